//! The job of an emitted ensemble: its memory layout, and how trajectories ended.

/// Ending of a trajectory, as the source numbers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// The end of the time span was reached.
    Reached,
    /// It settled, or the last crossing was recorded.
    Stopped,
    /// The state grew without bound.
    Escaped,
    /// It left the region in which f is defined.
    Undefined,
    /// The step became too small.
    StepTooSmall,
    /// The limit on the number of steps was reached.
    StepLimit,
    /// It began to slide along the surface of a switch, which the source does not follow.
    Slides,
}

impl Fate {
    /// The fate of that number.
    pub fn of(number: i32) -> Option<Fate> {
        use Fate::{Escaped, Reached, Slides, StepLimit, StepTooSmall, Stopped, Undefined};
        let all = [Reached, Stopped, Escaped, Undefined, StepTooSmall, StepLimit, Slides];
        all.get(usize::try_from(number).ok()?).copied()
    }
}

/// Members of the structure `fl_job`, in order, with their C types: `q` 64-bit integer, `i` 32-bit integer, `d` number,
/// `n` numbers, one per state, `s` numbers, one per scalar, `p` pointer.
pub type Layout = &'static [(&'static str, char)];

/// Members of every job.
pub const LAYOUT: Layout = &[
    ("count", 'q'),
    ("begin", 'd'),
    ("end", 'd'),
    ("sign", 'd'),
    ("longest", 'd'),
    ("limit", 'd'),
    ("size", 'd'),
    ("relative", 'd'),
    ("absolute", 'n'),
    ("s", 's'),
    ("starts", 'p'),
    ("own", 'p'),
    ("states", 'p'),
    ("times", 'p'),
    ("outcomes", 'p'),
    ("steps", 'p'),
    ("rejected", 'p'),
    ("next", 'p'),
];

/// Further members with `settle`.
pub const LAYOUT_SETTLE: Layout = &[
    ("orbits", 'i'),
    ("orbit_first", 'p'),
    ("orbit_scale", 'p'),
    ("orbit_states", 'p'),
    ("orbit_coarse", 'p'),
    ("settled", 'p'),
];

/// Further members with `section`.
pub const LAYOUT_SECTION: Layout = &[
    ("plane", 'n'),
    ("level", 'd'),
    ("direction", 'i'),
    ("strobe", 'd'),
    ("records", 'i'),
    ("recorded", 'p'),
    ("recorded_at", 'p'),
    ("crossings", 'p'),
];
