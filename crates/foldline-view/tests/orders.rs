//! Requests that change something: those that the page sends, and those that must be refused.

use crate::common::{MODEL, STUDY, Served, run_in, split};
use foldline_store::run_file::{Part, load_part};
use foldline_view::{Desk, Files, Watch};
use serde_json::{Value, json};
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A finished run with its study, and a server that may go on with it. Runs are counted, not started.
struct Place {
    folder: tempfile::TempDir,
    served: Served,
    cookie: String,
    started: Arc<AtomicUsize>,
}

impl Place {
    fn new() -> Place {
        let folder = tempfile::tempdir().expect("a folder can be made");
        let run = folder.path().join("run");
        run_in(&run);
        std::fs::write(folder.path().join("pitchfork.toml"), MODEL).expect("the folder can be written to");
        let study = folder.path().join("study.toml");
        std::fs::write(&study, STUDY).expect("the folder can be written to");
        let started = Arc::new(AtomicUsize::new(0));
        let count = Arc::clone(&started);
        let program = move |_: &std::path::Path, _: &std::path::Path, resume: bool| {
            assert!(resume);
            count.fetch_add(1, Ordering::Relaxed);
            Err(io::Error::other("not in this test"))
        };
        let watch = Watch::open(&run).expect("there is a run");
        let desk = Desk::new(
            Files { study, model: folder.path().join("pitchfork.toml"), folder: run },
            Box::new(program),
            watch.clone(),
            None,
        );
        let served = Served::of(watch, Some(desk));
        let cookie = served.enter();
        Place { folder, served, cookie, started }
    }

    fn study(&self) -> PathBuf {
        self.folder.path().join("study.toml")
    }

    fn origin(&self) -> String {
        format!("Origin: http://127.0.0.1:{}", self.served.port)
    }

    fn raw(&self, what: &str, body: &[u8]) -> (u16, Value) {
        let (host, origin, cookie) = (self.served.host(), self.origin(), &self.cookie);
        let head = format!(
            "POST /api/{what} HTTP/1.1\r\n{host}\r\n{origin}\r\n{cookie}\r\nContent-Type: application/json\r\n\
             Content-Length: {}\r\nConnection: close\r\n\r\n",
            body.len()
        );
        let (status, _, answer) = split(&self.served.raw(&[head.as_bytes(), body].concat(), false));
        (status, serde_json::from_slice(&answer).unwrap_or(Value::Null))
    }

    fn post(&self, what: &str, body: &Value) -> (u16, Value) {
        self.raw(what, body.to_string().as_bytes())
    }

    fn unchanged(&self) {
        assert_eq!(std::fs::read_to_string(self.study()).expect("the study is there"), STUDY);
        assert_eq!(self.started.load(Ordering::Relaxed), 0);
    }
}

#[test]
fn orders_of_other_pages_are_refused() {
    let place = Place::new();
    let (host, origin, cookie) = (place.served.host(), place.origin(), place.cookie.clone());
    let other = format!("Origin: http://127.0.0.1:{}", place.served.port.wrapping_add(1));
    let (json, length) = ("Content-Type: application/json", "Content-Length: 2");
    let refused: [(u16, Vec<&str>); 13] = [
        (403, vec![&host, &cookie, json, length]),
        (403, vec![&host, &cookie, json, length, "Origin: http://evil.example"]),
        (403, vec![&host, &cookie, json, length, "Origin: null"]),
        (403, vec![&host, &cookie, json, length, &other]),
        (403, vec![&host, &cookie, json, length, &origin, &origin]),
        (403, vec![&host, &cookie, json, length, &origin, "Sec-Fetch-Site: same-site"]),
        (403, vec![&host, json, length, &origin]),
        (421, vec!["Host: evil.example", &cookie, json, length, &origin]),
        (415, vec![&host, &cookie, length, &origin]),
        (415, vec![&host, &cookie, length, &origin, "Content-Type: text/plain"]),
        (415, vec![&host, &cookie, length, &origin, "Content-Type: application/json; charset=utf-8"]),
        (411, vec![&host, &cookie, json, &origin]),
        (413, vec![&host, &cookie, json, &origin, "Content-Length: 1048577"]),
    ];
    for path in ["check", "act", "study", "new", "example", "stop", "resume"] {
        for (expected, lines) in &refused {
            let lines: String = lines.iter().map(|line| format!("{line}\r\n")).collect();
            let request = format!("POST /api/{path} HTTP/1.1\r\n{lines}Connection: close\r\n\r\n{{}}");
            let (status, head, _) = split(&place.served.raw(request.as_bytes(), false));
            assert_eq!(status, *expected, "{path} {lines} {head}");
        }
        assert_eq!(place.served.ask(&format!("GET /api/{path} HTTP/1.1"), &[&host, &cookie]).0, 404);
        for method in ["PUT", "DELETE", "PATCH", "OPTIONS"] {
            assert_eq!(place.served.ask(&format!("{method} /api/{path} HTTP/1.1"), &[&host, &cookie, &origin]).0, 405);
        }
    }
    for path in ["/", "/api/run", "/api/points", "/app.js", "/api/study/", "//api/study"] {
        assert_eq!(
            place.served.ask(&format!("POST {path} HTTP/1.1"), &[&host, &cookie, &origin, json]).0,
            405,
            "{path}"
        );
    }
    let token = format!("POST /api/stop?token={} HTTP/1.1", place.served.token);
    assert_eq!(place.served.ask(&token, &[&host, &origin, json, "Content-Length: 0"]).0, 403);
    place.unchanged();
}

#[test]
fn bodies_that_mean_nothing_are_refused() {
    let place = Place::new();
    let deep = "[".repeat(100_000);
    let bodies: [&[u8]; 8] =
        [b"", b"{", b"null", b"[]", b"\xff\xfe", b"{\"study\":1}", deep.as_bytes(), b"{\"branch\":1e400}"];
    for what in ["check", "act", "study"] {
        for body in bodies {
            let (status, _) = place.raw(what, body);
            assert_eq!(status, 400, "{what} {:?}", String::from_utf8_lossy(&body[..body.len().min(40)]));
        }
    }
    let odd =
        [json!("1"), json!(1.5), json!(-1), json!(u64::MAX), json!(null), json!({}), json!("1; DROP TABLE points")];
    for value in &odd {
        for key in ["branch", "position", "special", "action", "free"] {
            let mut body = json!({ "branch": 1, "position": 0, "action": "continue", "free": "mu" });
            body[key] = value.clone();
            let (status, _) = place.post("act", &body);
            assert!(matches!(status, 400 | 409 | 200), "{body}: {status}");
        }
    }
    for branch in [i64::MIN, -1, 0, 99, i64::MAX] {
        let (status, said) = place.post("act", &json!({ "branch": branch, "position": 0, "action": "simulate" }));
        assert_eq!((status, said["error"].as_str()), (409, Some("there is no such point")));
    }
    place.unchanged();
}

#[test]
fn a_text_is_checked_at_line_and_column() {
    let place = Place::new();
    let (status, said) = place.post("check", &json!({ "study": STUDY.replace("\"mu\"", "\"nu\"") }));
    assert_eq!(status, 200);
    let first = &said["mistakes"][0];
    assert_eq!((first["line"].as_u64(), first["column"].as_u64()), (Some(8), Some(8)), "{said}");
    assert!(first["message"].as_str().is_some_and(|text| text.contains("nu")), "{said}");
    let (_, said) = place.post("check", &json!({ "study": STUDY.replace("[0.5, 2]", "[0.5, 3]") }));
    assert_eq!(said["unfit"].as_str(), Some("the branch \"main\" is different"), "{said}");
    let (_, said) = place.post("check", &json!({ "study": STUDY }));
    assert_eq!(said, json!({ "mistakes": [], "unfit": null }));
    let (_, said) = place.post("check", &json!({ "model": MODEL.replace("mu*x", "mu*y") }));
    assert_eq!(said["mistakes"][0]["line"].as_u64(), Some(5), "{said}");
    place.unchanged();
}

#[test]
fn a_longer_study_is_written_and_the_run_started_and_a_shorter_one_removes_results() {
    let place = Place::new();
    let (status, said) = place.post("act", &json!({ "branch": 1, "position": 2, "action": "survey" }));
    assert_eq!(status, 200, "{said}");
    place.unchanged();
    let text = said["text"].as_str().expect("there is a text").to_string();
    assert!(text.starts_with(STUDY));
    for (before, after) in [("", text.as_str()), (&text, &text)] {
        assert_eq!(place.post("study", &json!({ "before": before, "text": after })).0, 409);
    }
    for wrong in [text.replace("[0.5, 2]", "[0.5, 3]"), text.replace("free = \"mu\"", "free = \"nu\""), String::new()] {
        let (status, said) = place.post("study", &json!({ "before": STUDY, "text": wrong }));
        assert_eq!(status, 409, "{said}");
    }
    place.unchanged();
    let (status, said) = place.post("study", &json!({ "before": STUDY, "text": text }));
    assert_eq!((status, said["error"].as_str()), (409, Some("the run cannot be started: not in this test")));
    assert_eq!(std::fs::read_to_string(place.study()).expect("the study is there"), text);
    assert_eq!(place.started.load(Ordering::Relaxed), 1);
    assert_eq!(std::fs::read_dir(place.folder.path()).expect("the folder is there").count(), 3);
}

#[test]
fn a_study_changed_elsewhere_is_not_overwritten() {
    let place = Place::new();
    let edited = format!("{STUDY}# by hand\n");
    std::fs::write(place.study(), &edited).expect("the folder can be written to");
    let (_, said) = place.post("act", &json!({ "branch": 1, "position": 2, "action": "survey" }));
    let (status, said) = place.post("study", &json!({ "before": STUDY, "text": said["text"] }));
    assert_eq!(status, 409, "{said}");
    assert!(said["error"].as_str().is_some_and(|why| why.contains("changed elsewhere")), "{said}");
    assert_eq!(std::fs::read_to_string(place.study()).expect("the study is there"), edited);
    let run = load_part(&place.folder.path().join("run"), Part::Special).expect("the run can be read");
    assert_eq!(run.study_text, STUDY);
}
