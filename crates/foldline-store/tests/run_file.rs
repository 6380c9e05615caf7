//! Run file: round trips are exact to the bit, a kill loses nothing, and other files are recognised.

use foldline::contract::{Event, Observer, Verdict};
use foldline::diagram::{
    Branch, Cost, Cycle, Diagram, Ending, Family, Kind, Motion, Origin, Point, Recognition, Response, Responses,
    Search, Share, Shortfall, Solution, SpecialPoint, Trust,
};
use foldline::special::quantity::Quantity;
use foldline_store::run_file::{Part, Reading, Recorder, RunFileError, load, load_part, path_in};
use foldline_store::study_file::{Study, parse_study};
use num_complex::Complex64;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

// K and k: column names in SQLite are case-insensitive.
const MODEL: &str = "name = \"pitchfork\"\n[parameters]\nmu = 1.0\nK = 2.0\nk = 0.0\n\
    [states.x]\nequation = \"mu*x - K*x^3 + k\"\n[outputs]\nr = \"abs(x)\"\n";
const STUDY: &str = "model = \"pitchfork.toml\"\n[[seed]]\nname = \"start\"\nstate = { x = 0.1 }\n\
    [[branch]]\nname = \"main\"\nfrom = \"start\"\nfree = \"mu\"\nrange = [-1, 2]\n";

fn study() -> Study {
    parse_study(STUDY, "study.toml", MODEL, "pitchfork.toml").expect("the study is right")
}

/// Numbers that a decimal or an SQLite REAL column would not preserve: NaN, -0, infinities, subnormals, 1/3.
fn awkward(k: usize) -> f64 {
    [f64::NAN, -0.0, f64::INFINITY, f64::NEG_INFINITY, 5e-324, 1.0 / 3.0, -1.0e300, 0.1 + 0.2][k % 8]
}

fn point(position: i64, cycle: bool) -> Point {
    let list = |n: usize, from: usize| (0..n).map(|k| awkward(k + from)).collect::<Vec<f64>>();
    let solution = if cycle {
        let mesh: Vec<f64> = vec![0.0, 1.0 / 3.0, 1.0];
        Solution::Cycle(Cycle {
            points: foldline::problem::gauss::Points::Gauss,
            period: awkward(5),
            forcing_periods: 3,
            mesh: mesh.into(),
            degree: 4,
            profile: list(2 * 5, 3),
            gain: Vec::new(),
        })
    } else {
        Solution::Equilibrium(list(1, 5))
    };
    Point {
        position,
        parameters: vec![position as f64 / 7.0, -0.0, f64::NAN],
        solution,
        tangent: list(5, 1),
        step: awkward(7),
        spectrum: vec![Complex64::new(awkward(0), awkward(1)), Complex64::new(awkward(5), awkward(4))],
        unstable: 1,
        ranges: vec![[awkward(1), awkward(5)], [awkward(0), awkward(2)]],
        averages: vec![[awkward(2), awkward(4)], [awkward(3), awkward(1)]],
        trust: Trust {
            discretisation: 1e-9,
            residual: -0.0,
            trivial_defect: f64::NAN,
            liouville_defect: 1.0 / 3.0,
            spectrum: 2.0 / 3.0,
            slope: 2.5e-9,
        },
        cost: Cost { newton: 3, factorisations: 4, rejected: 1, evaluations: 900, linearisations: 700 },
    }
}

fn special(kind: Kind, position: i64, parameter: f64, cycle: bool) -> SpecialPoint {
    let mut point = point(position, cycle);
    point.parameters[0] = parameter;
    SpecialPoint {
        kind,
        point,
        unstable_before: 0,
        unstable_after: 2,
        error: awkward(5),
        coefficients: vec![awkward(7), -1.5],
        coefficient_errors: vec![awkward(3), 2.5e-300],
        remark: "no more, and \"why\"".into(),
    }
}

fn diagram() -> Diagram {
    let mut main = Branch::new("main", Family::Equilibrium, 0, Origin::Seed("start".into()));
    (-2..=3).for_each(|k| main.insert(point(k, false)));
    // Two special points of one kind between the same two points are kept apart.
    main.insert_special(special(Kind::Hopf, 1, 0.15, false));
    main.insert_special(special(Kind::Hopf, 1, 0.16, false));
    main.ends = [Some(Ending::Bound(-1.0)), Some(Ending::Stopped)];
    let origin = Origin::Switch { parent: "main".into(), kind: Kind::Hopf, parameter: 0.15 };
    let mut cycles = Branch::new("main/hopf", Family::Cycle, 0, origin);
    (0..=2).for_each(|k| cycles.insert(point(k, true)));
    cycles.insert_special(special(Kind::Unexplained, 0, -0.0, true));
    cycles.ends = [
        Some(Ending::Joined { at: Kind::Hopf, parameter: 0.15 }),
        Some(Ending::StepTooSmall("Newton left its region 7 times".into())),
    ];
    let mut third = Branch::new("third", Family::Cycle, 2, Origin::EndOf("main".into()));
    third.ends = [
        Some(Ending::SolutionUnbounded("it grew\nlikely cause: an asymptote".into())),
        Some(Ending::PeriodUnbounded(1.0 / 3.0)),
    ];
    let origin = Origin::Switch { parent: "third".into(), kind: Kind::PeriodDoubling, parameter: -0.0 };
    let mut curve = Branch::new("curve", Family::Cycle, 0, origin);
    curve.held = Some((Kind::PeriodDoubling, 2));
    curve.insert(point(0, true));
    let response = |motion: Motion, ratio: Option<(u32, u32)>| Response {
        value: awkward(5),
        parameters: vec![awkward(5), awkward(1), awkward(0)],
        motion,
        period: ratio.map(|_| awkward(7)),
        ratio,
        multiplicity: 2,
        // A motion that escaped or ended in chatter has no ranges.
        ranges: if motion.is_lost() { Vec::new() } else { vec![[awkward(1), awkward(5)], [awkward(0), awkward(2)]] },
        hits: 7,
        share: Some(Share { hits: 5, of: 9 }),
        jumped: Some(true),
        state: vec![awkward(4)],
        settled_after: awkward(5),
        error: awkward(0),
        iterates: Vec::new(),
        recognition: match motion {
            Motion::Torus => Recognition {
                rotation: Some([awkward(1), awkward(2)]),
                exponent: None,
                returns: 1000,
                reason: "none".into(),
            },
            _ => Recognition::default(),
        },
    };
    let motions = Motion::ALL;
    let responses = motions.map(|m| response(m, (m == Motion::Cycle).then_some((2, 1)))).to_vec();
    let sets = [("what attracts", Search::Survey), ("down", Search::Sweep)];
    let sets =
        sets.map(|(name, search)| Responses { name: name.into(), search, free: 2, responses: responses.clone() });
    let shortfalls = vec![
        Shortfall { about: "main".into(), what: "hopf 0.15 of main: no bifurcating branch found".into() },
        Shortfall { about: "third".into(), what: "two\nlines".into() },
    ];
    Diagram { branches: vec![main, cycles, third, curve], responses: sets.to_vec(), shortfalls, ..Diagram::default() }
}

fn record(diagram: &Diagram, observer: &dyn Observer) {
    // A set that is written again replaces the earlier one.
    diagram.responses.iter().chain(&diagram.responses).for_each(|set| {
        assert_eq!(observer.observe(Event::Visited(&set.name, 0.5, 1, 4)), Verdict::Continue);
        assert_eq!(observer.observe(Event::Responses(set)), Verdict::Continue);
    });
    diagram.shortfalls.iter().for_each(|own| _ = observer.observe(Event::Short(&own.about, &own.what)));
    for branch in &diagram.branches {
        let mut bare = branch.clone();
        (bare.points, bare.special, bare.ends) = (Vec::new(), Vec::new(), [None, None]);
        observer.observe(Event::Begin(&bare));
        branch.points.iter().for_each(|p| assert_eq!(observer.observe(Event::Point(branch, p)), Verdict::Continue));
        branch.special.iter().for_each(|s| assert_eq!(observer.observe(Event::Special(branch, s)), Verdict::Continue));
        for (side, ending) in branch.ends.iter().enumerate().filter_map(|(s, e)| Some((s, e.as_ref()?))) {
            observer.observe(Event::SideEnded(branch, side, ending));
        }
        observer.observe(Event::Note(&branch.name, "a remark"));
        observer.observe(Event::End(branch));
    }
}

/// Formats a diagram with the bits of every number, so that NaN equals NaN and 0 differs from -0.
fn exactly(diagram: &Diagram) -> String {
    fn bits(values: &[f64]) -> Vec<u64> {
        values.iter().map(|v| v.to_bits()).collect()
    }
    fn of_point(p: &Point) -> String {
        let solution = match &p.solution {
            Solution::Equilibrium(x) => format!("{:?}", bits(x)),
            Solution::Torus(t) => {
                let scalars = [t.period, t.rotation];
                format!("{:?} {:?} {} {:?}", bits(&scalars), bits(&t.mesh), t.degree, bits(&t.profile))
            }
            Solution::Cycle(c) => {
                format!("{} {:?} {} {:?}", c.period.to_bits(), bits(&c.mesh), c.degree, bits(&c.profile))
            }
        };
        let spectrum: Vec<f64> = p.spectrum.iter().flat_map(|z| [z.re, z.im]).collect();
        let t = p.trust;
        let trust = [t.discretisation, t.residual, t.trivial_defect, t.liouville_defect, t.spectrum, t.slope, p.step];
        let lists = [&p.parameters[..], &p.tangent, &spectrum, p.ranges.as_flattened(), &trust].map(bits);
        format!("{} {solution} {lists:?} {} {:?}\n", p.position, p.unstable, p.cost)
    }
    let mut text = String::new();
    for b in &diagram.branches {
        text += &format!("{} {:?} {} {:?} {:?} {:?}\n", b.name, b.family, b.free, b.held, b.origin, b.ends);
        b.points.iter().for_each(|p| text += &of_point(p));
        for s in &b.special {
            text += &format!("{} {} {} {} ", s.kind, s.unstable_before, s.unstable_after, s.error.to_bits());
            text += &format!("{:?} {:?} {:?} ", bits(&s.coefficients), bits(&s.coefficient_errors), s.remark);
            text += &of_point(&s.point);
        }
    }
    text += &format!("{:?} {:?}", diagram.responses, diagram.shortfalls);
    text
}

#[test]
fn a_diagram_comes_back_to_the_bit_and_so_do_the_texts() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(&folder.path().join("new"), &study()).unwrap();
    record(&diagram(), &recorder);
    recorder.finish().unwrap();
    let back = load(&folder.path().join("new")).unwrap();
    assert_eq!(exactly(&back.diagram), exactly(&diagram()));
    assert_eq!((back.study_text.as_str(), back.model_text.as_str()), (STUDY, MODEL));
    assert_eq!(back.notes.len(), 4);
}

/// Pairs of eigenvalues that cross the imaginary axis at the same point.
#[test]
fn special_points_of_one_kind_at_one_place_are_all_kept() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path(), &study()).unwrap();
    let mut branch = Branch::new("pairs", Family::Equilibrium, 0, Origin::Seed("start".into()));
    branch.insert(point(0, false));
    recorder.observe(Event::Begin(&branch));
    recorder.observe(Event::Point(&branch, &branch.points[0]));
    for before in [0, 2] {
        let special =
            SpecialPoint { unstable_before: before, unstable_after: before + 2, ..special(Kind::Hopf, 0, 0.3, false) };
        branch.insert_special(special.clone());
        recorder.observe(Event::Special(&branch, &special));
    }
    recorder.finish().unwrap();
    let back = load(folder.path()).unwrap().diagram;
    assert_eq!(back.branches[0].special.iter().map(|s| s.unstable_before).collect::<Vec<_>>(), [0, 2]);
}

#[test]
fn special_points_of_one_step_backwards_are_in_the_order_of_the_branch() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path(), &study()).unwrap();
    let mut branch = Branch::new("back", Family::Equilibrium, 0, Origin::Seed("start".into()));
    recorder.observe(Event::Begin(&branch));
    for (position, met) in [(0, &[0.3, 0.4][..]), (-1, &[0.2, 0.1])] {
        branch.insert(point(position, false));
        recorder.observe(Event::Point(&branch, &branch.points[0]));
        for parameter in met {
            let special = special(Kind::Hopf, position, *parameter, false);
            branch.insert_special(special.clone());
            recorder.observe(Event::Special(&branch, &special));
        }
    }
    recorder.finish().unwrap();
    let order = |branch: &Branch| branch.special.iter().map(|s| s.point.parameters[0]).collect::<Vec<_>>();
    assert_eq!(order(&branch), [0.1, 0.2, 0.3, 0.4]);
    assert_eq!(order(&load(folder.path()).unwrap().diagram.branches[0]), [0.1, 0.2, 0.3, 0.4]);
}

/// Removes from a diagram what [`Part::Numbers`] leaves out.
fn numbers_of(mut diagram: Diagram) -> Diagram {
    let strip = |point: &mut Point| {
        point.tangent.clear();
        match &mut point.solution {
            Solution::Equilibrium(x) => x.clear(),
            Solution::Torus(torus) => (torus.mesh, torus.profile) = (Vec::new().into(), Vec::new()),
            Solution::Cycle(cycle) => (cycle.mesh, cycle.profile) = (Vec::new().into(), Vec::new()),
        }
    };
    for branch in &mut diagram.branches {
        branch.points.iter_mut().for_each(strip);
        branch.special.iter_mut().for_each(|special| strip(&mut special.point));
    }
    diagram
}

#[test]
fn a_part_of_a_run_equals_that_part_of_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path(), &study()).unwrap();
    record(&diagram(), &recorder);
    recorder.finish().unwrap();
    let read = |part: Part| exactly(&load_part(folder.path(), part).unwrap().diagram);
    let mut expected = numbers_of(diagram());
    assert_eq!(read(Part::Numbers), exactly(&expected));
    expected.branches.iter_mut().for_each(|branch| branch.points.clear());
    assert_eq!(read(Part::Special), exactly(&expected));
    assert_eq!(read(Part::Everything), exactly(&diagram()));
}

#[test]
fn the_recorder_recalls_recorded_points() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path(), &study()).unwrap();
    record(&diagram(), &recorder);
    assert!(recorder.stores());
    let with = |branch: &Branch, points: Vec<Point>| {
        exactly(&Diagram { branches: vec![Branch { points, ..branch.clone() }], ..Diagram::default() })
    };
    for branch in &diagram().branches {
        let recalled = branch.points.iter().map(|p| recorder.recall(branch, p.position).unwrap()).collect();
        assert_eq!(with(branch, recalled), with(branch, branch.points.clone()));
        assert!(recorder.recall(branch, 1_000_000).is_none());
    }
}

#[test]
fn threads_that_record_at_once_lose_nothing_and_recall_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path(), &study()).unwrap();
    let followed = |name: String| {
        let mut branch = Branch::new(&name, Family::Cycle, 0, Origin::Seed("start".into()));
        recorder.observe(Event::Begin(&branch));
        for position in 0..40 {
            branch.insert(point(position, true));
            let found = &branch.points[position as usize];
            assert_eq!(recorder.observe(Event::Point(&branch, found)), Verdict::Continue);
            if position % 10 == 7 {
                let special = special(Kind::Torus, position, position as f64, true);
                branch.insert_special(special.clone());
                recorder.observe(Event::Special(&branch, &special));
                // While the other threads write.
                let recalled = recorder.recall(&branch, position - 1).expect("it was recorded");
                assert_eq!(format!("{recalled:?}"), format!("{:?}", branch.points[position as usize - 1]));
            }
        }
        recorder.observe(Event::Note(&name, "ends here"));
        branch.ends[1] = Some(Ending::Closed);
        recorder.observe(Event::SideEnded(&branch, 1, &Ending::Closed));
        branch
    };
    let mut expected: Vec<Branch> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..8).map(|k| scope.spawn(move || followed(format!("branch {k}")))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    recorder.finish().unwrap();
    let back = load(folder.path()).unwrap();
    assert_eq!(back.notes.len(), 8);
    let mut found = back.diagram.branches;
    [&mut found, &mut expected].into_iter().for_each(|all| all.sort_by(|a, b| a.name.cmp(&b.name)));
    let whole = |branches| exactly(&Diagram { branches, ..Diagram::default() });
    assert_eq!(whole(found), whole(expected));
}

#[test]
fn a_thread_queues_points_while_another_writes_up_to_a_limit() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path(), &study()).unwrap();
    let mut branches = ["a", "b"].map(|name| Branch::new(name, Family::Cycle, 0, Origin::Seed("start".into())));
    for branch in &mut branches {
        recorder.observe(Event::Begin(branch));
        (0..40).for_each(|position| branch.insert(point(position, true)));
    }
    // Another connection has the file locked, so the first writer waits.
    let other = rusqlite::Connection::open(path_in(folder.path())).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    let stored = || -> i64 { other.query_row("SELECT count(*) FROM points", [], |row| row.get(0)).unwrap() };
    let handed_in = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for branch in &branches {
            scope.spawn(|| {
                for point in &branch.points {
                    assert_eq!(recorder.observe(Event::Point(branch, point)), Verdict::Continue);
                    handed_in.fetch_add(1, Ordering::SeqCst);
                }
            });
        }
        let start = std::time::Instant::now();
        while handed_in.load(Ordering::SeqCst) < 16 && start.elapsed().as_secs() < 5 {
            std::thread::yield_now();
        }
        // One thread waits in its first point, the other in its seventeenth, whichever point is being written.
        std::thread::sleep(std::time::Duration::from_millis(50));
        assert_eq!((handed_in.load(Ordering::SeqCst), stored()), (16, 0));
        other.execute_batch("COMMIT").unwrap();
    });
    // No call is in progress any more: if the process is killed now, everything is in the file, in order.
    assert_eq!(stored(), 80);
    let mut rows = other.prepare("SELECT position FROM points WHERE branch = ? ORDER BY rowid").unwrap();
    for branch in 1..=2 {
        let positions = rows.query_map([branch], |row| row.get::<_, i64>(0)).unwrap();
        assert_eq!(positions.map(Result::unwrap).collect::<Vec<i64>>(), (0..40).collect::<Vec<i64>>());
    }
}

#[test]
fn no_row_is_lost_in_any_interleaving_of_two_threads() {
    const POINTS: i64 = 4;
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path(), &study()).unwrap();
    let other = Mutex::new(rusqlite::Connection::open(path_in(folder.path())).unwrap());
    let count =
        |sql: &str, name: &str| -> i64 { other.lock().unwrap().query_row(sql, [name], |row| row.get(0)).unwrap() };
    let points = "SELECT count(*) FROM points JOIN branches USING (branch) WHERE name = ?";
    let ends = "SELECT count(*) FROM ends JOIN branches USING (branch) WHERE name = ?";
    for round in 0..300 {
        let names = ["a", "b"].map(|thread| format!("{thread} {round}"));
        std::thread::scope(|scope| {
            for name in &names {
                let (recorder, count) = (&recorder, &count);
                scope.spawn(move || {
                    let mut branch = Branch::new(name, Family::Cycle, 0, Origin::Seed("start".into()));
                    recorder.observe(Event::Begin(&branch));
                    for position in 0..POINTS {
                        branch.insert(point(position, false));
                        recorder.observe(Event::Point(&branch, &branch.points[position as usize]));
                    }
                    if round % 2 == 0 {
                        recorder.observe(Event::SideEnded(&branch, 1, &Ending::Closed));
                        // All points before an ending are in the file once the ending has been observed.
                        assert_eq!(count(points, name), POINTS, "{name}");
                    }
                });
            }
        });
        for name in &names {
            assert_eq!((count(points, name), count(ends, name)), (POINTS, 1 - round % 2), "{name}");
        }
    }
    recorder.finish().unwrap();
}

#[test]
fn a_killed_run_resumes_with_all_accepted_points_and_repeated_resumption_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path(), &study()).unwrap();
    record(&diagram(), &recorder);
    // A killed process does not close the file: its log remains next to it, as it does for this copy.
    let copy = tempfile::tempdir().unwrap();
    for file in std::fs::read_dir(folder.path()).unwrap() {
        let file = file.unwrap();
        std::fs::copy(file.path(), copy.path().join(file.file_name())).unwrap();
    }
    let (resumed, earlier) = Recorder::resume(copy.path(), &study()).unwrap();
    let mut expected = diagram();
    expected.branches[0].ends[1] = None; // it had been stopped on request
    assert_eq!(exactly(&earlier), exactly(&expected));

    record(&diagram(), &resumed);
    resumed.finish().unwrap();
    assert_eq!(exactly(&load(copy.path()).unwrap().diagram), exactly(&diagram()));
}

#[test]
fn points_from_which_a_resumed_branch_does_not_continue_are_deleted() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path(), &study()).unwrap();
    record(&diagram(), &recorder);
    // The special points of the last step are located again, with other rounding errors.
    let mut main = diagram().branches.remove(0);
    main.points.retain(|p| p.position <= 2);
    main.special.truncate(1);
    recorder.observe(Event::Begin(&main));
    recorder.observe(Event::Special(&main, &special(Kind::Hopf, 1, 0.16 + 1e-15, false)));
    recorder.finish().unwrap();
    let back = load(folder.path()).unwrap().diagram;
    let parameters: Vec<f64> = back.branches[0].special.iter().map(|s| s.point.parameters[0]).collect();
    assert_eq!(parameters, [0.15, 0.16 + 1e-15]);
    assert_eq!(back.branches[0].points.iter().map(|p| p.position).collect::<Vec<_>>(), [-2, -1, 0, 1, 2]);
}

#[test]
fn a_run_killed_before_its_first_transaction_resumes_as_a_new_one() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(path_in(folder.path()), "").unwrap();
    let (recorder, earlier) = Recorder::resume(folder.path(), &study()).unwrap();
    assert!(earlier.branches.is_empty());
    record(&diagram(), &recorder);
    recorder.finish().unwrap();
    assert_eq!(load(folder.path()).unwrap().diagram.branches.len(), 4);
}

#[test]
fn an_open_run_can_be_read_by_others() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path(), &study()).unwrap();
    let diagram = diagram();
    recorder.observe(Event::Begin(&diagram.branches[0]));
    recorder.observe(Event::Point(&diagram.branches[0], &point(0, false)));
    assert_eq!(load(folder.path()).unwrap().diagram.branches[0].points.len(), 1);
    recorder.observe(Event::Point(&diagram.branches[0], &point(1, false)));
    assert_eq!(load(folder.path()).unwrap().diagram.branches[0].points.len(), 2);
    recorder.finish().unwrap();
}

#[test]
fn numbers_can_be_read_by_name_without_this_program() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path(), &study()).unwrap();
    record(&diagram(), &recorder);
    recorder.finish().unwrap();
    let connection = rusqlite::Connection::open(path_in(folder.path())).unwrap();
    let sql = "SELECT mu, K, x_max, unstable FROM points JOIN branches USING (branch)
               WHERE name = 'main' AND position = 3";
    let row = connection
        .query_row(sql, [], |row| {
            Ok((row.get::<_, f64>(0)?, row.get::<_, f64>(1)?, row.get::<_, f64>(2)?, row.get::<_, i64>(3)?))
        })
        .unwrap();
    assert_eq!(row, (3.0 / 7.0, 0.0, 1.0 / 3.0, 1));
}

/// Values of quantities at the points of a branch, and what SQLite reads for them.
fn values_of(folder: &Path, names: &[&str]) -> (Vec<[f64; 4]>, String) {
    let quantities: Vec<Quantity> =
        names.iter().map(|name| Quantity::named(name, &study().model).expect("there is such a quantity")).collect();
    let mut found = Vec::new();
    let reading = Reading::open(folder).unwrap();
    let take = |position: i64, _, values: &[f64]| found.push([position as f64, values[0], values[1], values[2]]);
    reading.each_value(1, [-1, 2], &quantities, &study().model, take).unwrap();
    let connection = rusqlite::Connection::open(path_in(folder)).unwrap();
    let sql = "EXPLAIN QUERY PLAN SELECT position, unstable, average_bytes, mu, x_max, period FROM points
               WHERE branch = 1 AND position BETWEEN -1 AND 2 ORDER BY position";
    (found, connection.query_row(sql, [], |row| row.get(3)).unwrap())
}

#[test]
fn diagrams_are_read_from_an_index_which_earlier_files_get_when_they_are_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path(), &study()).unwrap();
    record(&diagram(), &recorder);
    recorder.finish().unwrap();
    let bits = |values: &[[f64; 4]]| values.iter().map(|row| row.map(f64::to_bits)).collect::<Vec<_>>();
    let names = ["mu", "r_max", "x_mean"];
    let (values, plan) = values_of(folder.path(), &names);
    assert!(plan.contains("USING COVERING INDEX points_in_diagrams"), "{plan}");
    assert_eq!(values.iter().map(|row| row[0]).collect::<Vec<_>>(), [-1.0, 0.0, 1.0, 2.0]);
    for row in &values {
        let own = point(row[0] as i64, false);
        assert_eq!(row[1].to_bits(), own.parameters[0].to_bits());
    }
    // A file of an earlier version has no index: the same numbers come from the rows.
    let connection = rusqlite::Connection::open(path_in(folder.path())).unwrap();
    connection.execute_batch("DROP INDEX points_in_diagrams").unwrap();
    drop(connection);
    let (older, plan) = values_of(folder.path(), &names);
    assert!(!plan.contains("COVERING INDEX points_in_diagrams"), "{plan}");
    assert_eq!(bits(&older), bits(&values));
    let (resumed, _) = Recorder::resume(folder.path(), &study()).unwrap();
    resumed.finish().unwrap();
    let (resumed, plan) = values_of(folder.path(), &names);
    assert!(plan.contains("USING COVERING INDEX points_in_diagrams"), "{plan}");
    assert_eq!(bits(&resumed), bits(&values));
}

#[test]
fn numbers_stand_before_profiles_so_that_they_are_read_without_them() {
    let folder = tempfile::tempdir().unwrap();
    Recorder::create(folder.path(), &study()).unwrap().finish().unwrap();
    let connection = rusqlite::Connection::open(path_in(folder.path())).unwrap();
    for table in ["points", "special_points"] {
        let mut statement = connection.prepare("SELECT name FROM pragma_table_info(?1) ORDER BY cid").unwrap();
        let names: Vec<String> = statement.query_map([table], |row| row.get(0)).unwrap().map(Result::unwrap).collect();
        assert_eq!(names[names.len() - 3..], ["solution_bytes", "mesh_bytes", "tangent_bytes"], "{table}");
    }
}

/// Converts a file from version 10 to version 7.
const WITHOUT_ERRORS: &str = "
    UPDATE special_points SET scalar_bytes = CAST(substr(scalar_bytes, 1, 80) AS BLOB), numbers_checksum = NULL;
    ALTER TABLE special_points DROP COLUMN coefficient_count;
    ALTER TABLE special_points DROP COLUMN normal_form_remark;
    ALTER TABLE branches DROP COLUMN unit; ALTER TABLE branches DROP COLUMN held_unit;
    ALTER TABLE points DROP COLUMN gain_bytes; ALTER TABLE special_points DROP COLUMN gain_bytes;
    ALTER TABLE points DROP COLUMN slope_error; ALTER TABLE special_points DROP COLUMN slope_error;
    PRAGMA user_version = 7;";

/// Converts a file of version 4 to 7 to version 3, then to version 2.
const WITHOUT_COUNTERS: &str = "
    DROP INDEX points_in_diagrams;
    ALTER TABLE points DROP COLUMN average_bytes; ALTER TABLE special_points DROP COLUMN average_bytes;
    ALTER TABLE points DROP COLUMN forcing_periods; ALTER TABLE special_points DROP COLUMN forcing_periods;
    ALTER TABLE special_points DROP COLUMN normal_form;
    ALTER TABLE points DROP COLUMN numbers_checksum; ALTER TABLE points DROP COLUMN solution_checksum;
    ALTER TABLE points DROP COLUMN spectrum_error; ALTER TABLE special_points DROP COLUMN spectrum_error;
    ALTER TABLE special_points DROP COLUMN numbers_checksum; ALTER TABLE special_points DROP COLUMN solution_checksum;
    UPDATE points SET scalar_bytes = substr(scalar_bytes, 1, 48);
    UPDATE special_points SET scalar_bytes = CAST(substr(scalar_bytes, 1, 48) || substr(scalar_bytes, 57) AS BLOB);
    DELETE FROM meta WHERE key = 'texts_checksum';
    ALTER TABLE points DROP COLUMN evaluations; ALTER TABLE points DROP COLUMN linearisations;
    ALTER TABLE special_points DROP COLUMN evaluations; ALTER TABLE special_points DROP COLUMN linearisations;
    PRAGMA user_version = 2;";

fn without_errors(mut diagram: Diagram) -> Diagram {
    for special in diagram.branches.iter_mut().flat_map(|branch| &mut branch.special) {
        special.coefficient_errors.clear();
        special.remark.clear();
    }
    for branch in &mut diagram.branches {
        let special = branch.special.iter_mut().map(|special| &mut special.point);
        branch.points.iter_mut().chain(special).for_each(|point| point.trust.slope = 0.0);
    }
    diagram
}

/// Converts a file without errors of coefficients to version 7.
const VERSION_7: &str = "
    ALTER TABLE special_points DROP COLUMN coefficient_count;
    ALTER TABLE special_points DROP COLUMN normal_form_remark;
    ALTER TABLE branches DROP COLUMN unit; ALTER TABLE branches DROP COLUMN held_unit;
    ALTER TABLE points DROP COLUMN gain_bytes; ALTER TABLE special_points DROP COLUMN gain_bytes;
    ALTER TABLE points DROP COLUMN slope_error; ALTER TABLE special_points DROP COLUMN slope_error;
    PRAGMA user_version = 7;";

#[test]
fn a_file_whose_coefficients_have_no_errors_is_read_and_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path(), &study()).unwrap();
    // Contents of a row of version 7, including its checksum.
    record(&without_errors(diagram()), &recorder);
    recorder.finish().unwrap();
    rusqlite::Connection::open(path_in(folder.path())).unwrap().execute_batch(VERSION_7).unwrap();
    assert_eq!(exactly(&load(folder.path()).unwrap().diagram), exactly(&without_errors(diagram())));
    let (resumed, earlier) = Recorder::resume(folder.path(), &study()).unwrap();
    assert_eq!(earlier.branches[0].special[0].coefficients, diagram().branches[0].special[0].coefficients);
    record(&diagram(), &resumed);
    resumed.finish().unwrap();
    assert_eq!(exactly(&load(folder.path()).unwrap().diagram), exactly(&diagram()));
}

fn without_counters(diagram: Diagram) -> Diagram {
    let mut diagram = without_errors(diagram);
    for branch in &mut diagram.branches {
        let special = branch.special.iter_mut().map(|s| &mut s.point);
        for point in branch.points.iter_mut().chain(special) {
            (point.cost.evaluations, point.cost.linearisations) = (0, 0);
            point.trust.spectrum = f64::NAN;
            point.averages.clear();
        }
    }
    diagram
}

#[test]
fn a_file_of_the_second_version_is_read_and_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path(), &study()).unwrap();
    record(&diagram(), &recorder);
    recorder.finish().unwrap();
    let connection = rusqlite::Connection::open(path_in(folder.path())).unwrap();
    connection.execute_batch(&format!("{WITHOUT_ERRORS} {WITHOUT_COUNTERS}")).unwrap();
    drop(connection);
    assert_eq!(exactly(&load(folder.path()).unwrap().diagram), exactly(&without_counters(diagram())));
    let (resumed, _) = Recorder::resume(folder.path(), &study()).unwrap();
    record(&diagram(), &resumed);
    resumed.finish().unwrap();
    assert_eq!(exactly(&load(folder.path()).unwrap().diagram), exactly(&diagram()));
}

#[test]
fn a_file_of_the_first_version_is_read_and_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path(), &study()).unwrap();
    let mut older = diagram();
    older.branches.truncate(3);
    record(&older, &recorder);
    recorder.finish().unwrap();
    let connection = rusqlite::Connection::open(path_in(folder.path())).unwrap();
    let back =
        "ALTER TABLE branches DROP COLUMN held; ALTER TABLE branches DROP COLUMN follows; PRAGMA user_version = 1;";
    connection.execute_batch(&format!("{WITHOUT_ERRORS} {WITHOUT_COUNTERS} {back}")).unwrap();
    drop(connection);
    assert_eq!(exactly(&load(folder.path()).unwrap().diagram), exactly(&without_counters(older)));

    let (resumed, _) = Recorder::resume(folder.path(), &study()).unwrap();
    record(&diagram(), &resumed);
    resumed.finish().unwrap();
    assert_eq!(exactly(&load(folder.path()).unwrap().diagram), exactly(&diagram()));
}

#[test]
fn responses_can_be_read_by_name_and_files_without_them_are_read_too() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path(), &study()).unwrap();
    record(&diagram(), &recorder);
    recorder.finish().unwrap();
    let connection = rusqlite::Connection::open(path_in(folder.path())).unwrap();
    let sql =
        "SELECT count(*), max(x_max), max(mu), sum(ratio_first) FROM responses JOIN response_sets USING (response_set)
               WHERE name = 'down'";
    let row = connection
        .query_row(sql, [], |r| {
            Ok((r.get::<_, i64>(0)?, r.get::<_, f64>(1)?, r.get::<_, f64>(2)?, r.get::<_, i64>(3)?))
        })
        .unwrap();
    assert_eq!(row, (7, 1.0 / 3.0, 1.0 / 3.0, 2));
    // As written by earlier versions: without the later columns, then without the tables.
    let later = ["uniform_hits", "uniform_starts", "jumped"];
    later
        .iter()
        .for_each(|name| connection.execute_batch(&format!("ALTER TABLE responses DROP COLUMN {name}")).unwrap());
    drop(connection);
    let back = load(folder.path()).unwrap().diagram;
    assert!(back.responses.iter().flat_map(|set| &set.responses).all(|r| r.share.is_none() && r.jumped.is_none()));
    let (recorder, _) = Recorder::resume(folder.path(), &study()).unwrap();
    record(&diagram(), &recorder);
    recorder.finish().unwrap();
    assert_eq!(exactly(&load(folder.path()).unwrap().diagram), exactly(&diagram()));
    let connection = rusqlite::Connection::open(path_in(folder.path())).unwrap();
    connection.execute_batch("DROP TABLE responses; DROP TABLE response_sets").unwrap();
    drop(connection);
    let back = load(folder.path()).unwrap().diagram;
    assert_eq!((back.branches.len(), back.responses.len()), (4, 0));
    let (recorder, _) = Recorder::resume(folder.path(), &study()).unwrap();
    record(&diagram(), &recorder);
    recorder.finish().unwrap();
    assert_eq!(load(folder.path()).unwrap().diagram.responses.len(), 2);
}

fn refusal(result: Result<impl Sized, RunFileError>) -> String {
    result.err().map(|e| e.to_string()).unwrap_or_default()
}

#[test]
fn runs_that_cannot_be_resumed_are_rejected_with_reason_and_cure() {
    let folder = tempfile::tempdir().unwrap();
    Recorder::create(folder.path(), &study()).unwrap().finish().unwrap();
    let exists = refusal(Recorder::create(folder.path(), &study()));
    assert!(exists.contains("already exists") && exists.contains("--resume"), "{exists}");

    let text = STUDY.replace("2]", "3]");
    let other = parse_study(&text, "study.toml", MODEL, "pitchfork.toml").expect("the study is right");
    let changed = refusal(Recorder::resume(folder.path(), &other));
    assert!(changed.contains("the study has changed") && changed.contains("--out"), "{changed}");
    let other = Study { model_text: MODEL.replace("2.0", "3.0"), ..study() };
    let changed = refusal(Recorder::resume(folder.path(), &other));
    assert!(changed.contains("the model has changed"), "{changed}");

    let connection = rusqlite::Connection::open(path_in(folder.path())).unwrap();
    connection.pragma_update(None, "user_version", 99).unwrap();
    drop(connection);
    let newer = refusal(load(folder.path()));
    assert!(newer.contains("format 99") && newer.contains("newer foldline"), "{newer}");

    std::fs::write(path_in(folder.path()), "not a database, but long enough to be taken for one").unwrap();
    assert!(refusal(load(folder.path())).contains("is not a foldline run file"));
    assert!(refusal(load(Path::new("/nowhere/at/all"))).contains("there is no run file"));
}
