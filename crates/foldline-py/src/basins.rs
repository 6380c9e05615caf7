//! Basins of attraction.

use crate::bytes::{integers, numbers, read};
use crate::failure;
use crate::model::Model;
use crate::patience::patiently;
use crate::seeds::{checked, limited};
use crate::solution::Solution;
use foldline::attractors::Fate;
use foldline::explore::System;
use foldline::explore::basins::{Plane, basins as found_basins};
use foldline::explore::section;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// Axes, numbers of cells, and a state in the plane, with NaN for values that are not given.
type Section<'b> = ((usize, usize), (usize, usize), &'b [u8]);

/// Attractors with their ratios, the fates of the samples and of the cells, the samples, the early decisions, the ranges,
/// and of an adaptive section the cells that were computed, the number of filled ones that were checked and of those that
/// were wrong.
type Found<'py> = (
    Vec<(Solution, Option<(u32, u32)>)>,
    Bound<'py, PyBytes>,
    Bound<'py, PyBytes>,
    Bound<'py, PyBytes>,
    Option<(Vec<Option<f64>>, usize, usize)>,
    Bound<'py, PyBytes>,
    Option<(Bound<'py, PyBytes>, usize, usize)>,
);

/// Follows `samples` states drawn from `ranges` `[n][2]`, NaN for those of the model, and the cells of a plane.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one for each argument of the Python function")]
pub fn basins<'py>(
    py: Python<'py>,
    model: &Model,
    parameters: &[u8],
    ranges: &[u8],
    plane: Option<Section>,
    samples: usize,
    seed: u64,
    tolerance: f64,
    jobs: usize,
    limits: (Option<usize>, Option<f64>),
    adaptive: Option<usize>,
) -> PyResult<Found<'py>> {
    let parameters = checked(py, model, parameters)?;
    let ranges = read(ranges);
    let own = model.model.clone();
    let mut system = limited(System::of(&own, &parameters), limits);
    for (range, given) in system.ranges.iter_mut().zip(ranges.as_chunks::<2>().0) {
        *range = if given[0].is_nan() { *range } else { *given };
    }
    let ranges = system.ranges.clone();
    drop(system);
    let plane = plane.map(|(axes, cells, through)| {
        let given = read(through).into_iter().zip(&ranges);
        let through = given.map(|(x, [low, high])| if x.is_nan() { 0f64.clamp(*low, *high) } else { x });
        let axes: [usize; 2] = axes.into();
        Plane { axes, ranges: axes.map(|axis| ranges[axis]), cells: cells.into(), through: through.collect() }
    });
    if let Some(axis) = plane.iter().flat_map(|plane| plane.axes).find(|axis| ranges[*axis][0] >= ranges[*axis][1]) {
        let name = &model.model.states[axis].name;
        return Err(failure::of_argument(
            py,
            format!("the range of {name} is empty"),
            format!("ranges={{'{name}': (-1, 1)}}"),
        ));
    }
    let own_ranges = ranges.clone();
    let (found, _) = patiently(py, None, &mut |_| Ok(()), move || {
        let mut system = limited(System::of(&own, &parameters), limits);
        system.ranges = own_ranges;
        match (&plane, adaptive) {
            (Some(plane), Some(size)) => {
                section::adaptive(&system, &parameters, plane, (samples, seed), (jobs, tolerance), size)
            }
            _ => found_basins(&system, &parameters, plane.as_ref(), (samples, seed), jobs, tolerance),
        }
    })?;
    let attractors = found.attractors.into_iter();
    let attractors = attractors.map(|own| (Solution::new(own.point, &model.model), own.ratio)).collect();
    let samples = integers(py, found.box_fates.iter().map(|fate| number(*fate)))?;
    let cells = integers(py, found.plane_fates.iter().map(|fate| number(*fate)))?;
    let filled = match found.filled {
        Some(own) => Some((integers(py, own.known.iter().map(|known| i64::from(*known)))?, own.checked, own.wrong)),
        None => None,
    };
    let early = found.early.map(|early| (early.radii, early.checked, early.wrong));
    let drawn = numbers(py, found.samples.into_iter())?;
    let ranges: Vec<f64> = ranges.into_iter().flatten().collect();
    Ok((attractors, samples, cells, drawn, early, numbers(py, ranges.into_iter())?, filled))
}

/// Index of the attractor, or a negative number.
fn number(fate: Fate) -> i64 {
    match fate {
        Fate::Settled(index) => index as i64,
        Fate::Unsettled => -1,
        Fate::Escaped => -2,
        Fate::Undefined => -3,
        Fate::Stuck | Fate::Chatter => -4,
        Fate::Left => -5,
    }
}
