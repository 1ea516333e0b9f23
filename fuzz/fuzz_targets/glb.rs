//! Fuzz target: GLB. The input is a whole file, or JSON and a buffer separated by the first byte 0,
//! from which a valid container is made, so that the code behind its checks is reached.

#![no_main]

use libfuzzer_sys::fuzz_target;
use std::borrow::Cow;
use trisect::scene::import::{NoFiles, gltf};
use trisect_fuzz::{Choices, bounded, glb, model};

fuzz_target!(|bytes: &[u8]| {
    let file = if bytes.starts_with(b"glTF") { Cow::Borrowed(bytes) } else { Cow::Owned(glb(bytes)) };
    let choices = Choices::of(bytes);
    bounded(file.len(), || {
        model(gltf::parse(&file, "fuzz.glb", &choices.options, &mut NoFiles), &choices);
    });
});
