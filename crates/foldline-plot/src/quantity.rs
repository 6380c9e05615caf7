//! What an axis shows.

use foldline::diagram::{Branch, Diagram, Point};
use foldline::model::Model;

/// A scalar of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The parameter of that index.
    Parameter(usize),
    /// The period; equilibria have none.
    Period,
    /// The smallest value of a state or output: states first, then outputs.
    Smallest(usize),
    /// The largest value of a state or output.
    Largest(usize),
}

impl Quantity {
    /// The quantity of that name: a parameter, `period`, `NAME_min`, `NAME_max`, or a state or output, which means its
    /// largest value. The error lists what there is.
    pub fn named(name: &str, model: &Model) -> Result<Quantity, String> {
        if let Some(index) = model.parameter_index(name) {
            return Ok(Quantity::Parameter(index));
        }
        let variable = |name: &str| {
            let output = || model.output_index(name).map(|i| model.states.len() + i);
            model.state_index(name).or_else(output)
        };
        if let Some(index) = variable(name) {
            return Ok(Quantity::Largest(index));
        }
        if let Some(index) = name.strip_suffix("_max").and_then(variable) {
            return Ok(Quantity::Largest(index));
        }
        if let Some(index) = name.strip_suffix("_min").and_then(variable) {
            return Ok(Quantity::Smallest(index));
        }
        if name == "period" {
            return Ok(Quantity::Period);
        }
        let parameters = model.parameters.iter().map(|p| p.name.as_str());
        let variables = model.states.iter().map(|s| &s.name).chain(model.outputs.iter().map(|o| &o.name));
        let variables: Vec<String> = variables.map(|name| format!("{name}_max, {name}_min")).collect();
        let parameters: Vec<&str> = parameters.collect();
        Err(format!("one of: {}, {}, period", parameters.join(", "), variables.join(", ")))
    }

    /// The free parameter of most branches.
    pub fn default_x(diagram: &Diagram) -> Quantity {
        let count = |free: usize| diagram.branches.iter().filter(|b: &&Branch| b.free == free).count();
        let frees = diagram.branches.iter().map(|b| b.free);
        // Of equally many the first: max_by_key would take the last.
        Quantity::Parameter(frees.rev().max_by_key(|free| count(*free)).unwrap_or(0))
    }

    /// The largest value of the first output, or of the first state where there is no output.
    pub fn default_y(model: &Model) -> Quantity {
        Quantity::Largest(if model.outputs.is_empty() { 0 } else { model.states.len() })
    }

    /// The value at a point, if it has one that can be drawn.
    pub fn of(self, point: &Point) -> Option<f64> {
        let value = match self {
            Quantity::Parameter(index) => point.parameters.get(index).copied(),
            Quantity::Period => point.solution.period(),
            Quantity::Smallest(index) => point.ranges.get(index).map(|range| range[0]),
            Quantity::Largest(index) => point.ranges.get(index).map(|range| range[1]),
        };
        value.filter(|v| v.is_finite())
    }

    /// The axis label: Greek names as letters, the unit in brackets where there is one.
    pub fn label(self, model: &Model) -> String {
        let variable = |index: usize| match index.checked_sub(model.states.len()) {
            None => model.states.get(index).map(|s| (s.name.as_str(), s.unit.as_str())),
            Some(output) => model.outputs.get(output).map(|o| (o.name.as_str(), o.unit.as_str())),
        };
        let ((name, unit), front) = match self {
            Quantity::Parameter(index) => {
                (model.parameters.get(index).map_or(("", ""), |p| (p.name.as_str(), p.unit.as_str())), "")
            }
            Quantity::Period => (("period", ""), ""),
            Quantity::Smallest(index) => (variable(index).unwrap_or_default(), "min "),
            Quantity::Largest(index) => (variable(index).unwrap_or_default(), "max "),
        };
        let unit = if matches!(unit, "" | "1" | "-") { String::new() } else { format!(" [{unit}]") };
        format!("{front}{}{unit}", with_greek(name))
    }
}

/// `Omega` → `Ω`, `omega_n` → `ω_n`.
fn with_greek(name: &str) -> String {
    const LETTERS: [(&str, &str); 24] = [
        ("alpha", "α"),
        ("beta", "β"),
        ("gamma", "γ"),
        ("delta", "δ"),
        ("epsilon", "ε"),
        ("zeta", "ζ"),
        ("eta", "η"),
        ("theta", "θ"),
        ("kappa", "κ"),
        ("lambda", "λ"),
        ("mu", "μ"),
        ("nu", "ν"),
        ("xi", "ξ"),
        ("rho", "ρ"),
        ("sigma", "σ"),
        ("tau", "τ"),
        ("phi", "φ"),
        ("chi", "χ"),
        ("psi", "ψ"),
        ("omega", "ω"),
        ("Omega", "Ω"),
        ("Gamma", "Γ"),
        ("Delta", "Δ"),
        ("Lambda", "Λ"),
    ];
    let (head, tail) = name.split_once('_').map_or((name, None), |(head, tail)| (head, Some(tail)));
    let head = LETTERS.iter().find(|(word, _)| *word == head).map_or(head, |(_, letter)| letter);
    tail.map_or(head.to_string(), |tail| format!("{head}_{tail}"))
}
