//! `[[homotopy]]`: solution families carried from one set of parameter values to another.

use super::branches::{contains_start, range};
use super::items::{Ground, Item, Known, max_points, origin};
use super::unknown_parameter;
use crate::toml_walk::Walk;
use foldline::explore::{HomotopyPlan, Start};
use foldline::model::Model;

pub(super) const KEYS: [&str; 7] = ["name", "description", "from", "to", "via", "range", "max-points"];

/// Reads a homotopy and adds its plan to the items read so far.
pub(super) fn read(
    walk: &mut Walk,
    item: &Item,
    name: Option<String>,
    ground: &mut Ground,
    all: &[Item],
) -> Option<Known> {
    walk.only(item.table, &KEYS, "a homotopy");
    let model = ground.model;
    let origin = origin(walk, item, ground, all);
    let beginning = origin.as_ref().map(|(_, at, _)| at.as_slice());
    let targets = targets(walk, item, model, beginning);
    let via = via(walk, item, model, targets.as_deref());
    let range = via_range(walk, item, model, via, beginning);
    let max_points = max_points(walk, item);
    let (name, (start, beginning, family), targets) = (name?, origin?, targets?);
    let (via, range) = (via?, range?);
    let mut end = beginning.clone();
    end[via] = None;
    targets.iter().for_each(|(parameter, value)| end[*parameter] = Some(*value));
    let index = ground.items.homotopies.len();
    ground.items.homotopies.push(HomotopyPlan { name: name.clone(), start, targets, via, range, max_points });
    Some(Known { name, start: Start::EndOfHomotopy(index), beginning, end: Some(end), family })
}

/// Reads the parameters to be changed and their target values, in the order of the model.
fn targets(walk: &mut Walk, item: &Item, model: &Model, start: Option<&[Option<f64>]>) -> Option<Vec<(usize, f64)>> {
    let example = model.parameters.first().map_or("mu", |p| p.name.as_str());
    let Some(value) = item.table.get("to") else {
        let message = "this homotopy has no `to`, the goal";
        walk.report(item.span.clone(), message, format!("add a line such as `to = {{ {example} = 1.0 }}`"));
        return None;
    };
    let table = walk.table(value, "`to`")?;
    if table.is_empty() {
        let right = format!("name at least one parameter: `to = {{ {example} = 1.0 }}`");
        walk.report(value.span(), "the goal of this homotopy is empty", right);
        return None;
    }
    let mut targets = Vec::new();
    for (key, value) in table.iter() {
        let name: &str = key.get_ref();
        match model.parameter_index(name) {
            Some(index) => {
                let number = walk.quantity(value, &format!("the parameter `{name}`"), &model.parameters[index].unit);
                targets.extend(number.map(|number| (index, number)));
            }
            None => unknown_parameter(walk, key.span(), name, model),
        }
    }
    if targets.len() < table.len() {
        return None;
    }
    if start.is_some_and(|start| targets.iter().all(|(index, goal)| start[*index] == Some(*goal))) {
        walk.report(value.span(), "the homotopy already starts at its goal", "a goal other than the start");
    }
    targets.sort_by_key(|(index, _)| *index);
    Some(targets)
}

/// Reads the parameter that may vary along the path; it must not have a target value.
fn via(walk: &mut Walk, item: &Item, model: &Model, targets: Option<&[(usize, f64)]>) -> Option<usize> {
    let aimed = |index: usize| targets.is_some_and(|targets| targets.iter().any(|(target, _)| *target == index));
    let other = model.parameters.iter().enumerate().find(|(index, _)| !aimed(*index));
    let Some(value) = item.table.get("via") else {
        let message = "this homotopy has no `via`, the parameter that it may vary along the path";
        let right = match other {
            Some((_, other)) => format!("add a line such as `via = \"{}\"`, and its `range`", other.name),
            None => "every parameter of the model is part of the goal; remove one from `to` and use it for `via`"
                .to_string(),
        };
        walk.report(item.span.clone(), message, right);
        return None;
    };
    let name = walk.string(value, "`via`")?;
    let Some(index) = model.parameter_index(&name) else {
        unknown_parameter(walk, value.span(), &name, model);
        return None;
    };
    if aimed(index) {
        let message = format!("{name} is part of the goal, so it cannot also be `via`");
        let right = format!(
            "remove {name} from `to`, and reach its value with a branch from the end of the homotopy; or choose \
             another parameter for `via`"
        );
        walk.report(value.span(), message, right);
        return None;
    }
    Some(index)
}

fn via_range(
    walk: &mut Walk,
    item: &Item,
    model: &Model,
    via: Option<usize>,
    start: Option<&[Option<f64>]>,
) -> Option<[f64; 2]> {
    let name = via.map_or("the parameter `via`", |index| model.parameters[index].name.as_str());
    let Some(value) = item.table.get("range") else {
        let message = format!("this homotopy has no `range` for {name}");
        walk.report(item.span.clone(), message, "add a line such as `range = [0.5, 12]`");
        return None;
    };
    let range = range(walk, value, via.map_or("", |k| &model.parameters[k].unit))?;
    let start = via.zip(start).and_then(|(via, start)| start[via]);
    contains_start(walk, item.what, value.span(), range, start, name);
    Some(range)
}
