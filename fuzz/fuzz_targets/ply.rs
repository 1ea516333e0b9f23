//! Fuzz target: PLY.

#![no_main]

use libfuzzer_sys::fuzz_target;
use trisect::scene::import::ply;
use trisect_fuzz::{Choices, bounded, model};

fuzz_target!(|bytes: &[u8]| {
    bounded(bytes.len(), || model(ply::parse(bytes, "fuzz.ply"), &Choices::of(bytes)));
});
