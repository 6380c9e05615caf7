//! Conservative backbones: limits of the forced, damped bouncing cycles as unbalance and damping vanish.
//!
//! **Idea.** Without damping and unbalance the rotor is isotropic and conservative: energy E and angular momentum L are
//! conserved, and an orbit turns by the same angle in every radial period. It closes in the rotating frame if that
//! angle is the right fraction of a turn, which at each speed Ω leaves a one-parameter family of orbits: together with
//! Ω, a surface rather than a curve. Any damping, however small, selects one curve of it, the backbone.
//!
//! **Equations.** With g = (1 - J_p/2)Ω and w = z e^{jgτ}, z = u + jv, the motion takes place in a central field,
//!
//! 1. w″ + (1 + J_p²Ω²/4) w + f(|w|) w = 0, with radial period T_r(E, L, Ω) and apsidal angle A(E, L, Ω)
//! 2. resonance n:m, d = n - m: A - g T_r = -2πm/d (mod 2π); the period in the rotating frame is T = d T_r
//! 3. power: ∮ |z′|² + Ω Im(z̄ z′) dτ = Σ k w (k w + Ω) |c_k|² = 0 (times T)
//! 4. torque: m ε Ω² |c₀| sin α = -2ζ Σ (k w + Ω) |c_k|², where α is the angle of c₀ to the unbalance
//!
//! A forced cycle with ζ > 0 satisfies 3 exactly for any ε and ζ, since a constant force does no work along a closed
//! path. So wherever forced cycles converge as ε, ζ → 0, their limit satisfies 1, 2 and 3: two equations for (E, L) at
//! each Ω. Every point of a lightly damped branch tends to the backbone, not only its folds or its ridge. Equation 4
//! then fixes the orientation of the orbit to the unbalance. For d = 1 (SL) there are two angles, α and π - α, so the
//! two sheets of a forced branch lie on the same backbone. They meet in folds where sin α = ±1, and beyond a fold the
//! backbone has no forced cycle: it has one only where ζ/ε ≤ [`BackbonePoint::damping_limit`] (for contact SL only
//! between two speeds: the branch is closed). For d > 1 (DL: d = 2) the orbit is its own image under a turn by 2π/d, so
//! c₀ vanishes, and the mean torque as a function of α has the period 2π/d. It arises only at order (mεΩ²)^d, and
//! branches reach the backbone only for ζ of order ε^d or below.
//!
//! If ζ = 0 from the start, equation 3 is void and E stays free: for every Ω there is a one-parameter family of cycles
//! for each angle at which the torque vanishes. The limits do not commute: ζ → 0 first, or together with ε → 0 within
//! the bounds above, leads to the backbone; ε → 0 first, at fixed ζ, loses every cycle in a fold.
//!
//! The root is linear: lines at λ± (see [`Ratio`]) with λ₊(λ₊ + Ω)|c₊|² + λ₋(λ₋ + Ω)|c₋|² = 0, at Ω_{n:m}, for
//! r_max → 0 with a cubic spring and for any r_max ≤ 1 with contact. It exists for m ≥ 1, where both lines are
//! backward; otherwise both terms are positive.
//!
//! **Source.** akay2024, section 2, for the equation of motion; the rest is derived here.
//!
//! **Fails when** the ratio occurs at no speed or has m < 1, or when the speed range does not contain the root.

mod flow;
mod problem;

pub use problem::BackboneProblem;

use crate::campbell::{Ratio, undamped_modes};
use crate::contact::ContactLaw;
use crate::field::OverhungRotor;
use crate::quantities::Nondimensional;
use crate::spectrum::Spectrum;
use crate::units::Mistake;
use foldline::continuation::corrector::{Plane, settle};
use foldline::continuation::{Follow, Homecoming, Item, Settings, follow};
use foldline::contract::{Verdict, ZeroProblem};
use foldline::diagram::{Cost, Ending, Point, Solution};

/// Maximum number of points. A backbone over five orders of magnitude in radius needs far fewer; one that creeps
/// towards an orbit of infinite period, as with a softening spring, is ended here.
const MOST_POINTS: usize = 1000;

/// Range and accuracy of a backbone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Smallest and largest Ω.
    pub speeds: [f64; 2],
    /// r_max at which to stop.
    pub radius: f64,
    /// Relative accuracy of the points, 1e-10 to 1e-3.
    pub tolerance: f64,
}

/// A point of a backbone.
#[derive(Clone, Debug)]
pub struct BackbonePoint {
    /// Ω.
    pub speed: f64,
    /// Largest radius.
    pub r_max: f64,
    /// Smallest radius.
    pub r_min: f64,
    /// T = d T_r.
    pub period: f64,
    /// c₀, real as the orbit is stored: it starts at a turning point on the real axis. 0 as long as the orbit feels no
    /// nonlinear force; `None` for d > 1, where it vanishes by symmetry.
    pub mean: Option<f64>,
    /// Σ (k w + Ω) |c_k|²: angular momentum that the unbalance must sustain against damping.
    pub swirl: f64,
    /// m of the rotor.
    pub mass: f64,
    /// The orbit at ζ = ε = 0, with the parameters of [`OverhungRotor`].
    pub point: Point,
}

/// A backbone, starting from its root.
#[derive(Clone, Debug)]
pub struct Backbone {
    /// n:m.
    pub ratio: Ratio,
    /// Ω_{n:m}, the speed of the root.
    pub root: f64,
    /// Points by increasing distance from the root.
    pub points: Vec<BackbonePoint>,
    /// Reason for its end: [`Ending::Stopped`] if r_max reached its limit.
    pub ending: Ending,
}

impl BackbonePoint {
    /// Largest ζ/ε at which a lightly damped branch passes here, to first order: m Ω² |c₀|/(2 |swirl|). `None` for d >
    /// 1, where the first-order ratio does not decide.
    pub fn damping_limit(&self) -> Option<f64> {
        Some(0.5 * self.mass * self.speed * self.speed * self.mean?.abs() / self.swirl.abs())
    }

    /// The two angles by which the stored orbit must be turned to become the limit of forced cycles with that ζ/ε
    /// (equation 4 of the module). `None` beyond the damping limit, and for d > 1.
    pub fn phases(&self, epsilon: f64, zeta: f64) -> Option<[f64; 2]> {
        let sine = -2.0 * zeta * self.swirl / (self.mass * epsilon * self.speed * self.speed * self.mean?);
        (sine.abs() <= 1.0).then(|| [sine.asin(), std::f64::consts::PI - sine.asin()])
    }

    /// The orbit turned by `angle`, as a point with that ε and ζ. It is the limit of forced cycles but not a start for
    /// Newton's method: the torque balance can be differentiated with respect to the angle only once the orbit responds
    /// to the unbalance at first order.
    pub fn turned(&self, angle: f64, epsilon: f64, zeta: f64) -> Point {
        let mut point = self.point.clone();
        let (sin, cos) = angle.sin_cos();
        if let Solution::Cycle(cycle) = &mut point.solution {
            for x in cycle.profile.chunks_exact_mut(4) {
                let [u, v, du, dv] = [x[0], x[1], x[2], x[3]];
                x.copy_from_slice(&[cos * u - sin * v, sin * u + cos * v, cos * du - sin * dv, sin * du + cos * dv]);
            }
        }
        (point.parameters[2], point.parameters[3]) = (zeta, epsilon);
        point
    }
}

impl Backbone {
    /// Points [Ω, r_max] at which lightly damped branches with that ζ/ε turn back, to first order: the damping limit is
    /// passed there. By increasing distance from the root, interpolated between neighbouring points. Empty for d > 1.
    pub fn turning_points(&self, zeta_over_epsilon: f64) -> Vec<[f64; 2]> {
        let excess = |p: &BackbonePoint| p.damping_limit().map(|limit| (limit / zeta_over_epsilon).ln());
        let between = |pair: &[BackbonePoint]| {
            let (a, b) = (excess(&pair[0])?, excess(&pair[1])?);
            let share = a / (a - b);
            let mix = |x: f64, y: f64| x + share * (y - x);
            (a * b <= 0.0 && share.is_finite())
                .then(|| [mix(pair[0].speed, pair[1].speed), mix(pair[0].r_max, pair[1].r_max)])
        };
        self.points.windows(2).filter_map(between).collect()
    }
}

/// Computes the backbone of a ratio n:m at these constants, of which ζ, ε and Ω are ignored.
///
/// # Errors
/// A [`Mistake`] if there is no such backbone, or the reach does not contain its root.
pub fn backbone(constants: &Nondimensional, law: ContactLaw, ratio: Ratio, reach: &Reach) -> Result<Backbone, Mistake> {
    let place = format!("ratio {}:{}", ratio.backward, ratio.forward);
    let root = root(constants, ratio, reach, &place)?;
    let tolerance = reach.tolerance.clamp(1e-10, 1e-3);
    let mut problem = BackboneProblem::new(OverhungRotor { law }, *constants, ratio, 1e-3 * tolerance);
    let settings = Settings { max_points: MOST_POINTS, ..Settings::new(tolerance, reach.speeds, &[1.0; 4]) };
    // Contact is not felt below r = 1. A cubic spring is felt at any radius, and least at the smallest.
    let first: f64 = if constants.kappa < 1.0 { 1e-3 } else { 0.5 };
    let start = linear_orbit(root, constants.polar, first.min(0.5 * reach.radius));
    problem.anchor(&start);
    let plane = Plane { row: vec![1.0, 0.0, 0.0, 0.0], base: start.to_vec(), distance: 0.0 };
    let begun = settle(&mut problem, &settings, plane, start.to_vec(), 1.0, &mut Cost::default());
    let begun = begun.map_err(|why| Mistake {
        place,
        cause: format!("the linear orbit at Omega = {root} is not the root: {why}"),
        cure: "give finite constants with a smooth spring".into(),
    })?;
    let mut points = vec![described(begun.point.clone(), constants, ratio)];
    let mut walk = Follow {
        problem: &mut problem,
        settings: &settings,
        monitors: &[],
        marks: &[],
        collapses: &[],
        limit: &|_| None,
        corner: &|_| None,
        holds: false,
        symmetric: false,
        direction: 1.0,
        free: 0,
        home: None,
        first_period: begun.point.solution.free_period(),
        homecoming: Homecoming::default(),
        inspected: 0.0,
        resolved: f64::INFINITY,
    };
    let ending = follow(&mut walk, begun, None, 0, &mut |item| {
        if let Item::Point(point) = item {
            points.push(described(point, constants, ratio));
        }
        if points.last().is_some_and(|p| p.r_max >= reach.radius) { Verdict::Stop } else { Verdict::Continue }
    });
    Ok(Backbone { ratio, root, points, ending })
}

/// Ω_{n:m}, if the backbone exists there.
fn root(constants: &Nondimensional, ratio: Ratio, reach: &Reach, place: &str) -> Result<f64, Mistake> {
    let mistake = |cause: String, cure: String| Mistake { place: place.to_string(), cause, cure };
    if ratio.forward < 1 {
        let cause = "damping takes power from both lines or from none".to_string();
        return Err(mistake(cause, "give n:m with 1 ≤ m < n, such as 2:1".to_string()));
    }
    let forward = ratio.forward.unsigned_abs();
    if let Some(divisor) = (2..=forward).rev().find(|d| forward.is_multiple_of(*d) && ratio.backward.is_multiple_of(*d))
    {
        let cure = format!("give {}:{}", ratio.backward / divisor, forward / divisor);
        return Err(mistake("it is not in lowest terms".to_string(), cure));
    }
    let root = ratio.speed(constants.polar, 1.0).ok_or_else(|| {
        let limit = ratio.polar_limit();
        mistake(format!("it occurs at no speed for J_p = {}", constants.polar), format!("J_p is below {limit:.6}"))
    })?;
    let [low, high] = reach.speeds;
    if !(low < root && root < high && reach.radius > 0.0) {
        let cause = format!("its root Omega = {root:.6} lies outside {low} to {high}, or the radius is not positive");
        return Err(mistake(
            cause,
            "choose a range of speeds that contains the root, and a positive radius".to_string(),
        ));
    }
    Ok(root)
}

/// Unknowns of the linear orbit of largest radius `radius` that satisfies the power balance.
fn linear_orbit(speed: f64, polar: f64, radius: f64) -> [f64; 4] {
    let modes = undamped_modes(speed, polar, 1.0);
    let power = |k: usize| modes.rotating[k] * modes.inertial[k];
    let share = (-power(0) / power(1)).sqrt();
    let (forward, backward) = (radius / (1.0 + share), radius * share / (1.0 + share));
    let across = forward * modes.rotating[0] + backward * modes.rotating[1];
    let half = std::f64::consts::PI / (modes.rotating[0] - modes.rotating[1]);
    [radius, across, half, speed]
}

fn described(point: Point, constants: &Nondimensional, ratio: Ratio) -> BackbonePoint {
    let speed = point.parameters[0];
    let [r_min, r_max] = point.ranges.last().copied().unwrap_or([f64::NAN; 2]);
    let symmetric = i64::from(ratio.backward) - i64::from(ratio.forward) > 1;
    let (period, mean, swirl) = match &point.solution {
        Solution::Cycle(cycle) => {
            let spectrum = Spectrum::of(cycle, speed);
            (cycle.period, spectrum.amplitude(0).re, spectrum.swirl())
        }
        Solution::Equilibrium(_) | Solution::Torus(_) => (f64::NAN, f64::NAN, f64::NAN),
    };
    let mean = (!symmetric).then_some(mean);
    BackbonePoint { speed, r_max, r_min, period, mean, swirl, mass: constants.mass, point }
}
