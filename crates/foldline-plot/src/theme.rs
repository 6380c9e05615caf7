//! Colours of a whole picture.
//!
//! **Idea.** Pictures are drawn in the colours of the light theme. The dark theme replaces these colours, one by one, in
//! the finished SVG. The print theme draws all curves and marks black, before anything is placed, and puts small marks
//! along the curves in place of their colours.

use crate::figure::{Figure, Layer, Marker, Shape};
use crate::palette::{BLACK, GREY, PALE};

/// Colours of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Theme {
    /// Colours on white.
    #[default]
    Light,
    /// Lighter colours on a dark background, for slides.
    Dark,
    /// Black on white; curves differ by marks along them.
    Print,
}

impl Theme {
    /// All themes with their names.
    pub const ALL: [(&'static str, Theme); 3] =
        [("light", Theme::Light), ("dark", Theme::Dark), ("print", Theme::Print)];

    /// Returns the theme of that name.
    pub fn named(name: &str) -> Option<Theme> {
        Theme::ALL.into_iter().find(|(own, _)| *own == name).map(|(_, theme)| theme)
    }
}

/// Background of the dark theme.
const GROUND: &str = "#14181d";

/// Colours of the light theme with those that replace them in the dark one. Each curve colour has a contrast of at least
/// 4.5 with [`GROUND`].
const DARK: [(&str, &str); 28] = [
    ("#fff", GROUND),
    ("#ffffff", GROUND),
    ("#222", "#e8ebee"),
    ("#444444", "#c3cad1"),
    ("#444", "#c3cad1"),
    ("#555", "#98a2ac"),
    ("#666", "#a6b0ba"),
    ("#ccc", "#3c454e"),
    ("#e8e8e8", "#293038"),
    ("#8f8f8f", "#7d8791"),
    ("#c8c8c8", "#3c454e"),
    ("#000000", "#f4f6f8"),
    ("#0072b2", "#4aa8e0"),
    ("#d55e00", "#f08043"),
    ("#009e73", "#2fc298"),
    ("#cc79a7", "#dd94bd"),
    ("#e69f00", "#e9ae33"),
    ("#56b4e9", "#86cdf2"),
    ("#8c8400", "#d8cf4a"),
    ("#f0e442", "#f0e442"),
    ("#c68500", "#e9ae33"),
    ("#2f9bd8", "#86cdf2"),
    ("#b45000", "#f08043"),
    ("#007d5b", "#2fc298"),
    ("#a5578b", "#dd94bd"),
    ("#8a6000", "#e9ae33"),
    ("#1b77ab", "#86cdf2"),
    ("#736c00", "#d8cf4a"),
];

/// Returns a finished picture in the colours of the theme. For [`Theme::Print`] see [`black`], which comes before.
pub fn themed(svg: String, theme: Theme) -> String {
    if theme != Theme::Dark {
        return svg;
    }
    // Colours are values of attributes; texts contain no quotation marks.
    let mut out = String::with_capacity(svg.len());
    let mut rest = svg.as_str();
    while let Some(at) = rest.find("=\"#") {
        let (before, from) = rest.split_at(at + 2);
        let end = from.find('"').unwrap_or(from.len());
        let new = DARK.iter().find(|(old, _)| *old == &from[..end]).map_or(&from[..end], |(_, new)| new);
        out.push_str(before);
        out.push_str(new);
        rest = &from[end..];
    }
    out.push_str(rest);
    out
}

/// Marks along curves, for all but the first colour.
const BEADS: [Marker; 7] =
    [Marker::Circle, Marker::Square, Marker::Triangle, Marker::Cross, Marker::Diamond, Marker::Nabla, Marker::Plus];

/// Draws curves, marks and texts of a figure black. Curves of different colours get different small marks along them.
/// Cells and shaded intervals stay as they are.
pub fn black(mut figure: Figure) -> Figure {
    let mut seen: Vec<&'static str> = Vec::new();
    for layer in figure.panels.iter_mut().flat_map(|panel| &mut panel.layers) {
        // The lines of sweeps have no names; marks tell them apart already.
        let named = layer.name.is_some() && matches!(layer.shape, Shape::Curve { .. });
        if named && ![GREY, PALE].contains(&layer.colour) {
            let index = seen.iter().position(|own| *own == layer.colour).unwrap_or_else(|| {
                seen.push(layer.colour);
                seen.len() - 1
            });
            layer.bead = index.checked_sub(1).map(|k| BEADS[k % BEADS.len()]);
        }
        blacken(layer);
    }
    figure
}

fn blacken(layer: &mut Layer) {
    if !matches!(layer.shape, Shape::Cells { .. } | Shape::Band(_)) && ![GREY, PALE].contains(&layer.colour) {
        layer.colour = BLACK;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::{Axis, Panel};
    use crate::palette::{contrast, ink, nth};

    #[test]
    fn colours_of_curves_are_legible_on_the_dark_ground() {
        for colour in (0..8).map(nth).chain((0..8).map(|k| ink(nth(k)))).chain([GREY, PALE]) {
            let svg = themed(format!("<path stroke=\"{colour}\"/>"), Theme::Dark);
            let new = &svg[svg.find('#').expect("a colour")..][..7];
            assert!(contrast(new, GROUND) >= 4.5, "{colour} becomes {new}: {}", contrast(new, GROUND));
        }
    }

    #[test]
    fn texts_that_look_like_colours_stay() {
        let svg = "<text fill=\"#222\">=&quot;#222 #fff</text>".to_string();
        assert_eq!(themed(svg, Theme::Dark), "<text fill=\"#e8ebee\">=&quot;#222 #fff</text>");
    }

    #[test]
    fn black_curves_differ_by_their_marks() {
        let curve = |k: usize| Layer::curve(&[[0.0, k as f64], [1.0, k as f64]], nth(k)).named(k.to_string());
        let panel = Panel::new("", "", Axis::new("x"), Axis::new("y")).with_all((0..8).map(curve));
        let figure = black(Figure { panels: vec![panel], ..Figure::default() });
        let beads: Vec<_> = figure.panels[0].layers.iter().map(|layer| (layer.colour, layer.bead)).collect();
        assert!(beads.iter().all(|(colour, _)| *colour == BLACK));
        for (k, (_, own)) in beads.iter().enumerate() {
            assert!(beads[..k].iter().all(|(_, other)| other != own), "curve {k}");
        }
    }
}
