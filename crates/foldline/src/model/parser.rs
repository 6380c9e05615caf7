//! Parser from tokens to a list of terms.
//!
//! **Equations.** Grammar, loosest binding first:
//!
//! 1. comparison = sum [ ( < | <= | > | >= | == | != ) sum ]
//! 2. sum = product { ( + | - ) product }
//! 3. product = signed { ( * | / ) signed }
//! 4. signed = ( + | - ) signed | power
//! 5. power = atom [ ^ signed ], so -x^2 = -(x^2), x^y^z = x^(y^z), and 2^-1 is allowed
//! 6. atom = number | name | name [ comparison ] | name ( comparison { , comparison } ) | ( comparison )
//!
//! The first argument of `sum(j, first, last, term)` is a name, not a value.

use super::callable::{Callables, Callee, SUM};
use super::error::Complaint;
use super::function::{Function, function};
use super::graph::{Binary, Unary};
use super::lexer::{Token, words};
use std::ops::Range;

/// Maximum nesting of brackets, signs and powers.
const DEEPEST: usize = 200;

/// Maximum nesting of sums.
const DEEPEST_SUM: usize = 8;

/// Kind of a term; operands are indices of earlier terms.
#[derive(Clone, Debug)]
pub(super) enum Term {
    Number(f64),
    Name(String),
    Unary(Unary, usize),
    Binary(Binary, usize, usize),
    /// Unused positions repeat the first argument.
    Call(&'static Function, [usize; 3]),
    /// Element of a repeated quantity, with its index.
    Element(String, usize),
    /// Function of the model.
    Apply(usize, Vec<usize>),
    /// Table.
    Lookup(usize, usize),
    /// Sum over an index.
    Sum(Box<Sum>),
}

/// Σ of a term over an index that runs from `first` to `last`.
#[derive(Clone, Debug)]
pub(super) struct Sum {
    pub index: String,
    pub index_span: Range<usize>,
    pub first: usize,
    pub last: usize,
    pub term: Expression,
}

/// Parsed expression: terms, operands before their users; the last term is the whole expression.
#[derive(Clone, Debug, Default)]
pub(super) struct Expression {
    pub terms: Vec<Term>,
    pub spans: Vec<Range<usize>>,
    /// True if it contains an index, a sum or a function of the model.
    pub composite: bool,
}

impl Expression {
    /// Parses `text`.
    pub fn parse(text: &str, callables: &Callables) -> Result<Expression, Complaint> {
        let words = words(text)?;
        if words.is_empty() {
            return Err(Complaint::new(
                0..text.len(),
                "the expression is empty",
                "write a formula such as `a*x - x^3`",
            ));
        }
        let mut parser =
            Parser { callables, words, at: 0, end: text.len(), depth: 0, sums: 0, out: Expression::default() };
        parser.comparison()?;
        match parser.words.get(parser.at) {
            None => Ok(parser.out),
            Some((token, span)) => Err(parser.unexpected(token.clone(), span.clone())),
        }
    }

    /// Visits all terms with their spans, including those inside sums.
    pub fn each(&self, visit: &mut dyn FnMut(&Term, &Range<usize>)) {
        for (term, span) in self.terms.iter().zip(&self.spans) {
            visit(term, span);
            if let Term::Sum(sum) = term {
                sum.term.each(visit);
            }
        }
    }
}

struct Parser<'a> {
    callables: &'a Callables,
    words: Vec<(Token, Range<usize>)>,
    at: usize,
    end: usize,
    depth: usize,
    sums: usize,
    out: Expression,
}

type Parsed = Result<usize, Complaint>;

impl Parser<'_> {
    /// Consumes and returns the next token if it is one of these symbols.
    fn take(&mut self, symbols: &[&str]) -> Option<(&'static str, Range<usize>)> {
        match self.words.get(self.at) {
            Some((Token::Symbol(symbol), span)) if symbols.contains(symbol) => {
                self.at += 1;
                Some((symbol, span.clone()))
            }
            _ => None,
        }
    }

    fn push(&mut self, term: Term, span: Range<usize>) -> usize {
        self.out.terms.push(term);
        self.out.spans.push(span);
        self.out.terms.len() - 1
    }

    fn binary(&mut self, op: Binary, a: usize, b: usize) -> usize {
        let span = self.out.spans[a].start..self.out.spans[b].end;
        self.push(Term::Binary(op, a, b), span)
    }

    fn comparison(&mut self) -> Parsed {
        const SYMBOLS: [&str; 6] = ["<", "<=", ">", ">=", "==", "!="];
        let a = self.sum()?;
        let Some((symbol, _)) = self.take(&SYMBOLS) else { return Ok(a) };
        let b = self.sum()?;
        if let Some((_, span)) = self.take(&SYMBOLS) {
            return Err(Complaint::new(
                span,
                "comparisons cannot be chained",
                "write the two comparisons as a product: `(a < b)*(b < c)`",
            ));
        }
        Ok(match symbol {
            "<" => self.binary(Binary::Less, a, b),
            "<=" => self.binary(Binary::LessOrEqual, a, b),
            ">" => self.binary(Binary::Less, b, a),
            ">=" => self.binary(Binary::LessOrEqual, b, a),
            "==" => self.binary(Binary::Equal, a, b),
            _ => self.binary(Binary::NotEqual, a, b),
        })
    }

    fn sum(&mut self) -> Parsed {
        let mut a = self.product()?;
        while let Some((symbol, _)) = self.take(&["+", "-"]) {
            let b = self.product()?;
            a = self.binary(if symbol == "+" { Binary::Add } else { Binary::Subtract }, a, b);
        }
        Ok(a)
    }

    fn product(&mut self) -> Parsed {
        let mut a = self.signed()?;
        while let Some((symbol, _)) = self.take(&["*", "/"]) {
            let b = self.signed()?;
            a = self.binary(if symbol == "*" { Binary::Multiply } else { Binary::Divide }, a, b);
        }
        Ok(a)
    }

    fn signed(&mut self) -> Parsed {
        self.depth += 1;
        if self.depth > DEEPEST {
            let span = self.words.get(self.at).map_or(self.end..self.end, |word| word.1.clone());
            return Err(Complaint::new(
                span,
                format!("the expression is nested more than {DEEPEST} deep"),
                "name the inner parts in the definitions",
            ));
        }
        let parsed = match self.take(&["+", "-"]) {
            Some(("-", span)) => {
                let a = self.signed()?;
                let span = span.start..self.out.spans[a].end;
                self.push(Term::Unary(Unary::Negate, a), span)
            }
            Some(_) => self.signed()?,
            None => self.power()?,
        };
        self.depth -= 1;
        Ok(parsed)
    }

    fn power(&mut self) -> Parsed {
        let a = self.atom()?;
        if self.take(&["^"]).is_none() {
            return Ok(a);
        }
        let b = self.signed()?;
        Ok(self.binary(Binary::Power, a, b))
    }

    fn atom(&mut self) -> Parsed {
        let Some((token, span)) = self.words.get(self.at).cloned() else {
            return Err(Complaint::new(
                self.end..self.end,
                "the expression ends where a value is expected",
                "write a number, a name or a bracket here",
            ));
        };
        self.at += 1;
        match token {
            Token::Number(value) => Ok(self.push(Term::Number(value), span)),
            Token::Name(name) => match self.take(&["("]) {
                Some((_, open)) if name == SUM => self.series(span, open),
                Some((_, open)) => self.call(name, span, open),
                None => match self.take(&["["]) {
                    Some((_, open)) => self.element(name, span, open),
                    None => Ok(self.push(Term::Name(name), span)),
                },
            },
            Token::Symbol("(") => {
                let inner = self.comparison()?;
                let close = self.close(&span)?;
                self.out.spans[inner] = span.start..close.end;
                Ok(inner)
            }
            Token::Symbol(_) => {
                self.at -= 1;
                Err(self.unexpected(token, span))
            }
        }
    }

    fn call(&mut self, name: String, span: Range<usize>, open: Range<usize>) -> Parsed {
        let mut arguments = Vec::new();
        let close = match self.take(&[")"]) {
            Some((_, close)) => close,
            None => loop {
                arguments.push(self.comparison()?);
                if self.take(&[","]).is_none() {
                    break self.close(&open)?;
                }
            },
        };
        let whole = span.start..close.end;
        let own = self.callables.get(&name);
        let (arity, signature) = match (function(&name), own) {
            (Some(function), _) => (function.arity(), function.signature),
            (None, Some(own)) => (own.arity, own.signature.as_str()),
            (None, None) => return Err(Complaint::unknown_function(name, span, self.callables)),
        };
        if arguments.len() != arity {
            let plural = if arity == 1 { "" } else { "s" };
            return Err(Complaint::new(
                whole,
                format!("`{name}` takes {arity} argument{plural}, {} given", arguments.len()),
                format!("write `{signature}`"),
            ));
        }
        let Some(function) = function(&name) else {
            self.out.composite = true;
            let term = match own.map(|own| own.callee) {
                Some(Callee::Table(table)) => Term::Lookup(table, arguments[0]),
                Some(Callee::Function(number)) => Term::Apply(number, arguments),
                None => return Err(Complaint::unknown_function(name, span, self.callables)),
            };
            return Ok(self.push(term, whole));
        };
        let first = arguments[0];
        let place = |i: usize| arguments.get(i).copied().unwrap_or(first);
        Ok(self.push(Term::Call(function, [first, place(1), place(2)]), whole))
    }

    /// Parses the rest of `name[index]`.
    fn element(&mut self, name: String, span: Range<usize>, open: Range<usize>) -> Parsed {
        let index = self.comparison()?;
        let Some((_, close)) = self.take(&["]"]) else {
            return Err(Complaint::new(open, "this bracket is never closed", "add the missing `]` after the index"));
        };
        self.out.composite = true;
        Ok(self.push(Term::Element(name, index), span.start..close.end))
    }

    /// Parses the rest of `sum(index, first, last, term)`.
    fn series(&mut self, span: Range<usize>, open: Range<usize>) -> Parsed {
        let form = |span: Range<usize>| {
            let hint = "write the index, its first and last value, and the term: `sum(j, 1, n, x[j])`";
            Complaint::new(span, "`sum` is not written correctly", hint)
        };
        let Some((Token::Name(index), index_span)) = self.words.get(self.at).cloned() else {
            return Err(form(span.start..open.end));
        };
        self.at += 1;
        let comma = |parser: &mut Self| parser.take(&[","]).map(|_| ()).ok_or_else(|| form(span.start..open.end));
        comma(self)?;
        let first = self.comparison()?;
        comma(self)?;
        let last = self.comparison()?;
        comma(self)?;
        self.sums += 1;
        if self.sums > DEEPEST_SUM {
            let message = format!("sums are nested more than {DEEPEST_SUM} deep");
            return Err(Complaint::new(span, message, "name the inner sums in the definitions"));
        }
        let outer = std::mem::take(&mut self.out);
        self.comparison()?;
        self.sums -= 1;
        let term = std::mem::replace(&mut self.out, outer);
        let close = self.close(&open)?;
        self.out.composite = true;
        let sum = Sum { index, index_span, first, last, term };
        Ok(self.push(Term::Sum(Box::new(sum)), span.start..close.end))
    }

    /// Consumes the bracket that closes the one at `open`.
    fn close(&mut self, open: &Range<usize>) -> Result<Range<usize>, Complaint> {
        if let Some((_, close)) = self.take(&[")"]) {
            return Ok(close);
        }
        match self.words.get(self.at) {
            None => Err(Complaint::new(
                open.clone(),
                "this bracket is never closed",
                "add the missing `)` before the end of the expression",
            )),
            Some((Token::Symbol(","), span)) => Err(Complaint::new(
                span.clone(),
                "a comma outside the arguments of a function",
                "close the bracket before the comma, or write a decimal point instead of a comma",
            )),
            Some((token, span)) => Err(self.unexpected(token.clone(), span.clone())),
        }
    }

    /// Error for a misplaced token.
    fn unexpected(&self, token: Token, span: Range<usize>) -> Complaint {
        let after_value = self.at > 0
            && match &self.words[self.at - 1].0 {
                Token::Number(_) | Token::Name(_) => true,
                Token::Symbol(symbol) => matches!(*symbol, ")" | "]"),
            };
        match token {
            Token::Symbol(")") if after_value => {
                Complaint::new(span, "this bracket has no opening bracket", "remove it, or add the missing `(`")
            }
            Token::Symbol(",") if after_value => Complaint::new(
                span,
                "a comma outside the arguments of a function",
                "write a decimal point instead of a comma",
            ),
            Token::Number(_) | Token::Name(_) | Token::Symbol("(") if after_value => {
                let before =
                    |back: usize| self.at.checked_sub(back).and_then(|at| self.words.get(at)).map(|(token, _)| token);
                let named = |token: Option<&Token>, of: &[&str]| matches!(token, Some(Token::Name(name)) if of.contains(&name.as_str()));
                let here = Some(&token);
                if named(here, &["if", "else", "then"]) || named(before(1), &["if", "else", "then"]) {
                    return Complaint::new(
                        span,
                        "an operator is missing before this",
                        "write `if(condition, then, else)`",
                    );
                }
                if named(here, &["and", "or"]) {
                    let hint = "combine conditions with `*` for and, `max(a, b)` for or";
                    return Complaint::new(span, "this word is not an operator", hint);
                }
                if named(before(1), &["not"]) {
                    return Complaint::new(
                        span,
                        "an operator is missing before this",
                        "the opposite of a condition `c` is `1 - (c)`",
                    );
                }
                let hint = match self.words.get(self.at.saturating_sub(1)) {
                    // A power between the name and its argument, as in sin^2(x).
                    Some((Token::Number(power), _))
                        if token == Token::Symbol("(") && before(2) == Some(&Token::Symbol("^")) =>
                    {
                        match before(3) {
                            Some(Token::Name(name)) if function(name).is_some() => {
                                format!("write the power after the argument: `{name}(…)^{power}`")
                            }
                            _ => "write `*` for a product".to_string(),
                        }
                    }
                    Some((Token::Name(name), _)) if function(name).is_some() => {
                        format!("write `*` for a product, or brackets around an argument: `{name}(…)`")
                    }
                    _ => "write `*` for a product".to_string(),
                };
                Complaint::new(span, "an operator is missing before this", hint)
            }
            Token::Symbol("[") => {
                Complaint::new(span, "an index belongs to a name", "write it after the name, as in `x[i+1]`")
            }
            Token::Symbol(symbol) => Complaint::new(
                span,
                format!("unexpected `{symbol}`"),
                "a value is expected here: a number, a name or a bracket",
            ),
            Token::Number(_) | Token::Name(_) => {
                Complaint::new(span, "unexpected value", "write an operator before it")
            }
        }
    }
}
