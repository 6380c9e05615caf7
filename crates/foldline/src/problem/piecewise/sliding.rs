//! Parts that slide along the surface of a switch at which f jumps.

use super::search::Course;
use super::{PiecewiseFlow, Trial, ZERO};
use crate::contract::{Batch, Parameters, VectorField};

impl PiecewiseFlow<'_> {
    /// f along the surface of a switch at `x` on it.
    pub(super) fn along_surface(&self, x: &[f64], t: f64, signs: &[f64], switch: usize) -> Vec<f64> {
        let (time, mut signs, mut f) = (self.time(t), signs.to_vec(), vec![0.0; self.n()]);
        signs[switch] = 0.0;
        let parameters = Parameters::Shared(&self.parameters);
        let batch = Batch { lanes: 1, states: x, parameters, times: time.as_slice(), signs: &signs };
        self.setting.field.evaluate(batch, &mut f);
        f
    }

    /// Rate of change of a switch at `x` under the branch of f of its sign.
    pub(super) fn normal_speed(&self, x: &[f64], t: f64, signs: &[f64], switch: usize) -> f64 {
        let (time, parameters) = (self.time(t), Parameters::Shared(&self.parameters));
        let batch = Batch { lanes: 1, states: x, parameters, times: time.as_slice(), signs };
        let [below, above] = self.setting.field.normal_speeds(batch, switch);
        if signs[switch] < 0.0 { below[0] } else { above[0] }
    }

    /// Rate at which f on one side of the surface of a switch leads towards it, at a place of a polynomial.
    pub(super) fn push(
        &self,
        nodes: &[f64],
        [begin, end]: [f64; 2],
        s: f64,
        signs: &[f64],
        switch: usize,
        side: f64,
    ) -> f64 {
        let mut x = vec![0.0; self.n()];
        self.scheme.value_into(s, nodes, &mut x);
        let time = self.time(begin + s * (end - begin));
        let parameters = Parameters::Shared(&self.parameters);
        let batch = Batch { lanes: 1, states: &x, parameters, times: time.as_slice(), signs };
        let [below, above] = self.setting.field.normal_speeds(batch, switch);
        if side < 0.0 { below[0] } else { -above[0] }
    }

    /// The place at which a trial that slides along the surface of a switch leaves it, and the side. `states` `[n ×
    /// places]` and `times` are those of the trial at the places.
    pub(super) fn leaving(
        &self,
        trial: &Trial,
        switch: usize,
        places: &[f64],
        states: &[f64],
        times: &[f64],
    ) -> Option<(f64, f64)> {
        let lanes = places.len();
        let signs: Vec<f64> = trial.signs.iter().flat_map(|sign| std::iter::repeat_n(*sign, lanes)).collect();
        let parameters = Parameters::Shared(&self.parameters);
        let batch = Batch { lanes, states, parameters, times, signs: &signs };
        let [below, above] = self.setting.field.normal_speeds(batch, switch);
        let size = below.iter().chain(&above).fold(0.0, |most: f64, speed| most.max(speed.abs()));
        let pushes = [(-1.0, below), (1.0, above.iter().map(|speed| -speed).collect())];
        let first = pushes.into_iter().filter_map(|(side, margins)| {
            let at = |s: f64| self.push(trial.nodes, trial.ends, s, trial.signs, switch, side);
            match super::search::violated(places, &margins, ZERO * size, &at, &|_, _| false)? {
                Course::Crosses([left, right]) => Some((super::search::root(&at, left, right), side)),
                Course::Nears(_) => None,
            }
        });
        first.min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// One branch of a field with switches.
pub(crate) struct OneBranch<'a> {
    pub field: &'a dyn VectorField,
    /// Signs of the switches; see [`Batch::signs`].
    pub signs: &'a [f64],
}

impl OneBranch<'_> {
    fn signs(&self, lanes: usize) -> Vec<f64> {
        self.signs.iter().flat_map(|sign| std::iter::repeat_n(*sign, lanes)).collect()
    }
}

impl VectorField for OneBranch<'_> {
    fn dim(&self) -> usize {
        self.field.dim()
    }

    fn parameter_count(&self) -> usize {
        self.field.parameter_count()
    }

    fn forced(&self) -> bool {
        self.field.forced()
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        self.field.evaluate(Batch { signs: &self.signs(at.lanes), ..at }, f);
    }

    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        self.field.linearise(Batch { signs: &self.signs(at.lanes), ..at }, free, f, fx, fp);
    }

    fn directional(&self, at: Batch, directions: &[&[f64]], out: &mut [f64]) {
        self.field.directional(Batch { signs: &self.signs(at.lanes), ..at }, directions, out);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Scheme, identity};
    use super::*;
    use crate::linalg::dot;
    use crate::model::{Definition, Model, ModelSource, Parameter, State};
    use crate::problem::{Axis, Setting};

    /// A block on a belt of speed p, with friction that decreases with the slip.
    fn belt() -> Model {
        Model::compile(ModelSource {
            parameters: vec![Parameter::new("p", 0.5)],
            states: vec![State::new("x"), State::new("v")],
            equations: vec![
                Definition::new("x", "v"),
                Definition::new("v", "-0.1*v - x + sign(p - v)/(1 + 3*abs(p - v))"),
            ],
            ..ModelSource::default()
        })
        .unwrap()
    }

    /// Starts on the surface, beside it, and close to where the slide ends at x = 1 - 0.1 p.
    #[test]
    fn derivatives_of_a_slide_are_those_of_the_flow() {
        let (model, scales) = (belt(), [1.0, 1.0]);
        let setting = Setting { field: &model, scales: &scales, parameters: vec![0.5], axes: vec![Axis::new(0, 1.0)] };
        let (n, width, scheme) = (2, 4, Scheme::of(4));
        let at = |x: &[f64], scalars: &[f64]| {
            let flow = PiecewiseFlow::new(&setting, scheme, scalars, 0);
            flow.along(0, x, [0.0, 1.0], &x.repeat(5), &[1.0]).unwrap()
        };
        for start in [
            [0.5, 0.5],
            [0.5, 0.5 + 1e-3],
            [0.5, 0.5 - 1e-3],
            [0.94, 0.5],
            [0.95 - 1e-4, 0.5],
            [0.95 - 1e-7, 0.5],
            [0.95 - 1e-9, 0.5],
            [0.95 - 1e-12, 0.5],
            [0.95, 0.5],
            [0.95 + 1e-12, 0.5],
            [0.95 + 1e-9, 0.5],
            [0.95 + 1e-6, 0.5],
            [0.95 - 1e-6, 0.5 + 1e-14],
            [0.95 - 1e-6, 0.5 - 1e-14],
            [0.95 - 1e-6, 0.5 + 1e-11],
        ] {
            for length in [0.1, 1e-3] {
                let scalars = [length, 0.5];
                let own = at(&start, &scalars);
                // Along the surface.
                let direction = [0.7, 0.4, 0.0, 0.4];
                let moved = |by: f64| {
                    let at_start: Vec<f64> = (0..n).map(|c| start[c] + by * direction[c]).collect();
                    at(&at_start, &[length, 0.5 + by * direction[3]]).end
                };
                let step = 1e-5;
                let (more, less) = (moved(step), moved(-step));
                for c in 0..n {
                    let exact = dot(&own.end_by[c * width..(c + 1) * width], &direction);
                    let difference = (more[c] - less[c]) / (2.0 * step);
                    assert!(
                        (exact - difference).abs() < 1e-4,
                        "{start:?} {length}: {exact} {difference} {:?}",
                        own.parts.iter().map(|p| (p.signs.clone(), p.ends)).collect::<Vec<_>>()
                    );
                }
            }
        }
        assert_eq!(identity(1, 1), [1.0]);
    }
}
