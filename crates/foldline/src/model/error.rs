//! Errors in a model, with hints for correcting them.

use super::callable::Callables;
use super::function::known_elsewhere_as;
use super::nearest::suggest;
use super::unsupported::unsupported;
use std::fmt;
use std::ops::Range;

/// Part of a [`super::ModelSource`]; numbers are positions in its lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Item {
    /// The model as a whole.
    Model,
    /// A parameter.
    Parameter(usize),
    /// A named intermediate expression.
    Definition(usize),
    /// A state.
    State(usize),
    /// The equation of a state.
    Equation(usize),
    /// An output.
    Output(usize),
    /// The frequency or period of the forcing.
    Forcing,
    /// The pair of states that forms the complex signal.
    Whirl,
    /// A constant.
    Constant(usize),
    /// A function of the model.
    Function(usize),
    /// A table.
    Table(usize),
    /// An entry of the mass matrix.
    Mass(usize),
    /// A conserved total.
    Total(usize),
    /// A condition at the ends of the interval.
    Condition(usize),
    /// A condition on an integral over the interval.
    Integral(usize),
    /// The parameters determined by the conditions.
    Solve,
    /// An event.
    Event(usize),
    /// The parameter that makes a smoothed law sharp.
    Smoothing,
}

/// Field of an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Field {
    /// Name.
    Name,
    /// Expression.
    Expression,
    /// Unit.
    Unit,
    /// Value of a parameter.
    Value,
    /// Characteristic size of a state.
    Scale,
    /// Sampling range of a state.
    Range,
    /// Period of a state that is an angle.
    Period,
    /// Number of elements.
    Count,
    /// Name of the index.
    Index,
    /// Value beyond the first element, by position in the list.
    Before(usize),
    /// Value beyond the last element, by position in the list.
    After(usize),
    /// Value of a state after an event, by position in the list.
    Set(usize),
    /// Condition on the states of an event.
    Allowed,
}

/// Error in a model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ModelError {
    /// Part of the model.
    pub item: Item,
    /// Field of that part.
    pub field: Field,
    /// Name of the part, for messages without a file.
    pub name: String,
    /// Byte range within the expression, if the error has a position there.
    pub span: Option<Range<usize>>,
    /// Description of the error.
    pub message: String,
    /// Suggested correction.
    pub hint: String,
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let part = match self.item {
            Item::Model => "the model",
            Item::Parameter(_) => "the parameter",
            Item::Definition(_) => "the definition",
            Item::State(_) => "the state",
            Item::Equation(_) => "the equation of",
            Item::Output(_) => "the output",
            Item::Forcing => "the forcing",
            Item::Whirl => "whirl",
            Item::Constant(_) => "the constant",
            Item::Function(_) => "the function",
            Item::Table(_) => "the table",
            Item::Mass(_) => "the mass of",
            Item::Total(_) => "the total",
            Item::Condition(_) => "the boundary condition",
            Item::Integral(_) => "the integral condition",
            Item::Solve => "solve",
            Item::Event(_) => "the event",
            Item::Smoothing => "the parameter of `smoothing`",
        };
        write!(f, "{part}")?;
        if !self.name.is_empty() {
            write!(f, " `{}`", self.name)?;
        }
        if let Some(span) = &self.span {
            write!(f, ", byte {}", span.start + 1)?;
        }
        write!(f, ": {} ({})", self.message, self.hint)
    }
}

impl std::error::Error for ModelError {}

/// Error inside an expression.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Complaint {
    pub span: Range<usize>,
    pub message: String,
    pub hint: String,
    /// Unknown function name; the hint can be improved once all names are known.
    pub function: Option<String>,
}

impl Complaint {
    pub fn new(span: Range<usize>, message: impl Into<String>, hint: impl Into<String>) -> Complaint {
        Complaint { span, message: message.into(), hint: hint.into(), function: None }
    }

    pub fn unknown_function(name: String, span: Range<usize>, callables: &Callables) -> Complaint {
        let nothing = format!("there is no function `{name}`");
        let (message, hint) = match (known_elsewhere_as(&name), unsupported(&name)) {
            (Some(advice), _) => (nothing, advice.to_string()),
            (None, Some(kind)) => (format!("{nothing}: {}", kind.message), kind.instead.to_string()),
            (None, None) => (nothing, suggest(&name, &callables.names())),
        };
        Complaint { span, message, hint, function: Some(name) }
    }
}
