//! Report of a campaign.

use crate::errors::Honesty;
use std::fmt;

/// Counts and failures.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Number of cases.
    pub cases: usize,
    /// Number of branches.
    pub branches: usize,
    /// Number of continuation runs.
    pub runs: usize,
    /// Number of accepted points.
    pub points: usize,
    /// Number of special points on the branches, each counted once.
    pub special: usize,
    /// Number of solutions that could not be carried to the parameters of the case.
    pub not_brought: usize,
    /// Number of sides that ended, by the code of the ending.
    pub endings: Vec<(String, usize)>,
    /// Sides that ended short, one line each with the reason.
    pub short: Vec<String>,
    /// Differences in special points or ends between a run and the first one, one line each.
    pub differences: Vec<String>,
    /// Unexplained changes of stability, one line each.
    pub unexplained: Vec<String>,
    /// Errors of the points that were recomputed.
    pub honesty: Vec<Honesty>,
    /// Number of points that could not be recomputed.
    pub not_again: usize,
    /// Points and special points of every run, for inspection.
    pub traces: Vec<String>,
}

impl Report {
    /// Adds another report.
    pub fn add(&mut self, mut other: Report) {
        self.cases += other.cases;
        self.branches += other.branches;
        self.runs += other.runs;
        self.points += other.points;
        self.special += other.special;
        self.not_brought += other.not_brought;
        self.not_again += other.not_again;
        other.endings.into_iter().for_each(|(code, count)| self.ended(&code, count));
        self.short.append(&mut other.short);
        self.differences.append(&mut other.differences);
        self.unexplained.append(&mut other.unexplained);
        self.honesty.append(&mut other.honesty);
        self.traces.append(&mut other.traces);
    }

    /// Counts sides that ended with the given code.
    pub fn ended(&mut self, code: &str, count: usize) {
        match self.endings.iter_mut().find(|(known, _)| known == code) {
            Some((_, total)) => *total += count,
            None => self.endings.push((code.to_string(), count)),
        }
    }

    /// True without differences, unexplained changes of stability and sides that ended short.
    pub fn good(&self) -> bool {
        self.differences.is_empty() && self.unexplained.is_empty() && self.short.is_empty()
    }

    /// Returns two fractions of the recomputed points: those whose true error is at most the stated one, and those
    /// whose stated error is at most 100 times the true one.
    pub fn shares(&self) -> [f64; 2] {
        let all = self.honesty.len().max(1) as f64;
        let count = |kept: &dyn Fn(&Honesty) -> bool| self.honesty.iter().filter(|h| kept(h)).count() as f64 / all;
        [count(&|h| h.found <= h.stated), count(&|h| h.stated <= 100.0 * h.found)]
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(
            f,
            "{} cases, {} branches followed {} times, {} points, {} special points",
            self.cases, self.branches, self.runs, self.points, self.special
        )?;
        let endings: Vec<String> = self.endings.iter().map(|(code, count)| format!("{code} {count}")).collect();
        writeln!(f, "sides ended: {}", endings.join(", "))?;
        writeln!(
            f,
            "{} ended short, {} differences between runs, {} changes of stability unexplained, {} solutions not brought \
             to the parameters of their case",
            self.short.len(),
            self.differences.len(),
            self.unexplained.len(),
            self.not_brought
        )?;
        let [honest, sharp] = self.shares();
        writeln!(
            f,
            "{} points computed again ({} did not converge): true error within the stated one in {:.2} %, stated error within 100 \
             times the true one in {:.2} %",
            self.honesty.len(),
            self.not_again,
            100.0 * honest,
            100.0 * sharp
        )?;
        let share = |kept: &dyn Fn(&Honesty) -> bool| {
            100.0 * self.honesty.iter().filter(|h| kept(h)).count() as f64 / self.honesty.len().max(1) as f64
        };
        let worst = self.honesty.iter().map(|h| h.multipliers / h.stated_multipliers.max(1e-300)).fold(0.0, f64::max);
        writeln!(
            f,
            "multipliers within what is stated in {:.2} %, at worst {worst:.1} times that; stated error within 100 times the true one \
             in {:.2} %",
            share(&|h| h.multipliers <= h.stated_multipliers),
            share(&|h| h.stated_multipliers <= 100.0 * h.multipliers)
        )
    }
}
