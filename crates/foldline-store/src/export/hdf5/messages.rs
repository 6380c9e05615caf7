//! Messages of the object headers.
//!
//! **Source.** hdfgroup2024, section IV.A.2: dataspace version 2, datatype versions 1 and 3, fill value version 3, data
//! layout version 3, attribute version 3, link version 1, link info and group info version 0.

/// Undefined address.
pub(super) const NOWHERE: u64 = u64::MAX;

/// Message: type and contents.
pub(super) struct Message {
    pub(super) code: u8,
    pub(super) bytes: Vec<u8>,
}

fn message(code: u8, parts: &[&[u8]]) -> Message {
    Message { code, bytes: parts.concat() }
}

/// Type of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Element {
    /// Double-precision number.
    Real,
    /// Signed 64-bit integer.
    Integer,
    /// Text of any length.
    Text,
}

impl Element {
    /// Size of an element in bytes; for a text, the size of the pointer to it.
    pub(super) fn size(self) -> u64 {
        if self == Element::Text { 16 } else { 8 }
    }

    pub(super) fn datatype(self) -> Vec<u8> {
        match self {
            Element::Real => real(8, [0x20, 0x3f], [52, 11, 0, 52], 1023),
            Element::Integer => integer(8),
            // A variable-length list of bytes, marked as unterminated UTF-8 text.
            Element::Text => [&[0x19, 0x01, 0x01, 0, 16, 0, 0, 0][..], &unsigned_byte()].concat(),
        }
    }
}

fn real(size: u8, bits: [u8; 2], fields: [u8; 4], bias: u32) -> Vec<u8> {
    let head = [0x11, bits[0], bits[1], 0, size, 0, 0, 0, 0, 0, size * 8, 0];
    [&head[..], &fields, &bias.to_le_bytes()].concat()
}

fn integer(size: u8) -> Vec<u8> {
    vec![0x10, 0x08, 0, 0, size, 0, 0, 0, 0, 0, size * 8, 0]
}

fn unsigned_byte() -> Vec<u8> {
    vec![0x10, 0, 0, 0, 1, 0, 0, 0, 0, 0, 8, 0]
}

/// Datatype of a UTF-8 text with a fixed number of bytes.
pub(super) fn fixed_text(size: usize) -> Vec<u8> {
    [&[0x13, 0x10, 0, 0][..], &(size as u32).to_le_bytes()].concat()
}

fn reference() -> Vec<u8> {
    vec![0x17, 0, 0, 0, 8, 0, 0, 0]
}

/// Datatype of a variable-length list of object references.
pub(super) fn references() -> Vec<u8> {
    [&[0x19, 0, 0, 0, 16, 0, 0, 0][..], &reference()].concat()
}

/// Datatype of an entry in the REFERENCE_LIST of a dimension: a reference to a variable, and the position of the
/// dimension in that variable. 12 bytes.
pub(super) fn user_of_dimension() -> Vec<u8> {
    let head = [0x36, 2, 0, 0, 12, 0, 0, 0];
    [&head[..], b"dataset\0\0", &reference(), b"dimension\0\x08", &integer(4)].concat()
}

/// Datatype of a dimension without values: four-byte numbers, none of which is stored.
pub(super) fn no_values() -> Vec<u8> {
    real(4, [0x20, 0x1f], [23, 8, 0, 23], 127)
}

/// Dataspace of the given shape; `None` is a scalar.
pub(super) fn dataspace(shape: Option<&[u64]>) -> Vec<u8> {
    let shape_bytes: Vec<u8> = shape.unwrap_or(&[]).iter().flat_map(|n| n.to_le_bytes()).collect();
    let rank = shape.map_or(0, <[u64]>::len) as u8;
    [&[2, rank, 0, u8::from(shape.is_some())][..], &shape_bytes].concat()
}

pub(super) fn attribute(name: &str, datatype: &[u8], dataspace: &[u8], value: &[u8]) -> Message {
    let sizes = [name.len() + 1, datatype.len(), dataspace.len()].map(|size| (size as u16).to_le_bytes());
    let name = [name.as_bytes(), b"\0"].concat();
    message(0x0c, &[&[3, 0], sizes.as_flattened(), &[1], &name, datatype, dataspace, value])
}

/// Link in a group: the name of the object at `address`, and its number in creation order.
pub(super) fn link(name: &str, number: u64, address: u64) -> Message {
    // Flags 0x15: the length of the name has two bytes, and the creation order and the encoding of the name are given.
    let length = (name.len() as u16).to_le_bytes();
    message(0x06, &[&[1, 0x15], &number.to_le_bytes(), &[1], &length, name.as_bytes(), &address.to_le_bytes()])
}

/// Messages of every group: the creation order of its `count` members is tracked, and the links are in its header.
pub(super) fn group(count: u64) -> [Message; 2] {
    let nowhere = NOWHERE.to_le_bytes();
    [message(0x02, &[&[0, 0x03], &count.to_le_bytes(), &nowhere, &nowhere, &nowhere]), message(0x0a, &[&[0, 0]])]
}

/// Messages of every dataset; its elements are stored contiguously.
pub(super) fn dataset(datatype: &[u8], shape: &[u64], address: u64, size: u64) -> [Message; 4] {
    [
        message(0x01, &[&dataspace(Some(shape))]),
        message(0x03, &[datatype]),
        message(0x05, &[&[3, 0x0a]]),
        message(0x08, &[&[3, 1], &address.to_le_bytes(), &size.to_le_bytes()]),
    ]
}

/// Object header; the creation order of the attributes is tracked.
pub(super) fn header(messages: &[Message]) -> Vec<u8> {
    let mut body = Vec::new();
    let mut attributes = 0u16;
    for message in messages {
        body.push(message.code);
        body.extend((message.bytes.len() as u16).to_le_bytes());
        body.push(0);
        body.extend(attributes.to_le_bytes());
        attributes += u16::from(message.code == 0x0c);
        body.extend(&message.bytes);
    }
    let mut out = b"OHDR\x02\x0e".to_vec();
    out.extend((body.len() as u32).to_le_bytes());
    out.extend(body);
    let sum = super::lookup3::lookup3(&out);
    out.extend(sum.to_le_bytes());
    out
}

/// Superblock, version 2: the first bytes of the file.
pub(super) fn superblock(end: u64, root: u64) -> Vec<u8> {
    let mut out = b"\x89HDF\r\n\x1a\n\x02\x08\x08\0".to_vec();
    for address in [0, NOWHERE, end, root] {
        out.extend(address.to_le_bytes());
    }
    let sum = super::lookup3::lookup3(&out);
    out.extend(sum.to_le_bytes());
    out
}
