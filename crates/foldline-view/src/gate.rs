//! Checks that every request passes before its path is examined.
//!
//! **Idea.** Any page in the browser can send requests to a server on the same computer, and a hostile name server can
//! make its own host name point here. A request must therefore name this server as its host, must not come from
//! another origin, and must carry a cookie that is given once, in exchange for the token in the printed address.
//!
//! | check | refusal |
//! |---|---|
//! | exactly one `Host`: `127.0.0.1:PORT` or `localhost:PORT`, and no other authority in the request line | 421 |
//! | `Origin`, if present, is this server | 403 |
//! | `Sec-Fetch-Site`, if present, is `same-origin` or `none` | 403 |
//! | at most 2048 bytes of path and query | 414 |
//! | the method is GET, or POST for a path that takes a body | 405 |
//! | GET: no body | 413 |
//! | POST: an `Origin` | 403 |
//! | POST: `Content-Type: application/json`, which no other page can send | 415 |
//! | POST: a `Content-Length`, at most 1 MiB | 411, 413 |
//! | the cookie, or for GET of `/` the token, which works once | 403 |

use crate::orders;
use crate::query::Query;
use hyper::Method;
use hyper::StatusCode;
use hyper::header::{CONTENT_LENGTH, CONTENT_TYPE, COOKIE, HOST, HeaderMap, ORIGIN, TRANSFER_ENCODING};
use hyper::http::request::Parts;
use std::sync::{Mutex, PoisonError};

/// Longest path with query, in bytes.
const LONGEST: usize = 2048;

/// Entrance to the server on one port.
pub(crate) struct Gate {
    port: u16,
    token: Mutex<Option<String>>,
    session: String,
}

/// Result of the checks for an accepted request.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Entry {
    /// The request has the cookie.
    Known,
    /// The request brought the token; the answer sets the cookie.
    New,
}

impl Gate {
    /// Entrance with a new token and a new session.
    ///
    /// # Errors
    /// If the operating system supplies no random numbers.
    pub(crate) fn new(port: u16) -> std::io::Result<Gate> {
        Ok(Gate { port, token: Mutex::new(Some(secret()?)), session: secret()? })
    }

    /// Address to be opened in a browser, with the token if it has not been used.
    pub(crate) fn address(&self) -> String {
        let token = self.token.lock().unwrap_or_else(PoisonError::into_inner);
        let query = token.as_ref().map_or(String::new(), |token| format!("?token={token}"));
        format!("http://127.0.0.1:{}/{query}", self.port)
    }

    /// Value of `Set-Cookie` for a new entry. Cookies do not distinguish ports, so the name does.
    pub(crate) fn cookie(&self) -> String {
        format!("{}={}; HttpOnly; SameSite=Strict; Path=/", self.name(), self.session)
    }

    fn name(&self) -> String {
        format!("foldline-{}", self.port)
    }

    /// Checks a request.
    ///
    /// # Errors
    /// The status of the refusal.
    pub(crate) fn check(&self, request: &Parts) -> Result<Entry, StatusCode> {
        let headers = &request.headers;
        if !self.is_host(headers) || request.uri.authority().is_some() {
            return Err(StatusCode::MISDIRECTED_REQUEST);
        }
        let mut origins = headers.get_all(ORIGIN).iter();
        if !origins
            .all(|origin| self.hosts().iter().any(|host| origin.as_bytes() == format!("http://{host}").as_bytes()))
        {
            return Err(StatusCode::FORBIDDEN);
        }
        let mut sites = headers.get_all("sec-fetch-site").iter();
        if !sites.all(|site| matches!(site.as_bytes(), b"same-origin" | b"none")) {
            return Err(StatusCode::FORBIDDEN);
        }
        if request.uri.path_and_query().map_or(0, |path| path.as_str().len()) > LONGEST {
            return Err(StatusCode::URI_TOO_LONG);
        }
        let orders = request.method == Method::POST && orders::takes(request.uri.path());
        if request.method != Method::GET && !orders {
            return Err(StatusCode::METHOD_NOT_ALLOWED);
        }
        let length = headers.get(CONTENT_LENGTH).map_or(&b"0"[..], |length| length.as_bytes());
        if orders {
            fits(headers)?;
        } else if length != b"0" || headers.contains_key(TRANSFER_ENCODING) {
            return Err(StatusCode::PAYLOAD_TOO_LARGE);
        }
        if self.is_known(headers) {
            return Ok(Entry::Known);
        }
        if orders {
            return Err(StatusCode::FORBIDDEN);
        }
        let query = Query::new(request.uri.query().unwrap_or(""));
        match query.text("token") {
            Some(token) if request.uri.path() == "/" && self.spend(token) => Ok(Entry::New),
            _ => Err(StatusCode::FORBIDDEN),
        }
    }

    fn hosts(&self) -> [String; 2] {
        ["127.0.0.1", "localhost"].map(|host| format!("{host}:{}", self.port))
    }

    fn is_host(&self, headers: &HeaderMap) -> bool {
        let mut hosts = headers.get_all(HOST).iter();
        let (first, second) = (hosts.next(), hosts.next());
        second.is_none() && first.is_some_and(|own| self.hosts().iter().any(|host| own.as_bytes() == host.as_bytes()))
    }

    fn is_known(&self, headers: &HeaderMap) -> bool {
        let name = self.name();
        let texts = headers.get_all(COOKIE).iter().filter_map(|cookies| cookies.to_str().ok());
        let mut pairs = texts.flat_map(|text| text.split(';')).filter_map(|pair| pair.trim().split_once('='));
        pairs.any(|(key, value)| key == name && same(value, &self.session))
    }

    /// Uses up the token if `offered` equals it.
    fn spend(&self, offered: &str) -> bool {
        let mut token = self.token.lock().unwrap_or_else(PoisonError::into_inner);
        let right = token.as_ref().is_some_and(|token| same(offered, token));
        if right {
            *token = None;
        }
        right
    }
}

/// Checks the headers of a request with a body.
fn fits(headers: &HeaderMap) -> Result<(), StatusCode> {
    if headers.get_all(ORIGIN).iter().count() != 1 {
        return Err(StatusCode::FORBIDDEN);
    }
    if headers.get_all(CONTENT_TYPE).iter().map(|own| own.as_bytes()).ne([&b"application/json"[..]]) {
        return Err(StatusCode::UNSUPPORTED_MEDIA_TYPE);
    }
    if headers.contains_key(TRANSFER_ENCODING) {
        return Err(StatusCode::LENGTH_REQUIRED);
    }
    let length = headers.get(CONTENT_LENGTH).ok_or(StatusCode::LENGTH_REQUIRED)?;
    let length = length.to_str().ok().and_then(|text| text.parse::<u64>().ok()).ok_or(StatusCode::BAD_REQUEST)?;
    if length <= orders::LARGEST { Ok(()) } else { Err(StatusCode::PAYLOAD_TOO_LARGE) }
}

/// True if two texts are equal. The time depends on their lengths only.
fn same(offered: &str, own: &str) -> bool {
    let differences = offered.bytes().zip(own.bytes()).fold(0, |found, (a, b)| found | (a ^ b));
    offered.len() == own.len() && std::hint::black_box(differences) == 0
}

/// 256 random bits in hexadecimal digits.
fn secret() -> std::io::Result<String> {
    let mut bytes = [0; 32];
    getrandom::fill(&mut bytes).map_err(std::io::Error::other)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}
