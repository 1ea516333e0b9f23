//! Portals change the noise, not the mean: under each kind of sky, beside lights, in a medium and
//! behind a pane.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use trisect::render::Settings;
use trisect::scene::Scene;
use trisect_tests::renders::{film, independent};
use trisect_tests::statistics::{BlockTest, Blocks};
use trisect_tests::{BackendUnderTest, for_each_backend};

/// Light of a room, and objects in it.
struct Case {
    name: &'static str,
    sky: &'static str,
    lights: &'static str,
    objects: &'static str,
    atmosphere: &'static str,
    /// True if the door has a portal, too.
    door: bool,
}

const GRADIENT: &str = "Gradient(bottom: (0.5, 0.4, 0.3), top: (3, 4, 6))";
const LAMPS: &str = "Sphere(center: (0.5, 1.2, 0.3), radius: 0.2, material: \"lamp\"),
    Quad(corner: (-0.9, 1.9, -0.9), u: (1.8, 0, 0), v: (0, 0, 1.8), material: \"lamp\"),";
const SUN: &str = "Directional(direction: (0.8, -0.6, 0.1), irradiance: (2, 2, 1.5)),
    Point(position: (-0.5, 1.5, 0.6), intensity: (0.3, 0.2, 0.2)),";
const PANE: &str = "Quad(corner: (-1.05, 0.5, -0.7), u: (0, 1, 0), v: (0, 0, 0.8), material: \"pane\"),";

/// A large lamp near the wall around the window, which lies in the window's plane.
const NEAR: &str = "Sphere(center: (-0.6, 1.2, 0.55), radius: 0.3, material: \"lamp\"),";

const CASES: [Case; 6] = [
    Case { name: "gradient", sky: GRADIENT, lights: "", objects: "", atmosphere: "", door: true },
    Case { name: "gradient, lights", sky: GRADIENT, lights: SUN, objects: LAMPS, atmosphere: "", door: true },
    Case { name: "panorama", sky: "Studio(scale: 2)", lights: "", objects: "", atmosphere: "", door: true },
    Case {
        name: "panorama, lights, pane",
        sky: "Studio()",
        lights: SUN,
        objects: PANE,
        atmosphere: "",
        door: true,
    },
    Case {
        name: "panorama, lamp at the wall",
        sky: "Studio()",
        lights: "",
        objects: NEAR,
        atmosphere: "",
        door: false,
    },
    Case {
        name: "fog",
        sky: "Uniform(radiance: (2, 3, 4))",
        lights: SUN,
        objects: "",
        atmosphere: "fog",
        door: true,
    },
];

/// Returns the room, with portals in its window and its door, or without.
fn room(case: &Case, has_portals: bool) -> Scene {
    let Case { sky, lights, objects, .. } = case;
    // The fog fills the room alone: beyond it there is no light in an atmosphere without end.
    let fog = match case.atmosphere {
        "" => "",
        _ => "Box(min: (-0.999, 0.001, -0.999), max: (0.999, 1.999, 0.999), material: \"fog\"),",
    };
    let media = if fog.is_empty() {
        ""
    } else {
        "media: { \"fog\": (extinction: (0.45, 0.45, 0.5), albedo: (0.9, 0.9, 0.8), anisotropy: 0.3) },"
    };
    let of_fog = if fog.is_empty() { "" } else { "\"fog\": Interface(medium: \"fog\")," };
    let portals = match has_portals {
        true => {
            "portals: [
                (corner: (-1, 0.5, -0.7), u: (0, 1, 0), v: (0, 0, 0.8)),
                DOOR
            ],"
        }
        false => "",
    };
    let door = "(corner: (0.2, 0, 1), u: (0, 1.4, 0), v: (0.6, 0, 0)),";
    let portals = portals.replace("DOOR", if case.door { door } else { "" });
    let text = format!(
        "Scene(
            version: 1,
            image: (width: 24, height: 16, depth: 5),
            camera: (look_from: (0.8, 1.2, 0.9), look_at: (-0.6, 0.6, -0.4), vertical_fov: 70),
            sky: {sky},
            {media}
            materials: {{
                \"wall\": Lambertian(albedo: (0.6, 0.5, 0.4)),
                \"gloss\": MetallicRoughness(base_color: (0.4, 0.7, 0.5), roughness: 0.3),
                \"frosted\": RoughDielectric(ior: 1.5, roughness: 0.4),
                \"pane\": MetallicRoughness(base_color: (0.9, 1, 0.9), transmission: 1, roughness: 0),
                \"lamp\": Emissive(radiance: (1.5, 1.2, 0.8)),
                {of_fog}
            }},
            objects: [
                Quad(corner: (-1, 0, 1), u: (2, 0, 0), v: (0, 0, -2), material: \"wall\"),
                Quad(corner: (-1, 2, -1), u: (2, 0, 0), v: (0, 0, 2), material: \"wall\"),
                Quad(corner: (-1, 0, -1), u: (2, 0, 0), v: (0, 2, 0), material: \"wall\"),
                Quad(corner: (1, 0, -1), u: (0, 0, 2), v: (0, 2, 0), material: \"wall\"),
                // The wall with the window.
                Quad(corner: (-1, 0, -1), u: (0, 0.5, 0), v: (0, 0, 2), material: \"wall\"),
                Quad(corner: (-1, 1.5, -1), u: (0, 0.5, 0), v: (0, 0, 2), material: \"wall\"),
                Quad(corner: (-1, 0.5, -1), u: (0, 1, 0), v: (0, 0, 0.3), material: \"wall\"),
                Quad(corner: (-1, 0.5, 0.1), u: (0, 1, 0), v: (0, 0, 0.9), material: \"wall\"),
                // The wall with the door.
                Quad(corner: (-1, 0, 1), u: (0, 2, 0), v: (1.2, 0, 0), material: \"wall\"),
                Quad(corner: (0.8, 0, 1), u: (0, 2, 0), v: (0.2, 0, 0), material: \"wall\"),
                Quad(corner: (0.2, 1.4, 1), u: (0, 0.6, 0), v: (0.6, 0, 0), material: \"wall\"),
                Sphere(center: (-0.5, 0.3, 0.2), radius: 0.3, material: \"gloss\"),
                Sphere(center: (0, 0.25, -0.5), radius: 0.25, material: \"frosted\"),
                {objects}
                {fog}
            ],
            lights: [{lights}],
            {portals}
        )"
    );
    Scene::parse(&text, case.name).unwrap()
}

/// Returns the blocks of a scene.
fn blocks(subject: BackendUnderTest, scene: &Scene, samples: u32, seed: u32) -> Option<Blocks> {
    let settings = Settings { samples, seed, ..independent(scene) };
    Some(Blocks::new(&film(&mut subject.renderer(scene)?, &settings)))
}

fn compare(subject: BackendUnderTest, case: &Case, with: &Scene) -> Option<BlockTest> {
    // A software adapter may be slow.
    let part = if subject == BackendUnderTest::Cpu { 1 } else { 16 };
    let without = blocks(subject, &room(case, false), 2048 / part, 1)?;
    Some(blocks(subject, with, 512 / part, 2)?.compare(&without, 1e-4))
}

fn portals_change_no_mean(subject: BackendUnderTest) {
    let is_tested = |index| subject == BackendUnderTest::Cpu || index == 1 || index == 3;
    for (_, case) in CASES.iter().enumerate().filter(|(index, _)| is_tested(*index)) {
        let Some(test) = compare(subject, case, &room(case, true)) else { return };
        eprintln!("{}: {test:?}", case.name);
        assert!(test.passes(), "{}: {test:?}", case.name);
    }
}

/// Negative control: portals that are 5 % smaller than their area says.
#[test]
fn negative_control_wrong_pdfs_are_found() {
    let case = &CASES[0];
    let mut wrong = room(case, true);
    wrong.portals.iter_mut().for_each(|portal| portal.area *= 1.05);
    let test = compare(BackendUnderTest::Cpu, case, &wrong).unwrap();
    assert!(!test.passes(), "negative control not detected: {test:?}");
}

/// Portals pay: with them, connections find the sky, whose light comes through a small part of the
/// walls.
#[test]
fn portals_find_the_window() {
    let case = &CASES[0];
    let noise = |has_portals| {
        let scene = room(case, has_portals);
        let settings = Settings { samples: 256, ..independent(&scene) };
        let film = film(&mut BackendUnderTest::Cpu.renderer(&scene).unwrap(), &settings);
        let relative = |pixel: trisect::film::PixelTotals| {
            let (mean, variance) = (pixel.mean()[1], pixel.variance_of_mean()[1] * 256.0);
            variance / (mean * mean + 1e-4)
        };
        film.pixels.iter().map(relative).sum::<f64>() / film.pixels.len() as f64
    };
    let (with, without) = (noise(true), noise(false));
    assert!(with < 0.25 * without, "variance of a sample {with} with portals, {without} without");
}

for_each_backend!(portals_change_no_mean);
