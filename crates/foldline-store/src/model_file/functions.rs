//! Functions and tables of a model.

use super::Reader;
use crate::toml_walk::Value;
use foldline::model::{Field, Function, Interpolation, Item, ModelSource, Outside, Table};
use std::ops::Range;
use toml::de::DeTable;

impl Reader<'_> {
    /// Reads a function such as `"hill(x, K, n)" = "x^n/(K^n + x^n)"`.
    pub(super) fn function(&mut self, head: &str, place: Range<usize>, value: &Value, source: &mut ModelSource) {
        let item = Item::Function(source.functions.len());
        let Some((name, arguments)) = Function::head(head) else {
            let hint = "write the name and its arguments in quotes, as in `\"hill(x, K, n)\" = \"x^n/(K^n + x^n)\"`";
            return self.walk.report(place, format!("`{head}` is not a function name with arguments"), hint);
        };
        let expression = self.expression(item, place, value, &format!("the function `{name}`"));
        source.functions.push(Function { name, arguments, expression });
    }

    /// Reads a table: points, the interpolation between them and the extrapolation beyond them.
    pub(super) fn table(&mut self, name: String, place: Range<usize>, value: &Value, source: &mut ModelSource) {
        let what = format!("the table `{name}`");
        let Some(table) = self.walk.table(value, &what) else { return };
        let item = Item::Table(source.tables.len());
        self.places.insert((item, Field::Name), place.clone());
        self.walk.only(table, &["x", "y", "interpolation", "outside", "description"], &what);
        let mut column = |key: &str| match table.get(key) {
            Some(value) => {
                self.places.insert((item, Field::Value), value.span());
                self.numbers(value, &format!("the values `{key}` of {what}"))
            }
            None => {
                let hint = format!("write `{key} = [0.0, 1.0, 2.0]`");
                self.walk.report(place.clone(), format!("{what} has no `{key}` values"), hint);
                Vec::new()
            }
        };
        let (y, x) = (column("y"), column("x"));
        // Already reported.
        let (x, y) = if x.is_empty() || y.is_empty() { (vec![0.0, 1.0], vec![0.0, 1.0]) } else { (x, y) };
        let interpolation =
            self.choice(table, "interpolation", &[("linear", Interpolation::Linear), ("cubic", Interpolation::Cubic)]);
        let outside = self.choice(table, "outside", &[("linear", Outside::Linear), ("constant", Outside::Constant)]);
        source.tables.push(Table { name, x, y, interpolation, outside });
    }

    /// Reads one of two words; the first is the default.
    fn choice<T: Copy>(&mut self, table: &DeTable, key: &str, among: &[(&str, T); 2]) -> T {
        let Some(value) = table.get(key) else { return among[0].1 };
        let found = among.iter().find(|(word, _)| value.get_ref().as_str() == Some(word));
        if found.is_none() {
            let [(first, _), (second, _)] = among;
            let message = format!("`{key}` is neither \"{first}\" nor \"{second}\"");
            self.walk.report(value.span(), message, format!("write `{key} = \"{first}\"` or `{key} = \"{second}\"`"));
        }
        found.map_or(among[0].1, |(_, own)| *own)
    }
}
