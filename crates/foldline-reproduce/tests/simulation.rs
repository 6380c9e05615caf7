//! Figure 9: agreement of simulation and continuation, at a coarse tolerance and with a sparse survey.

use foldline_reproduce::akay2022::PUBLICATION;
use foldline_reproduce::{Claim, Reproduced, Request, Verdict, reproduce};
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

fn figure_9(folder: &tempfile::TempDir, said: &Mutex<Vec<String>>) -> Reproduced {
    let request = Request {
        publication: &PUBLICATION,
        figures: vec![PUBLICATION.figure("9").unwrap()],
        out: folder.path().to_path_buf(),
        jobs: 2,
        tolerance: Some(1e-5),
        stop: &AtomicBool::new(false),
        say: &|line| said.lock().unwrap().push(line.to_string()),
    };
    reproduce(&request).unwrap()
}

fn claim<'m>(made: &'m Reproduced, words: &str) -> &'m Claim {
    let found = made.claims.iter().find(|claim| claim.statement.contains(words));
    found.unwrap_or_else(|| panic!("no claim about {words}: {:?}", made.claims))
}

fn numbers(claim: &Claim) -> Vec<f64> {
    let parts = claim.ours.split(|c: char| !c.is_ascii_digit() && c != '.' && c != '-');
    parts.filter_map(|part| part.trim_end_matches('.').parse().ok()).collect()
}

#[test]
fn simulated_motions_lie_on_branches_and_sweeps_jump_where_dl_ends() {
    let (folder, said) = (tempfile::tempdir().unwrap(), Mutex::new(Vec::new()));
    let made = figure_9(&folder, &said);
    assert!(made.failures.is_empty(), "{:?}", made.failures);
    // Period doublings from an independent code (shooting at 1e-12).
    assert!((numbers(claim(&made, "branch of SL doubles again"))[1] - 4.628842).abs() < 1e-4);
    assert!((numbers(claim(&made, "branch of DL doubles again"))[1] - 4.199325).abs() < 1e-4);
    let every = claim(&made, "Every motion");
    let found = numbers(every);
    assert!(found[0] == found[1] && found[0] > 12.0, "{every:?}");
    for branch in ["contact S at", "contact SL at", "contact DL at", "contact 4:1 at"] {
        assert_eq!(claim(&made, branch).verdict, Verdict::Agrees, "{branch}");
    }
    // DL is stable from 4.19 to its fold at 6.16581.
    let (up, down) = (claim(&made, "sweep up"), claim(&made, "sweep down"));
    let ([u0, u1], [d0, d1]) = ([0, 1].map(|k| numbers(up)[k]), [0, 1].map(|k| numbers(down)[k]));
    assert!(up.verdict == Verdict::Refined && 6.08 < u0 && u0 < u1 && u0 < 6.16581, "{up:?}");
    assert!(down.verdict == Verdict::Refined && d1 < d0 && d0 > 4.19 && d1 < 4.27, "{down:?}");
    // A second call simulates nothing.
    said.lock().unwrap().clear();
    let report = std::fs::read_to_string(figure_9(&folder, &said).report).unwrap();
    assert!(said.lock().unwrap().iter().all(|line| !line.contains("values")), "{said:?}");
    assert_eq!(report.matches("(earlier)").count(), 3);
}
