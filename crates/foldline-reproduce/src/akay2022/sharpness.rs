//! The choice of K: error of the smoothed rotor relative to the piecewise one.

use super::orbits::cycle;
use super::rotor::stable_at;
use crate::runs::{Run, Runs, Table, in_parallel};
use foldline::diagram::{Point, Response};
use foldline::explore::{Persistence, System, persistence};
use foldline_rotor::{
    Nondimensional, SmoothingError, exact_motion, fitted_power, smallest_sharpness, smoothing_errors,
};

/// Speed at which motions are compared.
pub const SPEED: f64 = 5.0;
/// β with the K used for it in the study.
pub const PUBLISHED: [(f64, f64); 2] = [(10.0, 150.0), (6.0, 90.0)];
/// Errors for which the smallest K is determined.
pub const ACCEPTABLE: [f64; 2] = [1e-3, 1e-4];
/// K in units of β.
const TIMES: [f64; 9] = [2.0, 3.0, 5.0, 8.0, 15.0, 25.0, 40.0, 70.0, 120.0];
const FAMILIES: [&str; 2] = ["SL", "DL"];
/// Position of β among the parameters.
const BETA: usize = 5;

/// Errors of the smoothed rotor for one motion of the piecewise rotor.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// β.
    pub beta: f64,
    /// `SL` or `DL`.
    pub family: &'static str,
    /// Errors by increasing K.
    pub errors: Vec<SmoothingError>,
    /// Accuracy to which the motions had settled.
    pub floor: f64,
}

impl Comparison {
    /// Power of K with which the error falls.
    pub fn power(&self) -> Option<f64> {
        fitted_power(&self.errors, 30.0 * self.floor).map(|(power, _)| power)
    }

    /// Errors at that K, if it is among those compared.
    pub fn at(&self, k: f64) -> Option<SmoothingError> {
        self.errors.iter().copied().find(|e| (e.sharpness - k).abs() < 1e-9 * k)
    }
}

/// All results on the choice of K.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// Comparisons for every motion that exists.
    pub comparisons: Vec<Comparison>,
    /// β, acceptable error, the smallest K for all motions, and its error.
    pub smallest: Vec<[f64; 4]>,
    /// K at the second β that is as accurate for SL as the published K at the first, and its error.
    pub equivalent: Option<[f64; 2]>,
    /// Motions that do not exist at some β: the family, that β, and the β at which it vanishes on the way.
    pub missing: Vec<(&'static str, f64, f64)>,
}

/// Returns the choice computed from the contact cycles of a run, or read back.
///
/// # Errors
/// A cycle is missing, or the simulation settles to another motion.
pub fn choice(runs: &Runs, run: &Run) -> Result<Choice, String> {
    let of = format!("{SPEED} {PUBLISHED:?} {ACCEPTABLE:?} {TIMES:?} {} {}", run.study.text, run.study.model_text);
    runs.table("sharpness", &of, || computed(run, runs.jobs())).map(|table| read(&table))
}

/// Cycle of a family at another β, or the β beyond which it does not exist.
fn start(run: &Run, family: &str, beta: f64) -> Result<Result<Point, f64>, String> {
    let point = stable_at(run, &format!("contact {family}"), SPEED)?;
    let system = System::of_plan(&run.study.model, &run.study.plan);
    let plan = &run.study.plan;
    match persistence(&system, plan.tolerance, plan.degree, &point, BETA, beta, 4000) {
        Persistence::Survives(point) => Ok(Ok(*point)),
        Persistence::Vanishes { fold } => Ok(Err(fold)),
        Persistence::Changes(_) => Err(format!("{family} is not stable at β = {beta}")),
        Persistence::Undecided(why) => Err(format!("{family} cannot be followed to β = {beta}: {why}")),
    }
}

/// Computes the table. Rows begin with their kind: 0 an error, 1 a smallest K, 2 the equivalent K, 3 a missing motion.
fn computed(run: &Run, jobs: usize) -> Result<Table, String> {
    let cases: Vec<(usize, f64)> = PUBLISHED.iter().flat_map(|(beta, _)| [(0, *beta), (1, *beta)]).collect();
    let compared = in_parallel(jobs, &cases, |(family, beta)| compared(run, *family, *beta));
    let (mut rows, mut motions): (Table, Vec<(usize, f64, Response)>) = (Vec::new(), Vec::new());
    for (case, found) in cases.iter().zip(compared) {
        let (table, motion) = found?;
        rows.extend(table);
        motions.extend(motion.map(|motion| (case.0, case.1, motion)));
    }
    let of = |beta: f64| motions.iter().filter(|m| m.1 == beta).map(|m| m.2.clone()).collect::<Vec<_>>();
    let wanted: Vec<(f64, f64)> = PUBLISHED.iter().flat_map(|(beta, _)| ACCEPTABLE.map(|e| (*beta, e))).collect();
    let smallest = in_parallel(jobs, &wanted, |(beta, e)| smallest_sharpness(&constants(*beta), &of(*beta), *e));
    for ((beta, acceptable), found) in wanted.iter().zip(smallest) {
        rows.extend(found.map(|(k, error)| vec![1.0, *beta, *acceptable, k, error]));
    }
    let single: Vec<&(usize, f64, Response)> = motions.iter().filter(|m| m.0 == 0).collect();
    if let [first, second] = single[..] {
        let error = smoothing_errors(&constants(first.1), &first.2, &[PUBLISHED[0].1])[0].largest();
        let found = smallest_sharpness(&constants(second.1), std::slice::from_ref(&second.2), error);
        rows.extend(found.map(|(k, error)| vec![2.0, k, error]));
    }
    Ok(rows)
}

fn constants(beta: f64) -> Nondimensional {
    Nondimensional { omega: SPEED, kappa: 1.0, beta, ..Nondimensional::REFERENCE }
}

fn compared(run: &Run, family: usize, beta: f64) -> Result<(Table, Option<Response>), String> {
    let name = FAMILIES[family];
    let point = match start(run, name, beta)? {
        Ok(point) => point,
        Err(fold) => return Ok((vec![vec![3.0, family as f64, beta, fold]], None)),
    };
    let state: [f64; 4] = cycle(&point)?.state(0.0).try_into().map_err(|_| "a cycle has four states".to_string())?;
    let motion = exact_motion(&constants(beta), state).ok_or("the piecewise rotor does not settle")?;
    let wanted = [(2, 1), (3, 1)][family];
    if motion.ratio != Some(wanted) || motion.multiplicity != 1 {
        return Err(format!("at β = {beta} the piecewise rotor leaves {name} for {:?}", motion.ratio));
    }
    let errors = smoothing_errors(&constants(beta), &motion, &TIMES.map(|times| times * beta));
    let row =
        |e: &SmoothingError| vec![0.0, beta, family as f64, e.sharpness, e.radius, e.period, e.lines, motion.error];
    Ok((errors.iter().map(row).collect(), Some(motion)))
}

fn read(table: &[Vec<f64>]) -> Choice {
    let mut choice = Choice::default();
    for row in table {
        match row[..] {
            [0.0, beta, family, sharpness, radius, period, lines, floor] => {
                let family = FAMILIES[usize::from(family > 0.5)];
                let all = &mut choice.comparisons;
                if !all.last().is_some_and(|c| c.beta == beta && c.family == family) {
                    all.push(Comparison { beta, family, errors: Vec::new(), floor });
                }
                if let Some(comparison) = all.last_mut() {
                    comparison.errors.push(SmoothingError { sharpness, radius, period, lines });
                }
            }
            [1.0, beta, acceptable, k, error] => choice.smallest.push([beta, acceptable, k, error]),
            [2.0, k, error] => choice.equivalent = Some([k, error]),
            [3.0, family, beta, fold] => choice.missing.push((FAMILIES[usize::from(family > 0.5)], beta, fold)),
            _ => {}
        }
    }
    choice
}
