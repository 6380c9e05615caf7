//! Properties checked on reproducible random inputs.

use arbitrary::Unstructured;
use foldline_fuzz::edits::edited;
use foldline_fuzz::tapes::{Seen, tape};
use foldline_fuzz::{bytes, simulations, texts};

#[test]
fn tapes_agree_with_the_reference_evaluation() {
    let mut seen = Seen::default();
    for stream in 0..3000 {
        let data = bytes(stream, 2000);
        if let Ok(one) = tape(&mut Unstructured::new(&data)) {
            seen.values += one.values;
            seen.slopes += one.slopes;
        }
    }
    assert!(seen.values > 8_000 && seen.slopes > 4_000, "{seen:?}");
}

#[test]
fn every_trajectory_is_accounted_for() {
    let some = |streams: std::ops::Range<u64>| {
        let mut seen = simulations::Seen::default();
        for stream in streams {
            let data = bytes(stream, 2000);
            let _ = simulations::simulation(&mut Unstructured::new(&data), &mut seen);
        }
        seen
    };
    let (mut seen, other) = std::thread::scope(|scope| {
        let first = scope.spawn(|| some(0..20));
        let second = some(20..40);
        (first.join().expect("the simulations end"), second)
    });
    seen.run.iter_mut().zip(other.run).for_each(|(own, more)| *own += more);
    seen.settled += other.settled;
    seen.escaped += other.escaped;
    seen.swept += other.swept;
    assert!(
        seen.run.iter().all(|run| *run > 5) && seen.settled > 20 && seen.escaped > 20 && seen.swept > 10,
        "{seen:?}"
    );
}

#[test]
fn model_files_are_read_or_rejected_with_a_position() {
    let corpus = texts::corpus("models");
    let (mut read, mut refused) = (0, 0);
    for (stream, (_, text)) in (0..6000).zip(corpus.iter().cycle()) {
        let data = bytes(stream, 600);
        let Ok(text) = edited(&mut Unstructured::new(&data), text) else { continue };
        *if texts::model(&text) { &mut read } else { &mut refused } += 1;
    }
    assert!(read > 500 && refused > 2000, "{read} {refused}");
}

#[test]
fn study_files_are_read_or_rejected_with_a_position() {
    let all = texts::corpus("studies");
    let models = texts::corpus("models");
    let (_, rotor) = models.iter().find(|(path, _)| path.ends_with("overhung-rotor.toml")).expect("the rotor");
    // Only studies of this model; others would be rejected even without edits.
    let corpus: Vec<_> = all.into_iter().filter(|(_, text)| texts::study(text, rotor).is_some()).collect();
    let (mut read, mut refused) = (0, 0);
    for (stream, (_, text)) in (0..3000).zip(corpus.iter().cycle()) {
        let data = bytes(stream, 600);
        let Ok(text) = edited(&mut Unstructured::new(&data), text) else { continue };
        *if texts::study(&text, rotor).is_some() { &mut read } else { &mut refused } += 1;
    }
    assert!(read > 150 && refused > 1000, "{read} {refused}");
}

#[test]
fn auto_files_are_read_or_rejected_with_a_position() {
    let mut corpus = texts::corpus("crates/foldline-store/tests/auto");
    corpus.retain(|(path, _)| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("s.")));
    let model = foldline_store::model_file::parse_model(texts::AUTO_MODEL, "m.toml").expect("the model is right");
    let (mut read, mut refused) = (0, 0);
    for (stream, (_, text)) in (0..2000).zip(corpus.iter().cycle()) {
        let data = bytes(stream, 600);
        let Ok(text) = edited(&mut Unstructured::new(&data), text) else { continue };
        *if texts::solution_file(&text, &model).is_some() { &mut read } else { &mut refused } += 1;
    }
    assert!(read > 100 && refused > 500, "{read} {refused}");
}
