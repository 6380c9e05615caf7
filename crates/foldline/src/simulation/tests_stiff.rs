//! Trajectories of stiff fields, with known answers.

use super::*;
use crate::contract::Verdict;
use crate::model::{Definition, Model, ModelSource, Parameter, State};

const ACCURACY: f64 = 1e-6;

fn model(states: &[(&str, &str)], parameters: &[(&str, f64)]) -> Model {
    Model::compile(ModelSource {
        name: "stiff".into(),
        parameters: parameters.iter().map(|(name, value)| Parameter::new(name, *value)).collect(),
        states: states.iter().map(|(name, _)| State::new(name)).collect(),
        equations: states.iter().map(|(name, equation)| Definition::new(name, equation)).collect(),
        ..ModelSource::default()
    })
    .unwrap()
}

/// End of the trajectory from `start`, with the number of steps.
fn arrive(model: &Model, start: &[f64], span: [f64; 2], limit: usize) -> Arrival {
    let n = start.len();
    let tolerance = Tolerance::uniform(ACCURACY, n);
    let (parameters, mut seen) = (model.defaults(), span[0]);
    let arrival = Integrator::new(model, &parameters, tolerance).with_step_limit(limit).trajectory(
        start,
        span,
        &[],
        &mut |passage| {
            // Steps follow one another, and end where the next one begins.
            if let Passage::Step(step) = passage {
                assert_eq!(step.start_time(), seen);
                seen = step.end_time();
            }
            Verdict::Continue
        },
    );
    assert_eq!(seen, arrival.time);
    arrival
}

#[test]
fn a_slaved_fast_state_costs_no_more_steps_however_fast_it_is() {
    // x = cos t, and z lags it by 1 / rate: z = (rate² cos t + rate sin t) / (rate² + 1).
    for rate in [1e4, 1e6, 1e9] {
        let slaved = model(&[("x", "y"), ("y", "-x"), ("z", "rate*(x - z)")], &[("rate", rate)]);
        let arrival = arrive(&slaved, &[1.0, 0.0, 1.0], [0.0, 40.0], 4000);
        assert_eq!(arrival.outcome, Outcome::Reached, "{rate:e}: {} steps", arrival.steps);
        let (sin, cos) = 40f64.sin_cos();
        let z = (rate * rate * cos + rate * sin) / (rate * rate + 1.0);
        for (value, exact) in arrival.state.iter().zip([cos, -sin, z]) {
            // Errors add up over six periods.
            assert!((value - exact).abs() < 1e-4, "{rate:e}: {value} instead of {exact}");
        }
    }
}

#[test]
fn robertson_reaction_comes_to_rest_in_a_flow() {
    let reaction = model(
        &[("a", "k*(1 - a) - 0.04*a + 1e4*b*c"), ("b", "-k*b + 0.04*a - 1e4*b*c - 3e7*b^2"), ("c", "-k*c + 3e7*b^2")],
        &[("k", 0.01)],
    );
    for start in [[1.0, 0.0, 0.0], [0.5, 0.5, 0.5], [0.0, 1.0, 0.0], [0.3, 0.9, 0.1]] {
        let arrival = arrive(&reaction, &start, [0.0, 1e12], 20_000);
        assert_eq!(arrival.outcome, Outcome::Reached, "{start:?}: {} steps to {}", arrival.steps, arrival.time);
        let total: f64 = arrival.state.iter().sum();
        assert!((total - 1.0).abs() < 1e-6, "{start:?}: {:?}", arrival.state);
    }
}

#[test]
fn implicit_steps_end_where_a_switch_changes_sign() {
    // z follows |x| by 1e-6, x = cos t. On [0, 40] cos t has 13 zeros.
    let kinked = model(&[("x", "y"), ("y", "-x"), ("z", "rate*(abs(x) - z)")], &[("rate", 1e6)]);
    let (parameters, mut zeros) = (kinked.defaults(), Vec::new());
    let integrator = Integrator::new(&kinked, &parameters, Tolerance::uniform(ACCURACY, 3)).with_step_limit(4000);
    let arrival = integrator.trajectory(&[1.0, 0.0, 1.0], [0.0, 40.0], &[], &mut |passage| {
        if let Passage::Step(step) = passage
            && step.end(0).abs() < 1e-8
        {
            zeros.push(step.end_time());
        }
        Verdict::Continue
    });
    assert_eq!(arrival.outcome, Outcome::Reached, "{} steps to {}", arrival.steps, arrival.time);
    assert_eq!(zeros.len(), 13, "{zeros:?}");
    for (k, time) in zeros.iter().enumerate() {
        let exact = (k as f64 + 0.5) * std::f64::consts::PI;
        assert!((time - exact).abs() < 1e-4, "{time} instead of {exact}");
    }
    assert!((arrival.state[2] - 40f64.cos().abs()).abs() < 1e-4, "{:?}", arrival.state);
}
