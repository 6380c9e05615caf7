//! `foldline verify` on the reference study, unmodified and with numbers changed in its file.

use std::path::Path;
use std::process::{Command, Output};

fn foldline(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[test]
fn the_reference_run_is_verified_and_changes_to_it_are_detected() {
    let folder = tempfile::tempdir().unwrap();
    let study = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../studies/overhung-rotor/bouncing.toml");
    let run = folder.path().join("run").to_string_lossy().into_owned();
    assert!(foldline(&["run", &study.to_string_lossy(), "--out", &run]).status.success());

    // Every point: the verdict, and the number of points checked.
    let right = foldline(&["verify", &run]);
    let said = text(&right.stdout);
    assert_eq!(right.status.code(), Some(0), "{said}");
    let summary = said.lines().find(|line| line.contains("recomputed")).unwrap();
    assert!(summary.contains(" 0 outside the stated error"), "{said}");
    let counts: Vec<usize> = summary.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let [points, special, comparisons, ..] = counts[..] else { panic!("{summary}") };
    assert!(points > 480 && special == 24 && comparisons > 4 * points, "{summary}");

    // A sample of one branch as CSV, the worst first.
    let sample =
        foldline(&["verify", &run, "--branch", "cubic SL", "--sample", "5", "--worst", "9", "--format", "csv"]);
    let sample = text(&sample.stdout);
    let ratios: Vec<f64> = sample.lines().skip(1).filter_map(|line| line.rsplit(',').next()?.parse().ok()).collect();
    assert!(ratios.len() == 9 && ratios.is_sorted_by(|a, b| a >= b), "{sample}");
    assert!(sample.lines().skip(1).all(|line| line.starts_with("cubic SL,")), "{sample}");

    // A special point moved away from its true position.
    let file = rusqlite::Connection::open(Path::new(&run).join("run.sqlite")).unwrap();
    let sql =
        "SELECT rowid, position, unstable, parameter_bytes, spectrum_bytes, range_bytes, scalar_bytes, average_bytes
               FROM special_points WHERE kind = 'period-doubling' LIMIT 1";
    let (row, counts, mut lists): (i64, [i64; 2], [Vec<u8>; 5]) = file
        .query_row(sql, [], |row| {
            let lists = [row.get(3)?, row.get(4)?, row.get(5)?, row.get(6)?, row.get(7)?];
            Ok((row.get(0)?, [row.get(1)?, row.get(2)?], lists))
        })
        .unwrap();
    let bytes = &mut lists[0];
    let moved = f64::from_le_bytes(bytes[..8].try_into().unwrap()) + 1e-4;
    bytes[..8].copy_from_slice(&moved.to_le_bytes());
    let change = "UPDATE special_points SET parameter_bytes = ? WHERE rowid = ?";
    file.execute(change, rusqlite::params![lists[0], row]).unwrap();
    // The checksum detects the change …
    let spoilt = foldline(&["verify", &run, "--sample", "10"]);
    let said = text(&spoilt.stderr);
    assert!(spoilt.status.code() == Some(2) && said.contains("do not have their checksum"), "{said}");
    // … unless it is updated too, as docs/book/run-file.md describes.
    let words = lists.concat().chunks_exact(8).map(|w| u64::from_le_bytes(w.try_into().unwrap())).collect::<Vec<u64>>();
    let sum = counts.map(|count| count as u64).iter().chain(&words).fold(0xcbf2_9ce4_8422_2325u64, |h, word| {
        let h = (h ^ word).wrapping_mul(0x0100_0000_01b3);
        h ^ (h >> 32)
    });
    let change = "UPDATE special_points SET numbers_checksum = ? WHERE rowid = ?";
    file.execute(change, rusqlite::params![sum as i64, row]).unwrap();
    drop(file);
    let wrong = foldline(&["verify", &run, "--sample", "10"]);
    let said = text(&wrong.stdout);
    assert_eq!(wrong.status.code(), Some(3), "{said}");
    assert!(said.lines().nth(1).unwrap().contains("period-doubling") && said.contains("location"), "{said}");
}
