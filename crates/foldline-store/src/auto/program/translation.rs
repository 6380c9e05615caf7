//! Equations and constants of AUTO as a model and a study.
//!
//! **Idea.** The subroutines FUNC, STPNT, BCND and ICND are executed with symbols ([`super::steps`]). FUNC gives the equations, BCND
//! and ICND the conditions of a boundary-value problem, STPNT the parameters and the start, and the constants file the branch.
//!
//! | IPS | becomes |
//! |---|---|
//! | 0, 1 | equilibria |
//! | -1 | a map |
//! | 2 | cycles |
//! | -2 | a survey by simulation |
//! | 4, 7 | a boundary-value problem |
//! | 9 | equilibria, and a curve of homoclinic orbits |
//!
//! **Fails when** something has no counterpart. It is then named with its line; nothing is left out without a note.

use super::constants::{Constant, Constants};
use super::steps::{Machine, Variable};
use super::syntax::{Routine, Stop, stop};
use super::values::{V, written};
use std::fmt::Write;

/// A translated program.
#[derive(Clone, Debug)]
pub struct Program {
    /// Text of the model.
    pub model: String,
    /// Text of the study.
    pub study: String,
    /// Parts that were not translated, and parts that need attention.
    pub notes: Vec<String>,
}

/// Names and texts of definitions.
type Definitions = Vec<(String, String)>;
/// Values of the parameters and of the states, as far as they are set.
type Beginning = (Vec<Option<f64>>, Vec<Option<V>>);

/// Number of parameters that AUTO has at least.
const PARAMETERS: usize = 100;
/// Names that models use themselves.
const TAKEN: [&str; 38] = [
    "sqrt",
    "cbrt",
    "exp",
    "log",
    "log10",
    "log2",
    "expm1",
    "log1p",
    "exprel",
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan",
    "atan2",
    "sinh",
    "cosh",
    "tanh",
    "asinh",
    "acosh",
    "atanh",
    "floor",
    "ceil",
    "round",
    "mod",
    "abs",
    "sign",
    "min",
    "max",
    "hypot",
    "heaviside",
    "if",
    "sum",
    "pi",
    "t",
    "period",
    "norm",
];

pub(super) struct Translation<'r> {
    /// True for C, whose arguments have another order.
    c: bool,
    pub(super) constants: &'r Constants,
    routines: &'r [Routine],
    pub(super) problem: i64,
    pub(super) n: usize,
    pub(super) states: Vec<String>,
    parameters: Vec<String>,
    /// Numbers, from 1, of the parameters that occur.
    pub(super) used: Vec<usize>,
    /// States that turn along a cycle.
    pub(super) angles: Vec<usize>,
    /// Data of the start: a file that the constants name.
    pub(super) data: Option<&'r str>,
    pub(super) notes: Vec<String>,
}

/// Name of a quantity of AUTO in a model: letters, digits and `_`, and not taken.
fn named(wanted: Option<&String>, fallback: String, taken: &[String]) -> String {
    let plain: String = wanted.map_or(String::new(), |name| {
        name.trim().chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' }).collect()
    });
    let good = plain.starts_with(|c: char| c.is_ascii_alphabetic()) && !TAKEN.contains(&plain.as_str());
    let mut name = if good { plain } else { fallback };
    while taken.contains(&name) || TAKEN.contains(&name.as_str()) {
        name.push('_');
    }
    name
}

/// Translates the routines of an equations file with the constants of its first run.
///
/// # Errors
/// The line, message and cure of what has no counterpart.
pub(super) fn translated(
    routines: &[Routine],
    c: bool,
    constants: &Constants,
    data: Option<&str>,
    [title, model_file]: [&str; 2],
) -> Result<Program, Stop> {
    let problem = constants.whole("IPS", 1);
    let supported = "IPS = 0, 1, 2, -1, -2, 4, 7 and 9 are translated";
    match problem {
        0 | 1 | 2 | -1 | -2 | 4 | 7 | 9 => {}
        5 | 15 => {
            return stop(
                0,
                format!("IPS = {problem} optimises a functional, which is not translated"),
                "make the functional a parameter and follow its extrema: see the chapter on design questions",
            );
        }
        11 | 12 | 14 | 16 | 17 => {
            return stop(
                0,
                format!("IPS = {problem} is a parabolic equation or its waves, which is not translated"),
                "steady profiles and waves are boundary-value problems or cycles; motion in time needs states on a grid",
            );
        }
        _ => return stop(0, format!("IPS = {problem} is not translated"), supported),
    }
    let n = constants.whole("NDIM", 2);
    let Some(n) = usize::try_from(n).ok().filter(|n| (1..=1000).contains(n)) else {
        return stop(0, format!("NDIM = {n} is not a number of states"), "give the constants file of the run");
    };
    let (mut taken, mut states, mut parameters) = (Vec::new(), Vec::new(), Vec::new());
    let [own, others] = ["unames", "parnames"].map(|key| constants.names(key));
    let find =
        |all: &[(usize, String)], number: usize| all.iter().find(|(k, _)| *k == number).map(|(_, name)| name.clone());
    for k in 1..=n {
        states.push(named(find(&own, k).as_ref(), format!("u{k}"), &taken));
        taken.push(states[k - 1].clone());
    }
    for k in 1..=PARAMETERS {
        parameters.push(named(find(&others, k).as_ref(), format!("p{k}"), &taken));
        taken.push(parameters[k - 1].clone());
    }
    let mut own = Translation {
        c,
        constants,
        routines,
        problem,
        n,
        states,
        parameters,
        used: Vec::new(),
        angles: Vec::new(),
        data,
        notes: Vec::new(),
    };
    own.program(title, model_file)
}

impl<'r> Translation<'r> {
    pub(super) fn boundary(&self) -> bool {
        matches!(self.problem, 4 | 7)
    }

    fn machine(&self) -> Machine<'r> {
        let mut machine = Machine::new(self.routines);
        machine.taken = TAKEN
            .iter()
            .map(|name| (*name).to_string())
            .chain(self.states.clone())
            .chain(self.parameters.clone())
            .collect();
        let c = self.constants;
        // Variables of the common block of HomCont.
        let block = [
            ("iequib", "IEQUIB", 1),
            ("istart", "ISTART", 5),
            ("itwist", "ITWIST", 0),
            ("nunstab", "NUNSTAB", -1),
            ("nstab", "NSTAB", -1),
        ];
        machine.outside.extend(block.map(|(own, key, usual)| (own.to_string(), V::whole(c.whole(key, usual)))));
        let counts = [("nrev", "IREV"), ("nfixed", "IFIXED"), ("npsi", "IPSI")];
        machine.outside.extend(counts.map(|(own, key)| {
            let all = c.get(key).map_or(0, |value| value.all().iter().filter(|one| one.number() != Some(0.0)).count());
            (own.to_string(), V::whole(all as i64))
        }));
        machine
    }

    fn whole(&self, key: &str, usual: i64) -> Variable {
        Variable::scalar(Some(V::whole(self.constants.whole(key, usual))))
    }

    fn symbols(&self, names: &[String], suffix: &str) -> Variable {
        Variable::array(names.iter().map(|name| Some(V::name(&format!("{name}{suffix}")))).collect())
    }

    pub(super) fn free(&self) -> Vec<Constant> {
        self.constants.get("ICP").map_or_else(|| vec![Constant::Number(1.0)], Constant::all)
    }

    fn icp(&self) -> Variable {
        Variable::array(self.free().iter().map(|own| Some(V::whole(self.index(own).unwrap_or(0) as i64))).collect())
    }

    /// Number of a parameter that is given by number or name.
    pub(super) fn index(&self, own: &Constant) -> Option<usize> {
        match own {
            Constant::Number(value) if *value >= 1.0 => Some(*value as usize),
            Constant::Text(name) if name == "PERIOD" => Some(11),
            Constant::Text(name) => {
                let all = self.constants.names("parnames");
                all.iter().find(|(_, own)| own == name).map(|(k, _)| *k)
            }
            _ => None,
        }
    }

    pub(super) fn parameter(&self, number: usize) -> &str {
        self.parameters.get(number.wrapping_sub(1)).map_or("?", String::as_str)
    }

    fn blank() -> Variable {
        Variable::array(Vec::new())
    }

    fn program(&mut self, title: &str, model_file: &str) -> Result<Program, Stop> {
        let (equations, definitions) = self.equations()?;
        let (conditions, integrals) = if self.boundary() { self.conditions()? } else { (Vec::new(), Vec::new()) };
        let (values, start) = self.start(V::name("t"))?;
        let mut texts: Vec<&String> = equations.iter().chain(&conditions).chain(&integrals).collect();
        texts.extend(definitions.iter().map(|(_, text)| text));
        let mut used: Vec<usize> =
            (1..=PARAMETERS).filter(|k| texts.iter().any(|text| mentions(text, self.parameter(*k)))).collect();
        let free: Vec<usize> = self.free().iter().filter_map(|own| self.index(own)).collect();
        let period = |k: &usize| *k == 11 && !self.boundary();
        if used.iter().any(period) && self.problem == 2 {
            return stop(
                0,
                "FUNC uses PAR(11), the period, which is no parameter of a model",
                "write the equations in unscaled time",
            );
        }
        let own =
            free.iter().copied().filter(|k| !period(k) && *k <= self.constants.whole("NPAR", 36).max(36) as usize);
        for k in own.take(if self.boundary() { usize::MAX } else { 2 }) {
            if !used.contains(&k) {
                used.push(k);
            }
        }
        used.sort_unstable();
        self.used = used;
        for name in ["pvls", "fopt"] {
            if let Some(routine) = self.routines.iter().find(|own| own.name == name)
                && routine.body.iter().any(|line| {
                    !matches!(line.what, super::syntax::Statement::Declare(..) | super::syntax::Statement::Return)
                })
            {
                let what = if name == "pvls" {
                    "add what it computes to `[outputs]`"
                } else {
                    "the functional is not optimised"
                };
                self.notes.push(format!("line {}: {} is not translated; {what}", routine.line, name.to_uppercase()));
            }
        }
        let study = self.study(title, model_file, &values, &start, &free)?;
        let mut model = format!("name = {title:?}\n");
        // Writing to a string cannot fail.
        let solve = self.solve(&free, conditions.len() + integrals.len())?;
        if self.boundary() {
            let names: Vec<String> = solve.iter().map(|k| format!("{:?}", self.parameter(*k))).collect();
            let _ = write!(model, "\n[interval]\nlength = 1\n");
            if !names.is_empty() {
                let _ = writeln!(model, "solve = [{}]", names.join(", "));
            }
        }
        let _ = write!(model, "\n[parameters]\n");
        for k in &self.used {
            let value = values.get(*k - 1).copied().flatten().unwrap_or(0.0);
            let _ = writeln!(model, "{} = {} # PAR({k})", self.parameter(*k), float(value));
        }
        if !definitions.is_empty() {
            let _ = write!(model, "\n[definitions]\n");
            for (name, text) in &definitions {
                let _ = writeln!(model, "{name} = {text:?}");
            }
        }
        if self.problem == -1 {
            let _ = write!(model, "\n[states]\n");
            for name in &self.states {
                let _ = writeln!(model, "{name} = {{}}");
            }
            let _ = write!(model, "\n[map]\n");
        } else {
            let _ = write!(model, "\n[states]\n");
        }
        for (k, (name, text)) in self.states.iter().zip(&equations).enumerate() {
            let _ = match self.angles.contains(&k) {
                true => writeln!(model, "{name} = {{ equation = {text:?}, period = \"2*pi\" }}"),
                false => writeln!(model, "{name} = {text:?}"),
            };
        }
        for (head, all) in [("boundary", &conditions), ("integrals", &integrals)] {
            if !all.is_empty() {
                let _ = write!(model, "\n[{head}]\n");
                for (k, text) in all.iter().enumerate() {
                    let _ = writeln!(model, "condition_{} = {text:?}", k + 1);
                }
            }
        }
        Ok(Program { model, study, notes: std::mem::take(&mut self.notes) })
    }

    fn equations(&self) -> Result<(Vec<String>, Definitions), Stop> {
        let mut machine = self.machine();
        let Some(routine) = machine.routine("func") else {
            return stop(
                1,
                "there is no subroutine FUNC",
                "give an equations file of AUTO, such as NAME.f90 or NAME.c",
            );
        };
        machine.defines = true;
        let f = Variable::array(vec![None; self.n]);
        let given = vec![
            self.whole("NDIM", 2),
            self.symbols(&self.states, ""),
            self.icp(),
            self.symbols(&self.parameters, ""),
            Variable::scalar(Some(V::whole(0))),
            f.clone(),
            Self::blank(),
            Self::blank(),
        ];
        machine.run(routine, given, 0)?;
        let mut texts = Vec::new();
        for (k, value) in f.values().into_iter().enumerate().take(self.n) {
            let Some(value) = value else {
                return stop(
                    routine.line,
                    format!("FUNC does not set F({})", k + 1),
                    "give the constants file with the right NDIM",
                );
            };
            texts.push(value.text(routine.line)?.0);
        }
        // Definitions that nothing uses are those of derivatives.
        let mut all = std::mem::take(&mut machine.definitions);
        while let Some(at) = (0..all.len()).rev().find(|k| {
            let own = &all[*k].0;
            !texts.iter().chain(all.iter().map(|(_, text)| text)).any(|text| mentions(text, own))
        }) {
            all.remove(at);
        }
        Ok((texts, all))
    }

    fn conditions(&self) -> Result<(Vec<String>, Vec<String>), Stop> {
        let count = |key: &str| usize::try_from(self.constants.whole(key, 0)).unwrap_or(0);
        let (own, integrals) = (count("NBC"), count("NINT"));
        let mut machine = self.machine();
        let mut found = [Vec::new(), Vec::new()];
        let flag = Variable::scalar(Some(V::whole(0)));
        let parameters = self.symbols(&self.parameters, "");
        for (kind, (name, number)) in [("bcnd", own), ("icnd", integrals)].into_iter().enumerate() {
            if number == 0 {
                continue;
            }
            let Some(routine) = machine.routine(name) else {
                return stop(
                    1,
                    format!("there is no subroutine {}", name.to_uppercase()),
                    "give the whole equations file",
                );
            };
            let out = Variable::array(vec![None; number]);
            let before = |why: &'static str| Variable::array(vec![Some(V::Opaque(why)); self.n]);
            let past = || {
                before(
                    "an integral condition uses the solution before (UOLD, UDOT or UPOLD), as phase conditions do; models have none",
                )
            };
            let mut given = vec![
                self.whole("NDIM", 2),
                parameters.clone(),
                self.icp(),
                Variable::scalar(Some(V::whole(number as i64))),
            ];
            match kind {
                0 => given.extend([self.symbols(&self.states, "@0"), self.symbols(&self.states, "@1")]),
                _ => given.extend([self.symbols(&self.states, ""), past(), past(), past()]),
            }
            match self.c {
                true => given.extend([flag.clone(), out.clone(), Self::blank()]),
                false => given.extend([out.clone(), flag.clone(), Self::blank()]),
            }
            machine.run(routine, given, 0)?;
            for (k, value) in out.values().into_iter().enumerate().take(number) {
                let Some(value) = value else {
                    let message = format!("{} does not set condition {}", name.to_uppercase(), k + 1);
                    return stop(routine.line, message, "give the constants file with the right NBC and NINT");
                };
                found[kind].push(value.text(routine.line)?.0);
            }
        }
        let [boundary, integrals] = found;
        Ok((boundary, integrals))
    }

    /// Values of the parameters, and the states, at a value or as functions of the independent variable.
    pub(super) fn start(&self, time: V) -> Result<Beginning, Stop> {
        let mut machine = self.machine();
        let Some(routine) = machine.routine("stpnt") else {
            return stop(
                1,
                "there is no subroutine STPNT",
                "give an equations file of AUTO, such as NAME.f90 or NAME.c",
            );
        };
        let empty = || Variable::array(vec![None; self.n.max(PARAMETERS)]);
        let (u, par) = (empty(), empty());
        let at = |value: V| Variable::scalar(Some(value));
        let given = match self.c {
            true => vec![self.whole("NDIM", 2), at(time), u.clone(), par.clone()],
            false => vec![self.whole("NDIM", 2), u.clone(), par.clone(), at(time)],
        };
        machine.run(routine, given, 0)?;
        let mut values = Vec::new();
        for value in par.values() {
            values.push(match value {
                Some(V::Number(value, _)) => Some(value),
                Some(V::Symbol(..)) => {
                    return stop(
                        routine.line,
                        "STPNT sets a parameter that is not a number",
                        "set the parameters in the study",
                    );
                }
                _ => None,
            });
        }
        if let Some(Constant::Pairs(all)) = self.constants.get("PAR") {
            for (key, value) in all {
                if let (Some(k), Some(value)) = (self.index(key), value.number()) {
                    values.resize(values.len().max(k), None);
                    values[k - 1] = Some(value);
                }
            }
        }
        let mut states = u.values();
        if let Some(Constant::Pairs(all)) = self.constants.get("U") {
            let names = self.constants.names("unames");
            for (key, value) in all {
                let k = match key {
                    Constant::Number(k) if *k >= 1.0 => Some(*k as usize),
                    Constant::Text(name) => names.iter().find(|(_, own)| own == name).map(|(k, _)| *k),
                    _ => None,
                };
                if let (Some(k), Some(value)) = (k.filter(|k| *k <= self.n), value.number()) {
                    states[k - 1] = Some(V::Number(value, false));
                }
            }
        }
        states.truncate(self.n);
        Ok((values, states))
    }

    /// Parameters that the conditions determine.
    fn solve(&self, free: &[usize], conditions: usize) -> Result<Vec<usize>, Stop> {
        if !self.boundary() {
            return Ok(Vec::new());
        }
        let Some(more) = conditions.checked_sub(self.n) else {
            return stop(
                0,
                format!("there are {} states and {conditions} conditions", self.n),
                "at least as many conditions as states are needed",
            );
        };
        match free.get(1..=more) {
            Some(all) => Ok(all.to_vec()),
            None => stop(
                0,
                format!("ICP has {} parameters, but {} are needed", free.len(), more + 1),
                "give the constants file of the run",
            ),
        }
    }
}

/// True if a name occurs in a text as a whole word.
fn mentions(text: &str, name: &str) -> bool {
    let part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.match_indices(name).any(|(at, _)| !text[..at].ends_with(part) && !text[at + name.len()..].starts_with(part))
}

/// A number in TOML.
pub(super) fn float(value: f64) -> String {
    let text = written(value);
    if text.contains(['.', 'e']) || text.len() < 15 { text } else { format!("{value:e}") }
}
