//! Invariants of the source tree stated in ARCHITECTURE.md, which the compiler does not check.

use crate::tree::Text;

/// Modules of the crate `foldline` and the modules that each may use.
const MODULES: &[(&str, &[&str])] = &[
    ("attractors", &["contract", "diagram", "problem", "simulation"]),
    ("continuation", &["contract", "diagram", "linalg"]),
    ("contract", &["diagram"]),
    ("converted", &["diagram", "model", "units"]),
    // For the nodes of a mesh interval.
    ("diagram", &["problem"]),
    ("emitted", &["contract", "model"]),
    (
        "explore",
        &[
            "attractors",
            "continuation",
            "contract",
            "diagram",
            "linalg",
            "model",
            "problem",
            "simulation",
            "special",
            "stability",
        ],
    ),
    // For the error of a singular matrix.
    ("linalg", &["contract"]),
    ("model", &["contract", "linalg", "units"]),
    // `problem::cycle::meshes` uses the test of collapse to an equilibrium.
    ("problem", &["contract", "diagram", "linalg", "special", "stability"]),
    ("sensitivity", &["attractors", "continuation", "contract", "diagram", "explore", "model", "problem", "special"]),
    ("simulation", &["contract", "diagram", "linalg"]),
    ("smoothing", &["diagram"]),
    ("special", &["contract", "diagram", "linalg", "model", "problem", "stability"]),
    ("stability", &["linalg"]),
    ("susceptibility", &["contract", "diagram", "special"]),
    ("units", &[]),
    (
        "verify",
        &[
            "attractors",
            "contract",
            "diagram",
            "explore",
            "linalg",
            "model",
            "problem",
            "simulation",
            "special",
            "stability",
        ],
    ),
];

/// Input, output, clock, environment and serialisation, which `foldline` does not use.
const OUTSIDE: [&str; 12] = [
    "std::fs",
    "std::env",
    "std::io",
    "std::process",
    "std::time",
    "std::net",
    "println!",
    "print!",
    "eprintln!",
    "eprint!",
    "dbg!",
    "serde",
];

/// Traits of `contract`.
const TRAITS: [&str; 5] = ["VectorField", "ZeroProblem", "Monitor", "Condition", "Observer"];

const SOURCE: &str = "crates/foldline/src/";

/// Returns a message for each violation of an invariant.
pub fn broken(texts: &[Text]) -> Vec<String> {
    let mut found = Vec::new();
    for text in texts.iter().filter(|text| text.name.starts_with(SOURCE) && text.is(&["rs"])) {
        let module = text.name[SOURCE.len()..].split(['/', '.']).next().unwrap_or_default();
        for (line, code) in product(text) {
            let place = format!("{}:{line}", text.name);
            for used in modules_in(code) {
                let allowed = MODULES.iter().find(|(name, _)| *name == module).map(|(_, allowed)| *allowed);
                let known = MODULES.iter().any(|(name, _)| *name == used);
                if let Some(allowed) = allowed
                    && known
                    && used != module
                    && !allowed.contains(&used)
                {
                    found.push(format!("{place}: {module} does not use {used} (crates/xtask/src/invariants.rs)"));
                }
            }
            if let Some(outside) = OUTSIDE.iter().find(|outside| code.contains(*outside)) {
                found.push(format!("{place}: the crate foldline does not use {outside}"));
            }
            if let Some(name) = code.trim_start().strip_prefix("pub trait ") {
                let name = name.split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default();
                let expected = if module == "contract" { TRAITS.contains(&name) } else { module == "linalg" };
                if !expected {
                    found.push(format!("{place}: the public traits are the five in contract, and those in linalg"));
                }
            }
        }
    }
    for text in texts.iter().filter(|text| text.name.starts_with("crates/") && text.name.ends_with("/Cargo.toml")) {
        if text.name.matches('/').count() == 2 && !text.text.contains("[lints]\nworkspace = true") {
            found.push(format!("{}: the lints of the workspace are missing", text.name));
        }
    }
    for text in texts.iter().filter(|text| text.is(&["rs"]) && text.name != "crates/xtask/src/invariants.rs") {
        for (at, _) in text.text.match_indices("allow(unsafe_code)") {
            found.push(format!("{}: unsafe code is not allowed in any crate", text.place(at)));
        }
    }
    for text in texts {
        // Marks that an unfinished merge leaves.
        let marks = ["<<<<<<< ", ">>>>>>> "];
        for (k, _) in text.text.lines().enumerate().filter(|(_, line)| marks.iter().any(|mark| line.starts_with(mark)))
        {
            found.push(format!("{}:{}: both sides of a conflict are still there", text.name, k + 1));
        }
    }
    found
}

/// Returns the lines of code with their numbers, without comments and tests.
fn product(text: &Text) -> impl Iterator<Item = (usize, &str)> {
    let tests = text.name.rsplit('/').any(|part| part.starts_with("tests"));
    let end = text.text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.text.len());
    let code =
        text.text[..end].lines().enumerate().map(|(k, line)| (k + 1, line.split("//").next().unwrap_or_default()));
    code.filter(move |_| !tests)
}

/// Returns the modules that a line names after `crate::`, alone or in braces.
fn modules_in(code: &str) -> Vec<&str> {
    let name = |text: &str| text.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len());
    let mut found = Vec::new();
    for after in code.split("crate::").skip(1) {
        if let Some(list) = after.strip_prefix('{') {
            found.extend(list.split(['{', '}', ',']).map(str::trim).map(|item| &item[..name(item)]));
        } else {
            found.push(&after[..name(after)]);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(name: &str, text: &str) -> Vec<String> {
        broken(&[Text { name: name.to_string(), text: text.to_string() }])
    }

    #[test]
    fn the_marks_of_a_conflict_are_reported() {
        let expected = "CHANGELOG.md:2: both sides of a conflict are still there";
        assert_eq!(found("CHANGELOG.md", "* one\n<<<<<<< HEAD\n* two\n"), [expected]);
        assert_eq!(found("CHANGELOG.md", "Title\n=======\n"), [""; 0]);
    }

    #[test]
    fn a_forbidden_module_is_reported_with_its_line() {
        let source = "//! Idea.\nuse crate::explore::System;\n";
        let expected = "crates/foldline/src/continuation/x.rs:2: continuation does not use explore";
        let found = found("crates/foldline/src/continuation/x.rs", source);
        assert!(found.len() == 1 && found[0].starts_with(expected), "{found:?}");
    }

    #[test]
    fn input_and_output_are_reported_except_in_comments_and_tests() {
        assert_eq!(found("crates/foldline/src/units/x.rs", "use std::fs;\n").len(), 1);
        assert_eq!(
            found("crates/foldline/src/units/x.rs", "// std::fs\n#[cfg(test)]\nmod tests {\nuse std::fs;\n"),
            [""; 0]
        );
        assert_eq!(found("crates/foldline/src/units/tests.rs", "use std::fs;\n"), [""; 0]);
        assert_eq!(found("crates/foldline-cli/src/run.rs", "use std::fs;\n"), [""; 0]);
    }

    #[test]
    fn a_sixth_trait_a_missing_lint_and_unsafe_code_are_reported() {
        assert_eq!(found("crates/foldline/src/special/x.rs", "pub trait New {}\n").len(), 1);
        assert_eq!(found("crates/foldline-new/Cargo.toml", "[package]\n").len(), 1);
        assert_eq!(found("crates/foldline-new/src/lib.rs", "#![allow(unsafe_code)]\n").len(), 1);
    }
}
