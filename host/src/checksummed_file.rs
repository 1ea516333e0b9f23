//! Files that are there whole or not at all, and of which damage shows: written beside their place, synced and moved there, with a CRC-32 of each block.
//!
//! Eight bytes that say what it is; the lengths of header and data, eight bytes each; a CRC-32 of these; header and data; a CRC-32 of each 64 KiB of these two. Numbers
//! are little-endian. In 64 KiB a CRC-32 finds each change of up to three bits, and each within 32 neighbouring ones (Koopman 2002, table 1).

use crate::atomic_file::{Claim, write_atomic};
use crate::input;
use rayon::prelude::*;
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::Path;
use thiserror::Error;

/// Bytes that share a CRC.
const BLOCK: usize = 1 << 16;

/// Bytes of a header, at most: reading one takes many times as many.
const MAX_HEADER: u64 = 1 << 21;

/// Bytes before the header: what it is, both lengths, their CRC.
const PREFIX: usize = 28;

/// What a file is not.
#[derive(Debug, Error)]
pub enum ChecksummedFileError {
    /// The file system refused.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// It begins otherwise.
    #[error("it does not begin as one")]
    Other,
    /// Less than it says that it has, or more.
    #[error("it has {has} bytes in place of {should}: it was cut off, or written to")]
    Length {
        /// Bytes.
        has: u64,
        /// Bytes.
        should: u64,
    },
    /// A header of more than two megabytes.
    #[error("its header of {header} bytes is too long")]
    Header {
        /// Bytes.
        header: u64,
    },
    /// A block whose CRC is another.
    #[error("it was damaged: the checksum of bytes {from} to {to} is another")]
    Damaged {
        /// The first byte of the block.
        from: u64,
        /// One past its last.
        to: u64,
    },
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Contents {
    /// What the data is.
    pub header: Vec<u8>,
    /// The data.
    pub data: Vec<u8>,
}

/// Reads a file of the kind that `magic` says.
///
/// # Errors
///
/// [`ChecksummedFileError`] for another file, and one that was cut off or damaged. Twice its size is allocated, at most.
pub fn read(path: &Path, magic: &[u8; 8]) -> Result<Contents, ChecksummedFileError> {
    let mut file = input::open(path)?;
    let facts = file.metadata()?;
    // What is none is not read whole.
    let mut bytes = Vec::new();
    Read::by_ref(&mut file).take(magic.len() as u64).read_to_end(&mut bytes)?;
    if bytes != magic {
        return Err(ChecksummedFileError::Other);
    }
    file.take(facts.len()).read_to_end(&mut bytes)?;
    open(bytes, magic)
}

/// The same of bytes in memory.
///
/// # Errors
///
/// As [`read`].
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
    // Lengths that the bytes have fit a `usize`.
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

/// Builds for fuzzing skip checksums: what lies behind them is to be found.
fn is_crc(bytes: &[u8], crc: &[u8]) -> bool {
    cfg!(fuzzing) || crc32fast::hash(bytes).to_le_bytes() == *crc
}

/// Writes a file in place of an earlier one, which stays as it was until this one is complete. `data` is one after the other.
///
/// # Errors
///
/// What the file system says; then nothing is left of it.
pub fn write(path: &Path, magic: &[u8; 8], header: &[u8], data: &[&[u8]]) -> io::Result<()> {
    write_atomic(path, |file| write_to(file, magic, header, data))
}

/// Writes a file as [`write()`] does, if none is there or the one that is there is that of `claim`.
///
/// # Errors
///
/// As [`Claim::replace`].
pub fn write_claimed(
    path: &Path,
    claim: &mut Claim,
    magic: &[u8; 8],
    header: &[u8],
    data: &[&[u8]],
) -> io::Result<()> {
    claim.replace(path, |file| write_to(file, magic, header, data))
}

fn write_to(file: &mut File, magic: &[u8; 8], header: &[u8], data: &[&[u8]]) -> io::Result<()> {
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

/// CRCs of blocks of what comes in pieces.
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

    /// Each cut, and a bit flipped in each byte of a small file and in some of a large one.
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
            // The twin: what was not touched is read.
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
