//! Curves for pictures, by the rules of the pictures of the command line.

use crate::bytes::numbers;
use crate::diagram::Diagram;
use crate::failure;
use crate::model::Model;
use foldline::diagram::{self, Kind};
use foldline_plot::curve;
use foldline_plot::{Marker, Picture, Quantity};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

fn quantity(py: Python, name: &str, model: &foldline::model::Model) -> PyResult<Quantity> {
    let named = foldline_plot::axis(name, model);
    named.map_err(|known| failure::of_argument(py, format!("there is no quantity `{name}`"), known))
}

/// Axis label: Greek names as letters, the unit in brackets if there is one.
#[pyfunction]
pub fn label(py: Python, model: &Model, name: &str) -> PyResult<String> {
    Ok(foldline_plot::label(quantity(py, name, &model.model)?, &model.model))
}

/// Shape of the mark for a kind of special point.
#[pyfunction]
pub fn marker(kind: &str) -> &'static str {
    match Kind::from_name(kind).map_or(Marker::Dot, Marker::of) {
        Marker::Circle => "circle",
        Marker::Square => "square",
        Marker::Diamond => "diamond",
        Marker::Triangle => "triangle",
        Marker::Nabla => "nabla",
        Marker::Right => "right",
        Marker::Left => "left",
        Marker::Cross => "cross",
        Marker::Plus => "plus",
        Marker::Star => "star",
        Marker::Dot => "dot",
    }
}

type Piece<'py> = (bool, Bound<'py, PyBytes>, Bound<'py, PyBytes>);

/// Pieces of uniform stability of a branch, cut exactly at special points: stability, abscissas and ordinates.
/// They are rounded between points, with lengths measured in `scale`, the sizes of the axes.
#[pyfunction]
pub fn pieces<'py>(
    py: Python<'py>,
    of: &Diagram,
    branch: usize,
    x: &str,
    y: &str,
    scale: (f64, f64),
) -> PyResult<Vec<Piece<'py>>> {
    let model = &of.study.model;
    let (x, y) = (quantity(py, x, model)?, quantity(py, y, model)?);
    let pieces = curve::pieces(of.branch(py, branch)?, x, y, [scale.0, scale.1]);
    let column = |piece: &curve::Piece, axis: usize| {
        numbers(py, piece.vertices.iter().map(|vertex| vertex[axis]).collect::<Vec<f64>>().into_iter())
    };
    pieces.iter().map(|piece| Ok((piece.stable, column(piece, 0)?, column(piece, 1)?))).collect()
}

/// Renders some branches as SVG.
#[pyfunction]
pub fn svg(py: Python, of: &Diagram, branches: Vec<usize>, x: &str, y: &str, size: (f64, f64)) -> PyResult<String> {
    let model = &of.study.model;
    let (x, y) = (Some(quantity(py, x, model)?), Some(quantity(py, y, model)?));
    let branches = branches.into_iter().map(|index| of.branch(py, index).cloned()).collect::<PyResult<_>>()?;
    let shown = diagram::Diagram { branches, ..diagram::Diagram::default() };
    Ok(foldline_plot::svg(&shown, model, &Picture { x, y, size: [size.0, size.1], ..Picture::default() }))
}
