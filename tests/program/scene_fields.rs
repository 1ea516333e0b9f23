//! `--set` changes fields of a scene file for one command.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use std::fs;
use trisect_tests::program::{Temporary, fails, trisect};

const SCENE: &str = r#"Scene( // a ball
    version: 1,
    image: (width: 12, height: 8, samples: 300, depth: 4),
    camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 40),
    sky: Gradient(bottom: (1, 1, 1), top: (0.5, 0.7, 1)),
    materials: { "red": Lambertian(albedo: (0.8, 0.1, 0.1)), "blue": Lambertian(albedo: (0.1, 0.1, 0.8)) },
    objects: [Sphere(name: "ball", center: (0, 0, 0), radius: 1, material: "red")], // one
)"#;

/// Changes, each with the text that it replaces and the text that replaces it.
const CHANGES: [(&str, &str, &str); 4] = [
    ("image.width=10", "width: 12", "width: 10"),
    ("camera.look_from=0,1,3", "look_from: (0, 0, 3)", "look_from: (0, 1, 3)"),
    ("objects.ball.material=blue", "material: \"red\")], // one", "material: \"blue\")], // one"),
    ("materials.blue.albedo.2=0.4", "(0.1, 0.1, 0.8)", "(0.1, 0.1, 0.4)"),
];

fn with_changes<'a>(arguments: &[&'a str]) -> Vec<&'a str> {
    arguments.iter().copied().chain(CHANGES.iter().flat_map(|(edit, _, _)| ["--set", edit])).collect()
}

fn succeeds(arguments: &[&str]) {
    let output = trisect(arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The image is that of a file with the changes, also after an interruption, and so is a copy.
#[test]
fn fields_are_changed() {
    let folder = Temporary::new(file!(), "changed");
    let [scene, changed, copy] = ["scene.ron", "changed.ron", "copy.ron"].map(|name| folder.file(name));
    let [a, b, c, d] = ["a.pfm", "b.pfm", "c.pfm", "d.pfm"].map(|name| folder.file(name));
    let text = CHANGES.iter().fold(SCENE.to_owned(), |text, (_, old, new)| {
        assert_eq!(text.matches(old).count(), 1, "{old}");
        text.replace(old, new)
    });
    fs::write(&scene, SCENE).unwrap();
    fs::write(&changed, &text).unwrap();
    let cpu = ["--backend", "cpu", "-o"];
    succeeds(&[&["render", &changed], &cpu[..], &[&a]].concat());
    succeeds(&with_changes(&[&["render", &scene], &cpu[..], &[&b]].concat()));
    assert_eq!(fs::read(&a).unwrap(), fs::read(&b).unwrap());
    // A checkpoint keeps the changes.
    let film = folder.file("a.film");
    let part = ["--checkpoint", &film, "--sample-range", "0..256"];
    succeeds(&with_changes(&[&["render", &scene], &cpu[..], &[&c], &part[..]].concat()));
    assert_ne!(fs::read(&a).unwrap(), fs::read(&c).unwrap());
    let rest = folder.file("b.film");
    let part = ["--checkpoint", &rest, "--sample-range", "256..300"];
    succeeds(&with_changes(&[&["render", &scene], &cpu[..], &[&c], &part[..]].concat()));
    succeeds(&["merge", &film, &rest, "-o", &c]);
    assert_eq!(fs::read(&a).unwrap(), fs::read(&c).unwrap());
    // `resume` reads the scene again: without the changes it would refuse the film as another's.
    let whole = folder.file("whole.film");
    succeeds(&with_changes(&[&["render", &scene], &cpu[..], &[&c, "--checkpoint", &whole]].concat()));
    succeeds(&["resume", &whole, "-o", &d]);
    assert_eq!(fs::read(&a).unwrap(), fs::read(&d).unwrap());
    // A copy has the changes and the comments.
    succeeds(&with_changes(&["check", &scene, "-o", &copy]));
    let copied = fs::read_to_string(&copy).unwrap();
    assert!(copied.contains("// a ball") && copied.contains("(0.1, 0.1, 0.4)"), "{copied}");
    // Negative control: without changes it is another image.
    succeeds(&[&["render", &scene, "--width", "10"], &cpu[..], &[&d]].concat());
    assert_ne!(fs::read(&a).unwrap(), fs::read(&d).unwrap());
}

#[test]
fn the_built_in_scene_has_fields() {
    let folder = Temporary::new(file!(), "built-in");
    let image = folder.file("a.pfm");
    let small = ["--spp", "1", "--backend", "cpu", "-o", &image];
    succeeds(&[&["render", "--set", "image.width=8", "--set", "image.height=6"], &small[..]].concat());
    assert_eq!(trisect::image::Image::read(image.as_ref()).unwrap().width, 8);
}

#[test]
fn faults_are_named() {
    let folder = Temporary::new(file!(), "faults");
    let scene = folder.file("scene.ron");
    fs::write(&scene, SCENE).unwrap();
    let faulty = |edit: &str, code, words: &[&str]| {
        let words: Vec<&str> = words.iter().copied().chain(["--set"]).collect();
        for command in ["render", "check", "view"] {
            fails(&[command, &scene, "--set", edit], code, &words);
        }
    };
    faulty("image.width", 2, &["PATH=VALUE", "camera.look_at=0,1,0"]);
    faulty("objects.cube.radius=2", 4, &["objects has no cube", "scene.ron"]);
    faulty("images.width=2", 4, &["the scene has no images", "camera", "materials"]);
    faulty("objects.0.radius=-1", 4, &["scene.ron", "radius"]);
    faulty("objects.0.radios=1", 4, &["scene.ron", "radios"]);
    let model = folder.file("model.obj");
    fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    fails(&["render", &model, "--set", "image.width=2"], 4, &["model.obj", "--set", "--write"]);
}
