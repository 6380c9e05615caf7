//! `foldline export`: a run in the formats of other programs.

use crate::arguments::{Export as Typed, ExportFormat};
use crate::failure::{Failure, Outcome};
use crate::table::{asked_for, conversion};
use crate::verbosity::report;
use foldline_store::export::{Export, ExportError, Format};

/// Writes a run in another format and reports the path.
pub fn write(typed: &Typed) -> Result<Outcome, Failure> {
    let mut export = Export::open(&typed.folder)?;
    export.profiles = !typed.no_profiles;
    if !typed.branch.is_empty() {
        let kept = typed.branch.iter().map(|name| asked_for(&export.diagram, Some(name)));
        let kept = kept.collect::<Result<Vec<_>, Failure>>()?;
        export.keep(|branch| kept.iter().any(|kept| kept(branch)));
    }
    if let Some(conversion) = conversion(export.model(), &typed.unit)? {
        export.show_in(conversion);
    }
    let (format, name) = match typed.format {
        ExportFormat::Csv => (Format::Csv, "csv"),
        ExportFormat::Parquet => (Format::Parquet, "parquet"),
        ExportFormat::Netcdf => (Format::NetCdf, "run.nc"),
    };
    let out = typed.out.clone().unwrap_or_else(|| typed.folder.join(name));
    if format == Format::NetCdf && out.is_dir() {
        let cure = format!("name a file, such as --out {}", out.join("run.nc").display());
        return Err(Failure::typed(format!("--out {}: this is a folder", out.display()), cure));
    }
    if format != Format::NetCdf && out.is_file() {
        let message = format!("--out {}: this is a file", out.display());
        return Err(Failure::typed(message, "name a folder; each table becomes a file in it"));
    }
    for file in export.write(format, &out)? {
        report(format_args!("wrote {}", file.display()))?;
    }
    Ok(Outcome::Done)
}

impl From<ExportError> for Failure {
    fn from(error: ExportError) -> Failure {
        match error {
            ExportError::Run(error) => error.into(),
            ExportError::Study(found) => found.into(),
            ExportError::Output(..) => Failure::Outside(error.to_string()),
        }
    }
}
