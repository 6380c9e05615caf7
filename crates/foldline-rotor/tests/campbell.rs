//! Natural frequencies and resonance speeds: closed forms against the eigenvalues of the vector field itself.

use foldline::stability::eigenvalues;
use foldline_rotor::{Nondimensional, OverhungRotor, Ratio, campbell, modes, resonances, undamped_modes};

const POLAR: f64 = Nondimensional::REFERENCE.polar;

/// The 4 × 4 Jacobian has the two roots of the complex quadratic and their conjugates.
#[test]
fn modes_are_eigenvalues_of_the_vector_field() {
    for (kappa, r, stiffness) in [(0.0, 0.0, 1.0), (1.0, 0.0, 1.0)] {
        for (omega, zeta) in [(0.0, 0.01), (0.7, 0.0), (2.3, 0.3), (5.0, 0.01), (40.0, 1.7)] {
            let constants = Nondimensional { omega, zeta, kappa, ..Nondimensional::REFERENCE };
            let jacobian = OverhungRotor::default().state_jacobian([r, 0.0, 0.0, 0.0], &constants);
            let spectrum = eigenvalues(&jacobian.concat(), 4, &[1.0; 4]);
            let found = modes(&constants, stiffness);
            for k in 0..2 {
                let size = 1.0 + found.rotating[k].abs() + found.growth[k].abs();
                let near = |sign: f64| {
                    let at = spectrum.iter().map(|z| (z.re - found.growth[k]).hypot(z.im - sign * found.rotating[k]));
                    at.fold(f64::INFINITY, f64::min)
                };
                // Rounding of an eigenvalue solver, relative to the largest eigenvalue.
                assert!(
                    near(1.0).max(near(-1.0)) < 1e-13 * size * (1.0 + omega),
                    "{omega} {zeta}: {found:?} {spectrum:?}"
                );
            }
        }
    }
}

#[test]
fn without_damping_the_closed_form_is_the_characteristic_equation() {
    let speeds: Vec<f64> = (0..60).map(|i| 0.2 * f64::from(i)).collect();
    for stiffness in [1.0, 11.0] {
        let undamped = Nondimensional { zeta: 0.0, ..Nondimensional::REFERENCE };
        for found in campbell(&undamped, stiffness, &speeds) {
            let closed = undamped_modes(found.speed, POLAR, stiffness);
            for k in 0..2 {
                let lambda = found.rotating[k];
                let left = lambda * lambda + (2.0 - POLAR) * found.speed * lambda;
                let rest = left + (1.0 - POLAR) * found.speed.powi(2) - stiffness;
                assert!(rest.abs() < 1e-12 * (1.0 + lambda * lambda), "{found:?}: {rest}");
                assert!((lambda - closed.rotating[k]).abs() < 1e-13 * (1.0 + lambda.abs()));
                assert!((found.inertial[k] - closed.inertial[k]).abs() < 1e-13 * (1.0 + found.speed));
            }
            // In the inertial frame one mode whirls forward at every speed and the other backward.
            assert!(found.inertial[0] > 0.0 && found.inertial[1] < 0.0);
        }
    }
}

/// 2:1 and 3:1 against ten digits of an independent computation, and the ratio itself for all others.
#[test]
fn resonance_speeds_match_an_independent_computation() {
    let close = |a: f64, b: f64| (a - b).abs() < 5e-10;
    assert!(close(Ratio::SINGLE_LOOP.speed(POLAR, 1.0).unwrap(), 3.320848274));
    assert!(close(Ratio::DOUBLE_LOOP.speed(POLAR, 1.0).unwrap(), 2.180021683));
    let all = resonances(POLAR, 1.0, 7);
    // 17 pairs n > m ≥ 1 up to 7 are coprime; for 7:6 J_p = 0.143 is just above the limit 1/7.
    assert_eq!(all.len(), 16);
    assert!(!all.iter().any(|(ratio, _)| ratio.backward == 7 && ratio.forward == 6));
    for (ratio, speed) in all {
        let found = undamped_modes(speed, POLAR, 1.0).rotating;
        let (n, m) = (f64::from(ratio.backward), f64::from(ratio.forward));
        assert!((found[1] * m - found[0] * n).abs() < 1e-12 * speed * n, "{ratio:?} at {speed}: {found:?}");
    }
    let critical = Ratio { backward: 1, forward: 0 }.speed(POLAR, 1.0).unwrap();
    assert!(((1.0 - POLAR) * critical * critical - 1.0).abs() < 1e-14);
    let against = Ratio { backward: 2, forward: -1 };
    let found = undamped_modes(against.speed(POLAR, 1.0).unwrap(), POLAR, 1.0).rotating;
    assert!(found[0] > 0.0 && (found[1] + 2.0 * found[0]).abs() < 1e-13, "{found:?}");
}

#[test]
fn a_ratio_exists_only_below_its_limit_of_polar_inertia() {
    assert_eq!([Ratio::SINGLE_LOOP, Ratio::DOUBLE_LOOP].map(Ratio::polar_limit), [0.5, 2.0 / 3.0]);
    for ratio in [Ratio::SINGLE_LOOP, Ratio::DOUBLE_LOOP, Ratio { backward: 5, forward: 3 }] {
        let limit = ratio.polar_limit();
        assert!(ratio.speed(0.999 * limit, 1.0).is_some_and(|speed| speed > 20.0));
        for polar in [1.001 * limit, 1.5, 2.0, 10.0] {
            assert_eq!(ratio.speed(polar, 1.0), None, "{ratio:?} {polar}");
        }
    }
    for none in
        [Ratio { backward: 1, forward: 1 }, Ratio { backward: 1, forward: 3 }, Ratio { backward: 0, forward: 0 }]
    {
        assert_eq!(none.speed(0.1, 1.0), None);
    }
}

#[test]
fn the_contact_interval_scales_with_the_root_of_the_stiffness() {
    let beta = Nondimensional::REFERENCE.beta;
    let [low, high] = Ratio::SINGLE_LOOP.contact_interval(POLAR, beta).unwrap();
    assert!((high / low - (1.0 + beta).sqrt()).abs() < 1e-14);
}
