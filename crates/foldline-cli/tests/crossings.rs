//! Branches that leave a branch point, however the branches met there first, and points whose states differ in size.
//! Positions and coefficients follow from closed forms unless a source is given.

use crate::permuted::{points, run, value};

/// Study of a branch `b` in `free` from a state, with branches that leave its branch points.
fn followed(state: &str, free: &str, range: &str) -> String {
    format!(
        "[[seed]]\nname = \"s\"\nstate = {state}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"{free}\"\nrange = {range}\n\
         switch = {{ branch-point = 1 }}\n"
    )
}

#[test]
fn lines_that_cross_at_a_modest_angle_are_two_branches() {
    let pairs = [
        ("(x + 1.47*a - 0.31)*(x + 0.59*a + 0.17)", "0.83", "-0.9101"),
        ("(x + 0.6*a - 0.29)*(x + 0.4*a + 0.08)", "-0.05", "0.32"),
    ];
    for (product, a, x) in pairs {
        let model = format!("[parameters]\na = {a}\n[states]\nx = {{ equation = \"-{product}\", range = [-2, 2] }}\n");
        let (text, code) = run(&model, &followed(&format!("{{ x = {x} }}"), "a", "[-2, 2]"), "1e-6");
        assert_eq!(code, 0, "{text}");
        assert!(
            text.contains("b/branch-point-1 ") && points(&text, "b/branch-point-1", "branch-point").len() == 1,
            "{text}"
        );
    }
}

#[test]
fn a_pitchfork_met_along_its_side_branch_leads_to_the_branch_of_symmetric_states() {
    let single = "[parameters]\na = 1\n[states]\nx = { equation = \"a*x - x^3\", range = [-2, 2] }\n";
    for range in ["[-2, 5]", "[-1, 4]", "[-0.5, 2.5]"] {
        let (text, code) = run(single, &followed("{ x = 1 }", "a", range), "1e-6");
        assert_eq!(code, 0, "{text}");
        // x = 0, which changes its stability at a = 0.
        let here = points(&text, "b/branch-point-1", "branch-point");
        assert!(here.len() == 1 && value(here[0], 2).abs() < 1e-8, "{text}");
    }
    // Two cells: x = y = 0 is singular at a = 0 in the sum and at a = 2 k in the difference.
    for a in ["0.2", "0.3", "0.5"] {
        let model = format!(
            "[parameters]\na = {a}\nk = 1\n[states]\nx = {{ equation = \"a*x - x^3 + k*(y - x)\", range = [-2, 2] }}\n\
             y = {{ equation = \"a*y - y^3 + k*(x - y)\", range = [-2, 2] }}\n"
        );
        let x = a.parse::<f64>().unwrap().sqrt();
        let (text, code) = run(&model, &followed(&format!("{{ x = {x}, y = {x} }}"), "a", "[-1, 4]"), "1e-6");
        assert_eq!(code, 0, "{text}");
        let mut here: Vec<f64> =
            points(&text, "b/branch-point-1", "branch-point").iter().map(|line| value(line, 2)).collect();
        here.sort_by(f64::total_cmp);
        assert!(here.len() == 2 && here[0].abs() < 1e-8 && (here[1] - 2.0).abs() < 1e-8, "{text}");
    }
}

/// Ueda's oscillator: the asymmetric cycles and their period doubling at B = 4.876091 agree at tolerances from 1e-4 to
/// 1e-8.
#[test]
fn asymmetric_cycles_are_told_from_symmetric_ones_at_a_loose_tolerance() {
    let model = "[parameters]\nB = 1\n[forcing]\nfrequency = \"1\"\n[states]\nx = { equation = \"v\", range = [-3, 3] }\n\
                 v = { equation = \"-0.1*v - x^3 + B*cos(t)\", range = [-3, 3] }\n";
    let study = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"B\"\n\
                 range = [0.5, 6]\nswitch = { branch-point = 1 }\n";
    let (text, code) = run(model, study, "1e-4");
    assert_eq!(code, 0, "{text}");
    let doubling = points(&text, "b/branch-point-1", "period-doubling");
    assert!(!doubling.is_empty() && (value(doubling[0], 2) - 4.876091).abs() < 1e-5, "{text}");
}

#[test]
fn two_branch_points_within_a_step_along_a_line_are_found() {
    // The line meets the parabola twice: 0.33 a + 0.02 = ±√(0.27 - a), and the other line at 0.31/1.08.
    let product = "(x - 0.33*a - 0.27)*(a - 0.27 + (x - 0.25)^2)*(x + 0.75*a - 0.58)";
    let model = format!("[parameters]\na = 0.83\n[states]\nx = {{ equation = \"-{product}\", range = [-2, 2] }}\n");
    let (text, code) = run(&model, &followed("{ x = 0.5439 }", "a", "[-2, 2]"), "1e-6");
    assert_eq!(code, 0, "{text}");
    let mut here: Vec<f64> = points(&text, "b", "branch-point").iter().map(|line| value(line, 2)).collect();
    here.sort_by(f64::total_cmp);
    assert!(here.len() == 2 && (here[0] - 0.258884143).abs() < 1e-8 && (here[1] - 0.31 / 1.08).abs() < 1e-8, "{text}");
}

#[test]
fn a_bogdanov_takens_point_does_not_depend_on_the_unit_of_a_velocity() {
    for factor in ["1", "1e3", "1e4", "1e7"] {
        let model = format!(
            "[parameters]\nm1 = -0.5\nm2 = 0.2\n[states]\nx = {{ equation = \"v/{factor}\", range = [-2, 1] }}\n\
             v = {{ equation = \"{factor}*(m1 + m2*v/{factor} + x^2 + x*v/{factor})\", range = [-{factor}, {factor}] }}\n"
        );
        let study = "[[seed]]\nname = \"s\"\nstate = { x = -0.7, v = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"m1\"\n\
                     range = [-2, 0.5]\n[[curve]]\nname = \"F\"\nhold = \"fold\"\nof = \"b\"\nfree = \"m2\"\nrange = [-2, 2]\n";
        let (text, code) = run(&model, study, "1e-6");
        let here = points(&text, "F", "bogdanov-takens");
        assert!(code == 0 && here.len() == 1 && points(&text, "F", "cusp").is_empty(), "{factor}: {text}");
        assert!(value(here[0], 2).abs() < 1e-9 && value(here[0], 3).abs() < 1e-9, "{factor}: {text}");
    }
}

#[test]
fn a_transcritical_point_of_states_of_different_size_has_its_coefficients() {
    // At K = 1/3 the predator appears: b = 1/(1 + K)^2, and a is inverse to the unit of the predator.
    for unit in ["1", "1e6", "1e9"] {
        let model = format!(
            "[parameters]\nK = 0.2\n[states]\nx = {{ equation = \"x*(1 - x/K) - x*(y/{unit})/(1 + x)\", range = [0, 4] }}\n\
             y = {{ equation = \"y*(x/(1 + x) - 0.25)\", range = [0, 3{}] }}\n",
            unit.trim_start_matches('1')
        );
        let (text, _) = run(&model, &followed("{ x = 0.2, y = 0 }", "K", "[0.1, 1]"), "1e-6");
        let here = points(&text, "b", "branch-point");
        assert!(here.len() == 1 && here[0].contains("b = 0.56250, transcritical"), "{unit}: {text}");
    }
}

#[test]
fn no_generalised_hopf_point_is_read_from_the_rounding_of_a_vanishing_frequency() {
    // Predator and prey with an Allee effect: l1 < 0 for all b < 1, and the frequency vanishes at b = 1.
    let model = "[parameters]\nd = -0.8\nb = 0.2\n[states]\nN = { equation = \"N*(N - b)*(1 - N) - N*P\", range = [0, 1] }\n\
                 P = { equation = \"P*(N + d)\", range = [0, 1] }\n";
    let study = followed("{ N = 1, P = 0 }", "d", "[-1.2, -0.1]")
        + "[[curve]]\nname = \"H\"\nhold = \"hopf\"\nof = \"b/branch-point-1\"\nfree = \"b\"\nrange = [-1, 1]\n";
    let (text, code) = run(model, &study, "1e-6");
    assert!(code == 0 && text.contains("\nH ") && points(&text, "H", "generalised-hopf").is_empty(), "{text}");
}

#[test]
fn exploring_from_a_value_at_which_two_branches_cross_joins_no_halves() {
    // x = 0 and x = a; a = 0 is the first value that is examined.
    let model = "[parameters]\na = 0.3\n[states]\nx = { equation = \"a*x - x^2\", range = [-2, 2] }\n";
    let study = "[[explore]]\nname = \"x\"\nfree = \"a\"\nrange = [-1, 1]\n";
    let (text, _) = run(model, study, "1e-6");
    assert!(text.contains("x: 2 branches and 0 curves"), "{text}");
    for branch in ["x/equilibrium-1", "x/equilibrium-1/branch-point-1"] {
        let here = points(&text, branch, "branch-point");
        assert!(here.len() == 1 && value(here[0], 2).abs() < 1e-8, "{text}");
    }
}

/// Both Hopf points are one equilibrium of two Brusselators and its image with the cells exchanged; l₁ as in the unit test
/// of the coefficient.
#[test]
fn hopf_points_that_are_images_of_each_other_are_both_followed() {
    let cell = |own: &str, other: &str| {
        format!(
            "x{own} = {{ equation = \"1 - (B + 1)*x{own} + x{own}^2*y{own} + 0.05*(x{other} - x{own})\", range = [0, 3] }}\n\
             y{own} = {{ equation = \"B*x{own} - x{own}^2*y{own} + 0.25*(y{other} - y{own})\", range = [0, 5] }}\n"
        )
    };
    let model = format!("[parameters]\nB = 3.35\n[states]\n{}{}", cell("1", "2"), cell("2", "1"));
    let study = "[[seed]]\nname = \"s\"\nstate = { x1 = 1, y1 = 3.2, x2 = 1, y2 = 3.2 }\nparameters = { B = 3.2 }\n\
                 [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"B\"\nrange = [3.1, 3.45]\n\
                 switch = { branch-point = 1, hopf = 1 }\n";
    for tolerance in ["1e-5", "1e-6"] {
        let (text, _) = run(&model, study, tolerance);
        let here = points(&text, "b/branch-point-1", "hopf");
        assert!(here.len() == 2 && here.iter().all(|line| line.contains("l1 = 4.76413")), "{text}");
        assert!(!text.contains("no bifurcating branch found"), "{text}");
    }
}

/// Relaxation oscillations of the Oregonator between two subcritical Hopf points. f = 0.512644490558 agrees at tolerances
/// from 1e-6 to 1e-9, with f of either sign.
#[test]
fn a_fold_of_canards_is_not_taken_for_a_family_at_one_parameter_value() {
    let model = "[parameters]\nf = 0.3\n[states]\nx = { equation = \"(8e-4*y - x*y + x*(1 - x))/0.04\", range = [0, 1] }\n\
                 y = { equation = \"(-8e-4*y - x*y + f*z)/4e-4\", range = [0, 2] }\n\
                 z = { equation = \"x - z\", range = [0, 1] }\n";
    let study = "[[seed]]\nname = \"s\"\nattractor = \"equilibrium\"\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"f\"\n\
                 range = [0.3, 3]\nswitch = { hopf = 1 }\n";
    let (text, code) = run(model, study, "1e-6");
    let folds: Vec<f64> = points(&text, "b/hopf-1", "fold").iter().map(|line| value(line, 2)).collect();
    assert!(code == 0 && folds.len() == 2 && (folds[0] - 0.512644490558).abs() < 1e-8, "{text}");
}

/// FitzHugh and Nagumo's equations are symmetric under v → -v, I → 1.75 - I, and with them their folds of cycles.
#[test]
fn a_mesh_that_no_longer_resolves_a_relaxation_oscillation_is_renewed() {
    let model = "[parameters]\nI = 0\n[states]\nv = { equation = \"(v - v^3/3 - w + I)/0.002\", range = [-2, 2] }\n\
                 w = { equation = \"v + 0.7 - 0.8*w\", range = [-1, 2] }\n";
    let study = "[[seed]]\nname = \"s\"\nattractor = \"equilibrium\"\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"I\"\n\
                 range = [0, 2]\nswitch = { hopf = 1 }\n";
    let (text, code) = run(model, study, "1e-4");
    let folds: Vec<f64> = points(&text, "b/hopf-1", "fold").iter().map(|line| value(line, 2)).collect();
    assert!(code == 0 && folds.len() == 2 && (folds[0] + folds[1] - 1.75).abs() < 1e-5, "{text}");
}

/// Two Brusselators coupled by diffusion (A = 1, 0.05 and 0.25): the cubic term of their pitchfork at B = 3.3 vanishes, and
/// along the side branch B - 3.3 grows with the fourth power of the difference between the cells.
#[test]
fn a_pitchfork_without_a_cubic_term_has_one_point_on_its_side_branch() {
    let model = "[parameters]\nB = 3.2\n[states]\n\
                 x1 = { equation = \"1 - (B + 1)*x1 + x1^2*y1 + 0.05*(x2 - x1)\", range = [0, 3] }\n\
                 y1 = { equation = \"B*x1 - x1^2*y1 + 0.25*(y2 - y1)\", range = [0, 5] }\n\
                 x2 = { equation = \"1 - (B + 1)*x2 + x2^2*y2 + 0.05*(x1 - x2)\", range = [0, 3] }\n\
                 y2 = { equation = \"B*x2 - x2^2*y2 + 0.25*(y1 - y2)\", range = [0, 5] }\n";
    for tolerance in ["1e-5", "1e-6", "1e-7"] {
        let study = followed("{ x1 = 1, y1 = 3.2, x2 = 1, y2 = 3.2 }", "B", "[3.1, 3.45]");
        let (text, code) = run(model, &study, tolerance);
        assert_eq!(code, 0, "{text}");
        let side = "b/branch-point-1";
        assert!(points(&text, side, "fold").is_empty() && points(&text, side, "branch-point").len() <= 1, "{text}");
        assert_eq!(points(&text, side, "hopf").len(), 2, "{text}");
    }
}

/// x ↦ x + (a + 0.003 x - x³)/5, y ↦ -(1 + 0.3 (x + 0.0003)) y has its folds where 3 x² = 0.003, at a = ±2 (0.001)^1.5, and a period
/// doubling at x = -0.0003; the same flow has them with a Hopf point in between.
#[test]
fn two_folds_with_another_point_between_them_are_found_on_one_step() {
    let map = "[states]\nx = { range = [-2, 2] }\ny = { range = [-2, 2] }\n[map]\n\
               x = \"x + 0.2*(a + 0.003*x - x^3) + 0.1*y^2\"\ny = \"-(1 + 0.3*(x + 0.0003))*y\"\n";
    let flow = "[states]\nx = { equation = \"a + 0.003*x - x^3\", range = [-2, 2] }\n\
                y = { equation = \"0.3*(x + 0.0003)*y - z\", range = [-1, 1] }\n\
                z = { equation = \"0.3*(x + 0.0003)*z + y\", range = [-1, 1] }\n";
    for (states, start, between) in
        [(map, "{ x = 1, y = 0 }", "period-doubling"), (flow, "{ x = 1, y = 0, z = 0 }", "hopf")]
    {
        let model = format!("[parameters]\na = 0.997\n{states}");
        let study = followed(start, "a", "[-1, 1]");
        let (text, code) = run(&model, &study, "1e-6");
        assert_eq!(code, 0, "{text}");
        let mut folds: Vec<f64> = points(&text, "b", "fold").iter().map(|line| value(line, 2)).collect();
        folds.sort_by(f64::total_cmp);
        let right = 2.0 * 0.001f64.powf(1.5);
        assert!(folds.len() == 2 && folds.iter().zip([-right, right]).all(|(a, b)| (a - b).abs() < 1e-9), "{text}");
        assert_eq!(points(&text, "b", between).len(), 1, "{text}");
    }
}

/// The torus points of a circle x² + y² = a whose normal directions u, v obey a linear equation have d = 0 everywhere.
#[test]
fn no_chenciner_point_is_read_from_the_rounding_of_a_coefficient_that_vanishes() {
    let model = "[parameters]\na = 0.25\nb = 0\n[definitions]\nR = \"x^2 + y^2\"\nh = \"0.3*(a - 0.5) + 0.2*b\"\n[states]\n\
                 x = { equation = \"x*(a - R) - y\", range = [-1.5, 1.5] }\n\
                 y = { equation = \"y*(a - R) + x\", range = [-1.5, 1.5] }\n\
                 u = { equation = \"h*u - 0.3*v + 0.1*u*x\", range = [-1, 1] }\n\
                 v = { equation = \"h*v + 0.3*u + 0.1*v*x\", range = [-1, 1] }\n";
    let study = "[[seed]]\nname = \"s\"\nstate = { x = 0.5, y = 0, u = 0, v = 0 }\n\
                 [[branch]]\nname = \"c\"\nfrom = \"s\"\nfree = \"a\"\nrange = [0.1, 2]\n\
                 [[curve]]\nname = \"C\"\nof = \"c\"\nhold = \"torus\"\nfree = \"b\"\nrange = [-1, 1]\n";
    for tolerance in ["1e-5", "1e-6", "1e-7", "1e-8"] {
        let (text, _) = run(model, study, tolerance);
        assert!(text.contains("\nC ") && points(&text, "C", "chenciner").is_empty(), "{text}");
    }
}

/// States of any size: the doublings of the logistic map at r = 3 and 1 + √6 do not depend on the unit of x.
#[test]
fn switching_at_period_doublings_does_not_depend_on_the_unit_of_a_state() {
    for unit in ["1", "1e-6", "1e-9", "1e6"] {
        let model = format!(
            "[parameters]\nr = 2.5\n[states]\nx = {{ range = [0, {unit}] }}\n[map]\nx = \"r*x*(1 - x/{unit})\"\n"
        );
        let study = "[[seed]]\nname = \"s\"\nattractor = \"fixed-point\"\n[[branch]]\nname = \"f\"\nfrom = \"s\"\nfree = \"r\"\n\
            range = [2.5, 3.5]\nswitch = { period-doubling = 1 }\n";
        let (text, code) = run(&model, study, "1e-6");
        let doublings: Vec<f64> = ["f", "f/period-doubling-1"]
            .iter()
            .flat_map(|branch| points(&text, branch, "period-doubling"))
            .map(|line| value(line, 2))
            .collect();
        assert_eq!(code, 0, "{text}");
        assert_eq!(doublings.len(), 2, "{unit}: {doublings:?}");
        assert!(
            (doublings[0] - 3.0).abs() < 1e-7 && (doublings[1] - 1.0 - 6f64.sqrt()).abs() < 1e-7,
            "{unit}: {doublings:?}"
        );
    }
}

/// A random cubic field whose curve of folds has a Bogdanov–Takens point next to a cusp, where the null vector turns quickly.
/// From there a Newton iteration on f = 0 and two vanishing coefficients of the characteristic polynomial leads to
/// (p, q) = (0.1029802999, -0.0989555757).
#[test]
fn a_bogdanov_takens_point_is_listed_once_where_the_null_vector_turns_quickly() {
    let model = r#"[parameters]
p = 0.0
q = 0.0
[states]
x0 = "(0.35+-0.58*p)*x0 + (-1.159+0.897*p)*x1 + (0.87+-0.748*p)*x2 + -0.331*p + -0.392*x0*x2 + -1.642*x1*x2 + -0.423*x0*x0*x0 + 1.434*x0*x0*x1 + 0.774*x0*x0*x2 + -0.798*x0*x1*x2 + -0.306*x1*x1*x2 + -0.567*x1*x2*x2 + -0.199*q*x0 + -0.144*q*x1 + 1.382*q*x2 + -2.256*q"
x1 = "(-0.733+1.382*p)*x0 + (0.514+0.588*p)*x1 + (0.25+0.671*p)*x2 + -0.392*p + -0.474*x0*x1 + 1.648*x0*x2 + 1.451*x1*x1 + 0.62*x1*x2 + -0.642*x0*x0*x1 + -0.5940000000000001*x0*x0*x2 + 0.648*x0*x1*x1 + 0.41400000000000003*x0*x1*x2 + 1.323*x0*x2*x2 + -1.0*x1*x1*x1 + 0.5489999999999999*x1*x1*x2 + -0.237*x1*x2*x2 + 1.599*q*x0 + -0.443*q*x1 + 1.58*q*x2 + -0.555*q"
x2 = "(0.392+0.423*p)*x0 + (-0.043+-0.551*p)*x1 + (-0.096+0.375*p)*x2 + -1.008*p + 1.376*x0*x0 + -0.644*x0*x1 + -0.03*x1*x1 + -0.098*x1*x2 + 1.02*x0*x0*x0 + 0.138*x0*x0*x1 + 2.604*x0*x1*x2 + -0.96*x1*x1*x2 + -1.0*x2*x2*x2 + 0.288*q*x0 + 0.187*q*x1 + -0.879*q*x2 + 0.132*q"
"#;
    let study = "[[seed]]\nname = \"o\"\nstate = \"zero\"\n[[branch]]\nname = \"e\"\nfrom = \"o\"\nfree = \"p\"\nrange = [-1, 1]\n\
        [[curve]]\nname = \"c\"\nof = \"e\"\nhold = \"fold\"\nnear = 0.6833890963418737\nfree = \"q\"\nrange = [-1, 1]\nbranch-range = [-2, 2]\n";
    let (text, _) = run(model, study, "1e-6");
    let there: Vec<[f64; 2]> = points(&text, "c", "bogdanov-takens")
        .iter()
        .map(|line| [value(line, 2), value(line, 3)])
        .filter(|[p, _]| (p - 0.103).abs() < 1e-3)
        .collect();
    assert_eq!(there.len(), 1, "{there:?}");
    assert!((there[0][0] - 0.1029802999).abs() < 1e-9 && (there[0][1] + 0.0989555757).abs() < 1e-9, "{there:?}");
}

/// Three decoupled modes: eigenvalues m, (1 + d) m - d, and m - 0.7 d ± i. At m = d/(2 + d) the first two are opposite, a neutral saddle,
/// 2·10⁻⁵ from the only Hopf point.
#[test]
fn a_neutral_saddle_beside_a_hopf_point_is_none() {
    for d in [1e-5, 1e-4, 1e-3] {
        let model = format!(
            "[parameters]\nm = -1\n[states]\nx = \"m*x - x^3\"\ny = \"(1 + {d})*m*y - {d}*y - y^3\"\n\
             z = \"(m - 0.7*{d})*z - w - z*(z^2 + w^2)\"\nw = \"(m - 0.7*{d})*w + z - w*(z^2 + w^2)\"\n"
        );
        let study = "[[seed]]\nname = \"s\"\nstate = \"zero\"\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"m\"\nrange = [-1, 1]\n";
        let (text, code) = run(&model, study, "1e-6");
        let hopf: Vec<f64> = points(&text, "b", "hopf").iter().map(|line| value(line, 2)).collect();
        assert!(matches!(hopf[..], [one] if (one - 0.7 * d).abs() < 1e-9), "{d}: {hopf:?}");
        assert!(points(&text, "b", "unexplained").is_empty() && code == 0, "{d}: {text}");
        assert_eq!(points(&text, "b", "branch-point").len(), 2, "{d}: {text}");
    }
}

/// Rest is unstable for |l - l0| < w. Branches begin a round number of steps from the Hopf points, so that steps and the places
/// at which they are examined end exactly on them.
#[test]
fn pairs_of_hopf_points_at_round_distances_are_found() {
    let hopf = |w: f64, l0: f64, far: f64| {
        let model = format!(
            "[parameters]\nl = -{far}\n[definitions]\ng = \"({w}^2 - (l - {l0})^2)/({w}^2 + (l - {l0})^2)\"\n\
             [states]\nx = {{ equation = \"g*x - y - x*(x^2 + y^2)\", range = [-2, 2] }}\n\
             y = {{ equation = \"g*y + x - y*(x^2 + y^2)\", range = [-2, 2] }}\n"
        );
        let (text, code) = run(&model, &followed("{ x = 0, y = 0 }", "l", &format!("[-{far}, {far}]")), "1e-6");
        assert_eq!(code, 0, "{text}");
        let found: Vec<f64> = points(&text, "b", "hopf").iter().map(|line| value(line, 2)).collect();
        assert!(
            found.len() == 2 && found.iter().all(|l| ((l - l0).abs() - w).abs() < 1e-7 * far),
            "{w} {l0} {far}: {text}"
        );
    };
    hopf(1.0, 0.0, 10.0);
    for l0 in [-0.4, -0.15, 0.0, 0.2, 0.45] {
        hopf(0.1, l0, 1.0);
        hopf(0.05, l0, 1.0);
    }
}

/// x = 0 is a cycle along which nothing but its multipliers changes: exp(0.6 π g), g as above.
#[test]
fn pairs_of_branch_points_along_a_straight_branch_of_cycles_are_found() {
    for (w, l0) in [(0.05, 0.0), (0.03, 0.1), (0.02, -0.3), (0.04, 0.45)] {
        let model = format!(
            "[parameters]\nl = -1\n[forcing]\nperiod = \"2*pi\"\n[definitions]\n\
             g = \"0.3*({w}^2 - (l - {l0})^2)/({w}^2 + (l - {l0})^2)\"\n\
             [states]\nx = {{ equation = \"g*x - x^3\", range = [-2, 2] }}\ny = {{ equation = \"-y + cos(t)\", range = [-2, 2] }}\n"
        );
        let study = "[[seed]]\nname = \"s\"\nstate = { x = 0, y = 0.5 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"l\"\n\
                     range = [-1, 1]\n";
        let (text, code) = run(&model, study, "1e-6");
        assert_eq!(code, 0, "{text}");
        let found: Vec<f64> = points(&text, "b", "branch-point").iter().map(|line| value(line, 2)).collect();
        assert!(found.len() == 2 && found.iter().all(|l| ((l - l0).abs() - w).abs() < 1e-6), "{w} {l0}: {text}");
    }
}

/// x = x₀(l) + 0.3 sin 2πt with l = X³ - X: a = ∓3 X₀ = ∓√3 at the folds, where no amplitude grows along the null vector.
#[test]
fn the_sign_of_a_null_vector_is_no_error_of_a_coefficient() {
    for mean in ["0", "3", "300"] {
        let model = format!(
            "[parameters]\nl = 0\n[forcing]\nperiod = 1\n[definitions]\nX = \"x - {mean} - 0.3*sin(2*pi*t)\"\n\
             [states]\nx = {{ equation = \"l - X^3 + X + 0.6*pi*cos(2*pi*t)\", range = [{mean} - 2, {mean} + 2] }}\n"
        );
        let mean: f64 = mean.parse().unwrap();
        let model = model.replace(&format!("[{mean} - 2, {mean} + 2]"), &format!("[{}, {}]", mean - 2.0, mean + 2.0));
        let study = format!(
            "[[seed]]\nname = \"s\"\nstate = {{ x = {} }}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"l\"\nrange = [-1, 1]\n",
            mean - 1.0
        );
        let (text, code) = run(&model, &study, "1e-6");
        assert_eq!(code, 0, "{text}");
        let folds = points(&text, "b", "fold");
        assert!(
            folds.len() == 2 && folds.iter().all(|line| line.contains("1.7320") || line.contains("1.7321")),
            "{text}"
        );
    }
}

/// The doubling of the logistic map lies exactly at the end of the range.
#[test]
fn a_range_may_end_on_a_special_point() {
    let logistic = "[parameters]\nr = 2.6\n[states]\nx = { range = [0, 1] }\n[map]\nx = \"r*x*(1 - x)\"\n";
    let (text, code) = run(logistic, &followed("{ x = 0.6 }", "r", "[2.5, 3]"), "1e-6");
    assert_eq!(code, 0, "{text}");
    assert!(!text.contains("unexplained"), "{text}");
}

/// l1 vanishes at q = 0.3 and 0.5, between points of the curve at ..., 0.1, 0.3, 0.5, 0.7.
#[test]
fn generalised_hopf_points_on_points_of_their_curve_are_found() {
    let model = "[parameters]\nl = -0.5\nq = -1\n[definitions]\nr2 = \"x^2 + y^2\"\nb = \"((q - 0.4)^2 - 0.01)/((q - 0.4)^2 + 0.01)\"\n\
                 g = \"l + b*r2 - r2^2\"\n[states]\nx = { equation = \"g*x - 1.3*y\", range = [-2, 2] }\n\
                 y = { equation = \"g*y + 1.3*x\", range = [-2, 2] }\n";
    let study = format!(
        "{}[[curve]]\nname = \"c\"\nof = \"b\"\nhold = \"hopf\"\nfree = \"q\"\nrange = [-1, 1]\n",
        "[[seed]]\nname = \"s\"\nstate = { x = 0, y = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"l\"\nrange = [-0.5, 0.5]\n"
    );
    let (text, code) = run(model, &study, "1e-6");
    assert_eq!(code, 0, "{text}");
    let found: Vec<f64> = points(&text, "c", "generalised-hopf").iter().map(|line| value(line, 3)).collect();
    assert!(found.len() == 2 && (found[0] - 0.3).abs() < 1e-9 && (found[1] - 0.5).abs() < 1e-9, "{text}");
}
