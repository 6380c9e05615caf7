//! Continuation of one side of a branch, from one accepted point to the next.
//!
//! **Idea.** One loop: predict with the tangent and its change, correct, accept or reject the step by the angle between
//! tangents, clip it at the bounds, check whether the branch ends, search for special points in between, emit, choose
//! the next step size.

use super::Settings;
use super::allowance::{Allowance, work};
use super::corrector::{Care, Failure, Station};
use super::diagnosis::{Past, Tried};
use super::ends::Homecoming;
use super::inspect::Found;
use super::step::{Step, Trail};
use crate::contract::{Monitor, Verdict, ZeroProblem};
use crate::diagram::{Connection, Cost, Ending, Kind, Point, STANDS, SpecialPoint};
use num_complex::Complex64;

/// Output of a run, in the order of travel.
pub enum Item {
    /// A special point; it lies between the last point and the next.
    Special(SpecialPoint),
    /// An accepted point.
    Point(Point),
}

/// One side of a branch being followed.
pub struct Follow<'w> {
    /// The curve.
    pub problem: &'w mut dyn ZeroProblem,
    /// Settings of the run.
    pub settings: &'w Settings,
    /// Monitors of the special points to locate.
    pub monitors: &'w [Box<dyn Monitor + 'w>],
    /// Requested values. They affect nothing but the end of the branch.
    pub marks: &'w [Box<dyn Monitor + 'w>],
    /// Monitors whose sign change ends the branch: it has met the branch of simpler solutions from which it bifurcates.
    pub collapses: &'w [Box<dyn Monitor + 'w>],
    /// Returns the orbit of infinite period that the branch approaches, if the cycle at a point shows one.
    pub limit: &'w dyn Fn(&Point) -> Option<Ending>,
    /// Returns the ending at a point beyond which another problem or another direction is needed.
    pub corner: &'w dyn Fn(&Point) -> Option<Ending>,
    /// True if the problem holds a branch of a switched field, so that equilibria are followed through its surfaces.
    pub holds: bool,
    /// True if the model has a continuous symmetry, so that solutions form families and a second multiplier is 1.
    pub symmetric: bool,
    /// +1 towards larger positions, -1 towards smaller.
    pub direction: f64,
    /// Index of the continuation parameter among the parameters of a point.
    pub free: usize,
    /// The point at which the run ends as closed when it returns there; `None` if the branch cannot close.
    pub home: Option<&'w Point>,
    /// Period at which the branch began; `None` if it is not free.
    pub first_period: Option<f64>,
    /// Closure detector; empty when a run begins.
    pub homecoming: Homecoming,
    /// Longest piece of a step on which the number in place of a spectrum is resolved; see [`super::even`].
    pub resolved: f64,
    /// Length of the step under inspection. A change that is significant over the step is significant on its parts.
    pub inspected: f64,
}

impl Follow<'_> {
    /// Continuation of another problem with these settings, from a new start.
    pub fn on<'p>(&'p self, problem: &'p mut dyn ZeroProblem) -> Follow<'p> {
        Follow { problem, homecoming: Homecoming::default(), inspected: 0.0, resolved: f64::INFINITY, ..*self }
    }
}

/// Step, in tolerances, below which it begins and ends on the same mesh, because two meshes agree to the tolerance
/// only.
pub(super) const SHORT: f64 = 200.0;
/// Share of the tolerance below which a mesh is not refined on account of short steps.
const SHARPEST: f64 = 1e-3;
/// Longest step on which an unexplained change of stability is recorded; on a longer one it is taken for a jump to
/// another branch.
const SURE: f64 = 1e-4;
/// Number of times a mesh is halved for an unexplained change of stability on a short step …
const SHARPENED: usize = 2;
/// … and the factor by which its error is then taken to shrink.
const FINER: f64 = 1.0 / 32.0;
/// Longest step on which a branch point without a symmetry behind it is accepted; on a longer one it is taken for two
/// branches that pass each other closely.
const CROSSING: f64 = 2e-3;

/// Largest ratio of a step to the previous one, because the predictor is the cubic through both ends of the latter.
const GROWTH: f64 = 2.0;
/// Growth of the period beyond which an orbit of infinite period is searched for. Empirical: it saves the search on
/// ordinary branches and decides nothing, because the cycle itself must show the equilibria.
const LONG: f64 = 3.0;
/// Further growth of the period after which the search is repeated. A period grows like the logarithm of the distance
/// to a homoclinic orbit, so a tenth more is a marked approach; the search costs one pass over the cycle.
const AGAIN: f64 = 1.1;
/// Relative change of the parameter over [`PATIENCE`] equilibria below which it has stalled.
const REST: f64 = 1e-11;
const PATIENCE: usize = 100;
/// Share of the permitted deviation from the cubic midway that the next step aims for at most. The deviation, as a
/// share of the step, grows with the cube of the step.
const BENT: f64 = 0.8;
/// Number of steps from one point rejected because no permitted mesh is fine enough, after which the side ends.
const COARSE: usize = 6;

/// Follows one side from `start`, which has already been emitted. `previous` is its predecessor on the same side, if
/// any. `emitted` counts the points of this side so far.
pub fn follow(
    walk: &mut Follow,
    start: Station,
    previous: Option<Station>,
    mut emitted: usize,
    sink: &mut dyn FnMut(Item) -> Verdict,
) -> Ending {
    let mut left = start;
    walk.count(&mut left);
    let mut step = if left.point.step > 0.0 { left.point.step } else { walk.settings.first_step };
    let mut position = left.point.position;
    let mut trail = previous.map(|before| {
        let between = walk.between(&before, &left);
        walk.trail(&before, between)
    });
    let first_period = walk.first_period;
    let mut stirred = left.slope().abs() > STANDS;
    let mut stand = (left.parameter(), emitted);
    let mut long = first_period.map(|first| LONG * first);
    let mut allowance = Allowance::new();
    let mut before: Option<Station> = None;
    loop {
        if let Some(end) = walk.at_bound(&left, 1e-12) {
            return end;
        }
        if emitted >= walk.settings.max_points {
            return Ending::PointLimit(emitted);
        }
        let (mut cost, mut remeshed, mut coarse, mut sharpened) = (Cost::default(), 0, 0, 0);
        let (past, mut tried) = (Past { first_period, moved: stirred }, Tried::new());
        walk.sharpen(&mut left, step, &mut cost);
        let mut rigid = !walk.refresh(&mut left, step, &mut cost);
        let (Step { mut right, end, between, moving }, found) = loop {
            let attempt = walk.advanced(&left, trail.as_ref(), (step, rigid), &mut cost);
            match attempt {
                Ok((_, found))
                    if is_unexplained(&found) && sharpened < SHARPENED && walk.is_short(&left.mesh, step) =>
                {
                    // Multipliers that change within the error of this mesh need a finer one.
                    sharpened += 1;
                    cost.rejected += 1;
                    walk.place(&left);
                    left.share = (FINER * left.share).max(SHARPEST);
                    left.roomier = walk.problem.finer_mesh();
                    rigid = !walk.refresh(&mut left, step, &mut cost);
                }
                Ok(accepted) => break accepted,
                Err(Failure::Remeshed(mesh)) if remeshed < 3 => {
                    remeshed += 1;
                    left.roomier = Some(mesh);
                    rigid = !walk.refresh(&mut left, step, &mut cost);
                }
                Err(why) => {
                    cost.rejected += 1;
                    remeshed = 0;
                    tried.note(step, walk.problem.mesh().len().saturating_sub(1), &why);
                    step *= match why {
                        Failure::Unexplained => 0.25,
                        Failure::Elsewhere { miss, .. } | Failure::NotBack { miss } if miss > 1.0 => 0.25,
                        Failure::Bent { miss, allowed } if miss * allowed > 1.0 => 0.25,
                        Failure::Elsewhere { angle, .. } => (walk.settings.target_angle / angle).clamp(0.2, 0.5),
                        _ => 0.5,
                    };
                    coarse += usize::from(matches!(why, Failure::Mesh(_)));
                    let spent = work(cost.factorisations, &left.mesh);
                    let used_up = allowance.is_used_up(spent);
                    if step < walk.shortest() || coarse == COARSE || used_up {
                        // The matrix may be singular at the bound itself. The remaining distance is then less than the
                        // tolerance.
                        let singular = matches!(why, Failure::Singular);
                        let met = walk.at_bound(&left, walk.settings.tolerance).filter(|_| singular);
                        let met = met.or_else(|| {
                            before.as_ref().and_then(|before: &Station| walk.collapse_ahead(before, &left))
                        });
                        return match met.or_else(|| (walk.limit)(&left.point)) {
                            Some(end) => end,
                            None if used_up => {
                                let last = format!("the last step failed because {why}");
                                allowance.ending(walk.value(&left), spent, &last)
                            }
                            None => walk.short_end(&left, &tried, &why, past),
                        };
                    }
                    walk.sharpen(&mut left, step, &mut cost);
                    rigid = !walk.refresh(&mut left, step, &mut cost);
                }
            }
        };
        let found = match end {
            Some(Ending::Joined { parameter, .. }) => walk.up_to(parameter, found, left.point.unstable, &mut right),
            _ => found,
        };
        let (end, found) = walk.up_to_end(end, found, &mut right);
        let (crossing, end, mut found) = walk.up_to_surface(&left, end, found, &mut right, &mut cost);
        if walk.settings.stability {
            walk.at_contact([&left, &right], &mut found);
        }
        let between = between.filter(|_| !crossing);
        let between = between.unwrap_or_else(|| walk.between(&left, &right));
        let (angle, length) = (between.angle, between.along);
        // A bend that has sharpened is assumed to sharpen further.
        let trend = trail.as_ref().map_or(1.0, |t| angle / (length * t.curvature).max(1e-12)).clamp(1.0, 2.0);
        let factor = walk.settings.target_angle / (trend * angle).max(1e-12);
        let factor = factor.min((BENT / between.bent).cbrt()).clamp(0.3, GROWTH);
        let most = walk.settings.max_step / moving.as_ref().map_or(1.0, |moving| moving.rate);
        step = (length * factor).min(GROWTH * walk.resolved).clamp(walk.shortest(), most);
        walk.resolved *= GROWTH;
        let sideways = if walk.direction > 0.0 { 0 } else { -1 };
        let strange = walk.settings.stability && is_unexplained(&found);
        let spent = work(cost.factorisations, &right.mesh);
        let used_up = allowance.accepted(strange, spent, walk.value(&right));
        // As above, an orbit of infinite period takes precedence as the reason.
        let end = end.or(used_up.map(|why| (walk.limit)(&right.point).unwrap_or(why)));
        for item in found {
            let verdict = match item {
                Found::Special(mut special) => {
                    special.point.position = position + sideways;
                    sink(Item::Special(*special))
                }
                Found::Inserted(station, rest) => {
                    position += walk.direction as i64;
                    emitted += 1;
                    let point = Point { position, step: rest, ..station.point };
                    sink(Item::Point(point))
                }
            };
            if verdict == Verdict::Stop {
                return Ending::Stopped;
            }
        }
        position += walk.direction as i64;
        emitted += 1;
        let mut point = right.point.clone();
        (point.position, point.step, point.cost) = (position, step, cost);
        if sink(Item::Point(point)) == Verdict::Stop {
            return Ending::Stopped;
        }
        if let Some(ending) = end {
            if ending == Ending::Closed
                && let Some(change) = walk.changed_on_return(&right, position)
                && sink(Item::Special(change)) == Verdict::Stop
            {
                return Ending::Stopped;
            }
            return ending;
        }
        if let Some(corner) = (walk.corner)(&right.point) {
            return corner;
        }
        walk.leaves_home(&right.point);
        stirred |= right.slope().abs() > STANDS;
        let here = right.parameter();
        if (here - stand.0).abs() > REST * (1.0 + here.abs()) {
            stand = (here, emitted);
        } else if first_period.is_none() && stirred && emitted - stand.1 >= PATIENCE {
            return walk.at_a_stand(&right);
        }
        if let Some(ending) = walk.unbounded(&left, &right, past) {
            return ending;
        }
        if let (Some(first), Some(now), Some(next)) = (first_period, right.point.solution.free_period(), long)
            && now > next
        {
            // A saddle-node connection is solved for. For any other orbit of infinite period the parameter must have
            // converged.
            let placed = |limit: &Ending| {
                matches!(limit, Ending::Connecting { connection: Connection::SaddleNode, .. })
                    || !walk.moves(&left, &right)
            };
            if let Some(limit) = (walk.limit)(&right.point).filter(placed) {
                return limit;
            }
            if now > walk.settings.period_growth * first {
                return Ending::PeriodUnbounded(now);
            }
            long = Some(AGAIN * now);
        }
        if crossing {
            // On the other side the branch has another direction.
            (trail, before, left, step) = (None, None, right, walk.settings.first_step);
            continue;
        }
        trail = Some(walk.trail(&left, between).moving(moving));
        before = Some(std::mem::replace(&mut left, right));
    }
}

impl Follow<'_> {
    /// Attempts a step, on a moving mesh if jumps of the solution move far, and inspects it.
    fn advanced(
        &mut self,
        left: &Station,
        trail: Option<&Trail>,
        (step, rigid): (f64, bool),
        cost: &mut Cost,
    ) -> Result<(Step, Vec<Found>), Failure> {
        if let Some(done) = self.moved_on(left, trail, step, cost) {
            return Ok(done);
        }
        let tried = self.attempt(left, trail, step, rigid, cost)?;
        let tried = self.beyond_rounding(left, trail, (step, rigid), tried, cost);
        let found = self.examined_between(left, &tried.right, trail, step, cost)?;
        Ok(if tried.end.is_some() && is_unexplained(&found) {
            self.on_border(left, trail, step, cost, (tried, found))
        } else {
            (tried, found)
        })
    }

    /// A last step that ends on a special point itself, to within the errors, as where a doubling lies at a round number at
    /// which the range ends: the eigenvalues or multipliers on the border are counted so that what lies between is explained.
    fn on_border(
        &mut self,
        left: &Station,
        trail: Option<&Trail>,
        step: f64,
        cost: &mut Cost,
        (mut tried, found): (Step, Vec<Found>),
    ) -> (Step, Vec<Found>) {
        /// Least and largest error that is assumed: the accuracy to which a point is located, and beyond which nothing is settled
        /// by it.
        const ERRORS: [f64; 2] = [1e-9, 1e-6];
        /// Largest distance from the border of the critical eigenvalue or multiplier of what is found.
        const FOUND: f64 = 1e-7;
        // Eigenvalues are relative to the largest.
        let border = |point: &Point| -> Vec<f64> {
            let cycle = point.solution.period().is_some();
            let largest = point.free_spectrum().iter().map(|z| z.norm()).fold(f64::MIN_POSITIVE, f64::max);
            let off = |z: &Complex64| if cycle { (z.norm() - 1.0) / z.norm().max(1.0) } else { z.re / largest };
            point.free_spectrum().iter().map(off).collect()
        };
        let point = &tried.right.point;
        let stated = if point.solution.period().is_some() { point.trust.spectrum } else { 0.0 };
        let error = if stated > ERRORS[0] { stated.min(ERRORS[1]) } else { ERRORS[0] };
        let critical: Vec<f64> = border(point).into_iter().filter(|off| off.abs() <= error).collect();
        let counted = point.unstable;
        let fewest = counted.saturating_sub(critical.iter().filter(|off| **off > 0.0).count());
        let there = |item: &Found| match item {
            Found::Special(special) => border(&special.point).iter().any(|off| off.abs() <= FOUND),
            Found::Inserted(..) => true,
        };
        for count in (fewest..=fewest + critical.len()).filter(|count| *count != counted) {
            tried.right.point.unstable = count;
            if let Ok(other) = self.examined_between(left, &tried.right, trail, step, cost)
                && !is_unexplained(&other)
                && other.iter().all(there)
            {
                return (tried, other);
            }
        }
        tried.right.point.unstable = counted;
        (tried, found)
    }

    /// A longer step in place of `tried` if that ends at an equilibrium, or at a fixed point or cycle of a map, at which rounding
    /// decides on the number of unstable eigenvalues or multipliers, as beside a branch point, or, along curves, on the sign of a
    /// monitor, and the longer one does not.
    fn beyond_rounding(
        &mut self,
        left: &Station,
        trail: Option<&Trail>,
        (step, rigid): (f64, bool),
        tried: Step,
        cost: &mut Cost,
    ) -> Step {
        // Along a family of equilibria rounding decides everywhere.
        let apart =
            left.mesh.is_empty() && tried.end.is_none() && !(self.settings.stability && self.is_undecided(left));
        if !apart || !self.is_on_border(left, &tried.right) {
            return tried;
        }
        // As little longer as possible: a second special point may follow. No round numbers, as those at which it may lie.
        for longer in [1.057, 1.31, 2.07, 4.13, 8.3, 16.7] {
            match self.attempt(left, trail, longer * step, rigid, cost) {
                Ok(beyond) if !self.is_on_border(left, &beyond.right) => return beyond,
                Ok(_) => {}
                Err(_) => break,
            }
        }
        tried
    }

    /// True if rounding decides what is on which side of a station at the end of a step from `left`.
    fn is_on_border(&mut self, left: &Station, right: &Station) -> bool {
        /// Value of a monitor, relative to that at the other end, below which it is rounding.
        const ROUNDING: f64 = 1e-10;
        if self.settings.stability {
            return self.is_undecided(right);
        }
        self.monitored(left).iter().zip(self.monitored(right)).any(|(a, b)| b.abs() <= ROUNDING * a.abs() && *a != 0.0)
    }

    /// A step on a moving mesh within which there is no special point and stability does not change.
    fn moved_on(
        &mut self,
        left: &Station,
        trail: Option<&Trail>,
        step: f64,
        cost: &mut Cost,
    ) -> Option<(Step, Vec<Found>)> {
        let tried = self.moved(left, trail, step, cost)?.ok()?;
        let found = self.examined_between(left, &tried.right, trail, step, cost).ok()?;
        let quiet = found.is_empty() && left.point.unstable == tried.right.point.unstable;
        quiet.then_some((tried, found))
    }

    /// Special points between both ends of a step.
    ///
    /// # Errors
    /// [`Failure::Unexplained`] if the step is too long for what was found on it.
    fn examined_between(
        &mut self,
        left: &Station,
        right: &Station,
        trail: Option<&Trail>,
        step: f64,
        cost: &mut Cost,
    ) -> Result<Vec<Found>, Failure> {
        let history = trail.map(|trail| &trail.history);
        let found = self.inspect(left, right, history, 0, cost);
        let believed = found.iter().all(|f| match f {
            Found::Special(s) => step <= self.believed_at(s.kind),
            Found::Inserted(..) => true,
        });
        let nothing = found.iter().all(|f| matches!(f, Found::Inserted(..)));
        let jumped = step > CROSSING && nothing && self.may_jump([left, right], history, step);
        if believed && !jumped { Ok(found) } else { Err(Failure::Unexplained) }
    }
}

fn is_unexplained(found: &[Found]) -> bool {
    found.iter().any(|item| matches!(item, Found::Special(special) if special.kind == Kind::Unexplained))
}

impl Follow<'_> {
    /// Longest step on which a special point of this kind is accepted.
    fn believed_at(&self, kind: Kind) -> f64 {
        match kind {
            Kind::Unexplained => SURE,
            Kind::BranchPoint if !self.settings.is_symmetric() => CROSSING,
            _ => f64::INFINITY,
        }
    }

    /// Smallest step. At first contact a stop of stiffness k, relative to that of the spring, bends a branch within a
    /// distance of order k⁻².
    fn shortest(&self) -> f64 {
        const STIFF: f64 = 1e-3;
        if self.problem.is_switched() { STIFF * self.settings.min_step } else { self.settings.min_step }
    }

    /// Excludes multipliers that are on the unit circle for structural reasons (a family, a symmetry, a conservative
    /// system) from the number of unstable ones, because rounding decides on which side they are computed.
    pub(super) fn count(&self, station: &mut Station) {
        if !self.settings.stability {
            return;
        }
        if self.symmetric || station.point.is_one_of_family() {
            station.point.unstable = station.point.unstable_besides_neutral();
        }
        station.point.count_if_conservative();
    }

    /// Attributes to a grazing the change of stability at which a vertical branch begins or ends there: along it a
    /// multiplier is 1 and does not count; beyond, in contact, it is on one side.
    fn at_contact(&self, [left, right]: [&Station; 2], found: &mut [Found]) {
        let [before, after] = [left.point.unstable, right.point.unstable];
        let ends = left.point.is_one_of_family() != right.point.is_one_of_family();
        let steady = |item: &Found| match item {
            Found::Special(special) => special.unstable_before == before && special.unstable_after == before,
            Found::Inserted(..) => false,
        };
        if !ends || before.abs_diff(after) != 1 || !found.iter().all(steady) {
            return;
        }
        let grazes = |item: &Found| matches!(item, Found::Special(special) if special.kind == Kind::Grazing);
        let Some(first) = found.iter().position(grazes) else { return };
        for (index, item) in found.iter_mut().enumerate().skip(first) {
            let Found::Special(special) = item else { continue };
            let counts = if index == first { [before, after] } else { [after; 2] };
            let [low, high] = if self.direction > 0.0 { counts } else { [counts[1], counts[0]] };
            (special.unstable_before, special.unstable_after) = (low, high);
        }
    }

    /// The continuation parameter at a station.
    pub(super) fn value(&self, station: &Station) -> f64 {
        self.problem.unit() * station.parameter()
    }

    /// The parameter range in terms of the unknown λ.
    pub(super) fn bounds(&self) -> [f64; 2] {
        self.settings.range.map(|bound| bound / self.problem.unit())
    }

    pub(super) fn place(&mut self, station: &Station) {
        self.problem.set_mesh(&station.mesh);
        self.problem.anchor(&station.u);
    }

    /// Ending at a bound of the range that lies ahead, if it is no farther than `within`, relative to the scale of the
    /// parameter + |bound|.
    fn at_bound(&self, here: &Station, within: f64) -> Option<Ending> {
        let bound = self.settings.range[usize::from(here.slope() > 0.0)];
        let unit = self.problem.unit();
        let near = (here.parameter() - bound / unit).abs() <= within * (1.0 + (bound / unit).abs());
        (near && bound.is_finite() && here.slope() != 0.0).then_some(Ending::Bound(bound))
    }

    /// True if the parameter still changes with the period: dλ/d ln T, which tends to zero towards an orbit of infinite
    /// period, exceeds a tenth of the tolerance.
    fn moves(&self, left: &Station, right: &Station) -> bool {
        let period = |station: &Station| station.point.solution.free_period().unwrap_or(f64::NAN);
        let (change, here) = ((right.parameter() - left.parameter()).abs(), right.parameter().abs());
        change > 0.1 * self.settings.tolerance * (1.0 + here) * (period(right) / period(left)).ln().abs()
    }

    /// Refines the mesh where steps are short. The curve is then so strongly bent that errors of the size of the
    /// tolerance would show, and the mesh is adapted to errors that are as small a share of the step as on a step of
    /// ordinary length.
    fn sharpen(&mut self, left: &mut Station, step: f64, cost: &mut Cost) {
        let share = (step / (SHORT * self.settings.tolerance)).clamp(SHARPEST, 1.0);
        if left.mesh.is_empty() || share > 0.5 * left.share {
            return;
        }
        left.share = share;
        self.place(left);
        cost.factorisations += 1;
        if self.problem.factorise(&left.u, &left.tangent).is_ok()
            && let Some(better) = self.problem.better_mesh(&left.u, share * self.settings.tolerance)
        {
            left.roomier = Some(better);
        }
    }

    /// Moves the working copy of a station to a finer mesh if its own leaves no room for the next step. The stored
    /// point does not change. If the step is so short that the change of mesh would show, the copy is solved for on the
    /// new mesh, on the same side of special points. Returns false if there is no such solution, and the copy stays on
    /// its mesh.
    fn refresh(&mut self, left: &mut Station, step: f64, cost: &mut Cost) -> bool {
        let Some(better) = left.roomier.take() else { return true };
        if self.is_short(&left.mesh, step) {
            match self.carried(left, &better, step, cost) {
                Some(found) => *left = found,
                None => return false,
            }
            return true;
        }
        left.u = self.problem.carry(&left.u, &left.mesh, &better);
        left.tangent = self.problem.transfer(&left.tangent, &left.mesh, &better);
        left.mesh = better;
        true
    }

    /// Settings for the refinement of a point next to `left`.
    pub(super) fn care(&self, left: &Station, step: f64) -> Care {
        Care { share: left.share, close: self.settings.closeness(&left.mesh, step), trusted: false }
    }
}
