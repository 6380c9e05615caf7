//! Tables of a run file.

use foldline::model::Model;

/// Columns of a table that are named after items of the model.
pub(crate) struct Columns {
    /// One column per parameter.
    pub(crate) parameters: Vec<String>,
    /// Columns `NAME_min`, `NAME_max` of every state, then of every output.
    pub(crate) ranges: Vec<String>,
}

impl Columns {
    pub(crate) fn new(model: &Model) -> Columns {
        let own: Vec<&str> = POINT_COLUMNS.iter().map(|(name, _)| *name).chain(OTHERS).collect();
        Columns::beside(model, &own)
    }

    /// Columns of a model in a table that also has the columns `fixed`.
    pub(super) fn beside(model: &Model, fixed: &[&str]) -> Columns {
        let mut taken: Vec<String> = fixed.iter().map(|s| s.to_string()).collect();
        let mut unique = |name: String| free_name(name, &mut taken);
        let parameters = model.parameters.iter().map(|p| unique(p.name.clone())).collect();
        let ranged = model.states.iter().map(|s| &s.name).chain(model.outputs.iter().map(|o| &o.name));
        let ranges = ranged.flat_map(|name| [format!("{name}_min"), format!("{name}_max")]).map(&mut unique).collect();
        Columns { parameters, ranges }
    }

    /// Returns all column names in the order of the tables.
    pub(crate) fn names(&self) -> impl Iterator<Item = &String> {
        self.parameters.iter().chain(&self.ranges)
    }
}

/// Returns the name, or `NAME_2`, `NAME_3` and so on if it is taken, and adds it to `taken`.
///
/// Column names in SQLite are case-insensitive: if K is taken, k becomes k_2.
pub(crate) fn free_name(name: String, taken: &mut Vec<String>) -> String {
    let mut candidate = name.clone();
    let mut count = 2;
    while taken.contains(&candidate.to_lowercase()) {
        candidate = format!("{name}_{count}");
        count += 1;
    }
    taken.push(candidate.to_lowercase());
    candidate
}

/// Further names in the two tables of points, and the `rowid` that SQLite adds to every table.
const OTHERS: [&str; 11] = [
    "branch",
    "position",
    "kind",
    "key",
    "unstable_before",
    "unstable_after",
    "error",
    "normal_form",
    "coefficient_count",
    "normal_form_remark",
    "rowid",
];

/// Columns of a point in both tables of points, with their types: first the readable ones, then the exact bytes. Those
/// of profiles, which fill several pages of the file, are last: SQLite reads all pages before a column to get at it.
const POINT_COLUMNS: [(&str, &str); 26] = [
    ("period", "REAL"),
    ("unstable", "INTEGER NOT NULL"),
    ("discretisation", "REAL"),
    ("residual", "REAL"),
    ("trivial_defect", "REAL"),
    ("liouville_defect", "REAL"),
    ("newton", "INTEGER NOT NULL"),
    ("factorisations", "INTEGER NOT NULL"),
    ("rejected", "INTEGER NOT NULL"),
    ("evaluations", "INTEGER NOT NULL DEFAULT 0"),
    ("linearisations", "INTEGER NOT NULL DEFAULT 0"),
    ("spectrum_error", "REAL"),
    ("slope_error", "REAL"),
    ("degree", "INTEGER"),
    ("forcing_periods", "INTEGER NOT NULL DEFAULT 0"),
    ("gain_bytes", "BLOB"),
    ("parameter_bytes", "BLOB NOT NULL"),
    ("spectrum_bytes", "BLOB NOT NULL"),
    ("range_bytes", "BLOB NOT NULL"),
    ("average_bytes", "BLOB"),
    ("scalar_bytes", "BLOB NOT NULL"),
    ("numbers_checksum", "INTEGER"),
    ("solution_checksum", "INTEGER"),
    ("solution_bytes", "BLOB NOT NULL"),
    ("mesh_bytes", "BLOB"),
    ("tangent_bytes", "BLOB NOT NULL"),
];

/// Index of the table of points that holds the quantities of diagrams. SQLite reads them from it, without the rows.
const INDEX: &str = "points_in_diagrams";

/// Returns the statements that create all tables.
pub(super) fn create(columns: &Columns) -> String {
    let shown: String = columns.names().map(|name| format!("{} REAL, ", quoted(name))).collect();
    let of_points = POINT_COLUMNS.map(|(name, kind)| format!("{name} {kind}")).join(", ");
    format!(
        "CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
         CREATE TABLE variables (class TEXT NOT NULL, number INTEGER NOT NULL, name TEXT NOT NULL, unit TEXT NOT NULL,
             description TEXT NOT NULL, PRIMARY KEY (class, number));
         CREATE TABLE branches (branch INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, family TEXT NOT NULL,
             free INTEGER NOT NULL, origin TEXT NOT NULL, origin_name TEXT NOT NULL, origin_kind TEXT,
             origin_parameter REAL, origin_bytes BLOB, held TEXT, follows INTEGER,
             unit REAL NOT NULL, held_unit REAL NOT NULL);
         CREATE TABLE ends (branch INTEGER NOT NULL REFERENCES branches, side INTEGER NOT NULL, code TEXT NOT NULL,
             sentence TEXT NOT NULL, detail TEXT, kind TEXT, count INTEGER, value_bytes BLOB, PRIMARY KEY (branch, side));
         CREATE TABLE points (branch INTEGER NOT NULL REFERENCES branches, position INTEGER NOT NULL, {shown}
             {of_points}, PRIMARY KEY (branch, position));
         CREATE TABLE special_points (branch INTEGER NOT NULL REFERENCES branches, kind TEXT NOT NULL,
             position INTEGER NOT NULL, key BLOB NOT NULL, unstable_before INTEGER NOT NULL,
             unstable_after INTEGER NOT NULL, error REAL, normal_form TEXT, coefficient_count INTEGER,
             normal_form_remark TEXT, {shown}
             {of_points}, PRIMARY KEY (branch, kind, position, key));
         CREATE TABLE notes (branch TEXT NOT NULL, note TEXT NOT NULL, UNIQUE (branch, note));"
    )
}

/// Returns the statement that creates the index of the quantities of diagrams unless it exists.
pub(super) fn index(columns: &Columns) -> String {
    let shown: String = columns.names().map(|name| format!("{}, ", quoted(name))).collect();
    format!("CREATE INDEX IF NOT EXISTS {INDEX} ON points (branch, position, unstable, period, {shown} average_bytes);")
}

/// Returns the statements that upgrade a file from `version` to the next one.
///
/// Version 1 had no curves in two parameters, version 2 no counts of evaluations, version 3 neither checksums nor
/// errors of multipliers, version 4 no ending for an unbounded solution, version 5 neither forced models nor normal
/// forms, version 6 no averages, version 7 no errors of coefficients, version 8 neither units of parameters nor errors
/// of slopes, version 9 no angles.
pub(super) fn upgrade(version: i64) -> &'static str {
    match version {
        1 => "ALTER TABLE branches ADD COLUMN held TEXT; ALTER TABLE branches ADD COLUMN follows INTEGER;",
        2 => {
            "ALTER TABLE points ADD COLUMN evaluations INTEGER NOT NULL DEFAULT 0;
             ALTER TABLE points ADD COLUMN linearisations INTEGER NOT NULL DEFAULT 0;
             ALTER TABLE special_points ADD COLUMN evaluations INTEGER NOT NULL DEFAULT 0;
             ALTER TABLE special_points ADD COLUMN linearisations INTEGER NOT NULL DEFAULT 0;"
        }
        3 => {
            "ALTER TABLE points ADD COLUMN spectrum_error REAL;
             ALTER TABLE points ADD COLUMN numbers_checksum INTEGER;
             ALTER TABLE points ADD COLUMN solution_checksum INTEGER;
             ALTER TABLE special_points ADD COLUMN spectrum_error REAL;
             ALTER TABLE special_points ADD COLUMN numbers_checksum INTEGER;
             ALTER TABLE special_points ADD COLUMN solution_checksum INTEGER;"
        }
        5 => {
            "ALTER TABLE points ADD COLUMN forcing_periods INTEGER NOT NULL DEFAULT 0;
             ALTER TABLE special_points ADD COLUMN forcing_periods INTEGER NOT NULL DEFAULT 0;
             ALTER TABLE special_points ADD COLUMN normal_form TEXT;"
        }
        6 => {
            "ALTER TABLE points ADD COLUMN average_bytes BLOB;
             ALTER TABLE special_points ADD COLUMN average_bytes BLOB;"
        }
        7 => {
            "ALTER TABLE special_points ADD COLUMN coefficient_count INTEGER;
             ALTER TABLE special_points ADD COLUMN normal_form_remark TEXT;"
        }
        8 => {
            "ALTER TABLE branches ADD COLUMN unit REAL NOT NULL DEFAULT 1;
             ALTER TABLE branches ADD COLUMN held_unit REAL NOT NULL DEFAULT 1;
             ALTER TABLE points ADD COLUMN slope_error REAL;
             ALTER TABLE special_points ADD COLUMN slope_error REAL;"
        }
        9 => {
            "ALTER TABLE points ADD COLUMN gain_bytes BLOB;
             ALTER TABLE special_points ADD COLUMN gain_bytes BLOB;"
        }
        _ => "",
    }
}

/// Returns an `INSERT OR REPLACE` statement for the columns `first`, the named columns, and the columns of a point.
pub(super) fn insertion(table: &str, first: &[&str], columns: &Columns) -> String {
    let names: Vec<String> = first
        .iter()
        .map(|s| s.to_string())
        .chain(columns.names().map(|name| quoted(name)))
        .chain(POINT_COLUMNS.iter().map(|(name, _)| name.to_string()))
        .collect();
    let marks = vec!["?"; names.len()].join(", ");
    format!("INSERT OR REPLACE INTO {table} ({}) VALUES ({marks})", names.join(", "))
}

pub(super) fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('"', "\"\""))
}
