//! From a branch to polylines of one stability each, and marks.

use crate::quantity::Quantity;
use foldline::diagram::{Branch, Ending, Kind, Point};

/// A piece of a branch along which the stability does not change.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// Whether it is stable.
    pub stable: bool,
    /// Its vertices, in the units of the axes.
    pub vertices: Vec<[f64; 2]>,
}

/// The pieces of a branch, cut exactly where a special point changes the stability. A point without a value (the period
/// of an equilibrium, say) interrupts the curve.
pub fn pieces(branch: &Branch, x: Quantity, y: Quantity) -> Vec<Piece> {
    let mut pieces: Vec<Piece> = Vec::new();
    let mut last: Option<[f64; 2]> = None;
    // Stability of the stretch that leads to the next vertex.
    let mut stable = true;
    let mut specials = branch.special.iter().peekable();
    let mut connect = |last: &mut Option<[f64; 2]>, to: Option<[f64; 2]>, stable: bool| {
        if let (Some(from), Some(to)) = (*last, to) {
            match pieces.last_mut().filter(|p| p.stable == stable && p.vertices.last() == Some(&from)) {
                Some(piece) => piece.vertices.push(to),
                None => pieces.push(Piece { stable, vertices: vec![from, to] }),
            }
        }
        *last = to;
    };
    for point in &branch.points {
        // Without a special point between them, a stretch with an unstable end is drawn unstable.
        connect(&mut last, place(point, x, y), stable && (point.unstable == 0 || branch.special.is_empty()));
        stable = point.unstable == 0;
        while let Some(special) = specials.next_if(|s| s.point.position <= point.position) {
            connect(&mut last, place(&special.point, x, y), special.unstable_before == 0);
            stable = special.unstable_after == 0;
        }
    }
    let closed = branch.ends.iter().flatten().any(|end| *end == Ending::Closed);
    if let (true, Some(first)) = (closed, branch.points.first()) {
        connect(&mut last, place(first, x, y), stable);
    }
    pieces
}

/// The special points of a branch that can be drawn.
pub fn marks(branch: &Branch, x: Quantity, y: Quantity) -> Vec<(Kind, [f64; 2])> {
    branch.special.iter().filter_map(|s| Some((s.kind, place(&s.point, x, y)?))).collect()
}

fn place(point: &Point, x: Quantity, y: Quantity) -> Option<[f64; 2]> {
    Some([x.of(point)?, y.of(point)?])
}

/// The parts of a polyline within a window `[x0, x1, y0, y1]`.
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

/// The part of a segment within a window (Liang and Barsky).
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
    // An end that lies inside is kept exactly, so that neighbouring parts join.
    (enter <= leave).then(|| [if enter == 0.0 { a } else { at(enter) }, if leave == 1.0 { b } else { at(leave) }])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_leaves_and_comes_back_is_two_parts_that_end_on_the_border() {
        let line = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
        let parts = clipped(&line, [-1.0, 1.0, -1.0, 2.0]);
        assert_eq!(parts, vec![vec![[0.0, 0.0], [1.0, 0.0]], vec![[1.0, 1.0], [0.0, 1.0]]]);
    }

    #[test]
    fn a_line_that_passes_by_is_not_there() {
        assert!(clipped(&[[2.0, 0.0], [0.0, 3.0]], [0.0, 1.0, 0.0, 1.0]).is_empty());
    }
}
