//! Figures of a run: panels with branches, sections, multipliers, orbits, waterfalls and spectra.

use crate::failure::{Failure, Outcome};
use crate::plot::{chosen, shown};
use crate::progress::SignOfLife;
use crate::run::stop_on_interrupt;
use crate::table::Run;
use crate::verbosity::report;
use foldline::contract::VectorField;
use foldline::diagram::{Branch, Diagram, Motion, Response, Responses};
use foldline::explore::course::Way;
use foldline::explore::replay::{Plane, section, spectrum};
use foldline::model::Model;
use foldline::simulation::Outcome as Ending;
use foldline_plot::page::{figure_in, panel, section_panel, space_panel};
use foldline_plot::quantity::{default_x, default_y, label};
use foldline_plot::sections::Cloud;
use foldline_plot::space::View;
use foldline_plot::spectrogram::Spectrum;
use foldline_plot::theme::Theme;
use foldline_plot::waterfall::Waterfall;
use foldline_plot::{
    Axis, Figure, LegendPlace, Panel, Picture, Quantity, orbits, profile, spectra, spectrogram, waterfall,
};
use foldline_store::nearest::suggest;
use foldline_store::study_file::{FigurePlan, PanelPlan, Show};
use std::sync::atomic::Ordering;

/// Relative tolerance of trajectories.
const TOLERANCE: f64 = 1e-8;
/// Largest number of steps of one trajectory.
const STEPS: usize = 1_000_000;
/// Length of a trajectory for a spectrum in periods, so that two frequencies are 1/64 of the forcing frequency apart; and
/// samples per period.
const PERIODS: usize = 64;
const SAMPLES: usize = 64;
/// Highest frequency shown, as a multiple of the forcing frequency or of the median frequency of the cycles found.
const HIGHEST: f64 = 5.0;
/// Number of orbits, and of profiles in a waterfall, unless stated.
const ORBITS: usize = 9;
const PROFILES: usize = 30;

/// True if a figure needs profiles.
pub fn needs_profiles(figure: &FigurePlan, model: &Model) -> bool {
    let by_name = |name: &String| foldline_plot::axis(name, model).is_ok_and(|own| own.needs_profile());
    figure.panels.iter().any(|own| {
        matches!(own.show, Show::Orbits | Show::Waterfall | Show::Harmonics)
            || own.strobe.is_some()
            || own.section.is_some()
            || own.axes.iter().flatten().any(by_name)
    })
}

/// Returns a figure of a run as SVG. `plain` is true if quantities are shown in the units of the model.
pub fn drawn(figure: &FigurePlan, run: &Run, plain: bool) -> Result<(String, Outcome), Failure> {
    let mut outcome = Outcome::Done;
    let mut panels: Vec<Panel> = Vec::new();
    let mut firsts = Vec::new();
    for own in &figure.panels {
        firsts.push(panels.len());
        let page = Page { run, own, columns: figure.columns, plain };
        let (found, short) = page.panels()?;
        if short {
            outcome = Outcome::Short;
        }
        panels.extend(found);
    }
    let single = panels.len() == 1;
    let mut letters = 'a'..='z';
    for (k, own) in figure.panels.iter().enumerate() {
        let until = firsts.get(k + 1).copied().unwrap_or(panels.len());
        for panel in &mut panels[firsts[k]..until] {
            match &own.label {
                Some(label) => panel.label.clone_from(label),
                None if single || own.show == Show::Orbits => {}
                None => panel.label = format!("({})", letters.next().unwrap_or('z')),
            }
            if let Some(title) = &own.title {
                panel.title.clone_from(title);
            }
        }
    }
    outline(figure, &firsts, &mut panels);
    let title = if figure.title.is_some() { 31.0 } else { 0.0 };
    if let Some([_, height]) = figure.size.or(single.then_some([960.0, 600.0])) {
        let rows = rows(&panels, figure.columns);
        let scale = (height - 28.0 - title) / rows.max(1.0);
        panels.iter_mut().for_each(|panel| panel.height *= scale);
    }
    if single && let Some(only) = panels.first_mut().filter(|own| own.legend == LegendPlace::None) {
        only.legend = LegendPlace::Beside;
    }
    let theme = figure.theme.as_deref().and_then(Theme::named).unwrap_or_default();
    let width = figure.size.map_or(960.0, |[width, _]| width);
    let drawn = Figure { title: figure.title.clone(), panels, columns: figure.columns, width, legend: !single };
    Ok((figure_in(drawn, theme), outcome))
}

/// Height of all rows.
fn rows(panels: &[Panel], columns: usize) -> f64 {
    let (mut at, mut row, mut total) = (0, 0.0_f64, 0.0);
    for panel in panels {
        let span = panel.span.clamp(1, columns.max(1));
        if at + span > columns.max(1) {
            (total, at, row) = (total + row + 8.0, 0, 0.0);
        }
        row = row.max(panel.height);
        at += span;
    }
    total + row
}

/// Draws the window of each panel in the first earlier panel with the same axes that shows more.
fn outline(figure: &FigurePlan, firsts: &[usize], panels: &mut [Panel]) {
    let flat = |own: &PanelPlan| matches!(own.show, Show::Branches | Show::Curves) && own.axes[2].is_none();
    for (j, own) in figure.panels.iter().enumerate() {
        let Some(window) = own.window.filter(|_| flat(own)) else { continue };
        let [x0, x1, y0, y1] = window;
        let same = |i: &usize| {
            let (a, b) = (&panels[firsts[*i]], &panels[firsts[j]]);
            let more = figure.panels[*i].window.is_none_or(|[u0, u1, v0, v1]| {
                (u0 <= x0 && x1 <= u1 && v0 <= y0 && y1 <= v1) && (u1 - u0) * (v1 - v0) > (x1 - x0) * (y1 - y0)
            });
            flat(&figure.panels[*i]) && a.x.label == b.x.label && a.y.label == b.y.label && more
        };
        if let Some(i) = (0..j).find(same) {
            let label = panels[firsts[j]].label.clone();
            let target = &mut panels[firsts[i]];
            *target = target.clone().zooming(window, label);
        }
    }
}

/// A panel to be drawn.
struct Page<'p> {
    run: &'p Run,
    own: &'p PanelPlan,
    columns: usize,
    plain: bool,
}

impl Page<'_> {
    /// The panels, and true if something is missing from them.
    fn panels(&self) -> Result<(Vec<Panel>, bool), Failure> {
        let span = self.own.span;
        let (mut found, short) = match self.own.show {
            Show::Branches if self.own.strobe.is_some() || self.own.section.is_some() => self.sections()?,
            Show::Branches | Show::Curves => (vec![self.diagram()?], false),
            Show::Multipliers => (self.multipliers()?, false),
            Show::Orbits => return Ok((self.orbits()?, false)),
            Show::Waterfall => (vec![self.waterfall(Waterfall::Profiles)?], false),
            Show::Harmonics => (vec![self.waterfall(Waterfall::Harmonics)?], false),
            Show::Spectrogram => self.spectrogram()?,
        };
        found.iter_mut().for_each(|panel| panel.span = span);
        Ok((found, short))
    }

    fn model(&self) -> &Model {
        &self.run.model
    }

    fn axis(&self, k: usize) -> Result<Option<Quantity>, Failure> {
        let name = ["x", "y", "z"][k];
        self.own.axes[k].as_ref().map(|given| chosen(name, given, self.model())).transpose()
    }

    /// The state or output on the vertical axis: by default the first output, or the first state.
    fn channel(&self) -> Result<usize, Failure> {
        let model = self.model();
        let Some(name) = &self.own.axes[1] else {
            return Ok(if model.outputs.is_empty() { 0 } else { model.states.len() });
        };
        profile::channel(model, name).ok_or_else(|| {
            let message = format!("y = {name}: this picture shows a state or an output");
            Failure::typed(message, format!("one of: {}", self.channels().join(", ")))
        })
    }

    /// Names of states and outputs.
    fn channels(&self) -> Vec<&str> {
        let model = self.model();
        let states = model.states.iter().map(|own| own.name.as_str());
        states.chain(model.outputs.iter().map(|own| own.name.as_str())).collect()
    }

    /// Branches of the panel.
    fn selected(&self) -> Result<Diagram, Failure> {
        let mut diagram = self.run.diagram.clone();
        crate::plot::selected(&mut diagram, &self.own.branches)?;
        Ok(diagram)
    }

    /// The only branch of the panel.
    fn one_branch(&self, stored: bool) -> Result<(Diagram, usize), Failure> {
        let diagram = self.selected()?;
        let cycles = |own: &Branch| {
            own.held.is_none() && own.points.iter().any(|point| !stored || profile::cycle_of(point).is_some())
        };
        let index = diagram.branches.iter().position(cycles).ok_or_else(|| {
            let cure = "select a branch of cycles with --branch; profiles are in the run unless `store` in the study removes them";
            Failure::typed("there is no branch of cycles with stored profiles to show", cure)
        })?;
        Ok((diagram, index))
    }

    fn in_units_of_the_model(&self, what: &str) -> Result<(), Failure> {
        match self.plain {
            true => Ok(()),
            false => {
                Err(Failure::typed(format!("--unit: {what} are drawn in the units of the model"), "leave out --unit"))
            }
        }
    }

    fn picture(&self) -> Result<Picture, Failure> {
        let (x, y) = (self.axis(0)?, self.axis(1)?);
        Ok(Picture { x, y, window: self.own.window, log: self.own.log, ..Picture::default() })
    }

    fn view(&self) -> View {
        self.own.view.map_or(View::default(), |[azimuth, elevation]| View { azimuth, elevation })
    }

    fn diagram(&self) -> Result<Panel, Failure> {
        let mut picture = self.picture()?;
        let (diagram, plane) = shown(self.selected()?, self.own.show == Show::Curves, [picture.x, picture.y])?;
        picture.x = picture.x.or(plane.map(|[first, _]| Quantity::Parameter(first)));
        picture.y = picture.y.or(plane.map(|[_, second]| Quantity::Parameter(second)));
        let Some(z) = self.axis(2)? else { return Ok(panel(&diagram, self.model(), &picture)) };
        let mut diagram = diagram;
        if plane.is_none() {
            // Curves in two parameters lie in the same space if two of the axes are parameters.
            diagram = self.selected()?;
            let axes = [
                picture.x.unwrap_or_else(|| default_x(&diagram)),
                picture.y.unwrap_or_else(|| default_y(self.model())),
                z,
            ];
            let shows = |k: usize| axes.contains(&Quantity::Parameter(k));
            diagram.branches.retain(|own| match own.held {
                Some((_, follows)) => shows(own.free) && shows(follows),
                None => shows(own.free),
            });
        }
        Ok(Panel { height: 520.0, ..space_panel(&diagram, self.model(), &picture, z, self.view()) })
    }

    fn multipliers(&self) -> Result<Vec<Panel>, Failure> {
        let diagram = self.selected()?;
        let x = self.axis(0)?.unwrap_or_else(|| default_x(&diagram));
        let (panels, outside) = spectra::panels(&diagram, self.model(), x, self.own.log[1]);
        if panels[0].layers.iter().all(|layer| layer.name.is_none()) {
            return Err(Failure::typed(
                "there is no branch with multipliers or eigenvalues to show",
                "select others with --branch",
            ));
        }
        if outside > 0 {
            report(format_args!("note: {outside} values lie outside the plane of the multipliers"))?;
        }
        Ok(panels.into())
    }

    fn orbits(&self) -> Result<Vec<Panel>, Failure> {
        self.in_units_of_the_model("orbits")?;
        let (diagram, index) = self.one_branch(true)?;
        let branch = &diagram.branches[index];
        let model = self.model();
        // The axes of the panels with orbits; the diagram above has the default ones.
        let plane = match [&self.own.axes[0], &self.own.axes[1]] {
            [Some(a), Some(b)] => [a, b].map(|name| profile::channel(model, name)),
            _ => model.whirl.unwrap_or([0, 1.min(model.states.len() + model.outputs.len() - 1)]).map(Some),
        };
        let [Some(a), Some(b)] = plane else {
            return Err(Failure::typed(
                "orbits have a state or an output on each axis",
                "name two of them with --x and --y",
            ));
        };
        let axes = [Quantity::Parameter(branch.free), default_y(model)];
        let count = self.own.count.unwrap_or(ORBITS);
        if count > orbits::MOST {
            report(format_args!("note: {} orbits are drawn, the largest number", orbits::MOST))?;
        }
        Ok(orbits::panels(branch, model, axes, [a, b], count, self.columns))
    }

    fn waterfall(&self, what: Waterfall) -> Result<Panel, Failure> {
        self.in_units_of_the_model("profiles")?;
        let (diagram, index) = self.one_branch(true)?;
        let branch = &diagram.branches[index];
        let x = self.axis(0)?.unwrap_or(Quantity::Parameter(branch.free));
        let count = self.own.count.unwrap_or(PROFILES);
        let found = waterfall::panel(branch, self.model(), what, x, self.channel()?, count, self.view());
        let mut panel = found.ok_or_else(|| {
            Failure::typed(
                format!("{} has fewer than two stored cycles", branch.name),
                "select another branch with --branch",
            )
        })?;
        panel.title.clone_from(&branch.name);
        Ok(panel)
    }

    /// Surveys and sweeps over the parameter on the horizontal axis, of the given names if there are any.
    fn simulated(&self, x: Quantity) -> Vec<&Responses> {
        let named = |set: &&Responses| self.own.branches.is_empty() || self.own.branches.contains(&set.name);
        let over = |set: &&Responses| Quantity::Parameter(set.free) == x;
        self.run.diagram.responses.iter().filter(named).filter(over).collect()
    }

    fn sections(&self) -> Result<(Vec<Panel>, bool), Failure> {
        self.in_units_of_the_model("sections")?;
        let model = self.model();
        if model.iterated() {
            return Err(Failure::typed(
                "a map has no sections: its iterates are drawn",
                "leave out --strobe and --section",
            ));
        }
        let channel = self.channel()?;
        let plane = match &self.own.section {
            Some((name, level)) => {
                let index = profile::channel(model, name).ok_or_else(|| {
                    let message = format!("--section: the model has no state or output `{name}`");
                    Failure::typed(message, suggest(name, &self.channels()))
                })?;
                Plane::Level(index, *level)
            }
            None if model.forced() => Plane::Stroboscopic,
            None => {
                let cure = format!("give a level that the motions pass, such as --section {}=0", model.states[0].name);
                return Err(Failure::typed("--strobe: the model is not forced, so there is no forcing period", cure));
            }
        };
        let mut picture = self.picture()?;
        // The vertical axis shows the state itself.
        picture.y = None;
        let mut diagram = self.run.diagram.clone();
        let sets: Vec<String> = diagram.responses.iter().map(|set| set.name.clone()).collect();
        let names: Vec<String> = self.own.branches.iter().filter(|name| !sets.contains(name)).cloned().collect();
        if self.own.branches.is_empty() || !names.is_empty() {
            crate::plot::selected(&mut diagram, &names)?;
        } else {
            diagram.branches.clear();
        }
        let x = picture.x.unwrap_or_else(|| default_x(&self.run.diagram));
        picture.x = Some(x);
        diagram.branches.retain(|own| own.held.is_none() && Quantity::Parameter(own.free) == x);
        let mut clouds = Vec::new();
        let mut short = false;
        let count = self.own.strobe.unwrap_or(PERIODS);
        for set in self.simulated(x) {
            let (points, early) = self.cloud(set, plane, channel, count);
            if early > 0 {
                short = true;
                report(format_args!(
                    "incomplete: {early} motions of {} could not be followed through {count} points",
                    set.name
                ))?;
            }
            clouds.push(Cloud { name: set.name.clone(), points });
        }
        let mut panel = section_panel(&diagram, model, &picture, channel, plane, &clouds);
        panel.height = 420.0;
        if panel.layers.is_empty() {
            let cure =
                "the study needs a survey or sweep over the parameter on the horizontal axis, or a branch of cycles";
            return Err(Failure::typed("there are no points in this section", cure));
        }
        Ok((vec![panel], short))
    }

    /// Points of a survey or sweep in a plane, and the number of motions that ended early.
    fn cloud(&self, set: &Responses, plane: Plane, channel: usize, count: usize) -> (Vec<[f64; 2]>, usize) {
        let (model, stop) = (self.model(), stop_on_interrupt());
        let way = Way { tolerance: TOLERANCE, steps: STEPS, stop: &|| stop.load(Ordering::Relaxed) };
        let working = SignOfLife::of("integrating the motions again");
        let (mut points, mut early) = (Vec::new(), 0);
        for own in &set.responses {
            // What rests or has escaped passes no level.
            let still = own.motion == Motion::Equilibrium && plane != Plane::Stroboscopic;
            if own.motion.is_lost() || still {
                continue;
            }
            let found = section(model, &own.state, &own.parameters, plane, count, &way);
            early += usize::from(found.outcome != Ending::Reached);
            let n = model.states.len();
            let values: Vec<f64> = match channel.checked_sub(n) {
                None => found.states.iter().skip(channel).step_by(n).copied().collect(),
                Some(k) => found.outputs.iter().skip(k).step_by(model.outputs.len()).copied().collect(),
            };
            points.extend(values.into_iter().map(|value| [own.value, value]));
        }
        drop(working);
        (points, early)
    }

    fn spectrogram(&self) -> Result<(Vec<Panel>, bool), Failure> {
        self.in_units_of_the_model("spectra")?;
        let model = self.model();
        let channel = self.channel()?;
        let x = match self.axis(0)? {
            Some(x) => x,
            None => {
                self.run.diagram.responses.first().map_or(Quantity::Parameter(0), |set| Quantity::Parameter(set.free))
            }
        };
        let none = || {
            let cure =
                "the study needs a `[[sweep]]` or `[[survey]]` with several values; --branch selects one of them";
            Failure::typed("there is no survey or sweep whose spectra could be shown", cure)
        };
        let set = *self.simulated(x).first().ok_or_else(none)?;
        let settled = |own: &&Response| !own.motion.is_lost();
        let mut periods: Vec<f64> = set.responses.iter().filter(settled).filter_map(|own| own.period).collect();
        periods.sort_by(f64::total_cmp);
        let median = periods.get(periods.len() / 2).copied();
        let Some(unit) = (if model.forced() { Some(1.0) } else { median }) else {
            let cure = "without a forcing period, the length of the spectra follows from the periods of cycles";
            return Err(Failure::typed(format!("{}: no motion has a period", set.name), cure));
        };
        let stop = stop_on_interrupt();
        let way = Way { tolerance: TOLERANCE, steps: STEPS, stop: &|| stop.load(Ordering::Relaxed) };
        let working = SignOfLife::of("integrating the motions again");
        let (mut found, mut early) = (Vec::new(), 0);
        for own in set.responses.iter().filter(settled) {
            let period = if model.forced() { model.time_unit(&own.parameters) } else { unit };
            let time = PERIODS as f64 * period;
            match spectrum(model, &own.state, &own.parameters, channel, time, PERIODS * SAMPLES, &way) {
                // Multiples of the forcing frequency, or a frequency.
                Some(amplitudes) => {
                    let step = if model.forced() { 1.0 / PERIODS as f64 } else { 1.0 / time };
                    found.push(Spectrum { at: own.value, step, amplitudes });
                }
                None => early += 1,
            }
        }
        drop(working);
        if early > 0 {
            report(format_args!("incomplete: {early} motions of {} could not be followed", set.name))?;
        }
        let frequency = match (model.forced(), model.time.as_str()) {
            (true, _) => "frequency / forcing frequency".to_string(),
            (false, "" | "1" | "-") => "frequency".to_string(),
            (false, unit) => format!("frequency [1/{unit}]"),
        };
        let title = format!("{} in {}", profile::channel_label(model, channel), set.name);
        let highest = if model.forced() { HIGHEST } else { HIGHEST / unit };
        let panel = spectrogram::panel(found, Axis::new(label(x, model)), Axis::new(frequency), highest, &title);
        Ok((vec![panel.ok_or_else(none)?], early > 0))
    }
}
