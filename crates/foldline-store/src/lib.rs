//! File input and output: model and study files are read, run files are read and written.
//!
//! **Idea.** The mathematics is independent of files. Here a study file is parsed into a plan ([`study_file`]) and a
//! model file into a model ([`model_file`]). A growing diagram is stored in a database that survives a crash
//! ([`run_file`]) and can be exported to other formats ([`export`]). Every mistake in a text is reported with its
//! position ([`diagnostic`]).

pub mod auto;
pub mod diagnostic;
mod elsewhere;
pub mod export;
pub mod finite;
pub mod maps;
pub mod model_file;
pub mod nearest;
pub mod order;
pub mod run_file;
pub mod short;
mod slips;
pub mod study_file;
mod text_file;
mod toml_walk;
