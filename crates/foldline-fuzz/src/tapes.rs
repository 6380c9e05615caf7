//! Comparison of tapes and their derivatives with the reference evaluation, in every form of a batch.

use crate::formula::Formula;
use crate::reference::{Dual, Reference};
use arbitrary::{Result, Unstructured};
use foldline::contract::{Batch, Parameters, VectorField};
use foldline::model::{Definition, Model, ModelSource, Parameter, State};

const STATES: usize = 2;
const PARAMETERS: usize = 2;
const DEFINITIONS: usize = 3;
const LANES: usize = 5;
/// Multiple of the spread above which a difference is more than rounding.
const SPREADS: f64 = 30.0;

/// Counts of comparisons, so that a test can require a minimum.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen {
    /// Number of values compared with the reference.
    pub values: usize,
    /// Number of derivatives compared with the reference.
    pub slopes: usize,
}

/// Writes a random model, compiles it, and compares value and derivatives with the reference at random points.
pub fn tape(u: &mut Unstructured) -> Result<Seen> {
    let leaves = STATES + PARAMETERS;
    let mut formulas: Vec<Formula> = Vec::new();
    for i in 0..DEFINITIONS + STATES {
        formulas.push(Formula::random(u, leaves + i.min(DEFINITIONS), 4)?);
    }
    let name = |i: usize| match i {
        i if i < STATES => format!("x{i}"),
        i if i < leaves => format!("p{}", i - STATES),
        i => format!("d{}", i - leaves),
    };
    let mut texts = Vec::new();
    for formula in &formulas {
        let mut text = String::new();
        formula.write(u, &name, &mut text)?;
        texts.push(text);
    }
    // Definitions may be given in any order.
    let definitions: Vec<Definition> =
        (0..DEFINITIONS).rev().map(|i| Definition::new(&name(leaves + i), &texts[i])).collect();
    let source = ModelSource {
        name: "random".into(),
        parameters: (STATES..leaves).map(|i| Parameter::new(&name(i), 1.0)).collect(),
        states: (0..STATES).map(|i| State::new(&name(i))).collect(),
        equations: (0..STATES).map(|i| Definition::new(&name(i), &texts[DEFINITIONS + i])).collect(),
        definitions,
        ..ModelSource::default()
    };
    let model = Model::compile(source).unwrap_or_else(|errors| panic!("{texts:#?}\n{errors:#?}"));

    let mut places = Vec::new();
    for _ in 0..leaves * LANES {
        places.push(coordinate(u)?);
    }
    let (states, parameters) = places.split_at(STATES * LANES);
    let own = Batch { lanes: LANES, states, parameters: Parameters::PerLane(parameters), times: &[], signs: &[] };
    let free: Vec<usize> = (0..PARAMETERS).collect();
    let mut f = vec![0.0; STATES * LANES];
    let mut again = f.clone();
    let mut fx = vec![0.0; STATES * STATES * LANES];
    let mut fp = vec![0.0; STATES * PARAMETERS * LANES];
    model.evaluate(own, &mut again);
    model.linearise(own, &free, &mut f, &mut fx, &mut fp);
    assert!(f.iter().zip(&again).all(|(a, b)| same(*a, *b)), "f beside its derivatives differs: {texts:#?}");

    let mut seen = Seen::default();
    for lane in 0..LANES {
        let at = |list: &[f64], i: usize| list[i * LANES + lane];
        let place: Vec<f64> = (0..leaves).map(|i| at(&places, i)).collect();
        let one = Batch {
            lanes: 1,
            states: &place[..STATES],
            parameters: Parameters::Shared(&place[STATES..]),
            times: &[],
            signs: &[],
        };
        let mut alone = vec![0.0; STATES];
        model.evaluate(one, &mut alone);
        for component in 0..STATES {
            let context = || format!("x{component}' at {place:?} of {texts:#?}");
            let value = at(&f, component);
            assert!(same(value, alone[component]), "{value:e} in a batch, {:e} alone: {}", alone[component], context());
            for leaf in 0..leaves {
                let slope = match leaf.checked_sub(STATES) {
                    None => at(&fx, component * STATES + leaf),
                    Some(parameter) => at(&fp, component * PARAMETERS + parameter),
                };
                let Some((reference, spread)) = expected(&formulas, component, &place, leaf) else { continue };
                let close = |a: f64, b: f64, spread: f64| (a - b).abs() <= SPREADS * spread + 1e-300;
                seen.values += 1;
                assert!(
                    close(value, reference.value, spread.value),
                    "{value:e}, not {:e} ± {:e}: {}",
                    reference.value,
                    spread.value,
                    context()
                );
                let (expected, reach) = (reference.slope.unwrap_or(0.0), spread.slope.unwrap_or(0.0));
                seen.slopes += usize::from(reference.slope.is_some());
                assert!(
                    close(slope, expected, reach),
                    "derivative to {}: {slope:e}, not {expected:e} ± {reach:e}: {}",
                    name(leaf),
                    context()
                );
            }
        }
    }
    Ok(seen)
}

/// True if the numbers are equal or both NaN.
fn same(a: f64, b: f64) -> bool {
    a == b || (a.is_nan() && b.is_nan())
}

fn coordinate(u: &mut Unstructured) -> Result<f64> {
    const SPECIAL: [f64; 8] = [0.0, 1.0, -1.0, 0.5, -2.0, 1e-9, 1e6, -0.0];
    Ok(match u.ratio(1u8, 3u8)? {
        true => *u.choose(&SPECIAL)?,
        false => f64::from(u.arbitrary::<i32>()?) / f64::from(1 << 29),
    })
}

/// Returns a component of f with its derivative with respect to a leaf, and the spread of both due to rounding. `None`
/// if it is not finite or if rounding dominates.
fn expected(formulas: &[Formula], component: usize, place: &[f64], leaf: usize) -> Option<(Dual, Dual)> {
    let run = |disturbed: u64| -> Option<Dual> {
        let mut names: Vec<Dual> = Vec::new();
        for (i, &value) in place.iter().enumerate() {
            names.push(Dual { value, slope: (i == leaf).then_some(1.0) });
        }
        let mut stream = disturbed;
        let mut of = |formula: &Formula, names: &[Dual]| {
            let mut reference = Reference { names, disturbed: stream };
            let dual = reference.of(formula);
            stream = reference.disturbed;
            dual
        };
        for definition in &formulas[..DEFINITIONS] {
            // A definition that is not finite may be unused.
            let dual = of(definition, &names).unwrap_or(Dual { value: f64::NAN, slope: Some(f64::NAN) });
            names.push(dual);
        }
        of(&formulas[DEFINITIONS + component], &names)
    };
    let exact = run(0)?;
    let mut spread = Dual { value: 0.0, slope: Some(0.0) };
    for disturbed in 1..=6 {
        let other = run(disturbed * 0x9e37_79b9)?;
        let apart = (other.slope.unwrap_or(0.0) - exact.slope.unwrap_or(0.0)).abs();
        spread.value = spread.value.max((other.value - exact.value).abs());
        spread.slope = spread.slope.map(|s| s.max(apart));
    }
    // If rounding dominates, the spread of a few runs is not reliable.
    let decided = |x: f64, spread: f64| spread <= 1e-6 * x.abs();
    let clear = decided(exact.value, spread.value) && decided(exact.slope.unwrap_or(0.0), spread.slope.unwrap_or(0.0));
    clear.then_some((exact, spread))
}
