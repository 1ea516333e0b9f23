//! `--denoise oidn`: with the library, with one that stands in for it, and without.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use std::process::{Command, Output};
use trisect_tests::program::{Temporary, check_failure, fails};
use trisect_tests::{binary, mpi, root};

const VARIABLE: &str = "TRISECT_OIDN_LIBRARY";
/// A small render of one sample a pixel.
const SMALL: [&str; 6] =
    ["render", "--backend=cpu", "--resolution=16x9", "--spp=1", "--seed=4", "--denoise=oidn"];

/// Runs the program with the library `library`, of which `step` fails.
fn with(library: &str, step: &str, arguments: &[&str]) -> Output {
    let mut command = Command::new(binary());
    command.args(arguments).env(VARIABLE, library).env("FAKE_OIDN", step).env("NO_COLOR", "1");
    command.output().unwrap()
}

/// Compiles the library that stands in for Open Image Denoise; `None` without a compiler.
fn fake(folder: &Temporary, name: &str, options: &[&str]) -> Option<String> {
    let file = folder.file(name);
    let source = root().join("tests/program/open_image_denoise.cc");
    let mut command = Command::new("c++");
    command.args(["-shared", "-fPIC", "-O1"]).args(options).arg("-o").arg(&file).arg(source);
    match command.output() {
        Ok(output) => {
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            Some(file)
        }
        Err(error) => {
            eprintln!("SKIPPED: c++: {error}");
            None
        }
    }
}

/// Returns a library that this process has loaded and that is no Open Image Denoise.
#[cfg(target_os = "linux")]
fn other_library() -> String {
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
    let mut files = maps.lines().filter_map(|line| line.split_whitespace().last());
    files.find(|file| file.contains("/libc.so")).unwrap().to_owned()
}

/// The error names what was searched and what helps, before anything is rendered.
#[test]
fn a_missing_library_is_named() {
    let folder = Temporary::new("oidn", "missing");
    let out = folder.file("out.pfm");
    let run = |library: &str, words: &[&str]| {
        let arguments = [&SMALL[..], &["-o", &out]].concat();
        check_failure(&with(library, "", &arguments), &arguments, 3, words);
        assert!(!folder.path("out.pfm").exists());
    };
    let nothing = folder.file("nothing.so");
    run(&nothing, &[VARIABLE, "nothing.so, which does not exist", "pyoidn", "--denoise svgf needs nothing"]);
    run(&folder.file(""), &[VARIABLE, "which has no ", "OpenImageDenoise"]);
    std::fs::write(folder.path("broken.so"), "no library").unwrap();
    run(&folder.file("broken.so"), &["cannot be loaded", "broken.so"]);
    #[cfg(target_os = "linux")]
    run(&other_library(), &["libc.so", "is not Open Image Denoise 2", "oidnNewDevice"]);
    let output = with(&nothing, "", &["info"]);
    assert!(output.status.success());
    assert!(String::from_utf8_lossy(&output.stdout).contains("oidn  Open Image Denoise cannot be loaded"));
    // What needs no library is as before.
    let output = with(&nothing, "", &["render", "--denoise=svgf", "--resolution=8x8", "--spp=1", "-o", &out]);
    assert!(output.status.success(), "{output:?}");
}

/// Versions with other functions are refused.
#[test]
fn version_1_is_refused() {
    let folder = Temporary::new("oidn", "old");
    let out = folder.file("out.pfm");
    let arguments = [&SMALL[..], &["-o", &out]].concat();
    let Some(old) = fake(&folder, "old.so", &["-DOLD"]) else { return };
    check_failure(&with(&old, "", &arguments), &arguments, 3, &["old.so", "it is version 1"]);
    let Some(new) = fake(&folder, "new.so", &[]) else { return };
    check_failure(&with(&new, "version 1", &arguments), &arguments, 3, &["new.so", "it is version 1"]);
}

/// Each step's error is passed on, and the image is written without denoising.
#[test]
fn errors_are_passed_on() {
    let folder = Temporary::new("oidn", "errors");
    let Some(library) = fake(&folder, "fake.so", &[]) else { return };
    for (step, words) in [
        ("no device", ["opening a device", "no device, says the fake"]),
        ("device", ["opening a device", "no device, says the fake"]),
        ("memory", ["copying an image", "out of memory, says the fake"]),
        ("commit", ["denoising the albedo", "no weights, says the fake"]),
        ("execute", ["denoising the albedo", "a lost device, says the fake"]),
    ] {
        let out = folder.file(&format!("{}.pfm", step.replace(' ', "-")));
        let arguments = [&SMALL[..], &["-o", &out]].concat();
        let output = with(&library, step, &arguments);
        check_failure(&output, &arguments, 1, &words);
        check_failure(&output, &arguments, 1, &["without denoising"]);
        assert!(std::path::Path::new(&out).exists(), "{step}");
    }
}

/// The library gets radiance and features as it expects them, and its image is the one written: by
/// a render, one that was resumed, one with a goal, and one over ranks.
#[test]
fn the_library_is_called_as_it_expects() {
    let folder = Temporary::new("oidn", "fake");
    let Some(library) = fake(&folder, "fake.so", &[]) else { return };
    let run = |arguments: &[&str]| {
        let output = with(&library, "", arguments);
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        output
    };
    let image = |name: &str| {
        let bytes = std::fs::read(folder.path(name)).unwrap();
        let data = &bytes[bytes.len() - 16 * 9 * 12..];
        data.chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect::<Vec<f32>>()
    };
    let [raw, plain, stats] = ["raw.pfm", "plain.pfm", "stats.json"].map(|name| folder.file(name));
    run(&[&SMALL[..5], &["-q", "-o", &raw]].concat());
    run(&[&SMALL[..], &["--stats", &stats, "-o", &plain]].concat());
    let halved: Vec<f32> = image("raw.pfm").iter().map(|value| 0.5 * value).collect();
    assert_eq!(image("plain.pfm"), halved);
    let stats: serde_json::Value = serde_json::from_slice(&std::fs::read(stats).unwrap()).unwrap();
    assert_eq!(stats["denoise"], serde_json::json!({ "filter": "oidn" }));
    let named = stats["denoise_library"].as_str().unwrap();
    assert!(named.starts_with("Open Image Denoise 2.3.0 on CPU (") && named.contains("fake.so"), "{named}");
    // Of a folder, too, and with a checkpoint of which nothing is missing.
    let name =
        if cfg!(target_vendor = "apple") { "libOpenImageDenoise.dylib" } else { "libOpenImageDenoise.so" };
    std::fs::create_dir(folder.path("lib")).unwrap();
    std::fs::copy(&library, folder.path("lib").join(name)).unwrap();
    let [checkpoint, resumed] = ["a.ckpt", "resumed.pfm"].map(|name| folder.file(name));
    let keep = ["--checkpoint", &checkpoint, "-o", &resumed];
    assert!(with(&folder.file(""), "", &[&SMALL[..], &keep].concat()).status.success());
    std::fs::remove_file(&resumed).unwrap();
    run(&["resume", &checkpoint, "-o", &resumed, "-q"]);
    assert_eq!(image("resumed.pfm"), halved);
    for goal in [["--target-error", "60%"], ["--budget", "300ms"]] {
        let out = folder.file("goal.pfm");
        run(&[&SMALL[..3], &["--denoise=oidn", "-q", "-o", &out], &goal].concat());
    }
    let text =
        run(&["bench", "--backend=cpu", "--resolution=16x9", "--spp=1", "--denoise=oidn", "--frames=2"]);
    let text = String::from_utf8(text.stdout).unwrap();
    for row in ["denoise the albedo, ms", "denoise the normal, ms", "denoise the radiance, ms", "denoise, ms"]
    {
        assert!(text.contains(row), "{row:?} in {text}");
    }
    if mpi::available() {
        let out = folder.file("ranks.pfm");
        let arguments = [&SMALL[..], &["--distribute", "rows", "-q", "-o", &out]].concat();
        let output = mpi::command(&[], &[(2, &arguments)]).env(VARIABLE, &library).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(image("ranks.pfm"), halved);
    }
}

/// A budget takes the library if that lowers the error. On a plane that fills the view each pixel
/// has the same radiance, so the image's mean has less noise; half of it, the control, is worse
/// than the samples. A library that the variable names and that cannot be used is an error.
#[test]
fn a_budget_takes_the_library_if_it_helps() {
    let folder = Temporary::new("oidn", "budget");
    let Some(library) = fake(&folder, "fake.so", &[]) else { return };
    let [scene, out] = ["plane.ron", "out.pfm"].map(|name| folder.file(name));
    let plane = "Scene(version: 1, image: (width: 160, height: 90), \
        camera: (look_from: (0, 3, 0.1), look_at: (0, 0, 0), vertical_fov: 20), \
        materials: { \"a\": Lambertian(albedo: (0.5, 0.5, 0.5)), \"lamp\": Emissive(radiance: (4, 4, 4)) }, \
        objects: [Plane(point: (0, 0, 0), normal: (0, 1, 0), material: \"a\"), \
        Sphere(center: (0, 100, 0), radius: 40, material: \"lamp\")])";
    std::fs::write(&scene, plane).unwrap();
    let arguments = [
        "render",
        &scene,
        "--backend=cpu",
        "--light-sampling=off",
        "--sampler=independent",
        "-q",
        "-o",
        &out,
        "--stats=-",
    ];
    let chosen = |step: &str, budget: &str| {
        let output = with(&library, step, &[&arguments[..], &[budget]].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let stats: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        stats["sampling"]["way"]["denoise"].clone()
    };
    // On a loaded machine the library may not fit a short time.
    let mut budgets = ["--budget=1s", "--budget=4s", "--budget=16s"].iter();
    assert!(budgets.any(|budget| chosen("mean", budget) == serde_json::json!({ "filter": "oidn" })));
    assert_ne!(chosen("", "--budget=1s"), serde_json::json!({ "filter": "oidn" }));
    // A device that fails leaves the filter that needs nothing.
    assert_ne!(chosen("memory", "--budget=1s"), serde_json::json!({ "filter": "oidn" }));
    let arguments = [&arguments[..], &["--budget=1s"]].concat();
    let missing = with(&folder.file("nothing.so"), "", &arguments);
    check_failure(&missing, &arguments, 3, &[VARIABLE, "nothing.so", "--denoise svgf needs nothing"]);
}

/// A library that small images show to be too slow never gets the whole image. One that is fast,
/// the control, gets it; its failure is a warning, and the filter that needs nothing is tried.
#[test]
fn a_slow_library_does_not_delay_a_budget() {
    let folder = Temporary::new("oidn", "slow");
    let Some(library) = fake(&folder, "fake.so", &[]) else { return };
    let out = folder.file("out.pfm");
    let error = |step: &str, budget: &str| {
        let fixed = ["render", "--backend=cpu", "--resolution=640x480", "-q", "-o", &out, "--stats=-"];
        let output = with(&library, step, &[&fixed[..], &[budget]].concat());
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{text}");
        let stats: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let error = stats["sampling"]["denoiser_error"].clone();
        assert_eq!(text.contains("a denoiser could not be tried"), error.is_string(), "{text}");
        assert_ne!(stats["sampling"]["way"]["denoise"], serde_json::json!({ "filter": "oidn" }));
        error
    };
    assert!(error("slow", "--budget=1s").is_null());
    // On a loaded machine the library may not fit a short time.
    let mut budgets = ["--budget=1s", "--budget=4s", "--budget=16s"].iter();
    let is_told = |budget: &&str| {
        error("small", budget).as_str().is_some_and(|error| error.contains("a large image, says the fake"))
    };
    assert!(budgets.any(is_told));
}

/// Live frames and parameters of the filters are refused, with what works.
#[test]
fn frames_and_parameters_are_refused() {
    let words = ["--denoise oidn is for finished images", "svgf"];
    fails(&["view", "--headless", "--denoise=oidn"], 2, &words);
    let levels = ["render", "--denoise=oidn", "--denoise-levels=3", "-o", "out.png"];
    fails(&levels, 2, &["--denoise-levels is a parameter of the filters", "atrous"]);
    if mpi::available() {
        let arguments = ["view", "--headless", "--distribute=rows", "--denoise=oidn"];
        check_failure(&mpi::run(2, &arguments), &arguments, 2, &words);
    }
}
