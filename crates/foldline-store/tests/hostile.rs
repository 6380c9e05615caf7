//! Hostile input files: endless, huge, deeply nested, circular, or with misleading characters.

use foldline_store::diagnostic::Diagnostic;
use foldline_store::model_file::{parse_model, read_model};
use std::fmt::Write;

fn refused(text: &str) -> Vec<Diagnostic> {
    parse_model(text, "m.toml").expect_err("a model with mistakes")
}

/// Returns line, message and hint of the only mistake.
#[track_caller]
fn mistake(text: &str) -> (usize, String, String) {
    let found = refused(text);
    let [one] = &found[..] else { panic!("{found:#?}") };
    (one.line, one.message.clone(), one.hint.clone().unwrap_or_default())
}

fn with_equation(equation: &str) -> String {
    format!("[parameters]\na = 1.0\n[states]\nx = \"{equation}\"\n")
}

#[test]
fn a_million_states() {
    let mut text = String::from("[states]\n");
    (0..1_000_000).for_each(|i| writeln!(text, "x{i} = \"-x{i}\"").unwrap());
    let (_, message, hint) = mistake(&text);
    assert_eq!(message, "the model has 1000000 states; the limit is 1000");
    assert!(hint.contains("dense matrices"));
}

#[test]
fn the_largest_allowed_number_of_states() {
    let mut text = String::from("[states]\n");
    (0..1000).for_each(|i| writeln!(text, "x{i} = \"x{} - x{i}^3\"", (i + 1) % 1000).unwrap());
    assert_eq!(parse_model(&text, "m.toml").unwrap().states.len(), 1000);
}

/// Each definition depends on the next one in the file.
#[test]
fn a_long_chain_of_definitions_in_reverse_order() {
    let mut text = String::from("[states]\nx = \"d0\"\n[definitions]\n");
    (0..50_000).for_each(|i| writeln!(text, "d{i} = \"d{} + x\"", i + 1).unwrap());
    writeln!(text, "d50000 = \"-x\"").unwrap();
    parse_model(&text, "m.toml").unwrap();
}

#[test]
fn a_long_cycle_of_definitions() {
    let mut text = String::from("[states]\nx = \"d0\"\n[definitions]\n");
    (0..50_000).for_each(|i| writeln!(text, "d{i} = \"d{} + x\"", (i + 1) % 50_000).unwrap());
    let (_, message, _) = mistake(&text);
    assert!(message.starts_with("circular definitions: d0 → d1 → ") && message.len() < 200, "{message}");
}

#[test]
fn deeply_nested_brackets_signs_and_tables() {
    for text in ["(".repeat(100_000), "-".repeat(100_000) + "x", "sin(".repeat(100_000), "x^".repeat(100_000) + "x"] {
        let (line, message, hint) = mistake(&with_equation(&text));
        assert_eq!((line, message.as_str()), (4, "the expression is nested more than 200 deep"));
        assert_eq!(hint, "name the inner parts in the definitions");
    }
    let deep = format!("name = {}1{}\n[states]\nx = \"-x\"\n", "[".repeat(100_000), "]".repeat(100_000));
    assert!(refused(&deep).iter().all(|d| d.to_string().len() < 2000));
}

#[test]
fn an_expression_of_many_terms() {
    parse_model(&with_equation(&("x".to_string() + &" + x*a".repeat(200_000))), "m.toml").unwrap();
}

#[test]
fn a_thousand_mistakes_are_not_all_reported() {
    let mut text = String::from("[states]\n");
    (0..900).for_each(|i| writeln!(text, "x{i} = \"y{i} + z{i}*w{i}\"").unwrap());
    assert_eq!(refused(&text).len(), 100);
}

#[test]
fn a_name_of_a_million_letters() {
    let long = "q".repeat(1_000_000);
    for text in
        [with_equation(&long), with_equation(&format!("{long}(x)")), format!("[states]\nx = \"-x\"\n[{long}]\n")]
    {
        assert!(refused(&text).iter().all(|d| d.to_string().len() < 4000));
    }
}

#[test]
fn names_that_clash() {
    let clash = |text: &str| mistake(text).1;
    assert_eq!(clash("[states]\nsin = \"1\"\n"), "`sin` is the name of a function");
    assert_eq!(clash("[states]\npi = \"1\"\n"), "`pi` is a constant");
    assert_eq!(
        clash("[parameters]\nx = 1\n[states]\nx = \"-x\"\n"),
        "the name `x` is used twice: it is already a parameter"
    );
    assert!(clash("[states]\nx = \"-x\"\nx = \"x\"\n").contains("`x` is given twice"));
}

#[test]
fn an_empty_file() {
    for text in ["", "\n\n", "[states]\n", "[parameters]\n", "\u{feff}", "states = {}\n"] {
        assert_eq!(mistake(text).1, "the model has no states", "{text:?}");
    }
    assert_eq!(mistake("[states]\nx = \"\"\n").1, "the equation of `x` is empty");
    assert_eq!(mistake("[states]\nx = \"   \"\n").1, "the expression is empty");
}

#[test]
fn invalid_numbers() {
    for number in ["nan", "inf", "-inf", "1e999", "-1e309"] {
        let (line, message, _) = mistake(&format!("[parameters]\na = {number}\n[states]\nx = \"-x\"\n"));
        assert_eq!((line, message.as_str()), (2, "the parameter `a` is not a finite number"), "{number}");
        let (line, ..) = mistake(&format!("[states.x]\nequation = \"-x\"\nscale = {number}\n"));
        assert_eq!(line, 3);
    }
    let (_, message, _) = mistake(&with_equation("1e999*x"));
    assert_eq!(message, "`1e999` is too large for a number");
    let (_, message, _) = mistake(&with_equation(&format!("{}*x", "9".repeat(100_000))));
    assert!(message.ends_with('…'), "{message}");
}

#[test]
fn letters_that_look_alike() {
    // The micro sign found on keyboards instead of the Greek letter.
    let (_, message, hint) = mistake("[parameters]\n\"\u{3bc}\" = 1.0\n[states]\nx = \"\u{b5}*x\"\n");
    assert_eq!(message, "unknown name `\u{b5}`");
    assert_eq!(hint, "did you mean `\u{3bc}`? `\u{b5}` is U+00B5, `\u{3bc}` is U+03BC");
}

#[test]
fn terminal_control_characters_are_escaped() {
    for text in
        ["[states]\n\"\\u001b[2J\" = \"1\"\n", "[states]\nx = \"-x\u{202e}\"\n", "[states]\nx = \"-x \\u0000\"\n"]
    {
        let shown: String = refused(text).iter().map(Diagnostic::to_string).collect();
        assert!(!shown.contains(['\u{1b}', '\u{202e}', '\0']), "{shown:?}");
        assert!(shown.contains("\\u{1b}") || shown.contains("\\u{202e}") || shown.contains("\\u{0}"), "{shown}");
    }
}

#[cfg(unix)]
#[test]
fn an_endless_file_and_a_binary_file() {
    let found = read_model(std::path::Path::new("/dev/zero")).expect_err("no model");
    assert!(found[0].message.contains("longer than 64 MiB"), "{}", found[0]);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("m.toml");
    std::fs::write(&file, [0xff, 0xfe, 0x00, 0x41]).unwrap();
    let found = read_model(&file).expect_err("no model");
    assert!(found[0].hint.as_ref().is_some_and(|hint| hint.contains("UTF-8")), "{}", found[0]);
    assert!(read_model(folder.path()).is_err());
}
