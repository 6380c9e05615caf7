//! Bifurcation diagrams as SVG, PNG and PDF.
//!
//! **Idea.** A picture is made in three steps: what the axes show ([`quantity`]), which polylines and marks that gives
//! ([`curve`]), and where everything stands on the page ([`page`]). The page is SVG; PNG and PDF are made from it with the
//! embedded font, so they look alike everywhere.
//!
//! Stable pieces are solid, unstable ones dashed, and the change lies exactly at the special point. A branch that comes
//! from a special point of another has its colour, lighter.

pub mod curve;
pub mod font;
pub mod page;
pub mod quantity;
mod render;
pub mod ticks;

pub use page::{Picture, svg};
pub use quantity::Quantity;
pub use render::{RenderError, pdf, png};
