//! What happened there: one file per bifurcation, with its test function and how to leave it on the other branch.
//!
//! | kind | on | test function vanishes when | file |
//! |---|---|---|---|
//! | fold | both | the tangent has no component along the parameter | [`fold`] |
//! | branch point | both | an eigenvalue is 0 (a multiplier is 1) and it is not a fold | [`branch_point`] |
//! | Hopf | equilibria | two eigenvalues add up to 0 | [`hopf`] |
//! | period doubling | cycles | a multiplier is -1 | [`period_doubling`] |
//! | torus | cycles | the product of two multipliers is 1 | [`torus`] |
//!
//! Test functions are products over the whole spectrum, so it does not matter which eigenvalue was close before: a
//! complex pair that meets on the negative real axis and sends one multiplier through -1 is seen like any other.
//!
//! **Source.** kuznetsov2004, §10.

pub mod branch_point;
pub mod collapse;
pub mod condition;
pub mod fold;
pub mod hopf;
pub mod on_cycles;
pub mod on_equilibria;
pub mod period_doubling;
pub mod torus;

use crate::contract::Monitor;
use crate::diagram::Family;
use num_complex::Complex64;

/// Everything to look for on branches of a family.
pub fn monitors(family: Family) -> Vec<Box<dyn Monitor>> {
    let both: [Box<dyn Monitor>; 2] = [Box::new(fold::Fold), Box::new(branch_point::BranchPoint)];
    match family {
        Family::Equilibrium => both.into_iter().chain([Box::new(hopf::Hopf) as Box<dyn Monitor>]).collect(),
        Family::Cycle => both
            .into_iter()
            .chain([Box::new(period_doubling::PeriodDoubling) as Box<dyn Monitor>, Box::new(torus::Torus)])
            .collect(),
    }
}

/// What to look for where a special point is held along the curve: where it turns back in the second parameter.
pub fn monitors_where_held() -> Vec<Box<dyn Monitor>> {
    vec![Box::new(fold::Fold)]
}

/// Product over all of (z - at) / (1 + |z|): real for a spectrum closed under conjugation and a real `at`.
fn distance_product(spectrum: &[Complex64], at: f64) -> f64 {
    spectrum.iter().map(|z| (z - at) / (1.0 + z.norm())).product::<Complex64>().re
}
