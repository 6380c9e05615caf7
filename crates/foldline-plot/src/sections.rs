//! Stroboscopic and Poincaré points over a parameter: of the solutions on branches, and of motions found by simulation.

use crate::branches::{THINNER, root};
use crate::curve::line_of;
use crate::figure::{Layer, Marker, Shape};
use crate::palette::nth;
use crate::profile::{crossings, stroboscopic};
use crate::quantity::drawn;
use foldline::diagram::{Branch, Diagram, Point};
use foldline::explore::replay::Plane;
use foldline::model::Model;
use foldline::special::quantity::Quantity;

/// Points of a survey or sweep in a plane.
#[derive(Clone, Debug)]
pub struct Cloud {
    /// Name of the survey or sweep.
    pub name: String,
    /// Value of the quantity on the horizontal axis, and of the state or output in the plane.
    pub points: Vec<[f64; 2]>,
}

/// Layers of the branches: curves through the stroboscopic points of their cycles, or marks where they pass the level.
/// Equilibria appear with their values, unless the plane is a level.
pub fn branch_layers(diagram: &Diagram, model: &Model, x: Quantity, channel: usize, plane: Plane) -> Vec<Layer> {
    let roots: Vec<&str> = {
        let mut names: Vec<&str> = diagram.branches.iter().map(|own| root(diagram, own).0.name.as_str()).collect();
        names.dedup();
        names
    };
    let mut layers = Vec::new();
    for branch in diagram.branches.iter().filter(|branch| branch.held.is_none()) {
        let (own, depth) = root(diagram, branch);
        let colour = nth(roots.iter().position(|name| *name == own.name).unwrap_or(0));
        let named =
            |layer: Layer| if depth == 0 { layer.named(branch.name.clone()) } else { layer.wide(1.1).named(THINNER) };
        let values = |point: &Point| match plane {
            Plane::Stroboscopic => stroboscopic(model, point),
            Plane::Level(of, level) => crossings(model, point, of, level),
        };
        match plane {
            Plane::Stroboscopic => layers.extend(lines(branch, x, channel, colour, values).into_iter().map(named)),
            Plane::Level(..) => {
                let places = branch.points.iter().filter_map(|point| {
                    let at = drawn(x, point)?;
                    Some(values(point)?.swap_remove(channel).into_iter().map(move |y| [at, y]))
                });
                let layer = Layer::scatter(places.flatten().collect(), Marker::Dot, colour).wide(1.6);
                if !layer.is_empty() {
                    layers.push(named(layer));
                }
            }
        }
    }
    layers
}

/// One curve for each forcing period.
fn lines(
    branch: &Branch,
    x: Quantity,
    channel: usize,
    colour: &'static str,
    values: impl Fn(&Point) -> Option<Vec<Vec<f64>>>,
) -> Vec<Layer> {
    let periods = branch.points.iter().map(|point| point.solution.forcing_periods()).max().unwrap_or(1).max(1);
    let of = |number: usize| {
        let stretches = line_of(branch, |point| Some([drawn(x, point)?, *values(point)?.get(channel)?.get(number)?]));
        let shape = Shape::Curve { stretches, rounded: true, stability: true };
        Layer { shape, ..Layer::curve(&[], colour) }.wide(1.6)
    };
    (0..periods as usize).map(of).filter(|layer| !layer.is_empty()).collect()
}

/// Layers of clouds, in colours after `taken` others: small dots behind the branches.
pub fn cloud_layers(clouds: &[Cloud], taken: usize) -> Vec<Layer> {
    let layer = |(k, cloud): (usize, &Cloud)| {
        Layer::scatter(cloud.points.clone(), Marker::Dot, nth(taken + k)).wide(0.7).named(cloud.name.clone())
    };
    clouds.iter().enumerate().map(layer).filter(|layer| !layer.is_empty()).collect()
}
