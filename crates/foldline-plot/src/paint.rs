//! Layers as SVG.

use crate::curve::cut;
use crate::figure::{Layer, Marker, Shape, Zoom};
use crate::frame::Frame;
use crate::palette::ink;
use crate::scale::SIZE;
use crate::texts::{Area, Occupied, escaped};
use std::fmt::Write;

/// Dashes and gaps of unstable curves and reference lines.
pub(crate) const DASHES: &str = "5 3.5";
const NOTE: f64 = 12.0;
/// Distance between marks along a curve, and their size relative to special points.
const BEADS: f64 = 62.0;
pub(crate) const BEAD: f64 = 2.1;

/// Contents of a panel except its axes and legend: lines first, marks over them, texts last.
pub(crate) struct Painter<'f> {
    pub frame: &'f Frame,
    pub page: Occupied,
    lines: String,
    marks: String,
    /// Texts to place once all curves are known: anchor, text, colour, gap.
    waiting: Vec<([f64; 2], String, &'static str, f64)>,
    /// Texts to leave out if there is no room: anchors, text, colour.
    optional: Vec<(Vec<[f64; 2]>, String, &'static str)>,
}

impl<'f> Painter<'f> {
    pub fn new(frame: &'f Frame) -> Painter<'f> {
        let page = Occupied::new(frame.area);
        Painter { frame, page, lines: String::new(), marks: String::new(), waiting: Vec::new(), optional: Vec::new() }
    }

    pub fn layer(&mut self, layer: &Layer) {
        let opacity = if layer.opacity < 1.0 { format!(" opacity=\"{}\"", layer.opacity) } else { String::new() };
        let Layer { colour, width, .. } = layer;
        let _ = writeln!(
            self.lines,
            "<g fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{opacity}>"
        );
        if let Some(name) = &layer.name {
            let _ = writeln!(self.lines, "<title>{}</title>", escaped(name));
        }
        match &layer.shape {
            Shape::Curve { stretches, rounded, .. } => {
                self.curve(stretches, *rounded);
                if let Some(bead) = layer.bead {
                    self.beads(layer, stretches, bead);
                }
            }
            Shape::Scatter { points, marker, filled } => self.scatter(layer, points, *marker, *filled),
            Shape::Circle { centre, radius } => self.circle(*centre, *radius, layer.dashed),
            Shape::Stems { peaks, labels } => self.stems(layer, peaks, labels),
            Shape::Vertical(x) => {
                let ends = [self.frame.y.low, self.frame.y.high].map(|y| [self.frame.x.units(*x), y]);
                self.path(&ends, layer.dashed);
            }
            Shape::Horizontal(y) => {
                let ends = [self.frame.x.low, self.frame.x.high].map(|x| [x, self.frame.y.units(*y)]);
                self.path(&ends, layer.dashed);
            }
            Shape::Band(ends) => self.band(*ends, layer.colour),
            Shape::Cells { ranges, columns, filled } => self.cells(*ranges, *columns, filled, layer.colour),
            Shape::Label { places, text } => {
                let seen = places.iter().map(|at| self.frame.units(*at)).filter(|at| self.frame.holds(*at));
                let anchors = seen.map(|at| self.frame.at(at)).collect();
                self.optional.push((anchors, text.clone(), ink(layer.colour)));
            }
            Shape::Text { at, text } => {
                let at = self.frame.units(*at);
                if at[0].is_finite() && at[1].is_finite() {
                    let [x, y] = self.frame.at(at);
                    let _ = writeln!(
                        self.marks,
                        "<text x=\"{x:.2}\" y=\"{:.2}\" text-anchor=\"middle\" font-size=\"{NOTE}\" fill=\"{}\">{}</text>",
                        y + 0.36 * NOTE,
                        ink(layer.colour),
                        escaped(text)
                    );
                }
            }
            Shape::Note { at, text } => {
                let at = self.frame.units(*at);
                if self.frame.holds(at) {
                    self.waiting.push((self.frame.at(at), text.clone(), ink(layer.colour), 5.0));
                }
            }
        }
        self.lines.push_str("</g>\n");
    }

    fn curve(&mut self, stretches: &[Vec<crate::figure::Vertex>], rounded: bool) {
        let frame = self.frame;
        let units = |stretch: &Vec<crate::figure::Vertex>| {
            let vertices = stretch.iter().map(|(place, solid)| (frame.units(*place), *solid));
            let vertices: Vec<_> = vertices.collect();
            let parts = vertices.split(|(p, _)| !(p[0].is_finite() && p[1].is_finite()));
            parts.filter(|p| !p.is_empty()).map(<[_]>::to_vec).collect::<Vec<_>>()
        };
        let stretches: Vec<_> = stretches.iter().flat_map(units).collect();
        let [x0, x1, y0, y1] = frame.window();
        for piece in cut(&stretches, rounded.then_some([x1 - x0, y1 - y0])) {
            self.path(&piece.vertices, !piece.stable);
        }
    }

    /// Draws small marks at equal distances along the visible part of a curve.
    fn beads(&mut self, layer: &Layer, stretches: &[Vec<crate::figure::Vertex>], bead: Marker) {
        let style = Layer { width: BEAD, ..layer.clone() };
        let mut left = 0.5 * BEADS;
        for stretch in stretches {
            let vertices: Vec<[f64; 2]> = stretch.iter().map(|(place, _)| self.frame.units(*place)).collect();
            for part in self.frame.visible(&vertices) {
                for pair in part.windows(2) {
                    let [a, b] = [pair[0], pair[1]];
                    let length = (b[0] - a[0]).hypot(b[1] - a[1]);
                    while left <= length {
                        let share = if length > 0.0 { left / length } else { 0.0 };
                        let at = [0, 1].map(|i| a[i] + share * (b[i] - a[i]));
                        mark(&mut self.marks, bead, at, &style, true);
                        left += BEADS;
                    }
                    left -= length;
                }
            }
        }
    }

    /// Draws the visible part of a polyline in axis units.
    fn path(&mut self, vertices: &[[f64; 2]], dashed: bool) {
        let dashes = if dashed { format!(" stroke-dasharray=\"{DASHES}\"") } else { String::new() };
        for part in self.frame.visible(vertices) {
            self.page.draw(&part);
            let _ = write!(self.lines, "<path{dashes} d=\"");
            for (k, [x, y]) in part.iter().enumerate() {
                let _ = write!(self.lines, "{}{x:.2} {y:.2}", if k == 0 { 'M' } else { 'L' });
            }
            self.lines.push_str("\"/>\n");
        }
    }

    fn scatter(&mut self, layer: &Layer, points: &[[f64; 2]], marker: Marker, filled: bool) {
        let frame = self.frame;
        for point in points.iter().map(|p| frame.units(*p)).filter(|p| frame.holds(*p)) {
            let at = frame.at(point);
            if marker == Marker::Dot {
                self.page.draw(&[at, at]);
            } else {
                self.page.take(Area::around(at, layer.width + 1.0));
            }
            mark(&mut self.marks, marker, at, layer, filled);
        }
    }

    fn circle(&mut self, [x, y]: [f64; 2], radius: f64, dashed: bool) {
        const PARTS: usize = 180;
        let angle = |k: usize| k as f64 / PARTS as f64 * std::f64::consts::TAU;
        let at = |k: usize| self.frame.units([x + radius * angle(k).cos(), y + radius * angle(k).sin()]);
        let line: Vec<[f64; 2]> = (0..=PARTS).map(at).filter(|p| p[0].is_finite() && p[1].is_finite()).collect();
        self.path(&line, dashed);
    }

    fn stems(&mut self, layer: &Layer, peaks: &[[f64; 2]], labels: &[String]) {
        let foot = if self.frame.y.log { self.frame.y.low } else { 0.0 };
        for (k, peak) in peaks.iter().enumerate() {
            let top = self.frame.units(*peak);
            if !(top[0].is_finite() && top[1].is_finite()) {
                continue;
            }
            self.path(&[[top[0], foot], top], layer.dashed);
            if self.frame.holds(top) {
                let at = self.frame.at(top);
                mark(&mut self.marks, Marker::Dot, at, &Layer { width: 2.2, ..layer.clone() }, true);
                if let Some(text) = labels.get(k).filter(|t| !t.is_empty()) {
                    self.waiting.push((at, text.clone(), ink(layer.colour), 5.0));
                }
            }
        }
    }

    fn band(&mut self, ends: [f64; 2], colour: &str) {
        let [low, high] = ends.map(|x| self.frame.x.units(x).clamp(self.frame.x.low, self.frame.x.high));
        let (left, right) = (self.frame.at([low, 0.0])[0], self.frame.at([high, 0.0])[0]);
        let Area { top, bottom, .. } = self.frame.area;
        let (w, h) = (right - left, bottom - top);
        if w > 0.0 {
            let _ = writeln!(
                self.lines,
                "<rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{w:.2}\" height=\"{h:.2}\" fill=\"{colour}\" stroke=\"none\"/>"
            );
        }
    }

    /// Fills cells, those side by side as one rectangle.
    fn cells(&mut self, [x, y]: [[f64; 2]; 2], columns: usize, filled: &[bool], colour: &str) {
        let rows = filled.len().checked_div(columns).unwrap_or(0);
        let corner = |column: usize, row: usize| {
            let [u, v] = [column as f64 / columns as f64, row as f64 / rows as f64];
            self.frame.at(self.frame.units([x[0] + u * (x[1] - x[0]), y[0] + v * (y[1] - y[0])]))
        };
        let _ = write!(self.lines, "<path fill=\"{colour}\" stroke=\"none\" shape-rendering=\"crispEdges\" d=\"");
        for (row, cells) in filled.chunks_exact(columns.max(1)).enumerate() {
            let mut column = 0;
            for run in cells.chunk_by(|a, b| a == b) {
                if run[0] {
                    let ([left, bottom], [right, top]) = (corner(column, row), corner(column + run.len(), row + 1));
                    let _ = write!(self.lines, "M{left:.2} {top:.2}H{right:.2}V{bottom:.2}H{left:.2}Z");
                }
                column += run.len();
            }
        }
        self.lines.push_str("\"/>\n");
    }

    /// Draws the outline of a window that another panel shows, with the label of that panel.
    pub fn zoom(&mut self, zoom: &Zoom) {
        let [x0, x1, y0, y1] = zoom.window;
        let corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]].map(|p| self.frame.units(p));
        self.lines.push_str("<g fill=\"none\" stroke=\"#666\" stroke-width=\"0.9\">\n");
        self.path(&corners, false);
        self.lines.push_str("</g>\n");
        if self.frame.holds(corners[2]) {
            self.waiting.push((self.frame.at(corners[2]), zoom.label.clone(), "#444444", 2.0));
        }
    }

    /// Writes curves and marks as SVG, then the texts where they hide least.
    pub fn finish(mut self, out: &mut String, legend: impl FnOnce(&mut Occupied, &mut String)) {
        out.push_str(&self.lines);
        out.push_str(&self.marks);
        let mut texts = String::new();
        legend(&mut self.page, out);
        let mut placed = Vec::new();
        for (anchor, text, colour, gap) in std::mem::take(&mut self.waiting) {
            placed.push((self.page.beside(anchor, &text, NOTE, gap), text, colour));
        }
        for (anchors, text, colour) in std::mem::take(&mut self.optional) {
            placed.extend(self.page.with_room(&anchors, &text, NOTE, 4.0).map(|area| (area, text, colour)));
        }
        for (area, text, colour) in placed {
            let (x, y) = (0.5 * (area.left + area.right), 0.5 * (area.top + area.bottom) + 0.36 * NOTE);
            let text = escaped(&text);
            // White behind the letters keeps them legible where a curve passes through.
            let _ = writeln!(
                texts,
                "<text x=\"{x:.2}\" y=\"{y:.2}\" text-anchor=\"middle\" font-size=\"{NOTE}\" stroke=\"#fff\" \
                 stroke-width=\"3\" stroke-linejoin=\"round\">{text}</text>\n\
                 <text x=\"{x:.2}\" y=\"{y:.2}\" text-anchor=\"middle\" font-size=\"{NOTE}\" fill=\"{colour}\">{text}</text>"
            );
        }
        out.push_str(&texts);
    }
}

/// Draws a mark of the size given by the layer's width.
pub(crate) fn mark(out: &mut String, marker: Marker, [x, y]: [f64; 2], layer: &Layer, filled: bool) {
    let (size, colour) = (layer.width / 4.0, layer.colour);
    let shape = match marker {
        Marker::Circle => "<circle r=\"3.8\"/>",
        Marker::Square => "<path d=\"M-3.6-3.6H3.6V3.6H-3.6Z\"/>",
        Marker::Diamond => "<path d=\"M0-5L5 0L0 5L-5 0Z\"/>",
        Marker::Triangle => "<path d=\"M0-5L4.7 3.4H-4.7Z\"/>",
        Marker::Nabla => "<path d=\"M0 5L4.7-3.4H-4.7Z\"/>",
        Marker::Right => "<path d=\"M5 0L-3.4 4.7V-4.7Z\"/>",
        Marker::Left => "<path d=\"M-5 0L3.4 4.7V-4.7Z\"/>",
        Marker::Cross => "<path d=\"M-3.8-3.8L3.8 3.8M-3.8 3.8L3.8-3.8\"/>",
        Marker::Plus => "<path d=\"M0-4.6V4.6M-4.6 0H4.6\"/>",
        Marker::Star => "<path d=\"M0-5.4V5.4M-5.4 0H5.4M-3.8-3.8L3.8 3.8M-3.8 3.8L3.8-3.8\"/>",
        Marker::Dot => "<circle r=\"4\" stroke=\"none\"/>",
    };
    let fill = if filled { colour } else { "#fff" };
    let stroke = 1.5 / size.max(0.25);
    let opacity = if layer.opacity < 1.0 { format!(" opacity=\"{}\"", layer.opacity) } else { String::new() };
    let _ = writeln!(
        out,
        "<g transform=\"translate({x:.2} {y:.2}) scale({size:.3})\" fill=\"{fill}\" stroke=\"{colour}\" \
         stroke-width=\"{stroke:.2}\"{opacity}>{shape}</g>"
    );
}

/// Writes a text vertically centred at `y`.
pub(crate) fn text_at(out: &mut String, x: f64, y: f64, text: &str) {
    let _ = writeln!(out, "<text x=\"{x:.2}\" y=\"{:.2}\">{}</text>", y + 0.36 * SIZE, escaped(text));
}
