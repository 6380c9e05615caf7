//! Signed spectrum of a cycle in its whirl plane, and the ratio by which it is named.
//!
//! **Idea.** With z = u + jv a line at a positive frequency is a forward whirl and one at a negative frequency a backward whirl.
//! A cycle of period T has lines at multiples k/T only; the two strongest of them, the mean aside, tell what resonates.
//!
//! **Equations.** With z sampled N times over one period, N even, end point excluded:
//!
//!   (1)  z_k = (1/N) Σ_s z(s T/N) e^{-j 2π k s/N},   k = -N/2 … N/2 - 1,   at frequency k/T
//!
//! **Source.** akay, §2, where the profile is resampled for the same reason: meshes are not uniform.

use crate::diagram::Cycle;
use num_complex::Complex64;
use rustfft::FftPlanner;

/// Samples for naming; lines beyond ±512 are not among the two strongest of any motion that is resolved.
const COUNT: usize = 1024;
/// A second line weaker than this fraction of the strongest is none.
const FAINT: f64 = 1e-6;

/// The two-sided spectrum (1) by growing frequency (in cycles per time unit) and complex amplitude; `count` is rounded up to
/// an even number. Empty if a whirl component does not exist.
pub fn signed_spectrum(cycle: &Cycle, whirl: [usize; 2], count: usize) -> Vec<(f64, Complex64)> {
    let n = cycle.dim();
    let count = count.max(2).next_multiple_of(2);
    if whirl.iter().any(|&i| i >= n) {
        return Vec::new();
    }
    let mut z: Vec<Complex64> =
        cycle.uniform(count).chunks_exact(n).map(|x| Complex64::new(x[whirl[0]], x[whirl[1]])).collect();
    FftPlanner::new().plan_fft_forward(count).process(&mut z);
    let half = count as i64 / 2;
    (-half..half).map(|k| (k as f64 / cycle.period, z[k.rem_euclid(count as i64) as usize] / count as f64)).collect()
}

/// The ratio of the two strongest lines besides the mean, in lowest terms and the larger first: (2, 1) for lines at -1 and
/// -2 times the base frequency, and also at -2 and -4 times it, as after a period doubling. Lines at k and -k belong to the same
/// frequency and count together; `None` where there is only one frequency.
pub fn spectral_ratio(cycle: &Cycle, whirl: [usize; 2]) -> Option<(u32, u32)> {
    let n = cycle.dim();
    if whirl.iter().any(|&i| i >= n) {
        return None;
    }
    let states = cycle.uniform(COUNT);
    lines(states.chunks_exact(n).map(|x| Complex64::new(x[whirl[0]], x[whirl[1]])).collect()).map(|(ratio, _)| ratio)
}

/// The ratio, and over how many periods of the lines the motion closes, from uniform samples over one period.
pub(super) fn lines(mut z: Vec<Complex64>) -> Option<((u32, u32), u32)> {
    let count = z.len();
    FftPlanner::new().plan_fft_forward(count).process(&mut z);
    let mut power = vec![0.0; count / 2 + 1];
    for (k, amplitude) in z.iter().enumerate() {
        power[k.min(count - k)] += amplitude.norm_sqr();
    }
    let mut lines: Vec<usize> = (1..power.len()).collect();
    lines.sort_by(|&a, &b| power[b].total_cmp(&power[a]));
    let (&first, &second) = (lines.first()?, lines.get(1)?);
    if power[second] <= FAINT * FAINT * power[first] {
        return None;
    }
    let divisor = greatest_common_divisor(first, second);
    Some((((first.max(second) / divisor) as u32, (first.min(second) / divisor) as u32), divisor as u32))
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}
