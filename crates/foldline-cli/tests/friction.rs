//! Cycles that stick and slide: against closed forms and multiple shooting.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind, Point, SpecialPoint};
use foldline::explore::{self, System};
use foldline_store::study_file::parse_study;

const RUB: &str = include_str!("../../../models/overhung-rotor-rub.toml");

/// x'' + c x' + x = f cos(w t) - sign(x').
fn coulomb(c: f64) -> String {
    format!(
        "name = \"dry friction\"\n[parameters]\nw = 2\nc = {c}\nf = 1.5\n[forcing]\nfrequency = \"w\"\n\
         [states.x]\nequation = \"v\"\n[states.v]\nequation = \"f*cos(w*t) - c*v - x - sign(v)\"\n"
    )
}

/// A block on a belt of speed p, x'' + c x' + x = F(p - x'), F(s) = sign(s)/(1 + 3|s|).
fn belt(c: f64) -> String {
    format!(
        "name = \"belt\"\n[parameters]\np = 0.5\nc = {c}\n[states.x]\nequation = \"v\"\n[states.v]\n\
         equation = \"-c*v - x + sign(p - v)/(1 + 3*abs(p - v))\"\n"
    )
}

#[track_caller]
fn run(model: &str, study: &str) -> Diagram {
    let text = format!("model = \"m\"\n{study}");
    let study = parse_study(&text, "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"));
    explore::run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved)
}

/// The point of a mark.
#[track_caller]
fn mark(branch: &Branch, value: f64) -> &Point {
    let at = |point: &&Point| (point.parameters[branch.free] - value).abs() < 1e-12;
    branch
        .special
        .iter()
        .filter(|s| s.kind == Kind::Mark)
        .map(|s| &s.point)
        .find(at)
        .unwrap_or_else(|| panic!("{value}"))
}

/// Sticking begins where w = 1.2357… and ends where w = 0.7226…: at w = 0.8 the mass slips throughout.
#[test]
fn a_response_with_dry_friction_sticks_twice_in_a_period_away_from_resonance() {
    let study = |w: f64, range: &str, marks: &str| {
        format!(
            "tolerance = 1e-9\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 8\nparameters = {{ w = {w} }}\n[[branch]]\nname = \"b\"\n\
             from = \"s\"\nfree = \"w\"\nrange = {range}\nmark = {{ w = [{marks}] }}\n"
        )
    };
    let diagram = run(&coulomb(0.1), &study(2.0, "[0.45, 2.1]", "0.5, 0.8, 2"));
    let branch = diagram.branch("b").unwrap();
    assert!(branch.ends.iter().all(|end| end.as_ref().is_some_and(Ending::complete)), "{:?}", branch.ends);
    let known = [
        (0.5, 1.590652096503, [0.0108858292, 0.0]),
        (0.8, 2.145852589884, [0.250256805, 0.0365532704]),
        (2.0, 0.125412463390, [0.062408434, 0.0]),
    ];
    for (w, largest, multipliers) in known {
        let point = mark(branch, w);
        let off = (point.ranges[0][1] - largest).abs();
        assert!(off < 1e-10 && off < point.trust.discretisation, "w = {w}: {:?}", point.ranges);
        for (own, known) in point.spectrum.iter().zip(multipliers) {
            assert!((own.re - known).abs() < 2e-9 && own.im == 0.0, "w = {w}: {:?}", point.spectrum);
        }
        // A direction is lost where the mass sticks.
        assert_eq!(point.spectrum[1].norm() == 0.0, w != 0.8, "w = {w}: {:?}", point.spectrum);
    }
    let sliding: Vec<f64> =
        branch.special.iter().filter(|s| s.kind == Kind::Sliding).map(|s| s.point.parameters[0]).collect();
    assert_eq!(sliding.len(), 2, "{sliding:?}");
    for (own, known) in sliding.iter().zip([0.722679194438143, 1.235747152322398]) {
        assert!((own - known).abs() < 1e-9, "{own} {known}");
    }
    assert!(branch.special.iter().all(|s| s.kind != Kind::Sliding || s.remark == "crossing-sliding at v = 0"));
    // Without viscous damping: Den Hartog's closed form.
    let diagram = run(&coulomb(0.0), &study(0.78, "[0.75, 0.85]", "0.8"));
    let off = mark(diagram.branch("b").unwrap(), 0.8).ranges[0][1] - 2.873011264978818;
    assert!(off.abs() < 1e-9, "{off}");
}

#[test]
fn a_block_sticks_to_its_belt() {
    let study = "tolerance = 1e-9\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 8\n[[branch]]\nname = \"b\"\n\
        from = \"s\"\nfree = \"p\"\nrange = [0.2, 0.6]\nmark = { p = [0.5] }\n";
    for (c, known) in [(0.0, [(0.2, 12.001031294831), (0.5, 8.282743522678)]), (0.1, [(0.5, 7.772137860833); 2])] {
        let diagram = run(&belt(c), study);
        let branch = diagram.branch("b").unwrap();
        assert!(branch.ends.iter().all(|end| end.as_ref().is_some_and(Ending::complete)), "{:?}", branch.ends);
        for (p, period) in known {
            let near = |a: &&Point, b: &&Point| (a.parameters[0] - p).abs().total_cmp(&(b.parameters[0] - p).abs());
            let all = branch.points.iter().chain(branch.special.iter().map(|s| &s.point));
            let point = all.min_by(near).unwrap();
            let own = match &point.solution {
                foldline::diagram::Solution::Cycle(cycle) => cycle.period,
                foldline::diagram::Solution::Equilibrium(_) | foldline::diagram::Solution::Torus(_) => f64::NAN,
            };
            assert!((own - period).abs() < 1e-8, "c = {c}, p = {p}: {own} at {}", point.parameters[0]);
            assert!((point.ranges[1][1] - p).abs() < 1e-9, "the block never overtakes the belt");
            assert_eq!(point.spectrum[1].norm(), 0.0);
        }
    }
}

/// The stick-slip cycle meets the cycle that slips throughout, which shrinks to the equilibrium at its Hopf point: one
/// branch, from either end.
#[test]
fn a_branch_turns_back_where_sticking_ends() {
    let study = "tolerance = 1e-8\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 8\n\
        parameters = { p = 1.2 }\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p\"\nrange = [1.1, 4]\n\
        [[seed]]\nname = \"rest\"\nattractor = \"equilibrium\"\nparameters = { p = 4 }\n\
        [[branch]]\nname = \"e\"\nfrom = \"rest\"\nfree = \"p\"\nrange = [1.4, 4]\nswitch = { hopf = 1 }\n";
    let diagram = run(&belt(0.1), study);
    for name in ["b", "e/hopf-1"] {
        let branch = diagram.branch(name).unwrap();
        let complete = |end: &Option<Ending>| end.as_ref().is_some_and(Ending::complete);
        assert!(branch.ends.iter().all(complete), "{name}: {:?}", branch.ends);
        let grazing: Vec<_> = branch.special.iter().filter(|s| s.kind == Kind::Grazing).collect();
        let [corner] = &grazing[..] else { panic!("{name}: {}", grazing.len()) };
        let off = (corner.point.parameters[0] - 2.892345819430).abs();
        assert!(off < corner.error && off < 1e-8, "{name}: off {off}, stated {}", corner.error);
        assert_eq!(corner.remark, "grazing-sliding: non-smooth fold at p - v = 0", "{name}");
        assert!(branch.special.iter().all(|s| s.kind == Kind::Grazing), "{name}");
    }
}

/// v' = A cos t - sign v slips throughout the period if A exceeds √(1 + π²/4): at its turning points the force is then
/// greater than that of friction.
#[test]
fn a_block_without_a_spring_sticks_below_a_known_force() {
    let model = "name = \"block\"\n[parameters]\nA = 3\n[forcing]\nfrequency = 1\n[states.v]\n\
        equation = \"A*cos(t) - sign(v)\"\n";
    let study = "tolerance = 1e-8\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 8\n[[branch]]\nname = \"b\"\n\
        from = \"s\"\nfree = \"A\"\nrange = [1.05, 4]\n";
    let diagram = run(model, study);
    let [sliding] = &diagram.branch("b").unwrap().special[..] else { panic!("one special point") };
    let off = (sliding.point.parameters[0] - 1f64.hypot(std::f64::consts::FRAC_PI_2)).abs();
    assert!(sliding.kind == Kind::Sliding && off < sliding.error && off < 1e-8, "{off}, stated {}", sliding.error);
}

/// The synchronous rub is an equilibrium of the rotating frame. Its folds and Hopf points are known.
#[test]
fn a_rotor_rubs_in_step_with_its_unbalance() {
    let rows = include_str!("reference/exact_rub.csv").lines().skip(3);
    for row in rows {
        let fields: Vec<&str> = row.split(',').collect();
        let [zeta, mu, omega, radius] = [1, 2, 3, 4].map(|k| fields[k].parse::<f64>().unwrap());
        let study = format!(
            "tolerance = 1e-9\n[[seed]]\nname = \"s\"\nstate = {{ u = 0.05, v = 0, du = 0, dv = 0 }}\n\
             parameters = {{ Omega = 0.5, zeta = {zeta}, mu = {mu} }}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n\
             free = \"Omega\"\nrange = [0.3, 5]\n"
        );
        let diagram = run(RUB, &study);
        let branch = diagram.branch("b").unwrap();
        let off = |s: &SpecialPoint| {
            (s.point.parameters[0] - omega).abs().max((s.point.ranges[4][1] - radius).abs() / radius)
        };
        let own = branch.special.iter().filter(|s| s.kind.name() == fields[0]);
        let nearest = own.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or_else(|| panic!("{row}"));
        assert!(off(nearest) < 1e-8, "{row}: {:e}", off(nearest));
    }
}

/// On the cycles that leave a Hopf point of the rub, the disc whirls backwards until it rolls along the ring: from there on
/// its surface is at rest for a part of the period, and a multiplier is zero.
#[test]
fn a_rotor_that_rubs_comes_to_roll_along_its_ring() {
    let study = include_str!("../../../studies/exact/rub.toml").replace("../../models/overhung-rotor-rub.toml", "m");
    let study = study.lines().filter(|line| !line.starts_with("model =")).collect::<Vec<_>>().join("\n");
    let diagram = run(RUB, &study);
    let whirl = diagram.branch("rub/hopf-1").unwrap();
    assert!(whirl.ends.iter().all(|end| end.as_ref().is_some_and(Ending::complete)), "{:?}", whirl.ends);
    let corners: Vec<&str> =
        whirl.special.iter().filter(|s| s.kind == Kind::Grazing).map(|s| s.remark.as_str()).collect();
    assert_eq!(corners.iter().filter(|remark| remark.starts_with("grazing-sliding: non-smooth fold")).count(), 1);
    let rolls: Vec<&Point> =
        whirl.points.iter().filter(|point| point.spectrum.iter().any(|z| z.norm() == 0.0)).collect();
    assert!(rolls.len() > 3);
    // It rolls exactly where the smallest sliding speed is zero or has been passed.
    for point in rolls {
        assert!(point.ranges[5][0] < 1e-6, "{:?}", point.ranges);
    }
}
