//! Fields that are linear except for a few local forces.
//!
//! **Equations.** About an equilibrium x₀,
//!
//! ```text
//!   (1)  f(x₀ + y) = J y + P g(E y)          E selects s coordinates, P has r columns
//!   (2)  y_k = (iω - J)⁻¹ P g_k,   H(iω) = E (iω - J)⁻¹ P
//! ```
//!
//! for a harmonic at the frequency ω; in modes with rates μ, z' = μ z + p g and coordinates Re(ē z),
//!
//! ```text
//!   (3)  H(s) = ½ Σ [ē p / (s - μ) + e p̄ / (s - μ̄)]
//! ```
//!
//! Coordinates and forces are found where f_x varies, at states of many sizes about x₀.

use crate::contract::{Batch, Parameters, VectorField};
use crate::explore::System;
use crate::linalg::local::modes::Modes;
use crate::linalg::{axpy, span::spanned};
use num_complex::Complex64;

/// Largest numbers of coordinates and of forces.
const MOST: usize = 8;
/// Number of states at which f_x is compared, and of those evaluated together.
const STATES: usize = 128;
const FEW: usize = 8;
/// Sizes of these states, in powers of two of the scales.
const SIZES: [f64; 2] = [-4.0, 4.0];

/// (1) at given parameters.
pub(super) struct Local<'a> {
    field: &'a dyn VectorField,
    parameters: &'a [f64],
    /// x₀ and the sizes of all states.
    x0: Vec<f64>,
    sizes: Vec<f64>,
    columns: Vec<usize>,
    /// `[r][n]`: orthonormal in units of the sizes.
    basis: Vec<f64>,
    /// `[s][n]`: columns of J.
    linear: Vec<f64>,
    pub(super) modes: Modes,
    /// `[modes][r]` and `[modes][s]`: p and e of (3).
    pushed: Vec<Complex64>,
    seen: Vec<Complex64>,
}

impl<'a> Local<'a> {
    /// # Errors
    /// A sentence that says why the field does not have this form.
    pub(super) fn of(system: &System<'a>, parameters: &'a [f64], x0: Vec<f64>) -> Result<Local<'a>, String> {
        let (field, sizes) = (system.field, system.scales.clone());
        let n = field.dim();
        let jacobians = |states: &[f64], lanes: usize| {
            let (mut f, mut fx) = (vec![0.0; n * lanes], vec![0.0; n * n * lanes]);
            let at = Batch { lanes, states, parameters: Parameters::Shared(parameters), times: &[], signs: &[] };
            field.linearise(at, &[], &mut f, &mut fx, &mut []);
            fx
        };
        let reference = jacobians(&x0, 1);
        let (mut columns, mut variations) = (Vec::new(), Vec::new());
        for batch in 0..STATES / FEW {
            let fx = jacobians(&around(&x0, &sizes, batch), FEW);
            for (k, lane) in (0..n).flat_map(|k| (0..FEW).map(move |lane| (k, lane))) {
                let change = |i: usize| (fx[(i * n + k) * FEW + lane] - reference[i * n + k]) * sizes[k] / sizes[i];
                if (0..n).all(|i| change(i) == 0.0) {
                    continue;
                }
                if !columns.contains(&k) {
                    columns.push(k);
                }
                variations.push((0..n).map(change).filter(|x| x.is_finite()).collect::<Vec<f64>>());
            }
            if columns.len() > MOST {
                return Err(format!("forces that are not linear depend on more than {MOST} states"));
            }
        }
        variations.retain(|own| own.len() == n);
        columns.sort_unstable();
        let basis = spanned(variations, MOST).ok_or("forces that are not linear act on too many states")?;
        if columns.is_empty() || basis.is_empty() {
            return Err("the model is linear".into());
        }
        let modes = Modes::of(&reference, &sizes).ok_or("the linear modes are nearly dependent")?;
        let linear = columns.iter().flat_map(|k| (0..n).map(|i| reference[i * n + k]).collect::<Vec<f64>>()).collect();
        let (pushed, seen) = (Vec::new(), Vec::new());
        let mut own = Local { field, parameters, x0, sizes, columns, basis, linear, modes, pushed, seen };
        own.project();
        Ok(own)
    }

    /// Evaluates p and e.
    fn project(&mut self) {
        let n = self.sizes.len();
        let pair = |at: usize, size: usize, of: &dyn Fn(usize) -> f64| {
            Complex64::new(of(at), if size == 2 { of(at + 1) } else { 0.0 })
        };
        for mode in &self.modes.list {
            for q in self.basis.chunks_exact(n) {
                let of = |row: usize| (0..n).map(|i| self.modes.to[row * n + i] * self.sizes[i] * q[i]).sum();
                self.pushed.push(pair(mode.at, mode.size, &of));
            }
            for k in &self.columns {
                self.seen.push(pair(mode.at, mode.size, &|c| self.modes.from[k * n + c]));
            }
        }
    }

    /// s.
    pub(super) fn coordinates(&self) -> usize {
        self.columns.len()
    }

    /// r.
    pub(super) fn forces(&self) -> usize {
        self.basis.len() / self.sizes.len()
    }

    /// Size of a coordinate.
    pub(super) fn size(&self, c: usize) -> f64 {
        self.sizes[self.columns[c]]
    }

    /// Shape of a mode at the coordinates, `[s]`: the coordinates of its motion are Re(shape e^{iωt}) with ω > 0, but for
    /// its decay.
    pub(super) fn shape(&self, mode: usize) -> Vec<Complex64> {
        let (s, forward) = (self.coordinates(), self.modes.list[mode].rate.im > 0.0);
        self.seen[mode * s..(mode + 1) * s].iter().map(|e| if forward { e.conj() } else { *e }).collect()
    }

    fn states(&self, e: &[f64], nodes: usize) -> Vec<f64> {
        let mut states: Vec<f64> = self.x0.iter().flat_map(|x| std::iter::repeat_n(*x, nodes)).collect();
        for (c, k) in self.columns.iter().enumerate() {
            axpy(1.0, &e[c * nodes..(c + 1) * nodes], &mut states[k * nodes..(k + 1) * nodes]);
        }
        states
    }

    fn batch<'b>(&'b self, states: &'b [f64], lanes: usize) -> Batch<'b> {
        Batch { lanes, states, parameters: Parameters::Shared(self.parameters), times: &[], signs: &[] }
    }

    /// Components `[r × nodes]` along the forces of values `[n × nodes]`.
    fn along(&self, values: &[f64], nodes: usize) -> Vec<f64> {
        let n = self.sizes.len();
        let mut out = vec![0.0; self.forces() * nodes];
        for (q, to) in self.basis.chunks_exact(n).zip(out.chunks_exact_mut(nodes)) {
            for i in (0..n).filter(|i| q[*i] != 0.0) {
                axpy(q[i] / self.sizes[i], &values[i * nodes..(i + 1) * nodes], to);
            }
        }
        out
    }

    /// g `[r × nodes]` at deviations e `[s × nodes]` from the equilibrium.
    pub(super) fn force(&self, e: &[f64], nodes: usize) -> Vec<f64> {
        let n = self.sizes.len();
        let mut f = vec![0.0; n * nodes];
        self.field.evaluate(self.batch(&self.states(e, nodes), nodes), &mut f);
        for (column, e) in self.linear.chunks_exact(n).zip(e.chunks_exact(nodes)) {
            for i in (0..n).filter(|i| column[*i] != 0.0) {
                axpy(-column[i], e, &mut f[i * nodes..(i + 1) * nodes]);
            }
        }
        self.along(&f, nodes)
    }

    /// ∂g/∂e `[s][r × nodes]`.
    pub(super) fn slopes(&self, e: &[f64], nodes: usize) -> Vec<Vec<f64>> {
        let n = self.sizes.len();
        let states = self.states(e, nodes);
        let slope = |(c, k): (usize, &usize)| {
            let mut direction = vec![0.0; (n + self.parameters.len()) * nodes];
            direction[k * nodes..(k + 1) * nodes].fill(1.0);
            let mut out = vec![0.0; n * nodes];
            self.field.directional(self.batch(&states, nodes), &[&direction], &mut out);
            for (i, row) in out.chunks_exact_mut(nodes).enumerate() {
                row.iter_mut().for_each(|x| *x -= self.linear[c * n + i]);
            }
            self.along(&out, nodes)
        };
        self.columns.iter().enumerate().map(slope).collect()
    }

    /// H `[s × r]` of (3), and its derivative with respect to its argument.
    pub(super) fn flexibility(&self, at: Complex64) -> Vec<[Complex64; 2]> {
        let (s, r) = (self.coordinates(), self.forces());
        let mut out = vec![[Complex64::default(); 2]; s * r];
        for (k, mode) in self.modes.list.iter().enumerate() {
            let poles = [(at - mode.rate).inv(), (at - mode.rate.conj()).inv()].map(|pole| 0.5 * pole);
            for (to, (c, f)) in out.iter_mut().zip((0..s).flat_map(|c| (0..r).map(move |f| (c, f)))) {
                let (e, p) = (self.seen[k * s + c], self.pushed[k * r + f]);
                let parts = [e.conj() * p * poles[0], e * p.conj() * poles[1]];
                to[0] += parts[0] + parts[1];
                to[1] -= 2.0 * (parts[0] * poles[0] + parts[1] * poles[1]);
            }
        }
        out
    }

    /// Amplitude `[n]` of all states for forces `[r]` at a frequency, (2).
    pub(super) fn answer(&self, at: Complex64, forces: &[Complex64]) -> Vec<Complex64> {
        let (n, r) = (self.sizes.len(), self.forces());
        let mut out = vec![Complex64::default(); n];
        for (k, mode) in self.modes.list.iter().enumerate() {
            let push = |turned: bool| -> Complex64 {
                let of = |(p, g): (&Complex64, &Complex64)| if turned { p.conj() * g } else { p * g };
                self.pushed[k * r..(k + 1) * r].iter().zip(forces).map(of).sum()
            };
            let poles = [(at - mode.rate).inv(), (at - mode.rate.conj()).inv()].map(|pole| 0.5 * pole);
            let pair = [push(false) * poles[0], push(true) * poles[1]];
            for (i, to) in out.iter_mut().enumerate() {
                let second = if mode.size == 2 { self.modes.from[i * n + mode.at + 1] } else { 0.0 };
                let e = Complex64::new(self.modes.from[i * n + mode.at], second);
                *to += e.conj() * pair[0] + e * pair[1];
            }
        }
        out
    }

    /// x₀ of a state.
    pub(super) fn origin(&self) -> &[f64] {
        &self.x0
    }
}

/// `FEW` states about x₀, of various sizes.
fn around(x0: &[f64], sizes: &[f64], batch: usize) -> Vec<f64> {
    let n = x0.len();
    let mut out = vec![0.0; n * FEW];
    for lane in 0..FEW {
        // Multiples of irrational numbers are spread evenly.
        let number = (1 + batch * FEW + lane) as f64;
        let size = (SIZES[0] + (SIZES[1] - SIZES[0]) * (number * 0.618_033_988_749_895).fract()).exp2();
        for i in 0..n {
            let share = 2.0 * (number * (2.0 + i as f64).sqrt() + 0.37 * i as f64).fract() - 1.0;
            out[i * FEW + lane] = x0[i] + size * sizes[i] * share;
        }
    }
    out
}
