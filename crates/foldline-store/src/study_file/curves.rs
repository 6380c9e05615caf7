//! `[[curve]]`: special points continued in two parameters.

use super::branches::{bounds, free, marks, other_name, range, switch_step};
use super::items::{Ground, Item, Known, max_points, noun, said_or_further_down, written};
use super::seeds::state;
use super::unknown_parameter;
use crate::nearest::suggest;
use crate::toml_walk::{Value, Walk, with_article};
use foldline::contract::VectorField;
use foldline::diagram::{Family, Kind, Shown};
use foldline::explore::{BranchPlan, CurvePlan, Start};
use foldline::model::Parameter;

pub(super) const KEYS: [&str; 14] = [
    "name",
    "description",
    "hold",
    "of",
    "near",
    "to",
    "also",
    "free",
    "range",
    "branch-range",
    "until",
    "mark",
    "stop",
    "max-points",
];
const HELD: [Kind; 11] = [
    Kind::Fold,
    Kind::BranchPoint,
    Kind::Hopf,
    Kind::PeriodDoubling,
    Kind::Torus,
    Kind::Grazing,
    Kind::ImpactGrazing,
    Kind::BoundaryEquilibrium,
    Kind::Homoclinic,
    Kind::Heteroclinic,
    Kind::SaddleNodeHomoclinic,
];

/// Branch or curve on which the special point lies.
pub(super) struct Base {
    /// Name in the plan.
    name: String,
    /// Plan of this branch, or of the branch from which it is reached by branch switching; of a curve, that of the branch on
    /// which everything began.
    pub(super) plan: BranchPlan,
    /// Of a curve, its index.
    curve: Option<usize>,
    pub(super) beginning: Vec<Option<f64>>,
    /// Equilibria or cycles, if known.
    pub(super) family: Option<Family>,
    /// Second parameter of the curve on which another one starts in the same plane.
    plane: Option<usize>,
}

/// Reads a curve and adds its plan to the items read so far.
pub(super) fn read(
    walk: &mut Walk,
    item: &Item,
    name: Option<String>,
    ground: &mut Ground,
    all: &[Item],
) -> Option<Known> {
    let table = item.table;
    walk.only(table, &KEYS, "a curve");
    let base = base(walk, item, ground, all);
    // Solutions of a forced model are cycles, unless conditions take the place of periodicity.
    let forced = match ground.model.conditions() {
        [0, 0] => ground.model.forced().then_some(Family::Cycle),
        _ => Some(Family::Arc),
    };
    let hold = hold(walk, item, forced.or(base.as_ref().and_then(|base| base.family)));
    if let (true, Some(Kind::BranchPoint | Kind::Grazing), Some(value)) =
        (ground.model.iterated(), hold, item.table.get("hold"))
    {
        let message = "curves of these points are not supported for maps";
        walk.report(value.span(), message, "fold, period-doubling or torus");
    }
    let first = base.as_ref().map(|base| &ground.model.parameters[base.plan.free]);
    let curve = base.as_ref().and_then(|base| Some(ground.items.curves[base.curve?].clone()));
    let branch_range = branch_range(walk, item, base.as_ref(), curve.as_ref(), first);
    // On a curve the special point is selected by the second parameter of the curve.
    let near = match &curve {
        Some(own) => near(walk, item, Some(own.ranges[1]), Some(&ground.model.parameters[own.free])),
        None => near(walk, item, branch_range, first),
    };
    let to = to(walk, item, ground, hold, base.as_ref().and_then(|base| base.family));
    let second = second(walk, item, ground, base.as_ref());
    let further = further(walk, item, ground, hold, base.as_ref(), second);
    let max_points = max_points(walk, item);
    let marks = marks(walk, table, ground.model);
    let start = base.as_ref().zip(second).and_then(|(base, second)| base.beginning[second]);
    let own = second.map(|index| &ground.model.parameters[index]);
    let second_name = own.map(|own| own.name.as_str());
    // A target alone defines a range only if the start of the curve is known. It is never known after a mistake in the
    // branch, which has been reported already.
    let placed = start.is_some() || base.is_none() || second.is_none();
    if let (true, None, false) = (table.get("until").is_some(), table.get("range"), placed) {
        let message = format!(
            "the value of {} at the start of the curve is not known in advance",
            second_name.unwrap_or("value")
        );
        walk.report(item.span.clone(), message, "add the `range` of this parameter");
    }
    let bounds = bounds(walk, item, start, own);
    let (name, base, hold, branch_range) = (name?, base?, hold?, branch_range?);
    let (free, (range, until)) = (second?, bounds?);
    let mut end = base.beginning.clone();
    (end[free], end[base.plan.free]) = (until, None);
    let index = ground.items.curves.len();
    ground.items.curves.push(CurvePlan {
        name: name.clone(),
        hold,
        of: base.name,
        near: near.flatten(),
        to: to?,
        further: further?,
        free,
        ranges: [branch_range, range],
        until,
        marks,
        max_points,
    });
    let family = match hold {
        Kind::Hopf => Some(Family::Equilibrium),
        Kind::PeriodDoubling | Kind::Torus | Kind::Grazing | Kind::ImpactGrazing => Some(Family::Cycle),
        Kind::Homoclinic | Kind::Heteroclinic | Kind::SaddleNodeHomoclinic => Some(Family::Arc),
        Kind::BoundaryEquilibrium => Some(Family::Equilibrium),
        _ => base.family,
    };
    let end = until.map(|_| end);
    Some(Known { name, start: Start::EndOfCurve(index), beginning: base.beginning, end, family })
}

fn base(walk: &mut Walk, item: &Item, ground: &Ground, all: &[Item]) -> Option<Base> {
    let Some(value) = item.table.get("of") else {
        let message = "this curve has no `of`, the branch on which its special point lies";
        walk.report(item.span.clone(), message, "add a line such as `of = \"name of a branch\"`");
        return None;
    };
    let name = walk.string(value, "`of`")?;
    // The name of a switched branch is that of its parent, followed by one step per special point.
    let ends = || std::iter::once(name.len()).chain(name.rmatch_indices('/').map(|(end, _)| end));
    if let Some((known, rest)) = ends().find_map(|end| Some((ground.known(&name[..end])?, &name[end..]))) {
        return match known.start {
            Start::EndOf(index) => switched(walk, value, of_branch(ground, known, index), known, rest),
            Start::EndOfCurve(index) if rest.is_empty() && stays_in_plane(item, &ground.items.curves[index]) => {
                in_plane(ground, known, index)
            }
            Start::EndOfCurve(index) if rest.is_empty() => of_curve(walk, item, ground, known, index),
            _ => {
                let (short, noun) = (&known.name, with_article(noun(&known.start)));
                let message =
                    format!("\"{short}\" is {noun}, but the special point of a curve lies on a branch or a curve");
                walk.report(
                    value.span(),
                    message,
                    format!("a branch, for example one that starts `from = \"{short}\"`"),
                );
                None
            }
        };
    }
    if let Some((other, short)) = ends().find_map(|end| Some((written(all, &name[..end])?, &name[..end]))) {
        said_or_further_down(walk, value.span(), item, other, short);
        return None;
    }
    let branches = ground.known.iter().filter(|known| matches!(known.start, Start::EndOf(_)));
    let names: Vec<&str> = branches.map(|known| known.name.as_str()).collect();
    walk.report(value.span(), format!("there is no branch \"{name}\""), suggest(&name, &names));
    None
}

/// True if the curve of this item starts at a point of codimension two of another curve, in the same two parameters.
fn stays_in_plane(item: &Item, other: &CurvePlan) -> bool {
    let hold = item.table.get("hold").and_then(|value| value.get_ref().as_str()).and_then(Kind::from_name);
    matches!(
        (other.hold, hold),
        (Kind::Homoclinic, Some(Kind::SaddleNodeHomoclinic))
            | (Kind::SaddleNodeHomoclinic | Kind::Fold | Kind::Hopf, Some(Kind::Homoclinic))
    )
}

/// The base of a curve that starts on another one in the same two parameters: its branch, under its name and in its range.
fn in_plane(ground: &Ground, known: &Known, index: usize) -> Option<Base> {
    let curve = &ground.items.curves[index];
    let own = |name: &str| {
        // A switched branch is followed in the parameter of the branch it comes from.
        let ends = || std::iter::once(name.len()).chain(name.rmatch_indices('/').map(|(end, _)| end));
        ends().find_map(|end| ground.known(&name[..end]))
    };
    let parent = own(&curve.of)?;
    let below = match parent.start {
        Start::EndOf(index) => of_branch(ground, parent, index),
        Start::EndOfCurve(index) => in_plane(ground, parent, index)?,
        _ => return None,
    };
    let plan = BranchPlan { range: curve.ranges[0], ..below.plan };
    Some(Base {
        name: known.name.clone(),
        plan,
        beginning: known.beginning.clone(),
        family: None,
        curve: None,
        plane: Some(curve.free),
    })
}

pub(super) fn of_branch(ground: &Ground, known: &Known, index: usize) -> Base {
    let plan = ground.items.branches[index].clone();
    let (name, beginning) = (known.name.clone(), known.beginning.clone());
    Base { name, plan, curve: None, beginning, family: known.family, plane: None }
}

/// A curve at an extremum of which another one starts, which must be one of folds or of such extrema.
fn of_curve(walk: &mut Walk, item: &Item, ground: &Ground, known: &Known, index: usize) -> Option<Base> {
    let curve = &ground.items.curves[index];
    let value = item.table.get("hold");
    let points = value.and_then(|value| value.get_ref().as_str()) == Some(Kind::BranchPoint.name());
    let wrong = match (curve.hold, curve.further.is_empty(), points) {
        (_, _, false) => Some((
            format!("\"{}\" is a curve, and curves start on curves only as branch points", known.name),
            "`hold = \"branch-point\"`, or a branch instead of the curve",
        )),
        _ if ground.model.conditions() != [0, 0] => Some((
            "curves of boundary-value problems are followed in two parameters only".to_string(),
            "a branch instead of the curve",
        )),
        (Kind::Fold, true, _) | (Kind::BranchPoint, false, _) => None,
        _ => Some((
            format!("\"{}\" is a curve of kind {}", known.name, curve.hold.name()),
            "a curve of folds, or one of branch points with `also` or of a curve",
        )),
    };
    if let Some((message, right)) = wrong {
        let span = value.or(item.table.get("of")).map_or(item.span.clone(), |value| value.span());
        walk.report(span, message, right);
        return None;
    }
    // The branch on which everything began: the first of the plan from which the name leads here.
    let mut of = curve;
    while let Some(below) = ground.items.curves.iter().find(|own| own.name == of.of) {
        of = below;
    }
    let plan = ground
        .items
        .branches
        .iter()
        .find(|own| of.of.strip_prefix(&own.name).is_some_and(|rest| rest.is_empty() || rest.starts_with('/')));
    let (plan, beginning) = (plan?.clone(), known.beginning.clone());
    Some(Base { name: known.name.clone(), plan, curve: Some(index), beginning, family: known.family, plane: None })
}

/// Applies the branch switches `/kind-number` in `steps` to a branch; without steps, returns the branch itself.
pub(super) fn switched(walk: &mut Walk, value: &Value, mut base: Base, known: &Known, steps: &str) -> Option<Base> {
    let (from, name) = (&known.name, format!("{}{steps}", known.name));
    let mut depth = [0; Kind::ALL.len()];
    let mut switching = base.plan.switching.clone();
    for step in steps.split('/').skip(1) {
        let Some((kind, number)) = switch_step(step) else {
            let message = format!("no branch that leaves \"{from}\" is named \"{name}\"");
            walk.report(value.span(), message, format!("a name such as \"{from}/period-doubling-1\""));
            return None;
        };
        depth[kind as usize] += 1;
        if switching.at_point(kind, number) == 0 {
            let message = format!(
                "\"{name}\" will not be followed: `switch` of \"{from}\" does not go that far at {kind} \
                         points"
            );
            let right = format!("give the branch \"{from}\" a line `switch = {{ {kind} = {} }}`", depth[kind as usize]);
            walk.report(value.span(), message, right);
            return None;
        }
        switching = switching.below(kind, number);
        if kind != Kind::BranchPoint {
            base.family = Some(Family::Cycle);
        }
    }
    base.name = name;
    Some(base)
}

/// Reads the kind of special point that is continued; it must be one that solutions of the family can have.
fn hold(walk: &mut Walk, item: &Item, family: Option<Family>) -> Option<Kind> {
    let Some(value) = item.table.get("hold") else {
        let names = HELD.map(|kind| format!("\"{kind}\""));
        let message = "this curve has no `hold`, the kind of special point to continue";
        walk.report(item.span.clone(), message, format!("add `hold = …` with one of {}", names.join(", ")));
        return None;
    };
    let name = walk.string(value, "`hold`")?;
    let Some(kind) = Kind::from_name(&name).filter(|kind| HELD.contains(kind)) else {
        let message = match Kind::from_name(&name) {
            Some(_) => format!("a point of the kind {name} cannot be continued in two parameters"),
            None => format!("\"{name}\" is not a kind of special point that can be continued"),
        };
        let hint = match other_name(&name) {
            Some(own) => format!("write \"{own}\""),
            None => suggest(&name, &HELD.map(Kind::name)),
        };
        walk.report(value.span(), message, hint);
        return None;
    };
    let wrong = match (kind, family) {
        (Kind::Fold | Kind::BranchPoint, Some(Family::Arc)) => None,
        (Kind::SaddleNodeHomoclinic, Some(Family::Equilibrium)) => Some((
            "orbits homoclinic to a saddle-node are not searched for from equilibria",
            "homoclinic, or `of` a branch of cycles that ends at such an orbit",
        )),
        (_, Some(Family::Arc)) => {
            Some(("solutions of boundary-value problems have only folds and branch points", "fold or branch-point"))
        }
        (Kind::Fold, Some(Family::Torus)) => None,
        (_, Some(Family::Torus)) => Some(("of tori only folds can be continued in two parameters", "fold")),
        (Kind::Hopf, Some(Family::Cycle)) => {
            Some(("cycles have no Hopf points", "fold, branch-point, period-doubling, torus or grazing"))
        }
        (Kind::PeriodDoubling | Kind::Torus, Some(Family::Equilibrium)) => Some((
            "equilibria have only folds, branch points and Hopf points",
            "fold, branch-point or hopf, or a branch of cycles",
        )),
        (Kind::BoundaryEquilibrium, Some(Family::Cycle)) => {
            Some(("cycles touch a switching surface in grazings", "grazing"))
        }
        (Kind::Grazing | Kind::ImpactGrazing, Some(Family::Equilibrium)) => {
            Some(("equilibria meet a switching surface in boundary equilibria", "boundary-equilibrium"))
        }
        _ => None,
    };
    if let Some((message, right)) = wrong {
        walk.report(value.span(), message, right);
    }
    Some(kind)
}

/// Reads the range of the branch's free parameter in which the curve is continued.
fn branch_range(
    walk: &mut Walk,
    item: &Item,
    base: Option<&Base>,
    curve: Option<&CurvePlan>,
    first: Option<&Parameter>,
) -> Option<[f64; 2]> {
    let whole = base.map(|base| base.plan.range);
    let whole = curve.map(|curve| curve.ranges[0]).or(whole);
    let Some(value) = item.table.get("branch-range") else { return whole };
    let narrow = range(walk, value, first.map_or("", |own| &own.unit))?;
    if let Some([low, high]) = whole.filter(|[low, high]| narrow[1] < *low || narrow[0] > *high) {
        let first = first.map_or("its parameter", |own| &own.name);
        let message = format!(
            "the branch is followed in {first} from {low} to {high} only, so no curve starts in this range",
            low = Shown(low),
            high = Shown(high)
        );
        walk.report(
            value.span(),
            message,
            format!("a range that overlaps [{low}, {high}]", low = Shown(low), high = Shown(high)),
        );
    }
    Some(narrow)
}

/// Reads the value near which the special point lies; `Some(None)` if it is not given.
fn near(walk: &mut Walk, item: &Item, range: Option<[f64; 2]>, first: Option<&Parameter>) -> Option<Option<f64>> {
    let Some(value) = item.table.get("near") else { return Some(None) };
    let near = walk.quantity(value, "`near`", first.map_or("", |own| &own.unit))?;
    if let Some([low, high]) = range.filter(|[low, high]| near < *low || near > *high) {
        let first = first.map_or("the parameter of the branch", |own| &own.name);
        let message = format!(
            "`near` is {first} = {near}, but the curve stays between {low} and {high}",
            near = Shown(near),
            low = Shown(low),
            high = Shown(high)
        );
        walk.report(value.span(), message, "a value within the range, or a wider `branch-range`");
    }
    Some(Some(near))
}

/// Reads the state near the second equilibrium of a heteroclinic orbit, which starts of a branch of equilibria only;
/// `Some(None)` if it is not given.
fn to(
    walk: &mut Walk,
    item: &Item,
    ground: &Ground,
    hold: Option<Kind>,
    family: Option<Family>,
) -> Option<Option<Vec<f64>>> {
    let Some(value) = item.table.get("to") else {
        if let (Some(Kind::Heteroclinic), Some(Family::Equilibrium)) = (hold, family) {
            let message = "an orbit from an equilibrium of this branch needs a second equilibrium";
            walk.report(item.span.clone(), message, "add `to = { … }`, a state near it, or `of` a branch of cycles");
            return None;
        }
        return Some(None);
    };
    let wrong = match (hold, family) {
        (Some(Kind::Heteroclinic), Some(Family::Equilibrium) | None) => None,
        (Some(Kind::Heteroclinic), _) => Some("the equilibria are those that the cycles approach"),
        _ => Some("`to` is the second equilibrium of a heteroclinic orbit"),
    };
    if let Some(message) = wrong {
        walk.report(value.span(), message, "leave out `to`");
        return None;
    }
    state(walk, value, ground.model).map(Some)
}

/// Reads the parameters of a curve beyond the first two, with their ranges: those of the curve on which it starts, or the third
/// one of a curve of branch points; none for other curves.
fn further(
    walk: &mut Walk,
    item: &Item,
    ground: &Ground,
    hold: Option<Kind>,
    base: Option<&Base>,
    second: Option<usize>,
) -> Option<Vec<(usize, [f64; 2])>> {
    let curve = base.and_then(|base| Some(&ground.items.curves[base.curve?]));
    let Some(value) = item.table.get("also") else {
        let Some(own) = curve else { return Some(Vec::new()) };
        let all: Vec<(usize, [f64; 2])> = own.further.iter().copied().chain([(own.free, own.ranges[1])]).collect();
        if let (Some(index), Some(value)) = (second, item.table.get("free"))
            && all.iter().any(|(other, _)| *other == index)
        {
            let name = &ground.model.parameters[index].name;
            walk.report(
                value.span(),
                format!("{name} is already free along \"{}\"", own.name),
                "another parameter of the model",
            );
            return None;
        }
        return Some(all);
    };
    let taken = [base.map(|base| base.plan.free), second];
    if curve.is_some() {
        walk.report(
            value.span(),
            "a curve that starts on a curve has the parameters of that one and its own",
            "leave out `also`",
        );
        return None;
    }
    let model = ground.model;
    let wrong = match hold {
        Some(Kind::BranchPoint) | None if model.conditions() != [0, 0] => {
            Some("branch points of boundary-value problems are followed in two parameters only")
        }
        Some(Kind::BranchPoint) | None => None,
        _ => Some("`also` is the third parameter of a curve of branch points"),
    };
    if let Some(message) = wrong {
        walk.report(value.span(), message, "leave out `also`");
        return None;
    }
    let entries: Vec<_> = value.get_ref().as_table().into_iter().flat_map(|table| table.iter()).collect();
    let [(key, own)] = entries[..] else {
        walk.report(
            value.span(),
            "`also` names one parameter with its range",
            "a line such as `also = { q = [0, 1] }`",
        );
        return None;
    };
    let name: &str = key.get_ref();
    let Some(index) = model.parameter_index(name) else {
        unknown_parameter(walk, key.span(), name, model);
        return None;
    };
    if taken.contains(&Some(index)) {
        walk.report(key.span(), format!("{name} is free already"), "a third parameter of the model");
        return None;
    }
    Some(vec![(index, range(walk, own, &model.parameters[index].unit)?)])
}

/// Reads the second parameter, which must differ from that of the branch.
fn second(walk: &mut Walk, item: &Item, ground: &Ground, base: Option<&Base>) -> Option<usize> {
    let second = free(walk, item, ground.model)?;
    if let Some((base, value)) = base.zip(item.table.get("free")).filter(|(base, _)| base.plan.free == second) {
        let name = &ground.model.parameters[second].name;
        let message = format!("{name} is already the free parameter of the branch \"{}\"", base.name);
        let other = ground.model.parameters.iter().find(|parameter| parameter.name != *name);
        let right = match other {
            Some(other) => format!("a second parameter of the model, such as `{}`", other.name),
            None => "a curve needs a model with two parameters".to_string(),
        };
        walk.report(value.span(), message, right);
        return None;
    }
    let other = base.and_then(|base| Some((base, base.plane?))).filter(|(_, other)| *other != second);
    if let Some(((base, other), value)) = other.zip(item.table.get("free")) {
        let names = [base.plan.free, other].map(|index| &ground.model.parameters[index].name);
        let message = format!("the curve \"{}\" lies in the plane of {} and {}", base.name, names[0], names[1]);
        walk.report(value.span(), message, format!("the second parameter of that curve, `{}`", names[1]));
        return None;
    }
    Some(second)
}
