//! Maps over parameters in studies, against closed forms; threads, interruptions, limits, tables and exports.

use foldline::contract::{Event, Observer, Unobserved, Verdict};
use foldline::diagram::{CellAnswer, CellValue, Diagram, MapCell};
use foldline::explore::Plan;
use foldline::explore::cells::{Asked, ParameterMap, assembled, carry_out};
use foldline_store::run_file::Recorder;
use foldline_store::short::finished;
use foldline_store::study_file::{Study, parse_study};
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Folds at mu = ±2 (b/3)^(3/2) for b > 0, with three equilibria between them.
const CUSP: &str =
    "name = \"cusp\"\n[parameters]\nmu = -2\nb = 3\n[states]\nx = { equation = \"mu + b*x - x^3\", range = [-3, 3] }\n";
const FOLDS: &str = "[[seed]]\nname = \"low\"\nstate = { x = -2 }\n\
    [[branch]]\nname = \"all\"\nfrom = \"low\"\nfree = \"mu\"\nrange = [-2.5, 2.5]\n";
/// In polar coordinates r' = r (r - a) (2 - r): rest attracts the disc of radius a, a cycle of radius 2 everything else.
const DISC: &str = "name = \"disc\"\n[parameters]\na = 1\n[states]\n\
    x = { equation = \"x*(sqrt(x^2 + y^2) - a)*(2 - sqrt(x^2 + y^2)) - y\", range = [-3, 3] }\n\
    y = { equation = \"y*(sqrt(x^2 + y^2) - a)*(2 - sqrt(x^2 + y^2)) + x\", range = [-3, 3] }\n";

fn study(model: &str, text: &str) -> Study {
    parse_study(&format!("model = \"m\"\n{text}"), "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"))
}

fn mapped(study: &Study, jobs: usize, known: &[MapCell], observer: &dyn Observer) -> Vec<MapCell> {
    let finished = |diagram: Diagram, plan: &Plan| finished(diagram, plan, &study.model);
    carry_out(&Asked { model: &study.model, plan: &study.plan, finished: &finished }, jobs, known, observer)
}

fn only_map(study: &Study) -> ParameterMap {
    assembled(&study.plan.maps[0], &mapped(study, 2, &[], &Unobserved))
}

#[track_caller]
fn answers(map: &ParameterMap) -> Vec<&CellAnswer> {
    map.cells
        .iter()
        .map(|cell| cell.answer.as_ref().expect("it is computed").as_ref().expect("it has values"))
        .collect()
}

#[track_caller]
fn number(values: &[(String, CellValue)], name: &str) -> f64 {
    match values.iter().find(|(own, _)| own == name) {
        Some((_, CellValue::Number(value))) => *value,
        Some((_, CellValue::Count(value))) => *value as f64,
        other => panic!("{name}: {other:?}"),
    }
}

fn words(answer: &CellAnswer) -> &str {
    answer.category().map_or("", |(_, text)| text)
}

#[test]
fn special_points_are_where_theory_puts_them() {
    let study =
        study(CUSP, &format!("{FOLDS}[[map]]\nname = \"m\"\nwhat = \"points\"\nover = {{ b = [-1, 0.75, 3] }}\n"));
    let map = only_map(&study);
    let all = answers(&map);
    assert_eq!(all.iter().map(|own| words(own)).collect::<Vec<_>>(), ["none", "2 folds", "2 folds"]);
    for (answer, b) in all[1..].iter().zip([0.75f64, 3.0]) {
        let right = 2.0 * (b / 3.0).powf(1.5);
        for ((label, values), (name, exact)) in
            answer.items.iter().zip([("all: fold 1", right), ("all: fold 2", -right)])
        {
            assert_eq!(label, name);
            let (value, error) = (number(values, "value"), number(values, "error"));
            assert!((value - exact).abs() <= error && error < 1e-5, "{value} ± {error} for {exact}");
        }
    }
}

/// Frequencies of the folds of x'' + 2ζx' + x + x³ = A cos ωt by the balance of one harmonic. At the amplitude a, with
/// c = 1 + ¾a², W = ω² solves (c - W)² + 4ζ²W = A²/a². The larger root has a minimum over a, the fold of the small response,
/// and beyond it a maximum, that of the large one.
fn balanced(zeta: f64, force: f64) -> [f64; 2] {
    let larger = |a: f64| {
        let c = 1.0 + 0.75 * a * a;
        let p = c - 2.0 * zeta * zeta;
        p + (p * p - c * c + force * force / (a * a)).sqrt()
    };
    let roots: Vec<f64> = (1..200_000).map(|k| larger(f64::from(k) * 1e-5)).take_while(|root| !root.is_nan()).collect();
    let least = (0..roots.len()).min_by(|i, j| roots[*i].total_cmp(&roots[*j])).expect("there are roots");
    let most = roots[least..].iter().copied().fold(0.0, f64::max);
    [most.sqrt(), roots[least].sqrt()]
}

#[test]
fn the_jumps_of_a_hardening_spring_agree_with_python_and_with_one_harmonic() {
    let model = "name = \"spring\"\n[parameters]\nomega = 0.8\nA = 0.06\nzeta = 0.02\nk3 = 1\n[forcing]\nfrequency = \"omega\"\n\
        [states]\nx = { equation = \"v\", range = [-1, 1] }\n\
        v = { equation = \"-2*zeta*v - x - k3*x^3 + A*cos(omega*t)\", range = [-1, 1] }\n";
    let text = "[[seed]]\nname = \"below\"\nattractor = \"cycle\"\nsamples = 16\n[[branch]]\nname = \"response\"\n\
        from = \"below\"\nfree = \"omega\"\nrange = [0.6, 2.5]\n\
        [[map]]\nname = \"m\"\nwhat = \"points\"\nover = { zeta = [0.02, 0.04, 0.06] }\n";
    let map = only_map(&study(model, text));
    let all = answers(&map);
    assert_eq!(all.iter().map(|own| words(own)).collect::<Vec<_>>(), ["2 folds", "2 folds", "none"]);
    // The table of docs/book/maps-over-parameters.md, which Python computed, to its six decimals.
    for (answer, printed, zeta) in [(all[0], [1.378686, 1.121410], 0.02), (all[1], [1.152084, 1.112838], 0.04)] {
        let own: Vec<f64> = answer.items.iter().map(|(_, values)| number(values, "value")).collect();
        assert!(own.iter().zip(printed).all(|(a, b): (&f64, f64)| (a - b).abs() <= 0.6e-6), "{own:?}");
        // The next harmonic of the balance, a³/4 / (9 ω² - 1), shifts the frequency by less than 1 %.
        let theory = balanced(zeta, 0.06);
        assert!(own.iter().zip(theory).all(|(a, b)| (a - b).abs() < 0.01 * b), "{own:?} {theory:?}");
    }
}

#[test]
fn motions_are_counted_and_named() {
    let text = "[[map]]\nname = \"m\"\nwhat = \"motions\"\nsamples = 32\nover = { b = [-1, 2], mu = [0, 2] }\n";
    let map = only_map(&study(CUSP, text));
    let found: Vec<&str> = answers(&map).into_iter().map(words).collect();
    assert_eq!(found, ["equilibrium", "equilibrium", "2 equilibria", "equilibrium"]);
    let at: Vec<&[f64]> = map.cells.iter().map(|cell| &cell.at[..]).collect();
    assert_eq!(at, [[-1.0, 0.0], [-1.0, 2.0], [2.0, 0.0], [2.0, 2.0]]);
}

#[test]
fn shares_are_those_of_the_disc_within_their_intervals() {
    let text = "[[map]]\nname = \"m\"\nwhat = \"shares\"\nsamples = 400\nover = { a = [0.5, 1, 1.5] }\n";
    let map = only_map(&study(DISC, text));
    let mut inside = 0;
    for (answer, cell) in answers(&map).into_iter().zip(&map.cells) {
        assert_eq!(words(answer), "cycle + equilibrium");
        let (_, values) = answer.items.iter().find(|(label, _)| label == "equilibrium").expect("rest attracts");
        let exact = std::f64::consts::PI * cell.at[0] * cell.at[0] / 36.0;
        inside += usize::from((number(values, "share_low")..=number(values, "share_high")).contains(&exact));
        let sum: f64 = answer.items.iter().map(|(_, values)| number(values, "share")).sum();
        assert!((sum - 1.0).abs() < 1e-12);
    }
    // Three intervals of 95 %, with a seed for which all are met.
    assert_eq!(inside, 3);
}

#[test]
fn quantities_of_the_motion_that_settles_from_a_state() {
    let text = "[[map]]\nname = \"m\"\nwhat = [\"x_max\", \"period\"]\nstate = { x = 2 }\nparameters = { mu = 0 }\nover = { b = [1, 4] }\n";
    let map = only_map(&study(CUSP, text));
    for (answer, exact) in answers(&map).into_iter().zip([1.0, 2.0]) {
        assert!((number(&answer.values, "x_max") - exact).abs() < 1e-9);
        assert!(number(&answer.values, "period").is_nan());
        assert_eq!(words(answer), "equilibrium");
    }
}

#[test]
fn a_refined_map_is_right_on_the_fine_grid() {
    let text = "[[map]]\nname = \"m\"\nwhat = \"motions\"\nsamples = 64\nrefine = 3\n\
        over = { mu = { range = [-2, 2], count = 5 }, b = { range = [-1, 3], count = 5 } }\n";
    let map = only_map(&study(CUSP, text));
    assert_eq!(map.cells.len(), 33 * 33);
    assert!(map.complete && map.computed() < 33 * 33 / 2, "{}", map.computed());
    let step = 0.125;
    for cell in &map.cells {
        let [mu, b] = cell.at[..] else { panic!("two parameters") };
        let bound = |b: f64| if b > 0.0 { 2.0 * (b / 3.0).powf(1.5) } else { 0.0 };
        // Cells within two steps of the boundary are not judged: there the smaller basin may be missed by 64 samples.
        let (sure_in, sure_out) =
            (mu.abs() + 2.0 * step < bound(b - 2.0 * step), mu.abs() - 2.0 * step > bound(b + 2.0 * step));
        let found = cell.category.as_deref().expect("every cell has a category");
        if sure_in || sure_out {
            assert_eq!(found, if sure_in { "2 equilibria" } else { "equilibrium" }, "{mu} {b}");
        }
    }
}

#[test]
fn a_hypercube_has_one_value_in_each_part_and_cases_keep_their_order() {
    let text = "[[map]]\nname = \"m\"\nwhat = [\"x_max\"]\nstate = { x = 2 }\nhypercube = { b = [1, 3], mu = [-1, 0] }\ncount = 8\nrandom = 3\n\
        [[map]]\nname = \"n\"\nwhat = [\"x_max\"]\nstate = { x = 2 }\nover = [{ b = 2, mu = 0 }, { mu = 0, b = 1 }]\n";
    let study = study(CUSP, text);
    let cells = mapped(&study, 2, &[], &Unobserved);
    let map = assembled(&study.plan.maps[0], &cells);
    let part = |k: usize, low: f64, width: f64| {
        let mut parts: Vec<usize> = map.cells.iter().map(|cell| ((cell.at[k] - low) / width * 8.0) as usize).collect();
        parts.sort_unstable();
        parts
    };
    assert_eq!(part(0, 1.0, 2.0), (0..8).collect::<Vec<_>>());
    assert_eq!(part(1, -1.0, 1.0), (0..8).collect::<Vec<_>>());
    let listed = assembled(&study.plan.maps[1], &cells);
    assert_eq!(listed.cells.iter().map(|cell| cell.at.clone()).collect::<Vec<_>>(), [[2.0, 0.0], [1.0, 0.0]]);
}

/// Stops after a number of cells, which it counts.
struct Stopping {
    seen: AtomicUsize,
    most: usize,
    cells: Mutex<Vec<Vec<f64>>>,
}

impl Observer for Stopping {
    fn observe(&self, event: Event) -> Verdict {
        if let Event::Mapped(cell, ..) = event {
            self.seen.fetch_add(1, Ordering::Relaxed);
            self.cells.lock().expect("no thread failed").push(cell.at.clone());
        }
        if self.seen.load(Ordering::Relaxed) >= self.most { Verdict::Stop } else { Verdict::Continue }
    }
}

fn stopping(most: usize) -> Stopping {
    Stopping { seen: AtomicUsize::new(0), most, cells: Mutex::default() }
}

/// Cells without NaN, which would not compare equal.
fn plain(map: &ParameterMap) -> String {
    format!("{:?}", map.cells)
}

#[test]
fn threads_and_interruptions_do_not_change_a_map_and_nothing_is_computed_twice() {
    let text = format!(
        "{FOLDS}[[map]]\nname = \"m\"\nwhat = \"points\"\nrefine = 2\nover = {{ b = {{ range = [-1.1, 1.3], count = 4 }} }}\n"
    );
    let study = study(CUSP, &text);
    let whole = assembled(&study.plan.maps[0], &mapped(&study, 1, &[], &Unobserved));
    assert_eq!(plain(&whole), plain(&only_map(&study)));
    for most in [1, 3, 6] {
        let first = stopping(most);
        let known = mapped(&study, 1, &[], &first);
        assert_eq!(known.len(), most);
        let second = stopping(usize::MAX);
        let all = mapped(&study, 1, &known, &second);
        let again = second.cells.lock().expect("no thread failed").clone();
        assert!(again.iter().all(|at| known.iter().all(|cell| cell.at != *at)), "computed twice");
        assert_eq!(again.len() + most, whole.computed());
        assert_eq!(plain(&whole), plain(&assembled(&study.plan.maps[0], &all)));
    }
}

#[test]
fn cells_in_a_run_file_survive_a_writer_that_never_ends() {
    let text = format!("{FOLDS}[[map]]\nname = \"m\"\nwhat = \"points\"\nover = {{ b = [0.5, 1, 2, 3] }}\n");
    let study = study(CUSP, &text);
    let folder = tempfile::tempdir().expect("a folder can be made");
    let run = folder.path().join("run");
    let recorder = Recorder::create(&run, &study).expect("a run begins");
    let cells = mapped(&study, 1, &[], &Unobserved);
    for (k, cell) in cells[..2].iter().enumerate() {
        assert_eq!(recorder.observe(Event::Mapped(cell, k + 1, 4)), Verdict::Continue);
    }
    // As after a kill: neither finished nor closed. A copy stands for the file that the next process finds.
    let copy = folder.path().join("copy");
    std::fs::create_dir_all(&copy).expect("a folder can be made");
    for file in ["run.sqlite", "run.sqlite-wal"] {
        std::fs::copy(run.join(file), copy.join(file)).expect("the file is there");
    }
    drop(recorder);
    let (recorder, earlier) = Recorder::resume(&copy, &study).expect("the run can be resumed");
    // Texts, because a period that does not exist is NaN.
    assert_eq!(format!("{:?}", earlier.cells), format!("{:?}", &cells[..2]));
    let second = stopping(usize::MAX);
    let all = mapped(&study, 1, &earlier.cells, &second);
    assert_eq!((second.seen.load(Ordering::Relaxed), format!("{all:?}")), (2, format!("{cells:?}")));
    drop(recorder);
}

fn foldline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder).output().expect("it starts")
}

#[track_caller]
fn said(output: &Output, code: i32) -> [String; 2] {
    let texts = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    assert_eq!(output.status.code(), Some(code), "{texts:?}");
    texts
}

fn desk(model: &str, text: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder can be made");
    std::fs::write(folder.path().join("m.toml"), model).expect("it can be written");
    std::fs::write(folder.path().join("s.toml"), format!("model = \"m.toml\"\n{text}")).expect("it can be written");
    folder
}

#[test]
fn a_cell_that_does_not_end_is_reported_with_exit_code_3() {
    let text =
        format!("{FOLDS}[[map]]\nname = \"m\"\nwhat = \"points\"\nover = {{ b = [1, 2] }}\nmax-evaluations = 50\n");
    let desk = desk(CUSP, &text);
    let [_, errors] = said(&foldline(desk.path(), &["run", "s.toml"]), 3);
    assert!(
        errors.contains("m: 2 of 2 cells have no values: 2 × the cell did not end within 50 evaluations"),
        "{errors}"
    );
    let [table, _] = said(&foldline(desk.path(), &["table", "runs/s", "--map", "m", "--format", "csv"]), 0);
    assert!(table.contains("did not end within 50 evaluations"), "{table}");
}

#[test]
fn tables_exports_and_pictures_show_the_cells() {
    let text = format!(
        "{FOLDS}[[map]]\nname = \"over b\"\nwhat = \"points\"\nover = {{ b = [0.75, 3] }}\n\
         [[map]]\nname = \"plane\"\nwhat = \"motions\"\nsamples = 16\nover = {{ mu = [-1, 0, 1], b = [-1, 3] }}\nrefine = 1\n"
    );
    let desk = desk(CUSP, &text);
    let [summary, _] = said(&foldline(desk.path(), &["run", "s.toml"]), 0);
    assert!(
        summary.lines().any(|line| line.starts_with("over b") && line.contains("points") && line.ends_with("yes")),
        "{summary}"
    );
    let [table, _] = said(&foldline(desk.path(), &["table", "runs/s", "--map", "over b", "--format", "csv"]), 0);
    let lines: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(&lines[0][..4], ["b", "points", "point", "value"]);
    assert_eq!((lines.len(), lines[1][2]), (5, "all: fold 1"));
    let value: f64 = lines[4][3].parse().expect("a number");
    // The second fold at b = 3 is at mu = -2; the tolerance of the study is 1e-6, relative to 1 + |mu|.
    assert!((value + 2.0).abs() < 3e-6, "{table}");
    said(&foldline(desk.path(), &["export", "runs/s", "--format", "csv", "--out", "csv"]), 0);
    let exported = std::fs::read_to_string(desk.path().join("csv/map-over b.csv")).expect("it is written");
    assert!(exported.starts_with("b,points,point,value,") && exported.lines().count() == 5, "{exported}");
    said(&foldline(desk.path(), &["export", "runs/s", "--format", "netcdf", "--out", "run.nc"]), 0);
    let bytes = std::fs::read(desk.path().join("run.nc")).expect("it is written");
    for name in ["over b", "plane", "2 equilibria", "computed"] {
        assert!(bytes.windows(name.len()).any(|own| own == name.as_bytes()), "{name}");
    }
    for (name, words) in [("over b", "fold 1"), ("plane", "2 equilibria")] {
        said(&foldline(desk.path(), &["plot", "runs/s", "--map", name, "-o", "map.svg"]), 0);
        let svg = std::fs::read_to_string(desk.path().join("map.svg")).expect("it is written");
        assert!(svg.contains(words), "{name}");
    }
    let [_, errors] = said(&foldline(desk.path(), &["table", "runs/s", "--map", "plan"]), 2);
    assert!(errors.contains("no map \"plan\"") && errors.contains("plane"), "{errors}");
    // Nothing is left to compute.
    let [_, errors] = said(&foldline(desk.path(), &["run", "s.toml", "--resume"]), 0);
    assert!(!errors.contains("cells left"), "{errors}");
}

#[test]
fn mistakes_have_a_cause_and_a_cure() {
    let good = "[[map]]\nname = \"m\"\nwhat = \"points\"\nover = { b = [1, 2] }\n";
    let cases = [
        ("over = { b = [1, 2] }", "over = { c = [1, 2] }", "no parameter `c`"),
        ("over = { b = [1, 2] }", "over = { b = [1, 1] }", "the value 1 more than once"),
        ("over = { b = [1, 2] }", "over = { mu = [1, 2] }", "`mu`, which varies along \"all\""),
        ("over = { b = [1, 2] }", "over = []", "the list of cases is empty"),
        ("over = { b = [1, 2] }", "over = [{ b = 1 }, { mu = 1 }]", "have different parameters"),
        ("over = { b = [1, 2] }", "over = [{ b = 1 }]\nrefine = 1", "a list of cases cannot be refined"),
        ("over = { b = [1, 2] }", "over = { b = [1, 3, 2] }\nrefine = 1", "do not rise or fall"),
        ("over = { b = [1, 2] }", "over = { b = { range = [1, 2] } }", "no `count`"),
        ("over = { b = [1, 2] }", "hypercube = { b = [1, 2] }", "no `count`"),
        ("over = { b = [1, 2] }", "hypercube = { b = [2, 1] }\ncount = 3", "not a pair of rising numbers"),
        ("over = { b = [1, 2] }\n", "", "no `over`"),
        ("what = \"points\"", "what = \"folds\"", "cannot show \"folds\""),
        ("what = \"points\"", "what = [\"y_max\"]", "cannot show `y_max`"),
        ("what = \"points\"", "what = \"points\"\nsamples = 3", "`samples` has no effect"),
        ("what = \"points\"\n", "", "no `what`"),
        ("name = \"m\"", "name = \"all\"", "used twice"),
        ("name = \"m\"", "name = \"m\"\nrefined = 1", "refine"),
    ];
    for (piece, by, expected) in cases {
        let text = format!("model = \"m\"\n{FOLDS}{}", good.replace(piece, by));
        let found = parse_study(&text, "study.toml", CUSP, "m").err().unwrap_or_else(|| panic!("{by} is accepted"));
        let all: Vec<String> = found.iter().map(|one| one.to_string()).collect();
        assert!(all.iter().any(|one| one.contains(expected) && one.contains("study.toml:")), "{by}: {all:?}");
        assert!(all.iter().all(|one| one.contains("help")), "{by}: {all:?}");
    }
    let alone =
        parse_study(&format!("model = \"m\"\n{good}"), "study.toml", CUSP, "m").expect_err("it has no branches");
    assert!(alone[0].to_string().contains("no branches"), "{alone:?}");
    let twice = FOLDS.replace("state", "parameters = { b = 2 }\nstate")
        + "[[seed]]\nname = \"other\"\nstate = { x = 1 }\nparameters = { b = 1 }\n";
    let found =
        parse_study(&format!("model = \"m\"\n{twice}{good}"), "study.toml", CUSP, "m").expect_err("b is ambiguous");
    assert!(found[0].to_string().contains("several values of `b`"), "{found:?}");
}
