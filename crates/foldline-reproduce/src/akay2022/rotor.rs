//! The rotor of the study: its parameters, families, their colours, and quantities measured on a point.

use crate::runs::Run;
use foldline::diagram::{Branch, Ending, Point, SpecialPoint};
use foldline_plot::palette::{BLUE, GREEN, VERMILION};
use foldline_plot::{Layer, Quantity, branch_layers};

/// Index of the shaft speed.
pub const OMEGA: usize = 0;
/// max r: the output r comes after the four states.
pub const MAX_R: Quantity = Quantity::Largest(4);
/// Ω.
pub const SPEED: Quantity = Quantity::Parameter(OMEGA);

/// The three families, with their colours: S, SL, DL.
pub const FAMILIES: [(&str, &str); 3] = [("S", BLUE), ("SL", VERMILION), ("DL", GREEN)];

/// Colour of the family of a branch, from the last word of its name before any switching.
pub fn colour(branch: &str) -> &'static str {
    let root = branch.split('/').next().unwrap_or(branch);
    let has = |word: &str| root.split(' ').any(|part| part == word);
    FAMILIES.iter().rev().find(|(name, _)| has(name)).map_or(BLUE, |(_, colour)| colour)
}

/// Layers of a branch over the shaft speed under the name of its family.
pub fn over_speed(branch: &Branch, name: &str, y: Quantity) -> Vec<Layer> {
    let mut layers = branch_layers(branch, SPEED, y, colour(&branch.name));
    if let Some(curve) = layers.first_mut() {
        curve.name = Some(name.to_string());
    }
    layers
}

/// Largest radius.
pub fn max_r(point: &Point) -> f64 {
    point.ranges.get(4).map_or(f64::NAN, |r| r[1])
}

/// Smallest radius.
pub fn min_r(point: &Point) -> f64 {
    point.ranges.get(4).map_or(f64::NAN, |r| r[0])
}

/// Parameters in the order of the model file: Ω, κ, ζ, ε, γ, β, K, J_p, m.
pub fn parameters(point: &Point) -> [f64; 9] {
    std::array::from_fn(|k| point.parameters.get(k).copied().unwrap_or(f64::NAN))
}

/// Solution of largest radius.
pub fn highest(points: Vec<Point>) -> Option<Point> {
    points.into_iter().max_by(|a, b| max_r(a).total_cmp(&max_r(b)))
}

/// Stable solution of a branch at a shaft speed; if there are several, the one of largest radius.
///
/// # Errors
/// There is no such branch, or it has no stable solution there.
pub fn stable_at(run: &Run, branch: &str, omega: f64) -> Result<Point, String> {
    let stable = run.at(branch, omega)?.into_iter().filter(|p| p.unstable == 0).collect();
    highest(stable).ok_or_else(|| format!("{branch} is not stable at Ω = {omega}"))
}

/// Values of Ω at special points, each with its error.
pub fn speeds(run: &Run, special: &[&SpecialPoint]) -> Vec<[f64; 2]> {
    special.iter().map(|s| run.place(OMEGA, s)).collect()
}

/// Special point at the largest Ω.
pub fn last<'s>(special: &[&'s SpecialPoint]) -> Option<&'s SpecialPoint> {
    special.iter().copied().max_by(|a, b| a.point.parameters[OMEGA].total_cmp(&b.point.parameters[OMEGA]))
}

/// Smallest value of a measure over the points and special points of a branch, and the Ω there.
pub fn smallest(branch: &Branch, measure: impl Fn(&Point) -> f64) -> [f64; 2] {
    let points = branch.points.iter().chain(branch.special.iter().map(|s| &s.point));
    let values = points.map(|p| [measure(p), p.parameters[OMEGA]]);
    values.min_by(|a, b| a[0].total_cmp(&b[0])).unwrap_or([f64::NAN; 2])
}

/// Minimum of max r along a branch, the Ω there, and the error of that radius.
///
/// # Errors
/// There is no such branch.
pub fn least_radius(run: &Run, branch: &str) -> Result<[f64; 3], String> {
    let (point, error) = run.least(branch, &max_r)?;
    Ok([max_r(&point), point.parameters[OMEGA], error])
}

/// True if a branch closes on itself.
pub fn is_closed(branch: &Branch) -> bool {
    branch.ends.contains(&Some(Ending::Closed))
}
