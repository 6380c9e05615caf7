//! Diagrams do not depend on the units in which a model is written.

use foldline_campaign::{LIMIT, cases, drawn, rescaled};

/// Draws of units for each case: of the 29 branches of one draw, the share with as many points varies by several.
const DRAWS: usize = 6;

#[test]
fn states_parameters_and_time_in_any_units_give_the_same_diagrams() {
    let chosen = ["FitzHugh", "Brusselator", "Lorenz equilibria", "predator", "Wilson", "Oregonator", "parametric"];
    let all = cases::classical(1).into_iter().chain(drawn::drawn(0..24));
    let cases: Vec<_> = all.filter(|case| chosen.iter().any(|name| case.name.contains(name))).collect();
    assert!(cases.len() >= chosen.len());
    let report = rescaled::rescaled(&cases, DRAWS, LIMIT, &|_| {});
    assert!(report.differences.is_empty(), "{}", report.differences.join("\n"));
    // Only in a few cases does rounding change where steps end.
    assert!(report.branches >= 10 && 5 * report.as_many >= 4 * report.branches, "{report}");
}
