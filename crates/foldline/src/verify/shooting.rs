//! Cycles by multiple shooting.
//!
//! **Idea.** A cycle is cut into segments at some of its mesh points. Each is integrated with the variational
//! equations, and Newton's method makes the end of each segment the start of the next. Segments keep growing directions
//! from dominating all others.
//!
//! **Equations.** Nodes x_i, i = 0 … K-1, x_K = x_0; φ the flow; s_i the share of the period between x_i and x_{i+1}; k
//! free parameters λ:
//!
//! ```text
//!   (1)  φ(x_i; s_i T, λ) - x_{i+1} = 0
//!   (2)  Σ_i ⟨f(x̃_i), x_i - x̃_i⟩ = 0                    phase, x̃ the initial nodes
//!   (3)  ⟨c_r, (x, T, λ) - (x, T, λ)~⟩ = d_r             r = 1 … k
//! ```
//!
//! The period T of a forced cycle is prescribed, which replaces (2).
//!
//! Without rows c the shortest update is taken, towards the nearest solution.
//!
//! **Source.** ascher1995, §4.

use super::located::{Ignored, Jump, Leg, Located};
use super::variational::Variational;
use crate::contract::{Batch, Parameters, Verdict};
use crate::diagram::{Cycle, Point, Solution};
use crate::linalg::{axpy, dot, lu};
use crate::problem::Setting;
use crate::simulation::{Ensemble, Outcome, Step, Tolerance};
use crate::stability::floquet::{self, Frames};
use num_complex::Complex64;

/// Number of segments of a cycle.
const SEGMENTS: usize = 16;
/// Updates relative to the size of the cycle at which Newton's method has converged …
pub(super) const ARRIVED: f64 = 1e-9;
/// … and below which it may end once they stop decreasing: only the error of the integration remains.
pub(super) const STALLED: f64 = 1e-5;
pub(super) const ITERATIONS: usize = 6;
/// Maximum number of steps of an integration.
pub(super) const STEPS: usize = 2_000_000;

/// Cycle represented by its nodes.
#[derive(Clone, Debug)]
pub(super) struct Orbit {
    /// `[K][n]`.
    pub(super) nodes: Vec<f64>,
    /// `[K]`: s_i.
    pub(super) shares: Vec<f64>,
    /// T, in the time of the field.
    pub(super) period: f64,
    /// True if T is prescribed.
    pub(super) forced: bool,
    /// `[k]`.
    pub(super) free: Vec<f64>,
    /// `[n]` scale of the model plus largest value of each component.
    pub(super) scales: Vec<f64>,
    /// `[n]` increments of angles over the cycle; empty if none turns.
    pub(super) gain: Vec<f64>,
    /// Mesh interval at which each segment begins, `[K]`; empty if they begin elsewhere.
    pub(super) intervals: Vec<usize>,
    /// Normalised time of the first node.
    pub(super) begin: f64,
    /// True if f or the state jumps along the cycle: see [`super::located`].
    pub(super) jumps: bool,
}

impl Orbit {
    /// Orbit of a point, in the free parameters of a setting; `None` if it is not a cycle or has no profile.
    pub(super) fn of(setting: &Setting, point: &Point) -> Option<Orbit> {
        let Solution::Cycle(cycle) = &point.solution else { return None };
        let (n, count) = (setting.field.dim(), cycle.intervals());
        if count == 0 || cycle.dim() != n {
            return None;
        }
        let segments = SEGMENTS.min(count);
        let intervals: Vec<usize> = (0..segments).map(|i| i * count / segments).collect();
        let ends = intervals[1..].iter().map(|j| cycle.mesh[*j]).chain([1.0]);
        let shares = ends.zip(&intervals).map(|(end, j)| end - cycle.mesh[*j]).collect();
        let scales = (0..n).map(|c| setting.scales[c] + largest(cycle, n, c)).collect();
        Some(Orbit {
            nodes: at_left_ends(&cycle.profile, &intervals, cycle.degree, n),
            shares,
            period: if cycle.forcing_periods > 0 { f64::from(cycle.forcing_periods) } else { cycle.period },
            forced: cycle.forcing_periods > 0,
            free: setting.unknowns_of(point),
            scales,
            gain: cycle.gain.clone(),
            intervals,
            begin: 0.0,
            jumps: false,
        })
    }

    /// Orbit of a cycle along which f or the state jumps, with nodes away from all surfaces; an error says why there is
    /// none.
    pub(super) fn away_from_surfaces(setting: &Setting, point: &Point) -> Result<Orbit, &'static str> {
        /// Least value of a switch, relative to its largest along the cycle.
        const AWAY: f64 = 1e-3;
        let Solution::Cycle(cycle) = &point.solution else { return Err("it is not a cycle") };
        let (n, count, field) = (setting.field.dim(), cycle.intervals(), setting.field);
        if count == 0 || cycle.dim() != n {
            return Err("its profile was not stored");
        }
        // States at the nodes of the mesh are more accurate than between them: errors there would move the solution along its
        // branch.
        let node = |j: usize| cycle.mesh[j];
        let unit = if cycle.forcing_periods > 0 { f64::from(cycle.forcing_periods) } else { cycle.period };
        let values: Vec<Vec<f64>> = (0..count)
            .map(|j| {
                let (mut h, x, times) = (vec![0.0; field.switch_count()], cycle.state(node(j)), [unit * node(j)]);
                let times = if cycle.forcing_periods > 0 { &times[..] } else { &[] };
                let parameters = Parameters::Shared(&point.parameters);
                field.switches(Batch { lanes: 1, states: &x, parameters, times, signs: &[] }, &mut h);
                h
            })
            .collect();
        let size = |s: usize| values.iter().fold(0.0, |most: f64, h| most.max(h[s].abs()));
        let sizes: Vec<f64> = (0..field.switch_count()).map(size).collect();
        let away = |j: &usize| values[*j].iter().zip(&sizes).all(|(h, size)| h.abs() >= AWAY * size);
        let safe: Vec<usize> = (0..count).filter(away).collect();
        if safe.is_empty() {
            return Err("no part of the cycle is away from all surfaces");
        }
        let segments = SEGMENTS.min(safe.len());
        let places: Vec<f64> = (0..segments).map(|i| node(safe[i * safe.len() / segments])).collect();
        let ends = places[1..].iter().copied().chain([places[0] + 1.0]);
        let shares = ends.zip(&places).map(|(end, begin)| end - begin).collect();
        Ok(Orbit {
            nodes: places.iter().flat_map(|t| cycle.state(*t)).collect(),
            shares,
            period: unit,
            forced: cycle.forcing_periods > 0,
            free: setting.unknowns_of(point),
            scales: (0..n).map(|c| setting.scales[c] + largest(cycle, n, c)).collect(),
            gain: cycle.gain.clone(),
            intervals: Vec::new(),
            begin: places[0],
            jumps: true,
        })
    }

    pub(super) fn dim(&self) -> usize {
        self.scales.len()
    }

    /// `[K + 1]` times of the nodes and of the end, in the time of the field.
    pub(super) fn times(&self) -> Vec<f64> {
        let mut times = vec![self.begin * self.period];
        self.shares.iter().for_each(|share| times.push(times[times.len() - 1] + share * self.period));
        times
    }

    /// Number of unknowns of (1) to (3): K n + 1 + k.
    pub(super) fn unknowns(&self) -> usize {
        self.nodes.len() + 1 + self.free.len()
    }

    /// Orbit moved by a scaled update.
    pub(super) fn moved(&self, update: &[f64]) -> Orbit {
        let n = self.dim();
        let mut out = self.clone();
        let (nodes, rest) = update.split_at(self.nodes.len());
        out.nodes.iter_mut().zip(nodes).enumerate().for_each(|(at, (x, d))| *x += d * self.scales[at % n]);
        out.period += rest[0] * self.period;
        out.free.iter_mut().zip(&rest[1..]).for_each(|(own, d)| *own += d);
        out
    }
}

fn largest(cycle: &Cycle, n: usize, c: usize) -> f64 {
    cycle.profile.iter().skip(c).step_by(n).fold(0.0, |m: f64, x| m.max(x.abs()))
}

/// Values of a profile `[interval][node][n]` at the left ends of some intervals.
pub(super) fn at_left_ends(profile: &[f64], intervals: &[usize], degree: usize, n: usize) -> Vec<f64> {
    intervals.iter().flat_map(|j| &profile[j * (degree + 1) * n..][..n]).copied().collect()
}

/// Result of integrating the segments of an orbit.
#[derive(Clone, Debug, Default)]
pub(super) struct Flow {
    /// `[K][n]`.
    ends: Vec<f64>,
    /// `[K][n × n]`, in scaled components.
    pub(super) transitions: Vec<f64>,
    /// `[K][n × k]`.
    by_free: Vec<f64>,
    /// `[K][n]` f at the starts and ends of the segments.
    begins: Vec<f64>,
    finishes: Vec<f64>,
    /// Jumps of the state and legs, of an orbit along which f or the state jumps.
    pub(super) jumps: Vec<Jump>,
    pub(super) legs: Vec<Leg>,
}

impl Flow {
    /// Multipliers without the trivial one.
    pub(super) fn free_multipliers(&self, orbit: &Orbit) -> Vec<Complex64> {
        if orbit.forced {
            return floquet::forced(&self.transitions, orbit.dim()).multipliers;
        }
        self.multipliers(orbit).split_off(1)
    }

    /// Multipliers of an autonomous cycle, the trivial one first.
    pub(super) fn multipliers(&self, orbit: &Orbit) -> Vec<Complex64> {
        let n = orbit.dim();
        let flow: Vec<f64> = self.begins.iter().enumerate().map(|(at, f)| f / orbit.scales[at % n]).collect();
        floquet::multipliers(&self.transitions, &Frames::along(&flow, n), n).multipliers
    }
}

/// Row of (3): scaled coefficients, and the right-hand side.
pub(super) type Row = (Vec<f64>, f64);

/// Solution of (1).
#[derive(Clone, Debug)]
pub(super) struct Solved {
    pub(super) orbit: Orbit,
    pub(super) flow: Flow,
    /// `[k][unknowns]` in scaled unknowns: orthonormal directions in which (1) and (2) stay satisfied; with one row,
    /// oriented at an acute angle to it.
    pub(super) kernel: Vec<Vec<f64>>,
}

/// Integration of orbits in a setting.
pub(super) struct Shooting<'a> {
    pub(super) setting: &'a Setting<'a>,
    /// Relative accuracy of the integration.
    pub(super) accuracy: f64,
    /// A surface that orbits with jumps do not meet.
    pub(super) ignored: Option<Ignored>,
}

impl Shooting<'_> {
    /// Flow along an orbit through its jumps; `None` if the integration fails.
    pub(super) fn through_jumps(&self, orbit: &Orbit, ignored: Option<Ignored>) -> Option<Flow> {
        let (n, scales) = (orbit.dim(), &orbit.scales);
        let tolerance = Tolerance {
            relative: self.accuracy,
            absolute: Variational { setting: self.setting }.absolute(self.accuracy),
        };
        let (parameters, forced) = (self.setting.at(&orbit.free), orbit.forced);
        let located = Located { setting: self.setting, parameters, tolerance, forced, ignored };
        let (mut flow, times) = (Flow::default(), orbit.times());
        for (x, span) in orbit.nodes.chunks_exact(n).zip(times.windows(2)) {
            let found = located.over(x, [span[0], span[1]], flow.jumps.len())?;
            let scaled = found.along.iter().enumerate().map(|(at, m)| m * scales[at % n] / scales[at / n]);
            flow.transitions.extend(scaled);
            flow.ends.extend(found.end);
            flow.by_free.extend(found.by_free);
            flow.jumps.extend(found.jumps);
            flow.legs.extend(found.legs);
        }
        flow.begins = self.slopes(&orbit.nodes, &times, orbit);
        flow.finishes = self.slopes(&flow.ends, &times[1..], orbit);
        Some(flow)
    }

    /// Flow along each orbit; `None` if the integration fails. `sample` sees every step of every orbit.
    pub(super) fn flows(&self, orbits: &[&Orbit], sample: &mut dyn FnMut(usize, &Step)) -> Vec<Option<Flow>> {
        let (n, k) = (self.setting.field.dim(), self.setting.freedom());
        let field = Variational { setting: self.setting };
        let (mut starts, mut parameters, mut owners) = (Vec::new(), Vec::new(), Vec::new());
        for (index, orbit) in orbits.iter().enumerate() {
            let values = self.setting.at(&orbit.free);
            for ((x, share), time) in orbit.nodes.chunks_exact(n).zip(&orbit.shares).zip(orbit.times()) {
                starts.extend_from_slice(x);
                starts.extend((0..n * n).map(|at| if at % (n + 1) == 0 { 1.0 } else { 0.0 }));
                starts.extend(std::iter::repeat_n(0.0, n * k));
                starts.extend(orbit.forced.then_some(time));
                parameters.extend_from_slice(&values);
                parameters.push(share * orbit.period);
                owners.push(index);
            }
        }
        let tolerance = Tolerance { relative: self.accuracy, absolute: field.absolute(self.accuracy) };
        let ensemble = Ensemble::with_own_parameters(&field, &parameters, tolerance, &starts, [0.0, 1.0]);
        let arrivals = ensemble.with_step_limit(STEPS).run(&mut |step| {
            sample(owners[step.trajectory()], step);
            Verdict::Continue
        });
        let mut out: Vec<Option<Flow>> = vec![Some(Flow::default()); orbits.len()];
        for (arrival, owner) in arrivals.iter().zip(&owners) {
            let scales = &orbits[*owner].scales;
            match &mut out[*owner] {
                Some(flow) if arrival.outcome == Outcome::Reached => {
                    let (x, rest) = arrival.state.split_at(n);
                    let (matrix, by_free) = rest[..n * n + n * k].split_at(n * n);
                    flow.ends.extend_from_slice(x);
                    let scaled = matrix.iter().enumerate().map(|(at, m)| m * scales[at % n] / scales[at / n]);
                    flow.transitions.extend(scaled);
                    flow.by_free.extend_from_slice(by_free);
                }
                slot => *slot = None,
            }
        }
        for (orbit, flow) in orbits.iter().zip(&mut out) {
            if let Some(flow) = flow {
                let times = orbit.times();
                flow.begins = self.slopes(&orbit.nodes, &times, orbit);
                flow.finishes = self.slopes(&flow.ends, &times[1..], orbit);
            }
        }
        out
    }

    /// f at states `[K][n]` and times `[K]`.
    fn slopes(&self, states: &[f64], times: &[f64], orbit: &Orbit) -> Vec<f64> {
        let n = self.setting.field.dim();
        let parameters = self.setting.at(&orbit.free);
        let mut f = vec![0.0; states.len()];
        for ((x, time), f) in states.chunks_exact(n).zip(times.chunks_exact(1)).zip(f.chunks_exact_mut(n)) {
            let times = if orbit.forced { time } else { &[] };
            let at = Batch { lanes: 1, states: x, parameters: Parameters::Shared(&parameters), times, signs: &[] };
            self.setting.field.evaluate(at, f);
        }
        f
    }

    /// Solutions near the orbits, each with its rows (k of them) or none.
    pub(super) fn solve(&self, orbits: &[Orbit], rows: &[Vec<Row>]) -> Vec<Option<Solved>> {
        let mut found: Vec<Option<Solved>> = vec![None; orbits.len()];
        let mut current: Vec<Option<Orbit>> = orbits.iter().cloned().map(Some).collect();
        let mut last = vec![f64::INFINITY; orbits.len()];
        for _ in 0..ITERATIONS {
            let open: Vec<usize> = (0..orbits.len()).filter(|&i| found[i].is_none() && current[i].is_some()).collect();
            let at: Vec<&Orbit> = open.iter().filter_map(|&i| current[i].as_ref()).collect();
            if at.is_empty() {
                break;
            }
            let flows = match at.iter().any(|orbit| orbit.jumps) {
                true => at.iter().map(|orbit| self.through_jumps(orbit, self.ignored)).collect(),
                false => self.flows(&at, &mut |_, _| {}),
            };
            for (&i, flow) in open.iter().zip(flows) {
                let Some(now) = current[i].take() else { continue };
                let Some((update, kernel)) =
                    flow.as_ref().and_then(|flow| self.update(&orbits[i], &now, flow, rows.get(i).map_or(&[], |r| r)))
                else {
                    continue;
                };
                let size = update.iter().fold(0.0, |m: f64, d| if d.abs() > m || d.is_nan() { d.abs() } else { m });
                let next = now.moved(&update);
                let stalled = size < STALLED && size > 0.3 * last[i];
                last[i] = size;
                if size < ARRIVED || stalled {
                    found[i] = flow.map(|flow| Solved { orbit: next, flow, kernel });
                } else if size < 1.0 && next.period > 0.0 {
                    current[i] = Some(next);
                }
            }
        }
        found
    }

    /// Scaled Newton step for (1) to (3), and the kernel.
    fn update(&self, origin: &Orbit, orbit: &Orbit, flow: &Flow, rows: &[Row]) -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
        let (n, k, size) = (orbit.dim(), orbit.free.len(), orbit.unknowns());
        let (count, scales) = (orbit.shares.len(), &orbit.scales);
        let (inner, mut a) = (count * n, vec![0.0; size * size]);
        let mut right = vec![0.0; size * (1 + k)];
        let stride = 1 + k;
        for i in 0..count {
            let next = (i + 1) % count;
            for r in 0..n {
                let row = i * n + r;
                let line = &mut a[row * size..(row + 1) * size];
                line[i * n..(i + 1) * n].copy_from_slice(&flow.transitions[(i * n + r) * n..(i * n + r + 1) * n]);
                line[next * n + r] -= 1.0;
                line[inner] = flow.finishes[row] * orbit.shares[i] * orbit.period / scales[r];
                for c in 0..k {
                    line[inner + 1 + c] = flow.by_free[row * k + c] / scales[r];
                }
                let turned = if next == 0 { orbit.gain.get(r).copied().unwrap_or(0.0) } else { 0.0 };
                right[row * stride] = -(flow.ends[row] - turned - orbit.nodes[next * n + r]) / scales[r];
            }
        }
        let line = &mut a[inner * size..(inner + 1) * size];
        if orbit.forced {
            line[inner] = 1.0;
        }
        for at in 0..if orbit.forced { 0 } else { inner } {
            line[at] = flow.begins[at] * orbit.period / scales[at % n] / count as f64;
        }
        right[inner * stride] = 0.0;
        for r in 0..k {
            let line = &mut a[(inner + 1 + r) * size..(inner + 2 + r) * size];
            let place = (inner + 1 + r) * stride;
            match rows.get(r) {
                Some((row, distance)) => {
                    line.copy_from_slice(row);
                    right[place] = distance - dot(row, &self.between(origin, orbit));
                }
                // Any row will do that is not orthogonal to the kernel.
                None => (0..size).for_each(|c| line[c] = ((c * c + 3 * c + 7 * r) as f64 * 0.37).sin()),
            }
            right[place + 1 + r] = 1.0;
        }
        let mut pivots = vec![0; size];
        lu::factorise(&mut a, size, &mut pivots).ok()?;
        lu::solve(&a, size, &pivots, &mut right, stride);
        let column = |c: usize| -> Vec<f64> { right.iter().skip(c).step_by(stride).copied().collect() };
        let mut update = column(0);
        let mut kernel: Vec<Vec<f64>> = Vec::new();
        for r in 0..k {
            let mut own = column(1 + r);
            kernel.iter().for_each(|other| axpy(-dot(other, &own), other, &mut own));
            let norm = dot(&own, &own).sqrt();
            own.iter_mut().for_each(|x| *x /= norm);
            kernel.push(own);
        }
        if rows.is_empty() {
            for own in &kernel {
                let part = dot(own, &update);
                axpy(-part, own, &mut update);
            }
        }
        update.iter().all(|x| x.is_finite()).then_some((update, kernel))
    }

    /// Difference from one orbit to another, scaled like the first.
    pub(super) fn between(&self, from: &Orbit, to: &Orbit) -> Vec<f64> {
        let n = from.dim();
        let nodes = from.nodes.iter().zip(&to.nodes).enumerate().map(|(at, (a, b))| (b - a) / from.scales[at % n]);
        let free = from.free.iter().zip(&to.free).map(|(a, b)| b - a);
        nodes.chain([(to.period - from.period) / from.period]).chain(free).collect()
    }
}
