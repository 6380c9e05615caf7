//! Error estimate of a collocation solution.
//!
//! **Idea.** The polynomial satisfies the differential equation at the Gauss points. Its defect in between is measured
//! at one more point per interval, interlaced with them. The integral of the defect within an interval is the local
//! error; its integral over whole intervals, propagated by the linearised equations, is its effect on the cycle as a
//! whole. Unlike estimates from high derivatives, this also detects a kink or a layer that the mesh has not resolved
//! yet.
//!
//! **Equations.** d(s) = U'(s) - h T f(U(s)) on an interval, s ∈ [0, 1]:
//!
//!   (1)  local error   w(s) = ∫₀ˢ d ds           (largest at the Gauss points, where d vanishes)
//!   (2)  v' = h T J v + h T J w                  error of the cycle beyond w, continuous except for jumps by w(1)
//!
//! d is integrated through its values at the m + 1 collocation points of the next degree, exactly for its leading term.
//! Within an interval w(1) and the source of (2) are of the same, higher order. The source, h T (f(U + w) - f(U)), is
//! projected onto the polynomials that collocation at the Gauss points integrates, so that (2) has the matrix of the
//! cycle itself.
//!
//! **Source.** The role of the defect: enright2000.

mod columns;
pub use columns::correct_in_columns;

use super::gauss::Scheme;
use crate::contract::{Batch, Parameters, VectorField};

use crate::linalg::lane::{self, Eight, Lane, intact};
use crate::linalg::{axpy, lu, panel, tile};

/// Sample points of the defect, and weights for its integration.
#[derive(Clone, Debug)]
pub struct Sampling {
    /// `[m + 1]` sample points.
    points: Vec<f64>,
    /// `[m + 1][m + 1]` values at the sample points from values at the nodes.
    values: Vec<f64>,
    /// `[m + 1][m + 1]` derivatives at the sample points from values at the nodes.
    slopes: Vec<f64>,
    /// `[m + 1][m + 1]`: integral to each Gauss point, and to 1.
    integrals: Vec<f64>,
    /// `[m + 1][m + 1]`: integral to each sample point.
    partial: Vec<f64>,
    /// `[m + 1][m + 1]`: right-hand sides of the collocation equations from a source at the sample points, then its
    /// integral.
    sources: Vec<f64>,
    /// `[m + 1]`: value at the right end from values at the nodes.
    end: Vec<f64>,
}

impl Sampling {
    /// Weight of a sample point in the mean over an interval.
    pub fn weight(&self, point: usize) -> f64 {
        let m = self.points.len() - 1;
        self.integrals[m * (m + 1) + point]
    }

    /// `[m + 1]`: integral of the defect to a sample point, from its values at all of them.
    pub fn shares(&self, point: usize) -> &[f64] {
        let points = self.points.len();
        &self.partial[point * points..(point + 1) * points]
    }

    /// Sampling for a scheme.
    pub fn new(scheme: &Scheme) -> Sampling {
        let m = scheme.degree;
        let (points, weights) = scheme.points.with_weights(m + 1);
        let values = points.iter().flat_map(|&s| scheme.interpolation(s)).collect();
        // p' is a polynomial of degree m - 1 known at the m collocation points.
        let through = |nodes: &[f64], k: usize, s: f64| -> f64 {
            (0..nodes.len()).filter(|&l| l != k).map(|l| (s - nodes[l]) / (nodes[k] - nodes[l])).product()
        };
        let slopes = points
            .iter()
            .flat_map(|&s| {
                let mut line = vec![0.0; m + 1];
                for i in 0..m {
                    axpy(
                        through(&scheme.nodes[1..], i, s),
                        &scheme.derivative[i * (m + 1)..(i + 1) * (m + 1)],
                        &mut line,
                    );
                }
                line
            })
            .collect();
        let to = |c: f64, k: usize| (0..=m).map(|g| c * weights[g] * through(&points, k, c * points[g])).sum::<f64>();
        let to_nodes = scheme.nodes[1..].iter().flat_map(|&c| (0..=m).map(|k| to(c, k)).collect::<Vec<_>>());
        let integrals = to_nodes.chain(weights.iter().copied()).collect();
        let partial = points.iter().flat_map(|&c| (0..=m).map(|k| to(c, k)).collect::<Vec<_>>()).collect();
        // The Lagrange polynomials of the collocation points are orthogonal, with the weights as their squares.
        let inner = &scheme.nodes[1..];
        let projected = |k: usize, g: usize| weights[g] * through(inner, k, points[g]) / scheme.weights[k];
        let line = |i: usize| {
            (0..=m).map(move |g| (0..m).map(|k| scheme.integration[i * m + k] * projected(k, g)).sum::<f64>())
        };
        let sources = (0..m).flat_map(|i| line(i).collect::<Vec<_>>()).chain(weights.iter().copied()).collect();
        Sampling { points, values, slopes, integrals, partial, sources, end: scheme.end.clone() }
    }
}

impl Sampling {
    /// `[m + 1][N]` times of the sample points in forcing periods, of which a cycle lasts `forcing_periods`; empty
    /// without forcing.
    pub fn times(&self, mesh: &[f64], forcing_periods: u32) -> Vec<f64> {
        let points = self.points.iter().take(if forcing_periods > 0 { usize::MAX } else { 0 });
        let of =
            |s: f64| mesh.windows(2).map(move |pair| f64::from(forcing_periods) * (pair[0] + s * (pair[1] - pair[0])));
        points.flat_map(|&s| of(s)).collect()
    }

    /// Evaluates one component at the sample points, `[m + 1][N]`, from its values at the nodes, `[m + 1][N]`.
    pub fn sampled(&self, nodes: &[f64], intervals: usize, out: &mut [f64]) {
        panel::multiply(&self.values, nodes, intervals, out);
    }
}

/// The defect of a profile.
#[derive(Clone, Debug)]
pub struct Defect {
    /// `[N]`: (1), largest component relative to its scale.
    pub local: Vec<f64>,
    /// `[n][m + 1][N]`: w at the sample points.
    pub within: Vec<f64>,
    /// `[N][n]`: w(1).
    pub ends: Vec<f64>,
    /// `[N][m][n]`: right-hand sides of (2) at the Gauss points.
    pub sources: Vec<f64>,
    /// `[N][n]`: w(1) plus the integral of the source, by which the interval misses its right end.
    pub misses: Vec<f64>,
}

/// Number of intervals processed together, so that the data fit into the cache.
pub const TOGETHER: usize = 32;

/// Workspace for intervals processed together.
#[derive(Debug, Default)]
pub struct Room {
    /// `[n][m + 1][count]` at the nodes, then f at the sample points.
    nodes: Vec<f64>,
    /// `[n][m + 1][count]` at the sample points: states, d, and the source of (2).
    states: Vec<f64>,
    defect: Vec<f64>,
    source: Vec<f64>,
    /// `[m + 1][count]` of one component.
    line: Vec<f64>,
}

impl Room {
    /// Resizes for `lanes` entries (m + 1 per interval) of each component.
    fn resize(&mut self, n: usize, lanes: usize) {
        [&mut self.nodes, &mut self.states, &mut self.defect, &mut self.source]
            .into_iter()
            .for_each(|room| room.resize(n * lanes, 0.0));
        self.line.resize(lanes, 0.0);
    }
}

/// Measures the defect of a profile `[interval][node][component]`, which lasts `forcing_periods` (0 for an autonomous
/// field).
pub fn measure(
    field: &dyn VectorField,
    parameters: &[f64],
    profile: &[f64],
    period: f64,
    forcing_periods: u32,
    mesh: &[f64],
    scheme: &Scheme,
    sampling: &Sampling,
    scale: &[f64],
    room: &mut Room,
) -> Defect {
    let (n, m, all) = (scale.len(), scheme.degree, mesh.len() - 1);
    let (block, parameters) = ((m + 1) * n, Parameters::Shared(parameters));
    let [mut local, mut within] = [all, n * (m + 1) * all].map(|size| vec![0.0f64; size]);
    let [mut ends, mut misses, mut sources] = [all * n, all * n, all * m * n].map(|size| vec![0.0; size]);
    for first in (0..all).step_by(TOGETHER) {
        // Intervals are lanes: sample g of interval j is lane g·N + j of the batch, j counting from `first`.
        let count = (all - first).min(TOGETHER);
        let (lanes, mesh) = (count * (m + 1), &mesh[first..=first + count]);
        room.resize(n, lanes);
        let Room { nodes, states, defect, source, line } = room;
        panel::by_component(&profile[first * block..(first + count) * block], m + 1, n, nodes);
        for (own, (states, defect)) in
            nodes.chunks_exact(lanes).zip(states.chunks_exact_mut(lanes).zip(defect.chunks_exact_mut(lanes)))
        {
            panel::multiply(&sampling.values, own, count, states);
            panel::multiply(&sampling.slopes, own, count, defect);
        }
        let (places, f) = (sampling.times(mesh, forcing_periods), nodes);
        field.evaluate(Batch { lanes, states, parameters, times: &places, signs: &[] }, f);
        let times: Vec<f64> = mesh.windows(2).map(|pair| (pair[1] - pair[0]) * period).collect();
        for (d, f) in defect.chunks_exact_mut(count).zip(f.chunks_exact(count)) {
            d.iter_mut().zip(f).zip(&times).for_each(|((d, f), ht)| *d -= ht * f);
        }
        // U + w, then f at that state.
        for (i, (states, defect)) in states.chunks_exact_mut(lanes).zip(defect.chunks_exact(lanes)).enumerate() {
            panel::multiply(&sampling.partial, defect, count, line);
            states.iter_mut().zip(&*line).for_each(|(x, w)| *x += w);
            for (g, w) in line.chunks_exact(count).enumerate() {
                within[(i * (m + 1) + g) * all + first..][..count].copy_from_slice(w);
            }
        }
        field.evaluate(Batch { lanes, states, parameters, times: &places, signs: &[] }, source);
        for (own, f) in source.chunks_exact_mut(count).zip(f.chunks_exact(count)) {
            for ((g, f), ht) in own.iter_mut().zip(f).zip(&times) {
                let change = ht * (*g - f);
                // If U + w is outside the domain of f, that says nothing about the error.
                *g = if change.is_finite() { change } else { 0.0 };
            }
        }
        for (i, (source, defect)) in source.chunks_exact(lanes).zip(defect.chunks_exact(lanes)).enumerate() {
            panel::multiply(&sampling.sources, source, count, line);
            let (inner, whole) = line.split_at(m * count);
            for (k, line) in inner.chunks_exact(count).enumerate() {
                line.iter().enumerate().for_each(|(j, r)| sources[((first + j) * m + k) * n + i] = *r);
            }
            whole.iter().enumerate().for_each(|(j, r)| misses[(first + j) * n + i] = *r);
            panel::multiply(&sampling.integrals, defect, count, line);
            let (inner, whole) = line.split_at(m * count);
            for line in inner.chunks_exact(count) {
                local[first..].iter_mut().zip(line).for_each(|(most, e)| *most = most.max((e / scale[i]).abs()));
            }
            whole.iter().enumerate().for_each(|(j, e)| ends[(first + j) * n + i] = *e);
        }
    }
    misses.iter_mut().zip(&ends).for_each(|(miss, end)| *miss += end);
    Defect { local, within, ends, sources, misses }
}

/// Jacobians along a profile, for the correction of transition matrices.
pub struct Course<'a> {
    /// `[n × n][m + 1][N]`: J at the sample points.
    pub jacobians: &'a [f64],
    /// `[N]`: h T.
    pub lengths: &'a [f64],
    /// `[n × n][N]`: receives the corrections of the transitions V(1), the values of the polynomials at the right ends.
    pub gains: &'a mut [f64],
}

/// Improves the solutions of the variational equations x' = h T J x on all intervals, for several sets of Jacobians.
///
/// `nodes` `[m][n × n][N]` are the values at the inner nodes of the polynomials V, which begin with the identity. With
/// the sample points s_g, their weights w_g and D = V' - h T J V, the error that is subtracted from the transitions is
///
///   (3)  ∫₀¹ V(1) V(s)⁻¹ D(s) ds = V(1) Σ_g w_g V(s_g)⁻¹ D(s_g)
///
/// If V cannot be inverted, the correction is zero.
pub fn correct(sampling: &Sampling, nodes: &[f64], courses: &mut [Course], n: usize) {
    let count = courses.first().map_or(0, |course| course.lengths.len());
    if count >= Eight::COUNT {
        Eight::dispatch(Correction { sampling, nodes, courses, n });
    } else if count > 0 {
        // Fewer than eight intervals: the last one is repeated.
        let filled = |lines: &[f64]| -> Vec<f64> {
            let line = |line: &[f64]| (0..Eight::COUNT).map(|j| line[j.min(count - 1)]).collect::<Vec<f64>>();
            lines.chunks_exact(count).flat_map(line).collect()
        };
        let nodes = filled(nodes);
        for Course { jacobians, lengths, gains } in courses {
            let mut own = filled(gains);
            let course = Course { jacobians: &filled(jacobians), lengths: &filled(lengths), gains: &mut own };
            Eight::dispatch(Correction { sampling, nodes: &nodes, courses: &mut [course], n });
            for (gains, own) in gains.chunks_exact_mut(count).zip(own.chunks_exact(Eight::COUNT)) {
                gains.copy_from_slice(&own[..count]);
            }
        }
    }
}

/// Correction of eight intervals or more.
struct Correction<'a, 'b, 'c> {
    sampling: &'a Sampling,
    nodes: &'a [f64],
    courses: &'b mut [Course<'c>],
    n: usize,
}

impl pulp::NullaryFnOnce for Correction<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        // Common sizes as constants.
        match (self.n, self.sampling.points.len()) {
            (4, 5) => self.corrected(4, 5),
            (n, points) => self.corrected(n, points),
        }
    }
}

impl Correction<'_, '_, '_> {
    #[inline(always)]
    fn corrected(self, n: usize, points: usize) {
        let Correction { sampling, nodes, courses, .. } = self;
        let (square, inner, count) = (n * n, points - 1, nodes.len() / (n * n * (points - 1)));
        let mut room = vec![Eight::default(); square * (3 * points + inner + 2) + points];
        let (values, room) = room.split_at_mut(square * points);
        let (slopes, room) = room.split_at_mut(square * points);
        let (factors, room) = room.split_at_mut(square * points);
        let (own, room) = room.split_at_mut(square * inner);
        let (matrix, room) = room.split_at_mut(square);
        let (right, growth) = room.split_at_mut(square);
        // Sums over g in (3), `[course][n × n]`.
        let mut sums = vec![Eight::default(); square * courses.len()];
        let negative = |weights: &[f64]| -> Vec<Eight> { weights.iter().map(|w| Eight::splat(-w)).collect() };
        let [to_values, to_slopes, to_end] = [&sampling.values, &sampling.slopes, &sampling.end].map(|w| negative(w));
        let weights = &sampling.sources[inner * points..][..points];
        for first in (0..count).step_by(Eight::COUNT) {
            // The last eight may include intervals that were already processed.
            let first = first.min(count - Eight::COUNT);
            for (k, v) in own.iter_mut().enumerate() {
                intact::<Eight>();
                *v = Eight::load(&nodes[k * count + first..]);
            }
            for g in 0..points {
                let (row, at) = (g * points..(g + 1) * points, g * square..(g + 1) * square);
                combined(&to_values[row.clone()], own, &mut values[at.clone()], n);
                combined(&to_slopes[row], own, &mut slopes[at], n);
            }
            factors.copy_from_slice(values);
            factorised(factors, growth, n);
            sums.fill(Eight::default());
            for (course, sum) in courses.iter().zip(sums.chunks_exact_mut(square)) {
                let length = Eight::load(&course.lengths[first..]);
                for g in 0..points {
                    let at = g * square..(g + 1) * square;
                    for (entry, to) in matrix.iter_mut().enumerate() {
                        intact::<Eight>();
                        *to = length * Eight::load(&course.jacobians[(entry * points + g) * count + first..]);
                    }
                    // D, then V⁻¹ D.
                    let value = &values[at.clone()];
                    right.copy_from_slice(&slopes[at.clone()]);
                    tile::subtract(right, n, matrix, n, value, n, [n; 3], [0; 3]);
                    if growth[g].all(growth[g], |growth, _| growth < GROWTH) {
                        tile::forward(right, n, 0, &factors[at.clone()], n, n);
                        tile::backward(right, n, 0, &factors[at], n, 0, n, n);
                    } else {
                        exchanging(value, right, n);
                    }
                    lane::add(Eight::splat(weights[g]), right, sum);
                }
            }
            // V(1) times the sum.
            combined(&to_end, own, matrix, n);
            for (course, sum) in courses.iter_mut().zip(sums.chunks_exact(square)) {
                right.fill(Eight::default());
                tile::subtract(right, n, matrix, n, sum, n, [n; 3], [0; 3]);
                // Zero in lanes in which all gains are finite.
                let mut finite = Eight::default();
                for gain in right.iter() {
                    intact::<Eight>();
                    finite = finite.zip(*gain, |all, x| all + 0.0 * x);
                }
                for (gain, line) in right.iter().zip(course.gains.chunks_exact_mut(count)) {
                    intact::<Eight>();
                    let gain = finite.zip(*gain, |all, x| if all == 0.0 { x } else { 0.0 });
                    line[first..first + Eight::COUNT].copy_from_slice(gain.lanes());
                }
            }
        }
    }
}

/// Linear combination of the identity at the first node and `others` at the remaining nodes, given the negative
/// weights.
#[inline(always)]
fn combined(negative: &[Eight], others: &[Eight], to: &mut [Eight], n: usize) {
    to.fill(Eight::default());
    (0..n).for_each(|c| to[c * (n + 1)] = Eight::default() - negative[0]);
    tile::subtract_combination(to, &negative[1..], others, n * n, 0);
}

/// Largest growth factor of rounding errors, over all pivots, for which a factorisation without row exchanges is used.
const GROWTH: f64 = 1e8;

/// Factorises n×n matrices in every lane without row exchanges: unit lower triangle L below the diagonal, U on and
/// above it, with an inverted diagonal. `growth` receives the growth factor of rounding errors for each of them, at
/// least [`GROWTH`] if a pivot is too small. Contact makes velocities thousands of times as sensitive as positions, so
/// pivots can be small; but a few digits are enough for a correction.
#[inline(always)]
fn factorised(matrices: &mut [Eight], growth: &mut [Eight], n: usize) {
    growth.fill(Eight::splat(1.0));
    // All matrices advance pivot by pivot, so that divisions overlap.
    for k in 0..n {
        for (a, growth) in matrices.chunks_exact_mut(n * n).zip(&mut *growth) {
            let (upper, lower) = a.split_at_mut((k + 1) * n);
            let pivot = &mut upper[k * n + k..];
            let mut largest = pivot[0].map(f64::abs);
            for row in lower.chunks_exact(n) {
                intact::<Eight>();
                largest = largest.zip(row[k], |most, x| most.max(x.abs()));
            }
            let inverse = pivot[0].map(|x| 1.0 / x);
            *growth = *growth * largest * inverse.map(f64::abs);
            for row in lower.chunks_exact_mut(n) {
                row[k] = row[k] * inverse;
                lane::subtract(row[k], &pivot[1..], &mut row[k + 1..]);
            }
            pivot[0] = inverse;
        }
    }
}

/// Solves a x = b lane by lane with row exchanges, x replacing b; NaN if the matrix is singular.
fn exchanging(a: &[Eight], x: &mut [Eight], n: usize) {
    let mut pivots = vec![0; n];
    for lane in 0..Eight::COUNT {
        let mut matrix: Vec<f64> = a.iter().map(|a| a.0[lane]).collect();
        let mut right: Vec<f64> = x.iter().map(|x| x.0[lane]).collect();
        match lu::factorise(&mut matrix, n, &mut pivots) {
            Ok(()) => lu::solve(&matrix, n, &pivots, &mut right, x.len() / n),
            Err(_) => right.fill(f64::NAN),
        }
        x.iter_mut().zip(right).for_each(|(x, value)| x.0[lane] = value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagram::Mesh;

    #[test]
    fn transitions_are_corrected_by_several_digits() {
        // x' = (1 + 2 t) x on [0, 0.4] with one collocation polynomial; the solution is exp(t + t²).
        let scheme = Scheme::new(4);
        let sampling = Sampling::new(&scheme);
        let rate = |s: f64| 0.4 * (1.0 + 0.8 * s);
        let m = scheme.degree;
        let mut matrix: Vec<f64> = (0..m * m)
            .map(|k| f64::from(k / m == k % m) - scheme.integration[k] * rate(scheme.nodes[k % m + 1]))
            .collect();
        let (mut pivots, mut inner) = (vec![0; m], vec![1.0; m]);
        crate::linalg::lu::factorise(&mut matrix, m, &mut pivots).unwrap();
        crate::linalg::lu::solve(&matrix, m, &pivots, &mut inner, 1);
        let end = scheme.end[0] + crate::linalg::dot(&scheme.end[1..], &inner);
        let exact = (0.4f64 + 0.16).exp();
        let before = (end - exact).abs();
        let jacobians: Vec<f64> =
            crate::problem::gauss::Points::Gauss.with_weights(m + 1).0.into_iter().map(|s| rate(s) / 0.4).collect();
        let mut gain = [0.0];
        let course = Course { jacobians: &jacobians, lengths: &[0.4], gains: &mut gain };
        correct(&sampling, &inner, &mut [course], 1);
        let after = (end + gain[0] - exact).abs();
        assert!(before > 1e-9 && after < 0.15 * before, "{before:e} {after:e}");
    }

    #[test]
    fn the_correction_of_an_interval_does_not_depend_on_its_neighbours() {
        let (n, all) = (2, 19);
        let sampling = Sampling::new(&Scheme::new(4));
        let number = |k: usize, size: f64| size * ((k * k + 3 * k + 1) as f64).sin();
        // Values close to the identity.
        let near = |k: usize| f64::from([1, 0, 0, 1][k / all % 4]) + number(k, 0.2);
        let mut nodes: Vec<f64> = (0..4 * n * n * all).map(near).collect();
        let jacobians: [Vec<f64>; 2] = [0.5, 0.9].map(|size| (0..5 * n * n * all).map(|k| number(k, size)).collect());
        let lengths: Vec<f64> = (0..all).map(|j| 0.1 + number(j, 0.05)).collect();
        let of = |nodes: &[f64], piece: std::ops::Range<usize>| -> Vec<f64> {
            let cut = |lines: &[f64]| lines.chunks_exact(all).flat_map(|line| &line[piece.clone()]).copied().collect();
            let own: [Vec<f64>; 4] = [nodes, &jacobians[0], &jacobians[1], &lengths].map(cut);
            let [mut one, mut other] = [(); 2].map(|()| vec![f64::NAN; n * n * piece.len()]);
            let courses = &mut [
                Course { jacobians: &own[1], lengths: &own[3], gains: &mut one },
                Course { jacobians: &own[2], lengths: &own[3], gains: &mut other },
            ];
            correct(&sampling, &own[0], courses, n);
            one.into_iter().chain(other).collect()
        };
        let together = of(&nodes, 0..all);
        assert!(together.iter().all(|gain| gain.abs() > 1e-9), "{together:?}");
        for piece in [0..1, 3..10, 2..18, 18..19] {
            let expected = together.chunks_exact(all).flat_map(|line| line[piece.clone()].to_vec());
            assert_eq!(of(&nodes, piece.clone()), expected.collect::<Vec<f64>>(), "{piece:?}");
        }
        assert!(of(&nodes, 5..5).is_empty());
        // An interval without a transition has no correction, and its neighbours are not affected.
        nodes[5] = f64::NAN;
        for (line, before) in of(&nodes, 0..all).chunks_exact(all).zip(together.chunks_exact(all)) {
            for (j, (gain, before)) in line.iter().zip(before).enumerate() {
                let expected = if j == 5 { 0.0 } else { *before };
                assert!((gain - expected).abs() < 1e-12, "{j}: {gain:e} and {expected:e}");
            }
        }
    }

    #[test]
    fn small_pivots_are_accepted_and_tiny_ones_need_row_exchanges() {
        let lanes = |x: [f64; 4]| x.map(Eight::splat);
        let right = lanes([3.0, 1.0, 4.0, 2.0]);
        for (a, serves) in
            [([1e-5, 1.0, 1.0, 2.0], true), ([1e-9, 1.0, 1.0, 2.0], false), ([0.0, 1.0, 1.0, 2.0], false)]
        {
            let ([mut factors, mut x, mut exchanged], mut growth) = ([lanes(a), right, right], [Eight::default()]);
            factorised(&mut factors, &mut growth, 2);
            assert_eq!(growth[0].all(growth[0], |growth, _| growth < GROWTH), serves);
            exchanging(&lanes(a), &mut exchanged, 2);
            // The product with the matrix must be the right-hand side.
            let apply = |x: &[Eight; 4]| {
                [0, 1, 2, 3].map(|k| a[k / 2 * 2] * x[k % 2].0[7] + a[k / 2 * 2 + 1] * x[2 + k % 2].0[7])
            };
            let near = |x: &[Eight; 4]| apply(x).iter().zip(right).all(|(a, b)| (a - b.0[7]).abs() < 1e-10);
            assert!(near(&exchanged), "{exchanged:?}");
            if serves {
                tile::forward(&mut x, 2, 0, &factors, 2, 2);
                tile::backward(&mut x, 2, 0, &factors, 2, 0, 2, 2);
                assert!(near(&x), "{x:?}");
            }
        }
    }

    /// t' = 1, x' = sin t.
    struct Integral;

    impl VectorField for Integral {
        fn dim(&self) -> usize {
            2
        }
        fn parameter_count(&self) -> usize {
            0
        }
        fn evaluate(&self, at: Batch, f: &mut [f64]) {
            for l in 0..at.lanes {
                f[l] = 1.0;
                f[at.lanes + l] = at.states[l].sin();
            }
        }
        fn linearise(&self, _at: Batch, _free: &[usize], _f: &mut [f64], _fx: &mut [f64], _fp: &mut [f64]) {}
        fn directional(&self, _at: Batch, _directions: &[&[f64]], _out: &mut [f64]) {}
    }

    /// The collocation solution of [`Integral`] over one period, whose right-hand side does not depend on x.
    fn collocated(scheme: &Scheme, mesh: &Mesh, period: f64) -> Vec<f64> {
        let m = scheme.degree;
        let (mut x, mut profile) = (0.0, Vec::new());
        for pair in mesh.windows(2) {
            let h = (pair[1] - pair[0]) * period;
            let time = |c: f64| pair[0] * period + c * h;
            let mut matrix: Vec<f64> =
                scheme.derivative.chunks_exact(m + 1).flat_map(|row| row[1..].to_vec()).collect();
            let mut inner: Vec<f64> =
                (0..m).map(|i| h * time(scheme.nodes[i + 1]).sin() - scheme.derivative[i * (m + 1)] * x).collect();
            let mut pivots = vec![0; m];
            crate::linalg::lu::factorise(&mut matrix, m, &mut pivots).unwrap();
            crate::linalg::lu::solve(&matrix, m, &pivots, &mut inner, 1);
            profile.extend([time(0.0), x]);
            inner.iter().zip(&scheme.nodes[1..]).for_each(|(x, c)| profile.extend([time(*c), *x]));
            x = scheme.end[0] * x + crate::linalg::dot(&scheme.end[1..], &inner);
        }
        profile
    }

    #[test]
    fn the_local_error_has_order_m_plus_one_and_the_end_error_a_higher_one() {
        let scheme = Scheme::new(4);
        let sampling = Sampling::new(&scheme);
        let largest = |v: &[f64]| v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let at = |count: usize| {
            let (mesh, period) = (super::super::mesh::uniform(count), std::f64::consts::TAU);
            let profile = collocated(&scheme, &mesh, period);
            let d = measure(
                &Integral,
                &[],
                &profile,
                period,
                0,
                &mesh,
                &scheme,
                &sampling,
                &[1.0, 1.0],
                &mut Room::default(),
            );
            [largest(&d.local), largest(&d.ends)]
        };
        let (coarse, fine) = (at(10), at(20));
        let [local, ends] = [0, 1].map(|k| (coarse[k] / fine[k]).log2());
        assert!((local - 5.0).abs() < 0.2, "{local}");
        assert!(ends > 8.0, "{ends}");
    }
}
