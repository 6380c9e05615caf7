//! The command `foldline`: arguments → plan → run → table.

mod arguments;
mod attractors;
mod basins;
mod basins_along;
mod check;
mod emit;
mod exact;
mod explore;
mod export;
mod failure;
mod figures;
mod import_auto;
mod misspelt;
mod new;
mod plot;
mod plot_map;
mod progress;
mod reproduce;
mod rotor;
mod run;
mod simulate;
mod table;
mod tornado;
mod values;
mod verbosity;
mod verify;
mod view;

use arguments::{Arguments, Command};
use clap::Parser;
use failure::{Failure, Outcome};
use std::process::ExitCode;

/// Meshes change size all the time; this allocator reuses freed memory instead of returning it to the system.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return misspelt::report(error),
    };
    match answer(arguments) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Short | Outcome::Wrong) => ExitCode::from(3),
        Err(failure) => failure.report(),
    }
}

fn answer(arguments: Arguments) -> Result<Outcome, Failure> {
    verbosity::choose(arguments.quiet, arguments.verbose);
    match arguments.command {
        None => run::reference_study_or_help(),
        Some(Command::Run(typed)) => run::study(&typed),
        Some(Command::Explore(typed)) => explore::diagram(&typed),
        Some(Command::New(typed)) => new::write(&typed),
        Some(Command::Simulate(typed)) => simulate::trajectory(&typed),
        Some(Command::Table(typed)) => table::print(&typed),
        Some(Command::Verify(typed)) => verify::print(&typed),
        Some(Command::Exact(typed)) => exact::compare(&typed),
        Some(Command::View(typed)) => view::show(&typed),
        Some(Command::Plot(typed)) => plot::write(&typed),
        Some(Command::Export(typed)) => export::write(&typed),
        Some(Command::ImportAuto(typed)) => import_auto::answer(&typed),
        Some(Command::Attractors(typed)) => attractors::print(&typed),
        Some(Command::Basins(typed)) => basins::print(&typed),
        Some(Command::Emit(typed)) => emit::write(&typed),
        Some(Command::Check(typed)) => check::print(&typed),
        Some(Command::Campbell(typed)) => rotor::campbell::print(&typed),
        Some(Command::CriticalSpeeds(typed)) => rotor::critical::print(&typed),
        Some(Command::UnbalanceResponse(typed)) => rotor::unbalance::print(&typed),
        Some(Command::Reproduce(typed)) => reproduce::publication(&typed),
    }
}
