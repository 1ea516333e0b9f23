//! Fuzz target: glTF as JSON. Every file that it names has the content after the first byte 0, or
//! is the whole input without a byte 0, so that buffers and images have content.

#![no_main]

use libfuzzer_sys::fuzz_target;
use trisect::scene::import::gltf;
use trisect_fuzz::{Same, bounded, model};

fuzz_target!(|bytes: &[u8]| {
    let mut parts = bytes.splitn(2, |byte| *byte == 0);
    let json = parts.next().unwrap_or_default();
    let file = parts.next().unwrap_or(json);
    bounded(bytes.len(), || model(gltf::parse(json, "fuzz.gltf", &mut Same(file))));
});
