//! Image files, read by the tools of other projects: oiiotool (OpenImageIO), exrheader (OpenEXR)
//! and identify (ImageMagick).
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use std::fs;
use std::process::Command;
use trisect::image::Image;
use trisect_tests::program::{Temporary, check_failure, trisect};

/// A sky of middle grey, before which a bright orange ball is half as wide as the image.
const SCENE: &str = "Scene(version: 1, image: (width: 32, height: 16, samples: 4, depth: 3), \
    camera: (look_from: (0, 0, 5), look_at: (0, 0, 0), vertical_fov: 30), \
    sky: Uniform(radiance: (0.18, 0.18, 0.18)), \
    materials: { \"lamp\": Emissive(radiance: (8, 3, 0.5)) }, \
    objects: [Sphere(center: (0, 0, 0), radius: 1.3, material: \"lamp\")])";

fn folder(name: &str) -> Temporary {
    let folder = Temporary::new("files", name);
    fs::write(folder.path("a.ron"), SCENE).unwrap();
    folder
}

fn run(arguments: &[&str]) {
    let output = trisect(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Renders the scene to a file of the folder, whose path is returned.
fn render(folder: &Temporary, image: &str, options: &[&str]) -> String {
    let image = folder.file(image);
    run(&[&["render", &folder.file("a.ron"), "-o", &image, "--backend", "cpu", "-q"], options].concat());
    image
}

/// Returns the output of a tool, or `None`, aloud, if it is not installed. `tests/run` installs
/// them.
fn tool(words: &[&str]) -> Option<String> {
    let Ok(output) = Command::new(words[0]).args(&words[1..]).output() else {
        eprintln!("SKIPPED: {} is not installed", words[0]);
        return None;
    };
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{words:?}: {text}{}", String::from_utf8_lossy(&output.stderr));
    Some(text)
}

/// Checks that a tool's output has each line, apart from its indentation.
fn check_lines(words: &[&str], lines: &[&str]) {
    let Some(text) = tool(words) else { return };
    for line in lines {
        assert!(text.lines().any(|of| of.trim().starts_with(line)), "{words:?} lacks {line:?}:\n{text}");
    }
}

#[test]
fn oiiotool_reads_png() {
    let folder = folder("oiio-png");
    let image = render(&folder, "a.png", &["--seed", "7", "--exposure", "1", "--tonemap", "agx"]);
    check_lines(
        &["oiiotool", "--info", "-v", &image],
        &[
            &format!("{image} :   32 x   16, 3 channel, uint8 png"),
            "oiio:ColorSpace: \"sRGB\"",
            "Software: \"Trisect 0.1.0\"",
            "Scene: \"a.ron\"",
            "Samples: \"4\"",
            "Seed: \"7\"",
            "Exposure: \"1\"",
            "Tone Map: \"agx\"",
            "Fingerprint: \"",
        ],
    );
    let image = render(&folder, "b.png", &["--bits", "16", "--background", "transparent"]);
    check_lines(
        &["oiiotool", "--info", "-v", &image],
        &[&format!("{image} :   32 x   16, 4 channel, uint16 png")],
    );
    // Alpha is 0 in the corner and 1 in the middle, where blue is sRGB's code of 0.5.
    check_lines(&["convert", &format!("{image}[1x1+0+0]"), "txt:-"], &["0,0: (0,0,0,0)"]);
    let middle = tool(&["convert", &format!("{image}[1x1+16+8]"), "txt:-"]);
    assert!(middle.is_none_or(|text| text.contains("srgba(100%,100%,73.5363%,1)")), "the middle pixel");
    let image = render(&folder, "c.png", &["--gamma", "1.8"]);
    check_lines(&["oiiotool", "--info", "-v", &image], &["oiio:Gamma: 1.8"]);
}

#[test]
fn imagemagick_reads_png_jpeg_and_tiff() {
    let folder = folder("magick");
    for (name, options, wanted) in [
        ("a.png", &[][..], "PNG 32x16 srgb"),
        ("b.png", &["--bits", "16"], "PNG 32x16 srgb"),
        ("c.png", &["--background", "transparent"], "PNG 32x16 srgba"),
        ("a.jpg", &[], "JPEG 32x16 srgb"),
        ("a.tif", &[], "TIFF 32x16 srgb"),
        ("b.tiff", &["--bits", "16", "--background", "transparent"], "TIFF 32x16 srgba"),
    ] {
        let image = render(&folder, name, options);
        let Some(told) = tool(&["identify", "-format", "%m %wx%h %[channels]", &image]) else { return };
        assert_eq!(told.trim_end(), wanted, "{name}");
    }
    let jpeg = folder.file("a.jpg");
    let comment = tool(&["identify", "-format", "%c", &jpeg]).unwrap();
    assert!(comment.contains("Software: Trisect") && comment.contains("Samples: 4"), "{comment}");
    let tiff = folder.file("b.tiff");
    check_lines(
        &["oiiotool", "--info", "-v", &tiff],
        &[&format!("{tiff} :   32 x   16, 4 channel, uint16 tiff"), "Software: \"Trisect 0.1.0\""],
    );
    let text = tool(&["identify", "-format", "%[tiff:software] %[comment]", &tiff]).unwrap();
    assert!(text.contains("Trisect 0.1.0"), "{text}");
    // The pixels of all formats: 8 bits for 16, and the loss of JPEG at the ball's edge.
    let read = |name: &str| Image::read(&folder.path(name)).unwrap();
    let of = read("a.png");
    for (name, within) in [("b.png", 0.005), ("a.tif", 1e-6), ("a.jpg", 0.25)] {
        let pairs = of.pixels.iter().flatten().zip(read(name).pixels.into_iter().flatten());
        let most = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(most < within, "{name}: {most}");
    }
}

#[test]
fn openexr_reads_exr() {
    let folder = folder("exr");
    let image = render(&folder, "a.exr", &["--aov", "depth,normal,albedo,id", "--background", "transparent"]);
    check_lines(
        &["exrheader", &image],
        &[
            "A, 16-bit floating-point, sampling 1 1",
            "B, 16-bit floating-point, sampling 1 1",
            "N.X, 16-bit floating-point, sampling 1 1",
            "Z, 32-bit floating-point, sampling 1 1",
            "albedo.R, 16-bit floating-point, sampling 1 1",
            "id, 32-bit unsigned integer, sampling 1 1",
            "compression (type compression): zip, multi-scanline blocks",
            "lineOrder (type lineOrder): increasing y",
            "dataWindow (type box2i): (0 0) - (31 15)",
            "displayWindow (type box2i): (0 0) - (31 15)",
            "chromaticities (type chromaticities):",
            "red   (0.64 0.33)",
            "software (type string): \"Trisect 0.1.0\"",
            "trisect.samples (type string): \"4\"",
            "trisect.fingerprint (type string): \"",
            "worldToCamera (type m44f):",
            "worldToNDC (type m44f):",
            "(1 0 0 0",
            "0 0 5 1)",
        ],
    );
    let image = render(&folder, "b.exr", &["--float", "--metadata", "all"]);
    check_lines(
        &["exrheader", &image],
        &[
            "R, 32-bit floating-point, sampling 1 1",
            "trisect.creationTime (type string): \"20",
            "trisect.renderTime (type string): \"0.",
            "trisect.device (type string): \"cpu: ",
        ],
    );
    let image = render(&folder, "c.exr", &["--metadata", "none"]);
    if let Some(text) = tool(&["exrheader", &image]) {
        assert!(!text.contains("software") && !text.contains("trisect."), "{text}");
    }
}

/// Radiance beyond 16-bit floats keeps its value, and the program says so.
#[test]
fn no_radiance_is_lost_to_16_bits() {
    let folder = folder("beyond");
    fs::write(folder.path("a.ron"), SCENE.replace("(8, 3, 0.5)", "(80000, 3, 0.5)")).unwrap();
    let image = folder.file("a.exr");
    let arguments = ["render", &folder.file("a.ron"), "-o", &image, "--backend", "cpu"];
    let output = trisect(&arguments);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(told.contains("colours have 32 bits: some exceed 65504"), "{told}");
    let most = Image::read(&folder.path("a.exr")).unwrap().pixels.into_iter().flatten().fold(0.0, f32::max);
    assert_eq!(most, 80000.0);
    // Negative control: without such a colour they have 16 bits, in which 0.18 is rounded.
    let image = render(&self::folder("within"), "a.exr", &[]);
    let corner = Image::read(image.as_ref());
    assert!(corner.is_err() || corner.unwrap().pixels[0][0] != 0.18);
}

/// Equal renders are equal files, unless they ask for the date.
#[test]
fn equal_renders_are_equal_files() {
    let folder = folder("equal");
    for format in ["png", "jpg", "tif", "exr", "hdr", "pfm"] {
        let bytes = |name: &str, options: &[&str]| {
            fs::read(render(&folder, &format!("{name}.{format}"), options)).unwrap()
        };
        let one = bytes("one", &[]);
        assert!(one == bytes("two", &[]), "{format}");
        let has_text = !matches!(format, "hdr" | "pfm");
        assert_eq!(one != bytes("all", &["--metadata", "all"]), has_text, "{format}");
        assert!(one != bytes("other", &["--seed", "1", "--spp", "1"]) || format == "jpg", "{format}");
    }
}

#[test]
fn formats_without_what_was_asked_for_are_refused() {
    let folder = folder("refused");
    for (name, option, wanted) in [
        ("a.jpg", ["--bits", "16"], "--bits 16 needs a format that has 8 or 16 bits; use .png or .tif"),
        ("a.exr", ["--bits", "16"], "--bits 16 needs a format"),
        ("a.exr", ["--gamma", "2.2"], "--gamma is for a display"),
        ("a.jpg", ["--background", "transparent"], "needs a format with alpha; use .png, .tif or .exr"),
        ("a.tif", ["--aov", "depth"], "--aov needs a format with layers; use .exr"),
        ("b.gif", ["--gamma", "2.2"], "unknown image format; use .png, .jpg, .tif, .exr, .hdr or .pfm"),
    ] {
        let file = folder.file(name);
        let arguments = ["render", &folder.file("a.ron"), "-o", &file, option[0], option[1]];
        check_failure(&trisect(&arguments), &arguments, 2, &[wanted]);
        assert!(!folder.path(name).exists());
    }
}

/// An image that the format has no room for is refused before it is rendered.
#[test]
fn images_fit_their_format() {
    let folder = folder("size");
    let (scene, image) = (folder.file("a.ron"), folder.file("a.jpg"));
    let arguments = ["render", &scene, "-o", &image, "--resolution", "70000x1"];
    let wanted = ["a.jpg: the image is 70000 pixels long, and the format has at most 65535"];
    check_failure(&trisect(&arguments), &arguments, 1, &wanted);
}

/// Light groups are layers of an .exr beside the others, and are refused where they cannot be.
#[test]
fn light_groups_are_layers() {
    let folder = folder("lights");
    let groups = ["--light-group", "ball=objects[0]", "--aov", "id"];
    let file = render(&folder, "lights.exr", &groups);
    check_lines(
        &["exrheader", &file],
        &[
            "light_ball.R, 16-bit floating-point",
            "light_rest.B, 16-bit floating-point",
            "id, 32-bit unsigned",
        ],
    );
    for (image, options, wanted) in [
        ("a.png", &["--light-group", "a=sky"][..], "--light-group needs a format with layers"),
        (
            "a.exr",
            &["--light-group", "a=sky", "--budget", "1s"],
            "--light-group cannot be combined with --budget",
        ),
        ("a.exr", &["--light-group", "a=b,sky=c"], "--light-group"),
    ] {
        let (scene, image) = (folder.file("a.ron"), folder.file(image));
        let arguments = [&["render", &scene, "-o", &image, "--backend", "cpu"], options].concat();
        let code = if wanted == "--light-group" { 4 } else { 2 };
        check_failure(&trisect(&arguments), &arguments, code, &[wanted]);
    }
}

/// A part of an image is as large as asked for; an .exr keeps its place in the whole.
#[test]
fn a_crop_keeps_its_place() {
    let folder = folder("crop");
    for crop in ["0.25,0.5,0.75,1", "8,8,24,16"] {
        let file = render(&folder, "crop.exr", &["--crop", crop, "--resolution", "32x16", "--aov", "depth"]);
        let image = Image::read(file.as_ref()).unwrap();
        // Readers put the part in its place.
        assert_eq!((image.width, image.height), (32, 16), "{crop}");
        assert!(image.pixels[0] == [0.0; 3] && image.pixels[8 * 32 + 8] != [0.0; 3], "{crop}");
        let windows =
            ["dataWindow (type box2i): (8 8) - (23 15)", "displayWindow (type box2i): (0 0) - (31 15)"];
        check_lines(&["exrheader", &file], &windows);
    }
    // Parts of the samples are merged to the same place.
    let parts = ["0..256", "256..512"].map(|samples| {
        let part = folder.file(&format!("{}.ckpt", &samples[..1]));
        let options =
            ["--crop", "8,8,24,16", "--resolution", "32x16", "--spp", "512", "--sample-range", samples];
        render(&folder, "part.exr", &[&options[..], &["--checkpoint", &part]].concat());
        part
    });
    let merged = folder.file("merged.exr");
    run(&["merge", &parts[0], &parts[1], "-o", &merged]);
    check_lines(&["exrheader", &merged], &["dataWindow (type box2i): (8 8) - (23 15)"]);
    let file = render(&folder, "crop.png", &["--crop", "8,8,24,16", "--resolution", "32x16"]);
    assert_eq!(Image::read(file.as_ref()).unwrap().width, 16);
    let beyond = ["render", &folder.file("a.ron"), "--crop", "0,0,40,8", "--resolution", "32x16"];
    check_failure(&trisect(&beyond), &beyond, 2, &["--crop", "columns 0 to 40", "32x16"]);
}

/// Standard output has the bytes of the file, and a reader that ends early is no error.
#[test]
fn images_go_to_standard_output() {
    let folder = folder("stdout");
    let scene = folder.file("a.ron");
    for (name, format) in [("-", "png"), ("exr:-", "exr"), ("jpg:-", "jpg")] {
        let output = trisect(&["render", &scene, "-o", name, "--backend", "cpu"]);
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && !told.contains("wrote"), "{told}");
        let file = render(&folder, &format!("a.{format}"), &[]);
        assert!(output.stdout == fs::read(file).unwrap(), "{format}");
    }
    // An image that cannot go there is not lost.
    let full = format!(
        "'{}' render '{scene}' --backend cpu -q -o exr:- > /dev/full",
        trisect_tests::binary().display()
    );
    let shell = Command::new("bash").args(["-c", &full]).env("TMPDIR", folder.path("")).output().unwrap();
    let told = String::from_utf8_lossy(&shell.stderr).into_owned();
    let kept = told.lines().find_map(|line| line.strip_prefix("wrote ")?.strip_suffix(" instead"));
    assert!(kept.is_some_and(|path| Image::read(path.as_ref()).is_ok()), "{told}");
    let both = ["render", &scene, "-o", "-", "--stats", "-"];
    check_failure(&trisect(&both), &both, 2, &["-o and --stats are the same file"]);
    let program = trisect_tests::binary();
    let piped = format!(
        "'{}' render '{scene}' --backend cpu -q --resolution 512x512 -o - | head -c 1",
        program.display()
    );
    let shell = Command::new("bash").args(["-o", "pipefail", "-c", &piped]).output().unwrap();
    assert!(shell.status.success(), "{}", String::from_utf8_lossy(&shell.stderr));
}

#[test]
fn several_scenes_have_files_of_their_own() {
    let folder = folder("several");
    let (a, b) = (folder.file("a.ron"), folder.file("b.ron"));
    fs::write(&b, SCENE.replace("0.18", "0.5")).unwrap();
    let name = folder.file("of_{scene}.png");
    let stats = folder.file("{scene}.json");
    let common = ["--backend", "cpu", "-q"];
    run(&[&["render", &a, &b, "-o", &name, "--stats", &stats], &common[..]].concat());
    let alone = render(&folder, "alone.png", &[]);
    assert!(fs::read(folder.path("of_a.png")).unwrap() == fs::read(&alone).unwrap());
    assert!(fs::read(folder.path("of_b.png")).unwrap() != fs::read(&alone).unwrap());
    assert!(folder.path("a.json").exists() && folder.path("b.json").exists());
    // A scene that fails does not keep the next from being rendered.
    fs::remove_file(folder.path("of_b.png")).unwrap();
    let missing = folder.file("missing.ron");
    let arguments = [&["render", &missing, &b, "-o", &name], &common[..]].concat();
    check_failure(&trisect(&arguments), &arguments, 4, &["missing.ron"]);
    assert!(folder.path("of_b.png").exists());
    for (options, wanted) in [
        (&["-o", "one.png"][..], "one.png: several scenes have one name for -o; put {scene} into it"),
        (
            &["-o", "{scene}.png", "--checkpoint", "a.ckpt"],
            "--checkpoint cannot be combined with several scenes",
        ),
        (&["-o", "{scene}.png", "--stats", "a.json"], "several scenes have one name for --stats"),
    ] {
        let arguments = [&["render", &a, &b], options].concat();
        check_failure(&trisect(&arguments), &arguments, 2, &[wanted]);
    }
    let same = ["render", &a, &a, "-o", &name];
    check_failure(&trisect(&same), &same, 2, &["of_a.png: two scenes have this file for -o"]);
    let piped = ["render", &a, &b, "-o", "-"];
    check_failure(&trisect(&piped), &piped, 2, &["standard output cannot be combined with several scenes"]);
    // One scene may be what a pattern of names gave.
    run(&[&["render", &a, "-o", &folder.file("single_{scene}.png")], &common[..]].concat());
    assert!(fs::read(folder.path("single_a.png")).unwrap() == fs::read(&alone).unwrap());
    // The output of a scene may be the texture of another.
    let texture = trisect::output::encode_bytes(2, 2, &[200; 12]).unwrap();
    fs::write(folder.path("a.png"), &texture).unwrap();
    let textured = "textures: { \"t\": (file: \"a.png\") }, materials: { \"u\": Lambertian(albedo: (1, 1, 1), texture: \"t\"),";
    fs::write(&b, SCENE.replace("materials: {", textured)).unwrap();
    let over = ["render", &a, &b, "-o", &folder.file("{scene}.png")];
    check_failure(&trisect(&over), &over, 2, &["a.png: -o would overwrite a file of a scene"]);
    assert!(fs::read(folder.path("a.png")).unwrap() == texture);
}

/// Names, key and manifest of mattes as another reader sees them; the ids are those of the
/// manifest.
#[test]
fn oiiotool_reads_mattes() {
    let folder = folder("mattes");
    fs::write(folder.path("a.ron"), SCENE.replace("radius: 1.3", "radius: 1.3, name: \"ball\"")).unwrap();
    let image = render(&folder, "a.exr", &["--aov", "cryptomatte"]);
    // The key is the hash of "CryptoObject" by MurmurHash3's own code.
    let lines = [
        "channel list: R (half), G (half), B (half), CryptoMaterial00.R (float), CryptoMaterial00.G (float)",
        "cryptomatte/3ae39a5/name: \"CryptoObject\"",
        "cryptomatte/3ae39a5/hash: \"MurmurHash3_32\"",
        "cryptomatte/3ae39a5/conversion: \"uint32_to_float32\"",
        "cryptomatte/3ae39a5/manifest: \"{\"ball\":\"",
    ];
    check_lines(&["oiiotool", "--info", "-v", &image], &lines);
    let shares = folder.file("shares.exr");
    let channels = "CryptoObject00.G,CryptoMaterial00.G,CryptoObject00.A";
    if tool(&["oiiotool", &image, "--ch", channels, "--chnames", "R,G,B", "-o", &shares]).is_some() {
        let shares = Image::read(shares.as_ref()).unwrap();
        let [object, material, second] = shares.pixels[8 * 32 + 16];
        assert_eq!([object, material, second], [1.0, 1.0, 0.0]);
        assert_eq!(shares.pixels[0], [0.0; 3]);
        assert!(shares.pixels.iter().any(|[object, ..]| *object > 0.0 && *object < 1.0));
    }
}
