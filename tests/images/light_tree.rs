//! Light trees: all lights together give the sum of what each gives alone, for which no tree is
//! needed.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use std::fmt::Write;
use trisect::render::Settings;
use trisect::scene::{Includes, Rebase, Scene, SceneDocument};
use trisect_tests::renders::{film, independent};
use trisect_tests::statistics::{BlockTest, Blocks};
use trisect_tests::{BackendUnderTest, for_each_backend};

/// Lights of the scene: objects of a material of their own, or lights without extent. The first
/// shines through a pane, the second lies below the floor's horizon for most points.
const OBJECTS: [&str; 5] = [
    "Sphere(center: (-1.6, 0.5, -0.5), radius: 0.1, material: \"LAMP\")",
    "Quad(corner: (0.5, 0.02, 1), u: (0.4, 0, 0), v: (0, 0.4, 0), material: \"LAMP\")",
    "Quad(corner: (1, 1.8, -1), u: (0.3, 0, 0), v: (0, 0, 0.3), material: \"LAMP\")",
    "Disc(center: (-0.5, 1.2, -2), normal: (0.2, -0.3, 1), radius: 0.2, material: \"LAMP\")",
    "Sphere(center: (2.4, 0.2, 0.4), radius: 0.2, material: \"LAMP\")",
];
const PUNCTUAL: [&str; 5] = [
    "Point(position: (0.2, 1.5, 0.8), intensity: (0.3, 0.2, 0.4))",
    "Point(position: (-2, 0.1, 0.3), intensity: (0.05, 0.1, 0.03))",
    "Spot(position: (1.5, 2, 1), direction: (-0.5, -1, -0.4), intensity: (2, 2, 1), outer_angle: 35)",
    "Spot(position: (-1, 2, -1), direction: (0.3, -1, 0.2), intensity: (1, 2, 2), inner_angle: 50, outer_angle: 89)",
    "Directional(direction: (-0.3, -1, -0.6), irradiance: (0.2, 0.3, 0.4))",
];

/// Returns the scene with some of its lights: `is_lit` is asked for their numbers.
fn scene(is_lit: impl Fn(usize) -> bool) -> Scene {
    let (mut materials, mut objects, mut lights) = (String::new(), String::new(), String::new());
    for (index, object) in OBJECTS.iter().enumerate() {
        let radiance = if is_lit(index) { 1.0 + 3.0 * index as f64 } else { 0.0 };
        let (two, warm) = (index == 2, 0.4 * radiance);
        write!(
            materials,
            "\"lamp{index}\": Lambertian(albedo: (0.3, 0.3, 0.3), two_sided: {two}, emission: ({radiance}, {warm}, {radiance})),"
        )
        .unwrap();
        writeln!(objects, "{},", object.replace("LAMP", &format!("lamp{index}"))).unwrap();
    }
    for (index, light) in PUNCTUAL.iter().enumerate().filter(|(index, _)| is_lit(OBJECTS.len() + index)) {
        writeln!(lights, "{light}, // {index}").unwrap();
    }
    let text = format!(
        "Scene(
            version: 1,
            image: (width: 48, height: 32, depth: 5),
            camera: (look_from: (0, 1.4, 4.5), look_at: (0, 0.5, 0), vertical_fov: 42),
            sky: Black,
            materials: {{
                \"floor\": Lambertian(albedo: (0.6, 0.5, 0.4)),
                \"metal\": MetallicRoughness(base_color: (0.9, 0.7, 0.5), metallic: 1, roughness: 0.5),
                \"plastic\": MetallicRoughness(base_color: (0.4, 0.7, 0.5), roughness: 0.3),
                \"frosted\": RoughDielectric(ior: 1.5, roughness: 0.5),
                \"pane\": MetallicRoughness(base_color: (1, 1, 1), transmission: 1, roughness: 0.4),
                {materials}
            }},
            objects: [
                Quad(corner: (-4, 0, 3), u: (8, 0, 0), v: (0, 0, -8), material: \"floor\"),
                Quad(corner: (-4, 0, -2.5), u: (8, 0, 0), v: (0, 4, 0), material: \"floor\"),
                Sphere(center: (-0.8, 0.4, 0), radius: 0.4, material: \"metal\"),
                Sphere(center: (0.3, 0.4, -0.4), radius: 0.4, material: \"plastic\"),
                Sphere(center: (1.3, 0.4, 0.3), radius: 0.4, material: \"frosted\"),
                Quad(corner: (-1.3, 0, -1), u: (0, 0, 1.4), v: (0, 1, 0), material: \"pane\"),
                {objects}
            ],
            lights: [{lights}],
        )"
    );
    let document = SceneDocument::parse_including(&text, "lights", Includes::Anywhere).unwrap();
    document.lower(Rebase::IDENTITY).unwrap()
}

/// Returns the blocks of the scene with these lights.
fn blocks(subject: BackendUnderTest, samples: u32, is_lit: impl Fn(usize) -> bool) -> Option<Blocks> {
    let scene = scene(is_lit);
    let settings = Settings { samples, seed: 5 + samples, ..independent(&scene) };
    Some(Blocks::new(&film(&mut subject.renderer(&scene)?, &settings)))
}

/// Returns the sum of the blocks with each light alone.
fn sum(subject: BackendUnderTest) -> Option<Blocks> {
    let mut sum: Option<Blocks> = None;
    for light in 0..OBJECTS.len() + PUNCTUAL.len() {
        let one = blocks(subject, 256 + light as u32, |index| index == light)?;
        sum = Some(match sum {
            None => one,
            Some(mut sum) => {
                let add = |to: &mut ([f64; 3], [f64; 3]), of: &([f64; 3], [f64; 3])| {
                    for c in 0..3 {
                        to.0[c] += of.0[c];
                        to.1[c] += of.1[c];
                    }
                };
                sum.blocks.iter_mut().zip(&one.blocks).for_each(|(to, of)| add(to, of));
                add(&mut sum.whole, &one.whole);
                sum
            }
        });
    }
    sum
}

fn all_lights_give_the_sum_of_each(subject: BackendUnderTest) {
    let (Some(all), Some(sum)) = (blocks(subject, 1024, |_| true), sum(subject)) else { return };
    let test: BlockTest = all.compare(&sum, 1e-4);
    assert!(test.passes(), "{test:?}");
    // Negative controls: one light less, whichever it is but the dimmest.
    for missing in [0, 2, 5, 8, 9] {
        let fewer = blocks(subject, 256, |index| index != missing);
        let test = fewer.unwrap().compare(&sum, 1e-4);
        assert!(!test.passes(), "without {missing}: {test:?}");
    }
}

for_each_backend!(all_lights_give_the_sum_of_each);
