//! Changes of special points by a smoothed law.
//!
//! **Idea.** The diagram of an exact law is compared with those of the smoothed one at two sharpnesses K₁ < K₂. A point of
//! the exact diagram corresponds to the one that is closest at K₂, provided that its counterpart at K₁ is farther away:
//! points that smoothing creates or removes do not converge to anything.
//!
//! **Equations.** With δ_k = λ(K_k) - λ of the parameter at the point:
//!
//! ```text
//!   (1)  p = ln |δ₁/δ₂| / ln (K₂/K₁)                     δ ~ K⁻ᵖ
//! ```
//!
//! **Fails when** two points of one kind lie closer to each other than their changes by smoothing.

use crate::diagram::{Branch, Diagram, Kind, SpecialPoint};

/// Least order with which points that correspond approach each other: half of that of an equilibrium on a surface, the least
/// known, since the asymptotic order need not be reached.
const SLOWEST: f64 = 0.5;
/// Beginning of the remark of a point at which a branch turns back at a surface, which is a fold if the law is smoothed.
const TURNS: &str = "non-smooth fold";

/// A special point of the exact law, its counterparts with the smoothed one, or one of them alone.
#[derive(Clone, Debug)]
pub struct Change<'d> {
    /// Branch.
    pub branch: String,
    /// Index of its free parameter.
    pub free: usize,
    /// The point with the exact law.
    pub exact: Option<&'d SpecialPoint>,
    /// The points at both sharpnesses.
    pub smooth: [Option<&'d SpecialPoint>; 2],
    /// Bounds on the errors of the parameter at these three points; 0 where there is none.
    errors: [f64; 3],
}

impl Change<'_> {
    fn value(&self, at: Option<&SpecialPoint>) -> Option<f64> {
        at.map(|special| special.point.parameters[self.free])
    }

    /// δ_k, and a bound on its error.
    pub fn difference(&self, k: usize) -> Option<(f64, f64)> {
        let change = self.value(self.smooth[k])? - self.value(self.exact)?;
        Some((change, self.errors[0] + self.errors[k + 1]))
    }

    /// p of (1), and a bound on its error; `None` if a difference is not larger than its error.
    pub fn order(&self, sharpness: [f64; 2]) -> Option<(f64, f64)> {
        let [(one, error), (two, other)] = [self.difference(0)?, self.difference(1)?];
        let span = (sharpness[1] / sharpness[0]).ln();
        let certain = one.abs() > error && two.abs() > other;
        certain.then(|| ((one / two).abs().ln() / span, (error / one.abs() + other / two.abs()) / span))
    }
}

/// The changes of the special points of all branches of the exact diagram: those of the exact law in the order of positions, then
/// those of the smoothed one that have no counterpart. Marks are left out.
pub fn changes<'d>(exact: &'d Diagram, smooth: [&'d Diagram; 2], sharpness: [f64; 2]) -> Vec<Change<'d>> {
    let own = exact.branches.iter().filter(|branch| branch.held.is_none());
    own.flat_map(|branch| of_branch(branch, smooth.map(|diagram| diagram.branch(&branch.name)), sharpness)).collect()
}

fn of_branch<'d>(exact: &'d Branch, smooth: [Option<&'d Branch>; 2], sharpness: [f64; 2]) -> Vec<Change<'d>> {
    let listed = |branch: &'d Branch| -> Vec<&'d SpecialPoint> {
        branch.special.iter().filter(|special| special.kind != Kind::Mark).collect()
    };
    let own = listed(exact);
    let [one, two] = smooth.map(|branch| branch.map(listed).unwrap_or_default());
    let sizes = Sizes::of(exact, [&own, &one, &two]);
    // From the exact law to the sharper one, and on to the other.
    let to_sharper = sizes.pairs(&own, &two, &corresponds);
    let to_other = sizes.pairs(&two, &one, &|a, b| a.kind == b.kind);
    let ratio = (sharpness[1] / sharpness[0]).powf(SLOWEST);
    let (mut used, mut all): ([Vec<usize>; 2], Vec<Change>) = Default::default();
    let error = |special: Option<&&SpecialPoint>| {
        special.map_or(0.0, |own| own.error * exact.size(own.point.parameters[exact.free]))
    };
    let change = |at: [Option<&&'d SpecialPoint>; 3]| Change {
        branch: exact.name.clone(),
        free: exact.free,
        exact: at[0].copied(),
        smooth: [at[1].copied(), at[2].copied()],
        errors: at.map(error),
    };
    for (k, special) in own.iter().enumerate() {
        let partners = to_sharper.iter().find(|pair| pair[0] == k).and_then(|pair| {
            let next = to_other.iter().find(|other| other[0] == pair[1])?;
            let [near, far] = [two[pair[1]], one[next[1]]].map(|own| sizes.apart(special, own));
            let found = change([Some(special), Some(&one[next[1]]), Some(&two[pair[1]])]);
            let alike = (0..2).all(|k| found.difference(k).is_some_and(|(own, error)| own.abs() <= error));
            (alike || far >= ratio * near).then_some((found, [next[1], pair[1]]))
        });
        match partners {
            Some((found, [a, b])) => {
                used[0].push(a);
                used[1].push(b);
                all.push(found);
            }
            None => all.push(change([Some(special), None, None])),
        }
    }
    for pair in &to_other {
        if used[1].contains(&pair[0]) || used[0].contains(&pair[1]) {
            continue;
        }
        used[1].push(pair[0]);
        used[0].push(pair[1]);
        all.push(change([None, Some(&one[pair[1]]), Some(&two[pair[0]])]));
    }
    all.extend((0..one.len()).filter(|k| !used[0].contains(k)).map(|k| change([None, Some(&one[k]), None])));
    all.extend((0..two.len()).filter(|k| !used[1].contains(k)).map(|k| change([None, None, Some(&two[k])])));
    all
}

/// True if a point of the exact law may be that one of the smoothed law.
fn corresponds(exact: &SpecialPoint, smooth: &SpecialPoint) -> bool {
    let turns = matches!(exact.kind, Kind::Grazing | Kind::BoundaryEquilibrium) && exact.remark.contains(TURNS);
    exact.kind == smooth.kind || turns && smooth.kind == Kind::Fold
}

/// Sizes of the quantities by which points are compared.
struct Sizes {
    free: usize,
    parameter: f64,
    ranges: Vec<f64>,
}

impl Sizes {
    fn of(branch: &Branch, all: [&[&SpecialPoint]; 3]) -> Sizes {
        let points = || all.into_iter().flatten().map(|special| &special.point);
        let count = points().map(|point| point.ranges.len()).max().unwrap_or(0);
        let range = |k: usize| {
            points().filter_map(|point| point.ranges.get(k)).flatten().fold(0.0, |most: f64, v| most.max(v.abs()))
        };
        let free = branch.free;
        let parameter = points().fold(branch.units[1], |most, point| most.max(point.parameters[free].abs()));
        Sizes { free, parameter, ranges: (0..count).map(range).collect() }
    }

    /// Largest relative difference of parameter, period and ranges.
    fn apart(&self, a: &SpecialPoint, b: &SpecialPoint) -> f64 {
        let parameter = (a.point.parameters[self.free] - b.point.parameters[self.free]).abs() / self.parameter;
        let period = match (a.point.solution.free_period(), b.point.solution.free_period()) {
            (Some(one), Some(other)) => (one - other).abs() / one.abs().max(other.abs()),
            _ => 0.0,
        };
        let ranges = a.point.ranges.iter().zip(&b.point.ranges).zip(&self.ranges).filter(|(_, size)| **size > 0.0);
        let off = ranges.flat_map(|((a, b), size)| [0, 1].map(|end| (a[end] - b[end]).abs() / size));
        off.filter(|off| off.is_finite()).fold(parameter.max(period), f64::max)
    }

    /// Pairs of points that correspond, the closest first.
    fn pairs(
        &self,
        one: &[&SpecialPoint],
        other: &[&SpecialPoint],
        corresponds: &dyn Fn(&SpecialPoint, &SpecialPoint) -> bool,
    ) -> Vec<[usize; 2]> {
        let each = (0..one.len()).flat_map(|a| (0..other.len()).map(move |b| [a, b]));
        let mut all: Vec<(f64, [usize; 2])> = each
            .filter(|[a, b]| corresponds(one[*a], other[*b]))
            .map(|[a, b]| (self.apart(one[a], other[b]), [a, b]))
            .collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut found: Vec<[usize; 2]> = Vec::new();
        for (_, pair) in all {
            if found.iter().all(|known| known[0] != pair[0] && known[1] != pair[1]) {
                found.push(pair);
            }
        }
        found
    }
}
