//! Which of AUTO's numbers is which of the model's names.

use super::Names;
use crate::nearest::suggest;
use foldline::contract::VectorField;
use foldline::model::Model;

/// Something that does not fit, and what would.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Complaint {
    /// What does not fit.
    pub message: String,
    /// What would.
    pub hint: String,
}

pub(super) fn complaint(message: impl Into<String>, hint: impl Into<String>) -> Complaint {
    Complaint { message: message.into(), hint: hint.into() }
}

/// Which of AUTO's states and parameters is which of the model's.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Mapping {
    /// For each parameter of the model its number in AUTO, from 1; `None` for one that keeps its value.
    pub parameters: Vec<Option<usize>>,
    /// For each state of the model its number in AUTO, from 1.
    pub states: Vec<usize>,
}

impl Mapping {
    /// By the names of the files, except where `parameters` and `states` give the number of a name of the model. States without
    /// names come in their order.
    ///
    /// # Errors
    /// If a name is not one of the model, or if there is no telling.
    pub fn new(
        model: &Model,
        names: &Names,
        parameters: &[(usize, String)],
        states: &[(usize, String)],
        dim: usize,
    ) -> Result<Mapping, Complaint> {
        if dim != model.dim() {
            let (own, theirs) = (counted(model.dim()), counted(dim));
            let message = format!("the model {} has {own}, but the solution has {theirs}", model.name);
            return Err(complaint(
                message,
                "give a model with the same states; forcing that AUTO generates with two extra states is not the \
                 same as forcing in the model",
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
            None if typed.iter().chain(&named).all(Option::is_none) => (1..=dim).collect(),
            None => {
                let lacking: Vec<&str> =
                    (0..known.len()).filter(|i| typed[*i].or(named[*i]).is_none()).map(|i| known[i]).collect();
                let message = format!("the number of {} among AUTO's states is unknown", lacking.join(", "));
                return Err(complaint(message, format!("give it, as in `--states 1={}`", known[0])));
            }
        };
        if (1..=dim).any(|number| !states.contains(&number)) {
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

/// For each known name its number.
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
