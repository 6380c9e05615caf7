//! Bouncing cycles of an overhung rotor with smooth and contact nonlinearities.
//!
//! **Source.** akay2024.

mod artefacts;
mod figure03;
mod figure04;
mod figure05;
mod figure06;
mod figure07;
mod figure08;
mod figure09;
mod figure10;
mod figure12;
mod figure14;
mod identities;
mod limits;
mod orbits;
mod rotor;
mod sharpness;
mod simulation;

use crate::publication::{FigurePlan, Publication, StudyPlan};

const MODEL: &str = include_str!("../../models/overhung-rotor.toml");

/// Defines a study of this publication by its name, file and weight.
macro_rules! study {
    ($name:literal, $weight:literal) => {
        StudyPlan {
            name: $name,
            file: concat!("akay2022/", $name, ".toml"),
            text: include_str!(concat!("../../studies/akay2022/", $name, ".toml")),
            model_file: "overhung-rotor.toml",
            model: MODEL,
            weight: $weight,
        }
    };
}

const STUDIES: &[StudyPlan] = &[
    study!("diagrams", 1.7),
    study!("far", 1.0),
    study!("lowest-part", 1.5),
    study!("flows", 2.5),
    study!("flows-light-damping", 4.0),
    study!("flows-large-unbalance", 4.0),
    study!("light-damping-cubic", 0.3),
    study!("light-damping-contact", 5.0),
    study!("light-damping-large-unbalance-cubic", 0.3),
    study!("light-damping-large-unbalance-contact", 3.0),
    study!("blunt-contact", 0.5),
    study!("limits", 4.0),
    study!("simulation", 100.0),
    study!("other-cycles", 6.0),
];

const FIGURES: &[FigurePlan] = &[
    figure03::PLAN,
    figure04::PLAN,
    figure05::PLAN,
    figure06::PLAN,
    figure07::PLAN,
    figure08::PLAN,
    figure09::PLAN,
    figure10::CUBIC,
    figure10::CONTACT,
    figure12::CUBIC,
    figure12::CONTACT,
    figure14::PLAN,
    limits::PLAN,
];

/// The publication.
pub const PUBLICATION: Publication = Publication {
    name: "akay2022",
    title: "Akay, Shaw, Friswell: Continuation analysis of overhung rotor bouncing cycles with smooth and contact nonlinearities",
    studies: STUDIES,
    figures: FIGURES,
};
