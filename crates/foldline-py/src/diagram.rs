//! Results: branches as columns, solutions one by one.

use crate::bytes::{counted, integers, numbers, parts};
use crate::cells::{Answered, answered, dictionary};
use crate::failure;
use crate::saving::save;
use crate::sensitivity::{Distributions, Row};
use crate::solution::Solution;
use crate::study::Study;
use foldline::contract::VectorField;
use foldline::converted::Conversion;
use foldline::diagram::{self, Branch, CellValue, Ending, Origin, Point, Share};
use foldline::explore::MapPlan;
use foldline::explore::cells::answers;
use foldline::special::quantity::Quantity;
use foldline_store::maps::arrays;
use foldline_store::order::{leg, ordered};
use foldline_store::run_file::load;
use foldline_store::short;
use foldline_store::study_file::{self, parse_study_of_run};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

/// A diagram with its study.
#[pyclass(frozen, module = "foldline._native")]
pub struct Diagram {
    pub diagram: Arc<diagram::Diagram>,
    pub study: Arc<study_file::Study>,
    /// Subject of each remark, and the remark.
    #[pyo3(get)]
    pub notes: Vec<(String, String)>,
    /// True if quantities are in other units than those of the equations.
    pub converted: bool,
}

impl Diagram {
    /// Returns the diagram with its branches in the order of the study.
    pub fn new(diagram: diagram::Diagram, study: Arc<study_file::Study>, notes: Vec<(String, String)>) -> Diagram {
        let diagram = Arc::new(ordered(diagram, &study.plan));
        Diagram { diagram, study, notes, converted: false }
    }

    /// Branch with that index.
    pub fn branch(&self, py: Python, index: usize) -> PyResult<&Branch> {
        let found = self.diagram.branches.get(index);
        found.ok_or_else(|| failure::internal(py, format!("there is no branch {index}")))
    }
}

#[pymethods]
impl Diagram {
    /// Special points as the answer of a cell of a map over parameters; without branches the reason, `short` among it.
    fn answer<'py>(&self, py: Python<'py>, short: Vec<String>) -> PyResult<(Option<Answered<'py>>, String)> {
        let notes: Vec<String> = self.notes.iter().map(|(_, note)| note.clone()).collect();
        match answers::points(&self.diagram, &self.study.model, &short, &notes) {
            Ok(found) => Ok((Some(answered(py, found)?), String::new())),
            Err(reason) => Ok((None, reason)),
        }
    }

    /// Loads the run in a folder.
    #[staticmethod]
    fn load(py: Python, folder: PathBuf) -> PyResult<Diagram> {
        let run = py.detach(|| load(&folder)).map_err(|error| failure::of_run_file(py, &error))?;
        let study =
            py.detach(|| parse_study_of_run(&run.study_text, &run.study_file, &run.model_text, &run.model_file));
        let study = study.map_err(|found| failure::of_text(py, &found))?;
        Ok(Diagram::new(run.diagram, Arc::new(study), run.notes))
    }

    /// Writes the diagram as a run into a folder without a run.
    fn save(&self, py: Python, folder: PathBuf) -> PyResult<()> {
        let saved = py.detach(|| save(&folder, &self.study, &self.diagram, &self.notes));
        saved.map_err(|error| failure::of_run_file(py, &error))
    }

    /// Study of the diagram.
    fn study(&self) -> Study {
        Study { study: Arc::clone(&self.study) }
    }

    /// Returns the diagram and its model with some quantities in other units, `(name, unit)`, for display.
    fn in_units(&self, py: Python, units: Vec<(String, String)>) -> PyResult<Diagram> {
        let refused = |[message, cure]: [String; 2]| failure::of_argument(py, message, cure);
        let conversion = Conversion::new(&self.study.model, &units).map_err(refused)?;
        let diagram = Arc::new(conversion.diagram((*self.diagram).clone()));
        let study = study_file::Study { model: conversion.model().clone(), ..(*self.study).clone() };
        Ok(Diagram { diagram, study: Arc::new(study), notes: self.notes.clone(), converted: true })
    }

    /// Unreached parts of the study.
    fn short(&self) -> Vec<String> {
        short::lines(&self.diagram, &self.study.plan, &self.study.model)
    }

    /// Description of each branch.
    fn branches<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.diagram.branches.iter().map(|branch| described(py, branch)).collect()
    }

    /// Column of the points or special points of a branch, as the bytes of an array.
    fn column<'py>(&self, py: Python<'py>, branch: usize, special: bool, name: &str) -> PyResult<Bound<'py, PyBytes>> {
        let branch = self.branch(py, branch)?;
        let points: Vec<&Point> = match special {
            true => branch.special.iter().map(|s| &s.point).collect(),
            false => branch.points.iter().collect(),
        };
        column(py, &points, branch, special, name)
    }

    /// Values of a quantity at the points or special points of a branch, NaN where it has none; `None` if there is no
    /// quantity of that name.
    fn quantity<'py>(
        &self,
        py: Python<'py>,
        branch: usize,
        special: bool,
        name: &str,
    ) -> PyResult<Option<Bound<'py, PyBytes>>> {
        let model = &self.study.model;
        let Some(quantity) = Quantity::named(name, model) else { return Ok(None) };
        if self.converted && quantity.needs_profile() {
            let message = format!("`{name}` is computed in the units of the model");
            return Err(failure::of_argument(py, message, "take it from the diagram without other units"));
        }
        let branch = self.branch(py, branch)?;
        let value = |point: &Point| quantity.on(point, model).unwrap_or(f64::NAN);
        let values: Vec<f64> = match special {
            true => branch.special.iter().map(|s| value(&s.point)).collect(),
            false => branch.points.iter().map(value).collect(),
        };
        numbers(py, values.into_iter()).map(Some)
    }

    /// Kind, unstable before and after, error, coefficients, their errors, criticality and normal form of each special
    /// point of a branch.
    fn special(&self, py: Python, branch: usize) -> PyResult<Vec<SpecialRow>> {
        let row = |s: &diagram::SpecialPoint| {
            let (before, after) = (s.unstable_before, s.unstable_after);
            let coefficients = (s.coefficients.clone(), s.coefficient_errors.clone());
            (s.kind.name(), before, after, s.error, coefficients, s.criticality(), s.normal_form())
        };
        Ok(self.branch(py, branch)?.special.iter().map(row).collect())
    }

    /// A point, or special point, of a branch.
    fn solution(&self, py: Python, branch: usize, special: bool, index: usize) -> PyResult<Solution> {
        let branch = self.branch(py, branch)?;
        let point = match special {
            true => branch.special.get(index).map(|s| &s.point),
            false => branch.points.get(index),
        };
        let point = point.ok_or_else(|| failure::internal(py, format!("there is no point {index}")))?;
        Ok(Solution::new(point.clone(), &self.study.model))
    }

    /// Returns a diagram of one branch only, as the start of a computation that continues it.
    fn only(&self, py: Python, branch: usize, name: &str) -> PyResult<Diagram> {
        let mut branch = self.branch(py, branch)?.clone();
        branch.name = name.to_string();
        let diagram = diagram::Diagram { branches: vec![branch], ..diagram::Diagram::default() };
        let (diagram, study) = (Arc::new(diagram), Arc::clone(&self.study));
        Ok(Diagram { diagram, study, notes: Vec::new(), converted: self.converted })
    }

    /// Derivatives at a special point, or at a point, of a branch.
    fn sensitivities(&self, py: Python, branch: usize, special: bool, index: usize) -> PyResult<Vec<Row>> {
        self.derivatives(py, branch, special, index)
    }

    /// Distributions of the numbers at a special point for uncertain parameters: standard deviations, or ranges.
    fn uncertainty(
        &self,
        py: Python,
        branch: usize,
        index: usize,
        spreads: HashMap<String, (f64, Option<f64>)>,
        samples: usize,
    ) -> PyResult<Distributions> {
        self.distributions(py, branch, index, spreads, samples)
    }

    /// Solution at the target of a homotopy.
    fn arrival(&self, homotopy: &str) -> Option<Solution> {
        let plan = self.study.plan.homotopies.iter().find(|plan| plan.name == homotopy)?;
        let mut legs = self.diagram.branches.iter().filter(|b| leg(&b.name, homotopy).is_some());
        // The first run that reached the target ended the search.
        let point = legs.find_map(|leg| leg.end_at(&plan.targets))?;
        Some(Solution::new(point.clone(), &self.study.model))
    }

    /// Results of surveys and sweeps, one table each.
    fn responses<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let variables = self.study.model.dim() + self.study.model.output_count();
        self.diagram.responses.iter().map(|set| responses(py, set, variables)).collect()
    }

    /// Maps over parameters by name: a row for each motion or special point of each cell.
    fn maps<'py>(&self, py: Python<'py>) -> PyResult<Vec<(String, Vec<Bound<'py, PyDict>>)>> {
        let rows = |map: &MapPlan| {
            let listed = arrays(map, &self.diagram.cells, &self.study.model).listed();
            let names: Vec<String> = listed.columns.into_iter().map(|column| column.name).collect();
            let row = |row: Vec<Option<CellValue>>| {
                let known = names.iter().zip(row).filter_map(|(name, value)| Some((name.clone(), value?)));
                dictionary(py, &known.collect())
            };
            Ok((map.name.clone(), listed.rows.into_iter().map(row).collect::<PyResult<_>>()?))
        };
        self.study.plan.maps.iter().map(rows).collect()
    }

    /// Answers to design questions, one table each.
    fn designs<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.diagram.designs.iter().map(|design| answer(py, design, &self.study.model)).collect()
    }
}

type SpecialRow = (&'static str, usize, usize, f64, (Vec<f64>, Vec<f64>), Option<&'static str>, String);

fn described<'py>(py: Python<'py>, branch: &Branch) -> PyResult<Bound<'py, PyDict>> {
    let parts = PyDict::new(py);
    parts.set_item("name", &branch.name)?;
    parts.set_item("family", branch.family.name())?;
    parts.set_item("free", branch.free)?;
    parts.set_item("scale", branch.units[1])?;
    parts.set_item("also", branch.also.iter().map(|(index, _)| *index).collect::<Vec<_>>())?;
    parts.set_item("levels", branch.levels.clone())?;
    parts.set_item("held", branch.held.map(|(kind, first)| (kind.name(), first)))?;
    let (word, from, kind, parameter) = match &branch.origin {
        Origin::Seed(name) => ("seed", name, None, None),
        Origin::EndOf(name) => ("end", name, None, None),
        Origin::Switch { parent, kind, parameter } => ("switch", parent, Some(kind.name()), Some(*parameter)),
    };
    parts.set_item("origin", (word, from, kind, parameter))?;
    parts.set_item("points", branch.points.len())?;
    parts.set_item("special", branch.special.len())?;
    let end = |end: &Ending| (end.code(), end.to_string(), end.complete());
    parts.set_item("ends", branch.ends.iter().map(|own| own.as_ref().map(end)).collect::<Vec<_>>())?;
    Ok(parts)
}

fn column<'py>(
    py: Python<'py>,
    points: &[&Point],
    branch: &Branch,
    special: bool,
    name: &str,
) -> PyResult<Bound<'py, PyBytes>> {
    let count = points.len();
    let whole = |of: fn(&Point) -> usize| integers(py, points.iter().map(|p| of(p) as i64));
    let number = |of: fn(&Point) -> f64| numbers(py, points.iter().map(|p| of(p)));
    match name {
        "position" => integers(py, points.iter().map(|p| p.position)),
        "parameters" => {
            let width = points.first().map_or(0, |p| p.parameters.len());
            counted(py, count * width, points.iter().flat_map(|p| p.parameters.iter().copied()))
        }
        "ranges" => {
            let width = points.first().map_or(0, |p| 2 * p.ranges.len());
            counted(py, count * width, points.iter().flat_map(|p| p.ranges.as_flattened().iter().copied()))
        }
        "spectrum" => {
            // Multipliers that could not be computed are NaN.
            let width = points.iter().map(|p| p.spectrum.len()).max().unwrap_or(0);
            let padded = |p: &&Point| parts(&p.spectrum).chain(std::iter::repeat(f64::NAN)).take(2 * width).collect();
            let rows: Vec<Vec<f64>> = points.iter().map(padded).collect();
            counted(py, 2 * count * width, rows.into_iter().flatten())
        }
        "gain" => {
            let width = points.iter().map(|p| p.solution.gain().len()).max().unwrap_or(0);
            let row =
                |p: &&Point| p.solution.gain().iter().copied().chain(std::iter::repeat(0.0)).take(width).collect();
            let rows: Vec<Vec<f64>> = points.iter().map(row).collect();
            counted(py, count * width, rows.into_iter().flatten())
        }
        "period" => number(|p| p.solution.period().unwrap_or(f64::NAN)),
        "step" => number(|p| p.step),
        "unstable" => whole(|p| p.unstable),
        "forcing_periods" => whole(|p| p.solution.forcing_periods() as usize),
        "discretisation" => number(|p| p.trust.discretisation),
        "residual" => number(|p| p.trust.residual),
        "trivial_defect" => number(|p| p.trust.trivial_defect),
        "liouville_defect" => number(|p| p.trust.liouville_defect),
        "spectrum_error" => number(|p| p.trust.spectrum),
        "newton" => whole(|p| p.cost.newton),
        "factorisations" => whole(|p| p.cost.factorisations),
        "rejected" => whole(|p| p.cost.rejected),
        "evaluations" => whole(|p| p.cost.evaluations),
        "linearisations" => whole(|p| p.cost.linearisations),
        "error" if special => numbers(py, branch.special.iter().map(|s| s.error)),
        _ => Err(failure::internal(py, format!("there is no column {name}"))),
    }
}

/// Parts of the answer to a design question.
fn answer<'py>(
    py: Python<'py>,
    design: &diagram::Design,
    model: &foldline::model::Model,
) -> PyResult<Bound<'py, PyDict>> {
    let name = |index: usize| model.parameters.get(index).map_or("?", |own| own.name.as_str());
    let (parts, own) = (PyDict::new(py), design.answer.as_ref());
    let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
    parts.set_item("name", &design.name)?;
    parts.set_item("of", &design.of)?;
    parts.set_item("free", name(design.free))?;
    parts.set_item("vary", name(design.vary))?;
    parts.set_item("range", design.range)?;
    parts.set_item("greatest", design.greatest)?;
    parts.set_item("wanted", &design.wanted)?;
    parts.set_item("value", number(own.map(|own| own.value)))?;
    parts.set_item("error", number(own.map(|own| own.error)))?;
    parts.set_item("at", number(own.map(|own| own.at)))?;
    parts.set_item("binds", own.map(|own| own.binds.name()))?;
    parts.set_item("boundary", own.map(|own| own.kind.name()))?;
    parts.set_item("curve", own.map(|own| own.curve.clone()))?;
    parts.set_item("answered", design.answered())?;
    parts.set_item("reasons", &design.reasons)?;
    parts.set_item("checks", &design.checks)?;
    Ok(parts)
}

/// Columns of a survey or sweep of a model with `variables` states and outputs.
fn responses<'py>(py: Python<'py>, set: &diagram::Responses, variables: usize) -> PyResult<Bound<'py, PyDict>> {
    let (parts, all) = (PyDict::new(py), &set.responses);
    let number = |of: fn(&diagram::Response) -> f64| numbers(py, all.iter().map(of));
    parts.set_item("name", &set.name)?;
    parts.set_item("search", set.search.name())?;
    parts.set_item("free", set.free)?;
    parts.set_item("value", number(|r| r.value)?)?;
    parts.set_item("period", number(|r| r.period.unwrap_or(f64::NAN))?)?;
    parts.set_item("settled_after", number(|r| r.settled_after)?)?;
    parts.set_item("error", number(|r| r.error)?)?;
    let pair = |of: fn(&diagram::Recognition) -> Option<[f64; 2]>, k: usize| {
        numbers(py, all.iter().map(move |r| of(&r.recognition).map_or(f64::NAN, |pair| pair[k])))
    };
    parts.set_item("rotation", pair(|r| r.rotation, 0)?)?;
    parts.set_item("rotation_error", pair(|r| r.rotation, 1)?)?;
    parts.set_item("exponent", pair(|r| r.exponent, 0)?)?;
    parts.set_item("exponent_error", pair(|r| r.exponent, 1)?)?;
    parts.set_item("undecided", all.iter().map(|r| r.recognition.reason.clone()).collect::<Vec<_>>())?;
    parts.set_item("motion", all.iter().map(|r| r.motion.name()).collect::<Vec<_>>())?;
    parts.set_item("ratio", all.iter().map(|r| r.ratio).collect::<Vec<_>>())?;
    parts.set_item("multiplicity", all.iter().map(|r| r.multiplicity).collect::<Vec<_>>())?;
    parts.set_item("hits", all.iter().map(|r| r.hits).collect::<Vec<_>>())?;
    let share = |of: fn(&Share) -> f64| numbers(py, all.iter().map(move |r| r.share.as_ref().map_or(f64::NAN, of)));
    parts.set_item("share", share(Share::value)?)?;
    parts.set_item("share_low", share(|share| share.interval()[0])?)?;
    parts.set_item("share_high", share(|share| share.interval()[1])?)?;
    parts.set_item("jumped", all.iter().map(|r| r.jumped).collect::<Vec<_>>())?;
    let swept = set.search == diagram::Search::Sweep;
    parts.set_item("jumps", if swept { set.jumps() } else { Vec::new() })?;
    let width = all.first().map_or(0, |r| r.parameters.len());
    let parameters = all.iter().flat_map(|r| r.parameters.iter().copied());
    parts.set_item("parameters", counted(py, all.len() * width, parameters)?)?;
    // Motions that escaped have no ranges.
    let row = |r: &diagram::Response| {
        (0..variables).map(|k| r.ranges.get(k).copied().unwrap_or([f64::NAN; 2])).collect::<Vec<_>>()
    };
    let ranges = all.iter().flat_map(row).flatten();
    parts.set_item("ranges", counted(py, 2 * all.len() * variables, ranges)?)?;
    Ok(parts)
}
