//! A model as the exploration sees it.

use foldline::explore::System;
use foldline::model::Model;

/// The system of a model, with the scales and ranges of its states and the symmetries that it has at these parameters.
pub fn system<'m>(model: &'m Model, parameters: &[f64]) -> System<'m> {
    let mut system = System {
        scales: model.states.iter().map(|s| s.scale).collect(),
        // A parameter that is zero says nothing about its size.
        parameter_scales: parameters.iter().map(|v| if *v == 0.0 { 1.0 } else { v.abs() }).collect(),
        ranges: model.states.iter().map(|s| s.range).collect(),
        whirl: model.whirl,
        ..System::new(model)
    };
    system.find_reflections(parameters);
    system
}
