//! Comparison with AUTO-07p on all of figure 7.
//!
//! **Idea.** AUTO continues the branches that foldline continues, from the same first solutions: to both sides, or once
//! around a closed branch, and through two levels of period doubling. Information that AUTO needs for this, such as the
//! number of points after which a closed branch returns, is free: a first run provides it, and only a second run is
//! timed. Several meshes, largest steps and tolerances of special points are tried. Reported are the setting that finds
//! most special points, the fastest if there are several, and the setting that finds most of them as accurately as
//! foldline. Then each branch gets its own best setting. Both codes are compared with a run of foldline at a tolerance
//! a thousand times smaller.

use super::auto::Auto;
use super::auto_files::{Row, write_start};
use crate::report::{Table, digits, time};
use crate::workplace::Workplace;
use crate::{Outcome, clock, rotor};
use foldline::diagram::{Branch, Diagram, Kind, Point, Solution, SpecialPoint};
use foldline::explore::Plan;

const INTERVALS: [usize; 3] = [100, 200, 400];
/// DSMAX and EPSS.
const STEPS: [(&str, &str); 7] = [
    ("0.01", "1e-5"),
    ("0.02", "1e-5"),
    ("0.05", "1e-5"),
    ("0.2", "1e-5"),
    ("0.2", "1e-8"),
    ("1", "1e-5"),
    ("1", "1e-8"),
];
/// Limit on the length of a branch of cycles; by then AUTO has returned to the start or never will.
const FAR: f64 = 50.0;
/// Limit on the length of a branch of equilibria, which reaches large amplitudes.
const FARTHER: f64 = 400.0;
/// Smallest limit on the number of points, for long steps.
const LEAST: usize = 2500;

/// Largest tolerance of a study; its results are compared with those of AUTO too.
const LOOSE: f64 = 1e-4;
/// Tolerance of the reference run.
const EXACT: f64 = 1e-9;
/// Time in seconds above which a setting is repeated less often.
const LONG: f64 = 20.0;

/// NTST, DSMAX and EPSS.
#[derive(Clone, Copy)]
struct Setting {
    intervals: usize,
    step: &'static str,
    located: &'static str,
}

impl Setting {
    fn all() -> impl Iterator<Item = Setting> {
        let of = |intervals| STEPS.map(|(step, located)| Setting { intervals, step, located });
        INTERVALS.into_iter().flat_map(of)
    }
}

impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "NTST {}, DSMAX {}, EPSS {}", self.intervals, self.step, self.located)
    }
}

/// All runs of AUTO at one setting.
struct Tour<'t> {
    auto: &'t Auto,
    setting: Setting,
    cpu: f64,
    points: usize,
    /// Special points, each with the name of the branch of the plan from which it was found.
    special: Vec<(String, Row)>,
    /// Time in seconds of each branch of the plan, including its child branches.
    parts: Vec<(String, f64)>,
}

/// Run of AUTO: its constants and its start.
struct Run<'r> {
    changes: Vec<(&'r str, String)>,
    from: Option<(&'r str, usize)>,
}

impl Run<'_> {
    fn with(&self, more: &[(&'static str, String)]) -> Run<'_> {
        let changes = self.changes.iter().cloned().chain(more.iter().cloned()).collect();
        Run { changes, from: self.from }
    }
}

impl Tour<'_> {
    /// Runs AUTO without adding to the totals.
    fn tried(&self, run: &Run) -> Outcome<(f64, Vec<Row>)> {
        let changes: Vec<(&str, &str)> = run.changes.iter().map(|(name, value)| (*name, value.as_str())).collect();
        let answer = match run.from {
            None => self.auto.run(&changes)?,
            Some((solutions, label)) => self.auto.run_from(solutions, label, &changes)?,
        };
        Ok((answer.cpu, answer.rows))
    }

    /// Runs AUTO and adds time, points and special points to the totals.
    fn counted(&mut self, name: &str, run: &Run) -> Outcome<Vec<Row>> {
        let (cpu, rows) = self.tried(run)?;
        self.cpu += cpu;
        self.points += rows.len();
        self.special.extend(rows.iter().filter(|row| kind_of(row).is_some()).map(|row| (name.to_string(), *row)));
        Ok(rows)
    }

    /// Returns the limit on the number of points for a branch of the given length.
    fn limit(&self, length: f64) -> usize {
        let step: f64 = self.setting.step.parse().unwrap_or(1.0);
        ((length / step) as usize).max(LEAST)
    }

    fn common(&self) -> Vec<(&'static str, String)> {
        vec![
            ("UZSTOP", "{1: [0.5, 12.0]}".into()),
            ("DSMAX", self.setting.step.into()),
            ("EPSS", self.setting.located.into()),
            ("NTST", self.setting.intervals.to_string()),
            ("NMX", self.limit(FAR).to_string()),
        ]
    }

    /// Continues a branch of the plan and its child branches.
    fn branch(&mut self, branch: &Branch) -> Outcome<()> {
        let start = rotor::first(branch)?;
        let [omega, kappa] = [start.parameters[0], start.parameters[1]];
        let mut changes = self.common();
        changes.push(("PAR", format!("{{1: {omega:?}, 2: {kappa:?}}}")));
        let cycle = match &start.solution {
            Solution::Equilibrium(x) => {
                let values: Vec<String> = x.iter().enumerate().map(|(k, v)| format!("{}: {v:?}", k + 1)).collect();
                changes.push(("U", format!("{{{}}}", values.join(", "))));
                changes.extend([("IPS", "1".into()), ("ICP", "[1]".into()), ("dat", "''".into())]);
                changes.push(("NMX", self.limit(FARTHER).to_string()));
                None
            }
            Solution::Torus(_) => return Err("the start is no cycle".into()),
            Solution::Cycle(cycle) => {
                write_start(cycle, &self.auto.start())?;
                Some(cycle.period)
            }
        };
        for sign in ["", "-"] {
            let mut own = changes.clone();
            own.push(("DS", format!("{sign}0.01")));
            let run = Run { changes: own, from: None };
            let lap = match cycle {
                Some(period) => lap(&self.tried(&run)?.1, start.parameters[0], period),
                None => None,
            };
            // Timed in a second run, up to the point at which the branch closed.
            let run = match lap {
                Some(points) => run.with(&[("NMX", points.to_string())]),
                None => run,
            };
            let rows = self.counted(&branch.name, &run)?;
            if cycle.is_some() && start.parameters[1] == 1.0 {
                let solutions = self.auto.solutions()?;
                self.doubled(&branch.name, &solutions, &rows, 2)?;
            }
            if lap.is_some() {
                break;
            }
        }
        Ok(())
    }

    /// Continues the branches that begin at period doublings, down to the given depth.
    fn doubled(&mut self, name: &str, solutions: &str, rows: &[Row], depth: usize) -> Outcome<()> {
        let mut ends: Vec<f64> = Vec::new();
        for row in rows.iter().filter(|row| kind_of(row) == Some(Kind::PeriodDoubling) && row.label > 0) {
            // Skips the other end of a branch continued before.
            if ends.iter().any(|end| (end - row.parameter).abs() < 1e-2) {
                continue;
            }
            let mut changes = self.common();
            // The period doubles, and so does the number of intervals. The branch ends where it meets its parent again.
            // PAR is empty, because given parameters would replace those of the solution.
            changes.extend([
                ("PAR", "{}".into()),
                ("ISW", "-1".into()),
                ("STOP", "['BP1']".into()),
                ("NTST", (self.setting.intervals << (3 - depth)).to_string()),
            ]);
            let run = Run { changes, from: Some((solutions, row.label)) };
            let rows = self.counted(name, &run)?;
            ends.extend(rows.iter().filter(|row| row.kind == 6).map(|row| row.parameter));
            if depth > 1 {
                let own = self.auto.solutions()?;
                self.doubled(name, &own, &rows, depth - 1)?;
            }
        }
        Ok(())
    }
}

/// Returns the number of points after which a closed branch has returned to its start.
fn lap(rows: &[Row], start: f64, period: f64) -> Option<usize> {
    let rising = rows.get(1)?.parameter > start;
    let home = |pair: &[Row]| {
        let (a, b) = (pair[0].parameter - start, pair[1].parameter - start);
        a * b <= 0.0 && (b > a) == rising && (pair[1].period / period - 1.0).abs() < 0.02
    };
    rows.windows(2).skip(5).position(home).map(|at| at + 7)
}

/// Returns the kind of special point of a row.
fn kind_of(row: &Row) -> Option<Kind> {
    match row.kind {
        2 | 5 => Some(Kind::Fold),
        3 => Some(Kind::Hopf),
        7 => Some(Kind::PeriodDoubling),
        8 => Some(Kind::Torus),
        _ => None,
    }
}

/// Converts a special point to a row of AUTO.
fn row_of(kind: Kind, point: &Point) -> Option<Row> {
    let codes = [(Kind::Fold, 5), (Kind::Hopf, 3), (Kind::PeriodDoubling, 7), (Kind::Torus, 8)];
    let (_, code) = codes.into_iter().find(|(known, _)| *known == kind)?;
    let period = point.solution.period().unwrap_or(f64::NAN);
    Some(Row { kind: code, label: 0, parameter: point.parameters[rotor::OMEGA], period })
}

/// Returns the special points of a diagram, each with the name of the branch of the plan from which it was found.
fn special_of(diagram: &Diagram) -> Vec<(String, Row)> {
    let of = |branch: &Branch| {
        let root = branch.name.split('/').next().unwrap_or("").to_string();
        let rows = branch.special.iter().filter_map(|special| row_of(special.kind, &special.point));
        rows.map(|row| (root.clone(), row)).collect::<Vec<_>>()
    };
    diagram.branches.iter().flat_map(of).collect()
}

/// Match of the special points that were found with those of a diagram.
#[derive(Clone, Copy, Default)]
struct Matched {
    found: usize,
    /// Number of matches whose Ω has the requested accuracy.
    accurate: usize,
    /// Number of matches that are period doublings.
    doublings: usize,
    /// Number of special points that are not in the diagram.
    other: usize,
    /// Largest relative error of the parameter among the matches.
    error: f64,
}

/// Pairs special points with those of the diagram, nearest first, each at most once. `of` restricts them to one branch
/// of the plan and its child branches.
fn matched(exact: &Diagram, special: &[(String, Row)], tolerance: f64, of: Option<&str>) -> Matched {
    let root = |name: &str| name.split('/').next().unwrap_or("").to_string();
    let meant = |name: &str| of.is_none_or(|of| of == name);
    let off = |point: &Point, row: &Row| (row.parameter / point.parameters[rotor::OMEGA] - 1.0).abs();
    let known: Vec<(String, &SpecialPoint)> =
        exact.branches.iter().flat_map(|b| b.special.iter().map(|s| (root(&b.name), s))).collect();
    let same = |(branch, s): &(String, &SpecialPoint), (name, row): &(String, Row)| {
        let period = s.point.solution.period().is_none_or(|period| (row.period / period - 1.0).abs() < 1e-2);
        branch == name && kind_of(row) == Some(s.kind) && off(&s.point, row) < 1e-3 && period
    };
    let special: Vec<&(String, Row)> = special.iter().filter(|(name, _)| meant(name)).collect();
    let pair = |(i, one): (usize, &(String, &SpecialPoint))| -> Vec<(f64, usize, usize)> {
        let near = special.iter().enumerate().filter(|(_, row)| same(one, row));
        near.map(|(j, (_, row))| (off(&one.1.point, row), i, j)).collect()
    };
    let mut pairs: Vec<(f64, usize, usize)> = known.iter().enumerate().flat_map(pair).collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut taken: Vec<(usize, usize)> = Vec::new();
    let mut all = Matched::default();
    for (error, i, j) in pairs {
        if taken.iter().any(|(a, b)| *a == i || *b == j) {
            continue;
        }
        taken.push((i, j));
        all.found += 1;
        all.accurate += usize::from(error <= tolerance);
        all.doublings += usize::from(known[i].1.kind == Kind::PeriodDoubling);
        all.error = all.error.max(error);
    }
    all.other = special.iter().filter(|row| !known.iter().any(|one| same(one, row))).count();
    all
}

fn tour<'t>(auto: &'t Auto, starts: &Diagram, setting: Setting) -> Outcome<Tour<'t>> {
    let mut tour = Tour { auto, setting, cpu: 0.0, points: 0, special: Vec::new(), parts: Vec::new() };
    for branch in &starts.branches {
        let before = tour.cpu;
        tour.branch(branch)?;
        tour.parts.push((branch.name.clone(), tour.cpu - before));
    }
    Ok(tour)
}

/// Setting that finds most special points, the fastest if there are several: number found, seconds, setting.
#[derive(Clone, Copy, Default)]
struct Best(Option<(usize, f64, Setting)>);

impl Best {
    fn meet(&mut self, found: usize, cpu: f64, setting: Setting) {
        if self.0.is_none_or(|(most, least, _)| found > most || (found == most && cpu < least)) {
            self.0 = Some((found, cpu, setting));
        }
    }
}

/// Runs and compares both codes.
pub fn compared(place: &Workplace) -> Outcome<String> {
    let study = rotor::study(place, rotor::FIGURE_7)?;
    let starts = rotor::beginnings(&study);
    let own = |tolerance: f64| {
        let plan = Plan { tolerance, ..study.plan.clone() };
        clock::timed(|| rotor::run(&study, &plan, starts.clone()))
    };
    let plan = Plan { tolerance: EXACT, ..study.plan.clone() };
    let exact = rotor::run(&study, &plan, rotor::beginnings_at(&study, EXACT));
    let closed =
        |branch: &Branch| branch.points.len() < plan.branches[0].max_points && branch.ends.iter().all(Option::is_some);
    if !exact.branches.iter().all(closed) {
        return Err("what both codes are compared with is not complete".into());
    }
    let wanted = study.plan.tolerance;
    let all: usize = exact.branches.iter().map(|branch| branch.special.len()).sum();
    eprintln!("  {all} special points at tolerance {EXACT:.0e}");
    let auto = Auto::new(place, "rotor", "auto-diagrams")?;
    let within = format!("to {wanted:.0e}");
    let mut table = Table::new(&[
        "",
        "points",
        "special points found",
        &within,
        "period doublings of them",
        "not in the diagram",
        "error of their Ω, at most",
        "processor time",
        "over foldline's",
    ]);
    let usual: Vec<f64> = (0..5).map(|_| own(wanted).0).collect();
    let usual = clock::median(&usual);
    let row = |name: String, points: usize, one: Matched, seconds: f64, ratio: String| {
        let counts = [one.found, one.accurate].map(|count| format!("{count} of {all}"));
        let [found, accurate] = counts;
        let [points, doublings, other] = [points, one.doublings, one.other].map(|count| count.to_string());
        [name, points, found, accurate, doublings, other, format!("{:.0e}", one.error), time(seconds), ratio]
    };
    let (mut any, mut accurate) = (Best::default(), Best::default());
    // Best setting for each branch alone.
    let mut suited = vec![Best::default(); starts.branches.len()];
    for setting in Setting::all() {
        let name = format!("AUTO, {setting}");
        let tour = match tour(&auto, &starts, setting) {
            Ok(tour) => tour,
            Err(why) => {
                let failed: [&str; 9] = [&name, "", &format!("failed: {why}"), "", "", "", "", "", ""];
                table.row(&failed.map(String::from));
                continue;
            }
        };
        eprintln!("  {setting}: {}", time(tour.cpu));
        let one = matched(&exact, &tour.special, wanted, None);
        table.row(&row(name, tour.points, one, tour.cpu, digits(tour.cpu / usual)));
        any.meet(one.found, tour.cpu, setting);
        accurate.meet(one.accurate, tour.cpu, setting);
        for (best, (branch, cpu)) in suited.iter_mut().zip(&tour.parts) {
            best.meet(matched(&exact, &tour.special, wanted, Some(branch)).accurate, *cpu, setting);
        }
    }
    let mut measured: Vec<f64> = Vec::new();
    let mut against = |best: Best| -> Outcome<String> {
        let (_, cpu, setting) = best.0.ok_or("AUTO was not run")?;
        let rounds = if cpu < LONG { 5 } else { 2 };
        let mut ratios = Vec::new();
        for _ in 0..rounds {
            let theirs = tour(&auto, &starts, setting)?.cpu;
            let ours = own(wanted).0;
            measured.push(ours);
            ratios.push(theirs / ours);
        }
        let found = best.0.map_or(0, |(found, ..)| found);
        let ratio = digits(clock::median(&ratios));
        Ok(format!("{found} of {all} with {setting}: foldline is {ratio} times as fast (median of {rounds} pairs)"))
    };
    let said = [against(any)?, against(accurate)?];
    for tolerance in [wanted, LOOSE] {
        let times: Vec<f64> = (0..5).map(|_| own(tolerance).0).collect();
        let again = own(tolerance).1;
        let one = matched(&exact, &special_of(&again), wanted, None);
        let points: usize = again.branches.iter().map(|branch| branch.points.len()).sum();
        let seconds = clock::median(&times);
        table.row(&row(format!("foldline, tolerance {tolerance:.0e}"), points, one, seconds, digits(seconds / usual)));
    }
    let mut parts =
        Table::new(&["branch, with what grows from it", "special points", "AUTO finds", "with", "processor time"]);
    let (mut found, mut seconds) = (0, 0.0);
    for (branch, best) in starts.branches.iter().zip(&suited) {
        let (own, cpu, setting) = best.0.ok_or("AUTO was not run")?;
        (found, seconds) = (found + own, seconds + cpu);
        let grown = exact.branches.iter().filter(|b| b.name.split('/').next() == Some(&branch.name));
        let there: usize = grown.map(|b| b.special.len()).sum();
        parts.row(&[branch.name.clone(), there.to_string(), own.to_string(), setting.to_string(), time(cpu)]);
    }
    let usual = clock::median(&measured);
    Ok(format!(
        "Branches from given first solutions, two levels of period doubling (NTST doubled at each), NCOL 4; nothing is stored by foldline, AUTO's \
         times include its starts and files. Errors of Ω are relative, of both codes against foldline's diagram at tolerance {EXACT:.0e}; each of its \
         special points is found once at most, not farther off than 1e-3.\n\n{}\nMost special points AUTO finds, {}. Most to {wanted:.0e} (target: \
         20), {}.\n\nWith the setting for each branch at which AUTO finds most to {wanted:.0e} there, the fastest of several, it finds {found} of {all} in {}: \
         foldline is {} times as fast. Nobody knows these settings beforehand.\n\n{}",
        table.text(),
        said[0],
        said[1],
        time(seconds),
        digits(seconds / usual),
        parts.text(),
    ))
}
