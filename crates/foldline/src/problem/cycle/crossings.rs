//! Transition matrices of intervals on which the orbit crosses a switching surface.
//!
//! **Idea.** Collocation evaluates f_x at Gauss points. If f_x jumps between two of them, the transition of the
//! interval is wrong by the jump times the distance of the switching point from the nearest Gauss point, which no other
//! sample of the interval shows reliably. The interval is therefore divided where the switching function vanishes along
//! the profile, and each part is integrated separately; the difference is the error of the transition. It does not
//! improve the multipliers, which would then no longer be those of the discrete equations: at folds, no multiplier
//! would be exactly 1.
//!
//! **Equations.** With the interval [t_j, t_j + h], the switching function σ, and the right-hand sides f⁻ and f⁺ before
//! and after it:
//!
//! ```text
//!   (1)  V' = T f_x(x(τ)) V on each part, V = I at its left end                      by collocation at the Gauss points of the part
//!   (2)  S = I + (f⁺ - f⁻) (∇σ)ᵀ / (∇σ·f⁻ + ∂σ/∂t)                                  between two parts, the saltation matrix
//!   (3)  ∫ x' - h T f ds over the interval, part by part                             the defect of collocation at its right end
//! ```
//!
//! **Source.** leine2004 (saltation matrix).
//!
//! **Fails when** the orbit grazes a switching surface, or crosses it twice between two of the points examined: it is
//! then treated as smooth.

use super::CycleProblem;
use crate::contract::{Batch, Parameters};
use crate::linalg::{axpy, dot, lu, panel};

/// Number of parts of an interval at whose ends switching functions are compared: eight per Gauss point for degree 4.
const PLACES: usize = 32;
/// Number of bisections of a crossing, down to rounding.
const HALVINGS: usize = 50;
/// Jump of f, relative to the larger side, below which it is rounding: f is continuous and (2) is the identity.
const CONTINUOUS: f64 = 1e-9;
/// Step of the central difference of a switching function, in scales: the cube root of the machine precision.
const STEP: f64 = 6e-6;

/// An interval on which the orbit crosses switching surfaces.
pub(super) struct Crossed {
    pub interval: usize,
    /// `[n × n]`.
    pub transition: Vec<f64>,
}

/// Replaces the collocation transitions, `[N][n × n]`, of intervals with crossings.
pub(super) fn replace(transitions: &mut [f64], crossed: &[Crossed]) {
    for own in crossed {
        let square = own.transition.len();
        transitions[own.interval * square..][..square].copy_from_slice(&own.transition);
    }
}

/// Zero of a switching function within an interval: position in [0, 1], and index of the function.
struct Cut {
    at: f64,
    switch: usize,
}

/// An interval and the polynomial on it.
struct Piece<'p> {
    problem: &'p CycleProblem<'p>,
    parameters: &'p [f64],
    /// `[m + 1][n]`.
    nodes: &'p [f64],
    /// Ends in normalised time; below, the period in the time of the field.
    ends: [f64; 2],
    period: f64,
}

impl CycleProblem<'_> {
    /// Intervals on which the orbit `u` crosses switching surfaces, with their transitions.
    pub(super) fn crossed(&self, u: &[f64]) -> Vec<Crossed> {
        self.at_crossings(u, |interval, piece, cuts| Some(Crossed { interval, transition: piece.transition(cuts)? }))
    }

    /// Indices of the intervals on which the orbit `u` crosses switching surfaces, with (3) for each.
    pub(super) fn defects_at_crossings(&self, u: &[f64]) -> Vec<(usize, Vec<f64>)> {
        self.at_crossings(u, |interval, piece, cuts| Some((interval, piece.defect(cuts))))
    }

    fn at_crossings<R>(&self, u: &[f64], of: impl Fn(usize, &Piece, &[Cut]) -> Option<R>) -> Vec<R> {
        if self.setting.field.switch_count() == 0 {
            return Vec::new();
        }
        let (size, block) = (self.profile_size(), self.block());
        let parameters = self.setting.at(&u[size + 1..]);
        let found = self.suspects(u, &parameters).into_iter().filter_map(|j| {
            let (nodes, ends) = (&u[j * block..(j + 1) * block], [self.mesh[j], self.mesh[j + 1]]);
            let piece = Piece { problem: self, parameters: &parameters, nodes, ends, period: u[size] };
            let cuts = piece.cuts();
            if cuts.is_empty() { None } else { of(j, &piece, &cuts) }
        });
        found.collect()
    }

    /// Intervals on which a switching function may vanish: it varies by more than its smallest value at the nodes.
    fn suspects(&self, u: &[f64], parameters: &[f64]) -> Vec<usize> {
        let (n, intervals, nodes) = (self.n, self.intervals(), self.scheme.degree + 1);
        let (lanes, count) = (intervals * nodes, self.setting.field.switch_count());
        let mut states = vec![0.0; n * lanes];
        panel::by_component(&u[..self.profile_size()], nodes, n, &mut states);
        let time =
            |g: usize, j: usize| f64::from(self.forcing_periods) * (self.mesh[j] + self.scheme.nodes[g] * self.h(j));
        let times: Vec<f64> = match self.is_forced() {
            true => (0..nodes).flat_map(|g| (0..intervals).map(move |j| time(g, j))).collect(),
            false => Vec::new(),
        };
        let mut values = vec![0.0; count * lanes];
        let batch = Batch { lanes, states: &states, parameters: Parameters::Shared(parameters), times: &times };
        self.setting.field.switches(batch, &mut values);
        let could = |own: &[f64], j: usize| {
            // Including the left end of the next interval.
            let next = own[(j + 1) % intervals];
            let there = (0..nodes).map(|g| own[g * intervals + j]).chain([next]);
            let [low, high] = there.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
            low <= 0.0 && high >= 0.0 || low.abs().min(high.abs()) < high - low
        };
        (0..intervals).filter(|j| values.chunks_exact(lanes).any(|own| could(own, *j))).collect()
    }
}

impl Piece<'_> {
    fn n(&self) -> usize {
        self.problem.n
    }

    fn state(&self, s: f64) -> Vec<f64> {
        let mut x = vec![0.0; self.n()];
        self.problem.scheme.value_into(s, self.nodes, &mut x);
        x
    }

    /// Time at a position in [0, 1]; empty for an autonomous field.
    fn time(&self, s: f64) -> Vec<f64> {
        let [begin, end] = self.ends;
        let own = f64::from(self.problem.forcing_periods) * (begin + s * (end - begin));
        if self.problem.is_forced() { vec![own] } else { Vec::new() }
    }

    fn switches(&self, x: &[f64], times: &[f64]) -> Vec<f64> {
        let field = self.problem.setting.field;
        let mut values = vec![0.0; field.switch_count()];
        let batch = Batch { lanes: 1, states: x, parameters: Parameters::Shared(self.parameters), times };
        field.switches(batch, &mut values);
        values
    }

    /// Zeros of the switching functions, in order.
    fn cuts(&self) -> Vec<Cut> {
        let at = |s: f64| self.switches(&self.state(s), &self.time(s));
        let mut cuts = Vec::new();
        let mut before = at(0.0);
        for place in 0..PLACES {
            let [left, right] = [place, place + 1].map(|k| k as f64 / PLACES as f64);
            let after = at(right);
            for k in (0..after.len()).filter(|k| (before[*k] > 0.0) != (after[*k] > 0.0)) {
                let (mut a, mut b) = (left, right);
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (a + b);
                    if (at(middle)[k] > 0.0) == (before[k] > 0.0) { a = middle } else { b = middle }
                }
                cuts.push(Cut { at: 0.5 * (a + b), switch: k });
            }
            before = after;
        }
        cuts.sort_by(|a, b| a.at.total_cmp(&b.at));
        cuts
    }

    /// Transition over the whole interval.
    fn transition(&self, cuts: &[Cut]) -> Option<Vec<f64>> {
        let n = self.n();
        let mut transition: Vec<f64> = (0..n * n).map(|k| f64::from(u8::from(k % (n + 1) == 0))).collect();
        let mut begin = 0.0;
        for (index, end) in cuts.iter().map(|cut| cut.at).chain([1.0]).enumerate() {
            if end > begin {
                transition = product(&self.part([begin, end])?, &transition, n);
            }
            if let Some(Cut { at, switch }) = cuts.get(index) {
                // Signs are taken in the middle of the preceding part, because another switching function may vanish at
                // its end.
                transition = product(&self.saltation(*at, *switch, 0.5 * (begin + at)), &transition, n);
            }
            begin = end;
        }
        transition.iter().all(|x| x.is_finite()).then_some(transition)
    }

    /// Defect (3).
    fn defect(&self, cuts: &[Cut]) -> Vec<f64> {
        let (n, scheme, field) = (self.n(), &self.problem.scheme, self.problem.setting.field);
        let length = (self.ends[1] - self.ends[0]) * self.period;
        let slope = |s: f64| {
            // The polynomial of degree m - 1 through the derivatives at the Gauss points.
            let gauss = &scheme.nodes[1..];
            let through = |i: usize| -> f64 {
                (0..gauss.len()).filter(|l| *l != i).map(|l| (s - gauss[l]) / (gauss[i] - gauss[l])).product()
            };
            let mut slope = vec![0.0; n];
            for (i, row) in scheme.derivative.chunks_exact(scheme.degree + 1).enumerate() {
                let weight = through(i);
                row.iter().zip(self.nodes.chunks_exact(n)).for_each(|(d, x)| axpy(weight * d, x, &mut slope));
            }
            slope
        };
        let (mut total, mut begin) = (vec![0.0; n], 0.0);
        for end in cuts.iter().map(|cut| cut.at).chain([1.0]) {
            for (c, weight) in scheme.nodes[1..].iter().zip(&scheme.weights) {
                let s = begin + (end - begin) * c;
                let (x, times, mut f) = (self.state(s), self.time(s), vec![0.0; n]);
                let batch =
                    Batch { lanes: 1, states: &x, parameters: Parameters::Shared(self.parameters), times: &times };
                field.evaluate(batch, &mut f);
                let weight = weight * (end - begin);
                axpy(weight, &slope(s), &mut total);
                axpy(-weight * length, &f, &mut total);
            }
            begin = end;
        }
        total
    }

    /// Transition (1) over a part of the interval.
    fn part(&self, [begin, end]: [f64; 2]) -> Option<Vec<f64>> {
        let (n, scheme, field) = (self.n(), &self.problem.scheme, self.problem.setting.field);
        let m = scheme.degree;
        let length = (end - begin) * (self.ends[1] - self.ends[0]) * self.period;
        let places: Vec<f64> = scheme.nodes[1..].iter().map(|c| begin + (end - begin) * c).collect();
        let each: Vec<Vec<f64>> = places.iter().map(|s| self.state(*s)).collect();
        let states: Vec<f64> = (0..n).flat_map(|i| each.iter().map(move |x| x[i])).collect();
        let times: Vec<f64> = places.iter().flat_map(|s| self.time(*s)).collect();
        let batch = Batch { lanes: m, states: &states, parameters: Parameters::Shared(self.parameters), times: &times };
        let (mut f, mut fx) = (vec![0.0; n * m], vec![0.0; n * n * m]);
        field.linearise(batch, &[], &mut f, &mut fx, &mut []);
        // Σ_k D_ik V_k - length J_i V_i = -D_i0 I for the values at the Gauss points.
        let size = m * n;
        let (mut matrix, mut right) = (vec![0.0; size * size], vec![0.0; size * n]);
        for i in 0..m {
            let row = &scheme.derivative[i * (m + 1)..(i + 1) * (m + 1)];
            for a in 0..n {
                for k in 0..m {
                    matrix[(i * n + a) * size + k * n + a] += row[k + 1];
                }
                for b in 0..n {
                    matrix[(i * n + a) * size + i * n + b] -= length * fx[(a * n + b) * m + i];
                }
                right[(i * n + a) * n + a] = -row[0];
            }
        }
        let mut pivots = vec![0; size];
        lu::factorise(&mut matrix, size, &mut pivots).ok()?;
        lu::solve(&matrix, size, &pivots, &mut right, n);
        let mut transition = vec![0.0; n * n];
        (0..n).for_each(|a| transition[a * n + a] = scheme.end[0]);
        for (k, values) in right.chunks_exact(n * n).enumerate() {
            transition.iter_mut().zip(values).for_each(|(t, v)| *t += scheme.end[k + 1] * v);
        }
        Some(transition)
    }

    /// Saltation matrix (2) at a zero of a switching function; `before` is a position in the preceding part.
    fn saltation(&self, at: f64, switch: usize, before: f64) -> Vec<f64> {
        let (n, field) = (self.n(), self.problem.setting.field);
        let (x, time) = (self.state(at), self.time(at));
        let mut signs: Vec<f64> = self
            .switches(&self.state(before), &self.time(before))
            .iter()
            .map(|v| if *v > 0.0 { 1.0 } else { -1.0 })
            .collect();
        let side = |signs: &[f64]| {
            let mut f = vec![0.0; n];
            let batch = Batch { lanes: 1, states: &x, parameters: Parameters::Shared(self.parameters), times: &time };
            field.evaluate_switched(batch, signs, &mut f);
            f
        };
        let first = side(&signs);
        signs[switch] = -signs[switch];
        let second = side(&signs);
        let jump: Vec<f64> = second.iter().zip(&first).map(|(a, b)| a - b).collect();
        let mut matrix: Vec<f64> = (0..n * n).map(|k| f64::from(u8::from(k % (n + 1) == 0))).collect();
        let scales = self.problem.setting.scales;
        let size = |f: &[f64]| f.iter().zip(scales).map(|(f, s)| (f / s).abs()).fold(0.0, f64::max);
        if size(&jump) <= CONTINUOUS * size(&first).max(size(&second)) {
            return matrix;
        }
        let of = |x: &[f64], times: &[f64]| self.switches(x, times)[switch];
        let gradient: Vec<f64> = (0..n)
            .map(|i| {
                let step = STEP * scales[i].max(x[i].abs());
                let moved = |by: f64| {
                    let mut y = x.clone();
                    y[i] += by;
                    of(&y, &time)
                };
                (moved(step) - moved(-step)) / (2.0 * step)
            })
            .collect();
        let moved = |by: f64| of(&x, &time.iter().map(|t| t + by).collect::<Vec<f64>>());
        let in_time = if time.is_empty() { 0.0 } else { (moved(STEP) - moved(-STEP)) / (2.0 * STEP) };
        let speed = dot(&gradient, &first) + in_time;
        for i in 0..n {
            (0..n).for_each(|k| matrix[i * n + k] += jump[i] * gradient[k] / speed);
        }
        matrix
    }
}

/// Product a b, row-major.
fn product(a: &[f64], b: &[f64], n: usize) -> Vec<f64> {
    let entry = |i: usize, k: usize| (0..n).map(|j| a[i * n + j] * b[j * n + k]).sum::<f64>();
    (0..n * n).map(|k| entry(k / n, k % n)).collect()
}
