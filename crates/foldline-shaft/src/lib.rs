//! Rotors of finite elements: shafts, discs, bearings, rings.
//!
//! **Idea.** A [`Rotor`] is a list of parts. It becomes matrices ([`Assembly`]), and these become the states, equations
//! and outputs of an ordinary model ([`Assembled::extend`]), in the frame that turns with the shaft where the rotor
//! allows it. The same matrices, with coefficients evaluated by [`Machine`], give natural frequencies, Campbell diagrams,
//! critical speeds, unbalance response and sag.
//!
//! | question | answer |
//! |---|---|
//! | what are the matrices of a shaft element? | [`Section::matrices`] |
//! | in which frame are the equations constant, and why not? | [`Rotor::anisotropy`] |
//! | natural frequencies, damping, direction of whirl, shapes | [`Linear::modes`] |
//! | critical speeds, undamped and damped | [`Machine::critical_speeds`] |
//! | at which speed does a whirl close after n turns? | [`Machine::resonances`] |
//! | amplitudes under unbalance | [`Machine::unbalance_response`] |
//!
//! **Source.** friswell2010.

mod assembly;
mod campbell;
mod equations;
mod film;
mod isotropy;
mod machine;
mod modes;
mod parts;
mod response;
mod section;

pub use assembly::{Assembly, Of, Refusal, Term};
pub use campbell::Critical;
pub use equations::{Assembled, SPEED};
pub use machine::{Linear, Load, Machine};
pub use modes::{Mode, Modes, Whirl};
pub use parts::{
    Bearing, Centre, Coefficient, Contact, Damping, Disc, Element, Film, Force, Frame, Given, Law, PointMass, Rotor,
    Station, Unbalance,
};
pub use response::Orbit;
pub use section::{Matrices, Plane, Section};
