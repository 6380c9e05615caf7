//! Panels: Campbell diagrams, forced branches with their backbones, distances, and the damping limit.

use super::claims::{distances, order};
use super::{Family, Level};
use crate::akay2022::rotor::{FAMILIES, MAX_R, OMEGA, SPEED, colour};
use foldline_plot::palette::{AMBER, AZURE, BLACK, BLUE, GREY, PALE, PURPLE, VERMILION};
use foldline_plot::{Axis, Layer, LegendPlace, Marker, Panel, branch_curve};
use foldline_rotor::{Ratio, undamped_modes};

/// Colours by decreasing unbalance.
const LEVELS: [&str; 4] = [AMBER, AZURE, BLUE, BLACK];

/// Returns every panel, in a grid of six columns.
pub fn all(families: &[Family]) -> Result<Vec<Panel>, String> {
    let reference = &families[0].constants;
    let mut panels = vec![rotating(reference.polar, reference.beta), inertial(reference.polar, reference.beta)];
    let windows = [[3.2, 4.8, 0.05, 5.0], [2.0, 7.0, 0.3, 10.0], [3.0, 11.5, 0.8, 40.0], [2.0, 7.5, 0.8, 20.0]];
    for ((family, window), label) in families.iter().zip(windows).zip(["(c)", "(d)", "(e)", "(f)"]) {
        panels.push(branches(family, label, window));
    }
    panels.iter_mut().for_each(|panel| panel.span = 3);
    for (law, label) in [("cubic", "(g)"), ("contact", "(h)")] {
        panels.push(Panel { span: 2, ..nearness(families, law, label)? });
    }
    panels.push(Panel { span: 2, ..damping(families) });
    Ok(panels)
}

const SPEEDS: [f64; 2] = [0.0, 12.0];

/// A quantity of both modes over many speeds.
fn over_speeds(polar: f64, stiffness: f64, of: impl Fn([f64; 2], [f64; 2]) -> f64) -> Vec<[f64; 2]> {
    const STEPS: usize = 240;
    let speed = |k: usize| SPEEDS[0] + (SPEEDS[1] - SPEEDS[0]) * k as f64 / STEPS as f64;
    let at = |omega: f64| undamped_modes(omega, polar, stiffness);
    (0..=STEPS).map(|k| [speed(k), of(at(speed(k)).rotating, at(speed(k)).inertial)]).collect()
}

/// Stiffness, its description, and its colour.
fn springs(beta: f64) -> [(f64, &'static str, &'static str); 2] {
    [(1.0, "ring never touched", BLACK), (1.0 + beta, "ring always touched", PURPLE)]
}

fn rotating(polar: f64, beta: f64) -> Panel {
    let mut panel = Panel::new(
        "(a)",
        "rotating frame",
        Axis::new("Ω").from(SPEEDS[0], SPEEDS[1]),
        Axis::new("frequency of backward whirl").from(0.0, 18.0),
    );
    for (stiffness, name, colour) in springs(beta) {
        for ratio in [Ratio::SINGLE_LOOP, Ratio::DOUBLE_LOOP] {
            let n = f64::from(ratio.backward);
            let multiple = over_speeds(polar, stiffness, |[forward, _], _| -n * forward);
            panel = panel.with(Layer::curve(&multiple, colour).wide(0.9).dashed());
        }
        let slow = over_speeds(polar, stiffness, |[forward, _], _| -forward);
        let fast = over_speeds(polar, stiffness, |[_, backward], _| -backward);
        panel = panel.with(Layer::curve(&slow, colour).named(name)).with(Layer::curve(&fast, colour));
    }
    for (ratio, (family, colour)) in [(Ratio::SINGLE_LOOP, FAMILIES[1]), (Ratio::DOUBLE_LOOP, FAMILIES[2])] {
        let n = ratio.backward;
        let speeds: Vec<f64> = springs(beta).iter().filter_map(|(s, ..)| ratio.speed(polar, *s)).collect();
        let height = |(w, (s, ..)): (&f64, &(f64, _, _))| [*w, -undamped_modes(*w, polar, *s).rotating[1]];
        let crossings: Vec<[f64; 2]> = speeds.iter().zip(&springs(beta)).map(height).collect();
        let text: Vec<String> = speeds.iter().map(|w| format!("{w:.6}")).collect();
        let name = format!("{n}:1 ({family}) at Ω = {}", text.join(", "));
        panel = panel.with_all(crossings.iter().map(|at| Layer::note(*at, format!("{n}:1"))));
        panel = panel.with(Layer::scatter(crossings, Marker::Circle, colour).wide(5.0).named(name));
    }
    panel.with(Layer::curve(&[], GREY).wide(0.9).dashed().named("2 and 3 times the slower"))
}

fn inertial(polar: f64, beta: f64) -> Panel {
    let mut panel = Panel::new(
        "(b)",
        "inertial frame",
        Axis::new("Ω").from(SPEEDS[0], SPEEDS[1]),
        Axis::new("frequency, forward whirl positive").from(-5.0, 5.0),
    )
    .with(Layer::horizontal(0.0));
    for (stiffness, name, colour) in springs(beta) {
        for k in 0..2 {
            let frequency = over_speeds(polar, stiffness, |_, inertial| inertial[k]);
            panel = panel.with(Layer::curve(&frequency, colour).named(name).wide(1.2));
        }
    }
    panel
}

fn branches(family: &Family, label: &str, [x0, x1, y0, y1]: [f64; 4]) -> Panel {
    let axes = (Axis::new("Ω").from(x0, x1), Axis::new("max r").from(y0, y1).log());
    let mut panel = Panel { height: 360.0, ..Panel::new(label, family.title(), axes.0, axes.1) };
    if family.has_contact() {
        if let Some([low, high]) = family.ratio.contact_interval(family.constants.polar, family.constants.beta) {
            panel = panel.with(Layer::band(low, high, PALE)).with(Layer::vertical(high));
        }
        panel = panel.with(Layer::horizontal(1.0));
    }
    let points: Vec<[f64; 2]> = family.backbone.points.iter().map(|p| [p.speed, p.r_max]).collect();
    let first = points.first().map(|[speed, _]| [*speed, 1e-9]);
    let points: Vec<[f64; 2]> = first.into_iter().chain(points).collect();
    panel = panel.with(Layer::vertical(family.backbone.root));
    panel = panel.with(Layer::curve(&points, VERMILION).wide(6.0).faint(0.35).named("backbone"));
    for (level, colour) in family.levels.iter().zip(LEVELS) {
        panel = panel.with(branch_curve(level.branch, SPEED, MAX_R, colour).wide(1.3).named(named(level)));
    }
    panel
}

/// Legend entry such as `ε = 0.1765, ζ = 0.0025`.
fn named(level: &Level) -> String {
    let short = |x: f64| {
        let decimals = (3 - x.log10().floor() as i32).clamp(0, 9) as usize;
        format!("{x:.decimals$}").trim_end_matches('0').to_string()
    };
    format!("ε = {}, ζ = {}", short(level.epsilon), short(level.zeta))
}

/// Panel of the distances from the backbone over ε.
fn nearness(families: &[Family], law: &str, label: &str) -> Result<Panel, String> {
    let axes = (Axis::new("ε").from(0.03, 1.0).log(), Axis::new("relative distance").from(1e-7, 1.0).log());
    let members: Vec<&Family> = families.iter().filter(|f| f.law == law).collect();
    let mut speeds: Vec<String> = members.iter().map(|f| format!("{} at Ω = {}", f.name, f.compared)).collect();
    speeds.insert(0, law.to_string());
    let mut panel = Panel::new(label, speeds.join(", "), axes.0, axes.1);
    panel.legend = LegendPlace::Inside;
    for family in members {
        let found = distances(family)?;
        let tint = colour(family.name);
        let powers = order(&found).unwrap_or([f64::NAN; 2]);
        for (k, quantity, marker) in [(0, "max r", Marker::Circle), (1, "period", Marker::Square)] {
            let line: Vec<[f64; 2]> = found.iter().map(|d| [d.epsilon, d.relative[k]]).collect();
            let power = line.last().map(|at| Layer::note(*at, format!("{:.2}", powers[k])));
            let marks = Layer::scatter(line.clone(), marker, tint).named(format!("{}, {quantity}", family.name));
            panel = panel.with(Layer::curve(&line, tint).wide(1.0)).with(marks).with_all(power);
        }
    }
    Ok(panel)
}

/// Panel of the first-order damping limit along the backbones of SL, with the folds of the forced branches.
fn damping(families: &[Family]) -> Panel {
    let axes = (Axis::new("Ω").from(3.0, 11.5), Axis::new("ζ/ε").from(1e-3, 2.0).log());
    let mut panel = Panel::new("(i)", "SL turns back", axes.0, axes.1);
    panel.legend = LegendPlace::Inside;
    for (family, colour) in families.iter().filter(|f| f.name == "SL").zip([BLUE, VERMILION]) {
        let limit = |p: &foldline_rotor::BackbonePoint| Some([p.speed, p.damping_limit()?]);
        let limits: Vec<[f64; 2]> = family.backbone.points.iter().filter_map(limit).collect();
        let fold = |level: &Level| {
            let ratio = level.zeta / level.epsilon;
            level.folds().into_iter().map(move |s| [s.point.parameters[OMEGA], ratio]).collect::<Vec<_>>()
        };
        let folds = family.levels.iter().flat_map(fold).collect();
        panel = panel.with(Layer::curve(&limits, colour).named(format!("{}, limit", family.law)));
        panel =
            panel.with(Layer::scatter(folds, Marker::Circle, colour).hollow().named(format!("{}, folds", family.law)));
    }
    panel
}
