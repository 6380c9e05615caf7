//! `foldline reproduce`: recomputes a publication.

use crate::arguments::Reproduce as Typed;
use crate::failure::{Failure, Outcome};
use crate::progress::SignOfLife;
use crate::run::{processors, stop_on_interrupt};
use crate::verbosity::report;
use foldline_reproduce::{FigurePlan, PUBLICATIONS, Publication, Request, reproduce};
use std::io::{Write, stderr};
use std::path::Path;

/// Recomputes figures and claims and writes the report.
pub fn publication(typed: &Typed) -> Result<Outcome, Failure> {
    let publication = PUBLICATIONS.iter().find(|p| p.name == typed.publication).ok_or_else(|| {
        let known: Vec<&str> = PUBLICATIONS.iter().map(|p| p.name).collect();
        Failure::typed(
            format!("there is no publication \"{}\"", typed.publication),
            format!("one of: {}", known.join(", ")),
        )
    })?;
    let stop = stop_on_interrupt();
    let working = SignOfLife::of("computing");
    let request = Request {
        publication,
        figures: chosen(publication, &typed.figure)?,
        out: typed.out.clone().unwrap_or_else(|| Path::new("reproduced").join(publication.name)),
        jobs: typed.jobs.map_or_else(processors, usize::from),
        tolerance: None,
        stop: &stop,
        say: &|line| working.say(line),
    };
    let made = reproduce(&request).map_err(|error| unwritable(&request.out, &error))?;
    drop(working);
    made.failures.iter().try_for_each(|line| writeln!(stderr(), "failed: {line}"))?;
    if made.stopped {
        writeln!(stderr(), "stopped; repeat the same command to continue")?;
    } else {
        report(format_args!("{}", made.summary()))?;
    }
    report(format_args!("report: {}", made.report.display()))?;
    Ok(if made.failures.is_empty() && !made.stopped { Outcome::Done } else { Outcome::Short })
}

fn chosen(publication: &'static Publication, wanted: &[String]) -> Result<Vec<&'static FigurePlan>, Failure> {
    if wanted.is_empty() {
        return Ok(publication.figures.iter().collect());
    }
    let found = |name: &String| {
        publication.figure(name).ok_or_else(|| {
            let known: Vec<&str> = publication.figures.iter().map(|f| f.name).collect();
            let message = format!("--figure {name}: {} has no such figure", publication.name);
            Failure::typed(message, format!("one of: {}", known.join(", ")))
        })
    };
    wanted.iter().map(found).collect()
}

fn unwritable(out: &Path, error: &std::io::Error) -> Failure {
    Failure::typed(format!("cannot write to {}: {error}", out.display()), "choose another folder with --out DIR")
}
