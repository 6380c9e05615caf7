//! Conserved totals as parameters.
//!
//! **Idea.** A conserved sum of states makes every solution one of a family. If its value is given, one of its states
//! follows from the others: that state becomes a definition, the total becomes a parameter, and the remaining system
//! has isolated solutions.
//!
//! **Equations.** For totals T_i = Σ c_ij x_j with c·f = 0, and one state e(i) of each:
//!
//! ```text
//!   (1)  x_e = C_e⁻¹ (T - C_r x_r)      e the eliminated states, r the others
//! ```

use super::error::{Field, Item, ModelError};
use super::source::{Definition, ModelSource, Output, Parameter, Total};
use super::{Batch, Model, Parameters, laws};
use crate::contract::VectorField;
use crate::linalg::lu;

/// Conserved total of a compiled model.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept {
    /// Index of its parameter.
    pub parameter: usize,
    /// Eliminated state, no longer one of the model.
    pub instead_of: String,
    /// Terms of the sum: names of states, including the eliminated one, with their coefficients.
    pub terms: Vec<(String, f64)>,
}

/// Number of sample points at which linearity of a sum is tested.
const PLACES: usize = 4;

/// Model without the states eliminated by its totals, and the totals.
pub(super) fn reduced(source: ModelSource) -> Result<(ModelSource, Vec<Kept>), Vec<ModelError>> {
    let whole = whole(&source)?;
    let rows = sums(&whole, &source)?;
    let followers = followers(&source, &whole, &rows)?;
    let Some(solved) = solved(&rows, &followers) else {
        let message = "the totals do not determine the states that follow from them";
        let hint = "leave out a total that is a combination of others, or name other states with `instead-of`";
        return Err(vec![complaint(&source, 0, Field::Name, message.into(), hint.into())]);
    };
    let names: Vec<String> = whole.states.iter().map(|state| state.name.clone()).collect();
    let first = source.parameters.len();
    let kept = followers.iter().enumerate().map(|(i, follower)| Kept {
        parameter: first + i,
        instead_of: names[*follower].clone(),
        terms: names.iter().zip(&rows[i]).filter(|(_, c)| **c != 0.0).map(|(name, c)| (name.clone(), *c)).collect(),
    });
    let kept: Vec<Kept> = kept.collect();
    Ok((without(source, &names, &followers, &solved), kept))
}

fn complaint(source: &ModelSource, total: usize, field: Field, message: String, hint: String) -> ModelError {
    let name = source.totals[total].name.clone();
    ModelError { item: Item::Total(total), field, name, span: None, message, hint }
}

/// Model with all its states, each sum as an output.
fn whole(source: &ModelSource) -> Result<Model, Vec<ModelError>> {
    let mut plain = ModelSource { totals: Vec::new(), ..source.clone() };
    let first = plain.outputs.len();
    plain.outputs.extend(source.totals.iter().map(|total| Output::new(&total.name, &total.sum)));
    let place = |item: Item| match item {
        Item::Output(i) if i >= first => Item::Total(i - first),
        item => item,
    };
    Model::compile(plain).map_err(|found| {
        found.into_iter().map(|error| ModelError { item: place(error.item), ..error }).collect::<Vec<_>>()
    })
}

/// Coefficients `[total][n]`; errors if a sum is not linear or not conserved.
fn sums(whole: &Model, source: &ModelSource) -> Result<Vec<Vec<f64>>, Vec<ModelError>> {
    let (n, first) = (whole.dim(), whole.outputs.len() - source.totals.len());
    let parameters = whole.defaults();
    let of = |x: &[f64], total: usize| {
        let mut out = vec![0.0; whole.outputs.len()];
        let times: &[f64] = if whole.forced() { &[0.3] } else { &[] };
        whole.outputs(
            Batch { lanes: 1, states: x, parameters: Parameters::Shared(&parameters), times, signs: &[] },
            &mut out,
        );
        out[first + total]
    };
    let mut rows = Vec::new();
    let mut found = Vec::new();
    for i in 0..source.totals.len() {
        let unit = |j: usize| (0..n).map(|k| if k == j { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
        let row: Vec<f64> = (0..n).map(|j| of(&unit(j), i)).collect();
        let linear = (0..PLACES).all(|k| {
            let x: Vec<f64> = (0..n).map(|j| ((k * n + j) as f64 * 0.618).fract() * 4.0 - 2.0).collect();
            let terms: Vec<f64> = row.iter().zip(&x).map(|(c, x)| c * x).collect();
            let size = terms.iter().fold(0.0, |sum, term| sum + term.abs());
            (of(&x, i) - terms.iter().sum::<f64>()).abs() <= 1e-12 * size
        });
        if !linear || row.iter().all(|c| *c == 0.0) {
            let message = format!("`{}` is not a linear combination of states", source.totals[i].sum);
            let hint = "write a sum such as \"x + 2*y\"".into();
            found.push(complaint(source, i, Field::Expression, message, hint));
        } else if !laws::keeps_its_value(whole, &row) {
            let names: Vec<String> = whole.states.iter().map(|state| state.name.clone()).collect();
            let kept = laws::conserved(whole, &whole.defaults(), &whole.ranges());
            let kept: Vec<String> = kept.iter().map(|c| laws::in_words(c, &names)).collect();
            let hint = match kept.is_empty() {
                true => "no sum of states is conserved here: remove `totals`".to_string(),
                false => format!("conserved: {}", kept.join(", ")),
            };
            let message = format!("`{}` is not conserved", source.totals[i].sum);
            found.push(complaint(source, i, Field::Expression, message, hint));
        }
        rows.push(row);
    }
    if found.is_empty() { Ok(rows) } else { Err(found) }
}

/// State eliminated by each total: the one named, else the one with the largest stated scale, or the last of those.
fn followers(source: &ModelSource, whole: &Model, rows: &[Vec<f64>]) -> Result<Vec<usize>, Vec<ModelError>> {
    // A state that is not repeated and whose equation can be dropped.
    let single = |j: &usize| {
        let name = &whole.states[*j].name;
        let rate = format!("{name}'");
        let coupled = source.mass.iter().any(|mass| mass.row == *name || mass.column == *name);
        let whirls = source.whirl.as_ref().is_some_and(|pair| pair.contains(name));
        let own = source.states.iter().any(|state| state.name == *name && state.repeat.is_none());
        own && !coupled && !whirls && !name.ends_with('\'') && !source.states.iter().any(|state| state.name == rate)
    };
    let mut taken: Vec<usize> = Vec::new();
    for (i, (total, row)) in source.totals.iter().zip(rows).enumerate() {
        let free = |j: &usize| row[*j] != 0.0 && !taken.contains(j) && single(j);
        let size = |j: &usize| whole.states[*j].stated_scale().unwrap_or(0.0);
        let found = match &total.instead_of {
            Some(name) => whole.state_index(name).filter(free),
            None => (0..row.len()).filter(free).max_by(|a, b| size(a).total_cmp(&size(b))),
        };
        let Some(found) = found else {
            let message = match &total.instead_of {
                Some(name) => format!("`{name}` cannot be computed from `{}`", total.name),
                None => format!("no state can be computed from `{}`", total.name),
            };
            let hint = "it must be a state of the sum that is not an element of a family, has no velocity and no \
                        mass coupling, and belongs to no other total";
            let field = if total.instead_of.is_some() { Field::Name } else { Field::Expression };
            return Err(vec![complaint(source, i, field, message, hint.into())]);
        };
        taken.push(found);
    }
    Ok(taken)
}

/// C_e⁻¹ and C_e⁻¹ C_r of (1), row-major: `[total][total]` and `[total][n]`.
fn solved(rows: &[Vec<f64>], followers: &[usize]) -> Option<[Vec<f64>; 2]> {
    let (m, n) = (rows.len(), rows[0].len());
    let mut of_followers: Vec<f64> = rows.iter().flat_map(|row| followers.iter().map(|j| row[*j])).collect();
    let mut pivots = vec![0; m];
    lu::factorise(&mut of_followers, m, &mut pivots).ok()?;
    let mut inverse: Vec<f64> = (0..m * m).map(|k| if k % (m + 1) == 0 { 1.0 } else { 0.0 }).collect();
    lu::solve(&of_followers, m, &pivots, &mut inverse, m);
    if !inverse.iter().all(|v| v.is_finite() && v.abs() < 1e12) {
        return None;
    }
    let product = |i: usize, j: usize| (0..m).map(|k| inverse[i * m + k] * rows[k][j]).sum::<f64>();
    let others = (0..m).flat_map(|i| (0..n).map(move |j| (i, j)));
    let others = others.map(|(i, j)| if followers.contains(&j) { 0.0 } else { product(i, j) }).collect();
    Some([inverse, others])
}

/// Source after elimination by (1).
fn without(mut source: ModelSource, names: &[String], followers: &[usize], solved: &[Vec<f64>; 2]) -> ModelSource {
    let (m, n) = (followers.len(), names.len());
    let totals = std::mem::take(&mut source.totals);
    for (i, follower) in followers.iter().enumerate() {
        let name = &names[*follower];
        let term = |c: f64, name: &str| (c != 0.0).then(|| format!("({c:?})*{name}"));
        let of_totals = (0..m).filter_map(|k| term(solved[0][i * m + k], &totals[k].name));
        let of_states = (0..n).filter_map(|j| term(-solved[1][i * n + j], &names[j]));
        let expression: Vec<String> = of_totals.chain(of_states).collect();
        let state = source.states.iter().position(|state| state.name == *name);
        if let Some(state) = state.map(|at| source.states.remove(at)) {
            let shown = Output { unit: state.unit, description: state.description, ..Output::new(name, name) };
            source.outputs.push(shown);
        }
        source.equations.retain(|equation| equation.name != *name);
        source.definitions.push(Definition::new(name, &expression.join(" + ")));
    }
    source.parameters.extend(totals.into_iter().map(|total| {
        let Total { name, unit, description, value, .. } = total;
        Parameter { unit, description, ..Parameter::new(&name, value) }
    }));
    source
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::State;

    fn source(totals: &[(&str, &str, f64)]) -> ModelSource {
        let equations = [
            ("s", "-a*s*e + b*c"),
            ("e", "-a*s*e + (b + k)*c"),
            ("c", "a*s*e - (b + k)*c"),
            ("p", "k*c - d*p"),
            ("w", "d*p"),
        ];
        ModelSource {
            name: "m".into(),
            parameters: ["a", "b", "k", "d"].map(|name| Parameter::new(name, 1.5)).into(),
            states: equations.iter().map(|(name, _)| State::new(name)).collect(),
            equations: equations.iter().map(|(name, text)| Definition::new(name, text)).collect(),
            totals: totals.iter().map(|(name, sum, value)| Total::new(name, sum, *value)).collect(),
            ..ModelSource::default()
        }
    }

    fn rates(model: &Model, x: &[f64]) -> Vec<f64> {
        let (mut f, p) = (vec![0.0; x.len()], model.defaults());
        model.evaluate(
            Batch { lanes: 1, states: x, parameters: Parameters::Shared(&p), times: &[], signs: &[] },
            &mut f,
        );
        f
    }

    #[test]
    fn the_remaining_states_move_as_before() {
        let whole = Model::compile(source(&[])).unwrap();
        let x = [0.3, 0.5, 0.2, 0.4, 0.1];
        let f = rates(&whole, &x);
        let totals = [("E", "e + c", 0.7), ("M", "s + c + p + w", 1.0)];
        let model = Model::compile(source(&totals)).unwrap();
        let names: Vec<&str> = model.states.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, ["s", "e", "p"]);
        let own = rates(&model, &[x[0], x[1], x[3]]);
        for (a, b) in own.iter().zip([f[0], f[1], f[3]]) {
            assert!((a - b).abs() < 1e-14, "{own:?} {f:?}");
        }
        assert_eq!(model.totals[1].instead_of, "w");
    }

    #[test]
    fn a_sum_that_is_not_conserved_is_rejected() {
        let found = Model::compile(source(&[("E", "e + 2*c", 1.0)])).err().unwrap();
        assert!(found[0].message.contains("is not conserved") && found[0].hint.contains("e + c"), "{found:?}");
        let found = Model::compile(source(&[("E", "e*c", 1.0)])).err().unwrap();
        assert!(found[0].message.contains("not a linear combination of states"), "{found:?}");
        let found = Model::compile(source(&[("E", "e + c", 1.0), ("F", "2*e + 2*c", 1.0)])).err().unwrap();
        assert!(found[0].message.contains("do not determine"), "{found:?}");
    }
}
