//! Development tasks. `cargo xtask` lists them; continuous integration runs nothing else.

mod environment;
mod gallery;
mod invariants;
mod kill;
mod links;
mod page;
mod phrases;
mod python;
mod readers;
mod release;
mod site;
mod spelling;
mod tests;
mod tree;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Instant;

const USAGE: &str = "cargo xtask TASK
  test        format, clippy without warnings, references, words, every test of the workspace and of the Python package, dependencies
  check       the same without the tests and the dependencies
  words       spelling, links, phrasing and the invariants of ARCHITECTURE.md; with --all phrases in files that are not revised yet too
  address     replaces the address of the repository everywhere: cargo xtask address https://HOST/PATH
  page        the page of `foldline view` in Chromium; where Node.js or Chromium is missing that is said; --write: its pictures in the book
  python      the wheel of the Python package, its formatter, type checker and tests in an environment under target; where there is no
              Python that is said
  deny        licences, sources and advisories of the dependencies by cargo-deny, which is installed under target if it is not there
  licences    licences of everything that the command and the wheel contain, in target/THIRD-PARTY.html and
              python/foldline/THIRD-PARTY.html, by cargo-about, which is installed under target if it is not there
  bench       time, instructions, memory and work, written to benches/results/DATE.md; with --peers beside AUTO-07p and SciPy
              too; --only PART and --quick for a look (docs/book/benchmarks.md)
  reproduce   every figure and claim of the reference publication in a release build, from nothing; fails where a verdict is
              not the one in crates/foldline-reproduce/verdicts.txt, which `reproduce --write` renews
  kill        runs of the reference study killed at random instants, 100 or as many as a number says: each must resume, lose
              no point and find the same special points (docs/book/trust.md)
  campaign    random rotors, classical problems, and models of several fields with random parameters, 200, 5 starts of each and 240,
              or as many as numbers say: each branch followed in several ways must come out the same, and errors must be what is
              stated (docs/book/trust.md); with --rescaled the same in units of their own instead
  outside     problems of others with right values from elsewhere, each study in a process with a limit on its time; --quick, --only
              TEXT, and --write, which renews crates/foldline-campaign/outside/results.txt and the table in docs/book/trust.md
  docs        the documentation of the source, without warnings
  site        the documentation site in target/site, without warnings; with what `docs` has made, if it has run
  gallery     every example of docs/gallery again; renews tables, pictures and run times";

fn main() -> ExitCode {
    let task = std::env::args().nth(1).unwrap_or_default();
    let done = match task.as_str() {
        "test" => test(),
        "check" => check(),
        "words" => words(std::env::args().nth(2).as_deref() == Some("--all")),
        "address" => release::move_to(&std::env::args().nth(2).unwrap_or_default()),
        "page" if std::env::args().nth(2).as_deref() == Some("--write") => page::write(),
        "page" => page::test(),
        "python" => python::test(),
        "deny" => deny(),
        "licences" => licences(),
        "bench" => bench(&std::env::args().skip(2).collect::<Vec<String>>()),
        "reproduce" => reproduce(std::env::args().nth(2).as_deref() == Some("--write")),
        "kill" => kill::test(std::env::args().nth(2).and_then(|times| times.parse().ok()).unwrap_or(100)),
        "campaign" => campaign(&std::env::args().skip(2).collect::<Vec<String>>()),
        "outside" => outside(&std::env::args().skip(2).collect::<Vec<String>>()),
        "docs" => docs(),
        "site" => site::build(),
        "gallery" => gallery::renew(),
        _ => {
            eprintln!("{USAGE}");
            false
        }
    };
    if done { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Everything. What is installed for later steps is installed beside earlier ones, which rarely keep all cores busy.
fn test() -> bool {
    std::thread::scope(|scope| {
        let environments = scope.spawn(|| readers::prepared() && python::prepared());
        if !check() {
            return false;
        }
        let Some(built) = tests::build() else { return false };
        scope.spawn(cargo_deny);
        // A failure is reported where the environment is used.
        let _ = environments.join();
        let others = scope.spawn(|| [("page", page::test_built()), ("Python package", python::test())]);
        let own = tests::pass(built);
        let others = others.join().unwrap_or([("others", false); 2]);
        let verdicts = std::iter::once(("Rust code", own)).chain(others);
        let failed: Vec<&str> = verdicts.filter(|(_, passed)| !passed).map(|(what, _)| what).collect();
        failed.iter().for_each(|what| eprintln!("the tests of the {what} have failed, see above"));
        failed.is_empty()
    }) && deny()
}

fn check() -> bool {
    cargo(&["fmt", "--all", "--check"])
        && cargo(&["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"])
        && references()
        && words(false)
}

/// Checks spelling, links, phrasing, invariants of the source tree, and that address and version agree. With `all`,
/// also lists phrases in files that have not been revised yet.
fn words(all: bool) -> bool {
    let texts = tree::texts();
    let phrases = phrases::hits(&texts);
    let (failing, others): (Vec<_>, Vec<_>) = phrases.into_iter().partition(|hit| hit.fails);
    let mut faults = links::broken(&texts);
    faults.extend(invariants::broken(&texts));
    faults.extend(release::contradictions(&texts));
    faults.extend(failing.into_iter().map(|hit| hit.message));
    faults.iter().for_each(|fault| eprintln!("{fault}"));
    if all {
        others.iter().for_each(|hit| eprintln!("not revised yet: {}", hit.message));
    }
    spelling::right() && faults.is_empty()
}

/// A program of cargo, which is installed under target, with these further arguments, if it is not there.
fn tool(name: &str, version: &str, further: &[&str]) -> Option<PathBuf> {
    let tools = root().join("target/tools");
    let own = tools.join("bin").join(name);
    let known = Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success());
    if known {
        return Some(PathBuf::from(name));
    }
    let install = ["install", name, "--version", version, "--locked", "--quiet", "--root"];
    // `cargo install` succeeds without a program if a feature is missing.
    let there = own.exists() || run(Command::new(cargo_path()).args(install).arg(&tools).args(further)) && own.exists();
    there.then_some(own)
}

/// The program cargo-deny, in the newest version that was tested. It is built without optimisation, which takes a third
/// of the time.
fn cargo_deny() -> Option<PathBuf> {
    tool("cargo-deny", "0.20.2", &["--debug"])
}

/// Writes the licences of what the command and the wheel contain, each as a page.
fn licences() -> bool {
    let Some(program) = tool("cargo-about", "0.9.3", &["--features", "cli"]) else { return false };
    [("foldline-cli", "target/THIRD-PARTY.html"), ("foldline-py", "python/foldline/THIRD-PARTY.html")].iter().all(
        |(part, page)| {
            let manifest = format!("crates/{part}/Cargo.toml");
            let arguments = ["generate", "about.hbs", "--manifest-path", &manifest, "--output-file", page];
            eprintln!("cargo about {}", arguments.join(" "));
            run(Command::new(&program).args(arguments))
        },
    )
}

/// Checks dependencies with cargo-deny.
fn deny() -> bool {
    let Some(program) = cargo_deny() else { return false };
    let mut passed = true;
    let mut check = |what: &[&str]| {
        eprintln!("cargo deny check {}", what.join(" "));
        passed &= run(Command::new(&program).args(["--log-level", "error", "check", "--allow", "warnings"]).args(what));
    };
    check(&["licenses", "bans", "sources"]);
    // The advisory database is a remote repository. If it cannot be reached, a message says that advisories were not
    // checked.
    match Command::new(&program).current_dir(root()).args(["--log-level", "off", "fetch", "db"]).output() {
        Ok(output) if output.status.success() => check(&["advisories"]),
        _ => eprintln!("advisories NOT checked: their database cannot be reached from here"),
    }
    passed
}

fn docs() -> bool {
    run(Command::new(cargo_path()).args(["doc", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings"))
}

/// True if docs/references.bib has every key that a line `**Source.**` cites.
fn references() -> bool {
    let root = root();
    let bibliography = std::fs::read_to_string(root.join("docs/references.bib")).unwrap_or_default();
    let mut files = Vec::new();
    for folder in ["crates", "models", "studies"] {
        collect(&root.join(folder), &mut files);
    }
    let mut complete = true;
    for file in files {
        let text = std::fs::read_to_string(&file).unwrap_or_default();
        for line in text.lines().filter(|l| l.contains("**Source.**") || l.starts_with("source = ")) {
            for key in line.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| is_key(word)) {
                if !bibliography.contains(&format!("{{{key},")) {
                    eprintln!("{}: {key} is not in docs/references.bib", file.display());
                    complete = false;
                }
            }
        }
    }
    complete
}

/// True for a name followed by a year.
fn is_key(word: &str) -> bool {
    let name = word.trim_end_matches(|c: char| c.is_ascii_digit());
    name.len() > 2 && word.len() == name.len() + 4 && name.chars().all(|c| c.is_ascii_lowercase())
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs" || e == "toml") {
            files.push(path);
        }
    }
}

/// Builds the command and the examples, then runs the benchmarks, which write benches/results/DATE.md.
fn bench(arguments: &[String]) -> bool {
    let build = ["build", "--release", "--quiet", "--package", "foldline-cli", "--package", "foldline-rotor"];
    let own = ["run", "--release", "--quiet", "--package", "foldline-bench", "--"];
    let arguments: Vec<&str> = own.into_iter().chain(arguments.iter().map(String::as_str)).collect();
    // Only a complete run is published; a selection of parts is for inspection.
    let whole = !arguments.contains(&"--only") && !arguments.contains(&"--quick");
    let write: &[&str] = if whole { &["--write"] } else { &[] };
    cargo(&[&build[..], &["--bins", "--examples"]].concat()) && cargo(&[&arguments[..], write].concat())
}

/// Runs the campaign in a release build; the options are those of `foldline-campaign`.
fn campaign(arguments: &[String]) -> bool {
    let own = ["run", "--release", "--quiet", "--package", "foldline-campaign", "--"];
    cargo(&own.into_iter().chain(arguments.iter().map(String::as_str)).collect::<Vec<&str>>())
}

/// Runs the external problems with a release build of the command.
fn outside(arguments: &[String]) -> bool {
    let binary = root().join("target/release/foldline");
    let binary = binary.to_string_lossy();
    let own = ["run", "--release", "--quiet", "--package", "foldline-campaign", "--bin", "foldline-outside", "--"];
    let with = ["--binary", &binary].into_iter().chain(arguments.iter().map(String::as_str));
    cargo(&["build", "--release", "--quiet", "--package", "foldline-cli"])
        && cargo(&own.into_iter().chain(with).collect::<Vec<&str>>())
}

/// Reproduces the reference publication from scratch. Fails if a figure fails, a branch ends short or a verdict has
/// changed.
fn reproduce(write: bool) -> bool {
    if !cargo(&["build", "--release", "--quiet", "--package", "foldline-cli"]) {
        return false;
    }
    let out = root().join("target/reproduced");
    // Removes the folder of an earlier call.
    let _ = std::fs::remove_dir_all(&out);
    let start = Instant::now();
    let program = root().join("target/release/foldline");
    let made = run(Command::new(program).args(["reproduce", "akay2022", "--out"]).arg(&out));
    eprintln!("{:.1} s", start.elapsed().as_secs_f64());
    made && verdicts(&out.join("verdicts.txt"), write)
}

/// True if the verdicts equal the stored ones. With `write`, stores them instead.
fn verdicts(found: &Path, write: bool) -> bool {
    let known = root().join("crates/foldline-reproduce/verdicts.txt");
    if write {
        return std::fs::copy(found, &known).inspect_err(|error| eprintln!("{}: {error}", known.display())).is_ok();
    }
    let [now, before] = [found, &known].map(|file| std::fs::read_to_string(file).unwrap_or_default());
    let only = |sign: &str, here: &str, there: &str| {
        let lines = here.lines().filter(|line| !there.lines().any(|other| other == *line));
        lines.inspect(|line| eprintln!("{sign} {line}")).count()
    };
    let gone = only("was:", &before, &now);
    let new = only("now:", &now, &before);
    gone + new == 0
}

fn cargo(arguments: &[&str]) -> bool {
    eprintln!("cargo {}", arguments.join(" "));
    run(Command::new(cargo_path()).args(arguments))
}

fn cargo_path() -> String {
    std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_string())
}

fn run(command: &mut Command) -> bool {
    match command.current_dir(root()).status() {
        Ok(status) => status.success(),
        Err(error) => {
            eprintln!("{command:?}: {error}");
            false
        }
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}
