//! Points that it takes two parameters to meet, on curves of folds or Hopf points of equilibria.
//!
//! | on a curve of | kind | test function |
//! |---|---|---|
//! | folds | cusp | ⟨p, B(q, q)⟩ |
//! | folds | Bogdanov–Takens | ⟨p, q⟩ |
//! | folds | zero-Hopf | sums of two of the other eigenvalues |
//! | Hopf points | Bogdanov–Takens | the product of the two held: ω², negative where they are real |
//! | Hopf points | generalised Hopf | the first Lyapunov coefficient |
//! | Hopf points | zero-Hopf | the product of the other eigenvalues |
//! | Hopf points | double Hopf | sums of two of the others |
//!
//! p and q are of unit length, and point the way that they did where the step began.
//!
//! **Source.** kuznetsov2004, §10.3.

use super::normal_form::Local;
use crate::contract::{Monitor, VectorField};
use crate::diagram::{Family, Kind, Point};
use crate::linalg::dot;
use num_complex::Complex64;

/// One line of the table.
pub struct CodimensionTwo<'a> {
    field: &'a dyn VectorField,
    held: Kind,
    kind: Kind,
}

/// What to look for along a curve on which a special point of that kind is held.
pub fn monitors<'a>(field: &'a dyn VectorField, family: Family, held: Kind) -> Vec<Box<dyn Monitor + 'a>> {
    use Kind::{BogdanovTakens, Cusp, DoubleHopf, Fold, GeneralisedHopf, Hopf, ZeroHopf};
    let kinds: &[Kind] = match (family, held) {
        (Family::Equilibrium, Fold) => &[Cusp, BogdanovTakens, ZeroHopf],
        (Family::Equilibrium, Hopf) => &[BogdanovTakens, GeneralisedHopf, ZeroHopf, DoubleHopf],
        _ => &[],
    };
    kinds.iter().map(|&kind| Box::new(CodimensionTwo { field, held, kind }) as Box<dyn Monitor + 'a>).collect()
}

impl CodimensionTwo<'_> {
    /// Null vectors at a point that point the way that those at `reference` do.
    fn oriented(&self, reference: &Point, at: &Point) -> Option<[Vec<f64>; 2]> {
        let before = Local::new(self.field, reference)?.null_vectors()?;
        Local::new(self.field, at)?.null_vectors_near(&before)
    }

    /// Of the spectrum, what is held, then the rest.
    fn parts(&self, at: &Point) -> (Vec<Complex64>, Vec<Complex64>) {
        let mut all = at.spectrum.clone();
        if self.held == Kind::Fold {
            all.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
            let rest = all.split_off(1.min(all.len()));
            return (all, rest);
        }
        // The two whose sum is least against their size.
        let balance = |i: usize, j: usize| (all[i] + all[j]).norm() / (1e-300 + all[i].norm() + all[j].norm());
        let pairs = (0..all.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
        let Some((i, j)) = pairs.min_by(|a, b| balance(a.0, a.1).total_cmp(&balance(b.0, b.1))) else {
            return (Vec::new(), all);
        };
        let held = vec![all[i], all[j]];
        all.remove(j);
        all.remove(i);
        (held, all)
    }

    fn tested(&self, reference: &Point, at: &Point) -> Option<f64> {
        let (held, rest) = self.parts(at);
        Some(match self.kind {
            Kind::Cusp => Local::new(self.field, at)?.quadratic(&self.oriented(reference, at)?),
            Kind::BogdanovTakens if self.held == Kind::Fold => {
                let [q, p] = self.oriented(reference, at)?;
                dot(&p, &q)
            }
            Kind::BogdanovTakens => (held.first()? * held.get(1)?).re,
            Kind::GeneralisedHopf => Local::new(self.field, at)?.hopf(held.first()?.im.abs())?,
            Kind::ZeroHopf if self.held == Kind::Hopf => rest.iter().product::<Complex64>().re,
            _ => {
                let pairs = (0..rest.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
                let sums = pairs.map(|(i, j)| (rest[i] + rest[j]) / (1e-300 + rest[i].norm() + rest[j].norm()));
                sums.product::<Complex64>().re
            }
        })
    }
}

impl Monitor for CodimensionTwo<'_> {
    fn kind(&self) -> Kind {
        self.kind
    }

    fn value(&self, reference: &Point, at: &Point) -> f64 {
        self.tested(reference, at).unwrap_or(f64::NAN)
    }

    fn confirms(&self, at: &Point) -> bool {
        let (held, rest) = self.parts(at);
        let on_axis = |z: &Complex64| z.im != 0.0 && z.re.abs() < 1e-3 * z.im.abs();
        match self.kind {
            // Two real eigenvalues with the sum 0 are none of these.
            Kind::ZeroHopf if self.held == Kind::Fold => rest.iter().any(on_axis),
            Kind::ZeroHopf | Kind::GeneralisedHopf => held.iter().all(on_axis),
            Kind::DoubleHopf => rest.iter().any(on_axis) && held.iter().all(on_axis),
            _ => true,
        }
    }

    fn jump(&self) -> usize {
        0
    }

    fn ends(&self) -> bool {
        self.held == Kind::Hopf && self.kind == Kind::BogdanovTakens
    }
}
