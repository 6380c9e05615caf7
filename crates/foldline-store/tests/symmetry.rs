//! Which symmetries of a model count in a study.

use foldline::explore::System;
use foldline_store::study_file::parse_study;

const MODEL: &str = "name = \"pitchfork\"\n[parameters]\nmu = 1\nh = 0\n[states]\nx = \"mu*x - x^3 + h\"\n";

fn reflections(branch: &str) -> usize {
    let seed = "model = \"m\"\n[[seed]]\nname = \"s\"\nstate = { x = 1 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n";
    let study = parse_study(&format!("{seed}{branch}"), "study", MODEL, "model").unwrap();
    System::of_plan(&study.model, &study.plan).reflections.len()
}

#[test]
fn a_symmetry_that_the_free_parameter_breaks_is_none() {
    assert_eq!(reflections("free = \"mu\"\nrange = [-1, 2]\n"), 2);
    assert_eq!(reflections("free = \"h\"\nrange = [-1, 1]\n"), 1);
}
