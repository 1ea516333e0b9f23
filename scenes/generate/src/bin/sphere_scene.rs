//! Writes a scene of `trisect bench report`, with 1 to 10,000,000 spheres, to standard output as a
//! scene file.
//!
//! ```text
//! cargo generate-scene sphere_scene 10000 > scenes/generated/spheres_10000.ron
//! ```

use std::fmt::Write;
use std::io::Write as _;
use trisect::scene::description::{ShapeKind, Sky, Surface};
use trisect_lab::bench::sphere_scene;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let count = std::env::args().nth(1).ok_or("usage: sphere_scene COUNT")?.parse()?;
    let scene = sphere_scene(count)?;
    let description = &scene.description;
    let (_, camera) = description.cameras.first().ok_or("no camera")?;
    let Some(Sky::Gradient { bottom, top }) = &description.sky else { return Err("no gradient".into()) };
    let mut text = String::new();
    writeln!(text, "// {count} spheres; written by cargo generate-scene sphere_scene, do not edit.")?;
    writeln!(text, "Scene(\n    version: 1,")?;
    let image = scene.image;
    writeln!(
        text,
        "    image: (width: {}, height: {}, samples: {}, depth: {}),",
        image.width, image.height, image.samples, image.depth
    )?;
    writeln!(
        text,
        "    camera: (look_from: {}, look_at: {}, up: {}, vertical_fov: {}, defocus_angle: {}, focus_distance: {}),",
        triple(camera.look_from.into()),
        triple(camera.look_at.into()),
        triple(camera.up.into()),
        camera.vertical_fov.to_degrees(),
        camera.defocus_angle.to_degrees(),
        camera.focus_distance
    )?;
    let (bottom, top) = (triple((*bottom).into()), triple((*top).into()));
    writeln!(
        text,
        "    sky: Gradient(bottom: {bottom}, top: {top}),\n    fresnel: Schlick,\n    materials: {{"
    )?;
    for material in &description.materials {
        let surface = match &material.surface {
            Surface::Lambertian(m) => format!("Lambertian(albedo: {})", triple(m.albedo.into())),
            Surface::Metal(m) => format!("Metal(albedo: {}, fuzz: {})", triple(m.albedo.into()), m.fuzz),
            Surface::Dielectric(m) => format!("Dielectric(ior: {})", m.ior),
            other => return Err(format!("unexpected material {other:?}").into()),
        };
        writeln!(text, "        \"{}\": {surface},", material.name)?;
    }
    writeln!(text, "    }},\n    objects: [")?;
    for shape in &description.shapes {
        let ShapeKind::Sphere { center, radius } = shape.kind else { return Err("unexpected shape".into()) };
        let material = &description.materials.get(shape.material).ok_or("unknown material")?.name;
        let center = triple(center.into());
        writeln!(text, "        Sphere(center: {center}, radius: {radius}, material: \"{material}\"),")?;
    }
    writeln!(text, "    ],\n)")?;
    std::io::stdout().write_all(text.as_bytes())?;
    Ok(())
}

fn triple([x, y, z]: [f64; 3]) -> String {
    format!("({x}, {y}, {z})")
}
