//! Returns to a section, and their predicted limit.
//!
//! **Idea.** A trajectory that approaches a cycle returns to a plane across it at points y₁, y₂, … that converge like a
//! linear map. A cycle that crosses the plane q times per period is detected by comparing every q-th return. The limit
//! of a linear map follows from a few of its iterates, long before they reach it.
//!
//! **Equations.** With differences uⱼ = yⱼ₊₁ - yⱼ of every q-th return, j = 0 … m, scaled by the extent of the motion:
//!
//!   (1)  γ = arg min |Σ γⱼ uⱼ| subject to Σ γⱼ = 1
//!   (2)  y* = Σ γⱼ yⱼ₊₁
//!
//! exact for an affine map whose minimal polynomial has degree at most m; the degree is at most n - 1.
//!
//! **Source.** sidi2017, §1 (reduced rank extrapolation).
//!
//! **Fails when** the map is far from linear over the returns used. In few dimensions (1) leaves no residual to show
//! it; comparison with the limit predicted one return earlier does, and so does integrating from the limit over a
//! period.

use crate::simulation::Step;

/// Largest number of crossings per period that is sought. Empirical: cycles with up to [`MOST_REPEATED`] crossings are
/// found by following the trajectory until it repeats itself.
const MOST_CROSSINGS: usize = 16;
/// Largest number of crossings per period for a trajectory that is followed until it repeats itself.
const MOST_REPEATED: usize = 40;
/// Largest m of (1).
const MOST_TERMS: usize = 8;
/// Number of differences for [`MOST_TERMS`] terms, with one more for the comparison.
const MOST: usize = MOST_TERMS + 2;
/// Number of returns kept.
const KEPT: usize = MOST_REPEATED * 6 + 1;
/// Largest last difference, relative to the extent, from which a limit is predicted.
const NEAR: f64 = 0.5;
/// Largest difference between the limits predicted from successive returns, relative to the last difference of returns.
const STEADY: f64 = 0.3;
/// Last difference and doubt below which a prediction is worth integrating over a period.
const WORTHWHILE: [f64; 2] = [0.1, 5e-3];
/// Largest distance of a predicted limit from the last return, relative to the extent.
const REACH: f64 = 0.5;
/// Difference, relative to the extent, below which successive turns are the same motion. A spiral that turns by nearly
/// half a revolution per turn comes much closer to its position two turns earlier.
const SAME: f64 = 1e-5;
/// Half-width, relative to the extent of the motion, of the first part of a plane that is watched beside a crowded plane;
/// it is halved while that part is crowded too.
pub(super) const PART: f64 = 0.05;
/// Decrease of a distance over the last returns that counts as an approach.
const APPROACHED: f64 = 0.95;

/// A plane, with the points and times at which a trajectory crossed it.
#[derive(Clone, Debug, Default)]
pub(super) struct Returns {
    /// `[n]` the plane passes through here …
    anchor: Vec<f64>,
    /// … with this normal `[n]`.
    normal: Vec<f64>,
    /// `[n]` distances from the anchor within which a crossing counts; empty if the whole plane is used.
    reach: Vec<f64>,
    total: usize,
    times: Vec<f64>,
    /// `[return][n]`.
    states: Vec<f64>,
    /// Difference, relative to the extent, below which integration errors dominate.
    noise: f64,
}

/// A predicted limit of the returns.
#[derive(Clone, Debug)]
pub(super) struct Prediction {
    /// `[n]`.
    pub(super) state: Vec<f64>,
    /// Number of returns per period.
    pub(super) crossings: usize,
    /// Time between the last returns that were compared.
    pub(super) period: f64,
    /// The last difference, relative to the extent.
    pub(super) size: f64,
    /// Change of the prediction with the last return, relative to the extent.
    pub(super) doubt: f64,
}

impl Prediction {
    /// True if integrating from it over a period is likely enough to show a cycle: that costs more than a few returns.
    pub(super) fn worthwhile(&self) -> bool {
        self.size <= WORTHWHILE[0] && self.doubt <= WORTHWHILE[1]
    }

    /// True if a later prediction is the same motion, within the allowed doubt.
    pub(super) fn agrees(&self, later: &Prediction, extent: &[f64]) -> bool {
        let moved = (0..extent.len()).fold(0.0, |m: f64, i| m.max((self.state[i] - later.state[i]).abs() / extent[i]));
        moved <= WORTHWHILE[1] && (self.period - later.period).abs() <= 0.05 * later.period
    }
}

impl Returns {
    /// Returns the plane through `anchor` orthogonal to the velocity in the metric of `scale`; `noise` is the relative
    /// error.
    pub(super) fn across(anchor: Vec<f64>, velocity: &[f64], scale: &[f64], noise: f64) -> Returns {
        let normal: Vec<f64> = velocity.iter().zip(scale).map(|(v, s)| v / (s * s)).collect();
        let length = normal.iter().map(|v| v * v).sum::<f64>().sqrt();
        let normal = normal.iter().map(|v| v / length).collect();
        Returns { anchor, normal, noise, ..Returns::default() }
    }

    /// Restricts the plane to the part within these distances `[n]` of the anchor. A burst of many spikes crosses the
    /// whole plane at every spike, and a part of it at those few that begin at nearly the same slow variables.
    pub(super) fn within(mut self, reach: Vec<f64>) -> Returns {
        self.reach = reach;
        self
    }

    /// True if the trajectory has crossed so often that any period with at most [`MOST_REPEATED`] crossings has passed
    /// twice.
    pub(super) fn crowded(&self) -> bool {
        self.total > 2 * MOST_REPEATED
    }

    /// Evaluates the equation of the plane.
    pub(super) fn value(&self, x: &[f64]) -> f64 {
        self.normal.iter().zip(x).zip(&self.anchor).map(|((c, x), a)| c * (x - a)).sum()
    }

    /// Number of returns so far.
    pub(super) fn total(&self) -> usize {
        self.total
    }

    /// Returns time and state `[n]` of the last return.
    pub(super) fn last(&self) -> Option<(f64, &[f64])> {
        Some((*self.times.last()?, self.states.rchunks_exact(self.anchor.len().max(1)).next()?))
    }

    /// Returns a parallel plane through `start`, without returns, for a trajectory that starts there.
    pub(super) fn again_from(&self, start: &[f64]) -> Returns {
        let (anchor, normal, reach, noise) = (start.to_vec(), self.normal.clone(), self.reach.clone(), self.noise);
        Returns { anchor, normal, reach, noise, ..Returns::default() }
    }

    /// Records a crossing in the direction of the normal within the step. Returns true if there was one.
    pub(super) fn follow(&mut self, step: &Step, end: &[f64]) -> bool {
        // An event may have taken the state across the plane since the end of the last step; that is no crossing.
        let from = self.normal.iter().zip(&self.anchor).enumerate();
        let before: f64 = from.map(|(i, (c, a))| c * (step.start(i) - a)).sum();
        let value = if before < 0.0 { self.value(end) } else { f64::NAN };
        let crosses = before < 0.0 && value >= 0.0;
        if !crosses {
            return false;
        }
        let along = step.along(&self.normal);
        // Secant iteration on the continuous solution, kept within the bracket (Illinois method).
        let ([mut a, mut b], [mut ga, mut gb]) = ([0.0, 1.0], [before, value]);
        let mut theta = 1.0;
        for _ in 0..20 {
            theta = (gb * a - ga * b) / (gb - ga);
            let g = before + along.change(theta);
            if g.abs() <= 1e-12 * (value - before) {
                break;
            }
            if g < 0.0 {
                (a, ga, gb) = (theta, g, 0.5 * gb);
            } else {
                (b, gb, ga) = (theta, g, 0.5 * ga);
            }
        }
        let place = self.states.len();
        self.states.resize(place + end.len(), 0.0);
        step.state_into(theta, &mut self.states[place..]);
        if !self.reached(&self.states[place..]) {
            self.states.truncate(place);
            return false;
        }
        if self.times.len() >= KEPT {
            self.times.remove(0);
            self.states.drain(..end.len());
        }
        self.total += 1;
        self.times.push(step.time_at(theta));
        true
    }

    /// True if a point of the plane belongs to the part that is used.
    fn reached(&self, x: &[f64]) -> bool {
        self.reach.iter().zip(x).zip(&self.anchor).all(|((reach, x), a)| (x - a).abs() <= *reach)
    }

    /// Returns the limit of every q-th return, 1 ≤ q ≤ [`MOST_REPEATED`], if the last of them are close together and
    /// the limit predicted one return earlier was the same. With `repeats`, a motion that is back where it was one period
    /// earlier needs no more returns: bursts are long, and attract within one of them.
    fn predict(&self, q: usize, extent: &[f64], repeats: bool) -> Option<Prediction> {
        // Smaller matrices where fewer terms suffice.
        match MOST_TERMS.min(self.anchor.len().saturating_sub(1)) {
            ..=3 => self.predict_in::<5>(q, extent, repeats),
            _ => self.predict_in::<MOST>(q, extent, repeats),
        }
    }

    fn predict_in<const M: usize>(&self, q: usize, extent: &[f64], repeats: bool) -> Option<Prediction> {
        let n = self.anchor.len();
        let newest = self.times.len().checked_sub(1)?;
        let terms = (M - 2).min(n.saturating_sub(1)).min(KEPT / q - 3);
        // m + 1 differences, and one more return for the comparison.
        let enough = newest >= (terms + 2) * q;
        if !(enough || repeats && newest >= q) {
            return None;
        }
        // y(0) is the newest return.
        let y = |back: usize| &self.states[(newest - back * q) * n..][..n];
        let size = (0..n).fold(0.0, |m: f64, i| m.max((y(0)[i] - y(1)[i]).abs() / extent[i]));
        if size.is_nan() || size > NEAR {
            return None;
        }
        let period = self.times[newest] - self.times[newest - q];
        if size < self.noise {
            return Some(Prediction { state: y(0).to_vec(), crossings: q, period, size, doubt: size });
        }
        if !enough {
            return None;
        }
        let gram = Gram::<M>::new(terms + 2, extent, y);
        let (gamma, earlier) = (gram.weights(0, terms + 1)?, gram.weights(1, terms + 1)?);
        let limit =
            |gamma: &[f64; M], from: usize, i: usize| (0..=terms).map(|j| gamma[j] * y(from + j)[i]).sum::<f64>();
        let (mut doubt, mut reach): (f64, f64) = (0.0, 0.0);
        for i in 0..n {
            let here = limit(&gamma, 0, i);
            doubt = doubt.max((here - limit(&earlier, 1, i)).abs() / extent[i]);
            reach = reach.max((here - y(0)[i]).abs() / extent[i]);
        }
        let state = || (0..n).map(|i| limit(&gamma, 0, i)).collect();
        (reach <= REACH && doubt <= STEADY * size).then(|| Prediction {
            state: state(),
            crossings: q,
            period,
            size,
            doubt,
        })
    }

    /// True if any difference of every q-th return is small enough for its limit to be worth following. The prediction
    /// itself costs much more.
    pub(super) fn comes_back(&self, extent: &[f64]) -> bool {
        let n = self.anchor.len();
        let Some((_, last)) = self.last() else { return false };
        let near = |q: usize| {
            let Some(from) = self.times.len().checked_sub(q + 1) else { return false };
            let then = &self.states[from * n..][..n];
            (0..n).all(|i| (last[i] - then[i]).abs() <= WORTHWHILE[0] * extent[i])
        };
        (1..=MOST_CROSSINGS).any(near)
    }

    /// True if the trajectory comes steadily closer, as measured by `distance`: the largest value over each third of
    /// the last returns, as many as several periods need, is smaller than over the third before.
    pub(super) fn approach(&self, distance: impl Fn(&[f64]) -> f64) -> bool {
        let third = (self.times.len() / 3).min(MOST_CROSSINGS);
        if third < 2 {
            return false;
        }
        let mut largest = [0.0f64; 3];
        for (back, state) in self.states.rchunks_exact(self.anchor.len().max(1)).take(3 * third).enumerate() {
            let part = &mut largest[back / third];
            *part = part.max(distance(state));
        }
        let [last, middle, first] = largest;
        last < middle && middle < first && last <= APPROACHED * first
    }

    /// Returns the `count` most promising predictions: those that changed least, the fewest crossings per period first.
    pub(super) fn predictions(&self, count: usize, extent: &[f64]) -> Vec<Prediction> {
        // A cycle is predicted as well over several turns as over one.
        const AS_WELL: f64 = 1e-4;
        let mut found: Vec<Prediction> = Vec::new();
        for q in 1..=MOST_CROSSINGS {
            found.extend(self.predict(q, extent, !self.reach.is_empty()));
            // These remain and come first, whatever is found later.
            if found.len() >= count && found.iter().all(|p| p.doubt <= AS_WELL) {
                break;
            }
        }
        let least = found.iter().fold(f64::INFINITY, |m, p| m.min(p.doubt));
        found.retain(|p| p.doubt <= 3.0 * least + AS_WELL);
        found.truncate(count);
        found
    }

    /// Returns the prediction over the number of crossings per period after which the trajectory itself comes closest,
    /// the fewest if several do. (A mean over the crossings of a period is also a steady prediction, but not a state of
    /// the motion.)
    pub(super) fn closest(&self, extent: &[f64]) -> Option<Prediction> {
        let mut found: Vec<Prediction> = (1..=MOST_REPEATED).filter_map(|q| self.predict(q, extent, true)).collect();
        let least = found.iter().fold(f64::INFINITY, |m, p| m.min(p.size));
        found.retain(|p| p.size <= 10.0 * least + SAME);
        found.into_iter().next()
    }
}

/// Returns (2) from m + 2 iterates, newest first; differences are measured in `scale`.
pub(super) fn limit_of(y: &[&[f64]], scale: &[f64]) -> Option<Vec<f64>> {
    let count = y.len().checked_sub(1).filter(|count| *count <= MOST)?;
    let gamma = Gram::<MOST>::new(count, scale, |back| y[back]).weights(0, count)?;
    Some((0..scale.len()).map(|i| gamma[..count].iter().zip(y).map(|(g, y)| g * y[i]).sum()).collect())
}

/// Inner products of the differences uⱼ, at most M of them.
struct Gram<const M: usize>([[f64; M]; M]);

impl<const M: usize> Gram<M> {
    /// Returns the products of `count` differences, at most m + 2, from `count` + 1 iterates, y(0) being the newest.
    fn new<'a>(count: usize, scale: &[f64], y: impl Fn(usize) -> &'a [f64]) -> Gram<M> {
        let mut gram = [[0.0; M]; M];
        let mut u = [0.0; M];
        for i in 0..scale.len() {
            for (j, u) in u[..count].iter_mut().enumerate() {
                *u = (y(j)[i] - y(j + 1)[i]) / scale[i];
            }
            for j in 0..count {
                (0..=j).for_each(|k| gram[j][k] += u[j] * u[k]);
            }
        }
        Gram(gram)
    }

    /// Returns γ of (1) for the m differences from number `from`, from the normal equations G c = 1, γ = c / Σ c,
    /// slightly regularised.
    fn weights(&self, from: usize, m: usize) -> Option<[f64; M]> {
        let trace: f64 = (0..m).map(|i| self.0[from + i][from + i]).sum();
        // G = L D Lᵀ; row k holds L D until its pivot is known.
        let mut l = [[0.0; M]; M];
        let (mut d, mut c) = ([0.0; M], [0.0; M]);
        for k in 0..m {
            let mut own = l[k];
            for j in 0..k {
                own[j] = self.0[from + k][from + j] - (0..j).map(|i| own[i] * l[j][i]).sum::<f64>();
            }
            (d[k], c[k]) = (self.0[from + k][from + k] + 1e-14 * trace, 1.0);
            for j in 0..k {
                let factor = own[j] / d[j];
                d[k] -= own[j] * factor;
                c[k] -= factor * c[j];
                own[j] = factor;
            }
            if d[k].is_nan() || d[k] <= 0.0 {
                return None;
            }
            l[k] = own;
        }
        c.iter_mut().zip(&d).take(m).for_each(|(c, d)| *c /= d);
        for k in (0..m).rev() {
            (0..k).for_each(|j| c[j] -= l[k][j] * c[k]);
        }
        let sum: f64 = c.iter().sum();
        (sum.is_finite() && sum != 0.0).then(|| c.map(|c| c / sum))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns of a map with multipliers 0.9 e^{±i φ} and 0.5 to the fixed point (0.1, 0.2, 0.3, 0.4), which lies in
    /// the plane.
    fn returns(count: usize, angle: f64) -> Returns {
        let mut returns = Returns::across(vec![0.1, 0.2, 0.3, 0.4], &[0.0, 0.0, 0.0, 1.0], &[1.0; 4], 1e-6);
        for k in 0..count {
            let (decay, phase) = (0.01 * 0.9f64.powi(k as i32), angle * k as f64);
            let (a, b, c) = (decay * phase.cos(), decay * phase.sin(), 0.02 * 0.5f64.powi(k as i32));
            returns.states.extend([0.1 + a + c, 0.2 + b, 0.3 - c + b, 0.4]);
            returns.times.push(2.0 * k as f64);
            returns.total += 1;
        }
        returns
    }

    #[test]
    fn the_limit_of_a_linear_map_is_predicted_from_its_first_iterates() {
        let predictions = returns(6, 0.7).predictions(3, &[1.0; 4]);
        assert_eq!(predictions.len(), 1);
        let error =
            predictions[0].state.iter().zip([0.1, 0.2, 0.3, 0.4]).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        // The returns are still 1e-2 away; the regularisation of the normal equations costs the last digits.
        assert!(error < 1e-6, "{error}");
        assert_eq!(predictions[0].period, 2.0);
    }

    #[test]
    fn fewer_crossings_per_period_come_first_although_more_return_closer() {
        // After 9 turns of 0.7 rad the trajectory is back after almost one revolution, closer than after one turn.
        let predictions = returns(60, 0.7).predictions(3, &[1.0; 4]);
        assert!(predictions.len() > 1 && predictions[0].period == 2.0);
    }

    #[test]
    fn nothing_is_predicted_from_too_few_returns_or_from_scattered_ones() {
        assert!(returns(5, 0.7).predictions(3, &[1.0; 4]).is_empty());
        let mut scattered = returns(30, 0.7);
        scattered.states.iter_mut().enumerate().for_each(|(k, x)| *x += ((k * k) as f64 * 0.7).sin());
        assert!(scattered.predictions(3, &[1.0; 4]).is_empty());
    }
}
