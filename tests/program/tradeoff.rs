//! The trade-off lab as users run it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Output;
use std::time::Instant;
use trisect_lab::page::check;
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

/// Returns the last column of a point's row.
fn verdict(csv: &str, point: &Value) -> String {
    let (knob, level) = (point["knob"].as_str().unwrap(), point["level"].as_str().unwrap());
    let start = format!("{knob},\"{level}\",{},", point["spp"]);
    let row = csv.lines().find(|row| row.starts_with(&start)).unwrap_or_else(|| panic!("{start}"));
    row.rsplit(',').next().unwrap().to_owned()
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
    check(&page).unwrap_or_else(|fault| panic!("{fault}"));
    assert!(page.contains("<svg") && page.contains("data:image/png;base64,"));
    // It says first what to use, with commands that render it.
    let lead = page.find("class=\"lead\">For this scene use ").expect("no advice");
    assert!(lead < page.find("<svg").unwrap());
    let recommended = found["recommended"].as_array().unwrap();
    let purposes: Vec<&str> = recommended.iter().map(|of| of["purpose"].as_str().unwrap()).collect();
    assert_eq!(purposes, ["fast", "balanced", "best"]);
    for of in recommended {
        let is_it = |p: &&Value| ["knob", "level", "spp"].iter().all(|key| p[key] == of[key]);
        let point = points.iter().find(is_it).unwrap();
        let command = point["command"].as_str().unwrap();
        assert!(text(&output.stdout).contains(command), "{command}");
        let image = folder.join("advice.png");
        let words: Vec<&str> = command.split(' ').skip(1).collect();
        let rendered = trisect(&[&words[..], &["-q", "-o", image.to_str().unwrap()]].concat());
        assert!(rendered.status.success() && image.exists(), "{command}: {rendered:?}");
    }
    // No point with a large error is called better, and none without a bias biased.
    let csv = fs::read_to_string(folder.join("out/tradeoff.csv")).unwrap();
    for point in points {
        let rel_mse = point["errors"]["rel_mse"]["value"].as_f64().unwrap();
        let verdict = verdict(&csv, point);
        assert!(rel_mse <= 0.25 || verdict != "better", "{point}");
        let intervals = ["squared_bias", "brightness"].map(|key| {
            let of = &point["errors"][key];
            (of["low"].as_f64().unwrap(), of["high"].as_f64().unwrap())
        });
        let known = intervals[0].0 > 0.0 || intervals[1].0 > 0.0 || intervals[1].1 < 0.0;
        assert!(known || verdict != "biased", "{point}");
    }
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
    for (more, want) in [
        (["--knobs", "nonsense"], "unknown knob \"nonsense\" in --knobs"),
        (["--seeds", "2"], "--seeds is 2"),
    ] {
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

/// With a time limit too short for anything, the report is written and lists what is missing.
#[test]
fn no_time_at_all() {
    let folder = folder("tradeoff", "no-time");
    let scene = root().join("scenes/three_spheres.ron");
    let (cache, out) = (folder.join("cache"), folder.join("out"));
    let (scene, cache, out) = (scene.to_str().unwrap(), cache.to_str().unwrap(), out.to_str().unwrap());
    let fixed = ["--backend", "cpu", "--resolution", "16x9", "--cache", cache, "--time-limit", "1ms"];
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

/// The whole measurement ends within 10 % of its limit, and by what the machine's load adds: of a
/// scene whose first samples alone take longer than the reference's share.
#[test]
fn the_time_limit_holds() {
    let folder = folder("tradeoff", "limit");
    let scene = root().join("scenes/cornell_smoke.ron");
    let (cache, out) = (folder.join("cache"), folder.join("out"));
    let run = |limit: f64, resolution: &str| {
        let start = Instant::now();
        let limit = format!("{limit}s");
        let output = trisect(&[
            "tradeoff",
            scene.to_str().unwrap(),
            "--backend=cpu",
            "--resolution",
            resolution,
            "--time-limit",
            &limit,
            "--cache",
            cache.to_str().unwrap(),
            "-o",
            out.to_str().unwrap(),
        ]);
        assert_eq!(output.status.code(), Some(7), "{}", text(&output.stderr));
        start.elapsed().as_secs_f64()
    };
    for (limit, resolution) in [(5.0, "64x64"), (5.0, "1600x1600")] {
        let took = run(limit, resolution);
        // Starting the program and a submission that the system delays take longer than 10 % of a
        // limit as short as this.
        assert!(took < 1.1 * limit + 1.5, "{resolution}: {took} s");
        let found = json(&out.join("tradeoff.json"));
        assert!(found["seconds"].as_f64().unwrap() < 1.1 * limit + 1.0, "{resolution}");
    }
    fs::remove_dir_all(folder).unwrap();
}

/// A scene's own size is reduced where the time is too short for it, and the page says so.
#[test]
fn short_measurements_have_small_images() {
    let folder = folder("tradeoff", "reduced");
    let scene = root().join("scenes/cornell_box.ron");
    let (cache, out) = (folder.join("cache"), folder.join("out"));
    let (scene, cache, out) = (scene.to_str().unwrap(), cache.to_str().unwrap(), out.to_str().unwrap());
    let output = trisect(&[
        "tradeoff",
        scene,
        "--backend=cpu",
        "--threads=2",
        "--time-limit=4s",
        "--cache",
        cache,
        "-o",
        out,
    ]);
    let found = json(&folder.join("out/tradeoff.json"));
    let (width, reduction) = (found["width"].as_u64().unwrap(), found["reduction"].as_u64().unwrap());
    assert!(reduction > 1 && width == 512u64.div_ceil(reduction), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains(&format!("1/{reduction} of the size, to fit the time")));
    let page = fs::read_to_string(folder.join("out/report.html")).unwrap();
    assert!(page.contains(&format!("1/{reduction} of the size: the commands take about")));
    assert!(!found["points"][0]["command"].as_str().unwrap().contains("--resolution"));
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
