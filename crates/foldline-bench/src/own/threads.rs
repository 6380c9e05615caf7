//! Two threads against one.

use crate::report::{Table, digits, time};
use crate::workplace::Workplace;
use crate::{Outcome, child, clock, rotor};

/// Figure 7 with one and with two jobs in turn.
pub fn two(place: &Workplace) -> Outcome<String> {
    let out = place.scratch("threads")?;
    let study = place.study(rotor::FIGURE_7);
    let mut table = Table::new(&["jobs", "wall time, best", "wall time, median", "processor time, median"]);
    let mut usages: [Vec<child::Usage>; 2] = [Vec::new(), Vec::new()];
    for k in 0..place.repetitions() {
        for jobs in [1, 2] {
            let (jobs_text, folder) = (jobs.to_string(), out.join(format!("{jobs}-{k}")));
            let (study, folder) = (study.to_string_lossy(), folder.to_string_lossy());
            let arguments = ["run", &study, "--jobs", &jobs_text, "--out", &folder];
            usages[jobs - 1].push(child::run(&place.foldline(), &arguments, &place.root, &[])?.0);
        }
    }
    for (jobs, usages) in usages.iter().enumerate() {
        let wall: Vec<f64> = usages.iter().map(|u| u.wall).collect();
        let cpu: Vec<f64> = usages.iter().map(|u| u.cpu).collect();
        let cells = [clock::least(&wall), clock::median(&wall), clock::median(&cpu)].map(time);
        table.row(&[&[(jobs + 1).to_string()], &cells[..]].concat());
    }
    let ratios: Vec<f64> = usages[0].iter().zip(&usages[1]).map(|(one, two)| one.wall / two.wall).collect();
    let best = |usages: &[child::Usage]| clock::least(&usages.iter().map(|u| u.wall).collect::<Vec<_>>());
    Ok(format!(
        "Figure 7, wall time: on a machine that is busy with something else this says little.\n\n{}\nTwo threads are {} \
         times as fast (median of the ratios), {} by the best times.\n",
        table.text(),
        digits(clock::median(&ratios)),
        digits(best(&usages[0]) / best(&usages[1]))
    ))
}
