//! Other programs: AUTO-07p and SciPy.

use crate::workplace::Part;

/// The parts, in the order of the report.
pub const PARTS: [(&str, Part); 0] = [];
