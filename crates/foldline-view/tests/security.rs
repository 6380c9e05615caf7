//! The server answers only the page that it has served itself, and survives every other request.

use crate::common::{PATIENCE, Served, run_in, split};
use std::io::{ErrorKind, Read, Write};
use std::time::Instant;

fn served() -> (tempfile::TempDir, Served) {
    let folder = tempfile::tempdir().expect("a folder can be made");
    run_in(&folder.path().join("run"));
    let served = Served::new(&folder.path().join("run"));
    (folder, served)
}

#[test]
fn the_token_works_once_and_only_the_cookie_after_it() {
    let (_folder, served) = served();
    let host = served.host();
    assert_eq!(served.ask("GET / HTTP/1.1", &[&host]).0, 403);
    assert_eq!(served.ask(&format!("GET /?token={} HTTP/1.1", "0".repeat(64)), &[&host]).0, 403);
    assert_eq!(served.ask(&format!("GET /api/run?token={} HTTP/1.1", served.token), &[&host]).0, 403);
    let cookie = served.enter();
    assert_eq!(served.ask(&format!("GET /?token={} HTTP/1.1", served.token), &[&host]).0, 403);
    let (status, head, body) = served.ask("GET / HTTP/1.1", &[&host, &cookie]);
    assert_eq!(status, 200);
    assert!(body.starts_with(b"<!DOCTYPE html>"), "{head}");
    let mut wrong = cookie.clone();
    let last = if wrong.pop() == Some('0') { '1' } else { '0' };
    wrong.push(last);
    assert_eq!(served.ask("GET / HTTP/1.1", &[&host, &wrong]).0, 403);
    let name = cookie.split('=').next().unwrap_or_default();
    assert_eq!(served.ask("GET / HTTP/1.1", &[&host, &format!("{name}=")]).0, 403);
}

#[test]
fn every_answer_has_the_security_headers() {
    let (_folder, served) = served();
    let host = served.host();
    let cookie = served.enter();
    let lines = |path: &str, more: &[&str]| {
        let all: Vec<&str> = [host.as_str()].into_iter().chain(more.iter().copied()).collect();
        served.ask(&format!("GET {path} HTTP/1.1"), &all).1.to_lowercase()
    };
    let heads = [
        lines("/", &[&cookie]),
        lines("/app.js", &[&cookie]),
        lines("/api/run", &[&cookie]),
        lines("/none", &[&cookie]),
        lines("/", &[]),
    ];
    for head in heads {
        for line in [
            "content-security-policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
             connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; require-trusted-types-for 'script'",
            "x-content-type-options: nosniff",
            "referrer-policy: no-referrer",
            "cache-control: no-store",
            "cross-origin-opener-policy: same-origin",
            "cross-origin-resource-policy: same-origin",
            "cross-origin-embedder-policy: require-corp",
            "x-frame-options: deny",
        ] {
            assert!(head.contains(line), "{line} is missing in\n{head}");
        }
        assert!(!head.contains("access-control"), "{head}");
    }
}

#[test]
fn requests_of_other_pages_are_refused() {
    let (_folder, served) = served();
    let (host, cookie, port) = (served.host(), served.enter(), served.port);
    let other = port.wrapping_add(1);
    let refused = [
        (421, vec![]),
        (421, vec!["Host: evil.example".to_string()]),
        (421, vec![format!("Host: evil.example:{port}")]),
        (421, vec!["Host: 127.0.0.1".to_string()]),
        (421, vec![format!("Host: 127.0.0.1:{other}")]),
        (421, vec![format!("Host: 127.0.0.1:{port}.evil.example")]),
        (421, vec![host.clone(), "Host: evil.example".to_string()]),
        (403, vec![host.clone(), "Origin: http://evil.example".to_string()]),
        (403, vec![host.clone(), "Origin: null".to_string()]),
        (403, vec![host.clone(), format!("Origin: http://127.0.0.1:{other}")]),
        (403, vec![host.clone(), format!("Origin: https://127.0.0.1:{port}")]),
        (403, vec![host.clone(), format!("Origin: http://127.0.0.1:{port}"), "Origin: null".to_string()]),
        (403, vec![host.clone(), "Sec-Fetch-Site: cross-site".to_string()]),
        (403, vec![host.clone(), "Sec-Fetch-Site: same-site".to_string()]),
        (
            200,
            vec![host.clone(), format!("Origin: http://127.0.0.1:{port}"), "Sec-Fetch-Site: same-origin".to_string()],
        ),
        (200, vec![format!("Host: localhost:{port}"), "Sec-Fetch-Site: none".to_string()]),
    ];
    for path in ["/api/run", "/", "/app.js"] {
        for (expected, lines) in &refused {
            let lines: Vec<&str> = lines.iter().map(String::as_str).chain([cookie.as_str()]).collect();
            assert_eq!(served.ask(&format!("GET {path} HTTP/1.1"), &lines).0, *expected, "{path} {lines:?}");
        }
    }
    let events = served.ask("GET /api/events HTTP/1.1", &["Host: evil.example", &cookie]).0;
    assert_eq!(events, 421);
    assert_eq!(served.ask("GET http://evil.example/api/run HTTP/1.1", &[&host, &cookie]).0, 421);
}

#[test]
fn only_reading_is_possible() {
    let (_folder, served) = served();
    let (host, cookie) = (served.host(), served.enter());
    for method in ["POST", "PUT", "DELETE", "HEAD", "OPTIONS", "PATCH", "TRACE", "CONNECT"] {
        let status = served.ask(&format!("{method} /api/run HTTP/1.1"), &[&host, &cookie]).0;
        assert!(matches!(status, 400 | 405 | 421), "{method}: {status}");
    }
    let with_body =
        format!("GET /api/run HTTP/1.1\r\n{host}\r\n{cookie}\r\nContent-Length: 5\r\nConnection: close\r\n\r\nhello");
    assert_eq!(split(&served.raw(with_body.as_bytes(), false)).0, 413);
}

#[test]
fn paths_and_numbers_outside_the_closed_list_are_refused() {
    let (_folder, served) = served();
    let (host, cookie) = (served.host(), served.enter());
    for path in [
        "/../Cargo.toml",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/..%2f..%2fetc/passwd",
        "/app.js%00.html",
        "/C:/Windows/win.ini",
        "//etc/passwd",
        "/app.js/",
        "/APP.JS",
        "/api",
        "/api/",
        "/api/run/",
        "/run.sqlite",
        "/index.html",
        "/api/points/../run",
    ] {
        let status = served.ask(&format!("GET {path} HTTP/1.1"), &[&host, &cookie]).0;
        assert_eq!(status, 404, "{path}");
    }
    for query in [
        "/api/points",
        "/api/points?epoch=1",
        "/api/points?epoch=1&since=-1",
        "/api/points?epoch=1&since=99999999999999999999999",
        "/api/points?epoch=1&since=1;DROP",
        "/api/points?epoch=1&since=0&columns=999999",
        "/api/points?epoch=1&since=0&columns=1,",
        "/api/points?epoch=1&since=0&columns=0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0",
        "/api/points?epoch=1&since=0&since=0",
        "/api/special?columns=999999",
        "/api/special?columns=x_h1",
        "/api/special?columns=0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0",
        "/api/export?columns=-1",
        "/api/solution?branch=1",
        "/api/solution?branch=1&position=0&special=0",
        "/api/solution?branch=x&position=0",
        "/api/solution?branch=1&special=-1",
        "/api/solution?branch=%31&position=0",
    ] {
        assert_eq!(served.ask(&format!("GET {query} HTTP/1.1"), &[&host, &cookie]).0, 400, "{query}");
    }
    for extreme in [i64::MIN, i64::MAX] {
        assert_eq!(
            served.ask(&format!("GET /api/solution?branch={extreme}&position={extreme} HTTP/1.1"), &[&host, &cookie]).0,
            404
        );
    }
    let far = served.ask(&format!("GET /api/points?epoch=1&since={} HTTP/1.1", i64::MAX), &[&host, &cookie]);
    assert_eq!(far.0, 200);
    assert_eq!(served.ask(&format!("GET /?{} HTTP/1.1", "a".repeat(4000)), &[&host, &cookie]).0, 414);
    let long = format!("X: {}", "a".repeat(40_000));
    // The connection may be reset before the refusal has been read.
    assert!(matches!(served.ask("GET / HTTP/1.1", &[&host, &cookie, &long]).0, 0 | 431));
}

/// Pseudo-random numbers (xorshift, Marsaglia).
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % limit.max(1)
    }
}

#[test]
fn ten_thousand_malformed_requests_change_nothing() {
    let (_folder, served) = served();
    let cookie = served.enter();
    let host = served.host();
    let before = served.get("/api/state", &cookie);
    let whole = format!(
        "GET /api/points?epoch=1&since=0&columns=0,1 HTTP/1.1\r\n{host}\r\n{cookie}\r\nConnection: close\r\n\r\n"
    );
    let odd: [&[u8]; 12] = [
        b"\0",
        b"\r\n",
        b"\n",
        b"\xff\xfe",
        b"%00",
        b"Transfer-Encoding: chunked\r\n",
        b"Content-Length: -1\r\n",
        b" ",
        b"HTTP/9.9",
        b"Content-Length: 99999999999999999999\r\n",
        b"Expect: 100-continue\r\n",
        b"9999999999999999999999",
    ];
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    for _ in 0..10_000 {
        let mut bytes = whole.clone().into_bytes();
        for _ in 0..=random.below(4) {
            let at = random.below(bytes.len());
            match random.below(5) {
                0 => bytes.truncate(at),
                1 => drop(bytes.splice(at..at, odd[random.below(odd.len())].iter().copied())),
                2 => bytes.extend((0..random.below(200)).map(|k| (k * 37) as u8)),
                3 if !bytes.is_empty() => drop(bytes.drain(at..(at + 1 + random.below(12)).min(bytes.len()))),
                _ if !bytes.is_empty() => bytes[at] = random.below(256) as u8,
                _ => {}
            }
        }
        let (status, head, _) = split(&served.raw(&bytes, true));
        // An unfinished request is closed without an answer.
        let expected = matches!(status, 0 | 200 | 400 | 403 | 404 | 405 | 413 | 414 | 421 | 431 | 505);
        assert!(expected, "{status} {head} to {:?}", String::from_utf8_lossy(&bytes));
    }
    assert_eq!(served.get("/api/state", &cookie), before);
}

#[test]
fn unfinished_requests_are_closed() {
    let (_folder, served) = served();
    let mut stream = served.connect();
    stream.write_all(b"GET / HTTP/1.1\r\nHost: ").expect("the server listens");
    let start = Instant::now();
    let mut rest = Vec::new();
    let ended = stream.read_to_end(&mut rest);
    assert!(ended.is_ok() || ended.is_err_and(|error| error.kind() == ErrorKind::ConnectionReset));
    assert!(start.elapsed() < PATIENCE);
}

#[test]
fn idle_connections_are_limited_and_make_room_again() {
    let (_folder, served) = served();
    let cookie = served.enter();
    let mut idle: Vec<_> = (0..60).map(|_| served.connect()).collect();
    // At least those beyond the limit are closed at once: reading ends without data.
    let mut one = [0; 1];
    let last = idle.last_mut().expect("connections were opened");
    assert!(!matches!(last.read(&mut one), Ok(1..)));
    drop(idle);
    let start = Instant::now();
    loop {
        let (status, ..) = served.ask("GET /api/run HTTP/1.1", &[&served.host(), &cookie]);
        if status == 200 {
            break;
        }
        assert!(start.elapsed() < PATIENCE, "no room again");
        std::thread::yield_now();
    }
}

#[test]
fn event_streams_are_limited_to_one_for_each_of_four_tabs() {
    let (_folder, served) = served();
    let cookie = served.enter();
    let request = format!("GET /api/events HTTP/1.1\r\n{}\r\n{cookie}\r\n\r\n", served.host());
    let mut open = Vec::new();
    for number in 0..5 {
        let mut stream = served.connect();
        stream.write_all(request.as_bytes()).expect("the server listens");
        let mut head = [0; 12];
        stream.read_exact(&mut head).expect("the server answers");
        let expected: &[u8] = if number < 4 { b"HTTP/1.1 200" } else { b"HTTP/1.1 503" };
        assert_eq!(&head[..], expected, "stream {number}");
        open.push(stream);
    }
}
