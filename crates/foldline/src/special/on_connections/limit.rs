//! Ends of curves of connecting orbits at which the equilibrium stops being a saddle.
//!
//! **Idea.** As an eigenvalue approaches the imaginary axis, the time spent next to the equilibrium grows without bound, and the
//! curve cannot be followed to its end. It stops close to it.

use crate::diagram::{Ending, Point};
use crate::linalg::larger;

/// Ratio of the smallest to the largest distance from the axis at which a curve is not followed any further.
const REACHED: f64 = 1e-3;

/// The end of a curve at a point whose saddle has an eigenvalue next to the axis, if it has.
pub fn reached(at: &Point) -> Option<Ending> {
    let sizes = || at.spectrum.iter().map(|z| z.re.abs());
    let (least, largest) = (sizes().fold(f64::INFINITY, f64::min), sizes().fold(0.0, larger));
    let why = "an eigenvalue of the equilibrium approaches the imaginary axis, where it ceases to be a saddle";
    (least < REACHED * largest).then(|| Ending::GivenUp(why.into()))
}
