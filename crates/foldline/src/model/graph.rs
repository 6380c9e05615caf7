//! Expressions as a graph in which equal subexpressions are one node.
//!
//! **Idea.** Nodes are created through constructors that fold constants and apply identities, and are looked up before they
//! are made; an operand always has a smaller number than the node that uses it, so every pass is a loop, never a recursion.
//!
//! **Departures.** 0·x and 0/x become 0 and x - x becomes 0 even though an infinite or undefined x would give NaN: otherwise a
//! derivative would carry every term that does not depend on its variable.

use super::kernels;
use std::collections::HashMap;

/// Number of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Id(pub u32);

impl Id {
    /// As an index.
    pub fn at(self) -> usize {
        self.0 as usize
    }
}

/// What an expression depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Leaf {
    /// State component.
    State(u32),
    /// Parameter.
    Parameter(u32),
    /// Component of a direction: which direction, which component (states first, then parameters).
    Direction(u32, u32),
}

/// Functions of one operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Unary {
    Negate,
    Sqrt,
    Exp,
    Log,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    SechSquared,
    Abs,
    Sign,
    Heaviside,
}

/// Functions of two operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Atan2,
    Min,
    Max,
    Hypot,
    Less,
    LessOrEqual,
    Equal,
    NotEqual,
}

impl Unary {
    /// The value at `x`.
    #[inline(always)]
    pub fn of(self, x: f64) -> f64 {
        match self {
            Unary::Negate => -x,
            Unary::Sqrt => x.sqrt(),
            Unary::Exp => kernels::exp(x),
            Unary::Log => x.ln(),
            Unary::Sin => x.sin(),
            Unary::Cos => x.cos(),
            Unary::Tan => x.tan(),
            Unary::Asin => x.asin(),
            Unary::Acos => x.acos(),
            Unary::Atan => x.atan(),
            Unary::Sinh => x.sinh(),
            Unary::Cosh => x.cosh(),
            Unary::Tanh => kernels::tanh(x),
            Unary::SechSquared => kernels::sech_squared(x),
            Unary::Abs => x.abs(),
            Unary::Sign => kernels::sign(x),
            Unary::Heaviside => kernels::heaviside(x),
        }
    }
}

impl Binary {
    /// The value at `(a, b)`.
    #[inline(always)]
    pub fn of(self, a: f64, b: f64) -> f64 {
        let truth = |holds: bool| if holds { 1.0 } else { 0.0 };
        match self {
            Binary::Add => a + b,
            Binary::Subtract => a - b,
            Binary::Multiply => a * b,
            Binary::Divide => a / b,
            Binary::Power => a.powf(b),
            Binary::Atan2 => a.atan2(b),
            Binary::Min => kernels::min(a, b),
            Binary::Max => kernels::max(a, b),
            Binary::Hypot => kernels::hypot(a, b),
            Binary::Less => truth(a < b),
            Binary::LessOrEqual => truth(a <= b),
            Binary::Equal => truth(a == b),
            Binary::NotEqual => truth(a != b),
        }
    }
}

/// A node. Constants are kept as bits so that nodes can be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Node {
    Constant(u64),
    Leaf(Leaf),
    Unary(Unary, Id),
    Binary(Binary, Id, Id),
    /// Integer power by repeated multiplication.
    Integer(Id, i32),
    /// The second where the first is not zero, else the third.
    Select(Id, Id, Id),
}

impl Node {
    /// The operands.
    pub fn operands(self) -> impl Iterator<Item = Id> {
        let list = match self {
            Node::Constant(_) | Node::Leaf(_) => [None; 3],
            Node::Unary(_, a) | Node::Integer(a, _) => [Some(a), None, None],
            Node::Binary(_, a, b) => [Some(a), Some(b), None],
            Node::Select(c, a, b) => [Some(c), Some(a), Some(b)],
        };
        list.into_iter().flatten()
    }
}

/// The nodes made so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Graph {
    nodes: Vec<Node>,
    known: HashMap<Node, Id>,
}

impl Graph {
    /// How many nodes there are.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// The node of that number.
    pub fn node(&self, id: Id) -> Node {
        self.nodes[id.at()]
    }

    fn intern(&mut self, node: Node) -> Id {
        if let Some(&id) = self.known.get(&node) {
            return id;
        }
        let id = Id(self.nodes.len() as u32);
        self.nodes.push(node);
        self.known.insert(node, id);
        id
    }

    /// A number; -0 is taken as 0.
    pub fn constant(&mut self, value: f64) -> Id {
        self.intern(Node::Constant((value + 0.0).to_bits()))
    }

    /// An input.
    pub fn leaf(&mut self, leaf: Leaf) -> Id {
        self.intern(Node::Leaf(leaf))
    }

    /// The value of a constant node.
    pub fn value(&self, id: Id) -> Option<f64> {
        match self.node(id) {
            Node::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// Whether the node is the constant `value`.
    pub fn is(&self, id: Id, value: f64) -> bool {
        self.value(id) == Some(value)
    }

    /// The operand of a negation.
    fn negated(&self, id: Id) -> Option<Id> {
        match self.node(id) {
            Node::Unary(Unary::Negate, a) => Some(a),
            _ => None,
        }
    }

    /// Whether the value cannot be negative, by the form of the expression.
    fn nonnegative(&self, id: Id) -> bool {
        match self.node(id) {
            Node::Constant(bits) => f64::from_bits(bits) >= 0.0,
            Node::Integer(_, n) => n % 2 == 0,
            Node::Unary(Unary::Abs | Unary::Exp | Unary::Sqrt | Unary::Heaviside | Unary::SechSquared, _) => true,
            Node::Binary(Binary::Hypot, ..) => true,
            // One level only: sums of squares are what matters, and deep sums must not make this a recursion.
            Node::Binary(Binary::Add, a, b) => [a, b].iter().all(|&x| match self.node(x) {
                Node::Integer(_, n) => n % 2 == 0,
                _ => self.value(x).is_some_and(|v| v >= 0.0),
            }),
            _ => false,
        }
    }

    /// A function of one operand.
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
            // The square of a radius is then a sum of squares again, smooth at the origin.
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

    /// A function of two operands.
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

    /// `a` where `condition` is not zero, else `b`.
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

    /// 3 is not a power of two, so its reciprocal is rounded and the division must stay.
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
