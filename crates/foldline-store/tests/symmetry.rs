//! Symmetries of a model that remain in a study.

use foldline::explore::System;
use foldline_store::study_file::parse_study;

const MODEL: &str = "name = \"pitchfork\"\n[parameters]\nmu = 1\nh = 0\n[states]\nx = \"mu*x - x^3 + h\"\n";

fn symmetries(branch: &str) -> usize {
    let seed = "model = \"m\"\n[[seed]]\nname = \"s\"\nstate = { x = 1 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n";
    let study = parse_study(&format!("{seed}{branch}"), "study", MODEL, "model").unwrap();
    System::of_plan(&study.model, &study.plan).symmetries.len()
}

#[test]
fn a_symmetry_broken_by_the_free_parameter_is_dropped() {
    assert_eq!(symmetries("free = \"mu\"\nrange = [-1, 2]\n"), 2);
    assert_eq!(symmetries("free = \"h\"\nrange = [-1, 1]\n"), 1);
}

#[test]
fn a_symmetry_broken_by_a_curve_or_a_homotopy_is_dropped() {
    let branch = "free = \"mu\"\nrange = [-1, 2]\n";
    let curve = "[[curve]]\nname = \"c\"\nhold = \"fold\"\nof = \"b\"\n";
    assert_eq!(symmetries(&format!("{branch}{curve}free = \"h\"\nrange = [-1, 1]\n")), 1);
    let homotopy = "[[homotopy]]\nname = \"h\"\nfrom = \"s\"\n";
    assert_eq!(symmetries(&format!("{branch}{homotopy}to = {{ h = 1 }}\nvia = \"mu\"\nrange = [-1, 2]\n")), 1);
    assert_eq!(symmetries(&format!("{branch}{homotopy}to = {{ mu = 2 }}\nvia = \"h\"\nrange = [-1, 1]\n")), 1);
}

/// Number of symmetries of a model without parameters that matter, in n states of these equations.
fn of_equations(equations: &[(&str, &str)]) -> usize {
    let states: String = equations.iter().map(|(name, own)| format!("{name} = \"{own}\"\n")).collect();
    let model = format!("name = \"cells\"\n[parameters]\nmu = 1\n[states]\n{states}");
    let state = equations.iter().map(|(name, _)| format!("{name} = 1")).collect::<Vec<_>>().join(", ");
    let study = format!(
        "model = \"m\"\n[[seed]]\nname = \"s\"\nstate = {{ {state} }}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"mu\"\nrange = [-1, 2]\n"
    );
    let study = parse_study(&study, "study", &model, "model").unwrap();
    let system = System::of_plan(&study.model, &study.plan);
    system.symmetries.len() + system.exchanges.len()
}

#[test]
fn permutations_of_the_states_with_and_without_changes_of_sign_are_found() {
    // Two cells that inhibit each other: exchange.
    assert_eq!(of_equations(&[("x", "mu - x + tanh(x - 2*y)"), ("y", "mu - y + tanh(y - 2*x)")]), 2);
    // Three in a ring, coupled in one direction: rotations. In both directions: reflections as well.
    let ring = |force: &dyn Fn(&str, &str, &str) -> String| {
        let [x, y, z] = [force("x", "y", "z"), force("y", "z", "x"), force("z", "x", "y")];
        of_equations(&[("x", &x), ("y", &y), ("z", &z)])
    };
    assert_eq!(ring(&|own, next, _| format!("{own}*(mu - {own}) - {next}^2")), 3);
    assert_eq!(ring(&|own, next, last| format!("{own}*(mu - {own}) - {next}*{last}")), 6);
    // Odd as well.
    assert_eq!(ring(&|own, next, last| format!("mu*{own} - {own}^3 + {next} + {last}")), 12);
    // A quarter turn is neither a reflection nor a permutation alone; with the odd powers it generates four.
    assert_eq!(of_equations(&[("x", "mu*x - y - x^3"), ("y", "x + mu*y - y^3")]), 4);
    // Masses of a chain between walls, from one end or the other, up or down; logarithms have no state 0.
    let chain = |k: usize| {
        let term = |name: &str, j: usize| if j == 0 || j > k { String::new() } else { format!(" + {name}{j}") };
        let of = |j: usize| format!("mu*x{j} - x{j}^3{}{}", term("x", j - 1), term("x", j + 1));
        let own: Vec<(String, String)> = (1..=k).map(|j| (format!("x{j}"), of(j))).collect();
        of_equations(&own.iter().map(|(name, own)| (name.as_str(), own.as_str())).collect::<Vec<_>>())
    };
    assert_eq!((chain(4), chain(12)), (4, 4));
    assert_eq!(of_equations(&[("x", "mu - log(x^2) - y"), ("y", "mu - log(y^2) - x")]), 2);
    assert_eq!(of_equations(&[("x", "mu - x + y^2"), ("y", "2*mu - y + x^2")]), 1);
}
