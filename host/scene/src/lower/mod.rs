//! Lowers a description to the device records of a [`Scene`]: applies transforms, packs images, and
//! rounds f64 to f32.

mod environment;
mod geometry;
mod ground;
mod looks;
mod material;
mod medium;
mod shared;
mod sharing;
mod tangents;
mod texture;
mod vertices;

pub(super) use ground::place as place_ground;
pub(super) use looks::Looks;

use super::ImageSettings;
use super::description::{Description, PunctualLight};
use super::error::SceneError;
use super::values::{MAX_MAGNITUDE, MIN_MAGNITUDE};
use super::{CameraPose, Scene, Sharing};
use glam::{DVec3, Vec3};
use trisect_shared::planar::QUAD;
use trisect_shared::sky::Sky;

/// Makes the records of a description; its first camera is used. `name` stands for the file in
/// messages. `looks` are taken as they are if they are those of the description, and replaced
/// otherwise.
pub(super) fn lower(
    description: &Description,
    image: &ImageSettings,
    name: &str,
    sharing: Sharing,
    looks: &mut Option<Looks>,
) -> Result<Scene, SceneError> {
    let inconsistent = |message: String| SceneError::Inconsistent { file: name.to_owned(), message };
    let Some((_, camera)) = description.cameras.first() else {
        return Err(inconsistent("no camera; add one".to_owned()));
    };
    let of = match looks.take() {
        Some(known) if known.are_of(description) => known,
        other => Looks::of(description, other.as_ref()).map_err(inconsistent)?,
    };
    let geometry = geometry::lower(description, sharing).map_err(inconsistent)?;
    let mut warnings = description.warnings.clone();
    warnings.extend(geometry.warnings);
    let mut scene = Scene {
        name: name.to_owned(),
        camera: *camera,
        sky: uniform(Vec3::ZERO),
        environment: None,
        spheres: geometry.spheres,
        flats: geometry.flats,
        triangles: geometry.triangles.into(),
        vertices: geometry.vertices.into(),
        shared: geometry.shared,
        materials: Vec::new(),
        layers: Vec::new(),
        textures: Vec::new(),
        texels: [].into(),
        media: Vec::new(),
        atmosphere: 0,
        lights: description.lights.iter().map(PunctualLight::record).collect(),
        portals: description
            .portals
            .iter()
            .map(|of| geometry::flat(QUAD, of.corner, of.u, of.v, 0))
            .collect(),
        warnings,
        image: *image,
    };
    of.give(&mut scene);
    *looks = Some(of);
    scene.validate()?;
    Ok(scene)
}

/// Returns a sky of the same radiance from everywhere.
fn uniform(radiance: Vec3) -> Sky {
    Sky { bottom: radiance, strength: 0.0, top: radiance, pad1: 0 }
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
