//! Models of several fields whose parameters are drawn at random.
//!
//! **Idea.** Each problem states the model, the range of each random parameter, a start and a branch. The ranges are
//! those used in the field of the model. Each case draws all its parameters from a random stream of its own.

mod coupled;
mod ecology;
mod forced;
mod kinetics;
mod neurons;

use crate::TOLERANCE;
use crate::cases::{Case, First, study};
use crate::random::Random;

/// Parameter and the distribution from which it is drawn.
#[derive(Clone, Copy, Debug)]
pub enum Draw {
    /// Uniform between the two bounds.
    Uniform(&'static str, f64, f64),
    /// Uniform in the logarithm.
    Logarithmic(&'static str, f64, f64),
}

impl Draw {
    pub(crate) fn value(self, random: &mut Random) -> (&'static str, f64) {
        match self {
            Draw::Uniform(name, low, high) => (name, random.uniform(low, high)),
            Draw::Logarithmic(name, low, high) => (name, random.logarithmic(low, high)),
        }
    }
}

/// Model, ranges of its parameters, and lines of the tables `seed` and `branch`. `{name}` in the seed stands for the
/// value drawn for that parameter.
#[derive(Clone, Copy, Debug)]
pub struct Problem {
    /// Name in the report.
    pub name: &'static str,
    /// Text of the model file.
    pub model: &'static str,
    /// Parameters that are drawn.
    pub draws: &'static [Draw],
    /// State or attractor from which the branch starts.
    pub start: &'static str,
    /// Free parameter, range, and where to switch.
    pub branch: &'static str,
    /// See [`Case::bounded`]: the model has a single equilibrium, which is never a saddle.
    pub bounded: bool,
}

/// Returns every problem, field by field.
pub fn problems() -> impl Iterator<Item = &'static Problem> {
    [neurons::PROBLEMS, kinetics::PROBLEMS, ecology::PROBLEMS, coupled::PROBLEMS, forced::PROBLEMS]
        .into_iter()
        .flatten()
}

/// Returns the cases with the given numbers; consecutive numbers cycle through the problems.
pub fn drawn(numbers: std::ops::Range<usize>) -> Vec<Case> {
    let all: Vec<&Problem> = problems().collect();
    numbers.map(|number| all[number % all.len()].case(number)).collect()
}

impl Problem {
    fn case(&self, number: usize) -> Case {
        let mut random = Random::new(330_000 + number as u64);
        let values: Vec<(&str, f64)> = self.draws.iter().map(|draw| draw.value(&mut random)).collect();
        let mut start = self.start.to_string();
        for (name, value) in &values {
            start = start.replace(&format!("{{{name}}}"), &format!("{value:?}"));
        }
        let parameters: Vec<String> = values.iter().map(|(name, value)| format!("{name} = {value:?}")).collect();
        let seed = format!("{start}\nparameters = {{ {} }}", parameters.join(", "));
        let shown: Vec<String> = values.iter().map(|(name, value)| format!("{name} {value:.4}")).collect();
        Case {
            name: format!("drawn {number}, {} ({})", self.name, shown.join(", ")),
            study: study(self.model, &seed, self.branch),
            first: First::Planned,
            tolerance: TOLERANCE,
            bounded: self.bounded,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_problem_is_a_valid_study_for_all_drawn_parameters() {
        // `study` panics on an invalid text, such as one with undeclared parameters.
        let count = problems().count();
        let cases = drawn(0..20 * count);
        assert!(count >= 20 && cases.len() == 20 * count);
    }

    #[test]
    fn drawn_values_stay_within_their_ranges_and_differ_from_case_to_case() {
        for problem in problems() {
            for draw in problem.draws {
                let (Draw::Uniform(_, low, high) | Draw::Logarithmic(_, low, high)) = *draw;
                let mut random = Random::new(1);
                let values: Vec<f64> = (0..50).map(|_| draw.value(&mut random).1).collect();
                assert!(values.iter().all(|value| (low..=high).contains(value)), "{}", problem.name);
                assert!(values[0] != values[1], "{}", problem.name);
            }
        }
    }
}
