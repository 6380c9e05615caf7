//! The public traits: what a model, a curve, a monitor and an observer must provide.
//!
//! **Idea.** The rest of the crate is written against these few object-safe traits. A model may therefore be text,
//! traced code or native Rust, and a curve may consist of equilibria, cycles or solutions of a new kind of problem.

use crate::diagram::{
    Branch, Cycle, Design, Ending, Kind, MapCell, Mesh, Point, Responses, SpecialPoint, Symmetry, Trust,
};
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
    /// Number of points.
    pub lanes: usize,
    /// `[dim × lanes]`: component `i` of lane `l` at `i * lanes + l`.
    pub states: &'a [f64],
    /// Parameter values.
    pub parameters: Parameters<'a>,
    /// `[lanes]` for a forced field: the time of each point in forcing periods. Empty for an autonomous field.
    pub times: &'a [f64],
    /// `[switch_count × lanes]`: ±1 selects the branch of f and of its derivatives, continued smoothly beyond the zeros
    /// of the switching functions; 0, for at most one switch of a point, motion along the surface on which it vanishes
    /// (Filippov's combination of both branches). Empty: the branch in force at each point. A branch that is undefined
    /// at a point, such as a root whose argument is positive on one side only, is replaced by the one in force.
    pub signs: &'a [f64],
}

/// Test function whose sign depends on the signs of eigenvectors.
#[derive(Clone, Debug, PartialEq)]
pub struct Turning {
    /// Value.
    pub value: f64,
    /// Vector with the same dependence: two values have comparable signs if the product of their vectors is positive.
    pub refer: Vec<f64>,
}

/// A vector field x' = f(x, p), x ∈ ℝⁿ, p ∈ ℝᵏ, with exact derivatives, evaluated for a batch of points at once.
///
/// A forced field is x' = f(x, p, τ), where τ is time in forcing periods and x' the change per forcing period. f has
/// period 1 in τ for all parameter values. [`VectorField::time_unit`] is the length of one unit of τ in the time of the
/// model.
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

    /// f and its first derivatives: `f` is `[n × lanes]`, `fx` is `[n·n × lanes]` (entry ∂fᵢ/∂xⱼ is component
    /// `i * n + j`), `fp` is `[n·q × lanes]` with q = `free.len()` (entry ∂fᵢ/∂p_{free\[c\]} is component `i * q + c`).
    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]);

    /// Multilinear derivative Dᵏf[d₁, …, dₖ] in states and parameters, k = `directions.len()` ≥ 1. Each direction is
    /// `[(n + k_p) × lanes]` (state part first, then all parameters); writes `[n × lanes]`.
    fn directional(&self, at: Batch, directions: &[&[f64]], out: &mut [f64]);

    /// True once the run is ending and the field returns NaN; no lengthy computation should then be started.
    fn ended(&self) -> bool {
        false
    }

    /// True if f depends on time.
    fn forced(&self) -> bool {
        false
    }

    /// Returns the forced field if this one is its autonomous form, whose last two states traverse the unit circle once
    /// per forcing period; `None` for any other field.
    fn unclocked(&self) -> Option<&dyn VectorField> {
        None
    }

    /// True for a map x_{k+1} = f(x_k, p). One iteration is one unit of the field's time and counts as one forcing
    /// period, so that the period of a cycle is prescribed: [`VectorField::forced`] is true, and f depends on no time.
    fn iterated(&self) -> bool {
        false
    }

    /// Length of one unit of the field's time in the time of the model: 1, or the forcing period at parameters `[k]`.
    fn time_unit(&self, _parameters: &[f64]) -> f64 {
        1.0
    }

    /// Derivatives `[k]` of [`VectorField::time_unit`] with respect to the parameters.
    fn time_unit_slopes(&self, parameters: &[f64]) -> Vec<f64> {
        vec![0.0; parameters.len()]
    }

    /// Parameter that is the phase, in turns at τ = 0, of a second forcing; `None` if there is none.
    ///
    /// With a second forcing f does not have period 1 in τ: it repeats when τ grows by 1 while the phase falls by ρ, the
    /// [`VectorField::second_turns`], and when the phase alone grows by 1.
    fn second_phase(&self) -> Option<usize> {
        None
    }

    /// ρ, the turns of the second forcing per unit of τ, and its derivatives `[k]` with respect to the parameters.
    fn second_turns(&self, parameters: &[f64]) -> (f64, Vec<f64>) {
        (0.0, vec![0.0; parameters.len()])
    }

    /// `[n]` periods of f in each state: finite for an angle, infinite for other states. Empty if no state is an angle.
    ///
    /// States that differ by whole periods are identified, and an orbit closes when it returns to such a copy of its
    /// start.
    fn periods(&self) -> &[f64] {
        &[]
    }

    /// Number of scalar outputs that the model defines besides its states.
    fn output_count(&self) -> usize {
        0
    }

    /// The outputs: writes `[output_count × lanes]`.
    fn outputs(&self, _at: Batch, _out: &mut [f64]) {}

    /// The outputs with their derivatives, into `[g, gx, gp, gt]`, laid out as by [`VectorField::linearise_switches`]
    /// with outputs in place of switches. False, with nothing written, if the field does not provide derivatives.
    fn linearise_outputs(&self, _at: Batch, _free: &[usize], _to: [&mut [f64]; 4]) -> bool {
        self.output_count() == 0
    }

    /// Derivative of the outputs along a direction `[(n + k) × lanes]` in states and parameters, as for
    /// [`VectorField::directional`]: writes `[output_count × lanes]`. NaN for a field that does not provide it.
    fn outputs_along(&self, _at: Batch, _direction: &[f64], out: &mut [f64]) {
        out.fill(f64::NAN);
    }

    /// Derivative of [`VectorField::time_unit`] along a change `[k]` of the parameters; NaN for a field that does not
    /// provide it.
    fn time_unit_along(&self, _parameters: &[f64], _change: &[f64]) -> f64 {
        if self.forced() && !self.iterated() { f64::NAN } else { 0.0 }
    }

    /// Number of switching functions: scalars at whose zeros f, one of its derivatives or the state jumps. 0 if the
    /// field is smooth.
    fn switch_count(&self) -> usize {
        0
    }

    /// Number of events, at which the state jumps. They are the last switches; f does not depend on their signs.
    fn event_count(&self) -> usize {
        0
    }

    /// Direction in which the switch of an event must cross zero for the state to jump: 1, -1, or 0 for both.
    fn event_direction(&self, _event: usize) -> f64 {
        0.0
    }

    /// The state R(x, p, τ) after an event at a single point, and its derivatives, into `[R, R_x, R_p, R_τ]`: `[n]`,
    /// `[n × n]`, `[n × q]` with q = `free.len()`, and `[n]`.
    fn reset(&self, _event: usize, _at: Batch, _free: &[usize], _to: [&mut [f64]; 4]) {}

    /// Index of the first event whose condition one of the points violates; `None` if all points are allowed.
    fn forbidden(&self, _at: Batch) -> Option<usize> {
        None
    }

    /// ∂f/∂τ `[n × lanes]` of a forced field with events; 0 for others.
    fn slopes_in_time(&self, _at: Batch, out: &mut [f64]) {
        out.fill(0.0);
    }

    /// f `[n]` at one point in twice the working precision. States `[n]`, parameters `[k]` and results are sums of two
    /// numbers, the larger first. `None` if f is not finite or the field does not support this. Meant for checks; it
    /// may be slow.
    fn evaluate_precisely(&self, _states: &[[f64; 2]], _parameters: &[[f64; 2]]) -> Option<Vec<[f64; 2]>> {
        None
    }

    /// True if no component of f depends on the signs of both switches: an orbit may slide along both surfaces at once.
    fn are_independent(&self, _one: usize, _other: usize) -> bool {
        false
    }

    /// Name of a switch, for messages.
    fn switch_name(&self, switch: usize) -> String {
        format!("switch {}", switch + 1)
    }

    /// The switching functions: writes `[switch_count × lanes]`.
    fn switches(&self, _at: Batch, _out: &mut [f64]) {}

    /// The switching functions h with their derivatives, into `[h, hx, hp, ht]`: `h` is `[switch_count × lanes]`; `hx`
    /// is `[switch_count·n × lanes]` (entry ∂hₛ/∂xⱼ is component `s * n + j`), `hp` likewise with q = `free.len()`, and
    /// `ht` is `[switch_count × lanes]`, the derivative in τ. A field with switches must override it.
    fn linearise_switches(&self, _at: Batch, _free: &[usize], _to: [&mut [f64]; 4]) {}

    /// Numbers of conditions at both ends and on integrals of a boundary-value problem, [0, 0] for any other field. The
    /// interval is τ ∈ [0, 1], and [`VectorField::time_unit`] its length; [`VectorField::forced`] is true, but f need
    /// not be periodic. There are as many conditions as states and [`VectorField::determined`] parameters.
    fn conditions(&self) -> [usize; 2] {
        [0, 0]
    }

    /// Parameters that the conditions of a boundary-value problem determine along with the solution.
    fn determined(&self) -> &[usize] {
        &[]
    }

    /// The conditions B(x(0), x(1), p) at the states `ends` `[n]` and their derivatives, into `[B, B_left, B_right,
    /// B_p]`: `[b]`, `[b × n]` twice, and `[b × q]` with q = `free.len()`.
    fn boundary(&self, _ends: [&[f64]; 2], _parameters: &[f64], _free: &[usize], _to: [&mut [f64]; 4]) {}

    /// The integrands g, whose integrals over the interval vanish, and their derivatives, into `[g, g_x, g_p]`: `[i ×
    /// lanes]`; `[i·n × lanes]` and `[i·q × lanes]`, ordered as by [`VectorField::linearise`].
    fn integrands(&self, _at: Batch, _free: &[usize], _to: [&mut [f64]; 3]) {}

    /// Makes the conditions of a boundary-value problem refer to a solution with these states at its ends, by changing
    /// parameters that occur in the conditions only.
    fn refer(&self, _ends: [&[f64]; 2], _parameters: &mut [f64]) {}

    /// Estimates `[b]` of the terms that the conditions at the ends neglect; empty if they are exact.
    fn remainders(&self, _ends: [&[f64]; 2], _parameters: &[f64]) -> Vec<f64> {
        Vec::new()
    }

    /// For orbits that connect equilibria, the eigenvalues at the one where they begin and at the one where they end.
    fn saddles(&self, _parameters: &[f64]) -> Option<[Vec<Complex64>; 2]> {
        None
    }

    /// For orbits that connect equilibria, test functions of orbit flips at the end and at the start, and of inclination
    /// flips of the stable and the unstable manifold; `None` where the leading eigenvalue is complex or the only one.
    fn flips(&self, _orbit: &Cycle, _parameters: &[f64]) -> [Option<Turning>; 4] {
        Default::default()
    }

    /// An orbit that connects equilibria, and its parameters, continued approximately until its ends are closer to them by
    /// the factor `share`; with a factor greater than 1, cut where it is farther from them.
    fn lengthened(&self, _orbit: &Cycle, _parameters: &[f64], _share: f64) -> Option<(Cycle, Vec<f64>)> {
        None
    }

    /// Rates of change of a switching function under the branches of f on its negative and on its positive side,
    /// ∇h·f + h_t: `[lanes]` each. `at.signs` selects the branch of the other switches.
    fn normal_speeds(&self, at: Batch, switch: usize) -> [Vec<f64>; 2] {
        let (n, count, lanes) = (self.dim(), self.switch_count(), at.lanes);
        let [mut h, mut hx, mut ht] = [count, count * n, count].map(|size| vec![0.0; size * lanes]);
        self.linearise_switches(Batch { signs: &[], ..at }, &[], [&mut h, &mut hx, &mut [], &mut ht]);
        let mut signs = at.signs.to_vec();
        [-1.0, 1.0].map(|side| {
            signs[switch * lanes..(switch + 1) * lanes].fill(side);
            let mut f = vec![0.0; n * lanes];
            self.evaluate(Batch { signs: &signs, ..at }, &mut f);
            let moved = |l: usize| (0..n).map(|c| hx[(switch * n + c) * lanes + l] * f[c * lanes + l]).sum::<f64>();
            (0..lanes).map(|l| moved(l) + ht[switch * lanes + l]).collect()
        })
    }
}

/// The matrix of a Newton step could not be factorised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Singular;

/// Stability of a point on a curve, and the accuracy of the point.
#[derive(Clone, Debug, Default)]
pub struct Examination {
    /// Eigenvalues of an equilibrium, or Floquet multipliers of a cycle with the trivial one, if any, first.
    pub spectrum: Vec<Complex64>,
    /// Number of trivial multipliers: 1 for cycles of an autonomous field, else 0.
    pub trivial: usize,
    /// Number of unstable eigenvalues or multipliers (the trivial one never counts).
    pub unstable: usize,
    /// Smallest and largest value of every state, then of every output.
    pub ranges: Vec<[f64; 2]>,
    /// Mean and mean square of every state, then of every output.
    pub averages: Vec<[f64; 2]>,
    /// Accuracy of the point.
    pub trust: Trust,
}

/// A change of a solution, seen from points that move along time with its jumps.
#[derive(Clone, Debug)]
pub struct Shift {
    /// `[N + 1]`: shift of every mesh boundary, in periods; linear in between.
    pub times: Vec<f64>,
    /// `[unknowns]`: change at the moving points.
    pub shape: Vec<f64>,
}

/// A curve F(u) = 0, F: ℝⁿ⁺ᵏ → ℝⁿ, k = 1. The last k components of `u` are free parameters divided by their scales; the
/// very last is the continuation parameter. With k > 1 the solutions form a surface, and further conditions are needed
/// to select a curve on it.
///
/// The problem may be discretised on a mesh that changes along the curve. Vectors always belong to the current mesh.
pub trait ZeroProblem {
    /// n + k on the current mesh.
    fn unknowns(&self) -> usize;

    /// Value of the continuation parameter at which the corresponding unknown, the last component of `u`, equals 1.
    fn unit(&self) -> f64 {
        1.0
    }

    /// Uses `u` as the reference for phase conditions and scales until the next call.
    fn anchor(&mut self, u: &[f64]);

    /// Evaluates F(u): writes n values and leaves the last k of the n + k slots alone. Returns false if f is not
    /// finite.
    fn residual(&mut self, u: &[f64], r: &mut [f64]) -> bool;

    /// Reason, other than a non-finite f, for which [`ZeroProblem::residual`] has no value at `u`.
    fn obstacle(&self, _u: &[f64]) -> Option<&'static str> {
        None
    }

    /// Factorises the matrix [F_u(u); rows]. `rows` is `[k][n + k]`; each row acts through [`ZeroProblem::dot`].
    fn factorise(&mut self, u: &[f64], rows: &[f64]) -> Result<(), Singular>;

    /// Solves with the last factorisation. `rhs` and `x` have n + k components; the last k of `rhs` belong to the rows.
    fn solve(&mut self, rhs: &[f64], x: &mut [f64]);

    /// Inner product in scaled variables, in which lengths along the curve are measured.
    fn dot(&self, a: &[f64], b: &[f64]) -> f64;

    /// Size of an update relative to the scale of each component: max |Δuᵢ| / (scaleᵢ + max |uᵢ|).
    fn relative_size(&self, du: &[f64], u: &[f64]) -> f64;

    /// The current mesh; empty for problems without a mesh.
    fn mesh(&self) -> Mesh;

    /// True if the spectrum consists of multipliers, so that the unit circle decides stability.
    fn has_multipliers(&self) -> bool {
        !self.mesh().is_empty()
    }

    /// Moves the problem to another mesh.
    fn set_mesh(&mut self, mesh: &Mesh);

    /// Carries a vector from one mesh to another.
    fn transfer(&self, v: &[f64], from: &Mesh, to: &Mesh) -> Vec<f64>;

    /// Carries a solution to another mesh, accurately also where it is not smooth, unlike [`ZeroProblem::transfer`].
    fn carry(&self, u: &[f64], from: &Mesh, to: &Mesh) -> Vec<f64> {
        self.transfer(u, from, to)
    }

    /// Interpolates between close solutions on the current mesh, with weights that add up to 1; accurate also where a
    /// solution is not smooth.
    fn blended(&self, solutions: &[&[f64]], weights: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; self.unknowns()];
        for (weight, own) in weights.iter().zip(solutions) {
            sum.iter_mut().zip(*own).for_each(|(sum, u)| *sum += weight * u);
        }
        sum
    }

    /// Splits a change of the solution `u` on the current mesh into a shift in time and a change of shape; `None` if the
    /// problem does not support this.
    fn shift(&self, _u: &[f64], _change: &[f64]) -> Option<Shift> {
        None
    }

    /// Returns a mesh on which `u` would meet `tolerance`, or `None` if it does so on the current mesh. The last
    /// factorisation must have been near `u` on the current mesh.
    fn better_mesh(&self, u: &[f64], tolerance: f64) -> Option<Mesh>;

    /// Returns a mesh with fewer intervals, if fewer than half suffice for `tolerance`. The requirements are those of
    /// [`ZeroProblem::better_mesh`].
    fn coarser_mesh(&self, _u: &[f64], _tolerance: f64) -> Option<Mesh> {
        None
    }

    /// The current mesh with every interval halved; `None` for problems without a mesh.
    fn finer_mesh(&self) -> Option<Mesh>;

    /// A mesh that is finer everywhere, with 1.5 times as many intervals: enough to reveal the error of the current
    /// one.
    fn denser_mesh(&self) -> Option<Mesh> {
        self.finer_mesh()
    }

    /// Stability and accuracy at `u`, where [`ZeroProblem::factorise`] was called last.
    fn examine(&mut self, u: &[f64]) -> Examination;

    /// The spectral part of [`ZeroProblem::examine`], where that is cheaper to compute; the other fields need not be
    /// set.
    fn stability(&mut self, u: &[f64]) -> Examination {
        self.examine(u)
    }

    /// Estimated error of the spectrum at `u`, relative to the larger of 1 and each modulus: its difference from that of
    /// the nearest exact solution of the branch or, where the field has switches or events and no fold is near, of the one at
    /// the same value of the parameter. `spectrum` is the result of [`ZeroProblem::examine`] at `u`, and `tangent` the
    /// unit tangent there. The last factorisation must have been near `u` on the current mesh, and is kept.
    fn spectrum_error(&mut self, _u: &[f64], _tangent: &[f64], _spectrum: &[Complex64]) -> f64 {
        f64::NAN
    }

    /// Rounding error of the eigenvalue closest to 0 at a solution `u` with this tangent; 0 where none is computed.
    fn blur(&mut self, _u: &[f64], _tangent: &[f64]) -> f64 {
        0.0
    }

    /// True if f or its derivatives jump somewhere, which no mesh resolves.
    fn is_switched(&self) -> bool {
        false
    }

    /// Distance of a point from one with singular F_x, measured by its spectrum. It is small where another branch may
    /// be close.
    fn margin(&self, at: &Point) -> f64;

    /// Relative residual of the original equations at `u`, which solves an unfolded system; 0 if no unfolding terms are
    /// present.
    fn departure(&self, _u: &[f64]) -> f64 {
        0.0
    }

    /// Cusp test function along a curve of folds: a smooth function at a solution `u` on the current mesh whose sign
    /// distinguishes the two fold curves that meet at a cusp. Values are comparable until the next call of
    /// [`ZeroProblem::anchor`].
    fn arm(&mut self, _u: &[f64]) -> Option<f64> {
        None
    }

    /// Fixes the branch of a switched field that is in force at `u` (on a switching surface, the one to which `along`
    /// leads) until [`ZeroProblem::cross`]. Returns false if the problem does not support this.
    fn hold_branch(&mut self, _u: &[f64], _along: &[f64]) -> bool {
        false
    }

    /// At a solution on a switching surface, changes to the branch of f on the other side and returns the unit tangent
    /// there that leads away from the surface. Returns `None` and changes nothing if the problem has fixed no branch or
    /// f jumps.
    fn cross(&mut self, _u: &[f64], _along: &[f64], _switch: usize) -> Option<Vec<f64>> {
        None
    }

    /// `u` as plain data.
    fn point(&self, u: &[f64], tangent: &[f64], examination: Examination) -> Point;

    /// The unknowns of a point. The current mesh must be that of the point.
    fn unknowns_of(&mut self, point: &Point) -> Vec<f64>;

    /// Copies (unknowns and tangent) of a point under `symmetry` and, for a
    /// solution with free phase, under all phase shifts that bring it close to `beside`. They are on the current mesh,
    /// as is `beside`. Empty if no copy is within `within` of `beside`, or if the point does not belong to this
    /// problem.
    fn images(&mut self, beside: &[f64], point: &Point, symmetry: &Symmetry, within: f64) -> Vec<[Vec<f64>; 2]> {
        let mut seen = [self.unknowns_of(point), point.tangent.clone()];
        seen.iter_mut().filter_map(|v| v.get_mut(..symmetry.dim())).for_each(|x| symmetry.apply(x));
        if seen.iter().any(|v| v.len() != beside.len()) {
            return Vec::new();
        }
        let off: Vec<f64> = seen[0].iter().zip(beside).map(|(a, b)| a - b).collect();
        if self.dot(&off, &off) <= within * within { vec![seen] } else { Vec::new() }
    }
}

/// Level of detail at which a point is computed, besides its solution and parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sight {
    /// The point and its tangent.
    Tangent,
    /// The point, its tangent and its spectrum.
    Stability,
    /// Everything that a stored point contains.
    Everything,
}

/// A single event between two points, and the values of its monitor there.
pub struct Separate<'m> {
    /// Monitor of the event alone.
    pub monitor: Box<dyn Monitor + 'm>,
    /// Its values at both points.
    pub values: [f64; 2],
}

/// Events between two points, from a monitor that distinguishes them.
#[derive(Default)]
pub struct Events<'m> {
    /// Events that are apparent at both points.
    pub seen: Vec<Separate<'m>>,
    /// Positions between the points, as fractions of their distance, at which a value may have passed zero before it
    /// returns.
    pub turns: Vec<f64>,
}

/// A scalar test function along the branch; a change of its sign between two points indicates a special point.
pub trait Monitor: Send + Sync {
    /// Kind of special point at which the sign changes.
    fn kind(&self) -> Kind;

    /// The value at `at`; `reference` is the accepted point from which the step under inspection starts.
    fn value(&self, reference: &Point, at: &Point) -> f64;

    /// True if the located zero is an event of this kind (and not, say, a neutral saddle).
    fn confirms(&self, at: &Point) -> bool;

    /// Confirms the event as in [`Monitor::confirms`], given also the points `ends` between which the zero was located.
    fn confirms_between(&self, _ends: [&Point; 2], at: &Point) -> bool {
        self.confirms(at)
    }

    /// Parameter value at which a branch that is close to simpler solutions at `at` meets them; `None` if the simpler
    /// solutions do not determine it.
    fn meeting(&self, _at: &Point) -> Option<f64> {
        None
    }

    /// Level of detail that the value and its confirmation need.
    fn reads(&self) -> Sight {
        Sight::Stability
    }

    /// True if the sign of the value has a meaning only for one reference: it depends on the orientation of vectors there.
    fn is_oriented(&self) -> bool {
        false
    }

    /// True if the zero may still be confirmed, judging by the nearby point `at`.
    fn possible(&self, _at: &Point) -> bool {
        true
    }

    /// The single events between two points, `length` apart along the branch in the direction of growing positions, if
    /// several may occur within a step.
    fn separately<'m>(&'m self, _left: &Point, _right: &Point, _length: f64) -> Option<Events<'m>> {
        None
    }

    /// Description of a located event; `forwards` is false if it was passed towards smaller positions.
    fn remark(&self, _at: &Point, _forwards: bool) -> String {
        String::new()
    }

    /// Label that identifies the event: two events of one kind with equal labels at one point are the same event.
    fn label(&self) -> usize {
        0
    }

    /// A function with the zero of the value that is smooth along the branch, also where eigenvalues or multipliers
    /// meet and become complex; `None` if the value itself is to be used.
    fn smooth(&self, _at: &Point) -> Option<f64> {
        None
    }

    /// The factor of the value that vanishes next to `near`, evaluated at `at`. It has the same zero as the value but
    /// does not scale with the other factors, whose number grows with the number of states. `None` if the value is not
    /// a product.
    fn factor(&self, _near: &Point, _at: &Point) -> Option<f64> {
        None
    }

    /// Change in the number of unstable eigenvalues or multipliers at an event of this kind.
    fn jump(&self) -> usize;

    /// Number of events of this kind that account for the unstable eigenvalues or multipliers at `at`; `None` if events
    /// of another kind can change the same eigenvalues or multipliers.
    fn passed(&self, _at: &Point) -> Option<usize> {
        None
    }

    /// A monitor of the same events that uses the spectrum alone, for branches along which the parameter changes by
    /// rounding only.
    fn by_spectrum(&self) -> Option<Box<dyn Monitor>> {
        None
    }

    /// Ending of the branch at a located event, if the event ends it. `parameter` is the continuation parameter there.
    fn ending(&self, _at: &Point, _parameter: f64) -> Option<Ending> {
        None
    }

    /// Number of unstable eigenvalues or multipliers at a located event, not counting the critical ones. The count on
    /// one side of the event is this number, on the other side this number plus the jump. `None` if some are too close
    /// to neutral to decide.
    fn others_unstable(&self, _at: &Point) -> Option<usize> {
        None
    }
}

/// Defining system of a bifurcation curve: e extra unknowns (such as a frequency) and e + 1 scalar equations g = 0, or
/// more if the surface has unknowns besides two parameters (one equation each). Together with the equations of the
/// surface they define a two-parameter curve.
///
/// Vectors `u` are those of the surface, a [`ZeroProblem`] with two free parameters.
pub trait Condition {
    /// Kind of bifurcation that is continued.
    fn kind(&self) -> Kind;

    /// e, the number of extra unknowns.
    fn extra(&self) -> usize;

    /// Number of equations.
    fn equations(&self) -> usize {
        self.extra() + 1
    }

    /// Characteristic size of the extra unknowns at the point of the last evaluation.
    fn extra_scale(&self) -> f64 {
        1.0
    }

    /// Initial values `[e]` of the extra unknowns, from the spectrum of a point close to the bifurcation.
    fn guess(&self, point: &Point) -> Vec<f64>;

    /// Uses the null vectors of the last evaluation as reference until the next call.
    fn anchor(&mut self);

    /// Sets the direction of the curve, in the unknowns of the surface.
    fn face(&mut self, _along: &[f64]) {}

    /// Moves to another mesh.
    fn set_mesh(&mut self, mesh: &Mesh);

    /// Evaluates g. Returns false if its values are not finite.
    fn evaluate(&mut self, u: &[f64], extra: &[f64], g: &mut [f64]) -> bool;

    /// Reason, other than a non-finite g, for which [`Condition::evaluate`] has no value at these extra unknowns.
    fn obstacle(&self, _extra: &[f64]) -> Option<&'static str> {
        None
    }

    /// Derivative of g along (`du`, `extra`) at the point of the last evaluation; writes as many values as g has.
    fn derivative(&mut self, du: &[f64], extra: &[f64], dg: &mut [f64]);

    /// For curves of folds, the null vector at the last evaluation, as a direction in the unknowns of the surface.
    fn null_direction(&self) -> Option<Vec<f64>> {
        None
    }

    /// The critical eigenvalues or multipliers, given the extra unknowns.
    fn held(&self, extra: &[f64]) -> Vec<Complex64>;

    /// Distance of an eigenvalue or multiplier from the critical position.
    fn distance(&self, z: Complex64) -> f64;
}

/// An event during the computation of a diagram.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A branch begins; it has no points yet, or those of an earlier run that is being resumed.
    Begin(&'a Branch),
    /// A point was found; [`Point::position`] is its position on the branch.
    Point(&'a Branch, &'a Point),
    /// A special point was located, after the last point reported on its side.
    Special(&'a Branch, &'a SpecialPoint),
    /// One side of the branch ended; side 0 is backward, 1 forward.
    SideEnded(&'a Branch, usize, &'a Ending),
    /// The branch is complete.
    End(&'a Branch),
    /// A remark about a branch or seed, such as a switch that led to a known branch or the attractors that the samples
    /// reached.
    Note(&'a str, &'a str),
    /// A request that was not fulfilled: the name of the branch, exploration or sweep, then what was not reached and
    /// why.
    Short(&'a str, &'a str),
    /// A survey or sweep has settled, or an exploration has sampled, at one more parameter value: its name, the value,
    /// the number of values done, and their total.
    Visited(&'a str, f64, usize, usize),
    /// A survey or sweep is complete.
    Responses(&'a Responses),
    /// A design question is settled: answered, or not, with the reasons.
    Design(&'a Design),
    /// A cell of a map over parameters is computed: the cell, the number of cells done, and of all those known to be needed.
    Mapped(&'a MapCell, usize, usize),
}

/// The observer's decision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Continue the branch.
    Continue,
    /// End the branch at this point and keep everything.
    Stop,
}

/// Receives events as they occur, for progress display, storage and live plots.
pub trait Observer: Sync {
    /// Called once per event, from the thread that follows the branch.
    fn observe(&self, event: Event) -> Verdict;

    /// True once the run must end immediately, even in the middle of a point. Called very often and from every thread.
    /// No event is reported after that, because computations in progress return wrong numbers.
    fn stopping(&self) -> bool {
        false
    }

    /// True if [`Observer::recall`] returns stored points, so that profiles need not stay in memory.
    fn stores(&self) -> bool {
        false
    }

    /// The point at `position` of a branch, as reported.
    fn recall(&self, _branch: &Branch, _position: i64) -> Option<Point> {
        None
    }
}

/// An observer that ignores all events.
pub struct Unobserved;

impl Observer for Unobserved {
    fn observe(&self, _event: Event) -> Verdict {
        Verdict::Continue
    }
}
