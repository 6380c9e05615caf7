//! Memory used by a branch of 100,000 points written to a run file.

use crate::report::{Table, digits, time};
use crate::workplace::Workplace;
use crate::{Outcome, child};

/// Measures one branch with 1,000, 10,000 and 100,000 points.
pub fn long_branch(place: &Workplace) -> Outcome<String> {
    let out = place.scratch("stream")?;
    let mut table = Table::new(&["points", "largest resident memory", "processor time", "run file"]);
    let mut memory = Vec::new();
    let text = std::fs::read_to_string(place.study("benches/studies/long.toml"))?;
    let model = place.study("models/stuart-landau.toml");
    for points in [1_000, 10_000, 100_000] {
        if place.quick && points > 10_000 {
            continue;
        }
        let study = out.join(format!("{points}.toml"));
        let own = text.replace("max-points = 1", &format!("max-points = {points}"));
        std::fs::write(&study, own.replace("../../models/stuart-landau.toml", &model.to_string_lossy()))?;
        let folder = out.join(points.to_string());
        let arguments = ["run", &study.to_string_lossy(), "--jobs", "1", "--out", &folder.to_string_lossy()];
        // The branch ends at the limit on points: exit code 3.
        let (usage, _) = child::run(&place.foldline(), &arguments, &place.root, &[3])?;
        let size = std::fs::metadata(folder.join("run.sqlite"))?.len() as f64 * 1e-6;
        table.row(&[
            points.to_string(),
            format!("{} MB", digits(usage.memory)),
            time(usage.cpu),
            format!("{} MB", digits(size)),
        ]);
        memory.push((points as f64, usage.memory));
    }
    let growth = match (memory.first(), memory.last()) {
        (Some(a), Some(b)) => 1e6 * (b.1 - a.1) / (b.0 - a.0),
        _ => f64::NAN,
    };
    Ok(format!(
        "`foldline run` of cycles of the Stuart–Landau model in one parameter, ended by the limit of points.\n\n{}\nMemory \
         grows by {growth:.0} bytes a point.\n",
        table.text()
    ))
}
