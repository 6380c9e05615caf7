//! Phases of a cycle between its switchings: contact and flight, sticking and slipping.
//!
//! **Idea.** A stored cycle has a mesh node at every switching, so that a switch has one sign on each interval of its
//! mesh: that in the middle. Neighbouring intervals with the same signs are one phase.
//!
//! **Fails when** a mesh does not have these nodes, as that of a cycle read from another program.

use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::Cycle;

/// Value of a switch, relative to its largest along the cycle, on its surface.
const ON_SURFACE: f64 = 1e-8;

/// A phase of a cycle.
#[derive(Clone, Debug, PartialEq)]
pub struct Phase {
    /// Sign of every switch: -1, 1, or 0 while the orbit slides along its surface.
    pub signs: Vec<i8>,
    /// Share of the period.
    pub share: f64,
}

/// The phases of a cycle in the order of time, from the first switching on; a single one if it does not switch. Empty
/// for a map, and for a cycle without profile.
pub fn phases(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle) -> Vec<Phase> {
    let (n, count, intervals) = (field.dim(), field.switch_count(), cycle.intervals());
    let block = (cycle.degree + 1) * n;
    if cycle.degree == 0 || cycle.profile.len() != intervals * block || count == 0 {
        return Vec::new();
    }
    let scheme = cycle.scheme();
    let (mut states, mut x) = (vec![0.0; n * intervals], vec![0.0; n]);
    for (j, nodes) in cycle.profile.chunks_exact(block).enumerate() {
        scheme.value_into(0.5, nodes, &mut x);
        (0..n).for_each(|c| states[c * intervals + j] = x[c]);
    }
    let forced = f64::from(cycle.forcing_periods);
    let times: Vec<f64> = match cycle.forcing_periods {
        0 => Vec::new(),
        _ => cycle.mesh.windows(2).map(|ends| 0.5 * forced * (ends[0] + ends[1])).collect(),
    };
    let mut values = vec![0.0; count * intervals];
    let parameters = Parameters::Shared(parameters);
    field.switches(Batch { lanes: intervals, states: &states, parameters, times: &times, signs: &[] }, &mut values);
    let sizes: Vec<f64> =
        values.chunks_exact(intervals).map(|own| own.iter().fold(0.0, |most: f64, v| most.max(v.abs()))).collect();
    let sign = |k: usize, j: usize| match values[k * intervals + j] {
        value if value.abs() <= ON_SURFACE * sizes[k] => 0,
        value if value > 0.0 => 1,
        _ => -1,
    };
    let mut all: Vec<Phase> = Vec::new();
    for (j, ends) in cycle.mesh.windows(2).enumerate() {
        let own = Phase { signs: (0..count).map(|k| sign(k, j)).collect(), share: ends[1] - ends[0] };
        match all.last_mut() {
            Some(last) if last.signs == own.signs => last.share += own.share,
            _ => all.push(own),
        }
    }
    // The phase that the end of the period divides.
    if all.len() > 1 && all[0].signs == all[all.len() - 1].signs {
        let first = all.remove(0);
        let last = all.len() - 1;
        all[last].share += first.share;
    }
    all
}

/// Number of phases per period in which a switch is positive.
pub fn times_positive(all: &[Phase], switch: usize) -> usize {
    let positive = |k: usize| all[k % all.len()].signs[switch] > 0;
    match all.len() {
        0 => 0,
        1 => usize::from(positive(0)),
        count => (0..count)
            .filter(|k| positive(*k) && !positive(k + count - 1))
            .count()
            .max(usize::from((0..count).all(positive))),
    }
}

/// Share of the period in which a switch is positive.
pub fn share_positive(all: &[Phase], switch: usize) -> f64 {
    all.iter().filter(|phase| phase.signs[switch] > 0).fold(0.0, |sum, phase| sum + phase.share)
}

/// The phases as text: the share of each, and the signs of the switches in it.
pub fn sequence(field: &dyn VectorField, all: &[Phase]) -> String {
    let names: Vec<String> = (0..field.switch_count()).map(|switch| field.switch_name(switch)).collect();
    let one = |phase: &Phase| {
        let signs = phase.signs.iter().zip(&names).map(|(sign, name)| {
            let relation = ["<", "=", ">"][usize::from(sign.saturating_add(1).unsigned_abs())];
            format!("{name} {relation} 0")
        });
        format!("{:.3}: {}", phase.share, signs.collect::<Vec<_>>().join(" and "))
    };
    all.iter().map(one).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Definition, Model, ModelSource, State};

    #[test]
    fn phases_follow_each_other_around_the_period() {
        let model = Model::compile(ModelSource {
            states: vec![State::new("x")],
            equations: vec![Definition::new("x", "-x - max(x - 1, 0)")],
            ..ModelSource::default()
        })
        .unwrap();
        // x = 0, 2, 3, 0 on the four intervals.
        let profile = [0.0, 2.0, 3.0, 0.0].iter().flat_map(|x| [*x; 3]).collect();
        let cycle = Cycle {
            points: crate::problem::gauss::Points::Gauss,
            period: 1.0,
            forcing_periods: 0,
            mesh: vec![0.0, 0.2, 0.3, 0.6, 1.0].into(),
            degree: 2,
            profile,
            gain: Vec::new(),
        };
        let all = phases(&model, &[], &cycle);
        assert_eq!(all.iter().map(|p| p.signs[0]).collect::<Vec<_>>(), [1, -1]);
        assert!((share_positive(&all, 0) - 0.4).abs() < 1e-15);
        assert_eq!(times_positive(&all, 0), 1);
        assert_eq!(sequence(&model, &all), "0.400: x - 1 > 0; 0.600: x - 1 < 0");
    }
}
