//! The bouncing diagram of the overhung rotor against reference numbers, closed forms and identities.
//!
//! **Source.** The tables in `reference/` come from a separate code: single shooting with an adaptive Runge–Kutta pair
//! 5(4) at a relative tolerance of 1e-12 with variational equations; about 1e-8 in Omega, 1e-5 in r_max. Closed forms
//! and identities follow from the equations of motion (akay2024) by balance of power and torque.

use foldline::contract::{Event, Observer, Unobserved, Verdict};
use foldline::diagram::{Branch, Diagram, Ending, Kind, Solution};
use foldline::explore::{self, System, growth, known};
use foldline_store::study_file::{Study, parse_study, read_study};
use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

const OMEGA: usize = 0;

fn study(tolerance: f64) -> Study {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../studies/overhung-rotor/bouncing.toml");
    let mut study = read_study(&file).unwrap();
    study.plan.tolerance = tolerance;
    study
}

fn computed(tolerance: f64) -> Diagram {
    let study = study(tolerance);
    explore::run(&System::of_plan(&study.model, &study.plan), &study.plan, 2, Diagram::default(), &Unobserved)
}

/// The study at its default tolerance, computed once for all tests.
fn diagram() -> &'static Diagram {
    static DIAGRAM: OnceLock<Diagram> = OnceLock::new();
    DIAGRAM.get_or_init(|| computed(1e-6))
}

fn tight() -> &'static Diagram {
    static DIAGRAM: OnceLock<Diagram> = OnceLock::new();
    DIAGRAM.get_or_init(|| computed(1e-9))
}

/// Rows of a reference table, without comments and heading.
fn reference(name: &str) -> Vec<Vec<String>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference").join(name);
    let text = std::fs::read_to_string(file).unwrap();
    let rows = text.lines().filter(|l| !l.starts_with('#')).skip(1);
    rows.map(|l| l.split(',').map(str::to_string).collect()).collect()
}

/// Maximum of r: the output comes after the four states.
fn r_max(ranges: &[[f64; 2]]) -> f64 {
    ranges[4][1]
}

/// True if there is a special point of that kind at these reference values.
fn has(branch: &Branch, kind: &str, omega: f64, period: Option<f64>, r: f64) -> bool {
    branch.special.iter().any(|s| {
        let apart = (s.point.parameters[OMEGA] - omega).abs();
        s.kind.name() == kind
            && apart < 1e-6
            // The reference itself is accurate to about 1e-8.
            && apart <= s.error * branch.size(omega) + 2e-8
            && period.is_none_or(|t| (s.point.solution.period().unwrap() - t).abs() < 3e-6)
            && (r_max(&s.point.ranges) - r).abs() < 1e-4
    })
}

#[test]
fn every_reference_special_point_is_found() {
    let mut checked = 0;
    for row in reference("overhung_rotor_special_points.csv").iter().filter(|row| !row[0].contains("zeta")) {
        let name = format!("{} {}", row[0], row[1]).replace(" period-doubled", "/period-doubling-1");
        let branch = diagram().branch(&name).unwrap_or_else(|| panic!("no branch {name}"));
        let number = |k: usize| row[k].parse::<f64>().ok();
        assert!(
            has(branch, &row[2], number(3).unwrap(), number(4), number(5).unwrap()),
            "{row:?}: {:?}",
            table(branch)
        );
        checked += 1;
    }
    assert_eq!(checked, 7);
}

/// Detects a slowdown without a clock, by the work that each branch takes.
#[test]
fn the_work_matches_the_reference_table() {
    let mut found = "branch,points,newton,factorisations,rejected,evaluations,linearisations\n".to_string();
    for branch in &diagram().branches {
        let cost = branch.cost();
        let counts = [
            branch.points.len(),
            cost.newton,
            cost.factorisations,
            cost.rejected,
            cost.evaluations,
            cost.linearisations,
        ];
        found += &format!("{},{}\n", branch.name, counts.map(|count| count.to_string()).join(","));
    }
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference/overhung_rotor_work.csv");
    if std::env::var_os("FOLDLINE_WRITE_COUNTERS").is_some() {
        std::fs::write(&file, &found).unwrap();
    }
    let known = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(
        found == known,
        "the work has changed; where that is meant, renew the table with\n  \
         FOLDLINE_WRITE_COUNTERS=1 cargo test -p foldline-cli --test all the_work\nknown:\n{known}\nfound:\n{found}"
    );
}

fn table(branch: &Branch) -> Vec<(Kind, f64, f64)> {
    branch.special.iter().map(|s| (s.kind, s.point.parameters[OMEGA], s.error)).collect()
}

/// Follows the isola of contact SL in the opposite direction, and the open branches from their other end.
#[test]
fn the_other_direction_gives_the_same_special_points() {
    let study = study(1e-6);
    let system = System::of_plan(&study.model, &study.plan);
    for name in ["contact SL", "contact DL", "cubic DL", "cubic SL", "cubic S", "contact S"] {
        let known = diagram().branch(name).unwrap();
        let settings = growth::settings(&system, 1e-6, [0.5, 12.0], 5000);
        // Closed branches start at the same point in the opposite direction; open ones start at an end.
        let closed = known.ends[1] == Some(Ending::Closed);
        let start = if closed { known.points.iter().find(|p| p.position == 0).unwrap() } else { &known.points[0] };
        let mut problem = growth::problem_of(&system, OMEGA, 4, start, false);
        let station = growth::polished(&mut *problem, &settings, start).unwrap();
        let mut branch = Branch::new(name, known.family, OMEGA, known.origin.clone());
        let growth = growth::Growth {
            marks: &[],
            system: &system,
            settings: &settings,
            degree: 4,
            ties: Vec::new(),
            sides: [closed || known.points[0].parameter_slope() < 0.0, true],
            parents: &[],
            observer: &Unobserved,
            sparse: false,
            whole: true,
        };
        if closed {
            let growth = growth::Growth { sides: [true, false], ..growth };
            growth.begin(&mut branch, growth::Beginning::Inside(station));
            assert_eq!(branch.ends[0], Some(Ending::Closed), "{name}");
        } else {
            growth.begin(&mut branch, growth::Beginning::Inside(station));
        }
        assert_eq!(branch.special.len(), known.special.len(), "{name}: {:?} {:?}", table(&branch), table(known));
        for special in &known.special {
            let omega = special.point.parameters[OMEGA];
            let again = branch.special.iter().filter(|s| s.kind == special.kind);
            let same =
                again.map(|s| (s.point.parameters[OMEGA] - omega).abs() / (1.0 + omega)).fold(f64::INFINITY, f64::min);
            assert!(same < 1e-6, "{name}: {} {omega} is {same} away", special.kind);
        }
    }
}

#[test]
fn the_reference_tables_of_whole_branches_are_matched() {
    let study = study(1e-6);
    let system = System::of_plan(&study.model, &study.plan);
    for (file, name) in [("branch_contact_SL.csv", "contact SL"), ("branch_cubic_SL_upper.csv", "cubic SL")] {
        let branch = diagram().branch(name).unwrap();
        let settings = growth::settings(&system, 1e-6, [0.5, 12.0], 5000);
        let rows = reference(file);
        assert!(rows.len() > 250);
        for row in &rows {
            let [omega, period, r, unstable] = [0, 1, 2, 3].map(|k| row[k].parse::<f64>().unwrap());
            // The study ends there, while the table goes on.
            if omega > 12.0 {
                continue;
            }
            let found = known::solutions_at(&system, &settings, branch, omega);
            let matched = found.iter().any(|p| {
                // Near a fold the period changes like the square root of Omega, so the last digit of Omega in the table
                // matters.
                let slack = 1e-6 + 1e-9 / p.tangent.last().unwrap().abs().max(1e-9);
                (p.solution.period().unwrap() - period).abs() < slack * period
                    && (r_max(&p.ranges) - r).abs() < 1e-4 * (1.0 + r)
                    && p.unstable == unstable as usize
            });
            let list: Vec<_> = found.iter().map(|p| (p.solution.period(), r_max(&p.ranges), p.unstable)).collect();
            assert!(matched, "{name} at {omega}: T {period} r {r} unstable {unstable} is none of {list:?}");
        }
    }
}

/// a = 1 - (1 - J_p) Ω², F = m ε Ω²:  r² [ (a + g(r))² + (2ζΩ)² ] = F², g(r) r the restoring force.
#[test]
fn synchronous_responses_satisfy_their_closed_form() {
    for (name, points) in [("cubic S", 30), ("cubic S resonant", 10), ("contact S", 80)] {
        let branch = diagram().branch(name).unwrap();
        assert!(branch.points.len() >= points);
        for point in &branch.points {
            let [w, kappa, zeta, epsilon, gamma, beta, k, j_p, m] = point.parameters[..] else { panic!() };
            let r = r_max(&point.ranges);
            let contact = 0.5 * ((k * (r - 1.0)).tanh() + 1.0) * beta * (1.0 - 1.0 / r);
            let g = (1.0 - kappa) * gamma * r * r + kappa * contact;
            let force = m * epsilon * w * w;
            let left = r * ((1.0 - (1.0 - j_p) * w * w + g).powi(2) + (2.0 * zeta * w).powi(2)).sqrt();
            // Newton's method leaves an error of 1e-9 in r; next to contact, K = 150 magnifies the residual force.
            let steep =
                1.0 + r * (beta + gamma * r * r) + 0.5 * beta * k * kappa * (1.0 - (k * (r - 1.0)).tanh().powi(2));
            assert!((left - force).abs() < 1e-8 * (force + steep), "{name} at {w}, r = {r}: {left} against {force}");
        }
    }
    // Publication of the study, corrected: the three responses of the cubic rotor at Omega = 5.
    let study = study(1e-6);
    let system = System::of_plan(&study.model, &study.plan);
    let settings = growth::settings(&system, 1e-6, [0.5, 12.0], 5000);
    let mut radii: Vec<f64> = ["cubic S", "cubic S resonant"]
        .iter()
        .flat_map(|name| known::solutions_at(&system, &settings, diagram().branch(name).unwrap(), 5.0))
        .map(|p| r_max(&p.ranges))
        .collect();
    radii.sort_by(f64::total_cmp);
    radii.dedup_by(|a, b| (*a - *b).abs() < 1e-7);
    assert_eq!(radii.len(), 3, "{radii:?}");
    for (r, exact) in radii.iter().zip([0.38958073, 8.83900624, 9.22606067]) {
        assert!((r - exact).abs() < 2e-8, "{r} against {exact}");
    }
}

/// Averages over a cycle by Gauss quadrature: |U'|², u v' - v u', |U|², v.
fn averages(cycle: &foldline::diagram::Cycle) -> [f64; 4] {
    let scheme = cycle.scheme();
    let mut sums = [0.0; 4];
    for (j, interval) in cycle.profile.chunks_exact(4 * (cycle.degree + 1)).enumerate() {
        let h = cycle.mesh[j + 1] - cycle.mesh[j];
        for (x, b) in interval[4..].chunks_exact(4).zip(&scheme.weights) {
            let [u, v, du, dv] = [x[0], x[1], x[2], x[3]];
            for (sum, value) in sums.iter_mut().zip([du * du + dv * dv, u * dv - v * du, u * u + v * v, v]) {
                *sum += h * b * value;
            }
        }
    }
    sums
}

/// With U = Σ c_k e^{ikwτ}: Σ (k w)² |c_k|² is the mean of |U'|², Σ k w |c_k|² that of u v' - v u'.
///   I1 power   Σ k w (k w + Ω) |c_k|² = 0          I2 torque  m ε Ω² Im c_0 = -2ζ Σ (k w + Ω) |c_k|²
///   I3 Floquet ∏ μ = e^{-4ζT}                      I4 one multiplier is 1
fn identities_hold(diagram: &Diagram, tolerance: f64) -> usize {
    let mut cycles = 0;
    for branch in &diagram.branches {
        for point in &branch.points {
            let Solution::Cycle(cycle) = &point.solution else { continue };
            let [w, _, zeta, epsilon, .., m] = point.parameters[..] else { panic!() };
            let [speed, spin, size, v] = averages(cycle);
            let place = format!("{} at {w}, position {}", branch.name, point.position);
            let power = (speed + w * spin) / (speed + (w * spin).abs());
            assert!(power.abs() < 10.0 * tolerance, "I1 {place}: {power:.1e}");
            let (left, right) = (m * epsilon * w * w * v, -2.0 * zeta * (spin + w * size));
            let torque = (left - right) / (left.abs() + 2.0 * zeta * (spin.abs() + w * size));
            assert!(torque.abs() < 10.0 * tolerance, "I2 {place}: {torque:.1e}");
            let product: f64 = point.spectrum.iter().map(|z| z.norm().ln()).sum();
            let floquet = product + 4.0 * zeta * cycle.period;
            assert!(floquet.abs() < 10.0 * tolerance, "I3 {place}: {floquet:.1e}");
            let trivial = point.spectrum.iter().map(|z| (z - 1.0).norm()).fold(f64::INFINITY, f64::min);
            assert!(trivial < 10.0 * tolerance, "I4 {place}: {trivial:.1e}");
            cycles += 1;
        }
    }
    cycles
}

#[test]
fn power_torque_and_floquet_identities_hold_on_every_cycle() {
    assert!(identities_hold(diagram(), 1e-6) > 250);
}

#[test]
fn the_identities_hold_at_a_tight_tolerance_too() {
    assert!(identities_hold(tight(), 1e-9) > 250);
}

/// Every change of stability between neighbouring points is explained by the special points located there.
#[test]
fn stability_never_changes_silently() {
    for branch in &diagram().branches {
        assert!(branch.special.iter().all(|s| s.kind != Kind::Unexplained), "{}: {:?}", branch.name, table(branch));
        for pair in branch.points.windows(2) {
            let between: Vec<_> = branch.special.iter().filter(|s| s.point.position == pair[0].position).collect();
            let mut count = pair[0].unstable;
            for special in &between {
                assert_eq!(special.unstable_before, count, "{} {}", branch.name, special.kind);
                count = special.unstable_after;
            }
            assert_eq!(count, pair[1].unstable, "{} at {}", branch.name, pair[1].parameters[OMEGA]);
        }
    }
}

#[test]
fn no_spurious_special_points_are_reported() {
    // The cubic SL branch has its fold and no other special point on either side up to Omega = 12.
    assert_eq!(table(diagram().branch("cubic SL").unwrap()).len(), 1);
    assert_eq!(table(diagram().branch("cubic S").unwrap()).len(), 1);
    assert!(table(diagram().branch("cubic S resonant").unwrap()).is_empty());
}

#[test]
fn every_branch_ends_where_it_should() {
    for branch in &diagram().branches {
        for end in branch.ends.iter() {
            assert!(end.as_ref().is_some_and(Ending::complete), "{}: {end:?}", branch.name);
        }
    }
    for name in ["contact SL", "contact DL", "cubic DL"] {
        assert_eq!(diagram().branch(name).unwrap().ends, [Some(Ending::Closed), Some(Ending::Closed)], "{name}");
    }
}

/// Special points are the same at every tolerance, each within its stated error of those at the tightest.
#[test]
fn the_list_of_special_points_does_not_depend_on_the_tolerance() {
    let loose = computed(1e-4);
    for diagram in [&loose, diagram()] {
        assert_eq!(diagram.branches.len(), tight().branches.len());
        for branch in &tight().branches {
            let other = diagram.branch(&branch.name).unwrap_or_else(|| panic!("no branch {}", branch.name));
            assert_eq!(
                other.special.len(),
                branch.special.len(),
                "{}: {:?} {:?}",
                branch.name,
                table(other),
                table(branch)
            );
            for exact in &branch.special {
                let value = exact.point.parameters[OMEGA];
                let found = other.special.iter().filter(|s| s.kind == exact.kind);
                let distance = |s: &&foldline::diagram::SpecialPoint| (s.point.parameters[OMEGA] - value).abs();
                let nearest = found.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
                let allowed = (nearest.error + exact.error) * branch.size(value);
                assert!(distance(&nearest) <= allowed, "{} {} {value}: {:?}", branch.name, exact.kind, table(other));
                assert_eq!(
                    (nearest.unstable_before, nearest.unstable_after),
                    (exact.unstable_before, exact.unstable_after)
                );
            }
        }
    }
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let study = study(1e-6);
    let alone =
        explore::run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved);
    assert_eq!(alone.branches.len(), diagram().branches.len());
    for (a, b) in alone.branches.iter().zip(&diagram().branches) {
        assert_eq!((&a.name, table(a)), (&b.name, table(b)));
        assert!(a.points.iter().zip(&b.points).all(|(p, q)| p.solution == q.solution));
    }
}

/// Observer that stops the run after a number of points.
struct Impatient(AtomicUsize);

impl Observer for Impatient {
    fn observe(&self, event: Event) -> Verdict {
        match event {
            Event::Point(..) if self.0.fetch_sub(1, Ordering::Relaxed) <= 1 => Verdict::Stop,
            _ => Verdict::Continue,
        }
    }
}

#[test]
fn a_run_stopped_anywhere_resumes_to_the_same_diagram() {
    let mut study = study(1e-6);
    study.plan.branches.retain(|b| b.name == "contact SL");
    let system = System::of_plan(&study.model, &study.plan);
    let whole = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    // Anywhere along the branches, and near the start and the end of the doubled branches: with their special points
    // alone, and with those at both ends but without the record that they are ends.
    let mut places = vec![1, 17, 40];
    let mut before = 0;
    for branch in &whole.branches {
        before += branch.points.len();
        places.extend([before - 5, before, before + 1, before + 2]);
    }
    places.truncate(places.len() - 3);
    for points in places {
        let mut earlier =
            explore::run(&system, &study.plan, 1, Diagram::default(), &Impatient(AtomicUsize::new(points)));
        // A run that was killed has recorded no endings.
        for branch in &mut earlier.branches {
            branch.ends.iter_mut().for_each(|end| *end = end.take().filter(|e| *e != Ending::Stopped));
        }
        if let Some(last) = earlier.branches.last_mut().filter(|branch| growth::is_doubled(branch)) {
            last.ends = [None, None];
        }
        let kept: usize = earlier.branches.iter().map(|b| b.points.len()).sum();
        let resumed = explore::run(&system, &study.plan, 1, earlier, &Unobserved);
        assert!(resumed.branches.iter().map(|b| b.points.len()).sum::<usize>() >= kept);
        assert_eq!(resumed.branches.len(), whole.branches.len(), "after {points} points");
        for (a, b) in resumed.branches.iter().zip(&whole.branches) {
            let codes = |branch: &Branch| branch.ends.clone().map(|end| end.map(|end| end.code()));
            assert_eq!(codes(a), codes(b), "{} after {points} points", a.name);
            assert_eq!(
                a.special.len(),
                b.special.len(),
                "{} after {points} points: {:?} {:?}",
                a.name,
                table(a),
                table(b)
            );
            for (s, t) in a.special.iter().zip(&b.special) {
                assert!((s.point.parameters[OMEGA] - t.point.parameters[OMEGA]).abs() < 1e-6, "{} {}", a.name, s.kind);
            }
        }
    }
}

const MODEL: &str = include_str!("../../../models/overhung-rotor.toml");

/// A cycle found at ζ = 0.01 is carried to ζ = 1e-5, where nothing settles in reasonable time, and followed there.
#[test]
fn a_homotopy_reaches_the_lightly_damped_rotor() {
    let text = "model = \"m\"\n[[seed]]\nname = \"s\"\nattractor = \"2:1\"\n\
        [[branch]]\nname = \"less damping\"\nfrom = \"s\"\nfree = \"zeta\"\nuntil = 1e-5\n\
        [[branch]]\nname = \"SL\"\nfrom = \"less damping\"\nfree = \"Omega\"\nrange = [3, 10]\n";
    let study = parse_study(text, "study", MODEL, "model").unwrap();
    let diagram =
        explore::run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved);
    let branch = diagram.branch("SL").unwrap();
    let row = reference("overhung_rotor_special_points.csv").pop().unwrap();
    let number = |k: usize| row[k].parse::<f64>().unwrap();
    assert!(
        row[0].contains("zeta=1e-5") && has(branch, &row[2], number(3), Some(number(4)), number(5)),
        "{:?}",
        table(branch)
    );
    assert_eq!(table(branch).len(), 1);
}

/// Such cycles attract so few states that sampling misses them; states on them come from long simulations.
#[test]
fn states_on_cycles_of_many_turns_lead_to_them() {
    let model = include_str!("../../../models/overhung-rotor.toml");
    // Speed, state, and period relative to one turn of the 3:1 or 4:1 cycle at that speed: about 3, 4 and 5.
    for (omega, state, period) in [
        (3.99, "u = -1.194, v = -0.046, du = -2.112, dv = -1.438", 12.114265),
        (4.11, "u = -1.695, v = -1.616, du = -5.755, dv = 2.337", 15.713851),
        (4.83, "u = -0.031, v = -0.813, du = -0.775, dv = -3.906", 13.580696),
    ] {
        let text = format!(
            "model = \"m\"\n[[seed]]\nname = \"s\"\nstate = {{ {state} }}\nparameters = {{ Omega = {omega}, kappa = 1 }}\n\
             [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [{omega}, {}]\n",
            omega + 1e-4
        );
        let study = parse_study(&text, "study", model, "model").unwrap_or_else(|f| panic!("{}", f[0]));
        let system = System::of_plan(&study.model, &study.plan);
        let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
        let start = &diagram.branch("b").unwrap().points[0];
        let found = start.solution.period().unwrap();
        assert!((found - period).abs() < 1e-5 && start.unstable == 0, "{found} {}", start.unstable);
    }
}
