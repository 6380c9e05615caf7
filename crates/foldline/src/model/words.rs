//! Errors in the words of expressions: unknown names, misplaced indices, a forcing that depends on a state.

use super::check::{Check, MOST_ERRORS, TIME};
use super::error::{Complaint, Field, Item};
use super::family::{Kind, Layout};
use super::nearest::{nearest, suggest};
use super::parser::{Expression, Term};
use super::scope::Symbol;
use super::source::Ends;
use std::ops::Range;

/// Expression waiting to be examined: position of its use, and names that it shadows.
type Waiting<'e> = (&'e Expression, Option<Range<usize>>, &'e [String]);

impl Check<'_> {
    /// Parses an expression and checks its names; `locals` are valid in it alone.
    pub fn parse(&mut self, item: Item, field: Field, text: &str, locals: &[&str]) -> Option<Expression> {
        let expression = match Expression::parse(text, self.callables) {
            Ok(expression) => expression,
            Err(complaint) => {
                self.complain(item, field, complaint);
                return None;
            }
        };
        let mut found = Vec::new();
        self.misused(&expression, locals, &mut found);
        found.into_iter().for_each(|complaint| self.complain(item, field, complaint));
        Some(expression)
    }

    /// Collects names that have no meaning where they stand.
    fn misused(&self, expression: &Expression, locals: &[&str], found: &mut Vec<Complaint>) {
        for (term, span) in expression.terms.iter().zip(&expression.spans) {
            if found.len() == MOST_ERRORS {
                return;
            }
            let complaint = match term {
                Term::Name(name) if !locals.contains(&name.as_str()) => match self.symbols.get(name.as_str()) {
                    None => self.unknown(name, span.clone()),
                    Some(Symbol::Family(_)) => {
                        let message = format!("`{name}` is repeated over an index");
                        let hint = format!(
                            "give the element: `{name}[i]`, `{name}[1]`; add them up with `sum(j, 1, n, {name}[j])`"
                        );
                        Complaint::new(span.clone(), message, hint)
                    }
                    Some(_) => continue,
                },
                Term::Element(name, _) => match self.symbols.get(name.as_str()) {
                    _ if locals.contains(&name.as_str()) => {
                        let hint = format!("write `{name}` alone; `[…]` belongs to names with a `count`");
                        Complaint::new(span.clone(), format!("`{name}` has no index"), hint)
                    }
                    None => self.unknown(name, span.start..span.start + name.len()),
                    Some(Symbol::Family(_)) => continue,
                    Some(_) => {
                        let hint = format!("write `{name}` alone, or give it a `count` where it is declared");
                        Complaint::new(span.clone(), format!("`{name}` has no index"), hint)
                    }
                },
                Term::Sum(sum) => {
                    let inner = [locals, &[sum.index.as_str()]].concat();
                    self.misused(&sum.term, &inner, found);
                    let taken = self.symbols.get(sum.index.as_str()).map(|symbol| symbol.article());
                    let taken = taken.or(locals.contains(&sum.index.as_str()).then_some("an index"));
                    let Some(taken) = taken else { continue };
                    let message = format!(
                        "the index `{}` of this sum has a name that is already in use: it is \
                                           {taken}",
                        sum.index
                    );
                    Complaint::new(sum.index_span.clone(), message, "use another letter for the index of the sum")
                }
                _ => continue,
            };
            found.push(complaint);
        }
    }

    fn unknown(&self, name: &str, span: Range<usize>) -> Complaint {
        let repeated = || self.repeats().any(|(_, repeat)| repeat.index == name);
        let counted = matches!(name, "n" | "N") && self.repeats().next().is_some();
        let hint = match self.callables.signature(name) {
            Some(signature) => format!("`{name}` is a function: write `{signature}`"),
            None if name == "time" && self.symbols.contains_key(TIME) => "the time is `t`".into(),
            None if name == TIME || name == "time" => {
                "`t` is defined only for a forced model: give [forcing] with `frequency = \"…\"` (angular) or \
                 `period = \"…\"`"
                    .into()
            }
            None if name.contains('@') && self.source.boundary.is_some() => {
                "`@0` and `@1` follow the name of a state that is not repeated, and are allowed only under [boundary]"
                    .into()
            }
            None if name.contains('@') => {
                "`@0` and `@1` belong to boundary-value problems: give [interval] with its `length`, and [boundary]"
                    .into()
            }
            None if name.ends_with("'''") => {
                let base = name.trim_end_matches('\'');
                super::lexer::first_order_form(base, name.len() - base.len())
            }
            None if name.ends_with("''") => {
                "an acceleration cannot be used in an expression; name its right-hand side in the definitions".into()
            }
            None if name.ends_with('\'') => {
                let base = name.trim_end_matches('\'');
                format!(
                    "`{base}'` exists only if the acceleration of `{base}` is given: `\"{base}''\" = \"…\"` under \
                     [states]"
                )
            }
            None if repeated() => {
                format!(
                    "`{name}` is an index, defined only in items with a `count`; elsewhere write a number, as in \
                     `x[1]`"
                )
            }
            None if counted => {
                format!("define it as a constant: `{name} = 40` under [constants], and `count = \"{name}\"`")
            }
            None if name == "e" => "write `exp(x)` for a power of e; e itself is `exp(1)`".into(),
            None if matches!(name, "π" | "Pi" | "PI") => "write `pi`".into(),
            None if name.ends_with(['²', '³']) => {
                let base = name.trim_end_matches(['²', '³']);
                format!("write `{base}^{}`", if name.ends_with('²') { 2 } else { 3 })
            }
            None => {
                let mut known: Vec<&str> = self.symbols.keys().copied().collect();
                known.sort();
                match nearest(name, known.iter().copied()) {
                    Some(_) => suggest(name, &known),
                    None => format!("declare it under [parameters] or [definitions]; {}", suggest(name, &known)),
                }
            }
        };
        match self.source.outputs.iter().any(|output| output.name == name) {
            true => {
                let message = format!("`{name}` is an output, which cannot be used in an expression");
                let hint = "name the expression in the definitions and use that";
                Complaint::new(span, message, hint)
            }
            false => Complaint::new(span, format!("unknown name `{name}`"), hint),
        }
    }

    /// Parsed values beyond the ends, by piece, without those of definitions.
    pub fn beyond(&mut self, layout: &Layout) -> Vec<Option<Expression>> {
        let source = self.source;
        let given = |item: Item, field: Field| {
            let repeat = match item {
                Item::State(i) => source.states[i].repeat.as_ref(),
                Item::Parameter(i) => source.parameters[i].repeat.as_ref(),
                Item::Definition(i) => source.definitions[i].repeat.as_ref(),
                _ => None,
            };
            match (repeat.map(|repeat| &repeat.ends), field) {
                (Some(Ends::Given { before, .. }), Field::Before(k)) => before.get(k),
                (Some(Ends::Given { after, .. }), Field::After(k)) => after.get(k),
                _ => None,
            }
        };
        let texts = layout.pieces.iter().map(|piece| (piece.item, piece.field, given(piece.item, piece.field)));
        texts.map(|(item, field, text)| text.and_then(|text| self.parse(item, field, text, &[]))).collect()
    }

    /// Checks that the period of the forcing depends on parameters only.
    pub fn forcing(
        &mut self,
        expression: &Expression,
        definitions: &[Option<Expression>],
        functions: &[Option<Expression>],
    ) {
        let source = self.source;
        let own = |symbol: Symbol, layout: &Layout| match symbol {
            Symbol::Definition(piece) => match layout.pieces[piece].item {
                Item::Definition(i) => Some(i),
                _ => None,
            },
            Symbol::Family(f) => match layout.families[f].item {
                Item::Definition(i) => Some(i),
                _ => None,
            },
            _ => None,
        };
        let layout = Layout::new(source);
        let mut seen = vec![false; definitions.len()];
        let mut called = vec![false; functions.len()];
        let mut wait: Vec<Waiting> = vec![(expression, None, &[])];
        let mut wrong = None;
        while let Some((next, place, hidden)) = wait.pop() {
            let mut more = Vec::new();
            next.each(&mut |term, span| {
                let span = place.clone().unwrap_or(span.clone());
                match term {
                    Term::Name(name) | Term::Element(name, _) if !hidden.contains(name) => {
                        let Some(symbol) = self.symbols.get(name.as_str()).copied() else { return };
                        let state = match symbol {
                            Symbol::Family(f) => layout.families[f].kind == Kind::State,
                            symbol => matches!(symbol, Symbol::State(_) | Symbol::Time),
                        };
                        if state && wrong.is_none() {
                            let what = if symbol == Symbol::Time { "the time" } else { "a state" };
                            wrong = Some((name.clone(), what, span));
                        } else if let Some(j) = own(symbol, &layout)
                            && !std::mem::replace(&mut seen[j], true)
                        {
                            more.push((definitions[j].as_ref(), span, &[] as &[String]));
                        }
                    }
                    Term::Apply(f, _) if !std::mem::replace(&mut called[*f], true) => {
                        more.push((functions[*f].as_ref(), span, &source.functions[*f].arguments));
                    }
                    _ => {}
                }
            });
            wait.extend(more.into_iter().filter_map(|(body, span, hidden)| Some((body?, Some(span), hidden))));
        }
        if let Some((name, what, span)) = wrong {
            let [own, hint] = match source.boundary {
                None => ["the forcing", "its frequency or period may contain only numbers and parameters"],
                Some(_) => ["the length of the interval", "it may contain only numbers and parameters"],
            };
            let message = format!("{own} depends on `{name}`, which is {what}");
            self.complain(Item::Forcing, Field::Expression, Complaint::new(span, message, hint));
        }
    }
}
