//! Defining systems of folds, period doublings and torus points of cycles.
//!
//! **Idea.** At each of these points a linear operator L, the variational equation with a suitable boundary condition,
//! has a null vector. Bordered by approximate null vectors L is regular, and the border component g of the solution is
//! the scalar (or complex number) that must vanish. Its derivative needs one solution with the transposed operator.
//!
//! **Equations.** In normalised time, v the null vector, f_x along the cycle:
//!
//! ```text
//!   fold              (1)  v' - T f_x v - T₁ f = 0,   v(1) =  v(0),   ∫⟨f, v⟩ = 0      unknown (v, T₁)
//!   period doubling   (2)  v' - T f_x v        = 0,   v(1) = -v(0)
//!   torus             (3)  v' - T f_x v + iθ v = 0,   v(1) =  v(0)                      v complex, multiplier e^{iθ}
//!
//!   (4)  [ L   b ] [ v ]   [ 0 ]
//!        [ c*  0 ] [ g ] = [ 1 ],      dg = -w* (dL) v   with   L* w + c g* = 0,  b* w = 1
//! ```
//!
//! **Source.** govaerts2000, §3 and §7 (bordered test functions); doedel2003 (cycles).
//!
//! **Departures.** b and c are updated from w and v at every accepted point, since a fixed choice could become
//! orthogonal to the null vectors along the curve.

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

/// Condition for a fold, period doubling or torus point of cycles.
pub struct OnCycles<'a> {
    setting: Setting<'a>,
    scheme: Scheme,
    kind: Kind,
    mesh: Mesh,
    n: usize,
    /// Components of v: n, or 2n if it is complex (real parts, then imaginary parts).
    parts: usize,
    /// True if b and c are included; otherwise the system is L alone.
    bordered: bool,
    /// Bordered system. Scalars: T₁ for a fold of free cycles, then the parts of g.
    system: System,
    /// ⟨f, ·⟩ of the phase condition in (1), at the Gauss points.
    phase: Vec<f64>,
    /// b and c as profiles `[N][m+1][parts]`, and their components in the phase row and along T₁.
    left: Vec<f64>,
    left_phase: f64,
    right: Vec<f64>,
    right_period: f64,
    /// Last solutions: v with its scalars, w for each part of g.
    null: Vec<f64>,
    adjoint: Vec<Vec<f64>>,
    /// State of the last evaluation: T, the parameters, and states, f and f_x at the Gauss points.
    period: f64,
    parameters: Vec<f64>,
    states: Vec<f64>,
    f: Vec<f64>,
    fx: Vec<f64>,
    /// Number of forcing periods of the cycle.
    forcing_periods: u32,
    times: Vec<f64>,
    /// (T, λ …), and the intervals in which the orbit switches with their left ends.
    scalars: Vec<f64>,
    /// θ of the last factorisation.
    angle: f64,
    switched: Vec<(Vec<f64>, Switched)>,
}

/// Operator (4), filled with the widest instruction set of the machine.
struct Fill<'a, 'b, T> {
    own: &'a OnCycles<'b>,
    system: Condensed<T>,
    angle: f64,
}

impl<T: Lane> pulp::NullaryFnOnce for Fill<'_, '_, T> {
    type Output = Condensed<T>;

    #[inline(always)]
    fn call(self) -> Condensed<T> {
        self.own.filled(self.system, self.angle)
    }
}

impl<'a> OnCycles<'a> {
    /// Creates the condition of the given kind for cycles on the mesh of `cycle`; `None` for kinds that cycles do not
    /// have.
    pub fn new(kind: Kind, setting: Setting<'a>, cycle: &Cycle) -> Option<OnCycles<'a>> {
        let mut condition = OnCycles::empty(kind, setting, cycle, true)?;
        condition.system = System::new(condition.parts, &condition.scheme.end, condition.scalars());
        condition.resize();
        // Any border will do for the first evaluation unless it is orthogonal to a null vector.
        let size = condition.profile_size();
        condition.left = wave(size, 0.4, 0.013, [0.0, 1.0]);
        condition.right = wave(size, 0.5, 0.017, [1.0, 0.0]);
        for k in 0..size {
            let scale = condition.setting.scales[k % condition.n];
            condition.left[k] *= scale;
            condition.right[k] /= scale;
        }
        Some(condition)
    }

    /// Creates a condition without a system and without initialised borders.
    fn empty(kind: Kind, setting: Setting<'a>, cycle: &Cycle, bordered: bool) -> Option<OnCycles<'a>> {
        let Cycle { forcing_periods, ref mesh, .. } = *cycle;
        let (scheme, n) = (cycle.scheme().clone(), setting.field.dim());
        let parts = match kind {
            Kind::Fold | Kind::PeriodDoubling => n,
            Kind::Torus => 2 * n,
            _ => return None,
        };
        Some(OnCycles {
            system: nothing(),
            setting,
            scheme,
            kind,
            mesh: mesh.clone(),
            n,
            parts,
            bordered,
            phase: Vec::new(),
            left: Vec::new(),
            left_phase: 0.3,
            right: Vec::new(),
            right_period: 0.3,
            null: Vec::new(),
            adjoint: Vec::new(),
            period: 1.0,
            parameters: Vec::new(),
            states: Vec::new(),
            f: Vec::new(),
            fx: Vec::new(),
            forcing_periods,
            times: Vec::new(),
            scalars: Vec::new(),
            angle: 0.0,
            switched: Vec::new(),
        })
    }

    /// L of (1), or of (3) if `complex`, without borders; it is regular if it has no null vector. Reuses the storage of
    /// `spare` if that has the right shape.
    pub(super) fn operator(
        setting: Setting<'a>,
        cycle: &Cycle,
        complex: bool,
        spare: Option<System>,
    ) -> Option<OnCycles<'a>> {
        let kind = if complex { Kind::Torus } else { Kind::Fold };
        let mut own = OnCycles::empty(kind, setting, cycle, false)?;
        let shape = (own.parts, own.scalars());
        let spare = spare.filter(|system| system.shape() == shape);
        own.system = spare.unwrap_or_else(|| System::new(shape.0, &own.scheme.end, shape.1));
        own.resize();
        Some(own)
    }

    /// Takes the system out; its last solutions stay.
    pub(super) fn take_system(&mut self) -> System {
        std::mem::replace(&mut self.system, nothing())
    }

    /// Factorises L at `u`; `angle` is θ of (3).
    pub(super) fn prepare(&mut self, u: &[f64], angle: f64) -> Option<()> {
        self.linearise(u);
        self.fill(angle);
        self.factorise(angle)
    }

    /// Factorises what was filled, with the transitions of the piecewise flow where the orbit switches.
    fn factorise(&mut self, angle: f64) -> Option<()> {
        self.angle = angle;
        self.system.condense().ok()?;
        for (_, found) in &self.switched {
            self.system.replace(found.interval, &self.transition(found, angle));
        }
        self.system.eliminate(self.closure()).ok()
    }

    /// Derivatives of v at the inner nodes of an interval in its left end, and T₁ where it has one: `[m][parts][parts +
    /// scalars]`.
    fn transition(&self, found: &Switched, angle: f64) -> Vec<f64> {
        let ends = self.interval(found.interval);
        let width = self.parts + usize::from(self.is_fold());
        let left: Vec<f64> = piecewise::identity(self.parts, width);
        self.turned(&found.derivatives(&self.scheme, ends), &left, ends, |h| Complex64::cis(-angle * h))
    }

    /// Derivatives of the flow of an interval at its Gauss points and its right end, `[m + 1][n × (n + 1 + k)]`, as
    /// those of v at the inner nodes, `[m][parts][parts + scalars]`, where v is complex times `factor` of the time from
    /// the left end: (3) turns v back by θ over the period. `left` is their value at the left end.
    fn turned(&self, by: &[f64], left: &[f64], ends: [f64; 2], factor: impl Fn(f64) -> Complex64) -> Vec<f64> {
        let (n, parts, m) = (self.n, self.parts, self.scheme.degree);
        let (from, width) = (n + self.scalars.len(), parts + usize::from(self.is_fold()));
        let mut out = vec![0.0; (m + 1) * parts * width];
        let places = self.scheme.nodes[1..].iter().copied().chain([1.0]);
        for ((node, own), place) in out.chunks_exact_mut(parts * width).zip(by.chunks_exact(n * from)).zip(places) {
            let Complex64 { re: cos, im: sin } = factor(place * (ends[1] - ends[0]));
            for (i, k) in (0..n).flat_map(|i| (0..n).map(move |k| (i, k))) {
                let value = own[i * from + k];
                if parts == n {
                    node[i * width + k] = value;
                } else {
                    (node[i * width + k], node[i * width + n + k]) = (cos * value, -sin * value);
                    (node[(n + i) * width + k], node[(n + i) * width + n + k]) = (sin * value, cos * value);
                }
            }
            if width > parts {
                (0..n).for_each(|i| node[i * width + parts] = own[i * from + n]);
            }
        }
        let end = out.split_off(m * parts * width);
        piecewise::fit(&self.scheme, left, &mut out, &end);
        out
    }

    /// Ends of interval j in normalised time.
    fn interval(&self, j: usize) -> [f64; 2] {
        [self.mesh[j], self.mesh[j + 1]]
    }

    /// Solves L y = r, with r at the Gauss points `[parts × lanes]`. Returns y there, and T₁ if it is an unknown, else
    /// 0.
    pub(super) fn solved(&self, r: &[f64]) -> (Vec<f64>, f64) {
        let (size, lanes) = (self.profile_size(), self.lanes());
        let mut right = vec![0.0; size + self.scalars()];
        self.each(|lane, node, h, _| {
            (0..self.parts).for_each(|c| right[node + c] = h * r[c * lanes + lane]);
        });
        let mut y = right.clone();
        self.system.solve(&right, &mut y);
        let period = if self.is_fold() { y[size] } else { 0.0 };
        (self.at_points(&y[..size]), period)
    }

    /// Calls `call` for every Gauss point with its number, the index of its node in a profile, the length of its
    /// interval, and its weight.
    fn each(&self, mut call: impl FnMut(usize, usize, f64, f64)) {
        let m = self.scheme.degree;
        for lane in 0..self.lanes() {
            let h = self.mesh[lane / m + 1] - self.mesh[lane / m];
            call(lane, (lane / m * (m + 1) + lane % m + 1) * self.parts, h, self.scheme.weights[lane % m]);
        }
    }

    /// Values of a profile at the Gauss points, `[parts × lanes]`.
    fn at_points(&self, profile: &[f64]) -> Vec<f64> {
        let lanes = self.lanes();
        let mut out = vec![0.0; self.parts * lanes];
        self.each(|lane, node, _, _| (0..self.parts).for_each(|c| out[c * lanes + lane] = profile[node + c]));
        out
    }

    /// Last null vector, `[parts × lanes]`, and T₁ if it is an unknown, else 0.
    pub(super) fn null(&self) -> (Vec<f64>, f64) {
        let size = self.profile_size();
        (self.at_points(&self.null[..size]), if self.is_fold() { self.null[size] } else { 0.0 })
    }

    /// Solvability functional: L y = r, r at the Gauss points, has a solution if this is 0. Complex if v is.
    pub(super) fn solvability(&self, r: &[f64]) -> Complex64 {
        let lanes = self.lanes();
        let mut parts = [0.0; 2];
        for (part, w) in parts.iter_mut().zip(&self.adjoint) {
            self.each(|lane, node, h, _| {
                (0..self.parts).for_each(|c| *part += h * w[node + c] * r[c * lanes + lane]);
            });
        }
        Complex64::new(parts[0], parts[1])
    }

    /// ∫ |v|² over normalised time, v at the Gauss points.
    pub(super) fn square(&self, v: &[f64]) -> f64 {
        let lanes = self.lanes();
        let mut total = 0.0;
        self.each(|lane, _, h, weight| {
            total += h * weight * (0..self.parts).map(|c| v[c * lanes + lane].powi(2)).sum::<f64>();
        });
        total
    }

    /// Relative growth of the motion along v: Σ_i ∫ (x_i - x̄_i) v_i / ∫ x_i², with x̄ the mean. Components that hardly
    /// move about their mean contribute little.
    pub(super) fn growth(&self, v: &[f64]) -> f64 {
        let lanes = self.lanes();
        let share = |c: usize| {
            let [x, v] = [&self.states, v].map(|all| &all[c * lanes..(c + 1) * lanes]);
            let mut mean = 0.0;
            self.each(|lane, _, h, weight| mean += h * weight * x[lane]);
            let (mut along, mut square) = (0.0, 0.0);
            self.each(|lane, _, h, weight| {
                along += h * weight * (x[lane] - mean) * v[lane];
                square += h * weight * x[lane] * x[lane];
            });
            if square > 0.0 { along / square } else { 0.0 }
        };
        (0..self.n).map(share).sum()
    }

    /// f_x v at the Gauss points, `[n × lanes]`.
    pub(super) fn along(&self, v: &[f64]) -> Vec<f64> {
        let (n, lanes) = (self.n, self.lanes());
        let mut out = vec![0.0; n * lanes];
        for c in 0..n {
            for d in 0..n {
                let slope = &self.fx[(c * n + d) * lanes..(c * n + d + 1) * lanes];
                let own = out[c * lanes..(c + 1) * lanes].iter_mut().zip(slope);
                own.zip(&v[d * lanes..(d + 1) * lanes]).for_each(|((o, a), x)| *o += a * x);
            }
        }
        out
    }

    /// Derivative of f in the states at the Gauss points, along directions `[n × lanes]`.
    pub(super) fn bent(&self, along: &[&[f64]]) -> Vec<f64> {
        let (lanes, known) = (self.lanes(), self.setting.parameters.len());
        let full: Vec<Vec<f64>> = along
            .iter()
            .map(|d| {
                let mut own = d.to_vec();
                own.resize((self.n + known) * lanes, 0.0);
                own
            })
            .collect();
        let full: Vec<&[f64]> = full.iter().map(Vec::as_slice).collect();
        let parameters = Parameters::Shared(&self.parameters);
        let mut out = vec![0.0; self.n * lanes];
        let batch = Batch { lanes, states: &self.states, parameters, times: &self.times, signs: &[] };
        self.setting.field.directional(batch, &full, &mut out);
        out
    }

    /// Number of scalars of the system.
    fn scalars(&self) -> usize {
        usize::from(self.is_fold()) + if self.bordered { self.width() } else { 0 }
    }

    fn intervals(&self) -> usize {
        self.mesh.len() - 1
    }

    fn profile_size(&self) -> usize {
        self.intervals() * (self.scheme.degree + 1) * self.parts
    }

    fn lanes(&self) -> usize {
        self.intervals() * self.scheme.degree
    }

    /// Number of parts of g: two if it is complex, otherwise one.
    fn width(&self) -> usize {
        self.parts / self.n
    }

    /// True if (1) applies with T₁. The period of a forced cycle is prescribed, so its fold uses only the first
    /// equation of (1).
    fn is_fold(&self) -> bool {
        self.kind == Kind::Fold && self.forcing_periods == 0
    }

    fn resize(&mut self) {
        let lanes = self.lanes();
        self.system.resize(self.intervals());
        self.states.resize(lanes * self.n, 0.0);
        self.f.resize(lanes * self.n, 0.0);
        self.fx.resize(lanes * self.n * self.n, 0.0);
        let (m, mesh) = (self.scheme.degree, &self.mesh);
        let time = |lane: usize| {
            let j = lane / m;
            f64::from(self.forcing_periods) * (mesh[j] + (mesh[j + 1] - mesh[j]) * self.scheme.nodes[lane % m + 1])
        };
        self.times = (0..if self.forcing_periods > 0 { lanes } else { 0 }).map(time).collect();
        self.phase.clear();
    }

    /// Values at the Gauss points of `n` components from `first` on of a profile with `parts` components,
    /// component-major.
    fn gather(&self, profile: &[f64], parts: usize, first: usize) -> Vec<f64> {
        let (n, m, lanes) = (self.n, self.scheme.degree, self.lanes());
        let mut out = vec![0.0; n * lanes];
        for lane in 0..lanes {
            let at = (lane / m * (m + 1) + lane % m + 1) * parts + first;
            (0..n).for_each(|i| out[i * lanes + lane] = profile[at + i]);
        }
        out
    }

    fn linearise(&mut self, u: &[f64]) {
        let size = self.intervals() * (self.scheme.degree + 1) * self.n;
        self.states = self.gather(&u[..size], self.n, 0);
        self.period = u[size];
        self.parameters = self.setting.at(&u[size + 1..]);
        let batch = Batch {
            lanes: self.lanes(),
            states: &self.states,
            parameters: Parameters::Shared(&self.parameters),
            times: &self.times,
            signs: &[],
        };
        self.setting.field.linearise(batch, &[], &mut self.f, &mut self.fx, &mut []);
        self.scalars = u[size..].to_vec();
        let flow = PiecewiseFlow::new(&self.setting, &self.scheme, &self.scalars, self.forcing_periods);
        let block = (self.scheme.degree + 1) * self.n;
        let switched = flow.intervals(&u[..size], &self.mesh).unwrap_or_default().into_iter();
        self.switched = switched.map(|found| (u[found.interval * block..][..self.n].to_vec(), found)).collect();
        if self.phase.is_empty() {
            let (m, lanes) = (self.scheme.degree, self.lanes());
            let mut norm = 0.0;
            self.phase = vec![0.0; lanes * self.n];
            for lane in 0..lanes {
                let weight = (self.mesh[lane / m + 1] - self.mesh[lane / m]) * self.scheme.weights[lane % m];
                for i in 0..self.n {
                    let value = self.f[i * lanes + lane];
                    self.phase[lane * self.n + i] = value / self.setting.scales[i].powi(2);
                    norm += weight * value * value / self.setting.scales[i].powi(2);
                }
            }
            let scale = 1.0 / norm.sqrt().max(f64::MIN_POSITIVE);
            self.phase.iter_mut().for_each(|p| *p *= scale);
        }
    }

    /// Fills the bordered operator (4).
    fn fill(&mut self, angle: f64) {
        self.system = match self.take_system() {
            System::Eight(system) => System::Eight(Eight::dispatch(Fill { own: self, system, angle })),
            System::One(system) => System::One(f64::dispatch(Fill { own: self, system, angle })),
        };
    }

    #[inline(always)]
    fn filled<T: Lane>(&self, mut system: Condensed<T>, angle: f64) -> Condensed<T> {
        let (m, parts, count) = (self.scheme.degree, self.parts, self.intervals());
        let (is_fold, length) = (self.is_fold(), system.length());
        system.interior.fill(T::default());
        system.coupling.fill(T::default());
        system.border.fill(T::default());
        system.corner.fill(0.0);
        let sizes: Vec<f64> = (0..parts).map(|c| self.setting.scales[c % self.n]).collect();
        system.measure_in(&sizes, &sizes);
        let slots: Vec<usize> = (0..m * parts).map(|k| system.slot(k / parts, k % parts)).collect();
        for place in 0..length {
            // The solver pads the mesh with intervals of length zero.
            let h = |j: usize| if j < count { self.mesh[j + 1] - self.mesh[j] } else { 0.0 };
            let h = T::each(|lane| h(lane * length + place));
            for i in 0..m {
                for c in 0..parts {
                    self.fill_line(&mut system, &slots, place, [i, c], h, angle);
                }
            }
        }
        for (_, found) in &self.switched {
            system.isolate(found.interval, usize::from(is_fold));
        }
        if is_fold && self.bordered {
            system.corner[1] = self.left_phase;
            system.corner[2] = self.right_period;
        }
        system
    }

    /// Writes equation c at Gauss point i of the intervals at one position, whose lengths are h, and its part of the
    /// border.
    #[inline(always)]
    fn fill_line<T: Lane>(
        &self,
        system: &mut Condensed<T>,
        slots: &[usize],
        place: usize,
        [i, c]: [usize; 2],
        h: T,
        angle: f64,
    ) {
        let (n, m, parts, lanes) = (self.n, self.scheme.degree, self.parts, self.lanes());
        let (inner, scalars, last) = (m * parts, self.scalars(), self.intervals() - 1);
        let (width, block, length) = (parts + scalars, (m + 1) * parts, system.length());
        let first = usize::from(self.is_fold());
        // Values at the Gauss point in every interval: from consecutive points, and from profiles.
        let interval = |lane: usize| (lane * length + place).min(last);
        let at_point = |x: &[f64], stride: usize| T::each(|lane| x[(interval(lane) * m + i) * stride]);
        let at_node = |x: &[f64], c: usize| T::each(|lane| x[interval(lane) * block + (i + 1) * parts + c]);
        let (half, own) = (c / n * n, c % n);
        let line = &mut system.interior[(place * inner + slots[i * parts + c]) * inner..][..inner];
        for k in 0..m {
            line[slots[k * parts + c]] = T::splat(self.scheme.derivative[i * (m + 1) + k + 1]);
        }
        let ht = h * T::splat(self.period);
        for d in 0..n {
            let entry = &mut line[slots[i * parts + half + d]];
            *entry = *entry - ht * at_point(&self.fx[(own * n + d) * lanes..], 1);
        }
        // + iθ v: the real part is reduced by θ times the imaginary part.
        let (other, sign) = if c < n { (c + n, -1.0) } else { (c - n, 1.0) };
        let signed = T::splat(sign) * h;
        if parts > n {
            let entry = &mut line[slots[i * parts + other]];
            *entry = *entry + signed * T::splat(angle);
        }
        let right = &mut system.coupling[(place * inner + slots[i * parts + c]) * width..][..width];
        right[c] = T::splat(self.scheme.derivative[i * (m + 1)]);
        if self.is_fold() {
            right[parts] = T::splat(-1.0) * h * at_point(&self.f[c * lanes..], 1);
        }
        let weight = h * T::splat(self.scheme.weights[i]);
        let at = |r: usize| (r * length + place) * block + parts + slots[i * parts + c];
        if self.is_fold() {
            system.border[at(0)] = weight * at_point(&self.phase[c..], n);
        }
        if !self.bordered {
            return;
        }
        right[parts + first] = h * at_node(&self.left, c);
        system.border[at(first)] = weight * at_node(&self.right, c);
        if parts > n {
            // The second border is i times the first.
            right[parts + 1] = signed * at_node(&self.left, other);
            system.border[at(1)] = weight * T::splat(sign) * at_node(&self.right, other);
        }
    }

    /// Replaces the null vectors of the last evaluation by the result of (4) with borders made of them, using the
    /// existing factorisation. For real v, with b', c' the new borders and g, v, w from the old ones,
    ///
    /// ```text
    ///   (5)  [ L   b ] [ z ]   [ b' ]
    ///        [ c*  0 ] [ s ] = [ 0  ],      v' = v - g/s z,   L v' = -g/s b'
    /// ```
    ///
    /// and correspondingly for w.
    pub(super) fn sharpen(&mut self) -> Option<()> {
        let (size, first) = (self.profile_size(), usize::from(self.is_fold()));
        let (total, g) = (size + first + 1, *self.null.last()?);
        if self.width() > 1 || self.null.len() != total {
            return None;
        }
        self.anchor();
        let [mut left, mut right, mut z] = [(); 3].map(|()| vec![0.0; total]);
        self.each(|_, node, h, weight| {
            for at in node..node + self.parts {
                (left[at], right[at]) = (h * self.left[at], h * weight * self.right[at]);
            }
        });
        if self.is_fold() {
            (left[size], right[size]) = (self.left_phase, self.right_period);
        }
        self.system.solve(&left, &mut z);
        let share = g / z[total - 1];
        self.null.iter_mut().zip(&z).for_each(|(v, z)| *v -= share * z);
        self.system.solve_transposed(&right, &mut z);
        let share = g / z[total - 1];
        self.adjoint[0].iter_mut().zip(&z).for_each(|(w, z)| *w -= share * z);
        (max_abs(&self.null).is_finite() && max_abs(&self.adjoint[0]).is_finite()).then_some(())
    }

    /// w as a profile: left ends from the continuity rows, Gauss points from the collocation rows over their weights.
    fn adjoint_profile(&self) -> Vec<f64> {
        let (m, parts, count) = (self.scheme.degree, self.parts, self.intervals());
        let (w, block) = (&self.adjoint[0], (m + 1) * parts);
        let closure = self.closure();
        let mut profile = vec![0.0; count * block];
        for j in 0..count {
            let (before, factor) = if j == 0 { (count - 1, closure) } else { (j - 1, 1.0) };
            for c in 0..parts {
                profile[j * block + c] = factor * w[before * block + c];
                for i in 0..m {
                    profile[j * block + (i + 1) * parts + c] =
                        w[j * block + (i + 1) * parts + c] / self.scheme.weights[i];
                }
            }
        }
        profile
    }

    fn closure(&self) -> f64 {
        if self.kind == Kind::PeriodDoubling { -1.0 } else { 1.0 }
    }

    fn evaluated(&mut self, u: &[f64], extra: &[f64], g: &mut [f64]) -> Option<()> {
        self.linearise(u);
        let angle = extra.first().copied().unwrap_or(0.0);
        self.fill(angle);
        self.factorise(angle)?;
        let (size, first) = (self.profile_size(), usize::from(self.is_fold()));
        let total = size + first + self.width();
        let mut one = vec![0.0; total];
        one[size + first] = 1.0;
        self.null = vec![0.0; total];
        self.system.solve(&one, &mut self.null);
        self.adjoint = (0..self.width())
            .map(|part| {
                let (mut one, mut w) = (vec![0.0; total], vec![0.0; total]);
                one[size + first + part] = 1.0;
                self.system.solve_transposed(&one, &mut w);
                w
            })
            .collect();
        g.copy_from_slice(&self.null[size + first..]);
        (max_abs(&self.null).is_finite() && self.adjoint.iter().all(|w| max_abs(w).is_finite())).then_some(())
    }
}

/// System without intervals.
fn nothing() -> System {
    System::new(1, &[1.0, 0.0], 0)
}

/// Samples of a sine wave about a mean, with phase increment `angle` and the initial sine and cosine given.
fn wave(size: usize, mean: f64, angle: f64, [mut sin, mut cos]: [f64; 2]) -> Vec<f64> {
    let (s, c) = angle.sin_cos();
    let mut next = || {
        let value = mean + sin;
        (sin, cos) = (sin * c + cos * s, cos * c - sin * s);
        value
    };
    (0..size).map(|_| next()).collect()
}

impl Condition for OnCycles<'_> {
    fn kind(&self) -> Kind {
        self.kind
    }

    fn extra(&self) -> usize {
        self.width() - 1
    }

    fn guess(&self, point: &Point) -> Vec<f64> {
        let complex = point.free_spectrum().iter().filter(|z| z.im > 0.0);
        let nearest = complex.min_by(|a, b| a.norm().ln().abs().total_cmp(&b.norm().ln().abs()));
        (0..self.extra()).map(|_| nearest.map_or(1.0, |z| z.arg())).collect()
    }

    fn anchor(&mut self) {
        if self.null.is_empty() {
            return;
        }
        let (m, parts, size) = (self.scheme.degree, self.parts, self.profile_size());
        let left = self.adjoint_profile();
        let (mut v, mut w) = (0.0, 0.0);
        for lane in 0..self.lanes() {
            let weight = (self.mesh[lane / m + 1] - self.mesh[lane / m]) * self.scheme.weights[lane % m];
            let node = (lane / m * (m + 1) + lane % m + 1) * parts;
            for c in 0..parts {
                let scale = self.setting.scales[c % self.n].powi(2);
                v += weight * self.null[node + c].powi(2) / scale;
                w += weight * left[node + c].powi(2) * scale;
            }
        }
        let period = if self.is_fold() { self.null[size] / self.period } else { 0.0 };
        let phase = if self.is_fold() { self.adjoint[0][size] } else { 0.0 };
        (v, w) = (v + period * period, (w + phase * phase).sqrt());
        if !(v.is_finite() && v > 0.0 && w.is_finite() && w > 0.0) {
            return;
        }
        let scales = self.setting.scales;
        self.right = (0..size).map(|k| self.null[k] / (scales[k % parts % self.n].powi(2) * v)).collect();
        self.right_period = period / (self.period * v);
        self.left = left.iter().map(|x| x / w).collect();
        self.left_phase = phase / w;
        self.phase.clear();
    }

    fn set_mesh(&mut self, mesh: &Mesh) {
        if *mesh == self.mesh {
            return;
        }
        let from = std::mem::replace(&mut self.mesh, mesh.clone());
        self.resize();
        self.left = mesh::transferred(&self.left, self.parts, &self.scheme, &from, mesh);
        self.right = mesh::transferred(&self.right, self.parts, &self.scheme, &from, mesh);
        // These null vectors belong to another mesh.
        self.null.clear();
    }

    fn evaluate(&mut self, u: &[f64], extra: &[f64], g: &mut [f64]) -> bool {
        if self.evaluated(u, extra, g).is_none() {
            self.null.clear();
            return false;
        }
        true
    }

    fn derivative(&mut self, du: &[f64], extra: &[f64], dg: &mut [f64]) {
        let (n, m, parts, lanes) = (self.n, self.scheme.degree, self.parts, self.lanes());
        let (size, states) = (self.profile_size(), self.intervals() * (m + 1) * n);
        let known = self.setting.parameters.len();
        let batch = Batch {
            lanes,
            states: &self.states,
            parameters: Parameters::Shared(&self.parameters),
            times: &self.times,
            signs: &[],
        };
        let mut direction = self.gather(&du[..states], n, 0);
        direction.extend(self.setting.spread(&du[states + 1..]).iter().flat_map(|p| std::iter::repeat_n(*p, lanes)));
        let turn = extra.first().copied().unwrap_or(0.0);
        let mut change = vec![0.0; size];
        let (mut bent, mut moved) = (vec![0.0; n * lanes], vec![0.0; n * lanes]);
        if self.is_fold() {
            self.setting.field.directional(batch, &[&direction], &mut moved);
        }
        for part in 0..self.width() {
            let mut v = self.gather(&self.null[..size], parts, part * n);
            v.resize((n + known) * lanes, 0.0);
            self.setting.field.directional(batch, &[&v, &direction], &mut bent);
            for lane in 0..lanes {
                let h = self.mesh[lane / m + 1] - self.mesh[lane / m];
                let node = (lane / m * (m + 1) + lane % m + 1) * parts;
                for c in 0..n {
                    let along: f64 = (0..n).map(|d| self.fx[(c * n + d) * lanes + lane] * v[d * lanes + lane]).sum();
                    let mut rate = du[states] * along + self.period * bent[c * lanes + lane];
                    if self.is_fold() {
                        rate += self.null[size] * moved[c * lanes + lane];
                    }
                    change[node + part * n + c] -= h * rate;
                    if parts > n {
                        let (other, sign) = if part == 0 { (c + n, 1.0) } else { (c, -1.0) };
                        change[node + part * n + c] -= sign * h * turn * self.null[node + other];
                    }
                }
            }
        }
        let flow = PiecewiseFlow::new(&self.setting, &self.scheme, &self.scalars, self.forcing_periods);
        let (block, blocks) = ((m + 1) * n, (m + 1) * parts);
        for (x, found) in &self.switched {
            let j = found.interval;
            let ends = self.interval(j);
            let dx = &du[j * block..j * block + n];
            let Some(by) = flow.varied(found, x, ends, dx, &du[states..]) else {
                dg.fill(f64::NAN);
                return;
            };
            let width = parts + usize::from(self.is_fold());
            let (none, angle) = (vec![0.0; parts * width], self.angle);
            let mut varied = self.turned(&by, &none, ends, |h| Complex64::cis(-angle * h));
            if parts > n {
                let by = found.derivatives(&self.scheme, ends);
                let by_angle = self.turned(&by, &none, ends, |h| Complex64::new(0.0, -h) * Complex64::cis(-angle * h));
                axpy(turn, &by_angle, &mut varied);
            }
            let own = &mut change[j * blocks + parts..(j + 1) * blocks];
            for (row, to) in varied.chunks_exact(width).zip(own) {
                let left = dot(&row[..parts], &self.null[j * blocks..j * blocks + parts]);
                *to = -(left + if width > parts { row[parts] * self.null[size] } else { 0.0 });
            }
        }
        for (value, w) in dg.iter_mut().zip(&self.adjoint) {
            *value = -dot(&w[..size], &change);
        }
    }

    fn null_direction(&self) -> Option<Vec<f64>> {
        let own = (self.kind == Kind::Fold).then(|| self.null.get(..self.profile_size()))??;
        let period = if self.is_fold() { self.null[own.len()] } else { 0.0 };
        Some([own, &[period, 0.0, 0.0]].concat())
    }

    fn held(&self, extra: &[f64]) -> Vec<Complex64> {
        match self.kind {
            Kind::PeriodDoubling => vec![Complex64::new(-1.0, 0.0)],
            Kind::Torus => [1.0, -1.0].map(|sign| Complex64::from_polar(1.0, sign * extra[0])).to_vec(),
            _ => vec![Complex64::new(1.0, 0.0)],
        }
    }

    fn distance(&self, z: Complex64) -> f64 {
        match self.kind {
            Kind::Fold => (z - 1.0).norm(),
            Kind::PeriodDoubling => (z + 1.0).norm(),
            _ if z.im == 0.0 => f64::INFINITY,
            _ => z.norm().ln().abs(),
        }
    }
}
