//! Conservative backbones: their roots and limits, their orbits by quadrature, and forced cycles that tend to them.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Cycle, Family, Kind, Origin, Point, Solution};
use foldline::explore::{System, growth, known};
use foldline::problem::gauss::Scheme;
use foldline::simulation::{Integrator, Tolerance};
use foldline_rotor::{
    Backbone, BackbonePoint, ContactLaw, Nondimensional, OverhungRotor, Ratio, Reach, Spectrum, backbone,
};

const CUBIC: Nondimensional = Nondimensional::REFERENCE;
const CONTACT: Nondimensional = Nondimensional { kappa: 1.0, ..Nondimensional::REFERENCE };
const RATIOS: [Ratio; 2] = [Ratio::SINGLE_LOOP, Ratio::DOUBLE_LOOP];

fn computed(constants: &Nondimensional, law: ContactLaw, ratio: Ratio, largest: f64, radius: f64) -> Backbone {
    backbone(constants, law, ratio, &Reach { speeds: [0.5, largest], radius, tolerance: 1e-7 }).unwrap()
}

fn spectrum(point: &BackbonePoint) -> Spectrum {
    match &point.point.solution {
        Solution::Cycle(cycle) => Spectrum::of(cycle, point.speed),
        Solution::Equilibrium(_) | Solution::Torus(_) => panic!("a backbone is made of cycles"),
    }
}

/// With a cubic spring Ω - Ω_n grows with the square of the radius.
#[test]
fn cubic_backbones_are_rooted_at_the_linear_resonance() {
    for ratio in RATIOS {
        let found = computed(&CUBIC, ContactLaw::Tanh, ratio, 60.0, 0.2);
        let rate = |p: &BackbonePoint| (p.speed - found.root) / p.r_max.powi(2);
        let near = &found.points[0];
        assert!(near.r_max < 1.1e-3 && (near.speed - found.root).abs() < 1e-6);
        let further = found.points.iter().find(|p| p.r_max > 0.02).unwrap();
        // The next term is of relative order r² ~ 1e-3; the speeds are accurate to 1e-10, a part in 1e4 of their
        // difference from the root.
        assert!((rate(further) / rate(near) - 1.0).abs() < 1e-2, "{} {}", rate(near), rate(further));
        assert_eq!(spectrum(further).name(), format!("{}:1", ratio.backward));
    }
}

/// Below r = 1 contact is not felt; above it the speeds lie inside (Ω_n, sqrt(1 + β) Ω_n), and the distance from the
/// upper end halves when the radius doubles, because the effective stiffness is β (1 - 1/r).
#[test]
fn contact_backbones_fill_the_contact_interval() {
    for (ratio, law) in RATIOS.into_iter().zip([ContactLaw::Piecewise, ContactLaw::Softplus]) {
        let [low, high] = ratio.contact_interval(CONTACT.polar, CONTACT.beta).unwrap();
        let found = computed(&CONTACT, law, ratio, 60.0, 300.0);
        for p in &found.points {
            if p.r_max < 0.9 {
                assert!((p.speed - low).abs() < 1e-8, "{}: {}", p.r_max, p.speed);
            } else {
                assert!(p.speed > low - 1e-8 && p.speed < high, "{}: {}", p.r_max, p.speed);
            }
        }
        let gap = |r: f64| {
            let p = found.points.iter().find(|p| p.r_max > r).unwrap();
            (high - p.speed) * p.r_max
        };
        assert!((gap(140.0) / gap(280.0) - 1.0).abs() < 1e-2, "{} {}", gap(140.0), gap(280.0));
    }
}

/// The pull of the tanh law just below contact softens the rotor: its backbones leave the contact interval at the lower
/// end, less so for a sharper switch.
#[test]
fn the_pull_of_the_tanh_law_moves_backbones_out_of_the_contact_interval() {
    let lowest = |law, ratio, sharpness| {
        let found = computed(&Nondimensional { sharpness, ..CONTACT }, law, ratio, 4.0, 1.1);
        found.points.iter().map(|p| p.speed - found.root).fold(f64::INFINITY, f64::min)
    };
    for ratio in RATIOS {
        let [soft, sharp] = [30.0, 150.0].map(|k| lowest(ContactLaw::Tanh, ratio, k));
        assert!(soft < 5.0 * sharp && sharp < -1.4e-3, "{soft} {sharp}");
        assert!(lowest(ContactLaw::Softplus, ratio, 30.0) > -1e-8);
        assert!(lowest(ContactLaw::Piecewise, ratio, 150.0) > -1e-8);
    }
}

/// The net power over an orbit vanishes to the accuracy of its integration: a tenth of the tolerance, and a
/// tolerance smaller by a hundred leaves a thirtieth of that or less.
#[test]
fn orbits_balance_power_to_the_requested_tolerance() {
    for (constants, ratio) in [(CUBIC, RATIOS[1]), (CONTACT, RATIOS[0])] {
        let largest = |tolerance: f64| {
            let reach = Reach { speeds: [0.5, 8.0], radius: 4.0, tolerance };
            let found = backbone(&constants, ContactLaw::Softplus, ratio, &reach).unwrap();
            assert!(found.points.len() > 15);
            found.points.iter().step_by(3).map(|p| spectrum(p).power_defect().abs()).fold(0.0, f64::max)
        };
        let (loose, tight) = (largest(1e-7), largest(1e-9));
        assert!(loose < 1e-8 && tight < loose / 30.0, "{loose:e} {tight:e}");
    }
}

#[test]
fn orbits_close() {
    for (constants, ratio) in [(CUBIC, RATIOS[0]), (CUBIC, RATIOS[1]), (CONTACT, RATIOS[0]), (CONTACT, RATIOS[1])] {
        let found = computed(&constants, ContactLaw::Softplus, ratio, 8.0, 4.0);
        assert!(found.points.len() > 15);
        for p in found.points.iter().step_by(5) {
            let Solution::Cycle(cycle) = &p.point.solution else { panic!() };
            let integrator = Integrator::new(
                &OverhungRotor { law: ContactLaw::Softplus },
                &p.point.parameters,
                Tolerance { relative: 1e-12, absolute: vec![1e-12 * p.r_max; 4] },
            );
            let start = cycle.state(0.0);
            let end = integrator.state_after(&start, [0.0, p.period]).unwrap();
            // A tolerance of 1e-7 per half radial period, of which there are up to four.
            assert!(end.iter().zip(&start).all(|(a, b)| (a - b).abs() < 1e-6 * p.r_max), "{start:?} {end:?}");
        }
    }
}

/// T_r, A and the power by quadrature over s = r² between its turning values. With s = mean + half cos ψ the integrands
/// are periodic and smooth, so the trapezoidal rule converges exponentially.
#[test]
fn cubic_orbits_agree_with_quadrature() {
    for ratio in RATIOS {
        let found = computed(&CUBIC, ContactLaw::Tanh, ratio, 10.0, 30.0);
        for p in found.points.iter().step_by(6) {
            let (gamma, polar, omega) = (CUBIC.gamma, CUBIC.polar, p.speed);
            let stiffness = 1.0 + (0.5 * polar * omega).powi(2);
            let (low, high) = (p.r_min.powi(2), p.r_max.powi(2));
            // (ds/dτ)²/4 = 2E s - stiffness s² - γ s³/2 - L² = (γ/2)(s - low)(high - s)(s + third).
            let third = low + high + 2.0 * stiffness / gamma;
            let momentum = (0.5 * gamma * low * high * third).sqrt();
            let energy = 0.25 * gamma * ((low + high) * third - low * high);
            let (mut period, mut turn, mut power) = (0.0, 0.0, 0.0);
            const STEPS: usize = 2000;
            // Sign of L = r² (θ′ + g) at the turning point.
            let sense = match &p.point.solution {
                Solution::Cycle(cycle) => {
                    let x = cycle.state(0.0);
                    (x[0] * x[3] + (1.0 - 0.5 * polar) * omega * x[0] * x[0]).signum()
                }
                Solution::Equilibrium(_) | Solution::Torus(_) => panic!(),
            };
            let l = sense * momentum;
            for i in 0..STEPS {
                let psi = std::f64::consts::PI * (i as f64 + 0.5) / STEPS as f64;
                let s = 0.5 * (low + high) + 0.5 * (high - low) * psi.cos();
                let dt = std::f64::consts::PI / STEPS as f64 / (0.5 * gamma * (s + third)).sqrt();
                let speed = 2.0 * energy - stiffness * s - 0.5 * gamma * s * s;
                period += dt;
                turn += l / s * dt;
                let rotating =
                    speed - (1.0 - polar) * omega * l - (1.0 - 0.5 * polar) * 0.5 * polar * omega * omega * s;
                power += rotating * dt;
            }
            let d = f64::from(ratio.backward) - 1.0;
            assert!((d * period / p.period - 1.0).abs() < 1e-7, "{}: {} {}", p.speed, d * period, p.period);
            let angle =
                (turn - (1.0 - 0.5 * polar) * omega * period + std::f64::consts::TAU / d) / std::f64::consts::TAU;
            assert!((angle - angle.round()).abs() < 1e-7, "{}: {angle} turns", p.speed);
            assert!(power.abs() < 1e-6 * period * energy, "{}: {power}", p.speed);
        }
    }
}

/// A cycle of the reference study at Ω = 5, continued from one of its points.
fn reference(rotor: &OverhungRotor, ratio: Ratio) -> Point {
    let (period, start) = match ratio {
        Ratio::SINGLE_LOOP => (2.0147198658, [0.15353773, 2.35231575, 11.1670571, -0.46452523]),
        _ => (2.6261014808, [-1.28510156, -3.66161685, -12.31731823, 10.80656247]),
    };
    let parameters = CUBIC.parameters();
    let integrator = Integrator::new(rotor, &parameters, Tolerance::uniform(1e-9, 4));
    let (scheme, mut profile, mut x, mut t) = (Scheme::new(4), Vec::new(), start.to_vec(), 0.0);
    for j in 0..40 {
        for node in &scheme.nodes {
            let next = (f64::from(j) + node) / 40.0 * period;
            if next > t {
                x = integrator.state_after(&x, [t, next]).unwrap();
            }
            t = next;
            profile.extend_from_slice(&x);
        }
    }
    let mesh: Vec<f64> = (0..=40).map(|j| f64::from(j) / 40.0).collect();
    Point {
        parameters: parameters.to_vec(),
        solution: Solution::Cycle(Cycle {
            points: foldline::problem::gauss::Points::Gauss,
            period,
            forcing_periods: 0,
            mesh: mesh.into(),
            degree: 4,
            profile,
            gain: Vec::new(),
        }),
        ..computed(&CUBIC, ContactLaw::Tanh, ratio, 4.0, 0.01).points[0].point.clone()
    }
}

/// The branch through `point` in one parameter, in both directions.
fn followed(rotor: &OverhungRotor, point: &Point, free: usize, range: [f64; 2]) -> Branch {
    let mut system = System::new(rotor);
    system.scales = vec![1.0, 1.0, 3.0, 3.0];
    system.parameter_scales[free] = range[1];
    let settings = growth::settings(&system, 1e-7, range, 300);
    let mut problem = growth::problem_of(&system, free, 4, point, false);
    let station = growth::polished(&mut *problem, &settings, point).unwrap();
    let mut branch = Branch::new("forced", Family::Cycle, free, Origin::Seed("reference".into()));
    let (system, settings) = (&system, &settings);
    let growth = growth::Growth {
        marks: &[],
        system,
        settings,
        degree: 4,
        sides: [true; 2],
        parents: &[],
        ties: Vec::new(),
        observer: &Unobserved,
        sparse: false,
        whole: true,
    };
    growth.begin(&mut branch, growth::Beginning::Inside(station));
    branch
}

/// The forced branch in ε at Ω = 5 with that ζ, from the reference study.
fn in_unbalance(rotor: &OverhungRotor, ratio: Ratio, zeta: f64) -> Branch {
    let damped = followed(rotor, &reference(rotor, ratio), 2, [zeta, 0.01]);
    let by_damping = |a: &&Point, b: &&Point| a.parameters[2].total_cmp(&b.parameters[2]);
    let light = damped.points.iter().min_by(by_damping).unwrap();
    assert!((light.parameters[2] - zeta).abs() < 1e-12, "{:?}", damped.ends);
    followed(rotor, light, 3, [0.002, 0.353])
}

fn at(rotor: &OverhungRotor, branch: &Branch, epsilon: f64) -> Vec<Point> {
    let mut system = System::new(rotor);
    system.scales = vec![1.0, 1.0, 3.0, 3.0];
    let settings = growth::settings(&system, 1e-7, [0.002, 0.353], 300);
    known::solutions_at(&system, &settings, branch, epsilon)
}

/// SL: the distance from the backbone is proportional to ε, at constant ζ far below the damping limit.
#[test]
fn forced_single_loops_tend_to_the_backbone() {
    let rotor = OverhungRotor::default();
    let limit = computed(&CUBIC, ContactLaw::Tanh, Ratio::SINGLE_LOOP, 5.0, 30.0).points.pop().unwrap();
    assert!((limit.speed - 5.0).abs() < 1e-12);
    let branch = in_unbalance(&rotor, Ratio::SINGLE_LOOP, 1e-4);
    let gaps: Vec<[f64; 3]> = [0.04, 0.02, 0.01]
        .iter()
        .map(|&epsilon| {
            let found = at(&rotor, &branch, epsilon);
            assert_eq!(found.len(), 1);
            let range = found[0].ranges[4];
            let period = found[0].solution.period().unwrap();
            let Solution::Cycle(cycle) = &found[0].solution else { panic!() };
            let lines = Spectrum::of(cycle, 5.0);
            // The tolerance of the branch is 1e-7.
            assert!(lines.power_defect().abs() < 1e-8 && lines.torque_defect(1e-4, CUBIC.mass * epsilon).abs() < 1e-8);
            [range[1] - limit.r_max, range[0] - limit.r_min, period - limit.period]
        })
        .collect();
    for pair in gaps.windows(2) {
        for k in 0..3 {
            // The second-order term in ε is a few per cent of the first here.
            assert!((pair[0][k] / pair[1][k] - 2.0).abs() < 0.1, "{gaps:?}");
        }
    }
    assert!(gaps[2][0].abs() < 0.01 && gaps[2][2].abs() < 1e-3, "{gaps:?}");
}

/// DL is symmetric under half a turn, so the period differs only by the square of ε, and the branch turns back where ζ
/// is a multiple of ε².
#[test]
fn forced_double_loops_tend_to_the_backbone_and_turn_back_where_damping_is_quadratic_in_unbalance() {
    let rotor = OverhungRotor::default();
    let limit = computed(&CUBIC, ContactLaw::Tanh, Ratio::DOUBLE_LOOP, 5.0, 30.0).points.pop().unwrap();
    let fold = |branch: &Branch| {
        let folds: Vec<f64> =
            branch.special.iter().filter(|s| s.kind == Kind::Fold).map(|s| s.point.parameters[3]).collect();
        assert_eq!(folds.len(), 1, "{folds:?}");
        folds[0]
    };
    let branch = in_unbalance(&rotor, Ratio::DOUBLE_LOOP, 1e-5);
    let lighter = in_unbalance(&rotor, Ratio::DOUBLE_LOOP, 2.5e-6);
    assert!((fold(&branch) / fold(&lighter) - 2.0).abs() < 0.02, "{} {}", fold(&branch), fold(&lighter));
    // Both sheets, well above the fold of the lighter branch.
    let gaps = |epsilon: f64| {
        let mut found: Vec<f64> =
            at(&rotor, &lighter, epsilon).iter().map(|p| p.solution.period().unwrap() - limit.period).collect();
        found.sort_by(f64::total_cmp);
        assert_eq!(found.len(), 2);
        found
    };
    let (wide, narrow) = (gaps(0.08), gaps(0.04));
    (0..2).for_each(|k| assert!((wide[k] / narrow[k] - 4.0).abs() < 0.2, "{wide:?} {narrow:?}"));
}

/// Contact SL is an isola, for ζ = 0.01 and ε = 0.353 between folds at 3.352613 and 10.340617: there the backbone loses
/// its forced cycles. This holds to first order in ε and ζ, and better where ε is small compared with r_max.
#[test]
fn the_damping_limit_predicts_where_the_contact_branch_closes() {
    let found = computed(&CONTACT, ContactLaw::Tanh, Ratio::SINGLE_LOOP, 12.0, 30.0);
    let ends = found.turning_points(CONTACT.zeta / CONTACT.epsilon);
    assert_eq!(ends.len(), 2, "{ends:?}");
    assert!((ends[0][0] - 3.352613).abs() < 5e-3 && (ends[1][0] - 10.340617).abs() < 2e-3, "{ends:?}");
    let top = found.points.last().unwrap();
    assert_eq!(top.phases(CONTACT.epsilon, CONTACT.zeta), None);
    let double = computed(&CONTACT, ContactLaw::Tanh, Ratio::DOUBLE_LOOP, 4.0, 2.0);
    assert!(double.points.iter().all(|p| p.damping_limit().is_none()) && double.turning_points(0.01).is_empty());
}

#[test]
fn ratios_without_a_backbone_are_refused() {
    let reach = Reach { speeds: [0.5, 10.0], radius: 2.0, tolerance: 1e-6 };
    let refused = |constants: &Nondimensional, backward, forward, reach: &Reach| {
        let mistake = backbone(constants, ContactLaw::Tanh, Ratio { backward, forward }, reach).unwrap_err();
        assert!(mistake.place == format!("ratio {backward}:{forward}") && !mistake.cure.is_empty());
        mistake.cause
    };
    assert!(refused(&CUBIC, 2, -1, &reach).contains("power"));
    assert!(refused(&CUBIC, 1, 0, &reach).contains("power"));
    assert!(refused(&CUBIC, 4, 2, &reach).contains("lowest terms"));
    assert!(refused(&CUBIC, 7, 6, &reach).contains("no speed"));
    assert!(refused(&CUBIC, 2, 1, &Reach { speeds: [4.0, 10.0], ..reach }).contains("lies outside"));
    assert!(refused(&CUBIC, 2, 1, &Reach { radius: f64::NAN, ..reach }).contains("positive"));
    assert!(refused(&Nondimensional { gamma: f64::NAN, ..CUBIC }, 2, 1, &reach).contains("not the root"));
}
