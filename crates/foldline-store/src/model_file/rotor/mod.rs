//! Rotors: sections of a model file that describe shafts, discs, bearings and rings.
//!
//! **Idea.** The sections become parts of a [`Rotor`], which [`foldline_shaft`] assembles and turns into states,
//! equations and outputs of the model. Numbers are in SI units unless they carry a unit. A coefficient may be the name
//! of a parameter or an expression; an expression becomes a definition, so that mistakes in it have a position.

mod loads;
mod matrices;
mod shaft;
mod supports;
mod values;

use super::Reader;
use crate::toml_walk::Value;
use foldline::model::{Item, ModelSource};
use foldline_shaft::{Assembled, Coefficient, Damping, Frame, Machine, Rotor};
use std::ops::Range;
use toml::de::{DeTable, DeValue};

/// Sections of a rotor.
pub(super) const SECTIONS: [&str; 10] =
    ["rotor", "material", "shaft", "disc", "bearing", "point-mass", "unbalance", "contact", "film", "force"];
const KEYS: [&str; 8] = ["speed", "frame", "gravity", "damping", "modal-damping", "scale", "probes", "matrices"];

/// Maximum number of degrees of freedom: a model can have up to 1000 states.
const MOST_DOFS: usize = 500;

/// Rotor that was read, and what later steps need.
pub(super) struct Read {
    /// Rotor with its matrices.
    pub assembled: Assembled,
    /// Model before the equations of the rotor were added.
    pub before: ModelSource,
    /// Model whose units are checked: as written, with the coefficients of the rotor as outputs.
    pub checked: ModelSource,
}

/// Parts of the sections that are needed after they were read.
#[derive(Default)]
pub(super) struct Draft {
    /// Material names and properties.
    materials: Vec<shaft::Material>,
    /// Expressions with the unit they must have: definition, unit, description, position.
    pub(super) expressions: Vec<Expression>,
    /// Forces: function, whether in rotating axes, position.
    forces: Vec<(String, bool, Range<usize>)>,
}

/// Coefficient that is an expression.
pub(super) struct Expression {
    name: String,
    text: String,
    unit: String,
    what: String,
    span: Range<usize>,
}

impl Reader<'_> {
    /// Reads the sections of a rotor and adds its equations to the model; `None` if there are none, or after a mistake.
    pub(super) fn rotor(&mut self, root: &DeTable, source: &mut ModelSource) -> Option<Read> {
        // `[contact.NAME]` is a wall of a plain model, `[[contact]]` a ring of a rotor.
        let plain = |name: &str, value: &Value| name == "contact" && value.get_ref().as_table().is_some();
        let section =
            SECTIONS.iter().find_map(|name| root.get_key_value(*name).filter(|(_, value)| !plain(name, value)))?;
        let before = self.walk.found.len();
        let span = section.0.span();
        let Some(value) = root.get("rotor") else {
            let message = format!("`{}` describes a rotor, but there is no section `[rotor]`", section.0.get_ref());
            self.walk.report(span, message, "add `[rotor]` with `speed = \"Omega\"`, or a number such as \"3000 rpm\"");
            self.incomplete = true;
            return None;
        };
        let mut draft = Draft::default();
        let rotor = self.parts(value, root, source, &mut draft);
        let rotor = match rotor {
            Some(rotor) if self.walk.found.len() == before => rotor,
            _ => {
                self.incomplete = true;
                return None;
            }
        };
        if rotor.dofs() > MOST_DOFS {
            let message = format!("the rotor has {} degrees of freedom; the limit is {MOST_DOFS}", rotor.dofs());
            self.walk.report(span, message, "reduce the number of elements and supports");
            self.incomplete = true;
            return None;
        }
        let frame_span = value.get_ref().as_table().and_then(|table| table.get("frame")).map(|own| own.span());
        let assembled = match Assembled::new(rotor) {
            Ok(assembled) => assembled,
            Err([message, cure]) => {
                self.walk.report(frame_span.unwrap_or(span), message, cure);
                self.incomplete = true;
                return None;
            }
        };
        self.axes_of_forces(&assembled, &draft);
        if source.time.is_empty() {
            source.time = "s".into();
        } else if source.time != "s" {
            let message = format!("the time of a rotor is in s, not in {}", source.time);
            self.walk.report(root.get("time").map_or(0..0, |own| own.span()), message, "remove `time`");
        }
        let plain = source.clone();
        if let Err([message, cure]) = assembled.extend(source) {
            self.walk.report(span, message, cure);
            self.incomplete = true;
            return None;
        }
        let checked = self.checked(&plain, source, &draft);
        Some(Read { assembled, before: plain, checked })
    }

    /// Reads `[rotor]` and all other sections.
    fn parts(&mut self, value: &Value, root: &DeTable, source: &mut ModelSource, draft: &mut Draft) -> Option<Rotor> {
        let table = self.walk.table(value, "`rotor`")?;
        self.walk.only(table, &KEYS, "`[rotor]`");
        let Some(speed) = table.get("speed") else {
            let hint = "write `speed = \"Omega\"` with a parameter Omega, or a number such as `speed = \"3000 rpm\"`";
            self.walk.report(value.span(), "the rotor has no speed", hint);
            return None;
        };
        let speed = self.coefficient(speed, "the speed of the rotor", "rad/s", source, draft);
        let mut rotor = Rotor {
            stations: Vec::new(),
            nodes: 0,
            elements: Vec::new(),
            given: None,
            discs: Vec::new(),
            masses: Vec::new(),
            bearings: Vec::new(),
            unbalances: Vec::new(),
            contacts: Vec::new(),
            films: Vec::new(),
            forces: Vec::new(),
            damping: Damping::default(),
            speed: speed.unwrap_or(Coefficient::ZERO),
            gravity: Coefficient::ZERO,
            frame: None,
            scale: None,
            probes: Vec::new(),
            tables: Vec::new(),
        };
        rotor.frame = self.frame(table);
        rotor.gravity = self.gravity(table, source, draft);
        rotor.damping = self.shaft_damping(table, source);
        rotor.scale = table.get("scale").and_then(|own| self.fixed(own, "the scale of the rotor", "m", source));
        self.materials(root, source, draft);
        match table.get("matrices") {
            Some(own) => self.matrices(own, root, &mut rotor),
            None => self.shafts(root, source, draft, &mut rotor),
        }
        if rotor.nodes == 0 {
            if self.walk.found.is_empty() {
                let hint = "add `[[shaft]]` with length, diameter, material and elements";
                self.walk.report(value.span(), "the rotor has no shaft", hint);
            }
            return None;
        }
        self.supports(root, source, &mut rotor);
        self.discs(root, source, draft, &mut rotor);
        self.bearings(root, source, draft, &mut rotor);
        self.unbalances(root, source, draft, &mut rotor);
        self.contacts(root, source, draft, &mut rotor);
        self.films(root, source, draft, &mut rotor);
        self.forces(root, source, draft, &mut rotor);
        if let Some(list) = table.get("probes") {
            match list.get_ref().as_array() {
                Some(list) => {
                    rotor.probes = list.iter().filter_map(|own| self.station_of(own, "a probe", &rotor)).collect();
                }
                None => self.walk.report(list.span(), "`probes` is not a list of nodes", "write `probes = [0, 6]`"),
            }
        }
        Some(rotor)
    }

    fn frame(&mut self, table: &DeTable) -> Option<Frame> {
        let value = table.get("frame")?;
        match value.get_ref().as_str() {
            Some("rotating") => Some(Frame::Rotating),
            Some("fixed") => Some(Frame::Fixed),
            _ => {
                let hint = "write `frame = \"rotating\"` or `frame = \"fixed\"`, or leave it out";
                self.walk.report(value.span(), "`frame` is neither \"rotating\" nor \"fixed\"", hint);
                None
            }
        }
    }

    fn gravity(&mut self, table: &DeTable, source: &mut ModelSource, draft: &mut Draft) -> Coefficient {
        let Some(value) = table.get("gravity") else { return Coefficient::ZERO };
        match value.get_ref().as_str() {
            Some("off") => Coefficient::ZERO,
            Some("on") => Coefficient::number(9.80665),
            _ => {
                self.coefficient(value, "the gravity of the rotor", "m/s^2", source, draft).unwrap_or(Coefficient::ZERO)
            }
        }
    }

    /// Reads proportional and modal damping.
    fn shaft_damping(&mut self, table: &DeTable, source: &ModelSource) -> Damping {
        let mut damping = Damping::default();
        if let Some(own) = table.get("damping").and_then(|own| self.walk.table(own, "`damping`")) {
            self.walk.only(own, &["mass", "stiffness"], "`damping`");
            let mut factor = |key: &str, unit: &str| {
                let what = format!("the factor of the {key} matrix in the damping");
                own.get(key).and_then(|value| self.fixed(value, &what, unit, source)).unwrap_or(0.0)
            };
            (damping.mass, damping.stiffness) = (factor("mass", "1/s"), factor("stiffness", "s"));
        }
        if let Some(value) = table.get("modal-damping") {
            let list: Vec<&Value> = match value.get_ref() {
                DeValue::Array(list) => list.iter().collect(),
                _ => {
                    damping.all = true;
                    vec![value]
                }
            };
            damping.modal =
                list.into_iter().filter_map(|own| self.fixed(own, "a damping ratio", "1", source)).collect();
        }
        let negative = damping.modal.iter().chain([&damping.mass, &damping.stiffness]).any(|own| *own < 0.0);
        if negative {
            let span = table.get("modal-damping").or(table.get("damping")).map_or(0..0, |own| own.span());
            self.walk.report(span, "a damping is negative", "give damping ratios and factors from 0 upwards");
        }
        damping
    }

    /// Model whose units are checked.
    fn checked(&mut self, plain: &ModelSource, full: &ModelSource, draft: &Draft) -> ModelSource {
        let mut checked = ModelSource { states: full.states.clone(), forcing: full.forcing.clone(), ..plain.clone() };
        (plain.states.len()..full.states.len()).for_each(|i| {
            self.measured.insert(Item::State(i));
        });
        if full.forcing.is_some() && plain.forcing.is_none() {
            checked.forcing = None;
        }
        self.check_expressions(&mut checked, draft);
        checked
    }
}

/// Machine of a rotor that was read, or its mistakes.
pub(super) fn machine(read: Read) -> Result<Machine, Vec<foldline::model::ModelError>> {
    Machine::new(read.assembled, &read.before)
}
