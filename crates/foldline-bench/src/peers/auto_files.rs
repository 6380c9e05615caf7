//! Files of AUTO-07p: constants are written, points and solutions read.

use crate::Outcome;
use foldline::diagram::{Cycle, Solution};
use foldline::problem::gauss::Scheme;
use std::path::Path;

/// Point in `fort.7`.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Solution type: 5 fold, 6 branch point, 7 period doubling, 8 torus, -4 user value, 9 end, -9 no convergence; for
    /// equilibria 1 branch point, 2 fold, 3 Hopf; 0 regular.
    pub kind: i64,
    /// Label of the solution in `fort.8`, or 0.
    pub label: usize,
    /// Continuation parameter.
    pub parameter: f64,
    /// Last column: the period of a cycle.
    pub period: f64,
}

/// Returns the template with some values replaced. Every name must occur in it.
pub fn constants(template: &str, changes: &[(&str, &str)]) -> Outcome<String> {
    let name_of = |line: &str| line.split_once('=').map(|(name, _)| name.trim().to_string());
    for (name, _) in changes {
        if !template.lines().any(|line| name_of(line).as_deref() == Some(name)) {
            return Err(format!("benches/auto/c.rotor has no constant {name}").into());
        }
    }
    let line = |line: &str| {
        let found = changes.iter().rev().find(|(name, _)| name_of(line).as_deref() == Some(name));
        found.map_or(format!("{line}\n"), |(name, value)| format!("{name} = {value}\n"))
    };
    Ok(template.lines().filter(|line| !line.starts_with('#')).map(line).collect())
}

/// Reads the points of a `fort.7`.
pub fn rows(text: &str) -> Vec<Row> {
    let row = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        let whole = |k: usize| words.get(k).and_then(|word| word.parse::<i64>().ok());
        // Lines with column headings have branch number 0.
        whole(0).filter(|branch| *branch != 0)?;
        Some(Row {
            kind: match whole(2)? {
                kind @ (-9 | -4) => kind,
                kind => kind % 10,
            },
            label: usize::try_from(whole(3)?).ok()?,
            parameter: number(words.get(4)?)?,
            period: number(words.last()?)?,
        })
    };
    text.lines().filter_map(row).collect()
}

/// Counts the Newton iterations in a `fort.9` written with IID = 2: lines with branch, point, iteration (from 0),
/// parameter and norm.
pub fn iterations(text: &str) -> usize {
    let is_iteration = |line: &&str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        words.len() == 5
            && words[..3].iter().all(|word| word.parse::<i64>().is_ok())
            && words[3..].iter().all(|word| word.contains('E') && number(word).is_some())
            && words[2] != "0"
    };
    text.lines().filter(is_iteration).count()
}

/// Reads a number such as 5.0E+00 or, with a three-digit exponent and no letter, 1.0-101.
fn number(word: &str) -> Option<f64> {
    word.parse().ok().or_else(|| {
        let sign = word.rfind(['+', '-']).filter(|at| *at > 0)?;
        format!("{}E{}", &word[..sign], &word[sign..]).parse().ok()
    })
}

/// Reads the labelled cycles of a `fort.8`: label, value of the first parameter, solution. Equilibria are left out.
pub fn cycles(text: &str) -> Vec<(usize, f64, Solution)> {
    let lines: Vec<&str> = text.lines().collect();
    let (mut found, mut at) = (Vec::new(), 0);
    while let Some(head) = lines.get(at) {
        let head: Vec<usize> = head.split_whitespace().map(|word| word.parse().unwrap_or(0)).collect();
        let [_, _, _, label, free, _, nodes, width, length, intervals, degree, parameters, ..] = head[..] else {
            break;
        };
        let numbers: Vec<f64> = lines[at + 1..(at + 1 + length).min(lines.len())]
            .iter()
            .flat_map(|l| l.split_whitespace())
            .filter_map(number)
            .collect();
        at += 1 + length;
        let n = width - 1;
        let values = numbers.len().checked_sub(parameters).map(|first| &numbers[first..]);
        let (Some(values), true) = (values, nodes == intervals * degree + 1 && nodes > 1) else { continue };
        // The nodes are followed by indices and directions of the free parameters and the direction at every node.
        if numbers.len() == nodes * width + 2 * free + nodes * n + parameters {
            found.push((label, values[0], Solution::Cycle(cycle(&numbers, n, intervals, degree, values[10]))));
        }
    }
    found
}

/// Converts polynomials through equally spaced nodes to polynomials through Gauss points.
fn cycle(numbers: &[f64], n: usize, intervals: usize, degree: usize, period: f64) -> Cycle {
    let row = |node: usize| &numbers[node * (n + 1)..(node + 1) * (n + 1)];
    let mesh: Vec<f64> = (0..=intervals).map(|j| row(j * degree)[0]).collect();
    let mut profile = Vec::new();
    for j in 0..intervals {
        for s in &Scheme::new(degree).nodes {
            let weight = |k: usize| -> f64 {
                let others = (0..=degree).filter(|l| *l != k);
                others.map(|l| (s * degree as f64 - l as f64) / (k as f64 - l as f64)).product()
            };
            let value = |i: usize| (0..=degree).map(|k| weight(k) * row(j * degree + k)[1 + i]).sum::<f64>();
            profile.extend((0..n).map(value));
        }
    }
    Cycle {
        points: foldline::problem::gauss::Points::Gauss,
        period,
        forcing_periods: 0,
        mesh: mesh.into(),
        degree,
        profile,
        gain: Vec::new(),
    }
}

/// Writes the file from which AUTO reads the first profile: times and states of a cycle, including both ends.
pub fn write_start(cycle: &Cycle, file: &Path) -> Outcome<()> {
    let (n, nodes) = (cycle.dim(), cycle.scheme().nodes.clone());
    let mut text = String::new();
    let mut line = |t: f64, x: &[f64]| {
        let values: Vec<String> = std::iter::once(&t).chain(x).map(|v| format!("{v:.17e}")).collect();
        text.push_str(&format!("{}\n", values.join(" ")));
    };
    for (k, x) in cycle.profile.chunks_exact(n).enumerate() {
        let (j, node) = (k / nodes.len(), k % nodes.len());
        let t = cycle.mesh[j] + nodes[node] * (cycle.mesh[j + 1] - cycle.mesh[j]);
        line(t * cycle.period, x);
    }
    line(cycle.period, &cycle.profile[..n]);
    Ok(std::fs::write(file, text)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_are_replaced_by_name() {
        let text = constants("# remark\nDS = 0.1\nDSMAX = 1\n", &[("DS", "0.2")]).unwrap();
        assert_eq!(text, "DS = 0.2\nDSMAX = 1\n");
        assert!(constants("DS = 0.1\n", &[("NTST", "20")]).is_err());
    }

    #[test]
    fn points_are_read() {
        let text = "   0   PT\n  -1    12   5    2  1.5E+000  4.4E+001  2.0E+000\n   1    13  -9    0  1.6-101  4.4E+001  2.1E+000\n";
        let rows = rows(text);
        assert_eq!((rows[0].kind, rows[0].label), (5, 2));
        assert_eq!((rows[0].parameter, rows[0].period), (1.5, 2.0));
        assert_eq!((rows[1].kind, rows[1].parameter), (-9, 1.6e-101));
    }

    #[test]
    fn iterations_are_counted_from_one() {
        let text = "  BR    PT  IT         PAR           L2-NORM\n   1   190   0        1.0E+01   4.5E+01\n   1   190   1        1.0E+01   4.5E+01\n";
        assert_eq!(iterations(text), 1);
    }
}
