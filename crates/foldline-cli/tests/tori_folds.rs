//! Curves of folds of tori: against folds of branches at other values of the second parameter, and independent numbers in
//! `reference/tori.csv` (invariant curves by Newton's method with high-order integration).

use crate::tori::of;
use foldline::diagram::{Branch, Ending, Family, Kind, Point};

fn fold(branch: &Branch) -> &Point {
    &branch
        .special
        .iter()
        .find(|special| special.kind == Kind::Fold)
        .unwrap_or_else(|| panic!("{:?}", branch.ends))
        .point
}

#[track_caller]
fn mark(branch: &Branch, index: usize, value: f64) -> &Point {
    let there = |p: &&Point| (p.parameters[index] - value).abs() < 1e-9;
    let marks = branch.special.iter().filter(|special| special.kind == Kind::Mark).map(|special| &special.point);
    marks.chain(&branch.points).find(there).unwrap_or_else(|| panic!("no point at {value}: {:?}", branch.ends))
}

#[test]
fn folds_of_the_bouncing_tori_move_with_gravity_as_computed_one_by_one() {
    let (study, diagram) = of(
        "overhung-rotor-gravity",
        "[[seed]]\nname = \"s\"\nattractor = \"2:1\"\ntorus = true\nparameters = { Omega = 5, G = 0 }\n\
         [[branch]]\nname = \"to 0.05\"\nfrom = \"s\"\nfree = \"G\"\nuntil = 0.05\n\
         [[branch]]\nname = \"to 0.2\"\nfrom = \"s\"\nfree = \"G\"\nuntil = 0.2\n\
         [[branch]]\nname = \"at 0.05\"\nfrom = \"to 0.05\"\nfree = \"Omega\"\nrange = [3.4, 5.1]\n\
         [[branch]]\nname = \"at 0.2\"\nfrom = \"to 0.2\"\nfree = \"Omega\"\nrange = [3.4, 5.1]\n\
         [[curve]]\nname = \"folds\"\nof = \"at 0.05\"\nhold = \"fold\"\nfree = \"G\"\nrange = [0.01, 0.2]\n",
    );
    let [speed, gravity] = ["Omega", "G"].map(|name| study.model.parameter_index(name).unwrap());
    let curve = diagram.branch("folds").unwrap();
    assert_eq!(curve.family, Family::Torus);
    assert_eq!(curve.ends, [Some(Ending::Bound(0.01)), Some(Ending::Bound(0.2))]);
    // tori.csv, A3-fold-SL-lower-0.05.
    let known = fold(diagram.branch("at 0.05").unwrap()).parameters[speed];
    assert!((known - 3.4676512922).abs() < 1e-6, "{known}");
    // The end at 0.2, against a fold of the branch there; each within its stated error, that of the plan's tolerance.
    let [there, alone] = [mark(curve, gravity, 0.2), fold(diagram.branch("at 0.2").unwrap())];
    let off = (there.parameters[speed] - alone.parameters[speed]).abs();
    let stated = (there.trust.discretisation + alone.trust.discretisation) * (1.0 + alone.parameters[speed]);
    assert!(off <= stated, "{off:e} {stated:e}");
    // A3-scaling: the shift is 0.630 G² as G tends to 0, from 3.4660778052 without gravity; to 1 %.
    let small = (mark(curve, gravity, 0.01).parameters[speed] - 3.4660778052) / 1e-4;
    assert!((small - 0.630).abs() < 0.03, "{small}");
}

#[test]
fn folds_of_the_response_to_two_tones_end_in_a_cusp() {
    let (study, diagram) = of(
        "duffing-two-tones",
        "[[seed]]\nname = \"both\"\nattractor = \"torus\"\n\
         [[branch]]\nname = \"tori\"\nfrom = \"both\"\nfree = \"eta\"\nrange = [1.3, 2.1]\nmax-points = 60\n\
         [[branch]]\nname = \"to 0.27\"\nfrom = \"both\"\nfree = \"delta\"\nuntil = 0.27\n\
         [[branch]]\nname = \"to 0.3\"\nfrom = \"both\"\nfree = \"delta\"\nuntil = 0.3\n\
         [[branch]]\nname = \"at 0.27\"\nfrom = \"to 0.27\"\nfree = \"eta\"\nrange = [1.2, 2.1]\n\
         [[branch]]\nname = \"at 0.3\"\nfrom = \"to 0.3\"\nfree = \"eta\"\nrange = [1.2, 2.1]\n\
         [[curve]]\nname = \"folds\"\nof = \"tori\"\nhold = \"fold\"\nfree = \"delta\"\nrange = [0.08, 0.8]\nbranch-range = [0.5, 3]\nmark = { delta = [0.27] }\n",
    );
    let [damping, frequency] = ["delta", "eta"].map(|name| study.model.parameter_index(name).unwrap());
    let curve = diagram.branch("folds").unwrap();
    let cusps: Vec<&Point> = curve.special.iter().filter(|s| s.kind == Kind::Cusp).map(|s| &s.point).collect();
    let [cusp] = cusps[..] else { panic!("{:?}", curve.ends) };
    // The folds of branches at two values of the damping, on either side of the cusp.
    let folds = |name: &str| -> Vec<&Point> {
        let branch = diagram.branch(name).unwrap();
        let own = branch.special.iter().filter(|special| special.kind == Kind::Fold).map(|special| &special.point);
        own.filter(|point| (1.2..1.45).contains(&point.parameters[frequency])).collect()
    };
    assert!(cusp.parameters[damping] > 0.27 && cusp.parameters[damping] < 0.3, "{:?}", cusp.parameters);
    assert_eq!([folds("at 0.27").len(), folds("at 0.3").len()], [2, 0]);
    let marked = curve.special.iter().filter(|s| s.kind == Kind::Mark).map(|s| &s.point);
    let mut marked: Vec<f64> = marked.map(|point| point.parameters[frequency]).collect();
    let mut alone: Vec<f64> = folds("at 0.27").iter().map(|point| point.parameters[frequency]).collect();
    marked.sort_by(f64::total_cmp);
    alone.sort_by(f64::total_cmp);
    assert_eq!(marked.len(), 2);
    for (a, b) in marked.iter().zip(&alone) {
        // The tolerance of the study, on both sides.
        assert!((a - b).abs() < 2e-6 * (1.0 + b), "{a} {b}");
    }
}
