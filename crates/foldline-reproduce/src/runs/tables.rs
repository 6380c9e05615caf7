//! Tables of numbers computed by a figure itself, kept beside the runs.
//!
//! **Idea.** The first line of `OUT/runs/NAME.table` identifies the input: version, tolerance and a fingerprint of
//! the rest. A table whose first line matches is read back; any other is recomputed. Numbers are written so that
//! they read back exactly.

use super::{Runs, build};
use std::fmt::Write;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Rows of numbers, of any length.
pub type Table = Vec<Vec<f64>>;

impl Runs<'_> {
    /// Returns the table of that name, computing it if needed. `of` identifies everything it depends on besides the
    /// version and the tolerance.
    ///
    /// # Errors
    /// The error of `compute`, or that the table cannot be written.
    pub fn table(
        &self,
        name: &str,
        of: &str,
        compute: impl FnOnce() -> Result<Table, String>,
    ) -> Result<Table, String> {
        let mut hasher = DefaultHasher::new();
        of.hash(&mut hasher);
        let tolerance = self.tolerance.map_or("as stated".to_string(), |t| format!("{t:e}"));
        let head = format!("{}, tolerance {tolerance}, {:016x}", build(), hasher.finish());
        let file = self.folder.join(format!("{name}.table"));
        if let Some(known) = std::fs::read_to_string(&file).ok().and_then(|text| parsed(&text, &head)) {
            return Ok(known);
        }
        (self.say)(&format!("table {name}"));
        let table = compute()?;
        let unwritable = |error: std::io::Error| format!("{}: {error}", file.display());
        std::fs::create_dir_all(&self.folder).map_err(unwritable)?;
        std::fs::write(&file, written(&table, &head)).map_err(unwritable)?;
        Ok(table)
    }
}

fn written(table: &[Vec<f64>], head: &str) -> String {
    let mut text = format!("{head}\n");
    for row in table {
        let cells: Vec<String> = row.iter().map(|value| format!("{value:e}")).collect();
        let _ = writeln!(text, "{}", cells.join(" "));
    }
    text
}

/// Rows below the expected first line; `None` for any other file.
fn parsed(text: &str, head: &str) -> Option<Table> {
    let mut lines = text.lines();
    (lines.next()? == head).then_some(())?;
    lines.map(|line| line.split(' ').map(|cell| cell.parse().ok()).collect()).collect()
}

/// Results of `compute` in the order of `items`, computed by `jobs` threads.
pub fn in_parallel<T: Sync, R: Send>(jobs: usize, items: &[T], compute: impl Fn(&T) -> R + Sync) -> Vec<R> {
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicUsize, Ordering};
    let next = AtomicUsize::new(0);
    let done: Vec<Mutex<Option<R>>> = items.iter().map(|_| Mutex::new(None)).collect();
    std::thread::scope(|scope| {
        for _ in 0..jobs.clamp(1, items.len().max(1)) {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(index) else { break };
                    let result = compute(item);
                    if let Ok(mut slot) = done[index].lock() {
                        *slot = Some(result);
                    }
                }
            });
        }
    });
    done.into_iter().filter_map(|slot| slot.into_inner().ok().flatten()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_read_back_exactly_and_only_under_its_own_first_line() {
        let table = vec![vec![0.1, -1e-300, f64::INFINITY], vec![1.0 / 3.0]];
        let text = written(&table, "head");
        assert_eq!(parsed(&text, "head"), Some(table));
        assert_eq!(parsed(&text, "another"), None);
        assert_eq!(parsed("head\n1 x\n", "head"), None);
    }

    #[test]
    fn results_keep_the_order_of_their_items() {
        let items: Vec<usize> = (0..50).collect();
        assert_eq!(in_parallel(4, &items, |k| k * k), items.iter().map(|k| k * k).collect::<Vec<_>>());
    }
}
