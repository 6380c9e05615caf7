//! A branch of the plan with everything that grows from it.

use super::crossings::Sets;
use super::growth::{self, Beginning, Growth};
use super::minimal::reduced;
use super::plan::{BranchPlan, CurvePlan, Holds, Near, Plan, Start, Switching};
use super::seeds::Seeds;
use super::{System, arrival, connections, crossings, curves, discovery, holds, homotopy, known, near, switch};
use crate::continuation::{Settings, Station};
use crate::contract::{Event, Observer, Verdict};
use crate::diagram::{Branch, Diagram, Ending, Family, Kind, Origin, Point, Shown, Solution, SpecialPoint};
use crate::special::mark::Mark;
use crate::special::quantity::Quantity;
use std::ops::Range;

/// A root: something that starts at a seed, or finds its own starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Root {
    /// The branch of that index.
    Branch(usize),
    /// The homotopy of that index.
    Homotopy(usize),
    /// The exploration of that index.
    Exploration(usize),
}

/// Returns everything that starts at a seed, or finds its own starts.
pub fn roots(plan: &Plan) -> Vec<Root> {
    let seeded = |start: &Start| matches!(start, Start::Seed(_));
    let branches = (0..plan.branches.len()).filter(|&i| seeded(&plan.branches[i].start)).map(Root::Branch);
    let homotopies = (0..plan.homotopies.len()).filter(|&i| seeded(&plan.homotopies[i].start)).map(Root::Homotopy);
    let explorations = (0..plan.explorations.len()).map(Root::Exploration);
    branches.chain(homotopies).chain(explorations).collect()
}

/// Estimated number of branches that grow from a root; the largest are best started first.
pub fn weight(plan: &Plan, root: Root) -> usize {
    let following = |end: Start| {
        let branches = (0..plan.branches.len()).filter(|&i| plan.branches[i].start == end).map(Root::Branch);
        let homotopies = (0..plan.homotopies.len()).filter(|&i| plan.homotopies[i].start == end).map(Root::Homotopy);
        branches.chain(homotopies).map(|next| weight(plan, next)).sum::<usize>()
    };
    match root {
        Root::Branch(index) => {
            let branch = &plan.branches[index];
            let kinds = branch.switching.depth.iter().map(|(_, depth)| *depth);
            let depths = kinds.chain(branch.switching.only.iter().map(|(.., depth)| *depth));
            let switched: usize = depths.map(|depth| (1 << depth.min(8)) - 1).sum();
            let curves = (0..plan.curves.len()).filter(|&i| plan.curves[i].of == branch.name);
            let starts = plan.branches.iter().map(|b| &b.start).chain(plan.homotopies.iter().map(|h| &h.start));
            let behind = |start: &&Start| match start {
                Start::EndOfSwitched(from, _) => *from == index,
                Start::Near(near) => near.branch == index,
                _ => false,
            };
            let behind = starts.filter(behind).count();
            1 + switched
                + behind
                + following(Start::EndOf(index))
                + curves.map(|i| 2 + following(Start::EndOfCurve(i))).sum::<usize>()
        }
        Root::Homotopy(index) => 4 + following(Start::EndOfHomotopy(index)),
        Root::Exploration(_) => 100,
    }
}

/// Follows everything that grows from a root, in order.
pub fn grow(
    system: &System,
    plan: &Plan,
    root: Root,
    seeds: &Seeds<'_>,
    jobs: usize,
    earlier: &Diagram,
    observer: &dyn Observer,
) -> Vec<Branch> {
    let mut work = Work { system, plan, earlier, observer, branches: Vec::new(), budget: usize::MAX };
    let seeded = |start: &Start| match start {
        Start::Seed(seed) => Some((Origin::Seed(plan.seeds[*seed].name.clone()), seeds.point(*seed))),
        _ => None,
    };
    match root {
        Root::Branch(index) => {
            seeded(&plan.branches[index].start).map(|(origin, point)| work.planned(index, origin, point))
        }
        Root::Homotopy(index) => {
            seeded(&plan.homotopies[index].start).map(|(origin, point)| work.brought(index, origin, point))
        }
        Root::Exploration(index) => {
            let exploration = &plan.explorations[index];
            let mut own = Work { system, plan, earlier, observer, branches: Vec::new(), budget: usize::MAX };
            discovery::explore(&mut own, exploration, jobs / plan.explorations.len().max(1));
            return own.branches;
        }
    };
    work.branches
}

/// The branches grown so far, and what they grow from.
pub(super) struct Work<'w> {
    pub(super) system: &'w System<'w>,
    pub(super) plan: &'w Plan,
    pub(super) earlier: &'w Diagram,
    pub(super) observer: &'w dyn Observer,
    pub(super) branches: Vec<Branch>,
    /// No branch is switched to once this many points are accepted.
    pub(super) budget: usize,
}

/// A branch yet to be switched from: its index, and the depth.
struct Pending {
    branch: usize,
    switching: Switching,
}

/// A special point at which to switch, with the settings for it.
struct Leaving<'l> {
    plan: &'l BranchPlan,
    settings: &'l Settings,
    parent: &'l Branch,
    special: &'l SpecialPoint,
    label: String,
    /// Switching on the branches that leave.
    below: Switching,
}

impl Work<'_> {
    /// Follows a branch of the plan, the branches switched to from it, and the branches that start at its end.
    fn planned(&mut self, index: usize, origin: Origin, start: Result<Point, String>) -> bool {
        let plan = &self.plan.branches[index];
        let first = self.branches.len();
        if !self.grown(plan, origin, start) {
            return false;
        }
        let Some(branch) = self.branches.get(first) else { return true };
        let ended = end_of(branch, plan);
        let last = self.branches.len();
        self.curves(first..last)
            && self.after(Start::EndOf(index), &plan.name, ended)
            && self.after_switched(index, first..last)
            && self.after_inside(index, first..last)
    }

    /// Follows the branches and homotopies that start at points inside a branch and those switched to from it.
    fn after_inside(&mut self, index: usize, grown: Range<usize>) -> bool {
        let plan = self.plan;
        let of_this = |start: &Start| match start {
            Start::Near(near) if near.branch == index => Some(near.clone()),
            _ => None,
        };
        let branches = plan.branches.iter().enumerate().filter_map(|(i, own)| Some((i, of_this(&own.start)?, false)));
        let homotopies = plan.homotopies.iter().enumerate();
        let homotopies = homotopies.filter_map(|(i, own)| Some((i, of_this(&own.start)?, true)));
        let all: Vec<(usize, Near, bool)> = branches.chain(homotopies).collect();
        all.into_iter().all(|(next, near, is_homotopy)| {
            let parent = self.branches[grown.clone()].iter().find(|branch| branch.name == near.name);
            let point = parent.map_or_else(
                || Err(format!("no switch led to a branch {}", near.name)),
                |parent| near::point_of(self.system, plan, &near, parent, self.observer),
            );
            let origin = near::origin(&near, parent, &point);
            match is_homotopy {
                true => self.brought(next, origin, point),
                false => self.planned(next, origin, point),
            }
        })
    }

    /// Follows the branches and homotopies that start at the ends of switched branches.
    fn after_switched(&mut self, index: usize, grown: Range<usize>) -> bool {
        let plan = self.plan;
        let starts = plan.branches.iter().map(|b| &b.start).chain(plan.homotopies.iter().map(|h| &h.start));
        let mut names: Vec<&String> = starts
            .filter_map(|start| match start {
                Start::EndOfSwitched(from, name) if *from == index => Some(name),
                _ => None,
            })
            .collect();
        names.sort();
        names.dedup();
        names.into_iter().all(|name| {
            let own = self.branches[grown.clone()].iter().find(|branch| branch.name == *name);
            let ended = own.map_or_else(|| Err(format!("no switch led to a branch {name}")), end_of_switched);
            self.after(Start::EndOfSwitched(index, name.clone()), name, ended)
        })
    }

    /// Follows a branch and the branches switched to from it. Returns false if the observer wants to stop.
    pub(super) fn grown(&mut self, plan: &BranchPlan, origin: Origin, start: Result<Point, String>) -> bool {
        let Some((branch, going)) = self.root(plan, origin, start) else { return true };
        self.branches.push(branch);
        if !going {
            return false;
        }
        let mut queue = vec![Pending { branch: self.branches.len() - 1, switching: plan.switching.clone() }];
        while !queue.is_empty() {
            let pending = queue.remove(0);
            match self.switched(plan, &pending) {
                Some(more) => queue.extend(more),
                None => return false,
            }
        }
        true
    }

    /// Number of points on all branches.
    pub(super) fn points(&self) -> usize {
        self.branches.iter().map(|branch| branch.points.len()).sum()
    }

    /// Follows the branches and homotopies that start there.
    fn after(&mut self, start: Start, name: &str, point: Result<Point, String>) -> bool {
        let plan = self.plan;
        let origin = || Origin::EndOf(name.to_string());
        let branches = (0..plan.branches.len()).filter(|&i| plan.branches[i].start == start);
        let homotopies = (0..plan.homotopies.len()).filter(|&i| plan.homotopies[i].start == start);
        branches.into_iter().all(|i| {
            let parent = self.branches.iter().find(|branch| branch.name == name);
            let held = parent.and_then(|parent| holds::on_branch(self.system, &plan.branches[i], parent, &point));
            self.planned(i, origin(), held.unwrap_or_else(|| point.clone()))
        }) && homotopies.into_iter().all(|i| self.brought(i, origin(), point.clone()))
    }

    /// Follows a homotopy, and everything that starts at its goal.
    fn brought(&mut self, index: usize, origin: Origin, start: Result<Point, String>) -> bool {
        let homotopy = &self.plan.homotopies[index];
        let start = start.and_then(|point| match point.solution {
            Solution::Torus(_) => Err("tori cannot be carried by a homotopy; follow a branch with `until`".into()),
            _ => Ok(point),
        });
        let route = homotopy::find(self.system, self.plan, homotopy, origin, start, self.earlier, self.observer);
        self.branches.extend(route.legs);
        route.going && self.after(Start::EndOfHomotopy(index), &homotopy.name, route.arrived)
    }

    /// Follows the curves that start on those branches, and everything that starts at their ends.
    fn curves(&mut self, parents: Range<usize>) -> bool {
        for (index, curve) in self.plan.curves.iter().enumerate() {
            let Some(parent) = self.branches[parents.clone()].iter().find(|b| b.name == curve.of).cloned() else {
                continue;
            };
            let earlier = self.earlier.branch(&curve.name);
            let follow = match curve.hold {
                Kind::Homoclinic | Kind::Heteroclinic | Kind::SaddleNodeHomoclinic => connections::follow,
                _ => curves::follow,
            };
            let (branch, going) = match curve.further.is_empty() {
                false => self.in_further_parameters(curve, &parent),
                true => follow(self.system, self.plan, curve, &parent, earlier, self.observer),
            };
            let ended = curves::end_of(self.system, self.plan, curve, &branch);
            self.branches.push(branch);
            let own = self.branches.len() - 1;
            // Other curves start at its extrema and at its points of codimension two.
            if !going || !self.curves(own..own + 1) || !self.after(Start::EndOfCurve(index), &curve.name, ended) {
                return false;
            }
        }
        true
    }

    /// Follows branch points in three parameters, or extrema in more.
    fn in_further_parameters(&self, curve: &CurvePlan, parent: &Branch) -> (Branch, bool) {
        let start = curves::start(curve, parent).map(|special| special.point.clone());
        // The parameter of the branch over which everything began is the first of a curve, or the last of those solved for.
        let first = parent.held.map(|(_, first)| first).or(parent.also.last().map(|(index, _)| *index));
        let first = first.unwrap_or(parent.free);
        let start = start.and_then(|point| match (&point.solution, curve.further.len()) {
            (Solution::Equilibrium(_), _) | (_, 1) => Ok(point),
            _ => Err("extrema of cycles are followed in three parameters, those of equilibria in more\nlikely cause: the curve \
                      starts from one in three parameters\nwhat to do: fix one of the parameters"
                .to_string()),
        });
        let parameter = start.as_ref().map_or(f64::NAN, |point| point.parameters[first]);
        let origin = Origin::Switch { parent: parent.name.clone(), kind: curve.hold, parameter };
        let plan = BranchPlan {
            name: curve.name.clone(),
            start: Start::Seed(0),
            free: curve.free,
            range: curve.ranges[1],
            until: curve.until,
            switching: Switching::default(),
            // An extremum of the parameter that is solved for can be followed in one more parameter.
            marks: curve
                .further
                .first()
                .map(|own| Mark::peak(Quantity::Parameter(own.0)))
                .into_iter()
                .chain(curve.marks.clone())
                .collect(),
            max_points: curve.max_points,
            holds: Holds {
                others: curve
                    .further
                    .iter()
                    .map(|(index, range)| (*index, Some(*range)))
                    .chain([(first, Some(curve.ranges[0]))])
                    .collect(),
                singular: true,
                ..Holds::default()
            },
        };
        self.held(&plan, origin.clone(), start)
            .unwrap_or_else(|| (Branch::new(&curve.name, parent.family, curve.free, origin), true))
    }

    fn growth_settings(&self, plan: &BranchPlan, start: &Point) -> (Settings, [bool; 2]) {
        let value = start.parameters.get(plan.free).copied().unwrap_or(0.0);
        let (range, sides) = match plan.until {
            Some(target) if target >= value => ([plan.range[0].min(value), target], [false, true]),
            Some(target) => ([target, plan.range[1].max(value)], [true, false]),
            None => (plan.range, [true, true]),
        };
        (growth::settings(self.system, self.plan.tolerance, range, plan.max_points), sides)
    }

    /// Follows a branch on which quantities are held, or resumes it.
    pub(super) fn held(
        &self,
        plan: &BranchPlan,
        origin: Origin,
        start: Result<Point, String>,
    ) -> Option<(Branch, bool)> {
        let bounded = |(settings, sides): (Settings, [bool; 2])| {
            let bounds = plan.holds.others.iter().filter_map(|(index, range)| Some((*index, (*range)?))).collect();
            let stability = settings.stability && !plan.holds.singular && !self.system.is_open();
            (Settings { bounds, stability, ..settings }, sides)
        };
        let grow = |holds: &Holds, settings: &Settings, sides, branch: &mut Branch, station: Option<Station>| {
            let system = System { holds: Some(holds), ..self.system.clone() };
            let growth = Growth { system: &system, ..self.growth(plan, settings, sides, &[]) };
            match station {
                Some(station) => growth.begin(branch, Beginning::Inside(station)),
                None => growth.resume(branch),
            }
        };
        if let Some(earlier) = self.earlier.branch(&plan.name).filter(|b| !b.points.is_empty()) {
            let (settings, sides) =
                bounded(self.growth_settings(plan, earlier.points.iter().find(|p| p.position == 0)?));
            let mut holds = plan.holds.clone();
            holds.levels.iter_mut().zip(&earlier.levels).for_each(|(level, (_, value))| level.value = *value);
            let mut branch = earlier.clone();
            let going = grow(&holds, &settings, sides, &mut branch, None);
            return Some((branch, going));
        }
        let family = match &start {
            Ok(point) => self.system.family_of(&point.solution),
            Err(_) if self.system.is_open() => Family::Arc,
            Err(_) => Family::Cycle,
        };
        let mut branch = Branch::new(&plan.name, family, plan.free, origin);
        let begun = start.and_then(|point| {
            let only_rotation = matches!(&plan.holds.levels[..], [level] if level.quantity == Quantity::Rotation);
            if matches!(point.solution, Solution::Torus(_)) && !only_rotation {
                return Err("along tori only the rotation number can be held, `hold = \"rotation\"`".into());
            }
            let moving: Vec<(usize, [f64; 2])> =
                plan.holds.others.iter().filter_map(|(index, range)| Some((*index, (*range)?))).collect();
            self.system.repeats(&point.parameters, &[&moving[..], &[(plan.free, plan.range)]].concat())?;
            let (settings, sides) = bounded(self.growth_settings(plan, &point));
            let holds = holds::resolved(self.system, &plan.holds, &point)?;
            let station = holds::first(self.system, plan, &holds, self.plan.degree, &settings, &point)?;
            let outside = |index: usize, [low, high]: [f64; 2]| {
                let value = station.point.parameters.get(index).copied().unwrap_or(low);
                // A start at the end of a range is known as accurately as it is solved for.
                let slack = settings.newton_tolerance() * (self.system.unit(index) + value.abs());
                (value < low - slack || value > high + slack).then(|| {
                    format!("the start {} lies outside the range [{}, {}]", Shown(value), Shown(low), Shown(high))
                })
            };
            let mut ranges = settings.bounds.clone();
            if plan.until.is_none() {
                ranges.push((plan.free, plan.range));
            }
            match ranges.into_iter().find_map(|(index, range)| outside(index, range)) {
                Some(why) => Err(why),
                None => Ok((holds, settings, sides, station)),
            }
        });
        let going = match begun {
            Ok((holds, settings, sides, station)) => grow(&holds, &settings, sides, &mut branch, Some(station)),
            Err(why) => without_start(self.observer, &mut branch, why),
        };
        Some((branch, going))
    }

    /// Follows a branch of the plan itself, or resumes it if an earlier run has it.
    fn root(&self, plan: &BranchPlan, origin: Origin, start: Result<Point, String>) -> Option<(Branch, bool)> {
        if !plan.holds.levels.is_empty() {
            return self.held(plan, origin, start);
        }
        let known = self.earlier.branch(&plan.name).filter(|b| !b.points.is_empty());
        if let Some(earlier) = known {
            let (settings, sides) = self.growth_settings(plan, earlier.points.iter().find(|p| p.position == 0)?);
            let growth = self.growth(plan, &settings, sides, &[]);
            let mut branch = earlier.clone();
            let going = growth.resume(&mut branch);
            return Some((branch, going));
        }
        let family = match &start {
            Ok(point) => self.system.family_of(&point.solution),
            Err(_) if self.system.is_open() => Family::Arc,
            Err(_) => Family::Cycle,
        };
        let mut branch = Branch::new(&plan.name, family, plan.free, origin);
        let begun = start.and_then(|point| {
            let value = point.parameters.get(plan.free).copied().unwrap_or(0.0);
            let name = format!(
                "the start {} lies outside the range [{}, {}]",
                Shown(value),
                Shown(plan.range[0]),
                Shown(plan.range[1])
            );
            let inside = plan.until.is_some() || (plan.range[0] <= value && value <= plan.range[1]);
            self.system.repeats(&point.parameters, &[(plan.free, plan.range)])?;
            let (settings, sides) = self.growth_settings(plan, &point);
            let mut problem = growth::problem_of(self.system, plan.free, self.plan.degree, &point, false);
            let station = growth::first(&mut *problem, &settings, &point).map_err(|why| why.to_string())?;
            if inside { Ok((settings, sides, station)) } else { Err(name) }
        });
        let going = match begun {
            Ok((settings, sides, station)) => {
                self.growth(plan, &settings, sides, &[]).begin(&mut branch, Beginning::Inside(station))
            }
            Err(why) => without_start(self.observer, &mut branch, why),
        };
        Some((branch, going))
    }

    fn growth<'s>(
        &'s self,
        plan: &'s BranchPlan,
        settings: &'s Settings,
        sides: [bool; 2],
        parents: &'s [SpecialPoint],
    ) -> Growth<'s> {
        Growth {
            system: self.system,
            settings,
            degree: self.plan.degree,
            ties: Vec::new(),
            sides,
            parents,
            marks: &plan.marks,
            observer: self.observer,
            whole: false,
            // Branch switching checks whether a branch is known by comparison with the points of all.
            sparse: self.observer.stores()
                && self.plan.explorations.is_empty()
                && self.plan.designs.is_empty()
                && !self.plan.starts_inside()
                && !self.plan.branches.iter().any(|b| b.switching.anywhere()),
        }
    }

    pub(super) fn tell(&self, event: Event) -> bool {
        self.observer.observe(event) == Verdict::Continue
    }

    /// Follows every branch that leaves the special points of one branch; `None` if the observer wants to stop.
    fn switched(&mut self, plan: &BranchPlan, pending: &Pending) -> Option<Vec<Pending>> {
        let parent = self.branches[pending.branch].clone();
        let settings = growth::settings(self.system, self.plan.tolerance, plan.range, plan.max_points);
        let mut counts = [0usize; Kind::ALL.len()];
        let (mut more, mut left) = (Vec::new(), Vec::new());
        for special in &parent.special {
            let slot = Kind::ALL.iter().position(|k| *k == special.kind)?;
            counts[slot] += 1;
            if pending.switching.at_point(special.kind, counts[slot]) == 0 {
                continue;
            }
            let parameter = special.point.parameters[parent.free];
            let label = format!("{} {:.6} of {}", special.kind, Shown(parent.rounded(parameter)), parent.name);
            if self.points() >= self.budget {
                left.push(format!("{} {:.6}", special.kind, Shown(parent.rounded(parameter))));
                continue;
            }
            if self.observer.stopping() {
                return None;
            }
            let name = format!("{}/{}-{}", parent.name, special.kind, counts[slot]);
            let below = pending.switching.below(special.kind, counts[slot]);
            let leaving = Leaving { plan, settings: &settings, parent: &parent, special, label, below };
            let of_torus = matches!(special.point.solution, Solution::Torus(_));
            let kernel = match special.kind {
                Kind::BranchPoint if !of_torus => special.kernel(),
                Kind::PeriodDoubling if !of_torus => parent.together_with(special),
                _ => 1,
            };
            let going = match kernel {
                1 => self.left(&leaving, name, &mut more),
                _ if special.kind == Kind::PeriodDoubling && parent.earlier_there(special) > 0 => {
                    let said = format!("{}: its branches are those of the period doubling with it", leaving.label);
                    self.tell(Event::Note(&parent.name, &said))
                }
                _ => self.left_in_all_directions(&leaving, &name, kernel, &mut more),
            };
            if !going {
                return None;
            }
        }
        let found = |kind: Kind| Kind::ALL.iter().position(|k| *k == kind).map_or(0, |slot| counts[slot]);
        for (kind, number, depth) in &pending.switching.only {
            if *depth > 0 && *number > found(*kind) {
                let there = match found(*kind) {
                    0 => "none".to_string(),
                    count => format!("{count} only"),
                };
                let said = format!("no branch switching at {kind} {number}: the branch has {there} in its range");
                self.tell(Event::Short(&parent.name, &said));
            }
        }
        if !left.is_empty() {
            let said = format!("no branch switching, because the budget of points is used up: {}", left.join(", "));
            self.tell(Event::Short(&parent.name, &said));
        }
        Some(more)
    }

    /// Follows the branch that leaves a special point. Returns false if the observer wants to stop.
    fn left(&mut self, at: &Leaving, name: String, more: &mut Vec<Pending>) -> bool {
        let Leaving { settings, parent, special, label, .. } = at;
        if let Some(going) = self.resumed(at, &name, more) {
            return going;
        }
        let parameter = special.point.parameters[parent.free];
        // At the branch point where a branch itself started, the other branch is its parent.
        if let Origin::Switch { parent: from, kind: Kind::BranchPoint, parameter: there } = &parent.origin
            && special.kind == Kind::BranchPoint
            && (there - parameter).abs() < 1e3 * self.plan.tolerance * parent.size(*there)
        {
            self.tell(Event::Note(&parent.name, &format!("{label}: leads back to the parent branch {from}")));
            return true;
        }
        if let Some(already) = arrival::at(self.system, self.plan.tolerance, &self.branches, parent, special) {
            self.tell(Event::Note(&parent.name, &format!("{label}: leads to {already}, which ends here")));
            return true;
        }
        let pair = parent.earlier_there(special);
        match switch::beginning(self.system, settings, parent.free, self.plan.degree, special, pair) {
            None => true,
            Some(Ok((family, beginning))) => {
                let beginning = self.of_one_turn(settings, parent.free, special.kind, beginning);
                self.begun(at, name, family, beginning, more)
            }
            Some(Err(why)) => {
                let said = format!("{label}: no bifurcating branch found: {why}");
                self.tell(Event::Short(&parent.name, &said));
                true
            }
        }
    }

    /// Follows all branches that cross at a branch point with a null space of several dimensions. Returns false if the
    /// observer wants to stop.
    fn left_in_all_directions(&mut self, at: &Leaving, name: &str, dimension: usize, more: &mut Vec<Pending>) -> bool {
        // The number of directions grows as 3^d.
        const MOST: usize = 4;
        let Leaving { settings, parent, special, label, .. } = at;
        if let Origin::Switch { parent: from, kind: Kind::BranchPoint, parameter: there } = &parent.origin
            && (there - special.point.parameters[parent.free]).abs() < 1e3 * self.plan.tolerance * parent.size(*there)
        {
            return self.tell(Event::Note(
                &parent.name,
                &format!("{label}: its branches are those of the parent branch {from}"),
            ));
        }
        if dimension > MOST {
            let said = format!(
                "{label}: its branches are not followed, because its null space has dimension {dimension}; the limit \
                 is {MOST}"
            );
            return self.tell(Event::Short(&parent.name, &said));
        }
        let found = match crossings::crossings(self.system, settings, parent.free, self.plan.degree, special, dimension)
        {
            Ok(found) => found,
            Err(why) => {
                let said = format!("{label}: no bifurcating branch found: {why}");
                return self.tell(Event::Short(&parent.name, &said));
            }
        };
        let (count, directions) = (found.beginnings.len(), found.directions);
        let said = match found.sets {
            Sets::Continuous => format!(
                "{label}: null space of dimension {dimension}, with a bifurcating branch in every direction; one of \
                 them is followed"
            ),
            Sets::Undecided => format!(
                "{label}: null space of dimension {dimension}; more than {} bifurcating branches seem to leave, so \
                 that terms beyond the cubic ones decide; one of them is followed\nwhat to do: start branches at \
                 solutions farther from this point, found by sampling",
                (3usize.pow(dimension as u32) - 1) / 2
            ),
            Sets::Discrete => format!(
                "{label}: null space of dimension {dimension}; {count} bifurcating branches found, searched for in \
                 {directions} directions"
            ),
        };
        let family = parent.family;
        let said = match special.kind {
            Kind::PeriodDoubling => said.replace("null space", "multiplier -1 with a null space"),
            _ => said,
        };
        let event = match found.sets {
            Sets::Undecided => Event::Short(&parent.name, &said),
            _ => Event::Note(&parent.name, &said),
        };
        self.tell(event)
            && found.beginnings.into_iter().enumerate().all(|(index, beginning)| {
                let own = if index == 0 { name.to_string() } else { format!("{name}-{}", index + 1) };
                let resumed = self.resumed(at, &own, more);
                resumed.unwrap_or_else(|| self.begun(at, own, family, beginning, more))
            })
    }

    /// Resumes the branch of that name if an earlier run has it.
    fn resumed(&mut self, at: &Leaving, name: &str, more: &mut Vec<Pending>) -> Option<bool> {
        // A doubled branch that has only the special point starts again.
        let begun = |b: &&Branch| b.points.len() > usize::from(growth::is_doubled(b));
        let mut branch = self.earlier.branch(name).filter(begun)?.clone();
        let going = self.growth(at.plan, at.settings, [true, true], &at.parent.special).resume(&mut branch);
        Some(self.keep(at, branch, going, more))
    }

    /// Follows a branch from its first point, unless it is known.
    fn begun(
        &mut self,
        at: &Leaving,
        name: String,
        family: Family,
        beginning: Beginning,
        more: &mut Vec<Pending>,
    ) -> bool {
        let Leaving { plan, settings, parent, special, label, .. } = at;
        let (Beginning::Inside(station) | Beginning::Edge { first: station, .. }) = &beginning;
        let (free, degree, first) = (parent.free, self.plan.degree, &station.point);
        let known = known::branch_of(self.system, settings, free, degree, first, &self.branches, self.observer);
        // Branches are too close to a parent with a null space of several dimensions; their direction told them apart.
        let together = special.kind == Kind::PeriodDoubling && parent.together_with(special) > 1;
        let parted = special.kind == Kind::BranchPoint && special.kernel() > 1 || together;
        if let Some(already) = known.filter(|known| !(parted && *known == parent.name)) {
            return self.tell(Event::Note(&parent.name, &format!("{label}: leads to {already}, already known")));
        }
        let parameter = special.point.parameters[free];
        let origin = Origin::Switch { parent: parent.name.clone(), kind: special.kind, parameter };
        let mut branch = Branch::new(name, family, free, origin);
        let going = self.growth(plan, settings, [true, true], &parent.special).begin(&mut branch, beginning);
        self.keep(at, branch, going, more)
    }

    /// Keeps a branch that was switched to, and queues it for switching.
    fn keep(&mut self, at: &Leaving, branch: Branch, going: bool, more: &mut Vec<Pending>) -> bool {
        self.branches.push(branch);
        more.push(Pending { branch: self.branches.len() - 1, switching: at.below.clone() });
        going
    }

    /// Returns the start of a branch with its cycle reduced to the minimal period. A cycle that bifurcated from several
    /// turns of another meets that other cycle again at a branch point.
    fn of_one_turn(&self, settings: &Settings, free: usize, at: Kind, beginning: Beginning) -> Beginning {
        let (Beginning::Inside(station) | Beginning::Edge { first: station, .. }) = &beginning;
        let once = (at == Kind::BranchPoint).then(|| reduced(self.system, settings, &station.point)).flatten();
        let once = once.and_then(|point| {
            let mut problem = growth::problem_of(self.system, free, self.plan.degree, &point, false);
            growth::polished(&mut *problem, settings, &point).ok()
        });
        once.map_or(beginning, Beginning::Inside)
    }
}

/// Reports a branch that could not start. Returns false if the observer wants to stop.
pub(super) fn without_start(observer: &dyn Observer, branch: &mut Branch, why: String) -> bool {
    let tell = |event: Event| observer.observe(event) == Verdict::Continue;
    if observer.stopping() {
        return false;
    }
    let mut going = tell(Event::Begin(branch));
    for side in [1, 0] {
        let ending = Ending::NoStart(why.clone());
        branch.ends[side] = Some(ending.clone());
        going &= tell(Event::SideEnded(branch, side, &ending));
    }
    going & tell(Event::End(branch))
}

/// End of a switched branch at which another one starts: at a bound or requested stop, the forward end first.
fn end_of_switched(branch: &Branch) -> Result<Point, String> {
    let ends = [(&branch.ends[1], branch.points.last()), (&branch.ends[0], branch.points.first())];
    let whole = |end: &Option<Ending>| matches!(end, Some(Ending::Bound(_) | Ending::Asked(_)));
    let found = ends.into_iter().find_map(|(end, point)| point.filter(|_| whole(end)));
    found.cloned().ok_or_else(|| {
        let said: Vec<String> = branch.ends.iter().flatten().map(Ending::brief).collect();
        format!("the branch {} did not end at a bound or a `stop`: {}", branch.name, said.join("; "))
    })
}

/// Returns the end of a planned branch at which another one starts: its target, or its forward bound.
fn end_of(branch: &Branch, plan: &BranchPlan) -> Result<Point, String> {
    let start = branch.points.iter().find(|p| p.position == 0).map(|p| p.parameters[plan.free]);
    let backward = matches!((plan.until, start), (Some(target), Some(value)) if target < value);
    let side = if backward { 0 } else { 1 };
    let point = if backward { branch.points.first() } else { branch.points.last() };
    // A branch that turned back may have left its range where it began.
    let arrived = |value: f64| plan.until.is_none_or(|target| (value - target).abs() <= 1e-9 * branch.size(target));
    match (&branch.ends[side], point) {
        (Some(Ending::Bound(value)), Some(point)) if arrived(*value) => Ok(point.clone()),
        (Some(Ending::Asked(_)), Some(point)) => Ok(point.clone()),
        (Some(other), _) => Err(format!("the branch {} did not reach its end: {other}", plan.name)),
        _ => Err(format!("the branch {} is unfinished", plan.name)),
    }
}
