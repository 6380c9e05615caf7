//! Model files: the published ones compile and are finite where they start; mistakes are reported with their position.

use foldline::contract::{Batch, Parameters, VectorField};
use foldline_store::diagnostic::Diagnostic;
use foldline_store::model_file::{parse_model, read_model};
use std::path::Path;

fn mistakes(text: &str) -> Vec<Diagnostic> {
    match parse_model(text, "model.toml") {
        Ok(_) => Vec::new(),
        Err(found) => found,
    }
}

/// Returns line and column, the marked words, and the whole message of the only mistake.
fn only(text: &str) -> ((usize, usize), String, String) {
    let found = mistakes(text);
    assert_eq!(found.len(), 1, "{found:?}");
    let words = found[0].snippet.chars().skip(found[0].column - 1).take(found[0].length).collect();
    ((found[0].line, found[0].column), words, found[0].to_string())
}

#[test]
fn every_published_model_compiles_and_is_finite() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
    let mut seen = 0;
    for entry in std::fs::read_dir(&folder).expect("the folder of models is there") {
        let path = entry.expect("it can be listed").path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let (model, text) = read_model(&path).unwrap_or_else(|found| panic!("{}: {}", path.display(), found[0]));
        assert_eq!(std::fs::read_to_string(&path).ok(), Some(text));
        assert!(!model.source.is_empty() && !model.description.is_empty(), "{}: no source", path.display());
        let p = model.defaults();
        // Both ends and the middle of the sampling ranges.
        for share in [0.0, 0.5, 1.0] {
            let x: Vec<f64> = model.ranges().iter().map(|[low, high]| low + share * (high - low)).collect();
            let at = Batch { lanes: 1, states: &x, parameters: Parameters::Shared(&p), times: &[], signs: &[] };
            let (mut f, mut outputs) = (vec![0.0; model.dim()], vec![0.0; model.output_count()]);
            model.evaluate(at, &mut f);
            model.outputs(at, &mut outputs);
            assert!(f.iter().chain(&outputs).all(|v| v.is_finite()), "{}: {f:?} {outputs:?}", path.display());
        }
        seen += 1;
    }
    assert!(seen >= 7, "{seen} models");
}

const OSCILLATOR: &str = r#"name = "oscillator"
whirl = ["x", "y"]

[parameters]
mu = { value = 1.5, unit = "1/s", description = "damping" }
k = 2

[definitions]
spring = "k*x"

[states.y]
equation = "mu*(1 - x^2)*y - spring"
scale = 3.0

[states.x]
equation = "y"
range = [-1, 2.5]
unit = "m"

[outputs]
r = "hypot(x, y)"
power = { expression = "spring*y", unit = "W", description = "of the spring" }
"#;

#[test]
fn a_model_is_read_in_the_order_of_the_file() {
    let model = parse_model(OSCILLATOR, "oscillator.toml").unwrap_or_else(|found| panic!("{}", found[0]));
    assert_eq!(model.name, "oscillator");
    assert_eq!(model.defaults(), [1.5, 2.0]);
    assert_eq!(model.states.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), ["y", "x"]);
    assert_eq!((model.states[0].scale, model.states[0].range), (Some(3.0), None));
    assert_eq!((model.states[1].scale, model.states[1].range), (None, Some([-1.0, 2.5])));
    assert_eq!((model.scales(), model.ranges()), (vec![3.0, 0.875], vec![[-6.0, 6.0], [-1.0, 2.5]]));
    assert_eq!(model.states[1].unit, "m");
    assert_eq!(model.outputs[1].unit, "W");
    assert_eq!(model.whirl, Some([1, 0]));
}

#[test]
fn short_forms() {
    let text = "[states]\nx = 'y'\ny = '''\n  -x\n  - y'''\n";
    let model = parse_model(text, "some/folder/pendulum.toml").unwrap_or_else(|found| panic!("{}", found[0]));
    assert_eq!(model.name, "pendulum");
    let mut f = [0.0; 2];
    model.evaluate(
        Batch { lanes: 1, states: &[1.0, 2.0], parameters: Parameters::Shared(&[]), times: &[], signs: &[] },
        &mut f,
    );
    assert_eq!(f, [2.0, -3.0]);

    let text = "[states.x]\nrange = [0, 1]\n[equations]\nx = -1\n";
    assert!(mistakes(text).is_empty());
}

#[test]
fn a_mistake_in_an_expression_is_shown_at_its_column() {
    let text = OSCILLATOR.replace("mu*(1 - x^2)*y - spring", "mu*(1 - x^2)*tahn(y) - spring");
    let (place, words, message) = only(&text);
    assert_eq!((place, words.as_str()), ((12, 26), "tahn"));
    assert_eq!(
        message,
        "error: there is no function `tahn`\n  --> model.toml:12:26\n   |\n12 | equation = \"mu*(1 - x^2)*tahn(y) - spring\"\n   \
         |                          ^^^^\n   = help: did you mean `tanh`?"
    );

    let (place, words, message) = only(&OSCILLATOR.replace("hypot(x, y)", "hypot(x, y"));
    assert_eq!((place, words.as_str()), ((21, 11), "("));
    assert!(message.contains("never closed"));

    // In a multi-line text, and after multi-byte characters.
    let text = "[states]\nx = '''\n\n  1 +\n  größe'''\n";
    assert_eq!(only(text).0, (5, 3));
    let text = "[parameters]\n\"ψ\" = 1\n[states]\nx = \"ψ*ψ*q\"\n";
    assert_eq!((only(text).0, only(text).1), ((4, 10), "q".to_string()));
    // If escapes shift the text, the whole string is marked.
    let text = "[states]\nx = \"1 + \\u0071\"\n";
    assert_eq!((only(text).0, only(text).1), ((2, 5), "\"1 + \\u0071\"".to_string()));
}

#[test]
fn mistakes_outside_expressions_are_shown_too() {
    let cases = [
        // replaced text, replacement, position, words, part of the message
        ("value = 1.5", "valeu = 1.5", (5, 8), "valeu", "did you mean `value`?"),
        ("scale = 3.0", "scale = -3.0", (13, 9), "-3.0", "is not positive"),
        ("[-1, 2.5]", "[2.5, -1]", (17, 9), "[2.5, -1]", "wrong way round"),
        ("[-1, 2.5]", "[2.5]", (17, 9), "[2.5]", "not a pair of numbers"),
        ("k = 2", "k = \"2\"", (6, 5), "\"2\"", "not a number"),
        ("k = 2", "k = inf", (6, 5), "inf", "not a finite number"),
        ("[outputs]", "[outputs]\nx = \"1\"", (21, 1), "x", "the name of a state"),
        ("[definitions]", "[definitions]\nmu = \"1\"", (9, 1), "mu", "used twice"),
        ("[outputs]", "[equations]\nw = \"1\"\n[outputs]", (21, 1), "w", "not a declared state"),
        ("[outputs]", "[outpust]", (20, 2), "outpust", "did you mean `outputs`?"),
        ("whirl = [\"x\", \"y\"]", "whirl = [\"x\", \"z\"]", (2, 9), "[\"x\", \"z\"]", "`z` is not a state"),
        ("equation = \"y\"", "", (15, 9), "x", "has no equation"),
        ("equation = \"y\"", "equation = 'y", (16, 14), "", "error"),
    ];
    for (from, to, place, words, message) in cases {
        let found = only(&OSCILLATOR.replacen(from, to, 1));
        assert_eq!(found.0, place, "{to}: {}", found.2);
        if !words.is_empty() {
            assert_eq!(found.1, words, "{to}: {}", found.2);
        }
        assert!(found.2.contains(message), "{to}: {}", found.2);
    }
}

#[test]
fn all_mistakes_are_reported_in_the_order_of_the_file() {
    let text =
        OSCILLATOR.replace("k*x", "k*xx").replace("hypot(x, y)", "hypto(x, y)").replace("unit = \"m\"", "uint = \"m\"");
    let lines: Vec<usize> = mistakes(&text).iter().map(|d| d.line).collect();
    assert_eq!(lines, [9, 18, 21]);
}

#[test]
fn a_missing_file_is_named() {
    let Err(found) = read_model(Path::new("no/such/model.toml")) else { panic!("there is no such file") };
    assert!(found[0].message.contains("cannot be read") && found[0].file.contains("model.toml"), "{}", found[0]);
}

/// Forced oscillator of the book, whose time is measured in forcing periods.
#[test]
fn the_first_model_of_the_book_is_right() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/book/model-files.md");
    let page = std::fs::read_to_string(page).expect("the page is there");
    let text = page.split("```").nth(1).and_then(|block| block.strip_prefix("toml\n")).expect("it has a model");
    assert!(text.lines().count() <= 21, "twenty lines are promised");
    let model = parse_model(text, "first.toml").unwrap_or_else(|found| panic!("{}", found[0]));
    let (mut f, p) = ([0.0; 2], model.defaults());
    let at = Batch { lanes: 1, states: &[0.5, 0.25], parameters: Parameters::Shared(&p), times: &[0.3], signs: &[] };
    model.evaluate(at, &mut f);
    let period = std::f64::consts::TAU / 1.2;
    assert!(model.forced() && (model.time_unit(&p) - period).abs() < 1e-15);
    let force = 0.06 * (0.3 * std::f64::consts::TAU).cos();
    for (found, expected) in f.iter().zip([0.25, force - 2.0 * 0.02 * 0.25 - 0.625]) {
        assert!((found - period * expected).abs() < 1e-14, "{f:?}");
    }
}

#[test]
fn values_with_units_are_converted_and_expressions_are_left_alone() {
    let text = r#"
[constants]
V0 = "40 mV"
n = "2*3"
[parameters]
beta = 2.0
K = "15*beta"
d = { value = "0.3 mm", unit = "m" }
speed = "2670 rpm"
k = { values = ["1 kN/m", 2000], unit = "N/m" }
[states.x]
equation = "-x*speed*V0/V0*n"
unit = "m"
range = ["-2 mm", "0.5 cm"]
scale = "1 mm"
"#;
    let model = parse_model(text, "model.toml").unwrap_or_else(|found| panic!("{}", found[0]));
    let value = |name: &str| model.parameters.iter().find(|p| p.name == name).map(|p| (p.value, p.unit.as_str()));
    assert_eq!(value("d"), Some((3e-4, "m")));
    assert_eq!(value("speed"), Some((2670.0, "rpm")));
    assert_eq!([value("k[1]"), value("k[2]")], [Some((1000.0, "N/m")), Some((2000.0, "N/m"))]);
    assert_eq!(value("K"), None);
    assert_eq!((model.states[0].range, model.states[0].scale), (Some([-2e-3, 5e-3]), Some(1e-3)));
    // A missing multiplication sign does not make a unit.
    let forgotten = "[parameters]\nbeta = 2\nK = \"15 beta\"\n[states]\nx = \"-x\"\n";
    let ((line, column), _, message) = only(forgotten);
    assert_eq!((line, column), (3, 5));
    assert!(message.contains("`15*beta`"), "{message}");
}

#[test]
fn the_unit_of_time_follows_from_the_others() {
    let model = |head: &str, body: &str| parse_model(&format!("{head}\n[states]\n{body}"), "model.toml");
    let time = |head: &str, body: &str| model(head, body).unwrap_or_else(|found| panic!("{}", found[0])).time.clone();
    let leak = "[parameters]\ntau = { value = 5, unit = \"ms\" }";
    assert_eq!(time(leak, "v = { equation = \"-v/tau\", unit = \"mV\" }"), "ms");
    assert_eq!(time("", "v = \"-v\""), "");
    assert_eq!(time("time = \"h\"", "v = \"-v\""), "h");
    let wrong = model("time = \"kg\"", "v = \"-v\"").unwrap_err();
    assert!(wrong[0].message.contains("not a unit of time"), "{}", wrong[0]);
}

/// Run of an earlier version that did not check units.
#[test]
fn runs_whose_units_contradict_each_other_are_still_read() {
    let model = "[parameters]\np = 0\n[states]\nx = { equation = \"v\", unit = \"m\" }\nv = { equation = \"p - x\", unit = \"kg\" }\n";
    let study = "model = \"m.toml\"\n[[seed]]\nname = \"s\"\nstate = { x = 0, v = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p\"\nrange = [0, 1]\n";
    assert!(foldline_store::study_file::parse_study(study, "s.toml", model, "m.toml").is_err());
    assert!(foldline_store::study_file::parse_study_of_run(study, "s.toml", model, "m.toml").is_ok());
}
