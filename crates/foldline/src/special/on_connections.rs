//! Special points on curves of connecting orbits.
//!
//! **Idea.** Most bifurcations of codimension two depend on the leading eigenvalues: those closest to the imaginary axis
//! on either side, at the equilibria where the orbit begins (unstable ones, λ_u) and ends (stable ones, λ_s).
//!
//! | kind | test function |
//! |---|---|
//! | neutral saddle | σ = Re λ_s + Re λ_u, the saddle quantity |
//! | double eigenvalue | the discriminant (λ_1 - λ_2)² of the two leading eigenvalues of one side |
//! | three leading eigenvalues | Re λ_1 - Re λ_3 of a leading pair and the next real one, or the other way round |
//! | non-central homoclinic | the leading eigenvalue, if it is real; for orbits homoclinic to a saddle-node ⟨p, x(T) - x_1⟩ of the left null vector p, with terms of second order |
//! | Shilnikov–Hopf | the smallest real part of a pair |
//! | orbit flip | ⟨p, x(T) - x_1⟩ of the leading left eigenvector p, at the end; likewise at the start |
//! | inclination flip | ⟨q, ψ(0)⟩ of the leading right eigenvector q and the adjoint solution ψ; likewise at the end |
//!
//! **Source.** champneys1996, §2 (list and test functions); kuznetsov2004, §6.4 (Shilnikov's condition).
//!
//! **Departures.** The discriminant in place of the difference of two real eigenvalues: it passes through zero.

pub mod limit;

use crate::contract::{Monitor, Sight, Turning, VectorField};
use crate::diagram::{Ending, Kind, Point, Solution};
use crate::linalg::dot;
use num_complex::Complex64;

/// Test function in one line of the table; `side` is 1 for the unstable eigenvalues at the start, -1 for the stable
/// ones at the end.
pub struct OnConnection<'a> {
    field: &'a dyn VectorField,
    kind: Kind,
    side: f64,
    /// True for orbits homoclinic to a saddle-node.
    node: bool,
}

/// Monitors for a curve of connecting orbits.
pub fn monitors<'a>(field: &'a dyn VectorField) -> Vec<Box<dyn Monitor + 'a>> {
    let both = [Kind::DoubleEigenvalue, Kind::ThreeLeading, Kind::NonCentral, Kind::ShilnikovHopf];
    let own =
        |kind: Kind, side: f64| Box::new(OnConnection { field, kind, side, node: false }) as Box<dyn Monitor + 'a>;
    let sides = both.into_iter().flat_map(|kind| [own(kind, 1.0), own(kind, -1.0)]);
    let flips = [Kind::OrbitFlip, Kind::InclinationFlip].into_iter();
    let flips = flips.flat_map(|kind| [own(kind, -1.0), own(kind, 1.0)]);
    std::iter::once(own(Kind::NeutralSaddle, 1.0)).chain(sides).chain(flips).collect()
}

/// Monitors for a curve of orbits homoclinic to saddle-nodes.
pub fn monitors_at_saddle_nodes<'a>(field: &'a dyn VectorField) -> Vec<Box<dyn Monitor + 'a>> {
    let own =
        |side: f64| Box::new(OnConnection { field, kind: Kind::NonCentral, side, node: true }) as Box<dyn Monitor + 'a>;
    vec![own(-1.0), own(1.0)]
}

/// Eigenvalues of one side of the imaginary axis by their distance from it, as positive real parts.
pub fn of_side(values: &[Complex64], side: f64) -> Vec<Complex64> {
    let mut own: Vec<Complex64> = values.iter().filter(|z| side * z.re > 0.0).map(|z| side * z).collect();
    own.sort_by(|a, b| a.re.total_cmp(&b.re));
    own
}

/// σ of a connecting orbit: Re λ_s at its end plus Re λ_u at its start.
pub fn saddle_quantity(field: &dyn VectorField, at: &Point) -> Option<f64> {
    let [start, end] = field.saddles(&at.parameters)?;
    Some(of_side(&start, 1.0).first()?.re - of_side(&end, -1.0).first()?.re)
}

/// Saddle quantity of a homoclinic orbit from the eigenvalues of its saddle.
pub fn quantity_of(values: &[Complex64]) -> Option<f64> {
    Some(of_side(values, 1.0).first()?.re - of_side(values, -1.0).first()?.re)
}

/// Text of an ending on a curve of connecting orbits, with the likely cause if an eigenvalue at `at` is close to the
/// imaginary axis.
///
/// At a saddle-node, another eigenvalue than 0 is meant.
pub fn at_bifurcation(at: &Point, why: String, node: bool) -> String {
    /// Ratio of the smallest to the largest distance from the axis. A factor of safety: the steps shorten as it
    /// decreases.
    const NEAR: f64 = 0.05;
    let sizes = at.spectrum.iter().map(|z| z.re.abs());
    let largest = sizes.fold(0.0, f64::max);
    let mut by_size: Vec<&Complex64> = at.spectrum.iter().collect();
    by_size.sort_by(|a, b| a.re.abs().total_cmp(&b.re.abs()));
    let close = by_size.get(usize::from(node));
    let Some(z) = close.filter(|z| z.re.abs() < NEAR * largest) else { return why };
    let first = why.lines().next().unwrap_or_default();
    let (value, what, cure) = match z.im == 0.0 {
        true if node => (
            format!("a second eigenvalue, {:.2e},", z.re),
            "the curve ends at a Bogdanov–Takens point",
            "follow the fold of the equilibria, on which this point lies",
        ),
        true => (
            format!("the eigenvalue {:.2e}", z.re),
            "the curve ends at an orbit homoclinic to a saddle-node",
            "follow the fold of the equilibria, on which such orbits lie",
        ),
        false => (
            format!("the pair of eigenvalues {:.2e} ± {:.2e} i", z.re, z.im.abs()),
            "the curve ends at a Shilnikov–Hopf point, where the equilibrium has a Hopf bifurcation",
            "follow the Hopf points of the equilibria",
        ),
    };
    format!(
        "{first}\nlikely cause: {value} of the equilibrium is close to the imaginary axis; {what}\nwhat to do: {cure}"
    )
}

/// Group of eigenvalues with one real part: 1 if it is real, 2 if it is a pair.
fn group(values: &[Complex64]) -> usize {
    if values.first().is_some_and(|z| z.im != 0.0) { 2 } else { 1 }
}

impl OnConnection<'_> {
    /// Eigenvalues of the side, at its end of the orbit, by their distances from the axis. They are told by their number, so that
    /// they are the same ones where the leading one crosses the axis.
    fn own(&self, at: &Point) -> Option<Vec<Complex64>> {
        let [start, end] = self.field.saddles(&at.parameters)?;
        let mut all = if self.side > 0.0 { start } else { end };
        all.sort_by(|a, b| (self.side * a.re).total_cmp(&(self.side * b.re)));
        let unstable = *at.parameters.last()? as usize;
        let count = if self.side > 0.0 { unstable } else { all.len().checked_sub(unstable)? };
        Some(all.split_off(all.len().checked_sub(count)?).into_iter().map(|z| self.side * z).collect())
    }

    /// Sum of the distances from the axis of the leading eigenvalues, that of the stable ones negative.
    fn quantity(&self, at: &Point) -> Option<f64> {
        let leading = |side: f64| Some(OnConnection { side, ..*self }.own(at)?.first()?.re);
        Some(leading(1.0)? - leading(-1.0)?)
    }

    /// Test function of a flip.
    fn turning(&self, at: &Point) -> Option<Turning> {
        let Solution::Cycle(orbit) = &at.solution else { return None };
        let later = if self.side > 0.0 { 1 } else { 0 };
        let first = if self.kind == Kind::InclinationFlip { 2 } else { 0 };
        self.field.flips(orbit, &at.parameters).into_iter().nth(first + later).flatten()
    }

    fn is_flip(&self) -> bool {
        self.node || matches!(self.kind, Kind::OrbitFlip | Kind::InclinationFlip)
    }

    fn tested(&self, at: &Point) -> Option<f64> {
        let own = self.own(at)?;
        match self.kind {
            Kind::NeutralSaddle => self.quantity(at),
            Kind::DoubleEigenvalue => {
                let gap = own.get(1)? - own.first()?;
                Some((gap * gap).re)
            }
            Kind::ThreeLeading => {
                // Positive if a real one leads a pair.
                let first = group(&own);
                let next = own.get(first..)?;
                let gap = next.first()?.re - own.first()?.re;
                match (first, group(next)) {
                    (1, 2) => Some(gap),
                    (2, 1) => Some(-gap),
                    _ => None,
                }
            }
            Kind::NonCentral => own.first().filter(|z| z.im == 0.0).map(|z| z.re),
            Kind::ShilnikovHopf => own.first().filter(|z| z.im != 0.0).map(|z| z.re),
            _ => None,
        }
    }
}

impl Monitor for OnConnection<'_> {
    fn kind(&self) -> Kind {
        self.kind
    }

    fn value(&self, reference: &Point, at: &Point) -> f64 {
        if !self.is_flip() {
            return self.tested(at).unwrap_or(f64::NAN);
        }
        let Some(known) = self.turning(reference) else { return f64::NAN };
        self.turning(at)
            .map_or(f64::NAN, |own| if dot(&own.refer, &known.refer) < 0.0 { -own.value } else { own.value })
    }

    fn confirms(&self, at: &Point) -> bool {
        // Test functions jump where the leading eigenvalues become others.
        const NEAR: f64 = 1e-4;
        if self.is_flip() {
            return self.turning(at).is_some();
        }
        let Some((own, value)) = self.own(at).zip(self.tested(at)) else { return false };
        let size = own.iter().fold(0.0, |m: f64, z| m.max(z.norm()));
        // The vanishing eigenvalue may be the only one of its side.
        let size = match self.kind {
            Kind::NonCentral | Kind::ShilnikovHopf => {
                self.field.saddles(&at.parameters).iter().flatten().flatten().fold(size, |m, z| m.max(z.norm()))
            }
            _ => size,
        };
        value.abs() < NEAR * size * if self.kind == Kind::DoubleEigenvalue { size } else { 1.0 }
    }

    // Where a test function vanishes along the whole curve, as the saddle quantity of a conservative model does, its signs are
    // those of rounding errors.
    fn confirms_between(&self, ends: [&Point; 2], at: &Point) -> bool {
        const ROUNDING: f64 = 1e-9;
        /// Largest ratio of the test function at its zero to that at the ends: it jumps where another eigenvalue takes the lead.
        const JUMPS: f64 = 0.01;
        if self.is_flip() {
            let size = |at: &Point| self.turning(at).map_or(f64::NAN, |own| own.value.abs());
            let [left, right] = [size(ends[0]), size(ends[1])];
            return size(at) < JUMPS * left.max(right) && size(at) < 0.5 * left.min(right);
        }
        let clear = |end: &&Point| {
            let Some((own, value)) = self.own(end).zip(self.tested(end)) else { return true };
            let size = own.iter().fold(0.0, |m: f64, z| m.max(z.norm()));
            value.abs() > ROUNDING * size
        };
        self.confirms(at) && ends.iter().any(clear)
    }

    fn reads(&self) -> Sight {
        Sight::Tangent
    }

    fn label(&self) -> usize {
        usize::from(self.side < 0.0)
    }

    fn jump(&self) -> usize {
        0
    }

    fn ending(&self, _at: &Point, parameter: f64) -> Option<Ending> {
        let ends = matches!(self.kind, Kind::NonCentral | Kind::ShilnikovHopf);
        ends.then_some(Ending::Joined { at: self.kind, parameter })
    }

    fn remark(&self, at: &Point, _forwards: bool) -> String {
        let Some([start, end]) = self.field.saddles(&at.parameters) else { return String::new() };
        let kinds = [of_side(&start, 1.0), of_side(&end, -1.0)].map(|own| group(&own));
        let side = if self.side > 0.0 { "unstable" } else { "stable" };
        match (self.kind, kinds) {
            (Kind::NeutralSaddle, [1, 1]) => "neutral saddle".into(),
            (Kind::NeutralSaddle, [2, 2]) => "neutral bi-focus".into(),
            (Kind::NeutralSaddle, _) => "neutral saddle-focus (Belyakov)".into(),
            (Kind::DoubleEigenvalue, _) => format!("of the {side} eigenvalues: from saddle to saddle-focus (Belyakov)"),
            (Kind::ThreeLeading, _) => format!("of the {side} eigenvalues"),
            (Kind::NonCentral, _) => {
                // On a curve of orbits homoclinic to saddles, the eigenvalue 0 is one of the other side.
                let leaves = (self.side > 0.0) == self.node;
                let how = if leaves { "leaves along the strong unstable" } else { "returns along the strong stable" };
                format!("{how} manifold of a saddle-node")
            }
            (Kind::OrbitFlip, _) if self.side > 0.0 => "leaves along the strong unstable manifold".into(),
            (Kind::OrbitFlip, _) => "returns along the strong stable manifold".into(),
            (Kind::InclinationFlip, _) => format!("of the {side} manifold"),
            _ => String::new(),
        }
    }
}
