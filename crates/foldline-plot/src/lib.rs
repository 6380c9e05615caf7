//! Bifurcation diagrams and other figures as SVG, PNG and PDF.
//!
//! **Idea.** A figure is plain data: panels with axes and layers ([`figure`]). Branches become layers ([`branches`],
//! [`curve`]) once the axes are known ([`quantity`]); then everything is placed on the page ([`figure_svg`]). The page
//! is SVG; PNG and PDF are made from it with the embedded font, so they look alike everywhere.
//!
//! Stable pieces are solid and unstable ones dashed; the change lies exactly at the special point. A branch that starts
//! at a special point of another branch has the colour of that branch, but is thinner.

pub mod basins;
pub mod branches;
mod compose;
pub mod curve;
pub mod figure;
pub mod font;
mod frame;
mod legend;
pub mod map;
pub mod orbits;
pub mod page;
mod paint;
pub mod palette;
pub mod profile;
pub mod quantity;
#[cfg(feature = "render")]
mod render;
pub mod responses;
mod scale;
pub mod sections;
pub mod space;
pub mod spectra;
pub mod spectrogram;
mod texts;
pub mod theme;
pub mod ticks;
pub mod tornado;
pub mod waterfall;

pub use branches::{branch_curve, branch_layers, deviation_layers, diagram_layers, special_layers};
pub use compose::figure_svg;
pub use figure::{Axis, Figure, Layer, LegendPlace, Marker, Panel};
pub use foldline::special::quantity::Quantity;
pub use page::{Picture, svg};
pub use quantity::{axis, label};
#[cfg(feature = "render")]
pub use render::{RenderError, pdf, png};
pub use responses::response_layers;
pub use tornado::{Bar, tornado};
