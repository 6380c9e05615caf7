//! Legend of colours, line styles and marks.

use crate::figure::{Layer, LegendPlace, Panel, Shape};
use crate::font::width;
use crate::frame::Frame;
use crate::paint::{BEAD, DASHES, mark, text_at};
use crate::palette::GREY;
use crate::scale::SIZE;
use std::fmt::Write;

const LINE: f64 = 20.0;
const SAMPLE: f64 = 26.0;
const GAP: f64 = 8.0;
const BETWEEN: f64 = 22.0;

/// List of samples with names: named layers, then the line styles where they indicate stability.
#[derive(Clone, Debug, Default)]
pub(crate) struct Legend {
    entries: Vec<(String, Layer)>,
}

impl Legend {
    /// Returns the legend of the layers visible in a panel. A named layer without points is listed too.
    pub fn of(panel: &Panel, frame: &Frame) -> Legend {
        let mut legend = Legend::default();
        legend.add(panel, frame);
        legend
    }

    /// Returns one legend for the layers visible in any of the panels.
    pub fn shared<'p>(panels: impl Iterator<Item = (&'p Panel, &'p Frame)>) -> Legend {
        let mut legend = Legend::default();
        let mut stability = [false; 2];
        for (panel, frame) in panels.filter(|(p, _)| p.legend == LegendPlace::None) {
            legend.named(panel, frame);
            let here = styles(panel, frame);
            stability = [stability[0] | here[0], stability[1] | here[1]];
        }
        legend.styles(stability);
        legend
    }

    fn add(&mut self, panel: &Panel, frame: &Frame) {
        self.named(panel, frame);
        self.styles(styles(panel, frame));
    }

    fn named(&mut self, panel: &Panel, frame: &Frame) {
        for layer in panel.layers.iter().filter(|l| l.is_empty() || is_visible(l, frame)) {
            let Some(name) = &layer.name else { continue };
            match self.entries.iter_mut().find(|(known, _)| known == name) {
                Some((_, sample)) if sample.colour != layer.colour || sample.bead != layer.bead => {
                    (sample.colour, sample.bead) = (GREY, None);
                }
                Some(_) => {}
                None => self.entries.push((name.clone(), layer.clone())),
            }
        }
        // Marks after lines.
        self.entries.sort_by_key(|(_, layer)| matches!(layer.shape, Shape::Scatter { .. }));
    }

    fn styles(&mut self, [stable, unstable]: [bool; 2]) {
        if !(stable && unstable) {
            return;
        }
        let lines = self.entries.partition_point(|(_, layer)| !matches!(layer.shape, Shape::Scatter { .. }));
        let sample = Layer::curve(&[], GREY);
        let both = [("stable".to_string(), sample.clone()), ("unstable".to_string(), Layer { dashed: true, ..sample })];
        self.entries.splice(lines..lines, both);
    }

    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Width and height when set as one column.
    pub fn size(&self) -> [f64; 2] {
        let widest = self.entries.iter().map(|(name, _)| width(name, SIZE)).fold(0.0, f64::max);
        [SAMPLE + GAP + widest, LINE * self.entries.len() as f64]
    }

    /// Draws the legend as one column.
    pub fn column(&self, out: &mut String, left: f64, top: f64) {
        for (k, (name, layer)) in self.entries.iter().enumerate() {
            entry(out, left, top + (k as f64 + 0.5) * LINE, name, layer);
        }
    }

    /// Entries in rows no wider than `room`.
    fn rows(&self, room: f64) -> Vec<Vec<&(String, Layer)>> {
        let mut rows: Vec<Vec<&(String, Layer)>> = vec![Vec::new()];
        let mut used = 0.0;
        for item in &self.entries {
            let need = entry_width(&item.0);
            if used > 0.0 && used + need > room {
                rows.push(Vec::new());
                used = 0.0;
            }
            used += need + BETWEEN;
            if let Some(row) = rows.last_mut() {
                row.push(item);
            }
        }
        rows
    }

    /// Height when set in rows no wider than `room`.
    pub fn height_in_rows(&self, room: f64) -> f64 {
        if self.is_empty() { 0.0 } else { LINE * self.rows(room).len() as f64 }
    }

    /// Draws the legend as centred rows.
    pub fn in_rows(&self, out: &mut String, left: f64, top: f64, room: f64) {
        for (k, row) in self.rows(room).into_iter().enumerate() {
            let total: f64 = row.iter().map(|(name, _)| entry_width(name) + BETWEEN).sum::<f64>() - BETWEEN;
            let mut x = left + 0.5 * (room - total).max(0.0);
            for (name, layer) in row {
                entry(out, x, top + (k as f64 + 0.5) * LINE, name, layer);
                x += entry_width(name) + BETWEEN;
            }
        }
    }
}

fn entry_width(name: &str) -> f64 {
    SAMPLE + GAP + width(name, SIZE)
}

fn entry(out: &mut String, left: f64, y: f64, name: &str, layer: &Layer) {
    let (colour, middle) = (layer.colour, left + 0.5 * SAMPLE);
    match &layer.shape {
        Shape::Scatter { marker, filled, .. } => {
            mark(out, *marker, [middle, y], &Layer { width: layer.width.max(2.5), ..layer.clone() }, *filled);
        }
        Shape::Band(_) | Shape::Cells { .. } => {
            let (top, opacity) = (y - 6.0, layer.opacity);
            let _ = writeln!(
                out,
                "<rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{SAMPLE}\" height=\"12\" fill=\"{colour}\" opacity=\"{opacity}\"/>"
            );
        }
        _ => {
            let dashes = if layer.dashed { format!(" stroke-dasharray=\"{DASHES}\"") } else { String::new() };
            let (width, opacity) = (layer.width.max(1.2), layer.opacity);
            let _ = writeln!(
                out,
                "<path d=\"M{left:.2} {y:.2}h{SAMPLE}\" stroke=\"{colour}\" stroke-width=\"{width}\" opacity=\"{opacity}\"{dashes}/>"
            );
            if let Some(bead) = layer.bead {
                mark(out, bead, [middle, y], &Layer { width: BEAD, ..layer.clone() }, true);
            }
        }
    }
    text_at(out, left + SAMPLE + GAP, y, name);
}

/// True if part of a layer lies within the axes.
fn is_visible(layer: &Layer, frame: &Frame) -> bool {
    match &layer.shape {
        Shape::Curve { stretches, .. } => stretches.iter().any(|stretch| {
            let line: Vec<[f64; 2]> = stretch.iter().map(|(place, _)| frame.units(*place)).collect();
            !frame.visible(&line).is_empty()
        }),
        Shape::Scatter { points, .. } => points.iter().any(|p| frame.holds(frame.units(*p))),
        Shape::Stems { peaks, .. } => !peaks.is_empty(),
        _ => true,
    }
}

/// True if stable, and unstable, segments are visible of curves whose style shows stability.
fn styles(panel: &Panel, frame: &Frame) -> [bool; 2] {
    let mut seen = [false; 2];
    for layer in &panel.layers {
        let Shape::Curve { stretches, stability: true, .. } = &layer.shape else { continue };
        for pair in stretches.iter().flat_map(|stretch| stretch.windows(2)) {
            let line = [frame.units(pair[0].0), frame.units(pair[1].0)];
            seen[usize::from(!pair[1].1)] |= !frame.visible(&line).is_empty();
        }
    }
    seen
}
