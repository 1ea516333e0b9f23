//! Tone maps of image files: `--tonemap` of `render`, `resume` and `merge`.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use serde_json::Value;
use std::fs;
use trisect_tests::mpi;
use trisect_tests::program::{Temporary, check_failure, trisect};

/// A sky of middle grey, before which a bright orange ball is half as wide as the image.
const SCENE: &str = "Scene(version: 1, image: (width: 32, height: 16, samples: 4, depth: 3), \
    camera: (look_from: (0, 0, 5), look_at: (0, 0, 0), vertical_fov: 30), \
    sky: Uniform(radiance: (0.18, 0.18, 0.18)), \
    materials: { \"lamp\": Emissive(radiance: (8, 3, 0.5)) }, \
    objects: [Sphere(center: (0, 0, 0), radius: 1.3, material: \"lamp\")])";

fn run(arguments: &[&str]) {
    let output = trisect(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

fn render(scene: &str, image: &str, options: &[&str]) {
    run(&[&["render", scene, "-o", image, "--backend", "cpu", "-q"], options].concat());
}

/// Returns the corner pixel and the middle pixel, as bytes of sRGB.
fn ends(path: &str) -> [[u8; 3]; 2] {
    let image = image::open(path).unwrap().to_rgb8();
    [image.get_pixel(0, 0).0, image.get_pixel(image.width() / 2, image.height() / 2).0]
}

/// Middle grey and a bright colour have the values of the published curves, in f64 by hand: AgX
/// brings middle grey to half the range of a display of gamma 2.2.
#[test]
fn curves_are_applied_to_files_for_a_display() {
    let folder = Temporary::new("tonemap", "curves");
    fs::write(folder.path("a.ron"), SCENE).unwrap();
    let (scene, image, stats) = (folder.file("a.ron"), folder.file("a.png"), folder.file("a.json"));
    let mut seen = Vec::new();
    for (curve, grey) in [("none", 118), ("filmic", 100), ("agx", 128), ("aces", 91)] {
        render(&scene, &image, &["--tonemap", curve, "--stats", &stats]);
        let [sky, lamp] = ends(&image);
        assert!(sky.iter().all(|channel| channel.abs_diff(grey) <= 2), "{curve}: {sky:?} for {grey}");
        assert!(lamp[0] >= lamp[1] && lamp[1] >= lamp[2], "{curve}: {lamp:?}");
        let told: Value = serde_json::from_slice(&fs::read(&stats).unwrap()).unwrap();
        assert_eq!(told["tonemap"], curve);
        seen.push(lamp);
    }
    assert_eq!(seen[0], [255, 255, 188], "clipped");
    assert!(seen[1..].iter().all(|lamp| lamp[2] != 188), "a curve that does nothing: {seen:?}");
    // The exposure comes before the curve.
    render(&scene, &image, &["--tonemap", "agx", "--exposure", "2"]);
    assert!(ends(&image)[0][0] > 170);
}

/// A transparent image has the mapped colours of what covers its pixels.
#[test]
fn transparent_colours_are_mapped() {
    let folder = Temporary::new("tonemap", "transparent");
    fs::write(folder.path("a.ron"), SCENE).unwrap();
    let (scene, with, without) = (folder.file("a.ron"), folder.file("a.png"), folder.file("b.png"));
    render(&scene, &with, &["--tonemap", "agx", "--background", "transparent"]);
    render(&scene, &without, &["--tonemap", "agx"]);
    assert_eq!(ends(&with)[1], ends(&without)[1]);
}

/// A resumed and a merged image have the curve of the render, unless they name another.
#[test]
fn pieces_keep_the_curve() {
    let folder = Temporary::new("tonemap", "pieces");
    fs::write(folder.path("a.ron"), SCENE).unwrap();
    let file = |name: &str| folder.file(name);
    let (scene, kept) = (file("a.ron"), file("a.ckpt"));
    render(&scene, &file("agx.png"), &["--tonemap", "agx", "--checkpoint", &kept]);
    render(&scene, &file("none.png"), &[]);
    let bytes = |name: &str| fs::read(folder.path(name)).unwrap();
    run(&["merge", &kept, "-o", &file("merged.png")]);
    run(&["merge", &kept, "-o", &file("plain.png"), "--tonemap", "none"]);
    run(&["resume", &kept, "-o", &file("resumed.png"), "-q"]);
    assert_eq!(bytes("merged.png"), bytes("agx.png"));
    assert_eq!(bytes("resumed.png"), bytes("agx.png"));
    assert_eq!(bytes("plain.png"), bytes("none.png"));
    assert_ne!(bytes("none.png"), bytes("agx.png"), "a curve that does nothing");
}

/// Ranks give the image of one process.
#[test]
fn ranks_have_the_curve() {
    if !mpi::available() {
        return;
    }
    let folder = Temporary::new("tonemap", "ranks");
    fs::write(folder.path("a.ron"), SCENE).unwrap();
    let (scene, one, two) = (folder.file("a.ron"), folder.file("one.png"), folder.file("two.png"));
    render(&scene, &one, &["--tonemap", "aces"]);
    let arguments = ["render", &scene, "-o", &two, "--backend", "cpu", "-q", "--tonemap", "aces"];
    let output = mpi::run(2, &[&arguments[..], &["--distribute", "rows"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(fs::read(&one).unwrap(), fs::read(&two).unwrap());
}

#[test]
fn other_formats_and_names_are_refused() {
    let folder = Temporary::new("tonemap", "refused");
    fs::write(folder.path("a.ron"), SCENE).unwrap();
    for format in ["exr", "hdr", "pfm"] {
        let file = folder.file(&format!("a.{format}"));
        let arguments = ["render", &folder.file("a.ron"), "-o", &file, "--tonemap", "filmic"];
        let wanted = ["--tonemap is for a display, and the format holds linear radiance; use .png"];
        check_failure(&trisect(&arguments), &arguments, 2, &wanted);
        assert!(!folder.path(&format!("a.{format}")).exists());
    }
    let arguments = ["render", &folder.file("a.ron"), "--tonemap", "reinhard"];
    let wanted = ["unknown curve; available: none, filmic, agx, aces"];
    check_failure(&trisect(&arguments), &arguments, 2, &wanted);
}
