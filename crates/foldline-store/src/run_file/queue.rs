//! Rows on their way to the file.

use rusqlite::types::Value;
use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Where a row belongs.
#[derive(Clone, Copy, Debug)]
pub(super) enum Table {
    Points,
    SpecialPoints,
    Ends,
    Notes,
}

/// A row that is yet to be written.
#[derive(Debug)]
pub(super) struct Row {
    pub(super) table: Table,
    pub(super) values: Vec<Value>,
}

/// Rows in the order in which they came.
#[derive(Debug, Default)]
pub(super) struct Queue(Mutex<VecDeque<Row>>);

impl Queue {
    pub(super) fn push(&self, row: Row) {
        self.locked().push_back(row);
    }

    pub(super) fn pop(&self) -> Option<Row> {
        self.locked().pop_front()
    }

    pub(super) fn len(&self) -> usize {
        self.locked().len()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn locked(&self) -> MutexGuard<'_, VecDeque<Row>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
