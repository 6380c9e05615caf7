//! Evaluation of checks.

use super::expectations::{At, Check};
use super::quantities::{quantity, special_quantity};
use super::reporting::Verdict;
use super::running::Outcome;
use foldline::diagram::{Branch, Diagram, Ending, Kind, Point, Response, SpecialPoint};
use foldline::model::Model;

/// Result of a run, with its model.
struct Found<'a> {
    diagram: &'a Diagram,
    model: &'a Model,
    outcome: &'a Outcome,
}

/// Evaluates one check on the result of a run.
pub fn verdict(check: &Check, outcome: &Outcome) -> Verdict {
    if let Check::Says { words } = check {
        return Verdict::of(says(outcome, words), || "nothing says so".to_string());
    }
    let Some(stored) = &outcome.stored else { return Verdict::Wrong("nothing was stored".to_string()) };
    Found { diagram: &stored.diagram, model: &stored.model, outcome }.verdict(check)
}

fn says(outcome: &Outcome, words: &[String]) -> bool {
    let notes = outcome.stored.iter().flat_map(|stored| &stored.notes);
    let notes = notes.map(|(about, note)| format!("{about} {note}"));
    // Continuation lines of a message are indented.
    let messages = outcome.said.replace("\n  ", " ");
    let mut lines = messages.lines().map(str::to_string).chain(notes).map(|line| line.to_lowercase());
    lines.any(|line| words.iter().all(|word| line.contains(&word.to_lowercase())))
}

impl Found<'_> {
    fn verdict(&self, check: &Check) -> Verdict {
        match check {
            Check::Special { kind, branch, at, changes } => self.special(kind, branch, at, *changes),
            Check::Absent { kind, branch, at } => {
                let found = self.specials(kind, branch).find(|s| self.meets_special(s, at));
                Verdict::of(found.is_none(), || "there is one".to_string())
            }
            Check::Count { kind, branch, between: [least, most] } => {
                let found = self.specials(kind, branch).count();
                Verdict::of((*least..=*most).contains(&found), || format!("{found} of them"))
            }
            Check::Point { branch, at } => self.point(branch, at),
            Check::Ends { branch, code, at } => {
                let found = self.branches(branch).any(|b| (0..2).any(|side| self.ends(b, side, code, at)));
                Verdict::of(found, || format!("ends are {}", self.codes(branch)))
            }
            Check::Joins { kind, between, within } => self.joins(kind, *between, *within),
            Check::Unstable { branch, of, range, is } => self.unstable(branch, of, *range, *is),
            Check::Solutions { parameter, value, is } => {
                let found = self.solutions(parameter, *value);
                Verdict::of(found == *is, || format!("{found} of them"))
            }
            Check::Branches { at, is } => {
                let found = self.branches(&None).filter(|b| b.points.iter().any(|p| self.meets(p, at))).count();
                Verdict::of(found == *is, || format!("{found} of them"))
            }
            Check::Points { branch, most } => {
                let largest = self.branches(branch).map(|b| b.points.len()).max().unwrap_or(0);
                Verdict::of((1..=*most).contains(&largest), || format!("{largest} points"))
            }
            Check::Settles { set, motions, share } => self.settles(set, motions, *share),
            Check::Response { at, motion } => {
                let found = self.responses(&None).any(|r| r.motion.name() == motion && self.meets_response(r, at));
                Verdict::of(found, || "there is none".to_string())
            }
            Check::Says { words } => Verdict::of(says(self.outcome, words), || "nothing says so".to_string()),
        }
    }

    /// Returns the branch of the given name and all branches reached from it by switching, or every branch if `name` is
    /// `None`.
    fn branches<'b>(&'b self, name: &'b Option<String>) -> impl Iterator<Item = &'b Branch> {
        self.diagram.branches.iter().filter(move |branch| {
            name.as_ref().is_none_or(|name| {
                branch.name.strip_prefix(name.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
            })
        })
    }

    fn specials<'b>(&'b self, kind: &'b str, branch: &'b Option<String>) -> impl Iterator<Item = &'b SpecialPoint> {
        let wanted = Kind::from_name(kind);
        self.branches(branch).flat_map(|b| &b.special).filter(move |s| Some(s.kind) == wanted)
    }

    fn meets(&self, point: &Point, at: &At) -> bool {
        at.iter().all(|(name, [value, within])| {
            quantity(self.model, point, name).is_some_and(|found| (found - value).abs() <= *within)
        })
    }

    fn meets_special(&self, special: &SpecialPoint, at: &At) -> bool {
        self.distance(special, at) <= 1.0
    }

    /// Returns the largest deviation from the expected values, as a multiple of the permitted one.
    fn distance(&self, special: &SpecialPoint, at: &At) -> f64 {
        let far = |(name, [value, within]): (&String, &[f64; 2])| match special_quantity(self.model, special, name) {
            Some(found) if !found.is_nan() => (found - value).abs() / within,
            _ => f64::INFINITY,
        };
        at.iter().map(far).fold(0.0, f64::max)
    }

    fn special(&self, kind: &str, branch: &Option<String>, at: &At, changes: Option<[usize; 2]>) -> Verdict {
        if Kind::from_name(kind).is_none() {
            return Verdict::Wrong("no kind has that name".to_string());
        }
        let counts = |s: &SpecialPoint| {
            let mut counts = [s.unstable_before, s.unstable_after];
            counts.sort_unstable();
            counts
        };
        let sorted = changes.map(|[a, b]| [a.min(b), a.max(b)]);
        let fits = |s: &&SpecialPoint| self.meets_special(s, at) && sorted.is_none_or(|sorted| counts(s) == sorted);
        if self.specials(kind, branch).any(|s| fits(&s)) {
            return Verdict::Right;
        }
        let nearest = self.specials(kind, branch).min_by(|a, b| self.distance(a, at).total_cmp(&self.distance(b, at)));
        Verdict::Wrong(nearest.map_or("there is none".to_string(), |s| {
            let values =
                at.keys().filter_map(|name| special_quantity(self.model, s, name).map(|v| format!("{name} {v:.6e}")));
            let [before, after] = counts(s);
            format!("the nearest has {}, {before} to {after} unstable", values.collect::<Vec<_>>().join(", "))
        }))
    }

    fn point(&self, branch: &Option<String>, at: &At) -> Verdict {
        let special = self.branches(branch).flat_map(|b| &b.special).any(|s| self.meets_special(s, at));
        let found = special || self.branches(branch).flat_map(|b| &b.points).any(|p| self.meets(p, at));
        Verdict::of(found, || "there is none".to_string())
    }

    fn ends(&self, branch: &Branch, side: usize, code: &str, at: &At) -> bool {
        let Some(end) = branch.ends[side].as_ref().filter(|end| end.code() == code) else { return false };
        let last = if side == 0 { branch.points.first() } else { branch.points.last() };
        let free = self.model.parameters.get(branch.free).map(|p| p.name.as_str());
        at.iter().all(|(name, [value, within])| {
            let found = match end {
                Ending::Joined { parameter, .. } if Some(name.as_str()) == free => Some(*parameter),
                _ => last.and_then(|point| quantity(self.model, point, name)),
            };
            found.is_some_and(|found| (found - value).abs() <= *within)
        })
    }

    fn codes(&self, branch: &Option<String>) -> String {
        let ends = self.branches(branch).flat_map(|b| &b.ends);
        let mut codes: Vec<&str> = ends.map(|end| end.as_ref().map_or("none", |end| end.code())).collect();
        codes.sort_unstable();
        codes.dedup();
        codes.join(", ")
    }

    fn joins(&self, kind: &str, between: [f64; 2], within: f64) -> Verdict {
        let at = |end: &Option<Ending>, value: f64| {
            matches!(end, Some(Ending::Joined { at, parameter })
                if at.name() == kind && (parameter - value).abs() <= within)
        };
        let [low, high] = between;
        let found = self
            .diagram
            .branches
            .iter()
            .any(|b| at(&b.ends[0], low) && at(&b.ends[1], high) || at(&b.ends[0], high) && at(&b.ends[1], low));
        Verdict::of(found, || "no branch does".to_string())
    }

    fn unstable(&self, branch: &Option<String>, of: &str, [low, high]: [f64; 2], is: usize) -> Verdict {
        let inside = |p: &&Point| quantity(self.model, p, of).is_some_and(|value| value >= low && value <= high);
        let mut points = self.branches(branch).flat_map(|b| &b.points).filter(inside).peekable();
        if points.peek().is_none() {
            return Verdict::Wrong("no point lies there".to_string());
        }
        let other = points.find(|p| p.unstable != is);
        Verdict::of(other.is_none(), || other.map_or(String::new(), |p| format!("{} unstable at one", p.unstable)))
    }

    /// Counts the equilibria at a parameter value by linear interpolation between points. Equilibria that differ only
    /// in the signs of states count once.
    fn solutions(&self, parameter: &str, value: f64) -> usize {
        /// Relative difference below which equilibria are equal. Empirical: larger than the error of linear
        /// interpolation.
        const SAME: f64 = 1e-3;
        let states = self.model.states.len();
        let at = |p: &Point| quantity(self.model, p, parameter).unwrap_or(f64::NAN) - value;
        let mut found: Vec<Vec<f64>> = Vec::new();
        for pair in self.diagram.branches.iter().filter(|b| b.held.is_none()).flat_map(|b| b.points.windows(2)) {
            let (a, b) = (at(&pair[0]), at(&pair[1]));
            if a * b > 0.0 || (a * b).is_nan() || a == b {
                continue;
            }
            let share = a / (a - b);
            let state = |k: usize| (1.0 - share) * pair[0].ranges[k][1] + share * pair[1].ranges[k][1];
            let size: Vec<f64> = (0..states).map(|k| state(k).abs()).collect();
            let same = |known: &Vec<f64>| {
                known.iter().zip(&size).all(|(a, b)| (a - b).abs() <= SAME * (1.0 + a.abs().max(*b)))
            };
            if !found.iter().any(same) {
                found.push(size);
            }
        }
        found.len()
    }

    fn responses<'b>(&'b self, set: &'b Option<String>) -> impl Iterator<Item = &'b Response> {
        let sets = self.diagram.responses.iter().filter(move |r| set.as_ref().is_none_or(|name| *name == r.name));
        sets.flat_map(|r| &r.responses)
    }

    fn meets_response(&self, response: &Response, at: &At) -> bool {
        at.iter().all(|(name, [value, within])| {
            let found = match name.as_str() {
                "period" => response.period,
                "multiplicity" => Some(f64::from(response.multiplicity)),
                _ => self.response_quantity(response, name),
            };
            found.is_some_and(|found| (found - value).abs() <= *within)
        })
    }

    fn response_quantity(&self, response: &Response, name: &str) -> Option<f64> {
        if let Some(k) = self.model.parameters.iter().position(|p| p.name == name) {
            return response.parameters.get(k).copied();
        }
        let (bare, largest) =
            name.strip_suffix("_min").map_or((name.trim_end_matches("_max"), true), |bare| (bare, false));
        let mut names = self.model.states.iter().map(|s| &s.name).chain(self.model.outputs.iter().map(|o| &o.name));
        let k = names.position(|known| known == bare)?;
        response.ranges.get(k).map(|r| r[usize::from(largest)])
    }

    fn settles(&self, set: &Option<String>, motions: &[String], share: f64) -> Verdict {
        let (mut all, mut settled) = (0, 0);
        for response in self.responses(set) {
            all += response.hits;
            settled += if motions.iter().any(|m| m == response.motion.name()) { response.hits } else { 0 };
        }
        let enough = all > 0 && settled as f64 >= share * all as f64;
        Verdict::of(enough, || format!("{settled} of {all}"))
    }
}
