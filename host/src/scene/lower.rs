//! From the file's words to device records.

use super::error::SceneError;
use super::format::{self, Object, SceneFile};
use super::values::{Albedo, Colour, Point};
use super::{CameraPose, Scene};
use crate::render::{Fresnel, MathMode, Settings};
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use trisect_shared::bvh::Child;
use trisect_shared::material::{DIELECTRIC, LAMBERTIAN, METAL, Material};
use trisect_shared::sky::Sky;
use trisect_shared::sphere::Sphere;

pub(super) fn lower(file: SceneFile, name: &str) -> Result<Scene, SceneError> {
    let inconsistent = |message: String| SceneError::Inconsistent { file: name.to_owned(), message };

    let camera = CameraPose {
        look_from: point(file.camera.look_from),
        look_at: point(file.camera.look_at),
        up: point(file.camera.up),
        vertical_fov: file.camera.vertical_fov.0.to_radians(),
        defocus_angle: file.camera.defocus_angle.0.to_radians(),
        focus_distance: file.camera.focus_distance.0,
    };
    let axis = camera.look_at - camera.look_from;
    if axis.length() == 0.0 {
        return Err(inconsistent(
            "camera: look_from and look_at are the same point; move one of them".to_owned(),
        ));
    }
    let sine = axis.normalize().cross(camera.up.normalize_or_zero()).length();
    if sine < 1e-6 {
        return Err(inconsistent(
            "camera: up points along the view (or is zero); choose another direction".to_owned(),
        ));
    }
    // A lens' rays are differences of such vectors, whose squares must stay finite in f32.
    let widest = (0.5 * camera.vertical_fov).tan().max((0.5 * camera.defocus_angle).tan()).max(1.0);
    if camera.defocus_angle > 0.0 && camera.focus_distance * widest > 1e15 {
        return Err(inconsistent(format!(
            "camera: focus_distance {} is too large for these angles; it times the tangent of half an angle must be at most 1e15",
            camera.focus_distance
        )));
    }
    if file.objects.len() > Child::LIMIT as usize {
        return Err(inconsistent(format!("{} objects; at most {} fit", file.objects.len(), Child::LIMIT)));
    }

    let index: HashMap<&str, u32> =
        file.materials.iter().zip(0u32..).map(|((name, _), i)| (name.as_str(), i)).collect();
    let mut spheres = Vec::with_capacity(file.objects.len());
    for Object::Sphere { center, radius, material } in &file.objects {
        let Some(&material) = index.get(material.0.as_str()) else {
            return Err(inconsistent(format!("unknown material \"{}\"", material.0)));
        };
        spheres.push(Sphere {
            center: point(*center).as_vec3(),
            radius: radius.0 as f32,
            material,
            pad: [0; 3],
        });
    }

    let format::Sky::Gradient { bottom, top } = &file.sky;
    Ok(Scene {
        name: name.to_owned(),
        camera,
        sky: Sky { bottom: colour(bottom), pad0: 0, top: colour(top), pad1: 0 },
        spheres,
        materials: file.materials.iter().map(|(_, material)| lower_material(material)).collect(),
        settings: Settings {
            width: file.image.width.0,
            height: file.image.height.0,
            samples: file.image.samples.0,
            depth: file.image.depth.0,
            seed: 0,
            roulette: false,
            fresnel: match file.fresnel {
                format::Fresnel::Exact => Fresnel::Exact,
                format::Fresnel::Schlick => Fresnel::Schlick,
            },
            math: MathMode::Precise,
        },
    })
}

fn lower_material(material: &format::Material) -> Material {
    let record = |albedo, kind, fuzz, ior| Material { albedo, kind, fuzz, ior, pad: [0; 2] };
    match material {
        format::Material::Lambertian { albedo } => record(share(albedo), LAMBERTIAN, 0.0, 1.0),
        format::Material::Metal { albedo, fuzz } => record(share(albedo), METAL, fuzz.0 as f32, 1.0),
        format::Material::Dielectric { ior } => record(Vec3::ONE, DIELECTRIC, 0.0, ior.0 as f32),
    }
}

fn point(p: Point) -> DVec3 {
    DVec3::new(p.0.0, p.1.0, p.2.0)
}

fn share(p: &Albedo) -> Vec3 {
    DVec3::new(p.0.0, p.1.0, p.2.0).as_vec3()
}

fn colour(p: &Colour) -> Vec3 {
    DVec3::new(p.0.0, p.1.0, p.2.0).as_vec3()
}
