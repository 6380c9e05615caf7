//! Conversion of constants with units, in both directions.

use foldline_rotor::{Nondimensional, Scale, Si};
use foldline_store::model_file::read_model;
use std::path::Path;

/// models/overhung-rotor-si.toml in the units of a workshop drawing.
const DRAWING: [(&str, &str); 14] = [
    ("c", "0.5 mm"),
    ("e", "353 µm"),
    ("a", "500 mm"),
    ("b", "25 cm"),
    ("omega", "500 rad/s"),
    ("m_d", "3600 g"),
    ("I_d", "1e5 kg mm^2"),
    ("I_p", "143 g·m²"),
    ("k_r", "160 N/mm"),
    ("c_r", "0.032 N s/mm"),
    ("k_3", "160 N/mm^3"),
    ("k_s", "1.6 MN/m"),
    ("kappa", "0"),
    ("K", "150"),
];

fn close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(expected) {
        // A few rounding errors each.
        assert!((a - b).abs() <= 16.0 * f64::EPSILON * b.abs(), "{found:?} {expected:?}");
    }
}

#[test]
fn drawing_model_file_and_reference_agree() {
    let si = Si::given(&DRAWING).unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/overhung-rotor-si.toml");
    let (model, _) = read_model(&path).unwrap();
    let names: Vec<&str> = model.parameters.iter().map(|p| p.name.as_str()).collect();
    assert!(names.iter().all(|name| DRAWING.iter().any(|(known, _)| known == name)), "{names:?}");
    close(&si.parameters(), &model.defaults());
    close(&Nondimensional::from(&si).parameters(), &Nondimensional::REFERENCE.parameters());
    let scale = si.scale();
    close(&scale.state(), &[1e-3, 1e-3, 0.1, 0.1]);
    close(&[scale.time(), scale.length()], &[0.01, 1e-3]);
    assert_eq!(Si::from_parameters(si.parameters()), si);
}

#[test]
fn speeds_may_be_given_in_revolutions() {
    for (text, speed) in [("3000 rpm", 100.0), ("50 Hz", 100.0), ("50 rev/s", 100.0)] {
        let pairs = DRAWING.map(|(name, value)| if name == "omega" { (name, text) } else { (name, value) });
        close(&[Si::given(&pairs).unwrap().speed], &[speed * std::f64::consts::PI]);
    }
}

#[test]
fn conversion_there_and_back_is_the_identity() {
    let si = Si::given(&DRAWING).unwrap();
    close(&Nondimensional::from(&si).to_si(&si.scale()).unwrap().parameters(), &si.parameters());
    // In the opposite direction, at any scale.
    let scale = Scale {
        disc_distance: 0.31,
        spring_distance: 0.17,
        clearance: 2e-4,
        pivot_inertia: 0.042,
        pivot_frequency: 233.0,
    };
    for kappa in [0.0, 0.3, 1.0] {
        let constants = Nondimensional { kappa, zeta: 1e-5, gamma: -0.1, omega: 4.7, ..Nondimensional::REFERENCE };
        let si = constants.to_si(&scale).unwrap();
        close(&Nondimensional::from(&si).parameters(), &constants.parameters());
        close(&[si.scale().length(), si.pivot_inertia(), si.pivot_frequency()], &[scale.length(), 0.042, 233.0]);
    }
}

#[test]
fn nondimensional_constants_are_read_and_checked_too() {
    let good = ["5", "1", "1e-5", "1.5", "0.25", "10", "150", "0.143", "0.9"];
    let names = ["Omega", "kappa", "zeta", "epsilon", "gamma", "beta", "K", "J_p", "m"];
    let pairs: Vec<(&str, &str)> = names.into_iter().zip(good).collect();
    let found = Nondimensional::given(&pairs).unwrap();
    assert_eq!(found.parameters(), [5.0, 1.0, 1e-5, 1.5, 0.25, 10.0, 150.0, 0.143, 0.9]);
    for (at, text, cause) in [
        (2, "0.01 kg", "plain number"),
        (1, "1.5", "physically impossible"),
        (8, "1.2", "above 1"),
        (7, "0.5", "no rigid body"),
    ] {
        let mut pairs = pairs.clone();
        pairs[at].1 = text;
        let mistakes = Nondimensional::given(&pairs).unwrap_err();
        assert!(mistakes.len() == 1 && mistakes[0].cause.contains(cause), "{mistakes:?}");
    }
}

/// Every mistake is reported with place, cause and cure, and all of them at once.
#[test]
fn impossible_constants_are_refused() {
    let refused = |name: &str, text: &'static str| {
        let pairs = DRAWING.map(|(known, value)| if known == name { (known, text) } else { (known, value) });
        let mistakes = Si::given(&pairs).unwrap_err();
        assert!(
            mistakes.iter().all(|m| m.place.contains(name) && !m.cause.is_empty() && !m.cure.is_empty()),
            "{mistakes:?}"
        );
        mistakes.iter().map(|m| m.to_string()).collect::<Vec<_>>().join("\n")
    };
    assert_eq!(refused("c", "-0.5 mm"), "c = -0.0005 m: this value is physically impossible; c must be greater than 0");
    assert_eq!(
        refused("c", "0.5 g"),
        "c = `0.5 g`: g does not have the dimension of m; give a number with a unit compatible with m, as in `2.5 m`"
    );
    assert!(refused("omega", "80 1/s").ends_with("give a speed as in `500 rad/s`, `80 Hz` or `4800 rpm`"));
    assert!(refused("kappa", "1.5").contains("from 0 to 1"));
    assert!(refused("m_d", "0 kg").contains("greater than 0"));
    assert!(refused("I_p", "0.3 kg m^2").contains("no rigid body"));
    let mistakes = Si::given(&[("cc", "1 mm"), ("a", "1 m"), ("a", "2 m"), ("b", "x")]).unwrap_err();
    let causes: Vec<&str> = mistakes.iter().map(|m| m.cause.as_str()).collect();
    assert!(causes[0].contains("no constant `cc`") && mistakes[0].cure.contains("`c`"), "{mistakes:?}");
    assert!(causes[1].contains("twice") && causes[2].contains("finite number"), "{mistakes:?}");
    assert_eq!(causes[3..].iter().filter(|c| **c == "it is missing").count(), 12);
    let Err(mistakes) =
        Nondimensional::REFERENCE.to_si(&Scale { clearance: 0.0, ..Si::given(&DRAWING).unwrap().scale() })
    else {
        panic!("a clearance of 0 was accepted")
    };
    assert!(mistakes[0].place.starts_with("c = 0"), "{mistakes:?}");
}
