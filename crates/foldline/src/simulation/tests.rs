//! Trajectories with known answers.

use super::*;
use crate::contract::{Batch, Parameters, VectorField, Verdict};
use std::f64::consts::PI;

/// Vector field given as a function of one point; only f is needed here.
pub(crate) struct Native {
    pub(crate) dim: usize,
    pub(crate) f: fn(&[f64], &[f64], &mut [f64]),
}

impl VectorField for Native {
    fn dim(&self) -> usize {
        self.dim
    }

    fn parameter_count(&self) -> usize {
        0
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        let Parameters::Shared(parameters) = at.parameters else { return f.fill(f64::NAN) };
        let (mut x, mut y) = (vec![0.0; self.dim], vec![0.0; self.dim]);
        for l in 0..at.lanes {
            (0..self.dim).for_each(|i| x[i] = at.states[i * at.lanes + l]);
            (self.f)(&x, parameters, &mut y);
            (0..self.dim).for_each(|i| f[i * at.lanes + l] = y[i]);
        }
    }

    // Without derivatives the explicit pair integrates every trajectory.
    fn linearise(&self, _: Batch, _: &[usize], _: &mut [f64], fx: &mut [f64], _: &mut [f64]) {
        fx.fill(f64::NAN);
    }

    fn directional(&self, _: Batch, _: &[&[f64]], _: &mut [f64]) {
        unreachable!("integration needs f only")
    }
}

const OSCILLATOR: Native = Native {
    dim: 2,
    f: |x, _, f| {
        f[0] = x[1];
        f[1] = -x[0];
    },
};

const VAN_DER_POL: Native = Native {
    dim: 2,
    f: |x, _, f| {
        f[0] = x[1];
        f[1] = (1.0 - x[0] * x[0]) * x[1] - x[0];
    },
};

/// Slope of log error against log steps, from the first to the last pair.
fn order(cost: &[f64], error: &[f64]) -> f64 {
    let last = cost.len() - 1;
    -(error[last] / error[0]).ln() / (cost[last] / cost[0]).ln()
}

#[test]
fn the_error_falls_with_the_fifth_power_of_the_step() {
    // Kepler's ellipse of eccentricity 1/2 over half a period: x = cos E - e, y = √(1 - e²) sin E at E = π.
    let kepler = Native {
        dim: 4,
        f: |x, _, f| {
            let cube = x[0].hypot(x[1]).powi(3);
            (f[0], f[1], f[2], f[3]) = (x[2], x[3], -x[0] / cube, -x[1] / cube);
        },
    };
    let exact = [-1.5, 0.0, 0.0, -1.0 / 3f64.sqrt()];
    let run = |integrator: Integrator| {
        let arrival = integrator.trajectory(&[0.5, 0.0, 0.0, 3f64.sqrt()], [0.0, PI], &[], &mut |_| Verdict::Continue);
        assert_eq!((arrival.outcome, arrival.time), (Outcome::Reached, PI));
        let error = arrival.state.iter().zip(exact).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        (arrival.steps as f64, error)
    };
    let (mut cost, mut errors) = (vec![], vec![]);
    for longest in [PI / 100.0, PI / 800.0] {
        // The tolerance is so loose that the longest step is decisive.
        let (steps, error) = run(Integrator::new(&kepler, &[], Tolerance::uniform(1.0, 4)).with_longest_step(longest));
        cost.push(steps);
        errors.push(error);
    }
    let order = order(&cost, &errors);
    // The term of order six still contributes a few per cent of the error at the longer step.
    assert!((order - 5.0).abs() < 0.2, "order {order}, steps {cost:?}, errors {errors:?}");
    // Step control keeps the error of each step below the tolerance; errors add up over some dozens of steps.
    for tolerance in [1e-4, 1e-7, 1e-10] {
        let (_, error) = run(Integrator::new(&kepler, &[], Tolerance::uniform(tolerance, 4)));
        assert!(error < 30.0 * tolerance, "{error} at {tolerance}");
    }
}

#[test]
fn the_state_between_the_ends_of_a_step_is_as_accurate_as_order_four_allows() {
    let (mut cost, mut errors) = (vec![], vec![]);
    for tolerance in [1e-5, 1e-8, 1e-11] {
        let mut worst: f64 = 0.0;
        let mut x = [0.0; 2];
        let integrator = Integrator::new(&OSCILLATOR, &[], Tolerance::uniform(tolerance, 2));
        let arrival = integrator.trajectory(&[1.0, 0.0], [0.0, 6.0], &[], &mut |passage| {
            if let Passage::Step(step) = passage {
                for theta in [0.1, 0.3, 0.5, 0.8] {
                    step.state_into(theta, &mut x);
                    let t = step.time_at(theta);
                    worst = worst.max((x[0] - t.cos()).abs()).max((x[1] + t.sin()).abs());
                }
            }
            Verdict::Continue
        });
        cost.push(arrival.steps as f64);
        errors.push(worst);
    }
    let order = order(&cost, &errors);
    assert!(order > 4.5 && order < 5.5, "local order {order} (5 expected), {errors:?}");
}

#[test]
fn crossings_are_located_to_the_accuracy_of_the_trajectory() {
    let integrator = Integrator::new(&OSCILLATOR, &[], Tolerance::uniform(1e-12, 2));
    let sections = [
        Section { value: &|_, x| x[0], direction: Direction::Either },
        Section { value: &|t, x| x[1] - 0.5 + 0.0 * t, direction: Direction::Falling },
    ];
    let mut times = [vec![], vec![]];
    integrator.trajectory(&[1.0, 0.0], [0.0, 4.0 * PI], &sections, &mut |passage| {
        if let Passage::Crossing(crossing) = passage {
            times[crossing.section].push(crossing.time);
            // x = cos t, falling through zero at π/2.
            assert!(crossing.section == 1 || crossing.rising == ((crossing.time / PI) as usize % 2 == 1));
        }
        Verdict::Continue
    });
    // y = -sin t falls through 1/2 at 11π/6.
    let exact = [vec![0.5, 1.5, 2.5, 3.5], vec![11.0 / 6.0, 23.0 / 6.0]];
    for (found, exact) in times.iter().zip(&exact) {
        assert_eq!(found.len(), exact.len());
        for (t, e) in found.iter().zip(exact) {
            assert!((t - e * PI).abs() < 1e-10, "{t} against {}", e * PI);
        }
    }
}

#[test]
fn both_sides_of_a_near_tangency_are_found_wherever_it_falls_in_a_step() {
    // x = sin(t + φ) - (1 - δ) is positive for 2 acos(1 - δ) = 2.8e-3 only, a hundredth of a step.
    let delta = 1e-6;
    let integrator = Integrator::new(&OSCILLATOR, &[], Tolerance::uniform(1e-14, 2));
    let above = |_: f64, x: &[f64]| x[0] - (1.0 - delta);
    let missed = |_: f64, x: &[f64]| x[0] - (1.0 + 1e-9);
    let sections = [
        Section { value: &above, direction: Direction::Either },
        Section { value: &missed, direction: Direction::Either },
    ];
    for phase in 0..40 {
        let start = -0.8 + 0.005 * phase as f64;
        let mut times = vec![];
        integrator.trajectory(&[start.sin(), start.cos()], [0.0, 3.0], &sections, &mut |passage| {
            if let Passage::Crossing(crossing) = passage {
                assert_eq!(crossing.section, 0, "the circle stays inside");
                times.push(crossing.time + start - 0.5 * PI);
            }
            Verdict::Continue
        });
        let half = (1.0 - delta).acos();
        assert_eq!(times.len(), 2, "phase {start}");
        // An error e of the state moves the crossing by e / sin(half) = 700 e.
        assert!((times[0] + half).abs() < 1e-10 && (times[1] - half).abs() < 1e-10, "{times:?} against ±{half}");
    }
}

#[test]
fn a_trajectory_stops_at_a_crossing_and_runs_backwards() {
    let integrator = Integrator::new(&OSCILLATOR, &[], Tolerance::uniform(1e-12, 2));
    let sections = [Section { value: &|_, x| x[0], direction: Direction::Falling }];
    let arrival = integrator.trajectory(&[1.0, 0.0], [0.0, 100.0], &sections, &mut |passage| match passage {
        Passage::Crossing(_) => Verdict::Stop,
        Passage::Step(_) => Verdict::Continue,
    });
    assert_eq!(arrival.outcome, Outcome::Stopped);
    assert!((arrival.time - 0.5 * PI).abs() < 1e-10 && (arrival.state[1] + 1.0).abs() < 1e-10);
    let back = integrator.state_after(&arrival.state, [arrival.time, 0.0]).unwrap();
    assert!((back[0] - 1.0).abs() < 1e-10 && back[1].abs() < 1e-10);
}

#[test]
fn trajectories_that_cannot_continue_report_the_reason() {
    let run = |field: &Native, start: f64, limit: usize| {
        let integrator = Integrator::new(field, &[], Tolerance::uniform(1e-8, 1)).with_step_limit(limit);
        integrator.trajectory(&[start], [0.0, 1e4], &[], &mut |_| Verdict::Continue)
    };
    // x = 1 / (1 - t) is unbounded at t = 1.
    let blow_up = run(&Native { dim: 1, f: |x, _, f| f[0] = x[0] * x[0] }, 1.0, 100_000);
    assert_eq!(blow_up.outcome, Outcome::Escaped);
    assert!((blow_up.time - 1.0).abs() < 1e-6);
    // √(1 - x) is not defined beyond x = 1, which is reached with finite speed here.
    let undefined = run(&Native { dim: 1, f: |x, _, f| f[0] = 1.0 + (1.0 - x[0]).sqrt() }, 0.0, 100_000);
    assert_eq!(undefined.outcome, Outcome::Undefined);
    assert!((undefined.state[0] - 1.0).abs() < 1e-6);
    assert_eq!(run(&Native { dim: 1, f: |_, _, f| f[0] = f64::NAN }, 0.0, 100).outcome, Outcome::Undefined);
    assert_eq!(run(&Native { dim: 1, f: |x, _, f| f[0] = -x[0] }, 1.0, 10).outcome, Outcome::StepLimit);
    // A step of the right length would underflow.
    assert_eq!(run(&Native { dim: 1, f: |x, _, f| f[0] = 1e305 * x[0] }, 1.0, 1000).outcome, Outcome::StepTooSmall);
    // Constant solutions take few steps.
    let rest = run(&Native { dim: 1, f: |_, _, f| f[0] = 0.0 }, 1.0, 100_000);
    assert_eq!((rest.outcome, rest.state[0]), (Outcome::Reached, 1.0));
    assert!(rest.steps < 20);
}

#[test]
fn a_trajectory_does_not_depend_on_the_other_lanes() {
    let starts: Vec<f64> = (0..14).map(|k| ((k * 37 + 11) % 17) as f64 * 0.4 - 3.0).collect();
    let tolerance = Tolerance::uniform(1e-7, 2);
    let run = |starts: &[f64]| {
        Ensemble::new(&VAN_DER_POL, &[], tolerance.clone(), starts, [0.0, 20.0]).run(&mut |step| {
            // Some lanes end early, so the batch shrinks while others run.
            let leaves = step.end(0) > 2.0 && step.end_time() > 15.0;
            if leaves { Verdict::Stop } else { Verdict::Continue }
        })
    };
    let together = run(&starts);
    for (k, start) in starts.chunks(2).enumerate() {
        assert_eq!(run(start), together[k..k + 1], "lane {k}");
    }
    assert!(
        together.iter().any(|a| a.outcome == Outcome::Stopped)
            && together.iter().any(|a| a.outcome == Outcome::Reached)
    );
}

/// x' = cos 2πτ with τ in periods; the solution from 0 is sin(2πτ)/2π.
#[test]
fn a_clock_state_gives_a_forced_field_its_time() {
    use crate::model::{Definition, Forcing, Model, ModelSource, State};
    let model = Model::compile(ModelSource {
        name: "forced".into(),
        forcing: Some(Forcing { is_frequency: false, expression: "1".into() }),
        states: vec![State::new("x")],
        equations: vec![Definition::new("x", "cos(2*pi*t)")],
        ..ModelSource::default()
    })
    .unwrap();
    let field = Clocked(&model);
    let integrator = Integrator::new(&field, &[], Tolerance::uniform(1e-10, 2));
    for end in [0.3, 1.0, 2.7] {
        let state = integrator.state_after(&[0.0, 0.0], [0.0, end]).unwrap();
        assert!((state[0] - (2.0 * PI * end).sin() / (2.0 * PI)).abs() < 1e-8, "{state:?}");
        assert!((state[1] - end).abs() < 1e-14);
    }
}
