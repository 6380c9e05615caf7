//! Names of units.

use super::{RADIAN, TURN, Unit};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

/// Unit with its names.
struct Known {
    names: &'static [&'static str],
    /// True if it takes prefixes such as k and m.
    prefixed: bool,
    above: f64,
    below: f64,
    powers: &'static [(&'static str, f64)],
}

const fn unit(names: &'static [&'static str], powers: &'static [(&'static str, f64)]) -> Known {
    Known { names, prefixed: true, above: 1.0, below: 1.0, powers }
}

const fn fixed(
    names: &'static [&'static str],
    [above, below]: [f64; 2],
    powers: &'static [(&'static str, f64)],
) -> Known {
    Known { names, prefixed: false, above, below, powers }
}

const fn scaled(
    names: &'static [&'static str],
    [above, below]: [f64; 2],
    powers: &'static [(&'static str, f64)],
) -> Known {
    Known { names, prefixed: true, above, below, powers }
}

const NUMBER: &[(&str, f64)] = &[];
const LENGTH: &[(&str, f64)] = &[("m", 1.0)];
const MASS: &[(&str, f64)] = &[("kg", 1.0)];
const TIME: &[(&str, f64)] = &[("s", 1.0)];
const FORCE: &[(&str, f64)] = &[("kg", 1.0), ("m", 1.0), ("s", -2.0)];
const PRESSURE: &[(&str, f64)] = &[("kg", 1.0), ("m", -1.0), ("s", -2.0)];
const ENERGY: &[(&str, f64)] = &[("kg", 1.0), ("m", 2.0), ("s", -2.0)];
const POWER: &[(&str, f64)] = &[("kg", 1.0), ("m", 2.0), ("s", -3.0)];
const RESISTANCE: &[(&str, f64)] = &[("kg", 1.0), ("m", 2.0), ("s", -3.0), ("A", -2.0)];
const CONDUCTANCE: &[(&str, f64)] = &[("kg", -1.0), ("m", -2.0), ("s", 3.0), ("A", 2.0)];
const ANGLE: &[(&str, f64)] = &[(RADIAN, 1.0)];
const TURNS: &[(&str, f64)] = &[(TURN, 1.0)];
const SPEED: &[(&str, f64)] = &[(TURN, 1.0), ("s", -1.0)];
const CONCENTRATION: &[(&str, f64)] = &[("mol", 1.0), ("m", -3.0)];
const KELVIN: &[(&str, f64)] = &[("K", 1.0)];

/// All known units. Values that are not exact by definition have the digits of bipm2019.
static KNOWN: &[Known] = &[
    unit(&["m", "metre", "meter"], LENGTH),
    scaled(&["g", "gram"], [1.0, 1000.0], MASS),
    unit(&["s", "sec", "second", "seconds"], TIME),
    unit(&["A", "ampere"], &[("A", 1.0)]),
    unit(&["K", "kelvin"], KELVIN),
    unit(&["mol"], &[("mol", 1.0)]),
    unit(&["cd"], &[("cd", 1.0)]),
    unit(&["rad"], ANGLE),
    unit(&["sr"], &[(RADIAN, 2.0)]),
    fixed(&["deg", "°", "degree", "degrees"], [PI, 180.0], ANGLE),
    fixed(&["arcmin"], [PI, 10_800.0], ANGLE),
    fixed(&["arcsec"], [PI, 648_000.0], ANGLE),
    fixed(&["turn", "turns", "rev", "cycle", "cycles"], [1.0, 1.0], TURNS),
    unit(&["Hz", "hertz"], SPEED),
    fixed(&["rpm", "RPM"], [1.0, 60.0], SPEED),
    fixed(&["%", "percent"], [1.0, 100.0], NUMBER),
    fixed(&["‰"], [1.0, 1000.0], NUMBER),
    fixed(&["ppm"], [1.0, 1e6], NUMBER),
    unit(&["N", "newton"], FORCE),
    unit(&["Pa", "pascal"], PRESSURE),
    unit(&["J", "joule"], ENERGY),
    unit(&["W", "watt"], POWER),
    unit(&["C", "coulomb"], &[("A", 1.0), ("s", 1.0)]),
    unit(&["V", "volt"], &[("kg", 1.0), ("m", 2.0), ("s", -3.0), ("A", -1.0)]),
    unit(&["F", "farad"], &[("kg", -1.0), ("m", -2.0), ("s", 4.0), ("A", 2.0)]),
    unit(&["Ohm", "ohm", "Ω", "Ω"], RESISTANCE),
    unit(&["S", "siemens", "mho"], CONDUCTANCE),
    unit(&["Wb", "weber"], &[("kg", 1.0), ("m", 2.0), ("s", -2.0), ("A", -1.0)]),
    unit(&["T", "tesla"], &[("kg", 1.0), ("s", -2.0), ("A", -1.0)]),
    unit(&["H", "henry"], &[("kg", 1.0), ("m", 2.0), ("s", -2.0), ("A", -2.0)]),
    unit(&["lm"], &[("cd", 1.0), (RADIAN, 2.0)]),
    unit(&["lx"], &[("cd", 1.0), (RADIAN, 2.0), ("m", -2.0)]),
    unit(&["Bq"], &[("s", -1.0)]),
    unit(&["Gy", "Sv"], &[("m", 2.0), ("s", -2.0)]),
    unit(&["kat"], &[("mol", 1.0), ("s", -1.0)]),
    scaled(&["l", "L", "litre", "liter"], [1.0, 1000.0], &[("m", 3.0)]),
    scaled(&["M", "molar"], [1000.0, 1.0], CONCENTRATION),
    scaled(&["t", "tonne"], [1000.0, 1.0], MASS),
    fixed(&["u", "Da"], [1.66053906892e-27, 1.0], MASS),
    scaled(&["bar"], [1e5, 1.0], PRESSURE),
    fixed(&["atm"], [101_325.0, 1.0], PRESSURE),
    fixed(&["Torr", "torr", "mmHg"], [101_325.0, 760.0], PRESSURE),
    fixed(&["psi"], [4.4482216152605, 0.00064516], PRESSURE),
    scaled(&["eV"], [1.602176634e-19, 1.0], ENERGY),
    scaled(&["cal"], [4.184, 1.0], ENERGY),
    scaled(&["Wh"], [3600.0, 1.0], ENERGY),
    fixed(&["hp"], [745.699_871_582_270_2, 1.0], POWER),
    fixed(&["PS"], [735.49875, 1.0], POWER),
    scaled(&["P", "poise"], [1.0, 10.0], &[("kg", 1.0), ("m", -1.0), ("s", -1.0)]),
    scaled(&["St", "stokes"], [1.0, 10_000.0], &[("m", 2.0), ("s", -1.0)]),
    scaled(&["dyn"], [1.0, 1e5], FORCE),
    scaled(&["erg"], [1.0, 1e7], ENERGY),
    fixed(&["kgf", "kp"], [9.80665, 1.0], FORCE),
    fixed(&["lbf"], [4.4482216152605, 1.0], FORCE),
    fixed(&["lb", "lbm"], [0.45359237, 1.0], MASS),
    fixed(&["slug"], [14.593902937206365, 1.0], MASS),
    fixed(&["in", "inch"], [254.0, 10_000.0], LENGTH),
    fixed(&["mil"], [254.0, 10_000_000.0], LENGTH),
    fixed(&["ft"], [3048.0, 10_000.0], LENGTH),
    fixed(&["mile"], [1609.344, 1.0], LENGTH),
    fixed(&["Å", "Å", "angstrom"], [1.0, 1e10], LENGTH),
    fixed(&["micron"], [1.0, 1e6], LENGTH),
    fixed(&["min", "minute", "minutes"], [60.0, 1.0], TIME),
    fixed(&["h", "hour", "hours"], [3600.0, 1.0], TIME),
    fixed(&["d", "day", "days"], [86_400.0, 1.0], TIME),
    fixed(&["week", "weeks"], [604_800.0, 1.0], TIME),
    fixed(&["yr", "year", "years"], [31_557_600.0, 1.0], TIME),
    fixed(&["mph"], [1609.344, 3600.0], &[("m", 1.0), ("s", -1.0)]),
    fixed(&["kmh", "kph"], [1000.0, 3600.0], &[("m", 1.0), ("s", -1.0)]),
    fixed(&["knot", "kn"], [1852.0, 3600.0], &[("m", 1.0), ("s", -1.0)]),
    fixed(&["degC", "°C", "℃"], [1.0, 1.0], KELVIN),
];

/// Temperature scales whose zero is not absolute zero.
const SHIFTED: [&str; 3] = ["degC", "°C", "℃"];

/// Prefixes as fractions of whole powers of ten, which are exact.
const PREFIXES: [(&str, [f64; 2]); 23] = [
    ("da", [10.0, 1.0]),
    ("h", [100.0, 1.0]),
    ("k", [1e3, 1.0]),
    ("M", [1e6, 1.0]),
    ("G", [1e9, 1.0]),
    ("T", [1e12, 1.0]),
    ("P", [1e15, 1.0]),
    ("E", [1e18, 1.0]),
    ("Z", [1e21, 1.0]),
    ("Y", [1e24, 1.0]),
    ("d", [1.0, 10.0]),
    ("c", [1.0, 100.0]),
    ("m", [1.0, 1e3]),
    ("u", [1.0, 1e6]),
    ("µ", [1.0, 1e6]),
    ("μ", [1.0, 1e6]),
    ("n", [1.0, 1e9]),
    ("p", [1.0, 1e12]),
    ("f", [1.0, 1e15]),
    ("a", [1.0, 1e18]),
    ("z", [1.0, 1e21]),
    ("y", [1.0, 1e24]),
    ("micro", [1.0, 1e6]),
];

/// Unit with the given name, with or without a prefix; `None` if there is none.
pub(super) fn named(name: &str) -> Option<Unit> {
    let bare = || KNOWN.iter().find(|known| known.names.contains(&name)).map(|known| (known, [1.0, 1.0]));
    let prefixed = || {
        PREFIXES.iter().find_map(|(prefix, factor)| {
            let rest = name.strip_prefix(prefix)?;
            let known = KNOWN.iter().find(|known| known.prefixed && known.names.contains(&rest))?;
            Some((known, *factor))
        })
    };
    let (known, [up, down]) = bare().or_else(prefixed)?;
    let powers: BTreeMap<String, f64> = known.powers.iter().map(|(base, power)| (base.to_string(), *power)).collect();
    // A prefix cancels the factor of the unit if possible: kg is exactly 1.
    let (above, below) = match (known.above * up, known.below * down) {
        (above, below) if above == below => (1.0, 1.0),
        other => other,
    };
    let times = if known.powers == TIME { BTreeSet::from([name.to_string()]) } else { BTreeSet::new() };
    Some(Unit { powers, above, below, shifted: SHIFTED.contains(&name), times, foreign: BTreeSet::new() })
}
