//! The ensemble of a model as CUDA C source, one trajectory per thread.
//!
//! **Idea.** The tapes of a model and the method of [`crate::simulation::Ensemble`] are written as one self-contained
//! text. Compiled by `nvcc` or at run time, it is a kernel for NVIDIA cards; compiled by any C compiler, it is a
//! function that computes the same trajectories on the processor, by which it is tested.
//!
//! | part of the text | file |
//! |---|---|
//! | macros for both compilers, elementary functions | `text/head.c`, `text/functions.c` |
//! | the model | `crate::model` |
//! | steps, switches, sections, settling | `text/step.c`, `switches.c`, `section.c`, `settle.c` |
//! | trajectories one after the other | `text/run.c` |
//!
//! **Source.** Those of [`crate::simulation`] and, for settling, of [`crate::attractors`].
//!
//! **Departures.** On a card, products and sums are contracted, and step lengths are computed in single precision
//! unless `FL_EXACT_CONTROL` is defined: they differ from those on the processor in the sixth digit. A stiff trajectory
//! stays with the explicit pair. A trajectory that begins to slide along a surface ends there, as [`Fate::Slides`].
//! Trajectories are compared with known solutions every 16 steps tried instead of accepted.
//!
//! **Fails when** the model is a map.

mod job;

pub use job::{Fate, LAYOUT, LAYOUT_SECTION, LAYOUT_SETTLE, Layout};

use crate::contract::VectorField;
use crate::model::{Functions, Model, functions};
use std::fmt;

/// Optional parts of the source.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Parts {
    /// Every trajectory has parameters of its own.
    pub own_parameters: bool,
    /// Trajectories end where they have settled on a known solution.
    pub settle: bool,
    /// Crossings of a plane, or states at multiples of a time, are recorded.
    pub section: bool,
}

/// Source of the ensemble of a model.
#[derive(Clone, Debug)]
pub struct Emitted {
    /// CUDA C, and C.
    pub source: String,
    /// Number of states of a trajectory: those of the model, and for a forced model the time in forcing periods.
    pub states: usize,
    /// Number of values that depend on the parameters alone.
    pub scalars: usize,
    functions: Functions,
}

/// Reason why a model has no such source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refused {
    /// It is a map.
    Map,
    /// It has events.
    Events,
}

impl fmt::Display for Refused {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        to.write_str(match self {
            Refused::Map => "the model is a map, which is iterated rather than integrated",
            Refused::Events => "the model has events, at which its state jumps; emitted source does not have them",
        })
    }
}

impl Emitted {
    /// Writes the source of a model.
    pub fn new(model: &Model, parts: Parts) -> Result<Emitted, Refused> {
        if model.iterated() {
            return Err(Refused::Map);
        }
        if model.event_count() > 0 {
            return Err(Refused::Events);
        }
        let functions = functions(model);
        let states = model.dim() + usize::from(model.forced());
        let flag = |on: bool| if on { 1 } else { 0 };
        let sizes = [
            ("N", states),
            ("PARAMETERS", model.parameter_count()),
            ("SCALARS", functions.scalars.max(1)),
            ("SWITCHES", model.switch_count()),
            ("OWN", flag(parts.own_parameters)),
            ("SETTLE", flag(parts.settle)),
            ("SECTION", flag(parts.section)),
        ];
        let defined: String = sizes.iter().map(|(name, value)| format!("#define FL_{name} {value}\n")).collect();
        let time = if model.forced() { "((x)[FL_N - 1])" } else { "0.0" };
        let source = [
            &format!("/* Ensembles of the model \"{}\". Written by foldline. */\n\n", plain(&model.name)),
            &format!("{defined}#define FL_BOUND 1e12\n#define FL_TIME(x) {time}\n\n"),
            include_str!("text/head.c"),
            include_str!("text/functions.c"),
            "\n/* The model: x' = f(x, t), with values s that depend on the parameters p alone, its switches h, f with given\n   \
             signs g of these, and their rates of change on both sides of the surface of one. */\n\n",
            &functions.text,
            include_str!("text/step.c"),
            include_str!("text/switches.c"),
            include_str!("text/settle.c"),
            include_str!("text/section.c"),
            include_str!("text/run.c"),
        ]
        .join("\n");
        Ok(Emitted { source, states, scalars: functions.scalars.max(1), functions })
    }

    /// Values that depend on the parameters `[k]` alone: the member `s` of the job.
    pub fn scalars(&self, parameters: &[f64]) -> Vec<f64> {
        let mut values = self.functions.values(parameters);
        values.resize(self.scalars, 0.0);
        values
    }
}

/// C text of a program that runs a job on the processor, to be appended to a source.
pub const HOST: &str = include_str!("text/host.c");

/// A name without the characters that would end a comment.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_control() || c == '*' || c == '\\' { ' ' } else { c }).collect()
}
