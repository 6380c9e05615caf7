//! `foldline exact`: the exact law of a smoothed one, and what the smoothing changes.

use crate::arguments::{Exact as Typed, Format};
use crate::failure::{Failure, Outcome};
use crate::run::{completed, processors};
use crate::table::{self, Cell, Column, Style, Table};
use foldline::diagram::{Diagram, SpecialPoint};
use foldline::model::Model;
use foldline::smoothing::{Change, changes};
use foldline_store::order::ordered;
use foldline_store::run_file::{Part, load_part};
use foldline_store::study_file::{Study, Unsharpened, parse_study_of_run};
use std::io::{Write, stdout};
use std::path::{Path, PathBuf};

/// Runs the study of a run with the exact law and at another sharpness, and prints the changes of all special points.
pub fn compare(typed: &Typed) -> Result<Outcome, Failure> {
    let jobs = typed.jobs.map_or_else(processors, usize::from);
    let (study, smooth) = recorded(&typed.folder)?;
    let exact_study = study.of_exact_law()?;
    let out = typed.out.clone().unwrap_or_else(|| beside(&typed.folder, "exact"));
    let (sharper_study, sharper, sharper_outcome) = match &typed.beside {
        Some(folder) => {
            let (study, diagram) = recorded(folder)?;
            (study, diagram, Outcome::Done)
        }
        None => {
            let study = study.sharpened().map_err(unsharpened)?;
            let (diagram, outcome) = completed(&study, &beside(&typed.folder, "sharper"), jobs)?;
            (study, diagram, outcome)
        }
    };
    let (exact, outcome) = completed(&exact_study, &out, jobs)?;
    let mut both = [(&study, &smooth), (&sharper_study, &sharper)].map(|(study, run)| (sharpness(study), study, run));
    both.sort_by(|a, b| a.0.total_cmp(&b.0));
    let values = both.map(|own| own.0);
    if !(values[0] > 0.0 && values[1] > values[0]) {
        let cure = "give a run of the same study at another value of the parameter that `smoothing` names";
        return Err(Failure::typed("both runs have the same sharpness, or it is not positive", cure));
    }
    let found = changes(&exact, both.map(|own| own.2), values);
    let table = listed(&found, values, both.map(|own| stated_value(own.1)), &exact_study.model);
    let mut to = std::io::BufWriter::new(stdout().lock());
    if typed.format == Format::Text && table.rows.is_empty() {
        writeln!(to, "no special points")?;
    } else {
        table::write(&table, typed.format, &mut to)?;
    }
    to.flush()?;
    Ok(if [outcome, sharper_outcome].contains(&Outcome::Short) { Outcome::Short } else { Outcome::Done })
}

/// The study and the diagram of a run.
fn recorded(folder: &Path) -> Result<(Study, Diagram), Failure> {
    let run = load_part(folder, Part::Special)?;
    let study = parse_study_of_run(&run.study_text, &run.study_file, &run.model_text, &run.model_file)?;
    let diagram = ordered(run.diagram, &study.plan);
    Ok((study, diagram))
}

fn beside(folder: &Path, what: &str) -> PathBuf {
    let mut name = folder.file_name().unwrap_or_default().to_os_string();
    name.push(format!("-{what}"));
    folder.with_file_name(name)
}

/// Name and value of the parameter that makes the law of a study sharp.
fn stated_value(study: &Study) -> (String, f64) {
    let Some((index, _)) = study.model.sharpness else { return (String::new(), f64::NAN) };
    (study.model.parameters[index].name.clone(), study.parameters[index])
}

/// Sharpness of the law of a study: the value of its parameter, or its inverse if the parameter goes to zero.
fn sharpness(study: &Study) -> f64 {
    let (_, value) = stated_value(study);
    if study.model.sharpness.is_some_and(|(_, to_zero)| to_zero) { 1.0 / value } else { value }
}

fn unsharpened(why: Unsharpened) -> Failure {
    match why {
        Unsharpened::Elsewhere(why) => {
            Failure::typed(why, "run the study at another value yourself, and name that run with --beside DIR")
        }
        Unsharpened::Mistakes(found) => found.into(),
    }
}

/// Table with one row per special point: branch, kind, parameter, its value with the exact law, the differences at both
/// sharpnesses, and the order with its error.
fn listed(found: &[Change], sharpness: [f64; 2], stated: [(String, f64); 2], model: &Model) -> Table {
    let difference = |(name, value): &(String, f64)| Column::new(&format!("{name} = {value}"), Style::Size);
    let columns = vec![
        Column::new("branch", Style::Word),
        Column::new("kind", Style::Word),
        Column::new("parameter", Style::Word),
        Column::new("exact", Style::Number),
        difference(&stated[0]),
        difference(&stated[1]),
        Column::new("order", Style::Share),
        Column::new("order_error", Style::Exact),
        Column::new("remark", Style::Word),
    ];
    let row = |change: &Change| {
        let value = |special: &SpecialPoint| special.point.parameters[change.free];
        let [one, two] = change.smooth;
        let number = |value: Option<f64>| value.map_or(Cell::Empty, Cell::Number);
        let remark = match (change.exact, one, two) {
            (Some(_), Some(_), Some(_)) => String::new(),
            (Some(_), ..) => "not with the smoothed law".into(),
            (None, one, two) => {
                let at = |special: Option<&SpecialPoint>, k: usize| {
                    special.map(|own| format!("{:.10} at {} = {}", value(own), stated[k].0, stated[k].1))
                };
                let each: Vec<String> = [at(one, 0), at(two, 1)].into_iter().flatten().collect();
                format!("with the smoothed law only: {}", each.join(", "))
            }
        };
        let order = change.order(sharpness);
        vec![
            Cell::Word(change.branch.clone()),
            Cell::Word(change.exact.or(one).or(two).map_or(String::new(), |own| own.kind.name().to_string())),
            Cell::Word(model.parameters[change.free].name.clone()),
            number(change.exact.map(value)),
            number(change.difference(0).map(|own| own.0)),
            number(change.difference(1).map(|own| own.0)),
            number(order.map(|own| own.0)),
            number(order.map(|own| own.1)),
            Cell::Word(remark),
        ]
    };
    Table { columns, rows: found.iter().map(row).collect() }
}
