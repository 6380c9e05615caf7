//! Waiting for a computation without holding the interpreter's lock.
//!
//! **Idea.** The computation has a thread of its own. The thread that called looks a few times a second whether Ctrl-C was pressed,
//! and shows how far the computation is. The first Ctrl-C asks it to stop at the next point; the second, or the first where
//! nothing can be asked, leaves it to itself.

use crate::failure;
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

const LOOK: Duration = Duration::from_millis(100);

/// The result of `work`, and the exception of the Ctrl-C that stopped it, if one did.
///
/// # Errors
/// The exception where the computation could not be stopped, or one of `show`.
pub fn patiently<T: Send + 'static>(
    py: Python,
    stop: Option<&AtomicBool>,
    show: &mut dyn FnMut(Python) -> PyResult<()>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<(T, Option<PyErr>)> {
    let (sender, receiver) = channel();
    let receiver = Mutex::new(receiver);
    std::thread::spawn(move || {
        // Nobody may be there any more to receive it.
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
