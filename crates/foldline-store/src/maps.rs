//! Maps over parameters as arrays and as tables.
//!
//! **Idea.** All quantities of a map are arrays over its cells, some also over the motions or special points found. Tables,
//! exports and pictures have their names from here; they are those of `foldline.map` in Python.

use foldline::diagram::{CellAnswer, CellValue, CellValues, MapCell};
use foldline::explore::cells::{ParameterMap, assembled};
use foldline::explore::{MapPlan, Plan, Question};
use foldline::model::Model;

/// Type of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Texts.
    Text,
    /// Whole numbers.
    Count,
    /// Numbers.
    Number,
}

/// Quantity of a map.
#[derive(Clone, Debug)]
pub struct Array {
    /// Name.
    pub name: String,
    /// Type of its values.
    pub class: Class,
    /// Unit; empty if unknown.
    pub unit: String,
    /// Description.
    pub description: String,
    /// Values; `None` where it has none.
    pub values: Vec<Option<CellValue>>,
}

/// All quantities of a map.
#[derive(Clone, Debug)]
pub struct Arrays {
    /// Cells and refinement.
    pub map: ParameterMap,
    /// Parameters: their values in each cell.
    pub parameters: Vec<Array>,
    /// Quantities over the cells.
    pub cells: Vec<Array>,
    /// Name of the dimension of motions or points; empty if the question has none.
    pub item: &'static str,
    /// Labels of the motions or points.
    pub labels: Vec<String>,
    /// Texts about the motions or points, over the labels.
    pub about: Vec<Array>,
    /// Quantities over the cells and the labels, the labels varying fastest.
    pub items: Vec<Array>,
}

/// Name of the dimension of motions or points.
fn item_of(question: &Question) -> &'static str {
    match question {
        Question::Points => "point",
        Question::Motions(_) | Question::Shares(_) => "motion",
        Question::Settled(..) => "",
    }
}

/// The question in words.
pub fn words_of(question: &Question) -> String {
    match question {
        Question::Points => "points".into(),
        Question::Motions(_) => "motions".into(),
        Question::Shares(_) => "shares".into(),
        Question::Settled(readings, _) => readings.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", "),
    }
}

/// Names of the values in the order in which they appear, texts first.
fn names<'a>(rows: impl Iterator<Item = &'a CellValues>) -> Vec<String> {
    let mut seen: Vec<(String, bool)> = Vec::new();
    for (name, value) in rows.flatten() {
        let text = matches!(value, CellValue::Text(_));
        match seen.iter_mut().find(|(known, _)| known == name) {
            Some((_, known)) => *known |= text,
            None => seen.push((name.clone(), text)),
        }
    }
    seen.sort_by_key(|(_, text)| !text);
    seen.into_iter().map(|(name, _)| name).collect()
}

fn value_of<'a>(values: &'a CellValues, name: &str) -> Option<&'a CellValue> {
    values.iter().find(|(known, _)| known == name).map(|(_, value)| value)
}

fn array(model: &Model, name: &str, values: Vec<Option<CellValue>>) -> Array {
    let class = match values.iter().flatten().next() {
        Some(CellValue::Text(_)) => Class::Text,
        Some(CellValue::Count(_)) if values.iter().all(Option::is_some) => Class::Count,
        _ => Class::Number,
    };
    let [unit, description] = described(model, name);
    Array { name: name.to_string(), class, unit, description, values }
}

/// Unit and description of a quantity.
fn described(model: &Model, name: &str) -> [String; 2] {
    if let Some(own) = model.parameters.iter().find(|own| own.name == name) {
        return [own.unit.clone(), own.description.clone()];
    }
    let said = match name {
        "points" => "special points found",
        "motions" => "motions found",
        "settled_motion" => "motion reached",
        "value" => "value of the parameter of the branch at the special point",
        "error" => "bound on the error of value",
        "period" => return [model.time.clone(), "period".into()],
        "unstable_before" => "number of unstable eigenvalues or multipliers before the point",
        "unstable_after" => "number of unstable eigenvalues or multipliers after the point",
        "branch" => "name of the branch",
        "kind" => "kind of the special point",
        "free" => "parameter of the branch",
        "number" => "number of motions of this kind",
        "share" => "basin fraction",
        "share_low" => "lower end of the 95 % confidence interval of the basin fraction",
        "share_high" => "upper end of the 95 % confidence interval of the basin fraction",
        "unsettled" => "initial states that did not settle",
        "escaped" => "initial states that escaped",
        "computed" => "1 where a cell was computed",
        "failure" => "reason why a cell has no values",
        "remark" => "what fell short in a cell",
        _ => "",
    };
    if !said.is_empty() {
        return [String::new(), said.into()];
    }
    for (ending, side) in [("_max", "largest"), ("_min", "smallest")] {
        let Some(base) = name.strip_suffix(ending) else { continue };
        let states = model.states.iter().map(|own| (&own.name, &own.unit));
        let outputs = model.outputs.iter().map(|own| (&own.name, &own.unit));
        if let Some((_, unit)) = states.chain(outputs).find(|(known, _)| *known == base) {
            return [unit.clone(), format!("{side} value of {base}")];
        }
    }
    [String::new(), String::new()]
}

/// Returns all quantities of a map with the cells that are known.
pub fn arrays(plan: &MapPlan, known: &[MapCell], model: &Model) -> Arrays {
    let map = assembled(plan, known);
    let answers: Vec<Option<&CellAnswer>> =
        map.cells.iter().map(|cell| cell.answer.as_ref().and_then(|answer| answer.as_ref().ok())).collect();
    let text = |text: &str| Some(CellValue::Text(text.to_string()));
    let parameter = |(k, name): (usize, &String)| {
        let values = map.cells.iter().map(|cell| cell.at.get(k).map(|value| CellValue::Number(*value)));
        array(model, name, values.collect())
    };
    let parameters = plan.names.iter().enumerate().map(parameter).collect();
    let mut cells: Vec<Array> = Vec::new();
    for name in names(answers.iter().flatten().map(|answer| &answer.values)) {
        let category = answers.iter().flatten().any(|answer| answer.category().is_some_and(|(own, _)| own == name));
        let value = |(answer, cell): (&Option<&CellAnswer>, &foldline::explore::cells::ShownCell)| match answer {
            Some(answer) => value_of(&answer.values, &name).cloned(),
            None if category && plan.refine > 0 => cell.category.as_deref().and_then(text),
            None => None,
        };
        let values = answers.iter().zip(&map.cells).map(value).collect();
        cells.push(array(model, &name, values));
    }
    if plan.refine > 0 {
        let computed = map.cells.iter().map(|cell| Some(CellValue::Count(cell.answer.is_some().into())));
        cells.push(array(model, "computed", computed.collect()));
    }
    let failure = |cell: &foldline::explore::cells::ShownCell| match &cell.answer {
        Some(Err(reason)) => text(reason),
        Some(Ok(_)) => None,
        None if plan.refine > 0 && cell.category.is_some() => None,
        None => text("not computed"),
    };
    let mut said = array(model, "failure", map.cells.iter().map(failure).collect());
    let remark = answers
        .iter()
        .map(|answer| answer.and_then(|own| if own.remark.is_empty() { None } else { text(&own.remark) }));
    let mut remarks = array(model, "remark", remark.collect());
    (said.class, remarks.class) = (Class::Text, Class::Text);
    cells.extend([said, remarks]);
    let mut labels: Vec<String> = Vec::new();
    for (label, _) in answers.iter().flatten().flat_map(|answer| &answer.items) {
        if !labels.contains(label) {
            labels.push(label.clone());
        }
    }
    let found = |answer: &Option<&CellAnswer>, label: &str, name: &str| {
        let own = answer.as_ref()?;
        match own.items.iter().find(|(known, _)| known == label) {
            Some((_, values)) => value_of(values, name).cloned(),
            None => value_of(&own.absent, name).cloned(),
        }
    };
    let (mut about, mut items) = (Vec::new(), Vec::new());
    for name in names(answers.iter().flatten().flat_map(|answer| answer.items.iter().map(|(_, values)| values))) {
        let mut each = Vec::with_capacity(answers.len() * labels.len());
        for answer in &answers {
            each.extend(labels.iter().map(|label| found(answer, label, &name)));
        }
        let made = array(model, &name, each);
        if made.class == Class::Text {
            let first = |k: usize| made.values.iter().skip(k).step_by(labels.len()).flatten().next().cloned();
            about.push(Array { values: (0..labels.len()).map(first).collect(), ..made.clone() });
        } else {
            items.push(made);
        }
    }
    Arrays { parameters, cells, item: item_of(&plan.question), labels, about, items, map }
}

/// A table with named columns.
#[derive(Clone, Debug)]
pub struct Listed {
    /// Columns, whose `values` are empty.
    pub columns: Vec<Array>,
    /// Rows.
    pub rows: Vec<Vec<Option<CellValue>>>,
}

impl Arrays {
    /// Returns a table with a row for each motion or point of a cell, and for each cell without any.
    pub fn listed(&self) -> Listed {
        let bare = |own: &Array| Array { values: Vec::new(), ..own.clone() };
        let label = Array {
            name: self.item.to_string(),
            class: Class::Text,
            unit: String::new(),
            description: "motion or special point".into(),
            values: Vec::new(),
        };
        let (first, last): (Vec<&Array>, Vec<&Array>) =
            self.cells.iter().partition(|own| !matches!(own.name.as_str(), "computed" | "failure" | "remark"));
        let mut columns: Vec<Array> = self.parameters.iter().chain(first.iter().copied()).map(bare).collect();
        if !self.labels.is_empty() {
            columns.push(label);
            columns.extend(self.items.iter().map(bare));
        }
        columns.extend(last.iter().map(|own| bare(own)));
        let width = self.labels.len();
        let mut rows = Vec::new();
        for (k, cell) in self.map.cells.iter().enumerate() {
            let at = |own: &Array| own.values[k].clone();
            let begin: Vec<_> = self.parameters.iter().map(at).chain(first.iter().map(|own| at(own))).collect();
            let end: Vec<_> = last.iter().map(|own| at(own)).collect();
            // A share of 0 has an upper bound; other motions and points that are absent have no row.
            let answer = cell.answer.as_ref().and_then(|answer| answer.as_ref().ok());
            let bounded = answer.is_some_and(|own| value_of(&own.absent, "share").is_some());
            let here = |label: &String| answer.is_some_and(|own| own.items.iter().any(|(known, _)| known == label));
            let shown: Vec<usize> = (0..width).filter(|j| here(&self.labels[*j]) || bounded).collect();
            for j in &shown {
                let own = self.items.iter().map(|own| own.values[k * width + j].clone());
                let label = Some(CellValue::Text(self.labels[*j].clone()));
                rows.push(begin.iter().cloned().chain([label]).chain(own).chain(end.iter().cloned()).collect());
            }
            if shown.is_empty() {
                let none = if width == 0 { 0 } else { 1 + self.items.len() };
                rows.push(begin.into_iter().chain(std::iter::repeat_n(None, none)).chain(end).collect());
            }
        }
        Listed { columns, rows }
    }
}

/// Messages on maps that are incomplete or have cells without answers, or with answers that fell short.
pub fn short(plan: &Plan, known: &[MapCell]) -> Vec<String> {
    /// Number of different reasons that are listed.
    const TOLD: usize = 3;
    let counted = |all: &[(String, usize)]| {
        let said: Vec<String> = all.iter().take(TOLD).map(|(why, count)| format!("{count} × {why}")).collect();
        let more = match all.len().saturating_sub(TOLD) {
            0 => String::new(),
            more => format!("; and {more} other reasons"),
        };
        format!("{}{more}", said.join("; "))
    };
    let mut lines = Vec::new();
    for map in &plan.maps {
        let found = assembled(map, known);
        let [failures, remarks] = found.complaints();
        let total = found.computed();
        let sum = |all: &[(String, usize)]| all.iter().map(|(_, count)| count).sum::<usize>();
        if !found.complete {
            lines.push(format!("{}: it is incomplete, with {total} cells so far", map.name));
        }
        if !failures.is_empty() {
            let said = counted(&failures);
            lines.push(format!("{}: {} of {total} cells have no values: {said}", map.name, sum(&failures)));
        }
        if !remarks.is_empty() {
            let said = counted(&remarks);
            lines.push(format!("{}: {} of {total} cells fell short: {said}", map.name, sum(&remarks)));
        }
    }
    lines
}
