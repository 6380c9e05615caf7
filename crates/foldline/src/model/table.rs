//! Functions given by points.
//!
//! **Idea.** Between neighbouring points a table is a polynomial: a straight line, or a cubic whose slopes at the
//! points keep it as monotone as the points are. The pieces become choices on the graph, so a table has exact
//! derivatives and its kinks are switches like those of `if`.
//!
//! **Source.** Slopes of monotone cubics: fritsch1980, sections 3 and 4.

use super::graph::{Binary, Graph, Id};

/// Function of one argument given by points.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Name.
    pub name: String,
    /// Arguments, increasing.
    pub x: Vec<f64>,
    /// Values, one for each argument.
    pub y: Vec<f64>,
    /// Interpolation between the points.
    pub interpolation: Interpolation,
    /// Extrapolation beyond the first and the last point.
    pub outside: Outside,
}

/// Interpolation of a table between its points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Straight lines, with a kink at every point.
    #[default]
    Linear,
    /// Monotone cubics with a continuous slope.
    Cubic,
}

/// Extrapolation of a table beyond its points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Outside {
    /// Linear, with the slope at the last point.
    #[default]
    Linear,
    /// Constant at the value of the last point.
    Constant,
}

/// Maximum number of points: each costs a few operations wherever the table is used.
const MOST_POINTS: usize = 200;

/// c₀ + d (c₁ + d (c₂ + d c₃)), d = x - origin.
#[derive(Clone, Copy, Debug)]
struct Piece {
    origin: f64,
    coefficients: [f64; 4],
}

impl Table {
    /// Message and hint for an error in the points; `None` if they are valid.
    pub(super) fn mistake(&self) -> Option<[String; 2]> {
        let Table { x, y, .. } = self;
        let turned = x.windows(2).position(|pair| pair[0] >= pair[1]);
        if x.len() != y.len() {
            let message = format!("the table has {} `x` values and {} `y` values", x.len(), y.len());
            Some([message, "give one `y` for each `x`".into()])
        } else if x.len() < 2 {
            Some([format!("the table has {} points", x.len()), "give at least two points".into()])
        } else if x.len() > MOST_POINTS {
            let message = format!("the table has {} points; the limit is {MOST_POINTS}", x.len());
            Some([message, "keep the points that matter, or fit a formula".into()])
        } else if x.iter().chain(y).any(|v| !v.is_finite()) {
            Some(["a value of the table is not a finite number".into(), "write numbers".into()])
        } else {
            let at = turned?;
            let message = format!("the `x` values do not increase: {} is followed by {}", x[at], x[at + 1]);
            Some([message, "sort the points by `x` and remove duplicates".into()])
        }
    }

    /// Node for the value at `a`.
    pub(super) fn node(&self, graph: &mut Graph, a: Id) -> Id {
        let (pieces, starts) = self.pieces();
        choose(graph, a, &pieces, &starts)
    }

    /// Pieces in order, and start of each piece but the first.
    fn pieces(&self) -> (Vec<Piece>, Vec<f64>) {
        let Table { x, y, .. } = self;
        let last = x.len() - 1;
        let secants: Vec<f64> = (0..last).map(|k| (y[k + 1] - y[k]) / (x[k + 1] - x[k])).collect();
        let slopes = self.slopes(&secants);
        let mut pieces: Vec<Piece> = (0..last)
            .map(|k| {
                let (h, secant) = (x[k + 1] - x[k], secants[k]);
                let coefficients = match self.interpolation {
                    Interpolation::Linear => [y[k], secant, 0.0, 0.0],
                    Interpolation::Cubic => {
                        let (p, q) = (slopes[k], slopes[k + 1]);
                        [y[k], p, (3.0 * secant - 2.0 * p - q) / h, (p + q - 2.0 * secant) / (h * h)]
                    }
                };
                Piece { origin: x[k], coefficients }
            })
            .collect();
        let mut starts = x[1..last].to_vec();
        let beyond = |k: usize| {
            let slope = if self.outside == Outside::Linear { slopes[k] } else { 0.0 };
            Piece { origin: x[k], coefficients: [y[k], slope, 0.0, 0.0] }
        };
        // A straight line continues by itself.
        if self.interpolation == Interpolation::Cubic || self.outside == Outside::Constant {
            pieces.insert(0, beyond(0));
            pieces.push(beyond(last));
            starts.insert(0, x[0]);
            starts.push(x[last]);
        }
        (pieces, starts)
    }

    /// Slopes at the points: means of the secants, reduced until every cubic is monotone.
    fn slopes(&self, secants: &[f64]) -> Vec<f64> {
        let last = secants.len();
        let mean = |k: usize| match (secants[k - 1], secants[k]) {
            (p, q) if p * q <= 0.0 => 0.0,
            (p, q) => 0.5 * (p + q),
        };
        let mut slopes: Vec<f64> = (0..=last)
            .map(|k| match k {
                0 => secants[0],
                k if k == last => secants[last - 1],
                k => mean(k),
            })
            .collect();
        if self.interpolation == Interpolation::Linear {
            return slopes;
        }
        for (k, &secant) in secants.iter().enumerate() {
            let radius = (slopes[k] / secant).hypot(slopes[k + 1] / secant);
            if secant == 0.0 {
                (slopes[k], slopes[k + 1]) = (0.0, 0.0);
            } else if radius > 3.0 {
                slopes[k] *= 3.0 / radius;
                slopes[k + 1] *= 3.0 / radius;
            }
        }
        slopes
    }
}

/// Selects the piece that contains `a` by bisection.
fn choose(graph: &mut Graph, a: Id, pieces: &[Piece], starts: &[f64]) -> Id {
    let [piece] = pieces else {
        let middle = pieces.len() / 2;
        let below = choose(graph, a, &pieces[..middle], &starts[..middle - 1]);
        let above = choose(graph, a, &pieces[middle..], &starts[middle..]);
        let start = graph.constant(starts[middle - 1]);
        let left = graph.binary(Binary::Less, a, start);
        return graph.select(left, below, above);
    };
    let origin = graph.constant(piece.origin);
    let d = graph.subtract(a, origin);
    let mut value = graph.constant(piece.coefficients[3]);
    for c in piece.coefficients[..3].iter().rev() {
        let c = graph.constant(*c);
        let product = graph.multiply(value, d);
        value = graph.add(product, c);
    }
    value
}

#[cfg(test)]
mod tests {
    use super::super::graph::Leaf;
    use super::*;

    fn at(table: &Table, x: f64) -> f64 {
        let mut graph = Graph::default();
        let a = graph.constant(x);
        let id = table.node(&mut graph, a);
        graph.value(id).unwrap()
    }

    fn table(interpolation: Interpolation, outside: Outside) -> Table {
        let (x, y) = (vec![0.0, 1.0, 3.0, 4.0, 6.0], vec![0.0, 2.0, 2.5, 2.5, 7.0]);
        Table { name: "k".into(), x, y, interpolation, outside }
    }

    #[test]
    fn a_table_interpolates_its_points_and_extrapolates_as_stated() {
        for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
            let own = table(interpolation, Outside::Linear);
            own.x.iter().zip(&own.y).for_each(|(x, y)| assert!((at(&own, *x) - y).abs() < 1e-14));
            let held = table(interpolation, Outside::Constant);
            assert_eq!((at(&held, -5.0), at(&held, 50.0)), (0.0, 7.0));
        }
        let straight = table(Interpolation::Linear, Outside::Linear);
        assert_eq!((at(&straight, 0.5), at(&straight, -1.0), at(&straight, 8.0)), (1.0, -2.0, 11.5));
    }

    #[test]
    fn cubics_are_as_monotone_as_their_points() {
        let own = table(Interpolation::Cubic, Outside::Linear);
        let values: Vec<f64> = (-100..=800).map(|k| at(&own, 0.01 * f64::from(k))).collect();
        assert!(values.windows(2).all(|pair| pair[1] >= pair[0] - 1e-15));
        assert!((at(&own, 3.4) - 2.5).abs() < 1e-15);
    }

    #[test]
    fn a_cubic_has_a_continuous_slope() {
        let own = table(Interpolation::Cubic, Outside::Linear);
        let mut graph = Graph::default();
        let a = graph.leaf(Leaf::Parameter(0));
        let id = own.node(&mut graph, a);
        let one = graph.derivative(&[id], |graph, _| Some(graph.constant(1.0)))[0];
        let slope = |x: f64| {
            let mut values: Vec<f64> = Vec::new();
            for i in 0..graph.len() {
                let value = graph.node(Id(i as u32)).value(|id| values[id.at()], &[x]);
                values.push(value);
            }
            values[one.at()]
        };
        for x in &own.x {
            assert!((slope(x - 1e-9) - slope(x + 1e-9)).abs() < 1e-7, "{x}");
        }
    }
}
