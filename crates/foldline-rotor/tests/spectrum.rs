//! Spectra in both frames, from cycles whose lines are known and from a computed one.

use foldline::diagram::{Cycle, Mesh};
use foldline::problem::gauss::Scheme;
use foldline_rotor::{Frame, Spectrum, Whirl, mean_square};

/// A cycle with lines c_k at k w, and its exact profile at the nodes.
fn cycle(base: f64, lines: &[(i32, f64, f64)]) -> Cycle {
    let (period, degree) = (std::f64::consts::TAU / base, 7);
    let mesh: Mesh = (0..=60).map(|j| f64::from(j) / 60.0).collect();
    let scheme = Scheme::new(degree);
    let mut profile = Vec::new();
    for j in 0..60 {
        for node in &scheme.nodes {
            let t = (f64::from(j) + node) / 60.0 * period;
            let part = |shift: f64, rate: bool| {
                let term = |&(k, amplitude, phase): &(i32, f64, f64)| {
                    let speed = f64::from(k) * base;
                    let size = if rate { amplitude * speed } else { amplitude };
                    size * (speed * t + phase + shift).cos()
                };
                lines.iter().map(term).sum::<f64>()
            };
            let quarter = std::f64::consts::FRAC_PI_2;
            profile.extend([part(0.0, false), part(-quarter, false), part(quarter, true), part(0.0, true)]);
        }
    }
    Cycle {
        points: foldline::problem::gauss::Points::Gauss,
        period,
        forcing_periods: 0,
        mesh,
        degree,
        profile,
        gain: Vec::new(),
    }
}

#[test]
fn lines_have_the_right_frequency_and_whirl_in_both_frames() {
    let (base, speed) = (1.7, 5.0);
    let spectrum = Spectrum::of(&cycle(base, &[(-1, 2.0, 0.3), (-4, 1.0, 0.0), (0, 0.4, 0.2), (2, 1e-3, 0.0)]), speed);
    assert_eq!(spectrum.name(), "4:1");
    let rotating = spectrum.peaks(Frame::Rotating, 1e-2);
    let inertial = spectrum.peaks(Frame::Inertial, 1e-2);
    let table = |peaks: &[foldline_rotor::Line]| peaks.iter().map(|l| (l.order, l.whirl)).collect::<Vec<_>>();
    assert_eq!(table(&rotating), [(-1, Whirl::Backward), (-4, Whirl::Backward), (0, Whirl::Static)]);
    assert_eq!(table(&inertial), [(-1, Whirl::Forward), (-4, Whirl::Backward), (0, Whirl::Forward)]);
    for (line, shifted) in rotating.iter().zip(&inertial) {
        assert!((line.frequency - line.order as f64 * base).abs() < 1e-12);
        assert!((shifted.frequency - line.frequency - speed).abs() < 1e-12 && shifted.amplitude == line.amplitude);
    }
    assert!((rotating[0].amplitude - num_complex::Complex64::from_polar(2.0, 0.3)).norm() < 1e-12, "{rotating:?}");
    assert_eq!(spectrum.peaks(Frame::Rotating, 1e-4).len(), 4, "the faint line counts at a lower share");
    assert_eq!(spectrum.amplitude(1_000_000).norm(), 0.0);
    // A line at rest in the inertial frame.
    let spectrum = Spectrum::of(&cycle(base, &[(-2, 1.0, 0.0), (-1, 0.5, 0.0)]), 2.0 * base);
    assert_eq!(spectrum.peaks(Frame::Inertial, 0.9)[0].whirl, Whirl::Static);
}

#[test]
fn the_lines_satisfy_parsevals_identity() {
    let cycle = cycle(2.3, &[(-1, 1.0, 0.0), (-2, 0.6, 1.0), (0, 0.2, 0.5)]);
    let square = mean_square(&cycle);
    assert!((square - (1.0 + 0.36 + 0.04)).abs() < 1e-12, "{square}");
    assert!(Spectrum::of(&cycle, 5.0).parseval_defect(square).abs() < 1e-12);
}

#[test]
fn power_and_torque_balances_are_sums_over_lines() {
    // Two lines that balance power: w(w - Ω)a² + 2w(2w - Ω)b² = 0.
    let (base, speed, zeta): (f64, f64, f64) = (3.0, 5.0, 0.01);
    let second = ((speed - base) / (2.0 * (2.0 * base - speed))).sqrt();
    let swirl = (speed - base) + (speed - 2.0 * base) * second * second;
    // And torque: m ε Ω² Im c₀ = -2ζ (swirl + Ω |c₀|²), with c₀ imaginary: a quadratic equation.
    let unbalance: f64 = 0.3;
    let force = unbalance * speed * speed;
    let mean = ((force * force - 16.0 * zeta * zeta * speed * swirl).sqrt() - force) / (4.0 * zeta * speed);
    let spectrum = Spectrum::of(&cycle(base, &[(-1, 1.0, 0.0), (-2, second, 0.0)]), speed);
    assert!(spectrum.power_defect().abs() < 1e-12 && (spectrum.swirl() - swirl).abs() < 1e-12);
    let defect = |mean: f64| {
        let phase = std::f64::consts::FRAC_PI_2;
        let lines = [(-1, 1.0, 0.0), (-2, second, 0.0), (0, mean, phase)];
        Spectrum::of(&cycle(base, &lines), speed).torque_defect(zeta, unbalance)
    };
    assert!(mean.abs() > 1e-3 && defect(mean).abs() < 1e-12, "{mean}: {}", defect(mean));
    assert!(defect(-mean).abs() > 0.5);
}
