//! Phase shifts that bring a cycle close to another one.
//!
//! **Idea.** A branch may return to a cycle in any phase. Shifts θ that minimise the distance between two profiles are
//! sought: first among equally spaced ones, then as zeros of the phase condition (1), whose slope is close to that of
//! two equal profiles. There can be several: a cycle of three nearly equal turns is close to itself a third of its
//! period later.
//!
//! **Equations.** With weights w at the Gauss points t of the mesh of x:
//!
//!   (1)  g(θ) = Σ w ⟨y(t + θ) - x(t), x'(t)⟩ = 0,   g' ≈ Σ w ⟨x'(t), x'(t)⟩

use super::CycleProblem;
use crate::contract::ZeroProblem;
use crate::diagram::{Cycle, Point, Solution, Symmetry};

/// Number of equally spaced shifts at which two profiles are compared.
const PLACES: usize = 480;
/// Maximum number of Newton steps or bisections for (1).
const ROUNDS: usize = 60;
/// Shift that counts as none.
const FINEST: f64 = 1e-14;

impl CycleProblem<'_> {
    /// Phase-shifted copies of a point; see [`crate::contract::ZeroProblem::images`].
    pub(super) fn in_phase(
        &self,
        beside: &[f64],
        point: &Point,
        symmetry: &Symmetry,
        within: f64,
    ) -> Vec<[Vec<f64>; 2]> {
        let Solution::Cycle(cycle) = &point.solution else { return Vec::new() };
        let (size, whole) = (self.profile_size(), cycle.profile.len());
        if cycle.degree != self.scheme.degree || point.tangent.len() + size != whole + beside.len() {
            return Vec::new();
        }
        let mirrored = |profile: &[f64], gain: &[f64]| -> Cycle {
            let (mut profile, mut gain) = (profile.to_vec(), gain.to_vec());
            symmetry.apply(&mut profile);
            symmetry.apply(&mut gain);
            Cycle { profile, gain, ..cycle.clone() }
        };
        let states = mirrored(&cycle.profile, &cycle.gain);
        let tangent = mirrored(&point.tangent[..whole], &[]);
        if states.gain != self.gain {
            return Vec::new();
        }
        let period = if self.is_forced() { f64::from(self.forcing_periods) } else { cycle.period };
        let scalars = [&[period][..], &self.setting.unknowns_of(point)].concat();
        let close = |u: &Vec<f64>| {
            let off: Vec<f64> = u.iter().zip(beside).map(|(a, b)| a - b).collect();
            self.dot(&off, &off) <= within * within
        };
        // The distance of the scalars is the same in every phase.
        let apart = [&vec![0.0; size][..], &scalars].concat();
        let there = [&vec![0.0; size][..], &beside[size..]].concat();
        let off: Vec<f64> = apart.iter().zip(&there).map(|(a, b)| a - b).collect();
        let room = within * within - self.dot(&off, &off);
        if room < 0.0 {
            return Vec::new();
        }
        if self.apart_in_any_phase(&beside[..size], &states) > room {
            return Vec::new();
        }
        let images = self.shifts(&beside[..size], &states, room.sqrt()).into_iter().map(|shift| {
            let mut u = [&self.moved(&states, shift)[..], &scalars].concat();
            self.setting.nearest_copy(&mut u[..size], &beside[..self.n]);
            self.settle(&mut u);
            [u, [&self.moved(&tangent, shift)[..], &point.tangent[whole..]].concat()]
        });
        images.filter(|[u, _]| close(u)).collect()
    }

    /// Lower bound of the squared distance of two profiles in any phase, from the differences of their means and of
    /// their standard deviations. The first profile is on the mesh of this problem.
    fn apart_in_any_phase(&self, x: &[f64], y: &Cycle) -> f64 {
        let moments = |profile: &[f64], mesh: &[f64]| -> Vec<[f64; 2]> {
            let mut sums = vec![[0.0; 2]; self.n];
            for (block, ends) in profile.chunks_exact(self.block()).zip(mesh.windows(2)) {
                for (b, node) in self.scheme.weights.iter().zip(block[self.n..].chunks_exact(self.n)) {
                    let weight = (ends[1] - ends[0]) * b;
                    for (sum, v) in sums.iter_mut().zip(node) {
                        *sum = [sum[0] + weight * v, sum[1] + weight * v * v];
                    }
                }
            }
            sums.into_iter().map(|[mean, square]| [mean, (square - mean * mean).max(0.0).sqrt()]).collect()
        };
        let pairs = moments(x, &self.mesh).into_iter().zip(moments(&y.profile, &y.mesh));
        let off = |(a, b): ([f64; 2], [f64; 2])| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
        // Means of angles depend on the copy.
        let angle = |c: usize| self.setting.period(c).is_some();
        let off = |(c, (pair, scale)): (usize, (_, &f64))| if angle(c) { 0.0 } else { off(pair) / (scale * scale) };
        pairs.zip(&self.scale).enumerate().map(off).sum::<f64>() / self.n as f64
    }

    /// The profile of `y`, shifted by θ, on the mesh of this problem.
    fn moved(&self, y: &Cycle, shift: f64) -> Vec<f64> {
        let mut out = vec![0.0; self.profile_size()];
        for (j, block) in out.chunks_exact_mut(self.block()).enumerate() {
            for (node, to) in self.scheme.nodes.iter().zip(block.chunks_exact_mut(self.n)) {
                y.state_into(&self.scheme, self.mesh[j] + node * self.h(j) + shift, to);
            }
        }
        out
    }

    /// All shifts θ at which the distance has a local minimum that may be as small as `within`.
    fn shifts(&self, x: &[f64], y: &Cycle, within: f64) -> Vec<f64> {
        let n = self.n;
        let periods = self.forcing_periods as usize;
        let here = Cycle { mesh: self.mesh.clone(), profile: x.to_vec(), ..y.clone() };
        // A shifted forced cycle is a solution only if the shift is a whole number of forcing periods.
        let places = if self.is_forced() { (PLACES / periods).max(8) * periods } else { PLACES };
        let stride = if self.is_forced() { places / periods } else { 1 };
        let scaled = |cycle: &Cycle| -> Vec<f64> {
            cycle.uniform(places).iter().zip(self.scale.iter().cycle()).map(|(v, scale)| v / scale).collect()
        };
        let (a, b) = (scaled(&here), scaled(y));
        let periods: Vec<f64> =
            (0..n).map(|c| self.setting.period(c).unwrap_or(f64::INFINITY) / self.scale[c]).collect();
        let plain = periods.iter().all(|period| period.is_infinite());
        let between = |a: &[f64], b: &[f64]| match plain {
            true => a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>(),
            false => a.iter().zip(b).zip(periods.iter().cycle()).map(|((a, b), p)| nearest(a - b, *p).powi(2)).sum(),
        };
        let apart = |k: usize| {
            let (before, after) = a.split_at((places - k) * n);
            between(before, &b[k * n..]) + between(after, &b[..k * n])
        };
        // Largest change of the distance over one shift.
        let moves = (between(&b[n..], &b[..(places - 1) * n]) + between(&b[..n], &b[(places - 1) * n..])).sqrt();
        let limit = 1.1 * within * ((places * n) as f64).sqrt() + if self.is_forced() { 0.0 } else { moves };
        let count = places / stride;
        let mut all = vec![f64::INFINITY; count];
        let mut k = 0;
        while k < count {
            all[k] = apart(k * stride).sqrt();
            // Shifts that cannot be within the limit are skipped: a distance far above it covers those that follow.
            let clear = if self.is_forced() { 0.0 } else { (all[k] - limit) / moves.max(f64::MIN_POSITIVE) };
            k += (clear as usize).max(1);
        }
        let lowest =
            |k: &usize| all[*k] <= limit && all[*k] <= all[(k + 1) % count] && all[*k] <= all[(k + count - 1) % count];
        let about = (0..count).filter(lowest).map(|k| k as f64 / count as f64);
        about
            .map(|about| if self.is_forced() { about } else { self.exactly(x, y, about, 1.0 / count as f64) })
            .collect()
    }

    /// The zero of (1) no farther than `width` from `about`.
    fn exactly(&self, x: &[f64], y: &Cycle, about: f64, width: f64) -> f64 {
        let (mut low, mut high, mut shift) = (about - width, about + width, about);
        let mut before: Option<(f64, f64)> = None;
        for _ in 0..ROUNDS {
            let (g, mut slope) = self.out_of_phase(x, y, shift);
            // The slope is that of equal profiles; a secant is more accurate.
            let secant = before.map_or(f64::NAN, |(there, value)| (g - value) / (shift - there));
            if secant > 0.2 * slope && secant < 5.0 * slope {
                slope = secant;
            }
            before = Some((shift, g));
            if g > 0.0 {
                high = shift
            } else {
                low = shift
            }
            let step = -g / slope;
            if step.abs() < FINEST {
                break;
            }
            shift = if shift + step > low && shift + step < high { shift + step } else { 0.5 * (low + high) };
        }
        shift
    }

    /// (1) and its slope for equal profiles.
    fn out_of_phase(&self, x: &[f64], y: &Cycle, shift: f64) -> (f64, f64) {
        let (n, m) = (self.n, self.scheme.degree);
        let (mut g, mut slope, mut other) = (0.0, 0.0, vec![0.0; n]);
        for (j, block) in x.chunks_exact(self.block()).enumerate() {
            let h = self.h(j);
            for i in 1..=m {
                y.state_into(&self.scheme, self.mesh[j] + self.scheme.nodes[i] * h + shift, &mut other);
                let row = &self.scheme.derivative[(i - 1) * (m + 1)..i * (m + 1)];
                for c in 0..n {
                    let rate = row.iter().zip(block[c..].iter().step_by(n)).map(|(d, v)| d * v).sum::<f64>() / h;
                    let weight = self.scheme.weights[i - 1] * h / self.scale[c].powi(2);
                    let off = other[c] - block[i * n + c];
                    let off = self.setting.period(c).map_or(off, |period| nearest(off, period));
                    g += weight * off * rate;
                    slope += weight * rate * rate;
                }
            }
        }
        (g, slope)
    }
}

/// Difference of two angles, reduced to the nearest copies.
fn nearest(off: f64, period: f64) -> f64 {
    if period.is_finite() { off - period * (off / period).round() } else { off }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Definition, Model, ModelSource, Parameter, State};
    use crate::problem::gauss::Scheme;
    use crate::problem::{Axis, Setting, mesh};

    fn field() -> Model {
        Model::compile(ModelSource {
            name: "two".into(),
            parameters: vec![Parameter::new("p", 1.0)],
            states: vec![State::new("x"), State::new("y")],
            equations: vec![Definition::new("x", "p*y"), Definition::new("y", "-x")],
            ..ModelSource::default()
        })
        .unwrap()
    }

    /// (sin τ + sin 3τ / 2, cos τ) at τ = 2π (t + phase), on a mesh.
    fn cycle(intervals: usize, phase: f64) -> Cycle {
        let scheme = Scheme::new(4);
        let times = (0..intervals)
            .flat_map(|j| scheme.nodes.iter().map(move |c| (j as f64 + c) / intervals as f64).collect::<Vec<_>>());
        let turned = times.map(|t| std::f64::consts::TAU * (t + phase));
        let profile = turned.flat_map(|a| [a.sin() + 0.5 * (3.0 * a).sin(), a.cos()]).collect();
        Cycle {
            points: crate::problem::gauss::Points::Gauss,
            period: 2.0,
            forcing_periods: 0,
            mesh: mesh::uniform(intervals),
            degree: 4,
            profile,
            gain: Vec::new(),
        }
    }

    #[test]
    fn a_cycle_of_nearly_equal_turns_has_one_image_per_turn() {
        // Three turns that differ by a thousandth.
        let field = field();
        let scales = [1.0, 1.0];
        let setting = Setting { field: &field, scales: &scales, parameters: vec![1.0], axes: vec![Axis::new(0, 1.0)] };
        let times = (0..90)
            .flat_map(|j| Scheme::new(4).nodes.into_iter().map(move |c| std::f64::consts::TAU * (j as f64 + c) / 90.0));
        let profile = times.flat_map(|a| [(3.0 * a).sin() + 1e-3 * a.sin(), (3.0 * a).cos()]).collect();
        let turns = Cycle {
            points: crate::problem::gauss::Points::Gauss,
            period: 2.0,
            forcing_periods: 0,
            mesh: mesh::uniform(90),
            degree: 4,
            profile,
            gain: Vec::new(),
        };
        let mut problem = CycleProblem::like(setting, &turns);
        let beside: Vec<f64> = turns.profile.iter().copied().chain([2.0, 1.0]).collect();
        problem.anchor(&beside);
        let point = problem.point(&beside, &beside, Default::default());
        assert_eq!(problem.in_phase(&beside, &point, &Symmetry::identity(), 1e-2).len(), 3);
        assert_eq!(problem.in_phase(&beside, &point, &Symmetry::identity(), 1e-5).len(), 1);
    }

    #[test]
    fn images_have_the_phase_and_the_symmetry_of_the_other_cycle() {
        let model = field();
        let scales = [1.0, 1.0];
        let setting = Setting { field: &model, scales: &scales, parameters: vec![1.0], axes: vec![Axis::new(0, 1.0)] };
        let (here, there) = (cycle(60, 0.0), cycle(84, 0.3137));
        let mut problem = CycleProblem::like(setting, &here);
        let beside: Vec<f64> = here.profile.iter().copied().chain([2.0, 1.0]).collect();
        problem.anchor(&beside);
        // The profile itself serves as tangent, so that its shift can be checked.
        let tangent: Vec<f64> = there.profile.iter().copied().chain([0.5, 0.25]).collect();
        let mut point = problem.point(&beside, &tangent, Default::default());
        for reflected in [false, true] {
            let sign = if reflected { -1.0 } else { 1.0 };
            let profile = there.profile.iter().map(|v| sign * v).collect();
            point.solution = Solution::Cycle(Cycle { profile, ..there.clone() });
            let images = problem.in_phase(&beside, &point, &Symmetry::reflection(&[reflected; 2]), 1e-3);
            let [[u, along]] = &images[..] else { panic!("{} images", images.len()) };
            assert_eq!((u.len(), &along[along.len() - 2..]), (beside.len(), &[0.5, 0.25][..]));
            let off = u.iter().zip(&beside).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
            // Interpolation error of sin 3τ with polynomials of degree 4 on 60 intervals.
            assert!(off < 1e-5, "{off:e}");
            let off =
                along.iter().zip(&beside[..here.profile.len()]).fold(0.0f64, |m, (a, b)| m.max((a - sign * b).abs()));
            assert!(off < 1e-5, "{off:e}");
        }
    }
}
