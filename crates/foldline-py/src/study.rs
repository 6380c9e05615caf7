//! Studies: descriptions of computations.

use crate::failure;
use crate::model::Model;
use foldline_store::order::leg;
use foldline_store::study_file::{self, parse_study, parse_study_in, read_study};
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A study with its model.
#[pyclass(frozen, module = "foldline._native")]
pub struct Study {
    pub study: Arc<study_file::Study>,
}

#[pymethods]
impl Study {
    /// Reads a study for a given model from text; `file` is its name in messages.
    #[staticmethod]
    fn parse(py: Python, text: &str, file: &str, model: &Model) -> PyResult<Study> {
        let study = py.detach(|| parse_study(text, file, &model.text, &model.file));
        study.map(|study| Study { study: Arc::new(study) }).map_err(|found| failure::of_text(py, &found))
    }

    /// Reads a study from text, and the model that it names by a path relative to the current folder; `file` is its
    /// name in messages.
    #[staticmethod]
    fn parse_text(py: Python, text: &str, file: &str) -> PyResult<Study> {
        let study = py.detach(|| parse_study_in(text, file, Path::new("")));
        study.map(|study| Study { study: Arc::new(study) }).map_err(|found| failure::of_text(py, &found))
    }

    /// Reads a study file and the model that it names.
    #[staticmethod]
    fn read(py: Python, path: PathBuf) -> PyResult<Study> {
        let study = py.detach(|| read_study(&path));
        study.map(|study| Study { study: Arc::new(study) }).map_err(|found| failure::of_text(py, &found))
    }

    /// Returns the study with other limits on trajectories, which become part of its text.
    fn limited(&self, py: Python, steps: Option<u64>, time: Option<String>) -> PyResult<Study> {
        let study = (*self.study).clone().limited(steps, time.as_deref());
        study.map(|study| Study { study: Arc::new(study) }).map_err(|found| failure::of_text(py, &found))
    }

    #[getter]
    fn text(&self) -> &str {
        &self.study.text
    }

    #[getter]
    fn file(&self) -> &str {
        &self.study.file
    }

    #[getter]
    fn tolerance(&self) -> f64 {
        self.study.plan.tolerance
    }

    #[getter]
    fn degree(&self) -> usize {
        self.study.plan.degree
    }

    /// Model of the study, with the parameter values of the model's text.
    fn model(&self) -> Model {
        let study = &self.study;
        Model { model: study.model.clone(), text: study.model_text.clone(), file: study.model_file.clone() }
    }

    /// Range of the branch of that name, if the study states it.
    fn range_of(&self, branch: &str) -> Option<(f64, f64)> {
        let plan = &self.study.plan;
        let within = |name: &str| branch == name || branch.strip_prefix(name).is_some_and(|rest| rest.starts_with('/'));
        let branches = plan.branches.iter().filter(|b| within(&b.name)).map(|b| (b.name.len(), b.range));
        let explorations = plan.explorations.iter().filter(|e| within(&e.name)).map(|e| (e.name.len(), e.range));
        let curves = plan.curves.iter().filter(|c| c.name == branch).map(|c| (c.name.len(), c.ranges[1]));
        let longest = branches.chain(explorations).chain(curves).max_by_key(|(length, _)| *length);
        longest.map(|(_, [low, high])| (low, high))
    }

    /// True if that branch is a run of a homotopy.
    fn is_leg(&self, branch: &str) -> bool {
        self.study.plan.homotopies.iter().any(|homotopy| leg(branch, &homotopy.name).is_some())
    }
}
