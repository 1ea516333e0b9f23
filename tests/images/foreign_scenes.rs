//! Compares scenes in the formats of Mitsuba and pbrt with images of Mitsuba 3
//! (`tests/reference/mitsuba/xml`), by blocks of 8 x 8 pixels and as a whole, and with each other.
//! Each comparison has negative controls, which must be detected.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::path::PathBuf;
use trisect::image::Image;
use trisect::render::Settings;
use trisect::scene::{Rebase, Scene, SceneDocument};
use trisect_tests::renders::{cpu, film, independent, lit};
use trisect_tests::statistics::{BlockTest, Blocks};

fn folder() -> PathBuf {
    let root = trisect_tests::root();
    let folders = [root.join("tests/reference/mitsuba/xml"), root.join("reference/mitsuba/xml")]; // the second in a bundle
    folders.into_iter().find(|folder| folder.exists()).expect("tests/reference/mitsuba/xml")
}

/// Reads the means of blocks, and their standard errors. All blocks have the same size.
fn reference(name: &str) -> Blocks {
    let read = |name: String| Image::read(&folder().join(name)).unwrap();
    let (mean, error) = (read(format!("{name}.pfm")), read(format!("{name}.error.pfm")));
    let n = mean.pixels.len() as f64;
    let (mut blocks, mut whole) = (Vec::new(), ([0.0; 3], [0.0; 3]));
    for (mean, error) in mean.pixels.iter().zip(&error.pixels) {
        let block = (mean.map(f64::from), error.map(|error| f64::from(error).powi(2)));
        for c in 0..3 {
            whole.0[c] += block.0[c] / n;
            whole.1[c] += block.1[c] / (n * n);
        }
        blocks.push(block);
    }
    Blocks { blocks, whole }
}

fn scene(file: &str) -> Scene {
    let document = SceneDocument::load(&folder().join(file)).unwrap();
    assert!(document.warnings().is_empty(), "{file}: {:?}", document.warnings());
    document.lower(Rebase::IDENTITY).unwrap()
}

fn render(scene: &Scene, samples: u32, seed: u32) -> Blocks {
    let settings = Settings { samples, seed, ..independent(scene) };
    let film = film(&mut cpu(scene), &settings);
    assert_eq!(film.counts().rejected, 0);
    assert_eq!((film.width, film.height), (64, 48));
    Blocks::new(&film)
}

/// Negative control: the name of a fault, and the function that puts it into a scene.
type Fault = (&'static str, fn(&mut Scene));

/// Compares a scene with Mitsuba's image of it. A relative difference of `model` is allowed, for
/// materials that both programs model otherwise.
fn check(name: &str, samples: u32, model: f64, faults: &[Fault]) {
    let (good, reference) = (scene(&format!("{name}.xml")), reference(name));
    let compare = |scene: &Scene| -> BlockTest { render(scene, samples, 3).compare(&reference, model) };
    let test = compare(&good);
    eprintln!("{name}: {test:?}");
    assert!(test.passes(), "{name}: {test:?}");
    for (fault, plant) in faults {
        let mut scene = good.clone();
        plant(&mut scene);
        let test = compare(&scene);
        eprintln!("{name}, {fault}: {test:?}");
        assert!(!test.passes(), "{name}, {fault} went unnoticed: {test:?}");
    }
}

/// Makes all light 2 % brighter.
fn brighter(scene: &mut Scene) {
    *scene = lit(scene, 1.02);
}

fn rougher(scene: &mut Scene) {
    scene.materials.iter_mut().for_each(|m| m.roughness *= 1.2);
}

/// Exchanges the parts of the index of refraction of metals.
fn other_metals(scene: &mut Scene) {
    scene.materials.iter_mut().for_each(|m| (m.eta, m.k) = (m.k, m.eta));
}

#[test]
fn diffuse_box() {
    check("cornell_box", 256, 1e-4, &[("2 % brighter", brighter)]);
}

#[test]
fn rough_plates() {
    // Mitsuba masks by the product of both directions.
    let brighter: fn(&mut Scene) = |scene| *scene = lit(scene, 1.1);
    let faults: &[Fault] =
        &[("10 % brighter", brighter), ("rougher", rougher), ("other metals", other_metals)];
    check("plates", 256, 0.03, faults);
}

#[test]
fn glass_metal_and_plastic() {
    // Plastic differs by the direction that light comes from.
    let brighter: fn(&mut Scene) = |scene| *scene = lit(scene, 1.05);
    let denser: fn(&mut Scene) = |scene| {
        scene.materials.iter_mut().for_each(|m| m.ior *= 1.2);
    };
    let faults: &[Fault] = &[("5 % brighter", brighter), ("other metals", other_metals), ("denser", denser)];
    check("materials", 256, 0.02, faults);
}

#[test]
fn textures_meshes_and_panorama() {
    let brighter: fn(&mut Scene) = |scene| *scene = lit(scene, 1.04);
    let mirrored: fn(&mut Scene) = |scene| {
        scene.textures.iter_mut().for_each(|texture| texture.uu = -texture.uu);
    };
    let turned: fn(&mut Scene) = |scene| {
        if let Some(sky) = &mut scene.environment {
            sky.rotation += 0.1;
        }
    };
    // The panorama is resampled, and the edge of the light on the smooth torus is softened.
    check(
        "table",
        256,
        0.015,
        &[("4 % brighter", brighter), ("mirrored images", mirrored), ("turned sky", turned)],
    );
}

#[test]
fn instances_through_a_lens() {
    let sharp: fn(&mut Scene) = |scene| scene.camera.defocus_angle = 0.0;
    check("instances", 256, 1e-4, &[("2 % brighter", brighter), ("pinhole", sharp)]);
}

/// A scene in both formats has one image.
#[test]
fn pbrt_scenes_are_those_of_mitsuba() {
    for name in ["cornell_box", "materials"] {
        let [mitsuba, pbrt] = ["xml", "pbrt"].map(|format| scene(&format!("{name}.{format}")));
        let of_mitsuba = render(&mitsuba, 256, 5);
        let test = render(&pbrt, 256, 6).compare(&of_mitsuba, 1e-5);
        eprintln!("{name}: {test:?}");
        assert!(test.passes(), "{name}: {test:?}");
        let test = render(&lit(&pbrt, 1.02), 256, 6).compare(&of_mitsuba, 1e-5);
        assert!(!test.passes(), "{name}, 2 % brighter went unnoticed: {test:?}");
    }
}
