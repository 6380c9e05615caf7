//! Normal forms of a zero eigenvalue: folds, cusps, branch points, Bogdanov–Takens points.

use super::ROUNDING;
use super::local::Local;
use super::manifold::Manifold;
use super::without_rounding;
use crate::linalg::dot;

impl Local<'_> {
    /// a of (1).
    pub fn fold(&self) -> Option<f64> {
        Some(0.5 * Manifold::new(self, true, &[])?.motion(0, &[0, 0])?.value.re)
    }

    /// c of (2).
    pub fn cusp(&self) -> Option<f64> {
        Some(Manifold::new(self, true, &[])?.motion(0, &[0, 0, 0])?.value.re / 6.0)
    }

    /// a and b of (3), or 0, b and c at a pitchfork. `along` `[n + k]`, in states and parameters, is a direction closer
    /// to the branch than to the one that crosses it, per unit of its parameter. The states are measured in `units` `[n]`,
    /// the coefficients are in those of the model. `None` if no branches cross.
    pub fn crossing(&self, along: &[f64], pitchfork: bool, units: &[f64]) -> Option<Vec<f64>> {
        let vectors = self.null_vectors()?;
        // An interpolated tangent satisfies the linear equations only approximately.
        let off = self.bordered(&vectors, &self.derivative(&[along]))?;
        let along: Vec<f64> = along.iter().enumerate().map(|(i, x)| x - off.get(i).copied().unwrap_or(0.0)).collect();
        let [q, p] = vectors;
        // At a pitchfork b does not depend on the component along q, which is large on the branch that turns back.
        let own = if pitchfork { dot(&q, &along[..self.n]) } else { 0.0 };
        let along: Vec<f64> = along.iter().enumerate().map(|(i, x)| x - own * q.get(i).unwrap_or(&0.0)).collect();
        let along = &along[..];
        let size = dot(&p, &q);
        let b = dot(&p, &self.derivative(&[&q, along])) / size;
        // The null vector is of unit length in the units of the model.
        let length = q.iter().zip(units).map(|(q, unit)| (q * unit).powi(2)).sum::<f64>().sqrt();
        if pitchfork {
            return Some(vec![0.0, b, self.cusp()? / (length * length)]);
        }
        // Near the point both tangents and all vectors between them satisfy the linear equations. The tangents of the
        // branches, along + t q, are the roots of a t² + b t + ½ ⟨p, f(along, along)⟩, and b is half its derivative at
        // the nearer root.
        let a = self.fold()?;
        let rest = 0.5 * dot(&p, &self.derivative(&[along, along])) / size;
        let square = b * b - 4.0 * a * rest;
        (square >= 0.0).then(|| vec![a / length, square.sqrt().copysign(b)])
    }

    /// ⟨p, q⟩ of null vectors of unit length, with the states in terms of their sizes `[n]`. It vanishes if the
    /// eigenvalue 0 is double.
    pub(super) fn simplicity(&self, sizes: &[f64]) -> Option<f64> {
        let [q, p] = self.null_vectors()?;
        let norm = |v: &[f64], power: i32| {
            v.iter().zip(sizes).map(|(v, size)| (v * size.powi(power)).powi(2)).sum::<f64>().sqrt()
        };
        Some(dot(&p, &q) / (norm(&q, -1) * norm(&p, 1)))
    }

    /// Displacement `[n]` to the vertex of a pitchfork, at which a vanishes: a point located along the branch that turns back is
    /// off by the square root of the error of its parameter.
    pub fn vertex(&self) -> Option<Vec<f64>> {
        let [q, _] = self.null_vectors()?;
        let off = -self.fold()? / (3.0 * self.cusp()?);
        off.is_finite().then(|| q.iter().map(|q| off * q).collect())
    }

    /// True if a ξ² is less than c ξ³ at the amplitude ξ at which ξ q is `share` of the `scales` `[n]` of the states.
    pub fn is_pitchfork(&self, scales: &[f64], share: f64) -> Option<bool> {
        Some(self.fold()?.abs() <= share * self.reach(scales)? * self.cusp()?.abs())
    }

    /// The amplitude ξ at which ξ q reaches the `scales` `[n]` of the states.
    pub fn reach(&self, scales: &[f64]) -> Option<f64> {
        let [q, _] = self.null_vectors()?;
        Some(1.0 / q.iter().zip(scales).fold(f64::MIN_POSITIVE, |most, (q, s)| most.max((q / s).abs())))
    }

    /// a and b of (7); `None` if both vanish, by a symmetry.
    pub fn takens(&self) -> Option<[f64; 2]> {
        let vectors = self.null_vectors()?;
        let [q0, p1] = &vectors;
        let q1 = self.bordered(&vectors, q0)?;
        let p0 = self.transposed().bordered(&[p1.clone(), q0.clone()], p1)?;
        // p₀ and p₁ are divided by ⟨p₁, q₁⟩ = ⟨p₀, q₀⟩; the component of q₁ along q₀ is chosen so that ⟨p₀, q₁⟩ = 0.
        let size = dot(p1, &q1);
        let along = dot(&p0, &q1) / size;
        let q1: Vec<f64> = q1.iter().zip(q0).map(|(q1, q0)| q1 - along * q0).collect();
        let quadratic = self.derivative(&[q0, q0]);
        let mixed = self.derivative(&[q0, &q1]);
        let norm = |v: &[f64]| dot(v, v).sqrt();
        let product = |p: &[f64], b: &[f64]| (dot(p, b), norm(p) * norm(b));
        let (first, of_first) = product(p1, &quadratic);
        let (second, of_second) = product(&p0, &quadratic);
        let (third, of_third) = product(p1, &mixed);
        let a = without_rounding(&[0.5 * first], &[of_first], ROUNDING) / size;
        let b = without_rounding(&[second, third], &[of_second, of_third], ROUNDING) / size;
        (a != 0.0 || b != 0.0).then_some([a, b])
    }

    /// s, θ and E of (6) for the frequency ω, then b and c, by which they are divided.
    pub fn zero_hopf(&self, omega: f64) -> Option<[f64; 5]> {
        let mut manifold = Manifold::new(self, true, &[omega])?;
        let mut g = |i: usize, m: &[usize]| manifold.motion(i, m).map(|g| g.value);
        let (g200, g011) = (g(0, &[0, 0])?.re, g(0, &[1, 2])?.re);
        let (g300, g111) = (g(0, &[0, 0, 0])?.re, g(0, &[0, 1, 2])?.re);
        let (h110, h210, h021) = (g(1, &[0, 1])?, g(1, &[0, 0, 1])?, g(1, &[1, 1, 2])?);
        let time = h021.re / g011 - g300 / g200 + g111 / g011;
        let e = 0.5 * (h210 + h110 * time - h021 * g200 / (2.0 * g011)).re;
        Some([(g200 * g011).signum(), 2.0 * h110.re / g200, e, 0.5 * g200, g011])
    }
}
