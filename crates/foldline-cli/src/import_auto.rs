//! `foldline import-auto`: solutions from AUTO-07p files as a table, or as a study that starts from them; equations and constants
//! as a model and a study.

use crate::arguments::{Format, ImportAuto as Typed};
use crate::failure::{Failure, Outcome};
use crate::table::{Cell, Column, Style, Table, write as write_table};
use crate::verbosity::report;
use foldline_store::auto::{
    Chosen, Complaint, Labelled, Mapping, Names, Text, data_of, program, read_solutions, study,
};
use foldline_store::model_file::{parse_model, read_model};
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
    if let Some(file) = typed.files.iter().find(|file| is_program(file)) {
        return translated(typed, file);
    }
    if typed.output.is_some() && typed.model.is_none() {
        return Err(Failure::typed(
            "--output needs --model, the model with the same equations",
            "give the model, or the equations file",
        ));
    }
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

/// True for an equations file.
fn is_program(file: &Path) -> bool {
    let ending = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    ["f90", "f95", "f", "for", "c"].contains(&ending.as_str()) && !begins(file, &["c.", "b.", "s."])
}

/// Writes the model and the study of an equations file and the constants of a run.
fn translated(typed: &Typed, file: &Path) -> Result<Outcome, Failure> {
    let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let beside = file.with_file_name(format!("c.{name}"));
    let constants = match typed.files.iter().find(|file| begins(file, &["c."])) {
        Some(given) => given.clone(),
        None if beside.exists() => beside,
        None => {
            let message = format!("the constants file {} does not exist", beside.display());
            return Err(Failure::typed(
                message,
                "give the constants of the first run after the equations, such as c.NAME.1",
            ));
        }
    };
    let read = |file: &Path| {
        std::fs::read(file).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).map_err(|error| {
            Failure::typed(format!("cannot read {}: {error}", file.display()), "check the spelling of the path")
        })
    };
    let (text, values) = (read(file)?, read(&constants)?);
    let data = data_of(&values).and_then(|name| read(&constants.with_file_name(name)).ok());
    let output = typed.output.clone().unwrap_or_else(|| PathBuf::from(format!("{name}.toml")));
    let stem = output.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let model = output.with_file_name(format!("{stem}-model.toml"));
    for own in [&output, &model] {
        if own.exists() && typed.output.is_none() {
            let cure = "give the name of the study with `--output`; existing files of that name are overwritten";
            return Err(Failure::typed(format!("{} already exists", own.display()), cure));
        }
    }
    let [shown, named] = [file, &constants].map(|own| own.display().to_string());
    let model_name = model.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let found = program(
        Text { file: &shown, text: &text },
        Text { file: &named, text: &values },
        data.as_deref(),
        [&name, &model_name],
    )?;
    // Reads both back: a mistake in them should be reported now, not when they are run.
    let [own, other] = [&model, &output].map(|path| format!("{} (translated, not written)", path.display()));
    parse_model(&found.model, &own)?;
    parse_study(&found.study, &other, &found.model, &own)?;
    for (path, text) in [(&model, &found.model), (&output, &found.study)] {
        std::fs::write(path, text).map_err(|error| {
            Failure::typed(format!("cannot write {}: {error}", path.display()), "choose a file in a writable folder")
        })?;
    }
    for note in &found.notes {
        report(format_args!("note: {note}"))?;
    }
    report(format_args!("wrote {} and {}", model.display(), output.display()))?;
    report(format_args!("next: compare the model with the equations, then foldline run {}", output.display()))?;
    Ok(Outcome::Done)
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
            word(match (solution.lasts(), solution.problem) {
                (false, _) => "equilibrium",
                (true, Some(4 | 7)) => "profile",
                (true, Some(9)) => "connecting orbit",
                (true, _) => "cycle",
            }),
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
