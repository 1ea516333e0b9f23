//! Fuzz target: scene files. The current folder has small files that they may name: `m.glb`,
//! `m.obj`, `m.ply`, `m.stl`, `t.png`, `s.hdr`, `g.vol`, and `a.glb`, which has an animation,
//! variants and instances.

#![no_main]

use libfuzzer_sys::fuzz_target;
use std::fs::write;
use trisect::scene::{EnvironmentSource, SceneDocument, Surroundings};
use trisect_fuzz::{Choices, bounded, enter_folder, has_few_triangles, scene};

const FILES: [(&str, &[u8]); 8] = [
    ("a.glb", include_bytes!("../corpus/glb/moving.glb")),
    ("m.glb", include_bytes!("../corpus/glb/container.glb")),
    ("m.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n"),
    ("m.ply", include_bytes!("../corpus/ply/ascii.ply")),
    ("m.stl", include_bytes!("../corpus/stl/binary.stl")),
    ("t.png", include_bytes!("../../scenes/gltf/features_tiles.png")),
    ("g.vol", include_bytes!("../corpus/grid/small.vol")),
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
            bounded(text.len() + files(), || read(text));
        }
    }
);

fn read(text: &str) {
    let choices = Choices::of(text.as_bytes());
    let Ok(document) = SceneDocument::parse(text, "fuzz.ron") else { return };
    // Mostly the scene keeps its own sky, and a ground can only be taken away.
    let Surroundings { environment, sun, ground } = choices.surroundings.clone();
    let environment = environment.filter(|chosen| *chosen == EnvironmentSource::Studio || sun.is_some());
    let ground = ground.filter(|ground| !ground || sun.is_some());
    let Ok(document) = document.surrounded(&Surroundings { environment, sun, ground }) else { return };
    if has_few_triangles(&document.description) {
        scene(choices.lower(document));
    }
}
