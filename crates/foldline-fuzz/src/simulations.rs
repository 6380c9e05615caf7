//! Simulations of random models: no behaviour of a trajectory is an error.

use crate::formula::Formula;
use arbitrary::{Result, Unstructured};
use foldline::contract::Unobserved;
use foldline::diagram::{Diagram, Motion};
use foldline::explore::{self, System};
use foldline_store::study_file::parse_study;

/// Number of states of a model: the smallest for which oscillations are possible.
const STATES: usize = 2;
/// Number of starts of a survey. Small, so that many models run in little time.
const STARTS: usize = 3;
/// Number of parameter values of surveys and sweeps: the smallest for a sweep.
const VALUES: usize = 2;

/// Counts of the outcomes, so that a test can require some of each.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen {
    /// Number of models run: autonomous, forced.
    pub run: [usize; 2],
    /// Number of starts of surveys that settled to an equilibrium or a cycle.
    pub settled: usize,
    /// Number of starts of surveys that escaped.
    pub escaped: usize,
    /// Number of sweeps that were started.
    pub swept: usize,
}

/// Simulates a random model by survey, sweep and sampling of initial conditions. Every start of a survey must be
/// accounted for at every value, and a sweep whose seed was found must extend to its last value unless the motion
/// escapes.
pub fn simulation(u: &mut Unstructured, seen: &mut Seen) -> Result<()> {
    let forced: bool = u.arbitrary()?;
    let model = model(u, forced)?;
    let study = format!(
        "model = \"m.toml\"\n[[seed]]\nname = \"given\"\nstate = {{ x0 = 0.3, x1 = 0.1 }}\n\
         [[seed]]\nname = \"sampled\"\nattractor = \"cycle\"\nsamples = {STARTS}\n\
         [[survey]]\nname = \"survey\"\nfree = \"p\"\nrange = [0.1, 0.6]\ncount = {VALUES}\nstarts = {STARTS}\n\
         [[sweep]]\nname = \"from given\"\nfrom = \"given\"\nfree = \"p\"\nrange = [0.1, 0.6]\ncount = {VALUES}\n\
         [[sweep]]\nname = \"from sampled\"\nfrom = \"sampled\"\nfree = \"p\"\nrange = [0.1, 0.6]\ncount = {VALUES}\n"
    );
    // A model that is finite nowhere is rejected.
    let Ok(study) = parse_study(&study, "s.toml", &model, "m.toml") else { return Ok(()) };
    seen.run[usize::from(forced)] += 1;
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    let survey = diagram.response_set("survey").unwrap_or_else(|| panic!("no survey of\n{model}"));
    let hits: usize = survey.responses.iter().map(|response| response.hits).sum();
    assert_eq!(hits, STARTS * VALUES, "starts of\n{model}");
    for response in &survey.responses {
        match response.motion {
            Motion::Escaped | Motion::Chatter => seen.escaped += response.hits,
            Motion::Equilibrium | Motion::Cycle => seen.settled += response.hits,
            Motion::Torus | Motion::Chaos | Motion::Other => {}
        }
    }
    for name in ["from given", "from sampled"] {
        let Some(sweep) = diagram.response_set(name) else { continue };
        seen.swept += 1;
        let escaped = sweep.responses.last().is_some_and(|last| last.motion.is_lost());
        assert!(escaped || sweep.responses.len() == VALUES, "{name} of\n{model}");
    }
    let parameters = study.model.defaults();
    let census = explore::attractors(&system, &parameters, STARTS, 1, 1, study.plan.tolerance);
    let hits: usize = census.attractors.iter().map(|attractor| attractor.hits).sum();
    let lost = census.escaped + census.exits.len() + census.stuck + census.chattered + census.unsettled + census.left;
    assert_eq!(hits + lost, STARTS, "samples of\n{model}");
    Ok(())
}

/// Returns the text of a random model; half of the models are damped oscillators with a random force.
fn model(u: &mut Unstructured, forced: bool) -> Result<String> {
    let oscillator = u.arbitrary()?;
    let name = |i: usize| ["x0", "x1", "p", "cos(w*t)"][i].to_string();
    let names = if forced { 4 } else { 3 };
    let mut equations = Vec::new();
    for i in 0..STATES {
        let mut text = String::new();
        Formula::random(u, names, 3)?.write(u, &name, &mut text)?;
        equations.push(match (oscillator, i) {
            (false, _) => text,
            (true, 0) => "x1".to_string(),
            (true, _) => format!("-0.3*x1 - x0 + 0.5*({text})"),
        });
    }
    let forcing = if forced { "[forcing]\nfrequency = \"w\"\n" } else { "" };
    let [f, g] = [&equations[0], &equations[1]];
    Ok(format!("[parameters]\np = 0.2\nw = 1.3\n{forcing}[states]\nx0 = \"{f}\"\nx1 = \"{g}\"\n"))
}
