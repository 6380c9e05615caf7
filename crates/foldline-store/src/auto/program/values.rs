//! Values of variables: numbers, or text in the language of models.

use super::syntax::{Stop, stop};

/// Value of a variable or expression.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum V {
    /// A number, and true if it is an integer.
    Number(f64, bool),
    /// Text of an expression, and how tightly its outermost operator binds.
    Symbol(String, Tight),
    Logical(bool),
    Text(String),
    List(Vec<V>),
    /// A value that has no counterpart, with the reason.
    Opaque(&'static str),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Tight {
    Sum,
    Product,
    Minus,
    Power,
    Atom,
}

/// Longest text of an expression.
const LONGEST: usize = 60_000;

impl V {
    pub(super) fn whole(value: i64) -> V {
        V::Number(value as f64, true)
    }

    pub(super) fn name(name: &str) -> V {
        V::Symbol(name.to_string(), Tight::Atom)
    }

    /// Text in the language of models.
    pub(super) fn text(&self, line: usize) -> Result<(String, Tight), Stop> {
        match self {
            V::Number(value, _) if !value.is_finite() => {
                stop(line, "a number is not finite here", "correct the constants")
            }
            V::Number(value, _) => {
                let text = written(*value);
                let tight = if *value < 0.0 { Tight::Minus } else { Tight::Atom };
                Ok((text, tight))
            }
            V::Symbol(text, _) if text.len() > LONGEST => {
                stop(line, "an expression becomes too long", "write the model by hand, with definitions")
            }
            V::Symbol(text, tight) => Ok((text.clone(), *tight)),
            V::Opaque(why) => stop(line, *why, "write the model or the study by hand"),
            V::Logical(_) | V::Text(_) | V::List(_) => {
                stop(line, "a number is needed here", "write the statement for each element, or the model by hand")
            }
        }
    }

    fn within(&self, least: Tight, line: usize) -> Result<String, Stop> {
        let (text, tight) = self.text(line)?;
        Ok(if tight >= least { text } else { format!("({text})") })
    }
}

/// Shortest decimal that reads back as the same number.
pub(super) fn written(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").unwrap_or(&text).to_string()
}

/// Applies an operator to two values, element by element to lists.
pub(super) fn binary(sign: &str, left: V, right: V, line: usize) -> Result<V, Stop> {
    match (left, right) {
        (V::List(a), V::List(b)) => {
            let pairs = a.into_iter().zip(b);
            Ok(V::List(pairs.map(|(a, b)| binary(sign, a, b, line)).collect::<Result<_, _>>()?))
        }
        (V::List(a), b) => {
            Ok(V::List(a.into_iter().map(|a| binary(sign, a, b.clone(), line)).collect::<Result<_, _>>()?))
        }
        (a, V::List(b)) => {
            Ok(V::List(b.into_iter().map(|b| binary(sign, a.clone(), b, line)).collect::<Result<_, _>>()?))
        }
        (V::Opaque(why), _) | (_, V::Opaque(why)) => Ok(V::Opaque(why)),
        (V::Logical(a), V::Logical(b)) => match sign {
            "&&" => Ok(V::Logical(a && b)),
            "||" => Ok(V::Logical(a || b)),
            _ => Ok(V::Logical((sign == "==") == (a == b))),
        },
        (V::Text(a), V::Text(b)) => Ok(V::Logical((sign == "==") == (a == b))),
        (V::Number(a, i), V::Number(b, j)) => number(sign, (a, i), (b, j), line),
        (a, b) => symbol(sign, a, b, line),
    }
}

fn number(sign: &str, (a, i): (f64, bool), (b, j): (f64, bool), line: usize) -> Result<V, Stop> {
    let whole = i && j;
    Ok(match sign {
        "+" => V::Number(a + b, whole),
        "-" => V::Number(a - b, whole),
        "*" => V::Number(a * b, whole),
        // The quotient of integers is one.
        "/" if whole && b != 0.0 => V::Number((a / b).trunc(), true),
        "/" => V::Number(a / b, false),
        // So is a power: 2**(-1) is 0.
        "**" if whole && (b >= 0.0 || a != 0.0) => V::Number(a.powf(b).trunc(), true),
        "**" => V::Number(a.powf(b), false),
        "==" => V::Logical(a == b),
        "!=" => V::Logical(a != b),
        "<" => V::Logical(a < b),
        "<=" => V::Logical(a <= b),
        ">" => V::Logical(a > b),
        ">=" => V::Logical(a >= b),
        "&&" => V::Logical(a != 0.0 && b != 0.0),
        "||" => V::Logical(a != 0.0 || b != 0.0),
        _ => return stop(line, format!("`{sign}` is not translated"), "write the statement in another way"),
    })
}

fn symbol(sign: &str, a: V, b: V, line: usize) -> Result<V, Stop> {
    let is = |own: &V, value: f64| matches!(own, V::Number(v, _) if *v == value);
    match sign {
        "+" if is(&a, 0.0) => return Ok(b),
        "+" | "-" if is(&b, 0.0) => return Ok(a),
        "*" if is(&a, 1.0) => return Ok(b),
        "*" | "/" | "**" if is(&b, 1.0) => return Ok(a),
        "*" if is(&a, 0.0) || is(&b, 0.0) => return Ok(V::Number(0.0, false)),
        "-" if is(&a, 0.0) => return negative(b, line),
        _ => {}
    }
    let (left, right, tight) = match sign {
        "+" => (Tight::Sum, Tight::Product, Tight::Sum),
        "-" => (Tight::Sum, Tight::Product, Tight::Sum),
        "*" | "/" => (Tight::Product, Tight::Power, Tight::Product),
        "**" => (Tight::Atom, Tight::Atom, Tight::Power),
        _ => {
            return stop(
                line,
                "a condition depends on states, parameters or the independent variable",
                "write the model by hand with `if(condition, a, b)`",
            );
        }
    };
    let (a, b) = (a.within(left, line)?, b.within(right, line)?);
    let text = match sign {
        "**" => format!("{a}^{b}"),
        "+" | "-" => format!("{a} {sign} {b}"),
        _ => format!("{a}{sign}{b}"),
    };
    Ok(V::Symbol(text, tight))
}

/// Applies a sign.
pub(super) fn negative(value: V, line: usize) -> Result<V, Stop> {
    match value {
        V::Number(v, whole) => Ok(V::Number(-v, whole)),
        V::List(all) => Ok(V::List(all.into_iter().map(|own| negative(own, line)).collect::<Result<_, _>>()?)),
        V::Opaque(why) => Ok(V::Opaque(why)),
        own => Ok(V::Symbol(format!("-{}", own.within(Tight::Power, line)?), Tight::Minus)),
    }
}

/// Functions of one argument: names in Fortran and C, the name in models, and the function.
type Function = (&'static [&'static str], &'static str, fn(f64) -> f64);
const FUNCTIONS: [Function; 14] = [
    (&["exp", "dexp"], "exp", f64::exp),
    (&["log", "dlog"], "log", f64::ln),
    (&["log10", "dlog10"], "log10", f64::log10),
    (&["sqrt", "dsqrt"], "sqrt", f64::sqrt),
    (&["sin", "dsin"], "sin", f64::sin),
    (&["cos", "dcos"], "cos", f64::cos),
    (&["tan", "dtan"], "tan", f64::tan),
    (&["asin", "dasin"], "asin", f64::asin),
    (&["acos", "dacos"], "acos", f64::acos),
    (&["atan", "datan"], "atan", f64::atan),
    (&["sinh", "dsinh"], "sinh", f64::sinh),
    (&["cosh", "dcosh"], "cosh", f64::cosh),
    (&["tanh", "dtanh"], "tanh", f64::tanh),
    (&["abs", "dabs", "fabs"], "abs", f64::abs),
];

/// Applies an intrinsic function; `None` if there is none of the name.
pub(super) fn intrinsic(name: &str, given: &[V], line: usize) -> Result<Option<V>, Stop> {
    if let (Some((_, own, f)), [argument]) = (FUNCTIONS.iter().find(|(names, ..)| names.contains(&name)), given) {
        return Ok(Some(match argument {
            V::Number(value, _) => V::Number(f(*value), false),
            V::Opaque(why) => V::Opaque(why),
            V::List(all) => {
                let each = all
                    .iter()
                    .map(|one| intrinsic(name, std::slice::from_ref(one), line).map(Option::unwrap_or_default));
                V::List(each.collect::<Result<_, _>>()?)
            }
            other => V::Symbol(format!("{own}({})", other.text(line)?.0), Tight::Atom),
        }));
    }
    let numbers: Option<Vec<f64>> =
        given.iter().map(|v| if let V::Number(v, _) = v { Some(*v) } else { None }).collect();
    let integers = given.iter().all(|v| matches!(v, V::Number(_, true)));
    let two = |own: &str, f: fn(f64, f64) -> f64| -> Result<V, Stop> {
        if let Some(numbers) = &numbers {
            return Ok(V::Number(numbers.iter().copied().reduce(f).unwrap_or(f64::NAN), integers));
        }
        let mut texts = Vec::new();
        for one in given {
            texts.push(one.text(line)?.0);
        }
        let nested = texts.into_iter().reduce(|a, b| format!("{own}({a}, {b})")).unwrap_or_default();
        Ok(V::Symbol(nested, Tight::Atom))
    };
    Ok(Some(match (name, given) {
        ("dble" | "real" | "float" | "dfloat" | "sngl", [one]) => match one {
            V::Number(value, _) => V::Number(*value, false),
            other => other.clone(),
        },
        ("int" | "nint", [V::Number(value, _)]) => {
            V::Number(if name == "int" { value.trunc() } else { value.round() }, true)
        }
        ("max" | "dmax1" | "amax1" | "max0" | "fmax", _) => two("max", f64::max)?,
        ("min" | "dmin1" | "amin1" | "min0" | "fmin", _) => two("min", f64::min)?,
        ("atan2" | "datan2", [_, _]) => two("atan2", f64::atan2)?,
        ("mod", [V::Number(a, i), V::Number(b, j)]) => V::Number(a % b, *i && *j),
        ("sign", [V::Number(a, i), V::Number(b, _)]) => V::Number(a.abs() * if *b < 0.0 { -1.0 } else { 1.0 }, *i),
        ("pow" | "pow_dd" | "pow_di", [a, b]) => {
            let real = match a {
                V::Number(value, _) => V::Number(*value, false),
                other => other.clone(),
            };
            binary("**", real, b.clone(), line)?
        }
        ("dot_product", [V::List(a), V::List(b)]) => {
            let mut total = V::Number(0.0, false);
            for (a, b) in a.iter().zip(b) {
                total = binary("+", total, binary("*", a.clone(), b.clone(), line)?, line)?;
            }
            total
        }
        ("sum", [V::List(all)]) => {
            let mut total = V::Number(0.0, false);
            for one in all {
                total = binary("+", total, one.clone(), line)?;
            }
            total
        }
        ("getp", _) => V::Opaque("GETP gives data of AUTO's own, which have no counterpart in a model"),
        ("mod" | "sign" | "int" | "nint", _) => {
            return stop(
                line,
                format!("`{name}` of states or parameters is not translated"),
                "write the model by hand",
            );
        }
        _ => return Ok(None),
    }))
}

impl Default for V {
    fn default() -> V {
        V::Opaque("a function has no value here")
    }
}
