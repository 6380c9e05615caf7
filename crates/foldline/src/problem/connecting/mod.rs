//! Orbits that connect equilibria, as a boundary-value problem on a finite interval.
//!
//! **Idea.** A homoclinic orbit leaves a saddle along its unstable and returns along its stable manifold; a heteroclinic
//! one ends at another saddle. It is cut off at a small distance from both, where the manifolds are replaced by their
//! tangent spaces. The equilibria and the length of the interval are unknowns.
//!
//! **Equations.** On t ∈ [0, 1], with equilibria x_0 and x_1 (equal for a homoclinic orbit, but for whole turns g of
//! angles), A_i = f_x(x_i, p), and projectors P_s, P_u of `splitting`:
//!
//! ```text
//!   (1)  x' = T f(x, p)
//!   (2)  f(x_i, p) = 0
//!   (3)  Q_0 P_s(A_0) (x(0) - x_0) = 0             n_s rows
//!   (4)  Q_1 P_u(A_1) (x(1) - x_1 - g) = 0         n_u rows
//!   (5)  ⟨e_0, x(0) - x_0⟩ = ε_0,   ⟨e_1, x(1) - x_1 - g⟩ = ε_1
//! ```
//!
//! Rows Q_i span those of the projectors at a reference solution. With its deviations y_i from the equilibria, and H of
//! `splitting`, e_0 = P_uᵀ H y_0 / ε_0, e_1 = P_sᵀ H y_1 / ε_1, ε_i = |y_i|: the orbit is cut off where it crosses the plane (5) transversally, at the
//! distance ε_i. (5) fixes both T and the phase. The orbit exists if n_u(x_0) + n_s(x_1) = n, for isolated values of
//! one parameter.
//!
//! An orbit homoclinic to a saddle-node leaves it within the centre-unstable and returns within the centre-stable manifold. With
//! P_s and P_u for the eigenvalues off the axis, (3) and (4) have n - 1 rows, and the eigenvalue 0 gives the last condition, with
//! which two parameters are determined but for one:
//!
//! ```text
//!   (6)  tr((1 - P_s - P_u) A_0) = 0
//! ```
//!
//! The tangent spaces deviate from the manifolds by nonlinear terms, r = P (f(x_i + y) - f(x_i) - A_i y) / (rates). They are the
//! remainders of (3) and (4), from which the error of the truncated orbit follows. Next to a saddle-node the remaining
//! distance decreases like 1/t only. There (3) and (4) include the terms up to fourth order, with the leading real eigenvalue
//! κ of the subspace in which the orbit leaves or arrives, the leading one γ of the other, and time derivatives x', x'', x''' of the flow:
//!
//! ```text
//!   (7)  Q P (24 κ³ (x - x_i) - 26 κ² x' + 9 κ x'' - x''') / ((2 κ - γ) (3 κ - γ) (4 κ - γ)) = 0
//! ```
//!
//! On the manifold, z = h₂ y² + h₃ y³ + … with y ~ exp(κ t). The operator (2 κ - D) (3 κ - D) (4 κ - D), D = d/dt, annihilates three
//! terms. For κ = 0, y' = b y², and z''' is of fifth order. At the other end of a non-central orbit γ vanishes, and (7) serves there as well. The terms of that order follow from (5 κ - D) applied to (7).
//!
//! The state and the time of an orbit are those of the field. T, x_i, the ε_i and the reference are further parameters,
//! in this order: T, x_0, x_1 if it is another equilibrium, ε_0, ε_1, g, e_0, e_1, Q_0, Q_1 (with a row of zeros for a
//! saddle-node), the four coefficients of (7) at both ends (1, 0, 0, 0 for the tangent space), and the number of unstable
//! eigenvalues at x_0. Files of earlier versions end with Q_1.
//!
//! **Source.** beyn1990 (truncation, projection conditions, order of the error); kuznetsov2004, §6, §7.1;
//! champneys1996, §2 (saddle-nodes).
//!
//! **Departures.** Two distances in place of a phase condition with a given length; projectors in place of bases of
//! subspaces that are followed by Riccati equations.
//!
//! **Fails when** the real parts of eigenvalues on both sides of the projections meet.

mod flips;
pub mod longer;
mod splitting;
#[cfg(test)]
mod tests;

use crate::contract::{Batch, Parameters, Turning, VectorField};
use crate::diagram::{Cycle, Kind};
use crate::linalg::{dot, larger, max_abs};
use crate::stability::eigenvalues;
use num_complex::Complex64;
use splitting::{flow, gap, identity, metric, product, row_basis, shifted, sign, times, transposed};
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// Ratio of the rate at which the orbit leaves or arrives to that of the other subspace, or of the other to the former, below which (7)
/// replaces the tangent space. Elsewhere the tangent space serves at ends that are as close as test functions of flips need them.
const SLOW: f64 = 0.01;
/// Coefficients of (7) for the tangent space.
const TANGENT: [f64; 4] = [1.0, 0.0, 0.0, 0.0];
/// Further parameters of the reference behind Q: the coefficients of (7), and the number of unstable eigenvalues.
const FURTHER: usize = 9;
/// Number of orbits whose flips are kept: those at both ends of a step, and between.
const KEPT: usize = 4;

/// A field on the states of a connecting orbit; see the module.
pub struct ConnectingField<'a> {
    field: &'a dyn VectorField,
    /// `[n]` sizes of the states.
    scales: Vec<f64>,
    /// 1 for a homoclinic orbit, 2 for a heteroclinic one.
    places: usize,
    /// Dimension of the unstable subspace at the start.
    unstable: usize,
    /// True for orbits homoclinic to a saddle-node.
    node: bool,
    determined: Vec<usize>,
    /// The last results of [`VectorField::flips`], with the parameters, which tell one orbit from another.
    turned_last: Mutex<Vec<Turned>>,
}

/// Parameters and the results of [`VectorField::flips`] there.
type Turned = (Vec<f64>, [Option<Turning>; 4]);

/// An equilibrium, in units of the sizes of the states.
struct Saddle {
    f: Vec<f64>,
    /// `[n × n]`, and `[n × q]` in the parameters asked for.
    a: Vec<f64>,
    fp: Vec<f64>,
    state: Vec<f64>,
}

/// Stable and unstable parts at an equilibrium.
pub struct Split {
    /// A, its sign function S, and H, `[n × n]`, in units of the sizes of the states.
    a: Vec<f64>,
    s: Vec<f64>,
    h: Vec<f64>,
    n: usize,
}

impl Split {
    /// Dimension of the unstable subspace.
    pub fn unstable(&self) -> usize {
        let trace: f64 = (0..self.n).map(|i| self.s[i * self.n + i]).sum();
        ((self.n as f64 + trace) / 2.0).round() as usize
    }

    /// P_s (`side` -1) or P_u (`side` 1).
    fn projector(&self, side: f64) -> Vec<f64> {
        identity(self.n).iter().zip(&self.s).map(|(i, s)| 0.5 * (i + side * s)).collect()
    }

    /// |y| of the part of `y` `[n]` (in units of the sizes of the states) in the stable or the unstable subspace.
    pub fn length(&self, y: &[f64], side: f64) -> f64 {
        let part = times(&self.projector(side), y);
        dot(&times(&self.h, &part), &part).max(0.0).sqrt()
    }

    /// Length of `y` `[n]`, in units of the sizes of the states.
    pub fn size(&self, y: &[f64]) -> f64 {
        dot(&self.covector_of(y), y).max(0.0).sqrt()
    }

    /// H y.
    pub fn covector_of(&self, y: &[f64]) -> Vec<f64> {
        times(&self.h, y)
    }

    /// Unit eigenvector of the only stable or unstable eigenvalue.
    pub fn direction(&self, side: f64) -> Vec<f64> {
        row_basis(&transposed(&self.projector(side), self.n), 1, self.n)
    }

    /// Unit left eigenvector of the only stable or unstable eigenvalue.
    pub fn covector(&self, side: f64) -> Vec<f64> {
        row_basis(&self.projector(side), 1, self.n)
    }

    /// The part of `y` `[n]` in the stable or the unstable subspace.
    pub fn part(&self, y: &[f64], side: f64) -> Vec<f64> {
        times(&self.projector(side), y)
    }

    /// Time in which the linear flow brings the stable or unstable part of `y`, backwards for the unstable one, closer to
    /// the equilibrium by the factor `share`.
    pub fn time_to(&self, y: &[f64], side: f64, share: f64) -> Option<f64> {
        const DOUBLINGS: usize = 200;
        const HALVINGS: usize = 50;
        let goal = share * self.length(y, side);
        let size = |t: f64| self.length(&self.flow(y, side, -side * t), side);
        let rate = self.a.iter().fold(f64::MIN_POSITIVE, |m: f64, a| m.max(a.abs()));
        let (mut low, mut high) = (0.0, 0.01 / rate);
        for _ in 0..DOUBLINGS {
            if size(high) <= goal {
                break;
            }
            (low, high) = (high, 1.5 * high);
        }
        let reached = size(high);
        if reached.is_nan() || reached > goal {
            return None;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            *(if size(middle) > goal { &mut low } else { &mut high }) = middle;
        }
        Some(high)
    }

    /// The linear flow within the stable or unstable subspace from the part of `y` in it, at time `t`.
    pub fn flow(&self, y: &[f64], side: f64, t: f64) -> Vec<f64> {
        let p = self.projector(side);
        flow(&product(&self.a, &p, self.n), t, &times(&p, y))
    }
}

impl<'a> ConnectingField<'a> {
    /// Orbits of `field` that leave an equilibrium with `unstable` unstable eigenvalues, and return to it or, with two
    /// `places`, end at another one; `scales` `[n]` are the sizes of the states.
    pub fn new(field: &'a dyn VectorField, scales: &[f64], places: usize, unstable: usize) -> ConnectingField<'a> {
        let (n, k) = (field.dim(), field.parameter_count());
        let determined = (k..k + 1 + places * n).collect();
        let turned_last = Mutex::default();
        ConnectingField { field, scales: scales.to_vec(), places, unstable, node: false, determined, turned_last }
    }

    /// Orbits homoclinic to a saddle-node with `unstable` unstable eigenvalues besides 0.
    pub fn at_saddle_node(field: &'a dyn VectorField, scales: &[f64], unstable: usize) -> ConnectingField<'a> {
        ConnectingField { node: true, ..ConnectingField::new(field, scales, 1, unstable) }
    }

    /// Number of unstable eigenvalues at the start, without the one that vanishes at a saddle-node.
    pub fn unstable_off_axis(&self) -> usize {
        self.unstable
    }

    /// True for orbits homoclinic to a saddle-node.
    pub fn is_at_saddle_node(&self) -> bool {
        self.node
    }

    /// The field of a stored orbit of that kind with these parameters; `None` if they do not belong to one.
    pub fn of_stored(
        field: &'a dyn VectorField,
        scales: &[f64],
        kind: Kind,
        parameters: &[f64],
    ) -> Option<ConnectingField<'a>> {
        let places = if kind == Kind::Heteroclinic { 2 } else { 1 };
        let own = ConnectingField::new(field, scales, places, 0);
        let unstable = match own.parameter_count().checked_sub(parameters.len())? {
            0 => *parameters.last()? as usize,
            FURTHER => own.split(0, parameters)?.unstable(),
            _ => return None,
        };
        Some(ConnectingField { unstable, node: kind == Kind::SaddleNodeHomoclinic, ..own })
    }

    /// Parameters of an orbit of another kind, to which no reference applies yet.
    pub fn renewed(&self, parameters: &[f64]) -> Vec<f64> {
        let mut all = parameters[..parameters.len().saturating_sub(FURTHER)].to_vec();
        all.resize(self.parameter_count() - 1, 0.0);
        all.push(self.unstable as f64);
        all
    }

    /// Stored parameters, with what files of earlier versions lack.
    pub fn completed(&self, parameters: &[f64]) -> Vec<f64> {
        let mut all = parameters.to_vec();
        if all.len() + FURTHER == self.parameter_count() {
            all.extend([TANGENT, TANGENT].concat());
            all.push(self.unstable as f64);
        }
        all
    }

    fn known(&self) -> usize {
        self.field.parameter_count()
    }

    /// Range of the equilibrium at the start (`end` 0) or at the end (1) among the parameters.
    pub fn place(&self, end: usize) -> Range<usize> {
        let n = self.dim();
        let first = self.known() + 1 + if self.places == 2 { end * n } else { 0 };
        first..first + n
    }

    /// First of ε_0, ε_1, g, e_0, e_1, Q_0, Q_1.
    fn hidden(&self) -> usize {
        self.known() + 1 + self.places * self.dim()
    }

    /// All parameters, from those of the field, T, the equilibria, the distances ε and the turns g of angles. The
    /// reference is missing.
    pub fn parameters(&self, own: &[f64], length: f64, places: &[f64], sizes: [f64; 2], gain: &[f64]) -> Vec<f64> {
        let mut all = [&own[..self.known()], &[length], places, &sizes].concat();
        all.extend((0..self.dim()).map(|c| gain.get(c).copied().unwrap_or(0.0)));
        all.resize(self.parameter_count() - 1, 0.0);
        all.push(self.unstable as f64);
        all
    }

    /// Coefficients of (7) at an end.
    fn coefficients(&self, end: usize, parameters: &[f64]) -> [f64; 4] {
        let first = self.parameter_count() - FURTHER + 4 * end;
        std::array::from_fn(|k| parameters.get(first + k).copied().unwrap_or(TANGENT[k]))
    }

    /// True if the orbit leaves or arrives at an end more slowly than deviations decay there.
    pub fn creeps(&self, end: usize, parameters: &[f64]) -> bool {
        let at = self.saddle(&parameters[self.place(end)], parameters, &[]);
        let ([other, own], _) = self.rates(end, &self.eigenvalues_of(&at.a));
        self.node || own < other
    }

    /// True where (7) will replace the tangent space once an end is placed again.
    fn will_be_slow(&self, end: usize, parameters: &[f64]) -> bool {
        let at = self.saddle(&parameters[self.place(end)], parameters, &[]);
        let ([other, own], real) = self.rates(end, &self.eigenvalues_of(&at.a));
        self.node || real && is_slow(own, other)
    }

    /// True where (7) replaces the tangent space at an end.
    pub fn is_slow(&self, end: usize, parameters: &[f64]) -> bool {
        self.coefficients(end, parameters)[3] != 0.0
    }

    /// x', x'', x''' and x'''' of the flow at a state, each `[n]` in units of the sizes of the states.
    fn motions(&self, x: &[f64], parameters: &[f64]) -> [Vec<f64>; 4] {
        let at = Jet { field: self, x, parameters: &parameters[..self.known()] };
        at.motions().map(|v| v.iter().zip(&self.scales).map(|(v, s)| v / s).collect())
    }

    /// Number of eigenvalues to the left of those that the right one of the two projectors at an end belongs to.
    fn below(&self, end: usize) -> usize {
        self.dim() - self.unstable - usize::from(self.node && end == 0)
    }

    /// Size of a state.
    pub fn scale(&self, state: usize) -> f64 {
        self.scales[state]
    }

    /// |f(x_i + y) - A_i y| / |A_i y| for a deviation `y` `[n]` from the equilibrium of an end.
    pub fn nonlinearity(&self, end: usize, y: &[f64], parameters: &[f64]) -> f64 {
        let at = self.saddle(&parameters[self.place(end)], parameters, &[]);
        let there: Vec<f64> = (0..self.dim()).map(|c| at.state[c] + y[c] * self.scales[c]).collect();
        let linear = times(&at.a, y);
        let beyond = self.saddle(&there, parameters, &[]).f;
        let rest: Vec<f64> = beyond.iter().zip(&at.f).zip(&linear).map(|((b, f), l)| b - f - l).collect();
        max_abs(&rest) / max_abs(&linear)
    }

    /// Turns g of angles.
    pub fn gain(&self, parameters: &[f64]) -> Vec<f64> {
        let first = self.hidden() + 2;
        parameters[first..first + self.dim()].to_vec()
    }

    /// Distances ε at both ends.
    pub fn sizes(&self, parameters: &[f64]) -> [f64; 2] {
        let first = self.hidden();
        [parameters[first], parameters[first + 1]]
    }

    /// Deviations y of both ends from the equilibria, in units of the sizes of the states.
    pub fn deviations(&self, ends: [&[f64]; 2], parameters: &[f64]) -> [Vec<f64>; 2] {
        let gain = &parameters[self.hidden() + 2..];
        let off = |end: usize| -> Vec<f64> {
            let place = &parameters[self.place(end)];
            let turn = |c: usize| if end == 1 { gain[c] } else { 0.0 };
            (0..self.dim()).map(|c| (ends[end][c] - place[c] - turn(c)) / self.scales[c]).collect()
        };
        [off(0), off(1)]
    }

    /// Stable and unstable parts at the equilibrium of an end; `None` next to a bifurcation of it.
    pub fn split(&self, end: usize, parameters: &[f64]) -> Option<Split> {
        self.split_at(end, parameters, 0.0)
    }

    /// The part in which the orbit leaves or arrives, and the other one, at the equilibrium of an end. Unlike with
    /// [`ConnectingField::split`] eigenvalues are divided by their number, also next to a bifurcation.
    pub fn parts(&self, end: usize, parameters: &[f64]) -> Option<Split> {
        let a = self.saddle(&parameters[self.place(end)], parameters, &[]).a;
        self.split_at(end, parameters, gap(&self.eigenvalues_of(&a), self.below(end))?)
    }

    fn split_at(&self, end: usize, parameters: &[f64], shift: f64) -> Option<Split> {
        let a = self.saddle(&parameters[self.place(end)], parameters, &[]).a;
        let n = self.dim();
        let moved = shifted(&a, shift, n);
        let (s, _) = sign(&moved, &[], n)?;
        let h = metric(&moved, &s, n)?;
        Some(Split { a, s, h, n })
    }

    /// Eigenvalues of a matrix in units of the sizes of the states, by growing real part.
    fn eigenvalues_of(&self, a: &[f64]) -> Vec<Complex64> {
        let mut values = eigenvalues(a, self.dim(), &vec![1.0; self.dim()]);
        values.sort_by(|a, b| a.re.total_cmp(&b.re));
        values
    }

    /// Distances from the axis of the leading eigenvalues of the subspace that the orbit must not enter at an end, and of the one in
    /// which it leaves or arrives; the latter may be negative next to a bifurcation. True if it is real.
    fn rates(&self, end: usize, values: &[Complex64]) -> ([f64; 2], bool) {
        let (left, right) = values.split_at(self.below(end));
        let near = |z: Option<&Complex64>, side: f64| z.map_or(f64::INFINITY, |z| side * z.re);
        let both = [near(left.last(), -1.0), near(right.first(), 1.0)];
        match end {
            0 => (both, right.first().is_some_and(|z| z.im == 0.0)),
            _ => ([both[1], both[0]], left.last().is_some_and(|z| z.im == 0.0)),
        }
    }

    fn saddle(&self, state: &[f64], parameters: &[f64], free: &[usize]) -> Saddle {
        let (n, q) = (self.dim(), free.len());
        let [mut f, mut fx, mut fp] = [1, n, q].map(|size| vec![0.0; n * size]);
        let own = Parameters::Shared(&parameters[..self.known()]);
        let batch = Batch { lanes: 1, states: state, parameters: own, times: &[], signs: &[] };
        self.field.linearise(batch, free, &mut f, &mut fx, &mut fp);
        f.iter_mut().zip(&self.scales).for_each(|(f, scale)| *f /= scale);
        fx.iter_mut().enumerate().for_each(|(k, a)| *a *= self.scales[k % n] / self.scales[k / n]);
        fp.iter_mut().enumerate().for_each(|(k, p)| *p /= self.scales[k / q]);
        Saddle { f, a: fx, fp, state: state.to_vec() }
    }

    /// D²f[e_j, d] at a saddle for every state j, `[n × n]` in units of the sizes of the states: the derivative of A in
    /// the direction `d` of states and parameters.
    fn turned(&self, at: &Saddle, parameters: &[f64], d: &[f64]) -> Vec<f64> {
        let (n, k) = (self.dim(), self.known());
        let states: Vec<f64> = at.state.iter().flat_map(|x| vec![*x; n]).collect();
        let mut units = vec![0.0; (n + k) * n];
        (0..n).for_each(|j| units[j * n + j] = self.scales[j]);
        let along: Vec<f64> = d.iter().flat_map(|x| vec![*x; n]).collect();
        let mut out = vec![0.0; n * n];
        let own = Parameters::Shared(&parameters[..k]);
        let batch = Batch { lanes: n, states: &states, parameters: own, times: &[], signs: &[] };
        self.field.directional(batch, &[&units, &along], &mut out);
        out.iter_mut().enumerate().for_each(|(k, x)| *x /= self.scales[k / n]);
        out
    }

    /// True if the orbit is subject to conditions (3) or (4) at an end.
    pub fn is_bound(&self, end: usize) -> bool {
        !self.row_ranges()[end].is_empty()
    }

    /// Ranges of Q_0 and Q_1 among the parameters.
    fn row_ranges(&self) -> [Range<usize>; 2] {
        let n = self.dim();
        let first = self.hidden() + 2 + 3 * n;
        let middle = first + self.below(0) * n;
        [first..middle, middle..middle + (n - self.below(1)) * n]
    }

    /// Range of e at an end.
    fn plane(&self, end: usize) -> Range<usize> {
        let first = self.hidden() + 2 + (1 + end) * self.dim();
        first..first + self.dim()
    }

    /// Reciprocal rate of the subspaces off the axis at a saddle-node, constant between references: (6) has no unit.
    fn unit_of_rates(&self, parameters: &[f64]) -> f64 {
        let all = [0, 1].map(|end| self.coefficients(end, parameters)[3].abs().cbrt());
        if larger(all[0], all[1]) > 0.0 { larger(all[0], all[1]) } else { 1.0 }
    }

    fn base<'b>(&self, at: Batch<'b>) -> (Batch<'b>, Vec<f64>) {
        let (k, lanes) = (self.known(), at.lanes);
        let (parameters, lengths) = match at.parameters {
            Parameters::Shared(all) => (Parameters::Shared(&all[..k]), vec![all[k]; lanes]),
            Parameters::PerLane(all) => {
                (Parameters::PerLane(&all[..k * lanes]), all[k * lanes..(k + 1) * lanes].to_vec())
            }
        };
        (Batch { parameters, times: &[], ..at }, lengths)
    }
}

/// True if (7) is to replace the tangent space, by the distances from the axis of the leading eigenvalue of the subspace in which the
/// orbit leaves or arrives, which is real, and of the other one.
fn is_slow(own: f64, other: f64) -> bool {
    own < SLOW * other || other < SLOW * own
}

/// Time derivatives of the flow at a state.
struct Jet<'j> {
    field: &'j ConnectingField<'j>,
    x: &'j [f64],
    parameters: &'j [f64],
}

impl Jet<'_> {
    /// Derivative of f along directions in the states `[n]`, or in states and parameters `[n + k]`.
    fn along(&self, directions: &[&[f64]]) -> Vec<f64> {
        let size = self.x.len() + self.parameters.len();
        let padded: Vec<Vec<f64>> =
            directions.iter().map(|d| d.iter().copied().chain(std::iter::repeat(0.0)).take(size).collect()).collect();
        let padded: Vec<&[f64]> = padded.iter().map(Vec::as_slice).collect();
        let mut out = vec![0.0; self.x.len()];
        self.field.field.directional(self.batch(), &padded, &mut out);
        out
    }

    fn batch(&self) -> Batch<'_> {
        let parameters = Parameters::Shared(self.parameters);
        Batch { lanes: 1, states: self.x, parameters, times: &[], signs: &[] }
    }

    /// x' to x'''', `[n]` each.
    fn motions(&self) -> [Vec<f64>; 4] {
        let mut f = vec![0.0; self.x.len()];
        self.field.field.evaluate(self.batch(), &mut f);
        let second = self.along(&[&f]);
        let third = sum(&[(1.0, &self.along(&[&f, &f])), (1.0, &self.along(&[&second]))]);
        let fourth = sum(&[
            (1.0, &self.along(&[&f, &f, &f])),
            (3.0, &self.along(&[&f, &second])),
            (1.0, &self.along(&[&third])),
        ]);
        [f, second, third, fourth]
    }

    /// Changes of x', x'' and x''' along a direction `d` in states and parameters `[n + k]`.
    fn changes(&self, [f, second, _, _]: &[Vec<f64>; 4], d: &[f64]) -> [Vec<f64>; 3] {
        let a = self.along(&[d]);
        let b = sum(&[(1.0, &self.along(&[d, f])), (1.0, &self.along(&[&a]))]);
        let c = sum(&[
            (1.0, &self.along(&[d, f, f])),
            (2.0, &self.along(&[f, &a])),
            (1.0, &self.along(&[d, second])),
            (1.0, &self.along(&[&b])),
        ]);
        [a, b, c]
    }
}

/// Sum of vectors with factors.
fn sum(terms: &[(f64, &[f64])]) -> Vec<f64> {
    let mut out = vec![0.0; terms[0].1.len()];
    terms.iter().for_each(|(factor, x)| out.iter_mut().zip(*x).for_each(|(o, x)| *o += factor * x));
    out
}

impl VectorField for ConnectingField<'_> {
    fn dim(&self) -> usize {
        self.field.dim()
    }

    fn parameter_count(&self) -> usize {
        let n = self.dim();
        self.hidden() + 2 + 3 * n + n * n + FURTHER
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        let (own, lengths) = self.base(at);
        self.field.evaluate(own, f);
        f.chunks_exact_mut(at.lanes).for_each(|f| f.iter_mut().zip(&lengths).for_each(|(f, t)| *f *= t));
    }

    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        let (own, lengths) = self.base(at);
        let (k, n, q, lanes) = (self.known(), self.dim(), free.len(), at.lanes);
        let known: Vec<usize> = free.iter().copied().filter(|index| *index < k).collect();
        let mut each = vec![0.0; n * known.len() * lanes];
        self.field.linearise(own, &known, f, fx, &mut each);
        let stretched = |to: &mut [f64], from: &[f64]| {
            to.iter_mut().zip(from).zip(&lengths).for_each(|((to, x), t)| *to = t * x);
        };
        fp.fill(0.0);
        for (c, index) in free.iter().enumerate() {
            let column = known.iter().position(|own| own == index);
            for i in 0..n {
                let to = &mut fp[(i * q + c) * lanes..][..lanes];
                match column {
                    Some(column) => stretched(to, &each[(i * known.len() + column) * lanes..][..lanes]),
                    None if *index == k => to.copy_from_slice(&f[i * lanes..(i + 1) * lanes]),
                    None => {}
                }
            }
        }
        let scale = |values: &mut [f64]| {
            values.chunks_exact_mut(lanes).for_each(|v| v.iter_mut().zip(&lengths).for_each(|(v, t)| *v *= t));
        };
        scale(f);
        scale(fx);
    }

    // T f is linear in T.
    fn directional(&self, at: Batch, directions: &[&[f64]], out: &mut [f64]) {
        let (own, lengths) = self.base(at);
        let (k, n, lanes) = (self.known(), self.dim(), at.lanes);
        let short: Vec<&[f64]> = directions.iter().map(|d| &d[..(n + k) * lanes]).collect();
        self.field.directional(own, &short, out);
        out.chunks_exact_mut(lanes).for_each(|f| f.iter_mut().zip(&lengths).for_each(|(f, t)| *f *= t));
        let mut rest = vec![0.0; n * lanes];
        for (left, d) in directions.iter().enumerate() {
            let change = &d[(n + k) * lanes..(n + k + 1) * lanes];
            if change.iter().all(|t| *t == 0.0) {
                continue;
            }
            let others: Vec<&[f64]> = short.iter().enumerate().filter(|(i, _)| *i != left).map(|(_, d)| *d).collect();
            match others.is_empty() {
                true => self.field.evaluate(own, &mut rest),
                false => self.field.directional(own, &others, &mut rest),
            }
            for (out, rest) in out.chunks_exact_mut(lanes).zip(rest.chunks_exact(lanes)) {
                out.iter_mut().zip(rest).zip(change).for_each(|((out, f), t)| *out += t * f);
            }
        }
    }

    fn ended(&self) -> bool {
        self.field.ended()
    }

    fn forced(&self) -> bool {
        true
    }

    fn time_unit(&self, parameters: &[f64]) -> f64 {
        parameters[self.known()]
    }

    fn time_unit_slopes(&self, parameters: &[f64]) -> Vec<f64> {
        (0..parameters.len()).map(|k| if k == self.known() { 1.0 } else { 0.0 }).collect()
    }

    fn time_unit_along(&self, _parameters: &[f64], change: &[f64]) -> f64 {
        change[self.known()]
    }

    fn periods(&self) -> &[f64] {
        self.field.periods()
    }

    fn output_count(&self) -> usize {
        self.field.output_count()
    }

    fn outputs(&self, at: Batch, out: &mut [f64]) {
        self.field.outputs(self.base(at).0, out);
    }

    fn conditions(&self) -> [usize; 2] {
        [(self.places + 1) * self.dim() + 2, 0]
    }

    fn determined(&self) -> &[usize] {
        &self.determined
    }

    fn boundary(&self, ends: [&[f64]; 2], parameters: &[f64], free: &[usize], to: [&mut [f64]; 4]) {
        let [b, left, right, by] = to;
        let (n, q, k) = (self.dim(), free.len(), self.known());
        let known: Vec<usize> = free.iter().copied().filter(|index| *index < k).collect();
        let column = |c: usize| known.iter().position(|own| *own == free[c]);
        [&mut *left, &mut *right, &mut *by].into_iter().for_each(|values| values.fill(0.0));
        let ys = self.deviations(ends, parameters);
        let ranges = self.row_ranges();
        let mut row = self.places * n;
        let mut signs: Vec<Vec<f64>> = Vec::new();
        for end in 0..2 {
            let place = self.place(end);
            let at = self.saddle(&parameters[place.clone()], parameters, &known);
            // (2)
            if end < self.places {
                for i in 0..n {
                    b[end * n + i] = at.f[i];
                    for (c, index) in free.iter().enumerate() {
                        by[(end * n + i) * q + c] = match column(c) {
                            Some(own) => at.fp[i * known.len() + own],
                            None if place.contains(index) => {
                                let j = index - place.start;
                                at.a[i * n + j] / self.scales[j]
                            }
                            None => 0.0,
                        };
                    }
                }
            }
            // (3), (4), (7)
            let moves: Vec<usize> = (0..q).filter(|c| column(*c).is_some() || place.contains(&free[*c])).collect();
            let turns: Vec<Vec<f64>> = moves
                .iter()
                .map(|c| {
                    let mut d = vec![0.0; n + k];
                    match column(*c) {
                        Some(_) => d[n + free[*c]] = 1.0,
                        None => d[free[*c] - place.start] = 1.0,
                    }
                    self.turned(&at, parameters, &d)
                })
                .collect();
            let shift = gap(&self.eigenvalues_of(&at.a), self.below(end));
            let Some((s, along)) = shift.and_then(|shift| sign(&shifted(&at.a, shift, n), &turns, n)) else {
                b.fill(f64::NAN);
                return;
            };
            // P_s at the start, P_u at the end.
            let side = if end == 0 { -1.0 } else { 1.0 };
            let rows = &parameters[ranges[end].clone()];
            let projector: Vec<f64> = identity(n).iter().zip(&s).map(|(i, s)| 0.5 * (i + side * s)).collect();
            let (own, y) = (product(rows, &projector, n), &ys[end]);
            let [linear, bent @ ..] = self.coefficients(end, parameters);
            let mut subject: Vec<f64> = y.iter().map(|y| linear * y).collect();
            // The terms of (7) beyond the first, with their derivatives in the states and in the free parameters of the field.
            let mut further: Option<[Vec<Vec<f64>>; 2]> = None;
            if self.is_slow(end, parameters) && !rows.is_empty() {
                let jet = Jet { field: self, x: ends[end], parameters: &parameters[..k] };
                let motions = jet.motions();
                let added = |all: &[Vec<f64>]| -> Vec<f64> {
                    let one = |c: usize| bent.iter().zip(all).map(|(b, own)| b * own[c]).sum::<f64>() / self.scales[c];
                    (0..n).map(one).collect()
                };
                subject.iter_mut().zip(added(&motions)).for_each(|(x, f)| *x += f);
                let along = |index: usize| -> Vec<f64> {
                    let mut d = vec![0.0; n + k];
                    d[index] = 1.0;
                    added(&jet.changes(&motions, &d))
                };
                further = Some([(0..n).map(along).collect(), known.iter().map(|index| along(n + index)).collect()]);
            }
            let turned_by = |ds: &Vec<f64>| -> Vec<f64> {
                times(rows, &times(ds, &subject)).iter().map(|x| 0.5 * side * x).collect()
            };
            let varied: Vec<Vec<f64>> = along.iter().map(turned_by).collect();
            let own_value = |values: &[f64]| dot(values, &subject);
            let mut put =
                |values: &[f64], factor: f64, there: Option<&[Vec<Vec<f64>>; 2]>, value: f64, varied: &[f64]| {
                    let ends = if end == 0 { &mut *left } else { &mut *right };
                    b[row] = value;
                    for j in 0..n {
                        ends[row * n + j] = factor * values[j] / self.scales[j];
                    }
                    for (c, index) in free.iter().enumerate() {
                        if place.contains(index) {
                            let j = index - place.start;
                            by[row * q + c] = -factor * values[j] / self.scales[j];
                        }
                    }
                    if let Some([in_states, in_parameters]) = there {
                        in_states.iter().enumerate().for_each(|(j, slope)| ends[row * n + j] += dot(values, slope));
                        for (c, own) in (0..q).filter_map(|c| Some((c, column(c)?))) {
                            by[row * q + c] += dot(values, &in_parameters[own]);
                        }
                    }
                    moves.iter().zip(varied).for_each(|(c, v)| by[row * q + c] += v);
                    row += 1;
                };
            for (r, values) in own.chunks_exact(n).enumerate() {
                let varied: Vec<f64> = varied.iter().map(|v| v[r]).collect();
                put(values, linear, further.as_ref(), own_value(values), &varied);
            }
            // (5)
            let plane = &parameters[self.plane(end)];
            put(plane, 1.0, None, dot(plane, y) - self.sizes(parameters)[end], &[]);
            // (6), twice the projector of the eigenvalue 0 being the difference of the sign functions.
            signs.push(s);
            if let ([first, second], true) = (&signs[..], self.node) {
                let centre: Vec<f64> = first.iter().zip(second).map(|(a, b)| 0.5 * (a - b)).collect();
                let against = |m: &[f64]| dot(&transposed(&centre, n), m);
                let unit = self.unit_of_rates(parameters);
                b[row] = unit * against(&at.a);
                moves.iter().zip(&turns).for_each(|(c, turned)| by[row * q + c] = unit * against(turned));
            }
        }
    }

    fn refer(&self, ends: [&[f64]; 2], parameters: &mut [f64]) {
        let ys = self.deviations(ends, parameters);
        let (n, ranges) = (self.dim(), self.row_ranges());
        for (end, y) in ys.iter().enumerate() {
            let Some(split) = self.parts(end, parameters) else { return };
            let (gone, kept) = if end == 0 { (-1.0, 1.0) } else { (1.0, -1.0) };
            // Blind to the other subspace, so that what the conditions neglect does not shift the phase.
            let own = split.covector_of(&split.part(y, kept));
            let along = times(&transposed(&split.projector(kept), n), &own);
            let (length, reached) = (split.length(y, kept), dot(&along, y));
            if !(length > 0.0 && reached > 0.0 && max_abs(&along).is_finite()) {
                return;
            }
            // The plane passes through the point itself, so that a new reference does not move the solution.
            let plane = self.plane(end);
            parameters[plane].iter_mut().zip(&along).for_each(|(e, h)| *e = h * length / reached);
            let hidden = self.hidden();
            parameters[hidden + end] = length;
            let rows = ranges[end].len() / n;
            parameters[ranges[end].clone()].copy_from_slice(&row_basis(&split.projector(gone), rows, n));
            let ([other, own], real) = self.rates(end, &self.eigenvalues_of(&split.a));
            // Between references the conditions remain of one kind: the ends were placed for it.
            let known = self.coefficients(end, parameters);
            let slow = self.node || real && if known == [0.0; 4] { is_slow(own, other) } else { known[3] != 0.0 };
            let own = if self.node { 0.0 } else { own };
            let first = self.parameter_count() - FURTHER + 4 * end;
            let coefficients = match slow && other.is_finite() {
                true => {
                    // κ and γ have opposite signs.
                    let (kappa, gamma) = (-gone * own, gone * other);
                    let rates: f64 = [2.0, 3.0, 4.0].iter().map(|k| k * kappa - gamma).product();
                    [24.0 * kappa.powi(3), -26.0 * kappa.powi(2), 9.0 * kappa, -1.0].map(|c| c / rates)
                }
                false => TANGENT,
            };
            if let Some(to) = parameters.get_mut(first..first + 4) {
                to.copy_from_slice(&coefficients);
            }
        }
    }

    fn remainders(&self, ends: [&[f64]; 2], parameters: &[f64]) -> Vec<f64> {
        let (n, ranges) = (self.dim(), self.row_ranges());
        let mut all = vec![0.0; self.places * n];
        for (end, y) in self.deviations(ends, parameters).iter().enumerate() {
            let Some(split) = self.parts(end, parameters) else { return vec![f64::NAN; self.conditions()[0]] };
            let at = self.saddle(&parameters[self.place(end)], parameters, &[]);
            let there: Vec<f64> = (0..n).map(|c| at.state[c] + y[c] * self.scales[c]).collect();
            let beyond = self.saddle(&there, parameters, &[]);
            let gone = if end == 0 { -1.0 } else { 1.0 };
            let ([other, kept], _) = self.rates(end, &self.eigenvalues_of(&at.a));
            let own = product(&parameters[ranges[end].clone()], &split.projector(gone), n);
            let coefficients = self.coefficients(end, parameters);
            let (neglected, rates): (Vec<f64>, f64) = if !self.is_slow(end, parameters) {
                // All that the linear flow neglects, of any order: the second may vanish by symmetry.
                let along = times(&at.a, y);
                let neglected = (0..n).map(|c| beyond.f[c] - at.f[c] - along[c]).collect();
                (neglected, other + 2.0 * kept)
            } else {
                let kept = if self.node { 0.0 } else { kept };
                let kappa = -gone * kept;
                let [d1, d2, d3, d4] = self.motions(ends[end], parameters);
                let all = [y, &d1, &d2, &d3, &d4];
                let one = |c: usize| -> f64 {
                    coefficients
                        .iter()
                        .enumerate()
                        .map(|(k, own)| own * (5.0 * kappa * all[k][c] - all[k + 1][c]))
                        .sum()
                };
                ((0..n).map(one).collect(), other + 5.0 * kept)
            };
            all.extend(times(&own, &neglected).iter().map(|r| r / rates));
            all.push(0.0);
        }
        if self.node {
            all.push(0.0);
        }
        all
    }

    fn flips(&self, orbit: &Cycle, parameters: &[f64]) -> [Option<Turning>; 4] {
        let known = || self.turned_last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, found)) = known().iter().find(|(at, _)| at == parameters) {
            return found.clone();
        }
        let found = self.turnings(orbit, parameters);
        let mut kept = known();
        kept.insert(0, (parameters.to_vec(), found.clone()));
        kept.truncate(KEPT);
        found
    }

    fn lengthened(&self, orbit: &Cycle, parameters: &[f64], share: f64) -> Option<(Cycle, Vec<f64>)> {
        longer::resized(self, orbit, parameters, share)
    }

    fn saddles(&self, parameters: &[f64]) -> Option<[Vec<Complex64>; 2]> {
        let of = |end: usize| {
            let at = self.saddle(&parameters[self.place(end)], parameters, &[]);
            eigenvalues(&at.a, self.dim(), &vec![1.0; self.dim()])
        };
        Some([of(0), of(1)])
    }
}
