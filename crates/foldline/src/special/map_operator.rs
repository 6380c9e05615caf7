//! The linearised map along a cycle, with a multiplier imposed.
//!
//! **Equations.** With A_k = f_x along the cycle x_0 … x_{N-1} and a number κ, all vectors complex:
//!
//! ```text
//!   (1)  (L y)_k = A_k y_k - y_{k+1},   k < N-1;      (L y)_{N-1} = A_{N-1} y_{N-1} - κ y_0
//!   (2)  [ L   b ] [ v ]   [ 0 ]        [ Lᴴ  c ] [ w ]   [ 0 ]
//!        [ cᴴ  0 ] [ g ] = [ 1 ]        [ bᴴ  0 ] [ h ] = [ 1 ]
//! ```
//!
//! g = 0 if κ is a multiplier. Then v_0 is an eigenvector of D = A_{N-1} ⋯ A_0, D v_0 = κ v_0, v_k its image at x_k, and
//! w_{N-1} one of Dᴴ. All is computed in units of the scales of the states.
//!
//! **Source.** govaerts2000, §3.

use crate::contract::{Batch, Parameters};
use crate::linalg::cyclic::{Cyclic, Parts};
use crate::linalg::max_abs;
use crate::problem::{Setting, map};
use num_complex::Complex64;

/// Complex vectors `[N][n]` along a cycle.
pub(super) type Course = Vec<Complex64>;

/// A cycle with the linearised map, in scaled states.
pub(super) struct Orbit<'s, 'a> {
    pub(super) setting: &'s Setting<'a>,
    pub(super) n: usize,
    /// `[n][N]` states.
    states: Vec<f64>,
    pub(super) parameters: Vec<f64>,
    /// `[N][n × n]` A_k in units of the scales.
    blocks: Vec<f64>,
}

/// Solutions of (2).
pub(super) struct Null {
    pub(super) v: Course,
    pub(super) w: Course,
    pub(super) g: Complex64,
}

/// b and c of (2), in units of the scales.
#[derive(Clone)]
pub(super) struct Borders {
    pub(super) left: Course,
    pub(super) right: Course,
}

impl Borders {
    /// Borders without structure, which will do unless they are orthogonal to a null vector.
    pub(super) fn generic(size: usize) -> Borders {
        let left = |k: usize| Complex64::new(0.4 + (k as f64 * 1.3).sin(), 0.3 * (k as f64 * 0.7).sin());
        let right = |k: usize| Complex64::new(0.5 + (k as f64 * 1.7).cos(), 0.3 * (k as f64 * 0.9).cos());
        Borders { left: (0..size).map(left).collect(), right: (0..size).map(right).collect() }
    }

    /// Borders from null vectors; `None` if these are not finite.
    pub(super) fn of(null: &Null) -> Option<Borders> {
        let unit = |x: &Course| {
            let norm = x.iter().map(|z| z.norm_sqr()).sum::<f64>().sqrt();
            (norm.is_finite() && norm > 0.0).then(|| x.iter().map(|z| z / norm).collect::<Course>())
        };
        Some(Borders { left: unit(&null.w)?, right: unit(&null.v)? })
    }
}

impl<'s, 'a> Orbit<'s, 'a> {
    /// Linearises along iterates `[N][n]`.
    pub(super) fn new(setting: &'s Setting<'a>, iterates: &[f64], parameters: &[f64]) -> Orbit<'s, 'a> {
        let (n, scales) = (setting.field.dim(), setting.scales);
        let fixed = Setting { axes: Vec::new(), ..setting.clone() };
        let found = map::along(&fixed, iterates, parameters);
        let entry = |(c, a): (usize, &f64)| a * scales[c % n] / scales[c / n % n];
        Orbit {
            setting,
            n,
            states: map::transposed(iterates, n),
            parameters: parameters.to_vec(),
            blocks: found.blocks.iter().enumerate().map(entry).collect(),
        }
    }

    /// N.
    pub(super) fn count(&self) -> usize {
        self.states.len() / self.n.max(1)
    }

    /// Factors of (1), bordered as in (2) if borders are given, as a real system of twice the size.
    fn system(&self, kappa: Complex64, borders: Option<&Borders>) -> Option<Cyclic> {
        let (n, count) = (self.n, self.count());
        let (wide, q) = (2 * n, if borders.is_some() { 2 } else { 0 });
        let mut blocks = vec![0.0; count * wide * wide];
        for k in 0..count {
            for c in 0..n * n {
                let (i, j, a) = (c / n, c % n, self.blocks[k * n * n + c]);
                blocks[k * wide * wide + i * wide + j] = a;
                blocks[k * wide * wide + (n + i) * wide + n + j] = a;
            }
        }
        let mut closure = vec![0.0; wide * wide];
        for i in 0..n {
            (closure[i * wide + i], closure[(n + i) * wide + n + i]) = (kappa.re, kappa.re);
            (closure[i * wide + n + i], closure[(n + i) * wide + i]) = (-kappa.im, kappa.im);
        }
        let size = count * wide + q;
        let (mut columns, mut border) = (vec![0.0; count * wide * q], vec![0.0; q * size]);
        if let Some(Borders { left, right }) = borders {
            for k in 0..count {
                for i in 0..n {
                    let (b, c) = (left[k * n + i], right[k * n + i]);
                    let (re, im) = (k * wide + i, k * wide + n + i);
                    (columns[re * 2], columns[re * 2 + 1]) = (b.re, -b.im);
                    (columns[im * 2], columns[im * 2 + 1]) = (b.im, b.re);
                    (border[re], border[im]) = (c.re, c.im);
                    (border[size + re], border[size + im]) = (-c.im, c.re);
                }
            }
        }
        let parts = Parts { shape: [wide, q], blocks: &blocks, closure: &closure, columns: &columns, border: &border };
        Cyclic::new(parts).ok()
    }

    /// Solution of (2).
    pub(super) fn null(&self, kappa: Complex64, borders: &Borders) -> Option<Null> {
        let system = self.system(kappa, Some(borders))?;
        let size = 2 * self.n * self.count();
        let mut one = vec![0.0; size + 2];
        one[size] = 1.0;
        let (v, w) = (system.solve(&one), system.solve_transposed(&one));
        if !(max_abs(&v).is_finite() && max_abs(&w).is_finite()) {
            return None;
        }
        Some(Null { v: self.complex(&v), w: self.complex(&w), g: Complex64::new(v[size], v[size + 1]) })
    }

    /// Solution y of y_{k+1} = A_k y_k + s_k with y_N = κ y_0; with borders, of the bordered system, so that κ may be a
    /// multiplier.
    pub(super) fn solved(&self, kappa: Complex64, s: &[Complex64], borders: Option<&Borders>) -> Option<Course> {
        let system = self.system(kappa, borders)?;
        let (n, count) = (self.n, self.count());
        let mut rhs = vec![0.0; 2 * n * count + if borders.is_some() { 2 } else { 0 }];
        for (c, z) in s.iter().enumerate() {
            let at = c / n * 2 * n + c % n;
            (rhs[at], rhs[at + n]) = (-z.re, -z.im);
        }
        let y = system.solve(&rhs);
        max_abs(&y).is_finite().then(|| self.complex(&y))
    }

    fn complex(&self, both: &[f64]) -> Course {
        let n = self.n;
        let entry = |c: usize| Complex64::new(both[c / n * 2 * n + c % n], both[c / n * 2 * n + n + c % n]);
        (0..n * self.count()).map(entry).collect()
    }

    /// Multilinear derivative of f along real directions `[N][n]` in units of the scales, with a change of the parameters
    /// in the last one if it is given.
    pub(super) fn derivative(&self, along: &[&[f64]], parameters: Option<&[f64]>) -> Vec<f64> {
        let last = along.len().saturating_sub(1);
        let both: Vec<_> = along.iter().enumerate().map(|(d, own)| (*own, parameters.filter(|_| d == last))).collect();
        self.derivative_in_all(&both)
    }

    /// Multilinear derivative of f along real directions in states and, if given, parameters.
    pub(super) fn derivative_in_all(&self, along: &[(&[f64], Option<&[f64]>)]) -> Vec<f64> {
        let (n, lanes, scales) = (self.n, self.count(), self.setting.scales);
        let known = self.parameters.len();
        let full: Vec<Vec<f64>> = along
            .iter()
            .map(|(own, moves)| {
                let states = (0..n * lanes).map(|c| own[(c % lanes) * n + c / lanes] * scales[c / lanes]);
                let rest = (0..known * lanes).map(|c| moves.map_or(0.0, |p| p[c / lanes]));
                states.chain(rest).collect()
            })
            .collect();
        let directions: Vec<&[f64]> = full.iter().map(Vec::as_slice).collect();
        let parameters = Parameters::Shared(&self.parameters);
        let batch = Batch { lanes, states: &self.states, parameters, times: &[], signs: &[] };
        let mut out = vec![0.0; n * lanes];
        self.setting.field.directional(batch, &directions, &mut out);
        (0..n * lanes).map(|c| out[(c % n) * lanes + c / n] / scales[c % n]).collect()
    }

    /// Multilinear derivative of f along complex directions: the sum over all choices of a real or an imaginary part.
    pub(super) fn multilinear(&self, along: &[&[Complex64]]) -> Course {
        let parts: Vec<[Vec<f64>; 2]> =
            along.iter().map(|d| [d.iter().map(|z| z.re).collect(), d.iter().map(|z| z.im).collect()]).collect();
        let mut out = vec![Complex64::ZERO; self.n * self.count()];
        for choice in 0..1usize << along.len() {
            let chosen: Vec<&[f64]> = parts.iter().enumerate().map(|(k, both)| &both[choice >> k & 1][..]).collect();
            if chosen.iter().any(|d| max_abs(d) == 0.0) {
                continue;
            }
            let unit = Complex64::i().powu(choice.count_ones());
            out.iter_mut().zip(self.derivative(&chosen, None)).for_each(|(z, d)| *z += unit * d);
        }
        out
    }
}

/// Σ w̄ s.
pub(super) fn hermitian(w: &[Complex64], s: &[Complex64]) -> Complex64 {
    w.iter().zip(s).map(|(w, s)| w.conj() * s).sum()
}
