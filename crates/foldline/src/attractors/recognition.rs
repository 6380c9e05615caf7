//! Quasi-periodic motion, locked cycles and chaos, distinguished by means of one trajectory.
//!
//! **Idea.** A trajectory that neither comes to rest nor repeats itself is observed at equal intervals: the forcing
//! period or, without forcing, the period of its strongest spectral line. From N such states follow the rotation number
//! with its error, the closed curve on which they lie, and the largest Lyapunov exponent with its error. If these do not
//! decide, the trajectory goes on for twice as many intervals.
//!
//! **Equations.** In order, with states relative to their extents, the exponent λ ± ε per interval other than that along
//! the motion, and the rotation number ρ ± δ, the difference between both halves of the
//! record, and at least the distance of the states from the curve over N:
//!
//! ```text
//!   (1)  cycle of q intervals:  |x_{j+q} - x_j| ≤ 1e-6 and |x_{j+mq} - x_j| ≤ 1e-6 for all j and m,  λ + ε < 0
//!   (2)  chaos:                 λ > 3 ε  and  λ N > 10
//!   (3)  torus:                 distance of every x_j from the curve ≤ 2e-3,  δ ≤ 1e-6,
//!                               |ρ - p/q| > 10 δ for all q ≤ N/8,
//!                               amplitude of the first harmonic equal in both halves to 1e-4,
//!                               |λ| ≤ 3 ε or |λ| N ≤ 1/2
//! ```
//!
//! A motion that locks to p/q has ρ = p/q exactly, and so fails (3) whatever else it does. λ is the mean of weighted
//! averages over the last seven of eight parts of the record, and ε is three times the standard error of this mean. δ
//! is at least ten times the accuracy of the integration.
//!
//! **Source.** das2017 (weighted averages), laskar1999 (frequencies), benettin1980 (exponents).
//!
//! **Departures.** ρ is the frequency of the line whose harmonics describe all states, so that no angle around a centre
//! has to be chosen. It is determined up to its sign and whole numbers, and is given between 0 and 1/2.
//!
//! **Fails when** more than two frequencies are present, a locked motion has more than N/8 intervals per period, or a
//! cycle attracts by less than 1e-4 over a record. Transient chaos that lasts longer than the record counts as chaos.

use super::birkhoff::{Curve, Samples, average};
use super::settling::{Trial, lost};
use super::variation::Varied;
use crate::contract::{Batch, Parameters, VectorField, Verdict};
use crate::diagram::{Motion, Recognition};
use crate::simulation::{Clocked, Ensemble, Tolerance};
use std::f64::consts::TAU;

/// Relative accuracy of the integration.
const ACCURACY: f64 = 1e-10;
/// Number of intervals of the first record, and of the last one.
const RECORDS: [usize; 2] = [1000, 8000];
/// Distance at which states repeat, of (1).
const REPEATS: f64 = 1e-6;
/// Largest distance of a state from the curve, of (3).
const NEAR: f64 = 2e-3;
/// Distance from the curve at which no more harmonics are added.
const ENOUGH: f64 = 1e-9;
/// Largest error of a rotation number, of (3).
const KNOWN: f64 = 1e-6;
/// Largest change of the amplitude, of (3).
const STEADY: f64 = 1e-4;
/// Error of a line from which the frequency is corrected by the whole curve, and distance from the curve up to which.
const SHARP: f64 = 1e-9;
const ROUGH: f64 = 0.1;
/// Number of harmonics of the curve.
const HARMONICS: usize = 100;
/// Largest number of intervals after which a torus may close, as after its doubling.
const TURNS: usize = 4;
/// Number of parts over which the exponent is averaged.
const PARTS: usize = 8;

/// Type of a motion.
#[derive(Clone, Debug)]
pub(super) enum Nature {
    /// A cycle of that period.
    Cycle(f64),
    /// A torus that closes after `turns` intervals of length `interval`.
    Torus(Quasi),
    Chaos,
    Undecided,
    /// The trajectory could not be continued: it escaped or ended in chatter.
    Lost(Motion),
}

/// A quasi-periodic motion.
#[derive(Clone, Debug)]
pub(super) struct Quasi {
    pub(super) turns: usize,
    /// Time between two states of the section, in the unit of the field.
    pub(super) interval: f64,
    /// The section, in states divided by `extent`.
    pub(super) curve: Curve,
    pub(super) extent: Vec<f64>,
}

/// Type of the motion of a trajectory, with the evidence.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) nature: Nature,
    pub(super) evidence: Recognition,
    /// Last state, in the states of the trial.
    pub(super) state: Vec<f64>,
}

/// States at equal intervals, and the logarithm of the growth of a perturbation until then, if it is known.
struct Record {
    /// `[count][n]`.
    states: Vec<f64>,
    growth: Vec<f64>,
    steps: usize,
    /// Type of motion if the trajectory could not be continued.
    lost: Option<Motion>,
}

/// Observes a trajectory of the trial from a state on; each record takes at most the steps of the limit. `brief` keeps to the
/// shortest record.
pub(super) fn recognise(trial: &Trial, parameters: &[f64], state: &[f64], brief: bool) -> Found {
    let undecided = |reason: &str| Found {
        nature: Nature::Undecided,
        evidence: Recognition { reason: reason.into(), ..Recognition::default() },
        state: state.to_vec(),
    };
    let limits = trial.limits_at(parameters);
    let own = trial.field.unclocked();
    let field = own.unwrap_or(trial.field);
    let n = field.dim();
    let watch = Watch { field, parameters, scales: &trial.scales[..n] };
    let Some((mut state, interval)) = watch.begun(state, own.is_some(), limits.steps) else {
        return undecided("the limit on steps or time was reached before an interval was found for its observation");
    };
    let mut count = RECORDS[0];
    let most = RECORDS[usize::from(!brief)];
    let mut last = None;
    while count <= most && (count as f64) * interval <= limits.time && !field.ended() {
        let Some(record) = watch.record(&state, interval, count, limits.steps) else { break };
        if record.states.len() < count * n {
            let nature = Nature::Lost(record.lost.unwrap_or(Motion::Escaped));
            let found = Found { nature, evidence: Recognition::default(), state: back(&state, own.is_some()) };
            return if record.steps >= limits.steps { last.unwrap_or(undecided(LIMIT)) } else { found };
        }
        state = record.states[(count - 1) * n..].to_vec();
        let (nature, evidence) = watch.judged(&record, interval);
        let decided = !matches!(nature, Nature::Undecided);
        last = Some(Found { nature, evidence, state: back(&state, own.is_some()) });
        if decided {
            break;
        }
        count *= 2;
    }
    last.unwrap_or(undecided(LIMIT))
}

const LIMIT: &str = "the limit on steps or time was reached";

/// The state of the trial at the beginning of a forcing period, for a state of the field.
fn back(state: &[f64], clocked: bool) -> Vec<f64> {
    if clocked { [state, &[1.0, 0.0]].concat() } else { state.to_vec() }
}

struct Watch<'a> {
    field: &'a dyn VectorField,
    parameters: &'a [f64],
    scales: &'a [f64],
}

impl Watch<'_> {
    fn n(&self) -> usize {
        self.scales.len()
    }

    /// The state of the field at which the record begins, and the interval.
    fn begun(&self, state: &[f64], clocked: bool, limit: usize) -> Option<(Vec<f64>, f64)> {
        let n = self.n();
        if self.field.iterated() {
            return Some((state[..n].to_vec(), 1.0));
        }
        if !clocked {
            return Some((state.to_vec(), self.interval(state, limit)?));
        }
        let clock = state[n + 1].atan2(state[n]) / TAU;
        let wait = (clock.ceil() - clock).rem_euclid(1.0);
        if wait < 1e-12 {
            return Some((state[..n].to_vec(), 1.0));
        }
        let start = [&state[..n], &[clock]].concat();
        let field = Clocked(self.field);
        let run = Ensemble::new(&field, self.parameters, self.tolerance(n + 1), &start, [0.0, wait]);
        let arrival = run.with_step_limit(limit).run(&mut |_| Verdict::Continue).pop()?;
        (arrival.time >= wait).then(|| (arrival.state[..n].to_vec(), 1.0))
    }

    fn tolerance(&self, dim: usize) -> Tolerance {
        let own = (0..dim).map(|i| ACCURACY * self.scales.get(i).copied().unwrap_or(1.0));
        Tolerance { relative: ACCURACY, absolute: own.collect() }
    }

    /// Period of the strongest line of an autonomous motion.
    fn interval(&self, state: &[f64], limit: usize) -> Option<f64> {
        const SAMPLES: usize = 8192;
        const FIRST: usize = 400;
        let n = self.n();
        let until = |start: &[f64], end: f64, steps: usize| {
            Ensemble::new(self.field, self.parameters, self.tolerance(n), start, [0.0, end]).with_step_limit(steps)
        };
        let first = until(state, f64::INFINITY, FIRST.min(limit)).run(&mut |_| Verdict::Continue).pop()?;
        let spacing = 2.0 * first.time / first.steps as f64;
        let mut states = Vec::with_capacity(SAMPLES * n);
        let mut x = vec![0.0; n];
        let run = until(state, f64::INFINITY, limit.saturating_sub(FIRST));
        run.run(&mut |step| {
            let next = |states: &Vec<f64>| (states.len() / n) as f64 * spacing;
            while states.len() < SAMPLES * n && next(&states) <= step.end_time() {
                step.state_into((next(&states) - step.start_time()) / (step.end_time() - step.start_time()), &mut x);
                states.extend_from_slice(&x);
            }
            if states.len() < SAMPLES * n { Verdict::Continue } else { Verdict::Stop }
        });
        if states.len() < SAMPLES * n {
            return None;
        }
        let extent = self.extent(&states);
        states.iter_mut().enumerate().for_each(|(k, x)| *x /= extent[k % n]);
        let line = *Samples { values: &states, n }.lines(1).first()?;
        (line > 0.0).then(|| spacing / line)
    }

    /// Half the range of every state, with a floor.
    fn extent(&self, states: &[f64]) -> Vec<f64> {
        let n = self.n();
        let half = |i: usize| {
            let own = states.iter().skip(i).step_by(n);
            let [low, high] = own.fold([f64::MAX, f64::MIN], |[low, high], x| [x.min(low), x.max(high)]);
            (0.5 * (high - low)).max(1e-6 * self.scales[i])
        };
        (0..n).map(half).collect()
    }

    /// States at the multiples of the interval; fewer if the trajectory ends.
    fn record(&self, state: &[f64], interval: f64, count: usize, limit: usize) -> Option<Record> {
        if self.field.iterated() {
            return (count <= limit).then(|| self.iterates(state, count));
        }
        let n = self.n();
        let smooth = self.field.switch_count() == 0;
        let (varied, clocked) = (Varied { field: self.field, scales: self.scales }, Clocked(self.field));
        let (field, start): (&dyn VectorField, Vec<f64>) = match smooth {
            true => (&varied, varied.start(state, 0.0)),
            false => (&clocked, [state, &[0.0]].concat()),
        };
        let dim = field.dim();
        let run = Ensemble::new(field, self.parameters, self.tolerance_of(dim), &start, [0.0, f64::INFINITY]);
        let (mut states, mut growth, mut x) = (Vec::with_capacity(count * n), Vec::new(), vec![0.0; dim]);
        let arrivals = run.with_step_limit(limit.max(1)).run(&mut |step| {
            let next = |states: &Vec<f64>| (states.len() / n + 1) as f64 * interval;
            while states.len() < count * n && next(&states) <= step.end_time() {
                step.state_into((next(&states) - step.start_time()) / (step.end_time() - step.start_time()), &mut x);
                states.extend_from_slice(&x[..n]);
                growth.extend(smooth.then(|| x[2 * n]));
            }
            if states.len() < count * n { Verdict::Continue } else { Verdict::Stop }
        });
        let steps = arrivals.first().map_or(0, |arrival| arrival.steps + arrival.rejected);
        let lost = arrivals.first().and_then(|arrival| lost(arrival.outcome));
        Some(Record { states, growth, steps, lost })
    }

    fn tolerance_of(&self, dim: usize) -> Tolerance {
        // A perturbation need not be known as accurately as the motion.
        const PERTURBATION: f64 = 1e-7;
        let Tolerance { relative, mut absolute } = self.tolerance(dim);
        absolute.iter_mut().skip(self.n()).for_each(|own| *own = PERTURBATION);
        Tolerance { relative, absolute }
    }

    /// Iterates of a map.
    fn iterates(&self, state: &[f64], count: usize) -> Record {
        let n = self.n();
        let (mut x, mut v) = (state.to_vec(), (0..n).map(|i| (1.0 + 0.37 * i as f64).cos()).collect::<Vec<_>>());
        let (mut states, mut growth, mut sum) = (Vec::with_capacity(count * n), Vec::new(), 0.0);
        let (mut next, mut fx) = (vec![0.0; n], vec![0.0; n * n]);
        for _ in 0..count {
            let parameters = Parameters::Shared(self.parameters);
            let at = Batch { lanes: 1, states: &x, parameters, times: &[], signs: &[] };
            self.field.linearise(at, &[], &mut next, &mut fx, &mut []);
            let row = |i: usize| -> f64 {
                (0..n).map(|j| fx[i * n + j] * v[j] * self.scales[j]).sum::<f64>() / self.scales[i]
            };
            let moved: Vec<f64> = (0..n).map(row).collect();
            let norm = moved.iter().map(|v| v * v).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
            v = moved.iter().map(|v| v / norm).collect();
            sum += norm.ln();
            if !next.iter().all(|x| x.is_finite()) {
                break;
            }
            x.clone_from(&next);
            states.extend_from_slice(&x);
            growth.push(sum);
        }
        Record { states, growth, steps: count, lost: None }
    }

    /// Applies the criteria to a record.
    fn judged(&self, record: &Record, interval: f64) -> (Nature, Recognition) {
        let n = self.n();
        let extent = self.extent(&record.states);
        let scaled: Vec<f64> = record.states.iter().enumerate().map(|(k, x)| x / extent[k % n]).collect();
        let samples = Samples { values: &scaled, n };
        let count = samples.count();
        let growth = exponent(&record.growth);
        let unit = interval * self.field.time_unit(self.parameters);
        let mut evidence =
            Recognition { exponent: growth.map(|own| own.map(|e| e / unit)), returns: count, ..Recognition::default() };
        let shrinks = growth.is_none_or(|[rate, error]| rate + error < 0.0);
        if let Some(q) = closing(&samples) {
            if shrinks {
                return (Nature::Cycle(q as f64 * interval), evidence);
            }
            evidence.reason = format!("it repeats itself after {q} intervals, but does not attract measurably");
            return (Nature::Undecided, evidence);
        }
        let chaos = |[rate, error]: [f64; 2]| rate > 3.0 * error && rate * count as f64 > 10.0;
        if growth.is_some_and(chaos) {
            return (Nature::Chaos, evidence);
        }
        let mut best: Option<(usize, Curve)> = None;
        for turns in 1..=TURNS {
            let thinned: Vec<f64> = scaled.chunks_exact(n).step_by(turns).flatten().copied().collect();
            let own = Samples { values: &thinned, n };
            for line in own.lines(3) {
                let curve = own.curve(line, HARMONICS.min(own.count() / 10), ENOUGH);
                if best.as_ref().is_none_or(|(_, known)| curve.residual < 0.5 * known.residual) {
                    best = Some((turns, curve));
                }
                if best.as_ref().is_some_and(|(_, curve)| curve.residual <= NEAR) {
                    break;
                }
            }
            if best.as_ref().is_some_and(|(_, curve)| curve.residual <= NEAR) {
                break;
            }
        }
        let Some((turns, curve)) = best else {
            evidence.reason = "its spectrum has no lines".into();
            return (Nature::Undecided, evidence);
        };
        let thinned: Vec<f64> = scaled.chunks_exact(n).step_by(turns).flatten().copied().collect();
        let own = Samples { values: &thinned, n };
        let mut curve = curve;
        let mut halves = own.halves().map(|half| half.curve(half.line_near(curve.turn), 1, 0.0));
        if (halves[0].turn - halves[1].turn).abs() > SHARP && curve.residual <= ROUGH {
            // Lines close to others are biased; all harmonics together are not.
            curve = own.sharpened(&curve, ENOUGH);
            halves = own.halves().map(|half| half.sharpened(&curve, ENOUGH));
        }
        let rounding = if self.field.iterated() { 1e-14 } else { 10.0 * ACCURACY };
        // The halves may agree by chance: states that far off the curve displace a line by that share of a turn over the record.
        let blurred = curve.residual / count as f64;
        let error = (halves[0].turn - halves[1].turn).abs().max(rounding).max(blurred);
        evidence.rotation = Some([curve.turn, error]);
        let change = (halves[0].amplitude(n) / halves[1].amplitude(n)).ln().abs();
        let idle = growth.is_none_or(|[rate, error]| rate.abs() <= 3.0 * error || rate.abs() * count as f64 <= 0.5);
        let near = ratio_near(curve.turn, 10.0 * error, own.count() / 8);
        evidence.reason = match () {
            _ if curve.residual > NEAR => {
                let exponent = match growth {
                    None => "; its largest exponent is not known, as f or the state jumps".to_string(),
                    Some(_) => String::new(),
                };
                format!(
                    "its states lie on no closed curve to better than {:.0e} of its extent{exponent}",
                    curve.residual
                )
            }
            _ if error > KNOWN => format!("its rotation number is known to {error:.0e} only"),
            _ if near.is_some() => {
                let (p, q) = near.unwrap_or_default();
                format!("its rotation number cannot be distinguished from {p}/{q}, at which it may lock to a cycle")
            }
            _ if change > STEADY => {
                format!("it still changes, by {change:.0e} of its amplitude over half of the record")
            }
            _ if !idle => "its largest exponent is not 0 as on a torus".into(),
            () => String::new(),
        };
        if !evidence.reason.is_empty() {
            return (Nature::Undecided, evidence);
        }
        (Nature::Torus(Quasi { turns, interval: turns as f64 * interval, curve, extent }), evidence)
    }
}

/// Mean growth per interval, and three times its standard error, from the averages over parts of a record.
fn exponent(growth: &[f64]) -> Option<[f64; 2]> {
    if growth.len() < 2 * PARTS {
        return None;
    }
    let changes: Vec<f64> = growth.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let length = changes.len() / PARTS;
    // The perturbation of the first part has not turned into the direction of largest growth yet.
    let parts: Vec<f64> = changes.chunks_exact(length).skip(1).map(average).collect();
    let count = parts.len() as f64;
    let mean = parts.iter().sum::<f64>() / count;
    let spread = parts.iter().map(|own| (own - mean).powi(2)).sum::<f64>() / (count - 1.0);
    Some([mean, 3.0 * (spread / count).sqrt() + 1e-12])
}

/// The smallest q of (1), without the condition on the exponent.
fn closing(samples: &Samples) -> Option<usize> {
    let (n, count) = (samples.n, samples.count());
    let state = |j: usize| &samples.values[j * n..(j + 1) * n];
    let apart = |a: usize, b: usize| state(a).iter().zip(state(b)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let last = count - 1;
    (1..=count / 4).find(|&q| {
        apart(last, last - q) <= REPEATS
            && (count / 2..count).all(|j| apart(j, j - q) <= REPEATS)
            && (1..=count / 2 / q).all(|m| apart(last, last - m * q) <= REPEATS)
    })
}

/// The ratio p/q with the smallest q up to `most` that lies within `error` of a number.
fn ratio_near(x: f64, error: f64, most: usize) -> Option<(usize, usize)> {
    let off = |q: &usize| {
        let turns = x * *q as f64;
        (turns - turns.round()).abs() <= error * *q as f64
    };
    (1..=most).find(off).map(|q| ((x * q as f64).round().abs() as usize, q))
}
