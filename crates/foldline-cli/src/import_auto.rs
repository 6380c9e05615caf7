//! `foldline import-auto`: solutions from AUTO-07p files as a table, or as a study that starts from them.

use crate::arguments::{Format, ImportAuto as Typed};
use crate::failure::{Failure, Outcome};
use crate::table::{Cell, Column, Style, Table, write as write_table};
use crate::verbosity::report;
use foldline_store::auto::{Chosen, Complaint, Labelled, Mapping, Names, read_solutions, study};
use foldline_store::model_file::read_model;
use foldline_store::study_file::parse_study;
use std::io::stdout;
use std::path::{Path, PathBuf};

/// A file of solutions, with the names found in the files beside it.
struct Source {
    path: PathBuf,
    solutions: Vec<Labelled>,
    names: Names,
}

/// Lists the solutions, or writes a study.
pub fn answer(typed: &Typed) -> Result<Outcome, Failure> {
    let sources = sources(&typed.files)?;
    let chosen = chosen(&sources, &typed.label)?;
    match &typed.model {
        Some(model) => written(typed, model, &chosen),
        None => {
            let mut out = stdout().lock();
            write_table(&listed(&chosen), Format::Text, &mut out)?;
            Ok(Outcome::Done)
        }
    }
}

/// Files of solutions, with names from the files given or from those in the same folder.
fn sources(files: &[PathBuf]) -> Result<Vec<Source>, Failure> {
    let (named, solved): (Vec<&PathBuf>, Vec<&PathBuf>) =
        files.iter().partition(|file| begins(file, &["b.", "c.", "fort.7", "fort.2"]));
    if solved.is_empty() {
        return Err(Failure::typed(
            "no solution file was given",
            "give s.NAME or fort.8; b.NAME and c.NAME supply only names",
        ));
    }
    let mut given = Names::default();
    for file in named {
        let text = std::fs::read_to_string(file).map_err(|error| {
            Failure::typed(format!("cannot read {}: {error}", file.display()), "check the spelling of the path")
        })?;
        given = given.or(Names::of(&text));
    }
    let source = |file: &PathBuf| {
        let beside = |prefix: &str| {
            let name = file.file_name()?.to_str()?.strip_prefix("s.")?;
            std::fs::read_to_string(file.with_file_name(format!("{prefix}{name}"))).ok()
        };
        let beside = ["c.", "b."].into_iter().filter_map(beside).map(|text| Names::of(&text));
        let names = beside.fold(given.clone(), Names::or);
        Ok(Source { path: file.clone(), solutions: read_solutions(file)?, names })
    };
    solved.into_iter().map(source).collect()
}

fn begins(file: &Path, prefixes: &[&str]) -> bool {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    prefixes.iter().any(|prefix| name.starts_with(prefix))
}

/// Solutions with these labels; all solutions if there are no labels.
fn chosen<'s>(sources: &'s [Source], labels: &[i64]) -> Result<Vec<(&'s Source, &'s Labelled)>, Failure> {
    let all: Vec<_> = sources.iter().flat_map(|source| source.solutions.iter().map(move |s| (source, s))).collect();
    if let Some(label) = labels.iter().find(|label| all.iter().all(|(_, s)| s.label != **label)) {
        let there: Vec<String> = all.iter().map(|(_, s)| s.label.to_string()).collect();
        let message = format!("--label {label}: there is no solution with this label");
        return Err(Failure::typed(message, format!("one of {}", there.join(", "))));
    }
    Ok(all.into_iter().filter(|(_, s)| labels.is_empty() || labels.contains(&s.label)).collect())
}

/// Table of solutions: label, type, free parameters, period, mesh.
fn listed(chosen: &[(&Source, &Labelled)]) -> Table {
    let column = Column::new;
    let mut free: Vec<(usize, String)> = Vec::new();
    for (source, solution) in chosen {
        // The period has a column of its own.
        for number in solution.free.iter().filter(|number| **number != 11) {
            let name = source.names.parameters.iter().find(|(n, _)| n == number);
            free.push((*number, name.map_or_else(|| format!("PAR({number})"), |(_, name)| name.clone())));
        }
    }
    free.sort();
    free.dedup();
    let mut columns =
        vec![column("file", Style::Word), column("branch", Style::Number), column("label", Style::Number)];
    columns.extend(["type", "kind", "solution"].map(|name| column(name, Style::Word)));
    columns.extend(free.iter().map(|(_, name)| column(name, Style::Number)));
    columns.extend(["period", "states", "NTST", "NCOL"].map(|name| column(name, Style::Number)));
    let count = |n: usize| Cell::Count(n as i64);
    let row = |(source, solution): &(&Source, &Labelled)| {
        let (letters, kind) = solution.named().unwrap_or_default();
        let word = |text: &str| if text.is_empty() { Cell::Empty } else { Cell::Word(text.to_string()) };
        let mut row = vec![
            Cell::Word(source.path.display().to_string()),
            Cell::Count(solution.branch),
            Cell::Count(solution.label),
            word(letters),
            word(kind),
            word(if solution.lasts() { "cycle" } else { "equilibrium" }),
        ];
        let value = |number: usize| solution.parameters.get(number - 1).map_or(Cell::Empty, |v| Cell::Number(*v));
        row.extend(free.iter().map(|(number, _)| value(*number)));
        row.push(solution.period().map_or(Cell::Empty, Cell::Number));
        row.push(count(solution.dim()));
        let mesh = [solution.intervals, solution.degree];
        row.extend(mesh.map(|n| if solution.lasts() { count(n) } else { Cell::Empty }));
        row
    };
    Table { columns, rows: chosen.iter().map(row).collect() }
}

fn written(typed: &Typed, model_path: &Path, chosen: &[(&Source, &Labelled)]) -> Result<Outcome, Failure> {
    let (model, model_text) = read_model(model_path)?;
    let parameters = assignments("parameters", &typed.parameters)?;
    let states = assignments("states", &typed.states)?;
    let files: Vec<String> = chosen.iter().map(|(source, _)| source.path.display().to_string()).collect();
    let mut all = Vec::new();
    for ((source, solution), file) in chosen.iter().zip(&files) {
        let mapping = Mapping::new(&model, &source.names, &parameters, &states, solution.dim())?;
        all.push(Chosen { file, solution, names: &source.names, mapping });
    }
    let output = typed.output.clone().unwrap_or_else(|| PathBuf::from(format!("{}.toml", stem(&files[0]))));
    if output.exists() && typed.output.is_none() {
        let message = format!("{} already exists", output.display());
        return Err(Failure::typed(
            message,
            "give the name of the study with `--output`; an existing file of that \
                                            name is overwritten",
        ));
    }
    let text = study(&model, &named_from(&output, model_path)?, &all)?;
    // Reads the study back: a mistake in it should be reported now, not when it is run.
    parse_study(&text, &output.display().to_string(), &model_text, &model_path.display().to_string())?;
    std::fs::write(&output, text).map_err(|error| {
        Failure::typed(format!("cannot write {}: {error}", output.display()), "choose a file in a writable folder")
    })?;
    let seeds = if all.len() == 1 { "1 seed".into() } else { format!("{} seeds", all.len()) };
    report(format_args!("wrote {} with {seeds}", output.display()))?;
    report(format_args!("next: foldline run {}", output.display()))?;
    Ok(Outcome::Done)
}

fn stem(file: &str) -> String {
    let name = Path::new(file).file_name().unwrap_or_default().to_string_lossy().into_owned();
    name.strip_prefix("s.").unwrap_or(&name).to_string()
}

/// Path of the model as a study at `output` must name it.
fn named_from(output: &Path, model: &Path) -> Result<String, Failure> {
    let beside = output.parent().is_none_or(|folder| folder.as_os_str().is_empty());
    let path = if beside || model.is_absolute() { model.to_path_buf() } else { std::path::absolute(model)? };
    Ok(path.display().to_string())
}

/// Parses assignments such as `1=p1`.
fn assignments(option: &str, typed: &[String]) -> Result<Vec<(usize, String)>, Failure> {
    let one = |text: &String| {
        let (number, name) = text.split_once('=')?;
        Some((number.trim().parse().ok().filter(|n| *n > 0)?, name.trim().to_string()))
    };
    let pairs = typed.iter().map(|text| {
        let cure = format!("give AUTO's number, `=` and the name in the model, as in --{option} 1=mu,2=nu");
        one(text).ok_or_else(|| Failure::typed(format!("--{option} {text}: not a pair NUMBER=NAME"), cure))
    });
    pairs.collect()
}

impl From<Complaint> for Failure {
    fn from(complaint: Complaint) -> Failure {
        Failure::typed(complaint.message, complaint.hint)
    }
}
