//! Matrices of a rotor.
//!
//! **Idea.** Degrees of freedom come in pairs that rotate together: displacements (x, y) and rotations about these axes
//! (θx, θy) of each node of the shaft, and displacements of each support. Slopes are dx/dz = θy and dy/dz = -θx, with z
//! along the shaft and positive rotation from x to y.
//!
//! **Equations.** With n degrees of freedom, all matrices n × n, and J rotating each pair by a quarter turn:
//!
//! 1. M q̈ + (C + Cᵢ + ΩG) q̇ + (K - ΩCᵢJ) q = F
//! 2. C = α M + β Kₛ + M Φ diag(2ζω) Φᵀ M + bearings, Cᵢ internal damping, Kₛ stiffness of the shaft
//!
//! Coefficients that are expressions are not in the matrices; they are listed as [`Term`]s.

use crate::parts::{Coefficient, Rotor};
use foldline_general::{Mat, multiply, symmetric_eigenvectors};

/// Matrix to which a term belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Of {
    /// K.
    Stiffness,
    /// C.
    Damping,
}

/// Entry with a coefficient that is an expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    /// Its matrix.
    pub of: Of,
    /// Row.
    pub row: usize,
    /// Column.
    pub column: usize,
    /// Coefficient.
    pub coefficient: Coefficient,
}

/// Constant matrices of a rotor (equation 1), and terms with expressions.
#[derive(Clone, Debug)]
pub struct Assembly {
    /// M.
    pub mass: Mat<f64>,
    /// C without terms.
    pub damping: Mat<f64>,
    /// Cᵢ.
    pub internal: Mat<f64>,
    /// G.
    pub gyroscopic: Mat<f64>,
    /// K without terms.
    pub stiffness: Mat<f64>,
    /// Terms with expressions.
    pub terms: Vec<Term>,
}

/// Reason why a rotor cannot be assembled: message and cure.
pub type Refusal = [String; 2];

impl Assembly {
    /// Assembles a rotor.
    ///
    /// # Errors
    /// A mass matrix that is not positive definite, or modal damping that cannot be computed.
    pub fn new(rotor: &Rotor) -> Result<Assembly, Refusal> {
        let n = rotor.dofs();
        let zero = || Mat::<f64>::zeros(n, n);
        let mut to = Assembly {
            mass: zero(),
            damping: zero(),
            internal: zero(),
            gyroscopic: zero(),
            stiffness: zero(),
            terms: Vec::new(),
        };
        let mut shaft = zero();
        for element in &rotor.elements {
            to.element(rotor, element, &mut shaft);
        }
        if let Some(given) = &rotor.given {
            for (to, from) in [
                (&mut to.mass, &given.mass),
                (&mut to.damping, &given.damping),
                (&mut to.stiffness, &given.stiffness),
                (&mut to.gyroscopic, &given.gyroscopic),
            ] {
                for (i, row) in from.iter().enumerate() {
                    row.iter().enumerate().for_each(|(j, value)| to[(i, j)] += value);
                }
            }
        }
        for own in &rotor.masses {
            let first = rotor.first(own.at);
            (0..2).for_each(|i| to.mass[(first + i, first + i)] += own.mass);
        }
        for own in &rotor.discs {
            let first = rotor.first(own.at);
            for i in 0..2 {
                to.mass[(first + i, first + i)] += own.mass;
                to.mass[(first + 2 + i, first + 2 + i)] += own.diametral;
            }
            to.gyroscopic[(first + 2, first + 3)] += own.polar;
            to.gyroscopic[(first + 3, first + 2)] -= own.polar;
        }
        for i in 0..n {
            for j in 0..n {
                to.damping[(i, j)] += rotor.damping.mass * to.mass[(i, j)] + rotor.damping.stiffness * shaft[(i, j)];
            }
        }
        to.bearings(rotor);
        let matrices = [&to.mass, &to.damping, &to.internal, &to.gyroscopic, &to.stiffness];
        if matrices.into_iter().any(|own| !finite(own)) {
            let message = "the matrices of the rotor are not finite".to_string();
            return Err([
                message,
                "check lengths, diameters and material: a value is far too large or too small".into(),
            ]);
        }
        to.positive_mass(rotor)?;
        if !rotor.damping.modal.is_empty() {
            to.modal_damping(rotor)?;
        }
        Ok(to)
    }

    fn element(&mut self, rotor: &Rotor, element: &crate::parts::Element, shaft: &mut Mat<f64>) {
        let own = element.section.matrices();
        let (a, b) = (rotor.first(element.from), rotor.first(element.to));
        // Coordinates (w, slope) at both ends: x and θy in one plane, y and -θx in the other.
        let planes = [
            [(a, 1.0), (a + 3, 1.0), (b, 1.0), (b + 3, 1.0)],
            [(a + 1, 1.0), (a + 2, -1.0), (b + 1, 1.0), (b + 2, -1.0)],
        ];
        for plane in &planes {
            for (i, &(row, s)) in plane.iter().enumerate() {
                for (j, &(column, t)) in plane.iter().enumerate() {
                    let at = (row, column);
                    self.mass[at] += s * t * own.mass[i][j];
                    self.stiffness[at] += s * t * own.stiffness[i][j];
                    shaft[at] += s * t * own.stiffness[i][j];
                    self.internal[at] += s * t * element.section.internal * own.elastic[i][j];
                }
            }
        }
        for i in 0..4 {
            for j in 0..4 {
                let ((row, s), (column, t)) = (planes[0][i], planes[1][j]);
                self.gyroscopic[(row, column)] += s * t * own.gyroscopic[i][j];
                self.gyroscopic[(column, row)] -= s * t * own.gyroscopic[i][j];
            }
        }
    }

    fn bearings(&mut self, rotor: &Rotor) {
        for own in &rotor.bearings {
            let mut ends = vec![(rotor.first(own.at), 1.0)];
            ends.extend(own.to.map(|to| (rotor.first(to), -1.0)));
            for (of, block) in [(Of::Stiffness, &own.stiffness), (Of::Damping, &own.damping)] {
                for (i, line) in block.iter().enumerate() {
                    for (j, coefficient) in line.iter().enumerate().filter(|(_, own)| !own.is_zero()) {
                        for &(row, s) in &ends {
                            for &(column, t) in &ends {
                                self.entry(of, row + i, column + j, s * t, coefficient);
                            }
                        }
                    }
                }
            }
        }
    }

    fn entry(&mut self, of: Of, row: usize, column: usize, sign: f64, coefficient: &Coefficient) {
        let coefficient = Coefficient { factor: sign * coefficient.factor, text: coefficient.text.clone() };
        match (&coefficient.text, of) {
            (None, Of::Stiffness) => self.stiffness[(row, column)] += coefficient.factor,
            (None, Of::Damping) => self.damping[(row, column)] += coefficient.factor,
            (Some(_), _) => self.terms.push(Term { of, row, column, coefficient }),
        }
    }

    /// Refuses a mass matrix that is not positive definite, and names a degree of freedom without mass.
    fn positive_mass(&self, rotor: &Rotor) -> Result<(), Refusal> {
        let n = self.mass.nrows();
        for station in 0..rotor.stations.len() {
            let first = rotor.first(station);
            let count = if station < rotor.nodes { 4 } else { 2 };
            if (first..first + count).any(|i| self.mass[(i, i)] <= 0.0 || !self.mass[(i, i)].is_finite()) {
                let message = format!("{} has no mass", rotor.called(station));
                return Err([message, "give it a mass, as with `[[point-mass]]`, or leave it out".into()]);
            }
        }
        let scale: Vec<f64> = (0..n).map(|i| self.mass[(i, i)].sqrt()).collect();
        let scaled = Mat::from_fn(n, n, |i, j| self.mass[(i, j)] / (scale[i] * scale[j]));
        match symmetric_eigenvectors(scaled.as_ref()) {
            Some((values, _)) if values.first().is_some_and(|lowest| *lowest > 1e-13) => Ok(()),
            _ => Err(["the mass matrix is not positive definite".into(), "check masses and moments of inertia".into()]),
        }
    }

    /// Undamped modes at rest: angular frequencies, increasing, and mass-normalised shapes as columns. `None` if they
    /// could not be computed.
    pub fn modes_at_rest(&self) -> Option<(Vec<f64>, Mat<f64>)> {
        let n = self.mass.nrows();
        let scale: Vec<f64> = (0..n).map(|i| self.mass[(i, i)].sqrt()).collect();
        let scaled = Mat::from_fn(n, n, |i, j| self.mass[(i, j)] / (scale[i] * scale[j]));
        let (values, vectors) = symmetric_eigenvectors(scaled.as_ref())?;
        // M^{-1/2}, in scaled coordinates.
        let root = Mat::from_fn(n, n, |i, j| {
            (0..n).map(|k| vectors[(i, k)] * vectors[(j, k)] / values[k].sqrt()).sum::<f64>()
        });
        let stiffness =
            Mat::from_fn(n, n, |i, j| 0.5 * (self.stiffness[(i, j)] + self.stiffness[(j, i)]) / (scale[i] * scale[j]));
        let (mut half, mut whole) = (Mat::zeros(n, n), Mat::zeros(n, n));
        multiply(half.as_mut(), root.as_ref(), stiffness.as_ref());
        multiply(whole.as_mut(), half.as_ref(), root.as_ref());
        let (squares, shapes) = symmetric_eigenvectors(whole.as_ref())?;
        multiply(half.as_mut(), root.as_ref(), shapes.as_ref());
        let physical = Mat::from_fn(n, n, |i, j| half[(i, j)] / scale[i]);
        Some((squares.into_iter().map(|s| s.max(0.0).sqrt()).collect(), physical))
    }

    fn modal_damping(&mut self, rotor: &Rotor) -> Result<(), Refusal> {
        if self.terms.iter().any(|term| term.of == Of::Stiffness) {
            let message = "modal damping needs the modes at rest, but a stiffness is an expression".to_string();
            return Err([message, "give stiffnesses as numbers or [constants], or use proportional damping".into()]);
        }
        let Some((frequencies, shapes)) = self.modes_at_rest() else {
            return Err(["the modes at rest could not be computed".into(), "use proportional damping".into()]);
        };
        let n = frequencies.len();
        let Some(last) = rotor.damping.modal.last().copied() else { return Ok(()) };
        let rest = if rotor.damping.all { last } else { 0.0 };
        // At rest every frequency of an isotropic rotor occurs twice, once in each plane.
        let ratio = |k: usize| rotor.damping.modal.get(k / 2).copied().unwrap_or(rest);
        let momentum = foldline_general::product(&self.mass, &shapes);
        for i in 0..n {
            for j in 0..n {
                let sum = (0..n).map(|k| momentum[(i, k)] * 2.0 * ratio(k) * frequencies[k] * momentum[(j, k)]);
                self.damping[(i, j)] += sum.sum::<f64>();
            }
        }
        Ok(())
    }
}

/// True if all entries are finite.
pub(crate) fn finite(a: &Mat<f64>) -> bool {
    (0..a.ncols()).all(|j| (0..a.nrows()).all(|i| a[(i, j)].is_finite()))
}

/// A J: columns (2k, 2k + 1) become (column 2k + 1, -column 2k).
pub(crate) fn turned(a: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| if j % 2 == 0 { a[(i, j + 1)] } else { -a[(i, j - 1)] })
}
