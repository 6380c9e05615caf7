//! Labelled solutions of AUTO-07p.

use super::reader::Reader;
use crate::diagnostic::Diagnostic;
use crate::text_file::{read_text, unreadable};
use std::path::Path;

/// Solution in a file `s.NAME`.
#[derive(Clone, Debug, PartialEq)]
pub struct Labelled {
    /// Label.
    pub label: i64,
    /// Number of the branch.
    pub branch: i64,
    /// AUTO's solution type, the ITP of the file.
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

    /// True for a cycle or another solution over time.
    pub fn lasts(&self) -> bool {
        self.times.len() > 1
    }

    /// Returns PAR(11), the period of a cycle.
    pub fn period(&self) -> Option<f64> {
        self.parameters.get(10).copied().filter(|_| self.lasts())
    }

    /// Returns AUTO's two-letter code and the name used here; `None` for a regular solution.
    pub fn named(&self) -> Option<(&'static str, &'static str)> {
        let found = match self.kind {
            -21 | -31 => ("BT", "bogdanov-takens"),
            -22 => ("CP", "cusp"),
            -32 => ("GH", "generalised-hopf"),
            -13 | -23 | -33 => ("ZH", "zero-hopf"),
            -25 | -55 | -85 => ("R1", "1:1-resonance"),
            -76 | -86 => ("R2", "1:2-resonance"),
            -87 => ("R3", "1:3-resonance"),
            -88 => ("R4", "1:4-resonance"),
            28 | 78 => ("LPD", "fold-flip"),
            23 | 83 => ("LTR", "fold-torus"),
            77 | 87 => ("PTR", "flip-torus"),
            88 => ("TTR", "double-torus"),
            // On a curve in two parameters, AUTO adds ten times the type of the curve.
            kind => return Labelled::of_one_parameter(kind),
        };
        Some(found)
    }

    fn of_one_parameter(kind: i64) -> Option<(&'static str, &'static str)> {
        Some(match kind.unsigned_abs() % 10 {
            1 | 6 => ("BP", "branch-point"),
            2 | 5 => ("LP", "fold"),
            3 => ("HB", "hopf"),
            // A positive 4 marks a regular solution written at the print interval NPR.
            4 if kind < 0 => ("UZ", "mark"),
            7 => ("PD", "period-doubling"),
            8 => ("TR", "torus"),
            9 if kind < 0 => ("MX", "no convergence"),
            9 => ("EP", "end"),
            _ => return None,
        })
    }
}

/// Reads a solution file.
///
/// # Errors
/// The first deviation from AUTO's format, with its position, or an unreadable file.
pub fn read_solutions(path: &Path) -> Result<Vec<Labelled>, Vec<Diagnostic>> {
    let file = path.display().to_string();
    let text = read_text(path).map_err(|error| vec![unreadable(&file, "the solution file", &error)])?;
    solutions(&text, &file)
}

/// Reads the solutions in a text; `file` is its name in messages.
///
/// # Errors
/// The first deviation from AUTO's format, with its position.
pub fn solutions(text: &str, file: &str) -> Result<Vec<Labelled>, Vec<Diagnostic>> {
    let mut reader = Reader::new(text, file);
    let mut found = Vec::new();
    while reader.skip_to_solution() {
        found.push(reader.solution()?);
    }
    if found.is_empty() { Err(reader.empty()) } else { Ok(found) }
}
