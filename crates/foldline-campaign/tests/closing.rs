//! Branches that pass close to their own start.

use foldline::contract::Unobserved;
use foldline::diagram::{Diagram, Ending, Kind};
use foldline::explore::{self, System};
use foldline_store::study_file::parse_study;

/// Equilibria p + i x = (1 + D cos θ/2) e^{iθ}, y = D sin θ/2: a closed curve with two turns, 2 D apart. It is the set
/// z² = D² (p + i x) / r with z = r - 1 + i y. The two equations are mixed so that they do not become singular together.
const TWICE_ROUND: &str = r#"
[parameters]
p = 0.0
D = 1e-3
[definitions]
r = "hypot(p, x)"
a = "(r - 1)^2 - y^2 - D^2*p/r"
b = "2*(r - 1)*y - D^2*x/r"
[states.x]
equation = "0.765*a - 0.644*b"
scale = 1
[states.y]
equation = "0.644*a + 0.765*b"
scale = 1
"#;

#[test]
fn a_branch_that_passes_close_to_its_start_is_not_closed_there() {
    // At θ = 1/2 the other turn passes at a distance of 20 times the tolerance, in the same direction.
    let (theta, d) = (0.5f64, 1e-3);
    let r = 1.0 + d * (0.5 * theta).cos();
    let (p, x, y) = (r * theta.cos(), r * theta.sin(), d * (0.5 * theta).sin());
    let text = format!(
        "model = \"m\"\ntolerance = 1e-4\n[[seed]]\nname = \"s\"\nstate = {{ x = {x:?}, y = {y:?} }}\nparameters = {{ p = {p:?} }}\n\
         [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p\"\nrange = [-2, 2]\n"
    );
    let study = parse_study(&text, "study", TWICE_ROUND, "model").unwrap_or_else(|found| panic!("{found:?}"));
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    let branch = &diagram.branches[0];
    assert_eq!(branch.ends, [Some(Ending::Closed), Some(Ending::Closed)]);
    // Each of the two turns has a largest and a smallest p.
    let folds = branch.special.iter().filter(|special| special.kind == Kind::Fold).count();
    assert_eq!(folds, 4, "{:?}", branch.special.iter().map(|s| (s.kind, s.point.parameters[0])).collect::<Vec<_>>());
    let [first, .., last] = &branch.points[..] else { panic!("no points") };
    assert_eq!(first.unstable, last.unstable);
}
