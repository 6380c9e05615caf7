//! The functions of the expression language.

use super::graph::{Binary, Graph, Id, Unary};

/// What a function does with its arguments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Meaning {
    /// A function of one operand.
    One(Unary),
    /// A function of two operands.
    Two(Binary),
    /// `if(condition, a, b)`.
    If,
}

/// A function of the language.
#[derive(Debug)]
pub(super) struct Function {
    /// Its name.
    pub name: &'static str,
    /// How it is written.
    pub signature: &'static str,
    /// What it means.
    pub meaning: Meaning,
}

impl Function {
    /// How many arguments it takes.
    pub fn arity(&self) -> usize {
        match self.meaning {
            Meaning::One(_) => 1,
            Meaning::Two(_) => 2,
            Meaning::If => 3,
        }
    }

    /// The node for this function of `arguments`, whose number was checked.
    pub fn apply(&self, graph: &mut Graph, arguments: [Id; 3]) -> Id {
        let [a, b, c] = arguments;
        match self.meaning {
            Meaning::One(op) => graph.unary(op, a),
            Meaning::Two(op) => graph.binary(op, a, b),
            Meaning::If => graph.select(a, b, c),
        }
    }
}

const fn one(name: &'static str, signature: &'static str, op: Unary) -> Function {
    Function { name, signature, meaning: Meaning::One(op) }
}

const fn two(name: &'static str, signature: &'static str, op: Binary) -> Function {
    Function { name, signature, meaning: Meaning::Two(op) }
}

/// Every function.
pub(super) static FUNCTIONS: [Function; 20] = [
    one("sqrt", "sqrt(x)", Unary::Sqrt),
    one("exp", "exp(x)", Unary::Exp),
    one("log", "log(x)", Unary::Log),
    one("sin", "sin(x)", Unary::Sin),
    one("cos", "cos(x)", Unary::Cos),
    one("tan", "tan(x)", Unary::Tan),
    one("asin", "asin(x)", Unary::Asin),
    one("acos", "acos(x)", Unary::Acos),
    one("atan", "atan(x)", Unary::Atan),
    two("atan2", "atan2(y, x)", Binary::Atan2),
    one("sinh", "sinh(x)", Unary::Sinh),
    one("cosh", "cosh(x)", Unary::Cosh),
    one("tanh", "tanh(x)", Unary::Tanh),
    one("abs", "abs(x)", Unary::Abs),
    one("sign", "sign(x)", Unary::Sign),
    one("heaviside", "heaviside(x)", Unary::Heaviside),
    two("min", "min(a, b)", Binary::Min),
    two("max", "max(a, b)", Binary::Max),
    two("hypot", "hypot(a, b)", Binary::Hypot),
    Function { name: "if", signature: "if(condition, then, else)", meaning: Meaning::If },
];

/// Named numbers.
pub(super) const CONSTANTS: [(&str, f64); 1] = [("pi", std::f64::consts::PI)];

/// The function of that name.
pub(super) fn function(name: &str) -> Option<&'static Function> {
    FUNCTIONS.iter().find(|function| function.name == name)
}

/// What other languages call a function of this one.
pub(super) fn known_elsewhere_as(name: &str) -> Option<&'static str> {
    Some(match name {
        "ln" => "write `log(x)`",
        "log10" => "write `log(x)/log(10)`",
        "pow" | "power" => "write `a^b`",
        "arcsin" => "write `asin(x)`",
        "arccos" => "write `acos(x)`",
        "arctan" => "write `atan(x)`",
        "arctan2" => "write `atan2(y, x)`",
        "step" => "write `heaviside(x)`",
        "sgn" | "signum" => "write `sign(x)`",
        "ifelse" | "piecewise" | "where" | "select" => "write `if(condition, then, else)`",
        _ => return None,
    })
}
