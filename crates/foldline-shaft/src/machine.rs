//! Rotor with values: matrices for given parameters.
//!
//! **Idea.** Coefficients of bearings, unbalance and gravity may be expressions. These become outputs of a small model
//! with the parameters of the rotor's model, so that expressions, functions and tables have one meaning in both.

use crate::assembly::{Assembly, Of};
use crate::equations::{Assembled, SPEED, sag};
use crate::isotropy::commutes;
use crate::parts::{Centre, Coefficient, Frame};
use foldline::contract::{Batch, Parameters, VectorField};
use foldline::model::{Definition, Model, ModelError, ModelSource, Output, State};
use foldline_general::Mat;
use num_complex::Complex64;

/// Rotor whose coefficients can be evaluated.
#[derive(Clone, Debug)]
pub struct Machine {
    /// Rotor with its matrices.
    pub assembled: Assembled,
    /// Expressions of the coefficients as outputs.
    values: Model,
    texts: Vec<String>,
}

/// Matrices at one speed (equation 1 of [`Assembly`]), in the fixed frame.
#[derive(Clone, Debug)]
pub struct Linear {
    /// Ω in rad/s.
    pub speed: f64,
    /// M.
    pub mass: Mat<f64>,
    /// C + Cᵢ.
    pub damping: Mat<f64>,
    /// Cᵢ.
    pub internal: Mat<f64>,
    /// G.
    pub gyroscopic: Mat<f64>,
    /// K.
    pub stiffness: Mat<f64>,
    /// Number of nodes of the shaft, which have rotations.
    pub nodes: usize,
    /// True if all matrices commute with a rotation, so that forward and backward whirl are circular.
    pub isotropic: bool,
}

/// Unbalance with its values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Index of the first displacement.
    pub first: usize,
    /// Mass times eccentricity and phase, as a complex number.
    pub amount: Complex64,
}

impl Machine {
    /// Prepares a rotor; `source` is the model before the equations of the rotor were added.
    ///
    /// # Errors
    /// Errors of coefficients that depend on states.
    pub fn new(assembled: Assembled, source: &ModelSource) -> Result<Machine, Vec<ModelError>> {
        let rotor = &assembled.rotor;
        let mut list: Vec<&Coefficient> = assembled.assembly.terms.iter().map(|term| &term.coefficient).collect();
        list.extend(rotor.unbalances.iter().flat_map(|own| [&own.amount, &own.phase]));
        list.extend(rotor.contacts.iter().map(|own| &own.clearance));
        list.push(&rotor.gravity);
        let mut texts: Vec<String> = vec![SPEED.to_string()];
        for text in list.into_iter().filter_map(|own| own.text.as_ref()) {
            if !texts.contains(text) {
                texts.push(text.clone());
            }
        }
        let mut small = ModelSource {
            name: source.name.clone(),
            constants: source.constants.clone(),
            functions: source.functions.clone(),
            tables: source.tables.iter().chain(&rotor.tables).cloned().collect(),
            parameters: source.parameters.clone(),
            states: vec![State::new("rotor_state")],
            equations: vec![Definition::new("rotor_state", "0")],
            ..ModelSource::default()
        };
        let mut all = source.definitions.clone();
        all.push(Definition::new(SPEED, &rotor.speed.shown()));
        small.definitions = needed(&texts, &all);
        let bodies: Vec<String> =
            small.definitions.iter().map(|own| own.expression.clone()).chain(texts.clone()).collect();
        small.functions.retain(|own| bodies.iter().any(|text| words(text).any(|word| word == own.name)));
        small.outputs =
            texts.iter().enumerate().map(|(k, text)| Output::new(&format!("rotor_value_{k}"), text)).collect();
        Ok(Machine { values: Model::compile(small)?, assembled, texts })
    }

    /// Index of the parameter that is the speed, and rad/s per unit of it; `None` if the speed is a number or an
    /// expression.
    pub fn speed_parameter(&self) -> Option<(usize, f64)> {
        let speed = &self.assembled.rotor.speed;
        let index = self.values.parameter_index(speed.text.as_ref()?)?;
        Some((index, speed.factor))
    }

    /// Values of the expressions.
    fn evaluated(&self, parameters: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; self.texts.len()];
        let at = Batch { lanes: 1, states: &[0.0], parameters: Parameters::Shared(parameters), times: &[], signs: &[] };
        self.values.outputs(at, &mut values);
        values
    }

    fn value(&self, values: &[f64], own: &Coefficient) -> f64 {
        let of = |text: &String| self.texts.iter().position(|own| own == text).map_or(f64::NAN, |k| values[k]);
        own.factor * own.text.as_ref().map_or(1.0, of)
    }

    /// Matrices for parameters `[k]` in the order of the model.
    pub fn linear(&self, parameters: &[f64]) -> Linear {
        let values = self.evaluated(parameters);
        let Assembly { mass, damping, internal, gyroscopic, stiffness, terms } = &self.assembled.assembly;
        let n = mass.nrows();
        let mut to = Linear {
            speed: values[0],
            mass: mass.clone(),
            damping: Mat::from_fn(n, n, |i, j| damping[(i, j)] + internal[(i, j)]),
            internal: internal.clone(),
            gyroscopic: gyroscopic.clone(),
            stiffness: stiffness.clone(),
            nodes: self.assembled.rotor.nodes,
            isotropic: true,
        };
        for term in terms {
            let value = self.value(&values, &term.coefficient);
            let matrix = if term.of == Of::Stiffness { &mut to.stiffness } else { &mut to.damping };
            matrix[(term.row, term.column)] += value;
        }
        to.isotropic = [&to.mass, &to.damping, &to.gyroscopic, &to.stiffness].into_iter().all(commutes);
        to
    }

    /// Unbalances for parameters `[k]`.
    pub fn loads(&self, parameters: &[f64]) -> Vec<Load> {
        let values = self.evaluated(parameters);
        let rotor = &self.assembled.rotor;
        let load = |own: &crate::parts::Unbalance| Load {
            first: rotor.first(own.at),
            amount: Complex64::from_polar(self.value(&values, &own.amount), self.value(&values, &own.phase)),
        };
        rotor.unbalances.iter().map(load).collect()
    }

    /// Static displacements in the order of the degrees of freedom, in m, under gravity (9.80665 m/s² if the model has
    /// none) in -y, with the stiffness at `parameters`. `None` without supports.
    pub fn sag(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        let values = self.evaluated(parameters);
        let rotor = &self.assembled.rotor;
        let gravity = if rotor.gravity.is_zero() { 9.80665 } else { self.value(&values, &rotor.gravity) };
        let linear = self.linear(parameters);
        sag(&linear.stiffness, &linear.mass, rotor, gravity)
    }

    /// Rings: name, station, clearance and centre in m.
    pub fn rings(&self, parameters: &[f64]) -> Vec<(String, usize, f64, [f64; 2])> {
        let values = self.evaluated(parameters);
        let centre = |own: &Centre| match own {
            Centre::At(at) => [self.value(&values, &at[0]), self.value(&values, &at[1])],
            _ => [0.0; 2],
        };
        let ring = |own: &crate::parts::Contact| {
            (own.name.clone(), own.at, self.value(&values, &own.clearance), centre(&own.centre))
        };
        self.assembled.rotor.contacts.iter().map(ring).collect()
    }

    /// Frame of the equations of motion.
    pub fn frame(&self) -> Frame {
        self.assembled.frame
    }
}

/// Definitions that some texts need, directly or through others.
fn needed(texts: &[String], all: &[Definition]) -> Vec<Definition> {
    let mut kept = vec![false; all.len()];
    let mut wait: Vec<String> = texts.to_vec();
    while let Some(text) = wait.pop() {
        for word in words(&text) {
            if let Some(k) = all.iter().position(|own| own.name == word).filter(|k| !kept[*k]) {
                kept[k] = true;
                wait.push(all[k].expression.clone());
            }
        }
    }
    all.iter().zip(kept).filter(|(_, kept)| *kept).map(|(own, _)| own.clone()).collect()
}

/// Names in an expression.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '\'')).filter(|word| !word.is_empty())
}
