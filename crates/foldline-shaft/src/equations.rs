//! Equations of motion of a rotor as a model.
//!
//! **Idea.** For every degree of freedom a definition collects the generalised force, a sparse sum; the accelerations
//! are the constant inverse of the mass matrix times these forces. An equilibrium is therefore a zero of the sparse
//! forces, computed as accurately as the stiffness matrix allows, and the derivatives of the linear part are polynomials
//! in Ω with constant coefficients.
//!
//! **Equations.** Fixed frame, coordinates q, and rotating frame, q = R(Ωt) p:
//!
//! 1. f = -(K - ΩCᵢJ) q - (C + Cᵢ + ΩG) q̇ + F,   q̈ = M⁻¹ f
//! 2. f = -(K + ΩCJ + Ω²(GJ - M)) p - (C + Cᵢ + Ω(G + 2MJ)) ṗ + F,   p̈ = M⁻¹ f
//! 3. inertial velocities along the rotating axes: vu = u′ - Ωv, vv = v′ + Ωu
//!
//! **Source.** friswell2010, sections 5 and 7 (rotating coordinates).

use crate::assembly::{Assembly, Of, Refusal, turned};
use crate::film;
use crate::parts::{Centre, Coefficient, Contact, Frame, Law, Rotor, number};
use foldline::model::{Definition, Forcing, ModelSource, Output, State, constant_value};
use foldline_general::{Factored, Mat};

/// Name of the definition of Ω in rad/s.
pub const SPEED: &str = "rotor_speed";

/// Largest number of nodes for which every radius is an output.
const ALL_NODES: usize = 12;

/// Rotor with its matrices and the frame of its equations.
#[derive(Clone, Debug)]
pub struct Assembled {
    /// Parts.
    pub rotor: Rotor,
    /// Matrices.
    pub assembly: Assembly,
    /// Frame.
    pub frame: Frame,
    /// Reasons why the rotating frame is impossible.
    pub anisotropy: Vec<String>,
}

impl Assembled {
    /// Assembles a rotor and chooses its frame.
    ///
    /// # Errors
    /// See [`Assembly::new`]; a rotating frame that the rotor does not allow.
    pub fn new(mut rotor: Rotor) -> Result<Assembled, Refusal> {
        let assembly = Assembly::new(&rotor)?;
        centre_on_sag(&mut rotor, &assembly)?;
        let anisotropy = rotor.anisotropy(&assembly);
        let frame = rotor.frame_for(&anisotropy);
        if frame == Frame::Rotating && !anisotropy.is_empty() {
            let message = format!("the equations are not constant in the rotating frame: {}", anisotropy.join("; "));
            return Err([message, "write `frame = \"fixed\"`, or make the rotor isotropic".into()]);
        }
        Ok(Assembled { rotor, assembly, frame, anisotropy })
    }

    /// Names of the displacements and rotations, in the order of the matrices.
    pub fn coordinates(&self) -> Vec<String> {
        let [x, y] = self.axes();
        let mut names = Vec::with_capacity(self.rotor.dofs());
        for (k, station) in self.rotor.stations.iter().enumerate() {
            let s = &station.name;
            names.extend([format!("{x}_{s}"), format!("{y}_{s}")]);
            if k < self.rotor.nodes {
                names.extend([format!("theta_{x}_{s}"), format!("theta_{y}_{s}")]);
            }
        }
        names
    }

    /// Names of the axes of the frame.
    pub fn axes(&self) -> [&'static str; 2] {
        if self.frame == Frame::Rotating { ["u", "v"] } else { ["x", "y"] }
    }

    /// Adds states, definitions, equations and outputs of the rotor to a model.
    ///
    /// # Errors
    /// A mass matrix that cannot be inverted.
    pub fn extend(&self, source: &mut ModelSource) -> Result<(), Refusal> {
        let names = self.coordinates();
        source.tables.extend(self.rotor.tables.iter().cloned());
        source.definitions.push(Definition::new(SPEED, &self.rotor.speed.shown()));
        let mut forces = self.linear(&names);
        self.terms(&names, &mut forces);
        self.loads(&names, source, &mut forces);
        for (k, force) in forces.into_iter().enumerate() {
            let text = if force.is_empty() { "0".to_string() } else { force };
            source.definitions.push(Definition::new(&format!("rotor_f_{k}"), &text));
        }
        self.states(&names, source)?;
        self.outputs(&names, source);
        if self.frame == Frame::Fixed && self.forced() && source.forcing.is_none() {
            source.forcing = Some(Forcing { is_frequency: true, expression: SPEED.into() });
        }
        Ok(())
    }

    /// True if some force depends on the time in the fixed frame.
    fn forced(&self) -> bool {
        self.rotor.unbalances.iter().any(|own| !own.amount.is_zero())
    }

    /// Linear forces with constant coefficients.
    fn linear(&self, names: &[String]) -> Vec<String> {
        let Assembly { mass, damping, internal, gyroscopic, stiffness, .. } = &self.assembly;
        let n = names.len();
        let entry = |f: &dyn Fn(usize, usize) -> f64| Mat::from_fn(n, n, f);
        let (position, velocity) = match self.frame {
            Frame::Fixed => {
                let circulating = turned(internal);
                (
                    vec![entry(&|i, j| -stiffness[(i, j)]), circulating],
                    vec![entry(&|i, j| -damping[(i, j)] - internal[(i, j)]), entry(&|i, j| -gyroscopic[(i, j)])],
                )
            }
            Frame::Rotating => {
                let (cj, gj, mj) = (turned(damping), turned(gyroscopic), turned(mass));
                (
                    vec![
                        entry(&|i, j| -stiffness[(i, j)]),
                        entry(&|i, j| -cj[(i, j)]),
                        entry(&|i, j| mass[(i, j)] - gj[(i, j)]),
                    ],
                    vec![
                        entry(&|i, j| -damping[(i, j)] - internal[(i, j)]),
                        entry(&|i, j| -gyroscopic[(i, j)] - 2.0 * mj[(i, j)]),
                    ],
                )
            }
        };
        let row = |i: usize| {
            let mut text = String::new();
            for power in 0..3 {
                let mut sum = String::new();
                for (matrices, prime) in [(&position, ""), (&velocity, "'")] {
                    let Some(matrix) = matrices.get(power) else { continue };
                    for j in (0..n).filter(|&j| matrix[(i, j)] != 0.0) {
                        product(&mut sum, matrix[(i, j)], &format!("{}{prime}", names[j]));
                    }
                }
                if !sum.is_empty() {
                    let plus = if text.is_empty() { "" } else { " + " };
                    match power {
                        0 => text.push_str(&sum),
                        1 => text.push_str(&format!("{plus}{SPEED}*({sum})")),
                        _ => text.push_str(&format!("{plus}{SPEED}^2*({sum})")),
                    }
                }
            }
            text
        };
        (0..n).map(row).collect()
    }

    /// Linear forces whose coefficients are expressions.
    fn terms(&self, names: &[String], forces: &mut [String]) {
        for term in &self.assembly.terms {
            let j = term.column;
            let of = match (term.of, self.frame) {
                (Of::Stiffness, _) => names[j].clone(),
                (Of::Damping, Frame::Fixed) => format!("{}'", names[j]),
                (Of::Damping, Frame::Rotating) => self.inertial(names, j),
            };
            forces[term.row].push_str(&format!(" - {}*{of}", term.coefficient.shown()));
        }
    }

    /// Velocity of a coordinate in an inertial frame, along the axes of the frame.
    fn inertial(&self, names: &[String], j: usize) -> String {
        match (self.frame, j % 2) {
            (Frame::Fixed, _) => format!("{}'", names[j]),
            (Frame::Rotating, 0) => format!("({}' - {SPEED}*{})", names[j], names[j + 1]),
            (Frame::Rotating, _) => format!("({}' + {SPEED}*{})", names[j], names[j - 1]),
        }
    }

    /// Unbalance, gravity, rings and other forces.
    fn loads(&self, names: &[String], source: &mut ModelSource, forces: &mut [String]) {
        let mut define = |name: String, text: String| source.definitions.push(Definition::new(&name, &text));
        for own in self.rotor.unbalances.iter().filter(|own| !own.amount.is_zero()) {
            let (first, size, phase) = (self.rotor.first(own.at), own.amount.shown(), own.phase.shown());
            let angle = match self.frame {
                Frame::Rotating => phase,
                Frame::Fixed => format!("{SPEED}*t + {phase}"),
            };
            for (k, function) in ["cos", "sin"].into_iter().enumerate() {
                forces[first + k].push_str(&format!(" + {size}*{SPEED}^2*{function}({angle})"));
            }
        }
        if !self.rotor.gravity.is_zero() {
            let mass = &self.assembly.mass;
            for (i, force) in forces.iter_mut().enumerate() {
                let weight: f64 = (0..self.rotor.stations.len()).map(|s| mass[(i, self.rotor.first(s) + 1)]).sum();
                if weight != 0.0 {
                    product(force, -weight, &self.rotor.gravity.shown());
                }
            }
        }
        for own in &self.rotor.contacts {
            let first = self.rotor.first(own.at);
            for (name, text) in self.ring(own, names) {
                define(name, text);
            }
            for (k, axis) in self.axes().into_iter().enumerate() {
                forces[first + k].push_str(&format!(" + rotor_{}_{axis}", own.name));
            }
        }
        for own in &self.rotor.films {
            let first = self.rotor.first(own.at);
            let velocities = [self.inertial(names, first), self.inertial(names, first + 1)];
            let places = [names[first].as_str(), names[first + 1].as_str()];
            for (name, text) in film::definitions(own, places, velocities.each_ref().map(String::as_str), self.axes()) {
                define(name, text);
            }
            for (k, axis) in self.axes().into_iter().enumerate() {
                forces[first + k].push_str(&format!(" + rotor_{}_{axis}", own.name));
            }
        }
        for own in &self.rotor.forces {
            let first = self.rotor.first(own.at);
            let [x, y] = [&names[first], &names[first + 1]];
            let [vx, vy] = [self.inertial(names, first), self.inertial(names, first + 1)];
            for (k, function) in own.functions.iter().enumerate() {
                if let Some(function) = function {
                    forces[first + k].push_str(&format!(" + {function}({x}, {y}, {vx}, {vy})"));
                }
            }
        }
    }

    /// Definitions of the force of a ring: distance from its centre, radial force over distance, both components.
    fn ring(&self, own: &Contact, names: &[String]) -> Vec<(String, String)> {
        let first = self.rotor.first(own.at);
        let [ax, ay] = self.axes();
        let name = |what: &str| format!("rotor_{}_{what}", own.name);
        let offset = |k: usize| match &own.centre {
            Centre::At(at) if !at[k].is_zero() => format!("({} - {})", names[first + k], at[k].shown()),
            _ => names[first + k].clone(),
        };
        let [x, y] = [offset(0), offset(1)];
        let (d, c, k) = (name("d"), own.clearance.shown(), own.stiffness.shown());
        let per = match &own.law {
            Law::Piecewise => format!("if({d} > {c}, {k}*(1 - {c}/{d}), 0)"),
            // ln(1 + e^s) written so that nothing overflows.
            Law::Softplus(width) => {
                let (w, s) = (width.shown(), format!("(({d} - {c})/{})", width.shown()));
                format!("if({d} > 0, {k}*{w}*(({s} + abs({s}))/2 + log1p(exp(-abs({s}))))/{d}, 0)")
            }
            Law::Tanh(width) => {
                format!("if({d} > 0, {k}*(1 - {c}/{d})*(tanh(({d} - {c})/{}) + 1)/2, 0)", width.shown())
            }
        };
        let mut list = vec![(d.clone(), format!("hypot({x}, {y})")), (name("h"), per)];
        let mut radial = [format!("-{}*{x}", name("h")), format!("-{}*{y}", name("h"))];
        if !own.friction.is_zero() {
            let direction = match &own.radius {
                None => format!("sign({SPEED})"),
                Some(radius) => {
                    let [vx, vy] = [self.inertial(names, first), self.inertial(names, first + 1)];
                    // Slip velocity times distance, which has its sign and no division.
                    let slip = format!("({x}*{vy} - {y}*{vx} + {}*{SPEED}*{d})", radius.shown());
                    match &own.reversal {
                        None => format!("sign({slip})"),
                        // At the centre nothing touches, and the direction of slip is not defined.
                        Some(width) => format!("if({d} > 0, tanh({slip}/({}*{d})), 0)", width.shown()),
                    }
                }
            };
            list.push((name("mu"), format!("{}*{direction}", own.friction.shown())));
            radial[0].push_str(&format!(" + {}*{}*{y}", name("mu"), name("h")));
            radial[1].push_str(&format!(" - {}*{}*{x}", name("mu"), name("h")));
        }
        let [fx, fy] = radial;
        list.extend([(name(ax), fx), (name(ay), fy)]);
        list
    }

    fn states(&self, names: &[String], source: &mut ModelSource) -> Result<(), Refusal> {
        let n = names.len();
        let inverse = Factored::new(self.assembly.mass.as_ref()).solve(&Mat::identity(n, n));
        if (0..n).any(|i| (0..n).any(|j| !inverse[(i, j)].is_finite())) {
            return Err(["the mass matrix cannot be inverted".into(), "check masses and moments of inertia".into()]);
        }
        let [length, angle] = self.sizes(source);
        let rate = self.value(&self.rotor.speed, source).map(f64::abs).filter(|rate| *rate > 0.0);
        for (i, name) in names.iter().enumerate() {
            let rotation = name.starts_with("theta_");
            let (unit, scale) = if rotation { ("rad", angle) } else { ("m", length) };
            let velocity = format!("{name}'");
            let what = if rotation { "rotation about" } else { "displacement along" };
            let description = format!("{what} {}", self.place(i));
            let speed = scale.zip(rate).map(|(scale, rate)| scale * rate);
            source.states.push(State { unit: unit.into(), description, scale, ..State::new(name) });
            source.states.push(State { unit: format!("{unit}/s"), scale: speed, ..State::new(&velocity) });
            source.equations.push(Definition::new(name, &velocity));
            let mut sum = String::new();
            for j in (0..n).filter(|&j| inverse[(i, j)] != 0.0) {
                product(&mut sum, inverse[(i, j)], &format!("rotor_f_{j}"));
            }
            source.equations.push(Definition::new(&velocity, &sum));
        }
        let at = self.principal();
        let first = self.rotor.first(at);
        source.whirl.get_or_insert_with(|| [names[first].clone(), names[first + 1].clone()]);
        Ok(())
    }

    /// Axis and station of a degree of freedom.
    fn place(&self, i: usize) -> String {
        let station = (0..self.rotor.stations.len()).rev().find(|s| self.rotor.first(*s) <= i).unwrap_or(0);
        let axis = self.axes()[i % 2];
        format!("the {axis} axis at {}", self.rotor.called(station))
    }

    /// Station of most interest: that of a ring, else of an unbalance, a disc or the first node.
    fn principal(&self) -> usize {
        let rotor = &self.rotor;
        let ring = rotor.contacts.first().map(|own| own.at);
        let ring = ring.or(rotor.films.first().map(|own| own.at));
        ring.or(rotor.unbalances.first().map(|own| own.at)).or(rotor.discs.first().map(|own| own.at)).unwrap_or(0)
    }

    /// Characteristic displacement and rotation.
    fn sizes(&self, source: &ModelSource) -> [Option<f64>; 2] {
        let rings = self.rotor.contacts.iter().map(|own| &own.clearance);
        let gaps = rings.chain(self.rotor.films.iter().map(|own| &own.clearance));
        let clearances = gaps.filter_map(|own| self.value(own, source));
        let smallest = clearances.filter(|c| *c > 0.0).fold(f64::INFINITY, f64::min);
        let eccentric = || {
            let amounts = self.rotor.unbalances.iter().filter_map(|own| self.value(&own.amount, source));
            let total: f64 = amounts.map(f64::abs).sum();
            // The eccentricity of the whole mass is the amplitude far above the critical speeds.
            Some(total / self.rotor.mass()).filter(|e| *e > 0.0 && e.is_finite())
        };
        let length = self.rotor.scale.or(Some(smallest).filter(|c| c.is_finite())).or_else(eccentric);
        [length, length.map(|own| own * std::f64::consts::PI / self.rotor.length())]
    }

    /// Value of a coefficient with the parameters as the model gives them; `None` if it depends on more than that.
    pub(crate) fn value(&self, own: &Coefficient, source: &ModelSource) -> Option<f64> {
        let Some(text) = &own.text else { return Some(own.factor) };
        let mut known = source.constants.clone();
        known.extend(source.parameters.iter().map(|p| foldline::model::Constant::new(&p.name, p.value)));
        constant_value(text, &known).ok().map(|value| own.factor * value)
    }

    fn outputs(&self, names: &[String], source: &mut ModelSource) {
        let mut add = |name: String, expression: String, unit: &str, description: String| {
            // An output of the file with that name takes precedence.
            if source.outputs.iter().all(|own| own.name != name) {
                source.outputs.push(Output { unit: unit.into(), description, ..Output::new(&name, &expression) });
            }
        };
        for s in self.shown_stations() {
            let first = self.rotor.first(s);
            let text = format!("hypot({}, {})", names[first], names[first + 1]);
            let what = format!("distance of {} from the line of the undeformed shaft", self.rotor.called(s));
            add(format!("r_{}", self.rotor.stations[s].name), text, "m", what);
        }
        for own in &self.rotor.contacts {
            let [d, h] = ["d", "h"].map(|what| format!("rotor_{}_{what}", own.name));
            let what = format!("normal force of the ring `{}`", own.name);
            add(format!("force_{}", own.name), format!("{h}*{d}"), "N", what);
            let text = format!("max({d} - {}, 0)", own.clearance.shown());
            add(format!("penetration_{}", own.name), text, "m", format!("penetration into the ring `{}`", own.name));
        }
        for own in &self.rotor.films {
            let what =
                format!("distance of the journal from the centre of the film `{}`, over its clearance", own.name);
            add(format!("eccentricity_{}", own.name), format!("rotor_{}_eps", own.name), "1", what);
        }
        if let Some(power) = self.power(names) {
            add("power".into(), power, "W", "power that the drive supplies to hold the speed".into());
        }
    }

    /// Stations whose radius is an output: the principal one first.
    fn shown_stations(&self) -> Vec<usize> {
        let rotor = &self.rotor;
        let mut list = vec![self.principal()];
        list.extend(rotor.contacts.iter().map(|own| own.at));
        list.extend(rotor.films.iter().map(|own| own.at));
        list.extend(rotor.probes.iter().copied());
        list.extend(rotor.unbalances.iter().map(|own| own.at));
        list.extend(rotor.forces.iter().map(|own| own.at));
        list.extend(rotor.discs.iter().map(|own| own.at));
        list.extend(rotor.bearings.iter().map(|own| own.at));
        if rotor.stations.len() <= ALL_NODES {
            list.extend(0..rotor.stations.len());
        }
        let mut seen = Vec::new();
        list.into_iter()
            .filter(|s| {
                !seen.contains(s) && {
                    seen.push(*s);
                    true
                }
            })
            .collect()
    }

    /// Power of the unbalance forces and of friction at the circumference.
    fn power(&self, names: &[String]) -> Option<String> {
        let mut text = String::new();
        for own in self.rotor.unbalances.iter().filter(|own| !own.amount.is_zero()) {
            let (first, size, phase) = (self.rotor.first(own.at), own.amount.shown(), own.phase.shown());
            let angle = match self.frame {
                Frame::Rotating => phase,
                Frame::Fixed => format!("{SPEED}*t + {phase}"),
            };
            let [vx, vy] = [self.inertial(names, first), self.inertial(names, first + 1)];
            text.push_str(&format!(" + {size}*{SPEED}^2*(cos({angle})*{vx} + sin({angle})*{vy})"));
        }
        for own in self.rotor.contacts.iter().filter(|own| !own.friction.is_zero()) {
            if let Some(radius) = &own.radius {
                let [mu, h, d] = ["mu", "h", "d"].map(|what| format!("rotor_{}_{what}", own.name));
                text.push_str(&format!(" + {mu}*{h}*{d}*{}*{SPEED}", radius.shown()));
            }
        }
        (!text.is_empty()).then(|| text.trim_start_matches(" + ").to_string())
    }
}

/// Replaces rings centred on the sagged shaft by rings at these positions.
fn centre_on_sag(rotor: &mut Rotor, assembly: &Assembly) -> Result<(), Refusal> {
    if rotor.contacts.iter().all(|own| own.centre != Centre::Sagged) {
        return Ok(());
    }
    let variable = rotor.gravity.text.is_some() || assembly.terms.iter().any(|term| term.of == Of::Stiffness);
    if variable {
        let message = "a ring is centred on the sagged shaft, but the sag depends on expressions".to_string();
        let cure =
            "give gravity and stiffnesses as numbers or [constants], or the centre as `centre = [\"0 mm\", \"-1 mm\"]`";
        return Err([message, cure.into()]);
    }
    let sag = sag(&assembly.stiffness, &assembly.mass, rotor, rotor.gravity.factor);
    for k in 0..rotor.contacts.len() {
        if rotor.contacts[k].centre != Centre::Sagged {
            continue;
        }
        let first = rotor.first(rotor.contacts[k].at);
        rotor.contacts[k].centre = match &sag {
            _ if rotor.gravity.is_zero() => Centre::Line,
            Some(sag) => Centre::At([sag[first], sag[first + 1]].map(Coefficient::number)),
            None => {
                let message = format!("the sag for the ring `{}` cannot be computed", rotor.contacts[k].name);
                return Err([message, "support the shaft by bearings with stiffness".into()]);
            }
        };
    }
    Ok(())
}

/// Static displacements under gravity in -y; `None` if the stiffness matrix is singular.
pub(crate) fn sag(stiffness: &Mat<f64>, mass: &Mat<f64>, rotor: &Rotor, gravity: f64) -> Option<Vec<f64>> {
    let n = stiffness.nrows();
    let weight = |i: usize| (0..rotor.stations.len()).map(|s| mass[(i, rotor.first(s) + 1)]).sum::<f64>();
    let right = Mat::from_fn(n, 1, |i, _| -gravity * weight(i));
    let found = Factored::new(stiffness.as_ref()).solve(&right);
    let size = (0..n).map(|i| stiffness[(i, i)].abs()).fold(0.0, f64::max);
    let residual = (0..n).map(|i| {
        let sum: f64 = (0..n).map(|j| stiffness[(i, j)] * found[(j, 0)]).sum();
        (sum - right[(i, 0)]).abs()
    });
    let largest = (0..n).map(|j| found[(j, 0)].abs()).fold(0.0, f64::max);
    let finite = (0..n).all(|j| found[(j, 0)].is_finite());
    let solved = finite && residual.fold(0.0, f64::max) <= 1e-9 * size * largest && largest < 1e3;
    (solved || gravity == 0.0).then(|| (0..n).map(|i| if gravity == 0.0 { 0.0 } else { found[(i, 0)] }).collect())
}

/// Appends a product to a sum.
fn product(sum: &mut String, factor: f64, name: &str) {
    let sign = match (sum.is_empty(), factor < 0.0) {
        (true, false) => "",
        (true, true) => "-",
        (false, false) => " + ",
        (false, true) => " - ",
    };
    sum.push_str(sign);
    sum.push_str(&number(factor.abs()));
    sum.push('*');
    sum.push_str(name);
}
