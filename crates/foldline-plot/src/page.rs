//! Picture of a single diagram.

use crate::branches::{diagram_layers, label_layers, root_count};
use crate::compose::figure_svg;
use crate::figure::{Axis, Figure, Layer, LegendPlace, Panel};
use crate::quantity::{default_x, default_y, label};
use crate::responses::response_layers;
use foldline::diagram::Diagram;
use foldline::model::Model;
use foldline::special::quantity::{Quantity, append, appended};

/// Contents and size of a picture.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Horizontal axis; by default the free parameter.
    pub x: Option<Quantity>,
    /// Vertical axis; by default the largest value of the first output.
    pub y: Option<Quantity>,
    /// Window `[x0, x1, y0, y1]`; by default everything.
    pub window: Option<[f64; 4]>,
    /// Title above the axes.
    pub title: Option<String>,
    /// Width and height in units of the SVG.
    pub size: [f64; 2],
    /// Further layers, drawn below the branches.
    pub layers: Vec<Layer>,
}

impl Default for Picture {
    fn default() -> Picture {
        Picture { x: None, y: None, window: None, title: None, size: [960.0, 600.0], layers: Vec::new() }
    }
}

/// The diagram with values of the quantities that are computed from profiles, and these quantities; `None` if the axes
/// need no such quantity.
fn with_values(diagram: &Diagram, model: &Model, axes: [Quantity; 2]) -> (Option<Diagram>, [Quantity; 2]) {
    if !axes.iter().any(|axis| axis.needs_profile()) {
        return (None, axes);
    }
    let mut diagram = diagram.clone();
    for branch in &mut diagram.branches {
        let special = branch.special.iter_mut().map(|special| &mut special.point);
        branch.points.iter_mut().chain(special).for_each(|point| append(point, &axes, model));
    }
    (Some(diagram), [0, 1].map(|k| if axes[k].needs_profile() { appended(k, model) } else { axes[k] }))
}

/// Renders a diagram as SVG.
pub fn svg(diagram: &Diagram, model: &Model, picture: &Picture) -> String {
    let x = picture.x.unwrap_or_else(|| default_x(diagram));
    let y = picture.y.unwrap_or_else(|| default_y(model));
    let axis = |quantity: Quantity, range: Option<[f64; 2]>| Axis { range, ..Axis::new(label(quantity, model)) };
    let (horizontal, vertical) = (axis(x, None).label, axis(y, None).label);
    let (extended, [x, y]) = with_values(diagram, model, [x, y]);
    let diagram = extended.as_ref().unwrap_or(diagram);
    let axis = |label: &str, range: Option<[f64; 2]>| Axis { range, ..Axis::new(label) };
    let [wide, high] = picture.window.map_or([None, None], |[x0, x1, y0, y1]| [Some([x0, x1]), Some([y0, y1])]);
    let [width, height] = picture.size;
    let title = if picture.title.is_some() { 31.0 } else { 0.0 };
    let mut layers: Vec<Layer> = picture.layers.iter().cloned().chain(diagram_layers(diagram, x, y)).collect();
    let responses = response_layers(diagram, x, y, root_count(diagram));
    match y {
        // Behind the branches: there are many.
        Quantity::Iterate(..) => layers = responses.into_iter().chain(layers).collect(),
        _ => layers.extend(responses),
    }
    layers.extend(label_layers(diagram, x, y));
    let panel = Panel {
        layers,
        legend: LegendPlace::Beside,
        height: height - 28.0 - title,
        ..Panel::new("", "", axis(&horizontal, wide), axis(&vertical, high))
    };
    figure_svg(&Figure { title: picture.title.clone(), panels: vec![panel], width, ..Figure::default() })
}
