//! Artefacts of a small sharpness, and the sharpness that is sufficient.

use foldline::attractors::{Sampling, Trial, survey_by_simulation};
use foldline::contract::{Unobserved, Verdict};
use foldline::diagram::{Diagram, Response};
use foldline::explore::{
    self, BranchPlan, Persistence, Plan, SeedPlan, SeedSource, Start, Switching, System, persistence,
};
use foldline_rotor::{
    ContactLaw, Nondimensional, OverhungRotor, exact_motion, fitted_power, smallest_sharpness, smoothing_errors,
};

const SHARPNESS: usize = 6;

#[test]
fn the_false_unstable_piece_below_contact_is_recognised() {
    let field = OverhungRotor::default();
    let constants = Nondimensional { kappa: 1.0, beta: 6.0, sharpness: 30.0, omega: 0.6, ..Nondimensional::REFERENCE };
    let parameters = constants.parameters().to_vec();
    let seed = SeedPlan {
        name: "S".into(),
        // Without contact: r = mεΩ²/(1 - (1 - J_p)Ω²) = 0.165.
        source: SeedSource::State(vec![0.165, 0.0, 0.0, 0.0]),
        parameters,
        samples: 1,
        random: 1,
    };
    let branch = BranchPlan {
        holds: Default::default(),
        name: "S".into(),
        start: Start::Seed(0),
        free: 0,
        range: [0.6, 1.1],
        until: None,
        switching: Switching::default(),
        marks: Vec::new(),
        max_points: 3000,
    };
    let plan = Plan {
        tolerance: 1e-6,
        degree: 4,
        limits: Default::default(),
        simulation: foldline::attractors::Limits::patient(),
        seeds: vec![seed],
        branches: vec![branch],
        curves: Vec::new(),
        homotopies: Vec::new(),
        explorations: Vec::new(),
        surveys: Vec::new(),
        sweeps: Vec::new(),
        designs: Vec::new(),
        maps: Vec::new(),
        record: Vec::new(),
    };
    let system = System::new(&field);
    let diagram = explore::run(&system, &plan, 1, Diagram::default(), &Unobserved);
    let branch = &diagram.branches[0];
    // At small sharpness S folds twice below contact, with an unstable piece in between; the exact law has neither.
    let folds: Vec<f64> = branch.special.iter().map(|s| s.point.ranges[4][1]).collect();
    assert!(folds.len() == 2 && folds.iter().all(|r| (0.9..1.0).contains(r)), "{folds:?}");
    let mut unstable = 0;
    for point in &branch.points {
        let r = point.ranges[4][1];
        let fate = persistence(&system, 1e-6, 4, point, SHARPNESS, 90.0, 2000);
        match fate {
            Persistence::Vanishes { fold } => assert!(fold > 30.0 && fold < 90.0 && r > 0.9 && r < 1.0, "{r} {fold}"),
            // The solution that survives below contact is the free motion, up to the pull of the tanh law at K = 90: at
            // most 0.14 β/K = 0.01 over a stiffness of 0.3 there.
            Persistence::Survives(at) => assert!(point.unstable == 0 && (at.ranges[4][1] - r).abs() < 0.1, "{r}"),
            other => panic!("{r}: {other:?}"),
        }
        unstable += usize::from(point.unstable > 0);
    }
    assert!(unstable >= 3, "{unstable}");
    let fate = |r: f64| {
        let nearest =
            branch.points.iter().min_by(|a, b| (a.ranges[4][1] - r).abs().total_cmp(&(b.ranges[4][1] - r).abs()));
        persistence(&system, 1e-6, 4, nearest.unwrap(), SHARPNESS, 90.0, 2000).is_artefact()
    };
    assert_eq!([0.5, 0.96, 1.02].map(fate), [false, true, false]);
}

/// The 2:1 and 3:1 motions of the piecewise law at Ω = 5 reached from given starts.
fn motions(constants: &Nondimensional) -> Vec<Response> {
    let field = OverhungRotor { law: ContactLaw::Piecewise };
    let scales = [1.0; 4];
    let whirl = Some([0, 1]);
    let trial =
        Trial { field: &field, scales: &scales, whirl, jobs: 2, limits: foldline::attractors::Limits::patient() };
    let ranges = vec![[-5.0, 5.0], [-5.0, 5.0], [-15.0, 15.0], [-15.0, 15.0]];
    let sampling = Sampling {
        ranges,
        scales: scales.to_vec(),
        whirl,
        samples: 24,
        seed: 1,
        jobs: 2,
        tolerance: 1e-6,
        limits: Default::default(),
        given: None,
    };
    let found = survey_by_simulation(&trial, &sampling, &constants.parameters(), 0, &[5.0], &|_| Verdict::Continue);
    let named = |r: &Response| [(2, 1), (3, 1)].contains(&r.ratio.unwrap_or_default()) && r.multiplicity == 1;
    found.into_iter().filter(named).collect()
}

#[test]
fn the_smoothing_error_falls_with_the_square_of_the_sharpness() {
    let mut published = Vec::new();
    for (beta, expected) in [(10.0, 2), (6.0, 1)] {
        let constants = Nondimensional { kappa: 1.0, beta, ..Nondimensional::REFERENCE };
        let motions = motions(&constants);
        assert_eq!(motions.len(), expected);
        for motion in &motions {
            let exact = exact_motion(&constants, motion.state.clone().try_into().unwrap()).unwrap();
            let errors = smoothing_errors(&constants, &exact, &[6.0, 15.0, 30.0].map(|times| times * beta));
            // Five times the sharpness reduces the error by 25. The motions are settled to about 1e-7.
            let gain = errors[0].largest() / errors[2].largest();
            assert!((15.0..40.0).contains(&gain), "{gain} {errors:?}");
            assert!(errors.iter().all(|e| e.lines > 0.0 && e.lines < 1e-3 && e.period < e.lines), "{errors:?}");
            let (power, first) = fitted_power(&errors, 1e-6).unwrap();
            assert!((power - 2.0).abs() < 0.25 && first > 0.0, "{power} {first}");
            published.push(errors[1].largest());
        }
        let (sharpness, error) = smallest_sharpness(&constants, &motions, 1e-3).unwrap();
        // Found by bisection to a hundredth; the error goes like the square.
        assert!(error <= 1e-3 && error > 0.95e-3, "K = {sharpness}: {error}");
    }
    // K = 15 β, the choice of akay2024, makes no error visible in a picture.
    assert!(published.iter().all(|e| *e < 1e-4), "{published:?}");
}
