//! Constants as users give them: by name, with units, checked before anything is computed from them.
//!
//! **Fails when** a name is unknown, missing or given twice, a unit does not fit, or no rotor has such a value. Every
//! [`Mistake`] is reported, not only the first.

use crate::quantities::{Nondimensional, Si};
use crate::units::{Mistake, quantity};
use foldline::model::suggest;

/// Values that a constant may have.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Allowed {
    /// Greater than 0.
    Positive,
    /// 0 or greater.
    NotNegative,
    /// From 0 to 1.
    Share,
    /// Any: a cubic spring may soften.
    Any,
}

use Allowed::{Any, NotNegative, Positive, Share};

/// Constants of models/overhung-rotor-si.toml in their order: name, unit, allowed values.
const SI: [(&str, &str, Allowed); 14] = [
    ("omega", "rad/s", NotNegative),
    ("kappa", "1", Share),
    ("K", "1", Positive),
    ("m_d", "kg", Positive),
    ("e", "m", NotNegative),
    ("a", "m", Positive),
    ("b", "m", Positive),
    ("c", "m", Positive),
    ("I_d", "kg m^2", NotNegative),
    ("I_p", "kg m^2", NotNegative),
    ("k_r", "N/m", Positive),
    ("c_r", "N s/m", NotNegative),
    ("k_3", "N/m^3", Any),
    ("k_s", "N/m", NotNegative),
];

/// Constants of models/overhung-rotor.toml in their order: name, unit, allowed values.
const NONDIMENSIONAL: [(&str, &str, Allowed); 9] = [
    ("Omega", "1", NotNegative),
    ("kappa", "1", Share),
    ("zeta", "1", NotNegative),
    ("epsilon", "1", NotNegative),
    ("gamma", "1", Any),
    ("beta", "1", NotNegative),
    ("K", "1", Positive),
    ("J_p", "1", NotNegative),
    ("m", "1", Positive),
];

impl Si {
    /// Returns the constants from pairs of name and value with unit, such as `("c", "0.5 mm")`, in any order; the names
    /// are those of models/overhung-rotor-si.toml, and all fourteen are required.
    ///
    /// # Errors
    /// Every mistake, in the order of the pairs, then missing and inconsistent constants.
    pub fn given(pairs: &[(&str, &str)]) -> Result<Si, Vec<Mistake>> {
        let si = Si::from_parameters(read(&SI, pairs)?);
        si.check()?;
        Ok(si)
    }

    /// Checks that a rotor can have these constants.
    ///
    /// # Errors
    /// Every mistake.
    pub fn check(&self) -> Result<(), Vec<Mistake>> {
        let mut found = out_of_range(&SI, &self.parameters());
        if self.polar_inertia > 2.0 * self.diametral_inertia {
            found.push(Mistake {
                place: format!("I_p = {} kg m^2, I_d = {} kg m^2", self.polar_inertia, self.diametral_inertia),
                cause: "no rigid body has a polar moment of inertia above twice the diametral one".into(),
                cure: "give both about the centre of the disc; for a thin disc I_p = 2 I_d".into(),
            });
        }
        if found.is_empty() { Ok(()) } else { Err(found) }
    }
}

impl Nondimensional {
    /// Returns the constants from pairs of name and value, such as `("zeta", "0.01")`, in any order; the names are
    /// those of models/overhung-rotor.toml, and all nine are required.
    ///
    /// # Errors
    /// As for [`Si::given`].
    pub fn given(pairs: &[(&str, &str)]) -> Result<Nondimensional, Vec<Mistake>> {
        let constants = Nondimensional::from_parameters(read(&NONDIMENSIONAL, pairs)?);
        constants.check()?;
        Ok(constants)
    }

    /// Checks that a rotor can have these constants.
    ///
    /// # Errors
    /// Every mistake.
    pub fn check(&self) -> Result<(), Vec<Mistake>> {
        let mut found = out_of_range(&NONDIMENSIONAL, &self.parameters());
        if self.mass > 1.0 {
            found.push(Mistake {
                place: format!("m = {}", self.mass),
                cause:
                    "the disc as a point mass has m_d a² of the inertia m_d a² + I_d about the pivot, a share above 1"
                        .into(),
                cure: "give m = m_d a²/(m_d a² + I_d), which is at most 1".into(),
            });
        }
        if self.mass <= 1.0 && self.polar > 2.0 * (1.0 - self.mass) * (1.0 + 4.0 * f64::EPSILON) {
            found.push(Mistake {
                place: format!("J_p = {}, m = {}", self.polar, self.mass),
                cause: "no rigid body has a polar moment of inertia above twice the diametral one, J_p > 2 (1 - m)"
                    .into(),
                cure: "give J_p = I_p/(m_d a² + I_d) and m = m_d a²/(m_d a² + I_d)".into(),
            });
        }
        if found.is_empty() { Ok(()) } else { Err(found) }
    }
}

/// Values of all constants in their order.
fn read<const N: usize>(table: &[(&str, &str, Allowed); N], pairs: &[(&str, &str)]) -> Result<[f64; N], Vec<Mistake>> {
    let mut values = [f64::NAN; N];
    let mut given = [false; N];
    let mut found = Vec::new();
    for &(name, text) in pairs {
        let place = format!("{name} = `{text}`");
        let Some(k) = table.iter().position(|(known, ..)| *known == name) else {
            let names: Vec<&str> = table.iter().map(|(known, ..)| *known).collect();
            let cause = format!("there is no constant `{name}`");
            found.push(Mistake { place, cause, cure: suggest(name, &names) });
            continue;
        };
        if std::mem::replace(&mut given[k], true) {
            let cure = "remove one of the two".into();
            found.push(Mistake { place, cause: format!("`{name}` is given twice"), cure });
            continue;
        }
        match quantity(name, text, table[k].1) {
            Ok(value) => values[k] = value,
            Err(mistake) => found.push(mistake),
        }
    }
    for ((name, unit, _), _) in table.iter().zip(&given).filter(|(_, given)| !**given) {
        let cure = if *unit == "1" {
            "give a plain number".into()
        } else {
            format!(
                "give it in {unit} or a \
                                        compatible unit"
            )
        };
        found.push(Mistake { place: (*name).into(), cause: "it is missing".into(), cure });
    }
    if found.is_empty() { Ok(values) } else { Err(found) }
}

fn out_of_range(table: &[(&str, &str, Allowed)], values: &[f64]) -> Vec<Mistake> {
    let judged = table.iter().zip(values).filter_map(|(&(name, unit, allowed), &value)| {
        let (fits, wanted) = match allowed {
            Positive => (value > 0.0, "greater than 0"),
            NotNegative => (value >= 0.0, "0 or greater"),
            Share => ((0.0..=1.0).contains(&value), "from 0 to 1"),
            Any => (true, "finite"),
        };
        let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
        (!fits || !value.is_finite()).then(|| Mistake {
            place: format!("{name} = {value}{unit}"),
            cause: "this value is physically impossible".into(),
            cure: format!("{name} must be {wanted}"),
        })
    });
    judged.collect()
}
