//! Unbalance, rings and other forces.

use super::Draft;
use crate::model_file::Reader;
use foldline::model::{Field, Function, Item, ModelSource};
use foldline_shaft::{Assembled, Centre, Coefficient, Contact, Film, Force, Frame, Law, Rotor, Unbalance};
use std::ops::Range;
use toml::de::DeTable;

impl Reader<'_> {
    pub(super) fn unbalances(
        &mut self,
        root: &DeTable,
        source: &mut ModelSource,
        draft: &mut Draft,
        rotor: &mut Rotor,
    ) {
        for (k, (span, table)) in self.walk.tables(root, "unbalance").into_iter().enumerate() {
            let whose = format!("unbalance {k}");
            self.walk.only(table, &["node", "at", "amount", "phase"], &whose);
            let at = self.station(&span, table, &whose, rotor, source);
            let amount = self.required(&span, table, "amount", [&whose, "kg m", "\"1e-3 kg m\""], source, draft);
            let phase = self.optional(table, "phase", [&whose, "rad"], source, draft).unwrap_or(Coefficient::ZERO);
            if let (Some(at), Some(amount)) = (at, amount) {
                rotor.unbalances.push(Unbalance { at, amount, phase });
            }
        }
    }

    pub(super) fn contacts(&mut self, root: &DeTable, source: &mut ModelSource, draft: &mut Draft, rotor: &mut Rotor) {
        const KEYS: [&str; 11] = [
            "name",
            "node",
            "at",
            "clearance",
            "stiffness",
            "friction",
            "radius",
            "slip-velocity",
            "law",
            "width",
            "centre",
        ];
        for (k, (span, table)) in self.walk.tables(root, "contact").into_iter().enumerate() {
            let name = match table.get("name") {
                Some(own) => self.walk.string(own, "the name of the ring").unwrap_or_default(),
                None if k == 0 => "ring".to_string(),
                None => format!("ring_{}", k + 1),
            };
            let whose = format!("the ring `{name}`");
            let plain = name.chars().all(|c| c.is_alphanumeric() || c == '_') && !name.is_empty();
            if !plain || rotor.contacts.iter().any(|own| own.name == name) {
                let hint = "use letters, digits and underscores, and each name once";
                self.walk.report(span.clone(), format!("`{name}` cannot name a ring"), hint);
                continue;
            }
            self.walk.only(table, &KEYS, &whose);
            let at = self.station(&span, table, &whose, rotor, source);
            let clearance = self.required(&span, table, "clearance", [&whose, "m", "\"0.3 mm\""], source, draft);
            let stiffness = self.required(&span, table, "stiffness", [&whose, "N/m", "\"5e6 N/m\""], source, draft);
            let friction = self.optional(table, "friction", [&whose, "1"], source, draft).unwrap_or(Coefficient::ZERO);
            let radius = self.optional(table, "radius", [&whose, "m"], source, draft);
            let reversal = self.optional(table, "slip-velocity", [&whose, "m/s"], source, draft);
            if let (Some(own), None) = (table.get("slip-velocity"), &radius) {
                let hint =
                    "give the radius at which the surfaces slip, as in `radius = \"25 mm\"`, or remove `slip-velocity`";
                self.walk.report(own.span(), format!("{whose} has a slip velocity but no radius"), hint);
            }
            let law = self.law(&span, table, &whose, source, draft);
            let centre = self.centre(table, &whose, source, draft);
            if let (Some(at), Some(clearance), Some(stiffness), Some(law)) = (at, clearance, stiffness, law) {
                rotor.contacts.push(Contact {
                    name,
                    at,
                    clearance,
                    stiffness,
                    friction,
                    radius,
                    reversal,
                    law,
                    centre,
                });
            }
        }
    }

    /// Reads squeeze films.
    pub(super) fn films(&mut self, root: &DeTable, source: &mut ModelSource, draft: &mut Draft, rotor: &mut Rotor) {
        const KEYS: [&str; 8] = ["name", "node", "at", "clearance", "radius", "length", "viscosity", "half"];
        for (k, (span, table)) in self.walk.tables(root, "film").into_iter().enumerate() {
            let name = match table.get("name") {
                Some(own) => self.walk.string(own, "the name of the film").unwrap_or_default(),
                None if k == 0 => "film".to_string(),
                None => format!("film_{}", k + 1),
            };
            let plain = name.chars().all(|c| c.is_alphanumeric() || c == '_') && !name.is_empty();
            let rings = rotor.contacts.iter().map(|own| &own.name);
            if !plain || rings.chain(rotor.films.iter().map(|own| &own.name)).any(|own| *own == name) {
                let hint = "use letters, digits and underscores, and each name of a ring or film once";
                self.walk.report(span.clone(), format!("`{name}` cannot name a film"), hint);
                continue;
            }
            let whose = format!("the film `{name}`");
            self.walk.only(table, &KEYS, &whose);
            let at = self.station(&span, table, &whose, rotor, source);
            let mut own = |reader: &mut Self, key: &str, unit: &str, example: &str| {
                reader.required(&span, table, key, [&whose, unit, example], source, draft)
            };
            let clearance = own(self, "clearance", "m", "\"0.1 mm\"");
            let radius = own(self, "radius", "m", "\"50 mm\"");
            let length = own(self, "length", "m", "\"20 mm\"");
            let viscosity = own(self, "viscosity", "Pa s", "\"0.02 Pa s\"");
            let half = match table.get("half") {
                Some(value) => value.get_ref().as_bool().unwrap_or_else(|| {
                    let hint = "write `half = true` for a film that cavitates where the gap opens, or `half = false`";
                    self.walk.report(value.span(), format!("`half` of {whose} is not true or false"), hint);
                    true
                }),
                None => true,
            };
            if let (Some(at), Some(clearance), Some(radius), Some(length), Some(viscosity)) =
                (at, clearance, radius, length, viscosity)
            {
                rotor.films.push(Film { name, at, clearance, radius, length, viscosity, half });
            }
        }
    }

    fn law(
        &mut self,
        span: &Range<usize>,
        table: &DeTable,
        whose: &str,
        source: &mut ModelSource,
        draft: &mut Draft,
    ) -> Option<Law> {
        let name = table.get("law").map_or(Some("piecewise"), |own| own.get_ref().as_str());
        match name {
            Some("piecewise") => {
                if let Some(own) = table.get("width") {
                    let hint = "remove `width`, or write `law = \"softplus\"` or `law = \"tanh\"`";
                    self.walk.report(own.span(), format!("{whose} has a width, but its law is not smoothed"), hint);
                }
                Some(Law::Piecewise)
            }
            Some("softplus") => {
                self.required(span, table, "width", [whose, "m", "\"1 um\""], source, draft).map(Law::Softplus)
            }
            Some("tanh") => self.required(span, table, "width", [whose, "m", "\"1 um\""], source, draft).map(Law::Tanh),
            _ => {
                let place = table.get("law").map_or(span.clone(), |own| own.span());
                let hint = "write `law = \"piecewise\"`, or \"softplus\" or \"tanh\" with a `width`";
                self.walk.report(place, format!("{whose} has an unknown law"), hint);
                None
            }
        }
    }

    fn centre(&mut self, table: &DeTable, whose: &str, source: &mut ModelSource, draft: &mut Draft) -> Centre {
        let Some(value) = table.get("centre") else { return Centre::Line };
        let list = value.get_ref().as_array().filter(|list| list.len() == 2);
        match (value.get_ref().as_str(), list) {
            (Some("line"), _) => Centre::Line,
            (Some("sagged"), _) => Centre::Sagged,
            (_, Some(list)) => {
                let what = format!("the centre of {whose}");
                let mut one =
                    |k: usize| self.coefficient(&list[k], &what, "m", source, draft).unwrap_or(Coefficient::ZERO);
                Centre::At([one(0), one(1)])
            }
            _ => {
                let hint =
                    "write `centre = \"line\"`, `centre = \"sagged\"`, or a position `centre = [\"0 mm\", \"-1 mm\"]`";
                self.walk.report(value.span(), format!("the centre of {whose} is not understood"), hint);
                Centre::Line
            }
        }
    }

    /// Reads forces as functions of local displacements and velocities.
    pub(super) fn forces(&mut self, root: &DeTable, source: &mut ModelSource, draft: &mut Draft, rotor: &mut Rotor) {
        for (k, (span, table)) in self.walk.tables(root, "force").into_iter().enumerate() {
            let whose = format!("force {k}");
            self.walk.only(table, &["node", "at", "x", "y", "u", "v"], &whose);
            let at = self.station(&span, table, &whose, rotor, source);
            let rotating = table.get("u").is_some() || table.get("v").is_some();
            let fixed = table.get("x").is_some() || table.get("y").is_some();
            if rotating == fixed {
                let hint = "give `x` and `y` in the fixed frame, or `u` and `v` in the rotating frame";
                self.walk.report(span.clone(), format!("{whose} has no components in one frame"), hint);
                continue;
            }
            let axes = if rotating { ["u", "v"] } else { ["x", "y"] };
            let functions = axes.map(|axis| {
                let value = table.get(axis)?;
                let name = format!("rotor_force_{k}_{axis}");
                let item = Item::Function(source.functions.len());
                let expression = self.expression(item, value.span(), value, &format!("`{axis}` of {whose}"));
                let arguments = [axes[0].into(), axes[1].into(), format!("v{}", axes[0]), format!("v{}", axes[1])];
                source.functions.push(Function { name: name.clone(), arguments: arguments.to_vec(), expression });
                self.places.insert((item, Field::Name), value.span());
                draft.forces.push((name.clone(), rotating, value.span()));
                Some(name)
            });
            if let Some(at) = at {
                rotor.forces.push(Force { at, functions, rotating });
            }
        }
    }

    /// Reports forces given along axes that the frame of the equations does not have.
    pub(super) fn axes_of_forces(&mut self, assembled: &Assembled, draft: &Draft) {
        for (_, rotating, span) in &draft.forces {
            let (message, hint) = match (assembled.frame, rotating) {
                (Frame::Rotating, false) | (Frame::Fixed, true) => {
                    let [u, v] = assembled.axes();
                    let frame = if *rotating { "fixed" } else { "rotating" };
                    let message = format!("this force is not along the axes {u} and {v} of the {frame} frame");
                    let reason = match assembled.anisotropy.first() {
                        Some(reason) if *rotating => format!(" ({reason})"),
                        _ => String::new(),
                    };
                    (
                        message,
                        format!(
                            "the equations are in the {frame} frame{reason}: write the force as `{u}` and `{v}`, or choose the other `frame`"
                        ),
                    )
                }
                _ => continue,
            };
            self.walk.report(span.clone(), message, hint);
        }
    }

    pub(super) fn required(
        &mut self,
        span: &Range<usize>,
        table: &DeTable,
        key: &str,
        [whose, unit, example]: [&str; 3],
        source: &mut ModelSource,
        draft: &mut Draft,
    ) -> Option<Coefficient> {
        if table.get(key).is_none() {
            self.walk.report(span.clone(), format!("{whose} has no `{key}`"), format!("write `{key} = {example}`"));
        }
        self.optional(table, key, [whose, unit], source, draft)
    }

    fn optional(
        &mut self,
        table: &DeTable,
        key: &str,
        [whose, unit]: [&str; 2],
        source: &mut ModelSource,
        draft: &mut Draft,
    ) -> Option<Coefficient> {
        self.coefficient(table.get(key)?, &format!("`{key}` of {whose}"), unit, source, draft)
    }
}
