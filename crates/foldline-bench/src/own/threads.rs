//! Speed-up by two threads.

use crate::report::{Table, digits, time};
use crate::workplace::Workplace;
use crate::{Outcome, child, clock, rotor};

/// Study with eighteen branches, including curves in two parameters.
const FLOWS: &str = "crates/foldline-reproduce/studies/akay2022/flows.toml";

/// Measures two studies with one and with two jobs.
pub fn two(place: &Workplace) -> Outcome<String> {
    let head = ["study", "jobs", "wall time, best", "wall time, median", "processor time, median"];
    let (mut table, mut gains) = (Table::new(&head), Vec::new());
    for study in [rotor::FIGURE_7, FLOWS] {
        let usages = in_turn(place, study)?;
        let wall = |usages: &[child::Usage]| usages.iter().map(|u| u.wall).collect::<Vec<f64>>();
        for (jobs, usages) in usages.iter().enumerate() {
            let cpu: Vec<f64> = usages.iter().map(|u| u.cpu).collect();
            let cells = [clock::least(&wall(usages)), clock::median(&wall(usages)), clock::median(&cpu)].map(time);
            table.row(&[&[study.to_string(), (jobs + 1).to_string()], &cells[..]].concat());
        }
        let ratios: Vec<f64> = usages[0].iter().zip(&usages[1]).map(|(one, two)| one.wall / two.wall).collect();
        let best = clock::least(&wall(&usages[0])) / clock::least(&wall(&usages[1]));
        gains.push(format!(
            "{} (median of the ratios; {} by the best times)",
            digits(clock::median(&ratios)),
            digits(best)
        ));
    }
    Ok(format!(
        "On a machine that is busy with something else this says little.\n\n{}\nFigure 7 is {} times as fast with two threads, the \
         study of more branches {}; target 1.7.\n",
        table.text(),
        gains[0],
        gains[1]
    ))
}

/// Runs a study with one job and with two jobs alternately, for the number of repetitions of the benchmark.
fn in_turn(place: &Workplace, study: &str) -> Outcome<[Vec<child::Usage>; 2]> {
    let out = place.scratch("threads")?;
    let path = place.study(study);
    let mut usages = [Vec::new(), Vec::new()];
    for k in 0..place.repetitions() {
        for jobs in [1, 2] {
            let (jobs_text, folder) = (jobs.to_string(), out.join(format!("{jobs}-{k}")));
            let (path, folder) = (path.to_string_lossy(), folder.to_string_lossy());
            let arguments = ["run", &path, "--jobs", &jobs_text, "--out", &folder];
            usages[jobs - 1].push(child::run(&place.foldline(), &arguments, &place.root, &[])?.0);
        }
    }
    Ok(usages)
}
