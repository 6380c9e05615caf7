//! A solution family carried to new parameter values, along a path that is found and reported.
//!
//! **Idea.** The direct run may turn back at a fold. The following ways are then tried in this order until one reaches
//! the goal:
//!
//! 1. *direct*: all parameters change together, in proportion, at a fixed value of the parameter `via`;
//! 2. *along the fold*: the fold that turned the run back is continued to the goal;
//! 3. *moved*: the family is followed in `via`, and the direct run tried from points spread along it;
//! 4. *along its folds*: every fold met in `via` is continued to the goal;
//! 5. *halfway*: steps 1 to 4 again from the farthest point that any run has reached, as long as that makes progress;
//! 6. *one by one*: the parameters change one after the other.
//!
//! Every run is a branch of the diagram, every decision a note. If no way reaches the goal, the note reports how far
//! each came. If two folds of a closed family meet before the goal, the family shrinks to a point there and is not
//! connected to anything beyond.
//!
//! **Source.** The three flows (direct, with runs in the speed, along the fold) are those of akay2024; choosing among
//! them is ours.

use super::growth::{self, Beginning, Growth, Line};
use super::plan::{HomotopyPlan, Plan};
use super::{System, family};
use crate::continuation::Settings;
use crate::contract::{Event, Observer, Verdict};
use crate::diagram::{Branch, Diagram, Ending, Kind, Origin, Point, Shown, SpecialPoint};
use crate::problem::Tie;

/// Number of points along the family from which the direct run is tried.
const PLACES: usize = 6;
/// Number of rounds of step 5.
const ROUNDS: usize = 3;
/// Share of the way that a round must gain.
const GAIN: f64 = 0.02;

/// Result of a homotopy.
pub struct Route {
    /// Runs, in the order in which they were tried.
    pub legs: Vec<Branch>,
    /// The solution at the goal, or the reason why there is none.
    pub arrived: Result<Point, String>,
    /// False if the observer wants to stop.
    pub going: bool,
}

/// Finds a path for the family of `start` to the goal of the homotopy.
pub fn find(
    system: &System,
    plan: &Plan,
    homotopy: &HomotopyPlan,
    origin: Origin,
    start: Result<Point, String>,
    earlier: &Diagram,
    observer: &dyn Observer,
) -> Route {
    let mut planner = Planner {
        system,
        plan,
        homotopy,
        earlier,
        observer,
        legs: Vec::new(),
        going: true,
        origin,
        farthest: None,
        shrinks: false,
        open: false,
    };
    // The seed of a resumed run is not searched for again; the first run contains its solution.
    let first =
        earlier.branch(&format!("{}/1", homotopy.name)).and_then(|leg| leg.points.iter().find(|p| p.position == 0));
    let start = match first.cloned().map_or(start, Ok) {
        Ok(start) => start,
        Err(why) => {
            planner.short(&format!("no starting solution: {why}"));
            return Route { legs: Vec::new(), arrived: Err(why), going: planner.going };
        }
    };
    let arrived = planner.plan_route(start);
    if let Err(why) = &arrived
        && planner.going
    {
        let verdict = match (planner.open, planner.shrinks) {
            (true, _) => "some runs left the range or ended early, so there may be a path outside it",
            (false, true) => {
                "the folds of the family meet before the goal, where the family shrinks to a point: it is not \
                 connected to the goal"
            }
            (false, false) => "no path was found in these parameters",
        };
        planner.short(&format!("the goal was not reached: {why}; {verdict}"));
    }
    Route { legs: planner.legs, arrived, going: planner.going }
}

struct Planner<'p> {
    system: &'p System<'p>,
    plan: &'p Plan,
    homotopy: &'p HomotopyPlan,
    earlier: &'p Diagram,
    observer: &'p dyn Observer,
    legs: Vec<Branch>,
    going: bool,
    origin: Origin,
    /// The point closest to the goal on any run, the share of the way that it has covered, and true if it is a fold.
    farthest: Option<(f64, Point, bool)>,
    /// True if two folds of the family were observed to meet before the goal, so that it shrinks to a point there.
    shrinks: bool,
    /// True if some run left the range or ended otherwise, so that the family may extend further.
    open: bool,
}

/// Parameters that change together towards the goal.
struct Course {
    free: usize,
    ties: Vec<Tie>,
    from: f64,
    to: f64,
}

impl Course {
    /// Returns the path from a point to these values; `None` if the point has them already.
    fn new(start: &Point, targets: &[(usize, f64)]) -> Option<Course> {
        let moving: Vec<(usize, f64)> = targets.iter().copied().filter(|(i, v)| start.parameters[*i] != *v).collect();
        let &(free, to) = moving.first()?;
        let from = start.parameters[free];
        let ties = moving[1..]
            .iter()
            .map(|&(index, target)| {
                let slope = (target - start.parameters[index]) / (to - from);
                Tie { index, slope, offset: start.parameters[index] - slope * from }
            })
            .collect();
        Some(Course { free, ties, from, to })
    }

    /// Share of the way covered at a point.
    fn share(&self, point: &Point) -> f64 {
        (point.parameters[self.free] - self.from) / (self.to - self.from)
    }

    fn range(&self) -> [f64; 2] {
        [self.from.min(self.to), self.from.max(self.to)]
    }

    fn arrives(&self, point: &Point) -> bool {
        (point.parameters[self.free] - self.to).abs() <= 1e-9 * (self.to - self.from).abs()
    }
}

impl Planner<'_> {
    fn plan_route(&mut self, start: Point) -> Result<Point, String> {
        let targets = self.homotopy.targets.clone();
        let together = self.towards(&start, &targets);
        if together.is_ok() || !self.going || targets.len() < 2 {
            return together;
        }
        self.note("changing the parameters together did not reach the goal; trying one after the other");
        let mut here = start;
        for target in &targets {
            here = self.towards(&here, std::slice::from_ref(target))?;
        }
        Ok(here)
    }

    /// Carries out steps 1 to 5.
    fn towards(&mut self, start: &Point, targets: &[(usize, f64)]) -> Result<Point, String> {
        let (mut here, mut covered) = (start.clone(), 0.0);
        let mut tried = Vec::new();
        self.farthest = None;
        for round in 0..ROUNDS {
            let Some(course) = Course::new(&here, targets) else { return Ok(here) };
            match self.steps_from(&here, &course) {
                Ok(arrived) => return Ok(arrived),
                Err(why) => tried.push(why),
            }
            if !self.going {
                return Err("stopped on request".into());
            }
            // The share is one of the remaining way; gains count relative to the whole way.
            let Some((share, point, is_fold)) = self.farthest.take() else { break };
            let gained = share * (1.0 - covered);
            if gained < GAIN || round + 1 == ROUNDS {
                break;
            }
            covered += gained;
            let point = if is_fold { self.beside(&point) } else { Ok(point) };
            let [low, high] = self.homotopy.range;
            let inside = |point: &Point| (low..=high).contains(&point.parameters[self.homotopy.via]);
            let Some(point) = point.ok().filter(inside) else { break };
            self.note(&format!("{:.0} % of the way covered; continuing from there", 100.0 * covered));
            here = point;
        }
        Err(tried.join("; then "))
    }

    /// Returns a solution beside a fold of the family in `via`.
    fn beside(&self, fold: &Point) -> Result<Point, String> {
        let settings = growth::settings(self.system, self.plan.tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
        let mut problem = growth::problem_of(self.system, self.homotopy.via, self.plan.degree, fold, false);
        growth::beside(&mut *problem, &settings, fold)
            .map_err(|why| format!("no solution was found beside the fold: {why}"))
    }

    fn steps_from(&mut self, here: &Point, course: &Course) -> Result<Point, String> {
        let via = self.homotopy.via;
        let place = here.parameters[via];
        let from = Shown(place);
        let direct = self.direct(here, course);
        if let Some(point) = self.arrival(&direct, course) {
            self.note(&format!("reached the goal by a direct run at {from}"));
            return Ok(point);
        }
        let turned = direct.special.iter().find(|s| s.kind == Kind::Fold).cloned();
        let mut tried = match &turned {
            Some(fold) => {
                let share = 100.0 * course.share(&fold.point);
                vec![format!("the direct run at {from} turned back at a fold after {share:.1} % of the way")]
            }
            None => vec![format!("the direct run at {from} ended: {}", ending(&direct))],
        };
        self.note(&tried[0].clone());
        let turned_none = turned.is_none();
        if let Some(fold) = turned {
            match self.along(&fold, &direct.name, course, None) {
                Ok(point) => return Ok(point),
                Err(why) => tried.push(why),
            }
        }
        if !self.going {
            return Err("stopped on request".into());
        }
        let family = self.moved(here);
        self.open |= turned_none || family.ends.iter().flatten().any(|end| *end != Ending::Closed);
        for point in places(&family, via, place) {
            let at = point.parameters[via];
            let run = self.direct(&point, course);
            if let Some(point) = self.arrival(&run, course) {
                self.note(&format!("reached the goal by a direct run after moving from {from} to {:.6}", Shown(at)));
                return Ok(point);
            }
            if !self.going {
                return Err("stopped on request".into());
            }
        }
        let [low, high] = self.homotopy.range;
        tried.push(format!(
            "direct runs from other points between {} and {} did not reach the goal either",
            Shown(low),
            Shown(high)
        ));
        for fold in family.special.iter().filter(|s| s.kind == Kind::Fold) {
            match self.along(fold, &family.name, course, Some(&family)) {
                Ok(point) => return Ok(point),
                Err(why) => tried.push(why),
            }
            if !self.going {
                return Err("stopped on request".into());
            }
        }
        Err(tried.join(", "))
    }

    /// Carries out step 1.
    fn direct(&mut self, start: &Point, course: &Course) -> Branch {
        let sides = [course.to < course.from, course.to > course.from];
        let settings = self.settings(course.range());
        let line = Line { ties: course.ties.clone(), ..Line::new(course.free) };
        let origin = self.next_origin();
        let run = self.leg(line, settings, sides, origin, start);
        self.measure(&run, course);
        run
    }

    /// Step 3: follows the family in `via` at the parameters of a point.
    fn moved(&mut self, start: &Point) -> Branch {
        let settings = self.settings(self.homotopy.range);
        let origin = self.next_origin();
        self.leg(Line::new(self.homotopy.via), settings, [true, true], origin, start)
    }

    /// Steps 2 and 4: continues a fold towards the goal.
    fn along(
        &mut self,
        fold: &SpecialPoint,
        parent: &str,
        course: &Course,
        family: Option<&Branch>,
    ) -> Result<Point, String> {
        let via = self.homotopy.via;
        let place = fold.point.parameters[via];
        let line = Line { held: Some((Kind::Fold, via)), ties: course.ties.clone(), ..Line::new(course.free) };
        let settings =
            Settings { bounds: vec![(via, self.homotopy.range)], stability: false, ..self.settings(course.range()) };
        let origin = Origin::Switch { parent: parent.into(), kind: Kind::Fold, parameter: place };
        let curve = self.leg(line, settings, [true, true], origin, &fold.point);
        self.measure(&curve, course);
        let end = [curve.points.first(), curve.points.last()].into_iter().flatten().find(|p| course.arrives(p));
        let Some(end) = end else {
            let best = 100.0 * curve.points.iter().map(|p| course.share(p)).fold(0.0, f64::max);
            let bound = |end: &Ending| matches!(end, Ending::Bound(value) if (value - course.from).abs() < 1e-9 * (course.to - course.from).abs());
            let turned = curve.ends.iter().flatten().all(|end| bound(end) || *end == Ending::Closed);
            self.open |= !turned;
            let meets = |end: &Point| {
                let place = end.parameters[via];
                let size = self.system.unit(via) + place.abs();
                let here = |s: &SpecialPoint| (s.point.parameters[via] - place).abs() < 1e-4 * size;
                family.is_some_and(|f| f.special.iter().any(|s| s.kind == Kind::Fold && here(s)))
            };
            let ends = [curve.points.first(), curve.points.last()];
            self.shrinks |= turned && ends.into_iter().flatten().all(meets);
            let how = if turned { "turned back".into() } else { format!("ended early ({})", ending(&curve)) };
            let why = format!("the curve of the fold at {:.6} {how} after {best:.1} % of the way", Shown(place));
            self.note(&why);
            return Err(why);
        };
        let point = self.beside(end).inspect_err(|why| self.note(why))?;
        self.note(&format!(
            "reached the goal along the fold curve, from {:.6} to {:.6}",
            Shown(place),
            Shown(end.parameters[via])
        ));
        Ok(point)
    }

    fn arrival(&self, run: &Branch, course: &Course) -> Option<Point> {
        let end = if course.to > course.from { run.points.last() } else { run.points.first() };
        end.filter(|point| course.arrives(point)).cloned()
    }

    /// Records the point of a run that is closest to the goal.
    fn measure(&mut self, run: &Branch, course: &Course) {
        let best = run.points.iter().max_by(|a, b| course.share(a).total_cmp(&course.share(b)));
        if let Some(point) = best {
            let share = course.share(point);
            if self.farthest.as_ref().is_none_or(|(known, ..)| share > *known) {
                self.farthest = Some((share, point.clone(), run.held.is_some()));
            }
        }
    }

    fn settings(&self, range: [f64; 2]) -> Settings {
        growth::settings(self.system, self.plan.tolerance, range, self.homotopy.max_points)
    }

    fn next_origin(&self) -> Origin {
        match self.legs.last() {
            Some(last) => Origin::EndOf(last.name.clone()),
            None => self.origin.clone(),
        }
    }

    /// Follows one run, or takes it from an earlier attempt.
    fn leg(&mut self, line: Line, settings: Settings, sides: [bool; 2], origin: Origin, start: &Point) -> Branch {
        let name = format!("{}/{}", self.homotopy.name, self.legs.len() + 1);
        let growth = Growth {
            system: self.system,
            settings: &settings,
            degree: self.plan.degree,
            ties: line.ties.clone(),
            sides,
            parents: &[],
            marks: &[],
            observer: self.observer,
            // If a run does not arrive, others start from points inside it.
            whole: true,
            sparse: false,
        };
        let known = self.earlier.branch(&name).filter(|branch| !branch.points.is_empty());
        let branch = match known {
            Some(known) => {
                let mut branch = known.clone();
                self.going &= growth.resume(&mut branch);
                branch
            }
            None => {
                let family = self.system.family_of(&start.solution);
                let mut branch = Branch::new(&name, family, line.free, origin);
                branch.held = line.held;
                let begun =
                    growth::polished(&mut *line.problem(self.system, self.plan.degree, start), &settings, start);
                self.going &= match begun {
                    Ok(station) => growth.begin(&mut branch, Beginning::Inside(station)),
                    Err(why) => family::without_start(self.observer, &mut branch, why.to_string()),
                };
                branch
            }
        };
        self.legs.push(branch.clone());
        branch
    }

    fn short(&mut self, text: &str) {
        self.going &= self.observer.observe(Event::Short(&self.homotopy.name, text)) == Verdict::Continue;
    }

    fn note(&mut self, text: &str) {
        self.going &= self.observer.observe(Event::Note(&self.homotopy.name, text)) == Verdict::Continue;
    }
}

fn ending(run: &Branch) -> String {
    let mut ends: Vec<String> = run.ends.iter().flatten().map(|e| e.to_string()).collect();
    ends.dedup();
    ends.join(", ")
}

/// Returns points spread along a family, the nearest first.
fn places(family: &Branch, via: usize, from: f64) -> Vec<Point> {
    let count = family.points.len();
    let mut chosen: Vec<Point> =
        (1..=PLACES).map(|k| k * count / (PLACES + 1)).filter_map(|k| family.points.get(k).cloned()).collect();
    let gap = |point: &Point| (point.parameters[via] - from).abs();
    chosen.sort_by(|a, b| gap(a).total_cmp(&gap(b)));
    chosen.dedup_by_key(|point| point.position);
    chosen
}
