//! Findings that concern almost nothing of a scene are notes, and the scene's own space is not
//! suggested as a remedy.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use trisect_tests::program::{Temporary, trisect};

/// Returns an OBJ file: a hilly grid of 2 · 64² triangles, and `slivers` more that are almost
/// lines.
fn model(slivers: usize) -> String {
    let mut text = String::new();
    for row in 0..=64 {
        for column in 0..=64 {
            let (x, z) = (f64::from(column) / 32.0 - 1.0, f64::from(row) / 32.0 - 1.0);
            let _ = writeln!(text, "v {:?} {:?} {:?}", x, 0.2 * (3.0 * x).sin() * (2.0 * z).cos(), z);
        }
    }
    let vertex = |row: u32, column: u32| 65 * row + column + 1;
    for (row, column) in (0..64).flat_map(|row| (0..64).map(move |column| (row, column))) {
        let [a, b] = [vertex(row, column), vertex(row, column + 1)];
        let _ = writeln!(text, "f {a} {} {b}\nf {b} {} {}", a + 65, a + 65, b + 65);
    }
    for sliver in 0..slivers {
        let z = 1.1 + 0.01 * sliver as f64;
        let _ = writeln!(text, "v -1 0 {z}\nv 1 0 {z}\nv 0 1e-6 {z}\nf -3 -2 -1");
    }
    text
}

fn check(path: &Path) -> (Option<i32>, serde_json::Value, String) {
    let path = path.to_str().unwrap();
    let json = trisect(&["check", path, "--json"]);
    let text = trisect(&["check", path]);
    assert_eq!(json.status.code(), text.status.code());
    let json = serde_json::from_slice(&json.stdout).unwrap();
    (text.status.code(), json, String::from_utf8(text.stdout).unwrap())
}

#[test]
fn a_few_slivers_are_notes() {
    let folder = Temporary::new("limits", "notes");
    let path = folder.path("hills.obj");
    fs::write(&path, model(2)).unwrap();
    let (code, json, text) = check(&path);
    assert_eq!(code, Some(0), "{text}");
    let finding = &json["findings"][0];
    assert_eq!(
        (&finding["severity"], &finding["triangles"]["outside"]),
        (&"note".into(), &2.into()),
        "{json}"
    );
    assert_eq!(finding["triangles"]["of"], 8194);
    assert!(text.contains("note: small for its distance") && text.contains("but for notes"), "{text}");
    // No other place is better for them, so no remedy is suggested.
    assert!(!text.contains("check --write") && text.contains("no other `space` helps"), "{text}");
    // A render does not warn of notes.
    let image = folder.file("a.png");
    let arguments =
        ["render", path.to_str().unwrap(), "--backend", "cpu", "--resolution", "8x4", "--spp", "1"];
    let output = trisect(&[&arguments[..], &["-q", "-o", &image]].concat());
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && !said.contains("distance from the origin"), "{said}");

    // Negative controls: slivers that are more than a thousandth of the triangles, and a whole
    // model that another space mends.
    fs::write(&path, model(10)).unwrap();
    let (code, json, text) = check(&path);
    assert_eq!((code, &json["findings"][0]["severity"]), (Some(6), &"warning".into()), "{text}");
    assert!(!text.contains("check --write") && !text.contains("but for notes"), "{text}");
    fs::write(&path, model(2)).unwrap();
    let (far, copy) = (folder.path("far.ron"), folder.path("mended.ron"));
    let scene = "Scene(version: 1, image: (width: 8, height: 8), camera: (look_from: (1e6, 2, 3), look_at: (1e6, 0, 0), \
                 vertical_fov: 40), materials: {}, objects: [Mesh(file: \"hills.obj\", transform: [Translate((1e6, 0, 0))])])";
    fs::write(&far, scene).unwrap();
    let (code, json, text) = check(&far);
    assert_eq!((code, &json["findings"][0]["severity"]), (Some(6), &"warning".into()), "{text}");
    assert!(text.contains("check --write"), "{text}");
    let wrote = trisect(&["check", far.to_str().unwrap(), "--write", copy.to_str().unwrap()]);
    assert_eq!(wrote.status.code(), Some(6));
    let (code, json, text) = check(&copy);
    assert_eq!((code, &json["findings"][0]["severity"]), (Some(0), &"note".into()), "{text}");
    assert!(text.contains("best space    this one"), "{text}");
}

/// Two triangles among many are more than a note if they are most of the visible area.
#[test]
fn a_floor_of_two_triangles_is_no_note() {
    let folder = Temporary::new("limits", "floor");
    let path = folder.path("floor.obj");
    // A long floor, so far away that its width is rounded.
    let floor = "v 1e6 0 -1e5\nv 1000001 0 -1e5\nv 1000001 0 1e5\nv 1e6 0 1e5\nf -4 -3 -2\nf -4 -2 -1\n";
    fs::write(&path, model(0) + floor).unwrap();
    let (code, json, text) = check(&path);
    assert_eq!((code, &json["findings"][0]["triangles"]["outside"]), (Some(6), &2.into()), "{text}");
}
