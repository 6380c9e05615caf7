//! Figure 9: period-doubled branches of the contact rotor, and the motions found by simulation.

use super::rotor::{MAX_R, SPEED, max_r, over_speed, speeds};
use super::simulation::{self, Simulated};
use crate::claims::{Claim, Finding, digits};
use crate::publication::{FigurePlan, Made};
use crate::runs::{Run, Runs};
use foldline::diagram::{Ending, Kind, Response};
use foldline_plot::figure::{Marker, Shape};
use foldline_plot::palette::{AMBER, AZURE, BLACK, BLUE, GREY, PALE, PURPLE};
use foldline_plot::{Axis, Figure, Layer, Panel, branch_curve, branch_layers};

pub const PLAN: FigurePlan = FigurePlan {
    name: "9",
    title: "period-doubled branches with contact",
    runs: &["diagrams", "other-cycles", "simulation"],
    make,
};

const SL: [f64; 4] = [3.2, 5.2, 0.97, 1.5];
const DL: [f64; 4] = [2.55, 4.6, 1.2, 2.2];

fn make(runs: &Runs) -> Result<Made, String> {
    let (run, other) = (runs.run("diagrams")?, runs.run("other-cycles")?);
    let simulated = Simulated::of(runs.run("simulation")?, &[run, other], runs.jobs())?;
    let panels = vec![
        doubled(run, "(a)", "SL", SL)?,
        doubled(run, "(b)", "DL", DL)?,
        sampled(run, &simulated)?,
        swept(run, &simulated)?,
        everything(run, other, &simulated)?,
    ];
    let mut claims = Vec::new();
    for family in ["SL", "DL"] {
        claims.extend(cascade(run, family));
    }
    claims.extend(simulation::claims(run, &simulated));
    let caption = format!(
        "(a), (b) The branches of twice the period join the single ones at both ends, those of four times the period \
         these; each loses its stability in a further period doubling. (c), (e) The largest radius of every motion to which one of {} starts at each of {} speeds settled, \
         without a look at the branches; rings are stable solutions that no start reached, simulated from {:.0e} beside them. \
         (d) Stepped sweeps: each speed starts from the last state at the speed before. In (e) the other cycles are branches of \
         their own: 4:1, 5:1, 6:1, and cycles that close after several turns.",
        simulated.starts,
        simulated.speeds,
        crate::agreement::ASIDE
    );
    Ok(Made { figure: Figure::grid("Contact: period doubling", 2, panels), caption, claims })
}

fn empty(label: &str, title: &str, [x0, x1, y0, y1]: [f64; 4]) -> Panel {
    let axes = (Axis::new("Ω").from(x0, x1), Axis::new("max r").from(y0, y1));
    Panel { height: 400.0, ..Panel::new(label, title, axes.0, axes.1) }
}

/// Layers of a family with the branches of two and four times its period, marks last.
fn family(run: &Run, family: &str, marks: bool) -> Result<Vec<Layer>, String> {
    let root = run.branch(&format!("contact {family}"))?;
    let mut layers = over_speed(root, family, MAX_R);
    for branch in run.diagram.branches.iter().filter(|b| b.name.starts_with(&format!("{}/", root.name))) {
        let depth = branch.name.matches('/').count();
        let (shade, name) = if depth == 1 { (PURPLE, "period 2") } else { (BLACK, "period 4") };
        let mut next = branch_layers(branch, SPEED, MAX_R, shade);
        if let Some(curve) = next.first_mut() {
            curve.name = Some(name.into());
            curve.width = 1.3;
        }
        layers.extend(next);
    }
    layers.retain(|layer| marks || !matches!(layer.shape, Shape::Scatter { .. }));
    layers.sort_by_key(|layer| matches!(layer.shape, Shape::Scatter { .. }));
    Ok(layers)
}

/// (a), (b): the branches alone.
fn doubled(run: &Run, label: &str, name: &str, window: [f64; 4]) -> Result<Panel, String> {
    Ok(empty(label, name, window).with_all(family(run, name, true)?).with(Layer::horizontal(1.0)))
}

/// (c): SL as sampled by simulation from many starts.
fn sampled(run: &Run, simulated: &Simulated) -> Result<Panel, String> {
    let panel = empty("(c)", "SL, simulated from many starts", SL).with_all(family(run, "SL", true)?);
    let [met, missed] = survey(simulated);
    Ok(panel.with(Layer::horizontal(1.0)).with(missed).with(met))
}

/// Layers of the motions found by the survey, and of those reached only from a nearby start.
fn survey(simulated: &Simulated) -> [Layer; 2] {
    let dot = |points: Vec<[f64; 2]>, name: &str| Layer::scatter(points, Marker::Circle, GREY).wide(2.6).named(name);
    let met = simulated.survey.met.iter().map(|met| place(&met.motion)).collect();
    let missed = simulated.missed().map(|stable| [stable.value, max_r(&stable.point)]).collect();
    [dot(met, "reached from many starts"), dot(missed, "reached only from nearby starts").hollow()]
}

fn place(motion: &Response) -> [f64; 2] {
    [motion.value, motion.ranges.get(4).map_or(f64::NAN, |r| r[1])]
}

/// (d): DL swept up and down, with the branches to which the sweeps jump.
fn swept(run: &Run, simulated: &Simulated) -> Result<Panel, String> {
    let mut panel = empty("(d)", "DL, stepped sweeps", [4.0, 6.5, 0.0, 5.0]);
    let s = branch_curve(run.branch("contact S")?, SPEED, MAX_R, BLUE).named("S");
    panel = panel.with(s).with_all(family(run, "SL", false)?).with_all(family(run, "DL", true)?);
    for (set, marker, shade, name) in
        [(&simulated.up, Marker::Triangle, AMBER, "sweep up"), (&simulated.down, Marker::Nabla, AZURE, "sweep down")]
    {
        let places: Vec<[f64; 2]> = set.met.iter().map(|met| place(&met.motion)).collect();
        panel = panel.with(Layer::curve(&places, shade).wide(0.8));
        panel = panel.with(Layer::scatter(places, marker, shade).wide(3.0).named(name));
    }
    Ok(panel)
}

/// (e): everything found by simulation, drawn over all branches.
fn everything(run: &Run, other: &Run, simulated: &Simulated) -> Result<Panel, String> {
    let mut panel = empty("(e)", "all attractors in this window", [3.2, 5.2, 0.2, 3.6]);
    panel.span = 2;
    panel = panel.zooming(SL, "(c)");
    for branch in other.diagram.branches.iter().filter(|b| !b.points.is_empty()) {
        panel = panel.with(branch_curve(branch, SPEED, MAX_R, PALE).wide(1.2).named("other cycles"));
    }
    panel = panel.with(branch_curve(run.branch("contact S")?, SPEED, MAX_R, BLUE).named("S"));
    panel = panel.with_all(family(run, "SL", false)?).with_all(family(run, "DL", false)?);
    let [met, missed] = survey(simulated);
    Ok(panel.with(missed.wide(2.2)).with(met.wide(2.2)))
}

fn cascade(run: &Run, family: &str) -> Vec<Claim> {
    let first = format!("contact {family}/period-doubling-1");
    let listed = |name: &str| {
        let found = speeds(run, &run.special(name, Kind::PeriodDoubling)?);
        let worst = found.iter().map(|s| s[1]).fold(0.0, f64::max);
        let list: Vec<String> = found.iter().map(|[at, error]| digits(*at, *error)).collect();
        Ok::<_, String>((found.len(), list.join(", "), worst))
    };
    let secondary = || {
        let (count, list, error) = listed(&first)?;
        Ok(Finding::qualified(count > 0, format!("Ω = {list}")).within(error))
    };
    let joined = || {
        let branch = run.branch(&first)?;
        let ends: Vec<f64> = branch
            .ends
            .iter()
            .flatten()
            .filter_map(|end| match end {
                Ending::Joined { at: Kind::PeriodDoubling, parameter } => Some(*parameter),
                _ => None,
            })
            .collect();
        let list: Vec<String> = ends.iter().map(|at| format!("{at:.6}")).collect();
        // The end farther from the corresponding period doubling counts.
        let doublings = speeds(run, &run.special(&format!("contact {family}"), Kind::PeriodDoubling)?);
        let apart =
            |end: &f64| doublings.iter().map(|[at, error]| (at - end).abs() + error).fold(f64::INFINITY, f64::min);
        let error = ends.iter().map(apart).fold(0.0, f64::max);
        Ok(Finding::fact(ends.len() == 2, list.join(", ")).within(error))
    };
    vec![
        Claim::decided(
            "9",
            format!("The period-doubled branch of {family} leads from one period doubling to the other"),
            "yes",
            joined(),
        ),
        Claim::decided("9", format!("The period-doubled branch of {family} doubles again"), "yes", secondary()),
    ]
}
