//! Answers to design questions.

use super::Kind;

/// Answer to a design question: the least or greatest value of a parameter beyond which a branch has no solution, no stable
/// one, or none with a quantity at or above a bound, over a range of the branch's own parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// Name of the question.
    pub name: String,
    /// Name of the branch.
    pub of: String,
    /// Index of the branch's parameter.
    pub free: usize,
    /// Index of the design parameter.
    pub vary: usize,
    /// Range of the branch's parameter.
    pub range: [f64; 2],
    /// True if the greatest value is sought, below which the condition is met; false for the least, above which it is.
    pub greatest: bool,
    /// Condition, in words: `no motion`, `no stable motion`, `r_max < 1.2`.
    pub wanted: String,
    /// The value, if one was found.
    pub answer: Option<Answer>,
    /// Reasons why the question is not answered; empty if it is. With an answer, they say why that is only a bound.
    pub reasons: Vec<String>,
    /// Checks made on both sides of the answer, in sentences.
    pub checks: Vec<String>,
}

impl Design {
    /// True if the question is answered.
    pub fn answered(&self) -> bool {
        self.answer.is_some() && self.reasons.is_empty()
    }
}

/// Value of a design parameter, and the point that decides it.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Value of the design parameter.
    pub value: f64,
    /// Bound on its error.
    pub error: f64,
    /// Value of the branch's parameter at which it is attained.
    pub at: f64,
    /// Position of that value in the range.
    pub binds: Binds,
    /// Kind of the boundary there: `fold`, `period-doubling`, … or `mark` for a bound on a quantity.
    pub kind: Kind,
    /// Name of the curve on which the point lies.
    pub curve: String,
}

/// Position in a range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binds {
    /// Inside, at an extremum of the curve.
    Inside,
    /// At the lower end of the range.
    LowerEnd,
    /// At the upper end of the range.
    UpperEnd,
}

impl Binds {
    /// All positions.
    pub const ALL: [Binds; 3] = [Binds::Inside, Binds::LowerEnd, Binds::UpperEnd];

    /// The name used in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Binds::Inside => "inside",
            Binds::LowerEnd => "lower end of the range",
            Binds::UpperEnd => "upper end of the range",
        }
    }

    /// Returns the position of that name.
    pub fn from_name(name: &str) -> Option<Binds> {
        Binds::ALL.into_iter().find(|own| own.name() == name)
    }
}
