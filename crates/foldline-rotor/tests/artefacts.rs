//! What a small sharpness makes up, and which sharpness is enough.

use foldline::attractors::{Sampling, Trial, survey_by_simulation};
use foldline::contract::{Unobserved, Verdict};
use foldline::diagram::{Diagram, Response};
use foldline::explore::{
    self, BranchPlan, Persistence, Plan, SeedPlan, SeedSource, Start, Switching, System, persistence,
};
use foldline_rotor::{ContactLaw, Nondimensional, OverhungRotor, exact_motion, smallest_sharpness, smoothing_errors};

const SHARPNESS: usize = 6;

#[test]
fn the_false_unstable_piece_below_contact_is_recognised() {
    let field = OverhungRotor::default();
    let constants = Nondimensional { kappa: 1.0, beta: 6.0, sharpness: 30.0, omega: 0.6, ..Nondimensional::REFERENCE };
    let parameters = constants.parameters().to_vec();
    let seed = SeedPlan {
        name: "S".into(),
        // Free of contact: r = mεΩ²/(1 - (1 - J_p)Ω²) = 0.165.
        source: SeedSource::State(vec![0.165, 0.0, 0.0, 0.0]),
        parameters,
        samples: 1,
        random: 1,
    };
    let branch = BranchPlan {
        name: "S".into(),
        start: Start::Seed(0),
        free: 0,
        range: [0.6, 1.1],
        until: None,
        switching: Switching::default(),
        max_points: 3000,
    };
    let plan = Plan {
        tolerance: 1e-6,
        degree: 4,
        seeds: vec![seed],
        branches: vec![branch],
        curves: Vec::new(),
        homotopies: Vec::new(),
        surveys: Vec::new(),
        sweeps: Vec::new(),
    };
    let system = System::new(&field);
    let diagram = explore::run(&system, &plan, 1, Diagram::default(), &Unobserved);
    let branch = &diagram.branches[0];
    for special in &branch.special {
        eprintln!("{} at {:.6} r {:?}", special.kind, special.point.parameters[0], special.point.ranges[4]);
    }
    for point in branch.points.iter().filter(|p| p.ranges[4][1] < 1.05) {
        let fate = persistence(&system, 1e-6, 4, point, SHARPNESS, 90.0, 2000);
        let text = match &fate {
            Persistence::Survives(at) => format!("survives r {:.5}", at.ranges[4][1]),
            Persistence::Changes(at) => format!("changes r {:.5} unstable {}", at.ranges[4][1], at.unstable),
            Persistence::Vanishes { fold } => format!("vanishes at K {fold:.3}"),
            Persistence::Undecided(why) => format!("undecided: {why}"),
        };
        eprintln!("{:.5} r {:.5} unstable {} {text}", point.parameters[0], point.ranges[4][1], point.unstable);
    }
}

/// The 2:1 and 3:1 motions of the piecewise law at Ω = 5.
fn motions(constants: &Nondimensional) -> Vec<Response> {
    let field = OverhungRotor { law: ContactLaw::Piecewise };
    let scales = [1.0; 4];
    let trial = Trial { field: &field, scales: &scales, whirl: Some([0, 1]), jobs: 2 };
    let ranges = vec![[-5.0, 5.0], [-5.0, 5.0], [-15.0, 15.0], [-15.0, 15.0]];
    let sampling = Sampling {
        ranges,
        scales: scales.to_vec(),
        whirl: Some([0, 1]),
        samples: 24,
        seed: 1,
        jobs: 2,
        tolerance: 1e-6,
    };
    let parameters = constants.parameters();
    let found = survey_by_simulation(&trial, &sampling, &parameters, 0, &[5.0], &|_| Verdict::Continue);
    for r in &found {
        eprintln!("{:?} {:?} x{} {:?} {:?} {}", r.motion, r.ratio, r.multiplicity, r.period, r.ranges[4], r.error);
    }
    [(2, 1), (3, 1)]
        .map(|ratio| found.iter().find(|r| r.ratio == Some(ratio) && r.multiplicity == 1).unwrap().clone())
        .to_vec()
}

#[test]
fn the_error_of_smoothing_falls_with_the_square_of_the_sharpness() {
    for beta in [10.0, 6.0] {
        let constants = Nondimensional { kappa: 1.0, beta, ..Nondimensional::REFERENCE };
        let begun = std::time::Instant::now();
        let motions = motions(&constants);
        eprintln!("{:?}", begun.elapsed());
        for motion in &motions {
            let exact = exact_motion(&constants, motion.state.clone().try_into().unwrap()).unwrap();
            eprintln!("again {:?} {:?}", exact.period, exact.ranges[4]);
            for error in smoothing_errors(&constants, &exact, &[1.0, 3.0, 6.0, 9.0, 15.0, 30.0, 60.0].map(|f| f * beta))
            {
                eprintln!("{:?} {error:?}", motion.ratio);
            }
        }
        for acceptable in [1e-2, 1e-3, 1e-4] {
            eprintln!("beta {beta} {acceptable}: {:?}", smallest_sharpness(&constants, &motions, acceptable));
        }
        eprintln!("{:?}", begun.elapsed());
    }
}
