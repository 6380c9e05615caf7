//! Times of the parts of the linear algebra in a Newton iteration, on a system of the shape of the rotor's.

use crate::report::{Table, digits, time};
use crate::workplace::Workplace;
use crate::{Outcome, clock};
use foldline::linalg::condensed::Condensed;
use foldline::linalg::lane::{Eight, Lane as _};
use std::hint::black_box;

const STATES: usize = 4;
const DEGREE: usize = 4;
const SCALARS: usize = 2;
const INTERVALS: usize = 100;

/// Pattern of the Jacobian: two positions with their velocities, and accelerations that depend on all states.
const COUPLED: [u8; STATES * STATES] = [0, 0, 1, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1];

/// Measures the parts.
pub fn timed(_place: &Workplace) -> Outcome<String> {
    let (mut system, rhs) = filled();
    let (interior, coupling) = (system.interior.clone(), system.coupling.clone());
    let copy = clock::best(|| {
        system.interior.copy_from_slice(&interior);
        system.coupling.copy_from_slice(&coupling);
    });
    let condensed = clock::best(|| {
        system.interior.copy_from_slice(&interior);
        system.coupling.copy_from_slice(&coupling);
        let _ = black_box(system.condense());
    }) - copy;
    let eliminated = clock::best(|| {
        let _ = black_box(system.eliminate(1.0));
    });
    let mut x = vec![0.0; rhs.len()];
    let solved = clock::best(|| system.solve(&rhs, black_box(&mut x)));
    let places = (system.length() * Eight::COUNT) as f64;
    let (inner, width) = ((STATES * DEGREE) as f64, (STATES + SCALARS) as f64);
    let dense = places * (2.0 / 3.0 * inner.powi(3) + 2.0 * inner * inner * width + 2.0 * inner * width);
    let needed = places * operations_of_a_block();
    let [separate, fused] = [peak::<false>(), peak::<true>()];
    let mut table = Table::new(&["", "time", "operations", "rate", "of the peak"]);
    let share = |rate: f64| format!("{} %", digits(100.0 * rate / separate));
    let counted = |operations: f64, seconds: f64| {
        let rate = operations / seconds;
        [digits(1e-6 * operations) + " M", digits(1e-9 * rate) + " G/s", share(rate)]
    };
    for (name, seconds, operations) in
        [("condensation, what is not zero", condensed, needed), ("the same, as if nothing were zero", condensed, dense)]
    {
        let [operations, rate, share] = counted(operations, seconds);
        table.row(&[name.into(), time(seconds), operations, rate, share]);
    }
    let empty = String::new;
    table.row(&["elimination of the interval ends".into(), time(eliminated), empty(), empty(), empty()]);
    table.row(&["solution".into(), time(solved), empty(), empty(), empty()]);
    Ok(format!(
        "{STATES} states, degree {DEGREE}, {INTERVALS} intervals in {} places of eight lanes; sums and products in double \
         precision are counted. Vectors in twelve chains that do not wait for each other make {} G/s, the peak meant here; with fused multiply-add, which is not used, {} G/s.\n\n{}\n",
        system.length(),
        digits(1e-9 * separate),
        digits(1e-9 * fused),
        table.text()
    ))
}

/// Returns the number of additions and multiplications for one block. The diagonal blocks of the two positions are
/// identities.
fn operations_of_a_block() -> f64 {
    let (m, scalars) = (DEGREE as f64, SCALARS as f64);
    // Elimination of each position from both velocities, with the columns of its velocity, its left end and the
    // scalars; then the dense remainder.
    let positions = 2.0 * 2.0 * m * m * (m + 1.0 + scalars) * 2.0;
    let rest = 2.0 * m;
    let right = STATES as f64 + scalars;
    let velocities = 2.0 / 3.0 * rest.powi(3) + 2.0 * rest * rest * right;
    let back = 2.0 * m * m * right * 2.0;
    positions + velocities + back
}

const ROUNDS: usize = 2000;
/// Number of chains; with their operands they fit into sixteen registers.
const CHAINS: usize = 12;

/// Returns the peak rate of multiplications and additions per second, in independent chains.
fn peak<const FUSED: bool>() -> f64 {
    let arch = pulp::Arch::new();
    let lanes = arch.dispatch(Peak::<false>(0)).1;
    let seconds = clock::best(|| {
        black_box(arch.dispatch(Peak::<FUSED>(ROUNDS)));
    });
    (2 * ROUNDS * CHAINS * lanes) as f64 / seconds
}

/// Loop with the given number of rounds. Returns a sum, so that the compiler cannot remove the loop, and the number of
/// lanes of a vector.
struct Peak<const FUSED: bool>(usize);

impl<const FUSED: bool> pulp::WithSimd for Peak<FUSED> {
    type Output = (f64, usize);

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) -> (f64, usize) {
        let (x, y) = (simd.splat_f64s(black_box(0.999)), simd.splat_f64s(black_box(0.001)));
        let mut sums = [simd.splat_f64s(1.0); CHAINS];
        for _ in 0..self.0 {
            for sum in &mut sums {
                *sum = if FUSED { simd.mul_add_f64s(*sum, x, y) } else { simd.add_f64s(simd.mul_f64s(*sum, x), y) };
            }
        }
        (sums.into_iter().map(|sum| simd.reduce_sum_f64s(sum)).sum(), S::F64_LANES)
    }
}

/// Returns a system like that of collocation in Runge–Kutta form: the identity plus small entries.
fn filled() -> (Condensed<Eight>, Vec<f64>) {
    let mut system = Condensed::<Eight>::new(STATES, &[1.0, 0.2, 0.3, 0.3, 0.2], SCALARS);
    system.couple(&COUPLED.map(|x| x == 1));
    system.resize(INTERVALS);
    let mut component = [0; STATES * DEGREE];
    (0..component.len()).for_each(|k| component[system.slot(k / STATES, k % STATES)] = k % STATES);
    let mut seed = 0.3f64;
    let mut next = || {
        seed = (seed * 97.13 + 0.711).fract();
        0.1 * (seed - 0.5)
    };
    let (inner, width) = (STATES * DEGREE, STATES + SCALARS);
    for (k, entry) in system.interior.iter_mut().enumerate() {
        let place = k % (inner * inner);
        let unit = f64::from(u8::from(place / inner == place % inner));
        let coupled = f64::from(COUPLED[component[place / inner] * STATES + component[place % inner]]);
        entry.lanes_mut().iter_mut().for_each(|x| *x = unit + coupled * next());
    }
    for (k, entry) in system.coupling.iter_mut().enumerate() {
        let place = k % (inner * width);
        let (c, d) = (component[place / width], place % width);
        let scalar = f64::from(u8::from(d >= STATES));
        let unit = f64::from(u8::from(c == d));
        entry.lanes_mut().iter_mut().for_each(|x| *x = scalar * next() - unit);
    }
    system.border.iter_mut().for_each(|entry| entry.lanes_mut().iter_mut().for_each(|x| *x = next()));
    system.corner.iter_mut().for_each(|x| *x = 1.0 + next());
    let rhs = (0..INTERVALS * (inner + STATES) + SCALARS).map(|_| next()).collect();
    (system, rhs)
}
