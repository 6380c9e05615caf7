//! Pages whose examples are run, and whose quotations must match what the program prints.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};

pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A page as lines, with the folder in which its commands run and the one in which its pictures are kept.
pub struct Page {
    path: PathBuf,
    name: String,
    lines: Vec<String>,
    _desk: tempfile::TempDir,
    place: PathBuf,
    pictures: PathBuf,
}

/// A command on a page, and the lines below it that quote its output.
struct Quoted {
    command: String,
    answer: std::ops::Range<usize>,
}

impl Page {
    /// Opens a page whose commands run in `place`, a folder inside `desk`, and whose pictures are kept in `pictures`.
    pub fn open(path: &Path, desk: tempfile::TempDir, place: PathBuf, pictures: PathBuf) -> Page {
        let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let name = path.strip_prefix(root()).unwrap_or(path).display().to_string();
        let lines = text.lines().map(str::to_string).collect();
        Page { path: path.to_path_buf(), name, lines, _desk: desk, place, pictures }
    }

    /// Line ranges inside the blocks of one language.
    fn blocks(&self, kind: &str) -> Vec<std::ops::Range<usize>> {
        let fence = format!("```{kind}");
        let begins = self.lines.iter().enumerate().filter(|(_, line)| **line == fence).map(|(k, _)| k + 1);
        begins.map(|k| k..k + self.lines[k..].iter().position(|line| line == "```").unwrap()).collect()
    }

    /// Writes the files of the page; returns the names of the studies among them.
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
            std::fs::write(self.place.join(file), text).unwrap();
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

    /// Output of a command: its table and the list of incomplete parts, or the reason for a refusal.
    fn answer(&self, command: &str) -> Vec<String> {
        let run = Command::new(env!("CARGO_BIN_EXE_foldline"))
            .args(arguments(command))
            .current_dir(&self.place)
            .output()
            .unwrap();
        let said = String::from_utf8(run.stderr).unwrap();
        if said.starts_with("error: ") {
            assert_eq!(run.status.code(), Some(2), "{}: foldline {command}\n{said}", self.name);
            return said.lines().map(|line| line.trim_end().to_string()).collect();
        }
        let short: Vec<&str> = said.lines().skip_while(|line| !line.starts_with("incomplete: ")).collect();
        let code = if short.is_empty() { 0 } else { 3 };
        assert_eq!(run.status.code(), Some(code), "{}: foldline {command}\n{said}", self.name);
        let table = String::from_utf8(run.stdout).unwrap();
        let lines = table.lines().chain(short.into_iter().filter(|line| !line.starts_with("run: ")));
        lines.map(|line| line.trim_end().to_string()).collect()
    }

    /// The SVG pictures shown on the page that its commands draw. Other pictures are not checked.
    fn pictures(&self) -> Vec<&str> {
        let shown = self.lines.iter().filter(|line| line.starts_with("!["));
        let targets = shown.filter_map(|line| line.split_once("](")?.1.strip_suffix(')'));
        targets.filter_map(|target| target.rsplit('/').next()).filter(|name| name.ends_with(".svg")).collect()
    }
}

/// Arguments of a command; what is between double quotes is one.
fn arguments(command: &str) -> Vec<&str> {
    let parts = command.split('"').enumerate();
    parts.flat_map(|(k, part)| if k % 2 == 1 { vec![part] } else { part.split_whitespace().collect() }).collect()
}

/// Number in a word, and its number of decimals; no number of decimals with an exponent.
fn number(word: &str) -> Option<(f64, Option<i32>)> {
    let word = word.trim_matches(|c: char| ",:;()=".contains(c));
    let value = word.parse::<f64>().ok()?;
    let decimals = word.split_once('.').map_or(0, |(_, digits)| digits.len() as i32);
    Some((value, Some(decimals).filter(|_| !word.contains('e'))))
}

/// True if two lines agree: the same words, and numbers equal to the printed digits or to the error stated beside them.
pub fn same(quoted: &str, found: &str) -> bool {
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
            // Of an error only the magnitude matters.
            (Some((a, None)), Some((b, None))) => a / b < 10.0 && b / a < 10.0,
            _ => a == b,
        })
}

/// Texts in a picture.
fn labels(picture: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(picture).unwrap_or_else(|e| panic!("{}: {e}", picture.display()));
    text.split("<text").skip(1).filter_map(|t| Some(t.split_once('>')?.1.split_once('<')?.0.to_string())).collect()
}

/// Keys of docs/references.bib cited in the last line of a page: names followed by a year.
pub fn keys(page: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(page).unwrap();
    let last = text.lines().last().unwrap_or_default();
    assert!(last.starts_with("Source: "), "{} ends with its sources", page.display());
    let words = last.split(|c: char| !c.is_ascii_alphanumeric());
    words.filter(|word| word.len() > 6 && word.ends_with(|c: char| c.is_ascii_digit())).map(str::to_string).collect()
}

/// Runs the examples of a page; returns the differences from its quotations.
pub fn check(mut page: Page, renew: bool) -> Vec<String> {
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
        let [own, kept] = [page.place.join(picture), page.pictures.join(picture)];
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
        std::fs::write(&page.path, page.lines.join("\n") + "\n").unwrap();
    }
    wrong
}

/// Returns a temporary folder with the models of this repository.
pub fn desk() -> tempfile::TempDir {
    let desk = tempfile::tempdir().unwrap();
    copy(&root().join("models"), &desk.path().join("models"));
    desk
}

/// Copies the files of a folder.
pub fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
}

/// Opens and checks every page, two at a time; returns the differences from their quotations.
pub fn check_all(pages: &[PathBuf], open: fn(&Path) -> Page, renew: bool) -> Vec<String> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut wrong = Vec::new();
        while let Some(page) = pages.get(next.fetch_add(1, Ordering::Relaxed)) {
            wrong.extend(check(open(page), renew));
        }
        wrong
    };
    std::thread::scope(|scope| {
        let threads = [scope.spawn(work), scope.spawn(work)];
        threads.map(|thread| thread.join().expect("a page is as it should be")).concat()
    })
}
