//! Reference evaluation of a formula and its derivative, slow and simple.
//!
//! **Idea.** Recursion over the tree, with value and derivative together. The effect of rounding is measured: every
//! operation perturbs its result in the thirteenth digit, and the spread of several such runs estimates the rounding
//! error.

use crate::formula::{Formula, ONE, OPERATORS, TWO};

/// Value and derivative of a formula.
#[derive(Clone, Copy, Debug)]
pub struct Dual {
    /// Value.
    pub value: f64,
    /// Derivative; `None` if the value does not depend on the variable of differentiation.
    pub slope: Option<f64>,
}

/// True if a number is zero or in the range in which rounding errors are relative.
fn sound(x: f64) -> bool {
    x == 0.0 || (1e-280..1e280).contains(&x.abs())
}

/// Returns the product, or NaN if it underflows to zero.
fn product(a: f64, b: f64) -> f64 {
    if a * b == 0.0 && a != 0.0 && b != 0.0 { f64::NAN } else { a * b }
}

/// Relative perturbation of the result of an operation.
const WOBBLE: f64 = 1e-13;

/// Evaluation of formulas.
pub struct Reference<'a> {
    /// Values of the names, in the order of their indices.
    pub names: &'a [Dual],
    /// State of the random numbers that perturb the operations; 0 for no perturbation.
    pub disturbed: u64,
}

impl Reference<'_> {
    /// Evaluates a formula; `None` if an intermediate result is not finite or so small that rounding errors are not
    /// relative.
    pub fn of(&mut self, formula: &Formula) -> Option<Dual> {
        let dual = self.plain(formula)?;
        let sound = sound(dual.value) && dual.slope.is_none_or(sound);
        sound.then(|| match formula {
            Formula::Number(_) | Formula::Name(_) => dual,
            _ => Dual { value: self.disturb(dual.value), slope: dual.slope.map(|s| self.disturb(s)) },
        })
    }

    /// True if the formula depends on the variable of differentiation.
    fn moves(&self, formula: &Formula) -> bool {
        match formula {
            Formula::Number(_) => false,
            Formula::Name(i) => self.names[*i].slope.is_some(),
            Formula::Negative(a) => self.moves(a),
            Formula::One(i, a) => !matches!(ONE[*i], "sign" | "heaviside") && self.moves(a),
            Formula::Infix(i, list) => OPERATORS[*i].1 > 1 && list.iter().any(|a| self.moves(a)),
            Formula::Two(_, list) => list.iter().any(|a| self.moves(a)),
            Formula::If(list) => list[1..].iter().any(|a| self.moves(a)),
        }
    }

    fn disturb(&mut self, x: f64) -> f64 {
        if self.disturbed == 0 {
            return x;
        }
        self.disturbed = self.disturbed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        x * (1.0 + WOBBLE * ((self.disturbed >> 40) as f64 / (1u64 << 23) as f64 - 1.0))
    }

    fn plain(&mut self, formula: &Formula) -> Option<Dual> {
        Some(match formula {
            Formula::Number(value) => Dual { value: *value, slope: None },
            Formula::Name(i) => self.names[*i],
            Formula::Negative(a) => {
                let a = self.of(a)?;
                Dual { value: -a.value, slope: a.slope.map(|s| -s) }
            }
            Formula::If(list) => {
                let condition = self.of(&list[0])?;
                let taken = self.of(&list[if condition.value != 0.0 { 1 } else { 2 }])?;
                chosen(taken, self.moves(&list[1]) || self.moves(&list[2]))
            }
            Formula::One(i, a) => {
                let a = self.of(a)?;
                one(ONE[*i], a)
            }
            Formula::Two(i, list) => {
                let (a, b) = (self.of(&list[0])?, self.of(&list[1])?);
                // On its branch cut, atan2 depends on the sign of zero, which formulas do not preserve.
                if TWO[*i] == "atan2" && a.value == 0.0 && b.value <= 0.0 {
                    return None;
                }
                two(TWO[*i], a, b)
            }
            Formula::Infix(i, list) => {
                let (a, b) = (self.of(&list[0])?, self.of(&list[1])?);
                let whole = constant(&list[1]);
                infix(OPERATORS[*i].0, a, b, whole)
            }
        })
    }
}

/// Returns the value of a formula without names.
fn constant(formula: &Formula) -> Option<f64> {
    fn named(formula: &Formula) -> bool {
        match formula {
            Formula::Number(_) => false,
            Formula::Name(_) => true,
            Formula::Negative(a) | Formula::One(_, a) => named(a),
            Formula::Infix(_, list) | Formula::Two(_, list) => list.iter().any(named),
            Formula::If(list) => list.iter().any(named),
        }
    }
    let value = |formula| Reference { names: &[], disturbed: 0 }.of(formula).map(|dual| dual.value);
    if named(formula) { None } else { value(formula) }
}

/// Result of a choice. A constant chosen among values of which one is variable has the derivative 0.
fn chosen(taken: Dual, moves: bool) -> Dual {
    Dual { slope: taken.slope.or(moves.then_some(0.0)), ..taken }
}

fn one(function: &str, a: Dual) -> Dual {
    let x = a.value;
    let (value, slope) = match function {
        "+" => (x, 1.0),
        "sqrt" if a.slope == Some(0.0) => (x.sqrt(), 0.0),
        "sqrt" => (x.sqrt(), 0.5 / x.sqrt()),
        "exp" if x < -600.0 => (f64::NAN, f64::NAN),
        "exp" => (x.exp(), x.exp()),
        "log" => (x.ln(), 1.0 / x),
        "sin" => (x.sin(), x.cos()),
        "cos" => (x.cos(), -x.sin()),
        "tan" => (x.tan(), 1.0 + x.tan() * x.tan()),
        "asin" => (x.asin(), 1.0 / ((1.0 - x) * (1.0 + x)).sqrt()),
        "acos" => (x.acos(), -1.0 / ((1.0 - x) * (1.0 + x)).sqrt()),
        "atan" => (x.atan(), 1.0 / (1.0 + x * x)),
        "sinh" => (x.sinh(), x.cosh()),
        "cosh" => (x.cosh(), x.sinh()),
        "tanh" => (x.tanh(), 4.0 * (-2.0 * x.abs()).exp() / (1.0 + (-2.0 * x.abs()).exp()).powi(2)),
        "abs" => (x.abs(), sign(x)),
        "sign" => (sign(x), 0.0),
        "heaviside" => (0.5 * (1.0 + sign(x)), 0.0),
        "log10" => (x.log10(), 1.0 / (x * std::f64::consts::LN_10)),
        "expm1" if x < -600.0 => (f64::NAN, f64::NAN),
        "expm1" => (x.exp_m1(), x.exp()),
        "asinh" => (x.asinh(), 1.0 / (1.0 + x * x).sqrt()),
        other => unreachable!("{other}"),
    };
    Dual { value, slope: a.slope.map(|s| product(slope, s)) }
}

fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// Returns the derivative p da + q db with its value; terms without derivative are left out.
fn combined(value: f64, (p, a): (f64, Dual), (q, b): (f64, Dual)) -> Dual {
    let parts = [a.slope.map(|s| product(p, s)), b.slope.map(|s| product(q, s))];
    let slope = parts.into_iter().flatten().reduce(|x, y| x + y);
    Dual { value, slope }
}

fn two(function: &str, a: Dual, b: Dual) -> Dual {
    let (x, y) = (a.value, b.value);
    match function {
        "min" => chosen(if x <= y { a } else { b }, a.slope.or(b.slope).is_some()),
        "max" => chosen(if y <= x { a } else { b }, a.slope.or(b.slope).is_some()),
        "hypot" => {
            let r = x.hypot(y);
            let cosine = |z: f64| if r > 0.0 { z / r } else { 0.0 };
            combined(r, (cosine(x), a), (cosine(y), b))
        }
        "atan2" => {
            let square = if sound(x * x + y * y) { x * x + y * y } else { f64::NAN };
            combined(x.atan2(y), (y / square, a), (-x / square, b))
        }
        other => unreachable!("{other}"),
    }
}

/// Applies an infix operator; `whole` is the exponent if it is constant.
fn infix(symbol: &str, a: Dual, b: Dual, whole: Option<f64>) -> Dual {
    let (x, y) = (a.value, b.value);
    let truth = |holds: bool| Dual { value: f64::from(u8::from(holds)), slope: None };
    match symbol {
        "<" => truth(x < y),
        "<=" => truth(x <= y),
        ">" => truth(x > y),
        ">=" => truth(x >= y),
        "==" => truth(x == y),
        "!=" => truth(x != y),
        "+" => combined(x + y, (1.0, a), (1.0, b)),
        "-" => combined(x - y, (1.0, a), (-1.0, b)),
        "*" => combined(product(x, y), (y, a), (x, b)),
        "/" => {
            let over = |a: Dual| Dual { slope: a.slope.map(|s| product(s, 1.0 / y)), ..a };
            combined(x / y, (1.0, over(a)), (-x / y, over(b)))
        }
        "^" => {
            let power = if x.powf(y) == 0.0 && x != 0.0 { f64::NAN } else { x.powf(y) };
            let by_base = if whole == Some(0.0) { 0.0 } else { y * x.powf(y - 1.0) };
            let by_exponent = if power == 0.0 { 0.0 } else { power * x.ln() };
            combined(power, (by_base, a), (by_exponent, b))
        }
        other => unreachable!("{other}"),
    }
}
