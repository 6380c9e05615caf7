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

/// x'' = A cos(ω t) + F0 - c x' - k x with a rigid wall at x = d.
fn walled([k, c, e, f0, a, d]: [f64; 6], start: f64) -> String {
    format!(
        "name = \"wall\"\nunits = \"labels\"\n[parameters]\nw = {start}\nk = {k}\nc = {c}\ne = {e}\nF0 = {f0}\nA = {a}\nd = {d}\n\
         [forcing]\nfrequency = \"w\"\n[states.\"x''\"]\nequation = \"A*cos(w*t) + F0 - c*x' - k*x\"\nrange = [-2, {d}]\n\
         velocity = {{ range = [-2, 2] }}\n[contact.wall]\nat = \"x\"\nclearance = \"d\"\nrestitution = \"e\"\n"
    )
}

/// The motion without impacts touches the wall where F0/k + A/|k - ω² + i c ω| = d. Newton's method leads to its orbits beyond the
/// touch as well, which cross the surface of the wall.
#[test]
fn grazings_of_motions_without_impacts_lie_where_the_closed_form_says() {
    for (model, grazes, tolerance) in [
        ([0.325, 0.0222, 0.368, 0.245, 0.699, 1.736], 1.018_008_945_596_513_8, 1e-8),
        ([1.144, 0.0223, 0.443, 0.186, 1.548, 1.291], 1.585_995_795_075_96, 1e-8),
        ([1.144, 0.0223, 0.443, 0.186, 1.548, 1.291], 1.585_995_795_075_96, 1e-5),
    ] {
        let [k, c, _, f0, a, d] = model;
        let amplitude = |w: f64| f0 / k + a / (k - w * w).hypot(c * w);
        assert!((amplitude(grazes) - d).abs() < 1e-12, "{}", amplitude(grazes) - d);
        let start = 2.5 * grazes;
        let study = format!(
            "tolerance = {tolerance}\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nperiods = 1\nsamples = 8\n\
             [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"w\"\nrange = [{}, {start}]\nmax-points = 200\n",
            0.9 * grazes
        );
        let diagram = run(&walled(model, start), &study);
        let own = diagram.branch("b").unwrap();
        let found = own.special.iter().find(|s| s.kind == Kind::ImpactGrazing).unwrap();
        let off = (found.point.parameters[0] - grazes).abs();
        assert!(off <= found.error * own.size(grazes) && found.error < 10.0 * tolerance, "{off} {}", found.error);
        assert!(found.remark.ends_with("1 → 0"), "{}", found.remark);
    }
}

/// Impacts accumulate near ω = 0.793: at every further one the branch goes on, none of its points passes the wall at 0.622, and where
/// chatter is near it ends with that word.
#[test]
fn accumulating_impacts_end_a_branch_in_words() {
    let study = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nperiods = 1\nsamples = 16\n\
                 [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"w\"\nrange = [0.4, 4]\n";
    let diagram = run(&walled([1.0, 0.3639, 0.324, 0.091, 1.739, 0.622], 2.25), study);
    let own = diagram.branch("b").unwrap();
    assert!(own.points.iter().all(|point| point.ranges[0][1] < 0.622 + 1e-6));
    let least = own.points.iter().map(|point| point.parameters[0]).fold(f64::INFINITY, f64::min);
    assert!((least - 0.793).abs() < 1e-3, "{least}");
    let ended = own.ends.iter().flatten().filter(|end| !end.complete()).map(Ending::to_string).collect::<Vec<String>>();
    assert!(matches!(&ended[..], [one] if one.contains("chatter")), "{ended:?}");
}

/// With e = 0.387, impacts accumulate towards w = 0.8275: the ninth of them begins at w = 0.827847 (closed form of the flights), when
/// the eighth has 5e-4 of the largest speed. At a tolerance of 1e-5 the branch ends before, because what passes the wall there is
/// more than the errors of the points.
#[test]
fn impacts_that_a_tolerance_does_not_resolve_end_a_branch() {
    let study = "tolerance = 1e-5\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 24\nparameters = { w = 1.287 }\n\
                 [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"w\"\nrange = [0.6, 3.2]\nmax-points = 250\n";
    let diagram = run(&walled([1.0, 0.173, 0.387, 0.0, 1.0, 0.024], 1.0), study);
    let own = diagram.branch("b").unwrap();
    assert!(own.points.iter().all(|point| point.ranges[0][1] < 0.024 + 1e-5));
    let ended = own.ends.iter().flatten().filter(|end| !end.complete()).map(Ending::to_string).collect::<Vec<String>>();
    assert!(matches!(&ended[..], [one] if one.contains("smaller tolerance")), "{ended:?}");
}

/// A doubled cycle with one impact in two periods of the force passes the grazing of the motion without impacts, traversed twice, and
/// comes back with the impact in the other period. (A comparison of its halves led from there to the period doubling at once.)
#[test]
fn a_doubled_cycle_does_not_leap_from_a_grazing_to_its_start() {
    let model = "name = \"wall\"\nunits = \"labels\"\n[parameters]\nk = 3820\nc = 22.32\nF0 = -89.5\nA = 120.3\nw = 46.4\nd = 0.00295\n\
                 e = 0.784\n[forcing]\nfrequency = \"w\"\n[states]\nx = { equation = \"v\", range = [-0.02, 0.0029205] }\n\
                 v = { equation = \"A*cos(w*t) + F0 - c*v - k*x\", range = [-2, 2] }\n\
                 [events.a]\nwhen = \"x - d\"\nset = { v = \"-e*v\" }\nallowed = \"x <= d\"\n";
    let study = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 32\n\
                 [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"w\"\nrange = [24.7, 154.5]\nswitch = { period-doubling = 1 }\n";
    let diagram = run(model, study);
    let doubled = diagram.branches.iter().filter(|own| own.name.contains("period-doubling"));
    let mut count = 0;
    for own in doubled {
        for pair in own.points.windows(2) {
            let [a, b] = [&pair[0], &pair[1]].map(|point| point.ranges[1][1]);
            assert!((a - b).abs() < 0.03, "{}: {a} then {b}", own.name);
            count += 1;
        }
    }
    assert!(count > 5, "{count}");
}

/// Twelve jumps of v in two periods, and its largest value on a smooth piece: no node of the profile lies above it.
#[test]
fn the_largest_value_between_jumps_is_found() {
    let model = "name = \"walls\"\nunits = \"labels\"\n[parameters]\nk = 1e-8\nc = 1.9e-5\nF0 = -8.36e-13\nA = 1.611e-12\nom = 0.0001477\n\
                 d = 0.0001009\ne = 0.919\n[forcing]\nfrequency = \"om\"\n[states]\nx = { equation = \"v\", range = [-9.08e-5, 9.08e-5] }\n\
                 v = { equation = \"A*cos(om*t) + F0 - c*v - k*x\", range = [-2e-8, 2e-8] }\n\
                 [events.a]\nwhen = \"x - d\"\nset = { v = \"-e*v\" }\nallowed = \"x <= d\"\n\
                 [events.b]\nwhen = \"-x - d\"\nset = { v = \"-e*v\" }\nallowed = \"x >= -d\"\n";
    let study = "tolerance = 1e-5\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 32\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n\
                 free = \"om\"\nrange = [4e-5, 2.5e-4]\nswitch = { period-doubling = 1, branch-point = 1 }\n";
    let diagram = run(model, study);
    let doubled = diagram.branch("b/period-doubling-1").unwrap();
    assert!(doubled.points.len() > 5);
    for point in &doubled.points {
        let Solution::Cycle(cycle) = &point.solution else { panic!() };
        let stored = cycle.profile.chunks_exact(2).map(|x| x[1]).fold(0.0, f64::max);
        assert!(point.ranges[1][1] >= stored, "{} {stored}", point.ranges[1][1]);
    }
}

/// Cycles with different numbers of impacts are compared at branch points. Once this ended in a panic.
#[test]
fn branches_with_different_numbers_of_impacts_are_told_apart() {
    let model = "name = \"walls\"\nunits = \"labels\"\n[parameters]\nk = 64.1\nc = 0.588\nA = 227.3\nom = 15.46\nd = 0.969\ne = 0.558\n\
                 [forcing]\nfrequency = \"om\"\n[states.\"x''\"]\nequation = \"A*cos(om*t) - c*x' - k*x\"\nrange = [-0.8721, 0.8721]\n\
                 velocity = { range = [-20, 20] }\n[contact.w]\nat = \"x\"\nclearance = \"d\"\nrestitution = \"e\"\nside = \"both\"\n";
    let study = "tolerance = 1e-8\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 32\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n\
                 free = \"om\"\nrange = [2.002, 20.02]\nswitch = { period-doubling = 1, branch-point = 1 }\n";
    let own = run(model, study);
    assert!(own.branch("b/branch-point-1").is_some_and(|own| own.points.len() > 10));
}

/// x'' + c x' + x = A cos(w t) reaches the wall at 1 where A = |1 - w² + i c w|. Where its largest value follows soon after the
/// beginning of a period, the motion is beyond the wall there at once.
#[test]
fn a_touch_soon_after_the_beginning_of_a_period_is_found() {
    for c in [0.1, 0.15, 0.2] {
        let response = |w: f64| 0.5 / (1.0 - w * w).hypot(c * w);
        let (mut low, mut high) = (0.6f64, 0.95f64);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if response(middle) < 1.0 { low = middle } else { high = middle }
        }
        for tolerance in ["1e-5", "1e-6", "1e-8"] {
            let study = format!(
                "tolerance = {tolerance}\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nperiods = 1\nsamples = 4\n\
                 [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"w\"\nrange = [0.5, 0.9]\n"
            );
            let diagram = run(&walled([1.0, c, 0.8, 0.0, 0.5, 1.0], 0.6), &study);
            let own = diagram.branch("b").unwrap();
            let found = own.special.iter().filter(|s| s.kind == Kind::ImpactGrazing).map(|s| s.point.parameters[0]);
            let off = found.map(|w| (w - low).abs()).fold(f64::INFINITY, f64::min);
            assert!(off < 1e-6, "c = {c}, {tolerance}: {off:e}");
            assert!(own.points.iter().all(|point| point.ranges[0][1] < 1.0 + 1e-5), "c = {c}, {tolerance}");
        }
    }
}
