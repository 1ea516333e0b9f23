//! Checkpoints, whose checksums are skipped; two that can be read are added.

#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;
use trisect::checkpoint::Checkpoint;

fuzz_target!(|bytes: &[u8]| {
    let path = Path::new("fuzz.ckpt");
    let Ok(mut one) = Checkpoint::from_bytes(bytes.to_vec(), path) else { return };
    let missing = one.film.coverage.missing(&(0..one.header.spp));
    assert!(missing.iter().all(|part| !part.rows.is_empty() && !part.samples.is_empty()));
    let _ = (one.film.counts(), one.film.image());
    let parts = one.film.coverage.parts();
    let twice = one.merge(path, &one.clone());
    assert_eq!(twice.is_err(), !parts.is_empty(), "what is there already was added");
});
