//! Files of the HDF5 format, as much of it as NetCDF-4 needs.
//!
//! **Idea.** A [`Plan`] says first what the file will hold: groups, dimensions, variables with their shapes, attributes, texts.
//! From that follows where everything lies, so that the numbers can then be written in any order and in pieces of any size
//! ([`Laid::put`]), and never need to be in memory together.
//!
//! **Source.** hdfgroup2024 (HDF5 file format, version 3: superblock 2, object headers 2, contiguous datasets, global heaps);
//! the attributes that make a dataset a dimension: vicente2005; how NetCDF-4 uses them: unidata2024.
//!
//! **Departures.** Nothing is compressed. Links and attributes stand in the object headers, however many there are: a reader
//! does not mind.

mod heap;
mod lay;
mod lookup3;
mod messages;

pub use lay::Laid;
pub use messages::Element;

use heap::{Heaps, Lying, Place};

/// An object of a plan; 0 is the root group.
pub type Id = usize;

/// The root group.
pub const ROOT: Id = 0;

/// The longest text that is stored within an attribute; longer ones lie in a heap.
const LONGEST_WITHIN: usize = 4096;

enum Kind {
    Group {
        members: Vec<Id>,
    },
    Dataset {
        element: Element,
        dimensions: Vec<Id>,
        texts: Vec<Place>,
    },
    /// Has the values of a dataset of its own name, or none.
    Dimension {
        length: u64,
        values: Option<Element>,
        users: Vec<(Id, u32)>,
    },
}

struct Object {
    name: String,
    kind: Kind,
    attributes: Vec<(String, Value)>,
}

enum Value {
    /// With a zero at its end, as the library insists where it looks for dimensions.
    Ended(String),
    Short(String),
    Long(Place),
    Real(f64),
    Integer(i64),
}

/// What a file will hold.
pub struct Plan {
    objects: Vec<Object>,
    heaps: Heaps,
    lists: Vec<(Id, Vec<Place>)>,
}

impl Default for Plan {
    fn default() -> Plan {
        let root = Object { name: String::new(), kind: Kind::Group { members: Vec::new() }, attributes: Vec::new() };
        Plan { objects: vec![root], heaps: Heaps::default(), lists: Vec::new() }
    }
}

impl Plan {
    /// A group in the group `parent`.
    pub fn group(&mut self, parent: Id, name: &str) -> Id {
        self.add(parent, name, Kind::Group { members: Vec::new() })
    }

    /// A dimension of a length that is not 0; it has values where `values` says of which kind.
    pub fn dimension(&mut self, parent: Id, name: &str, length: u64, values: Option<Element>) -> Id {
        let id = self.add(parent, name, Kind::Dimension { length, values, users: Vec::new() });
        let own = match values {
            Some(_) => name.to_string(),
            None => format!("This is a netCDF dimension but not a netCDF variable. {length:10}"),
        };
        for (name, value) in [("CLASS", "DIMENSION_SCALE"), ("NAME", &own)] {
            self.objects[id].attributes.push((name.to_string(), Value::Ended(value.to_string())));
        }
        id
    }

    /// A variable over dimensions, the slowest first.
    pub fn variable(&mut self, parent: Id, name: &str, element: Element, dimensions: &[Id]) -> Id {
        let id = self.add(parent, name, Kind::Dataset { element, dimensions: dimensions.to_vec(), texts: Vec::new() });
        for (k, dimension) in dimensions.iter().enumerate() {
            if let Kind::Dimension { users, .. } = &mut self.objects[*dimension].kind {
                users.push((id, k as u32));
            }
        }
        let places = dimensions.iter().map(|id| self.heaps.lay(Lying::Reference(*id))).collect();
        self.lists.push((id, places));
        id
    }

    /// A variable of texts, with all of them.
    pub fn texts(&mut self, parent: Id, name: &str, dimension: Id, values: impl Iterator<Item = String>) -> Id {
        let id = self.variable(parent, name, Element::Text, &[dimension]);
        let places: Vec<Place> = values.map(|text| self.heaps.lay(Lying::Text(text.into_bytes()))).collect();
        if let Kind::Dataset { texts, .. } = &mut self.objects[id].kind {
            *texts = places;
        }
        id
    }

    /// An attribute that is a text.
    pub fn text(&mut self, id: Id, name: &str, value: &str) {
        let value = match value.len() <= LONGEST_WITHIN && !value.is_empty() {
            true => Value::Short(value.to_string()),
            false => Value::Long(self.heaps.lay(Lying::Text(value.into()))),
        };
        self.objects[id].attributes.push((name.to_string(), value));
    }

    /// An attribute that is a number.
    pub fn real(&mut self, id: Id, name: &str, value: f64) {
        self.objects[id].attributes.push((name.to_string(), Value::Real(value)));
    }

    /// An attribute that is an integer.
    pub fn integer(&mut self, id: Id, name: &str, value: i64) {
        self.objects[id].attributes.push((name.to_string(), Value::Integer(value)));
    }

    fn add(&mut self, parent: Id, name: &str, kind: Kind) -> Id {
        let id = self.objects.len();
        self.objects.push(Object { name: name.to_string(), kind, attributes: Vec::new() });
        if let Kind::Group { members } = &mut self.objects[parent].kind {
            members.push(id);
        }
        id
    }
}
