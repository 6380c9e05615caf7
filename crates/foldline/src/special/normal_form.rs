//! Normal forms at equilibria: what a bifurcation does to the solutions around it.
//!
//! **Equations.** With A = f_x, B and C the second and third derivatives of f in the states, ⟨q, q⟩ = 1 and ⟨p, q⟩ = 1 unless
//! said otherwise, on the critical eigenspace:
//!
//! ```text
//!   fold                (1)  A q = 0, pᵀ A = 0:            ξ' = β + a ξ²,         a = ½ ⟨p, B(q,q)⟩
//!   cusp                (2)  A h = -B(q,q), ⟨p, h⟩ = 0:    ξ' = … + c ξ³,         c = ⅙ ⟨p, C(q,q,q) + 3 B(q,h)⟩
//!   Hopf                (3)  A q = iω q, pᴴ A = iω pᴴ:     z' = iω z + … l₁ ω z |z|²
//!        l₁ = 1/(2ω) Re ⟨p, C(q,q,q̄) - 2 B(q, A⁻¹ B(q,q̄)) + B(q̄, (2iω - A)⁻¹ B(q,q))⟩
//!   Bogdanov–Takens     (4)  A q₀ = 0, A q₁ = q₀, p₁ᵀ A = 0, p₀ᵀ A = p₁ᵀ, ⟨p₀,q₀⟩ = ⟨p₁,q₁⟩ = 1, ⟨p₀,q₁⟩ = 0:
//!        ξ₁' = ξ₂,  ξ₂' = … + a ξ₁² + b ξ₁ ξ₂,   a = ½ ⟨p₁, B(q₀,q₀)⟩,  b = ⟨p₀, B(q₀,q₀)⟩ + ⟨p₁, B(q₀,q₁)⟩
//! ```
//!
//! All are in the units of the model. The signs of a (fold) and of a and b together (Bogdanov–Takens) change with that of q; those of
//! c and l₁ do not.
//!
//! **Source.** kuznetsov2004, §5.4 (fold, Hopf), §8.7 (cusp, Bogdanov–Takens).

use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::{Kind, Point, Solution};
use crate::linalg::{dot, lu, max_abs};
use num_complex::Complex64;

/// An equilibrium and the derivatives of f there.
pub struct Local<'a> {
    field: &'a dyn VectorField,
    state: &'a [f64],
    parameters: &'a [f64],
    n: usize,
    /// `[n × n]`.
    jacobian: Vec<f64>,
}

/// A complex vector as its real and imaginary part.
type Complex = [Vec<f64>; 2];

impl<'a> Local<'a> {
    /// At a point; `None` where it is a cycle.
    pub fn new(field: &'a dyn VectorField, at: &'a Point) -> Option<Local<'a>> {
        let Solution::Equilibrium(state) = &at.solution else { return None };
        let n = state.len();
        let (mut f, mut jacobian) = (vec![0.0; n], vec![0.0; n * n]);
        let batch = Batch { lanes: 1, states: state, parameters: Parameters::Shared(&at.parameters), times: &[] };
        field.linearise(batch, &[], &mut f, &mut jacobian, &mut []);
        Some(Local { field, state, parameters: &at.parameters, n, jacobian })
    }

    /// A derivative of f in the states along some directions `[n]`.
    fn derivative(&self, along: &[&[f64]]) -> Vec<f64> {
        let full: Vec<Vec<f64>> = along
            .iter()
            .map(|d| d.iter().copied().chain(std::iter::repeat_n(0.0, self.parameters.len())).collect())
            .collect();
        let full: Vec<&[f64]> = full.iter().map(Vec::as_slice).collect();
        let at = Batch { lanes: 1, states: self.state, parameters: Parameters::Shared(self.parameters), times: &[] };
        let mut out = vec![0.0; self.n];
        self.field.directional(at, &full, &mut out);
        out
    }

    /// B(a, b).
    fn bilinear(&self, a: &Complex, b: &Complex) -> Complex {
        let of = |x: &[f64], y: &[f64]| self.derivative(&[x, y]);
        let real = sum(&of(&a[0], &b[0]), -1.0, &of(&a[1], &b[1]));
        [real, sum(&of(&a[0], &b[1]), 1.0, &of(&a[1], &b[0]))]
    }

    /// C(q, q, q̄).
    fn cubic(&self, q: &Complex) -> Complex {
        let of = |x: &[f64], y: &[f64], z: &[f64]| self.derivative(&[x, y, z]);
        let [a, b] = q;
        [sum(&of(a, a, a), 1.0, &of(a, b, b)), sum(&of(a, a, b), 1.0, &of(b, b, b))]
    }

    /// (A - z) x = r as a real system of twice the size: its factors. A shift of the size of rounding keeps it regular at an eigenvalue.
    fn shifted(&self, z: Complex64) -> Option<(Vec<f64>, Vec<usize>)> {
        let (n, size) = (self.n, 2 * self.n);
        let mut matrix = vec![0.0; size * size];
        for i in 0..n {
            for j in 0..n {
                matrix[i * size + j] = self.jacobian[i * n + j];
                matrix[(n + i) * size + n + j] = self.jacobian[i * n + j];
            }
        }
        let least = 1e-14 * max_abs(&matrix).max(z.norm());
        for i in 0..n {
            matrix[i * size + i] -= z.re + least;
            matrix[(n + i) * size + n + i] -= z.re + least;
            matrix[i * size + n + i] += z.im;
            matrix[(n + i) * size + i] -= z.im;
        }
        let mut pivots = vec![0; size];
        lu::factorise(&mut matrix, size, &mut pivots).ok()?;
        Some((matrix, pivots))
    }

    /// (A - z)⁻¹ r.
    fn solved(&self, z: Complex64, r: &Complex) -> Option<Complex> {
        let (matrix, pivots) = self.shifted(z)?;
        let mut x = r.concat();
        lu::solve(&matrix, 2 * self.n, &pivots, &mut x, 1);
        Some(halves(x))
    }

    /// Right and left eigenvectors of the eigenvalue closest to z, each of unit length: A q = z q, pᴴ A = z pᴴ.
    fn eigenvectors(&self, z: Complex64) -> Option<[Complex; 2]> {
        let (matrix, pivots) = self.shifted(z)?;
        let mut out = [const { Vec::new() }; 2];
        for (side, vector) in out.iter_mut().enumerate() {
            *vector = (0..2 * self.n).map(|k| (1.0 + k as f64).sin()).collect();
            for _ in 0..3 {
                match side {
                    0 => lu::solve(&matrix, 2 * self.n, &pivots, vector, 1),
                    _ => lu::solve_transposed(&matrix, 2 * self.n, &pivots, vector),
                }
                let norm = dot(vector, vector).sqrt();
                if !(norm.is_finite() && norm > 0.0) {
                    return None;
                }
                vector.iter_mut().for_each(|x| *x /= norm);
            }
        }
        let [q, p] = out.map(halves);
        Some([q, p])
    }

    /// q and p of a zero eigenvalue, both of unit length.
    pub fn null_vectors(&self) -> Option<[Vec<f64>; 2]> {
        const ROUNDS: usize = 5;
        let generic = |k: f64| (0..self.n).map(|i| 0.6 + (1.0 + k * i as f64).sin()).collect();
        (0..ROUNDS).try_fold([generic(1.3), generic(1.9)], |vectors, _| self.null_vectors_near(&vectors))
    }

    /// The factors of A with the column p and the row q.
    fn with_borders(&self, q: &[f64], p: &[f64]) -> Option<(Vec<f64>, Vec<usize>)> {
        let (n, size) = (self.n, self.n + 1);
        let mut matrix = vec![0.0; size * size];
        for i in 0..n {
            matrix[i * size..i * size + n].copy_from_slice(&self.jacobian[i * n..(i + 1) * n]);
            (matrix[i * size + n], matrix[n * size + i]) = (p[i], q[i]);
        }
        let mut pivots = vec![0; size];
        lu::factorise(&mut matrix, size, &mut pivots).ok()?;
        Some((matrix, pivots))
    }

    /// The same from approximate ones, by a system that is regular where an eigenvalue 0 is double too: they change smoothly with the place
    /// and keep their direction.
    pub fn null_vectors_near(&self, [q, p]: &[Vec<f64>; 2]) -> Option<[Vec<f64>; 2]> {
        let (n, size) = (self.n, self.n + 1);
        let (matrix, pivots) = self.with_borders(q, p)?;
        let (mut v, mut w) = (vec![0.0; size], vec![0.0; size]);
        (v[n], w[n]) = (1.0, 1.0);
        lu::solve(&matrix, size, &pivots, &mut v, 1);
        lu::solve_transposed(&matrix, size, &pivots, &mut w);
        let unit = |mut x: Vec<f64>| {
            x.truncate(n);
            let norm = dot(&x, &x).sqrt();
            x.iter_mut().for_each(|x| *x /= norm);
            x
        };
        Some([unit(v), unit(w)])
    }

    /// Solves A y = r with ⟨p, y⟩ = 0 where that has a solution, for q and p as [`Local::null_vectors`] gives them.
    fn bordered(&self, [q, p]: &[Vec<f64>; 2], r: &[f64]) -> Option<Vec<f64>> {
        let (n, size) = (self.n, self.n + 1);
        let (matrix, pivots) = self.with_borders(q, p)?;
        let mut y = [r, &[0.0]].concat();
        lu::solve(&matrix, size, &pivots, &mut y, 1);
        y.truncate(n);
        Some(y)
    }

    /// ⟨p, B(q, q)⟩ of vectors of unit length, each of which points the way that the others do.
    pub fn quadratic(&self, [q, p]: &[Vec<f64>; 2]) -> f64 {
        dot(p, &self.derivative(&[q, q]))
    }

    /// a of (1).
    pub fn fold(&self) -> Option<f64> {
        let vectors = self.null_vectors()?;
        Some(0.5 * self.quadratic(&vectors) / dot(&vectors[0], &vectors[1]))
    }

    /// c of (2).
    pub fn cusp(&self) -> Option<f64> {
        let vectors = self.null_vectors()?;
        let [q, p] = &vectors;
        let b = self.derivative(&[q, q]);
        // What is left of ⟨p, B⟩ at a cusp that is not met exactly is taken away.
        let share = dot(p, &b) / dot(p, p);
        let right: Vec<f64> = b.iter().zip(p).map(|(b, p)| share * p - b).collect();
        let mut h = self.bordered(&vectors, &right)?;
        let along = dot(p, &h) / dot(p, q);
        h.iter_mut().zip(q).for_each(|(h, q)| *h -= along * q);
        Some((dot(p, &self.derivative(&[q, q, q])) + 3.0 * dot(p, &self.derivative(&[q, &h]))) / (6.0 * dot(p, q)))
    }

    /// l₁ of (3) for the frequency ω.
    pub fn hopf(&self, omega: f64) -> Option<f64> {
        let [q, p] = self.eigenvectors(Complex64::new(0.0, omega))?;
        let conjugate: Complex = [q[0].clone(), q[1].iter().map(|x| -x).collect()];
        let mean = self.solved(Complex64::new(0.0, 0.0), &self.bilinear(&q, &conjugate))?;
        // (2iω - A)⁻¹ r is minus what solves (A - 2iω) x = r.
        let second = self.solved(Complex64::new(0.0, 2.0 * omega), &self.bilinear(&q, &q))?;
        let (cubic, slow, fast) = (self.cubic(&q), self.bilinear(&q, &mean), self.bilinear(&conjugate, &second));
        let size = hermitian(&p, &q);
        let terms = [(1.0, &cubic), (-2.0, &slow), (-1.0, &fast)];
        let terms = terms.map(|(factor, term)| factor * (hermitian(&p, term) / size));
        Some(without_rounding(&terms.map(|z| z.re), &terms.map(|z| z.norm()), ROUNDING) / (2.0 * omega))
    }

    /// a and b of (4).
    pub fn takens(&self) -> Option<[f64; 2]> {
        let vectors = self.null_vectors()?;
        let [q0, p1] = &vectors;
        let q1 = self.bordered(&vectors, q0)?;
        let transposed = Local {
            jacobian: (0..self.n * self.n).map(|k| self.jacobian[k % self.n * self.n + k / self.n]).collect(),
            ..*self
        };
        let p0 = transposed.bordered(&[p1.clone(), q0.clone()], p1)?;
        // ⟨p₁, q₁⟩ = ⟨p₀, q₀⟩ is a number that p₀ and p₁ are divided by; what q₁ has along q₀ is chosen so that ⟨p₀, q₁⟩ = 0.
        let size = dot(p1, &q1);
        let along = dot(&p0, &q1) / size;
        let q1 = sum(&q1, -along, q0);
        let quadratic = self.derivative(&[q0, q0]);
        let mixed = self.derivative(&[q0, &q1]);
        Some([0.5 * dot(p1, &quadratic) / size, (dot(&p0, &quadratic) + dot(p1, &mixed)) / size])
    }
}

/// Relative to the terms of a coefficient, what is left of them is no more than rounding.
const ROUNDING: f64 = 1e-12;

/// The sum of some terms; exactly zero where it is less than that share of their sizes.
pub(super) fn without_rounding(terms: &[f64], sizes: &[f64], share: f64) -> f64 {
    let (total, size) = (terms.iter().sum::<f64>(), sizes.iter().sum::<f64>());
    if total.abs() <= share * size { 0.0 } else { total }
}

fn sum(a: &[f64], factor: f64, b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + factor * b).collect()
}

fn halves(mut both: Vec<f64>) -> Complex {
    let imaginary = both.split_off(both.len() / 2);
    [both, imaginary]
}

/// Σ p̄ x.
fn hermitian(p: &Complex, x: &Complex) -> Complex64 {
    Complex64::new(dot(&p[0], &x[0]) + dot(&p[1], &x[1]), dot(&p[0], &x[1]) - dot(&p[1], &x[0]))
}

/// The frequency of the pair of eigenvalues that is closest to the imaginary axis.
pub(super) fn frequency(at: &Point) -> Option<f64> {
    let pairs = at.spectrum.iter().filter(|z| z.im > 0.0);
    Some(pairs.min_by(|a, b| (a.re / a.im).abs().total_cmp(&(b.re / b.im).abs()))?.im)
}

/// The coefficients of the normal form of a special point of that kind, in the order of [`Kind::coefficients`]; none where they are not
/// known.
pub fn coefficients(field: &dyn VectorField, kind: Kind, at: &Point) -> Vec<f64> {
    let Some(local) = Local::new(field, at) else { return Vec::new() };
    let found = match kind {
        Kind::Fold => local.fold().map(|a| vec![a]),
        Kind::Hopf => frequency(at).and_then(|omega| local.hopf(omega)).map(|l| vec![l]),
        Kind::Cusp => local.cusp().map(|c| vec![c]),
        Kind::BogdanovTakens => local.takens().map(|both| both.to_vec()),
        _ => None,
    };
    found.filter(|all| all.iter().all(|c| c.is_finite())).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Definition, Model, ModelSource, Parameter, State};

    fn model(equations: &[(&str, &str)], parameter: f64) -> Model {
        Model::compile(ModelSource {
            parameters: vec![Parameter::new("p", parameter)],
            states: equations.iter().map(|(name, _)| State::new(name)).collect(),
            equations: equations.iter().map(|(name, text)| Definition::new(name, text)).collect(),
            ..ModelSource::default()
        })
        .unwrap()
    }

    fn origin(model: &Model) -> Point {
        let n = model.dim();
        Point {
            position: 0,
            parameters: model.defaults(),
            solution: Solution::Equilibrium(vec![0.0; n]),
            tangent: Vec::new(),
            step: 0.0,
            spectrum: Vec::new(),
            unstable: 0,
            ranges: Vec::new(),
            trust: Default::default(),
            cost: Default::default(),
        }
    }

    fn with(equations: &[(&str, &str)], parameter: f64, check: impl Fn(&Local)) {
        let model = model(equations, parameter);
        check(&Local::new(&model, &origin(&model)).unwrap());
    }

    fn near(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-10 * (1.0 + b.abs()), "{a} {b}");
    }

    #[test]
    fn a_normal_form_has_its_own_coefficients() {
        with(&[("x", "3*x^2"), ("y", "-y")], 0.0, |at| near(at.fold().unwrap().abs(), 3.0));
        // A change of coordinates that mixes: y is a slave, y = x², and adds 2 x y = 2 x³.
        with(&[("x", "-5*x^3 + 2*x*y"), ("y", "-y + x^2")], 0.0, |at| near(at.cusp().unwrap(), -3.0));
        // z' = iω z + (c₁ + i) z |z|² in Cartesian coordinates, where ⟨q, q⟩ = 1 makes |z|² half of x² + y²: l₁ = 2 c₁ / ω.
        let hopf =
            [("x", "-2*y - 0.3*x*(x^2 + y^2) - y*(x^2 + y^2)"), ("y", "2*x - 0.3*y*(x^2 + y^2) + x*(x^2 + y^2)")];
        with(&hopf, 0.0, |at| near(at.hopf(2.0).unwrap(), -2.0 * 0.3 / 2.0));
        with(&[("x", "y"), ("y", "0.7*x^2 - 0.4*x*y")], 0.0, |at| {
            let [a, b] = at.takens().unwrap();
            near(a * b, -0.28);
            near(a.abs(), 0.7);
        });
    }

    #[test]
    fn quadratic_terms_enter_the_first_lyapunov_coefficient() {
        // kuznetsov2004, §3.5: for u' = -v + …, ω = 1, l₁ from all second and third derivatives; here u' = -v + p u² + u v, v' = u + v².
        let formula = |p: f64| {
            // (1/16)(f_uuu + …) + (1/16 ω)(f_uv (f_uu + f_vv) - g_uv (g_uu + g_vv) - f_uu g_uu + f_vv g_vv), which is a for r' = a r³.
            let (fuu, fuv, fvv, guu, guv, gvv) = (2.0 * p, 1.0, 0.0, 0.0, 0.0, 2.0);
            (fuv * (fuu + fvv) - guv * (guu + gvv) - fuu * guu + fvv * gvv) / 16.0
        };
        for p in [0.5, -1.25] {
            // r' = a r³ in u + i v; with ⟨q, q⟩ = 1, l₁ = 2 a / ω.
            with(&[("u", "-v + p*u^2 + u*v"), ("v", "u + v^2")], p, |at| near(at.hopf(1.0).unwrap(), 2.0 * formula(p)));
        }
    }
}
