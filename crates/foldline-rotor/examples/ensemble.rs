//! Speed of integration of many trajectories of the overhung rotor, compared with a plain loop over the trajectories:
//! `cargo run --release -p foldline-rotor --example ensemble -- SAMPLES TIME TOLERANCE [KAPPA]`
//!
//! Prints three cases: the ensemble with the text model, the ensemble with the field written in Rust, and the plain
//! loop with a right-hand side written by hand with all constants precomputed. Each row gives the best of several runs
//! in seconds on one thread, the number of steps of all trajectories, accepted and rejected, and the median over the
//! trajectories of the largest error at the end. All use one method, step control, tolerance, set of starts and
//! parameters (those of models/overhung-rotor.toml with kappa = 1). The last row is the limit for any such program on
//! this machine: as many steps of fixed length with eight trajectories in lanes, without step control, end condition or
//! observer.

use foldline::attractors::Sampling;
use foldline::contract::VectorField;
use foldline::linalg::lane::{Eight, Lane as _};
use foldline::simulation::{Ensemble, Outcome, Tolerance};
use foldline_rotor::{Constants, Nondimensional, OverhungRotor};
use foldline_store::model_file::read_model;
use std::path::Path;
use std::time::Instant;

const RUNS: usize = 5;

fn main() -> Result<(), String> {
    let typed: Vec<f64> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let [samples, time, tolerance, kappa] = match typed[..] {
        [samples, time, tolerance] => [samples, time, tolerance, 1.0],
        [samples, time, tolerance, kappa] => [samples, time, tolerance, kappa],
        _ => return Err("needs SAMPLES TIME TOLERANCE [KAPPA]".into()),
    };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/overhung-rotor.toml");
    let (model, _) = read_model(&path).map_err(|found| found[0].to_string())?;
    let p = Nondimensional { omega: 5.0, kappa, ..Nondimensional::REFERENCE };
    let starts = starts(samples as usize);
    let exact = ensemble(&model, &p, &starts, time, 1e-4 * tolerance);
    let mut steps = 0;
    let rotor = OverhungRotor::default();
    let programs: [(&str, &dyn VectorField, Run); 3] =
        [("text", &model, &ensemble), ("rust", &rotor, &ensemble), ("scalar", &rotor, &scalar)];
    for (name, field, run) in programs {
        let mut best = f64::INFINITY;
        let mut found = (Vec::new(), 0);
        for _ in 0..RUNS {
            let clock = Instant::now();
            found = run(field, &p, &starts, time, tolerance);
            best = best.min(clock.elapsed().as_secs_f64());
        }
        println!("{name} {best:.6} {} {:.1e}", found.1, median_error(&found.0, &exact.0));
        steps = found.1;
    }
    let times = (0..RUNS).map(|_| {
        let clock = Instant::now();
        let taken = lanes(&p, &starts, steps / samples as usize, time * samples / steps as f64, tolerance);
        clock.elapsed().as_secs_f64() / taken as f64
    });
    println!("lanes {:.6} {steps} nan", times.fold(f64::INFINITY, f64::min) * steps as f64);
    Ok(())
}

/// Final states and the total number of steps.
type Run<'a> = &'a dyn Fn(&dyn VectorField, &Nondimensional, &[f64], f64, f64) -> (Vec<[f64; 4]>, usize);

fn starts(samples: usize) -> Vec<f64> {
    let ranges = vec![[-5.0, 5.0], [-5.0, 5.0], [-15.0, 15.0], [-15.0, 15.0]];
    let scales = vec![1.0; 4];
    Sampling {
        ranges,
        scales,
        whirl: None,
        samples,
        seed: 1,
        jobs: 1,
        tolerance: 1e-6,
        limits: Default::default(),
        given: None,
    }
    .starts()
}

fn ensemble(
    field: &dyn VectorField,
    p: &Nondimensional,
    starts: &[f64],
    time: f64,
    tolerance: f64,
) -> (Vec<[f64; 4]>, usize) {
    let parameters = p.parameters();
    let tolerance = Tolerance::uniform(tolerance, 4);
    let arrivals = Ensemble::new(field, &parameters, tolerance, starts, [0.0, time]).arrive();
    let steps = arrivals.iter().map(|arrival| arrival.steps + arrival.rejected).sum();
    let ends = arrivals.iter().filter(|arrival| arrival.outcome == Outcome::Reached);
    (ends.map(|arrival| std::array::from_fn(|i| arrival.state[i])).collect(), steps)
}

/// f of one state.
#[inline(always)]
fn slope(p: &Constants, [u, v, du, dv]: [f64; 4]) -> [f64; 4] {
    let square = u * u + v * v;
    let r = square.sqrt();
    let contact = p.ring * ((p.sharpness * (r - 1.0)).tanh() + 1.0) * (1.0 - 1.0 / r);
    let stiffness = p.linear + p.cubic * square + contact;
    [
        du,
        dv,
        p.forcing + p.gyroscopic * dv - p.damping * du - stiffness * u + p.circulatory * v,
        -p.gyroscopic * du - p.damping * dv - stiffness * v - p.circulatory * u,
    ]
}

/// x + h Σ a k.
#[inline(always)]
fn at<const N: usize>(x: &[f64; 4], h: f64, terms: [(f64, &[f64; 4]); N]) -> [f64; 4] {
    std::array::from_fn(|i| x[i] + h * terms.iter().map(|(a, k)| a * k[i]).sum::<f64>())
}

/// Dormand–Prince pair 5(4) (hairer1993, §II.5) with the step control of the ensemble, one trajectory after the other.
fn scalar(
    _: &dyn VectorField,
    p: &Nondimensional,
    starts: &[f64],
    time: f64,
    tolerance: f64,
) -> (Vec<[f64; 4]>, usize) {
    let constants = Constants::of(p);
    let mut steps = 0;
    let ends = starts.chunks_exact(4).map(|start| {
        let (end, own) = integrate(&constants, [start[0], start[1], start[2], start[3]], time, tolerance);
        steps += own;
        end
    });
    (ends.collect(), steps)
}

fn integrate(p: &Constants, start: [f64; 4], end: f64, tolerance: f64) -> ([f64; 4], usize) {
    const BETA: f64 = 0.04;
    const ALPHA: f64 = 0.2 - 0.75 * BETA;
    let norm = |x: &[f64; 4], y: &[f64; 4], e: &[f64; 4]| -> f64 {
        let square = |i: usize| (e[i] / (tolerance + tolerance * x[i].abs().max(y[i].abs()))).powi(2);
        (0.25 * (square(0) + square(1) + square(2) + square(3))).sqrt()
    };
    let (mut x, mut t, mut k1) = (start, 0.0, slope(p, start));
    let mut h: f64 = 0.01 * norm(&x, &x, &x) / norm(&x, &x, &k1);
    let k2 = slope(p, at(&x, h, [(1.0, &k1)]));
    let curvature = norm(&x, &x, &std::array::from_fn(|i| (k2[i] - k1[i]) / h)).max(norm(&x, &x, &k1));
    h = (0.01 / curvature).powf(0.2).min(100.0 * h).min(end);
    let (mut before, mut rejected, mut steps): (f64, bool, usize) = (1e-4, false, 0);
    while t < end {
        steps += 1;
        let k2 = slope(p, at(&x, h, [(1.0 / 5.0, &k1)]));
        let k3 = slope(p, at(&x, h, [(3.0 / 40.0, &k1), (9.0 / 40.0, &k2)]));
        let k4 = slope(p, at(&x, h, [(44.0 / 45.0, &k1), (-56.0 / 15.0, &k2), (32.0 / 9.0, &k3)]));
        let row = [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0];
        let k5 = slope(p, at(&x, h, [(row[0], &k1), (row[1], &k2), (row[2], &k3), (row[3], &k4)]));
        let row = [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0];
        let k6 = slope(p, at(&x, h, [(row[0], &k1), (row[1], &k2), (row[2], &k3), (row[3], &k4), (row[4], &k5)]));
        let row = [35.0 / 384.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0];
        let next = at(&x, h, [(row[0], &k1), (row[1], &k3), (row[2], &k4), (row[3], &k5), (row[4], &k6)]);
        let k7 = slope(p, next);
        let row = [71.0 / 57600.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];
        let e = at(
            &[0.0; 4],
            h,
            [(row[0], &k1), (row[1], &k3), (row[2], &k4), (row[3], &k5), (row[4], &k6), (row[5], &k7)],
        );
        let error = norm(&x, &next, &e);
        if error > 1.0 {
            h *= (0.9 * error.powf(-ALPHA)).clamp(0.2, 1.0);
            rejected = true;
            continue;
        }
        let last = t + h >= end;
        (t, x, k1) = (if last { end } else { t + h }, next, k7);
        let growth = 0.9 * error.max(1e-10).powf(-ALPHA) * before.powf(BETA);
        h *= growth.clamp(0.2, if rejected { 1.0 } else { 10.0 });
        (before, rejected) = (error.max(1e-4), false);
        if 1.01 * h >= end - t {
            h = end - t;
        }
    }
    (x, steps)
}

/// Takes `steps` steps of length h from each start, eight trajectories side by side; returns the total number of steps.
fn lanes(p: &Nondimensional, starts: &[f64], steps: usize, h: f64, tolerance: f64) -> usize {
    let constants = Constants::of(p);
    let groups = starts.chunks_exact(4 * Eight::COUNT);
    let count = groups.len() * Eight::COUNT * steps;
    for start in groups {
        let x = std::array::from_fn(|i| Eight::each(|lane| start[lane * 4 + i]));
        std::hint::black_box(Eight::dispatch(Trial { constants: &constants, x, steps, h, tolerance }));
    }
    count
}

/// Four numbers for each of eight trajectories.
type Lanes = [Eight; 4];

struct Trial<'c> {
    constants: &'c Constants,
    x: Lanes,
    steps: usize,
    h: f64,
    tolerance: f64,
}

impl pulp::NullaryFnOnce for Trial<'_> {
    type Output = Eight;

    #[inline(always)]
    fn call(self) -> Eight {
        let Trial { constants: p, mut x, steps, h, tolerance } = self;
        let (h, tolerance) = (Eight::splat(h), Eight::splat(tolerance));
        let mut k1 = p.slopes(x);
        let mut largest = Eight::default();
        for _ in 0..steps {
            let k2 = p.slopes(ahead(&x, h, [(1.0 / 5.0, &k1)]));
            let k3 = p.slopes(ahead(&x, h, [(3.0 / 40.0, &k1), (9.0 / 40.0, &k2)]));
            let k4 = p.slopes(ahead(&x, h, [(44.0 / 45.0, &k1), (-56.0 / 15.0, &k2), (32.0 / 9.0, &k3)]));
            let row = [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0];
            let k5 = p.slopes(ahead(&x, h, [(row[0], &k1), (row[1], &k2), (row[2], &k3), (row[3], &k4)]));
            let row = [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0];
            let k6 =
                p.slopes(ahead(&x, h, [(row[0], &k1), (row[1], &k2), (row[2], &k3), (row[3], &k4), (row[4], &k5)]));
            let row = [35.0 / 384.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0];
            let next = ahead(&x, h, [(row[0], &k1), (row[1], &k3), (row[2], &k4), (row[3], &k5), (row[4], &k6)]);
            let k7 = p.slopes(next);
            let row = [71.0 / 57600.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];
            let terms = [(row[0], &k1), (row[1], &k3), (row[2], &k4), (row[3], &k5), (row[4], &k6), (row[5], &k7)];
            let error = ahead(&[Eight::default(); 4], h, terms);
            let mut squares = Eight::default();
            for i in 0..4 {
                let scale = tolerance + tolerance * x[i].zip(next[i], |a, b| a.abs().max(b.abs()));
                let share = error[i].zip(scale, |error, scale| error / scale);
                squares = squares + share * share;
            }
            largest = largest.zip(squares, f64::max);
            (x, k1) = (next, k7);
        }
        largest
    }
}

/// x + h Σ a k. Here and below, operations on whole lanes and plain loops: a function of its own, such as the `map` of
/// an array, would be compiled without vector instructions.
#[inline(always)]
fn ahead<const N: usize>(x: &Lanes, h: Eight, terms: [(f64, &Lanes); N]) -> Lanes {
    let mut out = *x;
    for i in 0..4 {
        let mut sum = Eight::splat(terms[0].0) * terms[0].1[i];
        for (a, k) in &terms[1..] {
            sum = sum + Eight::splat(*a) * k[i];
        }
        out[i] = x[i] + h * sum;
    }
    out
}

/// Median over the trajectories of the largest error.
fn median_error(found: &[[f64; 4]], exact: &[[f64; 4]]) -> f64 {
    let error = |(a, b): (&[f64; 4], &[f64; 4])| (0..4).fold(0.0, |m: f64, i| m.max((a[i] - b[i]).abs()));
    let mut errors: Vec<f64> = found.iter().zip(exact).map(error).collect();
    errors.sort_by(f64::total_cmp);
    errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN)
}
