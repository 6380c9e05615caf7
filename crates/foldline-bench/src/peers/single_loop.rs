//! Comparison with AUTO-07p on one branch at equal accuracy.
//!
//! **Idea.** Every point of either code is recomputed at the same Ω with a tolerance of 1e-10; the differences in
//! period and largest radius are its errors. AUTO gets the mesh and the largest step for which it is fastest among
//! those for which the larger of its two errors does not exceed that of foldline; then degree and first step are chosen
//! in the same way. The comparison is made at the tolerance of the study, a looser and a tighter one, because a single
//! accuracy might favour one of the codes.

use super::auto::{Answer, Auto};
use super::auto_files::{cycles, write_start};
use crate::own::cost;
use crate::report::{Table, digits, time};
use crate::workplace::Workplace;
use crate::{Outcome, clock, rotor};
use foldline::diagram::{Branch, Point, Solution};
use foldline::explore::{Plan, System};
use foldline::problem::extremes;

/// Values of NCOL.
const DEGREES: [&str; 4] = ["4", "5", "6", "7"];
/// Values of NTST.
const INTERVALS: [&str; 21] = [
    "10", "12", "15", "20", "25", "30", "35", "40", "45", "50", "60", "70", "75", "80", "85", "90", "95", "100", "120",
    "150", "200",
];
/// Setting that a user would begin with who does not know the number of intervals needed.
const USUAL: Setting = Setting { degree: "4", intervals: "100", first: "0.1", step: "0.2" };
/// Values of DS and DSMAX.
const STEPS: [(&str, &str); 8] =
    [("0.1", "0.2"), ("0.1", "1"), ("0.1", "3"), ("0.1", "10"), ("1", "1"), ("1", "3"), ("1", "10"), ("3", "10")];
/// Tolerances of foldline that are compared; the study has the second.
const TOLERANCES: [f64; 3] = [1e-4, 1e-6, 1e-8];
/// Index of the output r in the list of states and outputs.
const RADIUS: usize = 4;

/// Returns the largest relative errors of the period and of the largest radius.
pub fn errors<'p>(system: &System, points: impl Iterator<Item = &'p Point>) -> Outcome<[f64; 2]> {
    let mut worst = [0.0f64; 2];
    for point in points {
        let exact = rotor::refined(system, point, 1e-10)?;
        let periods = [point, &exact].map(|p| p.solution.period().unwrap_or(f64::NAN));
        let radii = [point, &exact].map(|p| rotor::r_max(p, RADIUS));
        for (worst, [a, b]) in worst.iter_mut().zip([periods, radii]) {
            *worst = worst.max((a / b - 1.0).abs());
        }
    }
    Ok(worst)
}

/// Returns the points computed along a branch, without the given first one.
fn found_points(branch: &Branch) -> impl Iterator<Item = &Point> {
    branch.points.iter().filter(|point| point.position != 0)
}

/// Converts a solution of AUTO to a point that has what [`errors`] needs.
fn point(system: &System, like: &Point, omega: f64, solution: Solution) -> Point {
    let mut parameters = like.parameters.clone();
    parameters[rotor::OMEGA] = omega;
    let ranges = match &solution {
        Solution::Cycle(c) => extremes::of_profile(system.field, &parameters, [&c.profile, &c.mesh], 0, c.scheme()),
        Solution::Equilibrium(_) | Solution::Torus(_) => Vec::new(),
    };
    Point { parameters, solution, ranges, ..like.clone() }
}

/// Constants given to AUTO.
#[derive(Clone, Copy)]
struct Setting {
    degree: &'static str,
    intervals: &'static str,
    first: &'static str,
    step: &'static str,
}

impl Setting {
    fn all() -> impl Iterator<Item = Setting> {
        let steps = |degree, intervals| STEPS.map(|(first, step)| Setting { degree, intervals, first, step });
        let meshes = move |degree| INTERVALS.into_iter().flat_map(move |intervals| steps(degree, intervals));
        DEGREES.into_iter().flat_map(meshes)
    }

    /// True if only the mesh and the largest step are chosen, with the usual degree and first step.
    fn is_plain(self) -> bool {
        self.degree == USUAL.degree && self.first == USUAL.first
    }

    fn constants(self) -> Vec<(&'static str, &'static str)> {
        let own = [("NCOL", self.degree), ("NTST", self.intervals), ("DS", self.first), ("DSMAX", self.step)];
        [&own[..], &[("UZSTOP", "{1: [4.99, 10.0]}")]].concat()
    }
}

/// Setting with which AUTO reaches the end of the branch, and its result.
#[derive(Clone, Copy)]
struct Choice {
    setting: Setting,
    cpu: f64,
    errors: [f64; 2],
    points: usize,
    iterations: usize,
}

impl Choice {
    fn error(&self) -> f64 {
        self.errors[0].max(self.errors[1])
    }
}

/// True if a run reached the end of the branch.
fn arrived(answer: &Answer) -> bool {
    answer.rows.last().is_some_and(|row| row.kind == -4 && (row.parameter - 10.0).abs() <= 1e-4)
}

/// Runs AUTO with one setting and measures its errors; `None` if AUTO leaves the branch.
fn tried(auto: &Auto, system: &System, like: &Point, setting: Setting) -> Outcome<Option<Choice>> {
    let own = setting.constants();
    let answer = auto.run(&[&own[..], &[("NPR", "1"), ("IID", "2")]].concat())?;
    let found = cycles(&auto.solutions()?);
    if found.len() != answer.rows.len() {
        return Err(format!("{} of {} solutions of AUTO were read", found.len(), answer.rows.len()).into());
    }
    // The first point is left out: it is the given start, interpolated linearly by AUTO without Newton iterations.
    let points: Vec<Point> = found.into_iter().skip(1).map(|(_, omega, s)| point(system, like, omega, s)).collect();
    let Ok(errors) = errors(system, points.iter()) else { return Ok(None) };
    let times: Vec<f64> = (0..3).map(|_| auto.run(&own).map(|a| a.cpu)).collect::<Outcome<_>>()?;
    let (points, iterations) = (answer.rows.len(), answer.iterations);
    Ok(Some(Choice { setting, cpu: clock::median(&times), errors, points, iterations }))
}

/// Returns, for each allowed error, the fastest setting that stays below it.
fn fastest(
    auto: &Auto,
    system: &System,
    like: &Point,
    allowed: &[f64],
    among: &[Setting],
) -> Outcome<Vec<Option<Choice>>> {
    let mut best: Vec<Option<Choice>> = vec![None; allowed.len()];
    for setting in among.iter().copied() {
        let answer = auto.run(&setting.constants())?;
        // Measuring errors takes longer than the run, so it is done only for settings that may be the fastest.
        let faster = |best: &Option<Choice>| best.is_none_or(|best| answer.cpu < 1.1 * best.cpu);
        if !arrived(&answer) || !best.iter().any(faster) {
            continue;
        }
        let Some(choice) = tried(auto, system, like, setting)? else { continue };
        for (best, allowed) in best.iter_mut().zip(allowed) {
            if choice.error() <= *allowed && best.is_none_or(|best| choice.cpu < best.cpu) {
                *best = Some(choice);
            }
        }
    }
    Ok(best)
}

/// Runs both codes alternately. Returns median times in seconds: of foldline, of AUTO, of foldline's start-up with a
/// first point, of AUTO's; and the median ratio of the times without start-up.
fn in_turn(
    auto: &Auto,
    setting: Setting,
    repetitions: usize,
    mut own: impl FnMut(),
    mut own_start: impl FnMut(),
) -> Outcome<[f64; 5]> {
    let changes = setting.constants();
    let mut all = [const { Vec::new() }; 5];
    for _ in 0..repetitions {
        // The first run after a pause is slower, so it is not timed.
        own();
        let ours = clock::timed(&mut own).0;
        let our_start = clock::timed(&mut own_start).0;
        let theirs = auto.run(&changes)?.cpu;
        let their_start = auto.run(&[&changes[..], &[("NMX", "1")]].concat())?.cpu;
        let ratio = (theirs - their_start) / (ours - our_start);
        let one = [ours, theirs, our_start, their_start, ratio];
        all.iter_mut().zip(one).for_each(|(all, one)| all.push(one));
    }
    Ok(all.map(|values| clock::median(&values)))
}

/// Compares both codes.
pub fn compared(place: &Workplace) -> Outcome<String> {
    let study = rotor::study(place, rotor::SINGLE_LOOP)?;
    let system = System::of_plan(&study.model, &study.plan);
    let starts = rotor::beginnings(&study);
    let like = rotor::first(&starts.branches[0])?;
    let auto = Auto::new(place, "rotor", "auto-single-loop")?;
    let Solution::Cycle(cycle) = &like.solution else { return Err("no cycle".into()) };
    write_start(cycle, &auto.start())?;
    let plan = |tolerance: f64| Plan { tolerance, ..study.plan.clone() };
    let own: Vec<Branch> =
        TOLERANCES.iter().map(|t| rotor::run(&study, &plan(*t), starts.clone()).branches.swap_remove(0)).collect();
    let own_errors: Vec<[f64; 2]> =
        own.iter().map(|branch| errors(&system, found_points(branch))).collect::<Outcome<_>>()?;
    let allowed: Vec<f64> = own_errors.iter().map(|[period, radius]| period.max(*radius)).collect();
    let all: Vec<Setting> = Setting::all().collect();
    let plain: Vec<Setting> = all.iter().copied().filter(|setting| setting.is_plain()).collect();
    let choices = [fastest(&auto, &system, like, &allowed, &plain)?, fastest(&auto, &system, like, &allowed, &all)?];
    let usual = tried(&auto, &system, like, USUAL)?.ok_or("AUTO does not get to Ω = 10")?;
    let mut table = Table::new(&[
        "",
        "points",
        "Newton iterations",
        "error of T",
        "error of r_max",
        "processor time, median",
        "of it for the start",
        "over foldline's",
    ]);
    let row = |name: String, counts: [usize; 2], errors: [f64; 2], seconds: f64, rest: [String; 2]| {
        let [points, newton] = counts.map(|count| count.to_string());
        let [period, radius] = errors.map(|error| format!("{error:.1e}"));
        let [start, ratio] = rest;
        [name, points, newton, period, radius, time(seconds), start, ratio]
    };
    let (mut said, mut net, mut newton) = (Vec::new(), 0.0, 0.0);
    for (k, tolerance) in TOLERANCES.into_iter().enumerate() {
        let meant = tolerance == study.plan.tolerance;
        // Many repetitions, because each is short compared with the periods during which other work slows the machine
        // down.
        let repetitions = if meant { 12 * place.repetitions() } else { 3 * place.repetitions() };
        let plan = plan(tolerance);
        let mut none = plan.clone();
        none.branches.iter_mut().for_each(|branch| branch.max_points = 0);
        let mut rows = Vec::new();
        let (mut seconds, mut start) = (Vec::new(), Vec::new());
        let tuned = choices.iter().map(|choices| choices[k]);
        for choice in tuned.chain(meant.then_some(Some(usual))) {
            let Some(choice) = choice else {
                rows.push([const { String::new() }; 8].map(|_| "·".to_string()));
                if meant {
                    said.push(f64::NAN);
                }
                continue;
            };
            let [ours, theirs, our_start, their_start, ratio] = in_turn(
                &auto,
                choice.setting,
                repetitions,
                || drop(rotor::run(&study, &plan, starts.clone())),
                || drop(rotor::run(&study, &none, starts.clone())),
            )?;
            seconds.push(ours);
            start.push(our_start);
            let Choice { setting, errors, points, iterations, .. } = choice;
            let Setting { degree, intervals, first, step } = setting;
            let name = format!("AUTO, NTST {intervals}, NCOL {degree}, DS {first}, DSMAX {step}");
            rows.push(row(name, [points, iterations], errors, theirs, [time(their_start), digits(ratio)]));
            if meant {
                said.push(ratio);
            }
        }
        if meant {
            (net, newton) =
                (clock::median(&seconds) - clock::median(&start), cost::newton_of(&system, &own[k], rotor::OMEGA)?);
        }
        let name = format!("foldline, tolerance {tolerance:.0e}");
        let counts = [own[k].points.len(), own[k].cost().newton];
        table.row(&row(
            name,
            counts,
            own_errors[k],
            clock::median(&seconds),
            [time(clock::median(&start)), String::new()],
        ));
        rows.iter().for_each(|row| table.row(row));
    }
    Ok(format!(
        "Errors are the largest of all points after the first, which is given, relative; what either code takes to start and for a first point \
         is not counted in the ratios (medians). \
         At tolerance {:.0e} foldline is {} times as fast as AUTO with NTST {}, NCOL {}, DS {}, DSMAX {} (target 10), {} times as with the mesh and the \
         largest step of {} that are the fastest at which AUTO's larger error is not larger, and {} times as with the fastest of {}, if degree and \
         first step are chosen too. Of foldline's {} its Newton iterations take {}, timed one by one at its points; were there nothing else to do, the last ratio \
         would be about {}.\n\n{}",
        study.plan.tolerance,
        digits(said[2]),
        USUAL.intervals,
        USUAL.degree,
        USUAL.first,
        USUAL.step,
        digits(said[0]),
        plain.len(),
        digits(said[1]),
        all.len(),
        time(net),
        time(newton),
        digits(said[1] * net / newton),
        table.text()
    ))
}
