//! Fuzz target: scenes at several times of their animations, with BVHs that are refitted. The input
//! is a scene file, or a GLB as in the target `glb`. The current folder has `a.glb`, which moves,
//! and the image `t.png`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use std::fs::write;
use std::path::Path;
use trisect::bvh::BvhQuality;
use trisect::render::{PreparedScene, SceneTree};
use trisect::scene::{AnimatedScene, LoadOptions, SceneError};
use trisect_fuzz::{Choices, bounded, enter_folder, glb, has_few_triangles, is_small, promises, records};

const FILES: [(&str, &[u8]); 2] = [
    ("a.glb", include_bytes!("../corpus/glb/moving.glb")),
    ("t.png", include_bytes!("../../scenes/gltf/features_tiles.png")),
];

fuzz_target!(
    init: {
        enter_folder();
        for (name, bytes) in FILES {
            write(name, bytes).expect("the folder can be written to");
        }
    },
    |bytes: &[u8]| {
        let choices = Choices::of(bytes);
        let (name, file) = match bytes {
            [b'g', b'l', b'T', b'F', ..] => ("f.glb", bytes.to_vec()),
            [b'{', ..] => ("f.glb", glb(bytes)),
            _ if leads_out(bytes) => return,
            _ => ("f.ron", bytes.to_vec()),
        };
        let named: usize = FILES.iter().map(|file| file.1.len()).sum();
        write(name, &file).expect("the folder can be written to");
        bounded(file.len() + named, || drop(frames(Path::new(name), &choices)));
    }
);

/// Returns whether a scene may name files outside its folder, which must not be followed.
fn leads_out(text: &[u8]) -> bool {
    let has = |part: &[u8]| text.windows(part.len()).any(|of| of == part);
    has(b"file") && (has(b"..") || has(b"\"/") || has(b"\\"))
}

fn frames(path: &Path, choices: &Choices) -> Result<(), SceneError> {
    let Choices { options, surroundings, sharing, .. } = choices;
    let (model, surroundings) = (options.clone(), surroundings.clone());
    let options = LoadOptions { model, surroundings, ..LoadOptions::default() };
    let mut scene = AnimatedScene::load(path, &options)?;
    scene.sharing = *sharing;
    let quality = Some(BvhQuality::Fast);
    let mut tree: Option<SceneTree> = None;
    for time in [0.0, 0.5, 0.75, 1e9] {
        let document = scene.document(time)?;
        promises(&document.description);
        if !has_few_triangles(&document.description) {
            return Ok(());
        }
        let lowered = scene.lower(document)?;
        records(&lowered);
        if !is_small(&lowered) {
            return Ok(());
        }
        let prepared = match tree.take() {
            Some(tree) => PreparedScene::moved(&lowered, quality, tree),
            None => PreparedScene::new(&lowered, quality),
        };
        tree = Some(prepared.expect("every scene has a tree").into_tree());
    }
    Ok(())
}
