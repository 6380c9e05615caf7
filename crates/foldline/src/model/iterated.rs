//! Parts of a model that a map cannot have.

use super::error::{Field, Item, ModelError};
use super::source::ModelSource;
use super::{Model, VectorField};

/// Errors of a map with parts that only differential equations have.
pub(super) fn refused(source: &ModelSource) -> Vec<ModelError> {
    if !source.map {
        return Vec::new();
    }
    let error = |item: Item, name: &str, message: String, hint: &str| ModelError {
        item,
        field: Field::Name,
        name: name.to_string(),
        span: None,
        message,
        hint: hint.to_string(),
    };
    let mut found = Vec::new();
    if source.forcing.is_some() {
        let hint = "remove [forcing]; a map that depends on its step number k is one with further states, such as a \
                    phase that advances by omega";
        found.push(error(Item::Forcing, "", "a map has no forcing".into(), hint));
    }
    if let Some(mass) = source.mass.first() {
        let hint = "remove [mass] and solve for the next states";
        found.push(error(Item::Mass(0), &mass.row, "a map has no mass matrix".into(), hint));
    }
    if let Some(total) = source.totals.first() {
        let hint = "remove [totals] and express one of the states by the others";
        found.push(error(Item::Total(0), &total.name, "totals of a map are not supported".into(), hint));
    }
    if source.whirl.is_some() {
        found.push(error(Item::Whirl, "", "a map has no whirl plane".into(), "remove `whirl`"));
    }
    for (i, state) in source.states.iter().enumerate().filter(|(_, state)| state.name.ends_with('\'')) {
        let base = state.name.trim_end_matches('\'');
        let message = format!("`{base}` has an acceleration, but the states of a map have no rates");
        let hint = format!("give the next value, `{base} = \"…\"` under [map]; an earlier value is a further state");
        found.push(error(Item::State(i), &state.name, message, &hint));
    }
    found
}

/// Error of a map that is not smooth.
pub(super) fn switched(model: &Model) -> Option<ModelError> {
    if !model.iterated() || model.switch_count() == 0 {
        return None;
    }
    let message = format!(
        "the map is not smooth where {} = 0: maps with switching points (abs, max, min, sign, if, comparisons) are not \
         supported",
        model.switch_name(0)
    );
    let hint = "replace the corner by a smooth function, such as sqrt(x^2 + eps^2) for abs(x)".to_string();
    Some(ModelError { item: Item::Equation(0), field: Field::Name, name: String::new(), span: None, message, hint })
}
