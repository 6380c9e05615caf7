//! Rotors: random parameters of the overhung rotor.

use crate::TOLERANCE;
use crate::cases::{Case, First, study};
use crate::random::Random;

const MODEL: &str = include_str!("../../../models/overhung-rotor.toml");
/// Damping below which samples take long to settle. Solutions are found at this damping and then carried to a smaller
/// one.
const SETTLING: f64 = 0.01;

/// Returns the rotors with the given numbers: damping over four decades, unbalance from a twentieth of the clearance to
/// twice the clearance, contact stiffness from 1 to 50 with a sharpness of 15 times the stiffness. Even numbers have
/// the cubic spring, odd ones the ring.
pub fn rotors(numbers: std::ops::Range<usize>) -> Vec<Case> {
    numbers.map(rotor).collect()
}

fn rotor(number: usize) -> Case {
    let mut random = Random::new(77_000 + number as u64);
    let zeta = random.logarithmic(1e-5, 0.1);
    let epsilon = random.uniform(0.05, 2.0);
    let beta = random.uniform(1.0, 50.0);
    let gamma = random.uniform(0.05, 1.0);
    let polar = random.uniform(0.0, 0.4);
    let omega = random.uniform(2.5, 7.0);
    let kappa = (number % 2) as f64;
    let parameters = format!(
        "Omega = {omega:?}, kappa = {kappa:?}, epsilon = {epsilon:?}, beta = {beta:?}, K = {:?}, gamma = {gamma:?}, J_p = {polar:?}",
        15.0 * beta
    );
    let settled = zeta.max(SETTLING);
    let seed = format!("attractor = \"equilibrium\"\nparameters = {{ {parameters}, zeta = {settled:?} }}");
    let study = study(MODEL, &seed, "free = \"Omega\"\nrange = [0.5, 12]");
    let index = study.model.parameters.iter().position(|p| p.name == "zeta").unwrap_or(0);
    let first =
        First::Sampled { parameters: study.plan.seeds[0].parameters.clone(), to: (index, zeta), random: number as u64 };
    let name = format!(
        "rotor {number} (zeta {zeta:.3e}, epsilon {epsilon:.3}, beta {beta:.1}, gamma {gamma:.2}, J_p {polar:.3}, kappa {kappa}, \
         Omega {omega:.3})"
    );
    Case { name, study, first, tolerance: TOLERANCE, bounded: false }
}
