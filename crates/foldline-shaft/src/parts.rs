//! Parts of a rotor: data in SI units, with coefficients that may be expressions of the model.

use crate::section::Section;
use foldline::model::Table;

/// Number, or a number times an expression of the model; in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Coefficient {
    /// The number, or the factor of the expression.
    pub factor: f64,
    /// Expression in names of the model.
    pub text: Option<String>,
}

impl Coefficient {
    /// Zero.
    pub const ZERO: Coefficient = Coefficient { factor: 0.0, text: None };

    /// A number.
    pub fn number(value: f64) -> Coefficient {
        Coefficient { factor: value, text: None }
    }

    /// The negative of this coefficient.
    pub fn negated(&self) -> Coefficient {
        Coefficient { factor: -self.factor + 0.0, text: self.text.clone() }
    }

    /// True if the coefficient is the number 0.
    pub fn is_zero(&self) -> bool {
        self.factor == 0.0
    }

    /// Text of the coefficient for an expression of the model.
    pub fn shown(&self) -> String {
        match &self.text {
            None => number(self.factor),
            Some(text) if self.factor == 1.0 => format!("({text})"),
            Some(text) => format!("({}*({text}))", number(self.factor)),
        }
    }
}

impl std::fmt::Display for Coefficient {
    /// Formats the coefficient for a message: `1e7`, `k_b`.
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match &self.text {
            None => write!(f, "{:e}", self.factor),
            Some(text) if self.factor == 1.0 => f.write_str(text),
            Some(text) => write!(f, "{:e} {text}", self.factor),
        }
    }
}

/// A number as text that reads back exactly; negative numbers in parentheses.
pub(crate) fn number(value: f64) -> String {
    if value < 0.0 { format!("({value:?})") } else { format!("{value:?}") }
}

/// Place with two displacements and, on the shaft, two rotations.
#[derive(Clone, Debug, PartialEq)]
pub struct Station {
    /// Number of the node, or name of the support.
    pub name: String,
    /// Position along the shaft in m; `None` for a support.
    pub position: Option<f64>,
}

/// Rigid disc.
#[derive(Clone, Debug, PartialEq)]
pub struct Disc {
    /// Station.
    pub at: usize,
    /// Mass.
    pub mass: f64,
    /// Moment of inertia about a diameter.
    pub diametral: f64,
    /// Moment of inertia about the axis.
    pub polar: f64,
}

/// Mass without moments of inertia.
#[derive(Clone, Debug, PartialEq)]
pub struct PointMass {
    /// Station.
    pub at: usize,
    /// Mass.
    pub mass: f64,
}

/// Linear bearing, seal or support.
#[derive(Clone, Debug, PartialEq)]
pub struct Bearing {
    /// Station.
    pub at: usize,
    /// Station of the other end; `None` for the ground.
    pub to: Option<usize>,
    /// Stiffness [[xx, xy], [yx, yy]].
    pub stiffness: [[Coefficient; 2]; 2],
    /// Damping [[xx, xy], [yx, yy]].
    pub damping: [[Coefficient; 2]; 2],
}

/// Unbalance.
#[derive(Clone, Debug, PartialEq)]
pub struct Unbalance {
    /// Station.
    pub at: usize,
    /// Mass times eccentricity, in kg m.
    pub amount: Coefficient,
    /// Angle from the first rotating axis, in rad.
    pub phase: Coefficient,
}

/// Law of the normal force in contact.
#[derive(Clone, Debug, PartialEq)]
pub enum Law {
    /// Zero outside, linear inside.
    Piecewise,
    /// Softplus of the given width.
    Softplus(Coefficient),
    /// Linear force switched on by a hyperbolic tangent of the given width.
    Tanh(Coefficient),
}

/// Centre of a ring.
#[derive(Clone, Debug, PartialEq)]
pub enum Centre {
    /// On the line of the undeformed shaft.
    Line,
    /// On the shaft as it sags at rest.
    Sagged,
    /// At a position.
    At([Coefficient; 2]),
}

/// Ring around the shaft.
#[derive(Clone, Debug, PartialEq)]
pub struct Contact {
    /// Name.
    pub name: String,
    /// Station.
    pub at: usize,
    /// Radial clearance.
    pub clearance: Coefficient,
    /// Radial stiffness.
    pub stiffness: Coefficient,
    /// Coefficient of friction.
    pub friction: Coefficient,
    /// Radius of the shaft at the contact, from which the slip velocity follows; without it the shaft always slips
    /// forward.
    pub radius: Option<Coefficient>,
    /// Slip velocity over which friction reverses smoothly; without it friction reverses abruptly.
    pub reversal: Option<Coefficient>,
    /// Law of the normal force.
    pub law: Law,
    /// Centre.
    pub centre: Centre,
}

/// Squeeze film between a journal that does not rotate and the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Name.
    pub name: String,
    /// Station.
    pub at: usize,
    /// Radial clearance.
    pub clearance: Coefficient,
    /// Radius of the journal.
    pub radius: Coefficient,
    /// Length of the land.
    pub length: Coefficient,
    /// Dynamic viscosity.
    pub viscosity: Coefficient,
    /// True if the film cavitates where the gap opens.
    pub half: bool,
}

/// Any other force on a station, as expressions of local displacements and velocities.
#[derive(Clone, Debug, PartialEq)]
pub struct Force {
    /// Station.
    pub at: usize,
    /// Names of the functions of (x, y, vx, vy) or, in the rotating frame, of (u, v, vu, vv), one for each direction.
    pub functions: [Option<String>; 2],
    /// True if the components are along the rotating axes.
    pub rotating: bool,
}

/// Damping of the shaft, in addition to that of bearings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Damping {
    /// Factor of the mass matrix, in 1/s.
    pub mass: f64,
    /// Factor of the stiffness matrix of the shaft, in s.
    pub stiffness: f64,
    /// Damping ratios of the modes at rest, lowest first; the last applies to all further modes if `all` is true.
    pub modal: Vec<f64>,
    /// True if the single modal ratio applies to every mode.
    pub all: bool,
}

/// Matrices given as numbers, `[n][n]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Given {
    /// M.
    pub mass: Vec<Vec<f64>>,
    /// C.
    pub damping: Vec<Vec<f64>>,
    /// K.
    pub stiffness: Vec<Vec<f64>>,
    /// G.
    pub gyroscopic: Vec<Vec<f64>>,
}

/// Frame of the equations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame {
    /// Turns with the shaft; unbalance is constant.
    Rotating,
    /// Does not turn.
    Fixed,
}

/// Element of the shaft between two stations.
#[derive(Clone, Debug, PartialEq)]
pub struct Element {
    /// Left station.
    pub from: usize,
    /// Right station.
    pub to: usize,
    /// Geometry and material.
    pub section: Section,
}

/// Rotor as described by its parts.
#[derive(Clone, Debug, PartialEq)]
pub struct Rotor {
    /// Nodes of the shaft, then supports.
    pub stations: Vec<Station>,
    /// Number of nodes of the shaft.
    pub nodes: usize,
    /// Elements of the shaft.
    pub elements: Vec<Element>,
    /// Matrices given as numbers, in addition to the elements.
    pub given: Option<Given>,
    /// Discs.
    pub discs: Vec<Disc>,
    /// Point masses.
    pub masses: Vec<PointMass>,
    /// Bearings.
    pub bearings: Vec<Bearing>,
    /// Unbalances.
    pub unbalances: Vec<Unbalance>,
    /// Rings.
    pub contacts: Vec<Contact>,
    /// Squeeze films.
    pub films: Vec<Film>,
    /// Other forces.
    pub forces: Vec<Force>,
    /// Damping of the shaft.
    pub damping: Damping,
    /// Speed Ω, in rad/s.
    pub speed: Coefficient,
    /// Gravity in -y, in m/s²; zero if the model has none.
    pub gravity: Coefficient,
    /// Frame asked for.
    pub frame: Option<Frame>,
    /// Characteristic displacement, in m.
    pub scale: Option<f64>,
    /// Stations whose radius is an output, besides those with parts.
    pub probes: Vec<usize>,
    /// Coefficients of bearings as functions of speed, as tables of the model.
    pub tables: Vec<Table>,
}

impl Rotor {
    /// Number of degrees of freedom.
    pub fn dofs(&self) -> usize {
        4 * self.nodes + 2 * (self.stations.len() - self.nodes)
    }

    /// Index of the first displacement of a station; the second follows, then two rotations.
    pub fn first(&self, station: usize) -> usize {
        match station.checked_sub(self.nodes) {
            None => 4 * station,
            Some(support) => 4 * self.nodes + 2 * support,
        }
    }

    /// Station for messages: `node 6`, or the name of a support.
    pub fn called(&self, station: usize) -> String {
        match self.stations.get(station) {
            Some(Station { name, position: Some(_) }) => format!("node {name}"),
            Some(Station { name, .. }) => format!("the support `{name}`"),
            None => format!("node {station}"),
        }
    }

    /// Mass of all parts, in kg; that of given matrices is not included.
    pub fn mass(&self) -> f64 {
        self.elements.iter().map(|own| own.section.mass()).sum::<f64>()
            + self.discs.iter().map(|own| own.mass).sum::<f64>()
            + self.masses.iter().map(|own| own.mass).sum::<f64>()
    }

    /// Length of the shaft, in m.
    pub fn length(&self) -> f64 {
        let positions = self.stations.iter().filter_map(|own| own.position);
        let (low, high) = positions.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
        if high > low { high - low } else { 1.0 }
    }
}
