//! Bifurcation points continued in two parameters.
//!
//! **Idea.** Solutions with two free parameters form a surface; the defining condition of the bifurcation selects a
//! curve on it. The surface keeps its own block solver: two solutions span its tangent plane, and a system of a few
//! scalar equations remains.
//!
//! **Equations.** u = (σ, w): extra unknowns σ `[e]` of the condition, then w of the surface with both parameters last;
//! the second of them is the continuation parameter.
//!
//! ```text
//!   (1)  F(w) = 0,   g(w, σ) = 0                                e + 1 equations more than the surface has
//!   (2)  F_w τ_i = 0, i = 1, 2:   w = w_p + a₁ τ₁ + a₂ τ₂      w_p solves F_w w_p = r_F
//!   (3)  [ g_w τ₁   g_w τ₂   g_σ ] [ a ]     [ r_g - g_w w_p  ]
//!        [ ⟨c, τ₁⟩  ⟨c, τ₂⟩  c_σ ] [ σ ]  =  [ r_c - ⟨c, w_p⟩ ]
//! ```
//!
//! Where branches cross, the surface has one more unknown (`equilibrium`), three vectors τ span it, and there is one
//! more equation.
//!
//! **Source.** govaerts2000, §4 (bordered extended systems); the elimination (2), (3) is ours.
//!
//! **Fails when** the surface itself is singular (two bifurcation curves cross).

use crate::contract::{Condition, Examination, Singular, ZeroProblem};
use crate::diagram::{Kind, Mesh, Point, Symmetry};
use crate::linalg::{axpy, lu};
use num_complex::Complex64;

/// An eigenvalue next to the critical one coalesces with it if it is closer than this many times the error of the
/// latter.
const MEETING: f64 = 10.0;

/// A surface of solutions together with the condition of a bifurcation.
pub struct Held<'a> {
    surface: Box<dyn ZeroProblem + 'a>,
    condition: Box<dyn Condition + 'a>,
    /// Dimension of the surface.
    freedom: usize,
    /// Rows that fix the position on the surface, and the tangents τ found with them, each `[freedom][surface
    /// unknowns]`.
    rows: Vec<f64>,
    tangents: Vec<f64>,
    /// Size of the extra unknowns.
    scale: Vec<f64>,
    /// c of the last factorisation; below, the factors and pivots of (3).
    row: Vec<f64>,
    small: Vec<f64>,
    pivots: Vec<usize>,
    /// Point of the last evaluation of g, and its value; `None` if the borders have changed since.
    known: Option<(Vec<f64>, Vec<f64>)>,
    /// Points to which the null vectors and the tangents belong; empty if there are none.
    nulls_at: Vec<f64>,
    tangents_at: Vec<f64>,
    adapted: bool,
}

impl<'a> Held<'a> {
    /// Bifurcations that `condition` defines on a surface with `freedom` free unknowns: parameters, and the amplitude of an
    /// unfolding. Both must be on the same mesh. With two parameters they form a curve; with more, see
    /// [`Held::directions`].
    pub fn new(surface: Box<dyn ZeroProblem + 'a>, condition: Box<dyn Condition + 'a>, freedom: usize) -> Held<'a> {
        let (scale, rows) = (vec![1.0; condition.extra()], generic(freedom * surface.unknowns()));
        Held {
            surface,
            condition,
            freedom,
            rows,
            tangents: Vec::new(),
            scale,
            row: Vec::new(),
            small: Vec::new(),
            pivots: Vec::new(),
            known: None,
            nulls_at: Vec::new(),
            tangents_at: Vec::new(),
            adapted: false,
        }
    }

    /// Adapts rows and borders to the point. The initial ones are arbitrary, and every round replaces them by better
    /// ones.
    fn adapt(&mut self, u: &[f64]) {
        const ROUNDS: usize = 4;
        if std::mem::replace(&mut self.adapted, true) {
            return;
        }
        for _ in 0..ROUNDS {
            if self.surface.factorise(&u[self.extra()..], &self.rows).is_ok() {
                self.span(u);
                self.follow_plane();
            }
            if self.evaluate(u, &mut vec![0.0; self.condition.equations()]) {
                self.condition.anchor();
            }
        }
    }

    /// Computes the τ from the last factorisation of the surface, which is one at `u`.
    fn span(&mut self, u: &[f64]) {
        let (size, k) = (self.surface.unknowns(), self.freedom());
        self.tangents = vec![0.0; k * size];
        for (i, tangent) in self.tangents.chunks_exact_mut(size).enumerate() {
            let mut one = vec![0.0; size];
            one[size - k + i] = 1.0;
            self.surface.solve(&one, tangent);
        }
        self.tangents_at = u.to_vec();
    }

    /// True if vectors found at `place` can serve as references at `u`. Those of an iterate that has diverged cannot:
    /// with such borders g is so strongly nonlinear that the next step fails too.
    fn serves(&self, place: &[f64], u: &[f64]) -> bool {
        const NEAR: f64 = 1e-5;
        place.len() == u.len() && {
            let off: Vec<f64> = u.iter().zip(place).map(|(a, b)| a - b).collect();
            self.relative_size(&off, u) < NEAR
        }
    }

    /// Evaluates g with the current borders.
    fn evaluate(&mut self, u: &[f64], g: &mut [f64]) -> bool {
        let e = self.extra();
        let finite = self.condition.evaluate(&u[e..], &u[..e], g);
        self.nulls_at = if finite { u.to_vec() } else { Vec::new() };
        finite
    }

    /// Evaluates g at `u`, unless it is known there.
    fn condition_at(&mut self, u: &[f64], g: &mut [f64]) -> bool {
        self.adapt(u);
        if let Some((at, value)) = &self.known
            && at == u
        {
            g.copy_from_slice(value);
            return true;
        }
        let finite = self.evaluate(u, g);
        self.known = finite.then(|| (u.to_vec(), g.to_vec()));
        finite
    }

    fn extra(&self) -> usize {
        self.condition.extra()
    }

    /// Dimension of the surface.
    fn freedom(&self) -> usize {
        self.freedom
    }

    /// Directions in which the bifurcation moves at the solution `u` if one of the last `count` parameters λ_i changes by
    /// 1 and the others of these stay: `[count][unknowns]`. With the tangents of (2) for all parameters,
    ///
    /// ```text
    ///   (4)  [ g_w τ₁ … g_w τ_k   g_σ ] [ a ]   [ 0   ]
    ///        [ λ_i(τ₁) … λ_i(τ_k)  0  ] [ σ ] = [ e_i ],      direction i = (σ, Σ a_j τ_j)
    /// ```
    ///
    /// # Errors
    /// [`Singular`] where the bifurcation does not persist, or the surface is singular.
    pub fn directions(&mut self, u: &[f64], count: usize) -> Result<Vec<Vec<f64>>, Singular> {
        let (e, size, k) = (self.extra(), self.surface.unknowns(), self.freedom());
        let (width, equations) = (e + k, self.condition.equations());
        if equations + count != width {
            return Err(Singular);
        }
        let mut g = vec![0.0; equations];
        if !self.condition_at(u, &mut g) {
            return Err(Singular);
        }
        self.surface.factorise(&u[e..], &self.rows)?;
        self.span(u);
        let mut small = vec![0.0; width * width];
        for (i, tangent) in self.tangents.chunks_exact(size).enumerate() {
            self.condition.derivative(tangent, &vec![0.0; e], &mut g);
            (0..equations).for_each(|line| small[line * width + i] = g[line]);
            (0..count).for_each(|c| small[(equations + c) * width + i] = tangent[size - count + c]);
        }
        for i in 0..e {
            let mut turn = vec![0.0; e];
            turn[i] = 1.0;
            self.condition.derivative(&vec![0.0; size], &turn, &mut g);
            (0..equations).for_each(|line| small[line * width + k + i] = g[line]);
        }
        let mut pivots = vec![0; width];
        lu::factorise(&mut small, width, &mut pivots)?;
        let direction = |c: usize| {
            let mut a = vec![0.0; width];
            a[equations + c] = 1.0;
            lu::solve(&small, width, &pivots, &mut a, 1);
            let mut out = [&a[k..], &vec![0.0; size][..]].concat();
            for (share, tangent) in a[..k].iter().zip(self.tangents.chunks_exact(size)) {
                axpy(*share, tangent, &mut out[e..]);
            }
            out
        };
        let found: Vec<Vec<f64>> = (0..count).map(direction).collect();
        if found.iter().flatten().all(|x| x.is_finite()) { Ok(found) } else { Err(Singular) }
    }

    /// Number of extra unknowns of the condition, which come first.
    pub fn extras(&self) -> usize {
        self.extra()
    }

    /// Examination of the surface with the critical eigenvalues at their exact values; `u` includes the extra unknowns.
    fn with_held(&self, u: &[f64], mut found: Examination) -> Examination {
        // Critical eigenvalues count as neither stable nor unstable.
        let (first, is_cycle) = (found.trivial, self.surface.has_multipliers());
        let mut others = found.spectrum.split_off(first.min(found.spectrum.len()));
        let held = self.condition.held(&u[..self.extra()]);
        for z in &held {
            let closest = |others: &[Complex64]| {
                (0..others.len()).min_by(|a, b| (others[*a] - z).norm().total_cmp(&(others[*b] - z).norm()))
            };
            let off = closest(&others).map_or(Complex64::ZERO, |k| others.remove(k) - z);
            // The sum of two coalescing eigenvalues is more accurate than either: one takes its exact value, the other
            // the rest of the sum.
            if let ([_], Some(next)) = (&held[..], closest(&others))
                && (others[next] - z).norm() < MEETING * off.norm()
            {
                others[next] += off;
            }
        }
        others.sort_by(|a, b| self.condition.distance(*a).total_cmp(&self.condition.distance(*b)));
        found.unstable = others.iter().filter(|z| if is_cycle { z.norm() > 1.0 } else { z.re > 0.0 }).count();
        // Critical eigenvalues come first, at their exact values; a computed double eigenvalue has half the digits
        // only.
        found.spectrum.extend(held.into_iter().chain(others));
        found
    }

    /// Replaces the rows by orthonormal vectors that span the last tangent plane.
    fn follow_plane(&mut self) {
        let (size, k) = (self.surface.unknowns(), self.freedom());
        if self.tangents.len() != k * size {
            return;
        }
        let mut rows = self.tangents.clone();
        for i in 0..k {
            let (done, rest) = rows.split_at_mut(i * size);
            let own = &mut rest[..size];
            for other in done.chunks_exact(size) {
                let along = self.surface.dot(other, own);
                axpy(-along, other, own);
            }
            let norm = self.surface.dot(own, own).sqrt();
            own.iter_mut().for_each(|x| *x /= norm);
        }
        if rows.iter().all(|x| x.is_finite()) {
            self.rows = rows;
        }
    }
}

/// Numbers without any structure that vary smoothly along a profile.
fn generic(count: usize) -> Vec<f64> {
    (0..count).map(|k| 0.6 + (k as f64 * 0.0113).sin() + 0.7 * (k as f64 * 1.37).cos()).collect()
}

impl ZeroProblem for Held<'_> {
    fn unknowns(&self) -> usize {
        self.extra() + self.surface.unknowns()
    }

    fn unit(&self) -> f64 {
        self.surface.unit()
    }

    fn anchor(&mut self, u: &[f64]) {
        let e = self.extra();
        self.surface.anchor(&u[e..]);
        if !self.adapted
            || self.serves(&self.nulls_at, u)
            || self.evaluate(u, &mut vec![0.0; self.condition.equations()])
        {
            self.condition.anchor();
        }
        if self.row.len() == self.unknowns() {
            self.condition.face(&self.row[e..]);
        }
        self.known = None;
        if self.serves(&self.tangents_at, u) {
            self.follow_plane();
        }
        let own = self.condition.extra_scale().max(f64::MIN_POSITIVE);
        self.scale.iter_mut().zip(u).for_each(|(s, v)| *s = own + v.abs());
    }

    fn residual(&mut self, u: &[f64], r: &mut [f64]) -> bool {
        let (e, size, k) = (self.extra(), self.surface.unknowns(), self.freedom());
        self.surface.residual(&u[e..], &mut r[..size]) && self.condition_at(u, &mut r[size - k..size + e - 1])
    }

    fn obstacle(&self, u: &[f64]) -> Option<&'static str> {
        let (extra, rest) = u.split_at(self.extra());
        self.surface.obstacle(rest).or_else(|| self.condition.obstacle(extra))
    }

    fn factorise(&mut self, u: &[f64], row: &[f64]) -> Result<(), Singular> {
        let (e, size, k) = (self.extra(), self.surface.unknowns(), self.freedom());
        let width = e + k;
        let mut g = vec![0.0; width - 1];
        if !self.condition_at(u, &mut g) {
            return Err(Singular);
        }
        self.surface.factorise(&u[e..], &self.rows)?;
        self.span(u);
        self.small = vec![0.0; width * width];
        for (i, tangent) in self.tangents.chunks_exact(size).enumerate() {
            self.condition.derivative(tangent, &vec![0.0; e], &mut g);
            (0..width - 1).for_each(|line| self.small[line * width + i] = g[line]);
            self.small[(width - 1) * width + i] = self.surface.dot(&row[e..], tangent);
        }
        for i in 0..e {
            let mut turn = vec![0.0; e];
            turn[i] = 1.0;
            self.condition.derivative(&vec![0.0; size], &turn, &mut g);
            (0..width - 1).for_each(|line| self.small[line * width + k + i] = g[line]);
            self.small[(width - 1) * width + k + i] = row[i] / (self.scale[i] * self.scale[i]);
        }
        self.row = row.to_vec();
        self.pivots = vec![0; width];
        lu::factorise(&mut self.small, width, &mut self.pivots)
    }

    fn solve(&mut self, rhs: &[f64], x: &mut [f64]) {
        let (e, size, k) = (self.extra(), self.surface.unknowns(), self.freedom());
        let width = e + k;
        let mut own = rhs[..size].to_vec();
        own[size - k..].fill(0.0);
        let mut particular = vec![0.0; size];
        self.surface.solve(&own, &mut particular);
        let mut tail = vec![0.0; width];
        self.condition.derivative(&particular, &vec![0.0; e], &mut tail[..width - 1]);
        (0..width - 1).for_each(|line| tail[line] = rhs[size - k + line] - tail[line]);
        tail[width - 1] = rhs[size + e - 1] - self.surface.dot(&self.row[e..], &particular);
        lu::solve(&self.small, width, &self.pivots, &mut tail, 1);
        x[..e].copy_from_slice(&tail[k..]);
        x[e..].copy_from_slice(&particular);
        for (a, tangent) in tail[..k].iter().zip(self.tangents.chunks_exact(size)) {
            x[e..].iter_mut().zip(tangent).for_each(|(x, t)| *x += a * t);
        }
    }

    fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        let e = self.extra();
        let extra: f64 = (0..e).map(|i| a[i] * b[i] / (self.scale[i] * self.scale[i])).sum();
        extra + self.surface.dot(&a[e..], &b[e..])
    }

    fn relative_size(&self, du: &[f64], u: &[f64]) -> f64 {
        let e = self.extra();
        let own = self.condition.extra_scale().max(f64::MIN_POSITIVE);
        let extra = (0..e).map(|i| (du[i] / (own + u[i].abs())).abs());
        extra.fold(self.surface.relative_size(&du[e..], &u[e..]), |m, x| if x > m || x.is_nan() { x } else { m })
    }

    fn mesh(&self) -> Mesh {
        self.surface.mesh()
    }

    fn is_switched(&self) -> bool {
        // Bifurcation curves are located by their own conditions.
        self.condition.kind() == Kind::Mark && self.surface.is_switched()
    }

    fn has_multipliers(&self) -> bool {
        self.surface.has_multipliers()
    }

    fn set_mesh(&mut self, mesh: &Mesh) {
        let from = self.surface.mesh();
        if from == *mesh {
            return;
        }
        let size = self.surface.unknowns();
        let carried: Vec<f64> =
            self.rows.chunks_exact(size).flat_map(|row| self.surface.transfer(row, &from, mesh)).collect();
        self.rows = carried;
        self.tangents.clear();
        self.tangents_at.clear();
        self.nulls_at.clear();
        self.known = None;
        self.surface.set_mesh(mesh);
        self.condition.set_mesh(mesh);
    }

    fn transfer(&self, v: &[f64], from: &Mesh, to: &Mesh) -> Vec<f64> {
        let e = self.extra();
        [&v[..e], &self.surface.transfer(&v[e..], from, to)].concat()
    }

    fn carry(&self, u: &[f64], from: &Mesh, to: &Mesh) -> Vec<f64> {
        let e = self.extra();
        [&u[..e], &self.surface.carry(&u[e..], from, to)].concat()
    }

    fn blended(&self, solutions: &[&[f64]], weights: &[f64]) -> Vec<f64> {
        let e = self.extra();
        let extra = (0..e).map(|k| weights.iter().zip(solutions).map(|(weight, own)| weight * own[k]).sum());
        let own: Vec<&[f64]> = solutions.iter().map(|own| &own[e..]).collect();
        extra.chain(self.surface.blended(&own, weights)).collect()
    }

    fn better_mesh(&self, u: &[f64], tolerance: f64) -> Option<Mesh> {
        self.surface.better_mesh(&u[self.extra()..], tolerance)
    }

    fn coarser_mesh(&self, u: &[f64], tolerance: f64) -> Option<Mesh> {
        self.surface.coarser_mesh(&u[self.extra()..], tolerance)
    }

    fn finer_mesh(&self) -> Option<Mesh> {
        self.surface.finer_mesh()
    }

    fn denser_mesh(&self) -> Option<Mesh> {
        self.surface.denser_mesh()
    }

    fn spectrum_error(&mut self, u: &[f64], tangent: &[f64], spectrum: &[Complex64]) -> f64 {
        self.surface.spectrum_error(&u[self.extra()..], &tangent[self.extra()..], spectrum)
    }

    fn examine(&mut self, u: &[f64]) -> Examination {
        let found = self.surface.examine(&u[self.extra()..]);
        self.with_held(u, found)
    }

    fn stability(&mut self, u: &[f64]) -> Examination {
        let found = self.surface.stability(&u[self.extra()..]);
        self.with_held(u, found)
    }

    fn margin(&self, at: &Point) -> f64 {
        // One multiplier may be critical along the whole curve; only a second one counts.
        let held = if matches!(self.condition.kind(), Kind::Fold | Kind::BranchPoint) { 1 } else { 0 };
        let mut others = at.clone();
        let first = at.spectrum.len() - at.free_spectrum().len();
        others.spectrum[first..].sort_by(|a, b| self.condition.distance(*a).total_cmp(&self.condition.distance(*b)));
        others.spectrum.drain(first..(first + held).min(at.spectrum.len()));
        self.surface.margin(&others)
    }

    /// Directional derivative of g along the null vector, which vanishes at cusps.
    fn arm(&mut self, u: &[f64]) -> Option<f64> {
        let mut g = vec![0.0; self.condition.equations()];
        let along = self.condition_at(u, &mut g).then(|| self.condition.null_direction())??;
        self.condition.derivative(&along, &vec![0.0; self.extra()], &mut g);
        g.first().copied().filter(|value| value.is_finite())
    }

    fn departure(&self, u: &[f64]) -> f64 {
        self.surface.departure(&u[self.extra()..])
    }

    fn point(&self, u: &[f64], tangent: &[f64], examination: Examination) -> Point {
        self.surface.point(&u[self.extra()..], tangent, examination)
    }

    fn images(&mut self, beside: &[f64], point: &Point, symmetry: &Symmetry, within: f64) -> Vec<[Vec<f64>; 2]> {
        let e = self.extra();
        let Some((extra, rest)) = point.tangent.split_at_checked(e) else { return Vec::new() };
        let below = Point { tangent: rest.to_vec(), ..point.clone() };
        let guess = self.condition.guess(point);
        let images = self.surface.images(&beside[e..], &below, symmetry, within);
        images.into_iter().map(|[u, along]| [[&guess[..], &u].concat(), [extra, &along].concat()]).collect()
    }

    fn unknowns_of(&mut self, point: &Point) -> Vec<f64> {
        let mut u = self.condition.guess(point);
        let from = self.surface.mesh();
        u.extend(self.surface.unknowns_of(point));
        // Cycles with events bring the mesh of their flights.
        let mesh = self.surface.mesh();
        if from != mesh {
            self.condition.set_mesh(&mesh);
            self.rows = generic(self.freedom * self.surface.unknowns());
            self.tangents.clear();
            self.tangents_at.clear();
            self.nulls_at.clear();
            (self.known, self.adapted) = (None, false);
        }
        u
    }
}
