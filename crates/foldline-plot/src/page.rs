//! Where everything stands on the page.

use crate::curve::{clipped, marks, pieces};
use crate::font::{FAMILY, width};
use crate::quantity::Quantity;
use crate::ticks::{labels, ticks};
use foldline::diagram::{Branch, Diagram, Kind, Origin};
use foldline::model::Model;
use std::fmt::Write;

/// What is to be drawn.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Horizontal axis; the free parameter if absent.
    pub x: Option<Quantity>,
    /// Vertical axis; the largest value of the first output if absent.
    pub y: Option<Quantity>,
    /// `[x0, x1, y0, y1]`; everything if absent.
    pub window: Option<[f64; 4]>,
    /// Written above the axes.
    pub title: Option<String>,
    /// Width and height in units of the SVG.
    pub size: [f64; 2],
}

impl Default for Picture {
    fn default() -> Picture {
        Picture { x: None, y: None, window: None, title: None, size: [960.0, 600.0] }
    }
}

/// The colours of Okabe and Ito, told apart with every common kind of colour vision; yellow, faint on white, comes last.
const COLOURS: [&str; 8] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#f0e442"];
const SIZE: f64 = 13.0;
const LINE: f64 = 21.0;
const SAMPLE: f64 = 30.0;
const MARGIN: f64 = 16.0;
const DASHES: &str = "5 3.5";

/// The picture of a diagram as SVG.
pub fn svg(diagram: &Diagram, model: &Model, picture: &Picture) -> String {
    let x = picture.x.unwrap_or_else(|| Quantity::default_x(diagram));
    let y = picture.y.unwrap_or_else(|| Quantity::default_y(model));
    let window = picture.window.unwrap_or_else(|| extent(diagram, x, y));
    let legend = Legend::of(diagram, x, y, window);
    let frame = Frame::new(picture, window, &legend);

    let [page_width, page_height] = picture.size;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{page_width}\" height=\"{page_height}\" \
         viewBox=\"0 0 {page_width} {page_height}\" font-family=\"{FAMILY}\" font-size=\"{SIZE}\" fill=\"#222\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
    );
    if let Some(title) = &picture.title {
        let (left, top) = (frame.left, frame.top - 14.0);
        let _ = writeln!(out, "<text x=\"{left:.1}\" y=\"{top:.1}\" font-size=\"16\">{}</text>", escaped(title));
    }
    frame.axes(&mut out, &x.label(model), &y.label(model));
    curves(&mut out, diagram, x, y, &frame);
    legend.draw(&mut out, frame.right + MARGIN, frame.top);
    out.push_str("</svg>\n");
    out
}

/// The smallest window that holds every point, with a little room around it.
fn extent(diagram: &Diagram, x: Quantity, y: Quantity) -> [f64; 4] {
    let points = || diagram.branches.iter().flat_map(|b| b.points.iter().chain(b.special.iter().map(|s| &s.point)));
    let of = |q: Quantity, other: Quantity| {
        let values = points().filter(|p| other.of(p).is_some()).filter_map(|p| q.of(p));
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        match (low <= high, high - low > 1e-12 * high.abs().max(low.abs())) {
            (false, _) => [0.0, 1.0],
            (true, false) => [low - 0.5 * low.abs().max(1e-300), low + 0.5 * low.abs().max(1e-300)],
            (true, true) => [low - 0.03 * (high - low), high + 0.03 * (high - low)],
        }
    };
    let ([x0, x1], [y0, y1]) = (of(x, y), of(y, x));
    [x0, x1, y0, y1]
}

/// Curves first, marks on top of them.
fn curves(out: &mut String, diagram: &Diagram, x: Quantity, y: Quantity, frame: &Frame) {
    let mut on_top = String::new();
    for branch in &diagram.branches {
        let (colour, depth) = (colour(diagram, branch), depth(diagram, branch));
        let (stroke, opacity) = if depth == 0 { (2.0, 1.0) } else { (1.4, 0.65) };
        let _ = writeln!(
            out,
            "<g fill=\"none\" stroke=\"{colour}\" stroke-width=\"{stroke}\" stroke-opacity=\"{opacity}\" \
             stroke-linejoin=\"round\"><title>{}</title>",
            escaped(&branch.name)
        );
        for piece in pieces(branch, x, y, span(frame.window)) {
            let dashes = if piece.stable { String::new() } else { format!(" stroke-dasharray=\"{DASHES}\"") };
            for part in clipped(&piece.vertices, frame.window) {
                let _ = writeln!(out, "<path{dashes} d=\"{}\"/>", frame.path(&part));
            }
        }
        out.push_str("</g>\n");
        for (kind, place) in marks(branch, x, y).into_iter().filter(|(_, p)| inside(*p, frame.window)) {
            let [px, py] = frame.at(place);
            mark(&mut on_top, kind, px, py, colour);
        }
    }
    out.push_str(&on_top);
}

/// The sizes of the axes.
fn span([x0, x1, y0, y1]: [f64; 4]) -> [f64; 2] {
    [x1 - x0, y1 - y0]
}

fn inside([x, y]: [f64; 2], [x0, x1, y0, y1]: [f64; 4]) -> bool {
    (x0..=x1).contains(&x) && (y0..=y1).contains(&y)
}

/// A shape of its own for every kind.
fn mark(out: &mut String, kind: Kind, x: f64, y: f64, colour: &str) {
    let shape = match kind {
        Kind::Fold => "<circle r=\"4\"/>",
        Kind::BranchPoint => "<path d=\"M-4-4L4 4M-4 4L4-4\" stroke-width=\"2.2\"/>",
        Kind::Hopf => "<path d=\"M0-5.4L5.4 0L0 5.4L-5.4 0Z\"/>",
        Kind::PeriodDoubling => "<path d=\"M-4-4H4V4H-4Z\"/>",
        Kind::Torus => "<path d=\"M0-5.2L5 3.6H-5Z\"/>",
        Kind::Unexplained => "<path d=\"M0-6V6M-6 0H6M-4.2-4.2L4.2 4.2M-4.2 4.2L4.2-4.2\" stroke-width=\"1.4\"/>",
    };
    let _ = writeln!(
        out,
        "<g transform=\"translate({x:.2} {y:.2})\" fill=\"#fff\" stroke=\"{colour}\" stroke-width=\"1.8\">\
         <title>{kind}</title>{shape}</g>"
    );
}

/// The branch at the root of this one.
fn root<'d>(diagram: &'d Diagram, branch: &'d Branch) -> (&'d Branch, usize) {
    let mut at = branch;
    // Names are unique, so a chain longer than the list of branches would go round in circles.
    for depth in 0..diagram.branches.len() {
        let Origin::Switch { parent, .. } = &at.origin else { return (at, depth) };
        let Some(parent) = diagram.branch(parent) else { return (at, depth) };
        at = parent;
    }
    (at, 0)
}

fn depth(diagram: &Diagram, branch: &Branch) -> usize {
    root(diagram, branch).1
}

fn roots(diagram: &Diagram) -> Vec<&Branch> {
    diagram.branches.iter().filter(|branch| depth(diagram, branch) == 0).collect()
}

fn colour(diagram: &Diagram, branch: &Branch) -> &'static str {
    let root = root(diagram, branch).0;
    let index = roots(diagram).iter().position(|b| b.name == root.name).unwrap_or(0);
    COLOURS[index % COLOURS.len()]
}

/// The area of the axes on the page.
struct Frame {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
    window: [f64; 4],
    x_ticks: Vec<(f64, String)>,
    y_ticks: Vec<(f64, String)>,
}

impl Frame {
    fn new(picture: &Picture, window: [f64; 4], legend: &Legend) -> Frame {
        let [page_width, page_height] = picture.size;
        let [x0, x1, y0, y1] = window;
        let top = MARGIN + if picture.title.is_some() { 28.0 } else { 4.0 };
        let bottom = page_height - MARGIN - 2.4 * LINE;
        let labelled = |places: Vec<f64>| places.iter().copied().zip(labels(&places)).collect::<Vec<_>>();
        let widest = |ticks: &[(f64, String)]| ticks.iter().map(|(_, text)| width(text, SIZE)).fold(0.0, f64::max);
        let y_ticks = labelled(ticks(y0, y1, ((bottom - top) / 50.0) as usize));
        let left = MARGIN + LINE + widest(&y_ticks) + 10.0;
        let right = (page_width - 2.0 * MARGIN - legend.width()).max(left + 50.0);
        // Fewer ticks until the labels stand apart.
        let fits = |ticks: &[(f64, String)]| (widest(ticks) + 18.0) * (ticks.len() as f64) < right - left;
        let mut wanted = ((right - left) / 80.0) as usize;
        let mut x_ticks = labelled(ticks(x0, x1, wanted));
        while wanted > 1 && !fits(&x_ticks) {
            wanted -= 1;
            x_ticks = labelled(ticks(x0, x1, wanted));
        }
        Frame { left, right, top, bottom, window, x_ticks, y_ticks }
    }

    /// A place on the page.
    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [x0, x1, y0, y1] = self.window;
        let share = |v: f64, low: f64, high: f64| if high > low { (v - low) / (high - low) } else { 0.5 };
        [
            self.left + share(x, x0, x1) * (self.right - self.left),
            self.bottom - share(y, y0, y1) * (self.bottom - self.top),
        ]
    }

    fn path(&self, vertices: &[[f64; 2]]) -> String {
        let mut path = String::new();
        for (k, vertex) in vertices.iter().enumerate() {
            let [x, y] = self.at(*vertex);
            let _ = write!(path, "{}{x:.2} {y:.2}", if k == 0 { 'M' } else { 'L' });
        }
        path
    }

    fn axes(&self, out: &mut String, x_label: &str, y_label: &str) {
        let Frame { left, right, top, bottom, window: [x0, _, y0, _], .. } = *self;
        out.push_str("<g stroke=\"#e4e4e4\">\n");
        for (value, _) in &self.x_ticks {
            let x = self.at([*value, y0])[0];
            let _ = writeln!(out, "<path d=\"M{x:.2} {top:.2}V{bottom:.2}\"/>");
        }
        for (value, _) in &self.y_ticks {
            let y = self.at([x0, *value])[1];
            let _ = writeln!(out, "<path d=\"M{left:.2} {y:.2}H{right:.2}\"/>");
        }
        out.push_str("</g>\n");
        let (w, h) = (right - left, bottom - top);
        let _ = writeln!(
            out,
            "<rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{w:.2}\" height=\"{h:.2}\" fill=\"none\" stroke=\"#555\"/>"
        );
        for (value, text) in &self.x_ticks {
            let x = self.at([*value, y0])[0];
            let y = bottom + 18.0;
            let _ = writeln!(out, "<text x=\"{x:.2}\" y=\"{y:.2}\" text-anchor=\"middle\">{text}</text>");
        }
        for (value, text) in &self.y_ticks {
            let y = self.at([x0, *value])[1] + 0.36 * SIZE;
            let x = left - 8.0;
            let _ = writeln!(out, "<text x=\"{x:.2}\" y=\"{y:.2}\" text-anchor=\"end\">{text}</text>");
        }
        let (cx, cy) = (0.5 * (left + right), 0.5 * (top + bottom));
        let below = bottom + 2.2 * LINE;
        let _ = writeln!(
            out,
            "<text x=\"{cx:.2}\" y=\"{below:.2}\" text-anchor=\"middle\" font-size=\"15\">{}</text>\n\
             <text transform=\"translate({:.2} {cy:.2}) rotate(-90)\" text-anchor=\"middle\" font-size=\"15\">{}</text>",
            escaped(x_label),
            MARGIN + 10.0,
            escaped(y_label)
        );
    }
}

/// The column beside the axes: one line for each root branch, the two line styles, the marks that occur.
struct Legend {
    branches: Vec<(String, &'static str)>,
    descendants: bool,
    kinds: Vec<Kind>,
}

impl Legend {
    /// What is seen in the window.
    fn of(diagram: &Diagram, x: Quantity, y: Quantity, window: [f64; 4]) -> Legend {
        let seen = |branch: &Branch| {
            let drawn =
                pieces(branch, x, y, span(window)).iter().any(|piece| !clipped(&piece.vertices, window).is_empty());
            drawn || marks(branch, x, y).iter().any(|(_, place)| inside(*place, window))
        };
        let visible: Vec<&Branch> = diagram.branches.iter().filter(|b| seen(b)).collect();
        let from = |top: &Branch| visible.iter().any(|b| root(diagram, b).0.name == top.name);
        let all: Vec<&Branch> = roots(diagram).into_iter().filter(|b| from(b)).collect();
        let mut branches: Vec<_> = all.iter().take(MOST).map(|b| (shortened(&b.name), colour(diagram, b))).collect();
        if all.len() > MOST {
            branches.push((format!("and {} more", all.len() - MOST), "none"));
        }
        let descendants = visible.iter().any(|b| depth(diagram, b) > 0);
        let occurs = |kind: Kind| {
            visible.iter().any(|b| marks(b, x, y).iter().any(|(k, place)| *k == kind && inside(*place, window)))
        };
        Legend { branches, descendants, kinds: Kind::ALL.into_iter().filter(|k| occurs(*k)).collect() }
    }

    fn texts(&self) -> impl Iterator<Item = &str> {
        let styles = ["stable", "unstable"].into_iter().chain(self.descendants.then_some(LIGHTER));
        self.branches.iter().map(|(name, _)| name.as_str()).chain(styles).chain(self.kinds.iter().map(|k| k.name()))
    }

    fn width(&self) -> f64 {
        SAMPLE + 8.0 + self.texts().map(|text| width(text, SIZE)).fold(0.0, f64::max)
    }

    fn draw(&self, out: &mut String, left: f64, top: f64) {
        let mut y = top + 0.6 * LINE;
        let text = |out: &mut String, y: &mut f64, text: &str| {
            let (x, base) = (left + SAMPLE + 8.0, *y + 0.36 * SIZE);
            let _ = writeln!(out, "<text x=\"{x:.2}\" y=\"{base:.2}\">{}</text>", escaped(text));
            *y += LINE;
        };
        let line = |out: &mut String, y: f64, style: &str| {
            let _ = writeln!(out, "<path d=\"M{left:.2} {y:.2}h{SAMPLE}\" {style}/>");
        };
        for (name, colour) in &self.branches {
            line(out, y, &format!("stroke=\"{colour}\" stroke-width=\"2.4\""));
            text(out, &mut y, name);
        }
        y += 0.6 * LINE;
        line(out, y, "stroke=\"#444\" stroke-width=\"2\"");
        text(out, &mut y, "stable");
        line(out, y, &format!("stroke=\"#444\" stroke-width=\"2\" stroke-dasharray=\"{DASHES}\""));
        text(out, &mut y, "unstable");
        if self.descendants {
            line(out, y, "stroke=\"#444\" stroke-width=\"1.4\" stroke-opacity=\"0.65\"");
            text(out, &mut y, LIGHTER);
        }
        y += 0.6 * LINE;
        for kind in &self.kinds {
            mark(out, *kind, left + 0.5 * SAMPLE, y, "#444");
            text(out, &mut y, kind.name());
        }
    }
}

/// A name that leaves room for the diagram.
fn shortened(name: &str) -> String {
    const LONGEST: usize = 32;
    match name.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &name[..end]),
        None => name.to_string(),
    }
}

/// As many branches as the legend has room for.
const MOST: usize = 14;

/// What the legend calls branches that come from a special point of another.
const LIGHTER: &str = "branching off";

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
