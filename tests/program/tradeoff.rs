//! The trade-off lab as users run it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Output;
use trisect_tests::program::{folder, trisect};
use trisect_tests::root;
#[cfg(unix)]
use trisect_tests::running::{Running, program};

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

fn lab(scene: &str, folder: &Path, more: &[&str]) -> Output {
    let scene = root().join("scenes").join(scene);
    let cache = folder.join("cache");
    let out = folder.join("out");
    let fixed = [
        "tradeoff",
        scene.to_str().unwrap(),
        "--backend",
        "cpu",
        "--sampler",
        "independent",
        "--resolution",
        "48x27",
        "--levels",
        "4,16",
        "--reference-spp",
        "1024",
        "--time-limit",
        "1h",
        "--cache",
        cache.to_str().unwrap(),
        "-o",
        out.to_str().unwrap(),
    ];
    trisect(&[&fixed[..], more].concat())
}

/// Bias is found where there is some, and only there. The results are written in each format, and
/// the reference is cached.
#[test]
fn knobs_and_their_prices() {
    let folder = folder("tradeoff", "knobs");
    let knobs = ["--knobs", "sampler,roulette,adaptive,denoiser,depth,clamp,math,scale"];
    let output = lab("cornell_box.ron", &folder, &knobs);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let found = json(&folder.join("out/tradeoff.json"));
    let points = found["points"].as_array().unwrap();
    let point = |name: &str| {
        let is = |p: &&Value| {
            let of = format!("{} {}", p["knob"].as_str().unwrap(), p["level"].as_str().unwrap());
            of == name && p["spp"] == 16
        };
        points.iter().find(is).unwrap_or_else(|| panic!("{name} is missing"))
    };
    for unbiased in ["base as asked", "sampler sobol", "roulette from segment 1", "adaptive on", "clamp 16"] {
        assert_eq!(point(unbiased)["errors"]["biased"], false, "{unbiased}: {}", point(unbiased));
    }
    for biased in ["depth 2", "depth 4", "clamp 1", "denoiser svgf", "denoiser atrous", "scale 1/2"] {
        assert_eq!(point(biased)["errors"]["biased"], true, "{biased}: {}", point(biased));
    }
    // A lower depth gives a darker image, as the light of longer paths is missing.
    assert!(point("depth 2")["errors"]["brightness"]["high"].as_f64().unwrap() < 0.0);
    // The error falls with the root of the samples: relMSE at 4 and 16 samples differs by a factor
    // of 4.
    let slopes = found["slopes"].as_array().unwrap();
    let of_base = slopes.iter().find(|slope| slope["knob"] == "base").unwrap();
    let slope = of_base["over_samples"].as_f64().unwrap();
    assert!((slope + 0.5).abs() < 0.1, "{slope}");
    // On the CPU the math build is not a knob, as there is no fast build.
    assert!(points.iter().all(|point| point["knob"] != "math"));
    let page = fs::read_to_string(folder.join("out/report.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("data:image/png;base64,") && !page.contains("http-equiv"));
    assert!(!page.contains("src=\"http") && !page.contains("href="), "the page needs other files");
    let csv = fs::read_to_string(folder.join("out/tradeoff.csv")).unwrap();
    assert_eq!(csv.lines().count(), points.len() + 1);
    let columns = csv.lines().next().unwrap().split(',').count();
    assert!(csv.lines().skip(1).all(|line| line.replace(", ", " ").split(',').count() == columns));
    for chart in ["error_over_time", "front"] {
        assert!(
            folder.join(format!("out/{chart}.svg")).exists()
                && folder.join(format!("out/{chart}.png")).exists()
        );
    }

    // A second run uses the cached reference. A damaged one is not used.
    let few = ["--knobs", "sampler", "--seeds", "4"];
    let again = lab("cornell_box.ron", &folder, &few);
    assert!(text(&again.stderr).contains("reference: kept in"), "{}", text(&again.stderr));
    let kept = fs::read_dir(folder.join("cache")).unwrap().next().unwrap().unwrap().path();
    let mut bytes = fs::read(&kept).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&kept, &bytes).unwrap();
    let repaired = lab("cornell_box.ron", &folder, &few);
    let said = text(&repaired.stderr);
    assert!(repaired.status.success() && said.contains("warning") && said.contains("checksum"), "{said}");
    assert_ne!(fs::read(&kept).unwrap(), bytes);
    fs::write(&kept, &bytes[..40]).unwrap();
    assert!(text(&lab("cornell_box.ron", &folder, &few).stderr).contains("truncated"));
    fs::remove_dir_all(folder).unwrap();
}

/// Invalid requests are refused with the reason.
#[test]
fn mistakes_are_named() {
    let folder = folder("tradeoff", "mistakes");
    for (more, want) in
        [(["--knobs", "nonsense"], "unknown knob nonsense"), (["--seeds", "2"], "--seeds is 2")]
    {
        let output = lab("three_spheres.ron", &folder, &more);
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output.stderr).contains(want), "{}", text(&output.stderr));
    }
    for bad in [["--target-error", "0%"], ["--budget", "soon"], ["--quality", "best"], ["--clamp", "-1"]] {
        let output = trisect(&[&["render"], &bad[..]].concat());
        assert_eq!(output.status.code(), Some(2), "{bad:?}: {}", text(&output.stderr));
    }
    let both = trisect(&["render", "--budget", "1s", "--spp", "4"]);
    assert_eq!(both.status.code(), Some(2));
    fs::remove_dir_all(folder).unwrap();
}

/// With a time limit of zero, the report is written and lists what is missing.
#[test]
fn no_time_at_all() {
    let folder = folder("tradeoff", "no-time");
    let scene = root().join("scenes/three_spheres.ron");
    let (cache, out) = (folder.join("cache"), folder.join("out"));
    let (scene, cache, out) = (scene.to_str().unwrap(), cache.to_str().unwrap(), out.to_str().unwrap());
    let fixed = ["--backend", "cpu", "--resolution", "16x9", "--cache", cache, "--time-limit", "0s"];
    let all = [&["tradeoff", scene, "-o", out, "--knobs", "sampler,depth"], &fixed[..]].concat();
    let output = trisect(&all);
    assert_eq!(output.status.code(), Some(7), "{}", text(&output.stderr));
    let said = text(&output.stdout);
    for name in ["base as asked", "sampler independent", "depth 2"] {
        let line = format!("not measured: {name}: 1, 4, 16 samples a pixel; ended by the time limit");
        assert!(said.contains(&line), "{said}");
    }
    let found = json(&folder.join("out/tradeoff.json"));
    assert!(found["ended"] == "out_of_time" && found["points"].as_array().unwrap().is_empty());
    assert!(fs::read_to_string(folder.join("out/report.html")).unwrap().contains("ended by the time limit"));
    // An empty result does not replace an earlier one.
    fs::write(folder.join("out/tradeoff.json"), "earlier").unwrap();
    let again = trisect(&all);
    assert!(again.status.code() == Some(7) && text(&again.stderr).contains("is unchanged"));
    assert_eq!(fs::read_to_string(folder.join("out/tradeoff.json")).unwrap(), "earlier");

    let output = trisect(&[&["converge", scene, "--knobs", "sampler", "--json"], &fixed[..]].concat());
    assert_eq!(output.status.code(), Some(7), "{}", text(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(found["ended"] == "out_of_time" && found["reference"].is_null(), "{found}");
    let missing = found["missing"].as_array().unwrap();
    assert!(missing.len() == 2 && missing[1]["reason"].as_str().unwrap().contains("2048, 4096"), "{found}");
    fs::remove_dir_all(folder).unwrap();
}

/// An interrupt of a run that would take days writes what was measured.
#[test]
#[cfg(unix)]
fn an_interrupt_keeps_what_was_measured() {
    let folder = folder("tradeoff", "interrupted");
    let scene = root().join("scenes/three_spheres.ron");
    let (cache, out) = (folder.join("cache"), folder.join("out"));
    let mut running = Running::start(&mut program(&[
        "tradeoff",
        scene.to_str().unwrap(),
        "--backend",
        "cpu",
        "--resolution",
        "16x9",
        "--knobs",
        "depth",
        "--levels",
        "1,4000000000",
        "--reference-spp",
        "64",
        "--seeds",
        "4",
        "--time-limit",
        "100h",
        "--cache",
        cache.to_str().unwrap(),
        "-o",
        out.to_str().unwrap(),
    ]));
    running.until("base, 1 spp");
    running.signal("INT");
    let output = running.end();
    assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
    let found = json(&out.join("tradeoff.json"));
    assert_eq!(found["ended"], "interrupted", "{found}");
    assert!(found["points"].as_array().unwrap().iter().any(|point| point["knob"] == "base"), "{found}");
    let missing = found["missing"].to_string();
    assert!(missing.contains("4000000000 samples a pixel; ended by an interrupt"), "{missing}");
    fs::remove_dir_all(folder).unwrap();
}

/// Torture test 43 by `converge`: unbiased settings have slope -1/2 over 2^4 to 2^9 samples; the
/// error of a biased one reaches a plateau.
#[test]
fn courses_of_error() {
    let folder = folder("tradeoff", "courses");
    let (cache, out) = (folder.join("cache"), folder.join("courses.json"));
    for scene in ["rtiow_final.ron", "cornell_box.ron"] {
        let scene = root().join("scenes").join(scene);
        let output = trisect(&[
            "converge",
            scene.to_str().unwrap(),
            "--backend",
            "cpu",
            "--sampler",
            "independent",
            "--resolution",
            "32x18",
            "--knobs",
            "sampler,roulette,depth",
            "--last",
            "512",
            "--time-limit",
            "1h",
            "--cache",
            cache.to_str().unwrap(),
            "-o",
            out.to_str().unwrap(),
        ]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let found = json(&out);
        for course in found["courses"].as_array().unwrap() {
            let (mode, slope) =
                (course["mode"].as_str().unwrap(), course["slope"]["value"].as_f64().unwrap());
            let at = |end: &str| course["slope"][end].as_f64().unwrap();
            // The small lamp makes the slope of the Cornell box uncertain by a tenth.
            let near = at("low") <= -0.45 && at("high") >= -0.55 && at("high") - at("low") < 0.25;
            eprintln!("{mode}: {slope} ({} to {})", at("low"), at("high"));
            match mode {
                "base" | "roulette from segment 1" | "roulette from segment 4" => {
                    assert!(near && course["plateau"].is_null(), "{course}");
                }
                "sampler sobol" => assert!(at("low") < -0.45 && course["plateau"].is_null(), "{course}"),
                // Negative control: samples do not bring back the light of longer paths.
                "depth 2" => assert!(slope > -0.2 && course["plateau"].as_f64().unwrap() > 0.05, "{course}"),
                _ => {}
            }
        }
        let pair = |with: &str| {
            let pairs = found["pairs"].as_array().unwrap();
            let is = |pair: &&Value| pair["modes"][0] == "base" && pair["modes"][1] == with;
            pairs.iter().find(is).unwrap()["differ"].as_bool().unwrap()
        };
        assert!(!pair("sampler sobol") && !pair("roulette from segment 1") && pair("depth 2"));
    }
    fs::remove_dir_all(folder).unwrap();
}
