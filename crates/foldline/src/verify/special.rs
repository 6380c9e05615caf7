//! Verification of the positions of special points.
//!
//! **Idea.** Solutions at four distances around the point, found by shooting, avoid the singularity there. The zero of
//! a cubic through the four values of the test function gives the parameter at the special point. If the cubic is not
//! smooth enough, the distances are reduced.
//!
//! **Equations.** Test functions along the branch, with μ the multiplier and λ' the component of the unit tangent:
//!
//! ```text
//!   fold              (1)  λ'
//!   branch point      (2)  μ - 1 of the non-trivial multiplier closest to 1; (1) on a branch that ends there
//!   period doubling   (3)  μ + 1 of the multiplier closest to -1
//!   torus             (4)  |μ| - 1 of the complex pair closest to the unit circle
//!   Hopf              (5)  Re of the complex pair of eigenvalues closest to the imaginary axis
//!   grazing           (6)  the extremum of the switch on orbits that do not meet its surface there
//! ```
//!
//! For equilibria, μ - 1 is replaced by the eigenvalue closest to 0. For tori the moduli of the multipliers are recomputed, and
//! their arguments are those of the special point.

use super::shooting::{Orbit, Row, Shooting, at_left_ends};
use super::touching::Touch;
use super::{Check, Quantity, Undecided, Verified, accuracies, maps, tori};
use crate::contract::{Batch, Parameters};
use crate::diagram::{Branch, Kind, Solution, SpecialPoint};
use crate::linalg::{dot, lu, max_abs, periodic_schur};
use crate::problem::Setting;
use num_complex::Complex64;

/// Distances between neighbouring solutions, in scaled unknowns, in the order in which they are tried.
const DISTANCES: [f64; 10] = [1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7];
/// Largest contribution of the cubic beyond the parabola, relative to the values next to the zero.
const SMOOTH: f64 = 0.05;

/// Fraction of the stated error by which two distances may disagree.
const AGREEING: f64 = 0.2;

/// Verifies the special points of a branch.
pub(super) fn verify(setting: &Setting, branch: &Branch, tolerance: f64) -> Verified {
    let mut out = Verified::default();
    let [accuracy, _] = accuracies(tolerance);
    for special in
        branch.special.iter().filter(|special| !matches!(special.kind, Kind::Unexplained | Kind::Mark | Kind::Peak))
    {
        let undecided = |why| Undecided {
            branch: branch.name.clone(),
            position: special.point.position,
            special: Some(special.kind),
            why,
        };
        if matches!(special.kind, Kind::Sliding | Kind::BoundaryEquilibrium) {
            out.undecided.push(undecided("sliding bifurcations and boundary equilibria are not located again"));
            continue;
        }
        let parameter = special.point.parameters.get(branch.free).copied().unwrap_or(f64::NAN);
        if branch.held.is_some() || setting.axes.len() != 1 || setting.axes[0].index != branch.free {
            out.undecided.push(undecided("it lies on a curve in several parameters"));
            continue;
        }
        let place = Place { setting, special, accuracy };
        match place.found() {
            Ok(there) => {
                out.special += 1;
                out.checks.push(Check {
                    branch: branch.name.clone(),
                    position: special.point.position,
                    special: Some(special.kind),
                    parameter,
                    quantity: Quantity::Place,
                    stated: Some(special.error + 1000.0 * accuracy),
                    found: there.map_or(f64::INFINITY, |there| place.off(there)),
                });
            }
            Err(why) => out.undecided.push(undecided(why)),
        }
    }
    out
}

struct Place<'a> {
    setting: &'a Setting<'a>,
    special: &'a SpecialPoint,
    accuracy: f64,
}

/// Solution next to a special point: the parameter, λ', and the multipliers without the trivial one, or the
/// eigenvalues.
struct Nearby {
    parameter: f64,
    slope: f64,
    spectrum: Vec<Complex64>,
    /// Extremum of the switch at whose surface a cycle touches, 0 elsewhere.
    touch: f64,
}

impl Place<'_> {
    /// Parameter at the zero of the test function on which two successive distances agree; `None` if there is no zero
    /// here.
    fn found(&self) -> Result<Option<f64>, &'static str> {
        let mut why = "the solutions around it could not be computed";
        let (mut tried, mut crossed) = (false, false);
        let (mut centre, mut before) = (0.0, None::<f64>);
        for distance in DISTANCES {
            let nodes = [-1.5, -0.5, 0.5, 1.5].map(|k| centre + k * distance);
            let Some(around) = self.solutions(&nodes)? else { continue };
            tried = true;
            let tests: &[Kind] = match self.special.kind {
                // On the branch that ends there the parameter turns back.
                Kind::BranchPoint => &[Kind::BranchPoint, Kind::Fold],
                _ => std::slice::from_ref(&self.special.kind),
            };
            let values = tests.iter().filter_map(|test| all(&around, |nearby| self.test(*test, nearby)));
            let Some(values) = values.into_iter().find(|values| (values[0] > 0.0) != (values[3] > 0.0)) else {
                continue;
            };
            crossed = true;
            why = "estimates from different distances disagree";
            let root = zero(&nodes, &values);
            if bend(&nodes, &values, root) > SMOOTH * values[1].abs().max(values[2].abs()) {
                continue;
            }
            let parameters: Vec<f64> = around.iter().map(|nearby| nearby.parameter).collect();
            let there = dot(&weights(&nodes, root), &parameters);
            // The distances must agree better than the stated error, or than the deviation of the point.
            let off = self.off(there);
            let close = (AGREEING * self.special.error).max(0.1 * off) + 100.0 * self.accuracy;
            if before.is_some_and(|before| (there - before).abs() < close * (1.0 + there.abs())) {
                return Ok(Some(there));
            }
            (centre, before) = (root, Some(there));
        }
        if tried && !crossed { Ok(None) } else { Err(why) }
    }

    /// Distance of λ = `there` from the stated value, relative to 1 + |λ|.
    fn off(&self, there: f64) -> f64 {
        (there - self.stated()).abs() / (1.0 + there.abs())
    }

    /// Stated value of the unknown λ at the special point.
    fn stated(&self) -> f64 {
        self.setting.unknowns_of(&self.special.point)[0]
    }

    fn test(&self, kind: Kind, nearby: &Nearby) -> Option<f64> {
        let one = Complex64::new(1.0, 0.0);
        let of_cycle = matches!(self.special.point.solution, Solution::Cycle(_));
        let closest = |to: Complex64| -> Option<Complex64> {
            nearby.spectrum.iter().copied().min_by(|a, b| (a - to).norm().total_cmp(&(b - to).norm()))
        };
        let mut pairs: Vec<Complex64> = nearby.spectrum.iter().copied().filter(|z| z.im > 1e-9 * z.norm()).collect();
        match kind {
            Kind::Fold => Some(nearby.slope),
            Kind::BranchPoint if of_cycle => closest(one).map(|z| z.re - 1.0),
            Kind::BranchPoint => closest(Complex64::new(0.0, 0.0)).map(|z| z.re),
            Kind::PeriodDoubling => closest(-one).map(|z| z.re + 1.0),
            Kind::Torus => {
                pairs.sort_by(|a, b| (a.norm() - 1.0).abs().total_cmp(&(b.norm() - 1.0).abs()));
                pairs.first().map(|z| z.norm() - 1.0)
            }
            Kind::Hopf => {
                pairs.sort_by(|a, b| a.re.abs().total_cmp(&b.re.abs()));
                pairs.first().map(|z| z.re)
            }
            Kind::Grazing | Kind::ImpactGrazing => Some(nearby.touch),
            _ => None,
        }
    }

    /// Solutions at the given distances along the branch.
    fn solutions(&self, nodes: &[f64; 4]) -> Result<Option<Vec<Nearby>>, &'static str> {
        match &self.special.point.solution {
            Solution::Equilibrium(x) => Ok(self.equilibria(x, nodes)),
            Solution::Torus(_) if self.special.kind == Kind::BranchPoint => {
                Err("branch points of tori are not located again")
            }
            Solution::Torus(_) => {
                let around = tori::beside(self.setting, &self.special.point, nodes, self.accuracy)?;
                let nearby = |(parameter, slope, spectrum)| Nearby { parameter, slope, spectrum, touch: 0.0 };
                Ok(around.map(|all| all.into_iter().map(nearby).collect()))
            }
            Solution::Cycle(_) if self.special.point.is_light() => Err("its profile was not stored"),
            Solution::Cycle(_) if self.setting.field.iterated() => {
                if !maps::recomputes(self.special.kind) {
                    return Err("points of this kind are not recomputed for maps");
                }
                let each = nodes.iter().map(|distance| {
                    let (parameter, slope, spectrum) = maps::beside(self.setting, &self.special.point, *distance)?;
                    Some(Nearby { parameter, slope, spectrum, touch: 0.0 })
                });
                Ok(each.collect())
            }
            Solution::Cycle(_)
                if matches!(self.special.kind, Kind::Grazing | Kind::ImpactGrazing)
                    || super::points::jumps(self.setting.field, &self.special.point) =>
            {
                self.jumping(nodes)
            }
            Solution::Cycle(cycle) => {
                let base = Orbit::of(self.setting, &self.special.point).ok_or("its profile was not stored")?;
                let (n, tangent) = (base.dim(), &self.special.point.tangent);
                let size = cycle.profile.len();
                if tangent.len() != size + 2 {
                    return Err("its tangent was not stored");
                }
                let mut along: Vec<f64> = at_left_ends(&tangent[..size], &base.intervals, cycle.degree, n);
                along.iter_mut().enumerate().for_each(|(at, t)| *t /= base.scales[at % n]);
                // The period of a forced cycle is prescribed, so the tangent has no component along it.
                along.push(if base.forced { 0.0 } else { tangent[size] / base.period });
                along.push(tangent[size + 1]);
                normalise(&mut along);
                let shooting = Shooting { setting: self.setting, accuracy: self.accuracy, ignored: None };
                let moved = |s: &f64| base.moved(&along.iter().map(|t| s * t).collect::<Vec<_>>());
                let orbits: Vec<Orbit> = nodes.iter().map(moved).collect();
                // Each solution is sought in the plane through its initial guess.
                let rows: Vec<Vec<Row>> = vec![vec![(along.clone(), 0.0)]; nodes.len()];
                let solved = shooting.solve(&orbits, &rows);
                let nearby = solved.into_iter().map(|solved| {
                    let solved = solved?;
                    let spectrum = solved.flow.free_multipliers(&solved.orbit);
                    let slope = *solved.kernel.first()?.last()?;
                    Some(Nearby { parameter: solved.orbit.free[0], slope, spectrum, touch: 0.0 })
                });
                Ok(nearby.collect())
            }
        }
    }

    /// Cycles along which f or the state jumps; the direction of the branch is that of the shooting equations.
    fn jumping(&self, nodes: &[f64; 4]) -> Result<Option<Vec<Nearby>>, &'static str> {
        if self.special.kind == Kind::BranchPoint {
            return Err("branch points of cycles with jumps are not located again");
        }
        let base = Orbit::away_from_surfaces(self.setting, &self.special.point)?;
        let touch = match self.special.kind {
            Kind::Grazing | Kind::ImpactGrazing => Some(
                Touch::of(self.setting, self.special.kind, &self.special.point)
                    .ok_or("a surface that is reached at the instant of an event is not located again")?,
            ),
            _ => None,
        };
        let ignored = touch.map(|touch| touch.ignored(&base));
        let shooting = Shooting { setting: self.setting, accuracy: self.accuracy, ignored };
        let here = shooting.solve(std::slice::from_ref(&base), &[]).pop().flatten();
        let Some(mut along) = here.and_then(|here| here.kernel.into_iter().next()) else {
            return Err("shooting did not converge there");
        };
        normalise(&mut along);
        let orbits: Vec<Orbit> =
            nodes.iter().map(|s| base.moved(&along.iter().map(|t| s * t).collect::<Vec<_>>())).collect();
        let rows: Vec<Vec<Row>> = vec![vec![(along.clone(), 0.0)]; nodes.len()];
        let each = shooting.solve(&orbits, &rows).into_iter().map(|solved| {
            let solved = solved?;
            // The flow that Newton's method leaves is that of its last iterate but one.
            let flow = shooting.through_jumps(&solved.orbit, ignored)?;
            let spectrum = flow.free_multipliers(&solved.orbit);
            let slope = *solved.kernel.first()?.last()?;
            let touch = match touch {
                Some(touch) => touch.extremum(&shooting, &solved.orbit, &flow.legs)?,
                None => 0.0,
            };
            Some(Nearby { parameter: solved.orbit.free[0], slope, spectrum, touch })
        });
        Ok(each.collect())
    }

    fn equilibria(&self, x: &[f64], nodes: &[f64; 4]) -> Option<Vec<Nearby>> {
        let n = x.len();
        let scales: Vec<f64> = x.iter().zip(self.setting.scales).map(|(x, s)| x.abs() + s).collect();
        let mut along = self.special.point.tangent.clone();
        if along.len() != n + 1 {
            return None;
        }
        along.iter_mut().zip(&scales).for_each(|(t, s)| *t /= s);
        normalise(&mut along);
        let start = self.setting.unknowns_of(&self.special.point)[0];
        nodes.iter().map(|distance| self.equilibrium(x, start, &scales, &along, *distance)).collect()
    }

    fn equilibrium(&self, x: &[f64], start: f64, scales: &[f64], along: &[f64], distance: f64) -> Option<Nearby> {
        let n = x.len();
        let size = n + 1;
        let mut state: Vec<f64> = x.iter().zip(scales).zip(along).map(|((x, s), t)| x + distance * s * t).collect();
        let mut value = start + distance * along[n];
        let mut last = f64::INFINITY;
        for _ in 0..20 {
            let (mut f, mut fx, mut fp) = (vec![0.0; n], vec![0.0; n * n], vec![0.0; n]);
            let parameters = self.setting.at(&[value]);
            let batch =
                Batch { lanes: 1, states: &state, parameters: Parameters::Shared(&parameters), times: &[], signs: &[] };
            self.setting.linearise(batch, &mut f, &mut fx, &mut fp);
            let mut a = Vec::with_capacity(size * size);
            for i in 0..n {
                a.extend((0..n).map(|j| fx[i * n + j] * scales[j]));
                a.push(fp[i]);
            }
            a.extend_from_slice(along);
            let mut right: Vec<f64> = f.iter().flat_map(|f| [-f, 0.0]).chain([0.0, 1.0]).collect();
            let mut pivots = vec![0; size];
            lu::factorise(&mut a, size, &mut pivots).ok()?;
            lu::solve(&a, size, &pivots, &mut right, 2);
            let update: Vec<f64> = right.iter().step_by(2).copied().collect();
            let length = max_abs(&update);
            if length.is_nan() {
                return None;
            }
            // Iterate until only rounding remains.
            if length < 1e-14 || (length < 1e-9 && length > 0.5 * last) {
                let mut kernel: Vec<f64> = right.iter().skip(1).step_by(2).copied().collect();
                normalise(&mut kernel);
                let spectrum = periodic_schur::eigenvalues(&fx, n)?.iter().map(|value| value.value()).collect();
                return Some(Nearby { parameter: value, slope: kernel[n], spectrum, touch: 0.0 });
            }
            last = length;
            state.iter_mut().zip(scales).zip(&update).for_each(|((x, s), d)| *x += s * d);
            value += update[n];
        }
        None
    }
}

fn normalise(v: &mut [f64]) {
    let norm = dot(v, v).sqrt().max(f64::MIN_POSITIVE);
    v.iter_mut().for_each(|x| *x /= norm);
}

fn all(around: &[Nearby], value: impl Fn(&Nearby) -> Option<f64>) -> Option<[f64; 4]> {
    let values: Option<Vec<f64>> = around.iter().map(value).collect();
    values?.try_into().ok()
}

/// Values at `s` of the Lagrange polynomials of the nodes.
fn weights(nodes: &[f64; 4], s: f64) -> [f64; 4] {
    std::array::from_fn(|i| (0..4).filter(|&k| k != i).map(|k| (s - nodes[k]) / (nodes[i] - nodes[k])).product())
}

/// Difference at `s` between the cubic through all nodes and the parabola through the three nearest ones.
fn bend(nodes: &[f64; 4], values: &[f64; 4], s: f64) -> f64 {
    let farthest = if s - nodes[0] > nodes[3] - s { 0 } else { 3 };
    let three = |i: usize| -> f64 {
        (0..4).filter(|&k| k != i && k != farthest).map(|k| (s - nodes[k]) / (nodes[i] - nodes[k])).product()
    };
    let parabola: f64 = (0..4).filter(|&i| i != farthest).map(|i| three(i) * values[i]).sum();
    (dot(&weights(nodes, s), values) - parabola).abs()
}

/// Zero of the cubic between nodes whose outer values have opposite signs.
fn zero(nodes: &[f64; 4], values: &[f64; 4]) -> f64 {
    let (mut low, mut high) = (nodes[0], nodes[3]);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if (dot(&weights(nodes, middle), values) > 0.0) == (values[0] > 0.0) { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}
