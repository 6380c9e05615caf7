//! The backbone as a curve F(u) = 0.
//!
//! **Equations.** u = (r₀, v₀, T_h, Ω): a turning point of the radius at r₀ > 0 with transverse speed v₀, half a radial
//! period, the rotor speed. With x and P after the time T_h from (r₀, 0, 0, v₀), d = n - m, z = u + jv, a = πm/d:
//!
//! 1. Im(z e^{ja}) = 0: the next turning point lies on a line of symmetry of the closed orbit
//! 2. Re(z′ e^{ja}) = 0: the point reached is a turning point
//! 3. P = 0: power
//!
//! An orbit is its own mirror image at every turning point, so half a radial period determines it. F_u (3 × 4) is
//! exact: its columns are integrated along with the orbit.

use super::flow::{Flow, ORBIT};
use crate::campbell::Ratio;
use crate::field::OverhungRotor;
use crate::quantities::Nondimensional;
use foldline::contract::{Examination, Singular, Verdict, ZeroProblem};
use foldline::diagram::{Cycle, Mesh, Point, Solution, Trust};
use foldline::linalg::lu;
use foldline::problem::{extremes, gauss::Scheme};
use foldline::simulation::{Integrator, Outcome, Passage, Tolerance};

/// Number of unknowns.
const SIZE: usize = 4;
/// Degree of the profile of a stored orbit: the order of the integrator, whose steps are its mesh.
const DEGREE: usize = 5;
/// Relative change of speed whose step length equals that of a relative change of radius by 1.
const SPEED_SHARE: f64 = 0.1;
/// Tolerance of the mesh relative to that of the values on it.
const LOOSER: f64 = 1e2;

/// Backbone as a continuation problem (see the module).
pub struct BackboneProblem {
    rotor: OverhungRotor,
    constants: Nondimensional,
    ratio: Ratio,
    tolerance: f64,
    scale: [f64; SIZE],
    matrix: Vec<f64>,
    pivots: Vec<usize>,
    drawn: Option<(Vec<f64>, Cycle)>,
}

impl BackboneProblem {
    /// Returns the problem at these constants, of which ζ, ε and Ω are ignored. Orbits are integrated to `tolerance`.
    pub fn new(rotor: OverhungRotor, constants: Nondimensional, ratio: Ratio, tolerance: f64) -> BackboneProblem {
        BackboneProblem {
            rotor,
            constants,
            ratio,
            tolerance,
            scale: [1.0; SIZE],
            matrix: vec![0.0; SIZE * SIZE],
            pivots: vec![0; SIZE],
            drawn: None,
        }
    }

    /// d, the number of radial periods in a period.
    fn radial_periods(&self) -> f64 {
        f64::from(self.ratio.backward) - f64::from(self.ratio.forward)
    }

    /// x, P and optionally their derivatives after the time T_h.
    fn half(&self, u: &[f64], derivatives: bool) -> Option<(Flow, Vec<f64>)> {
        let flow = Flow::new(self.rotor, self.constants, derivatives);
        if !(u[0] > 0.0 && u[2] > 0.0 && u.iter().all(|x| x.is_finite())) {
            return None;
        }
        let tolerance = Tolerance { relative: self.tolerance, absolute: flow.absolute(self.tolerance, u[0]) };
        let end = Integrator::new(&flow, &u[3..], tolerance).state_after(&flow.start(u[0], u[1]), [0.0, u[2]])?;
        Some((flow, end))
    }

    /// Residuals of equations 1 to 3, or their derivatives for a column, divided by their scales.
    fn equations(&self, column: &[f64]) -> [f64; 3] {
        let angle = std::f64::consts::PI * f64::from(self.ratio.forward) / self.radial_periods();
        let (sin, cos) = angle.sin_cos();
        let size = self.scale[0];
        [
            (column[0] * sin + column[1] * cos) / size,
            (column[2] * cos - column[3] * sin) / size,
            column[4] / (size * size),
        ]
    }

    fn at(&self, omega: f64) -> Nondimensional {
        Nondimensional { omega, zeta: 0.0, epsilon: 0.0, ..self.constants }
    }

    /// The whole closed orbit on the mesh of the integrator's steps.
    fn cycle(&self, u: &[f64]) -> Cycle {
        let (parameters, period) = (self.at(u[3]).parameters(), 2.0 * self.radial_periods() * u[2]);
        // The steps of a looser integration are a sufficient mesh for polynomials of its order; the values on it are
        // accurate.
        let integrator = |tolerance: f64| {
            let accuracy = Tolerance { relative: tolerance, absolute: vec![tolerance * u[0]; 4] };
            Integrator::new(&self.rotor, &parameters, accuracy).with_longest_step(period / 40.0)
        };
        let (coarse, fine) = (integrator(LOOSER * self.tolerance), integrator(self.tolerance));
        let scheme = Scheme::new(DEGREE);
        let start = vec![u[0], 0.0, 0.0, u[1]];
        let (mut mesh, mut profile, mut x) = (vec![0.0], Vec::new(), start.clone());
        let arrival = coarse.trajectory(&start, [0.0, period], &[], &mut |passage| {
            if let Passage::Step(step) = passage {
                for pair in scheme.nodes.windows(2).map(|pair| [pair[0], pair[1]]) {
                    profile.extend_from_slice(&x);
                    x = fine.state_after(&x, pair.map(|c| step.time_at(c))).unwrap_or_else(|| vec![f64::NAN; 4]);
                }
                profile.extend_from_slice(&x);
                let last = scheme.nodes.last().copied().unwrap_or(0.0);
                x = fine.state_after(&x, [last, 1.0].map(|c| step.time_at(c))).unwrap_or_else(|| vec![f64::NAN; 4]);
                mesh.push(step.time_at(1.0) / period);
            }
            Verdict::Continue
        });
        if let (Outcome::Reached, Some(last)) = (arrival.outcome, mesh.last_mut()) {
            *last = 1.0;
        }
        Cycle {
            points: foldline::problem::gauss::Points::Gauss,
            period,
            forcing_periods: 0,
            mesh: mesh.into(),
            degree: DEGREE,
            profile,
            gain: Vec::new(),
        }
    }
}

impl ZeroProblem for BackboneProblem {
    fn unknowns(&self) -> usize {
        SIZE
    }

    fn anchor(&mut self, u: &[f64]) {
        // All scales are relative, since a backbone may cover several orders of magnitude in radius. Speed has more
        // weight; otherwise steps would pass over the effect of the onset of contact within a radius of 1/K.
        self.scale = [u[0], u[1].abs() + u[0], u[2], SPEED_SHARE * (1.0 + u[3].abs())];
    }

    fn residual(&mut self, u: &[f64], r: &mut [f64]) -> bool {
        let Some((_, end)) = self.half(u, false) else { return false };
        let equations = self.equations(&end);
        r[..3].copy_from_slice(&equations);
        equations.iter().all(|x| x.is_finite())
    }

    fn factorise(&mut self, u: &[f64], row: &[f64]) -> Result<(), Singular> {
        let (flow, end) = self.half(u, true).ok_or(Singular)?;
        let mut slope = vec![0.0; end.len()];
        flow.slope(&end, u[3], &mut slope);
        let column = |c: usize| &end[c * ORBIT..(c + 1) * ORBIT];
        for (at, entries) in [column(1), column(2), &slope[..ORBIT], column(3)].into_iter().enumerate() {
            let entries = self.equations(entries);
            (0..3).for_each(|i| self.matrix[i * SIZE + at] = entries[i]);
            self.matrix[3 * SIZE + at] = row[at] / self.scale[at].powi(2);
        }
        lu::factorise(&mut self.matrix, SIZE, &mut self.pivots)
    }

    fn solve(&mut self, rhs: &[f64], x: &mut [f64]) {
        x.copy_from_slice(rhs);
        lu::solve(&self.matrix, SIZE, &self.pivots, x, 1);
    }

    fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        (0..SIZE).map(|i| a[i] * b[i] / self.scale[i].powi(2)).sum()
    }

    fn relative_size(&self, du: &[f64], u: &[f64]) -> f64 {
        let sizes = [u[0], u[1].abs() + u[0], u[2], 1.0 + u[3].abs()];
        (0..SIZE).map(|i| (du[i] / sizes[i]).abs()).fold(0.0, |m: f64, x| if x > m || x.is_nan() { x } else { m })
    }

    fn mesh(&self) -> Mesh {
        Mesh::from([])
    }

    fn set_mesh(&mut self, _mesh: &Mesh) {}

    fn transfer(&self, v: &[f64], _from: &Mesh, _to: &Mesh) -> Vec<f64> {
        v.to_vec()
    }

    fn better_mesh(&self, _u: &[f64], _tolerance: f64) -> Option<Mesh> {
        None
    }

    fn finer_mesh(&self) -> Option<Mesh> {
        None
    }

    /// Returns no spectrum: the orbits near a backbone form a family of more than one dimension, whose multipliers are
    /// all 1.
    fn examine(&mut self, u: &[f64]) -> Examination {
        let cycle = self.cycle(u);
        let parameters = self.at(u[3]).parameters();
        let scheme = cycle.scheme();
        let ranges = match cycle.profile.iter().all(|x| x.is_finite()) && cycle.intervals() > 0 {
            true => extremes::of_profile(&self.rotor, &parameters, [&cycle.profile, &cycle.mesh], 0, scheme),
            false => vec![[f64::NAN; 2]; 5],
        };
        let mut r = [0.0; SIZE];
        let residual = if self.residual(u, &mut r) { r.iter().fold(0.0, |m: f64, x| m.max(x.abs())) } else { f64::NAN };
        self.drawn = Some((u.to_vec(), cycle));
        Examination { ranges, trust: Trust { residual, ..Trust::default() }, ..Examination::default() }
    }

    /// There is no spectrum to measure it by, and no other backbone is close except at a root.
    fn margin(&self, _at: &Point) -> f64 {
        f64::INFINITY
    }

    fn point(&self, u: &[f64], tangent: &[f64], examination: Examination) -> Point {
        let cycle = match &self.drawn {
            Some((of, cycle)) if of == u => cycle.clone(),
            _ => self.cycle(u),
        };
        Point {
            position: 0,
            parameters: self.at(u[3]).parameters().to_vec(),
            solution: Solution::Cycle(cycle),
            tangent: tangent.to_vec(),
            step: 0.0,
            spectrum: examination.spectrum,
            unstable: examination.unstable,
            ranges: examination.ranges,
            averages: examination.averages,
            trust: examination.trust,
            cost: Default::default(),
        }
    }

    fn unknowns_of(&mut self, point: &Point) -> Vec<f64> {
        let (x, period) = match &point.solution {
            Solution::Cycle(cycle) => (cycle.state(0.0), cycle.period),
            Solution::Equilibrium(x) => (x.clone(), f64::NAN),
            Solution::Torus(torus) => (torus.state(0.0, 0.0), f64::NAN),
        };
        let half = 0.5 * period / self.radial_periods();
        vec![x[0], x[3], half, point.parameters.first().copied().unwrap_or(f64::NAN)]
    }
}
