//! Defining systems of grazings and boundary equilibria in two parameters.
//!
//! **Equations.** h is a switch of the field, τ the time at which it has the extremum next to zero:
//!
//! ```text
//!   cycles       (1)  g = h(x(τ), λ),   ∂h/∂τ = 0,      dg = ∇h·δx(τ) + h_λ δλ
//!   equilibria   (2)  g = h(x, λ),                      dg = ∇h·δx + h_λ δλ
//! ```
//!
//! To first order the shift of τ does not matter in (1), because h has an extremum there.
//!
//! **Source.** dibernardo2008, §7.

use super::grazing::{self, Extremum};
use crate::contract::{Batch, Condition, Parameters};
use crate::diagram::{Cycle, Kind, Mesh, Point, Solution};
use crate::linalg::dot;
use crate::problem::Setting;
use crate::problem::gauss::Scheme;
use crate::problem::piecewise::{self, PiecewiseFlow, Switched};
use num_complex::Complex64;

/// Defining system of a grazing of cycles, or of a boundary equilibrium.
pub struct OnSurfaces<'a> {
    setting: Setting<'a>,
    kind: Kind,
    switch: usize,
    /// Scheme, mesh and forcing periods of a cycle; a cycle has its extremum at a time near `time`.
    scheme: Scheme,
    mesh: Mesh,
    forcing_periods: u32,
    time: Option<f64>,
    /// State and parameters at the last evaluation, and the time, in normalised time, of a cycle.
    state: Vec<f64>,
    parameters: Vec<f64>,
    found: Option<f64>,
    switched: Vec<Switched>,
}

impl<'a> OnSurfaces<'a> {
    /// Defining system for the switch that is next to zero at `at`, with the parameters of the setting; `None` if the
    /// field has none, or `kind` does not fit.
    pub fn new(kind: Kind, setting: Setting<'a>, at: &Solution) -> Option<OnSurfaces<'a>> {
        let (field, count) = (setting.field, setting.field.switch_count());
        let least = |switch: usize| -> Option<f64> {
            match at {
                Solution::Equilibrium(x) => {
                    let batch = Batch {
                        lanes: 1,
                        states: x,
                        parameters: Parameters::Shared(&setting.parameters),
                        times: &[],
                        signs: &[],
                    };
                    let mut values = vec![0.0; count];
                    field.switches(batch, &mut values);
                    Some(values[switch].abs())
                }
                Solution::Cycle(cycle) => {
                    let (all, size) = grazing::extrema(field, &setting.parameters, cycle, switch);
                    let nearest = all.iter().map(|e| e.value.abs()).fold(f64::INFINITY, f64::min);
                    (size > 0.0).then_some(nearest / size)
                }
                Solution::Torus(_) => None,
            }
        };
        let fits = match at {
            Solution::Equilibrium(_) => kind == Kind::BoundaryEquilibrium,
            Solution::Cycle(_) => matches!(kind, Kind::Grazing | Kind::ImpactGrazing),
            Solution::Torus(_) => false,
        };
        // The switches of events are the last ones.
        let kinks = count - field.event_count();
        let own = match kind {
            Kind::ImpactGrazing => kinks..count,
            Kind::Grazing => 0..kinks,
            _ => 0..count,
        };
        let switch = own.filter(|_| fits).min_by(|a, b| {
            let value = |switch: &usize| least(*switch).unwrap_or(f64::INFINITY);
            value(a).total_cmp(&value(b))
        })?;
        let (scheme, mesh, forcing_periods) = match at {
            Solution::Equilibrium(_) | Solution::Torus(_) => (Scheme::of(1), Mesh::from([]), 0),
            Solution::Cycle(cycle) => (cycle.scheme(), cycle.mesh.clone(), cycle.forcing_periods),
        };
        Some(OnSurfaces {
            setting,
            kind,
            switch,
            scheme: scheme.clone(),
            mesh,
            forcing_periods,
            time: None,
            state: Vec::new(),
            parameters: Vec::new(),
            found: None,
            switched: Vec::new(),
        })
    }

    fn n(&self) -> usize {
        self.setting.field.dim()
    }

    fn block(&self) -> usize {
        (self.scheme.degree + 1) * self.n()
    }

    fn profile_size(&self) -> usize {
        self.mesh.len().saturating_sub(1) * self.block()
    }

    /// A profile on the mesh with an interval for each part between switchings.
    fn cycle(&self, mesh: Mesh, profile: Vec<f64>) -> Cycle {
        Cycle {
            points: self.scheme.points,
            period: 1.0,
            forcing_periods: self.forcing_periods,
            mesh,
            degree: self.scheme.degree,
            profile,
            gain: Vec::new(),
        }
    }

    /// The switch with its derivatives in the states and the unknowns λ, at the last evaluation.
    fn derivatives(&self) -> (f64, Vec<f64>, Vec<f64>) {
        let time = (self.forcing_periods > 0).then_some(f64::from(self.forcing_periods) * self.found.unwrap_or(0.0));
        let parameters = Parameters::Shared(&self.parameters);
        let batch = Batch { lanes: 1, states: &self.state, parameters, times: time.as_slice(), signs: &[] };
        let [h, hx, hp, _] = self.setting.linearise_switches(batch);
        let (n, k, own) = (self.n(), self.setting.freedom(), self.switch);
        (h[own], hx[own * n..(own + 1) * n].to_vec(), hp[own * k..(own + 1) * k].to_vec())
    }
}

impl Condition for OnSurfaces<'_> {
    fn kind(&self) -> Kind {
        self.kind
    }

    fn extra(&self) -> usize {
        0
    }

    fn guess(&self, _point: &Point) -> Vec<f64> {
        Vec::new()
    }

    fn anchor(&mut self) {
        self.time = self.found.or(self.time);
    }

    fn set_mesh(&mut self, mesh: &Mesh) {
        self.mesh = mesh.clone();
    }

    fn evaluate(&mut self, u: &[f64], _extra: &[f64], g: &mut [f64]) -> bool {
        if self.kind == Kind::BoundaryEquilibrium {
            let n = self.n();
            (self.state, self.parameters) = (u[..n].to_vec(), self.setting.at(&u[n..]));
        } else {
            let size = self.profile_size();
            self.parameters = self.setting.at(&u[size + 1..]);
            let flow = PiecewiseFlow::new(&self.setting, &self.scheme, &u[size..], self.forcing_periods);
            let Ok(switched) = flow.intervals(&u[..size], &self.mesh) else { return false };
            self.switched = switched;
            let (mesh, profile) = piecewise::cut(&u[..size], &self.mesh, &self.switched, self.block());
            let cycle = self.cycle(mesh, profile);
            let (extrema, _) = grazing::extrema(self.setting.field, &self.parameters, &cycle, self.switch);
            let apart = |e: &Extremum| match self.time {
                None => e.value.abs(),
                Some(time) => (e.time - time - (e.time - time).round()).abs(),
            };
            let Some(nearest) = extrema.iter().min_by(|a, b| apart(a).total_cmp(&apart(b))) else { return false };
            self.found = Some(nearest.time);
            self.state = cycle.state(nearest.time);
        }
        let (value, ..) = self.derivatives();
        g[0] = value;
        value.is_finite()
    }

    fn derivative(&mut self, du: &[f64], _extra: &[f64], dg: &mut [f64]) {
        let (_, by_state, by_parameter) = self.derivatives();
        let (moved, free) = match self.kind {
            Kind::BoundaryEquilibrium => (du[..self.n()].to_vec(), &du[self.n()..]),
            _ => {
                let (size, intervals) = (self.profile_size(), self.mesh.len() - 1);
                let along = piecewise::cut_direction(du, intervals, &self.switched, self.block());
                let (mesh, _) = piecewise::cut(&du[..size], &self.mesh, &self.switched, self.block());
                let profile = along[..along.len() - (du.len() - size)].to_vec();
                (self.cycle(mesh, profile).state(self.found.unwrap_or(0.0)), &du[size + 1..])
            }
        };
        dg[0] = dot(&by_state, &moved) + dot(&by_parameter, free);
    }

    fn held(&self, _extra: &[f64]) -> Vec<Complex64> {
        Vec::new()
    }

    fn distance(&self, _z: Complex64) -> f64 {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Definition, Model, ModelSource, Parameter, State};
    use crate::problem::{Axis, mesh};
    use std::f64::consts::TAU;

    /// x'' = -x - 5 max(x - d, 0) has the free solution x = A cos t, which touches d where A = d.
    fn model() -> Model {
        Model::compile(ModelSource {
            name: "stop".into(),
            parameters: vec![Parameter::new("d", 1.0), Parameter::new("k", 5.0)],
            states: vec![State::new("x"), State::new("v")],
            equations: vec![Definition::new("x", "v"), Definition::new("v", "-x - k*max(x - d, 0)")],
            ..ModelSource::default()
        })
        .unwrap()
    }

    #[test]
    fn the_derivative_of_a_grazing_is_that_of_the_extremum() {
        let (model, scales) = (model(), [1.0, 1.0]);
        let axes = vec![Axis::new(1, 1.0), Axis::new(0, 1.0)];
        let setting = Setting { field: &model, scales: &scales, parameters: vec![1.0, 5.0], axes };
        let (scheme, mesh) = (Scheme::new(4), mesh::uniform(20));
        let profile = |size: f64| -> Vec<f64> {
            let times = mesh.windows(2).flat_map(|p| scheme.nodes.iter().map(move |c| p[0] + c * (p[1] - p[0])));
            times.flat_map(|t| [size * (TAU * t + 0.3).cos(), -size * (TAU * t + 0.3).sin()]).collect()
        };
        let cycle = Cycle {
            points: crate::problem::gauss::Points::Gauss,
            period: TAU,
            forcing_periods: 0,
            mesh: mesh.clone(),
            degree: 4,
            profile: profile(1.001),
            gain: Vec::new(),
        };
        let mut own = OnSurfaces::new(Kind::Grazing, setting, &Solution::Cycle(cycle)).unwrap();
        let at = |size: f64, d: f64| [&profile(size)[..], &[TAU, 5.0, d]].concat();
        let mut g = [0.0];
        let mut value = |own: &mut OnSurfaces, u: &[f64]| {
            assert!(own.evaluate(u, &[], &mut g));
            g[0]
        };
        for size in [0.999, 1.001] {
            let u = at(size, 1.0);
            let there = value(&mut own, &u);
            assert!((there - (size - 1.0)).abs() < 1e-4, "{size}: {there}");
            let du: Vec<f64> = at(1.0, 0.25).iter().zip(&at(0.0, 0.0)).map(|(a, b)| a - b).collect();
            let mut dg = [0.0];
            own.derivative(&du, &[], &mut dg);
            let step = 1e-5;
            let moved = |by: f64| -> Vec<f64> { u.iter().zip(&du).map(|(u, d)| u + by * d).collect() };
            let difference = (value(&mut own, &moved(step)) - value(&mut own, &moved(-step))) / (2.0 * step);
            assert!((dg[0] - difference).abs() < 1e-5, "{size}: {} {difference}", dg[0]);
        }
    }
}
