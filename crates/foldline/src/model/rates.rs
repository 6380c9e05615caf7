//! Quotients that are smooth although they are 0/0 at one point.
//!
//! **Idea.** Ion-channel rates are written u/(1 - exp(w)) with w proportional to u. At u = 0 the formula is undefined
//! although the function is not. It is replaced by the relative exponential of `exprel`, an identical function
//! everywhere else.
//!
//! **Equations.** With e₀(w) = (eʷ - 1)/w:
//!
//! 1. u/(eʷ - 1) = (u/w)/e₀(w), where the vanishing factor of u/w has been cancelled
//! 2. u/(1 - eʷ) = -(u/w)/e₀(w)
//!
//! **Departures.** Recognised if u and w share a factor that is a state, or one up to a constant multiple: 0.1 v + 4
//! and -(v + 40)/10.

use super::graph::{Binary, Graph, Id, Node, Unary};

/// Maximum number of factors examined; products with more are left unchanged.
const MOST_FACTORS: usize = 16;

/// A product of powers ±1 with a sign.
#[derive(Default)]
struct Factors {
    negative: bool,
    above: Vec<Id>,
    below: Vec<Id>,
}

impl Graph {
    /// a / b, in the form of equation 1 or 2 if b contains a difference that vanishes with a.
    pub fn quotient_of_rates(&mut self, a: Id, b: Id) -> Id {
        match self.relative(a, b) {
            Some(quotient) => quotient,
            None => self.divide(a, b),
        }
    }

    fn relative(&mut self, a: Id, b: Id) -> Option<Id> {
        let below = self.factors(b)?;
        let (place, exponent, negative) = below.above.iter().enumerate().find_map(|(place, id)| {
            let (exponent, negative) = self.exponential_less_one(*id)?;
            Some((place, exponent, negative))
        })?;
        let (mut u, w) = (self.factors(a)?, self.factors(exponent)?);
        // Cancel factors of u that are constant multiples of factors of w.
        let (mut ratio, mut left) = (1.0, Vec::new());
        for q in &w.above {
            match u.above.iter().enumerate().find_map(|(i, p)| Some((i, self.ratio(*p, *q)?))) {
                Some((i, own)) => {
                    u.above.remove(i);
                    ratio *= own;
                }
                None => left.push(*q),
            }
        }
        if left.len() == w.above.len() {
            return None;
        }
        // (rest of u / rest of w) / (rest of b), then the relative exponential.
        let others = below.above.iter().enumerate().filter(|(k, _)| *k != place).map(|(_, id)| *id).collect();
        let above = [u.above, w.below, below.below].concat();
        let under = [left, u.below, others].concat();
        let negative = negative ^ below.negative ^ u.negative ^ w.negative;
        let sign = if negative { -ratio } else { ratio };
        let mut quotient = self.constant(sign);
        for factor in above {
            quotient = self.multiply(quotient, factor);
        }
        for factor in under {
            quotient = self.divide(quotient, factor);
        }
        let relative = self.unary(Unary::Exprel(0), exponent);
        Some(self.divide(quotient, relative))
    }

    /// w of eʷ - 1, and true if the expression is 1 - eʷ.
    fn exponential_less_one(&self, id: Id) -> Option<(Id, bool)> {
        let exponent = |id: Id| match self.node(id) {
            Node::Unary(Unary::Exp, w) => Some(w),
            _ => None,
        };
        match self.node(id) {
            Node::Unary(Unary::Expm1, w) => Some((w, false)),
            Node::Binary(Binary::Subtract, x, y) if self.is(y, 1.0) => Some((exponent(x)?, false)),
            Node::Binary(Binary::Subtract, x, y) if self.is(x, 1.0) => Some((exponent(y)?, true)),
            Node::Binary(Binary::Add, x, y) if self.is(y, -1.0) => Some((exponent(x)?, false)),
            Node::Binary(Binary::Add, x, y) if self.is(x, -1.0) => Some((exponent(y)?, false)),
            _ => None,
        }
    }

    /// Factors of a product or quotient.
    fn factors(&self, id: Id) -> Option<Factors> {
        let mut factors = Factors::default();
        let mut wait = vec![(id, true)];
        while let Some((id, above)) = wait.pop() {
            match self.node(id) {
                Node::Unary(Unary::Negate, a) => {
                    factors.negative = !factors.negative;
                    wait.push((a, above));
                }
                Node::Binary(Binary::Multiply, a, b) => wait.extend([(b, above), (a, above)]),
                Node::Binary(Binary::Divide, a, b) => wait.extend([(b, !above), (a, above)]),
                _ if above => factors.above.push(id),
                _ => factors.below.push(id),
            }
            if factors.above.len() + factors.below.len() + wait.len() > MOST_FACTORS {
                return None;
            }
        }
        Some(factors)
    }

    /// r with p = r q, if the form of the two shows it.
    fn ratio(&self, p: Id, q: Id) -> Option<f64> {
        let ([a, b], x) = self.straight(p)?;
        let ([c, d], y) = self.straight(q)?;
        // Decimal constants are rounded: 0.1 · 40 and 4 may differ in the last digit.
        let (across, back) = (b * c, a * d);
        (x == y && (across - back).abs() <= 4.0 * f64::EPSILON * across.abs()).then_some(a / c)
    }

    /// [a, b] and x such that the node is a x + b, for a varying node; x is a node, or the difference of two.
    fn straight(&self, id: Id) -> Option<([f64; 2], [Id; 2])> {
        let (mut slope, mut shift, mut at) = (1.0, 0.0, id);
        for _ in 0..MOST_FACTORS {
            let (a, b, next) = match self.node(at) {
                Node::Constant(_) => return None,
                Node::Unary(Unary::Negate, x) => (-1.0, 0.0, x),
                Node::Binary(op, x, y) => match (op, self.value(x), self.value(y)) {
                    (Binary::Add, None, Some(b)) => (1.0, b, x),
                    (Binary::Add, Some(b), None) => (1.0, b, y),
                    (Binary::Subtract, None, Some(b)) => (1.0, -b, x),
                    (Binary::Subtract, Some(b), None) => (-1.0, b, y),
                    (Binary::Multiply, None, Some(a)) => (a, 0.0, x),
                    (Binary::Multiply, Some(a), None) => (a, 0.0, y),
                    (Binary::Divide, None, Some(a)) => (1.0 / a, 0.0, x),
                    _ => break,
                },
                _ => break,
            };
            (shift, slope, at) = (shift + slope * b, slope * a, next);
        }
        let x = match self.node(at) {
            Node::Binary(Binary::Subtract, x, y) if x > y => {
                slope = -slope;
                [y, x]
            }
            Node::Binary(Binary::Subtract, x, y) => [x, y],
            _ => [at; 2],
        };
        (slope != 0.0 && slope.is_finite() && shift.is_finite()).then_some(([slope, shift], x))
    }
}

#[cfg(test)]
mod tests {
    use crate::contract::{Batch, Parameters, VectorField};
    use crate::model::{Definition, Model, ModelSource, Parameter, State};

    fn value(formula: &str, v: f64) -> [f64; 2] {
        let model = Model::compile(ModelSource {
            parameters: vec![Parameter::new("k", 0.5), Parameter::new("w", 20.0)],
            states: vec![State::new("v")],
            equations: vec![Definition::new("v", formula)],
            ..ModelSource::default()
        })
        .unwrap();
        let (mut f, mut fx) = ([0.0], [0.0]);
        let at = Batch { lanes: 1, states: &[v], parameters: Parameters::Shared(&[0.5, 20.0]), times: &[], signs: &[] };
        model.linearise(at, &[], &mut f, &mut fx, &mut []);
        [f[0], fx[0]]
    }

    /// f and f' of u/(1 - e⁻ᵘ) at 0 are 1 and ½.
    #[test]
    fn rates_have_values_where_they_are_written_as_zero_over_zero() {
        let cases = [
            // formula, where it is 0/0, value and slope there
            ("0.1*(v + 40)/(1 - exp(-(v + 40)/10))", -40.0, [1.0, 0.05]),
            ("(0.1*v + 4)/(1 - exp(-0.1*v - 4))", -40.0, [1.0, 0.05]),
            ("0.1*(25 - v)/(exp((25 - v)/10) - 1)", 25.0, [1.0, 0.05]),
            ("(v + 40)/(10*(1 - exp((-v - 40)/10)))", -40.0, [1.0, 0.05]),
            ("k*(v - w)/(1 - exp((w - v)/10))", 20.0, [5.0, 0.25]),
            ("-k*(v - w)/(exp((w - v)/w) - 1)", 20.0, [10.0, 0.25]),
            ("v/(exp(v) - 1)", 0.0, [1.0, -0.5]),
            ("2*v/expm1(v)", 0.0, [2.0, -1.0]),
            ("k*(v + 40)/(1 - exp(-k*(v + 40)))", -40.0, [1.0, 0.25]),
            ("k*v/(k*(1 - exp(-2*v))*3)", 0.0, [1.0 / 6.0, 1.0 / 6.0]),
        ];
        for (formula, place, expected) in cases {
            let found = value(formula, place);
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-14, "{formula}: {found} {expected}");
            }
        }
    }

    #[test]
    fn elsewhere_rates_equal_the_written_formula() {
        for v in [-80.0f64, -41.0, -39.9, 0.0, 60.0] {
            let expected = 0.1 * (v + 40.0) / (1.0 - (-(v + 40.0) / 10.0).exp());
            let found = value("0.1*(v + 40)/(1 - exp(-(v + 40)/10))", v)[0];
            assert!((found / expected - 1.0).abs() < 1e-13, "{v}: {found} {expected}");
        }
    }

    #[test]
    fn quotients_without_a_common_zero_are_unchanged() {
        assert!(value("(v + 39)/(1 - exp(-(v + 40)/10))", -40.0)[0].is_infinite());
        assert!(value("v/(2 - exp(v))", 2.0f64.ln())[0].abs() > 1e10);
    }
}
