//! States that are angles: rotations, copies of one solution a full turn apart, branches that close around the circle.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind, Motion, Solution};
use foldline::explore::{self, System};
use foldline_store::study_file::{Study, parse_study};
use std::f64::consts::{PI, TAU};

#[track_caller]
fn study(model: &str, study: &str) -> Study {
    let text = format!("model = \"m\"\n{study}");
    parse_study(&text, "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"))
}

#[track_caller]
fn run(model: &str, text: &str) -> Diagram {
    let study = study(model, text);
    let system = System::of_plan(&study.model, &study.plan);
    explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved)
}

#[track_caller]
fn branch<'d>(diagram: &'d Diagram, name: &str) -> &'d Branch {
    let found = diagram.branches.iter().find(|b| b.name == name).unwrap_or_else(|| panic!("no branch {name}"));
    assert!(!found.points.is_empty(), "{name}: {:?}", found.ends);
    found
}

/// Positions of the special points of that kind, sorted.
fn places(branch: &Branch, kind: Kind) -> Vec<f64> {
    let own = branch.special.iter().filter(|s| s.kind == kind);
    let mut places: Vec<f64> = own.map(|s| s.point.parameters[branch.free]).collect();
    places.sort_by(f64::total_cmp);
    places
}

#[track_caller]
fn assert_places(branch: &Branch, kind: Kind, expected: &[f64], within: f64) {
    let found = places(branch, kind);
    let same = found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < within);
    assert!(same, "{}: {found:?}, expected {expected:?}", branch.name);
}

const MACHINE: &str = "[parameters]\nP = 0.5\nD = 0.2\nK = 1.0\n[states.delta]\nequation = \"w\"\nperiod = \"2*pi\"\n\
                       [states.w]\nequation = \"P - D*w - K*sin(delta)\"\nrange = [-3, 3]\n";

/// Asynchronous running of a machine connected to an infinite bus. Periods by a Runge-Kutta method of order 8 at 1e-11.
#[test]
fn an_asynchronous_machine_runs_and_its_synchronous_states_close_around_the_circle() {
    let found = run(
        MACHINE,
        "[[seed]]\nname = \"runs\"\nattractor = \"cycle\"\n[[seed]]\nname = \"rests\"\nattractor = \"equilibrium\"\n\
         [[branch]]\nname = \"running\"\nfrom = \"runs\"\nfree = \"P\"\nrange = [0.1, 1.5]\nmark = { P = [0.3, 1.0] }\n\
         [[branch]]\nname = \"sync\"\nfrom = \"rests\"\nfree = \"P\"\nrange = [-1.5, 1.5]\n",
    );
    let running = branch(&found, "running");
    for (expected, mark) in [4.7728301, 1.2576431].iter().zip(running.special.iter().filter(|s| s.kind == Kind::Mark)) {
        let Solution::Cycle(cycle) = &mark.point.solution else { panic!("no cycle") };
        assert!((cycle.period - expected).abs() < 1e-7, "{}", cycle.period);
        assert_eq!(cycle.gain, [TAU, 0.0]);
        let ahead: Vec<f64> = cycle.state(1.3).iter().zip(cycle.state(0.3)).map(|(a, b)| a - b).collect();
        assert!((ahead[0] - TAU).abs() < 1e-9 && ahead[1].abs() < 1e-9, "{ahead:?}");
    }
    assert!(matches!(running.ends[0], Some(Ending::Connecting { .. })), "{:?}", running.ends);
    let sync = branch(&found, "sync");
    assert!(sync.ends.iter().flatten().any(|end| *end == Ending::Closed), "{:?}", sync.ends);
    assert_places(sync, Kind::Fold, &[-1.0, 1.0], 1e-7);
}

/// Adler's equation: T = 2π / √(w² - 1), from a saddle-node on the circle at w = 1.
#[test]
fn adlers_equation_has_one_rotation_and_one_closed_branch_of_equilibria() {
    let found = run(
        "[parameters]\nw = 1.5\n[states.x]\nequation = \"w - sin(x)\"\nperiod = \"2*pi\"\n",
        "[[explore]]\nname = \"all\"\nfree = \"w\"\nrange = [0, 3]\n",
    );
    assert_eq!(found.branches.len(), 2);
    for point in &branch(&found, "all/cycle-1").points {
        let (w, period) = (point.parameters[0], point.solution.period().unwrap());
        let expected = TAU / ((w - 1.0) * (w + 1.0)).sqrt();
        // Near the saddle-node the period magnifies the error of w.
        let error = point.trust.discretisation + 1e-14 / (w - 1.0);
        assert!((period / expected - 1.0).abs() < error, "{w}: {period}, {expected}, {error:e}");
    }
    assert_places(branch(&found, "all/equilibrium-1"), Kind::Fold, &[1.0], 1e-7);
}

/// The first step of a driven Josephson junction, in the phase itself and in its cosine and sine.
#[test]
fn a_locked_rotation_is_the_same_on_the_cylinder_and_embedded() {
    let parameters = "[forcing]\nfrequency = \"om\"\n[parameters]\nI = 1.1\nom = 1.0\nA = 1.0\nD = 0.7\n";
    let angle = format!(
        "{parameters}[states.x]\nequation = \"v\"\nperiod = \"2*pi\"\n\
         [states.v]\nequation = \"-D*v - sin(x) + I + A*cos(om*t)\"\nrange = [-3, 3]\n"
    );
    let embedded = format!(
        "{parameters}[states.c]\nequation = \"-s*v + (1 - c^2 - s^2)*c\"\nrange = [-1, 1]\n\
         [states.s]\nequation = \"c*v + (1 - c^2 - s^2)*s\"\nrange = [-1, 1]\n\
         [states.v]\nequation = \"-D*v - s + I + A*cos(om*t)\"\nrange = [-3, 3]\n"
    );
    let text = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\n\
                [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"I\"\nrange = [0.2, 2]\n";
    let [one, other] = [angle, embedded].map(|model| run(&model, text));
    let [one, other] = [branch(&one, "b"), branch(&other, "b")];
    let Solution::Cycle(cycle) = &one.points[0].solution else { panic!("no cycle") };
    // One turn per forcing period.
    assert_eq!(cycle.gain, [TAU * f64::from(cycle.forcing_periods), 0.0]);
    let folds = places(one, Kind::Fold);
    assert_eq!(folds.len(), 2, "{:?}", one.ends);
    assert_places(other, Kind::Fold, &folds, 1e-7);
    assert_places(other, Kind::PeriodDoubling, &places(one, Kind::PeriodDoubling), 1e-7);
    assert!(one.ends.iter().flatten().any(|end| *end == Ending::Closed), "{:?}", one.ends);
}

/// A bead on a rotating hoop, its angle measured from the top. The symmetric state at the bottom is then half a turn,
/// an angle that is its own mirror image up to a full turn. The pitchfork is at W = 1.
#[test]
fn an_equilibrium_at_half_a_turn_is_symmetric() {
    let found = run(
        "[parameters]\nW = 0.5\nD = 0.3\n[states.th]\nequation = \"v\"\nperiod = \"2*pi\"\n\
         [states.v]\nequation = \"-D*v + sin(th)*(1 + W^2*cos(th))\"\nrange = [-2, 2]\n",
        "[[explore]]\nname = \"all\"\nfree = \"W\"\nrange = [0.2, 3]\n",
    );
    // Top, bottom, and tilted to one side or its mirror image.
    assert_eq!(found.branches.len(), 3, "{:?}", found.branches.iter().map(|b| &b.name).collect::<Vec<_>>());
    let forks: Vec<_> = found.branches.iter().flat_map(|b| &b.special).collect();
    assert!(!forks.is_empty());
    for fork in forks {
        assert_eq!(fork.kind, Kind::BranchPoint);
        assert!((fork.point.parameters[0] - 1.0).abs() < 1e-7);
        assert!(fork.normal_form().contains("pitchfork, supercritical"), "{}", fork.normal_form());
    }
}

/// On its own branch, which turns back there, a pitchfork is located less accurately than the coefficient a of its
/// normal form needs.
#[test]
fn a_pitchfork_is_recognised_on_the_branch_that_turns_back() {
    let found = run(
        "[parameters]\nW = 1.6\n[states]\nx = \"v\"\nv = \"-0.3*v - sin(x)*(1 - W^2*cos(x))\"\n",
        "[[seed]]\nname = \"tilted\"\nstate = { x = 1.17, v = 0 }\n\
         [[branch]]\nname = \"b\"\nfrom = \"tilted\"\nfree = \"W\"\nrange = [0.2, 3]\n",
    );
    let fork = branch(&found, "b").special.iter().find(|s| s.kind == Kind::BranchPoint).expect("a branch point");
    assert!(fork.normal_form().contains("pitchfork, supercritical"), "{}", fork.normal_form());
    assert!(fork.coefficients[0].abs() <= fork.coefficient_errors[0]);
}

/// Surveys and sweeps of a machine that runs or stands still.
#[test]
fn simulation_finds_running_and_resting_machines() {
    let found = run(
        MACHINE,
        "[[seed]]\nname = \"sync\"\nattractor = \"equilibrium\"\n\
         [[survey]]\nname = \"all\"\nfree = \"P\"\nvalues = [0.5]\nstarts = 24\n\
         [[sweep]]\nname = \"up\"\nfrom = \"sync\"\nfree = \"P\"\nvalues = [0.5, 0.9, 1.1]\n",
    );
    let of = |name: &str| &found.responses.iter().find(|r| r.name == name).expect(name).responses;
    let all = of("all");
    assert_eq!(all.len(), 2, "{all:?}");
    let running = all.iter().find(|r| r.motion == Motion::Cycle).expect("a running motion");
    assert!((running.period.unwrap() - 2.5464617).abs() < 1e-5, "{:?}", running.period);
    assert_eq!(running.ranges[0], [-PI, PI]);
    let rest = all.iter().find(|r| r.motion == Motion::Equilibrium).expect("a rest");
    assert!((rest.ranges[0][0] - PI / 6.0).abs() < 1e-5, "{:?}", rest.ranges);
    let motions: Vec<Motion> = of("up").iter().map(|r| r.motion).collect();
    assert_eq!(motions, [Motion::Equilibrium, Motion::Equilibrium, Motion::Cycle]);
    assert_eq!(of("up").last().and_then(|r| r.jumped), Some(true));
}

/// A given cycle whose phase goes far beyond the first turn.
#[test]
fn a_given_rotation_closes_after_a_full_turn() {
    // At a large torque the machine runs at nearly the constant speed P / D.
    let speed = 5.0 / 0.2;
    let times: Vec<String> = (0..=40).map(|k| format!("{}", k as f64 / 40.0)).collect();
    let angles: Vec<String> = (0..=40).map(|k| format!("{}", 40.0 * PI + TAU * k as f64 / 40.0)).collect();
    let speeds = vec![speed.to_string(); 41];
    let found = run(
        MACHINE,
        &format!(
            "[[seed]]\nname = \"given\"\nparameters = {{ P = 5 }}\ncycle = {{ period = {}, times = [{}], states = {{ delta = [{}], w = [{}] }} }}\n\
             [[branch]]\nname = \"b\"\nfrom = \"given\"\nfree = \"P\"\nrange = [0.9, 6]\nmark = {{ P = 1 }}\n",
            TAU / speed,
            times.join(", "),
            angles.join(", "),
            speeds.join(", ")
        ),
    );
    let mark = branch(&found, "b").special.iter().find(|s| s.kind == Kind::Mark).expect("the mark");
    assert!((mark.point.solution.period().unwrap() - 1.2576431).abs() < 1e-7);
}

#[test]
fn an_angle_whose_period_is_not_a_period_of_f_is_refused() {
    let model = "[parameters]\nk = 1.0\n[states.x]\nequation = \"v\"\nperiod = \"2*pi\"\n\
                 [states]\nv = \"-sin(x) - 0.1*k*x\"\n";
    let Err(found) = foldline_store::model_file::parse_model(model, "model") else { panic!("a mistake") };
    let text = format!("{found:?}");
    assert!(text.contains("declared as an angle") && text.contains("`x`"), "{text}");
}
