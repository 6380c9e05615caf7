//! Symmetries of a model that remain in a study.

use foldline::explore::System;
use foldline_store::study_file::parse_study;

const MODEL: &str = "name = \"pitchfork\"\n[parameters]\nmu = 1\nh = 0\n[states]\nx = \"mu*x - x^3 + h\"\n";

fn reflections(branch: &str) -> usize {
    let seed = "model = \"m\"\n[[seed]]\nname = \"s\"\nstate = { x = 1 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n";
    let study = parse_study(&format!("{seed}{branch}"), "study", MODEL, "model").unwrap();
    System::of_plan(&study.model, &study.plan).reflections.len()
}

#[test]
fn a_symmetry_broken_by_the_free_parameter_is_dropped() {
    assert_eq!(reflections("free = \"mu\"\nrange = [-1, 2]\n"), 2);
    assert_eq!(reflections("free = \"h\"\nrange = [-1, 1]\n"), 1);
}

#[test]
fn a_symmetry_broken_by_a_curve_or_a_homotopy_is_dropped() {
    let branch = "free = \"mu\"\nrange = [-1, 2]\n";
    let curve = "[[curve]]\nname = \"c\"\nhold = \"fold\"\nof = \"b\"\n";
    assert_eq!(reflections(&format!("{branch}{curve}free = \"h\"\nrange = [-1, 1]\n")), 1);
    let homotopy = "[[homotopy]]\nname = \"h\"\nfrom = \"s\"\n";
    assert_eq!(reflections(&format!("{branch}{homotopy}to = {{ h = 1 }}\nvia = \"mu\"\nrange = [-1, 2]\n")), 1);
    assert_eq!(reflections(&format!("{branch}{homotopy}to = {{ mu = 2 }}\nvia = \"h\"\nrange = [-1, 1]\n")), 1);
}
