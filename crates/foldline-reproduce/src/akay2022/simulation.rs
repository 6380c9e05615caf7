//! What the simulations of figure 9 decide: whether they meet what was followed, and nothing else.

use super::rotor::{OMEGA, speeds};
use crate::agreement::{Agreement, Met, Seen, Stable, compare};
use crate::claims::{Claim, Finding};
use crate::runs::Run;
use foldline::diagram::{Kind, Motion};

const FIGURE: &str = "9";

/// The survey and the sweeps, compared with the branches.
pub struct Simulated {
    /// From many starts.
    pub survey: Agreement,
    /// DL swept up.
    pub up: Agreement,
    /// DL swept down.
    pub down: Agreement,
    /// Starts at each speed of the survey.
    pub starts: usize,
    /// Speeds of the survey.
    pub speeds: usize,
}

impl Simulated {
    /// Compares the simulations of `run` with the branches of `followed`.
    ///
    /// # Errors
    /// A simulation is not there.
    pub fn of(run: &Run, followed: &[&Run], jobs: usize) -> Result<Simulated, String> {
        let compared = |name: &str| Ok::<_, String>(compare(run, run.responses(name)?, followed, jobs));
        let plan = run.study.plan.surveys.first();
        Ok(Simulated {
            survey: compared("what attracts")?,
            up: compared("DL up")?,
            down: compared("DL down")?,
            starts: plan.map_or(0, |plan| plan.starts),
            speeds: plan.map_or(0, |plan| plan.values.len()),
        })
    }

    /// Stable solutions that no start of the survey reached, but one beside them did.
    pub fn missed(&self) -> impl Iterator<Item = &Stable> {
        self.survey.stable.iter().filter(|stable| stable.seen == Seen::FromNearby)
    }
}

/// What the simulations decide; `run` holds the branches.
pub fn claims(run: &Run, simulated: &Simulated) -> Vec<Claim> {
    let mut claims = vec![explained(simulated)];
    claims.extend(parts(&simulated.survey));
    let end = |kind: Kind, name: &str| {
        let places = speeds(&run.special(name, kind)?);
        Ok(places.iter().map(|[at, _]| *at).fold(f64::NAN, f64::max))
    };
    let deepest = "contact DL/period-doubling-1/period-doubling-1";
    claims.push(fall("up", &simulated.up.met, "the fold of DL", end(Kind::Fold, "contact DL")));
    let doubling = "the period doubling of its cycles of four times the period";
    claims.push(fall("down", &simulated.down.met, doubling, end(Kind::PeriodDoubling, deepest)));
    claims
}

/// Whether every motion that was met lies on a stable part of a branch.
fn explained(simulated: &Simulated) -> Claim {
    let met = &simulated.survey.met;
    let stable = |met: &Met| met.on.as_ref().is_some_and(|place| place.stable);
    let holds: Vec<bool> = met.iter().map(stable).collect();
    let count = holds.iter().filter(|h| **h).count();
    let farthest = met.iter().filter(|m| stable(m)).filter_map(|m| Some(m.on.as_ref()?.apart)).fold(0.0, f64::max);
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
    let finding = Finding::cases(&holds, ours).noting(note);
    Claim::decided(
        FIGURE,
        "Every motion that simulation from many starts meets lies on a stable part of a branch",
        "yes",
        Ok(finding),
    )
}

/// Whether the stable solutions of each branch are met, a claim for each branch.
fn parts(survey: &Agreement) -> Vec<Claim> {
    let mut names: Vec<&str> = survey.stable.iter().map(|s| s.branch.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let claim = |name: &str| {
        let own: Vec<&Stable> = survey.stable.iter().filter(|s| s.branch == name).collect();
        let holds: Vec<bool> = own.iter().map(|s| s.seen != Seen::Never).collect();
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
        let never: Vec<String> =
            own.iter().filter(|s| s.seen == Seen::Never).map(|s| format!("{:.2}", s.value)).collect();
        let note = if never.is_empty() { String::new() } else { format!("not met at Ω = {}", never.join(", ")) };
        let statement = format!("Simulation meets the stable part of {name} at every speed sampled");
        Claim::decided(FIGURE, statement, "yes", Ok(Finding::cases(&holds, ours).noting(note)))
    };
    names.into_iter().map(claim).collect()
}

/// Where a sweep leaves DL, against where DL ends.
fn fall(direction: &str, met: &[Met], what: &str, end: Result<f64, String>) -> Claim {
    let finding = || {
        let end = end?;
        let on = |met: &Met| met.on.as_ref().is_some_and(|place| place.branch.starts_with("contact DL"));
        let last = met.iter().take_while(|m| on(m)).last().ok_or("the sweep does not begin on DL")?;
        let first = met.iter().find(|m| !on(m)).ok_or("the sweep does not leave DL")?;
        let speed = |met: &Met| met.motion.parameters[OMEGA];
        let [low, high] = [speed(last).min(speed(first)), speed(last).max(speed(first))];
        let to = first.on.as_ref().map_or("no branch".to_string(), |place| place.branch.replace("contact ", ""));
        let ours = format!("between Ω = {low:.4} and {high:.4}, to {to}");
        let note = format!("{what} lies at {end:.5}");
        Ok(Finding::qualified((low..=high).contains(&end), ours).within(high - low).noting(note))
    };
    Claim::decided(
        FIGURE,
        format!("A sweep {direction} follows DL until its stable part ends, and jumps"),
        "yes",
        finding(),
    )
}
