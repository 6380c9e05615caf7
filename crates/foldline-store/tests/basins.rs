//! Basins of attraction with known boundaries.

use foldline::attractors::Fate;
use foldline::diagram::Solution;
use foldline::explore::System;
use foldline::explore::basins::{Basins, Plane, basins};
use foldline::model::Model;
use foldline_store::model_file::parse_model;

fn model(text: &str) -> Model {
    parse_model(text, "model.toml").unwrap()
}

fn plane(model: &Model, axes: [usize; 2], cells: [usize; 2]) -> Plane {
    let ranges = model.ranges();
    Plane { axes, ranges: axes.map(|axis| ranges[axis]), cells, through: vec![0.0; ranges.len()] }
}

fn found(model: &Model, plane: Option<&Plane>, samples: usize, jobs: usize) -> Basins {
    let parameters = model.defaults();
    basins(&System::of(model, &parameters), &parameters, plane, (samples, 1), jobs, 1e-6)
}

/// Index of the equilibrium nearest to a state.
fn equilibrium(found: &Basins, near: &[f64]) -> usize {
    let at = |k: &usize| match &found.attractors[*k].point.solution {
        Solution::Equilibrium(x) => x.iter().zip(near).all(|(a, b)| (a - b).abs() < 1e-6),
        Solution::Cycle(_) | Solution::Torus(_) => false,
    };
    (0..found.attractors.len()).find(at).unwrap()
}

const WELL: &str = r#"
name = "double well"
[parameters]
d = { value = 0.2 }
[states.x]
equation = "v"
range = [-2.0, 2.0]
[states.v]
equation = "x - x^3 - d*v"
range = [-2.0, 2.0]
"#;

/// The model does not change under (x, v) → (-x, -v), which exchanges the wells: cells opposite each other go to
/// opposite wells, and each basin is exactly half of the plane. A thousand cells and more are decided early.
#[test]
fn the_wells_of_a_symmetric_double_well_have_half_of_the_plane_each() {
    let model = model(WELL);
    let plane = plane(&model, [0, 1], [96, 64]);
    let basins = found(&model, Some(&plane), 512, 2);
    let [left, right] = [-1.0, 1.0].map(|x| Fate::Settled(equilibrium(&basins, &[x, 0.0])));
    let count = plane.cells[0] * plane.cells[1];
    for (place, fate) in basins.plane_fates.iter().enumerate() {
        let opposite = basins.plane_fates[count - 1 - place];
        assert!((*fate == left && opposite == right) || (*fate == right && opposite == left), "{place}: {fate:?}");
    }
    assert_eq!((basins.part(left).hits, basins.part(right).hits), (count / 2, count / 2));
    let [low, high] = basins.share(left).interval();
    assert!(low < 0.5 && 0.5 < high && high - low < 0.1, "{low} {high}");
    let early = basins.early.unwrap();
    assert!(early.radii.iter().all(Option::is_some) && early.checked > 100 && early.wrong == 0, "{early:?}");
    // One thread decides as two.
    let alone = found(&model, Some(&plane), 512, 1);
    assert_eq!(alone.plane_fates, basins.plane_fates);
    assert_eq!(alone.box_fates, basins.box_fates);
}

/// In polar coordinates r' = -r (1 - r²)(1 - r²/9), φ' = 1: the origin attracts the disc r < 1, and a cycle of radius 3
/// attracts the rest.
#[test]
fn a_circle_separates_an_equilibrium_from_a_cycle() {
    let model = model(
        r#"
        name = "disc"
        [definitions]
        s = "(1 - x^2 - y^2)*(1 - (x^2 + y^2)/9)"
        [states.x]
        equation = "-x*s - y"
        range = [-4.0, 4.0]
        [states.y]
        equation = "-y*s + x"
        range = [-4.0, 4.0]
        "#,
    );
    let plane = plane(&model, [0, 1], [80, 80]);
    let basins = found(&model, Some(&plane), 2000, 2);
    assert_eq!(basins.attractors.len(), 2);
    let origin = equilibrium(&basins, &[0.0, 0.0]);
    for (place, fate) in basins.plane_fates.iter().enumerate() {
        let radius = plane.centre(0, place % 80).hypot(plane.centre(1, place / 80));
        // No centre lies so near to the circle that the integration decides.
        assert!((radius - 1.0).abs() > 1e-4);
        assert_eq!(*fate == Fate::Settled(origin), radius < 1.0, "{radius}");
        assert!(matches!(fate, Fate::Settled(_)));
    }
    // The fraction of the box is π/64, and every sample is on the right side.
    let share = basins.share(Fate::Settled(origin));
    let [low, high] = share.interval();
    let exact = std::f64::consts::PI / 64.0;
    assert!(low < exact && exact < high && high - low < 0.03, "{low} {high}");
    for (state, fate) in basins.samples.chunks(2).zip(&basins.box_fates) {
        assert_eq!(*fate == Fate::Settled(origin), state[0].hypot(state[1]) < 1.0);
    }
}

/// Without damping nothing settles, and nothing is invented.
#[test]
fn states_that_do_not_settle_are_counted_as_such() {
    let model = model(&WELL.replace("value = 0.2", "value = 0.0"));
    let parameters = model.defaults();
    let mut system = System::of(&model, &parameters);
    system.limits.steps = 3000;
    let plane = plane(&model, [0, 1], [8, 8]);
    let basins = basins(&system, &parameters, Some(&plane), (64, 1), 2, 1e-6);
    let all = basins.box_fates.iter().chain(&basins.plane_fates);
    assert!(all.clone().all(|fate| *fate == Fate::Unsettled), "{:?}", all.collect::<Vec<_>>());
    assert_eq!(basins.share(Fate::Unsettled).value(), 1.0);
}

/// x ↦ 2.5 x (1 - x) takes the interval (0, 1) to the fixed point 0.6, and everything else to minus infinity.
#[test]
fn a_map_has_basins_too() {
    let model = model(
        r#"
        name = "logistic"
        [states]
        x = { range = [-1.0, 2.0] }
        y = { range = [-1.0, 1.0] }
        [map]
        x = "2.5*x*(1 - x)"
        y = "0.5*y"
        "#,
    );
    let plane = plane(&model, [0, 1], [99, 3]);
    let basins = found(&model, Some(&plane), 300, 2);
    for (place, fate) in basins.plane_fates.iter().enumerate() {
        let x = plane.centre(0, place % 99);
        assert_eq!(matches!(fate, Fate::Settled(0)), 0.0 < x && x < 1.0, "{x}");
        assert_eq!(*fate == Fate::Escaped, !(0.0 < x && x < 1.0), "{x}: {fate:?}");
    }
    let share = basins.share(Fate::Settled(0));
    assert!(share.interval()[0] < 1.0 / 3.0 && 1.0 / 3.0 < share.interval()[1]);
}

/// A forced oscillator with two wells, symmetric under (x, v, t) → (-x, -v, t + half a period): for weak forcing each
/// well has its response, and both are found from initial states at the beginning of a forcing period.
#[test]
fn a_forced_oscillator_has_basins_at_the_beginning_of_its_period() {
    let text = WELL
        .replace("x - x^3 - d*v", "x - x^3 - d*v + 0.05*cos(2*pi*t/5)")
        .replace("[parameters]", "[forcing]\nfrequency = \"2*pi/5\"\n[parameters]");
    let model = model(&text);
    let plane = plane(&model, [0, 1], [24, 24]);
    let basins = found(&model, Some(&plane), 0, 2);
    assert_eq!(basins.attractors.len(), 2);
    assert!(basins.plane_fates.iter().all(|fate| matches!(fate, Fate::Settled(_))));
    let mean = |k: usize| match &basins.attractors[k].point.solution {
        Solution::Cycle(cycle) => cycle.uniform(64).chunks(2).map(|x| x[0]).sum::<f64>() / 64.0,
        Solution::Equilibrium(_) | Solution::Torus(_) => f64::NAN,
    };
    assert!(mean(0) * mean(1) < -0.5);
    // At the bottom of each well.
    for x in [-1.0, 1.0] {
        let [column, row] = [x, 0.0].map(|x: f64| ((x + 2.0) / 4.0 * 24.0) as usize);
        let Fate::Settled(own) = basins.plane_fates[row * 24 + column] else { panic!() };
        assert!(mean(own) * x > 0.5);
    }
}
