//! Files that are complete or do not exist, and whose damage is detected: written atomically, with
//! a CRC-32 of each block. Checkpoints and the lab's cached references are such files.
//!
//! Layout, with little-endian numbers: eight bytes of magic; lengths of header and data, eight
//! bytes each; a CRC-32 of all these; header; data; a CRC-32 of each 64 KiB of header and data. In
//! 64 KiB, a CRC-32 finds each change of up to three bits, and each within 32 adjacent bits
//! (Koopman 2002, table 1).

use crate::atomic_file::{Claim, write_atomic};
use crate::input;
use rayon::prelude::*;
use std::io::{self, Read, Write};
use std::path::Path;
use thiserror::Error;

/// Bytes covered by one CRC.
const BLOCK: usize = 1 << 16;

/// Maximum size of a header in bytes: parsing it takes many times its size in memory.
const MAX_HEADER: u64 = 1 << 21;

/// Bytes before the header: magic, both lengths, and their CRC.
const PREFIX: usize = 28;

/// Error of reading a file.
#[derive(Debug, Error)]
pub enum ChecksummedFileError {
    /// The file system reported an error.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The file has another magic.
    #[error("unrecognised file header")]
    Other,
    /// The file is shorter or longer than its prefix says.
    #[error("it has {has} bytes instead of {should}: it was truncated or changed")]
    Length {
        /// Size of the file in bytes.
        has: u64,
        /// Size in bytes according to its prefix.
        should: u64,
    },
    /// The header is longer than 2 MiB.
    #[error("its header of {header} bytes is too long")]
    Header {
        /// Size of the header in bytes.
        header: u64,
    },
    /// The CRC of a block does not match.
    #[error("it was damaged: the checksum of bytes {from} to {to} does not match")]
    Damaged {
        /// First byte of the block.
        from: u64,
        /// End of the block (exclusive).
        to: u64,
    },
}

/// Contents of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Contents {
    /// Header, which describes the data.
    pub header: Vec<u8>,
    /// Data.
    pub data: Vec<u8>,
}

/// Reads a file with this magic.
///
/// # Errors
///
/// [`ChecksummedFileError`] for a file with another magic, and one that was truncated or damaged.
/// At most twice the size of the file is allocated.
pub fn read(path: &Path, magic: &[u8; 8]) -> Result<Contents, ChecksummedFileError> {
    let mut file = input::open_file(path)?;
    let facts = file.metadata()?;
    // A file with another magic is not read as a whole.
    let mut bytes = Vec::new();
    Read::by_ref(&mut file).take(magic.len() as u64).read_to_end(&mut bytes)?;
    if bytes != magic {
        return Err(ChecksummedFileError::Other);
    }
    file.take(facts.len()).read_to_end(&mut bytes)?;
    open(bytes, magic)
}

/// Decodes the bytes of a file with this magic.
///
/// # Errors
///
/// Same as [`read`].
pub fn open(bytes: Vec<u8>, magic: &[u8; 8]) -> Result<Contents, ChecksummedFileError> {
    let has = bytes.len() as u64;
    if !bytes.starts_with(magic) {
        return Err(ChecksummedFileError::Other);
    }
    let Some((prefix, rest)) = bytes.split_first_chunk::<PREFIX>() else {
        return Err(ChecksummedFileError::Length { has, should: PREFIX as u64 });
    };
    let (said, crc) = prefix.split_at(PREFIX - 4);
    if !is_crc(said, crc) {
        return Err(ChecksummedFileError::Damaged { from: 0, to: PREFIX as u64 });
    }
    let number = |at: usize| u64::from_le_bytes(std::array::from_fn(|i| prefix[at + i]));
    let (header, data) = (number(8), number(16));
    let body = header.checked_add(data);
    let should = body.and_then(|body| {
        let crcs = body.div_ceil(BLOCK as u64).checked_mul(4)?;
        body.checked_add(crcs)?.checked_add(PREFIX as u64)
    });
    if header > MAX_HEADER {
        return Err(ChecksummedFileError::Header { header });
    }
    // The lengths match those of the bytes, so they fit a `usize`.
    let (Some(body), true) = (body, should == Some(has)) else {
        return Err(ChecksummedFileError::Length { has, should: should.unwrap_or(u64::MAX) });
    };
    let (body, crcs) = rest.split_at(body as usize);
    let blocks = body.par_chunks(BLOCK).zip(crcs.par_chunks_exact(4));
    if let Some(block) = blocks.position_first(|(block, crc)| !is_crc(block, crc)) {
        let from = PREFIX + block * BLOCK;
        let to = (from + BLOCK).min(PREFIX + body.len());
        return Err(ChecksummedFileError::Damaged { from: from as u64, to: to as u64 });
    }
    let (header, data) = body.split_at(header as usize);
    Ok(Contents { header: header.to_vec(), data: data.to_vec() })
}

/// Returns whether the CRC matches. Builds for fuzzing skip the check, to reach the code behind it.
fn is_crc(bytes: &[u8], crc: &[u8]) -> bool {
    cfg!(fuzzing) || crc32fast::hash(bytes).to_le_bytes() == *crc
}

/// Writes a file with the parts of `data` one after the other. An earlier file stays unchanged
/// until this one is complete.
///
/// # Errors
///
/// The file system's error; nothing is left behind then.
pub fn write(path: &Path, magic: &[u8; 8], header: &[u8], data: &[&[u8]]) -> io::Result<()> {
    write_atomic(path, |file| write_to(file, magic, header, data))
}

/// Returns the bytes of the file that [`write()`] writes.
///
/// # Errors
///
/// [`io::ErrorKind::InvalidInput`] for a header that is too long.
pub fn encode(magic: &[u8; 8], header: &[u8], data: &[&[u8]]) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    write_to(&mut bytes, magic, header, data)?;
    Ok(bytes)
}

/// Writes a file like [`write()`], if no file is there or the file is that of `claim`.
///
/// # Errors
///
/// Same as [`Claim::replace`].
pub fn write_claimed(
    path: &Path,
    claim: &mut Claim,
    magic: &[u8; 8],
    header: &[u8],
    data: &[&[u8]],
) -> io::Result<()> {
    claim.replace(path, |file| write_to(file, magic, header, data))
}

fn write_to(file: &mut impl Write, magic: &[u8; 8], header: &[u8], data: &[&[u8]]) -> io::Result<()> {
    if header.len() as u64 > MAX_HEADER {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "its header would be too long"));
    }
    let length: usize = data.iter().map(|part| part.len()).sum();
    let mut prefix = magic.to_vec();
    prefix.extend((header.len() as u64).to_le_bytes());
    prefix.extend((length as u64).to_le_bytes());
    prefix.extend(crc32fast::hash(&prefix).to_le_bytes());
    file.write_all(&prefix)?;
    let mut crcs = Crcs::default();
    for part in std::iter::once(&header).chain(data) {
        file.write_all(part)?;
        crcs.add(part);
    }
    file.write_all(&crcs.end())
}

/// CRCs of the blocks of data that arrives in pieces.
#[derive(Default)]
struct Crcs {
    bytes: Vec<u8>,
    open: crc32fast::Hasher,
    in_open: usize,
}

impl Crcs {
    fn close(&mut self) {
        self.bytes.extend(std::mem::take(&mut self.open).finalize().to_le_bytes());
        self.in_open = 0;
    }

    fn add(&mut self, piece: &[u8]) {
        let (first, rest) = piece.split_at(piece.len().min((BLOCK - self.in_open) % BLOCK));
        self.open.update(first);
        self.in_open += first.len();
        if self.in_open == BLOCK {
            self.close();
        }
        if rest.is_empty() {
            return;
        }
        let whole = rest.len() / BLOCK * BLOCK;
        let crcs: Vec<u32> = rest[..whole].par_chunks(BLOCK).map(crc32fast::hash).collect();
        self.bytes.extend(crcs.iter().flat_map(|crc| crc.to_le_bytes()));
        self.open.update(&rest[whole..]);
        self.in_open = rest.len() - whole;
    }

    fn end(mut self) -> Vec<u8> {
        if self.in_open > 0 {
            self.close();
        }
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::path::PathBuf;

    const MAGIC: &[u8; 8] = b"TRISTEST";

    fn path(name: &str) -> PathBuf {
        std::env::temp_dir().join(format!("trisect-sealed-{}-{name}", std::process::id()))
    }

    fn bytes(count: usize) -> Vec<u8> {
        (0..count).map(|i| ((i * i) >> 3) as u8).collect()
    }

    #[test]
    fn what_was_written_comes_back() {
        let path = path("back");
        for (header, pieces) in
            [(0, vec![]), (3, vec![0]), (7, vec![BLOCK - 7, 1]), (BLOCK + 5, vec![5, 3 * BLOCK, 99])]
        {
            let (header, pieces) = (bytes(header), pieces.into_iter().map(bytes).collect::<Vec<_>>());
            let parts: Vec<&[u8]> = pieces.iter().map(Vec::as_slice).collect();
            write(&path, MAGIC, &header, &parts).unwrap();
            assert_eq!(read(&path, MAGIC).unwrap(), Contents { header, data: pieces.concat() });
            assert!(matches!(read(&path, b"TRISELSE"), Err(ChecksummedFileError::Other)));
        }
        fs::remove_file(path).unwrap();
    }

    /// Cuts at each byte, and a flipped bit in each byte of a small file and in some of a large
    /// one.
    #[test]
    fn damage_shows() {
        let path = path("damage");
        for length in [100, 2 * BLOCK + 17] {
            write(&path, MAGIC, b"header", &[&bytes(length)]).unwrap();
            let whole = fs::read(&path).unwrap();
            let step = if length > BLOCK { 1009 } else { 1 };
            for at in (0..whole.len()).step_by(step) {
                let mut flipped = whole.clone();
                flipped[at] ^= 1 << (at % 8);
                fs::write(&path, &flipped).unwrap();
                assert!(read(&path, MAGIC).is_err(), "byte {at} of {}", whole.len());
                fs::write(&path, &whole[..at]).unwrap();
                assert!(read(&path, MAGIC).is_err(), "cut at {at} of {}", whole.len());
            }
            // Negative control: the unchanged file is read.
            fs::write(&path, &whole).unwrap();
            assert!(read(&path, MAGIC).is_ok());
        }
        fs::remove_file(path).unwrap();
    }

    #[test]
    fn a_folder_that_is_not_there_leaves_nothing() {
        let path = path("nowhere").join("file");
        assert!(write(&path, MAGIC, b"", &[]).is_err());
        assert!(!path.exists());
    }
}
