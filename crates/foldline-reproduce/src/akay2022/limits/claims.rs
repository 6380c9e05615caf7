//! Claims on the limit.

use super::{Family, rooted, turning};
use crate::akay2022::rotor::{max_r, speeds};
use crate::claims::{Claim, Finding, digits};
use foldline::diagram::Point;
use foldline_rotor::{BackbonePoint, ContactLaw, Ratio, undamped_modes};

const FIGURE: &str = "limits";

/// Distance of the forced cycles at [`Family::compared`] from the backbone.
pub struct Distance {
    /// ε.
    pub epsilon: f64,
    /// Differences of the largest radius and of the period, relative to the backbone; the largest over all sheets.
    pub relative: [f64; 2],
}

/// Returns every claim.
pub fn all(families: &[Family]) -> Vec<Claim> {
    let mut claims: Vec<Claim> = families.iter().map(root).collect();
    claims.extend(families.iter().filter(|f| f.has_contact()).map(interval));
    claims.extend(families.iter().map(approach));
    claims.extend([("SL", Ratio::SINGLE_LOOP), ("DL", Ratio::DOUBLE_LOOP)].map(|(name, ratio)| exists(name, ratio)));
    claims.extend(families.iter().filter(|f| f.name == "SL").map(turns));
    claims
}

/// Claim that a backbone, from its points of smallest radius, begins at the crossing of the Campbell diagram.
fn root(family: &Family) -> Claim {
    let finding = || {
        let closed = family.ratio.speed(family.constants.polar, 1.0).ok_or("there is no crossing")?;
        let [a, b, ..] = &family.backbone.points[..] else { return Err("the backbone has no points".to_string()) };
        // Below contact the speed does not depend on the radius; with the cubic spring it grows with the square.
        let share = if family.has_contact() { 0.0 } else { a.r_max.powi(2) / (b.r_max.powi(2) - a.r_max.powi(2)) };
        let computed = a.speed - share * (b.speed - a.speed);
        let found = Finding::vanishing((computed - closed).abs(), 1e-8);
        Ok(Finding { ours: digits(computed, 1e-8), ..found }.noting(format!("it differs by {:.1e}", computed - closed)))
    };
    let closed = family.ratio.speed(family.constants.polar, 1.0).map_or("·".into(), |w| digits(w, 1e-8));
    let statement =
        format!("Root of the backbone of {}, against the {}:1 crossing", family.title(), family.ratio.backward);
    Claim::check(FIGURE, statement, closed, finding())
}

/// Claim on the speeds between which a backbone with contact lies, for the piecewise-linear law and for the tanh law.
fn interval(family: &Family) -> Claim {
    let ends = |law: ContactLaw| {
        let backbone = rooted(&family.constants, law, family.ratio)?;
        let speeds = backbone.points.iter().map(|p| p.speed);
        Ok::<_, String>(speeds.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], w| [a.min(w), b.max(w)]))
    };
    let bounds = family.ratio.contact_interval(family.constants.polar, family.constants.beta);
    let finding = || {
        let [low, high] = bounds.ok_or("there is no crossing")?;
        let ([a, b], [soft, _]) = (ends(ContactLaw::Piecewise)?, ends(ContactLaw::Tanh)?);
        // Below contact the backbone is at the lower end.
        let error = 1e-8;
        let holds = a > low - error && b < high;
        let note = format!("piecewise-linear law; the pull of the tanh law leads {:.1e} below it", low - soft);
        Ok(Finding::qualified(holds, format!("{a:.6} to {b:.6}")).within(error).noting(note))
    };
    let study = bounds.map_or("·".into(), |[a, b]| format!("{a:.6} to {b:.6}"));
    Claim::check(
        FIGURE,
        format!("The backbone of {} lies between the crossings without and with the ring", family.title()),
        study,
        finding(),
    )
}

/// Largest radius and period of the backbone at a speed, interpolated by polynomials through its six nearest points.
fn at(points: &[BackbonePoint], speed: f64) -> Option<[f64; 2]> {
    let k = points.windows(2).position(|w| (w[0].speed - speed) * (w[1].speed - speed) <= 0.0)?;
    let count = points.len().min(6);
    let near = &points[(k + 1).saturating_sub(count / 2).min(points.len() - count)..][..count];
    let weight = |i: usize| -> f64 {
        let others = (0..count).filter(|j| *j != i);
        others.map(|j| (speed - near[j].speed) / (near[i].speed - near[j].speed)).product()
    };
    let value = |of: fn(&BackbonePoint) -> f64| (0..count).map(|i| weight(i) * of(&near[i])).sum();
    Some([value(|p| p.r_max), value(|p| p.period)])
}

/// Distances by decreasing ε.
pub fn distances(family: &Family) -> Result<Vec<Distance>, String> {
    let speed = family.compared;
    let backbone = at(&family.backbone.points, speed);
    let backbone = backbone.ok_or(format!("the backbone of {} misses Ω = {speed}", family.title()))?;
    let of = |p: &Point| [max_r(p), p.solution.period().unwrap_or(f64::NAN)];
    let mut found = Vec::new();
    for level in &family.levels {
        let mut relative = [0.0_f64; 2];
        for point in level.at(speed)? {
            (0..2).for_each(|k| relative[k] = relative[k].max((of(&point)[k] / backbone[k] - 1.0).abs()));
        }
        found.push(Distance { epsilon: level.epsilon, relative });
    }
    Ok(found)
}

/// Powers of ε with which the distances fall, from the two smallest ε.
pub fn order(found: &[Distance]) -> Option<[f64; 2]> {
    let [.., a, b] = found else { return None };
    Some([0, 1].map(|k| (a.relative[k] / b.relative[k]).ln() / (a.epsilon / b.epsilon).ln()))
}

/// Claim that the forced cycles approach the backbone with the expected powers of ε.
fn approach(family: &Family) -> Claim {
    // DL is symmetric under half a turn, under which ε changes its sign: its period is even in ε.
    let expected = if family.name == "SL" { [1.0, 1.0] } else { [1.0, 2.0] };
    let finding = || {
        let found = distances(family)?;
        let falls = found.windows(2).all(|w| (0..2).all(|k| w[1].relative[k] < w[0].relative[k]));
        let order = order(&found).ok_or("there are too few branches")?;
        // The next power of ε still has an effect at the smallest ε.
        let holds = falls && (0..2).all(|k| (order[k] - expected[k]).abs() < 0.1);
        let all: Vec<String> = found.iter().map(|d| format!("{:.1e}, {:.1e}", d.relative[0], d.relative[1])).collect();
        let note = format!("relative distances at Ω = {} by falling ε: {}", family.compared, all.join("; "));
        Ok(Finding::fact(holds, format!("max r: {:.3}, period: {:.3}", order[0], order[1])).noting(note))
    };
    let statement =
        format!("With ε, and ζ as its square, {} tends to its backbone, with these powers of ε", family.title());
    Claim::check(FIGURE, statement, format!("{}, {}", expected[0], expected[1]), finding())
}

/// Claim on the J_p up to which the crossing exists; there it goes to infinite speed.
fn exists(name: &str, ratio: Ratio) -> Claim {
    let n = f64::from(ratio.backward);
    // Beyond the critical speed the frequency ratio falls with Ω; the crossing exists if the ratio drops below n.
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
    Claim::check(FIGURE, statement, format!("(n-1)/n = {limit:.6}"), Ok(finding))
        .noting("the frequencies at a high speed, against the closed form")
}

/// Claim on the turning points of SL: the damping limit of the backbone against the folds of the forced branches.
fn turns(family: &Family) -> Claim {
    let finding = || {
        let (mut lines, mut off, mut error) = (Vec::new(), vec![Vec::new(); 2], 0.0_f64);
        for level in &family.levels {
            let predicted = turning::speeds(family, level.zeta / level.epsilon)?;
            let folds = speeds(level.run, &level.folds());
            if predicted.is_empty() || predicted.len() != folds.len() {
                return Err(format!("{} predicted, {} folds at ε = {}", predicted.len(), folds.len(), level.epsilon));
            }
            let mut pairs = Vec::new();
            for (k, ([w, e], [fold, f])) in predicted.iter().zip(&folds).enumerate() {
                off[k].push(w - fold);
                error = error.max(e + f);
                pairs.push(format!("{} and {}", digits(*w, 1e-6), digits(*fold, 1e-6)));
            }
            lines.push(format!("ε = {:.4}: {}", level.epsilon, pairs.join(", ")));
        }
        off.retain(|differences| !differences.is_empty());
        let closer: Vec<bool> = off.iter().map(|d| d.windows(2).all(|w: &[f64]| w[1].abs() < w[0].abs())).collect();
        let text = |d: &Vec<f64>| d.iter().map(|x| format!("{x:+.1e}")).collect::<Vec<_>>().join(", ");
        let ours: Vec<String> = off.iter().map(text).collect();
        let note = format!("foretold and computed Ω: {}", lines.join("; "));
        Ok(Finding::cases(&closer, format!("off by {}", ours.join("; "))).within(error).noting(note))
    };
    let statement = format!("The backbone foretells the folds of {}, the better the smaller ε is", family.title());
    Claim::check(FIGURE, statement, "closer as ε falls", finding())
        .noting("A difference that changes its sign can be small by chance")
}
