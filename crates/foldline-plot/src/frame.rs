//! The axes of a panel on the page.

use crate::curve::clipped;
use crate::figure::{Layer, Panel, Shape};
use crate::scale::{SIZE, Scale};
use crate::texts::{Area, escaped};
use std::fmt::Write;

/// Room for the label of an axis.
pub(crate) const LABEL: f64 = 22.0;

/// Axes of a panel: position on the page and range of values.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    pub area: Area,
    pub x: Scale,
    pub y: Scale,
}

impl Frame {
    /// Returns the scales of a panel, not yet placed on the page.
    pub fn of(panel: &Panel) -> Frame {
        let [x, y] = extent(panel);
        let nowhere = Area { left: 0.0, right: 1.0, top: 0.0, bottom: 1.0 };
        Frame { area: nowhere, x: Scale::new(&panel.x, x), y: Scale::new(&panel.y, y) }
    }

    /// Places the axes on the page; with `equal`, the axis with room to spare gets a longer range.
    pub fn place(&mut self, area: Area, equal: bool) {
        self.area = area;
        let [w, h] = self.size();
        if equal {
            let (per_x, per_y) = ((self.x.high - self.x.low) / w, (self.y.high - self.y.low) / h);
            let (scale, more) = if per_x < per_y { (&mut self.x, per_y * w) } else { (&mut self.y, per_x * h) };
            let middle = 0.5 * (scale.low + scale.high);
            (scale.low, scale.high) = (middle - 0.5 * more, middle + 0.5 * more);
        }
        self.divide_y(h);
        // Reduces the number of ticks until labels no longer overlap.
        let mut wanted = (w / 52.0).max(1.0) as usize;
        self.x.divide(wanted);
        while wanted > 1
            && (self.x.widest() + 16.0) * self.x.ticks.iter().filter(|t| !t.1.is_empty()).count() as f64 > w
        {
            wanted -= 1;
            self.x.divide(wanted);
        }
    }

    /// Sets the ticks of the vertical axis, whose labels determine the width left for the horizontal one.
    pub fn divide_y(&mut self, height: f64) {
        self.y.divide((height / 45.0).max(2.0) as usize);
    }

    pub fn size(&self) -> [f64; 2] {
        [self.area.right - self.area.left, self.area.bottom - self.area.top]
    }

    /// Window `[x0, x1, y0, y1]` in axis units.
    pub fn window(&self) -> [f64; 4] {
        [self.x.low, self.x.high, self.y.low, self.y.high]
    }

    /// Converts a point to axis units.
    pub fn units(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.x.units(x), self.y.units(y)]
    }

    /// True if a point in axis units is inside.
    pub fn holds(&self, [x, y]: [f64; 2]) -> bool {
        let [x0, x1, y0, y1] = self.window();
        (x0..=x1).contains(&x) && (y0..=y1).contains(&y)
    }

    /// Position on the page of a point in axis units.
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [w, h] = self.size();
        [self.area.left + self.x.share(x) * w, self.area.bottom - self.y.share(y) * h]
    }

    /// Visible parts, on the page, of a polyline in axis units.
    pub fn visible(&self, vertices: &[[f64; 2]]) -> Vec<Vec<[f64; 2]>> {
        let parts = clipped(vertices, self.window());
        parts.into_iter().map(|part| part.into_iter().map(|p| self.at(p)).collect()).collect()
    }

    /// Draws the grid, behind everything else.
    pub fn grid(&self, out: &mut String) {
        let Area { left, right, top, bottom } = self.area;
        out.push_str("<g stroke=\"#e8e8e8\" stroke-width=\"0.8\">\n");
        for (value, _) in self.x.ticks.iter().filter(|t| !t.1.is_empty()) {
            let x = self.at([*value, self.y.low])[0];
            let _ = writeln!(out, "<path d=\"M{x:.2} {top:.2}V{bottom:.2}\"/>");
        }
        for (value, _) in self.y.ticks.iter().filter(|t| !t.1.is_empty()) {
            let y = self.at([self.x.low, *value])[1];
            let _ = writeln!(out, "<path d=\"M{left:.2} {y:.2}H{right:.2}\"/>");
        }
        out.push_str("</g>\n");
    }

    /// Draws the frame with its ticks and labels.
    pub fn axes(&self, out: &mut String, panel: &Panel) {
        let Area { left, right, top, bottom } = self.area;
        let [w, h] = self.size();
        if panel.bare {
            return self.heading(out, panel);
        }
        let _ = writeln!(
            out,
            "<rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{w:.2}\" height=\"{h:.2}\" fill=\"none\" stroke=\"#555\"/>\n\
             <g stroke=\"#555\">"
        );
        let length = |text: &str| if text.is_empty() { 2.5 } else { 4.5 };
        for (value, text) in &self.x.ticks {
            let x = self.at([*value, self.y.low])[0];
            let _ = writeln!(out, "<path d=\"M{x:.2} {bottom:.2}v{}\"/>", length(text));
        }
        for (value, text) in &self.y.ticks {
            let y = self.at([self.x.low, *value])[1];
            let _ = writeln!(out, "<path d=\"M{left:.2} {y:.2}h-{}\"/>", length(text));
        }
        out.push_str("</g>\n");
        for (value, text) in &self.x.ticks {
            let (x, y) = (self.at([*value, self.y.low])[0], bottom + 18.0);
            let _ = writeln!(out, "<text x=\"{x:.2}\" y=\"{y:.2}\" text-anchor=\"middle\">{text}</text>");
        }
        for (value, text) in &self.y.ticks {
            let (x, y) = (left - 8.0, self.at([self.x.low, *value])[1] + 0.36 * SIZE);
            let _ = writeln!(out, "<text x=\"{x:.2}\" y=\"{y:.2}\" text-anchor=\"end\">{text}</text>");
        }
        let (cx, cy) = (0.5 * (left + right), 0.5 * (top + bottom));
        let below = bottom + 18.0 + LABEL - 2.0;
        let beside = left - 8.0 - self.y.widest() - 10.0;
        let _ = writeln!(
            out,
            "<text x=\"{cx:.2}\" y=\"{below:.2}\" text-anchor=\"middle\" font-size=\"14\">{}</text>\n\
             <text transform=\"translate({beside:.2} {cy:.2}) rotate(-90)\" text-anchor=\"middle\" font-size=\"14\">{}</text>",
            escaped(&panel.x.label),
            escaped(&panel.y.label)
        );
        self.heading(out, panel);
    }

    fn heading(&self, out: &mut String, panel: &Panel) {
        let gap = if panel.label.is_empty() || panel.title.is_empty() { "" } else { " " };
        let (x, y) = (self.area.left, self.area.top - 9.0);
        let _ = writeln!(
            out,
            "<text x=\"{x:.2}\" y=\"{y:.2}\" font-size=\"14\" xml:space=\"preserve\"><tspan font-weight=\"bold\">{}</tspan>{gap}{}</text>",
            escaped(&panel.label),
            escaped(&panel.title)
        );
    }
}

/// Smallest ranges, in axis units, that contain every layer; `None` for an empty panel.
fn extent(panel: &Panel) -> [Option<[f64; 2]>; 2] {
    let (x, y) = (Scale::new(&panel.x, None), Scale::new(&panel.y, None));
    let mut ranges = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    let within = |scale: &Scale, stated: bool, v: f64| !stated || (scale.low..=scale.high).contains(&v);
    for place in panel.layers.iter().flat_map(places) {
        let [u, v] = [x.units(place[0]), y.units(place[1])];
        // Points outside a stated range of one axis do not affect the other.
        let seen = within(&x, panel.x.range.is_some(), u) && within(&y, panel.y.range.is_some(), v);
        if u.is_finite() && v.is_finite() && seen {
            for (range, value) in ranges.iter_mut().zip([u, v]) {
                *range = [range[0].min(value), range[1].max(value)];
            }
        }
    }
    ranges.map(|[low, high]| (low <= high).then_some([low, high]))
}

/// Points that must be visible for a layer to be shown.
fn places(layer: &Layer) -> Vec<[f64; 2]> {
    match &layer.shape {
        Shape::Curve { stretches, .. } => stretches.iter().flatten().map(|(place, _)| *place).collect(),
        Shape::Scatter { points, .. } => points.clone(),
        Shape::Circle { centre: [x, y], radius: r } => vec![[x - r, *y], [x + r, *y], [*x, y - r], [*x, y + r]],
        Shape::Stems { peaks, .. } => peaks.iter().flat_map(|[x, y]| [[*x, 0.0], [*x, *y]]).collect(),
        Shape::Cells { ranges: [[x0, x1], [y0, y1]], .. } => vec![[*x0, *y0], [*x1, *y1]],
        Shape::Vertical(_) | Shape::Horizontal(_) | Shape::Band(_) => Vec::new(),
        Shape::Label { .. } | Shape::Note { .. } | Shape::Text { .. } => Vec::new(),
    }
}
