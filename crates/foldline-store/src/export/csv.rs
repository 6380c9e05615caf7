//! Comma-separated values.

use super::cells::Cell;
use super::columns::Column;
use super::tables::Rows;
use super::{ExportError, Growing};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

struct Csv {
    growing: Growing,
    out: BufWriter<File>,
    line: String,
}

/// Begins the table `name` in a folder.
pub(super) fn begin(folder: &Path, name: &str, columns: &[Column]) -> Result<Box<dyn Rows>, ExportError> {
    let (growing, file) = Growing::create(&folder.join(format!("{name}.csv")))?;
    let mut csv = Csv { growing, out: BufWriter::new(file), line: String::new() };
    csv.row(&columns.iter().map(|column| Cell::Text(column.name.clone())).collect::<Vec<Cell>>())?;
    Ok(Box::new(csv))
}

impl Rows for Csv {
    fn row(&mut self, cells: &[Cell]) -> Result<(), ExportError> {
        use std::fmt::Write;
        self.line.clear();
        for (k, cell) in cells.iter().enumerate() {
            if k > 0 {
                self.line.push(',');
            }
            match cell {
                Cell::Empty => {}
                Cell::Text(text) if text.contains([',', '"', '\n', '\r']) => {
                    self.line.push('"');
                    self.line.push_str(&text.replace('"', "\"\""));
                    self.line.push('"');
                }
                Cell::Text(text) => self.line.push_str(text),
                // Writing to a string cannot fail. `{:?}` gives the shortest decimal that reads back as the same
                // number.
                Cell::Integer(value) => drop(write!(self.line, "{value}")),
                Cell::Real(value) => drop(write!(self.line, "{value:?}")),
            }
        }
        self.line.push('\n');
        self.out.write_all(self.line.as_bytes()).map_err(|error| self.growing.failed(error))
    }

    fn finish(mut self: Box<Self>) -> Result<PathBuf, ExportError> {
        self.out.flush().map_err(|error| self.growing.failed(error))?;
        let Csv { growing, out, .. } = *self;
        drop(out);
        growing.finish()
    }
}
