//! Execution of subroutines with symbols in place of states and parameters.
//!
//! **Idea.** Loops with known bounds are unrolled, and conditions that are known are decided. What a subroutine assigns is then text
//! in the language of models. Local variables become definitions.

use super::syntax::{Line, Place, Routine, Statement, Stop, X, stop};
use super::values::{Tight, V, binary, intrinsic, negative};
use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

/// Limit on the number of executed statements.
const MOST: usize = 200_000;
/// Limit on the number of elements of an array.
const LARGEST: usize = 100_000;
/// Depth of calls.
const DEEPEST: usize = 20;

/// A variable: elements from an offset on, with the lower bound and the length of each index. Without indices it is a scalar.
#[derive(Clone, Debug)]
pub(super) struct Variable {
    cells: Rc<RefCell<Vec<Option<V>>>>,
    offset: usize,
    shape: Vec<(i64, Option<usize>)>,
    /// True if compound values become definitions.
    local: bool,
    /// True for an integer, to which numbers are truncated.
    integer: bool,
}

/// True if a name that is not declared is that of an integer.
fn implicit(name: &str) -> bool {
    name.starts_with(['i', 'j', 'k', 'l', 'm', 'n'])
}

impl Variable {
    pub(super) fn scalar(value: Option<V>) -> Variable {
        Variable {
            cells: Rc::new(RefCell::new(vec![value])),
            offset: 0,
            shape: Vec::new(),
            local: true,
            integer: false,
        }
    }

    /// An array with indices from 1.
    pub(super) fn array(values: Vec<Option<V>>) -> Variable {
        let shape = vec![(1, Some(values.len()))];
        Variable { cells: Rc::new(RefCell::new(values)), offset: 0, shape, local: false, integer: false }
    }

    pub(super) fn values(&self) -> Vec<Option<V>> {
        self.cells.borrow()[self.offset..].to_vec()
    }

    fn get(&self, at: usize) -> Option<V> {
        self.cells.borrow().get(self.offset + at).cloned().flatten()
    }

    fn set(&self, at: usize, value: V, line: usize) -> Result<(), Stop> {
        let at = self.offset + at;
        if at >= LARGEST {
            return stop(line, "an index is too large", "write the model by hand");
        }
        let mut cells = self.cells.borrow_mut();
        if at >= cells.len() {
            cells.resize(at + 1, None);
        }
        cells[at] = Some(value);
        Ok(())
    }

    fn len(&self) -> usize {
        let all: Option<usize> = self.shape.iter().map(|(_, length)| *length).product::<Option<usize>>();
        all.unwrap_or(self.cells.borrow().len().saturating_sub(self.offset))
    }
}

type Frame = HashMap<String, Variable>;

/// The routines of a file, and what their execution has defined.
pub(super) struct Machine<'r> {
    routines: &'r [Routine],
    /// Values of variables that are set outside, such as those of common blocks.
    pub(super) outside: HashMap<String, V>,
    /// Definitions in order: name and text.
    pub(super) definitions: Vec<(String, String)>,
    /// Names that a definition cannot have.
    pub(super) taken: Vec<String>,
    /// True if compound values of local variables become definitions.
    pub(super) defines: bool,
    /// Statement functions: name, arguments, expression.
    functions: Vec<(String, Vec<String>, &'r X)>,
    steps: usize,
}

enum Flow {
    Next,
    Return,
}

/// True for a statement function such as `f(x) = x**2`: its name is a scalar, and its arguments are names.
fn is_function(name: &str, places: &[Place], frame: &Frame) -> bool {
    !places.is_empty()
        && frame.get(name).is_none_or(|own| own.shape.is_empty())
        && places.iter().all(|place| matches!(place, Place::At(X::Name(_))))
}

impl<'r> Machine<'r> {
    pub(super) fn new(routines: &'r [Routine]) -> Machine<'r> {
        Machine {
            routines,
            outside: HashMap::new(),
            definitions: Vec::new(),
            taken: Vec::new(),
            defines: false,
            functions: Vec::new(),
            steps: 0,
        }
    }

    pub(super) fn routine(&self, name: &str) -> Option<&'r Routine> {
        self.routines.iter().find(|routine| routine.name == name)
    }

    /// Executes a routine with these arguments.
    pub(super) fn run(&mut self, routine: &'r Routine, given: Vec<Variable>, depth: usize) -> Result<Frame, Stop> {
        if depth > DEEPEST {
            return stop(routine.line, "calls are nested too deeply", "write the model by hand");
        }
        let mut frame: Frame = routine.arguments.iter().cloned().zip(given).collect();
        frame.entry(routine.name.clone()).or_insert_with(|| Variable::scalar(None));
        self.lines(&routine.body, &mut frame, depth)?;
        Ok(frame)
    }

    fn lines(&mut self, lines: &'r [Line], frame: &mut Frame, depth: usize) -> Result<Flow, Stop> {
        for line in lines {
            self.steps += 1;
            if self.steps > MOST {
                return stop(line.number, "the loops are too long", "write the model by hand");
            }
            if let Flow::Return = self.line(line, frame, depth)? {
                return Ok(Flow::Return);
            }
        }
        Ok(Flow::Next)
    }

    fn line(&mut self, line: &'r Line, frame: &mut Frame, depth: usize) -> Result<Flow, Stop> {
        let number = line.number;
        match &line.what {
            Statement::Return => return Ok(Flow::Return),
            Statement::Other(text) => {
                return stop(number, format!("this statement is not translated: {text}"), super::syntax::SIMPLER);
            }
            Statement::Assign(name, places, value) if is_function(name, places, frame) => {
                let arguments = places
                    .iter()
                    .filter_map(|place| if let Place::At(X::Name(own)) = place { Some(own.clone()) } else { None });
                self.functions.retain(|(own, ..)| own != name);
                self.functions.push((name.clone(), arguments.collect(), value));
            }
            Statement::Assign(name, places, value) => {
                let value = self.value(value, frame, number, depth)?;
                self.assign(name, places, value, frame, number, depth)?;
            }
            Statement::Declare(name, bounds, value, integer) => {
                self.declare(name, bounds, *integer, frame, number, depth)?;
                if let Some(value) = value {
                    let value = self.value(value, frame, number, depth)?;
                    self.assign(name, &[], value, frame, number, depth)?;
                }
            }
            Statement::Call(name, places) => {
                let Some(routine) = self.routine(name) else {
                    return stop(
                        number,
                        format!("the subroutine `{name}` is not in this file"),
                        "write the model by hand",
                    );
                };
                let given = self.arguments(routine, places, frame, number, depth)?;
                self.run(routine, given, depth + 1)?;
            }
            Statement::If(parts) => {
                for (condition, body) in parts {
                    let holds = match condition {
                        Some(condition) => self.decided(condition, frame, number, depth)?,
                        None => true,
                    };
                    if holds {
                        return self.lines(body, frame, depth);
                    }
                }
            }
            Statement::Do(name, from, to, step, body) => {
                let one = X::Number(1.0, true);
                let mut ends = [0i64; 3];
                for (end, own) in ends.iter_mut().zip([from, to, step.as_ref().unwrap_or(&one)]) {
                    *end = self.index(own, frame, number, depth)?;
                }
                let [mut at, last, by] = ends;
                while by != 0 && if by > 0 { at <= last } else { at >= last } {
                    frame.insert(name.clone(), Variable { integer: true, ..Variable::scalar(Some(V::whole(at))) });
                    if let Flow::Return = self.lines(body, frame, depth)? {
                        return Ok(Flow::Return);
                    }
                    at += by;
                }
                frame.insert(name.clone(), Variable { integer: true, ..Variable::scalar(Some(V::whole(at))) });
            }
        }
        Ok(Flow::Next)
    }

    fn decided(&mut self, condition: &X, frame: &mut Frame, line: usize, depth: usize) -> Result<bool, Stop> {
        match self.value(condition, frame, line, depth)? {
            V::Logical(own) => Ok(own),
            V::Number(own, _) => Ok(own != 0.0),
            V::Opaque(why) => stop(line, why, "write the model by hand"),
            _ => stop(
                line,
                "this condition is not known when the model is written",
                "write the model by hand with `if(condition, a, b)`",
            ),
        }
    }

    fn index(&mut self, x: &X, frame: &mut Frame, line: usize, depth: usize) -> Result<i64, Stop> {
        match self.value(x, frame, line, depth)? {
            V::Number(value, _) if value.fract() == 0.0 && value.abs() < 1e9 => Ok(value as i64),
            _ => stop(line, "an index or the end of a loop is not a known whole number", "write the model by hand"),
        }
    }

    fn declare(
        &mut self,
        name: &str,
        bounds: &[(Option<X>, X)],
        integer: Option<bool>,
        frame: &mut Frame,
        line: usize,
        depth: usize,
    ) -> Result<(), Stop> {
        let mut shape = Vec::new();
        for (from, to) in bounds {
            let from = match from {
                Some(own) => self.index(own, frame, line, depth)?,
                None => 1,
            };
            let to = match to {
                X::Name(star) if star == "*" => None,
                own => Some(self.index(own, frame, line, depth)?),
            };
            shape.push((from, to.map(|to| usize::try_from(to - from + 1).unwrap_or(0))));
        }
        if let Some(own) = frame.get_mut(name) {
            // An argument: its shape is that of its declaration.
            if !shape.is_empty() || integer.is_some() {
                own.shape = shape;
            }
            own.integer = integer.unwrap_or(own.integer);
        } else if !self.outside.contains_key(name) {
            let length = shape.iter().map(|(_, length)| length.unwrap_or(1)).product::<usize>().max(1);
            if length > LARGEST {
                return stop(line, "an array is too large", "write the model by hand");
            }
            let cells = Rc::new(RefCell::new(vec![None; length]));
            let integer = integer.unwrap_or(implicit(name));
            frame.insert(name.to_string(), Variable { cells, offset: 0, shape, local: true, integer });
        }
        Ok(())
    }

    /// Elements that indices select, in order, and true if they are a list.
    fn selected(
        &mut self,
        own: &Variable,
        places: &[Place],
        frame: &mut Frame,
        line: usize,
        depth: usize,
    ) -> Result<(Vec<usize>, bool), Stop> {
        if places.is_empty() {
            return Ok(((0..own.len()).collect(), !own.shape.is_empty()));
        }
        if places.len() != own.shape.len() {
            return stop(line, "the number of indices is not that of the declaration", "write the model by hand");
        }
        let (mut all, mut list, mut stride) = (vec![0usize], false, 1usize);
        for (place, (low, length)) in places.iter().zip(own.shape.clone()) {
            let range = match place {
                Place::At(x) => {
                    let at = self.index(x, frame, line, depth)?;
                    at..=at
                }
                Place::Range(from, to) => {
                    list = true;
                    let from = match from {
                        Some(x) => self.index(x, frame, line, depth)?,
                        None => low,
                    };
                    let to = match (to, length) {
                        (Some(x), _) => self.index(x, frame, line, depth)?,
                        (None, Some(length)) => low + length as i64 - 1,
                        (None, None) => low + own.len() as i64 - 1,
                    };
                    from..=to
                }
            };
            let mut next = Vec::new();
            for at in range {
                let Some(at) = usize::try_from(at - low).ok().filter(|at| length.is_none_or(|length| *at < length))
                else {
                    return stop(line, format!("the index {at} lies outside the array"), "correct the equations file");
                };
                next.extend(all.iter().map(|before| before + stride * at));
            }
            all = next;
            stride *= length.unwrap_or(1);
            if all.len() > LARGEST {
                return stop(line, "a section of an array is too large", "write the model by hand");
            }
        }
        Ok((all, list))
    }

    fn assign(
        &mut self,
        name: &str,
        places: &[Place],
        value: V,
        frame: &mut Frame,
        line: usize,
        depth: usize,
    ) -> Result<(), Stop> {
        let own = match frame.get(name) {
            Some(own) => own.clone(),
            None if places.is_empty() => {
                let own = Variable { integer: implicit(name), ..Variable::scalar(None) };
                frame.insert(name.to_string(), own.clone());
                own
            }
            None => {
                return stop(
                    line,
                    format!("`{name}` is not declared as an array here"),
                    "declare it, or write the model by hand",
                );
            }
        };
        let (cells, _) = self.selected(&own, places, frame, line, depth)?;
        if let V::List(all) = &value
            && all.len() != cells.len()
        {
            return stop(
                line,
                format!("{} values are assigned to {} elements", all.len(), cells.len()),
                "correct the equations file",
            );
        }
        let single = cells.len() == 1 && own.shape.is_empty();
        for (k, at) in cells.into_iter().enumerate() {
            let one = match &value {
                V::List(all) => all[k].clone(),
                other => other.clone(),
            };
            let one = match one {
                V::Number(value, _) if own.integer => V::Number(value.trunc(), true),
                V::Number(value, _) => V::Number(value, false),
                other => other,
            };
            let title = if single { name.to_string() } else { format!("{name}_{}", at + 1) };
            let one = if own.local { self.defined(&title, one, line)? } else { one };
            own.set(at, one, line)?;
        }
        Ok(())
    }

    /// A compound value as a definition.
    fn defined(&mut self, name: &str, value: V, line: usize) -> Result<V, Stop> {
        if !self.defines
            || !matches!(&value, V::Symbol(_, tight) if *tight < Tight::Atom || value.text(line)?.0.contains('('))
        {
            return Ok(value);
        }
        let (text, _) = value.text(line)?;
        let mut free = name.to_string();
        let mut number = 1;
        while self.taken.contains(&free) {
            number += 1;
            free = format!("{name}_v{number}");
        }
        self.taken.push(free.clone());
        self.definitions.push((free.clone(), text));
        Ok(V::name(&free))
    }

    /// Variables that arguments pass: elements and arrays by reference, other values as copies.
    fn arguments(
        &mut self,
        routine: &'r Routine,
        places: &[Place],
        frame: &mut Frame,
        line: usize,
        depth: usize,
    ) -> Result<Vec<Variable>, Stop> {
        let mut all = Vec::new();
        for place in places.iter().take(routine.arguments.len()) {
            let Place::At(x) = place else {
                return stop(line, "this argument is not understood", "write the model by hand");
            };
            let referred = match x {
                X::Name(name) => frame.get(name).cloned(),
                X::Of(name, places) => match frame.get(name).cloned() {
                    Some(own) if !own.shape.is_empty() => {
                        let (cells, _) = self.selected(&own, places, frame, line, depth)?;
                        let first = cells.first().copied().unwrap_or(0);
                        let next = cells.iter().enumerate().all(|(k, at)| *at == first + k);
                        if !next {
                            return stop(
                                line,
                                "a section that is not contiguous is passed here",
                                "write the model by hand",
                            );
                        }
                        let length = if cells.len() > 1 { Some(cells.len()) } else { None };
                        let (local, integer) = (own.local, own.integer);
                        let shape = vec![(1, length)];
                        Some(Variable { cells: own.cells.clone(), offset: own.offset + first, shape, local, integer })
                    }
                    _ => None,
                },
                _ => None,
            };
            all.push(match referred {
                Some(own) => own,
                None => match self.value(x, frame, line, depth)? {
                    V::List(values) => {
                        Variable { local: true, ..Variable::array(values.into_iter().map(Some).collect()) }
                    }
                    value => Variable::scalar(Some(value)),
                },
            });
        }
        Ok(all)
    }

    fn value(&mut self, x: &X, frame: &mut Frame, line: usize, depth: usize) -> Result<V, Stop> {
        Ok(match x {
            X::Number(value, whole) => V::Number(*value, *whole),
            X::Logical(own) => V::Logical(*own),
            X::Text(text) => V::Text(text.clone()),
            X::List(all) => {
                let mut values = Vec::new();
                for one in all {
                    match self.value(one, frame, line, depth)? {
                        V::List(more) => values.extend(more),
                        value => values.push(value),
                    }
                }
                V::List(values)
            }
            X::Unary("!", own) => match self.value(own, frame, line, depth)? {
                V::Logical(own) => V::Logical(!own),
                V::Number(own, _) => V::Logical(own == 0.0),
                _ => {
                    return stop(
                        line,
                        "this condition is not known when the model is written",
                        "write the model by hand",
                    );
                }
            },
            X::Unary(_, own) => negative(self.value(own, frame, line, depth)?, line)?,
            X::Binary(sign, left, right) => {
                let left = self.value(left, frame, line, depth)?;
                // (The right side may have no value if the left one decides.)
                match (*sign, &left) {
                    ("&&", V::Logical(false)) => return Ok(V::Logical(false)),
                    ("||", V::Logical(true)) => return Ok(V::Logical(true)),
                    _ => {}
                }
                let right = self.value(right, frame, line, depth)?;
                binary(sign, left, right, line)?
            }
            X::Name(name) => match frame.get(name).cloned() {
                Some(own) if own.shape.is_empty() => match own.get(0) {
                    Some(value) => value,
                    None => {
                        return stop(
                            line,
                            format!("`{name}` has no value here"),
                            "assign it before, in this subroutine",
                        );
                    }
                },
                Some(own) => self.list(name, &own, &[], frame, line, depth)?,
                None => match self.outside.get(name) {
                    Some(value) => value.clone(),
                    None => {
                        return stop(
                            line,
                            format!("`{name}` has no value here"),
                            "values from modules, common blocks and SAVE are not known; assign it in this subroutine",
                        );
                    }
                },
            },
            X::Of(name, places) => match frame.get(name).cloned() {
                Some(own) if !own.shape.is_empty() => self.list(name, &own, places, frame, line, depth)?,
                _ => self.applied(name, places, frame, line, depth)?,
            },
        })
    }

    fn list(
        &mut self,
        name: &str,
        own: &Variable,
        places: &[Place],
        frame: &mut Frame,
        line: usize,
        depth: usize,
    ) -> Result<V, Stop> {
        let (cells, list) = self.selected(own, places, frame, line, depth)?;
        let mut values = Vec::new();
        for at in cells {
            match own.get(at) {
                Some(value) => values.push(value),
                None => {
                    return stop(
                        line,
                        format!("{name}({}) has no value here", at + 1),
                        "assign it before, in this subroutine",
                    );
                }
            }
        }
        Ok(match (values.pop(), list) {
            (Some(value), false) => value,
            (Some(value), true) => {
                values.push(value);
                V::List(values)
            }
            (None, _) => V::List(values),
        })
    }

    fn applied(
        &mut self,
        name: &str,
        places: &[Place],
        frame: &mut Frame,
        line: usize,
        depth: usize,
    ) -> Result<V, Stop> {
        if let Some(routine) = self.routine(name) {
            let given = self.arguments(routine, places, frame, line, depth)?;
            let inner = self.run(routine, given, depth + 1)?;
            return match inner.get(name).and_then(|own| own.get(0)) {
                Some(value) => Ok(value),
                None => stop(line, format!("the function `{name}` has no value"), "write the model by hand"),
            };
        }
        if let Some((_, names, body)) = self.functions.iter().find(|(own, ..)| own == name).cloned() {
            let mut inner = frame.clone();
            for (own, place) in names.iter().zip(places) {
                let Place::At(x) = place else {
                    return stop(line, "this argument is not understood", "write the model by hand");
                };
                let value = self.value(x, frame, line, depth)?;
                inner.insert(own.clone(), Variable::scalar(Some(value)));
            }
            if depth > DEEPEST {
                return stop(line, "functions are nested too deeply", "write the model by hand");
            }
            return self.value(body, &mut inner, line, depth + 1);
        }
        let mut given = Vec::new();
        for place in places {
            let Place::At(x) = place else {
                return stop(line, format!("`{name}` is not declared as an array"), "declare it");
            };
            given.push(self.value(x, frame, line, depth)?);
        }
        match intrinsic(name, &given, line)? {
            Some(value) => Ok(value),
            None => stop(
                line,
                format!("`{name}` is neither an array nor a function that is known here"),
                "write the model by hand",
            ),
        }
    }
}
