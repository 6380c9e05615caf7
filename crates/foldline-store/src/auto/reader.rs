//! Reader of AUTO-07p solution files.
//!
//! **Idea.** A solution begins with a line of integers; the ninth is the number of lines that follow. These contain the
//! normalised time and the states at each mesh point, the numbers of the free parameters, the branch direction, and all
//! parameters.

use super::Labelled;
use crate::diagnostic::Diagnostic;
use crate::toml_walk::diagnose;
use std::ops::Range;

const HINT: &str = "give the file that AUTO wrote as s.NAME or fort.8";

/// Text, and the line from which it is read next.
pub(super) struct Reader<'t> {
    text: &'t str,
    file: &'t str,
    lines: Vec<Range<usize>>,
    next: usize,
}

/// Integers at the beginning of a solution, without the unused ones.
struct Head {
    place: Range<usize>,
    label: i64,
    branch: i64,
    kind: i64,
    problem: Option<i64>,
    free: usize,
    times: usize,
    columns: usize,
    rows: usize,
    intervals: usize,
    degree: usize,
    parameters: usize,
}

/// One diagnostic, in a list as the callers return it.
type Mistake = Vec<Diagnostic>;

impl<'t> Reader<'t> {
    pub(super) fn new(text: &'t str, file: &'t str) -> Reader<'t> {
        let mut start = 0;
        let line = |line: &str| {
            start += line.len();
            start - line.len()..start - line.len() + line.trim_end().len()
        };
        Reader { text, file, lines: text.split_inclusive('\n').map(line).collect(), next: 0 }
    }

    /// Advances to the next line that is not empty. Returns false at the end of the text.
    pub(super) fn skip_to_solution(&mut self) -> bool {
        while self.lines.get(self.next).is_some_and(|line| self.text[line.clone()].trim().is_empty()) {
            self.next += 1;
        }
        self.next < self.lines.len()
    }

    /// Diagnostic for a file without solutions.
    pub(super) fn empty(&self) -> Mistake {
        self.mistake(0..0, "there is no solution in this file".into(), HINT)
    }

    /// Reads the solution that begins at the next line.
    pub(super) fn solution(&mut self) -> Result<Labelled, Mistake> {
        let head = self.head()?;
        let (label, times, columns) = (head.label, head.times, head.columns);
        let body = self.next + 1..(self.next + 1).saturating_add(head.rows);
        if body.end > self.lines.len() {
            let (there, rows) = (self.lines.len() - body.start, head.rows);
            let message =
                format!("the file ends inside the solution labelled {label}, after {there} of its {rows} lines");
            return Err(self.mistake(head.place, message, "copy the complete file again, or remove this solution"));
        }
        let words: Vec<Range<usize>> = self.words(body.clone()).collect();
        let wanted = times.checked_mul(columns).and_then(|n| n.checked_add(head.free)?.checked_add(head.parameters));
        if wanted.is_none_or(|wanted| wanted > words.len()) {
            let message = format!(
                "the solution labelled {label} has {} numbers, too few for {times} points of {columns} columns and {} parameters",
                words.len(),
                head.parameters
            );
            return Err(self.mistake(head.place, message, "the file was edited or truncated; copy it again"));
        }
        let (mut moments, mut states) = (Vec::with_capacity(times), Vec::with_capacity(times * (columns - 1)));
        for (k, word) in words[..times * columns].iter().enumerate() {
            let value = self.number(word)?;
            if k % columns == 0 { moments.push(value) } else { states.push(value) }
        }
        let free = words[times * columns..times * columns + head.free].iter().map(|word| self.index(word));
        let last = &words[words.len() - head.parameters..];
        let found = Labelled {
            label,
            branch: head.branch,
            kind: head.kind,
            free: free.collect::<Result<_, _>>()?,
            intervals: head.intervals,
            degree: head.degree,
            problem: head.problem,
            times: moments,
            states,
            parameters: last.iter().map(|word| self.number(word)).collect::<Result<_, _>>()?,
        };
        self.next = body.end;
        Ok(found)
    }

    fn head(&self) -> Result<Head, Mistake> {
        let place = self.lines[self.next].clone();
        let mut integers = Vec::new();
        for word in self.words(self.next..self.next + 1) {
            let text = &self.text[word.clone()];
            integers.push(text.parse::<i64>().map_err(|_| {
                let message = format!("\"{text}\" is not an integer; a solution begins with a line of integers");
                self.mistake(word, message, HINT)
            })?);
        }
        let [branch, _, kind, label, free, _, times, columns, rows, intervals, degree, parameters, ..] = integers[..]
        else {
            let message = format!("a solution begins with 12 or 16 integers; this line has {}", integers.len());
            return Err(self.mistake(place, message, HINT));
        };
        let size = |what: &str, value: i64, least: i64| match usize::try_from(value) {
            Ok(size) if value >= least => Ok(size),
            _ => Err(self.mistake(place.clone(), format!("the solution labelled {label} has {value} {what}"), HINT)),
        };
        let head = Head {
            label,
            branch,
            kind,
            problem: integers.get(14).copied(),
            free: size("free parameters", free, 0)?,
            times: size("points in time", times, 1)?,
            columns: size("columns", columns, 2)?,
            rows: size("lines", rows, 1)?,
            intervals: size("mesh intervals", intervals, 0)?,
            degree: size("collocation points", degree, 0)?,
            parameters: size("parameters", parameters, 0)?,
            place,
        };
        let nodes = head.intervals.checked_mul(head.degree).and_then(|n| n.checked_add(1));
        if times > 1 && nodes != Some(head.times) {
            let message = format!(
                "the solution labelled {label} has {times} points, which is not {intervals} intervals of {degree} and one more"
            );
            return Err(self.mistake(head.place, message, HINT));
        }
        Ok(head)
    }

    /// Positions of the words of some lines.
    fn words(&self, lines: Range<usize>) -> impl Iterator<Item = Range<usize>> + use<'_, 't> {
        let start = self.text.as_ptr() as usize;
        let of_line = |line: &Range<usize>| self.text[line.clone()].split_ascii_whitespace();
        self.lines[lines].iter().flat_map(of_line).map(move |word| {
            let at = word.as_ptr() as usize - start;
            at..at + word.len()
        })
    }

    fn index(&self, word: &Range<usize>) -> Result<usize, Mistake> {
        let text = &self.text[word.clone()];
        text.parse().ok().filter(|index| *index > 0).ok_or_else(|| {
            let message = format!("\"{text}\" is not the number of a parameter");
            self.mistake(word.clone(), message, "this line lists the numbers of the free parameters, counted from 1")
        })
    }

    fn number(&self, word: &Range<usize>) -> Result<f64, Mistake> {
        let text = &self.text[word.clone()];
        number(text).filter(|value| value.is_finite()).ok_or_else(|| {
            let message = format!("\"{text}\" is not a finite number");
            self.mistake(word.clone(), message, "a number such as 1.25, 1.25E-01 or 1.25D-01")
        })
    }

    fn mistake(&self, place: Range<usize>, message: String, hint: &str) -> Mistake {
        vec![diagnose(self.file, self.text, place, message, hint.to_string())]
    }
}

/// Reads a number in Fortran notation: with D for E, or with neither if the exponent has three digits.
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
