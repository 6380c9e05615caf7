//! Defining system of branch points of cycles in two parameters.
//!
//! **Idea.** As for equilibria ([`super::on_branch_points`]): where branches over λ cross, the variational equation
//! with a column for λ has two right null vectors and a left one. Bordered by approximations of these it is regular,
//! and its border components vanish exactly at a branch point.
//!
//! **Equations.** In normalised time, f_x along the cycle, λ a direction in the plane of the two parameters:
//!
//! ```text
//!   (1)  L (v, T₁, ℓ) = v' - T f_x v - T₁ f - ℓ T f_λ,   v(1) = v(0),   ∫⟨f, v⟩ = 0
//!
//!   (2)  [ L  d ] [ v_k ]   [ 0   ]                                                   [ 0 … 0  1 ]
//!        [ C  0 ] [ ·   ] = [ e_k ],  k = 1, 2,      (w*  g₁  g₂) [ L  d ]  =
//!                                                                 [ C  0 ]
//!
//!   (3)  dg_k = -w* (dL) v_k
//! ```
//!
//! For forced cycles the period is prescribed, and T₁ and the integral are omitted. A curve along which branches cross
//! is not generic, so the system is posed for f + b d(x), which always has such a curve ([`super::unfolded`]); as long
//! as b stays 0 it is a curve of f.
//!
//! **Source.** doedel2003 (cycles); govaerts2000, §3 (bordered matrices) and §6 (branch points).
//!
//! **Departures.** d, C and λ are updated at every accepted point.

use crate::contract::{Batch, Condition, Parameters};
use crate::diagram::{Cycle, Kind, Mesh, Point};
use crate::linalg::condensed::Condensed;
use crate::linalg::lane::{Eight, Lane};
use crate::linalg::system::System;
use crate::linalg::{axpy, dot, max_abs};
use crate::problem::gauss::Scheme;
use crate::problem::piecewise::{self, PiecewiseFlow, Switched};
use crate::problem::{Setting, mesh};
use num_complex::Complex64;

/// Branch-point condition for cycles.
pub struct OnCycleBranchPoints<'a> {
    setting: Setting<'a>,
    scheme: Scheme,
    mesh: Mesh,
    n: usize,
    forcing_periods: u32,
    times: Vec<f64>,
    /// Direction of λ in the free parameters, which follow the amplitude of the unfolding.
    across: Vec<f64>,
    /// True if λ is the parameter of the branches, in whatever direction the curve goes.
    fixed: bool,
    /// Bordered system. Scalars: T₁ if the cycle is free, ℓ, the coefficient of d. Rows: the integral, then both rows
    /// of C.
    system: System,
    /// ⟨f, ·⟩ of the integral in (1), at the Gauss points.
    phase: Vec<f64>,
    /// d as a profile, and in the integral.
    left: Vec<f64>,
    left_phase: f64,
    /// C: two rows, each a profile, T₁, ℓ.
    right: [Vec<f64>; 2],
    /// Last solutions: v_k with their scalars; w.
    null: [Vec<f64>; 2],
    adjoint: Vec<f64>,
    period: f64,
    parameters: Vec<f64>,
    states: Vec<f64>,
    f: Vec<f64>,
    fx: Vec<f64>,
    /// f_λ at the Gauss points.
    along: Vec<f64>,
    /// (T, λ …), and the intervals in which the orbit switches with their left ends.
    scalars: Vec<f64>,
    switched: Vec<(Vec<f64>, Switched)>,
}

/// Operator (2), filled with the widest instruction set of the machine.
struct Fill<'a, 'b, T> {
    own: &'a OnCycleBranchPoints<'b>,
    system: Condensed<T>,
}

impl<T: Lane> pulp::NullaryFnOnce for Fill<'_, '_, T> {
    type Output = Condensed<T>;

    #[inline(always)]
    fn call(self) -> Condensed<T> {
        self.own.filled(self.system)
    }
}

impl<'a> OnCycleBranchPoints<'a> {
    /// Creates the condition on the mesh of `cycle`; the first free parameter of the
    /// setting is the amplitude of the unfolding.
    pub fn new(setting: Setting<'a>, cycle: &Cycle) -> OnCycleBranchPoints<'a> {
        let (scheme, n) = (cycle.scheme().clone(), setting.field.dim());
        let scalars = 2 + usize::from(cycle.forcing_periods == 0);
        let across = (0..setting.freedom() - 1).map(|k| if k == 0 { 1.0 } else { 0.0 }).collect();
        let mut own = OnCycleBranchPoints {
            system: System::new(n, &scheme.end, scalars),
            setting,
            scheme,
            mesh: cycle.mesh.clone(),
            n,
            forcing_periods: cycle.forcing_periods,
            times: Vec::new(),
            across,
            fixed: false,
            phase: Vec::new(),
            left: Vec::new(),
            left_phase: 0.3,
            right: [Vec::new(), Vec::new()],
            null: [Vec::new(), Vec::new()],
            adjoint: Vec::new(),
            period: 1.0,
            parameters: Vec::new(),
            states: Vec::new(),
            f: Vec::new(),
            fx: Vec::new(),
            along: Vec::new(),
            scalars: Vec::new(),
            switched: Vec::new(),
        };
        own.resize();
        // Any borders will do for the first evaluation unless they are orthogonal to the null vectors.
        let size = own.profile_size();
        let wave =
            |angle: f64, shift: f64| (0..size).map(|k| 0.5 + (k as f64 * angle + shift).sin()).collect::<Vec<f64>>();
        let rows = [wave(0.017, 1.0), wave(0.031, 2.3)];
        own.left = wave(0.013, 0.0);
        own.left.iter_mut().enumerate().for_each(|(k, x)| *x *= own.setting.scales[k % n]);
        let rows = rows
            .map(|row| -> Vec<f64> { row.iter().enumerate().map(|(k, x)| x / own.setting.scales[k % n]).collect() });
        own.right = [[&rows[0][..], &[0.3, 0.7]].concat(), [&rows[1][..], &[0.6, -0.4]].concat()];
        own
    }

    /// Creates the condition for singular points of branches over the second of three free parameters, without an
    /// unfolding: they form a curve.
    pub fn in_three_parameters(setting: Setting<'a>, cycle: &Cycle) -> OnCycleBranchPoints<'a> {
        OnCycleBranchPoints { fixed: true, ..OnCycleBranchPoints::new(setting, cycle) }
    }

    /// 1 if the system contains T₁ and the integral, otherwise 0.
    fn first(&self) -> usize {
        usize::from(self.forcing_periods == 0)
    }

    fn intervals(&self) -> usize {
        self.mesh.len() - 1
    }

    fn lanes(&self) -> usize {
        self.intervals() * self.scheme.degree
    }

    fn profile_size(&self) -> usize {
        self.intervals() * (self.scheme.degree + 1) * self.n
    }

    fn resize(&mut self) {
        let (m, lanes) = (self.scheme.degree, self.lanes());
        self.system.resize(self.intervals());
        self.states.resize(lanes * self.n, 0.0);
        self.f.resize(lanes * self.n, 0.0);
        self.along.resize(lanes * self.n, 0.0);
        self.fx.resize(lanes * self.n * self.n, 0.0);
        let mesh = &self.mesh;
        let time = |lane: usize| {
            let j = lane / m;
            f64::from(self.forcing_periods) * (mesh[j] + (mesh[j + 1] - mesh[j]) * self.scheme.nodes[lane % m + 1])
        };
        self.times = (0..if self.forcing_periods > 0 { lanes } else { 0 }).map(time).collect();
        self.phase.clear();
    }

    fn batch(&self) -> Batch<'_> {
        let parameters = Parameters::Shared(&self.parameters);
        Batch { lanes: self.lanes(), states: &self.states, parameters, times: &self.times, signs: &[] }
    }

    /// Calls `call` for every Gauss point with its number, the index of its node in a profile, the length of its
    /// interval, and its weight.
    fn each(&self, mut call: impl FnMut(usize, usize, f64, f64)) {
        let m = self.scheme.degree;
        for lane in 0..self.lanes() {
            let h = self.mesh[lane / m + 1] - self.mesh[lane / m];
            call(lane, (lane / m * (m + 1) + lane % m + 1) * self.n, h, self.scheme.weights[lane % m]);
        }
    }

    /// Direction at the Gauss points, `[(n + k) × lanes]`: a profile, then a change of all parameters.
    fn direction(&self, profile: &[f64], parameters: &[f64]) -> Vec<f64> {
        let lanes = self.lanes();
        let mut out = vec![0.0; self.n * lanes];
        self.each(|lane, node, _, _| (0..self.n).for_each(|c| out[c * lanes + lane] = profile[node + c]));
        out.extend(parameters.iter().flat_map(|p| std::iter::repeat_n(*p, lanes)));
        out
    }

    /// Change of all parameters for a change of λ.
    fn spread(&self, change: f64) -> Vec<f64> {
        let mut all = vec![0.0; self.setting.freedom()];
        all[1..].iter_mut().zip(&self.across).for_each(|(own, a)| *own = change * a);
        self.setting.spread(&all)
    }

    fn linearise(&mut self, u: &[f64]) {
        let (size, lanes) = (self.profile_size(), self.lanes());
        self.states = self.direction(&u[..size], &[]);
        self.period = u[size];
        self.parameters = self.setting.at(&u[size + 1..]);
        let (mut f, mut fx, mut along) =
            (vec![0.0; self.n * lanes], std::mem::take(&mut self.fx), vec![0.0; self.n * lanes]);
        self.setting.field.linearise(self.batch(), &[], &mut f, &mut fx, &mut []);
        let lambda = self.direction(&vec![0.0; size], &self.spread(1.0));
        self.setting.field.directional(self.batch(), &[&lambda], &mut along);
        (self.f, self.fx, self.along) = (f, fx, along);
        self.scalars = u[size..].to_vec();
        let flow = PiecewiseFlow::new(&self.setting, &self.scheme, &self.scalars, self.forcing_periods);
        let block = (self.scheme.degree + 1) * self.n;
        let switched = flow.intervals(&u[..size], &self.mesh).unwrap_or_default().into_iter();
        self.switched = switched.map(|found| (u[found.interval * block..][..self.n].to_vec(), found)).collect();
        if self.phase.is_empty() && self.first() == 1 {
            let (mut phase, mut norm) = (vec![0.0; lanes * self.n], 0.0);
            self.each(|lane, _, h, weight| {
                for c in 0..self.n {
                    let value = self.f[c * lanes + lane] / self.setting.scales[c];
                    phase[lane * self.n + c] = value / self.setting.scales[c];
                    norm += h * weight * value * value;
                }
            });
            let scale = 1.0 / norm.sqrt().max(f64::MIN_POSITIVE);
            phase.iter_mut().for_each(|p| *p *= scale);
            self.phase = phase;
        }
    }

    #[inline(always)]
    fn filled<T: Lane>(&self, mut system: Condensed<T>) -> Condensed<T> {
        let (n, m, first, lanes) = (self.n, self.scheme.degree, self.first(), self.lanes());
        let (inner, q, last, block) = (m * n, first + 2, self.intervals() - 1, (m + 1) * n);
        let (width, length, size) = (n + q, system.length(), self.profile_size());
        system.interior.fill(T::default());
        system.coupling.fill(T::default());
        system.border.fill(T::default());
        system.corner.fill(0.0);
        system.measure_in(self.setting.scales, self.setting.scales);
        let slots: Vec<usize> = (0..inner).map(|k| system.slot(k / n, k % n)).collect();
        for place in 0..length {
            // The solver pads the mesh with intervals of length zero.
            let interval = |lane: usize| (lane * length + place).min(last);
            let h = T::each(|lane| match lane * length + place {
                j if j <= last => self.mesh[j + 1] - self.mesh[j],
                _ => 0.0,
            });
            let ht = h * T::splat(self.period);
            for (i, c) in (0..m).flat_map(|i| (0..n).map(move |c| (i, c))) {
                let at_point = |x: &[f64], stride: usize| T::each(|lane| x[(interval(lane) * m + i) * stride]);
                let at_node = |x: &[f64]| T::each(|lane| x[interval(lane) * block + (i + 1) * n + c]);
                let slot = slots[i * n + c];
                let line = &mut system.interior[(place * inner + slot) * inner..][..inner];
                for k in 0..m {
                    line[slots[k * n + c]] = T::splat(self.scheme.derivative[i * (m + 1) + k + 1]);
                }
                for d in 0..n {
                    let entry = &mut line[slots[i * n + d]];
                    *entry = *entry - ht * at_point(&self.fx[(c * n + d) * lanes..], 1);
                }
                let right = &mut system.coupling[(place * inner + slot) * width..][..width];
                right[c] = T::splat(self.scheme.derivative[i * (m + 1)]);
                if first == 1 {
                    right[n] = T::splat(-1.0) * h * at_point(&self.f[c * lanes..], 1);
                }
                right[n + first] = T::splat(-1.0) * ht * at_point(&self.along[c * lanes..], 1);
                right[n + first + 1] = h * at_node(&self.left);
                let weight = h * T::splat(self.scheme.weights[i]);
                let at = |row: usize| (row * length + place) * block + n + slot;
                if first == 1 {
                    system.border[at(0)] = weight * at_point(&self.phase[c..], n);
                }
                for (k, row) in self.right.iter().enumerate() {
                    system.border[at(first + k)] = weight * at_node(row);
                }
            }
        }
        for (_, found) in &self.switched {
            system.isolate(found.interval, first + 1);
        }
        if first == 1 {
            system.corner[first + 1] = self.left_phase;
        }
        for (k, row) in self.right.iter().enumerate() {
            let line = &mut system.corner[(first + k) * q..];
            line[0] = row[size];
            line[first] = row[size + 1];
        }
        system
    }

    /// Ends of interval j in normalised time.
    fn interval(&self, j: usize) -> [f64; 2] {
        [self.mesh[j], self.mesh[j + 1]]
    }

    /// Derivatives of the flow of an interval at its Gauss points and its right end, `[m + 1][n × (n + 1 + k)]`, as
    /// those of v at the inner nodes in v at the left end, T₁ and ℓ, `[m][n][n + scalars]`.
    fn transition(&self, by: &[f64], left: f64) -> Vec<f64> {
        let (n, first, m, k) = (self.n, self.first(), self.scheme.degree, self.setting.freedom());
        let (from, width) = (n + 1 + k, n + first + 1);
        let mut out = Vec::with_capacity((m + 1) * n * width);
        for row in by.chunks_exact(from) {
            out.extend_from_slice(&row[..n + first]);
            out.push(self.across.iter().zip(&row[from - self.across.len()..]).map(|(a, v)| a * v).sum());
        }
        let end = out.split_off(m * n * width);
        let left: Vec<f64> = piecewise::identity(n, width).iter().map(|entry| left * entry).collect();
        piecewise::fit(&self.scheme, &left, &mut out, &end);
        out
    }

    fn evaluated(&mut self, u: &[f64], g: &mut [f64]) -> Option<()> {
        self.linearise(u);
        let system = std::mem::replace(&mut self.system, System::new(1, &[1.0, 0.0], 0));
        self.system = match system {
            System::Eight(system) => System::Eight(Eight::dispatch(Fill { own: self, system })),
            System::One(system) => System::One(f64::dispatch(Fill { own: self, system })),
        };
        self.system.condense().ok()?;
        for (_, found) in &self.switched {
            let ends = self.interval(found.interval);
            let own = self.transition(&found.derivatives(&self.scheme, ends), 1.0);
            self.system.replace(found.interval, &own);
        }
        self.system.eliminate(1.0).ok()?;
        let (size, first) = (self.profile_size(), self.first());
        let total = size + first + 2;
        let unit = |k: usize| {
            let mut one = vec![0.0; total];
            one[k] = 1.0;
            one
        };
        for k in 0..2 {
            self.null[k] = vec![0.0; total];
            self.system.solve(&unit(size + first + k), &mut self.null[k]);
        }
        self.adjoint = vec![0.0; total];
        self.system.solve_transposed(&unit(size + first + 1), &mut self.adjoint);
        g.copy_from_slice(&self.adjoint[size + first..]);
        let finite = self.null.iter().chain([&self.adjoint]).all(|x| max_abs(x).is_finite());
        finite.then_some(())
    }

    /// v_k, T₁ (0 for forced cycles) and ℓ.
    fn parts(&self, k: usize) -> (&[f64], f64, f64) {
        let (size, first) = (self.profile_size(), self.first());
        let v = &self.null[k];
        (&v[..size], if first == 1 { v[size] } else { 0.0 }, v[size + first])
    }

    /// w as a profile: left ends from the continuity rows, Gauss points from the collocation rows over their weights.
    fn adjoint_profile(&self) -> Vec<f64> {
        let (m, n, count) = (self.scheme.degree, self.n, self.intervals());
        let (w, block) = (&self.adjoint, (m + 1) * n);
        let mut profile = vec![0.0; count * block];
        for j in 0..count {
            let before = if j == 0 { count - 1 } else { j - 1 };
            for c in 0..n {
                profile[j * block + c] = w[before * block + c];
                for i in 0..m {
                    profile[j * block + (i + 1) * n + c] = w[j * block + (i + 1) * n + c] / self.scheme.weights[i];
                }
            }
        }
        profile
    }

    /// Scaled inner product of two rows (profile, T₁, ℓ).
    fn product(&self, a: &[f64], b: &[f64]) -> f64 {
        let size = self.profile_size();
        let mut sum = a[size] * b[size] / (self.period * self.period) + a[size + 1] * b[size + 1];
        self.each(|_, node, h, weight| {
            for c in 0..self.n {
                sum += h * weight * a[node + c] * b[node + c] / self.setting.scales[c].powi(2);
            }
        });
        sum
    }
}

impl Condition for OnCycleBranchPoints<'_> {
    fn kind(&self) -> Kind {
        Kind::BranchPoint
    }

    fn extra(&self) -> usize {
        0
    }

    fn equations(&self) -> usize {
        2
    }

    fn guess(&self, _point: &Point) -> Vec<f64> {
        Vec::new()
    }

    fn face(&mut self, along: &[f64]) {
        // Beyond two parameters the bifurcations are no curve.
        if self.fixed || self.across.len() != 2 {
            return;
        }
        let [a, b] = [along[along.len() - 2], along[along.len() - 1]];
        let length = a.hypot(b);
        if length > 0.0 {
            // The null vectors belong to the previous λ.
            self.across = vec![-b / length, a / length];
        }
    }

    fn anchor(&mut self) {
        if self.adjoint.is_empty() {
            return;
        }
        let (n, size) = (self.n, self.profile_size());
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for k in 0..2 {
            let (v, period, lambda) = self.parts(k);
            let mut row = [v, &[period, lambda]].concat();
            for other in &rows {
                let along = self.product(&row, other);
                axpy(-along, other, &mut row);
            }
            let norm = self.product(&row, &row).sqrt();
            row.iter_mut().for_each(|x| *x /= norm);
            rows.push(row);
        }
        let adjoint = self.adjoint_profile();
        let mut norm = 0.0;
        self.each(|_, node, h, weight| {
            (0..n).for_each(|c| norm += h * weight * (adjoint[node + c] * self.setting.scales[c]).powi(2));
        });
        let phase = if self.first() == 1 { self.adjoint[size] } else { 0.0 };
        let norm = (norm + phase * phase).sqrt();
        if !(norm.is_finite() && norm > 0.0 && rows.iter().all(|row| max_abs(row).is_finite())) {
            return;
        }
        for (own, mut row) in self.right.iter_mut().zip(rows) {
            row[..size].iter_mut().enumerate().for_each(|(k, x)| *x /= self.setting.scales[k % n].powi(2));
            row[size] /= self.period * self.period;
            *own = row;
        }
        self.left = adjoint.iter().enumerate().map(|(k, w)| w * self.setting.scales[k % n].powi(2) / norm).collect();
        self.left_phase = phase / norm;
        self.phase.clear();
    }

    fn set_mesh(&mut self, mesh: &Mesh) {
        if *mesh == self.mesh {
            return;
        }
        let size = self.profile_size();
        let from = std::mem::replace(&mut self.mesh, mesh.clone());
        self.resize();
        let carried = |profile: &[f64]| mesh::transferred(profile, self.n, &self.scheme, &from, mesh);
        let right = [0, 1].map(|k| {
            let row = &self.right[k];
            [&carried(&row[..size])[..], &row[size..]].concat()
        });
        (self.left, self.right) = (carried(&self.left), right);
        // These null vectors belong to another mesh.
        self.adjoint.clear();
    }

    fn evaluate(&mut self, u: &[f64], _extra: &[f64], g: &mut [f64]) -> bool {
        if self.evaluated(u, g).is_none() {
            self.adjoint.clear();
            return false;
        }
        true
    }

    fn derivative(&mut self, du: &[f64], _extra: &[f64], dg: &mut [f64]) {
        let (n, size, lanes) = (self.n, self.profile_size(), self.lanes());
        let way = self.direction(&du[..size], &self.setting.spread(&du[size + 1..]));
        let [mut bent, mut moved] = [(); 2].map(|()| vec![0.0; n * lanes]);
        self.setting.field.directional(self.batch(), &[&way], &mut moved);
        dg.fill(0.0);
        for (k, value) in dg.iter_mut().enumerate() {
            let (v, period, lambda) = self.parts(k);
            let own = self.direction(v, &self.spread(lambda));
            self.setting.field.directional(self.batch(), &[&own, &way], &mut bent);
            let mut change = vec![0.0; size];
            self.each(|lane, node, h, _| {
                for c in 0..n {
                    let along: f64 = (0..n).map(|d| self.fx[(c * n + d) * lanes + lane] * v[node + d]).sum();
                    let along = along + lambda * self.along[c * lanes + lane];
                    let rate =
                        du[size] * along + self.period * bent[c * lanes + lane] + period * moved[c * lanes + lane];
                    change[node + c] = -h * rate;
                }
            });
            let flow = PiecewiseFlow::new(&self.setting, &self.scheme, &self.scalars, self.forcing_periods);
            let block = (self.scheme.degree + 1) * n;
            for (x, found) in &self.switched {
                let (j, ends) = (found.interval, self.interval(found.interval));
                let dx = &du[j * block..j * block + n];
                let Some(by) = flow.varied(found, x, ends, dx, &du[size..]) else {
                    *value = f64::NAN;
                    continue;
                };
                let varied = self.transition(&by, 0.0);
                let width = n + self.first() + 1;
                let own = &mut change[j * block + n..(j + 1) * block];
                for (row, to) in varied.chunks_exact(width).zip(own) {
                    let by_period = if self.first() == 1 { row[n] * period } else { 0.0 };
                    *to = -(dot(&row[..n], &v[j * block..j * block + n]) + by_period + row[width - 1] * lambda);
                }
            }
            *value += -dot(&self.adjoint[..size], &change);
        }
    }

    fn held(&self, _extra: &[f64]) -> Vec<Complex64> {
        vec![Complex64::new(1.0, 0.0)]
    }

    fn distance(&self, z: Complex64) -> f64 {
        (z - 1.0).norm()
    }
}
