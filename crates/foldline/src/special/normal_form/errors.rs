//! Errors of coefficients at equilibria.
//!
//! **Idea.** A coefficient is wrong because the point is not exactly where it should be, and because of rounding. Both are repeated with other
//! errors: the coefficient is computed anew at points that are off by as much as this one may be, with derivatives that are off by what
//! rounding makes of them, all of either sign, and what that changes is its error. Where such changes would themselves drown in rounding they
//! are made larger, and their effect smaller by the same factor.
//!
//! Rounding is measured against states of their characteristic sizes: of a nonlinearity that f, evaluated there, does not show, no coefficient
//! is known. So the coefficient of a linear system is zero within its error.
//!
//! **Source.** vignes1993 (errors of either sign at random); higham2002, §9 (backward error of linear systems).

use super::local::{Local, Signs};
use crate::contract::{Batch, Parameters};
use crate::diagram::{Point, Solution};
use crate::problem::Setting;
use crate::special::coefficients::Coefficients;
use num_complex::Complex64;

/// How often a coefficient is computed anew.
const SAMPLES: u64 = 4;

/// Stated error over the largest change seen. The changes are sums with signs at random: that all of four are below a third of their root mean
/// square has a probability of 0.5 %.
const SAFE: f64 = 3.0;

/// Relative size of changes that rounding leaves eight digits of.
const VISIBLE: f64 = 1e-8;

/// A point of which the place is known only so well.
pub(super) struct Uncertain<'s, 'f> {
    pub(super) setting: &'s Setting<'f>,
    pub(super) at: &'s Point,
    /// Of every state and free parameter, relative to its size.
    error: f64,
    rounding: f64,
    /// `[n]` sizes of the states.
    sizes: Vec<f64>,
    /// Points as wrong as this one may be, times `larger`.
    others: Vec<Point>,
    larger: f64,
}

/// What a coefficient is computed from.
pub(super) struct Sample<'a> {
    pub(super) local: Local<'a>,
    pub(super) point: &'a Point,
}

impl<'s, 'f> Uncertain<'s, 'f> {
    pub(super) fn new(setting: &'s Setting<'f>, at: &'s Point, error: f64) -> Uncertain<'s, 'f> {
        let state = match &at.solution {
            Solution::Equilibrium(x) => x.as_slice(),
            Solution::Cycle(_) => &[],
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
        let free = self.setting.values_of(self.at);
        let moved: Vec<f64> = free
            .iter()
            .zip(&self.setting.axes)
            .map(|(value, axis)| value + size * (axis.scale + value.abs()) * signs.next())
            .collect();
        point.parameters = Setting { parameters: self.at.parameters.clone(), ..self.setting.clone() }.at(&moved);
        for z in &mut point.spectrum {
            // Both of a pair alike.
            *z = Complex64::new(z.re, z.im * (1.0 + if seed.is_multiple_of(2) { size } else { -size }));
        }
        point
    }

    /// True if a switch of the field has not the same sign at all places where the point may be.
    pub(super) fn lies_on_a_switch(&self) -> bool {
        let field = self.setting.field;
        let signs = |point: &Point| -> Vec<bool> {
            let Solution::Equilibrium(x) = &point.solution else { return Vec::new() };
            let parameters = Parameters::Shared(&point.parameters);
            let mut values = vec![0.0; field.switch_count()];
            field.switches(Batch { lanes: 1, states: x, parameters, times: &[] }, &mut values);
            values.iter().map(|value| *value > 0.0).collect()
        };
        let own = if field.switch_count() == 0 { return false } else { signs(self.at) };
        self.others.iter().any(|other| signs(other) != own)
    }

    /// The values of a formula with their errors; `None` where it has none.
    pub(super) fn measured(&self, formula: &dyn Fn(&Sample) -> Option<Vec<f64>>) -> Option<Coefficients> {
        let field = self.setting.field;
        let values = formula(&Sample { local: Local::new(field, self.at)?, point: self.at })?;
        let mut errors = vec![0.0f64; values.len()];
        for (seed, point) in (1..).zip(&self.others) {
            let local = Local::new(field, point)?.shaken(self.rounding * self.larger, &self.sizes, seed);
            // Where a formula fails for an error as small as this, nothing is known.
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
