//! Waiting for a computation without holding the interpreter's lock.
//!
//! **Idea.** The computation has a thread of its own. A few times a second the calling thread checks for Ctrl-C
//! and shows progress. The first Ctrl-C asks the computation to stop at the next point. The second, or the first if
//! the computation cannot be stopped, abandons it.

use crate::failure;
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

const LOOK: Duration = Duration::from_millis(100);

/// Returns the result of `work`, and the exception of the Ctrl-C that stopped it, if one did.
///
/// # Errors
/// The exception of Ctrl-C if the computation was abandoned, or one of `show`.
pub fn patiently<T: Send + 'static>(
    py: Python,
    stop: Option<&AtomicBool>,
    show: &mut dyn FnMut(Python) -> PyResult<()>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<(T, Option<PyErr>)> {
    let (sender, receiver) = channel();
    let receiver = Mutex::new(receiver);
    std::thread::spawn(move || {
        // The receiver may be gone.
        let _ = sender.send(catch_unwind(AssertUnwindSafe(work)));
    });
    let mut interrupt = None;
    loop {
        match py.detach(|| receiver.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(LOOK)) {
            Ok(Ok(result)) => {
                show(py)?;
                return Ok((result, interrupt));
            }
            Ok(Err(panic)) => {
                let text = panic.downcast_ref::<String>().cloned();
                let text = text.or_else(|| panic.downcast_ref::<&str>().map(|text| text.to_string()));
                return Err(failure::internal(py, text.unwrap_or_default()));
            }
            Err(RecvTimeoutError::Disconnected) => return Err(failure::internal(py, "a thread is gone".into())),
            Err(RecvTimeoutError::Timeout) => {}
        }
        if let Err(error) = py.check_signals().and_then(|()| show(py)) {
            match stop.filter(|stop| !stop.swap(true, Ordering::Relaxed)) {
                Some(_) => interrupt = Some(error),
                None => return Err(error),
            }
        }
    }
}
