//! Basin fractions.

/// 97.5 % quantile of the normal distribution, for two-sided 95 % intervals.
const QUANTILE: f64 = 1.959_963_984_540_054;

/// Basin fraction: the fraction of initial states, drawn uniformly from the ranges of the states, that settle to one
/// motion. It estimates the relative volume of the basin of attraction in that box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// Number of uniform initial states that settled there.
    pub hits: usize,
    /// Number of uniform initial states in total.
    pub of: usize,
}

impl Share {
    /// The estimate; NaN without initial states.
    pub fn value(&self) -> f64 {
        self.hits as f64 / self.of as f64
    }

    /// Standard error of the estimate, from the binomial distribution. It is 0 and meaningless if none or all settled
    /// there; see [`Share::interval`].
    pub fn error(&self) -> f64 {
        let value = self.value();
        (value * (1.0 - value) / self.of as f64).sqrt()
    }

    /// The 95 % confidence interval (Wilson's score interval; wilson1927).
    pub fn interval(&self) -> [f64; 2] {
        let (hits, of) = (self.hits as f64, self.of as f64);
        let square = QUANTILE * QUANTILE;
        let middle = (hits + 0.5 * square) / (of + square);
        let half = QUANTILE / (of + square) * (hits * (of - hits) / of + 0.25 * square).sqrt();
        // Rounding must not leave the share itself outside.
        let share = self.value();
        [(middle - half).max(0.0).min(share), (middle + half).min(1.0).max(share)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_agrees_with_published_wilson_intervals() {
        // newcombe1998, Table I, method 3: 81/263, 15/148, 0/20, 1/29.
        for (hits, of, expected) in [
            (81, 263, [0.2553, 0.3662]),
            (15, 148, [0.0624, 0.1605]),
            (0, 20, [0.0, 0.1611]),
            (1, 29, [0.0061, 0.1718]),
        ] {
            let found = Share { hits, of }.interval();
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 5e-5), "{hits}/{of}: {found:?}");
        }
    }

    #[test]
    fn the_interval_solves_its_equation() {
        // The estimate lies exactly QUANTILE standard errors away from each end.
        let share = Share { hits: 7, of: 24 };
        for end in share.interval() {
            let error = (end * (1.0 - end) / 24.0).sqrt();
            assert!(((share.value() - end).abs() / error - QUANTILE).abs() < 1e-12);
        }
    }
}
