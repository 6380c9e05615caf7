//! Derivatives and their errors on random models, against differences of the solved defining systems.

use super::tests::{Followed, followed, model};
use super::uncertainty::solved;
use super::with_base;
use crate::attractors::SplitMix64;
use crate::diagram::Kind;
use crate::explore::System;

const NAMES: [&str; 9] = ["a", "b", "c", "d", "e", "f", "g", "h", "k"];

/// Planar cubic system with random coefficients, whose solutions are bounded.
fn random(seed: u64) -> Followed {
    let mut numbers = SplitMix64(seed);
    let mut next = || 4.0 * ((numbers.next() >> 11) as f64 * (-53f64).exp2() - 0.5);
    let mut parameters: Vec<(&str, f64)> = NAMES.iter().map(|name| (*name, next())).collect();
    parameters[0].1 = 0.3;
    let equations = [("x", "a + b*x + c*y + d*x*y + e*x^2 - x^3"), ("y", "f + g*x + h*y + k*y^2 - y^3")];
    followed(model(&parameters, &equations, &[("r", "x*y + b*x^2")]), &[0.1, -0.2], [-3.0, 3.0], &[Kind::Hopf])
}

#[test]
fn stated_errors_contain_the_differences_on_random_models() {
    let (mut compared, mut kinds) = (0, std::collections::BTreeMap::new());
    for seed in 1..=24 {
        let own = random(seed);
        let system = System::of_plan(&own.model, &own.plan).in_units_of(&own.diagram);
        for branch in &own.diagram.branches {
            for special in &branch.special {
                if !matches!(special.kind, Kind::Fold | Kind::Hopf | Kind::Torus | Kind::PeriodDoubling) {
                    continue;
                }
                let result = with_base(&system, branch, special, &own.plan, |posed, base| {
                    let (found, route) = (posed.sensitivities(base)?, posed.route(base)?);
                    for (column, index) in found.parameters.iter().enumerate() {
                        let step = 1e-3 * (0.1 + base.parameters[*index].abs());
                        let at = |k: f64| solved(posed, base, &route, &[(*index, k * step)]);
                        let values = [-4.0, -2.0, -1.0, 1.0, 2.0, 4.0].map(at);
                        let Ok([a, b, c, d, e, f]) =
                            <[Vec<f64>; 6]>::try_from(values.into_iter().collect::<Result<Vec<_>, String>>()?)
                        else {
                            return Err("six values".into());
                        };
                        for (r, row) in found.rows.iter().enumerate() {
                            let Ok(own) = &row.by[column] else { continue };
                            let fine = (b[r] - 8.0 * c[r] + 8.0 * d[r] - e[r]) / (12.0 * step);
                            let coarse = (a[r] - 8.0 * b[r] + 8.0 * e[r] - f[r]) / (24.0 * step);
                            // Truncation of the finer difference, and rounding and discretisation of its values.
                            let allowed = (coarse - fine).abs() / 8.0 + 1e-10 * (1.0 + row.value.abs()) / step;
                            assert!(
                                (own.value - fine).abs() <= own.error + allowed,
                                "model {seed}, {} of {}: {:?} by {}: {own:?}, difference {fine} ± {allowed:.1e}",
                                special.kind,
                                branch.name,
                                row.of,
                                NAMES[*index]
                            );
                            compared += 1;
                        }
                    }
                    Ok(())
                });
                *kinds.entry((special.kind, branch.name.contains("hopf"), result.is_ok())).or_insert(0) += 1;
                println!("model {seed}, {} of {}: {result:?}", special.kind, branch.name);
            }
        }
    }
    println!("{compared} derivatives, {kinds:?}");
    assert!(compared > 500, "{compared}");
    let failed: usize = kinds.iter().filter(|((_, _, ok), _)| !ok).map(|(_, count)| count).sum();
    assert!(20 * failed <= kinds.values().sum::<usize>(), "{kinds:?}");
}
