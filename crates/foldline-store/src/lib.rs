//! Bytes to types and back: model files and study files in, the run file in and out.
//!
//! **Idea.** The mathematics knows no files. Here a study text becomes a plan ([`study_file`]), a model text a model
//! ([`model_file`]), and a growing diagram a database that survives being killed ([`run_file`]), from which other formats follow ([`export`]). Whatever is wrong with
//! a text is said with its place ([`diagnostic`]).

pub mod auto;
pub mod diagnostic;
pub mod export;
pub mod finite;
pub mod model_file;
pub mod nearest;
pub mod order;
pub mod run_file;
pub mod short;
pub mod study_file;
mod toml_walk;
