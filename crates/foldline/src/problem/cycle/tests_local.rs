//! Cycles with local forces, with and without use of the structure.

use super::CycleProblem;
use crate::contract::ZeroProblem;
use crate::diagram::Mesh;
use crate::model::{Definition, Forcing, Model, ModelSource, Parameter, State};
use crate::problem::{Axis, Setting};

/// A damped chain with a self-excited first mass, and a force of its own on the last one.
/// With `full`, every velocity depends on every position, as in finite-element models.
fn chain(masses: usize, force: &str, full: bool) -> Model {
    let mut states = Vec::new();
    let mut equations = Vec::new();
    for i in 0..masses {
        states.extend([State::new(&format!("x{i}")), State::new(&format!("v{i}"))]);
        equations.push(Definition::new(&format!("x{i}"), &format!("v{i}")));
        let left = if i == 0 { "0".to_string() } else { format!("x{}", i - 1) };
        let right = if i + 1 == masses { "0".to_string() } else { format!("x{}", i + 1) };
        let own = match i {
            0 => "+ (p - x0^2)*v0 + 0.3*cos(w*t)".to_string(),
            _ if i + 1 == masses => format!("- {}", force.replace('q', &format!("x{i}"))),
            _ => String::new(),
        };
        let stiffness = 4.0 + 0.1 * i as f64;
        let more: String =
            (0..if full { masses } else { 0 }).map(|k| format!(" - {}*x{k}", 1e-4 * (i + k) as f64)).collect();
        let law = format!("-{stiffness}*(2*x{i} - {left} - {right}) - 0.03*v{i} {own}{more}");
        equations.push(Definition::new(&format!("v{i}"), &law));
    }
    Model::compile(ModelSource {
        name: "chain".into(),
        parameters: vec![Parameter::new("p", 0.4), Parameter::new("w", 1.0)],
        states,
        equations,
        forcing: Some(Forcing { is_frequency: true, expression: "w".into() }),
        ..ModelSource::default()
    })
    .unwrap()
}

fn profile(n: usize, count: usize, nodes: &[f64]) -> Vec<f64> {
    let block = nodes.len() * n;
    let mut u: Vec<f64> = (0..count * block)
        .map(|k| {
            let (j, node, c) = (k / block, k % block / n, k % n);
            let t = std::f64::consts::TAU * (j as f64 + nodes[node]) / count as f64;
            ((1 + c % 3) as f64 * t + 0.3 * c as f64).sin() / (1.0 + 0.1 * (c / 2) as f64)
        })
        .collect();
    u.extend([1.0, 0.4]);
    u
}

/// Cycles of one forcing period: without a trivial multiplier, multipliers are defined for any profile.
fn forced<'a>(setting: Setting<'a>, mesh: &Mesh) -> CycleProblem<'a> {
    let mut problem = CycleProblem::new(setting, 4, mesh);
    problem.forcing_periods = 1;
    problem.arrange();
    problem
}

/// Solutions of the same Newton step, multipliers and error of multipliers, with and without the structure.
fn both(masses: usize, force: &str, count: usize) -> [(Vec<f64>, Vec<f64>, Vec<f64>); 2] {
    let n = 2 * masses;
    let (model, scales) = (chain(masses, force, false), vec![1.0; n]);
    let mesh: Mesh = (0..=count).map(|j| (j as f64 / count as f64).powf(1.1)).collect();
    [false, true].map(|structured| {
        let setting =
            Setting { field: &model, scales: &scales, parameters: vec![0.4, 1.0], axes: vec![Axis::new(0, 1.0)] };
        let mut problem = forced(setting, &mesh);
        if !structured {
            problem = problem.without_structure();
        }
        let u = profile(n, count, &problem.scheme().nodes.clone());
        problem.anchor(&u);
        let row: Vec<f64> = (0..u.len()).map(|k| (0.7 * k as f64).sin()).collect();
        problem.factorise(&u, &row).unwrap();
        assert_eq!(problem.is_localised(), structured);
        let rhs: Vec<f64> = (0..u.len()).map(|k| ((k * k) as f64 * 0.3).cos()).collect();
        let mut x = vec![0.0; u.len()];
        problem.solve(&rhs, &mut x);
        let examined = problem.stability(&u);
        let moduli = examined.spectrum.iter().map(|z| z.norm()).collect();
        let error = problem.spectrum_error(&u, &row, &examined.spectrum);
        (x, moduli, vec![error, examined.trust.liouville_defect])
    })
}

#[test]
fn local_forces_give_the_newton_step_and_the_multipliers_of_the_general_system() {
    for force in ["0.5*q^3", "20*max(q - 0.2, 0)"] {
        let [(x, moduli, error), (own, own_moduli, own_error)] = both(20, force, 24);
        let size = crate::linalg::max_abs(&x);
        let apart = x.iter().zip(&own).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-10 * size, "{force}: {apart:e} of {size:e}");
        for (a, b) in moduli.iter().zip(&own_moduli) {
            assert!((a - b).abs() < 1e-9 * a.max(1.0), "{force}: {a} {b}");
        }
        // Two estimates of the same error.
        assert!(own_error[0] < 10.0 * error[0] && error[0] < 10.0 * own_error[0], "{force}: {error:?} {own_error:?}");
        assert!((own_error[1] - error[1]).abs() < 1e-6, "{force}: {error:?} {own_error:?}");
    }
}

/// Ratio of the times of a factorisation with one solution: `cargo test -p foldline --release --lib ratio -- --ignored
/// --nocapture`.
#[test]
#[ignore = "a measurement"]
fn ratio_of_general_to_local_factorisations() {
    for masses in [32, 60, 120] {
        let n = 2 * masses;
        let count = 40;
        let (model, scales) = (chain(masses, "0.5*q^3", true), vec![1.0; n]);
        let mesh: Mesh = (0..=count).map(|j| j as f64 / count as f64).collect();
        let times = [false, true].map(|structured| {
            let setting =
                Setting { field: &model, scales: &scales, parameters: vec![0.4, 1.0], axes: vec![Axis::new(0, 1.0)] };
            let mut problem = forced(setting, &mesh);
            if !structured {
                problem = problem.without_structure();
            }
            let u = profile(n, count, &problem.scheme().nodes.clone());
            problem.anchor(&u);
            let row = vec![1.0; u.len()];
            let mut x = vec![0.0; u.len()];
            (0..3)
                .map(|_| {
                    let start = std::time::Instant::now();
                    problem.factorise(&u, &row).unwrap();
                    problem.solve(&row, &mut x);
                    start.elapsed().as_secs_f64()
                })
                .fold(f64::INFINITY, f64::min)
        });
        println!("{n} states: {:.4} s general, {:.4} s local, ratio {:.1}", times[0], times[1], times[0] / times[1]);
    }
}
