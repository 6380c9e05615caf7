//! Export of a run to CSV, Parquet and NetCDF.
//!
//! **Idea.** All formats share the names, units and descriptions in `columns`. The points of a branch are read one at a
//! time ([`Reading::each_point`]), so the length of a run is not limited by memory. CSV and Parquet have one file per
//! table (`tables`). NetCDF has one group per branch (`netcdf`), in a file whose layout is fixed before any number is
//! written ([`hdf5`]). The formats are described in docs/book/exports.md.
//!
//! **Departures.** A file is written under a temporary name and renamed when it is complete.

mod cells;
mod columns;
mod csv;
mod groups;
pub mod hdf5;
mod maps;
mod netcdf;
mod parquet;
mod tables;

use crate::diagnostic::Diagnostic;
use crate::order::ordered;
use crate::run_file::{Part, Reading, RunFileError};
use crate::study_file::{Study, parse_study_of_run};
use foldline::contract::VectorField;
use foldline::converted::Conversion;
use foldline::diagram::{Branch, Diagram, Point};
use foldline::model::Model;
use foldline::sensitivity::listed::Entry;
use foldline::special::quantity::{Quantity, append};
use std::fmt;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Format of the export.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Folder of files with comma-separated values.
    Csv,
    /// Folder of Parquet files.
    Parquet,
    /// One NetCDF-4 file.
    NetCdf,
}

/// Reason why a run could not be exported.
#[derive(Debug)]
pub enum ExportError {
    /// The run could not be read.
    Run(RunFileError),
    /// The study or the model stored in the run is invalid.
    Study(Vec<Diagnostic>),
    /// The file or folder cannot be written.
    Output(PathBuf, std::io::Error),
}

impl From<RunFileError> for ExportError {
    fn from(error: RunFileError) -> ExportError {
        ExportError::Run(error)
    }
}

impl fmt::Display for ExportError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            ExportError::Run(error) => write!(f, "{error}"),
            ExportError::Study(found) => {
                found.iter().enumerate().try_for_each(|(k, d)| write!(f, "{}{d}", if k > 0 { "\n\n" } else { "" }))
            }
            ExportError::Output(path, error) => write!(
                f,
                "{} cannot be written: {error}\n  help: free some space there, or write elsewhere with `--out PATH`",
                path.display()
            ),
        }
    }
}

impl std::error::Error for ExportError {}

/// Run to be exported.
pub struct Export {
    reading: Reading,
    study: Study,
    conversion: Option<Conversion>,
    /// Exported branches in the order in which they are listed, with their special points and ends but without points.
    pub diagram: Diagram,
    /// True if the profiles of cycles are exported too.
    pub profiles: bool,
    /// Derivatives of the special points, for a table of their own.
    pub sensitivities: Option<Vec<Entry>>,
}

impl Export {
    /// Opens the run in a folder and checks the whole file.
    ///
    /// # Errors
    /// If the file cannot be read or is damaged, or if its study or model is invalid.
    pub fn open(folder: &Path) -> Result<Export, ExportError> {
        let reading = Reading::open(folder)?;
        reading.sound()?;
        let run = reading.recorded(Part::Special)?;
        let study = parse_study_of_run(&run.study_text, &run.study_file, &run.model_text, &run.model_file);
        let study = study.map_err(ExportError::Study)?;
        let diagram = ordered(run.diagram, &study.plan);
        Ok(Export { reading, study, conversion: None, diagram, profiles: true, sensitivities: None })
    }

    /// Returns the model in the units of the export.
    pub fn model(&self) -> &Model {
        self.conversion.as_ref().map_or(&self.study.model, |own| own.model())
    }

    /// Exports quantities in the units of `conversion`.
    pub fn show_in(&mut self, conversion: Conversion) {
        self.diagram = conversion.diagram(std::mem::take(&mut self.diagram));
        self.conversion = Some(conversion);
    }

    /// Returns a point in the units of the export.
    fn shown(&self, mut point: Point) -> Point {
        let recorded: Vec<Quantity> = self.study.plan.record.iter().map(|(_, quantity)| *quantity).collect();
        append(&mut point, &recorded, &self.study.model);
        if self.study.model.conditions() != [0, 0] {
            // A boundary-value problem has no multipliers.
            point.spectrum.clear();
        }
        if let Some(conversion) = &self.conversion {
            conversion.point(&mut point);
        }
        point
    }

    /// Keeps only the branches for which `kept` returns true. Results of simulations are dropped.
    pub fn keep(&mut self, kept: impl Fn(&Branch) -> bool) {
        self.diagram.branches.retain(|branch| kept(branch));
        self.diagram.responses.clear();
    }

    /// Writes to a folder, or for NetCDF to a file. Missing folders are created. Returns the files written.
    ///
    /// # Errors
    /// If the run cannot be read, or `out` cannot be written.
    pub fn write(&self, format: Format, out: &Path) -> Result<Vec<PathBuf>, ExportError> {
        let folder = if format == Format::NetCdf { out.parent().unwrap_or(Path::new("")) } else { out };
        if !folder.as_os_str().is_empty() {
            std::fs::create_dir_all(folder).map_err(|error| ExportError::Output(folder.to_path_buf(), error))?;
        }
        match format {
            Format::Csv => tables::write(self, out, &csv::begin),
            Format::Parquet => tables::write(self, out, &parquet::begin),
            Format::NetCdf => netcdf::write(self, out),
        }
    }
}

/// File that gets its final name when it is complete.
struct Growing {
    path: PathBuf,
    meanwhile: PathBuf,
}

impl Growing {
    fn create(path: &Path) -> Result<(Growing, File), ExportError> {
        let mut name = path.file_name().unwrap_or_default().to_os_string();
        name.push(".part");
        let growing = Growing { path: path.to_path_buf(), meanwhile: path.with_file_name(name) };
        let file = File::create(&growing.meanwhile).map_err(|error| growing.failed(error))?;
        Ok((growing, file))
    }

    fn failed(&self, error: std::io::Error) -> ExportError {
        ExportError::Output(self.path.clone(), error)
    }

    fn finish(self) -> Result<PathBuf, ExportError> {
        std::fs::rename(&self.meanwhile, &self.path).map_err(|error| self.failed(error))?;
        Ok(self.path.clone())
    }
}

impl Drop for Growing {
    /// Removes an unfinished file. After the rename there is no file left to remove.
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.meanwhile);
    }
}
