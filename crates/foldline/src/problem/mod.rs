//! What is the curve? Equilibria and cycles as zero problems.

pub mod gauss;
