//! Initial states: stratified, reproducible, a quarter of them close to the origin.
//!
//! **Idea.** The range of every component is divided into as many strata as there are samples, and every stratum is
//! used once, in an order specific to the component. Each range is covered evenly for any number of components. Every
//! fourth sample is drawn towards the origin (or the point of the box nearest to it) by a random factor between 1 and
//! 1/100, since small motions are otherwise rare in a high-dimensional box. The other three in four are distributed
//! uniformly in the box; basin fractions are estimated from them alone.
//!
//! **Source.** mckay1979, owen1997 (Latin hypercube); steele2014 (SplitMix64).

use super::Limits;

/// Initial states to sample, and limits and accuracy of their trajectories.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampling {
    /// `[n]` smallest and largest initial value of every state.
    pub ranges: Vec<[f64; 2]>,
    /// `[n]` characteristic size of each state, relative to which errors and distances are measured.
    pub scales: Vec<f64>,
    /// The two states that make up the whirl plane z = u + jv, by which cycles are named.
    pub whirl: Option<[usize; 2]>,
    /// Number of initial states.
    pub samples: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of threads; the result does not depend on it.
    pub jobs: usize,
    /// Relative accuracy of `polish`: solutions that agree to it are the same.
    pub tolerance: f64,
    /// Limits on every trajectory, in the time unit of the model.
    pub limits: Limits,
    /// `[samples][n]` initial states to use instead of drawing from the ranges.
    pub given: Option<Vec<f64>>,
}

/// One in this many samples is drawn towards the origin.
const SHARE_NEAR_ORIGIN: usize = 4;

impl Sampling {
    /// True if initial state `number` is distributed uniformly in the box rather than drawn towards the origin.
    pub fn is_uniform(number: usize) -> bool {
        number % SHARE_NEAR_ORIGIN != SHARE_NEAR_ORIGIN - 1
    }

    /// Number of initial states that are distributed uniformly.
    pub fn uniform(&self) -> usize {
        (0..self.samples).filter(|number| Sampling::is_uniform(*number)).count()
    }

    /// The initial states `[samples][n]`.
    pub fn starts(&self) -> Vec<f64> {
        if let Some(given) = &self.given {
            return given.clone();
        }
        let mut random = SplitMix64(self.seed);
        let mut starts = self.stratified(&mut random);
        for (number, start) in starts.chunks_exact_mut(self.ranges.len().max(1)).enumerate() {
            if Sampling::is_uniform(number) {
                continue;
            }
            let factor = 0.01f64.powf(random.fraction());
            for (x, [low, high]) in start.iter_mut().zip(&self.ranges) {
                let nearest = 0f64.max(low.min(*high)).min(low.max(*high));
                *x = nearest + factor * (*x - nearest);
            }
        }
        starts
    }

    /// Initial states `[samples][n]` all of which are distributed uniformly in the box. Being stratified, they give
    /// fractions at least as accurate as one state fewer drawn independently (owen1997).
    pub fn uniform_starts(&self) -> Vec<f64> {
        stratified(&self.ranges, self.samples, self.seed)
    }

    fn stratified(&self, random: &mut SplitMix64) -> Vec<f64> {
        drawn(&self.ranges, self.samples, random)
    }
}

/// Returns a Latin hypercube `[samples][n]` in a box `[n]`: every component has one value in each of `samples` equal parts
/// of its range.
pub fn stratified(ranges: &[[f64; 2]], samples: usize, seed: u64) -> Vec<f64> {
    drawn(ranges, samples, &mut SplitMix64(seed))
}

fn drawn(ranges: &[[f64; 2]], samples: usize, random: &mut SplitMix64) -> Vec<f64> {
    let n = ranges.len();
    let mut starts = vec![0.0; samples * n];
    for (i, [low, high]) in ranges.iter().enumerate() {
        let mut strata: Vec<usize> = (0..samples).collect();
        for k in (1..strata.len()).rev() {
            strata.swap(k, (random.next() % (k as u64 + 1)) as usize);
        }
        for (s, stratum) in strata.iter().enumerate() {
            let place = (*stratum as f64 + random.fraction()) / samples as f64;
            starts[s * n + i] = low + place * (high - low);
        }
    }
    starts
}

/// A random number generator with a state of 64 bits.
pub(crate) struct SplitMix64(pub u64);

impl SplitMix64 {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a number uniform in [0, 1).
    fn fraction(&mut self) -> f64 {
        (self.next() >> 11) as f64 * (-53f64).exp2()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampling(samples: usize, seed: u64) -> Sampling {
        Sampling {
            ranges: vec![[-2.0, 2.0], [1.0, 5.0], [0.0, 1.0]],
            scales: vec![1.0; 3],
            whirl: None,
            samples,
            seed,
            jobs: 1,
            tolerance: 1e-6,
            limits: Limits::default(),
            given: None,
        }
    }

    #[test]
    fn the_generator_is_the_published_one() {
        // First output for seed 1234567: reference implementation of steele2014 (prng.di.unimi.it/splitmix64.c).
        assert_eq!(SplitMix64(1234567).next(), 6457827717110365317);
    }

    #[test]
    fn every_stratum_is_used_once_and_the_rest_lies_nearer_to_the_origin() {
        let samples = 40;
        let starts = sampling(samples, 3).starts();
        for (i, [low, high]) in sampling(samples, 3).ranges.iter().enumerate() {
            let mut used = vec![0; samples];
            for (s, x) in starts.chunks(3).enumerate() {
                assert!(x[i] >= *low && x[i] < *high);
                if s % 4 != 3 {
                    used[((x[i] - low) / (high - low) * samples as f64) as usize] += 1;
                }
            }
            assert!(used.iter().all(|u| *u <= 1) && used.iter().sum::<usize>() == 30);
        }
        let distance = |x: &[f64]| x[0].abs() + (x[1] - 1.0).abs();
        let mean = |near: bool| {
            let chosen: Vec<f64> =
                starts.chunks(3).enumerate().filter(|(s, _)| (s % 4 == 3) == near).map(|(_, x)| distance(x)).collect();
            chosen.iter().sum::<f64>() / chosen.len() as f64
        };
        assert!(mean(true) < 0.5 * mean(false));
        assert_eq!(starts, sampling(samples, 3).starts());
        assert_ne!(starts, sampling(samples, 4).starts());
    }
}
