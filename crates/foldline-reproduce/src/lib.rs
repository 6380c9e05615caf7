//! Published studies recomputed, figure by figure and claim by claim.
//!
//! **Idea.** A [`Publication`] lists figures. Each names the studies it needs, is made from their runs, and decides
//! claims. [`reproduce`] runs the missing studies and reuses the others ([`runs`]), draws, compares ([`claims`]) and
//! writes a report ([`report`]). Numbers of the publication appear only where a claim is compared with them; no
//! computation depends on them.
//!
//! | question | file |
//! |---|---|
//! | which studies and figures belong to a publication? | [`publication`] |
//! | how does a study become a run, once for all figures? | [`runs`] |
//! | do the results agree with the publication? | [`claims`] |
//! | do simulation and continuation agree? | [`agreement`] |
//! | which report is written at the end? | [`report`] |
//! | how is figure N made? | `akay2022/figureNN.rs` |

pub mod agreement;
pub mod akay2022;
pub mod claims;
pub mod publication;
pub mod report;
pub mod runs;

pub use claims::{Claim, Finding, Verdict};
pub use publication::{FigurePlan, Made, Publication, StudyPlan};
pub use runs::{Run, Runs};

use foldline_plot::{figure_svg, png};
use std::io;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Every publication that can be reproduced.
pub const PUBLICATIONS: &[Publication] = &[akay2022::PUBLICATION];

/// A request to reproduce figures of a publication.
pub struct Request<'r> {
    /// The publication.
    pub publication: &'static Publication,
    /// Its figures to reproduce.
    pub figures: Vec<&'static FigurePlan>,
    /// Folder for runs, figures and report.
    pub out: PathBuf,
    /// Number of branches followed in parallel.
    pub jobs: usize,
    /// Tolerance that replaces that of the studies: a coarse one for a quick look.
    pub tolerance: Option<f64>,
    /// Set from outside to end early; results so far are kept.
    pub stop: &'r AtomicBool,
    /// Receives progress, a line at a time.
    pub say: &'r (dyn Fn(&str) + Sync),
}

/// Result of a reproduction.
pub struct Reproduced {
    /// The report.
    pub report: PathBuf,
    /// Every claim of the figures made, decided or not.
    pub claims: Vec<Claim>,
    /// Failures, one line each.
    pub failures: Vec<String>,
    /// True if it was ended from outside.
    pub stopped: bool,
}

impl Reproduced {
    /// Number of claims per verdict, in one line.
    pub fn summary(&self) -> String {
        let counted = |check: bool| {
            let of = |verdict: Verdict| self.claims.iter().filter(|c| c.check == check && c.verdict == verdict).count();
            let counts = Verdict::ALL.map(|v| format!("{} {}", of(v), v.name()));
            (self.claims.iter().filter(|c| c.check == check).count(), counts.join(", "))
        };
        let ((claims, theirs), (checks, ours)) = (counted(false), counted(true));
        format!("{claims} claims of the publication: {theirs}; {checks} additional checks: {ours}")
    }
}

/// A figure of the report.
pub struct Drawn {
    /// Plan of the figure.
    pub plan: &'static FigurePlan,
    /// The figure as SVG, its caption and its claims; or the reason why there is none.
    pub made: Result<(String, Made), String>,
}

/// Computes figures and claims, and writes `figure-NN.svg`, `figure-NN.png`, `report.html` and `verdicts.txt`. A figure
/// that fails does not affect the others.
///
/// # Errors
/// The folder cannot be written to.
pub fn reproduce(request: &Request) -> io::Result<Reproduced> {
    let start = Instant::now();
    std::fs::create_dir_all(&request.out)?;
    let mut runs = Runs::new(request);
    let mut figures = Vec::new();
    for plan in &request.figures {
        for run in plan.runs {
            runs.compute(run);
        }
        if request.stop.load(Ordering::Relaxed) {
            break;
        }
        let made = (plan.make)(&runs).map(|made| (figure_svg(&made.figure), made));
        let made = match made {
            Ok((svg, made)) => write_pictures(request, plan, &svg)?.map(|()| (svg, made)),
            Err(why) => Err(why),
        };
        match &made {
            Ok(_) => (request.say)(&format!("figure {} done", plan.name)),
            Err(why) => (request.say)(&format!("figure {}: {why}", plan.name)),
        }
        figures.push(Drawn { plan, made });
    }
    let mut failures: Vec<String> = runs.failures();
    failures.extend(figures.iter().filter_map(|f| Some(format!("figure {}: {}", f.plan.name, f.made.as_ref().err()?))));
    let stopped = request.stop.load(Ordering::Relaxed);
    let seconds = start.elapsed().as_secs_f64();
    let page = report::html(request.publication, &figures, &runs, &failures, seconds);
    // A report on some of the figures does not replace the report on all of them.
    let some: Vec<&str> = request.figures.iter().map(|figure| figure.name).collect();
    let whole = some.len() == request.publication.figures.len();
    let name = if whole { "report.html".into() } else { format!("report-figure-{}.html", some.join("-")) };
    let report = request.out.join(name);
    std::fs::write(&report, page)?;
    let claims: Vec<Claim> =
        figures.into_iter().filter_map(|f| f.made.ok()).flat_map(|(_, made)| made.claims).collect();
    std::fs::write(request.out.join("verdicts.txt"), verdicts(&claims))?;
    Ok(Reproduced { report, claims, failures, stopped })
}

/// One line per claim: figure, verdict, statement, separated by tabs. Unlike the last digits of the numbers, these
/// lines should not vary between machines.
pub fn verdicts(claims: &[Claim]) -> String {
    claims.iter().map(|claim| format!("{}\t{}\t{}\n", claim.figure, claim.verdict, claim.statement)).collect()
}

/// Writes the SVG and the PNG; the inner error gives the reason why the PNG could not be made.
fn write_pictures(request: &Request, plan: &FigurePlan, svg: &str) -> io::Result<Result<(), String>> {
    const SCALE: f32 = 2.0;
    let file = |ending: &str| request.out.join(format!("{}.{ending}", plan.file_stem()));
    std::fs::write(file("svg"), svg)?;
    match png(svg, SCALE) {
        Ok(bytes) => std::fs::write(file("png"), bytes).map(Ok),
        Err(error) => Ok(Err(error.to_string())),
    }
}
