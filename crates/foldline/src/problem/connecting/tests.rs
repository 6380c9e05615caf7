use super::*;
use crate::model::{Definition, Model, ModelSource, Parameter, State};

fn lorenz() -> Model {
    Model::compile(ModelSource {
        name: "lorenz".into(),
        parameters: vec![Parameter::new("r", 14.0), Parameter::new("s", 10.0), Parameter::new("b", 2.7)],
        states: ["x", "y", "z"].map(State::new).to_vec(),
        equations: vec![
            Definition::new("x", "s*(y - x)"),
            Definition::new("y", "r*x - y - x*z"),
            Definition::new("z", "x*y - b*z"),
        ],
        ..ModelSource::default()
    })
    .unwrap()
}

/// Conditions and their derivatives, flat.
fn conditions(field: &ConnectingField, ends: [&[f64]; 2], parameters: &[f64], free: &[usize]) -> [Vec<f64>; 4] {
    let (b, n) = (field.conditions()[0], field.dim());
    let [mut v, mut l, mut r, mut p] = [1, n, n, free.len()].map(|size| vec![0.0; b * size]);
    field.boundary(ends, parameters, free, [&mut v, &mut l, &mut r, &mut p]);
    [v, l, r, p]
}

#[test]
fn the_derivatives_of_the_conditions_are_those_of_differences() {
    let model = lorenz();
    let scales = [2.0, 3.0, 5.0];
    have_exact_derivatives(&ConnectingField::new(&model, &scales, 1, 1), false);
    // The conditions do not depend on whether an eigenvalue is 0.
    have_exact_derivatives(&ConnectingField::at_saddle_node(&model, &scales, 0), true);
}

fn have_exact_derivatives(field: &ConnectingField, slow: bool) {
    let ends = [vec![0.011, 0.022, 0.001], vec![0.004, -0.003, 0.03]];
    let mut parameters = field.parameters(&[14.0, 10.0, 2.7], 4.0, &[0.002, -0.001, 0.003], [0.01, 0.01], &[]);
    field.refer([&ends[0], &ends[1]], &mut parameters);
    assert_eq!(field.is_slow(0, &parameters), slow);
    let free = [3, 4, 5, 6, 1, 0];
    let [value, left, right, by] = conditions(field, [&ends[0], &ends[1]], &parameters, &free);
    assert!(value.iter().all(|v| v.is_finite()));
    let h = 1e-6;
    let check = |moved: &dyn Fn(f64) -> Vec<f64>, own: &dyn Fn(usize) -> f64| {
        for (row, (a, b)) in moved(h).iter().zip(moved(-h)).enumerate() {
            let slope = (a - b) / (2.0 * h);
            assert!((slope - own(row)).abs() < 1e-6 * (1.0 + slope.abs()), "{row}: {slope} {}", own(row));
        }
    };
    for j in 0..3 {
        for (end, matrix) in [(0, &left), (1, &right)] {
            let moved = |h: f64| {
                let mut ends = ends.clone();
                ends[end][j] += h;
                conditions(field, [&ends[0], &ends[1]], &parameters, &free)[0].clone()
            };
            check(&moved, &|row| matrix[row * 3 + j]);
        }
    }
    for (c, index) in free.iter().enumerate() {
        let moved = |h: f64| {
            let mut parameters = parameters.clone();
            parameters[*index] += h;
            conditions(field, [&ends[0], &ends[1]], &parameters, &free)[0].clone()
        };
        check(&moved, &|row| by[row * free.len() + c]);
    }
}

/// y' = y², z' = -z + y² + 2 y³ has the manifold z = y².
#[test]
fn the_conditions_next_to_a_saddle_node_find_its_manifold_to_fourth_order() {
    let model = Model::compile(ModelSource {
        name: "slow".into(),
        parameters: vec![Parameter::new("p", 0.0)],
        states: ["y", "z"].map(State::new).to_vec(),
        equations: vec![Definition::new("y", "p + y^2"), Definition::new("z", "-z + y^2 + 2*y^3")],
        ..ModelSource::default()
    })
    .unwrap();
    let field = ConnectingField::at_saddle_node(&model, &[1.0, 1.0], 0);
    let residual = |y: f64, z: f64| {
        let ends = [vec![y, z], vec![-0.02, 0.0004]];
        let mut parameters = field.parameters(&[0.0], 100.0, &[0.0, 0.0], [0.02, 0.02], &[]);
        field.refer([&ends[0], &ends[1]], &mut parameters);
        conditions(&field, [&ends[0], &ends[1]], &parameters, &[])[0][2].abs()
    };
    // The third derivative of z = y² in time is 24 y⁵.
    for y in [0.02, 0.01] {
        let off = residual(y, y * y);
        assert!((off / (24.0 * y.powi(5)) - 1.0).abs() < 1e-6, "{off:e}");
    }
    assert!((residual(0.02, 0.0004 + 1e-3) / 1e-3 - 1.0).abs() < 0.2);
}

#[test]
fn the_field_is_measured_per_length_with_exact_derivatives() {
    let model = lorenz();
    let field = ConnectingField::new(&model, &[1.0; 3], 1, 1);
    let parameters = field.parameters(&[14.0, 10.0, 2.7], 4.0, &[0.0; 3], [0.01, 0.01], &[]);
    let at = |parameters: &[f64], x: &[f64]| {
        let mut f = vec![0.0; 3];
        let batch =
            Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters), times: &[0.5], signs: &[] };
        field.evaluate(batch, &mut f);
        f
    };
    let x = [1.0, 2.0, 3.0];
    for (f, known) in at(&parameters, &x).into_iter().zip([40.0, 36.0, 4.0 * (2.0 - 8.1)]) {
        assert!((f - known).abs() <= 1e-14 * known.abs(), "{f} is not {known}");
    }
    let mut d = vec![0.0; 3 + parameters.len()];
    (d[0], d[4], d[6]) = (0.3, -0.2, 0.7);
    let batch = Batch { lanes: 1, states: &x, parameters: Parameters::Shared(&parameters), times: &[0.5], signs: &[] };
    let mut along = vec![0.0; 3];
    field.directional(batch, &[&d], &mut along);
    let h = 1e-6;
    let moved = |h: f64| {
        let moved: Vec<f64> = parameters.iter().zip(&d[3..]).map(|(p, d)| p + h * d).collect();
        at(&moved, &[x[0] + h * d[0], x[1], x[2]])
    };
    for ((a, b), own) in moved(h).iter().zip(moved(-h)).zip(&along) {
        assert!(((a - b) / (2.0 * h) - own).abs() < 1e-6 * (1.0 + own.abs()));
    }
    let mut second = vec![0.0; 3];
    field.directional(batch, &[&d, &d], &mut second);
    let middle = at(&parameters, &x);
    let h = 1e-3;
    for (((a, b), m), own) in moved(h).iter().zip(moved(-h)).zip(&middle).zip(&second) {
        assert!(((a - 2.0 * m + b) / (h * h) - own).abs() < 1e-5 * (1.0 + own.abs()));
    }
}
