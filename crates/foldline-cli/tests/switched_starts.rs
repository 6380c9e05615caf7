//! A branch may start at the end of one that was switched to.

use foldline::contract::Unobserved;
use foldline::diagram::{Diagram, Ending, Family, Origin};
use foldline::explore::{System, run};
use foldline_store::study_file::parse_study;

const MODEL: &str = include_str!("../../../models/brusselator.toml");
const STUDY: &str = "model = \"m\"\n[[seed]]\nname = \"s\"\nstate = { x = 1, y = 1 }\nparameters = { A = 1, B = 1 }\n\
    [[branch]]\nname = \"steady\"\nfrom = \"s\"\nfree = \"B\"\nrange = [0.5, 3]\nswitch = { hopf = 1 }\n";

#[test]
fn the_cycles_born_at_a_hopf_point_go_on_in_another_parameter() {
    let text =
        format!("{STUDY}[[branch]]\nname = \"in A\"\nfrom = \"steady/hopf-1\"\nfree = \"A\"\nrange = [0.8, 2]\n");
    let study = parse_study(&text, "study", MODEL, "model").unwrap_or_else(|found| panic!("{}", found[0]));
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    let branch = diagram.branch("in A").unwrap();
    assert_eq!((branch.family, &branch.origin), (Family::Cycle, &Origin::EndOf("steady/hopf-1".into())));
    let start = branch.points.iter().find(|p| p.position == 0).unwrap();
    let [a, b] = ["A", "B"].map(|name| start.parameters[study.model.parameter_index(name).unwrap()]);
    assert!((a - 1.0).abs() < 1e-9 && (b - 3.0).abs() < 1e-9, "{a} {b}");
    // Closed form: the Hopf point is at B = 1 + A².
    let joined = branch.ends.iter().flatten().find_map(|end| match end {
        Ending::Joined { parameter, .. } => Some(*parameter),
        _ => None,
    });
    assert!((joined.unwrap() - 2f64.sqrt()).abs() < 1e-6, "{:?}", branch.ends);
}

#[test]
fn what_is_not_switched_to_is_no_start() {
    let text =
        |from: &str| format!("{STUDY}[[branch]]\nname = \"b\"\nfrom = \"{from}\"\nfree = \"A\"\nrange = [0.8, 2]\n");
    for (from, message) in [
        ("steady/period-doubling-1", "does not switch that far at period-doubling points"),
        ("steady/first", "no branch that leaves"),
        ("other/hopf-1", "there is no seed, branch, curve or homotopy"),
    ] {
        let found = parse_study(&text(from), "study", MODEL, "model").unwrap_err();
        assert!(found.len() == 1 && found[0].message.contains(message), "{from}: {found:?}");
    }
}
