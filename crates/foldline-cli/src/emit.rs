//! `foldline emit`: the ensemble of a model as source text.

use crate::arguments::Emit as Typed;
use crate::failure::{Failure, Outcome};
use crate::values::with_one_forcing;
use foldline::emitted::{Emitted, HOST, Parts};
use foldline_store::model_file::read_model;
use std::io::{Write, stdout};

/// Writes the source.
pub fn write(typed: &Typed) -> Result<Outcome, Failure> {
    let (model, _) = read_model(&typed.model)?;
    with_one_forcing(&model)?;
    let parts = Parts { own_parameters: typed.own_parameters, settle: typed.settle, section: typed.section };
    let emitted = Emitted::new(&model, parts).map_err(|refused| {
        let cure = "maps need no integrator; `foldline run` iterates them";
        Failure::typed(format!("{}: {refused}", typed.model.display()), cure)
    })?;
    let program = if typed.c { HOST } else { "" };
    match &typed.output {
        None => write!(stdout().lock(), "{}{program}", emitted.source)?,
        Some(file) => std::fs::write(file, format!("{}{program}", emitted.source))
            .map_err(|error| Failure::Outside(format!("cannot write {}: {error}", file.display())))?,
    }
    Ok(Outcome::Done)
}
