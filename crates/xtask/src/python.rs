//! `cargo xtask python`: builds the wheel of the Python package and tests it in a separate environment.

use crate::{root, run};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

const REQUIREMENTS: &str = "python/tests/requirements.txt";

/// Prepares the environment of [`test`].
pub fn prepared() -> bool {
    interpreter().is_none_or(|(python, version)| Environment::ready(&python, &version, &home()).is_some())
}

fn home() -> PathBuf {
    root().join("target/python")
}

/// Builds the wheel, installs it into a separate environment under target, and runs formatter, type checker and tests
/// there. The environment is rebuilt when its requirements change.
pub fn test() -> bool {
    let Some((python, version)) = interpreter() else {
        eprintln!("the Python package NOT tested: there is no python3 of version 3.10 or later");
        return true;
    };
    let home = home();
    let Some(environment) = Environment::ready(&python, &version, &home) else { return false };
    let wheels = home.join("wheels");
    // Removes the wheels of an earlier call.
    let _ = std::fs::remove_dir_all(&wheels);
    let build = ["build", "--quiet", "--features", "workspace", "--out"].map(OsStr::new);
    environment.runs("maturin", build.into_iter().chain([wheels.as_os_str()]))
        && wheel(&wheels).is_some_and(|wheel| {
            let install = ["-m", "pip", "install", "--quiet", "--force-reinstall", "--no-deps"].map(OsStr::new);
            environment.runs("python", install.into_iter().chain([wheel.as_os_str()]))
        })
        && environment.runs("ruff", ["format", "--quiet", "--check", "python"].map(OsStr::new))
        && environment.runs("ruff", ["check", "--quiet", "python"].map(OsStr::new))
        && environment.runs("mypy", ["--no-error-summary", "python/foldline"].map(OsStr::new))
        // pyright needs Node.js; if that is missing, the wheel of pyright downloads it.
        && environment.runs("pyright", ["--level", "error"].map(OsStr::new))
        && environment.runs("pytest", ["--quiet", "python/tests"].map(OsStr::new))
}

/// Returns name and version of the Python interpreter.
fn interpreter() -> Option<(String, String)> {
    let tried = std::env::var("PYTHON").into_iter().chain(["python3".to_string(), "python".to_string()]);
    tried.into_iter().find_map(|name| {
        let say = "import sys; assert sys.version_info >= (3, 10); print(sys.version)";
        let output = Command::new(&name).args(["-c", say]).output().ok().filter(|output| output.status.success())?;
        Some((name, String::from_utf8_lossy(&output.stdout).into_owned()))
    })
}

struct Environment {
    programs: PathBuf,
}

impl Environment {
    fn ready(python: &str, version: &str, home: &Path) -> Option<Environment> {
        let place = home.join("environment");
        let environment = Environment { programs: place.join(if cfg!(windows) { "Scripts" } else { "bin" }) };
        let wanted = std::fs::read_to_string(root().join(REQUIREMENTS)).ok()? + version;
        let stamp = place.join("made-for");
        if std::fs::read_to_string(&stamp).is_ok_and(|made| made == wanted) {
            return Some(environment);
        }
        let _ = std::fs::remove_dir_all(&place);
        eprintln!("making {}", place.display());
        let install =
            ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r", REQUIREMENTS].map(OsStr::new);
        let made = run(Command::new(python).args(["-m", "venv"]).arg(&place)) && environment.runs("python", install);
        (made && std::fs::write(&stamp, wanted).is_ok()).then_some(environment)
    }

    /// Runs a program of the environment and returns true if it succeeds.
    fn runs<'a>(&self, program: &str, arguments: impl IntoIterator<Item = &'a OsStr>) -> bool {
        let arguments: Vec<&OsStr> = arguments.into_iter().collect();
        let shown: Vec<_> = arguments.iter().map(|argument| argument.to_string_lossy()).collect();
        eprintln!("{program} {}", shown.join(" "));
        let found = std::env::var_os("PATH").unwrap_or_default();
        let paths = std::iter::once(self.programs.clone()).chain(std::env::split_paths(&found));
        let path = std::env::join_paths(paths).unwrap_or(found);
        let mut command = Command::new(self.programs.join(program));
        // Ignores another environment that is active here.
        for name in ["PYTHONPATH", "VIRTUAL_ENV", "CONDA_PREFIX"] {
            command.env_remove(name);
        }
        run(command.args(arguments).env("PATH", path))
    }
}

/// Returns the path of the only wheel in a folder.
fn wheel(folder: &Path) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    entries.into_iter().find(|path| path.extension().is_some_and(|ending| ending == "whl"))
}
