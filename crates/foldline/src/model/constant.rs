//! Numbers given as expressions of constants.

use super::callable::Callables;
use super::error::{Complaint, Field, Item, ModelError};
use super::family::Layout;
use super::function::CONSTANTS;
use super::nearest::suggest;
use super::parser::{Expression, Term};
use super::scope::{Scope, Symbol, Symbols};
use super::source::Constant;
use std::cell::Cell;

/// Evaluates an expression of numbers and `constants`; the span of an error refers to `text`.
///
/// ```
/// use foldline::model::{Constant, constant_value};
/// let n = Constant::new("n", 40.0);
/// assert_eq!(constant_value("n + 1", &[n]), Ok(41.0));
/// ```
pub fn constant_value(text: &str, constants: &[Constant]) -> Result<f64, Box<ModelError>> {
    let own = constants.iter().map(|c| (c.name.as_str(), c.value));
    let symbols: Symbols =
        CONSTANTS.into_iter().chain(own).map(|(name, value)| (name, Symbol::Number(value))).collect();
    value(text, &symbols).map_err(|Complaint { span, message, hint, .. }| {
        let (item, field, name) = (Item::Model, Field::Value, String::new());
        Box::new(ModelError { item, field, name, span: Some(span), message, hint })
    })
}

fn value(text: &str, symbols: &Symbols) -> Result<f64, Complaint> {
    let expression = Expression::parse(text, &Callables::default())?;
    let mut unknown = None;
    expression.each(&mut |term, span| {
        if let Term::Name(name) | Term::Element(name, _) = term
            && unknown.is_none()
            && !symbols.contains_key(name.as_str())
        {
            unknown = Some((name.clone(), span.clone()));
        }
    });
    if let Some((name, span)) = unknown {
        let mut known: Vec<&str> = symbols.keys().copied().collect();
        known.sort();
        let hint = format!("only numbers and [constants] are allowed here; {}", suggest(&name, &known));
        return Err(Complaint::new(span, format!("`{name}` is not a constant"), hint));
    }
    let layout = Layout::default();
    let scope = Scope { symbols, layout: &layout, functions: &[], arguments: &[], spent: Cell::new(0) };
    let value = scope.values(&expression, &[]).last().copied().flatten().filter(|value| value.is_finite());
    value.ok_or_else(|| Complaint::new(0..text.len(), "this is not a finite number", "write numbers and constants"))
}
