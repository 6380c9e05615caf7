//! Cost of a Newton iteration and of the examination of a point as functions of the size of the problem.

use super::chain;
use crate::report::{Table, digits, time};
use crate::workplace::Workplace;
use crate::{Outcome, clock, rotor};
use foldline::contract::ZeroProblem;
use foldline::diagram::{Branch, Point, Solution};
use foldline::explore::System;
use foldline::problem::mesh;

/// Returns the times in seconds of one Newton iteration (residual, Jacobian, factorisation, solution) and of the
/// examination of a point (multipliers, error estimate, extrema), on a uniform mesh.
pub fn measured(system: &System, point: &Point, free: usize, intervals: usize) -> Outcome<(f64, f64)> {
    let (mut problem, mut u) = rotor::on_mesh(system, point, free, &mesh::uniform(intervals))?;
    let size = u.len();
    let (mut r, mut du, mut row) = (vec![0.0; size], vec![0.0; size], vec![0.0; size]);
    row[size - 1] = 1.0;
    // Converges first to the cycle on this mesh, so that repeated iterations stay there.
    for _ in 0..4 {
        iterate(&mut problem, &mut u, &row, &mut r, &mut du)?;
    }
    let newton = clock::best(|| {
        let _ = iterate(&mut problem, &mut u, &row, &mut r, &mut du);
    });
    let examination = clock::best(|| {
        problem.examine(&u);
    });
    Ok((newton, examination))
}

/// Returns the time in seconds of the Newton iterations of a branch alone. Iterations with a new matrix and those with
/// a kept one are timed separately at each point on its mesh.
pub fn newton_of(system: &System, branch: &Branch, free: usize) -> Outcome<f64> {
    let mut total = 0.0;
    for point in branch.points.iter().filter(|point| point.position != 0) {
        let Solution::Cycle(cycle) = &point.solution else { return Err("no cycle".into()) };
        let (mut problem, mut u) = rotor::on_mesh(system, point, free, &cycle.mesh)?;
        let size = u.len();
        let (mut r, mut du, mut row) = (vec![0.0; size], vec![0.0; size], vec![0.0; size]);
        row[size - 1] = 1.0;
        let fresh = clock::best(|| {
            let _ = iterate(&mut problem, &mut u, &row, &mut r, &mut du);
        });
        let kept = clock::best(|| {
            problem.residual(&u, &mut r);
            r[size - 1] = 0.0;
            problem.solve(&r, &mut du);
        });
        let new = point.cost.factorisations.min(point.cost.newton);
        total += new as f64 * fresh + (point.cost.newton - new) as f64 * kept;
    }
    Ok(total)
}

fn iterate(problem: &mut dyn ZeroProblem, u: &mut [f64], row: &[f64], r: &mut [f64], du: &mut [f64]) -> Outcome<()> {
    let last = r.len() - 1;
    problem.residual(u, r);
    // Keeps the parameter fixed.
    r[last] = 0.0;
    problem.factorise(u, row).map_err(|_| "singular matrix")?;
    problem.solve(r, du);
    u.iter_mut().zip(&*du).for_each(|(u, d)| *u -= d);
    Ok(())
}

/// Measures the rotor on 50 to 3200 intervals.
pub fn intervals(place: &Workplace) -> Outcome<String> {
    let study = rotor::study(place, rotor::SINGLE_LOOP)?;
    let system = System::of_plan(&study.model, &study.plan);
    let starts = rotor::beginnings(&study);
    let point = rotor::first(&starts.branches[0])?;
    let counts = [50, 100, 200, 400, 800, 1600, 3200];
    let mut table = Table::new(&["intervals", "Newton iteration", "per interval", "examination of a point"]);
    let (mut newton, mut all) = (Vec::new(), Vec::new());
    for count in counts {
        let (iteration, examination) = measured(&system, point, rotor::OMEGA, count)?;
        table.row(&[count.to_string(), time(iteration), time(iteration / count as f64), time(examination)]);
        newton.push(iteration);
        // A point needs about three iterations and one examination.
        all.push(3.0 * iteration + examination);
    }
    let x = counts.map(|count| count as f64);
    Ok(format!(
        "Cubic rotor, 4 states, degree 4.\n\n{}\nFitted exponent: {:.3} of an iteration, {:.3} of a point (three iterations \
         and an examination); {:.2} and {:.2} between the two largest.\n",
        table.text(),
        clock::exponent(&x, &newton),
        clock::exponent(&x, &all),
        clock::exponent(&x[5..], &newton[5..]),
        clock::exponent(&x[5..], &all[5..])
    ))
}

/// Numbers of states of the chain.
pub const STATES: [usize; 5] = [4, 8, 16, 32, 64];

/// Measures the chain with 4 to 64 states on 100 intervals.
pub fn states(_place: &Workplace) -> Outcome<String> {
    let mut table = Table::new(&["states n", "Newton iteration", "over n³", "examination of a point"]);
    let (mut times, mut all) = (Vec::new(), Vec::new());
    for n in STATES {
        let model = chain::model(n)?;
        let system = System::of(&model, &model.defaults());
        let point = chain::cycle(&model, &system)?;
        let (iteration, examination) = measured(&system, &point, 0, 100)?;
        table.row(&[
            n.to_string(),
            time(iteration),
            format!("{} ns", digits(1e9 * iteration / (n * n * n) as f64)),
            time(examination),
        ]);
        times.push(iteration);
        all.push(3.0 * iteration + examination);
    }
    let x = STATES.map(|n| n as f64);
    Ok(format!(
        "Chain of n/2 coupled van der Pol oscillators, 100 intervals, degree 4.\n\n{}\nFitted exponent: {:.2} of an \
         iteration, {:.2} of a point (three iterations and an examination); {:.2} and {:.2} between the two longest.\n",
        table.text(),
        clock::exponent(&x, &times),
        clock::exponent(&x, &all),
        clock::exponent(&x[3..], &times[3..]),
        clock::exponent(&x[3..], &all[3..])
    ))
}
