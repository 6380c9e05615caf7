//! `[interval]`, `[boundary]` and `[integrals]`: boundary-value problems.

use super::Reader;
use foldline::model::{Boundary, Definition, Field, Forcing, Item};
use toml::de::{DeTable, DeValue};

/// Name of the independent variable unless the model gives another one.
const VARIABLE: &str = "t";

impl Reader<'_> {
    /// Reads the conditions, and the length of the interval, whose positions are those of a forcing; `None` without
    /// any of the three tables.
    pub(super) fn boundary(&mut self, root: &DeTable) -> Option<(Boundary, Option<Forcing>)> {
        let own = ["interval", "boundary", "integrals"];
        let first = own.iter().find_map(|key| root.get(*key))?;
        if let (Some(value), true) = (root.get("forcing"), root.contains_key("interval")) {
            let hint = "keep [interval]: in the equations its independent variable takes the place of the time";
            self.walk.report(value.span(), "the model has both [forcing] and [interval]", hint);
        }
        let mut boundary = Boundary { variable: VARIABLE.into(), ..Boundary::default() };
        let mut length = None;
        self.places.insert((Item::Solve, Field::Name), first.span());
        self.places.insert((Item::Forcing, Field::Name), first.span());
        if let Some(value) = root.get("interval")
            && let Some(table) = self.walk.table(value, "`interval`")
        {
            self.walk.only(table, &["length", "variable", "solve"], "`interval`");
            if let Some(own) = table.get("length") {
                let expression = self.expression(Item::Forcing, own.span(), own, "the length of the interval");
                length = Some(Forcing { is_frequency: false, expression });
            }
            let variable = table.get("variable").and_then(|own| self.walk.string(own, "`variable`"));
            boundary.variable = variable.unwrap_or(boundary.variable);
            if let Some(own) = table.get("solve") {
                self.places.insert((Item::Solve, Field::Name), own.span());
                boundary.solve = self.names(own);
            }
        }
        for (i, (name, place, value)) in self.entries(root, "boundary").into_iter().enumerate() {
            let what = format!("the boundary condition `{name}`");
            let expression = self.expression(Item::Condition(i), place, value, &what);
            boundary.conditions.push(Definition::new(&name, &expression));
        }
        for (i, (name, place, value)) in self.entries(root, "integrals").into_iter().enumerate() {
            let what = format!("the integral condition `{name}`");
            let expression = self.expression(Item::Integral(i), place, value, &what);
            boundary.integrals.push(Definition::new(&name, &expression));
        }
        Some((boundary, length))
    }

    /// Reads one name or a list of names.
    fn names(&mut self, value: &crate::toml_walk::Value) -> Vec<String> {
        match value.get_ref() {
            DeValue::Array(list) => {
                list.iter().filter_map(|own| self.walk.string(own, "a name under `solve`")).collect()
            }
            _ => self.walk.string(value, "`solve`").into_iter().collect(),
        }
    }
}
