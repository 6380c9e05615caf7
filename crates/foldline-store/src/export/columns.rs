//! Columns of the exported tables, with the names that all formats share.

use crate::run_file::{Columns, free_name};
use foldline::model::Model;
use foldline::special::quantity::Quantity;

/// Type of the cells of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Class {
    Text,
    Integer,
    Real,
}

/// Column of a table, or variable of a NetCDF group.
#[derive(Clone, Debug)]
pub(super) struct Column {
    pub(super) name: String,
    pub(super) class: Class,
    pub(super) unit: String,
    pub(super) description: String,
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

/// Columns that depend on the model.
pub(super) struct Variables {
    parameters: Vec<Column>,
    turns: Vec<Column>,
    ranges: Vec<Column>,
    averages: Vec<Column>,
    states: Vec<Column>,
    /// Quantities that the study records.
    recorded: Vec<Column>,
    /// Unit of time; empty if unknown.
    time: String,
}

/// Reserved names of columns and dimensions, in all tables and groups.
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
    "coefficient_3",
    "coefficient_4",
    "coefficient_5",
    "coefficient_6",
    "coefficient_1_error",
    "coefficient_2_error",
    "coefficient_3_error",
    "coefficient_4_error",
    "coefficient_5_error",
    "coefficient_6_error",
    "set",
    "search",
    "free",
    "motion",
    "value",
    "ratio_first",
    "ratio_second",
    "multiplicity",
    "hits",
    "uniform_hits",
    "uniform_starts",
    "jumped",
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
    pub(super) fn new(model: &Model, record: &[(String, Quantity)]) -> Variables {
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
        let kinds = [("_mean", "mean of"), ("_rms", "root mean square of")];
        let mut averages = Vec::new();
        for (name, unit, description) in &ranged {
            for (ending, what) in kinds {
                let text = format!("{what} {} over the solution", described(name, description));
                averages.push(labelled(&format!("{name}{ending}"), unit, text));
            }
        }
        let turn = |(k, _): (usize, f64)| {
            let name = &model.states[k].name;
            let own = labelled(&format!("{name}_turns"), "1", format!("turns of {name} per cycle"));
            Column { class: Class::Integer, ..own }
        };
        let turns = model.angles().map(turn).collect();
        let states = model.states.iter();
        let states = states.map(|s| labelled(&s.name, &s.unit, described(&s.name, &s.description))).collect();
        // Names in files of arrays are letters, digits and underscores.
        let plain =
            |name: &str| name.replace('/', "_over_").replace('-', "_minus_").replace('+', "_plus_").replace(' ', "");
        let own = |(name, quantity): &(String, Quantity)| labelled(&plain(name), quantity.unit(model), name.clone());
        let recorded = record.iter().map(own).collect();
        Variables { parameters, turns, ranges, averages, states, recorded, time: model.time.clone() }
    }

    /// Columns of the states of an equilibrium or of a profile.
    pub(super) fn states(&self) -> &[Column] {
        &self.states
    }

    /// Column names of the given parameters.
    pub(super) fn names_of(&self, parameters: &[usize]) -> Vec<String> {
        parameters.iter().filter_map(|k| self.parameters.get(*k)).map(|column| column.name.clone()).collect()
    }

    /// Scalar columns of a point. If `cycles` is true, the states are left out; they are in the profile.
    pub(super) fn of_point(&self, cycles: bool) -> Vec<Column> {
        let mut out = vec![integer("position", "position on the branch, 0 at the start")];
        out.extend_from_slice(&self.parameters);
        out.push(Column { unit: self.time.clone(), ..real("period", "period of a cycle") });
        out.push(integer("forcing_periods", "forcing periods per cycle, 0 without forcing"));
        out.extend_from_slice(&self.turns);
        out.extend_from_slice(&self.ranges);
        out.extend_from_slice(&self.averages);
        out.extend_from_slice(&self.recorded);
        if !cycles {
            out.extend_from_slice(&self.states);
        }
        out.extend([
            integer("unstable", "number of unstable eigenvalues or multipliers"),
            real("discretisation", "estimated discretisation error, relative"),
            real("residual", "relative residual of the equations after the last Newton step"),
            real("trivial_defect", "distance from 1 of the multiplier that is 1 in exact arithmetic"),
            real(
                "liouville_defect",
                "difference between the log of the product of the multipliers and the integral of the trace",
            ),
            real("spectrum_error", "estimated error of eigenvalues or multipliers, relative to max(1, modulus)"),
            real("step", "arclength step to be tried for the next point"),
            integer("newton", "Newton iterations since the previous point"),
            integer("factorisations", "matrices factorised since the previous point"),
            integer("rejected", "steps rejected since the previous point"),
            integer("evaluations", "evaluations of the vector field since the previous point"),
            integer("linearisations", "evaluations of its derivatives since the previous point"),
            integer("degree", "degree of the collocation polynomials, 0 for equilibria"),
            integer("intervals", "mesh intervals, 0 for equilibria"),
        ]);
        out
    }

    /// Further columns of a special point.
    pub(super) fn of_special() -> Vec<Column> {
        let mut out = vec![
            text("kind", "kind of special point"),
            integer("unstable_before", "number of unstable eigenvalues or multipliers before it"),
            integer("unstable_after", "number of unstable eigenvalues or multipliers after it"),
            real(
                "error",
                "bound on the error: of the parameter and of extremes of states relative to their scale + |value|, of the period relative to that, of extremes of outputs relative to 1 + |value|",
            ),
            text("normal_form", "coefficients of the normal form and what follows from them, as text"),
        ];
        for name in OWN.iter().filter(|name| name.starts_with("coefficient_")) {
            let text = match name.ends_with("_error") {
                false => "coefficient of the normal form, in the order of normal_form",
                true => "bound on the error of that coefficient",
            };
            out.push(real(name, text));
        }
        out
    }

    /// Columns of a response found by simulation.
    pub(super) fn of_response(&self) -> Vec<Column> {
        let mut out = vec![
            text("motion", "equilibrium, cycle, torus, chaos, other or escaped"),
            real("value", "value of the free parameter"),
            real("period", "period of a cycle"),
            integer("ratio_first", "first number of the spectral ratio of a cycle, 0 if there is none"),
            integer("ratio_second", "second number of the spectral ratio of a cycle, 0 if there is none"),
            integer("multiplicity", "number of turns of its strongest spectral lines after which a cycle closes"),
            integer("hits", "number of starts that settled there, including those drawn towards the origin"),
            integer(
                "uniform_hits",
                "number of starts drawn uniformly from the ranges that settled there; -1 in a sweep",
            ),
            integer("uniform_starts", "number of starts drawn uniformly from the ranges; -1 in a sweep"),
            integer("jumped", "1 if the sweep left the solution of the previous value, 0 if not, -1 if unknown"),
            real("settled_after", "settling time"),
            real("error", "deviation of the motion from periodicity, relative to its extent"),
            real("rotation", "rotation number of a torus, turns per period"),
            real("rotation_error", "error of the rotation number"),
            real("exponent", "largest Lyapunov exponent other than that along the motion"),
            real("exponent_error", "error of the exponent"),
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

/// Columns of a branch.
pub(super) fn of_branch() -> Vec<Column> {
    vec![
        text("branch", "name of the branch"),
        text("family", "equilibrium or cycle"),
        text("free", "free parameter"),
        text("held", "kind of special point continued along a two-parameter curve"),
        text("follows", "second parameter of such a curve, which follows from the free one"),
        real("scale", "scale of the free parameter, relative to which its errors are stated"),
        text("origin", "seed, end-of another branch, or switch at a special point of another branch"),
        text("origin_name", "name of that seed or branch"),
        text("origin_kind", "kind of that special point"),
        real("origin_parameter", "value of the parameter at that special point"),
        text("backward_end", "code of how the backward side ended"),
        text("backward_sentence", "how the backward side ended"),
        text("forward_end", "code of how the forward side ended"),
        text("forward_sentence", "how the forward side ended"),
        integer("points", "number of points"),
        integer("special", "number of special points"),
    ]
}
