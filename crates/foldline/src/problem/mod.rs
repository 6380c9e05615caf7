//! What the curve is: equilibria and cycles as zero problems.
//!
//! | curve | unknowns u | file |
//! |---|---|---|
//! | equilibria | x, λ | [`equilibrium`] |
//! | cycles | profile at mesh nodes and Gauss points, T, λ | [`cycle`] |

pub mod cycle;
pub mod defect;
pub mod equilibrium;
pub mod extremes;
pub mod gauss;
pub mod mesh;

use crate::contract::VectorField;

/// A vector field with everything fixed but the continuation parameter.
#[derive(Clone)]
pub struct Setting<'a> {
    /// The vector field.
    pub field: &'a dyn VectorField,
    /// `[n]` characteristic size of each state component, for relative errors.
    pub scales: &'a [f64],
    /// `[k]` parameter values; that of `free` is ignored.
    pub parameters: Vec<f64>,
    /// Index of the continuation parameter; beyond the last one, λ is a number on which nothing depends.
    pub free: usize,
    /// Characteristic size of the continuation parameter.
    pub parameter_scale: f64,
}

impl Setting<'_> {
    /// All parameter values with the free one at `value`.
    pub fn at(&self, value: f64) -> Vec<f64> {
        let mut all = self.parameters.clone();
        if let Some(own) = all.get_mut(self.free) {
            *own = value;
        }
        all
    }

    /// The free parameters: one, or none where `free` is no parameter of the model.
    fn free_ones(&self) -> &[usize] {
        if self.free < self.parameters.len() { std::slice::from_ref(&self.free) } else { &[] }
    }
}
