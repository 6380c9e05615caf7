//! A run, a server for it, and a client that sends any bytes.

use foldline::diagram::Diagram;
use foldline::explore;
use foldline_store::run_file::{Recorder, load};
use foldline_store::study_file::{Study, parse_study};
use foldline_view::{Desk, Server, Stop, Watch};
use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::path::Path;
use std::thread::JoinHandle;
use std::time::Duration;

pub const MODEL: &str =
    "name = \"pitchfork\"\n[parameters]\nmu = 1.0\n[states.x]\nequation = \"mu*x - x^3\"\n[outputs]\nr = \"abs(x)\"\n";
pub const STUDY: &str = "model = \"pitchfork.toml\"\n[[seed]]\nname = \"start\"\nstate = { x = 1 }\n\
    [[branch]]\nname = \"main\"\nfrom = \"start\"\nfree = \"mu\"\nrange = [0.5, 2]\n";

/// Time after which a test fails. Nothing is expected to take that long.
pub const PATIENCE: Duration = Duration::from_secs(60);

pub fn study() -> Study {
    parse_study(STUDY, "study.toml", MODEL, "pitchfork.toml").expect("the study is right")
}

/// Computes a small run and returns it as it is stored: with all points, of which only some stay in memory.
pub fn run_in(folder: &Path) -> Diagram {
    run_of(folder, &study())
}

/// Computes the run of a study.
pub fn run_of(folder: &Path, study: &Study) -> Diagram {
    let recorder = Recorder::create(folder, study).expect("the folder is new");
    let system = explore::System::of_plan(&study.model, &study.plan);
    explore::run(&system, &study.plan, 1, Diagram::default(), &recorder);
    recorder.complete().expect("the run can be written");
    load(folder).expect("the run can be read").diagram
}

/// A server in a thread of its own; it ends when this is dropped.
pub struct Served {
    pub port: u16,
    pub token: String,
    stop: Stop,
    thread: Option<JoinHandle<()>>,
}

impl Served {
    #[allow(dead_code)]
    pub fn new(folder: &Path) -> Served {
        Served::of(Watch::open(folder).expect("there is a run"), None)
    }

    pub fn of(watch: Watch, desk: Option<Desk>) -> Served {
        let server = Server::new(watch, desk).expect("a port is free");
        let address = server.address();
        let rest = address.strip_prefix("http://127.0.0.1:").expect("the server is on this computer");
        let (port, token) = rest.split_once("/?token=").expect("the address has a token");
        let (port, token, stop) = (port.parse().expect("a port"), token.to_string(), server.stopper());
        let thread = std::thread::spawn(move || server.run().expect("the server runs"));
        Served { port, token, stop, thread: Some(thread) }
    }

    /// Sends bytes and returns everything that comes back. With `last`, also says that nothing follows; the server
    /// takes that as the end of the connection and may drop an answer in progress.
    pub fn raw(&self, bytes: &[u8], last: bool) -> Vec<u8> {
        let mut stream = self.connect();
        // The server may close before everything is sent.
        let sent = stream.write_all(bytes);
        if last && sent.is_ok() {
            let _ = stream.shutdown(Shutdown::Write);
        }
        let mut answer = Vec::new();
        match stream.read_to_end(&mut answer) {
            Err(error) if matches!(error.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut) => {
                panic!("no end of the answer to {:?}", String::from_utf8_lossy(bytes))
            }
            _ => answer,
        }
    }

    pub fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).expect("the server accepts");
        stream.set_read_timeout(Some(PATIENCE)).expect("a timeout can be set");
        stream
    }

    /// Sends a request with the given lines after the first and returns status, head and body.
    pub fn ask(&self, first: &str, lines: &[&str]) -> (u16, String, Vec<u8>) {
        let lines: String = lines.iter().map(|line| format!("{line}\r\n")).collect();
        split(&self.raw(format!("{first}\r\n{lines}Connection: close\r\n\r\n").as_bytes(), false))
    }

    pub fn host(&self) -> String {
        format!("Host: 127.0.0.1:{}", self.port)
    }

    /// Exchanges the token for the cookie and returns the header line that sends it.
    pub fn enter(&self) -> String {
        let (status, head, _) = self.ask(&format!("GET /?token={} HTTP/1.1", self.token), &[&self.host()]);
        assert_eq!(status, 303, "{head}");
        let line = head.lines().find_map(|line| line.strip_prefix("set-cookie: ")).expect("a cookie is set");
        assert!(line.ends_with("; HttpOnly; SameSite=Strict; Path=/"), "{line}");
        format!("Cookie: {}", line.split(';').next().unwrap_or_default())
    }

    /// Body of a successful request with the cookie.
    #[allow(dead_code)]
    pub fn get(&self, path: &str, cookie: &str) -> Vec<u8> {
        let (status, _, body) = self.ask(&format!("GET {path} HTTP/1.1"), &[&self.host(), cookie]);
        assert_eq!(status, 200, "{path}");
        body
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.stop();
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            assert!(ended.is_ok() || std::thread::panicking(), "the server has failed");
        }
    }
}

/// Status, head and body of an answer; status 0 if there is none.
pub fn split(answer: &[u8]) -> (u16, String, Vec<u8>) {
    let cut = answer.windows(4).position(|four| four == b"\r\n\r\n").unwrap_or(answer.len());
    let head = String::from_utf8_lossy(&answer[..cut]).into_owned();
    let status = head.split(' ').nth(1).and_then(|code| code.parse().ok()).unwrap_or(0);
    (status, head, answer.get(cut + 4..).unwrap_or_default().to_vec())
}
