//! Layout of a figure on the page.

use crate::figure::{Figure, LegendPlace, Panel};
use crate::font::{FAMILY, width};
use crate::frame::{Frame, LABEL};
use crate::legend::Legend;
use crate::paint::Painter;
use crate::scale::SIZE;
use crate::texts::{Area, Occupied, escaped};
use std::fmt::Write;

const MARGIN: f64 = 14.0;
const BETWEEN: f64 = 18.0;
const TITLE: f64 = 17.0;

/// Renders a figure as SVG.
pub fn figure_svg(figure: &Figure) -> String {
    let mut frames: Vec<Frame> = figure.panels.iter().map(Frame::of).collect();
    let top = MARGIN + if figure.title.is_some() { TITLE + 14.0 } else { 0.0 };
    let mut bottom = arrange(figure, &mut frames, top);
    let room = figure.width - 2.0 * MARGIN;
    let shared = match figure.legend {
        true => Legend::shared(figure.panels.iter().zip(&frames)),
        false => Legend::default(),
    };
    let legend_top = bottom + 6.0;
    if !shared.is_empty() {
        bottom = legend_top + shared.height_in_rows(room);
    }
    let (w, h) = (figure.width, (bottom + MARGIN).ceil());
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" \
         font-family=\"{FAMILY}\" font-size=\"{SIZE}\" fill=\"#222\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
    );
    if let Some(title) = &figure.title {
        // A title that is too wide is set smaller.
        let size = TITLE * (room / width(title, TITLE)).min(1.0);
        let _ = writeln!(
            out,
            "<text x=\"{MARGIN}\" y=\"{}\" font-size=\"{size:.1}\">{}</text>",
            MARGIN + 14.0,
            escaped(title)
        );
    }
    for (panel, frame) in figure.panels.iter().zip(&frames) {
        draw(&mut out, panel, frame);
    }
    if !shared.is_empty() {
        shared.in_rows(&mut out, MARGIN, legend_top, room);
    }
    out.push_str("</svg>\n");
    out
}

/// Places the panels row by row, with axes in a column aligned. Returns the bottom of the last row.
fn arrange(figure: &Figure, frames: &mut [Frame], top: f64) -> f64 {
    let columns = figure.columns.max(1);
    let column = (figure.width - 2.0 * MARGIN - BETWEEN * (columns - 1) as f64) / columns as f64;
    let mut cells = Vec::new();
    let (mut at, mut y, mut row) = (0, top, 0.0_f64);
    for panel in &figure.panels {
        let span = panel.span.clamp(1, columns);
        if at + span > columns {
            (at, y, row) = (0, y + row + 8.0, 0.0);
        }
        cells.push((at, span, y));
        row = row.max(panel.height);
        at += span;
    }
    for k in 0..cells.len() {
        frames[k].divide_y(figure.panels[k].height - 80.0);
    }
    let widest = |column: usize, frames: &[Frame]| {
        let here = cells.iter().zip(frames).filter(|((at, ..), _)| *at == column);
        here.map(|(_, frame)| frame.y.widest()).fold(0.0, f64::max)
    };
    let margins: Vec<f64> = (0..columns).map(|c| widest(c, frames) + 18.0 + 14.0).collect();
    for (k, (at, span, y)) in cells.iter().enumerate() {
        let panel = &figure.panels[k];
        let left = MARGIN + *at as f64 * (column + BETWEEN);
        let beside = match panel.legend {
            LegendPlace::Beside => Legend::of(panel, &provisional(&frames[k], panel)).size()[0] + 16.0,
            _ => 0.0,
        };
        let right = left + *span as f64 * column + (*span - 1) as f64 * BETWEEN - beside - 10.0;
        let heading = if panel.label.is_empty() && panel.title.is_empty() { 4.0 } else { 24.0 };
        let left = left + margins[*at];
        let area =
            Area { left, right: right.max(left + 40.0), top: y + heading, bottom: y + panel.height - 20.0 - LABEL };
        frames[k].place(area, panel.equal);
    }
    y + row
}

/// Frame used only for its range.
fn provisional(frame: &Frame, panel: &Panel) -> Frame {
    let mut frame = frame.clone();
    frame.place(Area { left: 0.0, right: 400.0, top: 0.0, bottom: 300.0 }, panel.equal);
    frame
}

fn draw(out: &mut String, panel: &Panel, frame: &Frame) {
    if !panel.bare {
        frame.grid(out);
    }
    let mut painter = Painter::new(frame);
    for zoom in &panel.zooms {
        painter.zoom(zoom);
    }
    for layer in &panel.layers {
        painter.layer(layer);
    }
    let legend = if panel.legend == LegendPlace::None { Legend::default() } else { Legend::of(panel, frame) };
    painter.finish(out, |page, out| match panel.legend {
        LegendPlace::Inside if !legend.is_empty() => inside(&legend, page, out),
        LegendPlace::Beside => legend.column(out, frame.area.right + 16.0, frame.area.top),
        _ => {}
    });
    frame.axes(out, panel);
}

fn inside(legend: &Legend, page: &mut Occupied, out: &mut String) {
    const INSET: f64 = 7.0;
    let [w, h] = legend.size();
    let area = page.at_the_border(w + 2.0 * INSET, h + 4.0, 6.0);
    let (w, h) = (area.right - area.left, area.bottom - area.top);
    let _ = writeln!(
        out,
        "<rect x=\"{:.2}\" y=\"{:.2}\" width=\"{w:.2}\" height=\"{h:.2}\" fill=\"#fff\" fill-opacity=\"0.85\" stroke=\"#ccc\" \
         stroke-width=\"0.8\"/>",
        area.left, area.top
    );
    legend.column(out, area.left + INSET, area.top + 2.0);
}
