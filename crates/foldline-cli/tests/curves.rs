//! Two-parameter curves: against closed forms, and through the special points of one-parameter runs.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind, Point};
use foldline::explore::{CurvePlan, System, run};
use foldline::special::normal_form::Local;
use foldline_store::study_file::{Study, parse_study};

const ROTOR: &str = include_str!("../../../models/overhung-rotor.toml");
/// Default tolerance of a study.
const TOLERANCE: f64 = 1e-6;

fn study(model: &str, rest: &str) -> Study {
    parse_study(&format!("model = \"m\"\n{rest}"), "study", model, "model")
        .unwrap_or_else(|found| panic!("{}", found[0]))
}

/// Adds a curve to the study and runs it: kind of the point continued on branch "b", the parameter value it is close
/// to, and the second parameter.
fn with_curve(mut study: Study, hold: Kind, near: f64, second: &str, range: [f64; 2], until: Option<f64>) -> Diagram {
    let curve = CurvePlan {
        name: "curve".into(),
        hold,
        of: "b".into(),
        near: Some(near),
        to: None,
        further: Vec::new(),
        free: study.model.parameter_index(second).unwrap(),
        ranges: [study.plan.branches[0].range, range],
        until,
        marks: Vec::new(),
        max_points: 500,
    };
    study.plan.curves.push(curve);
    grown(&study)
}

fn grown(study: &Study) -> Diagram {
    run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved)
}

fn complete(branch: &Branch) {
    for end in &branch.ends {
        assert!(end.as_ref().is_some_and(|e| e.complete()), "{}: {end:?}", branch.name);
    }
}

/// Asserts that every point of the curve satisfies `defect` = 0, a function of the branch's parameter and the second
/// one, to the tolerance.
fn satisfies(diagram: &Diagram, points: usize, defect: impl Fn(f64, f64) -> f64) {
    let curve = diagram.branch("curve").unwrap();
    complete(curve);
    assert!(curve.points.len() >= points, "{} points", curve.points.len());
    let (_, first) = curve.held.unwrap();
    for point in &curve.points {
        let at = (point.parameters[first], point.parameters[curve.free]);
        assert!(defect(at.0, at.1).abs() < TOLERANCE, "{at:?}: {:.1e}", defect(at.0, at.1));
    }
}

#[test]
fn a_curve_of_folds_of_equilibria_passes_the_cusp() {
    let model = "name = \"Cusp\"\n[parameters]\nmu = -1\nlambda = 1\n[states]\nx = \"mu + lambda*x - x^3\"\n";
    let branch = "[[seed]]\nname = \"s\"\nstate = { x = -1.3247 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"mu\"\nrange = [-2, 2]\n";
    let diagram = with_curve(study(model, branch), Kind::Fold, 0.4, "lambda", [-1.0, 2.0], None);
    satisfies(&diagram, 10, |mu, lambda| 27.0 * mu * mu - 4.0 * lambda.powi(3));
    // Both sides of the cusp belong to the same curve, which turns back in lambda at the cusp.
    let curve = diagram.branch("curve").unwrap();
    let [only] = &curve.special[..] else { panic!("{:?}", curve.special.len()) };
    // x' = mu + lambda x - x³ is its own normal form, and its quadratic terms vanish there.
    assert!(only.kind == Kind::Cusp && (only.coefficients[0] + 1.0).abs() < 1e-6, "{}", only.normal_form());
    let cusp = &only.point.parameters;
    assert!(cusp[0].abs() < TOLERANCE && cusp[1].abs() < TOLERANCE, "{cusp:?}");
    let mu = |p: Option<&Point>| p.unwrap().parameters[0];
    assert!(mu(curve.points.first()) * mu(curve.points.last()) < 0.0);
}

/// Asserts the special points on the curve, by increasing second parameter; a closed curve is followed once.
fn lies_on(diagram: &Diagram, expected: &[(Kind, f64, f64)]) {
    let curve = diagram.branch("curve").unwrap();
    complete(curve);
    let (_, first) = curve.held.unwrap();
    let of = |s: &foldline::diagram::SpecialPoint| {
        (s.kind, s.point.parameters[first], s.point.parameters[curve.free], s.error)
    };
    let mut found: Vec<(Kind, f64, f64, f64)> = curve.special.iter().map(of).collect();
    found.sort_by(|a, b| a.2.total_cmp(&b.2));
    let agree = found.iter().zip(expected).all(|(own, known)| {
        let error = 1e-8_f64.max(own.3);
        own.0 == known.0 && (own.1 - known.1).abs() < error && (own.2 - known.2).abs() < error
    });
    assert!(agree && found.len() == expected.len(), "{found:?}");
}

/// Published values; all from Newton's method on the defining equations.
#[test]
fn curves_of_co_oxidation_have_the_published_codimension_two_points() {
    use Kind::{BogdanovTakens, Cusp, Fold, GeneralisedHopf, Hopf};
    let model = include_str!("../../../models/co-oxidation.toml");
    let branch = "[[seed]]\nname = \"s\"\nattractor = \"equilibrium\"\nparameters = { q2 = 0.9 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"q2\"\nrange = [0.5, 3]\n";
    let takens = [(1.1611987088, 0.7223390725), (1.4176276376, 0.9713975735)];
    let folds = with_curve(study(model, branch), Fold, 1.05, "k", [0.0, 2.0], None);
    let [a, b] = takens.map(|(q, k)| (BogdanovTakens, q, k));
    lies_on(&folds, &[(Cusp, 1.0064083297, 0.3559912732), a, b]);
    // From either Hopf point the curve ends on the fold curve at both sides, with a turn in k on the way.
    for near in [1.04, 1.06] {
        let hopf = with_curve(study(model, branch), Hopf, near, "k", [0.0, 2.0], None);
        let curve = hopf.branch("curve").unwrap();
        let turn = curve.special.iter().find(|s| s.kind == Fold).unwrap();
        let generalised =
            [(0.8913189808, 0.2324873542), (0.9242550152, 0.3058792675)].map(|(q, k)| (GeneralisedHopf, q, k));
        let turn = (Fold, turn.point.parameters[1], turn.point.parameters[6]);
        lies_on(&hopf, &[turn, generalised[0], generalised[1], a, b]);
        // The curve turns in k at its lowest point, which its own points surround.
        let lowest = curve.points.iter().map(|p| p.parameters[6]).fold(f64::INFINITY, f64::min);
        assert!(turn.2 <= lowest + 1e-9 && lowest - turn.2 < 1e-2, "{} {lowest}", turn.2);
        // Between the two generalised Hopf points the first Lyapunov coefficient has the other sign.
        let model = study(model, branch).model;
        let first = |p: &Point| Local::new(&model, p).unwrap().hopf(p.spectrum[0].im.abs()).unwrap();
        let signs: Vec<bool> = curve.points[1..curve.points.len() - 1].iter().map(|p| first(p) > 0.0).collect();
        assert_eq!(signs.windows(2).filter(|pair| pair[0] != pair[1]).count(), 2, "{signs:?}");
        for end in &curve.ends {
            assert_eq!(end.as_ref().unwrap().code(), "joined");
        }
    }
}

#[test]
fn folds_of_the_a_to_b_reaction_have_a_cusp_and_meet_the_hopf_curve() {
    let model = include_str!("../../../models/ab-reaction.toml");
    let branch = "[[seed]]\nname = \"s\"\nattractor = \"equilibrium\"\nparameters = { p1 = 0.05 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p1\"\nrange = [0.05, 1]\n";
    let folds = with_curve(study(model, branch), Kind::Fold, 0.1, "p3", [1.5, 6.0], None);
    let hopf = with_curve(study(model, branch), Kind::Hopf, 0.13, "p3", [1.5, 6.0], None);
    let takens = |diagram: &Diagram| -> Vec<f64> {
        let all = &diagram.branch("curve").unwrap().special;
        let found: Vec<_> = all.iter().filter(|s| s.kind == Kind::BogdanovTakens).collect();
        assert_eq!(found.len(), 1, "{:?}", all.iter().map(|s| s.kind).collect::<Vec<_>>());
        [&found[0].point.parameters[..], &found[0].coefficients].concat()
    };
    // The two curves have different defining systems, and meet at one point with one normal form.
    let (one, other) = (takens(&folds), takens(&hopf));
    assert!(
        one.iter().zip(&other).all(|(a, b)| (a.abs() - b.abs()).abs() < 1e-6 * (1.0 + a.abs())),
        "{one:?} {other:?}"
    );
    // Closed form: p₃ = 5/2, p₁ = e⁻².
    let cusp = folds.branch("curve").unwrap().special.iter().find(|s| s.kind == Kind::Cusp).unwrap();
    let [p1, _, p3] = cusp.point.parameters[..] else { panic!("three parameters") };
    assert!((p1 - (-2f64).exp()).abs() < 1e-8 && (p3 - 2.5).abs() < 1e-8, "{p1} {p3}");
}

/// x' = beta + x² + s (y² + z²), with a pair of frequency 1 that grows like mu + c x: the zero-Hopf normal form, whose
/// curves of folds (beta = 0) and Hopf points (beta = -mu²) touch at the origin.
#[test]
fn folds_and_hopf_points_meet_at_a_zero_hopf_point() {
    let model = "[parameters]\nbeta = -0.5\nmu = -0.3\n[states]\nx = \"beta + x^2 - y^2 - z^2\"\ny = \"(mu + x)*y - z\"\nz = \"y + (mu + x)*z\"\n";
    let branch = "[[seed]]\nname = \"s\"\nstate = { x = -0.70711, y = 0, z = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"beta\"\nrange = [-2, 1]\n";
    let folds = with_curve(study(model, branch), Kind::Fold, 0.0, "mu", [-1.0, 1.0], None);
    lies_on(&folds, &[(Kind::ZeroHopf, 0.0, 0.0)]);
    let hopf = with_curve(study(model, branch), Kind::Hopf, -0.09, "mu", [-1.0, 1.0], None);
    satisfies(&hopf, 5, |beta, mu| beta + mu * mu);
    let kinds: Vec<Kind> = hopf.branch("curve").unwrap().special.iter().map(|s| s.kind).collect();
    assert_eq!(kinds, [Kind::ZeroHopf]);
}

/// r' = r (mu + nu r² - r⁴): folds of cycles at mu = -nu²/4, r² = nu/2, up to the generalised Hopf point at the origin.
/// The period varies with the radius, or is stationary at all folds, or at one of them.
#[test]
fn folds_of_cycles_end_at_a_generalised_hopf_point() {
    for turn in ["1 + square", "1", "1 + (square - 0.25)^2"] {
        let model = format!(
            "[parameters]\nmu = -1\nnu = 1\n[definitions]\nsquare = \"x^2 + y^2\"\ngrowth = \"mu + nu*square - square^2\"\nturn = \"{turn}\"\n\
             [states]\nx = \"growth*x - turn*y\"\ny = \"turn*x + growth*y\"\n"
        );
        let text = "[[seed]]\nname = \"s\"\nstate = { x = 0, y = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"mu\"\nrange = [-1, 1]\nswitch = { hopf = 1 }\n\
                    [[curve]]\nname = \"curve\"\nhold = \"fold\"\nof = \"b/hopf-1\"\nfree = \"nu\"\nrange = [-1, 1.2]\n";
        let diagram = grown(&study(&model, text));
        satisfies(&diagram, 5, |mu, nu| mu + nu * nu / 4.0);
        let curve = diagram.branch("curve").unwrap();
        assert!(curve.special.is_empty(), "{turn}: {:?}", curve.special.iter().map(|s| s.kind).collect::<Vec<_>>());
        let joined = curve.ends.iter().flatten().find_map(|end| match end {
            Ending::Joined { at, parameter } => Some((*at, *parameter)),
            _ => None,
        });
        assert!(
            joined.is_some_and(|(at, nu)| at == Kind::GeneralisedHopf && nu.abs() < TOLERANCE),
            "{turn}: {:?}",
            curve.ends
        );
    }
}

/// Two oscillators, each with a growth rate that depends on both parameters.
#[test]
fn two_curves_of_hopf_points_cross_at_a_double_hopf_point() {
    let model = "[parameters]\np = -1\nq = -0.4\n[states]\na = \"(p + q)*a - b - a*(a^2 + b^2)\"\nb = \"a + (p + q)*b\"\nc = \"(p - q + 0.1*a)*c - 2.3*d\"\nd = \"2.3*c + (p - q)*d - d*c^2\"\n";
    let branch = "[[seed]]\nname = \"s\"\nstate = { a = 0, b = 0, c = 0, d = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p\"\nrange = [-2, 2]\n";
    for (near, slope) in [(0.4, -1.0), (-0.4, 1.0)] {
        let hopf = with_curve(study(model, branch), Kind::Hopf, near, "q", [-1.0, 1.0], None);
        satisfies(&hopf, 4, |p, q| p - slope * q);
        lies_on(&hopf, &[(Kind::DoubleHopf, 0.0, 0.0)]);
        // r' = -r³/8 for c and d, which are faster, and -r³/2 for a and b; r² = 2 |w|². The coupling of a into c
        // averages out.
        let double = &hopf.branch("curve").unwrap().special[0];
        let expected = [-0.25, 0.0, 0.0, -1.0, 0.0, 0.0];
        let off = double.coefficients.iter().zip(expected).map(|(own, known)| (own - known).abs());
        assert!(double.coefficients.len() == 6 && off.fold(0.0, f64::max) < 1e-7, "{}", double.normal_form());
        assert!(double.normal_form().ends_with("simple"));
    }
}

#[test]
fn hopf_points_of_the_brusselator_lie_on_a_parabola() {
    let model = include_str!("../../../models/brusselator.toml");
    let branch = "[[seed]]\nname = \"s\"\nstate = { x = 1, y = 1 }\nparameters = { A = 1, B = 1 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"B\"\nrange = [0.5, 12]\n";
    let diagram = with_curve(study(model, branch), Kind::Hopf, 2.0, "A", [0.3, 3.0], None);
    satisfies(&diagram, 5, |b, a| b - 1.0 - a * a);
}

#[test]
fn torus_points_of_the_langford_system_lie_on_a_line() {
    let model = "name = \"Langford\"\n[parameters]\nlambda = 0.5\na = 0.6\n[states]\nx = \"(z - 0.7)*x - 3.5*y\"\ny = \"3.5*x + (z - 0.7)*y\"\nz = \"a + lambda*z - z^3/3 - (x^2 + y^2)*(1 + 0.25*z)\"\n";
    let branch = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"lambda\"\nrange = [0.1, 1.5]\n";
    let diagram = with_curve(study(model, branch), Kind::Torus, 0.7, "a", [0.3, 1.2], None);
    // As for the torus point in the tests of classical problems, with a in place of 0.6.
    let z: f64 = 0.7;
    let share = 1.0 + 0.25 * z;
    let rest = 1.0 - 0.25 * z / share;
    satisfies(&diagram, 4, |lambda, a| lambda * rest - z * z - 0.25 * (a - z.powi(3) / 3.0) / share);
}

#[test]
fn the_fold_of_the_single_loop_leads_from_the_cubic_spring_to_contact() {
    let branch = "[[seed]]\nname = \"s\"\nattractor = \"2:1\"\nparameters = { Omega = 5, kappa = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [0.5, 12]\n";
    let mut cubic = study(ROTOR, branch);
    let flow = with_curve(cubic.clone(), Kind::Fold, 3.4, "kappa", [0.0, 1.0], Some(1.0));
    let curve = flow.branch("curve").unwrap();
    complete(curve);
    // The curve begins at the fold of the run in Omega and ends at that of the contact branch.
    let fold = |diagram: &Diagram| {
        let special = &diagram.branch("b").unwrap().special;
        special.iter().filter(|s| s.kind == Kind::Fold).map(|s| s.point.parameters[0]).reduce(f64::min).unwrap()
    };
    assert!((curve.points[0].parameters[0] - fold(&flow)).abs() < TOLERANCE);
    let arrived = curve.points.last().unwrap();
    assert_eq!(arrived.parameters[1], 1.0);
    cubic.plan.seeds[0].parameters[1] = 1.0;
    let contact = grown(&cubic);
    let gap = arrived.parameters[0] - fold(&contact);
    assert!(gap.abs() < TOLERANCE, "{gap:.1e}");
    assert!(curve.points.iter().all(|p| p.trust.discretisation < TOLERANCE));
}

/// The two cusps lie 4e-4 apart in speed, and at the second one the curve turns within 1e-4 of its length. Its two
/// sides are so close there that steps used to jump from one to the other, or turn back.
#[test]
fn the_fold_of_the_double_loop_passes_two_narrow_cusps() {
    let branch = "[[seed]]\nname = \"s\"\nattractor = \"3:1\"\nparameters = { Omega = 5, kappa = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [0.5, 12]\n";
    for tolerance in [1e-4, 1e-5, 2e-6] {
        let study = study(ROTOR, &format!("tolerance = {tolerance:e}\n{branch}"));
        let flow = with_curve(study, Kind::Fold, 2.8, "kappa", [0.0, 1.0], Some(1.0));
        let curve = flow.branch("curve").unwrap();
        complete(curve);
        assert_eq!(curve.points.last().unwrap().parameters[1], 1.0, "at {tolerance:e}");
        let found: Vec<Kind> = curve.special.iter().map(|s| s.kind).collect();
        assert_eq!(found, [Kind::Cusp; 2], "at {tolerance:e}");
        // Values of a run at a tolerance of 1e-7; parameters at a cusp are more accurate than its cycle.
        for (special, expected) in curve.special.iter().zip([[2.763550064, 0.739588323], [2.763881635, 0.539289978]]) {
            for (value, expected) in special.point.parameters.iter().zip(expected) {
                assert!((value - expected).abs() < tolerance + 1e-8, "{value} at {tolerance:e}, not {expected}");
            }
        }
    }
}

#[test]
fn a_curve_of_period_doublings_passes_those_of_runs_at_other_damping() {
    let at = |zeta: f64| {
        format!(
            "[[seed]]\nname = \"s\"\nattractor = \"2:1\"\nsamples = 48\nparameters = {{ Omega = 5, kappa = 1, zeta = {zeta} }}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [3, 6]\n"
        )
    };
    let flow = with_curve(study(ROTOR, &at(0.01)), Kind::PeriodDoubling, 3.4, "zeta", [1e-3, 0.011], Some(0.011));
    let arrived = flow.branch("curve").unwrap().points.last().unwrap();
    complete(flow.branch("curve").unwrap());
    assert_eq!(arrived.parameters[2], 0.011);
    let other = grown(&study(ROTOR, &at(0.011)));
    let gaps = other.branch("b").unwrap().special.iter().filter(|s| s.kind == Kind::PeriodDoubling);
    let gap = gaps.map(|s| (s.point.parameters[0] - arrived.parameters[0]).abs()).fold(f64::INFINITY, f64::min);
    assert!(gap < TOLERANCE, "{gap:.1e} from {:?}", arrived.parameters);
}

/// Uncoupled blocks, forced with the period 3: one that doubles its period where its rate vanishes, one with a
/// torus where its rate does, one with a fold at q = 0. The cycle is zero otherwise.
fn forced(blocks: &[(&str, &str)]) -> String {
    let mut text = String::from(
        "[parameters]\np = -0.4\nq = -0.3\n[forcing]\nperiod = \"3\"\n[definitions]\ncos1 = \"cos(2*pi*t/3)\"\nsin1 = \"sin(2*pi*t/3)\"\n",
    );
    let mut states = String::from("[states]\n");
    for (k, (block, rate)) in blocks.iter().enumerate() {
        match *block {
            "flip" => {
                text += &format!(
                    "square{k} = \"(u{k}^2 + v{k}^2)/2 + ((u{k}^2 - v{k}^2)*cos1 + 2*u{k}*v{k}*sin1)/2\"\nrate{k} = \"{rate}\"\n\
                     along{k} = \"(u{k} + u{k}*cos1 + v{k}*sin1)/2\"\nacross{k} = \"(v{k} + u{k}*sin1 - v{k}*cos1)/2\"\n"
                );
                states += &format!(
                    "u{k} = \"-pi/3*v{k} + rate{k}*along{k} - (u{k} - along{k})\"\nv{k} = \"pi/3*u{k} + rate{k}*across{k} - (v{k} - across{k})\"\n"
                );
            }
            "torus" => {
                text += &format!("square{k} = \"u{k}^2 + v{k}^2\"\nrate{k} = \"{rate}\"\n");
                let turn = 0.31 + 0.23 * k as f64;
                states += &format!("u{k} = \"rate{k}*u{k} - {turn}*v{k}\"\nv{k} = \"rate{k}*v{k} + {turn}*u{k}\"\n");
            }
            _ => states += &format!("h{k} = \"{rate} + h{k}^2\"\n"),
        }
    }
    text + &states
}

#[test]
fn curves_of_cycle_bifurcations_have_their_codimension_two_points() {
    use Kind::{
        Chenciner, DoubleTorus, FlipTorus, FoldFlip, FoldTorus, GeneralisedPeriodDoubling, PeriodDoubling, Torus,
    };
    let cases = [
        (vec![("flip", "p + q*square0")], PeriodDoubling, GeneralisedPeriodDoubling),
        (vec![("torus", "p + q*square0")], Torus, Chenciner),
        (vec![("flip", "p - square0"), ("fold", "q")], PeriodDoubling, FoldFlip),
        (vec![("torus", "p - square0"), ("fold", "q")], Torus, FoldTorus),
        (vec![("flip", "p - square0"), ("torus", "q - square1")], PeriodDoubling, FlipTorus),
        (vec![("torus", "p - square0"), ("torus", "q - square1")], Torus, DoubleTorus),
    ];
    for (blocks, hold, expected) in cases {
        let branch = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 16\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p\"\nrange = [-1, 1]\n";
        let model = forced(&blocks);
        let diagram = with_curve(study(&model, branch), hold, 0.0, "q", [-0.5, 0.5], None);
        let curve = diagram.branch("curve").unwrap();
        assert!(curve.points.iter().all(|p| p.parameters[0].abs() < TOLERANCE), "{expected}");
        let found: Vec<(Kind, f64)> = curve.special.iter().map(|s| (s.kind, s.point.parameters[1])).collect();
        assert!(
            matches!(found[..], [(kind, q)] if kind == expected && q.abs() < TOLERANCE),
            "{expected}: {found:?} {:?}",
            curve.ends
        );
    }
}

/// Folds and torus points of the entrained van der Pol oscillator end at the same 1:1 resonance, found by different
/// defining systems.
#[test]
fn torus_points_of_the_forced_van_der_pol_oscillator_end_on_its_folds() {
    let model = include_str!("../../../models/van-der-pol-forced.toml");
    let from = |frequency: f64, low: f64| {
        format!(
            "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 16\nparameters = {{ s = 1, Omega = {frequency} }}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"s\"\nrange = [{low}, 3]\n"
        )
    };
    let folds = with_curve(study(model, &from(1.1, 0.3)), Kind::Fold, 0.45, "Omega", [1.05, 1.3], None);
    let tori = with_curve(study(model, &from(1.2, 0.3)), Kind::Torus, 0.76, "Omega", [1.0, 1.6], None);
    let place = |diagram: &Diagram, kind: Kind| -> Vec<f64> {
        let curve = diagram.branch("curve").unwrap();
        let found: Vec<_> = curve.special.iter().filter(|s| s.kind == kind).collect();
        assert_eq!(found.len(), 1, "{kind}: {:?}", curve.special.iter().map(|s| s.kind).collect::<Vec<_>>());
        found[0].point.parameters.clone()
    };
    let (one, other) = (place(&folds, Kind::Resonance11), place(&tori, Kind::Resonance11));
    assert!(one.iter().zip(&other).all(|(a, b)| (a - b).abs() < 2e-8), "{one:?} {other:?}");
    let ends = tori.branch("curve").unwrap().ends.iter().flatten().filter(|end| end.code() == "joined").count();
    assert_eq!(ends, 1, "{:?}", tori.branch("curve").unwrap().ends);
    place(&folds, Kind::Cusp);
    place(&tori, Kind::Resonance13);
    place(&tori, Kind::Resonance14);
}

/// Closed form: Hopf points at αβ = 1; period doublings from another continuation code.
#[test]
fn curves_of_hopf_points_and_period_doublings_of_the_lure_system() {
    let model = include_str!("../../../models/lure.toml");
    let branch = "[[seed]]\nname = \"s\"\nstate = { x = 0, y = 0, z = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"alpha\"\nrange = [0.35, 2.5]\nswitch = { hopf = 1 }\n";
    let hopf = with_curve(study(model, branch), Kind::Hopf, 1.0, "beta", [0.5, 1.6], None);
    satisfies(&hopf, 4, |alpha, beta| alpha * beta - 1.0);
    // One study for each published value, at which the curve stops.
    for (beta, alpha) in [(1.2, 0.48096156567), (0.8, 0.81012451210)] {
        let mut study = study(model, branch);
        study.plan.curves.push(CurvePlan {
            name: "curve".into(),
            hold: Kind::PeriodDoubling,
            of: "b/hopf-1".into(),
            near: Some(0.63),
            to: None,
            further: Vec::new(),
            free: study.model.parameter_index("beta").unwrap(),
            ranges: [[0.35, 2.5], [0.7, 1.3]],
            until: Some(beta),
            marks: Vec::new(),
            max_points: 500,
        });
        let diagram = grown(&study);
        let curve = diagram.branch("curve").unwrap();
        complete(curve);
        let last = if beta > 1.0 { curve.points.last() } else { curve.points.first() }.unwrap();
        assert!((last.parameters[0] - alpha).abs() < 1e-8 && last.parameters[1] == beta, "{:?}", last.parameters);
    }
}

/// Folds of cycles between two generalised Hopf points, through a cusp; demo `abcb` of AUTO-07p (Doedel and
/// Heinemann 1983).
#[test]
fn a_curve_of_folds_of_cycles_ends_at_generalised_hopf_points() {
    let model = "name = \"abc\"\n[parameters]\nD = 0\nalpha = 1\nbeta = 1.55\nB = 8\nS = 0.04\n[definitions]\ne = \"exp(x3)\"\n\
        [states]\nx1 = \"-x1 + D*(1 - x1)*e\"\nx2 = \"-x2 + D*e*(1 - x1 - S*x2)\"\n\
        x3 = \"-x3 - beta*x3 + D*B*e*(1 - x1 + alpha*S*x2)\"\n";
    let diagram = grown(&study(
        model,
        "[[seed]]\nname = \"s\"\nstate = { x1 = 0, x2 = 0, x3 = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"D\"\n\
         range = [0, 0.4]\nswitch = { hopf = 1 }\n[[curve]]\nname = \"folds\"\nhold = \"fold\"\nof = \"b/hopf-1\"\nnear = 0.2137\n\
         free = \"alpha\"\nrange = [0.9, 1.4]\nbranch-range = [0.1, 0.4]\n[[curve]]\nname = \"hopf\"\nhold = \"hopf\"\nof = \"b\"\n\
         near = 0.2298\nfree = \"alpha\"\nrange = [0.9, 1.4]\nbranch-range = [0.1, 0.6]\n",
    ));
    let folds = diagram.branch("folds").unwrap();
    complete(folds);
    let mut ends: Vec<f64> = folds
        .ends
        .iter()
        .flatten()
        .filter_map(|end| match end {
            Ending::Joined { at: Kind::GeneralisedHopf, parameter } => Some(*parameter),
            _ => None,
        })
        .collect();
    ends.sort_by(f64::total_cmp);
    // AUTO ends at 1.09312; the other end is on the curve of the Hopf point at which the cycles are born. Both by a
    // second route: the first Lyapunov coefficient vanishes there along curves of Hopf points.
    let there = diagram.branch("hopf").unwrap();
    let second = there.special.iter().filter(|s| s.kind == Kind::GeneralisedHopf).map(|s| s.point.parameters[1]);
    let second = second.reduce(f64::max).unwrap();
    assert!((second - 1.09312).abs() < 1e-5, "{second}");
    assert!(ends.len() == 2 && (ends[1] - second).abs() < 1e-5 && (ends[0] - 1.026706).abs() < 1e-5, "{ends:?}");
}

/// Torus points of the electronic circuit of the demo `tor` of AUTO-07p shrink to an equilibrium where
/// beta + nu = beta + gamma = 0: the characteristic polynomial at the origin is λ³ + 0.4 λ there.
#[test]
fn a_curve_of_torus_points_ends_at_a_zero_hopf_point() {
    let model = "name = \"circuit\"\n[parameters]\nnu = -0.65\nbeta = 0.5\ngamma = -0.6\n[definitions]\nd = \"y - x\"\n[states]\n\
        x = \"(-(beta + nu)*x + beta*y - 0.328578*x^3 + 0.933578*d^3)/0.6\"\n\
        y = \"beta*x - (beta + gamma)*y - z - 0.933578*d^3\"\nz = \"y\"\n";
    let diagram = grown(&study(
        model,
        "[[seed]]\nname = \"s\"\nstate = { x = 0, y = 0, z = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"nu\"\nrange = [-0.9, -0.5]\n\
         switch = { hopf = 2, branch-point = 1 }\nstop = { period = 15 }\n[[curve]]\nname = \"torus\"\nhold = \"torus\"\n\
         of = \"b/hopf-1/branch-point-1\"\nfree = \"beta\"\nrange = [0.2, 0.9]\nbranch-range = [-0.99, -0.2]\n",
    ));
    let torus = diagram.branch("torus").unwrap();
    complete(torus);
    let at = |kind: Kind| {
        let ends = torus.ends.iter().flatten();
        let found = ends.filter_map(|end| match end {
            Ending::Joined { at, parameter } if *at == kind => Some(*parameter),
            _ => None,
        });
        found.collect::<Vec<f64>>()
    };
    assert!(matches!(at(Kind::ZeroHopf)[..], [beta] if (beta - 0.6).abs() < 1e-6), "{:?}", torus.ends);
    assert_eq!(at(Kind::Resonance11).len(), 1, "{:?}", torus.ends);
    assert!(torus.special.iter().all(|special| special.kind != Kind::Fold), "{:?}", torus.special);
}
