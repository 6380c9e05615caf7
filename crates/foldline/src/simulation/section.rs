//! Sign changes of a function of the state along a step.
//!
//! **Idea.** The function is sampled on the continuous solution of the step. A sign change between two samples, or
//! between a sample and an extremum beyond zero, brackets a crossing. Within the bracket the crossing is located on the
//! trajectory itself: the state is recomputed by a full-order step from the start of the accepted one, so a crossing is
//! as accurate as the integration rather than the interpolant.
//!
//! **Fails when** the function oscillates several times within an eighth of a step.

use super::Step;
use super::root::{lowest, root};

/// Sign changes that count as crossings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Direction {
    /// From negative to positive.
    Rising,
    /// From positive to negative.
    Falling,
    /// Both.
    #[default]
    Either,
}

/// Scalar function of time and state `[n]` whose zeros along a trajectory are sought.
#[derive(Clone, Copy)]
pub struct Section<'a> {
    /// Function.
    pub value: &'a dyn Fn(f64, &[f64]) -> f64,
    /// Direction of the zeros sought.
    pub direction: Direction,
}

/// Zero of a section function.
#[derive(Clone, Debug, PartialEq)]
pub struct Crossing {
    /// Index of the section.
    pub section: usize,
    /// Time.
    pub time: f64,
    /// `[n]` state.
    pub state: Vec<f64>,
    /// True if the function increases there.
    pub rising: bool,
}

/// Number of samples per step.
const SAMPLES: usize = 8;
/// An extremum is refined if a parabola puts it below this fraction of the largest sample.
const WORTH: f64 = 0.02;

/// All crossings along a step, in the order of integration; `exact` writes the state at a fraction θ of the step to the
/// accuracy of the integration.
pub(super) fn crossings(step: &Step, sections: &[Section], mut exact: impl FnMut(f64, &mut [f64])) -> Vec<Crossing> {
    let mut found: Vec<(f64, Crossing)> = Vec::new();
    let mut x = vec![0.0; step.dim()];
    for (index, section) in sections.iter().enumerate() {
        let mut value = |theta: f64, exactly: bool, x: &mut Vec<f64>| {
            if theta == 0.0 {
                step.start_into(x);
            } else if exactly && theta < 1.0 {
                exact(theta, x);
            } else {
                step.state_into(theta, x);
            }
            (section.value)(step.time_at(theta), x)
        };
        let mut samples: Vec<[f64; 2]> = (0..=SAMPLES)
            .map(|s| {
                let theta = s as f64 / SAMPLES as f64;
                [theta, value(theta, false, &mut x)]
            })
            .collect();
        insert_extrema(&mut samples, |theta| value(theta, true, &mut x));
        for pair in samples.windows(2) {
            let ([a, ga], [b, gb]) = (pair[0], pair[1]);
            let rising = ga < 0.0 && gb >= 0.0;
            let falling = ga > 0.0 && gb <= 0.0;
            let wanted = match section.direction {
                Direction::Rising => rising,
                Direction::Falling => falling,
                Direction::Either => rising || falling,
            };
            if !wanted {
                continue;
            }
            let ends = [value(a, true, &mut x), value(b, true, &mut x)];
            // If the interpolant and the trajectory disagree about the sign at a sample, the sample is the crossing.
            let theta = if ends[0] * ends[1] < 0.0 {
                root(|theta| value(theta, true, &mut x), [a, b], ends, 1e-15)
            } else if ends[0].abs() < ends[1].abs() {
                a
            } else {
                b
            };
            value(theta, true, &mut x);
            found.push((theta, Crossing { section: index, time: step.time_at(theta), state: x.clone(), rising }));
        }
    }
    found.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    found.into_iter().map(|(_, crossing)| crossing).collect()
}

/// Adds the extrema that lie beyond zero between samples of the same sign.
pub(super) fn insert_extrema(samples: &mut Vec<[f64; 2]>, mut value: impl FnMut(f64) -> f64) {
    let largest = samples.iter().fold(0.0, |m: f64, [_, g]| m.max(g.abs()));
    let mut extrema = Vec::new();
    for c in 0..samples.len() {
        let sign = samples[c][1].signum();
        let low = |k: usize| sign * samples[k][1];
        let left = c.saturating_sub(1);
        let right = (c + 1).min(samples.len() - 1);
        if !(low(c) > 0.0 && low(left) >= low(c) && low(right) >= low(c)) {
            continue;
        }
        // At an end of the step the parabola passes through the two nearest samples.
        let (p, q, r) = match c {
            0 => (low(0), low(1), low(2)),
            _ if right == c => (low(c), low(c - 1), low(c - 2)),
            _ => (low(left), low(c), low(right)),
        };
        let curvature = p - 2.0 * q + r;
        let slope = if c == left || c == right { 0.5 * (4.0 * q - 3.0 * p - r) } else { 0.5 * (r - p) };
        let estimate = low(c) - if curvature > 0.0 { 0.5 * slope * slope / curvature } else { 0.0 };
        if estimate < WORTH * largest {
            let (theta, lowest) = lowest(|theta| sign * value(theta), [samples[left][0], samples[right][0]]);
            if lowest <= 0.0 {
                extrema.push([theta, sign * lowest]);
            }
        }
    }
    samples.extend(extrema);
    samples.sort_by(|a, b| a[0].total_cmp(&b[0]));
}
