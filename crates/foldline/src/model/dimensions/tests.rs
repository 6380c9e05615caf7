use super::{UnitReport, check_units};
use crate::model::{Constant, Definition, Forcing, Function, Item, ModelSource, Output, Parameter, State};

/// Checks a model given by lines `p k N/m`, `s x m = v`, `d F = k*x`, `o E J = …`, `f omega`, `c n 3`, `t ms`,
/// `h hill(x, K, n) = …`; a unit `?` declares none.
fn report(text: &str) -> UnitReport {
    let mut source = ModelSource::default();
    let mut declared = std::collections::HashSet::new();
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty()) {
        let (head, expression) = line.split_once(" = ").unwrap_or((line, ""));
        let mut words = head.splitn(3, ' ');
        let (kind, name, unit) = (words.next().unwrap(), words.next().unwrap_or(""), words.next().unwrap_or("?"));
        let given = (unit != "?").then_some(unit.to_string());
        let mut note = |item| {
            if given.is_some() {
                declared.insert(item);
            }
        };
        let unit = given.clone().unwrap_or("1".into());
        match kind {
            "p" => {
                note(Item::Parameter(source.parameters.len()));
                source.parameters.push(Parameter { unit, ..Parameter::new(name, 2.0) });
            }
            "s" => {
                note(Item::State(source.states.len()));
                source.states.push(State { unit, ..State::new(name) });
                source.equations.push(Definition::new(name, expression));
            }
            "d" => source.definitions.push(Definition::new(name, expression)),
            "o" => {
                note(Item::Output(source.outputs.len()));
                source.outputs.push(Output { unit, ..Output::new(name, expression) });
            }
            "c" => source.constants.push(Constant::new(name, unit.parse().unwrap())),
            "f" => source.forcing = Some(Forcing { is_frequency: true, expression: expression.into() }),
            "t" => source.time = name.into(),
            "h" => {
                let (name, arguments) = Function::head(&head[2..]).unwrap();
                source.functions.push(Function { name, arguments, expression: expression.into() });
            }
            _ => panic!("{line}"),
        }
    }
    // A frequency in the wrong unit also has the wrong value, which is not tested here.
    let other = |error: &crate::model::ModelError| error.item != Item::Forcing;
    if let Err(errors) = crate::model::Model::compile(source.clone()) {
        assert!(!errors.iter().any(other), "{errors:?}");
    }
    check_units(&source, &|item| declared.contains(&item))
}

fn consistent(text: &str) -> UnitReport {
    let report = report(text);
    let UnitReport { errors, doubts, numbers, .. } = &report;
    assert!(errors.is_empty() && doubts.is_empty() && numbers.is_empty(), "{text}\n{report:#?}");
    report
}

/// Checks that there is exactly one contradiction and that its message contains the two units.
#[track_caller]
fn refused(text: &str, units: [&str; 2]) {
    let report = report(text);
    assert_eq!(report.errors.len(), 1, "{text}\n{report:#?}");
    let message = &report.errors[0].message;
    assert!(units.iter().all(|unit| message.contains(unit)), "{message}");
}

const SPRING: &str = "p m kg\np k N/m\n";

#[test]
fn a_velocity_in_kilograms_is_refused() {
    refused("s x m = v\ns v kg = 0", ["m/s", "kg"]);
}

#[test]
fn an_undeclared_damping_constant_takes_the_unit_that_fits() {
    consistent(&format!("{SPRING}p c\ns x m = v\ns v m/s = (-k*x - c*v)/m"));
    // If it occurs twice, it must fit twice.
    let twice = format!("{SPRING}p c\ns x m = v\ns v m/s = (-k*x - c*v - c*x)/m");
    let report = report(&twice);
    assert!(report.errors.is_empty() && report.doubts[0].message.contains("kg m/s"), "{report:#?}");
}

/// A model that states some of its units, and leaves a mass of 1 out of an equation.
#[test]
fn contradictions_with_units_that_are_not_stated_are_doubts() {
    let text = format!("{SPRING}p c\ns x = v\ns v = (-k*x - c*v)/m\ns y = w\ns w = -k*y - c*w");
    let UnitReport { errors, doubts, .. } = report(&text);
    assert!(errors.is_empty() && doubts.len() == 1 && doubts[0].message.contains("[y]"), "{errors:?} {doubts:?}");
    // Definitions have firm units if they are made of declared ones.
    let text = format!("{SPRING}d force = -k*x\ns x m = v\ns v m/s = force");
    refused(&text, ["m/s^2", "N"]);
}

#[test]
fn a_force_is_not_an_acceleration() {
    refused(&format!("{SPRING}s x m = v\ns v m/s = -k*x"), ["m/s^2", "N"]);
}

#[test]
fn units_without_a_declared_one_are_not_checked() {
    assert_eq!(report("s x = x + x^2 + sin(x)"), UnitReport::default());
    consistent("p g -\ns phi rad = w\ns w = -sin(phi) + g");
}

#[test]
fn functions_of_pure_numbers_refuse_lengths() {
    refused("p w\ns x m = y\ns y = w*y*sin(x)", ["sin", " m, but must be"]);
    refused("p w\ns x m = y\ns y = w*y*exp(x)", ["exp", " m, but must be"]);
    refused("p L m\np d mm\ns x m = y\ns y m/s = y^2*tanh(x/d)/L", ["tanh", "1000"]);
}

#[test]
fn equal_dimensions_of_different_size_are_refused() {
    refused("s x mm = v\ns v m/s = 0", ["mm/s", "in m/s"]);
    refused("p V0 V\np tau s\ns v mV = (V0 - v)/tau", ["V", "mV"]);
}

#[test]
fn conversion_factors_in_formulas_are_recognised() {
    consistent("s x mm = 1000*v\ns v m/s = 0");
    consistent("s x mm = v/1e-3\ns v m/s = 0");
    consistent(&format!(
        "{SPRING}p n rpm\np e m\nf = 2*pi*n/60\nd Om = 2*pi*n/60\ns x m = v\ns v m/s = -k*x/m + e*Om^2*cos(Om*t)"
    ));
    consistent(&format!(
        "{SPRING}p f Hz\np e m\nf = 2*pi*f\nd Om = 2*pi*f\ns x m = v\ns v m/s = -k*x/m + e*Om^2*cos(Om*t)"
    ));
    consistent("c rpm 0.10471975511965977\np n rpm\np a m\nf = rpm*n\ns x m = a*rpm*n*cos(rpm*n*t)");
    // A number that is not the missing factor.
    let report = report("s x mm = 500*v\ns v m/s = 0");
    assert_eq!((report.errors.len(), report.doubts.len()), (0, 1), "{report:#?}");
}

#[test]
fn a_frequency_in_hertz_is_not_an_angular_frequency() {
    refused("p f Hz\np a m/s\nf = f\ns x m = a*cos(2*pi*f*t)", ["rad/s", "Hz"]);
    refused("p f Hz\np a m/s\nf = 2*pi*f\ns x m = a*cos(f*t)", ["cos", "angle"]);
    // As a rate it is 1/s.
    consistent("p f Hz\ns x m = -f*x");
}

#[test]
fn numbers_that_stand_for_quantities_are_named() {
    let report = report("s v mV = (v + 40)/3*exp(-(v + 40)/10)");
    assert!(report.errors.is_empty());
    let told: Vec<&str> = report.numbers.iter().map(|n| n.message.as_str()).collect();
    assert!(told.contains(&"40 is taken as 40 mV") && told.contains(&"10 is taken as 10 mV"), "{told:?}");
}

/// Hodgkin and Huxley 1952, equations 12 to 23, in the units of that paper.
#[test]
fn the_squid_axon_passes_in_its_usual_units() {
    let text = "p C uF/cm^2\np gNa mS/cm^2\np ENa mV\np I uA/cm^2\n\
        d am = 0.1*(V + 40)/(1 - exp(-(V + 40)/10))\nd bm = 4*exp(-(V + 65)/18)\n\
        d ah = 0.07*exp(-(V + 65)/20)\nd bh = 1/(1 + exp(-(V + 35)/10))\n\
        s V mV = (I - gNa*m^3*h*(V - ENa))/C\ns m 1 = am*(1 - m) - bm*m\ns h = ah*(1 - h) - bh*h";
    let report = report(text);
    assert!(report.errors.is_empty() && report.doubts.is_empty(), "{report:#?}");
    assert_eq!(report.time.as_deref(), Some("ms"));
    assert!(!report.numbers.is_empty());
}

#[test]
fn powers_with_a_parameter_as_exponent_are_understood() {
    consistent(
        "h hill(x, K, n) = x^n/(K^n + x^n)\np K mol/l\np n\np k mol/l/min\np d 1/min\ns c mol/l = k*hill(c, K, n) - d*c",
    );
    refused(
        "h hill(x, K, n) = x^n/(K^n + x^n)\np K mol\np n\np k mol/l/min\ns c mol/l = k*hill(c, K, n)",
        ["K^n", "x^n"],
    );
}

#[test]
fn the_unit_of_time_follows_or_is_stated() {
    assert_eq!(consistent("p tau ms\np I mV\ns v mV = (I - v)/tau").time.as_deref(), Some("ms"));
    assert_eq!(consistent("p k 1/min\ns c mol/l = -k*c").time.as_deref(), Some("min"));
    assert_eq!(consistent(&format!("{SPRING}s x m = v\ns v m/s = -k*x/m")).time.as_deref(), Some("s"));
    refused("s x m = v\ns v m = 0", ["m/s", "m"]);
    consistent("t 1\ns x m = v\ns v m = -x");
}

#[test]
fn outputs_have_the_unit_they_state() {
    consistent(&format!("{SPRING}s x m = v\ns v m/s = -k*x/m\no E J = m*v^2/2 + k*x^2/2"));
    refused(&format!("{SPRING}s x m = v\ns v m/s = -k*x/m\no E W = m*v^2/2"), ["W", "N m"]);
}

#[test]
fn unknown_units_are_base_units() {
    let report = consistent("p k 1/h\np K cells/ml\ns n cells/ml = k*n*(1 - n/K)");
    assert_eq!((report.foreign, report.time.as_deref()), (vec!["cells".to_string()], Some("h")));
    refused("p k 1/h\ns n cells/ml = k*n\ns m g/ml = k*(m + n)", ["g/ml", "cells/ml"]);
}

#[test]
fn zero_has_every_unit() {
    consistent("p c 1/s\np d m\ns x m = if(x > 0, c*max(x - d, 0), 0)");
}
