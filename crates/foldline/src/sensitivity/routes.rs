//! The two computations of every derivative, on two meshes.

use super::extremes::{self, Extreme, Moved};
use super::{Derivative, Measured, Row, Sensitivities};
use crate::continuation::Settings;
use crate::continuation::corrector::parameter_row;
use crate::contract::{Examination, ZeroProblem};
use crate::diagram::{Branch, Kind, Mesh, Point, Solution};
use crate::explore::plan::Plan;
use crate::explore::{System, axis_of, growth};
use crate::problem::held::Held;
use crate::problem::{Axis, Setting};
use crate::special::sliding::meets_jump;
use std::f64::consts::TAU;

/// Index of a parameter that affects nothing.
const DUMMY: usize = usize::MAX;
/// Share of the plan's tolerance for the solutions, as on curves.
const SHARPER: f64 = 0.2;
/// Computations without a mesh, from different starts, and the multiple of their largest difference that bounds the error:
/// three samples of a rounding error exceed a quarter of its bound nearly always.
const STARTS: usize = 3;
const SAFE: f64 = 4.0;
/// Rounding errors that both computations may share, in units of the machine precision times the size of the changes: that
/// of some hundred operations.
const SHARED: f64 = 256.0;
/// Change of a parameter, relative to its scale, at which a branch point must still exist.
const CHANGE: f64 = 1e-2;

/// Solutions of one kind through a point.
pub(super) struct Posed<'a> {
    pub system: &'a System<'a>,
    pub kind: Option<Kind>,
    pub point: &'a Point,
    /// The parameter of the branch.
    pub axis: Axis,
    /// Index of the parameter that the branch reports.
    pub free: usize,
    /// Parameters with respect to which derivatives are taken.
    pub parameters: Vec<usize>,
    pub degree: usize,
    pub settings: Settings,
}

/// A solution, converged to rounding, on its mesh.
pub(super) struct Base {
    pub u: Vec<f64>,
    pub mesh: Mesh,
    pub parameters: Vec<f64>,
}

/// Numbers at a solution and their changes.
pub(super) struct Route {
    pub values: Vec<(Measured, f64)>,
    /// `[parameters][values]` per unit of each parameter.
    pub slopes: Vec<Vec<Result<f64, String>>>,
    /// `[parameters][unknowns]` changes of the unknowns per scale of each parameter.
    pub directions: Vec<Vec<f64>>,
    /// `[parameters]` length of the direction, and the share of the unfolding in it.
    lengths: Vec<f64>,
    departures: Vec<f64>,
    /// `[parameters]` the solution with its change, per unit of each parameter, and the extremes, which are the last
    /// numbers.
    moved: Vec<Moved>,
    extremes: Vec<Extreme>,
}

/// A bifurcation, or solutions without one.
pub(super) enum Problem<'a> {
    Held(Box<Held<'a>>),
    Free(Box<dyn ZeroProblem + 'a>),
}

impl<'a> Problem<'a> {
    pub fn zero(&mut self) -> &mut (dyn ZeroProblem + 'a) {
        match self {
            Problem::Held(held) => &mut **held,
            Problem::Free(free) => &mut **free,
        }
    }

    pub fn extras(&self) -> usize {
        match self {
            Problem::Held(held) => held.extras(),
            Problem::Free(_) => 0,
        }
    }
}

impl<'a> Posed<'a> {
    pub fn new(
        system: &'a System<'a>,
        branch: &Branch,
        kind: Option<Kind>,
        point: &'a Point,
        plan: &Plan,
    ) -> Posed<'a> {
        let axis = axis_of(system, branch);
        let all = 0..system.field.parameter_count();
        let excluded = |k: &usize| kind.is_some() && (*k == axis.index || *k == branch.free);
        let settings = growth::settings(system, SHARPER * plan.tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
        Posed {
            system,
            kind,
            point,
            free: branch.free,
            parameters: all.filter(|k| !excluded(k)).collect(),
            axis,
            degree: plan.degree,
            settings: Settings { stability: false, ..settings },
        }
    }

    /// The problem with these free parameters, through the point with parameter values `at`.
    fn problem(&self, axes: Vec<Axis>, at: &[f64]) -> Option<Problem<'a>> {
        let point = Point { parameters: at.to_vec(), ..self.point.clone() };
        match self.kind {
            Some(kind) => {
                growth::held(self.system, kind, axes, self.degree, &point).map(|held| Problem::Held(Box::new(held)))
            }
            None => Some(Problem::Free(growth::surface(self.system, axes, self.degree, &point, None, false))),
        }
    }

    /// The problem whose only solution, up to a dummy, is the special point at the other parameters in `at`; without a
    /// kind, the solution at all of them.
    pub fn isolated(&self, at: &[f64]) -> Result<Problem<'a>, String> {
        let axes = match self.kind {
            Some(_) => vec![self.axis.clone(), Axis::new(DUMMY, 1.0)],
            None => vec![Axis { ties: Vec::new(), ..self.axis.clone() }],
        };
        self.problem(axes, at).ok_or_else(|| "points of this kind have no defining system".to_string())
    }

    /// Solves for the point to rounding.
    pub fn base(&self) -> Result<Base, String> {
        let mut problem = self.isolated(&self.point.parameters)?;
        let problem = problem.zero();
        let found = growth::polished(problem, &self.settings, self.point).map_err(|why| why.to_string())?;
        let mut u = found.u;
        sharpen(problem, &mut u)?;
        Ok(Base { parameters: parameters_at(problem, &u), u, mesh: problem.mesh() })
    }

    /// Derivatives with their errors, from two computations.
    pub fn sensitivities(&self, base: &Base) -> Result<Sensitivities, String> {
        let first = self.route(base)?;
        let mut others = Vec::new();
        for start in 0..if base.mesh.is_empty() || self.system.field.iterated() { STARTS } else { 1 } {
            others.push(self.route(&self.again(base, start)?)?);
        }
        let best = others.last().unwrap_or(&first);
        let lasts = self.lasting(base, best);
        let jumps = self.kind == Some(Kind::Fold) && self.jumps(base)?;
        let rows = best.values.iter().enumerate().map(|(r, &(of, value))| {
            let by = (0..self.parameters.len()).map(|i| {
                lasts[i].clone()?;
                if jumps && matches!(of, Measured::Smallest(_) | Measured::Largest(_)) {
                    return Err("not known at a fold of cycles along which the right-hand side jumps".into());
                }
                let own = best.slopes[i][r].clone()?;
                let mut apart: f64 = 0.0;
                for route in others.iter().chain([&first]) {
                    let other = route.slopes[i].get(r).cloned().unwrap_or_else(|| Err("not confirmed".into()))?;
                    apart = apart.max((own - other).abs());
                }
                let extreme = (r + best.extremes.len()).checked_sub(best.values.len());
                if let Some(extreme) = extreme.and_then(|k| best.extremes.get(k)) {
                    let off = extremes::difference(self.system.field, extreme, &best.moved[i], &first.moved[i]);
                    apart = apart.max(off);
                }
                let factor = if others.len() > 1 { SAFE } else { 1.0 };
                let unit = self.system.unit(self.parameters[i]);
                let size = self.size(of, value, own * unit) * best.lengths[i] / unit;
                Ok(Derivative { value: own, error: factor * apart + SHARED * f64::EPSILON * size })
            });
            Row { of, value, by: by.collect() }
        });
        Ok(Sensitivities { rows: rows.collect(), parameters: self.parameters.clone() })
    }

    /// True if the right-hand side jumps along a cycle: along the curve of folds, the second derivatives of the flow in the
    /// direction of the null vector would then include the change of its saltation matrices.
    fn jumps(&self, base: &Base) -> Result<bool, String> {
        let mut problem = self.isolated(&base.parameters)?;
        let problem = problem.zero();
        problem.set_mesh(&base.mesh);
        problem.anchor(&base.u);
        let at = problem.point(&base.u, &vec![0.0; base.u.len()], Examination::default());
        Ok(match &at.solution {
            Solution::Cycle(cycle) => meets_jump(self.system.field, &at.parameters, cycle),
            Solution::Equilibrium(_) | Solution::Torus(_) => false,
        })
    }

    /// Characteristic size of a number, to which rounding errors are relative, given its value and its change with the
    /// scale of a parameter.
    fn size(&self, of: Measured, value: f64, change: f64) -> f64 {
        let scale = |k: usize| self.system.scales.get(k).copied().unwrap_or(0.0);
        let own = match of {
            Measured::Parameter => self.system.unit(self.free),
            Measured::Period => 0.0,
            Measured::Angle => 1.0,
            Measured::Smallest(k) | Measured::Largest(k) => scale(k),
        };
        own + value.abs().max(change.abs())
    }

    /// Solves for the solution again on a denser mesh, or without one from another start.
    fn again(&self, base: &Base, start: usize) -> Result<Base, String> {
        let mut problem = self.isolated(&base.parameters)?;
        let problem = problem.zero();
        problem.set_mesh(&base.mesh);
        problem.anchor(&base.u);
        let mut u = base.u.clone();
        match problem.denser_mesh() {
            Some(denser) => {
                u = problem.carry(&u, &base.mesh, &denser);
                problem.set_mesh(&denser);
                problem.anchor(&u);
            }
            None => {
                let last = u.len() - 1;
                let noise = |k: usize| 1e-6 * (k as f64 * 1.7 + start as f64 * 2.3).sin();
                (0..last).for_each(|k| u[k] += noise(k) * u[k].abs());
            }
        }
        sharpen(problem, &mut u).map_err(|why| format!("not confirmed on a denser mesh: {why}"))?;
        Ok(Base { parameters: parameters_at(problem, &u), u, mesh: problem.mesh() })
    }

    fn axes(&self) -> Vec<Axis> {
        let own = self.kind.map(|_| self.axis.clone());
        let of = |index: &usize| match *index == self.axis.index {
            true => self.axis.clone(),
            false => Axis::new(*index, self.system.unit(*index)),
        };
        own.into_iter().chain(self.parameters.iter().map(of)).collect()
    }

    /// Numbers at a solution and their changes with every parameter.
    pub fn route(&self, base: &Base) -> Result<Route, String> {
        let (axes, count) = (self.axes(), self.parameters.len());
        let mut problem =
            self.problem(axes.clone(), &base.parameters).ok_or("points of this kind have no defining system")?;
        let extras = problem.extras();
        let last = base.u.len() - 1;
        let mut u = base.u[..last].to_vec();
        u.extend(self.parameters.iter().map(|k| base.parameters[*k] / self.system.unit(*k)));
        problem.zero().set_mesh(&base.mesh);
        problem.zero().anchor(&u);
        let singular = |_| "the equations are singular there".to_string();
        let directions = match &mut problem {
            Problem::Held(held) => held.directions(&u, count).map_err(singular)?,
            Problem::Free(free) => fixed(&mut **free, &u, count).map_err(singular)?,
        };
        let problem = problem.zero();
        let setting = Setting {
            field: self.system.field,
            scales: &self.system.scales,
            parameters: base.parameters.clone(),
            axes,
        };
        let mut route = Route {
            values: Vec::new(),
            slopes: Vec::new(),
            directions: Vec::new(),
            lengths: Vec::new(),
            departures: Vec::new(),
            moved: Vec::new(),
            extremes: Vec::new(),
        };
        let mut found: Option<Vec<Extreme>> = None;
        for (index, direction) in self.parameters.iter().zip(directions) {
            let at = problem.point(&u, &direction, Examination::default());
            let extremes = found.get_or_insert_with(|| extremes::extremes(self.system.field, &at));
            let change = setting.spread(&direction[direction.len() - setting.freedom()..]);
            let rows = self.rows(&at, extremes, [&u[..extras], &direction[..extras]], &change);
            let unit = self.system.unit(*index);
            route.values = rows.iter().map(|(of, value, _)| (*of, *value)).collect();
            route.slopes.push(rows.into_iter().map(|(_, _, slope)| slope.map(|slope| slope / unit)).collect());
            let along = at.tangent[extras..extras + size_of(&at)].iter().map(|x| x / unit).collect();
            route.moved.push(Moved { along, change: change.iter().map(|x| x / unit).collect(), at });
            let length = problem.dot(&direction, &direction).sqrt();
            route.lengths.push(length);
            route.departures.push(problem.departure(&direction) / length);
            route.directions.push(direction);
        }
        route.extremes = found.unwrap_or_default();
        Ok(route)
    }

    /// Every number, with its change along a direction (the tangent of `at`) in which the parameters change by `change`.
    /// `extra` are the extra unknowns of the bifurcation and their changes.
    fn rows(
        &self,
        at: &Point,
        extremes: &[Extreme],
        extra: [&[f64]; 2],
        change: &[f64],
    ) -> Vec<(Measured, f64, Result<f64, String>)> {
        let field = self.system.field;
        let mut rows = Vec::new();
        if self.kind.is_some() {
            rows.push((Measured::Parameter, at.parameters[self.free], Ok(change[self.free])));
        }
        let along = &at.tangent[extra[0].len()..];
        let states = size_of(at);
        match (&at.solution, extra) {
            (Solution::Equilibrium(_), [[kappa], [moved]]) if self.kind == Some(Kind::Hopf) => {
                let slope = match *kappa > 0.0 {
                    true => Ok(-0.5 * TAU * moved / kappa.powf(1.5)),
                    false => Err("the eigenvalues are real: a neutral saddle".to_string()),
                };
                rows.push((Measured::Period, TAU / kappa.sqrt(), slope));
            }
            (Solution::Cycle(cycle), _) if !field.iterated() => {
                let slope = match cycle.forcing_periods {
                    0 => along[states],
                    q => f64::from(q) * field.time_unit_along(&at.parameters, change),
                };
                let slope =
                    if slope.is_finite() { Ok(slope) } else { Err("the model gives no derivative of it".into()) };
                rows.push((Measured::Period, cycle.period, slope));
            }
            _ => {}
        }
        if let (Some(Kind::Torus), [[angle], [moved]]) = (self.kind, extra) {
            rows.push((Measured::Angle, *angle, Ok(*moved)));
        }
        for extreme in extremes {
            let of = match extreme.largest {
                true => Measured::Largest(extreme.channel),
                false => Measured::Smallest(extreme.channel),
            };
            let slope = extremes::slope(field, at, extreme, &along[..states], change);
            rows.push((of, extreme.value, slope.map_err(Into::into)));
        }
        rows
    }

    /// Every number at a solution.
    pub fn values(&self, problem: &dyn ZeroProblem, u: &[f64], extras: usize) -> Vec<(Measured, f64)> {
        let none = vec![0.0; u.len()];
        let at = problem.point(u, &none, Examination::default());
        let extremes = extremes::extremes(self.system.field, &at);
        let change = vec![0.0; self.system.field.parameter_count()];
        let rows = self.rows(&at, &extremes, [&u[..extras], &none[..extras]], &change);
        rows.into_iter().map(|(of, value, _)| (of, value)).collect()
    }

    /// For every parameter, the reason why the point does not persist if it changes.
    fn lasting(&self, base: &Base, route: &Route) -> Vec<Result<(), String>> {
        let each = self.parameters.iter().enumerate().map(|(i, index)| {
            if self.kind != Some(Kind::BranchPoint) {
                return Ok(());
            }
            let crossing = "the branches no longer cross if this parameter changes".to_string();
            if route.departures[i] > self.settings.tolerance {
                return Err(crossing);
            }
            let mut moved = base.parameters.clone();
            moved[*index] += CHANGE * self.system.unit(*index);
            let (mut problem, mut u) = (self.isolated(&moved)?, base.u.clone());
            problem.zero().set_mesh(&base.mesh);
            problem.zero().anchor(&base.u);
            let solved = sharpen(problem.zero(), &mut u);
            match solved {
                Ok(()) if problem.zero().departure(&u) > self.settings.newton_tolerance() => Err(crossing),
                _ => Ok(()),
            }
        });
        each.collect()
    }
}

/// Number of values of the state, or of the profile.
fn size_of(at: &Point) -> usize {
    match &at.solution {
        Solution::Equilibrium(x) => x.len(),
        Solution::Cycle(cycle) => cycle.profile.len(),
        Solution::Torus(torus) => torus.profile.len(),
    }
}

/// Changes of the unknowns with each of the last `count` of them, all of which are free parameters.
fn fixed(problem: &mut dyn ZeroProblem, u: &[f64], count: usize) -> Result<Vec<Vec<f64>>, crate::contract::Singular> {
    let size = u.len();
    let unit = |i: usize| {
        let mut row = vec![0.0; size];
        row[size - count + i] = 1.0;
        row
    };
    let rows: Vec<f64> = (0..count).flat_map(unit).collect();
    problem.factorise(u, &rows)?;
    let solved = |i: usize| {
        let mut direction = vec![0.0; size];
        problem.solve(&unit(i), &mut direction);
        direction
    };
    let found: Vec<Vec<f64>> = (0..count).map(solved).collect();
    if found.iter().flatten().all(|x| x.is_finite()) { Ok(found) } else { Err(crate::contract::Singular) }
}

/// All parameters at unknowns of a problem.
pub(super) fn parameters_at(problem: &dyn ZeroProblem, u: &[f64]) -> Vec<f64> {
    problem.point(u, &vec![0.0; u.len()], Examination::default()).parameters
}

/// Newton's method with the last unknown fixed, until rounding stops it.
pub(super) fn sharpen(problem: &mut dyn ZeroProblem, u: &mut [f64]) -> Result<(), String> {
    /// Updates above this are not rounding.
    const CONVERGED: f64 = 1e-7;
    const ROUNDS: usize = 12;
    let size = u.len();
    let (row, mut r, mut du) = (parameter_row(size), vec![0.0; size], vec![0.0; size]);
    let mut before = f64::INFINITY;
    for _ in 0..ROUNDS {
        if !problem.residual(u, &mut r) {
            return Err(problem.obstacle(u).unwrap_or("the vector field is not finite there").into());
        }
        r[size - 1] = 0.0;
        problem.factorise(u, &row).map_err(|_| "the equations are singular there")?;
        problem.solve(&r, &mut du);
        let length = problem.relative_size(&du, u);
        if !length.is_finite() || length > 10.0 {
            break;
        }
        if before < CONVERGED && length > 0.3 * before {
            return Ok(());
        }
        u.iter_mut().zip(&du).for_each(|(u, d)| *u -= d);
        before = length;
        if length < 4.0 * f64::EPSILON {
            return Ok(());
        }
    }
    if before < CONVERGED { Ok(()) } else { Err("Newton's method did not converge".into()) }
}
