//! What is exported of a point, by the names that all formats share.

use crate::run_file::{Columns, free_name};
use foldline::diagram::{Branch, Kind, Origin, Point, Response, Solution, SpecialPoint};
use foldline::model::Model;
use foldline::problem::gauss::Scheme;

/// What the cells of a column are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Class {
    Text,
    Integer,
    Real,
}

/// A column of a table, or a variable.
#[derive(Clone, Debug)]
pub(super) struct Column {
    pub(super) name: String,
    pub(super) class: Class,
    pub(super) unit: String,
    pub(super) description: String,
}

/// What stands in a column.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cell {
    Text(String),
    Integer(i64),
    Real(f64),
    Empty,
}

fn column(name: &str, class: Class, description: &str) -> Column {
    Column { name: name.into(), class, unit: String::new(), description: description.into() }
}

fn real(name: &str, description: &str) -> Column {
    column(name, Class::Real, description)
}

fn integer(name: &str, description: &str) -> Column {
    column(name, Class::Integer, description)
}

fn text(name: &str, description: &str) -> Column {
    column(name, Class::Text, description)
}

/// The columns of a model.
pub(super) struct Variables {
    parameters: Vec<Column>,
    ranges: Vec<Column>,
    states: Vec<Column>,
}

/// What columns and dimensions of ours are called, in any of the tables and groups.
const OWN: &[&str] = &[
    "branch",
    "position",
    "period",
    "forcing_periods",
    "unstable",
    "discretisation",
    "residual",
    "trivial_defect",
    "liouville_defect",
    "spectrum_error",
    "step",
    "newton",
    "factorisations",
    "rejected",
    "evaluations",
    "linearisations",
    "degree",
    "intervals",
    "kind",
    "unstable_before",
    "unstable_after",
    "error",
    "normal_form",
    "coefficient_1",
    "coefficient_2",
    "set",
    "search",
    "free",
    "motion",
    "value",
    "ratio_first",
    "ratio_second",
    "multiplicity",
    "hits",
    "settled_after",
    "point",
    "node",
    "special",
    "special_node",
    "mode",
    "response",
    "normalised_time",
    "spectrum_re",
    "spectrum_im",
];

impl Variables {
    pub(super) fn new(model: &Model) -> Variables {
        let names = Columns::new(model);
        let mut taken: Vec<String> = OWN.iter().map(|name| name.to_string()).collect();
        let mut labelled = |name: &String, unit: &str, description: String| Column {
            unit: unit.to_string(),
            ..real(&free_name(name.clone(), &mut taken), &description)
        };
        let parameters = names.parameters.iter().zip(&model.parameters);
        let parameters: Vec<Column> =
            parameters.map(|(name, p)| labelled(name, &p.unit, described(&p.name, &p.description))).collect();
        let ranged = model.states.iter().map(|s| (&s.name, &s.unit, &s.description));
        let ranged: Vec<_> = ranged.chain(model.outputs.iter().map(|o| (&o.name, &o.unit, &o.description))).collect();
        let ends = ["smallest", "largest"].into_iter().cycle().zip(&names.ranges).enumerate();
        let range = |(k, (end, column)): (usize, (&str, &String))| {
            let (name, unit, description) = ranged[k / 2];
            labelled(column, unit, format!("{end} value of {}", described(name, description)))
        };
        let ranges = ends.map(range).collect();
        let states = model.states.iter();
        let states = states.map(|s| labelled(&s.name, &s.unit, described(&s.name, &s.description))).collect();
        Variables { parameters, ranges, states }
    }

    /// The states of an equilibrium, or of a profile.
    pub(super) fn states(&self) -> &[Column] {
        &self.states
    }

    /// What the columns of these parameters are called.
    pub(super) fn names_of(&self, parameters: &[usize]) -> Vec<String> {
        parameters.iter().filter_map(|k| self.parameters.get(*k)).map(|column| column.name.clone()).collect()
    }

    /// Of a point: what is one number each. `cycles` says that the states are not among them.
    pub(super) fn of_point(&self, cycles: bool) -> Vec<Column> {
        let mut out = vec![integer("position", "place on the branch, 0 at the start")];
        out.extend_from_slice(&self.parameters);
        out.push(real("period", "period of a cycle"));
        out.push(integer("forcing_periods", "periods of the forcing that a cycle lasts, 0 where there is none"));
        out.extend_from_slice(&self.ranges);
        if !cycles {
            out.extend_from_slice(&self.states);
        }
        out.extend([
            integer("unstable", "number of unstable eigenvalues or multipliers"),
            real("discretisation", "estimated discretisation error, relative"),
            real("residual", "of the equations after the last Newton step, relative"),
            real("trivial_defect", "distance from 1 of the multiplier that is 1 in exact arithmetic"),
            real(
                "liouville_defect",
                "difference of log of the product of the multipliers and the integral of the trace",
            ),
            real(
                "spectrum_error",
                "estimated error of eigenvalues or multipliers, relative to the larger of 1 and their modulus",
            ),
            real("step", "arclength with which the next point was to be tried"),
            integer("newton", "Newton iterations since the point before"),
            integer("factorisations", "matrices factorised since the point before"),
            integer("rejected", "steps rejected since the point before"),
            integer("evaluations", "points at which the vector field was evaluated since the point before"),
            integer("linearisations", "points at which its derivatives were evaluated since the point before"),
            integer("degree", "of the collocation polynomials, 0 for equilibria"),
            integer("intervals", "mesh intervals, 0 for equilibria"),
        ]);
        out
    }

    /// Of a special point, besides that.
    pub(super) fn of_special() -> Vec<Column> {
        vec![
            text("kind", "what happens there"),
            integer("unstable_before", "number of unstable eigenvalues or multipliers before it"),
            integer("unstable_after", "number of unstable eigenvalues or multipliers behind it"),
            real("error", "bound on the error of parameter, period and extremes, relative to 1 + |value|"),
            text("normal_form", "coefficients of the normal form, and what follows from them, in words"),
            real("coefficient_1", "first coefficient of the normal form"),
            real("coefficient_2", "second coefficient of the normal form"),
        ]
    }

    /// Of what simulation saw.
    pub(super) fn of_response(&self) -> Vec<Column> {
        let mut out = vec![
            text("motion", "equilibrium, cycle, other or escaped"),
            real("value", "of the parameter that varies"),
            real("period", "period of a cycle"),
            integer("ratio_first", "of the spectral ratio of a cycle, 0 where there is none"),
            integer("ratio_second", "of the spectral ratio of a cycle, 0 where there is none"),
            integer("multiplicity", "over how many turns of its strongest lines a cycle closes"),
            integer("hits", "how many starts went there"),
            real("settled_after", "time until it had settled"),
            real("error", "by how much the motion fails to repeat itself, relative to its extent"),
        ];
        out.extend_from_slice(&self.parameters);
        out.extend_from_slice(&self.ranges);
        out.extend_from_slice(&self.states);
        out
    }
}

fn described(name: &str, description: &str) -> String {
    let line = description.split_whitespace().collect::<Vec<_>>().join(" ");
    if line.is_empty() { name.to_string() } else { line }
}

fn count(n: usize) -> Cell {
    Cell::Integer(i64::try_from(n).unwrap_or(i64::MAX))
}

fn padded(values: &[f64], width: usize) -> impl Iterator<Item = Cell> {
    (0..width).map(|k| values.get(k).map_or(Cell::Empty, |v| Cell::Real(*v)))
}

/// The cells of [`Variables::of_point`].
pub(super) fn point_cells(point: &Point, model: &Model, cycles: bool) -> Vec<Cell> {
    let (n, outputs) = (model.states.len(), model.outputs.len());
    let mut out = vec![Cell::Integer(point.position)];
    out.extend(padded(&point.parameters, model.parameters.len()));
    out.push(point.solution.period().map_or(Cell::Empty, Cell::Real));
    out.push(Cell::Integer(point.solution.forcing_periods().into()));
    out.extend(padded(point.ranges.as_flattened(), 2 * (n + outputs)));
    let (state, degree, intervals) = match &point.solution {
        Solution::Equilibrium(state) => (&state[..], 0, 0),
        Solution::Cycle(cycle) => (&[][..], cycle.degree, cycle.intervals()),
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

/// The cells of [`Variables::of_special`].
pub(super) fn special_cells(special: &SpecialPoint) -> Vec<Cell> {
    let coefficient = |k: usize| special.coefficients.get(k).map_or(Cell::Empty, |v| Cell::Real(*v));
    vec![
        Cell::Text(special.kind.name().into()),
        count(special.unstable_before),
        count(special.unstable_after),
        Cell::Real(special.error),
        Cell::Text(special.normal_form()),
        coefficient(0),
        coefficient(1),
    ]
}

/// The cells of [`Variables::of_response`].
pub(super) fn response_cells(response: &Response, model: &Model) -> Vec<Cell> {
    let (n, outputs) = (model.states.len(), model.outputs.len());
    let (first, second) = response.ratio.unwrap_or((0, 0));
    let mut out = vec![
        Cell::Text(response.motion.name().into()),
        Cell::Real(response.value),
        response.period.map_or(Cell::Empty, Cell::Real),
        Cell::Integer(first.into()),
        Cell::Integer(second.into()),
        Cell::Integer(response.multiplicity.into()),
        count(response.hits),
        Cell::Real(response.settled_after),
        Cell::Real(response.error),
    ];
    out.extend(padded(&response.parameters, model.parameters.len()));
    out.extend(padded(response.ranges.as_flattened(), 2 * (n + outputs)));
    out.extend(padded(&response.state, n));
    out
}

/// What there is to say about a branch.
pub(super) fn of_branch() -> Vec<Column> {
    vec![
        text("branch", "name of the branch"),
        text("family", "equilibrium or cycle"),
        text("free", "parameter that varies"),
        text("held", "kind of special point held along a curve in two parameters"),
        text("follows", "parameter that follows from the free one on such a curve"),
        text("origin", "seed, end-of another branch, or switch at a special point of another branch"),
        text("origin_name", "name of that seed or branch"),
        text("origin_kind", "kind of that special point"),
        real("origin_parameter", "value of the parameter at that special point"),
        text("backward_end", "how the backward side ended, in a word"),
        text("backward_sentence", "how the backward side ended"),
        text("forward_end", "how the forward side ended, in a word"),
        text("forward_sentence", "how the forward side ended"),
        integer("points", "number of points"),
        integer("special", "number of special points"),
    ]
}

/// The cells of [`of_branch`].
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

/// A profile as it is exported: normalised times `[k]` and states `[k][n]`. At the end of the period the first state is repeated.
pub(super) fn profile(point: &Point) -> Option<(Vec<f64>, Vec<f64>)> {
    let Solution::Cycle(cycle) = &point.solution else { return None };
    let scheme = Scheme::new(cycle.degree);
    let mut times = Vec::with_capacity(cycle.profile.len() / cycle.dim().max(1) + 1);
    for ends in cycle.mesh.windows(2) {
        times.extend(scheme.nodes.iter().map(|c| ends[0] + c * (ends[1] - ends[0])));
    }
    times.extend(cycle.mesh.last());
    let first = &cycle.profile[..cycle.dim().min(cycle.profile.len())];
    Some((times, [&cycle.profile[..], first].concat()))
}
