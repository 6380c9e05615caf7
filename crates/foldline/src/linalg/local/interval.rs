//! One interval of [`super`] in modal coordinates.

use super::modes::Modes;
use crate::contract::Singular;
use crate::linalg::lu;
use num_complex::Complex64;

/// Weights of collocation.
#[derive(Clone, Copy, Debug)]
pub struct Weights<'a> {
    /// `[m × m]`: integration matrix a.
    pub integration: &'a [f64],
    /// `[m + 1]`: extrapolation to the right end, e.
    pub end: &'a [f64],
}

/// Modes and local forces, the same for all intervals.
#[derive(Clone, Debug)]
pub struct Common {
    /// Modes of the linear part.
    pub modes: Modes,
    /// Number of forces, r, and of local coordinates, s.
    pub forces: usize,
    /// See above.
    pub coordinates: usize,
    /// `[modes][r]`: forces on the modes, p₁ + i p₂.
    pub pushed: Vec<Complex64>,
    /// `[modes][s]`: local coordinates are Σ Re(ē z).
    pub seen: Vec<Complex64>,
}

/// A condensed interval.
#[derive(Clone, Debug)]
pub struct Interval {
    /// h T.
    pub step: f64,
    /// `[modes][m × m]`: (1 - h T μ a)⁻¹.
    inverse: Vec<Complex64>,
    /// `[modes][m]`: the same times (1, …, 1).
    carried: Vec<Complex64>,
    /// `[modes]`: transition of a mode without local forces.
    pub free: Vec<Complex64>,
    /// Local forces, if any.
    local: Option<Local>,
}

#[derive(Clone, Debug)]
struct Local {
    /// `[m][r × s]`: derivatives of the forces.
    slopes: Vec<f64>,
    /// `[m r × m r]`, factorised: (2) of [`super`].
    matrix: Vec<f64>,
    pivots: Vec<usize>,
    /// `[m r][n]` each: G = G_0 + U W.
    u: Vec<f64>,
    w: Vec<f64>,
}

impl Interval {
    /// Condenses an interval of duration `step`; `slopes` `[m][r × s]` are derivatives of the local forces.
    ///
    /// # Errors
    /// [`Singular`] if the matrix of the interval is.
    pub fn new(common: &Common, scheme: Weights, step: f64, slopes: &[f64]) -> Result<Interval, Singular> {
        let m = scheme.end.len() - 1;
        let count = common.modes.list.len();
        let mut inverse = vec![Complex64::ZERO; count * m * m];
        let mut carried = vec![Complex64::ZERO; count * m];
        let mut free = vec![Complex64::ZERO; count];
        for (b, mode) in common.modes.list.iter().enumerate() {
            let own = &mut inverse[b * m * m..(b + 1) * m * m];
            invert(scheme.integration, step * mode.rate, own, m)?;
            for i in 0..m {
                carried[b * m + i] = own[i * m..(i + 1) * m].iter().sum();
            }
            free[b] = scheme.end[0] + (0..m).map(|i| scheme.end[i + 1] * carried[b * m + i]).sum::<Complex64>();
        }
        let mut interval = Interval { step, inverse, carried, free, local: None };
        if slopes.iter().any(|c| *c != 0.0) {
            interval.local = Some(interval.coupled(common, scheme, slopes)?);
        }
        Ok(interval)
    }

    /// Local forces: matrix (2) and the factors of the transition.
    fn coupled(&self, common: &Common, scheme: Weights, slopes: &[f64]) -> Result<Local, Singular> {
        let (m, r, s) = (scheme.end.len() - 1, common.forces, common.coordinates);
        let size = m * r;
        let n: usize = common.modes.list.iter().map(|mode| mode.size).sum();
        // [s m × r m]: response of the local coordinates to the forces at the nodes.
        let mut response = vec![0.0; m * s * size];
        let mut u = vec![0.0; size * n];
        let mut seen = vec![0.0; m * s * n];
        let mut q = vec![Complex64::ZERO; m * m];
        for (b, mode) in common.modes.list.iter().enumerate() {
            let own = &self.inverse[b * m * m..(b + 1) * m * m];
            for i in 0..m {
                for k in 0..m {
                    q[i * m + k] =
                        self.step * (0..m).map(|l| own[i * m + l] * scheme.integration[l * m + k]).sum::<Complex64>();
                }
            }
            for f in 0..r {
                let push = common.pushed[b * r + f];
                for k in 0..m {
                    let mut end = Complex64::ZERO;
                    for i in 0..m {
                        let z = q[i * m + k] * push;
                        end += scheme.end[i + 1] * z;
                        for c in 0..s {
                            let e = common.seen[b * s + c];
                            response[(i * s + c) * size + k * r + f] += e.re * z.re + e.im * z.im;
                        }
                    }
                    put(&mut u[(k * r + f) * n..], mode.at, mode.size, end);
                }
            }
            for i in 0..m {
                for c in 0..s {
                    // Re(ē ρ z) = Re(conj(e ρ̄) z).
                    let own = common.seen[b * s + c] * self.carried[b * m + i].conj();
                    put(&mut seen[(i * s + c) * n..], mode.at, mode.size, own);
                }
            }
        }
        // (2): 1 - c W, and c times what the left end contributes.
        let mut matrix = vec![0.0; size * size];
        let mut w = vec![0.0; size * n];
        for i in 0..m {
            for f in 0..r {
                let row = i * r + f;
                matrix[row * size + row] += 1.0;
                for c in 0..s {
                    let slope = slopes[(i * r + f) * s + c];
                    if slope == 0.0 {
                        continue;
                    }
                    let from = &response[(i * s + c) * size..(i * s + c + 1) * size];
                    matrix[row * size..(row + 1) * size].iter_mut().zip(from).for_each(|(x, v)| *x -= slope * v);
                    let from = &seen[(i * s + c) * n..(i * s + c + 1) * n];
                    w[row * n..(row + 1) * n].iter_mut().zip(from).for_each(|(x, v)| *x += slope * v);
                }
            }
        }
        let mut pivots = vec![0; size];
        lu::factorise(&mut matrix, size, &mut pivots)?;
        lu::solve(&matrix, size, &pivots, &mut w, n);
        Ok(Local { slopes: slopes.to_vec(), matrix, pivots, u, w })
    }

    /// Solves with the matrix of the interval: `x` `[modes][m]` in place.
    pub fn solve(&self, common: &Common, scheme: Weights, x: &mut [Complex64]) {
        let m = scheme.end.len() - 1;
        let (r, s) = (common.forces, common.coordinates);
        self.apply(x, m);
        let Some(local) = &self.local else { return };
        let mut coordinates = vec![0.0; m * s];
        for (b, own) in x.chunks_exact(m).enumerate() {
            for c in 0..s {
                let e = common.seen[b * s + c];
                (0..m).for_each(|i| coordinates[i * s + c] += e.re * own[i].re + e.im * own[i].im);
            }
        }
        let mut forces: Vec<f64> =
            (0..m * r).map(|k| (0..s).map(|c| local.slopes[k * s + c] * coordinates[k / r * s + c]).sum()).collect();
        lu::solve(&local.matrix, m * r, &local.pivots, &mut forces, 1);
        let integrated = self.integrated(scheme, &forces, r);
        let mut push = vec![Complex64::ZERO; m];
        for (b, own) in x.chunks_exact_mut(m).enumerate() {
            for (i, push) in push.iter_mut().enumerate() {
                *push = (0..r).map(|f| common.pushed[b * r + f] * integrated[i * r + f]).sum();
            }
            let inverse = &self.inverse[b * m * m..(b + 1) * m * m];
            for i in 0..m {
                own[i] += (0..m).map(|k| inverse[i * m + k] * push[k]).sum::<Complex64>();
            }
        }
    }

    /// Solves with the transposed matrix: `x` `[modes][m]` in place.
    pub fn solve_transposed(&self, common: &Common, scheme: Weights, x: &mut [Complex64]) {
        let m = scheme.end.len() - 1;
        let (r, s) = (common.forces, common.coordinates);
        self.apply_adjoint(x, m);
        let Some(local) = &self.local else { return };
        let mut pushed = vec![0.0; m * r];
        for (b, own) in x.chunks_exact(m).enumerate() {
            for f in 0..r {
                let p = common.pushed[b * r + f];
                (0..m).for_each(|i| pushed[i * r + f] += p.re * own[i].re + p.im * own[i].im);
            }
        }
        let mut forces: Vec<f64> = (0..m * r)
            .map(|k| self.step * (0..m).map(|i| scheme.integration[i * m + k / r] * pushed[i * r + k % r]).sum::<f64>())
            .collect();
        lu::solve_transposed(&local.matrix, m * r, &local.pivots, &mut forces);
        let mut coordinates = vec![0.0; m * s];
        for k in 0..m * r {
            (0..s).for_each(|c| coordinates[k / r * s + c] += local.slopes[k * s + c] * forces[k]);
        }
        let mut more = vec![Complex64::ZERO; m];
        for (b, own) in x.chunks_exact_mut(m).enumerate() {
            for (i, more) in more.iter_mut().enumerate() {
                *more = (0..s).map(|c| common.seen[b * s + c] * coordinates[i * s + c]).sum();
            }
            let inverse = &self.inverse[b * m * m..(b + 1) * m * m];
            for i in 0..m {
                own[i] += (0..m).map(|k| inverse[k * m + i].conj() * more[k]).sum::<Complex64>();
            }
        }
    }

    /// h T a times forces `[m][r]`.
    fn integrated(&self, scheme: Weights, forces: &[f64], r: usize) -> Vec<f64> {
        let m = forces.len() / r;
        (0..m * r)
            .map(|k| self.step * (0..m).map(|l| scheme.integration[k / r * m + l] * forces[l * r + k % r]).sum::<f64>())
            .collect()
    }

    fn apply(&self, x: &mut [Complex64], m: usize) {
        let mut own = [Complex64::ZERO; 16];
        for (x, inverse) in x.chunks_exact_mut(m).zip(self.inverse.chunks_exact(m * m)) {
            own[..m].copy_from_slice(x);
            for i in 0..m {
                x[i] = (0..m).map(|k| inverse[i * m + k] * own[k]).sum();
            }
        }
    }

    fn apply_adjoint(&self, x: &mut [Complex64], m: usize) {
        let mut own = [Complex64::ZERO; 16];
        for (x, inverse) in x.chunks_exact_mut(m).zip(self.inverse.chunks_exact(m * m)) {
            own[..m].copy_from_slice(x);
            for i in 0..m {
                x[i] = (0..m).map(|k| inverse[k * m + i].conj() * own[k]).sum();
            }
        }
    }

    /// x = G x for `columns` columns, row-major `[n × columns]`.
    pub fn carry(&self, common: &Common, x: &mut [f64], columns: usize) {
        let mut forces = Vec::new();
        if let Some(local) = &self.local {
            let n = x.len() / columns;
            forces = vec![0.0; local.pivots.len() * columns];
            let size = local.pivots.len();
            crate::linalg::dense::multiply((&mut forces, columns), (&local.w, n), (x, columns), [size, n, columns]);
        }
        for (b, mode) in common.modes.list.iter().enumerate() {
            turn(&mut x[mode.at * columns..(mode.at + mode.size) * columns], self.free[b], columns);
        }
        if let Some(local) = &self.local {
            let n = x.len() / columns;
            for (u, forces) in local.u.chunks_exact(n).zip(forces.chunks_exact(columns)) {
                for (u, x) in u.iter().zip(x.chunks_exact_mut(columns)) {
                    x.iter_mut().zip(forces).for_each(|(x, f)| *x += u * f);
                }
            }
        }
    }

    /// x = Gᵀ x, `[n]`.
    pub fn carry_back(&self, common: &Common, x: &mut [f64]) {
        let n = x.len();
        let forces: Vec<f64> = match &self.local {
            Some(local) => local.u.chunks_exact(n).map(|u| crate::linalg::dot(u, x)).collect(),
            None => Vec::new(),
        };
        for (b, mode) in common.modes.list.iter().enumerate() {
            turn(&mut x[mode.at..mode.at + mode.size], self.free[b].conj(), 1);
        }
        if let Some(local) = &self.local {
            local.w.chunks_exact(n).zip(&forces).for_each(|(w, f)| crate::linalg::axpy(*f, w, x));
        }
    }

    /// log |det G|.
    pub fn log_determinant(&self, common: &Common) -> f64 {
        let modes = || common.modes.list.iter().enumerate();
        let alone: f64 = modes().map(|(b, mode)| mode.size as f64 * self.free[b].norm().ln()).sum();
        let Some(local) = &self.local else { return alone };
        // det (1 + W G_0⁻¹ U).
        let size = local.pivots.len();
        let n = local.u.len() / size;
        let mut matrix = vec![0.0; size * size];
        let mut own = vec![0.0; n];
        for k in 0..size {
            own.copy_from_slice(&local.u[k * n..(k + 1) * n]);
            for (b, mode) in modes() {
                turn(&mut own[mode.at..mode.at + mode.size], 1.0 / self.free[b], 1);
            }
            for i in 0..size {
                let unit = f64::from(u8::from(i == k));
                matrix[i * size + k] = unit + crate::linalg::dot(&local.w[i * n..(i + 1) * n], &own);
            }
        }
        let mut pivots = vec![0; size];
        if lu::factorise(&mut matrix, size, &mut pivots).is_err() {
            return f64::NEG_INFINITY;
        }
        alone + (0..size).map(|i| matrix[i * size + i].abs().ln()).sum::<f64>()
    }

    /// Y = A⁻¹ (1 ⊗ y): `[modes][m]` from the left end `[n]`.
    pub fn inside(&self, common: &Common, scheme: Weights, y: &[f64], to: &mut [Complex64]) {
        let m = scheme.end.len() - 1;
        for (mode, to) in common.modes.list.iter().zip(to.chunks_exact_mut(m)) {
            to.fill(take(y, mode.at, mode.size));
        }
        self.solve(common, scheme, to);
    }
}

/// Reads a mode.
#[inline(always)]
pub fn take(y: &[f64], at: usize, size: usize) -> Complex64 {
    Complex64::new(y[at], if size == 2 { y[at + 1] } else { 0.0 })
}

/// Writes a mode.
#[inline(always)]
pub fn put(y: &mut [f64], at: usize, size: usize, z: Complex64) {
    y[at] = z.re;
    if size == 2 {
        y[at + 1] = z.im;
    }
}

/// Multiplies the rows of a mode by g.
fn turn(rows: &mut [f64], g: Complex64, columns: usize) {
    if rows.len() == columns {
        rows.iter_mut().for_each(|x| *x *= g.re);
        return;
    }
    let (first, second) = rows.split_at_mut(columns);
    for (a, b) in first.iter_mut().zip(second) {
        (*a, *b) = (g.re * *a - g.im * *b, g.re * *b + g.im * *a);
    }
}

/// (1 - z a)⁻¹ for a real m×m matrix a.
fn invert(a: &[f64], z: Complex64, to: &mut [Complex64], m: usize) -> Result<(), Singular> {
    let mut own = [Complex64::ZERO; 144];
    for k in 0..m * m {
        let unit = Complex64::from(f64::from(u8::from(k % (m + 1) == 0)));
        (own[k], to[k]) = (unit - z * a[k], unit);
    }
    for c in 0..m {
        let pivot = (c..m).max_by(|i, k| own[i * m + c].norm_sqr().total_cmp(&own[k * m + c].norm_sqr())).unwrap_or(c);
        for k in 0..m {
            own.swap(c * m + k, pivot * m + k);
            to.swap(c * m + k, pivot * m + k);
        }
        let inverse = own[c * m + c].inv();
        if !inverse.is_finite() {
            return Err(Singular);
        }
        for k in 0..m {
            own[c * m + k] *= inverse;
            to[c * m + k] *= inverse;
        }
        for i in (0..m).filter(|i| *i != c) {
            let factor = own[i * m + c];
            for k in 0..m {
                let (x, y) = (own[c * m + k], to[c * m + k]);
                own[i * m + k] -= factor * x;
                to[i * m + k] -= factor * y;
            }
        }
    }
    Ok(())
}
