//! Reference numbers.

/// Row of the table.
pub struct Row {
    pub id: String,
    pub model: String,
    pub at: String,
    pub quantity: String,
    value: f64,
    tolerance: f64,
}

impl Row {
    /// Fails if a value differs by more than the tolerance.
    pub fn compare(&self, found: f64) {
        let error = (found / self.value - 1.0).abs();
        assert!(error < self.tolerance, "{}: {found} instead of {}: {error:.1e}", self.id, self.value);
    }
}

/// All rows.
pub fn rows() -> Vec<Row> {
    let lines = include_str!("fe_linear.csv").lines().filter(|line| !line.starts_with('#')).skip(1);
    lines.map(row).collect()
}

fn row(line: &str) -> Row {
    let (mut cells, mut quoted) = (vec![String::new()], false);
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            _ => cells.last_mut().unwrap().push(c),
        }
    }
    let [id, model, at, quantity, value, _, tolerance] = <[String; 7]>::try_from(cells).unwrap();
    Row { id, model, at, quantity, value: value.parse().unwrap(), tolerance: tolerance.parse().unwrap() }
}
