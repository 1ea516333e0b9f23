//! The program as users run it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::path::PathBuf;
use std::process::{Command, Output};
use trisect::image::Image;
use trisect_tests::{binary, root};

fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("trisect-command-line-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&path).unwrap();
    path
}

fn trisect(arguments: &[&str]) -> Output {
    let output = Command::new(binary()).args(arguments).output().expect("the program runs");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

#[test]
fn render_every_format_and_compare() {
    let folder = folder("formats");
    let scene = root().join("scenes/rtiow_final.ron");
    let render = |name: &str, more: &[&str]| {
        let file = folder.join(name).to_str().unwrap().to_owned();
        let fixed =
            ["render", scene.to_str().unwrap(), "--backend", "cpu", "--quiet", "--resolution", "64x36"];
        let float: &[&str] = if name.ends_with("png") { &[] } else { &["--float"] };
        let output = trisect(&[&fixed[..], &["--spp", "4", "-o", &file], float, more].concat());
        assert!(output.stderr.is_empty() && output.stdout.is_empty(), "--quiet: {output:?}");
        file
    };
    let reference = render("a.exr", &[]);
    for name in ["b.pfm", "b.png", "b.hdr", "b.EXR"] {
        let file = render(name, &[]);
        let image = Image::read(file.as_ref()).unwrap();
        assert_eq!((image.width, image.height), (64, 36));
        let output = trisect(&["compare", "--json", &file, &reference]);
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let limit = if name.ends_with("pfm") || name.ends_with("EXR") { 0.0 } else { 1e-4 };
        assert!(json["rel_mse"].as_f64().unwrap() <= limit, "{name}: {json}");
    }
    // Another seed gives another image: `compare` finds it, and --max-rel-mse turns that into exit
    // code 5.
    let other = render("c.exr", &["--seed", "9"]);
    let compare = |limit: &str| {
        let arguments = ["compare", &other, &reference, "--max-rel-mse", limit];
        Command::new(binary()).args(arguments).output().unwrap().status.code()
    };
    assert_eq!((compare("1e-9"), compare("1e9")), (Some(5), Some(0)));
    let text = String::from_utf8(trisect(&["compare", &other, &reference]).stdout).unwrap();
    for measure in ["RMSE", "relMSE", "PSNR", "FLIP", "greatest difference", "at pixel"] {
        assert!(text.contains(measure), "{text}");
    }
}

#[test]
fn stats_say_what_was_done() {
    let folder = folder("stats");
    let (image, stats) = (folder.join("a.png"), folder.join("stats.json"));
    trisect(&[
        "render",
        "--backend=cpu",
        "--threads=2",
        "--width=32",
        "--spp=3",
        "--depth=4",
        "--seed=5",
        "--roulette=on",
        "-o",
        image.to_str().unwrap(),
        "--stats",
        stats.to_str().unwrap(),
    ]);
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(stats).unwrap()).unwrap();
    assert_eq!(json["format"], 1);
    assert_eq!(json["device"]["backend"], "cpu");
    assert!(json["device"]["details"].as_str().is_some_and(|details| details.starts_with("2 threads, ")));
    assert!(json["kernel"].as_str().is_some_and(|kernel| kernel.starts_with("render")));
    assert!(
        json["features"].as_str().is_some_and(|features| features.starts_with("sobol,roulette,spheres,"))
    );
    // Only the width is given: the height follows from the scene's aspect ratio.
    assert_eq!((&json["settings"]["width"], &json["settings"]["height"]), (&32.into(), &18.into()));
    assert_eq!(json["samples"], 32 * 18 * 3);
    assert_eq!((&json["rejected_samples"], &json["unwritten_pixels"]), (&0.into(), &0.into()));
    let segments = json["segments"].as_u64().unwrap();
    assert!((32 * 18 * 3..=32 * 18 * 3 * 4).contains(&segments), "{segments}");
    assert!(json["device_seconds"].as_f64().unwrap() > 0.0);
}

#[test]
fn without_a_scene_the_hello_world_is_drawn() {
    let image = folder("hello").join("hello.png");
    let arguments = ["render", "--resolution", "48x27", "--spp", "2", "--backend", "cpu", "-o"];
    let output = trisect(&[&arguments[..], &[image.to_str().unwrap()]].concat());
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(text.contains("three_spheres.ron (built in)") && text.contains("Msamples/s"), "{text}");
    // Without a terminal there is no progress bar and no escape sequence.
    assert!(!text.contains('\u{1b}') && !text.contains('\r'), "{text:?}");
    assert!(Image::read(&image).unwrap().pixels.iter().flatten().any(|&value| value > 0.5));
}

/// The package has its own copy of the built-in scene, because a package contains only files of its
/// own folder.
#[test]
fn the_hello_world_is_that_of_the_scenes() {
    let of = |path: &str| std::fs::read(root().join(path)).unwrap();
    assert!(of("host/scene/assets/three_spheres.ron") == of("scenes/three_spheres.ron"));
}

#[test]
fn quiet_and_verbose() {
    let image = folder("verbose").join("a.png");
    let arguments =
        ["render", "--resolution", "16x9", "--spp", "2", "--backend", "cpu", "-o", image.to_str().unwrap()];
    let said = |more: &[&str]| String::from_utf8(trisect(&[&arguments[..], more].concat()).stderr).unwrap();
    let (usual, verbose) = (said(&[]), said(&["--verbose"]));
    assert!(said(&["--quiet"]).is_empty());
    assert!(usual.contains("wrote") && !usual.contains("build the BVH"), "{usual}");
    assert!(verbose.contains("kernel render") && verbose.contains("build the BVH"), "{verbose}");
    let both = trisect_tests::program::trisect(&["render", "-q", "-v"]);
    assert_eq!(both.status.code(), Some(2));
}

#[test]
fn auto_says_what_it_took() {
    let image = folder("auto").join("a.png");
    let arguments = ["render", "--resolution", "16x9", "--spp", "1", "-o"];
    let output = trisect(&[&arguments[..], &[image.to_str().unwrap()]].concat());
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(text.contains("auto: "), "{text}");
    // A software adapter is never chosen automatically.
    assert!(!text.contains("\nwgpu: llvmpipe"), "{text}");
}

#[test]
fn bench_prints_rates() {
    let scene = root().join("scenes/rtiow_final.ron");
    let arguments = ["--backend", "cpu", "--resolution", "32x18", "--spp", "2", "--frames", "2"];
    let output = trisect(&[&["bench", scene.to_str().unwrap()], &arguments[..]].concat());
    let text = String::from_utf8(output.stdout).unwrap();
    for row in ["device time, ms", "Msamples/s", "Msegments/s", "segments"] {
        assert!(text.contains(row), "{text}");
    }
}

/// The filter changes the image, the statistics name it, and the benchmark has a row for each of
/// its passes.
#[test]
fn denoise_and_its_times() {
    let folder = folder("denoise");
    let file = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let common = ["--backend=cpu", "--resolution=16x9", "--spp=1"];
    let render = |options: &[&str], out: &str| {
        let output = trisect(&[&["render"], &common[..], options, &["-q", "-o", out]].concat());
        assert!(output.status.success(), "{output:?}");
        std::fs::read(out).unwrap()
    };
    let raw = render(&[], &file("raw.pfm"));
    let stats = file("stats.json");
    let options = ["--denoise=svgf", "--denoise-levels=3", "--denoise-color=4", "--stats", &stats];
    assert_ne!(render(&options, &file("svgf.pfm")), raw);
    assert_ne!(render(&["--denoise=atrous"], &file("atrous.pfm")), raw);
    let stats: serde_json::Value = serde_json::from_slice(&std::fs::read(stats).unwrap()).unwrap();
    let denoise = &stats["denoise"];
    assert_eq!((&denoise["filter"], &denoise["levels"]), (&"svgf".into(), &3.into()), "{stats}");
    assert!(stats["denoise_seconds"].as_f64().is_some_and(|seconds| seconds > 0.0));
    let output = trisect(&[&["bench"], &common[..], &["--denoise=svgf", "--frames=2"]].concat());
    let text = String::from_utf8(output.stdout).unwrap();
    for row in
        ["trace, ms", "gather, ms", "estimate the variance, ms", "level 5, ms", "finish, ms", "frames/s"]
    {
        assert!(text.contains(row), "{row:?} in {text}");
    }
}

/// The benchmark's JSON has its values, and its table has a row for each phase; times are not
/// checked.
#[test]
fn bench_writes_json() {
    let file = folder("bench").join("bench.json");
    let arguments = ["bench", "--backend=cpu", "--threads=1", "--resolution=16x9", "--spp=2", "--frames=3"];
    let output = trisect(&[&arguments[..], &["--json", file.to_str().unwrap()]].concat());
    let text = String::from_utf8(output.stdout).unwrap();
    for row in
        ["load the scene", "build the BVH", "upload", "prepare", "first kernel", "read-back, ms", "merge, ms"]
    {
        assert!(text.contains(row), "{row:?} in {text}");
    }
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    assert_eq!((&json["format"], &json["warm_up"]), (&1.into(), &2.into()));
    assert_eq!(
        (&json["subject"]["backend"], &json["subject"]["settings"]["samples"]),
        (&"cpu".into(), &2.into())
    );
    let rows = json["rows"].as_array().unwrap();
    assert!(rows.len() == 6 && rows.iter().all(|row| row["summary"]["count"] == 3), "{json}");
    // The first submission ends after everything that happens once, before the first frame ends.
    let once = json["once"].as_object().unwrap();
    let seconds = |name: &str| once[name].as_f64().unwrap();
    let parts =
        ["load_seconds", "open_seconds", "bvh_seconds", "upload_seconds", "prepare_seconds", "view_seconds"];
    assert!(seconds("start_to_first_kernel_seconds") > parts.map(seconds).iter().sum(), "{json}");
}

#[test]
fn bench_report_draws_charts() {
    let out = folder("report");
    let scene = root().join("scenes/cornell_box.ron");
    let arguments = ["--quick", "--backend=cpu", "--resolution=8x4", "--spheres=100", "--time-limit=1"];
    let files = ["--output", out.to_str().unwrap(), scene.to_str().unwrap()];
    let output = trisect(&[&["bench", "report"], &arguments[..], &files].concat());
    let text = String::from_utf8(output.stdout).unwrap();
    for words in ["R² = ", "log2 N", "speed-up over", "against one thread, cornell_box.ron: "] {
        assert!(text.contains(words), "{words:?} in {text}");
    }
    for stem in
        ["time_against_spp", "speed_up_against_spheres", "cost_against_spheres", "device_against_one_thread"]
    {
        let png = Image::read(&out.join(format!("{stem}.png"))).unwrap();
        assert_eq!((png.width, png.height), (1920, 1120));
        let svg = std::fs::read_to_string(out.join(format!("{stem}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{svg}");
    }
    for stem in ["time_against_spp", "methods_against_spheres", "device_against_one_thread"] {
        let json = std::fs::read(out.join(format!("{stem}.json"))).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
        assert_eq!(json["conditions"]["format"], 1);
        let csv = std::fs::read_to_string(out.join(format!("{stem}.csv"))).unwrap();
        assert_eq!(csv.lines().count(), 1 + json["points"].as_array().unwrap().len(), "{csv}");
    }
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    trisect_lab::page::check(&page).unwrap_or_else(|fault| panic!("{fault}"));
    assert!(page.matches("<svg viewBox=\"0 0 960").count() == 4 && page.contains("cornell_box.ron</th>"));
    // An empty measurement is a usage error, and so is a time limit of zero.
    for wrong in [["--spheres=9"], ["--time-limit=0"]] {
        let output = Command::new(binary())
            .args([&["bench", "report"], &arguments[..3], &files[..2], &wrong].concat())
            .output();
        assert_eq!(output.unwrap().status.code(), Some(2), "{wrong:?}");
    }
}

/// A pixel with NaN or infinity is left out of the metrics, and no limit is met with it.
#[test]
fn images_with_nan_differ() {
    let folder = folder("nan");
    let write = |name: &str, first: f32| {
        let mut bytes = b"PF\n2 1\n-1.0\n".to_vec();
        bytes.extend([first, 1.0, 1.0, 1.0, 1.0, 1.0].into_iter().flat_map(f32::to_le_bytes));
        let path = folder.join(name);
        std::fs::write(&path, bytes).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let (nan, infinite, one) =
        (write("nan.pfm", f32::NAN), write("inf.pfm", f32::INFINITY), write("one.pfm", 1.0));
    let code = |a: &str, b: &str| {
        let mut compare = Command::new(binary());
        compare.args(["compare", a, b, "--max-rel-mse", "1e-3"]).output().unwrap().status.code()
    };
    for bad in [&nan, &infinite] {
        assert_eq!((code(bad, &one), code(&one, bad), code(bad, bad)), (Some(5), Some(5), Some(5)), "{bad}");
    }
    assert_eq!(code(&one, &one), Some(0));
}

/// The file name `-` writes data, and nothing else, to standard output.
#[test]
fn data_on_standard_output() {
    let folder = folder("stdout");
    let image = folder.join("a.png");
    let small = ["--backend=cpu", "--resolution=8x4", "--spp=1"];
    let json = |arguments: &[&str]| -> serde_json::Value {
        let all = [arguments, &small].concat();
        let output = Command::new(binary()).args(&all).current_dir(&folder).output().unwrap();
        assert!(output.status.success(), "{all:?}: {}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{all:?}: {error}"))
    };
    let image = image.to_str().unwrap();
    assert_eq!(json(&["render", "-o", image, "--stats", "-"])["samples"], 32);
    assert_eq!(json(&["bench", "--frames=2", "--json", "-"])["format"], 1);
    assert_eq!(json(&["view", "--headless", "--frames=2", "--json", "-"])["frames"], 1);
    assert!(!folder.join("-").exists());
    // This also holds for a resumed render, for which the statistics are asked for again.
    let checkpoint = folder.join("a.ckpt");
    let checkpoint = checkpoint.to_str().unwrap();
    json(&["render", "-o", image, "--stats", "-", "--checkpoint", checkpoint]);
    let output = trisect(&["resume", checkpoint, "--quiet", "--stats", "-"]);
    let again: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(again["format"], 1);
}
