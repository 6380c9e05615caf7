//! Exact law of a smoothed one: the limit in which the sharpness of a smoothing parameter grows without bound.
//!
//! **Idea.** Each node of the expression graph is replaced by its leading term in the sharpness K, from its operands on.
//! Smooth steps and corners have terms that grow with K within them, and lose them: what is left is the law that they
//! approach.
//!
//! **Equations.** K → ∞, g without K:
//!
//! ```text
//!   (1)  tanh(K g) → sign(g),   atan(K g) → (π/2) sign(g),   max(-a, min(K g, a)) → a sign(g)
//!   (2)  1/(1 + exp(-K g)) → heaviside(g),   log(1 + exp(K g))/K → max(g, 0),   log(cosh(K g))/K → |g|
//!   (3)  √(g² + 1/K²), hypot(g, 1/K) → |g|,   g/(|g| + 1/K), g/√(g² + 1/K²) → sign(g)
//! ```
//!
//! With a parameter ε = 1/K that goes to zero the orders are reversed.
//!
//! **Departures.** A node is a single term c Kᵖ, or a sum of exponentials. Where that does not suffice (leading terms that
//! cancel, a pulse such as sech², a leading coefficient that vanishes beside a surface within a step) there is no limit.
//!
//! **Fails when** a right-hand side grows with K.

use super::compile::Compiled;
use super::error::{Field, Item, ModelError};
use super::events::Lowered;
use super::graph::{Binary, Graph, Id, Leaf, Node, Unary};
use super::source::{Parameter, Smoothing};
use std::f64::consts::FRAC_PI_2;

/// Leading term of a node.
#[derive(Clone, Debug)]
enum Form {
    /// `coefficient` K^`order`. `patchy`: the coefficient may vanish on one side of a surface, and a lower term was left out.
    Term { coefficient: Id, order: f64, patchy: bool },
    /// Σ exp(K^`order` g) over the exponents g, of which a finite term has the exponent 0.
    Exponentials { order: f64, exponents: Vec<Id>, finite: Option<Id> },
    /// K g, bounded on one side: from above if `above`.
    Bounded { g: Id, bound: f64, above: bool },
    /// Not known, and why.
    Unknown(&'static str),
}

const CANCELS: &str = "terms that grow with it cancel";
const FUNCTION: &str = "a function without a known limit is applied to a term that grows with it";
const PATCHY: &str = "a step is applied to a term that grows with it on one side of a surface only";
const EXPONENTIAL: &str = "an exponential that grows with it is neither part of a logarithm nor a denominator";

/// Expressions of a model in the limit of a parameter: zero if `to_zero`, otherwise infinity.
///
/// # Errors
/// The reason why there is no limit.
pub(super) fn limit(compiled: &Compiled, parameter: usize, to_zero: bool) -> Result<Compiled, &'static str> {
    let mut limits = Limits { graph: compiled.graph.clone(), forms: Vec::new() };
    let sharpness = Leaf::Parameter(parameter as u32);
    for k in 0..compiled.graph.len() {
        let node = compiled.graph.node(Id(k as u32));
        let form = match node {
            Node::Leaf(leaf) if leaf == sharpness => {
                let one = limits.graph.constant(1.0);
                Form::Term { coefficient: one, order: if to_zero { -1.0 } else { 1.0 }, patchy: false }
            }
            _ => limits.of(Id(k as u32), node),
        };
        limits.forms.push(form);
    }
    let list = |limits: &mut Limits, ids: &[Id]| ids.iter().map(|id| limits.value(*id)).collect::<Result<Vec<_>, _>>();
    let field = list(&mut limits, &compiled.field)?;
    let outputs = list(&mut limits, &compiled.outputs)?;
    let period = compiled.period.map(|id| limits.value(id)).transpose()?;
    let mut events = Vec::with_capacity(compiled.events.len());
    for own in &compiled.events {
        events.push(Lowered {
            when: limits.value(own.when)?,
            direction: own.direction,
            set: list(&mut limits, &own.set)?,
            allowed: own.allowed.map(|id| limits.value(id)).transpose()?,
        });
    }
    let graph = limits.graph;
    Ok(Compiled { graph, field, period, outputs, events, conditions: Default::default(), whirl: compiled.whirl })
}

/// Index of the parameter that makes a smoothed law sharp.
///
/// # Errors
/// The mistake, if there is no such parameter or f does not depend on it.
pub(super) fn sharpness(
    own: &Smoothing,
    parameters: &[Parameter],
    compiled: &Compiled,
) -> Result<usize, Vec<ModelError>> {
    let wrong = |message: String, hint: &str| {
        let (item, field, name, hint) = (Item::Smoothing, Field::Name, own.parameter.clone(), hint.to_string());
        vec![ModelError { item, field, name, span: None, message, hint }]
    };
    let Some(index) = parameters.iter().position(|known| known.name == own.parameter) else {
        let message = format!("`smoothing` names `{}`, which is not a parameter", own.parameter);
        return Err(wrong(message, "name the parameter whose growth makes the smoothed law sharp"));
    };
    let reached = compiled.graph.reachable(&compiled.field);
    let here = |k: usize| compiled.graph.node(Id(k as u32)) == Node::Leaf(Leaf::Parameter(index as u32));
    if !(0..reached.len()).any(|k| reached[k] && here(k)) {
        let message = format!("no equation depends on `{}`, which `smoothing` names", own.parameter);
        return Err(wrong(message, "name the parameter whose growth makes the smoothed law sharp"));
    }
    Ok(index)
}

struct Limits {
    graph: Graph,
    /// One for each node of the original graph.
    forms: Vec<Form>,
}

impl Limits {
    fn form(&self, id: Id) -> Form {
        self.forms[id.at()].clone()
    }

    /// The limit of a root.
    fn value(&mut self, id: Id) -> Result<Id, &'static str> {
        match self.form(id) {
            Form::Term { coefficient, order, .. } if order == 0.0 || self.graph.is(coefficient, 0.0) => Ok(coefficient),
            Form::Term { order, .. } if order < 0.0 => Ok(self.graph.constant(0.0)),
            Form::Term { .. } | Form::Bounded { .. } => Err("a right-hand side grows with it"),
            Form::Exponentials { .. } => Err(EXPONENTIAL),
            Form::Unknown(why) => Err(why),
        }
    }

    fn term(&self, coefficient: Id, order: f64, patchy: bool) -> Form {
        let order = if self.graph.is(coefficient, 0.0) { 0.0 } else { order };
        Form::Term { coefficient, order, patchy }
    }

    /// True if a coefficient may vanish on one side of a surface.
    fn is_piecewise(&self, id: Id) -> bool {
        let steps = |node: Node| {
            matches!(
                node,
                Node::Unary(Unary::Sign | Unary::Heaviside | Unary::Floor, _)
                    | Node::Binary(
                        Binary::Min
                            | Binary::Max
                            | Binary::Less
                            | Binary::LessOrEqual
                            | Binary::Equal
                            | Binary::NotEqual,
                        ..
                    )
                    | Node::Select(..)
            )
        };
        let reached = self.graph.reachable(&[id]);
        (0..reached.len()).any(|k| reached[k] && steps(self.graph.node(Id(k as u32))))
    }

    /// The leading term of a node, from those of its operands.
    fn of(&mut self, id: Id, node: Node) -> Form {
        let operands: Vec<Form> = node.operands().map(|id| self.form(id)).collect();
        if let Some(Form::Unknown(why)) = operands.iter().find(|own| matches!(own, Form::Unknown(_))) {
            return Form::Unknown(why);
        }
        let same = |own: (Id, &Form)| matches!(own.1, Form::Term { coefficient, order, .. } if *coefficient == own.0 && *order == 0.0);
        if node.operands().zip(&operands).all(same) {
            return self.term(id, 0.0, false);
        }
        match node {
            Node::Constant(_) | Node::Leaf(_) => self.term(id, 0.0, false),
            Node::Unary(op, _) => self.unary(op, &operands[0]),
            Node::Integer(_, n) => match operands[0] {
                Form::Term { coefficient, order, patchy } => {
                    let power = self.graph.integer(coefficient, n);
                    self.term(power, order * f64::from(n), patchy)
                }
                _ => Form::Unknown(FUNCTION),
            },
            Node::Binary(op, ..) => self.binary(op, &operands[0], &operands[1]),
            Node::Select(..) => self.select(&operands),
        }
    }

    fn unary(&mut self, op: Unary, a: &Form) -> Form {
        let (c, order, patchy) = match a {
            Form::Term { coefficient, order, patchy } => (*coefficient, *order, *patchy),
            Form::Exponentials { order, exponents, finite } => {
                return self.of_exponentials(op, *order, exponents, *finite);
            }
            _ => return Form::Unknown(FUNCTION),
        };
        let (zero, grows) = (self.graph.constant(0.0), order > 0.0);
        let jumps = matches!(op, Unary::Sign | Unary::Heaviside);
        let steps = matches!(op, Unary::Tanh | Unary::Atan | Unary::Exp | Unary::Cosh);
        if patchy && (jumps || grows && steps) {
            return Form::Unknown(PATCHY);
        }
        match op {
            Unary::Negate | Unary::Abs => {
                let own = self.graph.unary(op, c);
                self.term(own, order, patchy)
            }
            Unary::Sign | Unary::Heaviside => {
                let own = self.graph.unary(op, c);
                self.term(own, 0.0, false)
            }
            Unary::Sqrt | Unary::Cbrt => {
                let own = if op == Unary::Sqrt { self.root(c) } else { self.graph.unary(op, c) };
                self.term(own, order / if op == Unary::Sqrt { 2.0 } else { 3.0 }, patchy)
            }
            _ if order == 0.0 => {
                let own = self.graph.unary(op, c);
                self.term(own, 0.0, patchy)
            }
            Unary::Tanh | Unary::Atan if grows => {
                let (sign, size) = (self.graph.unary(Unary::Sign, c), if op == Unary::Tanh { 1.0 } else { FRAC_PI_2 });
                let size = self.graph.constant(size);
                let own = self.graph.multiply(size, sign);
                self.term(own, 0.0, false)
            }
            Unary::Exp if grows => Form::Exponentials { order, exponents: vec![c], finite: None },
            Unary::Cosh if grows => {
                let other = self.graph.negate(c);
                Form::Exponentials { order, exponents: vec![c, other], finite: None }
            }
            // Small arguments.
            Unary::Sin
            | Unary::Tan
            | Unary::Asin
            | Unary::Atan
            | Unary::Sinh
            | Unary::Tanh
            | Unary::Asinh
            | Unary::Atanh
            | Unary::Expm1
            | Unary::Log1p
                if !grows =>
            {
                self.term(c, order, patchy)
            }
            Unary::Cos | Unary::Cosh | Unary::Exp | Unary::SechSquared | Unary::Exprel(0) if !grows => {
                let one = self.graph.unary(op, zero);
                self.term(one, 0.0, false)
            }
            _ => Form::Unknown(FUNCTION),
        }
    }

    /// √c, which is |g| for c = g².
    fn root(&mut self, c: Id) -> Id {
        match self.graph.node(c) {
            Node::Integer(g, 2) => self.graph.unary(Unary::Abs, g),
            Node::Binary(Binary::Multiply, g, h) if g == h => self.graph.unary(Unary::Abs, g),
            _ => self.graph.unary(Unary::Sqrt, c),
        }
    }

    fn of_exponentials(&mut self, op: Unary, order: f64, exponents: &[Id], finite: Option<Id>) -> Form {
        match op {
            Unary::Log | Unary::Log1p => {
                // The finite term, or 1, is exp(0).
                let with_zero = finite.is_some() || op == Unary::Log1p;
                let zero = self.graph.constant(0.0);
                let mut all = exponents.iter().copied().chain(with_zero.then_some(zero));
                let first = all.next().unwrap_or(zero);
                let rest: Vec<Id> = all.collect();
                let most = rest.into_iter().fold(first, |most, g| self.larger(most, g));
                self.term(most, order, with_zero)
            }
            _ => Form::Unknown(EXPONENTIAL),
        }
    }

    /// max(a, b), as |a| where b = -a.
    fn larger(&mut self, a: Id, b: Id) -> Id {
        if self.graph.negate(a) == b { self.graph.unary(Unary::Abs, a) } else { self.graph.binary(Binary::Max, a, b) }
    }

    fn binary(&mut self, op: Binary, a: &Form, b: &Form) -> Form {
        match (op, a, b) {
            (_, Form::Term { .. }, Form::Term { .. }) => self.of_terms(op, a, b),
            (Binary::Min | Binary::Max, Form::Bounded { g, bound, above }, other)
            | (Binary::Min | Binary::Max, other, Form::Bounded { g, bound, above }) => {
                let limit = match other {
                    Form::Term { coefficient, order: 0.0, .. } => self.graph.value(*coefficient),
                    _ => None,
                };
                match limit {
                    Some(limit) if (op == Binary::Max) == *above && (limit < *bound) == *above => {
                        let [low, high] = if *above { [limit, *bound] } else { [*bound, limit] };
                        self.step(*g, low, high)
                    }
                    _ => Form::Unknown(FUNCTION),
                }
            }
            (Binary::Add, Form::Exponentials { .. }, _) | (Binary::Add, _, Form::Exponentials { .. }) => {
                self.sum_of_exponentials(a, b)
            }
            (Binary::Multiply, Form::Exponentials { .. }, Form::Term { .. })
            | (Binary::Multiply, Form::Term { .. }, Form::Exponentials { .. }) => {
                let (own, factor) = if matches!(a, Form::Exponentials { .. }) { (a, b) } else { (b, a) };
                // A factor does not change which exponential is the largest.
                match (own, factor) {
                    (Form::Exponentials { finite: None, .. }, Form::Term { coefficient, .. })
                        if self.graph.value(*coefficient).is_some_and(|v| v > 0.0) =>
                    {
                        own.clone()
                    }
                    _ => Form::Unknown(EXPONENTIAL),
                }
            }
            (Binary::Divide, Form::Term { .. }, Form::Exponentials { order, exponents, finite }) => {
                let [g] = exponents[..] else { return Form::Unknown(EXPONENTIAL) };
                match (a, finite) {
                    // n / (c + exp(K g)): n/c where g < 0, else 0.
                    (Form::Term { coefficient, order: 0.0, .. }, Some(c)) => {
                        let off = self.graph.negate(g);
                        let on = self.graph.unary(Unary::Heaviside, off);
                        let ratio = self.graph.divide(*coefficient, *c);
                        let own = self.graph.multiply(ratio, on);
                        self.term(own, 0.0, false)
                    }
                    (Form::Term { coefficient, .. }, None)
                        if self.graph.value(*coefficient).is_some_and(|v| v > 0.0) =>
                    {
                        let inverse = self.graph.negate(g);
                        Form::Exponentials { order: *order, exponents: vec![inverse], finite: None }
                    }
                    _ => Form::Unknown(EXPONENTIAL),
                }
            }
            (Binary::Divide, Form::Exponentials { finite: Some(_), .. }, Form::Term { .. }) => {
                Form::Unknown(EXPONENTIAL)
            }
            (Binary::Divide, Form::Exponentials { .. }, Form::Term { coefficient, .. })
                if self.graph.value(*coefficient).is_some_and(|v| v > 0.0) =>
            {
                a.clone()
            }
            _ => Form::Unknown(EXPONENTIAL),
        }
    }

    /// `low` where g < 0, `high` where g > 0.
    fn step(&mut self, g: Id, low: f64, high: f64) -> Form {
        let [middle, half] = [0.5 * (low + high), 0.5 * (high - low)].map(|v| self.graph.constant(v));
        let sign = self.graph.unary(Unary::Sign, g);
        let jump = self.graph.multiply(half, sign);
        let own = self.graph.add(middle, jump);
        self.term(own, 0.0, false)
    }

    fn sum_of_exponentials(&mut self, a: &Form, b: &Form) -> Form {
        let (mut order, mut exponents, mut finite) = (None, Vec::new(), None);
        for own in [a, b] {
            match own {
                Form::Exponentials { order: p, exponents: all, finite: own } => {
                    if order.is_some_and(|known| known != *p) {
                        return Form::Unknown(EXPONENTIAL);
                    }
                    order = Some(*p);
                    exponents.extend(all.iter().copied());
                    finite = match (finite, *own) {
                        (Some(x), Some(y)) => Some(self.graph.add(x, y)),
                        (x, y) => x.or(y),
                    };
                }
                // The logarithm needs a positive term.
                Form::Term { coefficient, order: 0.0, .. }
                    if self.graph.value(*coefficient).is_some_and(|v| v > 0.0) =>
                {
                    finite = Some(finite.map_or(*coefficient, |known| self.graph.add(known, *coefficient)));
                }
                _ => return Form::Unknown(EXPONENTIAL),
            }
        }
        Form::Exponentials { order: order.unwrap_or(1.0), exponents, finite }
    }

    fn of_terms(&mut self, op: Binary, a: &Form, b: &Form) -> Form {
        let (
            Form::Term { coefficient: x, order: p, patchy: one },
            Form::Term { coefficient: y, order: q, patchy: other },
        ) = (a, b)
        else {
            return Form::Unknown(FUNCTION);
        };
        let ((x, p), (y, q), patchy) = ((*x, *p), (*y, *q), *one || *other);
        let (no_x, no_y) = (self.graph.is(x, 0.0), self.graph.is(y, 0.0));
        // Zero has any order.
        let (p, q) = (if no_x { q } else { p }, if no_y { p } else { q });
        match op {
            Binary::Multiply => {
                let own = self.graph.multiply(x, y);
                self.term(own, p + q, patchy)
            }
            Binary::Divide if *other && q != 0.0 => Form::Unknown(PATCHY),
            Binary::Divide => {
                let own = self.quotient(x, y);
                self.term(own, if no_x { 0.0 } else { p - q }, patchy)
            }
            Binary::Add | Binary::Subtract if p == q => {
                let own = self.graph.binary(op, x, y);
                match self.graph.is(own, 0.0) && !no_x {
                    true => Form::Unknown(CANCELS),
                    false => self.term(own, p, patchy),
                }
            }
            Binary::Add | Binary::Subtract => {
                let (mut own, order) = if p > q { (x, p) } else { (y, q) };
                if p < q && op == Binary::Subtract {
                    own = self.graph.negate(own);
                }
                // Small terms beside finite ones are no loss where what follows is continuous.
                let patchy = patchy || order > 0.0 && self.is_piecewise(own);
                self.term(own, order, patchy)
            }
            Binary::Hypot => {
                let own = match p.total_cmp(&q) {
                    std::cmp::Ordering::Equal => self.graph.binary(op, x, y),
                    std::cmp::Ordering::Greater => self.graph.unary(Unary::Abs, x),
                    std::cmp::Ordering::Less => self.graph.unary(Unary::Abs, y),
                };
                self.term(own, p.max(q), patchy)
            }
            Binary::Min | Binary::Max if p == q => {
                let own = self.graph.binary(op, x, y);
                self.term(own, p, patchy)
            }
            Binary::Min | Binary::Max => {
                let (g, order, bound, lower) = if p > q { (x, p, y, q) } else { (y, q, x, p) };
                match self.graph.value(bound) {
                    Some(bound) if order > 0.0 && lower == 0.0 && !patchy => {
                        Form::Bounded { g, bound, above: op == Binary::Min }
                    }
                    _ if order <= 0.0 => {
                        let zero = self.graph.constant(0.0);
                        let [x, y] = [(x, p), (y, q)].map(|(own, p)| if p < order { zero } else { own });
                        let own = self.graph.binary(op, x, y);
                        self.term(own, order, patchy)
                    }
                    _ => Form::Unknown(FUNCTION),
                }
            }
            Binary::Less | Binary::LessOrEqual => {
                if patchy {
                    return Form::Unknown(PATCHY);
                }
                let zero = self.graph.constant(0.0);
                let [x, y] = [(x, p), (y, q)].map(|(own, r)| if r < p.max(q) { zero } else { own });
                let own = self.graph.binary(op, x, y);
                self.term(own, 0.0, false)
            }
            Binary::Power if p == 0.0 && q == 0.0 => {
                let own = self.graph.binary(op, x, y);
                self.term(own, 0.0, patchy)
            }
            Binary::Power => match self.graph.value(y) {
                Some(exponent) if q == 0.0 || no_y => {
                    let own = self.graph.binary(op, x, y);
                    self.term(own, p * exponent, patchy)
                }
                _ => Form::Unknown(FUNCTION),
            },
            Binary::Atan2 if p == q => {
                let own = self.graph.binary(op, x, y);
                self.term(own, 0.0, patchy)
            }
            Binary::Atan2 | Binary::Equal | Binary::NotEqual => Form::Unknown(FUNCTION),
        }
    }

    /// x / y, which is a sign for g / |g|.
    fn quotient(&mut self, x: Id, y: Id) -> Id {
        let Node::Unary(Unary::Abs, g) = self.graph.node(y) else { return self.graph.divide(x, y) };
        let sign = self.graph.unary(Unary::Sign, g);
        match self.graph.node(x) {
            _ if x == g => sign,
            Node::Unary(Unary::Negate, own) if own == g => self.graph.negate(sign),
            Node::Binary(Binary::Multiply, own, factor) | Node::Binary(Binary::Multiply, factor, own) if own == g => {
                self.graph.multiply(factor, sign)
            }
            _ => self.graph.divide(x, y),
        }
    }

    fn select(&mut self, operands: &[Form]) -> Form {
        let [Form::Term { coefficient: c, order: 0.0, patchy: false }, a, b] = operands else {
            return Form::Unknown(FUNCTION);
        };
        let (
            Form::Term { coefficient: x, order: p, patchy: one },
            Form::Term { coefficient: y, order: q, patchy: other },
        ) = (a, b)
        else {
            return Form::Unknown(EXPONENTIAL);
        };
        let (no_x, no_y) = (self.graph.is(*x, 0.0), self.graph.is(*y, 0.0));
        let zero = self.graph.constant(0.0);
        let order = if no_x {
            *q
        } else if no_y {
            *p
        } else {
            p.max(*q)
        };
        if order > 0.0 && p != q && !no_x && !no_y {
            return Form::Unknown(FUNCTION);
        }
        let [x, y] = [(*x, *p), (*y, *q)].map(|(own, r)| if r < order { zero } else { own });
        let own = self.graph.select(*c, x, y);
        self.term(own, order, *one || *other)
    }
}

#[cfg(test)]
mod tests {
    use crate::contract::{Batch, Parameters, VectorField};
    use crate::model::{Contact, Definition, Model, ModelSource, Parameter, Smoothing, State};

    fn model(equation: &str, to_zero: bool) -> Model {
        Model::compile(ModelSource {
            parameters: vec![Parameter::new("K", 50.0), Parameter::new("p", 0.3)],
            states: vec![State::new("x"), State::new("y")],
            equations: vec![Definition::new("x", equation), Definition::new("y", "K*0 - x + tanh(K*x)")],
            smoothing: Some(Smoothing { parameter: "K".into(), to_zero }),
            ..ModelSource::default()
        })
        .unwrap_or_else(|errors| panic!("{equation}: {errors:?}"))
    }

    fn rate(model: &Model, x: &[f64]) -> f64 {
        let (mut f, parameters) = ([0.0; 2], [1e3, 0.3]);
        let parameters = Parameters::Shared(&parameters);
        model.evaluate(Batch { lanes: 1, states: x, parameters, times: &[], signs: &[] }, &mut f);
        f[0]
    }

    /// Smoothed laws and their limits: the same values on both sides of the surface, and one switch.
    #[test]
    fn smoothed_laws_become_exact_ones() {
        for (smooth, exact) in [
            ("tanh(K*(x - p))", "sign(x - p)"),
            ("(tanh(K*x - K*p) + 1)/2*y", "heaviside(x - p)*y"),
            ("2/pi*atan(K*y/3)", "sign(y)"),
            ("log(1 + exp(K*(x - p)))/K", "max(x - p, 0)"),
            ("log1p(exp(-K*y))/K", "max(-y, 0)"),
            ("y/(1 + exp(-K*(x - p)))", "y*heaviside(x - p)"),
            ("log(cosh(K*y))/K", "abs(y)"),
            ("log(exp(K*x) + exp(K*y))/K", "max(x, y)"),
            ("sqrt((x - p)^2 + 1/K^2)", "abs(x - p)"),
            ("hypot(y, 1/K) + sin(x/K)", "abs(y)"),
            ("y/sqrt(y^2 + K^-2)", "sign(y)"),
            ("p*y/(abs(y) + 1/K)", "p*sign(y)"),
            ("max(-1, min(1, K*y))", "sign(y)"),
            ("min(2, max(K*y, 1))", "1.5 + 0.5*sign(y)"),
            ("if(x > 0, tanh(K*(x - p)), -1)", "if(x > 0, sign(x - p), -1)"),
        ] {
            let (limit, known) = (model(smooth, false).with_contact(Contact::Limit).unwrap(), model(exact, false));
            assert!(limit.switch_count() > 0, "{smooth}");
            for x in [[1.3, 0.7], [-0.4, 0.2], [0.1, -1.1], [-2.0, -0.3]] {
                let [a, b] = [&limit, &known].map(|own| rate(own, &x));
                assert!((a - b).abs() < 1e-14, "{smooth} at {x:?}: {a} instead of {b}");
            }
        }
        let small = model("(x + sqrt(x^2 + K))/2", true).with_contact(Contact::Limit).unwrap();
        assert_eq!([[1.5, 0.0], [-1.5, 0.0]].map(|x| rate(&small, &x)), [1.5, 0.0]);
    }

    /// Expressions that are no law in the limit are refused.
    #[test]
    fn what_has_no_limit_is_refused() {
        for equation in [
            "K*x",
            "exp(-K*x)",
            "K*(tanh(K*x) - sign(x))",
            "K*(1 - tanh(K*x)^2)",
            "sin(K*x)",
            "sign(log(1 + exp(K*x))/K)",
            "tanh(K*max(x, 0) + y)",
            "(K*x + y) - K*x",
        ] {
            assert!(model(equation, false).with_contact(Contact::Limit).is_err(), "{equation}");
        }
    }
}
