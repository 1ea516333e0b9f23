//! Scene files. The current folder has small files that they may name: `m.glb`, `m.obj`, `m.ply`, `t.png`, `s.hdr`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use std::fs::write;
use trisect::scene::Scene;
use trisect_fuzz::{enter_folder, scene};

fuzz_target!(
    init: {
        enter_folder();
        let files: [(&str, &[u8]); 5] = [
            ("m.glb", include_bytes!("../corpus/glb/container.glb")),
            ("m.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n"),
            ("m.ply", include_bytes!("../corpus/ply/ascii.ply")),
            ("t.png", include_bytes!("../../scenes/gltf/features_tiles.png")),
            ("s.hdr", include_bytes!("../../scenes/textures/sky.hdr")),
        ];
        for (name, bytes) in files {
            write(name, bytes).expect("the folder can be written to");
        }
    },
    |text: &str| {
        // A name that leads out of the folder is not for a fuzzer to follow, nor one that may with its letters escaped.
        let leads_out = text.contains("..") || text.contains("\"/") || text.contains('\\');
        if !(leads_out && text.contains("file")) {
            scene(Scene::parse(text, "fuzz.ron"));
        }
    }
);
