//! A model as the exploration sees it.

use foldline::explore::{Plan, System};
use foldline::model::Model;

/// The system of a model at given parameters, with the scales and ranges of its states and the symmetries that it has there.
pub fn system<'m>(model: &'m Model, parameters: &[f64]) -> System<'m> {
    let mut system = System {
        scales: model.states.iter().map(|s| s.scale).collect(),
        // A parameter that is zero says nothing about its size.
        parameter_scales: model.parameters.iter().map(|p| if p.value == 0.0 { 1.0 } else { p.value.abs() }).collect(),
        ranges: model.states.iter().map(|s| s.range).collect(),
        whirl: model.whirl,
        ..System::new(model)
    };
    system.find_reflections(parameters);
    system
}

/// The system of a study. Only a symmetry that holds wherever the study goes counts: at every seed, and with the free
/// parameters away from values, such as zero, at which a model may be more symmetric than elsewhere.
pub fn system_of<'m>(model: &'m Model, plan: &Plan) -> System<'m> {
    const AWAY: f64 = 0.617;
    let mut places: Vec<Vec<f64>> = plan.seeds.iter().map(|seed| seed.parameters.clone()).collect();
    for seed in &plan.seeds {
        let mut place = seed.parameters.clone();
        for branch in &plan.branches {
            let [low, high] = branch.range;
            place[branch.free] = low + AWAY * (high - low);
        }
        places.push(place);
    }
    let mut systems = places.iter().map(|place| system(model, place));
    let Some(mut common) = systems.next() else { return System::new(model) };
    for other in systems {
        common.reflections.retain(|reflection| other.reflections.contains(reflection));
    }
    common
}

#[cfg(test)]
mod tests {
    use super::*;
    use foldline_store::study_file::parse_study;

    const MODEL: &str = "name = \"pitchfork\"\n[parameters]\nmu = 1\nh = 0\n[states]\nx = \"mu*x - x^3 + h\"\n";

    fn reflections(branch: &str) -> usize {
        let seed = "model = \"m\"\n[[seed]]\nname = \"s\"\nstate = { x = 1 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n";
        let study = parse_study(&format!("{seed}{branch}"), "study", MODEL, "model").unwrap();
        system_of(&study.model, &study.plan).reflections.len()
    }

    #[test]
    fn a_symmetry_that_the_free_parameter_breaks_is_none() {
        assert_eq!(reflections("free = \"mu\"\nrange = [-1, 2]\n"), 2);
        assert_eq!(reflections("free = \"h\"\nrange = [-1, 1]\n"), 1);
    }
}
