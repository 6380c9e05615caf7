//! Figure 14: artefacts of a contact law that is too smooth.

use super::artefacts::{Fates, fates};
use super::rotor::{MAX_R, SPEED, least_radius, max_r};
use crate::claims::{Claim, Finding, digits};
use crate::publication::{FigurePlan, Made};
use crate::runs::{Run, Runs};
use foldline::diagram::{Kind, SpecialPoint};
use foldline_plot::palette::{AMBER, BLACK, BLUE, VERMILION};
use foldline_plot::{Axis, Figure, Layer, Panel, branch_curve, special_layers};
use std::fmt::Write;

pub const PLAN: FigurePlan =
    FigurePlan { name: "14", title: "artefacts of a small K", runs: &["blunt-contact", "diagrams"], make };

const SHARPNESS: [(u32, &str); 2] = [(90, BLUE), (30, VERMILION)];
/// Ten times the K of the study for β = 6 and for β = 10.
const SHARP: [f64; 2] = [900.0, 1500.0];

fn make(runs: &Runs) -> Result<Made, String> {
    let (run, sharp) = (runs.run("blunt-contact")?, runs.run("diagrams")?);
    let of_blunt = |name: &str| Ok::<_, String>((name.to_string(), fates(runs, run, name, SHARP[0])?));
    let blunt = ["S 30", "S 90", "light SL 30", "light SL 90"].map(of_blunt);
    let blunt: Vec<(String, Fates)> = blunt.into_iter().collect::<Result<_, _>>()?;
    let of_sharp = |name: &str| Ok::<_, String>((name.to_string(), fates(runs, sharp, name, SHARP[1])?));
    let sharp_fates = ["contact S", "contact SL", "contact DL"].map(of_sharp);
    let sharp_fates: Vec<(String, Fates)> = sharp_fates.into_iter().collect::<Result<_, _>>()?;
    let panels = vec![
        synchronous(run, &blunt)?,
        light(run, &blunt)?,
        next_to_contact(sharp, &sharp_fates)?,
        first_fold(sharp, &sharp_fates)?,
    ];
    let mut claims = vec![false_piece(run), false_family(run)];
    claims.extend(recognised(&blunt));
    claims.extend(sharp_fates.iter().map(|(name, fates)| of_figure_7(name, fates)));
    let all: Vec<&(String, Fates)> = blunt.iter().chain(&sharp_fates).collect();
    Ok(Made { figure: Figure::grid("A switch that is too blunt", 2, panels), caption: caption(&all), claims })
}

/// Layers of the vanishing parts, as a broad band below the curve.
fn band(all: &[(String, Fates)], name: &str) -> Vec<Layer> {
    let stretches = all.iter().filter(|(of, _)| of == name).flat_map(|(_, fates)| &fates.stretches);
    let drawn = stretches.map(|s| Layer::curve(&s.places, AMBER).wide(9.0).faint(0.45).named("vanishes as K grows"));
    drawn.collect()
}

fn with_contact(panel: Panel, x: f64) -> Panel {
    panel.with(Layer::horizontal(1.0)).with(Layer::note([x, 1.0], "contact"))
}

fn synchronous(run: &Run, all: &[(String, Fates)]) -> Result<Panel, String> {
    let axes = (Axis::new("Ω").from(0.88, 0.94), Axis::new("max r").from(0.86, 1.06));
    let mut panel = Panel::new("(a)", "S, β = 6", axes.0, axes.1);
    for (k, colour) in SHARPNESS {
        let name = format!("S {k}");
        let branch = run.branch(&name)?;
        panel = panel.with_all(band(all, &name));
        panel = panel.with(branch_curve(branch, SPEED, MAX_R, colour).named(format!("K = {k}")));
        panel = panel.with_all(special_layers(branch, SPEED, MAX_R, colour));
    }
    Ok(with_contact(panel, 0.935))
}

fn light(run: &Run, all: &[(String, Fates)]) -> Result<Panel, String> {
    let axes = (Axis::new("Ω").from(2.7, 3.7), Axis::new("max r").from(0.9, 1.12));
    let mut panel = Panel::new("(b)", "SL (S thin), β = 6, ζ = 10⁻⁵, ε = 0.8", axes.0, axes.1);
    for (k, colour) in SHARPNESS {
        let name = format!("light SL {k}");
        panel = panel.with_all(band(all, &name));
        panel = panel.with(branch_curve(run.branch(&name)?, SPEED, MAX_R, colour).named(format!("K = {k}")));
        if let Ok(branch) = run.branch(&format!("light S {k}")) {
            panel = panel.with(branch_curve(branch, SPEED, MAX_R, colour).wide(0.9));
        }
    }
    Ok(with_contact(panel, 3.62))
}

/// S of figure 7 next to contact.
fn next_to_contact(run: &Run, all: &[(String, Fates)]) -> Result<Panel, String> {
    let axes = (Axis::new("Ω").from(0.908, 0.93), Axis::new("max r").from(0.92, 1.012));
    let branch = run.branch("contact S")?;
    let panel = Panel::new("(c)", "S of figure 7: β = 10, K = 150", axes.0, axes.1)
        .with_all(band(all, &branch.name))
        .with(branch_curve(branch, SPEED, MAX_R, BLACK).named("K = 150"))
        .with_all(special_layers(branch, SPEED, MAX_R, BLACK));
    Ok(with_contact(panel, 0.9275))
}

/// SL of figure 7 next to its first fold.
fn first_fold(run: &Run, all: &[(String, Fates)]) -> Result<Panel, String> {
    let branch = run.branch("contact SL")?;
    let folds = run.special(&branch.name, Kind::Fold)?;
    let first = folds.into_iter().min_by(|a, b| a.point.parameters[0].total_cmp(&b.point.parameters[0]));
    let [omega, r] = first.map_or([3.35, 1.03], |f| [f.point.parameters[0], max_r(&f.point)]);
    let axes = (Axis::new("Ω").from(omega - 4e-4, omega + 1.2e-3), Axis::new("max r").from(r - 2e-3, r + 2e-3));
    Ok(Panel::new("(d)", "SL of figure 7, first fold: β = 10, K = 150", axes.0, axes.1)
        .with_all(band(all, &branch.name))
        .with(branch_curve(branch, SPEED, MAX_R, BLACK).named("K = 150"))
        .with_all(special_layers(branch, SPEED, MAX_R, BLACK)))
}

fn caption(all: &[&(String, Fates)]) -> String {
    let mut text = format!(
        "With K = 30 S bends back below contact and is unstable there, and SL goes on far below contact where no ring is felt. \
         Every point was followed in K alone, to K = {} (β = 6) or {} (β = 10); where K turns back before, the point exists only \
         because K is small, and the branch is marked. At K = 150 a smaller loop of S is left of the same kind; a fold that moves \
         with K leaves a short piece next to it.",
        SHARP[0], SHARP[1]
    );
    text.push_str("\n\nbranch\tΩ\tmax r\texists up to K\tfolds on it\tpoints followed");
    for (name, fates) in all {
        if fates.stretches.is_empty() {
            let _ = write!(text, "\n{name}\tnothing vanishes\t\t\t\t{}", fates.tested_in_words());
        }
        for s in &fates.stretches {
            let ([a, b], [low, high]) = (s.range(0), s.range(1));
            let _ = write!(
                text,
                "\n{name}\t{a:.6} to {b:.6}\t{low:.5} to {high:.5}\t{:.1} to {:.1}\t{}\t{}",
                s.until[0],
                s.until[1],
                s.folds,
                fates.tested_in_words()
            );
        }
    }
    text
}

/// Claims on the artefacts of a small K, and on their absence at the K of the study.
fn recognised(all: &[(String, Fates)]) -> Vec<Claim> {
    let of = |name: &str| all.iter().find(|(of, _)| of == name).map(|(_, fates)| fates);
    let below = |name: &str| {
        let fates = of(name).ok_or("it was not followed")?;
        let holds = fates.stretches.iter().any(|s| s.range(1)[0] < 1.0);
        Ok(Finding::qualified(holds, fates.in_words()).noting(fates.tested_in_words()))
    };
    let removed = |blunt: &str, sharp: &str| {
        let [before, after] = [of(blunt), of(sharp)];
        let (before, after) = (before.ok_or("it was not followed")?, after.ok_or("it was not followed")?);
        let width = |fates: &Fates| fates.stretches.iter().map(|s| s.width()).fold(0.0, f64::max);
        let ours = format!("longest: {:.5} in Ω with K = 30, {:.5} with K = 90", width(before), width(after));
        Ok(Finding::qualified(width(after) < 0.5 * width(before), ours)
            .noting(format!("with K = 90: {}", after.in_words())))
    };
    // SL with K = 90 is not followed down to these points, so their own fate decides.
    let gone = |blunt: &str| {
        let fates = of(blunt).ok_or("it was not followed")?;
        let until = fates.stretches.iter().map(|s| s.until[1]).fold(0.0, f64::max);
        let ours = format!("the last of them vanish at K = {until:.1}");
        Ok(Finding::qualified(!fates.stretches.is_empty() && until < 90.0, ours))
    };
    vec![
        Claim::check("14", "S at β = 6, K = 30 has points that exist only because K is small", "yes", below("S 30")),
        Claim::check("14", "So has SL at ζ = 10⁻⁵, ε = 0.8, below contact", "yes", below("light SL 30")),
        Claim::check("14", "K = 90 removes them from S", "yes", removed("S 30", "S 90")),
        Claim::check("14", "K = 90 removes them from SL", "yes", gone("light SL 30")),
    ]
}

fn of_figure_7(name: &str, fates: &Fates) -> Claim {
    // A single vanishing point decides, whatever the fates of the others.
    let holds = fates.stretches.is_empty() && fates.changed == 0;
    let finding = match (holds, fates.undecided) {
        (true, 1..) => Err("too few points could be followed".to_string()),
        _ => Ok(Finding::fact(holds, fates.in_words())),
    };
    let statement = format!("No point of {name} in figure 7 depends on K = 150");
    Claim::check("14", statement, "K was validated on cycles", finding).noting(&fates.tested_in_words())
}

/// The unstable piece of S below contact, whose width is that of the smoothing.
fn false_piece(run: &Run) -> Claim {
    let width = |k: u32| {
        let folds = run.special(&format!("S {k}"), Kind::Fold)?;
        let below: Vec<&&SpecialPoint> = folds.iter().filter(|f| f.point.parameters[0] < 1.1).collect();
        let [a, b] = below[..] else { return Err(format!("S {k} has {} folds below contact", below.len())) };
        let ([low, e1], [high, e2]) = (run.place(0, a), run.place(0, b));
        Ok(((low - high).abs(), max_r(&a.point).max(max_r(&b.point)), e1 + e2))
    };
    let finding = || {
        let ((blunt, r, error), (sharp, _, _)) = (width(30)?, width(90)?);
        let ours = format!("{} wide in Ω at r < {r:.4}; {} for K = 90", digits(blunt, error), digits(sharp, error));
        let note = format!("the widths are as 1 : {:.2}, the widths 1/K of the switch as 1 : 0.33", sharp / blunt);
        Ok(Finding::qualified(blunt > 2.0 * sharp && r < 1.0, ours).within(error).noting(note))
    };
    Claim::decided("14", "With β = 6, K = 30 S has a kink and a false unstable piece below contact", "yes", finding())
}

/// Claim on the reach of SL below contact, where the ring is absent: the reach shrinks like the width 1/K of the
/// switch.
fn false_family(run: &Run) -> Claim {
    let lowest = |k: u32| least_radius(run, &format!("light SL {k}"));
    let finding = || {
        let ([blunt, at, error], [sharp, there, _]) = (lowest(30)?, lowest(90)?);
        let ours = format!("down to max r = {} at Ω = {at:.4}", digits(blunt, error));
        let note = format!(
            "with K = 90 it goes to max r = {sharp:.5} at Ω = {there:.4}: the depths below contact are as 1 : {:.2}, the widths \
             1/K as 1 : 0.33",
            (1.0 - sharp) / (1.0 - blunt)
        );
        Ok(Finding::qualified(blunt < 1.0 && 1.0 - sharp < 0.5 * (1.0 - blunt), ours).within(error).noting(note))
    };
    Claim::decided("14", "With K = 30 there is a fictitious family around and below contact", "yes", finding())
}
