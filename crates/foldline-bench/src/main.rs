//! Benchmarks of foldline alone and in comparison with other programs, run by `cargo xtask bench`.
//!
//! **Idea.** Times are processor times of one process or thread, which a busy machine affects little. Programs that are
//! compared are measured alternately, in one run on one machine; the result is the median of the ratios. All cases use
//! the public interface or the command.
//!
//! | question | file |
//! |---|---|
//! | how is time measured, in this process and in another? | [`clock`], [`child`] |
//! | which machine is this? | [`machine`] |
//! | how are ensembles timed on a card? | [`device`] |
//! | what is reported, and how? | [`report`] |
//! | which cases are there? | [`own`], [`peers`] |

mod child;
mod clock;
mod device;
mod machine;
mod own;
mod peers;
mod report;
mod rotor;
mod workplace;

use report::Report;
use std::process::ExitCode;
use workplace::Workplace;

const USAGE: &str = "foldline-bench [--peers] [--only PART] [--quick] [--write]
  --peers      compare with AUTO-07p and SciPy too
  --only PART  only the parts whose name contains PART
  --quick      fewer repetitions, no instruction counts
  --write      write the report to benches/results/DATE.md
  --device DIR write a folder that times ensembles on a machine with an NVIDIA card, and exit";

/// Allocator of the command `foldline`.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Result whose error ends the benchmark with a message.
type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let Some(("measure", command)) = arguments.split_first().map(|(first, rest)| (first.as_str(), rest)) {
        return child::measured(command);
    }
    match bench(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn bench(arguments: &[String]) -> Outcome<()> {
    let (mut with_peers, mut quick, mut write, mut only) = (false, false, false, String::new());
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        match argument.as_str() {
            "--peers" => with_peers = true,
            "--quick" => quick = true,
            "--write" => write = true,
            "--device" => {
                let folder = rest.next().ok_or(USAGE)?;
                return device::write(&Workplace::new(true)?.root, folder.as_ref());
            }
            "--only" => only = rest.next().ok_or(USAGE)?.clone(),
            _ => return Err(USAGE.into()),
        }
    }
    let place = Workplace::new(quick)?;
    let mut report = Report::new(machine::described(&place));
    let mut parts: Vec<(&str, workplace::Part)> = own::PARTS.to_vec();
    if with_peers {
        parts.extend(peers::PARTS);
    }
    for (name, part) in parts.into_iter().filter(|(name, _)| name.contains(&only)) {
        eprintln!("{name}");
        // A failed part is noted in the report; the others continue.
        let text = part(&place).unwrap_or_else(|error| format!("Not measured: {error}\n"));
        report.add(name, &text);
    }
    if write {
        let file = report.write(&place)?;
        eprintln!("{}", file.display());
    }
    Ok(())
}
