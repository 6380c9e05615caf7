//! Requests of the page that change something or check a text: bodies in JSON, and their answers.
//!
//! | path | body | answer |
//! |---|---|---|
//! | `/api/check` | `study` or `model`, a text | its mistakes, with line and column |
//! | `/api/act` | `branch`, `position` or `special`, `action`, perhaps `free` | the longer study, and which of its lines are new |
//! | `/api/verify` | `branch`, `position` or `special` | the differences to an independent computation, with the errors stated |
//! | `/api/quantity` | `name` | the index of this quantity, which is added to those of the run |
//! | `/api/study` | `before`, `text` | nothing; the run goes on with the text |
//! | `/api/new` | `model`, `study`, two texts | nothing; they are computed from the beginning, in a new folder |
//! | `/api/example` | `index` | nothing; the page shows the example, of which nothing is computed |
//! | `/api/stop`, `/api/resume` | nothing | nothing |

use crate::desk::{Desk, Refused};
use crate::orbit::Place;
use crate::watch::Watch;
use foldline::verify::Check;
use foldline_store::diagnostic::Diagnostic;
use foldline_store::model_file::parse_model;
use foldline_store::study_file::{self, Action, Refusal, parse_study};
use hyper::StatusCode;
use serde_json::{Value, json};

/// Paths of these requests.
const PATHS: [&str; 9] = [
    "/api/check",
    "/api/act",
    "/api/verify",
    "/api/quantity",
    "/api/study",
    "/api/new",
    "/api/example",
    "/api/stop",
    "/api/resume",
];
/// Largest body, in bytes.
pub(crate) const LARGEST: u64 = 1 << 20;

/// True if a path takes requests with a body.
pub(crate) fn takes(path: &str) -> bool {
    PATHS.contains(&path)
}

/// Carries out a request. The status of a refusal is that of the answer; its reason is the text.
pub(crate) fn carried_out(path: &str, body: &[u8], watch: &Watch, desk: Option<&Desk>) -> (StatusCode, Value) {
    let Ok(body) = serde_json::from_slice::<Value>(body) else {
        return (StatusCode::BAD_REQUEST, json!({ "error": "the body is not JSON" }));
    };
    let text = |key: &str| body.get(key).and_then(Value::as_str);
    let done = match (path, desk) {
        ("/api/check", _) => match (text("study"), text("model")) {
            (Some(study), model) => Ok(check_study(watch, study, model)),
            (None, Some(model)) => Ok(check_model(watch, model)),
            _ => return bad("`study` or `model` is missing"),
        },
        ("/api/act", _) => match action(&body) {
            Some((branch, place, action)) => act(watch, branch, place, &action),
            None => return bad("the action is not known"),
        },
        ("/api/verify", _) => match place(&body) {
            Some((branch, place)) => verified(watch, branch, place),
            None => return bad("the point is missing"),
        },
        ("/api/quantity", _) => match text("name") {
            Some(name) => watch.add(name).map(|index| json!({ "index": index })).map_err(Refused::Because),
            None => return bad("`name` is missing"),
        },
        (_, None) => Err(Refused::Because(watch.why_not().unwrap_or_default())),
        ("/api/study", Some(desk)) => match (text("before"), text("text")) {
            (Some(before), Some(text)) => desk.study(before, text).map(|()| json!({})),
            _ => return bad("`before` or `text` is missing"),
        },
        ("/api/new", Some(desk)) => match (text("model"), text("study")) {
            (Some(model), Some(study)) => desk.anew(model, study).map(|()| json!({})),
            _ => return bad("`model` or `study` is missing"),
        },
        ("/api/example", Some(desk)) => match body.get("index").and_then(Value::as_u64) {
            Some(index) => desk.example(usize::try_from(index).unwrap_or(usize::MAX)).map(|()| json!({})),
            None => return bad("`index` is missing"),
        },
        ("/api/stop", Some(desk)) => desk.stop().map(|()| json!({})),
        ("/api/resume", Some(desk)) => desk.resume().map(|()| json!({})),
        _ => return (StatusCode::NOT_FOUND, json!({})),
    };
    match done {
        Ok(answer) => (StatusCode::OK, answer),
        Err(Refused::Because(why)) => (StatusCode::CONFLICT, json!({ "error": why })),
        Err(Refused::Mistakes(found)) => {
            let why = "the study has mistakes";
            (StatusCode::CONFLICT, json!({ "error": why, "mistakes": mistakes(&found) }))
        }
    }
}

fn bad(why: &str) -> (StatusCode, Value) {
    (StatusCode::BAD_REQUEST, json!({ "error": why }))
}

fn mistakes(found: &[Diagnostic]) -> Vec<Value> {
    let one = |own: &Diagnostic| json!({ "line": own.line, "column": own.column, "length": own.length, "message": own.message, "hint": own.hint });
    found.iter().map(one).collect()
}

/// Mistakes of a study of a model, by default that of the run, and the reason why the run cannot go on with it.
fn check_study(watch: &Watch, text: &str, model: Option<&str>) -> Value {
    let own = watch.study();
    let model = model.unwrap_or(&own.model_text);
    let found = parse_study(text, &own.file, model, &own.model_file);
    let in_study = |found: Vec<Diagnostic>| found.into_iter().filter(|one| one.file == own.file).collect::<Vec<_>>();
    let fits = found.as_ref().ok().map(|new| {
        let longer = study_file::added(&own, new);
        longer.map_or_else(|why| study_file::added(new, &own).err().map(|_| why), |_| None)
    });
    let fits = if model == own.model_text { fits.flatten() } else { Some("the model is different".into()) };
    json!({ "mistakes": mistakes(&in_study(found.err().unwrap_or_default())), "unfit": fits })
}

fn check_model(watch: &Watch, text: &str) -> Value {
    let found = parse_model(text, &watch.study().model_file);
    json!({ "mistakes": mistakes(&found.err().unwrap_or_default()) })
}

/// Branch and place of a request.
fn place(body: &Value) -> Option<(i64, Place)> {
    let number = |key: &str| body.get(key).and_then(Value::as_i64);
    let place = match (number("position"), number("special").filter(|index| *index >= 0)) {
        (_, Some(index)) => Place::Special(index),
        (Some(position), None) => Place::Position(position),
        _ => return None,
    };
    Some((number("branch")?, place))
}

/// Branch, place and action of a request.
fn action(body: &Value) -> Option<(i64, Place, Action)> {
    let (branch, place) = place(body)?;
    let free = || body.get("free").and_then(Value::as_str).map(str::to_string);
    let action = match body.get("action")?.as_str()? {
        "continue" => Action::Continue { free: free()? },
        "switch" => Action::Switch,
        "follow" => Action::Follow { free: free()? },
        "simulate" => Action::Simulate,
        "up" => Action::Sweep { up: true },
        "down" => Action::Sweep { up: false },
        "survey" => Action::Survey,
        _ => return None,
    };
    Some((branch, place, action))
}

/// Comparisons of a point with an independent computation.
fn verified(watch: &Watch, branch: i64, place: Place) -> Result<Value, Refused> {
    let found = watch.verified(branch, place).map_err(|error| error.to_string())?;
    let found = found.ok_or_else(|| "there is no such point".to_string())?;
    let check = |own: &Check| json!({ "quantity": own.quantity.name(), "stated": own.stated, "found": own.found, "ratio": own.ratio() });
    let checks: Vec<Value> = found.checks.iter().map(check).collect();
    let undecided: Vec<&str> = found.undecided.iter().map(|own| own.why).collect();
    Ok(json!({ "checks": checks, "wrong": found.wrong().count(), "undecided": undecided, "removed": found.removed }))
}

fn act(watch: &Watch, branch: i64, place: Place, action: &Action) -> Result<Value, Refused> {
    let found = watch.place(branch, place).map_err(|error| error.to_string())?;
    let (name, point, special) = found.ok_or_else(|| "there is no such point".to_string())?;
    let place = study_file::Place { branch: &name, point: &point, special };
    match study_file::append(&watch.study(), &place, action) {
        Ok(own) => Ok(json!({ "text": own.text, "lines": own.lines, "name": own.name })),
        Err(Refusal::Because(why)) => Err(Refused::Because(why)),
        Err(Refusal::Mistakes(found)) => Err(Refused::Mistakes(found)),
    }
}
