//! Campbell diagrams, critical speeds and resonances.
//!
//! **Equations.** With the undamped, synchronous problem of `modes`:
//!
//! 1. undamped critical speed: K a = Ω² (M ∓ Ĝ) a
//! 2. damped critical speed: Im λ(Ω) = |Ω|, solved by the secant method from the undamped one
//!
//! **Source.** friswell2010, chapter 6.
//!
//! **Departures.** Where coefficients depend on the speed, equation 1 is solved repeatedly, with the coefficients at
//! the speed found, until the speed no longer changes.

use crate::machine::Machine;
use crate::modes::{Mode, Modes, Whirl, synchronous};
use num_complex::Complex64;

/// Relative change of a speed at which its iteration ends.
const SETTLED: f64 = 1e-13;
/// Maximum number of iterations for one speed.
const MOST: usize = 60;

/// Critical speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Critical {
    /// Direction of whirl.
    pub whirl: Whirl,
    /// Undamped critical speed in rad/s.
    pub undamped: f64,
    /// Speed at which the damped frequency equals the speed, with the eigenvalue there; `None` if the mode is
    /// overdamped or the iteration does not converge.
    pub damped: Option<(f64, Complex64)>,
    /// False if the iteration for coefficients that depend on the speed did not converge.
    pub settled: bool,
}

impl Machine {
    /// Returns the parameters with the speed Ω set to `speed`, in rad/s.
    pub fn at_speed(&self, parameters: &[f64], speed: f64) -> Vec<f64> {
        let mut own = parameters.to_vec();
        if let Some((index, factor)) = self.speed_parameter() {
            own[index] = speed / factor;
        }
        own
    }

    /// The `count` lowest modes at each of the speeds in rad/s. `None` where eigenvalues could not be computed.
    pub fn campbell(&self, parameters: &[f64], speeds: &[f64], count: usize) -> Vec<Option<Modes>> {
        if self.constant() {
            return self.linear(parameters).modes_over(speeds, count);
        }
        let modes = |speed: &f64| self.linear(&self.at_speed(parameters, *speed)).spectrum(count, false);
        speeds.iter().map(modes).collect()
    }

    /// The lowest critical speeds, at most `count` of each direction of whirl. `None` if eigenvalues could not be
    /// computed.
    pub fn critical_speeds(&self, parameters: &[f64], count: usize) -> Option<Vec<Critical>> {
        let at = |speed: f64| synchronous(&self.linear(&self.at_speed(parameters, speed)));
        let first = at(self.linear(parameters).speed)?;
        let mut found: Vec<Critical> = Vec::new();
        for whirl in [Whirl::Forward, Whirl::Backward, Whirl::Mixed] {
            let of = |list: &[(Whirl, f64)], k: usize| list.iter().filter(|own| own.0 == whirl).nth(k).map(|own| own.1);
            for k in 0..count {
                let Some(mut undamped) = of(&first, k) else { break };
                let mut settled = self.constant();
                for _ in 0..MOST {
                    if settled {
                        break;
                    }
                    let Some(next) = of(&at(undamped)?, k) else { break };
                    settled = (next - undamped).abs() <= SETTLED.sqrt() * undamped;
                    undamped = next;
                }
                let damped = self.damped(parameters, whirl, undamped);
                found.push(Critical { whirl, undamped, damped, settled });
            }
        }
        found.sort_by(|a, b| a.undamped.total_cmp(&b.undamped));
        Some(found)
    }

    /// True if no coefficient of stiffness or damping is an expression.
    fn constant(&self) -> bool {
        self.assembled.assembly.terms.is_empty()
    }

    /// Speed at which the damped frequency of the mode nearest to `speed` equals the speed.
    fn damped(&self, parameters: &[f64], whirl: Whirl, speed: f64) -> Option<(f64, Complex64)> {
        let count = 2 * self.assembled.rotor.dofs();
        let nearest = |speed: f64, to: f64| {
            let modes = self.linear(&self.at_speed(parameters, speed)).modes(count, false)?;
            let own = modes.into_iter().filter(|mode| mode.whirl == whirl);
            own.min_by(|a, b| (a.value.im - to).abs().total_cmp(&(b.value.im - to).abs())).map(|mode| mode.value)
        };
        let mut at = [speed, speed * (1.0 + 1e-6)];
        let mut values = [nearest(at[0], speed)?, nearest(at[1], speed)?];
        for _ in 0..MOST {
            let gap = [values[0].im - at[0], values[1].im - at[1]];
            if gap[1].abs() <= SETTLED * at[1] || gap[0] == gap[1] {
                break;
            }
            let next = at[1] - gap[1] * (at[1] - at[0]) / (gap[1] - gap[0]);
            // A damped critical speed far from the undamped one belongs to another mode.
            if !next.is_finite() || (next - speed).abs() > 0.5 * speed {
                return None;
            }
            at = [at[1], next];
            values = [values[1], nearest(next, values[1].im)?];
        }
        ((values[1].im - at[1]).abs() < 1e-9 * at[1]).then_some((at[1], values[1]))
    }

    /// Speeds in rad/s, within `speeds`, at which the whirl of the lowest forward and backward modes closes in the
    /// rotating frame: n (ω_f - Ω) = m (ω_b - Ω) (equation 3 of `modes`), for the undamped rotor. Empty for an
    /// anisotropic rotor.
    pub fn resonances(&self, parameters: &[f64], [n, m]: [f64; 2], speeds: [f64; 2]) -> Vec<f64> {
        const PARTS: usize = 400;
        let gap = |speed: f64| {
            let mut linear = self.linear(&self.at_speed(parameters, speed));
            if !linear.isotropic {
                return None;
            }
            linear.damping.fill(0.0);
            linear.internal.fill(0.0);
            let modes = linear.modes(8, false)?;
            let first = |whirl: Whirl| modes.iter().find(|mode| mode.whirl == whirl).map(Mode::signed);
            let (forward, backward) = (first(Whirl::Forward)?, first(Whirl::Backward)?);
            Some(n * (forward - speed) - m * (backward - speed))
        };
        let at = |k: usize| speeds[0] + (speeds[1] - speeds[0]) * k as f64 / PARTS as f64;
        let mut found = Vec::new();
        let mut before = gap(at(0));
        for k in 1..=PARTS {
            let after = gap(at(k));
            if let (Some(a), Some(b)) = (before, after)
                && (a < 0.0) != (b < 0.0)
            {
                found.extend(bisected(&gap, [at(k - 1), at(k)], a));
            }
            before = after;
        }
        found
    }
}

/// Zero of a function with a change of sign, by bisection to the last digits.
fn bisected(gap: &dyn Fn(f64) -> Option<f64>, [mut low, mut high]: [f64; 2], at_low: f64) -> Option<f64> {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if high - low <= 1e-14 * middle.abs() {
            break;
        }
        if (gap(middle)? < 0.0) == (at_low < 0.0) { low = middle } else { high = middle }
    }
    Some(0.5 * (low + high))
}
