use super::{Mismatch, Unit, quantity};

fn convert(value: f64, from: &str, to: &str) -> Result<f64, Mismatch> {
    Unit::read(from).convert(value, &Unit::read(to))
}

/// Definitions: bipm2019, tables 4 to 8.
#[test]
fn units_are_read_however_they_are_written() {
    let same = [
        ("N", "kg m/s^2"),
        ("N/m", "kg/s^2"),
        ("kg m^2/s", "J s"),
        ("N s/m", "kg/s"),
        ("N.m", "J"),
        ("m s-1", "m/s"),
        ("m2", "m^2"),
        ("kg·m²·s⁻²", "J"),
        ("1/(mol s)", "mol^-1 s^-1"),
        ("J/(kg K)", "J/kg/K"),
        ("V/A", "Ohm"),
        ("C/V", "F"),
        ("V s/A", "H"),
        ("Wb/m^2", "T"),
        ("1/Ω", "S"),
        ("W", "V*A"),
        ("m^(1/2)", "m^0.5"),
        ("mol/l", "M"),
        ("", "1"),
        ("µA", "uA"),
    ];
    for (a, b) in same {
        assert_eq!(convert(1.0, a, b), Ok(1.0), "{a} {b}");
    }
}

#[test]
fn decimal_values_convert_exactly() {
    let cases = [
        (0.3, "mm", "m", 3e-4),
        (0.1, "mV", "V", 1e-4),
        (12.0, "ms", "s", 0.012),
        (1.0, "uA/cm^2", "A/m^2", 0.01),
        (1.0, "mS/cm^2", "S/m^2", 10.0),
        (5.0, "bar", "Pa", 5e5),
        (1.0, "cP", "Pa s", 1e-3),
        (3.0, "1/min", "1/s", 0.05),
        (2.0, "kN/mm", "N/m", 2e6),
        (7.0, "%", "1", 0.07),
        (250.0, "g", "kg", 0.25),
        (1.0, "mol/l", "mol/m^3", 1000.0),
        (36.0, "km/h", "m/s", 10.0),
    ];
    for (value, from, to, expected) in cases {
        assert_eq!(convert(value, from, to), Ok(expected), "{from} {to}");
        // And back, to the last digit: 0.07 is not exactly seven hundredths.
        assert!((convert(expected, to, from).unwrap() / value - 1.0).abs() <= f64::EPSILON, "{to} {from}");
    }
}

#[test]
fn a_turn_is_two_pi_radians() {
    let turn = std::f64::consts::TAU;
    let close = |found: Result<f64, Mismatch>, expected: f64| (found.unwrap() / expected - 1.0).abs() < 1e-15;
    assert!(close(convert(50.0, "Hz", "rad/s"), 50.0 * turn));
    assert!(close(convert(3000.0, "rpm", "Hz"), 50.0));
    assert!(close(convert(3000.0, "rpm", "rad/s"), 50.0 * turn));
    assert!(close(convert(turn, "rad/s", "rpm"), 60.0));
    assert!(close(convert(180.0, "deg", "rad"), turn / 2.0));
    assert_eq!(convert(2.0, "rad/s", "1/s"), Ok(2.0));
    // A frequency is ambiguous.
    assert_eq!(convert(1.0, "Hz", "1/s"), Err(Mismatch::Turns));
}

#[test]
fn unknown_names_are_base_units() {
    assert_eq!(convert(3.0, "cells/ml", "cells/l"), Ok(3000.0));
    assert_eq!(convert(1.0, "a.u.", "a.u."), Ok(1.0));
    assert_eq!(convert(1.0, "a.u.", "m"), Err(Mismatch::Dimension));
    assert_eq!(Unit::read("cells/ml").foreign().collect::<Vec<_>>(), ["cells"]);
    assert_eq!(Unit::read("m/s").foreign().count(), 0);
    // A second factor after a slash is ambiguous.
    assert!(Unit::well_formed("W/m^2 K").is_none());
    assert_eq!(convert(1.0, "degC", "K"), Err(Mismatch::Zero));
}

#[test]
fn a_number_with_a_unit_is_distinguished_from_an_expression() {
    let found = |text: &str| quantity(text).map(|q| (q.value, q.unit));
    let read = |value: f64, unit: &str| Some((value, unit.to_string()));
    assert_eq!(found("0.3 mm"), read(0.3, "mm"));
    assert_eq!(found("-1e-3 m/s^2"), read(-1e-3, "m/s^2"));
    assert_eq!(found("2670rpm"), read(2670.0, "rpm"));
    assert_eq!(found("3 eV"), read(3.0, "eV"));
    assert_eq!(found("5 1/s"), read(5.0, "1/s"));
    assert_eq!(found("12 %"), read(12.0, "%"));
    for expression in ["15*beta", "2", "1e-3", "2 *x", "1/s", "sqrt(2)", "2*m", "3 + x", "-x", "", "2^n", "1/2 m + 1"] {
        assert_eq!(found(expression), None, "{expression}");
    }
}
