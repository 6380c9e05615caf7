//! Mistakes as exceptions of the package, with the messages of the command line.
//!
//! The exceptions are classes of `foldline._errors`.

use foldline_store::diagnostic::Diagnostic;
use foldline_store::run_file::RunFileError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::fmt::Display;

fn raised(py: Python, class: &str, message: String) -> PyErr {
    let made = py.import("foldline._errors").and_then(|errors| errors.getattr(class)?.call1((message,)));
    made.map_or_else(|error| error, PyErr::from_value)
}

/// Exception for mistakes in a text: a model or a study.
pub fn of_text(py: Python, found: &[Diagnostic]) -> PyErr {
    let texts: Vec<String> = found.iter().map(|d| d.to_string().trim_end().to_string()).collect();
    let error = raised(py, "InputError", texts.join("\n\n"));
    let list: PyResult<Vec<Bound<PyDict>>> = found.iter().map(|d| described(py, d)).collect();
    // The message is complete; the parts are for programs that display mistakes in their own way.
    let _ = list.and_then(|list| error.value(py).setattr("diagnostics", list));
    error
}

fn described<'py>(py: Python<'py>, found: &Diagnostic) -> PyResult<Bound<'py, PyDict>> {
    let parts = PyDict::new(py);
    parts.set_item("file", &found.file)?;
    parts.set_item("line", found.line)?;
    parts.set_item("column", found.column)?;
    parts.set_item("message", &found.message)?;
    parts.set_item("hint", &found.hint)?;
    Ok(parts)
}

/// Exception for a mistake in an argument, with its remedy.
pub fn of_argument(py: Python, message: impl Display, cure: impl Display) -> PyErr {
    raised(py, "InputError", format!("{message}\n  help: {cure}"))
}

/// Exception if there is no solution to start from.
pub fn no_solution(py: Python, why: String) -> PyErr {
    raised(py, "NoSolution", why)
}

/// Exception for a run file that cannot be made, read or continued.
pub fn of_run_file(py: Python, error: &RunFileError) -> PyErr {
    // `--out DIR` and `--resume` of the command are arguments here.
    let message =
        error.to_string().replace("`--resume`", "`resume=True`").replace("--resume --out DIR", "resume=True, out=DIR");
    raised(py, "RunFileError", message.replace("`--out DIR`", "`out=DIR`"))
}

/// Exception for a mistake in the program itself.
pub fn internal(py: Python, what: String) -> PyErr {
    raised(py, "Error", format!("internal error in foldline: {what}"))
}
