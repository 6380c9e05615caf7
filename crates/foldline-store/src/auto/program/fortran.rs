//! Fortran statements of AUTO's equations files.

use super::syntax::{Line, Place, Routine, SIMPLER, Statement, Stop, Token, Tokens, X, stop, tokens};

/// Words with which declarations begin.
const TYPES: [&str; 8] = ["double", "integer", "real", "logical", "dimension", "character", "complex", "parameter"];

/// Statements of a file in one line each, without comments, with their line numbers.
fn statements(text: &str, fixed: bool) -> Vec<(usize, String)> {
    let mut all: Vec<(usize, String)> = Vec::new();
    let mut open = false;
    for (number, line) in text.lines().enumerate() {
        if fixed && line.starts_with(['C', 'c', '*', '!']) {
            continue;
        }
        let mut own = uncommented(line).trim_end().to_string();
        let continued = if fixed {
            own.len() > 5 && own.is_char_boundary(5) && own[..5].trim().is_empty() && !matches!(&own[5..6], " " | "0")
        } else {
            open
        };
        if fixed && continued {
            own.replace_range(5..6, " ");
        }
        if own.trim().is_empty() {
            continue;
        }
        let mut own = own.trim().to_string();
        if let Some(rest) = own.strip_prefix('&') {
            own = rest.to_string();
        }
        open = !fixed && own.ends_with('&');
        let own = own.trim_end_matches('&').to_string();
        match all.last_mut().filter(|_| continued) {
            Some((_, before)) => {
                before.push(' ');
                before.push_str(&own);
            }
            None => all.push((number + 1, own)),
        }
    }
    let split = |(number, text): (usize, String)| {
        text.split(';')
            .map(|part| (number, part.trim().to_string()))
            .filter(|(_, part)| !part.is_empty())
            .collect::<Vec<_>>()
    };
    all.into_iter().flat_map(split).collect()
}

/// The line before its comment.
fn uncommented(line: &str) -> &str {
    let mut quote = None;
    for (at, c) in line.char_indices() {
        match (quote, c) {
            (None, '!') => return &line[..at],
            (None, '\'' | '"') => quote = Some(c),
            (Some(own), c) if own == c => quote = None,
            _ => {}
        }
    }
    line
}

/// Reads the subroutines and functions of a file.
pub(super) fn routines(text: &str, fixed: bool) -> Result<Vec<Routine>, Stop> {
    let all = statements(text, fixed);
    let mut at = 0;
    let mut found = Vec::new();
    while at < all.len() {
        let (number, text) = &all[at];
        at += 1;
        let lower = text.to_lowercase();
        let words: Vec<&str> =
            lower.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).filter(|w| !w.is_empty()).collect();
        let Some(place) = words.iter().position(|word| *word == "subroutine" || *word == "function") else { continue };
        if words[0] == "end" || lower.contains('=') || place > 3 {
            continue;
        }
        let name = words.get(place + 1).copied().unwrap_or_default().to_string();
        let arguments = lower.split_once('(').map_or("", |(_, rest)| rest.split(')').next().unwrap_or(""));
        let arguments = arguments.split(',').map(|own| own.trim().to_string()).filter(|own| !own.is_empty()).collect();
        let mut depth = Vec::new();
        let body = block(&all, &mut at, &mut depth)?;
        found.push(Routine { name, line: *number, arguments, body });
    }
    Ok(found)
}

/// True if the statement ends a block or begins its next part.
fn ends(lower: &str) -> bool {
    let packed: String = lower.chars().filter(|c| !c.is_whitespace()).collect();
    packed == "end"
        || ["endif", "enddo", "else", "endsubroutine", "endfunction", "contains", "endprogram", "endmodule"]
            .iter()
            .any(|word| packed.starts_with(word) && !packed.contains('='))
}

/// Reads statements up to one that ends the block, which is not consumed inside another block.
fn block(all: &[(usize, String)], at: &mut usize, depth: &mut Vec<&'static str>) -> Result<Vec<Line>, Stop> {
    let mut body = Vec::new();
    while let Some((number, text)) = all.get(*at) {
        let lower = text.to_lowercase();
        if ends(&lower) {
            *at += usize::from(depth.is_empty());
            break;
        }
        *at += 1;
        let number = *number;
        let list = match tokens(text, number, false) {
            Ok(list) => list,
            Err(_) => {
                body.push(Line { number, what: Statement::Other(text.clone()) });
                continue;
            }
        };
        body.extend(statement(&list, number, text, all, at, depth)?.into_iter().map(|what| Line { number, what }));
    }
    Ok(body)
}

fn statement(
    list: &[Token],
    line: usize,
    text: &str,
    all: &[(usize, String)],
    at: &mut usize,
    depth: &mut Vec<&'static str>,
) -> Result<Vec<Statement>, Stop> {
    let mut own = Tokens { list, at: 0, line, c: false };
    let first = match list.first() {
        Some(Token::Word(word)) => word.as_str(),
        // A label.
        Some(Token::Number(..)) => return statement(&list[1..], line, text, all, at, depth),
        _ => return Ok(vec![Statement::Other(text.to_string())]),
    };
    let assigned = matches!(list.get(1), Some(Token::Sign("="))) || is_element(list);
    if first == "if" && matches!(list.get(1), Some(Token::Sign("("))) && !assigned {
        own.at = 2;
        let condition = own.expression(0)?;
        own.need(")")?;
        if own.word().as_deref() != Some("then") {
            own.at -= usize::from(matches!(list.get(own.at - 1), Some(Token::Word(_))));
            let inner = statement(&list[own.at..], line, text, all, at, depth)?;
            let inner = inner.into_iter().map(|what| Line { number: line, what }).collect();
            return Ok(vec![Statement::If(vec![(Some(condition), inner)])]);
        }
        return branches(condition, line, all, at, depth).map(|own| vec![own]);
    }
    if first == "do" && !assigned {
        own.at = 1;
        if matches!(list.get(1), Some(Token::Number(..))) {
            return stop(line, "loops that end at a label are not translated", "end the loop with ENDDO");
        }
        let Some(name) = own.word() else { return Ok(vec![Statement::Other(text.to_string())]) };
        if !own.sign("=") {
            return stop(line, "only counted loops are translated", SIMPLER);
        }
        let from = own.expression(0)?;
        own.need(",")?;
        let to = own.expression(0)?;
        let step = if own.sign(",") { Some(own.expression(0)?) } else { None };
        depth.push("do");
        let inner = block(all, at, depth)?;
        depth.pop();
        *at += 1;
        return Ok(vec![Statement::Do(name, from, to, step, inner)]);
    }
    if assigned {
        let (name, places) = own.place()?;
        own.need("=")?;
        let value = own.expression(0)?;
        if !own.done() {
            return stop(line, "the end of this statement is not understood", SIMPLER);
        }
        return Ok(vec![Statement::Assign(name, places.unwrap_or_default(), value)]);
    }
    match first {
        "call" => {
            own.at = 1;
            let (name, places) = own.place()?;
            Ok(vec![Statement::Call(name, places.unwrap_or_default())])
        }
        "return" => Ok(vec![Statement::Return]),
        "implicit" | "use" | "save" | "external" | "intrinsic" | "common" | "include" | "continue" | "intent" => {
            Ok(Vec::new())
        }
        _ if TYPES.contains(&first) => declarations(own, text),
        _ => Ok(vec![Statement::Other(text.to_string())]),
    }
}

/// True for `name(…) =`.
fn is_element(list: &[Token]) -> bool {
    if !matches!(list.get(1), Some(Token::Sign("("))) {
        return false;
    }
    let mut open = 0usize;
    for (at, token) in list.iter().enumerate().skip(1) {
        match token {
            Token::Sign("(" | "(/") => open += 1,
            Token::Sign(")" | "/)") => open = open.saturating_sub(1),
            _ => {}
        }
        if open == 0 {
            return matches!(list.get(at + 1), Some(Token::Sign("=")));
        }
    }
    false
}

fn branches(
    condition: X,
    line: usize,
    all: &[(usize, String)],
    at: &mut usize,
    depth: &mut Vec<&'static str>,
) -> Result<Statement, Stop> {
    let mut parts = Vec::new();
    let mut condition = Some(condition);
    depth.push("if");
    loop {
        let inner = block(all, at, depth)?;
        parts.push((condition.take(), inner));
        let Some((number, text)) = all.get(*at) else { return stop(line, "this IF is not closed", "add ENDIF") };
        *at += 1;
        let packed: String = text.to_lowercase().chars().filter(|c| !c.is_whitespace()).collect();
        if packed.starts_with("elseif") {
            let list = tokens(text, *number, false)?;
            let open = list.iter().position(|own| *own == Token::Sign("(")).unwrap_or(0);
            let mut own = Tokens { list: &list, at: open + 1, line: *number, c: false };
            condition = Some(own.expression(0)?);
        } else if packed != "else" {
            break;
        }
    }
    depth.pop();
    Ok(Statement::If(parts))
}

/// Reads a declaration, such as `DOUBLE PRECISION, PARAMETER :: pi = 3.14d0, a(3)`.
fn declarations(mut own: Tokens, text: &str) -> Result<Vec<Statement>, Stop> {
    let parameter = matches!(own.list.first(), Some(Token::Word(word)) if word == "parameter");
    let colons = own.list.iter().position(|token| *token == Token::Sign("::"));
    // A dimension that all of the names have.
    let mut common = Vec::new();
    if let Some(end) = colons {
        if let Some(at) = own.list[..end].iter().position(|token| *token == Token::Word("dimension".into())) {
            own.at = at + 1;
            if own.sign("(") {
                common = shape(own.places(")")?);
            }
        }
        own.at = end + 1;
    } else if parameter {
        own.at = 1;
        if !own.sign("(") {
            return Ok(vec![Statement::Other(text.to_string())]);
        }
    } else {
        own.at = 1;
        if matches!(own.list.get(1), Some(Token::Word(word)) if word == "precision") {
            own.at = 2;
        }
        // `REAL*8`, `CHARACTER(LEN=4)`.
        if own.sign("*") {
            own.at += 1;
        } else if own.sign("(") {
            while !own.done() && !own.sign(")") {
                own.at += 1;
            }
        }
    }
    let integer = match own.list.first() {
        Some(Token::Word(word)) if word == "integer" => Some(true),
        Some(Token::Word(word)) if word == "double" || word == "real" => Some(false),
        _ => None,
    };
    let mut found = Vec::new();
    while !(own.done() || parameter && own.sign(")")) {
        let Some(name) = own.word() else { return Ok(vec![Statement::Other(text.to_string())]) };
        let bounds = if own.sign("(") { shape(own.places(")")?) } else { common.clone() };
        let value = if own.sign("=") { Some(own.expression(0)?) } else { None };
        found.push(Statement::Declare(name, bounds, value, integer));
        own.sign(",");
    }
    Ok(found)
}

fn shape(places: Vec<Place>) -> Vec<(Option<X>, X)> {
    let unknown = X::Name("*".into());
    places
        .into_iter()
        .map(|place| match place {
            Place::At(to) => (None, to),
            Place::Range(from, to) => (from, to.unwrap_or_else(|| unknown.clone())),
        })
        .collect()
}

/// Line of the first number that Fortran rounds to single precision and so changes, and how many there are.
pub(super) fn rounded(text: &str) -> Option<(usize, usize)> {
    let mut found = None;
    for (number, line) in statements(text, false) {
        let all: Vec<char> = line.chars().collect();
        let mut at = 0;
        while at < all.len() {
            let length = all[at..].iter().take_while(|c| c.is_ascii_alphanumeric() || **c == '_' || **c == '.').count();
            let word: String = all[at..at + length].iter().collect();
            // The sign of an exponent.
            let next = all.get(at + length).filter(|c| "+-".contains(**c) && word.ends_with(['e', 'E']));
            let digits: String = next.map_or(String::new(), |sign| {
                let rest = all[at + length + 1..].iter().take_while(|c| c.is_ascii_digit()).collect::<String>();
                format!("{sign}{rest}")
            });
            let whole = format!("{word}{digits}");
            let single = whole.starts_with(|c: char| c.is_ascii_digit() || c == '.') && whole.contains(['.', 'e', 'E']);
            if let (true, Ok(value)) = (single, whole.parse::<f64>())
                && f64::from(value as f32) != value
            {
                let (_, count) = found.get_or_insert((number, 0));
                *count += 1;
            }
            at += length.max(1) + digits.len();
        }
    }
    found
}
