use super::*;
use crate::contract::VectorField;
use crate::model::{Definition, Model, ModelSource, Parameter, State};

fn model(equations: &[(&str, &str)], parameter: f64) -> Model {
    Model::compile(ModelSource {
        parameters: vec![Parameter::new("p", parameter)],
        states: equations.iter().map(|(name, _)| State::new(name)).collect(),
        equations: equations.iter().map(|(name, text)| Definition::new(name, text)).collect(),
        ..ModelSource::default()
    })
    .unwrap()
}

fn origin(model: &Model) -> Point {
    let n = model.dim();
    Point {
        position: 0,
        parameters: model.defaults(),
        solution: Solution::Equilibrium(vec![0.0; n]),
        tangent: Vec::new(),
        step: 0.0,
        spectrum: Vec::new(),
        unstable: 0,
        ranges: Vec::new(),
        averages: Vec::new(),
        trust: Default::default(),
        cost: Default::default(),
    }
}

fn with(equations: &[(&str, &str)], parameter: f64, check: impl Fn(&Local)) {
    let model = model(equations, parameter);
    check(&Local::new(&model, &origin(&model)).unwrap());
}

fn near(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-10 * (1.0 + b.abs()), "{a} {b}");
}

#[test]
fn systems_in_normal_form_have_the_coefficients_they_are_written_with() {
    with(&[("x", "3*x^2"), ("y", "-y")], 0.0, |at| near(at.fold().unwrap().abs(), 3.0));
    // A nonlinear change of coordinates: y is slaved, y = x², and adds 2 x y = 2 x³.
    with(&[("x", "-5*x^3 + 2*x*y"), ("y", "-y + x^2")], 0.0, |at| near(at.cusp().unwrap(), -3.0));
    // z' = iω z + (c₁ + i) z |z|² in Cartesian coordinates, where ⟨q, q⟩ = 1 makes |z|² half of x² + y²: l₁ = 2 c₁ / ω.
    let hopf = [("x", "-2*y - 0.3*x*(x^2 + y^2) - y*(x^2 + y^2)"), ("y", "2*x - 0.3*y*(x^2 + y^2) + x*(x^2 + y^2)")];
    with(&hopf, 0.0, |at| near(at.hopf(2.0).unwrap(), -2.0 * 0.3 / 2.0));
    with(&[("x", "y"), ("y", "0.7*x^2 - 0.4*x*y")], 0.0, |at| {
        let [a, b] = at.takens().unwrap();
        near(a * b, -0.28);
        near(a.abs(), 0.7);
    });
    with(&[("x", "y"), ("y", "-x^3 + x^2*y")], 0.0, |at| assert!(at.takens().is_none()));
}

/// x' = v/k, v' = k (x² + x v/k): v is k times as large as x, whatever is declared.
#[test]
fn a_velocity_in_other_units_is_recognised() {
    for k in [1e3, 1e6, 1e9] {
        let model = model(&[("x", "v/p"), ("v", "p*(x^2 + x*v/p)")], k);
        let (found, _) = units(&model, &[0.0, 0.0], &[k], &[1.0, 1.0]);
        let ratio = found[1] / found[0] / k;
        assert!((0.3..3.0).contains(&ratio), "{k}: {ratio}");
    }
}

#[test]
fn quadratic_terms_enter_the_first_lyapunov_coefficient() {
    // kuznetsov2004, §3.5: for u' = -v + …, ω = 1, l₁ from all second and third derivatives; here u' = -v + p u² + u v,
    // v' = u + v².
    let formula = |p: f64| {
        // (1/16)(f_uuu + …) + (1/16 ω)(f_uv (f_uu + f_vv) - g_uv (g_uu + g_vv) - f_uu g_uu + f_vv g_vv), which is a for
        // r' = a r³.
        let (fuu, fuv, fvv, guu, guv, gvv) = (2.0 * p, 1.0, 0.0, 0.0, 0.0, 2.0);
        (fuv * (fuu + fvv) - guv * (guu + gvv) - fuu * guu + fvv * gvv) / 16.0
    };
    for p in [0.5, -1.25] {
        // r' = a r³ in u + i v; with ⟨q, q⟩ = 1, l₁ = 2 a / ω.
        with(&[("u", "-v + p*u^2 + u*v"), ("v", "u + v^2")], p, |at| near(at.hopf(1.0).unwrap(), 2.0 * formula(p)));
    }
}

/// System y' = g(y, p) in other coordinates: x_i = y_i + κ x_j x_k for every (i, j, k, κ) successively, then rotated in
/// every plane (i, j, angle), and shifted in proportion to p. None of these changes a normal form, and rotations
/// preserve lengths.
fn disguised(g: &[&str], shears: &[(usize, usize, usize, f64)], turns: &[(usize, usize, f64)], drift: &[f64]) -> Model {
    let (n, top) = (g.len(), shears.len());
    let mut turned: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| f64::from(i == j)).collect()).collect();
    for &(i, j, angle) in turns {
        for row in &mut turned {
            let (a, b) = (row[i], row[j]);
            (row[i], row[j]) = (a * angle.cos() - b * angle.sin(), a * angle.sin() + b * angle.cos());
        }
    }
    let moved = |j: usize| drift.get(j).copied().unwrap_or(0.0);
    let mut texts: Vec<(String, String)> = Vec::new();
    for i in 0..n {
        let terms: Vec<String> = (0..n).map(|j| format!("({:?})*(u{j} - ({:?})*p)", turned[j][i], moved(j))).collect();
        texts.push((format!("x{top}_{i}"), terms.join(" + ")));
        texts.push((format!("y{i}"), format!("x0_{i}")));
        texts.push((format!("d0_{i}"), g[i].to_string()));
    }
    for (l, &(i, j, k, factor)) in shears.iter().enumerate() {
        let (old, new) = (l, l + 1);
        for m in 0..n {
            let off = if m == i { format!(" - ({factor:?})*x{new}_{j}*x{new}_{k}") } else { String::new() };
            texts.push((format!("x{old}_{m}"), format!("x{new}_{m}{off}")));
            let product = format!(" + ({factor:?})*(d{old}_{j}*x{new}_{k} + x{new}_{j}*d{old}_{k})");
            let rate = if m == i { product } else { String::new() };
            texts.push((format!("d{new}_{m}"), format!("d{old}_{m}{rate}")));
        }
    }
    let sum = |j: usize| (0..n).map(|i| format!("({:?})*d{top}_{i}", turned[j][i])).collect::<Vec<_>>().join(" + ");
    let names: Vec<String> = (0..n).map(|j| format!("u{j}")).collect();
    Model::compile(ModelSource {
        parameters: vec![Parameter::new("p", 0.0)],
        definitions: texts.iter().map(|(name, text)| Definition::new(name, text)).collect(),
        states: names.iter().map(|name| State::new(name)).collect(),
        equations: names.iter().enumerate().map(|(j, name)| Definition::new(name, &sum(j))).collect(),
        ..ModelSource::default()
    })
    .unwrap()
}

const PLANE: [(usize, usize, usize, f64); 3] = [(0, 1, 1, 0.7), (1, 0, 0, -0.4), (0, 1, 1, -0.2)];
const SPACE: [(usize, usize, usize, f64); 5] =
    [(0, 1, 1, 0.5), (1, 0, 2, -0.6), (2, 0, 0, 0.8), (2, 0, 1, 0.4), (0, 1, 2, -0.3)];

#[test]
fn coordinates_do_not_change_a_hopf_point() {
    // z' = (1.3 i) z + (c + 2i) z |z|²; |z|² = 2 |w|² where x = 2 Re(w q), ⟨q, q⟩ = 1.
    for c in [0.45, -0.2] {
        let first = format!("-1.3*y1 + ({c})*y0*(y0^2 + y1^2) - 2*y1*(y0^2 + y1^2)");
        let second = format!("1.3*y0 + ({c})*y1*(y0^2 + y1^2) + 2*y0*(y0^2 + y1^2)");
        let plane = disguised(&[&first, &second], &PLANE, &[(0, 1, 0.9)], &[]);
        near(Local::new(&plane, &origin(&plane)).unwrap().hopf(1.3).unwrap(), 2.0 * c / 1.3);
        // With a third, damped state mixed in.
        let space = disguised(&[&first, &second, "-0.8*y2"], &SPACE, &[(0, 2, 0.7), (1, 2, -0.4)], &[]);
        near(Local::new(&space, &origin(&space)).unwrap().hopf(1.3).unwrap(), 2.0 * c / 1.3);
    }
}

#[test]
fn coordinates_do_not_change_a_generalised_hopf_point() {
    // z' = 1.3 i z + 0.6 i z |z|² + (c - 0.7 i) z |z|⁴, and |z|⁴ = 4 |w|⁴.
    for c in [0.45, -0.2] {
        let square = "(y0^2 + y1^2)";
        let turn = format!("(1.3 + 0.6*{square} - 0.7*{square}^2)");
        let first = format!("-y1*{turn} + ({c})*y0*{square}^2");
        let second = format!("y0*{turn} + ({c})*y1*{square}^2");
        let plane = disguised(&[&first, &second], &PLANE, &[(0, 1, 0.9)], &[]);
        let at = origin(&plane);
        let local = Local::new(&plane, &at).unwrap();
        near(local.hopf(1.3).unwrap(), 0.0);
        near(local.generalised_hopf(1.3).unwrap(), 4.0 * c / 1.3);
        let space = disguised(&[&first, &second, "-0.8*y2"], &SPACE, &[(0, 2, 0.7), (1, 2, -0.4)], &[]);
        near(Local::new(&space, &origin(&space)).unwrap().generalised_hopf(1.3).unwrap(), 4.0 * c / 1.3);
    }
}

#[test]
fn neither_coordinates_nor_time_change_a_zero_hopf_point() {
    // ξ' = b ξ² + c |z|², z' = 1.7 i z + (d + 0.4 i) ξ z + E ξ² z: four signs of b c and E.
    for (b, c, d, e) in
        [(1.5_f64, 0.8, 0.6, 0.9), (1.5, -0.8, -0.6, 0.9), (-1.1, 0.7, 2.0, -0.5), (-1.1, -0.7, -0.3, 1.4)]
    {
        for pace in ["", "*(1 + 0.35*y0 - 0.2*y0^2 + 0.3*(y1^2 + y2^2))"] {
            let slow = format!("(({b})*y0^2 + ({c})*(y1^2 + y2^2)){pace}");
            let growth = format!("(({d})*y0 + ({e})*y0^2)");
            let turn = "(1.7 + 0.4*y0)";
            let first = format!("({growth}*y1 - {turn}*y2){pace}");
            let second = format!("({turn}*y1 + {growth}*y2){pace}");
            let model = disguised(&[&slow, &first, &second], &SPACE, &[(0, 1, 0.5), (1, 2, 1.1), (0, 2, -0.8)], &[]);
            let found = Local::new(&model, &origin(&model)).unwrap().zero_hopf(1.7).unwrap();
            let expected = [(b * c).signum(), d / b, e];
            found.iter().zip(expected).for_each(|(own, known)| near(*own, known));
        }
    }
}

#[test]
fn coordinates_do_not_change_a_double_hopf_point() {
    // z₁' = z₁ (2.2 i + (p₁₁ + i) |z₁|² + (p₁₂ - i) |z₂|²), and so on; |z|² = 2 |w|².
    let form = |p: [f64; 4]| {
        let (one, two) = ("(y0^2 + y1^2)", "(y2^2 + y3^2)");
        let (first, second) =
            (format!("(({})*{one} + ({})*{two})", p[0], p[1]), format!("(({})*{one} + ({})*{two})", p[2], p[3]));
        let (turn, other) = (format!("(2.2 + {one} - {two})"), format!("(0.83 - 0.5*{one} + 0.3*{two})"));
        [
            format!("{first}*y0 - {turn}*y1"),
            format!("{first}*y1 + {turn}*y0"),
            format!("{second}*y2 - {other}*y3"),
            format!("{second}*y3 + {other}*y2"),
        ]
    };
    let shears = [(0, 1, 2, 0.5), (2, 0, 0, -0.6), (3, 0, 1, 0.8), (1, 2, 3, 0.4), (2, 1, 3, -0.7)];
    let turns = [(0, 2, 0.6), (1, 3, -1.2), (0, 3, 0.3), (1, 2, 0.9)];
    for p in [[-0.5, 0.7, -0.3, -0.9], [0.5, 0.7, 0.3, -0.9]] {
        let texts = form(p);
        let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
        let model = disguised(&texts, &shears, &turns, &[]);
        let at = origin(&model);
        let found = Local::new(&model, &at).unwrap().double_hopf([2.2, 0.83]).unwrap();
        let expected = [2.0 * p[0], 2.0 * p[1], 2.0 * p[2], 2.0 * p[3], p[1] / p[3], p[2] / p[0]];
        assert_eq!(found.len(), expected.len());
        found.iter().zip(expected).for_each(|(own, known)| near(*own, known));
    }
    // At a strong resonance terms such as z̄₁ z₂² cannot be removed, and this form does not exist.
    let texts = form([-0.5, 0.7, -0.3, -0.9]).map(|text| text.replace("0.83", "1.1"));
    let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
    let model = disguised(&texts, &shears, &turns, &[]);
    assert!(Local::new(&model, &origin(&model)).unwrap().double_hopf([2.2, 1.1]).is_none());
}

#[test]
fn coordinates_do_not_change_a_branch_point() {
    let drift = [0.4, -0.3, 0.9];
    let turns = [(0, 1, 0.5), (1, 2, 1.1), (0, 2, -0.8)];
    let along = [drift.as_slice(), &[1.0]].concat();
    // ξ' = 0.8 μ ξ + a ξ², along the branch ξ = 0 and along the other, ξ = -0.8 μ / a, where the eigenvalue crosses in
    // the opposite direction.
    let a = -1.7;
    let model = disguised(&["0.8*p*y0 + (-1.7)*y0^2 + 2*y0^3", "-y1", "-2*y2"], &SPACE, &turns, &drift);
    let at = origin(&model);
    let local = Local::new(&model, &at).unwrap();
    let [quadratic, b] = local.crossing(&along, false, &[1.0; 8]).unwrap()[..] else { panic!("it is transcritical") };
    near(quadratic.abs(), -a);
    near(b, 0.8);
    let [q, _] = local.null_vectors().unwrap();
    let other: Vec<f64> = (0..4).map(|i| along[i] - if i < 3 { 0.8 / quadratic * q[i] } else { 0.0 }).collect();
    let [same, back] = local.crossing(&other, false, &[1.0; 8]).unwrap()[..] else { panic!("it is transcritical") };
    near(same, quadratic);
    near(back, -0.8);
    // Near the point a computed tangent may lie anywhere between the two, so the closer one counts.
    for (share, expected) in [(0.4, 0.8), (0.6, -0.8)] {
        let between: Vec<f64> = along.iter().zip(&other).map(|(a, b)| a + share * (b - a)).collect();
        near(local.crossing(&between, false, &[1.0; 8]).unwrap()[1], expected);
    }
    // ξ' = 0.8 μ ξ + c ξ³ with slaved states that add to c: y₁ = y₀² and 2 y₀ y₁.
    for (cubic, whole) in [("-5", -3.0), ("1.5", 3.5)] {
        let first = format!("0.8*p*y0 + ({cubic})*y0^3 + 2*y0*y1");
        let model = disguised(&[&first, "-y1 + y0^2", "-2*y2"], &[(2, 0, 0, 0.8), (2, 1, 1, 0.4)], &turns, &drift);
        let at = origin(&model);
        let [zero, b, c] = Local::new(&model, &at).unwrap().crossing(&along, true, &[1.0; 8]).unwrap()[..] else {
            panic!("it is a pitchfork")
        };
        assert_eq!(zero, 0.0);
        near(b, 0.8);
        near(c, whole);
    }
}

/// Two Brusselators that exchange their substances, in a state in which they differ: l₁ from the formula of kuznetsov2004,
/// §5.4, evaluated independently. The state with the cells exchanged has the same.
#[test]
fn cells_that_are_exchanged_have_the_same_lyapunov_coefficient() {
    let b = "3.3855532395352155";
    let cell = |own: &str, other: &str| {
        [
            (format!("x{own}"), format!("1 - ({b} + 1)*x{own} + x{own}^2*y{own} + 0.05*(x{other} - x{own})")),
            (format!("y{own}"), format!("{b}*x{own} - x{own}^2*y{own} + 5*0.05*(y{other} - y{own})")),
        ]
    };
    let all: Vec<(String, String)> = [cell("1", "2"), cell("2", "1")].concat();
    let all: Vec<(&str, &str)> = all.iter().map(|(a, b)| (a.as_str(), b.as_str())).collect();
    let model = model(&all, 0.0);
    let [one, other] = [[1.4227438216077268, 2.609323784808865], [0.577256178392273, 4.469396599882864]];
    for state in [[one, other].concat(), [other, one].concat()] {
        let at = Point { solution: Solution::Equilibrium(state), ..origin(&model) };
        let found = Local::new(&model, &at).unwrap().hopf(0.32476006182662337).unwrap();
        assert!((found - 4.764130).abs() < 1e-5, "{found}");
    }
}
