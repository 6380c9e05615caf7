//! Coefficients of a normal form with their errors, and why there are none.

/// Coefficients of a normal form.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coefficients {
    /// Named by [`crate::diagram::Kind::coefficients`].
    pub values: Vec<f64>,
    /// Bounds on their errors.
    pub errors: Vec<f64>,
    /// Why there are none, or why they decide nothing; empty where there is nothing to say.
    pub remark: String,
}

impl Coefficients {
    /// No coefficients, for a reason.
    pub fn none(why: impl std::fmt::Display) -> Coefficients {
        Coefficients { remark: format!("no coefficients: {why}"), ..Coefficients::default() }
    }
}
