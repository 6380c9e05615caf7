//! Steps of the implicit method: Radau IIA of order 5.
//!
//! **Idea.** Collocation at the three Radau points. Fast decaying modes do not limit the step, since the method damps
//! them at any rate. The nonlinear system of a step is solved by a simplified Newton iteration with the Jacobian at the
//! start of the step, in variables in which it splits into a real system of size n and a complex one.
//!
//! **Equations.** With the stages x₀ + zᵢ at x₀ + cᵢ h, A the matrix of the method, and T⁻¹A⁻¹T = diag(γ, [α -β; β α]):
//!
//! ```text
//!   (1)  z = h (A ⊗ I) f(x₀ + z),   x₁ = x₀ + z₃
//!   (2)  w = (T⁻¹ ⊗ I) z:   (γ/h - J) Δw₁ = r₁,   ((α + iβ)/h - J)(Δw₂ + iΔw₃) = r₂ + i r₃
//!        r = (T⁻¹ ⊗ I) f(x₀ + z) - diag(γ, [α -β; β α]) w / h
//!   (3)  error of x₁ ≈ (γ/h - J)⁻¹ ( f(x₀) + Σ dᵢ zᵢ / h ),   order 3
//!   (4)  h_new = h min( 5, max( 1/8, s err^-1/4 ) ),   s = 0.9 (2K + 1) / (2K + iterations),   K the maximum number of iterations
//! ```
//!
//! Between the ends the solution is the collocation polynomial, whose error is of the order of (3).
//!
//! **Source.** hairer1996, §IV.8.
//!
//! **Departures.** The Jacobian is evaluated at every step. It lacks the dependence of a forced field on its clock,
//! which only costs iterations: the clock does not depend on the state, so the missing part is nilpotent.
//!
//! **Fails when** f jumps where the field declares no switch, like the explicit pair.

use super::Tolerance;
use super::step::Course;
use crate::contract::{Batch, Parameters, VectorField};
use crate::linalg::lu;

const STAGES: usize = 3;
const SQRT_6: f64 = 2.449_489_742_783_178;
/// c of (1).
const NODES: [f64; STAGES] = [(4.0 - SQRT_6) / 10.0, (4.0 + SQRT_6) / 10.0, 1.0];
/// γ, α and β of (2).
const GAMMA: f64 = 3.637_834_252_744_496;
const ALPHA: f64 = 2.681_082_873_627_752;
const BETA: f64 = 3.050_430_199_247_410_5;
/// T of (2), row-major.
const T: [[f64; 3]; 3] = [
    [9.123_239_487_089_295e-2, -0.141_255_295_020_954_2, -3.002_919_410_514_742_4e-2],
    [0.241_717_932_707_107, 0.204_129_352_293_799_94, 0.382_942_112_757_261_9],
    [0.966_048_182_615_093, 1.0, 0.0],
];
/// T⁻¹ of (2), row-major.
const T_INVERSE: [[f64; 3]; 3] = [
    [4.325_579_890_063_155, 0.339_199_251_815_809_9, 0.541_770_539_935_874_9],
    [-4.178_718_591_551_905, -0.327_682_820_761_062_4, 0.476_623_554_500_550_4],
    [-0.502_872_634_945_786_9, 2.571_926_949_855_605, -0.596_039_204_828_224_9],
];
/// d of (3).
const ERROR: [f64; STAGES] = [-(13.0 + 7.0 * SQRT_6) / 3.0, (-13.0 + 7.0 * SQRT_6) / 3.0, -1.0 / 3.0];
/// Maximum number of Newton iterations per step, K of (4).
const ITERATIONS: usize = 7;
/// Fraction of the accuracy of the iteration below which one update suffices: with the required contraction rate below
/// 0.99 at most a hundredth of the accuracy remains.
const ROUNDING: f64 = 1e-4;
/// Limits of the factor in (4).
const LEAST: f64 = 0.125;
const MOST: f64 = 5.0;

/// Result of one attempt at a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Attempt {
    /// The error meets the tolerance. The length is proposed for the next step.
    Accepted(f64),
    /// The error is too large, or Newton's method did not converge. The length is proposed for another attempt.
    Rejected(f64),
    /// f is not finite at a stage, or its Jacobian at the start. The length is proposed for another attempt.
    Undefined(f64),
}

/// One trajectory.
pub(super) struct Radau<'a> {
    field: &'a dyn VectorField,
    parameters: &'a [f64],
    tolerance: &'a Tolerance,
    /// `[switches]` signs of the switches along the step.
    pub(super) signs: Vec<f64>,
    /// `[n]` state and slope at the start of the step.
    pub(super) x: Vec<f64>,
    slope: Vec<f64>,
    /// `[n]` state at the end, and the polynomial of every component between the ends.
    pub(super) next: Vec<f64>,
    pub(super) courses: Vec<Course>,
    jacobian: Vec<f64>,
    /// True if the slope and the Jacobian belong to `x`.
    current: bool,
    /// Length of the last step, if it ended at `x` and the solution is smooth there.
    last: Option<f64>,
    /// Length of the last accepted step.
    length: f64,
    rejected: bool,
    real: Vec<f64>,
    complex: Vec<f64>,
    pivots: [Vec<usize>; 2],
    /// `[n][3]`: z and w of the equations, and the states and slopes of the stages, lane by lane.
    z: Vec<[f64; 3]>,
    w: Vec<[f64; 3]>,
    stages: Vec<f64>,
    slopes: Vec<f64>,
}

impl<'a> Radau<'a> {
    pub(super) fn new(
        field: &'a dyn VectorField,
        parameters: &'a [f64],
        tolerance: &'a Tolerance,
        start: &[f64],
        signs: Vec<f64>,
    ) -> Radau<'a> {
        let n = start.len();
        Radau {
            field,
            parameters,
            tolerance,
            signs,
            x: start.to_vec(),
            slope: vec![0.0; n],
            next: start.to_vec(),
            courses: vec![Course::default(); n],
            jacobian: vec![0.0; n * n],
            current: false,
            last: None,
            length: 0.0,
            rejected: false,
            real: vec![0.0; n * n],
            complex: vec![0.0; 4 * n * n],
            pivots: [vec![0; n], vec![0; 2 * n]],
            z: vec![[0.0; 3]; n],
            w: vec![[0.0; 3]; n],
            stages: vec![0.0; 3 * n],
            slopes: vec![0.0; 3 * n],
        }
    }

    /// Tries a step of length `h`, which may be negative.
    pub(super) fn attempt(&mut self, h: f64) -> Attempt {
        if !self.linearise() {
            return Attempt::Undefined(LEAST * h);
        }
        if !self.factorise(h) {
            return Attempt::Rejected(0.5 * h);
        }
        let iterations = match self.iterate(h) {
            Ok(iterations) => iterations,
            Err(failed) => {
                self.last = None;
                return failed;
            }
        };
        let error = self.error(h);
        let safety = 0.9 * (2 * ITERATIONS + 1) as f64 / (2 * ITERATIONS + iterations) as f64;
        let factor = (safety * error.powf(-0.25)).clamp(LEAST, MOST);
        if error.is_nan() || error > 1.0 {
            self.rejected = true;
            return Attempt::Rejected(h * if error.is_finite() { factor.min(0.9) } else { LEAST });
        }
        for ((next, course), (x, z)) in self.next.iter_mut().zip(&mut self.courses).zip(self.x.iter().zip(&self.z)) {
            *next = x + z[2];
            *course = polynomial(z);
        }
        let longest = if self.rejected { 1.0 } else { MOST };
        (self.rejected, self.length) = (false, h);
        Attempt::Accepted(h * factor.min(longest))
    }

    /// Continues from the end of the step.
    pub(super) fn go_on(&mut self) {
        self.x.copy_from_slice(&self.next);
        (self.current, self.last) = (false, Some(self.length));
    }

    /// Continues from a state on the step at which f or a derivative jumps, with the new sign of a switch.
    pub(super) fn pass(&mut self, from: &[f64], switch: usize, sign: f64) {
        self.x.copy_from_slice(from);
        self.signs[switch] = sign;
        (self.current, self.last) = (false, None);
    }

    /// f at the start of the step.
    pub(super) fn slope(&mut self) -> &[f64] {
        self.linearise();
        &self.slope
    }

    /// Evaluates f and its Jacobian at the start of the step; false if they are not finite.
    fn linearise(&mut self) -> bool {
        if !self.current {
            let at = Batch {
                lanes: 1,
                states: &self.x,
                parameters: Parameters::Shared(self.parameters),
                times: &[],
                signs: &self.signs,
            };
            self.field.linearise(at, &[], &mut self.slope, &mut self.jacobian, &mut []);
            self.current = true;
        }
        self.slope.iter().chain(&self.jacobian).all(|v| v.is_finite())
    }

    /// Factorises the matrices of (2) for states in units of their absolute tolerances, so that pivots are comparable;
    /// the complex one as a real matrix of twice the size.
    fn factorise(&mut self, h: f64) -> bool {
        let n = self.x.len();
        let (gamma, alpha, beta) = (GAMMA / h, ALPHA / h, BETA / h);
        self.complex.fill(0.0);
        for i in 0..n {
            for j in 0..n {
                let unit = f64::from(i == j);
                let entry = self.jacobian[i * n + j] * self.tolerance.absolute[j] / self.tolerance.absolute[i];
                self.real[i * n + j] = gamma * unit - entry;
                self.complex[i * 2 * n + j] = alpha * unit - entry;
                self.complex[(n + i) * 2 * n + n + j] = alpha * unit - entry;
            }
            self.complex[i * 2 * n + n + i] = -beta;
            self.complex[(n + i) * 2 * n + i] = beta;
        }
        let [real, complex] = &mut self.pivots;
        lu::factorise_even(&mut self.real, n, real).is_ok()
            && lu::factorise_even(&mut self.complex, 2 * n, complex).is_ok()
    }

    /// Solves (1) by (2); returns the number of iterations.
    fn iterate(&mut self, h: f64) -> Result<usize, Attempt> {
        let n = self.x.len();
        let converged = (10.0 * f64::EPSILON / self.tolerance.relative).max(self.tolerance.relative.sqrt().min(0.03));
        self.guess(h);
        let (mut before, mut rate) = (0.0, 0.0);
        let (mut one, mut two) = (vec![0.0; n], vec![0.0; 2 * n]);
        for iteration in 1..=ITERATIONS {
            if !self.evaluate_stages() {
                return Err(Attempt::Undefined(0.5 * h));
            }
            for i in 0..n {
                let f = transformed(&T_INVERSE, &[0, 1, 2].map(|s| self.slopes[3 * i + s]));
                let w = self.w[i];
                let unit = self.tolerance.absolute[i];
                one[i] = (f[0] - GAMMA / h * w[0]) / unit;
                two[i] = (f[1] - (ALPHA * w[1] - BETA * w[2]) / h) / unit;
                two[n + i] = (f[2] - (ALPHA * w[2] + BETA * w[1]) / h) / unit;
            }
            lu::solve(&self.real, n, &self.pivots[0], &mut one, 1);
            lu::solve(&self.complex, 2 * n, &self.pivots[1], &mut two, 1);
            let mut sum = 0.0;
            for i in 0..n {
                let change = [one[i], two[i], two[n + i]].map(|change| change * self.tolerance.absolute[i]);
                let weight = self.weight(i, 0.0);
                for (w, change) in self.w[i].iter_mut().zip(change) {
                    *w += change;
                    sum += (change * weight).powi(2);
                }
                self.z[i] = transformed(&T, &self.w[i]);
            }
            let size = (sum / (3 * n) as f64).sqrt();
            if !size.is_finite() {
                return Err(Attempt::Rejected(0.5 * h));
            }
            // Accepted at any contraction rate: near an equilibrium only rounding remains, which does not contract.
            if size <= ROUNDING * converged {
                return Ok(iteration);
            }
            if iteration > 1 {
                let now: f64 = size / before;
                rate = if iteration == 2 { now } else { (now * rate).sqrt() };
                if rate >= 0.99 {
                    return Err(Attempt::Rejected(0.5 * h));
                }
                let expected = size * rate / (1.0 - rate) * rate.powi((ITERATIONS - iteration) as i32);
                if expected >= converged && rate / (1.0 - rate) * size > converged {
                    let worse = (expected / converged).clamp(1e-4, 20.0);
                    let left = (4 + ITERATIONS - iteration) as f64;
                    return Err(Attempt::Rejected(h * 0.8 * worse.powf(-1.0 / left)));
                }
            }
            let remaining = if iteration > 1 { rate / (1.0 - rate) * size } else { size };
            if iteration > 1 && remaining <= converged {
                return Ok(iteration);
            }
            before = size;
        }
        Err(Attempt::Rejected(0.5 * h))
    }

    /// Initial stages: the polynomial of the last step extrapolated, or the constant state.
    fn guess(&mut self, h: f64) {
        for (i, (z, w)) in self.z.iter_mut().zip(&mut self.w).enumerate() {
            *z = match self.last {
                Some(last) => {
                    let course = self.courses[i];
                    NODES.map(|c| course.change(1.0 + c * h / last) - course.change(1.0))
                }
                None => [0.0; 3],
            };
            *w = transformed(&T_INVERSE, z);
        }
    }

    /// Evaluates f at the stages; false if it is not finite.
    fn evaluate_stages(&mut self) -> bool {
        for (i, (x, z)) in self.x.iter().zip(&self.z).enumerate() {
            (0..STAGES).for_each(|s| self.stages[3 * i + s] = x + z[s]);
        }
        let parameters = Parameters::Shared(self.parameters);
        let at = Batch { lanes: STAGES, states: &self.stages, parameters, times: &[], signs: &[] };
        if self.signs.is_empty() {
            self.field.evaluate(at, &mut self.slopes);
        } else {
            let signs: Vec<f64> = self.signs.iter().flat_map(|sign| [*sign; STAGES]).collect();
            self.field.evaluate(Batch { signs: &signs, ..at }, &mut self.slopes);
        }
        self.slopes.iter().all(|f| f.is_finite())
    }

    /// (3) in units of the tolerance.
    fn error(&mut self, h: f64) -> f64 {
        let part: Vec<f64> = self.z.iter().map(|z| (ERROR[0] * z[0] + ERROR[1] * z[1] + ERROR[2] * z[2]) / h).collect();
        let mut error: Vec<f64> = part.iter().zip(&self.slope).map(|(part, f)| part + f).collect();
        self.filter(&mut error);
        let mut size = self.size(&error);
        if size >= 1.0 && (self.last.is_none() || self.rejected) {
            // A second filtering keeps the estimate bounded for a fast mode away from its slow manifold.
            let moved: Vec<f64> = self.x.iter().zip(&error).map(|(x, error)| x + error).collect();
            let at = Batch {
                lanes: 1,
                states: &moved,
                parameters: Parameters::Shared(self.parameters),
                times: &[],
                signs: &[],
            };
            match self.signs.is_empty() {
                true => self.field.evaluate(at, &mut error),
                false => self.field.evaluate(Batch { signs: &self.signs, ..at }, &mut error),
            }
            error.iter_mut().zip(&part).for_each(|(error, part)| *error += part);
            self.filter(&mut error);
            size = self.size(&error);
        }
        size
    }

    /// Multiplies by (γ/h - J)⁻¹.
    fn filter(&self, v: &mut [f64]) {
        v.iter_mut().zip(&self.tolerance.absolute).for_each(|(v, unit)| *v /= unit);
        lu::solve(&self.real, self.x.len(), &self.pivots[0], v, 1);
        v.iter_mut().zip(&self.tolerance.absolute).for_each(|(v, unit)| *v *= unit);
    }

    fn size(&self, error: &[f64]) -> f64 {
        let sum: f64 = (0..error.len()).map(|i| (error[i] * self.weight(i, self.z[i][2])).powi(2)).sum();
        (sum / error.len() as f64).sqrt()
    }

    /// Reciprocal of the tolerance of component `i` between the start and a state that differs by `z`.
    fn weight(&self, i: usize, z: f64) -> f64 {
        let size = self.x[i].abs().max((self.x[i] + z).abs());
        1.0 / (self.tolerance.absolute[i] + self.tolerance.relative * size)
    }
}

fn transformed(matrix: &[[f64; 3]; 3], v: &[f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// Collocation polynomial of one component: 0 at the start of the step, z at the nodes.
fn polynomial(z: &[f64; 3]) -> Course {
    let quotient = |s: usize| (z[s] / NODES[s] - z[2]) / (1.0 - NODES[s]);
    let c = (quotient(1) - quotient(0)) / (NODES[1] - NODES[0]);
    Course::new([z[2], quotient(0) - NODES[0] * c, c, 0.0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transformation_diagonalises_the_method() {
        // A of Radau IIA, order 5 (hairer1996, table IV.5.6).
        let s = SQRT_6;
        let a = [
            [(88.0 - 7.0 * s) / 360.0, (296.0 - 169.0 * s) / 1800.0, (-2.0 + 3.0 * s) / 225.0],
            [(296.0 + 169.0 * s) / 1800.0, (88.0 + 7.0 * s) / 360.0, (-2.0 - 3.0 * s) / 225.0],
            [(16.0 - s) / 36.0, (16.0 + s) / 36.0, 1.0 / 9.0],
        ];
        let blocks = [[GAMMA, 0.0, 0.0], [0.0, ALPHA, -BETA], [0.0, BETA, ALPHA]];
        for k in 0..3 {
            let unit = [0, 1, 2].map(|i| f64::from(i == k));
            let back = transformed(&T, &transformed(&T_INVERSE, &unit));
            // A T Λ T⁻¹ = 1.
            let whole = transformed(&a, &transformed(&T, &transformed(&blocks, &transformed(&T_INVERSE, &unit))));
            for i in 0..3 {
                assert!((back[i] - unit[i]).abs() < 1e-14, "{back:?}");
                assert!((whole[i] - unit[i]).abs() < 1e-13, "{whole:?}");
            }
        }
    }

    #[test]
    fn the_polynomial_goes_through_the_stages() {
        let z = [0.3, -0.2, 0.7];
        let course = polynomial(&z);
        for s in 0..3 {
            assert!((course.change(NODES[s]) - z[s]).abs() < 1e-15);
        }
    }
}
