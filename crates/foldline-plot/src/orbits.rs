//! Orbits along a branch: the diagram with letters, and one small panel for each letter.

use crate::branches::{branch_curve, special_layers};
use crate::figure::{Axis, Layer, Marker, Panel};
use crate::palette::{BLUE, VERMILION};
use crate::profile::{along, channel_label, cycle_of, stroboscopic};
use crate::quantity::{drawn, label};
use foldline::contract::VectorField;
use foldline::diagram::{Branch, Point, SpecialPoint};
use foldline::model::Model;
use foldline::special::quantity::Quantity;

/// Largest number of orbits; more would have no letters.
pub const MOST: usize = 24;

/// Points with a stored cycle along a branch, `count` of them spread evenly by their distance in the diagram, special
/// points preferred to points close by.
fn chosen(branch: &Branch, axes: [Quantity; 2], count: usize) -> Vec<(&Point, Option<&SpecialPoint>)> {
    let mut all: Vec<(&Point, Option<&SpecialPoint>, [f64; 2])> = Vec::new();
    let mut specials = branch.special.iter().peekable();
    let at = |point: &Point| Some([drawn(axes[0], point)?, drawn(axes[1], point)?]);
    for point in &branch.points {
        all.extend(at(point).filter(|_| cycle_of(point).is_some()).map(|at| (point, None, at)));
        while let Some(own) = specials.next_if(|own| own.point.position <= point.position) {
            let place = at(&own.point).filter(|_| cycle_of(&own.point).is_some());
            all.extend(place.map(|at| (&own.point, Some(own), at)));
        }
    }
    if all.len() <= count {
        return all.into_iter().map(|(point, special, _)| (point, special)).collect();
    }
    let span = [0, 1].map(|k| {
        let values = || all.iter().map(|(.., at)| at[k]);
        let wide = values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
        if wide > 0.0 { wide } else { 1.0 }
    });
    let mut lengths = vec![0.0];
    for pair in all.windows(2) {
        let step = [0, 1].map(|k| (pair[1].2[k] - pair[0].2[k]) / span[k]);
        lengths.push(lengths[lengths.len() - 1] + step[0].hypot(step[1]));
    }
    let total = lengths[lengths.len() - 1];
    let part = total / (count.max(2) - 1) as f64;
    let mut found: Vec<usize> = Vec::new();
    for k in 0..count {
        let target = k as f64 * part;
        let close = |i: &usize| (lengths[*i] - target).abs();
        let near = (0..all.len()).filter(|i| all[*i].1.is_some() && close(i) < 0.5 * part && !found.contains(i));
        let best = near.min_by(|a, b| close(a).total_cmp(&close(b)));
        let best =
            best.or_else(|| (0..all.len()).filter(|i| !found.contains(i)).min_by(|a, b| close(a).total_cmp(&close(b))));
        found.extend(best);
    }
    found.sort_unstable();
    found.into_iter().map(|i| (all[i].0, all[i].1)).collect()
}

/// Panels for a figure with so many columns: the branch with letters above, orbits in the plane of two channels below.
pub fn panels(
    branch: &Branch,
    model: &Model,
    axes: [Quantity; 2],
    plane: [usize; 2],
    count: usize,
    columns: usize,
) -> Vec<Panel> {
    let places = chosen(branch, axes, count.min(MOST));
    let [x, y] = axes;
    let mut top = Panel::new("", branch.name.clone(), Axis::new(label(x, model)), Axis::new(label(y, model)));
    top.layers.push(branch_curve(branch, x, y, BLUE).wide(2.0));
    top.layers.extend(special_layers(branch, x, y, BLUE));
    (top.span, top.height) = (columns, 300.0);
    let whirl = model.whirl.is_some_and(|own| plane.iter().all(|k| own.contains(k)));
    let mut panels = Vec::new();
    for (k, (point, special)) in places.into_iter().enumerate() {
        let letter = format!("{}", char::from(b'a' + k as u8));
        if let (Some(a), Some(b)) = (drawn(x, point), drawn(y, point)) {
            top.layers.push(Layer::scatter(vec![[a, b]], Marker::Dot, VERMILION).wide(2.4));
            top.layers.push(Layer::note([a, b], letter.clone()));
        }
        let Some((_, values)) = along(model, point) else { continue };
        let [across, up] = plane;
        let orbit: Vec<[f64; 2]> = values[across].iter().zip(&values[up]).map(|(a, b)| [*a, *b]).collect();
        let stable = special.map_or(point.unstable, |own| own.unstable_after.max(own.unstable_before)) == 0;
        let at = drawn(x, point).map_or(String::new(), |value| format!("{} = {value:.5}", short(&label(x, model))));
        let title = special.map_or(at.clone(), |own| format!("{at}, {}", own.kind.title()));
        let mut panel = Panel::new(
            format!("({letter})"),
            title,
            Axis::new(channel_label(model, across)),
            Axis::new(channel_label(model, up)),
        );
        let line = Layer::masked(&orbit, &vec![stable; orbit.len()], BLUE);
        panel.layers.push(line);
        if model.forced()
            && let Some(points) = stroboscopic(model, point)
        {
            let starts = points[across].iter().zip(&points[up]).map(|(a, b)| [*a, *b]).collect();
            panel
                .layers
                .push(Layer::scatter(starts, Marker::Circle, VERMILION).wide(2.2).named("start of a forcing period"));
        }
        (panel.height, panel.equal) = (250.0, whirl);
        panels.push(panel);
    }
    panels.insert(0, top);
    panels
}

/// A label without its unit.
fn short(label: &str) -> &str {
    label.split(" [").next().unwrap_or(label)
}
