//! What is reported.

use crate::errors::Honesty;
use std::fmt;

/// Counts, and what failed.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Problems.
    pub cases: usize,
    /// Branches.
    pub branches: usize,
    /// Times that a branch was followed.
    pub runs: usize,
    /// Accepted points.
    pub points: usize,
    /// Special points of the branches, each once.
    pub special: usize,
    /// Solutions that could not be brought to the parameters of the case.
    pub not_brought: usize,
    /// Sides that ended, by the code of the ending.
    pub endings: Vec<(String, usize)>,
    /// Sides that ended short: where, and why.
    pub short: Vec<String>,
    /// Runs with other special points or ends than the first one: a line for each difference.
    pub differences: Vec<String>,
    /// Changes of stability without explanation.
    pub unexplained: Vec<String>,
    /// Points that were computed again.
    pub honesty: Vec<Honesty>,
    /// Points that could not be computed again.
    pub not_again: usize,
    /// The special points of every run, for those who look closer.
    pub traces: Vec<String>,
}

impl Report {
    /// Adds another one.
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

    /// Counts sides that ended like that.
    pub fn ended(&mut self, code: &str, count: usize) {
        match self.endings.iter_mut().find(|(known, _)| known == code) {
            Some((_, total)) => *total += count,
            None => self.endings.push((code.to_string(), count)),
        }
    }

    /// Whether everything came out as it should.
    pub fn good(&self) -> bool {
        self.differences.is_empty() && self.unexplained.is_empty() && self.short.is_empty()
    }

    /// Shares of the points that were computed again whose true error is at most the stated one, and whose stated one is at
    /// most 100 times the true one.
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
