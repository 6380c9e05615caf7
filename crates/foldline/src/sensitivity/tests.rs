//! Derivatives against closed forms.

use super::{Measured, Sensitivities, Spread, of_point, of_special, uncertainty};
use crate::contract::Unobserved;
use crate::diagram::{Diagram, Kind};
use crate::explore::{BranchPlan, Plan, SeedPlan, SeedSource, Start, Switching, System, run};
use crate::model::{Definition, Forcing, Model, ModelSource, Output, Parameter, State};

pub(super) fn model(parameters: &[(&str, f64)], equations: &[(&str, &str)], outputs: &[(&str, &str)]) -> ModelSource {
    ModelSource {
        name: "test".into(),
        parameters: parameters.iter().map(|(name, value)| Parameter::new(name, *value)).collect(),
        states: equations.iter().map(|(name, _)| State::new(name)).collect(),
        equations: equations.iter().map(|(name, text)| Definition::new(name, text)).collect(),
        outputs: outputs.iter().map(|(name, text)| Output::new(name, text)).collect(),
        ..ModelSource::default()
    }
}

pub(super) struct Followed {
    pub model: Model,
    pub plan: Plan,
    pub diagram: Diagram,
}

/// Follows a branch in the first parameter from the solution to which a state leads.
pub(super) fn followed(source: ModelSource, state: &[f64], range: [f64; 2], kinds: &[Kind]) -> Followed {
    let model = Model::compile(source).unwrap_or_else(|why| panic!("{why:?}"));
    let parameters = model.defaults();
    let source = SeedSource::State(state.to_vec());
    let switching = Switching { depth: kinds.iter().map(|kind| (*kind, 1)).collect(), ..Switching::default() };
    let plan = Plan {
        seeds: vec![SeedPlan { name: "seed".into(), source, parameters: parameters.clone(), samples: 1, random: 1 }],
        branches: vec![BranchPlan {
            name: "main".into(),
            start: Start::Seed(0),
            free: 0,
            range,
            until: None,
            switching,
            marks: Vec::new(),
            max_points: 400,
            holds: Default::default(),
        }],
        ..Plan::empty(1e-7, 4)
    };
    let diagram = run(&System::of_plan(&model, &plan), &plan, 1, Diagram::default(), &Unobserved);
    Followed { model, plan, diagram }
}

impl Followed {
    /// The derivatives of the special point of that kind next to a value of the first parameter.
    fn at(&self, kind: Kind, near: f64) -> (Result<Sensitivities, String>, f64) {
        let all = self.diagram.branches.iter().flat_map(|branch| branch.special.iter().map(move |own| (branch, own)));
        let found = all
            .filter(|(_, special)| special.kind == kind)
            .min_by(|a, b| {
                let off = |own: &crate::diagram::SpecialPoint| (own.point.parameters[0] - near).abs();
                off(a.1).total_cmp(&off(b.1))
            })
            .unwrap_or_else(|| {
                panic!(
                    "no {kind} in {:?}",
                    self.diagram
                        .branches
                        .iter()
                        .map(|b| b.special.iter().map(|s| (s.kind, s.point.parameters[0])).collect::<Vec<_>>())
                        .collect::<Vec<_>>()
                )
            });
        let system = System::of_plan(&self.model, &self.plan).in_units_of(&self.diagram);
        (of_special(&system, found.0, found.1, &self.plan), found.1.point.parameters[0])
    }
}

/// Checks a derivative against its exact value, its error against the true one, and that the error is small.
fn check(found: &Sensitivities, of: Measured, parameter: usize, exact: f64) {
    let own = found.of(of, parameter).unwrap_or_else(|| panic!("{of:?} by {parameter}: {found:?}"));
    let off = (own.value - exact).abs();
    assert!(off <= own.error + 1e-15, "{of:?} by {parameter}: {} ± {:.1e}, exactly {exact}", own.value, own.error);
    assert!(own.error <= 1e-6 * (1.0 + exact.abs()), "{of:?} by {parameter}: error {:.1e}", own.error);
}

#[test]
fn folds_of_equilibria_move_as_their_closed_form_says() {
    // a + b x - c x³ folds where a = ∓(2/√27) b^{3/2} c^{-1/2}, x = ±√(b/3c).
    let (b, c): (f64, f64) = (1.3, 0.7);
    let own = followed(
        model(&[("a", -2.0), ("b", b), ("c", c), ("unused", 0.0)], &[("x", "a + b*x - c*x^3")], &[("y", "b*x^2")]),
        &[-2.0],
        [-2.0, 2.0],
        &[],
    );
    let (found, _) = own.at(Kind::Fold, 1.0);
    let (found, x) = (found.unwrap(), -(b / (3.0 * c)).sqrt());
    assert_eq!(found.parameters, [1, 2, 3]);
    check(&found, Measured::Parameter, 1, -x);
    check(&found, Measured::Parameter, 2, x.powi(3));
    check(&found, Measured::Parameter, 3, 0.0);
    check(&found, Measured::Largest(0), 1, x / (2.0 * b));
    check(&found, Measured::Largest(0), 2, -x / (2.0 * c));
    check(&found, Measured::Largest(1), 1, x * x + 2.0 * b * x * x / (2.0 * b));
}

#[test]
fn hopf_points_move_as_their_closed_form_says() {
    // Brusselator: b = 1 + a², ω = a.
    let own = followed(
        model(&[("b", 1.5), ("a", 1.2)], &[("x", "a - (b + 1)*x + x^2*y"), ("y", "b*x - x^2*y")], &[]),
        &[1.2, 1.25],
        [1.0, 4.0],
        &[],
    );
    let (found, _) = own.at(Kind::Hopf, 2.44);
    let (found, a) = (found.unwrap(), 1.2f64);
    check(&found, Measured::Parameter, 1, 2.0 * a);
    check(&found, Measured::Period, 1, -std::f64::consts::TAU / (a * a));
    check(&found, Measured::Largest(0), 1, 1.0);
    // y = b / a = 1/a + a.
    check(&found, Measured::Largest(1), 1, 1.0 - 1.0 / (a * a));
}

/// r' = r (m + s r² - r⁴), turning with w: cycles fold where m = -s²/4, r² = s/2.
fn bautin() -> ModelSource {
    let growth = "(m + s*(x^2 + y^2) - (x^2 + y^2)^2)";
    let (x, y) = (format!("x*{growth} - w*y"), format!("y*{growth} + w*x"));
    let equations = [("x", x.as_str()), ("y", y.as_str())];
    model(&[("m", 0.3), ("s", 1.6), ("w", 0.8)], &equations, &[("r", "sqrt(x^2 + y^2)"), ("d", "x - 2*s")])
}

#[test]
fn folds_of_cycles_move_as_their_closed_form_says() {
    let own = followed(bautin(), &[1.3, 0.0], [-1.0, 0.4], &[]);
    let (found, _) = own.at(Kind::Fold, -0.64);
    let (found, s, w) = (found.unwrap(), 1.6f64, 0.8f64);
    let r = (s / 2.0).sqrt();
    check(&found, Measured::Parameter, 1, -s / 2.0);
    check(&found, Measured::Parameter, 2, 0.0);
    check(&found, Measured::Period, 2, -std::f64::consts::TAU / (w * w));
    check(&found, Measured::Period, 1, 0.0);
    for (of, exact) in [
        (Measured::Largest(0), 0.25 / r),
        (Measured::Smallest(1), -0.25 / r),
        (Measured::Largest(2), 0.25 / r),
        (Measured::Smallest(2), 0.25 / r),
        (Measured::Largest(3), 0.25 / r - 2.0),
    ] {
        check(&found, of, 1, exact);
    }
}

#[test]
fn cycles_change_as_their_closed_form_says() {
    let own = followed(bautin(), &[1.3, 0.0], [-0.5, 0.4], &[]);
    let branch = &own.diagram.branches[0];
    let system = System::of_plan(&own.model, &own.plan).in_units_of(&own.diagram);
    let point = branch.points.last().unwrap();
    let found = of_point(&system, branch, point, &own.plan).unwrap();
    // r² = s/2 + √(s²/4 + m)
    let ([m, s, w], root) = ([point.parameters[0], 1.6f64, 0.8f64], 0.0);
    let root = root + (s * s / 4.0 + m).sqrt();
    let r = (s / 2.0 + root).sqrt();
    check(&found, Measured::Largest(0), 0, 0.25 / (r * root));
    check(&found, Measured::Largest(0), 1, (0.5 + s / (4.0 * root)) / (2.0 * r));
    check(&found, Measured::Period, 2, -std::f64::consts::TAU / (w * w));
    check(&found, Measured::Period, 0, 0.0);
}

#[test]
fn pitchforks_move_only_with_parameters_that_keep_the_symmetry() {
    let own = followed(
        model(&[("l", -1.0), ("q", 0.4), ("h", 0.0), ("e", 0.0)], &[("x", "l*x + q*x - x^3 + h + e^2")], &[]),
        &[0.0],
        [-2.0, 2.0],
        &[],
    );
    let (found, at) = own.at(Kind::BranchPoint, -0.4);
    let found = found.unwrap();
    assert!((at + 0.4).abs() < 1e-8);
    check(&found, Measured::Parameter, 1, -1.0);
    let row = &found.rows[0];
    // h destroys it to first order, e to second.
    for column in [1, 2] {
        let reason = row.by[column].as_ref().unwrap_err();
        assert!(reason.contains("no longer cross"), "{reason}");
    }
}

#[test]
fn points_of_maps_move_as_their_closed_form_says() {
    let logistic = ModelSource {
        map: true,
        ..model(&[("r", 2.5), ("k", 1.5), ("c", 0.0)], &[("x", "r*x*(1 - x/k) + c")], &[("y", "x^2")])
    };
    let own = followed(logistic, &[0.9], [2.0, 3.3], &[]);
    let (found, _) = own.at(Kind::PeriodDoubling, 3.0);
    let found = found.unwrap();
    check(&found, Measured::Parameter, 1, 0.0);
    check(&found, Measured::Largest(0), 1, 2.0 / 3.0);
    check(&found, Measured::Largest(1), 1, 2.0 * (2.0 / 3.0) * 1.0);
    // x' = r x (1 - x/k) + c: at -1, x = k (r + 1)/(2 r) and c = x - r x (1 - x/k); dr/dc from dF = 0.
    let c = |r: f64| {
        let x = 1.5 * (r + 1.0) / (2.0 * r);
        x - r * x * (1.0 - x / 1.5)
    };
    let slope = (c(3.0 + 1e-5) - c(3.0 - 1e-5)) / 2e-5;
    let by = found.of(Measured::Parameter, 2).unwrap();
    assert!((by.value - 1.0 / slope).abs() < 1e-8, "{by:?} {}", 1.0 / slope);
    // Delayed logistic map: the torus point is at r = 2, θ = π/3, whatever the scale k.
    let delayed =
        ModelSource { map: true, ..model(&[("r", 1.8), ("k", 1.0)], &[("x", "r*x*(1 - y/k)"), ("y", "x")], &[]) };
    let own = followed(delayed, &[0.44, 0.44], [1.5, 2.2], &[]);
    let found = own.at(Kind::Torus, 2.0).0.unwrap();
    check(&found, Measured::Parameter, 1, 0.0);
    check(&found, Measured::Angle, 1, 0.0);
    check(&found, Measured::Largest(0), 1, 0.5);
}

#[test]
fn periods_of_forced_cycles_change_with_the_forcing() {
    // x'' + 2 z x' + x = f cos(w t): the amplitude is f / √((1 - w²)² + (2 z w)²).
    let forced = ModelSource {
        forcing: Some(Forcing { is_frequency: true, expression: "w".into() }),
        ..model(
            &[("w", 0.7), ("z", 0.1), ("f", 1.4)],
            &[("x", "v"), ("v", "-2*z*v - x + f*cos(w*t)")],
            &[("force", "f*cos(w*t) - x")],
        )
    };
    let own = followed(forced, &[1.0, 0.0], [0.6, 0.8], &[]);
    let branch = &own.diagram.branches[0];
    let system = System::of_plan(&own.model, &own.plan).in_units_of(&own.diagram);
    let point = branch.points.iter().find(|p| p.position == 0).unwrap();
    let found = of_point(&system, branch, point, &own.plan).unwrap();
    let [w, z, f] = [0.7f64, 0.1, 1.4];
    let size = |w: f64, z: f64| ((1.0 - w * w).powi(2) + (2.0 * z * w).powi(2)).sqrt();
    let d = size(w, z);
    check(&found, Measured::Period, 0, -std::f64::consts::TAU / (w * w));
    check(&found, Measured::Period, 1, 0.0);
    check(&found, Measured::Largest(0), 2, 1.0 / d);
    check(&found, Measured::Largest(0), 1, -f * 4.0 * z * w * w / d.powi(3));
    check(&found, Measured::Largest(0), 0, -f * (-2.0 * w * (1.0 - w * w) + 4.0 * z * z * w) / d.powi(3));
    // force = f cos - x has the amplitude f |1 - 1/(1 - w² + 2izw)|.
    let amplitude = |w: f64, z: f64| {
        let h = num_complex::Complex64::new(1.0 - w * w, 2.0 * z * w).inv();
        (1.0 - h).norm()
    };
    check(&found, Measured::Largest(2), 2, amplitude(w, z));
}

#[test]
fn samples_agree_with_the_exact_distribution() {
    let own = followed(
        model(&[("a", -2.0), ("b", 1.3), ("c", 0.7)], &[("x", "a + b*x - c*x^3")], &[]),
        &[-2.0],
        [-2.0, 2.0],
        &[],
    );
    let branch = &own.diagram.branches[0];
    let special = branch.special.iter().find(|s| s.kind == Kind::Fold && s.point.parameters[0] > 0.0).unwrap();
    let system = System::of_plan(&own.model, &own.plan).in_units_of(&own.diagram);
    let spreads = [(1, Spread::Uniform([1.2, 1.4])), (2, Spread::Normal(0.01))];
    let found = uncertainty(&system, branch, special, &own.plan, &spreads, 200).unwrap();
    assert_eq!((found.failed.len(), found.samples), (0, 200));
    let band = &found.bands[0];
    let fold = |b: f64, c: f64| 2.0 / 27f64.sqrt() * b.powf(1.5) / c.sqrt();
    // Moments by the trapezoidal rule on a fine grid of quantiles of b; those of c to second order.
    let cells = 2000;
    let value = |k: usize| fold(1.2 + 0.2 * (k as f64 + 0.5) / cells as f64, 0.7);
    let mean_b = (0..cells).map(value).sum::<f64>() / cells as f64;
    let mean = mean_b * (1.0 + 0.375 * (0.01f64 / 0.7).powi(2));
    let square = (0..cells).map(|k| (value(k) - mean_b).powi(2)).sum::<f64>() / cells as f64;
    let sigma = (square + (0.5 * mean_b * 0.01 / 0.7).powi(2)).sqrt();
    let [sampled, spread] = band.sampled.unwrap();
    assert!((sampled - mean).abs() < 0.01 * sigma, "{sampled} {mean}");
    assert!((spread - sigma).abs() < 0.03 * sigma, "{spread} {sigma}");
    let [_, first] = band.first_order.clone().unwrap();
    assert!((first - sigma).abs() < 0.01 * sigma, "{first} {sigma}");
}
