//! Functions of the expression language.

use super::graph::{Binary, Graph, Id, Unary};

/// Operation that a function performs on its arguments.
#[derive(Clone, Copy, Debug)]
pub(super) enum Meaning {
    /// Function of one operand.
    One(Unary),
    /// Function of two operands.
    Two(Binary),
    /// Formula in one or two operands.
    Made(usize, fn(&mut Graph, Id, Id) -> Id),
    /// `if(condition, a, b)`.
    If,
}

/// Function of the language.
#[derive(Debug)]
pub(super) struct Function {
    /// Name.
    pub name: &'static str,
    /// Signature.
    pub signature: &'static str,
    /// Operation.
    pub meaning: Meaning,
}

impl Function {
    /// Number of arguments.
    pub fn arity(&self) -> usize {
        match self.meaning {
            Meaning::One(_) => 1,
            Meaning::Two(_) => 2,
            Meaning::Made(arity, _) => arity,
            Meaning::If => 3,
        }
    }

    /// Adds the node for this function of `arguments`, whose number has been checked.
    pub fn apply(&self, graph: &mut Graph, arguments: [Id; 3]) -> Id {
        let [a, b, c] = arguments;
        match self.meaning {
            Meaning::One(op) => graph.unary(op, a),
            Meaning::Two(op) => graph.binary(op, a, b),
            Meaning::Made(_, make) => make(graph, a, b),
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

/// All built-in functions.
pub(super) static FUNCTIONS: [Function; 33] = [
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
    one("log10", "log10(x)", Unary::Log10),
    one("log2", "log2(x)", Unary::Log2),
    one("log1p", "log1p(x)", Unary::Log1p),
    one("expm1", "expm1(x)", Unary::Expm1),
    one("exprel", "exprel(x)", Unary::Exprel(0)),
    one("cbrt", "cbrt(x)", Unary::Cbrt),
    one("asinh", "asinh(x)", Unary::Asinh),
    one("acosh", "acosh(x)", Unary::Acosh),
    one("atanh", "atanh(x)", Unary::Atanh),
    one("floor", "floor(x)", Unary::Floor),
    Function { name: "ceil", signature: "ceil(x)", meaning: Meaning::Made(1, |graph, a, _| ceiling(graph, a)) },
    Function { name: "round", signature: "round(x)", meaning: Meaning::Made(1, |graph, a, _| nearest(graph, a)) },
    Function { name: "mod", signature: "mod(a, b)", meaning: Meaning::Made(2, remainder) },
    Function { name: "if", signature: "if(condition, then, else)", meaning: Meaning::If },
];

/// -⌊-a⌋.
fn ceiling(graph: &mut Graph, a: Id) -> Id {
    let negative = graph.negate(a);
    let floor = graph.unary(Unary::Floor, negative);
    graph.negate(floor)
}

/// ⌊a + ½⌋.
fn nearest(graph: &mut Graph, a: Id) -> Id {
    let half = graph.constant(0.5);
    let sum = graph.add(a, half);
    graph.unary(Unary::Floor, sum)
}

/// a - b ⌊a/b⌋, which has the sign of b.
fn remainder(graph: &mut Graph, a: Id, b: Id) -> Id {
    let ratio = graph.divide(a, b);
    let turns = graph.unary(Unary::Floor, ratio);
    let whole = graph.multiply(b, turns);
    graph.subtract(a, whole)
}

/// Named constants.
pub(super) const CONSTANTS: [(&str, f64); 1] = [("pi", std::f64::consts::PI)];

/// Built-in function with the given name.
pub(super) fn function(name: &str) -> Option<&'static Function> {
    FUNCTIONS.iter().find(|function| function.name == name)
}

/// Hint for a function name used by other languages.
pub(super) fn known_elsewhere_as(name: &str) -> Option<&'static str> {
    Some(match name {
        "ln" => "write `log(x)`",
        "pow" | "power" => "write `a^b`",
        "arsinh" | "arcsinh" => "write `asinh(x)`",
        "arcosh" | "arccosh" => "write `acosh(x)`",
        "artanh" | "arctanh" => "write `atanh(x)`",
        "fmod" | "rem" | "modulo" => "write `mod(a, b)`, which has the sign of b",
        "ceiling" => "write `ceil(x)`",
        "trunc" | "fix" | "int" => "write `sign(x)*floor(abs(x))`",
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
