//! Figures as plain data: panels of layers.
//!
//! **Idea.** A [`Figure`] is a grid of [`Panel`]s; a panel has two axes and [`Layer`]s, drawn in their order (bands
//! first, texts last). Coordinates are those of the axes; values that are not finite, or not positive on a logarithmic
//! axis, are left out.

use crate::palette::{GREY, PALE};
use foldline::diagram::Kind;

/// Panels in rows.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Title above all panels.
    pub title: Option<String>,
    /// Panels in reading order.
    pub panels: Vec<Panel>,
    /// Number of columns of the grid.
    pub columns: usize,
    /// Width of the page, in units of the SVG; text is 13 units high.
    pub width: f64,
    /// True if one legend for all panels stands below them.
    pub legend: bool,
}

impl Default for Figure {
    fn default() -> Figure {
        Figure { title: None, panels: Vec::new(), columns: 1, width: 960.0, legend: false }
    }
}

impl Figure {
    /// Returns a figure of panels in columns with one legend below.
    pub fn grid(title: impl Into<String>, columns: usize, panels: Vec<Panel>) -> Figure {
        Figure { title: Some(title.into()), panels, columns, legend: true, ..Figure::default() }
    }
}

/// Axes with layers.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Label in bold before the title, such as `(a)`.
    pub label: String,
    /// Title above the axes.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Layers, drawn in this order.
    pub layers: Vec<Layer>,
    /// Rectangles shown in detail by other panels.
    pub zooms: Vec<Zoom>,
    /// Position of the panel's own legend, if it has one.
    pub legend: LegendPlace,
    /// True if units have equal length on both axes; the range of one axis is extended as needed.
    pub equal: bool,
    /// Number of columns it spans.
    pub span: usize,
    /// Height including labels, in units of the SVG.
    pub height: f64,
    /// True if the panel has neither grid nor frame: its layers draw the axes.
    pub bare: bool,
}

impl Panel {
    /// Returns an empty panel.
    pub fn new(label: impl Into<String>, title: impl Into<String>, x: Axis, y: Axis) -> Panel {
        Panel {
            label: label.into(),
            title: title.into(),
            x,
            y,
            layers: Vec::new(),
            zooms: Vec::new(),
            legend: LegendPlace::None,
            equal: false,
            span: 1,
            height: 340.0,
            bare: false,
        }
    }

    /// Adds this layer on top.
    pub fn with(mut self, layer: Layer) -> Panel {
        self.layers.push(layer);
        self
    }

    /// Adds these layers on top.
    pub fn with_all(mut self, layers: impl IntoIterator<Item = Layer>) -> Panel {
        self.layers.extend(layers);
        self
    }

    /// Adds the outline of a window `[x0, x1, y0, y1]` that the panel with that label shows.
    pub fn zooming(mut self, window: [f64; 4], label: impl Into<String>) -> Panel {
        self.zooms.push(Zoom { window, label: label.into() });
        self
    }

    /// Makes units equally long on both axes.
    pub fn equal(mut self) -> Panel {
        self.equal = true;
        self
    }
}

/// Position of the legend of a panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LegendPlace {
    /// No legend.
    None,
    /// In the corner of the axes where it hides least.
    Inside,
    /// To the right of the axes.
    Beside,
}

/// An axis.
#[derive(Clone, Debug, Default)]
pub struct Axis {
    /// Label along the axis.
    pub label: String,
    /// Lower and upper limit; chosen to fit the layers if absent.
    pub range: Option<[f64; 2]>,
    /// True if the axis is logarithmic.
    pub log: bool,
}

impl Axis {
    /// Returns a linear axis whose range fits the layers.
    pub fn new(label: impl Into<String>) -> Axis {
        Axis { label: label.into(), range: None, log: false }
    }

    /// Sets the range.
    pub fn from(mut self, low: f64, high: f64) -> Axis {
        self.range = Some([low, high]);
        self
    }

    /// Makes the axis logarithmic.
    pub fn log(mut self) -> Axis {
        self.log = true;
        self
    }
}

/// Rectangle drawn with the label of the panel that shows it in detail.
#[derive(Clone, Debug)]
pub struct Zoom {
    /// `[x0, x1, y0, y1]`.
    pub window: [f64; 4],
    /// Label of that panel, such as `(b)`.
    pub label: String,
}

/// A vertex, and true if the segment that leads to it is solid.
pub type Vertex = ([f64; 2], bool);

/// Shape drawn in one colour. Layers of one name share a legend entry, which is grey if their colours differ.
#[derive(Clone, Debug)]
pub struct Layer {
    /// Name in the legend; without one the layer has no entry.
    pub name: Option<String>,
    /// SVG colour; [`crate::palette`] has some.
    pub colour: &'static str,
    /// Width of lines, or size of marks.
    pub width: f64,
    /// Opacity, from 0 (invisible) to 1.
    pub opacity: f64,
    /// True if lines without a style of their own are dashed.
    pub dashed: bool,
    /// Small mark repeated along a curve, to tell it from others without its colour.
    pub bead: Option<Marker>,
    /// Shape of the layer.
    pub shape: Shape,
}

/// Shape of a layer.
#[derive(Clone, Debug)]
pub enum Shape {
    /// Curve in segments, optionally rounded through its vertices (see [`crate::curve::rounded`]).
    Curve {
        /// Segments without interruption.
        stretches: Vec<Vec<Vertex>>,
        /// True if drawn as a smooth curve.
        rounded: bool,
        /// True if solid means stable, as the legend then says.
        stability: bool,
    },
    /// Marks.
    Scatter {
        /// Positions.
        points: Vec<[f64; 2]>,
        /// Their shape.
        marker: Marker,
        /// True if filled with the colour, false if filled with white.
        filled: bool,
    },
    /// A circle.
    Circle {
        /// Its centre.
        centre: [f64; 2],
        /// Its radius, in units of the axes.
        radius: f64,
    },
    /// Lines from zero (from the bottom of a logarithmic axis) to each point, with a text at the end.
    Stems {
        /// End points.
        peaks: Vec<[f64; 2]>,
        /// Text for each end, or none at all.
        labels: Vec<String>,
    },
    /// Vertical line across the axes at this x.
    Vertical(f64),
    /// Horizontal line across the axes at this y.
    Horizontal(f64),
    /// Shaded interval of the x axis.
    Band([f64; 2]),
    /// Filled cells of a rectangular grid.
    Cells {
        /// Ranges of the grid along both axes.
        ranges: [[f64; 2]; 2],
        /// Number of columns.
        columns: usize,
        /// True for each filled cell, row by row from below.
        filled: Vec<bool>,
    },
    /// Text beside one of several points where there is room for it; left out if there is none.
    Label {
        /// Candidate points, best first.
        places: Vec<[f64; 2]>,
        /// The text.
        text: String,
    },
    /// Text centred at a point.
    Text {
        /// The point.
        at: [f64; 2],
        /// The text.
        text: String,
    },
    /// Text beside a point, placed where it hides least.
    Note {
        /// The point.
        at: [f64; 2],
        /// The text.
        text: String,
    },
}

/// Shape of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// ○
    Circle,
    /// □
    Square,
    /// ◇
    Diamond,
    /// △
    Triangle,
    /// ▽
    Nabla,
    /// ▷
    Right,
    /// ◁
    Left,
    /// ×
    Cross,
    /// +
    Plus,
    /// ✳
    Star,
    /// Small dot.
    Dot,
}

impl Marker {
    /// Returns the mark of a special point.
    pub fn of(kind: Kind) -> Marker {
        match kind {
            Kind::Fold => Marker::Circle,
            Kind::BranchPoint => Marker::Cross,
            Kind::Hopf => Marker::Diamond,
            Kind::PeriodDoubling => Marker::Square,
            Kind::Torus => Marker::Triangle,
            // On curves in two parameters only, where none of the kinds above lie.
            Kind::Cusp => Marker::Nabla,
            Kind::BogdanovTakens | Kind::Resonance11 => Marker::Plus,
            Kind::ZeroHopf | Kind::FoldTorus | Kind::Resonance13 => Marker::Triangle,
            Kind::GeneralisedHopf | Kind::GeneralisedPeriodDoubling | Kind::Chenciner => Marker::Diamond,
            Kind::DoubleHopf | Kind::DoubleTorus | Kind::Resonance14 => Marker::Square,
            Kind::FoldFlip | Kind::FlipTorus | Kind::Resonance12 => Marker::Cross,
            Kind::Grazing => Marker::Right,
            Kind::BoundaryEquilibrium => Marker::Left,
            Kind::Sliding => Marker::Plus,
            Kind::ImpactGrazing => Marker::Diamond,
            Kind::Peak => Marker::Nabla,
            Kind::Mark => Marker::Dot,
            Kind::Homoclinic | Kind::Heteroclinic | Kind::SaddleNodeHomoclinic => Marker::Dot,
            Kind::NeutralSaddle => Marker::Circle,
            Kind::DoubleEigenvalue | Kind::ThreeLeading => Marker::Triangle,
            Kind::OrbitFlip | Kind::InclinationFlip => Marker::Cross,
            Kind::NonCentral => Marker::Nabla,
            Kind::ShilnikovHopf => Marker::Diamond,
            Kind::Unexplained => Marker::Star,
        }
    }
}

impl Layer {
    fn new(colour: &'static str, shape: Shape) -> Layer {
        Layer { name: None, colour, width: 1.6, opacity: 1.0, dashed: false, bead: None, shape }
    }

    /// Returns a polyline; a point that is not finite interrupts it.
    pub fn curve(points: &[[f64; 2]], colour: &'static str) -> Layer {
        Layer::masked(points, &[], colour)
    }

    /// Returns a polyline whose segment to a point is dashed if the mask of that point is false. A missing mask is
    /// true.
    pub fn masked(points: &[[f64; 2]], solid: &[bool], colour: &'static str) -> Layer {
        let vertex = |k: usize| (points[k], solid.get(k).copied().unwrap_or(true));
        let vertices: Vec<Vertex> = (0..points.len()).map(vertex).collect();
        let parts = vertices.split(|(p, _)| !(p[0].is_finite() && p[1].is_finite()));
        let stretches = parts.filter(|part| !part.is_empty()).map(<[Vertex]>::to_vec).collect();
        Layer::new(colour, Shape::Curve { stretches, rounded: false, stability: !solid.is_empty() })
    }

    /// Returns filled marks.
    pub fn scatter(points: Vec<[f64; 2]>, marker: Marker, colour: &'static str) -> Layer {
        let width = if marker == Marker::Dot { 1.2 } else { 4.0 };
        Layer { width, ..Layer::new(colour, Shape::Scatter { points, marker, filled: true }) }
    }

    /// Returns a circle.
    pub fn circle(centre: [f64; 2], radius: f64, colour: &'static str) -> Layer {
        Layer { width: 1.1, ..Layer::new(colour, Shape::Circle { centre, radius }) }
    }

    /// Returns stems with a text at each end; an empty text is left out.
    pub fn stems(peaks: Vec<[f64; 2]>, labels: Vec<String>, colour: &'static str) -> Layer {
        Layer::new(colour, Shape::Stems { peaks, labels })
    }

    /// Returns a thin vertical line across the axes at this x.
    pub fn vertical(x: f64) -> Layer {
        Layer { width: 1.0, dashed: true, ..Layer::new(PALE, Shape::Vertical(x)) }
    }

    /// Returns a thin horizontal line across the axes at this y.
    pub fn horizontal(y: f64) -> Layer {
        Layer { width: 1.0, dashed: true, ..Layer::new(PALE, Shape::Horizontal(y)) }
    }

    /// Returns a shaded interval of the x axis.
    pub fn band(from: f64, to: f64, colour: &'static str) -> Layer {
        Layer { opacity: 0.13, ..Layer::new(colour, Shape::Band([from, to])) }
    }

    /// Returns filled cells of a grid over `ranges`, row by row from below.
    pub fn cells(ranges: [[f64; 2]; 2], columns: usize, filled: Vec<bool>, colour: &'static str) -> Layer {
        Layer::new(colour, Shape::Cells { ranges, columns, filled })
    }

    /// Returns a text centred at a point.
    pub fn text(at: [f64; 2], text: impl Into<String>) -> Layer {
        Layer::new(GREY, Shape::Text { at, text: text.into() })
    }

    /// Returns a text beside a point.
    pub fn note(at: [f64; 2], text: impl Into<String>) -> Layer {
        Layer::new(GREY, Shape::Note { at, text: text.into() })
    }

    /// Returns a text beside one of several points, if there is room.
    pub fn label(places: Vec<[f64; 2]>, text: impl Into<String>, colour: &'static str) -> Layer {
        Layer::new(colour, Shape::Label { places, text: text.into() })
    }

    /// True if a curve or a set of marks has no points.
    pub fn is_empty(&self) -> bool {
        match &self.shape {
            Shape::Curve { stretches, .. } => stretches.is_empty(),
            Shape::Scatter { points, .. } => points.is_empty(),
            Shape::Cells { filled, .. } => !filled.contains(&true),
            _ => false,
        }
    }

    /// Adds an entry in the legend.
    pub fn named(mut self, name: impl Into<String>) -> Layer {
        self.name = Some(name.into());
        self
    }

    /// Sets the colour.
    pub fn coloured(mut self, colour: &'static str) -> Layer {
        self.colour = colour;
        self
    }

    /// Sets the width of lines or the size of marks.
    pub fn wide(mut self, width: f64) -> Layer {
        self.width = width;
        self
    }

    /// Sets the opacity.
    pub fn faint(mut self, opacity: f64) -> Layer {
        self.opacity = opacity;
        self
    }

    /// Makes all lines dashed.
    pub fn dashed(mut self) -> Layer {
        self.dashed = true;
        if let Shape::Curve { stretches, .. } = &mut self.shape {
            stretches.iter_mut().flatten().for_each(|vertex| vertex.1 = false);
        }
        self
    }

    /// Fills marks with white.
    pub fn hollow(mut self) -> Layer {
        if let Shape::Scatter { filled, .. } = &mut self.shape {
            *filled = false;
        }
        self
    }

    /// Draws a smooth curve through the vertices instead of a polyline.
    pub fn smooth(mut self) -> Layer {
        if let Shape::Curve { rounded, .. } = &mut self.shape {
            *rounded = true;
        }
        self
    }
}
