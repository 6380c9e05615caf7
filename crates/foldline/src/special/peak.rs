//! Peaks: points at which a quantity is largest or smallest along a branch.
//!
//! **Equations.** With the tangent τ of the branch and the derivative q' of the quantity ([`super::gradient`]):
//!
//! ```text
//!   (1)  q' τ = 0
//! ```
//!
//! At a fold the parameter turns and q does not, unless its peak is there.
//!
//! **Fails when** a largest value has a corner, because two maxima of the cycle are equally high: it may have a peak there
//! without (1).

use super::gradient::Along;
use super::quantity::Quantity;
use crate::contract::{Monitor, Sight};
use crate::diagram::{Kind, Point, Solution};
use crate::linalg::dot;
use crate::problem::Setting;

/// Monitor of the peaks of a quantity.
pub struct Peak<'a> {
    /// The quantity.
    pub quantity: Quantity,
    /// The field with the free parameters of the branch.
    pub setting: Setting<'a>,
}

impl Peak<'_> {
    /// Rate of change of the quantity along the branch.
    pub fn rate(&self, at: &Point) -> Option<f64> {
        let setting = Setting { parameters: at.parameters.clone(), ..self.setting.clone() };
        let (found, _) = Along::point(setting.field, at).gradient(self.quantity, None)?;
        let (own, free) = at.tangent.split_at_checked(at.tangent.len().checked_sub(setting.freedom())?)?;
        let scalars = usize::from(matches!(&at.solution, Solution::Cycle(cycle) if cycle.degree > 0));
        let (profile, period) = own.split_at_checked(own.len().checked_sub(scalars)?)?;
        if profile.len() != found.profile.len() {
            return None;
        }
        let moved = dot(&found.profile, profile) + dot(&found.parameters, &setting.spread(free));
        Some(moved + period.first().map_or(0.0, |change| found.period * change))
    }
}

impl Monitor for Peak<'_> {
    fn kind(&self) -> Kind {
        Kind::Peak
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        self.rate(at).unwrap_or(f64::NAN)
    }

    fn confirms(&self, _at: &Point) -> bool {
        true
    }

    fn reads(&self) -> Sight {
        Sight::Tangent
    }

    fn jump(&self) -> usize {
        0
    }
}
