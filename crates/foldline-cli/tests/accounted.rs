//! Finished runs of many kinds of studies, read from their files alone: the number of unstable eigenvalues or
//! multipliers changes only at special points, by as much as their kinds allow, and equals the number in the stored
//! spectrum. Whatever does not fit is said, and the exit code is 3.

use rusqlite::Connection;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A point of a branch, or a special point between two of them.
struct Row {
    position: i64,
    kind: String,
    counts: [i64; 2],
    parameters: Vec<f64>,
    spectrum: Vec<[f64; 2]>,
    /// Stated error of the spectrum, and defect of the trivial multiplier.
    error: f64,
    period: Option<f64>,
    forced: bool,
}

fn numbers(bytes: &[u8]) -> Vec<f64> {
    bytes.chunks_exact(8).map(|chunk| f64::from_le_bytes(chunk.try_into().unwrap())).collect()
}

impl Row {
    fn all(file: &Connection, branch: i64, special: bool) -> Vec<Row> {
        let (table, kind, counts) = match special {
            true => ("special_points", "kind", "unstable_before, unstable_after"),
            false => ("points", "''", "unstable, unstable"),
        };
        let sql = format!(
            "SELECT position, {kind}, {counts}, parameter_bytes, spectrum_bytes, spectrum_error, trivial_defect, period, \
             forcing_periods FROM {table} WHERE branch = ? ORDER BY position, rowid"
        );
        let mut statement = file.prepare(&sql).unwrap();
        let rows = statement.query_map([branch], |row| {
            let errors: [Option<f64>; 2] = [row.get(6)?, row.get(7)?];
            Ok(Row {
                position: row.get(0)?,
                kind: row.get(1)?,
                counts: [row.get(2)?, row.get(3)?],
                parameters: numbers(&row.get::<_, Vec<u8>>(4)?),
                spectrum: numbers(&row.get::<_, Vec<u8>>(5)?).chunks_exact(2).map(|z| [z[0], z[1]]).collect(),
                error: errors.into_iter().flatten().filter(|e| e.is_finite()).fold(0.0, f64::max),
                period: row.get(8)?,
                forced: row.get::<_, i64>(9)? > 0,
            })
        });
        rows.unwrap().map(Result::unwrap).collect()
    }

    /// Smallest and largest number of unstable eigenvalues or multipliers that the stored spectrum allows.
    fn in_spectrum(&self) -> [i64; 2] {
        /// Factor of safety where a multiplier is double.
        const ERRORS: f64 = 10.0;
        let trivial = usize::from(self.period.is_some() && !self.forced).min(self.spectrum.len());
        let (mut least, mut most) = (0, 0);
        for [re, im] in &self.spectrum[trivial..] {
            let (off, size) = match self.period {
                Some(_) => (re.hypot(*im) - 1.0, re.hypot(*im).max(1.0)),
                None => (*re, re.hypot(*im).max(1e-6)),
            };
            let error = (ERRORS * self.error).max(1e-9) * size;
            least += i64::from(off > error);
            most += i64::from(off > -error);
        }
        [least, most]
    }
}

fn allowed(kind: &str, change: i64) -> bool {
    match kind {
        "fold" | "period-doubling" => change == 1,
        "hopf" | "torus" => change == 2,
        "mark" | "peak" | "sliding" => change == 0,
        // Where a vertical branch ends in contact, a multiplier leaves 1.
        "grazing" => change <= 1,
        // Any number of eigenvalues may be 0 at once; multipliers and eigenvalues jump at an impact and at a surface.
        "branch-point" | "impact-grazing" | "boundary-equilibrium" => true,
        _ => false,
    }
}

/// Returns the number of steps checked, and the changes that the files of a run do not explain, one line each, with the branch.
fn unexplained(run: &Path) -> (usize, Vec<(String, String)>) {
    let file = Connection::open(run.join("run.sqlite")).unwrap();
    let mut statement =
        file.prepare("SELECT branch, name, family, free, origin_kind FROM branches WHERE held IS NULL").unwrap();
    let branches = statement.query_map([], |row| {
        Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?, row.get::<_, Option<String>>(4)?))
    });
    let branches: Vec<(i64, String, String, u32, Option<String>)> = branches.unwrap().map(Result::unwrap).collect();
    let (mut lines, mut checked) = (Vec::new(), 0);
    for (branch, name, family, free, origin) in branches {
        // A boundary-value problem has no stability.
        if family == "arc" {
            continue;
        }
        let (points, special) = (Row::all(&file, branch, false), Row::all(&file, branch, true));
        let mut say = |row: &Row, what: String| {
            lines.push((name.clone(), format!("{what} at {}", row.parameters[free as usize])))
        };
        for own in &special {
            let change = (own.counts[1] - own.counts[0]).abs();
            if !allowed(&own.kind, change) {
                say(own, format!("{} {}→{}", own.kind, own.counts[0], own.counts[1]));
            }
        }
        for pair in points.windows(2) {
            let mut now = pair[0].counts[0];
            for between in special.iter().filter(|s| s.position == pair[0].position) {
                if between.counts[0] != now {
                    say(between, format!("{} before a {}, after {now}", between.counts[0], between.kind));
                }
                now = between.counts[1];
            }
            if now != pair[1].counts[0] {
                say(&pair[1], format!("{now}→{} in silence", pair[1].counts[0]));
            }
            checked += 1;
        }
        // The special point where a branch starts has the number of the point beside it.
        let edge = |row: &Row| row.position == 0 && origin.is_some();
        // At the grazing of an impact the multipliers jump; the stored ones are those of the near side.
        let grazes = |row: &Row| special.iter().any(|s| s.kind == "impact-grazing" && s.parameters == row.parameters);
        for row in points.iter().filter(|row| !edge(row) && !grazes(row)) {
            let [least, most] = row.in_spectrum();
            if !(least..=most).contains(&row.counts[0]) {
                say(row, format!("{} unstable, {least} to {most} in the spectrum", row.counts[0]));
            }
        }
    }
    (checked, lines)
}

/// Names that the messages about shortfalls mention.
fn said(run: &Path) -> Vec<String> {
    let file = Connection::open(run.join("run.sqlite")).unwrap();
    let mut statement = file.prepare("SELECT about FROM shortfalls").unwrap();
    statement.query_map([], |row| row.get(0)).unwrap().map(Result::unwrap).collect()
}

fn foldline(arguments: &[&str], folder: &Path) -> i32 {
    let output = Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder).output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    let code = output.status.code().unwrap();
    assert!([0, 3].contains(&code), "{code}: {text}");
    code
}

/// Checks a finished run. `points` is the smallest number of steps that it must have.
fn checked(run: &Path, code: i32, points: usize) {
    let (count, lines) = unexplained(run);
    let about = said(run);
    let silent: Vec<_> = lines.iter().filter(|(name, _)| code != 3 || !about.contains(name)).collect();
    assert!(silent.is_empty(), "{}: {silent:#?}", run.display());
    assert!(count >= points, "{}: {count} steps only", run.display());
}

/// Runs a study of the project.
fn study_is_accounted_for(study: &str, points: usize) {
    let folder = tempfile::tempdir().unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(study);
    let code = foldline(&["run", &path.to_string_lossy(), "--out", "run"], folder.path());
    checked(&folder.path().join("run"), code, points);
}

/// Runs a model and a study given as text.
fn written(model: &str, study: &str) -> (tempfile::TempDir, PathBuf, i32) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.toml"), model).unwrap();
    std::fs::write(folder.path().join("s.toml"), format!("model = \"m.toml\"\n{study}")).unwrap();
    let code = foldline(&["run", "s.toml", "--out", "run"], folder.path());
    let run = folder.path().join("run");
    (folder, run, code)
}

/// Equilibria, cycles, tori, maps, boundary-value problems, homotopies, and curves in two parameters.
#[test]
fn studies_of_every_family_are_accounted_for() {
    let table = [
        ("studies/classical/predator-prey.toml", 40),
        ("studies/classical/co-oxidation.toml", 20),
        ("studies/classical/duffing-forced.toml", 40),
        ("studies/maps/henon.toml", 40),
        ("studies/maps/logistic.toml", 40),
        ("studies/maps/ikeda.toml", 40),
        ("studies/tori/laval.toml", 15),
        ("studies/boundary/bratu.toml", 0),
        ("studies/exact/one-sided-spring.toml", 40),
        ("studies/exact/belt.toml", 40),
        ("studies/exact/rub.toml", 40),
        ("studies/overhung-rotor/homotopy.toml", 40),
        ("crates/foldline-campaign/outside/fitzhugh-nagumo/fhn09s.toml", 40),
        ("crates/foldline-campaign/outside/gear-backlash/gbs.toml", 40),
        ("crates/foldline-campaign/outside/separable-wells/study.toml", 100),
        ("crates/foldline-campaign/outside/swap/perms.toml", 20),
        ("crates/foldline-campaign/outside/kerr-pair/study.toml", 20),
    ];
    for (study, points) in table {
        study_is_accounted_for(study, points);
    }
}

/// An oscillator that hits a stop: beyond the grazing of an impact the branch goes on with another number of impacts
/// and of unstable multipliers.
#[test]
fn impact_cycles_are_accounted_for() {
    let model = include_str!("../../../models/impact-oscillator.toml");
    let study = "tolerance = 1e-6\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\n\
                 [[branch]]\nname = \"response\"\nfrom = \"s\"\nfree = \"omega\"\nrange = [0.69, 1.0]\n";
    let (_folder, run, code) = written(model, study);
    checked(&run, code, 10);
    let file = Connection::open(run.join("run.sqlite")).unwrap();
    let grazings: i64 = file
        .query_row(
            "SELECT count(*) FROM special_points WHERE kind = 'impact-grazing' AND unstable_before <> unstable_after",
            [],
            |row| row.get(0),
        )
        .unwrap();
    assert!(grazings > 0, "no grazing at which the number of unstable multipliers changes");
}

/// An explored diagram, and a run that was interrupted again and again.
#[test]
fn explored_and_resumed_runs_are_accounted_for() {
    let model = "[parameters]\nmu = -0.5\n[states]\nx = { equation = \"mu*x - y + x*(x^2 + y^2) - x*(x^2 + y^2)^2\", range = [-2, 2] }\n\
                 y = { equation = \"x + mu*y + y*(x^2 + y^2) - y*(x^2 + y^2)^2\", range = [-2, 2] }\n";
    let study = "[[explore]]\nname = \"all\"\nfree = \"mu\"\nrange = [-0.5, 0.3]\nvalues = 3\nsamples = 8\n";
    let (folder, run, code) = written(model, study);
    checked(&run, code, 20);
    let mut code = foldline(&["run", "s.toml", "--out", "parts", "--time-limit", "0.02s"], folder.path());
    for _ in 0..200 {
        if code == 0 {
            break;
        }
        code = foldline(&["run", "s.toml", "--out", "parts", "--resume", "--time-limit", "0.06s"], folder.path());
    }
    checked(&folder.path().join("parts"), code, 20);
}

/// The rule notices what it must notice.
#[test]
fn a_change_that_is_not_explained_is_found() {
    let model = "[parameters]\np = -0.5\n[states]\nx = \"p*x - x^3\"\n";
    let study = "[[seed]]\nname = \"s\"\nstate = { x = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p\"\nrange = [-0.5, 0.5]\n";
    let (_folder, run, code) = written(model, study);
    checked(&run, code, 5);
    let change = |sql: &str| Connection::open(run.join("run.sqlite")).unwrap().execute(sql, []).unwrap();
    assert_eq!(change("UPDATE special_points SET kind = 'mark'"), 1);
    assert_eq!(unexplained(&run).1.len(), 1);
    change("DELETE FROM special_points");
    assert_eq!(unexplained(&run).1.len(), 1);
    change("UPDATE points SET unstable = 0");
    assert!(!unexplained(&run).1.is_empty(), "the spectrum says otherwise");
}
