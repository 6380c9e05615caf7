//! Coefficients of the Dormand–Prince 5(4) pair.
//!
//! **Equations.** With k₁ = f(x₀) and kᵢ = f(x₀ + h Σⱼ aᵢⱼ kⱼ):
//!
//!   (1)  x₁ = x₀ + h Σⱼ a₇ⱼ kⱼ, order 5; k₇ = f(x₁) is the k₁ of the next step
//!   (2)  error of x₁ ≈ h Σⱼ eⱼ kⱼ, the difference to an embedded formula of order 4
//!   (3)  x(θ) = x₀ + θ [ Δ + (1-θ) ( B + θ ( C + (1-θ) D ) ) ], order 4 on the whole step, with
//!        Δ = x₁ - x₀, B = h k₁ - Δ, C = Δ - h k₇ - B, D = h Σⱼ dⱼ kⱼ
//!
//! **Source.** dormand1980; hairer1993, §II.5 and §II.6.

/// Stages of one step, the last being the first of the next.
pub(super) const STAGES: usize = 7;

/// Row i - 2 holds aᵢ₁ … aᵢ,ᵢ₋₁ of (1), i = 2 … 7.
pub(super) const A: [&[f64]; 6] = [
    &[1.0 / 5.0],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
    &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
    &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];

/// e of (2).
pub(super) const ERROR: [f64; STAGES] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];

/// d of (3).
pub(super) const DENSE: [f64; STAGES] = [
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weights_are_those_of_an_embedded_pair() {
        // Σ b = 1, Σ b c = 1/2, Σ b c⁴ = 1/5, and the error weights sum to zero (hairer1993, table II.5.2).
        let c: Vec<f64> = std::iter::once(0.0).chain(A.iter().map(|row| row.iter().sum())).collect();
        for power in 0..5 {
            let sum: f64 = A[5].iter().zip(&c).map(|(b, c)| b * c.powi(power)).sum();
            assert!((sum - 1.0 / (power + 1) as f64).abs() < 1e-15, "power {power}: {sum}");
            if power < 4 {
                let error: f64 = ERROR.iter().zip(&c).map(|(e, c)| e * c.powi(power)).sum();
                assert!(error.abs() < 1e-15, "power {power}: {error}");
            }
        }
        assert!(DENSE.iter().sum::<f64>().abs() < 1e-14);
    }
}
