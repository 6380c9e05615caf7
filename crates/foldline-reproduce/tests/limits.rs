//! The limit of vanishing unbalance and damping, from half and a quarter of the unbalance at a coarse tolerance.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind, Point};
use foldline::explore::{self, System, growth, known};
use foldline_reproduce::akay2022::PUBLICATION;
use foldline_rotor::{Backbone, ContactLaw, Nondimensional, Ratio, Reach, backbone};
use foldline_store::study_file::{Study, parse_study};

/// The study without its smallest unbalance and without contact DL.
fn coarse() -> Study {
    let plan = PUBLICATION.study("limits").unwrap();
    let mut parts = plan.text.split("\n[[");
    let head = parts.next().unwrap();
    let kept = parts.filter(|part| !part.contains("1/8") && !part.contains("contact DL"));
    let text = kept.fold(format!("tolerance = 1e-5\n{head}"), |text, part| format!("{text}\n[[{part}"));
    parse_study(&text, plan.file, plan.model, plan.model_file).unwrap()
}

fn rooted(kappa: f64, ratio: Ratio) -> Backbone {
    let constants = Nondimensional { kappa, ..Nondimensional::REFERENCE };
    backbone(&constants, ContactLaw::Tanh, ratio, &Reach { speeds: [0.5, 12.0], radius: 30.0, tolerance: 1e-7 })
        .unwrap()
}

/// Folds of a branch by increasing Ω.
fn folds(branch: &Branch) -> Vec<f64> {
    let mut found: Vec<f64> =
        branch.special.iter().filter(|s| s.kind == Kind::Fold).map(|s| s.point.parameters[0]).collect();
    found.sort_by(f64::total_cmp);
    found
}

#[test]
fn forced_cycles_tend_to_the_backbones() {
    let study = coarse();
    let system = System::of_plan(&study.model, &study.plan);
    let diagram: Diagram = explore::run(&system, &study.plan, 2, Diagram::default(), &Unobserved);
    let branch = |name: &str| diagram.branch(name).unwrap();
    for (name, ratio, power) in [("SL", Ratio::SINGLE_LOOP, 1), ("DL", Ratio::DOUBLE_LOOP, 2)] {
        // The backbone up to Ω = 5.
        let reach = Reach { speeds: [0.5, 5.0], radius: 30.0, tolerance: 1e-7 };
        let limit =
            backbone(&Nondimensional::REFERENCE, ContactLaw::Tanh, ratio, &reach).unwrap().points.pop().unwrap();
        assert!((limit.speed - 5.0).abs() < 1e-12);
        let settings = growth::settings(&system, study.plan.tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
        let distance = |part: &str| {
            let found = known::solutions_at(&system, &settings, branch(&format!("cubic {name} {part}")), 5.0);
            assert_eq!(found.len(), 2, "{name} {part}");
            found.iter().map(|p: &Point| (p.solution.period().unwrap() - limit.period).abs()).fold(0.0, f64::max)
        };
        let order = (distance("1/2") / distance("1/4")).log2();
        // The next power of ε changes it by a hundredth; the tolerance of the run is 1e-5 of a period.
        assert!((order - f64::from(power)).abs() < 0.05, "{name}: {order}");
    }
    // Contact SL is closed, and its last fold is where the backbone loses its forced cycles, to first order in ε.
    let found = rooted(1.0, Ratio::SINGLE_LOOP);
    for (part, zeta, epsilon) in [("1/2", 0.0025, 0.1765), ("1/4", 0.000625, 0.08825)] {
        let branch = branch(&format!("contact SL {part}"));
        assert!(branch.ends.contains(&Some(Ending::Closed)), "{:?}", branch.ends);
        let (foretold, computed) = (found.turning_points(zeta / epsilon), folds(branch));
        assert_eq!((foretold.len(), computed.len()), (2, 2));
        assert!((foretold[1][0] - computed[1]).abs() < 2e-3, "{foretold:?} {computed:?}");
        assert!((foretold[0][0] - computed[0]).abs() < 1e-2, "{foretold:?} {computed:?}");
    }
    // Cubic DL turns back at both ends, which hardly move, because ζ/ε² is constant.
    let [whole, half] = ["1/2", "1/4"].map(|part| folds(branch(&format!("cubic DL {part}"))));
    assert!(whole.len() == 2 && half.len() == 2);
    assert!((0..2).all(|k| (whole[k] - half[k]).abs() < 0.05), "{whole:?} {half:?}");
}
