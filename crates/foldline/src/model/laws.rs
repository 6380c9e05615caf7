//! Linear conservation laws and shift symmetries of a vector field.
//!
//! **Idea.** A law holds for all states and parameters, so it can be read off f at sufficiently many sample points.
//! These are of order 1 instead of the values in use in the model, so that no term hides behind another.
//!
//! **Equations.** With rows f(x_k, p_k)ᵀ in A and rows of f_x(x_k, p_k) in B:
//!
//! ```text
//!   (1)  A c = 0:  c·x keeps its value along every solution
//!   (2)  B s = 0:  x + σ s is a solution with x, for every σ
//! ```
//!
//! The null spaces are reduced to echelon form, whose entries are rational in hand-written models. Each law is then
//! tested at further points, near and far because a term such as a contact may vanish while states are small, in twice
//! the working precision if available.

use crate::contract::{Batch, Parameters, VectorField};

/// Sample points in excess of the number of states.
const MORE: usize = 8;
/// Number of points at which a law is tested, and sizes of the states there, so that terms that switch on at large
/// states are seen, and those that exp(-x/ε) hides at states far above ε.
const TESTED: usize = 40;
const SIZES: [f64; 8] = [1.0, 10.0, 1e2, 1e3, 0.1, 1e-3, 1e-6, 1e-9];
/// Pivot, relative to the largest, that counts as zero; with a few hundred rows, rounding leaves about 1e-13.
const ZERO: f64 = 1e-9;
/// Largest residual of a law, relative to its terms: in working precision, and in twice that.
const LEFT: [f64; 2] = [1e-12, 1e-25];
/// Maximum number of states for which laws are sought: elimination costs n³ operations.
const MOST: usize = 400;
/// Largest denominator of a coefficient.
const DENOMINATORS: i32 = 60;

/// Laws (1) that hold for all parameters: coefficients `[n]` of each, sparse as far as echelon form allows. They are
/// tested at parameters of order 1 and at some of the size of those in use, `parameters` `[k]`, with states in their
/// `ranges` `[n]`: where a parameter is measured in a small unit, terms of order 1 vanish in the rounding of others that
/// are large at all parameters of order 1.
pub fn conserved(field: &dyn VectorField, parameters: &[f64], ranges: &[[f64; 2]]) -> Vec<Vec<f64>> {
    if field.iterated() {
        return Vec::new();
    }
    let around = |(i, value): (usize, &f64)| (i, [0.4 * value, 1.6 * value]);
    let moving: Vec<(usize, [f64; 2])> = parameters.iter().enumerate().map(around).collect();
    let in_use = Places { field, fixed: Some(Fixed { parameters, moving: &moving, ranges }) };
    laws(&Places { field, fixed: None }).into_iter().filter(|law| in_use.keep(law)).collect()
}

/// Laws (1) at given parameters `[k]`, except `moving` ones, which vary over their ranges; states are sampled from
/// `ranges` `[n]`.
pub fn conserved_at(
    field: &dyn VectorField,
    parameters: &[f64],
    moving: &[(usize, [f64; 2])],
    ranges: &[[f64; 2]],
) -> Vec<Vec<f64>> {
    if field.iterated() {
        return Vec::new();
    }
    laws(&Places { field, fixed: Some(Fixed { parameters, moving, ranges }) })
}

fn laws(places: &Places) -> Vec<Vec<f64>> {
    let n = places.field.dim();
    if n > MOST {
        return Vec::new();
    }
    let rows: Vec<Vec<f64>> = (0..n + MORE).filter_map(|k| places.rate(k)).collect();
    // Too few points for a conclusion.
    if rows.len() < n + MORE / 2 {
        return Vec::new();
    }
    let holds = |c: &[f64]| places.keep(c);
    null_space(rows.concat(), n).into_iter().filter(|c| holds(c)).collect()
}

/// True if c·x is conserved.
pub(super) fn keeps_its_value(field: &dyn VectorField, c: &[f64]) -> bool {
    Places { field, fixed: None }.keep(c)
}

/// Shift symmetries (2): directions `[n]`.
pub fn shifts(field: &dyn VectorField) -> Vec<Vec<f64>> {
    let n = field.dim();
    if n > MOST || field.iterated() {
        return Vec::new();
    }
    let places = Places { field, fixed: None };
    let rows: Vec<f64> = (0..MORE).filter_map(|k| places.derivatives(places.at(k))).flatten().collect();
    let moves = |s: &Vec<f64>, fx: &[f64]| {
        fx.chunks_exact(n).all(|row| {
            let terms = row.iter().zip(s).map(|(a, b)| a * b);
            let size: f64 = row.iter().zip(s).map(|(a, b)| (a * b).abs()).sum();
            terms.sum::<f64>().abs() <= LEFT[0] * size
        })
    };
    let further = || (MORE..MORE + 2 * SIZES.len()).filter_map(|k| places.derivatives(places.sized(k)));
    let holds = |s: &Vec<f64>| further().all(|fx| moves(s, &fx));
    if rows.is_empty() { Vec::new() } else { null_space(rows, n).into_iter().filter(holds).collect() }
}

/// c·x as text, such as "X1 + 2*X2".
pub fn in_words(coefficients: &[f64], names: &[String]) -> String {
    let mut text = String::new();
    for (c, name) in coefficients.iter().zip(names).filter(|(c, _)| **c != 0.0) {
        let sign = match (text.is_empty(), *c < 0.0) {
            (true, false) => "",
            (true, true) => "-",
            (false, false) => " + ",
            (false, true) => " - ",
        };
        let factor = if c.abs() == 1.0 { String::new() } else { format!("{}*", c.abs()) };
        text.push_str(&format!("{sign}{factor}{name}"));
    }
    text
}

/// Sample points of f: states and parameters of order 1, all different, or those of a study.
struct Places<'a> {
    field: &'a dyn VectorField,
    fixed: Option<Fixed<'a>>,
}

/// Fixed parameters, parameters that vary, and ranges of the states.
struct Fixed<'a> {
    parameters: &'a [f64],
    moving: &'a [(usize, [f64; 2])],
    ranges: &'a [[f64; 2]],
}

impl Places<'_> {
    /// Quasi-random number between 0.4 and 1.6 for each point and entry.
    fn number(k: usize, i: usize) -> f64 {
        0.4 + 1.2
            * ((k + 1) as f64 * 0.618_033_988_749_895 + ((i + 1) as f64).sqrt() * 1.324_717_957 * (k + 2) as f64)
                .fract()
    }

    fn at(&self, k: usize) -> [Vec<f64>; 3] {
        let (n, p) = (self.field.dim(), self.field.parameter_count());
        let (x, parameters) = match &self.fixed {
            None => ((0..n).map(|i| Self::number(k, i)).collect(), (0..p).map(|i| Self::number(k, n + i)).collect()),
            Some(Fixed { parameters, moving, ranges }) => {
                let within = |i: usize, [low, high]: [f64; 2]| low + (high - low) * (Self::number(k, i) - 0.4) / 1.2;
                let mut parameters = parameters.to_vec();
                moving.iter().for_each(|(i, range)| parameters[*i] = within(n + i, *range));
                (ranges.iter().enumerate().map(|(i, range)| within(i, *range)).collect(), parameters)
            }
        };
        [x, parameters, if self.field.forced() { vec![Self::number(k, n + p)] } else { Vec::new() }]
    }

    /// f, if it is defined at sample point k.
    fn rate(&self, k: usize) -> Option<Vec<f64>> {
        let [x, parameters, times] = self.at(k);
        self.rate_at(&x, &parameters, &times)
    }

    fn rate_at(&self, x: &[f64], parameters: &[f64], times: &[f64]) -> Option<Vec<f64>> {
        let mut f = vec![0.0; x.len()];
        let at = Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters), times, signs: &[] };
        self.field.evaluate(at, &mut f);
        f.iter().all(|value| value.is_finite()).then_some(f)
    }

    fn jacobian(&self, [x, parameters, times]: &[Vec<f64>; 3]) -> Option<Vec<f64>> {
        let (n, mut f) = (x.len(), vec![0.0; x.len()]);
        let mut fx = vec![0.0; n * n];
        let at = Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters), times, signs: &[] };
        self.field.linearise(at, &[], &mut f, &mut fx, &mut []);
        fx.iter().all(|value| value.is_finite()).then_some(fx)
    }

    /// The Jacobian, then the gradients of the switches, which a shift must not change either: rows `[n]`.
    fn derivatives(&self, place: [Vec<f64>; 3]) -> Option<Vec<f64>> {
        let [x, parameters, times] = &place;
        let (n, count) = (x.len(), self.field.switch_count());
        let [mut h, mut hx, mut ht] = [count, count * n, count].map(|size| vec![0.0; size]);
        let at = Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters), times, signs: &[] };
        self.field.linearise_switches(at, &[], [&mut h, &mut hx, &mut [], &mut ht]);
        hx.iter().all(|value| value.is_finite()).then(|| self.jacobian(&place)).flatten().map(|fx| [fx, hx].concat())
    }

    /// True if c·f vanishes wherever f is defined, at points of every size and sign.
    fn keep(&self, c: &[f64]) -> bool {
        let first = self.field.dim() + MORE;
        (first..first + TESTED).all(|k| {
            let at = if self.fixed.is_none() { self.sized(k) } else { self.at(k) };
            self.keeps(at, c)
        })
    }

    /// Sample point k with states of one of the [`SIZES`] and of both signs.
    fn sized(&self, k: usize) -> [Vec<f64>; 3] {
        let [mut x, parameters, times] = self.at(k);
        let (size, turn) = (SIZES[k % SIZES.len()], k / SIZES.len());
        x.iter_mut().enumerate().for_each(|(i, x)| *x *= if (turn + i).is_multiple_of(2) { size } else { -size });
        [x, parameters, times]
    }

    /// True if c·f vanishes at a point, or f is undefined there.
    fn keeps(&self, [x, parameters, times]: [Vec<f64>; 3], c: &[f64]) -> bool {
        let double = |v: &[f64]| -> Vec<[f64; 2]> { v.iter().map(|v| [*v, 0.0]).collect() };
        let precisely =
            if times.is_empty() { self.field.evaluate_precisely(&double(&x), &double(&parameters)) } else { None };
        let (f, left) = match precisely {
            Some(f) => (f, LEFT[1]),
            None => match self.rate_at(&x, &parameters, &times) {
                Some(f) => (double(&f), LEFT[0]),
                None => return true,
            },
        };
        let size: f64 = c.iter().zip(&f).map(|(c, f)| (c * f[0]).abs()).sum();
        let sum = c.iter().zip(&f).fold([0.0; 2], |sum, (c, f)| {
            let product = c * f[0];
            added(added(added(sum, product), c.mul_add(f[0], -product)), c * f[1])
        });
        let left = if c.iter().all(|c| c.fract() == 0.0) { left } else { LEFT[0] };
        (sum[0] + sum[1]).abs() <= left * size
    }
}

/// Adds to a double-double number, larger part first (Knuth's two-sum).
fn added(sum: [f64; 2], more: f64) -> [f64; 2] {
    let whole = sum[0] + more;
    let part = whole - sum[0];
    [whole, sum[1] + (sum[0] - (whole - part)) + (more - part)]
}

/// Basis of the null space of rows `[count][n]` in echelon form, each vector with cleared denominators.
pub(crate) fn null_space(mut rows: Vec<f64>, n: usize) -> Vec<Vec<f64>> {
    if n == 0 {
        return Vec::new();
    }
    let count = rows.len() / n;
    let size = |j: usize| rows.iter().skip(j).step_by(n).fold(0.0, |m: f64, v| m.max(v.abs()));
    let sizes: Vec<f64> = (0..n).map(|j| if size(j) > 0.0 { size(j) } else { 1.0 }).collect();
    for row in rows.chunks_exact_mut(n) {
        row.iter_mut().zip(&sizes).for_each(|(v, size)| *v /= size);
        let largest = row.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        row.iter_mut().for_each(|v| *v /= largest.max(f64::MIN_POSITIVE));
    }
    let (mut pivots, mut first): (Vec<usize>, f64) = (Vec::new(), 0.0);
    while pivots.len() < count {
        let rank = pivots.len();
        let free = |j: &usize| !pivots.contains(j);
        // Among nearly equal pivots take the first, so that the last states become the free ones.
        let largest = (rank..count)
            .flat_map(|i| (0..n).filter(free).map(move |j| (i, j)))
            .max_by(|a, b| rows[a.0 * n + a.1].abs().total_cmp(&rows[b.0 * n + b.1].abs()));
        let Some((row, column)) = largest else { break };
        let pivot = rows[row * n + column];
        first = first.max(pivot.abs());
        if pivot.abs() <= ZERO * first {
            break;
        }
        (0..n).for_each(|j| rows.swap(rank * n + j, row * n + j));
        (0..n).for_each(|j| rows[rank * n + j] /= pivot);
        let own = rows[rank * n..(rank + 1) * n].to_vec();
        for (i, other) in rows.chunks_exact_mut(n).enumerate().filter(|(i, _)| *i != rank) {
            let factor = other[column];
            if factor != 0.0 && i != rank {
                other.iter_mut().zip(&own).for_each(|(a, b)| *a -= factor * b);
            }
        }
        pivots.push(column);
    }
    let free = (0..n).filter(|j| !pivots.contains(j));
    let vector = |j: usize| {
        let mut c = vec![0.0; n];
        c[j] = 1.0;
        // Entries that are zero up to rounding.
        let entry = |i: usize| if rows[i * n + j].abs() < 1e-9 { 0.0 } else { -rows[i * n + j] };
        pivots.iter().enumerate().for_each(|(i, pivot)| c[*pivot] = entry(i));
        c.iter_mut().zip(&sizes).for_each(|(c, size)| *c /= size);
        over_denominators(c)
    };
    simplest(free.map(vector).collect())
}

/// Basis of the span with fewer nonzero and fewer negative entries: vectors are subtracted from each other where that
/// simplifies.
fn simplest(mut basis: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let cost = |c: &[f64]| {
        let count = |of: &dyn Fn(&f64) -> bool| c.iter().filter(|v| of(v)).count();
        (count(&|v| *v != 0.0), count(&|v| *v < 0.0))
    };
    let count = basis.len();
    let mut again = true;
    while again {
        again = false;
        for (i, j) in (0..count).flat_map(|i| (0..count).map(move |j| (i, j))).filter(|(i, j)| i != j) {
            let less = |k: usize| {
                let factor = basis[i][k] / basis[j][k];
                let off = basis[i].iter().zip(&basis[j]).map(|(a, b)| {
                    let off = a - factor * b;
                    if off.abs() < 1e-9 * a.abs() { 0.0 } else { off }
                });
                over_denominators(off.collect())
            };
            let shared = (0..basis[i].len()).filter(|k| basis[i][*k] != 0.0 && basis[j][*k] != 0.0);
            let best = shared.map(less).min_by_key(|c| cost(c)).filter(|c| cost(c) < cost(&basis[i]));
            if let Some(best) = best {
                (basis[i], again) = (best, true);
            }
        }
    }
    basis
}

/// Vector scaled by the smallest factor that makes rational entries integers, with a positive first entry.
fn over_denominators(mut c: Vec<f64>) -> Vec<f64> {
    const NEAR: f64 = 1e-7;
    let smallest = c.iter().filter(|v| **v != 0.0).fold(f64::INFINITY, |m, v| m.min(v.abs()));
    c.iter_mut().for_each(|v| *v /= smallest);
    let whole = |factor: f64| c.iter().all(|v| (v * factor - (v * factor).round()).abs() <= NEAR * factor);
    if let Some(factor) = (1..=DENOMINATORS).map(f64::from).find(|factor| whole(*factor)) {
        c.iter_mut().for_each(|v| *v = (*v * factor).round() + 0.0);
    }
    let sign = c.iter().find(|v| **v != 0.0).map_or(1.0, |v| v.signum());
    c.iter_mut().for_each(|v| *v *= sign);
    c.iter_mut().for_each(|v| *v += 0.0);
    c
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Definition, Model, ModelSource, Parameter, State};

    fn model(equations: &[(&str, &str)], parameters: &[&str]) -> Model {
        Model::compile(ModelSource {
            name: "m".into(),
            parameters: parameters.iter().map(|name| Parameter::new(name, 1.0)).collect(),
            states: equations.iter().map(|(name, _)| State::new(name)).collect(),
            equations: equations.iter().map(|(name, text)| Definition::new(name, text)).collect(),
            ..ModelSource::default()
        })
        .unwrap()
    }

    fn all(model: &Model) -> Vec<Vec<f64>> {
        conserved(model, &model.defaults(), &model.ranges())
    }

    fn told(model: &Model, found: Vec<Vec<f64>>) -> Vec<String> {
        let names: Vec<String> = model.states.iter().map(|s| s.name.clone()).collect();
        let mut told: Vec<String> = found.iter().map(|c| in_words(c, &names)).collect();
        told.sort();
        told
    }

    /// Michaelis-Menten: total enzyme and total substrate are conserved.
    #[test]
    fn the_totals_of_a_reaction_are_found() {
        let m = model(
            &[("s", "-a*s*e + b*c"), ("e", "-a*s*e + (b + k)*c"), ("c", "a*s*e - (b + k)*c"), ("p", "k*c")],
            &["a", "b", "k"],
        );
        let found = told(&m, all(&m));
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found.contains(&"e + c".to_string()), "{found:?}");
    }

    #[test]
    fn a_law_that_holds_at_one_parameter_value_only_is_rejected() {
        let m = model(&[("x", "-x + y"), ("y", "x - k*y")], &["k"]);
        assert!(all(&m).is_empty());
        let m = model(&[("x", "-x/2 + y^3"), ("y", "x/3 - 2*y^3/3")], &[]);
        assert_eq!(told(&m, all(&m)), ["2*x + 3*y"]);
    }

    /// At p of order 1, p/1e-6 to the fifth power hides everything else.
    #[test]
    fn terms_that_vanish_except_at_small_parameters_are_seen() {
        let mut source = ModelSource {
            states: vec![State::new("x"), State::new("y")],
            parameters: vec![Parameter::new("p", 1e-6)],
            equations: vec![Definition::new("x", "(p/1e-6 - x)^5 - x"), Definition::new("y", "(p/1e-6 - x)^5 - 2*y")],
            ..ModelSource::default()
        };
        assert!(all(&Model::compile(source.clone()).unwrap()).is_empty());
        source.equations[0] = Definition::new("x", "(p/1e-6 - x)^5 + y");
        source.equations[1] = Definition::new("y", "-(p/1e-6 - x)^5 - y");
        let m = Model::compile(source).unwrap();
        assert_eq!(told(&m, all(&m)), ["x + y"]);
    }

    /// A term that is zero while states are of order 1.
    #[test]
    fn terms_that_switch_on_at_large_states_are_seen() {
        let m = model(&[("x", "k - x"), ("y", "max(0, x - 5) - max(0, y - 40)")], &["k"]);
        assert!(all(&m).is_empty());
    }

    /// A term that is zero to rounding while states are of order 1, and of order 1 where they are small.
    #[test]
    fn terms_that_vanish_except_at_small_states_are_seen() {
        let m = model(&[("x", "y - x"), ("y", "k*exp(-x^2/1e-8) - k*exp(-y^2/1e-8)/2")], &["k"]);
        assert!(all(&m).is_empty());
        let m = model(&[("x", "exp(-x^2/1e-8)*k")], &["k"]);
        assert!(shifts(&m).is_empty() && all(&m).is_empty());
    }

    #[test]
    fn a_shift_symmetry_is_found() {
        let m = model(&[("a", "u"), ("u", "-u - k*sin(a - b)"), ("b", "v"), ("v", "-v - k*sin(b - a)")], &["k"]);
        assert_eq!(told(&m, shifts(&m)), ["a + b"]);
        let pendulum = model(&[("a", "u"), ("u", "-u - k*sin(a)")], &["k"]);
        assert!(shifts(&pendulum).is_empty());
    }
}
