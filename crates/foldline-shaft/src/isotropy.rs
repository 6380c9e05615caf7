//! Frames that a rotor allows.
//!
//! **Idea.** The equations have constant coefficients in the frame that turns with the shaft if all matrices commute
//! with a rotation of the pairs of coordinates and no force has a fixed direction.

use crate::assembly::Assembly;
use crate::parts::{Centre, Frame, Rotor};
use foldline_general::Mat;

/// Relative difference below which two entries of a matrix are equal. Given matrices may be rounded to ten digits.
const SAME: f64 = 1e-9;

impl Rotor {
    /// Reasons why the rotor has no equations with constant coefficients in the rotating frame; empty if it has.
    pub fn anisotropy(&self, assembly: &Assembly) -> Vec<String> {
        let mut found = Vec::new();
        for own in &self.bearings {
            let place = self.called(own.at);
            for (block, letter) in [(&own.stiffness, 'k'), (&own.damping, 'c')] {
                if block[0][0] != block[1][1] {
                    let [a, b] = [&block[0][0], &block[1][1]];
                    found.push(format!("the bearing at {place} has {letter}xx = {a} and {letter}yy = {b}"));
                }
                if block[0][1] != block[1][0].negated() {
                    let [a, b] = [&block[0][1], &block[1][0]];
                    found.push(format!(
                        "the bearing at {place} has {letter}xy = {a} and {letter}yx = {b}, which is not -{letter}xy"
                    ));
                }
            }
        }
        if !self.gravity.is_zero() {
            found.push("gravity has a fixed direction".into());
        }
        for own in &self.contacts {
            if let Centre::At(_) = own.centre {
                found.push(format!("the ring `{}` is not centred on the bearing line", own.name));
            }
        }
        for own in self.forces.iter().filter(|own| !own.rotating) {
            found.push(format!("the force at {} is given along the fixed axes x and y", self.called(own.at)));
        }
        if self.given.is_some() {
            for (name, matrix) in [
                ("M", &assembly.mass),
                ("C", &assembly.damping),
                ("K", &assembly.stiffness),
                ("G", &assembly.gyroscopic),
            ] {
                if found.is_empty() && !commutes(matrix) {
                    found.push(format!("the matrix {name} differs between the two planes"));
                }
            }
        }
        found
    }

    /// Frame of the equations: the requested one, or else the rotating one if the rotor allows it.
    pub fn frame_for(&self, anisotropy: &[String]) -> Frame {
        self.frame.unwrap_or(if anisotropy.is_empty() { Frame::Rotating } else { Frame::Fixed })
    }
}

/// True if every 2 × 2 block has the form [[a, -b], [b, a]].
pub(crate) fn commutes(a: &Mat<f64>) -> bool {
    let n = a.nrows();
    // Entries are compared with the largest of their row and column, which have the same units: entries that cancel where
    // two elements meet are rounding errors of these.
    let row = |i: usize| (0..n).fold(0.0, |m: f64, j| m.max(a[(i, j)].abs()));
    let rows: Vec<f64> = (0..n).map(row).collect();
    let unit = |i: usize, j: usize| (rows[i] * rows[j]).sqrt().max(rows[i + 1].min(rows[j + 1]));
    (0..n / 2).all(|i| {
        (0..n / 2).all(|j| {
            let (i, j) = (2 * i, 2 * j);
            let unit = unit(i, j);
            (a[(i, j)] - a[(i + 1, j + 1)]).abs() <= SAME * unit && (a[(i, j + 1)] + a[(i + 1, j)]).abs() <= SAME * unit
        })
    })
}
