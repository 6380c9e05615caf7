//! Cycles with impacts in models that switch besides, against closed forms: a spring that is met, and dry friction.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind, Point};
use foldline::explore::{self, System};
use foldline::verify::{Quantity, Verified, verify};
use foldline_store::study_file::parse_study;
use num_complex::Complex64;

/// x'' + 0.1 x' + x = cos(w t) with a wall at 1 and restitution 0.8, and a spring of stiffness 4 from x = -1.2 on. Between
/// its switchings the motion is that of a linear oscillator. The cycles, and the derivatives of the map from impact to impact,
/// were computed from that closed form with 24 digits.
const TOUCHES_SPRING: f64 = 1.012_641_510_227_335_6;
const DOUBLES: [f64; 2] = [1.044_836_141_461_997_6, 1.219_191_719_151_008_6];
/// At w = 1.6: least displacement, from integration of the cycle at a tolerance of 1e-12, and one of a pair of multipliers.
const LEAST: f64 = -1.668_080_442_778_5;
const MULTIPLIER: [f64; 2] = [-0.408_121_296_589_251, 0.515_349_810_837_267];
/// A wall as above, with Coulomb friction 0.2 instead of the spring, in closed form likewise: w and the least displacement. The
/// mass reverses once per period; sticks once more; reverses and sticks; reverses three times.
const FRICTION: [[f64; 2]; 4] = [
    [0.9, -1.056_640_433_474_245_9],
    [0.82, -1.154_534_498_941_534_4],
    [0.8, -1.199_800_585_766_966],
    [0.7, -1.516_141_544_562_860_5],
];

fn oscillator(force: &str) -> String {
    format!(
        "name = \"both\"\n[parameters]\nw = 1\n[forcing]\nfrequency = \"w\"\n[states.\"x''\"]\n\
         equation = \"cos(w*t) - 0.1*x' - x {force}\"\nrange = [-1.1, 0.9]\nvelocity = {{ range = [-2, 2] }}\n\
         [contact.wall]\nat = \"x\"\nclearance = 1\nrestitution = 0.8\n"
    )
}

/// A diagram, and a function that verifies some of its points.
#[track_caller]
fn run<R>(model: &str, study: &str, act: impl FnOnce(Diagram, &dyn Fn(&Diagram) -> Verified) -> R) -> R {
    let text = format!("model = \"m\"\n{study}");
    let study = parse_study(&text, "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"));
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    act(diagram, &|diagram| verify(&system, diagram, study.plan.tolerance, Some(10), &|_| true))
}

#[track_caller]
fn branch<'d>(diagram: &'d Diagram, name: &str) -> &'d Branch {
    let found = diagram.branch(name).unwrap_or_else(|| panic!("{name}"));
    assert!(found.ends.iter().all(|end| end.as_ref().is_some_and(Ending::complete)), "{name}: {:?}", found.ends);
    assert!(found.special.iter().all(|special| special.kind != Kind::Unexplained), "{name}");
    found
}

fn values(branch: &Branch, kind: Kind) -> Vec<f64> {
    let own = branch.special.iter().filter(|special| special.kind == kind);
    own.map(|special| special.point.parameters[branch.free]).collect()
}

#[track_caller]
fn all_as_stated(verified: &Verified, least: usize) {
    let wrong: Vec<String> = verified.wrong().map(|check| format!("{check:?}")).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
    let profiles = verified.checks.iter().filter(|check| check.quantity == Quantity::Profile).count();
    assert!(profiles >= least, "{profiles} profiles, undecided: {:?}", verified.undecided);
}

const STUDY: &str = "tolerance = 1e-8\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 8\n\
    [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"w\"\n";

/// The grazing of the spring, both doublings that follow it, and the multipliers at the end of the branch.
#[test]
fn a_wall_and_a_spring_on_one_branch() {
    let study = format!("{STUDY}range = [0.95, 1.6]\n");
    let diagram = run(&oscillator("+ 4*max(-x - 1.2, 0)"), &study, |diagram, _| diagram);
    let own = branch(&diagram, "b");
    let grazings = values(own, Kind::Grazing);
    assert_eq!(grazings.len(), 1, "{grazings:?}");
    assert!((grazings[0] - TOUCHES_SPRING).abs() < 1e-9, "{grazings:?}");
    let doublings = values(own, Kind::PeriodDoubling);
    assert_eq!(doublings.len(), 2, "{doublings:?}");
    assert!(doublings.iter().zip(DOUBLES).all(|(found, known)| (found - known).abs() < 1e-8), "{doublings:?}");
    let remark = &own.special.iter().find(|special| special.kind == Kind::Grazing).unwrap().remark;
    assert_eq!(remark, "contacts 0 → 1 at -x - 1.2 = 0");
    let last = own.points.iter().max_by(|a, b| a.parameters[0].total_cmp(&b.parameters[0])).unwrap();
    assert!((last.ranges[0][0] - LEAST).abs() < 1e-7, "{:?}", last.ranges);
    let off =
        last.spectrum.iter().map(|z| (z.re - MULTIPLIER[0]).hypot(z.im.abs() - MULTIPLIER[1])).fold(0.0, f64::max);
    assert!(off < 1e-6, "{:?}", last.spectrum);
}

/// Cycles with an impact that slip throughout, stick, and slip again.
#[test]
fn a_wall_and_dry_friction_on_one_branch() {
    let marks = FRICTION.map(|[w, _]| w.to_string()).join(", ");
    let study = format!("{STUDY}range = [0.68, 1.1]\nmark = {{ w = [{marks}] }}\n");
    let (diagram, verified) = run(&oscillator("- 0.2*sign(x')"), &study, |diagram, verified| {
        let verified = verified(&diagram);
        (diagram, verified)
    });
    let own = branch(&diagram, "b");
    for [w, least] in FRICTION {
        let at = |special: &&foldline::diagram::SpecialPoint| {
            special.kind == Kind::Mark && (special.point.parameters[0] - w).abs() < 1e-12
        };
        let found: &Point = &own.special.iter().find(at).unwrap_or_else(|| panic!("{w}")).point;
        assert!((found.ranges[0][0] - least).abs() < 1e-7, "{w}: {:?}", found.ranges);
        // Sticking forgets the velocity of arrival.
        let forgets = found.spectrum.iter().any(|z| z.norm() == 0.0);
        assert_eq!(forgets, w == 0.82 || w == 0.8, "{w}: {:?}", found.spectrum);
    }
    all_as_stated(&verified, 5);
}

/// A curve of grazings of the spring: the least displacement of the oscillator with a wall alone stays -g.
#[test]
fn grazings_of_the_spring_are_continued() {
    let model = oscillator("+ 4*max(-x - g, 0)").replace("w = 1\n", "w = 1\ng = 1.2\n");
    let study = format!(
        "{STUDY}range = [0.95, 1.1]\n[[curve]]\nname = \"c\"\nof = \"b\"\nhold = \"grazing\"\nnear = 1.01\nfree = \"g\"\nrange = [1.15, 1.25]\n"
    );
    let diagram = run(&model, &study, |diagram, _| diagram);
    let own = branch(&diagram, "c");
    assert!(own.points.len() > 3);
    for point in &own.points {
        let [w, g] = [point.parameters[0], point.parameters[1]];
        assert!((point.ranges[0][0] + g).abs() < 1e-8, "{w} {g}: {:?}", point.ranges);
    }
    let start = own.points.iter().find(|point| (point.parameters[1] - 1.2).abs() < 1e-12).unwrap();
    assert!((start.parameters[0] - TOUCHES_SPRING).abs() < 1e-8, "{:?}", start.parameters);
}

/// Multipliers of an oscillator with springs beyond two gaps, compared at the same frequencies with a computation at a hundredth
/// of the tolerance. Close to grazings they change so steeply that the error of the frequency at which a cycle exists decides.
#[test]
fn errors_of_multipliers_hold_at_the_same_value_of_the_parameter() {
    let model = "units = \"labels\"\n[parameters]\nom = 0.6\n[forcing]\nfrequency = \"om\"\n[states]\n\
                 x = { equation = \"v\", range = [-2, 2] }\n\
                 v = { equation = \"cos(om*t) - (0.168*v + x + 38.996*max(x - 0.144, 0) - 1.535*max(-x - 0.75, 0))\", range = [-2, 2] }\n";
    let study = |tolerance: &str, marks: &str| {
        format!(
            "tolerance = {tolerance}\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nperiods = 1\nsamples = 16\n\
             [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"om\"\nrange = [0.6, 3]\n{marks}"
        )
    };
    let of = |study: &str| run(model, study, |diagram, _| diagram);
    let coarse = of(&study("1e-6", ""));
    let coarse = coarse.branch("b").unwrap();
    let some: Vec<&Point> = coarse.points.iter().step_by(2).filter(|point| point.trust.spectrum.is_finite()).collect();
    let values: Vec<String> = some.iter().map(|point| format!("{:e}", point.parameters[0])).collect();
    let fine = of(&study("1e-8", &format!("mark = {{ om = [{}] }}\n", values.join(", "))));
    let marks: Vec<&Point> =
        fine.branch("b").unwrap().special.iter().filter(|s| s.kind == Kind::Mark).map(|s| &s.point).collect();
    let mut compared = 0;
    for own in &some {
        // The branch is folded, so that several cycles have the same frequency.
        let near = |other: &&&Point| {
            let apart = own.ranges.iter().zip(&other.ranges).flat_map(|(a, b)| [a[0] - b[0], a[1] - b[1]]);
            (other.parameters[0] - own.parameters[0]).abs() < 1e-14 && apart.map(f64::abs).fold(0.0, f64::max) < 1e-5
        };
        for other in marks.iter().filter(near) {
            let apart = |z: &Complex64| other.spectrum.iter().map(|w| (w - z).norm()).fold(f64::INFINITY, f64::min);
            let off = own.spectrum.iter().map(|z| apart(z) / z.norm().max(1.0)).fold(0.0, f64::max);
            let stated = own.trust.spectrum + other.trust.spectrum.max(1e-10);
            assert!(off <= stated, "om = {}: {off:e}, stated {stated:e}", own.parameters[0]);
            compared += 1;
        }
    }
    assert!(compared > 50, "{compared} of {} and {}", some.len(), marks.len());
}
