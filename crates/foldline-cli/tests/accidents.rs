//! Accidents to a run file: each gives a clear message, and nothing that was stored is lost.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn foldline(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(root()).output().unwrap()
}

fn said(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!text.contains("panicked"), "{text}");
    text
}

/// Starts a study that takes a while in `folder`.
fn begun(folder: &Path) -> Command {
    begun_with(folder, "1")
}

fn begun_with(folder: &Path, jobs: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_foldline"));
    command
        .args(["run", "studies/overhung-rotor/bouncing.toml", "--jobs", jobs, "--out"])
        .arg(folder)
        .current_dir(root());
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

/// Waits until `ready` returns true; a minute is more than enough.
fn until(mut ready: impl FnMut() -> bool) {
    let start = Instant::now();
    while !ready() {
        assert!(start.elapsed() < Duration::from_secs(60), "it did not happen");
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn points(folder: &Path) -> usize {
    let output = foldline(&["table", folder.to_str().unwrap(), "--points", "--format", "csv"]);
    String::from_utf8_lossy(&output.stdout).lines().count().saturating_sub(1)
}

/// Returns a new folder with a small finished run.
fn finished() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let model = "name = \"m\"\n[parameters]\nmu = -0.5\n[states]\nx = \"mu - x^2 + 0*y\"\ny = \"-y\"\n";
    let study = "model = \"m.toml\"\n[[seed]]\nname = \"s\"\nstate = { x = 1, y = 0 }\nparameters = { mu = 1 }\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"mu\"\nrange = [-1, 2]\n";
    std::fs::write(folder.path().join("m.toml"), model).unwrap();
    std::fs::write(folder.path().join("s.toml"), study).unwrap();
    let output = run(folder.path(), &[]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    folder
}

fn run(folder: &Path, more: &[&str]) -> Output {
    let [study, out] = ["s.toml", "run"].map(|name| folder.join(name));
    foldline(&[&["run", study.to_str().unwrap(), "--out", out.to_str().unwrap()], more].concat())
}

#[test]
fn a_second_run_in_the_same_folder_is_refused_while_the_first_writes() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let mut first = begun(&out).spawn().unwrap();
    until(|| out.join("run.sqlite").exists() && points(&out) > 3);
    let second = begun(&out).arg("--resume").output().unwrap();
    assert_eq!(second.status.code(), Some(2));
    let message = said(&second);
    assert!(message.contains("another run is writing") && message.contains("--out DIR"), "{message}");
    first.kill().unwrap();
    first.wait().unwrap();
    // The killed process has released its lock.
    let third = begun(&out).arg("--resume").output().unwrap();
    assert_eq!(third.status.code(), Some(0), "{}", said(&third));
}

#[test]
fn deleting_the_folder_during_a_run_ends_it_with_a_message() {
    for jobs in ["1", "3"] {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("run");
        let first = begun_with(&out, jobs).spawn().unwrap();
        until(|| out.join("run.sqlite").exists() && points(&out) > 3);
        std::fs::remove_dir_all(&out).unwrap();
        let output = first.wait_with_output().unwrap();
        let message = said(&output);
        assert_eq!(output.status.code(), Some(1), "{jobs}: {message}");
        assert!(message.contains("was deleted, moved or replaced"), "{jobs}: {message}");
    }
}

#[cfg(unix)]
#[test]
fn a_write_error_ends_the_run_and_keeps_the_stored_points() {
    for jobs in ["1", "3"] {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("run");
        // Files may grow to 3000 blocks of 1024 bytes and no further.
        let script = "trap '' XFSZ; ulimit -f 3000; \
            exec \"$0\" run studies/overhung-rotor/bouncing.toml --jobs \"$1\" --out \"$2\"";
        let output = Command::new("bash")
            .args(["-c", script, env!("CARGO_BIN_EXE_foldline"), jobs])
            .arg(&out)
            .current_dir(root())
            .output()
            .unwrap();
        let message = said(&output);
        assert_eq!(output.status.code(), Some(1), "{jobs}: {message}");
        assert!(message.contains("run.sqlite") && message.contains("--resume"), "{jobs}: {message}");
        let stored = points(&out);
        assert!(stored > 5, "{jobs}: {stored}");
        let resumed = begun_with(&out, jobs).arg("--resume").output().unwrap();
        assert_eq!(resumed.status.code(), Some(0), "{jobs}: {}", said(&resumed));
        assert!(points(&out) > stored);
    }
}

#[test]
fn a_truncated_file_is_reported_as_damaged() {
    let folder = finished();
    let file = folder.path().join("run/run.sqlite");
    let bytes = std::fs::read(&file).unwrap();
    for length in [0, 17, 100, 16_384, bytes.len() / 2, bytes.len() - 40_000] {
        std::fs::write(&file, &bytes[..length]).unwrap();
        for command in ["table", "verify"] {
            let output = foldline(&[command, folder.path().join("run").to_str().unwrap()]);
            let message = said(&output);
            assert_eq!(output.status.code(), Some(2), "{length}: {message}");
            assert!(
                message.contains("damaged") || message.contains("is not a foldline run file"),
                "{length}: {message}"
            );
        }
        let output = run(folder.path(), &["--resume"]);
        // A file of length zero belongs to a run that was killed before it had written anything.
        assert_eq!(output.status.code(), Some(if length == 0 { 0 } else { 2 }), "{length}: {}", said(&output));
    }
}

#[test]
fn a_flipped_bit_is_detected_or_harmless() {
    let folder = finished();
    let file = folder.path().join("run/run.sqlite");
    let whole = folder.path().join("run");
    let whole = whole.to_str().unwrap();
    let bytes = std::fs::read(&file).unwrap();
    let table = foldline(&["table", whole, "--points", "--format", "csv"]).stdout;
    let (mut noticed, mut random) = (0, 0x2545_f491_4f6c_dd1du64);
    for _ in 0..120 {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        let mut spoilt = bytes.clone();
        let place = (random >> 3) as usize % bytes.len();
        spoilt[place] ^= 1 << (random % 8);
        std::fs::write(&file, &spoilt).unwrap();
        let output = foldline(&["verify", whole]);
        let message = said(&output);
        if output.status.code() != Some(0) {
            let known = ["damaged", "is not a foldline run file", "but this foldline reads formats up to"];
            assert!(known.iter().any(|words| message.contains(words)), "byte {place}: {message}");
            noticed += 1;
            continue;
        }
        assert!(foldline(&["table", whole, "--points", "--format", "csv"]).stdout == table, "byte {place}");
    }
    assert!(noticed > 5, "{noticed}");
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_the_run_at_its_next_point_and_says_how_to_continue() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let first = begun(&out).spawn().unwrap();
    until(|| out.join("run.sqlite").exists() && points(&out) > 3);
    let done = Command::new("kill").args(["-INT", &first.id().to_string()]).status().unwrap();
    assert!(done.success());
    let message = said(&first.wait_with_output().unwrap());
    assert!(message.contains("stopped; continue with --resume --out"), "{message}");
    let stored = points(&out);
    let resumed = begun(&out).arg("--resume").output().unwrap();
    assert_eq!(resumed.status.code(), Some(0), "{}", said(&resumed));
    assert!(points(&out) > stored);
}
