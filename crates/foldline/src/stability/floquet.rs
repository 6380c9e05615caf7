//! Floquet multipliers of a cycle.
//!
//! **Idea.** The flow direction is mapped to itself around the cycle exactly, so it is split off. This leaves
//! (n-1)×(n-1) blocks whose product has the non-trivial multipliers. The product is never formed, except for large n
//! (`explicit`).
//!
//! **Equations.** With G_j the transition over interval j and Q_j orthogonal, its first column along x'(t_j) or against
//! it:
//!
//! ```text
//!   (1)  Q_{j+1}ᵀ G_j Q_j = [ g_j  *  ]        ∏ g_j = 1 up to the discretisation: the trivial multiplier
//!                           [  0  S_j ]        multipliers of S_N ⋯ S_1: the others
//!   (2)  log ∏ |μ| = ∫₀ᵀ tr f_x dt             Liouville
//! ```
//!
//! **Source.** lust2001; (2) is Liouville's formula.

use super::explicit;
use super::reduction::{self, Reduced};
use crate::linalg::{dense::MANY, periodic_schur};
use num_complex::Complex64;

/// Error of multipliers stated for rounding, relative to the larger of 1 and their modulus.
pub const ROUNDING: f64 = 1e-9;

/// Floquet multipliers of a cycle.
#[derive(Clone, Debug, Default)]
pub struct Floquet {
    /// The trivial multiplier first, if there is one, then the others by decreasing modulus.
    pub multipliers: Vec<Complex64>,
    /// Number of non-trivial multipliers outside the unit circle.
    pub unstable: usize,
    /// log of the product of all moduli; NaN if it was not computed, for several courses with many components.
    pub log_product: f64,
}

/// Data from which the multipliers of one cycle are computed.
#[derive(Clone, Copy)]
pub struct Course<'a> {
    /// `[N]` G_j row-major n×n; those with even j and those with odd j are each read from their own list.
    pub transitions: [&'a [f64]; 2],
    /// Frames along the flow; `None` for a forced cycle, which has no trivial multiplier.
    pub frames: Option<&'a Frames>,
}

/// Multipliers of an autonomous cycle. `transitions`: `[N]` G_j row-major n×n, in the components of the flow from which
/// the frames were built.
pub fn multipliers(transitions: &[f64], frames: &Frames, n: usize) -> Floquet {
    one(Course { transitions: [transitions; 2], frames: Some(frames) }, &vec![1.0; n])
}

/// Multipliers of a forced cycle, none of which is trivial. `transitions`: `[N]` G_j row-major n×n.
pub fn forced(transitions: &[f64], n: usize) -> Floquet {
    one(Course { transitions: [transitions; 2], frames: None }, &vec![1.0; n])
}

/// Multipliers of one course, as computed by [`several`]; NaN if that returns `None`.
pub fn one(course: Course, scale: &[f64]) -> Floquet {
    let unknown =
        || Floquet { multipliers: vec![Complex64::new(f64::NAN, f64::NAN); scale.len()], ..Floquet::default() };
    several([course], scale).map_or_else(unknown, |[found]| found)
}

/// Multipliers of up to eight courses with equally many intervals, all with frames or all without. `scale` `[n]` are
/// the sizes of the components, in which the flow direction of the frames is measured. `None` if there are more courses
/// or transitions are missing.
pub fn several<const K: usize>(courses: [Course; K], scale: &[f64]) -> Option<[Floquet; K]> {
    let n = scale.len();
    if n >= MANY {
        reduction::intervals(&courses, n)?;
        return Some(courses.map(|course| explicit::multipliers(course, scale, K == 1)));
    }
    let mut reduced = reduction::reduced(&courses, scale)?.into_iter();
    Some(courses.map(|course| {
        let trivial = usize::from(course.frames.is_some());
        let Reduced { factors, sign, log } = reduced.next().unwrap_or_default();
        let grouped = periodic_schur::group(&factors, n - trivial);
        let log_others = periodic_schur::log_determinant(&grouped, n - trivial);
        let others = periodic_schur::eigenvalues(&grouped, n - trivial);
        let unstable = others.iter().flatten().filter(|e| e.log_modulus > 0.0).count();
        // The iteration may not converge where multipliers are hundreds of orders of magnitude apart.
        let Some(others) = others else { return explicit::multipliers(course, scale, true) };
        let mut multipliers = vec![Complex64::new(sign * log.exp(), 0.0); trivial];
        multipliers.extend(others.into_iter().map(|e| e.value()));
        Floquet { multipliers, unstable, log_product: log + log_others }
    }))
}

/// Q_j of (1): reflections 1 - v vᵀ whose first columns are parallel or antiparallel to the flow. The sign does not
/// matter, since each occurs twice around the cycle.
#[derive(Clone, Debug)]
pub struct Frames {
    /// `[N][n]`.
    v: Vec<f64>,
}

impl Frames {
    /// Frames along `flow`, `[N][n]` x' at the left ends.
    pub fn along(flow: &[f64], n: usize) -> Frames {
        let mut frames = Frames { v: flow.to_vec() };
        // Small dimensions as compile-time constants.
        match n {
            2 => frames.turn(2),
            3 => frames.turn(3),
            4 => frames.turn(4),
            n => frames.turn(n),
        }
        frames
    }

    /// Replaces directions by the reflections whose first columns are along them.
    #[inline(always)]
    fn turn(&mut self, n: usize) {
        for v in self.v.chunks_exact_mut(n) {
            let norm = product(v, v, n).sqrt();
            for i in 0..n {
                v[i] = if norm > 0.0 { v[i] / norm } else { 0.0 };
            }
            // The reflection takes e_1 to ∓ the direction, with the sign that avoids cancellation.
            v[0] += if v[0] > 0.0 { 1.0 } else { -1.0 };
            let size = product(v, v, n);
            let scale = if size > 0.0 { (2.0 / size).sqrt() } else { 0.0 };
            (0..n).for_each(|i| v[i] *= scale);
        }
    }

    /// Number of frames, of dimension n.
    pub(super) fn count(&self, n: usize) -> usize {
        self.v.len() / n.max(1)
    }

    /// v of Q_j, `[n]`.
    pub(super) fn reflection(&self, j: usize, n: usize) -> &[f64] {
        &self.v[j * n..(j + 1) * n]
    }
}

/// a · b, with a length visible to the compiler.
#[inline(always)]
fn product(a: &[f64], b: &[f64], n: usize) -> f64 {
    let (a, b) = (&a[..n], &b[..n]);
    (0..n).map(|k| a[k] * b[k]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use foldline_general::{Mat, product};

    /// Pseudo-random numbers between -1 and 1.
    fn numbers(count: usize, seed: f64) -> Vec<f64> {
        (0..count)
            .map(|k| 2.0 * ((k * k) as f64 * 0.618 + seed * (1.0 + 0.37 * k as f64)).sin().abs().fract() - 1.0)
            .collect()
    }

    /// Transitions that map a flow around the cycle, `[N]` n×n, and the flow `[N][n]`.
    fn carried(count: usize, n: usize, seed: f64) -> (Vec<f64>, Vec<f64>) {
        let flow = numbers(count * n, 0.3);
        let mut transitions = numbers(count * n * n, seed);
        for j in 0..count {
            let (here, next) = (&flow[j * n..(j + 1) * n], &flow[(j + 1) % count * n..][..n]);
            let size: f64 = here.iter().map(|x| x * x).sum();
            for i in 0..n {
                let row = &mut transitions[(j * n + i) * n..][..n];
                let miss = next[i] - row.iter().zip(here).map(|(g, x)| g * x).sum::<f64>();
                row.iter_mut().zip(here).for_each(|(g, x)| *g += miss * x / size);
            }
        }
        (transitions, flow)
    }

    /// Eigenvalues of the product of the transitions, even ones from one list and odd ones from the other.
    fn reference(transitions: [&[f64]; 2], count: usize, n: usize) -> Vec<Complex64> {
        let of = |j: usize| Mat::from_fn(n, n, |i, k| transitions[j % 2][(j * n + i) * n + k]);
        let all = (1..count).fold(of(0), |before, j| product(&of(j), &before));
        foldline_general::eigenvalues(all.as_ref()).unwrap()
    }

    /// Asserts that both lists contain the same eigenvalues, up to order.
    fn assert_same(found: &[Complex64], expected: &[Complex64], what: &str) {
        assert_eq!(found.len(), expected.len());
        let largest = expected.iter().fold(1.0f64, |m, z| m.max(z.norm()));
        let mut left = found.to_vec();
        for z in expected {
            let distance = |w: &Complex64| (w - z).norm();
            let nearest = (0..left.len()).min_by(|a, b| distance(&left[*a]).total_cmp(&distance(&left[*b]))).unwrap();
            let apart = distance(&left.remove(nearest));
            // Products formed explicitly have the errors of their largest eigenvalue.
            assert!(apart < 1e-11 * largest, "{what}: {z} is {apart} from {found:?}");
        }
    }

    #[test]
    fn several_spectra_agree_with_explicit_products() {
        for (n, count) in [(1, 3), (2, 1), (2, 9), (3, 4), (4, 1), (4, 7), (4, 8), (4, 19), (5, 11), (33, 2), (36, 3)] {
            let ((own, flow), (other, _)) = (carried(count, n, 0.45), carried(count, n, 1.9));
            let frames = Frames::along(&flow, n);
            let what = format!("n = {n}, {count} intervals");
            let [a, b, c] = [[&*own, &*own], [&*other, &*own], [&*other, &*other]]
                .map(|transitions| Course { transitions, frames: Some(&frames) });
            let found = several([a, b, c], &vec![1.0; n]).unwrap();
            for (found, course) in found.iter().zip([a, b, c]) {
                assert!((found.multipliers[0] - 1.0).norm() < 1e-9, "{what}: {:?}", found.multipliers);
                assert_eq!(found.unstable, found.multipliers[1..].iter().filter(|z| z.norm() > 1.0).count(), "{what}");
                assert_same(&found.multipliers, &reference(course.transitions, count, n), &what);
            }
            // One spectrum in eight pieces, and one without the flow direction.
            assert_same(&one(b, &vec![1.0; n]).multipliers, &reference(b.transitions, count, n), &what);
            assert_same(&forced(&own, n).multipliers, &reference(a.transitions, count, n), &what);
        }
    }

    #[test]
    fn a_failed_spectrum_does_not_affect_the_others() {
        let (n, count) = (4, 12);
        let (own, flow) = carried(count, n, 0.45);
        let (mut broken, mut singular) = (own.clone(), own.clone());
        broken[5 * n * n + 7] = f64::NAN;
        // With a zero transition all multipliers are zero, or could not be computed.
        singular[6 * n * n..7 * n * n].fill(0.0);
        let frames = Frames::along(&flow, n);
        let courses =
            [&own, &broken, &singular, &own].map(|list| Course { transitions: [list; 2], frames: Some(&frames) });
        let [a, b, c, d] = several(courses, &[1.0; 4]).unwrap();
        assert_same(&a.multipliers, &reference([&own; 2], count, n), "beside one that is not a number");
        assert_same(&d.multipliers, &a.multipliers, "twice the same");
        assert!(b.multipliers[1..].iter().all(|z| z.re.is_nan()), "{b:?}");
        assert!(c.unstable == 0 && !c.multipliers[1..].iter().any(|z| z.norm() > 0.0), "{c:?}");
    }

    #[test]
    fn multipliers_do_not_depend_on_the_scales() {
        let (n, count) = (3, 10);
        let (transitions, flow) = carried(count, n, 0.45);
        let scale = [2.0, 0.1, 30.0];
        let measured: Vec<f64> = flow.iter().enumerate().map(|(k, x)| x / scale[k % n]).collect();
        let frames = Frames::along(&measured, n);
        let found = one(Course { transitions: [&transitions; 2], frames: Some(&frames) }, &scale);
        assert!((found.multipliers[0] - 1.0).norm() < 1e-9);
        assert_same(&found.multipliers, &reference([&transitions; 2], count, n), "scaled");
    }

    #[test]
    fn products_far_beyond_the_range_of_numbers_keep_their_logarithm() {
        // Along the flow every transition is the identity; transversally it is 10^40 and 10^-45, forty times.
        let (n, count) = (3, 40);
        let transitions: Vec<f64> = (0..count).flat_map(|_| [1.0, 0.0, 0.0, 0.0, 1e40, 0.0, 0.0, 0.0, 1e-45]).collect();
        let flow: Vec<f64> = (0..count).flat_map(|_| [1.0, 0.0, 0.0]).collect();
        let found = multipliers(&transitions, &Frames::along(&flow, n), n);
        assert_eq!(found.unstable, 1);
        assert!((found.log_product / std::f64::consts::LN_10 + 200.0).abs() < 1e-6, "{}", found.log_product);
        // If the flow itself is stretched, the trivial product temporarily leaves the range of numbers.
        let stretched: Vec<f64> = (0..count).flat_map(|j| [if j < 20 { 1e60 } else { 1e-60 }, 0.0, 0.0, 2.0]).collect();
        let flow: Vec<f64> = (0..count).flat_map(|_| [1.0, 0.0]).collect();
        let found = multipliers(&stretched, &Frames::along(&flow, 2), 2);
        assert!((found.multipliers[0] - 1.0).norm() < 1e-9, "{:?}", found.multipliers);
        assert!((found.log_product - 40.0 * 2f64.ln()).abs() < 1e-9);
    }
}
