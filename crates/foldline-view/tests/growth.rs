//! A run is shown while it grows, and its file is left unchanged.

use crate::common::{PATIENCE, Served, run_in, study};
use foldline::contract::{Event, Observer};
use foldline::diagram::{Branch, Diagram, Ending};
use foldline_store::run_file::{Part, Recorder, is_written, load_part};
use foldline_view::{Shown, html};
use std::time::Instant;

/// Header and columns of a frame of points.
fn frame(bytes: &[u8], columns: usize) -> (serde_json::Value, Vec<Vec<f64>>) {
    let length = u32::from_le_bytes(bytes[..4].try_into().expect("four bytes")) as usize;
    let header: serde_json::Value = serde_json::from_slice(&bytes[8..8 + length]).expect("the header is JSON");
    let numbers: Vec<f64> = bytes[8 + length..].as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
    let rows = header["rows"].as_u64().unwrap_or(0) as usize;
    assert_eq!(numbers.len(), rows * (3 + columns));
    (header, numbers.chunks(rows.max(1)).map(<[f64]>::to_vec).collect())
}

/// Waits until the state satisfies a condition.
fn state_when(served: &Served, cookie: &str, holds: impl Fn(&serde_json::Value) -> bool) -> serde_json::Value {
    let start = Instant::now();
    loop {
        let state: serde_json::Value =
            serde_json::from_slice(&served.get("/api/state", cookie)).expect("the state is JSON");
        if holds(&state) {
            return state;
        }
        assert!(start.elapsed() < PATIENCE, "{state}");
        std::thread::yield_now();
    }
}

#[test]
fn all_points_and_numbers_of_a_run_arrive() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let path = folder.path().join("run");
    let diagram = run_in(&path);
    let served = Served::new(&path);
    let cookie = served.enter();
    let run: serde_json::Value = serde_json::from_slice(&served.get("/api/run", &cookie)).expect("JSON");
    let names: Vec<&str> =
        run["quantities"].as_array().expect("a list").iter().filter_map(|q| q["name"].as_str()).collect();
    let index = |name: &str| names.iter().position(|own| *own == name).unwrap_or_else(|| panic!("{name} in {names:?}"));
    let query = format!("/api/points?epoch=1&since=0&columns={},{},{}", index("mu"), index("r_max"), index("r_mean"));
    let (header, columns) = frame(&served.get(&query, &cookie), 3);
    let points = &diagram.branches[0].points;
    assert_eq!(header["next"].as_u64(), Some(points.len() as u64));
    assert!(points.len() > 3);
    for (k, point) in points.iter().enumerate() {
        assert_eq!(columns[1][k], point.position as f64);
        assert_eq!(columns[3][k], point.parameters[0]);
        assert_eq!(columns[4][k], point.ranges[1][1]);
        assert_eq!(columns[5][k], point.averages[1][0]);
    }
    let (rest, _) = frame(&served.get("/api/points?epoch=1&since=3&columns=0", &cookie), 1);
    assert_eq!(rest["rows"].as_u64(), Some(points.len() as u64 - 3));
    let old = served.get("/api/points?epoch=7&since=0&columns=0", &cookie);
    assert!(String::from_utf8_lossy(&old).contains("\"restart\":true"));
}

#[test]
fn a_growing_run_is_seen_and_left_without_a_log() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let source = run_in(&folder.path().join("source"));
    let path = folder.path().join("run");
    let recorder = Recorder::create(&path, &study()).expect("the folder is new");
    assert!(is_written(&path));
    let (whole, served) = (&source.branches[0], Served::new(&path));
    let cookie = served.enter();
    let mut growing = Branch::new(whole.name.clone(), whole.family, whole.free, whole.origin.clone());
    recorder.observe(Event::Begin(&growing));
    for (k, point) in whole.points.iter().enumerate() {
        growing.insert(point.clone());
        recorder.observe(Event::Point(&growing, point));
        if k % 4 == 0 {
            let seen = state_when(&served, &cookie, |state| state["state"]["points"].as_u64() == Some(k as u64 + 1));
            assert_eq!(seen["state"]["running"].as_bool(), Some(true));
        }
    }
    recorder.observe(Event::SideEnded(&growing, 0, &Ending::Closed));
    recorder.complete().expect("the run can be written");
    let over = state_when(&served, &cookie, |state| state["state"]["running"].as_bool() == Some(false));
    assert_eq!(over["state"]["points"].as_u64(), Some(whole.points.len() as u64));
    assert_eq!(over["state"]["branches"][0]["ends"][0]["text"].as_str(), Some(Ending::Closed.to_string().as_str()));
    assert!(!path.join("run.sqlite-wal").exists() && !path.join("run.lock").exists());
    let stored = load_part(&path, Part::Numbers).expect("the file is sound").diagram;
    assert_eq!(stored.branches[0].points.len(), whole.points.len());
}

#[test]
fn a_resumed_run_begins_an_epoch() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let path = folder.path().join("run");
    let source = run_in(&path);
    let served = Served::new(&path);
    let cookie = served.enter();
    let (recorder, stored) = Recorder::resume(&path, &study()).expect("the run can be resumed");
    let mut shorter: Diagram = stored;
    let branch = &mut shorter.branches[0];
    let removed = branch.points.pop().expect("there are points");
    recorder.observe(Event::Begin(branch));
    let count = source.branches[0].points.len() as u64;
    let state = state_when(&served, &cookie, |state| state["epoch"].as_u64() == Some(2));
    assert_eq!(state["state"]["points"].as_u64(), Some(count - 1));
    branch.insert(removed.clone());
    recorder.observe(Event::Point(branch, &removed));
    state_when(&served, &cookie, |state| state["state"]["points"].as_u64() == Some(count));
    recorder.finish().expect("the run can be written");
}

#[test]
fn a_page_in_one_file_has_everything_and_asks_for_nothing() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let path = folder.path().join("</script>");
    let diagram = run_in(&path);
    let (page, amount) = html(&path, &Shown::default()).expect("the run can be read");
    assert_eq!(amount.points, diagram.branches[0].points.len());
    assert_eq!(amount.solutions, diagram.branches[0].points.len() + diagram.branches[0].special.len());
    assert!(!page.contains("src=") && !page.contains("app.css") && !page.contains("@import"));

    assert_eq!(page.matches("<script").count(), page.matches("</script>").count());
    let folder = folder.path().display().to_string();
    assert!(!page.contains(&folder), "the page names a folder of this computer");
}
