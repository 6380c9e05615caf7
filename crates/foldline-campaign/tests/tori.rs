//! Tori against simulation.

use foldline_campaign::tori::{Report, examine};

/// One case of each model, among them branches through tongues of locking.
#[test]
fn no_torus_is_reported_where_the_motion_is_locked() {
    let mut report = Report::default();
    (0..5).for_each(|number| report.add(examine(number)));
    assert!(report.good(), "{report}{:#?}{:#?}", report.wrong, report.other);
    // Guards against a comparison of nothing.
    assert!(report.points >= 20 && report.simulated >= 8 && report.verified >= 8, "{report}");
}
