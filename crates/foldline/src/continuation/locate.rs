//! Location of a zero of a monitor along the curve.
//!
//! **Idea.** Between two accepted points the curve is parametrised by the distance s along the tangent at the first. A
//! bracketing method finds the zero in s; each trial point is a full solution of the problem. The zero is then located
//! again on a finer mesh, and the difference is the stated error.
//!
//! **Source.** chandrupatla1997 (bracketing with inverse quadratic interpolation and bisection).

use super::corrector::{Plane, Station, arrive, correct, doubted, examined, parameter_row, settle};
use super::{Failure, ROUNDING, Settings};
use crate::contract::{Examination, Monitor, Sight, ZeroProblem};
use crate::diagram::{Cost, Kind, Point};

/// Share of the larger end value that a monitor must retain at a sign change for it to count as a jump rather than a
/// zero.
const JUMP: f64 = 0.05;

/// Largest share of a monitor's value that a secant step with the right slope leaves.
const LEADS: f64 = 0.2;

/// Cosine of the largest angle between a tangent and the one expected next to a crossing of branches. Newton's method
/// reaches both branches there, or, through rounding, a bend from one into the other.
const STRAIGHT: f64 = 0.95;

/// Distance along the curve below which rounding prevents a closer location of a zero.
const FINEST: f64 = 1e-12;

/// A located zero.
#[derive(Clone, Debug)]
pub struct Located {
    /// Distance from the left station along its tangent.
    pub distance: f64,
    /// The point, on the finer mesh if there is one.
    pub station: Station,
    /// Bound on its error; see [`crate::diagram::SpecialPoint::error`].
    pub error: f64,
}

/// The interval of the curve between two stations, in the metric and on the mesh of the left one.
pub struct Stretch<'s> {
    /// Left end.
    pub left: &'s Station,
    /// Unknowns of the right station, carried to the mesh of the left.
    right: Vec<f64>,
    slope: Vec<f64>,
    /// Distance of the right station along the tangent of the left.
    pub length: f64,
    /// Angle between the tangents at the ends, if small.
    pub(super) turn: f64,
    /// [`Station::midway`] of the right station.
    midway: f64,
    /// [`Station::middle`] of the right station.
    middle: Option<(f64, Vec<f64>)>,
    /// +1 towards larger positions, -1 towards smaller.
    pub(super) direction: f64,
}

impl<'s> Stretch<'s> {
    /// The interval from `left` to `right`; moves the problem to the mesh of `left`.
    pub fn new(problem: &mut dyn ZeroProblem, left: &'s Station, right: &Station, direction: f64) -> Stretch<'s> {
        problem.set_mesh(&left.mesh);
        problem.anchor(&left.u);
        let u = problem.carry(&right.u, &right.mesh, &left.mesh);
        let mut slope = problem.transfer(&right.tangent, &right.mesh, &left.mesh);
        let gap: Vec<f64> = u.iter().zip(&left.u).map(|(a, b)| a - b).collect();
        let length = problem.dot(&left.tangent, &gap);
        let forward = problem.dot(&left.tangent, &slope);
        slope.iter_mut().for_each(|t| *t /= forward.abs().max(0.1));
        let change: Vec<f64> = slope.iter().zip(&left.tangent).map(|(a, b)| a - b).collect();
        let turn = problem.dot(&change, &change).sqrt();
        let (midway, middle) = (right.midway, right.middle.clone());
        Stretch { left, right: u, slope, length, turn, midway, middle, direction }
    }

    /// Computes the point at distance s on the mesh of the left station.
    ///
    /// # Errors
    /// See [`Failure`].
    pub fn at(
        &self,
        problem: &mut dyn ZeroProblem,
        settings: &Settings,
        s: f64,
        cost: &mut Cost,
    ) -> Result<Station, Failure> {
        self.seen_at(Sight::Everything, problem, settings, s, cost)
    }

    /// Computes the point at distance s to the given level of detail.
    ///
    /// # Errors
    /// See [`Failure`].
    pub(super) fn seen_at(
        &self,
        sight: Sight,
        problem: &mut dyn ZeroProblem,
        settings: &Settings,
        s: f64,
        cost: &mut Cost,
    ) -> Result<Station, Failure> {
        let (u, tangent) = self.arrived(problem, settings, s, cost)?;
        Ok(seen(sight, problem, u, tangent, self.direction))
    }

    /// Spectrum at distance s, from a point that Newton's method moves by less than the relative distance `close`.
    pub(super) fn nearly_at(
        &self,
        close: f64,
        problem: &mut dyn ZeroProblem,
        s: f64,
        cost: &mut Cost,
    ) -> Result<Station, Failure> {
        problem.set_mesh(&self.left.mesh);
        problem.anchor(&self.left.u);
        let mut u = self.predicted(problem, s);
        let tangent = arrive(problem, &mut u, &self.left.tangent, close, cost)?;
        Ok(seen(Sight::Stability, problem, u, tangent, self.direction))
    }

    /// Unknowns and tangent at distance s.
    fn arrived(
        &self,
        problem: &mut dyn ZeroProblem,
        settings: &Settings,
        s: f64,
        cost: &mut Cost,
    ) -> Result<(Vec<f64>, Vec<f64>), Failure> {
        let mut u = self.corrected(problem, settings, s, cost)?;
        let close = settings.closeness(&self.left.mesh, self.length);
        let tangent = arrive(problem, &mut u, &self.left.tangent, close, cost)?;
        Ok((u, tangent))
    }

    /// Unknowns at distance s on the mesh of the left station, nearly converged.
    ///
    /// # Errors
    /// See [`Failure`].
    pub(super) fn corrected(
        &self,
        problem: &mut dyn ZeroProblem,
        settings: &Settings,
        s: f64,
        cost: &mut Cost,
    ) -> Result<Vec<f64>, Failure> {
        problem.set_mesh(&self.left.mesh);
        problem.anchor(&self.left.u);
        if let Some((_, known)) = self.middle.as_ref().filter(|(there, _)| *there == s) {
            return Ok(known.clone());
        }
        let mut u = self.predicted(problem, s);
        let plane = Plane { row: self.left.tangent.clone(), base: self.left.u.clone(), distance: s };
        correct(problem, settings, &plane, &mut u, cost)?;
        Ok(u)
    }

    /// The cubic between the stations, in the hyperplane at distance s.
    pub(super) fn predicted(&self, problem: &dyn ZeroProblem, s: f64) -> Vec<f64> {
        let mut u = self.hermite(s);
        let gap: Vec<f64> = u.iter().zip(&self.left.u).map(|(a, b)| a - b).collect();
        let off = s - problem.dot(&self.left.tangent, &gap);
        crate::linalg::axpy(off, &self.left.tangent, &mut u);
        u
    }

    /// Distance at which the cubic between the two stations turns in the continuation parameter.
    fn turning(&self) -> f64 {
        let last = self.left.u.len() - 1;
        let rise = |x: f64| {
            let h = 1e-4 * self.length;
            self.hermite_component(x * self.length + h, last) - self.hermite_component(x * self.length - h, last)
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            if (rise(middle) > 0.0) == (rise(0.0) > 0.0) { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// Distance at which the cubic between the two stations reaches the given value of the continuation parameter.
    fn distance_to(&self, value: f64) -> f64 {
        let last = self.left.u.len() - 1;
        let (mut low, mut high) = (0.0, self.length);
        let rising = self.right[last] > self.left.u[last];
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if (self.hermite_component(middle, last) < value) == rising { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    fn hermite(&self, s: f64) -> Vec<f64> {
        (0..self.right.len()).map(|i| self.hermite_component(s, i)).collect()
    }

    /// True if the curve between the two stations turns twice in the continuation parameter, or nearly does, judging by
    /// its ends and midpoint. Two close folds on a long step may not show at the ends alone.
    pub(super) fn may_turn_twice(&self) -> bool {
        let i = self.left.u.len() - 1;
        let rise = self.right[i] - self.left.u[i];
        turns_twice(rise, [self.length * self.left.tangent[i], self.length * self.slope[i]], self.midway)
    }

    /// Derivative of the cubic between the stations.
    fn heading(&self, s: f64) -> Vec<f64> {
        let (l, x) = (self.length, s / self.length);
        let own = |i: usize| {
            let (p, q, c) = (l * self.left.tangent[i], l * self.slope[i], self.right[i] - self.left.u[i]);
            p + x * (2.0 * (3.0 * c - 2.0 * p - q) + 3.0 * x * (p + q - 2.0 * c))
        };
        (0..self.right.len()).map(own).collect()
    }

    /// Cubic Hermite interpolant of both ends.
    fn hermite_component(&self, s: f64, i: usize) -> f64 {
        let (l, x) = (self.length, s / self.length);
        let (a, b) = (self.left.u[i], self.right[i]);
        let (p, q) = (l * self.left.tangent[i], l * self.slope[i]);
        let c = b - a;
        a + x * (p + x * ((3.0 * c - 2.0 * p - q) + x * (p + q - 2.0 * c)))
    }
}

/// True if a polynomial on [0, 1] has, or nearly has, both a maximum and a minimum inside. It rises by `rise`, has the
/// slopes `p` and `q` at its ends, and differs by `off` from the cubic at the midpoint.
fn turns_twice(rise: f64, [p, q]: [f64; 2], off: f64) -> bool {
    const PLACES: usize = 64;
    // Slope p + 2 b x + 3 c x² of the cubic plus that of 16 off x² (1 - x)²; its minimum is compared with the end
    // values.
    let (b, c) = (3.0 * rise - 2.0 * p - q, p + q - 2.0 * rise);
    let slope = |x: f64| p + x * (2.0 * b + 3.0 * c * x) + 32.0 * off * x * (1.0 - x) * (1.0 - 2.0 * x);
    let places = (1..PLACES).map(|k| k as f64 / PLACES as f64);
    p * q > 0.0 && places.map(|x| slope(x) * p.signum()).fold(f64::INFINITY, f64::min) < 0.1 * p.abs().min(q.abs())
}

/// Computes the point between two stations at which the continuation parameter has the given value, which lies between
/// theirs.
///
/// Fixing the parameter is ill-conditioned next to a fold. The search therefore uses hyperplanes across the tangent of
/// the left station, closer and closer to the value; only the last correction fixes the parameter.
///
/// # Errors
/// See [`Failure`].
pub fn passing(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    [left, right]: [&Station; 2],
    value: f64,
    direction: f64,
    cost: &mut Cost,
) -> Result<Station, Failure> {
    let stretch = Stretch::new(problem, left, right, direction);
    let value = value / problem.unit();
    let mut s = stretch.distance_to(value);
    let [mut low, mut high] = [(0.0, left.parameter()), (stretch.length, right.parameter())];
    let mut near = None;
    for _ in 0..5 {
        problem.set_mesh(&left.mesh);
        problem.anchor(&left.u);
        let plane = Plane { row: left.tangent.clone(), base: left.u.clone(), distance: s };
        let found = settle(problem, settings, plane, stretch.hermite(s), direction, cost)?;
        let gap = found.parameter() - value;
        if ((low.1 - value) > 0.0) == (gap > 0.0) {
            low = (s, found.parameter())
        } else {
            high = (s, found.parameter())
        }
        let done = gap.abs() < 1e-4 * (low.1 - high.1).abs().max(1e-9 * (1.0 + value.abs()));
        near = Some(found);
        if done || high.1 == low.1 {
            break;
        }
        let secant = low.0 + (high.0 - low.0) * (value - low.1) / (high.1 - low.1);
        s = secant;
    }
    let near = near.ok_or(Failure::NotFinite)?;
    let slope = near.slope();
    let mut u = near.u;
    let last = u.len() - 1;
    problem.set_mesh(&near.mesh);
    problem.anchor(&u);
    u[last] = value;
    let plane = Plane { row: parameter_row(u.len()), base: u.clone(), distance: 0.0 };
    let mut found = settle(problem, settings, plane, u, direction, cost)?;
    // The direction of travel is kept even if the parameter row has reversed the tangent.
    found.head(slope);
    Ok(found)
}

/// True if a tangent is not that of the branch being followed.
fn turned(problem: &dyn ZeroProblem, tangent: &[f64], expected: &[f64]) -> bool {
    let [along, own, other] = [[tangent, expected], [tangent; 2], [expected; 2]].map(|[a, b]| problem.dot(a, b));
    along.abs() < STRAIGHT * (own * other).sqrt()
}

/// Sets the tangent at a branch point to the direction in which the interval passes it. The matrix is singular there,
/// so the computed tangent may be that of the crossing branch, or anything in between.
pub(super) fn head_along(problem: &mut dyn ZeroProblem, stretch: &Stretch, found: &mut Located) {
    let station = &mut found.station;
    let heading = problem.transfer(&stretch.heading(found.distance), &stretch.left.mesh, &station.mesh);
    problem.set_mesh(&station.mesh);
    problem.anchor(&station.u);
    let norm = stretch.length.signum() * problem.dot(&heading, &heading).sqrt();
    if norm.is_finite() && norm != 0.0 {
        station.tangent = heading.iter().map(|t| t / norm).collect();
        // Points and curve points may be on different meshes.
        let stored: Vec<f64> = station.tangent.iter().map(|t| stretch.direction * t).collect();
        station.point.tangent = problem.point(&station.u, &stored, Examination::default()).tangent;
    }
}

/// Locates the zero of `monitor` in `stretch`, at whose ends its values have opposite signs.
///
/// # Errors
/// See [`Failure`]. Next to a branch point, also [`Failure::Singular`] if Newton's method leaves the branch for the one
/// that crosses it.
pub fn locate(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    stretch: &Stretch,
    monitor: &dyn Monitor,
    values: [f64; 2],
    cost: &mut Cost,
) -> Result<Located, Failure> {
    locate_within(problem, settings, stretch, [0.0, stretch.length], monitor, values, cost)
}

/// Locates a zero between two distances in the interval, at which the monitor has the given values; see [`locate`].
///
/// # Errors
/// See [`locate`].
pub(super) fn locate_within(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    stretch: &Stretch,
    ends: [f64; 2],
    monitor: &dyn Monitor,
    values: [f64; 2],
    cost: &mut Cost,
) -> Result<Located, Failure> {
    let reference = &stretch.left.point;
    let mut evaluate = |s: f64| {
        let (u, tangent) = stretch.arrived(problem, settings, s, cost)?;
        if monitor.kind() == Kind::BranchPoint && turned(problem, &tangent, &stretch.heading(s)) {
            return Err(Failure::Singular);
        }
        let found = seen(monitor.reads(), problem, u, tangent, stretch.direction);
        Ok((monitor.value(reference, &found.point), found))
    };
    let resolution = if stretch.left.mesh.is_empty() { 1e-9 } else { 1e-2 };
    let first = match monitor.kind() {
        Kind::Fold => stretch.turning(),
        _ => values[0] / (values[0] - values[1]),
    };
    let (mut distance, mut coarse, rise) = chandrupatla(&mut evaluate, ends, values, first, [resolution, 0.5 * JUMP])?;
    // A sign change without a zero means that the two ends lie on different branches.
    let smallest = monitor.value(reference, &coarse.point).abs();
    let largest = values[0].abs().max(values[1].abs());
    // (Of values that underflow only the sign is known.)
    if smallest > JUMP * largest && largest > f64::MIN_POSITIVE {
        return Err(Failure::Unexplained);
    }
    let mut floor = 10.0 * settings.newton_tolerance();
    let (mut tolerance, mut slope) = (0.3 * settings.tolerance, rise);
    // (Excluded: a branch born at a pitchfork turns where the matrix is singular.)
    if coarse.mesh.is_empty() && !matches!(monitor.kind(), Kind::BranchPoint | Kind::Fold) {
        (distance, coarse) = secant_zero(problem, settings, stretch, monitor, (distance, coarse), cost);
        floor = solution_error(problem, &coarse).unwrap_or(floor);
    }
    if !monitor.possible(&coarse.point) {
        return Ok(Located { distance, station: coarse, error: floor });
    }
    // First a mesh that resolves this point, then a finer one. If the two disagree by more than the tolerance, another
    // round starts from the finer one, with every interval halved.
    let mut known: Option<(Station, f64)> = None;
    let mut settled = false;
    for round in 0..4 {
        for _ in 0..4 {
            let better = coarse.better(problem, tolerance);
            // The bracketing stopped slightly off the zero. Compared with the finer mesh, that would count as an error
            // of this one.
            if better.is_none() && (settled || coarse.mesh.is_empty()) {
                break;
            }
            let found = relocate(problem, settings, stretch, monitor, &coarse, better.as_ref(), &mut slope, cost);
            settled = true;
            match found {
                Ok((found, _)) => coarse = found,
                Err(why) if better.is_some() => return Err(why),
                Err(_) => break,
            }
            if monitor.jump() > 0 && !monitor.confirms(&coarse.point) {
                return Ok(Located { distance, station: coarse, error: floor });
            }
            if better.is_none() {
                break;
            }
        }
        problem.set_mesh(&coarse.mesh);
        // If multipliers coalesce along a curve, the square root of the error is seen.
        let denser = round == 0 && !monitor.kind().has_codimension_two();
        let Some(finer) = (if denser { problem.denser_mesh() } else { problem.finer_mesh() }) else {
            let station = whole(problem, coarse, stretch.direction);
            let error = floor + noise(problem, settings, stretch, monitor, distance, &station, cost);
            return Ok(Located { distance, station, error });
        };
        coarse = whole(problem, coarse, stretch.direction);
        let (mut fine, off) = relocate(problem, settings, stretch, monitor, &coarse, Some(&finer), &mut slope, cost)?;
        let error = floor
            + off
            + discrepancy(
                settings,
                &coarse.point,
                &fine.point,
                coarse.parameter() - fine.parameter(),
                fine.parameter(),
            );
        let improved = known.as_ref().is_none_or(|(_, e)| error < *e);
        if error <= settings.tolerance {
            doubted(problem, &mut fine);
        }
        if improved {
            known = Some((fine.clone(), error));
        }
        if error <= settings.tolerance || !improved {
            break;
        }
        coarse = fine;
        tolerance *= 0.1;
    }
    known.map(|(station, error)| Located { distance, station, error }).ok_or(Failure::NotFinite)
}

/// The factor of a monitor's value that vanishes next to `near`, or the value itself if it has no factors.
fn vanishing(monitor: &dyn Monitor, stretch: &Stretch, near: &Point, at: &Point) -> f64 {
    monitor.factor(near, at).unwrap_or_else(|| monitor.value(&stretch.left.point, at))
}

/// The zero of a monitor along a branch of equilibria, to rounding, by the secant method.
fn secant_zero(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    stretch: &Stretch,
    monitor: &dyn Monitor,
    (distance, found): (f64, Station),
    cost: &mut Cost,
) -> (f64, Station) {
    /// Maximum number of iterations. The secant method gains a factor of 1.6 in digits with each, so fewer than ten are
    /// needed; the rest is a margin.
    const ROUNDS: usize = 12;
    /// Distance of the first secant, as a share of the interval: large enough for the difference of the values to
    /// exceed rounding (1e-16), small enough for the slope to be that at the zero.
    const APART: f64 = 1e-6;
    let near = found.point.clone();
    let own = vanishing(monitor, stretch, &near, &near);
    let mut best = (distance, own, found);
    let (mut a, mut b) = ((distance, own), distance + APART * stretch.length);
    for round in 0..ROUNDS {
        let Ok(there) = stretch.seen_at(monitor.reads(), problem, settings, b, cost) else { break };
        let value = vanishing(monitor, stretch, &near, &there.point);
        let next = b - value * (b - a.0) / (value - a.1);
        let better = value.abs() < best.1.abs();
        if better {
            best = (b, value, there);
        }
        // The first trial yields the slope. The values then decrease until they reach rounding.
        let inside = (0.0..=1.0).contains(&(next / stretch.length));
        if !inside || (round > 0 && !better) {
            break;
        }
        (a, b) = ((b, value), next);
    }
    (best.0, best.2)
}

/// Relative rounding error of a converged solution: one more Newton update plus the machine precision, times a safety
/// factor.
fn solution_error(problem: &mut dyn ZeroProblem, found: &Station) -> Option<f64> {
    /// Safety factor: a single update samples the rounding error once.
    const SAFE: f64 = 10.0;
    let (mut r, mut du) = (vec![0.0; found.u.len()], vec![0.0; found.u.len()]);
    problem.anchor(&found.u);
    problem.factorise(&found.u, &found.tangent).ok()?;
    if !problem.residual(&found.u, &mut r) {
        return None;
    }
    r[found.u.len() - 1] = 0.0;
    problem.solve(&r, &mut du);
    Some(SAFE * (problem.relative_size(&du, &found.u) + f64::EPSILON)).filter(|error| error.is_finite())
}

/// Relative rounding error, in parameter and states, of the zero of a monitor. So close to the zero the vanishing
/// factor is a parabola to rounding, and the residual of a fitted parabola measures the noise.
fn noise(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    stretch: &Stretch,
    monitor: &dyn Monitor,
    distance: f64,
    found: &Station,
    cost: &mut Cost,
) -> f64 {
    const NEAR: f64 = 1e-5;
    const PLACES: [f64; 6] = [-1.0, -0.6, -0.2, 0.2, 0.6, 1.0];
    let mut values = [0.0; 6];
    for (value, place) in values.iter_mut().zip(PLACES) {
        let s = distance + place * NEAR * stretch.length;
        let Ok(there) = stretch.at(problem, settings, s, cost) else { return 0.0 };
        *value = vanishing(monitor, stretch, &found.point, &there.point);
    }
    let sum = |of: &dyn Fn(f64) -> f64| PLACES.iter().map(|x| of(*x)).sum::<f64>();
    let moment = |of: &dyn Fn(f64) -> f64| PLACES.iter().zip(&values).map(|(x, v)| of(*x) * v).sum::<f64>();
    let square = sum(&|x| x * x) / 6.0;
    let bent = |x: f64| x * x - square;
    let (mean, slope) = (moment(&|_| 1.0) / 6.0, moment(&|x| x) / (6.0 * square));
    let bend = moment(&bent) / sum(&|x| bent(x) * bent(x));
    let fitted = |x: f64| mean + slope * x + bend * bent(x);
    let off = PLACES.iter().zip(&values).fold(0.0f64, |most, (x, v)| most.max((v - fitted(*x)).abs()));
    // The zero of the fitted parabola is as informative as the residual of the fit.
    let shift = ((fitted(0.0) / slope).abs() + 2.0 * (off / slope).abs()) * NEAR * stretch.length.abs();
    let rate = found.slope().abs() / (1.0 + found.parameter().abs());
    let error = shift * rate.max(problem.relative_size(&found.tangent, &found.u));
    if error.is_finite() { error } else { 0.0 }
}

/// Largest relative difference between two points: of the parameter and the extremes of the states, relative to scale +
/// |value|, of the period, and of the extremes of outputs, relative to 1 + |value|. `gap` and `parameter` are the
/// difference and the value of the unknown λ.
pub(super) fn discrepancy(settings: &Settings, a: &Point, b: &Point, gap: f64, parameter: f64) -> f64 {
    let mut largest = gap.abs() / (1.0 + parameter.abs());
    if let (Some(x), Some(y)) = (a.solution.period(), b.solution.period()) {
        largest = largest.max((x - y).abs() / y.abs());
    }
    let scales = settings.scales.iter().copied().chain(std::iter::repeat(1.0));
    for ((x, y), scale) in a.ranges.iter().zip(&b.ranges).zip(scales) {
        x.iter().zip(y).for_each(|(x, y)| largest = largest.max((x - y).abs() / (scale + y.abs())));
    }
    largest
}

impl Station {
    /// True if the station was fully examined.
    fn is_whole(&self) -> bool {
        !self.point.ranges.is_empty()
    }

    /// A mesh on which this point would meet the tolerance, if its own does not. To be called right after the station
    /// was computed, while its factorisation is the last one.
    fn better(&self, problem: &mut dyn ZeroProblem, tolerance: f64) -> Option<crate::diagram::Mesh> {
        problem.better_mesh(&self.u, tolerance)
    }
}

/// Station at `u`, where the problem was factorised last, to the given level of detail.
fn seen(sight: Sight, problem: &mut dyn ZeroProblem, u: Vec<f64>, tangent: Vec<f64>, direction: f64) -> Station {
    let examination = match sight {
        Sight::Everything => return examined(problem, u, tangent, direction),
        Sight::Stability => problem.stability(&u),
        Sight::Tangent => Examination::default(),
    };
    let stored: Vec<f64> = tangent.iter().map(|t| direction * t).collect();
    let point = problem.point(&u, &stored, examination);
    Station::new(point, u, tangent, problem.mesh())
}

/// Completes a station that was only partly examined; the problem must have been factorised there last.
fn completed(problem: &mut dyn ZeroProblem, found: Station, direction: f64) -> Station {
    if found.is_whole() { found } else { examined(problem, found.u, found.tangent, direction) }
}

/// Completes a station like [`completed`], but factorises again: the last trial need not have been the best one.
fn whole(problem: &mut dyn ZeroProblem, found: Station, direction: f64) -> Station {
    if found.is_whole() {
        return found;
    }
    problem.anchor(&found.u);
    let _ = problem.factorise(&found.u, &found.tangent);
    examined(problem, found.u, found.tangent, direction)
}

/// Locates the zero again by the secant method, from the coarse one, on a finer mesh or more closely on its own.
/// `slope` is that of the monitor, if known.
fn relocate(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    stretch: &Stretch,
    monitor: &dyn Monitor,
    coarse: &Station,
    finer: Option<&crate::diagram::Mesh>,
    slope: &mut Option<f64>,
    cost: &mut Cost,
) -> Result<(Station, f64), Failure> {
    let mesh = finer.unwrap_or(&coarse.mesh);
    problem.set_mesh(mesh);
    let row = problem.transfer(&coarse.tangent, &coarse.mesh, mesh);
    let value = |found: &Station| monitor.value(&stretch.left.point, &found.point);
    let mut at = |problem: &mut dyn ZeroProblem, mut u: Vec<f64>, close: f64| -> Result<(f64, Station), Failure> {
        let tangent = arrive(problem, &mut u, &row, close, cost)?;
        if monitor.kind() == Kind::BranchPoint && turned(problem, &tangent, &row) {
            return Err(Failure::Singular);
        }
        let found = seen(monitor.reads(), problem, u, tangent, stretch.direction);
        Ok((value(&found), found))
    };
    // Two meshes may place the zero this far apart along the curve, which can be more than the interval.
    let reach = stretch.length.abs().max(settings.tolerance);
    // So far below the tolerance that iteration errors are negligible, and on a short interval so small a share of it
    // that the monitor is unambiguous.
    let mut enough = (1e-2 * settings.tolerance).min(1e-3 * stretch.length.abs());
    // The difference of two values closer together than this is noise.
    let mut apart = (100.0 * settings.tolerance).min(1e-2 * stretch.length.abs());
    let (mut a, (mut ga, mut found)) = match finer {
        None => (0.0, (value(coarse), coarse.clone())),
        Some(_) => {
            let base = problem.carry(&coarse.u, &coarse.mesh, mesh);
            (0.0, at(problem, base, settings.closeness(mesh, stretch.length))?)
        }
    };
    let mut step = match *slope {
        Some(slope) if (ga / slope).abs() < reach => -ga / slope,
        _ => 1e-2 * reach,
    };
    // Rounds after which the outward search would only repeat itself.
    const OUTWARDS: usize = 19;
    // The closest known point with the other sign. If the monitor bends sharply, secant steps may overshoot this point
    // and are replaced by bisection.
    let mut other: Option<f64> = None;
    // If multipliers change fast along the curve, this may not be close enough to classify them.
    let unclear = |found: &Station, enough: f64| {
        enough > FINEST && monitor.jump() > 0 && monitor.possible(&found.point) && !monitor.confirms(&found.point)
    };
    for round in 0..40 {
        if step.abs() < enough || !step.is_finite() {
            if !step.is_finite() || !unclear(&found, enough) {
                // A station that was never moved was not factorised here.
                let done = if round == 0 && finer.is_none() { whole } else { completed };
                return Ok((done(problem, found, stretch.direction), step.abs()));
            }
            (enough, apart) = (1e-2 * enough, 0.0);
        }
        let mut b = a + step;
        match other {
            Some(o) if (b - a) * (b - o) >= 0.0 => b = 0.5 * (a + o),
            // The search below has covered both sides.
            None if round > OUTWARDS => break,
            None if b.abs() > reach || round > 7 => {
                // No bracket yet: search outwards on both sides alternately, farther each time.
                let sign = if round % 2 == 0 { 1.0 } else { -1.0 };
                b = sign * 1e-3 * reach * f64::from(1 << (round / 2).min(9));
            }
            _ => {}
        }
        let from = found.u.iter().zip(&found.tangent).map(|(u, t)| u + (b - a) * t).collect();
        let (gb, next) = at(problem, from, settings.newton_tolerance().min(0.1 * enough).max(ROUNDING))?;
        // A slope that does not reduce the value is not the slope here.
        let leads = gb.abs() < LEADS * ga.abs() || (b - a).abs() < 100.0 * settings.newton_tolerance();
        let rise = match *slope {
            Some(slope) if (b - a).abs() < apart && leads => slope,
            _ => (gb - ga) / (b - a),
        };
        step = -gb / rise;
        *slope = Some(rise);
        if (gb > 0.0) != (ga > 0.0) {
            other = Some(a);
        }
        (a, ga, found) = (b, gb, next);
        if other.is_some_and(|o| (o - a).abs() < enough) {
            if !unclear(&found, enough) {
                return Ok((completed(problem, found, stretch.direction), enough));
            }
            (enough, apart) = (1e-2 * enough, 0.0);
        }
    }
    Err(Failure::NoConvergence(vec![step.abs()]))
}

/// Bracketing root finder with its first trial at the share `first` of the interval. Returns the root, the result of
/// the evaluation there, and the slope of the function. It ends when the zero is, by the secant, closer than the share
/// `resolution` of the interval and the value is below the share `small` of the larger end value, or when the bracket
/// is a tenth of that resolution.
fn chandrupatla<T>(
    evaluate: &mut dyn FnMut(f64) -> Result<(f64, T), Failure>,
    [mut a, mut b]: [f64; 2],
    [mut fa, mut fb]: [f64; 2],
    first: f64,
    [resolution, small]: [f64; 2],
) -> Result<(f64, T, Option<f64>), Failure> {
    let (mut c, mut fc);
    let (width, largest) = ((b - a).abs(), fa.abs().max(fb.abs()));
    let resolved = 0.1 * resolution;
    let mut t = first.clamp(0.02, 0.98);
    let mut best: Option<(f64, f64, T)> = None;
    let mut slope = None;
    for _ in 0..60 {
        let x = a + t * (b - a);
        let (fx, found) = evaluate(x)?;
        if best.as_ref().is_none_or(|(_, f, _)| fx.abs() <= *f) {
            best = Some((x, fx.abs(), found));
        }
        if fx == 0.0 || !fx.is_finite() {
            break;
        }
        if (fx > 0.0) == (fa > 0.0) {
            (c, fc) = (a, fa);
        } else {
            (c, b, fc, fb) = (b, a, fb, fa);
        }
        (a, fa) = (x, fx);
        let (near, value) = if (c - a).abs() < (b - a).abs() { (c, fc) } else { (b, fb) };
        let rise = (value - fa) / (near - a);
        slope = Some(rise);
        let close = (fa / rise).abs() < resolution * width && fa.abs() < small * largest;
        if close || (b - a).abs() < resolved * width {
            break;
        }
        let (xi, phi) = ((a - b) / (c - b), (fa - fb) / (fc - fb));
        t = if phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi {
            fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        } else {
            0.5
        };
        let margin = 0.1 * resolved * width / (b - a).abs();
        t = if t.is_finite() && margin < 0.5 { t.clamp(margin, 1.0 - margin) } else { 0.5 };
        // The remaining value is the rounding of the end values.
        if fx.abs() < 1e-14 * largest {
            break;
        }
    }
    best.map(|(x, _, found)| (x, found, slope)).ok_or(Failure::NotFinite)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_with_two_extrema_is_recognised_from_its_ends() {
        // x³ - a x on [-1, 1] has slopes 3 - a at both ends, rise 2 - 2 a and extrema at ±(a / 3)^½; slopes double on
        // [0, 1].
        let seen = |a: f64| turns_twice(2.0 - 2.0 * a, [2.0 * (3.0 - a); 2], 0.0);
        assert!(seen(0.5) && seen(0.01), "turns twice");
        assert!(seen(-0.1) && !seen(-1.0), "nearly does; does not");
        // The mirror image, and a cubic with a single extremum between its ends.
        assert!(turns_twice(-1.0, [-5.0; 2], 0.0) && !turns_twice(1.0, [2.0, -1.0], 0.0));
        assert!(!turns_twice(1.0, [1.0; 2], 0.0));
        // The midpoint reveals what the ends do not: it lies a third of the rise off the straight line.
        assert!(turns_twice(1.0, [1.0; 2], 0.33) && !turns_twice(1.0, [1.0; 2], 0.01));
    }

    #[test]
    fn the_root_finder_handles_simple_and_triple_zeros() {
        for (f, root) in [
            ((|x: f64| x.exp() - 2.0) as fn(f64) -> f64, 2f64.ln()),
            (|x| (x - 0.3).powi(3), 0.3),
            (|x| x.atan() - 1.0, 1f64.tan()),
        ] {
            let mut count = 0;
            let mut evaluate = |x: f64| {
                count += 1;
                Ok((f(x), x))
            };
            let (x, ..) = chandrupatla(&mut evaluate, [-1.0, 2.0], [f(-1.0), f(2.0)], 0.5, [1e-8, 1.0]).unwrap();
            assert!((x - root).abs() < 1e-4 && count < 45, "{x} after {count}");
        }
    }
}
