//! Solutions: equilibria and cycles at given parameters.

use crate::bytes::{counted, integers, numbers, parts};
use crate::model::outputs_at;
use foldline::attractors::{signed_spectrum, spectral_ratio};
use foldline::contract::VectorField;
use foldline::diagram::{self, Cycle, Point};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::sync::Arc;

/// A computed point with its model.
#[pyclass(frozen, module = "foldline._native")]
pub struct Solution {
    pub point: Arc<Point>,
    model: foldline::model::Model,
}

impl Solution {
    pub fn new(point: Point, model: &foldline::model::Model) -> Solution {
        Solution { point: Arc::new(point), model: model.clone() }
    }

    fn cycle(&self) -> Option<&Cycle> {
        match &self.point.solution {
            diagram::Solution::Cycle(cycle) if !cycle.profile.is_empty() => Some(cycle),
            _ => None,
        }
    }
}

/// Bytes of an array.
type Array<'py> = PyResult<Bound<'py, PyBytes>>;

#[pymethods]
impl Solution {
    #[getter]
    fn position(&self) -> i64 {
        self.point.position
    }

    #[getter]
    fn family(&self) -> &'static str {
        match self.point.solution {
            diagram::Solution::Equilibrium(_) => "equilibrium",
            diagram::Solution::Cycle(_) => "cycle",
            diagram::Solution::Torus(_) => "torus",
        }
    }

    #[getter]
    fn period(&self) -> Option<f64> {
        self.point.solution.period()
    }

    #[getter]
    fn forcing_periods(&self) -> u32 {
        self.point.solution.forcing_periods()
    }

    #[getter]
    fn unstable(&self) -> usize {
        self.point.unstable
    }

    /// Number of turns over the cycle of each state that is an angle.
    #[getter]
    fn turns(&self) -> Vec<(&str, i64)> {
        let of = |(k, period): (usize, f64)| (&*self.model.states[k].name, self.point.solution.turns(k, period));
        self.model.angles().map(of).collect()
    }

    /// Parameters `[k]`.
    fn parameters<'py>(&self, py: Python<'py>) -> Array<'py> {
        numbers(py, self.point.parameters.iter().copied())
    }

    /// Equilibrium, or first state of the cycle, `[n]`.
    fn state<'py>(&self, py: Python<'py>) -> Array<'py> {
        let state = match &self.point.solution {
            diagram::Solution::Equilibrium(x) => &x[..],
            diagram::Solution::Cycle(cycle) => cycle.profile.get(..self.model.dim()).unwrap_or(&[]),
            diagram::Solution::Torus(torus) => torus.profile.get(..self.model.dim()).unwrap_or(&[]),
        };
        numbers(py, state.iter().copied())
    }

    /// Real and imaginary parts of eigenvalues or multipliers.
    fn spectrum<'py>(&self, py: Python<'py>) -> Array<'py> {
        // A boundary-value problem has no multipliers.
        let known = if self.model.conditions() == [0, 0] { &self.point.spectrum[..] } else { &[] };
        counted(py, 2 * known.len(), parts(known))
    }

    /// Ranges of states and outputs, `[n + outputs][2]`.
    fn ranges<'py>(&self, py: Python<'py>) -> Array<'py> {
        numbers(py, self.point.ranges.as_flattened().iter().copied())
    }

    /// Error estimates: discretisation, residual, trivial defect, Liouville defect, error of the spectrum.
    #[getter]
    fn trust(&self) -> (f64, f64, f64, f64, f64) {
        let t = &self.point.trust;
        (t.discretisation, t.residual, t.trivial_defect, t.liouville_defect, t.spectrum)
    }

    /// Work: Newton iterations, factorisations, rejected steps, evaluations, linearisations.
    fn cost<'py>(&self, py: Python<'py>) -> Array<'py> {
        let c = &self.point.cost;
        let all = [c.newton, c.factorisations, c.rejected, c.evaluations, c.linearisations];
        integers(py, all.into_iter().map(|count| count as i64))
    }

    /// Boundaries of the mesh in normalised time, `[N + 1]`.
    fn mesh<'py>(&self, py: Python<'py>) -> Array<'py> {
        numbers(py, self.cycle().map_or(&[][..], |cycle| &cycle.mesh).iter().copied())
    }

    /// Profile `[N][m + 1][n]`, and m.
    fn profile<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyBytes>, usize)> {
        let cycle = self.cycle();
        let values = numbers(py, cycle.map_or(&[][..], |cycle| &cycle.profile).iter().copied())?;
        Ok((values, cycle.map_or(0, |cycle| cycle.degree)))
    }

    /// Normalised times of the nodes of the profile, `[N (m + 1)]`.
    fn node_times<'py>(&self, py: Python<'py>) -> Array<'py> {
        let Some(cycle) = self.cycle() else { return numbers(py, [].into_iter()) };
        let scheme = cycle.scheme();
        let nodes = &scheme.nodes[..=cycle.degree];
        let on = |pair: &[f64]| nodes.iter().map(|c| pair[0] + (pair[1] - pair[0]) * c).collect::<Vec<f64>>();
        numbers(py, cycle.mesh.windows(2).flat_map(on).collect::<Vec<f64>>().into_iter())
    }

    /// States and outputs `[count][n + outputs]` at `count` uniformly spaced times over one period, the end point
    /// excluded.
    fn uniform<'py>(&self, py: Python<'py>, count: usize) -> Array<'py> {
        let Some(cycle) = self.cycle() else { return numbers(py, [].into_iter()) };
        let (n, m) = (self.model.dim(), self.model.output_count());
        let states = cycle.uniform(count);
        let times: Vec<f64> = match self.model.forced() {
            true => (0..count).map(|s| f64::from(cycle.forcing_periods) * s as f64 / count as f64).collect(),
            false => Vec::new(),
        };
        let outputs = outputs_at(&self.model, &states, &self.point.parameters, &times);
        let row = |s: usize| states[s * n..(s + 1) * n].iter().chain(&outputs[s * m..(s + 1) * m]);
        counted(py, count * (n + m), (0..count).flat_map(row).copied())
    }

    /// Frequencies, and real and imaginary parts of the amplitudes, of the whirling motion; empty if the model names
    /// none.
    fn signed_spectrum<'py>(
        &self,
        py: Python<'py>,
        count: usize,
    ) -> PyResult<(Bound<'py, PyBytes>, Bound<'py, PyBytes>)> {
        let lines = self.cycle().zip(self.model.whirl).map(|(cycle, whirl)| signed_spectrum(cycle, whirl, count));
        let lines = lines.unwrap_or_default();
        let amplitudes = counted(py, 2 * lines.len(), lines.iter().flat_map(|(_, z)| [z.re, z.im]))?;
        Ok((numbers(py, lines.iter().map(|(frequency, _)| *frequency))?, amplitudes))
    }

    /// Ratio of the two strongest lines, such as 2:1.
    #[getter]
    fn ratio(&self) -> Option<(u32, u32)> {
        spectral_ratio(self.cycle()?, self.model.whirl?)
    }
}
