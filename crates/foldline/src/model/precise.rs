//! Evaluation of expressions in twice the working precision.
//!
//! **Idea.** The graph is evaluated node by node in double-double arithmetic (a number is the unevaluated sum of two).
//! This is slow, but free of the rounding that limits a residual that should be zero; it is meant for checks.
//!
//! **Departures.** Sums, products and roots are the library's. Its quotients and `sin` are accurate to 1e-16 only, its
//! `exp` of negative numbers to 1e-11. These are implemented here: functions as series, inverses by a Newton step from
//! working precision.

use super::graph::{Binary, Graph, Id, Leaf, Node, Unary};
use twofloat::TwoFloat;

/// Values of `roots`, or `None` if one of them is not a number. States and parameters are double-double numbers.
pub(super) fn evaluate(
    graph: &Graph,
    roots: &[Id],
    states: &[[f64; 2]],
    parameters: &[[f64; 2]],
) -> Option<Vec<[f64; 2]>> {
    let reached = graph.reachable(roots);
    let mut values = vec![TwoFloat::from(0.0); graph.len()];
    for i in (0..graph.len()).filter(|&i| reached[i]) {
        let of = |id: Id| values[id.at()];
        values[i] = match graph.node(Id(i as u32)) {
            Node::Constant(bits) => f64::from_bits(bits).into(),
            Node::Leaf(Leaf::State(j)) => sum(states[j as usize]),
            Node::Leaf(Leaf::Parameter(k)) => sum(parameters[k as usize]),
            Node::Leaf(Leaf::Direction(..) | Leaf::Time) => 0.0.into(),
            Node::Unary(op, a) => unary(op, of(a)),
            Node::Binary(op, a, b) => binary(op, of(a), of(b)),
            Node::Integer(a, n) => integer_power(of(a), n),
            Node::Select(c, a, b) => of(if of(c) != TwoFloat::from(0.0) { a } else { b }),
        };
    }
    let parts = roots.iter().map(|root| [values[root.at()].hi(), values[root.at()].lo()]);
    let parts: Vec<[f64; 2]> = parts.collect();
    parts.iter().flatten().all(|part| part.is_finite()).then_some(parts)
}

fn sum([high, low]: [f64; 2]) -> TwoFloat {
    TwoFloat::new_add(high, low)
}

fn truth(holds: bool) -> TwoFloat {
    f64::from(u8::from(holds)).into()
}

fn unary(op: Unary, x: TwoFloat) -> TwoFloat {
    let zero = TwoFloat::from(0.0);
    let sign = || truth(x > zero) - truth(x < zero);
    match op {
        Unary::Negate => -x,
        Unary::Sqrt => x.sqrt(),
        Unary::Exp => exp(x),
        Unary::Log => log(x),
        Unary::Sin => sin_cos(x).0,
        Unary::Cos => sin_cos(x).1,
        Unary::Tan => {
            let (sin, cos) = sin_cos(x);
            divide(sin, cos)
        }
        Unary::Asin => {
            let y = x.hi().asin();
            let (sin, cos) = sin_cos(y.into());
            if cos > zero { divide(x - sin, cos) + y } else { y.into() }
        }
        Unary::Acos => {
            let y = x.hi().acos();
            let (sin, cos) = sin_cos(y.into());
            if sin > zero { divide(cos - x, sin) + y } else { y.into() }
        }
        Unary::Atan => atan2(x, 1.0.into()),
        Unary::Sinh => {
            // This form does not cancel near zero.
            let m = exp_m1(x.abs());
            let size = (m + divide(m, m + 1.0)) * 0.5;
            if x < zero { -size } else { size }
        }
        Unary::Cosh => {
            let e = exp(x.abs());
            (e + divide(1.0.into(), e)) * 0.5
        }
        Unary::Tanh => tanh(x),
        Unary::SechSquared => {
            let s = exp(x.abs() * -2.0);
            let d = s + 1.0;
            divide(s * 4.0, d * d)
        }
        Unary::Abs => x.abs(),
        Unary::Sign => sign(),
        Unary::Heaviside => (sign() + 1.0) * 0.5,
        Unary::Floor => {
            let whole = x.hi().floor();
            TwoFloat::from(whole) + if whole == x.hi() { x.lo().floor() } else { 0.0 }
        }
        Unary::Log10 => divide(log(x), log(10.0.into())),
        Unary::Log2 => divide(log(x), twofloat::consts::LN_2),
        Unary::Log1p => log1p(x),
        Unary::Expm1 => exp_m1(x),
        Unary::Cbrt => {
            let y = TwoFloat::from(x.hi().cbrt());
            let rest = divide(x - y * y * y, y * y * 3.0);
            if rest.hi().is_finite() { y + rest } else { y }
        }
        Unary::Asinh => {
            let (size, square) = (x.abs(), x * x);
            let value = log1p(size + divide(square, (square + 1.0).sqrt() + 1.0));
            if x < zero { -value } else { value }
        }
        Unary::Acosh => log(x + ((x - 1.0) * (x + 1.0)).sqrt()),
        Unary::Atanh => log1p(divide(x * 2.0, TwoFloat::from(1.0) - x)) * 0.5,
        Unary::Exprel(order) => exprel(order, x),
    }
}

/// Quotient of the library, corrected once by dividing its remainder.
fn divide(a: TwoFloat, b: TwoFloat) -> TwoFloat {
    let quotient = a / b;
    let rest = (a - quotient * b) / b;
    if rest.hi().is_finite() { quotient + rest } else { (a.hi() / b.hi()).into() }
}

fn integer_power(a: TwoFloat, n: i32) -> TwoFloat {
    let size = a.powi(n.saturating_abs());
    if n < 0 { divide(1.0.into(), size) } else { size }
}

fn exp(x: TwoFloat) -> TwoFloat {
    let k = (x.hi() * std::f64::consts::LOG2_E).round().clamp(-1080.0, 1030.0);
    if k.is_nan() || k == 1030.0 || k == -1080.0 {
        return x.hi().exp().into();
    }
    let half = (0.5 * k).trunc();
    (expm1_small(x - twofloat::consts::LN_2 * k) + 1.0) * half.exp2() * (k - half).exp2()
}

/// Sine and cosine by series about the nearest multiple of a right angle.
fn sin_cos(x: TwoFloat) -> (TwoFloat, TwoFloat) {
    let quarters = (x.hi() / std::f64::consts::FRAC_PI_2).round();
    // Beyond this the nearest multiple cannot be determined.
    if quarters.is_nan() || quarters.abs() > 1e15 {
        return (x.hi().sin().into(), x.hi().cos().into());
    }
    let r = x - twofloat::consts::FRAC_PI_2 * quarters;
    let square = r * r;
    // 1 - r²/(k (k - 1)) (1 - r²/((k - 2) (k - 3)) (…)): the truncation error is below (π/4)³⁰/30!.
    let one = TwoFloat::from(1.0);
    let series = |last: u32| {
        let factors = (2..=last).rev().step_by(2).map(|k| f64::from(k * (k - 1)));
        factors.fold(one, |sum, factor| one - square / factor * sum)
    };
    let (sin, cos) = (r * series(29), series(28));
    match quarters.rem_euclid(4.0) as u8 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Angle in working precision, corrected by the deviation of (a, b) from it.
fn atan2(a: TwoFloat, b: TwoFloat) -> TwoFloat {
    let y = a.hi().atan2(b.hi());
    let (sin, cos) = sin_cos(y.into());
    let rest = divide(a * cos - b * sin, a * sin + b * cos);
    if rest.hi().is_finite() { rest + y } else { y.into() }
}

/// eˣ - 1.
fn exp_m1(x: TwoFloat) -> TwoFloat {
    if x.hi().abs() < 0.4 { expm1_small(x) } else { exp(x) - 1.0 }
}

/// eˣ - 1 for |x| < ½: the series at x / 2⁸, doubled eight times by (1 + m)² - 1 = 2 m + m².
fn expm1_small(x: TwoFloat) -> TwoFloat {
    let r = x / 256.0;
    let mut m = (2..=12).rev().fold(TwoFloat::from(0.0), |sum, n| (sum + 1.0) * r / f64::from(n));
    m = (m + 1.0) * r;
    (0..8).for_each(|_| m = m * 2.0 + m * m);
    m
}

/// log(1 + x), by the series near 0.
fn log1p(x: TwoFloat) -> TwoFloat {
    if x.hi().abs() > 1e-3 {
        return log(x + 1.0);
    }
    let sum = (2..=12).rev().fold(TwoFloat::from(0.0), |sum, n| (TwoFloat::from(1.0) / f64::from(n) - sum) * x);
    x - sum * x
}

/// Derivative of (eˣ - 1)/x of the given order, as in [`super::exprel`].
fn exprel(order: u8, x: TwoFloat) -> TwoFloat {
    let (m, size) = (f64::from(order), x.abs());
    if size.hi() > m + 2.0 || !size.hi().is_finite() {
        let first = divide(exp_m1(x), x);
        return (1..=order).fold(first, |below, k| divide(exp(x) - below * f64::from(k), x));
    }
    let positive = x.hi() >= 0.0;
    let (mut term, mut sum) = (TwoFloat::from(1.0), divide(1.0.into(), (m + 1.0).into()));
    for j in (1..=400).map(f64::from) {
        term = divide(term * size, if positive { j } else { m + j }.into());
        let more = divide(term, (j + m + 1.0).into());
        sum += more;
        if more.hi() < 1e-34 * sum.hi() {
            break;
        }
    }
    if positive { sum } else { sum * exp(x) }
}

/// Logarithm from its value y in working precision: x e^-y differs from 1 by rounding, so its logarithm is a short
/// series.
fn log(x: TwoFloat) -> TwoFloat {
    let y = x.hi().ln();
    if !y.is_finite() {
        return y.into();
    }
    let rest = x * exp(TwoFloat::from(-y)) - 1.0;
    rest * (rest * -0.5 + 1.0) + y
}

/// aᵇ; by multiplication for an integer b.
fn power(a: TwoFloat, b: TwoFloat) -> TwoFloat {
    let whole = b.hi() as i32;
    if b == TwoFloat::from(f64::from(whole)) {
        return integer_power(a, whole);
    }
    if a == TwoFloat::from(0.0) {
        return a.hi().powf(b.hi()).into();
    }
    exp(log(a) * b)
}

/// m / (m + 2) with m = expm1(2|x|), which neither overflows nor cancels.
fn tanh(x: TwoFloat) -> TwoFloat {
    let one = TwoFloat::from(1.0);
    let size = x.abs();
    let value = if size > TwoFloat::from(40.0) {
        one
    } else {
        let m = exp_m1(size * 2.0);
        divide(m, m + 2.0)
    };
    if x < TwoFloat::from(0.0) { -value } else { value }
}

fn binary(op: Binary, a: TwoFloat, b: TwoFloat) -> TwoFloat {
    match op {
        Binary::Add => a + b,
        Binary::Subtract => a - b,
        Binary::Multiply => a * b,
        Binary::Divide => divide(a, b),
        Binary::Power => power(a, b),
        Binary::Atan2 => atan2(a, b),
        Binary::Min => {
            if b < a {
                b
            } else {
                a
            }
        }
        Binary::Max => {
            if b > a {
                b
            } else {
                a
            }
        }
        Binary::Hypot => a.hypot(b),
        Binary::Less => truth(a < b),
        Binary::LessOrEqual => truth(a <= b),
        Binary::Equal => truth(a == b),
        Binary::NotEqual => truth(a != b),
    }
}

#[cfg(test)]
mod tests {
    use crate::contract::{Batch, Parameters, VectorField};
    use crate::model::{Definition, Model, ModelSource, Parameter, State};

    fn model(equation: &str) -> Model {
        Model::compile(ModelSource {
            parameters: vec![Parameter::new("a", 0.3)],
            states: vec![State::new("x")],
            equations: vec![Definition::new("x", equation)],
            ..ModelSource::default()
        })
        .unwrap()
    }

    #[test]
    fn every_function_agrees_with_its_working_precision() {
        let formulas = [
            "sqrt(x)*exp(-x) + log(x)/a",
            "sin(x) + cos(2*x)*tan(x) - asin(a) + acos(a*x)*atan(x)",
            "sinh(x) - cosh(a) + tanh(3*x) + tanh(-100*x) + tanh(1e-9*x)",
            "abs(a - x) + sign(a - x) + heaviside(x) + max(x, a)*min(x, a) + hypot(x, a)",
            "floor(3*x) + log10(x) + log2(x) + log1p(a*x) + expm1(x) + cbrt(x) + cbrt(-a)",
            "asinh(x) - asinh(-a) + acosh(2*x) + atanh(x) + exprel(x) + exprel(-x) + exprel(50*x) + mod(7*x, a)",
            "x^a + a^x + x^7 + x^-3 + atan2(-x, -a) + if(x < a, x, 2*x) + (x >= a) + (x == x)",
        ];
        for formula in formulas {
            let model = model(formula);
            let x = 0.712_345_678_9;
            let mut f = [0.0];
            model.evaluate(
                Batch { lanes: 1, states: &[x], parameters: Parameters::Shared(&[0.3]), times: &[], signs: &[] },
                &mut f,
            );
            let precise = model.evaluate_precisely(&[[x, 0.0]], &[[0.3, 0.0]]).unwrap();
            assert!((precise[0][0] - f[0]).abs() < 1e-14 * (1.0 + f[0].abs()), "{formula}: {precise:?} {f:?}");
        }
    }

    /// Identities whose two sides are computed differently: the difference is the error of the functions.
    #[test]
    fn functions_are_right_far_beyond_working_precision() {
        let identities = [
            "log(exp(x)) - x",
            "exp(log(x)) - x",
            "sin(x)^2 + cos(x)^2 - 1",
            "tan(atan(x)) - x",
            "sin(asin(x/3)) - x/3",
            "cos(acos(x/3)) - x/3",
            "cosh(x)^2 - sinh(x)^2 - 1",
            "sinh(x) - tanh(x)*cosh(x)",
            "(x^a)^(1/a) - x",
            "a^x*a^(-x) - 1",
            "hypot(x, a)^2 - x^2 - a^2",
            "sqrt(x)*sqrt(x) - x",
            "atan2(x, -a) - atan2(a, x) - 2*atan2(a, a)",
            "a/x*x - a",
            "x^-3*x^2*x - 1",
            "10^log10(x) - x",
            "2^log2(x) - x",
            "log1p(expm1(x)) - x",
            "expm1(-log1p(x)) + x/(1 + x)",
            "cbrt(x)^3 - x",
            "sinh(asinh(x)) - x",
            "cosh(acosh(1 + x)) - 1 - x",
            "tanh(atanh(x/4)) - x/4",
            "x*exprel(x) - expm1(x)",
            "exprel(-x)*exp(x) - exprel(x)",
        ];
        for formula in identities {
            let model = model(formula);
            for k in 1..60 {
                let x = f64::from(k) * 0.0473;
                let precise = model.evaluate_precisely(&[[x, 0.0]], &[[0.3, 0.0]]).unwrap();
                assert!(precise[0][0].abs() < 1e-27, "{formula} at {x}: {precise:?}");
            }
        }
    }

    /// (x + a)² - x² - 2ax - a² is zero up to rounding: about 1e-17 in working precision and 1e-33 in twice that.
    #[test]
    fn rounding_errors_are_sixteen_orders_smaller() {
        let model = model("(x + a)^2 - x^2 - 2*a*x - a^2");
        let x = 0.712_345_678_9;
        let precise = model.evaluate_precisely(&[[x, 1e-17]], &[[0.3, 0.0]]).unwrap();
        assert!(precise[0][0].abs() < 1e-30, "{precise:?}");
    }
}
