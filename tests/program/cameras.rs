//! Options of the camera: `--camera`, `--look-from`, `--look-at`, `--up`, `--fov` and those of the
//! lens.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use std::fs;
use trisect_tests::models::bending_tube;
use trisect_tests::program::{Temporary, check_failure, trisect};

const CAMERA: &str = "look_from: (1, 2, 5), look_at: (0, 0.5, 0), up: (0.1, 1, 0), vertical_fov: 35, \
    defocus_angle: 2, focus_distance: 5";

fn scene(camera: &str) -> String {
    format!(
        "Scene(version: 1, image: (width: 32, height: 16, samples: 4, depth: 3), camera: ({camera}), \
         sky: Gradient(bottom: (1, 1, 1), top: (0.2, 0.4, 1)), \
         materials: {{ \"a\": Lambertian(albedo: (0.5, 0.5, 0.5)) }}, \
         objects: [Sphere(center: (0, 0, 0), radius: 1, material: \"a\")])"
    )
}

/// Options give the image of a file with the same camera; each of them has an effect.
#[test]
fn options_are_those_of_the_file() {
    let folder = Temporary::new("cameras", "options");
    let render = |camera: &str, options: &[&str]| {
        fs::write(folder.path("a.ron"), scene(camera)).unwrap();
        let (scene, image) = (folder.file("a.ron"), folder.file("a.pfm"));
        let common = ["render", &scene, "-o", &image, "--backend", "cpu", "-q"];
        let output = trisect(&[&common[..], options].concat());
        assert!(output.status.success(), "{options:?}: {}", String::from_utf8_lossy(&output.stderr));
        fs::read(&image).unwrap()
    };
    let wanted = render(CAMERA, &[]);
    let all = [
        ["--look-from", "1,2,5"],
        ["--look-at", "0,0.5,0"],
        ["--up", "0.1,1,0"],
        ["--fov", "35"],
        ["--defocus-angle", "2"],
        ["--focus-distance", "5"],
    ];
    let other = "look_from: (0, 0, 6), look_at: (0, 0, 0), vertical_fov: 50";
    assert!(render(other, all.as_flattened()) == wanted);
    for left_out in 0..all.len() {
        let some: Vec<&str> = all
            .iter()
            .enumerate()
            .filter(|(index, _)| *index != left_out)
            .flat_map(|(_, pair)| *pair)
            .collect();
        assert!(render(other, &some) != wanted, "{:?} has no effect", all[left_out]);
    }
}

#[test]
fn wrong_cameras_are_refused() {
    let folder = Temporary::new("cameras", "refused");
    fs::write(folder.path("a.ron"), scene(CAMERA)).unwrap();
    let scene = folder.file("a.ron");
    for (options, code, wanted) in [
        (["--camera", "side"], 4, "a.ron: unknown camera \"side\"; available: 0 \"camera\""),
        (["--look-from", "0,0.5,0"], 4, "look_from and look_at are the same point"),
        (["--up", "0,0,0"], 4, "up points along the view (or is zero)"),
        (["--fov", "0"], 2, "must be above 0 degrees, and below 180"),
        (["--fov", "180"], 2, "must be above 0 degrees, and below 180"),
        (["--look-at", "1,2"], 2, "must be three numbers, such as 0,1.5,-3"),
    ] {
        let arguments = ["render", &scene, options[0], options[1]];
        check_failure(&trisect(&arguments), &arguments, code, &[wanted]);
    }
}

/// All moments of a shutter, and all frames, have the camera of the options.
#[test]
fn what_moves_has_the_camera_of_the_options() {
    let folder = Temporary::new("cameras", "motion");
    fs::write(folder.path("tube.gltf"), bending_tube(12, 8)).unwrap();
    let own = scene("look_from: (0, 1, 9), look_at: (0, 1, 0), vertical_fov: 40");
    let with_tube = |text: String| text.replace("objects: [", "objects: [Mesh(file: \"tube.gltf\"), ");
    fs::write(folder.path("a.ron"), with_tube(own)).unwrap();
    let wanted = "look_from: (4, 2, 6), look_at: (0, 1, 0), vertical_fov: 55";
    fs::write(folder.path("b.ron"), with_tube(scene(wanted))).unwrap();
    let frames = |name: &str, options: &[&str]| {
        let (scene, image) = (folder.file(name), folder.file("a.pfm"));
        let moves =
            ["--frames", "0..2", "--fps", "2", "--shutter", "1", "--shutter-steps", "2", "--spp", "4"];
        let common = ["render", &scene, "-o", &image, "--backend", "cpu", "-q"];
        let output = trisect(&[&common[..], &moves, options].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        ["a.0000.pfm", "a.0001.pfm"].map(|name| fs::read(folder.path(name)).unwrap())
    };
    let options = ["--look-from", "4,2,6", "--look-at", "0,1,0", "--fov", "55"];
    assert!(frames("a.ron", &options) == frames("b.ron", &[]));
    // Negative control: without the options the camera is the file's.
    assert!(frames("a.ron", &[]) != frames("b.ron", &[]));
}
