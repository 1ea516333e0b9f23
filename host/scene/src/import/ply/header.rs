//! Reads the header of a PLY file, which describes the body.

use super::super::source_location::{SourceLocation, shown};
use crate::error::SceneError;

/// Maximum length of a header in bytes.
const MAX_HEADER: usize = 1 << 20;

/// Encoding of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Type of a number in a binary body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

/// Type of a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Scalar(Number),
    List { count: Number, item: Number },
}

/// A property of each member of an element.
#[derive(Debug)]
pub struct Property {
    pub name: String,
    pub kind: Kind,
}

/// A list of members with equal properties.
#[derive(Debug)]
pub struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

/// Encoding and content of the body.
#[derive(Debug)]
pub struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Offset of the body in bytes.
    pub end: usize,
}

impl Number {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Returns the size in bytes.
    pub fn size(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

/// Reads the header of a file.
pub fn read(bytes: &[u8], name: &str) -> Result<Header, SceneError> {
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut at = 0;
    for number in 1.. {
        let site = SourceLocation::new(name, format!("line {number}"));
        let rest = bytes.get(at..MAX_HEADER.min(bytes.len())).unwrap_or_default();
        let Some(length) = rest.iter().position(|byte| *byte == b'\n') else {
            return Err(site.malformed("the header has no end", "it must end with the line end_header"));
        };
        let line = String::from_utf8_lossy(&rest[..length]);
        at += length + 1;
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let wrong =
            |what: &str| site.malformed(format!("\"{}\" {what}", shown(line.trim())), "see PLY's header");
        if number == 1 {
            if words != ["ply"] {
                return Err(site.malformed("this is not a PLY file", "its first line must be \"ply\""));
            }
            continue;
        }
        match words[..] {
            ["end_header"] => break,
            [] | ["comment" | "obj_info", ..] => {}
            ["format", kind, "1.0"] => {
                encoding = Some(match kind {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    _ => return Err(wrong("names an unknown format")),
                });
            }
            ["element", name, count] => {
                let count = count.parse().map_err(|_| wrong("has no count"))?;
                if elements.iter().any(|element| element.name == name && matches!(name, "vertex" | "face")) {
                    return Err(wrong("occurs twice"));
                }
                elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
            }
            ["property", ref kind @ .., name] => {
                let kind = match kind {
                    ["list", count, item] => {
                        let count = Number::of(count).filter(|count| count.is_integer());
                        Number::of(item).zip(count).map(|(item, count)| Kind::List { count, item })
                    }
                    [number] => Number::of(number).map(Kind::Scalar),
                    _ => None,
                };
                let kind = kind.ok_or_else(|| wrong("is of an unknown type"))?;
                if let (Kind::List { item, .. }, "vertex_indices" | "vertex_index") = (kind, name)
                    && !item.is_integer()
                {
                    return Err(wrong("must be of an integer type"));
                }
                let element = elements.last_mut().ok_or_else(|| wrong("belongs to no element"))?;
                if element.properties.iter().any(|property| property.name == name) {
                    return Err(wrong("occurs twice"));
                }
                element.properties.push(Property { name: name.to_owned(), kind });
            }
            _ => return Err(wrong("is not understood")),
        }
    }
    let encoding = encoding.ok_or_else(|| {
        SourceLocation::new(name, "header")
            .malformed("it has no line \"format\"", "it must name format and version 1.0")
    })?;
    Ok(Header { encoding, elements, end: at })
}
