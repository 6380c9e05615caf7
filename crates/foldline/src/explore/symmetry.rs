//! Detection of continuous symmetries and conserved energies, which make solutions form families.
//!
//! **Idea.** A matrix A with f_x(x) A x = A f(x) for all x generates a symmetry, exp(sA), that maps solutions to
//! solutions. Solutions that it moves are not isolated, and Newton's method does not converge to them. The condition is
//! linear in A and is imposed at a few points of the sampling box. An undamped mechanical system whose forces have a
//! potential conserves its energy, so its cycles form a family too.
//!
//! **Equations.** At points x of the box, and at times τ if the field is forced:
//!
//! ```text
//!   (1)  Σ_jk (f_x)_ij A_jk x_k - Σ_k A_ik f_k = 0   for every i
//!   (2)  x_i' = v_i,  v_i' = g_i(x),  m_i ∂g_i/∂x_k = m_k ∂g_k/∂x_i
//! ```
//!
//! **Fails when** a symmetry is not linear, or the energy is not of the form (2); it then goes undetected.

use super::System;
use crate::contract::{Batch, Parameters};
use crate::diagram::{Point, Solution};
use crate::linalg::max_abs;
use crate::model::null_space;

/// Largest number of states n for which symmetries are searched for. (1) has n² unknowns, so elimination costs n⁶
/// operations: a million for ten.
const MOST: usize = 10;
/// Difference of derivatives, relative to the largest, that counts as rounding: a factor of safety of a million over
/// the machine precision, for derivatives that are sums of large terms.
const ROUNDING: f64 = 1e-10;

/// Values of the field at one point of the box.
struct Place {
    state: Vec<f64>,
    f: Vec<f64>,
    /// `[n][n]`.
    fx: Vec<f64>,
}

/// The pairs of states whose simultaneous rotation leaves the equations unchanged, if any.
pub(super) fn rotation(system: &System, parameters: &[f64]) -> Option<Vec<[usize; 2]>> {
    let n = system.field.dim();
    if !(2..=MOST).contains(&n) {
        return None;
    }
    let places = places(system, parameters, 2 * n + 4);
    let row = |place: &Place, i: usize| -> Vec<f64> {
        let mut row = vec![0.0; n * n];
        for j in 0..n {
            (0..n).for_each(|k| row[j * n + k] += place.fx[i * n + j] * place.state[k]);
            row[i * n + j] -= place.f[j];
        }
        row
    };
    let rows: Vec<Vec<f64>> = places.iter().flat_map(|place| (0..n).map(move |i| row(place, i))).collect();
    // Too few equations determine nothing.
    if rows.len() < n * n + n {
        return None;
    }
    null_space(rows.concat(), n * n).iter().find_map(|generator| rotated_pairs(generator, n))
}

/// True if a cycle is a rotating wave: it consists of the images of one of its states under rotation of these pairs.
/// Rotation then moves states along the cycle, not to other cycles.
pub(super) fn is_rotating_wave(system: &System, pairs: &[[usize; 2]], at: &Point) -> bool {
    /// Share of f that may have another direction: above the error of a profile.
    const ASIDE: f64 = 1e-3;
    let Solution::Cycle(cycle) = &at.solution else { return false };
    let (n, parameters) = (cycle.dim(), Parameters::Shared(&at.parameters));
    if cycle.forcing_periods > 0 || n != system.field.dim() || cycle.profile.is_empty() {
        return false;
    }
    // Sums of f², f·Jx and (Jx)², J x being the direction of rotation.
    let mut sums = [0.0; 3];
    for x in cycle.profile.chunks_exact(n) {
        let (mut f, mut turned) = (vec![0.0; n], vec![0.0; n]);
        system.field.evaluate(Batch { lanes: 1, states: x, parameters, times: &[], signs: &[] }, &mut f);
        pairs.iter().for_each(|&[i, j]| (turned[i], turned[j]) = (-x[j], x[i]));
        for ((f, t), scale) in f.iter().zip(&turned).zip(&system.scales) {
            let (f, t) = (f / scale, t / scale);
            sums = [sums[0] + f * f, sums[1] + f * t, sums[2] + t * t];
        }
    }
    sums[0] * sums[2] - sums[1] * sums[1] < ASIDE * ASIDE * sums[0] * sums[2]
}

/// The pairs of states that a generator rotates, all in the same sense; `None` if it is not a rotation.
fn rotated_pairs(generator: &[f64], n: usize) -> Option<Vec<[usize; 2]>> {
    let size = max_abs(generator);
    let entry = |i: usize, j: usize| generator[i * n + j] / size;
    let mut pairs = Vec::new();
    for i in 0..n {
        let mut partners = (0..n).filter(|&j| entry(i, j).abs() > 1e-6);
        let Some(j) = partners.next() else { continue };
        let opposite = (entry(i, j) + entry(j, i)).abs() < 1e-6;
        if j == i || partners.next().is_some() || !opposite {
            return None;
        }
        if i < j {
            pairs.push(([i, j], entry(i, j)));
        }
    }
    let sense = pairs.first().map_or(1.0, |(_, sense)| *sense);
    let pairs: Vec<[usize; 2]> =
        pairs.into_iter().map(|([i, j], own)| if own * sense > 0.0 { [i, j] } else { [j, i] }).collect();
    (!pairs.is_empty()).then_some(pairs)
}

/// True if the system has the form (2) and hence conserves an energy.
pub(super) fn keeps_energy(system: &System, parameters: &[f64]) -> bool {
    let n = system.field.dim();
    if n < 2 || !n.is_multiple_of(2) || system.field.forced() {
        return false;
    }
    let places = places(system, parameters, 2 * n + 4);
    if places.len() < n {
        return false;
    }
    let Some(pairs) = pairs(&places, n) else { return false };
    let slope = |place: &Place, of: usize, by: usize| place.fx[of * n + by] * system.scales[by] / system.scales[of];
    let entries = |place: &Place| (0..n * n).fold(0.0, |most: f64, k| most.max(slope(place, k / n, k % n).abs()));
    let size = places.iter().fold(0.0, |most: f64, place| most.max(entries(place)));
    let undamped = |place: &Place, v: usize, w: usize| slope(place, v, w).abs() <= ROUNDING * size;
    // The ratio of two masses is taken from the first point.
    let potential = |place: &Place, [x, v]: [usize; 2], [y, w]: [usize; 2]| {
        let [here, there] = [slope(place, v, y), slope(place, w, x)];
        let [first, second] = [slope(&places[0], v, y), slope(&places[0], w, x)];
        (here * second - there * first).abs() <= ROUNDING * size * size
            && (first == 0.0) == (second == 0.0)
            && first * second >= 0.0
    };
    let each = |place: &Place, a: [usize; 2], b: [usize; 2]| undamped(place, a[1], b[1]) && potential(place, a, b);
    places.iter().all(|place| pairs.iter().all(|a| pairs.iter().all(|b| each(place, *a, *b))))
}

/// Pairs of coordinate and velocity; `None` unless every state belongs to one.
fn pairs(places: &[Place], n: usize) -> Option<Vec<[usize; 2]>> {
    let is_unit =
        |i: usize, j: usize, place: &Place| (0..n).all(|k| place.fx[i * n + k] == f64::from(u8::from(k == j)));
    let velocity = |i: usize| (0..n).find(|&j| places.iter().all(|place| is_unit(i, j, place)));
    let pairs: Vec<[usize; 2]> = (0..n).filter_map(|i| Some([i, velocity(i)?])).collect();
    let mut all: Vec<usize> = pairs.iter().flatten().copied().collect();
    all.sort_unstable();
    (all == (0..n).collect::<Vec<_>>()).then_some(pairs)
}

/// Values of the field at points of the box, without those at which it is not finite.
fn places(system: &System, parameters: &[f64], count: usize) -> Vec<Place> {
    /// The golden ratio minus 1: its multiples modulo 1 spread evenly.
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let n = system.field.dim();
    let at = |place: usize| {
        let share = |i: usize| (GOLDEN * (place * (i + 2)) as f64 + 0.17 * (i * i) as f64).fract();
        let state: Vec<f64> = system.ranges.iter().enumerate().map(|(i, [a, b])| a + share(i) * (b - a)).collect();
        let times = if system.field.forced() { vec![share(n)] } else { Vec::new() };
        let (mut f, mut fx) = (vec![0.0; n], vec![0.0; n * n]);
        let batch =
            Batch { lanes: 1, states: &state, parameters: Parameters::Shared(parameters), times: &times, signs: &[] };
        system.field.linearise(batch, &[], &mut f, &mut fx, &mut []);
        let finite = f.iter().chain(&fx).all(|value| value.is_finite());
        finite.then_some(Place { state, f, fx })
    };
    (1..=count).filter_map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Definition, Model, ModelSource, Parameter, State};

    fn model(equations: &[(&str, &str)]) -> Model {
        Model::compile(ModelSource {
            parameters: vec![Parameter::new("c", 0.0)],
            states: equations.iter().map(|(name, _)| State::new(name)).collect(),
            equations: equations.iter().map(|(name, text)| Definition::new(name, text)).collect(),
            ..ModelSource::default()
        })
        .unwrap()
    }

    #[test]
    fn a_spherical_oscillator_can_be_turned_and_an_anisotropic_one_cannot() {
        let told = |stiffness: &str| {
            let force = |own: &str, k: &str| format!("-0.1*v{own} - ({k} + x^2 + y^2)*{own}");
            let [fx, fy] = [force("x", "1"), force("y", stiffness)];
            let model = model(&[("x", "vx"), ("y", "vy"), ("vx", &fx), ("vy", &fy)]);
            rotation(&System::of(&model, &[0.0]), &[0.0])
        };
        assert_eq!(told("1"), Some(vec![[0, 1], [2, 3]]));
        assert_eq!(told("1.01"), None);
    }

    #[test]
    fn two_masses_on_springs_keep_their_energy_until_they_are_damped() {
        // Masses 1 and 2: the matrix of stiffness over masses is not symmetric.
        let springs = [("x", "v"), ("y", "w"), ("v", "-2*x + y - 0.5*x^3 + c*v"), ("w", "-2*y + x/2 + c*w")];
        let masses = [("x", "v"), ("y", "w"), ("v", "-2*x + y - 0.5*x^3"), ("w", "-2*y + x/2")];
        let follower = [("x", "v"), ("y", "w"), ("v", "-2*x + y*x"), ("w", "-2*y + x")];
        let keeps = |equations: &[(&str, &str)], c: f64| {
            let model = model(equations);
            keeps_energy(&System::of(&model, &[c]), &[c])
        };
        assert!(keeps(&springs, 0.0) && keeps(&masses, 0.0));
        assert!(!keeps(&springs, 0.1) && !keeps(&follower, 0.0));
        assert!(!keeps(&[("x", "v"), ("v", "-x"), ("z", "-z"), ("u", "z")], 0.0));
    }
}
