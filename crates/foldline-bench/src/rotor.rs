//! Overhung rotor and its first cycles, shared by all parts.

use crate::Outcome;
use crate::workplace::Workplace;
use foldline::contract::{Unobserved, ZeroProblem};
use foldline::diagram::{Branch, Diagram, Mesh, Point, Solution};
use foldline::explore::growth::{polished, problem_of, setting, settings};
use foldline::explore::{self, Plan, Switching, System};
use foldline::problem::cycle::CycleProblem;
use foldline_store::study_file::{Study, read_study};

/// Study of figure 7.
pub const FIGURE_7: &str = "studies/overhung-rotor/bouncing.toml";
/// Study of the single loop of the cubic rotor from Ω = 5 to 10.
pub const SINGLE_LOOP: &str = "benches/studies/cubic-single-loop.toml";
/// Index of the parameter Ω.
pub const OMEGA: usize = 0;

/// Reads a study of the repository.
pub fn study(place: &Workplace, name: &str) -> Outcome<Study> {
    read_study(&place.study(name)).map_err(|found| {
        let lines: Vec<String> = found.iter().map(|diagnostic| diagnostic.to_string()).collect();
        lines.join("\n").into()
    })
}

/// Returns the diagram of an interrupted run with only the first point of every branch that starts at a seed. A run
/// that continues from it samples no attractors.
pub fn beginnings(study: &Study) -> Diagram {
    beginnings_at(study, study.plan.tolerance)
}

/// Returns the first points with accuracy `tolerance`. A closed branch does not close at a start that is less accurate
/// than the branch itself.
pub fn beginnings_at(study: &Study, tolerance: f64) -> Diagram {
    let mut plan = Plan { tolerance, ..study.plan.clone() };
    for branch in &mut plan.branches {
        (branch.max_points, branch.switching) = (0, Switching::default());
    }
    let mut diagram = run(study, &plan, Diagram::default());
    diagram.branches.iter_mut().for_each(|branch| branch.ends = [None, None]);
    diagram
}

/// Runs a plan on one thread.
pub fn run(study: &Study, plan: &Plan, earlier: Diagram) -> Diagram {
    explore::run(&System::of_plan(&study.model, plan), plan, 1, earlier, &Unobserved)
}

/// Returns the first point of a branch.
pub fn first(branch: &Branch) -> Outcome<&Point> {
    let first = branch.points.iter().find(|point| point.position == 0);
    first.ok_or_else(|| format!("{} has no first point", branch.name).into())
}

/// Returns the largest value of the first output.
pub fn r_max(point: &Point, states: usize) -> f64 {
    point.ranges.get(states).map_or(f64::NAN, |range| range[1])
}

/// Recomputes a cycle at the same parameters with accuracy `tolerance`.
pub fn refined(system: &System, point: &Point, tolerance: f64) -> Outcome<Point> {
    let settings = settings(system, tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
    let mut problem = problem_of(system, OMEGA, 4, point, false);
    let found = polished(&mut *problem, &settings, point).map_err(|why| why.to_string())?;
    Ok(found.point)
}

/// Transfers a cycle to another mesh. Returns the boundary-value problem on that mesh, with the free parameter `free`,
/// and its unknowns.
pub fn on_mesh<'a>(
    system: &'a System,
    point: &Point,
    free: usize,
    mesh: &Mesh,
) -> Outcome<(CycleProblem<'a>, Vec<f64>)> {
    let Solution::Cycle(cycle) = &point.solution else { return Err("no cycle".into()) };
    let mut problem = CycleProblem::new(setting(system, free, &point.parameters), cycle.degree, &cycle.mesh);
    let u = problem.unknowns_of(point);
    let u = problem.transfer(&u, &cycle.mesh, mesh);
    problem.set_mesh(mesh);
    problem.anchor(&u);
    Ok((problem, u))
}
