//! Normal forms of cycles at folds, period doublings and torus points.
//!
//! **Equations.** In model time, with T the period, A = f_x, B and C the second and third derivatives of f along the
//! cycle, and φ the solvability functional: the variational equation with the boundary condition of v and a right-hand
//! side is solvable if φ of that side is 0:
//!
//! ```text
//!   fold             (1)  v' - A v = f:                       ξ' = … + a ξ²,     a = φ(½ B(v,v) + A v) / φ(v)
//!   period doubling  (2)  v' - A v = 0, v(T) = -v(0):         ξ' = … + c ξ³,     c = φ(⅙ C(v,v,v) + ½ B(v,h) - α A v) / φ(v)
//!                         h' - A h = B(v,v) - 2 α f, h(T) = h(0)
//!   torus            (3)  v' - A v + iθ/T v = 0, v(T) = v(0): z' = … + d z |z|², d = φ(½ C(v,v,v̄) + B(v,h₁₁) + ½ B(v̄,h₂₀) - α A v) / φ(v)
//!                         h₁₁' - A h₁₁ = B(v,v̄) - α f,  h₂₀' - A h₂₀ + 2iθ/T h₂₀ = B(v,v)         both periodic
//! ```
//!
//! with ∫ |v|² dt = 1 over a period in (2) and (3). Negative c and Re d mean that the bifurcating doubled cycle or
//! torus is stable. A forced cycle has no phase freedom: α = 0, and (1) becomes v' - A v = 0, ∫ |v|² dt = 1, a = ½
//! φ(B(v,v)) / φ(v), with v oriented towards larger motion.
//!
//! **Source.** kuznetsov2005; formulated as bordered equations, govaerts2000, §7.
//!
//! **Fails when** the period of free cycles does not change at their fold: (1) has no solution, and the fold has no
//! coefficient. It also fails if a cycle passes a switch of a piecewise field, where the second derivative contains
//! impulses that B and C lack.

use super::normal_form::without_rounding;
use super::on_cycles::OnCycles;
use crate::contract::{Batch, Condition, Parameters};
use crate::diagram::{Cycle, Kind, Mesh, Point, Solution};
use crate::linalg::max_abs;
use crate::linalg::system::System;
use crate::problem::{Setting, mesh};

/// Share of the null vector of a fold below which a change of the period is the error of collocation.
pub(super) const NOTHING: f64 = 1e-8;

/// Coefficient computed on the mesh of the point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Value {
    /// Coefficient.
    pub(super) value: f64,
    /// Sum of the moduli of its terms.
    pub(super) terms: f64,
    /// For a fold of free cycles, the component of the null vector along the period, by which v of (1) is divided;
    /// otherwise 1.
    pub(super) divisor: f64,
}

/// Returns the coefficient of a cycle at a bifurcation point of the given kind, without an error, for uses that need
/// its sign only. `None` for kinds without a coefficient, and if it is undefined or cannot be computed. The setting may
/// have any free parameters.
pub fn coefficient(kind: Kind, setting: Setting, at: &Point) -> Option<f64> {
    let Solution::Cycle(cycle) = &at.solution else { return None };
    if cycle.intervals() == 0 || switches_passed(&setting, at) > 0 {
        return None;
    }
    // Higher derivatives of a field vary more sharply than the cycle, to which the mesh is adapted.
    let found = valued(kind, setting, &on_mesh(at, &mesh::denser(&cycle.mesh))?)?;
    (found.divisor.abs() > NOTHING).then_some(found.value)
}

/// True if a coefficient differs from zero by more than it changes when the critical eigenfunction does by the error of the
/// profile. Where the nonlinear terms vanish by the structure of the model, all that remains of them is such an error.
pub(super) fn is_significant(kind: Kind, setting: Setting, at: &Point) -> bool {
    let Solution::Cycle(cycle) = &at.solution else { return false };
    let Some(denser) = on_mesh(at, &mesh::denser(&cycle.mesh)) else { return false };
    let error = at.trust.discretisation.max(f64::EPSILON.sqrt());
    let [own, other] = [0.0, error].map(|shaken| shaken_value(kind, setting.clone(), &denser, shaken));
    own.zip(other).is_some_and(|(own, other)| own.value.abs() > SAFE * (own.value - other.value).abs())
}

/// Factor of safety between the change of a coefficient under one change of the eigenfunction and under all of that size.
const SAFE: f64 = 4.0;

/// Computes the coefficient on the mesh of the point.
pub(super) fn valued(kind: Kind, setting: Setting, at: &Point) -> Option<Value> {
    shaken_value(kind, setting, at, 0.0)
}

/// Computes the coefficient with a relative error of size `shaken`, without structure, in the critical eigenfunction.
fn shaken_value(kind: Kind, setting: Setting, at: &Point, shaken: f64) -> Option<Value> {
    let Solution::Cycle(cycle) = &at.solution else { return None };
    let unit = setting.field.time_unit(&at.parameters);
    let own = if cycle.forcing_periods > 0 { f64::from(cycle.forcing_periods) } else { cycle.period };
    let (mut condition, u, extra) = evaluated(kind, setting.clone(), at)?;
    let spare = Some(condition.take_system());
    let form = Form { setting, cycle, u: &u, period: own, condition: &condition };
    let (mut v, scalar) = condition.null();
    let free_fold = kind == Kind::Fold && cycle.forcing_periods == 0;
    let length = (cycle.period * condition.square(&v)).sqrt();
    // v_s - T A v = T₁ f, whereas T f is required.
    let size = match kind {
        Kind::Fold if free_fold => scalar / own,
        Kind::Fold if condition.growth(&v) < 0.0 => -length,
        _ => length,
    };
    v.iter_mut().for_each(|x| *x /= size);
    let largest = max_abs(&v);
    v.iter_mut().enumerate().for_each(|(i, x)| *x += shaken * largest * (2.4 * i as f64 + 1.0).cos());
    let (value, terms) = match kind {
        Kind::Fold => form.fold(&v, free_fold),
        Kind::PeriodDoubling => form.doubling(&v, spare)?,
        _ => form.torus(&v, extra[0], spare)?,
    };
    let divisor = if free_fold { size / length } else { 1.0 };
    Some(Value { value: value / unit, terms: terms / unit.abs(), divisor }).filter(|found| found.value.is_finite())
}

/// Transfers the cycle of a point to another mesh.
pub(super) fn on_mesh(at: &Point, mesh: &Mesh) -> Option<Point> {
    let Solution::Cycle(cycle) = &at.solution else { return None };
    let profile = mesh::transferred(&cycle.profile, cycle.dim(), cycle.scheme(), &cycle.mesh, mesh);
    let solution = Solution::Cycle(Cycle { mesh: mesh.clone(), profile, ..cycle.clone() });
    Some(Point { solution, ..at.clone() })
}

/// Number of times that a cycle passes a switch of the field. There the second derivative is an impulse, which no mesh
/// resolves.
pub(crate) fn switches_passed(setting: &Setting, at: &Point) -> usize {
    let (field, Solution::Cycle(cycle)) = (setting.field, &at.solution) else { return 0 };
    let (n, count) = (cycle.dim(), field.switch_count());
    if count == 0 || n == 0 {
        return 0;
    }
    let scheme = cycle.scheme();
    let lanes = cycle.profile.len() / n;
    let states: Vec<f64> = (0..n).flat_map(|c| cycle.profile.iter().skip(c).step_by(n).copied()).collect();
    let places = cycle.mesh.windows(2).flat_map(|pair| scheme.nodes.iter().map(|c| pair[0] + (pair[1] - pair[0]) * c));
    let times: Vec<f64> = places.map(|t| f64::from(cycle.forcing_periods) * t).collect();
    let times = if cycle.forcing_periods > 0 { &times[..] } else { &[] };
    let mut values = vec![0.0; count * lanes];
    field.switches(
        Batch { lanes, states: &states, parameters: Parameters::Shared(&at.parameters), times, signs: &[] },
        &mut values,
    );
    let changes = |own: &[f64]| (0..lanes).filter(|k| (own[*k] > 0.0) != (own[(k + 1) % lanes] > 0.0)).count();
    values.chunks_exact(lanes).map(changes).sum()
}

/// Defining system of the given kind with its null vector, the unknowns, and the extra unknowns.
fn evaluated<'a>(kind: Kind, setting: Setting<'a>, at: &Point) -> Option<(OnCycles<'a>, Vec<f64>, Vec<f64>)> {
    let Solution::Cycle(cycle) = &at.solution else { return None };
    if cycle.intervals() == 0 || !matches!(kind, Kind::Fold | Kind::PeriodDoubling | Kind::Torus) {
        return None;
    }
    let own = if cycle.forcing_periods > 0 { f64::from(cycle.forcing_periods) } else { cycle.period };
    let mut u = cycle.profile.clone();
    u.push(own);
    u.extend(setting.unknowns_of(at));
    let mut condition = OnCycles::new(kind, setting, cycle)?;
    let extra = condition.guess(at);
    let mut g = vec![0.0; 1 + extra.len()];
    // If the operator is singular, any borders give its null vectors, which are better borders for a second evaluation.
    if !Condition::evaluate(&mut condition, &u, &extra, &mut g) {
        return None;
    }
    if extra.is_empty() {
        condition.sharpen()?;
        return Some((condition, u, extra));
    }
    condition.anchor();
    Condition::evaluate(&mut condition, &u, &extra, &mut g).then_some((condition, u, extra))
}

/// Cycle with its critical eigenfunction. All right-hand sides are in normalised time.
struct Form<'a, 'b> {
    setting: Setting<'a>,
    cycle: &'b Cycle,
    u: &'b [f64],
    /// T in the time of the field.
    period: f64,
    condition: &'b OnCycles<'a>,
}

impl Form<'_, '_> {
    /// Returns the periodic solution of y' - A y + α f = r, and α.
    fn periodic(&self, r: &[f64], spare: Option<System>) -> Option<(Vec<f64>, f64)> {
        let mut operator = OnCycles::operator(self.setting.clone(), self.cycle, false, spare)?;
        operator.prepare(self.u, 0.0)?;
        let (y, scalar) = operator.solved(&scaled(r, self.period));
        Some((y, -scalar / self.period))
    }

    fn ratio(&self, above: &[f64], below: &[f64]) -> f64 {
        (self.condition.solvability(above) / self.condition.solvability(below)).re
    }

    /// Sum of the ratios, zero if only the error of collocation remains, and sum of their moduli.
    fn total(&self, terms: &[Vec<f64>], below: &[f64]) -> (f64, f64) {
        const SHARE: f64 = 1e-9;
        let terms: Vec<f64> = terms.iter().map(|term| self.ratio(term, below)).collect();
        let sizes: Vec<f64> = terms.iter().map(|term| term.abs()).collect();
        (without_rounding(&terms, &sizes, SHARE), sizes.iter().sum())
    }

    fn fold(&self, v: &[f64], free: bool) -> (f64, f64) {
        let mut terms = vec![scaled(&self.condition.bent(&[v, v]), 0.5)];
        if free {
            terms.push(self.condition.along(v));
        }
        self.total(&terms, v)
    }

    fn doubling(&self, v: &[f64], spare: Option<System>) -> Option<(f64, f64)> {
        let (h, twice) = self.periodic(&self.condition.bent(&[v, v]), spare)?;
        let terms = [
            scaled(&self.condition.bent(&[v, v, v]), 1.0 / 6.0),
            scaled(&self.condition.bent(&[v, &h]), 0.5),
            scaled(&self.condition.along(v), -0.5 * twice),
        ];
        Some(self.total(&terms, v))
    }

    fn torus(&self, v: &[f64], angle: f64, spare: Option<System>) -> Option<(f64, f64)> {
        let (x, y) = v.split_at(v.len() / 2);
        let b = |p: &[f64], q: &[f64]| self.condition.bent(&[p, q]);
        let c = |p: &[f64], q: &[f64], r: &[f64]| self.condition.bent(&[p, q, r]);
        let (xx, xy, yy) = (b(x, x), b(x, y), b(y, y));
        let (mean, alpha) = self.periodic(&sum(&xx, 1.0, &yy), None)?;
        let mut operator = OnCycles::operator(self.setting.clone(), self.cycle, true, spare)?;
        operator.prepare(self.u, 2.0 * angle)?;
        let second = [sum(&xx, -1.0, &yy), scaled(&xy, 2.0)].concat();
        let (second, _) = operator.solved(&scaled(&second, self.period));
        let (p, q) = second.split_at(second.len() / 2);
        // C(v, v, v̄), B(v, h₁₁), B(v̄, h₂₀), A v, each as real and imaginary part.
        let cubic = [sum(&c(x, x, x), 1.0, &c(x, y, y)), sum(&c(x, x, y), 1.0, &c(y, y, y))].concat();
        let slow = [b(x, &mean), b(y, &mean)].concat();
        let fast = [sum(&b(x, p), 1.0, &b(y, q)), sum(&b(x, q), -1.0, &b(y, p))].concat();
        let along = [self.condition.along(x), self.condition.along(y)].concat();
        Some(self.total(&[scaled(&cubic, 0.5), slow, scaled(&fast, 0.5), scaled(&along, -alpha)], v))
    }
}

fn scaled(v: &[f64], factor: f64) -> Vec<f64> {
    v.iter().map(|x| factor * x).collect()
}

fn sum(a: &[f64], factor: f64, b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + factor * b).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::VectorField;
    use crate::model::{Definition, Forcing, Model, ModelSource, Parameter, State};
    use crate::problem::Axis;
    use num_complex::Complex64;
    use std::f64::consts::TAU;

    fn model(forcing: Option<&str>, definitions: &[(&str, &str)], equations: &[(&str, &str)]) -> Model {
        let defined = |(name, text): &(&str, &str)| Definition::new(name, text);
        Model::compile(ModelSource {
            forcing: forcing.map(|period| Forcing { is_frequency: false, expression: period.into() }),
            parameters: vec![Parameter::new("p", 0.0)],
            definitions: definitions.iter().map(defined).collect(),
            states: equations.iter().map(|(name, _)| State::new(name)).collect(),
            equations: equations.iter().map(defined).collect(),
            ..ModelSource::default()
        })
        .unwrap_or_else(|errors| panic!("{}", errors[0]))
    }

    /// Coefficient on the cycle `state`, a function of normalised time, with the given period.
    fn of(model: &Model, kind: Kind, period: f64, spectrum: &[Complex64], state: impl Fn(f64) -> Vec<f64>) -> f64 {
        found(model, kind, period, spectrum, state).unwrap()
    }

    fn found(
        model: &Model,
        kind: Kind,
        period: f64,
        spectrum: &[Complex64],
        state: impl Fn(f64) -> Vec<f64>,
    ) -> Option<f64> {
        let (degree, mesh) = (4, mesh::uniform(60));
        let scheme = crate::problem::gauss::Scheme::new(degree);
        let places =
            mesh.windows(2).flat_map(|pair| scheme.nodes.iter().map(move |c| pair[0] + c * (pair[1] - pair[0])));
        let profile = places.flat_map(&state).collect();
        let point = Point {
            position: 0,
            parameters: model.defaults(),
            solution: Solution::Cycle(Cycle {
                points: crate::problem::gauss::Points::Gauss,
                period,
                forcing_periods: u32::from(model.forced()),
                mesh: mesh.clone(),
                degree,
                profile,
                gain: Vec::new(),
            }),
            tangent: Vec::new(),
            step: 0.0,
            spectrum: spectrum.to_vec(),
            unstable: 0,
            ranges: Vec::new(),
            averages: Vec::new(),
            trust: Default::default(),
            cost: Default::default(),
        };
        let scales = model.scales();
        let setting =
            Setting { field: model, scales: &scales, parameters: model.defaults(), axes: vec![Axis::new(0, 1.0)] };
        coefficient(kind, setting, &point)
    }

    fn near(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-6 * (1.0 + b.abs()), "{a} {b}");
    }

    fn circle(t: f64, rest: &[f64]) -> Vec<f64> {
        let (sin, cos) = (TAU * t).sin_cos();
        [&[cos, sin], rest].concat()
    }

    /// ρ' = ρ (p - 1 + 2 ρ² - ρ⁴), φ' = 1 + k (ρ² - 1): a fold of cycles at ρ = 1, where (ρ - 1)' = -4 (ρ - 1)² and the
    /// period changes by -2 k (ρ - 1). In a coordinate in which the period changes at unit rate, a is 2 / k. If the
    /// period does not change there is no coefficient.
    #[test]
    fn a_fold_of_cycles() {
        for k in [0.5, -1.25] {
            let grow = "p - 1 + 2*(x^2 + y^2) - (x^2 + y^2)^2";
            let turn = format!("1 + {k}*(x^2 + y^2 - 1)");
            let model =
                model(None, &[("grow", grow), ("turn", &turn)], &[("x", "grow*x - turn*y"), ("y", "turn*x + grow*y")]);
            near(of(&model, Kind::Fold, TAU, &[], |t| circle(t, &[])), 2.0 / k);
        }
        let model = model(
            None,
            &[("grow", "p - 1 + 2*(x^2 + y^2) - (x^2 + y^2)^2")],
            &[("x", "grow*x - y"), ("y", "x + grow*y")],
        );
        assert_eq!(found(&model, Kind::Fold, TAU, &[], |t| circle(t, &[])), None);
    }

    /// r' = p + c (r - 1)² with the angle fixed by the forcing: along v the radius grows, whatever the sign of c. r - 1
    /// = ξ/√T.
    #[test]
    fn a_fold_of_a_forced_cycle() {
        for c in [0.7, -0.4] {
            let model = model(
                Some("2*pi"),
                &[
                    ("r", "sqrt(x^2 + y^2)"),
                    ("grow", &format!("(p + {c}*(r - 1)^2)/r")),
                    ("turn", "1 - (y*cos(t) - x*sin(t))/r"),
                ],
                &[("x", "grow*x - turn*y"), ("y", "turn*x + grow*y")],
            );
            near(of(&model, Kind::Fold, TAU, &[], |t| circle(t, &[])), c / TAU.sqrt());
        }
    }

    /// In a frame that turns by half a revolution per forcing period, a' = p a + c a³ + g a h and b' = -b; h' = -k h +
    /// a² is slaved.
    #[test]
    fn a_period_doubling_of_a_forced_cycle() {
        // With w = p + i q: a² and e^{it/2} a are functions of w with the forcing period.
        let (c, g, k, period) = (-0.7, 0.4, 1.3, 3.0);
        let definitions = [
            ("cos1", "cos(2*pi*t/3)".to_string()),
            ("sin1", "sin(2*pi*t/3)".to_string()),
            ("square", "(u^2 + v^2)/2 + ((u^2 - v^2)*cos1 + 2*u*v*sin1)/2".into()),
            ("along_u", "(u + u*cos1 + v*sin1)/2".into()),
            ("along_v", "(v + u*sin1 - v*cos1)/2".into()),
            ("rate", format!("p + {c}*square + {g}*h")),
        ];
        let definitions: Vec<(&str, &str)> = definitions.iter().map(|(n, t)| (*n, t.as_str())).collect();
        let model = model(
            Some("3"),
            &definitions,
            &[
                ("u", "-pi/3*v + rate*along_u - (u - along_u)"),
                ("v", "pi/3*u + rate*along_v - (v - along_v)"),
                ("h", &format!("-{k}*h + square")),
            ],
        );
        // a = ξ/√T.
        near(of(&model, Kind::PeriodDoubling, period, &[], |_| vec![0.0; 3]), (c + g / k) / period);
    }

    /// Period doubling around an autonomous oscillator, whose radius and speed the doubled motion changes; u + iv is
    /// its position, which gives the angle.
    #[test]
    fn a_period_doubling_of_a_free_cycle() {
        let (c, g, k, m) = (-0.3, 0.5, 0.8, 0.9);
        let definitions = [
            ("size", "x^2 + y^2".to_string()),
            ("cos1", "x/sqrt(size)".into()),
            ("sin1", "y/sqrt(size)".into()),
            ("square", "(u^2 + v^2)/2 + ((u^2 - v^2)*cos1 + 2*u*v*sin1)/2".into()),
            ("along_u", "(u + u*cos1 + v*sin1)/2".into()),
            ("along_v", "(v + u*sin1 - v*cos1)/2".into()),
            ("rate", format!("p + {c}*square + {g}*(size - 1)")),
            ("grow", format!("{k}*(1 - size) + square")),
            ("turn", format!("1 + {m}*square")),
        ];
        let definitions: Vec<(&str, &str)> = definitions.iter().map(|(n, t)| (*n, t.as_str())).collect();
        let model = model(
            None,
            &definitions,
            &[
                ("x", "grow*x - turn*y"),
                ("y", "grow*y + turn*x"),
                ("u", "-turn/2*v + rate*along_u - (u - along_u)"),
                ("v", "turn/2*u + rate*along_v - (v - along_v)"),
            ],
        );
        // ρ² - 1 follows as a²/k.
        near(of(&model, Kind::PeriodDoubling, TAU, &[], |t| circle(t, &[0.0, 0.0])), (c + g / k) / TAU);
    }

    /// Hopf point in a plane coupled to an oscillator whose radius and speed it changes: z' = (p + iω) z + c z |z|² + g
    /// z (ρ² - 1), ρ' = ρ (k (1 - ρ²) + |z|²).
    #[test]
    fn a_torus_point() {
        let (c, g, k, m, omega) = (0.2, 0.6, 0.75, 0.4, 0.31);
        let definitions = [
            ("size", "x^2 + y^2".to_string()),
            ("square", "u^2 + v^2".into()),
            ("rate", format!("p + {c}*square + {g}*(size - 1)")),
            ("grow", format!("{k}*(1 - size) + square")),
            ("turn", format!("1 + {m}*square + 0.3*u*v*x")),
        ];
        let definitions: Vec<(&str, &str)> = definitions.iter().map(|(n, t)| (*n, t.as_str())).collect();
        let model = model(
            None,
            &definitions,
            &[
                ("x", "grow*x - turn*y"),
                ("y", "grow*y + turn*x"),
                ("u", &format!("rate*u - {omega}*v")),
                ("v", &format!("rate*v + {omega}*u")),
            ],
        );
        let pair = Complex64::from_polar(1.0, omega * TAU);
        let spectrum = [Complex64::new(1.0, 0.0), pair, pair.conj(), Complex64::new((-2.0 * k * TAU).exp(), 0.0)];
        // |z|² is 2 |ξ|² / T, and ρ² - 1 follows as |z|²/k.
        near(of(&model, Kind::Torus, TAU, &spectrum, |t| circle(t, &[0.0, 0.0])), (c + g / k) * 2.0 / TAU);
    }
}
