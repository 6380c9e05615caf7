//! The rotor as text, nondimensional and in SI units, against the one written by hand.

use foldline::contract::{Batch, Parameters, VectorField};
use foldline::model::Model;
use foldline_rotor::{ContactLaw, Nondimensional, OverhungRotor, Si};
use foldline_store::model_file::read_model;
use std::path::Path;

fn text(name: &str) -> Model {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models").join(name);
    match read_model(&path) {
        Ok((model, _)) => model,
        Err(found) => panic!("{}", found.iter().map(|d| d.to_string()).collect::<Vec<_>>().join("\n")),
    }
}

/// The values of models/overhung-rotor-si.toml.
const SI: Si = Si {
    speed: 500.0,
    kappa: 0.0,
    sharpness: 150.0,
    mass: 3.6,
    eccentricity: 0.353e-3,
    disc_distance: 0.5,
    spring_distance: 0.25,
    clearance: 0.5e-3,
    diametral_inertia: 0.1,
    polar_inertia: 0.143,
    stiffness: 1.6e5,
    damping: 32.0,
    cubic_stiffness: 1.6e11,
    ring_stiffness: 1.6e6,
};

/// Numbers in (-1, 1) without a pattern.
fn scattered(from: usize, count: usize) -> Vec<f64> {
    (from..from + count).map(|i| 2.0 * (i as f64 * 0.618_033_988_749_894_9).fract() - 1.0).collect()
}

/// States at radii around contact that exercise every part of the contact law.
fn states(lanes: usize) -> Vec<f64> {
    let s = scattered(1, 4 * lanes);
    let radius = |l: usize| if l.is_multiple_of(2) { 1.0 + 0.02 * s[l] } else { 2.0 * s[l].abs() };
    let angle = |l: usize| std::f64::consts::PI * s[lanes + l];
    let mut states = vec![0.0; 4 * lanes];
    for l in 0..lanes {
        states[l] = radius(l) * angle(l).cos();
        states[lanes + l] = radius(l) * angle(l).sin();
        states[2 * lanes + l] = 10.0 * s[2 * lanes + l];
        states[3 * lanes + l] = 10.0 * s[3 * lanes + l];
    }
    states
}

/// Rounding of a few operations, relative to the largest term of the sum, which is bounded by the largest entry.
fn assert_close(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    let size = expected.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
    for (i, (a, b)) in found.iter().zip(expected).enumerate() {
        assert!((a - b).abs() <= tolerance * size, "{what}, entry {i}: {a} {b}, largest {size}");
    }
}

#[test]
fn text_and_hand_written_model_agree_in_values_and_derivatives() {
    const LANES: usize = 53;
    let (model, native) = (text("overhung-rotor.toml"), OverhungRotor::default());
    assert_eq!(model.defaults(), Nondimensional::REFERENCE.parameters());
    let names: Vec<&str> = model.parameters.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["Omega", "kappa", "zeta", "epsilon", "gamma", "beta", "K", "J_p", "m"]);
    assert_eq!(model.whirl, Some([0, 1]));
    let x = states(LANES);
    let free: Vec<usize> = (0..9).collect();
    for kappa in [0.0, 0.4, 1.0] {
        let p = Nondimensional { kappa, zeta: 0.03, ..Nondimensional::REFERENCE }.parameters();
        let at = Batch { lanes: LANES, states: &x, parameters: Parameters::Shared(&p), times: &[], signs: &[] };
        let arrays = || (vec![0.0; 4 * LANES], vec![0.0; 16 * LANES], vec![0.0; 36 * LANES], vec![0.0; LANES]);
        let (mut f, mut fx, mut fp, mut r) = arrays();
        model.linearise(at, &free, &mut f, &mut fx, &mut fp);
        model.outputs(at, &mut r);
        let (mut f_native, mut fx_native, mut fp_native, mut r_native) = arrays();
        native.linearise(at, &free, &mut f_native, &mut fx_native, &mut fp_native);
        native.outputs(at, &mut r_native);
        assert_close(&f, &f_native, 1e-13, "f");
        assert_close(&fx, &fx_native, 1e-13, "fx");
        assert_close(&fp, &fp_native, 1e-13, "fp");
        assert_close(&r, &r_native, 1e-15, "r");
        for order in 1..=4 {
            let directions: Vec<Vec<f64>> = (0..order).map(|d| scattered(1000 * d, 13 * LANES)).collect();
            let directions: Vec<&[f64]> = directions.iter().map(|d| d.as_slice()).collect();
            let (mut found, mut expected) = (vec![0.0; 4 * LANES], vec![0.0; 4 * LANES]);
            model.directional(at, &directions, &mut found);
            native.directional(at, &directions, &mut expected);
            // Near contact, derivatives of order k grow like Kᵏ and are sums of terms of that size.
            assert_close(&found, &expected, 1e-12, &format!("order {order}, kappa {kappa}"));
        }
    }
}

/// Each of the other contact laws as text and by hand, around contact and at a sharpness where exponentials would
/// overflow.
#[test]
fn contact_laws_as_text_agree_with_those_by_hand() {
    const LANES: usize = 53;
    let x = states(LANES);
    let free: Vec<usize> = (0..9).collect();
    for law in [ContactLaw::Softplus, ContactLaw::Piecewise] {
        let (model, native) = (text(law.model_file()), OverhungRotor { law });
        assert_eq!(model.defaults(), Nondimensional::REFERENCE.parameters(), "{law:?}");
        for (kappa, sharpness) in [(1.0, 150.0), (0.6, 2000.0)] {
            let p = Nondimensional { kappa, sharpness, ..Nondimensional::REFERENCE }.parameters();
            let at = Batch { lanes: LANES, states: &x, parameters: Parameters::Shared(&p), times: &[], signs: &[] };
            let arrays = || (vec![0.0; 4 * LANES], vec![0.0; 16 * LANES], vec![0.0; 36 * LANES]);
            let ((mut f, mut fx, mut fp), (mut f_native, mut fx_native, mut fp_native)) = (arrays(), arrays());
            model.linearise(at, &free, &mut f, &mut fx, &mut fp);
            native.linearise(at, &free, &mut f_native, &mut fx_native, &mut fp_native);
            let what = format!("{law:?} K = {sharpness}");
            // K magnifies the rounding of r - 1.
            let tolerance = 1e-15 * sharpness;
            assert_close(&f, &f_native, tolerance, &what);
            assert_close(&fx, &fx_native, tolerance, &what);
            assert_close(&fp, &fp_native, tolerance, &what);
            for order in 1..=2 {
                let directions: Vec<Vec<f64>> = (0..order).map(|d| scattered(1000 * d, 13 * LANES)).collect();
                let directions: Vec<&[f64]> = directions.iter().map(|d| d.as_slice()).collect();
                let (mut found, mut expected) = (vec![0.0; 4 * LANES], vec![0.0; 4 * LANES]);
                model.directional(at, &directions, &mut found);
                native.directional(at, &directions, &mut expected);
                assert_close(&found, &expected, 1e-15 * sharpness, &format!("{what}, order {order}"));
            }
        }
    }
}

/// The hand-written Jacobian against the jets, for every contact law.
#[test]
fn jacobian_and_jets_agree_for_every_law() {
    const LANES: usize = 53;
    let x = states(LANES);
    let p = Nondimensional { kappa: 0.7, ..Nondimensional::REFERENCE }.parameters();
    let at = Batch { lanes: LANES, states: &x, parameters: Parameters::Shared(&p), times: &[], signs: &[] };
    let free: Vec<usize> = (0..9).collect();
    for law in [ContactLaw::Tanh, ContactLaw::Softplus, ContactLaw::Piecewise] {
        let native = OverhungRotor { law };
        let (mut f, mut fx, mut fp) = (vec![0.0; 4 * LANES], vec![0.0; 16 * LANES], vec![0.0; 36 * LANES]);
        native.linearise(at, &free, &mut f, &mut fx, &mut fp);
        for axis in 0..13 {
            let mut direction = vec![0.0; 13 * LANES];
            direction[axis * LANES..(axis + 1) * LANES].fill(1.0);
            let mut expected = vec![0.0; 4 * LANES];
            native.directional(at, &[&direction], &mut expected);
            let column: Vec<f64> = (0..4 * LANES)
                .map(|c| match axis {
                    0..4 => fx[((c / LANES) * 4 + axis) * LANES + c % LANES],
                    _ => fp[((c / LANES) * 9 + axis - 4) * LANES + c % LANES],
                })
                .collect();
            assert_close(&column, &expected, 1e-13, &format!("{law:?}, axis {axis}"));
        }
    }
}

#[test]
fn the_si_constants_are_the_reference_constants() {
    let found = Nondimensional::from(&SI).parameters();
    for (found, expected) in found.iter().zip(Nondimensional::REFERENCE.parameters()) {
        assert!((found - expected).abs() <= 4.0 * f64::EPSILON * expected, "{found} {expected}");
    }
    assert!((SI.disc_clearance() - 1e-3).abs() < 1e-18 && (SI.pivot_frequency() - 100.0).abs() < 1e-12);
}

/// The scalings V = c̄ U and d/dt = ω_n d/dτ map one model to the other.
#[test]
fn the_si_model_is_equivalent_to_the_nondimensional_model() {
    const LANES: usize = 53;
    let (si, nondimensional) = (text("overhung-rotor-si.toml"), text("overhung-rotor.toml"));
    assert_eq!(si.defaults(), SI.parameters());
    let (length, frequency) = (SI.disc_clearance(), SI.pivot_frequency());
    let x = states(LANES);
    let units = [length, length, length * frequency, length * frequency];
    let dimensional: Vec<f64> = (0..4 * LANES).map(|i| x[i] * units[i / LANES]).collect();
    for (kappa, speed) in [(0.0, 500.0), (0.5, 213.0), (1.0, 870.0)] {
        let constants = Si { kappa, speed, ..SI };
        let (p, q) = (constants.parameters(), Nondimensional::from(&constants).parameters());
        let (mut found, mut expected) = (vec![0.0; 4 * LANES], vec![0.0; 4 * LANES]);
        si.evaluate(
            Batch { lanes: LANES, states: &dimensional, parameters: Parameters::Shared(&p), times: &[], signs: &[] },
            &mut found,
        );
        nondimensional.evaluate(
            Batch { lanes: LANES, states: &x, parameters: Parameters::Shared(&q), times: &[], signs: &[] },
            &mut expected,
        );
        let found: Vec<f64> = (0..4 * LANES).map(|i| found[i] / (units[i / LANES] * frequency)).collect();
        // The switch magnifies the rounding of the radius by K.
        assert_close(&found, &expected, 1e-13, "f");
    }
}

/// At rest at the centre, where r = 0, values and derivatives are finite.
#[test]
fn values_and_derivatives_are_finite_at_the_centre() {
    for name in [
        "overhung-rotor.toml",
        "overhung-rotor-si.toml",
        "overhung-rotor-softplus.toml",
        "overhung-rotor-piecewise.toml",
    ] {
        let model = text(name);
        let mut p = model.defaults();
        let Some(kappa) = model.parameter_index("kappa") else { panic!("kappa") };
        for value in [0.0, 1.0] {
            p[kappa] = value;
            let free: Vec<usize> = (0..p.len()).collect();
            let at = Batch { lanes: 1, states: &[0.0; 4], parameters: Parameters::Shared(&p), times: &[], signs: &[] };
            let (mut f, mut fx, mut fp) = ([0.0; 4], [0.0; 16], vec![0.0; 4 * p.len()]);
            model.linearise(at, &free, &mut f, &mut fx, &mut fp);
            assert!(f.iter().chain(&fx).chain(&fp).all(|x| x.is_finite()), "{name}: {f:?} {fx:?} {fp:?}");
            let direction = vec![1.0; 4 + p.len()];
            let mut third = [0.0; 4];
            model.directional(at, &[&direction, &direction, &direction], &mut third);
            assert!(third.iter().all(|x| x.is_finite()), "{name}: {third:?}");
        }
    }
}

/// r² [(a + γ r²)² + (2ζΩ)²] = F² has three roots at Ω = 5 (closed form of the synchronous response); the equilibrium
/// follows from the radius. The radii are given to eight decimals, and f grows by at most a + 3γr² ≈ 85 per unit
/// radius.
#[test]
fn the_synchronous_response_matches_its_closed_form() {
    let model = text("overhung-rotor.toml");
    let p = Nondimensional::REFERENCE;
    for r in [0.38958073, 8.83900624, 9.22606067] {
        let stiffness = 1.0 - (1.0 - p.polar) * p.omega.powi(2) + p.gamma * r * r;
        let circulatory = 2.0 * p.zeta * p.omega;
        let below = stiffness.powi(2) + circulatory.powi(2);
        let forcing = p.mass * p.epsilon * p.omega.powi(2);
        let state = [forcing * stiffness / below, -forcing * circulatory / below, 0.0, 0.0];
        let mut f = [0.0; 4];
        let q = p.parameters();
        model.evaluate(
            Batch { lanes: 1, states: &state, parameters: Parameters::Shared(&q), times: &[], signs: &[] },
            &mut f,
        );
        assert!((state[0].hypot(state[1]) - r).abs() < 1e-5, "{r}: {state:?}");
        assert!(f.iter().all(|x| x.abs() < 1e-3), "{r}: {f:?}");
    }
}

/// Two stable cycles of the reference study at Ω = 5, computed with another code (a point to eight decimals, and the
/// period). The flow returns each point to itself. The classical Runge–Kutta method with 4000 steps errs by less than
/// 1e-8 here, and both cycles attract, so the accuracy is limited by the decimals of the point.
#[test]
fn known_cycles_return_to_their_start() {
    let (model, p) = (text("overhung-rotor.toml"), Nondimensional::REFERENCE.parameters());
    let field = |x: [f64; 4]| {
        let mut f = [0.0; 4];
        model.evaluate(
            Batch { lanes: 1, states: &x, parameters: Parameters::Shared(&p), times: &[], signs: &[] },
            &mut f,
        );
        f
    };
    let along = |x: [f64; 4], h: f64, k: [f64; 4]| std::array::from_fn(|i| x[i] + h * k[i]);
    let cycles = [
        ("2:1", 2.0147198658, [0.15353773, 2.35231575, 11.1670571, -0.46452523]),
        ("3:1", 2.6261014808, [-1.28510156, -3.66161685, -12.31731823, 10.80656247]),
    ];
    for (name, period, start) in cycles {
        let h = period / 4000.0;
        let mut x = start;
        for _ in 0..4000 {
            let k1 = field(x);
            let k2 = field(along(x, 0.5 * h, k1));
            let k3 = field(along(x, 0.5 * h, k2));
            let k4 = field(along(x, h, k3));
            x = std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        }
        for i in 0..4 {
            assert!((x[i] - start[i]).abs() < 1e-6, "{name}: {x:?} {start:?}");
        }
    }
}
