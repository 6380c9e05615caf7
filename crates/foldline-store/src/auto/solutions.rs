//! Labelled solutions.
//!
//! **Idea.** A solution is a line of integers, of which the ninth says how many lines follow: for each mesh point the
//! normalised time and the states, then which parameters are free, the direction of the branch, and all parameters.

use crate::diagnostic::Diagnostic;
use crate::toml_walk::{diagnose, read_text, unreadable};
use std::ops::Range;
use std::path::Path;

/// A solution of a file `s.NAME`.
#[derive(Clone, Debug, PartialEq)]
pub struct Labelled {
    /// Its label.
    pub label: i64,
    /// The number of its branch.
    pub branch: i64,
    /// AUTO's number for what it is.
    pub kind: i64,
    /// Numbers of the free parameters, from 1.
    pub free: Vec<usize>,
    /// NTST; 1 for an equilibrium.
    pub intervals: usize,
    /// NCOL; 0 for an equilibrium.
    pub degree: usize,
    /// IPS; files of old versions do not have it.
    pub problem: Option<i64>,
    /// Normalised times; one for an equilibrium.
    pub times: Vec<f64>,
    /// `[times][states]`.
    pub states: Vec<f64>,
    /// PAR(1), PAR(2), …
    pub parameters: Vec<f64>,
}

impl Labelled {
    /// Number of states.
    pub fn dim(&self) -> usize {
        self.states.len() / self.times.len().max(1)
    }

    /// Whether it is a cycle or another solution over time.
    pub fn lasts(&self) -> bool {
        self.times.len() > 1
    }

    /// PAR(11), the period of a cycle.
    pub fn period(&self) -> Option<f64> {
        self.parameters.get(10).copied().filter(|_| self.lasts())
    }

    /// AUTO's two letters and the name of the kind here; `None` for a solution that is nothing special.
    pub fn named(&self) -> Option<(&'static str, &'static str)> {
        Some(match self.kind.unsigned_abs() % 10 {
            _ if self.kind.abs() > 10 => ("", "codimension two"),
            1 | 6 => ("BP", "branch-point"),
            2 | 5 => ("LP", "fold"),
            3 => ("HB", "hopf"),
            // Without the sign it is a solution that was written because it was its turn.
            4 if self.kind < 0 => ("UZ", "mark"),
            7 => ("PD", "period-doubling"),
            8 => ("TR", "torus"),
            9 if self.kind < 0 => ("MX", "no convergence"),
            9 => ("EP", "end"),
            _ => return None,
        })
    }
}

/// Reads a file of solutions.
///
/// # Errors
/// The place of the first thing that is not as AUTO writes it.
pub fn read_solutions(path: &Path) -> Result<Vec<Labelled>, Vec<Diagnostic>> {
    let file = path.display().to_string();
    let text = read_text(path).map_err(|error| vec![unreadable(&file, "the solution file", &error)])?;
    solutions(&text, &file)
}

/// The solutions in a text; `file` is its name in messages.
///
/// # Errors
/// The place of the first thing that is not as AUTO writes it.
pub fn solutions(text: &str, file: &str) -> Result<Vec<Labelled>, Vec<Diagnostic>> {
    let mut reader = Reader { text, file, lines: lines(text), next: 0 };
    let mut found = Vec::new();
    while reader.to_head() {
        found.push(reader.solution().map_err(|mistake| vec![mistake])?);
    }
    if found.is_empty() {
        let hint = "give the file that AUTO writes as s.NAME or fort.8".to_string();
        return Err(vec![diagnose(file, text, 0..0, "there is no solution in this file".into(), hint)]);
    }
    Ok(found)
}

/// A number as Fortran writes it: with D for E, and without either where the exponent has three digits.
pub(super) fn number(word: &str) -> Option<f64> {
    if !word.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) {
        return None;
    }
    let plain = word.replace(['D', 'd'], "E");
    let sign = plain.rfind(['+', '-']).filter(|at| *at > 0 && plain.as_bytes()[at - 1].is_ascii_digit());
    let spelt = match sign {
        Some(at) => format!("{}E{}", &plain[..at], &plain[at..]),
        None => plain,
    };
    spelt.parse().ok()
}

struct Reader<'t> {
    text: &'t str,
    file: &'t str,
    lines: Vec<Range<usize>>,
    next: usize,
}

fn lines(text: &str) -> Vec<Range<usize>> {
    let mut start = 0;
    let line = |line: &str| {
        start += line.len();
        start - line.len()..start - line.len() + line.trim_end().len()
    };
    text.split_inclusive('\n').map(line).collect()
}

impl<'t> Reader<'t> {
    /// Goes to the next line that is not empty.
    fn to_head(&mut self) -> bool {
        while self.lines.get(self.next).is_some_and(|line| self.text[line.clone()].trim().is_empty()) {
            self.next += 1;
        }
        self.next < self.lines.len()
    }

    fn mistake(&self, place: Range<usize>, message: String, hint: &str) -> Diagnostic {
        diagnose(self.file, self.text, place, message, hint.to_string())
    }

    fn solution(&mut self) -> Result<Labelled, Diagnostic> {
        const HINT: &str = "give the file that AUTO writes as s.NAME or fort.8";
        let place = self.lines[self.next].clone();
        let words: Vec<Range<usize>> = self.words(self.next..self.next + 1).collect();
        let mut head = Vec::with_capacity(words.len());
        for word in words {
            match self.text[word.clone()].parse::<i64>() {
                Ok(integer) => head.push(integer),
                Err(_) => {
                    let message = format!(
                        "\"{}\" is not an integer; a solution begins with a line of them",
                        &self.text[word.clone()]
                    );
                    return Err(self.mistake(word, message, HINT));
                }
            }
        }
        let [branch, _, kind, label, free, _, times, columns, rows, intervals, degree, parameters, ..] = head[..]
        else {
            let message = format!("a solution begins with 12 or 16 integers, here are {}", head.len());
            return Err(self.mistake(place, message, HINT));
        };
        let size = |what: &str, value: i64, least: i64| match usize::try_from(value) {
            Ok(size) if value >= least => Ok(size),
            _ => Err(self.mistake(place.clone(), format!("the solution labelled {label} has {value} {what}"), HINT)),
        };
        let (times, columns) = (size("points in time", times, 1)?, size("columns", columns, 2)?);
        let (rows, free, parameters) =
            (size("lines", rows, 1)?, size("free parameters", free, 0)?, size("parameters", parameters, 0)?);
        let (intervals, degree) = (size("mesh intervals", intervals, 0)?, size("collocation points", degree, 0)?);
        let body = self.next + 1..(self.next + 1).saturating_add(rows);
        if body.end > self.lines.len() {
            let there = self.lines.len() - body.start;
            let message =
                format!("the file ends within the solution labelled {label}: {there} of its {rows} lines are there");
            return Err(self.mistake(place, message, "copy the file again, whole, or remove this solution from it"));
        }
        let words: Vec<Range<usize>> = self.words(body.clone()).collect();
        let wanted = times.checked_mul(columns).and_then(|n| n.checked_add(free)?.checked_add(parameters));
        if wanted.is_none_or(|wanted| wanted > words.len()) {
            let message = format!(
                "the solution labelled {label} has {} numbers, too few for {times} points of {columns} columns and {parameters} parameters",
                words.len()
            );
            return Err(self.mistake(place, message, "the file was changed, or cut within its lines; copy it again"));
        }
        if times > 1 && intervals.checked_mul(degree).and_then(|n| n.checked_add(1)) != Some(times) {
            let message = format!(
                "the solution labelled {label} has {times} points, which is not {intervals} intervals of {degree} and one more"
            );
            return Err(self.mistake(place, message, HINT));
        }
        let (mut moments, mut states) = (Vec::with_capacity(times), Vec::with_capacity(times * (columns - 1)));
        for (k, word) in words[..times * columns].iter().enumerate() {
            let value = self.number(word)?;
            if k % columns == 0 { moments.push(value) } else { states.push(value) }
        }
        let index = |word: &Range<usize>| match self.text[word.clone()].parse::<usize>() {
            Ok(index) if index > 0 => Ok(index),
            _ => {
                let message = format!("\"{}\" is not the number of a parameter", &self.text[word.clone()]);
                Err(self.mistake(word.clone(), message, "here stand the numbers of the free parameters, from 1 on"))
            }
        };
        let free = words[times * columns..times * columns + free].iter().map(index).collect::<Result<_, _>>()?;
        let last = &words[words.len() - parameters..];
        let parameters = last.iter().map(|word| self.number(word)).collect::<Result<_, _>>()?;
        self.next = body.end;
        let problem = head.get(14).copied();
        Ok(Labelled { label, branch, kind, free, intervals, degree, problem, times: moments, states, parameters })
    }

    /// Where the words of some lines stand.
    fn words(&self, lines: Range<usize>) -> impl Iterator<Item = Range<usize>> + use<'_, 't> {
        let start = self.text.as_ptr() as usize;
        let of_line = |line: &Range<usize>| self.text[line.clone()].split_ascii_whitespace();
        self.lines[lines].iter().flat_map(of_line).map(move |word| {
            let at = word.as_ptr() as usize - start;
            at..at + word.len()
        })
    }

    fn number(&self, word: &Range<usize>) -> Result<f64, Diagnostic> {
        let text = &self.text[word.clone()];
        number(text).filter(|value| value.is_finite()).ok_or_else(|| {
            self.mistake(
                word.clone(),
                format!("\"{text}\" is not a finite number"),
                "a number such as 1.25, 1.25E-01 or 1.25D-01",
            )
        })
    }
}
