//! Marks: points of a branch at which a quantity has a given value.

use super::quantity::Quantity;
use crate::contract::{Monitor, Sight};
use crate::diagram::{Ending, Kind, Point};

/// Value of a quantity that is marked where a branch passes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Quantity.
    pub quantity: Quantity,
    /// Value.
    pub value: f64,
    /// True if the branch ends there.
    pub stop: bool,
}

impl Mark {
    /// Monitor of this mark; `size` is the characteristic size of its quantity.
    pub fn of_size(self, size: f64) -> Sought {
        Sought { mark: self, size }
    }
}

/// Monitor of a mark.
pub struct Sought {
    mark: Mark,
    size: f64,
}

impl Monitor for Sought {
    fn kind(&self) -> Kind {
        Kind::Mark
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        self.mark.quantity.of(at).map_or(f64::NAN, |own| own - self.mark.value)
    }

    fn confirms(&self, _at: &Point) -> bool {
        true
    }

    fn reads(&self) -> Sight {
        Sight::Everything
    }

    fn jump(&self) -> usize {
        0
    }

    fn ending(&self, at: &Point, _parameter: f64) -> Option<Ending> {
        const SAME: f64 = 1e-4;
        let Mark { quantity, value, stop } = self.mark;
        let own = quantity.of(at).is_some_and(|own| (own - value).abs() <= SAME * (self.size + value.abs()));
        (stop && own).then_some(Ending::Asked(value))
    }
}
