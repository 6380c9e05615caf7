//! Runs that go on with a longer study, and lines that are appended to a study.

use foldline::contract::Unobserved;
use foldline::diagram::{Diagram, Kind, Origin};
use foldline::explore::{self, Start};
use foldline_store::run_file::{Recorder, RunFileError, could_resume, load, shorten};
use foldline_store::study_file::{Action, Place, Refusal, Study, added, append, parse_study};
use std::path::Path;

/// x' = h + μx − x³: a pitchfork that h unfolds.
const MODEL: &str = "name = \"unfolded\"\n[parameters]\nmu = 1.0\nh = 0.0\nk = 1.0\n[states.x]\n\
    equation = \"h + mu*x - k*x^3\"\n";
const STUDY: &str = "model = \"unfolded.toml\" # kept\n\n[[seed]]\nname = \"start\"\nstate = { x = 1 }\n\n\
    [[branch]]\nname = \"main\" # the upper one\nfrom = \"start\"\nfree = \"mu\"\nrange = [-1, 2]\n# the end";

fn study(text: &str) -> Study {
    parse_study(text, "study.toml", MODEL, "unfolded.toml").unwrap_or_else(|found| panic!("{found:#?}"))
}

fn computed(study: &Study, folder: &Path) -> Diagram {
    let (recorder, earlier) = Recorder::resume(folder, study).expect("the run can be resumed");
    let system = explore::System::of_plan(&study.model, &study.plan);
    explore::run(&system, &study.plan, 1, earlier, &recorder);
    recorder.complete().expect("the run can be written");
    load(folder).expect("the run can be read").diagram
}

#[test]
fn a_branch_starts_at_exactly_the_value_given_inside_another() {
    let text = format!(
        "{STUDY}\n[[branch]]\nname = \"unfolding\"\nfrom = {{ branch = \"main\", near = {{ mu = 1.25, x_max = 1.1 }} }}\n\
         free = \"h\"\nrange = [-1, 1]\n"
    );
    let folder = tempfile::tempdir().expect("a folder can be made");
    let diagram = computed(&study(&text), &folder.path().join("run"));
    let branch = diagram.branch("unfolding").expect("it was followed");
    let origin = Origin::Switch { parent: "main".into(), kind: Kind::Mark, parameter: 1.25 };
    assert_eq!(branch.origin, origin);
    assert!(branch.points.iter().all(|point| point.parameters[0] == 1.25));
    // At h = 0 the state is √μ; folds where 3x² = μ, at h = ∓2 (μ/3)^(3/2).
    let start = branch.points.iter().find(|point| point.position == 0).expect("it has a start");
    assert!((start.ranges[0][1] - 1.25f64.sqrt()).abs() < 1e-9);
    let fold = -2.0 * (1.25f64 / 3.0).powf(1.5);
    let folds: Vec<f64> =
        branch.special.iter().filter(|s| s.kind == Kind::Fold).map(|s| s.point.parameters[1]).collect();
    assert!(folds.iter().any(|value| (value - fold).abs() < 1e-6), "{folds:?} without {fold}");
    // In memory, without a file, the branch is the same.
    let own = study(&text);
    let system = explore::System::of_plan(&own.model, &own.plan);
    let free = explore::run(&system, &own.plan, 2, Diagram::default(), &Unobserved);
    let other = free.branch("unfolding").expect("it was followed");
    assert_eq!(other.points.len(), branch.points.len());
    assert_eq!(other.points.last().map(|p| p.parameters.clone()), branch.points.last().map(|p| p.parameters.clone()));
}

#[test]
fn a_value_that_the_branch_does_not_have_is_said() {
    let text = format!(
        "{STUDY}\n[[branch]]\nname = \"beyond\"\nfrom = {{ branch = \"main\", near = {{ mu = 7 }} }}\nfree = \"h\"\n\
         range = [-1, 1]\n"
    );
    let own = study(&text);
    let system = explore::System::of_plan(&own.model, &own.plan);
    let diagram = explore::run(&system, &own.plan, 1, Diagram::default(), &Unobserved);
    let said = diagram.branch("beyond").and_then(|branch| branch.ends[0].clone()).expect("it has ended").to_string();
    assert!(said.contains("no solution at 7.000000 was found next to the closest point of the branch main"), "{said}");
}

#[test]
fn mistakes_in_a_start_inside_a_branch_have_a_place() {
    let with = |from: &str| {
        let text = format!("{STUDY}\n[[branch]]\nname = \"b\"\nfrom = {from}\nfree = \"h\"\nrange = [-1, 1]\n");
        parse_study(&text, "study.toml", MODEL, "unfolded.toml").expect_err(from)
    };
    for (from, said) in [
        ("{ branch = \"main\" }", "`from` names a branch, but no point of it"),
        ("{ near = { mu = 1 } }", "`from` names no branch"),
        ("{ branch = \"mein\", near = { mu = 1 } }", "there is no branch \"mein\""),
        ("{ branch = \"start\", near = { mu = 1 } }", "\"start\" is a seed, and has no points inside"),
        ("{ branch = \"main\", near = {} }", "`near` gives no value"),
        ("{ branch = \"main\", near = { nu = 1 } }", "`nu` is not a quantity of a branch"),
        ("{ branch = \"main\", near = { x_h1 = 1 } }", "`x_h1` is not kept with every point"),
        ("{ branch = \"main/branch-point-1\", near = { mu = 1 } }", "will not be followed"),
        ("{ branch = \"b\", near = { mu = 1 } }", "further down"),
    ] {
        let found = with(from);
        assert!(found.iter().any(|one| one.message.contains(said) && one.line == 15), "{from}: {found:#?}");
    }
}

#[test]
fn a_run_goes_on_with_a_longer_study_and_back() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let run = folder.path().join("run");
    let short = study(STUDY);
    let before = computed(&short, &run);
    let long = study(&format!(
        "{STUDY}\n[[branch]]\nname = \"more\"\nfrom = {{ branch = \"main\", near = {{ mu = 0.5 }} }}\nfree = \"h\"\n\
         range = [-1, 1]\n[[survey]]\nname = \"here\"\nfree = \"mu\"\nvalues = [1]\nstarts = 4\n\
         [[sweep]]\nname = \"up\"\nfrom = {{ branch = \"main\", near = {{ mu = 0.5, x_max = 0.7 }} }}\nfree = \"mu\"\nvalues = [0.5, 0.6]\n"
    ));
    let added = could_resume(&run, &long).expect("it is longer");
    assert_eq!(added.items, ["more", "here", "up"]);
    let after = computed(&long, &run);
    let points = |diagram: &Diagram| format!("{:?}", diagram.branch("main").map(|branch| branch.points.clone()));
    assert_eq!(points(&after), points(&before));
    assert_eq!(after.responses.len(), 2);
    let swept = &after.response_set("up").expect("it was swept").responses;
    assert!((swept[1].ranges[0][1] - 0.6f64.sqrt()).abs() < 1e-6, "{swept:?}");
    assert_eq!(load(&run).expect("the run can be read").study_text, long.text);
    // Nothing that was computed may be different.
    for (from, to) in
        [("range = [-1, 2]", "range = [-1, 3]"), ("name = \"main\"", "name = \"other\""), ("x = 1", "x = 2")]
    {
        let other = study(&STUDY.replace(from, to));
        assert!(matches!(could_resume(&run, &other), Err(RunFileError::Different(..))), "{to}");
        assert!(Recorder::resume(&run, &other).is_err());
    }
    assert!(Recorder::resume(&run, &short).is_err());
    assert_eq!(shorten(&run, &short).expect("it is the beginning"), 3);
    let back = load(&run).expect("the run can be read");
    assert_eq!((back.study_text.as_str(), back.diagram.branches.len(), back.diagram.responses.len()), (STUDY, 1, 0));
    assert_eq!(points(&back.diagram), points(&before));
}

fn point_of(diagram: &Diagram, kind: Kind) -> foldline::diagram::Point {
    let branch = diagram.branch("main").expect("it was followed");
    branch
        .special
        .iter()
        .find(|special| special.kind == kind)
        .map(|special| special.point.clone())
        .expect("it was found")
}

#[test]
fn each_action_appends_lines_and_keeps_the_rest() {
    let own = study(STUDY);
    let system = explore::System::of_plan(&own.model, &own.plan);
    let diagram = explore::run(&system, &own.plan, 1, Diagram::default(), &Unobserved);
    let point = diagram.branches[0].points.iter().find(|point| point.position == 3).expect("there are more points");
    let place = Place { branch: "main", point, special: None };
    let free = "h".to_string();
    for (action, lines) in [
        (Action::Continue { free: free.clone() }, [14, 18]),
        (Action::Simulate, [14, 18]),
        (Action::Sweep { up: true }, [14, 19]),
        (Action::Sweep { up: false }, [14, 19]),
        (Action::Survey, [14, 18]),
    ] {
        let found = append(&own, &place, &action).unwrap_or_else(|why| panic!("{action:?}: {why:?}"));
        assert!(found.text.starts_with(STUDY), "{}", found.text);
        assert_eq!(found.lines, lines, "{}", found.text);
        let longer = study(&found.text);
        assert_eq!(added(&own, &longer).expect("it is longer").items, [found.name.as_str()]);
        let again = append(&longer, &place, &action).expect("a second one has another name");
        assert_ne!(again.name, found.name);
    }
    let Refusal::Because(why) = append(&own, &place, &Action::Switch).expect_err("nothing leaves here") else {
        panic!("no reason")
    };
    assert!(why.contains("special points only"), "{why}");
    let special = point_of(&diagram, Kind::BranchPoint);
    let at = Place { branch: "main", point: &special, special: Some((Kind::BranchPoint, 1)) };
    let followed = append(&own, &at, &Action::Follow { free }).expect("it can be followed");
    assert!(followed.text.contains("hold = \"branch-point\"\nof = \"main\"\nnear = "), "{}", followed.text);
    let switched = append(&own, &at, &Action::Switch).expect("a branch leaves here");
    let line = "name = \"main\" # the upper one\nswitch = { branch-point-1 = 1 }\nfrom";
    assert!(switched.text.contains(line), "{}", switched.text);
    assert_eq!((switched.lines, switched.name.as_str()), ([9, 9], "main/branch-point-1"));
    let longer = study(&switched.text);
    assert_eq!(
        added(&own, &longer).expect("it is longer").switched,
        [("main".to_string(), Kind::BranchPoint, Some(1))]
    );
    assert!(append(&longer, &at, &Action::Switch).is_err());
    // An entry joins those that are there.
    let has = STUDY.replace("free = \"mu\"", "switch = { hopf = 1 } # cycles\nfree = \"mu\"");
    let joined = append(&study(&has), &at, &Action::Switch).expect("a branch leaves here");
    assert!(joined.text.contains("switch = { hopf = 1, branch-point-1 = 1 } # cycles"), "{}", joined.text);
}

#[test]
fn a_run_switches_later_and_forgets_what_it_switched_to() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let run = folder.path().join("run");
    let short = study(STUDY);
    let before = computed(&short, &run);
    let special = point_of(&before, Kind::BranchPoint);
    let at = Place { branch: "main", point: &special, special: Some((Kind::BranchPoint, 1)) };
    let long = study(&append(&short, &at, &Action::Switch).expect("a branch leaves here").text);
    let after = computed(&long, &run);
    assert!(after.branch("main/branch-point-1").is_some_and(|branch| branch.points.len() > 5));
    let near = long.plan.branches.iter().any(|branch| matches!(branch.start, Start::Near(_)));
    assert!(!near);
    assert_eq!(shorten(&run, &short).expect("it is the beginning"), 1);
    assert_eq!(load(&run).expect("the run can be read").diagram.branches.len(), 1);
}
