//! What the numbers say about the limit.

use super::{Family, rooted};
use crate::akay2022::rotor::{max_r, speeds};
use crate::claims::{Claim, Finding, digits};
use foldline::diagram::Point;
use foldline_rotor::{BackbonePoint, ContactLaw, Ratio, undamped_modes};

const FIGURE: &str = "limits";

/// The Ω at which forced cycles are compared with the backbone: every branch of the figure passes it.
pub const AT: f64 = 5.0;

/// How far the forced cycles at [`AT`] are from the backbone.
pub struct Distance {
    /// ε.
    pub epsilon: f64,
    /// Of the largest radius and of the period, over their values on the backbone; the larger one of all sheets.
    pub relative: [f64; 2],
}

/// Every claim.
pub fn all(families: &[Family]) -> Vec<Claim> {
    let mut claims: Vec<Claim> = families.iter().map(root).collect();
    claims.extend(families.iter().filter(|f| f.has_contact()).map(interval));
    claims.extend(families.iter().map(approach));
    claims.extend([("SL", Ratio::SINGLE_LOOP), ("DL", Ratio::DOUBLE_LOOP)].map(|(name, ratio)| exists(name, ratio)));
    claims.extend(families.iter().filter(|f| f.name == "SL").map(turns));
    claims
}

/// Where a backbone begins, from its points of smallest radius, against the crossing of the Campbell diagram.
fn root(family: &Family) -> Claim {
    let finding = || {
        let closed = family.ratio.speed(family.constants.polar, 1.0).ok_or("there is no crossing")?;
        let [a, b, ..] = &family.backbone.points[..] else { return Err("the backbone has no points".to_string()) };
        // Below contact the speed does not depend on the radius; with the cubic spring it grows with its square.
        let share = if family.has_contact() { 0.0 } else { a.r_max.powi(2) / (b.r_max.powi(2) - a.r_max.powi(2)) };
        let computed = a.speed - share * (b.speed - a.speed);
        let found = Finding::vanishing((computed - closed).abs(), 1e-8);
        Ok(Finding { ours: digits(computed, 1e-8), ..found }.noting(format!("it differs by {:.1e}", computed - closed)))
    };
    let closed = family.ratio.speed(family.constants.polar, 1.0).map_or("·".into(), |w| digits(w, 1e-8));
    let statement =
        format!("Root of the backbone of {}, against the {}:1 crossing", family.title(), family.ratio.backward);
    Claim::decided(FIGURE, statement, closed, finding())
}

/// Between which speeds a backbone with contact lies, with the piecewise-linear law and with the tanh law.
fn interval(family: &Family) -> Claim {
    let ends = |law: ContactLaw| {
        let backbone = rooted(&family.constants, law, family.ratio)?;
        let speeds = backbone.points.iter().filter(|p| p.r_max > 1.0).map(|p| p.speed);
        Ok::<_, String>(speeds.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], w| [a.min(w), b.max(w)]))
    };
    let bounds = family.ratio.contact_interval(family.constants.polar, family.constants.beta);
    let finding = || {
        let [low, high] = bounds.ok_or("there is no crossing")?;
        let ([a, b], [soft, _]) = (ends(ContactLaw::Piecewise)?, ends(ContactLaw::Tanh)?);
        let error = 1e-8;
        let holds = a > low - error && b < high;
        let note = format!("piecewise-linear law; the pull of the tanh law leads {:.1e} below it", low - soft);
        Ok(Finding::qualified(holds, format!("{a:.6} to {b:.6}")).within(error).noting(note))
    };
    let study = bounds.map_or("·".into(), |[a, b]| format!("{a:.6} to {b:.6}"));
    Claim::decided(
        FIGURE,
        format!("The backbone of {} lies between the crossings without and with the ring", family.title()),
        study,
        finding(),
    )
}

/// The point of the backbone at a speed, by cubic interpolation between neighbours.
fn at(points: &[BackbonePoint], speed: f64) -> Option<[f64; 2]> {
    let k = points.windows(2).position(|w| (w[0].speed - speed) * (w[1].speed - speed) <= 0.0)?;
    let near = &points[k.saturating_sub(2).min(points.len().saturating_sub(6))..][..points.len().min(6)];
    let weight = |i: usize| {
        let others = (0..near.len()).filter(|j| *j != i);
        others.map(|j| (speed - near[j].speed) / (near[i].speed - near[j].speed)).product::<f64>()
    };
    let sum = |of: fn(&BackbonePoint) -> f64| (0..near.len()).map(|i| weight(i) * of(&near[i])).sum();
    Some([sum(|p| p.r_max), sum(|p| p.period)])
}

/// Distances by falling ε.
pub fn distances(family: &Family) -> Result<Vec<Distance>, String> {
    let backbone =
        at(&family.backbone.points, AT).ok_or(format!("the backbone of {} misses Ω = {AT}", family.title()))?;
    let of = |p: &Point| [max_r(p), p.solution.period().unwrap_or(f64::NAN)];
    let mut found = Vec::new();
    for level in &family.levels {
        let mut relative = [0.0_f64; 2];
        for point in level.at(AT)? {
            (0..2).for_each(|k| relative[k] = relative[k].max((of(&point)[k] / backbone[k] - 1.0).abs()));
        }
        found.push(Distance { epsilon: level.epsilon, relative });
    }
    Ok(found)
}

/// The power of ε with which the forced cycles come closer, from the two smallest.
fn approach(family: &Family) -> Claim {
    // DL is symmetric under half a turn, under which ε changes its sign: its period is even in ε.
    let expected = if family.name == "SL" { [1.0, 1.0] } else { [1.0, 2.0] };
    let finding = || {
        let found = distances(family)?;
        let falls = found.windows(2).all(|w| (0..2).all(|k| w[1].relative[k] < w[0].relative[k]));
        let [.., a, b] = &found[..] else { return Err("there are too few branches".to_string()) };
        let order = [0, 1].map(|k| (a.relative[k] / b.relative[k]).ln() / (a.epsilon / b.epsilon).ln());
        let holds = falls && (0..2).all(|k| (order[k] - expected[k]).abs() < 0.1);
        let all: Vec<String> = found.iter().map(|d| format!("{:.1e}, {:.1e}", d.relative[0], d.relative[1])).collect();
        let note = format!("relative distances at Ω = {AT} by falling ε: {}", all.join("; "));
        Ok(Finding::fact(holds, format!("max r: {:.3}, period: {:.3}", order[0], order[1])).noting(note))
    };
    let statement =
        format!("With ε, and ζ as its square, {} tends to its backbone, with these powers of ε", family.title());
    Claim::decided(FIGURE, statement, format!("{}, {}", expected[0], expected[1]), finding())
}

/// Up to which J_p the crossing exists: where it goes off to infinite speed.
fn exists(name: &str, ratio: Ratio) -> Claim {
    let n = f64::from(ratio.backward);
    // From the critical speed on the ratio of the frequencies falls with Ω; the crossing exists where it gets below n.
    const FAR: f64 = 1e5;
    let crosses = |polar: f64| {
        let [slow, fast] = undamped_modes(FAR, polar, 1.0).rotating;
        fast / slow < n
    };
    let (mut yes, mut no) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (yes + no);
        *(if crosses(middle) { &mut yes } else { &mut no }) = middle;
    }
    let limit = ratio.polar_limit();
    let finding = Finding::number(yes, 1e-8, limit, 1e-6);
    let statement = format!("{name} has a root where J_p is below a limit");
    Claim::decided(FIGURE, statement, format!("(n-1)/n = {limit:.6}"), Ok(finding))
        .noting("the frequencies at a high speed, against the closed form")
}

/// Where SL turns back: the damping limit of the backbone against the folds of the forced branches.
fn turns(family: &Family) -> Claim {
    let finding = || {
        let (mut lines, mut largest) = (Vec::new(), Vec::new());
        for level in &family.levels {
            let predicted = family.backbone.turning_points(level.zeta / level.epsilon);
            let folds = speeds(&level.folds());
            if predicted.len() != folds.len() {
                return Err(format!("{} predicted, {} folds at ε = {}", predicted.len(), folds.len(), level.epsilon));
            }
            let pairs: Vec<String> = predicted
                .iter()
                .zip(&folds)
                .map(|([w, _], [fold, e])| format!("{w:.4} and {}", digits(*fold, *e)))
                .collect();
            lines.push(format!("ε = {:.4}: {}", level.epsilon, pairs.join(", ")));
            let off = predicted.iter().zip(&folds).map(|([w, _], [fold, _])| (w - fold).abs());
            largest.push(off.fold(0.0, f64::max));
        }
        let closer = largest.windows(2).all(|w| w[1] < w[0]);
        let ours: Vec<String> = largest.iter().map(|x| format!("{x:.1e}")).collect();
        Ok(Finding::qualified(closer, format!("off by {}", ours.join(", "))).noting(lines.join("; ")))
    };
    let statement = format!("The backbone foretells the folds of {} to first order in ε", family.title());
    Claim::decided(FIGURE, statement, "closer as ε falls", finding())
}
