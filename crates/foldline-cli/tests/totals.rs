//! Conserved sums of states: continuation at given values of them.

use foldline::contract::Unobserved;
use foldline::diagram::{Diagram, Kind};
use foldline::explore::{self, System};
use foldline_store::study_file::{Study, parse_study};

fn study(model: &str, study: &str) -> Result<Study, String> {
    parse_study(&format!("model = \"m\"\n{study}"), "study", model, "model").map_err(|found| format!("{found:?}"))
}

#[track_caller]
fn run(model: &str, text: &str) -> Diagram {
    let study = study(model, text).unwrap_or_else(|found| panic!("{found}"));
    let system = System::of_plan(&study.model, &study.plan);
    explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved)
}

/// Six species and nine reactions, with rate constants from 1e-10 to 1e9. The reference value is the zero of the real
/// part of the eigenvalues of the Jacobian without two of the states.
const NETWORK: &str = "
[parameters]
k1 = 2.8384448207706775e-9
k2 = 2.276606366932523e-10
k3 = 1.0000091094346868
k4 = 29473.54319518398
k5 = 0.01816749288551057
k6 = 0.002345143593835089
k7 = 2.499174147678733e-5
k8 = 1.6010576150026472e9
k9 = 0.0005160737862267585
[states]
X1 = \"k1*X2 - k2*X1 - k8*X1*X5 - k9*X1*X6\"
X2 = \"-k1*X2 + k2*X1 + k8*X1*X5 + k9*X1*X6\"
X3 = \"-k3*X3 + k6*X4 + k8*X1*X5\"
X4 = \"k4*X5 - k5*X4 - k6*X4 + k9*X1*X6\"
X5 = \"k3*X3 - k4*X5 + k7*X6 - k8*X1*X5\"
X6 = \"k5*X4 - k7*X6 - k9*X1*X6\"
";
const STEADY: &str = "
[[seed]]
name = \"rest\"
state = { X1 = 1.6563516576558746, X2 = 3.5232975392793924e8, X3 = 1.0, X4 = 0.0038843824790898043, X5 = 3.7708607296986027e-10, \
X6 = 0.08021161610521155 }
[[branch]]
name = \"steady\"
from = \"rest\"
free = \"k9\"
range = [4e-4, 6e-4]
";

#[test]
fn totals_are_named_before_a_run_and_used_where_they_are_given() {
    let Err(found) = study(NETWORK, STEADY) else { panic!("families") };
    assert!(found.contains("X1 + X2 and X3 + X4 + X5 + X6 are conserved"), "{found}");
    // The seed gives the values of the totals.
    let totals = "[totals]\nTa = { sum = \"X1 + X2\", value = 1, instead-of = \"X2\" }\n\
                  Tb = { sum = \"X3 + X4 + X5 + X6\", value = 1, instead-of = \"X3\" }\n";
    let diagram = run(&format!("{NETWORK}{totals}"), STEADY);
    let hopf = diagram.branches[0].special.iter().find(|s| s.kind == Kind::Hopf).expect("a Hopf point");
    assert!((hopf.point.parameters[8] / 5.160737862e-4 - 1.0).abs() < 1e-8, "{}", hopf.point.parameters[8]);
    assert!((hopf.point.parameters[9] / 352_329_755.584_290_9 - 1.0).abs() < 1e-12);
    assert!(hopf.normal_form().contains("supercritical"), "{}", hopf.normal_form());
}

const PAIR: &str = "[parameters]\nk = 1\n[states]\nx = \"-k*x^2 + y\"\ny = \"k*x^2 - y\"\n";

#[test]
fn a_total_is_a_parameter_that_branches_may_vary() {
    let model = format!("{PAIR}[totals]\nT = {{ sum = \"x + y\", value = 2 }}\n");
    let text = "[[seed]]\nname = \"s\"\nattractor = \"equilibrium\"\n\
                [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"T\"\nrange = [0.5, 6]\nmark = { T = 6 }\n";
    let diagram = run(&model, text);
    for point in &diagram.branches[0].points {
        // x² + x = T.
        let (total, x) = (point.parameters[1], point.ranges[0][0]);
        assert!((x * x + x - total).abs() < 1e-6, "{x} {total}");
        // The eliminated state is an output.
        assert!((point.ranges[1][0] - (total - x)).abs() < 1e-6);
    }
}

#[test]
fn totals_that_a_seed_contradicts_or_leaves_open_are_refused() {
    let model = format!("{PAIR}[totals]\nT = {{ sum = \"x + y\", value = 2, instead-of = \"y\" }}\n");
    let branch = "[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"k\"\nrange = [0.5, 6]\n";
    let seed = |state: &str, more: &str| format!("[[seed]]\nname = \"s\"\nstate = {{ {state} }}\n{more}{branch}");
    let given = study(&model, &seed("x = 1, y = 3", "")).unwrap();
    assert_eq!(given.plan.seeds[0].parameters, [1.0, 4.0]);
    let left = study(&model, &seed("x = 1", "parameters = { T = 5 }\n")).unwrap();
    assert_eq!(left.plan.seeds[0].parameters, [1.0, 5.0]);
    let found = study(&model, &seed("x = 1, y = 3", "parameters = { T = 5 }\n")).err().unwrap();
    assert!(found.contains("the total `T` is 4 at this state, and 5 under `parameters`"), "{found}");
}
