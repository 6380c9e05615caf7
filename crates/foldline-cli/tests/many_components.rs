//! Cycles with many components, whose multipliers are computed by a different method than those of a few.

use foldline::contract::Unobserved;
use foldline::diagram::{Diagram, Kind, Point};
use foldline::explore::{System, run};
use foldline_store::study_file::parse_study;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// The unit circle, with period 2π, beside a plane that turns half as fast, one that turns at a rate of its own, a
/// line, and forty components that decay by up to 115 orders of magnitude in a period. All multipliers are known: those
/// of the first plane are -e^(2π (mu - 0.05)) and -e^(-2π), those of the second e^(2π (mu - 0.15 ± 0.3 i)), that of the
/// line e^(2π (mu - 0.25)), and the others e^(-4π), e^(-2π (k + 2)).
const MODEL: &str = r#"
name = "Known multipliers"

[constants]
n = 40

[parameters]
mu = -0.1

[states]
x = "x - y - x*(x^2 + y^2)"
y = "x + y - y*(x^2 + y^2)"
u = "(mu - 1.05)/2*u + (mu + 0.95)/2*(x*u + y*v) - v/2 - u*(u^2 + v^2)"
v = "(mu - 1.05)/2*v + (mu + 0.95)/2*(y*u - x*v) + u/2 - v*(u^2 + v^2)"
p = "(mu - 0.15)*p - 0.3*q - p*(p^2 + q^2)"
q = "(mu - 0.15)*q + 0.3*p - q*(p^2 + q^2)"
s = "(mu - 0.25)*s - s^3"

[states.z]
count = "n"
equation = "-(i + 2)*z[i] + z[i-1] + z[i+1]/2*x*s"
before = "x"
after = 0
"#;

fn explored() -> Diagram {
    let rest: String = (1..=40).map(|k| format!(", \"z[{k}]\" = 0")).collect();
    let study = format!(
        "model = \"m\"\n[[seed]]\nname = \"circle\"\nstate = {{ x = 1, y = 0, u = 0.01, v = 0, p = 0.01, q = 0, s = 0.01{rest} }}\n\
         [[branch]]\nname = \"b\"\nfrom = \"circle\"\nfree = \"mu\"\nrange = [-0.1, 0.35]\n"
    );
    let study = parse_study(&study, "study", MODEL, "model").unwrap_or_else(|f| panic!("{}", f[0]));
    run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved)
}

fn exact(mu: f64) -> Vec<Complex64> {
    let turning = |angle: f64| Complex64::from_polar((TAU * (mu - 0.15)).exp(), TAU * angle);
    let real = |rate: f64| Complex64::new((TAU * rate).exp(), 0.0);
    let mut all =
        vec![Complex64::ONE, real(-2.0), -real(mu - 0.05), -real(-1.0), turning(0.3), turning(-0.3), real(mu - 0.25)];
    all.extend((1..=40).map(|k| real(-f64::from(k + 2))));
    all
}

/// Largest distance of an exact multiplier from the nearest computed one, relative to the larger of 1 and its modulus.
fn off(point: &Point) -> f64 {
    let nearest = |z: Complex64| point.spectrum.iter().map(|w| (w - z).norm()).fold(f64::INFINITY, f64::min);
    exact(point.parameters[0]).into_iter().map(|z| nearest(z) / z.norm().max(1.0)).fold(0.0, f64::max)
}

#[test]
fn bifurcations_among_strongly_damped_components_are_at_their_known_values() {
    let diagram = explored();
    let branch = diagram.branch("b").unwrap();
    let mut found: Vec<_> = branch.special.iter().collect();
    found.sort_by(|a, b| a.point.parameters[0].total_cmp(&b.point.parameters[0]));
    let expected = [(Kind::PeriodDoubling, 0.05), (Kind::Torus, 0.15), (Kind::BranchPoint, 0.25)];
    assert_eq!(found.iter().map(|one| one.kind).collect::<Vec<_>>(), expected.map(|(kind, _)| kind));
    for (one, (kind, mu)) in found.iter().zip(expected) {
        let apart = (one.point.parameters[0] - mu).abs();
        assert!(
            apart <= one.error * branch.size(mu) && one.error < 1e-5,
            "{kind:?}: {apart:e}, stated {:e}",
            one.error
        );
    }
    for point in &branch.points {
        let mu = point.parameters[0];
        let unstable = exact(mu)[1..].iter().filter(|z| z.norm() > 1.0).count();
        let clear = expected.iter().all(|(_, at)| (mu - at).abs() > 1e-5);
        assert!(!clear || point.unstable == unstable, "{} at {mu}", point.unstable);
        assert_eq!(point.spectrum.len(), 47);
        assert!(off(point) <= point.trust.spectrum, "{:e} off at {mu}, stated {:e}", off(point), point.trust.spectrum);
    }
}
