//! Continuation of one branch to both sides, from its start or from the end of an earlier run.

use super::counted::Counted;
use super::plan::Holds;
use super::repointed;
use super::symmetry::{is_rotating_wave, rotation};
use super::{System, connections, corner, impacts as beside_impacts, tori};
use crate::continuation::corrector::{Plane, parameter_row, settle, station};
use crate::continuation::{Failure, Follow, Homecoming, Item, Settings, Station, follow};
use crate::contract::{Condition, Event, Examination, Monitor, Observer, Verdict, ZeroProblem};
use crate::diagram::{
    Branch, Connection, Cost, Ending, Family, Kind, NULL_SPACE, Origin, Point, Record, STANDS, Solution, SpecialPoint,
};
use crate::problem::gauss::Points;
use crate::problem::impact::{ImpactProblem, stored::impacts};
use crate::problem::map::MapProblem;
use crate::problem::torus::TorusProblem;
use crate::problem::{Axis, Setting, Tie, cycle::CycleProblem, equilibrium::EquilibriumProblem, held::Held, mesh};
use crate::special::coefficients::Coefficients;
use crate::special::connection::Limits;
use crate::special::mark::Mark;
use crate::special::on_branch_points::OnBranchPoints;
use crate::special::on_connections::{self, limit};
use crate::special::on_cycle_branch_points::OnCycleBranchPoints;
use crate::special::on_levels::{Corner, OnLevels};
use crate::special::on_tangents::OnTangents;
use crate::special::peak::Peak;
use crate::special::quantity::Quantity;
use crate::special::unfolded::UnfoldedCycles;
use crate::special::{self, collapse, grazing, impact, sliding};
use std::cell::{Cell, RefCell};

/// The curve through a point that is to be followed.
#[derive(Clone, Debug, Default)]
pub struct Line {
    /// Index of the continuation parameter.
    pub free: usize,
    /// Parameters that change with it.
    pub ties: Vec<Tie>,
    /// For a bifurcation curve: the bifurcation, and the index of the first parameter, which is solved for.
    pub held: Option<(Kind, usize)>,
    /// True if the branch was born by period doubling.
    pub doubled: bool,
}

impl Line {
    /// Returns a curve in one parameter.
    pub fn new(free: usize) -> Line {
        Line { free, ..Line::default() }
    }

    fn axis(&self, system: &System, index: usize) -> Axis {
        Axis {
            ties: if index == self.free { self.ties.clone() } else { Vec::new() },
            ..Axis::new(index, system.unit(index))
        }
    }

    /// Returns the setting of this curve at given parameters.
    pub(super) fn setting<'a>(&self, system: &'a System, parameters: &[f64]) -> Setting<'a> {
        let others = system.holds.filter(|_| self.held.is_none()).into_iter().flat_map(|holds| &holds.others);
        let determined = system.field.determined().iter().copied();
        let first = determined.chain(others.map(|(index, _)| *index)).chain(self.held.map(|(_, first)| first));
        Setting {
            field: system.field,
            scales: &system.scales,
            parameters: parameters.to_vec(),
            axes: first.chain([self.free]).map(|index| self.axis(system, index)).collect(),
        }
    }

    /// Returns the problem with held quantities through `point`.
    fn holding<'a>(
        &self,
        system: &'a System,
        holds: &Holds,
        setting: Setting<'a>,
        degree: usize,
        point: &Point,
    ) -> Box<dyn ZeroProblem + 'a> {
        if let (Solution::Torus(torus), [level]) = (&point.solution, &holds.levels[..])
            && level.quantity == Quantity::Rotation
        {
            return Box::new(TorusProblem::like(setting, torus, Some(level.value)));
        }
        let (like, surface): (Solution, Box<dyn ZeroProblem + 'a>) = match &point.solution {
            _ if system.field.iterated() => {
                (point.solution.clone(), Box::new(MapProblem::like(setting.clone(), &point.solution)))
            }
            Solution::Equilibrium(_) => (point.solution.clone(), Box::new(EquilibriumProblem::new(setting.clone()))),
            Solution::Cycle(cycle) => {
                let cycle = mesh::at_least_some(cycle, degree);
                let problem = Box::new(CycleProblem::like(setting.clone(), &cycle));
                (Solution::Cycle(cycle), problem)
            }
            Solution::Torus(torus) => {
                (point.solution.clone(), Box::new(TorusProblem::like(setting.clone(), torus, None)))
            }
        };
        let sizes: Vec<f64> = holds.levels.iter().map(|level| system.size_of(level.quantity)).collect();
        let free = setting.freedom() - system.field.determined().len();
        let condition: Box<dyn Condition + 'a> = match &like {
            Solution::Cycle(cycle) if holds.singular => {
                Box::new(OnCycleBranchPoints::in_three_parameters(setting, cycle))
            }
            _ if holds.singular => Box::new(OnBranchPoints::in_further_parameters(setting)),
            _ => Box::new(OnLevels::new(setting, &holds.levels, &sizes, &like)),
        };
        Box::new(Held::new(surface, condition, free))
    }

    /// Returns the problem of this curve through `point`, on the mesh of the point.
    pub fn problem<'a>(&self, system: &'a System, degree: usize, point: &Point) -> Box<dyn ZeroProblem + 'a> {
        let setting = self.setting(system, &point.parameters);
        if let Some(holds) = system.holds.filter(|_| self.held.is_none()) {
            return self.holding(system, holds, setting, degree, point);
        }
        let axes = setting.axes;
        match self.held.and_then(|(kind, _)| held(system, kind, axes.clone(), degree, point)) {
            Some(held) => Box::new(held),
            None => surface(system, axes, degree, point, self.held.map(|(kind, _)| kind), self.doubled),
        }
    }
}

fn setting_of<'a>(system: &'a System, axes: Vec<Axis>, point: &Point) -> Setting<'a> {
    Setting { field: system.field, scales: &system.scales, parameters: point.parameters.clone(), axes }
}

/// Returns the bifurcations of a kind in the parameters of `axes` as a problem through `point`, on its mesh; `None` if it
/// cannot be posed for such solutions.
pub fn held<'a>(system: &'a System, kind: Kind, axes: Vec<Axis>, degree: usize, point: &Point) -> Option<Held<'a>> {
    let setting = setting_of(system, axes.clone(), point);
    let free = axes.len() - system.field.determined().len();
    if let (Kind::BranchPoint, Solution::Cycle(cycle), Some(unfolded), false) =
        (kind, &point.solution, system.unfolded, system.field.iterated())
    {
        let cycle = mesh::at_least_some(cycle, degree);
        let own = UnfoldedCycles::setting(&setting, unfolded, &system.scales, &cycle);
        let condition: Box<dyn Condition + 'a> = match system.is_open() {
            true => Box::new(OnTangents::new(kind, own.clone(), &cycle)?),
            false => Box::new(OnCycleBranchPoints::new(own.clone(), &cycle)),
        };
        let surface = UnfoldedCycles::new(CycleProblem::like(own, &cycle), setting.parameters.len(), axes.len());
        return Some(Held::new(Box::new(surface), condition, free + 1));
    }
    let condition = special::condition::condition(kind, setting, degree, &point.solution)?;
    let unfolded = kind == Kind::BranchPoint && !system.field.iterated();
    let surface = surface(system, axes, degree, point, Some(kind), false);
    Some(Held::new(surface, condition, free + usize::from(unfolded)))
}

/// Returns the problem of solutions in the parameters of `axes` like `point`, on its mesh: without a condition, but for
/// branch points of equilibria with the amplitude of their unfolding. `doubled` as in [`Line`].
pub fn surface<'a>(
    system: &'a System,
    axes: Vec<Axis>,
    degree: usize,
    point: &Point,
    kind: Option<Kind>,
    doubled: bool,
) -> Box<dyn ZeroProblem + 'a> {
    let setting = setting_of(system, axes, point);
    if let Solution::Cycle(cycle) = &point.solution {
        let with_events = match kind {
            Some(Kind::ImpactGrazing) => ImpactProblem::besides_grazing(setting.clone(), cycle),
            _ => ImpactProblem::like(setting.clone(), cycle),
        };
        if let Some(problem) = with_events {
            return Box::new(problem);
        }
    }
    match &point.solution {
        solution if system.field.iterated() => Box::new(MapProblem::like(setting, solution)),
        Solution::Equilibrium(_) if kind == Some(Kind::BranchPoint) => Box::new(EquilibriumProblem::unfolded(setting)),
        Solution::Equilibrium(_) => Box::new(EquilibriumProblem::new(setting)),
        Solution::Cycle(cycle) if doubled && cycle.intervals() > 0 => {
            Box::new(CycleProblem::like(setting, cycle).with_equal_halves())
        }
        Solution::Cycle(cycle) => Box::new(CycleProblem::like(setting, &mesh::at_least_some(cycle, degree))),
        Solution::Torus(torus) => Box::new(TorusProblem::like(setting, torus, None)),
    }
}

/// Returns the problem of the curve in one parameter through `point`, on the mesh of the point; `doubled` if its branch
/// was born by period doubling.
pub fn problem_of<'a>(
    system: &'a System,
    free: usize,
    degree: usize,
    point: &Point,
    doubled: bool,
) -> Box<dyn ZeroProblem + 'a> {
    Line { doubled, ..Line::new(free) }.problem(system, degree, point)
}

/// Returns the setting of a system at given parameters.
pub fn setting<'a>(system: &'a System, free: usize, parameters: &[f64]) -> Setting<'a> {
    Setting {
        field: system.field,
        scales: &system.scales,
        parameters: parameters.to_vec(),
        axes: system.field.determined().iter().chain([&free]).map(|k| Axis::new(*k, system.unit(*k))).collect(),
    }
}

/// Returns the continuation settings of a branch.
pub fn settings(system: &System, tolerance: f64, range: [f64; 2], max_points: usize) -> Settings {
    let usual = Settings::new(tolerance, range, &system.scales);
    let periods = system.field.periods().to_vec();
    Settings {
        symmetries: system.symmetries.clone(),
        exchanges: system.exchanges.clone(),
        periods,
        max_points,
        kinks: system.field.switch_count() - system.field.event_count(),
        ..usual
    }
}

/// Solves at fixed parameters from an approximate solution. The tangent points towards larger parameter values.
///
/// # Errors
/// See [`Failure`].
pub fn polished(problem: &mut dyn ZeroProblem, settings: &Settings, point: &Point) -> Result<Station, Failure> {
    let u = problem.unknowns_of(point);
    problem.anchor(&u);
    let (row, value) = (parameter_row(u.len()), u[u.len() - 1]);
    let plane = Plane { row, base: u.clone(), distance: 0.0 };
    let mut found = settle(problem, settings, plane, u, 1.0, &mut Cost::default())?;
    // The exact value, without the rounding of Newton's method; a second parameter keeps the value solved for.
    let last = found.u.len() - 1;
    found.u[last] = value;
    found.point.parameters = problem.point(&found.u, &found.tangent, Examination::default()).parameters;
    Ok(found)
}

/// A first solution at the parameters of `point`: that of [`polished`] or, if solutions are not isolated, as with a
/// conserved quantity, the nearest member of their family.
///
/// # Errors
/// See [`polished`].
pub fn first(problem: &mut dyn ZeroProblem, settings: &Settings, point: &Point) -> Result<Station, Failure> {
    let mesh = problem.mesh();
    polished(problem, settings, point).or_else(|why| {
        problem.set_mesh(&mesh);
        family_member(problem, settings, point).ok_or(why)
    })
}

/// The solution nearest to `point` of a family at a single parameter value, in the hyperplane orthogonal to the family.
/// `None` if the parameter changes on the way there, in which case there is no family.
fn family_member(problem: &mut dyn ZeroProblem, settings: &Settings, point: &Point) -> Option<Station> {
    /// Change of the scaled parameter, in tolerances, that rounding and discretisation can produce: a factor of safety.
    const STAYS: f64 = 10.0;
    let u = problem.unknowns_of(point);
    problem.anchor(&u);
    let value = u[u.len() - 1];
    let row = direction(problem, &u).ok()?;
    let plane = Plane { row, base: u.clone(), distance: 0.0 };
    let mut found = settle(problem, settings, plane, u, 1.0, &mut Cost::default()).ok()?;
    // On another mesh the number of unknowns differs.
    let last = found.u.len() - 1;
    if (found.u[last] - value).abs() > STAYS * settings.tolerance {
        return None;
    }
    found.u[last] = value;
    found.point.parameters = problem.point(&found.u, &found.tangent, Examination::default()).parameters;
    Some(found)
}

/// Returns the tangent of the curve at `u`, a point close to it.
pub(super) fn direction(problem: &mut dyn ZeroProblem, u: &[f64]) -> Result<Vec<f64>, Failure> {
    // Any row serves for the first tangent unless it is orthogonal to it.
    let mut row: Vec<f64> = (0..u.len()).map(|k| 0.6 + (k as f64 * 0.0113).sin() + (k as f64 * 1.37).cos()).collect();
    let mut last = vec![0.0; u.len()];
    last[u.len() - 1] = 1.0;
    for _ in 0..2 {
        problem.factorise(u, &row).map_err(|_| Failure::Singular)?;
        let mut tangent = vec![0.0; u.len()];
        problem.solve(&last, &mut tangent);
        let norm = problem.dot(&tangent, &tangent).sqrt();
        row = tangent.iter().map(|t| t / norm).collect();
    }
    Ok(row)
}

/// A solution on the curve at some distance from `point`, which may be a fold. A branch that started at or next to a
/// fold could not recognise its start when it returns. Steps continue until the slope of the parameter is clearly
/// non-zero.
///
/// # Errors
/// See [`Failure`].
pub fn beside(problem: &mut dyn ZeroProblem, settings: &Settings, point: &Point) -> Result<Point, Failure> {
    /// Step lengths in the order of trial: a quarter of the longest step of a branch, then shorter by factors of five.
    /// Empirical.
    const DISTANCES: [f64; 4] = [0.05, 0.01, 2e-3, 4e-4];
    /// Slope of the parameter at which the solution is far enough from a fold. Empirical.
    const SLOPE: f64 = 0.15;
    /// Largest number of steps: a bound on the work on curves along which the parameter hardly changes.
    const FARTHEST: usize = 12;
    let u = problem.unknowns_of(point);
    problem.anchor(&u);
    let row = direction(problem, &u)?;
    let mut cost = Cost::default();
    let plane = Plane { row, base: u.clone(), distance: 0.0 };
    let mut there = settle(problem, settings, plane, u, 1.0, &mut cost)?;
    for count in 0..FARTHEST {
        let mut next = Err(Failure::Singular);
        for distance in DISTANCES {
            problem.set_mesh(&there.mesh);
            problem.anchor(&there.u);
            let guess = there.u.iter().zip(&there.tangent).map(|(u, t)| u + distance * t).collect();
            let plane = Plane { row: there.tangent.clone(), base: there.u.clone(), distance };
            next = settle(problem, settings, plane, guess, 1.0, &mut cost);
            if next.is_ok() {
                break;
            }
        }
        match next {
            Ok(found) => there = found,
            Err(why) if count == 0 => return Err(why),
            Err(_) => break,
        }
        if there.slope().abs() > SLOPE {
            break;
        }
    }
    Ok(there.point)
}

/// Restores a curve point from a stored point.
pub(super) fn revived(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    point: &Point,
    direction: f64,
) -> Result<Station, Failure> {
    if let Solution::Cycle(cycle) = &point.solution {
        problem.set_mesh(&cycle.mesh);
    }
    let u = problem.unknowns_of(point);
    let tangent: Vec<f64> = point.tangent.iter().map(|t| direction * t).collect();
    problem.anchor(&u);
    let close = settings.closeness(&problem.mesh(), f64::INFINITY);
    let mut found = station(problem, u.clone(), &tangent, close, direction, &mut Cost::default())?;
    found.roomier = problem.better_mesh(&found.u, 0.5 * settings.tolerance);
    found.point = point.clone();
    (found.u, found.tangent) = (u, tangent);
    Ok(found)
}

/// First points of a branch.
pub enum Beginning {
    /// One point inside the branch; both sides are followed.
    Inside(Station),
    /// The first points of a branch that starts at a special point; only the forward side is followed.
    Edge {
        /// Points before `first`, by position: the special point itself, where it is a point of this branch.
        before: Vec<Point>,
        /// The first point off the special point.
        first: Station,
        /// Its start, as an ending.
        joined: Ending,
    },
}

/// Everything about a branch that does not change while it is followed.
pub struct Growth<'g> {
    /// The system.
    pub system: &'g System<'g>,
    /// Continuation settings.
    pub settings: &'g Settings,
    /// Degree of collocation polynomials.
    pub degree: usize,
    /// Parameters that change with the continuation parameter.
    pub ties: Vec<Tie>,
    /// Sides to follow: backward, forward.
    pub sides: [bool; 2],
    /// Special points of the branch that this one was switched from; it may end at another of them.
    pub parents: &'g [SpecialPoint],
    /// Values to mark, or to stop at.
    pub marks: &'g [Mark],
    /// The observer.
    pub observer: &'g dyn Observer,
    /// True if inner points stay in memory whole even if the observer could recall them.
    pub whole: bool,
    /// True if only the start and the ends of the branch stay in memory.
    pub sparse: bool,
}

/// Number of corners on one side of a branch, after which something is wrong.
const CORNERS: usize = 32;
/// Multiple of its error by which a cycle may pass the surface of an event before it counts as no motion, and the least
/// such error: rounding.
const TRESPASS: [f64; 2] = [10.0, 1e-10];
/// Number of times that a connecting orbit is lengthened on one side of a curve: a bound on the work.
const LENGTHENINGS: usize = 20;
/// Points at either end of a branch that always stay whole, since continuation needs them.
const WHOLE: usize = 3;

impl Growth<'_> {
    /// Follows a new branch. Returns false if the observer wants to stop.
    pub fn begin(&self, branch: &mut Branch, beginning: Beginning) -> bool {
        branch.units = [branch.held.map_or(1.0, |(_, first)| self.system.unit(first)), self.system.unit(branch.free)];
        if let Some(holds) = self.system.holds {
            branch.also = holds.others.iter().map(|(index, _)| (*index, self.system.unit(*index))).collect();
            branch.levels = holds.levels.iter().map(|level| (level.name.clone(), level.value)).collect();
        }
        let mut going = self.tell(Event::Begin(branch));
        match beginning {
            Beginning::Inside(mut start) => {
                self.count(branch, &mut start.point);
                going &= self.accept(branch, Point { position: 0, step: self.settings.first_step, ..start.point });
                going &= self.note_undefined_coefficient(branch);
                going &= self.mark_start(branch);
            }
            Beginning::Edge { before, mut first, joined } => {
                let count = before.len() as i64;
                self.count(branch, &mut first.point);
                for (position, point) in before.into_iter().enumerate() {
                    let unstable = first.point.unstable;
                    going &= self.accept(branch, Point { position: position as i64, unstable, ..point });
                }
                going &= self.accept(branch, Point { position: count, ..first.point });
                going &= self.end(branch, 0, joined);
            }
        }
        self.finish(branch, going)
    }

    /// Excludes multipliers that are on the unit circle by structure from the number of unstable ones at the start of a branch.
    fn count(&self, branch: &Branch, start: &mut Point) {
        // Near a bifurcation the slope contains the rounding of the parameter divided by a small distance.
        let next_to = !starts_inside(branch) && start.parameter_slope().abs() < STANDS / super::switch::DISTANCES[0];
        let family = start.is_one_of_family() || (next_to && start.solution.period().is_some());
        let neutral = self.system.holds.is_some() && start.neutral_multiplier().is_some();
        if !self.settings.stability {
            return;
        }
        if family || neutral || self.is_symmetric(branch, start) {
            start.unstable = start.unstable_besides_neutral();
        }
        start.count_if_conservative();
    }

    /// True if cycles form families because the model has a rotational symmetry that leads from one to another.
    fn is_symmetric(&self, branch: &Branch, at: &Point) -> bool {
        let wave = |pairs: Vec<[usize; 2]>| is_rotating_wave(self.system, &pairs, at);
        branch.family == Family::Cycle
            && branch.held.is_none()
            && rotation(self.system, &at.parameters).is_some_and(|pairs| !wave(pairs))
    }

    /// Notes that a curve cannot be searched for points at which a coefficient vanishes, if that coefficient is not
    /// defined on it.
    fn note_undefined_coefficient(&self, branch: &Branch) -> bool {
        let sought = match branch.held {
            Some((Kind::PeriodDoubling, _)) => Kind::GeneralisedPeriodDoubling,
            Some((Kind::Torus, _)) => Kind::Chenciner,
            _ => return true,
        };
        let Some(start) = branch.points.first().filter(|_| !self.system.field.iterated()) else { return true };
        if self.system.field.event_count() > 0 {
            let note =
                format!("{sought} points are not searched for: normal forms of cycles with events are not computed");
            return self.tell(Event::Note(&branch.name, &note));
        }
        let own = setting(self.system, branch.free, &start.parameters);
        let count = special::cycle_form::switches_passed(&own, start);
        let note = format!(
            "{sought} points are not searched for: their normal form coefficient is undefined on orbits that cross \
             switching points of the right-hand side ({count} crossings at the start)"
        );
        count == 0 || self.tell(Event::Note(&branch.name, &note))
    }

    /// Adds a mark at the start of a branch, unless it is there already: no step passes over the start.
    fn mark_start(&self, branch: &mut Branch) -> bool {
        let Some(point) = branch.points.iter().find(|p| p.position == 0) else { return true };
        let known =
            |s: &SpecialPoint| s.kind == Kind::Mark && s.point.position == 0 && s.point.parameters == point.parameters;
        let meant = |mark: &Mark| mark.meets(point, self.system.field);
        if !self.marks.iter().any(meant) || branch.special.iter().any(known) {
            return true;
        }
        let special = SpecialPoint {
            kind: Kind::Mark,
            unstable_before: point.unstable,
            unstable_after: point.unstable,
            error: 10.0 * self.settings.newton_tolerance(),
            coefficients: Vec::new(),
            coefficient_errors: Vec::new(),
            remark: String::new(),
            point: point.clone(),
        };
        branch.insert_special(special.clone());
        self.tell(Event::Special(branch, &special))
    }

    /// Resumes a branch of an earlier run. Returns false if the observer wants to stop.
    pub fn resume(&self, branch: &mut Branch) -> bool {
        let (low, high) = match (branch.points.first(), branch.points.last()) {
            (Some(a), Some(b)) => (a.position, b.position),
            _ => return true,
        };
        // A special point in a step whose far end was not stored is found again, unless the side has ended with it.
        let [backward, forward] = [0, 1].map(|side| branch.ends[side].is_some());
        branch.special.retain(|s| (backward || s.point.position >= low) && (forward || s.point.position < high));
        let mut going = self.tell(Event::Begin(branch));
        if starts_inside(branch) {
            going &= self.mark_start(branch);
        }
        self.finish(branch, going)
    }

    fn finish(&self, branch: &mut Branch, mut going: bool) -> bool {
        for side in [1, 0] {
            // Closure was found from the other side, now or in an earlier run.
            if branch.ends[side].is_none() && branch.ends[1 - side] == Some(Ending::Closed) {
                going &= self.end(branch, side, Ending::Closed);
            }
            if !going {
                break;
            }
            if !self.sides[side] && branch.ends[side].is_none() {
                let at =
                    branch.points.first().map_or(f64::NAN, |p| p.parameters.get(branch.free).copied().unwrap_or(0.0));
                going &= self.end(branch, side, Ending::Bound(at));
            }
            if let Some(ending) = self.at_edge(branch, side).filter(|_| branch.ends[side].is_none()) {
                going &= self.end(branch, side, ending);
            }
            if branch.ends[side].is_none() {
                let ending = self.side(branch, side);
                going &= ending != Ending::Stopped;
                if ending == Ending::Stopped {
                    break;
                }
                let ending = self.recognised(branch, side, self.at_generalised_hopf(branch, side, ending));
                let ending = self.at_double_hopf(branch, side, ending);
                let ending = self.explain_missing_period(branch, side, ending);
                going &= self.end(branch, side, ending);
            }
        }
        if branch.ends.iter().all(Option::is_some) {
            going &= self.tell(Event::End(branch));
        }
        going
    }

    fn side(&self, branch: &mut Branch, side: usize) -> Ending {
        let direction = if side == 1 { 1.0 } else { -1.0 };
        let own: Vec<&Point> = if side == 1 {
            branch.points.iter().rev().take_while(|p| p.position >= 0).take(2).collect()
        } else {
            branch.points.iter().take_while(|p| p.position <= 0).take(2).collect()
        };
        let Some(&last) = own.first() else { return Ending::NoStart("the branch has no point to start from".into()) };
        let last = last.clone();
        let before = own.get(1).map(|p| (*p).clone());
        let emitted = last.position.unsigned_abs() as usize;
        let counted = Counted::new(self.system.field);
        let unfolded = self.system.unfolded.map(|own| own.over(&counted));
        let system = System { field: &counted, unfolded: unfolded.as_ref(), ..self.system.clone() };
        let mut problem = self.line(branch).problem(&system, self.degree, &last);
        let holds = branch.held.is_none() && {
            let (u, along) = (problem.unknowns_of(&last), &last.tangent);
            let along: Vec<f64> = along.iter().map(|t| direction * t).collect();
            u.len() == along.len() && problem.hold_branch(&u, &along)
        };
        // A boundary-value problem has no stability, and stored points say so; on the way, a sign is counted.
        let counted_at = |point: &Point| match branch.family {
            Family::Arc => usize::from(point.spectrum.first().is_some_and(|z| z.re > 1.0)),
            _ => point.unstable,
        };
        let revive = |problem: &mut dyn ZeroProblem, point: &Point| {
            let mut found = revived(problem, self.settings, point, direction)?;
            found.point.unstable = counted_at(point);
            Ok::<Station, Failure>(found)
        };
        // The special point at which a branch starts is no predecessor: the matrix is singular there.
        let before = before.filter(|p| p.position != 0 || starts_inside(branch));
        // Beyond a switching surface the branch has another direction.
        let on_surface = |s: &SpecialPoint| {
            s.kind == Kind::BoundaryEquilibrium
                && s.point.solution == last.solution
                && s.point.parameters == last.parameters
        };
        let before = before.filter(|_| !branch.special.iter().any(on_surface));
        let previous = before.and_then(|p| revive(&mut *problem, &p).ok());
        let mut start = match revive(&mut *problem, &last) {
            Ok(start) => start,
            Err(_) if self.observer.stopping() => return Ending::Stopped,
            Err(why) => return Ending::NoStart(why.to_string()),
        };
        if emitted == 0 {
            start.point.step = self.settings.first_step;
        }
        // Where quantities are held, a conservative system has a multiplier 1 but no vertical branch.
        let neutral = system.holds.is_some() && last.neutral_multiplier().is_some();
        let symmetric = neutral || self.is_symmetric(branch, &last);
        let (monitors, collapses) = match branch.held {
            None if system.holds.is_some_and(|holds| holds.singular) => (Vec::new(), Vec::new()),
            None if system.holds.is_some() => {
                let own = special::monitors_of_held_quantities(branch.family, symmetric, branch.free);
                (own, collapses(branch, &system))
            }
            None => (special::monitors(branch.family, symmetric), collapses(branch, &system)),
            Some((kind, first)) => {
                let monitors =
                    special::monitors_where_held(system.field, &system.scales, branch.family, kind, branch.free);
                // Here the Hopf points lie along the second parameter.
                let at = limit_of_small_cycles(branch, kind).filter(|_| !system.field.forced());
                (monitors, at.map(|at| shrinks(&system, first, at)).into_iter().collect())
            }
        };
        let own = self.line(branch).setting(&system, &last.parameters);
        let mut marks: Vec<Box<dyn Monitor + '_>> =
            self.marks.iter().map(|mark| mark.monitor(system.size_of(mark.quantity), &own)).collect();
        if let Some(holds) = system.holds {
            let sizes: Vec<f64> = holds.levels.iter().map(|level| system.size_of(level.quantity)).collect();
            let corners = Corner::all(system.field, &holds.levels, &sizes, self.settings.tolerance);
            marks.extend(corners.into_iter().map(|corner| Box::new(corner) as Box<dyn Monitor>));
        }
        let on_surfaces =
            branch.held.is_some_and(|(kind, _)| matches!(kind, Kind::Grazing | Kind::BoundaryEquilibrium));
        if !on_surfaces && !system.field.iterated() {
            let free = branch.held.map(|(_, first)| first).into_iter().chain([branch.free]);
            let axes: Vec<(usize, f64)> = free.map(|index| (index, system.unit(index))).collect();
            marks.extend(grazing::monitors(system.field, branch.family == Family::Cycle, &axes));
            if branch.family == Family::Cycle {
                marks.extend(sliding::monitors(system.field));
            }
            match branch.held {
                None => marks.extend(impact::monitors(system.field, branch.family == Family::Cycle)),
                Some((kind, _)) if branch.family == Family::Cycle => {
                    marks.extend(impact::on_curves(system.field, kind == Kind::ImpactGrazing));
                }
                Some(_) => {}
            }
        }
        if on_surfaces && branch.family == Family::Cycle {
            marks.extend(impact::on_curves(system.field, false));
        }
        let home = branch.points.iter().find(|p| p.position == 0).filter(|_| branch.ends[0].is_none());
        let home = home.map(|point| Point { unstable: counted_at(point), ..point.clone() });
        let limits = Limits {
            field: system.field,
            free: branch.free,
            scales: &system.scales,
            unit: system.unit(branch.free),
            tolerance: self.settings.tolerance,
        };
        let on_curve = branch.held.is_some();
        let (free, corners) = (branch.free, branch.held.is_none() && system.holds.is_none() && self.settings.kinks > 0);
        let free_cycles = branch.held.is_none() && !system.field.forced();
        let (connecting, line) = (branch.is_connecting(), self.line(branch));
        let node = matches!(branch.held, Some((Kind::SaddleNodeHomoclinic, _)));
        // The leading rate at which an orbit was last cut; it is tried again where that has halved.
        let (cut_at, too_long) = (Cell::new(f64::INFINITY), Cell::new(false));
        let held_here = branch.held;
        let at_axis = |at: &Point| {
            if !connecting {
                return None;
            }
            let long = limit::long(at, system.field.time_unit(&at.parameters)).filter(|rate| 2.0 * rate < cut_at.get());
            too_long.set(long.is_some());
            cut_at.set(long.unwrap_or(cut_at.get()));
            let ends = limit::reached(at, node).or_else(|| {
                let (_, first) = held_here.filter(|(kind, _)| *kind == Kind::Homoclinic)?;
                let free = [first, free].map(|index| (index, system.unit(index)));
                limit::at_takens(system.field, &system.scales, free, self.settings.tolerance, at)
            });
            ends.or(long.map(|_| Ending::Stopped))
        };
        let next_points: RefCell<Option<Points>> = RefCell::default();
        let may_change = Cell::new(branch.held.is_none() && system.holds.is_none());
        // Asked only where the branch has not ended, so that a change of the points hides no end.
        let at_change = |at: &Point| {
            let better = may_change.get().then(|| repointed::better(self.system, at)).flatten();
            next_points.replace(better);
            better.map(|_| Ending::Stopped)
        };
        let turned = |at: &Point| corner::limit(system.field, at, free).filter(|_| corners);
        let mut walk = Follow {
            problem: &mut *problem,
            settings: self.settings,
            monitors: &monitors,
            marks: &marks,
            collapses: &collapses,
            limit: &|at| limits.approached(at).filter(|_| free_cycles),
            corner: &|at| turned(at).or_else(|| at_axis(at)).or_else(|| at_change(at)),
            direction,
            symmetric,
            holds,
            free: branch.free,
            home: home.as_ref(),
            first_period: branch.points.iter().min_by_key(|p| p.position.abs()).and_then(|p| p.solution.free_period()),
            homecoming: Homecoming::default(),
            inspected: 0.0,
            resolved: f64::INFINITY,
        };
        // A resumed run may already be on its way back to the start.
        let mut before: Vec<&Point> = branch.points.iter().filter(|p| p.position as f64 * direction > 0.0).collect();
        before.sort_by_key(|p| p.position.abs());
        before.into_iter().for_each(|p| walk.leaves_home(p));
        let record = RefCell::new(Record::at(&last, side == 1));
        let recorded = self.settings.stability && branch.held.is_none() && branch.family != Family::Arc;
        let latest = RefCell::new(last);
        let beyond: RefCell<Option<beside_impacts::Beyond>> = RefCell::new(None);
        // Parameters of the last impact grazing, and the number of unstable multipliers beyond it.
        let grazed: RefCell<Option<(Vec<f64>, usize)>> = RefCell::new(None);
        let doubled = is_doubled(branch);
        let trespassed: RefCell<Option<String>> = RefCell::new(None);
        let trespasses = |point: &Point| {
            let error = (point.trust.discretisation + point.trust.residual).max(TRESPASS[1]);
            trespassed.replace(impact::trespass([TRESPASS[0] * error; 2], system.field, point));
            trespassed.borrow().is_some()
        };
        let mut sink = |item: Item| {
            // Discard items found after the field stopped returning values.
            if self.observer.stopping() {
                return Verdict::Stop;
            }
            let going = match item {
                Item::Special(mut special) => {
                    // The parameter may be stationary where the speed of an impact vanishes; that is no fold.
                    if matches!(special.kind, Kind::Fold | Kind::BranchPoint)
                        && beside_impacts::grazes(system.field, &special.point)
                    {
                        return Verdict::Continue;
                    }
                    // A touch that is none, since the errors of its cycle are larger than what decides.
                    if special.kind == Kind::ImpactGrazing && branch.held.is_none() && trespasses(&special.point) {
                        return Verdict::Stop;
                    }
                    if special.kind == Kind::NonCentral {
                        // Its position depends on where the orbit is cut. The terms that its test function neglects are below the tolerance.
                        let cut = special.point.trust.discretisation;
                        special.error += self.settings.tolerance + if cut.is_finite() { cut } else { 0.0 };
                    }
                    let plain = special.clone();
                    if special.kind == Kind::ImpactGrazing && branch.held.is_some() {
                        special.remark = "the sequence of events of this curve ends".into();
                    } else if special.kind == Kind::ImpactGrazing {
                        let found =
                            beside_impacts::beyond(&system, self.settings, branch.free, &special.point, direction);
                        let next = found.as_ref().map(|(_, next)| next);
                        self.tell_impacts(&system, branch, side, &mut special, next);
                        beyond.replace(found);
                        let after = if side == 1 { special.unstable_after } else { special.unstable_before };
                        grazed.replace(Some((special.point.parameters.clone(), after)));
                    }
                    self.tell_folds(&system, branch, &mut special);
                    if branch.family == Family::Arc {
                        (special.unstable_before, special.unstable_after) = (0, 0);
                    }
                    // A mere turning point of a curve has none.
                    if branch.held.is_none() || special.kind.has_codimension_two() {
                        let found = self.coefficients(&system, branch, side, &special);
                        (special.coefficients, special.coefficient_errors) = (found.values, found.errors);
                        special.remark = found.remark;
                    }
                    self.place_exactly(&system, branch, &mut special);
                    branch.insert_special(special.clone());
                    let counted = if special.kind == Kind::ImpactGrazing { &special } else { &plain };
                    let misfit = record.borrow_mut().special(counted);
                    self.tell(Event::Special(branch, &special)) && (!recorded || self.fits(branch, &special, &misfit))
                }
                Item::Point(mut point) => {
                    // The grazing cycle itself follows its special point and belongs to the far side.
                    if let Some((_, after)) = grazed.take().filter(|(there, _)| *there == point.parameters) {
                        point.unstable = after;
                    }
                    latest.replace(point.clone());
                    [point.cost.evaluations, point.cost.linearisations] = counted.take();
                    if system.field.event_count() > 0 && branch.held.is_none() && trespasses(&point) {
                        return Verdict::Stop;
                    }
                    let before = record.borrow_mut().point(&point).filter(|_| recorded);
                    before.is_none_or(|before| self.unexplained(branch, before, &point)) && self.accept(branch, point)
                }
            };
            if going { Verdict::Continue } else { Verdict::Stop }
        };
        let mut ending = follow(&mut walk, start, previous, emitted, &mut sink);
        // Beyond a corner the branch goes on with the same problem, and beyond an impact grazing with another sequence of events.
        let mut other: Option<Box<dyn ZeroProblem + '_>> = None;
        for _ in 0..CORNERS {
            let Ending::Joined { at: at @ (Kind::Grazing | Kind::ImpactGrazing), .. } = ending else { break };
            if self.observer.stopping() {
                break;
            }
            let there = latest.borrow().clone();
            let mut next = None;
            if at == Kind::ImpactGrazing {
                if let Some(why) = beside_impacts::accumulation(system.field, &there) {
                    ending = Ending::GivenUp(why);
                    break;
                }
                // A doubled cycle may go over into one of half the period, which lies on another branch.
                let halved = |(_, next): &beside_impacts::Beyond| {
                    doubled && collapse::repeats(&next.point, 100.0 * self.settings.tolerance)
                };
                match beyond.take() {
                    Some(next) if halved(&next) => break,
                    Some((problem, station)) => (other, next) = (Some(problem), Some(station)),
                    None if on_curve => break,
                    None => {
                        ending = Ending::GivenUp(
                            "no cycle with another sequence of impacts was found beside an impact grazing; with a \
                             smaller tolerance weaker impacts are resolved"
                                .into(),
                        );
                        break;
                    }
                }
            }
            let holds = walk.holds && other.is_none();
            let problem = match &mut other {
                Some(problem) => &mut **problem,
                None => &mut *walk.problem,
            };
            let mut walk =
                Follow { problem, holds, homecoming: Homecoming::default(), inspected: walk.inspected, ..walk };
            let mut stops = false;
            let mut right = match next {
                Some(next) => next,
                None => {
                    let left = revived(walk.problem, self.settings, &there, direction).ok();
                    let found = left
                        .and_then(|left| corner::beyond(walk.problem, self.settings, system.field, &left, direction));
                    let Some((mut special, right)) = found else { break };
                    // That of the lower of its neighbours.
                    special.point.position = there.position - i64::from(side == 0);
                    stops = sink(Item::Special(special)) == Verdict::Stop;
                    right
                }
            };
            right.point.position = there.position + if side == 1 { 1 } else { -1 };
            let emitted = right.point.position.unsigned_abs() as usize;
            stops = stops || sink(Item::Point(right.point.clone())) == Verdict::Stop;
            ending = if stops { Ending::Stopped } else { follow(&mut walk, right, None, emitted, &mut sink) };
        }
        if let Ending::Joined { at: Kind::Grazing, parameter } = ending {
            ending =
                Ending::StepTooSmall(format!("no direction was found in which the branch continues at {parameter}"));
        }
        // A connecting orbit that has come to need longer ends goes on with them.
        for _ in 0..LENGTHENINGS {
            let long = too_long.take() && ending == Ending::Stopped;
            let short =
                connecting && matches!(ending, Ending::StepTooSmall(_) | Ending::MeshTooLarge(_) | Ending::GivenUp(_));
            if !(short || long) || self.observer.stopping() {
                break;
            }
            let there = latest.borrow().clone();
            let found = match long {
                true => connections::shortened(self, &system, &line, &there),
                false => connections::relengthened(self, &system, &line, &there),
            };
            let (mut next, is_new) = match found {
                Some(next) => (next, true),
                None if long => (there, false),
                None => break,
            };
            next.position += if side == 1 { 1 } else { -1 } * i64::from(is_new);
            let mut problem = line.problem(&system, self.degree, &next);
            let Ok(start) = revived(&mut *problem, self.settings, &next, direction) else { break };
            let mut walk = Follow { holds: false, limit: &|_| None, corner: &at_axis, ..walk.on(&mut *problem) };
            let position = next.position.unsigned_abs() as usize;
            ending = match is_new && sink(Item::Point(next)) == Verdict::Stop {
                true => Ending::Stopped,
                false => follow(&mut walk, start, None, position, &mut sink),
            };
        }
        if let Some(why) = trespassed.take() {
            return Ending::GivenUp(format!(
                "the next point is no motion: {why}; with a smaller tolerance weaker impacts are resolved, unless they \
                 accumulate (chatter)"
            ));
        }
        // An interrupted run ends for reasons that have nothing to do with the branch.
        if self.observer.stopping() {
            return Ending::Stopped;
        }
        if too_long.get() && ending == Ending::Stopped {
            ending = Ending::GivenUp("the orbit next to the equilibrium grew too long too often".into());
        }
        while let Some(points) = next_points.take() {
            // A branch that has returned to Gauss points stays there.
            may_change.set(points == Points::Radau);
            let last = latest.borrow().clone();
            let there = repointed::repointed(&last, points);
            let mut problem = line.problem(&system, self.degree, &there);
            let (next, home, stops) = match repointed::again(&mut *problem, self.settings, &there, direction) {
                Ok(mut next) => {
                    next.point.position += if side == 1 { 1 } else { -1 };
                    let stops = sink(Item::Point(next.point.clone())) == Verdict::Stop;
                    (next, home.as_ref().map(|home| repointed::repointed(home, points)), stops)
                }
                Err(_) => {
                    may_change.set(false);
                    problem = line.problem(&system, self.degree, &last);
                    match revived(&mut *problem, self.settings, &last, direction) {
                        Ok(next) => (next, home.clone(), false),
                        Err(why) => return Ending::NoStart(why.to_string()),
                    }
                }
            };
            let position = next.point.position.unsigned_abs() as usize;
            let mut walk = Follow { home: home.as_ref(), ..walk.on(&mut *problem) };
            ending = match stops {
                true => Ending::Stopped,
                false => follow(&mut walk, next, None, position, &mut sink),
            };
            if self.observer.stopping() {
                return Ending::Stopped;
            }
        }
        match ending {
            Ending::StepTooSmall(why) if branch.is_connecting() => {
                Ending::StepTooSmall(on_connections::at_bifurcation(&latest.borrow(), why, node))
            }
            Ending::GivenUp(why) if branch.is_connecting() => {
                Ending::GivenUp(on_connections::at_bifurcation(&latest.borrow(), why, node))
            }
            Ending::PeriodUnbounded(period) if free_cycles => {
                // The saddle-node is solved for, so that the last cycle need not have its parameter to the tolerance: the law of the
                // period decides, which holds to first order in the distance.
                const NEAR: f64 = 1e-2;
                let near = Limits { tolerance: NEAR, ..limits }.approached(&latest.borrow());
                let node = |end: &Ending| matches!(end, Ending::Connecting { connection: Connection::SaddleNode, .. });
                near.filter(node).unwrap_or(Ending::PeriodUnbounded(period))
            }
            Ending::StepTooSmall(why) if branch.family == Family::Torus => {
                Ending::StepTooSmall(tori::likely_cause(&latest.borrow(), &why))
            }
            Ending::MeshTooLarge(why) if branch.family == Family::Torus => {
                Ending::MeshTooLarge(tori::likely_cause(&latest.borrow(), &why))
            }
            Ending::StepTooSmall(why) => Ending::StepTooSmall(sliding::at_corner(system.field, &latest.borrow(), why)),
            other => other,
        }
    }

    /// Returns the curve of a branch.
    pub fn line(&self, branch: &Branch) -> Line {
        Line { free: branch.free, ties: self.ties.clone(), held: branch.held, doubled: is_doubled(branch) }
    }

    pub(super) fn tell(&self, event: Event) -> bool {
        self.observer.observe(event) == Verdict::Continue
    }

    pub(super) fn accept(&self, branch: &mut Branch, mut point: Point) -> bool {
        if self.observer.stopping() {
            return false;
        }
        if branch.family == Family::Arc {
            point.unstable = 0;
        }
        branch.insert(point.clone());
        let going = self.tell(Event::Point(branch, &point));
        if self.sparse {
            branch.keep_ends();
        } else if !self.whole && self.observer.stores() && branch.points.len() > 2 * WHOLE {
            let forward = branch.points.last().is_some_and(|last| last.position == point.position);
            let inner = if forward { branch.points.len() - 1 - WHOLE } else { WHOLE };
            branch.points[inner..=inner].iter_mut().filter(|p| p.position != 0).for_each(Point::lighten);
        }
        going
    }

    /// Moves a mark at a value of the parameter itself to exactly that value.
    fn place_exactly(&self, system: &System, branch: &Branch, special: &mut SpecialPoint) {
        const SAME: f64 = 1e-6;
        let own = self.marks.iter().filter(|mark| !mark.peak && mark.quantity == Quantity::Parameter(branch.free));
        let off = |mark: &Mark| (mark.value - special.point.parameters[branch.free]).abs();
        let near =
            own.filter(|mark| off(mark) <= SAME * branch.size(mark.value)).min_by(|a, b| off(a).total_cmp(&off(b)));
        let Some(mark) = near.filter(|_| special.kind == Kind::Mark && branch.held.is_none()) else { return };
        let mut there = special.point.clone();
        there.parameters[branch.free] = mark.value;
        let mut problem = self.line(branch).problem(system, self.degree, &there);
        if let Ok(found) = polished(&mut *problem, self.settings, &there) {
            let (position, tangent, step) = (there.position, there.tangent, there.step);
            special.point = Point { position, step, ..found.point };
            // The solution alone does not tell which direction is forward.
            if special.point.tangent.last().is_some_and(|t| tangent.last().is_some_and(|own| t * own < 0.0)) {
                special.point.tangent.iter_mut().for_each(|t| *t = -*t);
            }
        }
    }

    /// Says what becomes of the branch at an impact grazing, beyond which it goes on with `next`, if it does.
    fn tell_impacts(
        &self,
        system: &System,
        branch: &Branch,
        side: usize,
        special: &mut SpecialPoint,
        next: Option<&Station>,
    ) {
        let count = |point: &Point| match &point.solution {
            Solution::Cycle(cycle) => impacts(system.field, &point.parameters, cycle).len(),
            Solution::Equilibrium(_) | Solution::Torus(_) => 0,
        };
        let own = beside_impacts::count(system.field, &special.point);
        let Some(next) = next else {
            special.remark = format!("impacts {own}; no cycle with another sequence was found beside it");
            return;
        };
        let towards = if side == 1 { 1.0 } else { -1.0 };
        let value = |point: &Point| point.parameters.get(branch.free).copied().unwrap_or(f64::NAN);
        // Where the parameter is stationary, as in autonomous oscillators, the last point decides.
        const STATIONARY: f64 = 1e-4;
        let slope = special.point.parameter_slope();
        let last = if side == 1 { branch.points.last() } else { branch.points.first() };
        let before = match last {
            Some(last) if slope.abs() < STATIONARY => value(last) - value(&special.point),
            _ => -towards * slope,
        };
        let kind = match (value(&next.point) - value(&special.point)) * before > 0.0 {
            true => "non-smooth fold",
            false => "persistence",
        };
        let beyond = count(&next.point);
        let [from, to] = if side == 1 { [own, beyond] } else { [beyond, own] };
        special.remark = format!("{kind}: impacts {from} → {to}");
        let unstable = if side == 1 { &mut special.unstable_after } else { &mut special.unstable_before };
        *unstable = next.point.unstable;
    }

    /// Returns the coefficients of the normal form of a special point.
    fn coefficients(&self, system: &System, branch: &Branch, side: usize, special: &SpecialPoint) -> Coefficients {
        let (line, own) = (self.line(branch), setting(system, branch.free, &special.point.parameters));
        if special.kind == Kind::Peak {
            return Coefficients { remark: self.peak(branch, special), ..Coefficients::default() };
        }
        if special.kind == Kind::ImpactGrazing {
            return Coefficients { remark: special.remark.clone(), ..Coefficients::default() };
        }
        if matches!(special.kind, Kind::Grazing | Kind::Sliding | Kind::BoundaryEquilibrium) {
            let remark = match special.kind {
                Kind::Grazing if special.remark.is_empty() => grazing::described(system.field, &special.point),
                Kind::Grazing => special.remark.clone(),
                Kind::Sliding => sliding::described(system.field, &special.point),
                _ => grazing::on_surface(system.field, &special.point, &special.remark),
            };
            return Coefficients { remark, ..Coefficients::default() };
        }
        if let Solution::Cycle(cycle) = &special.point.solution
            && !impacts(system.field, &special.point.parameters, cycle).is_empty()
            && special.kind != Kind::Mark
        {
            return Coefficients::none("normal forms of cycles with impacts are not computed");
        }
        let dimension = special.kernel();
        if special.kind == Kind::BranchPoint && dimension > 1 {
            return Coefficients::none(format!("{NULL_SPACE}{dimension}"));
        }
        if special.kind == Kind::PeriodDoubling && !special.remark.is_empty() {
            return Coefficients::none(&special.remark);
        }
        if special.kind == Kind::Hopf && special::hopf::share_a_frequency(&special.point) {
            return Coefficients::none("two pairs of eigenvalues cross with the same frequency");
        }
        let free = branch.held.map(|(_, first)| first).into_iter().chain([branch.free]);
        let own = Setting { axes: free.map(|index| line.axis(system, index)).collect(), ..own };
        let alone;
        let special = match system.holds {
            None => special,
            Some(_) => {
                alone = self.alone(system, branch, special);
                &alone
            }
        };
        match &special.point.solution {
            Solution::Equilibrium(there) => {
                let mut at = special.point.clone();
                let before = if side == 1 { branch.points.last() } else { branch.points.first() };
                if special.kind == Kind::BranchPoint
                    && let Some(Solution::Equilibrium(x)) = before.map(|point| &point.solution)
                {
                    // The computed tangent may be a combination of those of both branches.
                    let change = |point: &Point| special.point.parameters[branch.free] - point.parameters[branch.free];
                    let gap = |point: &Point| change(point) / own.unit();
                    at.tangent = there.iter().zip(x).map(|(a, b)| a - b).chain(before.map(gap)).collect();
                }
                special::normal_form::coefficients(
                    &own,
                    special.kind,
                    &at,
                    special.error,
                    branch.earlier_there(special),
                )
            }
            Solution::Cycle(there) if own.field.iterated() => {
                let mut at = special.point.clone();
                let before = if side == 1 { branch.points.last() } else { branch.points.first() };
                if special.kind == Kind::BranchPoint
                    && let Some(Solution::Cycle(cycle)) = before.map(|point| &point.solution)
                    && cycle.profile.len() == there.profile.len()
                {
                    // As for equilibria.
                    let change = |point: &Point| special.point.parameters[branch.free] - point.parameters[branch.free];
                    let gap = before.map(|point| change(point) / own.unit());
                    at.tangent = there.profile.iter().zip(&cycle.profile).map(|(a, b)| a - b).chain(gap).collect();
                }
                special::map_form::coefficients(special.kind, &own, &at, special.error)
            }
            Solution::Torus(_) => Coefficients { remark: on_torus(special.kind).into(), ..Coefficients::default() },
            // Normal forms of boundary-value problems are not computed.
            Solution::Cycle(_) if system.is_open() => {
                Coefficients { remark: special.remark.clone(), ..Coefficients::default() }
            }
            Solution::Cycle(_) => special::cycle_coefficients::coefficients(special.kind, &own, &special.point),
        }
    }

    /// Says whether the quantity at a peak is largest or smallest, compared with the points next to it.
    fn peak(&self, branch: &Branch, special: &SpecialPoint) -> String {
        let own = self.line(branch).setting(self.system, &special.point.parameters);
        let rate = |mark: &Mark| Peak { quantity: mark.quantity, setting: own.clone() }.rate(&special.point);
        let size = |mark: &Mark| mark.quantity.on(&special.point, self.system.field).map_or(1.0, f64::abs);
        let flat = |mark: &Mark| rate(mark).map_or(f64::INFINITY, |rate| rate.abs() / size(mark));
        let nearest = self.marks.iter().filter(|mark| mark.peak).min_by(|a, b| flat(a).total_cmp(&flat(b)));
        let Some(mark) = nearest else { return String::new() };
        let value = |point: &Point| mark.quantity.on(point, self.system.field);
        let beside = [branch.points.last(), branch.points.first()].into_iter().flatten();
        let near = beside.min_by_key(|point| (point.position - special.point.position).abs());
        let (Some(here), Some(there)) = (value(&special.point), near.and_then(value)) else { return String::new() };
        let name = match mark.quantity {
            // A table has a column for each parameter.
            Quantity::Parameter(_) => "value".to_string(),
            other => other.name(&self.system.channel_names),
        };
        format!("{} {name} = {}", if here > there { "largest" } else { "smallest" }, significant(here))
    }

    /// A special point of a branch with held quantities as one of a branch in the continuation parameter alone.
    fn alone(&self, system: &System, branch: &Branch, special: &SpecialPoint) -> SpecialPoint {
        let alone = System { holds: None, ..system.clone() };
        let mut problem = problem_of(&alone, branch.free, self.degree, &special.point, false);
        let u = problem.unknowns_of(&special.point);
        problem.anchor(&u);
        let tangent = direction(&mut *problem, &u).unwrap_or_default();
        SpecialPoint { point: Point { tangent, ..special.point.clone() }, ..special.clone() }
    }

    /// Tells folds from branch points where quantities are held: at a fold the solutions at fixed further parameters turn
    /// in one of the free parameters.
    fn tell_folds(&self, system: &System, branch: &Branch, special: &mut SpecialPoint) {
        /// Slope of a parameter below which the solutions turn. Empirical: the slope is of the order of the error of the
        /// special point at a fold, and of order 1 at a branch point.
        const TURNS: f64 = 1e-3;
        if special.kind != Kind::Fold || system.holds.is_none() || system.is_open() {
            return;
        }
        let alone = System { holds: None, ..system.clone() };
        let all = branch.also.iter().map(|(index, _)| *index).chain([branch.free]);
        let turns = |index: usize| {
            let mut problem = problem_of(&alone, index, self.degree, &special.point, false);
            let u = problem.unknowns_of(&special.point);
            problem.anchor(&u);
            direction(&mut *problem, &u).is_ok_and(|along| along.last().is_some_and(|slope| slope.abs() < TURNS))
        };
        if !all.into_iter().any(turns) {
            special.kind = Kind::BranchPoint;
        }
    }

    fn end(&self, branch: &mut Branch, side: usize, ending: Ending) -> bool {
        let ending = match ending {
            Ending::Joined { at, parameter } => Ending::Joined { at, parameter: branch.rounded(parameter) },
            other => other,
        };
        branch.ends[side] = Some(ending.clone());
        self.tell(Event::SideEnded(branch, side, &ending))
    }
}

/// A number with eight significant digits.
fn significant(value: f64) -> String {
    let size = value.abs().log10().floor();
    match (-4.0..8.0).contains(&size) {
        true => format!("{value:.*}", (7.0 - size) as usize),
        false => format!("{value:.7e}"),
    }
}

/// True if a branch continues on both sides of its start, which is then not a special point of another one.
fn starts_inside(branch: &Branch) -> bool {
    let inside = matches!(branch.origin, Origin::Seed(_) | Origin::EndOf(_) | Origin::Switch { kind: Kind::Mark, .. });
    branch.held.is_some() || inside
}

/// Name of a bifurcation of a torus, for kinds that are named after those of cycles.
fn on_torus(kind: Kind) -> &'static str {
    match kind {
        Kind::Torus => "quasi-periodic Hopf: a third frequency appears, and the tori with it are not followed",
        Kind::PeriodDoubling => "the torus doubles; the doubled torus is not followed",
        Kind::BranchPoint => "another branch of tori crosses, which is not followed",
        _ => "",
    }
}

/// True if a branch was born by period doubling.
pub fn is_doubled(branch: &Branch) -> bool {
    branch.held.is_none() && matches!(branch.origin, Origin::Switch { kind: Kind::PeriodDoubling, .. })
}

/// Monitors for the ends of a branch on other solutions: every cycle may shrink to an equilibrium, a doubled one may
/// also become its parent, and one born at a branch point may become a more symmetric solution.
fn collapses<'a>(branch: &Branch, system: &'a System) -> Vec<Box<dyn Monitor + 'a>> {
    let mut all: Vec<Box<dyn Monitor + 'a>> = Vec::new();
    if matches!(branch.origin, Origin::Switch { kind: Kind::BranchPoint, .. }) {
        for symmetry in system.symmetries.iter().filter(|r| !r.is_identity()) {
            let forced = system.field.forced();
            for half in [false, true].into_iter().take(if branch.family == Family::Cycle { 2 } else { 1 }) {
                // Half of an odd number of forcing periods shifts the forcing by half its period.
                let odd = branch.points.first().is_some_and(|p| p.solution.forcing_periods() % 2 == 1);
                if forced && !system.mirrors_after(symmetry, half && odd) {
                    continue;
                }
                all.push(Box::new(collapse::Mirrors {
                    symmetry: symmetry.clone(),
                    scales: system.scales.clone(),
                    periods: system.field.periods().to_vec(),
                    half,
                }));
            }
        }
    }
    if branch.family == Family::Cycle {
        all.push(Box::new(collapse::Halves {
            field: system.field,
            scales: &system.scales,
            born: is_doubled(branch) || lasts_even_periods(branch),
        }));
    }
    if branch.family == Family::Torus {
        all.push(Box::new(collapse::Narrows { scales: &system.scales }));
    }
    if branch.family == Family::Cycle && !system.field.forced() {
        all.push(shrinks(system, branch.free, Kind::Hopf));
    }
    all
}

/// True if the cycles of a forced model last an even number of forcing periods. Their phase is fixed, so the halves of
/// two cycles can be compared however much the cycles differ.
fn lasts_even_periods(branch: &Branch) -> bool {
    let periods = branch.points.first().map_or(0, |point| point.solution.forcing_periods());
    periods > 0 && periods.is_multiple_of(2)
}

/// Returns the point at which cycles on a bifurcation curve shrink to an equilibrium: folds at a generalised Hopf
/// point, torus points at a zero-Hopf point or, as [`Growth::at_double_hopf`] finds out, at a double Hopf point.
fn limit_of_small_cycles(branch: &Branch, held: Kind) -> Option<Kind> {
    match held {
        Kind::Fold if branch.family == Family::Cycle => Some(Kind::GeneralisedHopf),
        Kind::Torus => Some(Kind::ZeroHopf),
        _ => None,
    }
}

/// Returns a monitor for the point at which cycles shrink to an equilibrium.
fn shrinks<'a>(system: &'a System, free: usize, at: Kind) -> Box<dyn Monitor + 'a> {
    Box::new(collapse::Shrinks { field: system.field, free, unit: system.unit(free), scales: &system.scales, at })
}
