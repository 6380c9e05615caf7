//! A second forcing.
//!
//! **Idea.** The period of the second forcing depends on parameters only. It is compiled as that of a field of its own with
//! the same parameters and definitions.

use super::{Model, ModelError, ModelSource};

/// The phase of the second forcing, by index, and a field with its period.
pub(super) fn second(source: &ModelSource) -> Result<Option<(usize, Model)>, Vec<ModelError>> {
    let Some((forcing, phase)) = &source.second else { return Ok(None) };
    let Some(index) = source.parameters.iter().position(|own| own.name == *phase) else { return Ok(None) };
    let equations = source.equations.iter().map(|own| super::Definition { expression: "0".into(), ..own.clone() });
    let alone = ModelSource {
        forcing: Some(forcing.clone()),
        second: None,
        equations: equations.collect(),
        outputs: Vec::new(),
        events: Vec::new(),
        mass: Vec::new(),
        ..source.clone()
    };
    Ok(Some((index, Model::compile(alone)?)))
}
