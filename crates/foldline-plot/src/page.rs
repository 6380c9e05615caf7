//! Picture of a diagram: panels with its branches in two or three axes.

use crate::branches::{diagram_layers, label_layers, root, root_count};
use crate::compose::figure_svg;
use crate::curve::{line_of, marks_of};
use crate::figure::{Axis, Figure, Layer, LegendPlace, Marker, Panel};
use crate::palette::nth;
use crate::profile::channel_label;
use crate::quantity::{default_x, default_y, drawn, label};
use crate::responses::{response_layers, value};
use crate::sections::{Cloud, branch_layers, cloud_layers};
use crate::space::{Space, View};
use crate::theme::{Theme, black, themed};
use foldline::diagram::Diagram;
use foldline::explore::replay::Plane;
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
    /// True for each of the two axes that is logarithmic.
    pub log: [bool; 2],
    /// Title above the axes.
    pub title: Option<String>,
    /// Width and height in units of the SVG.
    pub size: [f64; 2],
    /// Colours.
    pub theme: Theme,
    /// Further layers, drawn below the branches.
    pub layers: Vec<Layer>,
}

impl Default for Picture {
    fn default() -> Picture {
        Picture {
            x: None,
            y: None,
            window: None,
            log: [false; 2],
            title: None,
            size: [960.0, 600.0],
            theme: Theme::Light,
            layers: Vec::new(),
        }
    }
}

/// The diagram with values of the quantities that are computed from profiles, and these quantities; `None` if the axes
/// need no such quantity.
fn with_values<const N: usize>(
    diagram: &Diagram,
    model: &Model,
    axes: [Quantity; N],
) -> (Option<Diagram>, [Quantity; N]) {
    if !axes.iter().any(|axis| axis.needs_profile()) {
        return (None, axes);
    }
    let mut diagram = diagram.clone();
    for branch in &mut diagram.branches {
        let special = branch.special.iter_mut().map(|special| &mut special.point);
        branch.points.iter_mut().chain(special).for_each(|point| append(point, &axes, model));
    }
    let mut own = axes;
    own.iter_mut()
        .enumerate()
        .filter(|(_, axis)| axis.needs_profile())
        .for_each(|(k, axis)| *axis = appended(k, model));
    (Some(diagram), own)
}

/// Panel with the branches of a diagram and its surveys and sweeps, without a legend.
pub fn panel(diagram: &Diagram, model: &Model, picture: &Picture) -> Panel {
    let x = picture.x.unwrap_or_else(|| default_x(diagram));
    let y = picture.y.unwrap_or_else(|| default_y(model));
    let (horizontal, vertical) = (label(x, model), label(y, model));
    let (extended, [x, y]) = with_values(diagram, model, [x, y]);
    let diagram = extended.as_ref().unwrap_or(diagram);
    let [wide, high] = picture.window.map_or([None, None], |[x0, x1, y0, y1]| [Some([x0, x1]), Some([y0, y1])]);
    let axis = |label: &str, range: Option<[f64; 2]>, log: bool| Axis { range, log, ..Axis::new(label) };
    let mut layers: Vec<Layer> = picture.layers.iter().cloned().chain(diagram_layers(diagram, x, y)).collect();
    let responses = response_layers(diagram, x, y, root_count(diagram));
    match y {
        // Behind the branches: there are many.
        Quantity::Iterate(..) => layers = responses.into_iter().chain(layers).collect(),
        _ => layers.extend(responses),
    }
    layers.extend(label_layers(diagram, x, y));
    let [x, y] = [axis(&horizontal, wide, picture.log[0]), axis(&vertical, high, picture.log[1])];
    Panel { layers, ..Panel::new("", "", x, y) }
}

/// Panel with stroboscopic or Poincaré points: of the branches, and in `clouds` of motions found by simulation.
pub fn section_panel(
    diagram: &Diagram,
    model: &Model,
    picture: &Picture,
    channel: usize,
    plane: Plane,
    clouds: &[Cloud],
) -> Panel {
    let x = picture.x.unwrap_or_else(|| default_x(diagram));
    let branches = branch_layers(diagram, model, x, channel, plane);
    let mut layers = cloud_layers(clouds, root_count(diagram));
    layers.extend(branches);
    let [wide, high] = picture.window.map_or([None, None], |[x0, x1, y0, y1]| [Some([x0, x1]), Some([y0, y1])]);
    let place = match plane {
        Plane::Stroboscopic => "at the start of a forcing period".to_string(),
        Plane::Level(of, level) => format!("where {} rises through {level}", name(model, of)),
    };
    let x = Axis { range: wide, log: picture.log[0], ..Axis::new(label(x, model)) };
    let y =
        Axis { range: high, log: picture.log[1], ..Axis::new(format!("{} {place}", channel_label(model, channel))) };
    Panel { layers, ..Panel::new("", "", x, y) }
}

fn name(model: &Model, channel: usize) -> &str {
    match channel.checked_sub(model.states.len()) {
        None => model.states.get(channel).map_or("", |own| &own.name),
        Some(k) => model.outputs.get(k).map_or("", |own| &own.name),
    }
}

/// Panel with the branches of a diagram in three axes.
pub fn space_panel(diagram: &Diagram, model: &Model, picture: &Picture, z: Quantity, view: View) -> Panel {
    let x = picture.x.unwrap_or_else(|| default_x(diagram));
    let y = picture.y.unwrap_or_else(|| default_y(model));
    let [wide, deep] = picture.window.map_or([None, None], |[x0, x1, y0, y1]| [Some([x0, x1]), Some([y0, y1])]);
    let axis = |of: Quantity, range: Option<[f64; 2]>, log: bool| Axis { range, log, ..Axis::new(label(of, model)) };
    let axes = [axis(x, wide, picture.log[0]), axis(y, deep, picture.log[1]), axis(z, None, false)];
    let (extended, [x, y, z]) = with_values(diagram, model, [x, y, z]);
    let diagram = extended.as_ref().unwrap_or(diagram);
    let place = |point: &foldline::diagram::Point| Some([drawn(x, point)?, drawn(y, point)?, drawn(z, point)?]);
    let at = |own: &foldline::diagram::Response| Some([value(x, own)?, value(y, own)?, value(z, own)?]);
    let motions = |set: &foldline::diagram::Responses| -> Vec<[f64; 3]> {
        set.responses.iter().filter(|own| !own.motion.is_lost()).filter_map(at).collect()
    };
    let of_branches = diagram.branches.iter().flat_map(|branch| branch.points.iter().filter_map(place));
    let all: Vec<[f64; 3]> = of_branches.chain(diagram.responses.iter().flat_map(motions)).collect();
    let space = Space::around(axes, all.into_iter(), view);
    let mut panel = space.panel();
    let names: Vec<&str> =
        diagram.branches.iter().filter(|own| root(diagram, own).1 == 0).map(|own| own.name.as_str()).collect();
    for branch in &diagram.branches {
        let (own, depth) = root(diagram, branch);
        let colour = nth(names.iter().position(|name| *name == own.name).unwrap_or(0));
        let curve = space.curve(&line_of(branch, place), colour);
        let curve = if depth == 0 { curve.named(branch.name.clone()).wide(2.0) } else { curve.wide(1.2) };
        panel.layers.push(curve);
        for (kind, known, at) in marks_of(branch, place) {
            let mark = Layer::scatter(vec![space.project(at)], Marker::of(kind), colour).wide(3.0);
            let mark = if known == Some("subcritical") { mark } else { mark.hollow() };
            panel.layers.push(mark.named(kind.title()));
        }
    }
    for (k, set) in diagram.responses.iter().enumerate() {
        let places = motions(set).into_iter().map(|at| space.project(at)).collect();
        let layer = Layer::scatter(places, Marker::Circle, nth(names.len() + k)).wide(1.8).hollow();
        panel.layers.push(layer.named(set.name.clone()));
    }
    panel
}

/// Renders a figure in the colours of a theme.
pub fn figure_in(figure: Figure, theme: Theme) -> String {
    let figure = if theme == Theme::Print { black(figure) } else { figure };
    themed(figure_svg(&figure), theme)
}

/// Renders a diagram as SVG.
pub fn svg(diagram: &Diagram, model: &Model, picture: &Picture) -> String {
    let [width, height] = picture.size;
    let title = if picture.title.is_some() { 31.0 } else { 0.0 };
    let own = panel(diagram, model, picture);
    let panel = Panel { legend: LegendPlace::Beside, height: height - 28.0 - title, ..own };
    let figure = Figure { title: picture.title.clone(), panels: vec![panel], width, ..Figure::default() };
    figure_in(figure, picture.theme)
}
