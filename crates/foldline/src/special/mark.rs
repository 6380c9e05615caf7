//! Marks: points of a branch at which a quantity has a given value, or a peak.

use super::peak::Peak;
use super::quantity::{Quantity, wrapped};
use crate::contract::{Monitor, Sight, VectorField};
use crate::diagram::{Ending, Kind, Point};
use crate::problem::Setting;

/// Value of a quantity that is marked where a branch passes it, or the peaks of the quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Quantity.
    pub quantity: Quantity,
    /// Value; without meaning for peaks.
    pub value: f64,
    /// True if the branch ends there.
    pub stop: bool,
    /// True if the peaks of the quantity are sought instead of a value.
    pub peak: bool,
}

impl Mark {
    /// Value of a quantity to be marked, or to stop at.
    pub fn at(quantity: Quantity, value: f64, stop: bool) -> Mark {
        Mark { quantity, value, stop, peak: false }
    }

    /// Peaks of a quantity.
    pub fn peak(quantity: Quantity) -> Mark {
        Mark { quantity, value: f64::NAN, stop: false, peak: true }
    }

    /// True if the quantity has the value at a point.
    pub fn meets(&self, point: &Point, field: &dyn VectorField) -> bool {
        !self.peak && self.quantity.on(point, field) == Some(self.value)
    }

    /// Monitor of this mark; `size` is the characteristic size of its quantity. The setting has the free parameters of
    /// the branch.
    pub fn monitor<'a>(self, size: f64, setting: &Setting<'a>) -> Box<dyn Monitor + 'a> {
        match self.peak {
            true => Box::new(Peak { quantity: self.quantity, setting: setting.clone() }),
            false => Box::new(Sought { mark: self, size, field: setting.field }),
        }
    }
}

/// Monitor of a value.
pub struct Sought<'a> {
    mark: Mark,
    size: f64,
    field: &'a dyn VectorField,
}

impl Monitor for Sought<'_> {
    fn kind(&self) -> Kind {
        Kind::Mark
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        let off = self.mark.quantity.on(at, self.field).map_or(f64::NAN, |own| own - self.mark.value);
        if self.mark.quantity.is_phase() { wrapped(off) } else { off }
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
        let Mark { value, stop, .. } = self.mark;
        let off = self.value(at, at);
        (stop && off.abs() <= SAME * (self.size + value.abs())).then_some(Ending::Asked(value))
    }
}
