//! Values of expressions, and batches of every size.

use foldline::contract::{Batch, Parameters, VectorField};
use foldline::model::{Definition, Model, ModelSource, Output, Parameter, State};

fn value(expression: &str) -> f64 {
    let source = ModelSource {
        parameters: vec![Parameter::new("two", 2.0)],
        states: vec![State::new("x")],
        equations: vec![Definition::new("x", expression)],
        ..ModelSource::default()
    };
    let model = Model::compile(source).unwrap_or_else(|errors| panic!("{expression}: {errors:?}"));
    let mut f = [0.0];
    model.evaluate(Batch { lanes: 1, states: &[3.0], parameters: Parameters::Shared(&[2.0]) }, &mut f);
    f[0]
}

#[test]
fn precedence_and_association() {
    assert_eq!(value("-x^two"), -9.0);
    assert_eq!(value("-x^2"), -9.0);
    assert_eq!(value("(-x)^2"), 9.0);
    assert_eq!(value("two^x^two"), 512.0);
    assert_eq!(value("two^-1"), 0.5);
    assert_eq!(value("x - two - 1"), 0.0);
    assert_eq!(value("x/two/2"), 0.75);
    assert_eq!(value("x - -two"), 5.0);
    assert_eq!(value("+x*-two"), -6.0);
    assert_eq!(value("x + 1 > two*1.5"), 1.0);
    assert_eq!(value("(x < two) + (x >= 3) + (x == 3) + (x != 3)"), 2.0);
    assert_eq!(value("if(x, 5, 7) + if(x - 3, 5, 7)"), 12.0);
    assert_eq!(value("1e-3*x + .5 + 2.5E+1"), 0.003 + 0.5 + 25.0);
    assert_eq!(value("sign(-x) + heaviside(0) + heaviside(x)"), 0.5);
    assert_eq!(value("min(x, two)*10 + max(x, two)"), 23.0);
}

#[test]
fn integer_powers_are_repeated_products() {
    let x: f64 = 3.0;
    assert_eq!(value("x^20"), 3486784401.0);
    assert_eq!(value("x^-3"), 1.0 / (x * x * x));
    assert_eq!(value("x^(1 + 1)"), 9.0);
    assert_eq!(value("(x/10)^3"), (0.3f64 * 0.3) * 0.3);
    assert!(value("(x - 4)^3") == -1.0 && value("(x - 4)^0.5").is_nan());
}

#[test]
fn what_is_undefined_is_not_hidden() {
    for expression in ["log(x - 4)", "min(log(x - 4), 1)", "max(1, log(x - 4))", "sign(log(x - 4))", "abs(asin(x))"] {
        assert!(value(expression).is_nan(), "{expression}");
    }
    assert_eq!(value("1/(x - 3)"), f64::INFINITY);
}

fn lorenz() -> Model {
    let source = ModelSource {
        parameters: vec![Parameter::new("sigma", 10.0), Parameter::new("rho", 28.0), Parameter::new("b", 8.0 / 3.0)],
        definitions: vec![Definition::new("pull", "bent - z"), Definition::new("bent", "rho*tanh(sigma/10)")],
        states: ["x", "y", "z"].map(State::new).to_vec(),
        equations: vec![
            Definition::new("z", "x*y - b*z"),
            Definition::new("y", "x*pull - y"),
            Definition::new("x", "sigma*(y - x)"),
        ],
        outputs: vec![Output::new("r", "sqrt(x^2 + y^2)"), Output::new("steep", "sigma/rho")],
        ..ModelSource::default()
    };
    Model::compile(source).unwrap_or_else(|errors| panic!("{errors:?}"))
}

/// A lane's result does not depend on where in the batch it is, nor on how many other lanes there are: bit for bit.
#[test]
fn batches_of_every_size_agree() {
    let model = lorenz();
    let parameters = model.defaults();
    let point = |l: usize| [(l as f64).sin(), (l as f64 * 0.7).cos() * 5.0, l as f64 * 0.1];
    let single: Vec<Vec<f64>> = (0..100)
        .map(|l| {
            let at = Batch { lanes: 1, states: &point(l), parameters: Parameters::Shared(&parameters) };
            let mut all = vec![0.0; 3 + 3 + 9 + 6 + 2];
            let (f, rest) = all.split_at_mut(3);
            model.evaluate(at, f);
            let (f, rest) = rest.split_at_mut(3);
            let (fx, rest) = rest.split_at_mut(9);
            let (fp, outputs) = rest.split_at_mut(6);
            model.linearise(at, &[1, 2], f, fx, fp);
            model.outputs(at, outputs);
            all
        })
        .collect();
    for lanes in (0..=50).chain([64, 99, 100]) {
        let states: Vec<f64> = (0..3).flat_map(|c| (0..lanes).map(move |l| point(l)[c])).collect();
        let each: Vec<f64> = parameters.iter().flat_map(|&p| std::iter::repeat_n(p, lanes)).collect();
        for given in [Parameters::Shared(&parameters), Parameters::PerLane(&each)] {
            let at = Batch { lanes, states: &states, parameters: given };
            let mut all = vec![0.0; 23 * lanes];
            let (f, rest) = all.split_at_mut(3 * lanes);
            model.evaluate(at, f);
            let (f, rest) = rest.split_at_mut(3 * lanes);
            let (fx, rest) = rest.split_at_mut(9 * lanes);
            let (fp, outputs) = rest.split_at_mut(6 * lanes);
            model.linearise(at, &[1, 2], f, fx, fp);
            model.outputs(at, outputs);
            for (c, l) in (0..23).flat_map(|c| (0..lanes).map(move |l| (c, l))) {
                assert_eq!(
                    all[c * lanes + l].to_bits(),
                    single[l][c].to_bits(),
                    "{lanes} lanes, lane {l}, component {c}"
                );
            }
        }
    }
}

/// The Jacobian of the Lorenz equations, by hand.
#[test]
fn lorenz_jacobian() {
    let model = lorenz();
    let (sigma, rho, b) = (10.0, 28.0, 8.0 / 3.0);
    let [x, y, z] = [1.5, -2.0, 20.0];
    let at = Batch { lanes: 1, states: &[x, y, z], parameters: Parameters::Shared(&[sigma, rho, b]) };
    let (mut f, mut fx, mut fp) = ([0.0; 3], [0.0; 9], [0.0; 6]);
    model.linearise(at, &[2, 1], &mut f, &mut fx, &mut fp);
    let bent = 1.0f64.tanh();
    let expected = [-sigma, sigma, 0.0, rho * bent - z, -1.0, -x, y, x, -b];
    for (found, expected) in fx.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-14, "{found} {expected}");
    }
    assert_eq!(fp, [0.0, 0.0, 0.0, x * bent, -z, 0.0]);
    assert_eq!(model.parameter_index("rho"), Some(1));
    assert_eq!((model.state_index("z"), model.output_index("steep"), model.state_index("r")), (Some(2), Some(1), None));
}

/// Depth and length of expressions are bounded by messages and memory, not by the stack.
#[test]
fn very_long_and_very_deep_expressions() {
    let long = vec!["x"; 20_000].join(" + ");
    assert_eq!(value(&long), 60_000.0);
    let deep = format!("{}x{}", "(".repeat(5_000), ")".repeat(5_000));
    let source = ModelSource {
        states: vec![State::new("x")],
        equations: vec![Definition::new("x", &deep)],
        ..ModelSource::default()
    };
    let errors = Model::compile(source).map(|_| ()).unwrap_err();
    assert!(errors[0].message.contains("nested"), "{errors:?}");

    let mut chain: Vec<Definition> =
        (1..3_000).map(|i| Definition::new(&format!("d{i}"), &format!("d{} + 1", i - 1))).collect();
    chain.push(Definition::new("d0", "x"));
    let source = ModelSource {
        states: vec![State::new("x")],
        definitions: chain,
        equations: vec![Definition::new("x", "d2999")],
        ..ModelSource::default()
    };
    let model = Model::compile(source).unwrap_or_else(|errors| panic!("{errors:?}"));
    let mut f = [0.0];
    model.evaluate(Batch { lanes: 1, states: &[0.5], parameters: Parameters::Shared(&[]) }, &mut f);
    assert_eq!(f[0], 2999.5);
}
