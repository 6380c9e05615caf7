//! Three axes in parallel projection.
//!
//! **Idea.** A box is seen from a direction given by two angles. Its three faces behind the curves carry grids, and its
//! edges in front of them the ticks. Everything becomes layers of a panel without axes of its own ([`Panel::bare`]).

use crate::figure::{Axis, Layer, Panel, Vertex};
use crate::palette::{GREY, PALE};
use crate::scale::Scale;

/// Direction from which the box is seen, in degrees: angle about the vertical axis, and height above the floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// 0 looks along the first axis, -90 along the second.
    pub azimuth: f64,
    /// From 0 (level with the floor) to 90 (from above).
    pub elevation: f64,
}

impl Default for View {
    fn default() -> View {
        View { azimuth: -60.0, elevation: 25.0 }
    }
}

/// A box with three axes.
pub struct Space {
    scales: [Scale; 3],
    labels: [String; 3],
    right: [f64; 3],
    up: [f64; 3],
    towards: [f64; 3],
    /// Lengths of the edges, each half an edge.
    half: [f64; 3],
}

impl Space {
    /// Returns the box around values, each `[x, y, z]`; axes with a stated range keep it.
    pub fn around(axes: [Axis; 3], places: impl Iterator<Item = [f64; 3]>, view: View) -> Space {
        let plain: Vec<Scale> = axes.iter().map(|axis| Scale::new(axis, None)).collect();
        let mut ranges = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for place in places {
            let units: [f64; 3] = [0, 1, 2].map(|k| plain[k].units(place[k]));
            let inside = |k: usize| axes[k].range.is_none() || (plain[k].low..=plain[k].high).contains(&units[k]);
            if units.iter().all(|v| v.is_finite()) && (0..3).all(inside) {
                for (range, value) in ranges.iter_mut().zip(units) {
                    *range = [range[0].min(value), range[1].max(value)];
                }
            }
        }
        let scale = |k: usize| {
            let [low, high] = ranges[k];
            let mut scale = Scale::new(&axes[k], (low <= high).then_some([low, high]));
            scale.divide(5);
            scale
        };
        let (a, e) = (view.azimuth.to_radians(), view.elevation.clamp(0.0, 90.0).to_radians());
        Space {
            scales: [scale(0), scale(1), scale(2)],
            labels: axes.map(|axis| axis.label),
            right: [-a.sin(), a.cos(), 0.0],
            up: [-a.cos() * e.sin(), -a.sin() * e.sin(), e.cos()],
            towards: [a.cos() * e.cos(), a.sin() * e.cos(), e.sin()],
            half: [1.0, 1.0, 0.72],
        }
    }

    /// Projection of a corner-like point, each coordinate from -1 to 1.
    fn page(&self, at: [f64; 3]) -> [f64; 2] {
        let dot = |axis: &[f64; 3]| (0..3).map(|k| axis[k] * self.half[k] * at[k]).sum();
        [dot(&self.right), dot(&self.up)]
    }

    /// Projection of values; NaN outside the box or where an axis cannot show them.
    pub fn project(&self, place: [f64; 3]) -> [f64; 2] {
        let share: [f64; 3] = [0, 1, 2].map(|k| self.scales[k].share(self.scales[k].units(place[k])));
        let inside = share.iter().all(|s| (-1e-9..=1.0 + 1e-9).contains(s));
        if inside { self.page(share.map(|s| 2.0 * s - 1.0)) } else { [f64::NAN; 2] }
    }

    /// Lowest value of the third axis.
    pub fn floor(&self) -> f64 {
        let scale = &self.scales[2];
        if scale.log { 10f64.powf(scale.low) } else { scale.low }
    }

    /// A curve through values, with the stability of each segment; interrupted where it leaves the box.
    pub fn curve(&self, stretches: &[Vec<([f64; 3], bool)>], colour: &'static str) -> Layer {
        let mut layer = Layer::masked(&[], &[true], colour);
        if let crate::figure::Shape::Curve { stretches: own, .. } = &mut layer.shape {
            *own = stretches
                .iter()
                .map(|stretch| stretch.iter().map(|(place, stable)| (self.project(*place), *stable)).collect())
                .flat_map(|line: Vec<Vertex>| {
                    let parts = line.split(|(at, _)| at[0].is_nan());
                    parts.filter(|part| !part.is_empty()).map(<[Vertex]>::to_vec).collect::<Vec<_>>()
                })
                .collect();
        }
        layer
    }

    /// Distance of values from the eye, for drawing what is far first: larger is nearer.
    pub fn depth(&self, place: [f64; 3]) -> f64 {
        (0..3)
            .map(|k| {
                self.towards[k] * self.half[k] * (2.0 * self.scales[k].share(self.scales[k].units(place[k])) - 1.0)
            })
            .sum()
    }

    /// The panel with the box and its ticks, to which layers are added.
    pub fn panel(&self) -> Panel {
        let front = self.towards.map(|t| if t >= 0.0 { 1.0 } else { -1.0 });
        let back = front.map(|f: f64| -f);
        // The floor is always shown, whatever the height of the eye.
        let floor = -1.0;
        let mut layers = Vec::new();
        let mut line = |a: [f64; 3], b: [f64; 3], width: f64, faint: f64| {
            layers.push(Layer::curve(&[self.page(a), self.page(b)], PALE).wide(width).faint(faint));
        };
        let along = |axis: usize, others: [(usize, f64); 2], s: f64| {
            let mut at = [0.0; 3];
            at[axis] = s;
            others.iter().for_each(|(k, v)| at[*k] = *v);
            at
        };
        for axis in 0..3 {
            let [j, k] = [[1, 2], [0, 2], [0, 1]][axis];
            let marks = self.scales[axis].ticks.iter().filter(|(_, text)| !text.is_empty());
            for (units, _) in marks {
                let s = 2.0 * self.scales[axis].share(*units) - 1.0;
                if s.abs() > 1.0 + 1e-9 {
                    continue;
                }
                // On the two back faces that contain this direction.
                let wall = |own: usize| if own == 2 { floor } else { back[own] };
                line(along(axis, [(j, wall(j)), (k, -1.0)], s), along(axis, [(j, wall(j)), (k, 1.0)], s), 0.8, 0.35);
                line(along(axis, [(k, wall(k)), (j, -1.0)], s), along(axis, [(k, wall(k)), (j, 1.0)], s), 0.8, 0.35);
            }
        }
        // Outlines of the three faces.
        let corner = |x: f64, y: f64, z: f64| [x, y, z];
        let (bx, by) = (back[0], back[1]);
        let (fx, fy) = (front[0], front[1]);
        for (a, b) in [
            (corner(-1.0, fy, floor), corner(1.0, fy, floor)),
            (corner(-1.0, by, floor), corner(1.0, by, floor)),
            (corner(fx, -1.0, floor), corner(fx, 1.0, floor)),
            (corner(bx, -1.0, floor), corner(bx, 1.0, floor)),
            (corner(bx, by, -1.0), corner(bx, by, 1.0)),
            (corner(fx, by, -1.0), corner(fx, by, 1.0)),
            (corner(bx, fy, -1.0), corner(bx, fy, 1.0)),
            (corner(-1.0, by, 1.0), corner(1.0, by, 1.0)),
            (corner(bx, -1.0, 1.0), corner(bx, 1.0, 1.0)),
        ] {
            line(a, b, 1.0, 0.9);
        }
        // The third axis is at the left of the two outermost vertical edges.
        let edges = [[fx, by], [bx, fy]];
        let left = edges.into_iter().min_by(|a, b| {
            let x = |e: &[f64; 2]| self.page([e[0], e[1], 0.0])[0];
            x(a).total_cmp(&x(b))
        });
        let [lx, ly] = left.unwrap_or([bx, fy]);
        const TICK: f64 = 0.16;
        const NAME: f64 = 0.44;
        // Width of a letter: the box is some 2.8 wide, on which about a hundred letters fit.
        const LETTER: f64 = 0.028;
        let mut texts = Vec::new();
        for axis in 0..3 {
            let place = |s: f64, away: f64| -> [f64; 2] {
                match axis {
                    0 => self.page([s, fy * (1.0 + away), floor]),
                    1 => self.page([fx * (1.0 + away), s, floor]),
                    _ => {
                        let at = self.page([lx, ly, s]);
                        [at[0] - away, at[1]]
                    }
                }
            };
            for (units, text) in &self.scales[axis].ticks {
                let s = 2.0 * self.scales[axis].share(*units) - 1.0;
                if s.abs() <= 1.0 + 1e-9 && !text.is_empty() {
                    texts.push(Layer::text(place(s, TICK), text.as_str()));
                }
            }
            // Below the ticks of the floor; above those of the third axis, left of the face behind it.
            let half = LETTER * 0.5 * self.labels[axis].chars().count() as f64;
            let name = if axis == 2 { place(1.2, half - 0.05) } else { place(0.0, NAME) };
            texts.push(Layer::text(name, self.labels[axis].clone()).coloured(GREY));
        }
        let all = [-1.0, 1.0].into_iter().flat_map(|x| [-1.0, 1.0].map(|y| [x, y]));
        let pages: Vec<[f64; 2]> = all.flat_map(|[x, y]| [-1.0, 1.0].map(|z| self.page([x, y, z]))).collect();
        let least = |k: usize| pages.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min);
        let most = |k: usize| pages.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max);
        let x = Axis::new("").from(least(0) - 0.35, most(0) + 0.12);
        let y = Axis::new("").from(least(1) - 0.38, most(1) + 0.2);
        layers.extend(texts);
        Panel { bare: true, equal: true, layers, ..Panel::new("", "", x, y) }
    }
}
