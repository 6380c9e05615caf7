//! Waterfalls: profiles or amplitudes of harmonics of the cycles of a branch, one behind the other along a parameter.

use crate::figure::{Axis, Panel, Shape};
use crate::palette::{BLUE, GREY};
use crate::profile::{along, channel_label, cycle_of};
use crate::quantity::{drawn, label};
use crate::space::{Space, View};
use foldline::diagram::{Branch, Point};
use foldline::model::Model;
use foldline::special::quantity::Quantity;
use std::f64::consts::TAU;

/// Smallest amplitude shown, relative to the largest.
const SMALLEST: f64 = 1e-4;
/// Number of harmonics shown.
const HARMONICS: usize = 12;
/// Samples of a profile for its harmonics. Those shown are far below the 256 that the samples resolve.
const SAMPLES: usize = 512;

/// Content of a waterfall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Waterfall {
    /// Profiles over one period.
    Profiles,
    /// Amplitudes of the harmonics of 1/T.
    Harmonics,
}

/// Panel with a curve or stems for `count` cycles of a branch; `None` if fewer than two have stored profiles.
pub fn panel(
    branch: &Branch,
    model: &Model,
    what: Waterfall,
    x: Quantity,
    channel: usize,
    count: usize,
    view: View,
) -> Option<Panel> {
    let with: Vec<(&Point, f64)> = branch
        .points
        .iter()
        .filter(|point| cycle_of(point).is_some())
        .filter_map(|p| Some((p, drawn(x, p)?)))
        .collect();
    if with.len() < 2 {
        return None;
    }
    let count = count.clamp(2, with.len());
    let picked = (0..count).map(|k| with[k * (with.len() - 1) / (count - 1)]);
    let mut curves: Vec<(f64, Vec<[f64; 3]>, bool)> = Vec::new();
    for (point, at) in picked {
        let line: Vec<[f64; 3]> = match what {
            Waterfall::Profiles => {
                let (times, values) = along(model, point)?;
                times.iter().zip(&values[channel]).map(|(t, v)| [*t, at, *v]).collect()
            }
            Waterfall::Harmonics => {
                amplitudes(model, point, channel)?.iter().enumerate().map(|(k, a)| [k as f64 + 1.0, at, *a]).collect()
            }
        };
        curves.push((at, line, point.unstable == 0));
    }
    let largest = curves.iter().flat_map(|(_, line, _)| line).map(|at| at[2]).fold(0.0, f64::max);
    let parameter = Axis::new(label(x, model));
    let axes = match what {
        Waterfall::Profiles => [Axis::new("t/T").from(0.0, 1.0), parameter, Axis::new(channel_label(model, channel))],
        Waterfall::Harmonics => [
            Axis::new("harmonic of 1/T").from(0.5, HARMONICS as f64 + 0.5),
            parameter,
            Axis::new(format!("amplitude of {}", channel_label(model, channel)))
                .from(SMALLEST * largest, 1.5 * largest)
                .log(),
        ],
    };
    let all: Vec<[f64; 3]> = curves.iter().flat_map(|(_, line, _)| line.iter().copied()).collect();
    let space = Space::around(axes, all.into_iter(), view);
    let mut panel = space.panel();
    // What is far is drawn first.
    curves.sort_by(|a, b| {
        space.depth([a.1[0][0], a.0, space.floor()]).total_cmp(&space.depth([b.1[0][0], b.0, space.floor()]))
    });
    for (at, line, stable) in curves {
        match what {
            Waterfall::Profiles => {
                let stretch: Vec<([f64; 3], bool)> = line.into_iter().map(|place| (place, stable)).collect();
                panel.layers.push(space.curve(&[stretch], BLUE).wide(1.1));
            }
            Waterfall::Harmonics => {
                let floor = space.floor();
                let stems: Vec<Vec<([f64; 3], bool)>> = line
                    .into_iter()
                    .filter(|place| place[2] > floor)
                    .map(|place| vec![([place[0], at, floor], true), (place, true)])
                    .collect();
                let (colour, name) = if stable { (BLUE, "stable") } else { (GREY, "unstable") };
                let mut layer = space.curve(&stems, colour).wide(1.6).named(name);
                if let Shape::Curve { stability, .. } = &mut layer.shape {
                    *stability = false;
                }
                panel.layers.push(layer);
            }
        }
    }
    panel.height = 520.0;
    Some(panel)
}

/// Amplitudes of the harmonics from 1 on.
fn amplitudes(model: &Model, point: &Point, channel: usize) -> Option<Vec<f64>> {
    let cycle = cycle_of(point)?;
    let times: Vec<f64> = (0..SAMPLES).map(|s| s as f64 / SAMPLES as f64).collect();
    let values = crate::profile::at(model, point, cycle, &times);
    let own = values.get(channel)?;
    let part = |k: usize, wave: fn(f64) -> f64| {
        own.iter().enumerate().map(|(s, v)| v * wave(TAU * (k * s % SAMPLES) as f64 / SAMPLES as f64)).sum::<f64>()
    };
    let amplitude = |k: usize| 2.0 / SAMPLES as f64 * part(k, f64::cos).hypot(part(k, f64::sin));
    Some((1..=HARMONICS).map(amplitude).collect())
}
