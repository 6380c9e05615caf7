//! Meshes: error estimate, redistribution, transfer.
//!
//! **Equations.** With h_j the length of interval j and C the error constant of the scheme ([`Scheme::error_constant`]):
//!
//!   (1)  e_j = C h_j^{m+1} max_i |u_i^{(m+1)}| / s_i       estimated error on interval j, s_i the scale of component i
//!   (2)  N   = Σ_j e_j^{1/(m+1)} / ε^{1/(m+1)}             intervals that make all e_j equal to ε
//!
//! u^{(m+1)} is the difference quotient of the piecewise constant u^{(m)} between neighbouring intervals.
//!
//! **Source.** deboor1973; ascher1995, §9.

use super::gauss::Scheme;
use crate::diagram::Mesh;

/// The largest mesh that is tried.
pub const LARGEST: usize = 4000;
const SMALLEST: usize = 6;

/// N equal intervals.
pub fn uniform(intervals: usize) -> Mesh {
    (0..=intervals).map(|j| j as f64 / intervals as f64).collect()
}

/// Every interval cut into `parts`.
pub fn divided(mesh: &Mesh, parts: usize) -> Mesh {
    let mut out = Vec::with_capacity(parts * mesh.len());
    for pair in mesh.windows(2) {
        out.extend((0..parts).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / parts as f64));
    }
    out.push(1.0);
    out.into()
}

/// (1) for every interval of a periodic profile `[interval][node][component]`.
pub fn errors(profile: &[f64], mesh: &Mesh, scheme: &Scheme, scale: &[f64]) -> Vec<f64> {
    let (n, m, count) = (scale.len(), scheme.degree, mesh.len() - 1);
    let factorial: f64 = (1..=m).map(|k| k as f64).product();
    let h: Vec<f64> = mesh.windows(2).map(|p| p[1] - p[0]).collect();
    let mut highest = vec![0.0; count * n];
    for j in 0..count {
        let factor = factorial / h[j].powi(m as i32);
        for (k, w) in scheme.leading.iter().enumerate() {
            let node = &profile[(j * (m + 1) + k) * n..(j * (m + 1) + k + 1) * n];
            crate::linalg::axpy(factor * w, node, &mut highest[j * n..(j + 1) * n]);
        }
    }
    let jump: Vec<f64> = (0..count)
        .map(|j| {
            let next = (j + 1) % count;
            let gap = 0.5 * (h[j] + h[next]);
            let difference = (0..n).map(|i| ((highest[next * n + i] - highest[j * n + i]) / scale[i]).abs()).fold(0.0, f64::max);
            difference / gap
        })
        .collect();
    (0..count)
        .map(|j| {
            let derivative = jump[j].max(jump[(j + count - 1) % count]);
            scheme.error_constant * h[j].powi(m as i32 + 1) * derivative
        })
        .collect()
}

/// A mesh on which every interval would carry about `target`, or `None` if more than [`LARGEST`] intervals were needed.
pub fn equidistributed(errors: &[f64], mesh: &Mesh, degree: usize, target: f64) -> Option<Mesh> {
    let count = errors.len();
    let power = 1.0 / (degree as f64 + 1.0);
    let raw: Vec<f64> = (0..count).map(|j| (errors[j] / target).powf(power) / (mesh[j + 1] - mesh[j])).collect();
    let mean: f64 = (0..count).map(|j| raw[j] * (mesh[j + 1] - mesh[j])).sum();
    // A floor and a look at the neighbours keep the mesh from tearing where the estimate happens to vanish.
    let density: Vec<f64> = (0..count)
        .map(|j| raw[j].max(0.6 * raw[(j + 1) % count]).max(0.6 * raw[(j + count - 1) % count]).max(0.1 * mean))
        .collect();
    let total: f64 = (0..count).map(|j| density[j] * (mesh[j + 1] - mesh[j])).sum();
    if !(total.is_finite() && total <= LARGEST as f64) {
        return None;
    }
    let wanted = (total.ceil() as usize).max(SMALLEST);
    let mut out = Vec::with_capacity(wanted + 1);
    out.push(0.0);
    let (mut j, mut before) = (0, 0.0);
    for k in 1..wanted {
        let level = total * k as f64 / wanted as f64;
        while j + 1 < count && before + density[j] * (mesh[j + 1] - mesh[j]) < level {
            before += density[j] * (mesh[j + 1] - mesh[j]);
            j += 1;
        }
        out.push((mesh[j] + (level - before) / density[j]).min(1.0));
    }
    out.push(1.0);
    Some(out.into())
}

/// A periodic profile carried to another mesh by evaluating its polynomials.
pub fn transferred(profile: &[f64], n: usize, scheme: &Scheme, from: &Mesh, to: &Mesh) -> Vec<f64> {
    let m = scheme.degree;
    let mut out = vec![0.0; (to.len() - 1) * (m + 1) * n];
    let mut j = 0;
    for (l, pair) in to.windows(2).enumerate() {
        for (k, c) in scheme.nodes.iter().enumerate() {
            let t = pair[0] + (pair[1] - pair[0]) * c;
            while j + 2 < from.len() && from[j + 1] <= t {
                j += 1;
            }
            let weights = scheme.interpolation((t - from[j]) / (from[j + 1] - from[j]));
            let x = &mut out[(l * (m + 1) + k) * n..(l * (m + 1) + k + 1) * n];
            for (i, w) in weights.iter().enumerate() {
                crate::linalg::axpy(*w, &profile[(j * (m + 1) + i) * n..(j * (m + 1) + i + 1) * n], x);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn sampled(mesh: &Mesh, scheme: &Scheme, f: impl Fn(f64) -> f64) -> Vec<f64> {
        mesh.windows(2).flat_map(|p| scheme.nodes.iter().map(|c| f(p[0] + (p[1] - p[0]) * c)).collect::<Vec<_>>()).collect()
    }

    #[test]
    fn equidistribution_meets_its_target_on_a_profile_with_a_layer() {
        let scheme = Scheme::new(4);
        let layer = |t: f64| (1.0 / (1.0 + 40.0 * (TAU * t).cos().powi(2))) + (TAU * t).sin();
        let mut mesh = uniform(20);
        for _ in 0..6 {
            let e = errors(&sampled(&mesh, &scheme, layer), &mesh, &scheme, &[1.0]);
            mesh = equidistributed(&e, &mesh, 4, 1e-7).unwrap();
        }
        let e = errors(&sampled(&mesh, &scheme, layer), &mesh, &scheme, &[1.0]);
        let worst = e.iter().fold(0.0, |m: f64, x| m.max(*x));
        assert!(worst < 3e-7, "{worst}");
        assert!(mesh.len() < 200, "{}", mesh.len());
    }

    #[test]
    fn transfer_reproduces_polynomials_exactly_and_smooth_profiles_to_the_order() {
        let scheme = Scheme::new(4);
        let (a, b) = (uniform(30), divided(&uniform(23), 2));
        let there = transferred(&sampled(&a, &scheme, |t| (TAU * t).sin()), 1, &scheme, &a, &b);
        for (x, y) in there.iter().zip(sampled(&b, &scheme, |t| (TAU * t).sin())) {
            assert!((x - y).abs() < 1e-6);
        }
    }
}
