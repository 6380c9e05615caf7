//! Sampling of systems with known attractors.

use super::*;
use crate::contract::{Batch, Parameters, VectorField, Verdict};
use crate::diagram::{Cost, Cycle, Solution, Trust};
use crate::problem::gauss::Scheme;
use crate::simulation::{Ensemble, Integrator, Tolerance};
use num_complex::Complex64;

mod fields;
mod shooting;

use fields::{BISTABLE, CENTRE, ESCAPING, Field, ROTOR, VAN_DER_POL};

fn sampling(ranges: &[[f64; 2]], samples: usize, jobs: usize) -> Sampling {
    let scales = vec![1.0; ranges.len()];
    Sampling {
        ranges: ranges.to_vec(),
        scales,
        whirl: None,
        samples,
        seed: 2,
        jobs,
        tolerance: 1e-6,
        limits: Limits::default(),
        given: None,
    }
}

/// A box that contains every attractor of the overhung rotor at Ω = 5 (akay, reference constants).
fn rotor_sampling(samples: usize, jobs: usize) -> Sampling {
    let ranges = [[-6.0, 6.0], [-6.0, 6.0], [-15.0, 15.0], [-15.0, 15.0]];
    Sampling { whirl: Some([0, 1]), ..sampling(&ranges, samples, jobs) }
}

fn survey_of(field: &Field, parameters: &[f64], sampling: &Sampling) -> Census {
    survey(field, parameters, sampling, &|candidate| shooting::polish(field, parameters, candidate))
}

/// Smallest and largest √(u² + v²).
fn radii(solution: &Solution) -> [f64; 2] {
    let states = match solution {
        Solution::Equilibrium(x) => x.clone(),
        Solution::Torus(torus) => torus.section(0.0),
        Solution::Cycle(cycle) => cycle.uniform(4000),
    };
    let radius = states.chunks_exact(4).map(|x| x[0].hypot(x[1]));
    radius.fold([f64::MAX, f64::MIN], |[low, high], r| [r.min(low), r.max(high)])
}

#[test]
fn the_cubic_rotor_goes_to_two_equilibria_a_single_or_a_double_loop() {
    let census = survey_of(&ROTOR, &[5.0, 0.0], &rotor_sampling(128, 2));
    assert_eq!((census.unsettled, census.escaped), (0, 0));
    assert_eq!(census.attractors.iter().map(|a| a.hits).sum::<usize>(), 128);
    let of_ratio = |ratio| census.attractors.iter().find(|a| a.ratio == Some(ratio)).unwrap();
    // Closed form of the synchronous response: r² ((a + γ r²)² + (2ζΩ)²) = (m ε Ω²)², the middle root being a saddle.
    let mut rest: Vec<f64> =
        census.attractors.iter().filter(|a| a.ratio.is_none()).map(|a| radii(&a.point.solution)[0]).collect();
    rest.sort_by(f64::total_cmp);
    assert_eq!(rest.len(), 2);
    assert!((rest[0] - 0.38958073).abs() < 1e-8 && (rest[1] - 9.22606067).abs() < 1e-8, "{rest:?}");
    // Single and double loop: period and radii of an independent continuation code, to the digits given there; radii
    // are read off 4000 samples, which miss an extremum by 1e-6 of it.
    let loops = [((2, 1), 2.0147198658, [0.587895, 2.48233521]), ((3, 1), 2.6261014808, [0.904902, 5.121533])];
    for (ratio, period, expected) in loops {
        let found = &of_ratio(ratio).point.solution;
        assert!((found.period().unwrap() - period).abs() < 1e-9, "{ratio:?}: {:?}", found.period());
        let radii = radii(found);
        assert!((radii[0] - expected[0]).abs() < 1e-5 && (radii[1] - expected[1]).abs() < 1e-5, "{ratio:?}: {radii:?}");
    }
    assert_eq!(census.attractors.len(), 4);
}

#[test]
fn every_sample_of_the_contact_rotor_is_counted_where_a_long_integration_ends() {
    let sampling = rotor_sampling(32, 2);
    let census = survey_of(&ROTOR, &[5.0, 1.0], &sampling);
    let single = census.attractors.iter().find(|a| a.ratio == Some((2, 1))).unwrap();
    // Period and radii of an independent continuation code.
    assert!((single.point.solution.period().unwrap() - 1.9910645451).abs() < 1e-9);
    let [low, high] = radii(&single.point.solution);
    assert!((low - 0.530563).abs() < 1e-5 && (high - 1.341756).abs() < 1e-5, "{low} {high}");
    // A small deviation from the attractor has decayed to e^(-ζ 1000) = 5e-5 of itself. Equal accuracy gives the same
    // trajectories, which matters for those that start near a basin boundary.
    let tolerance = Tolerance::uniform(super::census::Pace::THOROUGH.accuracy, 4);
    let starts = sampling.starts();
    let mut largest = vec![0.0; 32];
    Ensemble::new(&ROTOR, &[5.0, 1.0], tolerance, &starts, [0.0, 1000.0]).run(&mut |step| {
        if step.end_time() > 990.0 {
            let r: &mut f64 = &mut largest[step.trajectory()];
            *r = r.max(step.end(0).hypot(step.end(1)));
        }
        Verdict::Continue
    });
    for attractor in &census.attractors {
        let r = radii(&attractor.point.solution)[1];
        // The radii 0.39, 1.34 and 2.45 lie far enough apart for a wide margin; the last to arrive are still 0.1 away.
        let there = largest.iter().filter(|l| (*l - r).abs() < 0.2).count();
        assert_eq!(there, attractor.hits, "{:?} of largest radius {r}, {largest:?}", attractor.ratio);
    }
    assert_eq!((census.unsettled, census.escaped), (0, 0));
}

#[test]
fn a_survey_ends_without_reaching_an_equilibrium_that_clearly_attracts() {
    // The only equilibrium of the contact rotor attracts few samples, and slowly; Newton's method finds it long before.
    let polish = |candidate: &Candidate| shooting::polish(&ROTOR, &[5.0, 1.0], candidate);
    let whole = survey_of(&ROTOR, &[5.0, 1.0], &rotor_sampling(32, 2));
    let mut unseen = 0;
    for seed in 0..5 {
        let sampling = Sampling { seed, ..rotor_sampling(96, 2) };
        let census = survey_until(&ROTOR, &[5.0, 1.0], &sampling, &polish, &|known| {
            let ratios = [None, Some((2, 1)), Some((3, 1))];
            ratios.iter().all(|ratio| known.iter().any(|(_, found)| found == ratio))
        });
        assert_eq!(census.attractors.len(), 3);
        for (found, expected) in census.attractors.iter().zip(&whole.attractors) {
            assert_eq!(found.point.solution.period().is_some(), expected.point.solution.period().is_some());
            let expected = whole.attractors.iter().find(|attractor| attractor.ratio == found.ratio).unwrap();
            // Radii are read off samples that need not begin at the same phase, and miss an extremum by some 1e-6.
            let [a, b] = [found, expected].map(|attractor| radii(&attractor.point.solution));
            assert!((a[0] - b[0]).abs() < 1e-5 && (a[1] - b[1]).abs() < 1e-5, "{a:?} {b:?}");
        }
        let hits: usize = census.attractors.iter().map(|attractor| attractor.hits).sum();
        assert!(hits >= 8 && census.left == 96 - hits, "{hits} {}", census.left);
        let rest = &census.attractors[0];
        let Solution::Equilibrium(x) = &rest.point.solution else { panic!("a cycle without a ratio") };
        if rest.hits == 0 {
            assert_eq!(&rest.example, x);
            unseen += 1;
        }
    }
    assert!(unseen > 0);
}

#[test]
fn the_census_does_not_depend_on_the_number_of_threads() {
    let run = |jobs| {
        let census = survey_of(&ROTOR, &[5.0, 0.0], &rotor_sampling(72, jobs));
        let attractors = census.attractors.into_iter();
        (attractors.map(|a| (a.point.solution, a.ratio, a.hits, a.example)).collect::<Vec<_>>(), census.unsettled)
    };
    let one = run(1);
    assert!(one.0.len() >= 3);
    assert_eq!(one, run(2));
    assert_eq!(one, run(5));
}

#[test]
fn every_start_but_the_origin_leads_to_the_van_der_pol_cycle() {
    // μ = 1: period 6.66328686 and amplitude 2.00861986 (published to these digits).
    let sampling = sampling(&[[-4.0, 4.0], [-4.0, 4.0]], 40, 1);
    let census = survey_of(&VAN_DER_POL, &[1.0], &sampling);
    assert_eq!(census.attractors.len(), 1);
    let found = &census.attractors[0];
    assert_eq!(found.hits, 40);
    assert!((found.point.solution.period().unwrap() - 6.66328686).abs() < 1e-8);
    // 400 samples miss the maximum by (2π/400)² / 8 of it.
    assert!((found.point.ranges[0][1] - 2.00861986).abs() < 1e-4);
    let polish = |candidate: &Candidate| shooting::polish(&VAN_DER_POL, &[1.0], candidate);
    let settled = settle(&VAN_DER_POL, &[1.0], &sampling, &[0.01, 0.0], &polish).unwrap();
    assert!((settled.solution.period().unwrap() - 6.66328686).abs() < 1e-8);
    assert!(settle(&VAN_DER_POL, &[1.0], &sampling, &[0.0, 0.0], &polish).is_err(), "the origin is not stable");
}

#[test]
fn hits_of_two_nodes_follow_the_signs_of_the_initial_states() {
    // x' = x - x³: every positive start goes to 1, every negative one to -1.
    let sampling = sampling(&[[-2.0, 3.0]], 60, 2);
    let census = survey_of(&BISTABLE, &[], &sampling);
    let positive = sampling.starts().iter().filter(|x| **x > 0.0).count();
    assert_eq!((census.attractors.len(), census.unsettled, census.escaped), (2, 0, 0));
    for attractor in census.attractors {
        let Solution::Equilibrium(x) = attractor.point.solution else { panic!("a cycle on a line") };
        assert!((x[0].abs() - 1.0).abs() < 1e-9);
        assert_eq!(attractor.hits, if x[0] > 0.0 { positive } else { 60 - positive });
        // Every fourth start is drawn towards the origin and does not count; the positive part of the box is 3/5.
        let share = attractor.share.unwrap();
        let own = |(k, start): &(usize, &f64)| k % 4 != 3 && (**start > 0.0) == (x[0] > 0.0);
        assert_eq!((share.hits, share.of), (sampling.starts().iter().enumerate().filter(own).count(), 45));
        let [low, high] = share.interval();
        let volume = if x[0] > 0.0 { 0.6 } else { 0.4 };
        assert!(low < volume && volume < high, "{low} {high}");
        assert_eq!(attractor.example[0] > 0.0, x[0] > 0.0);
    }
    let polish = |candidate: &Candidate| shooting::polish(&BISTABLE, &[], candidate);
    let at_rest = settle(&BISTABLE, &[], &sampling, &[1.0], &polish);
    assert!(at_rest.is_ok(), "a start at rest has settled");
}

#[test]
fn escaping_trajectories_are_counted() {
    // x'' + x'/5 + x - x³ = 0: starts beyond the stable manifolds of the saddles escape in finite time.
    let census = survey_of(&ESCAPING, &[], &sampling(&[[-2.0, 2.0], [-2.0, 2.0]], 60, 1));
    assert_eq!(census.attractors.len(), 1);
    assert_eq!(census.unsettled, 0);
    assert_eq!(census.attractors[0].hits + census.escaped, 60);
    assert!(census.escaped > 10 && census.attractors[0].hits > 10);
    assert!(census.attractors[0].example.iter().all(|x| x.abs() < 2.0));
}

#[test]
fn no_trajectory_settles_around_a_centre() {
    // A centre: every orbit is closed, none is isolated.
    let census = survey_of(&CENTRE, &[], &sampling(&[[0.5, 2.0], [0.5, 2.0]], 2, 1));
    assert_eq!((census.attractors.len(), census.unsettled, census.escaped), (0, 2, 0));
}

/// The cycle with z = Σ c_k e^{j k 2π t/T}, T = 3, on a mesh fine enough that interpolation errors are below 1e-9.
fn whirling(lines: &[(i32, f64)]) -> Cycle {
    let scheme = Scheme::new(6);
    let mesh: Vec<f64> = (0..=80).map(|j| (j as f64 / 80.0).powf(1.2)).collect();
    let mut profile = Vec::new();
    for interval in mesh.windows(2) {
        for c in &scheme.nodes {
            let t = interval[0] + c * (interval[1] - interval[0]);
            let z: Complex64 =
                lines.iter().map(|&(k, c)| c * Complex64::from_polar(1.0, std::f64::consts::TAU * k as f64 * t)).sum();
            profile.extend([0.0, z.re, z.im]);
        }
    }
    Cycle {
        points: crate::problem::gauss::Points::Gauss,
        period: 3.0,
        forcing_periods: 0,
        mesh: mesh.into(),
        degree: 6,
        profile,
        gain: Vec::new(),
    }
}

#[test]
fn the_spectrum_is_signed_and_names_the_resonance() {
    let single = whirling(&[(0, 0.3), (-1, 1.1), (-2, -0.8), (1, 0.05), (-3, 0.1)]);
    let spectrum = signed_spectrum(&single, [1, 2], 31);
    assert_eq!(spectrum.len(), 32);
    assert!((spectrum[0].0 + 16.0 / 3.0).abs() < 1e-15);
    for (k, expected) in [(0, 0.3), (-1, 1.1), (-2, -0.8), (1, 0.05), (2, 0.0)] {
        let (frequency, amplitude) = spectrum[(k + 16) as usize];
        assert!((frequency - k as f64 / 3.0).abs() < 1e-15);
        assert!((amplitude - expected).norm() < 1e-8, "line {k}: {amplitude}");
    }
    assert_eq!(spectral_ratio(&single, [1, 2]), Some((2, 1)));
    assert_eq!(spectral_ratio(&whirling(&[(-1, 0.7), (-3, 1.0), (0, 5.0)]), [1, 2]), Some((3, 1)));
    // After a period doubling the same lines are multiples of half the frequency.
    assert_eq!(spectral_ratio(&whirling(&[(-2, 1.0), (-4, 0.8), (-1, 0.1), (-3, 0.2)]), [1, 2]), Some((2, 1)));
    assert_eq!(spectral_ratio(&whirling(&[(-1, 1.0), (1, 0.4)]), [1, 2]), None);
    // A whirl with its harmonics, of the sizes of a whip in journal bearings; and just above the limit.
    assert_eq!(spectral_ratio(&whirling(&[(-1, 14.5), (-2, 0.05)]), [1, 2]), None);
    assert_eq!(spectral_ratio(&whirling(&[(-1, 1.0), (-2, 0.098)]), [1, 2]), None);
    assert_eq!(spectral_ratio(&whirling(&[(-1, 1.0), (-2, 0.102)]), [1, 2]), Some((2, 1)));
    assert_eq!(whirl_sense(&whirling(&[(0, 5.0), (-1, 1.0), (1, 0.4), (2, 0.8)]), [1, 2]), Some(Sense::Backward));
    assert_eq!(whirl_sense(&whirling(&[(-1, 0.3), (1, 0.4), (-2, 0.1)]), [1, 2]), Some(Sense::Forward));
    assert_eq!(whirl_sense(&whirling(&[(-1, 0.4), (1, 0.4)]), [1, 2]), None, "a straight line");
    assert_eq!(spectral_ratio(&single, [1, 7]), None);
}
