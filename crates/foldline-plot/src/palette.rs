//! Colours that are distinguishable with every common kind of colour vision.
//!
//! **Source.** okabe2008.

/// Blue.
pub const BLUE: &str = "#0072b2";
/// Vermilion.
pub const VERMILION: &str = "#d55e00";
/// Bluish green.
pub const GREEN: &str = "#009e73";
/// Reddish purple.
pub const PURPLE: &str = "#cc79a7";
/// Orange.
pub const ORANGE: &str = "#e69f00";
/// Sky blue.
pub const SKY: &str = "#56b4e9";
/// Black.
pub const BLACK: &str = "#000000";
/// Yellow, faint on white.
pub const YELLOW: &str = "#f0e442";
/// Olive, legible on white unlike yellow; not part of the source.
pub const OLIVE: &str = "#8c8400";
/// Dark grey: text, and legend samples that stand for several colours.
pub const GREY: &str = "#444444";
/// Light grey: reference lines behind the curves.
pub const PALE: &str = "#9a9a9a";

/// Returns the k-th colour, starting again after the last.
pub fn nth(k: usize) -> &'static str {
    [BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK, OLIVE][k % 8]
}
