//! Search for the discrete symmetries of a field.
//!
//! **Idea.** A permutation of the states with changes of sign, R, is a symmetry if f(R x) = R f(x). It is verified at a
//! few points in general position. What is worth verifying is found by assigning the images of the states one after the
//! other. At a point that R leaves in place, values and first derivatives must agree among the states that have an image
//! already: at 0 for every R, at c (1, …, 1) for permutations without changes of sign.
//!
//! Solutions that differ in signs only are one. Solutions that differ in the order of their states are listed separately, because
//! whoever looks at one of the states sees different motions; that a branch is its own image under an exchange still tells
//! a pitchfork from a fold.
//!
//! **Equations.** For a forced field with R x(t + δ), δ = 0 or half a period, as the image of x(t):
//!
//! ```text
//!   (1)  f(R x, t + δ) = R f(x, t)
//!   (2)  x = R x:  f_i(x, t + δ) = ±f_σ(i)(x, t),  ∂f_i/∂x_k (x, t + δ) = ±± ∂f_σ(i)/∂x_σ(k) (x, t)
//! ```
//!
//! **Fails when** a model has more symmetries than [`MOST`], or so many candidates for which (2) holds that the search is
//! cut short; some symmetries then remain unknown.

use super::System;
use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::Symmetry;
use crate::linalg::max_abs;

/// Largest number of states whose signs are all tried separately; of more, either no sign or every sign changes.
const SIGNS: usize = 10;
/// Largest number of states for which permutations are tried.
const STATES: usize = 64;
/// Largest number of symmetries that are used.
const MOST: usize = 128;
/// Number of images tried before a search is cut short.
const TRIALS: usize = 100_000;
/// Difference relative to the values that counts as rounding.
const ROUNDING: f64 = 1e-10;

/// Values and derivatives at a point that stays in place.
struct Still {
    f: Vec<f64>,
    /// `[n][n]`.
    fx: Vec<f64>,
}

/// A system at parameter values, with the points at which (1) is tested.
struct Test<'a, 's> {
    system: &'a System<'s>,
    parameters: &'a [f64],
    points: Vec<Vec<f64>>,
}

impl System<'_> {
    /// True if a forced field has one of [`System::symmetries`] at the same time, or half a forcing period later if
    /// `half`.
    pub fn mirrors_after(&self, symmetry: &Symmetry, half: bool) -> bool {
        let place = self.symmetries.iter().position(|own| own == symmetry);
        place.and_then(|place| self.mirrors.get(place)).is_some_and(|mirrors| mirrors[usize::from(half)])
    }

    /// Finds the symmetries of the field at the parameter values `parameters`; see the module.
    pub fn find_symmetries(&mut self, parameters: &[f64]) {
        let n = self.field.dim();
        (self.symmetries, self.mirrors) = (vec![Symmetry::identity()], vec![[true, false]]);
        self.exchanges = Vec::new();
        // Events need not be symmetric.
        if self.field.event_count() > 0 || n == 0 {
            return;
        }
        let component = |k: usize, i: usize| ((3 * k + 1) as f64 * 0.71 + (i * i + 1) as f64 * 1.37).sin();
        let points = (0..5).map(|k| (0..n).map(|i| self.scales[i] * component(k, i)).collect()).collect();
        let test = Test { system: self, parameters, points };
        let mut found: Vec<(Symmetry, [bool; 2])> = Vec::new();
        let later = self.field.forced() && !self.field.iterated() && !self.is_open();
        for half in [false, true].into_iter().take(if later { 2 } else { 1 }) {
            for symmetry in test.all(if half { 0.5 } else { 0.0 }) {
                match found.iter_mut().find(|(own, _)| *own == symmetry) {
                    Some((_, mirrors)) => mirrors[usize::from(half)] = true,
                    None if symmetry.is_identity() => {}
                    None => found.push((symmetry, [!half, half])),
                }
            }
        }
        let (exchanges, reflections): (Vec<_>, Vec<_>) =
            found.into_iter().take(MOST).partition(|(symmetry, _)| symmetry.permutes());
        self.exchanges = exchanges.into_iter().map(|(symmetry, _)| symmetry).collect();
        let (symmetries, mirrors): (Vec<_>, Vec<_>) = reflections.into_iter().unzip();
        self.symmetries.extend(symmetries);
        self.mirrors.extend(mirrors);
    }
}

impl Test<'_, '_> {
    fn field(&self) -> &dyn VectorField {
        self.system.field
    }

    fn batch<'x>(&'x self, x: &'x [f64], time: &'x [f64; 1]) -> Batch<'x> {
        let times = if self.field().forced() { &time[..] } else { &[] };
        Batch { lanes: 1, states: x, parameters: Parameters::Shared(self.parameters), times, signs: &[] }
    }

    /// All symmetries with δ = `later` that the search finds.
    fn all(&self, later: f64) -> Vec<Symmetry> {
        let n = self.field().dim();
        let mut found: Vec<Symmetry> = Vec::new();
        let mut keep = |symmetry: Symmetry| {
            if found.len() < MOST && !found.contains(&symmetry) && self.holds(&symmetry, later) {
                found.push(symmetry);
            }
        };
        if n <= SIGNS {
            for bits in 0..1usize << n {
                keep(Symmetry::reflection(&(0..n).map(|i| bits >> i & 1 == 1).collect::<Vec<_>>()));
            }
        } else {
            keep(Symmetry::identity());
            keep(Symmetry::reflection(&vec![true; n]));
        }
        if !(2..=STATES).contains(&n) {
            return found;
        }
        let size = self.system.scales.iter().product::<f64>().powf(1.0 / n as f64);
        let searches = [(0.37 * size, &[false][..]), (0.0, if n <= SIGNS { &[false, true] } else { &[true] })];
        for (level, signs) in searches {
            let still = [0.0, later].map(|later| self.still(level, later));
            let [Some(before), Some(after)] = still else { continue };
            let mut search = Search { before, after, signs, images: Vec::new(), trials: 0 };
            search.extend(&mut keep);
        }
        found
    }

    /// Values at the point whose components are all `level`; `None` if they are not finite.
    fn still(&self, level: f64, later: f64) -> Option<Still> {
        let n = self.field().dim();
        let (x, time) = (vec![level; n], [0.137 + later]);
        let (mut f, mut fx) = (vec![0.0; n], vec![0.0; n * n]);
        self.field().linearise(self.batch(&x, &time), &[], &mut f, &mut fx, &mut []);
        f.iter().chain(&fx).all(|v| v.is_finite()).then_some(Still { f, fx })
    }

    /// True if (1) holds at all points, and for the conditions of a boundary-value problem too.
    fn holds(&self, symmetry: &Symmetry, later: f64) -> bool {
        let periods = self.field().periods();
        let turned = (0..periods.len()).any(|i| periods[symmetry.image(i).0] != periods[i]);
        let value = |x: &[f64], time: f64| {
            let (time, mut f) = ([time], vec![0.0; x.len()]);
            self.field().evaluate(self.batch(x, &time), &mut f);
            f
        };
        let equivariant = |(k, x): (usize, &Vec<f64>)| {
            let time = 0.137 + 0.211 * k as f64;
            let (a, b) = (value(&symmetry.of(x), time + later), symmetry.of(&value(x, time)));
            let size = if self.field().forced() { max_abs(&b) } else { 0.0 };
            a.iter().zip(&b).all(|(p, q)| p.is_finite() && (p - q).abs() <= ROUNDING * (p.abs() + q.abs() + size))
        };
        !turned && self.points.iter().enumerate().all(equivariant) && self.keeps_conditions(symmetry)
    }

    /// True if a symmetry takes every condition of a boundary-value problem to one of them, but for the sign.
    fn keeps_conditions(&self, symmetry: &Symmetry) -> bool {
        let ([ends, integrals], n) = (self.field().conditions(), self.field().dim());
        let values = |left: &[f64], right: &[f64], time: f64| {
            let [mut b, mut by_left, mut by_right] = [1, n, n].map(|size| vec![0.0; ends * size]);
            self.field().boundary([left, right], self.parameters, &[], [&mut b, &mut by_left, &mut by_right, &mut []]);
            let (mut g, mut gx) = (vec![0.0; integrals], vec![0.0; integrals * n]);
            self.field().integrands(self.batch(left, &[time]), &[], [&mut g, &mut gx, &mut []]);
            b.extend(g);
            b
        };
        // One list of values at all pairs of points for each condition.
        let pairs: Vec<[Vec<f64>; 2]> = self
            .points
            .windows(2)
            .enumerate()
            .map(|(k, pair)| {
                let time = 0.137 + 0.211 * k as f64;
                let image = values(&symmetry.of(&pair[0]), &symmetry.of(&pair[1]), time);
                [values(&pair[0], &pair[1], time), image]
            })
            .collect();
        let is_image = |own: usize, other: usize, sign: f64| {
            pairs.iter().all(|[values, images]| {
                let (a, b) = (values[other], sign * images[own]);
                (a - b).abs() <= ROUNDING * (a.abs() + b.abs())
            })
        };
        let count = ends + integrals;
        (0..count).all(|own| (0..count).any(|other| [1.0, -1.0].iter().any(|sign| is_image(own, other, *sign))))
    }
}

/// Assignment of images, state after state.
struct Search<'a> {
    /// At time t.
    before: Still,
    /// At time t + δ.
    after: Still,
    /// Changes of sign to be tried.
    signs: &'a [bool],
    images: Vec<(usize, bool)>,
    trials: usize,
}

impl Search<'_> {
    fn extend(&mut self, keep: &mut dyn FnMut(Symmetry)) {
        let (n, i) = (self.before.f.len(), self.images.len());
        if i == n {
            keep(Symmetry::new(self.images.clone()));
            return;
        }
        for from in 0..n {
            for &negated in self.signs {
                self.trials += 1;
                if self.trials > TRIALS {
                    return;
                }
                if self.images.iter().any(|(taken, _)| *taken == from) {
                    continue;
                }
                self.images.push((from, negated));
                if self.fits() {
                    self.extend(keep);
                }
                self.images.pop();
            }
        }
    }

    /// True if (2) holds for the last state with an image and those before it.
    fn fits(&self) -> bool {
        let (n, i) = (self.before.f.len(), self.images.len() - 1);
        let (from, negated) = self.images[i];
        let same = |a: f64, b: f64, opposite: bool, size: f64| {
            let b = if opposite { -b } else { b };
            (a - b).abs() <= ROUNDING * (a.abs() + b.abs() + size)
        };
        let (before, after) = (&self.before, &self.after);
        let sizes = [max_abs(&before.f), max_abs(&before.fx)];
        same(after.f[i], before.f[from], negated, sizes[0])
            && self.images.iter().enumerate().all(|(k, (other, opposite))| {
                let sign = negated != *opposite;
                same(after.fx[i * n + k], before.fx[from * n + other], sign, sizes[1])
                    && same(after.fx[k * n + i], before.fx[other * n + from], sign, sizes[1])
            })
    }
}
