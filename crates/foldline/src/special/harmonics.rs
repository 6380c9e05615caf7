//! Harmonics of states and outputs, and their names.
//!
//! **Equations.** A signal g of a state or output, or a pair g = u + i v, with angular frequency ω = 2π/T of the cycle, or
//! of the forcing where there is one:
//!
//! ```text
//!   (1)  c_k = (1/T) ∫ g e^(-ikωt) dt
//!   (2)  state or output:  g = c_0 + Σ_{k>0} a_k cos(kωt - φ_k),   a_k = 2 |c_k|,  φ_k = -arg c_k
//!   (3)  pair:             g = Σ_k a_k e^(±i(|k|ωt - φ_k)),        a_k = |c_k|,    φ_k = ∓arg c_k    (± the sign of k)
//! ```
//!
//! The order k is a fraction for subharmonics of the forcing: a cycle of two forcing periods has harmonics of order 1/2.
//! In (3) k > 0 turns from u to v (forward whirl), k < 0 the other way.

use crate::contract::VectorField;
use crate::model::Model;

/// Order of a harmonic: `numerator / denominator`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Order {
    /// Numerator; negative for backward whirl.
    pub numerator: i16,
    /// Denominator, 1 or larger.
    pub denominator: u16,
}

impl Order {
    /// Multiple of the frequency of a cycle that lasts `forcing_periods` (0 for an autonomous model); `None` if the
    /// cycle has no such harmonic.
    pub fn in_cycle(self, forcing_periods: u32) -> Option<i64> {
        let all = i64::from(self.numerator) * i64::from(forcing_periods.max(1));
        (all % i64::from(self.denominator) == 0).then(|| all / i64::from(self.denominator))
    }

    /// Reads `1`, `3`, `-1` or, for the order 1/2, `1_2`.
    fn read(text: &str) -> Option<Order> {
        let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        let (over, under) = text.split_once('_').unwrap_or((text, "1"));
        if !digits(over.strip_prefix('-').unwrap_or(over)) || !digits(under) {
            return None;
        }
        let order = Order { numerator: over.parse().ok()?, denominator: under.parse().ok()? };
        (order.denominator > 0).then_some(order)
    }
}

/// Measure of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measured {
    /// Largest value.
    Largest,
    /// Smallest value.
    Smallest,
    /// Mean.
    Mean,
    /// Root mean square.
    Rms,
    /// Amplitude of a harmonic, a_k.
    Amplitude(Order),
    /// Phase lag of a harmonic, φ_k, in degrees.
    Phase(Order),
}

/// A signal along a solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// A state, or an output after the states.
    Channel(usize),
    /// Two of them as real and imaginary part.
    Pair(usize, usize),
}

impl Signal {
    /// The state or output, if it is one.
    pub fn single(self) -> Option<usize> {
        match self {
            Signal::Channel(k) => Some(k),
            Signal::Pair(..) => None,
        }
    }
}

/// A value of one signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Term {
    /// The signal.
    pub signal: Signal,
    /// Its measure.
    pub measured: Measured,
}

impl Term {
    /// Reads a name such as `x_max`, `x_h1`, `x_h3_phase`, `whirl_h-1` or `u+iv_h2`.
    pub(super) fn named(name: &str, model: &Model) -> Option<Term> {
        let channel = |name: &str| {
            model.state_index(name).or_else(|| model.output_index(name).map(|index| model.states.len() + index))
        };
        let plain = [
            ("_max", Measured::Largest),
            ("_min", Measured::Smallest),
            ("_mean", Measured::Mean),
            ("_rms", Measured::Rms),
        ];
        let of = |(ending, measured): &(&str, Measured)| {
            Some(Term { signal: Signal::Channel(channel(name.strip_suffix(ending)?)?), measured: *measured })
        };
        if let Some(found) = plain.iter().find_map(of) {
            return Some(found);
        }
        if model.iterated() {
            return None;
        }
        let (front, phase) = name.strip_suffix("_phase").map_or((name, false), |front| (front, true));
        let (signal, order) = front.rsplit_once("_h")?;
        let order = Order::read(order)?;
        let pair = || {
            let (u, v) = signal.split_once("+i")?;
            Some(Signal::Pair(channel(u.trim())?, channel(v.trim())?))
        };
        let whirl = || model.whirl.filter(|_| signal == "whirl").map(|[u, v]| Signal::Pair(u, v));
        let signal = channel(signal).map(Signal::Channel).or_else(whirl).or_else(pair)?;
        if signal.single().is_some() && order.numerator < 1 {
            return None;
        }
        Some(Term { signal, measured: if phase { Measured::Phase(order) } else { Measured::Amplitude(order) } })
    }

    /// Name, given those of states and outputs.
    pub fn name(self, channels: &[String]) -> String {
        let own = |k: usize| channels.get(k).cloned().unwrap_or_else(|| format!("x{}", k + 1));
        let signal = match self.signal {
            Signal::Channel(k) => own(k),
            Signal::Pair(u, v) => format!("{}+i{}", own(u), own(v)),
        };
        let order = |order: Order| match order.denominator {
            1 => format!("{}", order.numerator),
            under => format!("{}_{under}", order.numerator),
        };
        match self.measured {
            Measured::Largest => format!("{signal}_max"),
            Measured::Smallest => format!("{signal}_min"),
            Measured::Mean => format!("{signal}_mean"),
            Measured::Rms => format!("{signal}_rms"),
            Measured::Amplitude(own) => format!("{signal}_h{}", order(own)),
            Measured::Phase(own) => format!("{signal}_h{}_phase", order(own)),
        }
    }

    /// Order of a harmonic.
    pub fn order(self) -> Option<Order> {
        match self.measured {
            Measured::Amplitude(order) | Measured::Phase(order) => Some(order),
            _ => None,
        }
    }
}
