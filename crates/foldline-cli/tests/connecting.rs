//! Connecting orbits: against separate computations, through the command.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind};
use foldline::explore::{self, System};
use foldline_store::run_file::{Part, load_part};
use foldline_store::study_file::parse_study;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const REFERENCE: &str = include_str!("reference/connecting.csv");

fn foldline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder).output().unwrap()
}

fn text(output: &Output) -> String {
    let text = [&output.stdout[..], &output.stderr[..]].concat();
    let text = String::from_utf8_lossy(&text).into_owned();
    assert!(!text.contains("panicked"), "{text}");
    text
}

fn model(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models").join(format!("{name}.toml"));
    std::fs::read_to_string(path).unwrap()
}

/// A folder with a model of the repository and a study of it.
fn desk(name: &str, study: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.toml"), model(name)).unwrap();
    std::fs::write(folder.path().join("s.toml"), format!("model = \"m.toml\"\ntolerance = 1e-8\n{study}")).unwrap();
    let run = folder.path().join("run");
    (folder, run)
}

/// Runs a study; the exit code must be `code`.
#[track_caller]
fn run(folder: &Path, code: i32) -> (Diagram, String) {
    let output = foldline(folder, &["run", "s.toml", "--out", "run"]);
    assert_eq!(output.status.code(), Some(code), "{}", text(&output));
    (load_part(&folder.join("run"), Part::Everything).unwrap().diagram, text(&output))
}

/// A branch of equilibria in `free` from a state, the cycles from its first Hopf point, and the curve of homoclinic
/// orbits at their end, with marks.
fn study(seed: &str, [free, range]: [&str; 2], [second, second_range]: [&str; 2], marks: &str) -> String {
    format!(
        "[[seed]]\nname = \"s\"\n{seed}\n[[branch]]\nname = \"rest\"\nfrom = \"s\"\nfree = \"{free}\"\nrange = {range}\n\
         switch = {{ hopf = 1 }}\n[[curve]]\nname = \"orbits\"\nhold = \"homoclinic\"\nof = \"rest/hopf-1\"\n\
         free = \"{second}\"\nrange = {second_range}\nmark = {{ {second} = [{marks}] }}\n"
    )
}

const BOGDANOV_TAKENS: &str =
    "name = \"bt\"\n[parameters]\nb1 = -0.01\nb2 = 0.05\n[states]\nx = \"y\"\ny = \"b1 + b2*y + x^2 + x*y\"\n";

const LORENZ: [&str; 2] = ["rho", "[5, 30]"];
const WING: &str = "state = { x = 8, y = 8, z = 25 }\nparameters = { rho = 26 }";

fn lorenz() -> String {
    study(WING, LORENZ, ["sigma", "[8.5, 12.5]"], "9, 10, 12")
}

/// Compares the marks of a curve, and its start, with the table.
#[track_caller]
fn agrees(model_name: &str, diagram: &Diagram, expected: usize) {
    let path = Path::new("models").join(model_name);
    let names = model(model_name);
    let index = |name: &str| {
        let parameters = names.split("[parameters]").nth(1).unwrap().split("\n[").next().unwrap();
        parameters.lines().filter(|l| l.contains(" = ")).position(|l| l.starts_with(&format!("{name} "))).unwrap()
    };
    let curve = diagram.branch("orbits").unwrap();
    let mut compared = 0;
    for line in REFERENCE.lines().filter(|line| line.starts_with(&format!("{model_name},"))) {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |k: usize| cells[k].parse::<f64>().unwrap();
        let (fixed, free) = (index(cells[1]), index(cells[3]));
        let at = curve.special.iter().find(|s| {
            s.kind == Kind::Mark && (s.point.parameters[fixed] - number(2)).abs() < 1e-9 * (1.0 + number(2).abs())
        });
        let Some(at) = at else { continue };
        let off = (at.point.parameters[free] - number(4)).abs();
        assert!(off < number(5), "{}: {line}: off by {off:e}", path.display());
        assert!(off < at.error * (1.0 + number(4).abs()) + number(5), "stated {:e}, off by {off:e}", at.error);
        compared += 1;
    }
    assert_eq!(compared, expected, "{:?}", curve.ends);
}

#[track_caller]
fn complete(branch: &Branch) {
    assert!(branch.ends.iter().all(|end| end.as_ref().is_some_and(Ending::complete)), "{:?}", branch.ends);
}

#[test]
fn homoclinic_orbits_of_the_lorenz_equations_start_where_cycles_end() {
    let (folder, _) = desk("lorenz", &lorenz());
    let (diagram, _) = run(folder.path(), 0);
    agrees("lorenz", &diagram, 3);
    let curve = diagram.branch("orbits").unwrap();
    complete(curve);
    // The saddle is the origin, with the eigenvalues of the linearised equations.
    for point in &curve.points {
        let (sigma, rho, b) = (point.parameters[0], point.parameters[1], point.parameters[2]);
        let root = ((sigma - 1.0f64).powi(2) + 4.0 * sigma * rho).sqrt();
        let mut known = [0.5 * (-1.0 - sigma + root), 0.5 * (-1.0 - sigma - root), -b];
        let mut found: Vec<f64> = point.spectrum.iter().map(|z| z.re).collect();
        known.sort_by(f64::total_cmp);
        found.sort_by(f64::total_cmp);
        assert!(known.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-6 * (1.0 + a.abs())), "{known:?} {found:?}");
        assert!(point.trust.discretisation < 1e-8, "{:e}", point.trust.discretisation);
    }
}

#[test]
fn homoclinic_orbits_of_other_models_have_known_places() {
    let cases = [
        (
            "shimizu-morioka",
            study(
                "state = { x = 0.7, y = 0, z = 1 }\nparameters = { lambda = 1.5 }",
                ["lambda", "[0.3, 2]"],
                ["alpha", "[0.45, 0.65]"],
                "0.5, 0.6",
            ),
            2,
        ),
        (
            "duffing-van-der-pol",
            study(
                "state = { x = 1, v = 0 }\nparameters = { nu = 0.7 }",
                ["nu", "[0.5, 1.5]"],
                ["eps", "[0.05, 0.6]"],
                "0.1, 0.5",
            ),
            2,
        ),
    ];
    for (name, study, count) in cases {
        let (folder, _) = desk(name, &study);
        agrees(name, &run(folder.path(), 0).0, count);
    }
}

#[test]
fn verification_by_trajectories_agrees() {
    let (folder, _) = desk("lorenz", &lorenz());
    run(folder.path(), 0);
    let output = foldline(folder.path(), &["verify", "run", "--branch", "orbits"]);
    let said = text(&output);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(said.contains("100.0 % within the stated error"), "{said}");
}

#[test]
fn a_stopped_curve_goes_on_to_the_same_end() {
    let (whole, _) = desk("lorenz", &lorenz());
    let (expected, _) = run(whole.path(), 0);
    let (folder, _) = desk("lorenz", &lorenz().replace("[8.5, 12.5]", "[8.5, 12.5]\nmax-points = 4"));
    let (mut short, _) = run(folder.path(), 3);
    assert!(short.branch("orbits").unwrap().points.len() < expected.branch("orbits").unwrap().points.len());
    let curve = short.branches.iter_mut().find(|branch| branch.name == "orbits").unwrap();
    curve.ends = [None, None];
    let whole_study = format!("model = \"m\"\ntolerance = 1e-8\n{}", lorenz());
    let study = parse_study(&whole_study, "study", &model("lorenz"), "model").unwrap();
    let again = explore::run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, short, &Unobserved);
    agrees("lorenz", &again, 3);
    complete(again.branch("orbits").unwrap());
    let table = foldline(folder.path(), &["table", "run", "--points", "--branch", "orbits"]);
    assert!(text(&table).contains("saddle_quantity"), "{}", text(&table));
}

#[test]
fn branches_without_a_homoclinic_orbit_are_refused_with_the_reason() {
    // The cycles end at the bound of the range.
    let (folder, _) = desk("lorenz", &study(WING, ["rho", "[18, 30]"], ["sigma", "[9, 12]"], "10"));
    let (_, said) = run(folder.path(), 3);
    assert!(said.contains("has a period that grows without bound") && said.contains("what to do"), "{said}");
    // The loop of this saddle lies at b2 = 0.0717.
    let study = from_rest(
        "{ x = 0.1, y = 0 }",
        ["b2", "[0.2, 0.3]"],
        ["b1", "[-0.05, -0.005]"],
        "-0.01",
        "hold = \"homoclinic\"",
    );
    let (_, said) = run(desk_of(&BOGDANOV_TAKENS.replace("b2 = 0.05", "b2 = 0.25"), &study).path(), 3);
    assert!(said.contains("no value of the parameter on the branch") && said.contains("what to do"), "{said}");
    // `to` belongs to heteroclinic orbits of equilibria.
    for (from, to, words) in [
        ("hold = \"homoclinic\"", "hold = \"homoclinic\"\nto = { x = 0, y = 0, z = 0 }", "second equilibrium"),
        ("hold = \"homoclinic\"", "hold = \"heteroclinic\"\nto = { x = 0, y = 0, z = 0 }", "that the cycles approach"),
    ] {
        let (folder, _) = desk("lorenz", &lorenz().replace(from, to));
        let output = foldline(folder.path(), &["run", "s.toml", "--out", "run"]);
        assert_eq!(output.status.code(), Some(2), "{}", text(&output));
        assert!(text(&output).contains(words), "{}", text(&output));
    }
}

/// A particle in a well between two saddles, (±1, 0), with a damping that changes sign with its deflection. For eps -> 0
/// the orbit from one saddle to the other exists at nu = 1/5 (Melnikov: the mean of tanh² over sech⁴).
const WELL: &str = "[parameters]\nnu = -0.1\neps = 0.1\n[states]\nx = { equation = \"v\", range = [-0.9, 0.9] }\n\
                    v = { equation = \"-x + x^3 + eps*(nu - x^2)*v\", range = [-0.9, 0.9] }\n";

#[test]
fn a_heteroclinic_orbit_between_two_saddles_has_the_place_of_its_limit() {
    let (folder, _) = desk(
        "lorenz",
        &study("state = { x = 0, v = 0 }", ["nu", "[-0.2, 0.5]"], ["eps", "[0.02, 0.3]"], "0.05, 0.1")
            .replace("\"homoclinic\"", "\"heteroclinic\""),
    );
    std::fs::write(folder.path().join("m.toml"), WELL).unwrap();
    let (diagram, _) = run(folder.path(), 0);
    let curve = diagram.branch("orbits").unwrap();
    complete(curve);
    let at = |eps: f64| {
        let marks = || curve.special.iter().filter(|s| s.kind == Kind::Mark);
        let found = marks().find(|s| (s.point.parameters[1] - eps).abs() < 1e-9).unwrap();
        found.point.parameters[0] - 0.2
    };
    // The next term is of second order.
    assert!(at(0.05).abs() < 0.05 * 0.05 && at(0.1).abs() < 0.1 * 0.1, "{} {}", at(0.05), at(0.1));
    let start = &curve.points[0];
    assert_eq!(start.spectrum.iter().filter(|z| z.re > 0.0).count(), 1);
    let output = foldline(folder.path(), &["verify", "run", "--branch", "orbits"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
}

/// A branch of equilibria in `free` from a state, and the curve of orbits from it, with marks.
fn from_rest(
    state: &str,
    [free, range]: [&str; 2],
    [second, second_range]: [&str; 2],
    marks: &str,
    more: &str,
) -> String {
    format!(
        "model = \"m.toml\"\ntolerance = 1e-8\n[[seed]]\nname = \"s\"\nstate = {state}\n[[branch]]\nname = \"rest\"\n\
         from = \"s\"\nfree = \"{free}\"\nrange = {range}\n[[curve]]\nname = \"orbits\"\nof = \"rest\"\n\
         free = \"{second}\"\nrange = {second_range}\nmark = {{ {second} = [{marks}] }}\n{more}\n"
    )
}

/// The values of a parameter at the marks, with their stated errors.
fn marked(diagram: &Diagram, parameter: usize) -> Vec<[f64; 2]> {
    let curve = diagram.branch("orbits").unwrap();
    let marks = curve.special.iter().filter(|s| s.kind == Kind::Mark);
    let mut all: Vec<[f64; 2]> = marks
        .map(|s| {
            let value = s.point.parameters[parameter];
            [value, (s.error + s.point.trust.discretisation) * (1.0 + value.abs())]
        })
        .collect();
    all.sort_by(|a, b| a[0].total_cmp(&b[0]));
    all
}

fn desk_of(model: &str, study: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.toml"), model).unwrap();
    std::fs::write(folder.path().join("s.toml"), study).unwrap();
    folder
}

/// u_t = u_xx + u (1 - u) (u - a) has a front between 0 and 1 that moves at the speed (1 - 2 a)/√2.
#[test]
fn the_speed_of_the_bistable_front_is_that_of_the_closed_form() {
    let model = "name = \"front\"\n[parameters]\nc = 0.3\na = 0.25\n[states]\nu = \"v\"\nv = \"c*v - u*(1-u)*(u-a)\"\n";
    let more = "hold = \"heteroclinic\"\nto = { u = 1, v = 0 }";
    let study = from_rest("{ u = 0, v = 0 }", ["c", "[0.05, 0.8]"], ["a", "[0.05, 0.45]"], "0.1, 0.25, 0.4", more);
    let folder = desk_of(model, &study);
    let (diagram, _) = run(folder.path(), 0);
    let found = marked(&diagram, 0);
    assert_eq!(found.len(), 3, "{found:?}");
    for ([value, stated], a) in found.iter().zip([0.4, 0.25, 0.1]) {
        let off = (value - (1.0 - 2.0 * a) / 2f64.sqrt()).abs();
        assert!(off < *stated && off < 1e-9, "a = {a}: off by {off:e}, stated {stated:e}");
    }
    let curve = diagram.branch("orbits").unwrap();
    complete(curve);
    // A front is u = 1 / (1 + exp(-z/√2)), whose slope has the maximum √2/8.
    let top = |p: &foldline::diagram::Point| p.ranges[1][1] - 2f64.sqrt() / 8.0;
    assert!(curve.points.iter().all(|p| top(p).abs() < 1e-8), "{:e}", top(&curve.points[0]));
    let output = foldline(folder.path(), &["verify", "run", "--branch", "orbits"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
}

/// Bogdanov–Takens normal form: numbers of a separate program, as in `reference/connecting.csv`.
#[test]
fn the_loop_of_the_bogdanov_takens_normal_form_starts_from_its_saddle() {
    let more = "hold = \"homoclinic\"";
    let study = from_rest("{ x = 0.1, y = 0 }", ["b2", "[0.01, 0.3]"], ["b1", "[-0.05, -0.005]"], "-0.04, -0.01", more);
    let (diagram, _) = run(desk_of(BOGDANOV_TAKENS, &study).path(), 0);
    let found = marked(&diagram, 1);
    assert_eq!(found.len(), 2, "{found:?}");
    // Tolerance of the reference: 2e-8.
    for ([value, stated], known) in found.iter().zip([0.071727763, 0.144051019]) {
        assert!((value - known).abs() < stated + 2e-8, "{value} is not {known}");
    }
}

/// Predator and prey with a refuge, `studies/auto/models/mtn.toml`. Its curve of orbits homoclinic to saddle-nodes in (gf, k) ends in two
/// non-central ones.
fn predator_prey() -> (String, String) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../studies/auto");
    let read = |name: &str| std::fs::read_to_string(root.join(name)).unwrap();
    (read("models/mtn.toml"), read("mtn.toml").replace("models/mtn.toml", "m.toml"))
}

/// Values k and gf of the non-central orbits: a trajectory on the centre manifold, from a distance of 1e-4 with terms of second
/// order, meets one on the strong stable manifold, from a distance of 1e-5, followed backwards (SciPy, DOP853 with rtol = 1e-13). Other
/// distances (3e-4, 3e-5) and sections change none of these digits.
const NON_CENTRAL: [[f64; 2]; 2] = [[5.1803076028, 0.063854986488], [6.6104586494, 0.069324818334]];

#[track_caller]
fn non_central(diagram: &Diagram, branch: &str) -> Vec<[f64; 3]> {
    let own = diagram.branch(branch).unwrap().special.iter().filter(|s| s.kind == Kind::NonCentral);
    let mut all: Vec<[f64; 3]> = own.map(|s| [s.point.parameters[0], s.point.parameters[1], s.error]).collect();
    all.sort_by(|a, b| a[0].total_cmp(&b[0]));
    all
}

#[track_caller]
fn same_non_central(found: [f64; 3], known: [f64; 2]) {
    let off = (0..2).map(|k| (found[k] - known[k]).abs() / (1.0 + known[k])).fold(0.0, f64::max);
    // 1e-10: digits of the reference.
    assert!(off < found[2] + 1e-10, "{found:?} is not {known:?}: off by {off:e}");
    assert!(off < 1e-7, "{found:?} is not {known:?}: off by {off:e}");
}

#[test]
fn orbits_homoclinic_to_saddle_nodes_end_at_non_central_ones_from_which_those_of_saddles_start() {
    let (model, study) = predator_prey();
    let folder = desk_of(&model, &study);
    let (diagram, _) = run_any(folder.path());
    let curve = diagram.branch("saddle-nodes").unwrap();
    complete(curve);
    let ends = non_central(&diagram, "saddle-nodes");
    assert_eq!(ends.len(), 2, "{:?}", curve.ends);
    (0..2).for_each(|k| same_non_central(ends[k], NON_CENTRAL[k]));
    // Both parameters lie on the fold of the equilibria: an eigenvalue is 0, with the determinant of the closed Jacobian.
    for point in &curve.points {
        let least = point.spectrum.iter().map(|z| z.re.abs()).fold(f64::INFINITY, f64::min);
        assert!(least < 1e-9, "{least:e}");
    }
    for (name, known) in [("lower saddles", NON_CENTRAL[0]), ("upper saddles", NON_CENTRAL[1])] {
        let curve = diagram.branch(name).unwrap();
        let ends = non_central(&diagram, name);
        assert_eq!(ends.len(), 1, "{name}: {:?}", curve.ends);
        same_non_central(ends[0], known);
    }
    let output = foldline(folder.path(), &["verify", "run"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
}

#[test]
fn a_curve_of_orbits_homoclinic_to_saddle_nodes_starts_where_one_of_saddles_ends() {
    let (model, study) = predator_prey();
    let more = "\n[[curve]]\nname = \"back\"\nhold = \"saddle-node-homoclinic\"\nof = \"upper saddles\"\nfree = \"k\"\nrange = [4, 8]\n";
    let (diagram, _) = run_any(desk_of(&model, &format!("{study}{more}")).path());
    let ends = non_central(&diagram, "back");
    assert_eq!(ends.len(), 2, "{:?}", diagram.branch("back").unwrap().ends);
    (0..2).for_each(|k| same_non_central(ends[k], NON_CENTRAL[k]));
}

/// Josephson junction, φ'' + β φ' + sin φ = I: the saddle-node is φ = π/2 at I = 1 for all β.
const JUNCTION: &str = "[parameters]\ncurrent = 1.2\nbeta = 1.5\n[states]\nphi = { equation = \"v\", period = \"2*pi\" }\n\
                        v = { equation = \"current - sin(phi) - beta*v\", range = [-1, 2] }\n";

#[test]
fn the_junction_has_orbits_homoclinic_to_a_saddle_node_only_with_strong_damping() {
    let study = "model = \"m.toml\"\ntolerance = 1e-8\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\n[[branch]]\nname = \"running\"\n\
                 from = \"s\"\nfree = \"current\"\nrange = [0.01, 1.5]\n[[curve]]\nname = \"nodes\"\nhold = \"saddle-node-homoclinic\"\n\
                 of = \"running\"\nfree = \"beta\"\nrange = [0.5, 3]\nmark = { beta = 2 }\n[[curve]]\nname = \"saddles\"\n\
                 hold = \"homoclinic\"\nof = \"nodes\"\nfree = \"beta\"\nrange = [0.02, 3]\nmark = { beta = [0.02, 0.05] }\n";
    let folder = desk_of(JUNCTION, study);
    let (diagram, _) = run_any(folder.path());
    let nodes = diagram.branch("nodes").unwrap();
    complete(nodes);
    for point in &nodes.points {
        assert!((point.parameters[0] - 1.0).abs() < 1e-10, "I = {}", point.parameters[0]);
    }
    let end = non_central(&diagram, "nodes");
    assert_eq!(end.len(), 1, "{:?}", nodes.ends);
    let again = non_central(&diagram, "saddles");
    assert_eq!(again.len(), 1);
    let off = (end[0][1] - again[0][1]).abs();
    assert!(off < 1e-8, "β = {} and {}", end[0][1], again[0][1]);
    // For β -> 0 the energy lost on the separatrix of the pendulum, 8 β, is what the current supplies, 2π I. The next term is of
    // second order.
    let saddles = diagram.branch("saddles").unwrap();
    let marks = saddles.special.iter().filter(|s| s.kind == Kind::Mark);
    let mut count = 0;
    for mark in marks {
        let (current, beta) = (mark.point.parameters[0], mark.point.parameters[1]);
        let first = 4.0 * beta / std::f64::consts::PI;
        assert!((current - first).abs() < 0.1 * beta * beta, "I({beta}) = {current}, {first}");
        count += 1;
    }
    assert_eq!(count, 2, "{:?}", saddles.ends);
    let output = foldline(folder.path(), &["verify", "run"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
}

/// Runs a study, whose branches may be incomplete.
#[track_caller]
fn run_any(folder: &Path) -> (Diagram, String) {
    let output = foldline(folder, &["run", "s.toml", "--out", "run"]);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{}", text(&output));
    (load_part(&folder.join("run"), Part::Everything).unwrap().diagram, text(&output))
}

/// A branch of equilibria, its folds, and homoclinic orbits from their Bogdanov–Takens point.
fn from_takens(state: &str, [free, range]: [&str; 2], [second, second_range]: [&str; 2], marks: &str) -> String {
    format!(
        "model = \"m.toml\"\ntolerance = 1e-8\n[[seed]]\nname = \"s\"\nstate = {state}\n[[branch]]\nname = \"rest\"\n\
         from = \"s\"\nfree = \"{free}\"\nrange = {range}\n[[curve]]\nname = \"folds\"\nhold = \"fold\"\nof = \"rest\"\n\
         free = \"{second}\"\nrange = {second_range}\n[[curve]]\nname = \"orbits\"\nhold = \"homoclinic\"\nof = \"folds\"\n\
         free = \"{second}\"\nrange = {second_range}\nmark = {{ {second} = [{marks}] }}\n"
    )
}

/// Numbers of a separate program, as in `reference/connecting.csv`.
#[test]
fn loops_start_at_the_bogdanov_takens_point_of_the_normal_form() {
    let study =
        from_takens("{ x = 0.3, y = 0 }", ["b1", "[-0.5, 0.5]"], ["b2", "[-0.5, 0.5]"], "0.071727763, 0.144051019");
    for study in [study.clone(), study.replace("hold = \"fold\"", "hold = \"hopf\"")] {
        let folder = desk_of(&BOGDANOV_TAKENS.replace("b1 = -0.01", "b1 = -0.09"), &study);
        let (diagram, _) = run_any(folder.path());
        let found = marked(&diagram, 0);
        assert_eq!(found.len(), 2, "{found:?} {:?}", diagram.branch("orbits").unwrap().ends);
        // Tolerance of the reference 2e-8, and b1 changes half as fast as b2.
        for ([value, stated], known) in found.iter().zip([-0.04, -0.01]) {
            assert!((value - known).abs() < stated + 2e-8, "{value} is not {known}");
        }
        let curve = diagram.branch("orbits").unwrap();
        complete(curve);
        assert!(matches!(curve.ends[0], Some(Ending::Joined { at: Kind::BogdanovTakens, .. })), "{:?}", curve.ends);
        let output = foldline(folder.path(), &["verify", "run", "--branch", "orbits"]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output));
    }
}

#[test]
fn a_curve_of_loops_ends_at_the_bogdanov_takens_point() {
    let more = "hold = \"homoclinic\"";
    let study = from_rest("{ x = 0.1, y = 0 }", ["b2", "[-0.1, 0.3]"], ["b1", "[-0.05, 0.05]"], "-0.04", more);
    let (diagram, _) = run(desk_of(BOGDANOV_TAKENS, &study).path(), 0);
    let ends = &diagram.branch("orbits").unwrap().ends;
    let met = ends.iter().flatten().find_map(|end| match end {
        Ending::Joined { at: Kind::BogdanovTakens, parameter } => Some(*parameter),
        _ => None,
    });
    assert!(met.is_some_and(|b1| b1.abs() < 1e-10), "{ends:?}");
}

/// The parameters at which the cycles of a Hopf point end are an independent route to the same orbits.
#[test]
fn loops_from_a_bogdanov_takens_point_are_those_in_which_cycles_end() {
    let study = "model = \"m.toml\"\ntolerance = 1e-7\n[[seed]]\nname = \"s\"\nattractor = \"equilibrium\"\nsamples = 16\n\
                 parameters = { q2 = 0.9, k = 0.6 }\n[[branch]]\nname = \"rest\"\nfrom = \"s\"\nfree = \"q2\"\nrange = [0.5, 2]\n\
                 switch = { hopf = 1 }\n[[curve]]\nname = \"folds\"\nhold = \"fold\"\nof = \"rest\"\nfree = \"k\"\n\
                 range = [0.45, 1.2]\n[[curve]]\nname = \"orbits\"\nhold = \"homoclinic\"\nof = \"folds\"\nnear = 1.41\n\
                 free = \"k\"\nrange = [0.58, 1.2]\nmark = { k = 0.6 }\n";
    let (diagram, _) = run_any(desk_of(&model("co-oxidation"), study).path());
    let cycles = diagram.branch("rest/hopf-1").unwrap();
    let ends = cycles.ends.iter().flatten();
    let limit =
        ends.filter_map(|end| if let Ending::Connecting { parameter, .. } = end { Some(*parameter) } else { None });
    let limit: Vec<f64> = limit.collect();
    let free = cycles.free;
    let curve = diagram.branch("orbits").unwrap();
    let mark = curve.special.iter().find(|s| s.kind == Kind::Mark).unwrap();
    // The last cycle's parameter has converged to the tolerance.
    let off = (mark.point.parameters[free] - limit[0]).abs();
    assert!(off < 1e-7, "{} and {limit:?}", mark.point.parameters[free]);
}

#[test]
fn a_stopped_curve_of_saddle_nodes_goes_on_to_the_same_ends() {
    let (model, study) = predator_prey();
    let study = study.split("[[curve]]\nname = \"upper").next().unwrap().to_string();
    let folder = desk_of(&model, &study.replace("mark = { k", "max-points = 3\nmark = { k"));
    let (mut short, _) = run_any(folder.path());
    let curve = short.branches.iter_mut().find(|branch| branch.name == "saddle-nodes").unwrap();
    assert_eq!(curve.special.iter().filter(|s| s.kind == Kind::NonCentral).count(), 0);
    curve.ends = [None, None];
    let study = parse_study(&study, "study", &model, "model").unwrap();
    let again = explore::run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, short, &Unobserved);
    let ends = non_central(&again, "saddle-nodes");
    assert_eq!(ends.len(), 2, "{:?}", again.branch("saddle-nodes").unwrap().ends);
    (0..2).for_each(|k| same_non_central(ends[k], NON_CENTRAL[k]));
}

#[test]
fn starts_that_do_not_exist_on_a_curve_are_refused_with_the_reason() {
    // No Bogdanov–Takens point on the curve of folds.
    let study = from_takens("{ x = 0.3, y = 0 }", ["b1", "[-0.5, 0.5]"], ["b2", "[0.02, 0.5]"], "0.07");
    let (_, said) = run_any(desk_of(&BOGDANOV_TAKENS.replace("b1 = -0.01", "b1 = -0.09"), &study).path());
    assert!(said.contains("has no bogdanov-takens point") && said.contains("what to do"), "{said}");
    // Another plane than that of the curve; a curve of the same kind.
    let three = BOGDANOV_TAKENS.replace("b2 = 0.05", "b2 = 0.05\nc = 1");
    for (from, to, words) in [
        ("of = \"folds\"\nfree = \"b2\"", "of = \"folds\"\nfree = \"c\"", "lies in the plane of b1 and b2"),
        ("hold = \"homoclinic\"\nof = \"folds\"", "hold = \"hopf\"\nof = \"folds\"", "is a curve, and"),
    ] {
        let folder = desk_of(&three, &study.replace(from, to));
        let output = foldline(folder.path(), &["run", "s.toml", "--out", "run"]);
        assert_eq!(output.status.code(), Some(2), "{}", text(&output));
        assert!(text(&output).contains(words), "{}", text(&output));
    }
}
