//! Models without a scene file: their light, and their exposure.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use std::fs;
use trisect::image::Image;
use trisect::output;
use trisect_tests::mpi;
use trisect_tests::program::{Temporary, trisect};

/// Returns a glTF file: a cube of half width 1 on a floor of half width `floor`, seen from a
/// corner. `changes` replace members of the document.
fn model(floor: f32, changes: Value) -> String {
    let cube = (0..8).flat_map(|i| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0f32 } else { -1.0 }));
    let ground = [[-floor, -1.0, -floor], [-floor, -1.0, floor], [floor, -1.0, floor], [floor, -1.0, -floor]];
    let positions: Vec<f32> = cube.chain(ground.into_iter().flatten()).collect();
    let quads =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6], [8, 9, 10, 11]];
    let indices: Vec<u8> = quads.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]).collect();
    let mut data: Vec<u8> = positions.iter().flat_map(|value| value.to_le_bytes()).collect();
    let vertices = data.len();
    data.extend(&indices);
    let grey =
        json!({ "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0 } });
    let mut document = json!({
        "asset": { "version": "2.0" },
        "nodes": [{ "mesh": 0 }],
        "materials": [grey],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }] }],
        "buffers": [{ "byteLength": data.len(), "uri": format!("data:;base64,{}", STANDARD.encode(&data)) }],
        "bufferViews": [
            { "buffer": 0, "byteLength": vertices },
            { "buffer": 0, "byteOffset": vertices, "byteLength": indices.len() },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 12, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5121, "count": indices.len(), "type": "SCALAR" },
        ],
    });
    for (key, value) in changes.as_object().unwrap() {
        document[key] = value.clone();
    }
    document.to_string()
}

/// Returns changes for [`model`] that add slanting sunlight of `lux`.
fn sun(lux: f64) -> Value {
    let light = json!({ "KHR_lights_punctual": { "light": 0 } });
    json!({
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "directional", "intensity": lux }] } },
        "nodes": [{ "mesh": 0 }, { "rotation": [-0.8, 0, 0, 0.6], "extensions": light }],
    })
}

fn run(arguments: &[&str]) -> String {
    let output = trisect(arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {said}");
    said
}

const SMALL: &[&str] = &["--backend", "cpu", "--resolution", "48x27", "--depth", "4"];

fn render(scene: &str, image: &str, more: &[&str]) -> String {
    run(&[&["render", scene, "-o", image], SMALL, more].concat())
}

/// Returns the share of an image's pixels for which `holds` is true.
fn share(path: &str, holds: impl Fn(&[f32; 3]) -> bool) -> f64 {
    let image = Image::read(path.as_ref()).unwrap();
    image.pixels.iter().filter(|pixel| holds(pixel)).count() as f64 / image.pixels.len() as f64
}

/// Returns the share among the pixels that are not black. The background of a model with its own
/// lights is black.
fn share_of_seen(path: &str, holds: impl Fn(&[f32; 3]) -> bool) -> f64 {
    share(path, |pixel| !is_black(pixel) && holds(pixel)) / share(path, |pixel| !is_black(pixel))
}

fn is_black(pixel: &[f32; 3]) -> bool {
    pixel.iter().all(|channel| *channel < 0.01)
}

fn is_white(pixel: &[f32; 3]) -> bool {
    pixel.iter().all(|channel| *channel == 1.0)
}

/// A glowing lamp on a body does not count as the light of a model: without a sky, everything but
/// the lamp would be black.
#[test]
fn a_glowing_texel_leaves_the_sky() {
    let folder = Temporary::new("models", "sky");
    let (scene, image) = (folder.file("helmet.gltf"), folder.file("a.png"));
    let mut texels = [0; 3 * 64];
    texels[3 * 9..3 * 10].fill(255);
    let png = output::encode_bytes(8, 8, &texels).unwrap();
    output::write_file(&folder.path("lamp.png"), &png).unwrap();
    let lamp = json!({
        "images": [{ "uri": "lamp.png" }],
        "textures": [{ "source": 0 }],
        "materials": [{ "pbrMetallicRoughness": { "metallicFactor": 0 }, "emissiveFactor": [1, 1, 1],
            "emissiveTexture": { "index": 0 } }],
    });
    fs::write(&scene, model(1.5, lamp)).unwrap();
    let said = render(&scene, &image, &["--spp", "4"]);
    assert!(said.contains("do not carry the image: the built-in studio is added"), "{said}");
    assert_eq!(share(&image, is_black), 0.0);
    // Negative control: a model with a light that illuminates the rest gets no sky, and is black
    // where the light does not reach.
    let lit = json!({ "materials": [{ "emissiveFactor": [0, 0, 0] }], "nodes": [{ "mesh": 0 }] });
    fs::write(&scene, model(1.5, lit)).unwrap();
    assert!(render(&scene, &image, &["--spp", "1"]).contains("no light: the built-in studio lights"));
    fs::write(&scene, model(1.5, sun(3.0))).unwrap();
    let said = render(&scene, &image, &["--spp", "4"]);
    assert!(
        said.contains("lit by the model's own lights: no sky is added") && !said.contains("studio"),
        "{said}"
    );
    assert!(share(&image, is_black) > 0.3);
}

/// Returns the printed exposure, as an argument.
fn printed(said: &str) -> String {
    let line = said.lines().find(|line| line.starts_with("exposure ")).unwrap_or_else(|| panic!("{said}"));
    assert!(line.ends_with("EV (from the median luminance; --exposure 0 for none)"), "{line}");
    line.split(' ').nth(1).unwrap().to_owned()
}

#[test]
fn a_model_in_lux_is_shown_with_an_exposure() {
    let folder = Temporary::new("models", "lux");
    let file = |name: &str| folder.file(name);
    let (scene, auto, stats) = (file("sun.gltf"), file("auto.png"), file("stats.json"));
    fs::write(&scene, model(3.0, sun(100_000.0))).unwrap();
    let stops = printed(&render(&scene, &auto, &["--spp", "16", "--stats", &stats]));
    let value: f32 = stops.parse().unwrap();
    // White reflects 100,000 / π times the cosine, and grey half of that: -16.3 stops give 0.18.
    assert!((-17.5..=-14.5).contains(&value), "{stops}");
    let stats: Value = serde_json::from_slice(&fs::read(&stats).unwrap()).unwrap();
    assert_eq!(stats["exposure"].as_f64().unwrap() as f32, value);
    assert!(share_of_seen(&auto, is_white) < 0.05);
    let middle = |pixel: &[f32; 3]| (0.1..0.4).contains(&pixel[1]);
    assert!(share_of_seen(&auto, middle) > 0.5);
    // Negative control: without exposure, all that is lit is white. And the printed number as an
    // argument gives the same image.
    let other = file("other.png");
    let said = render(&scene, &other, &["--spp", "16", "--exposure", "0"]);
    assert!(!said.contains("exposure"), "{said}");
    assert!(share_of_seen(&other, is_white) > 0.5);
    render(&scene, &other, &["--spp", "16", "--exposure", &stops]);
    assert_eq!(fs::read(&auto).unwrap(), fs::read(&other).unwrap());
    // Linear formats keep radiance, unless a number is given.
    let (linear, darker) = (file("a.pfm"), file("b.pfm"));
    assert!(!render(&scene, &linear, &["--spp", "2"]).contains("exposure"));
    render(&scene, &darker, &["--spp", "2", "--exposure", "-2"]);
    let [linear, darker] = [linear, darker].map(|path| Image::read(path.as_ref()).unwrap().pixels);
    assert!(linear.iter().flatten().any(|channel| *channel > 1e3));
    assert!(linear.iter().flatten().zip(darker.iter().flatten()).all(|(a, b)| 0.25 * a == *b));
    // A scene file has no automatic exposure.
    let around = file("around.ron");
    trisect(&["check", &scene, "--write", &around]);
    assert!(!render(&around, &other, &["--spp", "2"]).contains("exposure"));
    for bad in ["nan", "-65"] {
        let output = trisect(&["render", &scene, "--exposure", bad, "-o", &other]);
        assert_eq!(output.status.code(), Some(2));
    }
}

/// Exposure is applied when an image is written: merged parts and ranks write the same file as one
/// render.
#[test]
fn pieces_and_ranks_have_the_exposure_of_the_whole() {
    let folder = Temporary::new("models", "pieces");
    let file = |name: &str| folder.file(name);
    let (scene, whole) = (file("sun.gltf"), file("whole.png"));
    fs::write(&scene, model(3.0, sun(100_000.0))).unwrap();
    let said = render(&scene, &whole, &["--spp", "512"]);
    let bytes = fs::read(&whole).unwrap();
    let (first, second, image) = (file("1.ckpt"), file("2.ckpt"), file("image.png"));
    for (checkpoint, samples) in [(&first, "0..256"), (&second, "256..512")] {
        render(&scene, &image, &["--spp", "512", "--sample-range", samples, "--checkpoint", checkpoint]);
    }
    let merged = file("merged.png");
    assert_eq!(printed(&run(&["merge", &first, &second, "-o", &merged])), printed(&said));
    assert!(fs::read(&merged).unwrap() == bytes);
    run(&["merge", &first, &second, "-o", &merged, "--exposure", "0"]);
    assert!(fs::read(&merged).unwrap() != bytes);
    // A complete checkpoint is resumed with nothing left to render.
    let all = file("all.ckpt");
    render(&scene, &image, &["--spp", "512", "--checkpoint", &all, "--exposure", "1"]);
    run(&["resume", &all, "-o", &image, "--exposure", &printed(&said)]);
    assert!(fs::read(&image).unwrap() == bytes);
    if mpi::available() {
        let arguments =
            ["render", &scene, "-o", &image, "--spp", "512", "--threads", "1", "--distribute", "rows"];
        let output = mpi::run(2, &[&arguments[..], SMALL].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(fs::read(&image).unwrap() == bytes);
    }
}

#[test]
fn the_viewer_shows_a_model_with_an_exposure() {
    let folder = Temporary::new("models", "view");
    let (scene, frames) = (folder.file("sun.gltf"), folder.file("frames"));
    fs::write(&scene, model(3.0, sun(100_000.0))).unwrap();
    let view = ["view", &scene, "--headless", "--frames", "2", "--denoise", "off", "-o", &frames];
    let said = run(&[&view[..], SMALL].concat());
    let stops: f32 = printed(&said).parse().unwrap();
    let first = format!("{frames}/0001.png");
    assert!(share_of_seen(&first, is_white) < 0.1);
    // It is the exposure of `render`, within the noise of a small image.
    let rendered: f32 = printed(&render(&scene, &folder.file("a.png"), &["--spp", "16"])).parse().unwrap();
    assert!((stops - rendered).abs() <= 0.2, "{stops} and {rendered}");
    let bytes = fs::read(&first).unwrap();
    assert!(!run(&[&view[..], SMALL, &["--exposure", "0"]].concat()).contains("exposure"));
    assert!(share_of_seen(&first, is_white) > 0.5);
    if mpi::available() {
        let output = mpi::run(2, &[&view[..], SMALL, &["--threads", "1", "--distribute", "rows"]].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        assert_eq!(printed(&said).parse(), Ok(stops));
        assert!(fs::read(&first).unwrap() == bytes);
    }
}

/// A model in the current folder finds an image by its name, as one in another folder does.
#[test]
fn images_are_found_from_a_bare_name() {
    let folder = Temporary::new("models", "bare");
    fs::write(
        folder.path("a.obj"),
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n",
    )
    .unwrap();
    fs::write(folder.path("a.mtl"), "newmtl m\nmap_Kd C:\\Users\\me\\Wood.png\n").unwrap();
    fs::write(folder.path("wood.png"), output::encode_bytes(2, 2, &[200; 12]).unwrap()).unwrap();
    for name in ["a.obj", "./a.obj"] {
        let output = std::process::Command::new(trisect_tests::binary())
            .args(["check", name])
            .current_dir(folder.path(""))
            .output()
            .unwrap();
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && told.contains("wood.png"), "{name}: {told}");
    }
}
