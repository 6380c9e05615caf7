//! Eigenvalues that cross in opposite directions on one step.
//!
//! **Idea.** If two real eigenvalues pass 0 (multipliers: 1 or -1) on one step, one upwards and one downwards, neither
//! the number of unstable ones nor the sign of a test function differs at the ends. The same holds for two complex pairs
//! and the imaginary axis (the unit circle). Two real eigenvalues, or growth rates of pairs, on either side that are about
//! to exchange sides are therefore followed through the step, each as the one that is closest to the line between its two
//! ends. If both vanish at different places, the step is cut in between; if at the same place, the critical space there
//! has two dimensions, or two pairs.
//!
//! **Equations.** With a₊ > 0 > a₋ the distances at the left end that are closest to 0, b₊ and b₋ those at the right end
//! at distance L, and a′ the rates of change on the step before:
//!
//! ```text
//!   (1)  a₊ + L a₊′ < 0,  a₋ + L a₋′ > 0           about to exchange sides
//!   (2)  λ(s) closest to a₊ + (b₋ - a₊) s/L,  λ(s) = 0
//! ```
//!
//! **Fails when** the step before shows no trend towards 0, or more than one pair exchanges sides.

use super::follow::Follow;
use super::inspect::History;
use super::locate::{Located, Stretch};
use crate::diagram::{Cost, Kind, Point};
use crate::linalg::neutral;
use num_complex::Complex64;

/// Outcome for two eigenvalues on opposite sides.
pub(super) enum Exchange {
    /// They cross at different places; the step must be cut at this distance.
    Apart(f64),
    /// They cross at one place.
    Together(Kind, Box<Located>),
}

/// Share of the distance at the ends that counts as zero: the accuracy of a located point, relative to a step, with a
/// factor of safety.
const NOTHING: f64 = 1e-6;
/// Largest number of halvings of an interval in search of one zero: from a long step to rounding.
const HALVINGS: usize = 50;
/// Factor by which the trend of the step before may fall short.
const TREND: f64 = 1.5;

/// Values of which two may exchange sides.
#[derive(Clone, Copy)]
enum Values {
    /// Distances of real eigenvalues from this one.
    Real(f64),
    /// Growth rates of complex pairs: real parts of eigenvalues, or logarithms of the moduli of multipliers.
    Rates { of_cycle: bool },
}

impl Values {
    fn all(self, spectrum: &[Complex64]) -> impl Iterator<Item = f64> + '_ {
        spectrum.iter().filter_map(move |z| match self {
            Values::Real(centre) => (z.im == 0.0).then_some(z.re - centre),
            Values::Rates { of_cycle } => (z.im > 0.0).then(|| if of_cycle { z.norm().ln() } else { z.re }),
        })
    }

    /// Those closest to 0, above and below.
    fn beside(self, spectrum: &[Complex64]) -> Option<[f64; 2]> {
        let above = self.all(spectrum).filter(|x| *x > 0.0).min_by(f64::total_cmp)?;
        let below = self.all(spectrum).filter(|x| *x < 0.0).max_by(f64::total_cmp)?;
        Some([above, below])
    }
}

/// Points of a step and the one before it, as far as the search needs them.
struct Lines {
    values: Values,
    /// Values at the left end, above and below.
    from: [f64; 2],
    /// Values at the right end to which they lead.
    to: [f64; 2],
    length: f64,
}

impl Lines {
    /// The value of `at` that is closest to line `k` at distance s.
    fn value(&self, k: usize, s: f64, at: &Point) -> Option<f64> {
        let expected = self.from[k] + (self.to[k] - self.from[k]) * s / self.length;
        self.values.all(at.free_spectrum()).min_by(|a, b| (a - expected).abs().total_cmp(&(b - expected).abs()))
    }
}

impl Follow<'_> {
    /// Searches for eigenvalues that exchange sides; see the module.
    pub(super) fn exchanged(
        &mut self,
        stretch: &Stretch,
        right: &Point,
        history: Option<&History>,
        cost: &mut Cost,
    ) -> Option<Exchange> {
        let (history, left) = (history?, &stretch.left.point);
        let of_cycle = left.solution.period().is_some();
        let pairs = Values::Rates { of_cycle };
        let kinds = [
            (Values::Real(0.0), Kind::BranchPoint, !of_cycle),
            (Values::Real(1.0), Kind::BranchPoint, of_cycle),
            (Values::Real(-1.0), Kind::PeriodDoubling, of_cycle),
            (pairs, Kind::Hopf, !of_cycle),
            (pairs, Kind::Torus, of_cycle),
        ];
        for (values, kind, _) in kinds.into_iter().filter(|(.., applies)| *applies) {
            let skipped = left.spectrum.len() - left.free_spectrum().len();
            let before = history.spectrum.get(skipped..).and_then(|own| values.beside(own));
            let ends = [left, right].map(|point| values.beside(point.free_spectrum()));
            let (Some(before), [Some(from), Some(to)]) = (before, ends) else { continue };
            let trend = |k: usize| from[k] + TREND * stretch.length.abs() * (from[k] - before[k]) / history.distance;
            if trend(0) > 0.0 || trend(1) < 0.0 {
                continue;
            }
            // Of multipliers on the unit circle within their error, as in conservative systems, the side is arbitrary.
            let least = if of_cycle { left.neutral_error() } else { 0.0 };
            if from.iter().chain(&to).any(|value| value.abs() <= least) {
                continue;
            }
            let lines = Lines { values, from, to: [to[1], to[0]], length: stretch.length };
            let found = [0, 1].map(|k| self.zero_of(stretch, &lines, k, cost));
            let [Some(first), Some(second)] = found else { continue };
            let gap = (first - second).abs();
            if gap > 1e-7 * (1.0 + stretch.length.abs()) {
                return Some(Exchange::Apart(0.5 * (first + second)));
            }
            let there = 0.5 * (first + second);
            let Ok(station) = stretch.at(self.problem, self.settings, there, cost) else { continue };
            let error = gap + self.settings.newton_tolerance();
            return Some(Exchange::Together(kind, Box::new(Located { distance: there, station, error })));
        }
        None
    }

    /// Distance at which the eigenvalue on a line vanishes, by bisection; `None` if none does.
    fn zero_of(&mut self, stretch: &Stretch, lines: &Lines, k: usize, cost: &mut Cost) -> Option<f64> {
        let (mut low, mut high) = (0.0, stretch.length);
        let (up, size) = (lines.from[k] < 0.0, lines.from[k].abs().max(lines.to[k].abs()));
        let mut last = f64::INFINITY;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            // At the point itself the matrix may be singular.
            let near = [middle, middle + 1e-3 * (high - low)];
            let found = near.into_iter().find_map(|s| {
                let there = stretch.at(self.problem, self.settings, s, cost).ok()?;
                Some((s, lines.value(k, s, &there.point)?))
            });
            let Some((s, value)) = found else { break };
            last = value.abs();
            if last == 0.0 || (high - low).abs() < 1e-12 {
                return (last <= NOTHING * size).then_some(s);
            }
            if (value > 0.0) == up { high = s } else { low = s }
        }
        (last <= NOTHING * size).then_some(0.5 * (low + high))
    }
}

/// Places at which the distances of eigenvalues from a centre are compared.
pub(super) struct Around<'p> {
    /// The ends of a step.
    pub ends: [&'p Point; 2],
    /// A point located on it.
    pub at: &'p Point,
    /// Length of the step.
    pub length: f64,
    /// Error of the location.
    pub error: f64,
}

impl Around<'_> {
    /// Number of eigenvalues whose distance from `centre` vanishes at the located point within its error: in order of
    /// size, their zeros along the curve are no farther from it. Those that vanish along the whole curve, as with a
    /// conserved quantity, do not count.
    pub fn vanishing(&self, centre: f64) -> usize {
        /// A factor of safety.
        const ERRORS: f64 = 10.0;
        /// Rounding of a distance along the curve.
        const LEAST: f64 = 1e-11;
        /// Fraction of the step beyond which the error of the location is uninformative, and fraction of the change of
        /// a multiplier beyond which its error is.
        const MOST: f64 = 0.1;
        let sorted = |point: &Point| {
            let mut all: Vec<f64> = point.free_spectrum().iter().map(|z| (z - centre).norm()).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let (here, [before, after]) = (sorted(self.at), self.ends.map(sorted));
        let reach = ERRORS * self.error.max(LEAST);
        if reach > MOST * self.length.abs() {
            return 0;
        }
        // Equal multipliers are split by their errors, which the location does not include.
        let of = |point: &Point| Some(point.trust.spectrum).filter(|error| error.is_finite()).unwrap_or(0.0);
        let blurred = self.ends.map(of).into_iter().fold(of(self.at), f64::max);
        let vanishes = |(here, (before, after)): &(&f64, (&f64, &f64))| {
            let beside = *before + *after;
            let blur = if blurred <= MOST * beside { blurred } else { 0.0 };
            **here <= reach / self.length.abs() * beside + blur
        };
        let found = here.iter().zip(before.iter().zip(&after)).take_while(vanishes).count();
        found.saturating_sub(self.collisions(centre, found))
    }

    /// Number of pairs λ, -λ among the `found` smallest eigenvalues of equilibria that are imaginary on one side and real
    /// on the other: where they meet they have one eigenvector.
    fn collisions(&self, centre: f64, found: usize) -> usize {
        if centre != 0.0 {
            return 0;
        }
        let real = |point: &Point| {
            let mut all: Vec<[usize; 2]> = neutral::marked(&point.spectrum);
            let size = |pair: &[usize; 2]| point.spectrum[pair[0]].norm();
            all.sort_by(|a, b| size(a).total_cmp(&size(b)));
            let kinds = all.iter().take(found / 2).map(|pair| point.spectrum[pair[0]].im == 0.0);
            [all.len().min(found / 2), kinds.filter(|real| *real).count()]
        };
        let [[pairs, before], [others, after]] = self.ends.map(real);
        if pairs == others { before.abs_diff(after) } else { 0 }
    }
}
