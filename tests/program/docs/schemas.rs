//! JSON Schemas of the reports: the published files are those of the types that are written, and
//! real reports are valid by them.

use super::generated::compare;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs;
use trisect_lab::schema::schemas;
use trisect_tests::program::{Temporary, trisect};
use trisect_tests::root;

/// Folder of the published schemas.
const FOLDER: &str = "docs/reference/schemas";

#[test]
fn generated_schemas() {
    fs::create_dir_all(root().join(FOLDER)).unwrap();
    let mut wanted = BTreeSet::new();
    for (name, schema) in schemas() {
        let text = serde_json::to_string_pretty(&schema).unwrap() + "\n";
        compare(&format!("{FOLDER}/{name}.json"), &text);
        assert!(jsonschema::draft202012::meta::is_valid(schema.as_value()), "{name}");
        wanted.insert(format!("{name}.json"));
    }
    let entries = fs::read_dir(root().join(FOLDER)).unwrap();
    let found: BTreeSet<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    assert_eq!(found, wanted);
}

/// Returns a published schema.
fn published(name: &str) -> Value {
    serde_json::from_slice(&fs::read(root().join(FOLDER).join(format!("{name}.json"))).unwrap()).unwrap()
}

/// Refuses keys that a schema does not list.
fn close(schema: &mut Value) {
    match schema {
        Value::Object(map) => {
            map.values_mut().for_each(close);
            if map.contains_key("properties") && !map.contains_key("additionalProperties") {
                map.insert("additionalProperties".to_owned(), json!(false));
            }
        }
        Value::Array(values) => values.iter_mut().for_each(close),
        _ => {}
    }
}

/// Returns what is wrong with a report by a schema.
fn faults(schema: &Value, report: &Value) -> Vec<String> {
    let validator = jsonschema::draft202012::new(schema).unwrap();
    validator.iter_errors(report).map(|error| format!("{}: {error}", error.instance_path())).collect()
}

/// Checks a report by the published schema without any further key.
fn check(name: &str, report: &Value) {
    let mut schema = published(name);
    close(&mut schema);
    let faults = faults(&schema, report);
    assert!(faults.is_empty(), "{name}: {faults:#?}");
}

/// Runs the program in the folder of scenes, and returns the JSON that it prints.
fn printed(arguments: &[&str]) -> Value {
    let output = trisect(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Each report that the program writes is valid, and has no key that the schema lacks.
#[test]
fn reports_are_valid() {
    let folder = Temporary::new("schemas", "reports");
    let scene = root().join("scenes/cornell_box.ron");
    let scene = scene.to_str().unwrap();
    let small = ["--backend", "cpu", "--resolution", "16x16"];
    let cache = folder.file("cache");
    let lab = ["--knobs", "sampler,clamp,scale", "--seeds", "4", "--reference-spp", "16", "--cache", &cache];
    fs::create_dir_all(folder.path("images/a")).unwrap();
    for (file, seed) in [("images/a/1.exr", "1"), ("images/a/2.exr", "2"), ("images/reference.exr", "3")] {
        let file = folder.file(file);
        let render = ["render", scene, "--spp", "2", "--seed", seed, "-q", "--stats=-", "-o", &file];
        check("render_stats", &printed(&[&render[..], &small].concat()));
    }
    let (image, images) = (folder.file("images/a/1.exr"), folder.file("images"));
    let goal = ["render", scene, "--budget", "300ms", "--denoise", "svgf", "-q", "--stats=-", "-o", &image];
    check("render_stats", &printed(&[&goal[..], &small].concat()));
    check("compare", &printed(&["compare", &image, &folder.file("images/reference.exr"), "--json"]));
    check("evaluate", &printed(&["evaluate", &images, "--json"]));
    fs::write(folder.path("images/a/times.json"), "{\"seconds\": 1, \"processor_seconds\": 2}").unwrap();
    check("evaluate", &printed(&["evaluate", &images, "--json"]));
    let frames = ["evaluate", &folder.file("images/a"), "--reference", &folder.file("frames"), "--frames"];
    fs::create_dir_all(folder.path("frames")).unwrap();
    for (name, seed) in [("1", "4"), ("2", "5")] {
        let file = folder.file(&format!("frames/{name}.exr"));
        let render = ["render", scene, "--spp", "2", "--seed", seed, "-q", "-o", &file];
        assert!(trisect(&[&render[..], &small].concat()).status.success());
    }
    check("evaluate_frames", &printed(&[&frames[..], &["--json"]].concat()));
    check("info", &printed(&["info", "--json"]));
    // The exit code depends on the machine.
    check("doctor", &serde_json::from_slice(&trisect(&["doctor", "--json"]).stdout).unwrap());
    let view = ["view", scene, "--headless", "--frames", "2", "--json=-"];
    check("view", &printed(&[&view[..], &small].concat()));
    check("check", &printed(&["check", scene, "--json"]));
    let bench = ["bench", scene, "--spp", "1", "--frames", "2", "--json=-"];
    check("bench", &printed(&[&bench[..], &small].concat()));
    let out = folder.file("tradeoff");
    let tradeoff = ["tradeoff", scene, "--levels", "1,4", "--against", &images, "-q", "--json", "-o", &out];
    check("tradeoff", &printed(&[&tradeoff[..], &small, &lab].concat()));
    let converge = ["converge", scene, "--first", "1", "--last", "4", "--json"];
    check("converge", &printed(&[&converge[..], &small, &lab].concat()));
    let out = folder.file("report");
    let report = ["bench", "report", "--backend", "cpu", "--quick", "--resolution", "8x4", "--spheres", "10"];
    let output = trisect(&[&report[..], &["--time-limit", "1", "-o", &out]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for (name, file) in [
        ("bench_report_time", "time_against_spp"),
        ("bench_report_methods", "methods_against_spheres"),
        ("bench_report_threads", "device_against_one_thread"),
    ] {
        let file = fs::read(folder.path("report").join(format!("{file}.json"))).unwrap();
        check(name, &serde_json::from_slice(&file).unwrap());
    }
}

/// Negative control: a report without a key, with a value of another kind, or with a further key
/// that only a closed schema refuses.
#[test]
fn other_reports_are_not_valid() {
    let folder = Temporary::new("schemas", "control");
    let image = folder.file("a.pfm");
    let render = ["render", "--backend", "cpu", "--resolution", "8x8", "--spp", "1", "-q", "-o", &image];
    assert!(trisect(&render).status.success());
    let report = printed(&["compare", &image, &image, "--json"]);
    let schema = published("compare");
    assert!(faults(&schema, &report).is_empty());
    let changed = |change: &dyn Fn(&mut serde_json::Map<String, Value>)| {
        let mut report = report.clone();
        change(report.as_object_mut().unwrap());
        report
    };
    let lacking = changed(&|map| drop(map.remove("rmse")));
    let wrong = changed(&|map| drop(map.insert("rmse".to_owned(), json!("0"))));
    let further = changed(&|map| drop(map.insert("more".to_owned(), json!(0))));
    assert!(!faults(&schema, &lacking).is_empty() && !faults(&schema, &wrong).is_empty());
    assert!(faults(&schema, &further).is_empty());
    let mut closed = schema;
    close(&mut closed);
    assert!(!faults(&closed, &further).is_empty());
}
