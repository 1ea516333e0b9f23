//! Fuzz target: GLB. The input is a whole file, or JSON and a buffer separated by the first byte 0,
//! from which a valid container is made, so that the code behind its checks is reached.

#![no_main]

use libfuzzer_sys::fuzz_target;
use trisect::scene::import::{NoFiles, gltf};
use trisect_fuzz::{bounded, model, options};

fuzz_target!(|bytes: &[u8]| {
    if bytes.starts_with(b"glTF") {
        return bounded(bytes.len(), || model(gltf::parse(bytes, "fuzz.glb", &options(bytes), &mut NoFiles)));
    }
    let mut parts = bytes.splitn(2, |byte| *byte == 0);
    let (json, binary) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
    let chunk = |kind: &[u8; 4], content: &[u8], filler: u8| {
        let mut content = content.to_vec();
        content.resize(content.len().next_multiple_of(4), filler);
        [&(content.len() as u32).to_le_bytes()[..], kind, &content].concat()
    };
    let chunks = [chunk(b"JSON", json, b' '), chunk(b"BIN\0", binary, 0)].concat();
    let length = chunks.len() as u32 + 12;
    let file = [b"glTF", &2u32.to_le_bytes()[..], &length.to_le_bytes(), &chunks].concat();
    bounded(file.len(), || model(gltf::parse(&file, "fuzz.glb", &options(bytes), &mut NoFiles)));
});
