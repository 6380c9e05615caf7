//! Layout of a planned file.

use super::messages::{Message, NOWHERE};
use super::{Element, Id, Kind, Object, Place, Plan, ROOT, Value, messages};
use std::fs::File;
use std::io::{Error, Result, Seek, SeekFrom, Write};

/// Largest message in bytes; the format stores the size in 16 bits.
const LARGEST_MESSAGE: usize = u16::MAX as usize;

/// File with a fixed layout, to which numbers can be written.
pub struct Laid {
    file: File,
    data: Vec<u64>,
    sizes: Vec<u64>,
}

impl Plan {
    /// Writes everything but the numbers, which are 0 until they are written by [`Laid::put`].
    ///
    /// # Errors
    /// If the file cannot be written, or if a name or the list of variables of a dimension exceeds the limit of the
    /// format.
    pub fn lay(self, mut file: File) -> Result<Laid> {
        let mut places = Places {
            objects: vec![NOWHERE; self.objects.len()],
            data: vec![NOWHERE; self.objects.len()],
            heaps: vec![NOWHERE; self.heaps.count()],
        };
        let sizes: Vec<u64> = self.objects.iter().map(|object| self.size(object)).collect();
        let mut end = messages::superblock(0, 0).len() as u64;
        let mut take = |size: u64| {
            let at = end.next_multiple_of(8);
            end = at + size;
            at
        };
        for id in 0..self.objects.len() {
            let messages = self.messages(id, &places);
            if let Some(message) = messages.iter().find(|message| message.bytes.len() > LARGEST_MESSAGE) {
                let name = &self.objects[id].name;
                let size = message.bytes.len();
                return Err(Error::other(format!("\"{name}\" takes {size} bytes; HDF5 allows {LARGEST_MESSAGE}")));
            }
            places.objects[id] = take(messages::header(&messages).len() as u64);
        }
        for heap in 0..self.heaps.count() {
            places.heaps[heap] = take(self.heaps.size(heap));
        }
        for (id, size) in sizes.iter().enumerate().filter(|(_, size)| **size > 0) {
            places.data[id] = take(*size);
        }
        file.set_len(end)?;
        let mut out = std::io::BufWriter::new(&mut file);
        let mut write = |at: u64, bytes: &[u8]| {
            out.seek(SeekFrom::Start(at))?;
            out.write_all(bytes)
        };
        write(0, &messages::superblock(end, places.objects[ROOT]))?;
        for (id, object) in self.objects.iter().enumerate() {
            write(places.objects[id], &messages::header(&self.messages(id, &places)))?;
            if let Kind::Dataset { element: Element::Text, texts, .. } = &object.kind {
                let pointers = texts.iter().flat_map(|place| self.heaps.pointer(*place, 1, &places.heaps));
                write(places.data[id], &pointers.collect::<Vec<u8>>())?;
            }
        }
        for heap in 0..self.heaps.count() {
            write(places.heaps[heap], &self.heaps.bytes(heap, &|id| places.objects[id]))?;
        }
        out.flush()?;
        drop(out);
        Ok(Laid { file, data: places.data, sizes })
    }

    fn shape(&self, dimensions: &[Id]) -> Vec<u64> {
        let length = |id: &Id| match self.objects[*id].kind {
            Kind::Dimension { length, .. } => length,
            _ => 0,
        };
        dimensions.iter().map(length).collect()
    }

    /// Number of bytes that the elements of an object occupy.
    fn size(&self, object: &Object) -> u64 {
        match &object.kind {
            Kind::Group { .. } => 0,
            Kind::Dataset { element, dimensions, .. } => {
                self.shape(dimensions).iter().product::<u64>() * element.size()
            }
            Kind::Dimension { length, values, .. } => values.map_or(0, |element| length * element.size()),
        }
    }

    fn messages(&self, id: Id, places: &Places) -> Vec<Message> {
        let object = &self.objects[id];
        let (at, size) = (places.data[id], self.size(object));
        let mut out: Vec<Message> = match &object.kind {
            Kind::Group { members } => messages::group(members.len() as u64).into(),
            Kind::Dataset { element, dimensions, .. } => {
                messages::dataset(&element.datatype(), &self.shape(dimensions), at, size).into()
            }
            Kind::Dimension { length, values: Some(element), .. } => {
                messages::dataset(&element.datatype(), &[*length], at, size).into()
            }
            Kind::Dimension { length, values: None, .. } => {
                messages::dataset(&messages::no_values(), &[*length], NOWHERE, 4 * length).into()
            }
        };
        out.extend(object.attributes.iter().map(|(name, value)| self.attribute(name, value, places)));
        match &object.kind {
            Kind::Group { members } => {
                let link =
                    |(k, id): (usize, &Id)| messages::link(&self.objects[*id].name, k as u64, places.objects[*id]);
                out.extend(members.iter().enumerate().map(link));
            }
            Kind::Dimension { users, .. } if !users.is_empty() => {
                let entry = |(user, place): &(Id, u32)| {
                    let address = places.objects[*user].to_le_bytes();
                    address.into_iter().chain(place.to_le_bytes())
                };
                let value: Vec<u8> = users.iter().flat_map(entry).collect();
                let space = messages::dataspace(Some(&[users.len() as u64]));
                out.push(messages::attribute("REFERENCE_LIST", &messages::user_of_dimension(), &space, &value));
            }
            Kind::Dataset { .. } => out.extend(self.list_of(id).map(|list| {
                let value: Vec<u8> = list.iter().flat_map(|p| self.heaps.pointer(*p, 8, &places.heaps)).collect();
                let space = messages::dataspace(Some(&[list.len() as u64]));
                messages::attribute("DIMENSION_LIST", &messages::references(), &space, &value)
            })),
            Kind::Dimension { .. } => {}
        }
        out
    }

    fn list_of(&self, id: Id) -> Option<&Vec<Place>> {
        let index = self.lists.binary_search_by_key(&id, |(id, _)| *id).ok()?;
        Some(&self.lists[index].1)
    }

    fn attribute(&self, name: &str, value: &Value, places: &Places) -> Message {
        let (datatype, bytes) = match value {
            Value::Ended(text) => (messages::fixed_text(text.len() + 1), [text.as_bytes(), b"\0"].concat()),
            Value::Short(text) => (messages::fixed_text(text.len()), text.clone().into_bytes()),
            Value::Long(place) => (Element::Text.datatype(), self.heaps.pointer(*place, 1, &places.heaps).to_vec()),
            Value::Real(number) => (Element::Real.datatype(), number.to_le_bytes().to_vec()),
            Value::Integer(number) => (Element::Integer.datatype(), number.to_le_bytes().to_vec()),
        };
        messages::attribute(name, &datatype, &messages::dataspace(None), &bytes)
    }
}

/// Addresses in the file.
struct Places {
    objects: Vec<u64>,
    data: Vec<u64>,
    heaps: Vec<u64>,
}

impl Laid {
    /// Writes elements of a variable, little-endian, starting at the element with index `first`.
    ///
    /// # Errors
    /// If the bytes exceed the planned size of the variable, or if the file cannot be written.
    pub fn put(&mut self, id: Id, first: u64, bytes: &[u8]) -> Result<()> {
        let at = 8 * first;
        if at + bytes.len() as u64 > self.sizes[id] {
            return Err(Error::other("the run changed during the export"));
        }
        self.file.seek(SeekFrom::Start(self.data[id] + at))?;
        self.file.write_all(bytes)
    }
}
