//! Numbered images of models that move, and motion blur, as users run them.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::fs;
use std::path::Path;
use std::time::SystemTime;
use trisect::image::Image;
use trisect_tests::models::{bending_tube, departing_lamp, sliding_square};
use trisect_tests::program::{Temporary, fails, trisect, wait_for};
use trisect_tests::running::{Running, program};

/// Options of small images; the device is the CPU.
const SMALL: &[&str] = &["--backend", "cpu", "--resolution", "24x32", "--depth", "3", "--spp", "4"];

/// Returns a folder with a bending tube, and a square that slides.
fn models(test: &str) -> Temporary {
    let folder = Temporary::new("motion", test);
    fs::write(folder.path("tube.gltf"), bending_tube(12, 8)).unwrap();
    fs::write(folder.path("square.gltf"), sliding_square([1.0, -0.5, 0.0])).unwrap();
    folder
}

/// Renders, and returns standard error.
fn render(scene: &str, image: &str, more: &[&str]) -> String {
    let arguments = [&["render", scene, "-o", image], SMALL, more].concat();
    let output = trisect(&arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {said}");
    said
}

/// Returns the names of the files of a folder that begin with `start`, sorted.
fn files(folder: &Temporary, start: &str) -> Vec<String> {
    let entries = fs::read_dir(folder.path("")).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.filter(|name| name.starts_with(start)).collect();
    names.sort();
    names
}

/// A path moves the camera of a scene that moves, and of one that does not.
#[test]
fn a_path_moves_the_camera() {
    let folder = models("path");
    let key = |frame: u32, x: f64| {
        format!("(frame: {frame}, camera: (look_from: ({x}, 0, 6), look_at: (0, 0, 0), vertical_fov: 40))")
    };
    let path = folder.file("path.ron");
    fs::write(&path, format!("CameraPath(version: 1, keys: [{}, {}])", key(0, -2.0), key(2, 2.0))).unwrap();
    let scene = folder.file("still.ron");
    let still = "Scene(version: 1, image: (width: 24, height: 32), sky: Uniform(radiance: (1, 1, 1)), camera: (look_from: (0, 0, 6), look_at: (0, 0, 0), vertical_fov: 40), \
        materials: { \"a\": Lambertian(albedo: (0.5, 0.5, 0.5)) }, \
        objects: [Box(min: (-1, -1, -1), max: (1, 1, 1), material: \"a\")])";
    fs::write(&scene, still).unwrap();
    for (scene, time) in [(scene, None), (folder.file("tube.gltf"), Some("0.25"))] {
        let said = render(&scene, &folder.file("p.exr"), &["--camera-path", &path, "--fps", "4"]);
        assert!(said.contains("frames 0 to 2"), "{said}");
        assert_eq!(files(&folder, "p.0"), ["p.0000.exr", "p.0001.exr", "p.0002.exr"]);
        // Frame 1 is the image from the middle of the path, at its time.
        let alone = folder.file("alone.exr");
        let from = ["--look-from", "0,0,6", "--look-at", "0,0,0", "--fov", "40"];
        let at = time.map_or_else(Vec::new, |time| vec!["--time", time]);
        render(&scene, &alone, &[&from[..], &at].concat());
        let image = |path: &str| Image::read(Path::new(path)).unwrap();
        assert_eq!(image(&folder.file("p.0001.exr")), image(&alone));
        // Negative control: the others are from elsewhere.
        assert_ne!(image(&folder.file("p.0000.exr")), image(&alone));
        // Blur of the camera's motion: the image is no longer the sharp one.
        let blurred = ["--camera-path", &path, "--fps", "4", "--shutter", "1", "--frames", "1..2"];
        render(&scene, &folder.file("b.exr"), &blurred);
        assert_ne!(image(&folder.file("b.0001.exr")), image(&alone));
    }
    let missing = ["render", &folder.file("still.ron"), "--camera-path", "missing.ron"];
    fails(&missing, 4, &["missing.ron"]);
    let still = folder.file("still.ron");
    for (options, code, wanted) in [
        (&["--fov", "10"][..], 2, "--camera-path cannot be combined with options of the camera"),
        (&["--checkpoint", "a.ckpt"], 2, "--checkpoint cannot be combined with --camera-path"),
    ] {
        fails(&[&["render", &still, "--camera-path", &path], options].concat(), code, &[wanted]);
    }
}

#[test]
fn each_frame_is_the_image_at_its_time() {
    let folder = models("frames");
    let tube = folder.file("tube.gltf");
    let said = render(&tube, &folder.file("out.exr"), &["--frames", "1..4", "--fps", "4", "--time", "125ms"]);
    for words in ["frames 1 to 3 at 4 frames/s", "frame 1 (1 of 3), at 0.375 s: wrote", "frame 3 (3 of 3)"] {
        assert!(said.contains(words), "no {words:?} in: {said}");
    }
    assert_eq!(files(&folder, "out"), ["out.0001.exr", "out.0002.exr", "out.0003.exr"]);
    for (frame, time) in [(1, "0.375"), (2, "0.625"), (3, "0.875")] {
        let alone = folder.file(&format!("alone{frame}.exr"));
        render(&tube, &alone, &["--time", time]);
        let frame = fs::read(folder.path(&format!("out.000{frame}.exr"))).unwrap();
        assert!(frame == fs::read(alone).unwrap(), "the image at {time} s differs");
    }
    // Negative control: the frames differ.
    let [a, b] = ["out.0001.exr", "out.0002.exr"].map(|name| fs::read(folder.path(name)).unwrap());
    assert!(a != b);
}

#[test]
fn formats_layers_statistics_and_filters_are_those_of_an_image() {
    let folder = models("formats");
    let tube = folder.file("tube.gltf");
    let (image, stats) = (folder.file("a_%02d.exr"), folder.file("a.json"));
    let more = ["--frames", "0..2", "--denoise", "svgf", "--aov", "normal,id", "--stats", &stats, "--quiet"];
    let said = render(&tube, &image, &more);
    assert!(said.lines().all(|line| line.starts_with("warning: no light")), "{said}");
    assert_eq!(files(&folder, "a"), ["a.0000.json", "a.0001.json", "a_00.exr", "a_01.exr"]);
    let text = fs::read_to_string(folder.path("a.0001.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!((json["samples"].as_u64(), json["unwritten_pixels"].as_u64()), (Some(24 * 32 * 4), Some(0)));
    assert!(json["denoise"].is_object());
    // Frames replace images of an earlier run, and a goal may stand for the samples.
    let before = fs::read(folder.path("a_01.exr")).unwrap();
    let goal = ["render", &tube, "-o", &image, "--backend", "cpu", "--resolution", "24x32", "--quiet"];
    let output = trisect(&[&goal[..], &["--frames", "1..2", "--target-error", "50%"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(before != fs::read(folder.path("a_01.exr")).unwrap());
}

/// The CPU renders the frames where CUDA is missing; where it is there, its bits are the same.
#[test]
fn frames_fall_back_to_the_cpu() {
    let folder = models("fallback");
    let (tube, image) = (folder.file("tube.gltf"), folder.file("out.exr"));
    let frames = ["--frames", "0..2", "--fps", "2", "--shutter", "0.5"];
    render(&tube, &folder.file("cpu.exr"), &frames);
    let other = ["render", &tube, "-o", &image, "--backend", "cuda", "--fallback", "cpu"];
    let output = trisect(&[&other[..], &SMALL[2..], &frames].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for frame in ["0000", "0001"] {
        let [a, b] =
            ["out", "cpu"].map(|name| fs::read(folder.path(&format!("{name}.{frame}.exr"))).unwrap());
        assert!(a == b, "frame {frame} differs");
    }
}

/// A model without a camera and without light gets those of frame 0, and one exposure.
#[test]
fn what_a_model_lacks_is_the_same_in_all_frames() {
    let folder = models("lacks");
    let tube = folder.file("no_camera.gltf");
    fs::write(&tube, bending_tube(12, 8).replace("\"camera\":0,", "")).unwrap();
    let said = render(&tube, &folder.file("all.png"), &["--frames", "0..3", "--fps", "2"]);
    assert_eq!(said.matches("no camera").count(), 1, "{said}");
    assert_eq!(said.matches(" EV ").count(), 1, "{said}");
    render(&tube, &folder.file("all.exr"), &["--frames", "0..3", "--fps", "2"]);
    render(&tube, &folder.file("part.exr"), &["--frames", "2..3", "--fps", "2"]);
    let [whole, part] = ["all.0002.exr", "part.0002.exr"].map(|name| fs::read(folder.path(name)).unwrap());
    assert!(whole == part);
    // Negative control: the image at that time alone has a camera of its own.
    render(&tube, &folder.file("alone.exr"), &["--time", "1s"]);
    assert!(part != fs::read(folder.path("alone.exr")).unwrap());
}

/// Frames that several commands render have one exposure, that of frame 0, as after an interrupt.
#[test]
fn the_automatic_exposure_is_that_of_frame_0() {
    let folder = models("exposure");
    let lamp = folder.file("lamp.gltf");
    fs::write(&lamp, departing_lamp()).unwrap();
    let read = |name: &str| fs::read(folder.path(name)).unwrap();
    let said = render(&lamp, &folder.file("all.png"), &["--frames", "0..3", "--fps", "2"]);
    assert!(said.contains("for all frames: that of frame 0"), "{said}");
    let part = render(&lamp, &folder.file("part.png"), &["--frames", "2..3", "--fps", "2"]);
    assert_eq!(files(&folder, "part"), ["part.0002.png"], "frame 0 is not written");
    assert!(read("all.0002.png") == read("part.0002.png"), "{part}");
    assert_eq!(exposure(&said), exposure(&part));
    // The printed number does the same, and frame 0 is not rendered for it.
    let stops = exposure(&said);
    let more = ["--frames", "2..3", "--fps", "2", "--exposure", &stops];
    let given = render(&lamp, &folder.file("given.png"), &more);
    assert!(read("all.0002.png") == read("given.0002.png"), "{given}");
    assert!(!given.contains("frame 0"), "{given}");
    // Negative control: the image at that time alone has another exposure.
    let alone = render(&lamp, &folder.file("alone.png"), &["--time", "1s"]);
    assert_ne!(exposure(&alone), stops);
    assert!(read("all.0002.png") != read("alone.png"));
}

/// Returns the exposure in stops that the program printed.
fn exposure(said: &str) -> String {
    let line = said.lines().find(|line| line.starts_with("exposure ")).unwrap();
    line.split(' ').nth(1).unwrap().to_owned()
}

#[test]
fn a_shutter_blurs_and_one_of_zero_does_not() {
    let folder = models("shutter");
    let scene = folder.file("square.ron");
    let camera = "camera: (look_from: (0.5, 0, 4), look_at: (0.5, 0, 0), vertical_fov: 60)";
    let image = "image: (width: 8, height: 8, samples: 1)";
    let objects = "objects: [Mesh(file: \"square.gltf\")]";
    let text = format!("Scene(version: 1, {image}, {camera}, materials: {{}}, {objects})");
    fs::write(&scene, text).unwrap();
    let write = |name: &str, more: &[&str]| {
        let file = folder.file(name);
        let few = &SMALL[..SMALL.len() - 2];
        let output = trisect(&[&["render", &scene, "-o", &file, "--spp", "64", "-q"], few, more].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    let image = |name: &str, more: &[&str]| {
        write(name, more);
        Image::read(&folder.path(name)).unwrap()
    };
    let part = |image: &Image| {
        let grey = image.pixels.iter().filter(|[red, ..]| *red > 0.05 && *red < 0.95).count();
        grey as f64 / image.pixels.len() as f64
    };
    let still = image("still.exr", &["--time", "0"]);
    let sharp = image("sharp.exr", &["--shutter", "0", "--fps", "1"]);
    assert_eq!(still.pixels, sharp.pixels);
    let blurred = image("blurred.exr", &["--shutter", "1", "--fps", "1", "--shutter-steps", "64"]);
    assert!(part(&blurred) > 0.15 && part(&sharp) < 0.05, "{} {}", part(&blurred), part(&sharp));
    // Half a second of the shutter is one second at half the rate; and it is that of a frame.
    let half = image("half.exr", &["--shutter", "0.5", "--fps", "1"]);
    assert_eq!(half.pixels, image("rate.exr", &["--shutter", "1", "--fps", "2"]).pixels);
    write("frame.exr", &["--shutter", "0.5", "--fps", "1", "--frames", "0..1"]);
    assert_eq!(half.pixels, Image::read(&folder.path("frame.0000.exr")).unwrap().pixels);
    assert_ne!(half.pixels, blurred.pixels);
}

#[test]
fn what_does_not_move_and_what_cannot_be_is_refused() {
    let folder = models("refused");
    let (tube, image) = (folder.file("tube.gltf"), folder.file("out.png"));
    let refused = |scene: &str, more: &[&str], code: i32, words: &[&str]| {
        let scene: &[&str] = if scene.is_empty() { &[] } else { &[scene] };
        fails(&[&["render", "-o", &image], scene, SMALL, more].concat(), code, words);
    };
    let frames = ["--frames", "0..2"];
    refused("", &frames, 2, &["--frames is for scenes in files", "name a scene or a model"]);
    let still = sliding_square([1.0, 0.0, 0.0]).replace("animations", "extras");
    fs::write(folder.path("still.gltf"), still).unwrap();
    let still = folder.file("still.gltf");
    refused(&still, &frames, 4, &["still.gltf: the model has no animation", "render one image"]);
    refused(&still, &["--shutter", "0.5"], 4, &["the model has no animation"]);
    let beside: [(&[&str], &[&str]); 6] = [
        (&["--frames", "0..2", "--checkpoint", "a.ckpt"], &["--checkpoint cannot", "--frames K..END"]),
        (&["--shutter", "1", "--checkpoint", "a.ckpt"], &["--checkpoint cannot be combined with --shutter"]),
        (&["--frames", "0..2", "--distribute", "rows"], &["--distribute cannot", "--frames 60..120"]),
        (&["--shutter", "1", "--shutter-steps", "5"], &["`shutter_steps` is 5", "has 4 samples"]),
        (&["--shutter", "1", "--aov", "id", "-o", "a.exr"], &["--aov id cannot", "without --shutter"]),
        (&["--frames", "0..2", "--stats", &image], &["--stats are the same file"]),
    ];
    for (more, words) in beside {
        let arguments = [&["render", &tube], SMALL, more].concat();
        let output = match more.contains(&"-o") {
            true => arguments,
            false => [&arguments[..], &["-o", &image]].concat(),
        };
        fails(&output, 2, words);
    }
    let goal = ["render", &tube, "-o", &image, "--backend", "cpu", "--shutter", "1", "--budget", "1s"];
    fails(&goal, 2, &["--budget cannot be combined with --shutter", "name --spp"]);
    for (name, words) in [("%d%d.png", "twice"), ("%4d.png", "spaces")] {
        let name = folder.file(name);
        fails(&[&["render", &tube, "-o", &name], SMALL, &frames].concat(), 2, &[words, "as %04d"]);
    }
    for wrong in [&["--frames", "4"][..], &["--frames", "4..4"], &["--fps", "0"], &["--shutter", "2"]] {
        refused(&tube, wrong, 2, &["invalid value"]);
    }
    // An input under the name of a frame is not overwritten.
    let scene = folder.file("scene.0001.png");
    fs::write(&scene, "x").unwrap();
    let text = "Scene(version: 1, image: (width: 8, height: 8, samples: 1),
            camera: (look_from: (0, 0, 4), look_at: (0, 0, 0), vertical_fov: 60),
            textures: {\"t\": Texture(file: \"scene.0001.png\")},
            materials: {\"m\": Lambertian(albedo: (1, 1, 1), texture: \"t\")},
            objects: [Mesh(file: \"tube.gltf\", material: \"m\")])";
    fs::write(folder.path("scene.ron"), text).unwrap();
    let red = Image { width: 1, height: 1, pixels: vec![[1.0, 0.0, 0.0]] };
    trisect::output::write(&red, Path::new(&scene)).unwrap();
    let (scene, output) = (folder.file("scene.ron"), folder.file("scene.png"));
    let over = [&["render", &scene, "-o", &output], SMALL, &frames].concat();
    fails(&over, 2, &["-o would overwrite a file of the scene"]);
    assert_eq!(files(&folder, "out"), [""; 0], "nothing is written");
    let said = render(&tube, &image, &["--fps", "30"]);
    assert!(said.contains("--fps has no effect without --frames or --shutter"), "{said}");
}

#[test]
fn an_interrupt_keeps_the_frames_that_are_complete() {
    let folder = models("interrupt");
    let (tube, image) = (folder.file("tube.gltf"), folder.file("out.png"));
    let many = ["--frames", "0..5000", "--backend", "cpu", "--resolution", "64x64", "--spp", "64"];
    // Only the frames that are rendered are there: the check of 5,000 names leaves no file.
    let before = SystemTime::now();
    let mut command = program(&[&["render", &tube, "-o", &image], &many[..]].concat());
    let running = Running::start(&mut command);
    wait_for(&folder.file("out.0001.png"), before);
    running.signal("TERM");
    let output = running.end();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(130), "{said}");
    let complete = files(&folder, "out");
    let next = complete.len();
    assert!((2..1000).contains(&next), "{next}");
    // The remaining images would have the same exposure without it, which frame 0 gives.
    let same = format!("continue with --frames {next}..5000 --exposure {}", exposure(&said));
    for words in [same, format!("0 to {} are complete", next - 1)] {
        assert!(said.contains(&words), "no {words:?} in: {said}");
    }
    for name in complete {
        assert!(Image::read(&folder.path(&name)).is_ok(), "{name}");
    }
    let limited = [&["render", &tube, "-o", &image, "--time-limit", "0.001ms"], &many[..]].concat();
    fails(&limited, 7, &["no frame is complete; continue with --frames 0..5000"]);
}
