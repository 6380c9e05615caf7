//! Censuses with known answers.

use super::*;
use crate::contract::{Batch, Parameters, VectorField, Verdict};
use crate::diagram::{Cost, Cycle, Solution, Trust};
use crate::problem::gauss::Scheme;
use crate::simulation::{Integrator, Tolerance};
use num_complex::Complex64;

mod fields;
mod shooting;

use fields::{Field, ROTOR, VAN_DER_POL};

/// Reference constants and initial box of the overhung rotor; κ = 0 is cubic, 1 contact.
fn rotor_sampling(samples: usize, jobs: usize) -> Sampling {
    Sampling {
        ranges: vec![[-6.0, 6.0], [-6.0, 6.0], [-15.0, 15.0], [-15.0, 15.0]],
        scales: vec![1.0; 4],
        whirl: Some([0, 1]),
        samples,
        seed: 1,
        jobs,
        tolerance: 1e-6,
    }
}

fn survey_of(field: &Field, parameters: &[f64], sampling: &Sampling) -> Census {
    let t=std::time::Instant::now();
    let polishing = std::sync::Mutex::new((0,0,0.0));
    let r=survey(field, parameters, sampling, &|candidate| {
    let t=std::time::Instant::now();
    let r=shooting::polish(field, parameters, candidate);
    let mut c=polishing.lock().unwrap();
    c.0+=1;
    c.1+=r.is_some() as usize;
    c.2+=t.elapsed().as_secs_f64();
    r});
    println!("{:?} of {}",polishing.lock().unwrap(), t.elapsed().as_secs_f64());
    for a in &r.attractors {
        println!("{:?} {:?} {:?} {} {:?}", a.point.solution.period(), a.ratio, a.point.ranges, a.hits, a.example);
    }
    println!("unsettled {} escaped {}", r.unsettled, r.escaped);
    r
}

#[test]
fn the_cubic_rotor_has_one_equilibrium_a_single_and_a_double_loop_in_reach() {
    let census = survey_of(&ROTOR, &[5.0, 0.0], &rotor_sampling(128, 1));
    panic!();
}
#[test]
fn contact() {
    let census = survey_of(&ROTOR, &[5.0, 1.0], &rotor_sampling(128, 1));
    panic!();
}
