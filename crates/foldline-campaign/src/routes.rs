//! Repeated continuation of a branch from different starts and with different first steps.

use crate::DEGREE;
use crate::cases::{Case, First};
use crate::errors;
use crate::explained::unexplained;
use crate::report::Report;
use crate::same::differences;
use crate::watch::Watch;
use foldline::continuation::Settings;
use foldline::continuation::corrector::{Plane, settle};
use foldline::contract::Observer;
use foldline::diagram::{Branch, Cost, Diagram, Ending, Family, Kind, Origin, Point, Solution, SpecialPoint};
use foldline::explore::growth::{Beginning, Growth, is_doubled, polished, problem_of, settings};
use foldline::explore::{self, System};
use std::time::Duration;

/// First steps, one below and one above the default.
const FIRST_STEPS: [f64; 2] = [2e-4, 0.2];
/// Points from which a branch is continued again, as fractions of its number of points.
const ENTRANCES: [f64; 2] = [0.23, 0.81];
/// Parameter component of the tangent below which a branch of cycles is not entered.
const STANDS: f64 = 1e-7;
/// Limit on the number of points per side.
const MOST_POINTS: usize = 4000;
/// Number of points of a branch that are recomputed.
const AGAIN: usize = 8;
/// Number of samples in the search for first solutions.
const SAMPLES: usize = 32;
/// Largest number of cycles per case.
const CYCLES: usize = 3;

/// Continues all branches of a case in every way.
pub fn examine(case: &Case, limit: Duration) -> Report {
    let watch = Watch::start(limit);
    let mut report = Report { cases: 1, ..Report::default() };
    let system = System::of_plan(case.model(), &case.study.plan);
    let plan = &case.study.plan.branches[0];
    let (free, range) = (plan.free, plan.range);
    match &case.first {
        First::Planned => {
            let diagram = explore::run(&system, &case.study.plan, 1, Diagram::default(), &watch);
            // A stopped run cannot be compared with the others.
            if watch.over() {
                unfinished(case, &mut report);
                return report;
            }
            for branch in &diagram.branches {
                let settings = settings(&system, case.tolerance, plan.range, MOST_POINTS);
                let parents = match &branch.origin {
                    Origin::Switch { parent, .. } => diagram.branch(parent).map_or(&[][..], |parent| &parent.special),
                    _ => &[],
                };
                let way = Way { system: &system, settings: &settings, watch: &watch, bounded: case.bounded };
                routes(way, &case.name, branch, parents, &mut report);
            }
        }
        First::Sampled { parameters, to, random } => {
            let census = explore::attractors(&system, parameters, SAMPLES, *random, 1, case.tolerance);
            let equilibria = census.attractors.iter().filter(|a| a.point.solution.period().is_none()).take(1);
            let cycles = census.attractors.iter().filter(|a| a.point.solution.period().is_some()).take(CYCLES);
            for (number, attractor) in equilibria.chain(cycles).enumerate() {
                let Some(start) = brought(&system, &watch, case.tolerance, &attractor.point, *to) else {
                    report.not_brought += 1;
                    continue;
                };
                let settings = settings(&system, case.tolerance, range, MOST_POINTS);
                let way = Way { system: &system, settings: &settings, watch: &watch, bounded: case.bounded };
                let kind = attractor.ratio.map_or(String::new(), |(a, b)| format!(" {a}:{b}"));
                let name = format!("{number}{kind}");
                let Some(branch) = followed(way, free, &name, &start) else {
                    report.differences.push(format!("{}: {name}: the start did not converge", case.name));
                    continue;
                };
                routes(way, &case.name, &branch, &[], &mut report);
            }
        }
    }
    if watch.over() {
        unfinished(case, &mut report);
    }
    report
}

fn unfinished(case: &Case, report: &mut Report) {
    report.short.push(format!("{}: the case did not end within its time", case.name));
}

/// Common arguments of the functions that continue a branch.
#[derive(Clone, Copy)]
struct Way<'a> {
    system: &'a System<'a>,
    settings: &'a Settings,
    watch: &'a Watch,
    /// See [`Case::bounded`].
    bounded: bool,
}

/// Continues a solution to another value of a parameter.
fn brought(
    system: &System,
    watch: &Watch,
    tolerance: f64,
    point: &Point,
    (index, value): (usize, f64),
) -> Option<Point> {
    let now = point.parameters[index];
    if (now - value).abs() <= 1e-12 * now.abs() {
        return Some(point.clone());
    }
    let range = [now.min(value), now.max(value)];
    let settings = settings(system, tolerance, range, MOST_POINTS);
    let sides = if value > now { [false, true] } else { [true, false] };
    let way = Branch::new("way", family(point), index, Origin::Seed("way".into()));
    let how = Way { system, settings: &settings, watch, bounded: false };
    let branch = grown(how, way, &[], point, sides)?;
    let ends = [branch.points.first()?, branch.points.last()?];
    ends.into_iter()
        .find(|end| (end.parameters[index] - value).abs() <= 1e-9 * (system.unit(index) + value.abs()))
        .cloned()
}

fn followed(way: Way, free: usize, name: &str, start: &Point) -> Option<Branch> {
    let branch = Branch::new(name, family(start), free, Origin::Seed(name.into()));
    grown(way, branch, &[], start, [true, true])
}

fn family(point: &Point) -> Family {
    match point.solution {
        Solution::Equilibrium(_) => Family::Equilibrium,
        Solution::Cycle(_) => Family::Cycle,
        Solution::Torus(_) => Family::Torus,
    }
}

fn grown(
    Way { system, settings, watch, .. }: Way,
    mut branch: Branch,
    parents: &[SpecialPoint],
    start: &Point,
    sides: [bool; 2],
) -> Option<Branch> {
    /// Parameter component of the tangent below which a point is near a fold.
    const STEEP: f64 = 1e-2;
    let mut problem = problem_of(system, branch.free, DEGREE, start, is_doubled(&branch));
    let turns = start.parameter_slope().abs() < STEEP;
    let mut station = polished(&mut *problem, settings, start);
    if (turns || station.is_err()) && !start.tangent.is_empty() {
        // Near a fold, or where only the period still changes, the parameter must not be fixed: the correction could
        // lead to the other side of the fold or to another branch.
        problem = problem_of(system, branch.free, DEGREE, start, is_doubled(&branch));
        let u = problem.unknowns_of(start);
        problem.anchor(&u);
        let plane = Plane { row: start.tangent.clone(), base: u.clone(), distance: 0.0 };
        station = settle(&mut *problem, settings, plane, u, 1.0, &mut Cost::default());
    }
    let station = station.ok()?;
    let growth = Growth {
        marks: &[],
        system,
        settings,
        degree: DEGREE,
        ties: Vec::new(),
        sides,
        parents,
        observer: watch as &dyn Observer,
        whole: true,
        sparse: false,
    };
    growth.begin(&mut branch, Beginning::Inside(station));
    Some(branch)
}

/// Continues a branch again in every way and compares the results.
fn routes(way: Way, case: &str, base: &Branch, parents: &[SpecialPoint], report: &mut Report) {
    let Way { system, settings, watch, bounded } = way;
    let place = format!("{case}: {}", base.name);
    report.branches += 1;
    report.special += base.special.len();
    count(&place, base, bounded, report);
    let (points, failed) = errors::sampled(system, settings, base, AGAIN);
    report.not_again += failed;
    report
        .honesty
        .extend(points.into_iter().map(|h| errors::Honesty { place: format!("{place} at {}", h.place), ..h }));
    // A switched branch begins at a special point of its parent, so it can be re-entered only from its interior.
    let seeded = matches!(base.origin, Origin::Seed(_));
    let start = base.points.iter().find(|p| p.position == 0);
    let mut compare = |how: &str, settings: &Settings, start: &Point| {
        let again = Branch::new(&base.name, base.family, base.free, base.origin.clone());
        let way = Way { settings, ..way };
        let other = grown(way, again, parents, start, [true, true]);
        if watch.over() {
            return;
        }
        let Some(other) = other else {
            report.differences.push(format!("{place}: {how}: the start did not converge"));
            return;
        };
        count(&format!("{place}: {how}"), &other, bounded, report);
        // A switched branch ends at a special point of its parent. Continuation from the interior locates that end less
        // accurately.
        let slack = if seeded { 0.0 } else { 10.0 * settings.tolerance };
        let lines = differences(base, &other, slack);
        if let Some(first) = lines.first() {
            let more = if lines.len() > 1 { format!(", and {} more", lines.len() - 1) } else { String::new() };
            let counts = [base.special.len(), other.special.len()];
            report
                .differences
                .push(format!("{place}: {how}: {first}{more} ({} special points, {})", counts[0], counts[1]));
        }
        if seeded && codes(base) != codes(&other) {
            report.differences.push(format!("{place}: {how}: ends {:?} instead of {:?}", codes(&other), codes(base)));
        }
    };
    if let Some(start) = start.filter(|_| seeded) {
        for first_step in FIRST_STEPS {
            let settings = Settings { first_step, ..settings.clone() };
            compare(&format!("first step {first_step}"), &settings, start);
        }
    }
    // If only the unbounded period still changes, the parameter does not determine the position on the branch.
    let stands = |p: &Point| p.solution.period().is_some() && p.parameter_slope().abs() < STANDS;
    let fits = |p: &&Point| p.position != 0 && !p.is_light() && !stands(p);
    let mut starts: Vec<&Point> = ENTRANCES
        .iter()
        .filter_map(|share| base.points.get((share * base.points.len() as f64) as usize).filter(fits))
        .collect();
    // If the start is at a fold, a returning branch may not reach the parameter value of the start again.
    if base.special.iter().any(|special| special.kind == Kind::Fold) {
        let slope = |p: &&Point| p.parameter_slope().abs();
        starts.extend(base.points.iter().filter(fits).min_by(|a, b| slope(a).total_cmp(&slope(b))));
    }
    starts.dedup_by_key(|start| start.position);
    for start in starts {
        let value = start.parameters[base.free];
        compare(&format!("from {value:?} (position {})", start.position), settings, start);
    }
}

/// Codes of both ends, sorted, because a branch traversed in the opposite direction has them exchanged.
fn codes(branch: &Branch) -> Vec<String> {
    let mut codes: Vec<String> = branch.ends.iter().map(|end| end.as_ref().map_or("none".to_string(), told)).collect();
    codes.sort();
    codes
}

/// Formats a run with one line per point and special point.
fn trace(place: &str, branch: &Branch) -> String {
    use std::fmt::Write;
    let mut text = format!("== {place}: {:?}\n", branch.ends);
    let mut line = |head: &str, p: &Point| {
        let spectrum: Vec<String> = p
            .free_spectrum()
            .iter()
            .map(|z| {
                if p.solution.period().is_some() {
                    format!("{:.6}<{:.4}", z.norm(), z.arg())
                } else {
                    format!("{:.3e}{:+.3e}i", z.re, z.im)
                }
            })
            .collect();
        let _ = writeln!(
            text,
            "{head} {:4} {:.9} slope {:+.2e} step {:.1e} unstable {} T {:.6} |{}| disc {:.1e} triv {:.1e} liou {:.1e} r {:.7} rej {} N {}",
            p.position,
            p.parameters[branch.free],
            p.parameter_slope(),
            p.step,
            p.unstable,
            p.solution.period().unwrap_or(0.0),
            spectrum.join(" "),
            p.trust.discretisation,
            p.trust.trivial_defect,
            p.trust.liouville_defect,
            p.ranges.last().map_or(0.0, |r| r[1]),
            p.cost.rejected,
            match &p.solution {
                Solution::Cycle(c) => c.intervals(),
                _ => 0,
            }
        );
    };
    for p in &branch.points {
        line("   ", p);
        for s in branch.special.iter().filter(|s| s.point.position == p.position) {
            line(&format!(">> {} {}->{} ({:.1e})", s.kind, s.unstable_before, s.unstable_after, s.error), &s.point);
        }
    }
    text
}

/// Formats the end of a branch for comparison. Points where branches meet are extrapolated and accurate to a few digits
/// only; the last value of an unbounded period depends on the last step.
fn told(end: &Ending) -> String {
    match end {
        Ending::Joined { at, parameter } => format!("joined at {at} {parameter:.3}"),
        // The last period depends on the last steps.
        Ending::PeriodUnbounded(_) | Ending::Connecting { .. } => end.code().to_string(),
        other => other.to_string(),
    }
}

fn count(place: &str, branch: &Branch, bounded: bool, report: &mut Report) {
    report.traces.push(trace(place, branch));
    report.runs += 1;
    report.points += branch.points.len();
    for end in &branch.ends {
        report.ended(end.as_ref().map_or("none", |end| end.code()), 1);
        let explained = end.as_ref().is_some_and(|e| e.complete() || e.code() == "period-unbounded" && !bounded);
        if !explained {
            let why = end.as_ref().map_or("it was not finished".to_string(), |end| end.brief());
            report.short.push(format!("{place}: {why}"));
        }
    }
    report.unexplained.extend(unexplained(branch).into_iter().map(|line| format!("{place}: {line}")));
}
