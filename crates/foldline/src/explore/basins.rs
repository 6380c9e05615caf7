//! Basins of attraction: which attractor an initial state leads to.
//!
//! **Idea.** Basin fractions are estimated from initial states drawn at random from a box; a picture is made from
//! initial states at the centres of equal cells of a plane section. All are followed together, so that both refer to
//! the same list of attractors.
//!
//! **Equations.** For k of N states drawn uniformly from the box, the fraction is k / N with Wilson's interval
//! ([`Share`]).
//!
//! **Source.** wilson1927 (interval); mckay1979, owen1997 (stratified states).
//!
//! **Fails when** an attractor is neither an equilibrium nor a cycle: its states count as unsettled.

use super::System;
use super::seeds::{map, sampling};
use crate::attractors::{Attractor, Early, Fate};
use crate::diagram::Share;

/// A plane section through the state space, divided into cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// The states along the horizontal and the vertical axis.
    pub axes: [usize; 2],
    /// Range of each of these.
    pub ranges: [[f64; 2]; 2],
    /// Number of cells along each.
    pub cells: [usize; 2],
    /// `[n]` a state through which the plane passes.
    pub through: Vec<f64>,
}

impl Plane {
    /// Centre of a cell along an axis.
    pub fn centre(&self, axis: usize, cell: usize) -> f64 {
        let [low, high] = self.ranges[axis];
        low + (cell as f64 + 0.5) / self.cells[axis] as f64 * (high - low)
    }

    /// State `[n]` at the centre of a cell.
    pub fn state(&self, column: usize, row: usize) -> Vec<f64> {
        let mut state = self.through.clone();
        state[self.axes[0]] = self.centre(0, column);
        state[self.axes[1]] = self.centre(1, row);
        state
    }

    /// `[rows × columns][n]` states at the centres, row by row from below.
    pub fn starts(&self) -> Vec<f64> {
        let mut starts = Vec::with_capacity(self.cells[0] * self.cells[1] * self.through.len());
        for row in 0..self.cells[1] {
            (0..self.cells[0]).for_each(|column| starts.extend(self.state(column, row)));
        }
        starts
    }
}

/// Attractors with the initial states that lead to each.
#[derive(Clone, Debug)]
pub struct Basins {
    /// The attractors; their `hits` count states of the box and of the plane.
    pub attractors: Vec<Attractor>,
    /// Fates of the states drawn from the box.
    pub box_fates: Vec<Fate>,
    /// Fates of the cells, row by row from below.
    pub plane_fates: Vec<Fate>,
    /// Early decisions, if there were any.
    pub early: Option<Early>,
    /// States drawn from the box `[samples][n]`.
    pub samples: Vec<f64>,
    /// Cells that were filled instead of computed, if the section is adaptive.
    pub filled: Option<Filled>,
}

/// Filled cells of a section that was computed where the fate changes ([`super::section`]).
#[derive(Clone, Debug)]
pub struct Filled {
    /// Number of cells that were computed.
    pub computed: usize,
    /// For each cell, row by row from below: true if it was computed.
    pub known: Vec<bool>,
    /// Number of cells that would have been filled and were computed to check that.
    pub checked: usize,
    /// Number of those with another fate.
    pub wrong: usize,
}

impl Filled {
    /// Fraction of the filled cells with a wrong fate, estimated from those checked.
    pub fn error(&self) -> Share {
        Share { hits: self.wrong, of: self.checked }
    }
}

impl Basins {
    /// Returns the basins with the attractors in the order of [`super::attractors`]: equilibria, then cycles, each by decreasing hits.
    pub(super) fn sorted(self) -> Basins {
        let mut order: Vec<usize> = (0..self.attractors.len()).collect();
        let cycle = |k: &usize| self.attractors[*k].point.solution.period().is_some();
        order.sort_by_key(|k| (cycle(k), std::cmp::Reverse(self.attractors[*k].hits)));
        let mut place = vec![0; order.len()];
        order.iter().enumerate().for_each(|(new, old)| place[*old] = new);
        let moved = |fates: &[Fate]| -> Vec<Fate> {
            let one = |fate: &Fate| if let Fate::Settled(k) = fate { Fate::Settled(place[*k]) } else { *fate };
            fates.iter().map(one).collect()
        };
        let (box_fates, plane_fates) = (moved(&self.box_fates), moved(&self.plane_fates));
        let attractors = order.iter().map(|k| self.attractors[*k].clone()).collect();
        Basins { attractors, box_fates, plane_fates, ..self }
    }

    /// Fraction of the box whose states have this fate.
    pub fn share(&self, fate: Fate) -> Share {
        share(&self.box_fates, fate)
    }

    /// Fraction of the plane whose states have this fate.
    pub fn part(&self, fate: Fate) -> Share {
        share(&self.plane_fates, fate)
    }
}

fn share(fates: &[Fate], fate: Fate) -> Share {
    Share { hits: fates.iter().filter(|own| **own == fate).count(), of: fates.len() }
}

/// Follows `samples` states drawn uniformly from the ranges of the system, and the cells of a plane, to their
/// attractors.
pub fn basins(
    system: &System,
    parameters: &[f64],
    plane: Option<&Plane>,
    (samples, seed): (usize, u64),
    jobs: usize,
    tolerance: f64,
) -> Basins {
    let n = system.field.dim();
    let drawn = sampling(system, samples, seed, jobs, tolerance).uniform_starts();
    let cells = plane.map_or(Vec::new(), Plane::starts);
    let all = [&drawn[..], &cells].concat();
    let count = all.len() / n.max(1);
    let order = spread(count);
    let starts: Vec<f64> = order.iter().flat_map(|k| all[k * n..(k + 1) * n].iter().copied()).collect();
    let census = map(system, parameters, starts, jobs, tolerance);
    // Those that were not begun, because the work was stopped.
    let mut fates = vec![Fate::Left; count];
    order.iter().zip(&census.fates).for_each(|(k, fate)| fates[*k] = *fate);
    let plane_fates = fates.split_off(samples.min(count));
    Basins {
        attractors: census.attractors,
        box_fates: fates,
        plane_fates,
        early: census.early,
        samples: drawn,
        filled: None,
    }
}

/// Numbers from 0 to `count` - 1 in an order in which any first part is spread over all.
pub(super) fn spread(count: usize) -> Vec<usize> {
    fn divisor(a: usize, b: usize) -> usize {
        if b == 0 { a } else { divisor(b, a % b) }
    }
    // Near the golden section, and without a common divisor.
    let near = (count as f64 * 0.618_033_988_749_895) as usize;
    let stride = (near.max(1)..).find(|stride| divisor(count, *stride) == 1).unwrap_or(1);
    (0..count).map(|k| (k as u128 * stride as u128 % count.max(1) as u128) as usize).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_is_a_permutation_that_spreads_early() {
        for count in [1, 2, 3, 10, 64, 97, 1000] {
            let mut order = spread(count);
            let mut first: Vec<usize> = order[..count.min(10)].to_vec();
            order.sort_unstable();
            assert_eq!(order, (0..count).collect::<Vec<_>>());
            first.sort_unstable();
            // Ten of a thousand leave no gap of more than a quarter.
            assert!(first.windows(2).all(|pair| pair[1] - pair[0] <= count.max(4) / 4 + 1) || count < 20);
        }
        assert!(spread(0).is_empty());
    }

    #[test]
    fn cells_are_centred_and_numbered_from_below() {
        let ranges = [[0.0, 1.0], [-1.0, 1.0]];
        let plane = Plane { axes: [2, 0], ranges, cells: [2, 4], through: vec![9.0, 5.0, 9.0] };
        let starts = plane.starts();
        assert_eq!(starts.len(), 8 * 3);
        assert_eq!(&starts[..6], [-0.75, 5.0, 0.25, -0.75, 5.0, 0.75]);
        assert_eq!(&starts[21..], [0.75, 5.0, 0.75]);
    }
}
