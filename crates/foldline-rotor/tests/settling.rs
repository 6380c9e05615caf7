//! Simulation of the rotor without knowledge of branches.

use foldline::attractors::{Sampling, Trial, stepped_sweep, survey_by_simulation};
use foldline::contract::{VectorField, Verdict};
use foldline::diagram::{Motion, Response, Responses, Search};
use foldline::simulation::{Ensemble, Tolerance};
use foldline_rotor::{ContactLaw, Nondimensional, OverhungRotor};

const SCALES: [f64; 4] = [1.0; 4];
const OMEGA: usize = 0;
const RADIUS: usize = 4;

fn trial(field: &dyn VectorField, jobs: usize) -> Trial<'_> {
    Trial { field, scales: &SCALES, whirl: Some([0, 1]), jobs, limits: foldline::attractors::Limits::patient() }
}

fn sampling(samples: usize) -> Sampling {
    let ranges = vec![[-5.0, 5.0], [-5.0, 5.0], [-15.0, 15.0], [-15.0, 15.0]];
    Sampling {
        ranges,
        scales: SCALES.to_vec(),
        whirl: Some([0, 1]),
        samples,
        seed: 1,
        jobs: 2,
        tolerance: 1e-6,
        limits: Default::default(),
        given: None,
    }
}

fn reference(kappa: f64) -> Vec<f64> {
    Nondimensional { kappa, ..Nondimensional::REFERENCE }.parameters().to_vec()
}

fn of_ratio(found: &[Response], ratio: Option<(u32, u32)>) -> &Response {
    found.iter().find(|r| r.ratio == ratio && r.multiplicity == 1).unwrap_or_else(|| panic!("no {ratio:?}"))
}

/// Period and largest radius at Ω = 5 from an independent continuation code, to the digits given.
#[test]
fn settled_motions_agree_with_continuation() {
    let field = OverhungRotor::default();
    for (kappa, period, highest, rest) in
        [(0.0, 2.0147198658, 2.48233521, 0.38958073), (1.0, 1.9910645451, 1.341756, 0.38885703)]
    {
        let survey = |jobs| {
            let trial = trial(&field, jobs);
            survey_by_simulation(&trial, &sampling(20), &reference(kappa), OMEGA, &[5.0], &|_| Verdict::Continue)
        };
        let found = survey(2);
        assert_eq!(found.iter().map(|r| r.hits).sum::<usize>(), 20);
        assert!(found.iter().all(|r| r.motion != Motion::Other && r.error < 1e-6), "{found:?}");
        let single = of_ratio(&found, Some((2, 1)));
        // A cycle settles when its returns agree to 1e-7, at a distance that shrinks by e^(-0.02) from one to the next.
        assert!((single.period.unwrap() - period).abs() < 1e-6, "{:?}", single.period);
        assert!((single.ranges[RADIUS][1] - highest).abs() < 5e-6, "{:?}", single.ranges[RADIUS]);
        // Closed form of the synchronous response; with contact the pull of the tanh law is 1e-80 there.
        assert!((of_ratio(&found, None).ranges[RADIUS][0] - rest).abs() < 1e-8);
        assert_eq!(format!("{found:?}"), format!("{:?}", survey(1)), "the number of threads shows");
    }
}

#[test]
fn a_downward_sweep_doubles_and_jumps_where_the_branch_does() {
    let field = OverhungRotor::default();
    let found =
        survey_by_simulation(&trial(&field, 2), &sampling(20), &reference(1.0), OMEGA, &[4.5], &|_| Verdict::Continue);
    let start = of_ratio(&found, Some((3, 1))).state.clone();
    let values: Vec<f64> = (0..8).map(|k| 4.5 - 0.05 * k as f64).collect();
    let responses =
        stepped_sweep(&trial(&field, 1), &reference(1.0), OMEGA, &values, &start, &mut |_, _| None, &|_| {
            Verdict::Continue
        });
    let seen: Vec<(Motion, u32)> = responses.iter().map(|r| (r.motion, r.multiplicity)).collect();
    // The double loop has a period doubling between 4.25 and 4.3, and no attractor near it below 4.2.
    // At 4.2 the doubled cycle attracts, but a step of 0.05 may leave its basin.
    let (once, twice, rest) = ((Motion::Cycle, 1), (Motion::Cycle, 2), (Motion::Equilibrium, 1));
    assert_eq!(seen[..6], [once, once, once, once, once, twice]);
    assert!(seen[6] == twice || seen[6] == rest);
    assert_eq!(seen[7], rest);
    let set = Responses { name: "down".into(), search: Search::Sweep, free: OMEGA, responses };
    assert_eq!(set.jumps(), [5, if seen[6] == rest { 6 } else { 7 }]);
}

#[test]
fn motion_that_is_neither_steady_nor_periodic_is_classified_as_other() {
    // Without damping the motion stays on a torus and never settles.
    let field = OverhungRotor::default();
    let parameters = Nondimensional { zeta: 0.0, ..Nondimensional::REFERENCE }.parameters();
    let found =
        stepped_sweep(&trial(&field, 1), &parameters, OMEGA, &[5.0], &[0.5, 0.3, 0.2, 0.1], &mut |_, _| None, &|_| {
            Verdict::Continue
        });
    assert_eq!(found[0].motion, Motion::Other);
    let [low, high] = found[0].ranges[RADIUS];
    assert!(low < 0.6 && high > 3.0 && high < 4.0, "{low} {high}");
}

/// Largest error of the state after 30 time units, at tolerance 1e-6, 1e-8 and 1e-10 against 1e-13, over several
/// starts.
#[test]
fn the_error_of_the_piecewise_rotor_is_proportional_to_the_tolerance() {
    let field = OverhungRotor { law: ContactLaw::Piecewise };
    let parameters = reference(1.0);
    let starts: Vec<f64> = (0..12).flat_map(|k| [0.9 - 0.02 * k as f64, 0.1 * k as f64 - 0.5, 2.0, -2.5]).collect();
    let run = |tolerance: f64| {
        let mut contacts = 0;
        let ends = Ensemble::new(&field, &parameters, Tolerance::uniform(tolerance, 4), &starts, [0.0, 10.0]).run(
            &mut |step| {
                contacts += usize::from((step.end(0).hypot(step.end(1)) - 1.0).abs() < 1e-11);
                Verdict::Continue
            },
        );
        (ends.into_iter().map(|arrival| arrival.state).collect::<Vec<_>>(), contacts)
    };
    let (exact, contacts) = run(1e-13);
    assert!(contacts > 60, "{contacts}");
    for tolerance in [1e-6, 1e-8, 1e-10] {
        let (states, located) = run(tolerance);
        assert_eq!(located, contacts, "begins and ends of contact at {tolerance}");
        let errors =
            states.iter().zip(&exact).map(|(a, b)| a.iter().zip(b).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs())));
        let worst = errors.fold(0.0, f64::max);
        assert!(worst < 1000.0 * tolerance, "{worst} at {tolerance}");
    }
}
