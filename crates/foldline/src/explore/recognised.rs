//! Ends of branches that are recognised afterwards, from the branch as a whole or from its parent.

use super::diagnosis;
use super::growth::{Growth, is_doubled, polished, setting};
use crate::diagram::{Branch, Ending, Family, Kind, Point, Solution, SpecialPoint};
use crate::problem::equilibrium::EquilibriumProblem;

impl Growth<'_> {
    /// Distinguishes a double Hopf point, at which a curve of torus points shrinks to an equilibrium, from a zero-Hopf
    /// point: there the pair of multipliers on the unit circle goes to 1, at a double Hopf point its angle goes to 2π
    /// ω₂/ω₁.
    pub(super) fn at_double_hopf(&self, branch: &Branch, side: usize, ending: Ending) -> Ending {
        /// Largest angle of the pair that goes to 1. It is proportional to the extent of the cycles, which has fallen
        /// by a factor of ten and more when the end is recognised; frequencies in a ratio below 0.1/2π would be taken
        /// for a zero-Hopf point.
        const SMALL: f64 = 0.1;
        let Ending::Joined { at: Kind::ZeroHopf, parameter } = ending else { return ending };
        let last = if side == 1 { branch.points.last() } else { branch.points.first() };
        let off = |z: &num_complex::Complex64| z.norm().ln().abs();
        let pair = last.and_then(|last| {
            last.free_spectrum().iter().filter(|z| z.im > 0.0).min_by(|a, b| off(a).total_cmp(&off(b))).copied()
        });
        let at = if pair.is_some_and(|z| z.arg() > SMALL) { Kind::DoubleHopf } else { Kind::ZeroHopf };
        Ending::Joined { at, parameter }
    }

    /// Recognises the end of a curve of folds of cycles at a generalised Hopf point, where the first Lyapunov
    /// coefficient vanishes and the cycles shrink to an equilibrium. Steps get shorter in proportion to the cycles
    /// there, so the curve ends without passing the point, for the reason in `ending`. Along the curve both parameters
    /// vary linearly with the square of the extent of the cycles, and are extrapolated to extent zero; the equilibrium
    /// there must have eigenvalues ±2πi/T.
    pub(super) fn at_generalised_hopf(&self, branch: &Branch, side: usize, ending: Ending) -> Ending {
        /// Largest extent of the last cycle, as a share of the largest on the curve. Parameters vary with its square,
        /// so the extrapolation covers 0.25 % of their variation.
        const SMALL: f64 = 0.05;
        /// Largest relative real part and error of the frequency of the eigenvalues. Both vary with the square of the
        /// extent, so [`SMALL`] makes them 0.0025; the rest is a factor of safety.
        const NEAR: f64 = 1e-2;
        /// Ratio to the extent of the last cycle of those from which parameters are extrapolated. Where steps end, the
        /// fold is lost in rounding; its effect decreases with the square of the extent, by a factor of 100 here.
        const CLEAR: f64 = 10.0;
        let given_up = matches!(ending, Ending::StepTooSmall(_) | Ending::GivenUp(_));
        let Some((Kind::Fold, first)) = branch.held.filter(|_| given_up && branch.family == Family::Cycle) else {
            return ending;
        };
        let (n, system) = (self.system.scales.len(), self.system);
        let extent = |point: &Point| -> f64 {
            let states = point.ranges.iter().take(n).zip(&system.scales);
            states.map(|([low, high], scale)| (high - low) / scale).fold(0.0, f64::max)
        };
        let mut inwards: Vec<&Point> = branch.points.iter().collect();
        if side == 1 {
            inwards.reverse();
        }
        let Some(last) = inwards.first().copied() else { return ending };
        let clear: Vec<&Point> =
            inwards.iter().copied().filter(|point| extent(point) >= CLEAR * extent(last)).take(2).collect();
        let [near, far] = clear[..] else { return ending };
        let largest = branch.points.iter().map(extent).fold(0.0, f64::max);
        let (a, b) = (extent(near).powi(2), extent(far).powi(2));
        let Some(period) = last.solution.free_period().filter(|_| a < b && extent(last) < SMALL * largest) else {
            return ending;
        };
        let mut parameters = near.parameters.clone();
        for k in [first, branch.free] {
            parameters[k] += a / (b - a) * (near.parameters[k] - far.parameters[k]);
        }
        let rest: Vec<f64> = last.averages.iter().take(n).map(|mean| mean[0]).collect();
        if rest.len() != n {
            return ending;
        }
        let mut problem = EquilibriumProblem::new(setting(system, branch.free, &parameters));
        let guess = super::seeds::bare(&parameters, Solution::Equilibrium(rest));
        let Ok(found) = polished(&mut problem, self.settings, &guess) else { return ending };
        let turns = |z: &num_complex::Complex64| {
            z.re.abs() < NEAR * z.im.abs() && (z.im * period / std::f64::consts::TAU - 1.0).abs() < NEAR
        };
        match found.point.spectrum.iter().any(turns) {
            true => Ending::Joined { at: Kind::GeneralisedHopf, parameter: parameters[branch.free] },
            false => ending,
        }
    }

    /// Returns the ending of a side of a doubled branch that has its last point, the special point of the parent, but
    /// was interrupted before its end was recorded. The matrix is singular there, so the side cannot be continued.
    pub(super) fn at_edge(&self, branch: &Branch, side: usize) -> Option<Ending> {
        let end = if side == 1 { branch.points.last() } else { branch.points.first() }?;
        if branch.points.len() < 2 || !is_doubled(branch) {
            return None;
        }
        let value = |point: &Point| point.parameters.get(branch.free).copied();
        let same = |s: &&SpecialPoint| s.kind == Kind::PeriodDoubling && value(&s.point) == value(end);
        let parameter = self.parents.iter().find(same).and_then(|s| value(&s.point))?;
        Some(Ending::Joined { at: Kind::PeriodDoubling, parameter })
    }

    /// Explains an end next to a bound of the range at which the forcing has no period.
    pub(super) fn explain_missing_period(&self, branch: &Branch, side: usize, ending: Ending) -> Ending {
        let last = if side == 1 { branch.points.last() } else { branch.points.first() };
        match last {
            Some(last) => diagnosis::of_forcing(self.system, branch.free, self.settings.range, last, ending),
            None => ending,
        }
    }

    /// Gives an end at a special point of the parent the accurate parameter of that point. A special point that is a
    /// point of this branch too, as a doubled cycle, becomes its last point.
    pub(super) fn recognised(&self, branch: &mut Branch, side: usize, ending: Ending) -> Ending {
        let Ending::Joined { at, parameter } = ending else { return ending };
        let free = branch.free;
        let value = |s: &SpecialPoint| s.point.parameters.get(free).copied().unwrap_or(0.0);
        let size = branch.size(parameter);
        let Some(last) = (if side == 1 { branch.points.last() } else { branch.points.first() }) else { return ending };
        let fits = |s: &&SpecialPoint| {
            let periods = (last.solution.period(), s.point.solution.period());
            let right_period = match periods {
                (Some(long), Some(short)) if at == Kind::PeriodDoubling => (0.5 * long / short - 1.0).abs() < 0.02,
                _ => true,
            };
            s.kind == at && right_period && (value(s) - parameter).abs() < 1e-2 * size
        };
        let gap = |s: &SpecialPoint| (value(s) - parameter).abs();
        let Some(parent) = self.parents.iter().filter(fits).min_by(|a, b| gap(a).total_cmp(&gap(b))) else {
            return ending;
        };
        if at == Kind::PeriodDoubling
            && let Some(edge) = super::switch::doubled_edge(self.system, branch.free, parent, last)
        {
            let position = last.position + if side == 1 { 1 } else { -1 };
            self.accept(branch, Point { position, ..edge });
        }
        Ending::Joined { at, parameter: value(parent) }
    }
}
