//! Constants files of AUTO: `KEY = value` with numbers, texts, lists and dictionaries.

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Constant {
    Number(f64),
    Text(String),
    List(Vec<Constant>),
    Pairs(Vec<(Constant, Constant)>),
}

impl Constant {
    pub(super) fn number(&self) -> Option<f64> {
        match self {
            Constant::Number(value) => Some(*value),
            _ => None,
        }
    }

    /// The entries of a list, or the single value.
    pub(super) fn all(&self) -> Vec<Constant> {
        match self {
            Constant::List(all) => all.clone(),
            other => vec![other.clone()],
        }
    }
}

/// The constants of a file, in order.
#[derive(Clone, Debug, Default)]
pub(super) struct Constants(Vec<(String, Constant)>);

impl Constants {
    /// Reads the text of a file; what is not an assignment is skipped.
    pub(super) fn of(text: &str) -> Constants {
        let plain: Vec<&str> = text.lines().map(|line| line.split(['#', '!']).next().unwrap_or("")).collect();
        let text: Vec<char> = plain.join("\n").chars().collect();
        let mut own = Reader { text, at: 0 };
        let mut found = Vec::new();
        while own.at < own.text.len() {
            let word = own.word();
            if word.is_empty() {
                own.at += 1;
                continue;
            }
            own.space();
            if own.take('=')
                && let Some(value) = own.value()
            {
                found.push((word, value));
            }
        }
        Constants(found)
    }

    /// The last value of a key.
    pub(super) fn get(&self, key: &str) -> Option<&Constant> {
        self.0.iter().rev().find(|(own, _)| own == key).map(|(_, value)| value)
    }

    pub(super) fn number(&self, key: &str) -> Option<f64> {
        self.get(key)?.number()
    }

    /// A whole number, or the default.
    pub(super) fn whole(&self, key: &str, default: i64) -> i64 {
        self.number(key).map_or(default, |value| value as i64)
    }

    /// Names of numbered things: `{1: 'a'}` or `['a', 'b']`.
    pub(super) fn names(&self, key: &str) -> Vec<(usize, String)> {
        match self.get(key) {
            Some(Constant::Pairs(all)) => {
                let pair = |(key, value): &(Constant, Constant)| match (key, value) {
                    (Constant::Number(n), Constant::Text(name)) if *n >= 1.0 => Some((*n as usize, name.clone())),
                    _ => None,
                };
                all.iter().filter_map(pair).collect()
            }
            Some(Constant::List(all)) => {
                let name = |(k, own): (usize, &Constant)| match own {
                    Constant::Text(name) => Some((k + 1, name.clone())),
                    _ => None,
                };
                all.iter().enumerate().filter_map(name).collect()
            }
            _ => Vec::new(),
        }
    }
}

struct Reader {
    text: Vec<char>,
    at: usize,
}

impl Reader {
    fn space(&mut self) {
        while self.text.get(self.at).is_some_and(|c| c.is_whitespace()) {
            self.at += 1;
        }
    }

    fn take(&mut self, sign: char) -> bool {
        self.space();
        let is = self.text.get(self.at) == Some(&sign);
        self.at += usize::from(is);
        is
    }

    fn while_true(&mut self, is: impl Fn(char) -> bool) -> String {
        let from = self.at;
        while self.text.get(self.at).is_some_and(|c| is(*c)) {
            self.at += 1;
        }
        self.text[from..self.at].iter().collect()
    }

    fn word(&mut self) -> String {
        if !self.text.get(self.at).is_some_and(|c| c.is_ascii_alphabetic()) {
            return String::new();
        }
        self.while_true(|c| c.is_ascii_alphanumeric() || c == '_')
    }

    fn value(&mut self) -> Option<Constant> {
        self.space();
        let here = *self.text.get(self.at)?;
        if here == '\'' || here == '"' {
            self.at += 1;
            let text = self.while_true(|c| c != here);
            self.at += 1;
            return Some(Constant::Text(text));
        }
        if self.take('[') {
            let mut all = Vec::new();
            while !self.take(']') {
                all.push(self.value()?);
                self.take(',');
            }
            return Some(Constant::List(all));
        }
        if self.take('{') {
            let mut all = Vec::new();
            while !self.take('}') {
                let key = self.value()?;
                if !self.take(':') {
                    return None;
                }
                all.push((key, self.value()?));
                self.take(',');
            }
            return Some(Constant::Pairs(all));
        }
        let word = self.while_true(|c| c.is_ascii_alphanumeric() || "+-._".contains(c));
        if word.is_empty() {
            return None;
        }
        let number = word.replace(['d', 'D'], "e").parse().ok().filter(|value: &f64| value.is_finite());
        Some(number.map_or(Constant::Text(word), Constant::Number))
    }
}
