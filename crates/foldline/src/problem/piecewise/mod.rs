//! Intervals in which an orbit passes a switch of the vector field.
//!
//! **Idea.** A single collocation polynomial is accurate only where f is smooth. An interval in which the orbit crosses
//! a switching surface is cut at the crossings; each part has its own polynomial and its own branch of f. The equations
//! of the interval require its inner nodes and its right end to lie on this piecewise flow. The unknowns of the orbit
//! do not change, and the sequence of crossings need not be known: every Newton step reads it off the flow. A branch
//! therefore passes a grazing like any other point.
//!
//! **Equations.** On an interval of length ℓ (in the time of the field), with parts [t_p, t_{p+1}] of the branch σ_p of
//! f:
//!
//! ```text
//!   (1)  Y_i = y + ℓ_p Σ_k a_ik f_{σ_p}(Y_k),   y⁺ = Σ_k e_k Y_k             collocation on a part, from its left end y
//!   (2)  h_s(y⁺) = 0                                                       its right end, where the switch s changes sign
//!   (3)  V_i = V + ℓ_p Σ_k a_ik (f_x V_k + f_σ),   V⁺ = Σ_k e_k V_k          derivatives in the left end and the scalars
//!   (4)  V ← V⁺ + (f⁻ - f⁺) δt,   δt = -(∇h·V⁺ + h_σ) / (∇h·f⁻ + h_t)      at a switching at which f jumps
//! ```
//!
//! Where f on both sides leads to the surface, f⁺ in (4) is the motion along it (sign 0), which ends where f on one side
//! no longer does. V⁺ is then tangent to the surface: one direction is lost. Starting beside the surface, on either
//! side, gives the same derivatives in the limit, so that it need not be known whether an interval begins on it.
//!
//! If f is continuous at the surface, (4) leaves V unchanged, because to first order the crossing times do not matter.
//! The flow is then continuously differentiable, also where the orbit grazes the surface. So that this holds for its
//! discretisation as well, an interval is also cut where the orbit comes close to a surface and turns away from it: the
//! cut is the limit of a contact of vanishing length.
//!
//! A part on which f changes much faster than elsewhere, such as a short contact with a stiff stop in a long interval, is
//! divided into parts of the length that one polynomial represents.
//!
//! **Source.** leine2004 (saltation matrix); filippov1988, §4 (sliding). The extremum test: shampine2000.
//!
//! **Fails when** the orbit slides along two surfaces at once, or passes too many surfaces within one interval
//! ([`Obstacle`]).

mod parts;
mod search;
mod second;
mod sliding;

use super::Setting;
use super::gauss::Scheme;
use crate::contract::{Batch, Parameters};
use crate::linalg::{dot, lu, max_abs, panel};
pub(crate) use parts::{Part, Switched, cut, cut_direction, fit, identity};
use search::{Met, Trial};
pub(crate) use sliding::OneBranch;

/// Switchings in an interval. More within one interval of a mesh that is made for the tolerance is chatter.
const MOST: usize = 64;
/// Value of a switch, relative to its largest, at which its zero has been located: at a grazing the time of the zero is
/// poorly determined, and matters little.
const NEARLY: f64 = 1e-9;
/// Number of times that a part is halved where Newton's method does not converge on it.
const HALVINGS: i32 = 10;
/// Value of a switch, relative to its largest along the orbit, below which an interval on which it hardly changes may be
/// a slide: an iterate of Newton's method that is farther off is useless.
const CLOSE: f64 = 0.01;
/// Value of a switch, relative to its largest along the orbit, that counts as zero: rounding of the state.
const ZERO: f64 = 1e-13;
/// Length of a part, relative to its interval, below which it is left out: what f changes on it is then rounding.
const SHORTEST: f64 = 1e-12;
/// Jump of f, relative to the larger side and besides rounding, below which f is continuous.
const CONTINUOUS: f64 = 1e-9;
/// Longest part, in units of the time in which f changes: one polynomial of degree 4 has an error of 1e-6 on it. A stop
/// that is stiffer than what the mesh was made for begins within a long interval.
const REACH: f64 = 1.5;
/// Shortest part of a division, relative to its interval: a stop against which the orbit rests for long need not be
/// resolved further.
const FINEST: f64 = 1e-3;
/// Function of the nodes of a part, its ends, and a place in it.
type OnPart<'a> = dyn Fn(&[f64], [f64; 2], f64) -> f64 + 'a;

/// Reason why an orbit cannot be computed on an interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Obstacle {
    /// It slides along several switching surfaces at once.
    Slides,
    /// It passes more switching surfaces than are computed on one interval.
    Chatters,
    /// Newton's method does not converge on a part.
    Lost,
}

impl Obstacle {
    /// Sentence for messages.
    pub fn name(self) -> &'static str {
        match self {
            Obstacle::Slides => "the orbit slides along two switching surfaces at once",
            Obstacle::Chatters => "the orbit crosses switching surfaces dozens of times within one mesh interval",
            Obstacle::Lost => "the motion between two switchings could not be computed",
        }
    }
}

/// A solved part: its nodes `[m + 1][n]`, f_x at the Gauss points `[n·n × m]` and the matrix of the last Newton step.
struct Solved {
    nodes: Vec<f64>,
    fx: Vec<f64>,
    /// L and U of 1 - ℓ a f_x, and the pivots.
    matrix: Vec<f64>,
    pivots: Vec<usize>,
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

impl<'a> PiecewiseFlow<'a> {
    /// Flow for the scalars (T, λ₁ … λ_k) of an orbit.
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

    /// Time of the field at normalised time t; `None` if the field is autonomous.
    fn time(&self, t: f64) -> Option<f64> {
        (self.forcing_periods > 0).then(|| f64::from(self.forcing_periods) * t)
    }

    fn switches(&self, states: &[f64], times: &[f64]) -> Vec<f64> {
        self.switches_given(states, times, &[])
    }

    /// Switches of which those that depend on the branches of others take the branches of these signs, unless the orbit
    /// slides.
    fn switches_given(&self, states: &[f64], times: &[f64], signs: &[f64]) -> Vec<f64> {
        let (field, lanes) = (self.setting.field, states.len() / self.n());
        let mut values = vec![0.0; field.switch_count() * lanes];
        let signs: Vec<f64> = match signs.contains(&0.0) {
            true => Vec::new(),
            false => signs.iter().flat_map(|sign| std::iter::repeat_n(*sign, lanes)).collect(),
        };
        field.switches(
            Batch { lanes, states, parameters: Parameters::Shared(&self.parameters), times, signs: &signs },
            &mut values,
        );
        // f does not depend on the signs of events, and a motion that has none crosses no surface where it touches one.
        let kinks = (field.switch_count() - field.event_count()) * lanes;
        values[kinks..].fill(1.0);
        values
    }

    /// Switches whose values jump across their surfaces where another one passes: they take the branches of its new sign.
    fn companions(&self, x: &[f64], t: f64, signs: &[f64], switch: usize) -> Vec<usize> {
        let time = self.time(t);
        let mut after = signs.to_vec();
        after[switch] = -after[switch];
        let [old, new] = [signs, &after].map(|signs| self.switches_given(x, time.as_slice(), signs));
        let jumps = |k: &usize| *k != switch && signs[*k] * old[*k] > 0.0 && signs[*k] * new[*k] < 0.0;
        (0..signs.len()).filter(jumps).collect()
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
            if found.switches() {
                all.push(found);
            }
        }
        Ok(all)
    }

    /// Values that the flow from `x` over an interval requires at the inner nodes, `[m][n]`, and its right end. `nodes` is a
    /// polynomial close to it, and `orbit` the profile and the mesh to which the interval belongs.
    pub fn through(
        &self,
        interval: usize,
        x: &[f64],
        ends: [f64; 2],
        nodes: &[f64],
        [profile, mesh]: [&[f64]; 2],
    ) -> Option<(Vec<f64>, Vec<f64>)> {
        let (_, sizes) = self.suspects(profile, mesh);
        let found = self.along(interval, x, ends, nodes, &sizes).ok()?;
        Some((found.inner(self.scheme, ends), found.end))
    }

    /// The intervals in which a switch could vanish, and the largest value of every switch: it changes by as much as its
    /// smallest value at the nodes, or f leads to its zero in the time of the interval, which the nodes of an orbit that
    /// slides do not show.
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
        let last = self.at_right_end(profile, mesh, &values);
        let could = |switch: usize, j: usize| {
            let own = &values[switch * lanes..(switch + 1) * lanes];
            // With the left end of the next interval.
            let next = if j + 1 < intervals { own[j + 1] } else { last[switch] };
            let there = (0..nodes).map(|g| own[g * intervals + j]).chain([next]);
            let [low, high] = there.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
            let near = low.abs().min(high.abs());
            let leads_there = || {
                let x = &profile[j * nodes * n..(j * nodes + 1) * n];
                let signs: Vec<f64> = values.iter().skip(j).step_by(lanes).map(|v| v.signum()).collect();
                let speed = self.normal_speed(x, mesh[j], &signs, switch);
                // Twice the distance that f covers, since it varies.
                own[j] * speed < 0.0 && near < 2.0 * speed.abs() * self.scalars[0] * (mesh[j + 1] - mesh[j])
            };
            low <= 0.0 && high >= 0.0 || near < high - low || near < CLOSE * sizes[switch] && leads_there()
        };
        let suspects = (0..intervals).filter(|j| (0..sizes.len()).any(|switch| could(switch, *j))).collect();
        (suspects, sizes)
    }

    /// The switches at the right end of the last interval, which an orbit that closes has in common with the first; `values`
    /// are those at all nodes.
    fn at_right_end(&self, profile: &[f64], mesh: &[f64], values: &[f64]) -> Vec<f64> {
        let (n, nodes, lanes) = (self.n(), self.scheme.degree + 1, (mesh.len() - 1) * (self.scheme.degree + 1));
        if self.setting.field.conditions() == [0, 0] {
            return values.iter().step_by(lanes).copied().collect();
        }
        let mut x = vec![0.0; n];
        self.scheme.value_into(1.0, &profile[profile.len() - nodes * n..], &mut x);
        self.switches(&x, self.time(mesh[mesh.len() - 1]).as_slice())
    }

    /// Flow from `x` over an interval; `guess` `[m + 1][n]` is a polynomial close to it.
    ///
    /// # Errors
    /// See [`Obstacle`].
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
            nears: false,
            sizes: sizes.to_vec(),
            at_start: Vec::new(),
            trace: 0.0,
            end: x.to_vec(),
            end_by: identity(n, width),
        };
        let (mut begin, mut passed, mut count, mut halvings) = (ends[0], Vec::new(), 0, 0);
        let (length, mut touched) = (ends[1] - ends[0], None);
        loop {
            let within = |t: f64| (t - ends[0]) / length;
            // A branch of f need not be defined far beyond its surface.
            let trials = (halvings..=HALVINGS).map(|k| {
                let last = if k == 0 { ends[1] } else { begin + (ends[1] - begin) * 0.5f64.powi(k) };
                let from = self.restricted(guess, [within(begin), within(last)]);
                self.resolved(&found.end, [begin, last], length, &signs, from)
            });
            let (last, part) = trials.flatten().next().ok_or(Obstacle::Lost)?;
            let trial = Trial {
                nodes: &part.nodes,
                ends: [begin, last],
                signs: &signs,
                passed: &passed,
                touched,
                whole: length,
            };
            let (at, switch, side) = match self.first(&trial, sizes) {
                Met::Nothing => {
                    self.close(&mut found, [begin, last], part, &signs).ok_or(Obstacle::Lost)?;
                    if last == ends[1] {
                        return Ok(found);
                    }
                    (begin, halvings, touched) = (last, 0, None);
                    passed.clear();
                    continue;
                }
                Met::Near(at, switch) => {
                    let end = begin + at * (last - begin);
                    let from = self.restricted(&part.nodes, [0.0, at]);
                    let part = self.solved(&found.end, [begin, end], &signs, from).ok_or(Obstacle::Lost)?;
                    self.close(&mut found, [begin, end], part, &signs).ok_or(Obstacle::Lost)?;
                    (begin, halvings, touched) = (end, 0, Some(switch));
                    found.nears = true;
                    passed.clear();
                    continue;
                }
                // A tangency to rounding where f is continuous; where f jumps the orbit slides.
                Met::Back(switch) if count <= MOST && self.is_continuous(&found.end, begin, &signs, switch) => {
                    count += 1;
                    let companions = self.companions(&found.end, begin, &signs, switch);
                    companions.into_iter().chain([switch]).for_each(|k| signs[k] = -signs[k]);
                    continue;
                }
                Met::Back(switch) => (0.0, switch, 0.0),
                Met::At(at, switch) => (at, switch, 0.0),
                Met::Leaves(at, switch, side) => (at, switch, side),
            };
            count += 1;
            if count > MOST {
                return Err(Obstacle::Chatters);
            }
            let value = |nodes: &[f64], ends: [f64; 2], s: f64| match side {
                0.0 => self.switch(nodes, ends, s, switch, &signs),
                _ => self.push(nodes, ends, s, &signs, switch, side),
            };
            let part = self.until(&found.end, [begin, last], at, &signs, &part.nodes, &value).ok_or(Obstacle::Lost)?;
            let (end, part) = part;
            // A trial that is far off the part does not show where it ends.
            let size = if side == 0.0 { sizes[switch] } else { value(&part.nodes, [begin, end], 0.0).abs() };
            if halvings < HALVINGS && value(&part.nodes, [begin, end], 1.0).abs() > NEARLY * size {
                halvings += 1;
                continue;
            }
            halvings = 0;
            let passes = end - begin > SHORTEST * length;
            if passes {
                self.close(&mut found, [begin, end], part, &signs).ok_or(Obstacle::Lost)?;
            }
            if found.parts.is_empty() {
                found.at_start.push((signs.clone(), switch));
            }
            let companions = if side == 0.0 { self.companions(&found.end, end, &signs, switch) } else { Vec::new() };
            signs[switch] = match side {
                0.0 => self.pass(&mut found, end, &signs, (switch, &companions), passes)?,
                // f is continuous where a slide ends.
                _ => side,
            };
            if signs[switch] != 0.0 {
                companions.iter().for_each(|k| signs[*k] = -signs[*k]);
            }
            touched = None;
            // A shorter part is left out, and the next one begins in its place.
            if passes {
                begin = end;
                passed.clear();
            }
            passed.push(switch);
            if begin >= ends[1] {
                return Ok(found);
            }
        }
    }

    /// Signs of the switches just before `x`, at normalised time `t`: a switching at the left end of an interval
    /// belongs to it.
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
        let vanishes = |k: &usize| values[*k].abs() <= ZERO * sizes[*k];
        for k in (0..signs.len()).filter(vanishes) {
            let speed = dot(&hx[k * n..(k + 1) * n], &f) + ht[k];
            signs[k] = if speed == 0.0 { signs[k] } else { -speed.signum() };
        }
        // Others take the branches of these signs.
        let given = self.switches_given(x, time.as_slice(), &signs);
        for k in (0..signs.len()).filter(|k| !vanishes(k)) {
            signs[k] = if given[k] > 0.0 { 1.0 } else { -1.0 };
        }
        signs
    }

    /// The part from `begin` to where a function of its nodes, ends and a place in it vanishes, near the place `at` of a
    /// trial to `last`: its right end and its nodes.
    fn until(
        &self,
        x: &[f64],
        [begin, last]: [f64; 2],
        at: f64,
        signs: &[f64],
        trial: &[f64],
        value: &OnPart,
    ) -> Option<(f64, Solved)> {
        let mut end = begin + at * (last - begin);
        let mut part = self.solved(x, [begin, end], signs, self.restricted(trial, [0.0, at]))?;
        // From the root of the trial to that of the part, which is more accurate at its end.
        for _ in 0..4 {
            let [last_but_one, own] = [1.0 - 1e-4, 1.0].map(|s| value(&part.nodes, [begin, end], s));
            let off = own / (own - last_but_one) * 1e-4;
            let moved = (end - off * (end - begin)).min(last);
            // At a grazing the crossing time is poorly determined, and matters little.
            if !off.is_finite() || off.abs() > 0.1 || (moved - end).abs() < 1e-15 {
                break;
            }
            let share = (moved - begin) / (end - begin);
            let from = self.restricted(&part.nodes, [0.0, share]);
            let settled = (moved - end).abs() < 1e-11 * (end - begin);
            end = moved;
            part = self.solved(x, [begin, end], signs, from)?;
            // The slope of the secant is right to four digits.
            if settled {
                break;
            }
        }
        Some((end, part))
    }

    /// The part from `begin` to `end`, or to where one polynomial no longer represents it: its end and the part. `inner`
    /// are Gauss points of the whole to begin with, `whole` is the length of the interval. The length is a continuous
    /// function of the state, so that the flow is one too.
    fn resolved(
        &self,
        x: &[f64],
        [begin, end]: [f64; 2],
        whole: f64,
        signs: &[f64],
        mut inner: Vec<f64>,
    ) -> Option<(f64, Solved)> {
        /// Reach within a part, relative to that at its left end, below which the part is too long: f may become stiff
        /// on the way.
        const LESS: f64 = 0.5;
        let mut last = end;
        let shorten = |last: &mut f64, inner: &mut Vec<f64>, reach: f64| {
            let next = begin + reach.max(FINEST * whole);
            if next < *last - SHORTEST * whole {
                let nodes = [x, &inner[..]].concat();
                *inner = self.restricted(&nodes, [0.0, (next - begin) / (*last - begin)]);
                *last = next;
            }
        };
        shorten(&mut last, &mut inner, self.reach_at(x, begin, signs));
        loop {
            let whole_part = last;
            let part = self.solved(x, [begin, last], signs, inner)?;
            let reach = self.reach_of(&part.fx, self.scheme.degree);
            if reach >= LESS * (last - begin) || last - begin <= FINEST * whole {
                return Some((last, part));
            }
            inner = part.nodes[self.n()..].to_vec();
            shorten(&mut last, &mut inner, reach);
            if last == whole_part {
                return Some((last, part));
            }
        }
    }

    /// Longest part, in normalised time, with these f_x `[n·n × lanes]`.
    fn reach_of(&self, fx: &[f64], lanes: usize) -> f64 {
        let n = self.n();
        let pairs = (0..n * n).flat_map(|k| (0..lanes).map(move |lane| (k, lane)));
        // In any units: diagonal entries, and products of entries across the diagonal.
        let squares = pairs.map(|(k, lane)| (fx[k * lanes + lane] * fx[(k % n * n + k / n) * lanes + lane]).abs());
        let reach = REACH / (squares.fold(0.0, f64::max).sqrt() * self.scalars[0]);
        if reach.is_nan() { f64::INFINITY } else { reach }
    }

    fn reach_at(&self, x: &[f64], t: f64, signs: &[f64]) -> f64 {
        let (n, time, parameters) = (self.n(), self.time(t), Parameters::Shared(&self.parameters));
        let [mut f, mut fx] = [n, n * n].map(|size| vec![0.0; size]);
        let batch = Batch { lanes: 1, states: x, parameters, times: time.as_slice(), signs };
        self.setting.field.linearise(batch, &[], &mut f, &mut fx, &mut []);
        self.reach_of(&fx, 1)
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

    /// A polynomial at the right end of its part, from its values at the nodes `[m + 1][size]`.
    fn at_end(&self, values: &[f64], size: usize) -> Vec<f64> {
        let mut out = vec![0.0; size];
        for (e, own) in self.scheme.end.iter().zip(values.chunks_exact(size)) {
            out.iter_mut().zip(own).for_each(|(o, v)| *o += e * v);
        }
        out
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

    /// (1): a part from `x`, by Newton's method from its Gauss points `[m][n]`. The matrix is kept while it gains more
    /// than a digit per step.
    fn solved(&self, x: &[f64], ends: [f64; 2], signs: &[f64], mut inner: Vec<f64>) -> Option<Solved> {
        /// Error, relative, that counts as none, and update that is accepted where rounding stops the convergence.
        const ROUNDED: [f64; 2] = [1e-15, 1e-9];
        const ROUNDS: usize = 16;
        let (n, m, field) = (self.n(), self.scheme.degree, self.setting.field);
        let (length, times) = self.course(ends);
        let signs: Vec<f64> = signs.iter().flat_map(|sign| std::iter::repeat_n(*sign, m)).collect();
        let [mut f, mut fx] = [n, n * n].map(|size| vec![0.0; size * m]);
        let (mut matrix, mut pivots) = (Vec::new(), vec![0; n * m]);
        let scale = |c: usize| self.setting.scales[c].max(x[c].abs());
        let (mut before, mut fresh) = (f64::INFINITY, true);
        for round in 0..ROUNDS {
            let states = self.lanes(&inner);
            let parameters = Parameters::Shared(&self.parameters);
            let batch = Batch { lanes: m, states: &states, parameters, times: &times, signs: &signs };
            match fresh {
                true => field.linearise(batch, &[], &mut f, &mut fx, &mut []),
                false => field.evaluate(batch, &mut f),
            }
            let mut change = vec![0.0; n * m];
            for (i, row) in change.chunks_exact_mut(n).enumerate() {
                for c in 0..n {
                    let rates = &f[c * m..(c + 1) * m];
                    let rise = dot(&self.scheme.integration[i * m..(i + 1) * m], rates);
                    row[c] = inner[i * n + c] - x[c] - length * rise;
                }
            }
            if fresh {
                matrix = self.matrix(length, &fx);
                lu::factorise_scaled(&mut matrix, n * m, &mut pivots, self.setting.scales).ok()?;
            }
            lu::solve(&matrix, n * m, &pivots, &mut change, 1);
            inner.iter_mut().zip(&change).for_each(|(x, d)| *x -= d);
            let off = change.iter().enumerate().map(|(k, d)| (d / scale(k % n)).abs()).fold(0.0, f64::max);
            if !off.is_finite() {
                return None;
            }
            // What is left: quadratic convergence with a new matrix, linear with an old one.
            let ratio = off / before;
            let left = if fresh { off * off } else { off * ratio };
            let stalls = off < ROUNDED[1] && ratio > 0.3;
            if off < 10.0 * ROUNDED[0] || left < ROUNDED[0] && (round > 0 || off < 1e-8) || stalls {
                let nodes = [x, &inner].concat();
                return Some(Solved { nodes, fx, matrix, pivots });
            }
            fresh = round > 0 && ratio > 0.1;
            before = off;
        }
        if before >= ROUNDED[1] {
            return None;
        }
        Some(Solved { nodes: [x, &inner].concat(), fx, matrix, pivots })
    }

    /// Appends a part with its derivatives (3), and moves the end there.
    fn close(&self, found: &mut Switched, ends: [f64; 2], part: Solved, own_signs: &[f64]) -> Option<()> {
        let (n, m, width, k) = (self.n(), self.scheme.degree, self.width(), self.scalars.len() - 1);
        let (length, times) = self.course(ends);
        let Solved { nodes, fx: known, mut matrix, mut pivots, .. } = part;
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
        // Where f is linear, the matrix of the last Newton step is that of the solution.
        if fx != known {
            matrix = self.matrix(length, &fx);
            lu::factorise_scaled(&mut matrix, n * m, &mut pivots, self.setting.scales).ok()?;
        }
        lu::solve(&matrix, n * m, &pivots, &mut inner, width);
        let by = [&found.end_by[..], &inner].concat();
        found.end = self.at_end(&nodes, n);
        found.end_by = self.at_end(&by, n * width);
        let trace: f64 =
            (0..n).map(|c| dot(&self.scheme.weights, &fx[(c * n + c) * m..(c * n + c + 1) * m])).sum::<f64>() * length;
        let (signs, switch, jumps) = (own_signs.to_vec(), None, false);
        found.parts.push(Part { ends, nodes, by, signs, switch, jumps, trace });
        found.end.iter().chain(&found.end_by).all(|x| x.is_finite()).then_some(())
    }

    /// f on both sides of a switch that vanishes at `x`, evaluated on the surface itself, and the part of each component
    /// of their difference that is rounding of the state. A kink of a stiff spring would otherwise look like a jump.
    fn sides(
        &self,
        x: &[f64],
        t: f64,
        signs: &[f64],
        (switch, companions): (usize, &[usize]),
    ) -> ([Vec<f64>; 2], Vec<f64>) {
        let (n, time, scales) = (self.n(), self.time(t), self.setting.scales);
        let parameters = Parameters::Shared(&self.parameters);
        let at = |states: &'_ [f64]| -> [Vec<f64>; 4] {
            let batch = Batch { lanes: 1, states, parameters, times: time.as_slice(), signs: &[] };
            self.setting.linearise_switches(batch)
        };
        let [h, hx, _, _] = at(x);
        let gradient = &hx[switch * n..(switch + 1) * n];
        let square: f64 = gradient.iter().zip(scales).map(|(g, scale)| (g * scale).powi(2)).sum();
        let onto = if square > 0.0 { h[switch] / square } else { 0.0 };
        let x: Vec<f64> = (0..n).map(|c| x[c] - onto * gradient[c] * scales[c] * scales[c]).collect();
        let mut signs = signs.to_vec();
        let sides = [(); 2].map(|()| {
            let [mut f, mut fx] = [n, n * n].map(|size| vec![0.0; size]);
            let batch = Batch { lanes: 1, states: &x, parameters, times: time.as_slice(), signs: &signs };
            self.setting.field.linearise(batch, &[], &mut f, &mut fx, &mut []);
            companions.iter().chain([&switch]).for_each(|k| signs[*k] = -signs[*k]);
            (f, fx)
        });
        let [(f, fx), (other, other_fx)] = sides;
        let rounded = |c: usize| -> f64 {
            let own = (0..n).map(|d| ((fx[c * n + d] - other_fx[c * n + d]) * scales[d].max(x[d].abs())).abs());
            4.0 * f64::EPSILON * own.fold(0.0, f64::max)
        };
        let rounding = (0..n).map(rounded).collect();
        ([f, other], rounding)
    }

    fn is_continuous(&self, x: &[f64], t: f64, signs: &[f64], switch: usize) -> bool {
        let companions = self.companions(x, t, signs, switch);
        let ([before, after], rounding) = self.sides(x, t, signs, (switch, &companions));
        self.same(&before, &after, &rounding)
    }

    fn same(&self, before: &[f64], after: &[f64], rounding: &[f64]) -> bool {
        let size = |of: &dyn Fn(usize) -> f64| {
            (0..self.n()).map(|c| (of(c) / self.setting.scales[c]).abs()).fold(0.0, f64::max)
        };
        let jump = size(&|c| ((after[c] - before[c]).abs() - rounding[c]).max(0.0));
        jump <= CONTINUOUS * size(&|c| before[c]).max(size(&|c| after[c]))
    }

    /// (4) at the end of the last part, which is at time `t`; `signs` are those of that part. Returns the sign of the
    /// switch from there on, 0 if the flow slides along its surface.
    fn pass(
        &self,
        found: &mut Switched,
        t: f64,
        signs: &[f64],
        (switch, companions): (usize, &[usize]),
        ends: bool,
    ) -> Result<f64, Obstacle> {
        let x = found.end.clone();
        let ([before, mut after], rounding) = self.sides(&x, t, signs, (switch, companions));
        let jumps = !self.same(&before, &after, &rounding);
        if let Some(last) = found.parts.last_mut().filter(|_| ends) {
            (last.switch, last.jumps) = (Some(switch), jumps);
        }
        found.jumps |= jumps;
        if !jumps {
            return Ok(-signs[switch]);
        }
        let (n, width, time) = (self.n(), self.width(), self.time(t));
        let parameters = Parameters::Shared(&self.parameters);
        let batch = Batch { lanes: 1, states: &x, parameters, times: time.as_slice(), signs: &[] };
        let [_, hx, hp, ht] = self.setting.linearise_switches(batch);
        let (gradient, in_time, k) = (&hx[switch * n..(switch + 1) * n], ht[switch], width - n - 1);
        let in_scalar = &hp[switch * k..(switch + 1) * k];
        let [speed, speed_after] = [&before, &after].map(|f| dot(gradient, f) + in_time);
        if speed == 0.0 || !speed.is_finite() || !speed_after.is_finite() {
            return Err(Obstacle::Lost);
        }
        let crosses = speed * speed_after > 0.0;
        if !crosses {
            let with = (0..signs.len()).filter(|k| signs[*k] == 0.0);
            if !with.into_iter().all(|k| self.setting.field.are_independent(k, switch)) {
                return Err(Obstacle::Slides);
            }
            after = self.along_surface(&x, t, signs, switch);
        }
        for column in 0..width {
            let own = (0..n).map(|c| gradient[c] * found.end_by[c * width + column]).sum::<f64>();
            let direct = column.checked_sub(n + 1).map_or(0.0, |k| in_scalar[k]);
            let shift = -(own + direct) / speed;
            (0..n).for_each(|c| found.end_by[c * width + column] += (before[c] - after[c]) * shift);
        }
        // A direction that is lost has determinant 0.
        let trace = if crosses { (speed_after / speed).ln() } else { f64::NEG_INFINITY };
        match found.parts.last_mut() {
            Some(last) => last.trace += trace,
            None => found.trace += trace,
        }
        Ok(if crosses { -signs[switch] } else { 0.0 })
    }

    /// One switch at a place of a polynomial.
    fn switch(&self, nodes: &[f64], [begin, end]: [f64; 2], s: f64, switch: usize, signs: &[f64]) -> f64 {
        let mut x = vec![0.0; self.n()];
        self.scheme.value_into(s, nodes, &mut x);
        self.switches_given(&x, self.time(begin + s * (end - begin)).as_slice(), signs)[switch]
    }

    /// The right end `[n]` and the transition `[n × n]` of an interval from parts of half the length: more accurate than
    /// its own.
    pub fn refined(&self, own: &Switched, x: &[f64], [begin, end]: [f64; 2], nodes: &[f64]) -> Option<[Vec<f64>; 2]> {
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
        let transition = (0..n * n).map(|k| entry(k / n, k % n)).collect();
        Some([second.end, transition])
    }
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
}
