//! Diagrams do not depend on the units in which a model is written.

use foldline_campaign::{LIMIT, cases, drawn, rescaled};

#[test]
fn states_parameters_and_time_in_any_units_give_the_same_diagrams() {
    let chosen = ["FitzHugh", "Brusselator", "Lorenz equilibria", "predator", "Wilson", "Oregonator", "parametric"];
    let all = cases::classical(1).into_iter().chain(drawn::drawn(0..24));
    let cases: Vec<_> = all.filter(|case| chosen.iter().any(|name| case.name.contains(name))).collect();
    assert!(cases.len() >= chosen.len());
    let report = rescaled::rescaled(&cases, 1, LIMIT, &|_| {});
    assert!(report.differences.is_empty(), "{}", report.differences.join("\n"));
    // Only in a few cases does rounding change where steps end: 6 of 29 branches.
    assert!(report.branches >= 10 && 4 * report.as_many >= 3 * report.branches, "{report}");
}
