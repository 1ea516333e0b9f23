//! Fuzz target: STL, binary and text.

#![no_main]

use libfuzzer_sys::fuzz_target;
use trisect::scene::import::stl;
use trisect_fuzz::{Choices, bounded, model};

fuzz_target!(|bytes: &[u8]| {
    bounded(bytes.len(), || model(stl::parse(bytes, "fuzz.stl"), &Choices::of(bytes)));
});
