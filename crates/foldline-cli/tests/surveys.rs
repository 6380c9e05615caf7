//! Surveys and sweeps where motions are easily confused: impacts, forces that jump, equal ranges, folds beside a value.

use std::path::Path;
use std::process::{Command, Output};

fn foldline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder).output().unwrap()
}

/// Rows of the table of responses, by name of the column.
struct Rows {
    heads: Vec<String>,
    rows: Vec<Vec<String>>,
    /// Output of the run.
    said: String,
}

impl Rows {
    fn word(&self, row: usize, name: &str) -> &str {
        &self.rows[row][self.heads.iter().position(|head| head == name).unwrap()]
    }

    fn number(&self, row: usize, name: &str) -> f64 {
        self.word(row, name).parse().unwrap_or(f64::NAN)
    }

    fn all(&self, name: &str) -> Vec<&str> {
        (0..self.rows.len()).map(|row| self.word(row, name)).collect()
    }
}

/// Runs a study and returns its responses; the exit code must be `code`.
#[track_caller]
fn responses(model: &str, study: &str, code: i32) -> Rows {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("model.toml"), model).unwrap();
    std::fs::write(folder.path().join("study.toml"), format!("model = \"model.toml\"\n{study}")).unwrap();
    let output = foldline(folder.path(), &["run", "study.toml", "--out", "run"]);
    let said = String::from_utf8_lossy(&[&output.stdout[..], &output.stderr[..]].concat()).into_owned();
    assert_eq!(output.status.code(), Some(code), "{said}");
    let table = foldline(folder.path(), &["table", "run", "--responses", "--format", "csv"]);
    let table = String::from_utf8(table.stdout).unwrap();
    // Quoted cells, such as reasons, are not used here.
    let mut lines = table.lines().map(|line| line.split(',').map(String::from).collect::<Vec<_>>());
    Rows { heads: lines.next().unwrap(), rows: lines.collect(), said }
}

/// x'' + c x' + k x = f + A cos ωt, solved in closed form.
#[derive(Clone, Copy)]
struct Linear {
    c: f64,
    k: f64,
    f: f64,
    amplitude: f64,
    omega: f64,
}

impl Linear {
    /// State at time `t` from `[x, x']` at time `from`.
    fn at(&self, [x, v]: [f64; 2], from: f64, t: f64) -> [f64; 2] {
        let Linear { c, k, f, amplitude, omega } = *self;
        let (stiff, damp) = (k - omega * omega, c * omega);
        let size = amplitude / (stiff * stiff + damp * damp);
        let forced = |t: f64| {
            let (sin, cos) = (omega * t).sin_cos();
            [f / k + size * (stiff * cos + damp * sin), size * omega * (damp * cos - stiff * sin)]
        };
        let ([x0, v0], [xt, vt]) = (forced(from), forced(t));
        let (decay, frequency) = (0.5 * c, (k - 0.25 * c * c).sqrt());
        let ([a, b], s) = ([x - x0, (v - v0 + decay * (x - x0)) / frequency], t - from);
        let ((sin, cos), fades) = ((frequency * s).sin_cos(), (-decay * s).exp());
        let (free, slope) = (a * cos + b * sin, frequency * (b * cos - a * sin));
        [xt + fades * free, vt + fades * (slope - decay * free)]
    }
}

/// Smallest and largest x and x' over the last of `periods` forcing periods of a motion that is linear between the
/// passages of x through `d`: `law` gives the oscillator on each side, and the state after a passage.
fn exact(
    d: f64,
    periods: usize,
    law: &dyn Fn(bool) -> Linear,
    after: &dyn Fn([f64; 2]) -> ([f64; 2], bool),
) -> [[f64; 2]; 2] {
    const PARTS: usize = 20_000;
    let period = std::f64::consts::TAU / law(false).omega;
    let (mut state, mut beyond, mut from) = ([0.0, 0.0], false, 0.0);
    let mut ranges = [[f64::MAX, f64::MIN]; 2];
    let mut note = |period: usize, x: [f64; 2]| {
        if period + 1 == periods {
            for (own, x) in ranges.iter_mut().zip(x) {
                *own = [own[0].min(x), own[1].max(x)];
            }
        }
    };
    for part in 0..periods * PARTS {
        let end = (part + 1) as f64 * period / PARTS as f64;
        loop {
            let own = law(beyond);
            let outside = |t: f64| {
                let x = own.at(state, from, t)[0] - d;
                if beyond { x < 0.0 } else { x > 0.0 }
            };
            if !outside(end) {
                break;
            }
            let (mut a, mut b) = (from, end);
            for _ in 0..80 {
                let middle = 0.5 * (a + b);
                if outside(middle) { b = middle } else { a = middle }
            }
            let before = own.at(state, from, a);
            note(part / PARTS, before);
            let (x, side) = after(before);
            note(part / PARTS, x);
            (state, beyond, from) = (x, side, a);
        }
        state = law(beyond).at(state, from, end);
        from = end;
        note(part / PARTS, state);
    }
    ranges
}

/// Samples of 20 000 a period miss an extremum by (2π/20000)²/8 = 1.2e-8 of the amplitude, and those of higher harmonics by
/// more; the motion has settled to 1e-7 of its extent.
const EXACT: f64 = 1e-6;

#[track_caller]
fn assert_ranges(rows: &Rows, row: usize, [x, v]: [&str; 2], expected: [[f64; 2]; 2]) {
    for (name, [low, high]) in [x, v].into_iter().zip(expected) {
        for (end, expected) in [("min", low), ("max", high)] {
            let found = rows.number(row, &format!("{name}_{end}"));
            assert!((found - expected).abs() < EXACT, "{name}_{end} {found} instead of {expected}");
        }
    }
}

#[test]
fn a_cycle_with_an_impact_is_listed_once_and_with_the_impact_in_its_ranges() {
    let model = r#"units = "labels"
[parameters]
c = 0.232
F0 = -0.012
A = 1.325
om = 1.144
d = 0.322
e = 0.688
[forcing]
frequency = "om"
[states."x''"]
equation = "A*cos(om*t) + F0 - c*x' - x"
range = [-2.0, 0.322]
velocity = { range = [-2.0, 2.0] }
[contact.a]
at = "x"
clearance = "d"
restitution = "e"
"#;
    let survey = "[[survey]]\nname = \"s\"\nfree = \"om\"\nvalues = [1.144]\nstarts = 16\n";
    let seed = "[[seed]]\nname = \"a\"\nattractor = \"cycle\"\n";
    let sweep = "[[sweep]]\nname = \"w\"\nfrom = \"a\"\nfree = \"om\"\nvalues = [1.144]\n";
    let found = responses(model, &format!("{seed}{survey}{sweep}"), 0);
    assert_eq!(found.all("motion"), ["cycle", "cycle"]);
    assert_eq!(found.all("hits"), ["16", "1"]);
    let law = |_: bool| Linear { c: 0.232, k: 1.0, f: -0.012, amplitude: 1.325, omega: 1.144 };
    let expected = exact(0.322, 40, &law, &|[_, v]| ([0.322, -0.688 * v], false));
    assert_eq!(expected[0][1], 0.322);
    for row in 0..2 {
        assert_ranges(&found, row, ["x", "x'"], expected);
    }
}

#[test]
fn a_cycle_whose_force_jumps_is_listed_once_and_with_the_corner_in_its_ranges() {
    let model = r#"units = "labels"
[parameters]
c = 0.036
F0 = 0.13
A = 0.992
om = 0.585
[forcing]
frequency = "om"
[states]
x = { equation = "v", range = [-2.0, 2.0] }
v = { equation = "F0 + A*cos(om*t) - c*v - x - if(x > 0.349, 3.849*(x - 0.349) + 0.472*v, 0)", range = [-2.0, 2.0] }
"#;
    let found = responses(model, "[[survey]]\nname = \"s\"\nfree = \"om\"\nvalues = [0.585]\nstarts = 12\n", 0);
    assert_eq!(found.all("hits"), ["12"]);
    let law = |beyond: bool| match beyond {
        false => Linear { c: 0.036, k: 1.0, f: 0.13, amplitude: 0.992, omega: 0.585 },
        true => Linear { c: 0.508, k: 4.849, f: 0.13 + 3.849 * 0.349, amplitude: 0.992, omega: 0.585 },
    };
    let expected = exact(0.349, 60, &law, &|[_, v]| ([0.349, v], v > 0.0));
    assert_ranges(&found, 0, ["x", "v"], expected);
}

#[test]
fn starts_whose_impacts_accumulate_are_counted_as_chatter() {
    // A mass pressed against its stop: without forcing to lift it, it comes to rest there after infinitely many impacts.
    let model = r#"units = "labels"
[parameters]
A = 0.1
[forcing]
frequency = "1"
[states."x''"]
equation = "A*cos(t) + 2 - 0.1*x' - x"
range = [-1.0, 0.9]
velocity = { range = [-1.0, 1.0] }
[contact.a]
at = "x"
clearance = "1"
restitution = "0.5"
"#;
    let survey = "[[survey]]\nname = \"s\"\nfree = \"A\"\nvalues = [0.1]\nstarts = 8\n";
    let found = responses(model, survey, 0);
    assert_eq!((found.all("motion"), found.all("hits")), (vec!["chatter"], vec!["8"]));
    assert!(found.said.contains("ended in chatter") && !found.said.contains("escaped (of"), "{}", found.said);
    // A sweep from a motion that the forcing lifts off ends at the first value at which it no longer does.
    let seed = "[[seed]]\nname = \"a\"\nattractor = \"cycle\"\nparameters = { A = 5 }\n";
    let sweep = "[[sweep]]\nname = \"w\"\nfrom = \"a\"\nfree = \"A\"\nvalues = [5.0, 0.1, 0.05]\n";
    let found = responses(model, &format!("{seed}{sweep}"), 3);
    assert_eq!(found.all("motion"), ["cycle", "chatter"]);
    assert!(found.said.contains("the motion ends in chatter") && !found.said.contains("f jumps"), "{}", found.said);
}

#[test]
fn attractors_lists_a_cycle_with_impacts_once() {
    let model = r#"units = "labels"
[parameters]
A = 1.3
[forcing]
frequency = "1"
[states."x''"]
equation = "A*cos(t) + 0.5 - 0.1*x' - x"
range = [-1.0, 0.3]
velocity = { range = [-1.0, 1.0] }
[contact.a]
at = "x"
clearance = "0.3"
restitution = "0.7"
"#;
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("model.toml"), model).unwrap();
    let output = foldline(folder.path(), &["attractors", "model.toml", "--samples", "16"]);
    let said = String::from_utf8(output.stdout).unwrap();
    let cycles: Vec<&str> = said.lines().filter(|line| line.starts_with("cycle")).collect();
    assert_eq!(cycles.len(), 1, "{said}");
    assert_eq!(cycles[0].split_whitespace().nth(2), Some("16"), "{said}");
}

#[test]
fn motions_in_phase_and_in_antiphase_are_two_although_their_ranges_agree() {
    // Two equal limit cycles of radius 1, coupled by the second harmonic of their phase difference φ: φ' = -2k sin 2φ, so
    // that φ = 0 and φ = π attract and each half of all phase differences leads to one of them.
    let oscillators = r#"[parameters]
k = 0.2
w = 1.3
[definitions]
s = "2*(x1*x2 + y1*y2)*(x1*y2 - y1*x2)"
[states]
x1 = { equation = "x1*(1 - x1^2 - y1^2) - y1*(w + k*s)", range = [-1.5, 1.5] }
y1 = { equation = "y1*(1 - x1^2 - y1^2) + x1*(w + k*s)", range = [-1.5, 1.5] }
x2 = { equation = "x2*(1 - x2^2 - y2^2) - y2*(w - k*s)", range = [-1.5, 1.5] }
y2 = { equation = "y2*(1 - x2^2 - y2^2) + x2*(w - k*s)", range = [-1.5, 1.5] }
"#;
    let found = responses(oscillators, "[[survey]]\nname = \"s\"\nfree = \"k\"\nvalues = [0.2]\nstarts = 64\n", 0);
    assert_eq!(found.all("motion"), ["cycle"; 2]);
    for row in 0..2 {
        let [low, high] = ["share_low", "share_high"].map(|name| found.number(row, name));
        assert!(low <= 0.5 && 0.5 <= high, "{low} {high}");
    }
    // Cycles of periods p and q of two maps that do not interact make gcd(p, q) cycles together.
    let maps = |a: f64, b: f64| {
        format!(
            "[parameters]\na = {a}\nb = {b}\n[states]\nx = {{ range = [0.02, 0.98] }}\ny = {{ range = [0.02, 0.98] }}\n\
             [map]\nx = \"a*x*(1-x)\"\ny = \"b*y*(1-y)\"\n"
        )
    };
    // The logistic map has a stable cycle of period 2 from 3 to 1 + √6 = 3.449, and of period 4 up to 3.544.
    for (a, b, expected) in [(3.3186, 3.2094, 2), (3.5, 3.3, 2), (3.5, 3.48, 4), (2.8, 3.5, 1)] {
        let survey = format!("[[survey]]\nname = \"s\"\nfree = \"a\"\nvalues = [{a}]\nstarts = 100\n");
        let found = responses(&maps(a, b), &survey, 0);
        assert_eq!(found.all("motion"), vec!["cycle"; expected], "{a} {b}");
        let hits: f64 = (0..expected).map(|row| found.number(row, "hits")).sum();
        assert_eq!(hits, 100.0);
    }
}

#[test]
fn a_sweep_does_not_jump_where_the_branch_turns_just_beyond_the_value() {
    // x = 1e-5 z, z' = p - g(z).
    let g = [0.0, -0.00481942014553309, -0.07044119857912118, 0.34629314818331053, 1.259712170700491, 0.8];
    let slope = |z: f64| (1..6).map(|k| k as f64 * g[k] * z.powi(k as i32 - 1)).sum::<f64>();
    let value = |z: f64| (0..6).map(|k| g[k] * z.powi(k as i32)).sum::<f64>();
    // One stable piece leads from p = 3 to beyond p = 0, and turns before the next value, -0.6.
    let lowest = (0..1_000_000).map(|k| 0.1 + k as f64 * 1e-6).find(|z| slope(*z) > 0.0).unwrap();
    assert!((lowest..2.0).contains(&1.06) && value(lowest) < 0.0 && value(lowest) > -0.001);
    assert!((0..2000).map(|k| lowest + 1e-6 + k as f64 * 1e-3).all(|z| slope(z) > 0.0));
    let terms: Vec<String> = (0..6).map(|k| format!("({:?})*z^{k}", g[k])).collect();
    let model = format!(
        "units = \"labels\"\n[parameters]\np = 3.0\n[definitions]\nz = \"x*1e5\"\n[states]\n\
         x = {{ equation = \"1e-5*(p - ({}))\", range = [-2e-5, 2e-5] }}\nv = {{ equation = \"x - v\", range = [-2e-5, 2e-5] }}\n",
        terms.join("+")
    );
    let study = "[[seed]]\nname = \"a\"\nstate = { x = 1.06e-5, v = 1.06e-5 }\n\
                 [[sweep]]\nname = \"s\"\nfrom = \"a\"\nfree = \"p\"\nrange = [3.0, -3.0]\ncount = 11\n";
    let found = responses(&model, study, 0);
    let jumps: Vec<&str> =
        (0..11).filter(|row| found.word(*row, "jump") == "jump").map(|row| found.word(row, "p")).collect();
    assert_eq!(jumps.len(), 1, "{jumps:?}");
    assert!((jumps[0].parse::<f64>().unwrap() + 0.6).abs() < 1e-12, "{jumps:?}");
}
