//! Runs every example of the gallery; its page must quote what the program prints.
//!
//! `cargo xtask gallery` renews tables, pictures and run times.

use crate::pages::{Page, check_all, copy, desk, keys, root};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// Opens the page of an example. Relative to the models, its files lie where they lie in the repository.
fn open(folder: &Path) -> Page {
    let desk = desk();
    let place = desk.path().join("docs/gallery").join(folder.file_name().unwrap());
    copy(folder, &place);
    Page::open(&folder.join("index.md"), desk, place, folder.to_path_buf())
}

/// The folders of the gallery, sorted by name.
fn examples() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(root().join("docs/gallery")).unwrap().map(|entry| entry.unwrap().path());
    let mut folders: Vec<PathBuf> = entries.filter(|path| path.is_dir()).collect();
    folders.sort();
    folders
}

#[test]
fn the_gallery_quotes_what_the_program_prints() {
    let renew = std::env::var_os("FOLDLINE_WRITE_BOOK").is_some();
    let wrong = check_all(&examples(), open, renew);
    if renew {
        examples().iter().for_each(|folder| note_cost(folder));
    }
    assert!(
        renew || wrong.is_empty(),
        "where these changes are meant, run `cargo xtask gallery`\n{}",
        wrong.join("\n\n")
    );
}

#[test]
fn every_example_is_in_the_overview_and_its_sources_are_known() {
    let overview = std::fs::read_to_string(root().join("docs/gallery/index.md")).unwrap();
    let bibliography = std::fs::read_to_string(root().join("docs/references.bib")).unwrap();
    let folders = examples();
    assert!(folders.len() >= 25, "{} examples", folders.len());
    for folder in folders {
        let name = folder.file_name().unwrap().to_string_lossy().into_owned();
        assert!(overview.contains(&format!("({name}/index.md)")), "the overview has no link to {name}");
        let keys = keys(&folder.join("index.md"));
        assert!(!keys.is_empty(), "{name} has no source");
        for key in keys {
            assert!(bibliography.contains(&format!("{{{key},")), "{name}: {key} is not in docs/references.bib");
        }
    }
}

/// Runs an example on one thread and records its time and work counters on its page.
fn note_cost(folder: &Path) {
    let out = tempfile::tempdir().unwrap();
    let run = out.path().join("run");
    let foldline = || Command::new(env!("CARGO_BIN_EXE_foldline"));
    let start = Instant::now();
    let done =
        foldline().args(["run", "--jobs", "1"]).arg(folder.join("study.toml")).arg("--out").arg(&run).output().unwrap();
    let seconds = start.elapsed().as_secs_f64();
    assert!(done.status.success(), "{}: {}", folder.display(), String::from_utf8_lossy(&done.stderr));
    let table = foldline().arg("table").arg(&run).args(["--branches", "--format", "json"]).output().unwrap();
    let rows: Vec<serde_json::Value> = serde_json::from_slice(&table.stdout).unwrap();
    let total = |column: &str| rows.iter().filter_map(|row| row[column].as_u64()).sum::<u64>();
    let line = format!(
        "Run time: {seconds:.1} s on one core ({}, {}); branches and curves: {}, points: {}, Newton steps: {}.",
        std::env::consts::OS,
        std::env::consts::ARCH,
        rows.len(),
        total("points"),
        total("newton"),
    );
    let page = folder.join("index.md");
    let text = std::fs::read_to_string(&page).unwrap();
    let lines = text.lines().map(|old| if old.starts_with("Run time: ") { line.as_str() } else { old });
    std::fs::write(&page, lines.collect::<Vec<&str>>().join("\n") + "\n").unwrap();
}
