//! Node constructors that fold constants and apply identities.
//!
//! **Idea.** By-products of differentiation (products with 0 and 1, double negations) never become nodes. Identities
//! are exact to the last bit, except where stated.
//!
//! **Departures.** 0·x and 0/x become 0 and x - x becomes 0, although an infinite or undefined x would give NaN:
//! otherwise a derivative would carry every term that does not depend on its variable. The square of a radius becomes a
//! sum of squares, which is smooth at the origin and equal up to rounding.

use super::graph::{Binary, Graph, Id, Node, Unary};
use super::kernels;

impl Graph {
    /// Operand of a negation.
    fn negated(&self, id: Id) -> Option<Id> {
        match self.node(id) {
            Node::Unary(Unary::Negate, a) => Some(a),
            _ => None,
        }
    }

    /// True if the form of the expression shows that its value cannot be negative.
    pub fn nonnegative(&self, id: Id) -> bool {
        match self.node(id) {
            Node::Constant(bits) => f64::from_bits(bits) >= 0.0,
            Node::Integer(_, n) => n % 2 == 0,
            Node::Unary(Unary::Abs | Unary::Exp | Unary::Sqrt | Unary::Heaviside | Unary::SechSquared, _) => true,
            Node::Binary(Binary::Hypot, ..) => true,
            // One level only: sums of squares are the case that matters, and deep sums must not recurse.
            Node::Binary(Binary::Add, a, b) => [a, b].iter().all(|&x| match self.node(x) {
                Node::Integer(_, n) => n % 2 == 0,
                _ => self.value(x).is_some_and(|v| v >= 0.0),
            }),
            _ => false,
        }
    }

    /// Applies a function of one operand.
    pub fn unary(&mut self, op: Unary, a: Id) -> Id {
        if let Some(x) = self.value(a) {
            return self.constant(op.of(x));
        }
        match (op, self.node(a)) {
            (Unary::Negate, Node::Unary(Unary::Negate, inner)) => inner,
            (Unary::Negate, Node::Binary(Binary::Subtract, x, y)) => self.binary(Binary::Subtract, y, x),
            (Unary::Abs, Node::Unary(Unary::Negate, inner)) => self.unary(Unary::Abs, inner),
            (Unary::Abs, _) if self.nonnegative(a) => a,
            (Unary::Cos | Unary::Cosh | Unary::SechSquared, Node::Unary(Unary::Negate, inner)) => self.unary(op, inner),
            // The square of a radius then becomes a sum of squares again, smooth at the origin.
            (Unary::Sqrt, Node::Binary(Binary::Add, p, q)) => match (self.node(p), self.node(q)) {
                (Node::Integer(x, 2), Node::Integer(y, 2)) => self.binary(Binary::Hypot, x, y),
                _ => self.intern(Node::Unary(op, a)),
            },
            _ => self.intern(Node::Unary(op, a)),
        }
    }

    /// -a.
    pub fn negate(&mut self, a: Id) -> Id {
        self.unary(Unary::Negate, a)
    }

    /// a + b.
    pub fn add(&mut self, a: Id, b: Id) -> Id {
        self.binary(Binary::Add, a, b)
    }

    /// a - b.
    pub fn subtract(&mut self, a: Id, b: Id) -> Id {
        self.binary(Binary::Subtract, a, b)
    }

    /// a b.
    pub fn multiply(&mut self, a: Id, b: Id) -> Id {
        self.binary(Binary::Multiply, a, b)
    }

    /// a / b.
    pub fn divide(&mut self, a: Id, b: Id) -> Id {
        self.binary(Binary::Divide, a, b)
    }

    /// Applies a function of two operands.
    pub fn binary(&mut self, op: Binary, a: Id, b: Id) -> Id {
        if let (Some(x), Some(y)) = (self.value(a), self.value(b)) {
            return match op {
                Binary::Power if integer(y).is_some() => self.constant(kernels::power(x, integer(y).unwrap_or(0))),
                _ => self.constant(op.of(x, y)),
            };
        }
        match op {
            Binary::Add => self.sum(a, b),
            Binary::Subtract => self.difference(a, b),
            Binary::Multiply => self.product(a, b),
            Binary::Divide => self.quotient(a, b),
            Binary::Power => match self.value(b) {
                Some(0.5) => self.unary(Unary::Sqrt, a),
                Some(y) => match integer(y) {
                    Some(n) => self.integer(a, n),
                    None => self.intern(Node::Binary(op, a, b)),
                },
                None => self.intern(Node::Binary(op, a, b)),
            },
            Binary::Min | Binary::Max if a == b => a,
            _ => self.intern(Node::Binary(op, a, b)),
        }
    }

    fn sum(&mut self, a: Id, b: Id) -> Id {
        if self.is(a, 0.0) {
            return b;
        }
        if self.is(b, 0.0) {
            return a;
        }
        if a == b {
            let two = self.constant(2.0);
            return self.multiply(two, a);
        }
        if let Some(y) = self.negated(b) {
            return self.subtract(a, y);
        }
        if let Some(x) = self.negated(a) {
            return self.subtract(b, x);
        }
        self.intern(Node::Binary(Binary::Add, a.min(b), a.max(b)))
    }

    fn difference(&mut self, a: Id, b: Id) -> Id {
        if self.is(b, 0.0) {
            return a;
        }
        if self.is(a, 0.0) {
            return self.negate(b);
        }
        if a == b {
            return self.constant(0.0);
        }
        if let Some(y) = self.negated(b) {
            return self.add(a, y);
        }
        self.intern(Node::Binary(Binary::Subtract, a, b))
    }

    fn product(&mut self, a: Id, b: Id) -> Id {
        if self.is(a, 0.0) || self.is(b, 0.0) {
            return self.constant(0.0);
        }
        if self.is(a, 1.0) {
            return b;
        }
        if self.is(b, 1.0) {
            return a;
        }
        if self.is(a, -1.0) {
            return self.negate(b);
        }
        if self.is(b, -1.0) {
            return self.negate(a);
        }
        match (self.negated(a), self.negated(b)) {
            (Some(x), Some(y)) => return self.multiply(x, y),
            (Some(x), None) => {
                let product = self.multiply(x, b);
                return self.negate(product);
            }
            (None, Some(y)) => {
                let product = self.multiply(a, y);
                return self.negate(product);
            }
            (None, None) => {}
        }
        if a == b {
            return self.integer(a, 2);
        }
        self.intern(Node::Binary(Binary::Multiply, a.min(b), a.max(b)))
    }

    fn quotient(&mut self, a: Id, b: Id) -> Id {
        if self.is(a, 0.0) {
            return a;
        }
        if self.is(b, 1.0) {
            return a;
        }
        if self.is(b, -1.0) {
            return self.negate(a);
        }
        if let Some(y) = self.value(b).filter(|y| y.is_normal() && (1.0 / y).is_normal() && mantissa(*y) == 0) {
            let inverse = self.constant(1.0 / y); // exact
            return self.multiply(a, inverse);
        }
        if let Some(x) = self.negated(a) {
            let quotient = self.divide(x, b);
            return self.negate(quotient);
        }
        if let Some(y) = self.negated(b) {
            let quotient = self.divide(a, y);
            return self.negate(quotient);
        }
        self.intern(Node::Binary(Binary::Divide, a, b))
    }

    /// aⁿ.
    pub fn integer(&mut self, a: Id, n: i32) -> Id {
        if let Some(x) = self.value(a) {
            return self.constant(kernels::power(x, n));
        }
        if n == 0 {
            return self.constant(1.0);
        }
        if n == 1 {
            return a;
        }
        if n % 2 == 0 {
            match self.node(a) {
                Node::Unary(Unary::Negate | Unary::Abs, x) => return self.integer(x, n),
                Node::Binary(Binary::Hypot, x, y) => {
                    let (p, q) = (self.integer(x, 2), self.integer(y, 2));
                    let square = self.add(p, q);
                    return self.integer(square, n / 2);
                }
                Node::Unary(Unary::Sqrt, x) if self.nonnegative(x) => return self.integer(x, n / 2),
                _ => {}
            }
        }
        self.intern(Node::Integer(a, n))
    }

    /// `a` if `condition` is not zero, else `b`.
    pub fn select(&mut self, condition: Id, a: Id, b: Id) -> Id {
        match self.value(condition) {
            Some(c) if c != 0.0 => a,
            Some(_) => b,
            None if a == b => a,
            None => self.intern(Node::Select(condition, a, b)),
        }
    }
}

/// `y` as an integer exponent.
fn integer(y: f64) -> Option<i32> {
    (y == y.trunc() && y.abs() <= f64::from(i32::MAX)).then_some(y as i32)
}

fn mantissa(y: f64) -> u64 {
    y.to_bits() & ((1 << 52) - 1)
}

#[cfg(test)]
mod tests {
    use super::super::graph::Leaf;
    use super::*;

    #[test]
    fn equal_expressions_are_one_node() {
        let mut g = Graph::default();
        let (x, y) = (g.leaf(Leaf::State(0)), g.leaf(Leaf::State(1)));
        assert_eq!(g.add(x, y), g.add(y, x));
        assert_eq!(g.multiply(x, y), g.multiply(y, x));
        assert_ne!(g.subtract(x, y), g.subtract(y, x));
        assert_eq!(g.multiply(x, x), g.integer(x, 2));
    }

    #[test]
    fn identities() {
        let mut g = Graph::default();
        let (x, y) = (g.leaf(Leaf::State(0)), g.leaf(Leaf::State(1)));
        let (zero, one, two) = (g.constant(0.0), g.constant(1.0), g.constant(2.0));
        assert_eq!(g.add(x, zero), x);
        assert_eq!(g.multiply(one, x), x);
        assert_eq!(g.multiply(x, zero), zero);
        assert_eq!(g.subtract(x, x), zero);
        assert_eq!(g.divide(x, one), x);
        let minus = g.negate(x);
        assert_eq!(g.negate(minus), x);
        assert_eq!(g.add(y, minus), g.subtract(y, x));
        assert_eq!(g.binary(Binary::Power, x, two), g.multiply(x, x));
        let r = g.binary(Binary::Hypot, x, y);
        let (p, q) = (g.integer(x, 2), g.integer(y, 2));
        let square = g.add(p, q);
        assert_eq!(g.unary(Unary::Sqrt, square), r);
        assert_eq!(g.multiply(r, r), square);
    }

    /// 3 is not a power of two: its reciprocal is rounded, so the division must stay.
    #[test]
    fn divisions_are_kept_where_the_reciprocal_is_not_exact() {
        let mut g = Graph::default();
        let x = g.leaf(Leaf::State(0));
        let (three, four) = (g.constant(3.0), g.constant(4.0));
        let third = g.divide(x, three);
        assert!(matches!(g.node(third), Node::Binary(Binary::Divide, ..)));
        let quarter = g.divide(x, four);
        assert!(matches!(g.node(quarter), Node::Binary(Binary::Multiply, ..)));
    }
}
