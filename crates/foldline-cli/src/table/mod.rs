//! `foldline table`: the results of a run.

mod columns;
mod designs;
mod format;
mod maps;
mod responses;
mod sensitivity;
mod susceptibility;

pub use sensitivity::found;
pub use susceptibility::add_responses;

use crate::arguments::{Format, Table as Typed, What};
use crate::failure::{Failure, Outcome};
use foldline::contract::VectorField;
use foldline::converted::Conversion;
use foldline::diagram::{Branch, Diagram};
use foldline::explore::plan::{MapPlan, Plan};
use foldline::model::{Model, Spread};
use foldline::special::quantity::{Quantity, append};
use foldline_store::nearest::suggest;
use foldline_store::order::{is_run, leg, ordered};
use foldline_store::run_file::{Part, load_part};
use foldline_store::short;
use foldline_store::study_file::parse_study_of_run;
use std::io::{Write, stderr, stdout};
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
    /// Shown after the name in text; empty if there is none.
    pub unit: String,
}

impl Column {
    pub fn new(name: &str, style: Style) -> Column {
        Column { name: name.to_string(), style, unit: String::new() }
    }

    /// A column of numbers in a unit.
    pub fn in_unit(name: &str, style: Style, unit: &str) -> Column {
        let unit = if matches!(unit, "" | "1" | "-") { "" } else { unit };
        Column { unit: unit.to_string(), ..Column::new(name, style) }
    }

    /// Name and unit.
    pub fn head(&self) -> String {
        if self.unit.is_empty() { self.name.clone() } else { format!("{} [{}]", self.name, self.unit) }
    }
}

/// Style of a column in text.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Left-aligned.
    Word,
    /// Right-aligned, ten significant digits.
    Number,
    /// As `Number`, but left out if every row has the same value.
    Varying,
    /// Right-aligned, four decimals.
    Share,
    /// A small quantity of which only the magnitude matters: 1.2e-9.
    Size,
    /// Left out of text; for programs, not for readers.
    Exact,
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
    let part = match typed.what() {
        What::Points | What::Branches => Part::Numbers,
        What::Special | What::Responses | What::Designs | What::Map | What::Notes => Part::Special,
        What::Sensitivities | What::Uncertainty => return sensitivity::print(typed),
        What::Susceptibility => return susceptibility::print(typed),
    };
    if !typed.force.is_empty() || typed.frequency.is_some() {
        return Err(Failure::typed("--force and --frequency apply to --susceptibility", "add it, or leave them out"));
    }
    if typed.position.is_some() {
        return Err(Failure::typed("--position applies to --sensitivities", "leave it out"));
    }
    if !typed.of.is_empty() {
        return Err(Failure::typed("--of applies to --sensitivities and --uncertainty", "leave it out"));
    }
    let mut run = read(&typed.folder, part)?;
    let record = std::mem::take(&mut run.plan.record);
    let recorded: Vec<Quantity> = record.iter().map(|(_, quantity)| *quantity).collect();
    // The states at the ends of an interval are part of the profiles too.
    let profiled = run.model.conditions() != [0, 0] || recorded.iter().any(|quantity| quantity.needs_profile());
    if matches!(typed.what(), What::Points | What::Special) && profiled {
        run = read(&typed.folder, Part::Everything)?;
    }
    if matches!(typed.what(), What::Points | What::Special) {
        for branch in &mut run.diagram.branches {
            let special = branch.special.iter_mut().map(|special| &mut special.point);
            branch.points.iter_mut().chain(special).for_each(|point| append(point, &recorded, &run.model));
        }
    }
    if typed.map.is_some() && !typed.unit.is_empty() {
        return Err(Failure::typed("--unit: maps are in the units of the model", "leave out --unit"));
    }
    let kept = asked_for(&run.diagram, typed.branch.as_deref())?;
    let conversion = conversion(&run.model, &typed.unit)?;
    let shown = conversion.as_ref().map(|own| own.diagram(run.diagram.clone()));
    let (diagram, model) =
        (shown.as_ref().unwrap_or(&run.diagram), conversion.as_ref().map_or(&run.model, |own| own.model()));
    let table = match typed.what() {
        What::Points => columns::points(diagram, model, &record, &contacts(typed, &run)?, &kept),
        What::Branches => columns::branches(diagram, model, &kept),
        What::Special => columns::special(diagram, model, &record, &kept),
        What::Responses => responses::responses(diagram, model),
        What::Designs => designs::designs(diagram, model),
        What::Map => maps::cells(map_of(&run.plan, typed.map.as_deref().unwrap_or_default())?, diagram, model),
        What::Notes => columns::notes(&run.notes, typed.branch.as_deref()),
        What::Sensitivities | What::Uncertainty => return sensitivity::print(typed),
        What::Susceptibility => return susceptibility::print(typed),
    };
    let mut out = std::io::BufWriter::new(stdout().lock());
    write(&table, typed.format, &mut out)?;
    out.flush()?;
    if typed.what() == What::Branches && typed.branch.is_none() {
        tell_short(&run.diagram, &run.plan, &run.model)?;
    }
    Ok(Outcome::Done)
}

/// The switchings of the cycles of a run, which are read off their profiles.
fn contacts(typed: &Typed, run: &Run) -> Result<columns::Contacts, Failure> {
    if run.model.switch_count() == 0 {
        return Ok(columns::Contacts::default());
    }
    let whole = read(&typed.folder, Part::Everything)?;
    Ok(columns::contacts(&whole.diagram, &whole.model))
}

/// Units given with `--unit NAME=UNIT`; `None` without any.
pub fn conversion(model: &Model, typed: &[String]) -> Result<Option<Conversion>, Failure> {
    let one = |text: &String| match text.split_once('=') {
        Some((name, unit)) if !unit.trim().is_empty() => Ok((name.trim().to_string(), unit.trim().to_string())),
        _ => Err(Failure::typed(
            format!("--unit {text}: `=` and a unit are missing"),
            "write --unit NAME=UNIT, for example --unit Omega=rpm",
        )),
    };
    let wanted = typed.iter().map(one).collect::<Result<Vec<_>, Failure>>()?;
    if wanted.is_empty() {
        return Ok(None);
    }
    let refused = |[message, cure]: [String; 2]| Failure::typed(format!("--unit: {message}"), cure);
    Conversion::new(model, &wanted).map(Some).map_err(refused)
}

/// Reports unreached parts of the study on standard error; returns true if there are none.
pub fn tell_short(diagram: &Diagram, plan: &Plan, model: &Model) -> std::io::Result<bool> {
    let lines = short::lines(diagram, plan, model);
    let mut err = stderr().lock();
    lines.iter().try_for_each(|line| writeln!(err, "incomplete: {}", line.replace('\n', "\n  ")))?;
    Ok(lines.is_empty())
}

/// Writes a table in the given format.
pub fn write(table: &Table, format: Format, out: &mut impl Write) -> std::io::Result<()> {
    match format {
        Format::Text => format::text(table, out),
        Format::Csv => format::csv(table, out),
        Format::Json => format::json(table, out),
    }
}

/// Prints the maps of a run, one line for each.
pub fn print_maps(diagram: &Diagram, plan: &Plan) -> std::io::Result<()> {
    match plan.maps.is_empty() {
        true => Ok(()),
        false => format::text(&maps::summary(diagram, plan), &mut stdout().lock()),
    }
}

/// Prints the special points as text, and a line for each survey and sweep.
pub fn print_special(diagram: &Diagram, model: &Model) -> Result<(), Failure> {
    let mut out = std::io::BufWriter::new(stdout().lock());
    if diagram.responses.is_empty() || !diagram.branches.is_empty() {
        // The runs for design questions are in `foldline table`.
        let shown = |branch: &Branch| !diagram.designs.iter().any(|own| is_run(&branch.name, &own.name));
        let special = columns::special(diagram, model, &[], &shown);
        if special.rows.is_empty() { writeln!(out, "no special points")? } else { format::text(&special, &mut out)? }
    }
    if !diagram.designs.is_empty() {
        format::text(&designs::designs(diagram, model), &mut out)?;
    }
    if !diagram.responses.is_empty() {
        format::text(&responses::summary(diagram, model), &mut out)?;
    }
    Ok(out.flush()?)
}

/// A run, in the order in which it is shown.
pub struct Run {
    pub model: Model,
    pub plan: Plan,
    pub diagram: Diagram,
    /// Subject of each remark, and the remark.
    pub notes: Vec<(String, String)>,
    /// Uncertain parameters, by index.
    pub spreads: Vec<(usize, Spread)>,
    /// True if the study asks for uncertainty in plots.
    pub uncertainty: bool,
}

/// Reads as much of the run in a folder as `part` asks for.
pub fn read(folder: &Path, part: Part) -> Result<Run, Failure> {
    let run = load_part(folder, part)?;
    let study = parse_study_of_run(&run.study_text, &run.study_file, &run.model_text, &run.model_file)?;
    let diagram = ordered(run.diagram, &study.plan);
    let seeds = study.plan.seeds.iter().map(|seed| &seed.name);
    let designs = diagram.designs.iter().map(|own| &own.name);
    let shown: Vec<&String> = seeds.chain(diagram.branches.iter().map(|b| &b.name)).chain(designs).collect();
    let mut notes = run.notes;
    notes.extend(diagram.shortfalls.iter().map(|own| (own.about.clone(), format!("incomplete: {}", own.what))));
    // Remarks on one subject stay in the order in which they were made.
    notes.sort_by_key(|(about, _)| shown.iter().position(|name| of_name(name, about)).unwrap_or(usize::MAX));
    let (spreads, uncertainty) = (study.spreads, study.uncertainty);
    Ok(Run { model: study.model, plan: study.plan, diagram, notes, spreads, uncertainty })
}

/// Returns the map of that name.
pub fn map_of<'p>(plan: &'p Plan, name: &str) -> Result<&'p MapPlan, Failure> {
    plan.maps.iter().find(|own| own.name == name).ok_or_else(|| {
        let names: Vec<&str> = plan.maps.iter().map(|own| own.name.as_str()).collect();
        let cure = match names.is_empty() {
            true => "the study has no `[[map]]`".to_string(),
            false => suggest(name, &names),
        };
        Failure::typed(format!("--map: the run has no map \"{name}\""), cure)
    })
}

/// Selects the branches meant by a name given on the command line; all of them without a name.
pub fn asked_for<'n>(diagram: &Diagram, name: Option<&'n str>) -> Result<impl Fn(&Branch) -> bool + use<'n>, Failure> {
    let kept = move |branch: &Branch| name.is_none_or(|name| of_name(&branch.name, name));
    if let Some(name) = name.filter(|_| !diagram.branches.iter().any(kept)) {
        let names: Vec<&str> = diagram.branches.iter().map(|b| b.name.as_str()).collect();
        return Err(Failure::typed(format!("--branch: the run has no branch \"{name}\""), suggest(name, &names)));
    }
    Ok(kept)
}

/// True if a branch has that name, or is a run of the homotopy of that name.
fn of_name(branch: &str, name: &str) -> bool {
    branch == name || leg(branch, name).is_some()
}
