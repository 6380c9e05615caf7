//! Names of states and parameters, and the range of the branch, from `c.NAME` or `b.NAME`.
//!
//! **Idea.** Both files have lines such as `parnames = {1: 'p1', 11: 'PERIOD'}`. Everything else is ignored. Files of
//! older versions have no names; the user can give them on the command line instead.

use super::reader::number;

/// Names and range that accompany the solutions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Names {
    /// Number, from 1, and name of each named parameter.
    pub parameters: Vec<(usize, String)>,
    /// Number, from 1, and name of each named state.
    pub states: Vec<(usize, String)>,
    /// RL0 and RL1, the range of the first free parameter.
    pub range: Option<[f64; 2]>,
}

impl Names {
    /// Reads the text of a file `c.NAME` or `b.NAME`.
    pub fn of(text: &str) -> Names {
        let mut names = Names::default();
        let mut range = [None; 2];
        for line in text.lines() {
            let line = line.trim_start().trim_start_matches(|c: char| c == '0' || c.is_ascii_whitespace());
            let Some((key, value)) = line.split_once('=') else { continue };
            match key.trim() {
                "parnames" if names.parameters.is_empty() => names.parameters = dictionary(value),
                "unames" if names.states.is_empty() => names.states = dictionary(value),
                "RL0" => range[0] = value.split_whitespace().next().and_then(number),
                "RL1" => range[1] = value.split_whitespace().next().and_then(number),
                _ => {}
            }
        }
        // The first line of b.NAME is 0, RL0, RL1, A0, A1.
        let first: Vec<&str> = text.lines().next().unwrap_or("").split_whitespace().collect();
        if let ["0", low, high, _, _] = first[..] {
            range = [number(low), number(high)];
        }
        // AUTO writes a missing bound as the largest double.
        let bound = |value: Option<f64>| value.filter(|v| v.abs() < 1e300);
        names.range =
            bound(range[0]).zip(bound(range[1])).map(|(low, high)| [low, high]).filter(|[low, high]| low < high);
        names
    }

    /// Fills missing entries from `other`.
    pub fn or(self, other: Names) -> Names {
        Names {
            parameters: if self.parameters.is_empty() { other.parameters } else { self.parameters },
            states: if self.states.is_empty() { other.states } else { self.states },
            range: self.range.or(other.range),
        }
    }
}

/// Reads `{1: 'a', 2: "b"}`, or `['a', 'b']`, whose entries are numbered from 1.
fn dictionary(text: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut rest = text;
    while let Some(at) = rest.find(['\'', '"']) {
        let quote = if rest.as_bytes()[at] == b'"' { '"' } else { '\'' };
        let Some(length) = rest[at + 1..].find(quote) else { break };
        let digits = rest[..at].trim_end().strip_suffix(':').map(|before| {
            let before = before.trim_end();
            &before[before.trim_end_matches(|c: char| c.is_ascii_digit()).len()..]
        });
        let number = match digits {
            Some(digits) => digits.parse().ok(),
            None => Some(found.len() + 1),
        };
        found.extend(number.filter(|n| *n > 0).map(|n: usize| (n, rest[at + 1..at + 1 + length].to_string())));
        rest = &rest[at + length + 2..];
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_range_of_constants_and_of_branches() {
        let wanted = [(1, "p1".to_string()), (11, "PERIOD".to_string())];
        let constants =
            Names::of("# c\nparnames = {1: 'p1', 11: \"PERIOD\"}\nunames = ['u', 'v']\nRL0 = -1.0\nRL1=2D0\n");
        assert_eq!(constants.parameters, wanted);
        assert_eq!(constants.states, [(1, "u".to_string()), (2, "v".to_string())]);
        assert_eq!(constants.range, Some([-1.0, 2.0]));
        let branch = Names::of(
            "   0   0.0000E+00  4.0000E-01 -1.7976+308  1.7976+308\n   0   parnames = {1: 'p1', 11: 'PERIOD'}\n",
        );
        assert_eq!((branch.parameters, branch.range), (wanted.to_vec(), Some([0.0, 0.4])));
        let open = Names::of("   0  -1.7976+308  1.7976+308 -1.7976+308  1.7976+308\n0 unames = {1 'u', x: 'v', 'w\n");
        assert_eq!((open.range, open.parameters.len()), (None, 0));
    }
}
