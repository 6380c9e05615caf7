//! Codimension-two points on bifurcation curves in two parameters.
//!
//! | on a curve of | kind | test function |
//! |---|---|---|
//! | folds | cusp | ⟨p, B(q, q)⟩, for maps as well; for cycles, tori and boundary-value problems the slope in the first parameter, where it vanishes with that in the second |
//! | branch points of equilibria | cusp | ⟨p, B(q, q)⟩, unless they are pitchforks throughout |
//! | folds, branch points of equilibria | Bogdanov–Takens | ⟨p, q⟩ |
//! | folds, branch points of equilibria | zero-Hopf | sums of two of the other eigenvalues |
//! | Hopf points | Bogdanov–Takens | the product of the critical pair: ω², negative where it is real |
//! | Hopf points | generalised Hopf | the first Lyapunov coefficient |
//! | Hopf points | zero-Hopf | the product of the other eigenvalues |
//! | Hopf points | double Hopf | sums of two of the others |
//! | period doublings | generalised period doubling | c of the normal form |
//! | torus points | Chenciner | Re d of the normal form |
//! | torus points | 1:1, 1:2 resonance | sin θ, which changes sign where e^{iθ} is 1 or -1 |
//! | torus points | 1:3, 1:4 resonance | cos θ + ½, cos θ |
//! | folds, torus points | 1:1 resonance, fold–torus | the product of the others minus 1 |
//! | period doublings, folds, torus points | fold–flip, 1:2 resonance, flip–torus | the product of the others minus 1, plus 1 |
//! | all curves of cycles | fold–torus, flip–torus, double torus | products of two of the others minus 1 |
//!
//! p and q have unit length and keep their orientation from the beginning of the step.
//!
//! **Source.** kuznetsov2004, §10.3 (equilibria), §9 (cycles).

use super::normal_form::{Local, units};
use super::{cycle_form, fold, map_form};
use crate::contract::{Monitor, VectorField};
use crate::diagram::{Ending, Family, Kind, Point, Solution};
use crate::linalg::dot;
use crate::problem::Setting;
use num_complex::Complex64;

/// Ratio of the quadratic to the cubic term, at states of their characteristic size, below which the quadratic one is
/// rounding.
const VANISHING: f64 = 1e-9;

/// |⟨p, q⟩| of unit vectors below which an eigenvalue 0 counts as double, given the accuracy of located points.
const DOUBLE: f64 = 1e-6;

/// Frequency, in rates of change near the equilibrium, below which a Hopf point has no first Lyapunov coefficient: the
/// rounding error of the coefficient grows with the inverse square of the frequency, to 2e-4 at this one.
const STILL: f64 = 1e-6;

/// Test function in one line of the table.
pub struct CodimensionTwo<'a> {
    field: &'a dyn VectorField,
    scales: &'a [f64],
    held: Kind,
    kind: Kind,
}

/// Monitors for a curve of bifurcation points of kind `held`; `scales` `[n]` are those of the states.
pub fn monitors<'a>(
    field: &'a dyn VectorField,
    scales: &'a [f64],
    family: Family,
    held: Kind,
) -> Vec<Box<dyn Monitor + 'a>> {
    use Kind::{
        BogdanovTakens, BranchPoint, Chenciner, Cusp, DoubleHopf, DoubleTorus, FlipTorus, Fold, FoldFlip, FoldTorus,
        GeneralisedHopf, GeneralisedPeriodDoubling, Hopf, PeriodDoubling, Resonance11, Resonance12, Resonance13,
        Resonance14, Torus, ZeroHopf,
    };
    let kinds: &[Kind] = match (family, held) {
        (Family::Equilibrium, Fold | BranchPoint) => &[Cusp, BogdanovTakens, ZeroHopf],
        (Family::Equilibrium, Hopf) => &[BogdanovTakens, GeneralisedHopf, ZeroHopf, DoubleHopf],
        (Family::Arc | Family::Torus, Fold) => &[Cusp],
        (Family::Cycle, Fold) => &[Cusp, Resonance11, FoldFlip, FoldTorus],
        (Family::Cycle, PeriodDoubling) => &[GeneralisedPeriodDoubling, Resonance12, FoldFlip, FlipTorus],
        (Family::Cycle, Torus) => {
            &[Resonance11, Resonance12, Resonance13, Resonance14, Chenciner, FoldTorus, FlipTorus, DoubleTorus]
        }
        _ => &[],
    };
    let monitor = |&kind: &Kind| Box::new(CodimensionTwo { field, scales, held, kind }) as Box<dyn Monitor + 'a>;
    // Normal forms of cycles with events are not computed, and their torus points end before strong resonances.
    let strong = |kind: &Kind| held == Torus && matches!(kind, Resonance11 | Resonance12);
    let formed = |kind: &&Kind| {
        field.event_count() == 0 || !(matches!(kind, GeneralisedPeriodDoubling | Chenciner) || strong(kind))
    };
    kinds.iter().filter(formed).map(monitor).collect()
}

impl CodimensionTwo<'_> {
    /// Units that suit the states near an equilibrium, and the largest rate of change there.
    fn units(&self, at: &Point) -> Option<(Vec<f64>, f64)> {
        let Solution::Equilibrium(state) = &at.solution else { return None };
        let sizes: Vec<f64> = state.iter().zip(self.scales).map(|(x, s)| x.abs() + s).collect();
        Some(units(self.field, state, &at.parameters, &sizes))
    }

    /// Equilibrium in units that suit `reference`.
    fn local<'p>(&'p self, reference: &Point, at: &'p Point) -> Option<Local<'p>> {
        Some(Local::new(self.field, at)?.in_units(&self.units(reference)?.0))
    }

    /// Null vectors at a point, oriented like those at `reference` and in units that suit it.
    fn oriented(&self, reference: &Point, at: &Point) -> Option<[Vec<f64>; 2]> {
        let before = self.local(reference, reference)?.null_vectors()?;
        self.local(reference, at)?.null_vectors_near(&before)
    }

    /// True unless the coefficient of a bifurcation of cycles is zero within its error at one of these points, as all along a
    /// curve on which it vanishes by the structure of the model: its sign there is one of rounding.
    fn is_significant(&self, ends: [&Point; 2]) -> bool {
        let setting = |at: &Point| {
            let axes = Vec::new();
            Setting { field: self.field, scales: self.scales, parameters: at.parameters.clone(), axes }
        };
        // Those of maps are positive where they vanish.
        self.field.iterated() || ends.into_iter().all(|end| cycle_form::is_significant(self.held, setting(end), end))
    }

    /// Critical part of the spectrum, then the rest.
    fn parts<'p>(&self, at: &'p Point) -> (&'p [Complex64], &'p [Complex64]) {
        let all = at.free_spectrum();
        let held = if matches!(self.held, Kind::Hopf | Kind::Torus) { 2 } else { 1 };
        all.split_at(held.min(all.len()))
    }

    /// Normal-form coefficient of the bifurcation of cycles that is continued.
    fn coefficient(&self, at: &Point) -> Option<f64> {
        let (field, scales, parameters) = (self.field, self.scales, at.parameters.clone());
        let setting = Setting { field, scales, parameters, axes: Vec::new() };
        if field.iterated() {
            return map_form::coefficient(self.held, &setting, at);
        }
        cycle_form::coefficient(self.held, setting, at)
    }

    fn tested(&self, reference: &Point, at: &Point) -> Option<f64> {
        let (held, rest) = self.parts(at);
        let of_cycle = at.solution.period().is_some();
        let product = |centre: f64| rest.iter().map(|z| (z - centre) / (1.0 + z.norm())).product::<Complex64>().re;
        let pairs = || (0..rest.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
        Some(match self.kind {
            Kind::Cusp if self.field.iterated() => {
                let parameters = at.parameters.clone();
                let setting = Setting { field: self.field, scales: self.scales, parameters, axes: Vec::new() };
                map_form::quadratic_near(&setting, reference, at)?
            }
            Kind::Cusp if of_cycle => fold::first_slope(at),
            Kind::Cusp => {
                // By symmetry the coefficient vanishes everywhere, up to rounding.
                if self.held == Kind::BranchPoint
                    && Local::new(self.field, reference)?.is_pitchfork(self.scales, VANISHING)?
                {
                    return None;
                }
                self.local(reference, at)?.quadratic(&self.oriented(reference, at)?)
            }
            Kind::BogdanovTakens if self.held != Kind::Hopf => {
                let [q, p] = self.oriented(reference, at)?;
                let own = dot(&p, &q);
                // In a conservative system the eigenvalue 0 is double all along the curve.
                let [q, p] = self.local(reference, reference)?.null_vectors()?;
                if own.abs().max(dot(&p, &q).abs()) < DOUBLE { DOUBLE } else { own }
            }
            Kind::BogdanovTakens => (held.first()? * held.get(1)?).re,
            Kind::GeneralisedHopf => {
                let omega = held.first()?.im.abs();
                if omega <= STILL * self.units(at)?.1 {
                    return None;
                }
                Local::new(self.field, at)?.hopf(omega)?
            }
            Kind::ZeroHopf if self.held == Kind::Hopf => rest.iter().product::<Complex64>().re,
            Kind::GeneralisedPeriodDoubling | Kind::Chenciner => self.coefficient(at)?,
            Kind::Resonance11 | Kind::Resonance12 if self.held == Kind::Torus => {
                let z = held.first()?;
                // The opposite end of the unit circle belongs to the other resonance.
                if (z.re > 0.0) != (self.kind == Kind::Resonance11) {
                    return None;
                }
                z.im
            }
            Kind::Resonance13 => held.first()?.re + 0.5,
            Kind::Resonance14 => held.first()?.re,
            Kind::Resonance11 => product(1.0),
            Kind::Resonance12 => product(-1.0),
            Kind::FoldFlip => product(if self.held == Kind::Fold { -1.0 } else { 1.0 }),
            Kind::FoldTorus if self.held == Kind::Torus => product(1.0),
            Kind::FlipTorus if self.held == Kind::Torus => product(-1.0),
            Kind::FoldTorus | Kind::FlipTorus | Kind::DoubleTorus => {
                let products = pairs().map(|(i, j)| rest[i] * rest[j]);
                products.map(|z| (z - 1.0) / (1.0 + z.norm())).product::<Complex64>().re
            }
            _ => {
                let sums = pairs().map(|(i, j)| (rest[i] + rest[j]) / (1e-300 + rest[i].norm() + rest[j].norm()));
                sums.product::<Complex64>().re
            }
        })
    }
}

impl CodimensionTwo<'_> {
    /// True if the eigenvalue 0 of an equilibrium is simple. ⟨p, B(q, q)⟩ also vanishes, with ⟨p, q⟩, where a fold and
    /// a branch point meet at a double eigenvalue 0.
    fn is_simple(&self, at: &Point) -> Option<bool> {
        let [q, p] = self.local(at, at)?.null_vectors()?;
        Some(dot(&p, &q).abs() > DOUBLE)
    }
}

impl Monitor for CodimensionTwo<'_> {
    fn kind(&self) -> Kind {
        self.kind
    }

    fn is_oriented(&self) -> bool {
        matches!(self.kind, Kind::Cusp | Kind::BogdanovTakens) && self.held != Kind::Hopf
    }

    fn value(&self, reference: &Point, at: &Point) -> f64 {
        self.tested(reference, at).unwrap_or(f64::NAN)
    }

    fn confirms(&self, at: &Point) -> bool {
        let (held, rest) = self.parts(at);
        let on_axis = |z: &Complex64| z.im != 0.0 && z.re.abs() < 1e-3 * z.im.abs();
        let on_circle = |z: &Complex64| z.im != 0.0 && z.norm().ln().abs() < 1e-3;
        match self.kind {
            // Two real eigenvalues with zero sum are not on the axis.
            Kind::ZeroHopf if self.held != Kind::Hopf => rest.iter().any(on_axis),
            Kind::ZeroHopf | Kind::GeneralisedHopf => held.iter().all(on_axis),
            Kind::Cusp if at.solution.period().is_none() => self.is_simple(at) == Some(true),
            Kind::DoubleHopf => rest.iter().any(on_axis) && held.iter().all(on_axis),
            Kind::FoldTorus | Kind::FlipTorus if self.held != Kind::Torus => rest.iter().any(on_circle),
            Kind::DoubleTorus => rest.iter().any(on_circle),
            _ => true,
        }
    }

    fn confirms_between(&self, ends: [&Point; 2], at: &Point) -> bool {
        let of_cycle = at.solution.period().is_some();
        if self.kind == Kind::Cusp && self.field.iterated() {
            let parameters = at.parameters.clone();
            let setting = Setting { field: self.field, scales: self.scales, parameters, axes: Vec::new() };
            return map_form::is_simple(&setting, at);
        }
        if self.kind == Kind::Cusp && of_cycle {
            return fold::parameters_rest(ends, at);
        }
        if matches!(self.kind, Kind::GeneralisedPeriodDoubling | Kind::Chenciner) {
            return self.is_significant(ends);
        }
        // In a conservative system the eigenvalue 0 is double all along the curve.
        let always_double = || ends.iter().all(|end| self.is_simple(end) == Some(false));
        self.confirms(at) || self.kind == Kind::Cusp && always_double()
    }

    fn jump(&self) -> usize {
        0
    }

    fn ending(&self, _at: &Point, parameter: f64) -> Option<Ending> {
        let ends = match self.held {
            Kind::Hopf => self.kind == Kind::BogdanovTakens,
            Kind::Torus => matches!(self.kind, Kind::Resonance11 | Kind::Resonance12),
            _ => false,
        };
        ends.then_some(Ending::Joined { at: self.kind, parameter })
    }
}
