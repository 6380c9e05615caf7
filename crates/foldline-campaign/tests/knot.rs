//! Clusters of bifurcations: special points closer together than the error of the solutions between them, and a start
//! among them.
//!
//! 6:1 cycles of rotor 103 of the campaign, at a damping of 8.6e-5. At Ω = 2.545785651 there is a fold, followed by a
//! torus point at 6e-8 and a period doubling at 1.2e-6 in arclength; at Ω = 2.545853802 a fold, followed by a period
//! doubling at 1.4e-8. Solutions on two meshes for the same tolerance differ by 3e-8 there. The expected order is that
//! of runs with a tolerance of 3e-9.

use foldline::continuation::{Follow, Homecoming, Item, Settings, Station, follow};
use foldline::contract::{Unobserved, Verdict};
use foldline::diagram::{Branch, Cost, Cycle, Ending, Family, Kind, Origin, Point, Solution, Trust};
use foldline::explore::System;
use foldline::explore::growth::{Beginning, Growth, polished, problem_of, settings};
use foldline::problem::gauss::Scheme;
use foldline::simulation::{Integrator, Passage, Tolerance};
use foldline::special;
use foldline_campaign::cases::{Case, First};
use foldline_campaign::rotor::rotors;
use foldline_campaign::{DEGREE, TOLERANCE};

/// Cycle: Ω, the period, a state (u, v, u', v').
struct Place(f64, f64, [f64; 4]);

const BESIDE_THREE: Place = Place(
    2.545786072846464,
    23.046254354806077,
    [-1.0940053313824278, -0.1800891969289397, -1.0447578512023208, 0.5358191036516666],
);
/// Cycle between the torus point and the period doubling.
const AMONG_THREE: Place = Place(
    2.545785657,
    23.046256891,
    [-1.0940073914470287, -0.18008802553092115, -1.044752005170169, 0.5358240775883379],
);
const BESIDE_TWO: Place = Place(
    2.545853802012023,
    23.045426387189096,
    [-1.0715173051038271, -0.1902244753196616, -1.1122295901786816, 0.42947526248533147],
);

/// Integrates a trajectory over one period and returns the cycle on the mesh of the integration steps.
fn sampled(system: &System, case: &Case, Place(omega, period, state): &Place) -> Point {
    let First::Sampled { parameters, to: (index, value), .. } = &case.first else { unreachable!("a rotor is sampled") };
    let mut parameters = parameters.clone();
    (parameters[*index], parameters[0]) = (*value, *omega);
    let integrator = Integrator::new(system.field, &parameters, Tolerance::uniform(1e-11, 4));
    let mut mesh = vec![0.0];
    integrator.trajectory(state, [0.0, *period], &[], &mut |passage| {
        if let Passage::Step(step) = passage {
            mesh.push(step.end_time() / period);
        }
        Verdict::Continue
    });
    *mesh.last_mut().unwrap() = 1.0;
    let (mut profile, mut then, mut x) = (Vec::new(), 0.0, state.to_vec());
    for ends in mesh.windows(2) {
        for node in Scheme::new(DEGREE).nodes {
            let now = (ends[0] + node * (ends[1] - ends[0])) * period;
            if now > then {
                x = integrator.state_after(&x, [then, now]).unwrap();
            }
            then = now;
            profile.extend_from_slice(&x);
        }
    }
    let cycle = Cycle {
        points: foldline::problem::gauss::Points::Gauss,
        period: *period,
        forcing_periods: 0,
        mesh: mesh.into(),
        degree: DEGREE,
        profile,
        gain: Vec::new(),
    };
    Point {
        position: 0,
        parameters,
        solution: Solution::Cycle(cycle),
        tangent: Vec::new(),
        step: 0.0,
        spectrum: Vec::new(),
        unstable: 0,
        ranges: Vec::new(),
        averages: Vec::new(),
        trust: Trust::default(),
        cost: Cost::default(),
    }
}

fn station(system: &System, settings: &Settings, point: &Point) -> Station {
    polished(&mut *problem_of(system, 0, DEGREE, point, false), settings, point).unwrap()
}

fn grown(system: &System, settings: &Settings, start: Station) -> Branch {
    let mut branch = Branch::new("6:1", Family::Cycle, 0, Origin::Seed("6:1".into()));
    let growth = Growth {
        marks: &[],
        system,
        settings,
        degree: DEGREE,
        ties: Vec::new(),
        sides: [true, true],
        parents: &[],
        observer: &Unobserved,
        whole: true,
        sparse: false,
    };
    growth.begin(&mut branch, Beginning::Inside(start));
    branch
}

/// Returns kinds and numbers of unstable multipliers of the special points. Asserts that they explain every change of
/// that number.
#[track_caller]
fn told(branch: &Branch) -> Vec<(Kind, usize, usize)> {
    let mut count = branch.points[0].unstable;
    let mut told = Vec::new();
    for point in &branch.points {
        assert_eq!(point.unstable, count, "at position {} of {:?}", point.position, branch.special);
        for special in branch.special.iter().filter(|special| special.point.position == point.position) {
            assert_eq!(special.unstable_before, count, "{} at {}", special.kind, point.position);
            count = special.unstable_after;
            told.push((special.kind, special.unstable_before, special.unstable_after));
        }
    }
    told
}

#[test]
fn special_points_closer_together_than_the_discretisation_error_are_resolved() {
    let case = &rotors(103..104)[0];
    let system = System::of_plan(case.model(), &case.study.plan);
    let three = [(Kind::Fold, 1, 2), (Kind::Torus, 2, 0), (Kind::PeriodDoubling, 0, 1)];
    let two = [(Kind::Fold, 1, 2), (Kind::PeriodDoubling, 2, 1)];
    for (place, known) in [(&BESIDE_THREE, &three[..]), (&AMONG_THREE, &three), (&BESIDE_TWO, &two)] {
        let start = sampled(&system, case, place);
        let backwards: Vec<_> = known.iter().rev().map(|(kind, before, after)| (*kind, *after, *before)).collect();
        for first_step in [1e-6, 0.02] {
            let settings = Settings { first_step, ..settings(&system, TOLERANCE, [0.5, 12.0], 8) };
            let branch = grown(&system, &settings, station(&system, &settings, &start));
            let found = told(&branch);
            assert!(found == known || found == backwards, "from {} by {first_step}: {found:?}", place.0);
        }
    }
}

#[test]
fn a_branch_started_within_a_cluster_of_special_points_closes() {
    let case = &rotors(103..104)[0];
    let system = System::of_plan(case.model(), &case.study.plan);
    let settings = settings(&system, TOLERANCE, [0.5, 12.0], 14);
    // Continuation begins far before the cluster, where Ω decreases. After the fold, where the start is, Ω increases.
    // The direction is that of decreasing positions.
    let beside = grown(&system, &settings, station(&system, &settings, &sampled(&system, case, &BESIDE_THREE)));
    let ends = [&beside.points[0], &beside.points[beside.points.len() - 1]];
    let far = ends.into_iter().find(|end| end.free_spectrum()[0].re > 0.0).unwrap();
    let mut start = station(&system, &settings, far);
    let mut home = station(&system, &settings, &sampled(&system, case, &AMONG_THREE)).point;
    assert_eq!((far.unstable, home.unstable), (1, 0));
    start.tangent.iter_mut().for_each(|t| *t = -*t);
    home.tangent.iter_mut().for_each(|t| *t = -*t);
    start.point.step = 1e-4;
    let (monitors, mut met, mut last) = (special::monitors(Family::Cycle, false), Vec::new(), start.point.unstable);
    let mut walk = Follow {
        problem: &mut *problem_of(&system, 0, DEGREE, &start.point, false),
        settings: &Settings { max_points: 40, ..settings.clone() },
        monitors: &monitors,
        marks: &[],
        collapses: &[],
        limit: &|_| None,
        corner: &|_| None,
        holds: false,
        symmetric: false,
        direction: -1.0,
        free: 0,
        home: Some(&home),
        first_period: home.solution.free_period(),
        homecoming: Homecoming::default(),
        inspected: 0.0,
        resolved: f64::INFINITY,
    };
    let ending = follow(&mut walk, start, None, 0, &mut |item| {
        match item {
            Item::Special(special) => met.push(special.kind),
            Item::Point(point) => last = point.unstable,
        }
        Verdict::Continue
    });
    assert_eq!((ending, met, last), (Ending::Closed, vec![Kind::Fold, Kind::Torus], 0));
}
