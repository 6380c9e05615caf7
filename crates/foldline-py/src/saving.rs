//! Finished diagrams as run files.

use foldline::contract::{Event, Observer};
use foldline::diagram::{Branch, Diagram};
use foldline_store::run_file::{Recorder, RunFileError};
use foldline_store::study_file::Study;
use std::path::Path;

/// Writes a diagram into a folder without a run by replaying its events.
pub fn save(folder: &Path, study: &Study, diagram: &Diagram, notes: &[(String, String)]) -> Result<(), RunFileError> {
    let recorder = Recorder::create(folder, study)?;
    // Write errors are reported by `finish`.
    let tell = |event: Event| {
        recorder.observe(event);
    };
    diagram.branches.iter().for_each(|branch| branch_told(&tell, branch));
    notes.iter().for_each(|(about, note)| tell(Event::Note(about, note)));
    diagram.shortfalls.iter().for_each(|own| tell(Event::Short(&own.about, &own.what)));
    diagram.responses.iter().for_each(|set| tell(Event::Responses(set)));
    diagram.designs.iter().for_each(|design| tell(Event::Design(design)));
    diagram.cells.iter().enumerate().for_each(|(k, cell)| tell(Event::Mapped(cell, k + 1, diagram.cells.len())));
    recorder.complete()
}

fn branch_told(tell: &dyn Fn(Event), branch: &Branch) {
    let empty = Branch::new(&branch.name, branch.family, branch.free, branch.origin.clone());
    let (also, levels) = (branch.also.clone(), branch.levels.clone());
    tell(Event::Begin(&Branch { held: branch.held, also, levels, units: branch.units, ..empty }));
    branch.points.iter().for_each(|point| tell(Event::Point(branch, point)));
    branch.special.iter().for_each(|special| tell(Event::Special(branch, special)));
    for (side, ending) in branch.ends.iter().enumerate() {
        ending.iter().for_each(|ending| tell(Event::SideEnded(branch, side, ending)));
    }
}
