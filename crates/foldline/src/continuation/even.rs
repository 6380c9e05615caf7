//! Branch points of boundary-value problems: pairs on one step, and null spaces of an even dimension.
//!
//! **Idea.** A solution of a boundary-value problem has no spectrum, only one number d, which has the sign of the determinant
//! of F_u and vanishes with its smallest singular value ([`crate::problem::cycle`]). Steps are chosen for the solution, which may be
//! trivial while d oscillates. A step on which the value of d at a quarter differs from that of the parabola through ends and
//! middle is therefore cut, until the pieces resolve d. Where d goes on in a straight line from the step before, nothing is computed.
//!
//! Where an even number of singular values vanish at one point, d touches zero without a change of sign, like |s|. If the values lead
//! to zero, or dip towards it, without a change of sign at the end, the place where |d| is smallest is searched for. Either it
//! vanishes there; or it changes its sign, and two branch points are close together; or it stays away from zero, and the crossing
//! is imperfect.
//!
//! **Equations.** For an oscillation by the angle θ on a step, the parabola is off at a quarter by at most
//!
//! ```text
//!   (1)  θ³/128
//! ```
//!
//! of the amplitude. A bound of 1/75 means θ < 1.2: no two zeros of an oscillation, π apart, lie on one piece, nor a zero and the
//! extremum π/2 beside it.
//!
//! **Fails when** the right-hand side of d hardly excites the null vectors, so that the corner is a narrow dip; or an odd number of at
//! least three vanish: the point is then found, but not all branches that leave it.

use super::follow::Follow;
use super::inspect::History;
use super::locate::{Located, Stretch};
use super::opposite::Exchange;
use crate::contract::Sight;
use crate::diagram::{Cost, Kind, Point, Solution};

/// Share of the larger value at the ends that counts as zero: the accuracy of a located point, relative to a step, with a factor of
/// safety.
const NOTHING: f64 = 1e-6;
/// Largest difference of d at a quarter of a step from the parabola, in sizes of d; see (1).
const RESOLVED: f64 = 1.0 / 75.0;
/// Relative Newton correction with which d is known well enough for (1).
const ROUGH: f64 = 1e-3;
/// Largest second difference of d over two steps, in sizes of d, that leaves no doubt. For an oscillation it is the square of the
/// angle θ of a step: 0.22, from which no single growth of the step leads to an angle that is not resolved.
const STRAIGHT: f64 = 0.05;
/// Number of halvings of the beginning of a first step.
const FIRST: usize = 3;
/// Share of the smaller end below which a parabola dips towards zero.
const DIP: f64 = 0.1;
/// Share of the larger end below which the middle value may lie next to a zero at the other end: sin(θ/2)/sin θ = 0.61 for the
/// longest resolved piece of an oscillation that begins at the zero, θ = 1.2, and some more for other curves.
const LEADS: f64 = 0.7;
/// Place, from either end, at which it is seen whether d falls towards the other end: far enough for the difference to exceed
/// rounding, so near that hardly any zero lies between.
const BESIDE: f64 = 1e-4;
/// Largest number of halvings of the step: to rounding.
const HALVINGS: usize = 36;
/// Largest slope of d, in mean slopes of the halves of a step.
const STEEP: f64 = 8.0;
/// Share of an interval over which the sense of d is seen.
const NEXT: f64 = 0.02;

/// d at a point of a boundary-value problem, and the determinant of F_u in its size: d over the slope of the parameter along the
/// branch, which vanishes at folds.
#[derive(Clone, Copy)]
pub(super) struct Degeneracy {
    d: f64,
    determinant: f64,
}

impl Degeneracy {
    /// `None` if the problem is of another kind.
    pub(super) fn of(point: &Point) -> Option<Degeneracy> {
        let (Solution::Cycle(cycle), [z]) = (&point.solution, &point.spectrum[..]) else { return None };
        let (d, slope) = (1.0 - z.re, point.parameter_slope());
        let determinant = d / slope.abs().max(f64::MIN_POSITIVE).copysign(slope);
        let several = cycle.degree > 0 && cycle.dim() > 1;
        (several && determinant.is_finite()).then_some(Degeneracy { d, determinant })
    }
}

impl Follow<'_> {
    /// Searches a step of a boundary-value problem for what its ends do not show; see the module.
    pub(super) fn touching(
        &mut self,
        stretch: &Stretch,
        right: &Point,
        history: Option<&History>,
        depth: usize,
        cost: &mut Cost,
    ) -> Option<Exchange> {
        let (ends, length) = ([Degeneracy::of(&stretch.left.point)?, Degeneracy::of(right)?], stretch.length);
        // The length of a first step is a guess.
        if history.is_none() && depth < FIRST {
            self.resolved = self.resolved.min(0.5 * length.abs());
            return Some(Exchange::Apart(0.5 * length));
        }
        if history.is_some_and(|before| continues(before, ends, length)) {
            return None;
        }
        let [quarter, middle] = [0.25, 0.5].map(|share| {
            let found = stretch.nearly_at(ROUGH, self.problem, share * length, cost).ok()?;
            Degeneracy::of(&found.point)
        });
        let (quarter, middle) = (quarter?, middle?);
        let between = [ends[0], middle, ends[1]].map(|point| point.determinant);
        // Where d has a corner it is never resolved.
        if let Some(found) = self.least_within(stretch, between, cost) {
            return Some(found);
        }
        if resolves([ends[0].d, quarter.d, middle.d, ends[1].d]) {
            return None;
        }
        self.resolved = self.resolved.min(0.5 * length.abs());
        Some(Exchange::Apart(0.5 * length))
    }

    /// Searches a step for a place where the determinant vanishes, from its values at the ends and in the middle.
    fn least_within(&mut self, stretch: &Stretch, [a, middle, b]: [f64; 3], cost: &mut Cost) -> Option<Exchange> {
        let length = stretch.length;
        if a * b < 0.0 {
            return None;
        }
        if middle * a < 0.0 {
            return Some(Exchange::Apart(0.5 * length));
        }
        if middle.abs() > LEADS * a.abs().max(b.abs()) && !dips(a, middle, b) {
            return None;
        }
        // It still falls at the end, or rises from the beginning: a zero lies outside.
        if self.degeneracy(stretch, (1.0 - BESIDE) * length, cost)?.determinant.abs() > b.abs()
            || self.degeneracy(stretch, BESIDE * length, cost)?.determinant.abs() > a.abs()
        {
            return None;
        }
        let steepest = (a - middle).abs().max((b - middle).abs()) / (0.5 * length.abs());
        let (mut low, mut high) = (0.0, length);
        let mut least = (a.abs().min(b.abs()), 0.0);
        for _ in 0..HALVINGS {
            // At the point itself the matrix may be singular.
            let near = [0.5, 0.47, 0.55].map(|share| low + share * (high - low));
            let found = near.into_iter().find_map(|s| {
                let next = s + NEXT * (high - low);
                let [here, beside] = [s, next].map(|s| self.degeneracy(stretch, s, cost));
                Some((s, here?.determinant, next, beside?.determinant))
            });
            let Some((middle, here, next, beside)) = found else { break };
            if here * a < 0.0 || beside * a < 0.0 {
                // Cut halfway between both zeros.
                let inside = if here * a < 0.0 { middle } else { next };
                let zeros = [low, high].map(|outside| self.zero_between(stretch, [outside, inside], a, cost));
                return Some(Exchange::Apart(0.5 * (zeros[0] + zeros[1])));
            }
            if here.abs() < least.0 {
                least = (here.abs(), middle);
            }
            // No slope leads from here to zero within the interval.
            if here.abs() > STEEP * steepest * (high - low).abs() {
                return None;
            }
            if here.abs() < NOTHING * a.abs().max(b.abs()) {
                break;
            }
            if beside.abs() < here.abs() { low = middle } else { high = next }
        }
        if least.0 > NOTHING * a.abs().max(b.abs()) {
            return None;
        }
        let station = stretch.at(self.problem, self.settings, least.1, cost).ok()?;
        let error = (high - low).abs() + self.settings.newton_tolerance();
        Some(Exchange::Together(Kind::BranchPoint, Box::new(Located { distance: least.1, station, error })))
    }

    /// Roughly the place between two at which the determinant loses the sign of `a`, which it has at the first only.
    fn zero_between(&mut self, stretch: &Stretch, [mut outside, mut inside]: [f64; 2], a: f64, cost: &mut Cost) -> f64 {
        /// A thousandth of the interval, within which a zero may be missed.
        const ROUGHLY: usize = 10;
        for _ in 0..ROUGHLY {
            let middle = 0.5 * (outside + inside);
            match self.degeneracy(stretch, middle, cost) {
                Some(found) if found.determinant * a < 0.0 => inside = middle,
                Some(_) => outside = middle,
                None => break,
            }
        }
        0.5 * (outside + inside)
    }

    fn degeneracy(&mut self, stretch: &Stretch, s: f64, cost: &mut Cost) -> Option<Degeneracy> {
        let found = stretch.seen_at(Sight::Stability, self.problem, self.settings, s, cost).ok()?;
        Degeneracy::of(&found.point)
    }
}

/// True if d goes on as from the point before, and stays away from zero.
fn continues(before: &History, [a, b]: [Degeneracy; 2], length: f64) -> bool {
    let [z] = before.spectrum[..] else { return false };
    let bend = b.d - a.d - (a.d - (1.0 - z.re)) / before.distance * length.abs();
    let [least, largest] = [f64::min, f64::max].map(|pick| pick(a.determinant.abs(), b.determinant.abs()));
    bend.abs() < STRAIGHT * a.d.abs().max(b.d.abs()) && a.determinant * b.determinant > 0.0 && least > LEADS * largest
}

/// True if a step resolves d, whose values at its beginning, a quarter and half of the way and at its end are given.
fn resolves([a, quarter, middle, b]: [f64; 4]) -> bool {
    let expected = 0.375 * a + 0.75 * middle - 0.125 * b;
    (quarter - expected).abs() <= RESOLVED * [a, b, middle, quarter].iter().fold(0.0, |most: f64, d| most.max(d.abs()))
}

/// True if the parabola through three equidistant values of one sign turns close to zero or beyond it, between them.
fn dips(a: f64, middle: f64, b: f64) -> bool {
    let (slope, bend) = (0.5 * (b - a), 0.5 * (a + b) - middle);
    let at = -slope / (2.0 * bend);
    let least = middle + at * (slope + bend * at);
    bend * a > 0.0 && at.abs() < 1.0 && least / a < DIP * (b / a).min(1.0)
}
