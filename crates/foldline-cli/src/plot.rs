//! `foldline plot`: the bifurcation diagram of a run as a picture.

use crate::arguments::Plot as Typed;
use crate::failure::{Failure, Outcome};
use crate::figures::{drawn, needs_profiles};
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
use foldline_plot::theme::Theme;
use foldline_plot::{Picture, Quantity, deviation_layers, pdf, png, svg};
use foldline_store::nearest::suggest;
use foldline_store::order::is_run;
use foldline_store::run_file::{Part, Reading};
use foldline_store::study_file::{FigurePlan, PanelPlan, Show, parse_study_of_run, read_study};
use std::path::Path;

/// Pixels for each unit of the SVG.
const SCALE: f32 = 2.0;

/// Writes a picture of a run.
pub fn write(typed: &Typed) -> Result<Outcome, Failure> {
    if let Some(name) = &typed.map {
        return crate::plot_map::write(typed, name);
    }
    if let Some(figure) = asked(typed)? {
        return in_panels(typed, &figure);
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
    let axis = |option: &str, name: &Option<String>| name.as_ref().map(|name| chosen(option, name, &model)).transpose();
    let (x, y) = (axis("x", &typed.x)?, axis("y", &typed.y)?);
    selected(&mut diagram, &typed.branch)?;
    let (diagram, plane) = shown(diagram, typed.curves, [x, y])?;
    let picture = Picture {
        x: x.or(plane.map(|[first, _]| Quantity::Parameter(first))),
        y: y.or(plane.map(|[_, second]| Quantity::Parameter(second)))
            .or(typed.susceptibility.then_some(Quantity::Largest(first))),
        window: typed.window.as_deref().map(|text| window("window", text)).transpose()?,
        title: typed.title.clone(),
        log: log(typed),
        size: size(typed)?.unwrap_or(Picture::default().size),
        theme: Theme::named(&typed.theme).unwrap_or_default(),
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

/// The quantity of that name on an axis.
pub fn chosen(option: &str, name: &str, model: &Model) -> Result<Quantity, Failure> {
    let unknown = |choices| Failure::typed(format!("--{option}: there is no quantity \"{name}\""), choices);
    foldline_plot::axis(name, model).map_err(unknown)
}

/// The figure that the options describe; `None` for a diagram in one panel.
fn asked(typed: &Typed) -> Result<Option<FigurePlan>, Failure> {
    if let Some(name) = &typed.figure {
        return described(typed, name).map(Some);
    }
    let plain = typed.show.is_none() && typed.z.is_none() && typed.strobe.is_none() && typed.section.is_none();
    if plain && typed.zoom.is_empty() {
        return Ok(None);
    }
    let named = |name: &str| Show::ALL.into_iter().find(|(own, _)| *own == name).map(|(_, show)| show);
    let show = typed.show.as_deref().and_then(named).unwrap_or_default();
    let first = PanelPlan {
        show: if typed.curves { Show::Curves } else { show },
        axes: [typed.x.clone(), typed.y.clone(), typed.z.clone()],
        branches: typed.branch.clone(),
        window: typed.window.as_deref().map(|text| window("window", text)).transpose()?,
        log: log(typed),
        strobe: typed.strobe.map(|count| count as usize),
        section: typed.section.as_deref().map(level).transpose()?,
        count: typed.count.map(|count| count as usize),
        span: if typed.zoom.len() > 1 { 2 } else { 1 },
        view: typed.view.as_deref().map(view).transpose()?,
        ..PanelPlan::default()
    };
    let zoomed = |text: &String| Ok(PanelPlan { window: Some(window("zoom", text)?), span: 1, ..first.clone() });
    let zooms: Vec<PanelPlan> = typed.zoom.iter().map(zoomed).collect::<Result<_, Failure>>()?;
    let columns = match show {
        Show::Orbits => 3,
        Show::Multipliers => 2,
        _ if zooms.is_empty() => 1,
        _ => 2,
    };
    Ok(Some(FigurePlan {
        name: String::new(),
        title: typed.title.clone(),
        columns,
        size: size(typed)?,
        theme: Some(typed.theme.clone()),
        panels: [vec![first], zooms].concat(),
    }))
}

/// A figure of the study.
fn described(typed: &Typed, name: &str) -> Result<FigurePlan, Failure> {
    let figures = match &typed.study {
        Some(file) => read_study(file)?.figures,
        None => {
            let stored = Reading::open(&typed.folder)?.recorded(Part::Special)?;
            parse_study_of_run(&stored.study_text, &stored.study_file, &stored.model_text, &stored.model_file)?.figures
        }
    };
    let names: Vec<&str> = figures.iter().map(|own| own.name.as_str()).collect();
    let cure = match (names.is_empty(), &typed.study) {
        (true, None) => "the study had none when it was run; `--study FILE` names one that has".to_string(),
        (true, Some(_)) => "add `[[figure]]` to it".to_string(),
        _ => suggest(name, &names),
    };
    let unknown = || Failure::typed(format!("--figure {name}: the study has no such figure"), cure);
    let found = figures.iter().find(|own| own.name == name).cloned();
    found.map(|own| FigurePlan { theme: own.theme.or(Some(typed.theme.clone())), ..own }).ok_or_else(unknown)
}

/// Draws a figure with panels.
fn in_panels(typed: &Typed, figure: &FigurePlan) -> Result<Outcome, Failure> {
    let mut run = read(&typed.folder, Part::Numbers)?;
    let open = run.model.conditions() != [0, 0];
    if run.model.iterated() || open || needs_profiles(figure, &run.model) {
        run = read(&typed.folder, Part::Everything)?;
    }
    if let Some(conversion) = conversion(&run.model, &typed.unit)? {
        let diagram = std::mem::take(&mut run.diagram);
        (run.diagram, run.model) = (conversion.diagram(diagram), conversion.model().clone());
    }
    let (svg, outcome) = drawn(figure, &run, typed.unit.is_empty())?;
    picture(&svg, &typed.output)?;
    Ok(outcome)
}

fn log(typed: &Typed) -> [bool; 2] {
    ["x", "y"].map(|axis| typed.log.as_ref().is_some_and(|axes| axes.contains(axis)))
}

/// Width and height, if they are given.
fn size(typed: &Typed) -> Result<Option<[f64; 2]>, Failure> {
    let Some(text) = &typed.size else { return Ok(None) };
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|v| (200.0..=10_000.0).contains(v));
    let found = text.split_once('x').and_then(|(w, h)| Some([number(w)?, number(h)?]));
    let cure = "give two numbers from 200 to 10000, such as --size 960x600";
    found.map(Some).ok_or_else(|| Failure::typed(format!("--size {text}: not a width and a height"), cure))
}

/// State or output, and level.
fn level(text: &str) -> Result<(String, f64), Failure> {
    let found =
        text.split_once('=').and_then(|(name, level)| Some((name.trim().to_string(), level.trim().parse().ok()?)));
    let cure = "give a state or output and a number, such as --section x=0";
    found
        .filter(|(_, level): &(String, f64)| level.is_finite())
        .ok_or_else(|| Failure::typed(format!("--section {text}: not a level"), cure))
}

/// Angles of a view.
fn view(text: &str) -> Result<[f64; 2], Failure> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|v| v.is_finite());
    let found =
        text.split_once(',').and_then(|(a, e)| Some([number(a)?, number(e).filter(|e| (0.0..=90.0).contains(e))?]));
    let cure = "give two angles in degrees, the second from 0 to 90, such as --view -60,25";
    found.ok_or_else(|| Failure::typed(format!("--view {text}: not a direction"), cure))
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
pub fn selected(diagram: &mut Diagram, names: &[String]) -> Result<(), Failure> {
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
pub fn shown(
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

fn window(option: &str, text: &str) -> Result<[f64; 4], Failure> {
    let cure = format!("give four numbers such as --{option} 0.5,12,0,10: x from 0.5 to 12, y from 0 to 10");
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok([x0, x1, y0, y1]) if [x0, x1, y0, y1].iter().all(|v| v.is_finite()) => {
            if x0 >= x1 || y0 >= y1 {
                return Err(Failure::typed(
                    format!("--{option} {text}: a range is empty or the wrong way round"),
                    cure,
                ));
            }
            Ok([*x0, *x1, *y0, *y1])
        }
        _ => Err(Failure::typed(format!("--{option} {text}: not four numbers"), cure)),
    }
}
