//! Writes `scenes/rtiow_final.ron` from the spheres and the camera that the book's program printed.
//!
//! ```text
//! cargo generate-scene rtiow_scene \
//!     < scenes/source/rtiow_final.json > scenes/rtiow_final.ron
//! ```
//!
//! Numbers keep all their digits (the shortest decimal that reads back as the same f64). Each
//! sphere has its own material, as in the book, named by kind and index; glass with the same index
//! of refraction is shared.

use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::io::{Read, stdin};

#[derive(Deserialize)]
struct Book {
    source: String,
    camera: Camera,
    sky: Sky,
    spheres: Vec<Sphere>,
}

#[derive(Deserialize)]
struct Camera {
    lookfrom: [f64; 3],
    lookat: [f64; 3],
    vup: [f64; 3],
    vfov_deg: f64,
    defocus_angle_deg: f64,
    focus_dist: f64,
    image_width: u32,
    image_height: u32,
    max_depth: u32,
}

#[derive(Deserialize)]
struct Sky {
    bottom: [f64; 3],
    top: [f64; 3],
}

#[derive(Deserialize)]
struct Sphere {
    center: [f64; 3],
    radius: f64,
    material: String,
    albedo: Option<[f64; 3]>,
    fuzz: f64,
    ior: f64,
}

fn triple([x, y, z]: [f64; 3]) -> String {
    format!("({x}, {y}, {z})")
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut text = String::new();
    stdin().read_to_string(&mut text)?;
    print!("{}", convert(&serde_json::from_str(&text)?)?);
    Ok(())
}

fn convert(book: &Book) -> Result<String, Box<dyn std::error::Error>> {
    let mut materials = BTreeMap::new();
    let mut objects = String::new();
    for (index, sphere) in book.spheres.iter().enumerate() {
        let albedo = || sphere.albedo.map(triple).ok_or("a sphere without albedo");
        let (name, material) = match sphere.material.as_str() {
            "diffuse" => (format!("diffuse-{index:03}"), format!("Lambertian(albedo: {})", albedo()?)),
            "metal" => {
                (format!("metal-{index:03}"), format!("Metal(albedo: {}, fuzz: {})", albedo()?, sphere.fuzz))
            }
            "dielectric" => (format!("glass-{}", sphere.ior), format!("Dielectric(ior: {})", sphere.ior)),
            other => return Err(format!("unknown material {other}").into()),
        };
        let (center, radius) = (triple(sphere.center), sphere.radius);
        writeln!(objects, "        Sphere(center: {center}, radius: {radius}, material: \"{name}\"),")?;
        materials.insert(name, material);
    }
    let mut list = String::new();
    for (name, material) in materials {
        writeln!(list, "        \"{name}\": {material},")?;
    }
    let camera = &book.camera;
    Ok(format!(
        r#"// The final scene of "Ray Tracing in One Weekend" (Shirley, Black, Hollasch; CC0-1.0).
// Written by cargo generate-scene rtiow_scene from scenes/source/rtiow_final.json; do not edit.
Scene(
    version: 1,
    about: "{}",
    image: (width: {}, height: {}, samples: 64, depth: {}),
    camera: (
        look_from: {},
        look_at: {},
        up: {},
        vertical_fov: {},
        defocus_angle: {},
        focus_distance: {},
    ),
    sky: Gradient(bottom: {}, top: {}),
    fresnel: Schlick,
    materials: {{
{list}    }},
    objects: [
{objects}    ],
)
"#,
        book.source,
        camera.image_width,
        camera.image_height,
        camera.max_depth,
        triple(camera.lookfrom),
        triple(camera.lookat),
        triple(camera.vup),
        camera.vfov_deg,
        camera.defocus_angle_deg,
        camera.focus_dist,
        triple(book.sky.bottom),
        triple(book.sky.top),
    ))
}
