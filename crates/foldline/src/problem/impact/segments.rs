//! A cycle with events as one boundary-value problem: all flights between events side by side.
//!
//! **Idea.** Each flight i has its own copy of the states and its duration T_i as a further, constant state. All flights
//! run over s ∈ [0, 1] at once, so that a mesh, its errors and its elimination serve all of them. The conditions at the
//! ends say where each flight ends and how the next one begins.
//!
//! **Equations.** With k events per period, h_i and R_i the switch and the reset of the one that ends flight i:
//!
//! ```text
//!   (1)  x_i' = T_i f(x_i, p, τ_i),   T_i' = 0,   τ_i = φ + Σ_{j<i} T_j + T_i s
//!   (2)  x_{i+1}(0) = R_i(x_i(1), p, τ_i(1)),   h_i(x_i(1), p, τ_i(1)) = 0
//!   (3)  Σ T_i = q
//! ```
//!
//! A switch of f that is no event has a copy for each flight, with the number i·(switches) + s: at one value of s, several
//! flights may pass their surfaces, or slide along them, without regard to each other.
//!
//! (3) and the phase φ of the first event, which it determines, exist for a forced field only, whose time τ is measured
//! in forcing periods. The events fix the phase of an autonomous cycle.
//!
//! **Source.** thota2008 (periodic orbits of hybrid systems as boundary-value problems of several segments).

use crate::contract::{Batch, Parameters, VectorField};

/// The field (1) with the conditions (2) and (3).
pub(super) struct Segments<'a> {
    pub field: &'a dyn VectorField,
    /// `[k]`: the event that ends each flight.
    pub events: Vec<usize>,
    /// q of (3); 0 for an autonomous field.
    pub forcing_periods: u32,
    /// Index of φ among the parameters, for a forced field.
    determined: Vec<usize>,
}

/// Times, states and signs of one flight.
struct Flight {
    lasts: Vec<f64>,
    times: Vec<f64>,
    signs: Vec<f64>,
}

impl<'a> Segments<'a> {
    pub fn new(field: &'a dyn VectorField, events: Vec<usize>, forcing_periods: u32) -> Segments<'a> {
        let determined = if forcing_periods > 0 { vec![field.parameter_count()] } else { Vec::new() };
        Segments { field, events, forcing_periods, determined }
    }

    fn n(&self) -> usize {
        self.field.dim()
    }

    fn forced_inside(&self) -> bool {
        self.forcing_periods > 0
    }

    /// Switches that are no events.
    fn kinks(&self) -> usize {
        self.field.switch_count() - self.field.event_count()
    }

    /// The parameters of the field itself.
    fn own_parameters<'b>(&self, parameters: Parameters<'b>, lanes: usize) -> Parameters<'b> {
        let count = self.field.parameter_count();
        match parameters {
            Parameters::Shared(all) => Parameters::Shared(&all[..count]),
            Parameters::PerLane(all) => Parameters::PerLane(&all[..count * lanes]),
        }
    }

    /// φ.
    fn phase(&self, parameters: Parameters, lane: usize, lanes: usize) -> f64 {
        let index = self.field.parameter_count();
        let found = match parameters {
            Parameters::Shared(all) => all.get(index),
            Parameters::PerLane(all) => all.get(index * lanes + lane),
        };
        found.copied().unwrap_or(0.0)
    }

    fn flight(&self, at: &Batch, i: usize) -> Flight {
        let (n, lanes, kinks) = (self.n(), at.lanes, self.kinks());
        let duration = |j: usize, l: usize| at.states[(j * (n + 1) + n) * lanes + l];
        let lasts: Vec<f64> = (0..lanes).map(|l| duration(i, l)).collect();
        let time = |l: usize| {
            let before: f64 = (0..i).map(|j| duration(j, l)).sum();
            self.phase(at.parameters, l, lanes) + before + lasts[l] * at.times.get(l).copied().unwrap_or(0.0)
        };
        let times = if self.forced_inside() { (0..lanes).map(time).collect() } else { Vec::new() };
        let mut signs = Vec::new();
        if !at.signs.is_empty() {
            signs.extend_from_slice(&at.signs[i * kinks * lanes..(i + 1) * kinks * lanes]);
            signs.resize(self.field.switch_count() * lanes, 1.0);
        }
        Flight { lasts, times, signs }
    }

    /// The batch of flight i as seen by the field itself.
    fn inner<'b>(&self, at: &Batch<'b>, i: usize, flight: &'b Flight) -> Batch<'b> {
        let (n, lanes) = (self.n(), at.lanes);
        let states = &at.states[i * (n + 1) * lanes..][..n * lanes];
        let parameters = self.own_parameters(at.parameters, lanes);
        Batch { lanes, states, parameters, times: &flight.times, signs: &flight.signs }
    }

    /// The parameters of the field itself among `free`, and the column of each.
    fn own_free(&self, free: &[usize]) -> (Vec<usize>, Vec<usize>) {
        let own = free.iter().enumerate().filter(|(_, index)| **index < self.field.parameter_count());
        own.map(|(column, index)| (*index, column)).unzip()
    }

    /// Columns of φ among `free`.
    fn of_phase<'f>(&self, free: &'f [usize]) -> impl Iterator<Item = usize> + use<'f> {
        let index = self.field.parameter_count();
        free.iter().enumerate().filter(move |(_, own)| **own == index).map(|(column, _)| column)
    }
}

impl VectorField for Segments<'_> {
    fn dim(&self) -> usize {
        self.events.len() * (self.n() + 1)
    }

    fn parameter_count(&self) -> usize {
        self.field.parameter_count() + usize::from(self.forced_inside())
    }

    fn forced(&self) -> bool {
        true
    }

    fn ended(&self) -> bool {
        self.field.ended()
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        let (n, lanes) = (self.n(), at.lanes);
        f.fill(0.0);
        for i in 0..self.events.len() {
            let flight = self.flight(&at, i);
            let own = &mut f[i * (n + 1) * lanes..][..n * lanes];
            self.field.evaluate(self.inner(&at, i, &flight), own);
            own.iter_mut().enumerate().for_each(|(k, f)| *f *= flight.lasts[k % lanes]);
        }
    }

    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        let (n, lanes, q, all) = (self.n(), at.lanes, free.len(), self.dim());
        let (own_free, columns) = self.own_free(free);
        let [mut own_fx, mut own_fp, mut in_time] = [n * n, n * own_free.len(), n].map(|size| vec![0.0; size * lanes]);
        fx.fill(0.0);
        fp.fill(0.0);
        f.fill(0.0);
        for i in 0..self.events.len() {
            let flight = self.flight(&at, i);
            let batch = self.inner(&at, i, &flight);
            let first = i * (n + 1);
            let own = &mut f[first * lanes..][..n * lanes];
            self.field.linearise(batch, &own_free, own, &mut own_fx, &mut own_fp);
            if self.forced_inside() {
                self.field.slopes_in_time(batch, &mut in_time);
            }
            for (a, l) in (0..n * lanes).map(|k| (k / lanes, k % lanes)) {
                let (row, last) = (first + a, flight.lasts[l]);
                for b in 0..n {
                    fx[(row * all + first + b) * lanes + l] = last * own_fx[(a * n + b) * lanes + l];
                }
                let later = last * in_time[a * lanes + l];
                let place = at.times.get(l).copied().unwrap_or(0.0);
                fx[(row * all + first + n) * lanes + l] = own[a * lanes + l] + later * place;
                (0..i).for_each(|j| fx[(row * all + j * (n + 1) + n) * lanes + l] = later);
                for (c, column) in columns.iter().enumerate() {
                    fp[(row * q + column) * lanes + l] = last * own_fp[(a * own_free.len() + c) * lanes + l];
                }
                self.of_phase(free).for_each(|column| fp[(row * q + column) * lanes + l] = later);
                own[a * lanes + l] *= last;
            }
        }
    }

    fn directional(&self, at: Batch, directions: &[&[f64]], out: &mut [f64]) {
        let [along] = directions else { return out.fill(f64::NAN) };
        let (all, lanes, count) = (self.dim(), at.lanes, self.parameter_count());
        let free: Vec<usize> = (0..count).collect();
        let [mut f, mut fx, mut fp] = [1, all, count].map(|size| vec![0.0; all * size * lanes]);
        self.linearise(at, &free, &mut f, &mut fx, &mut fp);
        for (row, l) in (0..all * lanes).map(|k| (k / lanes, k % lanes)) {
            let by_state = (0..all).map(|c| fx[(row * all + c) * lanes + l] * along[c * lanes + l]);
            let by_parameter = (0..count).map(|c| fp[(row * count + c) * lanes + l] * along[(all + c) * lanes + l]);
            out[row * lanes + l] = by_state.chain(by_parameter).sum();
        }
    }

    fn switch_count(&self) -> usize {
        self.events.len() * self.kinks()
    }

    fn are_independent(&self, one: usize, other: usize) -> bool {
        one / self.kinks() != other / self.kinks()
    }

    fn switch_name(&self, switch: usize) -> String {
        self.field.switch_name(switch % self.kinks())
    }

    fn switches(&self, at: Batch, out: &mut [f64]) {
        let size = self.kinks() * at.lanes;
        let mut all = vec![0.0; self.field.switch_count() * at.lanes];
        for i in 0..self.events.len() {
            let flight = self.flight(&at, i);
            self.field.switches(self.inner(&at, i, &flight), &mut all);
            out[i * size..(i + 1) * size].copy_from_slice(&all[..size]);
        }
    }

    fn linearise_switches(&self, at: Batch, free: &[usize], [h, hx, hp, ht]: [&mut [f64]; 4]) {
        let (n, lanes, q, all, kinks) = (self.n(), at.lanes, free.len(), self.dim(), self.kinks());
        let (own_free, columns) = self.own_free(free);
        let count = self.field.switch_count();
        let [mut own_h, mut own_hx, mut own_hp, mut in_time] =
            [1, n, own_free.len(), 1].map(|size| vec![0.0; count * size * lanes]);
        hx.fill(0.0);
        hp.fill(0.0);
        for i in 0..self.events.len() {
            let flight = self.flight(&at, i);
            let to = [&mut own_h[..], &mut own_hx, &mut own_hp, &mut in_time];
            self.field.linearise_switches(self.inner(&at, i, &flight), &own_free, to);
            let first = i * (n + 1);
            for (s, l) in (0..kinks * lanes).map(|k| (k / lanes, k % lanes)) {
                let row = i * kinks + s;
                let later = if self.forced_inside() { in_time[s * lanes + l] } else { 0.0 };
                h[row * lanes + l] = own_h[s * lanes + l];
                ht[row * lanes + l] = later * flight.lasts[l];
                for b in 0..n {
                    hx[(row * all + first + b) * lanes + l] = own_hx[(s * n + b) * lanes + l];
                }
                hx[(row * all + first + n) * lanes + l] = later * at.times.get(l).copied().unwrap_or(0.0);
                (0..i).for_each(|j| hx[(row * all + j * (n + 1) + n) * lanes + l] = later);
                for (c, column) in columns.iter().enumerate() {
                    hp[(row * q + column) * lanes + l] = own_hp[(s * own_free.len() + c) * lanes + l];
                }
                self.of_phase(free).for_each(|column| hp[(row * q + column) * lanes + l] = later);
            }
        }
    }

    fn conditions(&self) -> [usize; 2] {
        [self.dim() + usize::from(self.forced_inside()), 0]
    }

    fn determined(&self) -> &[usize] {
        &self.determined
    }

    fn boundary(&self, ends: [&[f64]; 2], parameters: &[f64], free: &[usize], to: [&mut [f64]; 4]) {
        let (n, q, all, k) = (self.n(), free.len(), self.dim(), self.events.len());
        let [b, by_left, by_right, by] = to;
        [&mut *by_left, &mut *by_right, &mut *by].into_iter().for_each(|values| values.fill(0.0));
        let [left, right] = ends;
        let (own_free, columns) = self.own_free(free);
        let (count, phase) = (own_free.len(), self.phase(Parameters::Shared(parameters), 0, 1));
        let switches = self.field.switch_count();
        for (i, event) in self.events.iter().enumerate() {
            let first = i * (n + 1);
            let time = [phase + (0..=i).map(|j| right[j * (n + 1) + n]).sum::<f64>()];
            let times = if self.forced_inside() { &time[..] } else { &[] };
            let own = Parameters::Shared(&parameters[..self.field.parameter_count()]);
            let at = Batch { lanes: 1, states: &right[first..first + n], parameters: own, times, signs: &[] };
            let [mut r, mut rx, mut rp, mut rt] = [1, n, count, 1].map(|size| vec![0.0; n * size]);
            self.field.reset(*event, at, &own_free, [&mut r, &mut rx, &mut rp, &mut rt]);
            let [mut h, mut hx, mut hp, mut ht] = [1, n, count, 1].map(|size| vec![0.0; switches * size]);
            self.field.linearise_switches(at, &own_free, [&mut h, &mut hx, &mut hp, &mut ht]);
            let surface = self.kinks() + event;
            let next = (i + 1) % k * (n + 1);
            for a in 0..=n {
                let row = first + a;
                // The rows of -R, and that of h.
                let (value, slope, in_state, in_parameters) = match a < n {
                    true => (-r[a], -rt[a], &rx[a * n..(a + 1) * n], &rp[a * count..(a + 1) * count]),
                    false => (
                        h[surface],
                        ht[surface],
                        &hx[surface * n..(surface + 1) * n],
                        &hp[surface * count..(surface + 1) * count],
                    ),
                };
                let sign = if a < n { -1.0 } else { 1.0 };
                b[row] = value;
                if a < n {
                    b[row] += left[next + a];
                    by_left[row * all + next + a] = 1.0;
                }
                (0..n).for_each(|c| by_right[row * all + first + c] = sign * in_state[c]);
                (0..count).for_each(|c| by[row * q + columns[c]] = sign * in_parameters[c]);
                if self.forced_inside() {
                    (0..=i).for_each(|j| by_right[row * all + j * (n + 1) + n] = slope);
                    self.of_phase(free).for_each(|column| by[row * q + column] = slope);
                }
            }
        }
        if self.forced_inside() {
            b[all] = (0..k).map(|i| left[i * (n + 1) + n]).sum::<f64>() - f64::from(self.forcing_periods);
            (0..k).for_each(|i| by_left[all * all + i * (n + 1) + n] = 1.0);
        }
    }
}

/// A field without states.
pub(super) struct Nothing;

impl VectorField for Nothing {
    fn dim(&self) -> usize {
        0
    }

    fn parameter_count(&self) -> usize {
        0
    }

    fn evaluate(&self, _at: Batch, _f: &mut [f64]) {}

    fn linearise(&self, _at: Batch, _free: &[usize], _f: &mut [f64], _fx: &mut [f64], _fp: &mut [f64]) {}

    fn directional(&self, _at: Batch, _directions: &[&[f64]], _out: &mut [f64]) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Definition, Event, Forcing, Model, ModelSource, Parameter, State};

    /// An oscillator with a wall and a spring whose end moves.
    fn model() -> Model {
        Model::compile(ModelSource {
            parameters: vec![Parameter::new("w", 1.3), Parameter::new("g", 0.4)],
            forcing: Some(Forcing { is_frequency: true, expression: "w".into() }),
            states: vec![State::new("x"), State::new("v")],
            equations: vec![
                Definition::new("x", "v"),
                Definition::new("v", "-x - 3*max(x - g*sin(w*t), 0) - 0.2*sign(v)"),
            ],
            events: vec![Event {
                name: "wall".into(),
                when: "x - 1".into(),
                set: vec![Definition::new("v", "-0.8*v")],
                ..Event::default()
            }],
            ..ModelSource::default()
        })
        .unwrap()
    }

    #[test]
    fn derivatives_of_the_switches_of_all_flights_are_exact() {
        let model = model();
        let segments = Segments::new(&model, vec![0, 0], 1);
        let (size, count) = (segments.dim(), segments.switch_count());
        assert_eq!([size, count], [6, 4]);
        // x, v and T of both flights; w, g and φ; s.
        let at = [0.3, -0.5, 0.6, -0.2, 0.7, 0.4, 1.3, 0.4, 0.15, 0.35];
        let values = |all: &[f64]| {
            let mut h = vec![0.0; count];
            let parameters = Parameters::Shared(&all[size..size + 3]);
            let batch = Batch { lanes: 1, states: &all[..size], parameters, times: &all[size + 3..], signs: &[] };
            segments.switches(batch, &mut h);
            h
        };
        let [mut h, mut hx, mut hp, mut ht] = [1, size, 3, 1].map(|width| vec![0.0; count * width]);
        let parameters = Parameters::Shared(&at[size..size + 3]);
        let batch = Batch { lanes: 1, states: &at[..size], parameters, times: &at[size + 3..], signs: &[] };
        segments.linearise_switches(batch, &[0, 1, 2], [&mut h, &mut hx, &mut hp, &mut ht]);
        assert_eq!(h, values(&at));
        for k in 0..at.len() {
            let moved = |by: f64| {
                let mut all = at;
                all[k] += by;
                values(&all)
            };
            let step = 1e-5;
            let (more, less) = (moved(step), moved(-step));
            for row in 0..count {
                let exact = match k {
                    k if k < size => hx[row * size + k],
                    k if k < size + 3 => hp[row * 3 + k - size],
                    _ => ht[row],
                };
                let difference = (more[row] - less[row]) / (2.0 * step);
                assert!((exact - difference).abs() < 1e-8, "switch {row}, variable {k}: {exact} {difference}");
            }
        }
    }

    /// Slides of different flights do not disturb each other.
    #[test]
    fn two_flights_slide_at_once() {
        let model = model();
        let segments = Segments::new(&model, vec![0, 0], 1);
        let states = [0.05, 0.0, 0.6, -0.02, 0.0, 0.4];
        let names: Vec<String> = (0..4).map(|switch| segments.switch_name(switch)).collect();
        let stick = names.iter().position(|name| name == "v").unwrap();
        assert!(segments.are_independent(stick, stick + 2) && !segments.are_independent(0, 1));
        let mut signs = [-1.0; 4];
        (signs[stick], signs[stick + 2]) = (0.0, 0.0);
        let mut f = vec![0.0; 6];
        let parameters = Parameters::Shared(&[1.3, 0.4, 0.1]);
        segments.evaluate(Batch { lanes: 1, states: &states, parameters, times: &[0.2], signs: &signs }, &mut f);
        assert!([1, 4].iter().all(|row| f[*row].abs() < 1e-14), "{f:?}");
    }
}
