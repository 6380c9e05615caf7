//! Answers by path.
//!
//! | path | answer |
//! |---|---|
//! | `/`, `/app.js`, `/app.css`, `/icon.svg` | the page |
//! | `/api/run` | model, study and quantities (JSON) |
//! | `/api/state` | branches, special points, ends, notes (JSON) |
//! | `/api/points?epoch=E&since=N&columns=K,K,...` | points from cursor N on ([`frame`](crate::frame)) |
//! | `/api/special?columns=K,K,...` | values at all special points (frame) |
//! | `/api/solution?branch=B&position=P` or `&special=K` | one solution (frame) |
//! | `/api/export?columns=K,K,...` | the run as one page with these harmonics (HTML, to be saved) |
//! | `/api/events` | `grew` whenever something has changed (server-sent events) |
//! | POST | see [`orders`](crate::orders) |

use crate::body::{Answer, First, first};
use crate::desk::Desk;
use crate::gate::{Entry, Gate};
use crate::html::{Shown, html};
use crate::orbit::Place;
use crate::orders;
use crate::page;
use crate::query::Query;
use crate::server::Notices;
use crate::watch::{Notice, Watch};
use foldline_store::run_file::RunFileError;
use http_body_util::{BodyExt, Full, Limited};
use hyper::body::{Bytes, Incoming};
use hyper::header::{CONTENT_TYPE, HeaderValue, LOCATION, SET_COOKIE};
use hyper::{Method, Request, Response, StatusCode};
use serde_json::{Value, json};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tokio::sync::{mpsc, watch};

/// Largest number of columns in one answer.
const COLUMNS: usize = 16;
/// Largest number of open event streams: one for each tab.
const STREAMS: usize = 4;
/// Longest time for an answer.
const LONGEST: Duration = Duration::from_secs(10);
/// Interval between two signs of life on an event stream.
const ALIVE: Duration = Duration::from_secs(15);
/// Shortest interval between two looks at the file of a growing run, and at one that is not being written.
const LOOKS: [Duration; 2] = [Duration::from_millis(100), Duration::from_millis(500)];

/// Security headers of every answer. No `Access-Control` header exists.
const HEADERS: [(&str, &str); 9] = [
    (
        "content-security-policy",
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'; require-trusted-types-for 'script'",
    ),
    ("x-content-type-options", "nosniff"),
    ("referrer-policy", "no-referrer"),
    ("cache-control", "no-store"),
    ("cross-origin-opener-policy", "same-origin"),
    ("cross-origin-resource-policy", "same-origin"),
    ("cross-origin-embedder-policy", "require-corp"),
    ("x-frame-options", "DENY"),
    ("permissions-policy", "camera=(), microphone=(), geolocation=()"),
];

const JSON: &str = "application/json";
const BYTES: &str = "application/octet-stream";

/// Server for one run.
pub(crate) struct Routes {
    pub(crate) gate: Gate,
    watch: Watch,
    desk: Option<Desk>,
    notices: Notices,
    streams: Arc<AtomicUsize>,
}

type Whole = Result<(&'static str, Vec<u8>), StatusCode>;

impl Routes {
    pub(crate) fn new(gate: Gate, watch: Watch, desk: Option<Desk>) -> Routes {
        let notices = watch::channel(watch.notice()).0;
        Routes { gate, watch, desk, notices, streams: Arc::default() }
    }

    /// Answers a request. Nothing of it is examined before it has passed the gate.
    pub(crate) async fn answer(&self, request: Request<Incoming>) -> Response<Answer> {
        let (parts, body) = request.into_parts();
        let answer = match self.gate.check(&parts) {
            Err(status) => refusal(status),
            Ok(Entry::New) => self.entered(),
            Ok(Entry::Known) if parts.method == Method::POST => self.ordered(parts.uri.path(), body).await,
            Ok(Entry::Known) => {
                let (path, query) = (parts.uri.path(), parts.uri.query().unwrap_or(""));
                match tokio::time::timeout(LONGEST, self.routed(path, query)).await {
                    Ok(Ok(answer)) => answer,
                    Ok(Err(status)) => refusal(status),
                    Err(_) => refusal(StatusCode::SERVICE_UNAVAILABLE),
                }
            }
        };
        protected(answer)
    }

    /// Sets the cookie and removes the token from the address.
    fn entered(&self) -> Response<Answer> {
        let mut answer = whole("text/plain; charset=utf-8", Vec::new());
        *answer.status_mut() = StatusCode::SEE_OTHER;
        answer.headers_mut().insert(LOCATION, HeaderValue::from_static("/"));
        if let Ok(cookie) = HeaderValue::from_str(&self.gate.cookie()) {
            answer.headers_mut().insert(SET_COOKIE, cookie);
        }
        answer
    }

    /// Reads the body of a request and carries it out.
    async fn ordered(&self, path: &str, body: Incoming) -> Response<Answer> {
        let limited = Limited::new(body, orders::LARGEST as usize);
        let bytes = match tokio::time::timeout(LONGEST, limited.collect()).await {
            Ok(Ok(whole)) => whole.to_bytes(),
            Ok(Err(_)) => return refusal(StatusCode::BAD_REQUEST),
            Err(_) => return refusal(StatusCode::REQUEST_TIMEOUT),
        };
        let (path, watch, desk) = (path.to_string(), self.watch.clone(), self.desk.clone());
        // A run that is to stop before it goes on may take its time; what has begun is carried out in any case.
        let done = tokio::task::spawn_blocking(move || orders::carried_out(&path, &bytes, &watch, desk.as_ref())).await;
        let Ok((status, text)) = done else { return refusal(StatusCode::INTERNAL_SERVER_ERROR) };
        let mut answer = whole(JSON, text.to_string().into_bytes());
        *answer.status_mut() = status;
        answer
    }

    async fn routed(&self, path: &str, query: &str) -> Result<Response<Answer>, StatusCode> {
        if path == "/api/events" {
            return self.events().ok_or(StatusCode::SERVICE_UNAVAILABLE);
        }
        if let Some((kind, text)) = page::asset(path) {
            return Ok(whole(kind, text.as_bytes().to_vec()));
        }
        let asked = self.asked(path, &Query::new(query))?;
        let watch = self.watch.clone();
        if matches!(asked, Asked::Run) {
            let mut found = watch.description();
            let examples = self.desk.as_ref().map_or(&[][..], Desk::examples);
            let examples = examples.iter().map(|own| json!({ "name": own.name, "about": own.about }));
            found["examples"] = examples.collect::<Vec<Value>>().into();
            return Ok(whole(JSON, found.to_string().into_bytes()));
        }
        // Reading may wait for the disk; other requests do not.
        let found = tokio::task::spawn_blocking(move || asked.read(&watch)).await;
        let (kind, bytes) = found.unwrap_or(Err(StatusCode::INTERNAL_SERVER_ERROR))?;
        Ok(whole(kind, bytes))
    }

    fn asked(&self, path: &str, query: &Query) -> Result<Asked, StatusCode> {
        let bad = StatusCode::BAD_REQUEST;
        let natural = |key: &str| query.integer(key).and_then(|value| u64::try_from(value).ok()).ok_or(bad);
        match path {
            "/api/run" => Ok(Asked::Run),
            "/api/state" => Ok(Asked::State),
            "/api/export" => {
                let axes = self.watch.axes();
                let columns = query.indices("columns", axes.len(), axes.len()).ok_or(bad)?;
                Ok(Asked::Export(columns.iter().filter_map(|k| axes.get(*k)).map(|own| own.name.clone()).collect()))
            }
            "/api/special" => {
                let columns = query.indices("columns", self.watch.axes().len(), COLUMNS).ok_or(bad)?;
                Ok(Asked::Special { columns })
            }
            "/api/points" => {
                let columns = query.indices("columns", self.watch.axes().len(), COLUMNS).ok_or(bad)?;
                Ok(Asked::Points { epoch: natural("epoch")?, since: natural("since")?, columns })
            }
            "/api/solution" => {
                let branch = query.integer("branch").ok_or(bad)?;
                let place = match (query.text("position"), query.text("special")) {
                    (Some(_), None) => query.integer("position").map(Place::Position),
                    (None, Some(_)) => natural("special").ok().map(|index| Place::Special(index as i64)),
                    _ => None,
                };
                Ok(Asked::Solution { branch, place: place.ok_or(bad)? })
            }
            _ => Err(StatusCode::NOT_FOUND),
        }
    }

    /// Begins an event stream; `None` if there are too many.
    fn events(&self) -> Option<Response<Answer>> {
        let stream = Stream::new(&self.streams)?;
        let (sender, receiver) = mpsc::channel(4);
        let notices = self.notices.subscribe();
        tokio::spawn(tell(sender, notices, stream));
        let mut answer = Response::new(Answer::Events(receiver));
        answer.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static("text/event-stream"));
        Some(answer)
    }

    /// Starts the thread that looks at the file.
    pub(crate) fn start_watching(&self) -> io::Result<Watching> {
        let over = Arc::new(AtomicBool::new(false));
        let (watch, notices, ended) = (self.watch.clone(), self.notices.clone(), Arc::clone(&over));
        let work = move || {
            while !ended.load(Ordering::Relaxed) {
                let start = Instant::now();
                // A file that cannot be read at the moment is read later; the page keeps what it has.
                let _ = watch.look();
                // The desk looks too, and may have seen the change first.
                if *notices.borrow() != watch.notice() {
                    notices.send_replace(watch.notice());
                }
                let shortest = if watch.notice().running { LOOKS[0] } else { LOOKS[1] };
                // At most a fifth of the time is spent on a large file.
                std::thread::park_timeout(shortest.max(4 * start.elapsed()));
            }
        };
        let thread = std::thread::Builder::new().name("watch".into()).spawn(work)?;
        Ok(Watching { over, thread })
    }
}

/// Thread that looks at the file.
pub(crate) struct Watching {
    over: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Watching {
    pub(crate) fn end(self) {
        self.over.store(true, Ordering::Relaxed);
        self.thread.thread().unpark();
        let _ = self.thread.join();
    }
}

/// Valid request for data.
enum Asked {
    Run,
    State,
    /// Names of harmonics.
    Export(Vec<String>),
    Special {
        columns: Vec<usize>,
    },
    Points {
        epoch: u64,
        since: u64,
        columns: Vec<usize>,
    },
    Solution {
        branch: i64,
        place: Place,
    },
}

impl Asked {
    fn read(self, watch: &Watch) -> Whole {
        let failed = |_: RunFileError| StatusCode::SERVICE_UNAVAILABLE;
        match self {
            Asked::Run => Ok((JSON, watch.description().to_string().into_bytes())),
            Asked::State => Ok((JSON, watch.state().into_bytes())),
            // Not as a document: it would have the origin of the server.
            Asked::Export(axes) => match html(&watch.folder(), &Shown { axes, ..Shown::default() }) {
                Ok((page, _)) => Ok((BYTES, page.into_bytes())),
                Err(_) => Err(StatusCode::NOT_FOUND),
            },
            Asked::Special { columns } => Ok((BYTES, watch.special(&columns).map_err(failed)?)),
            Asked::Points { epoch, since, columns } => {
                Ok((BYTES, watch.points(epoch, since, &columns).map_err(failed)?))
            }
            Asked::Solution { branch, place } => {
                let found = watch.solution(branch, place).map_err(failed)?;
                Ok((BYTES, found.ok_or(StatusCode::NOT_FOUND)?))
            }
        }
    }
}

/// Place among the open event streams.
struct Stream(Arc<AtomicUsize>);

impl Stream {
    fn new(open: &Arc<AtomicUsize>) -> Option<Stream> {
        let before = open.fetch_add(1, Ordering::Relaxed);
        let stream = Stream(Arc::clone(open));
        (before < STREAMS).then_some(stream)
    }
}

impl Drop for Stream {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Sends an event for each change until the client is gone. Changes in quick succession are one event.
async fn tell(sender: mpsc::Sender<Bytes>, mut notices: watch::Receiver<Notice>, _stream: Stream) {
    loop {
        let notice = *notices.borrow_and_update();
        let Notice { epoch, version, points, running } = notice;
        let text = format!(
            "event: grew\ndata: {{\"epoch\":{epoch},\"version\":{version},\"points\":{points},\"running\":{running}}}\n\n"
        );
        if sender.send(text.into()).await.is_err() {
            return;
        }
        loop {
            let changed = tokio::time::timeout(ALIVE, notices.changed());
            match first(changed, sender.closed()).await {
                First::One(Ok(Ok(()))) => break,
                First::One(Ok(Err(_))) | First::Other(()) => return,
                First::One(Err(_)) if sender.send(Bytes::from_static(b": alive\n\n")).await.is_err() => return,
                First::One(Err(_)) => {}
            }
        }
    }
}

fn whole(kind: &'static str, bytes: Vec<u8>) -> Response<Answer> {
    let mut answer = Response::new(Answer::Whole(Full::new(bytes.into())));
    answer.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(kind));
    answer
}

fn refusal(status: StatusCode) -> Response<Answer> {
    let text = match status {
        StatusCode::FORBIDDEN => page::FORBIDDEN.to_string(),
        other => format!("{other}\n"),
    };
    let mut answer = whole("text/plain; charset=utf-8", text.into_bytes());
    *answer.status_mut() = status;
    answer
}

fn protected(mut answer: Response<Answer>) -> Response<Answer> {
    for (name, value) in HEADERS {
        answer.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    answer
}
