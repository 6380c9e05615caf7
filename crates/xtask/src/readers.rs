//! Python packages with which the tests read exported files, as users do.

use crate::environment;

/// Newest versions that were tested. xarray depends on numpy and pandas.
const PACKAGES: [&str; 5] =
    ["xarray==2026.9.0", "netCDF4==1.7.5.1.post1", "h5netcdf==1.8.2", "h5py==3.16.0", "pyarrow==26.0.1"];

/// Installs the packages. Without Python or a package index the tests check less, and a message says so.
pub fn prepared() -> bool {
    if environment::ready("python", &PACKAGES).is_none() {
        eprintln!("exports NOT checked with Python: python3 or its packages cannot be installed here");
    }
    true
}
