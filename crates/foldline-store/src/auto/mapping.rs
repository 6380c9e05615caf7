//! Assignment of AUTO's state and parameter numbers to the names of the model.

use super::Names;
use crate::nearest::suggest;
use foldline::contract::VectorField;
use foldline::model::Model;

/// Mismatch between an AUTO solution and the model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Complaint {
    /// The mismatch.
    pub message: String,
    /// Suggested correction.
    pub hint: String,
}

pub(super) fn complaint(message: impl Into<String>, hint: impl Into<String>) -> Complaint {
    Complaint { message: message.into(), hint: hint.into() }
}

/// AUTO's numbers of the states and parameters of a model.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Mapping {
    /// AUTO's number of each model parameter, from 1; `None` for a parameter that keeps its default.
    pub parameters: Vec<Option<usize>>,
    /// AUTO's number of each model state, from 1.
    pub states: Vec<usize>,
}

impl Mapping {
    /// Assigns numbers by the names in AUTO's files. `parameters` and `states` take precedence; they pair a number with
    /// a name of the model. If no state is named, states are assigned in their order.
    ///
    /// # Errors
    /// If `dim` differs from the dimension of the model, if the model lacks a given name, or if the states are not matched
    /// one to one.
    pub fn new(
        model: &Model,
        names: &Names,
        parameters: &[(usize, String)],
        states: &[(usize, String)],
        dim: usize,
    ) -> Result<Mapping, Complaint> {
        // AUTO adds an oscillator of two states to a forced system.
        let forced = model.forced() && model.conditions() == [0, 0] && dim == model.dim() + 2;
        if dim != model.dim() && !forced {
            let (own, theirs) = (counted(model.dim()), counted(dim));
            let message = format!("the model {} has {own}, but the solution has {theirs}", model.name);
            return Err(complaint(
                message,
                "give a model with the same states; for a forced model, the solution may have two states more, of the oscillator that \
                 forces it",
            ));
        }
        let known: Vec<&str> = model.parameters.iter().map(|p| p.name.as_str()).collect();
        let typed = numbered(&known, parameters, "parameters")?;
        let named = |k: usize| names.parameters.iter().find(|(_, name)| name == known[k]).map(|(number, _)| *number);
        let parameters = (0..known.len()).map(|k| typed[k].or_else(|| named(k))).collect();
        let known: Vec<&str> = model.states.iter().map(|s| s.name.as_str()).collect();
        let typed = numbered(&known, states, "states")?;
        let named: Vec<Option<usize>> = known
            .iter()
            .map(|own| names.states.iter().find(|(_, name)| name == own).map(|(number, _)| *number))
            .collect();
        let found: Option<Vec<usize>> = (0..known.len()).map(|i| typed[i].or(named[i])).collect();
        let states = match found {
            Some(found) => found,
            None if typed.iter().chain(&named).all(Option::is_none) => (1..=model.dim()).collect(),
            None => {
                let lacking: Vec<&str> =
                    (0..known.len()).filter(|i| typed[*i].or(named[*i]).is_none()).map(|i| known[i]).collect();
                let message = format!("the number of {} among AUTO's states is unknown", lacking.join(", "));
                return Err(complaint(message, format!("give it, as in `--states 1={}`", known[0])));
            }
        };
        let twice =
            states.iter().enumerate().any(|(i, number)| *number == 0 || *number > dim || states[..i].contains(number));
        if twice {
            let message = format!(
                "`--states` does not match each of AUTO's states, 1 to {dim}, to a state of the \
                                   model"
            );
            return Err(complaint(
                message,
                format!("give a different number for each state, as in `--states 1={}`", known[0]),
            ));
        }
        Ok(Mapping { parameters, states })
    }
}

fn counted(states: usize) -> String {
    if states == 1 { "1 state".into() } else { format!("{states} states") }
}

/// Returns for each known name the number given to it.
fn numbered(known: &[&str], typed: &[(usize, String)], option: &str) -> Result<Vec<Option<usize>>, Complaint> {
    let mut out = vec![None; known.len()];
    for (number, name) in typed {
        match known.iter().position(|known| known == name) {
            Some(index) => out[index] = Some(*number),
            None => return Err(complaint(format!("--{option}: the model has no \"{name}\""), suggest(name, known))),
        }
    }
    Ok(out)
}
