//! Eigenvalues and multipliers that are neutral at all parameters, that cross together, or that are far smaller than the entries of the
//! Jacobian. Positions and numbers of unstable eigenvalues follow from closed forms.

use std::process::Command;

struct Case {
    name: &'static str,
    model: String,
    /// Lines of the study after those of the model.
    study: &'static str,
    tolerance: &'static [&'static str],
    branch: &'static str,
    /// Kind, parameter and numbers of unstable eigenvalues or multipliers of each special point of the branch, by position.
    special: Vec<(&'static str, f64, [i64; 2])>,
    /// Relative error allowed for the parameter.
    within: f64,
    exit: i32,
}

fn study(state: &str, parameters: &str, free: &str, range: &str, more: &str) -> String {
    format!(
        "[[seed]]\nname = \"s\"\nstate = {state}\nparameters = {{ {parameters} }}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \
         \"{free}\"\nrange = {range}\n{more}\n"
    )
}

/// A ring of cells near a Hopf point with the coupling -0.1.
fn ring(count: usize) -> String {
    format!(
        "[parameters]\nmu = -0.5\nk = -0.1\n[states.x]\ncount = {count}\nperiodic = true\nequation = \
         \"mu*x[i] - y[i] - x[i]*(x[i]^2 + y[i]^2) + k*(x[i-1] + x[i+1] - 2*x[i])\"\n[states.y]\ncount = {count}\nperiodic = \
         true\nequation = \"x[i] + mu*y[i] - y[i]*(x[i]^2 + y[i]^2) + k*(y[i-1] + y[i+1] - 2*y[i])\"\n"
    )
}

#[test]
fn what_is_neutral_all_along_makes_no_special_points_and_what_crosses_together_is_counted_together() {
    let usual: &'static [&'static str] = &["1e-4", "1e-6", "1e-8"];
    let undamped =
        "[parameters]\nP = 0.5\n[states]\n\"x''\" = \"-(3*x - y) + P*x - x^3\"\n\"y''\" = \"-(3*y - x) + P*y - y^3\"\n";
    let fast = |w: f64, c: f64| {
        format!(
            "[parameters]\nmu = -0.5\n[states]\n\"x''\" = \"2*mu*x' - x - x'*x^2 + 0.1*y\"\n\"y''\" = \"-{w:e}^2*(y - 0.3*x) - \
             {c:e}*y'\"\n"
        )
    };
    let chain: String = (0..5)
        .map(|k| {
            let sum = |name: &str| match k {
                0 => format!("{name}1"),
                4 => format!("{name}3"),
                _ => format!("{name}{} + {name}{}", k - 1, k + 1),
            };
            let (u, v) = (format!("u{k}"), format!("v{k}"));
            format!(
                "{u} = \"mu*{u} - {v} - {u}*({u}^2 + {v}^2) + D*({} - 2*{u})\"\n{v} = \"{u} + mu*{v} - {v}*({u}^2 + {v}^2) + D*({} \
                 - 2*{v})\"\n",
                sum("u"),
                sum("v")
            )
        })
        .collect();
    let rate = |k: usize| 4.0 * 0.3 * (k as f64 * std::f64::consts::PI / 12.0).sin().powi(2);
    let cases = [
        Case {
            name: "the interior equilibrium of Lotka and Volterra is a centre",
            model: "[parameters]\na = 1\nb = 0.5\nc = 0.3\nd = 0.8\n[states]\nx = \"a*x - b*x*y\"\ny = \"c*x*y - d*y\"\n".into(),
            study: Box::leak(study("{ x = 2.6666666666666667, y = 2 }", "", "c", "[0.03, 2.9]", "").into_boxed_str()),
            tolerance: usual,
            branch: "b",
            special: vec![],
            within: 1e-9,
            exit: 0,
        },
        Case {
            name: "buckling of an undamped structure with the stiffnesses 2 and 4",
            model: undamped.into(),
            study: Box::leak(study("\"zero\"", "", "P", "[0, 6]", "").into_boxed_str()),
            tolerance: usual,
            branch: "b",
            special: vec![("branch-point", 2.0, [0, 1]), ("branch-point", 4.0, [1, 2])],
            within: 1e-6,
            exit: 0,
        },
        Case {
            name: "an undamped pitchfork and the states that leave it",
            model: "[parameters]\nmu = -1\n[states]\n\"x''\" = \"mu*x - x^3\"\n".into(),
            study: Box::leak(study("\"zero\"", "", "mu", "[-1.3, 1.1]", "switch = { branch-point = 1 }").into_boxed_str()),
            tolerance: usual,
            branch: "b",
            special: vec![("branch-point", 0.0, [0, 1])],
            within: 1e-6,
            exit: 0,
        },
        Case {
            name: "sums of other eigenvalues vanish at a Hopf point as well",
            model: format!("[parameters]\nmu = 0\nD = 0.3\n[states]\n{chain}"),
            study: Box::leak(study("\"zero\"", "", "mu", "[0, 0.95]", "").into_boxed_str()),
            tolerance: &["1e-6"],
            branch: "b",
            special: (1..5).map(|k| ("hopf", rate(k), [2 * k as i64 - 2, 2 * k as i64])).collect(),
            within: 1e-12,
            exit: 0,
        },
        Case {
            name: "a fast mode of light damping",
            model: fast(1e8, 0.01),
            study: Box::leak(study("\"zero\"", "", "mu", "[-1, 1.1]", "").into_boxed_str()),
            tolerance: usual,
            branch: "b",
            special: vec![("hopf", 0.0, [0, 2])],
            within: 1e-12,
            exit: 0,
        },
        Case {
            name: "a fold and a Hopf point at the same place",
            model: "[parameters]\nmu = -0.53\n[states]\nx = \"-mu - x^2\"\ny = \"x*y - z - y*(y^2 + z^2)\"\nz = \"y + x*z - \
                    z*(y^2 + z^2)\"\n"
                .into(),
            study: Box::leak(study("{ x = 0.728, y = 0, z = 0 }", "", "mu", "[-1.3, 1.1]", "").into_boxed_str()),
            tolerance: usual,
            branch: "b",
            special: vec![("fold", 0.0, [2, 3]), ("hopf", 0.0, [3, 1])],
            within: 1e-4,
            exit: 0,
        },
        Case {
            name: "a double multiplier 1 in a ring of three cells",
            model: ring(3),
            study: Box::leak(study("\"zero\"", "", "mu", "[-1, 1]", "switch = { hopf-3 = 1 }").into_boxed_str()),
            tolerance: &["1e-4", "1e-6"],
            branch: "b/hopf-3",
            special: vec![("branch-point", 0.15, [4, 2])],
            within: 1e-6,
            exit: 0,
        },
        Case {
            name: "a double multiplier 1 in a ring of four cells",
            model: ring(4),
            study: Box::leak(study("\"zero\"", "", "mu", "[-0.5, 1]", "switch = { hopf-4 = 1 }").into_boxed_str()),
            tolerance: &["1e-4", "1e-6"],
            branch: "b/hopf-4",
            special: vec![("branch-point", 0.1, [6, 4]), ("branch-point", 0.2, [4, 3])],
            within: 1e-6,
            exit: 0,
        },
        Case {
            name: "a forced oscillator without damping",
            model: "[parameters]\nw = 2.3\n[forcing]\nfrequency = \"w\"\n[states]\n\"x''\" = \"-x - 0.3*x^3 + 0.5*cos(w*t)\"\n"
                .into(),
            study: Box::leak(
                study("\"zero\"", "w = 2.3", "w", "[1.2, 5]", "").into_boxed_str(),
            ),
            tolerance: usual,
            branch: "b",
            special: vec![("fold", 1.313584601, [1, 0])],
            within: 1e-7,
            exit: 0,
        },
        Case {
            name: "a step that ends exactly at a Hopf point",
            model: "[parameters]\nmu = 0\n[states]\nx = \"y\"\ny = \"mu*(1 - x^2)*y - x\"\n".into(),
            study: Box::leak(study("\"zero\"", "mu = 1", "mu", "[-1, 1]", "mark = { mu = [0.5] }").into_boxed_str()),
            tolerance: usual,
            branch: "b",
            special: vec![("mark", 0.5, [2, 2]), ("hopf", 0.0, [0, 2])],
            within: 1e-9,
            exit: 0,
        },
        Case {
            name: "a branch that starts exactly at a Hopf point",
            model: "[parameters]\nmu = 0\n[states]\nx = \"y\"\ny = \"mu*(1 - x^2)*y - x\"\n".into(),
            study: Box::leak(study("\"zero\"", "", "mu", "[-1, 1]", "").into_boxed_str()),
            tolerance: usual,
            branch: "b",
            special: vec![("hopf", 0.0, [0, 2])],
            within: 1e-9,
            exit: 0,
        },
        Case {
            name: "two pairs that exchange sides within a step",
            model: "[parameters]\nmu = -0.53\n[states]\nx = \"mu*x - y - x*(x^2 + y^2)\"\ny = \"x + mu*y - y*(x^2 + y^2)\"\n\
                    u = \"-(mu - 0.001)*u - 2*v - u*(u^2 + v^2)\"\nv = \"2*u - (mu - 0.001)*v - v*(u^2 + v^2)\"\n"
                .into(),
            study: Box::leak(study("\"zero\"", "", "mu", "[-1.3, 1.1]", "").into_boxed_str()),
            tolerance: usual,
            branch: "b",
            special: vec![("hopf", 0.0, [2, 4]), ("hopf", 0.001, [4, 2])],
            within: 1e-9,
            exit: 0,
        },
        Case {
            name: "two real eigenvalues that exchange sides around a Hopf point",
            model: "[parameters]\nmu = -0.53\n[states]\nx = \"mu*x - y - x*(x^2 + y^2)\"\ny = \"x + mu*y - y*(x^2 + y^2)\"\n\
                    u = \"-(mu + 0.001)*u - u^3\"\nv = \"(mu - 0.001)*v - v^3\"\n"
                .into(),
            study: Box::leak(study("\"zero\"", "", "mu", "[-1.3, 1.1]", "").into_boxed_str()),
            tolerance: usual,
            branch: "b",
            special: vec![("branch-point", -0.001, [1, 0]), ("hopf", 0.0, [0, 2]), ("branch-point", 0.001, [2, 3])],
            within: 1e-8,
            exit: 0,
        },
    ];
    let mut wrong = Vec::new();
    for case in &cases {
        for tolerance in case.tolerance {
            let found = run(case, tolerance);
            if let Err(why) = found {
                wrong.push(format!("{} at {tolerance}: {why}", case.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

fn run(case: &Case, tolerance: &str) -> Result<(), String> {
    let folder = std::env::temp_dir().join(format!("foldline-neutral-{}-{tolerance}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("model.toml"), &case.model).unwrap();
    let study = format!("model = \"model.toml\"\ntolerance = {tolerance}\n{}", case.study);
    std::fs::write(folder.join("study.toml"), study).unwrap();
    let command = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(&folder).output().unwrap()
    };
    let ran = command(&["run", "study.toml", "--out", "run", "--quiet"]);
    let said = String::from_utf8_lossy(&ran.stderr).into_owned() + &String::from_utf8_lossy(&ran.stdout);
    let table = command(&["table", "run", "--special", "--branch", case.branch, "--format", "csv"]);
    std::fs::remove_dir_all(&folder).unwrap();
    let table = String::from_utf8(table.stdout).unwrap();
    let mut lines = table.lines().map(|line| line.split(',').map(str::to_string).collect::<Vec<_>>());
    let header = lines.next().unwrap_or_default();
    let column = |name: &str| header.iter().position(|own| own == name);
    let free = case.study.split("free = \"").nth(1).and_then(|rest| rest.split('"').next()).unwrap();
    let rows: Vec<Vec<String>> = lines.collect();
    let found: Vec<(String, f64, [i64; 2])> = rows
        .iter()
        .map(|row| {
            let text = |name: &str| row[column(name).unwrap()].clone();
            let count = |name: &str| text(name).parse().unwrap();
            (text("kind"), text(free).parse().unwrap(), [count("unstable_before"), count("unstable_after")])
        })
        .collect();
    type Row<Name> = (Name, f64, [i64; 2]);
    let same = |(own, right): (&Row<String>, &Row<&str>)| {
        let reverse = [right.2[1], right.2[0]];
        own.0 == right.0
            && (own.2 == right.2 || own.2 == reverse)
            && (own.1 - right.1).abs() <= case.within * right.1.abs().max(1.0)
    };
    let all = found.len() == case.special.len()
        && (found.iter().zip(&case.special).all(same) || found.iter().rev().zip(&case.special).all(same));
    match (all, ran.status.code() == Some(case.exit)) {
        (true, true) => Ok(()),
        _ => Err(format!("{:?} {found:?}\n{said}", ran.status.code())),
    }
}
