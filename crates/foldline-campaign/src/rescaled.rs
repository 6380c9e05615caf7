//! Invariance of diagrams under changes of units.
//!
//! **Idea.** A diagram must not depend on the units in which a model is written. Every state, every parameter and the
//! time of a case are multiplied by powers of ten, in the equations, the ranges and the study. The result is converted
//! back to the original units and compared: branches and their ends, parameters and periods of special points within
//! their stated errors, stability, and eigenvalues of equilibria.

use crate::cases::Case;
use crate::random::Random;
use crate::same::differences;
use crate::watch::Watch;
use foldline::diagram::{Branch, Diagram, Point, Solution, SpecialPoint};
use foldline::explore::{self, Plan, SeedSource, System};
use foldline::model::{Model, ModelSource};
use foldline_store::model_file::parse_source;
use std::fmt;
use std::time::Duration;

/// Largest exponent of ten.
const MOST: i32 = 12;

/// Factors by which the quantities are multiplied.
#[derive(Clone, Debug)]
struct Units {
    states: Vec<f64>,
    parameters: Vec<f64>,
    time: f64,
}

/// Result of the comparison.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Number of cases in other units.
    pub cases: usize,
    /// Number of branches in the original units.
    pub branches: usize,
    /// Number of branches with the same number of points in the other units.
    pub as_many: usize,
    /// Number of points in the original and in the other units.
    pub points: [usize; 2],
    /// Number of special points in the original units.
    pub special: usize,
    /// Differences, one line each.
    pub differences: Vec<String>,
}

impl Report {
    fn add(&mut self, mut other: Report) {
        self.cases += other.cases;
        self.branches += other.branches;
        self.as_many += other.as_many;
        (0..2).for_each(|k| self.points[k] += other.points[k]);
        self.special += other.special;
        self.differences.append(&mut other.differences);
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(
            f,
            "{} cases in other units, {} branches, {} with as many points ({} and {} in all), {} special points",
            self.cases, self.branches, self.as_many, self.points[0], self.points[1], self.special
        )?;
        writeln!(f, "{} differences", self.differences.len())
    }
}

/// Runs every case in `draws` sets of random units and compares the results with those in the original units.
pub fn rescaled(cases: &[Case], draws: usize, limit: Duration, tell: &dyn Fn(&Report)) -> Report {
    let mut whole = Report::default();
    for (number, case) in cases.iter().enumerate() {
        let base = run(case.model(), &case.study.plan, limit);
        for draw in 0..draws {
            let report = compared(case, base.as_ref(), (number * draws + draw) as u64, limit);
            tell(&report);
            whole.add(report);
        }
    }
    whole
}

fn run(model: &Model, plan: &Plan, limit: Duration) -> Option<Diagram> {
    let watch = Watch::start(limit);
    let diagram = explore::run(&System::of_plan(model, plan), plan, 1, Diagram::default(), &watch);
    (!watch.over()).then_some(diagram)
}

fn compared(case: &Case, base: Option<&Diagram>, number: u64, limit: Duration) -> Report {
    let mut report = Report { cases: 1, ..Report::default() };
    let units = Units::drawn(case.model(), number);
    let place = format!("{} {units}", case.name);
    let (model, plan) = (units.model(&case.study.model_text), units.plan(&case.study.plan));
    let other = run(&model, &plan, limit);
    let (Some(base), Some(other)) = (base, other) else {
        report.differences.push(format!("{place}: it did not end within its time"));
        return report;
    };
    for branch in &base.branches {
        report.branches += 1;
        report.points[0] += branch.points.len();
        report.special += branch.special.len();
        let Some(found) = other.branch(&branch.name) else {
            report.differences.push(format!("{place}: {} is missing", branch.name));
            continue;
        };
        report.points[1] += found.points.len();
        report.as_many += usize::from(found.points.len() == branch.points.len());
        let back = units.back(found, branch);
        let mut lines = differences(branch, &back, 0.0);
        if lines.is_empty() {
            lines = others(branch, &back);
        }
        if let Some(first) = lines.first() {
            let more = if lines.len() > 1 { format!(", and {} more", lines.len() - 1) } else { String::new() };
            report.differences.push(format!("{place}: {}: {first}{more}", branch.name));
        }
        let codes =
            |b: &Branch| b.ends.iter().map(|end| end.as_ref().map_or("none", |end| end.code())).collect::<Vec<_>>();
        if codes(branch) != codes(&back) {
            let line = format!("{place}: {}: ends {:?} instead of {:?}", branch.name, codes(&back), codes(branch));
            report.differences.push(line);
        }
    }
    let new = other.branches.iter().filter(|own| base.branch(&own.name).is_none());
    report.differences.extend(new.map(|own| format!("{place}: {} is new", own.name)));
    report
}

/// Returns differences between matching special points: in the period, the numbers of unstable eigenvalues or
/// multipliers, and the largest eigenvalue.
fn others(base: &Branch, back: &Branch) -> Vec<String> {
    /// Factor by which an eigenvalue may be more sensitive than the parameter.
    const SENSITIVE: f64 = 1e3;
    let value = |special: &SpecialPoint| special.point.parameters[base.free];
    let period = |special: &SpecialPoint| special.point.solution.period().unwrap_or(1.0);
    let modulus = |point: &Point| point.spectrum.iter().fold(0.0, |most: f64, z| most.max(z.norm()));
    // Relative to the whole branch, because at a fold of a scalar equation the only eigenvalue vanishes.
    let size = base.points.iter().map(modulus).fold(0.0, f64::max);
    let mut lines = Vec::new();
    for special in &base.special {
        let off = |other: &&SpecialPoint| {
            (value(other) - value(special)).abs() / base.size(value(special))
                + (period(other) / period(special)).ln().abs()
        };
        let nearest = back.special.iter().filter(|other| other.kind == special.kind);
        let Some(other) = nearest.min_by(|a, b| off(a).total_cmp(&off(b))) else { continue };
        let allowed = special.error + other.error;
        let place = format!("{} {:.9}", special.kind, value(special));
        let periods = [special, other].map(period);
        if (periods[0] / periods[1]).ln().abs() > allowed {
            lines.push(format!("{place}: the period is {} instead of {}", periods[1], periods[0]));
        }
        // A branch may be traversed in the opposite direction.
        let counts = [special, other].map(|own| {
            let [a, b] = [own.unstable_before, own.unstable_after];
            [a.min(b), a.max(b)]
        });
        if counts[0] != counts[1] {
            lines.push(format!("{place}: {:?} unstable instead of {:?}", counts[1], counts[0]));
        }
        let largest = [special, other].map(|own| modulus(&own.point));
        let at_rest = special.point.solution.period().is_none();
        if at_rest && (largest[0] - largest[1]).abs() > (SENSITIVE * allowed).max(1e-9) * size {
            lines.push(format!("{place}: an eigenvalue of modulus {} instead of {}", largest[1], largest[0]));
        }
    }
    lines
}

impl fmt::Display for Units {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "[states {:?}, parameters {:?}, time {:?}]", self.states, self.parameters, self.time)
    }
}

impl Units {
    fn drawn(model: &Model, number: u64) -> Units {
        let mut random = Random::new(340_000 + number);
        let mut power = || 10f64.powi(random.uniform(f64::from(-MOST), f64::from(MOST + 1)).floor() as i32);
        let mut states: Vec<f64> = model.states.iter().map(|_| power()).collect();
        // The two states of a complex signal share a unit.
        if let Some([u, v]) = model.whirl {
            states[v] = states[u];
        }
        Units { states, parameters: model.parameters.iter().map(|_| power()).collect(), time: power() }
    }

    /// Returns the model in these units.
    fn model(&self, text: &str) -> Model {
        let source = parse_source(text, "model").unwrap_or_else(|found| panic!("{text}\n{found:?}"));
        let factor = |name: &str| {
            let state = source.states.iter().position(|s| s.name == name).map(|i| self.states[i]);
            let parameter = source.parameters.iter().position(|p| p.name == name).map(|i| self.parameters[i]);
            state.or(parameter).or((name == "t" && source.forcing.is_some()).then_some(self.time))
        };
        let replaced = |expression: &str| replaced(expression, &factor);
        let mut new: ModelSource = source.clone();
        for (parameter, factor) in new.parameters.iter_mut().zip(&self.parameters) {
            parameter.value *= factor;
            parameter.scale = parameter.scale.map(|scale| scale * factor);
        }
        for (state, factor) in new.states.iter_mut().zip(&self.states) {
            state.scale = state.scale.map(|scale| scale * factor);
            state.range = state.range.map(|range| range.map(|end| end * factor));
        }
        for equation in &mut new.equations {
            let own = factor(&equation.name).unwrap_or(1.0) / self.time;
            equation.expression = format!("{own:?}*({})", replaced(&equation.expression));
        }
        new.definitions.iter_mut().for_each(|own| own.expression = replaced(&own.expression));
        new.outputs.iter_mut().for_each(|own| own.expression = replaced(&own.expression));
        if let Some(forcing) = &mut new.forcing {
            let own = if forcing.is_frequency { 1.0 / self.time } else { self.time };
            forcing.expression = format!("{own:?}*({})", replaced(&forcing.expression));
        }
        Model::compile(new).unwrap_or_else(|found| panic!("{text}\n{found:?}"))
    }

    fn plan(&self, plan: &Plan) -> Plan {
        let mut new = plan.clone();
        for seed in &mut new.seeds {
            seed.parameters.iter_mut().zip(&self.parameters).for_each(|(value, factor)| *value *= factor);
            if let SeedSource::State(state) = &mut seed.source {
                state.iter_mut().zip(&self.states).for_each(|(x, factor)| *x *= factor);
            }
        }
        for branch in &mut new.branches {
            branch.range = branch.range.map(|end| end * self.parameters[branch.free]);
            branch.until = branch.until.map(|end| end * self.parameters[branch.free]);
        }
        new
    }

    /// Converts a branch back to the original units, in which it is `base`.
    fn back(&self, branch: &Branch, base: &Branch) -> Branch {
        let mut new = branch.clone();
        new.units = base.units;
        new.points
            .iter_mut()
            .chain(new.special.iter_mut().map(|special| &mut special.point))
            .for_each(|p| self.point(p));
        new
    }

    fn point(&self, point: &mut Point) {
        point.parameters.iter_mut().zip(&self.parameters).for_each(|(value, factor)| *value /= factor);
        point.ranges.iter_mut().zip(&self.states).for_each(|(range, factor)| *range = range.map(|end| end / factor));
        match &mut point.solution {
            Solution::Equilibrium(x) => {
                x.iter_mut().zip(&self.states).for_each(|(x, factor)| *x /= factor);
                point.spectrum.iter_mut().for_each(|z| *z *= self.time);
            }
            Solution::Torus(torus) => {
                torus.period /= self.time;
                torus.profile.iter_mut().zip(self.states.iter().cycle()).for_each(|(x, factor)| *x /= factor);
            }
            Solution::Cycle(cycle) => {
                cycle.period /= self.time;
                cycle.profile.iter_mut().zip(self.states.iter().cycle()).for_each(|(x, factor)| *x /= factor);
            }
        }
    }
}

/// Divides every name in an expression that has a `factor` by that factor.
fn replaced(expression: &str, factor: &dyn Fn(&str) -> Option<f64>) -> String {
    let mut new = String::new();
    let mut rest = expression;
    while let Some(first) = rest.chars().next() {
        let starts = first.is_alphabetic() || first == '_';
        // A number includes its exponent.
        let belongs = |c: char| c.is_alphanumeric() || c == '_' || (!starts && c == '.');
        let length = match starts || first.is_ascii_digit() || first == '.' {
            true => rest.find(|c| !belongs(c)).unwrap_or(rest.len()),
            false => first.len_utf8(),
        };
        let (word, after) = rest.split_at(length);
        match factor(word).filter(|_| starts) {
            Some(factor) => new += &format!("({word}*{:?})", 1.0 / factor),
            None => new += word,
        }
        rest = after;
    }
    new
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_replaced_and_numbers_and_functions_are_not() {
        let factor = |name: &str| (name == "e" || name == "x1").then_some(0.5);
        let text = "1e-3*exp(e) + x1^2 - .5e2*x12";
        assert_eq!(replaced(text, &factor), "1e-3*exp((e*2.0)) + (x1*2.0)^2 - .5e2*x12");
    }
}
