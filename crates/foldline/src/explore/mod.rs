//! From a plan to a diagram: follow → locate → switch → follow.

pub mod plan;

pub use plan::{AttractorKey, BranchPlan, Plan, SeedPlan, SeedSource, Start, Switching};
