//! Bad input gets an error that names the file, the place and the remedy, and an exit code. Nothing
//! is written, and nothing panics.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::path::{Path, PathBuf};
use trisect::image::Image;
use trisect_tests::program::{self, check_failure, fails, trisect};
use trisect_tests::root;

fn folder(name: &str) -> PathBuf {
    program::folder("bad-input", name)
}

const GOOD: &str = r#"Scene(
    version: 1,
    image: (width: 8, height: 4, samples: 1),
    camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 40),
    sky: Gradient(bottom: (1, 1, 1), top: (0.5, 0.7, 1)),
    materials: { "a": Lambertian(albedo: (0.5, 0.5, 0.5)), "g": Dielectric(ior: 1.5) },
    objects: [
        Sphere(center: (0, 0, 0), radius: 1, material: "a"),
        Sphere(center: (1, 0, 0), radius: 1, material: "g"),
    ],
)
"#;

#[test]
fn the_scene_that_the_faults_are_planted_in_is_good() {
    let folder = folder("good");
    let (scene, image) = (folder.join("scene.ron"), folder.join("a.png"));
    std::fs::write(&scene, GOOD).unwrap();
    let output = trisect(&[
        "render",
        scene.to_str().unwrap(),
        "--backend",
        "cpu",
        "--quiet",
        "-o",
        image.to_str().unwrap(),
    ]);
    assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
    assert!(image.exists());
}

#[test]
fn faults_in_a_scene_are_placed() {
    // A text, its replacement, and what the message must contain: line and column, then the reason.
    let cases: &[(&str, &str, &[&str])] = &[
        ("Scene(", "%", &["scene.ron:1:", "docs/reference/scene-format/README.md"]),
        ("version: 1", "version: 2", &["scene.ron:2:", "version 2", "reads 1"]),
        ("samples: 1", "sample: 1", &["scene.ron:3:", "sample", "samples"]),
        ("height: 4,", "height: 0,", &["scene.ron:3:", "0 is not a count"]),
        ("vertical_fov: 40", "vertical_fov: 180", &["scene.ron:4:", "179"]),
        ("radius: 1, material: \"a\"", "radius: 0, material: \"a\"", &["scene.ron:8:", "0 is not", "length"]),
        ("radius: 1, material: \"a\"", "radius: -1, material: \"a\"", &["scene.ron:8:", "-1 is not"]),
        ("radius: 1, material: \"a\"", "radius: NaN, material: \"a\"", &["scene.ron:8:", "NaN is not"]),
        ("radius: 1, material: \"a\"", "radius: inf, material: \"a\"", &["scene.ron:8:", "inf is not"]),
        ("radius: 1, material: \"g\"", "radius: 1e30, material: \"g\"", &["scene.ron:9:", "1e18"]),
        ("center: (1, 0, 0)", "center: (1, NaN, 0)", &["scene.ron:9:", "NaN is not", "coordinate"]),
        ("ior: 1.5", "ior: 0", &["scene.ron:6:", "index of refraction"]),
        ("ior: 1.5", "ior: -1.5", &["scene.ron:6:", "-1.5 is not"]),
        (
            "albedo: (0.5, 0.5, 0.5)",
            "albedo: (1.5, 0.5, 0.5)",
            &["scene.ron:6:", "1.5 is not between 0 and 1"],
        ),
        ("Lambertian(", "Velvet(", &["scene.ron:6:", "Velvet"]),
        ("material: \"g\"", "material: \"glass\"", &["scene.ron:9:", "unknown material \"glass\"", "a, g"]),
        ("\"g\": Dielectric", "\"a\": Dielectric", &["scene.ron:6:", "is defined twice"]),
        ("radius: 1, material: \"a\"", "radius: 1, materal: \"a\"", &["scene.ron:8:", "materal"]),
        ("look_from: (0, 0, 3)", "look_from: (0, 0, 0)", &["look_from and look_at"]),
        ("look_from: (0, 0, 3)", "look_from: (0, 3, 0)", &["up points along the view"]),
        (
            "vertical_fov: 40",
            "vertical_fov: 170, defocus_angle: 1, focus_distance: 1e15",
            &["focus_distance", "1e15"],
        ),
    ];
    let folder = folder("scene");
    let (path, image) = (folder.join("scene.ron"), folder.join("a.png"));
    for (from, to, words) in cases {
        assert!(GOOD.contains(from), "{from}");
        std::fs::write(&path, GOOD.replacen(from, to, 1)).unwrap();
        fails(&["render", path.to_str().unwrap(), "-o", image.to_str().unwrap()], 4, words);
        assert!(!image.exists());
    }
    std::fs::write(&path, [0xff, 0xfe, 0x00]).unwrap();
    fails(&["render", path.to_str().unwrap(), "-o", image.to_str().unwrap()], 4, &["scene.ron", "UTF-8"]);
    std::fs::write(&path, "").unwrap();
    fails(&["render", path.to_str().unwrap(), "-o", image.to_str().unwrap()], 4, &["scene.ron:1:1"]);
    fails(&["render", "no-such.ron", "-o", image.to_str().unwrap()], 4, &["no-such.ron", "No such file"]);
}

#[test]
fn settings_out_of_range() {
    let out = folder("settings").join("a.png");
    let out = out.to_str().unwrap();
    fails(&["render", "--threads", "100000", "-o", out], 2, &["--threads"]);
    fails(&["render", "--depth", "65536", "-o", out], 2, &["at most 65535"]);
    for option in ["--width", "--height", "--spp", "--depth", "--threads"] {
        for value in ["0", "-1", "4294967296", "many"] {
            fails(&["render", &format!("{option}={value}"), "-o", out], 2, &[option]);
        }
    }
    fails(&["render", "--resolution", "1280", "-o", out], 2, &["WIDTHxHEIGHT"]);
    fails(&["render", "--resolution", "9x9", "--width", "9", "-o", out], 2, &["--width"]);
    fails(&["render", "--resolution", "4294967295x2", "-o", out], 2, &["2^32", "--resolution"]);
    fails(&["render", "--resolution", "65535x65535", "-o", out], 2, &["GiB of memory", "--resolution"]);
    fails(&["render", "--backend", "abacus", "-o", out], 2, &["abacus"]);
    fails(&["render", "--denoise", "blur", "-o", out], 2, &["blur", "atrous", "svgf"]);
    fails(&["render", "--denoise-color", "2", "-o", out], 2, &["--denoise-color", "without a filter"]);
    for levels in ["0", "11"] {
        let options = ["render", "--denoise=svgf", "--denoise-levels", levels, "-o", out];
        fails(&options, 2, &["--denoise-levels", "from 1 to 10"]);
    }
    for bad in ["-1", "NaN"] {
        let depth = format!("--denoise-depth={bad}");
        fails(&["render", "--denoise=atrous", &depth, "-o", out], 2, &["depth", bad, "0 or more"]);
    }
    fails(&["render", "--aov=normal", "-o", out], 2, &["--aov", ".exr"]);
    fails(&["render", "--aov=normal,beauty", "-o", out], 2, &["beauty", "albedo"]);
    let kernel = |features| {
        ["render", "--sampler=independent", "--denoise=svgf", features, "--backend=cpu", "-o", out]
    };
    fails(&kernel("--features=spheres,aovs"), 2, &["--features lacks", "lambertian,metal,dielectric"]);
    fails(&kernel("--features=+sobol"), 2, &["--features", "differ in sobol"]);
    fails(&kernel("--features=sphere"), 2, &["unknown feature sphere", "known: ", "spheres"]);
    let long = ["bench", "--denoise=svgf", "--spp=257", "--backend=cpu", "--resolution=4x3", "--frames=1"];
    fails(&long, 2, &["at most 256 samples", "--spp"]);
    fails(&["render", "--backend", "cpu", "--math", "fast", "-o", out], 2, &["--math fast", "cuda"]);
    assert!(!Path::new(out).exists());
}

#[test]
fn outputs_are_checked_before_rendering() {
    let folder = folder("output");
    // With so many samples the test would not end if the render started.
    let render = ["render", "--backend", "cpu", "--spp", "4000000000", "-o"];
    let at = |path: &str, code, words: &[&str]| fails(&[&render[..], &[path]].concat(), code, words);
    at("picture.gif", 2, &["picture.gif", ".png, .jpg, .tif, .exr, .hdr or .pfm"]);
    at("picture", 2, &["picture", ".png"]);
    let missing = folder.join("no/such/folder/a.png");
    at(missing.to_str().unwrap(), 1, &["a.png", "no/such/folder does not exist"]);
    at("/dev/null/a.png", 1, &["a.png"]);
    let stats = folder.join("none/stats.json");
    let image = folder.join("a.png");
    let arguments = [&render[..], &[image.to_str().unwrap(), "--stats", stats.to_str().unwrap()]].concat();
    fails(&arguments, 1, &["stats.json"]);
    assert!(!image.exists(), "the check left a file behind");
    let same = image.to_str().unwrap();
    let dotted = format!("{}/./a.png", folder.to_str().unwrap());
    for stats in [same, &dotted] {
        fails(&[&render[..], &[same, "--stats", stats]].concat(), 2, &["--stats", "same file"]);
    }
    let layers = folder.join("a.exr");
    let twice = [&render[..], &[layers.to_str().unwrap(), "--aov=normal,depth,normal"]].concat();
    fails(&twice, 2, &["normal twice", "once"]);
    assert!(!image.exists() && !layers.exists());
}

/// No command overwrites a file that it reads.
#[test]
fn inputs_are_kept() {
    let folder = folder("inputs");
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let gradient = "sky: Gradient(bottom: (1, 1, 1), top: (0.5, 0.7, 1))";
    let text = GOOD.replacen(gradient, "sky: Image(file: \"sky.exr\")", 1);
    assert_ne!(text, GOOD);
    let sky = Image { width: 4, height: 2, pixels: vec![[1.0; 3]; 8] };
    trisect::output::write(&sky, path("sky.exr").as_ref()).unwrap();
    let scene = path("scene.ron");
    std::fs::write(&scene, &text).unwrap();
    let before = std::fs::read(path("sky.exr")).unwrap();
    let (image, far) = (path("a.png"), "--spp=4000000000");
    let render = ["render", &scene, "--backend=cpu", far];
    let of_scene = ["would overwrite", "name another file"];
    fails(&[&render[..], &["-o", &image, "--stats", &scene]].concat(), 2, &of_scene);
    fails(&[&render[..], &["-o", &path("sky.exr")]].concat(), 2, &of_scene);
    fails(&[&render[..], &["-o", &image, "--checkpoint", &scene]].concat(), 2, &["scene.ron"]);
    fails(&["bench", &scene, "--backend=cpu", far, &format!("--json={scene}")], 2, &of_scene);
    fails(&["converge", &scene, "--backend=cpu", "-o", &path("sky.exr")], 2, &of_scene);
    let view = ["view", &scene, "--headless", "--backend=cpu", "-o", &path("")];
    fails(&[&view[..], &["--json", &path("0003.png")]].concat(), 2, &["-o and --json are the same file"]);
    let poses = path("0001.png");
    fails(&[&view[..], &["--camera-path", &poses]].concat(), 2, &["the camera path", "name another file"]);
    assert_eq!(std::fs::read(&scene).unwrap(), text.as_bytes());
    assert_eq!(std::fs::read(path("sky.exr")).unwrap(), before);
    assert!(!Path::new(&image).exists());
}

/// A named pipe, which may never get a reader, is refused before rendering. Devices and open files
/// are written to.
#[cfg(unix)]
#[test]
fn outputs_are_files_or_devices() {
    let folder = folder("outputs");
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let (pipe, image) = (path("pipe.png"), path("a.png"));
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    // More samples than anyone would wait for.
    let long = ["render", "--backend", "cpu", "--resolution", "16x9", "--spp", "100000000"];
    let words = ["pipe.png", "this is a pipe", "regular files", "/dev/null", "/dev/stdout"];
    fails(&[&long[..], &["-o", &pipe]].concat(), 1, &words);
    fails(&[&long[..], &["-o", &image, "--stats", &pipe]].concat(), 1, &words);
    fails(
        &[&long[..], &["-o", &image, "--checkpoint", &pipe]].concat(),
        1,
        &["pipe.png", "not a regular file"],
    );
    let short = ["render", "--backend", "cpu", "--resolution", "16x9", "--spp", "1", "-o", &image];
    for stats in ["/dev/null", "/dev/stdout"] {
        let output = trisect(&[&short[..], &["--stats", stats]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(output.stdout.starts_with(b"{"), stats == "/dev/stdout");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

/// Devices, which have no end, and pipes, which may have no writer, are refused wherever a file is
/// read.
#[cfg(unix)]
#[test]
fn only_regular_files_are_read() {
    let folder = folder("regular");
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let out = path("out.png");
    let made = std::process::Command::new("mkfifo").arg(path("fifo")).status().unwrap();
    assert!(made.success());
    let link = |from: &str, name: &str| std::os::unix::fs::symlink(from, path(name)).unwrap();
    for name in ["fifo.ron", "fifo.glb", "fifo.png", "fifo.exr", "fifo.pfm"] {
        link(&path("fifo"), name);
    }
    link("/dev/zero", "zero.obj");
    link("/dev/zero", "zero.png");
    let words = ["only regular files are read", "write its content to a file first"];
    for scene in
        ["/dev/stdin", "/dev/zero", "/dev/full", &path("fifo.ron"), &path("fifo.glb"), &path("zero.obj")]
    {
        fails(&["render", scene, "-o", &out], 4, &[&words[..], &[scene]].concat());
    }
    fails(&["render", folder.to_str().unwrap(), "-o", &out], 4, &["this is a folder"]);
    fails(&["check", &path("fifo.ron")], 4, &words);
    let sky = |file: &str| {
        ("sky: Gradient(bottom: (1, 1, 1), top: (0.5, 0.7, 1))", format!("sky: Image(file: \"{file}\")"))
    };
    let mesh =
        ("Sphere(center: (1, 0, 0), radius: 1, material: \"g\")", "Mesh(file: \"fifo.glb\")".to_owned());
    let texture = ("materials:", "textures: { \"t\": (file: \"zero.png\") },\n    materials:".to_owned());
    for (from, to) in [sky("fifo.exr"), mesh, texture] {
        assert!(GOOD.contains(from), "{from}");
        std::fs::write(path("scene.ron"), GOOD.replacen(from, &to, 1)).unwrap();
        fails(&["render", &path("scene.ron"), "-o", &out], 4, &words);
    }
    for file in ["/dev/zero", &path("fifo")] {
        fails(&["resume", file], 1, &words);
        fails(&["merge", file, "-o", &out], 1, &words);
    }
    for image in ["fifo.png", "zero.png", "fifo.pfm", "fifo.exr"] {
        fails(&["compare", &path(image), &path(image)], 1, &words);
    }
    let view = ["view", "--headless", "--backend=cpu", "--resolution=8x4", "--camera-path", &path("fifo")];
    fails(&view, 4, &words);
    assert!(!Path::new(&out).exists());
}

#[test]
fn devices_out_of_range() {
    let out = folder("devices").join("a.png");
    let out = out.to_str().unwrap();
    fails(&["render", "--backend", "cpu", "--device", "1", "-o", out], 3, &["--device 1", "trisect info"]);
    fails(&["render", "--device", "0", "-o", out], 2, &["--device needs --backend"]);
    fails(&["render", "--backend", "wgpu", "--device", "99", "-o", out], 3, &["wgpu"]);
    fails(&["render", "--backend", "cuda", "--device", "99", "-o", out], 3, &["cuda"]);
}

/// The message for a machine without NVIDIA's driver. With the driver the test is skipped.
#[test]
fn a_missing_driver_is_explained() {
    if trisect::device::cuda::devices().is_ok() {
        eprintln!("SKIPPED: this machine has NVIDIA's driver");
        return;
    }
    let out = folder("driver").join("a.png");
    let scene = root().join("scenes/rtiow_final.ron");
    fails(
        &["render", scene.to_str().unwrap(), "--backend", "cuda", "-o", out.to_str().unwrap()],
        3,
        &["backend cuda is not available", "driver", "--backend"],
    );
    let info = trisect(&["info"]);
    assert!(info.status.success());
    let text = String::from_utf8_lossy(&info.stdout);
    assert!(
        text.contains("cuda  backend cuda is not available") && text.contains("cpu   --device 0"),
        "{text}"
    );
}

#[test]
fn comparisons_of_what_cannot_be_compared() {
    let folder = folder("compare");
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    std::fs::write(path("broken.pfm"), "PF\n2 2\n-1\nxx").unwrap();
    std::fs::write(path("broken.png"), "not a picture").unwrap();
    std::fs::write(path("one.pfm"), b"Pf\n1 1\n-1\n\0\0\0\0").unwrap();
    std::fs::write(path("two.pfm"), b"Pf\n1 2\n-1\n\0\0\0\0\0\0\0\0").unwrap();
    fails(&["compare", &path("none.pfm"), &path("one.pfm")], 1, &["none.pfm"]);
    fails(&["compare", &path("broken.pfm"), &path("one.pfm")], 1, &["broken.pfm", "needs 48 bytes"]);
    fails(&["compare", &path("one.pfm"), &path("broken.png")], 1, &["broken.png"]);
    fails(&["compare", &path("one.pfm"), &path("two.pfm")], 1, &["size"]);
    fails(&["compare", "a.gif", &path("one.pfm")], 2, &["a.gif", ".png"]);
}

/// Returns whether the text has no control character beside line ends, which could act on a
/// terminal, and no line of more than 300 characters.
fn is_safe(text: &str) -> bool {
    text.lines().all(|line| line.chars().count() <= 300 && !line.chars().any(char::is_control))
}

#[test]
fn messages_cannot_act_on_a_terminal() {
    let folder = folder("escape");
    let (scene, image) = (folder.join("scene.ron"), folder.join("a.png"));
    let long = "x".repeat(5000);
    for name in ["\u{1b}[31mglass\u{7}\u{1b}]0;title\u{7}", &long, "a\tb\rc\u{9b}2J"] {
        std::fs::write(&scene, GOOD.replace("material: \"g\"", &format!("material: \"{name}\""))).unwrap();
        let arguments = ["render", scene.to_str().unwrap(), "-o", image.to_str().unwrap()];
        let output = trisect(&arguments);
        check_failure(&output, &arguments, 4, &["scene.ron:9:", "unknown material", "`materials` has: a, g"]);
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(is_safe(&text), "{text:?}");
    }
    // Negative control: what the names contained.
    assert!(!is_safe("\u{1b}[31m") && !is_safe(&long));
}

#[test]
fn a_scene_names_files_of_its_own_folder() {
    let folder = folder("outside");
    let below = folder.join("scene/models");
    std::fs::create_dir_all(&below).unwrap();
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    };
    write("a.obj", triangle);
    let absolute = write("scene/in.obj", triangle);
    write("scene/kd.mtl", "newmtl a\nKd 1 0 0\n");
    write("passwd", "root:x:0:0:secret\n");
    // A model in a folder below the scene's may name files of the scene's folder.
    write("scene/models/up.obj", &format!("mtllib ../kd.mtl\n{triangle}"));
    write("scene/models/out.obj", &format!("mtllib ../../passwd\n{triangle}"));
    let image = folder.join("a.png");
    let scene =
        |object: &str| write("scene/a.ron", &GOOD.replace("objects: [", &format!("objects: [{object},")));
    let run = |scene: &str, more: &[&str]| {
        let fixed = ["render", scene, "--backend", "cpu", "-q", "-o", image.to_str().unwrap()];
        trisect(&[&fixed[..], more].concat())
    };
    for (object, place) in [
        ("Mesh(file: \"../a.obj\")", "a.ron:7:"),
        (&format!("Mesh(file: \"{absolute}\")"), "a.ron:7:"),
        ("Mesh(file: \"models/../../a.obj\")", "a.ron:7:"),
        ("Mesh(file: \"models/out.obj\")", "line 1, mtllib"),
    ] {
        let output = run(&scene(object), &[]);
        check_failure(&output, &[object], 4, &[place, "outside the scene's folder", "--allow-outside"]);
        assert!(!image.exists());
    }
    let model = folder.join("scene/models/up.obj");
    let output = run(model.to_str().unwrap(), &[]);
    check_failure(&output, &[], 4, &["\"../kd.mtl\" lies outside the scene's folder", "--allow-outside"]);
    for (object, more) in [
        ("Mesh(file: \"models/up.obj\")", &[][..]),
        ("Mesh(file: \"models/../in.obj\")", &[]),
        ("Mesh(file: \"../a.obj\")", &["--allow-outside"]),
        (&format!("Mesh(file: \"{absolute}\")"), &["--allow-outside"]),
    ] {
        let output = run(&scene(object), more);
        assert!(output.status.success(), "{object}: {}", String::from_utf8_lossy(&output.stderr));
    }
    let output = run(&scene("Mesh(file: \"models/out.obj\")"), &["--allow-outside"]);
    check_failure(&output, &[], 4, &["passwd: line 1: no newmtl", "mtllib must name"]);
    assert!(!String::from_utf8_lossy(&output.stderr).contains("secret"));
    let checked = scene("Mesh(file: \"../a.obj\")");
    fails(&["check", &checked], 4, &["--allow-outside"]);
    assert_eq!(trisect(&["check", &checked, "--allow-outside"]).status.code(), Some(0));
}

#[test]
fn formats_and_numbers_that_are_none() {
    let folder = folder("none");
    let file = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    std::fs::write(file("m.blend"), "BLENDER\n").unwrap();
    for name in ["m.blend", "not-there.blend"] {
        let words =
            [name, "unknown format .blend; readable: .ron, .gltf, .glb, .obj, .ply, .stl, .pbrt, .xml"];
        fails(&["render", &file(name), "-o", &file("a.png")], 4, &words);
        fails(&["check", &file(name)], 4, &words);
    }
    std::fs::write(file("one.pfm"), b"Pf\n1 1\n-1\n\0\0\0\0").unwrap();
    for limit in ["NaN", "-1", "much"] {
        let limit = format!("--max-rel-mse={limit}");
        fails(&["compare", &file("one.pfm"), &file("one.pfm"), &limit], 2, &["--max-rel-mse", "0 or more"]);
    }
    assert!(trisect(&["compare", &file("one.pfm"), &file("one.pfm"), "--max-rel-mse=0"]).status.success());
}

/// A sky with a negative, infinite or NaN texel is refused by `render` and by `check`.
#[test]
fn a_sky_that_is_no_number() {
    let folder = folder("sky");
    let file = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let sky = |value: f32| [b"PF\n1 1\n-1\n".to_vec(), value.to_le_bytes().repeat(3)].concat();
    let gradient = "Gradient(bottom: (1, 1, 1), top: (0.5, 0.7, 1))";
    assert!(GOOD.contains(gradient));
    std::fs::write(file("a.ron"), GOOD.replace(gradient, "Image(file: \"sky.pfm\")")).unwrap();
    for value in [f32::NAN, f32::INFINITY, -1.0] {
        std::fs::write(file("sky.pfm"), sky(value)).unwrap();
        let words = ["a.ron", "the panorama's texel (0, 0)"];
        fails(&["render", &file("a.ron"), "-o", &file("a.png")], 4, &words);
        fails(&["check", &file("a.ron")], 4, &words);
    }
    std::fs::write(file("sky.pfm"), sky(1.0)).unwrap();
    assert_eq!(trisect(&["check", &file("a.ron")]).status.code(), Some(0));
}

/// A cache folder that cannot be written is reported before the reference is rendered, which here
/// would take far longer than a test may.
#[test]
fn a_cache_that_cannot_be_written() {
    let folder = folder("cache");
    let cache = folder.join("file");
    std::fs::write(&cache, "").unwrap();
    let arguments =
        ["--backend=cpu", "--resolution=8x4", "--first=1", "--last=4", "--reference-spp=4000000000"];
    let arguments = [&["converge", "--cache", cache.to_str().unwrap()], &arguments[..]].concat();
    fails(&arguments, 1, &["file", "name another folder by --cache"]);
}

#[test]
fn options_without_effect_are_warned_of_once() {
    let folder = folder("warnings");
    let file = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let dark = GOOD.replace("sky: Gradient(bottom: (1, 1, 1), top: (0.5, 0.7, 1)),", "");
    std::fs::write(file("dark.ron"), dark).unwrap();
    std::fs::write(file("good.ron"), GOOD).unwrap();
    let warnings = |scene: &str, more: &[&str]| {
        let image = file("a.png");
        let output =
            trisect(&[&["render", &file(scene), "--backend=cpu", "-q", "-o", &image], more].concat());
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{text}");
        text.lines().filter(|line| line.starts_with("warning: ")).map(str::to_owned).collect::<Vec<_>>()
    };
    let found = warnings("dark.ron", &[]);
    assert!(found.len() == 1 && found[0].contains("no light") && found[0].contains("`sky`"), "{found:?}");
    let found = warnings("good.ron", &["--roulette-depth=3", "--roulette=off"]);
    assert!(found.len() == 1 && found[0].contains("--roulette off"), "{found:?}");
    assert!(warnings("good.ron", &["--roulette-depth=3", "--roulette=on"]).is_empty());
    // A goal may enable roulette.
    assert!(warnings("good.ron", &["--roulette-depth=3", "--target-error=50%", "--max-spp=16"]).is_empty());
}
