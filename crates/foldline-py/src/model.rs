//! Models read from text.

use crate::bytes::{numbers, read};
use crate::failure;
use foldline::contract::{Batch, Parameters, VectorField};
use foldline_store::model_file::{parse_model, read_model};
use foldline_store::nearest::suggest;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::PathBuf;

/// A model and its text.
#[pyclass(frozen, module = "foldline._native")]
pub struct Model {
    pub model: foldline::model::Model,
    #[pyo3(get)]
    pub text: String,
    #[pyo3(get)]
    pub file: String,
}

/// Scale, range and period, where a model states them.
type Stated = (Option<f64>, Option<(f64, f64)>, Option<f64>);

/// Name, unit, description.
type Named<'m> = (&'m str, &'m str, &'m str);

#[pymethods]
impl Model {
    /// Reads a model from text; `file` is its name in messages.
    #[staticmethod]
    fn parse(py: Python, text: String, file: String) -> PyResult<Model> {
        let model = py.detach(|| parse_model(&text, &file)).map_err(|found| failure::of_text(py, &found))?;
        Ok(Model { model, text, file })
    }

    /// Reads a model file.
    #[staticmethod]
    fn read(py: Python, path: PathBuf) -> PyResult<Model> {
        let (model, text) = py.detach(|| read_model(&path)).map_err(|found| failure::of_text(py, &found))?;
        Ok(Model { model, text, file: path.display().to_string() })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.model.name
    }

    #[getter]
    fn description(&self) -> &str {
        &self.model.description
    }

    /// Name, unit, description and value of each parameter.
    #[getter]
    fn parameters(&self) -> Vec<(Named<'_>, f64)> {
        self.model.parameters.iter().map(|p| ((&*p.name, &*p.unit, &*p.description), p.value)).collect()
    }

    /// Name, unit and description of each state, with scale, range and period where the model states them.
    #[getter]
    fn states(&self) -> Vec<(Named<'_>, Stated)> {
        let row = |s: &foldline::model::State| (s.scale, s.range.map(|[low, high]| (low, high)), s.period);
        let named = self.model.states.iter().map(|s| ((&*s.name, &*s.unit, &*s.description), row(s)));
        named.collect()
    }

    /// Name, unit and description of each output.
    #[getter]
    fn outputs(&self) -> Vec<Named<'_>> {
        self.model.outputs.iter().map(|o| (&*o.name, &*o.unit, &*o.description)).collect()
    }

    /// Unit of time, and hence of periods; empty if it is not known.
    #[getter]
    fn time(&self) -> &str {
        &self.model.time
    }

    /// Doubts about the units.
    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.model.remarks.clone()
    }

    /// Indices of the two states of the complex signal.
    #[getter]
    fn whirl(&self) -> Option<(usize, usize)> {
        self.model.whirl.map(|[u, v]| (u, v))
    }

    #[getter]
    fn forced(&self) -> bool {
        self.model.forced() && !self.model.iterated()
    }

    /// Period of the forcing at parameters `[k]`; 1 for an unforced model.
    fn time_unit(&self, parameters: &[u8]) -> f64 {
        self.model.time_unit(&read(parameters))
    }

    /// Values of all parameters `[k]`, some of them replaced by name.
    fn values<'py>(&self, py: Python<'py>, given: Vec<(String, f64)>) -> PyResult<Bound<'py, PyBytes>> {
        let mut values = self.model.defaults();
        for (name, value) in given {
            let index = self.index(py, &name)?;
            if !value.is_finite() {
                let cure = "a number such as 5, 0.25 or 1e-6";
                return Err(failure::of_argument(py, format!("{name} = {value} is not a finite number"), cure));
            }
            values[index] = value;
        }
        numbers(py, values.into_iter())
    }

    /// Evaluates the right-hand side in the time of the model, or the outputs, at points `[lanes][n]` with parameters
    /// `[k]` and, for a forced model, times `[lanes]`: returns `[lanes][n]` or `[lanes][outputs]`.
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        states: &[u8],
        parameters: &[u8],
        times: &[u8],
        outputs: bool,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let (states, parameters, times) = (read(states), read(parameters), read(times));
        let unit = self.model.time_unit(&parameters);
        let times: Vec<f64> = times.iter().map(|t| t / unit).collect();
        let rows = match outputs {
            true => outputs_at(&self.model, &states, &parameters, &times),
            false => {
                let n = self.model.dim();
                let f = batched(n, n, &states, &parameters, &times, |at, f| self.model.evaluate(at, f));
                f.into_iter().map(|f| f / unit).collect()
            }
        };
        numbers(py, rows.into_iter())
    }
}

impl Model {
    /// Index of the parameter of that name.
    pub fn index(&self, py: Python, name: &str) -> PyResult<usize> {
        self.model.parameter_index(name).ok_or_else(|| {
            let known: Vec<&str> = self.model.parameters.iter().map(|p| p.name.as_str()).collect();
            let message = format!("the model `{}` has no parameter `{name}`", self.model.name);
            failure::of_argument(py, message, suggest(name, &known))
        })
    }
}

/// Suggests the known name nearest to a word, or lists the known names, in words.
#[pyfunction]
#[pyo3(name = "suggest")]
pub fn suggested(word: &str, known: Vec<String>) -> String {
    suggest(word, &known.iter().map(String::as_str).collect::<Vec<_>>())
}

/// Outputs at states `[lanes][n]`, with times in forcing periods: `[lanes][outputs]`.
pub fn outputs_at(model: &foldline::model::Model, states: &[f64], parameters: &[f64], times: &[f64]) -> Vec<f64> {
    batched(model.dim(), model.output_count(), states, parameters, times, |at, out| model.outputs(at, out))
}

/// Evaluates rows: `[lanes][n]` → `[lanes][m]`.
fn batched(
    n: usize,
    m: usize,
    states: &[f64],
    parameters: &[f64],
    times: &[f64],
    evaluate: impl Fn(Batch, &mut [f64]),
) -> Vec<f64> {
    let lanes = states.len() / n.max(1);
    let by_component: Vec<f64> = (0..n * lanes).map(|k| states[(k % lanes) * n + k / lanes]).collect();
    let mut out = vec![0.0; m * lanes];
    evaluate(
        Batch { lanes, states: &by_component, parameters: Parameters::Shared(parameters), times, signs: &[] },
        &mut out,
    );
    (0..m * lanes).map(|k| out[(k % m) * lanes + k / m]).collect()
}
