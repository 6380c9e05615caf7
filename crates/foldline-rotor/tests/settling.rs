//! Simulation that knows of no branches, on the rotor.

use foldline::attractors::{Sampling, Trial, stepped_sweep, survey_by_simulation};
use foldline::contract::{VectorField, Verdict};
use foldline::diagram::{Motion, Response};
use foldline_rotor::{ContactLaw, Nondimensional, OverhungRotor};

const SCALES: [f64; 4] = [1.0; 4];
const OMEGA: usize = 0;

fn trial(field: &dyn VectorField) -> Trial<'_> {
    Trial { field, scales: &SCALES, whirl: Some([0, 1]), jobs: 2 }
}

fn sampling(samples: usize) -> Sampling {
    let ranges = vec![[-5.0, 5.0], [-5.0, 5.0], [-15.0, 15.0], [-15.0, 15.0]];
    Sampling { ranges, scales: SCALES.to_vec(), whirl: Some([0, 1]), samples, seed: 1, jobs: 2, tolerance: 1e-6 }
}

fn reference(kappa: f64) -> Vec<f64> {
    Nondimensional { kappa, ..Nondimensional::REFERENCE }.parameters().to_vec()
}

fn of_ratio(found: &[Response], ratio: (u32, u32)) -> &Response {
    found.iter().find(|r| r.ratio == Some(ratio)).unwrap_or_else(|| panic!("no {ratio:?}"))
}

fn shown(found: &[Response]) {
    for r in found {
        eprintln!(
            "{:.4} {:?} {:?} x{} T {:?} r {:?} hits {} after {:.0} error {:.1e}",
            r.value,
            r.motion,
            r.ratio,
            r.multiplicity,
            r.period,
            r.ranges.get(4),
            r.hits,
            r.settled_after,
            r.error
        );
    }
}

#[test]
fn settled_motions_agree_with_an_independent_continuation_code() {
    let field = OverhungRotor::default();
    // Period, smallest and largest radius at Ω = 5.
    let cubic = [((2, 1), 2.0147198658, [0.587895, 2.48233521]), ((3, 1), 2.6261014808, [0.904902, 5.121533])];
    let contact = [((2, 1), 1.9910645451, [0.530563, 1.341756])];
    for (kappa, expected) in [(0.0, &cubic[..]), (1.0, &contact[..])] {
        let begun = std::time::Instant::now();
        let found = survey_by_simulation(&trial(&field), &sampling(64), &reference(kappa), OMEGA, &[5.0], &|_| {
            Verdict::Continue
        });
        eprintln!("{:?}", begun.elapsed());
        shown(&found);
        assert_eq!(found.iter().map(|r| r.hits).sum::<usize>(), 64);
        for (ratio, period, [low, high]) in expected {
            let r = of_ratio(&found, *ratio);
            let errors = [r.period.unwrap() - period, r.ranges[4][0] - low, r.ranges[4][1] - high];
            eprintln!("{errors:?}");
        }
    }
}

#[test]
fn many_speeds() {
    let law = ContactLaw::Tanh;
    let field = OverhungRotor { law };
    let values: Vec<f64> = (0..12).map(|k| 3.0 + k as f64 / 3.0).collect();
    let begun = std::time::Instant::now();
    let found =
        survey_by_simulation(&trial(&field), &sampling(16), &reference(1.0), OMEGA, &values, &|_| Verdict::Continue);
    eprintln!("{:?}", begun.elapsed());
    shown(&found);
}

#[test]
fn debug_one() {
    let field = OverhungRotor::default();
    let found =
        survey_by_simulation(&trial(&field), &sampling(4), &reference(0.0), OMEGA, &[5.0], &|_| Verdict::Continue);
    shown(&found);
}
