//! Environment, sun and ground of the command line: `--env`, `--sun` and `--ground`.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use std::f64::consts::PI;
use std::fs;
use trisect::image::Image;
use trisect_tests::program::{Temporary, check_failure, trisect};

/// A red block from y = 0 to 1 whose base is its lowest face.
const BLOCK: &str = "mtllib block.mtl\nusemtl red\n\
    v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -1 1 -1\nv 1 1 -1\nv 1 1 1\nv -1 1 1\n\
    f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";

const SMALL: &[&str] = &["--backend", "cpu", "--resolution", "48x27", "--depth", "3", "-q"];

fn block(folder: &Temporary) -> String {
    fs::write(folder.path("block.mtl"), "newmtl red\nKd 0.5 0 0\n").unwrap();
    fs::write(folder.path("block.obj"), BLOCK).unwrap();
    folder.file("block.obj")
}

/// Renders to a .pfm and returns it.
fn render(folder: &Temporary, scene: &str, options: &[&str]) -> Image {
    let path = folder.file("image.pfm");
    let arguments = [&["render", scene, "-o", &path], SMALL, options].concat();
    let output = trisect(&arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    Image::read(path.as_ref()).unwrap()
}

/// Writes a panorama of one radiance.
fn panorama(folder: &Temporary, name: &str, radiance: f32) -> String {
    let image = Image { width: 4, height: 2, pixels: vec![[radiance; 3]; 8] };
    image.save(folder.path(name)).unwrap();
    folder.file(name)
}

/// Returns the largest difference of any channel.
fn difference(a: &Image, b: &Image) -> f32 {
    let pairs = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn uniform_light_and_panoramas_are_exact() {
    let folder = Temporary::new("surroundings", "env");
    let model = block(&folder);
    let uniform = render(&folder, &model, &["--spp", "4", "--env", "uniform", "--ground", "off"]);
    assert_eq!(uniform.pixels[0], [1.0; 3]);
    // A scene around the model, under the same sky, is the same image.
    let around = folder.file("around.ron");
    let wrote = trisect(&["check", &model, "--env", "uniform", "--ground", "off", "--write", &around]);
    assert!(wrote.status.success());
    assert!(fs::read_to_string(&around).unwrap().contains("sky: Gradient(bottom: (1.0, 1.0, 1.0)"));
    assert_eq!(render(&folder, &around, &["--spp", "4"]), uniform);
    // A panorama of radiance 2 is twice as bright, within the noise of its sampling.
    let file = panorama(&folder, "two.exr", 2.0);
    let twice = render(&folder, &model, &["--spp", "64", "--env", &file, "--ground", "off"]);
    assert_eq!(twice.pixels[0], [2.0; 3]);
    let sum = |image: &Image| image.pixels.iter().map(|pixel| f64::from(pixel[0])).sum::<f64>();
    assert!((sum(&twice) / sum(&uniform) - 2.0).abs() < 0.05, "{} {}", sum(&twice), sum(&uniform));
    // It replaces the sky of a scene file. Negative control: the studio is another image.
    let replaced = render(&folder, &around, &["--spp", "64", "--env", &file]);
    assert_eq!(replaced, twice);
    let studio = render(&folder, &model, &["--spp", "4", "--ground", "off"]);
    assert!(difference(&studio, &uniform) > 0.3);
}

/// Under a sky of its own level, a dark image becomes as bright as a display shows well; under
/// light of radiance 1, the control, the same block stays as dark as its albedo.
#[test]
fn a_model_under_the_sky_is_not_dark() {
    let folder = Temporary::new("surroundings", "exposure");
    let model = block(&folder);
    let stops = |environment: &str| {
        let path = folder.file("image.png");
        let arguments = ["render", &model, "-o", &path, "--spp=16", "--ground=off", "--env", environment];
        let output = trisect(&[&arguments[..], &SMALL[..6]].concat());
        let text = String::from_utf8(output.stderr).unwrap();
        let line = text.lines().find_map(|line| line.strip_prefix("exposure ")).unwrap_or(&text).to_owned();
        line.split(' ').next().unwrap().parse::<f64>().unwrap_or_else(|_| panic!("{text}"))
    };
    let dark = panorama(&folder, "dark.exr", 0.1);
    assert_eq!(stops("uniform"), 0.0);
    assert!(stops("sky") > 0.5 && stops(&dark) > 0.5, "{} {}", stops("sky"), stops(&dark));
}

/// The radiance of a diffuse plane under the sun alone: albedo / π · irradiance · sine of the
/// elevation.
#[test]
fn the_sun_has_its_irradiance_at_every_elevation() {
    let folder = Temporary::new("surroundings", "sun");
    let scene = folder.file("plane.ron");
    let text = "Scene(version: 1, image: (width: 8, height: 4), \
        camera: (look_from: (0, 3, 0.1), look_at: (0, 0, 0), vertical_fov: 20), \
        materials: { \"a\": Lambertian(albedo: (0.5, 0.5, 0.5)) }, \
        objects: [Plane(point: (0, 0, 0), normal: (0, 1, 0), material: \"a\")])";
    fs::write(&scene, text).unwrap();
    for (sun, want) in [
        ("0,90", 1.0 / PI),
        ("135,30", 0.5 / PI),
        ("-77,30,3.141592653589793", 0.25),
        ("270,0", 0.0),
        ("0,0.001", 0.001f64.to_radians() / PI),
    ] {
        for pixel in render(&folder, &scene, &["--spp", "1", "--sun", sun]).pixels {
            assert!((f64::from(pixel[1]) - want).abs() < 1e-5, "{sun}: {pixel:?} for {want}");
        }
    }
    // A wall that faces +x sees a sun on the horizon at 90, and none at 270.
    let wall = text.replace("(0, 3, 0.1)", "(3, 0, 0)").replace("normal: (0, 1, 0)", "normal: (1, 0, 0)");
    fs::write(&scene, wall).unwrap();
    for (sun, want) in [("90,0", 1.0 / PI), ("270,0", 0.0)] {
        for pixel in render(&folder, &scene, &["--spp", "1", "--sun", sun]).pixels {
            assert!((f64::from(pixel[1]) - want).abs() < 1e-5, "{sun}: {pixel:?} for {want}");
        }
    }
}

/// The ground catches a shadow, has no border, and does not show through the base of the model.
#[test]
fn the_ground_catches_shadows_and_has_no_border() {
    let folder = Temporary::new("surroundings", "ground");
    let model = block(&folder);
    let with = render(&folder, &model, &["--spp", "256"]);
    let without = render(&folder, &model, &["--spp", "256", "--ground", "off"]);
    let is_grey = |pixel: &[f32; 3]| pixel[0] == pixel[1] && pixel[1] == pixel[2];
    let least = |image: &Image| {
        image.pixels.iter().filter(|pixel| is_grey(pixel)).map(|pixel| pixel[1]).fold(f32::MAX, f32::min)
    };
    // Red light of the block falls on the ground, so its shadow is not grey: green counts.
    let dark = |image: &Image| image.pixels.iter().filter(|[r, g, _]| *g < 0.42 && *r < 2.0 * g).count();
    // Pixels at the edges of the block are dark, too.
    assert!(dark(&with) > 50 + dark(&without), "{} {}", dark(&with), dark(&without));
    assert!(least(&without) > 0.45, "{}", least(&without));
    // The border of the image shows ground that fades into the panorama: no step.
    let row = &with.pixels[..48];
    let column: Vec<[f32; 3]> = with.pixels.iter().step_by(48).copied().collect();
    for pair in row.array_windows().chain(column.array_windows()) {
        let [a, b]: &[[f32; 3]; 2] = pair;
        assert!((a[1] - b[1]).abs() < 0.1, "{a:?} {b:?}");
    }
    // Seen from below, without a ground, and from above, the base is whole: no texel of the ground
    // is in front of it.
    let scene = folder.file("below.ron");
    let below = "Scene(version: 1, image: (width: 48, height: 27), materials: {}, \
        ground: (center: (0, -0.0003, 0), size: 1.5), sky: Uniform(radiance: (1, 1, 1)), \
        camera: (look_from: (0, 6, 0.1), look_at: (0, 0, 0), vertical_fov: 10), \
        objects: [Mesh(file: \"block.obj\", transform: [ScaleXyz((1, 1e-5, 1))])])";
    fs::write(&scene, below).unwrap();
    let flat = render(&folder, &scene, &["--spp", "16"]);
    assert!(flat.pixels.iter().all(|pixel| pixel[1] == 0.0), "the base is red");
    // Negative control: a ground at the height of the top hides it.
    fs::write(&scene, below.replace("-0.0003", "0.001")).unwrap();
    assert!(render(&folder, &scene, &["--spp", "1"]).pixels.iter().all(|pixel| pixel[1] > 0.2));
}

/// `check --write` writes a scene that shows the model with its studio, ground and sun.
#[test]
fn a_written_scene_has_the_surroundings() {
    let folder = Temporary::new("surroundings", "write");
    let (model, around) = (block(&folder), folder.file("around.ron"));
    let wrote = trisect(&["check", &model, "--sun", "120,35", "--write", &around]);
    assert!(wrote.status.success(), "{}", String::from_utf8_lossy(&wrote.stderr));
    let text = fs::read_to_string(&around).unwrap();
    for field in
        ["sky: Studio(scale: 0.4, rotation: 0.0)", "ground: (center: (0.0, ", "lights: [Directional("]
    {
        assert!(text.contains(field), "{text}");
    }
    let shown = render(&folder, &model, &["--spp", "4", "--sun", "120,35"]);
    assert_eq!(render(&folder, &around, &["--spp", "4"]), shown);
    // Negative control: without the sun.
    assert!(difference(&render(&folder, &model, &["--spp", "4"]), &shown) > 0.1);
    let file = panorama(&folder, "one.hdr", 1.0);
    let other = folder.file("other.ron");
    let arguments = ["check", &model, "--env", &file, "--write", &other];
    check_failure(&trisect(&arguments), &arguments, 2, &["panorama of --env", "sky: Image"]);
    let arguments = ["check", &around, "--env", "uniform", "--write", &other];
    check_failure(&trisect(&arguments), &arguments, 2, &["nor --env, --sun and --ground", "sky, lights"]);
}

/// `--env sky` is a clear sky, whose sun stands where `--sun` says, and is no light of its own.
#[test]
fn a_clear_sky_has_its_sun() {
    let folder = Temporary::new("surroundings", "sky");
    let (model, around) = (block(&folder), folder.file("around.ron"));
    let options = ["--env", "sky", "--sun", "120,35", "--spp", "4"];
    let shown = render(&folder, &model, &options);
    let wrote = trisect(&["check", &model, "--env", "sky", "--sun", "120,35", "--write", &around]);
    assert!(wrote.status.success(), "{}", String::from_utf8_lossy(&wrote.stderr));
    let text = fs::read_to_string(&around).unwrap();
    assert!(text.contains("sky: Sun(elevation: 35.0, azimuth: 120.0,") && !text.contains("lights"), "{text}");
    assert_eq!(render(&folder, &around, &["--spp", "4"]), shown);
    // A scene file gets the same sky, and its own is replaced.
    let uniform = |line: &str| match line.trim_start().starts_with("sky:") {
        true => "sky: Uniform(radiance: (9, 9, 9)),\n".to_owned(),
        false => format!("{line}\n"),
    };
    let replaced: String = text.lines().map(uniform).collect();
    assert!(replaced.contains("Uniform"));
    fs::write(&around, replaced).unwrap();
    assert_eq!(render(&folder, &around, &options), shown);
    // Negative controls: the sun elsewhere, and the sun of no place given.
    for other in [&["--env", "sky", "--sun", "300,35"][..], &["--env", "sky"]] {
        assert!(difference(&render(&folder, &model, &[other, &["--spp", "4"]].concat()), &shown) > 0.05);
    }
    // An irradiance scales the sky: one of 0 is night.
    let night = ["--env", "sky", "--sun", "120,35,0", "--spp", "1"];
    assert!(render(&folder, &model, &night).pixels.iter().all(|pixel| *pixel == [0.0; 3]));
}

/// A checkpoint has the surroundings, also after it moved with its panorama.
#[test]
fn a_resumed_render_has_its_panorama() {
    let folder = Temporary::new("surroundings", "resume");
    let model = block(&folder);
    let file = panorama(&folder, "sky.pfm", 0.5);
    let options = ["--spp", "512", "--env", &file, "--sun", "100,50"];
    let whole = render(&folder, &model, &options);
    let (checkpoint, image) = (folder.file("a.ckpt"), folder.file("part.pfm"));
    let first = ["render", &model, "-o", &image, "--checkpoint", &checkpoint, "--time-limit", "1ms"];
    let output = trisect(&[&first[..], SMALL, &options].concat());
    assert_eq!(output.status.code(), Some(7), "{}", String::from_utf8_lossy(&output.stderr));
    let output = trisect(&["resume", &checkpoint, "-q", "-o", &image]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(Image::read(image.as_ref()).unwrap(), whole);
    // Negative control: another panorama is another image, and the checkpoint is refused.
    panorama(&folder, "sky.pfm", 0.25);
    let arguments = ["resume", &checkpoint, "-q", "-o", &image];
    check_failure(&trisect(&arguments), &arguments, 1, &["scene is"]);
}

#[test]
fn bad_surroundings_are_refused() {
    let folder = Temporary::new("surroundings", "bad");
    let model = block(&folder);
    let image = folder.file("a.png");
    let refused = |options: &[&str], code: i32, words: &[&str]| {
        let arguments = [&["render", &model, "-o", &image], SMALL, options].concat();
        check_failure(&trisect(&arguments), &arguments, code, words);
    };
    refused(&["--env", "none.hdr"], 4, &["none.hdr", "No such file"]);
    refused(&["--env", &model], 4, &["block.obj: this is not a panorama; use .hdr, .exr, .pfm"]);
    refused(&["--sun", "10"], 2, &["--sun", "such as 135,40"]);
    refused(&["--sun", "10,91"], 2, &["--sun", "from 0 (the horizon) to 90"]);
    refused(&["--sun", "10,-5"], 2, &["--sun", "from 0 (the horizon) to 90"]);
    refused(&["--ground", "maybe"], 2, &["--ground"]);
    let file = panorama(&folder, "sky.exr", 1.0);
    let arguments = [&["render", &model, "--env", &file, "-o", &file], SMALL].concat();
    check_failure(&trisect(&arguments), &arguments, 2, &["a file of the scene"]);
    let scene = folder.file("a.ron");
    let text = "Scene(version: 1, image: (width: 8, height: 4), materials: {}, objects: [], \
        camera: (look_from: (0, 3, 0.1), look_at: (0, 0, 0), vertical_fov: 20))";
    fs::write(&scene, text).unwrap();
    let arguments = [&["render", &scene, "--ground", "on", "-o", &image], SMALL].concat();
    check_failure(&trisect(&arguments), &arguments, 4, &["a.ron: --ground on is for models"]);
}
