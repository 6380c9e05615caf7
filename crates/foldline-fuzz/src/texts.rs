//! Arbitrary texts as files: each is read as a model, a study or AUTO-07p solutions, or rejected with the positions of
//! its mistakes.

use foldline::contract::{Batch, Parameters, VectorField};
use foldline::model::Model;
use foldline_store::auto::{self, Chosen, Mapping, Names, solutions};
use foldline_store::diagnostic::Diagnostic;
use foldline_store::model_file::parse_model;
use foldline_store::study_file::{Study, parse_study};
use std::path::{Path, PathBuf};

/// Asserts that every message is short and refers to a position in its file.
fn sound(found: &[Diagnostic], texts: &[(&str, &str)]) {
    assert!(!found.is_empty() && found.len() <= 101, "{} mistakes", found.len());
    for diagnostic in found {
        let shown = diagnostic.to_string();
        assert!(shown.len() < 8000, "{} bytes: {shown:.300}", shown.len());
        let hidden = |c: char| c.is_control() && c != '\n' && c != '\t';
        assert!(!shown.contains(hidden), "{shown:?}");
        assert!(!diagnostic.message.is_empty() && diagnostic.hint.as_ref().is_some_and(|hint| !hint.is_empty()));
        let (_, text) = texts.iter().find(|(file, _)| *file == diagnostic.file).unwrap_or(&("", ""));
        let line = text.split('\n').nth(diagnostic.line - 1);
        let columns = line.unwrap_or_else(|| panic!("no line {}", diagnostic.line)).chars().count();
        assert!((1..=columns + 1).contains(&diagnostic.column), "{diagnostic:?} in {columns} columns");
    }
}

/// Reads a model text, and evaluates and differentiates the model. Returns false if the text is rejected.
pub fn model(text: &str) -> bool {
    let model = match parse_model(text, "m.toml") {
        Ok(model) => model,
        Err(found) => {
            sound(&found, &[("m.toml", text)]);
            return false;
        }
    };
    let (n, q) = (model.dim(), model.parameter_count());
    if n > 50 || q > 50 {
        return true;
    }
    let states: Vec<f64> = model.ranges().iter().map(|[low, high]| 0.3 * low + 0.7 * high).collect();
    let parameters = model.defaults();
    let free: Vec<usize> = (0..q).collect();
    let at = Batch { lanes: 1, states: &states, parameters: Parameters::Shared(&parameters), times: &[], signs: &[] };
    let (mut f, mut fx, mut fp) = (vec![0.0; n], vec![0.0; n * n], vec![0.0; n * q]);
    model.linearise(at, &free, &mut f, &mut fx, &mut fp);
    let mut outputs = vec![0.0; model.output_count()];
    model.outputs(at, &mut outputs);
    let mut alone = vec![0.0; n];
    model.evaluate(at, &mut alone);
    assert!(f.iter().zip(&alone).all(|(a, b)| a == b || (a.is_nan() && b.is_nan())), "{f:?} {alone:?}");
    true
}

/// Reads a study text with a valid model; `None` if it is rejected.
pub fn study(text: &str, model_text: &str) -> Option<Study> {
    match parse_study(text, "s.toml", model_text, "m.toml") {
        Ok(study) => Some(study),
        Err(found) => {
            sound(&found, &[("s.toml", text), ("m.toml", model_text)]);
            None
        }
    }
}

/// Reads a text as a solution file of AUTO-07p and checks the number of states. Each solution must give a valid study
/// or be rejected with a reason. Returns the number of solutions; `None` if the text is rejected, at a position within
/// it.
pub fn solution_file(text: &str, model: &Model) -> Option<usize> {
    let found = match solutions(text, "s.auto") {
        Ok(found) => found,
        Err(found) => {
            sound(&found, &[("s.auto", text)]);
            return None;
        }
    };
    let names = Names::of(text);
    for solution in &found {
        assert!(!solution.times.is_empty() && solution.states.len() == solution.times.len() * solution.dim());
        let written = Mapping::new(model, &names, &[(1, "p1".to_string())], &[], solution.dim()).and_then(|mapping| {
            auto::study(model, "m.toml", &[Chosen { file: "s.auto", solution, names: &names, mapping }])
        });
        match written {
            Ok(text) => assert!(parse_study(&text, "s.toml", AUTO_MODEL, "m.toml").is_ok(), "{text}"),
            Err(complaint) => assert!(!complaint.message.is_empty() && !complaint.hint.is_empty()),
        }
    }
    Some(found.len())
}

/// Model of the AUTO-07p files among the tests.
pub const AUTO_MODEL: &str = include_str!("../../../models/ab-reaction.toml");

/// Returns the texts of the files in a folder of this repository and its subfolders.
pub fn corpus(folder: &str) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    collect(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(folder), &mut found);
    found.sort();
    found
}

fn collect(folder: &Path, found: &mut Vec<(PathBuf, String)>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, found);
        } else if let Ok(text) = std::fs::read_to_string(&path) {
            found.push((path, text));
        }
    }
}

/// Compiles a text as the right-hand side of an equation. It must be accepted or rejected at a position within it.
pub fn expression(text: &str) {
    use foldline::model::{Definition, Model, ModelSource, Parameter, State};
    let source = ModelSource {
        name: "one equation".into(),
        parameters: vec![Parameter::new("p", 0.5)],
        states: vec![State::new("x")],
        equations: vec![Definition::new("x", text)],
        ..ModelSource::default()
    };
    match Model::compile(source) {
        Ok(model) => {
            let at = Batch { lanes: 1, states: &[0.7], parameters: Parameters::Shared(&[0.5]), times: &[], signs: &[] };
            let (mut f, mut fx, mut fp) = ([0.0], [0.0], [0.0]);
            model.linearise(at, &[0], &mut f, &mut fx, &mut fp);
        }
        Err(errors) => {
            for error in errors {
                let span = error.span.clone().unwrap_or(0..0);
                assert!(text.get(span).is_some(), "{error:?}");
            }
        }
    }
}
