//! The report: one self-contained HTML page.

use crate::Drawn;
use crate::claims::{Claim, Verdict};
use crate::publication::Publication;
use crate::runs::{Run, Runs, VERSION};
use std::fmt::Write;

const STYLE: &str = "\
body{font:15px/1.5 'DejaVu Sans',Verdana,sans-serif;color:#222;max-width:64rem;margin:2rem auto;padding:0 1rem}
h1{font-size:1.5rem}h2{font-size:1.2rem;margin-top:2.5rem}
table{border-collapse:collapse;width:100%;font-size:.85rem}
th,td{text-align:left;vertical-align:top;padding:.3rem .5rem;border-bottom:1px solid #ddd}
th{border-bottom:2px solid #555}td.n{font-variant-numeric:tabular-nums;overflow-wrap:anywhere}
small{color:#555;display:block}figure{margin:1.5rem 0;break-inside:avoid}figure svg{max-width:100%;height:auto}
figcaption{color:#444;font-size:.9rem}
.v{white-space:nowrap;font-weight:bold}.agrees{color:#00664b}.refined{color:#0072b2}.contradicted{color:#b34e00}
.not-decided{color:#666}tr{break-inside:avoid}thead{display:table-header-group}
@media print{body{max-width:none;margin:0;font-size:10pt}h2{break-after:avoid}}";

/// Writes the page: summary, claims, figures, runs, failures.
pub fn html(publication: &Publication, figures: &[Drawn], runs: &Runs, failures: &[String], seconds: f64) -> String {
    let mut out = String::new();
    let title = escaped(publication.title);
    let _ = write!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>{title}</title>\n<style>{STYLE}</style></head><body>\n<h1>{title}: \
         recomputed</h1>\n"
    );
    let claims: Vec<&Claim> =
        figures.iter().filter_map(|f| f.made.as_ref().ok()).flat_map(|(_, m)| &m.claims).collect();
    summary(&mut out, &claims, runs, seconds);
    if !failures.is_empty() {
        out.push_str("<h2>Failed or incomplete</h2>\n<ul>\n");
        for line in failures {
            let _ = writeln!(out, "<li>{}</li>", escaped(line));
        }
        out.push_str("</ul>\n");
    }
    let (own, theirs): (Vec<&Claim>, Vec<&Claim>) = claims.iter().copied().partition(|claim| claim.check);
    table_of_claims(&mut out, "Claims of the publication", "Study", &theirs);
    table_of_claims(&mut out, "Additional checks and results", "Expected", &own);
    for figure in figures {
        let (name, title) = (escaped(figure.plan.name), escaped(figure.plan.title));
        let _ = writeln!(out, "<h2 id=\"figure-{name}\">Figure {name}: {title}</h2>");
        match &figure.made {
            Ok((svg, made)) => {
                let caption = caption(&made.caption);
                let _ = writeln!(out, "<figure>\n{svg}<figcaption>{caption}</figcaption></figure>");
            }
            Err(why) => {
                let _ = writeln!(out, "<p>This figure could not be made: {}</p>", escaped(why));
            }
        }
    }
    table_of_runs(&mut out, runs);
    out.push_str("</body></html>\n");
    out
}

/// Writes a caption as paragraphs; those with tabs become tables.
fn caption(text: &str) -> String {
    let part = |part: &str| {
        if !part.contains('\t') {
            return format!("<p>{}</p>\n", escaped(part));
        }
        let row = |(k, line): (usize, &str)| {
            let tag = if k == 0 { "th" } else { "td class=\"n\"" };
            let end = if k == 0 { "th" } else { "td" };
            let cells: String = line.split('\t').map(|cell| format!("<{tag}>{}</{end}>", escaped(cell))).collect();
            format!("<tr>{cells}</tr>\n")
        };
        let rows: String = part.lines().enumerate().map(row).collect();
        format!("<table>\n{rows}</table>\n")
    };
    text.split("\n\n").map(part).collect()
}

fn summary(out: &mut String, claims: &[&Claim], runs: &Runs, seconds: f64) {
    let computing: f64 = runs.all().filter_map(|(_, run)| run.as_ref().ok()).map(|run| run.seconds).sum();
    let mut tolerances: Vec<f64> =
        runs.all().filter_map(|(_, r)| Some(r.as_ref().ok()?.study.plan.tolerance)).collect();
    tolerances.sort_by(f64::total_cmp);
    tolerances.dedup();
    let tolerances: Vec<String> = tolerances.iter().map(|t| format!("{t:e}")).collect();
    let counted = |check: bool| {
        let count = |verdict: Verdict| claims.iter().filter(|c| c.check == check && c.verdict == verdict).count();
        let all = Verdict::ALL.iter().map(|verdict| (verdict, count(*verdict))).filter(|(_, count)| *count > 0);
        let all = all.map(|(verdict, count)| format!("{count} <span class=\"v {}\">{verdict}</span>", class(*verdict)));
        let all: Vec<String> = all.collect();
        if all.is_empty() { "none".into() } else { all.join(", ") }
    };
    let _ = writeln!(
        out,
        "<p>foldline {VERSION}; relative tolerance {}; runs {computing:.1} s, this report {seconds:.1} s. Claims of \
         the publication: {}. Additional checks: {}.</p>",
        if tolerances.is_empty() { "·".into() } else { tolerances.join(", ") },
        counted(false),
        counted(true)
    );
}

fn table_of_claims(out: &mut String, title: &str, against: &str, claims: &[&Claim]) {
    if claims.is_empty() {
        return;
    }
    let _ = writeln!(
        out,
        "<h2>{title}</h2>\n<table><thead><tr><th>Figure</th><th>Claim</th><th>{against}</th><th>Computed</th><th>Error</th>\
         <th>Verdict</th></tr></thead><tbody>"
    );
    for claim in claims {
        let note =
            if claim.note.is_empty() { String::new() } else { format!("<small>{}</small>", escaped(&claim.note)) };
        let error = claim.error.map_or("·".to_string(), |e| format!("{e:.0e}"));
        let figure = escaped(claim.figure);
        let _ = writeln!(
            out,
            "<tr><td><a href=\"#figure-{figure}\">{figure}</a></td><td>{}{note}</td><td class=\"n\">{}</td>\
             <td class=\"n\">{}</td><td class=\"n\">{error}</td><td class=\"v {}\">{}</td></tr>",
            escaped(&claim.statement),
            escaped(&claim.study),
            escaped(&claim.ours),
            class(claim.verdict),
            claim.verdict
        );
    }
    out.push_str("</tbody></table>\n");
}

fn table_of_runs(out: &mut String, runs: &Runs) {
    out.push_str(
        "<h2>Runs</h2>\n<table><thead><tr><th>Run</th><th>Study</th><th>Branches</th><th>Points</th><th>Special points</th>\
         <th>Tolerance</th><th>Time</th></tr></thead><tbody>\n",
    );
    for (name, run) in runs.all() {
        match run {
            Ok(run) => row(out, name, run),
            Err(why) => {
                let _ = writeln!(out, "<tr><td>{name}</td><td colspan=\"6\">failed: {}</td></tr>", escaped(why));
            }
        }
    }
    out.push_str("</tbody></table>\n");
}

fn row(out: &mut String, name: &str, run: &Run) {
    let branches = &run.diagram.branches;
    let points: usize = branches.iter().map(|b| b.points.len()).sum();
    let special: usize = branches.iter().map(|b| b.special.len()).sum();
    let earlier = if run.reused { " (earlier)" } else { "" };
    let _ = writeln!(
        out,
        "<tr><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{points}</td><td class=\"n\">{special}</td>\
         <td class=\"n\">{:e}</td><td class=\"n\">{:.1} s{earlier}</td></tr>",
        escaped(name),
        escaped(&run.study.file),
        branches.len(),
        run.study.plan.tolerance,
        run.seconds
    );
}

fn class(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Agrees => "agrees",
        Verdict::Refined => "refined",
        Verdict::Contradicted => "contradicted",
        Verdict::NotDecided => "not-decided",
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
