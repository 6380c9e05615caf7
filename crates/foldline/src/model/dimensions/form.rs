//! Units as linear forms.

use crate::units::{RADIAN, SAME_POWER, TURN, Unit, is_angle};
use std::collections::BTreeMap;

/// Marker for the dimensionless unit of time.
pub(super) const CLOCK: &str = "\u{0}time";

/// Factor of a unit.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Key {
    /// Base unit.
    Base(String),
    /// Unit of a quantity that declares none.
    Quantity(usize),
    /// Unit of a number.
    Number(usize),
}

/// e^scale Π key^power.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Form {
    pub powers: BTreeMap<Key, f64>,
    pub scale: f64,
    /// True for 0, which has every unit.
    pub any: bool,
}

impl Form {
    pub fn of(unit: &Unit) -> Form {
        let powers = unit.powers.iter().map(|(name, power)| (Key::Base(name.clone()), *power)).collect();
        Form { powers, scale: unit.scale(), any: false }
    }

    pub fn key(key: Key) -> Form {
        Form { powers: BTreeMap::from([(key, 1.0)]), ..Form::default() }
    }

    pub fn any() -> Form {
        Form { any: true, ..Form::default() }
    }

    pub fn radian() -> Form {
        Form::key(Key::Base(RADIAN.into()))
    }

    /// Product with a power of another unit.
    pub fn plus(&self, other: &Form, power: f64) -> Form {
        let mut sum = Form { any: self.any || other.any, ..self.clone() };
        for (key, own) in &other.powers {
            *sum.powers.entry(key.clone()).or_insert(0.0) += power * own;
        }
        sum.powers.retain(|_, power| power.abs() > SAME_POWER);
        sum.scale += power * other.scale;
        sum
    }

    /// Power of the unit.
    pub fn raised(&self, power: f64) -> Form {
        Form { any: self.any && power > 0.0, ..Form::default() }.plus(&Form { any: false, ..self.clone() }, power)
    }

    fn base(&self, name: &str) -> f64 {
        self.powers.get(&Key::Base(name.into())).copied().unwrap_or(0.0)
    }

    pub fn turns(&self) -> f64 {
        self.base(TURN)
    }

    pub fn radians(&self) -> f64 {
        self.base(RADIAN)
    }

    pub fn clock(&self) -> f64 {
        self.base(CLOCK)
    }

    /// Dimensional base units and their powers.
    pub fn dimension(&self) -> impl Iterator<Item = (&str, f64)> {
        self.powers.iter().filter_map(|(key, power)| match key {
            Key::Base(name) if !is_angle(name) && name != CLOCK => Some((name.as_str(), *power)),
            _ => None,
        })
    }

    /// Numbers with their powers.
    pub fn numbers(&self) -> impl Iterator<Item = (usize, f64)> {
        self.powers.iter().filter_map(|(key, power)| match key {
            Key::Number(k) => Some((*k, *power)),
            _ => None,
        })
    }

    /// Quantity whose unit is not known, and its power.
    pub fn unknown(&self) -> Option<(Key, f64)> {
        let mut unknown = self.powers.iter().filter(|(key, _)| matches!(key, Key::Quantity(_)));
        unknown.next_back().map(|(key, power)| (key.clone(), *power))
    }

    /// Text in base units, those of `known` first.
    pub fn shown<'k>(&self, known: impl IntoIterator<Item = (&'k str, Form)>) -> String {
        let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
        let mut own = Form { any: false, ..self.clone() };
        // In a force or an acceleration the radian carries no information.
        if own.dimension().any(|(name, _)| name != "s") {
            own.powers.remove(&Key::Base(RADIAN.into()));
        }
        for (text, form) in known {
            let rest = own.plus(&form, -1.0);
            let angles = close(rest.turns(), 0.0) && close(rest.radians(), 0.0);
            if rest.dimension().next().is_none() && angles && close(rest.scale, 0.0) {
                return text.to_string();
            }
        }
        let factor = |name: &str, power: f64| match close(power, 1.0) {
            true => name.to_string(),
            false => format!("{name}^{}", (power * 1e6).round() / 1e6),
        };
        let mut parts: Vec<(&str, f64)> = own.dimension().collect();
        parts.extend([(TURN, own.turns()), (RADIAN, own.radians())].into_iter().filter(|(_, p)| p.abs() > SAME_POWER));
        let above: Vec<String> = parts.iter().filter(|(_, p)| *p > 0.0).map(|(n, p)| factor(n, *p)).collect();
        let below: Vec<String> = parts.iter().filter(|(_, p)| *p < 0.0).map(|(n, p)| factor(n, -p)).collect();
        let mut text = if above.is_empty() { "1".to_string() } else { above.join(" ") };
        match below.len() {
            0 => {}
            1 => text.push_str(&format!("/{}", below[0])),
            _ => text.push_str(&format!("/({})", below.join(" "))),
        }
        let scale = self.scale.exp();
        match (close(self.scale, 0.0), text.as_str()) {
            (true, "1") => "1 (a pure number)".into(),
            (true, _) => text,
            (false, _) => format!("{} {text}", short(scale)),
        }
    }
}

/// Factor with at most six digits.
pub(super) fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    if (1e-4..1e6).contains(&rounded.abs()) { format!("{rounded}") } else { format!("{rounded:e}") }
}
