//! `[events.NAME]`: instants at which states jump. `[contact.NAME]`: walls and stops, written as events or as forces.

use super::Reader;
use crate::toml_walk::Value;
use foldline::model::{Definition, Event, Field, Item, ModelSource, Passing};
use std::ops::Range;
use toml::de::{DeTable, DeValue};

const EVENT: [&str; 4] = ["when", "direction", "set", "allowed"];
const CONTACT: [&str; 7] = ["at", "velocity", "clearance", "side", "stiffness", "damping", "restitution"];

/// Side of a wall on a single coordinate.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Above,
    Below,
    Both,
}

impl Reader<'_> {
    /// Reads the events, then the contacts of a model that is not a rotor.
    pub(super) fn events(&mut self, root: &DeTable, source: &mut ModelSource) {
        for (name, place, value) in self.entries(root, "events") {
            self.event(name, place, value, source);
        }
        // The rings of a rotor are a list, `[[contact]]`.
        if root.get("contact").is_some_and(|own| own.get_ref().as_table().is_some()) {
            for (name, place, value) in self.entries(root, "contact") {
                self.contact(name, place, value, source);
            }
        }
    }

    fn event(&mut self, name: String, place: Range<usize>, value: &Value, source: &mut ModelSource) {
        let whose = format!("the event `{name}`");
        let Some(table) = self.walk.table(value, &whose) else { return };
        self.walk.only(table, &EVENT, &whose);
        let item = Item::Event(source.events.len());
        self.places.insert((item, Field::Name), place.clone());
        let Some(when) = table.get("when") else {
            let hint = "give the expression at whose zero it occurs, as in `when = \"x - d\"`";
            return self.walk.report(place, format!("{whose} has no `when`"), hint);
        };
        let when = self.event_text(item, Field::Expression, when, &format!("`when` of {whose}"));
        let direction = table.get("direction").map_or(Some(Passing::Up), |own| match own.get_ref().as_str() {
            Some("up") => Some(Passing::Up),
            Some("down") => Some(Passing::Down),
            Some("both") => Some(Passing::Either),
            _ => {
                let hint = "write `direction = \"up\"` where `when` becomes positive, \"down\" or \"both\"";
                self.walk.report(own.span(), format!("the direction of {whose} is none"), hint);
                None
            }
        });
        let mut set = Vec::new();
        if let Some(own) = table.get("set")
            && let Some(values) = self.walk.table(own, &format!("`set` of {whose}"))
        {
            let mut all: Vec<_> = values.iter().collect();
            all.sort_by_key(|(key, _)| key.span().start);
            for (key, value) in all {
                let what = format!("the new value of `{}`", key.get_ref());
                let expression = self.event_text(item, Field::Set(set.len()), value, &what);
                set.push(Definition::new(key.get_ref(), &expression));
            }
        }
        let allowed = table.get("allowed");
        let allowed = allowed.map(|own| self.event_text(item, Field::Allowed, own, &format!("`allowed` of {whose}")));
        let direction = direction.unwrap_or_default();
        source.events.push(Event { name, when, direction, set, allowed });
    }

    /// Reads an expression of an event and notes its position.
    fn event_text(&mut self, item: Item, field: Field, value: &Value, what: &str) -> String {
        self.places.insert((item, field), value.span());
        self.formula(value, what)
    }

    /// Reads an expression that is a text or a number; `0` after a mistake.
    fn formula(&mut self, value: &Value, what: &str) -> String {
        match value.get_ref() {
            DeValue::Integer(_) | DeValue::Float(_) => {
                self.walk.number(value, what).map_or_else(|| "0".into(), |number| format!("{number:?}"))
            }
            _ => self.walk.string(value, what).unwrap_or_else(|| "0".into()),
        }
    }

    /// Names of one or two coordinates.
    fn coordinates(&mut self, value: &Value, what: &str) -> Option<Vec<String>> {
        let names: Option<Vec<String>> = match value.get_ref() {
            DeValue::Array(list) => list.iter().map(|own| self.walk.string(own, what)).collect(),
            _ => self.walk.string(value, what).map(|own| vec![own]),
        };
        let names = names?;
        if names.is_empty() || names.len() > 2 {
            let hint = "name one state, as in `at = \"x\"`, or two for a round clearance, as in `at = [\"u\", \"v\"]`";
            self.walk.report(value.span(), format!("{what} names {} states", names.len()), hint);
            return None;
        }
        Some(names)
    }

    fn contact(&mut self, name: String, place: Range<usize>, value: &Value, source: &mut ModelSource) {
        let whose = format!("the contact `{name}`");
        let Some(table) = self.walk.table(value, &whose) else { return };
        let before = self.walk.found.len();
        self.walk.only(table, &CONTACT, &whose);
        let missing = |reader: &mut Self, key: &str, hint: &str| {
            reader.walk.report(place.clone(), format!("{whose} has no `{key}`"), hint);
        };
        let Some(at) = table.get("at") else {
            return missing(self, "at", "name the state that is limited, as in `at = \"x\"`");
        };
        let Some(clearance) = table.get("clearance") else {
            return missing(self, "clearance", "give the position of the wall, as in `clearance = \"d\"`");
        };
        let (clearance_place, clearance) = (clearance.span(), self.formula(clearance, "the clearance"));
        let Some(coordinates) = self.coordinates(at, "`at`") else { return };
        let velocities = match table.get("velocity") {
            Some(own) => self.coordinates(own, "`velocity`"),
            None => {
                let named: Vec<String> = coordinates.iter().map(|x| format!("{x}'")).collect();
                let known = |name: &String| source.states.iter().any(|own| own.name == *name);
                if !named.iter().all(known) {
                    let hint = "name the velocity, as in `velocity = \"v\"`, or write the equation of motion as that of \
                                an acceleration, \"x''\"";
                    self.walk.report(at.span(), format!("{whose} is on a state without a velocity"), hint);
                    return;
                }
                Some(named)
            }
        };
        let Some(velocities) = velocities else { return };
        if velocities.len() != coordinates.len() {
            let hint = "give as many velocities as coordinates, in the same order";
            self.walk.report(at.span(), format!("{whose} has coordinates without a velocity"), hint);
            return;
        }
        let round = coordinates.len() == 2;
        let side = match table.get("side").map(|own| (own.span(), own.get_ref().as_str())) {
            None => Side::Above,
            Some((span, _)) if round => {
                self.walk.report(span, "a round clearance has no sides", "remove `side`");
                Side::Above
            }
            Some((_, Some("above"))) => Side::Above,
            Some((_, Some("below"))) => Side::Below,
            Some((_, Some("both"))) => Side::Both,
            Some((span, _)) => {
                let hint = "write `side = \"above\"` for a wall that limits the coordinate from above, \"below\", or \
                            \"both\" for walls at plus and minus the clearance";
                return self.walk.report(span, format!("{whose} is on no side"), hint);
            }
        };
        let law = (table.get("stiffness"), table.get("restitution"));
        match law {
            (Some(stiffness), None) => {
                let stiffness = self.formula(stiffness, "the stiffness");
                let damping = table.get("damping").map(|own| self.formula(own, "the damping"));
                if self.walk.found.len() == before {
                    let states = [&coordinates[..], &velocities[..]];
                    let force = force(states, &clearance, side, &stiffness, damping.as_deref());
                    self.push_forces(&place, &whose, &velocities, force, source);
                }
            }
            (None, Some(restitution)) => {
                let span = restitution.span();
                let restitution = self.formula(restitution, "the restitution");
                if let Some(own) = table.get("damping") {
                    let hint = "the restitution is the loss of a rigid wall: remove `damping`";
                    self.walk.report(own.span(), format!("{whose} is rigid and has damping"), hint);
                }
                if self.walk.found.len() > before {
                    return;
                }
                for event in impacts(&name, &coordinates, &velocities, &clearance, side, &restitution) {
                    let item = Item::Event(source.events.len());
                    self.places.insert((item, Field::Name), place.clone());
                    self.places.insert((item, Field::Expression), clearance_place.clone());
                    (0..event.set.len()).for_each(|k| _ = self.places.insert((item, Field::Set(k)), span.clone()));
                    source.events.push(event);
                }
            }
            _ => {
                let both = law.0.is_some();
                let what = if both { "both a stiffness and a restitution" } else { "no stiffness and no restitution" };
                let hint = "give `stiffness = \"k\"` for an elastic wall or `restitution = \"e\"` for a rigid one";
                self.walk.report(place, format!("{whose} has {what}"), hint);
            }
        }
    }

    /// Adds forces to the equations of the velocities.
    fn push_forces(
        &mut self,
        place: &Range<usize>,
        whose: &str,
        velocities: &[String],
        forces: Vec<String>,
        source: &mut ModelSource,
    ) {
        for (velocity, force) in velocities.iter().zip(forces) {
            match source.equations.iter_mut().find(|own| own.name == *velocity) {
                Some(own) => own.expression += &format!(" - {force}"),
                None => {
                    let hint = "the force is added to the equation of the velocity: give that equation";
                    self.walk.report(place.clone(), format!("{whose}: `{velocity}` has no equation"), hint);
                }
            }
        }
    }
}

/// Forces of an elastic wall on every coordinate, to be subtracted.
fn force(
    [coordinates, velocities]: [&[String]; 2],
    clearance: &str,
    side: Side,
    stiffness: &str,
    damping: Option<&str>,
) -> Vec<String> {
    if let ([u, v], [du, dv]) = (coordinates, velocities) {
        let (r, depth) = (format!("hypot({u}, {v})"), format!("hypot({u}, {v}) - ({clearance})"));
        let lost = damping.map_or(String::new(), |c| format!(" + ({c})*({u}*{du} + {v}*{dv})/{r}"));
        let force = format!("if({depth} > 0, (({stiffness})*({depth}){lost})/{r}, 0)");
        return vec![format!("{u}*{force}"), format!("{v}*{force}")];
    }
    let (x, v) = (&coordinates[0], &velocities[0]);
    let above = match damping {
        None => format!("({stiffness})*max({x} - ({clearance}), 0)"),
        Some(c) => format!("if({x} > {clearance}, ({stiffness})*({x} - ({clearance})) + ({c})*{v}, 0)"),
    };
    let beyond = |wall: String| match damping {
        None => format!("({stiffness})*min({x} - ({wall}), 0)"),
        Some(c) => format!("if({x} < {wall}, ({stiffness})*({x} - ({wall})) + ({c})*{v}, 0)"),
    };
    vec![match side {
        Side::Above => above,
        Side::Below => beyond(clearance.to_string()),
        Side::Both => format!("({above} + {})", beyond(format!("-({clearance})"))),
    }]
}

/// Events of a rigid wall.
fn impacts(
    name: &str,
    coordinates: &[String],
    velocities: &[String],
    clearance: &str,
    side: Side,
    restitution: &str,
) -> Vec<Event> {
    if let ([u, v], [du, dv]) = (coordinates, velocities) {
        let loss = format!("(1 + ({restitution}))*({u}*{du} + {v}*{dv})/({u}^2 + {v}^2)");
        return vec![Event {
            name: name.to_string(),
            when: format!("hypot({u}, {v}) - ({clearance})"),
            direction: Passing::Up,
            set: vec![
                Definition::new(du, &format!("{du} - {loss}*{u}")),
                Definition::new(dv, &format!("{dv} - {loss}*{v}")),
            ],
            allowed: None,
        }];
    }
    let (x, v) = (&coordinates[0], &velocities[0]);
    let wall = |name: String, at: &str, direction: Passing| Event {
        name,
        when: format!("{x} - ({at})"),
        direction,
        set: vec![Definition::new(v, &format!("-({restitution})*{v}"))],
        allowed: None,
    };
    match side {
        Side::Above => vec![wall(name.to_string(), clearance, Passing::Up)],
        Side::Below => vec![wall(name.to_string(), clearance, Passing::Down)],
        Side::Both => vec![
            wall(format!("{name} above"), clearance, Passing::Up),
            wall(format!("{name} below"), &format!("-({clearance})"), Passing::Down),
        ],
    }
}
