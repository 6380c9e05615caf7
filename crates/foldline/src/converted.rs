//! Conversion of a diagram to other units, for display.
//!
//! **Idea.** Every number with a unit in a diagram is multiplied by a factor: parameters, extremes, averages, profiles,
//! periods, bounds at which branches ended. Errors are relative to scale + |value| and do not depend on the unit.
//! Normal-form coefficients and messages stay in the units of the model.
//!
//! **Equations.** An *order* is a frequency over a reference speed, q/Ω, both in the same unit.

use crate::diagram::{Branch, Diagram, Ending, Origin, Point, Response, Solution};
use crate::model::{Model, element_of, suggest};
use crate::units::{Mismatch, Unit};

/// The unit in which a quantity is shown.
#[derive(Clone, Debug, PartialEq)]
pub enum Shown {
    /// The unit of the model.
    Own,
    /// Multiplied by the fraction numerator / denominator.
    By([f64; 2]),
    /// Multiplied by a fraction and divided by the parameter with this index.
    Orders([f64; 2], usize),
}

impl Shown {
    fn of(&self, value: f64, parameters: &[f64]) -> f64 {
        match self {
            Shown::Own => value,
            Shown::By([above, below]) => value * above / below,
            Shown::Orders([above, below], of) => {
                value * above / below / parameters.get(*of).copied().unwrap_or(f64::NAN)
            }
        }
    }

    /// Converts a value for which the parameters are unknown; orders become NaN.
    fn alone(&self, value: f64) -> f64 {
        self.of(value, &[])
    }
}

/// The units in which a diagram is shown.
#[derive(Clone, Debug)]
pub struct Conversion {
    parameters: Vec<Shown>,
    /// States, then outputs.
    channels: Vec<Shown>,
    time: Shown,
    model: Model,
}

/// An error message and a hint on how to fix it.
pub type Refusal = [String; 2];

impl Conversion {
    /// Conversion that shows the quantities in `wanted` (names of parameters, states, outputs, or `period`) in the
    /// given units, or as `orders:NAME`.
    ///
    /// # Errors
    /// If a name is unknown or its unit cannot be converted to the requested one.
    pub fn new(model: &Model, wanted: &[(String, String)]) -> Result<Conversion, Refusal> {
        let channels = model.states.len() + model.outputs.len();
        let mut own = Conversion {
            parameters: vec![Shown::Own; model.parameters.len()],
            channels: vec![Shown::Own; channels],
            time: Shown::Own,
            model: model.clone(),
        };
        let mut labels: Vec<(String, String)> = Vec::new();
        for (name, unit) in wanted {
            own.wish(model, name, unit, &mut labels)?;
        }
        own.model = model.labelled(&labels);
        Ok(own)
    }

    /// The model, labelled with the units shown.
    pub fn model(&self) -> &Model {
        &self.model
    }

    fn wish(
        &mut self,
        model: &Model,
        name: &str,
        unit: &str,
        labels: &mut Vec<(String, String)>,
    ) -> Result<(), Refusal> {
        if matches!(name, "period" | "time") && model.parameter_index(name).is_none() {
            self.time = shown(model, "the time of the model", &model.time, unit)?.0;
            labels.push(("period".into(), unit.into()));
            return Ok(());
        }
        let mut known = false;
        let meant = |own: &str| own == name || element_of(own) == Some(name);
        for (k, own) in model.parameters.iter().enumerate().filter(|(_, own)| meant(&own.name)) {
            let (how, label) = shown(model, &own.name, &own.unit, unit)?;
            self.parameters[k] = how;
            labels.push((own.name.clone(), label));
            known = true;
        }
        let states = model.states.iter().map(|s| (&s.name, &s.unit));
        let channels = states.chain(model.outputs.iter().map(|o| (&o.name, &o.unit)));
        for (k, (own, declared)) in channels.enumerate().filter(|(_, (own, _))| meant(own)) {
            let (how, label) = shown(model, own, declared, unit)?;
            self.channels[k] = how;
            labels.push((own.clone(), label));
            known = true;
        }
        if known {
            return Ok(());
        }
        let states = model.states.iter().map(|s| s.name.as_str());
        let names = model.parameters.iter().map(|p| p.name.as_str()).chain(states);
        let names: Vec<&str> = names.chain(model.outputs.iter().map(|o| o.name.as_str())).chain(["period"]).collect();
        Err([format!("the model `{}` has no quantity `{name}`", model.name), suggest(name, &names)])
    }

    /// Converts a diagram to these units.
    pub fn diagram(&self, mut diagram: Diagram) -> Diagram {
        diagram.branches.iter_mut().for_each(|branch| self.branch(branch));
        // The parent of a switch lies in the same diagram; its free parameter is what the origin quotes.
        let frees: Vec<(String, usize)> = diagram.branches.iter().map(|b| (b.name.clone(), b.free)).collect();
        for branch in &mut diagram.branches {
            if let Origin::Switch { parent, parameter, .. } = &mut branch.origin
                && let Some((_, free)) = frees.iter().find(|(name, _)| name == parent)
            {
                *parameter = self.parameter(*free, *parameter);
            }
        }
        for set in &mut diagram.responses {
            let free = set.free;
            set.responses.iter_mut().for_each(|response| self.response(response, free));
        }
        for design in &mut diagram.designs {
            let (free, vary) = (design.free, design.vary);
            design.range = design.range.map(|value| self.parameter(free, value));
            if let Some(answer) = &mut design.answer {
                answer.value = self.parameter(vary, answer.value);
                answer.error = self.parameter(vary, answer.error);
                answer.at = self.parameter(free, answer.at);
            }
        }
        diagram
    }

    fn parameter(&self, index: usize, value: f64) -> f64 {
        self.parameters.get(index).map_or(value, |own| own.alone(value))
    }

    fn branch(&self, branch: &mut Branch) {
        branch.points.iter_mut().for_each(|point| self.point(point));
        branch.special.iter_mut().for_each(|special| self.point(&mut special.point));
        for end in branch.ends.iter_mut().flatten() {
            match end {
                Ending::Bound(value) | Ending::Joined { parameter: value, .. } => {
                    *value = self.parameter(branch.free, *value)
                }
                Ending::Connecting { parameter, period, .. } => {
                    (*parameter, *period) = (self.parameter(branch.free, *parameter), self.time.alone(*period))
                }
                Ending::PeriodUnbounded(period) => *period = self.time.alone(*period),
                _ => {}
            }
        }
    }

    /// Converts a point to these units.
    pub fn point(&self, point: &mut Point) {
        let at = point.parameters.clone();
        self.values(&mut point.parameters, &at);
        self.ranges(&mut point.ranges, &at);
        for ([mean, square], how) in point.averages.iter_mut().zip(&self.channels) {
            *mean = how.of(*mean, &at);
            *square = how.of(how.of(*square, &at), &at);
        }
        match &mut point.solution {
            Solution::Equilibrium(state) => self.states(state, &at),
            Solution::Cycle(cycle) => {
                cycle.period = self.time.of(cycle.period, &at);
                let n = self.model.states.len().max(1);
                cycle.profile.chunks_mut(n).for_each(|state| self.states(state, &at));
            }
            Solution::Torus(torus) => {
                torus.period = self.time.of(torus.period, &at);
                let n = self.model.states.len().max(1);
                torus.profile.chunks_mut(n).for_each(|state| self.states(state, &at));
            }
        }
    }

    fn response(&self, response: &mut Response, free: usize) {
        let at = response.parameters.clone();
        self.values(&mut response.parameters, &at);
        response.value = self.parameters.get(free).map_or(response.value, |how| how.of(response.value, &at));
        self.ranges(&mut response.ranges, &at);
        self.states(&mut response.state, &at);
        let width = response.ranges.len().max(1);
        response.iterates.chunks_mut(width).for_each(|iterate| self.states(iterate, &at));
        response.period = response.period.map(|period| self.time.of(period, &at));
        response.settled_after = self.time.of(response.settled_after, &at);
    }

    fn values(&self, values: &mut [f64], at: &[f64]) {
        values.iter_mut().zip(&self.parameters).for_each(|(value, how)| *value = how.of(*value, at));
    }

    fn states(&self, state: &mut [f64], at: &[f64]) {
        state.iter_mut().zip(&self.channels).for_each(|(value, how)| *value = how.of(*value, at));
    }

    fn ranges(&self, ranges: &mut [[f64; 2]], at: &[f64]) {
        for (range, how) in ranges.iter_mut().zip(&self.channels) {
            *range = range.map(|value| how.of(value, at));
            // Dividing by a negative speed exchanges minimum and maximum.
            if range[0] > range[1] {
                range.swap(0, 1);
            }
        }
    }
}

/// Conversion of a quantity to `unit`, and the label of that unit.
fn shown(model: &Model, name: &str, declared: &str, unit: &str) -> Result<(Shown, String), Refusal> {
    let lacks =
        |name: &str| [format!("{name} has no unit in the model"), "declare it in the model: `unit = \"…\"`".into()];
    let refused = |from: &str, to: &str, why: Mismatch| {
        let hint = match why {
            Mismatch::Dimension => format!("choose a unit of the same dimension as {from}"),
            Mismatch::Turns => {
                "in the model, use `rad/s` for an angular frequency and `Hz` or `rpm` for revolutions per time".into()
            }
            Mismatch::Zero => "use K on both sides for temperature differences".into(),
        };
        [format!("{name} is in {from} and cannot be shown in {to}: {why}"), hint]
    };
    let is_declared = |unit: &str| !matches!(unit, "" | "1" | "-");
    if let Some(reference) = unit.strip_prefix("orders:") {
        let Some(index) = model.parameter_index(reference) else {
            let known: Vec<&str> = model.parameters.iter().map(|p| p.name.as_str()).collect();
            return Err([format!("orders of `{reference}`: it is not a parameter"), suggest(reference, &known)]);
        };
        let other = &model.parameters[index].unit;
        let label = format!("orders of {reference}");
        return match (is_declared(declared), is_declared(other)) {
            (false, false) => Ok((Shown::Orders([1.0, 1.0], index), label)),
            (false, true) => Err(lacks(name)),
            (true, false) => Err(lacks(reference)),
            (true, true) => match Unit::read(declared).fraction_to(&Unit::read(other)) {
                Ok(fraction) => Ok((Shown::Orders(fraction, index), label)),
                Err(why) => Err(refused(declared, other, why)),
            },
        };
    }
    let wanted = Unit::read(unit);
    if !is_declared(declared) && !wanted.is_number() {
        return Err(lacks(name));
    }
    match Unit::read(declared).fraction_to(&wanted) {
        Ok([above, below]) if above == below => Ok((Shown::Own, unit.into())),
        Ok(fraction) => Ok((Shown::By(fraction), unit.into())),
        Err(why) => Err(refused(declared, unit, why)),
    }
}
