//! Results of surveys and sweeps as rows.
//!
//! **Idea.** A set is written in one transaction when it is complete. Files of earlier versions lack the tables or some
//! columns. These are added when such a run is resumed; a reader treats missing tables and columns as empty.

use super::RunFileError;
use super::bytes::{pack, pack_pairs, unpack, unpack_pairs};
use super::schema::{Columns, quoted};
use foldline::diagram::{Motion, Recognition, Response, Responses, Search, Share};
use foldline::model::Model;
use rusqlite::types::Value;
use rusqlite::{Connection, Row, params, params_from_iter};
use std::path::Path;

const FIRST: [&str; 15] = [
    "response_set",
    "number",
    "value",
    "motion",
    "period",
    "ratio_first",
    "ratio_second",
    "multiplicity",
    "hits",
    "settled_after",
    "error",
    "uniform_hits",
    "uniform_starts",
    "jumped",
    "rowid",
];
/// Columns added later: integers, the bytes of iterates, or NULL.
const LATER: [&str; 6] =
    ["uniform_hits", "uniform_starts", "jumped", "iterate_bytes", "recognition_bytes", "undecided"];
const LAST: [&str; 7] = [
    "parameter_bytes",
    "state_bytes",
    "range_bytes",
    "scalar_bytes",
    "iterate_bytes",
    "recognition_bytes",
    "undecided",
];

fn columns(model: &Model) -> Columns {
    Columns::beside(model, &FIRST.into_iter().chain(LAST).collect::<Vec<_>>())
}

/// Creates missing tables and missing columns.
pub(super) fn create(connection: &Connection, model: &Model) -> rusqlite::Result<()> {
    connection.execute_batch(&tables(model))?;
    let mut statement = connection.prepare("SELECT name FROM pragma_table_info('responses')")?;
    let known: Vec<String> = statement.query_map([], |row| row.get(0))?.collect::<Result<_, _>>()?;
    LATER
        .iter()
        .filter(|name| !known.iter().any(|own| own == *name))
        .try_for_each(|name| connection.execute_batch(&format!("ALTER TABLE responses ADD COLUMN {name}")))
}

fn tables(model: &Model) -> String {
    let shown: String = columns(model).names().map(|name| format!("{} REAL, ", quoted(name))).collect();
    format!(
        "CREATE TABLE IF NOT EXISTS response_sets (response_set INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE,
             search TEXT NOT NULL, free INTEGER NOT NULL);
         CREATE TABLE IF NOT EXISTS responses (response_set INTEGER NOT NULL REFERENCES response_sets,
             number INTEGER NOT NULL, value REAL, motion TEXT NOT NULL, period REAL, ratio_first INTEGER,
             ratio_second INTEGER, multiplicity INTEGER NOT NULL, hits INTEGER NOT NULL, settled_after REAL, error REAL,
             uniform_hits INTEGER, uniform_starts INTEGER, jumped INTEGER,
             {shown}
             parameter_bytes BLOB NOT NULL, state_bytes BLOB NOT NULL, range_bytes BLOB NOT NULL,
             scalar_bytes BLOB NOT NULL, iterate_bytes BLOB, recognition_bytes BLOB, undecided TEXT,
             PRIMARY KEY (response_set, number));"
    )
}

/// Returns the statement that inserts a response.
pub(super) fn insert(model: &Model) -> String {
    let columns = columns(model);
    let shown: Vec<String> = columns.names().map(|name| quoted(name)).collect();
    let fixed = |names: &[&str]| names.iter().map(|s| s.to_string()).collect::<Vec<_>>();
    let names = [fixed(&FIRST[..FIRST.len() - 1]), shown, fixed(&LAST)].concat();
    let marks = vec!["?"; names.len()].join(", ");
    format!("INSERT OR REPLACE INTO responses ({}) VALUES ({marks})", names.join(", "))
}

/// Writes a complete set.
pub(super) fn write(connection: &mut Connection, sql: &str, set: &Responses, shown: usize) -> rusqlite::Result<()> {
    let transaction = connection.transaction()?;
    transaction.execute(
        "INSERT INTO response_sets (name, search, free) VALUES (?1, ?2, ?3)
         ON CONFLICT (name) DO UPDATE SET search = ?2, free = ?3",
        params![set.name, set.search.name(), set.free as i64],
    )?;
    let query = "SELECT response_set FROM response_sets WHERE name = ?";
    let number: i64 = transaction.query_row(query, [&set.name], |row| row.get(0))?;
    transaction.execute("DELETE FROM responses WHERE response_set = ?", [number])?;
    for (k, response) in set.responses.iter().enumerate() {
        let first = [Value::Integer(number), Value::Integer(k as i64)];
        let values = first.into_iter().chain(values_of(response, shown));
        transaction.prepare_cached(sql)?.execute(params_from_iter(values))?;
    }
    transaction.commit()
}

/// Values of a row. `shown` is the number of columns of parameters and extremes; missing extremes are NULL.
fn values_of(response: &Response, shown: usize) -> Vec<Value> {
    let (first, second) = response.ratio.unzip();
    let integer = |value: Option<u32>| value.map_or(Value::Null, |v| Value::Integer(v.into()));
    let whole =
        |value: Option<usize>| value.map_or(Value::Null, |v| Value::Integer(i64::try_from(v).unwrap_or(i64::MAX)));
    let mut values = vec![
        Value::Real(response.value),
        Value::Text(response.motion.name().to_string()),
        response.period.map_or(Value::Null, Value::Real),
        integer(first),
        integer(second),
        integer(Some(response.multiplicity)),
        whole(Some(response.hits)),
        Value::Real(response.settled_after),
        Value::Real(response.error),
        whole(response.share.map(|share| share.hits)),
        whole(response.share.map(|share| share.of)),
        whole(response.jumped.map(usize::from)),
    ];
    let numbers = response.parameters.iter().chain(response.ranges.as_flattened()).map(|v| Value::Real(*v));
    values.extend(numbers.chain(std::iter::repeat(Value::Null)).take(shown));
    let scalars = [response.value, response.period.unwrap_or(0.0), response.settled_after, response.error];
    values.extend([
        Value::Blob(pack(&response.parameters)),
        Value::Blob(pack(&response.state)),
        Value::Blob(pack_pairs(&response.ranges)),
        Value::Blob(pack(&scalars)),
        if response.iterates.is_empty() { Value::Null } else { Value::Blob(pack(&response.iterates)) },
    ]);
    values.extend(recognition_values(&response.recognition));
    values
}

/// ρ and λ, each with its error and NaN if it is missing, and the number of periods; then the reason.
fn recognition_values(own: &Recognition) -> [Value; 2] {
    if *own == Recognition::default() {
        return [Value::Null, Value::Null];
    }
    let [rotation, exponent] = [own.rotation, own.exponent].map(|pair| pair.unwrap_or([f64::NAN; 2]));
    let numbers = [&rotation[..], &exponent, &[own.returns as f64]].concat();
    [Value::Blob(pack(&numbers)), Value::Text(own.reason.clone())]
}

/// Inverse of [`recognition_values`]; empty in files of earlier versions.
fn recognition_in(row: &Row) -> Result<Recognition, String> {
    let bytes = match row.get::<_, Option<Vec<u8>>>("recognition_bytes") {
        Err(rusqlite::Error::InvalidColumnName(_)) => None,
        other => other.map_err(|e| e.to_string())?,
    };
    let Some(bytes) = bytes else { return Ok(Recognition::default()) };
    let numbers = unpack(&bytes).ok_or("recognition_bytes has a length that is not a multiple of 8")?;
    let [rotation, doubt, exponent, error, returns] = numbers[..] else {
        return Err("recognition_bytes does not have five numbers".to_string());
    };
    let pair = |value: f64, error: f64| (!value.is_nan()).then_some([value, error]);
    let reason = row.get::<_, Option<String>>("undecided").map_err(|e| e.to_string())?.unwrap_or_default();
    Ok(Recognition {
        rotation: pair(rotation, doubt),
        exponent: pair(exponent, error),
        returns: returns as usize,
        reason,
    })
}

/// Loads all sets in the order in which they were completed.
pub(super) fn load(connection: &Connection, path: &Path) -> Result<Vec<Responses>, RunFileError> {
    let failed = |e| RunFileError::from_sqlite(path, e);
    let damaged = |what: String| RunFileError::Damaged(path.to_path_buf(), what);
    let there = "SELECT count(*) > 0 FROM sqlite_master WHERE type = 'table' AND name = 'responses'";
    if !connection.query_row(there, [], |row| row.get::<_, bool>(0)).map_err(failed)? {
        return Ok(Vec::new());
    }
    let mut statement = connection.prepare("SELECT * FROM response_sets ORDER BY response_set").map_err(failed)?;
    let mut rows = statement.query([]).map_err(failed)?;
    let mut sets = Vec::new();
    while let Some(row) = rows.next().map_err(failed)? {
        let (number, mut set) = set_in(row).map_err(&damaged)?;
        let mut statement = connection
            .prepare_cached("SELECT * FROM responses WHERE response_set = ? ORDER BY number")
            .map_err(failed)?;
        let mut rows = statement.query([number]).map_err(failed)?;
        while let Some(row) = rows.next().map_err(failed)? {
            set.responses.push(response_in(row).map_err(&damaged)?);
        }
        sets.push(set);
    }
    Ok(sets)
}

fn set_in(row: &Row) -> Result<(i64, Responses), String> {
    let text = |name: &str| row.get::<_, String>(name).map_err(|e| e.to_string());
    let search = text("search")?;
    let free: i64 = row.get("free").map_err(|e| e.to_string())?;
    let set = Responses {
        name: text("name")?,
        search: Search::from_name(&search).ok_or_else(|| format!("unknown search \"{search}\""))?,
        free: usize::try_from(free).map_err(|e| e.to_string())?,
        responses: Vec::new(),
    };
    Ok((row.get("response_set").map_err(|e| e.to_string())?, set))
}

fn response_in(row: &Row) -> Result<Response, String> {
    let blob = |name: &str| row.get::<_, Vec<u8>>(name).map_err(|e| e.to_string());
    let numbers =
        |name: &str| unpack(&blob(name)?).ok_or_else(|| format!("{name} has a length that is not a multiple of 8"));
    let count = |name: &str| row.get::<_, Option<u32>>(name).map_err(|e| e.to_string());
    // Columns added in later versions may be missing.
    let later = |name: &str| match row.get::<_, Option<i64>>(name) {
        Err(rusqlite::Error::InvalidColumnName(_)) => Ok(None),
        Err(error) => Err(error.to_string()),
        Ok(value) => value.map(|v| usize::try_from(v).map_err(|_| format!("{name} is not a count"))).transpose(),
    };
    let share = later("uniform_hits")?.zip(later("uniform_starts")?).map(|(hits, of)| Share { hits, of });
    let motion: String = row.get("motion").map_err(|e| e.to_string())?;
    let [value, period, settled_after, error] = numbers("scalar_bytes")?[..] else {
        return Err("scalar_bytes of a response does not have four numbers".to_string());
    };
    let motion = Motion::from_name(&motion).ok_or_else(|| format!("unknown motion \"{motion}\""))?;
    let has_period = row.get::<_, Option<f64>>("period").map_err(|e| e.to_string())?.is_some();
    Ok(Response {
        value,
        parameters: numbers("parameter_bytes")?,
        motion,
        period: has_period.then_some(period),
        ratio: count("ratio_first")?.zip(count("ratio_second")?),
        multiplicity: count("multiplicity")?.unwrap_or(1),
        ranges: unpack_pairs(&blob("range_bytes")?).ok_or("range_bytes is not a list of pairs")?,
        hits: row.get::<_, i64>("hits").ok().and_then(|n| usize::try_from(n).ok()).ok_or("hits is not a count")?,
        share,
        jumped: later("jumped")?.map(|jumped| jumped != 0),
        state: numbers("state_bytes")?,
        settled_after,
        error,
        iterates: match row.get::<_, Option<Vec<u8>>>("iterate_bytes") {
            Err(rusqlite::Error::InvalidColumnName(_)) => Vec::new(),
            other => {
                let bytes = other.map_err(|e| e.to_string())?.unwrap_or_default();
                unpack(&bytes).ok_or("iterate_bytes has a length that is not a multiple of 8")?
            }
        },
        recognition: recognition_in(row)?,
    })
}
