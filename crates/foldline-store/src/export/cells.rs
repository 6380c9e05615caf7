//! Contents of the exported tables.

use foldline::diagram::{Branch, Kind, Origin, Point, Response, Solution, SpecialPoint};
use foldline::model::Model;
use foldline::special::quantity::Quantity;

/// Contents of one cell.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cell {
    Text(String),
    Integer(i64),
    Real(f64),
    Empty,
}

/// Largest number of coefficients of a normal form.
const COEFFICIENTS: usize = 6;

fn count(n: usize) -> Cell {
    Cell::Integer(i64::try_from(n).unwrap_or(i64::MAX))
}

fn padded(values: &[f64], width: usize) -> impl Iterator<Item = Cell> {
    (0..width).map(|k| values.get(k).map_or(Cell::Empty, |v| Cell::Real(*v)))
}

/// The cells of [`super::columns::Variables::of_point`].
pub(super) fn point_cells(point: &Point, model: &Model, cycles: bool) -> Vec<Cell> {
    let (n, outputs) = (model.states.len(), model.outputs.len());
    let mut out = vec![Cell::Integer(point.position)];
    out.extend(padded(&point.parameters, model.parameters.len()));
    out.push(point.solution.period().map_or(Cell::Empty, Cell::Real));
    out.push(Cell::Integer(point.solution.forcing_periods().into()));
    out.extend(model.angles().map(|(k, period)| Cell::Integer(point.solution.turns(k, period))));
    out.extend(padded(point.ranges.as_flattened(), 2 * (n + outputs)));
    let of = |quantity: Quantity| quantity.of(point).map_or(Cell::Empty, Cell::Real);
    out.extend((0..n + outputs).flat_map(|k| [of(Quantity::Mean(k)), of(Quantity::Rms(k))]));
    // The recorded quantities follow the averages.
    let recorded = point.averages.iter().skip(n + outputs).map(|own| own[0]);
    out.extend(recorded.map(|value| if value.is_nan() { Cell::Empty } else { Cell::Real(value) }));
    let (state, degree, intervals) = match &point.solution {
        Solution::Equilibrium(state) => (&state[..], 0, 0),
        Solution::Cycle(cycle) => (&[][..], cycle.degree, cycle.intervals()),
        Solution::Torus(torus) => (&[][..], torus.degree, torus.intervals()),
    };
    if !cycles {
        out.extend(padded(state, n));
    }
    out.push(count(point.unstable));
    let trust = point.trust;
    let sizes = [trust.discretisation, trust.residual, trust.trivial_defect, trust.liouville_defect, trust.spectrum];
    out.extend(sizes.into_iter().chain([point.step]).map(Cell::Real));
    let cost = point.cost;
    let counts = [cost.newton, cost.factorisations, cost.rejected, cost.evaluations, cost.linearisations];
    out.extend(counts.into_iter().chain([degree, intervals]).map(count));
    out
}

/// The cells of [`super::columns::Variables::of_special`].
pub(super) fn special_cells(special: &SpecialPoint) -> Vec<Cell> {
    let each = |list: &[f64]| -> Vec<Cell> {
        (0..COEFFICIENTS).map(|k| list.get(k).map_or(Cell::Empty, |v| Cell::Real(*v))).collect()
    };
    let mut out = vec![
        Cell::Text(special.kind.name().into()),
        count(special.unstable_before),
        count(special.unstable_after),
        Cell::Real(special.error),
        Cell::Text(special.normal_form()),
    ];
    out.extend(each(&special.coefficients));
    out.extend(each(&special.coefficient_errors));
    out
}

/// The cells of [`super::columns::Variables::of_response`].
pub(super) fn response_cells(response: &Response, model: &Model) -> Vec<Cell> {
    let (n, outputs) = (model.states.len(), model.outputs.len());
    let (first, second) = response.ratio.unwrap_or((0, 0));
    let known = |value: Option<usize>| value.map_or(Cell::Integer(-1), count);
    let mut out = vec![
        Cell::Text(response.motion.name().into()),
        Cell::Real(response.value),
        response.period.map_or(Cell::Empty, Cell::Real),
        Cell::Integer(first.into()),
        Cell::Integer(second.into()),
        Cell::Integer(response.multiplicity.into()),
        count(response.hits),
        known(response.share.map(|share| share.hits)),
        known(response.share.map(|share| share.of)),
        known(response.jumped.map(usize::from)),
        Cell::Real(response.settled_after),
        Cell::Real(response.error),
    ];
    let known = &response.recognition;
    for pair in [known.rotation, known.exponent] {
        out.extend(pair.map_or([Cell::Empty, Cell::Empty], |pair| pair.map(Cell::Real)));
    }
    out.extend(padded(&response.parameters, model.parameters.len()));
    out.extend(padded(response.ranges.as_flattened(), 2 * (n + outputs)));
    out.extend(padded(&response.state, n));
    out
}

/// The cells of [`super::columns::of_branch`].
pub(super) fn branch_cells(branch: &Branch, model: &Model, points: u64) -> Vec<Cell> {
    let word = |text: &str| Cell::Text(text.to_string());
    let parameter = |index: Option<usize>| {
        let found = index.and_then(|k| model.parameters.get(k));
        word(found.map_or("", |p| p.name.as_str()))
    };
    let kind = |kind: Option<Kind>| word(kind.map_or("", Kind::name));
    let (origin, name, at_kind, at) = match &branch.origin {
        Origin::Seed(name) => ("seed", name, None, Cell::Empty),
        Origin::EndOf(name) => ("end-of", name, None, Cell::Empty),
        Origin::Switch { parent, kind, parameter } => ("switch", parent, Some(*kind), Cell::Real(*parameter)),
    };
    let mut out = vec![
        word(&branch.name),
        word(branch.family.name()),
        parameter(Some(branch.free)),
        kind(branch.held.map(|(kind, _)| kind)),
        parameter(branch.held.map(|(_, follows)| follows)),
        Cell::Real(branch.units[1]),
        word(origin),
        word(name),
        kind(at_kind),
        at,
    ];
    for end in &branch.ends {
        out.push(word(end.as_ref().map_or("", |end| end.code())));
        out.push(Cell::Text(end.as_ref().map_or_else(String::new, |end| end.to_string())));
    }
    out.extend([Cell::Integer(i64::try_from(points).unwrap_or(i64::MAX)), count(branch.special.len())]);
    out
}

/// Returns an exported profile: normalised times `[k]` and states `[k][n]`. The last state is the first one, with each
/// angle increased by its gain over the period.
pub(super) fn profile(point: &Point) -> Option<(Vec<f64>, Vec<f64>)> {
    let Solution::Cycle(cycle) = &point.solution else { return None };
    let scheme = cycle.scheme();
    // An iterate of a map lasts until the next one.
    let nodes = &scheme.nodes[..=cycle.degree];
    let mut times = Vec::with_capacity(cycle.profile.len() / cycle.dim().max(1) + 1);
    for ends in cycle.mesh.windows(2) {
        times.extend(nodes.iter().map(|c| ends[0] + c * (ends[1] - ends[0])));
    }
    times.extend(cycle.mesh.last());
    let mut end = cycle.profile[..cycle.dim().min(cycle.profile.len())].to_vec();
    end.iter_mut().zip(&cycle.gain).for_each(|(x, gain)| *x += gain);
    Some((times, [&cycle.profile[..], &end].concat()))
}
