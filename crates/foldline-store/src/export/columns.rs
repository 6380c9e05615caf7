//! What is exported of a point, by the names that all formats share.

use crate::run_file::{Columns, free_name};
use foldline::model::Model;

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
    turns: Vec<Column>,
    ranges: Vec<Column>,
    averages: Vec<Column>,
    states: Vec<Column>,
    /// Unit of time; empty where it is not known.
    time: String,
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
            let own = labelled(&format!("{name}_turns"), "1", format!("how often {name} turns over a cycle"));
            Column { class: Class::Integer, ..own }
        };
        let turns = model.angles().map(turn).collect();
        let states = model.states.iter();
        let states = states.map(|s| labelled(&s.name, &s.unit, described(&s.name, &s.description))).collect();
        Variables { parameters, turns, ranges, averages, states, time: model.time.clone() }
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
        out.push(Column { unit: self.time.clone(), ..real("period", "period of a cycle") });
        out.push(integer("forcing_periods", "periods of the forcing that a cycle lasts, 0 where there is none"));
        out.extend_from_slice(&self.turns);
        out.extend_from_slice(&self.ranges);
        out.extend_from_slice(&self.averages);
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
        let mut out = vec![
            text("kind", "what happens there"),
            integer("unstable_before", "number of unstable eigenvalues or multipliers before it"),
            integer("unstable_after", "number of unstable eigenvalues or multipliers behind it"),
            real(
                "error",
                "bound on the error: of the parameter and of extremes of states relative to their scale + |value|, of the period relative to that, of extremes of outputs relative to 1 + |value|",
            ),
            text("normal_form", "coefficients of the normal form, and what follows from them, in words"),
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

    /// Of what simulation saw.
    pub(super) fn of_response(&self) -> Vec<Column> {
        let mut out = vec![
            text("motion", "equilibrium, cycle, other or escaped"),
            real("value", "of the parameter that varies"),
            real("period", "period of a cycle"),
            integer("ratio_first", "of the spectral ratio of a cycle, 0 where there is none"),
            integer("ratio_second", "of the spectral ratio of a cycle, 0 where there is none"),
            integer("multiplicity", "over how many turns of its strongest lines a cycle closes"),
            integer("hits", "how many starts went there, those drawn towards the origin included"),
            integer("uniform_hits", "how many of the starts drawn uniformly from the ranges went there; -1 in a sweep"),
            integer("uniform_starts", "how many starts were drawn uniformly from the ranges; -1 in a sweep"),
            integer(
                "jumped",
                "1 where a sweep has left the solution of the value before, 0 where not, -1 where it is not known",
            ),
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

/// What there is to say about a branch.
pub(super) fn of_branch() -> Vec<Column> {
    vec![
        text("branch", "name of the branch"),
        text("family", "equilibrium or cycle"),
        text("free", "parameter that varies"),
        text("held", "kind of special point held along a curve in two parameters"),
        text("follows", "parameter that follows from the free one on such a curve"),
        real("scale", "scale of the free parameter, relative to which its errors are stated"),
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
