//! `foldline export`: a run in the formats of other programs.

use crate::arguments::{Export as Typed, ExportFormat};
use crate::failure::{Failure, Outcome};
use crate::table::{asked_for, conversion, found};
use crate::verbosity::report;
use foldline::sensitivity::listed::entries;
use foldline_store::export::{Export, ExportError, Format};
use foldline_store::run_file::Part;
use foldline_view::{Amount, Shown};

/// Writes a run in another format and reports the path.
pub fn write(typed: &Typed) -> Result<Outcome, Failure> {
    let (format, name) = match typed.format {
        ExportFormat::Csv => (Format::Csv, "csv"),
        ExportFormat::Parquet => (Format::Parquet, "parquet"),
        ExportFormat::Netcdf => (Format::NetCdf, "run.nc"),
        ExportFormat::Html => return page(typed),
    };
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
    if typed.sensitivities {
        if format == Format::NetCdf {
            let message = "--sensitivities: a NetCDF file has no table of sensitivities";
            return Err(Failure::typed(message, "export them with --format csv or parquet"));
        }
        if !typed.unit.is_empty() {
            return Err(Failure::typed(
                "--sensitivities: derivatives are in the units of the model",
                "leave out --unit",
            ));
        }
        let branches: Vec<String> = export.diagram.branches.iter().map(|branch| branch.name.clone()).collect();
        let run = crate::table::read(&typed.folder, Part::Everything)?;
        let found = found(&run, &|branch| branches.contains(&branch.name));
        export.sensitivities = Some(entries(&found, &run.model, &|_, _| true));
    }
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

/// Writes a run as a page that needs no server.
fn page(typed: &Typed) -> Result<Outcome, Failure> {
    if !typed.branch.is_empty() || !typed.unit.is_empty() || typed.no_profiles || typed.sensitivities {
        let message = "--format html: --branch, --unit, --no-profiles and --sensitivities do not apply to a page";
        return Err(Failure::typed(message, "leave them out; the page shows and hides branches itself"));
    }
    let out = typed.out.clone().unwrap_or_else(|| typed.folder.join("run.html"));
    if out.is_dir() {
        let cure = format!("name a file, such as --out {}", out.join("run.html").display());
        return Err(Failure::typed(format!("--out {}: this is a folder", out.display()), cure));
    }
    let (text, amount) = foldline_view::html(&typed.folder, &Shown::default())?;
    let failed = |error| Failure::from(foldline_view::Failure::Output(out.clone(), error));
    if let Some(folder) = out.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    let meanwhile = out.with_extension("html.tmp");
    std::fs::write(&meanwhile, text).and_then(|()| std::fs::rename(&meanwhile, &out)).map_err(failed)?;
    let Amount { points, solutions } = amount;
    report(format_args!("wrote {} with {points} points; {solutions} solutions include their orbits", out.display()))?;
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
