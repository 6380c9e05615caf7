//! Fates of initial states that are chosen one set after the other.
//!
//! **Idea.** Each set is a sampling of its own. The attractors known before take part in it with a state of each, so that the
//! trajectories from these say which of them an attractor of the set is.

use super::System;
use super::basins::spread;
use super::seeds::map;
use crate::attractors::{Attractor, Fate};
use crate::diagram::{Point, Solution};

/// Sets of initial states, and the attractors that they reached.
pub(super) struct Rounds<'a> {
    system: &'a System<'a>,
    parameters: &'a [f64],
    jobs: usize,
    tolerance: f64,
    /// In the order in which they were found; their `hits` do not count the states of known attractors.
    pub(super) attractors: Vec<Attractor>,
}

impl<'a> Rounds<'a> {
    pub(super) fn new(system: &'a System<'a>, parameters: &'a [f64], jobs: usize, tolerance: f64) -> Rounds<'a> {
        Rounds { system, parameters, jobs, tolerance, attractors: Vec::new() }
    }

    /// True if the run is to end.
    pub(super) fn ended(&self) -> bool {
        self.system.field.ended()
    }

    /// Returns the fates of initial states `[count][n]`. Indices of attractors stay as they are from set to set.
    pub(super) fn fates(&mut self, starts: &[f64]) -> Vec<Fate> {
        let n = self.system.field.dim();
        let count = starts.len() / n.max(1);
        if count == 0 {
            return Vec::new();
        }
        let known = self.attractors.len();
        let mut all: Vec<f64> = self.attractors.iter().flat_map(|own| state_of(&own.point, n)).collect();
        let order = spread(count);
        order.iter().for_each(|k| all.extend_from_slice(&starts[k * n..(k + 1) * n]));
        let census = map(self.system, self.parameters, all, self.jobs, self.tolerance);
        let mut place: Vec<Option<usize>> = vec![None; census.attractors.len()];
        for (k, fate) in census.fates.iter().take(known).enumerate() {
            if let Fate::Settled(local) = fate {
                place[*local].get_or_insert(k);
            }
        }
        let mut fates = vec![Fate::Left; count];
        for (k, fate) in order.iter().zip(census.fates.iter().skip(known)) {
            fates[*k] = match fate {
                Fate::Settled(local) => {
                    let own = *place[*local].get_or_insert_with(|| {
                        self.attractors.push(Attractor { hits: 0, ..census.attractors[*local].clone() });
                        self.attractors.len() - 1
                    });
                    self.attractors[own].hits += 1;
                    Fate::Settled(own)
                }
                other => *other,
            };
        }
        fates
    }
}

/// A state of a solution.
pub(super) fn state_of(point: &Point, n: usize) -> Vec<f64> {
    match &point.solution {
        Solution::Equilibrium(state) => state.clone(),
        Solution::Cycle(cycle) => cycle.profile[..n].to_vec(),
        Solution::Torus(torus) => torus.profile[..n].to_vec(),
    }
}
