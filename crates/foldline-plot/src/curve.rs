//! Branches as marks and polylines of uniform stability.

use crate::figure::Vertex;
use crate::quantity::drawn;
use foldline::diagram::{Branch, Ending, Kind, Point, SpecialPoint};
use foldline::special::quantity::Quantity;

/// A piece of a branch of uniform stability.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// True if the piece is stable.
    pub stable: bool,
    /// Vertices, in the units of the axes.
    pub vertices: Vec<[f64; 2]>,
}

/// Pieces of a branch, cut exactly where a special point changes the stability. A point without a value (such as the
/// period of an equilibrium) interrupts the curve. Between vertices the curve is rounded (see [`rounded`]), with
/// lengths measured in `scale`, the sizes of the axes.
pub fn pieces(branch: &Branch, x: Quantity, y: Quantity, scale: [f64; 2]) -> Vec<Piece> {
    cut(&stretches(branch, x, y), Some(scale))
}

/// Pieces of uniform style of curves given by their vertices, rounded if a scale is given.
pub fn cut(stretches: &[Vec<Vertex>], scale: Option<[f64; 2]>) -> Vec<Piece> {
    let mut pieces: Vec<Piece> = Vec::new();
    for curve in stretches {
        let vertices: Vec<[f64; 2]> = curve.iter().map(|(vertex, _)| *vertex).collect();
        let between = match scale {
            Some(scale) => rounded(&vertices, scale),
            None => vec![Vec::new(); vertices.len().saturating_sub(1)],
        };
        let mut fresh = true;
        for (k, between) in between.into_iter().enumerate() {
            let stable = curve[k + 1].1;
            let line = between.into_iter().chain([vertices[k + 1]]);
            match pieces.last_mut().filter(|piece| !fresh && piece.stable == stable) {
                Some(piece) => piece.vertices.extend(line),
                None => pieces.push(Piece { stable, vertices: [vertices[k]].into_iter().chain(line).collect() }),
            }
            fresh = false;
        }
    }
    pieces
}

/// Vertices of a branch, points and special points in order, interrupted where a point has no value; each with the
/// stability of the segment that leads to it.
pub fn stretches(branch: &Branch, x: Quantity, y: Quantity) -> Vec<Vec<Vertex>> {
    each_iterate(branch, y).flat_map(|y| one_line(branch, x, y)).collect()
}

/// The quantity, or for iterates of a map one quantity for each.
fn each_iterate(branch: &Branch, y: Quantity) -> impl Iterator<Item = Quantity> {
    let count = match y {
        Quantity::Iterate(..) => branch.points.iter().map(|p| p.solution.forcing_periods()).max().unwrap_or(1).max(1),
        _ => 1,
    };
    (0..count as usize).map(move |number| match y {
        Quantity::Iterate(state, _) => Quantity::Iterate(state, number),
        other => other,
    })
}

fn one_line(branch: &Branch, x: Quantity, y: Quantity) -> Vec<Vec<Vertex>> {
    line_of(branch, |point| place(point, x, y))
}

/// Vertices of a branch, points and special points in order, at the places that `place` gives to them; interrupted where
/// it gives none, each with the stability of the segment that leads to it.
pub fn line_of<const N: usize>(
    branch: &Branch,
    place: impl Fn(&Point) -> Option<[f64; N]>,
) -> Vec<Vec<([f64; N], bool)>> {
    let mut vertices: Vec<Option<([f64; N], bool)>> = Vec::new();
    // Stability of the segment that leads to the next vertex.
    let mut stable = true;
    let mut specials = branch.special.iter().peekable();
    for point in &branch.points {
        // In a branch without special points, a segment with an unstable end is drawn unstable.
        let silent = branch.special.is_empty() && point.unstable > 0;
        vertices.push(place(point).map(|at| (at, stable && !silent)));
        stable = point.unstable == 0;
        while let Some(special) = specials.next_if(|s| s.point.position <= point.position) {
            let at = place(&special.point);
            vertices.push(at.map(|at| (at, special.unstable_before == 0)));
            stable = special.unstable_after == 0;
            if has_corner(special) {
                // The curve is rounded on either side, but not across.
                vertices.extend([None, at.map(|at| (at, stable))]);
            }
        }
    }
    let closed = branch.ends.iter().flatten().any(|end| *end == Ending::Closed);
    if let (true, Some(first)) = (closed, branch.points.first()) {
        let home = place(first).filter(|home| !is_another_copy(&vertices, *home));
        vertices.push(home.map(|at| (at, stable)));
    }
    let parts = vertices.split(Option::is_none);
    parts.map(|stretch| stretch.iter().flatten().copied().collect()).filter(|s: &Vec<_>| !s.is_empty()).collect()
}

/// True if the branch has a corner at a special point: its direction jumps there.
fn has_corner(special: &SpecialPoint) -> bool {
    matches!(special.kind, Kind::BoundaryEquilibrium | Kind::ImpactGrazing)
        || special.kind == Kind::Grazing && special.remark.starts_with("grazing-sliding")
}

/// True if a branch that closes around a circle returns to a copy of its start, a full turn away: the segment that
/// closes it would be much longer than any other. (The start lies within one step of the last point.)
fn is_another_copy<const N: usize>(vertices: &[Option<([f64; N], bool)>], home: [f64; N]) -> bool {
    const FAR: f64 = 4.0;
    let known: Vec<[f64; N]> = vertices.iter().flatten().map(|(at, _)| *at).collect();
    let longest = |axis: usize| known.windows(2).fold(0.0, |m: f64, w| m.max((w[1][axis] - w[0][axis]).abs()));
    known.last().is_some_and(|last| (0..N).any(|axis| (last[axis] - home[axis]).abs() > FAR * longest(axis)))
}

/// For each segment, the vertices to insert so that the polyline becomes a smooth curve through all given vertices:
/// cubic Hermite pieces over the chord length, with slopes from parabolas through three vertices. A polyline that ends
/// where it began is smooth there too.
pub fn rounded(vertices: &[[f64; 2]], scale: [f64; 2]) -> Vec<Vec<[f64; 2]>> {
    const SHORTEST: f64 = 0.004;
    // The direction between two points closer than this, a pixel, may be rounding error.
    const NEAR: f64 = 0.001;
    let chord = |a: [f64; 2], b: [f64; 2]| ((b[0] - a[0]) / scale[0]).hypot((b[1] - a[1]) / scale[1]);
    let chords: Vec<f64> = vertices.windows(2).map(|w| chord(w[0], w[1])).collect();
    let count = vertices.len();
    let closed = count > 2 && chord(vertices[0], vertices[count - 1]) < NEAR;
    let neighbour = |k: usize, forward: bool| {
        let steps = if closed {
            count
        } else if forward {
            count - k
        } else {
            k + 1
        };
        let others = (1..steps).map(|step| vertices[if forward { k + step } else { k + count - step } % count]);
        others.into_iter().find(|other| chord(vertices[k], *other) > NEAR)
    };
    let divided = |a: [f64; 2], b: [f64; 2]| [0, 1].map(|i| (b[i] - a[i]) / chord(a, b));
    let slope = |k: usize| match (neighbour(k, false), neighbour(k, true)) {
        (Some(before), Some(after)) => {
            let (p, q) = (chord(before, vertices[k]), chord(vertices[k], after));
            let (a, b) = (divided(before, vertices[k]), divided(vertices[k], after));
            [0, 1].map(|i| (q * a[i] + p * b[i]) / (p + q))
        }
        (Some(before), None) => divided(before, vertices[k]),
        (None, Some(after)) => divided(vertices[k], after),
        (None, None) => [0.0, 0.0],
    };
    let slopes: Vec<[f64; 2]> = (0..count).map(slope).collect();
    let piece = |k: usize| {
        let h = chords[k];
        let (a, b) = (vertices[k], vertices[k + 1]);
        // A chord that is short on the page, or not finite, stays straight.
        let parts = if h.is_finite() { (h / SHORTEST).ceil().clamp(1.0, 24.0) as usize } else { 1 };
        let inner = (1..parts).map(|s| {
            let t = s as f64 / parts as f64;
            [0, 1].map(|i| {
                let (da, db) = (h * slopes[k][i], h * slopes[k + 1][i]);
                let (u, t2) = (1.0 - t, t * t);
                a[i] * (1.0 + 2.0 * t) * u * u + da * t * u * u + b[i] * t2 * (3.0 - 2.0 * t) - db * t2 * u
            })
        });
        inner.collect()
    };
    (0..chords.len()).map(piece).collect()
}

/// Special points of a branch that can be drawn: kind, criticality where known, position.
pub fn marks(branch: &Branch, x: Quantity, y: Quantity) -> Vec<(Kind, Option<&'static str>, [f64; 2])> {
    let of = |y: Quantity| {
        branch.special.iter().filter_map(move |s| Some((s.kind, s.criticality(), place(&s.point, x, y)?)))
    };
    each_iterate(branch, y).flat_map(of).collect()
}

/// Special points with their kind, criticality where known, and the place that `place` gives to them.
pub fn marks_of<const N: usize>(
    branch: &Branch,
    place: impl Fn(&Point) -> Option<[f64; N]>,
) -> Vec<(Kind, Option<&'static str>, [f64; N])> {
    branch.special.iter().filter_map(|s| Some((s.kind, s.criticality(), place(&s.point)?))).collect()
}

fn place(point: &Point, x: Quantity, y: Quantity) -> Option<[f64; 2]> {
    Some([drawn(x, point)?, drawn(y, point)?])
}

/// Parts of a polyline within a window `[x0, x1, y0, y1]`.
pub fn clipped(vertices: &[[f64; 2]], window: [f64; 4]) -> Vec<Vec<[f64; 2]>> {
    let mut parts: Vec<Vec<[f64; 2]>> = Vec::new();
    for pair in vertices.windows(2) {
        let Some([a, b]) = clipped_segment(pair[0], pair[1], window) else { continue };
        match parts.last_mut().filter(|part| part.last() == Some(&a)) {
            Some(part) => part.push(b),
            None => parts.push(vec![a, b]),
        }
    }
    parts
}

/// Part of a segment within a window (Liang and Barsky).
fn clipped_segment(a: [f64; 2], b: [f64; 2], window: [f64; 4]) -> Option<[[f64; 2]; 2]> {
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        let d = b[axis] - a[axis];
        for (towards, room) in [(-d, a[axis] - window[2 * axis]), (d, window[2 * axis + 1] - a[axis])] {
            if towards == 0.0 {
                if room < 0.0 {
                    return None;
                }
            } else if towards < 0.0 {
                enter = enter.max(room / towards);
            } else {
                leave = leave.min(room / towards);
            }
        }
    }
    let at = |t: f64| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
    // An end inside the window is kept exactly, so that neighbouring parts join.
    (enter <= leave).then(|| [if enter == 0.0 { a } else { at(enter) }, if leave == 1.0 { b } else { at(leave) }])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_leaves_the_window_and_returns_is_cut_at_its_border() {
        let line = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
        let parts = clipped(&line, [-1.0, 1.0, -1.0, 2.0]);
        assert_eq!(parts, vec![vec![[0.0, 0.0], [1.0, 0.0]], vec![[1.0, 1.0], [0.0, 1.0]]]);
    }

    #[test]
    fn a_rounded_circle_is_rounder_than_its_polygon() {
        let corners: Vec<[f64; 2]> =
            (0..=12).map(|k| (k as f64 * std::f64::consts::TAU / 12.0).sin_cos().into()).collect();
        let inner = rounded(&corners, [2.0, 2.0]);
        let error = inner[1..11].iter().flatten().map(|[x, y]| (x.hypot(*y) - 1.0).abs()).fold(0.0, f64::max);
        let error_at_the_seam = inner[0].iter().map(|[x, y]| (x.hypot(*y) - 1.0).abs()).fold(0.0, f64::max);
        assert!(error_at_the_seam < 0.003, "{error_at_the_seam}");
        // The polygon is off by 1 - cos(15°) = 0.034; the slopes of parabolas are accurate to the square of the chord.
        assert!(error < 0.003, "{error}");
    }

    #[test]
    fn vertices_equal_up_to_rounding_make_no_kink() {
        let at = |t: f64| [t, t * t];
        let once: Vec<[f64; 2]> = (0..=8).map(|k| at(k as f64 / 8.0)).collect();
        let mut twice = once.clone();
        twice.insert(5, [once[4][0] - 1e-9, once[4][1] + 1e-9]);
        let (a, mut b) = (rounded(&once, [1.0, 1.0]), rounded(&twice, [1.0, 1.0]));
        b.remove(4);
        for (p, q) in a.iter().flatten().zip(b.iter().flatten()) {
            assert!((p[0] - q[0]).abs() < 1e-7 && (p[1] - q[1]).abs() < 1e-7, "{p:?} {q:?}");
        }
    }

    #[test]
    fn a_line_outside_the_window_is_left_out() {
        assert!(clipped(&[[2.0, 0.0], [0.0, 3.0]], [0.0, 1.0, 0.0, 1.0]).is_empty());
    }
}
