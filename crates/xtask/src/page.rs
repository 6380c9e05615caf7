//! `cargo xtask page`: tests the page of `foldline view` in a browser; with `--write`, its pictures in the book are made.

use crate::{cargo, root, run};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Folder of the tests, which are written for the test runner of Node.js.
const TESTS: &str = "crates/foldline-view/tests/page";

/// Oldest version of Node.js with the test runner that is used.
const NODE: u32 = 20;

/// Builds the program and tests its page.
pub fn test() -> bool {
    built() && test_built()
}

/// Builds the program and writes the pictures of its page in the book.
pub fn write() -> bool {
    built() && node_runs(&["pictures.mjs"])
}

fn built() -> bool {
    cargo(&["build", "--quiet", "--package", "foldline-cli"])
}

/// Tests the page of the program that the build of the tests has left. Its tests run under `target/page`, where their
/// only dependency is installed. Without Node.js, npm, a browser or a package registry, a message says that the page was
/// not tested.
pub fn test_built() -> bool {
    node_runs(&["--test", "--test-concurrency=1", "--test-reporter=dot"])
}

/// Calls Node.js with these arguments.
fn node_runs(arguments: &[&str]) -> bool {
    let Some(browser) = browser() else {
        eprintln!("the page NOT tested: there is no Chromium; CHROMIUM=PATH names one");
        return true;
    };
    if node().is_none_or(|version| version < NODE) || !works("npm") {
        eprintln!("the page NOT tested: there is no Node.js of version {NODE} or later with npm");
        return true;
    }
    let folder = root().join("target/page");
    if let Err(error) = copied(&root().join(TESTS), &folder) {
        eprintln!("{}: {error}", folder.display());
        return false;
    }
    let install = ["install", "--no-audit", "--no-fund", "--no-package-lock", "--silent"];
    if !folder.join("node_modules/playwright-core").exists()
        && !run(Command::new("npm").current_dir(&folder).args(install))
    {
        eprintln!("the page NOT tested: playwright-core cannot be installed here");
        return true;
    }
    let program = root().join("target/debug").join(format!("foldline{}", std::env::consts::EXE_SUFFIX));
    let mut node = Command::new("node");
    node.current_dir(&folder).args(arguments);
    node.env("FOLDLINE", program).env("ROOT", root()).env("BROWSER", browser);
    run(&mut node)
}

/// Program of Chromium itself: a wrapper of a distribution may add options for a graphics processor.
fn browser() -> Option<PathBuf> {
    let own = std::env::var_os("CHROMIUM").map(PathBuf::from);
    let known =
        ["/usr/lib/chromium/chromium", "/usr/lib64/chromium-browser/chromium-browser", "/opt/google/chrome/chrome"];
    own.into_iter().chain(known.map(PathBuf::from)).find(|path| path.is_file())
}

/// Major version of Node.js.
fn node() -> Option<u32> {
    let output = Command::new("node").arg("--version").output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    text.trim().strip_prefix('v')?.split('.').next()?.parse().ok()
}

fn works(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
}

/// Copies the files of a folder.
fn copied(from: &Path, to: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(to)?;
    for entry in std::fs::read_dir(from)? {
        let entry = entry?;
        std::fs::copy(entry.path(), to.join(entry.file_name()))?;
    }
    Ok(())
}
