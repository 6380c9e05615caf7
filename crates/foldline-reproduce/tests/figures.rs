//! One test per figure, on the numbers that decide its claims.
//!
//! The studies are run as by the command, at a coarse tolerance, each in a folder of its own.

use foldline_reproduce::akay2022::PUBLICATION;
use foldline_reproduce::{Claim, Reproduced, Request, Verdict, reproduce};
use std::sync::atomic::AtomicBool;
use tempfile::TempDir;

/// Reproduces some figures at a tolerance of 1e-5.
fn figures(names: &[&str]) -> (Reproduced, TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let made = again(names, &folder, 1e-5);
    (made, folder)
}

fn again(names: &[&str], folder: &TempDir, tolerance: f64) -> Reproduced {
    let request = Request {
        publication: &PUBLICATION,
        figures: names.iter().map(|name| PUBLICATION.figure(name).unwrap()).collect(),
        out: folder.path().to_path_buf(),
        jobs: 2,
        tolerance: Some(tolerance),
        stop: &AtomicBool::new(false),
        say: &|_| {},
    };
    reproduce(&request).unwrap()
}

fn claim<'m>(made: &'m Reproduced, words: &str) -> &'m Claim {
    let found = made.claims.iter().find(|claim| claim.statement.contains(words));
    found.unwrap_or_else(|| panic!("no claim about {words}: {:?}", made.claims))
}

/// Numbers in the computed value of a claim.
fn numbers(claim: &Claim) -> Vec<f64> {
    let parts = claim.ours.split(|c: char| !c.is_ascii_digit() && c != '.' && c != '-');
    parts.filter_map(|part| part.trim_end_matches('.').parse().ok()).collect()
}

fn near(value: f64, expected: f64, tolerance: f64) -> bool {
    (value - expected).abs() < tolerance
}

#[test]
fn figure_3_the_smoothed_ring_pulls_as_much_as_its_formula_says() {
    let (made, folder) = figures(&["3"]);
    let found = numbers(claim(&made, "β = 10, K = 150"));
    // -0.139232 β/K at 1 - 0.639232/K, of which six decimals are printed.
    assert!(near(found[0], -0.139232 / 15.0, 1e-6) && near(found[1], 1.0 - 0.639232 / 150.0, 1e-6), "{found:?}");
    // The error falls like 1/K², and K = 15 β makes it less than 1e-4. There is no double loop with β = 6.
    let errors = claim(&made, "sharp enough");
    assert!(errors.verdict == Verdict::Refined && errors.ours.matches("e-").count() == 3, "{errors:?}");
    let enough = numbers(claim(&made, "as exact for SL"));
    assert!(near(enough[0], 56.8, 3.0), "{enough:?}");
    // A second call reads the table back.
    let table = folder.path().join("runs/sharpness.table");
    let written = std::fs::metadata(&table).unwrap().modified().unwrap();
    again(&["3"], &folder, 1e-5);
    assert_eq!(std::fs::metadata(&table).unwrap().modified().unwrap(), written);
    assert!(folder.path().join("figure-03.svg").exists() && folder.path().join("figure-03.png").exists());
}

#[test]
fn figure_4_both_flows_reach_the_sampled_branch() {
    let (made, _folder) = figures(&["4"]);
    for family in ["SL", "DL"] {
        assert_eq!(claim(&made, &format!("reaches contact {family}")).verdict, Verdict::Agrees, "{family}");
    }
}

#[test]
fn figures_5_6_and_7_are_made_from_one_run() {
    let (made, folder) = figures(&["5", "6", "7"]);
    for family in ["SL", "DL"] {
        assert_eq!(claim(&made, &format!("lines of {family}")).verdict, Verdict::Agrees);
        assert_eq!(claim(&made, &format!("loops {family} makes")).verdict, Verdict::Agrees);
        let standing = claim(&made, &format!("In the inertial frame {family}"));
        assert!(standing.verdict == Verdict::Refined && standing.ours.contains("forward; "), "{standing:?}");
    }
    // Period doublings from an independent code (shooting at 1e-12).
    let window = claim(&made, "window");
    let found = numbers(window);
    assert!(near(found[0], 4.269067, 1e-4) && near(found[1], 4.862412, 1e-4), "{window:?}");
    let closing = claim(&made, "With contact SL stays open");
    assert_eq!(closing.verdict, Verdict::Contradicted);
    assert!(near(numbers(closing)[0], 10.340617, 1e-4), "{closing:?}");
    let fold = claim(&made, "With contact S stays open");
    assert_eq!(fold.verdict, Verdict::Contradicted);
    assert!(near(numbers(fold)[0], 3.556166, 1e-5), "{fold:?}");
    assert_eq!(claim(&made, "cubic spring S stays").verdict, Verdict::Agrees);
    assert!(made.claims.iter().filter(|c| c.check && c.figure == "7").all(|c| c.verdict == Verdict::Agrees));
    // A second call computes nothing.
    let report = std::fs::read_to_string(&made.report).unwrap();
    assert!(!report.contains("(earlier)") && report.contains("contradicted"));
    assert!(!report.contains("src=") && !report.contains("href=\"http"), "the report needs nothing else");
    let report = std::fs::read_to_string(again(&["5"], &folder, 1e-5).report).unwrap();
    assert!(report.contains("(earlier)"));
}

#[test]
fn figure_8_the_lowest_amplitude_passes_the_contact_radius() {
    let (made, _folder) = figures(&["8"]);
    let lowest = claim(&made, "lowest amplitude");
    assert_eq!(lowest.verdict, Verdict::Refined, "{lowest:?}");
    assert!(near(numbers(lowest)[1], 1.0272, 2e-3), "{lowest:?}");
}

#[test]
fn figure_10_cycles_of_the_cubic_rotor_reach_below_contact() {
    let (made, _folder) = figures(&["10"]);
    for family in ["SL", "DL"] {
        assert_eq!(claim(&made, &format!("{family} reaches down")).verdict, Verdict::Agrees);
    }
}

#[test]
fn figure_11_contact_cycles_begin_at_the_contact_radius_and_come_from_the_cubic_ones() {
    let (made, _folder) = figures(&["11"]);
    for family in ["SL", "DL"] {
        let lowest = claim(&made, &format!("{family} reaches down"));
        assert_eq!(lowest.verdict, Verdict::Refined, "{lowest:?}");
        // At a tolerance as large as the damping, branches may end short, which decides nothing.
        let brought = claim(&made, &format!("Cubic {family} is brought"));
        assert_ne!(brought.verdict, Verdict::Contradicted, "{brought:?}");
    }
}

#[test]
fn figure_12_the_straight_run_turns_back_and_the_program_finds_another_way() {
    let (made, _folder) = figures(&["12"]);
    let fold = claim(&made, "turns back");
    assert!(near(numbers(fold)[0], 1.465178, 1e-5) && fold.note.contains("reached the goal"), "{fold:?}");
    for family in ["SL", "DL"] {
        assert_eq!(claim(&made, &format!("S and {family} connect")).verdict, Verdict::Refined);
    }
}

#[test]
fn figure_13_there_is_a_second_stable_zone_of_the_double_loop() {
    let (made, _folder) = figures(&["13"]);
    let zone = claim(&made, "second stable zone");
    let found = numbers(zone);
    // Between a torus point and a fold, known to three digits at the coarse tolerance.
    assert!(zone.verdict == Verdict::Refined && near(found[0], 6.279, 2e-3) && near(found[1], 6.335, 2e-3), "{zone:?}");
}

#[test]
fn figure_14_artefacts_shrink_with_the_width_of_the_switch() {
    // At 1e-5, neighbouring branches near contact are not distinguished at zeta = 1e-5.
    let folder = tempfile::tempdir().unwrap();
    let made = again(&["14"], &folder, 1e-6);
    // Stretches that vanish as K grows: on S they begin at its folds, with the widths of the folds themselves.
    let found = numbers(claim(&made, "S at β = 6, K = 30 has points"));
    assert!(near(found[0], 0.90675, 1e-5) && near(found[1], 0.9224, 1e-3), "{found:?}");
    let sharp = claim(&made, "No point of contact S in figure 7");
    assert!(sharp.verdict == Verdict::Contradicted && near(numbers(sharp)[0], 0.918069, 1e-5), "{sharp:?}");
    for words in ["false unstable piece", "fictitious family", "So has SL", "removes them from S"] {
        let claim = claim(&made, words);
        assert_eq!(claim.verdict, Verdict::Refined, "{claim:?}");
    }
}

#[test]
fn a_stopped_run_is_reported_and_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let stop = AtomicBool::new(true);
    let request = Request {
        publication: &PUBLICATION,
        figures: vec![PUBLICATION.figure("8").unwrap()],
        out: folder.path().to_path_buf(),
        jobs: 1,
        tolerance: Some(1e-4),
        stop: &stop,
        say: &|_| {},
    };
    let made = reproduce(&request).unwrap();
    assert!(made.stopped && made.claims.is_empty());
    assert!(again(&["3"], &folder, 1e-5).failures.is_empty());
}
