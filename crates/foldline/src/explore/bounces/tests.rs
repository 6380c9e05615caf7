//! A rotor of one mass in a ring, in the frame that turns with it.

use super::local::Local;
use super::{bounces, rest};
use crate::attractors::spectral_ratio;
use crate::contract::Verdict;
use crate::diagram::Solution;
use crate::explore::System;
use crate::linalg::lu;
use crate::model::{Definition, Model, ModelSource, Parameter, State};
use crate::simulation::{Integrator, Tolerance};
use num_complex::Complex64;

const PARAMETERS: [f64; 3] = [3.6, 20.0, 0.3];

fn rotor() -> Model {
    let names = ["Omega", "ring", "e"];
    let own = |name: &str, text: &str| Definition::new(name, text);
    Model::compile(ModelSource {
        name: "rotor".into(),
        parameters: names.iter().zip(PARAMETERS).map(|(name, value)| Parameter::new(name, value)).collect(),
        states: ["u", "v", "du", "dv"].map(State::new).into(),
        definitions: vec![own("r", "hypot(u, v)"), own("stiffness", "1 - Omega^2 + if(r > 1, ring*(1 - 1/r), 0)")],
        equations: vec![
            own("u", "du"),
            own("v", "dv"),
            own("du", "e*Omega^2 + 2*Omega*dv - 0.02*(du - Omega*v) - stiffness*u"),
            own("dv", "-2*Omega*du - 0.02*(dv + Omega*u) - stiffness*v"),
        ],
        whirl: Some(["u".into(), "v".into()]),
        ..ModelSource::default()
    })
    .unwrap()
}

fn system(model: &Model) -> System<'_> {
    System { whirl: Some([0, 1]), ..System::new(model) }
}

#[test]
fn the_flexibility_is_that_of_the_linear_part() {
    let model = rotor();
    let system = system(&model);
    let local = Local::of(&system, &PARAMETERS, rest(&system, &PARAMETERS).unwrap()).unwrap();
    assert_eq!((local.coordinates(), local.forces()), (2, 2));
    // (s - J)⁻¹ b with s = 0.3 + 0.7i for the force of the ring at e = (1.5, 0.4), relative to that at rest.
    let (omega, s) = (PARAMETERS[0], Complex64::new(0.3, 0.7));
    let k = 1.0 - omega * omega;
    let j = [
        [0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
        [-k, 0.02 * omega, -0.02, 2.0 * omega],
        [-0.02 * omega, -k, -2.0 * omega, -0.02],
    ];
    let e = [1.5, 0.4];
    let at: Vec<f64> = e.iter().zip(local.origin()).map(|(e, x)| e + x).collect();
    let r = at[0].hypot(at[1]);
    assert!(local.origin()[0].hypot(local.origin()[1]) < 1.0);
    let force = at.clone().into_iter().map(|x| -20.0 * (1.0 - 1.0 / r) * x);
    let (mut matrix, mut x, mut pivots) = (vec![0.0; 64], vec![0.0; 8], vec![0; 8]);
    for (row, own) in j.iter().enumerate() {
        for (column, value) in own.iter().enumerate() {
            let diagonal = if row == column { s } else { Complex64::default() };
            let z = diagonal - value;
            (matrix[row * 8 + column], matrix[(4 + row) * 8 + 4 + column]) = (z.re, z.re);
            (matrix[row * 8 + 4 + column], matrix[(4 + row) * 8 + column]) = (-z.im, z.im);
        }
    }
    force.enumerate().for_each(|(i, f)| x[2 + i] = f);
    lu::factorise(&mut matrix, 8, &mut pivots).unwrap();
    lu::solve(&matrix, 8, &pivots, &mut x, 1);
    let g = local.force(&e, 1);
    let h = local.flexibility(s);
    for c in 0..2 {
        let found: Complex64 = (0..2).map(|f| h[c * 2 + f][0] * g[f]).sum();
        assert!((found - Complex64::new(x[c], x[4 + c])).norm() < 1e-11, "{found}");
        let nearby = local.flexibility(s + 1e-6);
        let slope: Complex64 = (0..2).map(|f| (nearby[c * 2 + f][0] - h[c * 2 + f][0]) * 1e6 * g[f]).sum();
        let stated: Complex64 = (0..2).map(|f| h[c * 2 + f][1] * g[f]).sum();
        assert!((slope - stated).norm() < 1e-4 * stated.norm(), "{slope} {stated}");
        let answer = local.answer(s, &g.iter().map(|g| Complex64::new(*g, 0.0)).collect::<Vec<_>>());
        assert!((answer[c] - found).norm() < 1e-12);
    }
}

#[test]
fn bouncing_cycles_return_to_their_start_in_simulation() {
    let model = rotor();
    let system = system(&model);
    for ratio in [(2, 1), (3, 1)] {
        let found = bounces(&system, &PARAMETERS, ratio, 1e-8).unwrap();
        assert!(!found.cycles.is_empty(), "{}", found.none(ratio));
        for point in &found.cycles {
            let Solution::Cycle(cycle) = &point.solution else { panic!("{ratio:?}") };
            assert_eq!(spectral_ratio(cycle, [0, 1]), Some(ratio));
            let tolerance = Tolerance { relative: 1e-10, absolute: vec![1e-10; 4] };
            let integrator = Integrator::new(&model, &PARAMETERS, tolerance);
            let start = cycle.state(0.0);
            let arrival = integrator.trajectory(&start, [0.0, cycle.period], &[], &mut |_| Verdict::Continue);
            let off = start.iter().zip(&arrival.state).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 1e-6, "{ratio:?}: {off}");
        }
        assert!(found.cycles.is_sorted_by_key(|cycle| cycle.unstable));
    }
}

#[test]
fn without_a_solution_the_message_says_what_was_tried() {
    let model = rotor();
    // Below the crossing of the linear whirls, at Ω = 3, no motion has this ratio.
    let parameters = [2.0, 20.0, 0.01];
    let found = bounces(&system(&model), &parameters, (2, 1), 1e-8).unwrap();
    assert!(found.cycles.is_empty(), "{}", found.told((2, 1)));
    let told = found.none((2, 1));
    assert!(told.contains("no 2:1 cycle was found") && told.contains("at 2 coordinates"), "{told}");
}
