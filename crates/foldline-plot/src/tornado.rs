//! Tornado chart: how much each parameter changes a number.

use crate::font::{FAMILY, width};
use crate::palette::{BLUE, GREY, PALE, VERMILION};
use crate::scale::SIZE;
use crate::texts::escaped;
use crate::ticks::{labels, ticks};
use std::fmt::Write;

const WIDTH: f64 = 760.0;
const MARGIN: f64 = 14.0;
const ROW: f64 = 26.0;
const BAR: f64 = 16.0;
const TITLE: f64 = 16.0;

/// Bar of one parameter.
#[derive(Clone, Debug)]
pub struct Bar {
    /// Name of the parameter, and by how much it changes.
    pub name: String,
    /// Change of the number if the parameter decreases and if it increases.
    pub change: [f64; 2],
    /// Half-width of the error of the change.
    pub error: f64,
}

/// Renders bars about zero, the longest on top. `axis` says what changes, `note` stands below.
pub fn tornado(title: &str, axis: &str, bars: &[Bar], note: &str) -> String {
    let mut sorted: Vec<&Bar> = bars.iter().collect();
    let size = |bar: &Bar| bar.change.iter().fold(0.0f64, |most, v| most.max(v.abs()));
    sorted.sort_by(|a, b| size(b).total_cmp(&size(a)));
    let most = sorted.first().map_or(0.0, |bar| size(bar));
    let most = if most > 0.0 && most.is_finite() { 1.08 * most } else { 1.0 };
    let names = bars.iter().map(|bar| width(&bar.name, SIZE)).fold(0.0, f64::max);
    let (left, right) = (MARGIN + names + 12.0, WIDTH - MARGIN - 8.0);
    let top = MARGIN + TITLE + 14.0;
    let bottom = top + ROW * sorted.len().max(1) as f64 + 6.0;
    let height = bottom + 48.0 + if note.is_empty() { 0.0 } else { 20.0 } + MARGIN;
    let at = |value: f64| left + (right - left) * (value + most) / (2.0 * most);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} {height}\" \
         font-family=\"{FAMILY}\" font-size=\"{SIZE}\" fill=\"#222\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
    );
    let mut draw = |text: String| _ = writeln!(out, "{text}");
    let text = |x: f64, y: f64, anchor: &str, size: f64, text: &str| {
        format!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" font-size=\"{size:.1}\">{}</text>",
            escaped(text)
        )
    };
    let room = WIDTH - 2.0 * MARGIN;
    draw(text(MARGIN, MARGIN + TITLE - 3.0, "start", TITLE * (room / width(title, TITLE)).min(1.0), title));
    let places = ticks(-most, most, 7);
    for (value, label) in places.iter().zip(labels(&places)) {
        let x = at(*value);
        draw(format!(
            "<line x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{top:.1}\" y2=\"{bottom:.1}\" stroke=\"{PALE}\" stroke-width=\"0.6\" \
             opacity=\"0.5\"/>"
        ));
        draw(text(x, bottom + 17.0, "middle", SIZE, &label));
    }
    for (k, bar) in sorted.iter().enumerate() {
        let middle = top + ROW * (k as f64 + 0.5) + 3.0;
        draw(text(left - 10.0, middle + 4.5, "end", SIZE, &bar.name));
        for (change, colour) in bar.change.iter().zip([BLUE, VERMILION]) {
            let (a, b) = (at(change.min(0.0)), at(change.max(0.0)));
            let y = middle - BAR / 2.0;
            draw(format!(
                "<rect x=\"{a:.2}\" y=\"{y:.1}\" width=\"{:.2}\" height=\"{BAR}\" fill=\"{colour}\" opacity=\"0.85\"/>",
                b - a
            ));
            // An error that would not be seen is not drawn.
            if bar.error > 0.004 * most {
                let [low, high] = [change - bar.error, change + bar.error].map(at);
                draw(format!(
                    "<line x1=\"{low:.2}\" x2=\"{high:.2}\" y1=\"{middle:.1}\" y2=\"{middle:.1}\" stroke=\"{GREY}\" \
                     stroke-width=\"1.4\"/>"
                ));
            }
        }
    }
    let zero = at(0.0);
    draw(format!(
        "<line x1=\"{zero:.1}\" x2=\"{zero:.1}\" y1=\"{top:.1}\" y2=\"{bottom:.1}\" stroke=\"{GREY}\" stroke-width=\"1.2\"/>"
    ));
    // The legend: a decrease and an increase of the parameter.
    let y = bottom + 40.0;
    draw(text(0.5 * (left + right), y, "middle", SIZE, axis));
    let x = MARGIN;
    for (offset, colour, word) in [(0.0, BLUE, "lower"), (60.0, VERMILION, "higher")] {
        draw(format!(
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"10\" height=\"10\" fill=\"{colour}\" opacity=\"0.85\"/>",
            x + offset,
            y - 9.0
        ));
        draw(text(x + offset + 14.0, y, "start", SIZE, word));
    }
    if !note.is_empty() {
        draw(text(MARGIN, y + 20.0, "start", SIZE * (room / width(note, SIZE)).min(1.0), note));
    }
    out.push_str("</svg>\n");
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_bar_is_on_top_and_its_length_is_its_change() {
        let bar = |name: &str, change: f64| Bar { name: name.into(), change: [-change, change], error: 0.0 };
        let picture = tornado("t", "x", &[bar("short", 0.5), bar("long", -2.0), bar("none", 0.0)], "");
        let place = |name: &str| picture.find(&format!(">{name}<")).unwrap();
        assert!(place("long") < place("short") && place("short") < place("none"));
        let widths: Vec<f64> = picture
            .lines()
            .filter(|line| line.contains("height=\"16\""))
            .map(|line| line.split("width=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap())
            .collect();
        assert_eq!(widths.len(), 6);
        assert!((widths[0] - 4.0 * widths[2]).abs() < 0.1 && widths[4] == 0.0, "{widths:?}");
    }
}
