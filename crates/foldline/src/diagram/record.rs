//! The record of stability along a branch.
//!
//! **Idea.** The number of unstable eigenvalues or multipliers may change at special points only, and there by as much as their kind
//! allows. What changes otherwise was lost, or counted wrongly.

use super::{Kind, Point, SpecialPoint};

/// The number of unstable eigenvalues or multipliers as it is carried along a branch, in one direction.
pub struct Record {
    count: usize,
    family: bool,
    forwards: bool,
}

/// Disagreement of a special point with the record, as numbers of eigenvalues or multipliers.
pub struct Misfit {
    /// Difference between what the branch has on this side of it and what it says itself.
    pub on_arrival: usize,
    /// Difference between the change that it says and the one that its kind makes.
    pub of_change: usize,
}

impl Record {
    /// Begins at a point, in the direction of growing positions or against it.
    pub fn at(point: &Point, forwards: bool) -> Record {
        Record { count: point.unstable, family: point.is_one_of_family(), forwards }
    }

    /// Passes a special point.
    pub fn special(&mut self, special: &SpecialPoint) -> Misfit {
        let [first, second] = [special.unstable_before, special.unstable_after];
        let [arrival, departure] = if self.forwards { [first, second] } else { [second, first] };
        let change = first.abs_diff(second);
        let own = match special.kind {
            Kind::Fold | Kind::PeriodDoubling => 1,
            Kind::Hopf | Kind::Torus => 2,
            // A pitchfork seen from the branch that ends in it changes nothing; a kernel of several dimensions as much as that.
            _ => change,
        };
        let misfit = Misfit { on_arrival: self.count.abs_diff(arrival), of_change: change.abs_diff(own) };
        self.count = departure;
        misfit
    }

    /// Passes a point. Returns the change that nothing explains: the number before, if it is not that of the point.
    pub fn point(&mut self, point: &Point) -> Option<usize> {
        // Where a family at one value of the parameter begins or ends, a multiplier that was 1 is so no more.
        let allowed = usize::from(self.family != point.is_one_of_family());
        let before = std::mem::replace(self, Record::at(point, self.forwards)).count;
        (before.abs_diff(point.unstable) > allowed).then_some(before)
    }
}
