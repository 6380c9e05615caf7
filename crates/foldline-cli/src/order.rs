//! The order in which branches are listed.

use foldline::diagram::{Branch, Diagram, Origin};

/// The branches of a diagram in an order that does not depend on how the work was shared out: those of the study as it
/// names them, each followed by the branches that come from it, by the parameter at which they do.
pub fn ordered(mut diagram: Diagram, study: &[&str]) -> Diagram {
    let rank = |branch: &Branch| {
        let place = study.iter().position(|name| *name == branch.name).unwrap_or(usize::MAX);
        let parameter = match branch.origin {
            Origin::Switch { parameter, .. } => parameter,
            _ => f64::NEG_INFINITY,
        };
        (place, parameter)
    };
    let mut waiting = std::mem::take(&mut diagram.branches);
    waiting.sort_by(|a, b| {
        let ((p, x), (q, y)) = (rank(a), rank(b));
        p.cmp(&q).then(x.total_cmp(&y)).then_with(|| a.name.cmp(&b.name))
    });
    // A branch is listed once its parent is; what is left over at last has no parent in the diagram.
    while !waiting.is_empty() {
        let (mut children, others): (Vec<Branch>, Vec<Branch>) = match diagram.branches.last() {
            Some(_) => waiting.into_iter().partition(|b| parent(b).is_some_and(|p| diagram.branch(p).is_some())),
            None => (Vec::new(), waiting),
        };
        waiting = others;
        if children.is_empty() {
            let next = waiting.iter().position(|b| parent(b).is_none_or(|p| waiting.iter().all(|w| w.name != p)));
            diagram.branches.push(waiting.remove(next.unwrap_or(0)));
            continue;
        }
        // Siblings stand in order behind their parent, each before what comes from it.
        for child in children.drain(..).rev() {
            let at = diagram.branches.iter().position(|b| Some(b.name.as_str()) == parent(&child));
            diagram.branches.insert(at.map_or(diagram.branches.len(), |at| at + 1), child);
        }
    }
    diagram
}

fn parent(branch: &Branch) -> Option<&str> {
    match &branch.origin {
        Origin::Switch { parent, .. } => Some(parent),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use foldline::diagram::{Family, Kind};

    fn from(parent: &str, name: &str, parameter: f64) -> Branch {
        let origin = Origin::Switch { parent: parent.into(), kind: Kind::PeriodDoubling, parameter };
        Branch::new(name, Family::Cycle, 0, origin)
    }

    #[test]
    fn children_follow_their_parent_by_parameter_whatever_the_order_of_work() {
        let root = |name: &str| Branch::new(name, Family::Cycle, 0, Origin::Seed(String::new()));
        let expected = ["a", "a1", "a1x", "a2", "b", "b1"];
        let branches = [
            root("a"),
            from("a", "a1", 1.0),
            from("a1", "a1x", 5.0),
            from("a", "a2", 2.0),
            root("b"),
            from("b", "b1", 0.0),
        ];
        for shift in 0..branches.len() {
            let mut shuffled = branches.to_vec();
            shuffled.rotate_left(shift);
            shuffled.swap(0, 3);
            let sorted = ordered(Diagram { branches: shuffled, ..Diagram::default() }, &["a", "b"]);
            assert_eq!(sorted.branches.iter().map(|b| b.name.as_str()).collect::<Vec<_>>(), expected);
        }
    }

    #[test]
    fn a_circle_of_parents_is_listed_too() {
        let branches = vec![from("b", "a", 0.0), from("a", "b", 0.0)];
        let diagram = Diagram { branches, ..Diagram::default() };
        assert_eq!(ordered(diagram, &[]).branches.len(), 2);
    }
}
