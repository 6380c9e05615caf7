//! `foldline plot --map`: a map over one or two parameters as a picture.

use crate::arguments::Plot as Typed;
use crate::failure::{Failure, Outcome};
use crate::plot::picture;
use crate::table::{Run, map_of, read};
use foldline::diagram::CellValue;
use foldline_plot::map::{Along, Shown, line_svg, plane_svg};
use foldline_store::maps::{Array, Arrays, Class, arrays};
use foldline_store::nearest::suggest;
use foldline_store::run_file::Part;

/// Writes the picture of a map.
pub fn write(typed: &Typed, name: &str) -> Result<Outcome, Failure> {
    let Run { model, plan, diagram, .. } = read(&typed.folder, Part::Special)?;
    let map = map_of(&plan, name)?;
    let found = arrays(map, &diagram.cells, &model);
    let Some(axes) = &found.map.axes else {
        let cure = format!("foldline table {} --map \"{name}\" --format csv", typed.folder.display());
        return Err(Failure::typed(
            format!("--map {name}: a list of cases has no order in which it could be drawn"),
            cure,
        ));
    };
    let along: Vec<Along> = (found.parameters.iter().zip(axes))
        .map(|(own, axis)| Along { name: &own.name, unit: &own.unit, values: axis })
        .collect();
    let array = asked(typed, &found)?;
    let title = typed.title.as_deref().unwrap_or("");
    let svg = match &along[..] {
        [x] => line_svg(x, &headed(array), &curves(typed, &found, array)?, title),
        [x, y] => plane_svg(x, y, &plane(typed, &found, array)?, title),
        _ => {
            let message = format!("--map {name}: a map over {} parameters cannot be drawn", along.len());
            return Err(Failure::typed(message, "make a map over one or two of them"));
        }
    };
    picture(&svg, &typed.output)?;
    Ok(Outcome::Done)
}

/// Name and unit.
fn headed(array: &Array) -> String {
    match array.unit.as_str() {
        "" | "1" | "-" => array.name.clone(),
        unit => format!("{} [{unit}]", array.name),
    }
}

/// The quantity to draw: over two parameters by default the text of each cell, over one the first number.
fn asked<'a>(typed: &Typed, found: &'a Arrays) -> Result<&'a Array, Failure> {
    let all = || found.cells.iter().chain(&found.items);
    let Some(name) = &typed.of else {
        let text = found.cells.iter().find(|own| own.class == Class::Text && !reserved(own));
        let shares = || found.items.iter().find(|own| own.name == "share");
        let numbers = || found.items.iter().find(|own| own.class == Class::Number);
        let other = || found.cells.iter().find(|own| own.class == Class::Number);
        let wanted = if found.parameters.len() == 1 { shares().or_else(numbers).or_else(other).or(text) } else { text };
        let none = || Failure::typed("--map: no cell has a value yet", "resume the run");
        return wanted.or_else(other).ok_or_else(none);
    };
    all().find(|own| own.name == *name).ok_or_else(|| {
        let known: Vec<&str> = all().map(|own| own.name.as_str()).collect();
        Failure::typed(format!("--of {name}: the map has no such quantity"), suggest(name, &known))
    })
}

fn reserved(array: &Array) -> bool {
    matches!(array.name.as_str(), "failure" | "remark")
}

fn number(value: &Option<CellValue>) -> f64 {
    match value {
        Some(CellValue::Number(own)) => *own,
        Some(CellValue::Count(own)) => *own as f64,
        Some(CellValue::Text(_)) | None => f64::NAN,
    }
}

/// Labels to draw: all of them, or the one that was asked for.
fn chosen(typed: &Typed, found: &Arrays) -> Result<Vec<usize>, Failure> {
    let Some(label) = &typed.item else { return Ok((0..found.labels.len()).collect()) };
    match found.labels.iter().position(|own| own == label) {
        Some(k) => Ok(vec![k]),
        None => {
            let known: Vec<&str> = found.labels.iter().map(String::as_str).collect();
            Err(Failure::typed(format!("--item {label}: the map has no such {}", found.item), suggest(label, &known)))
        }
    }
}

/// True if the quantity is known for each motion or special point.
fn of_items(found: &Arrays, array: &Array) -> bool {
    !found.labels.is_empty() && found.items.iter().any(|own| std::ptr::eq(own, array))
}

fn curves(typed: &Typed, found: &Arrays, array: &Array) -> Result<Vec<(String, Vec<f64>)>, Failure> {
    if array.class == Class::Text {
        let message = format!("--of {}: over one parameter a text cannot be drawn", array.name);
        return Err(Failure::typed(message, "choose a number, such as --of value, or print the table"));
    }
    if !of_items(found, array) {
        return Ok(vec![(array.name.clone(), array.values.iter().map(number).collect())]);
    }
    let width = found.labels.len();
    let own = |k: usize| array.values.iter().skip(k).step_by(width).map(number).collect();
    Ok(chosen(typed, found)?.into_iter().map(|k| (found.labels[k].clone(), own(k))).collect())
}

fn plane(typed: &Typed, found: &Arrays, array: &Array) -> Result<Shown, Failure> {
    if array.class == Class::Text {
        let text = |value: &Option<CellValue>| match value {
            Some(CellValue::Text(text)) => Some(text.clone()),
            _ => None,
        };
        return Ok(Shown::Texts(array.values.iter().map(text).collect()));
    }
    if !of_items(found, array) {
        return Ok(Shown::Numbers(array.values.iter().map(number).collect()));
    }
    match chosen(typed, found)?[..] {
        [k] => Ok(Shown::Numbers(array.values.iter().skip(k).step_by(found.labels.len()).map(number).collect())),
        _ => {
            let (item, first) = (found.item, &found.labels[0]);
            let message = format!("--of {}: over two parameters, one {item} can be drawn at a time", array.name);
            Err(Failure::typed(message, format!("choose one, such as --item \"{first}\"")))
        }
    }
}
