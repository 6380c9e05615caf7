//! Trajectories with their variational equations, through jumps of f and of the state.
//!
//! **Idea.** f is smooth while the signs of all switches stay as they are. A trajectory is integrated with these signs
//! given up to the first zero of a switch, which is located on the trajectory itself. There the derivatives are
//! multiplied by the saltation matrix, and integration continues from the state after the event, on the other side of
//! the surface, or along it.
//!
//! **Equations.** With R the reset of an event (the identity elsewhere), h the switch, f⁻ and f⁺ before and after, X and Y
//! the derivatives of the state with respect to the start and the free parameters λ:
//!
//! ```text
//!   (1)  δt = -(∇h·V + h_λ) / (∇h·f⁻ + h_t)                       V = X, without h_λ, or V = Y
//!   (2)  V⁺ = R_x V + R_λ + (R_x f⁻ + R_t - f⁺) δt                R_λ for Y only
//! ```
//!
//! Where both sides lead to the surface, f⁺ is Filippov's field along it, which ends where one side ceases to.
//!
//! **Source.** leine2004, §7; filippov1988, §4.
//!
//! **Fails when** a trajectory slides along two surfaces at once, or only touches a surface.

use super::variational::Variational;
use crate::contract::{Batch, Parameters, VectorField, Verdict};
use crate::linalg::{dot, max_abs};
use crate::problem::Setting;
use crate::simulation::{Direction, Integrator, Outcome, Passage, Section, Tolerance};

/// Largest number of events and switchings of a trajectory.
const MOST: usize = 2000;
/// Largest number of steps between two of them.
const STEPS: usize = 500_000;
/// Difference of f on both sides of a surface, relative to f, up to which it is continuous.
const CONTINUOUS: f64 = 1e-9;
/// Speed on the far side of a surface, relative to that of arrival, that counts as zero.
const AT_REST: f64 = 1e-9;
/// Time after an event, relative to the longest, within which its own surface is not met again.
const AGAIN: f64 = 1e-12;
/// Rounding of a switch, relative to its parts.
const ROUNDING: f64 = 1e-13;
/// Attempts at a leg, and the factor by which its steps become shorter. What a step does not see has a depth of the order
/// of its square, so that after two reductions it is 1e5 times smaller; who still stands beyond a surface began there.
const TRIES: usize = 3;
const SHORTER: f64 = 20.0;
/// Places of a step whose states are kept: its continuous solution is a polynomial of degree 4.
const PLACES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

/// A jump of the state.
#[derive(Clone, Debug)]
pub(super) struct Jump {
    /// Its event, and its time.
    pub(super) event: usize,
    pub(super) time: f64,
}

/// Times at the ends of a step, and the states `[5][n]` at [`PLACES`].
pub(super) type Kept = ([f64; 2], Vec<f64>);

/// A function of time and state.
type Value<'a> = Box<dyn Fn(f64, &[f64]) -> f64 + 'a>;

/// A part of a trajectory on which f is smooth.
#[derive(Clone, Debug)]
pub(super) struct Leg {
    /// Number of jumps of the state since the first node of the orbit.
    pub(super) flight: usize,
    /// Times at the ends of each step, and the states `[5][n]` at [`PLACES`].
    pub(super) steps: Vec<Kept>,
}

impl Leg {
    /// Times of both ends.
    pub(super) fn ends(&self) -> [f64; 2] {
        let time = |step: Option<&Kept>, end: usize| step.map_or(f64::NAN, |(times, _)| times[end]);
        [time(self.steps.first(), 0), time(self.steps.last(), 1)]
    }

    /// State `[n]` at a time within the leg.
    pub(super) fn state(&self, time: f64) -> Option<Vec<f64>> {
        let next = self.steps.partition_point(|(times, _)| times[1] < time).min(self.steps.len().checked_sub(1)?);
        let ([begin, end], states) = &self.steps[next];
        Some(within(states, if end > begin { ((time - begin) / (end - begin)).clamp(0.0, 1.0) } else { 1.0 }))
    }
}

/// State at a fraction of a step.
pub(super) fn within(states: &[f64], theta: f64) -> Vec<f64> {
    let n = states.len() / PLACES.len();
    let others = |k: usize| (0..PLACES.len()).filter(move |other| *other != k);
    let weight = |k: usize| others(k).map(|j| (theta - PLACES[j]) / (PLACES[k] - PLACES[j])).product::<f64>();
    let weights: Vec<f64> = (0..PLACES.len()).map(weight).collect();
    (0..n).map(|c| (0..PLACES.len()).map(|k| weights[k] * states[k * n + c]).sum()).collect()
}

/// A trajectory with its derivatives.
pub(super) struct Trajectory {
    /// `[n]` its end, `[n × n]` X and `[n × k]` Y there.
    pub(super) end: Vec<f64>,
    pub(super) along: Vec<f64>,
    pub(super) by_free: Vec<f64>,
    pub(super) jumps: Vec<Jump>,
    pub(super) legs: Vec<Leg>,
}

/// A switch that is not to change its sign, or an event that is not to occur, between two times.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ignored {
    pub(super) switch: usize,
    pub(super) times: [f64; 2],
}

/// Integration in a setting.
pub(super) struct Located<'a> {
    pub(super) setting: &'a Setting<'a>,
    /// All parameters.
    pub(super) parameters: Vec<f64>,
    pub(super) tolerance: Tolerance,
    /// True if time is measured in forcing periods.
    pub(super) forced: bool,
    pub(super) ignored: Option<Ignored>,
}

/// The variational equations with given signs.
struct Fixed<'a> {
    inner: Variational<'a>,
    signs: &'a [f64],
}

impl VectorField for Fixed<'_> {
    fn dim(&self) -> usize {
        self.inner.dim()
    }

    fn parameter_count(&self) -> usize {
        self.inner.parameter_count()
    }

    fn evaluate(&self, at: Batch, out: &mut [f64]) {
        let signs: Vec<f64> = self.signs.iter().flat_map(|sign| std::iter::repeat_n(*sign, at.lanes)).collect();
        self.inner.evaluate(Batch { signs: &signs, ..at }, out);
    }

    /// Not implemented: integration does not need it.
    fn linearise(&self, _at: Batch, _free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        [f, fx, fp].into_iter().for_each(|all| all.fill(f64::NAN));
    }

    /// Not implemented: integration does not need it.
    fn directional(&self, _at: Batch, _directions: &[&[f64]], out: &mut [f64]) {
        out.fill(f64::NAN);
    }
}

/// Meaning of a section of a trajectory.
#[derive(Clone, Copy, Debug)]
enum Met {
    /// A switch or an event changes its sign.
    Surface(usize),
    /// A slide ends on the side of this sign.
    Exit(usize, f64),
}

/// A leg, the surface at its end, and the state with its derivatives there.
type Reached = (Leg, Option<Met>, Vec<f64>);

impl<'a> Located<'a> {
    fn field(&self) -> &'a dyn VectorField {
        self.setting.field
    }

    fn kinks(&self) -> usize {
        self.field().switch_count() - self.field().event_count()
    }

    fn batch<'b>(&'b self, x: &'b [f64], time: &'b [f64; 1], signs: &'b [f64]) -> Batch<'b> {
        let times = if self.forced { &time[..] } else { &[] };
        Batch { lanes: 1, states: x, parameters: Parameters::Shared(&self.parameters), times, signs }
    }

    /// The switches at a point.
    pub(super) fn switches(&self, x: &[f64], time: f64) -> Vec<f64> {
        let mut values = vec![0.0; self.field().switch_count()];
        self.field().switches(self.batch(x, &[time], &[]), &mut values);
        values
    }

    fn rates(&self, x: &[f64], time: f64, signs: &[f64]) -> Vec<f64> {
        let mut f = vec![0.0; x.len()];
        self.field().evaluate(self.batch(x, &[time], signs), &mut f);
        f
    }

    /// Rates of change of a switch under f on its negative and on its positive side.
    fn speeds(&self, x: &[f64], time: f64, signs: &[f64], switch: usize) -> [f64; 2] {
        self.field().normal_speeds(self.batch(x, &[time], signs), switch).map(|speed| speed[0])
    }

    /// Trajectory from a state away from all surfaces; `flight` is the number of jumps before it.
    pub(super) fn over(&self, start: &[f64], span: [f64; 2], flight: usize) -> Option<Trajectory> {
        let (n, k) = (start.len(), self.setting.freedom());
        let unit = (0..n * n).map(|at| if at % (n + 1) == 0 { 1.0 } else { 0.0 });
        let mut state: Vec<f64> = start.iter().copied().chain(unit).chain(vec![0.0; n * k]).collect();
        let mut signs: Vec<f64> =
            self.switches(start, span[0]).iter().map(|h| if *h < 0.0 { -1.0 } else { 1.0 }).collect();
        let (mut time, mut jumps, mut legs) = (span[0], Vec::new(), Vec::new());
        for _ in 0..MOST {
            let (leg, met, arrived) = self.leg(&state, [time, span[1]], &signs, flight + jumps.len())?;
            time = leg.ends()[1];
            state = arrived;
            legs.push(leg);
            match met {
                None => {
                    let (end, rest) = state.split_at(n);
                    let (along, by_free) = rest.split_at(n * n);
                    return Some(Trajectory {
                        end: end.to_vec(),
                        along: along.to_vec(),
                        by_free: by_free.to_vec(),
                        jumps,
                        legs,
                    });
                }
                // f is that of the side on which it leaves, so that nothing jumps.
                Some(Met::Exit(switch, side)) => signs[switch] = side,
                Some(Met::Surface(switch)) => {
                    let (after, beyond) = self.passed(&state, time, &signs, switch)?;
                    if let Some(event) = switch.checked_sub(self.kinks()) {
                        jumps.push(Jump { event, time });
                    }
                    (state, signs) = (after, beyond);
                }
            }
        }
        None
    }

    /// Integrates up to the next surface, or to the end of the span; in shorter steps if a surface was passed unseen.
    fn leg(&self, state: &[f64], span: [f64; 2], signs: &[f64], flight: usize) -> Option<Reached> {
        let mut longest = f64::INFINITY;
        for _ in 0..TRIES {
            match self.leg_in_steps(state, span, signs, flight, longest) {
                Ok(found) => return Some(found),
                Err(Some(shorter)) => longest = shorter,
                Err(None) => return None,
            }
        }
        None
    }

    /// True if a state is clearly on the wrong side of a surface. A leg begins on the surface of the event before it, up to
    /// the error with which that was located; `begin` are the values of the switches there.
    fn astray(&self, x: &[f64], time: f64, signs: &[f64], begin: &[f64]) -> bool {
        let (n, kinks) = (x.len(), self.kinks());
        let own_time = [time];
        let side = |s: usize| match s.checked_sub(kinks) {
            Some(event) => -self.field().event_direction(event),
            None => signs[s],
        };
        let values = self.switches(x, time);
        if (0..values.len()).all(|s| side(s) * values[s] >= 0.0) {
            return false;
        }
        let [h, gradient, _, later] = self.setting.linearise_switches(self.batch(x, &own_time, &[]));
        (0..h.len()).any(|s| {
            let size = (0..n).map(|j| (gradient[s * n + j] * x[j]).abs()).sum::<f64>() + later[s].abs();
            let allowed = ROUNDING * size + 2.0 * (-side(s) * begin[s]).max(0.0);
            side(s) * h[s] < -allowed && !self.ignores(Met::Surface(s), time)
        })
    }

    fn leg_in_steps(
        &self,
        state: &[f64],
        span: [f64; 2],
        signs: &[f64],
        flight: usize,
        longest: f64,
    ) -> Result<Reached, Option<f64>> {
        let (n, kinks) = (self.field().dim(), self.kinks());
        let field = Fixed { inner: Variational { setting: self.setting }, signs };
        // The last parameter is the length of the unit of time.
        let parameters: Vec<f64> = self.parameters.iter().copied().chain([1.0]).collect();
        let mut start = state.to_vec();
        start.extend(self.forced.then_some(span[0]));
        let mut all: Vec<(Met, Direction)> = Vec::new();
        for (switch, sign) in signs.iter().enumerate() {
            let direction = match switch.checked_sub(kinks) {
                Some(event) => self.field().event_direction(event),
                None => -sign,
            };
            let direction = match direction {
                0.0 => Direction::Either,
                up if up > 0.0 => Direction::Rising,
                _ => Direction::Falling,
            };
            if switch < kinks && *sign == 0.0 {
                all.push((Met::Exit(switch, -1.0), Direction::Falling));
                all.push((Met::Exit(switch, 1.0), Direction::Falling));
            } else {
                all.push((Met::Surface(switch), direction));
            }
        }
        let values: Vec<Value<'_>> = all
            .iter()
            .map(|(met, _)| -> Value<'_> {
                match *met {
                    Met::Surface(switch) => Box::new(move |t, x| self.switches(&x[..n], t)[switch]),
                    // The push to the surface from the side.
                    Met::Exit(switch, side) => Box::new(move |t, x| {
                        let [below, above] = self.speeds(&x[..n], t, signs, switch);
                        if side < 0.0 { below } else { -above }
                    }),
                }
            })
            .collect();
        let sections: Vec<Section> =
            values.iter().zip(&all).map(|(value, (_, direction))| Section { value, direction: *direction }).collect();
        let integrator = Integrator::new(&field, &parameters, self.tolerance.clone())
            .with_step_limit(STEPS)
            .with_longest_step(longest);
        let begin = self.switches(&state[..n], span[0]);
        let mut astray = None;
        let mut met: Option<(Met, f64, Vec<f64>)> = None;
        let mut steps: Vec<Kept> = Vec::new();
        let arrival = integrator.trajectory(&start, span, &sections, &mut |passage| match passage {
            Passage::Crossing(crossing) => {
                let own = all[crossing.section].0;
                if met.is_none()
                    && crossing.time - span[0] > AGAIN * (span[1] - span[0])
                    && !self.ignores(own, crossing.time)
                {
                    met = Some((own, crossing.time, crossing.state.clone()));
                }
                Verdict::Continue
            }
            Passage::Step(step) => {
                let ends = [step.start_time(), step.end_time()];
                let end = met.as_ref().map_or(ends[1], |(_, time, _)| *time);
                let share =
                    if met.is_some() && ends[1] > ends[0] { (end - ends[0]) / (ends[1] - ends[0]) } else { 1.0 };
                steps.push(([ends[0], end], sampled(step, n, share)));
                let mut x = vec![0.0; n];
                step.end_into(&mut x);
                if met.is_none() && self.astray(&x, ends[1], signs, &begin) {
                    astray = Some((ends[1] - ends[0]) / SHORTER);
                }
                if met.is_some() || astray.is_some() { Verdict::Stop } else { Verdict::Continue }
            }
        });
        if astray.is_some() {
            return Err(astray);
        }
        if met.is_none() && arrival.outcome != Outcome::Reached {
            return Err(None);
        }
        let (met, mut arrived) = match met {
            Some((met, _, state)) => (Some(met), state),
            None => (None, arrival.state),
        };
        arrived.truncate(state.len());
        if max_abs(&arrived).is_finite() { Ok((Leg { flight, steps }, met, arrived)) } else { Err(None) }
    }

    /// True if a surface is not to be met at a time.
    fn ignores(&self, met: Met, time: f64) -> bool {
        match (met, self.ignored) {
            (Met::Surface(switch), Some(own)) => switch == own.switch && own.times[0] < time && time < own.times[1],
            _ => false,
        }
    }

    /// The state with its derivatives, and the signs, beyond a surface.
    fn passed(&self, state: &[f64], time: f64, signs: &[f64], switch: usize) -> Option<(Vec<f64>, Vec<f64>)> {
        let (n, k) = (self.field().dim(), self.setting.freedom());
        let (x, rest) = state.split_at(n);
        let (along, by_free) = rest.split_at(n * n);
        let own_time = [time];
        let at = self.batch(x, &own_time, &[]);
        let [_, gradient, by, later] = self.setting.linearise_switches(at);
        let (gradient, by, later) =
            (&gradient[switch * n..(switch + 1) * n], &by[switch * k..(switch + 1) * k], later[switch]);
        let before = self.rates(x, time, signs);
        let mut beyond = signs.to_vec();
        let unit = || -> Vec<f64> { (0..n * n).map(|at| if at % (n + 1) == 0 { 1.0 } else { 0.0 }).collect() };
        let event = switch.checked_sub(self.kinks());
        let [after, r_x, r_p, r_t] = match event {
            Some(event) => {
                let found = self.setting.reset(event, at);
                let values = self.switches(&found[0], time);
                // On the surface of the event the value is rounding.
                let sign = |s: usize| if values[s] < 0.0 { -1.0 } else { 1.0 };
                (0..self.kinks()).for_each(|s| beyond[s] = sign(s));
                found
            }
            None => {
                let [below, above] = self.speeds(x, time, signs, switch);
                let [arrival, far] = if signs[switch] < 0.0 { [below, above] } else { [-above, -below] };
                let crosses = far > 0.0 || far.abs() <= AT_REST * arrival.abs();
                beyond[switch] = if crosses { -signs[switch] } else { 0.0 };
                // Sliding along two surfaces at once is not determined.
                if beyond.iter().filter(|sign| **sign == 0.0).count() > 1 {
                    return None;
                }
                [x.to_vec(), unit(), vec![0.0; n * k], vec![0.0; n]]
            }
        };
        let f = self.rates(&after, time, &beyond);
        let apart = before.iter().zip(&f).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
        if event.is_none() && apart <= CONTINUOUS * max_abs(&before) {
            return Some((state.to_vec(), beyond));
        }
        let speed = dot(gradient, &before) + later;
        let jump: Vec<f64> = (0..n).map(|i| dot(&r_x[i * n..(i + 1) * n], &before) + r_t[i] - f[i]).collect();
        let mut out = after.clone();
        for (block, width, extra, shift) in [(along, n, None, None), (by_free, k, Some(&r_p), Some(by))] {
            let column = |c: usize| -> Vec<f64> { (0..n).map(|j| block[j * width + c]).collect() };
            let columns: Vec<Vec<f64>> = (0..width)
                .map(|c| {
                    let v = column(c);
                    let delay = -(dot(gradient, &v) + shift.map_or(0.0, |by| by[c])) / speed;
                    let own = |i: usize| dot(&r_x[i * n..(i + 1) * n], &v) + extra.map_or(0.0, |r| r[i * k + c]);
                    (0..n).map(|i| own(i) + jump[i] * delay).collect()
                })
                .collect();
            (0..n).for_each(|i| out.extend(columns.iter().map(|column| column[i])));
        }
        max_abs(&out).is_finite().then_some((out, beyond))
    }
}

/// States `[5][n]` at [`PLACES`] of a step, up to a fraction of it.
fn sampled(step: &crate::simulation::Step, n: usize, share: f64) -> Vec<f64> {
    let mut x = vec![0.0; n];
    PLACES
        .iter()
        .flat_map(|place| {
            step.state_into(place * share, &mut x);
            x.clone()
        })
        .collect()
}
