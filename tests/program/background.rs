//! Backgrounds of images: `--background` transparent, a colour, or the sky.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use exr::prelude::{ReadChannels, ReadLayers, read};
use std::collections::BTreeMap;
use std::fs;
use trisect::image::Image;
use trisect_tests::mpi;
use trisect_tests::program::{Temporary, check_failure, trisect};

/// A ball of glass and a grey one under a sky of radiance 1.
const SCENE: &str = "Scene(version: 1, image: (width: 32, height: 18, samples: 16, depth: 6), \
    camera: (look_from: (0, 0.5, 5), look_at: (0, 0, 0), vertical_fov: 30), \
    sky: Uniform(radiance: (1, 1, 1)), \
    materials: { \"grey\": Lambertian(albedo: (0.5, 0.3, 0.1)), \"glass\": Dielectric(ior: 1.5) }, \
    objects: [Sphere(center: (-0.8, 0, 0), radius: 0.7, material: \"grey\"), \
              Sphere(center: (0.8, 0, 0), radius: 0.7, material: \"glass\")])";

fn scene(folder: &Temporary) -> String {
    fs::write(folder.path("a.ron"), SCENE).unwrap();
    folder.file("a.ron")
}

fn run(arguments: &[&str]) {
    let output = trisect(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

fn render(scene: &str, image: &str, options: &[&str]) {
    run(&[&["render", scene, "-o", image, "--backend", "cpu", "-q", "--float"], options].concat());
}

/// Returns the channels of an EXR file by their names.
fn channels(path: &str) -> BTreeMap<String, Vec<f32>> {
    let file = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    let file = file.all_attributes().from_file(path).unwrap();
    let list = file.layer_data.channel_data.list;
    list.iter().map(|of| (of.name.to_string(), of.sample_data.values_as_f32().collect())).collect()
}

/// Puts a transparent image before the sky, which gives the image with the sky: colours are
/// multiplied by alpha in an EXR file, and not in a PNG file.
#[test]
fn a_transparent_image_before_the_sky_is_the_image() {
    let folder = Temporary::new("background", "transparent");
    let (scene, file) = (scene(&folder), |name: &str| folder.file(name));
    let (with_sky, clear) = (file("sky.exr"), file("clear.exr"));
    render(&scene, &with_sky, &[]);
    render(&scene, &clear, &["--background", "transparent"]);
    let (sky, clear) = (channels(&with_sky), channels(&clear));
    assert!(!sky.contains_key("A"));
    let alpha = &clear["A"];
    for name in ["R", "G", "B"] {
        for (pixel, alpha) in alpha.iter().enumerate() {
            let over = clear[name][pixel] + (1.0 - alpha);
            assert!((over - sky[name][pixel]).abs() < 1e-5, "{name} {pixel}: {over} {}", sky[name][pixel]);
        }
    }
    let count = |holds: fn(f32) -> bool| alpha.iter().filter(|alpha| holds(**alpha)).count();
    let [none, some, all] = [count(|a| a == 0.0), count(|a| a > 0.0 && a < 1.0), count(|a| a == 1.0)];
    assert!(none > 100 && some > 10 && all > 50, "{none} {some} {all}");
    // Glass shows the sky: only camera rays do not see it. So it has light without alpha's help.
    let glass = 9 * 32 + 20;
    assert!(alpha[glass] == 1.0 && clear["G"][glass] > 0.9, "{}", clear["G"][glass]);
    // Layers stand beside alpha.
    let layered = file("layers.exr");
    render(&scene, &layered, &["--background", "transparent", "--aov", "depth"]);
    let layered = channels(&layered);
    assert!(layered["A"] == *alpha && layered["R"] == clear["R"] && layered.contains_key("Z"));

    let png = file("clear.png");
    render(&scene, &png, &["--background", "transparent"]);
    let image = image::open(&png).unwrap().into_rgba8();
    let mut edges = 0;
    for (pixel, alpha) in image.pixels().zip(alpha) {
        let [red, green, blue, a] = pixel.0;
        assert_eq!(a, (255.0 * alpha).round() as u8);
        if a == 0 {
            assert_eq!([red, green, blue], [0; 3]);
        }
    }
    // An edge of the grey ball keeps its colour: red is brighter than blue by the albedo's ratio.
    for (x, y, pixel) in image.enumerate_pixels() {
        if x < 14 && pixel.0[3] > 20 && pixel.0[3] < 235 {
            edges += 1;
            assert!(pixel.0[0] > 150 && pixel.0[2] < pixel.0[0] - 40, "{x} {y} {pixel:?}");
        }
    }
    assert!(edges > 4, "{edges}");
}

#[test]
fn a_colour_shows_where_camera_rays_meet_the_sky() {
    let folder = Temporary::new("background", "colour");
    let (scene, path) = (scene(&folder), folder.file("a.pfm"));
    let read = |options: &[&str]| {
        render(&scene, &path, options);
        Image::read(path.as_ref()).unwrap()
    };
    let sky = read(&[]);
    assert_eq!(read(&["--background", "sky"]), sky);
    // The colour of the sky itself gives the image with the sky.
    let white = read(&["--background", "1,1,1"]);
    let pairs = white.pixels.iter().flatten().zip(sky.pixels.iter().flatten());
    assert!(pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) < 1e-5);
    let red = read(&["--background", "#ff0000"]);
    assert_eq!(red.pixels[0], [1.0, 0.0, 0.0]);
    // The light stays: the middle of the grey ball is as it was.
    let grey = 9 * 32 + 11;
    assert!(red.pixels[grey] == sky.pixels[grey] && red.pixels[grey][1] > 0.1);
    // A colour has no exposure, and the light has.
    let darker = read(&["--background", "0.25,0.5,0.75", "--exposure", "-1"]);
    assert_eq!(darker.pixels[0], [0.25, 0.5, 0.75]);
    assert_eq!(darker.pixels[grey], sky.pixels[grey].map(|channel| 0.5 * channel));
}

/// A resumed render, ranks and a filter have the background, too.
#[test]
fn backgrounds_of_resumed_and_shared_renders() {
    let folder = Temporary::new("background", "resume");
    let (scene, file) = (scene(&folder), |name: &str| folder.file(name));
    let options = ["--spp", "512", "--background", "transparent"];
    let (whole, other, checkpoint) = (file("whole.png"), file("other.png"), file("a.ckpt"));
    render(&scene, &whole, &options);
    let first = ["render", &scene, "-o", &other, "--backend", "cpu", "-q", "--checkpoint", &checkpoint];
    let output = trisect(&[&first[..], &options, &["--time-limit", "1ms"]].concat());
    assert_eq!(output.status.code(), Some(7), "{}", String::from_utf8_lossy(&output.stderr));
    run(&["resume", &checkpoint, "-q", "-o", &other]);
    let bytes = fs::read(&whole).unwrap();
    assert!(fs::read(&other).unwrap() == bytes);
    if mpi::available() {
        let ranks = ["render", &scene, "-o", &other, "--backend", "cpu", "-q", "--threads", "1"];
        let output = mpi::run(2, &[&ranks[..], &options, &["--distribute", "rows"]].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(fs::read(&other).unwrap() == bytes);
    }
    // Negative control: without the option the file has no alpha.
    render(&scene, &other, &["--spp", "512"]);
    assert!(!image::open(&other).unwrap().color().has_alpha());
    render(&scene, &other, &["--background", "transparent", "--denoise", "svgf"]);
    assert!(image::open(&other).unwrap().color().has_alpha());
}

/// Merged parts have the background of one render.
#[test]
fn backgrounds_of_merged_renders() {
    let folder = Temporary::new("background", "merge");
    let (scene, file) = (scene(&folder), |name: &str| folder.file(name));
    for (background, image) in [("transparent", "png"), ("transparent", "exr"), ("#336699", "png")] {
        let options = ["--spp", "512", "--background", background, "--exposure", "-1"];
        let (whole, merged) = (file(&format!("whole.{image}")), file(&format!("merged.{image}")));
        render(&scene, &whole, &options);
        let parts = ["0..256", "256..512"].map(|samples| {
            let checkpoint = file(&format!("{}.{image}.ckpt", &samples[..1]));
            let _ = fs::remove_file(&checkpoint);
            let part = ["--sample-range", samples, "--checkpoint", &checkpoint];
            render(&scene, &file(&format!("part.{image}")), &[&options[..], &part].concat());
            checkpoint
        });
        let arguments = ["merge", &parts[0], &parts[1], "-o", &merged];
        let output = trisect(&arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && !said.contains("warning"), "{said}");
        assert!(fs::read(&merged).unwrap() == fs::read(&whole).unwrap(), "{background} in {image}");
        if background == "transparent" {
            let other = file("merged.hdr");
            let arguments = ["merge", &parts[0], &parts[1], "-o", &other];
            check_failure(&trisect(&arguments), &arguments, 2, &["merged.hdr", ".png, .tif or .exr"]);
        }
        // Negative control: one part alone is another image.
        run(&["merge", &parts[0], "-o", &merged]);
        assert!(fs::read(&merged).unwrap() != fs::read(&whole).unwrap());
    }
}

#[test]
fn bad_backgrounds_are_refused() {
    let folder = Temporary::new("background", "bad");
    let scene = scene(&folder);
    for name in ["a.hdr", "a.pfm"] {
        let image = folder.file(name);
        let arguments = ["render", &scene, "-o", &image, "--background", "transparent"];
        check_failure(
            &trisect(&arguments),
            &arguments,
            2,
            &[name, "--background transparent", ".png, .tif or .exr"],
        );
    }
    let image = folder.file("a.png");
    for bad in ["blue", "1,2", "#12"] {
        let arguments = ["render", &scene, "-o", &image, "--background", bad];
        check_failure(&trisect(&arguments), &arguments, 2, &["--background", "#rrggbb"]);
    }
}
