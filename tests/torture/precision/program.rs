//! `trisect check`, and the warnings of `trisect render`.

use std::fs;
use std::path::Path;
use trisect::image::Image;
use trisect_tests::program::{check_failure, fails, folder, trisect};
use trisect_tests::root;

const FAR: &str = "// A sphere far away.
Scene(
    version: 1, /* ( */
    image: (width: 16, height: 16, samples: 2, depth: 4), // small
    camera: (look_from: (1000000, 0, 3), look_at: (1000000, 0, 0), vertical_fov: 40),
    sky: Gradient(bottom: (1, 1, 1), top: (0.5, 0.7, 1)),
    materials: { \"a\": Lambertian(albedo: (0.5, 0.5, 0.5)) },
    objects: [
        Sphere(center: (1000000, 0, 0), radius: 1, material: \"a\"),
        Sphere(center: (1000000, 1, 0), radius: 0.5, material: \"a\"),
    ],
)
";

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn findings_have_a_code_and_a_remedy() {
    let folder = folder("limits", "check");
    let scene = folder.join("far.ron");
    fs::write(&scene, FAR).unwrap();
    let output = trisect(&["check", text(&scene)]);
    let said = String::from_utf8(output.stdout.clone()).unwrap();
    assert_eq!(output.status.code(), Some(6), "{output:?}");
    for words in
        ["objects[0]", "objects[1]", "distance from the origin", "predicted: an error of 6.0e-2", "remedy: "]
    {
        assert!(said.contains(words), "{words}: {said}");
    }
    let json = trisect(&["check", text(&scene), "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!((&json["format"], json["findings"].as_array().unwrap().len()), (&1.into(), 2));
    assert_eq!(json["findings"][0]["limit"], "far-from-origin");
    assert_eq!(json["best_space"]["origin"][0], 1e6);
    let good = trisect(&["check", text(&root().join("scenes/three_spheres.ron"))]);
    assert_eq!(good.status.code(), Some(0));
    assert!(String::from_utf8(good.stdout).unwrap().contains("nothing outside the supported range"));
    // An emitter of 1e30 is refused as a scene.
    let bright = folder.join("bright.ron");
    fs::write(
        &bright,
        FAR.replace("Lambertian(albedo: (0.5, 0.5, 0.5))", "Emissive(radiance: (1e30, 0, 0))"),
    )
    .unwrap();
    fails(&["check", text(&bright)], 4, &["bright.ron:7:", "at most 1e18"]);
    fs::write(&bright, FAR.replace("samples: 2", "samples: 4294967296")).unwrap();
    fails(&["check", text(&bright)], 4, &["bright.ron:4:"]);
    fails(&["check", text(&folder.join("none.ron"))], 4, &["none.ron"]);
}

#[test]
fn a_copy_in_the_best_space_keeps_all_else() {
    let folder = folder("limits", "write");
    let (scene, copy) = (folder.join("far.ron"), folder.join("near.ron"));
    fs::write(&scene, FAR).unwrap();
    let output = trisect(&["check", text(&scene), "--write", text(&copy)]);
    assert_eq!(output.status.code(), Some(6), "{output:?}");
    let written = fs::read_to_string(&copy).unwrap();
    let space = "\n    space: (origin: (1000000.0, 0.25, 0.0), scale: 1.0),";
    assert_eq!(written.replace(space, ""), FAR);
    assert_eq!(trisect(&["check", text(&copy)]).status.code(), Some(0));
    // Once more: an existing space is replaced by the same one.
    let again = folder.join("again.ron");
    trisect(&["check", text(&copy), "--write", text(&again)]);
    assert_eq!(fs::read_to_string(&again).unwrap(), written);

    let render = |scene: &Path, image: &str| {
        let image = folder.join(image);
        let output = trisect(&["render", text(scene), "--backend", "cpu", "--quiet", "-o", text(&image)]);
        assert!(output.status.success(), "{output:?}");
        (Image::read(&image).unwrap().pixels, String::from_utf8(output.stderr).unwrap())
    };
    // One warning for both spheres. The copy has none, and its image is that of the scene at the
    // origin.
    let (far, warned) = render(&scene, "far.pfm");
    assert_eq!(warned.lines().filter(|line| line.starts_with("warning: ")).count(), 1, "{warned}");
    assert!(
        warned.contains("and 1 more") && warned.contains("trisect check ") && warned.contains("far.ron"),
        "{warned}"
    );
    let origin = folder.join("origin.ron");
    fs::write(
        &origin,
        FAR.replace("1000000", "0").replace("version: 1,", "version: 1, space: (origin: (0, 0.25, 0)),"),
    )
    .unwrap();
    let (near, silent) = render(&copy, "near.pfm");
    let (want, _) = render(&origin, "origin.pfm");
    assert_eq!((silent.as_str(), near == want, far == want), ("", true, false));
}

#[test]
fn a_copy_must_not_lose_its_files() {
    let folder = folder("limits", "files");
    let elsewhere = folder.join("elsewhere");
    fs::create_dir_all(&elsewhere).unwrap();
    fs::write(folder.join("a.obj"), "v 1e6 0 0\nv 1000001 0 0\nv 1e6 1 0\nf 1 2 3\n").unwrap();
    let (model, copy) = (folder.join("a.obj"), folder.join("a.ron"));
    let away = elsewhere.join("a.ron");
    fails(&["check", text(&model), "--write", text(&away)], 2, &["other files", "a.ron"]);
    assert!(!away.exists());
    fails(&["check", text(&model), "--write", text(&folder.join("a.txt"))], 2, &[".ron"]);
    // A model gets a scene around it.
    assert_eq!(trisect(&["check", text(&model), "--write", text(&copy)]).status.code(), Some(6));
    assert_eq!(trisect(&["check", text(&copy)]).status.code(), Some(0));
    fails(&["check", text(&copy), "--write", text(&copy)], 2, &["scene itself"]);
    fails(&["check", text(&copy), "--write", text(&away)], 2, &["other files"]);
    // A scene without other files may go anywhere.
    let scene = folder.join("far.ron");
    fs::write(&scene, FAR).unwrap();
    check_failure(&trisect(&["check", text(&scene), "--write", text(&away)]), &[], 6, &["wrote"]);
    fails(&["check", text(&scene), "--write", text(&folder.join("none/a.ron"))], 1, &["none"]);
}
