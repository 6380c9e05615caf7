//! Materials, shafts, discs and point masses.

use super::Draft;
use crate::model_file::Reader;
use crate::nearest::suggest;
use foldline::model::ModelSource;
use foldline_shaft::{Disc, Element, PointMass, Rotor, Section, Station};
use std::f64::consts::PI;
use std::ops::Range;
use toml::de::DeTable;

/// Maximum number of nodes: a model can have up to 1000 states.
const MOST_NODES: usize = 125;

/// Material.
pub(super) struct Material {
    name: String,
    young: f64,
    shear: f64,
    density: f64,
    internal: f64,
}

impl Reader<'_> {
    pub(super) fn materials(&mut self, root: &DeTable, source: &ModelSource, draft: &mut Draft) {
        for (span, table) in self.walk.tables(root, "material") {
            self.walk.only(table, &["name", "E", "G", "nu", "density", "internal-damping"], "the material");
            let name = table.get("name").and_then(|own| self.walk.string(own, "the name of the material"));
            let name = name.unwrap_or_default();
            let whose = if name.is_empty() { "the material".to_string() } else { format!("the material `{name}`") };
            let young = self.needed((&span, table), "E", [&whose, "Pa", "\"211 GPa\""], source);
            let density = self.needed((&span, table), "density", [&whose, "kg/m^3", "\"7810 kg/m^3\""], source);
            let shear = match (table.get("G"), table.get("nu")) {
                (Some(own), None) => self.positive(own, &format!("`G` of {whose}"), "Pa", source),
                (None, Some(own)) => {
                    let nu = self.fixed(own, &format!("`nu` of {whose}"), "1", source);
                    young.zip(nu).map(|(young, nu)| young / (2.0 * (1.0 + nu)))
                }
                _ => {
                    let hint = "give either the shear modulus, `G = \"81.2 GPa\"`, or Poisson's ratio, `nu = 0.3`";
                    self.walk.report(span.clone(), format!("{whose} needs one of `G` and `nu`"), hint);
                    None
                }
            };
            if let (Some(young), Some(shear)) = (young, shear)
                && !(-1.0..=0.5).contains(&(young / (2.0 * shear) - 1.0))
            {
                let nu = young / (2.0 * shear) - 1.0;
                let message = format!("{whose} has a Poisson's ratio E/(2G) - 1 of {nu:.3}");
                self.walk.report(span.clone(), message, "check E and G; the ratio lies between -1 and 0.5");
            }
            let internal = table.get("internal-damping");
            let what = format!("`internal-damping` of {whose}");
            let internal = internal.and_then(|own| self.fixed(own, &what, "s", source)).unwrap_or(0.0);
            if let (Some(young), Some(shear), Some(density)) = (young, shear, density) {
                draft.materials.push(Material { name, young, shear, density, internal });
            }
        }
    }

    /// Index of the material of a part: the one named, or the only one.
    fn material(&mut self, span: &Range<usize>, table: &DeTable, whose: &str, draft: &Draft) -> Option<usize> {
        let names: Vec<&str> = draft.materials.iter().map(|own| own.name.as_str()).collect();
        let Some(value) = table.get("material") else {
            if names.len() != 1 {
                let hint = if names.is_empty() {
                    "add `[[material]]` with E, G and density"
                } else {
                    "write `material = \"…\"`"
                };
                self.walk.report(span.clone(), format!("{whose} has no material"), hint);
            }
            return (names.len() == 1).then_some(0);
        };
        let name = self.walk.string(value, &format!("the material of {whose}"))?;
        let found = names.iter().position(|own| *own == name);
        if found.is_none() {
            let message = format!("{whose} is made of `{name}`, which is not a material of this file");
            self.walk.report(value.span(), message, suggest(&name, &names));
        }
        found
    }

    /// Reads the sections of the shaft, from left to right.
    pub(super) fn shafts(&mut self, root: &DeTable, source: &ModelSource, draft: &mut Draft, rotor: &mut Rotor) {
        const KEYS: [&str; 12] = [
            "length",
            "elements",
            "positions",
            "diameter",
            "right",
            "inner",
            "inner-right",
            "material",
            "axial-force",
            "shear",
            "rotary-inertia",
            "gyroscopic",
        ];
        for (k, (span, table)) in self.walk.tables(root, "shaft").into_iter().enumerate() {
            let whose = format!("section {k} of the shaft");
            self.walk.only(table, &KEYS, &whose);
            let Some(places) = self.positions(&span, table, &whose, source, rotor) else { continue };
            let outer = self.needed((&span, table), "diameter", [&whose, "m", "\"50 mm\""], source);
            let Some(outer) = outer else { continue };
            let mut size = |key: &str, otherwise: f64| match table.get(key) {
                Some(own) => self.fixed(own, &format!("`{key}` of {whose}"), "m", source),
                None => Some(otherwise),
            };
            let Some(right) = size("right", outer) else { continue };
            let Some(inner) = size("inner", 0.0) else { continue };
            let Some(inner_right) = size("inner-right", inner) else { continue };
            if right <= 0.0 || inner < 0.0 || inner_right < 0.0 || inner >= outer || inner_right >= right {
                let message = format!("{whose} has no wall: the inner diameter is not smaller than the outer one");
                self.walk.report(span.clone(), message, "check `diameter`, `right`, `inner` and `inner-right`");
                continue;
            }
            let Some(material) = self.material(&span, table, &whose, draft) else { continue };
            let axial = table.get("axial-force");
            let axial = axial.and_then(|own| self.fixed(own, &format!("`axial-force` of {whose}"), "N", source));
            let flags = ["shear", "rotary-inertia", "gyroscopic"].map(|key| self.truth(table, key, true));
            let own = &draft.materials[material];
            let total = places[places.len() - 1] - places[0];
            let along = |d: [f64; 2], z: f64| d[0] + (d[1] - d[0]) * (z - places[0]) / total;
            for pair in places.windows(2) {
                let from = rotor.nodes - 1;
                rotor.stations.push(Station { name: rotor.nodes.to_string(), position: Some(pair[1]) });
                rotor.nodes += 1;
                let section = Section {
                    length: pair[1] - pair[0],
                    outer: [pair[0], pair[1]].map(|z| along([outer, right], z)),
                    inner: [pair[0], pair[1]].map(|z| along([inner, inner_right], z)),
                    young: own.young,
                    shear: own.shear,
                    density: own.density,
                    axial: axial.unwrap_or(0.0),
                    shear_deformation: flags[0],
                    rotary_inertia: flags[1],
                    gyroscopic: flags[2],
                    internal: own.internal,
                };
                rotor.elements.push(Element { from, to: from + 1, section });
            }
        }
    }

    /// Positions of the nodes of a section, with its left end; adds the first node of the shaft.
    fn positions(
        &mut self,
        span: &Range<usize>,
        table: &DeTable,
        whose: &str,
        source: &ModelSource,
        rotor: &mut Rotor,
    ) -> Option<Vec<f64>> {
        let start = rotor.stations.last().and_then(|own| own.position);
        let places: Vec<f64> = match table.get("positions") {
            Some(value) => {
                if let Some(other) = table.get("length").or(table.get("elements")) {
                    let message = format!("{whose} has `positions` as well as `length` or `elements`");
                    self.walk.report(other.span(), message, "keep the positions, or length and number of elements");
                    return None;
                }
                let list = value.get_ref().as_array().filter(|list| list.len() >= 2);
                let Some(list) = list else {
                    let hint = "write the positions of its nodes: `positions = [\"0 m\", \"0.25 m\", \"0.5 m\"]`";
                    self.walk.report(
                        value.span(),
                        format!("`positions` of {whose} is not a list of two or more"),
                        hint,
                    );
                    return None;
                };
                let what = format!("a position of {whose}");
                let places: Option<Vec<f64>> = list.iter().map(|own| self.fixed(own, &what, "m", source)).collect();
                let places = places?;
                if places.windows(2).any(|pair| pair[1] <= pair[0]) {
                    let message = format!("the positions of {whose} do not increase");
                    self.walk.report(value.span(), message, "list the nodes from left to right");
                    return None;
                }
                if let Some(start) =
                    start.filter(|start| (start - places[0]).abs() > 1e-9 * places[places.len() - 1].abs())
                {
                    let message = format!("{whose} begins at {} m, but the shaft so far ends at {start} m", places[0]);
                    self.walk.report(
                        value.span(),
                        message,
                        "begin with the position at which the previous section ends",
                    );
                    return None;
                }
                places
            }
            None => {
                let length = self.needed((span, table), "length", [whose, "m", "\"0.5 m\""], source)?;
                let count = match table.get("elements") {
                    Some(own) => {
                        self.walk.integer(own, &format!("the number of elements of {whose}"), 1..=MOST_NODES as u64)?
                    }
                    None => 1,
                };
                let from = start.unwrap_or(0.0);
                (0..=count).map(|i| from + length * i as f64 / count as f64).collect()
            }
        };
        if rotor.nodes + places.len() > MOST_NODES {
            let message = format!("the shaft has more than {MOST_NODES} nodes");
            self.walk.report(
                span.clone(),
                message,
                "reduce the number of elements; six to ten between supports are enough",
            );
            return None;
        }
        if start.is_none() {
            rotor.stations.push(Station { name: "0".into(), position: Some(places[0]) });
            rotor.nodes = 1;
        }
        Some(places)
    }

    /// Reads supports: point masses with a name, which are not on the shaft, and point masses on the shaft.
    pub(super) fn supports(&mut self, root: &DeTable, source: &ModelSource, rotor: &mut Rotor) {
        for (span, table) in self.walk.tables(root, "point-mass") {
            self.walk.only(table, &["name", "node", "at", "mass"], "the point mass");
            let mass = self.needed((&span, table), "mass", ["the point mass", "kg", "\"5 kg\""], source);
            let at = match table.get("name") {
                Some(value) => {
                    let Some(name) = self.walk.string(value, "the name of the point mass") else { continue };
                    let named = !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_');
                    let taken = rotor.stations.iter().any(|own| own.name == name);
                    if !named || taken || name.starts_with(|c: char| c.is_ascii_digit()) {
                        let message = format!("`{name}` cannot name a support");
                        let hint = "use letters, digits and underscores, beginning with a letter, and each name once";
                        self.walk.report(value.span(), message, hint);
                        continue;
                    }
                    rotor.stations.push(Station { name, position: None });
                    Some(rotor.stations.len() - 1)
                }
                None => self.station(&span, table, "the point mass", rotor, source),
            };
            if let (Some(at), Some(mass)) = (at, mass) {
                rotor.masses.push(PointMass { at, mass });
            }
        }
    }

    pub(super) fn discs(&mut self, root: &DeTable, source: &ModelSource, draft: &Draft, rotor: &mut Rotor) {
        const KEYS: [&str; 9] = ["node", "at", "outer", "inner", "width", "material", "mass", "Id", "Ip"];
        for (k, (span, table)) in self.walk.tables(root, "disc").into_iter().enumerate() {
            let whose = format!("disc {k}");
            self.walk.only(table, &KEYS, &whose);
            let at = self.station(&span, table, &whose, rotor, source);
            let by_mass = ["mass", "Id", "Ip"].iter().any(|key| table.get(*key).is_some());
            let by_size = ["outer", "inner", "width"].iter().any(|key| table.get(*key).is_some());
            if by_mass == by_size {
                let message = format!("{whose} needs either its dimensions or its inertia");
                let hint = "give `outer`, `inner` and `width`, or `mass`, `Id` and `Ip`";
                self.walk.report(span.clone(), message, hint);
                continue;
            }
            let mut number = |key: &str, unit: &str, example: &str| {
                self.needed((&span, table), key, [&whose, unit, example], source)
            };
            let values = if by_mass {
                let mass = number("mass", "kg", "\"30 kg\"");
                let diametral = number("Id", "kg m^2", "\"0.2 kg m^2\"");
                let polar = number("Ip", "kg m^2", "\"0.4 kg m^2\"");
                mass.zip(diametral).zip(polar).map(|((mass, diametral), polar)| [mass, diametral, polar])
            } else {
                let (outer, width) = (number("outer", "m", "\"350 mm\""), number("width", "m", "\"70 mm\""));
                let inner = match table.get("inner") {
                    Some(own) => self.fixed(own, &format!("`inner` of {whose}"), "m", source),
                    None => Some(0.0),
                };
                let material = self.material(&span, table, &whose, draft);
                match (outer, width, inner, material) {
                    (Some(outer), Some(width), Some(inner), Some(material)) if inner >= 0.0 && inner < outer => {
                        Some(annulus(outer, inner, width, draft.materials[material].density))
                    }
                    (Some(_), Some(_), Some(_), Some(_)) => {
                        let message = format!("the bore of {whose} is not smaller than its outer diameter");
                        self.walk.report(span.clone(), message, "check `outer` and `inner`, which are diameters");
                        None
                    }
                    _ => None,
                }
            };
            let Some(at) = at else { continue };
            if at >= rotor.nodes {
                let message = format!("{whose} is on {}, which has no rotations", rotor.called(at));
                self.walk.report(span.clone(), message, "put it on a node of the shaft, or use `[[point-mass]]`");
                continue;
            }
            if let Some([mass, diametral, polar]) = values {
                rotor.discs.push(Disc { at, mass, diametral, polar });
            }
        }
    }
}

/// Mass, and moments of inertia about a diameter and about the axis, of a disc with a bore.
fn annulus(outer: f64, inner: f64, width: f64, density: f64) -> [f64; 3] {
    let mass = density * width * PI / 4.0 * (outer.powi(2) - inner.powi(2));
    let squares = outer.powi(2) + inner.powi(2);
    [mass, mass * (squares / 16.0 + width.powi(2) / 12.0), mass * squares / 8.0]
}
