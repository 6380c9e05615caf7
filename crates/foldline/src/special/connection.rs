//! Orbits of infinite period that a branch of cycles approaches.
//!
//! **Idea.** A cycle close to a homoclinic or heteroclinic orbit spends most of its period near equilibria. The slowest
//! points of the cycle are therefore compared with nearby equilibria: each must be a saddle, the cycle must pass close
//! to it, and the passage time must be the one that the eigenvalues predict for that distance. A canard is slow as
//! well, but not near a saddle. If there is no equilibrium at all, two may just have vanished in a saddle-node; the
//! period then follows from its normal form.
//!
//! **Equations.** With d the least distance from a saddle with leading eigenvalues λ_s < 0 < λ_u, R the radius of a
//! ball around it, and null vectors v, w, ⟨w, v⟩ = 1, of f_x and its transpose at a saddle-node:
//!
//! ```text
//!   (1)  time in the ball = (1/λ_u + 1/|λ_s|) ln(R/d)
//!   (2)  f(x, p) = 0,  f_x v = 0,  ⟨v₀, v⟩ = 1
//!   (3)  T = π / (a b (p - p₀))^½,   a = ⟨w, f_p⟩,  b = ½ ⟨w, D²f[v, v]⟩
//! ```
//!
//! **Source.** kuznetsov2004, §6.1 (passage near a saddle) and §7.1 (saddle-node on an invariant circle).

use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::{Connection, Cycle, Ending, Point, Shown, Solution};
use crate::linalg::{dot, lu};
use crate::stability::eigenvalues;
use std::f64::consts::PI;

/// Radius of the ball around an equilibrium in which the flow is nearly linear, in units of the extents of the cycle.
/// Order of magnitude: quadratic terms are then a tenth of the linear ones.
const BALL: f64 = 0.1;
/// Largest distance, in the same units, of closest approach to a saddle: e⁻² of the ball. The logarithm in (1) is then
/// at least 2 and exceeds the neglected terms of order 1.
const CLOSE: f64 = 0.135 * BALL;
/// Largest ratio between the measured time and (1) or (3). Empirical: the ball is not small, and the constants beside
/// the logarithm are neglected.
const FACTOR: f64 = 3.0;
/// Smallest share of the period spent near equilibria. It tends to 1 at the limit; one half is a factor of safety.
const MOST: f64 = 0.5;
/// Largest number of saddles on one heteroclinic cycle. A bound on the work: with more, each takes an eighth of the
/// period or less.
const PLACES: usize = 8;
/// Maximum number of Newton iterations. Convergence to 1e-10 from a tenth of the extent takes about six; the rest is a
/// margin.
const ITERATIONS: usize = 20;

/// Search for equilibria next to a cycle, with distances in units of its extents.
pub struct Limits<'a> {
    /// Vector field, which is autonomous.
    pub field: &'a dyn VectorField,
    /// Index of the continuation parameter.
    pub free: usize,
    /// `[n]` characteristic sizes of the states.
    pub scales: &'a [f64],
    /// Scale of that parameter.
    pub unit: f64,
    /// Relative accuracy of parameters.
    pub tolerance: f64,
}

/// Node of a cycle: its state, its share of the period (quadrature weight), and its speed.
struct Node {
    x: Vec<f64>,
    share: f64,
    speed: f64,
}

/// Copy of a state with angles between minus and plus half their period.
pub(crate) fn in_first_turn(periods: &[f64], x: &[f64]) -> Vec<f64> {
    let mut x = x.to_vec();
    for (x, period) in x.iter_mut().zip(periods).filter(|(_, period)| period.is_finite()) {
        *x -= period * (*x / period).round();
    }
    x
}

impl Limits<'_> {
    /// Orbit of infinite period that a cycle of long period approaches, if any.
    pub fn approached(&self, at: &Point) -> Option<Ending> {
        let Solution::Cycle(cycle) = &at.solution else { return None };
        let n = cycle.dim();
        if cycle.forcing_periods > 0 || n != self.scales.len() || at.ranges.len() < n {
            return None;
        }
        let extents: Vec<f64> = at.ranges[..n].iter().map(|[low, high]| (high - low).max(f64::MIN_POSITIVE)).collect();
        let nodes = self.nodes(cycle, &at.parameters, &extents);
        self.saddles(cycle.period, &nodes, &at.parameters, &extents)
            .map(|(connection, told)| (connection, at.parameters[self.free], told))
            .or_else(|| self.saddle_node(cycle.period, &nodes, &at.parameters, &extents))
            .map(|(connection, parameter, to)| Ending::Connecting { connection, parameter, period: cycle.period, to })
    }

    fn nodes(&self, cycle: &Cycle, parameters: &[f64], extents: &[f64]) -> Vec<Node> {
        let (n, m, scheme) = (cycle.dim(), cycle.degree, cycle.scheme());
        let mut nodes = Vec::with_capacity(cycle.intervals() * m);
        for (block, ends) in cycle.profile.chunks_exact((m + 1) * n).zip(cycle.mesh.windows(2)) {
            for (x, weight) in block[n..].chunks_exact(n).zip(&scheme.weights) {
                let (f, _) = self.linearised(x, parameters);
                let speed = distance(&f, &vec![0.0; n], extents);
                nodes.push(Node { x: x.to_vec(), share: weight * (ends[1] - ends[0]), speed });
            }
        }
        nodes
    }

    /// Connection of the saddles near which the cycle spends most of its period.
    fn saddles(
        &self,
        period: f64,
        nodes: &[Node],
        parameters: &[f64],
        extents: &[f64],
    ) -> Option<(Connection, String)> {
        let mut left: Vec<&Node> = nodes.iter().collect();
        let (mut met, mut spent): (Vec<Vec<f64>>, f64) = (Vec::new(), 0.0);
        for _ in 0..PLACES {
            let Some(slowest) = left.iter().min_by(|a, b| a.speed.total_cmp(&b.speed)) else { break };
            let Some(saddle) = self.equilibrium(&slowest.x, parameters) else { break };
            let near = |node: &Node| self.apart(&node.x, &saddle, extents) < BALL;
            let inside: Vec<&Node> = left.iter().copied().filter(|node| near(node)).collect();
            let share: f64 = inside.iter().map(|node| node.share).sum();
            let least = inside.iter().map(|node| self.apart(&node.x, &saddle, extents)).fold(f64::INFINITY, f64::min);
            let passage = self.passage(&saddle, parameters, least);
            if !(least < CLOSE && passage.is_some_and(|time| fits(share * period, time * passes(nodes, &near)))) {
                break;
            }
            spent += share;
            met.push(saddle.clone());
            left.retain(|node| !near(node));
        }
        let kind = if met.len() == 1 { Connection::Homoclinic } else { Connection::Heteroclinic };
        (spent > MOST).then(|| (kind, met.iter().map(|x| self.place(x)).collect::<Vec<_>>().join(", ")))
    }

    /// Equilibrium to which Newton's method converges from a state.
    fn equilibrium(&self, beside: &[f64], parameters: &[f64]) -> Option<Vec<f64>> {
        let n = beside.len();
        let (mut x, mut pivots) = (beside.to_vec(), vec![0; n]);
        for _ in 0..ITERATIONS {
            let (mut f, mut fx) = self.linearised(&x, parameters);
            lu::factorise(&mut fx, n, &mut pivots).ok()?;
            lu::solve(&fx, n, &pivots, &mut f, 1);
            x.iter_mut().zip(&f).for_each(|(x, d)| *x -= d);
            let size = self.relative(&f, &x);
            if size < 1e-10 || !size.is_finite() {
                return size.is_finite().then_some(x);
            }
        }
        None
    }

    /// Time (1) of one passage at distance `least`; `None` if the equilibrium is not a saddle.
    fn passage(&self, saddle: &[f64], parameters: &[f64], least: f64) -> Option<f64> {
        let (_, fx) = self.linearised(saddle, parameters);
        let rates = eigenvalues(&fx, saddle.len(), self.scales).into_iter().map(|z| z.re);
        let slowest =
            |sign: f64| rates.clone().map(|rate| sign * rate).filter(|rate| *rate > 0.0).fold(f64::INFINITY, f64::min);
        let [unstable, stable] = [slowest(1.0), slowest(-1.0)];
        let saddle = unstable.is_finite() && stable.is_finite() && least > 0.0;
        saddle.then(|| (1.0 / unstable + 1.0 / stable) * (BALL / least).ln())
    }

    /// Saddle-node (2) next to the slowest point, if its parameter value agrees within the tolerance and its period
    /// with (3).
    fn saddle_node(
        &self,
        period: f64,
        nodes: &[Node],
        parameters: &[f64],
        extents: &[f64],
    ) -> Option<(Connection, f64, String)> {
        let slowest = nodes.iter().min_by(|a, b| a.speed.total_cmp(&b.speed))?;
        let n = slowest.x.len();
        let (x, at, v) = self.fold_beside(&slowest.x, parameters)?;
        let (there, here) = (at[self.free], parameters[self.free]);
        let near = (there - here).abs() <= self.tolerance * (self.unit + there.abs());
        if !near || self.apart(&x, &slowest.x, extents) > BALL {
            return None;
        }
        let w = self.null_vector(&x, &at, true)?;
        let bent = self.derivative(&x, &at, &[&self.padded(&v), &self.padded(&v)]);
        let along = self.derivative(&x, &at, &[&self.along_parameter(n)]);
        let product = 0.5 * dot(&w, &along) * dot(&w, &bent) / dot(&w, &v).powi(2);
        let time = PI / (product * (here - there)).sqrt();
        (time.is_finite() && fits(period, time)).then(|| (Connection::SaddleNode, there, self.place(&x)))
    }

    /// State, parameters and null vector that solve (2), from a state and parameters nearby.
    pub fn fold_beside(&self, beside: &[f64], parameters: &[f64]) -> Option<(Vec<f64>, Vec<f64>, Vec<f64>)> {
        let n = beside.len();
        let (mut x, mut at) = (beside.to_vec(), parameters.to_vec());
        let first = self.null_vector(&x, &at, false)?;
        let mut v = first.clone();
        let size = 2 * n + 1;
        for _ in 0..ITERATIONS {
            let (f, fx) = self.linearised(&x, &at);
            let fp = self.derivative(&x, &at, &[&self.along_parameter(n)]);
            // Unknowns x, p, v; equations as in (2).
            let (mut matrix, mut right) = (vec![0.0; size * size], vec![0.0; size]);
            for j in 0..=n {
                let e = if j < n { self.along_state(n, j) } else { self.along_parameter(n) };
                let bent = self.derivative(&x, &at, &[&self.padded(&v), &e]);
                for i in 0..n {
                    matrix[i * size + j] = if j < n { fx[i * n + j] } else { fp[i] };
                    matrix[(n + i) * size + j] = bent[i];
                }
            }
            for i in 0..n {
                matrix[(n + i) * size + n + 1..(n + i) * size + size].copy_from_slice(&fx[i * n..(i + 1) * n]);
                matrix[2 * n * size + n + 1 + i] = first[i] / self.scales[i].powi(2);
                (right[i], right[n + i]) = (f[i], dot(&fx[i * n..(i + 1) * n], &v));
                right[2 * n] += first[i] * v[i] / self.scales[i].powi(2);
            }
            right[2 * n] -= 1.0;
            let mut pivots = vec![0; size];
            lu::factorise(&mut matrix, size, &mut pivots).ok()?;
            lu::solve(&matrix, size, &pivots, &mut right, 1);
            x.iter_mut().zip(&right).for_each(|(x, d)| *x -= d);
            at[self.free] -= right[n];
            v.iter_mut().zip(&right[n + 1..]).for_each(|(v, d)| *v -= d);
            let moved = self.relative(&right[..n], &x).max(right[n].abs() / (self.unit + at[self.free].abs()));
            if !moved.is_finite() {
                return None;
            }
            if moved < 1e-10 {
                break;
            }
        }
        Some((x, at, v))
    }

    /// Distance of two states, with angles taken between their nearest copies.
    fn apart(&self, a: &[f64], b: &[f64], extents: &[f64]) -> f64 {
        let mut near = a.to_vec();
        for (c, period) in self.field.periods().iter().enumerate().filter(|(_, period)| period.is_finite()) {
            near[c] -= period * ((a[c] - b[c]) / period).round();
        }
        distance(&near, b, extents)
    }

    /// State as text.
    fn place(&self, x: &[f64]) -> String {
        let x = &in_first_turn(self.field.periods(), x);
        // Components that should be zero contain only rounding.
        let rounded = |(x, scale): (&f64, &f64)| if x.abs() < 1e-9 * scale { 0.0 } else { *x };
        let all = x.iter().zip(self.scales).map(|pair| format!("{:.6}", Shown(rounded(pair))));
        format!("({})", all.collect::<Vec<_>>().join(", "))
    }

    /// Null vector of f_x, or of its transpose (`left`), by inverse iteration; of unit length in scaled states, the
    /// left one in the reciprocal scaling.
    fn null_vector(&self, x: &[f64], parameters: &[f64], left: bool) -> Option<Vec<f64>> {
        let n = x.len();
        let (_, mut fx) = self.linearised(x, parameters);
        let shift = 1e-12 * crate::linalg::size_in_any_units(&fx, n).max(f64::MIN_POSITIVE);
        (0..n).for_each(|i| fx[i * n + i] += shift);
        let mut pivots = vec![0; n];
        lu::factorise(&mut fx, n, &mut pivots).ok()?;
        let mut v: Vec<f64> = (0..n).map(|k| self.scales[k] * (1.0 + (k as f64).sin())).collect();
        for _ in 0..4 {
            match left {
                true => lu::solve_transposed(&fx, n, &pivots, &mut v),
                false => lu::solve(&fx, n, &pivots, &mut v, 1),
            }
            let weight = |k: usize| if left { self.scales[k] } else { 1.0 / self.scales[k] };
            let norm = (0..n).map(|k| (v[k] * weight(k)).powi(2)).sum::<f64>().sqrt();
            if !(norm.is_finite() && norm > 0.0) {
                return None;
            }
            v.iter_mut().for_each(|a| *a /= norm);
        }
        Some(v)
    }

    fn linearised(&self, x: &[f64], parameters: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let n = x.len();
        let (mut f, mut fx) = (vec![0.0; n], vec![0.0; n * n]);
        self.field.linearise(self.batch(x, parameters), &[], &mut f, &mut fx, &mut []);
        (f, fx)
    }

    fn derivative(&self, x: &[f64], parameters: &[f64], along: &[&[f64]]) -> Vec<f64> {
        let mut out = vec![0.0; x.len()];
        self.field.directional(self.batch(x, parameters), along, &mut out);
        out
    }

    fn batch<'b>(&self, x: &'b [f64], parameters: &'b [f64]) -> Batch<'b> {
        Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters), times: &[], signs: &[] }
    }

    fn along_state(&self, n: usize, j: usize) -> Vec<f64> {
        (0..n + self.field.parameter_count()).map(|k| if k == j { 1.0 } else { 0.0 }).collect()
    }

    fn along_parameter(&self, n: usize) -> Vec<f64> {
        self.along_state(n, n + self.free)
    }

    fn padded(&self, v: &[f64]) -> Vec<f64> {
        let mut all = v.to_vec();
        all.resize(v.len() + self.field.parameter_count(), 0.0);
        all
    }

    fn relative(&self, d: &[f64], x: &[f64]) -> f64 {
        (0..x.len()).map(|i| (d[i] / (self.scales[i] + x[i].abs())).abs()).fold(0.0, f64::max)
    }
}

/// Largest difference of two states in units of the extents.
fn distance(a: &[f64], b: &[f64], extents: &[f64]) -> f64 {
    (0..a.len()).map(|i| ((a[i] - b[i]) / extents[i]).abs()).fold(0.0, f64::max)
}

/// Number of times that a cycle enters a neighbourhood, at least 1.
fn passes(nodes: &[Node], near: &dyn Fn(&Node) -> bool) -> f64 {
    let before = nodes.iter().cycle().skip(nodes.len() - 1);
    let entries = nodes.iter().zip(before).filter(|(node, before)| near(node) && !near(before)).count();
    entries.max(1) as f64
}

fn fits(measured: f64, expected: f64) -> bool {
    measured < FACTOR * expected && expected < FACTOR * measured
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passage_times_must_agree_within_the_factor() {
        assert!(fits(1.0, 2.9) && fits(2.9, 1.0) && !fits(1.0, 3.1) && !fits(3.1, 1.0) && !fits(1.0, f64::NAN));
    }
}
