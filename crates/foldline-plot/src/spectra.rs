//! Paths of multipliers or eigenvalues along branches.
//!
//! **Idea.** The spectrum of each point is a list without order. The values of neighbouring points are paired, closest
//! pairs first, and the pairs joined to paths. They are shown twice: in the complex plane beside the unit circle (the
//! imaginary axis for equilibria), and their modulus (real part) against the parameter.
//!
//! **Fails when** two values come closer to each other than they move from point to point: their paths may change
//! places.

use crate::branches::root;
use crate::figure::{Axis, Layer, LegendPlace, Marker, Panel};
use crate::palette::{BLACK, nth};
use crate::quantity::{drawn, label};
use foldline::diagram::{Branch, Diagram, Family, Point, SpecialPoint};
use foldline::model::Model;
use foldline::special::quantity::Quantity;
use num_complex::Complex64;

/// Half-width of the plane of multipliers: at least this, and at most [`WIDEST`]; larger values are left out.
const NARROWEST: f64 = 1.25;
const WIDEST: f64 = 2.5;

/// Values along a branch: for each path one value at each point, NaN where it does not exist.
pub fn paths(points: &[&[Complex64]]) -> Vec<Vec<Complex64>> {
    let none = Complex64::new(f64::NAN, f64::NAN);
    let mut paths: Vec<Vec<Complex64>> = Vec::new();
    for (k, values) in points.iter().enumerate() {
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (i, path) in paths.iter().enumerate() {
            let Some(last) = path.last().filter(|z| !z.re.is_nan()) else { continue };
            pairs.extend(values.iter().enumerate().map(|(j, z)| ((z - last).norm(), i, j)));
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut taken, mut given) = (vec![false; paths.len()], vec![false; values.len()]);
        for (_, i, j) in pairs {
            if !taken[i] && !given[j] {
                (taken[i], given[j]) = (true, true);
                paths[i].push(values[j]);
            }
        }
        for (path, _) in paths.iter_mut().zip(taken).filter(|(_, taken)| !taken) {
            path.push(none);
        }
        for (_, z) in given.into_iter().zip(*values).filter(|(given, _)| !given) {
            paths.push([vec![none; k], vec![*z]].concat());
        }
    }
    paths
}

/// Points and special points of a branch in their order.
fn in_order(branch: &Branch) -> Vec<(&Point, Option<&SpecialPoint>)> {
    let mut found = Vec::new();
    let mut specials = branch.special.iter().peekable();
    for point in &branch.points {
        found.push((point, None));
        while let Some(special) = specials.next_if(|own| own.point.position <= point.position) {
            found.push((&special.point, Some(special)));
        }
    }
    found
}

/// Two panels: the complex plane, and modulus or real part against `x`. Curves in two parameters have no spectrum of
/// their own and are left out; so are equilibria if there are cycles, which have a plane of their own. Returns also the
/// number of values outside the plane.
pub fn panels(diagram: &Diagram, model: &Model, x: Quantity, log: bool) -> ([Panel; 2], usize) {
    let shown = |branch: &&Branch| branch.held.is_none() && branch.points.iter().any(|p| !p.free_spectrum().is_empty());
    let isolated: Vec<&Branch> = diagram.branches.iter().filter(shown).collect();
    let cycles = isolated.iter().any(|branch| branch.family != Family::Equilibrium);
    let branches: Vec<&Branch> =
        isolated.into_iter().filter(|branch| (branch.family != Family::Equilibrium) == cycles).collect();
    let all = || branches.iter().flat_map(|branch| &branch.points).flat_map(|point| point.free_spectrum());
    let far = 1.08 * all().map(|z| z.re.abs().max(z.im.abs())).fold(0.0, f64::max);
    let reach = if cycles { far.clamp(NARROWEST, WIDEST) } else { far };
    let outside = all().filter(|z| z.re.abs().max(z.im.abs()) > reach).count();
    let symbol = if cycles { "μ" } else { "λ" };
    let (real, imaginary) = (Axis::new(format!("Re {symbol}")), Axis::new(format!("Im {symbol}")));
    let mut plane = match cycles {
        true => Panel::new("", "", real.from(-reach, reach), imaginary.from(-reach, reach))
            .equal()
            .with(Layer::circle([0.0, 0.0], 1.0, BLACK)),
        false => Panel::new("", "", real, imaginary).with(Layer::vertical(0.0)),
    };
    let size = Axis { log: cycles && log, ..Axis::new(if cycles { "|μ|" } else { "Re λ" }) };
    let mut against = Panel::new("", "", Axis::new(label(x, model)), size);
    against.layers.push(Layer::horizontal(if cycles { 1.0 } else { 0.0 }));
    let roots: Vec<&str> = branches.iter().map(|own| root(diagram, own).0.name.as_str()).collect();
    let mut order = roots.clone();
    order.dedup();
    for (branch, root) in branches.iter().zip(&roots) {
        let colour = nth(order.iter().position(|own| own == root).unwrap_or(0));
        let sequence = in_order(branch);
        let spectra: Vec<&[Complex64]> = sequence.iter().map(|(point, _)| point.free_spectrum()).collect();
        let values: Vec<f64> = sequence.iter().map(|(point, _)| drawn(x, point).unwrap_or(f64::NAN)).collect();
        let named = |layer: Layer| layer.named(branch.name.clone());
        let (mut starts, mut ends) = (Vec::new(), Vec::new());
        for path in paths(&spectra) {
            let in_plane: Vec<[f64; 2]> = path.iter().map(|z| [z.re, z.im]).collect();
            let level = |z: &Complex64| if cycles { z.norm() } else { z.re };
            let by: Vec<[f64; 2]> = path.iter().zip(&values).map(|(z, at)| [*at, level(z)]).collect();
            plane.layers.push(named(Layer::curve(&in_plane, colour).wide(1.4)));
            against.layers.push(named(Layer::curve(&by, colour).wide(1.4)));
            let finite = || in_plane.iter().filter(|at| at[0].is_finite());
            starts.extend(finite().next().copied());
            ends.extend(finite().next_back().copied());
        }
        plane.layers.push(Layer::scatter(starts, Marker::Circle, colour).wide(2.6).hollow().named("first point"));
        plane.layers.push(Layer::scatter(ends, Marker::Circle, colour).wide(2.6).named("last point"));
        for special in &branch.special {
            let near = |z: &&Complex64| (if cycles { z.norm() - 1.0 } else { z.re }).abs();
            let critical = special.point.free_spectrum().iter().min_by(|a, b| near(a).total_cmp(&near(b)));
            let (Some(z), true) = (critical, changes(special)) else { continue };
            let pair: &[[f64; 2]] = if z.im == 0.0 { &[[z.re, 0.0]] } else { &[[z.re, z.im], [z.re, -z.im]] };
            let marks = Layer::scatter(pair.to_vec(), Marker::of(special.kind), colour).hollow();
            plane.layers.push(marks.named(special.kind.title()));
            let level = if cycles { z.norm() } else { z.re };
            if let Some(at) = drawn(x, &special.point) {
                let mark = Layer::scatter(vec![[at, level]], Marker::of(special.kind), colour).hollow();
                against.layers.push(mark.named(special.kind.title()));
            }
        }
    }
    (plane.height, against.height) = (420.0, 420.0);
    plane.legend = LegendPlace::None;
    ([plane, against], outside)
}

/// True if the number of unstable values changes there.
fn changes(special: &SpecialPoint) -> bool {
    special.unstable_before != special.unstable_after
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_follow_values_that_change_their_order() {
        let (a, b) = (|t: f64| Complex64::new(t, 0.0), |t: f64| Complex64::new(1.0 - t, 0.3));
        let lists: Vec<Vec<Complex64>> = (0..=10)
            .map(|k| {
                let t = f64::from(k) / 10.0;
                if k % 2 == 0 { vec![a(t), b(t)] } else { vec![b(t), a(t)] }
            })
            .collect();
        let all: Vec<&[Complex64]> = lists.iter().map(Vec::as_slice).collect();
        let found = paths(&all);
        assert_eq!(found.len(), 2);
        assert!(found[0].iter().all(|z| z.im == 0.0) && found[1].iter().all(|z| z.im == 0.3), "{found:?}");
    }

    #[test]
    fn a_value_that_appears_begins_a_path() {
        let [one, two] = [vec![Complex64::new(0.1, 0.0)], vec![Complex64::new(0.1, 0.0), Complex64::new(2.0, 0.0)]];
        let found = paths(&[&one, &two]);
        assert_eq!(found.len(), 2);
        assert!(found[1][0].re.is_nan() && found[1][1].re == 2.0);
    }
}
