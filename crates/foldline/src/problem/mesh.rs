//! Meshes: redistribution and transfer.
//!
//! **Equations.** With e_j the estimated error on interval j (see [`super::defect`]), which behaves like h_j^{m+1}
//! where the solution is smooth:
//!
//!   (1)  N = Σ_j e_j^{1/(m+1)} / ε^{1/(m+1)}             intervals that make all e_j equal to ε
//!
//! **Source.** deboor1973; ascher1995, §9.

use super::gauss::Scheme;
use crate::diagram::{Cycle, Mesh};
use crate::linalg::lane::{Eight, Lane as _};

/// Number of intervals permitted for any number of states; see [`largest`].
pub const LARGEST: usize = 4000;
/// Number of intervals never exceeded: a burst of some hundred spikes, of thirty intervals each, takes half of it.
const MOST: usize = 20_000;
/// Memory, in bytes, of the matrices of the intervals within which more than [`LARGEST`] are permitted.
const MEMORY: usize = 256 << 20;
const SMALLEST: usize = 6;
/// Ratio of the lengths of neighbouring intervals below which the shorter one is a sliver. Empirical: far below the
/// grading of meshes that resolve a layer, so that they stay as they are.
const SLIVER: f64 = 1e-3;

/// Largest permitted number of intervals for n states and degree m. The matrix of an interval has n m rows and n (m + 1)
/// columns.
pub fn largest(n: usize, degree: usize) -> usize {
    let matrix = size_of::<f64>() * n * degree * n * (degree + 1);
    (MEMORY / matrix.max(1)).clamp(LARGEST, MOST)
}

/// Mesh of N equal intervals.
pub fn uniform(intervals: usize) -> Mesh {
    (0..=intervals).map(|j| j as f64 / intervals as f64).collect()
}

/// Mesh with every interval divided into `parts`.
pub fn divided(mesh: &Mesh, parts: usize) -> Mesh {
    let mut out = Vec::with_capacity(parts * mesh.len());
    for pair in mesh.windows(2) {
        out.extend((0..parts).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / parts as f64));
    }
    out.push(1.0);
    out.into()
}

/// Mesh with 1.5 times as many intervals everywhere. If the second half of `mesh` is a copy of the first, this remains
/// so.
pub fn denser(mesh: &Mesh) -> Mesh {
    let thicker = |nodes: &[f64]| -> Vec<f64> {
        let count = nodes.len() - 1;
        let wanted = (3 * count).div_ceil(2);
        let node = |k: usize| {
            let (j, rest) = (k * count / wanted, k * count % wanted);
            let next = nodes[(j + 1).min(count)];
            nodes[j] + (next - nodes[j]) * rest as f64 / wanted as f64
        };
        (0..=wanted).map(node).collect()
    };
    if !in_halves(mesh) {
        return thicker(mesh).into();
    }
    let mut first = thicker(&mesh[..=(mesh.len() - 1) / 2]);
    let second: Vec<f64> = first[1..].iter().map(|t| 0.5 + t).collect();
    first.extend(second);
    first.into()
}

/// Mesh on which every interval would have an error of about `target`, nowhere coarser than the share `kept` of the
/// density of `mesh`. `None` if more than `most` intervals were needed.
pub fn equidistributed(
    errors: &[f64],
    mesh: &Mesh,
    (degree, most): (usize, usize),
    target: f64,
    kept: f64,
) -> Option<Mesh> {
    let count = errors.len();
    let power = 1.0 / (degree as f64 + 1.0);
    let raw: Vec<f64> = (0..count).map(|j| (errors[j] / target).powf(power) / (mesh[j + 1] - mesh[j])).collect();
    let mean: f64 = (0..count).map(|j| raw[j] * (mesh[j + 1] - mesh[j])).sum();
    // A lower bound and a glance at the neighbours keep the mesh from tearing where the estimate happens to vanish, and
    // leave room for a layer to move. Fine parts are coarsened only gradually, because a layer may return.
    // The density of a sliver, as between two switchings, is mostly rounding over its length. It takes no more intervals
    // next to it than it has itself, and one for it to move there.
    let length = |j: usize| mesh[j + 1] - mesh[j];
    let there = |j: usize, other: usize| match length(other) < SLIVER * length(j) {
        true => (raw[other] * length(other) + 1.0) / length(j),
        false => raw[other],
    };
    let beside = |j: usize, k: usize| there(j, (j + k) % count).max(there(j, (j + count - k) % count));
    let density: Vec<f64> = (0..count)
        .map(|j| {
            let around = raw[j].max(0.8 * beside(j, 1)).max(0.6 * beside(j, 2 % count));
            around.max(0.1 * mean).max(kept / (mesh[j + 1] - mesh[j]))
        })
        .collect();
    let total: f64 = (0..count).map(|j| density[j] * (mesh[j + 1] - mesh[j])).sum();
    if !(total.is_finite() && total <= most as f64) {
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

/// Equidistributed mesh whose second half is a copy of the first, as in `mesh`, with `limits` for each half; see
/// [`equidistributed`].
pub fn equidistributed_in_halves(
    errors: &[f64],
    mesh: &Mesh,
    limits: (usize, usize),
    target: f64,
    kept: f64,
) -> Option<Mesh> {
    let half = errors.len() / 2;
    let worse: Vec<f64> = (0..half).map(|j| errors[j].max(errors[j + half])).collect();
    let stretched: Mesh = mesh[..=half].iter().map(|t| 2.0 * t).collect();
    // Lengths relative to the half are twice those relative to the whole; the errors do not change.
    let first = equidistributed(&worse, &stretched, limits, target, kept)?;
    Some(first.iter().map(|t| 0.5 * t).chain(first[1..].iter().map(|t| 0.5 + 0.5 * t)).collect())
}

/// True if the second half of a mesh is a copy of the first.
pub fn in_halves(mesh: &Mesh) -> bool {
    let half = (mesh.len() - 1) / 2;
    mesh.len() % 2 == 1 && (0..=half).all(|j| (mesh[j] + 0.5 - mesh[j + half]).abs() < 1e-14)
}

/// Mesh whose second half is a copy of the first, with every boundary of `mesh` in both halves, and the errors expected
/// on its intervals if those of `mesh` have `errors`.
pub fn halved(errors: &[f64], mesh: &Mesh, degree: usize) -> (Vec<f64>, Mesh) {
    let mut first: Vec<f64> = mesh.iter().map(|t| if *t < 0.5 { *t } else { t - 0.5 }).collect();
    first.push(0.5);
    first.sort_by(f64::total_cmp);
    first.dedup_by(|b, a| *b - *a < 1e-9);
    let last = first.len() - 1;
    (first[0], first[last]) = (0.0, 0.5);
    let whole: Mesh = first.iter().copied().chain(first[1..].iter().map(|t| 0.5 + t)).collect();
    let error = |pair: &[f64]| {
        let middle = 0.5 * (pair[0] + pair[1]);
        let j = mesh.partition_point(|t| *t <= middle).clamp(1, errors.len()) - 1;
        errors[j] * ((pair[1] - pair[0]) / (mesh[j + 1] - mesh[j])).powi(degree as i32 + 1)
    };
    (whole.windows(2).map(error).collect(), whole)
}

/// True if two meshes have the same boundaries.
pub fn same(a: &Mesh, b: &Mesh) -> bool {
    std::sync::Arc::ptr_eq(a, b) || crate::linalg::same(a, b)
}

/// Interpolation from one mesh to another.
#[derive(Clone, Debug)]
pub struct Passage {
    from: Mesh,
    to: Mesh,
    degree: usize,
    /// Old interval that contains each node of the new mesh …
    within: Vec<usize>,
    /// … and weights of the nodes of that interval, `[N (m + 1)][m + 1]`.
    weights: Vec<f64>,
}

impl Passage {
    /// Interpolation of polynomials of the given scheme.
    pub fn new(scheme: &Scheme, from: &Mesh, to: &Mesh) -> Passage {
        let nodes = scheme.degree + 1;
        let count = (to.len() - 1) * nodes;
        let (mut within, mut weights) = (Vec::with_capacity(count), vec![0.0; count * nodes]);
        let places = to.windows(2).flat_map(|pair| scheme.nodes.iter().map(move |c| pair[0] + (pair[1] - pair[0]) * c));
        let mut j = 0;
        for (t, own) in places.zip(weights.chunks_exact_mut(nodes)) {
            while j + 2 < from.len() && from[j + 1] <= t {
                j += 1;
            }
            within.push(j);
            scheme.weigh((t - from[j]) / (from[j + 1] - from[j]), own);
        }
        Passage { from: from.clone(), to: to.clone(), degree: scheme.degree, within, weights }
    }

    /// True if this interpolates between these two meshes.
    pub fn is_between(&self, from: &Mesh, to: &Mesh) -> bool {
        same(&self.from, from) && same(&self.to, to)
    }

    /// Interpolates a profile of n components, `[interval][node][component]`, to the new mesh.
    pub fn carried(&self, profile: &[f64], n: usize) -> Vec<f64> {
        // Capacity for the scalars that follow a profile.
        let mut out = Vec::with_capacity(self.within.len() * n + 8);
        out.resize(self.within.len() * n, 0.0);
        Eight::dispatch(Carried { passage: self, profile, out: &mut out, n });
        out
    }
}

struct Carried<'a, 'b> {
    passage: &'a Passage,
    profile: &'a [f64],
    out: &'b mut [f64],
    n: usize,
}

impl pulp::NullaryFnOnce for Carried<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        // Common sizes as constants.
        match (self.n, self.passage.degree + 1) {
            (4, 5) => self.fill_in::<4, 5>(),
            (n, nodes) => self.fill(n, nodes),
        }
    }
}

impl Carried<'_, '_> {
    /// [`Carried::fill`] for constant numbers of components and nodes, with the sums in registers.
    #[inline(always)]
    fn fill_in<const N: usize, const NODES: usize>(self) {
        let places = self.passage.within.iter().zip(self.passage.weights.as_chunks::<NODES>().0);
        for (x, (j, weights)) in self.out.as_chunks_mut::<N>().0.iter_mut().zip(places) {
            let own = self.profile[j * NODES * N..(j + 1) * NODES * N].as_chunks::<N>().0;
            let mut sum = [0.0; N];
            for (weight, node) in weights.iter().zip(own) {
                (0..N).for_each(|c| sum[c] += weight * node[c]);
            }
            *x = sum;
        }
    }

    #[inline(always)]
    fn fill(self, n: usize, nodes: usize) {
        let Carried { passage, profile, out, .. } = self;
        let places = passage.within.iter().zip(passage.weights.chunks_exact(nodes));
        for (x, (j, weights)) in out.chunks_exact_mut(n).zip(places) {
            let own = &profile[j * nodes * n..(j + 1) * nodes * n];
            for k in 0..nodes {
                for c in 0..n {
                    x[c] += weights[k] * own[k * n + c];
                }
            }
        }
    }
}

/// Transfers a periodic profile to another mesh by evaluating its polynomials.
pub fn transferred(profile: &[f64], n: usize, scheme: &Scheme, from: &Mesh, to: &Mesh) -> Vec<f64> {
    Passage::new(scheme, from, to).carried(profile, n)
}

/// The cycle itself or, if it has no mesh, a cycle of this degree on a uniform mesh, with an unknown profile.
pub fn at_least_some(cycle: &Cycle, degree: usize) -> Cycle {
    match cycle.intervals() {
        0 => Cycle { mesh: uniform(20), degree, profile: Vec::new(), ..cycle.clone() },
        _ => cycle.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn sampled(mesh: &Mesh, scheme: &Scheme, f: impl Fn(f64) -> f64) -> Vec<f64> {
        mesh.windows(2)
            .flat_map(|p| scheme.nodes.iter().map(|c| f(p[0] + (p[1] - p[0]) * c)).collect::<Vec<_>>())
            .collect()
    }

    #[test]
    fn halving_a_mesh_keeps_every_boundary() {
        let mesh: Mesh = vec![0.0, 0.2, 0.3, 0.9, 1.0].into();
        assert!(!in_halves(&mesh));
        let (errors, whole) = halved(&[1.0, 2.0, 64.0, 4.0], &mesh, 4);
        assert!(in_halves(&whole), "{whole:?}");
        let expected = [0.0, 0.2, 0.3, 0.4, 0.5, 0.7, 0.8, 0.9, 1.0];
        assert!(whole.len() == 9 && whole.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{whole:?}");
        assert!((errors[0] - 1.0).abs() < 1e-12 && (errors[2] - 64.0 / 6f64.powi(5)).abs() < 1e-12, "{errors:?}");
    }

    #[test]
    fn a_denser_mesh_has_half_as_many_intervals_again_and_keeps_its_halves() {
        let mesh: Mesh = vec![0.0, 0.1, 0.3, 0.7, 1.0].into();
        let expected = [0.0, 0.1 * 2.0 / 3.0, 0.1 + 0.2 / 3.0, 0.3, 0.3 + 0.4 * 2.0 / 3.0, 0.7 + 0.1, 1.0];
        let denser_one = denser(&mesh);
        assert_eq!(denser_one.len(), expected.len());
        assert!(denser_one.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{denser_one:?}");
        let halves: Mesh = vec![0.0, 0.2, 0.4, 0.5, 0.7, 0.9, 1.0].into();
        let denser_two = denser(&halves);
        assert!(in_halves(&denser_two) && denser_two.len() == 11, "{denser_two:?}");
        assert!(denser_two.windows(2).all(|pair| pair[1] > pair[0]));
    }

    #[test]
    fn equidistribution_meets_its_target_where_the_error_has_a_layer() {
        // e_j = h⁵ density(t)⁵ with a sharp peak at t = 0.3.
        let density = |t: f64| 20.0 + 400.0 / (1.0 + (100.0 * (t - 0.3)).powi(2));
        let error = |mesh: &Mesh| -> Vec<f64> {
            mesh.windows(2).map(|p| ((p[1] - p[0]) * density(0.5 * (p[0] + p[1]))).powi(5)).collect()
        };
        let mut mesh = uniform(20);
        for _ in 0..8 {
            mesh = equidistributed(&error(&mesh), &mesh, (4, LARGEST), 1e-3, 0.0).unwrap();
        }
        let worst = error(&mesh).iter().fold(0.0, |m: f64, x| m.max(*x));
        assert!(worst < 2e-3, "{worst}");
        assert!(mesh.len() < 300, "{}", mesh.len());
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

    #[test]
    fn transfer_with_constant_sizes_agrees_with_single_components() {
        let scheme = Scheme::new(4);
        let (a, b) = (uniform(11), divided(&uniform(7), 2));
        let parts = [1.0, 2.0, 3.0, 4.0].map(|k| sampled(&a, &scheme, |t| (k * TAU * t).cos()));
        let together: Vec<f64> = (0..parts[0].len()).flat_map(|at| parts.each_ref().map(|part| part[at])).collect();
        let carried = transferred(&together, 4, &scheme, &a, &b);
        for (c, part) in parts.iter().enumerate() {
            let own = transferred(part, 1, &scheme, &a, &b);
            assert!(carried.iter().skip(c).step_by(4).eq(&own), "component {c}: the same sums in the same order");
        }
    }
}
