//! Fuzz target: scene files. The current folder has small files that they may name: `m.glb`,
//! `m.obj`, `m.ply`, `t.png`, `s.hdr`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use std::fs::write;
use trisect::scene::Scene;
use trisect_fuzz::{bounded, enter_folder, scene};

const FILES: [(&str, &[u8]); 5] = [
    ("m.glb", include_bytes!("../corpus/glb/container.glb")),
    ("m.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n"),
    ("m.ply", include_bytes!("../corpus/ply/ascii.ply")),
    ("t.png", include_bytes!("../../scenes/gltf/features_tiles.png")),
    ("s.hdr", include_bytes!("../../scenes/textures/sky.hdr")),
];

/// Returns the size of these files in bytes, which a scene may also read.
fn files() -> usize {
    FILES.iter().map(|file| file.1.len()).sum()
}

fuzz_target!(
    init: {
        enter_folder();
        for (name, bytes) in FILES {
            write(name, bytes).expect("the folder can be written to");
        }
    },
    |text: &str| {
        // A file name that leads out of the folder must not be followed, nor one that may do so
        // with escaped letters.
        let leads_out = text.contains("..") || text.contains("\"/") || text.contains('\\');
        if !(leads_out && text.contains("file")) {
            bounded(text.len() + files(), || scene(Scene::parse(text, "fuzz.ron")));
        }
    }
);
