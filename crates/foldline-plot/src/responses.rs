//! Surveys and sweeps as layers drawn over the branches.
//!
//! **Idea.** A sweep is a thin line, interrupted at jumps, with marks that show its direction: △ while the parameter
//! rises, ▽ while it falls. The motions of a survey are dots. Periodic motions are hollow marks, others (chaos, tori)
//! small filled ones. Escaped trajectories are not drawn.

use crate::figure::{Layer, Marker};
use crate::palette::nth;
use foldline::diagram::{Diagram, Motion, Response, Responses, Search};
use foldline::special::quantity::Quantity;

/// Maximum number of marks along a sweep; more would overlap.
const MARKS: usize = 60;

/// Layers of all surveys and sweeps, starting with the colour after `taken` others. Empty for quantities of which
/// simulation has no value (see [`value`]).
pub fn response_layers(diagram: &Diagram, x: Quantity, y: Quantity, taken: usize) -> Vec<Layer> {
    let sets = diagram.responses.iter().enumerate();
    sets.flat_map(|(k, set)| set_layers(set, x, y, nth(taken + k))).collect()
}

/// Value of a quantity for a settled motion: a parameter, the period, the smallest or largest value of a state or
/// output.
pub fn value(quantity: Quantity, response: &Response) -> Option<f64> {
    let found = match quantity {
        Quantity::Parameter(k) => response.parameters.get(k).copied(),
        Quantity::Period => response.period,
        Quantity::Smallest(k) => response.ranges.get(k).map(|range| range[0]),
        Quantity::Largest(k) => response.ranges.get(k).map(|range| range[1]),
        Quantity::At(..) => None,
        Quantity::Iterate(k, number) => {
            let width = response.ranges.len();
            response.iterates.get(number * width + k).copied()
        }
        Quantity::Frequency => response.period.map(|period| 1.0 / period),
        _ => None,
    };
    found.filter(|value| value.is_finite())
}

/// All iterates of a survey or sweep of a map as small dots.
fn iterate_layers(set: &Responses, x: Quantity, state: usize, colour: &'static str) -> Vec<Layer> {
    let of = |r: &Response| -> Vec<[f64; 2]> {
        let count = r.iterates.len() / r.ranges.len().max(1);
        let all = (0..count).map(|number| value(x, r).zip(value(Quantity::Iterate(state, number), r)));
        all.flatten().map(|(x, y)| [x, y]).collect()
    };
    let places: Vec<[f64; 2]> = set.responses.iter().flat_map(of).collect();
    let layer = Layer::scatter(places, Marker::Dot, colour).wide(0.5).named(set.name.clone());
    if layer.is_empty() { Vec::new() } else { vec![layer] }
}

fn set_layers(set: &Responses, x: Quantity, y: Quantity, colour: &'static str) -> Vec<Layer> {
    if let Quantity::Iterate(state, _) = y {
        return iterate_layers(set, x, state, colour);
    }
    let at = |r: &Response| {
        let shown = !r.motion.is_lost();
        value(x, r).zip(value(y, r)).filter(|_| shown).map(|(x, y)| [x, y])
    };
    let settled = |r: &&Response| matches!(r.motion, Motion::Equilibrium | Motion::Cycle);
    let repeating: Vec<[f64; 2]> = set.responses.iter().filter(settled).filter_map(at).collect();
    let others: Vec<[f64; 2]> = set.responses.iter().filter(|r| !settled(r)).filter_map(at).collect();
    let mut layers = Vec::new();
    match (set.search, direction(set)) {
        (Search::Sweep, Some((marker, way))) => {
            layers.push(Layer::curve(&line(set, &at), colour).wide(0.8));
            let every = repeating.len().div_ceil(MARKS).max(1);
            let marked = repeating.into_iter().step_by(every).collect();
            layers.push(Layer::scatter(marked, marker, colour).wide(2.8).hollow().named(title(&set.name, way)));
        }
        _ => layers.push(Layer::scatter(repeating, Marker::Circle, colour).wide(2.4).hollow().named(set.name.clone())),
    }
    if !others.is_empty() {
        layers.push(Layer::scatter(others, Marker::Dot, colour).wide(1.6).named(format!("{}, not periodic", set.name)));
    }
    layers.retain(|layer| !layer.is_empty());
    layers
}

/// Name of a sweep followed by its direction, unless the name is the direction.
fn title(name: &str, way: &str) -> String {
    if name.to_lowercase().contains(way) { format!("{name} (sweep)") } else { format!("{name} (sweep {way})") }
}

/// Mark of a sweep for its direction, and the direction in words.
fn direction(set: &Responses) -> Option<(Marker, &'static str)> {
    let (first, last) = (set.responses.first()?.value, set.responses.last()?.value);
    Some(if last >= first { (Marker::Triangle, "up") } else { (Marker::Nabla, "down") })
}

/// Line of a sweep, interrupted at its jumps.
fn line(set: &Responses, at: &dyn Fn(&Response) -> Option<[f64; 2]>) -> Vec<[f64; 2]> {
    let jumps = set.jumps();
    let nowhere = [f64::NAN; 2];
    let place = |(k, r): (usize, &Response)| {
        let gap = jumps.contains(&k).then_some(nowhere);
        gap.into_iter().chain([at(r).unwrap_or(nowhere)])
    };
    set.responses.iter().enumerate().flat_map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::Shape;

    fn set(values: &[f64], jump: usize) -> Responses {
        let one = |(k, value): (usize, &f64)| Response {
            value: *value,
            parameters: vec![*value],
            motion: if k == 0 { Motion::Other } else { Motion::Cycle },
            period: Some(1.0),
            ratio: None,
            multiplicity: 1,
            ranges: vec![[-*value, 2.0 * value]],
            hits: 1,
            share: None,
            jumped: (k > 0).then_some(k == jump),
            state: vec![0.0],
            settled_after: 0.0,
            error: 0.0,
            iterates: Vec::new(),
            recognition: Default::default(),
        };
        let responses = values.iter().enumerate().map(one).collect();
        Responses { name: "s".into(), search: Search::Sweep, free: 0, responses }
    }

    #[test]
    fn a_sweep_shows_its_direction_and_is_interrupted_at_its_jumps() {
        let up = set_layers(&set(&[1.0, 2.0, 3.0, 4.0], 2), Quantity::Parameter(0), Quantity::Largest(0), "red");
        let Shape::Curve { stretches, .. } = &up[0].shape else { panic!("a line comes first") };
        assert_eq!(stretches.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2]);
        assert_eq!(stretches[1][0].0, [3.0, 6.0]);
        let marker = |layer: &Layer| match &layer.shape {
            Shape::Scatter { marker, points, .. } => (*marker, points.len()),
            _ => panic!("marks come after the line"),
        };
        assert_eq!(marker(&up[1]), (Marker::Triangle, 3));
        assert_eq!(marker(&up[2]), (Marker::Dot, 1), "the motion that does not repeat itself");
        let down = set_layers(&set(&[4.0, 3.0, 2.0], 9), Quantity::Parameter(0), Quantity::Largest(0), "red");
        assert_eq!(marker(&down[1]).0, Marker::Nabla);
        assert!(set_layers(&set(&[1.0, 2.0], 9), Quantity::Parameter(0), Quantity::Rms(0), "red").is_empty());
    }
}
