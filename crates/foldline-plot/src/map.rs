//! Maps over parameters.
//!
//! **Idea.** Over two parameters, each cell is filled with the colour of its text, or of the class to which its number
//! belongs. Over one parameter, numbers are curves through the cells, one for each motion or special point.

use crate::compose::figure_svg;
use crate::figure::{Axis, Figure, Layer, LegendPlace, Marker, Panel};
use crate::palette;
use crate::quantity::with_greek;

/// Colours of areas with a text.
const AREAS: [&str; 7] = [
    palette::SKY,
    palette::ORANGE,
    palette::GREEN,
    palette::YELLOW,
    palette::PURPLE,
    palette::BLUE,
    palette::VERMILION,
];
/// Colours of classes of a number, from small to large: equal steps of the lightness of one scale from dark blue to
/// yellow, which stay in order without colour.
pub(crate) const CLASSES: [&str; 8] =
    ["#440154", "#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#fde725"];
/// Colour of cells without a value.
const NONE: &str = "#c8c8c8";
/// Least number of columns and rows of the picture if the values of a parameter are not equally spaced.
const FINE: usize = 400;

/// A parameter of a map: its name, unit and values.
pub struct Along<'a> {
    /// Name.
    pub name: &'a str,
    /// Unit; empty if unknown.
    pub unit: &'a str,
    /// Values.
    pub values: &'a [f64],
}

impl Along<'_> {
    fn label(&self) -> String {
        match self.unit {
            "" | "1" | "-" => with_greek(self.name),
            unit => format!("{} [{unit}]", with_greek(self.name)),
        }
    }

    /// Range of the picture, and for each of its columns the index of the value nearest to its middle.
    fn columns(&self) -> ([f64; 2], Vec<usize>) {
        let mut order: Vec<usize> = (0..self.values.len()).collect();
        order.sort_by(|a, b| self.values[*a].total_cmp(&self.values[*b]));
        let sorted: Vec<f64> = order.iter().map(|k| self.values[*k]).collect();
        let (first, last) = (sorted[0], sorted[sorted.len() - 1]);
        if sorted.len() == 1 {
            let half = if first == 0.0 { 0.5 } else { 0.5 * first.abs() };
            return ([first - half, first + half], order);
        }
        let steps: Vec<f64> = sorted.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let range = [first - 0.5 * steps[0], last + 0.5 * steps[steps.len() - 1]];
        let even = (last - first) / steps.len() as f64;
        // Rounding of the values leaves such differences of the steps.
        if steps.iter().all(|step| (step - even).abs() < 1e-6 * even) {
            return (range, order);
        }
        let count = FINE.max(sorted.len());
        let nearest = |k: usize| {
            let place = range[0] + (k as f64 + 0.5) / count as f64 * (range[1] - range[0]);
            let above = sorted.partition_point(|value| *value < place).min(sorted.len() - 1);
            let below = above.saturating_sub(1);
            if place - sorted[below] < sorted[above] - place { below } else { above }
        };
        (range, (0..count).map(|k| order[nearest(k)]).collect())
    }
}

/// Values in the cells over two parameters, those of the second varying fastest.
pub enum Shown {
    /// Texts; `None` where there is none.
    Texts(Vec<Option<String>>),
    /// Numbers; NaN where there is none.
    Numbers(Vec<f64>),
}

/// Renders a map over two parameters as SVG.
pub fn plane_svg(x: &Along, y: &Along, shown: &Shown, title: &str) -> String {
    let ((across, columns), (up, rows)) = (x.columns(), y.columns());
    let index = |column: usize, row: usize| columns[column] * y.values.len() + rows[row];
    let mut layers: Vec<Layer> = Vec::new();
    let mut area = |inside: &dyn Fn(usize) -> bool, colour: &'static str, name: String| {
        let filled: Vec<bool> = (0..rows.len())
            .flat_map(|row| (0..columns.len()).map(move |column| (column, row)))
            .map(|(column, row)| inside(index(column, row)))
            .collect();
        if filled.contains(&true) {
            layers.push(Layer::cells([across, up], columns.len(), filled, colour).named(name));
        }
    };
    match shown {
        Shown::Texts(texts) => {
            let mut kinds: Vec<&String> = texts.iter().flatten().collect();
            kinds.sort();
            kinds.dedup();
            for (k, kind) in kinds.into_iter().enumerate() {
                area(&|cell| texts[cell].as_ref() == Some(kind), AREAS[k % AREAS.len()], kind.clone());
            }
            area(&|cell| texts[cell].is_none(), NONE, "no value".into());
        }
        Shown::Numbers(numbers) => {
            let finite = || numbers.iter().copied().filter(|value| value.is_finite());
            let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
            let count = CLASSES.len() as f64;
            let class = |value: f64| {
                if high > low { ((value - low) / (high - low) * count).floor().min(count - 1.0) as usize } else { 0 }
            };
            for (k, colour) in CLASSES.into_iter().enumerate() {
                let end = |k: usize| low + k as f64 / count * (high - low);
                let name = if high > low { format!("{:.4} to {:.4}", end(k), end(k + 1)) } else { format!("{low:.6}") };
                area(&|cell| numbers[cell].is_finite() && class(numbers[cell]) == k, colour, name);
            }
            area(&|cell| !numbers[cell].is_finite(), NONE, "no value".into());
        }
    }
    let [across, up] = [(x, across), (y, up)].map(|(own, range)| Axis::new(own.label()).from(range[0], range[1]));
    let panel =
        Panel { legend: LegendPlace::Beside, height: 560.0, ..Panel::new("", title, across, up).with_all(layers) };
    figure_svg(&Figure { panels: vec![panel], width: 880.0, ..Figure::default() })
}

/// Renders a map over one parameter as SVG: for each name a value at each value of the parameter; NaN where there is none.
pub fn line_svg(x: &Along, quantity: &str, curves: &[(String, Vec<f64>)], title: &str) -> String {
    let mut order: Vec<usize> = (0..x.values.len()).collect();
    order.sort_by(|a, b| x.values[*a].total_cmp(&x.values[*b]));
    let mut panel = Panel::new("", title, Axis::new(x.label()), Axis::new(quantity));
    for (k, (name, values)) in curves.iter().enumerate() {
        let points: Vec<[f64; 2]> = order.iter().map(|j| [x.values[*j], values[*j]]).collect();
        let colour = palette::nth(k);
        // A gap stays a gap: the curve is interrupted where there is no value.
        for part in points.split(|point| !point[1].is_finite()).filter(|part| part.len() > 1) {
            panel = panel.with(Layer::curve(part, colour));
        }
        let known = points.into_iter().filter(|point| point[1].is_finite()).collect();
        panel = panel.with(Layer::scatter(known, Marker::Circle, colour).named(name.clone()));
    }
    let panel = Panel { legend: LegendPlace::Beside, height: 480.0, ..panel };
    figure_svg(&Figure { panels: vec![panel], width: 880.0, ..Figure::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unequal_steps_are_drawn_to_scale() {
        let (range, columns) = Along { name: "a", unit: "", values: &[0.0, 1.0, 4.0] }.columns();
        assert_eq!((range, columns.len()), ([-0.5, 5.5], FINE));
        let share = |k: usize| columns.iter().filter(|own| **own == k).count() as f64 / FINE as f64;
        // From -0.5 to 0.5, to 2.5, and to 5.5; a column may lie on a boundary.
        for (k, expected) in [(0, 1.0 / 6.0), (1, 2.0 / 6.0), (2, 3.0 / 6.0)] {
            assert!((share(k) - expected).abs() <= 1.0 / FINE as f64, "{k}: {}", share(k));
        }
        assert_eq!(Along { name: "a", unit: "", values: &[2.0, 1.0, 0.0] }.columns(), ([-0.5, 2.5], vec![2, 1, 0]));
    }

    #[test]
    fn every_text_of_a_map_has_an_area_and_a_name() {
        let (x, y) =
            (Along { name: "a", unit: "", values: &[0.0, 1.0] }, Along { name: "b", unit: "mm", values: &[0.0, 2.0] });
        let texts = [Some("cycle"), None, Some("equilibrium"), Some("cycle")];
        let svg = plane_svg(&x, &y, &Shown::Texts(texts.map(|own| own.map(str::to_string)).to_vec()), "");
        assert!(["cycle", "equilibrium", "no value", "b [mm]"].iter().all(|own| svg.contains(own)), "{svg}");
    }
}
