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
/// IPS of HomCont.
const CONNECTION: i64 = 9;

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
/// If no study starts from a solution of that kind, if its free parameter is not assigned to one of the model, or if it does not
/// satisfy the equations of the model.
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
    let of_model = |number: &usize| one.mapping.parameters.iter().position(|own| *own == Some(*number));
    let connects = solution.problem == Some(CONNECTION);
    let open = model.conditions() != [0, 0];
    // Of a connecting orbit the length of the interval may come first; parameters that conditions determine are not free.
    let usable = |number: &&usize| !open || of_model(number).is_none_or(|own| !model.determined().contains(&own));
    let free = match connects {
        true => solution.free.iter().find_map(of_model),
        false => solution.free.iter().find(usable).and_then(of_model),
    };
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
        _ if open => arc(model, solution, &nodes, values)?,
        true if connects => connection(model, one, &nodes)?,
        true if model.forced() => response(model, solution, &nodes, values)?,
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
    if connects {
        out.push_str(&curve(model, one, name, values, free)?);
        return Ok(out);
    }
    let branch = match solution.lasts() {
        _ if open => "solutions",
        true => "cycles",
        false => "equilibria",
    };
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
                "a boundary-value problem needs a model with `[interval]` and `[boundary]`",
            ));
        }
    }
    let period = duration(solution)?;
    let given = over(solution, states, period)?;
    let mut out = format!("[seed.cycle]\nperiod = {}\nthrough = {}\n", decimal(period), solution.degree);
    listed(&mut out, "times", solution.times.iter().copied());
    out.push_str("[seed.cycle.states]\n");
    for (i, own) in model.states.iter().enumerate() {
        listed(&mut out, &key(&own.name), states.iter().skip(i).step_by(n).copied());
    }
    Ok((out, Solution::Cycle(given)))
}

/// PAR(11), the duration of a cycle or of a connecting orbit.
fn duration(solution: &Labelled) -> Result<f64, Complaint> {
    solution.period().filter(|period| *period > 0.0).ok_or_else(|| {
        let message = format!("the solution labelled {} has no positive period in PAR(11)", solution.label);
        complaint(message, "a boundary-value problem needs a model with `[interval]` and `[boundary]`")
    })
}

/// The states `[times][n]` of a solution, over a duration.
fn over(solution: &Labelled, states: &[f64], duration: f64) -> Result<Cycle, Complaint> {
    Cycle::given(duration, &solution.times, states, solution.degree, DEGREE).ok_or_else(|| {
        complaint(
            format!("the times of the solution labelled {} do not increase from 0 to 1", solution.label),
            "copy the file again; AUTO writes increasing times",
        )
    })
}

/// First profile of a boundary-value problem, whose independent variable runs from 0 to 1 in AUTO.
fn arc(model: &Model, solution: &Labelled, states: &[f64], values: &[f64]) -> Result<(String, Solution), Complaint> {
    let n = model.dim();
    if !solution.lasts() || !matches!(solution.problem, None | Some(4 | 7)) {
        let message =
            format!("the model is a boundary-value problem, but the solution labelled {} is not", solution.label);
        return Err(complaint(message, "solutions of boundary-value problems have IPS = 4 or 7"));
    }
    let given = Cycle { forcing_periods: 1, ..over(solution, states, model.time_unit(values))? };
    let mut out = format!("[seed.profile]\nthrough = {}\n", solution.degree);
    listed(&mut out, "places", solution.times.iter().copied());
    out.push_str("[seed.profile.states]\n");
    for (i, own) in model.states.iter().enumerate() {
        listed(&mut out, &key(&own.name), states.iter().skip(i).step_by(n).copied());
    }
    Ok((out, Solution::Cycle(given)))
}

/// State at the beginning of a forcing period on a cycle of a forced model. The phase of the oscillator that forces it in AUTO is
/// unknown here; it is the one with which the cycle satisfies the equations best.
fn response(
    model: &Model,
    solution: &Labelled,
    states: &[f64],
    values: &[f64],
) -> Result<(String, Solution), Complaint> {
    /// Largest accepted deviation of the period from that of the forcing, relative.
    const ONE_PERIOD: f64 = 1e-3;
    /// Phases that are compared, and steps of the golden section from the best of them.
    const PHASES: usize = 64;
    const STEPS: usize = 50;
    /// Intervals of the shifted cycle.
    const INTERVALS: usize = 100;
    let label = solution.label;
    if !matches!(solution.problem, None | Some(2)) {
        return Err(other_kind(solution));
    }
    let (period, unit) = (duration(solution)?, model.time_unit(values));
    if (period / unit - 1.0).abs() > ONE_PERIOD {
        let message = format!(
            "the cycle labelled {label} has the period {period}, but that of the forcing is {unit} at its parameters"
        );
        return Err(complaint(
            message,
            "import a cycle of one forcing period, and switch to longer ones at its period doublings",
        ));
    }
    let whole = over(solution, states, period)?;
    let count = INTERVALS * DEGREE;
    let times: Vec<f64> = (0..=count).map(|k| k as f64 / count as f64).collect();
    let shifted = |phase: f64| -> Option<Cycle> {
        let states: Vec<f64> = times.iter().flat_map(|t| whole.state((t + phase).rem_euclid(1.0))).collect();
        Some(Cycle { forcing_periods: 1, ..Cycle::given(period, &times, &states, DEGREE, DEGREE)? })
    };
    let off = |phase: f64| {
        let found = shifted(phase).and_then(|cycle| mismatch(model, values, &Solution::Cycle(cycle)));
        found.map_or(f64::INFINITY, |(_, share)| share)
    };
    let first = (0..PHASES).map(|k| k as f64 / PHASES as f64).min_by(|a, b| off(*a).total_cmp(&off(*b))).unwrap_or(0.0);
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let [mut a, mut b] = [-1.0, 1.0].map(|side| first + side / PHASES as f64);
    for _ in 0..STEPS {
        let (left, right) = (b - golden * (b - a), a + golden * (b - a));
        *(if off(left) < off(right) { &mut b } else { &mut a }) = if off(left) < off(right) { right } else { left };
    }
    let lost = || complaint(format!("the cycle labelled {label} cannot be shifted"), "copy the file again");
    let found = shifted(0.5 * (a + b)).ok_or_else(lost)?;
    let mut out = String::from("[seed.state]\n");
    for (own, value) in model.states.iter().zip(found.state(0.0)) {
        let _ = writeln!(out, "{} = {}", key(&own.name), decimal(value));
    }
    Ok((out, Solution::Cycle(found)))
}

/// Numbers of the parameters in which AUTO stores the equilibria begin here.
const EQUILIBRIA: usize = 11;

/// The equilibrium that a connecting orbit leaves (`end` 0) or, if it is another one, at which it arrives (1).
fn stored(model: &Model, one: &Chosen, end: usize) -> Option<Vec<f64>> {
    let n = model.dim();
    let all = one.solution.parameters.get(EQUILIBRIA + end * n..EQUILIBRIA + (end + 1) * n)?;
    let state: Vec<f64> = one.mapping.states.iter().map(|number| all[number - 1]).collect();
    let values = parameters(model, one).ok()?;
    let found = mismatch(model, &values, &Solution::Equilibrium(state.clone()));
    found.filter(|(_, share)| *share <= LARGEST_MISMATCH).map(|_| state)
}

/// Largest distance of two states, relative to the extents of the components along an orbit.
fn apart(states: &[f64], a: &[f64], b: &[f64]) -> f64 {
    let n = a.len();
    let share = |i: usize| {
        let values = || states.iter().skip(i).step_by(n).copied();
        let extent = values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
        (a[i] - b[i]).abs() / extent.max(f64::MIN_POSITIVE)
    };
    (0..n).map(share).fold(0.0, f64::max)
}

/// The second equilibrium of a heteroclinic orbit.
fn arrival(model: &Model, one: &Chosen, states: &[f64]) -> Option<Vec<f64>> {
    let n = model.dim();
    let last = &states[states.len() - n..];
    let (from, to) = (stored(model, one, 0)?, stored(model, one, 1)?);
    (apart(states, last, &to) < apart(states, last, &from)).then_some(to)
}

/// The equilibrium that a connecting orbit leaves, and the orbit.
fn connection(model: &Model, one: &Chosen, states: &[f64]) -> Result<(String, Solution), Complaint> {
    let label = one.solution.label;
    if model.forced() {
        let message = format!("the solution labelled {label} is a connecting orbit, but the model is forced");
        return Err(complaint(message, "give a model without forcing"));
    }
    let Some(from) = stored(model, one, 0) else {
        let message = format!(
            "the parameters from PAR({}) on of the solution labelled {label} are no equilibrium of the model",
            EQUILIBRIA + 1
        );
        return Err(complaint(message, "HomCont stores the equilibrium there; compare the equations of the model"));
    };
    let orbit = over(one.solution, states, duration(one.solution)?)?;
    let mut out = String::from("[seed.state]\n");
    for (own, value) in model.states.iter().zip(&from) {
        let _ = writeln!(out, "{} = {}", key(&own.name), decimal(*value));
    }
    Ok((out, Solution::Cycle(orbit)))
}

/// The branch of the equilibrium and the curve of the orbit.
fn curve(model: &Model, one: &Chosen, name: &str, values: &[f64], free: usize) -> Result<String, Complaint> {
    let label = one.solution.label;
    let nodes: Vec<f64> = one
        .solution
        .states
        .chunks_exact(one.solution.dim())
        .flat_map(|state| one.mapping.states.iter().map(|number| state[number - 1]))
        .collect();
    let of_model = |number: &usize| one.mapping.parameters.iter().position(|own| *own == Some(*number));
    let others = one.solution.free.iter().filter_map(of_model).chain((0..model.parameters.len()).filter(|k| {
        // A parameter that the solution does not vary, if it varies no second one.
        one.mapping.parameters[*k].is_some()
    }));
    let Some(second) = others.into_iter().find(|k| *k != free) else {
        let message = format!("the connecting orbit labelled {label} has only one parameter, and curves need two");
        return Err(complaint(message, "name a second one, as in `--parameters 1=mu,2=nu`"));
    };
    let around = |k: usize, share: f64| {
        let reach = share * values[k].abs().max(1.0);
        [values[k] - reach, values[k] + reach].map(decimal).join(", ")
    };
    let heteroclinic = arrival(model, one, &nodes);
    let hold = if heteroclinic.is_some() { "heteroclinic" } else { "homoclinic" };
    let to = heteroclinic.map_or_else(String::new, |to| {
        let all: Vec<String> = model
            .states
            .iter()
            .zip(to)
            .map(|(own, value)| format!("{} = {}", key(&own.name), decimal(value)))
            .collect();
        format!("to = {{ {} }}\n", all.join(", "))
    });
    let (branch, first) = (quoted(&format!("equilibria from {name}")), quoted(&model.parameters[free].name));
    Ok(format!(
        "\n[[branch]]\nname = {branch}\nfrom = {}\nfree = {first}\nrange = [{}] # edit as needed\n\n\
         # The orbit is searched for next to this value, from the equilibrium.\n\
         [[curve]]\nname = {}\nhold = \"{hold}\"\nof = {branch}\nnear = {}\n{to}free = {}\nrange = [{}] # edit as needed\n",
        quoted(name),
        around(free, 0.1),
        quoted(&format!("orbits from {name}")),
        decimal(values[free]),
        quoted(&model.parameters[second].name),
        around(second, 0.5),
    ))
}

fn other_kind(solution: &Labelled) -> Complaint {
    let (label, problem) = (solution.label, solution.problem.unwrap_or_default());
    let message = format!("the solution labelled {label} was computed with IPS = {problem}");
    let hint = "equilibria (IPS = 1), cycles (IPS = 2) and connecting orbits (IPS = 9) can be imported, and with a model of a \
                boundary-value problem its solutions (IPS = 4, 7)";
    complaint(message, hint)
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
