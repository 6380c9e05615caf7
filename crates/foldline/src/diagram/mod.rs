//! Results as plain data: points, special points, branches, diagrams.

mod conservative;
mod cycle;
mod design;
mod mapped;
mod number;
mod record;
mod response;
mod share;
mod symmetry;
mod torus;

pub use cycle::Cycle;
pub use design::{Answer, Binds, Design};
pub use mapped::{CellAnswer, CellValue, CellValues, MapCell};
pub use number::Shown;
pub use record::{Misfit, Record};
pub use response::{Motion, Recognition, Response, Responses, Search};
pub use share::Share;
pub use symmetry::Symmetry;
pub use torus::Torus;

use num_complex::Complex64;
use std::fmt;
use std::sync::Arc;

/// Boundaries of mesh intervals in normalised time, from 0 to 1; empty where there is no mesh.
pub type Mesh = Arc<[f64]>;

/// A solution of the model.
#[derive(Clone, Debug, PartialEq)]
pub enum Solution {
    /// f(x, p) = 0: the state `[n]`.
    Equilibrium(Vec<f64>),
    /// A periodic orbit.
    Cycle(Cycle),
    /// A two-dimensional invariant torus.
    Torus(Torus),
}

/// Scales and periods for the comparison of solutions.
#[derive(Clone, Copy, Debug)]
pub struct Measure<'a> {
    /// `[n]` characteristic sizes of the states.
    pub scales: &'a [f64],
    /// `[n]` periods of the states that are angles; see [`crate::contract::VectorField::periods`].
    pub periods: &'a [f64],
}

impl Solution {
    /// False for a cycle whose profile was not kept.
    pub fn is_stored(&self) -> bool {
        match self {
            Solution::Cycle(cycle) => !cycle.profile.is_empty(),
            Solution::Torus(torus) => !torus.profile.is_empty(),
            Solution::Equilibrium(_) => true,
        }
    }

    /// Gain of each state over a period; empty if no angle turns.
    pub fn gain(&self) -> &[f64] {
        match self {
            Solution::Cycle(cycle) => &cycle.gain,
            Solution::Equilibrium(_) | Solution::Torus(_) => &[],
        }
    }

    /// Number of turns over a cycle, with sign, of a state that is an angle of that period; 0 for an equilibrium.
    pub fn turns(&self, state: usize, period: f64) -> i64 {
        self.gain().get(state).map_or(0, |gain| (gain / period).round() as i64)
    }

    /// True if angles turn as often as those of the image of `other` under a symmetry.
    fn turns_like(&self, other: &Solution, symmetry: &Symmetry) -> bool {
        let (own, theirs) = (self.gain(), other.gain());
        let of = |gain: &[f64], i: usize| gain.get(i).copied().unwrap_or(0.0);
        (0..own.len().max(theirs.len())).all(|i| {
            let (from, negated) = symmetry.image(i);
            let theirs = if negated { -of(theirs, from) } else { of(theirs, from) };
            (of(own, i) - theirs).abs() <= 1e-9 * theirs.abs()
        })
    }

    /// Period of a cycle, or the first period of a torus.
    pub fn period(&self) -> Option<f64> {
        match self {
            Solution::Equilibrium(_) => None,
            Solution::Cycle(cycle) => Some(cycle.period),
            Solution::Torus(torus) => Some(torus.period),
        }
    }

    /// True for a cycle of a map.
    pub fn is_of_map(&self) -> bool {
        matches!(self, Solution::Cycle(cycle) if cycle.degree == 0)
    }

    /// Mesh of a cycle; empty for an equilibrium.
    pub fn mesh(&self) -> Mesh {
        match self {
            Solution::Equilibrium(_) => Mesh::default(),
            Solution::Cycle(cycle) => cycle.mesh.clone(),
            Solution::Torus(torus) => torus.mesh.clone(),
        }
    }

    /// Period of a cycle, unless a forcing prescribes it.
    pub fn free_period(&self) -> Option<f64> {
        self.period().filter(|_| self.forcing_periods() == 0)
    }

    /// Number of forcing periods in one period of a cycle; 0 without forcing.
    pub fn forcing_periods(&self) -> u32 {
        match self {
            Solution::Equilibrium(_) => 0,
            Solution::Cycle(cycle) => cycle.forcing_periods,
            Solution::Torus(torus) => torus.forcing_periods,
        }
    }
}

/// Accuracy of a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Trust {
    /// Estimated discretisation error of the profile, relative to scale + max |component|; 0 for equilibria.
    pub discretisation: f64,
    /// max |F(u)| after the last Newton step, relative.
    pub residual: f64,
    /// |μ₁ - 1| of the trivial multiplier; 0 for equilibria and forced cycles.
    pub trivial_defect: f64,
    /// |log ∏μ - ∫ tr J dt|; 0 for equilibria.
    pub liouville_defect: f64,
    /// Estimated error of the eigenvalues or multipliers, relative to the larger of 1 and their modulus; NaN if it was
    /// not estimated.
    pub spectrum: f64,
    /// Possible rounding error of the slope dλ/ds if above [`STANDS`], as for a parameter that hardly enters f.
    pub slope: f64,
}

/// Work done for a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Newton iterations, rejected attempts included.
    pub newton: usize,
    /// Matrices factorised.
    pub factorisations: usize,
    /// Steps tried and rejected before this point was accepted.
    pub rejected: usize,
    /// Points (states with parameters) at which f was evaluated without its derivatives: a residual on N intervals of
    /// degree m takes N m of them.
    pub evaluations: usize,
    /// Points at which derivatives of f were evaluated.
    pub linearisations: usize,
}

impl std::ops::AddAssign for Cost {
    fn add_assign(&mut self, other: Cost) {
        self.newton += other.newton;
        self.factorisations += other.factorisations;
        self.rejected += other.rejected;
        self.evaluations += other.evaluations;
        self.linearisations += other.linearisations;
    }
}

/// A computed point of a branch.
#[derive(Clone, Debug)]
pub struct Point {
    /// Position on the branch: 0 at the start, increasing forwards and decreasing backwards.
    pub position: i64,
    /// Value of every parameter of the model.
    pub parameters: Vec<f64>,
    /// The solution itself.
    pub solution: Solution,
    /// Unit tangent of the branch towards increasing position, in the layout of the unknowns; the last component is the
    /// change of the parameter relative to its scale ([`Branch::units`]).
    pub tangent: Vec<f64>,
    /// Arclength step to be tried next towards larger |position|.
    pub step: f64,
    /// Eigenvalues (equilibrium) or Floquet multipliers (cycle; the trivial one first unless it is forced).
    pub spectrum: Vec<Complex64>,
    /// Number of unstable eigenvalues or multipliers.
    pub unstable: usize,
    /// Smallest and largest value of every state, then of every output.
    pub ranges: Vec<[f64; 2]>,
    /// Mean and mean square over the cycle of every state, then of every output; empty if the file has none.
    pub averages: Vec<[f64; 2]>,
    /// Accuracy of the point.
    pub trust: Trust,
    /// Work done since the previous point.
    pub cost: Cost,
}

impl Point {
    /// The non-trivial part of the spectrum: all eigenvalues, all multipliers of a forced cycle, or those after the
    /// trivial one.
    pub fn free_spectrum(&self) -> &[Complex64] {
        match &self.solution {
            Solution::Cycle(cycle) if cycle.forcing_periods == 0 => self.spectrum.get(1..).unwrap_or(&[]),
            // Perturbations along the torus.
            Solution::Torus(torus) => {
                self.spectrum.get(if torus.forcing_periods == 0 { 2 } else { 1 }..).unwrap_or(&[])
            }
            _ => &self.spectrum,
        }
    }

    /// Significant error of the multipliers: the larger of the two defects. Liouville's is a relative error of
    /// their product; if the smallest multiplier is so small that its digits do not matter, neither do those of the
    /// product.
    pub fn multiplier_defect(&self) -> f64 {
        const SMALL: f64 = 1e-3;
        let smallest = self.free_spectrum().iter().fold(SMALL, |m, z| m.min(z.norm()));
        self.trust.trivial_defect.max(self.trust.liouville_defect * smallest / SMALL)
    }

    /// True for a cycle of a family at a single parameter value (a vertical branch), as in a conservative system or one
    /// that is linear up to some amplitude: the parameter does not change along the branch, and a second multiplier is
    /// 1 within its error. The side of 1 on which that multiplier is computed is not significant.
    pub fn is_one_of_family(&self) -> bool {
        let stands = self.parameter_slope().abs() < STANDS.max(self.trust.slope);
        self.solution.period().is_some() && stands && self.neutral_multiplier().is_some()
    }

    /// Distance from 1 within which a multiplier may be exactly 1.
    pub(crate) fn neutral_error(&self) -> f64 {
        /// Multiple of the stated error: a factor of safety, since a multiplier at a double eigenvalue 1 is less
        /// accurate than others.
        const ERRORS: f64 = 10.0;
        let stated = if self.trust.spectrum.is_nan() { 0.0 } else { self.trust.spectrum };
        ERRORS * stated.max(self.trust.trivial_defect)
    }

    /// Returns the non-trivial multiplier closest to 1, if it is 1 within its error.
    pub(crate) fn neutral_multiplier(&self) -> Option<Complex64> {
        let distance = |z: &Complex64| (z - 1.0).norm();
        let closest = self.free_spectrum().iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        (distance(closest) <= self.neutral_error()).then_some(*closest)
    }

    /// Number of unstable multipliers, without one that is 1 within its error and, on a vertical branch, without all
    /// that are on the unit circle within their errors: in a conservative system they stay there, and the computed side
    /// is meaningless.
    pub(crate) fn unstable_besides_neutral(&self) -> usize {
        /// Error of the multipliers above which their distance from the unit circle is meaningless, as near an infinite
        /// period. The second value applies where reciprocal pairs show that the system is conservative, which requires
        /// an error well below 1.
        const UNKNOWN: [f64; 2] = [1e-3, 0.1];
        let error = self.neutral_error();
        let known = error < UNKNOWN[0] || error < UNKNOWN[1] && self.is_conservative();
        let circle = if known && self.is_one_of_family() { error } else { 0.0 };
        let own = usize::from(self.neutral_multiplier().is_some_and(|z| z.norm() > 1.0 + circle));
        self.free_spectrum().iter().filter(|z| z.norm() > 1.0 + circle).count() - own
    }

    /// True if the multipliers come in reciprocal pairs, as in a conservative system: besides the one that is 1, two
    /// have the product 1 within their errors.
    pub(crate) fn is_conservative(&self) -> bool {
        let Some(neutral) = self.neutral_multiplier() else { return false };
        let mut rest = self.free_spectrum().to_vec();
        if let Some(own) = rest.iter().position(|z| *z == neutral) {
            rest.remove(own);
        }
        let reciprocal =
            |a: &Complex64, b: &Complex64| (a * b - 1.0).norm() <= self.neutral_error() * (a.norm() + b.norm());
        (0..rest.len()).any(|i| rest[i + 1..].iter().any(|other| reciprocal(&rest[i], other)))
    }

    /// Returns the largest difference between two points in their periods, relative to the period, and in the ranges of
    /// their states, relative to scale plus size. Outputs do not count: they follow from the states, and one that is a
    /// small difference (the force of a contact that has just begun) is less accurate than they are. The other point is seen
    /// under `symmetry`. Infinite between an equilibrium and a cycle, or if angles turn differently.
    pub fn difference(&self, other: &Point, measure: Measure, symmetry: &Symmetry) -> f64 {
        let Measure { scales, periods } = measure;
        if !self.solution.turns_like(&other.solution, symmetry) {
            return f64::INFINITY;
        }
        let mut largest: f64 = match (self.solution.period(), other.solution.period()) {
            (Some(a), Some(b)) => ((a - b) / a.abs().max(b.abs())).abs(),
            (None, None) => 0.0,
            _ => return f64::INFINITY,
        };
        for (i, (a, scale)) in self.ranges.iter().take(other.ranges.len()).zip(scales).enumerate() {
            let mut b = symmetry.range(&other.ranges, i);
            if let Some(period) = periods.get(i).filter(|period| period.is_finite()) {
                let copies = period * (0.5 * (a[0] + a[1] - b[0] - b[1]) / period).round();
                b = b.map(|b| b + copies);
            }
            let size = a[0].abs().max(a[1].abs()).max(b[0].abs()).max(b[1].abs());
            let scale = scale + size;
            largest = largest.max((a[0] - b[0]).abs() / scale).max((a[1] - b[1]).abs() / scale);
        }
        largest
    }

    /// Returns [`Point::difference`] from the other point as it is.
    pub fn distance(&self, other: &Point, measure: Measure) -> f64 {
        self.difference(other, measure, &Symmetry::identity())
    }

    /// Drops the profile and mesh of a cycle and the tangent, which make up nearly all of a point.
    pub fn lighten(&mut self) {
        let (mesh, profile) = match &mut self.solution {
            Solution::Equilibrium(_) => return,
            Solution::Cycle(cycle) => (&mut cycle.mesh, &mut cycle.profile),
            Solution::Torus(torus) => (&mut torus.mesh, &mut torus.profile),
        };
        (*mesh, *profile) = (Vec::new().into(), Vec::new());
        self.tangent = Vec::new();
    }

    /// True if profile and tangent were dropped.
    pub fn is_light(&self) -> bool {
        !self.solution.is_stored()
    }

    /// Component of the tangent along the continuation parameter, relative to the scale of the parameter.
    pub fn parameter_slope(&self) -> f64 {
        self.tangent.last().copied().unwrap_or(0.0)
    }
}

/// Slope dλ/ds, λ relative to the scale of the parameter, below which the parameter is constant along a branch up to
/// rounding. Order of magnitude: the machine precision times a condition number of 1e7.
pub(crate) const STANDS: f64 = 1e-9;
/// Beginning of the remark that states the dimension of a null space.
pub(crate) const NULL_SPACE: &str = "the null space has dimension ";
/// Slope below which branch points cannot be distinguished from folds, and a branch may be vertical.
pub(crate) const FLAT: f64 = 1e-6;

/// Type of a special point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Kind {
    /// The branch turns back in its parameter (limit point, saddle-node).
    Fold,
    /// Another branch of the same type crosses.
    BranchPoint,
    /// A pair of eigenvalues crosses the imaginary axis.
    Hopf,
    /// A multiplier passes -1.
    PeriodDoubling,
    /// A complex pair of multipliers crosses the unit circle (Neimark–Sacker).
    Torus,
    /// On a curve of folds: the quadratic coefficient of the normal form vanishes, and two folds meet.
    Cusp,
    /// A double eigenvalue 0: a curve of Hopf points ends on one of folds.
    BogdanovTakens,
    /// An eigenvalue 0 and a pair on the imaginary axis.
    ZeroHopf,
    /// On a curve of Hopf points: the first Lyapunov coefficient vanishes (Bautin).
    GeneralisedHopf,
    /// Two pairs of eigenvalues on the imaginary axis.
    DoubleHopf,
    /// On a curve of period doublings: the cubic coefficient of the normal form vanishes.
    GeneralisedPeriodDoubling,
    /// On a curve of torus points: the cubic coefficient of the normal form vanishes.
    Chenciner,
    /// A curve of torus points ends at a double multiplier 1.
    Resonance11,
    /// A double multiplier -1: a curve of torus points ends on one of period doublings.
    Resonance12,
    /// On a curve of torus points: the third power of the multipliers is 1.
    Resonance13,
    /// On a curve of torus points: the fourth power of the multipliers is 1.
    Resonance14,
    /// Multipliers 1 and -1.
    FoldFlip,
    /// A multiplier 1 and a pair on the unit circle.
    FoldTorus,
    /// A multiplier -1 and a pair on the unit circle.
    FlipTorus,
    /// Two pairs of multipliers on the unit circle.
    DoubleTorus,
    /// A cycle touches a switching surface of the vector field.
    Grazing,
    /// A cycle begins or ceases to slide along a switching surface of the vector field.
    Sliding,
    /// An event of a cycle, such as an impact, loses its speed, or a cycle touches the surface of an event without speed.
    ImpactGrazing,
    /// An equilibrium lies on a switching surface of the vector field.
    BoundaryEquilibrium,
    /// A quantity has a requested value.
    Mark,
    /// A quantity is largest or smallest along the branch.
    Peak,
    /// A stability change that no located special point explains.
    Unexplained,
    /// An orbit that leaves an equilibrium and returns to it; curves of such orbits only.
    Homoclinic,
    /// An orbit that leads from one equilibrium to another; curves of such orbits only.
    Heteroclinic,
    /// An orbit that leaves a saddle-node equilibrium and returns to it; curves of such orbits only.
    SaddleNodeHomoclinic,
    /// On a curve of connecting orbits: the leading eigenvalues on both sides of the imaginary axis have equal distances
    /// from it, so that the saddle quantity vanishes.
    NeutralSaddle,
    /// On a curve of connecting orbits: two leading eigenvalues meet and become complex (Belyakov).
    DoubleEigenvalue,
    /// On a curve of connecting orbits: a complex pair and a real eigenvalue are equally close to the imaginary axis.
    ThreeLeading,
    /// On a curve of connecting orbits: the orbit returns along the strong stable, or leaves along the strong unstable,
    /// manifold.
    OrbitFlip,
    /// On a curve of connecting orbits: an invariant manifold returns tangent to an exceptional direction.
    InclinationFlip,
    /// On a curve of connecting orbits: the equilibrium is a saddle-node, and the orbit returns along its strong stable, or leaves
    /// along its strong unstable, manifold.
    NonCentral,
    /// On a curve of homoclinic orbits: the equilibrium has a Hopf bifurcation (Shilnikov–Hopf).
    ShilnikovHopf,
}

impl Kind {
    /// Every kind, in the order in which tables list them.
    pub const ALL: [Kind; 37] = [
        Kind::Fold,
        Kind::BranchPoint,
        Kind::Hopf,
        Kind::PeriodDoubling,
        Kind::Torus,
        Kind::Cusp,
        Kind::BogdanovTakens,
        Kind::ZeroHopf,
        Kind::GeneralisedHopf,
        Kind::DoubleHopf,
        Kind::GeneralisedPeriodDoubling,
        Kind::Chenciner,
        Kind::Resonance11,
        Kind::Resonance12,
        Kind::Resonance13,
        Kind::Resonance14,
        Kind::FoldFlip,
        Kind::FoldTorus,
        Kind::FlipTorus,
        Kind::DoubleTorus,
        Kind::Grazing,
        Kind::Sliding,
        Kind::ImpactGrazing,
        Kind::BoundaryEquilibrium,
        Kind::Mark,
        Kind::Peak,
        Kind::Unexplained,
        Kind::Homoclinic,
        Kind::Heteroclinic,
        Kind::SaddleNodeHomoclinic,
        Kind::NeutralSaddle,
        Kind::DoubleEigenvalue,
        Kind::ThreeLeading,
        Kind::OrbitFlip,
        Kind::InclinationFlip,
        Kind::NonCentral,
        Kind::ShilnikovHopf,
    ];

    /// True for bifurcations of codimension two.
    pub fn has_codimension_two(self) -> bool {
        use Kind::{BoundaryEquilibrium, BranchPoint, Fold, Grazing, Hopf, Mark, PeriodDoubling, Torus, Unexplained};
        !matches!(self, Fold | BranchPoint | Hopf | PeriodDoubling | Torus | Mark | Unexplained)
            && !matches!(self, Grazing | BoundaryEquilibrium | Kind::Sliding | Kind::ImpactGrazing | Kind::Peak)
            && !matches!(self, Kind::Homoclinic | Kind::Heteroclinic | Kind::SaddleNodeHomoclinic)
    }

    /// Names of the coefficients of the normal form, as defined in [`crate::special::normal_form`] and
    /// [`crate::special::cycle_form`]; for a torus point the real part of d.
    pub fn coefficients(self) -> &'static [&'static str] {
        match self {
            Kind::Fold => &["a"],
            Kind::BranchPoint => &["a", "b", "c"],
            Kind::Hopf => &["l1"],
            Kind::PeriodDoubling => &["c"],
            Kind::Torus => &["d"],
            Kind::Cusp => &["c"],
            Kind::BogdanovTakens => &["a", "b"],
            Kind::GeneralisedHopf => &["l2"],
            Kind::ZeroHopf => &["s", "theta", "E"],
            Kind::DoubleHopf => &["p11", "p12", "p21", "p22", "theta", "delta"],
            _ => &[],
        }
    }

    /// The name used in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Fold => "fold",
            Kind::BranchPoint => "branch-point",
            Kind::Hopf => "hopf",
            Kind::PeriodDoubling => "period-doubling",
            Kind::Torus => "torus",
            Kind::Cusp => "cusp",
            Kind::BogdanovTakens => "bogdanov-takens",
            Kind::ZeroHopf => "zero-hopf",
            Kind::GeneralisedHopf => "generalised-hopf",
            Kind::DoubleHopf => "double-hopf",
            Kind::GeneralisedPeriodDoubling => "generalised-period-doubling",
            Kind::Chenciner => "chenciner",
            Kind::Resonance11 => "1:1-resonance",
            Kind::Resonance12 => "1:2-resonance",
            Kind::Resonance13 => "1:3-resonance",
            Kind::Resonance14 => "1:4-resonance",
            Kind::FoldFlip => "fold-flip",
            Kind::FoldTorus => "fold-torus",
            Kind::FlipTorus => "flip-torus",
            Kind::DoubleTorus => "double-torus",
            Kind::Grazing => "grazing",
            Kind::Sliding => "sliding",
            Kind::ImpactGrazing => "impact-grazing",
            Kind::BoundaryEquilibrium => "boundary-equilibrium",
            Kind::Mark => "mark",
            Kind::Peak => "peak",
            Kind::Unexplained => "unexplained",
            Kind::Homoclinic => "homoclinic",
            Kind::Heteroclinic => "heteroclinic",
            Kind::SaddleNodeHomoclinic => "saddle-node-homoclinic",
            Kind::NeutralSaddle => "neutral-saddle",
            Kind::DoubleEigenvalue => "double-eigenvalue",
            Kind::ThreeLeading => "three-leading-eigenvalues",
            Kind::OrbitFlip => "orbit-flip",
            Kind::InclinationFlip => "inclination-flip",
            Kind::NonCentral => "non-central-homoclinic",
            Kind::ShilnikovHopf => "shilnikov-hopf",
        }
    }

    /// The name in running text: "Hopf", "period doubling".
    pub fn title(self) -> &'static str {
        match self {
            Kind::BranchPoint => "branch point",
            Kind::Hopf => "Hopf",
            Kind::PeriodDoubling => "period doubling",
            Kind::BogdanovTakens => "Bogdanov–Takens",
            Kind::ZeroHopf => "zero-Hopf",
            Kind::GeneralisedHopf => "generalised Hopf",
            Kind::DoubleHopf => "double Hopf",
            Kind::GeneralisedPeriodDoubling => "generalised period doubling",
            Kind::Chenciner => "Chenciner",
            Kind::Resonance11 => "1:1 resonance",
            Kind::Resonance12 => "1:2 resonance",
            Kind::Resonance13 => "1:3 resonance",
            Kind::Resonance14 => "1:4 resonance",
            Kind::DoubleTorus => "double torus",
            Kind::ImpactGrazing => "impact grazing",
            Kind::BoundaryEquilibrium => "boundary equilibrium",
            Kind::NeutralSaddle => "neutral saddle",
            Kind::DoubleEigenvalue => "double eigenvalue",
            Kind::ThreeLeading => "three leading eigenvalues",
            Kind::OrbitFlip => "orbit flip",
            Kind::InclinationFlip => "inclination flip",
            Kind::SaddleNodeHomoclinic => "saddle-node homoclinic",
            Kind::NonCentral => "non-central homoclinic",
            Kind::ShilnikovHopf => "Shilnikov–Hopf",
            other => other.name(),
        }
    }

    /// The kind of that name.
    pub fn from_name(name: &str) -> Option<Kind> {
        Kind::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A located special point.
#[derive(Clone, Debug)]
pub struct SpecialPoint {
    /// Type of the point.
    pub kind: Kind,
    /// The point itself; its `position` is that of the accepted point just before it (towards smaller positions).
    pub point: Point,
    /// Number of unstable multipliers (eigenvalues) on the side of smaller positions.
    pub unstable_before: usize,
    /// Number of unstable multipliers (eigenvalues) on the side of larger positions.
    pub unstable_after: usize,
    /// Bound on the errors: of the parameter, relative to its scale ([`Branch::units`]) + |value|, and of the ranges of
    /// states, likewise; of the period, relative to its value; and of the ranges of outputs, relative to 1 + |value|.
    pub error: f64,
    /// Coefficients of the normal form, named by [`Kind::coefficients`]; empty if they are not known.
    pub coefficients: Vec<f64>,
    /// Bounds on the errors of the coefficients; empty in files of earlier versions.
    pub coefficient_errors: Vec<f64>,
    /// Reason why the coefficients are missing or inconclusive; otherwise empty.
    pub remark: String,
}

impl SpecialPoint {
    /// Dimension of the null space at a branch point: the number of eigenvalues 0 (multipliers 1). If some of them cross
    /// in opposite directions, the numbers of unstable ones do not show it and the remark does.
    pub fn kernel(&self) -> usize {
        let stated = self.remark.rsplit_once(NULL_SPACE).and_then(|(_, count)| count.parse().ok());
        stated.unwrap_or(1).max(self.unstable_before.abs_diff(self.unstable_after))
    }

    /// Returns coefficient `k` unless it is zero within its error.
    fn certain(&self, k: usize) -> Option<f64> {
        let error = self.coefficient_errors.get(k).copied().unwrap_or(0.0);
        self.coefficients.get(k).copied().filter(|value| value.abs() > error)
    }

    /// True if the point is supercritical (in the critical directions the bifurcating solutions are stable), false if
    /// subcritical; `None` if criticality does not apply to the kind or the deciding coefficient is zero within its
    /// error.
    fn is_supercritical(&self) -> Option<bool> {
        let decides = match (self.kind, self.coefficients.len()) {
            (Kind::Hopf | Kind::PeriodDoubling | Kind::Torus, 1) => 0,
            (Kind::BranchPoint, 3) => 2,
            _ => return None,
        };
        // At -1 the normal form of a map is -ξ + c ξ³.
        let reversed = self.kind == Kind::PeriodDoubling && self.point.solution.is_of_map();
        self.certain(decides).map(|value| (value < 0.0) != reversed)
    }

    /// `supercritical` or `subcritical` if that is known; `degenerate` if a required coefficient is zero within its
    /// error; `undetermined` if that error is as large as the terms of the coefficient.
    pub fn criticality(&self) -> Option<&'static str> {
        // Coefficients that must not vanish: a pitchfork has no quadratic term, and two oscillations may be uncoupled.
        let needed: &[usize] = match (self.kind, self.coefficients.len()) {
            (_, 0) => return None,
            (_, 1) => &[0],
            (_, 2) => &[0, 1],
            (Kind::DoubleHopf, _) => &[0, 3],
            _ => &[1, 2],
        };
        let vanishes = needed.iter().any(|k| self.certain(*k).is_none());
        match self.is_supercritical() {
            _ if vanishes && !self.remark.is_empty() => Some("undetermined"),
            _ if vanishes => Some("degenerate"),
            Some(true) => Some("supercritical"),
            Some(false) => Some("subcritical"),
            None => None,
        }
    }

    /// Case of the normal form: a branch point is transcritical or a pitchfork; a double Hopf point is simple if p₁₁
    /// and p₂₂ have the same sign, otherwise difficult.
    pub fn case(&self) -> Option<&'static str> {
        match (self.kind, self.coefficients.len()) {
            (Kind::BranchPoint, 2) => self.certain(0).map(|_| "transcritical"),
            (Kind::BranchPoint, 3) => Some("pitchfork"),
            (Kind::DoubleHopf, 4..) if self.certain(0)? * self.certain(3)? > 0.0 => Some("simple"),
            (Kind::DoubleHopf, 4..) => Some("difficult"),
            _ => None,
        }
    }

    /// Text of the coefficients, case, criticality and remark, such as `l1 = -0.0123, supercritical`. An error is shown
    /// if it affects the digits printed.
    pub fn normal_form(&self) -> String {
        let named = self.kind.coefficients().iter().zip(&self.coefficients).enumerate();
        let error = |k: usize| self.coefficient_errors.get(k).copied();
        let parts = named.map(|(k, (name, value))| format!("{name} = {}", shortly(*value, error(k))));
        let words = [self.case(), self.criticality(), Some(self.remark.as_str()).filter(|remark| !remark.is_empty())];
        parts.chain(words.into_iter().flatten().map(str::to_string)).collect::<Vec<_>>().join(", ")
    }
}

/// Five digits, with the error if the last digit is uncertain. A value that is zero within a small error prints as 0.
fn shortly(value: f64, error: Option<f64>) -> String {
    /// Error below which zero prints without it: half a unit in the last of five decimals.
    const SMALL: f64 = 5e-6;
    let error = error.unwrap_or(0.0);
    let value = if value.abs() <= error && error < SMALL { 0.0 } else { value };
    let fixed = value == 0.0 || (1e-3..1e4).contains(&value.abs());
    let text = if fixed { format!("{value:.5}") } else { format!("{value:.4e}") };
    let last = if fixed { 1e-5 } else { 1e-4 * 10f64.powf(value.abs().log10().floor()) };
    if error > 0.5 * last { format!("{text} ± {error:.0e}") } else { text }
}

/// Type of the solutions on a branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Family {
    /// Equilibria.
    Equilibrium,
    /// Cycles.
    Cycle,
    /// Solutions of a boundary-value problem.
    Arc,
    /// Tori.
    Torus,
}

impl Family {
    /// The name used in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Family::Equilibrium => "equilibrium",
            Family::Cycle => "cycle",
            Family::Arc => "arc",
            Family::Torus => "torus",
        }
    }
}

/// An orbit of infinite period.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Connection {
    /// Homoclinic orbit to a saddle.
    Homoclinic,
    /// Heteroclinic cycle between saddles.
    Heteroclinic,
    /// Homoclinic orbit to a saddle-node: saddle-node on an invariant circle.
    SaddleNode,
}

impl Connection {
    /// All kinds of connection.
    pub const ALL: [Connection; 3] = [Connection::Homoclinic, Connection::Heteroclinic, Connection::SaddleNode];

    /// The name used in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Connection::Homoclinic => "homoclinic",
            Connection::Heteroclinic => "heteroclinic",
            Connection::SaddleNode => "saddle-node-on-cycle",
        }
    }

    /// Returns the connection of that name.
    pub fn from_name(name: &str) -> Option<Connection> {
        Connection::ALL.into_iter().find(|connection| connection.name() == name)
    }
}

/// Reason why one side of a branch ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Ending {
    /// The parameter reached this bound of its range, or the stated target.
    Bound(f64),
    /// The branch returned to its start.
    Closed,
    /// The branch met the one from which it (or a branch of its type) bifurcates: a cycle shrank to an equilibrium, or
    /// became a cycle of half the period.
    Joined {
        /// `Hopf` (cycle became an equilibrium), `PeriodDoubling` (half the period), `BranchPoint`, or on a curve the point of
        /// codimension two at which it ends.
        at: Kind,
        /// Value of the continuation parameter there.
        parameter: f64,
    },
    /// The step size fell below its limit. Here and below, the text has three lines: what was tried, the likely cause,
    /// and what can be done.
    StepTooSmall(String),
    /// The mesh would need more intervals than allowed.
    MeshTooLarge(String),
    /// The period exceeded its limit, and no nearby equilibrium explains it.
    PeriodUnbounded(f64),
    /// The cycles approach an orbit of infinite period.
    Connecting {
        /// Kind of orbit.
        connection: Connection,
        /// Value of the continuation parameter at the limit.
        parameter: f64,
        /// Period of the last cycle.
        period: f64,
        /// States of the equilibria on the orbit.
        to: String,
    },
    /// A state grew without bound while the parameter approached a limit; the text names the likely cause.
    SolutionUnbounded(String),
    /// The limit on the number of points was reached.
    PointLimit(usize),
    /// f is not finite at the start of the branch or beyond its last point.
    NotFinite(String),
    /// The work limit was reached (one point or several in succession needed too many factorisations), or stability
    /// changed without explanation at several consecutive points.
    GivenUp(String),
    /// The branch could not be started.
    NoStart(String),
    /// A quantity reached the value at which the study asks to stop.
    Asked(f64),
    /// On a branch on which a largest value is held, another maximum of the cycle becomes the largest.
    HeldCorner(String),
    /// The observer asked to stop.
    Stopped,
}

impl Ending {
    /// A one-word code for files and tables.
    pub fn code(&self) -> &'static str {
        match self {
            Ending::Bound(_) => "bound",
            Ending::Closed => "closed",
            Ending::Joined { .. } => "joined",
            Ending::StepTooSmall(_) => "step-too-small",
            Ending::MeshTooLarge(_) => "mesh-too-large",
            Ending::PeriodUnbounded(_) => "period-unbounded",
            Ending::Connecting { connection, .. } => connection.name(),
            Ending::SolutionUnbounded(_) => "solution-unbounded",
            Ending::PointLimit(_) => "point-limit",
            Ending::NotFinite(_) => "not-finite",
            Ending::GivenUp(_) => "given-up",
            Ending::NoStart(_) => "no-start",
            Ending::Asked(_) => "asked",
            Ending::HeldCorner(_) => "held-corner",
            Ending::Stopped => "stopped",
        }
    }

    /// Returns the first line of the text.
    pub fn brief(&self) -> String {
        let text = self.to_string();
        text.lines().next().unwrap_or_default().to_string()
    }

    /// True if the branch is complete: it ended at a bound or stop, closed, joined another branch, or approached an
    /// orbit of infinite period.
    pub fn complete(&self) -> bool {
        use Ending::{Asked, Bound, Closed, Connecting, Joined};
        matches!(self, Bound(_) | Closed | Joined { .. } | Asked(_) | Connecting { .. })
    }
}

impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Ending::Bound(value) => write!(f, "reached {}", Shown(*value)),
            Ending::Asked(value) => write!(f, "stopped at the requested value {}", Shown(*value)),
            Ending::Closed => write!(f, "closed on itself"),
            Ending::Joined { at: Kind::Hopf, parameter } => {
                write!(f, "shrank to an equilibrium at {:.6}", Shown(*parameter))
            }
            Ending::Joined { at: Kind::PeriodDoubling, parameter } => {
                write!(f, "became a cycle of half the period at {:.6}", Shown(*parameter))
            }
            Ending::Joined { at: Kind::ImpactGrazing, parameter } => {
                write!(
                    f,
                    "ends at an impact grazing at {:.9}: beyond it the cycle has another sequence of impacts",
                    Shown(*parameter)
                )
            }
            Ending::Joined { at: Kind::BoundaryEquilibrium, parameter } => {
                write!(f, "ends at {:.9}, where the equilibrium reaches the surface of an event", Shown(*parameter))
            }
            Ending::Joined { at: Kind::NonCentral, parameter } => {
                write!(
                    f,
                    "ends at a non-central orbit homoclinic to a saddle-node at {:.9}, where curves of orbits homoclinic to saddles \
                     and to saddle-nodes meet",
                    Shown(*parameter)
                )
            }
            Ending::Joined { at, parameter } => write!(f, "joined another branch at {at} {:.6}", Shown(*parameter)),
            Ending::StepTooSmall(why) => write!(f, "step size too small: {why}"),
            Ending::MeshTooLarge(why) => write!(f, "mesh too large: {why}"),
            Ending::PeriodUnbounded(period) => {
                write!(
                    f,
                    "the period grew beyond its limit, to {:.4}, with no equilibrium near the cycle to explain \
                           it",
                    Shown(*period)
                )
            }
            Ending::Connecting { connection, parameter, period, to } => {
                let orbit = match connection {
                    Connection::Homoclinic => "an orbit homoclinic to the saddle",
                    Connection::Heteroclinic => "a heteroclinic cycle between the saddles",
                    Connection::SaddleNode => "an orbit homoclinic to the saddle-node",
                };
                write!(f, "approaches {orbit} {to} at {:.9}; last period {:.4}", Shown(*parameter), Shown(*period))
            }
            Ending::SolutionUnbounded(why) => write!(f, "solution unbounded: {why}"),
            Ending::PointLimit(points) => write!(f, "stopped at the limit of {points} points"),
            Ending::NotFinite(why) => write!(f, "vector field not finite: {why}"),
            Ending::GivenUp(why) => write!(f, "given up: {why}"),
            Ending::NoStart(why) => write!(f, "no starting solution: {why}"),
            Ending::HeldCorner(why) => write!(f, "corner of a held extreme value: {why}"),
            Ending::Stopped => write!(f, "stopped on request"),
        }
    }
}

/// Origin of a branch.
#[derive(Clone, Debug, PartialEq)]
pub enum Origin {
    /// A seed of the study, by name.
    Seed(String),
    /// The end of another branch.
    EndOf(String),
    /// A special point of another branch.
    Switch {
        /// Name of the parent branch.
        parent: String,
        /// Kind of the special point.
        kind: Kind,
        /// Value of the continuation parameter there.
        parameter: f64,
    },
}

/// A branch: a curve of solutions in one parameter, or a bifurcation curve in two.
#[derive(Clone, Debug)]
pub struct Branch {
    /// Name, unique within a diagram.
    pub name: String,
    /// Equilibria or cycles.
    pub family: Family,
    /// Index of the continuation parameter among the model's parameters.
    pub free: usize,
    /// For a bifurcation curve: the bifurcation, and the index of the first parameter, which is solved for.
    pub held: Option<(Kind, usize)>,
    /// On a branch with held quantities: further free parameters, which are solved for, with their scales. The
    /// components of the tangents that belong to them come before that of the continuation parameter.
    pub also: Vec<(usize, f64)>,
    /// On a branch with held quantities: the names of the quantities, and their values.
    pub levels: Vec<(String, f64)>,
    /// Scales of the first parameter of a bifurcation curve (otherwise 1) and of the continuation parameter. The last
    /// components of the tangents are changes of the parameters relative to these.
    pub units: [f64; 2],
    /// Origin.
    pub origin: Origin,
    /// Points by increasing position.
    pub points: Vec<Point>,
    /// Special points by increasing position.
    pub special: Vec<SpecialPoint>,
    /// Reasons why the backward and the forward side ended; `None` until then.
    pub ends: [Option<Ending>; 2],
}

impl Branch {
    /// Returns a value of the continuation parameter as shown in messages: 0 if it is smaller than any tolerance.
    pub fn rounded(&self, value: f64) -> f64 {
        if value.abs() < 1e-9 * self.units[1] { 0.0 } else { value }
    }

    /// Returns the first or the last point if its parameters, given by index, have these values, up to the rounding of
    /// a value at a bound: relative to the largest that the parameter has on the branch.
    pub fn end_at(&self, targets: &[(usize, f64)]) -> Option<&Point> {
        const ROUNDING: f64 = 1e-9;
        let value = |point: &Point, index: usize| point.parameters.get(index).copied().unwrap_or(f64::NAN);
        let there = |point: &&Point| {
            targets.iter().all(|(index, goal)| {
                let size = self.points.iter().fold(goal.abs(), |most, point| most.max(value(point, *index).abs()));
                (value(point, *index) - goal).abs() <= ROUNDING * size
            })
        };
        [self.points.first(), self.points.last()].into_iter().flatten().find(there)
    }

    /// Returns the size of a value of the continuation parameter: its scale + |value|. Errors are relative to it.
    pub fn size(&self, value: f64) -> f64 {
        self.units[1] + value.abs()
    }

    /// Returns an empty branch.
    pub fn new(name: impl Into<String>, family: Family, free: usize, origin: Origin) -> Branch {
        Branch {
            name: name.into(),
            family,
            free,
            held: None,
            also: Vec::new(),
            levels: Vec::new(),
            units: [1.0; 2],
            origin,
            points: Vec::new(),
            special: Vec::new(),
            ends: [None, None],
        }
    }

    /// Both parameters of a bifurcation curve: that of the branch on which it begins, then the second. `None` for a
    /// branch in one parameter.
    pub fn plane(&self) -> Option<[usize; 2]> {
        self.held.map(|(_, first)| [first, self.free])
    }

    /// True for a curve of orbits that connect equilibria; the spectra of its points are the eigenvalues at the
    /// equilibrium where the orbit begins.
    pub fn is_connecting(&self) -> bool {
        matches!(self.held, Some((Kind::Homoclinic | Kind::Heteroclinic | Kind::SaddleNodeHomoclinic, _)))
    }

    /// Inserts an accepted point at its position.
    pub fn insert(&mut self, point: Point) {
        let at = self.points.partition_point(|p| p.position < point.position);
        self.points.insert(at, point);
    }

    /// Drops all points but the start and the outermost two of each side, from which the branch can be continued.
    pub fn keep_ends(&mut self) {
        let (mut index, count) = (0, self.points.len());
        self.points.retain(|point| {
            index += 1;
            index <= 2 || index + 2 > count || point.position == 0
        });
    }

    /// Number of special points of the same kind found before this one at exactly the same point: pairs of eigenvalues
    /// that cross simultaneously.
    pub fn earlier_there(&self, special: &SpecialPoint) -> usize {
        let same = |other: &&SpecialPoint| {
            other.kind == special.kind
                && other.point.parameters == special.point.parameters
                // Images under a symmetry may have the same parameters to the last digit.
                && other.point.ranges == special.point.ranges
                && !std::ptr::eq(*other, special)
        };
        let own = self.special.iter().position(|other| std::ptr::eq(other, special));
        // Those of the backward side are in reverse order.
        let (first, last) = self.special.split_at(own.unwrap_or(self.special.len()));
        let earlier = if own.is_some() && special.point.position < 0 { last } else { first };
        earlier.iter().filter(same).count()
    }

    /// Number of special points of the same kind at exactly the same point, this one included: eigenvalues or multipliers
    /// that cross simultaneously.
    pub fn together_with(&self, special: &SpecialPoint) -> usize {
        let same = |other: &&SpecialPoint| {
            other.kind == special.kind
                && other.point.parameters == special.point.parameters
                && other.point.ranges == special.point.ranges
        };
        self.special.iter().filter(same).count().max(1)
    }

    /// Inserts a special point at its position.
    pub fn insert_special(&mut self, special: SpecialPoint) {
        // On the backward side the first one found comes last.
        let own = special.point.position;
        let at = self.special.partition_point(|s| s.point.position < own || own >= 0 && s.point.position == own);
        self.special.insert(at, special);
    }

    /// Returns the total work.
    pub fn cost(&self) -> Cost {
        let mut total = Cost::default();
        self.points.iter().for_each(|p| total += p.cost);
        total
    }
}

/// All branches of a study, in the order in which they were begun.
#[derive(Clone, Debug, Default)]
pub struct Diagram {
    /// The branches.
    pub branches: Vec<Branch>,
    /// Results of surveys and sweeps.
    pub responses: Vec<Responses>,
    /// Answers to design questions.
    pub designs: Vec<Design>,
    /// Cells of maps over parameters.
    pub cells: Vec<MapCell>,
    /// Requests that were not fulfilled, in addition to branches that ended short.
    pub shortfalls: Vec<Shortfall>,
}

/// A request that was not fulfilled.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Shortfall {
    /// Name of a branch, exploration or sweep.
    pub about: String,
    /// Text that says what was not reached, and why.
    pub what: String,
}

impl Diagram {
    /// Returns the branch of that name.
    pub fn branch(&self, name: &str) -> Option<&Branch> {
        self.branches.iter().find(|branch| branch.name == name)
    }

    /// Returns the answer to the design question of that name.
    pub fn design(&self, name: &str) -> Option<&Design> {
        self.designs.iter().find(|design| design.name == name)
    }

    /// Returns the responses of the survey or sweep of that name.
    pub fn response_set(&self, name: &str) -> Option<&Responses> {
        self.responses.iter().find(|set| set.name == name)
    }
}
