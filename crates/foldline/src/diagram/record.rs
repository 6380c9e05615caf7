//! The record of stability along a branch.
//!
//! **Idea.** The number of unstable eigenvalues or multipliers may change only at special points, by as much as their
//! kind allows. After any other change, a special point was missed or the number counted wrongly.

use super::{Kind, Point, SpecialPoint};

/// Running number of unstable eigenvalues or multipliers along a branch, in one direction.
pub struct Record {
    count: usize,
    family: bool,
    forwards: bool,
}

/// Disagreement of a special point with the record, as numbers of eigenvalues or multipliers.
pub struct Misfit {
    /// Difference between the number carried along the branch and the special point's number on this side.
    pub on_arrival: usize,
    /// Difference between the change that the special point states and the one that its kind implies.
    pub of_change: usize,
}

impl Record {
    /// Starts at a point, in the direction of increasing positions or against it.
    pub fn at(point: &Point, forwards: bool) -> Record {
        Record { count: point.unstable, family: point.is_one_of_family(), forwards }
    }

    /// Passes a special point and returns its misfit.
    pub fn special(&mut self, special: &SpecialPoint) -> Misfit {
        let [first, second] = [special.unstable_before, special.unstable_after];
        let [arrival, departure] = if self.forwards { [first, second] } else { [second, first] };
        let change = first.abs_diff(second);
        let own = match special.kind {
            Kind::Fold | Kind::PeriodDoubling => 1,
            Kind::Hopf | Kind::Torus => 2,
            // A pitchfork seen from the branch that ends in it changes nothing; a null space of dimension d changes d.
            _ => change,
        };
        let misfit = Misfit { on_arrival: self.count.abs_diff(arrival), of_change: change.abs_diff(own) };
        self.count = departure;
        misfit
    }

    /// Passes a point. Returns the number before it if the change is unexplained.
    pub fn point(&mut self, point: &Point) -> Option<usize> {
        // At the beginning or end of a vertical branch a multiplier ceases to be 1.
        let allowed = usize::from(self.family != point.is_one_of_family());
        let before = std::mem::replace(self, Record::at(point, self.forwards)).count;
        (before.abs_diff(point.unstable) > allowed).then_some(before)
    }
}
