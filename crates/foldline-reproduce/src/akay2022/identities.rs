//! Identities satisfied by every cycle and every synchronous response of the rotor, independent of the computation.
//!
//! **Equations.** With U = Σ c_k e^{jkwτ} in the rotating frame:
//!
//!   I1 power    Σ k w (k w + Ω) |c_k|² = 0
//!   I2 torque   m ε Ω² Im c_0 = -2ζ Σ (k w + Ω) |c_k|²
//!   I3 Floquet  ∏ μ = e^{-4ζT}
//!   I4          one multiplier is 1
//!
//! and a synchronous response of radius r under the restoring force g(r) r:
//!
//!   S           r² [ (1 - (1-J_p)Ω² + g(r))² + (2ζΩ)² ] = (mεΩ²)²

use super::rotor::{max_r, parameters};
use foldline::diagram::{Branch, Cycle, Point, Solution};

/// Largest defects of I1, I2, I3 and I4, each relative to the sum of its terms, over all cycles of some branches; and
/// the number of cycles.
pub fn of_cycles<'b>(branches: impl Iterator<Item = &'b Branch>) -> ([f64; 4], usize) {
    let (mut largest, mut count) = ([0.0_f64; 4], 0);
    for point in branches.flat_map(|branch| &branch.points) {
        let Solution::Cycle(cycle) = &point.solution else { continue };
        let defects = of_cycle(point, cycle);
        largest = std::array::from_fn(|i| if defects[i].is_nan() { f64::NAN } else { largest[i].max(defects[i]) });
        count += 1;
    }
    (largest, count)
}

fn of_cycle(point: &Point, cycle: &Cycle) -> [f64; 4] {
    let [w, _, zeta, epsilon, .., m] = parameters(point);
    let [speed, spin, size, v] = averages(cycle);
    let power = (speed + w * spin) / (speed + (w * spin).abs());
    let (left, right) = (m * epsilon * w * w * v, -2.0 * zeta * (spin + w * size));
    let torque = (left - right) / (left.abs() + 2.0 * zeta * (spin.abs() + w * size));
    let product: f64 = point.spectrum.iter().map(|z| z.norm().ln()).sum();
    let floquet = product + 4.0 * zeta * cycle.period;
    let trivial = point.spectrum.iter().map(|z| (z - 1.0).norm()).fold(f64::INFINITY, f64::min);
    [power.abs(), torque.abs(), floquet.abs(), trivial]
}

/// Means over a cycle, by Gauss quadrature: |U'|² = Σ (k w)²|c_k|², u v' - v u' = Σ k w |c_k|², |U|², v.
fn averages(cycle: &Cycle) -> [f64; 4] {
    let scheme = cycle.scheme();
    let mut sums = [0.0; 4];
    for (j, interval) in cycle.profile.chunks_exact(4 * (cycle.degree + 1)).enumerate() {
        let h = cycle.mesh[j + 1] - cycle.mesh[j];
        for (x, b) in interval[4..].chunks_exact(4).zip(&scheme.weights) {
            let [u, v, du, dv] = [x[0], x[1], x[2], x[3]];
            for (sum, value) in sums.iter_mut().zip([du * du + dv * dv, u * dv - v * du, u * u + v * v, v]) {
                *sum += h * b * value;
            }
        }
    }
    sums
}

/// Largest defect of the closed form over the points of a branch of synchronous responses, as an error of r: the
/// residual over the forcing and the steepness of the left side.
pub fn of_synchronous(branch: &Branch) -> f64 {
    let defect = |point: &Point| {
        let [w, kappa, zeta, epsilon, gamma, beta, k, j_p, m] = parameters(point);
        let r = max_r(point);
        let switch = 0.5 * ((k * (r - 1.0)).tanh() + 1.0);
        let g = (1.0 - kappa) * gamma * r * r + kappa * switch * beta * (1.0 - 1.0 / r);
        let force = m * epsilon * w * w;
        let left = r * ((1.0 - (1.0 - j_p) * w * w + g).powi(2) + (2.0 * zeta * w).powi(2)).sqrt();
        // The switch makes the force steeper by about β K/2 next to contact.
        let steep = r * (beta + gamma * r * r) + 2.0 * beta * k * kappa * switch * (1.0 - switch);
        (left - force).abs() / (force + 1.0 + steep)
    };
    branch.points.iter().map(defect).max_by(f64::total_cmp).unwrap_or(f64::NAN)
}
