//! Special points at which several eigenvalues or multipliers are critical at once: they are named, their coefficients
//! are left out with the reason, and all branches that leave are found. The numbers of branches follow from closed forms.

use std::process::Command;

struct Case {
    name: &'static str,
    model: String,
    /// Start of the branch.
    start: &'static str,
    /// Kind, numbers of unstable eigenvalues or multipliers and normal form of each special point.
    special: Vec<(&'static str, [i64; 2], &'static str)>,
    /// Number of branches that leave, and what the run says about them.
    leaving: usize,
    says: &'static str,
}

/// xᵢ′ = …: competing species y, each with the equation y (p - Σ A y), in the coordinates x = R y. For every set of
/// species one solution has just these, so 2^d - 1 branches leave.
fn competing(before: &str, inside: &str, dimension: usize, cycle: bool) -> String {
    const A: [[f64; 3]; 3] = [[2.0, 0.7, 0.5], [0.6, 1.8, 0.4], [0.8, 0.3, 2.2]];
    // Rotations in two planes.
    let ([c, s], [d, e]) = ([0.8, 0.6], [5.0 / 13.0, 12.0 / 13.0]);
    let turn = [[c, -s * d, s * e], [s, c * d, -c * e], [0.0, e, d]];
    let turn = if dimension == 2 { [[c, -s, 0.0], [s, c, 0.0], [0.0; 3]] } else { turn };
    let sum = |terms: Vec<String>| terms.join(" + ");
    let mut definitions = String::new();
    for j in 0..dimension {
        let own = sum((0..dimension).map(|i| format!("({:?})*x{i}", turn[i][j])).collect());
        definitions += &format!("y{j} = \"{own}\"\n");
    }
    for j in 0..dimension {
        let own = sum((0..dimension).map(|i| format!("{:?}*y{i}", A[j][i])).collect());
        definitions += &format!("g{j} = \"y{j}*({inside} - ({own}))\"\n");
    }
    let states: String = (0..dimension)
        .map(|i| {
            let own = sum((0..dimension).map(|j| format!("({:?})*g{j}", turn[i][j])).collect());
            let range = if cycle { ", range = [-0.1, 0.1]" } else { "" };
            format!("x{i} = {{ equation = \"{own}\"{range} }}\n")
        })
        .collect();
    format!("[parameters]\np = -0.5\n[definitions]\n{definitions}[states]\n{before}{states}")
}

/// An oscillator of radius 1 and period 2π.
const CIRCLE: &str = "u = { equation = \"u*(1 - u^2 - v^2) - v\", range = [-1.5, 1.5] }\n\
                      v = { equation = \"v*(1 - u^2 - v^2) + u\", range = [-1.5, 1.5] }\n";

/// Planes beside the oscillator in which solutions turn by half a turn per period and grow with the rate p along one
/// direction: several multipliers pass -1 at p = 0.
fn half_turns(count: usize) -> String {
    let planes: String = (0..count)
        .map(|i| {
            let size = format!("{:?}*(a{i}^2 + b{i}^2)", 1.0 + 0.3 * i as f64);
            format!(
                "a{i} = {{ equation = \"0.5*((p - 1) + (p + 1)*u)*a{i} + 0.5*(p + 1)*v*b{i} - 0.5*b{i} - {size}*a{i}\", range = [-0.1, 0.1] }}\n\
                 b{i} = {{ equation = \"0.5*(p + 1)*v*a{i} + 0.5*((p - 1) - (p + 1)*u)*b{i} + 0.5*a{i} - {size}*b{i}\", range = [-0.1, 0.1] }}\n"
            )
        })
        .collect();
    format!("[parameters]\np = -0.5\n[states]\n{CIRCLE}{planes}")
}

fn map(rules: &[&str]) -> String {
    let states: String = (0..rules.len()).map(|i| format!("x{i} = {{ range = [-1, 1] }}\n")).collect();
    let rules: String = rules.iter().enumerate().map(|(i, rule)| format!("x{i} = \"{rule}\"\n")).collect();
    format!("[parameters]\np = -0.5\n[states]\n{states}[map]\n{rules}")
}

const TWO: &str = "no coefficients: the null space has dimension 2";
const THREE: &str = "no coefficients: the null space has dimension 3";
const DOUBLE: &str = "no coefficients: the multiplier -1 has multiplicity 2";

#[test]
fn null_spaces_of_several_dimensions_are_named_and_all_branches_are_found() {
    let flow = |states: &str| format!("[parameters]\np = -0.5\n[states]\n{states}");
    let (two, cycle) = ("state = { x0 = 0, x1 = 0 }", "attractor = \"cycle\"");
    let cases = [
        Case {
            name: "two competing species",
            model: competing("", "p", 2, false),
            start: two,
            special: vec![("branch-point", [0, 2], TWO)],
            leaving: 3,
            says: "3 bifurcating branches found",
        },
        Case {
            name: "three competing species",
            model: competing("", "p", 3, false),
            start: "state = { x0 = 0, x1 = 0, x2 = 0 }",
            special: vec![("branch-point", [0, 3], THREE)],
            leaving: 7,
            says: "7 bifurcating branches found",
        },
        Case {
            name: "two competing species driven by an oscillator",
            model: competing(CIRCLE, "p + 0.3*u", 2, true),
            start: cycle,
            special: vec![("branch-point", [0, 2], TWO)],
            leaving: 3,
            says: "3 bifurcating branches found",
        },
        // (1, 0), (0, 1), (1, 1) and (1, -1).
        Case {
            name: "two multipliers -1",
            model: half_turns(2),
            start: cycle,
            special: vec![("period-doubling", [0, 1], DOUBLE), ("period-doubling", [1, 2], DOUBLE)],
            leaving: 4,
            says: "4 bifurcating branches found",
        },
        Case {
            name: "two multipliers -1 of a map",
            model: map(&["-(1 + p)*x0 + x0^3 + 0.2*x0*x1^2", "-(1 + p)*x1 + 1.2*x1^3"]),
            start: two,
            special: vec![("period-doubling", [0, 1], DOUBLE), ("period-doubling", [1, 2], DOUBLE)],
            leaving: 4,
            says: "4 bifurcating branches found",
        },
        Case {
            name: "two multipliers 1 of a map",
            model: map(&["(1 + p)*x0 - x0^3 - 0.2*x0*x1^2", "(1 + p)*x1 - 1.2*x1^3"]),
            start: two,
            special: vec![("branch-point", [0, 2], TWO)],
            leaving: 4,
            says: "4 bifurcating branches found",
        },
        // x² = p and y² = -p have no common solution.
        Case {
            name: "two eigenvalues that cross in opposite directions",
            model: flow("x0 = \"p*x0 - x0^3\"\nx1 = \"-p*x1 - x1^3\"\n"),
            start: two,
            special: vec![("branch-point", [1, 1], TWO)],
            leaving: 2,
            says: "2 bifurcating branches found",
        },
        Case {
            name: "two eigenvalues that cross in opposite directions, one after the other",
            model: flow("x0 = \"p*x0 - x0^2\"\nx1 = \"(0.01 - p)*x1 - x1^2\"\n"),
            start: two,
            special: vec![("branch-point", [1, 2], ""), ("branch-point", [2, 1], "")],
            leaving: 2,
            says: "",
        },
        // x′ = p (1 + i) x …: no oscillation at p = 0, where the frequency vanishes too, and no other equilibria.
        Case {
            name: "a pair of eigenvalues that passes through 0",
            model: flow("x0 = \"p*x0 - p*x1 - x0^3\"\nx1 = \"p*x0 + p*x1 - x1^3\"\n"),
            start: two,
            special: vec![("branch-point", [0, 2], TWO)],
            leaving: 0,
            says: "no bifurcating branch found",
        },
    ];
    for case in cases {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("m.toml"), &case.model).unwrap();
        let study = format!(
            "model = \"m.toml\"\n[[seed]]\nname = \"s\"\n{}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p\"\n\
             range = [-0.5, 0.43]\nswitch = {{ branch-point = 1, period-doubling = 1 }}\n",
            case.start
        );
        std::fs::write(folder.path().join("s.toml"), study).unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_foldline"))
            .args(["run", "s.toml", "--out", "run"])
            .current_dir(folder.path())
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        let name = case.name;
        assert_eq!(output.status.code(), Some(if case.leaving > 0 { 0 } else { 3 }), "{name}: {text}");
        assert!(text.contains(case.says), "{name}: {text}");
        let file = rusqlite::Connection::open(folder.path().join("run/run.sqlite")).unwrap();
        let mut statement = file
            .prepare(
                "SELECT kind, unstable_before, unstable_after, normal_form FROM special_points JOIN branches USING (branch) \
                 WHERE name = 'b' ORDER BY position, special_points.rowid",
            )
            .unwrap();
        let rows = statement.query_map([], |row| Ok((row.get(0)?, [row.get(1)?, row.get(2)?], row.get(3)?)));
        let found: Vec<(String, [i64; 2], Option<String>)> = rows.unwrap().map(Result::unwrap).collect();
        assert_eq!(found.len(), case.special.len(), "{name}: {found:?}");
        for (own, (kind, counts, form)) in found.iter().zip(&case.special) {
            assert_eq!((own.0.as_str(), own.1), (*kind, *counts), "{name}: {found:?}");
            assert!(form.is_empty() || own.2.as_deref() == Some(*form), "{name}: {found:?}");
        }
        let followed: i64 = file
            .query_row("SELECT count(*) FROM branches WHERE origin_name = 'b' AND origin_kind IS NOT NULL", [], |row| {
                row.get(0)
            })
            .unwrap();
        // Nor has the same point coefficients where a branch that left it passes it.
        let sql =
            "SELECT count(*) FROM special_points WHERE kind <> 'hopf' AND coefficient_count > 0 AND abs(p) < 1e-6";
        let coefficients: i64 = file.query_row(sql, [], |row| row.get(0)).unwrap();
        assert!(
            coefficients == 0 || case.says.is_empty(),
            "{name}: coefficients at a null space of several dimensions"
        );
        let images = text.matches("already known").count();
        assert_eq!(followed as usize + images, case.leaving, "{name}: {text}");
    }
}
