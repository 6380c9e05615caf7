//! `cargo xtask kill`: runs killed at random times must resume without loss and end like an undisturbed run.

use crate::{cargo, root};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Outcomes of the runs.
#[derive(Default)]
struct Counts {
    killed: usize,
    before_the_file: usize,
    after_the_end: usize,
    points: usize,
    failed: usize,
}

/// Kills and resumes the reference study the given number of times.
pub fn test(times: usize) -> bool {
    if !cargo(&["build", "--release", "--quiet", "--package", "foldline-cli"]) {
        return false;
    }
    let place = Place { program: root().join("target/release/foldline"), out: root().join("target/killed") };
    // Removes the folder of an earlier call.
    let _ = std::fs::remove_dir_all(&place.out);
    let start = Instant::now();
    let whole = place.out.join("whole");
    if !place.finished(&whole, false) {
        eprintln!("the undisturbed run failed");
        return false;
    }
    let (span, expected) = (start.elapsed(), place.table(&whole, "--special"));
    let (mut counts, mut random) = (Counts::default(), 0x9e37_79b9_7f4a_7c15u64);
    for k in 0..times {
        // xorshift (Marsaglia); any distribution of times is sufficient.
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        let share = 1.05 * (random >> 11) as f64 / (1u64 << 53) as f64;
        let folder = place.out.join(k.to_string());
        if let Err(why) = place.killed(&folder, span.mul_f64(share), &expected, &mut counts) {
            eprintln!("{} after {:.3} of the time: {why}", folder.display(), share);
            counts.failed += 1;
            continue;
        }
        let _ = std::fs::remove_dir_all(&folder);
    }
    println!(
        "{} killed ({} before there was a file, {} after the end), {} points stored until then, {} runs failed",
        counts.killed, counts.before_the_file, counts.after_the_end, counts.points, counts.failed
    );
    counts.failed == 0
}

struct Place {
    program: PathBuf,
    out: PathBuf,
}

impl Place {
    fn command(&self, folder: &Path, resume: bool) -> Command {
        let mut command = Command::new(&self.program);
        command.arg("run").arg(root().join("studies/overhung-rotor/bouncing.toml")).arg("--out").arg(folder);
        command.args(resume.then_some("--resume")).stdout(Stdio::null()).stderr(Stdio::null());
        command
    }

    fn finished(&self, folder: &Path, resume: bool) -> bool {
        self.command(folder, resume).status().is_ok_and(|status| status.success())
    }

    /// Returns the lines of a table without its heading; empty if there is no run.
    fn table(&self, folder: &Path, what: &str) -> Vec<String> {
        let output = Command::new(&self.program).arg("table").arg(folder).args([what, "--format", "csv"]).output();
        let text = output.map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).unwrap_or_default();
        text.lines().skip(1).map(str::to_string).collect()
    }

    fn killed(&self, folder: &Path, after: Duration, expected: &[String], counts: &mut Counts) -> Result<(), String> {
        let mut child = self.command(folder, false).spawn().map_err(|error| error.to_string())?;
        std::thread::sleep(after);
        counts.after_the_end += usize::from(matches!(child.try_wait(), Ok(Some(_))));
        // The process may have ended in the meantime.
        let _ = child.kill();
        child.wait().map_err(|error| error.to_string())?;
        counts.killed += 1;
        let begun = folder.join("run.sqlite").exists();
        counts.before_the_file += usize::from(!begun);
        let before = self.table(folder, "--points");
        counts.points += before.len();
        if !self.finished(folder, begun) {
            return Err("it does not resume".to_string());
        }
        let after: BTreeSet<String> = self.table(folder, "--points").into_iter().collect();
        if let Some(lost) = before.iter().find(|row| !after.contains(*row)) {
            return Err(format!("a point is lost or changed: {lost}"));
        }
        let found = self.table(folder, "--special");
        if found.len() != expected.len() {
            return Err(format!("{} special points instead of {}", found.len(), expected.len()));
        }
        let differs = expected.iter().find(|row| !found.iter().any(|other| same(row, other)));
        differs.map_or(Ok(()), |row| Err(format!("no longer there: {row}")))
    }
}

/// True if two rows denote the same special point within their stated errors. A row begins with branch, kind and
/// parameter and ends with error and normal form.
fn same(a: &str, b: &str) -> bool {
    let number = |text: Option<&str>| text.and_then(|text| text.parse::<f64>().ok()).unwrap_or(f64::NAN);
    // A normal form that contains a comma is quoted.
    let error = |row: &str| {
        let end = if row.ends_with('"') { row.rfind(",\"") } else { row.rfind(',') };
        number(row[..end.unwrap_or(row.len())].rsplit(',').next())
    };
    let heads = |row: &str| row.split(',').take(2).map(str::to_string).collect::<Vec<String>>();
    let [x, y] = [a, b].map(|row| number(row.split(',').nth(2)));
    heads(a) == heads(b) && (x - y).abs() <= (error(a) + error(b)) * (1.0 + x.abs())
}
