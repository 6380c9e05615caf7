//! Starts: two lines that nearly satisfy the balance.
//!
//! **Idea.** With two lines given, the local forces and their harmonics follow from one evaluation over a period, and the
//! misfit is a function of the frequency alone, known from a table of flexibilities. A grid of amplitudes, phases and
//! directions is therefore cheap.
//!
//! **Equations.** With the lines e_k at the orders k = p, q and the harmonics g_k of the forces on them,
//!
//!   (1)  misfit = min_w max_k |e_k - σ H(ikw) g_k| / |e_k|
//!
//! The local forces are also taken at shares σ of their size ([`SHARES`]), from which they then grow to the whole: the
//! softer the ring, the closer the motion is to two lines, and the more starts converge. For each share a pair of
//! amplitudes and directions contributes the phase with the smallest misfit, if it is below [`GOOD`].
//!
//! **Fails when** the motion is carried by harmonics of the two lines rather than by themselves.

use super::balance::{Balance, harmonics};
use super::local::Local;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Largest misfit of a start.
const GOOD: f64 = 1.0;
/// Shares of the local forces with which starts are sought, softest first: a ring 25 times as stiff as the shaft needs a tenth.
const SHARES: [f64; 4] = [0.03, 0.1, 0.3, 1.0];
/// Number of starts for each share, those with the smallest misfit.
const STARTS: usize = 16;
/// Nodes over a period.
const NODES: usize = 64;
const PHASES: usize = 12;
/// Amplitudes in powers of √2 of the sizes, and the largest ratio of two, as such a power.
const POWERS: [i32; 2] = [-5, 7];
const APART: i32 = 6;
/// Frequencies of the table.
const FREQUENCIES: usize = 240;
/// Modes whose shapes give directions, and the largest number of directions.
const MODES: usize = 8;
const DIRECTIONS: usize = 4;
/// Ratio of decay to frequency up to which a mode counts as an oscillation.
const LIGHT: f64 = 0.3;
/// Harmonics of a start for each order of the higher line, and their least number.
const HARMONICS: usize = 4;
const LEAST: usize = 8;

/// Starts for the orders `orders`, smaller one first, the smallest misfit first.
pub(super) fn starts(local: &Local, orders: [usize; 2]) -> Vec<Balance> {
    let mut light: Vec<usize> = (0..local.modes.list.len())
        .filter(|k| {
            let rate = local.modes.list[*k].rate;
            rate.im != 0.0 && rate.re.abs() <= LIGHT * rate.im.abs()
        })
        .collect();
    let rate = |mode: usize| local.modes.list[mode].rate.im.abs();
    light.sort_by(|a, b| rate(*a).total_cmp(&rate(*b)));
    light.truncate(MODES);
    let [Some(first), Some(last)] = [light.first(), light.last()] else { return Vec::new() };
    let ends = [0.2 * rate(*first) / orders[1] as f64, 1.5 * rate(*last) / orders[0] as f64];
    let table = Table::new(local, orders, ends);
    let directions = directions(local, &light);
    let mut rated: [Vec<(f64, Start)>; SHARES.len()] = Default::default();
    let pairs = directions.iter().flat_map(|a| directions.iter().map(move |b| [a, b]));
    for (pair, (i, j)) in pairs.flat_map(|pair| sizes().map(move |sizes| (pair, sizes))) {
        let found = table.best(local, pair, [i, j].map(|power| 0.5f64.powf(-0.5 * f64::from(power))));
        rated.iter_mut().zip(found).for_each(|(list, own)| list.extend(own));
    }
    let harmonics = LEAST.max(HARMONICS * orders[1]);
    let start = |(share, start): (&f64, Start)| {
        Balance::of_lines(local, harmonics, orders, &start.lines, start.w).with_share(*share)
    };
    let sorted = rated.into_iter().zip(&SHARES).flat_map(|(mut list, share)| {
        list.sort_by(|a, b| a.0.total_cmp(&b.0));
        list.truncate(STARTS);
        list.into_iter().map(move |(_, own)| (share, own))
    });
    sorted.map(start).collect()
}

fn sizes() -> impl Iterator<Item = (i32, i32)> {
    let [low, high] = POWERS;
    (low..=high).flat_map(move |i| (low..=high).map(move |j| (i, j))).filter(|(i, j)| (i - j).abs() <= APART)
}

struct Start {
    lines: [Vec<Complex64>; 2],
    w: f64,
}

/// Different directions of the modes at the coordinates, each of size 1 in its largest coordinate.
fn directions(local: &Local, light: &[usize]) -> Vec<Vec<Complex64>> {
    const ALIKE: f64 = 0.95;
    let mut out: Vec<Vec<Complex64>> = Vec::new();
    for mode in light {
        let shape: Vec<Complex64> = local.shape(*mode).iter().enumerate().map(|(c, z)| z / local.size(c)).collect();
        let most = shape.iter().map(|z| z.norm()).fold(0.0, f64::max);
        let own: Vec<Complex64> = shape.iter().map(|z| z / most).collect();
        let product = |a: &[Complex64], b: &[Complex64]| a.iter().zip(b).map(|(a, b)| a.conj() * b).sum::<Complex64>();
        let alike = |other: &Vec<Complex64>| {
            product(other, &own).norm_sqr() > ALIKE * (product(other, other) * product(&own, &own)).norm()
        };
        if most > 0.0 && most.is_finite() && !out.iter().any(alike) {
            out.push(own);
        }
    }
    out.truncate(DIRECTIONS);
    for own in &mut out {
        own.iter_mut().enumerate().for_each(|(c, z)| *z *= local.size(c));
    }
    out
}

/// Flexibilities at both orders over w.
struct Table {
    orders: [usize; 2],
    w: Vec<f64>,
    /// `[order][w][s × r]`.
    h: [Vec<Vec<Complex64>>; 2],
}

impl Table {
    fn new(local: &Local, orders: [usize; 2], [low, high]: [f64; 2]) -> Table {
        let w: Vec<f64> =
            (0..FREQUENCIES).map(|k| low * (high / low).powf(k as f64 / (FREQUENCIES - 1) as f64)).collect();
        let of = |order: usize| {
            let at = |w: &f64| local.flexibility(Complex64::i() * (order as f64 * w)).iter().map(|h| h[0]).collect();
            w.iter().map(at).collect()
        };
        Table { orders, h: orders.map(of), w }
    }

    /// The best phase and frequency for two directions and their amplitudes, for each share.
    fn best(
        &self,
        local: &Local,
        directions: [&Vec<Complex64>; 2],
        amplitudes: [f64; 2],
    ) -> [Option<(f64, Start)>; SHARES.len()] {
        let (s, r, lanes) = (local.coordinates(), local.forces(), NODES * PHASES);
        let lines = |phase: usize| -> [Vec<Complex64>; 2] {
            let turns = [
                Complex64::new(amplitudes[0], 0.0),
                Complex64::from_polar(amplitudes[1], TAU * phase as f64 / PHASES as f64),
            ];
            std::array::from_fn(|l| directions[l].iter().map(|z| z * turns[l]).collect())
        };
        let mut e = vec![0.0; s * lanes];
        for phase in 0..PHASES {
            let lines = lines(phase);
            for node in 0..NODES {
                let carriers = self.orders.map(|k| Complex64::cis(TAU * (k * node) as f64 / NODES as f64));
                for c in 0..s {
                    e[c * lanes + phase * NODES + node] = (lines[0][c] * carriers[0] + lines[1][c] * carriers[1]).re;
                }
            }
        }
        let g = local.force(&e, lanes);
        let mut best: [Option<(f64, usize, usize)>; SHARES.len()] = Default::default();
        for phase in 0..PHASES {
            let lines = lines(phase);
            let own = |f: usize| &g[f * lanes + phase * NODES..][..NODES];
            let forces: Vec<[Complex64; 2]> = (0..r)
                .map(|f| {
                    let all = harmonics(own(f), self.orders[1]);
                    self.orders.map(|k| all[k])
                })
                .collect();
            if !forces.iter().flatten().all(|g| g.is_finite()) || forces.iter().flatten().all(|g| g.norm() == 0.0) {
                continue;
            }
            for at in 0..self.w.len() {
                let answers = [0, 1].map(|l| self.answer(local, l, at, &forces));
                for (best, share) in best.iter_mut().zip(SHARES) {
                    let off = |l: usize| misfit(local, &lines[l], &answers[l], share);
                    let own = off(0).max(off(1));
                    if own < best.map_or(GOOD, |known| known.0) {
                        *best = Some((own, phase, at));
                    }
                }
            }
        }
        best.map(|own| own.map(|(misfit, phase, at)| (misfit, Start { lines: lines(phase), w: self.w[at] })))
    }

    /// H g at one of the orders.
    fn answer(&self, local: &Local, l: usize, at: usize, forces: &[[Complex64; 2]]) -> Vec<Complex64> {
        let (h, r) = (&self.h[l][at], forces.len());
        (0..local.coordinates()).map(|c| (0..r).map(|f| h[c * r + f] * forces[f][l]).sum()).collect()
    }
}

/// Relative misfit of a line, in units of the sizes.
fn misfit(local: &Local, line: &[Complex64], answer: &[Complex64], share: f64) -> f64 {
    let (mut off, mut size) = (0.0, 0.0);
    for (c, (own, answer)) in line.iter().zip(answer).enumerate() {
        let unit = local.size(c);
        off += (own - share * answer).norm_sqr() / (unit * unit);
        size += own.norm_sqr() / (unit * unit);
    }
    (off / size).sqrt()
}
