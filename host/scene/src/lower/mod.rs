//! Lowers a description to the device records of a [`Scene`]: applies transforms, packs images, and
//! rounds f64 to f32.

mod environment;
mod geometry;
mod ground;
mod material;
mod shared;
mod sharing;
mod tangents;
mod texture;

pub(super) use geometry::check_memory;
pub(super) use ground::place as place_ground;

use super::ImageSettings;
use super::description::{self, Description, Mesh, PunctualLight};
use super::error::SceneError;
use super::values::{MAX_MAGNITUDE, MIN_MAGNITUDE};
use super::{CameraPose, Scene, Sharing};
use glam::{DVec3, Vec3};
use std::collections::HashSet;
use trisect_shared::sky::Sky;

/// Makes the records of a description; its first camera is used. `name` stands for the file in
/// messages.
pub(super) fn lower(
    description: &Description,
    image: &ImageSettings,
    name: &str,
    sharing: Sharing,
) -> Result<Scene, SceneError> {
    let inconsistent = |message: String| SceneError::Inconsistent { file: name.to_owned(), message };
    let Some((_, camera)) = description.cameras.first() else {
        return Err(inconsistent("no camera; add one".to_owned()));
    };
    let sky = match &description.sky {
        Some(description::Sky::Gradient { bottom, top }) => {
            Sky { bottom: bottom.as_vec3(), pad0: 0, top: top.as_vec3(), pad1: 0 }
        }
        _ => Sky { bottom: Vec3::ZERO, pad0: 0, top: Vec3::ZERO, pad1: 0 },
    };
    let environment = match description.sky.as_ref().and_then(description::Sky::panorama) {
        Some((image, scale, rotation)) => {
            Some(environment::lower(image, scale, rotation).map_err(inconsistent)?)
        }
        None => None,
    };
    let mut textures = texture::Packer::default();
    let mut layers = Vec::new();
    let mut materials = Vec::with_capacity(description.materials.len());
    let fading = |mesh: &&Mesh| mesh.colors.iter().any(|color| color[3] < 1.0);
    let fading: HashSet<usize> = description.meshes.iter().filter(fading).map(|mesh| mesh.material).collect();
    for (index, material) in description.materials.iter().enumerate() {
        let fades = fading.contains(&index);
        let record = material::lower(material, fades, &description.images, (&mut textures, &mut layers));
        materials.push(record.map_err(inconsistent)?);
    }
    let geometry = geometry::lower(description, sharing).map_err(inconsistent)?;
    let mut warnings = description.warnings.clone();
    warnings.extend(geometry.warnings);
    let scene = Scene {
        name: name.to_owned(),
        camera: *camera,
        sky,
        environment,
        spheres: geometry.spheres,
        flats: geometry.flats,
        triangles: geometry.triangles,
        shading: geometry.shading,
        shared: geometry.shared,
        attributes: geometry.attributes,
        materials,
        layers,
        textures: textures.textures,
        texels: textures.texels,
        lights: description.lights.iter().map(PunctualLight::record).collect(),
        warnings,
        image: *image,
    };
    scene.validate()?;
    Ok(scene)
}

/// Returns the unit vector along `v`, in f32.
fn unit(v: DVec3) -> Vec3 {
    v.normalize_or_zero().as_vec3()
}

/// Returns a camera that sees a whole ball from above and in front.
pub(super) fn camera_for(center: DVec3, radius: f64) -> CameraPose {
    let vertical_fov = 40f64.to_radians();
    let distance = 1.1 * radius / (0.5 * vertical_fov).sin();
    CameraPose {
        look_from: center + DVec3::new(0.35, 0.3, 1.0).normalize() * distance,
        look_at: center,
        vertical_fov,
        // A pinhole has everything in focus.
        focus_distance: distance.clamp(MIN_MAGNITUDE, MAX_MAGNITUDE),
        ..CameraPose::PINHOLE
    }
}
