//! Units of expressions.

use super::form::Form;
use super::names::Names;
use super::system::{Finding, Outcome, Place, Severity, System};
use crate::model::callable::Callables;
use crate::model::check::TIME;
use crate::model::error::{Field, Item};
use crate::model::function::{Function, Meaning};
use crate::model::graph::{Binary, Id, Unary};
use crate::model::parser::{Expression, Sum, Term};
use crate::model::scope::{Local, Scope};
use crate::model::source::ModelSource;
use std::ops::Range;

/// Maximum number of terms examined: nested function calls multiply.
const MOST_TERMS: usize = 500_000;

/// Name local to one expression: an index, or an argument with its unit.
#[derive(Clone)]
struct Bound<'e> {
    name: &'e str,
    form: Form,
    /// Value if made of numbers only, and value if parameters take the values of the model.
    value: Option<f64>,
    default: Option<f64>,
}

/// Expression with its position.
#[derive(Clone, Copy)]
struct Body<'e> {
    item: Item,
    field: Field,
    text: &'e str,
    expression: &'e Expression,
    locals: &'e [Bound<'e>],
    /// Part of the model whose unit is being determined, for messages.
    from: &'e str,
}

pub(super) struct Walk<'a> {
    pub source: &'a ModelSource,
    pub names: Names<'a>,
    pub system: System,
    pub functions: &'a [Option<Expression>],
    /// Values of numbers and of constants without a unit.
    pub numbers: Scope<'a>,
    /// Values of parameters and all constants as well.
    pub defaults: Scope<'a>,
    pub spent: usize,
}

impl<'a> Walk<'a> {
    /// Unit of an expression of the model.
    pub fn form(&mut self, item: Item, field: Field, text: &str, callables: &Callables) -> Form {
        let expression = super::parse(text, callables);
        let from = self.described(item);
        let repeat = match item {
            Item::State(i) => &self.source.states[i].repeat,
            Item::Parameter(i) => &self.source.parameters[i].repeat,
            Item::Definition(i) => &self.source.definitions[i].repeat,
            Item::Output(i) => &self.source.outputs[i].repeat,
            Item::Equation(i) => {
                let own = self.source.states.iter().find(|state| state.name == self.source.equations[i].name);
                own.map_or(&None, |state| &state.repeat)
            }
            _ => &None,
        };
        let index = repeat.as_ref().map(|repeat| index(&repeat.index));
        let body = Body { item, field, text, expression: &expression, locals: index.as_slice(), from: &from };
        self.expression(body)
    }

    /// Description of a part of the model.
    fn described(&self, item: Item) -> String {
        let name = crate::model::check::name_of(self.source, item);
        match item {
            Item::Definition(_) => format!("from the definition of `{name}`"),
            Item::Equation(_) => format!("from the equation of `{name}`"),
            Item::Output(_) => format!("from the output `{name}`"),
            Item::Forcing => "from the forcing".into(),
            Item::Mass(_) => format!("from the masses of `{name}`"),
            _ => format!("from `{name}`"),
        }
    }

    /// Requires the whole expression `text` to have the unit `goal` of `what`.
    pub fn equal(&mut self, item: Item, field: Field, text: &str, form: Form, goal: Form, what: &str) {
        let from = self.described(item);
        let span = 0..text.len();
        let place = Place { item, field, span: span.clone() };
        let strict = matches!(item, Item::Forcing) && self.source.forcing.as_ref().is_some_and(|f| f.is_frequency);
        let residual = form.plus(&goal, -1.0);
        let outcome = self.system.settle(&residual, strict, &place, &from);
        if matches!(outcome, Outcome::Holds) {
            return;
        }
        let [own, other] = [self.system.shown(&form), self.system.shown(&goal)];
        let message = format!("{what} is in {other}, but this is in {own}");
        let inferred = self.system.inferred(&self.mentioned(text));
        let time = match goal.clock() != 0.0 && self.source.time.is_empty() && self.system.differs_in_time(&residual) {
            true => {
                ", or state the unit of time at the top, as in `time = \"ms\"` or, for a pure number, `time = \"1\"`"
            }
            false => "",
        };
        self.tell(outcome, &residual, Place { item, field, span }, message, &format!("{time}{inferred}"));
    }

    /// Names in a text with their units.
    fn mentioned<'t>(&self, text: &'t str) -> Vec<(&'t str, Form)> {
        let words = text.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '\''));
        words.filter(|word| !word.is_empty()).map(|word| (word, self.names.of(word))).collect()
    }

    fn tell(&mut self, outcome: Outcome, residual: &Form, place: Place, message: String, more: &str) {
        let certain = if self.system.is_firm(residual) { Severity::Error } else { Severity::Doubt };
        let (severity, hint) = match outcome {
            Outcome::Holds => return,
            Outcome::Dimension => (certain, format!("correct the formula or a unit{more}")),
            Outcome::Factor(doubtful) => {
                let apart = self.system.apart(residual);
                let hint = format!("a factor of {apart} is missing, or a unit is wrong: correct one of them{more}");
                (if doubtful { Severity::Doubt } else { certain }, hint)
            }
        };
        let hint = format!("{hint}; `units = \"labels\"` at the top of the model leaves all units unchecked");
        let Place { item, field, span } = place;
        self.system.findings.push(Finding { severity, item, field, span, message, hint });
    }

    fn expression(&mut self, body: Body) -> Form {
        let Body { expression, .. } = body;
        self.spent += expression.terms.len();
        if self.spent > MOST_TERMS || expression.terms.is_empty() {
            return Form::any();
        }
        let locals = |value: fn(&Bound) -> Option<f64>| -> Vec<Local> {
            body.locals.iter().map(|own| Local { name: own.name, value: value(own), id: Id(0) }).collect()
        };
        let values = self.numbers.values(expression, &locals(|own| own.value));
        let defaults = self.defaults.values(expression, &locals(|own| own.default));
        let needed = needed(expression, &values);
        let mut forms: Vec<Form> = vec![Form::any(); expression.terms.len()];
        for t in (0..expression.terms.len()).filter(|t| needed[*t]) {
            forms[t] = self.term(body, t, &forms, &values, &defaults);
        }
        forms.pop().unwrap_or_default()
    }

    fn term(&mut self, body: Body, t: usize, forms: &[Form], values: &[Option<f64>], defaults: &[Option<f64>]) -> Form {
        let span = body.expression.spans[t].clone();
        let place = Place { item: body.item, field: body.field, span: span.clone() };
        let text = body.text.get(span.clone()).unwrap_or_default();
        let term = &body.expression.terms[t];
        if let (Some(value), false) = (values[t], taken_apart(term)) {
            return self.system.written(value, text, Some(place));
        }
        match term {
            Term::Number(value) => self.system.written(*value, text, Some(place)),
            Term::Name(name) => match body.locals.iter().rev().find(|own| own.name == name) {
                Some(own) => own.form.clone(),
                None if name == "pi" => self.system.written(std::f64::consts::PI, "pi", Some(place)),
                None if name == TIME && self.source.forcing.is_some() => self.names.time(),
                None => self.names.of(name),
            },
            Term::Element(name, _) => self.names.of(name),
            Term::Unary(Unary::Negate, a) => forms[*a].clone(),
            Term::Unary(..) => Form::default(),
            Term::Binary(op, a, b) => self.binary(body, *op, [*a, *b], forms, defaults),
            Term::Call(function, arguments) => self.call(body, function, arguments, forms),
            Term::Apply(function, arguments) => self.apply(body, *function, arguments, forms, values, defaults),
            Term::Lookup(table, a) => {
                let [argument, value] = self.names.tables[*table].clone();
                self.same(body, [&forms[*a], &argument], body.expression.spans[*a].clone(), "the argument of a table");
                value
            }
            Term::Sum(sum) => self.sum(body, sum),
        }
    }

    fn binary(&mut self, body: Body, op: Binary, [a, b]: [usize; 2], forms: &[Form], defaults: &[Option<f64>]) -> Form {
        let [own, other] = [&forms[a], &forms[b]];
        match op {
            Binary::Multiply => own.plus(other, 1.0),
            Binary::Divide => own.plus(other, -1.0),
            Binary::Power => match defaults[b] {
                Some(power) => own.raised(power),
                // The exponent is an element of a repeated parameter, or varies.
                None if matches!(body.expression.terms[b], Term::Element(..)) => self.system.quantity("a power"),
                None => {
                    self.pure(body, a, own, false, "the base of a power with a variable exponent");
                    self.pure(body, b, other, false, "an exponent");
                    Form::default()
                }
            },
            Binary::Add | Binary::Subtract => self.alike(body, [a, b], forms, "added"),
            _ => {
                self.alike(body, [a, b], forms, "compared");
                Form::default()
            }
        }
    }

    fn call(&mut self, body: Body, function: &Function, arguments: &[usize; 3], forms: &[Form]) -> Form {
        let [a, b, c] = *arguments;
        match function.name {
            "sqrt" => forms[a].raised(0.5),
            "cbrt" => forms[a].raised(1.0 / 3.0),
            "abs" => forms[a].clone(),
            "sign" | "heaviside" => Form::default(),
            "min" | "max" | "hypot" | "mod" => self.alike(body, [a, b], forms, "compared"),
            "atan2" => {
                self.alike(body, [a, b], forms, "compared");
                Form::default()
            }
            "if" => self.alike(body, [b, c], forms, "alternatives"),
            name => {
                let angle = matches!(name, "sin" | "cos" | "tan");
                self.pure(body, a, &forms[a], angle, &format!("the argument of {name}"));
                Form::default()
            }
        }
    }

    /// Requires two terms to have equal units; returns that unit.
    fn alike(&mut self, body: Body, [a, b]: [usize; 2], forms: &[Form], done: &str) -> Form {
        let [own, other] = [&forms[a], &forms[b]];
        if own.any || other.any {
            return if own.any { other.clone() } else { own.clone() };
        }
        let spans = &body.expression.spans;
        let place = Place { item: body.item, field: body.field, span: spans[b].clone() };
        let residual = own.plus(other, -1.0);
        let outcome = self.system.settle(&residual, false, &place, body.from);
        if !matches!(outcome, Outcome::Holds) {
            let text = |k: usize| body.text.get(spans[k].clone()).unwrap_or_default().to_string();
            let units = [own, other].map(|form| self.system.shown(form));
            let message =
                format!("`{}` is in {} and `{}` in {}: they cannot be {done}", text(a), units[0], text(b), units[1]);
            let both = format!("{} {}", text(a), text(b));
            let inferred = self.system.inferred(&self.mentioned(&both));
            self.tell(outcome, &residual, place, message, &inferred);
            // Report once; do not follow up consequences.
            return Form::any();
        }
        // Return the more informative one: a number has the unit of the term it is added to.
        if self.system.resolved(own).dimension().next().is_some() { own.clone() } else { other.clone() }
    }

    /// Requires a term to be dimensionless; with `angle`, a turn counts as 2π.
    fn pure(&mut self, body: Body, term: usize, form: &Form, angle: bool, what: &str) {
        let place = Place { item: body.item, field: body.field, span: body.expression.spans[term].clone() };
        let outcome = self.system.settle(form, angle, &place, body.from);
        if matches!(outcome, Outcome::Holds) {
            return;
        }
        let wanted = if angle { "an angle in rad" } else { "a pure number" };
        let message = format!("{what} is in {}, but must be {wanted}", self.system.shown(form));
        let text = body.text.get(place.span.clone()).unwrap_or_default();
        let inferred = self.system.inferred(&self.mentioned(text));
        self.tell(outcome, form, place, message, &inferred);
    }

    /// Requires two units to be equal.
    fn same(&mut self, body: Body, [own, other]: [&Form; 2], span: Range<usize>, what: &str) {
        let place = Place { item: body.item, field: body.field, span };
        let residual = own.plus(other, -1.0);
        let outcome = self.system.settle(&residual, false, &place, body.from);
        if !matches!(outcome, Outcome::Holds) {
            let [own, other] = [own, other].map(|form| self.system.shown(form));
            let message = format!("{what} is in {own} here, but in {other} elsewhere");
            self.tell(outcome, &residual, place, message, "");
        }
    }

    /// Unit of a call of a model function, with the units of its arguments.
    fn apply(
        &mut self,
        body: Body,
        function: usize,
        arguments: &[usize],
        forms: &[Form],
        values: &[Option<f64>],
        defaults: &[Option<f64>],
    ) -> Form {
        let functions = self.functions;
        let (Some(inner), own) = (&functions[function], &self.source.functions[function]) else { return Form::any() };
        let bound: Vec<Bound> = own
            .arguments
            .iter()
            .zip(arguments)
            .map(|(name, a)| Bound { name, form: forms[*a].clone(), value: values[*a], default: defaults[*a] })
            .collect();
        let item = Item::Function(function);
        let text = own.expression.as_str();
        self.expression(Body {
            item,
            field: Field::Expression,
            text,
            expression: inner,
            locals: &bound,
            from: body.from,
        })
    }

    fn sum(&mut self, body: Body, sum: &Sum) -> Form {
        let locals = [body.locals, &[index(&sum.index)]].concat();
        self.expression(Body { expression: &sum.term, locals: &locals, ..body })
    }
}

/// Index, a dimensionless number.
fn index(name: &str) -> Bound<'_> {
    Bound { name, form: Form::default(), value: None, default: None }
}

/// True for products of numbers, whose factors may be conversion factors individually.
fn taken_apart(term: &Term) -> bool {
    match term {
        Term::Binary(op, ..) => matches!(op, Binary::Multiply | Binary::Divide | Binary::Power),
        Term::Unary(op, _) => *op == Unary::Negate,
        Term::Number(_) | Term::Name(_) => true,
        _ => false,
    }
}

/// Marks terms whose unit matters: not indices, exponents with a value, or branches that are never taken.
fn needed(expression: &Expression, values: &[Option<f64>]) -> Vec<bool> {
    let mut needed = vec![false; expression.terms.len()];
    needed.iter_mut().last().into_iter().for_each(|last| *last = true);
    for (t, term) in expression.terms.iter().enumerate().rev() {
        if !needed[t] || values[t].is_some() && !taken_apart(term) {
            continue;
        }
        match term {
            Term::Number(_) | Term::Name(_) | Term::Element(..) | Term::Sum(_) => {}
            Term::Unary(_, a) | Term::Lookup(_, a) => needed[*a] = true,
            Term::Binary(Binary::Power, a, b) if values[*b].is_some() => needed[*a] = true,
            Term::Binary(_, a, b) => [a, b].into_iter().for_each(|a| needed[*a] = true),
            Term::Call(Function { meaning: Meaning::If, .. }, [c, a, b]) => match values[*c] {
                Some(c) => needed[if c != 0.0 { *a } else { *b }] = true,
                None => [c, a, b].into_iter().for_each(|a| needed[*a] = true),
            },
            Term::Call(function, arguments) => arguments.iter().take(function.arity()).for_each(|a| needed[*a] = true),
            Term::Apply(_, arguments) => arguments.iter().for_each(|a| needed[*a] = true),
        }
    }
    needed
}
