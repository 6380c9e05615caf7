//! Symmetries that permute states, and special points that were missed beside others. Positions follow from closed forms.

use std::process::Command;

/// Output and exit code of a run of this model and study, at a tolerance.
pub(crate) fn run(model: &str, study: &str, tolerance: &str) -> (String, i32) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("model.toml"), format!("name = \"m\"\n{model}")).unwrap();
    let study = format!("model = \"model.toml\"\ntolerance = {tolerance}\n{study}");
    std::fs::write(folder.path().join("study.toml"), study).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_foldline"));
    let output = command.args(["run", "study.toml", "--out", "run"]).current_dir(folder.path()).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    (text, output.status.code().unwrap())
}

/// Lines that begin with the name of a branch and its kind.
pub(crate) fn points<'t>(text: &'t str, branch: &str, kind: &str) -> Vec<&'t str> {
    text.lines().filter(|line| line.split_whitespace().take(2).eq([branch, kind])).collect()
}

pub(crate) fn value(line: &str, column: usize) -> f64 {
    line.split_whitespace().nth(column).unwrap().parse().unwrap()
}

#[test]
fn a_pitchfork_of_exchanged_cells_is_a_branch_point_on_both_branches() {
    // On the diagonal x^2 = mu - k, and the difference of the cells has the rate mu - 3 x^2 + k, which is 0 at mu = 2 k.
    let model = "[parameters]\nmu = 1\nk = 0.5\n[states]\nx = \"mu*x - x^3 - k*y\"\ny = \"mu*y - y^3 - k*x\"\n";
    let study = "[[seed]]\nname = \"s\"\nstate = { x = 1.2, y = 1.2 }\nparameters = { mu = 2 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n\
                 free = \"mu\"\nrange = [0.6, 3]\nswitch = { branch-point = 2 }\n";
    for tolerance in ["1e-4", "1e-6", "1e-8"] {
        let (text, code) = run(model, study, tolerance);
        assert_eq!(code, 0, "{text}");
        let here = points(&text, "b", "branch-point");
        assert_eq!(here.len(), 1, "{text}");
        assert!((value(here[0], 2) - 1.0).abs() < 1e-6 && here[0].contains("pitchfork"), "{text}");
        // The branch that leaves is its own image under the exchange: it passes the point where it began, and has no fold.
        assert_eq!(points(&text, "b/branch-point-1", "branch-point").len(), 1, "{text}");
        assert!(points(&text, "b/branch-point-1", "fold").is_empty(), "{text}");
        assert!(!text.contains("unexplained"), "{text}");
    }
}

#[test]
fn a_cusp_of_an_undamped_system_and_close_points_of_codimension_two_are_found() {
    let undamped = "[parameters]\np = -3\nq = 1\n[states]\n\"x''\" = \"p + q*x - x^3\"\n";
    let folds = "[[seed]]\nname = \"s\"\nstate = { x = -1.5, \"x'\" = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p\"\nrange = [-3, 3]\n\
                 [[curve]]\nname = \"folds\"\nhold = \"fold\"\nof = \"b\"\nfree = \"q\"\nrange = [-2, 2]\n";
    // l1 vanishes at b = 0.503 ± 0.01 on the line mu = 0.
    let force = "((b - 0.503)^2 - 0.01^2 - (x^2 + y^2))*(x^2 + y^2)";
    let bautin =
        format!("[parameters]\nmu = -1\nb = 0\n[states]\nx = \"mu*x - y + {force}*x\"\ny = \"x + mu*y + {force}*y\"\n");
    let hopf = "[[seed]]\nname = \"s\"\nstate = \"zero\"\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"mu\"\nrange = [-1, 1]\n\
                [[curve]]\nname = \"hopf\"\nhold = \"hopf\"\nof = \"b\"\nfree = \"b\"\nrange = [-2, 3]\n";
    for tolerance in ["1e-4", "1e-6", "1e-8"] {
        let (text, code) = run(undamped, folds, tolerance);
        let cusps = points(&text, "folds", "cusp");
        assert!(code == 0 && cusps.len() == 1 && points(&text, "folds", "bogdanov-takens").is_empty(), "{text}");
        assert!((2..4).all(|column| value(cusps[0], column).abs() < 1e-9), "{text}");
        let (text, code) = run(&bautin, hopf, tolerance);
        let found: Vec<f64> = points(&text, "hopf", "generalised-hopf").iter().map(|line| value(line, 3)).collect();
        assert!(code == 0 && found.len() == 2, "{text}");
        assert!((found[0] - 0.493).abs() < 1e-8 && (found[1] - 0.513).abs() < 1e-8, "{text}");
    }
}
