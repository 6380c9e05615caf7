//! Bearings.

use super::Draft;
use crate::model_file::Reader;
use crate::toml_walk::Value;
use foldline::model::{Interpolation, ModelSource, Outside, Table};
use foldline::units::Unit;
use foldline_shaft::{Bearing, Coefficient, Rotor, SPEED};
use toml::de::DeTable;

const ENTRIES: [[&str; 2]; 4] = [["kxx", "cxx"], ["kxy", "cxy"], ["kyx", "cyx"], ["kyy", "cyy"]];

impl Reader<'_> {
    pub(super) fn bearings(&mut self, root: &DeTable, source: &mut ModelSource, draft: &mut Draft, rotor: &mut Rotor) {
        const KEYS: [&str; 16] = [
            "node", "at", "to", "k", "c", "k-cross", "c-cross", "kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy",
            "table",
        ];
        for (b, (span, table)) in self.walk.tables(root, "bearing").into_iter().enumerate() {
            let whose = format!("bearing {b}");
            self.walk.only(table, &KEYS, &whose);
            let at = self.station(&span, table, &whose, rotor, source);
            let to = match table.get("to") {
                Some(own) => match self.station_of(own, &whose, rotor) {
                    Some(to) => Some(to),
                    None => continue,
                },
                None => None,
            };
            let over_speed = table.get("table").map(|own| self.over_speed(own, b, &whose, rotor)).unwrap_or_default();
            let blocks = [("k", "k-cross", 0, "N/m"), ("c", "c-cross", 1, "N s/m")].map(|(key, cross, which, unit)| {
                let mut one = |key: &str| {
                    let own = table.get(key)?;
                    self.coefficient(own, &format!("`{key}` of {whose}"), unit, source, draft)
                };
                let both = one(key);
                let across = one(cross);
                let entries =
                    ENTRIES.map(|names| one(names[which]).or_else(|| over_speed[which].get(names[which]).cloned()));
                let [xx, xy, yx, yy] = entries;
                for (name, twice) in [
                    (key, both.is_some() && (xx.is_some() || yy.is_some())),
                    (cross, across.is_some() && (xy.is_some() || yx.is_some())),
                ] {
                    if twice {
                        let message = format!("{whose} has `{name}` as well as the entries it stands for");
                        self.walk.report(span.clone(), message, "keep one of them");
                    }
                }
                let zero = || Coefficient::ZERO;
                let diagonal = |own: Option<Coefficient>| own.or_else(|| both.clone()).unwrap_or_else(zero);
                let above = xy.or_else(|| across.clone()).unwrap_or_else(zero);
                let below = yx.or_else(|| across.as_ref().map(Coefficient::negated)).unwrap_or_else(zero);
                [[diagonal(xx), above], [below, diagonal(yy)]]
            });
            let [stiffness, damping] = blocks;
            if stiffness.iter().chain(&damping).flatten().all(Coefficient::is_zero) {
                let hint = "write `k = \"1e7 N/m\"` and `c = \"1e3 N s/m\"`, or kxx, kxy, …, cyy";
                self.walk.report(span.clone(), format!("{whose} has neither stiffness nor damping"), hint);
            }
            if let Some(at) = at {
                rotor.bearings.push(Bearing { at, to, stiffness, damping });
            }
        }
    }

    /// Reads coefficients as functions of the speed: monotone cubics, constant beyond the first and the last speed.
    /// Returns stiffness and damping by name.
    fn over_speed(
        &mut self,
        value: &Value,
        bearing: usize,
        whose: &str,
        rotor: &mut Rotor,
    ) -> [std::collections::HashMap<&'static str, Coefficient>; 2] {
        let mut to = [Default::default(), Default::default()];
        let Some(table) = self.walk.table(value, &format!("the table of {whose}")) else { return to };
        let names: Vec<&'static str> = ENTRIES.iter().flatten().copied().collect();
        let known = [&["speed", "unit"], &names[..]].concat();
        self.walk.only(table, &known, &format!("the table of {whose}"));
        let Some(speeds) = table.get("speed") else {
            let hint = "write `table = { speed = [0, 3000], unit = \"rpm\", kxx = [1e7, 2e7], kyy = [1e7, 2e7] }`";
            return {
                self.walk.report(value.span(), format!("the table of {whose} has no `speed`"), hint);
                to
            };
        };
        let unit = table.get("unit").and_then(|own| self.walk.string(own, "`unit`")).unwrap_or_else(|| "rad/s".into());
        let factor = match Unit::read(&unit).convert(1.0, &Unit::read("rad/s")) {
            Ok(factor) => factor,
            Err(_) => {
                let message = format!("the speeds of {whose} are in {unit}, which is not a unit of speed");
                self.walk.report(
                    table.get("unit").map_or(value.span(), |own| own.span()),
                    message,
                    "write \"rpm\" or \"rad/s\"",
                );
                return to;
            }
        };
        let x: Vec<f64> = self.numbers(speeds, &format!("the speeds of {whose}")).iter().map(|s| s * factor).collect();
        if x.len() < 2 || x.windows(2).any(|pair| pair[1] <= pair[0]) {
            if !x.is_empty() {
                let message = format!("the speeds of {whose} do not increase");
                self.walk.report(speeds.span(), message, "list two or more speeds, lowest first");
            }
            return to;
        }
        for name in names {
            let Some(own) = table.get(name) else { continue };
            let y = self.numbers(own, &format!("`{name}` of {whose}"));
            if y.len() != x.len() {
                if !y.is_empty() {
                    let message = format!("`{name}` of {whose} has {} values for {} speeds", y.len(), x.len());
                    self.walk.report(own.span(), message, "give one value for each speed");
                }
                continue;
            }
            // Equal columns are one table, so that an isotropic bearing is recognised.
            let same = rotor.tables.iter().find(|own| own.x == x && own.y == y).map(|own| own.name.clone());
            let table = same.unwrap_or_else(|| {
                let table = format!("rotor_table_{bearing}_{name}");
                let (interpolation, outside) = (Interpolation::Cubic, Outside::Constant);
                rotor.tables.push(Table { name: table.clone(), x: x.clone(), y, interpolation, outside });
                table
            });
            let coefficient = Coefficient { factor: 1.0, text: Some(format!("{table}({SPEED})")) };
            to[usize::from(name.starts_with('c'))].insert(name, coefficient);
        }
        to
    }
}
