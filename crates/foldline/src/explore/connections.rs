//! Orbits that connect equilibria, followed in two parameters.
//!
//! **Idea.** A branch of cycles that ends with a period without bound leads to a homoclinic orbit: the last cycle is cut
//! where it is closest to the equilibrium, and the ends are moved onto its invariant subspaces. The orbit is then
//! lengthened by the linear flow next to the equilibrium until the estimated error of its truncation is far below the
//! tolerance, and followed as a curve. Cycles that approach an orbit homoclinic to a saddle-node are cut next to that, and the orbit
//! is followed together with the fold. Curves of both kinds start from the non-central orbits in which the others end.

use super::System;
use super::arcs::damped;
use super::growth::{self, Beginning, Growth, Line};
use super::plan::{CurvePlan, Plan};
use super::seeds::bare;
use super::shooting::Search;
use crate::continuation::corrector::{Plane, parameter_row, settle};
use crate::continuation::{Failure, Settings, Station};
use crate::contract::{Batch, Examination, Observer, Parameters, VectorField, ZeroProblem};
use crate::diagram::{
    Branch, Connection, Cost, Cycle, Ending, Family, Kind, Origin, Point, Shown, Solution, SpecialPoint, Symmetry,
};
use crate::linalg::{lu, max_abs};
use crate::problem::connecting::longer::{longer, sampled};
use crate::problem::connecting::{ConnectingField, Split};
use crate::problem::cycle::CycleProblem;
use crate::problem::gauss::Scheme;
use crate::special::connection::Limits;
use crate::special::normal_form::{Local, Loops};
use num_complex::Complex64;
use std::ops::Range;

/// Factor on the plan's tolerance, as for other curves.
const SHARPER: f64 = 0.2;
/// Estimated error of the truncation at the start of a curve, in tolerances: it changes along the curve.
const MARGIN: f64 = 0.1;
/// Largest estimated error of the truncation, in tolerances, of an orbit whose ends are so close to the equilibria that rounding
/// would matter next.
const ENOUGH: f64 = 0.5;
/// Number of times that an orbit is lengthened: a bound on the work.
const LENGTHENINGS: usize = 40;
/// Smallest factor by which the distances from the equilibria are reduced at once …
const SHORTEST: f64 = 0.05;
/// … and the one at which a further failure counts.
const LONGEST: f64 = 0.6;
/// Relative correction at which Newton's method has all but converged.
const CLOSE: f64 = 1e-4;
/// Distances along a curve at which it is left from the point where it meets another one: a tenth of the longest step, then shorter.
const DISTANCES: [f64; 4] = [0.02, 4e-3, 8e-4, 1.6e-4];
/// Smallest distance from the equilibria, relative to the largest on the orbit, at which rounding does not matter yet.
const LEAST: f64 = 1e-6;

/// Follows a curve of connecting orbits, or the part of it that is missing; `parent` is the branch at whose end it
/// starts. Returns the curve, and false if the observer wants to stop.
pub(super) fn follow(
    system: &System,
    plan: &Plan,
    curve: &CurvePlan,
    parent: &Branch,
    earlier: Option<&Branch>,
    observer: &dyn Observer,
) -> (Branch, bool) {
    let first = parent.held.map_or(parent.free, |(_, first)| first);
    let known = earlier.filter(|branch| !branch.points.is_empty());
    let start = match known.and_then(|branch| branch.points.iter().find(|p| p.position == 0)) {
        Some(point) => revived(system, curve, point),
        None => at_end(system, plan, curve, parent),
    };
    let parameter = start.as_ref().map_or(f64::NAN, |start| start.point.parameters[first]);
    let origin = match (special_of(curve, parent), parent.held) {
        (Ok(special), Some(_)) => {
            let parameter = special.point.parameters[parent.free];
            Origin::Switch { parent: parent.name.clone(), kind: special.kind, parameter }
        }
        _ if parent.family == Family::Cycle => Origin::EndOf(parent.name.clone()),
        _ => Origin::Switch { parent: parent.name.clone(), kind: curve.hold, parameter },
    };
    let mut branch = known.cloned().unwrap_or_else(|| Branch::new(&curve.name, Family::Arc, curve.free, origin));
    branch.held = Some((curve.hold, first));
    let begun = start.and_then(|start| {
        system.repeats(&start.point.parameters, &[(first, curve.ranges[0]), (curve.free, curve.ranges[1])])?;
        Ok(start)
    });
    let going = match begun {
        Ok(start) => {
            let own = start.system(system);
            let value = start.point.parameters[curve.free];
            let (settings, mut sides) = settings(&own, plan, curve, first, value);
            if start.away_from.is_some() {
                sides = [true; 2];
            }
            let growth = Growth {
                system: &own,
                settings: &settings,
                degree: plan.degree,
                ties: Vec::new(),
                sides,
                parents: &[],
                marks: &curve.marks,
                observer,
                whole: false,
                sparse: false,
            };
            if known.is_some() {
                growth.resume(&mut branch)
            } else {
                let line = Line { held: branch.held, ..Line::new(curve.free) };
                let mut problem = line.problem(&own, plan.degree, &start.point);
                match growth::polished(&mut *problem, &settings, &start.point) {
                    Ok(station) => growth.begin(&mut branch, beginning(station, &own, curve, first, start.away_from)),
                    Err(why) => super::family::without_start(
                        observer,
                        &mut branch,
                        format!(
                            "the orbit cannot be computed to the tolerance: {why}\nlikely cause: its ends are so close to the \
                             equilibrium that rounding matters\nwhat to do: use a larger tolerance"
                        ),
                    ),
                }
            }
        }
        Err(why) => super::family::without_start(observer, &mut branch, why),
    };
    (branch, going)
}

/// The beginning of a curve: both sides, or only the one that leads away from the values of both parameters in `away_from`.
fn beginning(
    mut station: Station,
    system: &System,
    curve: &CurvePlan,
    first: usize,
    away_from: Option<[f64; 2]>,
) -> Beginning {
    let Some(at) = away_from else { return Beginning::Inside(station) };
    let last = station.tangent.len() - 2;
    let apart = [(first, at[0]), (curve.free, at[1])].into_iter().zip(&station.tangent[last..]);
    let along: f64 =
        apart.map(|((index, at), t)| (station.point.parameters[index] - at) / system.unit(index) * t).sum();
    if along < 0.0 {
        [&mut station.tangent, &mut station.point.tangent].into_iter().flatten().for_each(|t| *t = -*t);
    }
    let joined = Ending::Joined { at: Kind::BogdanovTakens, parameter: at[1] };
    Beginning::Edge { before: Vec::new(), first: station, joined }
}

fn settings(system: &System, plan: &Plan, curve: &CurvePlan, first: usize, value: f64) -> (Settings, [bool; 2]) {
    let [own, second] = curve.ranges;
    let (range, sides) = match curve.until {
        Some(target) if target >= value => ([second[0].min(value), target], [false, true]),
        Some(target) => ([target, second[1].max(value)], [true, false]),
        None => (second, [true, true]),
    };
    let usual = growth::settings(system, SHARPER * plan.tolerance, range, curve.max_points);
    (Settings { bounds: vec![(first, own)], stability: false, ..usual }, sides)
}

/// A connecting orbit with its field.
struct Start<'s> {
    field: ConnectingField<'s>,
    point: Point,
    /// Values of both parameters at the Bogdanov–Takens point from which the curve leads away.
    away_from: Option<[f64; 2]>,
}

impl<'s> Start<'s> {
    /// The system of the curve. The sizes of the further parameters come from its first point.
    fn system<'o>(&'o self, system: &System<'o>) -> System<'o>
    where
        's: 'o,
    {
        let mut parameter_scales = system.parameter_scales.clone();
        parameter_scales.resize(system.field.parameter_count(), 1.0);
        parameter_scales.push(self.field.time_unit(&self.point.parameters));
        while parameter_scales.len() < self.field.parameter_count() {
            parameter_scales.extend_from_slice(&system.scales);
        }
        parameter_scales.truncate(self.field.parameter_count());
        System {
            field: &self.field,
            parameter_scales,
            symmetries: vec![Symmetry::identity()],
            exchanges: Vec::new(),
            mirrors: Vec::new(),
            holds: None,
            unfolded: None,
            ..system.clone()
        }
    }

    /// Largest distances of the orbit from the equilibria.
    fn extents(&self) -> [f64; 2] {
        let (n, parameters) = (self.field.dim(), &self.point.parameters);
        let profile = self.cycle().map_or(&[][..], |cycle| &cycle.profile);
        let far = |end: usize| {
            let split = self.field.parts(end, parameters)?;
            let sizes = profile.chunks_exact(n).map(|x| split.size(&self.field.deviations([x, x], parameters)[end]));
            Some(sizes.fold(0.0, f64::max))
        };
        [0, 1].map(|end| far(end).unwrap_or(f64::NAN))
    }

    /// Distances of the ends at which a non-central orbit would leave or arrive at a saddle-node, in units of those at which terms
    /// of fifth order, which its test function neglects, are below the tolerance.
    fn distances_from_saddle_node(&self, tolerance: f64) -> [f64; 2] {
        let (sizes, extents) = (self.field.sizes(&self.point.parameters), self.extents());
        let strong = [self.field.unstable_off_axis() > 0, self.field.unstable_off_axis() + 1 < self.field.dim()];
        [0, 1].map(|end| match self.field.is_at_saddle_node() && strong[end] {
            true => sizes[end] / (tolerance.powf(0.2) * extents[end]),
            false => 0.0,
        })
    }

    /// The orbit.
    fn cycle(&self) -> Option<&Cycle> {
        match &self.point.solution {
            Solution::Cycle(cycle) => Some(cycle),
            Solution::Equilibrium(_) | Solution::Torus(_) => None,
        }
    }
}

/// Number of unstable eigenvalues of an equilibrium.
fn unstable(system: &System, x: &[f64], parameters: &[f64]) -> Option<usize> {
    let probe = ConnectingField::new(system.field, &system.scales, 1, 0);
    let all = probe.parameters(parameters, 1.0, x, [1.0; 2], &[]);
    Some(probe.split(0, &all)?.unstable())
}

/// The field of a stored orbit.
fn revived<'s>(system: &'s System, curve: &CurvePlan, point: &Point) -> Result<Start<'s>, String> {
    let field = ConnectingField::of_stored(system.field, &system.scales, curve.hold, &point.parameters);
    let field = field.ok_or_else(|| "the stored orbit does not belong to an equilibrium of this model".to_string())?;
    let parameters = field.completed(&point.parameters);
    Ok(Start { field, point: Point { parameters, ..point.clone() }, away_from: None })
}

/// The special point of a curve `parent` at which another one starts.
///
/// # Errors
/// A sentence that says why there is none.
fn special_of<'b>(curve: &CurvePlan, parent: &'b Branch) -> Result<&'b SpecialPoint, String> {
    let wanted = match (parent.held, curve.hold) {
        (Some((Kind::SaddleNodeHomoclinic, _)), Kind::Homoclinic)
        | (Some((Kind::Homoclinic, _)), Kind::SaddleNodeHomoclinic) => Kind::NonCentral,
        (Some((Kind::Fold | Kind::Hopf, _)), Kind::Homoclinic) if parent.family == Family::Equilibrium => {
            Kind::BogdanovTakens
        }
        _ => {
            return Err(format!(
                "no curve of {} orbits starts from {}\nlikely cause: such a curve starts from cycles, from equilibria, or at a point that \
                 it has in common with another curve\nwhat to do: name another branch or curve as `of`",
                curve.hold, parent.name
            ));
        }
    };
    let first = parent.held.map_or(parent.free, |(_, first)| first);
    let value = |special: &SpecialPoint| special.point.parameters.get(first).copied().unwrap_or(f64::NAN);
    let fitting = parent.special.iter().filter(|special| special.kind == wanted);
    let found = match curve.near {
        Some(near) => fitting.min_by(|a, b| (value(a) - near).abs().total_cmp(&(value(b) - near).abs())),
        None => fitting.min_by_key(|special| special.point.position),
    };
    found.ok_or_else(|| {
        let ends = parent.ends.iter().flatten().map(Ending::brief).collect::<Vec<_>>().join("; ");
        format!(
            "the curve {} has no {wanted} point, at which curves of {} orbits start ({ends})\nlikely cause: it left its ranges \
             before it reached one\nwhat to do: widen the `range` of the curve, and that of its branch",
            parent.name, curve.hold
        )
    })
}

/// The orbit next to the non-central one in which a curve of orbits homoclinic to saddles meets one of those homoclinic to
/// saddle-nodes.
fn beside_non_central<'s>(
    system: &'s System,
    plan: &Plan,
    curve: &CurvePlan,
    parent: &Branch,
) -> Result<Start<'s>, String> {
    let special = special_of(curve, parent)?;
    let at = &special.point;
    let (kind, first) = parent.held.ok_or("the parent is no curve")?;
    let lost = || format!("the non-central orbit of {} cannot be read", parent.name);
    let old = ConnectingField::of_stored(system.field, &system.scales, kind, &at.parameters).ok_or_else(lost)?;
    let Solution::Cycle(orbit) = &at.solution else { return Err(lost()) };
    // The eigenvalue 0 counts as one of the side on which the orbit does not arrive along the strong manifold.
    let field = if old.is_at_saddle_node() {
        let tests = old.flips(orbit, &at.parameters).map(|own| own.map_or(f64::INFINITY, |own| own.value.abs()));
        let count = old.unstable_off_axis() + usize::from(tests[0] < tests[1]);
        ConnectingField::new(system.field, &system.scales, 1, count)
    } else {
        let [values, _] = old.saddles(&at.parameters).ok_or_else(lost)?;
        let positive = values.iter().filter(|z| z.re > 0.0).count();
        let smallest = values.iter().min_by(|a, b| a.re.abs().total_cmp(&b.re.abs())).ok_or_else(lost)?;
        ConnectingField::at_saddle_node(system.field, &system.scales, positive - usize::from(smallest.re > 0.0))
    };
    let parameters = field.renewed(&at.parameters);
    let start = Start { field, point: bare(&parameters, Solution::Cycle(orbit.clone())), away_from: None };
    let start = settled(system, plan, curve, first, start)?;
    // Off the point where they meet, to the side on which the orbits exist.
    let own = start.system(system);
    let line = Line { held: Some((curve.hold, first)), ..Line::new(curve.free) };
    let settings = growth::settings(&own, SHARPER * plan.tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
    let exists = |point: &Point| {
        if start.field.is_at_saddle_node() {
            let Solution::Cycle(orbit) = &point.solution else { return false };
            let tests = start.field.flips(orbit, &point.parameters);
            return tests.iter().flatten().all(|test| test.value > 0.0);
        }
        let positive = |values: &Vec<Complex64>| values.iter().filter(|z| z.re > 0.0).count();
        let count = start.field.saddles(&point.parameters).map(|[values, _]| positive(&values));
        count == Some(start.field.unstable_off_axis())
    };
    let found = {
        let mut problem = line.problem(&own, plan.degree, &start.point);
        let met = growth::polished(&mut *problem, &settings, &start.point).map_err(|why| why.to_string())?;
        DISTANCES.iter().flat_map(|distance| [*distance, -distance]).find_map(|distance| {
            problem.set_mesh(&met.mesh);
            problem.anchor(&met.u);
            let guess = met.u.iter().zip(&met.tangent).map(|(u, t)| u + distance * t).collect();
            let plane = Plane { row: met.tangent.clone(), base: met.u.clone(), distance };
            let found = settle(&mut *problem, &settings, plane, guess, 1.0, &mut Cost::default()).ok()?;
            exists(&found.point).then_some(found.point)
        })
    };
    drop(own);
    let point = found
        .ok_or_else(|| format!("no {} orbit is found next to the non-central one of {}", curve.hold, parent.name))?;
    Ok(Start { point: bare(&point.parameters, point.solution), ..start })
}

/// A homoclinic orbit next to a Bogdanov–Takens point of a curve of folds or Hopf points.
fn beside_takens<'s>(
    system: &'s System,
    plan: &Plan,
    curve: &CurvePlan,
    parent: &Branch,
    first: usize,
) -> Result<Start<'s>, String> {
    /// Sizes of the first orbit relative to those of the states, in the order of trial.
    const SIZES: [f64; 7] = [0.1, 0.03, 0.3, 0.01, 3e-3, 1.0, 1e-3];
    /// Largest relative distance of the orbit from the approximate one: they agree to the order ε.
    const NEAR: f64 = 0.3;
    let special = special_of(curve, parent)?;
    let at = &special.point;
    let free = [first, curve.free];
    let degenerate = || {
        format!(
            "the Bogdanov–Takens point of {} has no normal form from which a homoclinic orbit follows\nlikely cause: a or b vanishes, or \
             the two parameters do not unfold the point, as with a symmetry\nwhat to do: start the curve from cycles",
            parent.name
        )
    };
    let local = Local::new(system.field, at).ok_or_else(degenerate)?;
    let loops =
        Loops::new(&local, &system.scales, free, free.map(|index| system.unit(index))).ok_or_else(degenerate)?;
    let mut last = None;
    for size in SIZES {
        let eps = loops.of_size(size);
        if eps > loops.largest() {
            continue;
        }
        match on_loop(system, plan, curve, &loops, eps, first) {
            Ok(start) => {
                let (predicted, found) = (loops.parameters(eps), &start.point.parameters);
                let scaled = |index: usize, value: f64| (value - at.parameters[index]) / system.unit(index);
                let length = |all: &[f64]| free.iter().map(|k| scaled(*k, all[*k]).powi(2)).sum::<f64>().sqrt();
                let off = free.iter().map(|k| ((predicted[*k] - found[*k]) / system.unit(*k)).powi(2)).sum::<f64>();
                if off.sqrt() < NEAR * length(&predicted) {
                    return Ok(Start { away_from: Some(free.map(|index| at.parameters[index])), ..start });
                }
                last.get_or_insert("Newton's method leads to another orbit".to_string());
            }
            Err(why) => {
                last.get_or_insert(why.lines().next().unwrap_or_default().to_string());
            }
        }
    }
    Err(format!(
        "no homoclinic orbit is found next to the Bogdanov–Takens point of {}: {}\nlikely cause: its normal form describes a small \
         neighbourhood only, in which orbits are too small for the tolerance\nwhat to do: use a smaller tolerance, or start the curve from \
         cycles or saddles nearby",
        parent.name,
        last.unwrap_or_else(|| "its normal form is too one-sided".into())
    ))
}

/// The homoclinic orbit of a size ε.
fn on_loop<'s>(
    system: &'s System,
    plan: &Plan,
    curve: &CurvePlan,
    loops: &Loops,
    eps: f64,
    first: usize,
) -> Result<Start<'s>, String> {
    /// ξ at the ends, where the orbit of the normal form is closer to the saddle by a factor of 10⁻⁴, and mesh intervals.
    const REACH: f64 = 6.0;
    const INTERVALS: usize = 60;
    let parameters = loops.parameters(eps);
    let place = equilibrium(system, &loops.saddle(eps), &parameters)
        .ok_or("Newton's method finds no saddle next to the point")?;
    let count = unstable(system, &place, &parameters).ok_or("the equilibrium is not hyperbolic")?;
    let (begin, end) = (loops.time(eps, -REACH), loops.time(eps, REACH));
    let mesh: Vec<f64> = (0..=INTERVALS)
        .map(|k| (loops.time(eps, REACH * (2.0 * k as f64 / INTERVALS as f64 - 1.0)) - begin) / (end - begin))
        .collect();
    let state = |t: f64| loops.state(eps, loops.phase(eps, begin + t * (end - begin)));
    let profile = sampled(&mesh, &Scheme::new(plan.degree), &state);
    let cycle = Cycle {
        points: crate::problem::gauss::Points::Gauss,
        period: end - begin,
        forcing_periods: 1,
        mesh: mesh.into(),
        degree: plan.degree,
        profile,
        gain: vec![0.0; place.len()],
    };
    let orbit = Orbit {
        parameters: &parameters,
        cycle: &cycle,
        times: [0.0, 1.0 - 1e-9],
        places: &place,
        count,
        node: false,
        gain: &[],
    };
    let start =
        pieced(system, plan, &orbit)?.ok_or("the orbit of the normal form does not come close to the saddle")?;
    settled(system, plan, curve, first, start)
}

/// The homoclinic orbit that the cycles at an end of a branch approach, at the values that the last cycle has of all
/// parameters but the branch's.
///
/// # Errors
/// A sentence that says why there is none.
fn at_end<'s>(system: &'s System, plan: &Plan, curve: &CurvePlan, parent: &Branch) -> Result<Start<'s>, String> {
    if system.field.forced() || system.field.switch_count() > 0 {
        return Err(format!(
            "{} orbits are followed for smooth autonomous models only\nlikely cause: the right-hand side depends on \
             time or has switching points\nwhat to do: smooth the switching points, or repeat the branch of cycles at \
             several values of the second parameter",
            curve.hold
        ));
    }
    match parent.held {
        Some((Kind::Fold | Kind::Hopf, first)) => return beside_takens(system, plan, curve, parent, first),
        Some(_) => return beside_non_central(system, plan, curve, parent),
        None => {}
    }
    if parent.family == Family::Equilibrium && curve.hold == Kind::SaddleNodeHomoclinic {
        return Err(format!(
            "{} consists of equilibria, from which orbits homoclinic to a saddle-node are not searched for\nlikely cause: `of` is not \
             the branch of cycles\nwhat to do: name a branch of cycles that ends at such an orbit, or a curve of homoclinic \
             orbits that ends at one",
            parent.name
        ));
    }
    if parent.family == Family::Equilibrium {
        return shot(system, plan, curve, parent);
    }
    let value = |point: &Point| point.parameters.get(parent.free).copied().unwrap_or(f64::NAN);
    let unbounded = |ending: &Option<Ending>| match ending {
        Some(Ending::Connecting { connection, .. }) => Some(Some(*connection)),
        Some(Ending::PeriodUnbounded(_)) => Some(None),
        _ => None,
    };
    let ends = [(parent.points.first(), 0), (parent.points.last(), 1)];
    let mut fitting: Vec<(&Point, Option<Connection>)> =
        ends.into_iter().filter_map(|(point, side)| Some((point?, unbounded(&parent.ends[side])?))).collect();
    // Ends of the kind asked for come first.
    let meant = |connection: &Option<Connection>| {
        (curve.hold == Kind::SaddleNodeHomoclinic) == (*connection == Some(Connection::SaddleNode))
    };
    if fitting.iter().any(|(_, connection)| meant(connection)) {
        fitting.retain(|(_, connection)| meant(connection));
    }
    let near = curve.near.unwrap_or(f64::NAN);
    fitting.sort_by(|a, b| (value(a.0) - near).abs().total_cmp(&(value(b.0) - near).abs()));
    let Some((point, connection)) = fitting.last().filter(|_| curve.near.is_none()).or(fitting.first()) else {
        let ends = parent.ends.iter().flatten().map(Ending::brief).collect::<Vec<_>>().join("; ");
        return Err(format!(
            "no end of the branch {} has a period that grows without bound ({ends})\nlikely cause: the branch stopped \
             before it came close to the {} orbit\nwhat to do: widen its range, or give it more `max-points`",
            parent.name, curve.hold
        ));
    };
    match (curve.hold, connection) {
        (Kind::Homoclinic, Some(Connection::SaddleNode)) => Err(format!(
            "the cycles of {} approach an orbit homoclinic to a saddle-node, not to a saddle\nlikely cause: the period \
             becomes infinite where two equilibria meet on the cycle\nwhat to do: use `hold = \"{}\"`",
            parent.name,
            Kind::SaddleNodeHomoclinic
        )),
        (Kind::SaddleNodeHomoclinic, Some(Connection::SaddleNode) | None) => {
            cut_at_saddle_node(system, plan, curve, parent.free, point)
        }
        (Kind::SaddleNodeHomoclinic, _) => Err(format!(
            "the cycles of {} do not approach an orbit homoclinic to a saddle-node\nlikely cause: they approach one of a saddle\nwhat to \
             do: use `hold = \"{}\"`; where that curve meets a fold of the equilibria, this one can start",
            parent.name,
            Kind::Homoclinic
        )),
        (Kind::Homoclinic, Some(Connection::Heteroclinic)) => Err(format!(
            "the cycles of {} approach a heteroclinic cycle between several saddles\nlikely cause: the model is \
             symmetric, or the cycle passes near more than one saddle\nwhat to do: use `hold = \"heteroclinic\"`",
            parent.name
        )),
        (Kind::Heteroclinic, _) => cut(system, plan, curve, parent.free, point, true),
        _ => cut(system, plan, curve, parent.free, point, false),
    }
}

/// Normalised times and states at which a cycle is slower than just before and after, by time from its slowest point on.
fn slow_points(system: &System, cycle: &Cycle, parameters: &[f64]) -> Vec<(f64, Vec<f64>)> {
    let n = system.field.dim();
    let times: Vec<f64> = cycle.mesh.windows(2).flat_map(|pair| [pair[0], 0.5 * (pair[0] + pair[1])]).collect();
    let speed = |t: &f64| {
        let (x, mut f) = (cycle.state(*t), vec![0.0; n]);
        let at = Parameters::Shared(parameters);
        system.field.evaluate(Batch { lanes: 1, states: &x, parameters: at, times: &[], signs: &[] }, &mut f);
        system.norm(&f)
    };
    let speeds: Vec<f64> = times.iter().map(speed).collect();
    let count = times.len();
    let lowest = (0..count).min_by(|a, b| speeds[*a].total_cmp(&speeds[*b])).unwrap_or(0);
    let along = (0..count).map(|k| (lowest + k) % count);
    let low = along.filter(|k| speeds[*k] <= speeds[(k + 1) % count] && speeds[*k] <= speeds[(k + count - 1) % count]);
    let later = |t: f64| if t < times[lowest] { t + 1.0 } else { t };
    low.map(|k| (later(times[k]), cycle.state(later(times[k])))).collect()
}

/// The equilibrium to which Newton's method leads from `x`.
pub(super) fn equilibrium(system: &System, x: &[f64], parameters: &[f64]) -> Option<Vec<f64>> {
    const ITERATIONS: usize = 30;
    let (n, mut x) = (x.len(), x.to_vec());
    for _ in 0..ITERATIONS {
        let (mut f, mut fx) = (vec![0.0; n], vec![0.0; n * n]);
        let at = Batch { lanes: 1, states: &x, parameters: Parameters::Shared(parameters), times: &[], signs: &[] };
        system.field.linearise(at, &[], &mut f, &mut fx, &mut []);
        let mut pivots = vec![0; n];
        lu::factorise(&mut fx, n, &mut pivots).ok()?;
        lu::solve(&fx, n, &pivots, &mut f, 1);
        x.iter_mut().zip(&f).for_each(|(x, d)| *x -= d);
        if system.norm(&f) <= 1e-12 * (1.0 + system.norm(&x)) {
            return max_abs(&x).is_finite().then_some(x);
        }
    }
    None
}

/// The connecting orbit near a cycle of long period, from the piece of the cycle between its departure from a saddle and
/// its return to that or, `between_two`, its arrival at the next one.
fn cut<'s>(
    system: &'s System,
    plan: &Plan,
    curve: &CurvePlan,
    first: usize,
    point: &Point,
    between_two: bool,
) -> Result<Start<'s>, String> {
    let Solution::Cycle(cycle) = &point.solution else {
        return Err("the branch consists of equilibria; a connecting orbit needs a branch of cycles".into());
    };
    let (n, slow) = (system.field.dim(), slow_points(system, cycle, &point.parameters));
    let Some((begin, place)) = slow.first().and_then(|(t, x)| Some((*t, equilibrium(system, x, &point.parameters)?)))
    else {
        return Err("Newton's method finds no equilibrium next to the slowest point of the last cycle".into());
    };
    let differs = |x: &[f64]| {
        const SAME: f64 = 1e-3;
        let off: Vec<f64> = x.iter().zip(&place).map(|(a, b)| a - b).collect();
        system.norm(&off) > SAME
    };
    let near = |x: &[f64], y: &[f64]| {
        (0..n).all(|c| {
            let [low, high] = point.ranges.get(c).copied().unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
            (x[c] - y[c]).abs() <= NEAR * (high - low)
        })
    };
    let other = slow.iter().skip(1).filter(|_| between_two).find_map(|(t, x)| {
        let found = equilibrium(system, x, &point.parameters)?;
        (differs(&found) && near(x, &found)).then_some((*t, found))
    });
    if between_two && other.is_none() {
        return Err(format!(
            "the last cycle is close to one equilibrium only\nlikely cause: it approaches a homoclinic orbit\nwhat to do: use \
             `hold = \"{}\"`",
            Kind::Homoclinic
        ));
    }
    let until = other.as_ref().map_or(begin + 1.0, |(t, _)| *t);
    let places = [&place[..], other.as_ref().map_or(&[], |(_, x)| &x[..])].concat();
    let count = unstable(system, &place, &point.parameters).filter(|count| (1..n).contains(count));
    let counts = [count, other.as_ref().map_or(count, |(_, x)| unstable(system, x, &point.parameters))];
    let [Some(count), Some(count_there)] = counts else {
        let state: Vec<String> = places.iter().map(|x| format!("{:.6}", Shown(*x))).collect();
        return Err(format!(
            "an equilibrium next to the slowest points of the last cycle is not a saddle ({})",
            state.join(", ")
        ));
    };
    if count != count_there {
        return Err(format!(
            "the saddles have {count} and {count_there} unstable eigenvalues\nlikely cause: orbits from one to the other exist \
             for all parameter values, or need more than one parameter\nwhat to do: only orbits between saddles with as \
             many unstable eigenvalues are followed"
        ));
    }
    let gain: &[f64] = if between_two { &[] } else { &cycle.gain };
    let orbit = Orbit {
        parameters: &point.parameters,
        cycle,
        times: [begin, until],
        places: &places,
        count,
        node: false,
        gain,
    };
    let start = pieced(system, plan, &orbit)?.ok_or_else(|| {
        "the last cycle does not come close enough to the equilibrium\nlikely cause: its period is not long yet\nwhat to \
         do: follow the branch of cycles further, with more `max-points`"
            .to_string()
    })?;
    settled(system, plan, curve, first, start)
}

/// Largest distance of an equilibrium from the slowest point of a cycle, relative to the extents of that.
const NEAR: f64 = 0.2;

/// The orbit homoclinic to the saddle-node that the cycles of a branch in the parameter `first` approach.
fn cut_at_saddle_node<'s>(
    system: &'s System,
    plan: &Plan,
    curve: &CurvePlan,
    first: usize,
    point: &Point,
) -> Result<Start<'s>, String> {
    let Solution::Cycle(cycle) = &point.solution else { return Err("the branch does not consist of cycles".into()) };
    let unit = system.unit(first);
    let limits = Limits { field: system.field, free: first, scales: &system.scales, unit, tolerance: plan.tolerance };
    let slow = slow_points(system, cycle, &point.parameters);
    let found = slow.first().and_then(|(t, x)| Some((*t, x, limits.fold_beside(x, &point.parameters)?)));
    let near = |x: &[f64], y: &[f64]| {
        x.iter().zip(y).zip(&point.ranges).all(|((x, y), [low, high])| (x - y).abs() <= NEAR * (high - low))
    };
    let Some((begin, _, (place, parameters, _))) = found.filter(|(_, x, (place, ..))| near(x, place)) else {
        return Err(
            "there is no saddle-node next to the slowest point of the last cycle\nlikely cause: the cycles approach an orbit \
             of another kind, or their period is not long yet\nwhat to do: follow the branch of cycles further, with more `max-points`"
                .into(),
        );
    };
    let probe = ConnectingField::new(system.field, &system.scales, 1, 0);
    let all = probe.parameters(&parameters, 1.0, &place, [1.0; 2], &[]);
    let [mut values, _] = probe.saddles(&all).ok_or("the equilibrium has no eigenvalues")?;
    values.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
    let count = values.iter().skip(1).filter(|z| z.re > 0.0).count();
    let orbit = Orbit {
        parameters: &parameters,
        cycle,
        times: [begin, begin + 1.0],
        places: &place,
        count,
        node: true,
        gain: &cycle.gain,
    };
    let start = pieced(system, plan, &orbit)?
        .ok_or("the last cycle does not come close enough to the saddle-node\nlikely cause: its period is not long yet\nwhat to do: follow the branch of cycles further")?;
    settled(system, plan, curve, first, start)
}

/// An orbit that leaves one saddle and comes close to another, or the same.
struct Orbit<'o> {
    parameters: &'o [f64],
    cycle: &'o Cycle,
    /// Times, in periods, at which the orbit is next to the saddles.
    times: [f64; 2],
    /// The saddles, or the only one.
    places: &'o [f64],
    /// Number of their unstable eigenvalues.
    count: usize,
    /// True if the equilibrium is a saddle-node.
    node: bool,
    gain: &'o [f64],
}

/// The piece of an orbit between its departure from the first and its arrival at the second saddle; `None` if it does not
/// come close enough.
fn pieced<'s>(system: &'s System, plan: &Plan, orbit: &Orbit) -> Result<Option<Start<'s>>, String> {
    let (n, cycle) = (system.field.dim(), orbit.cycle);
    let field = match orbit.node {
        true => ConnectingField::at_saddle_node(system.field, &system.scales, orbit.count),
        false => ConnectingField::new(system.field, &system.scales, orbit.places.len() / n, orbit.count),
    };
    let probe = field.parameters(orbit.parameters, 1.0, orbit.places, [1.0; 2], orbit.gain);
    let splits = [0, 1].map(|end| field.parts(end, &probe));
    let [Some(left), Some(right)] = &splits else { return Err("an equilibrium is not hyperbolic".into()) };
    let sides = Departure { field: &field, splits: [left, right], probe: &probe, cycle, times: orbit.times };
    let Some((from, to, sizes)) = sides.piece() else { return Ok(None) };
    let length = (to - from) * cycle.period;
    let scheme = Scheme::new(plan.degree);
    let inner = (0..3).flat_map(|turn| cycle.mesh.iter().map(move |t| t + f64::from(turn) - 1.0));
    let mut mesh: Vec<f64> = vec![from];
    mesh.extend(inner.filter(|t| *t > from + 1e-9 && *t < to - 1e-9));
    mesh.push(to);
    mesh.dedup_by(|a, b| (*a - *b).abs() < 1e-12);
    let profile = sampled(&mesh, &scheme, &|t| cycle.state(t));
    let mesh: Vec<f64> = mesh.iter().map(|t| (t - from) / (to - from)).collect();
    let parameters = field.parameters(orbit.parameters, length, orbit.places, sizes, orbit.gain);
    let solution = Cycle {
        points: crate::problem::gauss::Points::Gauss,
        period: length,
        forcing_periods: 1,
        mesh: mesh.into(),
        degree: plan.degree,
        profile,
        gain: vec![0.0; n],
    };
    drop(splits);
    Ok(Some(Start { field, point: bare(&parameters, Solution::Cycle(solution)), away_from: None }))
}

/// The connecting orbit of saddles on a branch of equilibria, found by shooting.
fn shot<'s>(system: &'s System, plan: &Plan, curve: &CurvePlan, parent: &Branch) -> Result<Start<'s>, String> {
    let search = Search {
        system,
        free: parent.free,
        range: curve.ranges[0],
        near: curve.near,
        to: curve.to.clone(),
        degree: plan.degree,
    };
    let found = search.found(parent)?;
    let count = unstable(system, &found.places[..system.field.dim()], &found.parameters)
        .ok_or("an equilibrium is not hyperbolic")?;
    let orbit = Orbit {
        parameters: &found.parameters,
        cycle: &found.cycle,
        times: [0.0, 1.0 - 1e-9],
        places: &found.places,
        count,
        node: false,
        gain: &[],
    };
    let start =
        pieced(system, plan, &orbit)?.ok_or("the orbit found by shooting does not come close enough to the saddle")?;
    settled(system, plan, curve, parent.free, start)
}

/// A cycle between the saddle that it leaves and the one that it arrives at.
struct Departure<'d> {
    field: &'d ConnectingField<'d>,
    splits: [&'d Split; 2],
    probe: &'d [f64],
    cycle: &'d Cycle,
    /// Times in periods at which the cycle is slowest next to both.
    times: [f64; 2],
}

impl Departure<'_> {
    /// Lengths of the stable and unstable parts of the deviations from both saddles at a time in periods.
    fn parts(&self, t: f64) -> [[f64; 2]; 2] {
        let x = self.cycle.state(t);
        let ys = self.field.deviations([&x, &x], self.probe);
        [0, 1].map(|end| [-1.0, 1.0].map(|side| self.splits[end].length(&ys[end], side)))
    }

    /// Share of nonlinear terms in the speed at a time in periods, as seen from the saddle of an end.
    fn nonlinearity(&self, t: f64, end: usize) -> f64 {
        let x = self.cycle.state(t);
        let y = &self.field.deviations([&x, &x], self.probe)[end];
        // The flow next to a saddle-node is not linear.
        if self.field.is_at_saddle_node() { 0.0 } else { self.field.nonlinearity(end, y, self.probe) }
    }

    /// Times, in periods, at which the cycle leaves the neighbourhood of one saddle and enters that of the other, and
    /// the sizes of these: a share of the largest distance, or more if the cycle is not that close.
    fn piece(&self) -> Option<(f64, f64, [f64; 2])> {
        const SAMPLES: usize = 4000;
        const SHARE: f64 = 0.05;
        /// Largest share of nonlinear terms in the speed at the cut.
        const NONLINEAR: f64 = 0.3;
        let time = |k: usize| self.times[0] + (self.times[1] - self.times[0]) * k as f64 / SAMPLES as f64;
        let all: Vec<[[f64; 2]; 2]> = (0..=SAMPLES).map(|k| self.parts(time(k))).collect();
        let size = |end: usize| {
            let lengths = |of: Range<usize>| all[of].iter().map(move |own| own[end][0].hypot(own[end][1]));
            let half = if end == 0 { 0..SAMPLES / 2 } else { SAMPLES / 2..SAMPLES + 1 };
            let near = lengths(half).fold(f64::INFINITY, f64::min);
            let far = lengths(0..SAMPLES + 1).fold(0.0, f64::max);
            let at = |k: &usize| if end == 0 { *k } else { SAMPLES - k };
            let linear = |k: &usize| self.nonlinearity(time(at(k)), end) < NONLINEAR;
            let reach = (0..SAMPLES / 2).take_while(linear).map(|k| all[at(&k)][end][1 - end]).fold(0.0, f64::max);
            let size = (SHARE * far).min(reach).max(2.0 * near);
            (size < 0.5 * far).then_some(size)
        };
        let sizes = [size(0)?, size(1)?];
        let from = (0..=SAMPLES).find(|k| all[*k][0][1] >= sizes[0])?;
        let to = (from..=SAMPLES).rev().find(|k| all[*k][1][0] >= sizes[1])?;
        Some((time(from), time(to), sizes))
    }
}

/// Factor on the distances from the equilibria that brings the error of the truncation, which is of second order, to half of
/// `goal`.
fn share_for(goal: f64, error: f64) -> f64 {
    (0.5 * goal / error).sqrt().clamp(SHORTEST, 0.5)
}

/// The point of a curve with its orbit cut where the error of the truncation allows it.
pub(super) fn shortened(growth: &Growth, system: &System, line: &Line, at: &Point) -> Option<Point> {
    /// Least factor on the distances from the equilibria that is worth a new orbit, and the greatest at once.
    const WORTH: f64 = 2.0;
    const MOST: f64 = 1e6;
    let Solution::Cycle(orbit) = &at.solution else { return None };
    let mut problem = CycleProblem::like(line.setting(system, &at.parameters), orbit);
    let u = problem.unknowns_of(at);
    problem.anchor(&u);
    problem.factorise(&u, &parameter_row(u.len())).ok()?;
    let share = (MARGIN * growth.settings.tolerance / problem.truncation(&u)).sqrt().min(MOST);
    drop(problem);
    // The tangent space may have served so far, with a much larger error.
    let shares = [share, MOST.sqrt(), MOST.sqrt().sqrt(), MOST.powf(0.125)].into_iter().filter(|share| *share > WORTH);
    shares.into_iter().find_map(|share| resized(growth, system, line, at, share))
}

/// The point of a curve with the ends of its orbit moved by the factor `share`.
fn resized(growth: &Growth, system: &System, line: &Line, at: &Point, share: f64) -> Option<Point> {
    let Solution::Cycle(orbit) = &at.solution else { return None };
    let of = |point: &Point, orbit: &Cycle| CycleProblem::like(line.setting(system, &point.parameters), orbit);
    let (other, parameters) = system.field.lengthened(orbit, &at.parameters, share)?;
    let mut start = bare(&parameters, Solution::Cycle(other.clone()));
    let mut problem = of(&start, &other);
    if let Some(u) = damped(&mut problem, &start, CLOSE) {
        start = problem.point(&u, &[], Examination::default());
    }
    let found = growth::polished(&mut problem, growth.settings, &start).ok()?;
    let mut point = Point { position: at.position, step: at.step, ..found.point };
    // The direction of the curve is that of its scalars.
    let scalars = system.field.determined().len() + 2;
    let along: f64 = point.tangent.iter().rev().zip(at.tangent.iter().rev()).take(scalars).map(|(a, b)| a * b).sum();
    if along < 0.0 {
        point.tangent.iter_mut().for_each(|t| *t = -*t);
    }
    Some(point)
}

/// The point of a curve with its orbit lengthened, if the error of the truncation is what limits the curve there.
pub(super) fn relengthened(growth: &Growth, system: &System, line: &Line, at: &Point) -> Option<Point> {
    /// Share of the tolerance from which on the truncation matters.
    const MATTERS: f64 = 0.25;
    let Solution::Cycle(orbit) = &at.solution else { return None };
    let mut problem = CycleProblem::like(line.setting(system, &at.parameters), orbit);
    let u = problem.unknowns_of(at);
    problem.anchor(&u);
    problem.factorise(&u, &parameter_row(u.len())).ok()?;
    let (error, tolerance) = (problem.truncation(&u), growth.settings.tolerance);
    if error.is_nan() || error < MATTERS * tolerance {
        return None;
    }
    drop(problem);
    let share = share_for(MARGIN * tolerance, error);
    [share, share.sqrt(), share.powf(0.25)].into_iter().find_map(|share| resized(growth, system, line, at, share))
}

/// The problem of the orbit in the branch's parameter, with the second one last, which stays.
fn problem_of<'s>(point: &Point, system: &'s System, first: usize, free: usize) -> CycleProblem<'s> {
    let line = Line { held: Some((Kind::Homoclinic, first)), ..Line::new(free) };
    let setting = line.setting(system, &point.parameters);
    let cycle = match &point.solution {
        Solution::Cycle(cycle) => cycle.clone(),
        Solution::Equilibrium(_) | Solution::Torus(_) => Cycle {
            points: crate::problem::gauss::Points::Gauss,
            period: 1.0,
            forcing_periods: 1,
            mesh: vec![0.0, 1.0].into(),
            degree: 4,
            profile: Vec::new(),
            gain: Vec::new(),
        },
    };
    CycleProblem::like(setting, &cycle).without_truncation()
}

/// Solves for the orbit at fixed values of all parameters but the first, and lengthens it until its truncation does not
/// matter.
fn settled<'s>(
    base: &System,
    plan: &Plan,
    curve: &CurvePlan,
    first: usize,
    mut start: Start<'s>,
) -> Result<Start<'s>, String> {
    let tolerance = SHARPER * plan.tolerance;
    let system = start.system(base);
    let settings = growth::settings(&system, tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
    drop(system);
    let solved = |start: &Start, point: &Point| -> Result<(Point, f64), Failure> {
        let system = start.system(base);
        let mut problem = problem_of(point, &system, first, curve.free);
        let mut point = point.clone();
        // Every step lets the conditions refer to its result.
        if let Some(u) = damped(&mut problem, &point, CLOSE) {
            point = problem.point(&u, &[], Examination::default());
        }
        let found = growth::polished(&mut problem, &settings, &point)?;
        problem.set_mesh(&found.mesh);
        let row = parameter_row(found.u.len());
        let error = match problem.factorise(&found.u, &row) {
            Ok(()) => problem.truncation(&found.u),
            Err(_) => f64::NAN,
        };
        Ok((found.point, error))
    };
    let (point, mut error) = solved(&start, &start.point).map_err(|why| {
        format!(
            "Newton's method does not lead from the orbit cut next to the equilibrium to a {} orbit: {why}\nlikely cause: the \
             orbit is still far from one\nwhat to do: follow the branch of cycles further, with a smaller tolerance or \
             more `max-points`, or start near another value of the parameter",
            curve.hold
        )
    })?;
    start.point = point;
    let (mut longest, mut failed) = (SHORTEST, None);
    for _ in 0..LENGTHENINGS {
        let goal = MARGIN * tolerance;
        let sizes = start.field.sizes(&start.point.parameters);
        let at_limit = sizes.iter().zip(start.extents()).all(|(size, extent)| *size < LEAST * extent);
        let far = start.distances_from_saddle_node(tolerance);
        let close = far.iter().all(|far| *far <= 1.0);
        if close && (error <= goal || at_limit && error <= ENOUGH * tolerance) {
            return Ok(start);
        }
        if error.is_nan() {
            return Err("next to the orbit found, the equilibrium is not a saddle as at the start\nlikely cause: Newton's method led \
                        to another equilibrium, which is close\nwhat to do: use another tolerance, or start at other values of the \
                        parameters"
                .into());
        }
        if at_limit && close {
            return Err(format!(
                "the orbit cannot be lengthened until the error of its truncation, {error:.1e}, is below {goal:.1e}\n\
                 likely cause: an eigenvalue of the equilibrium is close to zero\nwhat to do: begin where the \
                 equilibrium is clearly a saddle, or use a larger tolerance"
            ));
        }
        let orbit = start.cycle().ok_or("the orbit is not a cycle")?;
        let by_error = if error <= goal { 1.0 } else { share_for(goal, error) };
        let shares = [0, 1].map(|end| {
            // The error is of second order, or of fifth.
            let own = match start.field.is_slow(end, &start.point.parameters) {
                _ if !start.field.is_bound(end) => 1.0,
                true => by_error.powf(0.4),
                false => by_error,
            };
            // Nine tenths of the distance at which the terms neglected equal the tolerance.
            let by_distance = if far[end] > 1.0 { 0.9 / far[end] } else { 1.0 };
            own.min(by_distance).max(longest)
        });
        let (orbit, parameters) = longer(&start.field, orbit, &start.point.parameters, shares).ok_or(
            "the time that the orbit spends next to the equilibrium is too long\nlikely cause: an eigenvalue of the equilibrium is close to \
             zero, or the equilibrium is nearly a cusp\nwhat to do: begin at other values of the parameters, or use a larger tolerance",
        )?;
        let guess = bare(&parameters, Solution::Cycle(orbit));
        match solved(&start, &guess) {
            Ok(found) => (start.point, error) = found,
            // Less far at once.
            Err(_) if longest < LONGEST => longest = longest.sqrt(),
            Err(_) if error <= ENOUGH * tolerance => return Ok(start),
            Err(why) => {
                failed = Some(why);
                break;
            }
        }
    }
    Err(match failed {
        Some(why) => format!(
            "the orbit cannot be lengthened next to the equilibrium until the error of its truncation, {error:.1e}, is below \
             the tolerance: {why}\nlikely cause: an eigenvalue of the equilibrium is close to zero\nwhat to do: begin where \
             the equilibrium is clearly a saddle, or use a larger tolerance"
        ),
        None => "the truncation error does not decrease when the orbit is lengthened".into(),
    })
}
