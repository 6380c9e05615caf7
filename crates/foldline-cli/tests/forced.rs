//! Forced models: the time `t` in the equations, cycles that last a given number of forcing periods, and their
//! stability.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Kind, Solution};
use foldline::explore::{self, System};
use foldline::verify;
use foldline_store::model_file::parse_model;
use foldline_store::study_file::parse_study;

const DUFFING: &str = include_str!("../../../models/duffing-forced.toml");
const VAN_DER_POL: &str = include_str!("../../../models/van-der-pol-forced.toml");
/// The linear oscillator x'' + 2 zeta x' + x = A cos(omega t), whose response is known in closed form.
const LINEAR: &str = "[parameters]\nomega = 0.8\nA = 0.5\nzeta = 0.05\n[forcing]\nfrequency = \"omega\"\n[states.x]\nequation = \
                      \"v\"\n[states.v]\nequation = \"-2*zeta*v - x + A*cos(omega*t)\"\n[outputs]\nsum = \"x + 3*A*cos(omega*t)\"\n";

#[track_caller]
fn run(model: &str, text: &str) -> Diagram {
    let text = format!("model = \"m\"\n{text}");
    let study = parse_study(&text, "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"));
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    // A second route to every number: shooting, with its own treatment of the forcing.
    let verified = verify::verify(&system, &diagram, study.plan.tolerance, None, &|_| true);
    let worse: Vec<_> = verified.wrong().collect();
    assert!(worse.is_empty() && verified.points > 20, "{} points: {worse:?}", verified.points);
    diagram
}

fn one_branch(seed: &str, branch: &str) -> String {
    format!("[[seed]]\nname = \"s\"\n{seed}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n{branch}\n")
}

#[track_caller]
fn has(branch: &Branch, expected: &[(Kind, f64)], error: f64) {
    let mut found: Vec<(Kind, f64)> =
        branch.special.iter().map(|s| (s.kind, s.point.parameters[branch.free])).collect();
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    let agree = found.len() == expected.len()
        && found.iter().zip(expected).all(|(a, b)| a.0 == b.0 && (a.1 - b.1).abs() < error * (1.0 + b.1.abs()));
    assert!(agree, "{}: {found:?}, expected {expected:?}", branch.name);
}

#[test]
fn a_linear_oscillator_responds_as_in_the_textbook() {
    let diagram = run(LINEAR, &one_branch("attractor = \"cycle\"\nsamples = 8", "free = \"omega\"\nrange = [0.3, 3]"));
    let branch = &diagram.branches[0];
    has(branch, &[], 0.0);
    for point in &branch.points {
        let [omega, a, zeta] = point.parameters[..] else { panic!("three parameters") };
        let Solution::Cycle(cycle) = &point.solution else { panic!("a forced system has no equilibria") };
        assert_eq!(cycle.forcing_periods, 1);
        let period = std::f64::consts::TAU / omega;
        assert!((cycle.period - period).abs() < 1e-12 * period);
        let [re, im] = [1.0 - omega * omega, 2.0 * zeta * omega];
        let amplitude = a / re.hypot(im);
        let error = point.trust.discretisation * (1.0 + amplitude);
        assert!((point.ranges[0][1] - amplitude).abs() < error, "{omega}: {:?} {amplitude}", point.ranges);
        // x(0) is the component in phase with the force, and the output sees the same time as the equations.
        assert!((cycle.state(0.0)[0] - a * re / (re * re + im * im)).abs() < error);
        let sum = (re / (re * re + im * im) + 3.0).hypot(im / (re * re + im * im)) * a;
        assert!((point.ranges[2][1] - sum).abs() < error, "{omega}: {:?} {sum}", point.ranges);
        // Both multipliers have modulus exp(-zeta T), and the argument of the damped oscillation.
        assert_eq!((point.spectrum.len(), point.unstable), (2, 0));
        for z in &point.spectrum {
            let angle = (period * (1.0 - zeta * zeta).sqrt()).cos();
            assert!((z.norm() - (-zeta * period).exp()).abs() < point.trust.spectrum, "{z}");
            assert!((z.re / z.norm() - angle).abs() < 2.0 * point.trust.spectrum, "{z} {angle}");
        }
    }
}

/// Folds and cusp from two other codes, which agree to 2e-9.
#[test]
fn the_duffing_resonance_has_its_folds_and_their_curve_its_cusp() {
    let strong = "[[seed]]\nname = \"strong seed\"\nattractor = \"cycle\"\nparameters = { omega = 0.8, A = 0.06 }\nsamples = 16\n\
                  [[branch]]\nname = \"strong\"\nfrom = \"strong seed\"\nfree = \"omega\"\nrange = [0.5, 2]\n";
    let weak = one_branch(
        "attractor = \"cycle\"\nparameters = { omega = 0.8, A = 0.015 }\nsamples = 16",
        "free = \"omega\"\nrange = [0.5, 2]",
    );
    let curve = "[[curve]]\nname = \"folds\"\nhold = \"fold\"\nof = \"b\"\nfree = \"A\"\nrange = [0.001, 0.2]\n";
    let diagram = run(DUFFING, &format!("{weak}{strong}{curve}"));
    let of = |name: &str| diagram.branch(name).unwrap_or_else(|| panic!("no branch {name}"));
    has(of("b"), &[(Kind::Fold, 1.0439137088), (Kind::Fold, 1.0492623992)], 3e-9);
    has(of("strong"), &[(Kind::Fold, 1.1214097673), (Kind::Fold, 1.3786856804)], 3e-9);
    let folds = of("folds");
    let [cusp] = &folds.special[..] else { panic!("{:?}", folds.special.len()) };
    let [omega, a, _] = cusp.point.parameters[..] else { panic!("three parameters") };
    assert!((omega - 1.0351991393).abs() < 5e-9 && (a - 0.0120510724).abs() < 5e-9, "{omega} {a}");
    // Both sides of the cusp on the curve pass the folds of the strong branch.
    for fold in &of("strong").special {
        let [omega, a, _] = fold.point.parameters[..] else { panic!("three parameters") };
        let passes = folds.points.windows(2).any(|pair| {
            let [p, q] = [0, 1].map(|k| &pair[k].parameters);
            let share = (a - p[1]) / (q[1] - p[1]);
            (0.0..=1.0).contains(&share) && (p[0] + share * (q[0] - p[0]) - omega).abs() < 2e-3
        });
        assert!(passes, "the curve misses the fold at omega = {omega}");
    }
}

/// Another continuation code, to the digits given.
#[test]
fn a_forced_van_der_pol_oscillator_loses_entrainment_at_a_fold_or_a_torus() {
    let text = |frequency: f64| {
        one_branch(
            &format!("attractor = \"cycle\"\nparameters = {{ s = 1, Omega = {frequency} }}\nsamples = 16"),
            "free = \"s\"\nrange = [0.3, 2]",
        )
    };
    let folds = run(VAN_DER_POL, &text(1.1));
    has(&folds.branches[0], &[(Kind::Fold, 0.45378911055), (Kind::Fold, 0.49860584807)], 2e-9);
    let torus = run(VAN_DER_POL, &text(1.2));
    has(&torus.branches[0], &[(Kind::Torus, 0.76153714404)], 2e-8);
}

/// A softening spring under a force, as for a ship that rolls in waves: the cycle doubles its period, and so does the
/// doubled one.
#[test]
fn forced_cycles_double_their_period_and_last_whole_forcing_periods() {
    let model = "[parameters]\nA = 0.1\nomega = 0.85\nzeta = 0.05\n[forcing]\nperiod = \"2*pi/omega\"\n[states.x]\nequation = \
                 \"v\"\nrange = [-0.5, 0.5]\n[states.v]\nequation = \"-2*zeta*v - x + x^2 + A*sin(omega*t)\"\nrange = [-0.5, 0.5]\n";
    let diagram = run(
        model,
        &one_branch(
            "attractor = \"cycle\"\nsamples = 16",
            "free = \"A\"\nrange = [0.05, 0.2]\nswitch = { period-doubling = 2 }",
        ),
    );
    let names: Vec<&str> = diagram.branches.iter().map(|b| b.name.as_str()).collect();
    for (name, periods) in [("b", 1), ("b/period-doubling-1", 2), ("b/period-doubling-1/period-doubling-1", 4)] {
        let branch = diagram.branch(name).unwrap_or_else(|| panic!("{name} is not among {names:?}"));
        for point in &branch.points {
            let Solution::Cycle(cycle) = &point.solution else { panic!("a forced system has no equilibria") };
            assert_eq!(cycle.forcing_periods, periods);
            let forcing = std::f64::consts::TAU / point.parameters[1];
            assert!((cycle.period - f64::from(periods) * forcing).abs() < 1e-10);
        }
        assert!(branch.special.iter().any(|s| s.kind == Kind::PeriodDoubling), "{name}: {:?}", branch.ends);
    }
}

#[test]
fn mistakes_in_a_forcing_are_reported_in_place() {
    let told = |forcing: &str, equation: &str| {
        let text = format!("[parameters]\nw = 2.0\n{forcing}\n[states.x]\nequation = \"{equation}\"\n");
        let found = parse_model(&text, "m.toml").expect_err("the model is wrong");
        found.iter().map(|d| d.to_string()).collect::<Vec<_>>().join("\n")
    };
    for (forcing, equation, expected) in [
        ("", "-x + cos(w*t)", "[forcing]"),
        (
            "[forcing]\nfrequency = \"w\"",
            "-x + cos(1.5*w*t)",
            "the equation of `x` does not have the forcing period 3.14159",
        ),
        (
            "[forcing]\nfrequency = \"w\"\n[outputs]\no = \"x*cos(w*t/2)\"",
            "-x + cos(w*t)",
            "the output `o` does not have the forcing period 3.14159",
        ),
        ("[forcing]\nfrequency = \"x\"", "-x + cos(w*t)", "the forcing depends on `x`, which is a state"),
        ("[forcing]\nfrequency = \"t\"", "-x + cos(w*t)", "the forcing depends on `t`, which is the time"),
        ("[forcing]\nperiod = \"-w\"", "-x + cos(w*t)", "the period of the forcing is -2"),
        ("[forcing]\nfrequency = \"w\"\nperiod = \"w\"", "-x", "both a frequency and a period"),
        ("[forcing]", "-x", "no frequency and no period"),
        ("[forcing]\nfrequenzy = \"w\"", "-x", "did you mean `frequency`"),
        ("[forcing]\nfrequency = \"w\"", "-x + cos(w*time)", "the time is `t`"),
        (
            "[forcing]\nfrequency = \"w\"\n[definitions]\nt = \"1\"",
            "-x",
            "`t` is the time, since the model has a forcing",
        ),
    ] {
        let found = told(forcing, equation);
        // Each mistake is reported once.
        assert_eq!(found.matches("error").count(), 1, "{forcing} {equation}:\n{found}");
        assert!(found.contains(expected), "{forcing} {equation}:\n{found}");
    }
}

/// Two frequencies that agree at the default parameter values agree nowhere else.
#[test]
fn a_branch_along_which_the_forcing_is_not_periodic_is_refused() {
    let model = "[parameters]\nomega = 0.8\nw2 = 0.8\nA = 0.1\n[forcing]\nfrequency = \"omega\"\n[states.x]\nequation = \
                 \"-x + A*cos(omega*t) + A*sin(w2*t)\"\n";
    for (free, range, code) in
        [("omega", "[0.5, 1]", "no-start"), ("w2", "[0.5, 1]", "no-start"), ("A", "[0, 1]", "bound")]
    {
        let text = one_branch("attractor = \"cycle\"\nsamples = 8", &format!("free = \"{free}\"\nrange = {range}"));
        let study = parse_study(&format!("model = \"m\"\n{text}"), "study", model, "model").unwrap();
        let system = System::of_plan(&study.model, &study.plan);
        let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
        let end = diagram.branches[0].ends[1].as_ref().unwrap();
        assert_eq!(end.code(), code, "{free}: {end}");
        assert!(code == "bound" || end.to_string().contains("does not have the forcing period"), "{end}");
    }
    // A frequency that changes sign within the range has no period there.
    let model = "[parameters]\nomega = 0.8\nA = 0.1\n[forcing]\nfrequency = \"omega\"\n[states.x]\nequation = \"-x + A*cos(omega*t)\"\n";
    let text = one_branch("attractor = \"cycle\"\nsamples = 8", "free = \"omega\"\nrange = [-0.5, 1]");
    let study = parse_study(&format!("model = \"m\"\n{text}"), "study", model, "model").unwrap();
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    let branch = &diagram.branches[0];
    assert!(branch.points.iter().all(|p| p.parameters[0] > 0.0), "{:?}", branch.ends);
    assert!(!branch.ends[0].as_ref().unwrap().complete() && branch.special.is_empty());
}

/// The rest state of a parametrically forced oscillator is approached by slow oscillations. It is a cycle of one
/// forcing period and loses stability by period doubling. Damped Mathieu equation: near eps = 4 zeta, here with the
/// next terms from shooting.
#[test]
fn the_rest_state_under_parametric_forcing_doubles_its_period() {
    let model = "[parameters]\nomega = 2\neps = 0\nzeta = 0.02\n[forcing]\nfrequency = \"omega\"\n[states.x]\nequation = \
                 \"v\"\n[states.v]\nequation = \"-2*zeta*v - (1 + eps*cos(omega*t))*x - x^3\"\n";
    let text = one_branch("attractor = \"cycle\"\nsamples = 8", "free = \"eps\"\nrange = [0, 0.2]");
    let study = parse_study(&format!("model = \"m\"\n{text}"), "study", model, "model").unwrap();
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    let branch = &diagram.branches[0];
    let [special] = &branch.special[..] else { panic!("{:?} {:?}", branch.special.len(), branch.ends) };
    assert_eq!((special.kind, special.point.solution.forcing_periods()), (Kind::PeriodDoubling, 1));
    assert!((special.point.parameters[1] - 0.08).abs() < 1e-4, "{:?}", special.point.parameters);
}

/// At ω = 5, A = 10 most samples of the hardening oscillator follow the forcing, and a few oscillate once in three
/// forcing periods.
#[test]
fn a_cycle_of_a_stated_number_of_forcing_periods_is_found() {
    let seed = "attractor = \"cycle\"\nperiods = 3\nparameters = { A = 10, omega = 5 }\nsamples = 64";
    let diagram = run(DUFFING, &one_branch(seed, "free = \"omega\"\nrange = [3.5, 8]"));
    for point in &diagram.branches[0].points {
        let Solution::Cycle(cycle) = &point.solution else { panic!("a forced model has cycles only") };
        let expected = 3.0 * std::f64::consts::TAU / point.parameters[diagram.branches[0].free];
        assert!(cycle.forcing_periods == 3 && (cycle.period - expected).abs() < 1e-10);
    }
    let refused = |model: &str, seed: &str| {
        let text = format!("model = \"m\"\n{}", one_branch(seed, "free = \"omega\"\nrange = [4.5, 5.5]"));
        let found = parse_study(&text, "study", model, "model").expect_err("the study is wrong");
        found.iter().map(|d| d.to_string()).collect::<Vec<_>>().join("\n")
    };
    let free = "[parameters]\nomega = 5.0\n[states]\nx = \"omega - x\"\n";
    let said = refused(free, "attractor = \"cycle\"\nperiods = 3");
    assert!(said.contains("no forcing, so no forcing periods"), "{said}");
    let said = refused(DUFFING, "state = { x = 0, v = 0 }\nperiods = 3");
    assert!(said.contains("goes with `attractor = \"cycle\"`"), "{said}");
}
