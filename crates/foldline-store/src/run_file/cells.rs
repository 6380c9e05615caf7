//! Cells of maps over parameters as rows.
//!
//! **Idea.** A cell is written when it is computed. Its answer is one text, a JSON list of values, motions or points,
//! remark, and values of motions that are absent, as in the folder that Python writes. Numbers are the shortest decimals
//! that read back as the same numbers; those that do not exist are null. Files without the table have no cells.

use super::RunFileError;
use super::bytes::{pack, unpack};
use foldline::diagram::{CellAnswer, CellValue, CellValues, MapCell};
use rusqlite::{Connection, Row, params};
use serde_json::{Value, json};
use std::path::Path;

const TABLE: &str = "CREATE TABLE IF NOT EXISTS map_cells (map TEXT NOT NULL, at_bytes BLOB NOT NULL, answer TEXT,
    failure TEXT, PRIMARY KEY (map, at_bytes));";

/// Writes a cell; the table is created with the first one.
pub(super) fn write(connection: &Connection, cell: &MapCell) -> rusqlite::Result<()> {
    connection.execute_batch(TABLE)?;
    let (answer, failure) = match &cell.answer {
        Ok(answer) => (Some(written(answer).to_string()), None),
        Err(reason) => (None, Some(reason)),
    };
    let mut insert = connection.prepare_cached("INSERT OR REPLACE INTO map_cells VALUES (?, ?, ?, ?)")?;
    insert.execute(params![cell.map, pack(&cell.at), answer, failure]).map(|_| ())
}

/// Loads all cells in the order in which they were written.
pub(super) fn load(connection: &Connection, path: &Path) -> Result<Vec<MapCell>, RunFileError> {
    let failed = |e| RunFileError::from_sqlite(path, e);
    let there = "SELECT count(*) > 0 FROM sqlite_master WHERE type = 'table' AND name = 'map_cells'";
    if !connection.query_row(there, [], |row| row.get::<_, bool>(0)).map_err(failed)? {
        return Ok(Vec::new());
    }
    let mut statement = connection.prepare("SELECT * FROM map_cells ORDER BY rowid").map_err(failed)?;
    let mut rows = statement.query([]).map_err(failed)?;
    let mut found = Vec::new();
    while let Some(row) = rows.next().map_err(failed)? {
        found.push(cell_in(row).map_err(|what| RunFileError::Damaged(path.to_path_buf(), what))?);
    }
    Ok(found)
}

fn cell_in(row: &Row) -> Result<MapCell, String> {
    let bytes = row.get::<_, Vec<u8>>("at_bytes").map_err(|e| e.to_string())?;
    let at = unpack(&bytes).ok_or("at_bytes has a length that is not a multiple of 8")?;
    let text = |name: &str| row.get::<_, Option<String>>(name).map_err(|e| e.to_string());
    let answer = match (text("answer")?, text("failure")?) {
        (Some(answer), _) => {
            let value = serde_json::from_str(&answer).map_err(|error| format!("answer of a map cell: {error}"))?;
            Ok(read(&value).ok_or("the answer of a map cell is not such a list")?)
        }
        (None, Some(reason)) => Err(reason),
        (None, None) => return Err("a map cell has neither an answer nor a failure".into()),
    };
    Ok(MapCell { map: row.get("map").map_err(|e| e.to_string())?, at, answer })
}

/// Values as a list of pairs, which keeps their order.
fn values_written(values: &CellValues) -> Value {
    let pair = |(name, value): &(String, CellValue)| match value {
        // JSON has no NaN; `json!` writes null. A whole number keeps its point, which tells it from a count.
        CellValue::Number(own) => json!([name, own]),
        CellValue::Count(own) => json!([name, own]),
        CellValue::Text(own) => json!([name, own]),
    };
    values.iter().map(pair).collect()
}

fn written(answer: &CellAnswer) -> Value {
    let items: Value = answer.items.iter().map(|(label, values)| json!([label, values_written(values)])).collect();
    json!([values_written(&answer.values), items, answer.remark, values_written(&answer.absent)])
}

fn values_read(value: &Value) -> Option<CellValues> {
    let pair = |pair: &Value| {
        let [name, value] = &pair.as_array()?[..] else { return None };
        let value = match value {
            Value::Null => CellValue::Number(f64::NAN),
            Value::String(text) => CellValue::Text(text.clone()),
            Value::Number(own) => match own.as_i64() {
                Some(count) => CellValue::Count(count),
                None => CellValue::Number(own.as_f64()?),
            },
            _ => return None,
        };
        Some((name.as_str()?.to_string(), value))
    };
    value.as_array()?.iter().map(pair).collect()
}

fn read(value: &Value) -> Option<CellAnswer> {
    let [values, items, remark, absent] = &value.as_array()?[..] else { return None };
    let item = |item: &Value| {
        let [label, values] = &item.as_array()?[..] else { return None };
        Some((label.as_str()?.to_string(), values_read(values)?))
    };
    Some(CellAnswer {
        values: values_read(values)?,
        items: items.as_array()?.iter().map(item).collect::<Option<_>>()?,
        remark: remark.as_str()?.to_string(),
        absent: values_read(absent)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_reads_back_to_the_bit() {
        let number = |value: f64| CellValue::Number(value);
        let names = ["a", "b", "c", "d", "e", "f"].map(str::to_string);
        let all = [number(1.0 / 3.0), number(2.0), number(-0.0), number(6.02e23), CellValue::Count(3), number(5e-324)];
        let values: CellValues = names.into_iter().zip(all).collect();
        let text = ("motions".to_string(), CellValue::Text("2:1 cycle".into()));
        let answer = CellAnswer {
            values: [vec![text], values.clone()].concat(),
            items: vec![("all: fold 1".into(), values)],
            remark: "a \"remark\"".into(),
            absent: Vec::new(),
        };
        let back = read(&serde_json::from_str(&written(&answer).to_string()).unwrap()).unwrap();
        assert_eq!(back, answer);
        assert!(matches!(back.values[3].1, CellValue::Number(zero) if zero.is_sign_negative()));
        // Numbers with all their digits: the bits of a linear congruence.
        let mut bits = 1u64;
        for _ in 0..1000 {
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let value = f64::from_bits(bits >> 2);
            let one = CellAnswer { values: vec![("a".into(), number(value))], ..CellAnswer::default() };
            let back = read(&serde_json::from_str(&written(&one).to_string()).unwrap()).unwrap();
            assert!(value.is_nan() || back == one, "{value:e}");
        }
        let missing = CellAnswer { values: vec![("period".into(), number(f64::NAN))], ..CellAnswer::default() };
        let back = read(&written(&missing)).unwrap();
        assert!(matches!(back.values[0].1, CellValue::Number(value) if value.is_nan()));
    }
}
