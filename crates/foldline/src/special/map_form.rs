//! Normal forms of cycles of maps.
//!
//! **Idea.** The centre manifold is expanded at every iterate, H_{k+1} = f(H_k), and closes with the normal form, H_N(ξ) =
//! H_0(g(ξ)). This yields the coefficients of the N-th iterate of the map without forming it.
//!
//! **Equations.** With v, w and κ of `map_operator`, B and C the second and third derivatives of f along the cycle, ⟨v₀,
//! v₀⟩ = ⟨w_{N-1}, v₀⟩ = 1, and ⟨w, s⟩ = Σ_k w̄_k s_k:
//!
//! ```text
//!   fold             (1)  κ = 1:       ξ → ξ + β + a ξ²,    a = ½ ⟨w, B(v,v)⟩
//!   cusp             (2)               ξ → … + c ξ³,        c = ⅙ ⟨w, C(v,v,v) + 3 B(v,h)⟩,   h_{k+1} = A_k h_k + B(v_k,v_k), h_N = h_0
//!   branch point     (3)               ξ → ξ + b μ ξ + a ξ² + c ξ³,   b = ⟨w, f_xμ v + B(v, x_μ)⟩, a of (1), c of (2)
//!   period doubling  (4)  κ = -1:      ξ → -ξ + c ξ³,       c as in (2)
//!   torus            (5)  κ = e^{iθ}:  z → e^{iθ} z (1 + d |z|²),  d = ½ e^{-iθ} ⟨w, C(v,v,v̄) + 2 B(v,h₁₁) + B(v̄,h₂₀)⟩
//!        h₁₁ with B(v,v̄), h_N = h_0;   h₂₀ with B(v,v), h_N = e^{2iθ} h_0
//! ```
//!
//! These are the coefficients of kuznetsov2004 for f^N at x₀. Those at another iterate x_k differ by the factor 1/|v_k| (a)
//! or 1/|v_k|² (c, d). v₀ is oriented so that its largest component is positive.
//!
//! Errors: the coefficient is recomputed at cycles displaced by the error of the point, with random signs.
//!
//! **Source.** kuznetsov2004, §5.4 and §9; kuznetsov2005 (without forming the iterate).
//!
//! **Fails when** κ is a double multiplier, or θ is that of a strong resonance, at which (5) is not the normal form.

use super::coefficients::Coefficients;
use super::map_operator::{Borders, Course, Null, Orbit, hermitian};
use crate::diagram::{Kind, Point, Solution};
use crate::problem::Setting;
use num_complex::Complex64;

/// Number of recomputations of a coefficient, and the stated error over the largest change; see `normal_form::errors`.
const SAMPLES: u64 = 4;
const SAFE: f64 = 3.0;
/// Relative size of displacements that rounding leaves visible.
const VISIBLE: f64 = 1e-8;
/// Rounding error of a coefficient, relative to its terms, for each component of the cycle.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Share of its terms below which a coefficient is rounding: a hundred times the error of a point of a curve.
const NOISE: f64 = 1e-9;
/// Distance of e^{ikθ} from 1 at which a point is resonant. Order of magnitude: the square root of the smallest error of
/// a located point.
const RESONANT: f64 = 1e-6;
/// |⟨w, v⟩| of unit vectors below which κ is a double multiplier.
const DOUBLE: f64 = 1e-6;
/// Amplitude, relative to the scales, up to which a quadratic term may be invisible at a pitchfork; see `normal_form`.
const PITCHFORK: f64 = 1e-5;

/// Values of a formula, and the sums of the moduli of their terms.
struct Found {
    values: Vec<f64>,
    terms: Vec<f64>,
}

/// Returns the coefficients of a cycle at a bifurcation of the given kind; `error` is the bound on the error of the
/// point. Of the setting, all free parameters matter; the last is that of the branch.
pub fn coefficients(kind: Kind, setting: &Setting, at: &Point, error: f64) -> Coefficients {
    use Kind::{BranchPoint, Cusp, Fold, PeriodDoubling, Torus};
    if !matches!(kind, Fold | Cusp | BranchPoint | PeriodDoubling | Torus) {
        return Coefficients::default();
    }
    measured(kind, setting, at, error).unwrap_or_else(Coefficients::none)
}

/// Returns the coefficient without an error, for uses that need its sign only. One that vanishes up to rounding, as all
/// along a curve of torus points of area-preserving maps, is taken as positive.
pub fn coefficient(kind: Kind, setting: &Setting, at: &Point) -> Option<f64> {
    let found = formula(kind, setting, at, false).ok()?;
    let (value, noise) = (*found.values.first()?, NOISE * found.terms.first()?);
    Some(if value.abs() < noise { noise } else { value })
}

/// First coefficient.
fn value_of(kind: Kind, setting: &Setting, at: &Point) -> Option<f64> {
    formula(kind, setting, at, false).ok()?.values.first().copied()
}

fn measured(kind: Kind, setting: &Setting, at: &Point, error: f64) -> Result<Coefficients, String> {
    if kind == Kind::Torus
        && let Some(angle) = angle(at)
        && let Some(k) = (1..=4).find(|k| (Complex64::cis(f64::from(*k) * angle) - 1.0).norm() < RESONANT)
    {
        return Err(format!("1:{k} resonance, at which d does not decide"));
    }
    let simple = simplicity(kind, setting, at).ok_or("its equations could not be solved")?;
    if simple < DOUBLE {
        return Err("the multiplier is double".into());
    }
    // A pitchfork has no quadratic term.
    let pitchfork = kind == Kind::BranchPoint && is_pitchfork(setting, at, error);
    let own = formula(kind, setting, at, pitchfork)?;
    let size = at.solution.mesh().len().max(1) as f64 * setting.field.dim() as f64;
    let error = if error.is_finite() { error.max(4.0 * size * f64::EPSILON) } else { 1.0 };
    let larger = (VISIBLE / error).max(1.0);
    let mut errors: Vec<f64> = own.terms.iter().map(|terms| ROUNDING * size * terms).collect();
    for seed in 1..=SAMPLES {
        let other = formula(kind, setting, &displaced(setting, at, error * larger, seed), pitchfork);
        for (k, error) in errors.iter_mut().enumerate() {
            let value = other.as_ref().ok().and_then(|other| other.values.get(k).copied()).unwrap_or(f64::NAN);
            let change = SAFE * (value - own.values[k]).abs() / larger;
            *error = if change.is_nan() { f64::INFINITY } else { error.max(change) };
        }
    }
    if let (true, Some(first)) = (pitchfork, errors.first_mut()) {
        // By symmetry it is 0, or at most the observed value.
        *first += value_of(Kind::Fold, setting, at).unwrap_or(f64::INFINITY).abs();
    }
    if own.values.iter().any(|value| !value.is_finite()) {
        return Err("they are not finite".into());
    }
    Ok(Coefficients { values: own.values, errors, remark: String::new() })
}

/// θ of the pair of multipliers closest to the unit circle.
fn angle(at: &Point) -> Option<f64> {
    let complex = at.free_spectrum().iter().filter(|z| z.im > 0.0);
    complex.min_by(|a, b| a.norm().ln().abs().total_cmp(&b.norm().ln().abs())).map(|z| z.arg())
}

fn kappa(kind: Kind, at: &Point) -> Option<Complex64> {
    match kind {
        Kind::PeriodDoubling => Some((-1.0).into()),
        Kind::Torus => angle(at).map(Complex64::cis),
        _ => Some(1.0.into()),
    }
}

/// The point with its iterates and free parameters displaced by `size`, relative, with random signs.
fn displaced(setting: &Setting, at: &Point, size: f64, seed: u64) -> Point {
    let (mut point, n) = (at.clone(), setting.field.dim());
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut sign = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        if state >> 32 & 1 == 0 { 1.0 } else { -1.0 }
    };
    if let Solution::Cycle(cycle) = &mut point.solution {
        let size_of = |x: f64, c: usize| x.abs() + setting.scales[c % n];
        cycle.profile.iter_mut().enumerate().for_each(|(c, x)| *x += size * size_of(*x, c) * sign());
    }
    let free = setting.unknowns_of(at);
    let moved: Vec<f64> = free.iter().map(|own| own + size * (1.0 + own.abs()) * sign()).collect();
    point.parameters = Setting { parameters: at.parameters.clone(), ..setting.clone() }.at(&moved);
    let turn = 1.0 + size * sign();
    point.spectrum.iter_mut().for_each(|z| *z = Complex64::from_polar(z.norm(), z.arg() * turn));
    point
}

/// Null vectors in units of the scales, with borders close to them.
fn critical(orbit: &Orbit, kappa: Complex64) -> Option<(Null, Borders)> {
    const ROUNDS: usize = 4;
    let mut borders = Borders::generic(orbit.n * orbit.count());
    if kappa.im == 0.0 {
        borders.left.iter_mut().chain(&mut borders.right).for_each(|z| z.im = 0.0);
    }
    for _ in 0..ROUNDS {
        borders = Borders::of(&orbit.null(kappa, &borders)?)?;
    }
    Some((orbit.null(kappa, &borders)?, borders))
}

/// |⟨w_{N-1}, v_0⟩| of vectors of unit length in these components; 0 for a double multiplier.
fn simplicity(kind: Kind, setting: &Setting, at: &Point) -> Option<f64> {
    let Solution::Cycle(cycle) = &at.solution else { return None };
    let orbit = Orbit::new(setting, &cycle.profile, &at.parameters);
    let (null, _) = critical(&orbit, kappa(kind, at)?)?;
    let (q, p) = ends(&orbit, &null);
    let norm = |x: &[Complex64]| x.iter().map(|z| z.norm_sqr()).sum::<f64>().sqrt();
    Some(hermitian(p, q).norm() / (norm(p) * norm(q)))
}

/// v_0 and w_{N-1}.
fn ends<'n>(orbit: &Orbit, null: &'n Null) -> (&'n [Complex64], &'n [Complex64]) {
    (&null.v[..orbit.n], &null.w[null.w.len() - orbit.n..])
}

/// v with the normalisation and the orientation of (1) to (5).
fn oriented(orbit: &Orbit, null: &Null) -> Option<Course> {
    let (n, scales) = (orbit.n, orbit.setting.scales);
    let q = &null.v[..n];
    let norm = q.iter().zip(scales).map(|(z, s)| (z * s).norm_sqr()).sum::<f64>().sqrt();
    let largest = (0..n).max_by(|a, b| q[*a].norm().total_cmp(&q[*b].norm()))?;
    let turn = q[largest] / q[largest].norm();
    let v: Course = null.v.iter().map(|z| z / (turn * norm)).collect();
    v.iter().all(|z| z.is_finite()).then_some(v)
}

/// a of (1) at a point of a curve of folds, with v oriented as at `reference`, where it may be oriented in any way: a
/// smooth function along the curve.
pub fn quadratic_near(setting: &Setting, reference: &Point, at: &Point) -> Option<f64> {
    let vectors = |point: &Point| -> Option<(Course, f64)> {
        let Solution::Cycle(cycle) = &point.solution else { return None };
        let orbit = Orbit::new(setting, &cycle.profile, &point.parameters);
        let (null, _) = critical(&orbit, Complex64::ONE)?;
        let unit = |x: &Course| {
            let norm = x.iter().map(|z| z.norm_sqr()).sum::<f64>().sqrt();
            x.iter().map(|z| z / norm).collect::<Course>()
        };
        let (v, w) = (unit(&null.v), unit(&null.w));
        // Both signs are fixed by the product that does not vanish at a simple multiplier.
        let value = hermitian(&w, &orbit.multilinear(&[&v, &v])).re;
        let sign = hermitian(&w[w.len() - orbit.n..], &v[..orbit.n]).re.signum();
        Some((v, value * sign))
    };
    let (before, _) = vectors(reference)?;
    let (now, value) = vectors(at)?;
    Some(value * hermitian(&before, &now).re.signum())
}

/// True if the multiplier 1 is simple.
pub fn is_simple(setting: &Setting, at: &Point) -> bool {
    simplicity(Kind::Fold, setting, at).is_some_and(|simple| simple > DOUBLE)
}

/// v and w with the normalisation of (1) to (5).
fn normalised(orbit: &Orbit, null: &Null) -> Option<(Course, Course)> {
    let n = orbit.n;
    let v = oriented(orbit, null)?;
    let (_, p) = ends(orbit, null);
    let size = hermitian(p, &v[..n]).conj();
    let w: Course = null.w.iter().map(|z| z / size).collect();
    v.iter().chain(&w).all(|z| z.is_finite()).then_some((v, w))
}

/// Sum of ⟨w, s⟩ over several s, and the sum of the moduli of the products.
fn total(w: &Course, terms: &[(f64, Course)], factor: Complex64) -> (f64, f64) {
    let value: Complex64 = terms.iter().map(|(share, s)| share * hermitian(w, s)).sum();
    let sizes = terms.iter().map(|(share, s)| share * w.iter().zip(s).map(|(w, s)| (w * s).norm()).sum::<f64>());
    ((value * factor).re, sizes.sum())
}

/// Returns the eigenvector of the multiplier -1 along a cycle, `[N][n]`, with the orientation of (4).
pub fn antiperiodic(setting: &Setting, at: &Point) -> Option<Vec<f64>> {
    let Solution::Cycle(cycle) = &at.solution else { return None };
    let orbit = Orbit::new(setting, &cycle.profile, &at.parameters);
    let (null, _) = critical(&orbit, (-1.0).into())?;
    let v = oriented(&orbit, &null)?;
    Some(v.iter().enumerate().map(|(c, z)| z.re * setting.scales[c % orbit.n]).collect())
}

const UNSOLVED: &str = "its equations could not be solved";

fn formula(kind: Kind, setting: &Setting, at: &Point, pitchfork: bool) -> Result<Found, String> {
    let Solution::Cycle(cycle) = &at.solution else { return Err("the solution is not a cycle".into()) };
    if cycle.profile.is_empty() {
        return Err("the iterates of the cycle are missing".into());
    }
    let orbit = Orbit::new(setting, &cycle.profile, &at.parameters);
    let kappa = kappa(kind, at).ok_or("no multiplier is on the unit circle")?;
    let (null, borders) = critical(&orbit, kappa).ok_or(UNSOLVED)?;
    let (v, w) = normalised(&orbit, &null).ok_or(UNSOLVED)?;
    let one = Complex64::ONE;
    let bent = orbit.multilinear(&[&v, &v]);
    let quadratic = || total(&w, &[(0.5, bent.clone())], one);
    let cubic = |borders: Option<&Borders>| -> Result<(f64, f64), String> {
        let h = orbit.solved(one, &bent, borders).ok_or(UNSOLVED)?;
        let c = orbit.multilinear(&[&v, &v, &v]);
        Ok(total(&w, &[(1.0 / 6.0, c), (0.5, orbit.multilinear(&[&v, &h]))], one))
    };
    let found = |pairs: Vec<(f64, f64)>| {
        let (values, terms) = pairs.into_iter().unzip();
        Ok(Found { values, terms })
    };
    match kind {
        Kind::Fold => found(vec![quadratic()]),
        Kind::Cusp => found(vec![cubic(Some(&borders))?]),
        Kind::PeriodDoubling => found(vec![cubic(None)?]),
        Kind::BranchPoint => {
            let along = direction(&orbit, at, &borders).ok_or("the branch itself turns back there")?;
            let part = |x: &Course| -> Vec<f64> { x.iter().map(|z| z.re).collect() };
            let real = |values: Vec<f64>| -> Course { values.into_iter().map(Complex64::from).collect() };
            let mixed = real(orbit.derivative(&[&part(&v), &along.states], Some(&along.parameters)));
            let b = total(&w, &[(1.0, mixed)], one);
            if pitchfork {
                return found(vec![(0.0, quadratic().1), b, cubic(Some(&borders))?]);
            }
            // The tangent lies between those of both branches; see `normal_form`.
            let a = quadratic();
            let own = along.second(&orbit);
            let (rest, _) = total(&w, &[(0.5, real(own))], one);
            let square = b.0 * b.0 - 4.0 * a.0 * rest;
            if square < 0.0 {
                return Err("no second branch was found to cross there".into());
            }
            found(vec![a, (square.sqrt().copysign(b.0), b.1)])
        }
        _ => {
            let conjugate: Course = v.iter().map(|z| z.conj()).collect();
            let h11 = orbit.solved(one, &orbit.multilinear(&[&v, &conjugate]), None).ok_or(UNSOLVED)?;
            let h20 = orbit.solved(kappa * kappa, &bent, None).ok_or(UNSOLVED)?;
            let terms = [
                (0.5, orbit.multilinear(&[&v, &v, &conjugate])),
                (1.0, orbit.multilinear(&[&v, &h11])),
                (0.5, orbit.multilinear(&[&conjugate, &h20])),
            ];
            found(vec![total(&w, &terms, kappa.conj())])
        }
    }
}

/// Direction along a branch, in units of the scales, per unit of its parameter.
struct Along {
    states: Vec<f64>,
    parameters: Vec<f64>,
}

impl Along {
    /// Second derivative of f along the direction, in states and parameters.
    fn second(&self, orbit: &Orbit) -> Vec<f64> {
        let own = (&self.states[..], Some(&self.parameters[..]));
        orbit.derivative_in_all(&[own, own])
    }
}

fn direction(orbit: &Orbit, at: &Point, borders: &Borders) -> Option<Along> {
    // A branch that turns back itself cannot serve as the reference branch.
    const STEEP: f64 = 1e-3;
    let (setting, n, size) = (orbit.setting, orbit.n, orbit.n * orbit.count());
    let slope = at.parameter_slope();
    let states: Vec<f64> = at.tangent.get(..size)?.iter().enumerate().map(|(c, t)| t / setting.scales[c % n]).collect();
    let sideways = states.iter().fold(0.0f64, |most, t| most.max(t.abs()));
    if slope.abs() < STEEP * sideways {
        return None;
    }
    let mut one = vec![0.0; setting.freedom()];
    *one.last_mut()? = 1.0 / setting.unit();
    let parameters = setting.spread(&one);
    let mut states: Vec<f64> = states.iter().map(|t| t / (slope * setting.unit())).collect();
    // An interpolated tangent satisfies the linear equations only approximately.
    let moved = orbit.derivative(&[&states], Some(&parameters));
    let miss: Course = (0..size).map(|c| Complex64::from(moved[c] - states[(c + n) % size])).collect();
    let off = orbit.solved(Complex64::ONE, &miss, Some(borders))?;
    states.iter_mut().zip(&off).for_each(|(x, d)| *x += d.re);
    Some(Along { states, parameters })
}

/// True if a ξ² is less than c ξ³ at the amplitude at which the quadratic term would still be visible, or if a is zero
/// within its error.
fn is_pitchfork(setting: &Setting, at: &Point, error: f64) -> bool {
    let (Some(a), Some(c)) = (value_of(Kind::Fold, setting, at), value_of(Kind::Cusp, setting, at)) else {
        return false;
    };
    let scale = setting.scales.iter().fold(0.0f64, |most, s| most.max(*s));
    a.abs() <= PITCHFORK.max(error.sqrt()) * scale * c.abs()
}
