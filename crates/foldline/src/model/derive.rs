//! Symbolic derivatives on the graph.
//!
//! **Idea.** One forward sweep over the nodes that the roots depend on gives the derivative along a given tangent of
//! the leaves. The result is again a set of nodes, so repeated sweeps give derivatives of any order.
//!
//! **Departures.** Where a function has no derivative, a finite value is used so that one entry cannot make a whole
//! Jacobian undefined: `abs`, `sign`, `heaviside`, `floor` and comparisons contribute sign(x), 0, 0, 0 and 0; `hypot`
//! contributes 0 at the origin, and `sqrt` and powers below 1 contribute 0 where their argument and its derivative both
//! vanish. Squares of a radius are rewritten as sums of squares beforehand (see `identities`), so smooth functions of a
//! radius are not affected. A choice (`if`, `min`, `max`) has the derivative of the selected branch, whatever that of
//! the other.

use super::graph::{Binary, Graph, Id, Leaf, Node, Unary};

impl Graph {
    /// Marks the nodes that the roots depend on, including the roots.
    pub fn reachable(&self, roots: &[Id]) -> Vec<bool> {
        let mut reached = vec![false; self.len()];
        for root in roots {
            reached[root.at()] = true;
        }
        for i in (0..self.len()).rev() {
            if reached[i] {
                for operand in self.node(Id(i as u32)).operands() {
                    reached[operand.at()] = true;
                }
            }
        }
        reached
    }

    /// Derivatives of the roots along the tangent of the leaves given by `tangent` (`None`: zero).
    pub fn derivative(&mut self, roots: &[Id], tangent: impl Fn(&mut Graph, Leaf) -> Option<Id>) -> Vec<Id> {
        let reached = self.reachable(roots);
        let zero = self.constant(0.0);
        let mut d = vec![zero; reached.len()];
        for i in (0..reached.len()).filter(|&i| reached[i]) {
            let id = Id(i as u32);
            d[i] = match self.node(id) {
                Node::Constant(_) => zero,
                Node::Leaf(leaf) => tangent(self, leaf).unwrap_or(zero),
                Node::Unary(op, a) => {
                    let da = d[a.at()];
                    if da == zero { zero } else { self.unary_derivative(op, id, a, da) }
                }
                Node::Binary(op, a, b) => {
                    let (da, db) = (d[a.at()], d[b.at()]);
                    if da == zero && db == zero { zero } else { self.binary_derivative(op, id, [a, b], [da, db]) }
                }
                Node::Integer(a, n) => {
                    let da = d[a.at()];
                    let (factor, power) = (self.constant(f64::from(n)), self.integer(a, n.saturating_sub(1)));
                    let slope = self.multiply(factor, power);
                    self.multiply(slope, da)
                }
                Node::Select(c, a, b) => self.select(c, d[a.at()], d[b.at()]),
            };
        }
        roots.iter().map(|root| d[root.at()]).collect()
    }

    /// d op(a), with `y` = op(a).
    fn unary_derivative(&mut self, op: Unary, y: Id, a: Id, da: Id) -> Id {
        let one = self.constant(1.0);
        let slope = match op {
            Unary::Negate => return self.negate(da),
            Unary::Sqrt => {
                let two = self.constant(2.0);
                let below = self.multiply(two, y);
                let quotient = self.divide(da, below);
                let zero = self.constant(0.0);
                let rests = self.binary(Binary::Equal, da, zero);
                return self.select(rests, zero, quotient);
            }
            Unary::Log => return self.divide(da, a),
            Unary::Exp => y,
            Unary::Sin => self.unary(Unary::Cos, a),
            Unary::Cos => {
                let sine = self.unary(Unary::Sin, a);
                self.negate(sine)
            }
            Unary::Tan => {
                let square = self.integer(y, 2);
                self.add(one, square)
            }
            Unary::Asin | Unary::Acos => {
                // (1 - a)(1 + a) avoids cancellation near ±1.
                let (p, q) = (self.subtract(one, a), self.add(one, a));
                let product = self.multiply(p, q);
                let root = self.unary(Unary::Sqrt, product);
                let quotient = self.divide(da, root);
                return if op == Unary::Asin { quotient } else { self.negate(quotient) };
            }
            Unary::Atan => {
                let square = self.integer(a, 2);
                let below = self.add(one, square);
                return self.divide(da, below);
            }
            Unary::Sinh => self.unary(Unary::Cosh, a),
            Unary::Cosh => self.unary(Unary::Sinh, a),
            Unary::Tanh => self.unary(Unary::SechSquared, a),
            Unary::SechSquared => {
                let (factor, t) = (self.constant(-2.0), self.unary(Unary::Tanh, a));
                let product = self.multiply(t, y);
                self.multiply(factor, product)
            }
            Unary::Abs => self.unary(Unary::Sign, a),
            Unary::Log10 | Unary::Log2 => {
                let base = if op == Unary::Log2 { std::f64::consts::LN_2 } else { std::f64::consts::LN_10 };
                let base = self.constant(base);
                let below = self.multiply(base, a);
                return self.divide(da, below);
            }
            Unary::Log1p => {
                let below = self.add(one, a);
                return self.divide(da, below);
            }
            Unary::Expm1 => self.unary(Unary::Exp, a),
            Unary::Cbrt => {
                let (three, square) = (self.constant(3.0), self.integer(y, 2));
                let below = self.multiply(three, square);
                return self.divide(da, below);
            }
            Unary::Asinh | Unary::Acosh => {
                let square = self.integer(a, 2);
                let inside = if op == Unary::Asinh { self.add(square, one) } else { self.subtract(square, one) };
                let root = self.unary(Unary::Sqrt, inside);
                return self.divide(da, root);
            }
            Unary::Atanh => {
                let (p, q) = (self.subtract(one, a), self.add(one, a));
                let below = self.multiply(p, q);
                return self.divide(da, below);
            }
            Unary::Exprel(order) => self.unary(Unary::Exprel(order.saturating_add(1)), a),
            Unary::Floor | Unary::Sign | Unary::Heaviside => return self.constant(0.0),
        };
        self.multiply(slope, da)
    }

    /// d op(a, b), with `y` = op(a, b).
    fn binary_derivative(&mut self, op: Binary, y: Id, [a, b]: [Id; 2], [da, db]: [Id; 2]) -> Id {
        match op {
            Binary::Add => self.add(da, db),
            Binary::Subtract => self.subtract(da, db),
            Binary::Multiply => {
                let (p, q) = (self.multiply(da, b), self.multiply(a, db));
                self.add(p, q)
            }
            Binary::Divide => {
                let carried = self.multiply(y, db);
                let above = self.subtract(da, carried);
                self.divide(above, b)
            }
            Binary::Power => self.power_derivative(y, [a, b], [da, db]),
            Binary::Atan2 => {
                let (p, q) = (self.multiply(b, da), self.multiply(a, db));
                let above = self.subtract(p, q);
                let (p, q) = (self.integer(a, 2), self.integer(b, 2));
                let below = self.add(p, q);
                self.divide(above, below)
            }
            Binary::Min => {
                let first = self.binary(Binary::LessOrEqual, a, b);
                self.select(first, da, db)
            }
            Binary::Max => {
                let first = self.binary(Binary::LessOrEqual, b, a);
                self.select(first, da, db)
            }
            Binary::Hypot => {
                let zero = self.constant(0.0);
                let away = self.binary(Binary::Less, zero, y);
                let mut total = zero;
                for (x, dx) in [(a, da), (b, db)] {
                    let cosine = self.divide(x, y);
                    let cosine = self.select(away, cosine, zero);
                    let term = self.multiply(cosine, dx);
                    total = self.add(total, term);
                }
                total
            }
            Binary::Less | Binary::LessOrEqual | Binary::Equal | Binary::NotEqual => self.constant(0.0),
        }
    }

    /// d aᵇ = b aᵇ⁻¹ da + aᵇ log a db; the second term is 0 at a = 0 if aᵇ is 0.
    fn power_derivative(&mut self, y: Id, [a, b]: [Id; 2], [da, db]: [Id; 2]) -> Id {
        let (zero, one) = (self.constant(0.0), self.constant(1.0));
        let mut total = zero;
        if da != zero {
            let exponent = self.subtract(b, one);
            let power = self.binary(Binary::Power, a, exponent);
            let slope = self.multiply(b, power);
            total = self.multiply(slope, da);
            if self.value(b).is_none_or(|b| b < 1.0) {
                let rests = self.binary(Binary::Equal, da, zero);
                total = self.select(rests, zero, total);
            }
        }
        if db != zero {
            let logarithm = self.unary(Unary::Log, a);
            let slope = self.multiply(y, logarithm);
            let vanishes = self.binary(Binary::Equal, y, zero);
            let slope = self.select(vanishes, zero, slope);
            let term = self.multiply(slope, db);
            total = self.add(total, term);
        }
        total
    }
}
