//! `foldline plot`: the bifurcation diagram of a run as a picture.

use crate::arguments::Plot as Typed;
use crate::failure::{Failure, Outcome};
use crate::progress::SignOfLife;
use crate::table::{Run, add_responses, asked_for, conversion, read};
use crate::tornado;
use crate::verbosity::report;
use foldline::contract::VectorField;
use foldline::diagram::{Branch, Diagram};
use foldline::explore::System;
use foldline::model::Model;
use foldline::sensitivity::Measured;
use foldline::sensitivity::listed::uncertainties;
use foldline_plot::quantity::{default_x, default_y, label};
use foldline_plot::responses::value;
use foldline_plot::{Picture, Quantity, deviation_layers, pdf, png, svg};
use foldline_store::order::is_run;
use foldline_store::run_file::Part;
use std::path::Path;

/// Pixels for each unit of the SVG.
const SCALE: f32 = 2.0;

/// Writes a picture of a run.
pub fn write(typed: &Typed) -> Result<Outcome, Failure> {
    if let Some(name) = &typed.map {
        return crate::plot_map::write(typed, name);
    }
    let mut run = read(&typed.folder, Part::Numbers)?;
    let profiled = |name: &Option<String>| {
        let found = name.as_ref().and_then(|name| foldline_plot::axis(name, &run.model).ok());
        found.is_some_and(|quantity| quantity.needs_profile())
    };
    let open = run.model.conditions() != [0, 0];
    let sensitive = typed.uncertainty || run.uncertainty || typed.tornado.is_some();
    if run.model.iterated() || open || profiled(&typed.x) || profiled(&typed.y) || sensitive {
        // Iterates, values at the ends of an interval and harmonics need the profiles; sensitivities need those of special
        // points.
        run = read(&typed.folder, Part::Everything)?;
    }
    if let Some(name) = &typed.tornado {
        return tornado::write(typed, &run, name);
    }
    let (mut outcome, states) = (Outcome::Done, run.model.states.len());
    let first = states + run.model.outputs.len();
    if typed.susceptibility {
        run = read(&typed.folder, Part::Everything)?;
        selected(&mut run.diagram, &typed.branch)?;
        outcome = add_responses(&mut run, &typed.force, typed.frequency.as_deref())?;
    }
    let deviations = match (typed.uncertainty || run.uncertainty) && !typed.curves {
        true => deviations(typed, &run)?,
        false => Vec::new(),
    };
    let Run { mut model, mut diagram, .. } = run;
    if let Some(conversion) = conversion(&model, &typed.unit)? {
        (diagram, model) = (conversion.diagram(diagram), conversion.model().clone());
    }
    let axis = |option: &str, name: &Option<String>| {
        let quantity = name.as_ref().map(|name| {
            let unknown = |choices| Failure::typed(format!("--{option}: there is no quantity \"{name}\""), choices);
            foldline_plot::axis(name, &model).map_err(unknown)
        });
        quantity.transpose()
    };
    let (x, y) = (axis("x", &typed.x)?, axis("y", &typed.y)?);
    selected(&mut diagram, &typed.branch)?;
    let (diagram, plane) = shown(diagram, typed.curves, [x, y])?;
    let picture = Picture {
        x: x.or(plane.map(|[first, _]| Quantity::Parameter(first))),
        y: y.or(plane.map(|[_, second]| Quantity::Parameter(second)))
            .or(typed.susceptibility.then_some(Quantity::Largest(first))),
        window: typed.window.as_deref().map(window).transpose()?,
        title: typed.title.clone(),
        ..Picture::default()
    };
    let axes = [picture.x.unwrap_or_else(|| default_x(&diagram)), picture.y.unwrap_or_else(|| default_y(&model))];
    let layers = deviation_layers(&diagram, axes[0], axes[1], &deviations);
    if layers.is_empty() && !deviations.is_empty() {
        report(format_args!("note: no error bars, because neither axis is the parameter of a branch"))?;
    }
    let picture = Picture { layers, ..picture };
    draw(&diagram, &model, &picture, &typed.output)?;
    undrawn(&diagram, &model, axes)?;
    Ok(outcome)
}

/// Standard deviations of the special points to first order, by branch and index.
fn deviations(typed: &Typed, run: &Run) -> Result<Vec<(String, usize, f64)>, Failure> {
    if run.spreads.is_empty() {
        let cure = "state one in the study or the model, such as `zeta = { value = 0.01, sigma = 0.002 }` in \
                    `[parameters]`, and run the study again";
        return Err(Failure::typed("--uncertainty: no parameter of the run is uncertain", cure));
    }
    if !typed.unit.is_empty() {
        let message = "--unit: uncertainty is drawn in the units of the model";
        return Err(Failure::typed(message, "leave out --unit, or --uncertainty"));
    }
    let working = SignOfLife::of("computing uncertainties");
    let system = System::of_plan(&run.model, &run.plan);
    let all = uncertainties(&system, &run.diagram, &run.plan, &run.spreads, 0, &|branch| branch.held.is_none());
    drop(working);
    let mut out = Vec::new();
    for point in all {
        let band = point.found.and_then(|found| {
            let own = found.bands.into_iter().find(|band| band.of == Measured::Parameter);
            own.map_or_else(|| Err("no band".to_string()), |band| band.first_order)
        });
        match band {
            Ok([_, sigma]) => out.push((point.branch, point.number, sigma)),
            Err(_) if point.expected => {}
            Err(why) => {
                report(format_args!("note: no error bar for the {} of {}: {why}", point.kind.title(), point.branch))?
            }
        }
    }
    Ok(out)
}

/// Reports the surveys and sweeps that have no value for the quantity on an axis.
fn undrawn(diagram: &Diagram, model: &Model, axes: [Quantity; 2]) -> std::io::Result<()> {
    for axis in axes {
        let sets = diagram.responses.iter().filter(|set| set.responses.iter().all(|r| value(axis, r).is_none()));
        let names: Vec<&str> = sets.map(|set| set.name.as_str()).collect();
        if !names.is_empty() {
            let (names, axis) = (names.join(", "), label(axis, model));
            report(format_args!("note: not drawn, because simulations have no \"{axis}\": {names}"))?;
        }
    }
    Ok(())
}

/// Keeps the branches of the given names. Without names, leaves out the runs for design questions that are not diagrams of
/// the branch in question: lines at fixed speeds and solutions with a bound.
fn selected(diagram: &mut Diagram, names: &[String]) -> Result<(), Failure> {
    if names.is_empty() {
        let designs = std::mem::take(&mut diagram.designs);
        let aside = |branch: &Branch| {
            let own = designs.iter().find(|design| is_run(&branch.name, &design.name));
            own.is_some_and(|design| branch.held.is_none() && (branch.free != design.free || !branch.also.is_empty()))
        };
        diagram.branches.retain(|branch| !aside(branch));
        diagram.designs = designs;
        return Ok(());
    }
    let kept: Vec<_> = names.iter().map(|name| asked_for(diagram, Some(name))).collect::<Result<_, Failure>>()?;
    diagram.branches.retain(|branch| kept.iter().any(|kept| kept(branch)));
    Ok(())
}

/// Selects the branches to draw, or the curves in two parameters with `--curves`; both if both axes are parameters.
/// With `--curves`, also returns the parameter plane of the curves.
fn shown(
    mut diagram: Diagram,
    curves: bool,
    axes: [Option<Quantity>; 2],
) -> Result<(Diagram, Option<[usize; 2]>), Failure> {
    if !curves {
        if !axes.iter().all(|axis| matches!(axis, Some(Quantity::Parameter(_)))) {
            diagram.branches.retain(|branch| branch.held.is_none());
        }
        return Ok((diagram, None));
    }
    let planes: Vec<[usize; 2]> = diagram.branches.iter().filter_map(Branch::plane).collect();
    let Some(first) = planes.first().copied() else {
        return Err(Failure::typed("--curves: the run has no two-parameter curves", "remove --curves"));
    };
    if axes.iter().any(Option::is_none) && planes.iter().any(|plane| *plane != first) {
        let cure = "choose the plane to draw with --x and --y";
        return Err(Failure::typed("--curves: the curves of the run lie in different parameter planes", cure));
    }
    diagram.branches.retain(|branch| branch.held.is_some());
    diagram.responses.clear();
    Ok((diagram, Some(first)))
}

/// Writes a picture of a diagram in the format given by the file extension.
pub fn draw(diagram: &Diagram, model: &Model, shown: &Picture, output: &Path) -> Result<(), Failure> {
    picture(&svg(diagram, model, shown), output)
}

/// Writes an SVG picture in the format given by the file extension.
pub fn picture(svg: &str, output: &Path) -> Result<(), Failure> {
    let render =
        |result: Result<Vec<u8>, foldline_plot::RenderError>| result.map_err(|e| Failure::Outside(e.to_string()));
    let ending = output.extension().and_then(|e| e.to_str()).unwrap_or("").to_lowercase();
    let bytes = match ending.as_str() {
        "svg" => svg.as_bytes().to_vec(),
        "png" => render(png(svg, SCALE))?,
        "pdf" => render(pdf(svg))?,
        _ => {
            let message = format!("{}: unknown picture format", output.display());
            return Err(Failure::typed(message, "give a file name that ends in .svg, .png or .pdf"));
        }
    };
    std::fs::write(output, bytes).map_err(|error| {
        Failure::typed(format!("cannot write {}: {error}", output.display()), "choose a file in a writable folder")
    })
}

fn window(text: &str) -> Result<[f64; 4], Failure> {
    let cure = "give four numbers such as --window 0.5,12,0,10: x from 0.5 to 12, y from 0 to 10";
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok([x0, x1, y0, y1]) if [x0, x1, y0, y1].iter().all(|v| v.is_finite()) => {
            if x0 >= x1 || y0 >= y1 {
                return Err(Failure::typed(format!("--window {text}: a range is empty or the wrong way round"), cure));
            }
            Ok([*x0, *x1, *y0, *y1])
        }
        _ => Err(Failure::typed(format!("--window {text}: not four numbers"), cure)),
    }
}
