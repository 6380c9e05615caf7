//! Values of quantities at a point, by name.

use foldline::diagram::{Point, SpecialPoint};
use foldline::model::Model;

/// Returns the value of `name` at a point: a parameter, `period`, `NAME_max`, `NAME_min`, `NAME_mean` or `NAME_rms` of
/// a state or output (a bare name is its largest value), `multiplier_K` (K-th largest modulus of the free spectrum),
/// `omega` (imaginary part of the pair nearest to the imaginary axis), or `unstable`.
pub fn quantity(model: &Model, point: &Point, name: &str) -> Option<f64> {
    if let Some(k) = model.parameters.iter().position(|p| p.name == name) {
        return point.parameters.get(k).copied();
    }
    match name {
        "period" => return point.solution.period(),
        "unstable" => return Some(point.unstable as f64),
        "omega" => return frequency(point),
        _ => {}
    }
    if let Some(number) = name.strip_prefix("multiplier_") {
        let mut moduli: Vec<f64> = point.free_spectrum().iter().map(|z| z.norm()).collect();
        moduli.sort_by(|a, b| b.total_cmp(a));
        return moduli.get(number.parse::<usize>().ok()?.checked_sub(1)?).copied();
    }
    let (bare, what) = match name.rsplit_once('_') {
        Some((bare, what @ ("max" | "min" | "mean" | "rms"))) => (bare, what),
        _ => (name, "max"),
    };
    let names = model.states.iter().map(|s| &s.name).chain(model.outputs.iter().map(|o| &o.name));
    // An output with the name of a state takes precedence, as in tables.
    let index = names.enumerate().filter(|(_, known)| *known == bare).map(|(k, _)| k).last()?;
    let range = point.ranges.get(index);
    let average = point.averages.get(index);
    match what {
        "max" => range.map(|r| r[1]),
        "min" => range.map(|r| r[0]),
        "mean" => average.map(|a| a[0]),
        _ => average.map(|a| a[1].sqrt()),
    }
}

/// Returns the value of `name` at a special point: a [`quantity`], or `nf.NAME` for a coefficient of the normal form.
pub fn special_quantity(model: &Model, special: &SpecialPoint, name: &str) -> Option<f64> {
    match name.strip_prefix("nf.") {
        Some(coefficient) => {
            let k = special.kind.coefficients().iter().position(|known| *known == coefficient)?;
            special.coefficients.get(k).copied()
        }
        None => quantity(model, &special.point, name),
    }
}

fn frequency(point: &Point) -> Option<f64> {
    let pairs = point.spectrum.iter().filter(|z| z.im > 0.0);
    pairs.min_by(|a, b| (a.re.abs() / a.norm()).total_cmp(&(b.re.abs() / b.norm()))).map(|z| z.im)
}
