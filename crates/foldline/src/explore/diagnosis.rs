//! Diagnosis of a failed search for a first solution: the likely cause in the vector field, and a cure.
//!
//! **Idea.** Values of f at a few points of the sampling box reveal whether some combination of the states is
//! conserved. Then no equilibrium or cycle is isolated, and Newton's method does not converge.

use super::direct::{transient, turn};
use super::{System, symmetry};
use crate::attractors::{self, Exit, Limits};
use crate::contract::{Batch, Parameters};
use crate::diagram::{Ending, Point, Shown};
use crate::linalg::max_abs;
use crate::model::{conserved_at, in_words, shifts};
use crate::problem::mesh::largest;
use crate::special::connection::in_first_turn;

/// Size, relative to the largest, below which the remainder of a column is rounding.
const ROUNDING: f64 = 1e-10;

/// Observations of trajectories that led to no solution.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seen<'a> {
    /// The given state, if any.
    pub state: Option<&'a [f64]>,
    /// True if some trajectories stopped because their steps became too small.
    pub stuck: bool,
    /// True if all trajectories grew without bound.
    pub all_escaped: bool,
    /// Exit of a trajectory that left the region in which f is defined.
    pub exit: Option<&'a Exit>,
    /// True if some trajectories did not settle, or settled to a motion that Newton's method does not confirm.
    pub unsettled: bool,
    /// True if the trajectory from the given state repeats itself, and Newton's method does not confirm that motion.
    pub repeats: bool,
    /// Attractors that samples reached instead of the one that is sought, if they explain its absence.
    pub instead: Option<Instead>,
}

/// Attractors reached instead of the one that is sought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Instead {
    /// Only equilibria, where a cycle is sought.
    Rest,
    /// Only cycles, where an equilibrium is sought.
    Oscillation,
}

/// Returns lines with a likely cause and a cure, to be appended to a message about what happened.
pub(super) fn of_no_start(system: &System, parameters: &[f64], seen: Seen) -> String {
    let stuck = seen.stuck;
    if system.field.iterated() {
        return of_map(system, &seen);
    }
    if let Some(why) = of_laws(system, parameters) {
        return why;
    }
    if seen.state.is_some_and(|state| is_equilibrium(system, parameters, state)) {
        return "\nlikely cause: the state is a singular equilibrium (a fold, a branch point or an isolated point), \
                where the direction of the branch is undefined\nwhat to do: start at another parameter value, on one \
                of the branches that meet there"
            .into();
    }
    if let Some(why) = seen.exit.map(|exit| of_exit(system, exit)) {
        return why;
    }
    if seen.unsettled
        && let Some(why) = of_family(system, parameters).or_else(|| of_slow_decay(system, parameters, seen.state))
    {
        return why;
    }
    let angles = if seen.unsettled { angles(system, parameters) } else { Vec::new() };
    match system.field.switch_count() {
        0 if stuck => "\nlikely cause: f is discontinuous, or too stiff for the integrator\nwhat to do: give a state \
                       near an equilibrium, or start at less extreme parameter values and follow the solution from \
                       there"
            .into(),
        n if stuck && n > 0 => "\nlikely cause: f is discontinuous (sign, heaviside, if, comparisons), and \
                                trajectories slide along two discontinuities at once, as where two bodies stick\n\
                                what to do: replace the jumps by smooth steps such as tanh(s*x), and continue the \
                                solution in s to the sharpness needed"
            .into(),
        _ if seen.all_escaped => "\nlikely cause: at these parameter values no attractor can be reached from the \
                                  ranges of the states\nwhat to do: change the parameters or the ranges of the \
                                  states, or give a state near the solution"
            .into(),
        _ if !angles.is_empty() => format!(
            "\nlikely cause: f has the period 2*pi in {}: a rotation never returns to its starting state\nwhat to \
             do: declare {0} as an angle, with `period = \"2*pi\"` in the model, so that a full rotation counts as a \
             cycle (docs/book/when-it-does-not-work.md)",
            angles.join(", ")
        ),
        _ if seen.repeats => format!(
            "\nlikely cause: the cycle needs a mesh of more than {} intervals, as a burst of several hundred spikes \
             does; or it is one of a family, or hardly attracts\nwhat to do: set a larger tolerance, change the parameters so that \
             the cycle becomes simpler and follow it from there, or follow the attractor by simulation with [[sweep]]",
            largest(system.field.dim(), 4)
        ),
        _ if seen.unsettled => {
            let rest = if system.field.switch_count() > 0 {
                "rest on a surface at which f jumps (a sliding equilibrium, such as a mass that sticks, is not followed), "
            } else {
                ""
            };
            format!(
                "\nlikely cause: a quasi-periodic or chaotic motion, {rest}or slow attraction: trajectories are limited to \
             {}\nwhat to do: raise the limit in the study, change the parameters or the ranges of the states, or \
             give a state",
                limits(system, seen.state.is_some())
            )
        }
        _ => match seen.instead {
            Some(Instead::Rest) => "\nlikely cause: at these parameter values trajectories come to rest\nwhat to do: write \
                                    `attractor = \"equilibrium\"`; or give the seed `parameters` at which the model \
                                    oscillates; or follow the equilibrium to a Hopf point, from which `switch = { hopf = 1 }` \
                                    leads to cycles, stable or not"
                .into(),
            Some(Instead::Oscillation) => "\nlikely cause: the equilibrium is unstable at these parameter values\nwhat to do: give \
                                           a `state` near it in place of the attractor: an equilibrium near a given state is found \
                                           whether it is stable or not; or give the seed `parameters` at which it is stable"
                .into(),
            None => "\nwhat to do: use more samples, change the parameters or the ranges of the states, or give a state".into(),
        },
    }
}

/// Cause and cure where orbits of a map led to no cycle.
fn of_map(system: &System, seen: &Seen) -> String {
    if let Some(why) = seen.exit.map(|exit| of_exit(system, exit)) {
        return why;
    }
    if seen.all_escaped {
        return "\nlikely cause: at these parameter values no attractor can be reached from the ranges of the states\n\
                what to do: change the parameters or the ranges of the states, or give a state near the cycle"
            .into();
    }
    "\nlikely cause: a quasi-periodic or chaotic motion, a cycle of more than 128 iterates, or slow attraction\nwhat to \
     do: change the parameters, or state the number of iterates, as in `periods = 3`, for which unstable cycles are found \
     by Newton's method as well"
        .into()
}

/// Names of the states on which f depends with the period 2π, judged at a few points of the sampling box.
fn angles(system: &System, parameters: &[f64]) -> Vec<String> {
    /// Number of points, and the share of the largest component of f that counts as no difference.
    const PLACES: usize = 8;
    const SAME: f64 = 1e-9;
    let n = system.field.dim();
    let f = |x: &[f64], time: f64| -> Vec<f64> {
        let mut f = vec![0.0; n];
        let at = Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters), times: &[time], signs: &[] };
        let at = if system.field.forced() { at } else { Batch { times: &[], ..at } };
        system.field.evaluate(at, &mut f);
        f
    };
    let starts = super::seeds::sampling(system, PLACES, 1, 1, 1e-6).starts();
    let same = |a: &[f64], b: &[f64]| {
        let size = max_abs(a).max(max_abs(b));
        size.is_finite() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME * size)
    };
    let is_angle = |i: usize| {
        let (mut depends, mut repeats) = (false, true);
        for (k, x) in starts.chunks_exact(n).enumerate() {
            let time = k as f64 / PLACES as f64;
            let moved = |by: f64| (0..n).map(|j| x[j] + if j == i { by } else { 0.0 }).collect::<Vec<f64>>();
            let here = f(x, time);
            depends |= !same(&here, &f(&moved(1.0), time));
            repeats &= same(&here, &f(&moved(std::f64::consts::TAU), time));
        }
        depends && repeats
    };
    let declared = |i: usize| system.field.periods().get(i).is_some_and(|period| period.is_finite());
    (0..n).filter(|&i| !declared(i) && is_angle(i)).map(|i| system.state_names[i].clone()).collect()
}

/// The limits on trajectories as text, with the names of the settings; the trajectory from a `given` state is followed
/// for longer.
fn limits(system: &System, given: bool) -> String {
    let Limits { steps, time } = system.limits;
    let steps = if given { steps.max(attractors::PERSISTENT) } else { steps };
    let steps = format!("{steps} integration steps (`max-steps`)");
    if time.is_finite() { format!("{steps} or a time of {time:e} (`max-time`)") } else { steps }
}

/// Cause and cure for a trajectory that reached the boundary of the region in which f is defined.
fn of_exit(system: &System, exit: &Exit) -> String {
    format!(
        "\nlikely cause: at time {:.6}, {}, a trajectory leaves the region where the vector field is defined \
         (division by zero, log or root of a negative number)\nwhat to do: rewrite the equation so that it is \
         defined there, or change the ranges of the states, the given state or the parameters",
        exit.time,
        place(system, &exit.state)
    )
}

/// Returns the first few components of a state as text.
pub(super) fn place(system: &System, state: &[f64]) -> String {
    /// Components that fit on one line.
    const TOLD: usize = 6;
    let state = in_first_turn(system.field.periods(), state);
    /// Share of the scale below which a value is 0 up to rounding.
    const NOTHING: f64 = 1e-12;
    let named = system.state_names.iter().zip(state.iter().zip(&system.scales)).take(TOLD);
    let rounded = |value: f64, scale: f64| Shown(if value.abs() < NOTHING * scale { 0.0 } else { value });
    let told: Vec<String> = named.map(|(name, (x, scale))| format!("{name} = {:.6}", rounded(*x, *scale))).collect();
    let more = if state.len() > TOLD { ", …" } else { "" };
    format!("{}{more}", told.join(", "))
}

/// Cause and cure if solutions form families, because of a rotational symmetry or a conserved energy.
fn of_family(system: &System, parameters: &[f64]) -> Option<String> {
    if let Some(pairs) = symmetry::rotation(system, parameters) {
        let name = |state: &usize| system.state_names.get(*state).map_or("?", String::as_str);
        let turned: Vec<String> = pairs.iter().map(|[a, b]| format!("({}, {})", name(a), name(b))).collect();
        let rest: Vec<String> = pairs.iter().map(|[_, b]| format!("{} = 0", name(b))).collect();
        return Some(format!(
            "\nlikely cause: the equations are invariant under a common rotation of {}: solutions form families, \
             none of them is isolated, and Newton's method does not converge\nwhat to do: for a motion along a \
             straight line, choose that line as an axis and start with {}; otherwise write the model in coordinates \
             without the angle",
            turned.join(" and "),
            rest.join(", ")
        ));
    }
    symmetry::keeps_energy(system, parameters).then(|| {
        "\nlikely cause: there is no damping and the forces derive from a potential, so energy is conserved: cycles \
         form a family with one member per energy, and no trajectory settles\nwhat to do: add a small damping as the \
         free parameter, and start from a cycle of the family (`cycle`) or from the equilibrium inside it (`state`) \
         with a switch at its Hopf point; the branch at zero damping is the family"
            .into()
    })
}

/// Cause and cure for a forced system so lightly damped that transients outlast every trajectory. The decay rate is
/// that of the linearisation at the given state or, if none was given, at the state of the sampling box nearest to the
/// origin.
fn of_slow_decay(system: &System, parameters: &[f64], state: Option<&[f64]>) -> Option<String> {
    let n = system.field.dim();
    if !system.field.forced() {
        return None;
    }
    let central = next_to_origin(system);
    let state = state.unwrap_or(&central);
    let (mut f, mut fx) = (vec![0.0; n], vec![0.0; n * n]);
    let at = Batch { lanes: 1, states: state, parameters: Parameters::Shared(parameters), times: &[0.0], signs: &[] };
    system.field.linearise(at, &[], &mut f, &mut fx, &mut []);
    let rates = crate::stability::eigenvalues(&fx, n, &system.scales);
    let slowest = rates.iter().fold(f64::NEG_INFINITY, |m: f64, z| m.max(z.re));
    let rounding = ROUNDING * rates.iter().fold(0.0, |m: f64, z| m.max(z.norm()));
    let periods = if slowest.abs() <= rounding { f64::INFINITY } else { transient(slowest) };
    let (_, steps) = turn(system, parameters, state)?;
    let followed = system.limits.steps / steps.max(1);
    let slow = slowest <= rounding && periods > followed as f64;
    slow.then(|| {
        let lasts = match periods.is_finite() {
            true => format!(
                "transients near the state take about {periods:.1e} forcing periods to decay by a factor \
                             of a thousand"
            ),
            false => "transients near the state do not decay".to_string(),
        };
        format!(
            "\nlikely cause: light damping: {lasts}, but trajectories are integrated for only {followed} \
             periods\nwhat to do: start with more damping or far from resonance, and follow the solution from there \
             (a homotopy or a branch); or give a state on the cycle"
        )
    })
}

/// The state of the sampling box nearest to the origin.
pub(super) fn next_to_origin(system: &System) -> Vec<f64> {
    system.ranges.iter().map(|[low, high]| 0.0f64.max(*low).min(*high)).collect()
}

/// True if f vanishes at a state.
fn is_equilibrium(system: &System, parameters: &[f64], state: &[f64]) -> bool {
    let mut f = vec![0.0; state.len()];
    system.field.evaluate(
        Batch { lanes: 1, states: state, parameters: Parameters::Shared(parameters), times: &[], signs: &[] },
        &mut f,
    );
    f.iter().zip(&system.scales).all(|(v, scale)| v.abs() <= ROUNDING * scale)
}

/// Cause and cure if the states can be shifted together, or a sum of them keeps its value.
pub(super) fn of_laws(system: &System, parameters: &[f64]) -> Option<String> {
    let names = &system.state_names;
    if let [shift, ..] = &shifts(system.field)[..] {
        return Some(format!(
            "\nlikely cause: f is unchanged when {} are shifted together: solutions are not isolated but form \
             families\nwhat to do: measure these states relative to one of them, which removes one state",
            shift.iter().zip(names).filter(|(s, _)| **s != 0.0).map(|(_, name)| &**name).collect::<Vec<_>>().join(", ")
        ));
    }
    let kept = conserved_at(system.field, parameters, &[], &system.ranges);
    let [first, rest @ ..] = &kept[..] else { return None };
    let more = if rest.is_empty() { String::new() } else { format!(", and {} more", rest.len()) };
    Some(format!(
        "\nlikely cause: {}{more} is conserved: solutions are not isolated but form families\nwhat to do: prescribe \
         its value under `[totals]` in the model, or use it to eliminate one state",
        in_words(first, names)
    ))
}

/// Explains the end of a branch of forced cycles next to a bound of the range at which the forcing has no period, such
/// as frequency zero; neither the mesh nor the field is at fault there. Returns any other end unchanged.
pub(super) fn of_forcing(system: &System, free: usize, range: [f64; 2], last: &Point, ending: Ending) -> Ending {
    /// Largest distance from the bound, in widths of the range. With a range of frequencies from 0 the period there is
    /// a hundred times that at the other bound.
    const NEAR: f64 = 0.01;
    let (Ending::MeshTooLarge(text) | Ending::StepTooSmall(text) | Ending::NotFinite(text)) = &ending else {
        return ending;
    };
    let (value, [low, high]) = (last.parameters[free], range);
    let unit = |at: f64| {
        let mut parameters = last.parameters.clone();
        parameters[free] = at;
        system.field.time_unit(&parameters)
    };
    let lost = |bound: &f64| {
        let unit = unit(*bound);
        (value - bound).abs() <= NEAR * (high - low) && !(unit > 0.0 && unit.is_finite())
    };
    let Some(bound) = range.into_iter().find(lost).filter(|_| system.field.forced()) else { return ending };
    let inside = bound + NEAR * (if bound == low { high - low } else { low - high });
    let shown = Shown(inside);
    let text = format!(
        "{}\nlikely cause: the range extends to {bound}, where the forcing has no period; the period grows without \
         bound towards it ({:.3e} at {value:.3e}, {:.3e} at {shown})\nwhat to do: end the range where the forcing \
         still has a period, such as {shown}; the response to a constant force is an equilibrium of the model \
         without forcing",
        text.lines().next().unwrap_or_default(),
        unit(value),
        unit(inside)
    );
    match ending {
        Ending::MeshTooLarge(_) => Ending::MeshTooLarge(text),
        Ending::StepTooSmall(_) => Ending::StepTooSmall(text),
        _ => Ending::NotFinite(text),
    }
}
