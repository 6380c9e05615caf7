//! Derivatives of special points and solutions, and their uncertainty.

use crate::diagram::Diagram;
use crate::failure;
use foldline::explore::System;
use foldline::model::{Model, Spread};
use foldline::sensitivity::{Sensitivities, of_point, of_special, uncertainty};
use pyo3::prelude::*;
use std::collections::HashMap;

/// Name and unit of a number, its value, and for every parameter its name, derivative with error, and the reason if there
/// is none.
pub type Row = (String, String, f64, Vec<(String, Option<(f64, f64)>, String)>);

/// Name of a number, its value, mean and standard deviation to first order, and mean, standard deviation and 95 % range of
/// the samples.
pub type Band = (String, f64, Option<[f64; 2]>, Option<[f64; 2]>, Option<[f64; 2]>);

/// Bands of all numbers, and the reasons why samples failed, with their number.
pub type Distributions = (Vec<Band>, Vec<(String, usize)>);

impl Diagram {
    /// Derivatives at a special point, or at a point, of a branch.
    pub fn derivatives(&self, py: Python, branch: usize, special: bool, index: usize) -> PyResult<Vec<Row>> {
        self.of_the_model(py)?;
        let own = self.branch(py, branch)?;
        let (model, plan) = (&self.study.model, &self.study.plan);
        let found = py.detach(|| {
            let system = System::of_plan(model, plan).in_units_of(&self.diagram);
            match special {
                true => own.special.get(index).map(|special| of_special(&system, own, special, plan)),
                false => own.points.get(index).map(|point| of_point(&system, own, point, plan)),
            }
        });
        let found = found.ok_or_else(|| failure::internal(py, format!("there is no point {index}")))?;
        let refused = |why| failure::of_argument(py, format!("no sensitivities: {why}"), "choose another point");
        Ok(rows(&found.map_err(refused)?, model, own.free))
    }

    /// Distributions of the numbers at a special point. `spreads` replaces those of the study: a standard deviation, or a
    /// range, for each parameter. Also returns the reasons why samples failed, with their number.
    pub fn distributions(
        &self,
        py: Python,
        branch: usize,
        index: usize,
        spreads: HashMap<String, (f64, Option<f64>)>,
        samples: usize,
    ) -> PyResult<Distributions> {
        self.of_the_model(py)?;
        let own = self.branch(py, branch)?;
        let (model, plan) = (&self.study.model, &self.study.plan);
        let mut all: HashMap<usize, Spread> = self.study.spreads.iter().copied().collect();
        for (name, (first, second)) in spreads {
            let index = model.parameter_index(&name);
            let index = index.ok_or_else(|| failure::internal(py, format!("there is no parameter {name}")))?;
            all.insert(index, second.map_or(Spread::Normal(first), |high| Spread::Uniform([first, high])));
        }
        let mut all: Vec<(usize, Spread)> = all.into_iter().collect();
        all.sort_by_key(|(index, _)| *index);
        let special = own.special.get(index);
        let special = special.ok_or_else(|| failure::internal(py, format!("there is no special point {index}")))?;
        let found = py.detach(|| {
            let system = System::of_plan(model, plan).in_units_of(&self.diagram);
            uncertainty(&system, own, special, plan, &all, samples)
        });
        let refused = |why| failure::of_argument(py, format!("no uncertainty: {why}"), "choose another point");
        let found = found.map_err(refused)?;
        let band = |band: foldline::sensitivity::Band| {
            (band.of.name(model, own.free), band.value, band.first_order.ok(), band.sampled, band.range)
        };
        Ok((found.bands.into_iter().map(band).collect(), found.failed))
    }
}

impl Diagram {
    /// Refuses a diagram in other units than those of the equations.
    fn of_the_model(&self, py: Python) -> PyResult<()> {
        match self.converted {
            true => Err(failure::of_argument(
                py,
                "derivatives are in the units of the model, and this diagram is shown in others",
                "take the point from the original diagram",
            )),
            false => Ok(()),
        }
    }
}

fn rows(found: &Sensitivities, model: &Model, free: usize) -> Vec<Row> {
    let each = found.rows.iter().map(|row| {
        let by = found.parameters.iter().zip(&row.by).map(|(index, derivative)| {
            let pair = derivative.as_ref().ok().map(|own| (own.value, own.error));
            let reason = derivative.as_ref().err().cloned().unwrap_or_default();
            (model.parameters[*index].name.clone(), pair, reason)
        });
        (row.of.name(model, free), row.of.unit(model, free), row.value, by.collect())
    });
    each.collect()
}
