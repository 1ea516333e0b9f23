//! How much memory a description may take.

use super::source_location::SourceLocation;
use crate::memory;
use crate::scene::error::SceneError;

/// Bytes of a description for each byte that was read. Indices of one byte, which become four, need the most of what is no
/// attempt to fill the memory.
const FACTOR: u64 = 64;

/// Bytes of a description beside those: many instances of a mesh of many parts take few bytes in a file.
const BASE: u64 = 64 << 20;

/// Triangles in the world, each of a mesh counted with each of its instances.
const TRIANGLES: u64 = 1 << 30;

/// Requests below this are not worth asking the system how much memory there is.
const SMALL: u64 = 16 << 20;

/// What is left for a description.
#[derive(Debug)]
pub(super) struct Budget {
    bytes: u64,
    triangles: u64,
}

impl Budget {
    /// For a file of `input` bytes.
    pub fn new(input: usize) -> Self {
        Self { bytes: BASE.saturating_add(FACTOR.saturating_mul(input as u64)), triangles: TRIANGLES }
    }

    /// Another file, of `input` bytes, has been read.
    pub fn extend(&mut self, input: usize) {
        self.bytes = self.bytes.saturating_add(FACTOR.saturating_mul(input as u64));
    }

    /// Asks for `bytes` before they are allocated.
    pub fn take(&mut self, bytes: u64, site: &SourceLocation) -> Result<(), SceneError> {
        let Some(left) = self.bytes.checked_sub(bytes) else {
            return Err(site.too_large(
                "the scene grows while it is read, by references to the same data",
                format!("{FACTOR} times the bytes of its files and {}", memory::display(BASE)),
            ));
        };
        self.bytes = left;
        fits(bytes, site)
    }

    /// Counts an instance of `triangles` triangles.
    pub fn place(&mut self, triangles: u64, site: &SourceLocation) -> Result<(), SceneError> {
        let left = self.triangles.checked_sub(triangles).ok_or_else(|| {
            site.too_large("too many triangles, counting each instance", format!("{TRIANGLES} triangles"))
        })?;
        self.triangles = left;
        Ok(())
    }
}

/// Whether the memory has room for `bytes`, with as much left for the rest.
pub(super) fn fits(bytes: u64, site: &SourceLocation) -> Result<(), SceneError> {
    if bytes <= SMALL {
        return Ok(());
    }
    let half = memory::available() / 2;
    if bytes <= half {
        return Ok(());
    }
    let (needed, half) = (memory::display(bytes), memory::display(half));
    Err(site.too_large(format!("{needed} are needed"), format!("{half}, half of the free memory")))
}
