//! Reads the body of a PLY file: a sequence of numbers, in ASCII or binary.

use super::super::source_location::{SourceLocation, shown};
use super::header::{Element, Encoding, Header, Kind, Number};
use crate::error::SceneError;

/// The numbers of the body that have not been read yet.
#[derive(Debug)]
pub struct Body<'a> {
    name: &'a str,
    encoding: Encoding,
    left: &'a [u8],
    length: usize,
}

impl<'a> Body<'a> {
    pub fn new(bytes: &'a [u8], header: &Header, name: &'a str) -> Self {
        let left = bytes.get(header.end..).unwrap_or_default();
        Self { name, encoding: header.encoding, left, length: bytes.len() }
    }

    /// Returns a place in the file, for errors.
    pub fn site(&self, place: &str) -> SourceLocation<'a> {
        SourceLocation::new(self.name, place)
    }

    /// Checks that the rest of the file has room for all members of an element.
    pub fn reserve(&self, element: &Element) -> Result<(), SceneError> {
        let least = |kind: Kind| match (self.encoding, kind) {
            (Encoding::Ascii, _) => 2, // a digit and a space, except after the last
            (_, Kind::Scalar(number) | Kind::List { count: number, .. }) => number.size(),
        };
        let least = element.properties.iter().fold(0u64, |sum, property| sum + least(property.kind));
        match least.checked_mul(element.count) {
            Some(bytes) if bytes <= self.left.len() as u64 + 1 => Ok(()),
            _ => {
                let (count, place) = (element.count, format!("element {}", shown(&element.name)));
                Err(self.site(&place).malformed(
                    format!(
                        "{count} members need at least {least} bytes each, but {} bytes are left",
                        self.left.len()
                    ),
                    "the file is incomplete: copy or export it again",
                ))
            }
        }
    }

    /// Returns whether f32 holds each number of a type exactly. Text may have more digits than the
    /// type in its header.
    pub fn is_single(&self, kind: Number) -> bool {
        self.encoding != Encoding::Ascii && !matches!(kind, Number::I32 | Number::U32 | Number::F64)
    }

    /// Reads a number.
    pub fn number(&mut self, kind: Number) -> Result<f64, SceneError> {
        if self.encoding == Encoding::Ascii {
            return self.word();
        }
        let number = match kind {
            Number::I8 => i8::from_le_bytes(self.bytes()?).into(),
            Number::U8 => u8::from_le_bytes(self.bytes()?).into(),
            Number::I16 => i16::from_le_bytes(self.bytes()?).into(),
            Number::U16 => u16::from_le_bytes(self.bytes()?).into(),
            Number::I32 => i32::from_le_bytes(self.bytes()?).into(),
            Number::U32 => u32::from_le_bytes(self.bytes()?).into(),
            Number::F32 => f32::from_le_bytes(self.bytes()?).into(),
            Number::F64 => f64::from_le_bytes(self.bytes()?),
        };
        Ok(number)
    }

    /// Reads the length of a list, and checks that the rest of the file has room for it.
    pub fn count(&mut self, kind: Number, item: Number) -> Result<u64, SceneError> {
        let count = self.number(kind)?;
        let size = if self.encoding == Encoding::Ascii { 2 } else { item.size() };
        let most = (self.left.len() as u64 + 1) / size;
        if count >= 0.0 && count <= most as f64 && count.fract() == 0.0 {
            return Ok(count as u64);
        }
        Err(self.here().malformed(
            format!("the length of a list is {count} members, but there is room for {most}"),
            "a list's length must be a whole number, and its members must follow",
        ))
    }

    /// Skips a property.
    pub fn skip_property(&mut self, kind: Kind) -> Result<(), SceneError> {
        match kind {
            Kind::Scalar(number) => drop(self.number(number)?),
            Kind::List { count, item } => {
                for _ in 0..self.count(count, item)? {
                    self.number(item)?;
                }
            }
        }
        Ok(())
    }

    /// Skips all members of an element.
    pub fn skip(&mut self, element: &Element) -> Result<(), SceneError> {
        if element.properties.is_empty() {
            return Ok(()); // takes no bytes, whatever the count
        }
        for _ in 0..element.count {
            for property in &element.properties {
                self.skip_property(property.kind)?;
            }
        }
        Ok(())
    }

    /// Returns the next bytes, in little-endian order.
    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], SceneError> {
        let Some((bytes, left)) = self.left.split_first_chunk() else { return Err(self.ended()) };
        let mut bytes: [u8; N] = *bytes;
        self.left = left;
        if self.encoding == Encoding::BigEndian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    /// Reads the next word of an ASCII file as a number.
    fn word(&mut self) -> Result<f64, SceneError> {
        self.left = self.left.trim_ascii_start();
        let end = self.left.iter().position(u8::is_ascii_whitespace).unwrap_or(self.left.len());
        let (word, left) = self.left.split_at(end);
        if word.is_empty() {
            return Err(self.ended());
        }
        let number = str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        let number = number.ok_or_else(|| {
            let word = shown(&String::from_utf8_lossy(word));
            self.here().malformed(format!("\"{word}\" is not a number"), "the body must be numbers only")
        })?;
        self.left = left;
        Ok(number)
    }

    fn here(&self) -> SourceLocation<'a> {
        self.site(&format!("byte {}", self.length - self.left.len()))
    }

    fn ended(&self) -> SceneError {
        self.site("end of the file").malformed(
            "there is less data than the header says",
            "the file is incomplete: copy or export it again",
        )
    }
}
