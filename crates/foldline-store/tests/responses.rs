//! Surveys and sweeps in study files: plans, and diagnostics for mistakes.

use foldline::explore::Start;
use foldline_store::study_file::{Study, parse_study};

const MODEL: &str = "name = \"pitchfork\"\n[parameters]\nmu = 1.0\nK = 2.0\n[states.x]\nequation = \"mu*x - K*x^3\"\n";

const STUDY: &str = r#"model = "pitchfork.toml"
parameters = { K = 3 }

[[seed]]
name = "start"
state = { x = 0.1 }

[[survey]]
name = "many"
free = "mu"
parameters = { K = 1 }
range = [-1, 2]
count = 4
starts = 8

[[sweep]]
name = "down"
from = "start"
free = "mu"
range = [2, 0.5]
count = 4
"#;

fn parse(text: &str) -> Result<Study, String> {
    parse_study(text, "study.toml", MODEL, "pitchfork.toml")
        .map_err(|found| found.iter().map(|d| d.to_string()).collect::<Vec<_>>().join("\n"))
}

#[test]
fn a_study_may_simulate_only() {
    let plan = parse(STUDY).unwrap().plan;
    assert!(plan.branches.is_empty());
    let (survey, sweep) = (&plan.surveys[0], &plan.sweeps[0]);
    assert_eq!((survey.values.as_slice(), survey.starts, survey.random), (&[-1.0, 0.0, 1.0, 2.0][..], 8, 1));
    assert_eq!(survey.parameters, [1.0, 1.0]);
    assert_eq!((sweep.values.as_slice(), &sweep.start, sweep.free), (&[2.0, 1.5, 1.0, 0.5][..], &Start::Seed(0), 0));
    let listed = STUDY.replace("range = [2, 0.5]\ncount = 4", "values = [1, 3, 2]");
    assert_eq!(parse(&listed).unwrap().plan.sweeps[0].values, [1.0, 3.0, 2.0]);
}

#[test]
fn mistakes_are_reported_with_position_and_cure() {
    let cases: [(&str, &str, &[&str]); 11] = [
        ("range = [-1, 2]", "range = [2, -1]", &["study.toml:12:9", "the wrong way round", "write [-1, 2]"]),
        ("count = 4\nstarts", "starts", &["study.toml:12:9", "has no `count`, the number of values", "count = 101"]),
        ("starts = 8", "starts = 0", &["study.toml:14:10", "out of range"]),
        ("range = [-1, 2]\ncount = 4\n", "", &["this survey has no values", "values = [3, 3.5, 4]"]),
        ("count = 4\nstarts", "count = 4\nvalues = [1]\nstarts", &["both `values` and a `range`"]),
        ("from = \"start\"", "from = \"stat\"", &["study.toml:18:8", "no seed \"stat\"", "did you mean `start`"]),
        ("from = \"start\"\n", "", &["this sweep has no `from`"]),
        ("name = \"down\"", "name = \"many\"", &["study.toml:17:8", "used twice"]),
        ("free = \"mu\"\nparameters", "free = \"nu\"\nparameters", &["study.toml:10:8", "nu", "mu"]),
        ("free = \"mu\"\nrange = [2", "range = [2", &["this sweep has no free parameter"]),
        ("starts = 8", "starts = 8\nfrom = \"start\"", &["unknown key `from` in a survey"]),
    ];
    for (piece, by, expected) in cases {
        let text = STUDY.replacen(piece, by, 1);
        assert_ne!(text, STUDY, "{piece}");
        let message = parse(&text).err().unwrap_or_else(|| panic!("accepted: {by}"));
        for part in expected {
            assert!(message.contains(part), "`{part}` is missing in:\n{message}");
        }
    }
}
