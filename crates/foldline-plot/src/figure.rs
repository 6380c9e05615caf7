//! What a figure consists of: panels of layers, as plain data.
//!
//! **Idea.** A [`Figure`] is a grid of [`Panel`]s; a panel has two axes and [`Layer`]s, drawn in their order (bands first,
//! texts last). Coordinates are those of the axes; what is not finite, or not positive on a logarithmic axis, is left out.

use crate::palette::{GREY, PALE};
use foldline::diagram::Kind;

/// Panels in rows.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Written above everything.
    pub title: Option<String>,
    /// In reading order.
    pub panels: Vec<Panel>,
    /// Columns of the grid.
    pub columns: usize,
    /// Width of the page, in units of the SVG; text is 13 units high.
    pub width: f64,
    /// Whether one legend for all panels stands below them.
    pub legend: bool,
}

impl Default for Figure {
    fn default() -> Figure {
        Figure { title: None, panels: Vec::new(), columns: 1, width: 960.0, legend: false }
    }
}

impl Figure {
    /// A figure of panels in columns with one legend below.
    pub fn grid(title: impl Into<String>, columns: usize, panels: Vec<Panel>) -> Figure {
        Figure { title: Some(title.into()), panels, columns, legend: true, ..Figure::default() }
    }
}

/// Axes with layers.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Set in bold before the title: `(a)`.
    pub label: String,
    /// Written above the axes.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is drawn.
    pub layers: Vec<Layer>,
    /// Rectangles that another panel shows.
    pub zooms: Vec<Zoom>,
    /// Whether this panel has a legend of its own.
    pub legend: LegendPlace,
    /// Whether a unit is as long on both axes; the range of one axis grows where it has to.
    pub equal: bool,
    /// Columns it extends over.
    pub span: usize,
    /// Height with labels, in units of the SVG.
    pub height: f64,
}

impl Panel {
    /// An empty panel.
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
        }
    }

    /// With this layer on top.
    pub fn with(mut self, layer: Layer) -> Panel {
        self.layers.push(layer);
        self
    }

    /// With these layers on top.
    pub fn with_all(mut self, layers: impl IntoIterator<Item = Layer>) -> Panel {
        self.layers.extend(layers);
        self
    }

    /// With the outline of a window `[x0, x1, y0, y1]` that the panel of that label shows.
    pub fn zooming(mut self, window: [f64; 4], label: impl Into<String>) -> Panel {
        self.zooms.push(Zoom { window, label: label.into() });
        self
    }

    /// With units of equal length.
    pub fn equal(mut self) -> Panel {
        self.equal = true;
        self
    }
}

/// Where the legend of a panel stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LegendPlace {
    /// Nowhere.
    None,
    /// In the corner of the axes where it hides least.
    Inside,
    /// To the right of the axes.
    Beside,
}

/// An axis.
#[derive(Clone, Debug, Default)]
pub struct Axis {
    /// Written along it.
    pub label: String,
    /// From where to where; what the layers need if absent.
    pub range: Option<[f64; 2]>,
    /// Whether it is logarithmic.
    pub log: bool,
}

impl Axis {
    /// A linear axis as long as needed.
    pub fn new(label: impl Into<String>) -> Axis {
        Axis { label: label.into(), range: None, log: false }
    }

    /// From `low` to `high`.
    pub fn from(mut self, low: f64, high: f64) -> Axis {
        self.range = Some([low, high]);
        self
    }

    /// Logarithmic.
    pub fn log(mut self) -> Axis {
        self.log = true;
        self
    }
}

/// A rectangle `[x0, x1, y0, y1]`, drawn with the label of the panel that shows it.
#[derive(Clone, Debug)]
pub struct Zoom {
    /// `[x0, x1, y0, y1]`.
    pub window: [f64; 4],
    /// `(b)`.
    pub label: String,
}

/// A vertex, and whether the stretch that leads to it is solid.
pub type Vertex = ([f64; 2], bool);

/// Something drawn in one colour. Layers of one name share a line of the legend; where their colours differ it is grey.
#[derive(Clone, Debug)]
pub struct Layer {
    /// What the legend calls it; it is not there without a name.
    pub name: Option<String>,
    /// An SVG colour; [`crate::palette`] has some.
    pub colour: &'static str,
    /// Width of lines, size of marks.
    pub width: f64,
    /// From 0, invisible, to 1.
    pub opacity: f64,
    /// Whether lines without a style of their own are dashed.
    pub dashed: bool,
    /// What it is.
    pub shape: Shape,
}

/// What a layer is.
#[derive(Clone, Debug)]
pub enum Shape {
    /// A curve in stretches, which may be rounded through its vertices (see [`crate::curve::rounded`]).
    Curve {
        /// Stretches without interruption.
        stretches: Vec<Vec<Vertex>>,
        /// Whether it is drawn as a smooth curve.
        rounded: bool,
        /// Whether solid means stable; the legend then says so.
        stability: bool,
    },
    /// Marks.
    Scatter {
        /// Where.
        points: Vec<[f64; 2]>,
        /// Their shape.
        marker: Marker,
        /// Filled with the colour, or with white.
        filled: bool,
    },
    /// A circle.
    Circle {
        /// Its centre.
        centre: [f64; 2],
        /// Its radius, in units of the axes.
        radius: f64,
    },
    /// Lines from zero (from the bottom of a logarithmic axis) to each place, with a text at its end.
    Stems {
        /// The ends.
        peaks: Vec<[f64; 2]>,
        /// A text for each of them, or none.
        labels: Vec<String>,
    },
    /// A line across, at this x.
    Vertical(f64),
    /// A line across, at this y.
    Horizontal(f64),
    /// A shaded stretch of the x axis.
    Band([f64; 2]),
    /// A text beside one of several places, where there is room for it; left out where there is none.
    Label {
        /// The places, the better ones first.
        places: Vec<[f64; 2]>,
        /// The text.
        text: String,
    },
    /// A text beside a place, where it hides least.
    Note {
        /// The place.
        at: [f64; 2],
        /// The text.
        text: String,
    },
}

/// The shape of a mark.
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
    /// ×
    Cross,
    /// +
    Plus,
    /// ✳
    Star,
    /// A small dot.
    Dot,
}

impl Marker {
    /// The mark of a special point.
    pub fn of(kind: Kind) -> Marker {
        match kind {
            Kind::Fold => Marker::Circle,
            Kind::BranchPoint => Marker::Cross,
            Kind::Hopf => Marker::Diamond,
            Kind::PeriodDoubling => Marker::Square,
            Kind::Torus => Marker::Triangle,
            // On curves in two parameters, where none of the above lie.
            Kind::Cusp => Marker::Nabla,
            Kind::BogdanovTakens | Kind::Resonance11 => Marker::Plus,
            Kind::ZeroHopf | Kind::FoldTorus | Kind::Resonance13 => Marker::Triangle,
            Kind::GeneralisedHopf | Kind::GeneralisedPeriodDoubling | Kind::Chenciner => Marker::Diamond,
            Kind::DoubleHopf | Kind::DoubleTorus | Kind::Resonance14 => Marker::Square,
            Kind::FoldFlip | Kind::FlipTorus | Kind::Resonance12 => Marker::Cross,
            Kind::Mark => Marker::Dot,
            Kind::Unexplained => Marker::Star,
        }
    }
}

impl Layer {
    fn new(colour: &'static str, shape: Shape) -> Layer {
        Layer { name: None, colour, width: 1.6, opacity: 1.0, dashed: false, shape }
    }

    /// A polyline; a place that is not finite interrupts it.
    pub fn curve(points: &[[f64; 2]], colour: &'static str) -> Layer {
        Layer::masked(points, &[], colour)
    }

    /// A polyline that is dashed on its way to each place whose mask is false. A missing mask is true.
    pub fn masked(points: &[[f64; 2]], solid: &[bool], colour: &'static str) -> Layer {
        let vertex = |k: usize| (points[k], solid.get(k).copied().unwrap_or(true));
        let vertices: Vec<Vertex> = (0..points.len()).map(vertex).collect();
        let parts = vertices.split(|(p, _)| !(p[0].is_finite() && p[1].is_finite()));
        let stretches = parts.filter(|part| !part.is_empty()).map(<[Vertex]>::to_vec).collect();
        Layer::new(colour, Shape::Curve { stretches, rounded: false, stability: !solid.is_empty() })
    }

    /// Marks, filled.
    pub fn scatter(points: Vec<[f64; 2]>, marker: Marker, colour: &'static str) -> Layer {
        let width = if marker == Marker::Dot { 1.2 } else { 4.0 };
        Layer { width, ..Layer::new(colour, Shape::Scatter { points, marker, filled: true }) }
    }

    /// A circle.
    pub fn circle(centre: [f64; 2], radius: f64, colour: &'static str) -> Layer {
        Layer { width: 1.1, ..Layer::new(colour, Shape::Circle { centre, radius }) }
    }

    /// Stems with a text at each end; an empty text is none.
    pub fn stems(peaks: Vec<[f64; 2]>, labels: Vec<String>, colour: &'static str) -> Layer {
        Layer::new(colour, Shape::Stems { peaks, labels })
    }

    /// A thin line across at this x.
    pub fn vertical(x: f64) -> Layer {
        Layer { width: 1.0, dashed: true, ..Layer::new(PALE, Shape::Vertical(x)) }
    }

    /// A thin line across at this y.
    pub fn horizontal(y: f64) -> Layer {
        Layer { width: 1.0, dashed: true, ..Layer::new(PALE, Shape::Horizontal(y)) }
    }

    /// A shaded stretch of the x axis.
    pub fn band(from: f64, to: f64, colour: &'static str) -> Layer {
        Layer { opacity: 0.13, ..Layer::new(colour, Shape::Band([from, to])) }
    }

    /// A text beside a place.
    pub fn note(at: [f64; 2], text: impl Into<String>) -> Layer {
        Layer::new(GREY, Shape::Note { at, text: text.into() })
    }

    /// A text beside one of several places, if there is room.
    pub fn label(places: Vec<[f64; 2]>, text: impl Into<String>, colour: &'static str) -> Layer {
        Layer::new(colour, Shape::Label { places, text: text.into() })
    }

    /// True if a curve or a set of marks has no places.
    pub fn is_empty(&self) -> bool {
        match &self.shape {
            Shape::Curve { stretches, .. } => stretches.is_empty(),
            Shape::Scatter { points, .. } => points.is_empty(),
            _ => false,
        }
    }

    /// With a line in the legend.
    pub fn named(mut self, name: impl Into<String>) -> Layer {
        self.name = Some(name.into());
        self
    }

    /// In this colour.
    pub fn coloured(mut self, colour: &'static str) -> Layer {
        self.colour = colour;
        self
    }

    /// With lines of this width or marks of this size.
    pub fn wide(mut self, width: f64) -> Layer {
        self.width = width;
        self
    }

    /// With this opacity.
    pub fn faint(mut self, opacity: f64) -> Layer {
        self.opacity = opacity;
        self
    }

    /// Dashed all along.
    pub fn dashed(mut self) -> Layer {
        self.dashed = true;
        if let Shape::Curve { stretches, .. } = &mut self.shape {
            stretches.iter_mut().flatten().for_each(|vertex| vertex.1 = false);
        }
        self
    }

    /// Marks with white inside.
    pub fn hollow(mut self) -> Layer {
        if let Shape::Scatter { filled, .. } = &mut self.shape {
            *filled = false;
        }
        self
    }

    /// A smooth curve through the vertices instead of a polyline.
    pub fn smooth(mut self) -> Layer {
        if let Shape::Curve { rounded, .. } = &mut self.shape {
            *rounded = true;
        }
        self
    }
}
