//! Files of AUTO-07p: they are read, mistakes in them are reported, and imported starts give the same branches as our
//! own.

mod programs;

use foldline::contract::Unobserved;
use foldline::diagram::{Diagram, Kind};
use foldline::explore::{self, SeedSource, System, mismatch};
use foldline::model::Model;
use foldline_store::auto::{Chosen, Complaint, Labelled, Mapping, Names, solutions, study};
use foldline_store::model_file::parse_model;
use foldline_store::study_file::parse_study;

const EQUILIBRIA: &str = include_str!("s.ab");
const CYCLES: &str = include_str!("s.ab-cycles");
const CONSTANTS: &str = include_str!("c.ab");
const BRANCH: &str = include_str!("b.ab");
const MODEL: &str = include_str!("../../../../models/ab-reaction.toml");
const BRATU: [&str; 2] = [include_str!("s.bratu"), include_str!("../../../../models/bratu.toml")];
const DUFFING: [&str; 2] = [include_str!("s.duffing"), include_str!("../../../../models/duffing-forced.toml")];
const CIRCUIT: [&str; 2] = [include_str!("s.cir"), include_str!("../../../../models/freire-circuit.toml")];

fn model(text: &str) -> Model {
    parse_model(text, "m.toml").unwrap()
}

fn typed(pairs: &[(usize, &str)]) -> Vec<(usize, String)> {
    pairs.iter().map(|(number, name)| (*number, name.to_string())).collect()
}

/// Returns the study that starts from the first solution of a text.
fn imported(model: &Model, text: &str, names: &Names, pairs: [&[(usize, &str)]; 2]) -> Result<String, Complaint> {
    let solution = &solutions(text, "s.ab").unwrap()[0];
    let mapping = Mapping::new(model, names, &typed(pairs[0]), &typed(pairs[1]), solution.dim())?;
    study(model, "m.toml", &[Chosen { file: "s.ab", solution, names, mapping }])
}

#[test]
fn labels_states_periods_and_meshes_are_read() {
    let found = solutions(EQUILIBRIA, "s.ab").unwrap();
    let kinds: Vec<_> = found.iter().map(|s| s.named().map(|(letters, _)| letters)).collect();
    assert_eq!(kinds, [Some("EP"), Some("LP"), Some("LP"), None, Some("HB"), Some("EP")]);
    let hopf = &found[4];
    assert_eq!((hopf.label, hopf.branch, hopf.lasts(), hopf.period()), (5, 1, false, None));
    assert_eq!((hopf.states.as_slice(), hopf.free.as_slice()), (&[0.89508063375, 4.1770429575][..], &[1][..]));
    assert_eq!(hopf.parameters[..3], [0.13090004473, 14.0, 2.0]);
    let cycle = &solutions(CYCLES, "s.ab-cycles").unwrap()[0];
    assert_eq!((cycle.label, cycle.intervals, cycle.degree, cycle.dim()), (7, 20, 4, 2));
    assert_eq!((cycle.times.len(), cycle.times[0], cycle.times[80]), (81, 0.0, 1.0));
    assert_eq!((cycle.period(), cycle.free.as_slice()), (Some(2.9999981419), &[1, 11][..]));
}

#[test]
fn numbers_of_fortran_are_read() {
    let with = |number: &str| {
        let text = EQUILIBRIA.replace("8.9508063375E-001", number);
        solutions(&text, "s.ab").map(|found| found[4].states[0])
    };
    for (written, value) in
        [("8.9D-001", 0.89), ("8.9d-01", 0.89), ("8.9-101", 8.9e-101), ("-8.9+005", -8.9e5), (".5", 0.5)]
    {
        assert_eq!(with(written), Ok(value), "{written}");
    }
    for wrong in ["NaN", "8.9E+999", "*****", "8.9.1", "E5", "--1"] {
        let found = with(wrong).unwrap_err();
        assert!(found[0].message.contains(&format!("\"{wrong}\" is not a finite number")), "{wrong}: {}", found[0]);
        assert_eq!((found[0].line, found[0].column), (30, 26), "{wrong}: {}", found[0]);
    }
    // Versions before 07p had neither IPS nor anything else after the twelfth integer.
    let old = EQUILIBRIA
        .replace("    11    0    2    1    0\n", "    11\n")
        .replace("   11    0    2    1    0\n", "   11\n");
    assert_ne!(old, EQUILIBRIA);
    let without = |all: Vec<Labelled>| all.into_iter().map(|s| Labelled { problem: None, ..s }).collect::<Vec<_>>();
    assert_eq!(without(solutions(&old, "s.ab").unwrap()), without(solutions(EQUILIBRIA, "s.ab").unwrap()));
}

#[test]
fn corrupted_files_are_reported_with_position_and_cure() {
    let lines: Vec<&str> = CYCLES.lines().collect();
    let cut = lines[..60].join("\n");
    let row = lines[..40].iter().chain(&lines[41..]).copied().collect::<Vec<_>>().join("\n") + "\n\n";
    let cases: [(&str, String, usize, &str); 7] = [
        ("cut", cut, 1, "the file ends inside the solution labelled 7, after 59 of its 166 lines"),
        ("a row is missing", row, 83, "\"1.8978541499E+000\" is not the number of a parameter"),
        ("no solution", "\n\n".into(), 1, "there is no solution in this file"),
        ("another file", BRANCH.into(), 1, "\"0.0000E+00\" is not an integer"),
        ("short head", CYCLES.replacen("    0    2    2    0", "", 1).replacen("   12", "", 1), 1, "12 or 16 integers"),
        (
            "mesh",
            CYCLES.replacen("   20    4   12", "   21    4   12", 1),
            1,
            "81 points, which is not 21 intervals of 4",
        ),
        (
            "huge",
            CYCLES.replacen("      81     3", "      81     999999999999", 1),
            1,
            "too few for 81 points of 999999999999 columns",
        ),
    ];
    for (what, text, line, message) in cases {
        let found = solutions(&text, "s.ab").map(|found| found.len()).unwrap_err();
        assert_eq!((found.len(), found[0].line), (1, line), "{what}: {}", found[0]);
        assert!(found[0].message.contains(message) && found[0].hint.is_some(), "{what}: {}", found[0]);
    }
}

#[test]
fn a_cycle_becomes_a_seed_with_the_same_polynomials() {
    let model = model(MODEL);
    let text = imported(&model, CYCLES, &Names::of(CONSTANTS), [&[], &[]]).unwrap();
    let study = parse_study(&text, "s.toml", MODEL, "m.toml").unwrap();
    let seed = &study.plan.seeds[0];
    assert_eq!((seed.name.as_str(), study.plan.branches[0].range), ("label 7", [0.0, 0.4]));
    assert_eq!(seed.parameters, [0.11934046606, 14.0, 2.0]);
    let SeedSource::Cycle(cycle) = &seed.source else { panic!("{:?}", seed.source) };
    assert_eq!((cycle.intervals(), cycle.degree, cycle.period), (20, 4, 2.9999981419));
    let auto = &solutions(CYCLES, "s.ab").unwrap()[0];
    for (t, state) in auto.times.iter().zip(auto.states.chunks(2)) {
        // Time 1 belongs to the next period, and AUTO's values have fewer digits.
        let found = cycle.state(*t);
        found.iter().zip(state).for_each(|(a, b)| assert!((a - b).abs() < 1e-9, "{t} {found:?} {state:?}"));
    }
    let (_, share) = mismatch(&model, &seed.parameters, &foldline::diagram::Solution::Cycle(cycle.clone())).unwrap();
    // Both satisfy the same equations at the same Gauss points. The eleven digits of the file are divided by steps of
    // 1e-3.
    assert!(share < 1e-7, "{share}");
}

#[test]
fn mismatches_with_the_model_are_reported() {
    let own = model(MODEL);
    let (named, bare) = (Names::of(CONSTANTS), Names::default());
    let renamed = model(&MODEL.replace("p1", "Da").replace("u1", "c").replace("u2", "T"));
    let swapped = model(&MODEL.replace("u1", "uu").replace("u2", "u1").replace("uu", "u2"));
    let other = model(&MODEL.replace("14.0", "13.0"));
    let three = model(&format!("{MODEL}\n[states.u3]\nequation = \"-u3\"\n"));
    let forced = model(
        &MODEL
            .replace("- p3*u2", "- p3*u2 + 0*sin(t)")
            .replace("[states.u1]", "[forcing]\nperiod = \"2*pi\"\n[states.u1]"),
    );
    type Pairs = &'static [(usize, &'static str)];
    let cases: [(&Model, &Names, [Pairs; 2], &str); 9] = [
        (
            &renamed,
            &named,
            [&[], &[]],
            "the solution labelled 7 has the free parameter PAR(1), whose name in the model is unknown",
        ),
        (&renamed, &bare, [&[(1, "DA")], &[]], "--parameters: the model has no \"DA\""),
        (&own, &bare, [&[(1, "p1")], &[(1, "u2")]], "the number of u1 among AUTO's states is unknown"),
        (&own, &bare, [&[(1, "p1")], &[(1, "u2"), (1, "u1")]], "does not match each of AUTO's states, 1 to 2"),
        (
            &own,
            &bare,
            [&[(1, "p1"), (40, "p2")], &[]],
            "p2 is assigned to PAR(40), but the solution has only 12 parameters",
        ),
        (&swapped, &named, [&[], &[]], "does not satisfy the model: the relative residual of the equation of"),
        (
            &other,
            &bare,
            [&[(1, "p1")], &[]],
            "does not satisfy the model: the relative residual of the equation of `u2` is",
        ),
        (&three, &named, [&[], &[]], "has 3 states, but the solution has 2 states"),
        (
            &forced,
            &named,
            [&[], &[]],
            "has the period 2.9999981419, but that of the forcing is 6.283185307179586 at its",
        ),
    ];
    for (model, names, pairs, message) in cases {
        let found = imported(model, CYCLES, names, pairs).unwrap_err();
        assert!(found.message.contains(message) && !found.hint.is_empty(), "{message}: {found:?}");
    }
    assert!(imported(&own, CYCLES, &bare, [&[(1, "p1")], &[]]).is_ok());
    assert!(imported(&swapped, CYCLES, &named, [&[], &[(1, "u2"), (2, "u1")]]).is_ok(), "what is typed counts");
    assert!(imported(&swapped, CYCLES, &bare, [&[(1, "p1")], &[]]).is_ok(), "without names it is the order");
    let open = CYCLES.replacen("1.0000000000E+000  8.0922871782E-001", "1.0000000000E+000  7.0922871782E-001", 1);
    assert!(
        imported(&own, &open, &named, [&[], &[]]).unwrap_err().message.contains("does not close: `u1` ends 1.0e-1")
    );
    let boundary = CYCLES.replacen("   12    0    2    2    0", "   12    0    2    4    0", 1);
    assert!(imported(&own, &boundary, &named, [&[], &[]]).unwrap_err().message.contains("IPS = 4"));
}

#[test]
fn mistakes_in_a_given_cycle_are_reported_with_position_and_cure() {
    let right = "model = \"m.toml\"\n[[seed]]\nname = \"s\"\ncycle = { period = 2, times = [0, 0.5, 1], states = { u1 = [0, 1, 0], u2 = [1, 2, 1] } }\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p1\"\nrange = [0, 1]\n";
    assert!(parse_study(right, "s.toml", MODEL, "m.toml").is_ok());
    let cases: [(&str, &str, &str); 10] = [
        ("period = 2", "period = 0", "s.toml:4:20: the period is not positive"),
        ("[0, 0.5, 1]", "[0, 1, 0.5]", "s.toml:4:31: the times do not increase: 1 is followed by 0.5"),
        ("[0, 0.5, 1]", "[0, 0.5, 2]", "s.toml:4:31: the times do not run from 0 to 1"),
        ("[0, 0.5, 1]", "[1]", "fewer than two numbers"),
        ("u1 = [0, 1, 0]", "u1 = [0, 1]", "the state `u1` has 2 values where there are 3 times"),
        ("u1 = [0, 1, 0], ", "", "the states lack u1"),
        ("u1 =", "v1 =", "has no state `v1`"),
        ("period = 2", "period = 2, through = 4", "the number of time steps, 2, is not a multiple of `through`, 4"),
        ("period = 2, ", "", "s.toml:4:9: the cycle lacks period"),
        ("cycle =", "attractor = \"cycle\"\ncycle =", "another start"),
    ];
    for (piece, by, message) in cases {
        let found = parse_study(&right.replacen(piece, by, 1), "s.toml", MODEL, "m.toml").unwrap_err();
        let told: Vec<String> =
            found.iter().map(|d| format!("{}:{}:{}: {}", d.file, d.line, d.column, d.message)).collect();
        assert!(told.iter().any(|told| told.contains(message)), "{message}: {told:?}");
    }
}

/// The study that starts from the only solution of a file, as text.
fn imported_with(file: &str, text: &str, pairs: &[(usize, &str)]) -> Result<String, Complaint> {
    imported(&model(text), file, &Names::default(), [pairs, &[]])
}

#[test]
fn a_solution_of_a_boundary_value_problem_starts_a_branch() {
    let [file, text] = BRATU;
    let written = imported_with(file, text, &[(1, "p")]).unwrap();
    let wider = |line: &str| if line.starts_with("range =") { "range = [0, 4]".to_string() } else { line.to_string() };
    let wide = written.lines().map(wider).collect::<Vec<_>>().join("\n");
    let study = parse_study(&wide, "s.toml", text, "m.toml").unwrap();
    let seed = &study.plan.seeds[0];
    let SeedSource::Cycle(given) = &seed.source else { panic!("{:?}", seed.source) };
    assert_eq!((given.intervals(), given.degree, given.forcing_periods), (8, 4, 1));
    // AUTO's mark at p = 2, to its tolerance.
    assert!((seed.parameters[0] - 2.0).abs() < 1e-8, "{}", seed.parameters[0]);
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    let branch = diagram.branch("solutions from label 2").unwrap();
    let fold = branch.special.iter().find(|special| special.kind == Kind::Fold).unwrap();
    // 8 of the largest (θ / cosh θ)², as in Bratu's closed form.
    assert!((fold.point.parameters[0] - 3.513830719125162).abs() < 1e-6, "{:?}", fold.point.parameters);
}

#[test]
fn a_cycle_of_a_forced_system_starts_at_the_phase_of_the_forcing() {
    let [file, text] = DUFFING;
    let all = [(1, "omega"), (2, "A"), (3, "zeta")];
    let written = imported_with(file, text, &all).unwrap();
    let study = parse_study(&written, "s.toml", text, "m.toml").unwrap();
    let SeedSource::State(state) = &study.plan.seeds[0].source else { panic!("{:?}", study.plan.seeds[0].source) };
    // The force A cos(ωt) is largest where AUTO's fourth state, the cosine of its oscillator, is 1.
    let solution = &solutions(file, "s.duffing").unwrap()[0];
    let top = solution.states.chunks_exact(4).max_by(|a, b| a[3].total_cmp(&b[3])).unwrap();
    // The phase is that of the smallest largest residual, to the square root of its rounding; speeds are below 0.05.
    assert!(state.iter().zip(top).all(|(a, b)| (a - b).abs() < 1e-3), "{state:?} {top:?}");
    let slower = imported_with(file, text, &[(2, "A"), (3, "zeta")]).unwrap_err();
    assert!(slower.message.contains("but that of the forcing is"), "{slower:?}");
    let stronger = imported_with(file, &text.replace("- x^3", "- 2*x^3 - 0.5*x"), &all).unwrap_err();
    assert!(stronger.message.contains("does not satisfy the model"), "{stronger:?}");
}

#[test]
fn a_connecting_orbit_becomes_a_curve_next_to_it() {
    let [file, text] = CIRCUIT;
    let numbers = [(1, "nu"), (2, "beta"), (3, "gamma"), (4, "r"), (5, "a3"), (6, "b3")];
    let written = imported_with(file, text, &numbers).unwrap();
    assert!(written.contains("hold = \"homoclinic\"") && written.contains("free = \"beta\""), "{written}");
    let study = parse_study(&written, "s.toml", text, "m.toml").unwrap();
    let curve = &study.plan.curves[0];
    assert!((curve.near.unwrap() + 0.721309).abs() < 1e-5, "{:?}", curve.near);
    let SeedSource::State(state) = &study.plan.seeds[0].source else { panic!("{:?}", study.plan.seeds[0].source) };
    assert!(state.iter().all(|x| x.abs() < 1e-6), "{state:?}");
    let other = imported_with(file, &text.replace("a3*x^3", "a3*x^3 + 0.1"), &numbers).unwrap_err();
    assert!(other.message.contains("are no equilibrium of the model"), "{other:?}");
    let bent = imported_with(file, &text.replace("beta*x - ", "beta*x + x^3 - "), &numbers).unwrap_err();
    assert!(bent.message.contains("does not satisfy the model"), "{bent:?}");
}

#[test]
fn solutions_of_another_kind_than_the_model_are_refused() {
    let boundary = imported_with(BRATU[0], MODEL, &[(1, "p1")]).unwrap_err();
    assert!(boundary.message.contains("IPS = 4") && boundary.hint.contains("boundary-value"), "{boundary:?}");
    let cycle = imported_with(CYCLES, BRATU[1], &[(1, "p")]).unwrap_err();
    assert!(cycle.message.contains("is a boundary-value problem, but the solution labelled 7 is not"), "{cycle:?}");
}
