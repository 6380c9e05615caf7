//! Normal-form coefficients with their errors, or the reason why they are missing.

/// Coefficients of a normal form.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coefficients {
    /// Values, in the order of [`crate::diagram::Kind::coefficients`].
    pub values: Vec<f64>,
    /// Bounds on their errors.
    pub errors: Vec<f64>,
    /// Reason why the coefficients are missing or inconclusive; otherwise empty.
    pub remark: String,
}

impl Coefficients {
    /// Missing coefficients, with the reason.
    pub fn none(why: impl std::fmt::Display) -> Coefficients {
        Coefficients { remark: format!("no coefficients: {why}"), ..Coefficients::default() }
    }
}
