//! Selection among the attractors found, and their description in messages.

use super::System;
use super::diagnosis::{Instead, Seen, of_no_start};
use super::plan::{AttractorKey, SeedPlan};
use crate::attractors::{Attractor, Census, whirl_sense};
use crate::diagram::{Point, Solution, Symmetry};

/// True if a solution is of the type that a key names.
pub(super) fn is_meant(key: &AttractorKey, point: &Point, ratio: Option<(u32, u32)>) -> bool {
    match (key, &point.solution) {
        (AttractorKey::Equilibrium, solution) => matches!(solution, Solution::Equilibrium(_)),
        (AttractorKey::Cycle, solution) => matches!(solution, Solution::Cycle(_)),
        (AttractorKey::Ratio(p, q), _) => ratio == Some((*p, *q)),
        (AttractorKey::Lasting(periods), solution) => solution.forcing_periods() == *periods,
    }
}

/// The attractors that match a key.
pub(super) struct Choice<'c> {
    /// In order of preference: equilibria by increasing norm, cycles by decreasing number of hits.
    meant: Vec<&'c Attractor>,
}

impl<'c> Choice<'c> {
    /// Selects the sampled attractors that match a key; mirror images count once.
    pub(super) fn of(system: &System, tolerance: f64, census: &'c Census, key: &AttractorKey) -> Choice<'c> {
        let size = |a: &Attractor| match &a.point.solution {
            Solution::Equilibrium(x) => system.norm(x),
            Solution::Cycle(_) | Solution::Torus(_) => f64::INFINITY,
        };
        let mut fitting: Vec<&Attractor> =
            census.attractors.iter().filter(|a| is_meant(key, &a.point, a.ratio)).collect();
        match key {
            AttractorKey::Equilibrium => fitting.sort_by(|a, b| size(a).total_cmp(&size(b))),
            AttractorKey::Cycle | AttractorKey::Ratio(..) | AttractorKey::Lasting(_) => {
                fitting.sort_by_key(|a| std::cmp::Reverse(a.hits));
            }
        }
        let mut meant: Vec<&Attractor> = Vec::new();
        for attractor in fitting {
            let image = |other: &&Attractor| {
                let close =
                    |r: &Symmetry| attractor.point.difference(&other.point, system.measure(), r) < 30.0 * tolerance;
                system.symmetries.iter().any(close)
            };
            if !meant.iter().any(image) {
                meant.push(attractor);
            }
        }
        Choice { meant }
    }

    pub(super) fn taken(&self) -> Option<&Point> {
        self.meant.first().map(|attractor| &attractor.point)
    }

    /// Note on a choice between several cycles, with a way to select another; `None` if there is no choice.
    pub(super) fn told(&self, system: &System) -> Option<String> {
        let [first, others @ ..] = &self.meant[..] else { return None };
        if others.is_empty() || first.point.solution.period().is_none() {
            return None;
        }
        let others: Vec<String> = others.iter().map(|other| described(system, other)).collect();
        Some(format!(
            "{} is used, because most samples reached it; also matching: {}. To start from one of those, give a \
             state on it: `state = {{ … }}`",
            described(system, first),
            others.join(", ")
        ))
    }
}

fn described(system: &System, attractor: &Attractor) -> String {
    format!("{} ({})", kind(system, attractor), attractor.hits)
}

/// Name of an attractor. The sense of whirl is stated for forced models only: in an autonomous one the whirl plane may
/// turn with the shaft.
fn kind(system: &System, attractor: &Attractor) -> String {
    match (&attractor.point.solution, attractor.ratio) {
        (Solution::Equilibrium(_), _) => "equilibrium".to_string(),
        (Solution::Torus(_), _) => "torus".to_string(),
        (Solution::Cycle(cycle), Some((p, q))) => format!("{p}:{q} cycle of period {:.6}", cycle.period),
        (Solution::Cycle(cycle), None) => {
            let sense = system.whirl.filter(|_| system.field.forced()).and_then(|whirl| whirl_sense(cycle, whirl));
            let name = sense.map_or("cycle".to_string(), |sense| format!("{} whirl", sense.name()));
            format!("{name} of period {:.6}", cycle.period)
        }
    }
}

/// Returns a summary of the outcome of all samples.
pub(super) fn summary(system: &System, census: &Census) -> String {
    if let [found] = &census.attractors[..]
        && found.hits == 0
    {
        let what = kind(system, found);
        return match census.unsettled {
            0 => format!(
                "{what}, found by Newton's method; it attracts too slowly for samples to settle within the step limit"
            ),
            n => format!(
                "{what}, found by Newton's method from the state nearest to the origin; {n} samples did not settle \
                 anywhere"
            ),
        };
    }
    let mut parts: Vec<String> = census.attractors.iter().map(|attractor| described(system, attractor)).collect();
    if census.unsettled > 0 {
        parts.push(format!("not settled ({})", census.unsettled));
    }
    if census.escaped > 0 {
        parts.push(format!("escaped ({})", census.escaped));
    }
    if !census.exits.is_empty() {
        parts.push(format!("left the region where the vector field is defined ({})", census.exits.len()));
    }
    if census.stuck > 0 {
        parts.push(format!("stopped because the step size became too small ({})", census.stuck));
    }
    if census.chattered > 0 {
        let count = census.chattered;
        parts.push(format!("ended in chatter, where impacts accumulate and sustained contact follows ({count})"));
    }
    if census.left > 0 {
        parts.push(format!("not needed ({})", census.left));
    }
    format!("outcome of the samples: {}", parts.join(", "))
}

/// Message that no attractor matches a key, with what was found instead and what to do.
pub(super) fn missing(system: &System, seed: &SeedPlan, census: &Census, key: &AttractorKey) -> String {
    let wanted = match key {
        AttractorKey::Equilibrium => "no stable equilibrium".to_string(),
        AttractorKey::Cycle => "no stable cycle".to_string(),
        AttractorKey::Ratio(p, q) => format!("no stable {p}:{q} cycle"),
        AttractorKey::Lasting(1) if system.field.iterated() => "no fixed point, stable or unstable,".to_string(),
        AttractorKey::Lasting(count) if system.field.iterated() => {
            format!("no cycle of {count} iterates, stable or unstable,")
        }
        AttractorKey::Lasting(periods) => format!("no stable cycle of {periods} forcing periods"),
    };
    let all_escaped = census.attractors.is_empty() && census.unsettled == 0 && census.escaped > 0;
    // If any sample settled to what is sought, the fate of the others is not the cause.
    let none = census.attractors.is_empty();
    let rest_only =
        *key != AttractorKey::Equilibrium && census.attractors.iter().all(|a| a.point.solution.period().is_none());
    let (stuck, unsettled) = (census.stuck > 0, (none || rest_only) && census.unsettled > 0);
    let exit = census.exits.first().filter(|_| none);
    let oscillates = |a: &Attractor| a.point.solution.period().is_some();
    let instead = match key {
        _ if none => None,
        AttractorKey::Equilibrium => census.attractors.iter().all(oscillates).then_some(Instead::Oscillation),
        AttractorKey::Cycle if !system.field.forced() => rest_only.then_some(Instead::Rest),
        _ => None,
    };
    let why = of_no_start(
        system,
        &seed.parameters,
        Seen { state: None, stuck, all_escaped, exit, unsettled, repeats: false, instead },
    );
    let unnamed = census.attractors.iter().any(|a| a.point.solution.period().is_some() && a.ratio.is_none());
    let single = match key {
        AttractorKey::Ratio(..) if unnamed && system.whirl.is_some() => {
            "; a cycle without a ratio is a single whirl with its harmonics: select it with attractor = \"cycle\""
        }
        _ => "",
    };
    format!("{wanted} was found; {}{single}{why}", summary(system, census))
}
