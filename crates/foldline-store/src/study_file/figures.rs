//! `[[figure]]`: pictures of a run with several panels.
//!
//! Figures compute nothing. They can be added to a study, or changed, after the run.

use super::branches::quantity;
use super::unique_name;
use crate::nearest::suggest;
use crate::toml_walk::{Value, Walk};
use foldline::contract::VectorField;
use foldline::model::Model;
use std::ops::Range;
use toml::de::DeTable;

const KEYS: [&str; 7] = ["name", "description", "title", "columns", "size", "theme", "panel"];
const PANEL_KEYS: [&str; 14] =
    ["label", "title", "show", "x", "y", "z", "branch", "window", "log", "strobe", "section", "count", "span", "view"];
/// Names of the themes.
pub const THEMES: [&str; 3] = ["light", "dark", "print"];
/// Smallest and largest width and height of a figure.
const SIZES: [f64; 2] = [200.0, 10_000.0];

/// Figure of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct FigurePlan {
    /// Its name.
    pub name: String,
    /// Title above all panels.
    pub title: Option<String>,
    /// Number of columns of panels.
    pub columns: usize,
    /// Width and height, in units of which the text is 13 high.
    pub size: Option<[f64; 2]>,
    /// One of [`THEMES`].
    pub theme: Option<String>,
    /// Panels in reading order.
    pub panels: Vec<PanelPlan>,
}

/// Content of a panel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Show {
    /// Branches, surveys and sweeps in two or three axes.
    #[default]
    Branches,
    /// Curves in two parameters.
    Curves,
    /// Paths of multipliers or eigenvalues.
    Multipliers,
    /// Orbits along a branch.
    Orbits,
    /// Profiles of cycles, one behind the other.
    Waterfall,
    /// Amplitudes of the harmonics of cycles, one behind the other.
    Harmonics,
    /// Spectra of the motions of a survey or sweep.
    Spectrogram,
}

impl Show {
    /// All contents with their names.
    pub const ALL: [(&'static str, Show); 7] = [
        ("branches", Show::Branches),
        ("curves", Show::Curves),
        ("multipliers", Show::Multipliers),
        ("orbits", Show::Orbits),
        ("waterfall", Show::Waterfall),
        ("harmonics", Show::Harmonics),
        ("spectrogram", Show::Spectrogram),
    ];
}

/// Panel of a figure. Quantities are names, for example `Omega` or `x_max`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PanelPlan {
    /// Label before the title; by default a letter if the figure has several panels.
    pub label: Option<String>,
    /// Title.
    pub title: Option<String>,
    /// Content.
    pub show: Show,
    /// Quantities on the axes.
    pub axes: [Option<String>; 3],
    /// Names of the branches shown; empty for all.
    pub branches: Vec<String>,
    /// Limits `[x0, x1, y0, y1]`.
    pub window: Option<[f64; 4]>,
    /// True for each axis that is logarithmic.
    pub log: [bool; 2],
    /// Number of stroboscopic points at each value, or of Poincaré points with a section.
    pub strobe: Option<usize>,
    /// State or output, and the level that it passes upwards.
    pub section: Option<(String, f64)>,
    /// Number of orbits or profiles.
    pub count: Option<usize>,
    /// Number of columns that it spans.
    pub span: usize,
    /// Direction of a view in three axes: azimuth and elevation in degrees.
    pub view: Option<[f64; 2]>,
}

/// Reads the figures.
pub(super) fn read(walk: &mut Walk, root: &DeTable, model: &Model) -> Vec<FigurePlan> {
    let mut found: Vec<FigurePlan> = Vec::new();
    for (span, table) in walk.tables(root, "figure") {
        walk.only(table, &KEYS, "a figure");
        let names: Vec<&str> = found.iter().map(|own| own.name.as_str()).collect();
        let name = unique_name(walk, table, &span, "figure", &names);
        let title = table.get("title").and_then(|value| walk.string(value, "`title`"));
        let columns = table.get("columns").and_then(|value| walk.integer(value, "`columns`", 1..=6)).unwrap_or(1);
        let size = table.get("size").and_then(|value| numbers::<2>(walk, value, "`size`", "[960, 600]"));
        if let (Some(value), Some(size)) = (table.get("size"), size)
            && size.iter().any(|own| !(SIZES[0]..=SIZES[1]).contains(own))
        {
            walk.report(value.span(), "`size` is not between 200 and 10000", "a usual size is [960, 600]");
        }
        let theme = table.get("theme").and_then(|value| one_of(walk, value, "`theme`", &THEMES));
        let panels = walk.tables(table, "panel");
        if panels.is_empty() {
            walk.report(span.clone(), "this figure has no panel", "add `[[figure.panel]]` below it");
        }
        let panels = panels.into_iter().map(|(span, table)| panel(walk, span, table, model)).collect();
        let theme = theme.map(|k| THEMES[k].to_string());
        if let Some(name) = name {
            found.push(FigurePlan { name, title, columns: columns as usize, size, theme, panels });
        }
    }
    found
}

fn panel(walk: &mut Walk, span: Range<usize>, table: &DeTable, model: &Model) -> PanelPlan {
    walk.only(table, &PANEL_KEYS, "a panel");
    let mut own = PanelPlan { span: 1, ..PanelPlan::default() };
    let text = |walk: &mut Walk, key: &str| table.get(key).and_then(|value| walk.string(value, &format!("`{key}`")));
    (own.label, own.title) = (text(walk, "label"), text(walk, "title"));
    if let Some(value) = table.get("show") {
        let names = Show::ALL.map(|(name, _)| name);
        own.show = one_of(walk, value, "`show`", &names).map(|k| Show::ALL[k].1).unwrap_or_default();
    }
    for (k, key) in ["x", "y", "z"].into_iter().enumerate() {
        own.axes[k] = text(walk, key);
        if let (Some(value), Some(name)) = (table.get(key), &own.axes[k])
            && channel(model, name).is_none()
        {
            quantity(walk, name, value.span(), model);
        }
    }
    if let Some(value) = table.get("branch") {
        let list = value.get_ref().as_array().map_or(vec![value], |list| list.iter().collect());
        own.branches = list.into_iter().filter_map(|one| walk.string(one, "an entry of `branch`")).collect();
    }
    own.window = table.get("window").and_then(|value| window(walk, value));
    if let Some(value) = table.get("log") {
        let names = ["x", "y", "xy"];
        own.log = one_of(walk, value, "`log`", &names).map_or([false; 2], |k| [k != 1, k != 0]);
    }
    own.strobe =
        table.get("strobe").and_then(|value| walk.integer(value, "`strobe`", 1..=100_000)).map(|count| count as usize);
    own.section = table.get("section").and_then(|value| section(walk, value, model));
    if let (Some(_), None, false) = (table.get("strobe"), table.get("section"), model.forced()) {
        let message = "the model is not forced: there is no forcing period";
        let name = model.states.first().map_or("x", |own| &own.name);
        walk.report(span, message, format!("give a level at which points are taken: `section = {{ {name} = 0 }}`"));
    }
    own.count =
        table.get("count").and_then(|value| walk.integer(value, "`count`", 1..=400)).map(|count| count as usize);
    own.span = table.get("span").and_then(|value| walk.integer(value, "`span`", 1..=6)).unwrap_or(1) as usize;
    own.view = table.get("view").and_then(|value| numbers::<2>(walk, value, "`view`", "[-60, 25]"));
    own
}

/// Index of a state or, after the states, of an output.
pub fn channel(model: &Model, name: &str) -> Option<usize> {
    model.state_index(name).or_else(|| model.output_index(name).map(|k| model.states.len() + k))
}

fn section(walk: &mut Walk, value: &Value, model: &Model) -> Option<(String, f64)> {
    let table = walk.table(value, "`section`")?;
    let mut entries = table.iter();
    let (Some((key, level)), None) = (entries.next(), entries.next()) else {
        walk.report(value.span(), "`section` does not name one state or output", "write `section = { x = 0 }`");
        return None;
    };
    if channel(model, key.get_ref()).is_none() {
        let names = model.states.iter().map(|own| &own.name).chain(model.outputs.iter().map(|own| &own.name));
        let names: Vec<&str> = names.map(String::as_str).collect();
        let message = format!("there is no state or output `{}`", key.get_ref());
        walk.report(key.span(), message, suggest(key.get_ref(), &names));
    }
    Some((key.get_ref().to_string(), walk.number(level, "the level")?))
}

fn window(walk: &mut Walk, value: &Value) -> Option<[f64; 4]> {
    let found = numbers::<4>(walk, value, "`window`", "[0, 1, -2, 2]")?;
    if found[0] >= found[1] || found[2] >= found[3] {
        walk.report(
            value.span(),
            "a range of `window` is empty or reversed",
            "write [x0, x1, y0, y1] with x0 < x1 and y0 < y1",
        );
        return None;
    }
    Some(found)
}

fn numbers<const N: usize>(walk: &mut Walk, value: &Value, what: &str, example: &str) -> Option<[f64; N]> {
    let list = value.get_ref().as_array().map(|list| list.iter().collect::<Vec<_>>()).unwrap_or_default();
    if list.len() != N {
        walk.report(
            value.span(),
            format!("{what} is not a list of {N} numbers"),
            format!("write, for example, {example}"),
        );
        return None;
    }
    let found: Vec<f64> = list.into_iter().filter_map(|one| walk.number(one, &format!("an entry of {what}"))).collect();
    found.try_into().ok()
}

/// Index of a text among the names.
fn one_of(walk: &mut Walk, value: &Value, what: &str, names: &[&str]) -> Option<usize> {
    let text = walk.string(value, what)?;
    let found = names.iter().position(|name| *name == text);
    if found.is_none() {
        let hint = if names.len() > 3 { suggest(&text, names) } else { format!("one of: {}", names.join(", ")) };
        walk.report(value.span(), format!("{what} cannot be `{text}`"), hint);
    }
    found
}
