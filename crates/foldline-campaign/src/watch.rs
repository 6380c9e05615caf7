//! Time limit of a case.

use foldline::contract::{Event, Observer, Verdict};
use std::time::{Duration, Instant};

/// Observer that stops every branch of a case once its time is over.
#[derive(Clone, Copy, Debug)]
pub struct Watch {
    start: Instant,
    limit: Duration,
}

impl Watch {
    /// Starts the time limit.
    pub fn start(limit: Duration) -> Watch {
        Watch { start: Instant::now(), limit }
    }

    /// True once the time is over.
    pub fn over(&self) -> bool {
        self.start.elapsed() > self.limit
    }
}

impl Observer for Watch {
    fn observe(&self, _event: Event) -> Verdict {
        if self.over() { Verdict::Stop } else { Verdict::Continue }
    }
}
