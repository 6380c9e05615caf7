//! Statements and expressions of AUTO's equations files.
//!
//! **Idea.** Fortran (free and fixed form) and C are read into one small language: assignments, calls, conditions, counted loops
//! and returns. Indices of C, from 0, become those of Fortran, from 1. Declarations matter only where they give a value or a
//! shape.

/// A mistake or a construct that is not translated: line, message, cure.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stop {
    pub(super) line: usize,
    pub(super) message: String,
    pub(super) hint: String,
}

pub(super) fn stop<T>(line: usize, message: impl Into<String>, hint: impl Into<String>) -> Result<T, Stop> {
    Err(Stop { line, message: message.into(), hint: hint.into() })
}

/// An expression.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum X {
    /// A number, and true if it is an integer.
    Number(f64, bool),
    Logical(bool),
    Text(String),
    Name(String),
    /// An element or section of an array, or a function of arguments.
    Of(String, Vec<Place>),
    List(Vec<X>),
    Unary(&'static str, Box<X>),
    Binary(&'static str, Box<X>, Box<X>),
}

/// An index, an argument, or a range of indices.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Place {
    At(X),
    Range(Option<X>, Option<X>),
}

/// A statement with the line on which it begins.
#[derive(Clone, Debug)]
pub(super) struct Line {
    pub(super) number: usize,
    pub(super) what: Statement,
}

#[derive(Clone, Debug)]
pub(super) enum Statement {
    Assign(String, Vec<Place>, X),
    Call(String, Vec<Place>),
    /// Conditions, of which the first that holds decides, with their statements; the last part may have no condition.
    If(Vec<(Option<X>, Vec<Line>)>),
    Do(String, X, X, Option<X>, Vec<Line>),
    /// A name declared, with lower and upper bounds of its indices, a value, and its type if it has one: true for an integer.
    Declare(String, Vec<(Option<X>, X)>, Option<X>, Option<bool>),
    Return,
    /// A statement that is not understood.
    Other(String),
}

/// A subroutine or function.
#[derive(Clone, Debug)]
pub(super) struct Routine {
    pub(super) name: String,
    pub(super) line: usize,
    pub(super) arguments: Vec<String>,
    pub(super) body: Vec<Line>,
}

/// A token.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token {
    Word(String),
    Number(f64, bool),
    Text(String),
    Sign(&'static str),
}

const SIGNS: [&str; 34] = [
    "**", "==", "/=", "!=", "<=", ">=", "&&", "||", "(/", "/)", "::", "=>", "+=", "-=", "*=", "++", "--", "->", "+",
    "-", "*", "/", "(", ")", ",", "=", "<", ">", ":", "[", "]", "%", "!", ".",
];
const DOTTED: [(&str, &str); 10] = [
    (".eq.", "=="),
    (".ne.", "!="),
    (".lt.", "<"),
    (".le.", "<="),
    (".gt.", ">"),
    (".ge.", ">="),
    (".and.", "&&"),
    (".or.", "||"),
    (".not.", "!"),
    (".true.", ".true."),
];

/// Tokens of a statement in lower case. `c` is true for C, which has no `(/` and `/=` as an inequality.
pub(super) fn tokens(text: &str, line: usize, c: bool) -> Result<Vec<Token>, Stop> {
    let text: Vec<char> = text.chars().collect();
    let mut found = Vec::new();
    let mut at = 0;
    while at < text.len() {
        let here = text[at];
        let rest: String = text[at..text.len().min(at + 8)].iter().collect::<String>().to_lowercase();
        if here.is_whitespace() {
            at += 1;
        } else if here.is_ascii_digit() || (here == '.' && text.get(at + 1).is_some_and(char::is_ascii_digit)) {
            let (value, whole, length) = number(&text[at..], line)?;
            found.push(Token::Number(value, whole));
            at += length;
        } else if here.is_ascii_alphabetic() || here == '_' {
            let length = text[at..].iter().take_while(|c| c.is_ascii_alphanumeric() || **c == '_').count();
            found.push(Token::Word(text[at..at + length].iter().collect::<String>().to_lowercase()));
            at += length;
        } else if here == '\'' || here == '"' {
            let length = text[at + 1..].iter().take_while(|c| **c != here).count();
            found.push(Token::Text(text[at + 1..at + 1 + length].iter().collect()));
            at += length + 2;
        } else if let Some((dotted, sign)) = DOTTED.iter().find(|(dotted, _)| !c && rest.starts_with(dotted)) {
            found.push(Token::Sign(sign));
            at += dotted.len();
        } else if !c && rest.starts_with(".false.") {
            found.push(Token::Sign(".false."));
            at += 7;
        } else {
            let fits = |sign: &&&str| rest.starts_with(**sign) && !(c && matches!(**sign, "(/" | "/)" | "/=" | "**"));
            let Some(sign) = SIGNS.iter().find(fits) else {
                return stop(
                    line,
                    format!("the character `{here}` is not understood"),
                    "write the statement in another way",
                );
            };
            at += sign.len();
            found.push(Token::Sign(if *sign == "/=" { "!=" } else { sign }));
        }
    }
    Ok(found)
}

/// Reads a number: its value, true if it is an integer, and its length.
fn number(text: &[char], line: usize) -> Result<(f64, bool, usize), Stop> {
    let digits = |from: usize| text[from.min(text.len())..].iter().take_while(|c| c.is_ascii_digit()).count();
    let mut length = digits(0);
    let mut whole = true;
    // `1.eq.2`: the point belongs to the operator.
    let operator = || {
        let word: String = text[length + 1..].iter().take_while(|c| c.is_ascii_alphabetic()).collect();
        word.len() > 1 && text.get(length + 1 + word.len()) == Some(&'.')
    };
    if text.get(length) == Some(&'.') && !operator() {
        length += 1 + digits(length + 1);
        whole = false;
    }
    if text.get(length).is_some_and(|c| "eEdD".contains(*c)) {
        let sign = usize::from(text.get(length + 1).is_some_and(|c| "+-".contains(*c)));
        if digits(length + 1 + sign) > 0 {
            length += 1 + sign + digits(length + 1 + sign);
            whole = false;
        }
    }
    let own: String = text[..length].iter().map(|c| if "dD".contains(*c) { 'e' } else { *c }).collect();
    // A kind (`1.0_dp`) or a suffix of C.
    if text.get(length) == Some(&'_') {
        length += 1 + text[length + 1..].iter().take_while(|c| c.is_ascii_alphanumeric() || **c == '_').count();
    }
    match own.parse::<f64>() {
        Ok(value) => Ok((value, whole, length)),
        Err(_) => stop(line, format!("\"{own}\" is not a number"), "correct the number"),
    }
}

/// Reader of the tokens of a statement.
pub(super) struct Tokens<'t> {
    pub(super) list: &'t [Token],
    pub(super) at: usize,
    pub(super) line: usize,
    /// C: indices from 0 in square brackets.
    pub(super) c: bool,
}

impl Tokens<'_> {
    pub(super) fn sign(&mut self, sign: &str) -> bool {
        let is = matches!(self.list.get(self.at), Some(Token::Sign(own)) if *own == sign);
        self.at += usize::from(is);
        is
    }

    pub(super) fn word(&mut self) -> Option<String> {
        let Some(Token::Word(word)) = self.list.get(self.at) else { return None };
        self.at += 1;
        Some(word.clone())
    }

    pub(super) fn need(&mut self, sign: &str) -> Result<(), Stop> {
        match self.sign(sign) {
            true => Ok(()),
            false => stop(self.line, format!("`{sign}` is missing here, or the statement is not understood"), SIMPLER),
        }
    }

    pub(super) fn done(&self) -> bool {
        self.at >= self.list.len()
    }

    /// Reads an expression; `level` is the tightness of the operators around it.
    pub(super) fn expression(&mut self, level: usize) -> Result<X, Stop> {
        const LEVELS: [&[&str]; 5] = [&["||"], &["&&"], &["==", "!=", "<", "<=", ">", ">="], &["+", "-"], &["*", "/"]];
        if level == LEVELS.len() {
            return self.power();
        }
        if level == 2 && self.sign("!") {
            return Ok(X::Unary("!", Box::new(self.expression(level)?)));
        }
        // A leading sign binds as loosely as a sum.
        let mut left = match level {
            3 if self.sign("-") => X::Unary("-", Box::new(self.expression(4)?)),
            3 if self.sign("+") => self.expression(4)?,
            _ => self.expression(level + 1)?,
        };
        while let Some(sign) = LEVELS[level].iter().find(|sign| self.sign(sign)) {
            let right = match self.sign("-") {
                true => X::Unary("-", Box::new(self.expression(level.max(4))?)),
                false => self.expression(level + 1)?,
            };
            left = X::Binary(sign, Box::new(left), Box::new(right));
        }
        Ok(left)
    }

    fn power(&mut self) -> Result<X, Stop> {
        if self.c && self.sign("-") {
            return Ok(X::Unary("-", Box::new(self.power()?)));
        }
        let base = self.atom()?;
        if !self.sign("**") {
            return Ok(base);
        }
        let exponent = match self.sign("-") {
            true => X::Unary("-", Box::new(self.power()?)),
            false => {
                self.sign("+");
                self.power()?
            }
        };
        Ok(X::Binary("**", Box::new(base), Box::new(exponent)))
    }

    fn atom(&mut self) -> Result<X, Stop> {
        if self.sign("(/") || (!self.c && self.sign("[")) {
            let mut all = Vec::new();
            while !self.sign("/)") && !self.sign("]") {
                all.push(self.expression(0)?);
                self.sign(",");
                if self.done() {
                    return stop(self.line, "the list is not closed", "write `(/ … /)` in one statement");
                }
            }
            return Ok(X::List(all));
        }
        if self.sign("(") {
            // A cast of C, such as `(doublereal)`.
            if let (true, Some(Token::Word(word)), Some(Token::Sign(")"))) =
                (self.c, self.list.get(self.at), self.list.get(self.at + 1))
                && ["double", "doublereal", "integer", "int", "real"].contains(&word.as_str())
            {
                self.at += 2;
                return self.power();
            }
            let inner = self.expression(0)?;
            self.need(")")?;
            return Ok(inner);
        }
        if self.sign(".true.") {
            return Ok(X::Logical(true));
        }
        if self.sign(".false.") {
            return Ok(X::Logical(false));
        }
        match self.list.get(self.at).cloned() {
            Some(Token::Number(value, whole)) => {
                self.at += 1;
                Ok(X::Number(value, whole))
            }
            Some(Token::Text(text)) => {
                self.at += 1;
                Ok(X::Text(text))
            }
            Some(Token::Word(_)) => {
                let (name, places) = self.place()?;
                Ok(if let Some(places) = places { X::Of(name, places) } else { X::Name(name) })
            }
            _ => stop(self.line, "an expression is not understood here", SIMPLER),
        }
    }

    /// Reads a name with its indices or arguments, if there are any.
    pub(super) fn place(&mut self) -> Result<(String, Option<Vec<Place>>), Stop> {
        let mut name = self.word().unwrap_or_default();
        // Members of a structure are known by their own names.
        while self.sign(".") || self.sign("->") || self.sign("%") {
            name = self.word().unwrap_or_default();
        }
        if self.c && self.sign("[") {
            let index = self.expression(0)?;
            self.need("]")?;
            let next = X::Binary("+", Box::new(index), Box::new(X::Number(1.0, true)));
            return Ok((name, Some(vec![Place::At(next)])));
        }
        if !self.sign("(") {
            return Ok((name, None));
        }
        Ok((name, Some(self.places(")")?)))
    }

    /// Reads indices or arguments up to a closing sign.
    pub(super) fn places(&mut self, close: &str) -> Result<Vec<Place>, Stop> {
        let mut all = Vec::new();
        while !self.sign(close) {
            let next = self.list.get(self.at + 1);
            let unknown = matches!(self.list.get(self.at), Some(Token::Sign("*")))
                && matches!(next, Some(Token::Sign("," | ")")));
            let first = match self.list.get(self.at) {
                _ if unknown => {
                    self.at += 1;
                    Some(X::Name("*".into()))
                }
                Some(Token::Sign(":")) => None,
                _ => Some(self.expression(0)?),
            };
            if self.sign(":") {
                let ends = matches!(self.list.get(self.at), Some(Token::Sign("," | ")")));
                all.push(Place::Range(first, if ends { None } else { Some(self.expression(0)?) }));
            } else if let Some(first) = first {
                all.push(Place::At(first));
            }
            if !self.sign(",") && !matches!(self.list.get(self.at), Some(Token::Sign(own)) if *own == close) {
                return stop(self.line, "the indices or arguments are not understood", SIMPLER);
            }
        }
        Ok(all)
    }
}

pub(super) const SIMPLER: &str = "write it as plain assignments, or write the model by hand";
