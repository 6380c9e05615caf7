//! Cycles near a resonance of a lightly damped field, from averaged equations.
//!
//! **Idea.** Near a resonance the motion is nearly the response x₀ plus a few modes with slowly varying amplitudes, and
//! a stationary point of the averaged equations is nearly a cycle, stable or not, isolated or not. These are only a few
//! equations, so zeros can be sought from a whole grid of amplitudes and phases. They serve as starts for Newton's
//! method on the cycle.
//!
//! **Equations.** With A the mean of f_x along x₀, A q_j = μ_j q_j, p_jᴴ A = μ_j p_jᴴ, p_jᴴ q_j = 1, and ⟨·⟩ the mean
//! over the period 2π/w,
//!
//!   (1)  x = x₀ + y,  y = Re Σ_j c_j q_j e^{i k_j w t}
//!   (2)  E_j = i k_j w c_j - 2 p_jᴴ ⟨(f(x₀ + y) - f(x₀)) e^{-i k_j w t}⟩ = 0
//!
//! for one mode in a forced field, where w is the forcing frequency divided by a whole number, and for two modes in an
//! autonomous field, where w is unknown and c₁ is real, since the origin of time is arbitrary.
//!
//! The mean contains μ_j c_j from A y. The rest, due to nonlinear forces, must sustain the mode against its damping:
//!
//!   (3)  |2 p_jᴴ ⟨…⟩ - μ_j c_j| ≥ |Re μ_j| |c_j|
//!
//! Starts that provide less than half of that are discarded.
//!
//! **Source.** nayfeh1979, chapters 4 and 6: averaging at external and internal resonances; quadrature is ours.
//!
//! **Fails when** the motion is far from a sum of the two modes, such as far from the resonance with a hard contact.

use crate::attractors::Candidate;
use crate::contract::{Batch, Parameters, VectorField};
use crate::linalg::lu;
use crate::linalg::size_in_any_units;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Number of nodes of the mean over a period.
const NODES: usize = 128;
/// Number of amplitudes in the grid of starts, each 1/√2 of the one before; the first fills the ranges of the states.
const AMPLITUDES: i32 = 17;
/// Shares of the second of two modes in the amplitude.
const SHARES: [f64; 4] = [0.2, 0.4, 0.6, 0.8];
/// Number of phases in the grid.
const PHASES: u32 = 6;
/// Number of starts that are corrected, those with the smallest residual.
const CORRECTED: usize = 48;
/// Largest number of solutions kept.
const KEPT: usize = 4;
const ROUNDS: usize = 25;

/// A mode of oscillation, scaled to half the ranges of the states.
#[derive(Clone, Debug)]
pub(super) struct Mode {
    /// μ.
    rate: Complex64,
    right: Vec<Complex64>,
    left: Vec<Complex64>,
}

impl Mode {
    /// Returns the mode of the eigenvalue of `matrix` `[n × n]` closest to `rate`; `halves` are half the ranges of the
    /// states.
    pub(super) fn of(matrix: &[f64], rate: Complex64, halves: &[f64]) -> Option<Mode> {
        let n = halves.len();
        // (A - z) (a + ib) as a real system of twice the size; a shift of the size of rounding keeps it regular.
        let shifted = rate + 1e-14 * rate.norm().max(size_in_any_units(matrix, n));
        let (mut real, mut pivots) = (vec![0.0; 4 * n * n], vec![0; 2 * n]);
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let own = matrix[i * n + j] - if i == j { shifted.re } else { 0.0 };
            let turned = if i == j { shifted.im } else { 0.0 };
            real[2 * n * i + j] = own;
            real[2 * n * (n + i) + n + j] = own;
            real[2 * n * i + n + j] = turned;
            real[2 * n * (n + i) + j] = -turned;
        }
        lu::factorise(&mut real, 2 * n, &mut pivots).ok()?;
        let iterated = |transposed: bool| {
            let mut vector: Vec<f64> = (0..2 * n).map(|k| (1.0 + k as f64).sin()).collect();
            for _ in 0..3 {
                match transposed {
                    false => lu::solve(&real, 2 * n, &pivots, &mut vector, 1),
                    true => lu::solve_transposed(&real, 2 * n, &pivots, &mut vector),
                }
                let size = vector.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                vector.iter_mut().for_each(|x| *x /= size);
            }
            (0..n).map(|i| Complex64::new(vector[i], vector[n + i])).collect::<Vec<_>>()
        };
        let (mut right, mut left) = (iterated(false), iterated(true));
        let size = right.iter().zip(halves).fold(0.0f64, |m, (q, half)| m.max(q.norm() / half));
        right.iter_mut().for_each(|q| *q /= size);
        let product: Complex64 = left.iter().zip(&right).map(|(p, q)| p.conj() * q).sum();
        left.iter_mut().for_each(|p| *p /= product.conj());
        let sound = right.iter().chain(&left).all(|z| z.is_finite());
        sound.then_some(Mode { rate, right, left })
    }
}

/// Modes that may oscillate together, each with its order k.
pub(super) struct Averaged<'a> {
    field: &'a dyn VectorField,
    parameters: &'a [f64],
    modes: Vec<(&'a Mode, u32)>,
    /// For a forced field, the number of forcing periods in one period of the cycle.
    turns: Option<u32>,
    /// x₀ and f(x₀) at the nodes, `[n × nodes]`.
    states: Vec<f64>,
    flow: Vec<f64>,
    times: Vec<f64>,
    /// e^{i k_j w t} at the nodes.
    carriers: Vec<Vec<Complex64>>,
}

/// A zero of (2), or a start for one.
#[derive(Clone, Debug)]
struct Swing {
    amplitudes: Vec<Complex64>,
    w: f64,
}

impl Swing {
    fn size(&self) -> f64 {
        self.amplitudes.iter().map(|c| c.norm_sqr()).sum::<f64>().sqrt()
    }
}

impl<'a> Averaged<'a> {
    /// Evaluates the response at the nodes; `response` returns x₀ at a time, in forcing periods if there is a forcing.
    pub(super) fn new(
        field: &'a dyn VectorField,
        parameters: &'a [f64],
        modes: Vec<(&'a Mode, u32)>,
        turns: Option<u32>,
        response: &dyn Fn(f64) -> Vec<f64>,
    ) -> Averaged<'a> {
        let n = field.dim();
        let time = |node: usize| f64::from(turns.unwrap_or(0)) * node as f64 / NODES as f64;
        let (mut states, mut flow) = (vec![0.0; n * NODES], vec![0.0; n * NODES]);
        for node in 0..NODES {
            response(time(node)).iter().enumerate().for_each(|(i, x)| states[i * NODES + node] = *x);
        }
        let times = if turns.is_some() { (0..NODES).map(time).collect() } else { Vec::new() };
        let parameters_of = Parameters::Shared(parameters);
        field.evaluate(
            Batch { lanes: NODES, states: &states, parameters: parameters_of, times: &times, signs: &[] },
            &mut flow,
        );
        let carrier = |order: u32| {
            let angle = |node: usize| TAU * f64::from(order) * node as f64 / NODES as f64;
            (0..NODES).map(|node| Complex64::cis(angle(node))).collect::<Vec<_>>()
        };
        let carriers = modes.iter().map(|(_, order)| carrier(*order)).collect();
        Averaged { field, parameters, modes, turns, states, flow, times, carriers }
    }

    /// Returns motions that solve (2), as starts for Newton's method on the cycle, and the number of starts corrected.
    pub(super) fn motions(&self) -> (Vec<Candidate>, usize) {
        let mut starts: Vec<(f64, Swing)> = self.grid().into_iter().filter_map(|swing| self.rated(swing)).collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        starts.truncate(CORRECTED);
        let (count, mut found) = (starts.len(), Vec::<Swing>::new());
        for (_, start) in starts {
            if let Some(swing) = self.corrected(start)
                && !found.iter().any(|other| self.same(other, &swing))
            {
                found.push(swing);
            }
        }
        found.truncate(KEPT);
        (found.iter().map(|swing| self.motion(swing)).collect(), count)
    }

    /// Initial value of w.
    fn first_w(&self) -> f64 {
        let (mode, order) = self.modes[0];
        self.turns.map_or(mode.rate.im / f64::from(order), |turns| TAU / f64::from(turns))
    }

    /// Power of a phase that does not depend on the origin of time.
    fn fold(&self) -> u32 {
        self.turns.unwrap_or(self.modes[0].1)
    }

    fn grid(&self) -> Vec<Swing> {
        let w = self.first_w();
        let mut all = Vec::new();
        for amplitude in (0..AMPLITUDES).map(|j| 0.5f64.powf(0.5 * f64::from(j))) {
            for phase in 0..PHASES {
                let turn = Complex64::cis(TAU * f64::from(phase) / f64::from(PHASES * self.fold()));
                if self.modes.len() == 1 {
                    all.push(Swing { amplitudes: vec![amplitude * turn], w });
                    continue;
                }
                all.extend(SHARES.map(|share| {
                    let amplitudes = vec![(amplitude * (1.0 - share)).into(), amplitude * share * turn];
                    Swing { amplitudes, w }
                }));
            }
        }
        all
    }

    /// Returns a start with the w that suits it best, and its relative residual; `None` if (3) fails by more than half.
    fn rated(&self, mut swing: Swing) -> Option<(f64, Swing)> {
        let mut f = vec![0.0; self.states.len()];
        self.field.evaluate(self.batch(&self.place(&swing)), &mut f);
        let rates = self.rates(&f);
        let driven = (0..self.modes.len()).all(|j| {
            let (c, mode) = (swing.amplitudes[j], self.modes[j].0);
            (rates[j] - mode.rate * c).norm() >= 0.5 * mode.rate.re.abs() * c.norm() && rates[j].is_finite()
        });
        if !driven {
            return None;
        }
        if self.turns.is_none() {
            let errors = self.residual(&swing, &rates);
            let (mut product, mut square) = (0.0, 0.0);
            for (slope, error) in self.slopes(&swing).iter().zip(errors) {
                product += (slope.conj() * error).re;
                square += slope.norm_sqr();
            }
            swing.w -= product / square;
        }
        let error = self.residual(&swing, &rates).iter().map(|e| e.norm_sqr()).sum::<f64>().sqrt();
        (swing.w > 0.0).then_some((error / (swing.w * swing.size()), swing))
    }

    fn batch<'b>(&'b self, states: &'b [f64]) -> Batch<'b> {
        Batch { lanes: NODES, states, parameters: Parameters::Shared(self.parameters), times: &self.times, signs: &[] }
    }

    /// Returns y at the nodes.
    fn deviation(&self, swing: &Swing) -> Vec<f64> {
        let n = self.field.dim();
        let mut y = vec![0.0; n * NODES];
        for ((c, (mode, _)), carrier) in swing.amplitudes.iter().zip(&self.modes).zip(&self.carriers) {
            for (i, q) in mode.right.iter().enumerate() {
                let row = &mut y[i * NODES..(i + 1) * NODES];
                row.iter_mut().zip(carrier).for_each(|(y, e)| *y += (c * q * e).re);
            }
        }
        y
    }

    /// Returns x at the nodes.
    fn place(&self, swing: &Swing) -> Vec<f64> {
        self.states.iter().zip(self.deviation(swing)).map(|(x, y)| x + y).collect()
    }

    /// Returns 2 p_jᴴ ⟨v e^{-i k_j w t}⟩ for each mode.
    fn means(&self, v: &[f64]) -> Vec<Complex64> {
        let mean = |((mode, _), carrier): (&(&Mode, u32), &Vec<Complex64>)| -> Complex64 {
            let part = |row: &[f64]| row.iter().zip(carrier).map(|(v, e)| e.conj() * *v).sum::<Complex64>();
            let rows = mode.left.iter().zip(v.chunks_exact(NODES));
            rows.map(|(p, row)| p.conj() * part(row)).sum::<Complex64>() * 2.0 / NODES as f64
        };
        self.modes.iter().zip(&self.carriers).map(mean).collect()
    }

    /// Returns the means of f(x) - f(x₀), the rates of change of the amplitudes.
    fn rates(&self, f: &[f64]) -> Vec<Complex64> {
        let changed: Vec<f64> = f.iter().zip(&self.flow).map(|(a, b)| a - b).collect();
        self.means(&changed)
    }

    /// Evaluates (2).
    fn residual(&self, swing: &Swing, rates: &[Complex64]) -> Vec<Complex64> {
        self.slopes(swing).iter().zip(rates).map(|(slope, rate)| slope * swing.w - rate).collect()
    }

    /// Derivative of (2) with respect to w.
    fn slopes(&self, swing: &Swing) -> Vec<Complex64> {
        let slope = |(c, (_, order)): (&Complex64, &(&Mode, u32))| Complex64::i() * f64::from(*order) * c;
        swing.amplitudes.iter().zip(&self.modes).map(slope).collect()
    }

    /// Newton's method, with steps of at most half the amplitudes; `None` unless it converges to a motion of all modes.
    fn corrected(&self, mut swing: Swing) -> Option<Swing> {
        const CONVERGED: f64 = 1e-7;
        const LEAST: f64 = 1e-2;
        for _ in 0..ROUNDS {
            let step = self.step(&swing)?;
            let (size, w) = (swing.size(), swing.w);
            let moved = step.size() / size + (step.w / w).abs();
            let share = (0.5 / moved).min(1.0);
            swing.amplitudes.iter_mut().zip(&step.amplitudes).for_each(|(c, d)| *c -= share * d);
            swing.w -= share * step.w;
            if !(moved.is_finite() && swing.w > 0.0) {
                return None;
            }
            if moved < CONVERGED {
                let whole = swing.amplitudes.iter().all(|c| c.norm() > LEAST * swing.size());
                return (whole && swing.size() > LEAST * 0.5f64.powf(0.5 * f64::from(AMPLITUDES))).then_some(swing);
            }
        }
        None
    }

    /// Returns Newton's step, to be subtracted.
    fn step(&self, swing: &Swing) -> Option<Swing> {
        let m = self.modes.len();
        let x = self.place(swing);
        let mut f = vec![0.0; x.len()];
        self.field.evaluate(self.batch(&x), &mut f);
        let errors = self.residual(swing, &self.rates(&f));
        // Real and imaginary part of each amplitude; in an autonomous field w replaces the imaginary part of the first.
        let columns = (0..2 * m).map(|c| match (c, self.turns) {
            (1, None) => self.slopes(swing),
            _ => self.column(&x, swing, c),
        });
        let (mut matrix, mut pivots) = (vec![0.0; 4 * m * m], vec![0; 2 * m]);
        for (c, column) in columns.enumerate() {
            for (j, value) in column.iter().enumerate() {
                (matrix[2 * j * 2 * m + c], matrix[(2 * j + 1) * 2 * m + c]) = (value.re, value.im);
            }
        }
        let mut step: Vec<f64> = errors.iter().flat_map(|e| [e.re, e.im]).collect();
        lu::factorise(&mut matrix, 2 * m, &mut pivots).ok()?;
        lu::solve(&matrix, 2 * m, &pivots, &mut step, 1);
        let w = if self.turns.is_none() { std::mem::take(&mut step[1]) } else { 0.0 };
        Some(Swing { amplitudes: step.chunks_exact(2).map(|c| Complex64::new(c[0], c[1])).collect(), w })
    }

    /// Derivative of (2) at x with respect to the real or imaginary part of an amplitude.
    fn column(&self, x: &[f64], swing: &Swing, part: usize) -> Vec<Complex64> {
        let mut amplitudes = vec![Complex64::new(0.0, 0.0); self.modes.len()];
        amplitudes[part / 2] = if part.is_multiple_of(2) { 1.0.into() } else { Complex64::i() };
        let unit = Swing { amplitudes, w: swing.w };
        let mut direction = self.deviation(&unit);
        direction.resize(x.len() + self.parameters.len() * NODES, 0.0);
        let mut bent = vec![0.0; x.len()];
        self.field.directional(self.batch(x), &[&direction], &mut bent);
        self.residual(&unit, &self.means(&bent))
    }

    /// True if two solutions differ only in the origin of time.
    fn same(&self, a: &Swing, b: &Swing) -> bool {
        const NEAR: f64 = 1e-3;
        let phase = |swing: &Swing| {
            let unit = |j: usize| swing.amplitudes[j] / swing.amplitudes[j].norm();
            match self.turns {
                Some(turns) => unit(0).powu(turns),
                None => unit(0).powu(self.modes[1].1) * unit(1).conj().powu(self.modes[0].1),
            }
        };
        let sizes = a.amplitudes.iter().zip(&b.amplitudes).map(|(a, b)| (a.norm() - b.norm()).abs());
        sizes.sum::<f64>() < NEAR * a.size() && (phase(a) - phase(b)).norm() < NEAR
    }

    /// Returns (1) over one period.
    fn motion(&self, swing: &Swing) -> Candidate {
        let n = self.field.dim();
        let y = self.deviation(swing);
        let period = self.turns.map_or(TAU / swing.w, f64::from);
        let times = (0..=NODES).map(|node| period * node as f64 / NODES as f64).collect();
        let nodes = (0..NODES).chain([0]);
        let state = |node: usize| (0..n).map(move |i| i * NODES + node);
        let states = nodes.flat_map(state).map(|k| self.states[k] + y[k]).collect();
        Candidate::Cycle { period, times, states }
    }
}

#[cfg(test)]
mod tests {
    use super::{Averaged, Mode};
    use crate::attractors::Candidate;
    use crate::contract::VectorField;
    use crate::model::{Definition, Forcing, Model, ModelSource, Parameter, State};
    use num_complex::Complex64;
    use std::f64::consts::TAU;

    /// x'' + 2ζ x' + x + α x³ = A cos ωt.
    fn duffing(parameters: [f64; 4]) -> Model {
        let names = ["omega", "A", "zeta", "alpha"];
        Model::compile(ModelSource {
            name: "duffing".into(),
            parameters: names.iter().zip(parameters).map(|(name, value)| Parameter::new(name, value)).collect(),
            states: vec![State::new("x"), State::new("v")],
            equations: vec![
                Definition::new("x", "v"),
                Definition::new("v", "-2*zeta*v - x - alpha*x^3 + A*cos(omega*t)"),
            ],
            forcing: Some(Forcing { is_frequency: true, expression: "omega".into() }),
            ..ModelSource::default()
        })
        .unwrap()
    }

    /// The subharmonic x = B cos ωt + a cos(ωt/3 + φ) of a weak cubic spring, B = A/(1 - ω²), by first-order balance:
    /// [1 - ω²/9 + α(¾a² + 3/2 B²)]² + (2ζω/3)² = (¾ α a B)². nayfeh1979, §4.1.4.
    #[test]
    fn the_subharmonic_of_order_three_of_a_weakly_nonlinear_oscillator() {
        let (omega, force, zeta, alpha) = (3.02, 8.0, 1e-4, 0.002);
        let parameters = [omega, force, zeta, alpha];
        let model = duffing(parameters);
        let period = TAU / omega;
        // Time is counted in periods.
        let matrix = [0.0, period, -period, -2.0 * zeta * period];
        let rate = period * Complex64::new(-zeta, (1.0 - zeta * zeta).sqrt());
        let mode = Mode::of(&matrix, rate, &[8.0, 8.0]).unwrap();
        let b = force / (1.0 - omega * omega);
        let response = |t: f64| vec![b * (TAU * t).cos(), -b * omega * (TAU * t).sin()];
        let averaged = Averaged::new(&model, &parameters, vec![(&mode, 1)], Some(3), &response);
        let (motions, _) = averaged.motions();
        let balance = |a: f64| {
            let stiff = 1.0 - omega * omega / 9.0 + alpha * (0.75 * a * a + 1.5 * b * b);
            stiff * stiff + (2.0 * zeta * omega / 3.0).powi(2) - (0.75 * alpha * a * b).powi(2)
        };
        let grid: Vec<f64> = (1..8000).map(|k| k as f64 * 1e-3).collect();
        let expected: Vec<f64> =
            grid.windows(2).filter(|w| balance(w[0]) * balance(w[1]) < 0.0).map(|w| w[0]).collect();
        assert!(!expected.is_empty() && model.forced());
        let mut found: Vec<f64> = motions.iter().map(amplitude).collect();
        found.sort_by(f64::total_cmp);
        assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 0.05 * b), "{found:?} {expected:?}");
    }

    /// Amplitude of the component at a third of the forcing frequency.
    fn amplitude(motion: &Candidate) -> f64 {
        let Candidate::Cycle { period, times, states } = motion else { return f64::NAN };
        let last = times.len() - 1;
        let part = |k: usize| states[2 * k] * Complex64::cis(-TAU * times[k] / period);
        ((0..last).map(part).sum::<Complex64>() * 2.0 / last as f64).norm()
    }
}
