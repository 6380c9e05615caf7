//! Marks: places of a branch at which a quantity has a given value.

use super::quantity::Quantity;
use crate::contract::{Monitor, Sight};
use crate::diagram::{Ending, Kind, Point};

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

    fn reads(&self) -> Sight {
        Sight::Everything
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
