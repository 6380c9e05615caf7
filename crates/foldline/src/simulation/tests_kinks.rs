//! Piecewise-smooth fields with known answers.

use super::*;
use crate::contract::{Batch, VectorField, Verdict};
use crate::model::{Definition, Model, ModelSource, State};

fn model(equations: &[(&str, &str)]) -> Model {
    let source = ModelSource {
        states: equations.iter().map(|(name, _)| State::new(name)).collect(),
        equations: equations.iter().map(|(name, text)| Definition::new(name, text)).collect(),
        ..ModelSource::default()
    };
    Model::compile(source).unwrap()
}

/// A model whose switches are hidden.
struct Plain<'a>(&'a Model);

impl VectorField for Plain<'_> {
    fn dim(&self) -> usize {
        self.0.dim()
    }

    fn parameter_count(&self) -> usize {
        self.0.parameter_count()
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        self.0.evaluate(at, f);
    }

    fn linearise(&self, _: Batch, _: &[usize], _: &mut [f64], _: &mut [f64], _: &mut [f64]) {
        unreachable!("integration needs f only")
    }

    fn directional(&self, _: Batch, _: &[&[f64]], _: &mut [f64]) {
        unreachable!("integration needs f only")
    }
}

/// x'' + x + 9 max(x - a, 0) = 0 as two harmonic motions: the state after `time`, from x = 0, x' = 1. Outside contact
/// the motion is an arc of radius 1; contact lasts from entry to its mirror image, with frequency ω = √10 about the
/// centre 0.9 a.
fn bouncer(a: f64, time: f64) -> [f64; 2] {
    let (mut t, mut x, mut v, mut outside): (f64, f64, f64, bool) = (0.0, 0.0, 1.0, true);
    loop {
        let (omega, centre) = if outside { (1.0, 0.0) } else { (10f64.sqrt(), 0.9 * a) };
        let (radius, phase) = ((x - centre).hypot(v / omega), (x - centre).atan2(v / omega));
        // x = centre + radius sin(ω τ + phase) meets a at ω τ + phase = asin, rising, or π - asin, falling.
        let angle = ((a - centre) / radius).min(1.0).asin();
        let goal = if outside { angle } else { std::f64::consts::PI - angle };
        let wait = (goal - phase).rem_euclid(std::f64::consts::TAU) / omega;
        let misses = outside && a > radius;
        if misses || t + wait >= time {
            let s = omega * (time - t) + phase;
            return [centre + radius * s.sin(), radius * omega * s.cos()];
        }
        (t, x, v, outside) = (t + wait, a, radius * omega * goal.cos(), !outside);
    }
}

fn error(field: &dyn VectorField, a: f64, tolerance: f64) -> (f64, usize) {
    let integrator = Integrator::new(field, &[], Tolerance::uniform(tolerance, 2));
    let arrival = integrator.trajectory(&[0.0, 1.0], [0.0, 40.0], &[], &mut |_| Verdict::Continue);
    assert_eq!(arrival.outcome, Outcome::Reached);
    let exact = bouncer(a, 40.0);
    ((arrival.state[0] - exact[0]).hypot(arrival.state[1] - exact[1]), arrival.steps + arrival.rejected)
}

#[test]
fn a_kink_costs_neither_accuracy_nor_many_steps() {
    let bouncing = model(&[("x", "v"), ("v", "-x - 9*max(x - 0.6, 0)")]);
    for tolerance in [1e-5, 1e-7, 1e-9, 1e-11] {
        let (located, steps) = error(&bouncing, 0.6, tolerance);
        let (plain, plain_steps) = error(&Plain(&bouncing), 0.6, tolerance);
        // Errors of a few hundred steps add up, as do the resulting phase errors over seven periods.
        assert!(located < 300.0 * tolerance, "{located} at {tolerance}");
        assert!(plain_steps > steps, "{plain_steps} against {steps} steps");
        // The error of a step across a kink is of second order in its length only.
        assert!(tolerance > 1e-6 || plain > 4.0 * located, "{plain} against {located} at {tolerance}");
    }
}

#[test]
fn grazing_is_neither_missed_nor_invented() {
    // The first arc has amplitude 1: contact slightly below it lasts 2 acos(a), a small part of a step.
    for depth in [1e-3, 1e-5, 1e-7, -1e-7] {
        let a = 1.0 - depth;
        let grazing = model(&[("x", "v"), ("v", &format!("-x - 9*max(x - {a}, 0)"))]);
        let mut worst: f64 = 0.0;
        for tolerance in [1e-8, 1e-10] {
            worst = worst.max(error(&grazing, a, tolerance).0 / tolerance);
        }
        // Near tangency an error e of the state changes the duration of contact, 2 √(2 depth), by e / √(2 depth). The
        // impulse is proportional to depth^1.5 and changes only by 9 · 2 √(2 depth) e.
        assert!(worst < 100.0, "{worst} at depth {depth}");
    }
}

#[test]
fn a_discontinuous_field_is_integrated_to_rounding() {
    // x'' = -sign(x): arcs x = v τ - τ²/2 of duration 2 v; the motion from x = 0, v = 1 has the period 4.
    let jumping = model(&[("x", "v"), ("v", "-sign(x)")]);
    let integrator = Integrator::new(&jumping, &[], Tolerance::uniform(1e-8, 2));
    let arrival = integrator.trajectory(&[0.0, 1.0], [0.0, 401.0], &[], &mut |_| Verdict::Continue);
    assert_eq!(arrival.outcome, Outcome::Reached);
    // The arcs are polynomials of degree two, which the method integrates exactly up to rounding.
    assert!((arrival.state[0] - 0.5).abs() < 1e-10 && arrival.state[1].abs() < 1e-10, "{:?}", arrival.state);
    assert!(arrival.steps < 2000, "{}", arrival.steps);
}

#[test]
fn a_trajectory_slides_along_a_surface_and_leaves_it() {
    // It slides until y = 5, from where x' = (y - 5)/5 on the side x > 0. Backwards it leaves where it arrived.
    let sliding = model(&[("x", "y/5 - sign(x)"), ("y", "1")]);
    let integrator = Integrator::new(&sliding, &[], Tolerance::uniform(1e-8, 2));
    let mut slid = 0.0;
    let arrival = integrator.trajectory(&[1.0, 0.0], [0.0, 10.0], &[], &mut |passage| {
        if let Passage::Step(step) = passage
            && step.start(0) == 0.0
            && step.end(0) == 0.0
        {
            slid += step.end_time() - step.start_time();
        }
        Verdict::Continue
    });
    assert_eq!(arrival.outcome, Outcome::Reached);
    assert!((arrival.state[0] - 2.5).abs() < 1e-9, "{:?}", arrival.state);
    // x = 1 - t + t²/10 vanishes at 5 - √15.
    assert!((slid - 15f64.sqrt()).abs() < 1e-9, "{slid}");
}

#[test]
fn sliding_along_two_surfaces_is_reported() {
    let sliding = model(&[("x", "-sign(x)"), ("y", "-sign(y)")]);
    let integrator = Integrator::new(&sliding, &[], Tolerance::uniform(1e-8, 2));
    let arrival = integrator.trajectory(&[1.0, 0.5], [0.0, 10.0], &[], &mut |_| Verdict::Continue);
    assert_eq!(arrival.outcome, Outcome::StepTooSmall);
    assert!((arrival.time - 1.0).abs() < 1e-12, "{}", arrival.time);
}

#[test]
fn every_lane_has_its_own_parameters_and_kinks() {
    let source = ModelSource {
        parameters: vec![crate::model::Parameter::new("a", 0.6)],
        states: ["x", "v"].map(State::new).to_vec(),
        equations: vec![Definition::new("x", "v"), Definition::new("v", "-x - 9*max(x - a, 0)")],
        ..ModelSource::default()
    };
    let model = Model::compile(source).unwrap();
    let gaps: Vec<f64> = (0..20).map(|k| 0.03 + 0.049 * k as f64).collect();
    let starts = [0.0, 1.0].repeat(gaps.len());
    let tolerance = Tolerance::uniform(1e-9, 2);
    let together = Ensemble::with_own_parameters(&model, &gaps, tolerance.clone(), &starts, [0.0, 30.0]).arrive();
    for (arrival, a) in together.iter().zip(&gaps) {
        let alone = Ensemble::new(&model, &[*a], tolerance.clone(), &[0.0, 1.0], [0.0, 30.0]).arrive();
        assert_eq!(*arrival, alone[0], "a = {a}");
        let exact = bouncer(*a, 30.0);
        assert!((arrival.state[0] - exact[0]).abs() < 1e-7, "a = {a}: {} {}", arrival.state[0], exact[0]);
    }
}

/// x'' + x + F(x - 0.5) = 0 with a contact force F that is a root of the penetration δ: the energy x'²/2 + x²/2 + ∫ F
/// dδ is conserved. Without contact the amplitude would be 1.
#[test]
fn a_contact_force_defined_on_one_side_only_conserves_energy() {
    for (force, exponent) in [
        ("max(x - 0.5, 0)^1.5", 1.5),
        ("if(x > 0.5, (x - 0.5)^1.5, 0)", 1.5),
        ("if(x > 0.5, sqrt(x - 0.5), 0)", 0.5),
        ("if(x < 0.5, 0, (x - 0.5)^2.3)", 2.3),
    ] {
        let contact = model(&[("x", "v"), ("v", &format!("-x - {force}"))]);
        let energy =
            |x: f64, v: f64| 0.5 * (x * x + v * v) + (x - 0.5).max(0.0).powf(exponent + 1.0) / (exponent + 1.0);
        let starts = [0.0, 1.0].repeat(9);
        let tolerance = Tolerance::uniform(1e-9, 2);
        let (mut steps, mut deepest, mut off) = (0, 0.0f64, 0.0f64);
        let arrivals = Ensemble::new(&contact, &[], tolerance.clone(), &starts, [0.0, 40.0]).run(&mut |step| {
            deepest = deepest.max(step.end(0) - 0.5);
            off = off.max((energy(step.end(0), step.end(1)) - 0.5).abs());
            steps += usize::from(step.trajectory() == 0);
            Verdict::Continue
        });
        let alone = Integrator::new(&contact, &[], tolerance);
        let alone = alone.trajectory(&[0.0, 1.0], [0.0, 40.0], &[], &mut |_| Verdict::Continue);
        assert!(arrivals.iter().all(|arrival| *arrival == alone), "{force}: lanes differ");
        assert_eq!(alone.outcome, Outcome::Reached, "{force}");
        assert!(deepest > 0.3, "{force}: no contact");
        // Errors of some hundred steps add up; for a power below 1 the steps next to contact have a lower order.
        assert!(off < 1e-6 && steps < 5000, "{force}: {off} after {steps} steps, {} rejected", alone.rejected);
    }
}

/// x'' = -√x passes x = 0 at nonzero speed: there f ceases to be defined, with or without a distant switch around it.
#[test]
fn a_trajectory_that_leaves_the_domain_of_the_field_is_reported() {
    for force in ["sqrt(x)", "if(x > -1, sqrt(x), 0)"] {
        let falling = model(&[("x", "v"), ("v", &format!("-{force}"))]);
        let integrator = Integrator::new(&falling, &[], Tolerance::uniform(1e-9, 2));
        let arrival = integrator.trajectory(&[1.0, 0.0], [0.0, 40.0], &[], &mut |_| Verdict::Continue);
        assert_eq!(arrival.outcome, Outcome::Undefined, "{force}");
        // v²/2 = 2/3 (1 - x^1.5).
        assert!(
            arrival.state[0].abs() < 1e-6 && (arrival.state[1] + (4.0f64 / 3.0).sqrt()).abs() < 1e-6,
            "{arrival:?}"
        );
    }
}
