//! A model as it is written: names, numbers and expressions in text.

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
}

/// A name for an expression: an intermediate result, or the right-hand side of the equation of a state.
#[derive(Clone, Debug, PartialEq)]
pub struct Definition {
    /// The name, or the state.
    pub name: String,
    /// The expression.
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
    /// Outputs, in the order in which they are numbered.
    pub outputs: Vec<Output>,
    /// The two states u, v that form the complex signal u + j v.
    pub whirl: Option<[String; 2]>,
}

impl Parameter {
    /// A parameter without unit and description.
    pub fn new(name: &str, value: f64) -> Parameter {
        Parameter { name: name.into(), unit: "1".into(), description: String::new(), value, scale: None }
    }
}

impl State {
    /// A state without unit, description, scale and range.
    pub fn new(name: &str) -> State {
        State { name: name.into(), unit: "1".into(), description: String::new(), scale: None, range: None }
    }

    /// The characteristic size that the model states: the scale, else a quarter of the width of the range.
    pub fn stated_scale(&self) -> Option<f64> {
        self.scale.or(self.range.map(|[low, high]| 0.25 * (high - low)))
    }

    /// Where initial values are sampled if the characteristic size is `scale`.
    pub fn range_at(&self, scale: f64) -> [f64; 2] {
        self.range.unwrap_or([-2.0 * scale, 2.0 * scale])
    }
}

impl Output {
    /// An output without unit and description.
    pub fn new(name: &str, expression: &str) -> Output {
        Output { name: name.into(), unit: "1".into(), description: String::new(), expression: expression.into() }
    }
}

impl Definition {
    /// `name` stands for `expression`.
    pub fn new(name: &str, expression: &str) -> Definition {
        Definition { name: name.into(), expression: expression.into() }
    }
}
