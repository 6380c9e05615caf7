//! Design questions: mistakes in a study have place and cure; answers in a run file are exact to the bit.

use foldline::contract::{Event, Observer, Verdict};
use foldline::diagram::{Answer, Binds, Design, Kind};
use foldline_store::run_file::{Recorder, could_resume, load, shorten};
use foldline_store::study_file::{Study, parse_study};

const MODEL: &str = "name = \"m\"\n[parameters]\nl = 1.0\np = 0.5\nq = 0.0\n[states]\nx = \"1 - p - q - l^2 - x^2\"\n";
const START: &str = "model = \"m\"\n[[seed]]\nname = \"s\"\nstate = { x = 0.1 }\n\
    [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"l\"\nrange = [-1, 2]\n";
const QUESTION: &str = "[[design]]\nname = \"d\"\nof = \"b\"\nleast = { p = [0, 2] }\nwithout = \"motion\"\n";

fn study(text: &str) -> Study {
    parse_study(text, "study.toml", MODEL, "m").unwrap_or_else(|found| panic!("{found:?}"))
}

#[test]
fn mistakes_have_a_cause_and_a_cure() {
    let cases = [
        ("of = \"b\"", "of = \"c\"", "there is no branch \"c\""),
        ("of = \"b\"\n", "", "has no `of`"),
        ("least = { p = [0, 2] }", "least = { l = [0, 2] }", "`l` is the free parameter of the branch"),
        ("least = { p = [0, 2] }", "least = { p = [1, 2] }", "the branch \"b\" has p = 0.5, outside this range"),
        ("least = { p = [0, 2] }", "least = { p = [0, 2], q = [0, 1] }", "exactly one parameter"),
        ("least = { p = [0, 2] }\n", "", "no `least` or `greatest`"),
        ("least =", "most =", "most"),
        ("without = \"motion\"", "without = \"folds\"", "`without` cannot be \"folds\""),
        ("without = \"motion\"", "below = { p = 2 }", "`p` is a parameter"),
        ("without = \"motion\"", "below = { y_max = 2 }", "y_max"),
        ("without = \"motion\"", "range = [-3, 1]\nwithout = \"motion\"", "from -1 to 2 only"),
        ("without = \"motion\"", "without = \"motion\"\nalong = { p = [0, 1] }", "already free"),
        ("without = \"motion\"\n", "", "no condition"),
        ("name = \"d\"", "name = \"b\"", "used twice"),
    ];
    for (piece, by, said) in cases {
        let text = format!("{START}{}", QUESTION.replace(piece, by));
        let found = parse_study(&text, "study.toml", MODEL, "m").err().unwrap_or_else(|| panic!("{by} is accepted"));
        let all: Vec<String> = found.iter().map(|one| one.to_string()).collect();
        assert!(all.iter().any(|one| one.contains(said) && one.contains("study.toml:")), "{by}: {all:?}");
        assert!(all.iter().all(|one| one.contains("help")), "{by}: {all:?}");
    }
}

fn answers() -> [Design; 2] {
    let answer = Answer {
        value: 1.0 / 3.0,
        error: 5e-324,
        at: -0.0,
        binds: Binds::UpperEnd,
        kind: Kind::PeriodDoubling,
        curve: "d/period-doubling-1".into(),
    };
    let one = Design {
        name: "d".into(),
        of: "b".into(),
        free: 0,
        vary: 1,
        range: [0.1 + 0.2, 1e300],
        greatest: true,
        wanted: "x_max < 2".into(),
        answer: Some(answer),
        reasons: vec!["one\ncure".into(), "two".into()],
        checks: Vec::new(),
    };
    let other = Design { name: "none".into(), answer: None, checks: vec!["seen".into()], ..one.clone() };
    [one, other]
}

#[test]
fn answers_are_stored_exactly_and_a_changed_question_is_another_study() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    let own = study(&format!("{START}{QUESTION}"));
    let recorder = Recorder::create(&run, &own).unwrap();
    for design in &answers() {
        assert_eq!(recorder.observe(Event::Design(design)), Verdict::Continue);
    }
    recorder.complete().unwrap();
    let found = load(&run).unwrap().diagram.designs;
    assert_eq!(found, answers());
    assert!(found[0].answer.as_ref().unwrap().at.is_sign_negative());
    let changed = study(&format!("{START}{}", QUESTION.replace("[0, 2]", "[0, 3]")));
    let why = could_resume(&run, &changed).expect_err("an answer belongs to its question").to_string();
    assert!(why.contains("design question \"d\" is different"), "{why}");
    shorten(&run, &study(START)).unwrap();
    let left: Vec<String> = load(&run).unwrap().diagram.designs.into_iter().map(|own| own.name).collect();
    assert_eq!(left, ["none"]);
}
