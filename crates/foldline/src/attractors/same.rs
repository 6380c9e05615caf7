//! Identity of cycles in simulations.
//!
//! **Idea.** Two cycles with the same period and the same ranges need not be one motion: two coupled oscillators in phase
//! and in antiphase agree in all of these. They are one if states of one lie on the orbit of the other, by the measure
//! and tolerance of [`super::orbit`].
//!
//! **Departures.** Only a few states of one cycle are compared: orbits of the same period that agree in these are one.
//! Half the range of a state counts as no less than the tolerance of its ranges allows, so that states are never compared
//! more strictly than ranges.

use super::brute_force::SAME;
use super::orbit::ALIKE;

/// Number of states of a cycle that are compared with another one.
const COMPARED: usize = 16;

/// States along a cycle, dense where it is fast.
pub(super) struct Track {
    /// `[sample][n]`.
    states: Vec<f64>,
    /// Number of samples of each piece; the state may jump between two pieces.
    pieces: Vec<usize>,
    /// `[n]` s of (1) of [`super::orbit`].
    sizes: Vec<f64>,
}

impl Track {
    pub(super) fn new(states: Vec<f64>, pieces: Vec<usize>, scales: &[f64]) -> Track {
        let size = |(i, scale): (usize, &f64)| {
            let own = states.iter().skip(i).step_by(scales.len());
            let [low, high] = own.fold([f64::MAX, f64::MIN], |[low, high], x| [x.min(low), x.max(high)]);
            (0.5 * (high - low)).max(SAME / ALIKE * scale.max(low.abs()).max(high.abs()))
        };
        let sizes = scales.iter().enumerate().map(size).collect();
        Track { states, pieces, sizes }
    }

    /// True if states of this cycle lie on the orbit of another one.
    pub(super) fn follows(&self, other: &Track) -> bool {
        let n = self.sizes.len();
        let count = self.states.len() / n.max(1);
        (0..COMPARED).map(|k| k * count / COMPARED).all(|k| other.passes(&self.states[k * n..(k + 1) * n]))
    }

    /// True if the distance (1) of a state from the polygon through the samples of each piece is within the tolerance.
    fn passes(&self, x: &[f64]) -> bool {
        let n = self.sizes.len();
        let mut from = 0;
        self.pieces.iter().any(|count| {
            let piece = &self.states[from * n..(from + count) * n];
            from += count;
            (1..*count).any(|k| self.near(x, &piece[(k - 1) * n..k * n], &piece[k * n..(k + 1) * n]))
        })
    }

    /// True if the distance of a state from the chord between two samples is within the tolerance.
    fn near(&self, x: &[f64], a: &[f64], b: &[f64]) -> bool {
        // Most chords are far away in some component.
        let outside = |(i, size): (usize, &f64)| {
            let room = ALIKE * size;
            x[i] < a[i].min(b[i]) - room || x[i] > a[i].max(b[i]) + room
        };
        if self.sizes.iter().enumerate().any(outside) {
            return false;
        }
        let (mut along, mut length) = (0.0, 0.0);
        for (i, size) in self.sizes.iter().enumerate() {
            let (chord, off) = ((b[i] - a[i]) / size, (x[i] - a[i]) / size);
            along += chord * off;
            length += chord * chord;
        }
        let s = if length > 0.0 { (along / length).clamp(0.0, 1.0) } else { 0.0 };
        self.sizes.iter().enumerate().all(|(i, size)| (x[i] - a[i] - s * (b[i] - a[i])).abs() <= ALIKE * size)
    }
}
