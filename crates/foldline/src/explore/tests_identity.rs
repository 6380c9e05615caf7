//! Identity of cycles: several turns of one, copies shifted by forcing periods, neighbours in a sweep.

use super::growth::{polished, problem_of, settings};
use super::minimal::reduced;
use super::seeds::bare;
use super::{
    AttractorKey, BranchPlan, ExplorePlan, Plan, SeedPlan, SeedSource, Start, SweepPlan, Switching, System, run,
};
use crate::contract::{Event, Observer, Unobserved, Verdict};
use crate::diagram::{Branch, Cycle, Diagram, Ending, Kind, Point, Solution};
use crate::model::{Definition, Forcing, Model, ModelSource, Parameter, State};
use std::f64::consts::TAU;
use std::sync::Mutex;

fn compiled(parameters: &[(&str, f64)], frequency: Option<&str>, equations: &[(&str, &str)]) -> Model {
    Model::compile(ModelSource {
        name: "test".into(),
        parameters: parameters.iter().map(|(name, value)| Parameter::new(name, *value)).collect(),
        forcing: frequency.map(|text| Forcing { is_frequency: true, expression: text.into() }),
        states: equations.iter().map(|(name, _)| State::new(name)).collect(),
        equations: equations.iter().map(|(name, text)| Definition::new(name, text)).collect(),
        ..ModelSource::default()
    })
    .unwrap()
}

/// Period doublings of the parametrically pumped resonator of HarmonicBalance.jl, issues 62 and 249: rest doubles its
/// period at w = 0.98849257053 and 1.01140437084 (Floquet multipliers from an integration at 1e-13).
const DOUBLINGS: [f64; 2] = [0.98849257053, 1.01140437084];

fn parametron() -> Model {
    let rate = "-0.01*y - (1 - 0.05*cos(2*w*t))*x - x^3 - 0.3*x^2*y";
    compiled(&[("w", 0.9)], Some("2*w"), &[("x", "y"), ("y", rate)])
}

fn seed(source: SeedSource, parameters: &[f64], samples: usize) -> SeedPlan {
    SeedPlan { name: "start".into(), source, parameters: parameters.to_vec(), samples, random: 1 }
}

fn branch(range: [f64; 2], depth: &[(Kind, usize)]) -> BranchPlan {
    BranchPlan {
        holds: Default::default(),
        name: "branch".into(),
        start: Start::Seed(0),
        free: 0,
        range,
        until: None,
        switching: Switching { depth: depth.to_vec(), only: Vec::new() },
        marks: Vec::new(),
        max_points: 1000,
    }
}

fn followed(model: &Model, seed: SeedPlan, branch: BranchPlan) -> Vec<Branch> {
    let plan = Plan { seeds: vec![seed], branches: vec![branch], ..Plan::empty(1e-6, 4) };
    run(&System::of_plan(model, &plan), &plan, 1, Diagram::default(), &Unobserved).branches
}

/// Asserts that both ends are those period doublings.
#[track_caller]
fn ends_at_both_doublings(branch: &Branch) {
    let mut at: Vec<f64> = branch
        .ends
        .iter()
        .flatten()
        .map(|end| match end {
            Ending::Joined { at: Kind::PeriodDoubling, parameter } => *parameter,
            other => panic!("{other}"),
        })
        .collect();
    assert_eq!(at.len(), 2);
    at.sort_by(f64::total_cmp);
    assert!(at.iter().zip(DOUBLINGS).all(|(a, b)| (a - b).abs() < 1e-6), "{at:?}");
}

#[test]
fn an_exploration_lists_a_family_and_what_doubles_from_it_once() {
    let model = parametron();
    let depth = [(Kind::PeriodDoubling, 2), (Kind::BranchPoint, 2)].to_vec();
    let exploration = ExplorePlan {
        name: "all".into(),
        parameters: vec![0.9],
        free: 0,
        range: [0.9, 1.15],
        values: 3,
        samples: 32,
        random: 1,
        switching: Switching { depth, only: Vec::new() },
        connect: None,
        budget: 10_000,
        max_points: 1000,
    };
    let plan = Plan { explorations: vec![exploration], ..Plan::empty(1e-6, 4) };
    let found = run(&System::of_plan(&model, &plan), &plan, 1, Diagram::default(), &Unobserved).branches;
    let names: Vec<&str> = found.iter().map(|branch| branch.name.as_str()).collect();
    assert_eq!(names, ["all/cycle-1", "all/cycle-2"]);
    let periods = |branch: &Branch| branch.points[1].solution.forcing_periods();
    let (doubled, rest) = if periods(&found[0]) == 2 { (&found[0], &found[1]) } else { (&found[1], &found[0]) };
    assert_eq!((periods(doubled), periods(rest)), (2, 1));
    ends_at_both_doublings(doubled);
    let at: Vec<f64> = rest.special.iter().map(|special| special.point.parameters[0]).collect();
    assert!(at.iter().zip(DOUBLINGS).all(|(a, b)| (a - b).abs() < 1e-7) && at.len() == 2, "{at:?}");
}

#[test]
fn a_branch_that_starts_with_two_forcing_periods_ends_where_its_halves_become_equal() {
    let start = seed(SeedSource::Attractor(AttractorKey::Lasting(2)), &[1.0], 64);
    let found = followed(&parametron(), start, branch([0.9, 1.15], &[(Kind::BranchPoint, 2)]));
    assert_eq!(found.len(), 1, "its copy one forcing period later is not another one");
    ends_at_both_doublings(&found[0]);
}

#[test]
fn a_doubled_branch_ends_at_its_other_period_doubling_though_some_states_do_not_double() {
    // An absorber tuned to half the frequency: when it moves, `a` has the opposite sign after a forcing period, and `b`
    // repeats itself exactly, so that any difference of `b` is error.
    let model = compiled(
        &[("w", 1.7)],
        Some("w"),
        &[("a", "va"), ("b", "vb"), ("va", "-0.02*va - a - 2*a*b"), ("vb", "-0.04*vb - 4*b - a^2 + 0.02*cos(w*t)")],
    );
    let start = seed(SeedSource::State(vec![0.0; 4]), &[1.7], 1);
    let found = followed(&model, start, branch([1.7, 2.3], &[(Kind::PeriodDoubling, 1)]));
    let names: Vec<&str> = found.iter().map(|branch| branch.name.as_str()).collect();
    assert_eq!(names, ["branch", "branch/period-doubling-1"]);
    let at: Vec<f64> = found[0].special.iter().map(|special| special.point.parameters[0]).collect();
    let ends: Vec<Option<Ending>> = found[1].ends.to_vec();
    let joined = |value: f64| Some(Ending::Joined { at: Kind::PeriodDoubling, parameter: value });
    assert_eq!(ends, [joined(at[0]), joined(at[1])]);
}

/// Returns a cycle over `turns` periods.
fn repeated(cycle: &Cycle, turns: usize) -> Cycle {
    let times = |k: usize| cycle.mesh[1..].iter().map(move |t| (k as f64 + t) / turns as f64);
    Cycle {
        period: cycle.period * turns as f64,
        forcing_periods: cycle.forcing_periods * turns as u32,
        mesh: std::iter::once(0.0).chain((0..turns).flat_map(times)).collect(),
        degree: cycle.degree,
        points: cycle.points,
        profile: cycle.profile.repeat(turns),
        gain: Vec::new(),
    }
}

/// Returns a point of a branch over several turns, solved for on a mesh that need not be the same for each of them.
fn over(system: &System, point: &Point, turns: usize) -> Point {
    let Solution::Cycle(cycle) = &point.solution else { panic!("no cycle") };
    let settings = settings(system, 1e-6, [f64::NEG_INFINITY, f64::INFINITY], 0);
    let guess = bare(&point.parameters, Solution::Cycle(repeated(cycle, turns)));
    polished(&mut *problem_of(system, 0, 4, &guess, false), &settings, &guess).unwrap().point
}

#[test]
fn next_to_a_period_doubling_a_doubled_cycle_is_told_from_its_parent_run_twice() {
    let model = parametron();
    let start = seed(SeedSource::State(vec![0.0, 0.0]), &[0.9], 1);
    let found = followed(&model, start, branch([0.9, 1.15], &[(Kind::PeriodDoubling, 1)]));
    let system = System::of(&model, &[0.9]);
    let settings = settings(&system, 1e-6, [f64::NEG_INFINITY, f64::INFINITY], 0);
    let doubled = &found[1];
    assert_eq!(doubled.name, "branch/period-doubling-1");
    // The first point is the period doubling itself. Beside it, the amplitude starts with some thousandths.
    assert!(reduced(&system, &settings, &doubled.points[0]).is_some());
    let smallest = doubled.points[1].ranges[0][1];
    assert!(smallest < 5e-3 && smallest > 0.0, "{smallest}");
    for point in &doubled.points[1..doubled.points.len() - 1] {
        assert!(reduced(&system, &settings, point).is_none(), "at {:?}", point.parameters);
    }
    for turns in [2, 3, 6] {
        let long = over(&system, &doubled.points[doubled.points.len() / 2], turns);
        assert_eq!(reduced(&system, &settings, &long).unwrap().solution.forcing_periods(), 2);
    }
}

/// x' = x - 2 y - x (x² + y²), y' = 2 x + y - y (x² + y²): the cycle is the unit circle, of period π.
fn circle() -> Model {
    compiled(&[("p", 1.0)], None, &[("x", "p*x - 2*y - x*(x^2 + y^2)"), ("y", "2*x + p*y - y*(x^2 + y^2)")])
}

#[derive(Default)]
struct Notes(Mutex<Vec<String>>);

impl Observer for Notes {
    fn observe(&self, event: Event) -> Verdict {
        if let Event::Note(_, text) = event {
            self.0.lock().unwrap().push(text.to_string());
        }
        Verdict::Continue
    }
}

#[test]
fn a_given_profile_of_several_turns_starts_a_branch_of_one() {
    let model = circle();
    for turns in [1, 2, 3, 5] {
        let count = 24 * turns;
        let times: Vec<f64> = (0..=count).map(|k| k as f64 / count as f64).collect();
        let states: Vec<f64> =
            times.iter().map(|t| TAU * t * turns as f64).flat_map(|angle| [angle.cos(), angle.sin()]).collect();
        let given = Cycle::given(0.5 * TAU * turns as f64, &times, &states, 4, 4).unwrap();
        let plan = Plan {
            seeds: vec![seed(SeedSource::Cycle(given), &[1.0], 1)],
            branches: vec![branch([0.5, 2.0], &[])],
            ..Plan::empty(1e-6, 4)
        };
        let notes = Notes::default();
        let found = run(&System::of_plan(&model, &plan), &plan, 1, Diagram::default(), &notes).branches;
        let period = found[0].points[0].solution.period().unwrap();
        assert!((period - 0.5 * TAU).abs() < 1e-6, "{turns} turns: {period}");
        let said =
            notes.0.into_inner().unwrap().iter().any(|note| note.contains(&format!("is {turns} turns of a cycle")));
        assert_eq!(said, turns > 1);
    }
}

fn swept(model: &Model, parameters: &[f64], values: Vec<f64>) -> (Vec<f64>, Vec<Option<bool>>) {
    let start =
        SeedPlan { parameters: parameters.to_vec(), ..seed(SeedSource::Attractor(AttractorKey::Cycle), &[], 8) };
    let sweep = SweepPlan { name: "up".into(), start: Start::Seed(0), free: 0, values: values.clone() };
    let plan = Plan { seeds: vec![start], sweeps: vec![sweep], ..Plan::empty(1e-6, 4) };
    let found = run(&System::of_plan(model, &plan), &plan, 1, Diagram::default(), &Unobserved).responses.remove(0);
    let jumped = found.responses.iter().map(|response| response.jumped).collect();
    (found.jumps().into_iter().map(|k| values[k]).collect(), jumped)
}

#[test]
fn a_sharp_resonance_is_no_jump_and_a_fold_is() {
    let values = |low: f64, high: f64| -> Vec<f64> { (0..=20).map(|k| low + (high - low) * k as f64 / 20.0).collect() };
    // Linear, with an amplification of 100: between two values the amplitude grows sixfold.
    let linear = compiled(&[("w", 0.8)], Some("w"), &[("x", "v"), ("v", "-0.01*v - x + 0.1*cos(w*t)")]);
    let (jumps, jumped) = swept(&linear, &[0.9], values(0.9, 1.1));
    assert_eq!(jumps, Vec::<f64>::new());
    assert!(jumped[0].is_none() && jumped[1..].iter().all(|j| *j == Some(false)), "{jumped:?}");
    // Hardening: the upper part of the resonance curve ends at a fold, beyond which the sweep falls to the lower part.
    let hardening = compiled(&[("w", 0.8)], Some("w"), &[("x", "v"), ("v", "-0.1*v - x - x^3 + 0.3*cos(w*t)")]);
    let start = seed(SeedSource::Attractor(AttractorKey::Cycle), &[0.8], 8);
    let curve = followed(&hardening, start, branch([0.8, 2.4], &[])).remove(0);
    let fold = curve.special.iter().filter(|s| s.kind == Kind::Fold).map(|s| s.point.parameters[0]).fold(0.0, f64::max);
    let (jumps, _) = swept(&hardening, &[0.8], values(0.8, 2.4));
    assert!(jumps.len() == 1 && jumps[0] > fold && jumps[0] < fold + 0.08, "{jumps:?}, fold at {fold}");
}

#[test]
fn a_range_that_reaches_frequency_zero_is_reported_as_the_cause() {
    let model = compiled(&[("w", 0.8)], Some("w"), &[("x", "v"), ("v", "-0.05*v - x + 0.1*cos(w*t)")]);
    let start = seed(SeedSource::State(vec![0.0, 0.0]), &[0.8], 1);
    let found = followed(&model, start, branch([0.0, 2.0], &[])).remove(0);
    assert_eq!(found.ends[1], Some(Ending::Bound(2.0)));
    let said = found.ends[0].as_ref().unwrap().to_string();
    assert!(said.contains("the range extends to 0, where the forcing has no period"), "{said}");
    assert!(said.lines().count() == 3 && said.contains("what to do"), "{said}");
}
