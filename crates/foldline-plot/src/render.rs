//! Conversion of SVG to PNG and PDF.

use resvg::{tiny_skia, usvg};
use std::fmt;
use std::sync::Arc;

/// Reason why a picture could not be rendered.
#[derive(Clone, Debug)]
pub struct RenderError(String);

impl fmt::Display for RenderError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "the picture cannot be rendered: {}", self.0)
    }
}

impl std::error::Error for RenderError {}

fn tree(svg: &str) -> Result<usvg::Tree, RenderError> {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(dejavu::sans::regular().to_vec());
    fonts.load_font_data(dejavu::sans::bold().to_vec());
    let options = usvg::Options { fontdb: Arc::new(fonts), ..usvg::Options::default() };
    usvg::Tree::from_str(svg, &options).map_err(|e| RenderError(e.to_string()))
}

/// Renders a PNG with `scale` pixels per unit of the SVG.
pub fn png(svg: &str, scale: f32) -> Result<Vec<u8>, RenderError> {
    let tree = tree(svg)?;
    let size = tree.size().to_int_size().scale_by(scale).ok_or_else(|| RenderError("it has no size".into()))?;
    let mut pixels = tiny_skia::Pixmap::new(size.width(), size.height())
        .ok_or_else(|| RenderError("there is not enough memory for it".into()))?;
    resvg::render(&tree, tiny_skia::Transform::from_scale(scale, scale), &mut pixels.as_mut());
    pixels.encode_png().map_err(|e| RenderError(e.to_string()))
}

/// Renders a one-page PDF whose text can be searched.
pub fn pdf(svg: &str) -> Result<Vec<u8>, RenderError> {
    let (conversion, page) = (svg2pdf::ConversionOptions::default(), svg2pdf::PageOptions::default());
    svg2pdf::to_pdf(&tree(svg)?, conversion, page).map_err(|e| RenderError(e.to_string()))
}
