//! Local server: one listener on the loopback interface, with limits on everything a client can use up.

use crate::body::{First, first};
use crate::desk::Desk;
use crate::gate::Gate;
use crate::routes::Routes;
use crate::watch::{Notice, Watch};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use std::convert::Infallible;
use std::io;
use std::net::Ipv4Addr;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::{Notify, Semaphore, watch};

/// Time in which the head of a request must be complete, and the longest pause between two requests.
const HEAD: Duration = Duration::from_secs(5);
/// Largest head of a request, in bytes.
const LARGEST: usize = 16 * 1024;
/// Largest number of headers of a request.
const HEADERS: usize = 64;
/// Largest number of connections; a browser opens at most six for each host.
const CONNECTIONS: usize = 32;
/// Pause after a failure to accept a connection, such as too many open files.
const PAUSE: Duration = Duration::from_millis(50);
/// Time for reads in progress when the server ends.
const LAST: Duration = Duration::from_secs(1);

/// Server for one run, bound to a free port of the loopback interface.
pub struct Server {
    runtime: Runtime,
    listener: TcpListener,
    routes: Arc<Routes>,
    stop: Arc<Notify>,
}

/// Ends a server from another thread.
#[derive(Clone)]
pub struct Stop(Arc<Notify>);

impl Stop {
    /// Asks the server to end.
    pub fn stop(&self) {
        self.0.notify_one();
    }
}

impl Server {
    /// Binds a free port. With a desk, the page can go on with a longer study.
    ///
    /// # Errors
    /// If no port can be bound or the operating system supplies no random numbers.
    pub fn new(watch: Watch, desk: Option<Desk>) -> io::Result<Server> {
        let runtime = Builder::new_current_thread().enable_all().max_blocking_threads(4).build()?;
        let listener = runtime.block_on(TcpListener::bind((Ipv4Addr::LOCALHOST, 0)))?;
        let gate = Gate::new(listener.local_addr()?.port())?;
        let routes = Arc::new(Routes::new(gate, watch, desk));
        Ok(Server { runtime, listener, routes, stop: Arc::new(Notify::new()) })
    }

    /// Address to open in a browser. It works once.
    pub fn address(&self) -> String {
        self.routes.gate.address()
    }

    /// Handle that ends the server.
    pub fn stopper(&self) -> Stop {
        Stop(Arc::clone(&self.stop))
    }

    /// Serves until it is stopped.
    ///
    /// # Errors
    /// If the thread that watches the file cannot be started.
    pub fn run(self) -> io::Result<()> {
        let Server { runtime, listener, routes, stop } = self;
        let watching = routes.start_watching()?;
        runtime.block_on(accept(&listener, &routes, &stop));
        runtime.shutdown_timeout(LAST);
        watching.end();
        Ok(())
    }
}

async fn accept(listener: &TcpListener, routes: &Arc<Routes>, stop: &Notify) {
    let places = Arc::new(Semaphore::new(CONNECTIONS));
    loop {
        let stream = match first(listener.accept(), stop.notified()).await {
            First::One(Ok((stream, _))) => stream,
            First::One(Err(_)) => {
                tokio::time::sleep(PAUSE).await;
                continue;
            }
            First::Other(()) => return,
        };
        // Without a free place the connection is closed.
        if let Ok(place) = Arc::clone(&places).try_acquire_owned() {
            let routes = Arc::clone(routes);
            tokio::spawn(async move {
                serve(stream, routes).await;
                drop(place);
            });
        }
    }
}

async fn serve(stream: TcpStream, routes: Arc<Routes>) {
    let service = service_fn(|request| {
        let routes = Arc::clone(&routes);
        async move { Ok::<_, Infallible>(routes.answer(request).await) }
    });
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(HEAD).max_buf_size(LARGEST).max_headers(HEADERS);
    // Errors are those of the client, such as a closed connection.
    let _ = http.serve_connection(TokioIo::new(stream), service).await;
}

/// Sender of notices about the run.
pub(crate) type Notices = watch::Sender<Notice>;
