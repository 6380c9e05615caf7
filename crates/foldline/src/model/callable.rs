//! Functions and tables of the model, callable from expressions beside the built-in functions.

use super::function::{FUNCTIONS, function};
use super::source::ModelSource;
use std::collections::HashMap;

/// Name of the sum over an index.
pub(super) const SUM: &str = "sum";

/// Target of a call, by position in the source.
#[derive(Clone, Copy, Debug)]
pub(super) enum Callee {
    Function(usize),
    Table(usize),
}

/// Function or table of the model.
#[derive(Debug)]
pub(super) struct Callable {
    pub callee: Callee,
    pub arity: usize,
    pub signature: String,
}

/// Functions and tables of a model, by name.
#[derive(Debug, Default)]
pub(super) struct Callables {
    own: HashMap<String, Callable>,
}

impl Callables {
    /// Collects the functions and tables of `source`; of two with the same name, the first.
    pub fn new(source: &ModelSource) -> Callables {
        let mut own: HashMap<String, Callable> = HashMap::new();
        for (i, f) in source.functions.iter().enumerate() {
            let signature = format!("{}({})", f.name, f.arguments.join(", "));
            let callable = Callable { callee: Callee::Function(i), arity: f.arguments.len(), signature };
            own.entry(f.name.clone()).or_insert(callable);
        }
        for (i, table) in source.tables.iter().enumerate() {
            let signature = format!("{}(x)", table.name);
            let callable = Callable { callee: Callee::Table(i), arity: 1, signature };
            own.entry(table.name.clone()).or_insert(callable);
        }
        Callables { own }
    }

    /// Function or table of the model with the given name.
    pub fn get(&self, name: &str) -> Option<&Callable> {
        self.own.get(name)
    }

    /// Names of all functions, built-in ones first.
    pub fn names(&self) -> Vec<&str> {
        let mut own: Vec<&str> = self.own.keys().map(String::as_str).collect();
        own.sort();
        FUNCTIONS.iter().map(|f| f.name).chain([SUM]).chain(own).collect()
    }

    /// Signature of the function with the given name.
    pub fn signature(&self, name: &str) -> Option<&str> {
        match (function(name), self.own.get(name)) {
            (Some(function), _) => Some(function.signature),
            (None, Some(own)) => Some(&own.signature),
            (None, None) => (name == SUM).then_some("sum(j, 1, n, x[j])"),
        }
    }
}
