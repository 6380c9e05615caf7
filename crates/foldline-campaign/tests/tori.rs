//! Tori against simulation.

use foldline_campaign::tori::{Report, examine};

/// Two cases; `--tori 50` examines more. The first ends where the torus shrinks to a cycle, and once went back from there.
#[test]
fn no_torus_is_reported_where_the_motion_is_locked() {
    let mut report = Report::default();
    [0, 3].into_iter().for_each(|number| report.add(examine(number)));
    assert!(report.good(), "{report}{:#?}{:#?}", report.wrong, report.other);
    // Guards against a comparison of nothing.
    assert!(report.points >= 20 && report.simulated >= 6 && report.verified >= 6, "{report}");
}
