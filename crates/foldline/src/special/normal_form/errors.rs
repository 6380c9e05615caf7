//! Errors of normal-form coefficients at equilibria.
//!
//! **Idea.** The error of a coefficient has two sources: the error of the point and rounding. Both are sampled. The
//! coefficient is recomputed at points displaced by the error bound, with derivatives perturbed by their rounding
//! error, all with random signs; the resulting changes give its error. The point satisfies the equations, so the displaced ones
//! do too, but for the component of f that vanishes with the critical eigenvalue: what remains are displacements of the parameters
//! and along the critical eigenvector. States that a stiff direction ties together are then not displaced apart. Displacements that would themselves vanish in
//! rounding are enlarged, and their effect is reduced by the same factor.
//!
//! Rounding is relative to f at states of their characteristic sizes. A nonlinearity too small to affect f there yields
//! no significant coefficient, so the coefficient of a linear system is zero within its error.
//!
//! **Source.** vignes1993 (errors of either sign at random); higham2002, §9 (backward error of linear systems).

use super::local::{Local, Signs};
use crate::contract::{Batch, Parameters};
use crate::diagram::{Point, Solution};
use crate::problem::Setting;
use crate::special::coefficients::Coefficients;
use num_complex::Complex64;

/// Number of recomputations of a coefficient: with [`SAFE`] enough for the probability stated there.
const SAMPLES: u64 = 4;

/// Stated error over the largest observed change. The changes are sums of terms with random signs. The probability that
/// all four are below a third of their root mean square is 0.5 %.
const SAFE: f64 = 3.0;

/// Relative size of displacements, chosen so that rounding leaves eight digits: the square root of the machine
/// precision.
const VISIBLE: f64 = 1e-8;

/// Point with its error bound.
pub(super) struct Uncertain<'s, 'f> {
    pub(super) setting: &'s Setting<'f>,
    pub(super) at: &'s Point,
    /// Error of every state and free parameter, relative to its size.
    pub(super) error: f64,
    rounding: f64,
    /// `[n]` sizes of the states.
    pub(super) sizes: Vec<f64>,
    /// Points displaced by the error bound times `larger`.
    others: Vec<Point>,
    larger: f64,
}

/// Input of the formula for a coefficient.
pub(super) struct Sample<'a> {
    pub(super) local: Local<'a>,
    pub(super) point: &'a Point,
}

impl<'s, 'f> Uncertain<'s, 'f> {
    pub(super) fn new(setting: &'s Setting<'f>, at: &'s Point, error: f64) -> Uncertain<'s, 'f> {
        let state = match &at.solution {
            Solution::Equilibrium(x) => x.as_slice(),
            Solution::Cycle(_) | Solution::Torus(_) => &[],
        };
        let sizes: Vec<f64> = state.iter().zip(setting.scales).map(|(x, s)| x.abs() + s).collect();
        // Backward error of a linear system with n unknowns.
        let rounding = 4.0 * sizes.len() as f64 * f64::EPSILON;
        let error = if error.is_finite() { error.max(rounding) } else { 1.0 };
        let larger = (VISIBLE / error).max(1.0);
        let mut own = Uncertain { setting, at, error, rounding, sizes, others: Vec::new(), larger };
        own.others = (1..=SAMPLES).map(|seed| own.displaced(seed)).collect();
        own
    }

    fn displaced(&self, seed: u64) -> Point {
        let (mut point, mut signs) = (self.at.clone(), Signs::new(seed));
        let size = self.error * self.larger;
        if let Solution::Equilibrium(x) = &mut point.solution {
            x.iter_mut().zip(&self.sizes).for_each(|(x, s)| *x += size * s * signs.next());
        }
        let free = self.setting.unknowns_of(self.at);
        let moved: Vec<f64> = free.iter().map(|own| own + size * (1.0 + own.abs()) * signs.next()).collect();
        point.parameters = Setting { parameters: self.at.parameters.clone(), ..self.setting.clone() }.at(&moved);
        for z in &mut point.spectrum {
            // Displace both members of a pair alike.
            *z = Complex64::new(z.re, z.im * (1.0 + if seed.is_multiple_of(2) { size } else { -size }));
        }
        self.settled(&point).unwrap_or(point)
    }

    /// The point after one step of Newton's method orthogonal to the critical eigenvector.
    fn settled(&self, at: &Point) -> Option<Point> {
        let Solution::Equilibrium(x) = &at.solution else { return None };
        let local = Local::new(self.setting.field, at)?.in_units(&self.sizes);
        let mut f = vec![0.0; x.len()];
        let parameters = Parameters::Shared(&at.parameters);
        self.setting.field.evaluate(Batch { lanes: 1, states: x, parameters, times: &[], signs: &[] }, &mut f);
        f.iter_mut().zip(&self.sizes).for_each(|(f, size)| *f /= size);
        let step = local.bordered(&local.null_vectors()?, &f)?;
        let moved: Vec<f64> = x.iter().zip(step.iter().zip(&self.sizes)).map(|(x, (d, s))| x - d * s).collect();
        moved.iter().all(|x| x.is_finite()).then(|| Point { solution: Solution::Equilibrium(moved), ..at.clone() })
    }

    /// True if some switch of the field changes sign within the error of the point.
    pub(super) fn lies_on_a_switch(&self) -> bool {
        let field = self.setting.field;
        let signs = |point: &Point| -> Vec<bool> {
            let Solution::Equilibrium(x) = &point.solution else { return Vec::new() };
            let parameters = Parameters::Shared(&point.parameters);
            let mut values = vec![0.0; field.switch_count()];
            field.switches(Batch { lanes: 1, states: x, parameters, times: &[], signs: &[] }, &mut values);
            values.iter().map(|value| *value > 0.0).collect()
        };
        let own = if field.switch_count() == 0 { return false } else { signs(self.at) };
        self.others.iter().any(|other| signs(other) != own)
    }

    /// Values of a formula with their errors; `None` if the formula has no value at the point.
    pub(super) fn measured(&self, formula: &dyn Fn(&Sample) -> Option<Vec<f64>>) -> Option<Coefficients> {
        self.sampled(&|local| local.with_sizes(&self.sizes), &self.sizes, formula)
    }

    /// As [`Uncertain::measured`], with the states of the samples measured by their sizes.
    pub(super) fn measured_in_sizes(&self, formula: &dyn Fn(&Sample) -> Option<Vec<f64>>) -> Option<Coefficients> {
        self.sampled(&|local| local.in_units(&self.sizes), &vec![1.0; self.sizes.len()], formula)
    }

    fn sampled<'x>(
        &'x self,
        prepared: &dyn Fn(Local<'x>) -> Local<'x>,
        sizes: &[f64],
        formula: &dyn Fn(&Sample) -> Option<Vec<f64>>,
    ) -> Option<Coefficients> {
        let field = self.setting.field;
        let own = prepared(Local::new(field, self.at)?);
        let vectors = own.null_vectors();
        let values = formula(&Sample { local: own, point: self.at })?;
        let mut errors = vec![0.0f64; values.len()];
        for (seed, point) in (1..).zip(&self.others) {
            let local = prepared(Local::new(field, point)?).oriented_like(vectors.clone());
            let local = local.shaken(self.rounding * self.larger, sizes, seed);
            // If the formula fails for so small a displacement, the error is infinite.
            let other = formula(&Sample { local, point }).unwrap_or_else(|| vec![f64::NAN; values.len()]);
            for (error, (value, other)) in errors.iter_mut().zip(values.iter().zip(&other)) {
                let change = SAFE * (other - value).abs() / self.larger;
                *error = if change.is_nan() { f64::INFINITY } else { error.max(change) };
            }
        }
        let spacing = |(error, value): (f64, &f64)| error + f64::EPSILON * value.abs();
        let errors: Vec<f64> = errors.into_iter().zip(&values).map(spacing).collect();
        Some(Coefficients { values, errors, remark: String::new() })
    }
}
