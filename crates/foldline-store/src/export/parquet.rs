//! Parquet files.
//!
//! **Idea.** A row group is written once it holds [`CELLS`] cells. Nothing is compressed; columns use the dictionary
//! encoding of the library's defaults.

use super::cells::Cell;
use super::columns::{Class, Column};
use super::tables::Rows;
use super::{ExportError, Growing};
use parquet::basic::{ConvertedType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{Type, TypePtr};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Number of cells of a row group.
const CELLS: usize = 1_000_000;

struct Parquet {
    growing: Growing,
    writer: SerializedFileWriter<File>,
    columns: Vec<Values>,
    rows: usize,
}

/// Column of the current row group: definition levels (0 for an empty cell, 1 for a value) and the values present.
struct Values {
    there: Vec<i16>,
    values: Typed,
}

enum Typed {
    Text(Vec<ByteArray>),
    Integer(Vec<i64>),
    Real(Vec<f64>),
}

/// Begins the table `name` in a folder.
pub(super) fn begin(folder: &Path, name: &str, columns: &[Column]) -> Result<Box<dyn Rows>, ExportError> {
    let (growing, file) = Growing::create(&folder.join(format!("{name}.parquet")))?;
    let made = schema(columns)
        .and_then(|schema| SerializedFileWriter::new(file, schema, Arc::new(WriterProperties::builder().build())));
    let writer = made.map_err(|error| growing.failed(outside(error)))?;
    let values = |column: &Column| Values {
        there: Vec::new(),
        values: match column.class {
            Class::Text => Typed::Text(Vec::new()),
            Class::Integer => Typed::Integer(Vec::new()),
            Class::Real => Typed::Real(Vec::new()),
        },
    };
    Ok(Box::new(Parquet { growing, writer, columns: columns.iter().map(values).collect(), rows: 0 }))
}

fn schema(columns: &[Column]) -> Result<TypePtr, ParquetError> {
    let field = |column: &Column| {
        let (physical, converted) = match column.class {
            Class::Text => (Physical::BYTE_ARRAY, ConvertedType::UTF8),
            Class::Integer => (Physical::INT64, ConvertedType::NONE),
            Class::Real => (Physical::DOUBLE, ConvertedType::NONE),
        };
        let field = Type::primitive_type_builder(&column.name, physical).with_repetition(Repetition::OPTIONAL);
        field.with_converted_type(converted).build().map(Arc::new)
    };
    let fields = columns.iter().map(field).collect::<Result<Vec<_>, _>>()?;
    Type::group_type_builder("foldline").with_fields(fields).build().map(Arc::new)
}

fn outside(error: ParquetError) -> std::io::Error {
    std::io::Error::other(error.to_string())
}

impl Parquet {
    fn flush(&mut self) -> Result<(), ParquetError> {
        if self.rows == 0 {
            return Ok(());
        }
        let mut group = self.writer.next_row_group()?;
        for column in &mut self.columns {
            let Some(mut writer) = group.next_column()? else { break };
            let there = Some(&column.there[..]);
            match &mut column.values {
                Typed::Text(values) => {
                    writer.typed::<ByteArrayType>().write_batch(values, there, None)?;
                    values.clear();
                }
                Typed::Integer(values) => {
                    writer.typed::<Int64Type>().write_batch(values, there, None)?;
                    values.clear();
                }
                Typed::Real(values) => {
                    writer.typed::<DoubleType>().write_batch(values, there, None)?;
                    values.clear();
                }
            }
            column.there.clear();
            writer.close()?;
        }
        group.close()?;
        self.rows = 0;
        Ok(())
    }
}

impl Rows for Parquet {
    fn row(&mut self, cells: &[Cell]) -> Result<(), ExportError> {
        for (column, cell) in self.columns.iter_mut().zip(cells) {
            let there = match (&mut column.values, cell) {
                (Typed::Text(values), Cell::Text(text)) => {
                    values.push(text.as_bytes().to_vec().into());
                    1
                }
                (Typed::Integer(values), Cell::Integer(value)) => {
                    values.push(*value);
                    1
                }
                (Typed::Real(values), Cell::Real(value)) => {
                    values.push(*value);
                    1
                }
                _ => 0,
            };
            column.there.push(there);
        }
        self.rows += 1;
        if self.rows * self.columns.len() < CELLS {
            return Ok(());
        }
        self.flush().map_err(|error| self.growing.failed(outside(error)))
    }

    fn finish(mut self: Box<Self>) -> Result<PathBuf, ExportError> {
        let done = self.flush().and_then(|()| self.writer.finish().map(drop));
        done.map_err(|error| self.growing.failed(outside(error)))?;
        let Parquet { growing, writer, .. } = *self;
        drop(writer);
        growing.finish()
    }
}
