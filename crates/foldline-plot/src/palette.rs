//! Colours that are distinguishable with every common kind of colour vision.
//!
//! **Idea.** Curves and marks have a contrast of at least 3 with the background, texts of at least 4.5, as the Web Content
//! Accessibility Guidelines 2.2 (1.4.3 and 1.4.11) demand. Areas keep the light colours of the source: they touch each
//! other, and the legend shows each beside its name.
//!
//! **Source.** okabe2008.
//!
//! **Departures.** Orange and sky blue of curves are darker than in the source, and olive replaces yellow.

/// Blue.
pub const BLUE: &str = "#0072b2";
/// Vermilion.
pub const VERMILION: &str = "#d55e00";
/// Bluish green.
pub const GREEN: &str = "#009e73";
/// Reddish purple.
pub const PURPLE: &str = "#cc79a7";
/// Orange, for areas.
pub const ORANGE: &str = "#e69f00";
/// Sky blue, for areas.
pub const SKY: &str = "#56b4e9";
/// Orange that is legible on white.
pub const AMBER: &str = "#c68500";
/// Sky blue that is legible on white.
pub const AZURE: &str = "#2f9bd8";
/// Black.
pub const BLACK: &str = "#000000";
/// Yellow, faint on white.
pub const YELLOW: &str = "#f0e442";
/// Olive, legible on white unlike yellow; not part of the source.
pub const OLIVE: &str = "#8c8400";
/// Dark grey: text, and legend samples that stand for several colours.
pub const GREY: &str = "#444444";
/// Light grey: reference lines behind the curves.
pub const PALE: &str = "#8f8f8f";

/// Returns the k-th colour, starting again after the last.
pub fn nth(k: usize) -> &'static str {
    [BLUE, VERMILION, GREEN, PURPLE, AMBER, AZURE, BLACK, OLIVE][k % 8]
}

/// Returns the colour of texts that belong to curves or marks of a colour: the same hue, dark enough to be read.
pub fn ink(colour: &'static str) -> &'static str {
    match colour {
        VERMILION => "#b45000",
        GREEN => "#007d5b",
        PURPLE => "#a5578b",
        AMBER => "#8a6000",
        AZURE => "#1b77ab",
        OLIVE => "#736c00",
        PALE => GREY,
        other => other,
    }
}

/// Contrast ratio of two colours `#rrggbb`, from 1 to 21 (Web Content Accessibility Guidelines 2.2).
///
/// # Panics
///
/// If a colour is not of this form.
pub fn contrast(a: &str, b: &str) -> f64 {
    let luminance = |colour: &str| {
        let part = |k: usize| {
            let value = f64::from(u8::from_str_radix(&colour[k..k + 2], 16).expect("a colour #rrggbb")) / 255.0;
            if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * part(1) + 0.7152 * part(3) + 0.0722 * part(5) + 0.05
    };
    let (a, b) = (luminance(a), luminance(b));
    (a / b).max(b / a)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: &str = "#ffffff";

    #[test]
    fn curves_and_their_texts_are_legible_on_white() {
        assert!((contrast(BLACK, WHITE) - 21.0).abs() < 1e-12 && contrast(BLUE, BLUE) == 1.0);
        for colour in (0..8).map(nth).chain([GREY, PALE]) {
            assert!(contrast(colour, WHITE) >= 3.0, "{colour}: {}", contrast(colour, WHITE));
            let ink = ink(colour);
            assert!(contrast(ink, WHITE) >= 4.5, "{ink}, text of {colour}: {}", contrast(ink, WHITE));
        }
    }
}
