//! Rotors of finite elements, against independent results.

mod models;
mod reference;

use foldline::contract::{Batch, Parameters, VectorField};
use foldline::model::Model;
use foldline_shaft::{Frame, Machine, Whirl};
use foldline_store::model_file::{parse_model, parse_rotor};
use models::{R599, rotor};
use reference::{Row, rows};
use std::f64::consts::TAU;

const RPM: f64 = TAU / 60.0;

fn machine(text: &str) -> (Model, Machine) {
    let (model, machine) = parse_rotor(text, "rotor.toml").unwrap_or_else(|found| panic!("{found:#?}"));
    (model, machine.expect("a rotor"))
}

fn speed(row: &Row) -> f64 {
    row.at.split(" rpm").next().unwrap().parse::<f64>().unwrap() * RPM
}

#[test]
fn natural_frequencies_are_those_of_the_reference() {
    let mut count = 0;
    for row in rows().iter().filter(|row| row.quantity.starts_with("natural frequency")) {
        let (_, machine) = machine(&rotor(&row.model));
        let linear = machine.linear(&machine.at_speed(&[100.0], speed(row)));
        // Without rotation every frequency occurs twice, and is listed once.
        let modes = linear.modes(12, false).unwrap();
        let place: usize = row.quantity.rsplit(' ').next().unwrap().parse().unwrap();
        let place = if speed(row) == 0.0 { 2 * place - 1 } else { place };
        row.compare(modes[place - 1].natural());
        count += 1;
    }
    assert_eq!(count, 27);
}

#[test]
fn critical_speeds_and_resonances_are_those_of_the_reference() {
    let mut count = 0;
    for row in rows() {
        let (_, machine) = machine(&rotor(&row.model));
        if let Some(place) = row.quantity.strip_prefix("critical speed ") {
            let found = machine.critical_speeds(&[100.0], 4).unwrap();
            let forward: Vec<_> = found.iter().filter(|own| own.whirl == Whirl::Forward).collect();
            row.compare(forward[place.parse::<usize>().unwrap() - 1].undamped / RPM);
            count += 1;
        } else if row.quantity.starts_with("speed of") {
            let ratio = if row.quantity.contains("2:1") { [2.0, 1.0] } else { [3.0, 1.0] };
            let found = machine.resonances(&[100.0], ratio, [1.0, 500.0]);
            assert_eq!(found.len(), 1, "{found:?}");
            row.compare(found[0] / RPM);
            count += 1;
        }
    }
    assert_eq!(count, 8);
}

#[test]
fn unbalance_responses_are_those_of_the_reference() {
    let mut count = 0;
    for row in rows().iter().filter(|row| row.quantity.starts_with("|x| at node")) {
        let at = row.at.rsplit(' ').next().unwrap();
        let text = format!("{}\n[[unbalance]]\nnode = {at}\namount = 1e-3\n", rotor(&row.model));
        let (_, machine) = machine(&text);
        let node: usize = row.quantity.rsplit(' ').next().unwrap().parse().unwrap();
        let found = machine.unbalance_response(&[100.0], &[speed(row)], &[node]);
        row.compare(found[0][0].x.norm());
        count += 1;
    }
    assert_eq!(count, 24);
}

/// The equations of the model and the matrices of the linear analyses are two routes to the same amplitude.
#[test]
fn the_response_to_unbalance_is_an_equilibrium_in_the_rotating_frame() {
    let text = format!("{R599}\n[[unbalance]]\nnode = 6\namount = 1e-3\nphase = \"30 deg\"\n");
    let text = text.replace("k = \"1e7 N/m\"", "k = \"1e7 N/m\"\nc = \"1e3 N s/m\"\nk-cross = \"2e5 N/m\"");
    let text = text.replace("density = \"7810 kg/m^3\"", "density = \"7810 kg/m^3\"\ninternal-damping = \"1e-5 s\"");
    let (model, machine) = machine(&text);
    let parameters = [250.0];
    let found = machine.linear(&parameters).response(&machine.loads(&parameters));
    // At time 0 the rotating axes are those at rest: u = Re x, v = Re y.
    let states: Vec<f64> = found.iter().flat_map(|z| [z.re, 0.0]).collect();
    let mut f = vec![0.0; states.len()];
    let at = Batch { lanes: 1, states: &states, parameters: Parameters::Shared(&parameters), times: &[], signs: &[] };
    model.evaluate(at, &mut f);
    let (mut f0, zero) = (f.clone(), vec![0.0; states.len()]);
    model.evaluate(Batch { states: &zero, ..at }, &mut f0);
    let size = |f: &[f64]| f.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    // Elastic forces are about 1e4 times the unbalance force, so 1e-11 of the latter is rounding error.
    assert!(size(&f) < 1e-9 * size(&f0), "{} {}", size(&f), size(&f0));
}

#[test]
fn both_frames_have_the_same_eigenvalues() {
    let damped = R599.replace("k = \"1e7 N/m\"", "k = \"1e7 N/m\"\nc = \"1e3 N s/m\"");
    let fixed = damped.replace("speed = \"Omega\"", "speed = \"Omega\"\nframe = \"fixed\"");
    let omega = 300.0;
    let eigenvalues = |text: &str| {
        let (model, _) = machine(text);
        let n = model.dim();
        let (mut f, mut fx) = (vec![0.0; n], vec![0.0; n * n]);
        let states = vec![0.0; n];
        let at = Batch { lanes: 1, states: &states, parameters: Parameters::Shared(&[omega]), times: &[], signs: &[] };
        model.linearise(at, &[], &mut f, &mut fx, &mut []);
        // Velocities in units of 1e5/s, so that both blocks have the size of the highest frequency.
        let scale = |i: usize| if i.is_multiple_of(2) { 1.0 } else { 1e5 };
        let a = foldline_general::Mat::from_fn(n, n, |i, j| fx[i * n + j] * scale(j) / scale(i));
        foldline_general::eigenvalues(a.as_ref()).unwrap()
    };
    let (fixed, rotating) = (eigenvalues(&fixed), eigenvalues(&damped));
    for z in fixed.iter().filter(|z| z.im.abs() < 3e3) {
        // A forward whirl at ω is seen at ω - Ω, a backward one at ω + Ω.
        let near = rotating.iter().flat_map(|w| [omega, -omega].map(|shift| (w.re - z.re).hypot(w.im + shift - z.im)));
        let nearest = near.fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-4, "{z}: {nearest}");
    }
    let (_, machine) = machine(&damped);
    let modes = machine.linear(&[omega]).modes(6, false).unwrap();
    for mode in &modes {
        let nearest = fixed.iter().map(|z| (z - mode.value).norm()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-4, "{:?}: {nearest}", mode.value);
    }
}

#[test]
fn an_anisotropic_rotor_has_no_rotating_frame() {
    let text = rotor("R592").replace("speed = \"Omega\"", "speed = \"Omega\"\nframe = \"rotating\"");
    let found = parse_model(&text, "rotor.toml").unwrap_err();
    assert_eq!(found.len(), 1, "{found:#?}");
    let message = found[0].to_string();
    assert!(message.contains("kxx = 1e6 and kyy = 8e5"), "{message}");
    assert!(message.contains("frame = \"fixed\""), "{message}");
    let (_, machine) = machine(&rotor("R592"));
    assert_eq!(machine.frame(), Frame::Fixed);
}

/// Sag of R599 on bearings with kyy = 4e6 N/m: 1.3689359973 mm at the disc (independent program).
#[test]
fn the_sag_is_that_of_the_reference() {
    let text = R599.replace("k = \"1e7 N/m\"", "kxx = \"1e7 N/m\"\nkyy = \"4e6 N/m\"");
    let (_, machine) = machine(&text);
    let sag = machine.sag(&[0.0]).unwrap();
    let first = machine.assembled.rotor.first(6);
    assert!((-sag[first + 1] / 1.3689359973e-3 - 1.0).abs() < 1e-8, "{}", sag[first + 1]);
    assert!(sag[first].abs() < 1e-15);
}

/// Coefficients that are parameters, expressions and tables of equal value give the same matrices as numbers.
#[test]
fn parameters_expressions_and_tables_mean_the_same_as_numbers() {
    let plain = R599.replace("k = \"1e7 N/m\"", "k = \"1e7 N/m\"\nc = 1000");
    let other = R599
        .replacen("k = \"1e7 N/m\"", "k = \"kb\"\nc = \"500*two\"", 1)
        .replacen(
            "k = \"1e7 N/m\"",
            "table = { speed = [0, 6000], unit = \"rpm\", kxx = [1e7, 1e7], kyy = [1e7, 1e7] }\nc = 1e3",
            1,
        )
        .replace("[parameters]", "[parameters]\ntwo = 2\nkb = \"10 kN/mm\"");
    let (_, a) = machine(&plain);
    let (model, b) = machine(&other);
    assert_eq!(b.frame(), Frame::Rotating);
    let mut values: Vec<f64> = model.parameters.iter().map(|own| own.value).collect();
    values[model.parameter_index("Omega").unwrap()] = 250.0;
    let [x, y] = [a.linear(&[250.0]), b.linear(&values)].map(|own| own.modes(6, false).unwrap());
    for (x, y) in x.iter().zip(&y) {
        assert!((x.value - y.value).norm() < 1e-9 * x.value.norm(), "{x:?} {y:?}");
    }
}

/// Two equal springs in series, with hardly any mass between them, are one spring of half the stiffness.
#[test]
fn a_light_support_puts_two_springs_in_series() {
    let support = "[[point-mass]]\nname = \"pedestal\"\nmass = 1e-6\n\n[[bearing]]\nnode = \"pedestal\"\nk = 2e7\n";
    let doubled = R599.replacen("node = 0\nk = \"1e7 N/m\"", "node = 0\nto = \"pedestal\"\nk = 2e7", 1);
    let (model, mounted) = machine(&format!("{doubled}\n{support}"));
    assert_eq!(model.dim(), 60);
    assert_eq!(mounted.frame(), Frame::Rotating);
    let (_, grounded) = machine(R599);
    let [x, y] = [mounted, grounded].map(|own| own.linear(&[200.0]).modes(4, false).unwrap());
    for (x, y) in x.iter().zip(&y) {
        assert!((x.value - y.value).norm() < 1e-7 * y.value.norm(), "{x:?} {y:?}");
    }
}

/// ζ of every mode at rest is the ratio given.
#[test]
fn modal_damping_gives_the_modes_at_rest_their_ratio() {
    let text = R599.replace("speed = \"Omega\"", "speed = \"Omega\"\nmodal-damping = 0.015");
    let (_, machine) = machine(&text);
    for mode in machine.linear(&[0.0]).modes(10, false).unwrap() {
        assert!((mode.ratio() - 0.015).abs() < 1e-8, "{mode:?}");
    }
}

/// Internal damping destabilises forward whirl above the critical speed, and not below: with Cᵢ = βK the threshold of
/// an undamped mode is where Ω = ω.
#[test]
fn internal_damping_destabilises_forward_whirl_above_the_critical_speed() {
    let text = R599.replace("density = \"7810 kg/m^3\"", "density = \"7810 kg/m^3\"\ninternal-damping = \"1e-6 s\"");
    let (_, machine) = machine(&text);
    let critical =
        machine.critical_speeds(&[100.0], 1).unwrap().iter().find(|own| own.whirl == Whirl::Forward).unwrap().undamped;
    for (factor, stable) in [(0.99, true), (1.01, false)] {
        let modes = machine.linear(&[factor * critical]).modes(4, false).unwrap();
        let forward = modes.iter().find(|own| own.whirl == Whirl::Forward).unwrap();
        assert_eq!(forward.value.re < 0.0, stable, "{factor}: {}", forward.value);
    }
}

#[test]
fn mistakes_in_a_rotor_have_place_cause_and_cure() {
    let cases = [
        ("length = \"1.5 m\"", "length = \"1.5 kg\"", "cannot be converted to m"),
        ("length = \"1.5 m\"", "length = \"Omega\"", "move `Omega` to [constants]"),
        ("width = \"70 mm\"", "brdth = \"70 mm\"", "unknown key `brdth`"),
        ("node = 6", "node = 9", "there is no node 9"),
        ("node = 6", "at = \"1.4 m\"", "the shaft has no node"),
        ("material = \"steel\"", "material = \"steal\"", "`steal`, which is not a material"),
        ("k = \"1e7 N/m\"", "k = \"1e7 N s/m\"", "cannot be converted to N/m"),
        ("k = \"1e7 N/m\"", "k = \"Omega\"", "cannot be converted to N/m"),
        ("k = \"1e7 N/m\"", "k = \"2*Omege\"", "Omege"),
        ("speed = \"Omega\"", "speed = \"Omega\"\nframe = \"corotating\"", "neither \"rotating\" nor \"fixed\""),
        ("[rotor]\nspeed = \"Omega\"", "", "there is no section `[rotor]`"),
        ("E = \"211 GPa\"", "E = 1e300", "Poisson's ratio"),
        ("width = \"70 mm\"", "width = 1e300", "not finite"),
        ("inner = \"50 mm\"", "inner = \"500 mm\"", "not smaller than its outer diameter"),
    ];
    for (from, to, expected) in cases {
        let text = R599.replacen(from, to, 1);
        assert_ne!(text, R599, "{from}");
        let found = parse_model(&text, "rotor.toml").expect_err(expected);
        let message = found.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n");
        assert!(message.contains(expected), "{expected}\n{message}");
        assert!(
            found.iter().all(|own| own.line > 0 && own.hint.as_ref().is_some_and(|hint| !hint.is_empty())),
            "{message}"
        );
    }
}

#[test]
fn the_units_of_expressions_are_checked() {
    let force = |text: &str| {
        format!(
            "{}\n[[force]]\nnode = 6\nu = \"{text}*u\"\nv = \"{text}*v\"\n",
            R599.replace("[parameters]", "[parameters]\nk3 = \"2e11 N/m^3\"")
        )
    };
    parse_model(&force("-k3*(u^2 + v^2)"), "rotor.toml").unwrap_or_else(|found| panic!("{found:#?}"));
    let found = parse_model(&force("-k3*(u^2 + v^2)*vu"), "rotor.toml").unwrap_err();
    assert!(found[0].message.contains("N"), "{found:#?}");
}

/// A free shaft has rigid motions at zero frequency; its first bending frequency is that of a slender free beam,
/// 22.3733 sqrt(EI/ρA)/l²; at a slenderness of 150, shear and rotary inertia and six elements change it by less than 1e-3.
#[test]
fn a_free_shaft_has_the_frequencies_of_a_free_beam() {
    let free = R599.split("[[disc]]").next().unwrap().replace("diameter = \"50 mm\"", "diameter = \"10 mm\"");
    let (_, machine) = machine(&free);
    let modes = machine.linear(&[0.0]).modes(8, false).unwrap();
    let slender = 22.3732854 * (211e9 / 7810.0f64).sqrt() * 0.01 / 4.0 / 1.5f64.powi(2);
    let bending = modes.iter().map(|mode| mode.value.im).find(|w| *w > 0.1 * slender).unwrap();
    assert!((bending / slender - 1.0).abs() < 1e-3, "{bending} {slender}");
    assert!(machine.sag(&[0.0]).is_none());
}
