//! Maps: special points and coefficients against closed forms and separate computations, through the command.

use foldline::diagram::{Branch, Diagram, Kind, Solution, SpecialPoint};
use foldline_store::run_file::{Part, load_part};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const REFERENCE: &str = include_str!("reference/maps.csv");

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn foldline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder).output().unwrap()
}

fn text(output: &Output) -> String {
    let text = [&output.stdout[..], &output.stderr[..]].concat();
    let text = String::from_utf8_lossy(&text).into_owned();
    assert!(!text.contains("panicked"), "{text}");
    text
}

/// Runs a study on a model, both given as text, and returns its diagram; the exit code must be 0.
#[track_caller]
fn run(model: &str, study: &str) -> Diagram {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.toml"), model).unwrap();
    std::fs::write(folder.path().join("s.toml"), format!("model = \"m.toml\"\ntolerance = 1e-8\n{study}")).unwrap();
    ran(folder.path(), "s.toml")
}

#[track_caller]
fn ran(folder: &Path, study: &str) -> Diagram {
    let out = tempfile::tempdir().unwrap();
    let run = out.path().join("run");
    let output = foldline(folder, &["run", study, "--out", run.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
    load_part(&run, Part::Everything).unwrap().diagram
}

/// A model of one or two states with their ranges.
fn model(parameters: &str, states: &[(&str, &str)], range: &str) -> String {
    let states_of: String = states.iter().map(|(name, _)| format!("{name} = {{ range = {range} }}\n")).collect();
    let next: String = states.iter().map(|(name, next)| format!("{name} = \"{next}\"\n")).collect();
    format!("[parameters]\n{parameters}\n[states]\n{states_of}[map]\n{next}")
}

/// A study with a branch `f` from the fixed point that orbits reach.
fn from_fixed(parameters: &str, free: &str, range: &str, more: &str) -> String {
    format!(
        "[[seed]]\nname = \"s\"\nattractor = \"fixed-point\"\nparameters = {{ {parameters} }}\n\
         [[branch]]\nname = \"f\"\nfrom = \"s\"\nfree = \"{free}\"\nrange = {range}\n{more}"
    )
}

fn generalised(r: f64, s: f64) -> String {
    model(
        &format!("a = 0.2\nb = 0.5\nR = {r:?}\nS = {s:?}"),
        &[("x", "y"), ("y", "a - b*x - y^2 + R*x*y + S*y^3")],
        "[-2, 2]",
    )
}

const HENON: [(&str, &str); 2] = [("x", "y"), ("y", "alpha - beta*x - y^2")];
const DELAYED: [(&str, &str); 2] = [("x", "r*x*(1 - y)"), ("y", "x")];

fn diagram(study: &str) -> Diagram {
    let henon = |alpha: f64, beta: f64| model(&format!("alpha = {alpha:?}\nbeta = {beta:?}"), &HENON, "[-1, 1]");
    let wide = from_fixed("", "a", "[-2, 4]", "");
    let shipped = |name: &str| ran(&root().join("studies/maps"), &format!("{name}.toml"));
    let switched = |kind: &str| format!("switch = {{ {kind} = 1 }}\n");
    match study {
        "henon-0" => run(&henon(0.0, 0.0), &from_fixed("", "alpha", "[-1, 1]", "")),
        "area-0.5" => run(&henon(0.5, 0.8), &from_fixed("", "beta", "[0.5, 1.3]", "")),
        "area-2" => run(&henon(2.0, 0.8), &from_fixed("", "beta", "[0.7, 1.3]", "")),
        "delayed" => run(&model("r = 1.8", &DELAYED, "[0, 1]"), &from_fixed("", "r", "[0.5, 2.4]", "")),
        "generalised-1" => run(&generalised(-0.1, 0.05), &wide),
        "generalised-2" => run(&generalised(0.1, 0.0), &wide),
        "generalised-3" => run(&generalised(0.0, 0.1), &wide),
        "ricker" => {
            let own = model("r = 1.5", &[("x", "x*exp(r*(1 - x))")], "[0.1, 3]");
            run(&own, &from_fixed("", "r", "[1, 2.6]", &switched("period-doubling")))
        }
        "cubic" => run(&model("r = 0.5", &[("x", "r*x - x^3")], "[-1, 1]"), &from_fixed("", "r", "[-2, 2]", "")),
        "arnold" => {
            let own = "[parameters]\nOmega = 0.05\nK = 0.8\n[states]\nth = { period = 1 }\n\
                [map]\nth = \"th + Omega - K/(2*pi)*sin(2*pi*th)\"\n";
            run(own, &from_fixed("", "Omega", "[-0.3, 0.3]", "").replace("name = \"f\"", "name = \"zero\""))
        }
        shipped_study => shipped(shipped_study),
    }
}

fn value(branch: &Branch, special: &SpecialPoint) -> f64 {
    special.point.parameters[branch.free]
}

#[test]
fn special_points_and_coefficients_agree_with_the_reference() {
    let rows: Vec<Vec<&str>> =
        REFERENCE.lines().filter(|line| !line.starts_with('#')).skip(1).map(|line| line.split(',').collect()).collect();
    let mut known: Vec<(String, Diagram)> = Vec::new();
    for row in &rows {
        let [study, name, kind, place, coefficient, tolerance] = row[..] else { panic!("{row:?}") };
        if known.last().is_none_or(|(last, _)| last != study) {
            known.push((study.to_string(), diagram(study)));
        }
        let found = &known.last().unwrap().1;
        let branch = found.branch(name).unwrap_or_else(|| panic!("{study}: no branch {name}"));
        let (place, tolerance): (f64, f64) = (place.parse().unwrap(), tolerance.parse().unwrap());
        let of_kind = branch.special.iter().filter(|special| special.kind.name() == kind);
        let off = |special: &&SpecialPoint| (value(branch, special) - place).abs() / (1.0 + place.abs());
        let special = of_kind.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or_else(|| panic!("{row:?}: none"));
        assert!(off(&special) < tolerance, "{row:?}: {:?}", value(branch, special));
        if coefficient.is_empty() {
            continue;
        }
        let wanted: f64 = coefficient.parse().unwrap();
        let (own, error) = (special.coefficients[0], special.coefficient_errors[0]);
        if wanted == 0.0 {
            assert_eq!(special.criticality(), Some("degenerate"), "{row:?}: {own:e} ± {error:e}");
            assert!(error < 1e-6, "{row:?}: {error:e}");
        } else {
            // The sign of a is that of the orientation of q.
            let own = if kind == "fold" { own.abs() } else { own };
            assert!((own - wanted).abs() < tolerance * wanted.abs(), "{row:?}: {own:?}");
            assert!(error < 1e-5 * wanted.abs(), "{row:?}: {error:e}");
        }
    }
}

#[test]
fn stated_errors_of_places_with_closed_forms_are_true() {
    let diagram = diagram("logistic");
    let closed =
        [("fixed", 3.0), ("fixed/period-doubling-1", 1.0 + 6f64.sqrt()), ("three iterates", 1.0 + 8f64.sqrt())];
    for (name, known) in closed {
        let branch = diagram.branch(name).unwrap();
        let off = |special: &&SpecialPoint| (value(branch, special) - known).abs();
        let special = branch.special.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
        assert!(
            off(&special) <= special.error * branch.size(known),
            "{name}: {:e}, {:e}",
            off(&special),
            special.error
        );
    }
}

#[test]
fn a_doubling_is_supercritical_where_the_doubled_cycle_is_stable() {
    let logistic = diagram("logistic");
    let special = &logistic.branch("fixed").unwrap().special[0];
    assert_eq!(special.criticality(), Some("supercritical"));
    let cubic = diagram("cubic");
    let doubling = cubic.branch("f").unwrap().special.iter().find(|s| s.kind == Kind::PeriodDoubling).unwrap();
    assert_eq!(doubling.criticality(), Some("subcritical"));
    let pitchfork = cubic.branch("f").unwrap().special.iter().find(|s| s.kind == Kind::BranchPoint).unwrap();
    assert_eq!((pitchfork.case(), pitchfork.criticality()), (Some("pitchfork"), Some("supercritical")));
}

#[test]
fn the_angle_of_a_torus_point_is_that_of_the_closed_form() {
    for (study, alpha) in [("area-0.5", 0.5f64), ("area-2", 2.0)] {
        let diagram = diagram(study);
        let special = diagram.branch("f").unwrap().special.iter().find(|s| s.kind == Kind::Torus).unwrap().clone();
        let pair = special.point.spectrum.iter().find(|z| z.im > 0.0).unwrap();
        assert!((pair.arg() - (1.0 - (1.0 + alpha).sqrt()).acos()).abs() < 1e-9, "{study}: {pair}");
    }
    let diagram = diagram("delayed");
    let special = diagram.branch("f").unwrap().special.iter().find(|s| s.kind == Kind::Torus).unwrap().clone();
    let pair = special.point.spectrum.iter().find(|z| z.im > 0.0).unwrap();
    assert!((pair.arg() - std::f64::consts::FRAC_PI_3).abs() < 1e-9, "{pair}");
}

/// Curves of the Hénon map: folds α = -(1 + β)²/4 and doublings α = 3 (1 + β)²/4 end at the resonances at β = 1, and along
/// the torus points, β = 1, cos θ = 1 - √(1 + α).
#[test]
fn curves_in_two_parameters_follow_their_closed_forms_and_name_their_points() {
    let own = model("alpha = 0.2\nbeta = 0.5", &HENON, "[-1, 1]");
    let study = from_fixed("", "alpha", "[-1, 2]", "")
        + "[[branch]]\nname = \"g\"\nfrom = \"s\"\nfree = \"beta\"\nrange = [0.2, 1.3]\n"
        + "[[curve]]\nname = \"folds\"\nhold = \"fold\"\nof = \"f\"\nfree = \"beta\"\nrange = [-0.5, 1.3]\nbranch-range = [-3, 6]\n"
        + "[[curve]]\nname = \"flips\"\nhold = \"period-doubling\"\nof = \"f\"\nfree = \"beta\"\nrange = [-0.5, 1.3]\nbranch-range = [-3, 6]\n"
        + "[[curve]]\nname = \"ns\"\nhold = \"torus\"\nof = \"g\"\nfree = \"alpha\"\nrange = [-2, 4]\nbranch-range = [0, 2]\n";
    let diagram = run(&own, &study);
    for (name, factor, resonance) in [("folds", -0.25, Kind::Resonance11), ("flips", 0.75, Kind::Resonance12)] {
        let curve = diagram.branch(name).unwrap();
        assert!(curve.points.len() > 5, "{name}");
        for point in &curve.points {
            let [alpha, beta] = point.parameters[..] else { panic!() };
            assert!(
                (alpha - factor * (1.0 + beta).powi(2)).abs() < 1e-9 * (1.0 + alpha.abs()),
                "{name}: {alpha} {beta}"
            );
        }
        let found: Vec<Kind> = curve.special.iter().map(|s| s.kind).filter(|k| k.has_codimension_two()).collect();
        assert_eq!(found, [resonance], "{name}");
        let special = curve.special.iter().find(|s| s.kind == resonance).unwrap();
        assert!((special.point.parameters[1] - 1.0).abs() < 1e-8, "{name}: {:?}", special.point.parameters);
    }
    let curve = diagram.branch("ns").unwrap();
    assert!(curve.points.iter().all(|point| (point.parameters[1] - 1.0).abs() < 1e-9));
    let mut found: Vec<(Kind, f64)> = curve.special.iter().map(|s| (s.kind, s.point.parameters[0])).collect();
    found.retain(|(kind, _)| kind.has_codimension_two());
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    // cos θ = 1, 0, -½, -1.
    let expected =
        [(Kind::Resonance11, -1.0), (Kind::Resonance14, 0.0), (Kind::Resonance13, 1.25), (Kind::Resonance12, 3.0)];
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for ((kind, alpha), (wanted, known)) in found.iter().zip(expected) {
        assert!(*kind == wanted && (alpha - known).abs() < 1e-7, "{found:?}");
    }
}

/// x → h + r x - x³: two folds meet in a cusp at r = 1, h = 0; the doublings are degenerate at r = -2/3, where 9 x² = 1.
#[test]
fn cusps_and_generalised_doublings_are_located() {
    let own = model("r = 2\nh = 0", &[("x", "h + r*x - x^3")], "[-2, 2]");
    let study = "[[seed]]\nname = \"s\"\nstate = { x = 1.2 }\nparameters = { h = 1 }\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"h\"\nrange = [-2, 2]\n\
        [[curve]]\nname = \"folds\"\nhold = \"fold\"\nof = \"b\"\nfree = \"r\"\nrange = [0, 3]\n\
        [[curve]]\nname = \"flips\"\nhold = \"period-doubling\"\nof = \"b\"\nfree = \"r\"\nrange = [-3, 3]\n";
    let diagram = run(&own, study);
    let special = |name: &str, kind: Kind| -> Vec<Vec<f64>> {
        let curve = diagram.branch(name).unwrap();
        curve.special.iter().filter(|s| s.kind == kind).map(|s| s.point.parameters.clone()).collect()
    };
    let cusps = special("folds", Kind::Cusp);
    assert_eq!(cusps.len(), 1, "{cusps:?}");
    assert!((cusps[0][0] - 1.0).abs() < 1e-8 && cusps[0][1].abs() < 1e-8, "{cusps:?}");
    let degenerate = special("flips", Kind::GeneralisedPeriodDoubling);
    assert_eq!(degenerate.len(), 2, "{degenerate:?}");
    let h = 1.0 / 3.0 * (1.0 + 2.0 / 3.0) + 1.0 / 27.0;
    for place in &degenerate {
        assert!((place[0] + 2.0 / 3.0).abs() < 1e-8 && (place[1].abs() - h).abs() < 1e-8, "{degenerate:?} {h}");
    }
}

/// Unstable cycles of five and of sixty iterates, deep in the chaotic range: all iterates satisfy the map, and the
/// multiplier is the product of the derivatives.
#[test]
fn long_unstable_cycles_are_solved_for_all_their_iterates() {
    for (periods, r) in [(5u32, 3.9), (60, 3.97)] {
        let study = format!(
            "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nperiods = {periods}\nparameters = {{ r = {r} }}\n\
             [[branch]]\nname = \"f\"\nfrom = \"s\"\nfree = \"r\"\nrange = [{r}, {}]\n",
            r + 0.01
        );
        let diagram = run(&model("r = 3.9", &[("x", "r*x*(1 - x)")], "[0, 1]"), &study);
        for point in &diagram.branch("f").unwrap().points {
            let Solution::Cycle(cycle) = &point.solution else { panic!() };
            assert_eq!((cycle.forcing_periods, cycle.profile.len()), (periods, periods as usize));
            let (x, r) = (&cycle.profile, point.parameters[0]);
            let next = |k: usize| r * x[k] * (1.0 - x[k]) - x[(k + 1) % x.len()];
            assert!((0..x.len()).all(|k| next(k).abs() < 1e-14), "{periods}");
            let product: f64 = x.iter().map(|x| r * (1.0 - 2.0 * x)).product();
            let own = point.spectrum[0].re;
            assert!((own - product).abs() <= 1e-9 * product.abs() && point.unstable == 1, "{own} {product}");
        }
    }
}

#[test]
fn verification_by_the_composed_map_confirms_a_run() {
    let out = tempfile::tempdir().unwrap();
    for study in ["logistic", "henon", "ikeda"] {
        let run = out.path().join(study);
        let path = root().join(format!("studies/maps/{study}.toml"));
        let output = foldline(out.path(), &["run", path.to_str().unwrap(), "--out", run.to_str().unwrap()]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output));
        let output = foldline(out.path(), &["verify", run.to_str().unwrap()]);
        let said = text(&output);
        assert_eq!(output.status.code(), Some(0), "{study}: {said}");
        assert!(said.contains(" 0 outside the stated error"), "{said}");
        assert!(!said.starts_with("0 points"), "{said}");
    }
}

#[test]
fn a_killed_run_resumes_to_the_same_special_points() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.toml"), model("r = 2.5", &[("x", "r*x*(1 - x)")], "[0, 1]")).unwrap();
    let study = "model = \"m.toml\"\ntolerance = 1e-8\n".to_string()
        + &from_fixed("", "r", "[2.5, 3.6]", "switch = { period-doubling = 8 }\n")
        + "[[survey]]\nname = \"iterates\"\nfree = \"r\"\nrange = [2.5, 4]\ncount = 801\nstarts = 8\n";
    std::fs::write(folder.path().join("s.toml"), study).unwrap();
    let start = |more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_foldline"));
        command.args([&["run", "s.toml", "--out", "run", "--jobs", "1"], more].concat());
        command.current_dir(folder.path()).stdout(Stdio::null()).stderr(Stdio::null());
        command
    };
    let mut child = start(&[]).spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(400));
    let finished = child.try_wait().unwrap().is_some();
    let _ = child.kill();
    child.wait().unwrap();
    if !finished {
        assert_eq!(start(&["--resume"]).status().unwrap().code(), Some(0));
    }
    let resumed = load_part(&folder.path().join("run"), Part::Everything).unwrap().diagram;
    let whole = ran(folder.path(), "s.toml");
    let places = |diagram: &Diagram| -> Vec<(String, Kind, f64)> {
        let of = |b: &Branch| b.special.iter().map(|s| (b.name.clone(), s.kind, value(b, s))).collect::<Vec<_>>();
        diagram.branches.iter().flat_map(of).collect()
    };
    assert_eq!(places(&resumed), places(&whole));
    assert!(places(&whole).len() >= 6, "{:?}", places(&whole));
    let iterates = |diagram: &Diagram| diagram.response_set("iterates").unwrap().responses.len();
    assert_eq!(iterates(&resumed), iterates(&whole));
    // Every motion has its iterates: as many as its period.
    for response in &whole.response_set("iterates").unwrap().responses {
        let count = response.period.map_or(256, |period| period as usize);
        assert_eq!(response.iterates.len(), count, "{response:?}");
    }
}

#[test]
fn mistakes_in_maps_have_place_cause_and_cure() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |model: &str, pieces: &[&str]| {
        std::fs::write(folder.path().join("m.toml"), format!("[parameters]\na = 1\n{model}")).unwrap();
        let output = foldline(folder.path(), &["check", "m.toml"]);
        let said = text(&output);
        assert_eq!(output.status.code(), Some(2), "{said}");
        pieces.iter().for_each(|piece| assert!(said.contains(piece), "{piece}\n{said}"));
    };
    let smooth = "[states]\nx = { range = [-2, 2] }\n[map]\n";
    refused(&format!("{smooth}x = \"1 - a*abs(x)\"\n"), &["not smooth", "abs", "sqrt(x^2 + eps^2)"]);
    refused(&format!("{smooth}\"x'\" = \"a*x\"\n"), &["m.toml:6:1", "`x'` is not the name of a state", "write `x ="]);
    refused(&format!("{smooth}y = \"a*x\"\n"), &["has no equation", "[map]"]);
    refused(&format!("{smooth}x = \"a*x\"\n[equations]\nx = \"1\"\n"), &["both [equations] and [map]", "keep one"]);
    refused(&format!("{smooth}x = \"a*x\"\n[forcing]\nperiod = \"1\"\n"), &["a map has no forcing"]);
    refused("[states]\nx = { period = 1 }\n[map]\nx = \"2*x + a\"\n", &["declared as an angle", "advance by its own"]);
    std::fs::write(folder.path().join("m.toml"), model("a = 2", &[("x", "a*x*(1 - x)")], "[0, 1]")).unwrap();
    let study = |seed: &str, rest: &str, pieces: &[&str]| {
        let text_of = format!(
            "model = \"m.toml\"\n[[seed]]\nname = \"s\"\n{seed}\n[[branch]]\nname = \"f\"\nfrom = \"s\"\nfree = \"a\"\nrange = [1.5, 3]\n{rest}"
        );
        std::fs::write(folder.path().join("s.toml"), text_of).unwrap();
        let output = foldline(folder.path(), &["check", "s.toml"]);
        let said = text(&output);
        assert_eq!(output.status.code(), Some(2), "{said}");
        pieces.iter().for_each(|piece| assert!(said.contains(piece), "{piece}\n{said}"));
    };
    study("attractor = \"equilibrium\"", "", &["no equilibria", "fixed-point"]);
    study("cycle = { period = 1, times = [0, 1], states = { x = [0, 0] } }", "", &["the model is a map", "periods"]);
    study(
        "attractor = \"fixed-point\"",
        "[[curve]]\nname = \"c\"\nhold = \"branch-point\"\nof = \"f\"\nfree = \"a\"\nrange = [1, 2]\n",
        &["not supported for maps", "period-doubling"],
    );
}

#[test]
fn orbits_are_simulated_and_attractors_listed() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.toml"), model("r = 3.83", &[("x", "r*x*(1 - x)")], "[0, 1]")).unwrap();
    let output = foldline(folder.path(), &["simulate", "m.toml", "--start", "x=0.3", "--time", "2", "--format", "csv"]);
    let said = text(&output);
    let rows: Vec<Vec<f64>> =
        said.lines().skip(1).map(|l| l.split(',').map(|v| v.parse().unwrap()).collect()).collect();
    let next = 3.83 * 0.3 * 0.7;
    assert_eq!(rows.len(), 3, "{said}");
    assert!((rows[1][1] - next).abs() < 1e-15 && (rows[2][1] - 3.83 * next * (1.0 - next)).abs() < 1e-15, "{said}");
    let said = text(&foldline(folder.path(), &["attractors", "m.toml", "--samples", "16"]));
    assert!(said.contains("3.000000000") && said.contains("0 not settled"), "{said}");
}

/// A planar map with the fixed point 0, whose linear part has trace `q + b p` and determinant `p + a q` in coordinates in
/// which it is a companion matrix, seen in rotated, bent coordinates. It has a multiplier 1 where 1 - trace + determinant
/// vanishes, and -1 where 1 + trace + determinant does.
fn companion(q: f64, [a, b]: [f64; 2], turn: f64, bend: f64) -> String {
    let (s, c) = turn.sin_cos();
    format!(
        "[parameters]\np = 0.0\nq = {q:?}\n[definitions]\nD = \"p + ({a:?})*q\"\nT = \"q + ({b:?})*p\"\n\
         u = \"({c:?})*X + ({s:?})*Y\"\ny = \"(-{s:?})*X + ({c:?})*Y\"\nx = \"u - ({bend:?})*y^2\"\n\
         fy = \"-D*x + T*y + 0.494*x^2 + 0.646*x*y - 0.465*y^2 - 0.825*x^3\"\ngu = \"y + ({bend:?})*fy^2\"\n\
         [states]\nX = {{ range = [-1.0, 1.0] }}\nY = {{ range = [-1.0, 1.0] }}\n\
         [map]\nX = \"({c:?})*gu - ({s:?})*fy\"\nY = \"({s:?})*gu + ({c:?})*fy\"\n"
    )
}

#[test]
fn a_step_that_ends_on_a_branch_point_or_doubling_counts_it_once() {
    let [q, a, b] = [-0.19041051435988968, -0.116, -0.12];
    // 1 - (q + b p) + p + a q = 0 and 1 + (q + b p) + p + a q = 0.
    let branching = (q - a * q - 1.0) / (1.0 - b);
    let doubling = (-q - a * q - 1.0) / (1.0 + b);
    for (kind, at, counts) in [(Kind::BranchPoint, branching, [2, 1]), (Kind::PeriodDoubling, doubling, [1, 0])] {
        let mut seen = 0;
        // The first steps are 0.02, 0.04, … of the scale of the parameter, so that a start a round distance away has a step that
        // ends there; sums of powers of two are exact.
        for away in [0.2125, 0.1, 0.05, 0.25] {
            let study = format!(
                "parameters = {{ p = {:?} }}\n[[seed]]\nname = \"s\"\nstate = \"zero\"\n\
                 [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p\"\nrange = [{:?}, {:?}]\n",
                at - away,
                at - away - 0.05,
                at + 0.06
            );
            let diagram = run(&companion(q, [a, b], 2.346, -0.203), &study);
            let branch = diagram.branch("b").unwrap();
            let found: Vec<_> =
                branch.special.iter().map(|own| (own.kind, own.unstable_before, own.unstable_after)).collect();
            assert!(found.iter().all(|own| own.0 != Kind::Unexplained), "{away}: {found:?}");
            let here: Vec<&SpecialPoint> =
                branch.special.iter().filter(|own| (own.point.parameters[0] - at).abs() < 1e-6).collect();
            assert_eq!(here.len(), 1, "{away}: {found:?}");
            assert_eq!((here[0].kind, [here[0].unstable_before, here[0].unstable_after]), (kind, counts), "{away}");
            assert!((here[0].point.parameters[0] - at).abs() <= here[0].error, "{away}");
            seen += 1;
        }
        assert_eq!(seen, 4);
    }
}
