//! A table as text, CSV or JSON.

use super::{Cell, Style, Table};
use num_complex::Complex64;
use std::io::{Result, Write};

const DIGITS: i32 = 10;

/// Writes aligned columns under their names, leaving out empty ones.
pub fn text(table: &Table, out: &mut impl Write) -> Result<()> {
    if table.rows.is_empty() {
        return writeln!(out, "none");
    }
    let mut lines = vec![String::new(); table.rows.len() + 1];
    for (index, column) in table.columns.iter().enumerate() {
        let cells: Vec<&Cell> = table.rows.iter().map(|row| &row[index]).collect();
        let empty = cells.iter().all(|cell| matches!(cell, Cell::Empty));
        if empty || column.style == Style::Exact || column.style == Style::Varying && constant(&cells) {
            continue;
        }
        let decimals = decimals(&cells);
        let texts: Vec<String> = cells.iter().map(|cell| shown(cell, column.style, decimals)).collect();
        let head = column.head();
        let all = || std::iter::once(&head).chain(&texts);
        let width = all().map(|text| text.chars().count()).max().unwrap_or(0);
        for (line, text) in lines.iter_mut().zip(all()) {
            if !line.is_empty() {
                line.push_str("  ");
            }
            let room = " ".repeat(width - text.chars().count());
            let (before, after) = if column.style == Style::Word { ("", room.as_str()) } else { (room.as_str(), "") };
            line.push_str(&format!("{before}{text}{after}"));
        }
    }
    lines.iter().try_for_each(|line| writeln!(out, "{}", line.trim_end()))
}

/// True if all cells are the same number.
fn constant(cells: &[&Cell]) -> bool {
    let number = |cell: &Cell| if let Cell::Number(v) = cell { Some(v.to_bits()) } else { None };
    cells.windows(2).all(|pair| number(pair[0]) == number(pair[1]))
}

/// Number of decimals that gives the largest number of a column ten significant digits; `None` if powers of ten are
/// needed.
fn decimals(cells: &[&Cell]) -> Option<usize> {
    let size = |cell: &&Cell| if let Cell::Number(v) = cell { Some(v.abs()) } else { None };
    let largest = cells.iter().filter_map(size).filter(|v| v.is_finite()).fold(0.0, f64::max);
    if largest == 0.0 {
        return Some(0);
    }
    let digits = largest.log10().floor() as i32 + 1;
    (-2..DIGITS).contains(&digits).then(|| (DIGITS - digits.max(1)).clamp(0, DIGITS) as usize)
}

fn shown(cell: &Cell, style: Style, decimals: Option<usize>) -> String {
    match (cell, style, decimals) {
        (Cell::Empty, ..) => "·".to_string(),
        (Cell::Word(word), ..) => word.lines().next().unwrap_or_default().to_string(),
        (Cell::Count(count), ..) => count.to_string(),
        (Cell::Number(value), _, None) | (Cell::Number(value), Style::Size, _) if *value == 0.0 => "0".to_string(),
        (Cell::Number(value), Style::Size, _) => format!("{value:.1e}"),
        (Cell::Number(value), Style::Share, _) => without_sign_of_zero(format!("{value:.4}")),
        (Cell::Number(value), _, Some(decimals)) => without_sign_of_zero(format!("{value:.decimals$}")),
        (Cell::Number(value), _, None) => format!("{value:.9e}"),
        (Cell::Spectrum(values), ..) => {
            let one =
                |z: &Complex64| if z.im == 0.0 { format!("{:.6}", z.re) } else { format!("{:.6}{:+.6}i", z.re, z.im) };
            values.iter().map(one).collect::<Vec<_>>().join(" ")
        }
    }
}

/// Writes a number that rounds to zero without its minus sign.
fn without_sign_of_zero(text: String) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_string(),
        _ => text,
    }
}

/// Writes comma-separated values (RFC 4180) in full precision. A spectrum is one cell: its numbers as `re+imj`,
/// separated by spaces, as Python's `complex` reads them.
pub fn csv(table: &Table, out: &mut impl Write) -> Result<()> {
    let names: Vec<String> = table.columns.iter().map(|c| quoted(&c.name)).collect();
    writeln!(out, "{}", names.join(","))?;
    for row in &table.rows {
        let cells: Vec<String> = row.iter().map(|cell| quoted(&exact(cell))).collect();
        writeln!(out, "{}", cells.join(","))?;
    }
    Ok(())
}

fn exact(cell: &Cell) -> String {
    match cell {
        Cell::Empty => String::new(),
        Cell::Word(word) => word.replace('\n', "; "),
        Cell::Count(count) => count.to_string(),
        // Shortest decimal that reads back as the same number, with an exponent if it would be long.
        Cell::Number(value) => format!("{value:?}"),
        Cell::Spectrum(values) => {
            let one =
                |z: &Complex64| format!("{:?}{}{:?}j", z.re, if z.im.is_sign_negative() { "" } else { "+" }, z.im);
            values.iter().map(one).collect::<Vec<_>>().join(" ")
        }
    }
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_string() }
}

/// Writes a list of objects. A spectrum is a list of pairs `[re, im]`; non-finite numbers are null.
pub fn json(table: &Table, out: &mut impl Write) -> Result<()> {
    writeln!(out, "[")?;
    for (k, row) in table.rows.iter().enumerate() {
        let cells: Vec<String> = table
            .columns
            .iter()
            .zip(row)
            .map(|(column, cell)| format!("{}: {}", serde_json::Value::from(column.name.as_str()), value(cell)))
            .collect();
        let comma = if k + 1 < table.rows.len() { "," } else { "" };
        writeln!(out, "  {{{}}}{comma}", cells.join(", "))?;
    }
    writeln!(out, "]")
}

fn value(cell: &Cell) -> serde_json::Value {
    match cell {
        Cell::Empty => serde_json::Value::Null,
        Cell::Word(word) => word.as_str().into(),
        Cell::Count(count) => (*count).into(),
        Cell::Number(value) => (*value).into(),
        Cell::Spectrum(values) => values.iter().map(|z| serde_json::json!([z.re, z.im])).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Column;
    use super::*;

    fn table() -> Table {
        let column = Column::new;
        let columns = vec![
            column("branch", Style::Word),
            column("K", Style::Varying),
            column("Omega", Style::Varying),
            column("error", Style::Size),
            column("multipliers", Style::Word),
        ];
        let spectrum = vec![Complex64::new(1.0, 0.0), Complex64::new(-0.5, -1e-9)];
        let row = |name: &str, omega: f64| {
            let numbers = [150.0, omega, 1.5e-9].map(Cell::Number);
            let mut row = vec![Cell::Word(name.into())];
            row.extend(numbers);
            row.push(Cell::Spectrum(spectrum.clone()));
            row
        };
        Table { columns, rows: vec![row("contact SL", 10.34061714), row("a \"b\", c", 1.0 / 3.0)] }
    }

    fn written(format: impl Fn(&Table, &mut Vec<u8>) -> Result<()>) -> String {
        let mut out = Vec::new();
        format(&table(), &mut out).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn text_is_aligned_and_omits_constant_columns() {
        let expected = "branch            Omega   error  multipliers\n\
                        contact SL  10.34061714  1.5e-9  1.000000 -0.500000-0.000000i\n\
                        a \"b\", c     0.33333333  1.5e-9  1.000000 -0.500000-0.000000i\n";
        assert_eq!(written(text), expected);
    }

    #[test]
    fn a_cell_of_several_lines_shows_only_the_first_in_text_and_all_in_csv() {
        let mut table = table();
        table.rows[0][0] = Cell::Word("it ended\nlikely cause: a cusp".into());
        let (mut short, mut long) = (Vec::new(), Vec::new());
        text(&table, &mut short).unwrap();
        csv(&table, &mut long).unwrap();
        let [short, long] = [short, long].map(|bytes| String::from_utf8(bytes).unwrap());
        assert!(short.contains("it ended ") && !short.contains("likely"), "{short}");
        assert!(long.contains("it ended; likely cause: a cusp,"), "{long}");
    }

    #[test]
    fn zero_among_powers_of_ten_is_a_plain_zero() {
        let columns = vec![Column::in_unit("x_max", Style::Number, "m"), Column::new("error", Style::Size)];
        let rows = [1e-12, 0.0].map(|x| vec![Cell::Number(x), Cell::Number(0.0)]);
        let mut out = Vec::new();
        text(&Table { columns, rows: rows.into() }, &mut out).unwrap();
        let expected = "      x_max [m]  error\n1.000000000e-12      0\n              0      0\n";
        assert_eq!(String::from_utf8(out).unwrap(), expected);
    }

    #[test]
    fn csv_keeps_every_digit_and_quotes_what_needs_it() {
        let expected = "branch,K,Omega,error,multipliers\n\
                        contact SL,150.0,10.34061714,1.5e-9,1.0+0.0j -0.5-1e-9j\n\
                        \"a \"\"b\"\", c\",150.0,0.3333333333333333,1.5e-9,1.0+0.0j -0.5-1e-9j\n";
        assert_eq!(written(csv), expected);
    }

    #[test]
    fn json_is_a_list_of_objects() {
        let parsed: serde_json::Value = serde_json::from_str(&written(json)).unwrap();
        assert_eq!(parsed[1]["branch"], "a \"b\", c");
        assert_eq!(parsed[0]["Omega"], 10.34061714);
        assert_eq!(parsed[0]["multipliers"][1][1], -1e-9);
    }
}
