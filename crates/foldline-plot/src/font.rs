//! DejaVu Sans, the font of the pictures, and the width of texts in it.

use std::sync::LazyLock;
use ttf_parser::Face;

/// Font families requested by an SVG, best first.
pub const FAMILY: &str = "DejaVu Sans, Verdana, sans-serif";

static FACE: LazyLock<Option<Face<'static>>> = LazyLock::new(|| Face::parse(dejavu::sans::regular(), 0).ok());

/// Width of a text at a font size, in the same unit.
pub fn width(text: &str, size: f64) -> f64 {
    const UNKNOWN: f64 = 0.6;
    let Some(face) = FACE.as_ref() else { return UNKNOWN * size * text.chars().count() as f64 };
    let em = f64::from(face.units_per_em());
    let advance =
        |c: char| face.glyph_index(c).and_then(|g| face.glyph_hor_advance(g)).map_or(UNKNOWN, |a| f64::from(a) / em);
    text.chars().map(advance).sum::<f64>() * size
}
