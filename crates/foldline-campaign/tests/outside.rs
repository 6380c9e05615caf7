//! External problems: the quick ones pass, and the checks distinguish right from wrong values.

use foldline_campaign::outside::expectations::{Check, Problem, Right, Run};
use foldline_campaign::outside::reporting::{Line, Verdict, counts, placed, renewed, text};
use foldline_campaign::outside::running::Program;
use foldline_campaign::outside::{folder, judged};

#[test]
fn quick_external_problems_pass_all_checks() {
    let problems = Problem::all(&folder()).expect("the problems can be read");
    let mut wrong = Vec::new();
    let mut checks = 0;
    for problem in &problems {
        for run in problem.runs.iter().filter(|run| run.quick) {
            assert_eq!(run.command, ["run"], "{}: only a study can be quick", problem.name);
            let lines = judged(problem, run, &Program::Library);
            checks += lines.len();
            wrong.extend(lines.into_iter().filter(|line| line.verdict != Verdict::Right));
        }
    }
    assert!(checks >= 100, "{checks} checks");
    assert!(wrong.is_empty(), "{}", text(&wrong));
}

#[test]
fn every_expected_value_has_a_source_and_every_run_its_files() {
    for problem in Problem::all(&folder()).expect("the problems can be read") {
        assert!(
            !problem.source.is_empty() && !problem.question.is_empty() && !problem.runs.is_empty(),
            "{}",
            problem.name
        );
        for run in &problem.runs {
            assert!(problem.folder.join(&run.file).is_file(), "{}: {}", problem.name, run.file);
            assert!(run.right.iter().all(|right| !right.source.is_empty()), "{}: {}", problem.name, run.file);
        }
    }
}

/// Evaluates one check on the fold of x' = 1 - mu/s - x² at s = 1e-6.
fn fold_with(check: &str) -> Line {
    let mut problem = Problem::read(&folder().join("fold-at-any-scale")).expect("it can be read");
    let run = problem.runs.iter().find(|run| run.file == "s-1e-6.toml").expect("it is there").clone();
    let check: Check = toml::from_str(check).expect("a check");
    let run = Run { right: vec![Right { check, source: "here".to_string() }], ..run };
    problem.runs = vec![run.clone()];
    judged(&problem, &run, &Program::Library).pop().expect("a line for the check")
}

#[track_caller]
fn is(check: &str, right: bool) {
    let line = fold_with(check);
    assert_eq!(line.verdict == Verdict::Right, right, "{check}: {:?}", line.verdict);
}

#[test]
fn wrong_values_fail_their_checks() {
    is("special = { kind = 'fold', at = { mu = [1e-6, 1e-13] }, changes = [1, 0] }", true);
    is("special = { kind = 'fold', at = { mu = [1.001e-6, 1e-13] } }", false);
    is("special = { kind = 'fold', at = { mu = [1e-6, 1e-13] }, changes = [0, 2] }", false);
    is("special = { kind = 'hopf' }", false);
    is("special = { kind = 'fold', branch = 'another' }", false);
    is("special = { kind = 'fold', at = { nothing = [1, 1] } }", false);
    is("absent = { kind = 'fold' }", false);
    is("absent = { kind = 'fold', at = { mu = [0, 1e-9] } }", true);
    is("count = { kind = 'fold', between = [1, 1] }", true);
    is("count = { kind = 'fold', between = [2, 3] }", false);
    is("ends = { code = 'bound', at = { mu = [-3e-6, 1e-12] } }", true);
    is("ends = { code = 'bound', at = { mu = [3e-6, 1e-12] } }", false);
    is("ends = { code = 'closed' }", false);
    is("joins = { kind = 'hopf', between = [0, 1], within = 1 }", false);
    is("point = { at = { mu = [0, 1e-12], x = [1, 1e-6] } }", true);
    is("point = { at = { mu = [0, 1e-12], x = [1.1, 1e-6] } }", false);
    is("unstable = { of = 'x', range = [0.1, 3], is = 0 }", true);
    is("unstable = { of = 'x', range = [-3, 3], is = 0 }", false);
    is("unstable = { of = 'x', range = [10, 11], is = 0 }", false);
    is("solutions = { parameter = 'mu', value = -1e-6, is = 1 }", true);
    is("solutions = { parameter = 'mu', value = -1e-6, is = 2 }", false);
    is("branches = { at = { mu = [0, 1e-12] }, is = 1 }", true);
    is("branches = { at = { mu = [0, 1e-12] }, is = 2 }", false);
    is("points = { most = 1000 }", true);
    is("points = { most = 2 }", false);
    is("settles = { motions = ['cycle'], share = 0.5 }", false);
    is("response = { motion = 'cycle', at = {} }", false);
    is("says = { words = ['purple'] }", false);
}

#[test]
fn results_and_the_table_count_each_problem_separately() {
    let line =
        |problem: &str, verdict: Verdict| Line { problem: problem.into(), run: "r".into(), check: "c".into(), verdict };
    let lines =
        [line("a", Verdict::Right), line("ab", Verdict::Wrong("no".into())), line("a", Verdict::Wrong("no".into()))];
    let all = text(&lines);
    assert_eq!([counts(&all, "a"), counts(&all, "ab"), counts(&all, "b")], [[1, 2], [0, 1], [0, 0]]);
    let problems = Problem::all(&folder()).unwrap();
    let [one, other] = [&problems[0].name, &problems[1].name];
    let [known, now] = [
        text(&[line(one, Verdict::Right), line(other, Verdict::Right)]),
        text(&[line(other, Verdict::Wrong("no".into()))]),
    ];
    let both = renewed(&problems, &known, &now);
    assert_eq!([counts(&both, one), counts(&both, other)], [[1, 1], [0, 1]]);
    let page = "before <!-- outside: begin --> old <!-- outside: end --> after";
    assert_eq!(
        placed(page, "new").as_deref(),
        Some("before <!-- outside: begin -->\n\nnew\n<!-- outside: end --> after")
    );
    assert_eq!(placed("no markers", "new"), None);
}
