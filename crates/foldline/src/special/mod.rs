//! Bifurcations, one file each: the test function, and the direction of the bifurcating branch.
//!
//! | kind | on | test function vanishes when | file |
//! |---|---|---|---|
//! | fold | both | the tangent has no component along the parameter | [`fold`] |
//! | branch point | both | an eigenvalue is 0 (a multiplier is 1) and it is not a fold | [`branch_point`] |
//! | Hopf | equilibria | two eigenvalues add up to 0 | [`hopf`] |
//! | period doubling | cycles | a multiplier is -1 | [`period_doubling`] |
//! | torus | cycles | the product of two multipliers is 1 | [`torus`] |
//! | sliding | cycles | the speed on the far side of a surface is 0 where the orbit arrives | [`sliding`] |
//! | grazing | both | a switch of the field, or an extremum of one along a cycle, is 0 | [`grazing`] |
//!
//! Test functions are products over the whole spectrum, so no eigenvalue needs to be tracked: a complex pair that meets
//! on the negative real axis and sends one multiplier through -1 is detected like any other.
//!
//! **Source.** kuznetsov2004, §10.

pub mod branch_point;
pub mod codim_two;
pub mod coefficients;
pub mod collapse;
pub mod condition;
pub mod connection;
pub mod cycle_coefficients;
pub mod cycle_form;
pub mod fold;
pub mod gradient;
pub mod grazing;
pub mod harmonics;
pub mod hopf;
pub mod impact;
pub mod map_form;
mod map_operator;
pub mod mark;
pub mod normal_form;
pub mod on_branch_points;
pub mod on_connections;
pub mod on_cycle_branch_points;
pub mod on_cycles;
pub mod on_equilibria;
pub mod on_impacts;
pub mod on_levels;
pub mod on_maps;
pub mod on_surfaces;
pub mod on_tangents;
pub mod peak;
pub mod period_doubling;
pub mod phases;
pub mod quantity;
pub mod sliding;
pub mod torus;
pub mod unfolded;

use crate::contract::{Monitor, VectorField};
use crate::diagram::{Family, Kind, Point};
use num_complex::Complex64;

/// Monitors for branches of a solution family. `symmetric` is true if the model has a continuous symmetry.
pub fn monitors(family: Family, symmetric: bool) -> Vec<Box<dyn Monitor>> {
    let both: [Box<dyn Monitor>; 2] = [Box::new(fold::Fold), Box::new(branch_point::BranchPoint { symmetric })];
    match family {
        Family::Equilibrium => both.into_iter().chain([Box::new(hopf::Hopf) as Box<dyn Monitor>]).collect(),
        Family::Cycle | Family::Torus => both
            .into_iter()
            .chain([Box::new(period_doubling::PeriodDoubling) as Box<dyn Monitor>, Box::new(torus::Torus)])
            .collect(),
        Family::Arc => both.into(),
    }
}

/// Monitors along a branch on which quantities are held, in several parameters: a turning point of one of them is not a
/// bifurcation, so the spectrum alone decides. Folds and branch points are distinguished afterwards.
pub fn monitors_of_held_quantities(family: Family, symmetric: bool, free: usize) -> Vec<Box<dyn Monitor>> {
    // Boundary-value problems have no stability that a turning point in a further parameter would change.
    if family == Family::Arc {
        return vec![Box::new(fold::Turn { free })];
    }
    let mut all = monitors(family, symmetric);
    all.retain(|monitor| !matches!(monitor.kind(), Kind::Fold | Kind::BranchPoint));
    all.insert(0, Box::new(fold::Passage { symmetric }));
    all
}

/// Monitors along a curve of bifurcation points of kind `held`: codimension-two points, and turning points in the
/// second parameter of the curve, which has the index `free`.
pub fn monitors_where_held<'a>(
    field: &'a dyn VectorField,
    scales: &'a [f64],
    family: Family,
    held: Kind,
    free: usize,
) -> Vec<Box<dyn Monitor + 'a>> {
    let mut all = match held {
        Kind::Homoclinic | Kind::Heteroclinic => on_connections::monitors(field),
        Kind::SaddleNodeHomoclinic => on_connections::monitors_at_saddle_nodes(field),
        _ => codim_two::monitors(field, scales, family, held),
    };
    all.push(Box::new(fold::Turn { free }));
    all
}

/// Distance beyond the unit circle up to which a multiplier counts as on it: of maps, the rounding of the product.
fn rounding(at: &Point) -> f64 {
    match at.solution.period().filter(|_| at.solution.is_of_map()) {
        Some(iterates) => crate::problem::map::ON_CIRCLE * f64::EPSILON * iterates,
        None => 0.0,
    }
}

/// Product of (z - at) / (1 + |z|) over the spectrum: real for a spectrum closed under conjugation and a real `at`.
fn distance_product(spectrum: &[Complex64], at: f64) -> f64 {
    product(|| spectrum.iter().map(|z| (z - at) / (1.0 + z.norm())))
}

/// Product of factors of which complex ones occur in conjugate pairs. Its sign is correct even if the product of many
/// factors underflows in a large system.
fn product<I: Iterator<Item = Complex64>>(factors: impl Fn() -> I) -> f64 {
    let product = factors().product::<Complex64>().re;
    if product.abs() >= f64::MIN_POSITIVE || product.is_nan() {
        return product;
    }
    let real = || factors().filter(|factor| factor.im == 0.0).map(|factor| factor.re);
    if real().any(|factor| factor == 0.0) { 0.0 } else { f64::MIN_POSITIVE * real().map(f64::signum).product::<f64>() }
}

/// Number of unstable free eigenvalues or multipliers, without the `passing` ones closest by `distance` to their
/// critical values; `None` if another one is neutral within its error and a small margin.
fn others_unstable(at: &Point, passing: usize, distance: impl Fn(Complex64) -> f64) -> Option<usize> {
    const CLEAR: f64 = 1e-3;
    let is_cycle = at.solution.period().is_some();
    let growth = |z: Complex64| if is_cycle { z.norm().ln() } else { z.re };
    let mut others: Vec<Complex64> = at.free_spectrum().to_vec();
    others.sort_by(|a, b| distance(*a).total_cmp(&distance(*b)));
    let largest = if is_cycle { 1.0 } else { others.iter().fold(f64::MIN_POSITIVE, |m, z| m.max(z.norm())) };
    let clear =
        (CLEAR * largest).max(if at.trust.spectrum.is_nan() { 0.0 } else { 10.0 * at.trust.spectrum * largest });
    let others = others.get(passing..)?;
    // (NaN is not clear either.)
    let all_clear = others.iter().all(|z| growth(*z).abs() > clear);
    all_clear.then(|| others.iter().filter(|z| growth(**z) > 0.0).count())
}
