//! Runs the examples of the book: the pages on bifurcations, the tutorials and some others. Their quotations must match
//! the program.
//!
//! On these pages each TOML block begins with the name of its file, and each `console` block holds commands and their
//! output. After an intended change, `FOLDLINE_WRITE_BOOK=1 cargo test -p foldline-cli --test all book::` renews outputs and
//! pictures.

use crate::pages::{Page, check_all, desk, keys, root, same};
use std::path::{Path, PathBuf};

/// Opens a page of the book. The files that it shows are placed beside the folder of models.
fn open(path: &Path) -> Page {
    let desk = desk();
    let place = desk.path().to_path_buf();
    Page::open(path, desk, place, root().join("docs/images"))
}

#[test]
fn the_pages_on_bifurcations_quote_what_the_program_prints() {
    let folder = root().join("docs/book/bifurcations");
    let mut pages: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    pages.sort();
    let bibliography = std::fs::read_to_string(root().join("docs/references.bib")).unwrap();
    let overview = std::fs::read_to_string(root().join("docs/book/bifurcations.md")).unwrap();
    for page in &pages {
        let link = format!("(bifurcations/{})", page.file_name().unwrap().to_string_lossy());
        assert!(overview.contains(&link), "the overview has no link {link}");
        for key in keys(page) {
            assert!(
                bibliography.contains(&format!("{{{key},")),
                "{}: {key} is not in docs/references.bib",
                page.display()
            );
        }
    }
    let others = [
        "boundary-value-problems",
        "connecting-orbits",
        "contact",
        "design",
        "friction",
        "endings",
        "exploring",
        "first-model",
        "from-auto",
        "held-quantities",
        "how-to",
        "maps",
        "maps-in-studies",
        "outputs",
        "pictures",
        "sensitivities",
        "tori",
        "tutorial-forced-oscillator",
        "tutorial-neuron",
        "tutorial-rotor",
        "units",
        "what-foldline-does-not-do",
        "when-it-does-not-work",
    ];
    pages.extend(others.map(|page| root().join(format!("docs/book/{page}.md"))));
    pages.push(root().join("README.md"));
    let renew = std::env::var_os("FOLDLINE_WRITE_BOOK").is_some();
    let wrong = check_all(&pages, open, renew);
    assert!(
        renew || wrong.is_empty(),
        "where these changes are meant, renew them with\n  \
         FOLDLINE_WRITE_BOOK=1 cargo test -p foldline-cli --test all book::\n{}",
        wrong.join("\n\n")
    );
}

#[test]
fn lines_match_to_their_stated_digits_and_errors() {
    let quoted = "b  torus  0.697166666  2  8.1e-7  d = -0.16628, supercritical";
    assert!(same(quoted, "b torus  0.697166999  2  7.0e-7  d = -0.16628, supercritical"));
    for other in [
        "b  torus  0.697169666  2  8.1e-7  d = -0.16628, supercritical",
        "b  torus  0.697166666  1  8.1e-7  d = -0.16628, supercritical",
        "b  torus  0.697166666  2  8.1e-5  d = -0.16628, supercritical",
        "b  torus  0.697166666  2  8.1e-7  d = -0.16648, supercritical",
        "b  torus  0.697166666  2  8.1e-7  d = -0.16628, subcritical",
        "b  fold   0.697166666  2  8.1e-7  d = -0.16628, supercritical",
        "b  torus  0.697166666  2  8.1e-7",
    ] {
        assert!(!same(quoted, other), "{other}");
    }
    assert!(same("0.000000000", "-2.1e-16") && !same("0.000000000", "0.000000003"));
}
