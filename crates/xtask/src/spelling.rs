//! Spelling check by codespell with the settings in `.codespellrc`.

use crate::environment;
use crate::root;
use std::process::Command;

/// Newest version that was tested.
const PACKAGE: [&str; 1] = ["codespell==2.4.3"];

/// Checks the spelling of the repository. Without Python or a package index, a message says that spelling was not
/// checked.
pub fn right() -> bool {
    let Some(programs) = environment::ready("codespell", &PACKAGE) else {
        eprintln!("spelling NOT checked: codespell cannot be installed here");
        return true;
    };
    match Command::new(programs.join("codespell")).current_dir(root()).output() {
        Ok(output) if output.status.success() => true,
        Ok(output) => {
            let [said, failed] = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
            for line in said.lines().filter(|line| line.contains(" ==> ")) {
                // PLACE: WORD ==> CORRECTION
                let (place, words) = line.split_once(": ").unwrap_or(("", line));
                let (word, instead) = words.split_once(" ==> ").unwrap_or((words, "another word"));
                eprintln!("{}: \"{word}\": write \"{instead}\"", place.trim_start_matches("./"));
            }
            eprint!("{failed}");
            eprintln!("  Words that are right belong in .codespellrc.");
            false
        }
        Err(error) => {
            eprintln!("codespell: {error}");
            false
        }
    }
}
