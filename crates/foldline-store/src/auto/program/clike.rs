//! C statements of AUTO's equations files.

use super::syntax::{Line, Routine, SIMPLER, Statement, Stop, Token, Tokens, X, stop, tokens};

const TYPES: [&str; 8] = ["double", "doublereal", "integer", "int", "real", "float", "const", "static"];

/// Tokens of a file with their lines, without comments and lines of the preprocessor.
fn all_tokens(text: &str) -> Result<Vec<(usize, Token)>, Stop> {
    let mut plain = String::new();
    let mut rest = text;
    while let Some(at) = rest.find("/*") {
        plain.push_str(&rest[..at]);
        let end = rest[at..].find("*/").map_or(rest.len(), |end| at + end + 2);
        plain.extend(rest[at..end].chars().filter(|c| *c == '\n'));
        plain.push(' ');
        rest = &rest[end..];
    }
    plain.push_str(rest);
    let mut found = Vec::new();
    for (number, line) in plain.lines().enumerate() {
        let line = line.split("//").next().unwrap_or("");
        if line.trim_start().starts_with('#') {
            continue;
        }
        let line = line.replace(['{', '}'], " \u{1} ").chars().collect::<String>();
        // Braces and semicolons delimit; they are tokens of their own.
        let original = plain.lines().nth(number).unwrap_or("").split("//").next().unwrap_or("");
        let braces: Vec<char> = original.chars().filter(|c| "{}".contains(*c)).collect();
        let mut next = braces.into_iter();
        for (k, part) in line.split('\u{1}').enumerate() {
            if k > 0 {
                found.push((number + 1, Token::Sign(if next.next() == Some('{') { "{" } else { "}" })));
            }
            for (j, piece) in part.split(';').enumerate() {
                if j > 0 {
                    found.push((number + 1, Token::Sign(";")));
                }
                found.extend(tokens(piece, number + 1, true)?.into_iter().map(|token| (number + 1, token)));
            }
        }
    }
    Ok(found)
}

struct Reader {
    list: Vec<Token>,
    lines: Vec<usize>,
    at: usize,
}

impl Reader {
    fn line(&self) -> usize {
        self.lines.get(self.at).or(self.lines.last()).copied().unwrap_or(1)
    }

    fn is(&self, sign: &str) -> bool {
        matches!(self.list.get(self.at), Some(Token::Sign(own)) if *own == sign)
    }

    fn take(&mut self, sign: &str) -> bool {
        let is = self.is(sign);
        self.at += usize::from(is);
        is
    }

    fn word(&self) -> Option<&str> {
        match self.list.get(self.at) {
            Some(Token::Word(word)) => Some(word),
            _ => None,
        }
    }

    /// Reads with the reader of expressions.
    fn with<T>(&mut self, read: impl FnOnce(&mut Tokens) -> Result<T, Stop>) -> Result<T, Stop> {
        let mut own = Tokens { list: &self.list, at: self.at, line: self.line(), c: true };
        let found = read(&mut own)?;
        self.at = own.at;
        Ok(found)
    }

    /// Skips to the closing brace that belongs to an open one just read.
    fn skip(&mut self) {
        let mut open = 1;
        while open > 0 && self.at < self.list.len() {
            open += i32::from(self.is("{")) - i32::from(self.is("}"));
            self.at += 1;
        }
    }

    /// Reads a statement or a block.
    fn block(&mut self) -> Result<Vec<Line>, Stop> {
        if !self.take("{") {
            return self.statement();
        }
        let mut body = Vec::new();
        while !self.take("}") {
            if self.at >= self.list.len() {
                return stop(self.line(), "a brace is not closed", "add `}`");
            }
            body.extend(self.statement()?);
        }
        Ok(body)
    }

    fn statement(&mut self) -> Result<Vec<Line>, Stop> {
        let number = self.line();
        let one = |what: Statement| Ok(vec![Line { number, what }]);
        if self.take(";") {
            return Ok(Vec::new());
        }
        if self.is("{") {
            return self.block();
        }
        match self.word().unwrap_or("").to_string().as_str() {
            "return" => {
                while !self.take(";") && self.at < self.list.len() {
                    self.at += 1;
                }
                one(Statement::Return)
            }
            "if" => {
                self.at += 1;
                let condition = self.with(|own| own.need("(").and_then(|()| own.expression(0)))?;
                self.take(")");
                let mut parts = vec![(Some(condition), self.block()?)];
                if self.word() == Some("else") {
                    self.at += 1;
                    parts.push((None, self.block()?));
                }
                one(Statement::If(parts))
            }
            "for" => self.counted(number),
            "extern" | "struct" => {
                while !self.is(";") && !self.is("{") && self.at < self.list.len() {
                    self.at += 1;
                }
                if self.take("{") {
                    self.skip();
                }
                Ok(Vec::new())
            }
            word if TYPES.contains(&word) => self.declarations(number),
            "while" | "do" | "switch" | "goto" => {
                let word = self.word().unwrap_or("").to_string();
                stop(number, format!("`{word}` is not translated"), SIMPLER)
            }
            _ => self.assignments(number),
        }
    }

    /// `a = b = expression;`, `a += expression;` or a call.
    fn assignments(&mut self, number: usize) -> Result<Vec<Line>, Stop> {
        let mut targets = Vec::new();
        loop {
            let before = self.at;
            let (name, places) = self.with(|own| own.place())?;
            let operator = ["=", "+=", "-=", "*="].into_iter().find(|sign| self.take(sign));
            match operator {
                Some("=") => targets.push((name, places.unwrap_or_default())),
                Some(sign) => {
                    let right = self.with(|own| own.expression(0))?;
                    let old = places.clone().map_or(X::Name(name.clone()), |own| X::Of(name.clone(), own));
                    let sign = match sign {
                        "+=" => "+",
                        "-=" => "-",
                        _ => "*",
                    };
                    self.take(";");
                    let what = Statement::Assign(
                        name,
                        places.unwrap_or_default(),
                        X::Binary(sign, Box::new(old), Box::new(right)),
                    );
                    return Ok(vec![Line { number, what }]);
                }
                None if targets.is_empty() && places.is_some() && self.is(";") => {
                    self.at += 1;
                    return Ok(vec![Line { number, what: Statement::Call(name, places.unwrap_or_default()) }]);
                }
                None => {
                    self.at = before;
                    break;
                }
            }
        }
        if targets.is_empty() {
            return stop(number, "this statement is not understood", SIMPLER);
        }
        let value = self.with(|own| own.expression(0))?;
        if !self.take(";") {
            return stop(number, "the end of this statement is not understood", SIMPLER);
        }
        let line = |(name, places)| Line { number, what: Statement::Assign(name, places, value.clone()) };
        Ok(targets.into_iter().rev().map(line).collect())
    }

    /// `for (i = 0; i < n; ++i)`.
    fn counted(&mut self, number: usize) -> Result<Vec<Line>, Stop> {
        self.at += 1;
        let unknown = || stop(number, "only loops such as `for (i = 0; i < n; ++i)` are translated", SIMPLER);
        let head = self.with(|own| {
            own.need("(")?;
            let name = own.word().unwrap_or_default();
            own.need("=")?;
            Ok((name, own.expression(0)?))
        })?;
        self.take(";");
        let condition = self.with(|own| own.expression(0))?;
        self.take(";");
        while !self.take(")") && self.at < self.list.len() {
            self.at += 1;
        }
        let (name, from) = head;
        let to = match condition {
            X::Binary("<", left, right) if *left == X::Name(name.clone()) => {
                X::Binary("-", right, Box::new(X::Number(1.0, true)))
            }
            X::Binary("<=", left, right) if *left == X::Name(name.clone()) => *right,
            _ => return unknown(),
        };
        let body = self.block()?;
        Ok(vec![Line { number, what: Statement::Do(name, from, to, None, body) }])
    }

    fn declarations(&mut self, number: usize) -> Result<Vec<Line>, Stop> {
        let mut integer = false;
        while let Some(word) = self.word().filter(|word| TYPES.contains(word)) {
            integer |= word == "int" || word == "integer";
            self.at += 1;
        }
        let mut found = Vec::new();
        while !self.take(";") && self.at < self.list.len() {
            self.take("*");
            let Some(name) = self.word().map(str::to_string) else {
                self.at += 1;
                continue;
            };
            self.at += 1;
            let mut bounds = Vec::new();
            while self.take("[") {
                bounds.push((None, self.with(|own| own.expression(0))?));
                self.take("]");
            }
            let value = if self.take("=") { Some(self.with(|own| own.expression(0))?) } else { None };
            found.push(Line { number, what: Statement::Declare(name, bounds, value, Some(integer)) });
            self.take(",");
        }
        Ok(found)
    }
}

/// Reads the functions of a file.
pub(super) fn routines(text: &str) -> Result<Vec<Routine>, Stop> {
    let (lines, list) = all_tokens(text)?.into_iter().unzip();
    let mut own = Reader { list, lines, at: 0 };
    let mut found = Vec::new();
    while own.at < own.list.len() {
        // A function: a name, arguments in brackets, and a brace.
        let name = own.word().map(str::to_string);
        let line = own.line();
        own.at += 1;
        if own.is("{") {
            own.at += 1;
            own.skip();
            continue;
        }
        let (Some(name), true) = (name, own.is("(")) else { continue };
        let mut arguments = Vec::new();
        let mut last = None;
        while own.at < own.list.len() && !own.is(")") {
            if own.is(",") {
                arguments.extend(last.take());
            }
            last = own.word().map(str::to_string).or(last);
            own.at += 1;
        }
        arguments.extend(last);
        own.at += 1;
        if !own.is("{") {
            continue;
        }
        let body = own.block()?;
        found.push(Routine { name, line, arguments, body });
    }
    Ok(found)
}
