//! Equilibrium with the derivatives of f and its critical eigenvectors.

use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::{Point, Solution};
use crate::linalg::{dot, lu, max_abs};
use num_complex::Complex64;
use std::cell::RefCell;

/// Shifts off an eigenvalue in inverse iteration, relative to the matrix: above rounding, so that the shifted matrix is
/// regular, and several of them, since one may be unfortunate.
pub const SHIFTS: [f64; 3] = [1e-14, 3.7e-14, 1.3e-13];
/// Overlap of two iterates from which they are the same vector: each iteration multiplies errors by the ratio of two distances
/// from the shift, far below this.
pub const ALIGNED: f64 = 1.0 - 1e-6;

/// |⟨a, b⟩| of two complex vectors, divided by their lengths; real parts come first, then imaginary parts.
pub fn overlap(a: &[f64], b: &[f64]) -> f64 {
    let half = a.len() / 2;
    let ((ar, ai), (br, bi)) = (a.split_at(half), b.split_at(half));
    let (re, im) = (dot(ar, br) + dot(ai, bi), dot(ar, bi) - dot(ai, br));
    // Divided one after the other, since the product can overflow.
    re.hypot(im) / dot(a, a).sqrt() / dot(b, b).sqrt()
}

/// Equilibrium and the derivatives of f there.
pub struct Local<'a> {
    field: &'a dyn VectorField,
    pub(super) state: &'a [f64],
    pub(super) parameters: &'a [f64],
    pub(super) n: usize,
    /// `[n × n]`.
    pub(super) jacobian: Vec<f64>,
    /// `[n]` units in which the states are measured; empty for those of the model.
    units: Vec<f64>,
    /// `[n]` sizes of the states, in terms of which null vectors are computed; empty if they are 1.
    sizes: Vec<f64>,
    /// Null vectors of a nearby point, whose orientation those of this point have.
    near: Option<[Vec<f64>; 2]>,
    noise: Option<Noise>,
}

/// Perturbation of derivatives.
#[derive(Clone)]
struct Noise {
    /// Relative size.
    size: f64,
    /// `[n]` sizes of the states.
    scales: Vec<f64>,
    /// `[n]` largest term of each component of the Jacobian times states of those sizes.
    rates: Vec<f64>,
    signs: RefCell<Signs>,
}

/// Pseudo-random sequence of signs, reproducible from its seed.
#[derive(Clone)]
pub(super) struct Signs(u64);

impl Signs {
    pub(super) fn new(seed: u64) -> Signs {
        Signs(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    /// +1 or -1.
    pub(super) fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        if self.0 >> 32 & 1 == 0 { 1.0 } else { -1.0 }
    }
}

impl<'a> Local<'a> {
    /// Evaluates at a point; `None` if it is a cycle.
    pub fn new(field: &'a dyn VectorField, at: &'a Point) -> Option<Local<'a>> {
        let Solution::Equilibrium(state) = &at.solution else { return None };
        let n = state.len();
        let (mut f, mut jacobian) = (vec![0.0; n], vec![0.0; n * n]);
        let batch =
            Batch { lanes: 1, states: state, parameters: Parameters::Shared(&at.parameters), times: &[], signs: &[] };
        field.linearise(batch, &[], &mut f, &mut jacobian, &mut []);
        Some(Local {
            field,
            state,
            parameters: &at.parameters,
            n,
            jacobian,
            units: Vec::new(),
            sizes: Vec::new(),
            near: None,
            noise: None,
        })
    }

    /// Equilibrium with the states measured in `units` `[n]`.
    pub fn in_units(mut self, units: &[f64]) -> Local<'a> {
        let n = self.n;
        (0..n * n).for_each(|k| self.jacobian[k] *= units[k % n] / units[k / n]);
        self.units = units.to_vec();
        self
    }

    /// Equilibrium with null vectors computed for states of `sizes` `[n]`.
    pub(super) fn with_sizes(mut self, sizes: &[f64]) -> Local<'a> {
        self.sizes = sizes.to_vec();
        self
    }

    /// Equilibrium with null vectors oriented like these, of a nearby point.
    pub(super) fn oriented_like(mut self, near: Option<[Vec<f64>; 2]>) -> Local<'a> {
        self.near = near;
        self
    }

    /// Perturbs the Jacobian and all higher derivatives with random signs. `size` is relative to the largest term of
    /// the same component of f at states of the sizes `scales` `[n]`, which is the rounding error of f there.
    pub(super) fn shaken(mut self, size: f64, scales: &[f64], seed: u64) -> Local<'a> {
        let (n, mut signs) = (self.n, Signs::new(seed));
        let largest = |row: &[f64]| row.iter().zip(scales).fold(0.0f64, |most, (a, s)| most.max((a * s).abs()));
        let rates: Vec<f64> = self.jacobian.chunks_exact(n).map(largest).collect();
        (0..n * n).for_each(|k| self.jacobian[k] += size * rates[k / n] / scales[k % n] * signs.next());
        self.noise = Some(Noise { size, scales: scales.to_vec(), rates, signs: RefCell::new(signs) });
        self
    }

    /// Copy with the transposed Jacobian, for left eigenvectors.
    pub(super) fn transposed(&self) -> Local<'a> {
        let n = self.n;
        let jacobian = (0..n * n).map(|k| self.jacobian[k % n * n + k / n]).collect();
        Local {
            jacobian,
            units: self.units.clone(),
            sizes: self.sizes.iter().map(|size| 1.0 / size).collect(),
            near: None,
            noise: self.noise.clone(),
            ..*self
        }
    }

    /// Derivative of f along directions in the states `[n]`, or in states and parameters `[n + k]`.
    pub(super) fn derivative(&self, along: &[&[f64]]) -> Vec<f64> {
        let size = self.n + self.parameters.len();
        let mut full: Vec<Vec<f64>> =
            along.iter().map(|d| d.iter().copied().chain(std::iter::repeat(0.0)).take(size).collect()).collect();
        for own in &mut full {
            own.iter_mut().zip(&self.units).for_each(|(d, unit)| *d *= unit);
        }
        let full: Vec<&[f64]> = full.iter().map(Vec::as_slice).collect();
        let at = Batch {
            lanes: 1,
            states: self.state,
            parameters: Parameters::Shared(self.parameters),
            times: &[],
            signs: &[],
        };
        let mut out = vec![0.0; self.n];
        self.field.directional(at, &full, &mut out);
        out.iter_mut().zip(&self.units).for_each(|(f, unit)| *f /= unit);
        if let Some(noise) = &self.noise {
            let largest = |d: &&[f64]| d.iter().zip(&noise.scales).fold(0.0f64, |most, (d, s)| most.max((d / s).abs()));
            let reach = along.iter().map(largest).product::<f64>();
            let signs = &mut *noise.signs.borrow_mut();
            for (out, rate) in out.iter_mut().zip(&noise.rates) {
                *out += noise.size * (out.abs() * signs.next() + rate * reach * signs.next());
            }
        }
        out
    }

    /// Derivative of f along complex directions `[n]`: the sum over all choices of a real or an imaginary part for
    /// each.
    pub(super) fn multilinear(&self, along: &[&[Complex64]]) -> Vec<Complex64> {
        let parts: Vec<[Vec<f64>; 2]> =
            along.iter().map(|d| [d.iter().map(|z| z.re).collect(), d.iter().map(|z| z.im).collect()]).collect();
        let mut out = vec![Complex64::new(0.0, 0.0); self.n];
        for choice in 0..1usize << along.len() {
            let chosen: Vec<&[f64]> =
                parts.iter().enumerate().map(|(k, both)| both[choice >> k & 1].as_slice()).collect();
            if chosen.iter().any(|d| max_abs(d) == 0.0) {
                continue;
            }
            let unit = Complex64::i().powu(choice.count_ones());
            out.iter_mut().zip(self.derivative(&chosen)).for_each(|(z, d)| *z += unit * d);
        }
        out
    }

    /// Factors of A - z bordered by the columns `right` and the rows `left` (conjugated), as a real system of twice the
    /// size.
    pub(super) fn shifted(&self, z: Complex64, right: &[&[Complex64]], left: &[&[Complex64]]) -> Option<Shifted> {
        let (n, half) = (self.n, self.n + right.len());
        let size = 2 * half;
        let mut matrix = vec![0.0; size * size];
        let mut put = |i: usize, j: usize, z: Complex64| {
            matrix[i * size + j] += z.re;
            matrix[(half + i) * size + half + j] += z.re;
            matrix[i * size + half + j] -= z.im;
            matrix[(half + i) * size + j] += z.im;
        };
        (0..n * n).for_each(|k| put(k / n, k % n, self.jacobian[k].into()));
        (0..n).for_each(|i| put(i, i, -z));
        for (k, (q, p)) in right.iter().zip(left).enumerate() {
            (0..n).for_each(|i| put(i, n + k, q[i]));
            (0..n).for_each(|i| put(n + k, i, p[i].conj()));
        }
        let mut pivots = vec![0; size];
        lu::factorise(&mut matrix, size, &mut pivots).ok()?;
        Some(Shifted { matrix, pivots, n })
    }

    /// Right and left eigenvectors of the eigenvalue closest to z, with |q| = 1 and ⟨p, q⟩ = 1: A q = z q, pᴴ A = z pᴴ.
    pub(super) fn eigenvectors(&self, z: Complex64) -> Option<[Vec<Complex64>; 2]> {
        let size_of = crate::linalg::size_in_any_units(&self.jacobian, self.n).max(z.norm());
        let out = SHIFTS.into_iter().find_map(|shift| {
            let factors = self.shifted(z + shift * size_of, &[], &[])?;
            let mut out = [const { Vec::new() }; 2];
            for (side, vector) in out.iter_mut().enumerate() {
                *vector = (0..2 * self.n).map(|k| (1.0 + k as f64).sin()).collect();
                let mut aligned = 0.0;
                for _ in 0..3 {
                    let before = vector.clone();
                    match side {
                        0 => lu::solve(&factors.matrix, 2 * self.n, &factors.pivots, vector, 1),
                        _ => lu::solve_transposed(&factors.matrix, 2 * self.n, &factors.pivots, vector),
                    }
                    aligned = overlap(&before, vector);
                    let norm = dot(vector, vector).sqrt();
                    if !(norm.is_finite() && norm > 0.0) {
                        return None;
                    }
                    vector.iter_mut().for_each(|x| *x /= norm);
                }
                if aligned.is_nan() || aligned < ALIGNED {
                    return None;
                }
            }
            Some(out)
        })?;
        let [q, mut p] = out.map(|both| complex(&both));
        let size = hermitian(&p, &q).conj();
        p.iter_mut().for_each(|p| *p /= size);
        Some([q, p])
    }

    /// q and p of a zero eigenvalue, both of unit length.
    pub fn null_vectors(&self) -> Option<[Vec<f64>; 2]> {
        const ROUNDS: usize = 5;
        let generic = |k: f64| (0..self.n).map(|i| 0.6 + (1.0 + k * i as f64).sin()).collect();
        let found =
            (0..ROUNDS).try_fold([generic(1.3), generic(1.9)], |vectors, _| self.null_vectors_near(&vectors))?;
        let Some(near) = &self.near else { return Some(found) };
        // The sizes of q are those of the states, those of p the inverse ones.
        let own = |i: usize| self.sizes.get(i).copied().unwrap_or(1.0);
        let along = |k: usize| -> f64 {
            let weight = |i: usize| if k == 0 { 1.0 / own(i) } else { own(i) };
            (0..self.n).map(|i| (found[k][i] * weight(i)) * (near[k][i] * weight(i))).sum()
        };
        let turned = [0, 1].map(|k| along(k) < 0.0);
        let mut found = found;
        for (vector, _) in found.iter_mut().zip(turned).filter(|(_, turned)| *turned) {
            vector.iter_mut().for_each(|x| *x = -*x);
        }
        Some(found)
    }

    /// Null vectors computed from approximate ones by a bordered system that is regular even at a double eigenvalue 0.
    /// They depend smoothly on the point and keep their orientation.
    pub fn null_vectors_near(&self, [q, p]: &[Vec<f64>; 2]) -> Option<[Vec<f64>; 2]> {
        let (n, size) = (self.n, self.n + 1);
        let own = |i: usize| self.sizes.get(i).copied().unwrap_or(1.0);
        let unit = |mut x: Vec<f64>, factor: &dyn Fn(usize) -> f64| {
            x.truncate(n);
            x.iter_mut().enumerate().for_each(|(i, x)| *x *= factor(i));
            let norm = dot(&x, &x).sqrt();
            x.iter_mut().for_each(|x| *x /= norm);
            x
        };
        let (in_sizes, of_rows) = (|i: usize| 1.0 / own(i), |i: usize| own(i));
        let jacobian: Vec<f64> = (0..n * n).map(|k| self.jacobian[k] * own(k % n) / own(k / n)).collect();
        let (matrix, pivots) = with_borders(&jacobian, &unit(q.clone(), &in_sizes), &unit(p.clone(), &of_rows))?;
        let (mut v, mut w) = (vec![0.0; size], vec![0.0; size]);
        (v[n], w[n]) = (1.0, 1.0);
        lu::solve(&matrix, size, &pivots, &mut v, 1);
        lu::solve_transposed(&matrix, size, &pivots, &mut w);
        Some([unit(v, &of_rows), unit(w, &in_sizes)])
    }

    /// Solves A y = r with ⟨q, y⟩ = 0 if that is solvable, for q and p from [`Local::null_vectors`].
    pub(super) fn bordered(&self, [q, p]: &[Vec<f64>; 2], r: &[f64]) -> Option<Vec<f64>> {
        let (n, size) = (self.n, self.n + 1);
        let (matrix, pivots) = with_borders(&self.jacobian, q, p)?;
        let mut y = [r, &[0.0]].concat();
        lu::solve(&matrix, size, &pivots, &mut y, 1);
        y.truncate(n);
        Some(y)
    }

    /// ⟨p, B(q, q)⟩ of unit vectors with consistent orientation.
    pub fn quadratic(&self, [q, p]: &[Vec<f64>; 2]) -> f64 {
        dot(p, &self.derivative(&[q, q]))
    }
}

/// Factors of A bordered by the column p and the row q.
fn with_borders(a: &[f64], q: &[f64], p: &[f64]) -> Option<(Vec<f64>, Vec<usize>)> {
    let (n, size) = (q.len(), q.len() + 1);
    let mut matrix = vec![0.0; size * size];
    for i in 0..n {
        matrix[i * size..i * size + n].copy_from_slice(&a[i * n..(i + 1) * n]);
        (matrix[i * size + n], matrix[n * size + i]) = (p[i], q[i]);
    }
    let mut pivots = vec![0; size];
    lu::factorise(&mut matrix, size, &mut pivots).ok()?;
    Some((matrix, pivots))
}

/// Factorised A - z, possibly bordered.
pub(super) struct Shifted {
    matrix: Vec<f64>,
    pivots: Vec<usize>,
    n: usize,
}

impl Shifted {
    /// Solution x `[n]` for a right-hand side `[n]` extended by zeros.
    pub(super) fn solve(&self, r: &[Complex64]) -> Vec<Complex64> {
        let half = self.pivots.len() / 2;
        let mut both = vec![0.0; 2 * half];
        r.iter().enumerate().for_each(|(i, z)| (both[i], both[half + i]) = (z.re, z.im));
        lu::solve(&self.matrix, 2 * half, &self.pivots, &mut both, 1);
        let mut x = complex(&both);
        x.truncate(self.n);
        x
    }
}

/// Complex vector from real parts followed by imaginary parts.
fn complex(both: &[f64]) -> Vec<Complex64> {
    let (re, im) = both.split_at(both.len() / 2);
    re.iter().zip(im).map(|(re, im)| Complex64::new(*re, *im)).collect()
}

/// Σ p̄ x.
pub(super) fn hermitian(p: &[Complex64], x: &[Complex64]) -> Complex64 {
    p.iter().zip(x).map(|(p, x)| p.conj() * x).sum()
}
