//! Runs the examples of the book: the pages on bifurcations, the tutorials and some others. What they quote must be what the program prints.
//!
//! On these pages each block of TOML begins with the name of its file, and each block `console` holds commands and their output. After an intended
//! change, `FOLDLINE_WRITE_BOOK=1 cargo test -p foldline-cli --test book` renews outputs and pictures.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A page, line by line, with the folder in which its commands run.
struct Page {
    name: String,
    lines: Vec<String>,
    desk: tempfile::TempDir,
}

/// A command of a page, and the lines below it that are its answer.
struct Quoted {
    command: String,
    answer: std::ops::Range<usize>,
}

impl Page {
    /// The page with its files laid out beside the models of this repository.
    fn open(path: &Path) -> Page {
        let desk = tempfile::tempdir().unwrap();
        std::fs::create_dir(desk.path().join("models")).unwrap();
        for entry in std::fs::read_dir(root().join("models")).unwrap() {
            let entry = entry.unwrap();
            std::fs::copy(entry.path(), desk.path().join("models").join(entry.file_name())).unwrap();
        }
        let text = std::fs::read_to_string(path).unwrap();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        Page { name, lines: text.lines().map(str::to_string).collect(), desk }
    }

    /// The lines inside the blocks of a kind.
    fn blocks(&self, kind: &str) -> Vec<std::ops::Range<usize>> {
        let fence = format!("```{kind}");
        let begins = self.lines.iter().enumerate().filter(|(_, line)| **line == fence).map(|(k, _)| k + 1);
        begins.map(|k| k..k + self.lines[k..].iter().position(|line| line == "```").unwrap()).collect()
    }

    /// Writes the files; returns the names of the studies among them.
    fn lay_out(&self) -> Vec<String> {
        let mut studies = Vec::new();
        for block in self.blocks("toml") {
            let head = &self.lines[block.start];
            let file = head.strip_prefix("# ").filter(|name| name.ends_with(".toml"));
            let file = file.unwrap_or_else(|| panic!("{}: a block begins with {head:?}", self.name));
            let text = self.lines[block].join("\n");
            if text.contains("\nmodel = ") {
                studies.push(file.to_string());
            }
            std::fs::write(self.desk.path().join(file), text).unwrap();
        }
        studies
    }

    fn quoted(&self) -> Vec<Quoted> {
        let mut all: Vec<Quoted> = Vec::new();
        for block in self.blocks("console") {
            for k in block.clone() {
                if let Some(command) = self.lines[k].strip_prefix("$ foldline ") {
                    all.push(Quoted { command: command.to_string(), answer: k + 1..block.end });
                } else if self.lines[k].starts_with('$') {
                    panic!("{}: {}", self.name, self.lines[k]);
                }
            }
        }
        for k in 1..all.len() {
            let next = all[k].answer.start - 1;
            all[k - 1].answer.end = all[k - 1].answer.end.min(next);
        }
        all
    }

    /// What a command says: the table, and which branches ended short; or why it is refused.
    fn answer(&self, command: &str) -> Vec<String> {
        let run = Command::new(env!("CARGO_BIN_EXE_foldline"))
            .args(command.split(' '))
            .current_dir(self.desk.path())
            .output()
            .unwrap();
        let said = String::from_utf8(run.stderr).unwrap();
        if said.starts_with("error: ") {
            assert_eq!(run.status.code(), Some(2), "{}: foldline {command}\n{said}", self.name);
            return said.lines().map(|line| line.trim_end().to_string()).collect();
        }
        let short: Vec<&str> = said.lines().skip_while(|line| !line.starts_with("ended short: ")).collect();
        let code = if short.is_empty() { 0 } else { 3 };
        assert_eq!(run.status.code(), Some(code), "{}: foldline {command}\n{said}", self.name);
        let table = String::from_utf8(run.stdout).unwrap();
        let lines = table.lines().chain(short.into_iter().filter(|line| !line.starts_with("run: ")));
        lines.map(|line| line.trim_end().to_string()).collect()
    }

    /// Pictures shown on the page that its commands draw. These are SVG files; others are not checked.
    fn pictures(&self) -> Vec<&str> {
        let shown = self.lines.iter().filter_map(|line| line.split_once("images/")?.1.split_once(')'));
        shown.map(|(name, _)| name).filter(|name| name.ends_with(".svg")).collect()
    }
}

/// The number of a word, and how many decimals it has; `None` for those with an exponent.
fn number(word: &str) -> Option<(f64, Option<i32>)> {
    let word = word.trim_matches(|c: char| ",:;()=".contains(c));
    let value = word.parse::<f64>().ok()?;
    let decimals = word.split_once('.').map_or(0, |(_, digits)| digits.len() as i32);
    Some((value, Some(decimals).filter(|_| !word.contains('e'))))
}

/// Whether two lines say the same: the same words, and numbers that agree to the digits printed or the error that stands beside them.
fn same(quoted: &str, found: &str) -> bool {
    let words = |line: &str| line.split_whitespace().map(str::to_string).collect::<Vec<_>>();
    let (quoted, found) = (words(quoted), words(found));
    let errors = quoted.iter().filter_map(|word| number(word)).filter(|(_, decimals)| decimals.is_none());
    let error = errors.map(|(value, _)| value).filter(|&value| value > 0.0 && value < 1e-4).fold(0.0, f64::max);
    quoted.len() == found.len()
        && quoted.iter().zip(&found).all(|(a, b)| match (number(a), number(b)) {
            (Some((a, _)), Some((b, _))) if a.abs().max(b.abs()) < 1e-9 => true,
            (Some((a, Some(decimals))), Some((b, _))) => {
                let unit = if decimals == 0 { 0.0 } else { 10f64.powi(-decimals) };
                (a - b).abs() <= (1.01 * unit).max(error * (1.0 + a.abs()) * f64::from(decimals.min(1)))
            }
            // An error, of which the size is what matters.
            (Some((a, None)), Some((b, None))) => a / b < 10.0 && b / a < 10.0,
            _ => a == b,
        })
}

/// What is written in a picture.
fn labels(picture: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(picture).unwrap_or_else(|e| panic!("{}: {e}", picture.display()));
    text.split("<text").skip(1).filter_map(|t| Some(t.split_once('>')?.1.split_once('<')?.0.to_string())).collect()
}

/// What the last line of a page cites: names followed by a year.
fn keys(page: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(page).unwrap();
    let last = text.lines().last().unwrap_or_default();
    assert!(last.starts_with("Source: "), "{} ends with its sources", page.display());
    let words = last.split(|c: char| !c.is_ascii_alphanumeric());
    words.filter(|word| word.len() > 6 && word.ends_with(|c: char| c.is_ascii_digit())).map(str::to_string).collect()
}

/// Runs the examples of a page; what is not as quoted.
fn check(path: &Path, renew: bool) -> Vec<String> {
    let mut page = Page::open(path);
    let (studies, quoted, mut wrong) = (page.lay_out(), page.quoted(), Vec::new());
    assert!(!quoted.is_empty(), "{} has no example", page.name);
    for study in studies {
        let command = format!("run {study}");
        assert!(quoted.iter().any(|q| q.command.starts_with(&command)), "{}: nothing runs {study}", page.name);
    }
    let mut answers = Vec::new();
    for Quoted { command, answer } in quoted {
        let found = page.answer(&command);
        let told = &page.lines[answer.clone()];
        if told.len() != found.len() || !told.iter().zip(&found).all(|(a, b)| same(a, b)) {
            let [told, now] = [told.join("\n"), found.join("\n")];
            wrong.push(format!("{}: foldline {command}\nquoted:\n{told}\nnow:\n{now}", page.name));
        }
        answers.push((answer, found));
    }
    for picture in page.pictures() {
        let [own, kept] = [page.desk.path().join(picture), root().join("docs/images").join(picture)];
        if renew {
            std::fs::copy(&own, &kept).unwrap_or_else(|e| panic!("{}: {picture}: {e}", page.name));
        }
        if labels(&own) != labels(&kept) {
            wrong.push(format!("{}: the picture {picture} has changed", page.name));
        }
    }
    if renew && !wrong.is_empty() {
        for (answer, found) in answers.into_iter().rev() {
            page.lines.splice(answer, found);
        }
        std::fs::write(path, page.lines.join("\n") + "\n").unwrap();
    }
    wrong
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
        "endings",
        "exploring",
        "first-model",
        "from-auto",
        "tutorial-forced-oscillator",
        "tutorial-neuron",
        "tutorial-rotor",
        "units",
        "what-foldline-does-not-do",
        "when-it-does-not-work",
    ];
    pages.extend(others.map(|page| root().join(format!("docs/book/{page}.md"))));
    pages.push(root().join("README.md"));
    let (renew, next) = (std::env::var_os("FOLDLINE_WRITE_BOOK").is_some(), AtomicUsize::new(0));
    let work = || {
        let mut wrong = Vec::new();
        while let Some(page) = pages.get(next.fetch_add(1, Ordering::Relaxed)) {
            wrong.extend(check(page, renew));
        }
        wrong
    };
    let wrong = std::thread::scope(|scope| {
        let threads = [scope.spawn(work), scope.spawn(work)];
        threads.map(|thread| thread.join().expect("a page is as it should be")).concat()
    });
    assert!(
        renew || wrong.is_empty(),
        "where these changes are meant, renew them with\n  \
         FOLDLINE_WRITE_BOOK=1 cargo test -p foldline-cli --test book\n{}",
        wrong.join("\n\n")
    );
}

#[test]
fn lines_are_the_same_to_the_digits_and_errors_that_they_state() {
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
