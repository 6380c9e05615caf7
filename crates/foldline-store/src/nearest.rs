//! Suggestions for misspelt names.

pub use foldline::model::{nearest, suggest};
