//! Derivatives of the tape against an independent automatic-differentiation crate, to third order, for every function of the
//! language; and the values where a derivative is a convention.

use foldline::contract::{Batch, Parameters, VectorField};
use foldline::model::{Definition, Model, ModelSource, Parameter, State};
use num_dual::{DualNum, HyperHyperDual64 as H};

fn model(expression: &str) -> Model {
    let source = ModelSource {
        parameters: vec![Parameter::new("p", 0.0)],
        states: vec![State::new("x"), State::new("y")],
        equations: vec![Definition::new("x", expression), Definition::new("y", "0")],
        ..ModelSource::default()
    };
    Model::compile(source).unwrap_or_else(|errors| panic!("{expression}: {errors:?}"))
}

/// Numbers in (0, 1) without a pattern: the multiples of the golden section.
fn scattered(count: usize) -> Vec<f64> {
    (1..=count).map(|i| (i as f64 * 0.618_033_988_749_894_9).fract()).collect()
}

type Function = fn(H, H, H) -> H;

fn select(condition: bool, a: H, b: H) -> H {
    if condition { a } else { b }
}

/// An expression in x, y, p; the same for dual numbers; and where to sample x and y.
const CASES: &[(&str, Function, [f64; 2], [f64; 2])] = &[
    ("x + 2*y - p", |x, y, p| x + y * 2.0 - p, [-2.0, 2.0], [-2.0, 2.0]),
    ("x*y*p/(1 + x^2)", |x, y, p| x * y * p / (x * x + 1.0), [-2.0, 2.0], [-2.0, 2.0]),
    ("x/y - y/x", |x, y, _| x / y - y / x, [0.5, 2.0], [0.5, 2.0]),
    ("x^3 - 2*y^2 + x^-2", |x, y, _| x.powi(3) - y.powi(2) * 2.0 + x.powi(-2), [0.5, 2.0], [-2.0, 2.0]),
    ("x^7*y^-3", |x, y, _| x.powi(7) * y.powi(-3), [-1.5, 1.5], [0.5, 2.0]),
    ("x^2.5", |x, _, _| x.powf(2.5), [0.5, 2.0], [0.0, 1.0]),
    ("x^y", |x, y, _| x.powd(y), [0.5, 2.0], [-2.0, 2.0]),
    ("sqrt(x + y^2)", |x, y, _| (x + y * y).sqrt(), [0.2, 2.0], [-2.0, 2.0]),
    ("exp(x*y)", |x, y, _| (x * y).exp(), [-2.0, 2.0], [-2.0, 2.0]),
    ("log(x + 2*y)", |x, y, _| (x + y * 2.0).ln(), [0.2, 2.0], [0.2, 2.0]),
    ("sin(x*y) + cos(x - y)", |x, y, _| (x * y).sin() + (x - y).cos(), [-2.0, 2.0], [-2.0, 2.0]),
    ("tan(x*p)", |x, _, p| (x * p).tan(), [-1.0, 1.0], [0.0, 1.0]),
    ("asin(x*y)", |x, y, _| (x * y).asin(), [-0.9, 0.9], [-0.9, 0.9]),
    ("acos(x*y)", |x, y, _| (x * y).acos(), [-0.9, 0.9], [-0.9, 0.9]),
    ("atan(x - y^2)", |x, y, _| (x - y * y).atan(), [-2.0, 2.0], [-2.0, 2.0]),
    ("atan2(y, x)", |x, y, _| y.atan2(x), [0.3, 2.0], [-2.0, 2.0]),
    ("sinh(x)*cosh(y)", |x, y, _| x.sinh() * y.cosh(), [-2.0, 2.0], [-2.0, 2.0]),
    ("tanh(2*x - y)", |x, y, _| (x * 2.0 - y).tanh(), [-1.0, 1.0], [-1.0, 1.0]),
    ("abs(x - y)*x", |x, y, _| select(x.re > y.re, x - y, y - x) * x, [-2.0, 2.0], [-2.0, 2.0]),
    ("sign(x)*y^2", |x, y, _| y * y * x.re.signum(), [-2.0, 2.0], [-2.0, 2.0]),
    ("heaviside(x - y)*x^2", |x, y, _| select(x.re > y.re, x * x, H::from(0.0)), [-2.0, 2.0], [-2.0, 2.0]),
    ("min(x^2, y^2)", |x, y, _| select(x.re.abs() < y.re.abs(), x * x, y * y), [-2.0, 2.0], [-2.0, 2.0]),
    ("max(x^2, y^3)", |x, y, _| select(x.re.powi(2) > y.re.powi(3), x * x, y * y * y), [-2.0, 2.0], [-2.0, 2.0]),
    ("hypot(x, y)^3", |x, y, _| (x * x + y * y).sqrt().powi(3), [0.3, 2.0], [0.3, 2.0]),
    ("if(x < y, x^2*y, y^3)", |x, y, _| select(x.re < y.re, x * x * y, y * y * y), [-2.0, 2.0], [-2.0, 2.0]),
    ("if(x >= y, sin(x), log(y))", |x, y, _| select(x.re >= y.re, x.sin(), y.ln()), [0.1, 2.0], [0.1, 2.0]),
    ("if(x <= y, x, p*y)", |x, y, p| select(x.re <= y.re, x, p * y), [-2.0, 2.0], [-2.0, 2.0]),
    ("(x > y)*x^2 + (x != y)*y", |x, y, _| select(x.re > y.re, x * x, H::from(0.0)) + y, [-2.0, 2.0], [-2.0, 2.0]),
    ("if(x == y, 0, pi*x)", |x, _, _| x * std::f64::consts::PI, [-2.0, 2.0], [-2.0, 2.0]),
];

/// Sums of products reorder roundings: 1e-12 of the largest term leaves four digits of reserve for third derivatives.
#[test]
fn derivatives_to_third_order_agree_with_dual_numbers() {
    const LANES: usize = 21;
    for &(expression, dual, xs, ys) in CASES {
        let model = model(expression);
        let s = scattered(LANES * 12);
        let place = |[low, high]: [f64; 2], share: f64| low + share * (high - low);
        let state: Vec<f64> = (0..2 * LANES).map(|i| place(if i < LANES { xs } else { ys }, s[i])).collect();
        let p: Vec<f64> = (0..LANES).map(|l| 0.3 + s[2 * LANES + l]).collect();
        let directions: Vec<Vec<f64>> = (0..3)
            .map(|d| s[3 * LANES * (1 + d)..3 * LANES * (2 + d)].iter().map(|share| 2.0 * share - 1.0).collect())
            .collect();
        let at = Batch { lanes: LANES, states: &state, parameters: Parameters::PerLane(&p) };
        let directions: Vec<&[f64]> = directions.iter().map(|d| d.as_slice()).collect();

        let mut found = vec![vec![0.0; 2 * LANES]; 4];
        model.evaluate(at, &mut found[0]);
        for order in 1..=3 {
            model.directional(at, &directions[..order], &mut found[order]);
        }
        for l in 0..LANES {
            let input = |c: usize, value: f64| {
                let d = |k: usize| directions[k][c * LANES + l];
                H::new(value, d(0), d(1), d(2), 0.0, 0.0, 0.0, 0.0)
            };
            let expected = dual(input(0, state[l]), input(1, state[LANES + l]), input(2, p[l]));
            let expected = [expected.re, expected.eps1, expected.eps1eps2, expected.eps1eps2eps3];
            let size = expected.iter().fold(1.0, |m: f64, e| m.max(e.abs()));
            for order in 0..=3 {
                let difference = (found[order][l] - expected[order]).abs();
                assert!(
                    difference <= 1e-12 * size,
                    "{expression}, order {order}: {} {}",
                    found[order][l],
                    expected[order]
                );
            }
        }
    }
}

/// The Jacobian is the first directional derivative along the axes, and shared parameters give what parameters per lane give.
#[test]
fn jacobian_and_directional_derivative_agree() {
    const LANES: usize = 37;
    for &(expression, _, xs, ys) in CASES {
        let model = model(expression);
        let s = scattered(2 * LANES);
        let state: Vec<f64> = (0..2 * LANES)
            .map(|i| {
                let [low, high] = if i < LANES { xs } else { ys };
                low + s[i] * (high - low)
            })
            .collect();
        let p = vec![0.7; LANES];
        let shared = Batch { lanes: LANES, states: &state, parameters: Parameters::Shared(&p[..1]) };
        let per_lane = Batch { lanes: LANES, states: &state, parameters: Parameters::PerLane(&p) };
        let mut results = Vec::new();
        for at in [shared, per_lane] {
            let (mut f, mut fx, mut fp) = (vec![0.0; 2 * LANES], vec![0.0; 4 * LANES], vec![0.0; 2 * LANES]);
            model.linearise(at, &[0], &mut f, &mut fx, &mut fp);
            results.push((f, fx, fp));
        }
        assert_eq!(results[0], results[1], "{expression}");
        for (axis, column) in
            [&results[0].1[..LANES], &results[0].1[LANES..2 * LANES], &results[0].2[..LANES]].iter().enumerate()
        {
            let mut direction = vec![0.0; 3 * LANES];
            direction[axis * LANES..(axis + 1) * LANES].fill(1.0);
            let mut derivative = vec![0.0; 2 * LANES];
            model.directional(shared, &[&direction], &mut derivative);
            for l in 0..LANES {
                let size = 1.0 + column[l].abs();
                assert!((derivative[l] - column[l]).abs() < 1e-13 * size, "{expression}, axis {axis}");
            }
        }
    }
}

fn at_origin(expression: &str, order: usize) -> f64 {
    let model = model(expression);
    let at = Batch { lanes: 1, states: &[0.0, 0.0], parameters: Parameters::Shared(&[1.0]) };
    let direction = [3.0, 4.0, 0.0];
    let mut out = [0.0; 2];
    model.directional(at, &vec![&direction[..]; order], &mut out);
    out[0]
}

#[test]
fn what_is_not_taken_does_not_spoil_the_derivative() {
    // 1/x, log and sqrt are singular at the origin, in the branch that is not taken there.
    assert_eq!(at_origin("if(x > 0, 1/x, 2*x)", 1), 6.0);
    assert_eq!(at_origin("if(x > 0, log(x)*sqrt(x), x^2)", 2), 18.0);
    assert_eq!(at_origin("max(x, 0)*0 + y", 1), 4.0);
}

#[test]
fn smooth_functions_of_a_radius_are_smooth_at_the_origin() {
    // r² y has the third derivative D³[d, d, d] = 6 |d|² d_y with d = (3, 4).
    for square in ["hypot(x, y)^2", "sqrt(x^2 + y^2)^2", "sqrt(x^2 + y^2)*hypot(x, y)", "abs(x)^2 + y^2"] {
        let expression = format!("({square})*y");
        assert_eq!(at_origin(&expression, 1), 0.0, "{expression}");
        assert_eq!(at_origin(&expression, 3), 600.0, "{expression}");
    }
    // Where the radius itself is asked for, there is no derivative: the convention is 0, not NaN.
    assert_eq!(at_origin("hypot(x, y)", 1), 0.0);
    assert_eq!(at_origin("sqrt(x^2 + y^2 + x^4)", 1), 0.0);
    assert_eq!(at_origin("sqrt(x)", 1), f64::INFINITY);
}
