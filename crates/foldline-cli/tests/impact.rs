//! Cycles with impacts, against closed forms and against multiple shooting with event location.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind, Point, Solution};
use foldline::explore::{self, System};
use foldline::verify::{Quantity, Verified, verify};
use foldline_store::study_file::parse_study;

/// One impact per period with d = 1, in closed form: the flight is that of the linear oscillator.
const FOLD: f64 = 1.750_142_623_676_7;
const GRAZES: f64 = 1.410_673_597_966_6;
const TOUCHES: f64 = 0.704_493_589_686;

fn oscillator(a: f64, e: f64) -> String {
    format!(
        "name = \"impacts\"\n[parameters]\nw = 1\nc = 0.1\nA = {a}\nd = 1\ne = {e}\n[forcing]\nfrequency = \"w\"\n\
         [states.\"x''\"]\nequation = \"A*cos(w*t) - c*x' - x\"\nrange = [-2, 0.9]\nvelocity = {{ range = [-2, 2] }}\n\
         [contact.stop]\nat = \"x\"\nclearance = \"d\"\nrestitution = \"e\"\n"
    )
}

/// The overhung rotor in the frame that rotates with it, inside a rigid ring without friction.
const ROTOR: &str = "name = \"rigid ring\"\n[parameters]\nOmega = 6\ne = 0.8\nzeta = 0.01\nepsilon = 0.353\nJ_p = 0.143\nm = 0.9\n\
    [definitions]\nk = \"1 - (1 - J_p)*Omega^2\"\ng = \"(2 - J_p)*Omega\"\n\
    [states]\nu = { equation = \"du\" }\nv = { equation = \"dv\" }\n\
    du = { equation = \"m*epsilon*Omega^2 + g*dv - 2*zeta*du - k*u + 2*zeta*Omega*v\" }\n\
    dv = { equation = \"-g*du - 2*zeta*dv - k*v - 2*zeta*Omega*u\" }\n\
    [contact.ring]\nat = [\"u\", \"v\"]\nvelocity = [\"du\", \"dv\"]\nclearance = 1\nrestitution = \"e\"\n";

#[track_caller]
fn run(model: &str, study: &str) -> Diagram {
    with_run(model, study, |diagram, _| diagram)
}

/// A diagram, and a function that verifies some points of one.
#[track_caller]
fn with_run<R>(model: &str, study: &str, act: impl FnOnce(Diagram, &dyn Fn(&Diagram, usize) -> Verified) -> R) -> R {
    let text = format!("model = \"m\"\n{study}");
    let study = parse_study(&text, "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"));
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    act(diagram, &|diagram, sample| verify(&system, diagram, study.plan.tolerance, Some(sample), &|_| true))
}

#[track_caller]
fn branch<'d>(diagram: &'d Diagram, name: &str) -> &'d Branch {
    let found = diagram.branch(name).unwrap_or_else(|| panic!("{name}"));
    assert!(found.ends.iter().all(|end| end.as_ref().is_some_and(Ending::complete)), "{name}: {:?}", found.ends);
    assert!(found.special.iter().all(|special| special.kind != Kind::Unexplained), "{name}");
    found
}

#[track_caller]
fn located(branch: &Branch, kind: Kind, known: f64, within: f64) {
    let values: Vec<f64> =
        branch.special.iter().filter(|s| s.kind == kind).map(|s| s.point.parameters[branch.free]).collect();
    let off = values.iter().map(|own| (own - known).abs()).fold(f64::INFINITY, f64::min);
    assert!(off < within, "{}: {kind} {known}: {values:?}", branch.name);
}

fn start(branch: &Branch) -> &Point {
    branch.points.iter().find(|point| point.position == 0).unwrap()
}

const SEED: &str = "tolerance = 1e-8\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 8\n\
    [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"w\"\n";

/// The response turns at a fold, loses its impact where it grazes, and goes on without impacts.
#[test]
fn a_response_with_impacts_is_followed_to_its_grazings() {
    let diagram = run(&oscillator(1.0, 0.8), &format!("{SEED}range = [0.72, 2]\n"));
    let own = branch(&diagram, "b");
    let mut multipliers = start(own).spectrum.clone();
    multipliers.sort_by(|a, b| a.im.total_cmp(&b.im));
    for (found, known) in multipliers.iter().zip([-0.005_600_351_492, 0.005_600_351_492]) {
        assert!((found.re + 0.584_295_314_342).abs() < 1e-7 && (found.im - known).abs() < 1e-7, "{multipliers:?}");
    }
    located(own, Kind::Fold, FOLD, 1e-9);
    located(own, Kind::ImpactGrazing, GRAZES, 1e-9);
    let grazing = own.special.iter().find(|s| s.kind == Kind::ImpactGrazing).unwrap();
    assert!(grazing.remark.starts_with("non-smooth fold"), "{}", grazing.remark);
    // Beyond, the motion is that of the linear oscillator.
    let last = own.points.iter().max_by(|a, b| a.parameters[0].total_cmp(&b.parameters[0])).unwrap();
    let w = last.parameters[0];
    let linear = 1.0 / (1.0 - w * w).hypot(0.1 * w);
    assert!((w - 2.0).abs() < 1e-12 && (last.ranges[0][1] - linear).abs() < 1e-7, "{w}: {:?}", last.ranges);
}

/// A second touch of the stop within the period.
#[test]
fn a_second_touch_is_located() {
    let diagram = run(&oscillator(1.0, 0.8), &format!("{SEED}range = [0.69, 1.1]\nmax-points = 400\n"));
    located(diagram.branch("b").unwrap(), Kind::ImpactGrazing, TOUCHES, 1e-9);
}

/// A doubling of cycles with one impact in two periods of the force, and the branch that leaves there.
#[test]
fn doublings_of_cycles_with_impacts_are_switched_at() {
    let study = "tolerance = 1e-8\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nperiods = 2\nparameters = { w = 0.95 }\n\
        samples = 32\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"w\"\nrange = [0.935, 0.96]\n\
        [branch.switch]\nperiod-doubling = 1\n";
    let diagram = run(&oscillator(0.3, 0.7), study);
    located(diagram.branch("b").unwrap(), Kind::PeriodDoubling, 0.942_780_505_343_07, 1e-9);
    assert_eq!(diagram.branches.len(), 2);
}

/// Unstable cycles of an autonomous rotor, from states just after an impact: periods and multipliers.
#[test]
fn unstable_cycles_of_a_rotor_in_a_rigid_ring() {
    for (e, state, period, multipliers) in [
        (
            0.8,
            [-0.999_268_381_098, -0.038_245_294_323, 0.265_315_115_093, 3.013_276_381_444],
            1.565_814_225_367,
            [19.627_293_31, 0.930_740_05, 0.032_907_14],
        ),
        (
            1.0,
            [-0.999_919_973_814, -0.012_650_927_545, 0.474_884_200_657, 3.377_682_290_046],
            1.674_786_099_499,
            [25.800_191_62, 0.969_255_9, 0.037_397_67],
        ),
    ] {
        let [u, v, du, dv] = state;
        let study = format!(
            "tolerance = 1e-8\n[[seed]]\nname = \"s\"\nstate = {{ u = {u}, v = {v}, du = {du}, dv = {dv} }}\n\
             parameters = {{ e = {e} }}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [5.99, 6.01]\n"
        );
        let diagram = run(ROTOR, &study);
        let point = start(diagram.branch("b").unwrap());
        assert!((point.solution.period().unwrap() - period).abs() < 1e-8, "{:?}", point.solution.period());
        for known in multipliers {
            let off = point.spectrum.iter().map(|z| (z - known).norm()).fold(f64::INFINITY, f64::min);
            assert!(off < 1e-6 * known.max(1.0), "{known}: {:?}", point.spectrum);
        }
    }
}

/// A self-excited oscillator inside a stop: the speed of the impact vanishes like the square root of the distance, which
/// is no fold.
#[test]
fn an_autonomous_oscillator_leaves_its_stop() {
    let model = "name = \"self-excited\"\n[parameters]\nmu = 0.5\nd = 1.5\ne = 0.6\n\
        [states.\"x''\"]\nequation = \"mu*(1 - x^2)*x' - x\"\nrange = [-2, 1.4]\nvelocity = { range = [-2, 2] }\n\
        [contact.stop]\nat = \"x\"\nclearance = \"d\"\nrestitution = \"e\"\n";
    let diagram = run(model, &SEED.replace("\"w\"", "\"d\"").replace("[[branch]]", "[[branch]]\nrange = [1.4, 2.2]"));
    let own = branch(&diagram, "b");
    // Integrated with event location.
    let period = start(own).solution.period().unwrap();
    assert!((period - 4.910_461_493_524).abs() < 1e-8, "{period}");
    let kinds: Vec<Kind> = own.special.iter().map(|special| special.kind).collect();
    assert_eq!(kinds, [Kind::ImpactGrazing]);
    assert!(own.special[0].remark.starts_with("persistence"), "{}", own.special[0].remark);
    // There d is the amplitude of the cycle without impacts.
    let free = own.points.iter().find(|point| point.parameters[1] > 2.1).unwrap();
    assert!((own.special[0].point.parameters[1] - free.ranges[0][1]).abs() < 1e-7);
}

/// A cycle with impacts is recomputed by shooting through its events, and a changed number is found.
#[test]
fn cycles_with_impacts_are_verified() {
    let study = format!("{SEED}range = [0.9, 2]\n");
    with_run(&oscillator(1.0, 0.8), &study, |diagram, verified| {
        let right = verified(&diagram, 6);
        assert_eq!(right.wrong().count(), 0, "{:?}", right.wrong().next());
        // The fold and the impact grazing are located again.
        assert!(right.points == 6 && right.special == 2, "{} {} {:?}", right.points, right.special, right.undecided);
        type Change = (Quantity, fn(&mut Point));
        let changes: [Change; 4] = [
            (Quantity::Spectrum, |point| point.spectrum[0] += 1e-6),
            (Quantity::Range, |point| point.ranges[0][0] += 1e-6),
            (Quantity::Profile, |point| {
                let Solution::Cycle(cycle) = &mut point.solution else { return };
                cycle.profile[4] += 1e-6;
            }),
            // The velocity after an impact: it is none any more.
            (Quantity::Events, |point| {
                let Solution::Cycle(cycle) = &mut point.solution else { return };
                let block = 2 * (cycle.degree + 1);
                let jump = |j: usize| (cycle.profile[j * block + 1] - cycle.profile[j * block - 1]).abs();
                let after = (1..cycle.intervals()).max_by(|a, b| jump(*a).total_cmp(&jump(*b))).unwrap();
                cycle.profile[after * block + 1] += 1e-3;
            }),
        ];
        for (quantity, change) in changes {
            let mut other = diagram.clone();
            other.branches[0].special.clear();
            other.branches[0].points.retain(|point| point.position == 2);
            change(&mut other.branches[0].points[0]);
            let found = verified(&other, 1);
            assert!(found.wrong().any(|check| check.quantity == quantity), "{quantity:?} {:?}", found.undecided);
        }
        let mut other = diagram.clone();
        other.branches[0].points.truncate(1);
        other.branches[0].special.retain(|own| own.kind == Kind::ImpactGrazing);
        other.branches[0].special[0].point.parameters[0] += 1e-5;
        let found = verified(&other, 1);
        assert!(found.wrong().any(|check| check.quantity == Quantity::Place), "{:?}", found.undecided);
    });
}

/// Cycles that stick, and cycles that slip throughout, against shooting with Filippov's field.
#[test]
fn cycles_with_friction_are_verified() {
    let model = "name = \"friction\"\n[parameters]\nw = 0.6\n[forcing]\nfrequency = \"w\"\n[states.\"x''\"]\n\
        equation = \"1.5*cos(w*t) - 0.1*x' - x - sign(x')\"\nrange = [-2, 2]\nvelocity = { range = [-2, 2] }\n";
    with_run(model, &format!("{SEED}range = [0.6, 0.9]\n"), |diagram, verified| {
        let found = verified(&diagram, 4);
        assert_eq!(found.wrong().count(), 0, "{:?}", found.wrong().next());
        assert_eq!(found.points, 4, "{:?}", found.undecided);
    });
}

/// Values of the first and second parameter along a curve where it passes a value of the second.
fn marked(diagram: &Diagram, curve: &str, first: usize) -> Vec<f64> {
    let own = branch(diagram, curve);
    own.special.iter().filter(|s| s.kind == Kind::Mark).map(|s| s.point.parameters[first]).collect()
}

/// Folds and doublings in two parameters against closed forms: one impact in q periods of a linear oscillator is a
/// system of two equations.
#[test]
fn curves_in_two_parameters_are_those_of_the_closed_form() {
    // From either of two starts, in both directions.
    for e in [0.8, 0.75] {
        let study = format!(
            "{SEED}range = [0.95, 2]\n[[curve]]\nname = \"folds\"\nof = \"b\"\nhold = \"fold\"\nfree = \"e\"\n\
             range = [0.7, 0.85]\nmark = {{ e = [0.7] }}\n"
        );
        let diagram = run(&oscillator(1.0, e), &study);
        let known = [1.703_193_808_401_04];
        let found = marked(&diagram, "folds", 0);
        assert_eq!(found.len(), known.len(), "{found:?}");
        assert!(found.iter().zip(known).all(|(a, b)| (a - b).abs() < 1e-8), "{found:?}");
    }
    let doublings = "tolerance = 1e-8\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nperiods = 2\n\
        parameters = { w = 0.95 }\nsamples = 32\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"w\"\n\
        range = [0.935, 0.96]\n[[curve]]\nname = \"doublings\"\nof = \"b\"\nhold = \"period-doubling\"\n\
        free = \"e\"\nrange = [0.69, 0.75]\nbranch-range = [0.9, 1]\nmark = { e = [0.75] }\n";
    let found = marked(&run(&oscillator(0.3, 0.7), doublings), "doublings", 0);
    let known = [0.950_865_914_101_461];
    assert_eq!(found.len(), known.len(), "{found:?}");
    assert!(found.iter().zip(known).all(|(a, b)| (a - b).abs() < 1e-8), "{found:?}");
}

/// A curve of impact grazings is the amplitude of the linear oscillator.
#[test]
fn impact_grazings_of_a_linear_oscillator() {
    let study = format!(
        "{SEED}range = [0.95, 2]\n[[curve]]\nname = \"grazings\"\nof = \"b\"\nhold = \"impact-grazing\"\n\
         free = \"A\"\nrange = [0.5, 1.5]\nbranch-range = [1.1, 2]\n"
    );
    let diagram = run(&oscillator(1.0, 0.8), &study);
    let own = branch(&diagram, "grazings");
    assert!(own.points.len() > 4);
    for point in &own.points {
        let [w, a] = [point.parameters[0], point.parameters[2]];
        let linear = (1.0 - w * w).hypot(0.1 * w);
        assert!((a - linear).abs() < 1e-8, "{w} {a} {linear}");
    }
}

/// Beyond the second touch the branch goes on with two impacts instead of turning back to one, at any tolerance; and the
/// curve of these grazings is that of cycles with one impact.
#[test]
fn a_branch_goes_on_away_from_a_grazing() {
    let study = format!(
        "{SEED}range = [0.69, 1.02]\n[[curve]]\nname = \"touches\"\nof = \"b\"\nhold = \"impact-grazing\"\nfree = \"e\"\n\
         range = [0.75, 0.85]\nbranch-range = [0.6, 1.1]\nmark = {{ e = [0.75, 0.85] }}\n"
    );
    let diagram = run(&oscillator(1.0, 0.8), &study);
    let kinds: Vec<Kind> = branch(&diagram, "b").special.iter().map(|special| special.kind).collect();
    assert_eq!(kinds, [Kind::Fold, Kind::ImpactGrazing]);
    let found = marked(&diagram, "touches", 0);
    // Closed form with the maximum of the flight.
    let known = [0.701_313_209_832_74, 0.707_252_536_774_21];
    assert!(found.len() == 2 && found.iter().zip(known).all(|(a, b)| (a - b).abs() < 1e-8), "{found:?}");
}

/// Torus points: the product of the multipliers of one impact per period is e² exp(-c T).
#[test]
fn torus_points_of_cycles_with_impacts() {
    let study = format!(
        "{}range = [0.8, 0.9]\n[[curve]]\nname = \"torus\"\nof = \"b\"\nhold = \"torus\"\nfree = \"w\"\n\
         range = [1.05, 1.15]\n",
        SEED.replace("\"w\"", "\"e\"").replace("samples = 8", "samples = 8\nparameters = { w = 1.1, c = -0.05 }")
    );
    let diagram = run(&oscillator(1.0, 0.8), &study);
    let own = diagram.branch("torus").unwrap();
    assert!(own.points.len() > 2, "{:?}", own.ends);
    for point in &own.points {
        let [w, e] = [point.parameters[0], point.parameters[4]];
        assert!((e - (-0.05 * std::f64::consts::PI / w).exp()).abs() < 1e-8, "{w} {e}");
    }
}
