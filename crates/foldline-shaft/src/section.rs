//! Shaft elements: tapered, hollow Timoshenko beams with two nodes.
//!
//! **Idea.** The interpolation functions are the exact deflections of the element under forces and moments at its ends.
//! For a cylinder they are the usual cubic functions of a shear-flexible beam; for a cone they follow from the same
//! integrals with variable bending and shear stiffness. The mass matrices are consistent with them.
//!
//! **Equations.** In one plane, with deflection w, slope θ, bending moment M₀ - Q s and shear force Q:
//!
//! 1. θ(s) = θ₀ + M₀ a₁ - Q a₂,   a₁ = ∫ ds/EI,   a₂ = ∫ s ds/EI
//! 2. w(s) = w₀ + θ₀ s + M₀ ∫ a₁ - Q ∫ a₂ + Q ∫ ds/κGA
//! 3. K = ∫ (M₀ - Q s)²/EI + Q²/κGA + P w'²,   M = ∫ ρA w² + ρI θ²,   G = ∫ 2ρI θ²
//! 4. κ = 6 (1 + ν)(1 + m²)²/((7 + 6ν)(1 + m²)² + (20 + 12ν) m²), m the ratio of inner to outer diameter
//!
//! **Source.** friswell2010, chapter 5 (elements); cowper1966 (shear coefficient).

use std::f64::consts::PI;

/// Number of Gauss points. The integrands of a cylinder are polynomials of degree at most 6; those of a cone whose
/// diameter doubles along the element are integrated to 1e-10.
const POINTS: usize = 12;

/// 4 × 4 matrix for the coordinates (w, θ) at the left node, then at the right node.
pub type Plane = [[f64; 4]; 4];

/// Shaft element between two nodes; SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Length.
    pub length: f64,
    /// Outer diameter at the left and at the right end.
    pub outer: [f64; 2],
    /// Inner diameter at the left and at the right end.
    pub inner: [f64; 2],
    /// Young's modulus E.
    pub young: f64,
    /// Shear modulus G.
    pub shear: f64,
    /// Density ρ.
    pub density: f64,
    /// Axial force P, positive in tension.
    pub axial: f64,
    /// True if the element deforms in shear.
    pub shear_deformation: bool,
    /// True if the cross-sections have rotary inertia.
    pub rotary_inertia: bool,
    /// True if the cross-sections have gyroscopic moments.
    pub gyroscopic: bool,
    /// Internal damping over stiffness, in s.
    pub internal: f64,
}

/// Matrices of an element in one plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matrices {
    /// M.
    pub mass: Plane,
    /// G: M ẍ + Ω G ẏ, M ÿ - Ω G ẋ.
    pub gyroscopic: Plane,
    /// K.
    pub stiffness: Plane,
    /// Elastic part of K, without the axial force.
    pub elastic: Plane,
}

/// Properties of a cross-section.
struct Cross {
    area: f64,
    second_moment: f64,
    /// 1/EI.
    bending: f64,
    /// 1/κGA; 0 without shear deformation.
    shear: f64,
}

impl Section {
    fn cross(&self, s: f64) -> Cross {
        let along = |d: [f64; 2]| d[0] + (d[1] - d[0]) * s / self.length;
        let (outer, inner) = (along(self.outer), along(self.inner));
        let area = PI / 4.0 * (outer.powi(2) - inner.powi(2));
        let second_moment = PI / 64.0 * (outer.powi(4) - inner.powi(4));
        let (nu, m2) = (self.young / (2.0 * self.shear) - 1.0, (inner / outer).powi(2));
        let around = (1.0 + m2).powi(2);
        let kappa = 6.0 * (1.0 + nu) * around / ((7.0 + 6.0 * nu) * around + (20.0 + 12.0 * nu) * m2);
        let shear = if self.shear_deformation { 1.0 / (kappa * self.shear * area) } else { 0.0 };
        Cross { area, second_moment, bending: 1.0 / (self.young * second_moment), shear }
    }

    /// Mass of the element, in kg.
    pub fn mass(&self) -> f64 {
        gauss(self.length).iter().map(|(s, weight)| weight * self.density * self.cross(*s).area).sum()
    }

    /// a₁, a₂, ∫ a₁, ∫ a₂ and ∫ ds/κGA from the left end to s, times `unit`.
    fn integrals(&self, s: f64, unit: f64) -> [f64; 5] {
        let mut sums = [0.0; 5];
        for (t, weight) in gauss(s) {
            let Cross { bending, shear, .. } = self.cross(t);
            let (bending, shear) = (unit * weight * bending, unit * weight * shear);
            let own = [bending, bending * t, bending * (s - t), bending * (s - t) * t, shear];
            sums.iter_mut().zip(own).for_each(|(sum, own)| *sum += own);
        }
        sums
    }

    /// Matrices of the element in one plane (equation 3).
    pub fn matrices(&self) -> Matrices {
        let length = self.length;
        // M₀ and Q are measured in this bending stiffness, so that all coefficients have the size of the length.
        let unit = 1.0 / self.cross(0.5 * length).bending;
        let [a1, a2, b1, b2, c] = self.integrals(length, unit);
        // θ(l) = θ₀ + M₀ a₁ - Q a₂ and w(l) = w₀ + θ₀ l + M₀ b₁ - Q (b₂ - c), solved for M₀ and Q.
        let (e, f) = (-a2, c - b2);
        let determinant = a1 * f - e * b1;
        let right = [[0.0, -1.0, 0.0, 1.0], [-1.0, -length, 1.0, 0.0]];
        let moment: [f64; 4] = std::array::from_fn(|j| (f * right[0][j] - e * right[1][j]) / determinant);
        let force: [f64; 4] = std::array::from_fn(|j| (a1 * right[1][j] - b1 * right[0][j]) / determinant);
        let mut to = Matrices {
            mass: Plane::default(),
            gyroscopic: Plane::default(),
            stiffness: Plane::default(),
            elastic: Plane::default(),
        };
        for (s, weight) in gauss(length) {
            let Cross { area, second_moment, bending, shear } = self.cross(s);
            let [a1, a2, b1, b2, c] = self.integrals(s, unit);
            let start = |j: usize, which: usize| if j == which { 1.0 } else { 0.0 };
            let slope: [f64; 4] = std::array::from_fn(|j| start(j, 1) + a1 * moment[j] - a2 * force[j]);
            let deflection: [f64; 4] =
                std::array::from_fn(|j| start(j, 0) + s * start(j, 1) + b1 * moment[j] + (c - b2) * force[j]);
            let bent: [f64; 4] = std::array::from_fn(|j| unit * (moment[j] - s * force[j]));
            let sheared: [f64; 4] = std::array::from_fn(|j| unit * force[j]);
            let inclined: [f64; 4] = std::array::from_fn(|j| slope[j] + shear * sheared[j]);
            add(&mut to.mass, weight * self.density * area, &deflection);
            if self.rotary_inertia {
                add(&mut to.mass, weight * self.density * second_moment, &slope);
            }
            if self.gyroscopic {
                add(&mut to.gyroscopic, 2.0 * weight * self.density * second_moment, &slope);
            }
            add(&mut to.elastic, weight * bending, &bent);
            add(&mut to.elastic, weight * shear, &sheared);
            add(&mut to.stiffness, weight * self.axial, &inclined);
        }
        for (row, elastic) in to.stiffness.iter_mut().zip(&to.elastic) {
            row.iter_mut().zip(elastic).for_each(|(k, own)| *k += own);
        }
        to
    }
}

/// Adds `factor` v vᵀ.
fn add(to: &mut Plane, factor: f64, v: &[f64; 4]) {
    for (row, x) in to.iter_mut().zip(v) {
        row.iter_mut().zip(v).for_each(|(entry, y)| *entry += factor * x * y);
    }
}

/// Gauss points and weights on the interval from 0 to `end`.
fn gauss(end: f64) -> [(f64, f64); POINTS] {
    let n = POINTS as f64;
    std::array::from_fn(|k| {
        let mut x = (PI * (k as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (mut p, mut before) = (1.0, 0.0);
            for j in 0..POINTS {
                let j = j as f64;
                (p, before) = (((2.0 * j + 1.0) * x * p - j * before) / (j + 1.0), p);
            }
            slope = n * (x * p - before) / (x * x - 1.0);
            let step = p / slope;
            x -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        (0.5 * end * (1.0 - x), end / ((1.0 - x * x) * slope * slope))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steel(length: f64, outer: [f64; 2], inner: [f64; 2]) -> Section {
        Section {
            length,
            outer,
            inner,
            young: 211e9,
            shear: 81.2e9,
            density: 7810.0,
            axial: 0.0,
            shear_deformation: true,
            rotary_inertia: true,
            gyroscopic: true,
            internal: 0.0,
        }
    }

    /// Closed form of the cylinder: 12 EI/(l³ (1 + Φ)), Φ = 12 EI/(κ G A l²).
    #[test]
    fn the_stiffness_of_a_cylinder_is_the_closed_form() {
        let (l, d) = (0.25, 0.05);
        let k = steel(l, [d; 2], [0.0; 2]).matrices().stiffness;
        let (ei, area) = (211e9 * PI * d.powi(4) / 64.0, PI * d * d / 4.0);
        let nu = 211.0 / 162.4 - 1.0;
        let kappa = 6.0 * (1.0 + nu) / (7.0 + 6.0 * nu);
        let phi = 12.0 * ei / (kappa * 81.2e9 * area * l * l);
        let unit = ei / (l.powi(3) * (1.0 + phi));
        let expected = [[12.0, 6.0 * l, -12.0, 6.0 * l], [6.0 * l, (4.0 + phi) * l * l, -6.0 * l, (2.0 - phi) * l * l]];
        for i in 0..2 {
            for j in 0..4 {
                assert!((k[i][j] - unit * expected[i][j]).abs() < 1e-12 * 12.0 * unit, "{i} {j}");
            }
        }
    }

    /// Rigid motions have the kinetic energy of a rigid body and no strain energy, for a hollow cone too.
    #[test]
    fn rigid_motions_of_a_cone_have_the_energy_of_a_rigid_body() {
        let cone = steel(0.4, [0.06, 0.09], [0.02, 0.03]);
        let Matrices { mass, stiffness, .. } = cone.matrices();
        let energy =
            |a: &Plane, v: [f64; 4]| (0..4).map(|i| (0..4).map(|j| v[i] * a[i][j] * v[j]).sum::<f64>()).sum::<f64>();
        let total: f64 = cone.mass();
        // Frustum minus frustum.
        let frustum = |a: f64, b: f64| PI / 12.0 * 0.4 * (a * a + a * b + b * b);
        assert!((total / (7810.0 * (frustum(0.06, 0.09) - frustum(0.02, 0.03))) - 1.0).abs() < 1e-13);
        assert!((energy(&mass, [1.0, 0.0, 1.0, 0.0]) / total - 1.0).abs() < 1e-11);
        for v in [[1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.4, 1.0]] {
            assert!(energy(&stiffness, v).abs() < 1e-9 * stiffness[0][0], "{v:?}");
        }
    }

    /// One conical element has the static flexibility of many short cylinders.
    #[test]
    fn a_cone_is_as_stiff_as_many_short_cylinders() {
        let cone = steel(0.5, [0.05, 0.08], [0.0, 0.0]);
        let k = cone.matrices().stiffness;
        // Tip deflection of the cantilever clamped at the left under a unit force at the right end.
        let det = k[2][2] * k[3][3] - k[2][3] * k[3][2];
        let tip = k[3][3] / det;
        let steps = 4000;
        let h = 0.5 / steps as f64;
        let mut expected = 0.0;
        for i in 0..steps {
            let s = (i as f64 + 0.5) * h;
            let own = cone.cross(s);
            expected += h * ((0.5 - s).powi(2) * own.bending + own.shear);
        }
        assert!((tip / expected - 1.0).abs() < 1e-6, "{tip} {expected}");
    }
}
