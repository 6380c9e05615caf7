//! Chain of coupled van der Pol oscillators of any length.
//!
//! **Equations.** N oscillators, n = 2N states, free ends (x₀ = x₁, x_{N+1} = x_N):
//!
//!   (1)  x_i'' - μ (1 - x_i²) x_i' + (1 + δ i/N) x_i = c (x_{i+1} - 2 x_i + x_{i-1}),   i = 1…N
//!
//! The detuning δ makes the oscillators different; the coupling c synchronises them. benches/auto/chain.f90 has the
//! same equations.

use crate::Outcome;
use foldline::contract::Unobserved;
use foldline::diagram::{Diagram, Point};
use foldline::explore::{self, BranchPlan, Plan, SeedPlan, SeedSource, Start, Switching, System};
use foldline::model::Model;
use foldline_store::model_file::parse_model;

/// Values of μ, c, δ.
pub const PARAMETERS: [(&str, f64); 3] = [("mu", 1.0), ("c", 0.5), ("delta", 0.1)];

/// Returns the chain as a model text.
fn text(oscillators: usize) -> String {
    let mut text = format!("name = \"chain of {oscillators}\"\n[parameters]\n");
    PARAMETERS.iter().for_each(|(name, value)| text.push_str(&format!("{name} = {value:?}\n")));
    text.push_str("[states]\n");
    for i in 1..=oscillators {
        let neighbours = [(i > 1).then(|| i - 1), (i < oscillators).then(|| i + 1)];
        let pull: String = neighbours.into_iter().flatten().map(|k| format!(" + c*(x{k} - x{i})")).collect();
        text.push_str(&format!("x{i} = \"y{i}\"\n"));
        text.push_str(&format!("y{i} = \"mu*(1 - x{i}^2)*y{i} - (1 + delta*{i}/{oscillators})*x{i}{pull}\"\n"));
    }
    text
}

/// Returns the chain with n states.
pub fn model(states: usize) -> Outcome<Model> {
    parse_model(&text(states / 2), "chain.toml")
        .map_err(|found| found.iter().map(|d| d.to_string()).collect::<Vec<_>>().join("\n").into())
}

/// Returns the plan of its branch in μ from 1 to `until`, with at most `points` points.
pub fn plan(model: &Model, until: f64, points: usize) -> Plan {
    let parameters = model.defaults();
    let state = (0..model.states.len()).map(|i| if i % 2 == 0 { 2.0 } else { 0.0 }).collect();
    let seed = SeedPlan { name: "locked".into(), source: SeedSource::State(state), parameters, samples: 1, random: 1 };
    let branch = BranchPlan {
        holds: Default::default(),
        name: "locked".into(),
        start: Start::Seed(0),
        free: 0,
        range: [1.0, until],
        until: Some(until),
        switching: Switching::default(),
        marks: Vec::new(),
        max_points: points,
    };
    Plan {
        tolerance: 1e-6,
        degree: 4,
        limits: Default::default(),
        simulation: foldline::attractors::Limits::patient(),
        seeds: vec![seed],
        branches: vec![branch],
        curves: Vec::new(),
        homotopies: Vec::new(),
        explorations: Vec::new(),
        surveys: Vec::new(),
        sweeps: Vec::new(),
        designs: Vec::new(),
        maps: Vec::new(),
        record: Vec::new(),
    }
}

/// Returns the synchronised cycle at μ = 1.
pub fn cycle(model: &Model, system: &System) -> Outcome<Point> {
    let diagram = explore::run(system, &plan(model, 2.0, 0), 1, Diagram::default(), &Unobserved);
    let branch = diagram.branches.first().ok_or("the chain has no branch")?;
    branch.points.first().cloned().ok_or_else(|| format!("the chain does not settle: {:?}", branch.ends).into())
}
