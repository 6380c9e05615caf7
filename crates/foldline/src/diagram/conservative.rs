//! Multipliers of forced cycles that are on the unit circle for a structural reason.
//!
//! **Idea.** In a conservative system the multipliers come in pairs μ, 1/μ, and those of a stable cycle lie on the unit
//! circle at all parameter values. Rounding decides on which side of it they are computed, so they must neither count
//! as unstable nor be taken for torus points.
//!
//! **Equations.** With the error ε of the multipliers, the system counts as conservative if all form pairs with
//!
//!   (1)  |μ_i μ_j - 1| ≤ ε (1 + |μ_i| + |μ_j|)
//!
//! **Fails when** damping is so light that the product differs from 1 by less than the error of the multipliers.

use super::{Point, Solution};

/// Largest error of the multipliers at which their products are significant.
const KNOWN: f64 = 1e-3;

impl Point {
    /// Counts the unstable multipliers of a cycle of a forced conservative system: those outside the unit circle by more
    /// than their error.
    pub(crate) fn count_if_conservative(&mut self) {
        let margin = self.conservative_margin();
        if margin > 0.0 {
            self.unstable = self.spectrum.iter().filter(|z| z.norm() > 1.0 + margin).count();
        }
    }

    /// Distance from the unit circle within which multipliers of a forced conservative system are on it: their error. 0 in
    /// other systems.
    pub(crate) fn conservative_margin(&self) -> f64 {
        let error = self.neutral_error();
        if self.reciprocal_pairs(error).is_some() { error } else { 0.0 }
    }

    /// Pairs the multipliers of a forced cycle so that each product is 1 (1); `None` if that is impossible.
    pub(crate) fn reciprocal_pairs(&self, error: f64) -> Option<Vec<[usize; 2]>> {
        let Solution::Cycle(cycle) = &self.solution else { return None };
        let z = &self.spectrum;
        let known = error <= KNOWN;
        if cycle.forcing_periods == 0 || z.is_empty() || z.len() % 2 == 1 || !known {
            return None;
        }
        let mut rest: Vec<usize> = (0..z.len()).collect();
        let mut found = Vec::with_capacity(z.len() / 2);
        while let Some(i) = rest.pop() {
            let off = |j: &usize| (z[i] * z[*j] - 1.0).norm() / (1.0 + z[i].norm() + z[*j].norm());
            let place = (0..rest.len()).min_by(|a, b| off(&rest[*a]).total_cmp(&off(&rest[*b])))?;
            let j = rest.remove(place);
            if off(&j) > error {
                return None;
            }
            found.push([i, j]);
        }
        Some(found)
    }
}
