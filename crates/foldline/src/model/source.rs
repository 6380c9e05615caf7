//! A model as it is written: names, numbers and expressions in text.

use super::table::Table;

/// A parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its unit; `1` where it has none.
    pub unit: String,
    /// What it is.
    pub description: String,
    /// Its value unless a study says otherwise.
    pub value: f64,
    /// Characteristic size, positive; where none is given it follows from the value and the ranges of a study.
    pub scale: Option<f64>,
    /// Repetition over an index.
    pub repeat: Option<Repeat>,
    /// Value of each element of a repeated parameter; all have `value` where the list is empty.
    pub values: Vec<f64>,
}

/// A state component.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Its name.
    pub name: String,
    /// Its unit; `1` where it has none.
    pub unit: String,
    /// What it is.
    pub description: String,
    /// Characteristic size, positive: errors and lengths of this component are measured in it. Where none is given it follows
    /// from the range, else from the solutions.
    pub scale: Option<f64>,
    /// Smallest and largest initial value when initial states are sampled; where none is given, twice the scale to both sides of 0.
    pub range: Option<[f64; 2]>,
    /// For an angle its period: states that differ by whole periods are one.
    pub period: Option<f64>,
    /// Repetition over an index.
    pub repeat: Option<Repeat>,
}

/// A scalar of the state.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// Its name.
    pub name: String,
    /// Its unit; `1` where it has none.
    pub unit: String,
    /// What it is.
    pub description: String,
    /// How it is computed.
    pub expression: String,
    /// Repetition over an index.
    pub repeat: Option<Repeat>,
}

/// A name for an expression: an intermediate result, or the right-hand side of the equation of a state.
#[derive(Clone, Debug, PartialEq)]
pub struct Definition {
    /// The name, or the state.
    pub name: String,
    /// The expression.
    pub expression: String,
    /// Repetition over an index; an equation is repeated as its state is.
    pub repeat: Option<Repeat>,
}

/// A number that no study changes, usable wherever an expression is.
#[derive(Clone, Debug, PartialEq)]
pub struct Constant {
    /// Its name.
    pub name: String,
    /// Its unit; `1` where it has none.
    pub unit: String,
    /// Its value.
    pub value: f64,
}

/// A function defined by the model; calls are replaced by its expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Function {
    /// Its name.
    pub name: String,
    /// Names of its arguments.
    pub arguments: Vec<String>,
    /// Its value.
    pub expression: String,
}

/// Repetition of a quantity over an index that runs from 1 to a count.
#[derive(Clone, Debug, PartialEq)]
pub struct Repeat {
    /// Number of elements.
    pub count: usize,
    /// Name of the index in expressions.
    pub index: String,
    /// Values beyond the first and the last element.
    pub ends: Ends,
}

/// Values of a repeated quantity beyond its first and its last element.
#[derive(Clone, Debug, PartialEq)]
pub enum Ends {
    /// Expressions for the elements 0, -1, … and for the elements n + 1, n + 2, …; elements without an expression do not exist.
    Given {
        /// Before the first element, nearest first.
        before: Vec<String>,
        /// After the last element, nearest first.
        after: Vec<String>,
    },
    /// The first element follows the last.
    Periodic,
    /// Time derivatives of the values beyond the ends of the family of that name.
    RateOf(String),
}

/// An entry of the matrix M of M dy/dt = f.
#[derive(Clone, Debug, PartialEq)]
pub struct Mass {
    /// State whose equation is the row.
    pub row: String,
    /// State whose rate the entry multiplies.
    pub column: String,
    /// The entry.
    pub expression: String,
}

/// What `t` means in a model: how long a period of its forcing is.
#[derive(Clone, Debug, PartialEq)]
pub struct Forcing {
    /// Whether the expression is the angular frequency, 2π over the period.
    pub is_frequency: bool,
    /// The frequency or the period, in terms of parameters.
    pub expression: String,
}

/// A model as it is written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelSource {
    /// Its name.
    pub name: String,
    /// What it describes.
    pub description: String,
    /// Where it comes from.
    pub source: String,
    /// Unit of time; empty where the model does not state it.
    pub time: String,
    /// Numbers with names.
    pub constants: Vec<Constant>,
    /// Functions of the model, in any order.
    pub functions: Vec<Function>,
    /// Measured or tabulated functions of one argument.
    pub tables: Vec<Table>,
    /// Parameters, in the order in which they are numbered.
    pub parameters: Vec<Parameter>,
    /// The forcing, where expressions use the time `t`.
    pub forcing: Option<Forcing>,
    /// Intermediate expressions, in any order.
    pub definitions: Vec<Definition>,
    /// States, in the order in which they are numbered.
    pub states: Vec<State>,
    /// One equation for each state, in any order.
    pub equations: Vec<Definition>,
    /// Entries of the matrix that multiplies the rates; rows that are not mentioned are those of the unit matrix.
    pub mass: Vec<Mass>,
    /// Sums of states that keep their values.
    pub totals: Vec<Total>,
    /// Outputs, in the order in which they are numbered.
    pub outputs: Vec<Output>,
    /// The two states u, v that form the complex signal u + j v.
    pub whirl: Option<[String; 2]>,
}

/// A sum of states that keeps its value, which is a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Total {
    /// Its name.
    pub name: String,
    /// Its unit; `1` where it has none.
    pub unit: String,
    /// What it is.
    pub description: String,
    /// Its value.
    pub value: f64,
    /// The states times numbers.
    pub sum: String,
    /// The state that follows from it; where none is named, the largest of the sum.
    pub instead_of: Option<String>,
}

impl Total {
    /// A total without unit and description.
    pub fn new(name: &str, sum: &str, value: f64) -> Total {
        Total {
            name: name.into(),
            unit: "1".into(),
            description: String::new(),
            value,
            sum: sum.into(),
            instead_of: None,
        }
    }
}

impl Parameter {
    /// A parameter without unit and description.
    pub fn new(name: &str, value: f64) -> Parameter {
        Parameter {
            name: name.into(),
            unit: "1".into(),
            description: String::new(),
            value,
            scale: None,
            repeat: None,
            values: Vec::new(),
        }
    }
}

impl State {
    /// A state without unit, description, scale and range.
    pub fn new(name: &str) -> State {
        State {
            name: name.into(),
            unit: "1".into(),
            description: String::new(),
            scale: None,
            range: None,
            period: None,
            repeat: None,
        }
    }

    /// The characteristic size that the model states: the scale, else a radian of an angle, else a quarter of the width of the range.
    pub fn stated_scale(&self) -> Option<f64> {
        let radian = self.period.map(|period| period / std::f64::consts::TAU);
        self.scale.or(radian).or(self.range.map(|[low, high]| 0.25 * (high - low)))
    }

    /// Where initial values are sampled if the characteristic size is `scale`: in the range, else over a whole turn of an angle.
    pub fn range_at(&self, scale: f64) -> [f64; 2] {
        let half = self.period.map_or(2.0 * scale, |period| 0.5 * period);
        self.range.unwrap_or([-half, half])
    }
}

impl Output {
    /// An output without unit and description.
    pub fn new(name: &str, expression: &str) -> Output {
        Output {
            name: name.into(),
            unit: "1".into(),
            description: String::new(),
            expression: expression.into(),
            repeat: None,
        }
    }
}

impl Definition {
    /// `name` stands for `expression`.
    pub fn new(name: &str, expression: &str) -> Definition {
        Definition { name: name.into(), expression: expression.into(), repeat: None }
    }
}

impl Function {
    /// Name and arguments of a head such as `hill(x, K, n)`; `None` if `head` is not of that form.
    pub fn head(head: &str) -> Option<(String, Vec<String>)> {
        let (name, rest) = head.split_once('(')?;
        let inner = rest.trim_end().strip_suffix(')')?;
        let arguments: Vec<String> = inner.split(',').map(|a| a.trim().to_string()).collect();
        let word = |word: &str| !word.is_empty() && word.chars().all(|c| c.is_alphanumeric() || c == '_');
        let well_formed = word(name.trim()) && arguments.iter().all(|a| word(a));
        well_formed.then(|| (name.trim().to_string(), arguments))
    }
}

impl Repeat {
    /// Repetition over the index `i` without values beyond the ends.
    pub fn new(count: usize) -> Repeat {
        Repeat { count, index: "i".into(), ends: Ends::default() }
    }
}

impl Default for Ends {
    fn default() -> Ends {
        Ends::Given { before: Vec::new(), after: Vec::new() }
    }
}

impl Constant {
    /// A constant without unit.
    pub fn new(name: &str, value: f64) -> Constant {
        Constant { name: name.into(), unit: "1".into(), value }
    }
}

/// Name of the repeated quantity of which `x[3]` is an element: `x`.
pub(crate) fn element_of(name: &str) -> Option<&str> {
    name.split_once('[').map(|(family, _)| family)
}

/// Name of an element of a repeated quantity: `x[3]`.
pub(super) fn element_name(name: &str, k: i64) -> String {
    format!("{name}[{k}]")
}
