//! Tests of folders of images, and of what is wrong with them.

use super::super::{EvaluateError, Evaluation, ImageFolder};
use super::{SIZE, image_of};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use trisect::image::Image;

/// Writes images of a configuration.
fn write(folder: &Path, first: u32, count: u32, noise: f64) {
    fs::create_dir_all(folder).unwrap();
    for seed in 0..count {
        image_of(first + seed, noise, 1.0, 1).save(folder.join(format!("{seed}.pfm"))).unwrap();
    }
}

/// Returns a folder with two configurations and a reference.
fn example() -> (TempDir, PathBuf) {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path().join("images");
    write(&folder.join("a"), 10, 4, 0.2);
    write(&folder.join("b"), 20, 3, 0.1);
    write(&folder.join("reference"), 30, 4, 0.02);
    (temporary, folder)
}

fn evaluate_folder(folder: &Path, reference: Option<&Path>) -> Result<Evaluation, EvaluateError> {
    ImageFolder::open(folder, reference)?.evaluate()
}

fn message(result: Result<Evaluation, EvaluateError>) -> String {
    result.unwrap_err().to_string()
}

/// A folder has a row for each of its folders, or one for its images, in all formats of radiance.
#[test]
fn folders_and_files() {
    let (_temporary, folder) = example();
    fs::write(folder.join("a/times.json"), "{\"seconds\": [1, 2, 2, 3], \"processor_seconds\": 7}").unwrap();
    fs::write(folder.join("a/notes.txt"), "ignored").unwrap();
    fs::create_dir(folder.join(".hidden")).unwrap();
    let found = evaluate_folder(&folder, None).unwrap();
    let names: Vec<&str> = found.rows.iter().map(|row| &row.name[..]).collect();
    assert_eq!(names, ["a", "b"]);
    assert_eq!((found.reference.images, found.width, found.rows[1].errors.seeds), (4, SIZE, 3));
    let (a, b) = (&found.rows[0], &found.rows[1]);
    assert_eq!((a.seconds.unwrap().median, a.processor_seconds.unwrap().median), (2.0, 7.0));
    assert!(b.seconds.is_none() && a.errors.variance.low > b.errors.variance.high);
    let back: Evaluation = serde_json::from_str(&found.json().unwrap()).unwrap();
    assert_eq!(back, found);
    // One configuration, whose reference lies beside it, and another file as reference.
    let one = folder.join("a");
    let same = evaluate_folder(&one, Some(&folder.join("reference"))).unwrap();
    assert_eq!(same.rows, found.rows[..1]);
    fs::copy(folder.join("reference/0.pfm"), one.join("reference.pfm")).unwrap();
    let file = evaluate_folder(&one, None).unwrap();
    assert_eq!((file.reference.images, file.reference.error, file.rows[0].errors.seeds), (1, None, 4));
    for name in ["exr", "hdr"] {
        let image = Image::read(&one.join("3.pfm")).unwrap();
        fs::remove_file(one.join("3.pfm")).or_else(|_| fs::remove_file(one.join("3.exr"))).unwrap();
        image.save(one.join(format!("3.{name}"))).unwrap();
        assert_eq!(evaluate_folder(&one, None).unwrap().rows[0].errors.seeds, 4, "{name}");
        image.save(one.join("3.pfm")).unwrap();
        fs::remove_file(one.join(format!("3.{name}"))).unwrap();
    }
}

#[test]
fn images_that_do_not_fit() {
    let (_temporary, folder) = example();
    let bad = |name: &str, image: Image| {
        let path = folder.join("a").join(name);
        image.save(&path).unwrap();
        let said = message(evaluate_folder(&folder, None));
        fs::remove_file(&path).unwrap();
        assert!(said.contains(name), "{said}");
        said
    };
    let mut wide = image_of(50, 0.1, 1.0, 1);
    (wide.width, wide.height) = (2 * SIZE, SIZE / 2);
    let said = bad("wide.pfm", wide);
    assert!(said.contains("64x16 pixels, but") && said.contains("0.pfm has 32x32"), "{said}");
    let mut nan = image_of(51, 0.1, 1.0, 1);
    (nan.pixels[70][1], nan.pixels[900][0]) = (f32::NAN, f32::INFINITY);
    let said = bad("nan.pfm", nan);
    assert!(
        said.contains("NaN or infinite in 2 of its pixels, the first at (6, 2); render it again"),
        "{said}"
    );
    let said = bad("twice.pfm", image_of(11, 0.2, 1.0, 1));
    assert!(said.contains("equal to") && said.contains("1.pfm") && said.contains("seed"), "{said}");
    fs::write(folder.join("a/broken.pfm"), "PF\n").unwrap();
    let said = message(evaluate_folder(&folder, None));
    assert!(said.contains("broken.pfm"), "{said}");
}

#[test]
fn folders_that_lack_something() {
    let (_temporary, folder) = example();
    let said = message(evaluate_folder(&folder.join("nosuch"), None));
    assert!(said.contains("nosuch"), "{said}");
    let said = message(evaluate_folder(&folder, Some(&folder.join("nosuch.pfm"))));
    assert!(said.contains("nosuch.pfm"), "{said}");
    let said = message(evaluate_folder(&folder.join("a"), None));
    assert!(said.contains("no reference; name one by `reference`"), "{said}");
    let display = folder.join("display.png");
    image_of(40, 0.1, 1.0, 1).save(&display).unwrap();
    let said = message(evaluate_folder(&folder, Some(&display)));
    assert!(said.contains("display.png: an image for a display"), "{said}");
    fs::create_dir(folder.join("empty")).unwrap();
    let said = message(evaluate_folder(&folder, None));
    assert!(said.contains("empty: no images; each configuration is a folder"), "{said}");
    fs::remove_dir(folder.join("empty")).unwrap();
    let said = message(evaluate_folder(&folder.join("a"), Some(&folder.join("a"))));
    assert!(said.contains("a/0.pfm: equal to") && said.contains("seed of its own"), "{said}");
    fs::remove_file(folder.join("b/0.pfm")).unwrap();
    fs::remove_file(folder.join("b/1.pfm")).unwrap();
    let said = message(evaluate_folder(&folder, None));
    assert!(said.contains("b: 1 of at least 2 images; render more"), "{said}");
    image_of(60, 0.1, 1.0, 1).save(folder.join("loose.pfm")).unwrap();
    let said = message(evaluate_folder(&folder, None));
    assert!(said.contains("has images and folders") && said.contains("move the images"), "{said}");
}

#[test]
fn times_that_cannot_be_used() {
    let (_temporary, folder) = example();
    let times = folder.join("b/times.json");
    for (text, part) in [
        ("", "EOF"),
        ("3", "invalid type"),
        ("{}", "neither `seconds` nor"),
        ("{\"second\": 1}", "unknown field"),
        ("{\"seconds\": \"1\"}", "did not match"),
        ("{\"seconds\": []}", "seconds is a list of 0 times"),
        ("{\"seconds\": [1]}", "seconds is a list of 1 times"),
        ("{\"seconds\": [1, 2]}", "seconds has 2 times for 3 images"),
        ("{\"seconds\": [1, 0, 1]}", "seconds has 0, which is no positive time"),
        ("{\"seconds\": 1, \"processor_seconds\": -1}", "processor_seconds has -1"),
    ] {
        fs::write(&times, text).unwrap();
        let said = message(evaluate_folder(&folder, None));
        assert!(said.contains("times.json") && said.contains(part), "{text}: {said}");
        assert!(said.contains("write {\"seconds\": [1.5, 1.6]}"), "{said}");
    }
    // Negative control: the same folder with times of the right form.
    fs::write(&times, "{\"seconds\": [1, 2, 3]}").unwrap();
    assert!(evaluate_folder(&folder, None).is_ok());
}
