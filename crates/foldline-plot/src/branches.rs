//! Branches of a diagram as layers.

use crate::curve::{marks, stretches};
use crate::figure::{Layer, Marker, Shape};
use crate::palette::{BLACK, nth};
use foldline::diagram::{Branch, Diagram, Kind, Origin};
use foldline::special::quantity::Quantity;
use std::cmp::Reverse;

/// Layers of a branch in one colour, the curve first: solid where stable, dashed where unstable, with its special
/// points hollow and named by their kind.
pub fn branch_layers(branch: &Branch, x: Quantity, y: Quantity, colour: &'static str) -> Vec<Layer> {
    let mut layers = vec![branch_curve(branch, x, y, colour)];
    layers.extend(special_layers(branch, x, y, colour));
    layers
}

/// Layer of a branch without its special points.
pub fn branch_curve(branch: &Branch, x: Quantity, y: Quantity, colour: &'static str) -> Layer {
    let shape = Shape::Curve { stretches: stretches(branch, x, y), rounded: true, stability: true };
    Layer { shape, ..Layer::curve(&[], colour) }
}

/// Layers of the special points of a branch, one for each kind. Where the criticality is known, supercritical points
/// (stable solutions are born) are hollow and subcritical ones filled, each in a layer of their own.
pub fn special_layers(branch: &Branch, x: Quantity, y: Quantity, colour: &'static str) -> Vec<Layer> {
    let all = marks(branch, x, y);
    let of = |kind: Kind, own: Option<&str>| -> Vec<[f64; 2]> {
        all.iter().filter(|(k, known, _)| *k == kind && *known == own).map(|(.., place)| *place).collect()
    };
    let mut cases: Vec<Option<&str>> = all.iter().map(|(_, known, _)| *known).collect();
    // Supercritical before subcritical, as in the tables.
    cases.sort_by_key(|case| (case.is_some(), Reverse(*case)));
    cases.dedup();
    let kinds = Kind::ALL.into_iter().flat_map(|kind| cases.iter().map(move |case| (kind, *case)));
    kinds
        .map(|(kind, known)| (kind, known, of(kind, known)))
        .filter(|(.., places)| !places.is_empty())
        .map(|(kind, known, places)| {
            let layer = Layer::scatter(places, Marker::of(kind), colour);
            match known {
                // A dot has no outline and would be invisible if hollow.
                None if kind == Kind::Mark => layer.wide(MARK).named(kind.title()),
                None => layer.hollow().named(kind.title()),
                Some("subcritical") => layer.named(format!("{}, subcritical", kind.title())),
                Some(known) => layer.hollow().named(format!("{}, {known}", kind.title())),
            }
        })
        .collect()
}

/// Layers of all branches, marks above curves. Each branch that was not switched to has a colour; the others have the
/// colour of the branch they come from, thinner.
pub fn diagram_layers(diagram: &Diagram, x: Quantity, y: Quantity) -> Vec<Layer> {
    let roots: Vec<&Branch> = diagram.branches.iter().filter(|branch| root(diagram, branch).1 == 0).collect();
    let (mut curves, mut specials) = (Vec::new(), Vec::new());
    for branch in &diagram.branches {
        let (root, depth) = root(diagram, branch);
        let index = roots.iter().position(|b| b.name == root.name).unwrap_or(0);
        let mut curve = branch_curve(branch, x, y, nth(index));
        curve = match depth {
            0 if index < MOST => curve.named(shortened(&branch.name)).wide(2.0),
            0 => curve.wide(2.0),
            _ => curve.named(THINNER).wide(1.2),
        };
        curves.push(curve);
        specials.extend(special_layers(branch, x, y, nth(index)));
    }
    // The entry for branches that branch off goes last.
    curves.sort_by_key(|layer| layer.name.as_deref() == Some(THINNER));
    curves.into_iter().chain(specials).collect()
}

/// Error bars of special points: two standard deviations of the branch's parameter to either side. The points are given
/// by branch and index with the standard deviation. Empty if no axis shows that parameter.
pub fn deviation_layers(
    diagram: &Diagram,
    x: Quantity,
    y: Quantity,
    deviations: &[(String, usize, f64)],
) -> Vec<Layer> {
    let mut bars = Vec::new();
    for (name, number, sigma) in deviations {
        let branch = diagram.branches.iter().find(|branch| branch.name == *name);
        let Some((branch, special)) = branch.and_then(|own| Some((own, own.special.get(*number)?))) else { continue };
        let (Some(a), Some(b)) = (x.of(&special.point), y.of(&special.point)) else { continue };
        let reach = 2.0 * sigma;
        let ends = match Quantity::Parameter(branch.free) {
            own if own == x => [[a - reach, b], [a + reach, b]],
            own if own == y => [[a, b - reach], [a, b + reach]],
            _ => continue,
        };
        bars.push(Layer::curve(&ends, BLACK).wide(5.0).faint(0.35).named("± 2 standard deviations"));
    }
    bars
}

/// Labels beside the curves where there is room, one for each branch that was not switched to, so that curves can be
/// identified without their colours. There are none for a single branch, or for more branches than the legend names.
pub fn label_layers(diagram: &Diagram, x: Quantity, y: Quantity) -> Vec<Layer> {
    let roots: Vec<&Branch> = diagram.branches.iter().filter(|branch| root(diagram, branch).1 == 0).collect();
    if !(2..=MOST).contains(&roots.len()) {
        return Vec::new();
    }
    let label = |(k, branch): (usize, &&Branch)| {
        let vertices: Vec<[f64; 2]> = stretches(branch, x, y).into_iter().flatten().map(|(place, _)| place).collect();
        Layer::label(from_the_middle(&vertices), shortened(&branch.name), nth(k))
    };
    roots.iter().enumerate().map(label).collect()
}

/// The positions, starting from the middle of the list.
fn from_the_middle(places: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by_key(|k| k.abs_diff(places.len() / 2));
    order.into_iter().map(|k| places[k]).collect()
}

/// Number of branches that were not switched to, each of which has its own colour.
pub fn root_count(diagram: &Diagram) -> usize {
    diagram.branches.iter().filter(|branch| root(diagram, branch).1 == 0).count()
}

/// Width of the dot of a mark: smaller than a special point, wider than the curve.
const MARK: f64 = 2.6;

/// Legend entry of branches that start at a special point of another branch.
pub(crate) const THINNER: &str = "branching off";

/// Maximum number of branches in the legend.
const MOST: usize = 14;

/// Shortens a name to leave room for the diagram.
fn shortened(name: &str) -> String {
    const LONGEST: usize = 32;
    match name.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &name[..end]),
        None => name.to_string(),
    }
}

/// Root of a branch, and the number of switches between them.
pub fn root<'d>(diagram: &'d Diagram, branch: &'d Branch) -> (&'d Branch, usize) {
    let mut at = branch;
    // Names are unique, so a chain longer than the list of branches would be a loop.
    for depth in 0..diagram.branches.len() {
        let Origin::Switch { parent, .. } = &at.origin else { return (at, depth) };
        // A curve in two parameters is not a side branch.
        if at.held.is_some() {
            return (at, depth);
        }
        let Some(parent) = diagram.branch(parent) else { return (at, depth) };
        at = parent;
    }
    (at, 0)
}
