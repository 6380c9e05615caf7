//! Basins of attraction in a plane of the state space.

use crate::compose::figure_svg;
use crate::figure::{Axis, Figure, Layer, LegendPlace, Marker, Panel};
use crate::palette;
use crate::quantity::with_greek;
use foldline::attractors::Fate;
use foldline::diagram::{Share, Solution};
use foldline::explore::basins::{Basins, Plane};
use foldline::model::Model;

/// Colours of basins, light enough for orbits in black to be seen.
const COLOURS: [&str; 7] = [
    palette::SKY,
    palette::ORANGE,
    palette::GREEN,
    palette::YELLOW,
    palette::PURPLE,
    palette::BLUE,
    palette::VERMILION,
];

/// Name of an attractor in a picture or table: its type, and its ratio or its period; `number` from 0.
pub fn name(basins: &Basins, number: usize, map: bool) -> String {
    let attractor = &basins.attractors[number];
    match (&attractor.point.solution, attractor.ratio) {
        (Solution::Equilibrium(_), _) => format!("equilibrium {}", number + 1),
        (Solution::Torus(_), _) => format!("torus {}", number + 1),
        (Solution::Cycle(_), Some((a, b))) => format!("cycle {}, {a}:{b}", number + 1),
        (Solution::Cycle(cycle), None) if map && cycle.period == 1.0 => format!("fixed point {}", number + 1),
        (Solution::Cycle(cycle), None) => format!("cycle {}, period {:.4}", number + 1, cycle.period),
    }
}

/// Every fate other than that of reaching an attractor, with its name and colour.
pub const LOST: [(Fate, &str, &str); 5] = [
    (Fate::Unsettled, "not settled", "#c8c8c8"),
    (Fate::Escaped, "unbounded", palette::BLACK),
    (Fate::Undefined, "left the domain of f", "#7a5230"),
    (Fate::Stuck, "step too small", palette::GREY),
    (Fate::Left, "not computed", "#ffffff"),
];

/// Renders the basins in a plane as SVG, with the attractors: marks for equilibria, orbits of cycles in projection.
pub fn svg(basins: &Basins, plane: &Plane, model: &Model, map: bool) -> String {
    let label = |axis: usize| {
        let state = &model.states[plane.axes[axis]];
        match state.unit.as_str() {
            "" | "1" | "-" => with_greek(&state.name),
            unit => format!("{} [{unit}]", with_greek(&state.name)),
        }
    };
    let [x, y] = [0, 1].map(|axis| Axis::new(label(axis)).from(plane.ranges[axis][0], plane.ranges[axis][1]));
    let cells = |fate: Fate, colour: &'static str| {
        let filled = basins.plane_fates.iter().map(|own| *own == fate).collect();
        Layer::cells(plane.ranges, plane.cells[0], filled, colour)
    };
    let part = |fate: Fate| percent(basins.part(fate));
    let mut layers: Vec<Layer> = Vec::new();
    for number in 0..basins.attractors.len() {
        let fate = Fate::Settled(number);
        let colour = COLOURS[number % COLOURS.len()];
        layers.push(cells(fate, colour).named(format!("{}: {}", name(basins, number, map), part(fate))));
    }
    for (fate, name, colour) in LOST.into_iter().filter(|(fate, ..)| basins.plane_fates.contains(fate)) {
        layers.push(cells(fate, colour).named(format!("{name}: {}", part(fate))));
    }
    for attractor in &basins.attractors {
        let at = |state: &[f64]| [state[plane.axes[0]], state[plane.axes[1]]];
        layers.push(match &attractor.point.solution {
            Solution::Equilibrium(state) => Layer::scatter(vec![at(state)], Marker::Circle, palette::BLACK),
            Solution::Torus(torus) => {
                let states = torus.grid(41, 41);
                Layer::scatter(
                    states.chunks_exact(plane.through.len()).map(at).collect(),
                    Marker::Circle,
                    palette::BLACK,
                )
            }
            Solution::Cycle(cycle) if map => {
                let states = cycle.profile.chunks_exact(plane.through.len());
                Layer::scatter(states.map(at).collect(), Marker::Circle, palette::BLACK)
            }
            Solution::Cycle(cycle) => {
                let states = cycle.uniform(ORBIT);
                let mut points: Vec<[f64; 2]> = states.chunks_exact(plane.through.len()).map(at).collect();
                points.push(points[0]);
                Layer::curve(&points, palette::BLACK).wide(1.0)
            }
        });
    }
    let panel = Panel { legend: LegendPlace::Beside, height: 640.0, ..Panel::new("", "", x, y).with_all(layers) };
    figure_svg(&Figure { panels: vec![panel], width: 880.0, ..Figure::default() })
}

/// Points of the orbit of a cycle.
const ORBIT: usize = 720;

/// A fraction in per cent.
fn percent(share: Share) -> String {
    format!("{:.1} %", 100.0 * share.value())
}
