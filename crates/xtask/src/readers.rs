//! The packages with which the tests look at exported files as others do.

use crate::{root, run};
use std::process::Command;

/// The newest versions that were tried. xarray brings numpy and pandas with it.
const PACKAGES: [&str; 5] =
    ["xarray==2026.9.0", "netCDF4==1.7.5.1.post1", "h5netcdf==1.8.2", "h5py==3.16.0", "pyarrow==26.0.1"];

/// Whether the tests can go on: where there is no Python or no way to its packages, it is said that they look less far.
pub fn prepared() -> bool {
    let folder = root().join("target/tools/python");
    let complete = folder.join("complete");
    let wanted = PACKAGES.join("\n");
    if std::fs::read_to_string(&complete).is_ok_and(|there| there == wanted) {
        return true;
    }
    let python = folder.join("bin/python");
    let made = run(Command::new("python3").args(["-m", "venv"]).arg(&folder))
        && run(Command::new(&python)
            .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"])
            .args(PACKAGES));
    if !made {
        eprintln!("exports NOT checked with Python: python3 or its packages cannot be had here");
        return true;
    }
    std::fs::write(&complete, wanted).inspect_err(|error| eprintln!("{}: {error}", complete.display())).is_ok()
}
