//! Fuzz target: glTF as JSON, which ends at the first byte 0. Every file that it names consists of
//! the bytes after that, or of the whole input if it has no byte 0.

#![no_main]

use libfuzzer_sys::fuzz_target;
use trisect::scene::import::gltf;
use trisect_fuzz::{Choices, Same, bounded, model};

fuzz_target!(|bytes: &[u8]| {
    let mut parts = bytes.splitn(2, |byte| *byte == 0);
    let json = parts.next().unwrap_or_default();
    let file = parts.next().unwrap_or(json);
    let choices = Choices::of(bytes);
    bounded(bytes.len(), || {
        model(gltf::parse(json, "fuzz.gltf", &choices.options, &mut Same(file)), &choices);
    });
});
