//! Figures 12 and 13: almost no damping and a large unbalance.

use super::figure04::chosen;
use super::figure10::diagrams;
use super::rotor::{OMEGA, is_closed, max_r, min_r, smallest};
use crate::claims::{Claim, Finding, digits};
use crate::publication::{FigurePlan, Made};
use crate::runs::{Run, Runs};
use foldline::diagram::{Branch, Kind};

const CUBIC_RUN: &str = "light-damping-large-unbalance-cubic";
const CONTACT_RUN: &str = "light-damping-large-unbalance-contact";

pub const CUBIC: FigurePlan =
    FigurePlan { name: "12", title: "ζ = 10⁻⁵, ε = 1.5, cubic", runs: &[CUBIC_RUN], make: cubic };
pub const CONTACT: FigurePlan = FigurePlan {
    name: "13",
    title: "ζ = 10⁻⁵, ε = 1.5, contact",
    runs: &[CONTACT_RUN, "flows-large-unbalance"],
    make: contact,
};

fn cubic(runs: &Runs) -> Result<Made, String> {
    let run = runs.run(CUBIC_RUN)?;
    let figure = diagrams(
        run,
        "cubic",
        "Cubic spring, ζ = 10⁻⁵, ε = 1.5",
        [0.5, 15.0, 0.0, 20.0],
        &[("where SL meets S", [2.5, 7.5, 1.0, 4.5])],
    );
    let claims = vec![straight(run), connects("12", run, "cubic", "SL"), connects("12", run, "cubic", "DL")];
    Ok(Made { figure, caption: "S, SL and DL without contact; SL comes next to S.".into(), claims })
}

fn contact(runs: &Runs) -> Result<Made, String> {
    let run = runs.run(CONTACT_RUN)?;
    let parts = [("double loop", [5.9, 6.7, 1.5, 6.0]), ("single loop", [8.3, 10.3, 1.3, 5.0])];
    let figure = diagrams(run, "contact", "Contact, ζ = 10⁻⁵, ε = 1.5", [0.3, 15.0, 0.0, 20.0], &parts);
    let mut claims = vec![connects("13", run, "contact", "SL"), connects("13", run, "contact", "DL"), second_zone(run)];
    let flows = runs.run("flows-large-unbalance")?;
    claims.extend(["SL", "DL"].map(|family| chosen("13", flows, "large", family, run)));
    Ok(Made {
        figure,
        caption: "S, SL and DL with contact; the double loop has a second stable zone below the main one.".into(),
        claims,
    })
}

/// Claim that the straight run turns back. ε and ζ change together, but only ε matters there.
fn straight(run: &Run) -> Claim {
    let finding = || {
        let folds = run.special("cubic SL to 1.5/1", Kind::Fold)?;
        let fold = folds.first().ok_or("the straight run has no fold")?;
        let [value, error] = run.place(run.parameter("epsilon"), fold);
        let route: Vec<&str> =
            run.notes.iter().filter(|(about, _)| about == "cubic SL to 1.5").map(|(_, note)| note.as_str()).collect();
        Ok(Finding::number(value, error, 1.465, 5e-4).noting(route.join("; ")))
    };
    Claim::decided("12", "At Ω = 5 the cubic SL turns back before ε = 1.5", "1.465", finding())
}

/// Claim on the distance of a family of cycles from S, measured by the variation of the radius along the cycle. Cycles
/// can end on S only at a Hopf point; any other point of S has a neighbourhood without cycles.
fn connects(figure: &'static str, run: &Run, law: &str, family: &str) -> Claim {
    let finding = || {
        let [variation, omega] =
            smallest(run.branch(&format!("{law} {family}"))?, |p| (max_r(p) - min_r(p)) / max_r(p));
        let hopf = run.special(&format!("{law} S"), Kind::Hopf)?.len();
        let ours = format!("radius varies by {:.2} % at Ω = {omega:.5}", 100.0 * variation);
        let note = match hopf {
            0 => "nearly: S has no Hopf point, so the cycles pass by at a distance".to_string(),
            n => format!("S has {n} Hopf points"),
        };
        Ok(Finding::qualified(variation < 0.1, ours).noting(note))
    };
    Claim::decided(figure, format!("S and {family} connect, or nearly so"), "yes", finding())
}

/// Claim on a stable part of DL at smaller radii than the main one, at the same speeds.
fn second_zone(run: &Run) -> Claim {
    let finding = || {
        let zones = stable_zones(run.branch("contact DL")?);
        let top = zones.iter().max_by(|a, b| a.radius[1].total_cmp(&b.radius[1])).ok_or("DL is nowhere stable")?;
        let below = zones.iter().filter(|z| z.radius[1] < top.radius[0].min(5.0));
        let second = below.max_by(|a, b| (a.speed[1] - a.speed[0]).total_cmp(&(b.speed[1] - b.speed[0])));
        Ok(match second {
            Some(zone) => {
                let [a, b] = zone.speed.map(|w| digits(w, zone.error));
                let ours = format!("Ω = {a} to {b}, max r = {:.4} to {:.4}", zone.radius[0], zone.radius[1]);
                Finding::qualified(true, ours).within(zone.error)
            }
            None => Finding::fact(false, format!("{} stable zones, none below the main one", zones.len())),
        })
    };
    Claim::decided("13", "DL has a second stable zone below the main one", "yes", finding())
}

/// A stable part of a branch.
struct Zone {
    /// Smallest and largest Ω.
    speed: [f64; 2],
    /// Smallest and largest max r.
    radius: [f64; 2],
    /// Error in Ω of the special points at its ends.
    error: f64,
}

/// Stable parts of a branch, each from one change of stability to the next.
fn stable_zones(branch: &Branch) -> Vec<Zone> {
    let mut marks: Vec<(i64, bool, f64, f64, bool, f64)> = Vec::new();
    for p in &branch.points {
        marks.push((p.position, false, p.parameters[OMEGA], max_r(p), p.unstable == 0, 0.0));
    }
    for s in &branch.special {
        let omega = s.point.parameters[OMEGA];
        let error = s.error * branch.size(omega);
        marks.push((s.point.position, true, omega, max_r(&s.point), s.unstable_after == 0, error));
    }
    // A special point lies after the point of its position.
    marks.sort_by_key(|m| (m.0, m.1));
    let ends = [marks.first().is_some_and(|m| m.4), marks.last().is_some_and(|m| m.4)];
    let mut zones: Vec<Zone> = Vec::new();
    let mut open = false;
    for (_, _, w, r, stable, error) in marks {
        match (open, stable, zones.last_mut()) {
            (true, _, Some(zone)) => {
                zone.speed = [zone.speed[0].min(w), zone.speed[1].max(w)];
                zone.radius = [zone.radius[0].min(r), zone.radius[1].max(r)];
                zone.error = zone.error.max(error);
            }
            (_, true, _) => zones.push(Zone { speed: [w, w], radius: [r, r], error }),
            _ => {}
        }
        open = stable;
    }
    // A closed branch that begins inside a zone has traversed it in two parts.
    if zones.len() > 1 && ends == [true, true] && is_closed(branch) {
        let first = zones.remove(0);
        if let Some(last) = zones.last_mut() {
            let joined = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
            last.speed = joined(first.speed, last.speed);
            last.radius = joined(first.radius, last.radius);
            last.error = first.error.max(last.error);
        }
    }
    zones
}
