//! `from = { branch = "…", near = { … } }`: starts at a point inside a branch.

use super::branches::{quantity, reading_unit};
use super::curves::{of_branch, switched};
use super::items::{Ground, Item, noun, said_or_further_down, written};
use crate::nearest::suggest;
use crate::toml_walk::{Value, Walk, with_article};
use foldline::diagram::Family;
use foldline::explore::{Near, Start};
use foldline::special::on_levels::Level;
use foldline::special::quantity::Quantity;
use toml::de::DeTable;

/// Point of a branch, with the parameter values known before anything is computed, and the family if it is known.
pub(super) type Place = (Near, Vec<Option<f64>>, Option<Family>);

/// Reads a start at a point of a branch.
pub(super) fn read(walk: &mut Walk, item: &Item, value: &Value, ground: &Ground, all: &[Item]) -> Option<Place> {
    let table = walk.table(value, "`from`")?;
    walk.only(table, &["branch", "near"], "`from`");
    let near = table.get("near").map(|near| levels(walk, near, ground));
    if near.is_none() {
        let message = "`from` names a branch, but no point of it";
        walk.report(value.span(), message, "add `near`, as in `from = { branch = \"upper\", near = { mu = 0.3 } }`");
    }
    let (name, index, mut at, family) = branch(walk, item, value, table, ground, all)?;
    let levels = near??;
    for level in &levels {
        if let Quantity::Parameter(index) = level.quantity {
            at[index] = Some(level.value);
        }
    }
    Some((Near { branch: index, name, levels }, at, family))
}

type Parent = (String, usize, Vec<Option<f64>>, Option<Family>);

/// Reads the name of the branch: one of the study, or one switched to from it.
fn branch(
    walk: &mut Walk,
    item: &Item,
    from: &Value,
    table: &DeTable,
    ground: &Ground,
    all: &[Item],
) -> Option<Parent> {
    let Some(value) = table.get("branch") else {
        walk.report(from.span(), "`from` names no branch", "add `branch = \"name of a branch\"`");
        return None;
    };
    let name = walk.string(value, "`branch`")?;
    let ends = || std::iter::once(name.len()).chain(name.rmatch_indices('/').map(|(end, _)| end));
    if let Some((known, steps)) = ends().find_map(|end| Some((ground.known(&name[..end])?, &name[end..]))) {
        let Start::EndOf(index) = known.start else {
            let message =
                format!("\"{}\" is {}, and has no points inside", known.name, with_article(noun(&known.start)));
            walk.report(value.span(), message, format!("write `from = \"{}\"`, or name a branch", known.name));
            return None;
        };
        let base = switched(walk, value, of_branch(ground, known, index), known, steps)?;
        let mut at = base.beginning;
        at[base.plan.free] = None;
        base.plan.holds.others.iter().for_each(|(other, _)| at[*other] = None);
        return Some((name.clone(), index, at, base.family));
    }
    if let Some(other) = ends().find_map(|end| written(all, &name[..end])) {
        said_or_further_down(walk, value.span(), item, other, &name);
        return None;
    }
    let names = ground.known.iter().filter(|known| matches!(known.start, Start::EndOf(_)));
    let names: Vec<&str> = names.map(|known| known.name.as_str()).collect();
    walk.report(value.span(), format!("there is no branch \"{name}\""), suggest(&name, &names));
    None
}

/// Reads the values of the point: one number for each quantity.
fn levels(walk: &mut Walk, value: &Value, ground: &Ground) -> Option<Vec<Level>> {
    let table = walk.table(value, "`near`")?;
    if table.is_empty() {
        walk.report(value.span(), "`near` gives no value", "values of the point, as in `near = { mu = 0.3 }`");
        return None;
    }
    let mut found = Vec::new();
    for (key, value) in table.iter() {
        let name: &str = key.get_ref();
        let Some(quantity) = quantity(walk, name, key.span(), ground.model) else { continue };
        if quantity.needs_profile() {
            let message = format!("`{name}` is not kept with every point, so it cannot select one");
            walk.report(key.span(), message, "a parameter, the period, or a state or output with _max, _min or _mean");
            continue;
        }
        let number = walk.quantity(value, "the value", reading_unit(quantity, ground.model));
        found.extend(number.map(|value| Level { quantity, value, name: name.to_string() }));
    }
    (found.len() == table.len()).then_some(found)
}
