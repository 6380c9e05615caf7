//! Study that starts from AUTO-07p solutions.

use super::mapping::{Complaint, Mapping, complaint};
use super::{Labelled, Names};
use foldline::contract::VectorField;
use foldline::diagram::{Cycle, Solution};
use foldline::explore::mismatch;
use foldline::model::Model;
use std::fmt::Write;

/// Degree of the polynomials with which the residual of a cycle is evaluated.
const DEGREE: usize = 4;
/// Largest accepted residual of the equations, relative to their size.
const LARGEST_MISMATCH: f64 = 1e-2;
/// Largest accepted difference between the last and first state of a cycle, relative to the extent of the component.
const LARGEST_GAP: f64 = 1e-3;

/// Chosen solution, with the names and numbers that belong to it.
pub struct Chosen<'a> {
    /// Name of its file, for the description of the seed.
    pub file: &'a str,
    /// The solution.
    pub solution: &'a Labelled,
    /// Names and range of its branch.
    pub names: &'a Names,
    /// Numbers of the states and parameters of the model.
    pub mapping: Mapping,
}

/// Returns the text of a study in which each solution is a seed from which a branch starts.
///
/// `model_file` is the path of the model as written in the study. Every solution is checked against the
/// equations.
///
/// # Errors
/// If a solution is neither an equilibrium nor a cycle, if its free parameter is not assigned to one of the model, or if
/// it does not satisfy the equations of the model.
pub fn study(model: &Model, model_file: &str, chosen: &[Chosen]) -> Result<String, Complaint> {
    let mut out = format!("# Starting points computed by AUTO-07p.\nmodel = {}\n", quoted(model_file));
    let mut taken: Vec<String> = Vec::new();
    for one in chosen {
        let label = one.solution.label;
        let name = crate::run_file::free_name(format!("label {label}"), &mut taken);
        let values = parameters(model, one)?;
        let text = written(model, one, &name, &values)?;
        out.push_str(&text);
    }
    Ok(out)
}

/// Values of all parameters of the model.
fn parameters(model: &Model, one: &Chosen) -> Result<Vec<f64>, Complaint> {
    let mut values = model.defaults();
    for (k, number) in one.mapping.parameters.iter().enumerate() {
        let Some(number) = number else { continue };
        values[k] = *one.solution.parameters.get(number.wrapping_sub(1)).ok_or_else(|| {
            let (name, count) = (&model.parameters[k].name, one.solution.parameters.len());
            complaint(
                format!("{name} is assigned to PAR({number}), but the solution has only {count} parameters"),
                "give another number in `--parameters`",
            )
        })?;
    }
    Ok(values)
}

fn written(model: &Model, one: &Chosen, name: &str, values: &[f64]) -> Result<String, Complaint> {
    let solution = one.solution;
    let label = solution.label;
    let first = solution.free.first().copied();
    let free = first.and_then(|number| one.mapping.parameters.iter().position(|own| *own == Some(number)));
    let Some(free) = free else {
        let number = first.unwrap_or(1);
        let known = model.parameters.first().map_or("NAME", |p| p.name.as_str());
        let message = format!(
            "the solution labelled {label} has the free parameter PAR({number}), whose name in the model is unknown"
        );
        return Err(complaint(
            message,
            format!("name it, as in `--parameters {number}={known}`, or add the file c.NAME or b.NAME that names it"),
        ));
    };
    // Value of the i-th state of the model at a node.
    let of = |node: usize, i: usize| solution.states[node * solution.dim() + one.mapping.states[i] - 1];
    let n = model.dim();
    let nodes: Vec<f64> = (0..solution.times.len())
        .flat_map(|node| (0..n).map(move |i| (node, i)))
        .map(|(node, i)| of(node, i))
        .collect();
    let (body, given) = match solution.lasts() {
        true => cycle(model, solution, &nodes)?,
        false => equilibrium(model, solution, &nodes)?,
    };
    held_against(model, values, solution, &given)?;
    let kind = solution.named().map_or(String::new(), |(letters, word)| format!(" ({letters}: {word})"));
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "\n[[seed]]\nname = {}\ndescription = {}",
        quoted(name),
        quoted(&format!("{}, label {label}{kind}", one.file))
    );
    let _ = writeln!(out, "[seed.parameters]");
    for (k, parameter) in model.parameters.iter().enumerate() {
        let (name, value) = (key(&parameter.name), decimal(values[k]));
        match one.mapping.parameters[k] {
            Some(number) => drop(writeln!(out, "{name} = {value} # PAR({number})")),
            None => drop(writeln!(out, "# {name} = {value} # as in the model; not named in AUTO's files")),
        }
    }
    let states = model.states.iter().zip(&one.mapping.states);
    let states: Vec<String> = states.map(|(own, number)| format!("{} = U({number})", own.name)).collect();
    let _ = writeln!(out, "# {}", states.join(", "));
    out.push_str(&body);
    let branch = if solution.lasts() { "cycles" } else { "equilibria" };
    let value = values[free];
    let around = [value - 0.5 * value.abs().max(1.0), value + 0.5 * value.abs().max(1.0)];
    let (range, whose) = match one.names.range.filter(|[low, high]| (*low..=*high).contains(&value)) {
        Some(range) => (range, "RL0 and RL1"),
        None => (around, "edit as needed"),
    };
    let [low, high] = range.map(decimal);
    let _ = writeln!(
        out,
        "\n[[branch]]\nname = {}\nfrom = {}\nfree = {}\nrange = [{low}, {high}] # {whose}",
        quoted(&format!("{branch} from {name}")),
        quoted(name),
        quoted(&model.parameters[free].name)
    );
    Ok(out)
}

fn equilibrium(model: &Model, solution: &Labelled, state: &[f64]) -> Result<(String, Solution), Complaint> {
    let label = solution.label;
    if model.forced() {
        let message = format!("the solution labelled {label} is an equilibrium, but a forced model has no equilibria");
        return Err(complaint(message, "give a model without forcing"));
    }
    if !matches!(solution.problem, None | Some(0 | 1 | 11)) {
        return Err(other_kind(solution));
    }
    let mut out = String::from("[seed.state]\n");
    for (own, value) in model.states.iter().zip(state) {
        let _ = writeln!(out, "{} = {}", key(&own.name), decimal(*value));
    }
    Ok((out, Solution::Equilibrium(state.to_vec())))
}

fn cycle(model: &Model, solution: &Labelled, states: &[f64]) -> Result<(String, Solution), Complaint> {
    let (label, n, count) = (solution.label, model.dim(), solution.times.len());
    if model.forced() {
        let message = format!("the solution labelled {label} is a cycle, but the model is forced");
        return Err(complaint(
            message,
            "in a study of a forced model, start with `attractor = \"cycle\"` or `state = { … }`; see the book",
        ));
    }
    if !matches!(solution.problem, None | Some(2)) {
        return Err(other_kind(solution));
    }
    for (i, own) in model.states.iter().enumerate() {
        let values = || states.iter().skip(i).step_by(n).copied();
        let extent = values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
        let gap = (states[(count - 1) * n + i] - states[i]).abs();
        if gap > LARGEST_GAP * extent {
            let message = format!(
                "the solution labelled {label} does not close: `{}` ends {gap:.1e} from where it begins",
                own.name
            );
            return Err(complaint(
                message,
                "only equilibria and cycles can be imported, not boundary-value problems or connecting orbits",
            ));
        }
    }
    let period = solution.period().filter(|period| *period > 0.0).ok_or_else(|| {
        let message = format!("the solution labelled {label} has no positive period in PAR(11)");
        complaint(
            message,
            "only equilibria and cycles can be imported, not boundary-value problems or connecting \
                            orbits",
        )
    })?;
    let unordered = || {
        complaint(
            format!("the times of the solution labelled {label} do not increase from 0 to 1"),
            "copy the file again; AUTO writes increasing times",
        )
    };
    let given = Cycle::given(period, &solution.times, states, solution.degree, DEGREE).ok_or_else(unordered)?;
    let mut out = format!("[seed.cycle]\nperiod = {}\nthrough = {}\n", decimal(period), solution.degree);
    listed(&mut out, "times", solution.times.iter().copied());
    out.push_str("[seed.cycle.states]\n");
    for (i, own) in model.states.iter().enumerate() {
        listed(&mut out, &key(&own.name), states.iter().skip(i).step_by(n).copied());
    }
    Ok((out, Solution::Cycle(given)))
}

fn other_kind(solution: &Labelled) -> Complaint {
    let (label, problem) = (solution.label, solution.problem.unwrap_or_default());
    let message = format!("the solution labelled {label} was computed with IPS = {problem}");
    complaint(message, "equilibria (IPS = 1) and cycles (IPS = 2) can be imported")
}

/// Checks that a solution satisfies the equations of the model.
fn held_against(model: &Model, values: &[f64], solution: &Labelled, given: &Solution) -> Result<(), Complaint> {
    let label = solution.label;
    let hint = "give a model with the same equations, and assign AUTO's numbers with `--parameters 1=NAME,…` and \
                `--states 1=NAME,…`";
    match mismatch(model, values, given) {
        Some((_, share)) if share <= LARGEST_MISMATCH => Ok(()),
        Some((component, share)) => {
            let name = &model.states[component].name;
            let message = format!(
                "the solution labelled {label} does not satisfy the model: the relative residual of the equation of \
                 `{name}` is {share:.1e}"
            );
            Err(complaint(message, hint))
        }
        None => Err(complaint(format!("the model is not finite on the solution labelled {label}"), hint)),
    }
}

fn listed(out: &mut String, name: &str, values: impl Iterator<Item = f64>) {
    let values: Vec<String> = values.map(decimal).collect();
    let lines: Vec<String> = values.chunks(6).map(|line| format!("  {},\n", line.join(", "))).collect();
    let _ = write!(out, "{name} = [\n{}]\n", lines.concat());
}

/// Returns the shortest decimal that reads back as the same number, in TOML syntax.
fn decimal(value: f64) -> String {
    format!("{value:?}")
}

fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

fn key(name: &str) -> String {
    let plain = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if plain { name.to_string() } else { quoted(name) }
}
