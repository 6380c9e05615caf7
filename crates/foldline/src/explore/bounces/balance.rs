//! The balance of harmonics at the local coordinates.
//!
//! **Equations.** With e = Re Σ e_k e^{ikwt}, k = 0 … K, and g_k the harmonics of the local forces,
//!
//! ```text
//!   (1)  e_k - H(ikw) g_k = 0,   w unknown
//!   (2)  Re Σ conj(i k e_k) δe_k = 0                      steps are orthogonal to a shift in time
//!   (3)  δg_k = Σ_l ε/2 [(C_{k-l} + C_{k+l}) Re δe_l + i (C_{k-l} - C_{k+l}) Im δe_l],   C_m = ⟨∂g/∂e e^{-imwt}⟩
//! ```
//!
//! with ε = 2 for k > 0 and 1 for k = 0.
//!
//! **Departures.** Forces are sampled uniformly, also at edges of contact: the result is a start only.

use super::local::Local;
use crate::attractors::Candidate;
use crate::linalg::lu;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Newton's method: steps, and the relative size of the last.
const ROUNDS: usize = 25;
const CONVERGED: f64 = 1e-8;
/// Largest step, relative to the amplitudes, and of the frequency.
const STEP: f64 = 0.4;
const SHIFT: f64 = 0.1;
/// Growth of the share of the local forces in a step.
const GROWTH: f64 = 1.4;
/// Nodes for each harmonic, and their least number.
const NODES: usize = 16;
const FEWEST: usize = 128;
/// Size of the highest quarter of the harmonics, relative to the largest, below which there are enough; and their largest number.
const TAIL: f64 = 1e-5;
const HIGHEST: usize = 64;
/// Samples of the motion: first meshes have one interval for 12 of them.
const SAMPLES: usize = 12 * 240;

/// Harmonics and frequency of a motion.
#[derive(Clone, Debug)]
pub(super) struct Balance {
    /// `[s][K + 1]`.
    e: Vec<Complex64>,
    k: usize,
    w: f64,
    /// Share of the local forces that act.
    share: f64,
    sizes: Vec<f64>,
}

/// Harmonics 0 … `count` of uniform samples of a real signal, x = Re Σ x_k e^{ikθ}.
pub(super) fn harmonics(x: &[f64], count: usize) -> Vec<Complex64> {
    let mut all: Vec<Complex64> = x.iter().map(|x| Complex64::new(*x, 0.0)).collect();
    foldline_general::fourier(&mut all);
    let scale = |k: usize| if k == 0 { 1.0 } else { 2.0 } / x.len() as f64;
    (0..=count).map(|k| all[k] * scale(k)).collect()
}

impl Balance {
    /// A motion of two lines.
    pub(super) fn of_lines(
        local: &Local,
        k: usize,
        orders: [usize; 2],
        lines: &[Vec<Complex64>; 2],
        w: f64,
    ) -> Balance {
        let s = local.coordinates();
        let mut e = vec![Complex64::default(); s * (k + 1)];
        for (order, line) in orders.iter().zip(lines) {
            line.iter().enumerate().for_each(|(c, z)| e[c * (k + 1) + order] += z);
        }
        Balance { e, k, w, share: 1.0, sizes: (0..s).map(|c| local.size(c)).collect() }
    }

    /// This motion as a start with a share of the local forces.
    pub(super) fn with_share(self, share: f64) -> Balance {
        Balance { share, ..self }
    }

    /// True if all of the local forces act.
    pub(super) fn is_whole(&self) -> bool {
        self.share == 1.0
    }

    /// The motion to which a solution leads as the local forces grow to their size; `None` if it does not last so long.
    pub(super) fn grown(mut self, local: &Local) -> Option<Balance> {
        while !self.is_whole() {
            let share = (GROWTH * self.share).min(1.0);
            self = self.with_share(share).solved(local)?;
        }
        Some(self)
    }

    /// Size of a harmonic.
    fn line(&self, k: usize) -> f64 {
        let of = |(c, size): (usize, &f64)| (self.e[c * (self.k + 1) + k] / size).norm_sqr();
        self.sizes.iter().enumerate().map(of).sum::<f64>().sqrt()
    }

    fn largest(&self) -> f64 {
        (1..=self.k).map(|k| self.line(k)).fold(0.0, f64::max)
    }

    /// Greatest common divisor of the orders of all lines that are present: the motion repeats itself so often in a period.
    pub(super) fn divisor(&self) -> usize {
        const PRESENT: f64 = 1e-4;
        let largest = self.largest();
        let present = (1..=self.k).filter(|k| self.line(*k) > PRESENT * largest);
        present.fold(0, |a, b| {
            let (mut a, mut b) = (a, b);
            while b != 0 {
                (a, b) = (b, a % b);
            }
            a
        })
    }

    /// True if two motions have the same frequency and the same lines, up to a shift in time.
    pub(super) fn same(&self, other: &Balance) -> bool {
        // Samples of a ring at other phases change a motion of few harmonics that much.
        const NEAR: [f64; 2] = [2e-3, 2e-2];
        let size = self.largest();
        let lines = (0..=self.k.min(other.k)).all(|k| (self.line(k) - other.line(k)).abs() < NEAR[1] * size);
        self.share == other.share && (self.w / other.w - 1.0).abs() < NEAR[0] && lines
    }

    /// Newton's method on (1); `None` unless it converges to a motion.
    pub(super) fn solved(mut self, local: &Local) -> Option<Balance> {
        for _ in 0..ROUNDS {
            let (de, dw) = self.step(local)?;
            let largest = self.largest();
            let step = Balance { e: de, ..self.clone() };
            let moved = (step.largest().max(step.line(0)) / largest).max((dw / self.w).abs());
            if !moved.is_finite() {
                return None;
            }
            let share = (STEP / moved).min(SHIFT * self.w / dw.abs()).min(1.0);
            self.e.iter_mut().zip(&step.e).for_each(|(e, d)| *e -= share * d);
            self.w -= share * dw;
            if moved < CONVERGED {
                return (self.w > 0.0 && self.largest() > 0.0).then_some(self);
            }
        }
        None
    }

    /// This motion with as many harmonics as it needs, or can be solved with.
    pub(super) fn refined(&self, local: &Local) -> Balance {
        let mut own = self.clone();
        while own.k < HIGHEST && own.tail() > TAIL {
            let k = (2 * own.k).min(HIGHEST);
            let mut e = vec![Complex64::default(); own.sizes.len() * (k + 1)];
            for (to, from) in e.chunks_exact_mut(k + 1).zip(own.e.chunks_exact(own.k + 1)) {
                to[..=own.k].copy_from_slice(from);
            }
            match (Balance { e, k, ..own.clone() }).solved(local) {
                Some(finer) => own = finer,
                None => break,
            }
        }
        own
    }

    fn tail(&self) -> f64 {
        (3 * self.k / 4..=self.k).map(|k| self.line(k)).fold(0.0, f64::max) / self.largest()
    }

    fn nodes(&self) -> usize {
        (NODES * self.k).next_power_of_two().max(FEWEST)
    }

    /// e `[s × nodes]`.
    fn samples(&self, nodes: usize) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.sizes.len() * nodes);
        for e in self.e.chunks_exact(self.k + 1) {
            let mut all = vec![Complex64::default(); nodes];
            // The transform has the sign of e^{-ikθ}.
            all[..=self.k].iter_mut().zip(e).for_each(|(to, e)| *to = e.conj());
            foldline_general::fourier(&mut all);
            out.extend(all.iter().map(|z| z.re));
        }
        out
    }

    /// Newton's step, to be subtracted.
    fn step(&self, local: &Local) -> Option<(Vec<Complex64>, f64)> {
        let (s, r, k_max, nodes) = (local.coordinates(), local.forces(), self.k, self.nodes());
        let each = 2 * k_max + 1;
        let size = s * each + 1;
        let e = self.samples(nodes);
        let force: Vec<Vec<Complex64>> =
            local.force(&e, nodes).chunks_exact(nodes).map(|x| harmonics(x, k_max)).collect();
        let force: Vec<Vec<Complex64>> = force.iter().map(|own| own.iter().map(|g| self.share * g).collect()).collect();
        // C_m, m = -2K … 2K, for each coordinate and force.
        let slopes: Vec<Vec<Complex64>> = local
            .slopes(&e, nodes)
            .iter()
            .flat_map(|own| own.chunks_exact(nodes).map(|x| halves(x, self.share, 2 * k_max)).collect::<Vec<_>>())
            .collect();
        let place = |c: usize, k: usize| c * each + if k == 0 { 0 } else { 2 * k - 1 };
        let (mut matrix, mut right) = (vec![0.0; size * size], vec![0.0; size]);
        for k in 0..=k_max {
            let h = local.flexibility(Complex64::i() * (k as f64 * self.w));
            for c in 0..s {
                let own = &h[c * r..(c + 1) * r];
                let answer: Complex64 = (0..r).map(|f| own[f][0] * force[f][k]).sum();
                let slope: Complex64 = (0..r).map(|f| own[f][1] * Complex64::i() * k as f64 * force[f][k]).sum();
                let off = self.e[c * (k_max + 1) + k] - answer;
                let mut put = |column: usize, value: Complex64| {
                    matrix[place(c, k) * size + column] += value.re / self.sizes[c];
                    if k > 0 {
                        matrix[(place(c, k) + 1) * size + column] += value.im / self.sizes[c];
                    }
                };
                for (d, l) in (0..s).flat_map(|d| (0..=k_max).map(move |l| (d, l))) {
                    let scale = if k == 0 { 0.5 } else { 1.0 } * self.sizes[d];
                    let (mut cosine, mut sine) = (Complex64::default(), Complex64::default());
                    for (f, h) in own.iter().enumerate() {
                        let c = &slopes[d * r + f];
                        let [minus, plus] = [c[2 * k_max + k - l], c[2 * k_max + k + l]];
                        cosine += h[0] * (minus + plus);
                        sine += h[0] * Complex64::i() * (minus - plus);
                    }
                    put(place(d, l), -scale * cosine);
                    if l > 0 {
                        put(place(d, l) + 1, -scale * sine);
                    }
                }
                put(place(c, k), Complex64::new(self.sizes[c], 0.0));
                if k > 0 {
                    put(place(c, k) + 1, Complex64::new(0.0, self.sizes[c]));
                }
                put(size - 1, -slope * self.w);
                right[place(c, k)] = off.re / self.sizes[c];
                if k > 0 {
                    right[place(c, k) + 1] = off.im / self.sizes[c];
                    let own = self.e[c * (k_max + 1) + k] * (Complex64::i() * k as f64 / self.sizes[c]);
                    matrix[(size - 1) * size + place(c, k)] = own.re;
                    matrix[(size - 1) * size + place(c, k) + 1] = own.im;
                }
            }
        }
        let mut pivots = vec![0; size];
        lu::factorise_even(&mut matrix, size, &mut pivots).ok()?;
        lu::solve(&matrix, size, &pivots, &mut right, 1);
        let mut step = vec![Complex64::default(); self.e.len()];
        for (c, k) in (0..s).flat_map(|c| (0..=k_max).map(move |k| (c, k))) {
            let imaginary = if k > 0 { right[place(c, k) + 1] } else { 0.0 };
            step[c * (k_max + 1) + k] = Complex64::new(right[place(c, k)], imaginary) * self.sizes[c];
        }
        Some((step, right[size - 1] * self.w))
    }

    /// The motion of all states over one period.
    pub(super) fn motion(&self, local: &Local) -> Candidate {
        let (n, nodes) = (local.origin().len(), self.nodes());
        let e = self.samples(nodes);
        let force: Vec<Vec<Complex64>> =
            local.force(&e, nodes).chunks_exact(nodes).map(|x| harmonics(x, self.k)).collect();
        let amplitudes: Vec<Vec<Complex64>> = (0..=self.k)
            .map(|k| {
                let forces: Vec<Complex64> = force.iter().map(|own| own[k]).collect();
                local.answer(Complex64::i() * (k as f64 * self.w), &forces)
            })
            .collect();
        let mut states = vec![0.0; (SAMPLES + 1) * n];
        for i in 0..n {
            let mut all = vec![Complex64::default(); SAMPLES];
            amplitudes.iter().zip(&mut all).for_each(|(own, to)| *to = own[i].conj());
            foldline_general::fourier(&mut all);
            (0..=SAMPLES).for_each(|t| states[t * n + i] = local.origin()[i] + all[t % SAMPLES].re);
        }
        let period = TAU / self.w;
        let times = (0..=SAMPLES).map(|t| period * t as f64 / SAMPLES as f64).collect();
        Candidate::Cycle { period, times, states }
    }
}

/// C_m = ⟨x e^{-imθ}⟩ times a factor, for m = -`count` … `count`.
fn halves(x: &[f64], factor: f64, count: usize) -> Vec<Complex64> {
    let factor = factor / x.len() as f64;
    let mut all: Vec<Complex64> = x.iter().map(|x| Complex64::new(factor * x, 0.0)).collect();
    foldline_general::fourier(&mut all);
    (-(count as i64)..=count as i64).map(|m| all[m.rem_euclid(all.len() as i64) as usize]).collect()
}
