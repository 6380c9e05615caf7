//! Equations files of AUTO-07p, in Fortran or C, and constants files as a model and a study.
//!
//! **Idea.** The subroutines are read ([`fortran`], [`clike`]), executed with symbols ([`steps`]), and what they assign is written
//! in the language of models ([`translation`], [`study`]).
//!
//! **Departures.** A number that Fortran reads in single precision, such as 0.1 without an exponent, keeps its decimal value; a note
//! says so, since AUTO rounds it to 7 digits.
//!
//! **Fails when** a construct has no counterpart: it is refused with its line, and nothing is written.

mod clike;
mod constants;
mod fortran;
mod steps;
mod study;
mod syntax;
mod translation;
mod values;

use crate::diagnostic::Diagnostic;
use crate::toml_walk::diagnose;
use constants::{Constant, Constants};
use syntax::Stop;

pub use translation::Program;

/// A file that is read.
#[derive(Clone, Copy, Debug)]
pub struct Text<'t> {
    /// Its name in messages.
    pub file: &'t str,
    /// Its text.
    pub text: &'t str,
}

/// Name of the file of data with which the run begins, if the constants name one.
pub fn data_of(constants: &str) -> Option<String> {
    match Constants::of(constants).get("dat") {
        Some(Constant::Text(name)) => Some(format!("{name}.dat")),
        _ => None,
    }
}

/// Translates an equations file and a constants file to a model and a study that names the model as `model_file`.
///
/// # Errors
/// The first construct that has no counterpart, with its line and a cure.
pub fn program(
    equations: Text,
    constants: Text,
    data: Option<&str>,
    [title, model_file]: [&str; 2],
) -> Result<Program, Vec<Diagnostic>> {
    let ending = equations.file.rsplit('.').next().unwrap_or("").to_lowercase();
    let c = ending == "c";
    let read = match c {
        true => clike::routines(equations.text),
        false => fortran::routines(equations.text, ending == "f" || ending == "for"),
    };
    let own = Constants::of(constants.text);
    let translated = read.and_then(|all| translation::translated(&all, c, &own, data, [title, model_file]));
    let mut program = translated.map_err(|stop| vec![placed(&stop, equations, constants)])?;
    if !c && let Some((line, count)) = fortran::rounded(equations.text) {
        program.notes.push(format!(
            "line {line}: {count} numbers have no exponent D, so AUTO rounds them to 7 digits; the model has their decimal values, and \
             results differ accordingly"
        ));
    }
    Ok(program)
}

/// A refusal with its place: a line of the equations, or the constant that the message names first.
fn placed(stop: &Stop, equations: Text, constants: Text) -> Diagnostic {
    let key: String = stop.message.chars().take_while(|c| c.is_ascii_alphanumeric()).collect();
    let (own, line) = match stop.line {
        0 => (constants, constants.text.lines().position(|line| line.contains(&format!("{key} "))).unwrap_or(0)),
        line => (equations, line - 1),
    };
    let before: usize = own.text.split_inclusive('\n').take(line).map(str::len).sum();
    let text = own.text.split_inclusive('\n').nth(line).unwrap_or("");
    let from = before + (text.len() - text.trim_start().len());
    let span = from..(before + text.trim_end().len()).max(from);
    diagnose(own.file, own.text, span, stop.message.clone(), stop.hint.clone())
}
