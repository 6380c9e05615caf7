//! A small campaign, and cases that once failed.

use foldline_campaign::cases::{Case, classical};
use foldline_campaign::report::Report;
use foldline_campaign::rotor::rotors;
use foldline_campaign::{campaign, cases};

fn of(cases: &[Case]) -> Report {
    campaign(cases, 2, &|_, _| ())
}

#[track_caller]
fn comes_out_the_same(report: &Report) {
    let failed: Vec<&String> = report.short.iter().chain(&report.differences).chain(&report.unexplained).collect();
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn rotors_come_out_the_same_however_they_are_followed_and_their_errors_are_what_they_state() {
    let report = of(&rotors(0..12));
    comes_out_the_same(&report);
    let [honest, sharp] = report.shares();
    assert!(report.branches >= 20 && report.honesty.len() >= 80, "{report}");
    assert!(honest >= 0.99 && sharp >= 0.9, "{report}");
}

#[test]
fn classical_problems_come_out_the_same_however_they_are_followed() {
    let quick = ["cusp", "predator", "FitzHugh", "Lur'e", "Stuart", "Brusselator"];
    let chosen: Vec<Case> =
        classical(1).into_iter().filter(|case| quick.iter().any(|name| case.name.starts_with(name))).collect();
    assert_eq!(chosen.len(), quick.len());
    comes_out_the_same(&of(&chosen));
}

#[test]
fn a_branch_that_begins_next_to_a_fold_closes_after_one_lap() {
    // 4:1, which went round twelve times; and 7:3, 138 special points instead of 3.
    comes_out_the_same(&of(&rotors(3..4)));
    comes_out_the_same(&of(&rotors(63..64)));
}

#[test]
fn a_doubled_cycle_that_was_sampled_ends_at_its_period_doubling() {
    // Its branch turned round there at spurious folds, or jumped.
    for number in [59, 162] {
        let report = of(&rotors(number..number + 1));
        comes_out_the_same(&report);
        assert!(report.endings.iter().any(|(code, count)| code == "joined" && *count > 0), "{report}");
    }
}

#[test]
fn two_period_doublings_between_two_points_are_not_passed_over() {
    // 4:1 of the cubic spring: a pair of multipliers meets at -1, one passes it, and both come back within a step.
    comes_out_the_same(&of(&rotors(72..73)));
}

#[test]
fn hopf_points_and_folds_in_a_wiggle_shorter_than_a_step_are_not_passed_over() {
    comes_out_the_same(&of(&rotors(55..56)));
    comes_out_the_same(&of(&rotors(167..168)));
}

#[test]
fn hopf_points_next_to_no_damping_state_what_rounding_does() {
    comes_out_the_same(&of(&rotors(31..32)));
}

#[test]
fn the_texts_of_all_cases_are_right() {
    assert!(cases::classical(1).len() >= 11);
}
