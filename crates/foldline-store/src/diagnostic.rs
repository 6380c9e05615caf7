//! What is wrong with an input file: place, cause, cure.

use std::fmt;

/// One mistake in an input file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// The file, as it was named.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// The line of the file, or the part of it around the place.
    pub snippet: String,
    /// How many characters of the snippet stand before the place.
    pub mark: usize,
    /// How many characters of the snippet are meant.
    pub length: usize,
    /// What is wrong.
    pub message: String,
    /// What would be right.
    pub hint: Option<String>,
}

impl Diagnostic {
    /// As a remark, on which nothing is refused.
    pub fn as_note(&self) -> String {
        self.to_string().replacen("error:", "note:", 1)
    }
}

impl fmt::Display for Diagnostic {
    /// In the form that compilers use; the last line has no line end.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let number = self.line.to_string();
        let margin = " ".repeat(number.len());
        writeln!(f, "error: {}", self.message)?;
        write!(f, "{margin}--> {}:{}:{}", self.file, self.line, self.column)?;
        if !self.snippet.is_empty() {
            // Tabs are kept in front of the mark, so that it stands under its place however wide they are shown.
            let before = self.snippet.chars().take(self.mark);
            let indent: String = before.map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
            let marks = "^".repeat(self.length.max(1));
            write!(f, "\n{margin} |\n{number} | {}\n{margin} | {indent}{marks}", self.snippet)?;
        }
        if let Some(hint) = &self.hint {
            write!(f, "\n{margin} = help: {hint}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Diagnostic {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mark_stands_under_the_place() {
        let diagnostic = Diagnostic {
            file: "rotor.toml".into(),
            line: 12,
            column: 6,
            snippet: "\tx = \"tahn(u)\"".into(),
            mark: 5,
            length: 4,
            message: "there is no function `tahn`".into(),
            hint: Some("did you mean `tanh`?".into()),
        };
        let text = diagnostic.to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "error: there is no function `tahn`");
        assert_eq!(lines[1], "  --> rotor.toml:12:6");
        assert_eq!(lines[3], "12 | \tx = \"tahn(u)\"");
        assert_eq!(lines[4], "   | \t    ^^^^");
        assert_eq!(lines[5], "   = help: did you mean `tanh`?");
    }
}
