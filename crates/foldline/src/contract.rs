//! The public traits: what a model, a curve, a monitor and an observer must be able to do.
//!
//! **Idea.** Everything else in the crate is written against these few object-safe traits, so a model may be text, traced
//! code or native Rust, and a curve may be an equilibrium, a cycle or a problem nobody has thought of yet.

use crate::diagram::{Branch, Ending, Kind, Mesh, Point, Responses, SpecialPoint, Trust};
use num_complex::Complex64;

/// The parameters of a batch: one set for all lanes, or one set per lane.
#[derive(Clone, Copy, Debug)]
pub enum Parameters<'a> {
    /// `[parameter]`: every lane uses the same values.
    Shared(&'a [f64]),
    /// `[parameter × lanes]`, component-major: lane `l` of parameter `k` at `k * lanes + l`.
    PerLane(&'a [f64]),
}

/// Points at which a vector field is evaluated together, component-major (structure of arrays).
#[derive(Clone, Copy, Debug)]
pub struct Batch<'a> {
    /// How many points.
    pub lanes: usize,
    /// `[dim × lanes]`: component `i` of lane `l` at `i * lanes + l`.
    pub states: &'a [f64],
    /// Parameter values.
    pub parameters: Parameters<'a>,
    /// `[lanes]` where the field is forced: the time of each point in periods of the forcing. Empty where it is autonomous.
    pub times: &'a [f64],
}

/// A vector field x' = f(x, p), x ∈ ℝⁿ, p ∈ ℝᵏ, with exact derivatives, evaluated for a batch of points at once.
///
/// A forced field has x' = f(x, p, τ) where τ is time counted in periods of the forcing, and x' the change per such period: f has
/// the period 1 in τ whatever the parameters are. What one unit of τ is in the time of the model is [`VectorField::time_unit`].
///
/// All arrays are component-major over the lanes of the batch: a quantity with components `c` stores lane `l` at
/// `c * lanes + l`.
pub trait VectorField: Send + Sync {
    /// n, the number of state components.
    fn dim(&self) -> usize;

    /// k, the number of parameters.
    fn parameter_count(&self) -> usize;

    /// f: writes `[n × lanes]`.
    fn evaluate(&self, at: Batch, f: &mut [f64]);

    /// f and its first derivatives: `f` is `[n × lanes]`, `fx` is `[n·n × lanes]` (entry ∂fᵢ/∂xⱼ is component `i * n + j`),
    /// `fp` is `[n·q × lanes]` with q = `free.len()` (entry ∂fᵢ/∂p_{free\[c\]} is component `i * q + c`).
    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]);

    /// The multilinear derivative Dᵏf[d₁, …, dₖ] in states and parameters, k = `directions.len()` ≥ 1: each direction is
    /// `[(n + k_p) × lanes]` (state part first, then all parameters); writes `[n × lanes]`.
    fn directional(&self, at: Batch, directions: &[&[f64]], out: &mut [f64]);

    /// True once the run is to end and the field returns NaN: no lengthy computation need be started.
    fn ended(&self) -> bool {
        false
    }

    /// True if f depends on time.
    fn forced(&self) -> bool {
        false
    }

    /// The unit of the field's time in that of the model: 1, or the period of the forcing at parameters `[k]`.
    fn time_unit(&self, _parameters: &[f64]) -> f64 {
        1.0
    }

    /// `[n]` the period of f in each state: finite for an angle, infinite for others. Empty where no state is an angle.
    ///
    /// States that differ by whole periods are one, and an orbit closes where it comes back to such a copy of its start.
    fn periods(&self) -> &[f64] {
        &[]
    }

    /// How many scalar outputs the model defines besides its states.
    fn output_count(&self) -> usize {
        0
    }

    /// The outputs: writes `[output_count × lanes]`.
    fn outputs(&self, _at: Batch, _out: &mut [f64]) {}

    /// How many switches the field has: scalars at whose zeros f or one of its derivatives jumps. 0 where it is smooth.
    fn switch_count(&self) -> usize {
        0
    }

    /// f `[n]` at one point in twice the working precision: states `[n]`, parameters `[k]` and results are sums of two numbers,
    /// the larger first. `None` where f is not finite, or the field cannot do that. For checks; it may be slow.
    fn evaluate_precisely(&self, _states: &[[f64; 2]], _parameters: &[[f64; 2]]) -> Option<Vec<[f64; 2]>> {
        None
    }

    /// The switches: writes `[switch_count × lanes]`.
    fn switches(&self, _at: Batch, _out: &mut [f64]) {}

    /// Evaluates the branch of f that the given signs of the switches select (±1, `[switch_count × lanes]`), continued smoothly beyond
    /// their zeros; writes `[n × lanes]`. Where that branch is undefined, such as a root of an argument that is positive on one
    /// side only, the actual value of f is used.
    fn evaluate_switched(&self, at: Batch, _signs: &[f64], f: &mut [f64]) {
        self.evaluate(at, f);
    }
}

/// The matrix of a Newton step could not be factorised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Singular;

/// What a curve knows about the stability of one of its points, and how far that can be trusted.
#[derive(Clone, Debug, Default)]
pub struct Examination {
    /// Eigenvalues of an equilibrium; Floquet multipliers of a cycle, the trivial one first where there is one.
    pub spectrum: Vec<Complex64>,
    /// How many trivial ones there are: 1 for cycles of an autonomous field, else 0.
    pub trivial: usize,
    /// How many of them are unstable (the trivial one never counts).
    pub unstable: usize,
    /// Smallest and largest value of every state, then of every output.
    pub ranges: Vec<[f64; 2]>,
    /// Mean and mean square of every state, then of every output.
    pub averages: Vec<[f64; 2]>,
    /// Accuracy of the point.
    pub trust: Trust,
}

/// A curve F(u) = 0, F: ℝⁿ⁺ᵏ → ℝⁿ, k = 1. The last k components of `u` are free parameters over their scales, the very last is that of the
/// continuation. With k > 1 it is a surface, on which something else must be held to make it a curve.
///
/// The problem may be discretised on a mesh that changes along the curve; vectors always belong to the current mesh.
pub trait ZeroProblem {
    /// n + k on the current mesh.
    fn unknowns(&self) -> usize;

    /// Value of the continuation parameter for which its unknown, the last component of `u`, is 1.
    fn unit(&self) -> f64 {
        1.0
    }

    /// Takes `u` as the reference for phase conditions and scales until the next call.
    fn anchor(&mut self, u: &[f64]);

    /// F(u): writes n values (the last k of the n + k slots are left alone). Returns false if f is not finite there.
    fn residual(&mut self, u: &[f64], r: &mut [f64]) -> bool;

    /// Factorises the matrix [F_u(u); rows]: `rows` is `[k][n + k]`, each row acts through [`ZeroProblem::dot`].
    fn factorise(&mut self, u: &[f64], rows: &[f64]) -> Result<(), Singular>;

    /// Solves with the last factorisation. `rhs` and `x` have n + k components, the last k of `rhs` being those of the rows.
    fn solve(&mut self, rhs: &[f64], x: &mut [f64]);

    /// Inner product in scaled variables, in which lengths along the curve are measured.
    fn dot(&self, a: &[f64], b: &[f64]) -> f64;

    /// Size of an update relative to the scale of each component: max |Δuᵢ| / (scaleᵢ + max |uᵢ|).
    fn relative_size(&self, du: &[f64], u: &[f64]) -> f64;

    /// The current mesh; empty for problems that have none.
    fn mesh(&self) -> Mesh;

    /// Moves the problem to another mesh.
    fn set_mesh(&mut self, mesh: &Mesh);

    /// Carries a vector from one mesh to another.
    fn transfer(&self, v: &[f64], from: &Mesh, to: &Mesh) -> Vec<f64>;

    /// The mesh on which `u` would meet `tolerance`, or `None` where it does on the current one. The last factorisation must
    /// be one near `u` on the current mesh.
    fn better_mesh(&self, u: &[f64], tolerance: f64) -> Option<Mesh>;

    /// A mesh with fewer intervals, where less than half of them would do for `tolerance`; asked like
    /// [`ZeroProblem::better_mesh`].
    fn coarser_mesh(&self, _u: &[f64], _tolerance: f64) -> Option<Mesh> {
        None
    }

    /// A mesh with every interval halved; `None` for problems that have none.
    fn finer_mesh(&self) -> Option<Mesh>;

    /// A mesh that is finer everywhere, with half as many intervals again: enough to see the error of the current one.
    fn denser_mesh(&self) -> Option<Mesh> {
        self.finer_mesh()
    }

    /// Stability and trust at `u`, for which [`ZeroProblem::factorise`] was called last.
    fn examine(&mut self, u: &[f64]) -> Examination;

    /// The stability alone, of [`ZeroProblem::examine`], where that is cheaper: what belongs to the spectrum, the rest as it comes.
    fn stability(&mut self, u: &[f64]) -> Examination {
        self.examine(u)
    }

    /// Estimated error of the spectrum at `u`, relative to the larger of 1 and each modulus; `spectrum` is what
    /// [`ZeroProblem::examine`] found there. The last factorisation must be one near `u` on the current mesh, and stays.
    fn spectrum_error(&mut self, _u: &[f64], _spectrum: &[Complex64]) -> f64 {
        f64::NAN
    }

    /// True if f or its derivatives jump somewhere: a mesh does not resolve what happens there.
    fn is_switched(&self) -> bool {
        false
    }

    /// How far a point is from one at which F_x is singular, in terms of its spectrum: small where another branch may be
    /// close by.
    fn margin(&self, at: &Point) -> f64;

    /// How far `u`, which solves equations that were added to, is from solving those that were given, relative: 0 where nothing is added.
    fn departure(&self, _u: &[f64]) -> f64 {
        0.0
    }

    /// Along a curve of folds, a smooth function whose sign tells the two arms of a cusp apart, at a solution `u` on the current mesh. It
    /// may be compared until the next call of [`ZeroProblem::anchor`].
    fn arm(&mut self, _u: &[f64]) -> Option<f64> {
        None
    }

    /// `u` as plain data.
    fn point(&self, u: &[f64], tangent: &[f64], examination: Examination) -> Point;

    /// The unknowns of a point, the mesh being that of the point.
    fn unknowns_of(&mut self, point: &Point) -> Vec<f64>;

    /// Unknowns and tangent of a point as it can be seen no farther than `within` from `beside`: on the current mesh, on which `beside`
    /// is, in that reflection (state i negated where it says so), in every phase that is close where a solution has one. None where
    /// it is farther, or does not belong to this problem.
    fn images(&mut self, beside: &[f64], point: &Point, reflection: &[bool], within: f64) -> Vec<[Vec<f64>; 2]> {
        let mut seen = [self.unknowns_of(point), point.tangent.clone()];
        for (i, _) in reflection.iter().enumerate().filter(|(_, negated)| **negated) {
            seen.iter_mut().filter_map(|v| v.get_mut(i)).for_each(|v| *v = -*v);
        }
        if seen.iter().any(|v| v.len() != beside.len()) {
            return Vec::new();
        }
        let off: Vec<f64> = seen[0].iter().zip(beside).map(|(a, b)| a - b).collect();
        if self.dot(&off, &off) <= within * within { vec![seen] } else { Vec::new() }
    }
}

/// What of a point is looked at beside its solution and its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sight {
    /// Its tangent.
    Tangent,
    /// Its tangent and its spectrum.
    Stability,
    /// All that is ever known of it.
    Everything,
}

/// A scalar along the branch whose sign change between two points is a special point.
pub trait Monitor: Send + Sync {
    /// What is found where the sign changes.
    fn kind(&self) -> Kind;

    /// The value at `at`; `reference` is the accepted point from which the step under inspection starts.
    fn value(&self, reference: &Point, at: &Point) -> f64;

    /// Whether the located zero is an event of this kind (and not, say, a neutral saddle).
    fn confirms(&self, at: &Point) -> bool;

    /// The same with a look at the points `ends` between which the zero was located.
    fn confirms_between(&self, _ends: [&Point; 2], at: &Point) -> bool {
        self.confirms(at)
    }

    /// Parameter value at which a branch that is close to simpler solutions at `at` meets them; `None` if the simpler solutions do not
    /// determine it.
    fn meeting(&self, _at: &Point) -> Option<f64> {
        None
    }

    /// On what of a point the value depends, and whether it is confirmed.
    fn reads(&self) -> Sight {
        Sight::Stability
    }

    /// Whether `at`, which is close to the zero but not there yet, leaves it possible that the zero will be confirmed.
    fn possible(&self, _at: &Point) -> bool {
        true
    }

    /// The factor of the value that vanishes next to `near`, evaluated at `at`. It has the same zero as the value but does not scale
    /// with the other factors, whose number grows with the number of states. `None` if the value is not a product.
    fn factor(&self, _near: &Point, _at: &Point) -> Option<f64> {
        None
    }

    /// By how much an event of this kind changes the number of unstable eigenvalues or multipliers.
    fn jump(&self) -> usize;

    /// Number of events of this kind that account for the unstable eigenvalues or multipliers at `at`. `None` if events of another kind
    /// change the same ones.
    fn passed(&self, _at: &Point) -> Option<usize> {
        None
    }

    /// A monitor of the same events that uses the spectrum alone, for branches along which the parameter changes by rounding only.
    fn by_spectrum(&self) -> Option<Box<dyn Monitor>> {
        None
    }

    /// How the branch ends at a located event, if it does; `parameter` is that of the continuation there.
    fn ending(&self, _at: &Point, _parameter: f64) -> Option<Ending> {
        None
    }

    /// How many eigenvalues or multipliers are unstable at a located event besides those that pass there: on one side of it the count is
    /// this, on the other this with the jump. `None` where some are too close to neutral to say.
    fn others_unstable(&self, _at: &Point) -> Option<usize> {
        None
    }
}

/// The extra unknowns and equations that hold a special point: e unknowns (such as a frequency) and e + 1 scalar equations
/// g = 0, or more by the number of unknowns that the surface has besides two parameters. A surface of solutions with one of them held is a
/// two-parameter curve.
///
/// Vectors `u` are those of the surface, a [`ZeroProblem`] with two free parameters.
pub trait Condition {
    /// What is held.
    fn kind(&self) -> Kind;

    /// e.
    fn extra(&self) -> usize;

    /// How many equations there are.
    fn equations(&self) -> usize {
        self.extra() + 1
    }

    /// Characteristic size of the extra unknowns at the place of the last evaluation.
    fn extra_scale(&self) -> f64 {
        1.0
    }

    /// First values `[e]` of the extra unknowns, from the spectrum of a point close to the special one.
    fn guess(&self, point: &Point) -> Vec<f64>;

    /// Takes the null vectors of the last evaluation as reference until the next call.
    fn anchor(&mut self);

    /// Learns which way the curve goes, in the unknowns of the surface.
    fn face(&mut self, _along: &[f64]) {}

    /// Moves to another mesh.
    fn set_mesh(&mut self, mesh: &Mesh);

    /// g: writes all its values. Returns false if they are not finite there.
    fn evaluate(&mut self, u: &[f64], extra: &[f64], g: &mut [f64]) -> bool;

    /// The derivative of g along (`du`, `extra`) at the place of the last evaluation: writes as many values.
    fn derivative(&mut self, du: &[f64], extra: &[f64], dg: &mut [f64]);

    /// Where folds are held, the null vector found at the last evaluation, as a direction in the unknowns of the surface.
    fn null_direction(&self) -> Option<Vec<f64>> {
        None
    }

    /// The eigenvalues or multipliers that are held, as the extra unknowns say.
    fn held(&self, extra: &[f64]) -> Vec<Complex64>;

    /// How far an eigenvalue or multiplier is from where one is held.
    fn distance(&self, z: Complex64) -> f64;
}

/// What happens while a diagram grows.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A branch begins; it has no points yet, or those of an earlier run that is being resumed.
    Begin(&'a Branch),
    /// A point was found; [`Point::position`] says where on the branch it belongs.
    Point(&'a Branch, &'a Point),
    /// A special point was located behind the last point of its side.
    Special(&'a Branch, &'a SpecialPoint),
    /// One side of the branch ended; side 0 is backward, 1 forward.
    SideEnded(&'a Branch, usize, &'a Ending),
    /// The branch is complete.
    End(&'a Branch),
    /// A remark about a branch or seed, such as a switch that led to a known branch or the attractors that the samples reached.
    Note(&'a str, &'a str),
    /// A request that was not fulfilled: the name of the branch, exploration or sweep, then what was not reached and why.
    Short(&'a str, &'a str),
    /// A survey or sweep has settled, or an exploration has sampled, at one more parameter value: its name, the value, the number of
    /// values done, and their total.
    Visited(&'a str, f64, usize, usize),
    /// A survey or sweep is complete.
    Responses(&'a Responses),
}

/// What an observer wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Go on.
    Continue,
    /// End the branch at this point, keeping everything.
    Stop,
}

/// Receives everything as it happens: progress, storage and live plots hang here.
pub trait Observer: Sync {
    /// Called once per event, from the thread that follows the branch.
    fn observe(&self, event: Event) -> Verdict;

    /// True once the run is to end immediately, even in the middle of a point. Called very often and from every thread. No event is
    /// reported after that, because computations in progress return wrong numbers.
    fn stopping(&self) -> bool {
        false
    }

    /// Whether [`Observer::recall`] answers. Profiles then need not stay in memory.
    fn stores(&self) -> bool {
        false
    }

    /// The point at `position` of a branch, as it was observed.
    fn recall(&self, _branch: &Branch, _position: i64) -> Option<Point> {
        None
    }
}

/// An observer that lets everything pass.
pub struct Unobserved;

impl Observer for Unobserved {
    fn observe(&self, _event: Event) -> Verdict {
        Verdict::Continue
    }
}
