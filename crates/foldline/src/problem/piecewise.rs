//! Intervals in which an orbit passes a switch of the vector field.
//!
//! **Idea.** Collocation by one polynomial is accurate where f is smooth. Where an orbit passes a switching surface within an interval, the
//! interval is cut at the switching instants, every part has a polynomial of its own and the branch of f that is in force there, and the
//! equations of the interval are those of this piecewise flow: what the flow makes of the left end is required of the inner nodes and of
//! the right end. The unknowns of the orbit stay what they are. Nothing has to be known of the sequence of switchings beforehand: it
//! is read off the flow in every Newton step, so that a branch goes on through a grazing contact as through any other point.
//!
//! **Equations.** On an interval of length ℓ (in the time of the field), with parts [t_p, t_{p+1}] of the branch σ_p of f:
//!
//! ```text
//!   (1)  Y_i = y + ℓ_p Σ_k a_ik f_{σ_p}(Y_k),   y⁺ = Σ_k e_k Y_k             collocation on a part, from its left end y
//!   (2)  h_s(y⁺) = 0                                                       its right end, where the switch s changes sign
//!   (3)  V_i = V + ℓ_p Σ_k a_ik (f_x V_k + f_σ),   V⁺ = Σ_k e_k V_k          derivatives in the left end and the scalars
//!   (4)  V ← V⁺ + (f⁻ - f⁺) δt,   δt = -(∇h·V⁺ + h_σ) / (∇h·f⁻ + h_t)      at a switching at which f jumps
//! ```
//!
//! Where f is continuous at the surface (4) leaves V as it is: to first order the switching instants do not matter. The derivatives are
//! then those of a continuously differentiable map also where the orbit grazes the surface.
//!
//! **Source.** leine2004 (saltation matrix). The extremum test: shampine2000.
//!
//! **Fails when** the orbit slides along a surface, or passes too many surfaces within one interval ([`Obstacle`]).

use super::Setting;
use super::gauss::Scheme;
use crate::contract::{Batch, Parameters};
use crate::diagram::Mesh;
use crate::linalg::{dot, lu, max_abs, panel};

/// Sections of a part at whose ends switches are compared; extrema between them are found from parabolas.
const SECTIONS: usize = 32;
/// Parts of an interval. More within one interval of a mesh that is made for the tolerance is chatter.
const MOST_PARTS: usize = 64;
/// Value of a switch, relative to its largest along the orbit, that counts as zero: rounding of the state.
const ZERO: f64 = 1e-13;
/// Value of a switch, relative to its largest, below which the flow does not leave the surface that it has just passed.
const NEAR: f64 = 1e-11;
/// Place in a part, from its left end, at which it is seen on which side of the surface just passed the flow continues. A contact that
/// is shorter is no deeper than the square of this.
const AFTER: f64 = 1e-6;
/// Length of a part, relative to its interval, below which it is left out.
const SHORTEST: f64 = 1e-12;
/// Jump of f, relative to the larger side, below which it is rounding.
const CONTINUOUS: f64 = 1e-9;
/// Step of central differences, in scales: the cube root of rounding.
const STEP: f64 = 6e-6;

/// Reason why an orbit cannot be computed on an interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Obstacle {
    /// It stays on a switching surface.
    Slides,
    /// It passes switching surfaces more often than is computed on one interval.
    Chatters,
    /// Newton's method does not converge on a part.
    Lost,
}

impl Obstacle {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Obstacle::Slides => "the orbit slides along a switching surface at which the right-hand side jumps",
            Obstacle::Chatters => "the orbit crosses switching surfaces dozens of times within one mesh interval",
            Obstacle::Lost => "the motion between two switchings could not be computed",
        }
    }
}

/// The flow of a vector field along a piecewise smooth orbit.
pub(crate) struct PiecewiseFlow<'a> {
    setting: &'a Setting<'a>,
    scheme: &'a Scheme,
    parameters: Vec<f64>,
    /// T, λ₁ … λ_k.
    scalars: Vec<f64>,
    forcing_periods: u32,
}

/// A part of an interval between switchings.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    /// Normalised times of its ends.
    pub ends: [f64; 2],
    /// `[m + 1][n]`: left end and Gauss points.
    pub nodes: Vec<f64>,
    /// `[m + 1][n × (n + 1 + k)]`: derivatives in the left end of the interval and in T, λ₁ … λ_k.
    pub by: Vec<f64>,
    /// Signs of the switches.
    signs: Vec<f64>,
    /// The switch that changes sign at the right end, and true if f jumps there.
    switch: Option<usize>,
    jumps: bool,
    /// ∫ tr f_x dt, with the logarithm of the determinant of (4).
    trace: f64,
}

/// An interval in which the orbit switches.
#[derive(Clone, Debug)]
pub(crate) struct Switched {
    /// Its number.
    pub interval: usize,
    /// The parts, in order.
    pub parts: Vec<Part>,
    /// True if f jumps at a switching.
    pub jumps: bool,
    /// Largest value of every switch along the orbit.
    sizes: Vec<f64>,
    /// Switchings at the left end, which have no part: signs before each, and the switch.
    at_start: Vec<(Vec<f64>, usize)>,
    /// Logarithm of the determinants of (4) at the left end.
    trace: f64,
    /// `[n]` and `[n × (n + 1 + k)]`: the right end and its derivatives.
    pub end: Vec<f64>,
    pub end_by: Vec<f64>,
}

/// First switching on a trial polynomial.
enum Met {
    Nothing,
    /// The switch just passed is passed back at once.
    Back,
    /// At this place in (0, 1], this switch.
    At(f64, usize),
}

/// A trial: nodes of a polynomial from one normalised time to another.
struct Trial<'a> {
    nodes: &'a [f64],
    ends: [f64; 2],
    signs: &'a [f64],
    /// The switch at whose zero the part begins.
    passed: Option<usize>,
}

impl<'a> PiecewiseFlow<'a> {
    /// For orbits with scalars (T, λ₁ … λ_k).
    pub fn new(setting: &'a Setting<'a>, scheme: &'a Scheme, scalars: &[f64], forcing_periods: u32) -> Self {
        let parameters = setting.at(&scalars[1..]);
        PiecewiseFlow { setting, scheme, parameters, scalars: scalars.to_vec(), forcing_periods }
    }

    fn n(&self) -> usize {
        self.setting.field.dim()
    }

    /// Columns of derivatives: n + 1 + k.
    fn width(&self) -> usize {
        self.n() + self.scalars.len()
    }

    /// The time of the field at normalised time t; nothing where it is autonomous.
    fn time(&self, t: f64) -> Option<f64> {
        (self.forcing_periods > 0).then(|| f64::from(self.forcing_periods) * t)
    }

    fn switches(&self, states: &[f64], times: &[f64]) -> Vec<f64> {
        let (field, lanes) = (self.setting.field, states.len() / self.n());
        let mut values = vec![0.0; field.switch_count() * lanes];
        field.switches(
            Batch { lanes, states, parameters: Parameters::Shared(&self.parameters), times, signs: &[] },
            &mut values,
        );
        values
    }

    /// The intervals of a profile in which the orbit switches.
    ///
    /// # Errors
    /// See [`Obstacle`].
    pub fn intervals(&self, profile: &[f64], mesh: &[f64]) -> Result<Vec<Switched>, Obstacle> {
        if self.setting.field.switch_count() == 0 {
            return Ok(Vec::new());
        }
        let block = (self.scheme.degree + 1) * self.n();
        let (suspects, sizes) = self.suspects(profile, mesh);
        let mut all = Vec::new();
        for j in suspects {
            let nodes = &profile[j * block..(j + 1) * block];
            let found = self.along(j, &nodes[..self.n()], [mesh[j], mesh[j + 1]], nodes, &sizes)?;
            if found.parts.len() > 1 || !found.at_start.is_empty() {
                all.push(found);
            }
        }
        Ok(all)
    }

    /// The intervals in which a switch could vanish, because it changes by as much as its smallest value at the nodes, and the largest
    /// value of every switch.
    fn suspects(&self, profile: &[f64], mesh: &[f64]) -> (Vec<usize>, Vec<f64>) {
        let (n, intervals, nodes) = (self.n(), mesh.len() - 1, self.scheme.degree + 1);
        let lanes = intervals * nodes;
        let mut states = vec![0.0; n * lanes];
        panel::by_component(profile, nodes, n, &mut states);
        let place = |g: usize, j: usize| mesh[j] + self.scheme.nodes[g] * (mesh[j + 1] - mesh[j]);
        let places = (0..nodes).flat_map(|g| (0..intervals).map(move |j| (g, j)));
        let times: Vec<f64> = places.filter_map(|(g, j)| self.time(place(g, j))).collect();
        let values = self.switches(&states, &times);
        let sizes: Vec<f64> = values.chunks_exact(lanes).map(max_abs).collect();
        let could = |own: &[f64], j: usize| {
            // With the left end of the next interval.
            let next = own[(j + 1) % intervals];
            let there = (0..nodes).map(|g| own[g * intervals + j]).chain([next]);
            let [low, high] = there.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
            low <= 0.0 && high >= 0.0 || low.abs().min(high.abs()) < high - low
        };
        let suspects = (0..intervals).filter(|j| values.chunks_exact(lanes).any(|own| could(own, *j))).collect();
        (suspects, sizes)
    }

    /// The flow from `x` over an interval; `guess` `[m + 1][n]` is a polynomial next to it. `None` if it cannot be had.
    fn along(
        &self,
        interval: usize,
        x: &[f64],
        ends: [f64; 2],
        guess: &[f64],
        sizes: &[f64],
    ) -> Result<Switched, Obstacle> {
        let (n, width) = (self.n(), self.width());
        let mut signs = self.signs_before(x, ends[0], sizes);
        let mut found = Switched {
            interval,
            parts: Vec::new(),
            jumps: false,
            sizes: sizes.to_vec(),
            at_start: Vec::new(),
            trace: 0.0,
            end: x.to_vec(),
            end_by: vec![0.0; n * width],
        };
        (0..n).for_each(|c| found.end_by[c * width + c] = 1.0);
        let (mut begin, mut passed, mut back) = (ends[0], None, 0);
        let length = ends[1] - ends[0];
        loop {
            let within = |t: f64| (t - ends[0]) / length;
            let from = self.restricted(guess, [within(begin), 1.0]);
            let nodes = self.solved(&found.end, [begin, ends[1]], &signs, from).ok_or(Obstacle::Lost)?;
            let trial = Trial { nodes: &nodes, ends: [begin, ends[1]], signs: &signs, passed };
            let (at, switch) = match self.first(&trial, sizes) {
                Met::Nothing => {
                    self.close(&mut found, [begin, ends[1]], nodes, &signs).ok_or(Obstacle::Lost)?;
                    return Ok(found);
                }
                Met::Back => {
                    // A tangency to rounding where f is continuous; where f jumps the orbit slides.
                    let switch = passed.ok_or(Obstacle::Lost)?;
                    back += 1;
                    if !self.is_continuous(&found.end, begin, &signs, switch) {
                        return Err(Obstacle::Slides);
                    }
                    if back > 4 {
                        return Err(Obstacle::Chatters);
                    }
                    signs[switch] = -signs[switch];
                    continue;
                }
                Met::At(at, switch) => (at, switch),
            };
            if found.parts.len() == MOST_PARTS {
                return Err(Obstacle::Chatters);
            }
            let part = self.until(&found.end, begin, ends[1], at, switch, &signs, &nodes).ok_or(Obstacle::Lost)?;
            let (end, nodes) = part;
            let passes = end - begin > SHORTEST * length;
            if passes {
                self.close(&mut found, [begin, end], nodes, &signs).ok_or(Obstacle::Lost)?;
            }
            if found.parts.is_empty() {
                found.at_start.push((signs.clone(), switch));
            }
            if !self.pass(&mut found, end, &signs, switch, passes).ok_or(Obstacle::Lost)? {
                return Err(Obstacle::Slides);
            }
            signs[switch] = -signs[switch];
            // What is shorter has no part of its own: the next one begins where it does.
            begin = if passes { end } else { begin };
            passed = Some(switch);
            if begin >= ends[1] {
                return Ok(found);
            }
        }
    }

    /// Signs of the switches just before `x`, at normalised time `t`: a switching at the left end of an interval belongs to it.
    fn signs_before(&self, x: &[f64], t: f64, sizes: &[f64]) -> Vec<f64> {
        let time = self.time(t);
        let values = self.switches(x, time.as_slice());
        let mut signs: Vec<f64> = values.iter().map(|value| if *value > 0.0 { 1.0 } else { -1.0 }).collect();
        if (0..signs.len()).all(|k| values[k].abs() > ZERO * sizes[k]) {
            return signs;
        }
        let parameters = Parameters::Shared(&self.parameters);
        let batch = Batch { lanes: 1, states: x, parameters, times: time.as_slice(), signs: &[] };
        let [_, hx, _, ht] = self.setting.linearise_switches(batch);
        let (n, mut f) = (self.n(), vec![0.0; self.n()]);
        self.setting.field.evaluate(batch, &mut f);
        for k in (0..signs.len()).filter(|k| values[*k].abs() <= ZERO * sizes[*k]) {
            let speed = dot(&hx[k * n..(k + 1) * n], &f) + ht[k];
            signs[k] = if speed == 0.0 { signs[k] } else { -speed.signum() };
        }
        signs
    }

    /// The part from `begin` to where the switch vanishes, near the place `at` of a trial to `last`: its right end and its nodes.
    fn until(
        &self,
        x: &[f64],
        begin: f64,
        last: f64,
        at: f64,
        switch: usize,
        signs: &[f64],
        trial: &[f64],
    ) -> Option<(f64, Vec<f64>)> {
        let mut end = begin + at * (last - begin);
        let mut nodes = self.solved(x, [begin, end], signs, self.restricted(trial, [0.0, at]))?;
        // From the root of the trial to that of the part, which is more accurate at its end.
        for _ in 0..4 {
            let value = |s: f64| self.switch(&nodes, [begin, end], s, switch);
            let off = value(1.0) / (value(1.0) - value(1.0 - 1e-4)) * 1e-4;
            let moved = (end - off * (end - begin)).min(last);
            // Where the orbit grazes the surface the instant matters little, and is not better determined.
            if !off.is_finite() || off.abs() > 0.1 || (moved - end).abs() < 1e-15 {
                break;
            }
            let share = (moved - begin) / (end - begin);
            let from = self.restricted(&nodes, [0.0, share]);
            end = moved;
            nodes = self.solved(x, [begin, end], signs, from)?;
        }
        Some((end, nodes))
    }

    /// A polynomial at the Gauss points of the part between two places of it, `[m][n]`.
    fn restricted(&self, nodes: &[f64], [from, to]: [f64; 2]) -> Vec<f64> {
        let n = self.n();
        let mut out = vec![0.0; self.scheme.degree * n];
        for (x, c) in out.chunks_exact_mut(n).zip(&self.scheme.nodes[1..]) {
            self.scheme.value_into(from + c * (to - from), nodes, x);
        }
        out
    }

    /// States `[m][n]` component-major, `[n × m]`.
    fn lanes(&self, states: &[f64]) -> Vec<f64> {
        let n = self.n();
        (0..n).flat_map(|c| states.iter().skip(c).step_by(n).copied()).collect()
    }

    /// Length of a part in the time of the field, and the times of its Gauss points.
    fn course(&self, [begin, end]: [f64; 2]) -> (f64, Vec<f64>) {
        let times = self.scheme.nodes[1..].iter().filter_map(|c| self.time(begin + c * (end - begin))).collect();
        ((end - begin) * self.scalars[0], times)
    }

    /// 1 - ℓ a f_x as rows `[m n × m n]`, from f_x `[n·n × m]`.
    fn matrix(&self, length: f64, fx: &[f64]) -> Vec<f64> {
        let (n, m) = (self.n(), self.scheme.degree);
        let size = m * n;
        let mut matrix = vec![0.0; size * size];
        for i in 0..m {
            for c in 0..n {
                let row = &mut matrix[(i * n + c) * size..(i * n + c + 1) * size];
                for k in 0..m {
                    let share = length * self.scheme.integration[i * m + k];
                    (0..n).for_each(|d| row[k * n + d] = -share * fx[(c * n + d) * m + k]);
                }
                row[i * n + c] += 1.0;
            }
        }
        matrix
    }

    /// (1): the nodes `[m + 1][n]` of a part from `x`, by Newton's method from its Gauss points `[m][n]`.
    fn solved(&self, x: &[f64], ends: [f64; 2], signs: &[f64], mut inner: Vec<f64>) -> Option<Vec<f64>> {
        /// Updates, relative, that rounding may leave, and what is accepted where it leaves more.
        const ROUNDED: [f64; 2] = [1e-14, 1e-9];
        const ROUNDS: usize = 12;
        let (n, m, field) = (self.n(), self.scheme.degree, self.setting.field);
        let (length, times) = self.course(ends);
        let signs: Vec<f64> = signs.iter().flat_map(|sign| std::iter::repeat_n(*sign, m)).collect();
        let [mut f, mut fx] = [n, n * n].map(|size| vec![0.0; size * m]);
        let mut pivots = vec![0; n * m];
        let scale = |c: usize| self.setting.scales[c].max(x[c].abs());
        let mut before = f64::INFINITY;
        for _ in 0..ROUNDS {
            let states = self.lanes(&inner);
            let parameters = Parameters::Shared(&self.parameters);
            let batch = Batch { lanes: m, states: &states, parameters, times: &times, signs: &signs };
            field.linearise(batch, &[], &mut f, &mut fx, &mut []);
            let mut matrix = self.matrix(length, &fx);
            let mut change = vec![0.0; n * m];
            for (i, row) in change.chunks_exact_mut(n).enumerate() {
                for c in 0..n {
                    let rates = &f[c * m..(c + 1) * m];
                    let rise = dot(&self.scheme.integration[i * m..(i + 1) * m], rates);
                    row[c] = inner[i * n + c] - x[c] - length * rise;
                }
            }
            lu::factorise(&mut matrix, n * m, &mut pivots).ok()?;
            lu::solve(&matrix, n * m, &pivots, &mut change, 1);
            inner.iter_mut().zip(&change).for_each(|(x, d)| *x -= d);
            let off = change.iter().enumerate().map(|(k, d)| (d / scale(k % n)).abs()).fold(0.0, f64::max);
            if !off.is_finite() {
                return None;
            }
            if off < ROUNDED[0] || off < ROUNDED[1] && off > 0.3 * before {
                return Some([x, &inner].concat());
            }
            before = off;
        }
        (before < ROUNDED[1]).then(|| [x, &inner].concat())
    }

    /// Appends a part with its derivatives (3), and moves the end there.
    fn close(&self, found: &mut Switched, ends: [f64; 2], nodes: Vec<f64>, own_signs: &[f64]) -> Option<()> {
        let (n, m, width, k) = (self.n(), self.scheme.degree, self.width(), self.scalars.len() - 1);
        let (length, times) = self.course(ends);
        let states = self.lanes(&nodes[n..]);
        let [mut f, mut fx, mut fp] = [n, n * n, n * k].map(|size| vec![0.0; size * m]);
        let signs: Vec<f64> = own_signs.iter().flat_map(|sign| std::iter::repeat_n(*sign, m)).collect();
        let parameters = Parameters::Shared(&self.parameters);
        let batch = Batch { lanes: m, states: &states, parameters, times: &times, signs: &signs };
        self.setting.linearise(batch, &mut f, &mut fx, &mut fp);
        let mut inner = vec![0.0; m * n * width];
        for i in 0..m {
            let shares = &self.scheme.integration[i * m..(i + 1) * m];
            for c in 0..n {
                let row = &mut inner[(i * n + c) * width..(i * n + c + 1) * width];
                row.copy_from_slice(&found.end_by[c * width..(c + 1) * width]);
                // The period stretches the part.
                row[n] += length / self.scalars[0] * dot(shares, &f[c * m..(c + 1) * m]);
                for p in 0..k {
                    row[n + 1 + p] += length * dot(shares, &fp[(c * k + p) * m..(c * k + p + 1) * m]);
                }
            }
        }
        let mut matrix = self.matrix(length, &fx);
        let mut pivots = vec![0; n * m];
        lu::factorise(&mut matrix, n * m, &mut pivots).ok()?;
        lu::solve(&matrix, n * m, &pivots, &mut inner, width);
        let by = [&found.end_by[..], &inner].concat();
        let combined = |values: &[f64], size: usize| -> Vec<f64> {
            let mut out = vec![0.0; size];
            for (e, own) in self.scheme.end.iter().zip(values.chunks_exact(size)) {
                out.iter_mut().zip(own).for_each(|(o, v)| *o += e * v);
            }
            out
        };
        found.end = combined(&nodes, n);
        found.end_by = combined(&by, n * width);
        let trace: f64 =
            (0..n).map(|c| dot(&self.scheme.weights, &fx[(c * n + c) * m..(c * n + c + 1) * m])).sum::<f64>() * length;
        let (signs, switch, jumps) = (own_signs.to_vec(), None, false);
        found.parts.push(Part { ends, nodes, by, signs, switch, jumps, trace });
        found.end.iter().chain(&found.end_by).all(|x| x.is_finite()).then_some(())
    }

    /// f on both sides of a switch that vanishes at `x`.
    fn sides(&self, x: &[f64], t: f64, signs: &[f64], switch: usize) -> [Vec<f64>; 2] {
        let time = self.time(t);
        let mut signs = signs.to_vec();
        [(); 2].map(|()| {
            let mut f = vec![0.0; self.n()];
            let parameters = Parameters::Shared(&self.parameters);
            let batch = Batch { lanes: 1, states: x, parameters, times: time.as_slice(), signs: &signs };
            self.setting.field.evaluate(batch, &mut f);
            signs[switch] = -signs[switch];
            f
        })
    }

    fn is_continuous(&self, x: &[f64], t: f64, signs: &[f64], switch: usize) -> bool {
        let [before, after] = self.sides(x, t, signs, switch);
        self.same(&before, &after)
    }

    fn same(&self, before: &[f64], after: &[f64]) -> bool {
        let size = |of: &dyn Fn(usize) -> f64| {
            (0..self.n()).map(|c| (of(c) / self.setting.scales[c]).abs()).fold(0.0, f64::max)
        };
        let jump = size(&|c| after[c] - before[c]);
        jump <= CONTINUOUS * size(&|c| before[c]).max(size(&|c| after[c]))
    }

    /// (4) at the end of the last part, which is at time `t`; `signs` are those of that part. False if the flow does not leave the surface
    /// on the other side.
    fn pass(&self, found: &mut Switched, t: f64, signs: &[f64], switch: usize, ends: bool) -> Option<bool> {
        let x = found.end.clone();
        let [before, after] = self.sides(&x, t, signs, switch);
        let jumps = !self.same(&before, &after);
        if let Some(last) = found.parts.last_mut().filter(|_| ends) {
            (last.switch, last.jumps) = (Some(switch), jumps);
        }
        found.jumps |= jumps;
        if !jumps {
            return Some(true);
        }
        let (n, width, time) = (self.n(), self.width(), self.time(t));
        let parameters = Parameters::Shared(&self.parameters);
        let batch = Batch { lanes: 1, states: &x, parameters, times: time.as_slice(), signs: &[] };
        let [_, hx, hp, ht] = self.setting.linearise_switches(batch);
        let (gradient, in_time, k) = (&hx[switch * n..(switch + 1) * n], ht[switch], width - n - 1);
        let in_scalar = &hp[switch * k..(switch + 1) * k];
        let [speed, speed_after] = [&before, &after].map(|f| dot(gradient, f) + in_time);
        if speed * speed_after <= 0.0 || !speed.is_finite() {
            return Some(false);
        }
        for column in 0..width {
            let own = (0..n).map(|c| gradient[c] * found.end_by[c * width + column]).sum::<f64>();
            let direct = column.checked_sub(n + 1).map_or(0.0, |k| in_scalar[k]);
            let shift = -(own + direct) / speed;
            (0..n).for_each(|c| found.end_by[c * width + column] += (before[c] - after[c]) * shift);
        }
        match found.parts.last_mut() {
            Some(last) => last.trace += (speed_after / speed).ln(),
            None => found.trace += (speed_after / speed).ln(),
        }
        Some(true)
    }

    /// One switch at a place of a polynomial.
    fn switch(&self, nodes: &[f64], [begin, end]: [f64; 2], s: f64, switch: usize) -> f64 {
        let mut x = vec![0.0; self.n()];
        self.scheme.value_into(s, nodes, &mut x);
        self.switches(&x, self.time(begin + s * (end - begin)).as_slice())[switch]
    }

    /// Which switch changes sign first on a trial. The one at whose zero it begins is divided by the place, which removes that zero.
    fn first(&self, trial: &Trial, sizes: &[f64]) -> Met {
        let (n, [begin, end]) = (self.n(), trial.ends);
        let places: Vec<f64> = (0..=SECTIONS).map(|k| k as f64 / SECTIONS as f64).collect();
        let mut states = vec![0.0; n * places.len()];
        let mut x = vec![0.0; n];
        for (k, s) in places.iter().enumerate() {
            self.scheme.value_into(*s, trial.nodes, &mut x);
            (0..n).for_each(|c| states[c * places.len() + k] = x[c]);
        }
        let times: Vec<f64> = places.iter().filter_map(|s| self.time(begin + s * (end - begin))).collect();
        let values = self.switches(&states, &times);
        let mut met = Met::Nothing;
        for (k, own) in values.chunks_exact(places.len()).enumerate() {
            let (sign, passed) = (trial.signs[k], trial.passed == Some(k));
            // (There it is zero but for rounding.)
            let of = |s: f64, value: f64| sign * if passed { (value - own[0]) / s } else { value };
            let at = |s: f64| of(s, self.switch(trial.nodes, trial.ends, s, k));
            let mut margins: Vec<f64> = places.iter().zip(own).map(|(s, value)| of(*s, *value)).collect();
            let mut knots = places.clone();
            if passed {
                // So close to the surface all the way that rounding decides on which side.
                if own.iter().all(|value| value.abs() <= NEAR * sizes[k]) {
                    continue;
                }
                (knots[0], margins[0]) = (AFTER, at(AFTER));
                if margins[0] <= 0.0 && margins[1] <= 0.0 {
                    return Met::Back;
                }
                if margins[0] <= 0.0 {
                    margins[0] = margins[1];
                }
            }
            let zero = ZERO * sizes[k];
            let Some([left, right]) = violated(&knots, &margins, zero, &at) else { continue };
            let place = root(&at, left, right);
            if !matches!(met, Met::At(earlier, _) if earlier <= place) {
                met = Met::At(place, k);
            }
        }
        met
    }

    /// The derivatives of an interval, `[m + 1][n × (n + 1 + k)]` at the Gauss points and at the right end, differentiated along a
    /// direction of its left end and the scalars:
    ///
    /// ```text
    ///   (5)  W_i = W + Σ_k a_ik (δℓ (f_x V_k + f_σ) + ℓ (D²f[V_k, δY_k] + f_x W_k)),   W ← W⁺ + (f_x⁻ V + f_σ⁻ - f_x⁺ V - f_σ⁺) δt
    /// ```
    ///
    /// where the second relation, at a switching, has δt of (4). Where f jumps, by central differences of the flow.
    pub fn varied(&self, own: &Switched, x: &[f64], ends: [f64; 2], dx: &[f64], scalars: &[f64]) -> Option<Vec<f64>> {
        if own.jumps {
            return self.differences(own, x, ends, dx, scalars);
        }
        let (n, m, width, k) = (self.n(), self.scheme.degree, self.width(), self.scalars.len() - 1);
        let direction = [dx, scalars].concat();
        let free_change = self.setting.spread(&scalars[1..]);
        let free_units: Vec<Vec<f64>> = (0..k)
            .map(|p| self.setting.spread(&(0..k).map(|q| f64::from(u8::from(p == q))).collect::<Vec<f64>>()))
            .collect();
        let nothing = vec![0.0; free_change.len()];
        let combined = |values: &[f64], size: usize| -> Vec<f64> {
            let mut out = vec![0.0; size];
            for (e, own) in self.scheme.end.iter().zip(values.chunks_exact(size)) {
                out.iter_mut().zip(own).for_each(|(o, v)| *o += e * v);
            }
            out
        };
        let lanes = |columns: &dyn Fn(usize, usize) -> f64, parameters: &[f64]| -> Vec<f64> {
            let states = (0..n).flat_map(|c| (0..m).map(move |i| (c, i))).map(|(c, i)| columns(c, i));
            states.chain(parameters.iter().flat_map(|p| std::iter::repeat_n(*p, m))).collect()
        };
        let mut start = vec![0.0; n * width];
        let left: Vec<f64> = (0..n * width).map(|at| f64::from(u8::from(at % width == at / width))).collect();
        for (signs, switch) in &own.at_start {
            let moved = self.shifted(x, &left, ends[0], signs, *switch, &direction);
            start.iter_mut().zip(&moved).for_each(|(w, m)| *w += m);
        }
        let mut all: Vec<Vec<f64>> = Vec::with_capacity(own.parts.len());
        for part in &own.parts {
            let (length, times) = self.course(part.ends);
            let stretched = (part.ends[1] - part.ends[0]) * scalars[0];
            let states = self.lanes(&part.nodes[n..]);
            let signs: Vec<f64> = part.signs.iter().flat_map(|sign| std::iter::repeat_n(*sign, m)).collect();
            let parameters = Parameters::Shared(&self.parameters);
            let batch = Batch { lanes: m, states: &states, parameters, times: &times, signs: &signs };
            let [mut f, mut fx, mut fp] = [n, n * n, n * k].map(|size| vec![0.0; size * m]);
            self.setting.linearise(batch, &mut f, &mut fx, &mut fp);
            // V at Gauss point i.
            let by = |c: usize, i: usize, column: usize| part.by[((i + 1) * n + c) * width + column];
            let change = |c: usize, i: usize| -> f64 {
                dot(&part.by[((i + 1) * n + c) * width..((i + 1) * n + c + 1) * width], &direction)
            };
            let along = lanes(&change, &free_change);
            let mut first = vec![0.0; n * m];
            self.setting.field.directional(batch, &[&along], &mut first);
            let mut rows = vec![0.0; m * n * width];
            for column in 0..width {
                let own_parameters = column.checked_sub(n + 1).map_or(&nothing, |p| &free_units[p]);
                let own = lanes(&|c, i| by(c, i, column), own_parameters);
                let mut second = vec![0.0; n * m];
                self.setting.field.directional(batch, &[&own, &along], &mut second);
                for c in 0..n {
                    let rate = |at: usize| -> f64 {
                        let moved: f64 = (0..n).map(|d| fx[(c * n + d) * m + at] * by(d, at, column)).sum();
                        let forced = column.checked_sub(n + 1).map_or(0.0, |p| fp[(c * k + p) * m + at]);
                        let by_period = if column == n { first[c * m + at] / self.scalars[0] } else { 0.0 };
                        stretched * (moved + forced) + length * (second[c * m + at] + by_period)
                    };
                    let rates: Vec<f64> = (0..m).map(rate).collect();
                    for i in 0..m {
                        let share = dot(&self.scheme.integration[i * m..(i + 1) * m], &rates);
                        rows[(i * n + c) * width + column] = start[c * width + column] + share;
                    }
                }
            }
            let mut matrix = self.matrix(length, &fx);
            let mut pivots = vec![0; n * m];
            lu::factorise(&mut matrix, n * m, &mut pivots).ok()?;
            lu::solve(&matrix, n * m, &pivots, &mut rows, width);
            let nodes = [&start[..], &rows].concat();
            start = combined(&nodes, n * width);
            all.push(nodes);
            if let Some(switch) = part.switch {
                let (x, by) = (combined(&part.nodes, n), combined(&part.by, n * width));
                let moved = self.shifted(&x, &by, part.ends[1], &part.signs, switch, &direction);
                start.iter_mut().zip(&moved).for_each(|(w, m)| *w += m);
            }
        }
        let mut out = own.at_nodes(self.scheme, ends, &all, n * width);
        out.extend(combined(all.last()?, n * width));
        out.iter().all(|value| value.is_finite()).then_some(out)
    }

    /// The second relation of (5), without W⁺: at `x`, with the derivatives `by` `[n × (n + 1 + k)]` there, where the switch
    /// changes sign at normalised time `t`.
    fn shifted(&self, x: &[f64], by: &[f64], t: f64, signs: &[f64], switch: usize, direction: &[f64]) -> Vec<f64> {
        let (n, width, k) = (self.n(), self.width(), self.scalars.len() - 1);
        let (time, parameters) = (self.time(t), Parameters::Shared(&self.parameters));
        let batch = Batch { lanes: 1, states: x, parameters, times: time.as_slice(), signs: &[] };
        let [_, hx, hp, ht] = self.setting.linearise_switches(batch);
        let mut signs = signs.to_vec();
        let sides = [(); 2].map(|()| {
            let [mut f, mut fx, mut fp] = [n, n * n, n * k].map(|size| vec![0.0; size]);
            self.setting.linearise(Batch { signs: &signs, ..batch }, &mut f, &mut fx, &mut fp);
            signs[switch] = -signs[switch];
            (f, fx, fp)
        });
        let gradient = &hx[switch * n..(switch + 1) * n];
        let speed = dot(gradient, &sides[0].0) + ht[switch];
        let moved: f64 = (0..n).map(|c| gradient[c] * dot(&by[c * width..(c + 1) * width], direction)).sum();
        let shift = -(moved + dot(&hp[switch * k..(switch + 1) * k], &direction[n + 1..])) / speed;
        let rate = |(_, fx, fp): &(Vec<f64>, Vec<f64>, Vec<f64>), c: usize, column: usize| -> f64 {
            let moved: f64 = (0..n).map(|d| fx[c * n + d] * by[d * width + column]).sum();
            moved + column.checked_sub(n + 1).map_or(0.0, |p| fp[c * k + p])
        };
        let entries = (0..n).flat_map(|c| (0..width).map(move |column| (c, column)));
        entries.map(|(c, column)| (rate(&sides[0], c, column) - rate(&sides[1], c, column)) * shift).collect()
    }

    /// [`PiecewiseFlow::varied`] by central differences.
    fn differences(&self, own: &Switched, x: &[f64], ends: [f64; 2], dx: &[f64], scalars: &[f64]) -> Option<Vec<f64>> {
        let (n, scales) = (self.n(), self.setting.scales);
        let relative = (0..n).map(|c| (dx[c] / scales[c].max(x[c].abs())).abs());
        let others = scalars.iter().zip(&self.scalars).map(|(d, v)| (d / v.abs().max(1e-3)).abs());
        let size = relative.chain(others).fold(0.0, f64::max);
        if size == 0.0 {
            return Some(vec![0.0; (self.scheme.degree + 1) * n * self.width()]);
        }
        let step = STEP / size;
        let guess = self.guess(own);
        let at = |by: f64| {
            let moved: Vec<f64> = x.iter().zip(dx).map(|(x, d)| x + by * d).collect();
            let there: Vec<f64> = self.scalars.iter().zip(scalars).map(|(v, d)| v + by * d).collect();
            let flow = PiecewiseFlow::new(self.setting, self.scheme, &there, self.forcing_periods);
            Some(flow.along(own.interval, &moved, ends, &guess, &own.sizes).ok()?.derivatives(self.scheme, ends))
        };
        let (more, less) = (at(step)?, at(-step)?);
        Some(more.iter().zip(&less).map(|(a, b)| (a - b) / (2.0 * step)).collect())
    }

    /// A polynomial through the flow at the nodes of its interval, `[m + 1][n]`.
    fn guess(&self, own: &Switched) -> Vec<f64> {
        let ends = [own.parts[0].ends[0], own.parts[own.parts.len() - 1].ends[1]];
        let n = self.n();
        let mut nodes = own.parts[0].nodes[..n].to_vec();
        nodes.extend(own.values(self.scheme, ends));
        nodes
    }

    /// The transition of an interval from parts of half the length, `[n × n]`: more accurate than its own.
    pub fn refined(&self, own: &Switched, x: &[f64], [begin, end]: [f64; 2], nodes: &[f64]) -> Option<Vec<f64>> {
        let (n, width, interval, sizes) = (self.n(), self.width(), own.interval, &own.sizes);
        let middle = 0.5 * (begin + end);
        let half = |from: [f64; 2]| -> Vec<f64> {
            let mut x = vec![0.0; n];
            self.scheme.value_into(from[0], nodes, &mut x);
            [x, self.restricted(nodes, from)].concat()
        };
        let first = self.along(interval, x, [begin, middle], &half([0.0, 0.5]), sizes).ok()?;
        let second = self.along(interval, &first.end, [middle, end], &half([0.5, 1.0]), sizes).ok()?;
        let entry = |i: usize, k: usize| {
            (0..n).map(|j| second.end_by[i * width + j] * first.end_by[j * width + k]).sum::<f64>()
        };
        Some((0..n * n).map(|k| entry(k / n, k % n)).collect())
    }
}

impl Switched {
    /// ∫ tr f_x dt over the interval.
    pub fn trace(&self) -> f64 {
        self.trace + self.parts.iter().map(|part| part.trace).sum::<f64>()
    }

    /// The part and the place in it of a place in the interval.
    fn part(&self, t: f64) -> (usize, f64) {
        let last = self.parts.len() - 1;
        let own = self.parts.iter().position(|part| t <= part.ends[1]).unwrap_or(last);
        let part = &self.parts[own];
        (own, ((t - part.ends[0]) / (part.ends[1] - part.ends[0])).clamp(0.0, 1.0))
    }

    /// The flow at the Gauss points of the interval, `[m][n]`.
    fn values(&self, scheme: &Scheme, ends: [f64; 2]) -> Vec<f64> {
        let n = self.end.len();
        let mut out = vec![0.0; scheme.degree * n];
        for (x, c) in out.chunks_exact_mut(n).zip(&scheme.nodes[1..]) {
            let (part, s) = self.part(ends[0] + c * (ends[1] - ends[0]));
            scheme.value_into(s, &self.parts[part].nodes, x);
        }
        out
    }

    /// Values that the flow requires at the inner nodes, `[m][n]`: its values there, but at the last node what gives its right end.
    pub fn inner(&self, scheme: &Scheme, ends: [f64; 2]) -> Vec<f64> {
        let n = self.end.len();
        let mut out = self.values(scheme, ends);
        fit(scheme, &self.parts[0].nodes[..n], &mut out, &self.end);
        out
    }

    /// Derivatives of the flow at the Gauss points and at the right end, `[m + 1][n × (n + 1 + k)]`.
    pub fn derivatives(&self, scheme: &Scheme, ends: [f64; 2]) -> Vec<f64> {
        let of_parts: Vec<&[f64]> = self.parts.iter().map(|part| &part.by[..]).collect();
        let mut out = self.at_nodes(scheme, ends, &of_parts, self.end_by.len());
        out.extend_from_slice(&self.end_by);
        out
    }

    /// Polynomials `[m + 1][size]` on the parts, at the Gauss points of the interval.
    fn at_nodes(&self, scheme: &Scheme, ends: [f64; 2], of_parts: &[impl AsRef<[f64]>], size: usize) -> Vec<f64> {
        let mut out = vec![0.0; scheme.degree * size];
        for (to, c) in out.chunks_exact_mut(size).zip(&scheme.nodes[1..]) {
            let (part, s) = self.part(ends[0] + c * (ends[1] - ends[0]));
            for (weight, own) in scheme.interpolation(s).iter().zip(of_parts[part].as_ref().chunks_exact(size)) {
                to.iter_mut().zip(own).for_each(|(o, v)| *o += weight * v);
            }
        }
        out
    }
}

/// Mesh and profile of an orbit with an interval for each part between switchings; `block` is the size of an interval.
pub(crate) fn cut(profile: &[f64], mesh: &Mesh, switched: &[Switched], block: usize) -> (Mesh, Vec<f64>) {
    if switched.is_empty() {
        return (mesh.clone(), profile.to_vec());
    }
    let (mut nodes, mut out) = (vec![0.0], Vec::with_capacity(profile.len() + 4 * switched.len() * block));
    let mut next = switched.iter().peekable();
    for (j, own) in profile.chunks_exact(block).enumerate() {
        match next.next_if(|found| found.interval == j) {
            Some(found) => {
                out.extend(found.parts.iter().flat_map(|part| &part.nodes));
                let inner = &found.parts[..found.parts.len() - 1];
                nodes.extend(inner.iter().map(|part| part.ends[1]));
            }
            None => out.extend_from_slice(own),
        }
        nodes.push(mesh[j + 1]);
    }
    (nodes.into(), out)
}

/// A direction (profile, T, λ …) at that orbit, on the mesh with an interval for each part.
pub(crate) fn cut_direction(along: &[f64], intervals: usize, switched: &[Switched], block: usize) -> Vec<f64> {
    let (profile, scalars) = along.split_at(intervals * block);
    let mut out = Vec::with_capacity(along.len() + 4 * switched.len() * block);
    let mut next = switched.iter().peekable();
    for (j, own) in profile.chunks_exact(block).enumerate() {
        let Some(found) = next.next_if(|found| found.interval == j) else {
            out.extend_from_slice(own);
            continue;
        };
        let direction: Vec<f64> = own[..found.end.len()].iter().chain(scalars).copied().collect();
        let rows = found.parts.iter().flat_map(|part| part.by.chunks_exact(direction.len()));
        out.extend(rows.map(|row| dot(row, &direction)));
    }
    out.extend_from_slice(scalars);
    out
}

/// Replaces the value at the last node, so that the polynomial from `left` through the nodes `[m][size]` ends at `end`.
pub(crate) fn fit(scheme: &Scheme, left: &[f64], nodes: &mut [f64], end: &[f64]) {
    let (m, size) = (scheme.degree, end.len());
    let (others, last) = nodes.split_at_mut((m - 1) * size);
    for (k, to) in last.iter_mut().enumerate() {
        let rest = (0..m - 1).map(|i| scheme.end[i + 1] * others[i * size + k]).sum::<f64>();
        *to = (end[k] - scheme.end[0] * left[k] - rest) / scheme.end[m];
    }
}

/// The first stretch between two places on which margins become negative by more than `zero`, an extremum between them included.
fn violated(places: &[f64], margins: &[f64], zero: f64, at: &dyn Fn(f64) -> f64) -> Option<[f64; 2]> {
    let last = places.len() - 1;
    let first = (1..=last).find(|k| margins[*k] < -zero);
    let until = first.unwrap_or(last);
    for k in 1..until.max(2).min(last) {
        let (s, v) = ([places[k - 1], places[k], places[k + 1]], [margins[k - 1], margins[k], margins[k + 1]]);
        let Some(place) = lowest(s, v, at) else { continue };
        if place < places[until] && at(place) < -zero {
            let before = places.iter().rposition(|p| *p < place).unwrap_or(0);
            return Some([places[before], place]);
        }
    }
    first.map(|k| [places[k - 1], places[k]])
}

/// Place of the minimum between three places, by parabolas.
fn lowest(mut s: [f64; 3], mut v: [f64; 3], at: &dyn Fn(f64) -> f64) -> Option<f64> {
    const ROUNDS: usize = 4;
    let bounds = [s[0], s[2]];
    let mut found = None;
    for _ in 0..ROUNDS {
        let (a, b) = ((v[1] - v[0]) / (s[1] - s[0]), (v[2] - v[1]) / (s[2] - s[1]));
        let bend = (b - a) / (s[2] - s[0]);
        let place = 0.5 * (s[0] + s[1]) - 0.5 * a / bend;
        if !(bend > 0.0 && place > bounds[0] && place < bounds[1]) {
            return found;
        }
        let low = v[1] - 0.25 * bend * (s[2] - s[0]).powi(2);
        // Far from zero it need not be known any better.
        if found.is_none() && low > 0.0 && place > s[0] && v.iter().all(|v| *v > 0.0) && low > 0.5 * v[1] {
            return None;
        }
        found = Some(place);
        let step = (0.125 * (s[2] - s[0])).min(place - bounds[0]).min(bounds[1] - place);
        if step < 1e-12 {
            return found;
        }
        s = [place - step, place, place + step];
        v = s.map(at);
    }
    found
}

/// A zero between `left`, where the function is not negative, and `right`, where it is.
fn root(at: &dyn Fn(f64) -> f64, mut left: f64, mut right: f64) -> f64 {
    const ROUNDS: usize = 60;
    let (mut a, mut b) = (at(left), at(right));
    if a <= 0.0 {
        return left;
    }
    let mut stayed = 0;
    for _ in 0..ROUNDS {
        let secant = left + (right - left) * a / (a - b);
        let middle = if secant > left && secant < right { secant } else { 0.5 * (left + right) };
        if middle <= left || middle >= right {
            break;
        }
        let value = at(middle);
        if value == 0.0 {
            return middle;
        }
        // The Illinois rule: an end that stays a second time counts half.
        if value > 0.0 {
            (left, a) = (middle, value);
            b *= if stayed == 1 { 0.5 } else { 1.0 };
            stayed = 1;
        } else {
            (right, b) = (middle, value);
            a *= if stayed == -1 { 0.5 } else { 1.0 };
            stayed = -1;
        }
        if (right - left).abs() < f64::EPSILON {
            break;
        }
    }
    0.5 * (left + right)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Definition, Model, ModelSource, Parameter, State};
    use crate::problem::Axis;

    /// A forced oscillator with the given force of its contact; parameters p and k.
    fn model(force: &str) -> Model {
        Model::compile(ModelSource {
            name: "contact".into(),
            parameters: vec![Parameter::new("p", 0.4), Parameter::new("k", 3.0)],
            states: vec![State::new("x"), State::new("v")],
            equations: vec![Definition::new("x", "v"), Definition::new("v", &format!("-x - 0.1*v - {force}"))],
            ..ModelSource::default()
        })
        .unwrap()
    }

    fn flow<'a>(setting: &'a Setting<'a>, scalars: &[f64], x: &[f64], ends: [f64; 2]) -> Option<Switched> {
        let scheme = Scheme::of(4);
        let flow = PiecewiseFlow::new(setting, scheme, scalars, 0);
        let sizes = vec![1.0; setting.field.switch_count()];
        flow.along(0, x, ends, &x.repeat(5), &sizes).ok()
    }

    /// Derivatives of the end, and of the derivatives, against differences.
    #[test]
    fn derivatives_through_switchings_are_those_of_the_flow() {
        for (force, start) in [
            ("k*max(x - p, 0)", [0.35, 0.9]),
            ("if(x > p, k*(x - p)^2 + x - p, 0)", [0.35, 0.9]),
            ("k*heaviside(v - p)", [0.3, 0.55]),
        ] {
            let (model, scales) = (model(force), [1.0, 1.0]);
            let axes = vec![Axis::new(0, 1.0), Axis::new(1, 1.0)];
            let setting = Setting { field: &model, scales: &scales, parameters: vec![0.4, 3.0], axes };
            let (scalars, ends, n, width) = ([0.2, 0.4, 3.0], [0.1, 0.7], 2, 5);
            let own = flow(&setting, &scalars, &start, ends).unwrap();
            assert!(own.parts.len() > 1, "{force}");
            let direction = [0.3, -0.2, 0.02, 0.25, 0.4];
            let moved = |by: f64| {
                let at = |k: usize| if k < n { start[k] } else { scalars[k - n] };
                let all: Vec<f64> = (0..width).map(|k| at(k) + by * direction[k]).collect();
                flow(&setting, &all[n..], &all[..n], ends).unwrap()
            };
            let step = 1e-5;
            let (more, less) = (moved(step), moved(-step));
            for c in 0..n {
                let exact = dot(&own.end_by[c * width..(c + 1) * width], &direction);
                let difference = (more.end[c] - less.end[c]) / (2.0 * step);
                assert!((exact - difference).abs() < 1e-8, "{force}: {exact} {difference}");
            }
            let flow = PiecewiseFlow::new(&setting, Scheme::of(4), &scalars, 0);
            let exact = flow.varied(&own, &start, ends, &direction[..n], &direction[n..]).unwrap();
            let [more, less] = [more, less].map(|own| own.derivatives(Scheme::of(4), ends));
            for (k, exact) in exact.iter().enumerate() {
                let difference = (more[k] - less[k]) / (2.0 * step);
                assert!((exact - difference).abs() < 1e-6, "{force} {k}: {exact} {difference}");
            }
        }
    }

    /// Contact with x'' = -4 x lasts π/2.
    #[test]
    fn a_contact_ends_when_its_spring_has_relaxed() {
        let model = Model::compile(ModelSource {
            states: vec![State::new("x"), State::new("v")],
            equations: vec![Definition::new("x", "v"), Definition::new("v", "-x - 3*max(x, 0)")],
            ..ModelSource::default()
        })
        .unwrap();
        let setting = Setting { field: &model, scales: &[1.0, 1.0], parameters: vec![], axes: vec![] };
        // Late in the contact: 0.1 before its end, x = sin(2 t)/2.
        let (x, v) = (0.5 * 0.2f64.sin(), -(0.2f64.cos()));
        let own = flow(&setting, &[1.0], &[x, v], [0.0, 0.15]).unwrap();
        assert_eq!(own.parts.len(), 2);
        let leaves = own.parts[0].ends[1];
        assert!((leaves - 0.1).abs() < 1e-11, "{leaves}");
    }

    #[test]
    fn an_extremum_between_sections_is_found() {
        for depth in [1e-2, 1e-4, 1e-8, 1e-11] {
            let at = |s: f64| (s - 0.51234f64).powi(2) - depth;
            let places: Vec<f64> = (0..=SECTIONS).map(|k| k as f64 / SECTIONS as f64).collect();
            let margins: Vec<f64> = places.iter().map(|s| at(*s)).collect();
            let [left, right] = violated(&places, &margins, 0.0, &at).unwrap_or_else(|| panic!("{depth}"));
            let place = root(&at, left, right);
            assert!((place - (0.51234 - depth.sqrt())).abs() < 1e-9, "{depth}: {place}");
        }
    }
}
