//! "Did you mean …?"

pub use foldline::model::{nearest, suggest};
