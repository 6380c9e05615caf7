//! `foldline plot --tornado`: how much each parameter changes a number at a special point.

use crate::arguments::Plot as Typed;
use crate::failure::{Failure, Outcome};
use crate::plot::picture;
use crate::table::{Run, found};
use foldline::diagram::Shown;
use foldline::model::{Model, Spread};
use foldline::sensitivity::Sensitivities;
use foldline::sensitivity::listed::Listed;
use foldline_plot::{Bar, tornado};
use foldline_store::nearest::suggest;

/// Change of a parameter without an uncertainty: one per cent of its value.
const SHARE: f64 = 0.01;

/// Writes the chart.
pub fn write(typed: &Typed, run: &Run, name: &str) -> Result<Outcome, Failure> {
    if !typed.unit.is_empty() {
        return Err(Failure::typed("--unit: a tornado chart is in the units of the model", "leave out --unit"));
    }
    let (branch, number, kind) = place(typed.at.as_deref(), run)?;
    let all = found(run, &|own| branch.as_ref().is_none_or(|name| own.name == *name));
    let fits = |own: &&Listed<Sensitivities>| {
        number.is_none_or(|number| own.number + 1 == number) && kind.as_ref().is_none_or(|kind| own.kind.name() == kind)
    };
    let fitting: Vec<&Listed<Sensitivities>> = all.iter().filter(fits).collect();
    let point = fitting.iter().find(|own| own.found.is_ok()).or(fitting.first());
    let Some(point) = point else {
        return Err(Failure::typed("--tornado: the run has no such special point", points(&all)));
    };
    let sensitivities = match &point.found {
        Ok(found) => found,
        Err(why) => {
            let message =
                format!("--tornado: the {} of {} has no sensitivities: {why}", point.kind.title(), point.branch);
            return Err(Failure::typed(message, "choose another special point with --at"));
        }
    };
    let row = sensitivities.rows.iter().find(|row| row.of.name(&run.model, point.free) == *name);
    let Some(row) = row else {
        let known: Vec<String> = sensitivities.rows.iter().map(|row| row.of.name(&run.model, point.free)).collect();
        let known: Vec<&str> = known.iter().map(String::as_str).collect();
        return Err(Failure::typed(format!("--tornado: there is no number \"{name}\" there"), suggest(name, &known)));
    };
    let (mut bars, mut without) = (Vec::new(), Vec::new());
    for (index, found) in sensitivities.parameters.iter().zip(&row.by) {
        let own = &run.model.parameters[*index];
        match found {
            Ok(derivative) => {
                let (change, how) = change(run, *index, point.parameters[*index]);
                let moved = change.map(|by| by * derivative.value);
                let error = derivative.error * change[1].abs().max(change[0].abs());
                bars.push(Bar { name: format!("{} {how}", own.name), change: moved, error });
            }
            Err(_) => without.push(own.name.as_str()),
        }
    }
    if bars.is_empty() {
        let message = format!("--tornado: {name} has no derivatives there");
        return Err(Failure::typed(message, "`foldline table --sensitivities` gives the reasons"));
    }
    let title = format!(
        "{} of {} at {} = {:.6}",
        capital(point.kind.title()),
        point.branch,
        run.model.parameters[point.free].name,
        Shown(point.at)
    );
    let unit = row.of.unit(&run.model, point.free);
    let unit = if matches!(unit.as_str(), "" | "1" | "-") { String::new() } else { format!(" [{unit}]") };
    let axis = format!("change of {name}{unit}");
    let note = match without.is_empty() {
        true => String::new(),
        false => format!("no derivative with respect to {}", without.join(", ")),
    };
    picture(&tornado(&title, &axis, &bars, &note), &typed.output)?;
    Ok(Outcome::Done)
}

/// Branch, number and kind of `--at`.
type Place = (Option<String>, Option<usize>, Option<String>);

fn place(text: Option<&str>, run: &Run) -> Result<Place, Failure> {
    let Some(text) = text else { return Ok((None, None, None)) };
    if foldline::diagram::Kind::from_name(text).is_some() {
        return Ok((None, None, Some(text.into())));
    }
    let cure = "write BRANCH:NUMBER with the number of the special point on its branch, such as upper:1, or a kind such as \
                fold";
    let parts = text.rsplit_once(':').and_then(|(branch, number)| Some((branch, number.trim().parse::<usize>().ok()?)));
    let Some((branch, number)) = parts else {
        return Err(Failure::typed(format!("--at {text}: no such special point"), cure));
    };
    let names: Vec<&str> = run.diagram.branches.iter().map(|own| own.name.as_str()).collect();
    if !names.contains(&branch) {
        return Err(Failure::typed(format!("--at: the run has no branch \"{branch}\""), suggest(branch, &names)));
    }
    Ok((Some(branch.into()), Some(number), None))
}

/// Changes of a parameter downwards and upwards, and words for them.
fn change(run: &Run, index: usize, value: f64) -> ([f64; 2], String) {
    let spread = run.spreads.iter().find(|(own, _)| *own == index).map(|(_, spread)| *spread);
    let unit = unit(&run.model, index);
    match spread {
        Some(Spread::Normal(sigma)) => ([-sigma, sigma], format!("± {:.4}{unit}", Shown(sigma))),
        Some(Spread::Uniform([low, high])) => {
            ([low - value, high - value], format!("{:.4} … {:.4}{unit}", Shown(low), Shown(high)))
        }
        None if value != 0.0 => ([-SHARE * value.abs(), SHARE * value.abs()], "± 1 %".into()),
        None => {
            let scale = run.model.parameters[index].scale.unwrap_or(1.0);
            ([-SHARE * scale, SHARE * scale], format!("± {:.4}{unit}", Shown(SHARE * scale)))
        }
    }
}

fn unit(model: &Model, index: usize) -> String {
    let unit = &model.parameters[index].unit;
    if matches!(unit.as_str(), "" | "1" | "-") { String::new() } else { format!(" {unit}") }
}

/// The special points to choose from.
fn points(all: &[Listed<Sensitivities>]) -> String {
    let names: Vec<String> =
        all.iter().map(|own| format!("{}:{} ({})", own.branch, own.number + 1, own.kind)).collect();
    if names.is_empty() {
        "the run has no special points".into()
    } else {
        format!("choose one of {}", names.join(", "))
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
