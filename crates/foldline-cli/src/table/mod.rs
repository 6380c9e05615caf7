//! `foldline table`: what a run has found.

mod columns;
mod format;
mod responses;

use crate::arguments::{Format, Table as Typed};
use crate::failure::{Failure, Outcome};
use crate::order::ordered;
use foldline::diagram::Diagram;
use foldline::model::Model;
use foldline_store::nearest::suggest;
use foldline_store::run_file::load;
use foldline_store::study_file::parse_study;
use std::io::{Write, stdout};
use std::path::Path;

/// A rectangle of cells under named columns.
pub struct Table {
    pub columns: Vec<Column>,
    pub rows: Vec<Vec<Cell>>,
}

/// A column.
pub struct Column {
    pub name: String,
    pub style: Style,
}

/// How a column is shown as text.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Left-aligned.
    Word,
    /// Right-aligned, ten significant digits.
    Number,
    /// As `Number`, but left out where every row has the same.
    Varying,
    /// A small quantity of which only the size matters: 1.2e-9.
    Size,
}

/// A cell.
pub enum Cell {
    Word(String),
    Count(i64),
    Number(f64),
    Spectrum(Vec<num_complex::Complex64>),
    Empty,
}

/// Prints a table of a run to standard output.
pub fn print(typed: &Typed) -> Result<Outcome, Failure> {
    let (model, mut diagram) = read(&typed.folder)?;
    if let Some(name) = &typed.branch {
        only(&mut diagram, name)?;
    }
    let table = match (typed.points, typed.branches, typed.responses) {
        (true, ..) => columns::points(&diagram, &model),
        (_, true, _) => columns::branches(&diagram, &model),
        (.., true) => responses::responses(&diagram, &model),
        _ => columns::special(&diagram, &model),
    };
    let mut out = std::io::BufWriter::new(stdout().lock());
    match typed.format {
        Format::Text => format::text(&table, &mut out)?,
        Format::Csv => format::csv(&table, &mut out)?,
        Format::Json => format::json(&table, &mut out)?,
    }
    out.flush()?;
    Ok(Outcome::Done)
}

/// Prints the special points as text, and a line for what each survey and sweep saw.
pub fn print_special(diagram: &Diagram, model: &Model) -> Result<(), Failure> {
    let mut out = std::io::BufWriter::new(stdout().lock());
    if diagram.responses.is_empty() || !diagram.branches.is_empty() {
        format::text(&columns::special(diagram, model), &mut out)?;
    }
    if !diagram.responses.is_empty() {
        format::text(&responses::summary(diagram, model), &mut out)?;
    }
    Ok(out.flush()?)
}

/// The model and the diagram of the run in a folder.
pub fn read(folder: &Path) -> Result<(Model, Diagram), Failure> {
    let run = load(folder)?;
    let study = parse_study(&run.study_text, &run.study_file, &run.model_text, &run.model_file)?;
    let names: Vec<&str> = study.plan.branches.iter().map(|b| b.name.as_str()).collect();
    Ok((study.model, ordered(run.diagram, &names)))
}

fn only(diagram: &mut Diagram, name: &str) -> Result<(), Failure> {
    if diagram.branch(name).is_none() {
        let names: Vec<&str> = diagram.branches.iter().map(|b| b.name.as_str()).collect();
        return Err(Failure::typed(format!("--branch: the run has no branch \"{name}\""), suggest(name, &names)));
    }
    diagram.branches.retain(|branch| branch.name == name);
    Ok(())
}
