//! Marks request solutions at given values and change nothing else in the result.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Cost, Diagram, Ending, Kind};
use foldline::explore::{self, System};
use foldline_store::study_file::parse_study;

/// Food chain of three species; demo `tfc` of AUTO-07p (Kuznetsov, De Feo, Rinaldi 2001).
const FOOD_CHAIN: &str = "name = \"tfc\"\n[parameters]\na1 = 5.0\nb1 = 3.0\nd1 = 1.1083\na2 = 0.1\nb2 = 2.0\nd2 = 0.01\n\
    [states]\nx = \"1 - exp(x) - a1*exp(y)/(1 + b1*exp(x))\"\n\
    y = \"a1*exp(x)/(1 + b1*exp(x)) - d1 - a2*z/(1 + b2*exp(y))\"\nz = \"z*(a2*exp(y)/(1 + b2*exp(y)) - d2)\"\n";
const FOOD_CHAIN_STUDY: &str = "[[seed]]\nname = \"s\"\nstate = { x = -0.413049, y = -1.59954, z = 0 }\n\
    [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"d1\"\nrange = [0.3, 1.2]\nswitch = { hopf = 1 }\n";

fn grown(model: &str, study: &str) -> Diagram {
    let study = parse_study(&format!("model = \"m\"\n{study}"), "study", model, "model")
        .unwrap_or_else(|found| panic!("{found:?}"));
    explore::run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved)
}

/// Everything known of a branch except its marks and the work done, every number to the last bit.
fn unmarked(branch: &Branch) -> String {
    let mut branch = branch.clone();
    branch.special.retain(|special| special.kind != Kind::Mark);
    branch
        .points
        .iter_mut()
        .chain(branch.special.iter_mut().map(|s| &mut s.point))
        .for_each(|p| p.cost = Cost::default());
    format!("{branch:?}")
}

/// Values of a parameter at the marks of a branch.
fn marks(branch: &Branch, index: usize) -> Vec<f64> {
    branch.special.iter().filter(|s| s.kind == Kind::Mark).map(|s| s.point.parameters[index]).collect()
}

/// Runs a study without and with a line of marks added to its last table, and asserts that the branches agree; returns
/// the marked diagram.
#[track_caller]
fn compared(model: &str, study: &str, line: &str, at_least: usize) -> Diagram {
    let [plain, marked] = [grown(model, study), grown(model, &format!("{study}{line}\n"))];
    let count = marked.branches.iter().map(|b| marks(b, 0).len()).sum::<usize>();
    assert!(count >= at_least, "{count} marks");
    assert_eq!(plain.branches.len(), marked.branches.len());
    for (plain, marked) in plain.branches.iter().zip(&marked.branches) {
        assert!(unmarked(plain) == unmarked(marked), "{} has changed", plain.name);
    }
    marked
}

#[test]
fn a_mark_next_to_a_hopf_point_does_not_affect_the_branch_born_there() {
    let marked = compared(FOOD_CHAIN, FOOD_CHAIN_STUDY, "mark = { d1 = [0.75, 0.8, 0.83, 0.84, 0.9] }", 8);
    let cycles = marked.branch("b/hopf-1").unwrap();
    let at = cycles.special.iter().find(|s| s.point.parameters[2] == 0.75).unwrap();
    // The period that AUTO prints for its user point.
    assert!((at.point.solution.period().unwrap() - 12.6846).abs() < 1e-4);
}

#[test]
fn marks_of_all_quantities_leave_equilibria_and_cycles_unchanged() {
    let brusselator = include_str!("../../../models/brusselator.toml");
    let study = "[[seed]]\nname = \"s\"\nstate = { x = 1, y = 1 }\nparameters = { A = 1, B = 1 }\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"B\"\nrange = [0.5, 4]\nswitch = { hopf = 1 }\n";
    compared(
        brusselator,
        study,
        "mark = { B = [0.9, 2, 2.001, 3], period = [6.5, 7], x_max = [1.5, 2], norm = 2.5 }",
        7,
    );
    let fitzhugh = include_str!("../../../models/fitzhugh-nagumo.toml");
    let study = "[[seed]]\nname = \"s\"\nattractor = \"equilibrium\"\nparameters = { a = 0.9 }\nsamples = 8\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"a\"\nrange = [-1, 1]\nswitch = { hopf = 1 }\n";
    compared(fitzhugh, study, "mark = { a = [-0.4, 0, 0.42, 0.43, 0.5], period = [9, 11] }", 5);
}

#[test]
fn marks_leave_a_cascade_unchanged() {
    let lorenz = include_str!("../../../models/lorenz.toml");
    let study = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nparameters = { rho = 280 }\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"rho\"\nrange = [212, 300]\nswitch = { period-doubling = 1 }\n";
    compared(lorenz, study, "mark = { rho = [215, 218.2, 218.3, 229, 230, 250], z_max = 380 }", 5);
}

#[test]
fn marks_leave_the_folds_of_a_forced_oscillator_unchanged() {
    let duffing = include_str!("../../../models/duffing-forced.toml");
    let study = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nparameters = { omega = 0.4 }\nsamples = 8\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"omega\"\nrange = [0.4, 2.5]\n";
    let marked = compared(duffing, study, "mark = { omega = [0.5, 1, 1.5, 2, 2.2], x_max = [0.5, 1, 1.5] }", 8);
    let branch = marked.branch("b").unwrap();
    assert!(branch.special.iter().any(|s| s.kind == Kind::Fold));
}

#[test]
fn a_value_on_both_sides_of_a_fold_within_one_step_is_marked_twice() {
    // x' = p - x²: the fold at p = 0 is passed in one step, and p = 1e-5 lies on both sides of it at x = ± 3.2e-3.
    let model = "name = \"fold\"\n[parameters]\np = 1\n[states]\nx = \"p - x^2\"\n";
    let study = "[[seed]]\nname = \"s\"\nstate = { x = 1 }\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p\"\nrange = [-1, 2]\n";
    let marked = compared(model, study, "mark = { p = 1e-5 }", 2);
    let branch = marked.branch("b").unwrap();
    let found: Vec<&str> = branch.special.iter().map(|s| s.kind.name()).collect();
    assert_eq!(found, ["mark", "fold", "mark"]);
    assert_eq!(marks(branch, 0), [1e-5, 1e-5]);
    let states: Vec<f64> = [0, 2].map(|k| branch.special[k].point.ranges[0][0]).to_vec();
    assert!((states[0] * states[1] + 1e-5).abs() < 1e-12, "{states:?}");
}

#[test]
fn a_stop_truncates_a_branch_without_changing_it() {
    let [plain, stopped] = [
        grown(FOOD_CHAIN, FOOD_CHAIN_STUDY),
        grown(FOOD_CHAIN, &format!("{FOOD_CHAIN_STUDY}stop = {{ d1 = 0.75 }}\n")),
    ];
    let [plain, stopped] = [&plain, &stopped].map(|diagram| diagram.branch("b/hopf-1").unwrap());
    let inner = |branch: &Branch| -> Vec<f64> {
        let own = branch.points.iter().map(|p| p.parameters[2]).filter(|d| *d > 0.75 + 1e-6);
        own.collect()
    };
    assert_eq!(inner(plain), inner(stopped));
    assert!(stopped.ends.contains(&Some(Ending::Asked(0.75))), "{:?}", stopped.ends);
}
