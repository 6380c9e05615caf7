//! Mistakes in input files: position, cause and cure.

use std::fmt;

/// One mistake in an input file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// File name as the user gave it.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Line of the file, or the part of it around the mistake.
    pub snippet: String,
    /// Number of characters of the snippet before the mistake.
    pub mark: usize,
    /// Number of characters of the snippet that are marked.
    pub length: usize,
    /// The mistake.
    pub message: String,
    /// Suggested correction.
    pub hint: Option<String>,
}

impl Diagnostic {
    /// Formats the diagnostic as a note; a note does not reject the file.
    pub fn as_note(&self) -> String {
        self.to_string().replacen("error:", "note:", 1)
    }
}

impl fmt::Display for Diagnostic {
    /// Formats the diagnostic as compilers do, without a trailing newline.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let number = self.line.to_string();
        let margin = " ".repeat(number.len());
        writeln!(f, "error: {}", self.message)?;
        write!(f, "{margin}--> {}:{}:{}", self.file, self.line, self.column)?;
        if !self.snippet.is_empty() {
            // Tabs are kept in front of the mark, so that it lines up whatever the tab width.
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
    fn the_mark_is_printed_under_the_mistake() {
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
