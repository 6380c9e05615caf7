//! Expression graph in which equal subexpressions are one node.
//!
//! **Idea.** A node is looked up before it is created. An operand always has a smaller number than the nodes that use
//! it, so every pass is a loop, never a recursion. Nodes are created through the constructors of `identities`.

use super::{exprel, kernels};
use std::collections::HashMap;

/// Number of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Id(pub u32);

impl Id {
    /// Node number as an index.
    pub fn at(self) -> usize {
        self.0 as usize
    }
}

/// Input of an expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Leaf {
    /// State component.
    State(u32),
    /// Parameter.
    Parameter(u32),
    /// Time in periods of the forcing.
    Time,
    /// Component of a direction: direction number, component (states first, then parameters).
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
    Floor,
    Log10,
    Log2,
    Log1p,
    Expm1,
    Cbrt,
    Asinh,
    Acosh,
    Atanh,
    /// Derivative of (eˣ - 1)/x of the given order.
    Exprel(u8),
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
    /// Value at `x`.
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
            Unary::Floor => x.floor(),
            Unary::Log10 => x.log10(),
            Unary::Log2 => x.log2(),
            Unary::Log1p => x.ln_1p(),
            Unary::Expm1 => kernels::expm1(x),
            Unary::Cbrt => x.cbrt(),
            Unary::Asinh => x.asinh(),
            Unary::Acosh => x.acosh(),
            Unary::Atanh => x.atanh(),
            Unary::Exprel(0) => exprel::exprel(x),
            Unary::Exprel(order) => exprel::derivative(order, x),
        }
    }
}

impl Binary {
    /// Value at `(a, b)`.
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

/// Node. Constants are kept as bits so that nodes can be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Node {
    Constant(u64),
    Leaf(Leaf),
    Unary(Unary, Id),
    Binary(Binary, Id, Id),
    /// Integer power by repeated multiplication.
    Integer(Id, i32),
    /// The second operand if the first is not zero, else the third.
    Select(Id, Id, Id),
}

impl Node {
    /// Operands.
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

impl Node {
    /// Copy of the node with its operands renamed.
    pub fn renamed(self, name: impl Fn(Id) -> Id) -> Node {
        match self {
            Node::Constant(_) | Node::Leaf(_) => self,
            Node::Unary(op, a) => Node::Unary(op, name(a)),
            Node::Integer(a, n) => Node::Integer(name(a), n),
            Node::Binary(op, a, b) => Node::Binary(op, name(a), name(b)),
            Node::Select(c, a, b) => Node::Select(name(c), name(a), name(b)),
        }
    }

    /// Value, from the values of the operands and the parameters.
    pub fn value(self, of: impl Fn(Id) -> f64, parameters: &[f64]) -> f64 {
        match self {
            Node::Constant(bits) => f64::from_bits(bits),
            Node::Leaf(Leaf::Parameter(k)) => parameters[k as usize],
            Node::Leaf(_) => f64::NAN,
            Node::Unary(op, a) => op.of(of(a)),
            Node::Binary(op, a, b) => op.of(of(a), of(b)),
            Node::Integer(a, n) => kernels::power(of(a), n),
            Node::Select(c, a, b) => {
                if of(c) != 0.0 {
                    of(a)
                } else {
                    of(b)
                }
            }
        }
    }
}

/// Nodes created so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Graph {
    nodes: Vec<Node>,
    known: HashMap<Node, Id>,
}

impl Graph {
    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Node with the given number.
    pub fn node(&self, id: Id) -> Node {
        self.nodes[id.at()]
    }

    /// Returns the number of a node, which is added if there is no equal node yet.
    pub fn intern(&mut self, node: Node) -> Id {
        if let Some(&id) = self.known.get(&node) {
            return id;
        }
        let id = Id(self.nodes.len() as u32);
        self.nodes.push(node);
        self.known.insert(node, id);
        id
    }

    /// Constant node; -0 becomes 0.
    pub fn constant(&mut self, value: f64) -> Id {
        self.intern(Node::Constant((value + 0.0).to_bits()))
    }

    /// Input node.
    pub fn leaf(&mut self, leaf: Leaf) -> Id {
        self.intern(Node::Leaf(leaf))
    }

    /// Value of a constant node.
    pub fn value(&self, id: Id) -> Option<f64> {
        match self.node(id) {
            Node::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// True if the node is the constant `value`.
    pub fn is(&self, id: Id, value: f64) -> bool {
        self.value(id) == Some(value)
    }
}
