//! Correction of transition matrices with many components.
//!
//! **Idea.** Variation of constants, (3) of [`super::correct`], requires several factorisations of a dense matrix per
//! interval. The error of a column of V itself solves the linearised equations, and the factorised matrix of the
//! interval, which is sparse if the field is, solves them: the error estimate of a cycle, (1) and (2) of [`super`],
//! column by column. Eight columns run side by side.
//!
//! **Equations.** With D = V' - h T J V on an interval:
//!
//! ```text
//!   (1)  W(s) = ∫₀ˢ D ds,    Y' = h T J Y + h T J W,  Y(0) = 0       V - W - Y solves the variational equations
//!   (2)  V(1) gains -(W(1) + Y(1))
//! ```

use super::{Course, Sampling};
use crate::linalg::condensed::Condensed;
use crate::linalg::lane::{Eight, Lane, intact};
use std::ops::Range;

/// Corrects transitions like [`super::correct`], for the intervals `piece` of a condensed system, each of which has its
/// own place.
pub fn correct_in_columns(
    sampling: &Sampling,
    system: &Condensed<f64>,
    piece: Range<usize>,
    courses: &mut [Course],
    n: usize,
) {
    let points = sampling.points.len();
    let jacobians: Vec<Sparse> = courses.iter().map(|course| Sparse::of(course, points, n)).collect();
    Eight::dispatch(Columns { sampling, system, piece, courses, jacobians: &jacobians, n });
}

/// Entries of J that are nonzero at some sample point of some interval.
struct Sparse {
    /// Row and column of each entry.
    places: Vec<[usize; 2]>,
    /// `[N][m + 1][entries]`: h T times the entry.
    values: Vec<f64>,
}

impl Sparse {
    fn of(course: &Course, points: usize, n: usize) -> Sparse {
        let count = course.lengths.len();
        let lines = || course.jacobians.chunks_exact(points * count).enumerate();
        let entries: Vec<_> = lines().filter(|(_, line)| line.iter().any(|x| *x != 0.0)).collect();
        let places = entries.iter().map(|(k, _)| [k / n, k % n]).collect();
        let entries = &entries;
        let at = |j: usize, g: usize| entries.iter().map(move |(_, line)| course.lengths[j] * line[g * count + j]);
        let values = (0..count).flat_map(|j| (0..points).flat_map(move |g| at(j, g))).collect();
        Sparse { places, values }
    }

    /// to += sign · h T J x at sample point number `at`, counted over all intervals.
    #[inline(always)]
    fn add_image(&self, at: usize, sign: f64, x: &[Eight], to: &mut [Eight]) {
        let values = &self.values[at * self.places.len()..][..self.places.len()];
        for ([row, column], value) in self.places.iter().zip(values) {
            intact::<Eight>();
            to[*row] = to[*row] + Eight::splat(sign * value) * x[*column];
        }
    }
}

struct Columns<'a, 'b, 'c> {
    sampling: &'a Sampling,
    system: &'a Condensed<f64>,
    piece: Range<usize>,
    courses: &'b mut [Course<'c>],
    jacobians: &'a [Sparse],
    n: usize,
}

impl pulp::NullaryFnOnce for Columns<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Columns { sampling, system, piece, courses, jacobians, n } = self;
        let (points, count) = (sampling.points.len(), piece.len());
        let inner = points - 1;
        let mut room = vec![Eight::default(); n * (2 * inner + 4 * points + 1)];
        let (own, room) = room.split_at_mut(inner * n);
        let (solved, room) = room.split_at_mut(inner * n);
        let (values, room) = room.split_at_mut(points * n);
        let (slopes, room) = room.split_at_mut(points * n);
        let (defect, room) = room.split_at_mut(points * n);
        let (within, gain) = room.split_at_mut(points * n);
        for (place, j) in piece.enumerate() {
            for first in (0..n).step_by(Eight::COUNT) {
                system.inner_columns(j, first, own);
                for g in 0..points {
                    let row = g * points..(g + 1) * points;
                    from_identity(&sampling.values[row.clone()], own, first, &mut values[g * n..(g + 1) * n]);
                    from_identity(&sampling.slopes[row], own, first, &mut slopes[g * n..(g + 1) * n]);
                }
                for (course, jacobian) in courses.iter_mut().zip(jacobians) {
                    defect.copy_from_slice(slopes);
                    for g in 0..points {
                        let own = g * n..(g + 1) * n;
                        jacobian.add_image(place * points + g, -1.0, &values[own.clone()], &mut defect[own]);
                    }
                    combined(&sampling.partial, defect, within, n);
                    combined(&sampling.integrals[inner * points..], defect, gain, n);
                    // The source, then the right-hand sides at the inner nodes.
                    defect.fill(Eight::default());
                    for g in 0..points {
                        let own = g * n..(g + 1) * n;
                        jacobian.add_image(place * points + g, 1.0, &within[own.clone()], &mut defect[own]);
                    }
                    combined(&sampling.sources[..inner * points], defect, solved, n);
                    system.solve_inner_columns(j, solved);
                    combined_onto(&sampling.end[1..], solved, gain);
                    for (k, gain) in gain.iter().enumerate() {
                        for (lane, gain) in gain.lanes().iter().enumerate().take(n - first) {
                            course.gains[(k * n + first + lane) * count + place] = -gain;
                        }
                    }
                }
            }
            courses.iter_mut().for_each(|course| keep_finite(course.gains, count, place));
        }
    }
}

/// Sets the correction of an interval to zero if it is not finite.
fn keep_finite(gains: &mut [f64], count: usize, place: usize) {
    let own = || (place..gains.len()).step_by(count);
    if !own().all(|k| gains[k].is_finite()) {
        own().collect::<Vec<_>>().into_iter().for_each(|k| gains[k] = 0.0);
    }
}

/// Columns from `first` on of the linear combination of the identity at the first node and `others` `[m][n]` at the
/// remaining nodes.
#[inline(always)]
fn from_identity(weights: &[f64], others: &[Eight], first: usize, to: &mut [Eight]) {
    let last = to.len().min(first + Eight::COUNT);
    to.fill(Eight::default());
    (first..last).for_each(|c| to[c].lanes_mut()[c - first] = weights[0]);
    combined_onto(&weights[1..], others, to);
}

/// Linear combinations of parts of n numbers, one for each row of weights.
#[inline(always)]
fn combined(weights: &[f64], parts: &[Eight], to: &mut [Eight], n: usize) {
    for (row, to) in weights.chunks_exact(parts.len() / n).zip(to.chunks_exact_mut(n)) {
        to.fill(Eight::default());
        combined_onto(row, parts, to);
    }
}

/// Adds a linear combination of equally long parts.
#[inline(always)]
fn combined_onto(weights: &[f64], parts: &[Eight], to: &mut [Eight]) {
    for (weight, part) in weights.iter().zip(parts.chunks_exact(to.len())) {
        for (to, x) in to.iter_mut().zip(part) {
            intact::<Eight>();
            *to = *to + Eight::splat(*weight) * *x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::dense::MANY;
    use crate::problem::gauss::Scheme;
    use foldline_general::{Mat, product};

    /// exp(A), from its power series.
    fn exponential(a: &Mat<f64>) -> Mat<f64> {
        let n = a.nrows();
        let mut term = Mat::<f64>::identity(n, n);
        let mut sum = term.clone();
        for k in 1..30 {
            let next = product(&term, a);
            term = Mat::from_fn(n, n, |i, j| next[(i, j)] / f64::from(k));
            sum = Mat::from_fn(n, n, |i, j| sum[(i, j)] + term[(i, j)]);
        }
        sum
    }

    #[test]
    fn many_columns_are_corrected_as_well_as_by_variation_of_constants() {
        // A number of columns that is not a multiple of eight, with coupled neighbours.
        let (n, h) = (MANY + 3, 0.7);
        let scheme = Scheme::new(4);
        let (m, sampling) = (scheme.degree, Sampling::new(&scheme));
        let entry = |c: usize, d: usize| if c.abs_diff(d) < 2 { ((3 * c + 5 * d) as f64).sin() } else { 0.0 };
        let exact = exponential(&Mat::from_fn(n, n, |c, d| h * entry(c, d)));
        for pattern in [vec![true; n * n], (0..n * n).map(|k| (k / n).abs_diff(k % n) < 2).collect::<Vec<bool>>()] {
            let mut system = Condensed::<f64>::new(n, &scheme.end, 1);
            system.couple(&pattern);
            system.resize(1);
            system.clear(0);
            let inner = m * n;
            for (c, i) in (0..n).flat_map(|c| (0..m).map(move |i| (c, i))) {
                let row = system.slot(i, c);
                system.coupling[row * (n + 1) + c] = -1.0;
                for (d, k) in (0..n).flat_map(|d| (0..m).map(move |k| (d, k))).filter(|(d, _)| pattern[c * n + d]) {
                    let column = system.slot(k, d);
                    let unit = f64::from(u8::from(row == column));
                    system.interior[row * inner + column] = unit - h * scheme.integration[i * m + k] * entry(c, d);
                }
            }
            system.condense().unwrap();
            let mut before = vec![0.0; n * n];
            system.transition(0, &mut before);
            let jacobians: Vec<f64> = (0..n * n).flat_map(|k| vec![entry(k / n, k % n); m + 1]).collect();
            let [mut own, mut other] = [(); 2].map(|()| vec![f64::NAN; n * n]);
            let course = Course { jacobians: &jacobians, lengths: &[h], gains: &mut own };
            correct_in_columns(&sampling, &system, 0..1, &mut [course], n);
            let mut nodes = vec![0.0; m * n * n];
            system.inner(0..1, 1, &mut nodes);
            let course = Course { jacobians: &jacobians, lengths: &[h], gains: &mut other };
            super::super::correct(&sampling, &nodes, &mut [course], n);
            let error = |gains: &[f64]| {
                (0..n * n).map(|k| (before[k] + gains[k] - exact[(k / n, k % n)]).abs()).fold(0.0, f64::max)
            };
            let [plain, columns, constants] = [&vec![0.0; n * n], &own, &other].map(|gains| error(gains));
            assert!(plain > 1e-9 && columns < 0.15 * plain, "{plain:e}, {columns:e}, {constants:e}");
            assert!(constants < 0.15 * plain, "{plain:e}, {constants:e}");
        }
    }
}
