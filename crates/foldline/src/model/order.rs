//! Order of evaluation of definitions, values beyond ends and functions.

use super::check::Check;
use super::error::{Complaint, Field, Item};
use super::family::Layout;
use super::parser::{Expression, Term};
use super::scope::{Local, Scope};
use std::collections::HashMap;
use std::ops::Range;

/// Maximum number of names listed of a circular definition.
const LONGEST_CIRCLE: usize = 12;
/// Maximum nesting of functions that call functions.
const DEEPEST_CALL: usize = 50;

/// Uses of each item, with their positions.
type Uses = Vec<Vec<(usize, Range<usize>)>>;

/// Order in which each item uses only earlier ones, or the cycle that prevents it: its members, and the last use.
fn ordered(uses: &Uses) -> Result<Vec<usize>, (Vec<usize>, Range<usize>)> {
    let mut users: Vec<Vec<usize>> = vec![Vec::new(); uses.len()];
    uses.iter().enumerate().for_each(|(i, list)| list.iter().for_each(|(j, _)| users[*j].push(i)));
    let mut waits_for: Vec<usize> = uses.iter().map(Vec::len).collect();
    let mut settled: Vec<bool> = waits_for.iter().map(|&count| count == 0).collect();
    let mut order: Vec<usize> = (0..uses.len()).filter(|&i| settled[i]).collect();
    let mut next = 0;
    while let Some(&done) = order.get(next) {
        next += 1;
        for &user in &users[done] {
            waits_for[user] -= 1;
            if waits_for[user] == 0 {
                settled[user] = true;
                order.push(user);
            }
        }
    }
    match settled.iter().position(|settled| !settled).and_then(|start| circle(start, uses, &settled)) {
        Some(circle) => Err(circle),
        None => Ok(order),
    }
}

/// Cycle reached from `start` through unsettled items.
fn circle(start: usize, uses: &Uses, settled: &[bool]) -> Option<(Vec<usize>, Range<usize>)> {
    let mut path = vec![start];
    let mut place: HashMap<usize, usize> = HashMap::from([(start, 0)]);
    while let Some((next, span)) = uses[path[path.len() - 1]].iter().find(|(j, _)| !settled[*j]) {
        if let Some(&at) = place.get(next) {
            return Some((path[at..].to_vec(), span.clone()));
        }
        place.insert(*next, path.len());
        path.push(*next);
    }
    None
}

/// `a → b → a`, shortened.
fn chain(mut names: Vec<String>) -> String {
    names.extend(names.first().cloned());
    if names.len() > LONGEST_CIRCLE {
        names.splice(LONGEST_CIRCLE / 2..names.len() - LONGEST_CIRCLE / 2, ["…".to_string()]);
    }
    names.join(" → ")
}

impl Check<'_> {
    /// Rejects functions that call each other circularly or too deeply.
    pub fn calls(&mut self, functions: &[Option<Expression>]) {
        let uses: Uses = functions
            .iter()
            .map(|body| {
                let mut calls = Vec::new();
                body.iter().for_each(|body| {
                    body.each(&mut |term, span| {
                        if let Term::Apply(function, _) = term {
                            calls.push((*function, span.clone()));
                        }
                    });
                });
                calls
            })
            .collect();
        let order = match ordered(&uses) {
            Ok(order) => order,
            Err((members, span)) => {
                let names = members.iter().map(|i| self.source.functions[*i].name.clone()).collect();
                let message = format!("circular function calls: {}", chain(names));
                let hint = "break the cycle: functions are expanded in place and cannot be recursive";
                let last = Item::Function(members[members.len() - 1]);
                return self.complain(last, Field::Expression, Complaint::new(span, message, hint));
            }
        };
        let mut depth = vec![1; functions.len()];
        for i in order {
            depth[i] = 1 + uses[i].iter().map(|(j, _)| depth[*j]).max().unwrap_or(0);
            if depth[i] == DEEPEST_CALL + 1 {
                let message = format!("function calls nested more than {DEEPEST_CALL} deep");
                self.report(Item::Function(i), Field::Name, message, "write the inner ones as definitions");
            }
        }
    }

    /// Orders the pieces so that each uses only earlier ones.
    pub fn order(&mut self, scope: &Scope, layout: &Layout, bodies: &[Option<&Expression>]) -> Vec<usize> {
        let mut uses: Uses = Vec::with_capacity(layout.pieces.len());
        let mut reported: Option<(Item, Field)> = None;
        for (piece, body) in layout.pieces.iter().zip(bodies) {
            let mut own = Vec::new();
            own.extend(piece.rate_of.map(|of| (of, 0..0)));
            let place = (piece.item, piece.field);
            if let Some(body) = body.filter(|_| reported != Some(place)) {
                let index = self.index(piece.item).zip(piece.element).map(|(name, k)| Local::index(name, k as f64));
                if let Err(complaint) = scope.uses(body, index.as_slice(), None, &mut own) {
                    self.complain(piece.item, piece.field, complaint);
                    // The other elements of this expression have the same error.
                    reported = Some(place);
                }
            }
            uses.push(own);
        }
        match ordered(&uses) {
            Ok(order) => order,
            Err((members, span)) => {
                let names = members.iter().map(|i| layout.piece_name(self.source, *i)).collect();
                let last = &layout.pieces[members[members.len() - 1]];
                let message = format!("circular definitions: {}", chain(names));
                let hint = "break the cycle; only a state may depend on itself";
                self.complain(last.item, last.field, Complaint::new(span, message, hint));
                Vec::new()
            }
        }
    }
}
