//! Faults in media are refused by name, with file, place and remedy.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use trisect::scene::medium::DensityGrid;
use trisect_tests::program::{self, fails, trisect};

const GOOD: &str = r#"Scene(
    version: 1,
    image: (width: 8, height: 4, samples: 1),
    camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 40),
    sky: Uniform(radiance: (1, 1, 1)),
    media: {
        "fog": (extinction: (0.1, 0.1, 0.1), albedo: (1, 1, 1), anisotropy: 0.5),
        "cloud": (extinction: (3, 3, 3), emission: (1, 0, 0), grid: (file: "cloud.vol")),
    },
    atmosphere: "fog",
    materials: {
        "a": Lambertian(albedo: (0.5, 0.5, 0.5)),
        "i": Interface(medium: "cloud"),
        "g": Dielectric(ior: 1.5, medium: "fog"),
    },
    objects: [
        Sphere(center: (0, 0, 0), radius: 1, material: "a"),
        Sphere(center: (1, 0, 0), radius: 1, material: "i"),
        Sphere(center: (2, 0, 0), radius: 1, material: "g"),
    ],
)
"#;

#[test]
fn faults_in_media_are_placed() {
    // A text, its replacement, and what the message must contain: line and column, then the reason.
    let cases: &[(&str, &str, &[&str])] = &[
        ("extinction: (0.1,", "extinction: (-0.1,", &["scene.ron:7:", "-0.1 is not an extinction"]),
        ("extinction: (0.1,", "extinction: (1e-30,", &["scene.ron:7:", "1e-18"]),
        ("albedo: (1,", "albedo: (1.5,", &["scene.ron:7:", "1.5 is not between 0 and 1"]),
        ("anisotropy: 0.5", "anisotropy: 1", &["scene.ron:7:", "anisotropy between -0.99"]),
        ("anisotropy: 0.5", "g: 0.5", &["scene.ron:7:", "anisotropy"]),
        ("emission: (1, 0, 0)", "emission: (1, NaN, 0)", &["scene.ron:8:", "NaN is not a finite radiance"]),
        (
            "atmosphere: \"fog\"",
            "atmosphere: \"mist\"",
            &["scene.ron:10:", "unknown medium \"mist\"", "cloud, fog"],
        ),
        (
            "(medium: \"cloud\")",
            "(medium: \"smoke\")",
            &["scene.ron:13:", "unknown medium \"smoke\"", "cloud, fog"],
        ),
        ("(medium: \"cloud\")", "()", &["material \"i\"", "give it a `medium`"]),
        ("(medium: \"cloud\")", "(medium: \"cloud\", opacity: 0.5)", &["material \"i\"", "remove"]),
        (
            "albedo: (0.5, 0.5, 0.5)",
            "albedo: (0.5, 0.5, 0.5), medium: \"fog\"",
            &["material \"a\"", "no light passes"],
        ),
        (
            "Dielectric(ior: 1.5,",
            "MetallicRoughness(metallic: 0, transmission: 1, layers: (volume: (attenuation_color: (0.5, 0.5, 0.5), \
             attenuation_distance: 1)),",
            &["material \"g\"", "exclude each other"],
        ),
        ("cloud.vol", "cloud.png", &["scene.ron:8:", "not a grid of densities", ".vol"]),
        ("cloud.vol", "none.vol", &["scene.ron:8:", "none.vol", "No such file"]),
        ("cloud.vol", "../cloud.vol", &["scene.ron:8:", "allow-outside"]),
        ("cloud.vol", "broken.vol", &["broken.vol", "densities", "4 bytes for each voxel"]),
        ("(3, 3, 3)", "(1e18, 3, 3)", &["medium \"cloud\"", "maximum density"]),
        ("\"cloud\": (e", "\"fog\": (e", &["scene.ron:8:", "is defined twice"]),
    ];
    let folder = program::folder("bad-media", "scene");
    let (path, image) = (folder.join("scene.ron"), folder.join("a.png"));
    let grid = DensityGrid::new([2, 2, 2], vec![0.0, 1.0, 2.0, 3.0, 0.5, 0.5, 0.5, 0.5]).unwrap().to_bytes();
    std::fs::write(folder.join("cloud.vol"), &grid).unwrap();
    std::fs::write(folder.join("broken.vol"), &grid[..grid.len() - 1]).unwrap();
    for (from, to, words) in cases {
        assert!(GOOD.contains(from), "{from}");
        std::fs::write(&path, GOOD.replacen(from, to, 1)).unwrap();
        fails(&["render", path.to_str().unwrap(), "-o", image.to_str().unwrap()], 4, words);
        assert!(!image.exists());
    }
    std::fs::write(&path, GOOD).unwrap();
    let (path, image) = (path.to_str().unwrap(), image.to_str().unwrap());
    let output = trisect(&["render", path, "--backend", "cpu", "--quiet", "-o", image]);
    assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
}
