//! Ranges and averages over a torus, and copies of it in phase with another.
//!
//! **Idea.** The largest value of a quantity is found on a grid in phase and time, and improved by quadratic models of
//! the interpolant. The trajectory from phase φ continues beyond t = 1 as the one from φ + ρ.

use super::TorusProblem;
use super::start::transferred;
use super::{phases, summit};
use crate::contract::{Batch, Parameters, ZeroProblem};
use crate::diagram::{Point, Solution, Symmetry};
use num_complex::Complex64;
use std::f64::consts::TAU;

impl TorusProblem<'_> {
    /// Smallest and largest value, and mean and mean square, of every state, then of every output.
    pub(super) fn extent(&self, u: &[f64]) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
        let (n, m, size) = (self.n, self.scheme.degree, self.profile_size());
        let parameters = self.setting.at(&u[size + 2..]);
        let (width, fine) = (self.phases * n, (2 * self.phases + 1).max(41));
        let matrix = phases::passage(self.phases, fine);
        let nodes = size / width;
        let lanes = nodes * fine;
        let mut states = vec![0.0; n * lanes];
        let mut times = Vec::with_capacity(lanes);
        for (at, node) in u[..size].chunks_exact(width).enumerate() {
            let (j, i) = (at / (m + 1), at % (m + 1));
            let t = self.time[j] + (self.time[j + 1] - self.time[j]) * self.scheme.nodes[i];
            for (k, row) in matrix.chunks_exact(self.phases).enumerate() {
                times.push(t);
                for c in 0..n {
                    let value = row.iter().zip(node[c..].iter().step_by(n)).map(|(w, x)| w * x).sum();
                    states[c * lanes + at * fine + k] = value;
                }
            }
        }
        let all = self.channels(states, &times, &parameters);
        let grid = [fine as f64, 0.5 / (self.intervals() * m) as f64];
        let ranges = all.chunks_exact(lanes).enumerate().map(|(channel, line)| {
            [-1.0, 1.0].map(|sign| {
                let value = |at: [f64; 2]| {
                    let all = self.channels(self.state(u, at), &[at[1] - at[1].floor()], &parameters);
                    sign * all[channel]
                };
                sign * summit::largest(line, &times, sign, grid, &value)
            })
        });
        let weight = |at: usize| {
            let (j, i) = (at / fine / (m + 1), at / fine % (m + 1));
            let share = if i == 0 { 0.0 } else { self.scheme.weights[i - 1] };
            (self.time[j + 1] - self.time[j]) * share / fine as f64
        };
        let mean = |line: &[f64]| {
            line.iter()
                .enumerate()
                .fold([0.0; 2], |[once, squared], (at, v)| [once + weight(at) * v, squared + weight(at) * v * v])
        };
        (ranges.collect(), all.chunks_exact(lanes).map(mean).collect())
    }

    /// States with the outputs behind them, component-major, at normalised times.
    fn channels(&self, mut states: Vec<f64>, times: &[f64], parameters: &[f64]) -> Vec<f64> {
        let field = self.setting.field;
        let periods = f64::from(self.forcing_periods);
        let own: Vec<f64> = if field.forced() { times.iter().map(|t| periods * t).collect() } else { Vec::new() };
        let mut outputs = vec![0.0; field.output_count() * times.len()];
        let parameters = Parameters::Shared(parameters);
        field.outputs(Batch { lanes: times.len(), states: &states, parameters, times: &own, signs: &[] }, &mut outputs);
        states.extend(outputs);
        states
    }

    /// State at a phase and a time, which may lie a little outside [0, 1].
    fn state(&self, u: &[f64], [mut turns, mut t]: [f64; 2]) -> Vec<f64> {
        let (size, width) = (self.profile_size(), self.phases * self.n);
        let whole = t.floor();
        turns += whole * u[size + 1];
        t -= whole;
        let j = self.time.partition_point(|b| *b <= t).clamp(1, self.intervals()) - 1;
        let block = (self.scheme.degree + 1) * width;
        let mut section = vec![0.0; width];
        let s = (t - self.time[j]) / (self.time[j + 1] - self.time[j]);
        self.scheme.value_into(s, &u[j * block..(j + 1) * block], &mut section);
        phases::between(&section, self.n, turns)
    }

    /// Copies of a point under a symmetry, in the phase in which they are closest to `beside`. Without forcing the time
    /// would have to be shifted as well, and no copy is found.
    pub(super) fn in_phase(
        &self,
        beside: &[f64],
        point: &Point,
        symmetry: &Symmetry,
        within: f64,
    ) -> Vec<[Vec<f64>; 2]> {
        let Solution::Torus(torus) = &point.solution else { return Vec::new() };
        let scalars = beside.len() - self.profile_size();
        let whole = torus.profile.len();
        if self.forcing_periods == 0 || torus.degree != self.scheme.degree || point.tangent.len() != whole + scalars {
            return Vec::new();
        }
        let moved = |profile: &[f64]| {
            let mut own = transferred(profile, self.n, &self.scheme, &torus.mesh, &self.mesh);
            symmetry.apply(&mut own);
            own
        };
        let (profile, tangent) = (moved(&torus.profile), moved(&point.tangent[..whole]));
        let [table, _] = phases::shift(self.phases, self.best_shift(&profile, beside));
        let turn = |v: &[f64]| {
            let mut out = vec![0.0; v.len()];
            let width = self.phases * self.n;
            for (to, from) in out.chunks_exact_mut(width).zip(v.chunks_exact(width)) {
                phases::shifted(&table, from, self.n, to);
            }
            out
        };
        let scalars =
            [&[f64::from(self.forcing_periods), torus.rotation][..], &self.setting.unknowns_of(point)].concat();
        let u = [turn(&profile), scalars].concat();
        let along = [&turn(&tangent)[..], &point.tangent[whole..]].concat();
        let off: Vec<f64> = u.iter().zip(beside).map(|(a, b)| a - b).collect();
        if self.dot(&off, &off) <= within * within { vec![[u, along]] } else { Vec::new() }
    }

    /// Shift of the phase, in turns, by which a profile becomes closest to another.
    fn best_shift(&self, profile: &[f64], beside: &[f64]) -> f64 {
        let (n, count, width) = (self.n, self.phases, self.phases * self.n);
        let mut product = vec![Complex64::default(); count / 2 + 1];
        let block = (self.scheme.degree + 1) * width;
        for (own, other) in profile.chunks_exact(block).zip(beside.chunks_exact(block)) {
            for c in 0..n {
                let transformed = |v: &[f64]| {
                    let mut all: Vec<Complex64> = v[c..width].iter().step_by(n).map(|x| (*x).into()).collect();
                    foldline_general::fourier(&mut all);
                    all
                };
                let weight = 1.0 / (self.scale[c] * self.scale[c]);
                let (a, b) = (transformed(own), transformed(other));
                product.iter_mut().zip(a.iter().zip(&b)).for_each(|(p, (a, b))| *p += weight * a.conj() * b);
            }
        }
        let value = |x: f64| {
            let terms = product.iter().enumerate().skip(1);
            terms.map(|(j, p)| (p.conj() * Complex64::cis(TAU * j as f64 * x)).re).sum::<f64>()
        };
        let fine = 8 * count;
        let first = (0..fine).map(|k| k as f64 / fine as f64).max_by(|a, b| value(*a).total_cmp(&value(*b)));
        let (mut x, mut h) = (first.unwrap_or(0.0), 0.5 / fine as f64);
        for _ in 0..8 {
            let (left, middle, right) = (value(x - h), value(x), value(x + h));
            let bend = left - 2.0 * middle + right;
            if bend < 0.0 {
                x += h * (0.5 * (left - right) / bend).clamp(-2.0, 2.0);
            }
            h *= 0.5;
        }
        x
    }
}
