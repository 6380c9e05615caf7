//! Spectra over a parameter as a map of colours.
//!
//! **Idea.** For each value of the parameter there is a column of amplitudes. A cell of the picture shows the largest
//! amplitude that falls into it, in decibels below the largest of all, so that a line never disappears between cells.

use crate::figure::{Axis, Layer, LegendPlace, Panel};
use crate::map::CLASSES;

/// Range of amplitudes shown, in decibels below the largest.
const RANGE: f64 = 80.0;
/// Number of rows of cells.
const ROWS: usize = 240;
/// Least number of columns of cells.
const COLUMNS: usize = 120;

/// Spectrum at one value of the parameter.
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// The value.
    pub at: f64,
    /// Distance between two frequencies.
    pub step: f64,
    /// Amplitude at each multiple of `step`, from 0 on.
    pub amplitudes: Vec<f64>,
}

/// Panel of spectra up to a frequency; `None` without two values of the parameter or without any amplitude.
pub fn panel(mut spectra: Vec<Spectrum>, x: Axis, frequency: Axis, highest: f64, title: &str) -> Option<Panel> {
    spectra.sort_by(|a, b| a.at.total_cmp(&b.at));
    spectra.dedup_by(|a, b| a.at == b.at);
    let largest = spectra.iter().flat_map(|own| own.amplitudes.iter().skip(1)).copied().fold(0.0, f64::max);
    let [first, last] = [spectra.first()?.at, spectra.last()?.at];
    if first == last || largest == 0.0 {
        return None;
    }
    let margin = 0.5 * (last - first) / (spectra.len() - 1) as f64;
    let (low, high) = (first - margin, last + margin);
    let columns = COLUMNS.max(spectra.len());
    let nearest = |column: usize| {
        let at = low + (column as f64 + 0.5) / columns as f64 * (high - low);
        let k = spectra.partition_point(|own| own.at < at).clamp(1, spectra.len() - 1);
        if at - spectra[k - 1].at < spectra[k].at - at { k - 1 } else { k }
    };
    let level = |spectrum: &Spectrum, row: usize| {
        let edge = |row: usize| row as f64 / ROWS as f64 * highest / spectrum.step;
        // The mean is not part of the spectrum.
        let from = (edge(row).ceil() as usize).max(1);
        let to = (edge(row + 1).ceil() as usize).max(from);
        let inside = spectrum.amplitudes.get(from..to.min(spectrum.amplitudes.len())).unwrap_or_default();
        // A row between two frequencies shows the closer one.
        let near = ((edge(row) + edge(row + 1)) / 2.0).round() as usize;
        let own = spectrum.amplitudes.get(near).copied().filter(|_| near > 0 && inside.is_empty());
        20.0 * (inside.iter().copied().chain(own).fold(0.0, f64::max) / largest).log10()
    };
    let levels: Vec<Vec<f64>> =
        spectra.iter().map(|spectrum| (0..ROWS).map(|row| level(spectrum, row)).collect()).collect();
    let classes = CLASSES.len();
    let width = RANGE / classes as f64;
    let class = |level: f64| ((level + RANGE) / width).floor().clamp(0.0, classes as f64 - 1.0) as usize;
    let shown: Vec<usize> = (0..columns).map(nearest).collect();
    let mut layers = Vec::new();
    for (k, colour) in CLASSES.into_iter().enumerate().rev() {
        let filled: Vec<bool> = (0..ROWS)
            .flat_map(|row| shown.iter().map(move |own| (row, *own)))
            .map(|(row, own)| class(levels[own][row]) == k)
            .collect();
        let (from, to) = (k as f64 * width - RANGE, (k + 1) as f64 * width - RANGE);
        let name = if k == 0 { format!("below {to:.0} dB") } else { format!("{from:.0} to {to:.0} dB") };
        layers.push(Layer::cells([[low, high], [0.0, highest]], columns, filled, colour).named(name.replace('-', "−")));
    }
    let panel = Panel::new("", title, x.from(low, high), frequency.from(0.0, highest)).with_all(layers);
    Some(Panel { legend: LegendPlace::Beside, height: 460.0, ..panel })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::Shape;

    #[test]
    fn a_line_is_in_the_cell_of_its_frequency() {
        let spectrum = |at: f64| {
            let mut amplitudes = vec![1e-9; 100];
            amplitudes[(10.0 * at) as usize] = 2.0;
            Spectrum { at, step: 0.1, amplitudes }
        };
        let all = (1..=3).map(|k| spectrum(f64::from(k))).collect();
        let panel = panel(all, Axis::new("x"), Axis::new("f"), 4.0, "").expect("there are spectra");
        let Shape::Cells { columns, filled, .. } = &panel.layers[0].shape else { panic!("cells") };
        for (share, frequency) in [(0.1, 1.0), (0.5, 2.0), (0.9, 3.0)] {
            let column = (share * *columns as f64) as usize;
            let rows: Vec<usize> = (0..ROWS).filter(|row| filled[row * columns + column]).collect();
            let row = (frequency / 4.0 * ROWS as f64) as usize;
            assert!(!rows.is_empty() && rows.iter().all(|own| own.abs_diff(row) <= 3), "{frequency}: {rows:?} {row}");
        }
    }
}
