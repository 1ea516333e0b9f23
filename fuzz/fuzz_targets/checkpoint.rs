//! Fuzz target: checkpoints, whose checksums are not verified. The input is a whole file, or a
//! header and data separated by the first byte 0, from which a file with correct lengths is made,
//! so that the code behind their check is reached. A checkpoint that can be read is merged with
//! itself.

#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;
use trisect::checkpoint::Checkpoint;
use trisect_fuzz::bounded;

const MAGIC: &[u8] = b"TRISCKP1";

fuzz_target!(|bytes: &[u8]| {
    if bytes.starts_with(MAGIC) {
        return bounded(bytes.len(), || read(bytes.to_vec()));
    }
    let mut parts = bytes.splitn(2, |byte| *byte == 0);
    let (header, data) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
    let lengths = [header.len(), data.len()].map(|length| (length as u64).to_le_bytes()).concat();
    // Four bytes of checksum follow the lengths, and four for each 64 KiB follow the data.
    let sums = vec![0; 4 * (header.len() + data.len()).div_ceil(1 << 16)];
    let file = [MAGIC, &lengths, &[0; 4], header, data, &sums].concat();
    bounded(file.len(), || read(file));
});

fn read(bytes: Vec<u8>) {
    let path = Path::new("fuzz.ckpt");
    let Ok(mut one) = Checkpoint::from_bytes(bytes, path) else { return };
    let missing = one.film.coverage.missing(&(0..one.header.spp));
    assert!(missing.iter().all(|part| !part.rows.is_empty() && !part.samples.is_empty()));
    let _ = (one.film.counts(), one.film.image());
    let parts = one.film.coverage.parts();
    let twice = one.merge(path, &one.clone());
    assert_eq!(twice.is_err(), !parts.is_empty(), "samples that the film already has were added");
}
