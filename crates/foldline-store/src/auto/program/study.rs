//! The study of a translated program.

use super::constants::Constant;
use super::syntax::{Stop, stop};
use super::translation::{Translation, float};
use super::values::V;
use std::f64::consts::TAU;
use std::fmt::Write;

/// Number of intervals at whose ends a given cycle is sampled.
const SAMPLES: usize = 40;
/// Largest difference of a turn from a multiple of 2π, relative to the turn.
const TURN: f64 = 1e-2;

impl Translation<'_> {
    /// Text of the study.
    pub(super) fn study(
        &mut self,
        title: &str,
        model: &str,
        values: &[Option<f64>],
        start: &[Option<V>],
        free: &[usize],
    ) -> Result<String, Stop> {
        let mut out = format!("title = {title:?}\nmodel = {model:?}\n");
        let restart = self.constants.whole("IRS", 0);
        if restart != 0 {
            self.notes.push(format!(
                "IRS = {restart}: the run restarts from a solution of another one, which is not known here; the study starts from STPNT"
            ));
        }
        let given = match self.constants.get("dat") {
            Some(Constant::Text(name)) => Some(name.clone()),
            _ => None,
        };
        match (&given, self.problem, self.data) {
            (Some(name), 9, _) => {
                self.notes.push(format!("dat = '{name}': the orbit is not needed; it is found from the equilibrium"))
            }
            (Some(name), 2, None) => {
                return stop(
                    0,
                    format!("dat = '{name}': the file {name}.dat is not beside the constants file"),
                    "put it there",
                );
            }
            (Some(_), 2, Some(_)) | (None, ..) => {}
            (Some(name), ..) => {
                return stop(
                    0,
                    format!("dat = '{name}': only cycles can start from a file of data"),
                    "write the study by hand",
                );
            }
        }
        let reversible =
            self.constants.get("IREV").is_some_and(|own| own.all().iter().any(|one| one.number() != Some(0.0)));
        if self.problem == 9 && reversible {
            return stop(
                0,
                "IREV: half of a reversible homoclinic orbit is sought",
                "pose it as a boundary-value problem",
            );
        }
        let value = |number: usize| values.get(number.wrapping_sub(1)).copied().flatten().unwrap_or(0.0);
        let first = free.iter().copied().find(|k| self.used.contains(k));
        let Some(first) = first else {
            return stop(
                0,
                "none of the parameters in ICP occurs in the equations",
                "give the constants file of the run",
            );
        };
        if self.problem == 9 && (0..self.n).all(|k| values.get(11 + k).copied().flatten().is_none()) {
            self.notes.push("STPNT does not set the equilibrium PAR(12), …; the study starts at 0".into());
        }
        self.seed(&mut out, start, &value)?;
        let name = self.parameter(first).to_string();
        if self.problem == -2 {
            let _ = write!(
                out,
                "\n# AUTO integrates in time from the start; `foldline simulate` does the same from one state.\n[[survey]]\nname = \"in time\"\n\
                 free = {name:?}\nvalues = [{}]\n",
                float(value(first))
            );
            return Ok(out);
        }
        let here = value(first);
        let (range, whose) = self.range(first, here);
        let [low, high] = range.map(float);
        let _ = write!(
            out,
            "\n[[branch]]\nname = \"branch\"\nfrom = \"start\"\nfree = {name:?}\nrange = [{low}, {high}] # {whose}\n"
        );
        // AUTO follows the branches that cross, too.
        if (-1..=1).contains(&self.problem)
            && self.constants.whole("MXBF", 10) != 0
            && self.constants.whole("ISP", 2) > 0
        {
            let _ = writeln!(out, "switch = {{ branch-point = 1 }} # MXBF");
        }
        for (key, own) in [("mark", "UZR"), ("stop", "UZSTOP")] {
            let text = self.levels(own, first, range);
            if !text.is_empty() {
                let _ = writeln!(out, "{key} = {{ {} }}", text.join(", "));
            }
        }
        if self.problem == 9 {
            let second = free.iter().copied().filter(|k| self.used.contains(k)).nth(1);
            let Some(second) = second else {
                self.notes.push("IPS = 9 with one parameter in ICP: the study follows the equilibrium; add a `[[curve]]` with `hold = \"homoclinic\"`".into());
                return Ok(out);
            };
            let (range, whose) = self.range(second, value(second));
            let [low, high] = range.map(float);
            let kind = if self.constants.whole("IEQUIB", 1) < 0 { "heteroclinic" } else { "homoclinic" };
            let _ = write!(
                out,
                "\n[[curve]]\nname = \"connecting orbits\"\nhold = {kind:?}\nof = \"branch\"\nfree = {:?}\nrange = [{low}, {high}] # {whose}\n",
                self.parameter(second)
            );
            if kind == "heteroclinic" {
                let to: Option<Vec<String>> = (0..self.n)
                    .map(|k| {
                        values
                            .get(11 + self.n + k)
                            .copied()
                            .flatten()
                            .map(|v| format!("{} = {}", self.states[k], float(v)))
                    })
                    .collect();
                let Some(to) = to else {
                    return stop(0, "IEQUIB: STPNT does not set the second equilibrium", "write the study by hand");
                };
                let _ = writeln!(out, "to = {{ {} }}", to.join(", "));
            }
        }
        Ok(out)
    }

    fn seed(&mut self, out: &mut String, start: &[Option<V>], value: &dyn Fn(usize) -> f64) -> Result<(), Stop> {
        let _ = write!(out, "\n[[seed]]\nname = \"start\"\n");
        if let (Some(data), 2) = (self.data, self.problem) {
            return self.cycle_of_data(out, data, value);
        }
        let mut texts = Vec::new();
        let mut varies = false;
        for (k, own) in start.iter().enumerate() {
            // Of a connecting orbit, the equilibrium.
            let own = if self.problem == 9 { Some(V::Number(value(12 + k), false)) } else { own.clone() };
            let Some(own) = own else {
                return stop(
                    0,
                    format!("STPNT does not set U({})", k + 1),
                    "set it there, or as U in the constants file",
                );
            };
            varies |= !matches!(own, V::Number(..));
            texts.push(own.text(0)?.0);
        }
        if varies && self.problem == 2 {
            return self.cycle(out, &texts, value);
        }
        if varies && !self.boundary() {
            return stop(0, "STPNT gives the start as a function of time", "start from a state");
        }
        let own = |(name, text): (&String, &String)| match text.parse::<f64>() {
            Ok(number) => format!("{name} = {}", float(number)),
            Err(_) => format!("{name} = {text:?}"),
        };
        let all: Vec<String> = self.states.iter().zip(&texts).map(own).collect();
        let _ = writeln!(out, "state = {{ {} }}", all.join(", "));
        Ok(())
    }

    /// A cycle from its formulas, at evenly spaced times.
    fn cycle(&self, out: &mut String, texts: &[String], value: &dyn Fn(usize) -> f64) -> Result<(), Stop> {
        let period = value(11);
        if period <= 0.0 {
            return stop(0, "STPNT gives a cycle without its period PAR(11)", "set PAR(11) there");
        }
        let _ = write!(out, "\n[seed.cycle]\nperiod = {}\n", float(period));
        let _ = writeln!(out, "# As functions of the share t of the period: {}", texts.join("; "));
        let times: Vec<String> = (0..=SAMPLES).map(|k| float(k as f64 / SAMPLES as f64)).collect();
        let _ = writeln!(out, "times = [{}]\n\n[seed.cycle.states]", times.join(", "));
        let mut columns = vec![Vec::new(); self.n];
        for k in 0..=SAMPLES {
            let (_, states) = self.start(V::Number(k as f64 / SAMPLES as f64, false))?;
            for (column, own) in columns.iter_mut().zip(states) {
                let Some(V::Number(own, _)) = own else {
                    return stop(0, "STPNT gives no numbers along the cycle", "start from a state");
                };
                column.push(float(own));
            }
        }
        for (name, column) in self.states.iter().zip(columns) {
            let _ = writeln!(out, "{name} = [{}]", column.join(", "));
        }
        Ok(())
    }

    /// A cycle from a file with a column of times and one for each state.
    fn cycle_of_data(&mut self, out: &mut String, data: &str, value: &dyn Fn(usize) -> f64) -> Result<(), Stop> {
        let number = |text: &str| text.replace(['d', 'D'], "e").parse::<f64>().ok().filter(|value| value.is_finite());
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for line in data.lines().filter(|line| !line.trim().is_empty()) {
            let row: Option<Vec<f64>> = line.split_whitespace().take(self.n + 1).map(number).collect();
            match row.filter(|row| row.len() == self.n + 1) {
                Some(row) => rows.push(row),
                None => {
                    return stop(
                        0,
                        format!("a line of the file of data is not {} numbers: {line}", self.n + 1),
                        "correct the file",
                    );
                }
            }
        }
        let (Some(first), Some(last)) = (rows.first().map(|row| row[0]), rows.last().map(|row| row[0])) else {
            return stop(0, "the file of data is empty", "give the file that AUTO reads");
        };
        // The times may be shares of the period.
        let span = last - first;
        let period = if value(11) > 0.0 { value(11) } else { span };
        if !rows.windows(2).all(|pair| pair[0][0] < pair[1][0]) {
            return stop(0, "the times in the file of data do not increase", "correct the file");
        }
        let _ = write!(out, "\n[seed.cycle]\nperiod = {}\n", float(period));
        let times: Vec<String> = rows.iter().map(|row| float((row[0] - first) / span)).collect();
        let _ = writeln!(out, "times = [{}]\n\n[seed.cycle.states]", times.join(", "));
        for (k, name) in self.states.iter().enumerate() {
            let column: Vec<String> = rows.iter().map(|row| float(row[k + 1])).collect();
            let _ = writeln!(out, "{name} = [{}]", column.join(", "));
            // AUTO lets states turn by multiples of 2π.
            let gap = rows[rows.len() - 1][k + 1] - rows[0][k + 1];
            let turns = (gap / TAU).round();
            if turns != 0.0 && (gap - turns * TAU).abs() <= TURN * gap.abs() {
                self.angles.push(k);
            }
        }
        Ok(())
    }

    /// RL0 and RL1, or bounds from UZSTOP and the start.
    fn range(&self, number: usize, here: f64) -> ([f64; 2], &'static str) {
        let bound = |key: &str| self.constants.number(key).filter(|value| value.abs() < 1e300);
        let first = self.free().first().and_then(|own| self.index(own)) == Some(number);
        // AUTO's steps lead no farther than this.
        let farthest = self.constants.number("NMX").unwrap_or(100.0) * self.constants.number("DSMAX").unwrap_or(0.1);
        let stops: Vec<f64> = match self.constants.get("UZSTOP") {
            Some(Constant::Pairs(all)) => {
                let own = all.iter().filter(|(key, _)| self.index(key) == Some(number));
                own.flat_map(|(_, value)| value.all()).filter_map(|one| one.number()).collect()
            }
            _ => Vec::new(),
        };
        let below = stops.iter().copied().filter(|value| *value < here).fold(f64::NEG_INFINITY, f64::max);
        let above = stops.iter().copied().filter(|value| *value > here).fold(f64::INFINITY, f64::min);
        let low = bound("RL0").filter(|low| first && *low <= here).or(Some(below).filter(|v| v.is_finite()));
        let high = bound("RL1").filter(|high| first && *high >= here).or(Some(above).filter(|v| v.is_finite()));
        let whose = match (low, high) {
            (Some(_), Some(_)) => "from the constants",
            (None, None) => "edit as needed: NMX steps of DSMAX to both sides",
            _ => "edit as needed: one bound is that of the constants, the other NMX steps of DSMAX away",
        };
        ([low.unwrap_or(here - farthest), high.unwrap_or(here + farthest)], whose)
    }

    /// Values of parameters to mark or to stop at, as entries of a table.
    fn levels(&mut self, key: &str, first: usize, [low, high]: [f64; 2]) -> Vec<String> {
        let Some(Constant::Pairs(all)) = self.constants.get(key).cloned() else { return Vec::new() };
        let mut texts = Vec::new();
        for (own, value) in &all {
            let values: Vec<f64> = value.all().iter().filter_map(Constant::number).collect();
            let Some(number) = self.index(own) else {
                self.notes.push(format!("{key}: the entry {own:?} is not translated"));
                continue;
            };
            let period = number == 11 && !self.boundary();
            // The ends of the range are no marks, and a stop at the free parameter is the end of the range.
            let inside = |value: &&f64| number != first || (low <= **value && **value <= high && key != "UZSTOP");
            let inside: Vec<String> = values.iter().filter(inside).map(|value| float(*value)).collect();
            if inside.is_empty() {
                if number != first {
                    continue;
                }
                if key == "UZR" && !values.is_empty() {
                    self.notes
                        .push(format!("{key}: values of {} outside the range are left out", self.parameter(number)));
                }
                continue;
            }
            let name = if period { "period".to_string() } else { self.parameter(number).to_string() };
            if !period && !self.used.contains(&number) {
                self.notes
                    .push(format!("{key}: PAR({number}) does not occur in the equations; its values are not marked"));
                continue;
            }
            if period && matches!(self.problem, 0 | 1 | -1 | 9) {
                continue;
            }
            texts.push(format!("{name} = [{}]", inside.join(", ")));
        }
        texts
    }
}
