//! An entry in `switch` of a branch, in place.

use super::{Appended, Place, root};
use crate::study_file::{Study, branches};
use foldline::diagram::Kind;
use foldline::explore::Switching;
use std::ops::Range;
use toml::de::{DeTable, DeValue};

/// Returns the study that also switches at a special point.
pub(super) fn switched(study: &Study, place: &Place) -> Result<Appended, String> {
    let Some((kind, number)) = place.special else { return Err("branches are switched at special points only".into()) };
    if !matches!(kind, Kind::PeriodDoubling | Kind::BranchPoint | Kind::Hopf) {
        return Err("branches are switched here only at period doublings, branch points and Hopf points".into());
    }
    let plan = root(study, place.branch)?;
    let steps: Vec<(Kind, usize)> = place.branch[plan.name.len()..]
        .split('/')
        .skip(1)
        .map(|step| {
            branches::switch_step(step)
                .ok_or_else(|| format!("{} is one of several branches that leave at one point", place.branch))
        })
        .collect::<Result<_, _>>()?;
    let (entry, depth) = entry(&plan.switching, &steps, kind, number)?;
    let name = format!("{}/{}-{number}", place.branch, kind.name());
    let (text, at) = inserted(&study.text, &plan.name, &entry, depth)?;
    let line = text[..at].matches('\n').count() + 1;
    Ok(Appended { text, lines: [line, line], name })
}

/// Key and depth of the entry that switches at a point of a branch reached by these steps.
fn entry(own: &Switching, steps: &[(Kind, usize)], kind: Kind, number: usize) -> Result<(String, usize), String> {
    let mut left = own.clone();
    for (kind, number) in steps {
        left = left.below(*kind, *number);
    }
    if left.at_point(kind, number) > 0 {
        return Err("the study switches here already".into());
    }
    match steps.first() {
        None => Ok((format!("{}-{number}", kind.name()), 1)),
        // Deeper, at all points of this kind on the branches below.
        Some((first, at)) if steps.iter().all(|(own, _)| *own == kind) => {
            Ok((format!("{}-{at}", first.name()), steps.len() + 1))
        }
        Some(_) => Ok((kind.name().to_string(), own.at(kind) + 1)),
    }
}

/// Returns the text with an entry in `switch` of the branch of that name, and the offset of the entry.
fn inserted(text: &str, branch: &str, key: &str, depth: usize) -> Result<(String, usize), String> {
    let (root, _) = DeTable::parse_recoverable(text);
    let tables = root.get_ref().get("branch").and_then(|list| list.get_ref().as_array());
    let named = |table: &&DeTable| table.get("name").and_then(|name| name.get_ref().as_str()) == Some(branch);
    let table = tables.into_iter().flat_map(|list| list.iter()).filter_map(|own| own.get_ref().as_table()).find(named);
    let table = table.ok_or_else(|| format!("the study has no block `[[branch]]` named \"{branch}\""))?;
    let edit = |at: Range<usize>, new: &str| {
        let mut longer = text.to_string();
        longer.replace_range(at.clone(), new);
        (longer, at.start)
    };
    let Some(switch) = table.get("switch") else {
        let end = table.get("name").map_or(0, |name| name.span().end);
        let end = text[end..].find('\n').map_or(text.len(), |line| end + line);
        let (longer, at) = edit(end..end, &format!("\nswitch = {{ {key} = {depth} }}"));
        return Ok((longer, at + 1));
    };
    let DeValue::Table(entries) = switch.get_ref() else { return Err("`switch` is not a table".into()) };
    if let Some(value) = entries.get(key) {
        return Ok(edit(value.span(), &depth.to_string()));
    }
    let span = switch.span();
    if text[span.clone()].starts_with('{') && text[span.clone()].ends_with('}') {
        let inner = text[span.start + 1..span.end - 1].trim();
        let new =
            if inner.is_empty() { format!("{{ {key} = {depth} }}") } else { format!("{{ {inner}, {key} = {depth} }}") };
        return Ok(edit(span, &new));
    }
    let last = entries.iter().map(|(_, value)| value.span().end).max();
    let last = last.ok_or("`switch` is an empty table with a header; give it an entry first")?;
    let end = text[last..].find('\n').map_or(text.len(), |line| last + line);
    let (longer, at) = edit(end..end, &format!("\n{key} = {depth}"));
    Ok((longer, at + 1))
}
