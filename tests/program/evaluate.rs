//! `trisect evaluate` as users run it, on images that the program renders.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use serde_json::Value;
use std::fs;
use trisect_tests::program::{Temporary, check_failure, trisect};
use trisect_tests::root;

/// Renders images of a configuration of the Cornell box into a folder.
fn render(folder: &Temporary, name: &str, seeds: std::ops::Range<u32>, options: &[&str]) {
    fs::create_dir_all(folder.path(name)).unwrap();
    let scene = root().join("scenes/cornell_box.ron");
    for seed in seeds {
        let (file, seed) = (folder.file(&format!("{name}/{seed}.exr")), seed.to_string());
        let fixed = ["render", scene.to_str().unwrap(), "--backend", "cpu", "--resolution", "48x48", "-q"];
        let own = ["--sampler", "independent", "--seed", &seed, "-o", &file];
        let output = trisect(&[&fixed[..], &own, options].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}

fn row<'a>(found: &'a Value, name: &str) -> &'a Value {
    let rows = found["rows"].as_array().unwrap();
    rows.iter().find(|row| row["name"] == name).unwrap_or_else(|| panic!("{name}: no row"))
}

/// Paths that are too short are found as a bias, and others are not; the results are printed as a
/// table and as JSON.
#[test]
fn noise_and_bias_of_two_configurations() {
    let folder = Temporary::new("evaluate", "two");
    render(&folder, "images/all", 1..9, &["--spp", "16"]);
    render(&folder, "images/short", 1..9, &["--spp", "16", "--depth", "3"]);
    render(&folder, "images/reference", 100..104, &["--spp", "256"]);
    fs::write(folder.path("images/all/times.json"), "{\"seconds\": 0.5}").unwrap();
    let (images, json) = (folder.file("images"), folder.file("found.json"));
    let output = trisect(&["evaluate", &images, "--json", &json]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(
        table.starts_with("reference: 4 images, own error ") && table.contains("no bias seen"),
        "{table}"
    );
    let found: Value = serde_json::from_slice(&fs::read(&json).unwrap()).unwrap();
    let (all, short) = (row(&found, "all"), row(&found, "short"));
    assert_eq!((&all["errors"]["biased"], &short["errors"]["biased"]), (&false.into(), &true.into()));
    assert!(short["errors"]["brightness"]["high"].as_f64().unwrap() < 0.0, "{short}");
    assert_eq!(all["seconds"]["median"], 0.5);
    assert!(short["seconds"].is_null() && short["efficiency"].is_null());
    // The same noise by another way: that of the difference of two images.
    let compared =
        trisect(&["compare", &folder.file("images/all/1.exr"), &folder.file("images/all/2.exr"), "--json"]);
    let compared: Value = serde_json::from_slice(&compared.stdout).unwrap();
    let twice = compared["rmse"].as_f64().unwrap().powi(2);
    let noise = all["errors"]["rmse"]["value"].as_f64().unwrap().powi(2);
    assert!((0.25..4.0).contains(&(twice / 2.0 / noise)), "{twice} {noise}");
    // A reference of one image, and a single configuration.
    let (one, file) = (folder.file("images/all"), folder.file("images/reference/100.exr"));
    let output = trisect(&["evaluate", &one, "--reference", &file]);
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(
        table.contains("one image, whose own noise is unknown") && table.contains("difference"),
        "{table}"
    );
    // Negative control: a reference of too short paths makes the others biased.
    let output = trisect(&["evaluate", &one, "--reference", &folder.file("images/short"), "--json"]);
    let wrong: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(row(&wrong, "all")["errors"]["biased"], true);
}

/// Images that cannot be evaluated are named, with a remedy in the words of the program.
#[test]
fn what_cannot_be_evaluated() {
    let folder = Temporary::new("evaluate", "bad");
    render(&folder, "images/a", 1..3, &["--spp", "1"]);
    let images = folder.file("images");
    let fails = |more: &[&str], code: i32, words: &[&str]| {
        let arguments = [&["evaluate", &images[..]], more].concat();
        check_failure(&trisect(&arguments), &arguments, code, words);
    };
    fails(&[], 2, &["no reference; name one by --reference"]);
    let own = folder.file("images/a/1.exr");
    fails(&["--reference", &own], 1, &["images/a", "1 of at least 2 images"]);
    let nosuch = folder.file("nosuch.exr");
    fails(&["--reference", &nosuch], 1, &["nosuch.exr"]);
    render(&folder, "images/reference", 5..6, &["--spp", "1"]);
    fails(&[&format!("--json={own}")], 2, &["1.exr", "--json would overwrite an image"]);
    let times = folder.path("images/a/times.json");
    fs::write(&times, "{\"seconds\": [1, 2]}").unwrap();
    assert!(trisect(&["evaluate", &images]).status.success());
    fs::write(&times, "{\"seconds\": [1, 2, 3]}").unwrap();
    fails(&[], 1, &["times.json", "3 times for 2 images", "write {\"seconds\""]);
}

/// Noise with other random numbers in each frame flickers; noise of one seed stands still.
#[test]
fn frames_flicker() {
    let folder = Temporary::new("evaluate", "frames");
    render(&folder, "images/own", 1..6, &["--spp", "4"]);
    render(&folder, "images/one", 1..2, &["--spp", "4"]);
    render(&folder, "reference", 100..105, &["--spp", "256"]);
    for frame in 2..6 {
        fs::copy(folder.path("images/one/1.exr"), folder.path(&format!("images/one/{frame}.exr"))).unwrap();
    }
    let (images, reference) = (folder.file("images"), folder.file("reference"));
    let arguments = ["evaluate", &images, "--reference", &reference, "--frames"];
    let found: Value =
        serde_json::from_slice(&trisect(&[&arguments[..], &["--json"]].concat()).stdout).unwrap();
    let ratio = |name: &str| row(&found, name)["flicker_ratio"].as_f64().unwrap();
    assert!((ratio("own") - 1.0).abs() < 0.25, "{}", ratio("own"));
    assert!(ratio("one") < 0.1, "{}", ratio("one"));
    let table = String::from_utf8(trisect(&arguments).stdout).unwrap();
    assert!(table.starts_with("configuration  frames") && table.contains("flicker"), "{table}");
    fs::remove_file(folder.path("reference/104.exr")).unwrap();
    check_failure(&trisect(&arguments), &arguments, 1, &["one: 5 frames, but the reference has 4"]);
}
