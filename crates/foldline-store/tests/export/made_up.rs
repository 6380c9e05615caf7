//! Run with everything that could go wrong in another format: numbers that short decimals do not preserve, meshes of
//! different sizes, names that are taken or not allowed, a branch without points, texts of any length.

use foldline::contract::{Event, Observer, Verdict};
use foldline::diagram::{
    Branch, Cost, Cycle, Ending, Family, Kind, Motion, Origin, Point, Response, Responses, Search, Share, Solution,
    SpecialPoint, Trust,
};
use foldline_store::run_file::Recorder;
use foldline_store::study_file::parse_study;
use num_complex::Complex64;
use std::path::Path;

// K and k differ only in case; `step` and `node` are reserved column names.
const MODEL: &str = "name = \"made up\"\nunits = \"labels\"\n[parameters]\nK = { value = 1.0, unit = \"N/m\", description = \"gain, größer als 0\" }\n\
    k = 2.0\nstep = 0.5\n[states.x]\nequation = \"K*x - k*x^3\"\n[states.node]\nequation = \"-step*node\"\n\
    [outputs]\nr = \"abs(x)\"\n";
const STUDY: &str = "model = \"made-up.toml\"\n[[seed]]\nname = \"start\"\nstate = { x = 0.1, node = 0 }\n\
    [[branch]]\nname = \"main\"\nfrom = \"start\"\nfree = \"K\"\nrange = [-1, 2]\n";

/// Numbers that a decimal with too few digits or a column of another type would not preserve.
fn awkward(k: usize) -> f64 {
    [f64::NAN, -0.0, f64::INFINITY, f64::NEG_INFINITY, 5e-324, 1.0 / 3.0, -1.0e300, 0.1 + 0.2][k % 8]
}

/// Cycle with `intervals` mesh intervals, or an equilibrium if `intervals` is 0.
fn point(position: i64, intervals: usize) -> Point {
    let list = |n: usize, from: usize| (0..n).map(|k| awkward(k + from)).collect::<Vec<f64>>();
    let ends: Vec<f64> = (0..=intervals).map(|j| (j as f64 / intervals as f64).powi(2)).collect();
    let solution = match intervals {
        0 => Solution::Equilibrium(list(2, 5)),
        _ => Solution::Cycle(Cycle {
            points: foldline::problem::gauss::Points::Gauss,
            period: 0.1 + 0.2,
            forcing_periods: 3,
            mesh: ends.into(),
            degree: 2,
            profile: list(intervals * 3 * 2, position as usize),
            gain: Vec::new(),
        }),
    };
    Point {
        position,
        parameters: vec![position as f64 / 7.0, -0.0, f64::NAN],
        solution,
        tangent: list(5, 1),
        step: awkward(7),
        spectrum: vec![Complex64::new(awkward(0), awkward(1)), Complex64::new(awkward(5), awkward(4))],
        unstable: 1,
        ranges: vec![[awkward(1), awkward(5)], [awkward(0), awkward(2)], [awkward(3), awkward(6)]],
        averages: vec![[awkward(4), 2.0], [awkward(6), 0.25], [1.0 / 3.0, awkward(0).abs()]],
        trust: Trust {
            discretisation: 1e-9,
            residual: -0.0,
            trivial_defect: f64::NAN,
            liouville_defect: 1.0 / 3.0,
            spectrum: 2.0 / 3.0,
            slope: 0.0,
        },
        cost: Cost { newton: 3, factorisations: 4, rejected: 1, evaluations: 900, linearisations: 700 },
    }
}

fn special(kind: Kind, position: i64, intervals: usize, coefficients: &[f64]) -> SpecialPoint {
    let point = point(position, intervals);
    SpecialPoint {
        kind,
        point,
        unstable_before: 0,
        unstable_after: 2,
        error: awkward(5),
        coefficients: coefficients.into(),
        coefficient_errors: coefficients.iter().map(|c| 1e-9 * c.abs()).collect(),
        remark: String::new(),
    }
}

/// Records the run in a folder.
pub fn record(folder: &Path) {
    // Longer than a text stored within an attribute.
    let study = format!("{STUDY}# {}\n", "long ".repeat(20_000));
    let study = parse_study(&study, "study.toml", MODEL, "made-up.toml").expect("the study is right");
    let recorder = Recorder::create(folder, &study).unwrap();
    let mut main = Branch::new("main", Family::Equilibrium, 0, Origin::Seed("start".into()));
    (-1..=1).for_each(|k| main.insert(point(k, 0)));
    main.insert_special(special(Kind::Hopf, 0, 0, &[-0.25]));
    main.insert_special(special(Kind::Fold, 1, 0, &[]));
    main.ends = [Some(Ending::Bound(-1.0)), Some(Ending::Closed)];
    let origin = Origin::Switch { parent: "main".into(), kind: Kind::Hopf, parameter: 0.15 };
    let mut cycles = Branch::new("main/hopf-1", Family::Cycle, 0, origin);
    [2, 5, 3].iter().zip(0..).for_each(|(intervals, k)| cycles.insert(point(k, *intervals)));
    cycles.insert_special(special(Kind::Torus, 1, 4, &[0.5]));
    cycles.ends = [None, Some(Ending::StepTooSmall("it failed,\nand \"again\"".into()))];
    let mut empty = Branch::new("empty", Family::Cycle, 2, Origin::EndOf("main".into()));
    empty.ends = [Some(Ending::NoStart("nothing".into())), None];
    let mut curve = Branch::new(" (1)", Family::Cycle, 1, Origin::EndOf("main".into()));
    curve.held = Some((Kind::Torus, 0));
    curve.insert(point(0, 1));
    let response = Response {
        value: awkward(5),
        parameters: vec![awkward(5), awkward(1), awkward(0)],
        motion: Motion::Escaped,
        period: None,
        ratio: None,
        multiplicity: 1,
        ranges: Vec::new(),
        hits: 7,
        share: Some(Share { hits: 5, of: 9 }),
        jumped: Some(true),
        state: vec![awkward(4), awkward(6)],
        settled_after: awkward(5),
        error: awkward(0),
        iterates: Vec::new(),
        recognition: Default::default(),
    };
    let set = Responses { name: "down".into(), search: Search::Sweep, free: 2, responses: vec![response] };
    recorder.observe(Event::Responses(&set));
    for branch in [main, cycles, empty, curve] {
        let mut bare = branch.clone();
        (bare.points, bare.special, bare.ends) = (Vec::new(), Vec::new(), [None, None]);
        recorder.observe(Event::Begin(&bare));
        branch.points.iter().for_each(|p| assert_eq!(recorder.observe(Event::Point(&branch, p)), Verdict::Continue));
        branch.special.iter().for_each(|s| assert_eq!(recorder.observe(Event::Special(&branch, s)), Verdict::Continue));
        for (side, ending) in branch.ends.iter().enumerate().filter_map(|(s, e)| Some((s, e.as_ref()?))) {
            recorder.observe(Event::SideEnded(&branch, side, ending));
        }
    }
    recorder.finish().unwrap();
}
