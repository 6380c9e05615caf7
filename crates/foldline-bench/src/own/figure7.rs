//! Figure 7 as a whole, and the single loop of the cubic rotor.

use crate::report::{Table, digits, time};
use crate::workplace::Workplace;
use crate::{Outcome, child, clock, rotor};
use foldline::contract::ZeroProblem;
use foldline::diagram::{Diagram, Solution};
use foldline::explore::System;
use foldline_store::run_file;
use foldline_store::study_file::Study;
use std::hint::black_box;
use std::path::Path;
use std::process::Command;

/// Measures time, instructions, memory and work of the study on one thread.
pub fn whole(place: &Workplace) -> Outcome<String> {
    let out = place.scratch("figure7")?;
    let study = place.study(rotor::FIGURE_7);
    let mut usages = Vec::new();
    for k in 0..place.repetitions() {
        let folder = out.join(k.to_string());
        let arguments =
            [&*study.to_string_lossy(), "--jobs", "1", "--out", &folder.to_string_lossy()].map(String::from);
        let arguments: Vec<&str> = std::iter::once("run").chain(arguments.iter().map(String::as_str)).collect();
        usages.push(child::run(&place.foldline(), &arguments, &place.root, &[])?.0);
    }
    let all = |value: fn(&child::Usage) -> f64| usages.iter().map(value).collect::<Vec<f64>>();
    let (cpu, wall, memory) = (all(|u| u.cpu), all(|u| u.wall), all(|u| u.memory));
    let diagram = run_file::load(&out.join("0"))?.diagram;

    // The parts alone, in this process.
    let study = rotor::study(place, rotor::FIGURE_7)?;
    let starts = rotor::beginnings(&study);
    let again = || 0..place.repetitions().min(5);
    let sampled: Vec<f64> = again().map(|_| clock::timed(|| rotor::beginnings(&study)).0).collect();
    let branches: Vec<f64> =
        again().map(|_| clock::timed(|| rotor::run(&study, &study.plan, starts.clone())).0).collect();
    let parts = again().map(|_| repeated(&study, &diagram)).collect::<Outcome<Vec<[f64; 2]>>>()?;
    let part = |which: usize| parts.iter().map(|part| part[which]).collect::<Vec<f64>>();

    let mut table = Table::new(&["one thread", "best", "median"]);
    let row = |name: &str, values: &[f64]| [name.to_string(), time(clock::least(values)), time(clock::median(values))];
    table.row(&row("processor time of `foldline run --jobs 1`", &cpu));
    table.row(&row("wall time of the same", &wall));
    table.row(&row("processor time of the first solutions alone", &sampled));
    table.row(&row("processor time of the branches alone, first solutions given, nothing stored", &branches));
    table.row(&row(
        "of Newton's method alone: as many residuals, factorisations and solutions, for steps and special points, on the mesh of every cycle",
        &part(0),
    ));
    table.row(&row("of the examination of every cycle alone: multipliers, errors, ranges, once each", &part(1)));
    table.row(&["largest resident memory".to_string(), format!("{} MB", digits(clock::median(&memory)))]);
    table.row(&["instructions".to_string(), instructions(place, &out)?]);
    let special: usize = diagram.branches.iter().map(|branch| branch.special.len()).sum();
    Ok(format!("{}\n{special} special points.\n\n{}", table.text(), work(&diagram)))
}

/// Returns the processor times in seconds of the indispensable work for every cycle of a diagram: the residuals,
/// factorisations and solutions that its counters state, on its own mesh (some were on finer ones), and one
/// examination.
fn repeated(study: &Study, diagram: &Diagram) -> Outcome<[f64; 2]> {
    let system = System::of_plan(&study.model, &study.plan);
    let mut total = [0.0; 2];
    for (branch, point) in diagram.branches.iter().flat_map(|b| b.points.iter().map(move |point| (b, point))) {
        let Solution::Cycle(cycle) = &point.solution else { continue };
        let (mut problem, u) = rotor::on_mesh(&system, point, branch.free, &cycle.mesh)?;
        let (mut r, mut du, mut row) = (vec![0.0; u.len()], vec![0.0; u.len()], vec![0.0; u.len()]);
        row[u.len() - 1] = 1.0;
        total[0] += clock::timed(|| {
            for _ in 0..point.cost.factorisations {
                // Near a fold the matrix with this row is nearly singular, but its factorisation takes as long.
                let _ = black_box(problem.factorise(&u, &row));
            }
            for _ in 0..point.cost.newton {
                black_box(problem.residual(&u, &mut r));
                problem.solve(&r, black_box(&mut du));
            }
        })
        .0;
        // A first point has no counters, so its matrix may not have been factorised yet.
        let _ = problem.factorise(&u, &row);
        total[1] += clock::timed(|| {
            let found = problem.examine(&u);
            black_box(problem.spectrum_error(&u, &row, &found.spectrum));
        })
        .0;
    }
    Ok(total)
}

/// Returns a table of the counters of every branch.
pub fn work(diagram: &Diagram) -> String {
    let mut table = Table::new(&["branch", "points", "special", "Newton iterations", "factorisations", "rejected"]);
    let mut total = [0; 5];
    for branch in &diagram.branches {
        let cost = branch.cost();
        let counts = [branch.points.len(), branch.special.len(), cost.newton, cost.factorisations, cost.rejected];
        total.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
        table.row(&row_of(&branch.name, &counts));
    }
    table.row(&row_of("all", &total));
    table.text().to_string()
}

fn row_of(name: &str, counts: &[usize]) -> Vec<String> {
    std::iter::once(name.to_string()).chain(counts.iter().map(usize::to_string)).collect()
}

/// Counts the instructions of the whole run with callgrind.
fn instructions(place: &Workplace, out: &Path) -> Outcome<String> {
    if place.quick {
        return Ok("not counted".into());
    }
    let counts = out.join("callgrind.out");
    let ran = Command::new("valgrind")
        .args(["--tool=callgrind", &format!("--callgrind-out-file={}", counts.display())])
        .arg(place.foldline())
        .arg("run")
        .arg(place.study(rotor::FIGURE_7))
        .args(["--jobs", "1", "--out"])
        .arg(out.join("counted"))
        .output();
    let Ok(ran) = ran else { return Ok("not counted: valgrind is not installed".into()) };
    let complaint = String::from_utf8_lossy(&ran.stderr);
    let text = std::fs::read_to_string(&counts).unwrap_or_default();
    let total = text.lines().find_map(|line| line.strip_prefix("totals: "));
    match total.and_then(|line| line.split_whitespace().next()).and_then(|word| word.parse::<f64>().ok()) {
        Some(count) => Ok(format!("{} · 10⁹", digits(count * 1e-9))),
        None => Ok(format!("not counted: {}", complaint.lines().last().unwrap_or("valgrind failed"))),
    }
}

/// Measures the single loop of the cubic rotor between Ω = 5 and 10, from a given first cycle.
pub fn single_loop(place: &Workplace) -> Outcome<String> {
    let study = rotor::study(place, rotor::SINGLE_LOOP)?;
    let starts = rotor::beginnings(&study);
    let diagram = rotor::run(&study, &study.plan, starts.clone());
    let times: Vec<f64> = (0..3 * place.repetitions())
        .map(|_| clock::timed(|| rotor::run(&study, &study.plan, starts.clone())).0)
        .collect();
    let iterations = diagram.branches.first().map_or(0, |branch| branch.cost().newton);
    Ok(format!(
        "Processor time from a given first cycle, tolerance {:.0e}: best {}, median {}; {} per Newton iteration with all \
         that belongs to a branch.\n\n{}",
        study.plan.tolerance,
        time(clock::least(&times)),
        time(clock::median(&times)),
        time(clock::least(&times) / iterations.max(1) as f64),
        work(&diagram)
    ))
}
