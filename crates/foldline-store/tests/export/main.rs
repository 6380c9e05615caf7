//! Exports: other formats hold the contents of the run file to the bit, as read by independent programs.

mod made_up;

use foldline::diagram::{Branch, Cycle, Diagram, Point, Solution};
use foldline_store::export::{Export, Format};
use foldline_store::run_file::load;
use hdf5_reader::Hdf5File;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Returns the folder of a recorded run and the contents of its file.
fn recorded() -> (tempfile::TempDir, Diagram) {
    let folder = tempfile::tempdir().unwrap();
    made_up::record(folder.path());
    let mut diagram = load(folder.path()).unwrap().diagram;
    let listed: Vec<String> =
        Export::open(folder.path()).unwrap().diagram.branches.into_iter().map(|b| b.name).collect();
    diagram.branches.sort_by_key(|branch| listed.iter().position(|name| *name == branch.name));
    (folder, diagram)
}

fn export(folder: &Path, format: Format, name: &str) -> PathBuf {
    let out = folder.join(name);
    let written = Export::open(folder).unwrap().write(format, &out).unwrap();
    assert!(written.iter().all(|file| file.is_file()));
    out
}

/// Expected values of the scalar columns of a point.
fn expected(point: &Point) -> Vec<(&'static str, Option<f64>)> {
    let range = |k: usize, end: usize| Some(point.ranges[k][end]);
    let mut out = vec![
        ("position", Some(point.position as f64)),
        ("K", Some(point.parameters[0])),
        ("k_2", Some(point.parameters[1])),
        ("step_2", Some(point.parameters[2])),
        ("period", point.solution.period()),
        ("forcing_periods", Some(f64::from(point.solution.forcing_periods()))),
        ("x_min", range(0, 0)),
        ("x_max", range(0, 1)),
        ("node_min", range(1, 0)),
        ("r_max", range(2, 1)),
        ("node_mean", Some(point.averages[1][0])),
        ("node_rms", Some(0.5)),
        ("unstable", Some(point.unstable as f64)),
        ("discretisation", Some(point.trust.discretisation)),
        ("trivial_defect", Some(point.trust.trivial_defect)),
        ("spectrum_error", Some(point.trust.spectrum)),
        ("step", Some(point.step)),
        ("linearisations", Some(point.cost.linearisations as f64)),
    ];
    if let Solution::Equilibrium(state) = &point.solution {
        out.extend([("x", Some(state[0])), ("node_2", Some(state[1]))]);
    }
    out
}

/// Compares to the bit; all NaNs are equal, because text has only one.
fn same(a: Option<f64>, b: Option<f64>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()),
        (None, None) => true,
        _ => false,
    }
}

/// Reads the rows of a CSV file without quotation marks, keyed by column.
fn csv_rows(file: &Path) -> Vec<HashMap<String, String>> {
    let text = std::fs::read_to_string(file).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), names.len(), "{line}");
        names.iter().zip(cells).map(|(name, cell)| (name.to_string(), cell.to_string())).collect()
    };
    lines.map(row).collect()
}

#[test]
fn csv_has_every_digit() {
    let (folder, diagram) = recorded();
    let out = export(folder.path(), Format::Csv, "csv");
    let number = |cell: &String| (!cell.is_empty()).then(|| cell.parse::<f64>().unwrap());
    let rows = csv_rows(&out.join("points.csv"));
    let points: Vec<(&Branch, &Point)> =
        diagram.branches.iter().flat_map(|b| b.points.iter().map(move |p| (b, p))).collect();
    assert_eq!(rows.len(), points.len());
    for (row, (branch, point)) in rows.iter().zip(&points) {
        assert_eq!(row["branch"], branch.name);
        for (name, value) in expected(point) {
            assert!(same(number(&row[name]), value), "{name}: {} {value:?}", row[name]);
        }
        for (k, z) in point.spectrum.iter().enumerate() {
            assert!(same(number(&row[&format!("spectrum_{}_re", k + 1)]), Some(z.re)));
            assert!(same(number(&row[&format!("spectrum_{}_im", k + 1)]), Some(z.im)));
        }
    }
    let mut rows = csv_rows(&out.join("profiles.csv")).into_iter();
    for (branch, point) in points {
        let Solution::Cycle(cycle) = &point.solution else { continue };
        for (node, (time, state)) in nodes(cycle).into_iter().enumerate() {
            let row = rows.next().unwrap();
            assert_eq!((&row["branch"], &row["node"]), (&branch.name, &node.to_string()));
            assert_eq!(row["position"], point.position.to_string());
            assert!(number(&row["normalised_time"]).is_some_and(|found| (found - time).abs() < 1e-15));
            let wanted = [("x", state[0]), ("node_2", state[1])];
            for (name, value) in wanted {
                assert!(same(number(&row[name]), Some(value)), "{name} {value} {row:?}");
            }
        }
    }
    assert_eq!(rows.count(), 0);
}

/// Normalised time and state at every left end and Gauss point, and at the end.
fn nodes(cycle: &Cycle) -> Vec<(f64, Vec<f64>)> {
    // For degree 2 the Gauss points are (1 ∓ 1/√3)/2.
    let gauss = [0.0, 0.5 - 1.0 / 12f64.sqrt(), 0.5 + 1.0 / 12f64.sqrt()];
    assert_eq!(cycle.degree, 2);
    let times = cycle.mesh.windows(2).flat_map(|ends| gauss.map(|c| ends[0] + c * (ends[1] - ends[0])));
    let mut out: Vec<(f64, Vec<f64>)> = times.zip(cycle.profile.chunks(2).map(<[f64]>::to_vec)).collect();
    out.push((1.0, out[0].1.clone()));
    out
}

#[test]
fn parquet_has_the_same_bits() {
    let (folder, diagram) = recorded();
    let out = export(folder.path(), Format::Parquet, "parquet");
    let rows = |name: &str| -> Vec<HashMap<String, Field>> {
        let file = std::fs::File::open(out.join(format!("{name}.parquet"))).unwrap();
        let reader = SerializedFileReader::new(file).unwrap();
        let rows = reader.get_row_iter(None).unwrap();
        rows.map(|row| row.unwrap().into_columns().into_iter().collect()).collect()
    };
    let number = |field: &Field| match field {
        Field::Null => None,
        Field::Double(value) => Some(*value),
        Field::Long(value) => Some(*value as f64),
        other => panic!("{other:?}"),
    };
    let all: Vec<&Point> = diagram.branches.iter().flat_map(|b| &b.points).collect();
    let found = rows("points");
    assert_eq!(found.len(), all.len());
    for (row, point) in found.iter().zip(&all) {
        for (name, value) in expected(point) {
            assert!(same(number(&row[name]), value), "{name}: {:?} {value:?}", row[name]);
        }
    }
    let specials: Vec<_> = diagram.branches.iter().flat_map(|b| &b.special).collect();
    let found = rows("special_points");
    assert_eq!(found.len(), specials.len());
    for (row, special) in found.iter().zip(specials) {
        assert_eq!(row["kind"], Field::Str(special.kind.name().into()));
        assert!(same(number(&row["coefficient_1"]), special.coefficients.first().copied()));
        assert!(same(number(&row["coefficient_1_error"]), special.coefficient_errors.first().copied()));
        assert!(same(number(&row["error"]), Some(special.error)));
    }
    let cycles = all.iter().filter_map(|point| match &point.solution {
        Solution::Cycle(cycle) => Some(nodes(cycle)),
        Solution::Equilibrium(_) | Solution::Torus(_) => None,
    });
    let states: Vec<Vec<f64>> = cycles.flatten().map(|(_, state)| state).collect();
    let found = rows("profiles");
    assert_eq!(found.len(), states.len());
    for (row, state) in found.iter().zip(states) {
        assert!(same(number(&row["x"]), Some(state[0])) && same(number(&row["node_2"]), Some(state[1])));
    }
    assert_eq!(rows("responses").len(), diagram.responses[0].responses.len());
    assert_eq!(rows("branches")[1]["branch"], Field::Str(diagram.branches[1].name.clone()));
}

#[test]
fn netcdf_has_a_group_for_each_branch() {
    let (folder, diagram) = recorded();
    let file = Hdf5File::open(export(folder.path(), Format::NetCdf, "run.nc")).unwrap();
    let reals =
        |path: &str| -> Vec<f64> { file.dataset(path).unwrap().read_array().unwrap().iter().copied().collect() };
    let integers =
        |path: &str| -> Vec<i64> { file.dataset(path).unwrap().read_array().unwrap().iter().copied().collect() };
    let groups = file.dataset("/group").unwrap().read_strings().unwrap();
    assert_eq!(groups.len(), diagram.branches.len());
    assert!(["main", "main|hopf-1", "empty", "_(1)"].iter().all(|name| groups.iter().any(|group| group == name)));
    let text = file.dataset("/main/K").unwrap().attribute("long_name").unwrap().read_string().unwrap();
    assert_eq!(text, "gain, größer als 0");
    for (branch, group) in diagram.branches.iter().zip(&groups) {
        if branch.points.is_empty() {
            assert!(file.dataset(&format!("/{group}/K")).is_err());
            continue;
        }
        let positions: Vec<i64> = branch.points.iter().map(|point| point.position).collect();
        assert_eq!(integers(&format!("/{group}/point")), positions);
        for (k, point) in branch.points.iter().enumerate() {
            for (name, value) in expected(point).into_iter().filter(|(name, _)| *name != "position") {
                let counted = ["forcing_periods", "unstable", "linearisations"].contains(&name);
                let path = format!("/{group}/{name}");
                let found = if counted { integers(&path)[k] as f64 } else { reals(&path)[k] };
                assert!(same(Some(found), value.or(Some(f64::NAN))), "{name} {found} {value:?}");
            }
            let Solution::Cycle(cycle) = &point.solution else { continue };
            let width = file.dataset(&format!("/{group}/x")).unwrap().shape()[1] as usize;
            let wanted = nodes(cycle);
            for (name, i) in [("x", 0), ("node_2", 1)] {
                let found = &reals(&format!("/{group}/{name}"))[k * width..(k + 1) * width];
                wanted.iter().zip(found).for_each(|((_, state), found)| assert!(same(Some(state[i]), Some(*found))));
                assert!(found[wanted.len()..].iter().all(|v| v.is_nan()));
            }
            let found = &reals(&format!("/{group}/normalised_time"))[k * width..(k + 1) * width];
            wanted.iter().zip(found).for_each(|((time, _), found)| assert!((time - found).abs() < 1e-15));
        }
        if !branch.special.is_empty() {
            let kinds: Vec<&str> = branch.special.iter().map(|special| special.kind.name()).collect();
            let path = format!("/{group}/special/kind");
            assert_eq!(file.dataset(&path).unwrap().read_strings().unwrap(), kinds);
        }
    }
}

#[test]
fn an_unfinished_export_leaves_no_file() {
    let (folder, _) = recorded();
    let run = folder.path().join("run.sqlite");
    let out = folder.path().join("out");
    let exporting = Export::open(folder.path()).unwrap();
    // Overwrites a profile with zeros, which SQLite's integrity check does not notice.
    let damage = rusqlite::Connection::open(&run).unwrap();
    let spoilt = "UPDATE points SET solution_bytes = zeroblob(length(solution_bytes)) WHERE position = 2";
    drop(exporting);
    damage.execute(spoilt, []).unwrap();
    for format in [Format::Csv, Format::Parquet, Format::NetCdf] {
        let target = if format == Format::NetCdf { out.join("run.nc") } else { out.clone() };
        let message = Export::open(folder.path()).unwrap().write(format, &target).unwrap_err().to_string();
        assert!(message.contains("checksum") && message.contains("position 2"), "{message}");
        let left = std::fs::read_dir(&out).unwrap().flatten().map(|entry| entry.file_name());
        assert!(left.into_iter().all(|name| name.to_string_lossy().starts_with("branches.")));
    }
}

/// tests/export/check.py compares what xarray and pandas read with the bytes of the run file, if `cargo xtask test` has
/// set up a Python environment with both.
#[test]
fn python_reads_the_same_bits() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let python = root.join("target/tools/python/bin/python");
    if !root.join("target/tools/python/complete").exists() {
        eprintln!("NOT checked with Python: `cargo xtask python` makes what is needed");
        return;
    }
    let (folder, _) = recorded();
    export(folder.path(), Format::Csv, "csv");
    export(folder.path(), Format::Parquet, "parquet");
    export(folder.path(), Format::NetCdf, "run.nc");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/export/check.py");
    let output = Command::new(python).arg(script).arg(folder.path()).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("compared 7 points"), "{said}");
}
