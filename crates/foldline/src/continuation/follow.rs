//! From one accepted point to the next; why a side ends.
//!
//! **Idea.** One loop: predict with the tangent and its change, correct, judge the step by the angle between tangents,
//! clip at the bounds, see whether the branch has come to an end, look for special points in between, emit, choose the
//! next step.

use super::Settings;
use super::corrector::{Care, Failure, Station, refine};
use super::diagnosis::{Past, Tried};
use super::ends::Homecoming;
use super::inspect::{Found, History};
use crate::contract::{Monitor, Verdict, ZeroProblem};
use crate::diagram::{Cost, Ending, Kind, Mesh, Point, SpecialPoint};

/// What a run emits, in the order of travel.
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
    /// What governs the run.
    pub settings: &'w Settings,
    /// What to look for.
    pub monitors: &'w [Box<dyn Monitor + 'w>],
    /// Sign changes that end the branch: it has met the branch of simpler solutions that it comes from.
    pub collapses: &'w [Box<dyn Monitor + 'w>],
    /// +1 towards larger positions, -1 towards smaller.
    pub direction: f64,
    /// Index of the continuation parameter among the parameters of a point.
    pub free: usize,
    /// The point whose return ends the run as closed; `None` where the branch cannot close.
    pub home: Option<&'w Point>,
    /// What is known of the way back there; nothing when a run begins.
    pub homecoming: Homecoming,
}

/// An accepted step, perhaps the last one.
pub(super) struct Step {
    pub(super) right: Station,
    pub(super) end: Option<Ending>,
}

/// What the point before the current one contributes: its tangent for the predictor, its monitors for the inspection.
struct Trail {
    u: Vec<f64>,
    tangent: Vec<f64>,
    mesh: Mesh,
    /// Arclength between the two points.
    length: f64,
    /// Angle between their tangents, per arclength.
    curvature: f64,
    history: History,
}

/// What a step aims at.
#[derive(Clone, Copy, Debug)]
pub(super) enum Aim {
    /// The plane across the tangent at this distance.
    Plane(f64),
    /// The value of the parameter that the prediction has, about this far.
    Value(f64),
}

impl Aim {
    /// How far that is.
    pub(super) fn step(self) -> f64 {
        match self {
            Aim::Plane(step) | Aim::Value(step) => step,
        }
    }
}

/// Steps longer than this many of the one before are predicted from the tangents alone.
const FARTHEST: f64 = 2.5;
/// By how much a step is longer if that takes it to a bound: what is left would be a step of its own.
const STRETCHED: f64 = 1.2;
/// How close to a bound a prediction must be, as a share of its way there, to be moved to it.
const NEAR_BOUND: f64 = 1e-4;

/// Steps shorter than this many tolerances begin and end on the same mesh: two meshes agree to the tolerance only.
pub(super) const SHORT: f64 = 200.0;
/// Share of the tolerance below which a mesh is not refined on account of short steps.
const SHARPEST: f64 = 1e-3;
/// Step down to which a change of stability without explanation is taken for a jump to another branch.
const SURE: f64 = 1e-4;
/// How often a mesh is halved for a change of stability without explanation in a short step …
const SHARPENED: usize = 2;
/// … and what that makes of its error, at least.
const FINER: f64 = 1.0 / 32.0;
/// Step down to which a branch point without a symmetry that makes it is taken for two branches that pass each other.
const CROSSING: f64 = 2e-3;

/// Growth of a step over the one before, at most: the prediction is by the cubic through both ends of that.
const GROWTH: f64 = 2.0;
/// Growth of the period while the parameter stands still, having moved before, that means that the period has no bound.
const LONG: f64 = 3.0;
/// Slope of a branch in its parameter below which it does not change along the branch but for rounding.
pub(super) const STANDS: f64 = 1e-9;
/// Distance midway from the cubic through both ends, as a share of the step, from which on the parameter there is looked at.
const BENT: f64 = 2e-3;
/// Change of the parameter, over so many equilibria, below which it has come to a stand.
const REST: f64 = 1e-11;
const PATIENCE: usize = 100;
/// Change of the logarithm of the period that shows whether the parameter still moves with it.
const SHOWN: f64 = 0.01;
/// Steps given up in turn because no permitted mesh is fine enough, until the side ends for that.
const COARSE: usize = 6;

/// Follows one side from `start`, which has been emitted already, and of which `previous` is the predecessor on the same
/// side if there is one. `emitted` counts the points of this side so far.
pub fn follow(
    walk: &mut Follow,
    start: Station,
    previous: Option<Station>,
    mut emitted: usize,
    sink: &mut dyn FnMut(Item) -> Verdict,
) -> Ending {
    let mut left = start;
    let mut step = if left.point.step > 0.0 { left.point.step } else { walk.settings.first_step };
    let mut position = left.point.position;
    let mut trail = previous.map(|p| walk.trail(&p, &left));
    let first_period = walk.home.unwrap_or(&left.point).solution.free_period();
    let (mut ever_moved, mut moved, mut still) = (left.slope().abs() > STANDS, true, 0);
    let mut stirred = ever_moved;
    let mut stand = (left.parameter(), emitted);
    // Parameter and period where the parameter was last seen to move, or to stand.
    let mut mark = left.point.solution.free_period().map(|period| (left.parameter(), period));
    let mut moving = mark;
    loop {
        let outward = |bound: f64| (left.parameter() - bound).abs() <= 1e-12 * (1.0 + bound.abs());
        let [low, high] = walk.settings.range;
        if (outward(low) && left.slope() < 0.0) || (outward(high) && left.slope() > 0.0) {
            return Ending::Bound(if left.slope() < 0.0 { low } else { high });
        }
        if emitted >= walk.settings.max_points {
            return Ending::PointLimit(emitted);
        }
        let (mut cost, mut remeshed, mut coarse, mut sharpened) = (Cost::default(), 0, 0, 0);
        let (past, mut tried) = (Past { first_period, moved: stirred }, Tried::new());
        walk.sharpen(&mut left, step, &mut cost);
        let mut rigid = !walk.refresh(&mut left, step, &mut cost);
        let history = trail.as_ref().map(|t| t.history.clone());
        let (Step { mut right, end }, found) = loop {
            let attempt = walk.attempt(&left, trail.as_ref(), step, rigid, &mut cost).and_then(|tried| {
                let found = walk.inspect(&left, &tried.right, history.as_ref(), 0, &mut cost);
                let believed = found.iter().all(|f| match f {
                    Found::Special(s) => step <= walk.believed_at(s.kind),
                    Found::Inserted(..) => true,
                });
                if believed { Ok((tried, found)) } else { Err(Failure::Unexplained) }
            });
            match attempt {
                Ok((_, found))
                    if is_unexplained(&found) && sharpened < SHARPENED && walk.is_short(&left.mesh, step) =>
                {
                    // What multipliers do closer together than this mesh is accurate it need not show as it is.
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
                        Failure::Elsewhere { angle, .. } => (walk.settings.target_angle / angle).clamp(0.2, 0.5),
                        _ => 0.5,
                    };
                    coarse += usize::from(matches!(why, Failure::Mesh(_)));
                    if step < walk.settings.min_step || coarse == COARSE {
                        // Where the period grows and nothing else changes, the end is foreseeable.
                        return match (left.point.solution.free_period(), moving) {
                            (Some(period), Some((_, then))) if !moved && period > then => {
                                Ending::PeriodUnbounded(period)
                            }
                            _ => walk.short_end(&left, &tried, &why, past),
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
        let (angle, length) = walk.angle(&left, &right);
        // A bend that has become sharper will go on so.
        let trend = trail.as_ref().map_or(1.0, |t| angle / (length * t.curvature).max(1e-12)).clamp(1.0, 2.0);
        let factor = (walk.settings.target_angle / (trend * angle).max(1e-12)).clamp(0.3, GROWTH);
        step = (length * factor).clamp(walk.settings.min_step, walk.settings.max_step);
        let sideways = if walk.direction > 0.0 { 0 } else { -1 };
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
        if let (Some(first), Some(now), Some(then)) = (first_period, right.point.solution.free_period(), mark) {
            let here = (right.parameter(), now);
            if (now / then.1).ln().abs() > SHOWN {
                moved = walk.moves(then, here);
                still = if moved { 0 } else { still + 1 };
                ever_moved |= moved;
                mark = Some(here);
                if moved {
                    moving = mark;
                }
            }
            let since = moving.map_or(first, |(_, period)| period);
            let grown = still > 0 && now > LONG * since || still > 1 && now > LONG * first;
            if now > walk.settings.period_growth * first || (ever_moved && grown) {
                return Ending::PeriodUnbounded(now);
            }
        }
        trail = Some(walk.trail(&left, &right));
        left = right;
    }
}

fn is_unexplained(found: &[Found]) -> bool {
    found.iter().any(|item| matches!(item, Found::Special(special) if special.kind == Kind::Unexplained))
}

impl Follow<'_> {
    /// The longest step in which something of that kind is believed.
    fn believed_at(&self, kind: Kind) -> f64 {
        match kind {
            Kind::Unexplained => SURE,
            Kind::BranchPoint if self.settings.reflections.len() < 2 => CROSSING,
            _ => f64::INFINITY,
        }
    }

    pub(super) fn place(&mut self, station: &Station) {
        self.problem.set_mesh(&station.mesh);
        self.problem.anchor(&station.u);
    }

    /// Whether the parameter still moves where the period changes, from one pair of both to another: dλ/d ln T, which tends to
    /// zero with the distance from an orbit of infinite period, exceeds the tolerance.
    fn moves(&self, then: (f64, f64), now: (f64, f64)) -> bool {
        let change = (now.0 - then.0).abs();
        change > 0.1 * self.settings.tolerance * (1.0 + now.0.abs()) * (now.1 / then.1).ln().abs()
    }

    fn trail(&mut self, before: &Station, now: &Station) -> Trail {
        self.place(before);
        let u = self.problem.transfer(&now.u, &now.mesh, &before.mesh);
        let gap: Vec<f64> = u.iter().zip(&before.u).map(|(a, b)| a - b).collect();
        let distance = self.problem.dot(&before.tangent, &gap).abs().max(f64::MIN_POSITIVE);
        let history = History { distance, values: self.monitored(before), spectrum: before.point.spectrum.clone() };
        let (angle, _) = self.angle(before, now);
        let length = self.problem.dot(&gap, &gap).sqrt().max(distance) * (1.0 + angle * angle / 24.0);
        let (u, tangent) = (before.u.clone(), before.tangent.clone());
        Trail { u, tangent, mesh: before.mesh.clone(), length, curvature: angle / length, history }
    }

    /// Where steps are short, the curve is so curved that errors of a tolerance would show: the mesh is made for errors that are
    /// as small a share of the step as they are of a step of usual length.
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

    /// Moves the working copy of a station to a mesh with room for the next step, where its own has none left. The stored
    /// point stays as it is. If the step is so short that the change of mesh would show in it, the copy is a solution there, on
    /// its own side of special points; false where there is none, and the copy stays on its mesh.
    fn refresh(&mut self, left: &mut Station, step: f64, cost: &mut Cost) -> bool {
        let Some(better) = left.roomier.take() else { return true };
        if self.is_short(&left.mesh, step) {
            match self.carried(left, &better, step, cost) {
                Some(found) => *left = found,
                None => return false,
            }
            return true;
        }
        left.u = self.problem.transfer(&left.u, &left.mesh, &better);
        left.tangent = self.problem.transfer(&left.tangent, &left.mesh, &better);
        left.mesh = better;
        true
    }

    /// How a point next to `left` is refined.
    pub(super) fn care(&self, left: &Station, step: f64) -> Care {
        Care { share: left.share, close: self.settings.closeness(&left.mesh, step), trusted: false }
    }

    /// Whether the mesh of `left` has served for a step already and has room left: what the tolerance leaves of what is stated, which is
    /// several times the estimate.
    fn trusts(&self, left: &Station, trail: Option<&Trail>) -> bool {
        let room = left.point.trust.discretisation < left.share * self.settings.tolerance;
        room && trail.is_some_and(|trail| trail.mesh == left.mesh)
    }

    /// Angle between the tangents, and distance along the left one.
    pub(super) fn angle(&mut self, left: &Station, right: &Station) -> (f64, f64) {
        self.place(left);
        let tangent = self.problem.transfer(&right.tangent, &right.mesh, &left.mesh);
        let u = self.problem.transfer(&right.u, &right.mesh, &left.mesh);
        let gap: Vec<f64> = u.iter().zip(&left.u).map(|(a, b)| a - b).collect();
        let sizes = (self.problem.dot(&tangent, &tangent) * self.problem.dot(&left.tangent, &left.tangent)).sqrt();
        let cosine = self.problem.dot(&left.tangent, &tangent) / sizes;
        (cosine.clamp(-1.0, 1.0).acos(), self.problem.dot(&left.tangent, &gap))
    }

    /// The point at distance `step`: on the cubic through the last two points with their tangents.
    fn predicted(&mut self, left: &Station, trail: Option<&Trail>, step: f64) -> Vec<f64> {
        self.place(left);
        let mut guess: Vec<f64> = left.u.iter().zip(&left.tangent).map(|(u, t)| u + step * t).collect();
        let Some(trail) = trail else { return guess };
        let (d, x) = (trail.length, step / trail.length);
        let then = self.problem.transfer(&trail.tangent, &trail.mesh, &left.mesh);
        if x > FARTHEST {
            let bend = 0.5 * step * step / d.max(0.2 * step);
            (0..guess.len()).for_each(|i| guess[i] += bend * (left.tangent[i] - then[i]));
        } else {
            let before = self.problem.transfer(&trail.u, &trail.mesh, &left.mesh);
            for i in 0..guess.len() {
                let (chord, turn) = (before[i] - left.u[i] + d * left.tangent[i], d * (then[i] - left.tangent[i]));
                guess[i] += x * x * ((3.0 * chord + turn) + x * (2.0 * chord + turn));
            }
        }
        let gap: Vec<f64> = guess.iter().zip(&left.u).map(|(a, b)| a - b).collect();
        let off = step - self.problem.dot(&left.tangent, &gap);
        guess.iter_mut().zip(&left.tangent).for_each(|(g, t)| *g += off * t);
        guess
    }

    fn attempt(
        &mut self,
        left: &Station,
        trail: Option<&Trail>,
        step: f64,
        rigid: bool,
        cost: &mut Cost,
    ) -> Result<Step, Failure> {
        let guess = self.predicted(left, trail, step);
        // A step that would pass a bound is aimed at it; where that fails, the bound is looked for after the step.
        if let Some((nearer, landing)) = self.landing(left, trail, &guess, step)
            && !self.is_short(&left.mesh, nearer)
            && let Ok(landed) = self.tried(left, trail, &landing, Aim::Value(nearer), rigid, cost)
        {
            return Ok(landed);
        }
        self.place(left);
        self.tried(left, trail, &guess, Aim::Plane(step), rigid, cost)
    }

    /// Where the prediction passes a bound, within the step or a little farther: at what step, and the prediction there, with the
    /// parameter at the bound.
    fn landing(&mut self, left: &Station, trail: Option<&Trail>, guess: &[f64], step: f64) -> Option<(f64, Vec<f64>)> {
        let last = guess.len() - 1;
        let (here, way) = (left.parameter(), guess[last] - left.parameter());
        let [low, high] = self.settings.range;
        let there = here + STRETCHED * way;
        let bound = if there < low { low } else { (there > high).then_some(high)? };
        if left.slope() * way <= 0.0 || (here - bound) * way >= 0.0 {
            return None;
        }
        let gap = |at: &[f64]| (at[last] - bound) * way.signum();
        let farthest = STRETCHED * step;
        let (mut inner, mut outer) =
            ((0.0, -(here - bound).abs()), (farthest, gap(&self.predicted(left, trail, farthest))));
        if outer.1 < 0.0 {
            return None;
        }
        for _ in 0..20 {
            let s = inner.0 + (outer.0 - inner.0) * inner.1 / (inner.1 - outer.1);
            let mut landing = self.predicted(left, trail, s);
            let miss = gap(&landing);
            if miss > 0.0 {
                outer = (s, miss)
            } else {
                inner = (s, miss)
            }
            if miss.abs() < NEAR_BOUND * (s * left.slope()).abs() {
                landing[last] = bound;
                return Some((s, landing));
            }
        }
        None
    }

    /// The step to what was predicted, in the plane or at the value of the parameter that is aimed at.
    fn tried(
        &mut self,
        left: &Station,
        trail: Option<&Trail>,
        guess: &[f64],
        aim: Aim,
        rigid: bool,
        cost: &mut Cost,
    ) -> Result<Step, Failure> {
        let step = aim.step();
        let (u, row) = self.corrected(left, guess, aim, cost)?;
        let short = self.is_short(&left.mesh, step);
        let mut right = if rigid && short {
            let close = self.settings.closeness(&left.mesh, step);
            self.unrefined(left, u, close, cost)?
        } else {
            let care = Care { trusted: self.trusts(left, trail), ..self.care(left, step) };
            refine(self.problem, self.settings, care, row, u, self.direction, cost)?
        };
        if let Aim::Value(_) = aim {
            // Where travel is towards smaller values the row has turned the tangent round.
            right.head(left.slope());
        }
        if right.mesh != left.mesh && short {
            return Err(Failure::Remeshed(right.mesh));
        }
        let mut miss = 0.0;
        if !left.mesh.is_empty() {
            miss = self.is_nearly_smooth(left, &right)?;
        }
        self.continues(left, &right, guess)?;
        if self.problem.departure(&right.u) > self.settings.newton_tolerance() {
            return Err(Failure::Departed);
        }
        if trail.is_none() || left.mesh.is_empty() {
            self.is_smooth(left, &mut right, cost)?;
        }
        self.leads_back(left, &right, cost)?;
        if miss > BENT {
            right.midway = self.midway(left, &right, cost)?;
        }
        if let Some(ended) = self.collapsed(left, &right, cost)? {
            return Ok(ended);
        }
        let [low, high] = self.settings.range;
        let bound = match aim {
            Aim::Value(_) => Some(guess[guess.len() - 1]),
            Aim::Plane(_) if right.parameter() < low => Some(low),
            Aim::Plane(_) => (right.parameter() > high).then_some(high),
        };
        let mut end = None;
        if let Some(bound) = bound {
            if let Aim::Plane(_) = aim {
                right = self.at_parameter(left, &right, bound, cost)?;
            }
            // To the last bit, whatever rounding Newton's method left.
            let last = right.u.len() - 1;
            right.u[last] = bound;
            if let Some(own) = right.point.parameters.get_mut(self.free) {
                *own = bound;
            }
            end = Some(Ending::Bound(bound));
        }
        if let Some((value, there)) = self.beyond(left, &right, cost) {
            return Ok(Step { right: there, end: Some(Ending::Bound(value)) });
        }
        if let Some(home) = self.closes(left, &right, cost)? {
            return Ok(Step { right: home, end: Some(Ending::Closed) });
        }
        Ok(Step { right, end })
    }
}
