//! Reduction of the transitions of a cycle to a few factors with the same multipliers.
//!
//! **Idea.** The flow direction is split off every transition ((1) of [`super::floquet`]), and neighbours are
//! multiplied while their product stays well conditioned ((4) of [`crate::linalg::periodic_schur`]). Each product
//! depends on the previous one, so several cycles, and several pieces of each, run side by side in lanes.
//!
//! **Source.** lust2001; guggenheimer1995.

use super::floquet::Course;
use crate::linalg::lane::{self, Eight, Lane};
use crate::linalg::periodic_schur::{CONDITION, condition, spread};

/// Modulus of a product beyond which, or below the inverse of which, its logarithm is taken.
const FAR: f64 = 1e100;

/// Reduced transitions of a cycle.
#[derive(Clone, Debug, Default)]
pub struct Reduced {
    /// Factors, row-major p×p, p = n - 1 with frames and n without; their product has the multipliers.
    pub factors: Vec<f64>,
    /// Trivial multiplier: its sign …
    pub sign: f64,
    /// … and the logarithm of its modulus. 1 and 0 without frames.
    pub log: f64,
}

/// Number of intervals of courses that can be treated together: at most eight, with equally many transitions, all with
/// frames or all without.
pub(super) fn intervals(courses: &[Course], n: usize) -> Option<usize> {
    let first = courses.first()?;
    let count = first.transitions[0].len().checked_div(n * n)?;
    let alike = |course: &Course| {
        let long = course.transitions.iter().all(|list| list.len() >= count * n * n);
        let fitting = course.frames.is_none_or(|frames| frames.count(n) == count);
        long && fitting && course.frames.is_some() == first.frames.is_some()
    };
    (courses.len() <= Eight::COUNT && count > 0 && courses.iter().all(alike)).then_some(count)
}

/// Reduces up to eight courses at a time; `scale` `[n]` as in [`super::floquet::several`].
pub fn reduced(courses: &[Course], scale: &[f64]) -> Option<Vec<Reduced>> {
    let count = intervals(courses, scale.len())?;
    let framed = courses.first()?.frames.is_some();
    let pieces = Eight::COUNT / courses.len();
    let mut lanes: [Reduced; 8] = Default::default();
    Eight::dispatch(Reduction { courses, scale, pieces, count, framed, lanes: &mut lanes });
    let joined = |pieces: &[Reduced]| Reduced {
        factors: pieces.iter().flat_map(|piece| &piece.factors).copied().collect(),
        sign: pieces.iter().map(|piece| piece.sign).product(),
        log: pieces.iter().map(|piece| piece.log).sum(),
    };
    Some(lanes.chunks(pieces).take(courses.len()).map(joined).collect())
}

struct Reduction<'a, 'b> {
    courses: &'a [Course<'a>],
    scale: &'a [f64],
    /// Number of pieces of a course, in neighbouring lanes.
    pieces: usize,
    /// Number of intervals of a course.
    count: usize,
    framed: bool,
    lanes: &'b mut [Reduced; 8],
}

impl pulp::NullaryFnOnce for Reduction<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        // The usual dimension as a compile-time constant.
        match (self.scale.len(), self.framed) {
            (4, true) => self.carried_out(4, true),
            (n, framed) => self.carried_out(n, framed),
        }
    }
}

impl Reduction<'_, '_> {
    #[inline(always)]
    fn carried_out(self, n: usize, framed: bool) {
        let Reduction { courses, scale, pieces, count, lanes, .. } = self;
        let (p, square, length) = (n - usize::from(framed), n * n, count.div_ceil(pieces));
        let (own, one) = (p * p, Eight::splat(1.0));
        let mut room = vec![Eight::default(); 2 * square + 3 * n + 3 * own];
        let (units, rest) = room.split_at_mut(square);
        let (g, rest) = rest.split_at_mut(square);
        let (left, rest) = rest.split_at_mut(n);
        let (right, rest) = rest.split_at_mut(n);
        let (sums, rest) = rest.split_at_mut(n);
        let (factor, rest) = rest.split_at_mut(own);
        let (product, candidate) = rest.split_at_mut(own);
        for k in 0..square {
            units[k] = Eight::splat(scale[k % n] / scale[k / n]);
        }
        // Lanes beyond the last course or interval contain the identity, without a reflection.
        let neutral: Vec<f64> = (0..square).map(|k| f64::from(u8::from(k % (n + 1) == 0))).collect();
        let still = vec![0.0; n];
        let course_of = |lane: usize| courses.get(lane / pieces);
        let reflection = |lane: usize, t: usize, end: bool| {
            let j = lane % pieces * length + t;
            let frames = course_of(lane).and_then(|course| course.frames).filter(|_| j < count);
            frames.map_or(&still[..], |frames| frames.reflection(if end { (j + 1) % count } else { j }, n))
        };
        let mut from = [&still[..]; 8];
        let mut matrices = [&neutral[..]; 8];
        let (mut trivial, mut bound) = (one, one);
        for t in 0..length {
            for lane in 0..Eight::COUNT {
                let j = lane % pieces * length + t;
                matrices[lane] = match course_of(lane).filter(|_| j < count) {
                    Some(course) => &course.transitions[j % 2][j * square..(j + 1) * square],
                    None => &neutral,
                };
            }
            for k in 0..square {
                lane::intact::<Eight>();
                g[k] = units[k] * Eight::each(|lane| matrices[lane][k]);
            }
            if framed {
                for (side, end) in [(&mut *left, false), (&mut *right, true)] {
                    for lane in 0..Eight::COUNT {
                        from[lane] = reflection(lane, t, end);
                    }
                    for i in 0..n {
                        side[i] = Eight::each(|lane| from[lane][i]);
                    }
                }
                reflect(g, left, right, sums, n);
                trivial = trivial * g[0];
                if !trivial.all(one, |x, _| (x.abs() >= 1.0 / FAR) & (x.abs() < FAR)) {
                    for (x, lane) in trivial.lanes_mut().iter_mut().zip(lanes.iter_mut()) {
                        lane.log += x.abs().ln();
                        *x = x.signum();
                    }
                }
            }
            let first = n - p;
            for i in 0..p {
                for k in 0..p {
                    factor[i * p + k] = g[(i + first) * n + k + first];
                }
            }
            // In few dimensions the condition number itself costs no more than a bound.
            let spread = if p > 3 { spread_of(factor, p) } else { one };
            if t > 0 {
                multiply(factor, product, candidate, p);
                if joins(candidate, spread, &mut bound, p) {
                    product.copy_from_slice(candidate);
                    continue;
                }
                put(product, lanes);
            }
            product.copy_from_slice(factor);
            bound = spread;
        }
        put(product, lanes);
        for (x, lane) in trivial.lanes().iter().zip(lanes) {
            (lane.sign, lane.log) = (x.signum(), lane.log + x.abs().ln());
        }
    }
}

/// (1) of [`super::floquet`]: Q_{j+1}ᵀ g Q_j, except that only the corner of the first row and column is correct.
/// `sums` is workspace for n numbers.
#[inline(always)]
fn reflect(g: &mut [Eight], left: &[Eight], right: &[Eight], sums: &mut [Eight], n: usize) {
    for row in g.chunks_exact_mut(n) {
        let mut sum = row[0] * left[0];
        for k in 1..n {
            sum = sum + row[k] * left[k];
        }
        lane::subtract(sum, left, row);
    }
    for k in 0..n {
        let mut sum = right[0] * g[k];
        for i in 1..n {
            sum = sum + right[i] * g[i * n + k];
        }
        sums[k] = sum;
    }
    g[0] = g[0] - right[0] * sums[0];
    for i in 1..n {
        lane::subtract(right[i], &sums[1..n], &mut g[i * n + 1..]);
    }
}

/// True if a product may replace its factors in every lane. In more than three dimensions `bound` is a bound of its
/// condition from those of the previous product and of the new factor, `spread`; it is updated to that of the product
/// if the product is accepted.
#[inline(always)]
fn joins(product: &[Eight], spread: Eight, bound: &mut Eight, p: usize) -> bool {
    let below = |condition: Eight| condition.all(condition, |x, _| x < CONDITION);
    if p > 3 {
        let mut together = *bound * spread;
        if !below(together) {
            together = conditions_of(product, p);
        }
        *bound = together;
        return below(together);
    }
    // c(F)² of (4) against the square of its bound, without division; out of range the answer is no.
    let f = product;
    let determinant = match p {
        0 => return true,
        1 => f[0],
        2 => f[0] * f[3] - f[1] * f[2],
        _ => {
            let minors = [f[4] * f[8] - f[5] * f[7], f[3] * f[8] - f[5] * f[6], f[3] * f[7] - f[4] * f[6]];
            f[0] * minors[0] - f[1] * minors[1] + f[2] * minors[2]
        }
    };
    let mut sum = f[0] * f[0];
    for entry in &f[1..p * p] {
        sum = sum + *entry * *entry;
    }
    let mean = sum * Eight::splat(1.0 / p as f64);
    let mut power = mean;
    for _ in 1..p {
        power = power * mean;
    }
    power.all(determinant * determinant * Eight::splat(CONDITION * CONDITION), |a, b| a < b)
}

/// c = a b.
#[inline(always)]
fn multiply(a: &[Eight], b: &[Eight], c: &mut [Eight], p: usize) {
    for i in 0..p {
        for k in 0..p {
            let mut sum = a[i * p] * b[k];
            for l in 1..p {
                sum = sum + a[i * p + l] * b[l * p + k];
            }
            c[i * p + k] = sum;
        }
    }
}

/// Bound of κ^(p - 1) in (4) of [`crate::linalg::periodic_schur`].
#[inline(always)]
fn spread_of(factor: &[Eight], p: usize) -> Eight {
    let mut delta2 = Eight::default();
    for i in 0..p {
        for k in 0..=i {
            let mut sum = factor[i] * factor[k];
            for r in 1..p {
                sum = sum + factor[r * p + i] * factor[r * p + k];
            }
            let off = if i == k { sum - Eight::splat(1.0) } else { sum };
            let square = off * off;
            delta2 = delta2 + if i == k { square } else { square + square };
        }
    }
    delta2.map(|delta2| spread(delta2, p))
}

/// c(F) of (4) in every lane. Rarely needed.
#[inline(never)]
fn conditions_of(matrices: &[Eight], p: usize) -> Eight {
    let mut own = vec![0.0; p * p];
    Eight::each(|lane| {
        own.iter_mut().zip(matrices).for_each(|(x, entry)| *x = entry.0[lane]);
        condition(&mut own, p)
    })
}

/// Appends a factor in every lane.
#[inline(never)]
fn put(factor: &[Eight], lanes: &mut [Reduced; 8]) {
    for (k, lane) in lanes.iter_mut().enumerate() {
        lane.factors.extend(factor.iter().map(|entry| entry.0[k]));
    }
}
