//! Scenes at several times: what moves, what is shared, and scenes of which nothing moves.

use super::*;
use crate::import::testing::{floats, png};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use std::fs;
use std::sync::Arc;
use tempfile::TempDir;

/// Returns a glTF file of a textured triangle that moves from x = 0 to x = 4 in 2 s, with more
/// members in `rest`.
fn moving(rest: &str) -> String {
    let triangle = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let keys = [0.0, 2.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0];
    let data = [floats(&triangle), floats(&keys)].concat();
    let (length, data) = (data.len(), STANDARD.encode(&data));
    format!(
        r#"{{"asset":{{"version":"2.0"}},
        "buffers":[{{"byteLength":{length},"uri":"data:;base64,{data}"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":8}},
            {{"buffer":0,"byteOffset":44,"byteLength":24}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},
            {{"bufferView":1,"componentType":5126,"count":2,"type":"SCALAR"}},
            {{"bufferView":2,"componentType":5126,"count":2,"type":"VEC3"}}],
        "images":[{{"uri":"a.png"}}],"textures":[{{"source":0}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
        "nodes":[{{"mesh":0}}]{rest}}}"#
    )
}

const ANIMATION: &str = r#","animations":[{"name":"go","samplers":[{"input":1,"output":2}],
    "channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}]}]"#;

/// Returns a folder with a model and its image, and the model's path.
fn folder(rest: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.png"), png(2, 1, &[[255, 0, 0, 255], [0, 255, 0, 255]])).unwrap();
    let path = folder.path().join("a.gltf");
    fs::write(&path, moving(rest)).unwrap();
    (folder, path)
}

fn load(path: &Path) -> Result<AnimatedScene, SceneError> {
    AnimatedScene::load(path, &LoadOptions::default())
}

fn at(scene: &mut AnimatedScene, time: f64) -> Scene {
    let document = scene.document(time).unwrap();
    scene.lower(document).unwrap()
}

#[test]
fn models_move_and_what_does_not_is_shared() {
    let (folder, path) = folder(ANIMATION);
    let mut scene = load(&path).unwrap();
    // Each file is read once.
    fs::remove_file(folder.path().join("a.png")).unwrap();
    fs::remove_file(&path).unwrap();
    let (start, middle, end) = (at(&mut scene, 0.0), at(&mut scene, 1.0), at(&mut scene, 9.0));
    let places = [&start, &middle, &end].map(|scene| scene.triangles[0].a.x);
    assert_eq!(places, [0.0, 2.0, 4.0]);
    assert!(Arc::ptr_eq(&start.texels, &middle.texels) && start.texels.len() == 2);
    assert_eq!(start.materials, end.materials);
    // The camera and the sky that the model lacks are those of the start, for all times.
    assert_eq!((start.camera, start.sky.bottom), (end.camera, end.sky.bottom));
    let files = scene.document(0.0).unwrap().description.files;
    assert_eq!(files, [path.clone(), folder.path().join("a.png")]);
    // Negative control: one that starts at the end has another camera.
    let (_other, path) = self::folder(ANIMATION);
    let model = ModelOptions { time: Some(2.0), ..ModelOptions::default() };
    let mut late = AnimatedScene::load(&path, &LoadOptions { model, ..LoadOptions::default() }).unwrap();
    assert_ne!(at(&mut late, 0.0).camera, start.camera);
}

/// A scene at a time is the one that is read at that time.
#[test]
fn the_records_are_those_of_one_time() {
    let (_folder, path) = folder(ANIMATION);
    // The ground, as the camera, is that of the start.
    let surroundings = Surroundings { ground: Some(false), ..Surroundings::default() };
    let plain = LoadOptions { surroundings, ..LoadOptions::default() };
    let mut scene = AnimatedScene::load(&path, &plain).unwrap();
    for time in [0.0, 1.25, 0.5] {
        let mut moved = at(&mut scene, time);
        let model = ModelOptions { time: Some(time), ..ModelOptions::default() };
        let alone = SceneDocument::load_with(&path, &LoadOptions { model, ..plain.clone() }).unwrap();
        let alone = alone.lower(Rebase::IDENTITY).unwrap();
        moved.camera = alone.camera;
        assert_eq!(moved.digest(), alone.digest(), "{time}");
    }
}

#[test]
fn scene_files_place_models_that_move() {
    let (folder, _path) = folder(ANIMATION);
    let camera = "image: (width: 8, height: 8, samples: 1), camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 90)";
    let write = |objects: &str| {
        let path = folder.path().join("a.ron");
        fs::write(&path, format!("Scene(version: 1, {camera}, materials: {{}}, objects: [{objects}])"))
            .unwrap();
        path
    };
    let path = write(r#"Mesh(file: "a.gltf"), Mesh(file: "a.gltf", time: 2)"#);
    let mut scene = load(&path).unwrap();
    let corners = |scene: &Scene| scene.triangles.iter().map(|of| of.a.x).collect::<Vec<_>>();
    assert_eq!(corners(&at(&mut scene, 0.5)), [1.0, 4.0]);
    assert_eq!(corners(&at(&mut scene, 1.5)), [3.0, 4.0]);
    assert_eq!(at(&mut scene, 0.0).camera.look_from, DVec3::new(0.0, 0.0, 3.0));
    // Negative control: models with a time of their own do not move.
    let message = load(&write(r#"Mesh(file: "a.gltf", time: 2)"#)).err().unwrap().to_string();
    assert!(message.contains("a.ron") && message.contains("none of its models moves"), "{message}");
}

#[test]
fn models_without_animations_are_refused() {
    let (_folder, path) = folder("");
    let message = load(&path).err().unwrap().to_string();
    assert!(message.contains("a.gltf: the model has no animation"), "{message}");
    let unknown = load(&path.with_extension("xyz")).err().unwrap();
    assert!(matches!(unknown, SceneError::UnknownFormat { .. }), "{unknown}");
}
