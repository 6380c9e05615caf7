//! Signed spectrum of a cycle in its whirl plane, and the ratio by which it is named.
//!
//! **Idea.** With z = u + jv a line at a positive frequency is a forward whirl and one at a negative frequency a
//! backward whirl, in the frame in which u and v are written; if that frame rotates with the shaft, whirl is relative
//! to the shaft. A cycle of period T has lines only at multiples k/T. Two strong lines identify the resonance. If one
//! line outweighs all others, the motion is a single whirl with its harmonics and has no ratio.
//!
//! **Equations.** With z sampled N times over one period, N even, end point excluded:
//!
//!   (1)  z_k = (1/N) Σ_s z(s T/N) e^{-j 2π k s/N},   k = -N/2 … N/2 - 1,   at frequency k/T
//!   (2)  P_k = |z_k|² + |z_-k|²,   k = 1, 2, …
//!   (3)  with P_p and P_q the largest of these, the ratio is p : q if the smaller is at least 1/100 of the larger
//!
//! By (3) the second whirl changes the radius of the orbit by at least a tenth. On the resonant motions of akay and
//! akay2024, from 2:1 to 8:1, the smaller amplitude is between 0.36 (6:1) and 0.90 (2:1) of the larger one along whole
//! branches; the harmonics of a whirl in journal bearings are 0.003 of it.
//!
//! **Source.** akay, §2, where the profile is resampled for the same reason: meshes are not uniform.

use crate::diagram::Cycle;
use foldline_general::fourier;
use num_complex::Complex64;

/// Number of samples for naming; lines beyond ±512 are not among the two strongest of any motion that is resolved.
const COUNT: usize = 1024;
/// Amplitude of the second line, as a fraction of that of the strongest, below which it is a harmonic: (3). The
/// measured values above leave a wide gap, 0.003 to 0.36, and 0.1 lies in its middle.
const FAINT: f64 = 0.1;

/// Returns the two-sided spectrum (1) as frequency (cycles per time unit, increasing) and complex amplitude; `count` is
/// rounded up to an even number. Empty if a whirl component does not exist.
pub fn signed_spectrum(cycle: &Cycle, whirl: [usize; 2], count: usize) -> Vec<(f64, Complex64)> {
    let n = cycle.dim();
    let count = count.max(2).next_multiple_of(2);
    if whirl.iter().any(|&i| i >= n) {
        return Vec::new();
    }
    let mut z: Vec<Complex64> =
        cycle.uniform(count).chunks_exact(n).map(|x| Complex64::new(x[whirl[0]], x[whirl[1]])).collect();
    fourier(&mut z);
    let half = count as i64 / 2;
    (-half..half).map(|k| (k as f64 / cycle.period, z[k.rem_euclid(count as i64) as usize] / count as f64)).collect()
}

/// Returns the ratio of the two strongest lines besides the mean, in lowest terms with the larger first: (2, 1) for
/// lines at -1 and -2 times the base frequency, and also at -2 and -4 times it, as after a period doubling. Lines at k
/// and -k belong to the same frequency and count together. `None` if the second line has less than a tenth of the
/// amplitude of the first, that is, if it is a harmonic of a single whirl.
pub fn spectral_ratio(cycle: &Cycle, whirl: [usize; 2]) -> Option<(u32, u32)> {
    if whirl.iter().any(|&i| i >= cycle.dim()) {
        return None;
    }
    lines(sampled(cycle, whirl))?.0
}

/// The ratio of [`spectral_ratio`] from uniform samples of z over one period, end point excluded.
pub(crate) fn ratio_of_samples(z: Vec<Complex64>) -> Option<(u32, u32)> {
    lines(z)?.0
}

/// Sense of whirl: forward if z turns from the first state of the whirl plane towards the second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sense {
    /// The strongest line has a positive frequency.
    Forward,
    /// The strongest line has a negative frequency.
    Backward,
}

impl Sense {
    /// The name used in tables.
    pub fn name(self) -> &'static str {
        match self {
            Sense::Forward => "forward",
            Sense::Backward => "backward",
        }
    }
}

/// Returns the sense of whirl of a cycle in the coordinates of the model: the sign of the frequency of its strongest
/// line, the mean excluded. `None` if the lines at both signs are equally strong, as for a motion along a straight
/// line.
pub fn whirl_sense(cycle: &Cycle, whirl: [usize; 2]) -> Option<Sense> {
    if whirl.iter().any(|&i| i >= cycle.dim()) {
        return None;
    }
    let z = transformed(sampled(cycle, whirl));
    let (first, _) = strongest(&z)?;
    let [forward, backward] = [z[first].norm(), z[z.len() - first].norm()];
    // The difference must exceed the error of the cycle.
    let differ = (forward - backward).abs() > 1e-6 * forward.max(backward);
    differ.then_some(if forward > backward { Sense::Forward } else { Sense::Backward })
}

fn sampled(cycle: &Cycle, whirl: [usize; 2]) -> Vec<Complex64> {
    let states = cycle.uniform(COUNT);
    states.chunks_exact(cycle.dim()).map(|x| Complex64::new(x[whirl[0]], x[whirl[1]])).collect()
}

fn transformed(mut z: Vec<Complex64>) -> Vec<Complex64> {
    fourier(&mut z);
    z
}

/// Returns the index k of the largest P_k of (2), and that of the second largest if it satisfies (3).
fn strongest(z: &[Complex64]) -> Option<(usize, Option<usize>)> {
    let count = z.len();
    let mut power = vec![0.0; count / 2 + 1];
    for (k, amplitude) in z.iter().enumerate() {
        power[k.min(count - k)] += amplitude.norm_sqr();
    }
    let mut lines: Vec<usize> = (1..power.len()).collect();
    lines.sort_by(|&a, &b| power[b].total_cmp(&power[a]));
    let (&first, &second) = (lines.first()?, lines.get(1)?);
    let strong = power[second] >= FAINT * FAINT * power[first];
    (power[first] > 0.0).then_some((first, strong.then_some(second)))
}

/// Returns the ratio (3), if any, and the number of periods of the strong lines after which the motion closes, from
/// uniform samples over one period.
pub(super) fn lines(z: Vec<Complex64>) -> Option<(Option<(u32, u32)>, u32)> {
    let (first, second) = strongest(&transformed(z))?;
    let Some(second) = second else { return Some((None, first as u32)) };
    let divisor = greatest_common_divisor(first, second);
    let ratio = ((first.max(second) / divisor) as u32, (first.min(second) / divisor) as u32);
    Some((Some(ratio), divisor as u32))
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}
