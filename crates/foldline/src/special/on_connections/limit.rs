//! Ends of curves of connecting orbits at which the equilibrium stops being a saddle.
//!
//! **Idea.** As eigenvalues approach the imaginary axis, the time spent next to the equilibrium grows without bound, and the
//! curve cannot be followed to its end. It stops close to it. A single real eigenvalue may vanish: the distance from the
//! equilibrium then still decreases like 1/t. Next to a Bogdanov–Takens point the orbit shrinks to the equilibrium, and the curve ends where
//! that point is found.

use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::{Ending, Kind, Point, Solution};
use crate::linalg::{dot, larger, lu};
use num_complex::Complex64;

/// Ratio of the smallest to the largest distance from the axis at which a curve is not followed any further.
const REACHED: f64 = 1e-3;

/// Ratio of the smallest to the largest distance from the axis below which an orbit may be longer than it need be …
const SLOW: f64 = 0.01;
/// … and its length in units of the time constant of that eigenvalue from which on it probably is. At a distance at which
/// terms of second order matter, the constant does not determine the length.
const LONG: f64 = 4.0;

/// The leading rate at a point whose orbit, next to an equilibrium that is nearly a saddle-node, is probably longer than it need be: its ends
/// were placed where the equilibrium was clearly a saddle.
pub fn long(at: &Point, length: f64) -> Option<f64> {
    let sizes = || at.spectrum.iter().map(|z| z.re.abs());
    let (least, largest) = (sizes().fold(f64::INFINITY, f64::min), sizes().fold(0.0, f64::max));
    let real = at.spectrum.iter().any(|z| z.im == 0.0 && z.re.abs() == least);
    (real && least < SLOW * largest && least * length > LONG).then_some(least)
}

/// The end of a curve at a point whose equilibrium has a pair of eigenvalues next to the axis, or with `node` a second real one, if
/// it has.
pub fn reached(at: &Point, node: bool) -> Option<Ending> {
    let mut all: Vec<&Complex64> = at.spectrum.iter().collect();
    all.sort_by(|a, b| a.re.abs().total_cmp(&b.re.abs()));
    let largest = all.last()?.re.abs();
    let least = all.iter().enumerate().find(|(k, z)| node && *k > 0 || z.im != 0.0).map(|(_, z)| z.re.abs())?;
    let why = "an eigenvalue of the equilibrium approaches the imaginary axis, where it ceases to be a saddle";
    (least < REACHED * largest).then(|| Ending::GivenUp(why.into()))
}

/// The end of a curve of homoclinic orbits at a Bogdanov–Takens point, if the orbit has become so small that its error relative to
/// its size is the square root of the tolerance. `free` are both parameters with their scales; the last one is that of the curve.
pub fn at_takens(
    field: &dyn VectorField,
    scales: &[f64],
    free: [(usize, f64); 2],
    tolerance: f64,
    at: &Point,
) -> Option<Ending> {
    /// Largest distance of the point in units of the size of the orbit: both have the same order in ε.
    const NEAR: f64 = 10.0;
    let n = scales.len();
    let extents = at.ranges.get(..n)?.iter().zip(scales).map(|([low, high], scale)| (high - low) / scale);
    let size = extents.fold(0.0, f64::max);
    let Solution::Cycle(orbit) = &at.solution else { return None };
    if size > tolerance.sqrt() {
        return None;
    }
    let start = orbit.state(0.0);
    let (state, parameters) = takens(field, scales, free, &start, &at.parameters)?;
    let apart = state.iter().zip(&start).zip(scales).map(|((a, b), scale)| (a - b).abs() / scale);
    let moved = free.map(|(index, unit)| (parameters[index] - at.parameters[index]).abs() / unit);
    let near = apart.chain(moved).all(|d| d <= NEAR * size);
    near.then(|| Ending::Joined { at: Kind::BogdanovTakens, parameter: parameters[free[1].0] })
}

/// State and parameters of a Bogdanov–Takens point nearby, by Newton's method on f = 0, A q₀ = 0, A q₁ = q₀, ⟨c, q₀⟩ = 1, ⟨c, q₁⟩ = 0.
fn takens(
    field: &dyn VectorField,
    scales: &[f64],
    free: [(usize, f64); 2],
    state: &[f64],
    parameters: &[f64],
) -> Option<(Vec<f64>, Vec<f64>)> {
    const ITERATIONS: usize = 30;
    let (n, k) = (state.len(), parameters.len());
    let size = 3 * n + 2;
    let (mut x, mut at) = (state.to_vec(), parameters.to_vec());
    // A column and a row that border the singular matrix; any serve but for exceptional ones.
    let any = |shift: f64| -> Vec<f64> { (0..n).map(|k| 1.0 + 0.5 * (1.7 * k as f64 + shift).sin()).collect() };
    let (column, row) = (any(0.3), any(1.1));
    let mut vectors: Option<[Vec<f64>; 2]> = None;
    for _ in 0..ITERATIONS {
        let batch = Batch { lanes: 1, states: &x, parameters: Parameters::Shared(&at), times: &[], signs: &[] };
        let (mut f, mut a, mut fp) = (vec![0.0; n], vec![0.0; n * n], vec![0.0; 2 * n]);
        field.linearise(batch, &[free[0].0, free[1].0], &mut f, &mut a, &mut fp);
        // In units of the sizes of states and parameters.
        (0..n * n).for_each(|i| a[i] *= scales[i % n] / scales[i / n]);
        (0..n).for_each(|i| f[i] /= scales[i]);
        (0..2 * n).for_each(|i| fp[i] *= free[i % 2].1 / scales[i / 2]);
        let bent = |q: &[f64], j: usize| -> Vec<f64> {
            let (mut d, mut e) = (vec![0.0; n + k], vec![0.0; n + k]);
            (0..n).for_each(|c| d[c] = q[c] * scales[c]);
            match j.checked_sub(n) {
                None => e[j] = scales[j],
                Some(i) => e[n + free[i].0] = free[i].1,
            }
            let mut out = vec![0.0; n];
            field.directional(batch, &[&d, &e], &mut out);
            out.iter().zip(scales).map(|(x, s)| x / s).collect()
        };
        let [q0, q1] = match vectors.take() {
            Some(known) => known,
            None => {
                let bordered = |right: &[f64], last: f64| -> Option<Vec<f64>> {
                    let own = n + 1;
                    let mut matrix = vec![0.0; own * own];
                    for i in 0..n {
                        matrix[i * own..i * own + n].copy_from_slice(&a[i * n..(i + 1) * n]);
                        (matrix[i * own + n], matrix[n * own + i]) = (column[i], row[i]);
                    }
                    let mut pivots = vec![0; own];
                    lu::factorise(&mut matrix, own, &mut pivots).ok()?;
                    let mut x = [right, &[last]].concat();
                    lu::solve(&matrix, own, &pivots, &mut x, 1);
                    x.truncate(n);
                    Some(x)
                };
                let q0 = bordered(&vec![0.0; n], 1.0)?;
                let q1 = bordered(&q0, 0.0)?;
                [q0, q1]
            }
        };
        let (mut matrix, mut r) = (vec![0.0; size * size], vec![0.0; size]);
        let times = |q: &[f64], i: usize| dot(&a[i * n..(i + 1) * n], q);
        for j in 0..n + 2 {
            let [with_q0, with_q1] = [bent(&q0, j), bent(&q1, j)];
            for i in 0..n {
                matrix[i * size + j] = if j < n { a[i * n + j] } else { fp[i * 2 + j - n] };
                matrix[(n + i) * size + j] = with_q0[i];
                matrix[(2 * n + i) * size + j] = with_q1[i];
            }
        }
        for i in 0..n {
            for j in 0..n {
                matrix[(n + i) * size + n + 2 + j] = a[i * n + j];
                matrix[(2 * n + i) * size + 2 * n + 2 + j] = a[i * n + j];
            }
            matrix[(2 * n + i) * size + n + 2 + i] = -1.0;
            matrix[3 * n * size + n + 2 + i] = row[i];
            matrix[(3 * n + 1) * size + 2 * n + 2 + i] = row[i];
            (r[i], r[n + i], r[2 * n + i]) = (f[i], times(&q0, i), times(&q1, i) - q0[i]);
        }
        (r[3 * n], r[3 * n + 1]) = (dot(&row, &q0) - 1.0, dot(&row, &q1));
        let mut pivots = vec![0; size];
        lu::factorise(&mut matrix, size, &mut pivots).ok()?;
        lu::solve(&matrix, size, &pivots, &mut r, 1);
        (0..n).for_each(|i| x[i] -= scales[i] * r[i]);
        (0..2).for_each(|i| at[free[i].0] -= free[i].1 * r[n + i]);
        let less = |q: &[f64], from: usize| -> Vec<f64> { q.iter().zip(&r[from..]).map(|(q, d)| q - d).collect() };
        vectors = Some([less(&q0, n + 2), less(&q1, 2 * n + 2)]);
        let moved = r[..n + 2].iter().fold(0.0, |m: f64, d| larger(m, d.abs()));
        if !moved.is_finite() {
            return None;
        }
        if moved < 1e-12 {
            return Some((x, at));
        }
    }
    None
}
