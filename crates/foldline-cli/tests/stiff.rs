//! First solutions of stiff models, each compared with the same solution continued from parameters where the model is
//! not stiff, or with a closed form.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Kind, Solution};
use foldline::explore::{self, System};
use foldline_store::study_file::parse_study;

#[track_caller]
fn run(model: &str, study: &str) -> Diagram {
    let text = format!("model = \"m\"\n{study}");
    let study = parse_study(&text, "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"));
    let system = System::of_plan(&study.model, &study.plan);
    explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved)
}

#[track_caller]
fn branch<'d>(diagram: &'d Diagram, name: &str) -> &'d Branch {
    let found = diagram.branches.iter().find(|b| b.name == name).unwrap_or_else(|| panic!("no branch {name}"));
    assert!(!found.points.is_empty(), "{name}: {:?}", found.ends);
    found
}

/// Period of the cycle at the mark of a branch.
#[track_caller]
fn period(branch: &Branch) -> f64 {
    let mark =
        branch.special.iter().find(|s| s.kind == Kind::Mark).unwrap_or_else(|| panic!("no mark on {}", branch.name));
    mark.point.solution.period().unwrap()
}

/// The relaxation oscillation at mu = 1000, whose rates span six decades, found by simulation and reached from mu = 5.
#[test]
fn a_relaxation_oscillation_is_found_where_it_is_stiff() {
    let found = run(
        "[parameters]\nmu = 1000\n[states]\nx = \"y\"\ny = \"mu*(1 - x^2)*y - x\"\n",
        "[[seed]]\nname = \"stiff\"\nstate = { x = 2, y = 0 }\n\
         [[seed]]\nname = \"mild\"\nstate = { x = 2, y = 0 }\nparameters = { mu = 5 }\n\
         [[branch]]\nname = \"there\"\nfrom = \"stiff\"\nfree = \"mu\"\nrange = [900, 1100]\nmark = { mu = 950 }\n\
         [[branch]]\nname = \"reached\"\nfrom = \"mild\"\nfree = \"mu\"\nrange = [5, 1100]\nmark = { mu = 950 }\n",
    );
    let [there, reached] = ["there", "reached"].map(|name| period(branch(&found, name)));
    assert!((there / reached - 1.0).abs() < 1e-6, "{there} and {reached}");
}

/// Robertson's reaction in a flow of rate k: a stiff node that samples reach from anywhere.
#[test]
fn a_stiff_node_is_found_from_samples() {
    let found = run(
        "[parameters]\nk = 0.01\n[states.a]\nequation = \"k*(1 - a) - 0.04*a + 1e4*b*c\"\nrange = [0, 1]\n\
         [states.b]\nequation = \"-k*b + 0.04*a - 1e4*b*c - 3e7*b^2\"\nrange = [0, 1]\n\
         [states.c]\nequation = \"-k*c + 3e7*b^2\"\nrange = [0, 1]\n",
        "[[seed]]\nname = \"rest\"\nattractor = \"equilibrium\"\n\
         [[branch]]\nname = \"b\"\nfrom = \"rest\"\nfree = \"k\"\nrange = [0.001, 0.1]\n",
    );
    for point in &branch(&found, "b").points {
        let Solution::Equilibrium(x) = &point.solution else { panic!("a cycle") };
        // The total is conserved, and the second and third equations can be solved for a and c.
        assert!((x.iter().sum::<f64>() - 1.0).abs() < 1e-6);
        let (k, b) = (point.parameters[0], x[1]);
        let c = 3e7 * b * b / k;
        assert!((x[2] - c).abs() < 1e-6 * (1.0 + c), "{k}: {x:?}");
        assert!((0.04 * x[0] - b * (k + 1e4 * c + 3e7 * b)).abs() < 1e-6, "{k}: {x:?}");
    }
}

/// A forced oscillator beside a fast state that follows it: its folds are those without that state.
#[test]
fn a_fast_state_beside_a_forced_oscillator_changes_nothing() {
    let [alone, beside] = ["", "z = \"-1e6*(z - x^2)\"\n"].map(|fast| {
        run(
            &format!(
                "[parameters]\nom = 1\n[forcing]\nfrequency = \"om\"\n[states]\nx = \"y\"\n\
                 y = \"0.3*cos(om*t) - 0.1*y - x - x^3\"\n{fast}"
            ),
            "[[seed]]\nname = \"c\"\nattractor = \"cycle\"\n\
             [[branch]]\nname = \"b\"\nfrom = \"c\"\nfree = \"om\"\nrange = [0.8, 2.2]\n",
        )
    });
    let folds = |diagram: &Diagram| -> Vec<[f64; 2]> {
        let special = branch(diagram, "b").special.iter().filter(|s| s.kind == Kind::Fold);
        special.map(|s| [s.point.parameters[0], s.error]).collect()
    };
    let (alone, beside) = (folds(&alone), folds(&beside));
    assert_eq!((alone.len(), beside.len()), (2, 2));
    for ([a, own], [b, other]) in alone.iter().zip(&beside) {
        assert!((a - b).abs() <= 2.0 * (own + other) * a, "{a} ± {own}, {b} ± {other}");
    }
}

/// A search that runs into a limit names the setting to raise, and succeeds once it is raised.
#[test]
fn a_search_that_hits_a_limit_names_it_and_succeeds_once_it_is_raised() {
    // A focus that turns a hundred times while it decays by a factor e.
    let model =
        "[parameters]\np = 0\n[states]\nx = \"20*y - 0.2*x*(1 + p)\"\ny = \"-20*x - 0.2*y\"\nz = \"-z + x*y\"\n";
    let study = |limits: &str| {
        format!(
            "{limits}[[seed]]\nname = \"c\"\nattractor = \"equilibrium\"\nsamples = 16\n\
             [[branch]]\nname = \"b\"\nfrom = \"c\"\nfree = \"p\"\nrange = [-0.5, 0.5]\n"
        )
    };
    let short = run(model, &study("max-steps = 20\n"));
    let said = format!("{:?}", short.branches[0].ends);
    assert!(said.contains("max-steps") && said.contains("20 integration"), "{said}");
    let brief = run(model, &study("max-time = 0.5\n"));
    let said = format!("{:?}", brief.branches[0].ends);
    assert!(said.contains("max-time"), "{said}");
    branch(&run(model, &study("")), "b");
}
