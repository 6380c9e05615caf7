//! First switching of a polynomial: sign changes between sections, and extrema between them.

use super::{PiecewiseFlow, ZERO};

/// Sections of a part at whose ends switches are compared; extrema between them are found from parabolas.
const SECTIONS: usize = 32;
/// Value of a switch, relative to its largest, below which the side of the surface just passed is a matter of rounding:
/// a hundred times [`ZERO`].
const NEAR: f64 = 1e-11;
/// Position in a part, from its left end, at which the flow shows on which side of the surface it continues. A shorter
/// contact has a depth of the order of its square, which is rounding.
const AFTER: f64 = 1e-6;
/// Extremum of a switch, relative to its largest value, up to which a part is cut there.
const CLOSE: f64 = 1e-3;

/// Length of a part, relative to its interval, below which it is not cut off for that: its error is far below that of
/// the interval. Where the extremum is one at which the part begins, distance to the next.
const NARROW: f64 = 1e-3;
const APART: f64 = 0.0625;
/// Length of an interval, in periods, below which it is not cut for that.
const SHORT: f64 = 1e-8;

/// First switching on a trial polynomial.
pub(super) enum Met {
    Nothing,
    /// At this place, this switch comes close to zero and turns away.
    Near(f64, usize),
    /// This switch, just passed, is passed back at once.
    Back(usize),
    /// At this place in (0, 1], this switch.
    At(f64, usize),
    /// At this place a slide along the surface of this switch ends, on this side.
    Leaves(f64, usize, f64),
}

impl Met {
    fn is_before(&self, place: f64) -> bool {
        matches!(self, Met::At(earlier, _) | Met::Near(earlier, _) | Met::Leaves(earlier, ..) if *earlier <= place)
    }
}

/// A trial: nodes of a polynomial from one normalised time to another.
pub(super) struct Trial<'a> {
    pub nodes: &'a [f64],
    pub ends: [f64; 2],
    pub signs: &'a [f64],
    /// The switches at whose zeros the part begins.
    pub passed: &'a [usize],
    /// The switch that has its extremum where the part begins.
    pub touched: Option<usize>,
    /// Length of the interval.
    pub whole: f64,
}

/// Course of a switch on a trial.
#[derive(Debug)]
pub(super) enum Course {
    /// It vanishes between these places.
    Crosses([f64; 2]),
    /// It has an extremum close to zero.
    Nears(f64),
}

impl PiecewiseFlow<'_> {
    /// First switch that changes sign on a trial. A switch that is zero at its start is divided by the position, which
    /// removes that zero.
    pub(super) fn first(&self, trial: &Trial, sizes: &[f64]) -> Met {
        let (n, [begin, end]) = (self.n(), trial.ends);
        let places: Vec<f64> = (0..=SECTIONS).map(|k| k as f64 / SECTIONS as f64).collect();
        let mut states = vec![0.0; n * places.len()];
        let mut x = vec![0.0; n];
        for (k, s) in places.iter().enumerate() {
            self.scheme.value_into(*s, trial.nodes, &mut x);
            (0..n).for_each(|c| states[c * places.len() + k] = x[c]);
        }
        let times: Vec<f64> = places.iter().filter_map(|s| self.time(begin + s * (end - begin))).collect();
        let values = self.switches_given(&states, &times, trial.signs);
        let mut met = Met::Nothing;
        for (k, own) in values.chunks_exact(places.len()).enumerate() {
            let (sign, passed) = (trial.signs[k], trial.passed.contains(&k));
            if sign == 0.0 {
                match self.leaving(trial, k, &places, &states, &times) {
                    Some((place, side)) if !met.is_before(place) => met = Met::Leaves(place, k, side),
                    _ => {}
                }
                continue;
            }
            // At the start of the part it is zero up to rounding.
            let of = |s: f64, value: f64| sign * if passed { (value - own[0]) / s } else { value };
            let at = |s: f64| of(s, self.switch(trial.nodes, trial.ends, s, k, trial.signs));
            let mut margins: Vec<f64> = places.iter().zip(own).map(|(s, value)| of(*s, *value)).collect();
            let mut knots = places.clone();
            if passed {
                // Within rounding of the surface throughout: the side is undetermined.
                if own.iter().all(|value| value.abs() <= NEAR * sizes[k]) {
                    continue;
                }
                (knots[0], margins[0]) = (AFTER, at(AFTER));
                if margins[0] <= 0.0 && margins[1] <= 0.0 {
                    return Met::Back(k);
                }
                if margins[0] <= 0.0 {
                    margins[0] = margins[1];
                }
            }
            let zero = ZERO * sizes[k];
            // Margins of a switch just passed are divided by the position.
            let near = |s: f64, margin: f64| {
                let value = if passed { margin * s } else { margin };
                // Next to the extremum at which the part begins there are others, of rounding.
                let begins = passed || trial.touched == Some(k);
                let least = if begins { APART } else { NARROW } * trial.whole;
                let length = end - begin;
                trial.whole > SHORT
                    && value < CLOSE * sizes[k]
                    && s * length > least
                    && (1.0 - s) * length > NARROW * trial.whole
                    && self.is_kink(trial, s, k)
            };
            let Some(course) = violated(&knots, &margins, zero, &at, &near) else { continue };
            let (place, own) = match course {
                Course::Crosses([left, right]) => {
                    let place = root(&at, left, right);
                    (place, Met::At(place, k))
                }
                Course::Nears(place) => (place, Met::Near(place, k)),
            };
            if !met.is_before(place) {
                met = own;
            }
        }
        met
    }

    /// True if f is continuous at the surface of a switch next to a place of a trial. Where it jumps, a node beside the
    /// surface would hold the orbit to it.
    fn is_kink(&self, trial: &Trial, s: f64, switch: usize) -> bool {
        let mut x = vec![0.0; self.n()];
        self.scheme.value_into(s, trial.nodes, &mut x);
        let [begin, end] = trial.ends;
        self.is_continuous(&x, begin + s * (end - begin), trial.signs, switch)
    }
}

/// First stretch on which the margins become less than -`zero`, also at an extremum between two places, or an extremum
/// before it that is `near` zero.
pub(super) fn violated(
    places: &[f64],
    margins: &[f64],
    zero: f64,
    at: &dyn Fn(f64) -> f64,
    near: &dyn Fn(f64, f64) -> bool,
) -> Option<Course> {
    let last = places.len() - 1;
    let first = (1..=last).find(|k| margins[*k] < -zero);
    let until = first.unwrap_or(last);
    for k in 1..until.max(2).min(last) {
        let (s, v) = ([places[k - 1], places[k], places[k + 1]], [margins[k - 1], margins[k], margins[k + 1]]);
        let Some(place) = lowest(s, v, at) else { continue };
        if place >= places[until] {
            continue;
        }
        let value = at(place);
        if value < -zero {
            let before = places.iter().rposition(|p| *p < place).unwrap_or(0);
            return Some(Course::Crosses([places[before], place]));
        }
        if near(place, value) {
            return Some(Course::Nears(place));
        }
    }
    first.map(|k| Course::Crosses([places[k - 1], places[k]]))
}

/// Place of the minimum between three places, by parabolas.
fn lowest(mut s: [f64; 3], mut v: [f64; 3], at: &dyn Fn(f64) -> f64) -> Option<f64> {
    const ROUNDS: usize = 4;
    let bounds = [s[0], s[2]];
    let mut found = None;
    for _ in 0..ROUNDS {
        let (a, b) = ((v[1] - v[0]) / (s[1] - s[0]), (v[2] - v[1]) / (s[2] - s[1]));
        let bend = (b - a) / (s[2] - s[0]);
        let place = 0.5 * (s[0] + s[1]) - 0.5 * a / bend;
        if !(bend > 0.0 && place > bounds[0] && place < bounds[1]) {
            return found;
        }
        let low = v[1] - 0.25 * bend * (s[2] - s[0]).powi(2);
        // An extremum far from zero needs no refinement.
        if found.is_none() && low > 0.0 && place > s[0] && v.iter().all(|v| *v > 0.0) && low > 0.5 * v[1] {
            return None;
        }
        found = Some(place);
        let step = (0.125 * (s[2] - s[0])).min(place - bounds[0]).min(bounds[1] - place);
        if step < 1e-12 {
            return found;
        }
        s = [place - step, place, place + step];
        v = s.map(at);
    }
    found
}

/// A zero between `left`, where the function is not negative, and `right`, where it is.
pub(super) fn root(at: &dyn Fn(f64) -> f64, mut left: f64, mut right: f64) -> f64 {
    const ROUNDS: usize = 60;
    let (mut a, mut b) = (at(left), at(right));
    if a <= 0.0 {
        return left;
    }
    let mut stayed = 0;
    for _ in 0..ROUNDS {
        let secant = left + (right - left) * a / (a - b);
        let middle = if secant > left && secant < right { secant } else { 0.5 * (left + right) };
        if middle <= left || middle >= right {
            break;
        }
        let value = at(middle);
        if value == 0.0 {
            return middle;
        }
        // The Illinois rule: an end that stays a second time counts half.
        if value > 0.0 {
            (left, a) = (middle, value);
            b *= if stayed == 1 { 0.5 } else { 1.0 };
            stayed = 1;
        } else {
            (right, b) = (middle, value);
            a *= if stayed == -1 { 0.5 } else { 1.0 };
            stayed = -1;
        }
        if (right - left).abs() < f64::EPSILON {
            break;
        }
    }
    0.5 * (left + right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_extremum_between_sections_is_found() {
        for depth in [1e-2, 1e-4, 1e-8, 1e-11] {
            let at = |s: f64| (s - 0.51234f64).powi(2) - depth;
            let places: Vec<f64> = (0..=SECTIONS).map(|k| k as f64 / SECTIONS as f64).collect();
            let margins: Vec<f64> = places.iter().map(|s| at(*s)).collect();
            let found = violated(&places, &margins, 0.0, &at, &|_, _| false);
            let Some(Course::Crosses([left, right])) = found else { panic!("{depth}: {found:?}") };
            let place = root(&at, left, right);
            assert!((place - (0.51234 - depth.sqrt())).abs() < 1e-9, "{depth}: {place}");
        }
        let above = |s: f64| (s - 0.51234f64).powi(2) + 1e-5;
        let places: Vec<f64> = (0..=SECTIONS).map(|k| k as f64 / SECTIONS as f64).collect();
        let margins: Vec<f64> = places.iter().map(|s| above(*s)).collect();
        let found = violated(&places, &margins, 0.0, &above, &|_, value| value < 1e-4);
        assert!(matches!(found, Some(Course::Nears(place)) if (place - 0.51234).abs() < 1e-6), "{found:?}");
    }
}
