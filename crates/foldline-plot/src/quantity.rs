//! Quantities on the axes.

use foldline::contract::VectorField;
use foldline::diagram::{Branch, Diagram, Point};
use foldline::model::Model;
use foldline::special::quantity::Quantity;

/// Returns the quantity of that name: one of [`Quantity::named`], or a state or output, which means its largest value;
/// a state of a map means all iterates.
///
/// # Errors
/// The names that exist.
pub fn axis(name: &str, model: &Model) -> Result<Quantity, String> {
    let output = || model.output_index(name).map(|index| model.states.len() + index);
    let iterate = || model.state_index(name).filter(|_| model.iterated()).map(|index| Quantity::Iterate(index, 0));
    let bare = || iterate().or_else(|| model.state_index(name).or_else(output).map(Quantity::Largest));
    let parameter = model.parameter_index(name).map(Quantity::Parameter);
    parameter.or_else(bare).or_else(|| Quantity::named(name, model)).ok_or_else(|| {
        let parameters = model.parameters.iter().map(|p| p.name.as_str());
        let variables = model.states.iter().map(|s| &s.name).chain(model.outputs.iter().map(|o| &o.name));
        let names: Vec<&str> =
            parameters.chain(variables.map(String::as_str)).chain(["period", "frequency", "norm"]).collect();
        format!(
            "one of: {}; or a state or output followed by _max, _min, _mean, _rms, _integral, _h1 or _h1_phase",
            names.join(", ")
        )
    })
}

/// Default horizontal axis: the free parameter of most points of branches. The runs of a homotopy count only if there
/// are no other branches. Without any branch, it is the parameter of the first survey or sweep.
pub fn default_x(diagram: &Diagram) -> Quantity {
    if let ([], Some(set)) = (&diagram.branches[..], diagram.responses.first()) {
        return Quantity::Parameter(set.free);
    }
    let followed: Vec<&Branch> = diagram.branches.iter().filter(|branch| !is_leg(branch)).collect();
    let counted = if followed.is_empty() { diagram.branches.iter().collect() } else { followed };
    let count = |free: usize| counted.iter().filter(|b| b.free == free).map(|b| b.points.len()).sum::<usize>();
    let frees = counted.iter().map(|b| b.free);
    // Ties go to the first parameter: max_by_key would take the last.
    Quantity::Parameter(frees.rev().max_by_key(|free| count(*free)).unwrap_or(0))
}

/// True if a branch is a run of a homotopy: the third run of `NAME` is called `NAME/3`.
fn is_leg(branch: &Branch) -> bool {
    branch.name.rsplit_once('/').is_some_and(|(_, number)| number.parse::<usize>().is_ok())
}

/// Default vertical axis: the largest value of the first output, or of the first state if there is no output; for a map
/// all iterates of that state.
pub fn default_y(model: &Model) -> Quantity {
    match model.outputs.is_empty() {
        true if model.iterated() => Quantity::Iterate(0, 0),
        true => Quantity::Largest(0),
        false => Quantity::Largest(model.states.len()),
    }
}

/// Value at a point, if it exists and can be drawn.
pub fn drawn(quantity: Quantity, point: &Point) -> Option<f64> {
    quantity.of(point).filter(|value| value.is_finite())
}

/// Axis label: Greek names as letters, the unit in brackets if there is one.
pub fn label(quantity: Quantity, model: &Model) -> String {
    let variable = |index: usize| match index.checked_sub(model.states.len()) {
        None => model.states.get(index).map(|s| (s.name.as_str(), s.unit.as_str())),
        Some(output) => model.outputs.get(output).map(|o| (o.name.as_str(), o.unit.as_str())),
    };
    let ((name, unit), front) = match quantity {
        Quantity::Parameter(index) => {
            (model.parameters.get(index).map_or(("", ""), |p| (p.name.as_str(), p.unit.as_str())), "")
        }
        Quantity::Period => (("period", model.time.as_str()), ""),
        Quantity::Norm(_) => (("rms of the state", ""), ""),
        Quantity::Iterate(index, _) => (variable(index).unwrap_or_default(), ""),
        Quantity::At(index, place) => {
            let (name, unit) = variable(index).unwrap_or_default();
            let unit = if matches!(unit, "" | "1" | "-") { String::new() } else { format!(" [{unit}]") };
            return format!("{}({}){unit}", with_greek(name), f64::from_bits(place));
        }
        Quantity::Smallest(index) => (variable(index).unwrap_or_default(), "min "),
        Quantity::Largest(index) => (variable(index).unwrap_or_default(), "max "),
        Quantity::Mean(index) => (variable(index).unwrap_or_default(), "mean "),
        Quantity::Rms(index) => (variable(index).unwrap_or_default(), "rms "),
        // Its unit, that of the variable times time, has no name.
        Quantity::Integral(index) => ((variable(index).unwrap_or_default().0, ""), "integral of "),
        Quantity::Frequency => (("frequency", ""), ""),
        other => {
            let names = model.states.iter().map(|s| &s.name).chain(model.outputs.iter().map(|o| &o.name));
            let name = other.name(&names.cloned().collect::<Vec<String>>());
            let unit = other.unit(model);
            let unit = if matches!(unit, "" | "1" | "-") { String::new() } else { format!(" [{unit}]") };
            return format!("{name}{unit}");
        }
    };
    let unit = if matches!(unit, "" | "1" | "-") { String::new() } else { format!(" [{unit}]") };
    format!("{front}{}{unit}", with_greek(name))
}

/// Replaces Greek names by letters: `Omega` → `Ω`, `omega_n` → `ω_n`.
pub fn with_greek(name: &str) -> String {
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
