//! Writer of the subset of HDF5 that NetCDF-4 needs.
//!
//! **Idea.** A [`Plan`] first lists the contents of the file: groups, dimensions, variables with their shapes,
//! attributes and texts. The layout follows from it. The numbers can then be written in any order and in pieces of any
//! size ([`Laid::put`]) and need not be in memory together.
//!
//! **Source.** hdfgroup2024 (HDF5 file format, version 3: superblock 2, object headers 2, contiguous datasets, global
//! heaps); vicente2005 for the attributes that make a dataset a dimension; unidata2024 for their use in NetCDF-4.
//!
//! **Departures.** Nothing is compressed. Links and attributes are stored in the object headers regardless of their
//! number; readers accept this.

mod heap;
mod lay;
mod lookup3;
mod messages;

pub use lay::Laid;
pub use messages::Element;

use heap::{Heaps, Lying, Place};

/// Index of an object of a plan; 0 is the root group.
pub type Id = usize;

/// Root group.
pub const ROOT: Id = 0;

/// Longest text in bytes that is stored within an attribute; longer texts are stored in a heap.
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
    /// Dimension, with the values of a variable of the same name or without values.
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
    /// Null-terminated, as the HDF5 library requires of the attributes of dimensions.
    Ended(String),
    Short(String),
    Long(Place),
    Real(f64),
    Integer(i64),
}

/// Planned contents of a file.
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
    /// Adds a group to the group `parent`.
    pub fn group(&mut self, parent: Id, name: &str) -> Id {
        self.add(parent, name, Kind::Group { members: Vec::new() })
    }

    /// Adds a dimension of nonzero length. If it has values, `values` is their type.
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

    /// Adds a variable over the given dimensions, the slowest first.
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

    /// Adds a variable of texts over the given dimensions, with its values.
    pub fn texts(&mut self, parent: Id, name: &str, dimensions: &[Id], values: impl Iterator<Item = String>) -> Id {
        let id = self.variable(parent, name, Element::Text, dimensions);
        let places: Vec<Place> = values.map(|text| self.heaps.lay(Lying::Text(text.into_bytes()))).collect();
        if let Kind::Dataset { texts, .. } = &mut self.objects[id].kind {
            *texts = places;
        }
        id
    }

    /// Adds a text attribute.
    pub fn text(&mut self, id: Id, name: &str, value: &str) {
        let value = match value.len() <= LONGEST_WITHIN && !value.is_empty() {
            true => Value::Short(value.to_string()),
            false => Value::Long(self.heaps.lay(Lying::Text(value.into()))),
        };
        self.objects[id].attributes.push((name.to_string(), value));
    }

    /// Adds a floating-point attribute.
    pub fn real(&mut self, id: Id, name: &str, value: f64) {
        self.objects[id].attributes.push((name.to_string(), Value::Real(value)));
    }

    /// Adds an integer attribute.
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
