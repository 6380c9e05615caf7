//! Batches in which some points slide along the surface of a switch.
//!
//! **Idea.** A sign of 0 selects the motion along the surface of that switch, which has tapes of its own. The points of
//! a batch are sorted by the surface along which they slide, and each group is evaluated by itself.

use crate::contract::{Batch, Parameters};

/// True if a point slides.
pub(super) fn occurs(at: &Batch) -> bool {
    at.signs.contains(&0.0)
}

/// Runs `evaluate(batch, directions, switch, to)` for every group of points, where `switch` is the one along whose
/// surface the group slides, and distributes the results, `[size × lanes]` each. Points that slide along several
/// surfaces have no result: NaN.
pub(super) fn each(
    at: Batch,
    directions: &[&[f64]],
    to: &mut [&mut [f64]],
    evaluate: impl Fn(Batch, &[&[f64]], Option<u32>, &mut [&mut [f64]]),
) {
    let lanes = at.lanes;
    let surface = |lane: usize| -> Result<Option<u32>, ()> {
        let mut all = (lane..at.signs.len()).step_by(lanes).enumerate().filter(|(_, place)| at.signs[*place] == 0.0);
        let first = all.next().map(|(switch, _)| switch as u32);
        if all.next().is_some() { Err(()) } else { Ok(first) }
    };
    let surfaces: Vec<_> = (0..lanes).map(surface).collect();
    let mut groups: Vec<_> = surfaces.iter().flatten().copied().collect();
    groups.sort_unstable();
    groups.dedup();
    to.iter_mut().for_each(|all| all.fill(f64::NAN));
    for group in groups {
        let own: Vec<usize> = (0..lanes).filter(|lane| surfaces[*lane] == Ok(group)).collect();
        let of = |all: &[f64]| -> Vec<f64> {
            all.chunks_exact(lanes).flat_map(|row| own.iter().map(move |lane| row[*lane])).collect()
        };
        let own_parameters = match at.parameters {
            Parameters::Shared(_) => Vec::new(),
            Parameters::PerLane(all) => of(all),
        };
        let parameters = match at.parameters {
            Parameters::Shared(all) => Parameters::Shared(all),
            Parameters::PerLane(_) => Parameters::PerLane(&own_parameters),
        };
        let [states, times, signs] = [at.states, at.times, at.signs].map(of);
        let batch = Batch { lanes: own.len(), states: &states, parameters, times: &times, signs: &signs };
        let along: Vec<Vec<f64>> = directions.iter().map(|all| of(all)).collect();
        let along: Vec<&[f64]> = along.iter().map(Vec::as_slice).collect();
        let mut results: Vec<Vec<f64>> = to.iter().map(|all| vec![0.0; all.len() / lanes * own.len()]).collect();
        let mut views: Vec<&mut [f64]> = results.iter_mut().map(Vec::as_mut_slice).collect();
        evaluate(batch, &along, group, &mut views);
        for (all, results) in to.iter_mut().zip(&results) {
            for (row, result) in all.chunks_exact_mut(lanes).zip(results.chunks_exact(own.len())) {
                own.iter().zip(result).for_each(|(lane, value)| row[*lane] = *value);
            }
        }
    }
}
