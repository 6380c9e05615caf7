//! Response time of a query on a finished run.

use crate::report::{Table, time};
use crate::workplace::Workplace;
use crate::{Outcome, child, clock, rotor};

/// Measures `foldline table` on the run of figure 7.
pub fn table(place: &Workplace) -> Outcome<String> {
    let out = place.scratch("startup")?;
    let folder = out.join("run").to_string_lossy().into_owned();
    let study = place.study(rotor::FIGURE_7);
    child::run(&place.foldline(), &["run", &study.to_string_lossy(), "--out", &folder], &place.root, &[])?;
    let mut table = Table::new(&["command", "processor time, best", "median", "wall time, best", "median"]);
    for what in ["--special", "--branches", "--notes", "--points"] {
        let mut usages = Vec::new();
        for _ in 0..5 * place.repetitions() {
            usages.push(child::run(&place.foldline(), &["table", &folder, what], &place.root, &[])?.0);
        }
        let cpu: Vec<f64> = usages.iter().map(|u| u.cpu).collect();
        let wall: Vec<f64> = usages.iter().map(|u| u.wall).collect();
        let cells = [&cpu, &wall].map(|v| [clock::least(v), clock::median(v)]).concat();
        let cells: Vec<String> = cells.into_iter().map(time).collect();
        table.row(&[&[format!("`foldline table {what}`")], &cells[..]].concat());
    }
    Ok(format!("On the run of figure 7, the start of the process included.\n\n{}", table.text()))
}
