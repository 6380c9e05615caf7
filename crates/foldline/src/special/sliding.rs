//! Sliding bifurcations of cycles: the orbit begins or ceases to slide along a surface at which the field jumps.
//!
//! **Idea.** Where an orbit arrives at the surface of a switch, f on the far side either carries it on, and it crosses,
//! or carries it back, and it slides. The change from one to the other is a zero of the speed on the far side. The flow
//! and its derivatives are continuous there, because Filippov's field equals f on that side where its speed is zero.
//!
//! **Equations.** At the arrivals of an orbit, with σ the sign of h before, f⁻ the branch of that side and f⁺ the other:
//!
//! ```text
//!   (1)  w = (∇h·f⁺ + h_t) / (∇h·f⁻ + h_t)          crosses where w > 0, slides where w < 0
//!   (2)  (-1)^C min |w| = 0,  (-1)^⌊C/2⌋ min |w| = 0      C arrivals that cross
//! ```
//!
//! At a zero of w the orbit continues with f⁺. If it moves away from the surface on the far side, the slide beyond is
//! short (crossing-sliding); if it returns, it slides after a short excursion (switching-sliding).
//!
//! **Source.** dibernardo2008, §8.
//!
//! **Fails when** several arrivals that are not images of each other change at one parameter value.

use super::grazing::{self, Extremum};
use crate::contract::{Batch, Monitor, Parameters, Sight, VectorField};
use crate::diagram::{Cycle, Kind, Point, Solution};

/// Value of a switch, relative to its largest along the cycle, on its surface.
const ON_SURFACE: f64 = 1e-8;
/// |w| of a located zero.
const LOCATED: f64 = 1e-5;
/// Speed of arrival, relative to the speed on the far side, of an orbit that touches the surface.
const TOUCHES: f64 = 1e-9;

/// An arrival at the surface of a switch.
#[derive(Clone, Debug)]
struct Arrival {
    /// Mesh node.
    node: usize,
    /// State `[n]`, and the time of the field.
    state: Vec<f64>,
    time: Option<f64>,
    /// Signs of all switches before it.
    signs: Vec<f64>,
    /// Speeds in the direction of arrival: on the side from which it comes, and on the far side.
    speeds: [f64; 2],
}

impl Arrival {
    fn w(&self) -> f64 {
        self.speeds[1] / self.speeds[0]
    }

    fn slides(&self) -> bool {
        self.speeds[1] < 0.0
    }
}

/// Monitor of the sliding bifurcations at one switch.
pub struct Sliding<'a> {
    field: &'a dyn VectorField,
    switch: usize,
    /// 1 or 2, for the two functions (2).
    stride: usize,
}

/// Monitors of all switches of a field.
pub fn monitors(field: &dyn VectorField) -> Vec<Box<dyn Monitor + '_>> {
    let each = (0..field.switch_count() - field.event_count()).flat_map(|switch| [1, 2].map(|stride| (switch, stride)));
    each.map(|(switch, stride)| Box::new(Sliding { field, switch, stride }) as Box<dyn Monitor + '_>).collect()
}

impl Sliding<'_> {
    fn arrivals(&self, at: &Point) -> Vec<Arrival> {
        match &at.solution {
            Solution::Cycle(cycle) => {
                let mut all = arrivals(self.field, &at.parameters, cycle, self.switch);
                all.retain(|own| jumps(self.field, &at.parameters, &own.state, own.time, &own.signs, self.switch));
                all
            }
            Solution::Equilibrium(_) | Solution::Torus(_) => Vec::new(),
        }
    }
}

impl Monitor for Sliding<'_> {
    fn kind(&self) -> Kind {
        Kind::Sliding
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        let all = self.arrivals(at);
        let least = all.iter().map(|arrival| arrival.w().abs()).fold(1.0, f64::min);
        let crossings = all.iter().filter(|arrival| !arrival.slides()).count();
        if (crossings / self.stride).is_multiple_of(2) { least } else { -least }
    }

    fn confirms(&self, at: &Point) -> bool {
        self.arrivals(at).iter().any(|arrival| arrival.w().abs() < LOCATED)
    }

    fn reads(&self) -> Sight {
        Sight::Everything
    }

    fn jump(&self) -> usize {
        0
    }

    fn label(&self) -> usize {
        // Not one of a grazing.
        self.field.switch_count() + self.switch + 1
    }
}

/// The arrivals of a cycle at the surface of a switch. Its profile has a mesh node at each of them.
fn arrivals(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle, switch: usize) -> Vec<Arrival> {
    let (n, intervals, scheme) = (cycle.dim(), cycle.intervals(), cycle.scheme());
    if n == 0 || intervals < 2 {
        return Vec::new();
    }
    let block = (cycle.degree + 1) * n;
    let time = |t: f64| (cycle.forcing_periods > 0).then_some(f64::from(cycle.forcing_periods) * t);
    let batch = |states: &[f64], time: &Option<f64>| -> Vec<f64> {
        let mut values = vec![0.0; field.switch_count()];
        let parameters = Parameters::Shared(parameters);
        let at = Batch { lanes: 1, states, parameters, times: time.as_slice(), signs: &[] };
        field.switches(at, &mut values);
        values
    };
    let at_node = |j: usize| batch(&cycle.profile[j * block..j * block + n], &time(cycle.mesh[j]));
    let within = |j: usize| {
        let mut x = vec![0.0; n];
        scheme.value_into(0.5, &cycle.profile[j * block..(j + 1) * block], &mut x);
        batch(&x, &time(0.5 * (cycle.mesh[j] + cycle.mesh[j + 1])))
    };
    let nodes: Vec<Vec<f64>> = (0..intervals).map(at_node).collect();
    let size = nodes.iter().fold(0.0, |most: f64, values| most.max(values[switch].abs()));
    let mut found = Vec::new();
    // At an event the orbit does not arrive but jumps there.
    let after_event = grazing::after_events(field, parameters, cycle);
    for j in (0..intervals).filter(|j| nodes[*j][switch].abs() <= ON_SURFACE * size && !after_event[*j]) {
        let before = within((j + intervals - 1) % intervals);
        // It slides along the surface already.
        if before[switch].abs() <= ON_SURFACE * size {
            continue;
        }
        let signs: Vec<f64> = before.iter().map(|value| if *value < 0.0 { -1.0 } else { 1.0 }).collect();
        let (state, time) = (cycle.profile[j * block..j * block + n].to_vec(), time(cycle.mesh[j]));
        let parameters = Parameters::Shared(parameters);
        let at = Batch { lanes: 1, states: &state, parameters, times: time.as_slice(), signs: &signs };
        let [below, above] = field.normal_speeds(at, switch).map(|speed| -signs[switch] * speed[0]);
        let speeds = if signs[switch] < 0.0 { [below, above] } else { [above, below] };
        if speeds[0] > TOUCHES * speeds[1].abs() {
            found.push(Arrival { node: j, state, time, signs, speeds });
        }
    }
    found
}

/// The slides that leave the surface on the side from which the orbit came, as extrema of the switch: what its value
/// would be had the orbit gone on without the jump, to second order in the speed of arrival. It passes zero where the
/// orbit only touches the surface (grazing-sliding).
pub(super) fn touches(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle, switch: usize) -> Vec<Extremum> {
    let (n, intervals, scheme) = (cycle.dim(), cycle.intervals(), cycle.scheme());
    let mut found = Vec::new();
    for arrival in arrivals(field, parameters, cycle, switch).iter().filter(|arrival| arrival.slides()) {
        let [speed, _] = arrival.speeds;
        let side = arrival.signs[switch];
        // The side on which the slide ends: that of the first interval that is not on the surface.
        let block = (cycle.degree + 1) * n;
        let value = |j: usize| {
            let mut x = vec![0.0; n];
            scheme.value_into(0.5, &cycle.profile[j * block..(j + 1) * block], &mut x);
            let t = 0.5 * (cycle.mesh[j] + cycle.mesh[j + 1]);
            let time = (cycle.forcing_periods > 0).then_some(f64::from(cycle.forcing_periods) * t);
            let mut values = vec![0.0; field.switch_count()];
            let parameters = Parameters::Shared(parameters);
            field.switches(Batch { lanes: 1, states: &x, parameters, times: time.as_slice(), signs: &[] }, &mut values);
            values[switch]
        };
        let after: Vec<f64> = (0..intervals).map(|k| value((arrival.node + k) % intervals)).collect();
        let size = after.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let left = after.iter().find(|value| value.abs() > ON_SURFACE * size);
        let Some(curvature) = curvature(field, parameters, cycle, arrival, switch, side) else { continue };
        if left.is_some_and(|value| value * side > 0.0) && curvature * side > 0.0 {
            let (time, value) = (cycle.mesh[arrival.node], -side * 0.5 * speed * speed / curvature.abs());
            found.push(Extremum { time, value, maximum: side < 0.0, at_event: false });
        }
    }
    found
}

/// Second derivative of a switch in time at an arrival, with f of one side, by central differences.
fn curvature(
    field: &dyn VectorField,
    parameters: &[f64],
    cycle: &Cycle,
    arrival: &Arrival,
    switch: usize,
    side: f64,
) -> Option<f64> {
    /// Relative to the period.
    const STEP: f64 = 1e-5;
    let duration = if cycle.forcing_periods > 0 { f64::from(cycle.forcing_periods) } else { cycle.period };
    let mut signs = arrival.signs.clone();
    signs[switch] = side;
    let mut f = vec![0.0; arrival.state.len()];
    let parameters = Parameters::Shared(parameters);
    let here = Batch { lanes: 1, states: &arrival.state, parameters, times: arrival.time.as_slice(), signs: &signs };
    field.evaluate(here, &mut f);
    let step = STEP * duration;
    let speed = |by: f64| {
        let moved: Vec<f64> = arrival.state.iter().zip(&f).map(|(x, f)| x + by * f).collect();
        let time = arrival.time.map(|t| t + by);
        let [below, above] = field.normal_speeds(Batch { states: &moved, times: time.as_slice(), ..here }, switch);
        if side < 0.0 { below[0] } else { above[0] }
    };
    let rate = (speed(step) - speed(-step)) / (2.0 * step);
    rate.is_finite().then_some(rate)
}

/// Description of a sliding bifurcation: its type and the surface.
pub fn described(field: &dyn VectorField, at: &Point) -> String {
    let Solution::Cycle(cycle) = &at.solution else { return String::new() };
    let all = (0..field.switch_count())
        .flat_map(|switch| arrivals(field, &at.parameters, cycle, switch).into_iter().map(move |own| (switch, own)));
    let Some((switch, own)) = all.min_by(|a, b| a.1.w().abs().total_cmp(&b.1.w().abs())) else {
        return String::new();
    };
    let far = -own.signs[switch];
    let kind = match curvature(field, &at.parameters, cycle, &own, switch, far) {
        Some(curvature) if curvature * far > 0.0 => "crossing-sliding",
        Some(_) => "switching-sliding",
        None => "sliding begins or ends",
    };
    format!("{kind} at {} = 0", field.switch_name(switch))
}

/// True if the field jumps at a surface at which a cycle arrives.
pub fn meets_jump(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle) -> bool {
    (0..field.switch_count()).any(|switch| {
        let all = arrivals(field, parameters, cycle, switch);
        all.iter().any(|own| jumps(field, parameters, &own.state, own.time, &own.signs, switch))
    })
}

/// True if f on both sides of the surface of a switch leads to it, at a state on it.
pub(super) fn pushes(
    field: &dyn VectorField,
    parameters: &[f64],
    state: &[f64],
    time: Option<f64>,
    switch: usize,
) -> bool {
    let mut values = vec![0.0; field.switch_count()];
    let parameters = Parameters::Shared(parameters);
    let at = Batch { lanes: 1, states: state, parameters, times: time.as_slice(), signs: &[] };
    field.switches(at, &mut values);
    let signs: Vec<f64> = values.iter().map(|value| if *value < 0.0 { -1.0 } else { 1.0 }).collect();
    let [below, above] = field.normal_speeds(Batch { signs: &signs, ..at }, switch);
    below[0] > 0.0 && above[0] < 0.0
}

/// True if the branches of f on both sides of a surface differ at a state on it by more than rounding.
fn jumps(
    field: &dyn VectorField,
    parameters: &[f64],
    state: &[f64],
    time: Option<f64>,
    signs: &[f64],
    switch: usize,
) -> bool {
    /// Relative to the larger side.
    const ROUNDING: f64 = 1e-6;
    let mut signs = signs.to_vec();
    let [below, above] = [-1.0, 1.0].map(|side| {
        signs[switch] = side;
        let mut f = vec![0.0; state.len()];
        let parameters = Parameters::Shared(parameters);
        field.evaluate(Batch { lanes: 1, states: state, parameters, times: time.as_slice(), signs: &signs }, &mut f);
        f
    });
    below.iter().zip(&above).any(|(a, b)| (a - b).abs() > ROUNDING * a.abs().max(b.abs()))
}

/// True if the field jumps at the surface of a switch that a cycle touches at a normalised time.
pub fn jumps_at(field: &dyn VectorField, point: &Point, cycle: &Cycle, t: f64, switch: usize) -> bool {
    let (mut state, forced) = (cycle.state(t), cycle.forcing_periods);
    let (n, count) = (state.len(), field.switch_count());
    let time = (forced > 0).then_some(f64::from(forced) * t);
    let [mut values, mut gradients, mut rates] = [count, count * n, count].map(|size| vec![0.0; size]);
    let parameters = Parameters::Shared(&point.parameters);
    let at = Batch { lanes: 1, states: &state, parameters, times: time.as_slice(), signs: &[] };
    field.linearise_switches(at, &[], [&mut values, &mut gradients, &mut [], &mut rates]);
    let signs: Vec<f64> = values.iter().map(|value| if *value < 0.0 { -1.0 } else { 1.0 }).collect();
    // On the surface itself: beside it, the branches of f on both sides of a kink differ.
    let gradient = &gradients[switch * n..(switch + 1) * n];
    let share = values[switch] / gradient.iter().map(|h| h * h).sum::<f64>();
    state.iter_mut().zip(gradient).for_each(|(x, h)| *x -= share * h);
    jumps(field, &point.parameters, &state, time, &signs, switch)
}

/// The reason why a branch ends, with a better cause if its last cycle touches a surface at which f jumps.
pub fn at_corner(field: &dyn VectorField, point: &Point, why: String) -> String {
    /// Extremum, relative to the largest value of the switch along the cycle.
    const CLOSE: f64 = 1e-4;
    let Solution::Cycle(cycle) = &point.solution else { return why };
    let touched = (0..field.switch_count()).find(|switch| {
        let (extrema, size) = super::grazing::extrema(field, &point.parameters, cycle, *switch);
        let close = |own: &&Extremum| own.value.abs() < CLOSE * size;
        extrema.iter().filter(close).any(|own| jumps_at(field, point, cycle, own.time, *switch))
    });
    let Some(switch) = touched else { return why };
    let first = why.split('\n').next().unwrap_or_default();
    format!(
        "{first}\nlikely cause: the cycle touches the surface {} = 0, at which the right-hand side jumps \
         (grazing-sliding): a cycle that slides along the surface and one that does not meet here, and may end here \
         together (a non-smooth fold)\nwhat to do: start the other one from a solution of its own",
        field.switch_name(switch)
    )
}
