//! Requests appended to the text of a study.
//!
//! **Idea.** Each action adds a block of lines at the end of the text, or an entry to `switch` of a branch. Everything
//! else, comments included, stays as it is. The result is read again, which ensures that a run can go on with it.

mod switch;

use super::{Study, added, parse_study};
use crate::diagnostic::Diagnostic;
use foldline::diagram::{Kind, Point};
use foldline::explore::BranchPlan;
use foldline::special::quantity::Quantity;

/// Number of values of a sweep, and of starts of a survey, that are suggested.
const SWEPT: usize = 61;
const STARTS: usize = 64;
/// Number of significant digits of values that need not be exact.
const DIGITS: usize = 9;

/// Point of a branch from which something is to be computed.
#[derive(Clone, Copy, Debug)]
pub struct Place<'p> {
    /// Name of the branch.
    pub branch: &'p str,
    /// The point.
    pub point: &'p Point,
    /// For a special point its kind, and its number among those of its kind on the branch, from 1.
    pub special: Option<(Kind, usize)>,
}

/// Computation from a point.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// A branch in another parameter.
    Continue {
        /// Name of the parameter.
        free: String,
    },
    /// The branch that leaves at the special point.
    Switch,
    /// The curve of such special points in a second parameter.
    Follow {
        /// Name of the second parameter.
        free: String,
    },
    /// The motion that starts from a state of the solution.
    Simulate,
    /// Simulation at successive values of the parameter.
    Sweep {
        /// True towards larger values.
        up: bool,
    },
    /// Simulation from many initial states at this value of the parameter.
    Survey,
}

/// A study with a request appended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Appended {
    /// Its text.
    pub text: String,
    /// First and last line that is new or changed, from 1.
    pub lines: [usize; 2],
    /// Name of what is added.
    pub name: String,
}

/// Reason why nothing was appended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// A sentence.
    Because(String),
    /// The study with the request would contain mistakes.
    Mistakes(Vec<Diagnostic>),
}

impl From<String> for Refusal {
    fn from(why: String) -> Refusal {
        Refusal::Because(why)
    }
}

/// Returns the study with one more request.
///
/// # Errors
/// The reason why this cannot be requested at that point.
pub fn append(study: &Study, place: &Place, action: &Action) -> Result<Appended, Refusal> {
    let found = match action {
        Action::Switch => switch::switched(study, place)?,
        _ => {
            let (name, block) = block(study, place, action)?;
            let gap = match study.text.trim_end().is_empty() {
                true => "",
                false if study.text.ends_with('\n') => "\n",
                false => "\n\n",
            };
            let first = (study.text.clone() + gap).lines().count() + 1;
            let lines = [first, first + block.lines().count() - 1];
            Appended { text: format!("{}{gap}{block}", study.text), lines, name }
        }
    };
    let longer = parse_study(&found.text, &study.file, &study.model_text, &study.model_file);
    let longer = longer.map_err(Refusal::Mistakes)?;
    added(study, &longer)?;
    Ok(found)
}

/// Plan of the branch of the study on which a point lies, or from which its branch was switched to.
fn root<'s>(study: &'s Study, branch: &str) -> Result<&'s BranchPlan, String> {
    let below = |own: &&BranchPlan| {
        branch == own.name || branch.strip_prefix(own.name.as_str()).is_some_and(|rest| rest.starts_with('/'))
    };
    let all = study.plan.branches.iter().filter(below);
    all.max_by_key(|own| own.name.len()).ok_or_else(|| {
        let curve = study.plan.curves.iter().any(|own| own.name == branch);
        match curve {
            true => format!("{branch} is a curve in two parameters; branches and sweeps start at its ends only"),
            false => format!("{branch} is not a `[[branch]]` of the study, nor switched to from one"),
        }
    })
}

fn block(study: &Study, place: &Place, action: &Action) -> Result<(String, String), String> {
    let model = &study.model;
    let parameter = |name: &str| {
        let index = model.parameter_index(name).ok_or_else(|| format!("the model has no parameter {name}"))?;
        Ok::<usize, String>(index)
    };
    let Place { branch, point, special } = place;
    let values = &point.parameters;
    match action {
        Action::Continue { free } => {
            let from = from(study, place)?;
            let index = parameter(free)?;
            let name = unused(study, &format!("{} in {free}", spoken(branch)));
            let range = around(*values.get(index).unwrap_or(&0.0));
            let lines =
                format!("[[branch]]\nname = {}\nfrom = {from}\nfree = {}\nrange = {range}\n", text(&name), text(free));
            Ok((name, lines))
        }
        Action::Follow { free } => {
            let (kind, _) = special.ok_or("only special points are followed in two parameters")?;
            let plan = root(study, branch)?;
            let index = parameter(free)?;
            let name = unused(study, &format!("{} of {} in {free}", kind.name(), spoken(branch)));
            let near = number(*values.get(plan.free).unwrap_or(&0.0), DIGITS);
            let range = around(*values.get(index).unwrap_or(&0.0));
            let lines = format!(
                "[[curve]]\nname = {}\nhold = {}\nof = {}\nnear = {near}\nfree = {}\nrange = {range}\n",
                text(&name),
                text(kind.name()),
                text(branch),
                text(free)
            );
            Ok((name, lines))
        }
        Action::Simulate => {
            let (from, plan) = (from(study, place)?, root(study, branch)?);
            let (free, value) = (&model.parameters[plan.free].name, *values.get(plan.free).unwrap_or(&0.0));
            let name = unused(study, &format!("from {}", spoken(branch)));
            let value = number(value, DIGITS);
            let lines = format!(
                "[[sweep]]\nname = {}\nfrom = {from}\nfree = {}\nvalues = [{value}]\n",
                text(&name),
                text(free)
            );
            Ok((name, lines))
        }
        Action::Sweep { up } => {
            let (from, plan) = (from(study, place)?, root(study, branch)?);
            let (free, value) = (&model.parameters[plan.free].name, *values.get(plan.free).unwrap_or(&0.0));
            let end = plan.range[usize::from(*up)];
            let direction = if *up { "up" } else { "down" };
            if !end.is_finite() || (*up && end <= value) || (!*up && end >= value) {
                return Err(format!("the range of {} ends here; there is nowhere to sweep {direction}", plan.name));
            }
            let name = unused(study, &format!("{direction} from {}", spoken(branch)));
            let lines = format!(
                "[[sweep]]\nname = {}\nfrom = {from}\nfree = {}\nrange = [{}, {}]\ncount = {SWEPT}\n",
                text(&name),
                text(free),
                number(value, DIGITS),
                number(end, DIGITS)
            );
            Ok((name, lines))
        }
        Action::Survey => {
            let plan = root(study, branch).ok();
            let curve = study.plan.curves.iter().find(|own| own.name == *branch);
            let free = plan.map(|plan| plan.free).or(curve.map(|curve| curve.free)).unwrap_or(0);
            let (own, value) = (&model.parameters[free].name, *values.get(free).unwrap_or(&0.0));
            let value = number(value, DIGITS);
            let name = unused(study, &format!("attractors at {own} {}", number(value.parse().unwrap_or(0.0), 4)));
            let others = model.parameters.iter().zip(values.iter()).enumerate();
            let others = others.filter(|(k, (own, value))| *k != free && own.value != **value);
            let others = others.filter(|(k, _)| !foldline::contract::VectorField::determined(model).contains(k));
            let others: Vec<String> =
                others.map(|(_, (own, value))| format!("{} = {}", key(&own.name), number(*value, 17))).collect();
            let others = match others.is_empty() {
                true => String::new(),
                false => format!("parameters = {{ {} }}\n", others.join(", ")),
            };
            let lines = format!(
                "[[survey]]\nname = {}\n{others}free = {}\nvalues = [{value}]\nstarts = {STARTS}\n",
                text(&name),
                text(own)
            );
            Ok((name, lines))
        }
        Action::Switch => Err("a switch is no block".into()),
    }
}

/// Value of `from` that identifies a point: its parameter, and the largest value of one quantity, which distinguishes
/// points on either side of a fold.
fn from(study: &Study, place: &Place) -> Result<String, String> {
    let (model, plan) = (&study.model, root(study, place.branch)?);
    // A rounded value may lie beyond a fold.
    let digits = if place.special.is_some() { 17 } else { DIGITS };
    let mut near = Vec::new();
    if let (Some(own), Some(value)) = (model.parameters.get(plan.free), place.point.parameters.get(plan.free)) {
        near.push(format!("{} = {}", key(&own.name), number(*value, digits)));
    }
    let first = model.outputs.first().map(|own| &own.name).or(model.states.first().map(|own| &own.name));
    let second = first.map(|name| format!("{name}_max"));
    if let Some((name, quantity)) = second.and_then(|name| Quantity::named(&name, model).map(|found| (name, found)))
        && let Some(value) = quantity.of(place.point).filter(|value| value.is_finite())
    {
        near.push(format!("{} = {}", key(&name), number(value, DIGITS)));
    }
    Ok(format!("{{ branch = {}, near = {{ {} }} }}", text(place.branch), near.join(", ")))
}

/// Range around a value that is suggested for a parameter.
fn around(value: f64) -> String {
    let [low, high] = match value {
        0.0 => [-1.0, 1.0],
        value if value > 0.0 => [0.5 * value, 2.0 * value],
        value => [2.0 * value, 0.5 * value],
    };
    format!("[{}, {}]", number(low, 4), number(high, 4))
}

/// Number with so many significant digits, in the shortest form.
fn number(value: f64, digits: usize) -> String {
    let rounded = format!("{value:.*e}", digits.clamp(1, 17) - 1).parse::<f64>().unwrap_or(value);
    format!("{rounded:?}").strip_suffix(".0").map_or_else(|| format!("{rounded:?}"), str::to_string)
}

/// Name of a branch without slashes, which are reserved for branches that are switched to.
fn spoken(branch: &str) -> String {
    branch.replace('/', " ")
}

/// The first of `name`, `name 2`, `name 3`, … that the study does not use.
fn unused(study: &Study, name: &str) -> String {
    let plan = &study.plan;
    let taken: Vec<&String> = plan
        .seeds
        .iter()
        .map(|own| &own.name)
        .chain(plan.branches.iter().map(|own| &own.name))
        .chain(plan.curves.iter().map(|own| &own.name))
        .chain(plan.homotopies.iter().map(|own| &own.name))
        .chain(plan.explorations.iter().map(|own| &own.name))
        .chain(plan.surveys.iter().map(|own| &own.name))
        .chain(plan.sweeps.iter().map(|own| &own.name))
        .collect();
    let numbered = (2..).map(|k| format!("{name} {k}"));
    let mut all = std::iter::once(name.to_string()).chain(numbered);
    all.find(|name| !taken.contains(&name)).unwrap_or_else(|| name.to_string())
}

/// String of TOML.
fn text(text: &str) -> String {
    toml::Value::String(text.to_string()).to_string()
}

/// Key of TOML, in quotes if necessary.
fn key(name: &str) -> String {
    let bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-'));
    if bare { name.to_string() } else { text(name) }
}
