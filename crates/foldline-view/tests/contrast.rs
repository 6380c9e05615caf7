//! Colours of the page against the Web Content Accessibility Guidelines 2.2: texts have a contrast of at least 4.5 with every
//! background (1.4.3), curves, marks and rings of focus one of at least 3 (1.4.11).

use foldline_plot::palette::contrast;
use std::collections::HashMap;

const STYLE: &str = include_str!("../page/app.css");
const COLOURS: &str = include_str!("../page/colours.js");

/// Colours that the rule of a selector defines, by name.
fn defined(selector: &str) -> HashMap<&'static str, &'static str> {
    let rule = STYLE.split_once(selector).expect("the rule").1.split_once('}').expect("its end").0;
    let pairs = rule.split(';').filter_map(|line| line.trim().trim_start_matches("{\n").trim().split_once(": "));
    pairs.filter(|(_, value)| value.starts_with('#')).collect()
}

/// All colours in a part of the script.
fn colours(part: &str) -> Vec<&str> {
    part.match_indices("\"#").map(|(at, _)| &part[at + 1..at + 8]).collect()
}

fn at_least(least: f64, colour: &str, ground: &str, name: &str) {
    let found = contrast(colour, ground);
    assert!(found >= least, "{name}: {colour} on {ground} has a contrast of {found:.2}, less than {least}");
}

#[test]
fn texts_and_marks_are_legible_in_both_themes() {
    let list = |name: &str| {
        let from = COLOURS.split_once(&format!("const {name} = ")).expect("the list").1;
        colours(from.split_once(';').expect("its end").0)
    };
    for (selector, branches) in [(":root {", "LIGHT"), (":root[data-theme=\"dark\"] {", "DARK")] {
        let own = defined(selector);
        for text in ["--fg", "--soft", "--faint", "--warn"] {
            for ground in ["--bg", "--panel", "--hover", "--accent-soft"] {
                at_least(4.5, own[text], own[ground], &format!("{selector} {text} on {ground}"));
            }
        }
        for ground in ["--bg", "--panel", "--hover", "--accent-soft"] {
            at_least(3.0, own["--accent"], own[ground], selector);
            at_least(3.0, own["--focus"], own[ground], selector);
        }
        at_least(4.5, own["--on-accent"], own["--accent"], selector);
        let (lines, marks) = (list(branches), list("KINDS"));
        assert!(lines.len() == 8 && marks.len() > 15, "{} and {}", lines.len(), marks.len());
        for colour in lines.into_iter().chain(marks) {
            at_least(3.0, colour, own["--panel"], branches);
        }
    }
}
