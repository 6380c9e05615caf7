//! Shares of basins of attraction.

/// 97.5 % quantile of the normal distribution.
const QUANTILE: f64 = 1.959_963_984_540_054;

/// The part of initial states, drawn uniformly from the ranges of the states, that went to one motion: an estimate of the
/// volume of its basin of attraction in that box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// Uniform initial states that went there.
    pub hits: usize,
    /// All uniform initial states, whatever became of them.
    pub of: usize,
}

impl Share {
    /// The estimate; NaN without initial states.
    pub fn value(&self) -> f64 {
        self.hits as f64 / self.of as f64
    }

    /// Its standard error, that of a binomial distribution. It says nothing where none or all went there: see
    /// [`Share::interval`].
    pub fn error(&self) -> f64 {
        let value = self.value();
        (value * (1.0 - value) / self.of as f64).sqrt()
    }

    /// The interval that holds the true share with a confidence of 95 % (Wilson's score interval; wilson1927).
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
    fn the_interval_is_that_of_wilson() {
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
        // Its ends are the shares from which the estimate is just the quantile of standard errors away.
        let share = Share { hits: 7, of: 24 };
        for end in share.interval() {
            let error = (end * (1.0 - end) / 24.0).sqrt();
            assert!(((share.value() - end).abs() / error - QUANTILE).abs() < 1e-12);
        }
    }
}
