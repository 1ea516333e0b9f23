//! Limits on the memory and the triangles of an imported model, so that a small file cannot demand
//! much of either.

use super::source_location::SourceLocation;
use crate::error::SceneError;
use trisect_system::memory;

/// Maximum bytes of a description per byte of its files. Of harmless files, those with indices of
/// one byte need the most, because such an index becomes four bytes.
const FACTOR: u64 = 64;

/// Maximum bytes of a description per byte of decompressed data: a vertex of a mesh takes 72 bytes,
/// and a compressed one 6 or more.
const DECOMPRESSED: u64 = 16;

/// Bytes that a description may take beyond [`FACTOR`] times its files: many instances of a mesh of
/// many parts take few bytes in a file.
const BASE: u64 = 64 << 20;

/// Maximum number of triangles in the world, where each instance of a mesh counts. Those that share
/// no mesh must fit the memory, too.
const TRIANGLES: u64 = 1 << 40;

/// Requests up to this size are granted without asking the system for its free memory.
const SMALL: u64 = 16 << 20;

/// Bytes and triangles that a description may still take.
#[derive(Clone, Debug)]
pub(super) struct Budget {
    bytes: u64,
    /// Bytes of all files.
    input: u64,
    /// Bytes by which decompressed data may still extend it.
    extension: u64,
    triangles: u64,
}

impl Budget {
    /// Returns the budget for a file of `input` bytes.
    pub fn new(input: usize) -> Self {
        let bytes = FACTOR.saturating_mul(input as u64);
        let extension = DECOMPRESSED.saturating_mul(bytes);
        let (bytes, input) = (BASE.saturating_add(bytes), input as u64);
        Self { bytes, input, extension, triangles: TRIANGLES }
    }

    /// Extends the budget for another file, of `input` bytes.
    pub fn extend(&mut self, input: usize) {
        self.input = self.input.saturating_add(input as u64);
        let bytes = FACTOR.saturating_mul(input as u64);
        self.bytes = self.bytes.saturating_add(bytes);
        self.extension = self.extension.saturating_add(DECOMPRESSED.saturating_mul(bytes));
    }

    /// Extends the budget for the files by which `later`, a copy of it, was extended.
    pub fn extend_as(&mut self, later: &Self) {
        self.extend(usize::try_from(later.input.saturating_sub(self.input)).unwrap_or(usize::MAX));
    }

    /// Takes `bytes` for data that is decompressed from `source` bytes, before they are allocated,
    /// and extends the budget for what is made of them.
    ///
    /// # Errors
    ///
    /// [`SceneError::TooLarge`] as for [`Self::take`].
    pub fn decompress(&mut self, bytes: u64, source: u64, site: &SourceLocation) -> Result<(), SceneError> {
        self.take(bytes, site)?;
        let counted = DECOMPRESSED.saturating_mul(bytes.min(FACTOR.saturating_mul(source)));
        // Many views may name the same data.
        let counted = counted.min(self.extension);
        self.extension -= counted;
        self.bytes = self.bytes.saturating_add(counted);
        Ok(())
    }

    /// Takes `bytes` from the budget before they are allocated.
    ///
    /// # Errors
    ///
    /// [`SceneError::TooLarge`] if the budget or the free memory does not suffice.
    pub fn take(&mut self, bytes: u64, site: &SourceLocation) -> Result<(), SceneError> {
        let Some(left) = self.bytes.checked_sub(bytes) else {
            return Err(site.too_large(
                "the scene needs too much memory for the size of its files, because parts refer to the same data",
                format!("{FACTOR} times the bytes of its files plus {}", memory::display(BASE)),
            ));
        };
        self.bytes = left;
        fits(bytes, site)
    }

    /// Takes an instance of `triangles` triangles from the budget.
    ///
    /// # Errors
    ///
    /// [`SceneError::TooLarge`] if there are too many triangles.
    pub fn place(&mut self, triangles: u64, site: &SourceLocation) -> Result<(), SceneError> {
        let left = self.triangles.checked_sub(triangles).ok_or_else(|| {
            site.too_large("too many triangles, counting each instance", format!("{TRIANGLES} triangles"))
        })?;
        self.triangles = left;
        Ok(())
    }
}

/// Checks that `bytes` are at most half of the free memory, so that as much is left for the rest.
pub(super) fn fits(bytes: u64, site: &SourceLocation) -> Result<(), SceneError> {
    if bytes <= SMALL {
        return Ok(());
    }
    let half = memory::available() / 2;
    if bytes <= half {
        return Ok(());
    }
    let (needed, half) = (memory::display(bytes), memory::display(half));
    Err(site.too_large(format!("{needed} of memory are needed"), format!("{half}, half of the free memory")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles are counted with each instance, up to 2^40.
    #[test]
    fn too_many_triangles_are_refused() {
        let site = SourceLocation::new("test", "nodes[0]");
        let mut budget = Budget::new(1000);
        assert!((0..1024).all(|_| budget.place(1 << 30, &site).is_ok()));
        let error = budget.place(1, &site).unwrap_err().to_string();
        assert!(error.contains("too many triangles") && error.contains("1099511627776"), "{error}");
    }

    /// Data that many views name extends the budget as often as the files are long, not as often as
    /// it is named.
    #[test]
    fn compressed_data_that_is_named_often_is_refused() {
        let site = SourceLocation::new("test", "bufferViews[0]");
        let mut budget = Budget::new(1000);
        let (bytes, source) = (64 * 1000, 1000);
        let granted =
            (0..1_000_000).take_while(|_| budget.decompress(bytes, source, &site).is_ok()).count() as u64;
        let most = (BASE + FACTOR * 1000 * (1 + DECOMPRESSED)) / bytes;
        assert_eq!(granted, most);
        let mut once = Budget::new(1000);
        once.decompress(bytes, source, &site).unwrap();
        // What is made of them may take more than a plain file of this length.
        assert!(once.take(BASE + DECOMPRESSED * bytes, &site).is_ok() && once.take(1, &site).is_err());
    }

    /// A budget that is used again has what the files of its first use gave it.
    #[test]
    fn files_of_the_first_use_extend_the_next() {
        let site = SourceLocation::new("test", "images[0]");
        let mut budget = Budget::new(1000);
        let mut first = budget.clone();
        first.extend(500);
        first.take(BASE + FACTOR * 1500, &site).unwrap();
        assert!(budget.clone().take(BASE + FACTOR * 1500, &site).is_err());
        budget.extend_as(&first);
        budget.extend_as(&first);
        assert!(budget.take(BASE + FACTOR * 1500, &site).is_ok() && budget.take(1, &site).is_err());
    }
}
