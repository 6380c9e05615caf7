//! Answers in the cells of maps over parameters.

/// A value of a cell.
#[derive(Clone, Debug, PartialEq)]
pub enum CellValue {
    /// A number; NaN if it does not exist.
    Number(f64),
    /// A whole number.
    Count(i64),
    /// A text.
    Text(String),
}

/// Values with their names, in the order in which they are shown.
pub type CellValues = Vec<(String, CellValue)>;

/// Answer in a cell of a map over parameters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CellAnswer {
    /// Values of the cell. The first text among them is its category.
    pub values: CellValues,
    /// Label of each motion or special point found in the cell, with its values.
    pub items: Vec<(String, CellValues)>,
    /// Remark on shortfalls; empty if there are none.
    pub remark: String,
    /// Values of a motion that was not found in the cell.
    pub absent: CellValues,
}

impl CellAnswer {
    /// Name and text that say what is found in the cell: refinement looks for its changes.
    pub fn category(&self) -> Option<(&str, &str)> {
        self.values.iter().find_map(|(name, value)| match value {
            CellValue::Text(text) => Some((name.as_str(), text.as_str())),
            CellValue::Number(_) | CellValue::Count(_) => None,
        })
    }
}

/// A computed cell of a map over parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct MapCell {
    /// Name of the map.
    pub map: String,
    /// `[q]` values of the parameters of the map.
    pub at: Vec<f64>,
    /// The answer, or the reason why there is none.
    pub answer: Result<CellAnswer, String>,
}
