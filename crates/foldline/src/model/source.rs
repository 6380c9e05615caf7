//! Model as written: names, numbers and expressions in text form.

use super::table::Table;

/// Parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name.
    pub name: String,
    /// Unit; `1` if dimensionless.
    pub unit: String,
    /// Description.
    pub description: String,
    /// Default value; a study may override it.
    pub value: f64,
    /// Characteristic size, positive; otherwise derived from the value and the ranges of a study.
    pub scale: Option<f64>,
    /// Repetition over an index.
    pub repeat: Option<Repeat>,
    /// Value of each element of a repeated parameter; if empty, all elements have `value`.
    pub values: Vec<f64>,
    /// Uncertainty of the value.
    pub spread: Option<Spread>,
}

/// Distribution of an uncertain parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spread {
    /// Normal about the value of the parameter, with this standard deviation.
    Normal(f64),
    /// Uniform between two values.
    Uniform([f64; 2]),
}

/// State component.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Name.
    pub name: String,
    /// Unit; `1` if dimensionless.
    pub unit: String,
    /// Description.
    pub description: String,
    /// Characteristic size, positive: errors and lengths of this component are measured in it. Otherwise derived from
    /// the range, else from the solutions.
    pub scale: Option<f64>,
    /// Smallest and largest initial value for sampling; by default twice the scale on either side of 0, for an angle a
    /// full turn.
    pub range: Option<[f64; 2]>,
    /// Period, for an angle: states that differ by whole periods are identified.
    pub period: Option<f64>,
    /// Repetition over an index.
    pub repeat: Option<Repeat>,
}

/// Scalar function of the state.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// Name.
    pub name: String,
    /// Unit; `1` if dimensionless.
    pub unit: String,
    /// Description.
    pub description: String,
    /// Defining expression.
    pub expression: String,
    /// Repetition over an index.
    pub repeat: Option<Repeat>,
}

/// Name for an expression: an intermediate result, or the right-hand side of the equation of a state.
#[derive(Clone, Debug, PartialEq)]
pub struct Definition {
    /// Name, or the state of an equation.
    pub name: String,
    /// Expression.
    pub expression: String,
    /// Repetition over an index; an equation is repeated with its state.
    pub repeat: Option<Repeat>,
}

/// Number that no study changes, usable anywhere in an expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Constant {
    /// Name.
    pub name: String,
    /// Unit; `1` if dimensionless.
    pub unit: String,
    /// Value.
    pub value: f64,
}

/// Function defined by the model; calls are replaced by its expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Function {
    /// Name.
    pub name: String,
    /// Names of the arguments.
    pub arguments: Vec<String>,
    /// Defining expression.
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
    /// Expressions for the elements 0, -1, … and for the elements n + 1, n + 2, …; elements without an expression do
    /// not exist.
    Given {
        /// Before the first element, nearest first.
        before: Vec<String>,
        /// After the last element, nearest first.
        after: Vec<String>,
    },
    /// The first element follows the last.
    Periodic,
    /// Time derivatives of the values beyond the ends of the named family.
    RateOf(String),
}

/// Entry of the matrix M of M dy/dt = f.
#[derive(Clone, Debug, PartialEq)]
pub struct Mass {
    /// State whose equation is the row.
    pub row: String,
    /// State whose rate is multiplied by the entry.
    pub column: String,
    /// Entry.
    pub expression: String,
}

/// Forcing: defines the time `t` through its period.
#[derive(Clone, Debug, PartialEq)]
pub struct Forcing {
    /// True if the expression is the angular frequency, 2π over the period.
    pub is_frequency: bool,
    /// Frequency or period, in terms of parameters.
    pub expression: String,
}

/// Conditions that make the model a boundary-value problem. Its interval is [0, L], with L the period under
/// [`ModelSource::forcing`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Boundary {
    /// Name of the independent variable.
    pub variable: String,
    /// Expressions that vanish, in terms of the states at both ends, `x@0` and `x@1`.
    pub conditions: Vec<Definition>,
    /// Expressions whose integrals over the interval vanish.
    pub integrals: Vec<Definition>,
    /// Parameters that are determined along with the solution: one for each condition beyond the number of states.
    pub solve: Vec<String>,
}

/// Direction in which an expression passes zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Passing {
    /// From negative to positive.
    #[default]
    Up,
    /// From positive to negative.
    Down,
    /// Either.
    Either,
}

impl Passing {
    /// Sign of the change; 0 for either.
    pub fn sign(self) -> f64 {
        match self {
            Passing::Up => 1.0,
            Passing::Down => -1.0,
            Passing::Either => 0.0,
        }
    }
}

/// Event at which states jump, such as an impact.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Event {
    /// Name.
    pub name: String,
    /// Expression at whose zero it occurs.
    pub when: String,
    /// Direction in which that passes zero.
    pub direction: Passing,
    /// New values of states, in terms of those before; other states keep their values.
    pub set: Vec<Definition>,
    /// Comparison that holds along every motion.
    pub allowed: Option<String>,
}

/// Parameter whose limit turns a smoothed law into the exact one.
#[derive(Clone, Debug, PartialEq)]
pub struct Smoothing {
    /// Name of the parameter.
    pub parameter: String,
    /// True if the limit is 0; otherwise it is infinity.
    pub to_zero: bool,
}

/// Treatment of the places at which f or its derivatives jump.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Contact {
    /// They are located.
    #[default]
    Exact,
    /// They are not: polynomials extend across them.
    SmoothedOver,
    /// The exact law of a smoothed one takes its place; see [`ModelSource::smoothing`].
    Limit,
}

/// Model as written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelSource {
    /// Name.
    pub name: String,
    /// Description.
    pub description: String,
    /// Origin, such as a publication.
    pub source: String,
    /// Unit of time; empty if the model does not state it.
    pub time: String,
    /// Named constants.
    pub constants: Vec<Constant>,
    /// Functions of the model, in any order.
    pub functions: Vec<Function>,
    /// Measured or tabulated functions of one argument.
    pub tables: Vec<Table>,
    /// Parameters, in the order in which they are numbered.
    pub parameters: Vec<Parameter>,
    /// Forcing, if expressions use the time `t`.
    pub forcing: Option<Forcing>,
    /// A second forcing, whose frequency need not have a ratio to that of the first, and the name of the parameter that
    /// is its phase in turns.
    pub second: Option<(Forcing, String)>,
    /// Intermediate expressions, in any order.
    pub definitions: Vec<Definition>,
    /// States, in the order in which they are numbered.
    pub states: Vec<State>,
    /// One equation for each state, in any order.
    pub equations: Vec<Definition>,
    /// Conditions at the ends of an interval; `None` unless the model is a boundary-value problem.
    pub boundary: Option<Boundary>,
    /// Events at which states jump.
    pub events: Vec<Event>,
    /// Parameter that makes a smoothed law sharp.
    pub smoothing: Option<Smoothing>,
    /// True for a map: the equations give the next state instead of the rate.
    pub map: bool,
    /// Entries of the matrix that multiplies the rates; rows without entries are those of the identity.
    pub mass: Vec<Mass>,
    /// Conserved sums of states.
    pub totals: Vec<Total>,
    /// Outputs, in the order in which they are numbered.
    pub outputs: Vec<Output>,
    /// The two states u, v that form the complex signal u + j v.
    pub whirl: Option<[String; 2]>,
}

/// Conserved sum of states, whose value is a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Total {
    /// Name.
    pub name: String,
    /// Unit; `1` if dimensionless.
    pub unit: String,
    /// Description.
    pub description: String,
    /// Value.
    pub value: f64,
    /// Linear combination of states.
    pub sum: String,
    /// State to eliminate; by default the one of the sum with the largest scale.
    pub instead_of: Option<String>,
}

impl Total {
    /// Total without unit and description.
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
    /// Parameter without unit and description.
    pub fn new(name: &str, value: f64) -> Parameter {
        Parameter {
            name: name.into(),
            unit: "1".into(),
            description: String::new(),
            value,
            scale: None,
            repeat: None,
            values: Vec::new(),
            spread: None,
        }
    }
}

impl State {
    /// State without unit, description, scale and range.
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

    /// Characteristic size stated by the model: the scale, else one radian of an angle, else a quarter of the width of
    /// the range.
    pub fn stated_scale(&self) -> Option<f64> {
        let radian = self.period.map(|period| period / std::f64::consts::TAU);
        self.scale.or(radian).or(self.range.map(|[low, high]| 0.25 * (high - low)))
    }

    /// Sampling interval for initial values if the characteristic size is `scale`: the range, else a full turn of an
    /// angle, else ±2 `scale`.
    pub fn range_at(&self, scale: f64) -> [f64; 2] {
        let half = self.period.map_or(2.0 * scale, |period| 0.5 * period);
        self.range.unwrap_or([-half, half])
    }
}

impl Output {
    /// Output without unit and description.
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
    /// Defines `name` as `expression`.
    pub fn new(name: &str, expression: &str) -> Definition {
        Definition { name: name.into(), expression: expression.into(), repeat: None }
    }
}

impl Function {
    /// Splits a head such as `hill(x, K, n)` into name and arguments; `None` if `head` is not of that form.
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
    /// Constant without unit.
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
