//! Quantities held at given values.
//!
//! **Idea.** With k free parameters the solutions form a surface of dimension k. k - 1 quantities held at values select a
//! curve on it, which is followed like a bifurcation curve ([`crate::problem::held`]).
//!
//! **Equations.** Quantity q_i, its value v_i and size s_i:
//!
//! ```text
//!   (1)  g_i = (q_i(w) - v_i) / s_i,    dg_i = q_i' δw / s_i        q_i' from `gradient`
//! ```
//!
//! A largest value follows the local maximum closest to that of the reference, so that g is smooth. Where another maximum
//! becomes larger, the curve of the largest value has a corner ([`Corner`]).

use super::gradient::{Along, Gradient};
use super::quantity::{Quantity, wrapped};
use crate::contract::{Condition, Monitor, Sight, VectorField};
use crate::diagram::{Cycle, Ending, Kind, Mesh, Point, Solution};
use crate::linalg::dot;
use crate::problem::Setting;
use crate::problem::gauss::Scheme;
use crate::problem::piecewise::{self, PiecewiseFlow, Switched};
use num_complex::Complex64;

/// A quantity held at a value.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// The quantity.
    pub quantity: Quantity,
    /// Its value.
    pub value: f64,
    /// Name of the quantity.
    pub name: String,
}

impl Level {
    /// Deviation of a value from the level; for phases the smaller angle.
    pub fn off(&self, value: f64) -> f64 {
        if self.quantity.is_phase() { wrapped(value - self.value) } else { value - self.value }
    }

    /// Size of the quantity, relative to which deviations count: that of the value, at least `least`; a radian for phases.
    fn size(&self, least: f64) -> f64 {
        if self.quantity.is_phase() { 360.0 / std::f64::consts::TAU } else { self.value.abs().max(least) }
    }
}

/// Defining system of held quantities.
pub struct OnLevels<'a> {
    setting: Setting<'a>,
    levels: Vec<Level>,
    sizes: Vec<f64>,
    like: Solution,
    /// For each level the time of the extremum that decides it: of the reference, and at the last evaluation.
    times: Vec<Option<f64>>,
    found: Vec<Option<f64>>,
    switched: Vec<Switched>,
    gradients: Vec<Gradient>,
}

impl<'a> OnLevels<'a> {
    /// Defining system for solutions like the given one, on its mesh. The setting has one more free parameter than there
    /// are levels; `sizes` are the characteristic sizes of the quantities.
    pub fn new(setting: Setting<'a>, levels: &[Level], sizes: &[f64], like: &Solution) -> OnLevels<'a> {
        let sizes = levels.iter().zip(sizes).map(|(level, size)| level.size(*size).max(f64::MIN_POSITIVE)).collect();
        let none = vec![None; levels.len()];
        OnLevels {
            setting,
            levels: levels.to_vec(),
            sizes,
            like: like.clone(),
            times: none.clone(),
            found: none,
            switched: Vec::new(),
            gradients: Vec::new(),
        }
    }

    /// The numbers of u that belong to the solution, and those of the parameters.
    fn parts<'u>(&self, u: &'u [f64]) -> (&'u [f64], &'u [f64]) {
        u.split_at(u.len() - self.setting.freedom())
    }

    /// The solution with the unknowns `own`, with an interval for each part between switchings, and its parameters.
    fn solution(&mut self, own: &[f64], parameters: &[f64]) -> Option<Solution> {
        let (degree, points, mesh, forcing_periods, gain) = match &self.like {
            Solution::Equilibrium(_) => return Some(Solution::Equilibrium(own.to_vec())),
            Solution::Torus(_) => return None,
            Solution::Cycle(cycle) => {
                (cycle.degree, cycle.points, cycle.mesh.clone(), cycle.forcing_periods, cycle.gain.clone())
            }
        };
        if degree == 0 {
            let n = self.setting.field.dim();
            return Some(Solution::Cycle(crate::problem::map::cycle_of(own, n, &gain)));
        }
        let (size, scheme) = (own.len() - 1, Scheme::at(degree, points));
        let block = (degree + 1) * self.setting.field.dim();
        let (mesh, profile) = match self.setting.field.switch_count() {
            0 => (mesh, own[..size].to_vec()),
            _ => {
                let unknowns: Vec<f64> = own[size..].iter().chain(parameters).copied().collect();
                let flow = PiecewiseFlow::new(&self.setting, scheme, &unknowns, forcing_periods);
                self.switched = flow.intervals(&own[..size], &mesh).ok()?;
                piecewise::cut(&own[..size], &mesh, &self.switched, block)
            }
        };
        let all = self.setting.at(parameters);
        let period = own[size] * self.setting.field.time_unit(&all);
        Some(Solution::Cycle(Cycle { points, period, forcing_periods, mesh, degree, profile, gain }))
    }
}

impl Condition for OnLevels<'_> {
    fn kind(&self) -> Kind {
        Kind::Mark
    }

    fn extra(&self) -> usize {
        0
    }

    fn equations(&self) -> usize {
        self.levels.len()
    }

    fn guess(&self, _point: &Point) -> Vec<f64> {
        Vec::new()
    }

    fn anchor(&mut self) {
        self.times.clone_from(&self.found);
    }

    fn set_mesh(&mut self, mesh: &Mesh) {
        if let Solution::Cycle(cycle) = &mut self.like {
            cycle.mesh = mesh.clone();
        }
    }

    fn evaluate(&mut self, u: &[f64], _extra: &[f64], g: &mut [f64]) -> bool {
        let (own, free) = self.parts(u);
        let (own, free) = (own.to_vec(), free.to_vec());
        let Some(solution) = self.solution(&own, &free) else { return false };
        let parameters = self.setting.at(&free);
        let along = Along { field: self.setting.field, solution: &solution, parameters: &parameters };
        self.gradients.clear();
        for (k, level) in self.levels.iter().enumerate() {
            let Some((found, time)) = along.gradient(level.quantity, self.times[k]) else { return false };
            g[k] = level.off(found.value) / self.sizes[k];
            self.found[k] = time;
            self.gradients.push(found);
        }
        g.iter().all(|value| value.is_finite())
            && self.gradients.iter().all(|found| found.profile.iter().chain(&found.parameters).all(|d| d.is_finite()))
    }

    fn derivative(&mut self, du: &[f64], _extra: &[f64], dg: &mut [f64]) {
        let (own, free) = self.parts(du);
        let parameters = self.setting.spread(free);
        let (profile, period) = match &self.like {
            Solution::Cycle(cycle) if cycle.degree > 0 => {
                let size = own.len() - 1;
                let block = (cycle.degree + 1) * self.setting.field.dim();
                let cut = match self.switched.is_empty() {
                    true => own[..size].to_vec(),
                    false => {
                        let along = piecewise::cut_direction(du, cycle.intervals(), &self.switched, block);
                        along[..along.len() - (du.len() - size)].to_vec()
                    }
                };
                (cut, own[size])
            }
            _ => (own.to_vec(), 0.0),
        };
        for (k, found) in self.gradients.iter().enumerate() {
            let change = dot(&found.profile, &profile) + found.period * period + dot(&found.parameters, &parameters);
            dg[k] = change / self.sizes[k];
        }
    }

    fn held(&self, _extra: &[f64]) -> Vec<Complex64> {
        Vec::new()
    }

    fn distance(&self, _z: Complex64) -> f64 {
        f64::INFINITY
    }
}

/// Monitor of the corner at which another maximum (or minimum) than the held one becomes the outermost one.
pub struct Corner<'a> {
    field: &'a dyn VectorField,
    level: Level,
    channel: usize,
    sign: f64,
    /// Difference of two maxima that counts as none.
    close: f64,
}

impl<'a> Corner<'a> {
    /// Monitors of held extrema. `tolerance` is the relative accuracy of solutions.
    pub fn all(field: &'a dyn VectorField, levels: &[Level], sizes: &[f64], tolerance: f64) -> Vec<Corner<'a>> {
        let mut found = Vec::new();
        for (level, size) in levels.iter().zip(sizes) {
            let own = match level.quantity {
                Quantity::Largest(k) => Some((k, 1.0)),
                Quantity::Smallest(k) => Some((k, -1.0)),
                _ => None,
            };
            if let Some((channel, sign)) = own {
                let close = 1e2 * tolerance * (level.value.abs() + size);
                found.push(Corner { field, level: level.clone(), channel, sign, close });
            }
        }
        found
    }

    /// Height of the outermost extremum above the level.
    fn above(&self, at: &Point) -> f64 {
        let summits = Along::point(self.field, at).summits(self.channel, self.sign);
        summits.first().map_or(f64::NAN, |top| self.sign * (top.value - self.level.value) - self.close)
    }
}

impl Monitor for Corner<'_> {
    fn kind(&self) -> Kind {
        Kind::Mark
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        self.above(at)
    }

    fn confirms(&self, _at: &Point) -> bool {
        true
    }

    fn reads(&self) -> Sight {
        Sight::Everything
    }

    fn jump(&self) -> usize {
        0
    }

    fn ending(&self, at: &Point, _parameter: f64) -> Option<Ending> {
        const NEAR: f64 = 0.5;
        let met = self.above(at).abs() <= NEAR * self.close;
        let Level { name, value, .. } = &self.level;
        met.then(|| {
            Ending::HeldCorner(format!(
                "another hump of the cycle becomes as high as the one held at {name} = {value}\nlikely cause: the cycle \
                 has several humps; beyond this point the outermost value belongs to another one, and the curve has a \
                 corner\nwhat to do: continue from here with a branch that holds the same value, or hold a harmonic, a \
                 mean or an rms value instead"
            ))
        })
    }
}
