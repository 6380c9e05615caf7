//! Finite kicks: the distance of an attractor from the boundary of its basin.
//!
//! **Idea.** Rays start at states of the attractor in many directions, up to the end of the box. On each the first of equally
//! spaced states with another fate is sought, and the change before it is bracketed by bisection as long as the ray can be
//! the shortest. The direction of the shortest one is then turned to where it is shortest.
//!
//! **Equations.** With the widths w_i of the ranges of the kicked states,
//!
//! ```text
//!   (1)  |Δ|² = Σ (Δ_i / w_i)²
//!   (2)  error = (upper - lower end of the bracket) + Σ (c + ε)² / (4 c),   c = ½ (d₊ + d₋) - d
//! ```
//!
//! At the end, turning the shortest ray by an angle in either sense of each direction at right angles gives the lengths d₊, d₋ ≥ d - ε,
//! with the width ε of a bracket. A parabola through the three has its lowest point at most (c + ε)² / (4 c) below d.
//!
//! **Departures.** The states of a cycle are those at the beginnings of its forcing periods, or eight equally spaced in time
//! without forcing.
//!
//! **Fails when** a part of another basin reaches between the rays, or between two states on one: the distance found is then too
//! large. It is never too small by more than the integration error, because the trajectory from the state at it went elsewhere.

use super::System;
use super::rounds::Rounds;
use crate::attractors::{Attractor, Fate, SplitMix64};
use crate::diagram::Solution;
use std::f64::consts::{PI, TAU};

/// Number of states of a cycle without forcing from which it is kicked.
const PHASES: usize = 8;
/// Number of states on a ray among which the first with another fate is sought.
const ALONG: usize = 16;
/// Relative width of the bracket at which bisection ends.
const WIDTH: f64 = 1e-3;
/// Relative lengths at which a turned ray is searched for a change.
const NEARBY: [f64; 9] = [0.5, 0.8, 0.9, 0.95, 0.98, 0.995, 1.01, 1.05, 1.2];
/// Largest number of turns: seven halve a quarter of a circle to the last angle, and each may follow a few successful ones.
/// Without an end the error is infinite.
const TURNS: usize = 32;

/// Directions of kicks.
#[derive(Clone, Debug)]
pub struct Kicking<'k> {
    /// Indices of the states that are kicked.
    pub states: &'k [usize],
    /// Number of directions; with one state there are two, with two they are equally spaced, otherwise random.
    pub directions: usize,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// Smallest kick found that leads from an attractor to another fate.
#[derive(Clone, Debug, PartialEq)]
pub struct Kick {
    /// Its size (1).
    pub size: f64,
    /// Its error (2).
    pub error: f64,
    /// `[n]` the state that is kicked.
    pub from: Vec<f64>,
    /// `[n]` change of the state.
    pub change: Vec<f64>,
    /// Fate of the kicked state.
    pub fate: Fate,
}

/// A ray from a state of an attractor.
#[derive(Clone)]
struct Ray {
    from: Vec<f64>,
    /// `[m]` unit vector, in units of the widths.
    direction: Vec<f64>,
    /// Length to the end of the box.
    reach: f64,
    /// Largest length with the fate of the attractor before the first change, smallest with another fate.
    bracket: [f64; 2],
    fate: Fate,
}

struct Search<'s, 'r> {
    kicking: &'s Kicking<'s>,
    widths: Vec<f64>,
    ranges: Vec<[f64; 2]>,
    own: Fate,
    rounds: &'s mut Rounds<'r>,
}

impl Search<'_, '_> {
    fn state(&self, ray: &Ray, length: f64) -> Vec<f64> {
        let mut state = ray.from.clone();
        for ((index, width), part) in self.kicking.states.iter().zip(&self.widths).zip(&ray.direction) {
            state[*index] += length * width * part;
        }
        state
    }

    fn ray(&self, from: &[f64], direction: Vec<f64>) -> Ray {
        let mut reach = f64::INFINITY;
        for (k, (index, width)) in self.kicking.states.iter().zip(&self.widths).enumerate() {
            let [low, high] = self.ranges[k];
            let speed = width * direction[k];
            let end = if speed > 0.0 { high } else { low };
            if speed != 0.0 {
                reach = reach.min((end - from[*index]) / speed);
            }
        }
        Ray { from: from.to_vec(), direction, reach, bracket: [0.0, f64::INFINITY], fate: self.own }
    }

    /// Seeks the first change among these lengths of each ray, which rise.
    fn scan(&mut self, rays: &mut [Ray], lengths: &dyn Fn(&Ray) -> Vec<f64>) {
        let all: Vec<Vec<f64>> = rays.iter().map(lengths).collect();
        let mut starts = Vec::new();
        for (ray, own) in rays.iter().zip(&all) {
            own.iter().for_each(|length| starts.extend(self.state(ray, *length)));
        }
        let fates = self.rounds.fates(&starts);
        let mut next = fates.into_iter();
        for (ray, own) in rays.iter_mut().zip(&all) {
            let found: Vec<Fate> = next.by_ref().take(own.len()).collect();
            if let Some(k) = found.iter().position(|fate| *fate != self.own) {
                let before = if k == 0 { ray.bracket[0] } else { own[k - 1] };
                (ray.bracket, ray.fate) = ([before, own[k]], found[k]);
            } else if let Some(last) = own.last().filter(|last| **last < ray.bracket[1]) {
                ray.bracket[0] = ray.bracket[0].max(*last);
            }
        }
    }

    /// Narrows the brackets of all rays that can be the shortest. Returns the shortest.
    fn shortest(&mut self, mut rays: Vec<Ray>) -> Option<Ray> {
        loop {
            rays.retain(|ray| ray.bracket[1].is_finite());
            let best = rays.iter().map(|ray| ray.bracket[1]).fold(f64::INFINITY, f64::min);
            rays.retain(|ray| ray.bracket[0] < best);
            rays.sort_by(|a, b| a.bracket[1].total_cmp(&b.bracket[1]));
            let done = rays.iter().all(|ray| ray.bracket[1] - ray.bracket[0] <= WIDTH * ray.bracket[1]);
            if done || self.rounds.ended() {
                return rays.into_iter().next();
            }
            self.scan(&mut rays, &|ray| vec![0.5 * (ray.bracket[0] + ray.bracket[1])]);
        }
    }

    /// Narrows the brackets of all rays on which a change is known.
    fn narrow(&mut self, rays: &mut [Ray]) {
        loop {
            let wide =
                |ray: &Ray| ray.bracket[1].is_finite() && ray.bracket[1] - ray.bracket[0] > WIDTH * ray.bracket[1];
            let open: Vec<usize> = (0..rays.len()).filter(|k| wide(&rays[*k])).collect();
            if open.is_empty() || self.rounds.ended() {
                return;
            }
            let mut some: Vec<Ray> = open.iter().map(|k| rays[*k].clone()).collect();
            self.scan(&mut some, &|ray| vec![0.5 * (ray.bracket[0] + ray.bracket[1])]);
            open.into_iter().zip(some).for_each(|(k, ray)| rays[k] = ray);
        }
    }

    /// Turns a ray to where it is shortest. Returns it with the second term of (2).
    fn turned(&mut self, mut ray: Ray, spacing: f64) -> (Ray, f64) {
        let mut left = 0.0;
        let mut angle = 0.5 * spacing;
        for _ in 0..TURNS {
            if ray.direction.len() < 2 || self.rounds.ended() {
                break;
            }
            let mut rays = Vec::new();
            for tangent in tangents(&ray.direction) {
                for (sin, cos) in [angle, -angle].map(f64::sin_cos) {
                    let turned = ray.direction.iter().zip(&tangent).map(|(d, t)| cos * d + sin * t).collect();
                    rays.push(self.ray(&ray.from, turned));
                }
            }
            let [low, length] = ray.bracket;
            self.scan(&mut rays, &|own| {
                NEARBY.iter().map(|share| share * length).filter(|length| *length <= own.reach).collect()
            });
            self.narrow(&mut rays);
            let shorter = rays.iter().min_by(|a, b| a.bracket[1].total_cmp(&b.bracket[1]));
            if let Some(shorter) = shorter.filter(|own| own.bracket[1] < length) {
                (ray, left) = (shorter.clone(), f64::INFINITY);
                continue;
            }
            let open = WIDTH * length;
            let rise = |pair: &[Ray]| (0.5 * (pair[0].bracket[1] + pair[1].bracket[1]) - low).max(open);
            left = rays.chunks_exact(2).map(rise).map(|rise| (rise + open).powi(2) / (4.0 * rise)).sum();
            // A plane boundary met at this angle is at the relative distance WIDTH behind the nearest point.
            if angle <= (2.0 * WIDTH).sqrt() && f64::is_finite(left) {
                break;
            }
            angle *= 0.5;
        }
        (ray, left)
    }
}

/// Orthonormal vectors at right angles to a unit vector.
fn tangents(direction: &[f64]) -> Vec<Vec<f64>> {
    let m = direction.len();
    let mut basis: Vec<Vec<f64>> = vec![direction.to_vec()];
    for k in 0..m {
        let mut own: Vec<f64> = (0..m).map(|i| f64::from(u8::from(i == k))).collect();
        // Twice, so that rounding errors do not remain.
        for _ in 0..2 {
            for other in &basis {
                let dot: f64 = own.iter().zip(other).map(|(a, b)| a * b).sum();
                own.iter_mut().zip(other).for_each(|(a, b)| *a -= dot * b);
            }
        }
        let norm = own.iter().map(|a| a * a).sum::<f64>().sqrt();
        // Of m unit vectors, the projections of all but the one nearest to the direction have at least this norm.
        if norm > 0.5 / (m as f64).sqrt() && basis.len() < m {
            own.iter_mut().for_each(|a| *a /= norm);
            basis.push(own);
        }
    }
    basis.split_off(1)
}

/// Unit vectors in m dimensions, and the angle between neighbours.
fn directions(m: usize, kicking: &Kicking) -> (Vec<Vec<f64>>, f64) {
    let count = kicking.directions.max(2);
    match m {
        1 => (vec![vec![1.0], vec![-1.0]], 0.0),
        2 => {
            let spacing = TAU / count as f64;
            let at = |k: usize| (k as f64 * spacing).sin_cos();
            ((0..count).map(|k| vec![at(k).1, at(k).0]).collect(), spacing)
        }
        _ => {
            let mut random = SplitMix64(kicking.seed);
            let mut uniform = || ((random.next() >> 11) as f64 + 0.5) * (-53f64).exp2();
            // Normally distributed components by the method of Box and Muller.
            let mut normal = || (-2.0 * uniform().ln()).sqrt() * (TAU * uniform()).cos();
            let mut draw = || {
                let own: Vec<f64> = (0..m).map(|_| normal()).collect();
                let norm = own.iter().map(|a| a * a).sum::<f64>().sqrt();
                own.into_iter().map(|a| a / norm).collect::<Vec<f64>>()
            };
            let all = (0..count).map(|_| draw()).collect();
            // N caps of this angle have about the area of the sphere.
            (all, PI * (count as f64).powf(-1.0 / (m as f64 - 1.0)))
        }
    }
}

/// States from which an attractor is kicked.
fn bases(attractor: &Attractor, forced: bool) -> Vec<Vec<f64>> {
    let solution = &attractor.point.solution;
    match solution {
        Solution::Equilibrium(state) => vec![state.clone()],
        Solution::Cycle(cycle) => {
            if solution.is_of_map() {
                return cycle.profile.chunks_exact(cycle.dim()).map(<[f64]>::to_vec).collect();
            }
            let count = if forced { cycle.forcing_periods.max(1) as usize } else { PHASES };
            (0..count).map(|k| cycle.state(k as f64 / count as f64)).collect()
        }
        Solution::Torus(_) => Vec::new(),
    }
}

/// Returns the smallest kick found for each of the attractors in a box; `Err` says why there is none.
pub fn kicks(
    system: &System,
    parameters: &[f64],
    attractors: &[Attractor],
    kicking: &Kicking,
    (jobs, tolerance): (usize, f64),
) -> Vec<Result<Kick, String>> {
    let mut rounds = Rounds::new(system, parameters, jobs, tolerance);
    rounds.attractors = attractors.iter().map(|own| Attractor { hits: 0, ..own.clone() }).collect();
    let ranges: Vec<[f64; 2]> = kicking.states.iter().map(|index| system.ranges[*index]).collect();
    let widths: Vec<f64> = ranges.iter().map(|[low, high]| high - low).collect();
    let (all, spacing) = directions(kicking.states.len(), kicking);
    let one = |(k, attractor): (usize, &Attractor)| {
        let bases = bases(attractor, system.field.forced());
        if bases.is_empty() {
            return Err("kicks of a torus are not supported".to_string());
        }
        let mut search = Search {
            kicking,
            widths: widths.clone(),
            ranges: ranges.clone(),
            own: Fate::Settled(k),
            rounds: &mut rounds,
        };
        let mut rays = Vec::new();
        for from in &bases {
            rays.extend(all.iter().map(|direction| search.ray(from, direction.clone())));
        }
        rays.retain(|ray| ray.reach > 0.0);
        if rays.is_empty() {
            return Err("the attractor lies outside the ranges of the kicked states".to_string());
        }
        search.scan(&mut rays, &|ray| (1..=ALONG).map(|k| k as f64 / ALONG as f64 * ray.reach).collect());
        let Some(first) = search.shortest(rays) else {
            return Err("no kick that stays within the ranges leads elsewhere".to_string());
        };
        let (ray, left) = search.turned(first, spacing);
        let [low, size] = ray.bracket;
        let end = search.state(&ray, size);
        let change = end.iter().zip(&ray.from).map(|(a, b)| a - b).collect();
        let error = size - low + left;
        Ok(Kick { size, error, from: ray.from, change, fate: ray.fate })
    };
    attractors.iter().enumerate().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_are_orthonormal() {
        for direction in [vec![1.0, 0.0], vec![0.6, 0.8], vec![0.0, 0.0, 1.0], vec![0.5, 0.5, 0.5, 0.5]] {
            let all = [vec![direction.clone()], tangents(&direction)].concat();
            assert_eq!(all.len(), direction.len());
            for (i, a) in all.iter().enumerate() {
                for (j, b) in all.iter().enumerate() {
                    let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                    assert!((dot - f64::from(u8::from(i == j))).abs() < 1e-14);
                }
            }
        }
    }
}
