//! Comparison of an ensemble with SciPy's `solve_ivp`.
//!
//! **Idea.** Initial states, time and tolerance (relative and absolute) are the same. SciPy integrates each trajectory
//! separately, as its interface is meant to be used, or all of them as one large problem with a common step. Final
//! errors are relative to a run with a tolerance 10⁴ times smaller, by SciPy's DOP853 for SciPy and by foldline for
//! foldline. They are medians over the trajectories, because near contact some trajectories diverge for every method.

use crate::own::ensemble::measured;
use crate::report::{Table, digits, time};
use crate::workplace::Workplace;
use crate::{Outcome, clock};
use foldline::attractors::Sampling;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Number of trajectories, final time, tolerance. Fewer trajectories than for foldline alone, because SciPy is slow.
const CASE: [&str; 3] = ["32", "20", "1e-6"];
/// Value of κ for which the contact ring acts fully.
const KAPPA: &str = "1";

/// Returns a Python interpreter with SciPy from an environment in `target`, which is created if it is missing.
fn python(place: &Workplace) -> Outcome<PathBuf> {
    let folder = place.root.join("target/bench-python");
    let python = folder.join("bin/python");
    let works = |python: &Path| {
        Command::new(python).args(["-c", "import scipy"]).stderr(Stdio::null()).status().is_ok_and(|s| s.success())
    };
    if !works(&python) {
        eprintln!("python3 -m venv {}; pip install scipy", folder.display());
        let _ = Command::new("python3").args(["-m", "venv"]).arg(&folder).status();
        let _ = Command::new(&python).args(["-m", "pip", "install", "--quiet", "scipy"]).status();
    }
    if works(&python) {
        Ok(python)
    } else {
        Err("SciPy is missing: python3 with venv and access to PyPI is needed".into())
    }
}

/// Returns the versions of Python and SciPy.
fn version(python: &Path) -> String {
    let asked = "import platform, scipy, numpy; print('Python', platform.python_version() + ', SciPy', scipy.__version__ + ', NumPy', numpy.__version__)";
    let out = Command::new(python).args(["-c", asked]).output();
    out.map_or(String::new(), |out| String::from_utf8_lossy(&out.stdout).trim().to_string())
}

/// Returns the initial states of the example `ensemble`, one per line: those sampled by the reference study.
fn starts() -> Outcome<String> {
    let ranges = vec![[-5.0, 5.0], [-5.0, 5.0], [-15.0, 15.0], [-15.0, 15.0]];
    let samples = CASE[0].parse()?;
    let sampling = Sampling {
        ranges,
        scales: vec![1.0; 4],
        whirl: None,
        samples,
        seed: 1,
        jobs: 1,
        tolerance: 1e-6,
        limits: Default::default(),
        given: None,
    };
    let line = |x: &[f64]| format!("{:?} {:?} {:?} {:?}\n", x[0], x[1], x[2], x[3]);
    Ok(sampling.starts().chunks_exact(4).map(line).collect())
}

/// Runs SciPy. Returns the time in seconds, the number of evaluations per trajectory, and the final states.
fn scipy(python: &Path, place: &Workplace, case: [&str; 3], starts: &str) -> Outcome<(f64, f64, Vec<[f64; 4]>)> {
    let [method, tolerance, way] = case;
    let mut child = Command::new(python)
        .arg(place.root.join("benches/scipy/ensemble.py"))
        .args([method, CASE[1], tolerance, KAPPA, way])
        .envs(["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"].map(|name| (name, "1")))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()?;
    child.stdin.take().ok_or("no input")?.write_all(starts.as_bytes())?;
    let out = child.wait_with_output()?;
    let text = String::from_utf8_lossy(&out.stdout);
    let numbers = |line: &str| line.split_whitespace().filter_map(|word| word.parse().ok()).collect::<Vec<f64>>();
    let mut lines = text.lines().map(numbers);
    let [seconds, calls] = lines.next().unwrap_or_default()[..] else { return Err("SciPy gave no answer".into()) };
    Ok((seconds, calls, lines.filter_map(|x| x.try_into().ok()).collect()))
}

/// Measures both codes alternately.
pub fn compared(place: &Workplace) -> Outcome<String> {
    let python = python(place)?;
    let starts = starts()?;
    let exact = scipy(&python, place, ["DOP853", "1e-10", "each"], &starts)?.2;
    let mut table = Table::new(&["", "time, median", "evaluations each", "median error", "foldline is faster by"]);
    let mut own: Vec<[f64; 3]> = Vec::new();
    let mut rows = Vec::new();
    for (method, way) in [("RK45", "each"), ("DOP853", "each"), ("RK45", "together"), ("DOP853", "together")] {
        let (mut times, mut ratios, mut last) = (Vec::new(), Vec::new(), None);
        for _ in 0..3 {
            let ours = measured(place, CASE)?[0];
            let answer = scipy(&python, place, [method, CASE[2], way], &starts)?;
            own.push(ours);
            times.push(answer.0);
            ratios.push(answer.0 / ours[0]);
            last = Some(answer);
        }
        let (_, calls, ends) = last.ok_or("no answer")?;
        let name = format!("SciPy {method}, {}", if way == "each" { "each by itself" } else { "all with one step" });
        let error = error(&ends, &exact);
        rows.push([
            name,
            time(clock::median(&times)),
            digits(calls),
            format!("{error:.1e}"),
            digits(clock::median(&ratios)),
        ]);
    }
    let seconds: Vec<f64> = own.iter().map(|one| one[0]).collect();
    let error = own.first().map_or(f64::NAN, |one| one[2]);
    table.row(&[
        "foldline, ensemble, the model's text".to_string(),
        time(clock::median(&seconds)),
        String::new(),
        format!("{error:.1e}"),
    ]);
    rows.iter().for_each(|row| table.row(row));
    Ok(format!(
        "{} trajectories of the contact rotor over a time of {} at tolerance {} (target: 50 times as fast as each by itself). Of foldline the best of five runs is taken, in wall \
         time, of SciPy one in processor time: milliseconds and tenths of seconds. {}.\n\n{}",
        CASE[0],
        CASE[1],
        CASE[2],
        version(&python),
        table.text()
    ))
}

/// Returns the median over the trajectories of the largest difference of a state.
fn error(ends: &[[f64; 4]], exact: &[[f64; 4]]) -> f64 {
    let largest = |(a, b): (&[f64; 4], &[f64; 4])| a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
    clock::median(&ends.iter().zip(exact).map(largest).collect::<Vec<f64>>())
}
