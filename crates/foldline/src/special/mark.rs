//! Marks: places of a branch at which a quantity has a given value.

use crate::contract::Monitor;
use crate::diagram::{Ending, Kind, Point};

/// A quantity that every point of a branch has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The parameter of that index.
    Parameter(usize),
    /// The period of a cycle.
    Period,
    /// The smallest value of a state or output over the solution; outputs are numbered after the states.
    Smallest(usize),
    /// The largest one.
    Largest(usize),
}

impl Quantity {
    /// Its value at a point, if that has it.
    pub fn of(self, point: &Point) -> Option<f64> {
        match self {
            Quantity::Parameter(k) => point.parameters.get(k).copied(),
            Quantity::Period => point.solution.period(),
            Quantity::Smallest(k) => point.ranges.get(k).map(|range| range[0]),
            Quantity::Largest(k) => point.ranges.get(k).map(|range| range[1]),
        }
    }
}

/// A value of a quantity that is marked where a branch passes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// The quantity.
    pub quantity: Quantity,
    /// Its value.
    pub value: f64,
    /// Whether the branch ends there.
    pub stop: bool,
}

impl Monitor for Mark {
    fn kind(&self) -> Kind {
        Kind::Mark
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        self.quantity.of(at).map_or(f64::NAN, |own| own - self.value)
    }

    fn confirms(&self, _at: &Point) -> bool {
        true
    }

    fn jump(&self) -> usize {
        0
    }

    fn ending(&self, at: &Point, _parameter: f64) -> Option<Ending> {
        const SAME: f64 = 1e-4;
        let own = self.quantity.of(at).is_some_and(|own| (own - self.value).abs() <= SAME * (1.0 + self.value.abs()));
        (self.stop && own).then_some(Ending::Asked(self.value))
    }
}
