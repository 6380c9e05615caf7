//! Placement of texts where they hide nothing.
//!
//! **Idea.** Anything already drawn is known as *ink*, points along the curves, and as boxes of other texts and marks.
//! For a new text, positions around its anchor are tried and the one that hides least is chosen.

use crate::font::width;

/// A rectangle on the page: left, right, top, bottom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Area {
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
}

impl Area {
    pub fn around([x, y]: [f64; 2], half: f64) -> Area {
        Area { left: x - half, right: x + half, top: y - half, bottom: y + half }
    }

    fn holds(&self, [x, y]: [f64; 2]) -> bool {
        (self.left..=self.right).contains(&x) && (self.top..=self.bottom).contains(&y)
    }

    fn overlap(&self, other: &Area) -> f64 {
        let w = self.right.min(other.right) - self.left.max(other.left);
        let h = self.bottom.min(other.bottom) - self.top.max(other.top);
        w.max(0.0) * h.max(0.0)
    }
}

/// Occupied parts of a panel.
#[derive(Clone, Debug)]
pub(crate) struct Occupied {
    /// The axes.
    pub frame: Area,
    boxes: Vec<Area>,
    ink: Vec<[f64; 2]>,
}

impl Occupied {
    pub fn new(frame: Area) -> Occupied {
        Occupied { frame, boxes: Vec::new(), ink: Vec::new() }
    }

    pub fn take(&mut self, area: Area) {
        self.boxes.push(area);
    }

    /// Records a polyline on the page, a point every few units.
    pub fn draw(&mut self, line: &[[f64; 2]]) {
        const EVERY: f64 = 3.0;
        for pair in line.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            let parts = ((b[0] - a[0]).hypot(b[1] - a[1]) / EVERY).ceil().clamp(1.0, 2000.0);
            let at = |s: f64| [a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])];
            self.ink.extend((0..=parts as usize).map(|k| at(k as f64 / parts)));
        }
    }

    /// Amount of ink that a box would hide.
    fn hidden(&self, area: &Area) -> f64 {
        let outside = (area.right - area.left) * (area.bottom - area.top) - area.overlap(&self.frame);
        let boxes: f64 = self.boxes.iter().map(|b| area.overlap(b)).sum();
        let ink = self.ink.iter().filter(|p| area.holds(**p)).count() as f64;
        100.0 * outside.max(0.0) + 10.0 * boxes + 12.0 * ink
    }

    /// Reserves a box for a text beside the first of `anchors` where it hides nothing; `None` if there is no room.
    pub fn with_room(&mut self, anchors: &[[f64; 2]], text: &str, size: f64, gap: f64) -> Option<Area> {
        let free = |anchor: &[f64; 2]| {
            let (cost, area) = self.best_beside(*anchor, text, size, gap, 1);
            (self.hidden(&area) == 0.0).then_some((cost, area))
        };
        let (_, area) = anchors.iter().find_map(free)?;
        self.take(area);
        Some(area)
    }

    /// Reserves a box for a text beside `anchor`, `gap` away.
    pub fn beside(&mut self, anchor: [f64; 2], text: &str, size: f64, gap: f64) -> Area {
        let (_, area) = self.best_beside(anchor, text, size, gap, 5);
        self.take(area);
        area
    }

    /// The box beside `anchor`, in the given number of rings around it, that hides least, and its cost.
    fn best_beside(&self, anchor: [f64; 2], text: &str, size: f64, gap: f64, rings: usize) -> (f64, Area) {
        let (w, h) = (width(text, size) + 2.0, 1.15 * size);
        let towards = [(1, 0), (1, -1), (1, 1), (0, -1), (0, 1), (-1, -1), (-1, 1), (-1, 0)];
        let mut best = (f64::INFINITY, Area::around(anchor, 0.0));
        for ring in (0..rings).map(|ring| ring as f64) {
            let reach = gap + 9.0 * ring;
            for (order, (dx, dy)) in towards.into_iter().enumerate() {
                let x = anchor[0] + f64::from(dx) * (reach + 0.5 * w);
                let y = anchor[1] + f64::from(dy) * (reach + 0.5 * h);
                let area = Area { left: x - 0.5 * w, right: x + 0.5 * w, top: y - 0.5 * h, bottom: y + 0.5 * h };
                let cost = self.hidden(&area) + 6.0 * ring + 0.3 * order as f64;
                if cost < best.0 {
                    best = (cost, area);
                }
            }
        }
        best
    }

    /// Reserves the box of that size, at the border of the axes, that hides least.
    pub fn at_the_border(&mut self, w: f64, h: f64, inset: f64) -> Area {
        let Area { left, right, top, bottom } = self.frame;
        let (columns, rows) = (5, 5);
        let mut best = (f64::INFINITY, Area::around([left, top], 0.0));
        for k in 0..columns * rows {
            let (i, j) = (k % columns, k / columns);
            if i != 0 && i + 1 != columns && j != 0 && j + 1 != rows {
                continue;
            }
            let share = |n: usize, of: usize| n as f64 / (of - 1) as f64;
            let x = left + inset + share(i, columns) * (right - left - 2.0 * inset - w);
            let y = top + inset + share(j, rows) * (bottom - top - 2.0 * inset - h);
            let area = Area { left: x, right: x + w, top: y, bottom: y + h };
            // Prefers corners among equals.
            let corner = (i == 0 || i + 1 == columns) && (j == 0 || j + 1 == rows);
            let cost = self.hidden(&area) + if corner { 0.0 } else { 5.0 };
            if cost < best.0 {
                best = (cost, area);
            }
        }
        self.take(best.1);
        best.1
    }
}

/// Escapes a text for SVG.
pub(crate) fn escaped(text: &str) -> String {
    let allowed = text.chars().filter(|c| !c.is_control() || c.is_whitespace());
    let escape = |c: char| match c {
        '&' => "&amp;".to_string(),
        '<' => "&lt;".to_string(),
        '>' => "&gt;".to_string(),
        '"' => "&quot;".to_string(),
        other => other.to_string(),
    };
    allowed.map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_avoid_curves_and_other_texts() {
        let frame = Area { left: 0.0, right: 300.0, top: 0.0, bottom: 200.0 };
        let mut page = Occupied::new(frame);
        page.draw(&[[100.0, 100.0], [300.0, 100.0]]);
        let first = page.beside([100.0, 100.0], "first", 13.0, 4.0);
        let second = page.beside([100.0, 100.0], "second", 13.0, 4.0);
        assert_eq!(first.overlap(&second), 0.0);
        let line = |k: i32| [100.0 + f64::from(k), 100.0];
        assert!((0..200).all(|k| !first.holds(line(k)) && !second.holds(line(k))), "{first:?} {second:?}");
    }
}
