//! Claims decided by the simulations of figure 9: that they find the motions on the branches, and no others.

use super::rotor::{OMEGA, speeds};
use crate::agreement::{Agreement, Met, Seen, Stable, compare};
use crate::claims::{Claim, Finding};
use crate::runs::Run;
use foldline::diagram::{Kind, Motion, Responses, Search};

const FIGURE: &str = "9";
const DL: &str = "contact DL";

/// True if a motion lies on DL or on a branch that arises from it by period doubling.
fn on_dl(met: &Met) -> bool {
    met.on().is_some_and(|place| place.branch.starts_with(DL))
}

/// Survey and sweeps, compared with the branches.
pub struct Simulated {
    /// Survey from many starts.
    pub survey: Agreement,
    /// DL swept up.
    pub up: Agreement,
    /// DL swept down.
    pub down: Agreement,
    /// DL at the first speed at which each sweep, up and down, has left it: evidence on its attraction there.
    pub left: [Vec<Stable>; 2],
    /// Number of starts at each speed of the survey.
    pub starts: usize,
    /// Number of speeds of the survey.
    pub speeds: usize,
}

impl Simulated {
    /// Compares the simulations of `run` with the branches of `followed`, the first of which holds S, SL and DL.
    ///
    /// # Errors
    /// A simulation is missing.
    pub fn of(run: &Run, followed: &[&Run], jobs: usize) -> Result<Simulated, String> {
        let first = followed.get(..1).unwrap_or_default();
        let swept = |name: &str| Ok::<_, String>(compare(run, run.responses(name)?, first, jobs));
        let (up, down) = (swept("DL up")?, swept("DL down")?);
        let left = [&up, &down].map(|sweep| {
            let responses = sweep.met.iter().find(|m| !on_dl(m)).map(|m| m.motion.clone()).into_iter().collect();
            let set = Responses { name: String::new(), search: Search::Survey, free: OMEGA, responses };
            let stable = compare(run, &set, first, jobs).stable.into_iter();
            stable.filter(|s| s.branch.starts_with(DL)).collect()
        });
        let plan = run.study.plan.surveys.first();
        Ok(Simulated {
            survey: compare(run, run.responses("what attracts")?, followed, jobs),
            up,
            down,
            left,
            starts: plan.map_or(0, |plan| plan.starts),
            speeds: plan.map_or(0, |plan| plan.values.len()),
        })
    }

    /// Stable solutions reached only from a nearby start, not by the survey.
    pub fn missed(&self) -> impl Iterator<Item = &Stable> {
        self.survey.stable.iter().filter(|stable| stable.seen == Seen::FromNearby)
    }
}

/// Claims decided by the simulations; `run` holds the branches.
pub fn claims(run: &Run, simulated: &Simulated) -> Vec<Claim> {
    let mut claims = vec![explained(simulated)];
    claims.extend(parts(&simulated.survey));
    let end = |kind: Kind, name: &str| {
        let places = speeds(run, &run.special(name, kind)?);
        Ok(places.iter().map(|[at, _]| *at).fold(f64::NAN, f64::max))
    };
    let deepest = "contact DL/period-doubling-1/period-doubling-1";
    let [up, down] = &simulated.left;
    claims.push(fall("up", &simulated.up.met, up, "the fold of DL", end(Kind::Fold, DL)));
    let doubling = "the period doubling of its cycles of four times the period";
    claims.push(fall("down", &simulated.down.met, down, doubling, end(Kind::PeriodDoubling, deepest)));
    claims
}

/// Claim that every motion found lies on a stable part of a branch.
fn explained(simulated: &Simulated) -> Claim {
    let met = &simulated.survey.met;
    let holds: Vec<bool> = met.iter().map(Met::is_explained).collect();
    let count = holds.iter().filter(|h| **h).count();
    let farthest = met.iter().filter(|m| m.is_explained()).filter_map(|m| Some(m.on()?.apart)).fold(0.0, f64::max);
    let late = met.iter().filter(|m| m.followed > 0).count();
    let unsettled = met.iter().filter(|m| m.motion.motion == Motion::Other).count();
    let mut note = format!(
        "{} starts at each of {} speeds; farthest from its branch: {farthest:.2} of what the errors of both allow; {late} were \
         followed on, as they had not settled, and {unsettled} of them did not settle then",
        simulated.starts, simulated.speeds
    );
    let others = simulated.survey.unexplained();
    if !others.is_empty() {
        note.push_str(&format!(". Met by simulation, not among the branches: {}", others.join("; ")));
    }
    let ours = format!("{count} of {} motions", holds.len());
    // A motion on no branch shows that further families exist, not that simulation and branches disagree.
    let finding = match count == holds.len() {
        true => Finding::cases(&holds, ours),
        false => Finding::qualified(2 * count > holds.len(), ours),
    };
    let finding = finding.noting(note);
    Claim::check(
        FIGURE,
        "Every motion that simulation from many starts meets lies on a stable part of a branch",
        "yes",
        Ok(finding),
    )
}

/// Claims, one per branch, that its stable solutions are found by the survey.
fn parts(survey: &Agreement) -> Vec<Claim> {
    let mut names: Vec<&str> = survey.stable.iter().map(|s| s.branch.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let claim = |name: &str| {
        let own: Vec<&Stable> = survey.stable.iter().filter(|s| s.branch == name).collect();
        let decided = own.iter().filter(|s| s.seen != Seen::Unsettled);
        let holds: Vec<bool> = decided.map(|s| s.seen != Seen::Never).collect();
        let hits = own.iter().map(|s| if let Seen::Sampled(hits) = s.seen { hits } else { 0 });
        let (sampled, beside) = (
            own.iter().filter(|s| matches!(s.seen, Seen::Sampled(_))).count(),
            own.iter().filter(|s| s.seen == Seen::FromNearby).count(),
        );
        let [low, high] = own.iter().fold([f64::MAX, f64::MIN], |[low, high], s| [low.min(s.value), high.max(s.value)]);
        let ours = format!(
            "{} solutions at Ω = {low:.2} to {high:.2}: {sampled} met by sampling ({} starts), {beside} from beside them only",
            own.len(),
            hits.sum::<usize>()
        );
        let speeds = |seen: Seen| {
            let at = own.iter().filter(|s| s.seen == seen).map(|s| format!("{:.2}", s.value));
            at.collect::<Vec<String>>().join(", ")
        };
        let (never, open) = (speeds(Seen::Never), speeds(Seen::Unsettled));
        let mut notes = Vec::new();
        if !never.is_empty() {
            notes.push(format!("what starts beside it goes elsewhere at Ω = {never}"));
        }
        if !open.is_empty() {
            notes.push(format!("what starts beside it was not seen to repeat itself at Ω = {open}"));
        }
        let note = notes.join("; ");
        let statement = format!("Simulation meets the stable part of {name} at every speed sampled");
        Claim::check(FIGURE, statement, "yes", Ok(Finding::cases(&holds, ours).noting(note)))
    };
    names.into_iter().map(claim).collect()
}

/// Claim on the speed at which a sweep leaves DL, against the end of DL. The sweep may leave earlier, if a step of the
/// speed leads out of a narrowing basin; DL at the new speed then still attracts nearby starts. It cannot stay longer.
fn fall(direction: &str, met: &[Met], left: &[Stable], what: &str, end: Result<f64, String>) -> Claim {
    let finding = || {
        let end = end?;
        let last = met.iter().take_while(|m| on_dl(m)).last().ok_or("the sweep does not begin on DL")?;
        let first = met.iter().find(|m| !on_dl(m)).ok_or("the sweep does not leave DL")?;
        let [from, to] = [last, first].map(|m| m.motion.parameters[OMEGA]);
        let passes = (from - end) * (to - end) <= 0.0;
        let thrown = !left.is_empty() && left.iter().all(|s| s.seen == Seen::FromNearby);
        let early = (end - to) * (to - from) > 0.0 && (end - to).abs() <= 2.0 * (to - from).abs() && thrown;
        let where_to = first.on().map_or("no branch".to_string(), |place| place.branch.replace("contact ", ""));
        let ours = format!("between Ω = {from:.4} and {to:.4}, to {where_to}");
        let mut note = format!("{what} lies at {end:.5}");
        if early {
            note.push_str(
                "; the last step of the speed leads out of the basin, as DL still attracts what starts beside it",
            );
        }
        Ok(Finding::qualified(passes || early, ours).within((to - from).abs()).noting(note))
    };
    Claim::decided(
        FIGURE,
        format!("A sweep {direction} follows DL to the end of its stable part, and jumps"),
        "yes",
        finding(),
    )
}
