//! Tapes as C text.
//!
//! **Idea.** Every instruction becomes one assignment to a constant of its own, in the order of the tape, so that a C
//! compiler allocates registers without having to look for common subexpressions. Values that depend on parameters
//! alone are computed once by `fl_scalars` and read from an array; those that a machine instruction can hold are
//! written as numbers.
//!
//! **Departures.** None from the tape: without contraction of products and sums the results agree to the bit, except
//! for functions of the C library where it differs from that of this program (sin, pow and the like).

use super::Model;
use super::graph::{Binary, Leaf, Node, Unary};
use super::kernels;
use super::tape::{Code, Instruction, Sum, Tape, Term};
use crate::contract::VectorField;
use std::collections::HashMap;
use std::fmt::Write;

/// C text of the functions of a model, and the sizes that it is written for.
#[derive(Clone, Debug)]
pub(crate) struct Functions {
    /// `fl_scalars`, `fl_field` and, with switches, `fl_given`, `fl_switches` and `fl_speeds`.
    pub text: String,
    /// Number of values that depend on parameters alone.
    pub scalars: usize,
    /// Tapes whose scalars [`Functions::values`] computes.
    tapes: Vec<(Code, Vec<u32>)>,
}

impl Functions {
    /// Values that depend on parameters alone, at the parameters `[k]`: the argument `s` of the functions.
    pub(crate) fn values(&self, parameters: &[f64]) -> Vec<f64> {
        let mut found = Vec::with_capacity(self.scalars);
        for (code, used) in &self.tapes {
            let mut own: Vec<f64> = Vec::with_capacity(code.scalars.len());
            for node in &code.scalars {
                own.push(node.value(|id| own[id.at()], parameters));
            }
            found.extend(used.iter().map(|s| own[*s as usize]));
        }
        found
    }
}

/// Writes the functions of a model.
pub(crate) fn functions(model: &Model) -> Functions {
    let mut writer = Writer::default();
    let forced = model.forced();
    let clock = if forced { format!("    f[{}] = 1.0;\n", model.dim()) } else { String::new() };
    let head = |name: &str, signs: &str, to: &str| {
        format!("FL_FUNCTION void {name}(const double *s, double t, const double *x{signs}, double *{to})\n")
    };
    writer.function(&model.inner.field, &head("fl_field", "", "f"), "f", &clock);
    let switches = model.switch_count();
    if switches > 0 {
        writer.function(&model.inner.given, &head("fl_given", ", const double *g", "f"), "f", &clock);
        writer.function(&model.inner.switches.values, &head("fl_switches", "", "h"), "h", "");
        for switch in 0..switches {
            let (graph, speeds) = model.inner.switches.speeds(0, switch);
            let name = format!("fl_speeds_{switch}");
            writer.function(&Tape::new(&graph, &[&speeds]), &head(&name, ", const double *g", "v"), "v", "");
        }
        writer.text += "FL_RARE void fl_speeds(const double *s, double t, const double *x, const double *g, int along, \
                        double *v)\n{\n";
        for switch in 0..switches {
            let _ = writeln!(writer.text, "    if (along == {switch}) {{ fl_speeds_{switch}(s, t, x, g, v); }}");
        }
        writer.text += "}\n\n";
    }
    let scalars = writer.tapes.iter().map(|(_, used)| used.len()).sum();
    let text = format!("{}{}", writer.prepared(), writer.text);
    Functions { text, scalars, tapes: writer.tapes }
}

#[derive(Default)]
struct Writer {
    text: String,
    tapes: Vec<(Code, Vec<u32>)>,
    scalars: usize,
}

impl Writer {
    /// Adds the function of a tape with one array of results, `to`.
    fn function(&mut self, tape: &Tape, head: &str, to: &str, more: &str) {
        let code = &tape.shared;
        let mut own =
            Function { code, used: Vec::new(), places: HashMap::new(), first: self.scalars, names: Vec::new() };
        own.names = vec![String::new(); code.registers];
        let body = own.body(to);
        let used = own.used;
        self.scalars += used.len();
        let unused = if head.contains("*g") { ", (void)g" } else { "" };
        self.text += &format!("{head}{{\n    (void)s, (void)t, (void)x{unused};\n{body}{more}}}\n\n");
        self.tapes.push((code.clone(), used));
    }

    /// `fl_scalars`.
    fn prepared(&self) -> String {
        let mut text = String::from("FL_RARE void fl_scalars(const double *p, double *s)\n{\n    (void)p, (void)s;\n");
        let mut place = 0;
        for (number, (code, used)) in self.tapes.iter().enumerate() {
            let needed = needed(code, used);
            let name = |id: u32| match code.scalars[id as usize] {
                Node::Constant(bits) => number_text(f64::from_bits(bits)),
                _ => format!("c{number}_{id}"),
            };
            for (id, node) in code.scalars.iter().enumerate().filter(|(id, _)| needed[*id]) {
                let value = match *node {
                    Node::Constant(_) => continue,
                    Node::Leaf(Leaf::Parameter(k)) => format!("p[{k}]"),
                    Node::Leaf(_) => "0.0/0.0".into(),
                    Node::Unary(op, a) => unary(op, &name(a.0)),
                    Node::Binary(op, a, b) => binary(op, &name(a.0), &name(b.0)),
                    Node::Integer(a, n) => power(&name(a.0), n),
                    Node::Select(c, a, b) => format!("{} != 0.0 ? {} : {}", name(c.0), name(a.0), name(b.0)),
                };
                let _ = writeln!(text, "    const double c{number}_{id} = {value};");
            }
            for id in used {
                let _ = writeln!(text, "    s[{place}] = {};", name(*id));
                place += 1;
            }
        }
        text + "}\n\n"
    }
}

/// Marks the scalars on which those `used` depend.
fn needed(code: &Code, used: &[u32]) -> Vec<bool> {
    let mut needed = vec![false; code.scalars.len()];
    used.iter().for_each(|id| needed[*id as usize] = true);
    for id in (0..needed.len()).rev().filter(|id| code.scalars[*id].operands().next().is_some()) {
        if needed[id] {
            code.scalars[id].operands().for_each(|a| needed[a.at()] = true);
        }
    }
    needed
}

/// Function being written.
struct Function<'a> {
    code: &'a Code,
    /// Scalars read from the array, in the order of their places, which begin at `first`.
    used: Vec<u32>,
    places: HashMap<u32, usize>,
    first: usize,
    /// Name of the value in each register.
    names: Vec<String>,
}

impl Function<'_> {
    /// Text of a scalar: a number if it is short, else its place in the array.
    fn scalar(&mut self, id: u32) -> String {
        if let Node::Constant(bits) = self.code.scalars[id as usize]
            && bits.trailing_zeros() >= 32
        {
            return number_text(f64::from_bits(bits));
        }
        let next = self.first + self.used.len();
        let place = *self.places.entry(id).or_insert(next);
        if place == next {
            self.used.push(id);
        }
        format!("s[{place}]")
    }

    fn body(&mut self, to: &str) -> String {
        let code = self.code;
        let mut text = String::new();
        for &(scalar, place) in &code.uniform {
            let _ = writeln!(text, "    {to}[{}] = {};", place.component, self.scalar(scalar));
        }
        for &(register, scalar) in &code.filled {
            self.names[register as usize] = self.scalar(scalar);
        }
        for (number, &instruction) in code.body.iter().enumerate() {
            let at = |register: u32, own: &Self| own.names[register as usize].clone();
            let (target, value) = match instruction {
                Instruction::Store { from, place } => {
                    let _ = writeln!(text, "    {to}[{}] = {};", place.component, at(from, self));
                    continue;
                }
                Instruction::Load { to, from } => (to, leaf(from)),
                Instruction::Unary { op, to, a } => (to, unary(op, &at(a, self))),
                Instruction::Binary { op, to, a, b } => (to, binary(op, &at(a, self), &at(b, self))),
                Instruction::Right { op, to, a, s } => (to, binary(op, &at(a, self), &self.scalar(s))),
                Instruction::Left { op, to, s, b } => (to, binary(op, &self.scalar(s), &at(b, self))),
                Instruction::Fused { sum, to, a, b, c } => {
                    (to, added(sum, &format!("{} * {}", at(a, self), at(b, self)), &at(c, self)))
                }
                Instruction::Scaled { sum, to, a, s, c } => {
                    (to, added(sum, &format!("{} * {}", at(a, self), self.scalar(s)), &at(c, self)))
                }
                Instruction::Terms { to, c, first, count } => {
                    let mut value = at(c, self);
                    for &term in &code.terms[first as usize..][..count as usize] {
                        value = match term {
                            Term::Product { sum, a, b } => {
                                added(sum, &format!("{} * {}", at(a, self), at(b, self)), &value)
                            }
                            Term::Scaled { sum, a, s } => {
                                added(sum, &format!("{} * {}", at(a, self), self.scalar(s)), &value)
                            }
                        };
                        value = format!("({value})");
                    }
                    (to, value)
                }
                Instruction::Integer { to, a, n } => (to, power(&at(a, self), n)),
                Instruction::Select { to, c, a, b } => {
                    (to, format!("{} != 0.0 ? {} : {}", at(c, self), at(a, self), at(b, self)))
                }
            };
            let _ = writeln!(text, "    const double v{number} = {value};");
            self.names[target as usize] = format!("v{number}");
        }
        text
    }
}

fn leaf(from: Leaf) -> String {
    match from {
        Leaf::State(i) => format!("x[{i}]"),
        Leaf::Time => "t".into(),
        Leaf::Direction(_, i) => format!("g[{i}]"),
        // Parameters are scalars.
        Leaf::Parameter(_) => "0.0/0.0".into(),
    }
}

fn added(sum: Sum, product: &str, c: &str) -> String {
    match sum {
        Sum::Plus => format!("{product} + {c}"),
        Sum::Minus => format!("{product} - {c}"),
        Sum::From => format!("{c} - {product}"),
    }
}

fn unary(op: Unary, a: &str) -> String {
    let name = match op {
        Unary::Negate => return format!("-({a})"),
        Unary::Exprel(0) => "fl_exprel",
        Unary::Exprel(order) => return format!("fl_exprel_derivative({order}, {a})"),
        Unary::Sqrt => "fl_sqrt",
        Unary::Exp => "fl_exp",
        Unary::Log => "log",
        Unary::Sin => "sin",
        Unary::Cos => "cos",
        Unary::Tan => "tan",
        Unary::Asin => "asin",
        Unary::Acos => "acos",
        Unary::Atan => "atan",
        Unary::Sinh => "sinh",
        Unary::Cosh => "cosh",
        Unary::Tanh => "fl_tanh",
        Unary::SechSquared => "fl_sech_squared",
        Unary::Abs => "fabs",
        Unary::Sign => "fl_sign",
        Unary::Heaviside => "fl_heaviside",
        Unary::Floor => "floor",
        Unary::Log10 => "log10",
        Unary::Log2 => "log2",
        Unary::Log1p => "log1p",
        Unary::Expm1 => "fl_expm1",
        Unary::Cbrt => "cbrt",
        Unary::Asinh => "asinh",
        Unary::Acosh => "acosh",
        Unary::Atanh => "atanh",
    };
    format!("{name}({a})")
}

fn binary(op: Binary, a: &str, b: &str) -> String {
    match op {
        Binary::Add => format!("{a} + {b}"),
        Binary::Subtract => format!("{a} - {b}"),
        Binary::Multiply => format!("{a} * {b}"),
        Binary::Divide => format!("fl_divide({a}, {b})"),
        Binary::Power => format!("pow({a}, {b})"),
        Binary::Atan2 => format!("atan2({a}, {b})"),
        Binary::Min => format!("fl_min({a}, {b})"),
        Binary::Max => format!("fl_max({a}, {b})"),
        Binary::Hypot => format!("fl_hypot({a}, {b})"),
        Binary::Less => format!("{a} < {b} ? 1.0 : 0.0"),
        Binary::LessOrEqual => format!("{a} <= {b} ? 1.0 : 0.0"),
        Binary::Equal => format!("{a} == {b} ? 1.0 : 0.0"),
        Binary::NotEqual => format!("{a} != {b} ? 1.0 : 0.0"),
    }
}

/// Power by the products of [`kernels::power`].
fn power(a: &str, n: i32) -> String {
    /// aᵏ for a power of two k, by repeated squaring.
    fn square(a: &str, k: u32) -> String {
        if k == 1 { a.to_string() } else { format!("fl_square({})", square(a, k / 2)) }
    }
    let mut result: Option<String> = None;
    for bit in (0..32).map(|bit| 1 << bit).filter(|bit| n.unsigned_abs() & bit != 0) {
        let factor = square(a, bit);
        result = Some(result.map_or(factor.clone(), |result| format!("({result} * {factor})")));
    }
    let result = result.unwrap_or_else(|| number_text(kernels::power(1.0, 0)));
    if n < 0 { format!("fl_divide(1.0, {result})") } else { result }
}

/// A number as C text, exact; negative ones in parentheses.
pub(crate) fn number_text(value: f64) -> String {
    match value {
        _ if value.is_nan() => "(0.0/0.0)".into(),
        f64::INFINITY => "(1.0/0.0)".into(),
        f64::NEG_INFINITY => "(-1.0/0.0)".into(),
        _ if value < 0.0 => format!("({value:?})"),
        _ => format!("{value:?}"),
    }
}
