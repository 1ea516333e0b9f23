//! Scenes at several times: what moves, what is shared, and scenes of which nothing moves.

use super::*;
use crate::Includes;
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

/// Returns a folder with a scene file around a model of one triangle.
fn editable() -> (TempDir, PathBuf) {
    let (folder, _) = folder("");
    let path = folder.path().join("a.ron");
    let text = r#"Scene(version: 1, image: (width: 8, height: 8, samples: 1),
        camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 90),
        materials: { "red": Lambertian(albedo: (1, 0, 0)) },
        objects: [Mesh(file: "a.gltf"), Sphere(center: (0, 0, 0), radius: 1, material: "red")])"#;
    fs::write(&path, text).unwrap();
    (folder, path)
}

fn edit(text: &str) -> FieldEdit {
    text.parse().unwrap()
}

/// A change of a material reads no file again, and gives the scene that is read with that change.
#[test]
fn an_edit_reads_no_file_again() {
    let (folder, path) = editable();
    let mut scene = AnimatedScene::load_moving_or_not(&path, &LoadOptions::default()).unwrap();
    let start = at(&mut scene, 0.0);
    let green = edit("materials.red.albedo=0,1,0");
    let options = LoadOptions { edits: vec![green.clone()], ..LoadOptions::default() };
    let alone = SceneDocument::load_with(&path, &options).unwrap().lower(Rebase::IDENTITY).unwrap();
    for file in ["a.gltf", "a.png", "a.ron"] {
        fs::remove_file(folder.path().join(file)).unwrap();
    }
    let edited = scene.edit(&[green], 0.0).unwrap();
    assert_eq!(edited.digest(), alone.digest());
    assert_ne!(edited.materials, start.materials);
    assert_eq!((&edited.triangles, &edited.vertices), (&start.triangles, &start.vertices));
    assert_eq!(edited.texels, start.texels);
    // Without changes the scene is that of the file.
    assert_eq!(scene.set_edits(Vec::new(), 0.0).unwrap().digest(), start.digest());
    // Negative control: what the scene did not name before is read.
    let error = scene.edit(&[edit("objects.0.file=b.gltf")], 0.0).unwrap_err();
    assert!(error.to_string().contains("b.gltf"), "{error}");
}

/// An edit that fails, in its path, in its value or in the scene that it gives, changes nothing.
#[test]
fn an_edit_that_fails_leaves_the_scene() {
    let (_folder, path) = editable();
    let mut scene = AnimatedScene::load_moving_or_not(&path, &LoadOptions::default()).unwrap();
    let first = edit("objects.1.radius=2");
    let before = scene.edit(std::slice::from_ref(&first), 0.0).unwrap().digest();
    for (change, words) in [
        ("materials.rde.albedo=0,1,0", "materials has no rde; it has red"),
        ("objects.1.radius=-1", "radius"),
        ("objects.1.material=blue", "blue"),
        ("camera.look_at=0,0,3", "a.ron"),
    ] {
        let error = scene.edit(&[edit("objects.1.radius=3"), edit(change)], 0.0).unwrap_err().to_string();
        assert!(error.contains(words), "{change}: {error}");
        assert_eq!(scene.edits(), std::slice::from_ref(&first), "{change}");
        assert_eq!(at(&mut scene, 0.0).digest(), before, "{change}");
    }
    // Negative control: the first of both changes alone is made, in place of the earlier one.
    let second = edit("objects.1.radius=3");
    assert_ne!(scene.edit(std::slice::from_ref(&second), 0.0).unwrap().digest(), before);
    assert_eq!(scene.edits(), [second]);
}

#[test]
fn texts_and_the_built_in_scene_are_edited_and_models_are_not() {
    let options = LoadOptions::default();
    let mut built_in = AnimatedScene::hello_world(&options).unwrap();
    assert_eq!(at(&mut built_in, 0.0).digest(), Scene::hello_world().unwrap().digest());
    let moved = built_in.edit(&[edit("camera.look_from=0,1,9")], 0.0).unwrap();
    assert_eq!((moved.camera.look_from.z, built_in.moves()), (9.0, false));
    let (folder, path) = editable();
    let model = folder.path().join("a.gltf");
    let text = fs::read_to_string(&path).unwrap().replace("a.gltf", model.to_str().unwrap());
    let anywhere = LoadOptions { includes: Includes::Anywhere, ..LoadOptions::default() };
    let mut parsed = AnimatedScene::parse(&text, "text", &anywhere).unwrap();
    let smaller = parsed.edit(&[edit("objects.1.radius=0.5")], 0.0).unwrap();
    assert_eq!((smaller.spheres[0].radius, smaller.triangles.len()), (0.5, 1));
    let refused = AnimatedScene::parse(&text, "text", &options).err().unwrap().to_string();
    assert!(refused.contains("text") || refused.contains("a.gltf"), "{refused}");
    let mut model = AnimatedScene::load_moving_or_not(&model, &options).unwrap();
    let error = model.edit(&[edit("image.width=4")], 0.0).unwrap_err().to_string();
    assert!(error.contains("fields of .ron files only"), "{error}");
}

/// A scene with images in memory keeps them over edits, and its records of materials as well.
#[test]
fn images_in_memory_stay() {
    let text = r#"Scene(version: 1, image: (width: 8, height: 8), sky: Uniform(radiance: (1, 1, 1)),
        camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 90),
        textures: {"a": (file: "a.png")},
        materials: {"a": Lambertian(albedo: (1, 1, 1), texture: "a")},
        objects: [Sphere(center: (0, 0, 0), radius: 1, material: "a")])"#;
    let image = |code| Arc::new(TextureImage::new(1, 1, crate::description::Texels::Srgb8(vec![[code; 4]])));
    let images = |code| BTreeMap::from([("a.png".to_owned(), image(code))]);
    let options = LoadOptions { images: images(9), ..LoadOptions::default() };
    let mut scene = AnimatedScene::parse(text, "a", &options).unwrap();
    let edit = |text: &str| vec![text.parse().unwrap()];
    let first = scene.set_edits(edit("objects.0.radius=2"), 0.0).unwrap();
    let second = scene.set_edits(edit("objects.0.radius=3"), 0.0).unwrap();
    assert!(Arc::ptr_eq(&first.texels, &second.texels) && first.texels.len() == 1);
    scene.set_images(images(8));
    let third = scene.set_edits_and(edit("objects.0.radius=3"), 0.0, |document| {
        document.description.shapes.truncate(0);
        Ok(())
    });
    let third = third.unwrap();
    assert_ne!(third.texels, second.texels);
    assert_eq!((second.primitives(), third.primitives()), (1, 0));
}
