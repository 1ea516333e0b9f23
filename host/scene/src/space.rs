//! The space that the renderer computes in: an origin and a unit of length other than the file's,
//! so that single precision has digits for what is seen. It is applied in f64, before anything is
//! rounded.

use super::description::{
    Description, Instance, MetallicRoughness, Portal, PunctualLight, Shape, ShapeKind, Surface,
};
use super::ranges::MAX_INTENSITY;
use super::values::{MAX_MAGNITUDE, MIN_MAGNITUDE};
use super::{CameraPose, limits, part_names as names};
use glam::{DAffine3, DVec3};
use serde::{Serialize, Serializer};

/// Radii that keep a disc a plane, without a visible border, in any space. `trisect::lights`
/// recognises planes by the minimum.
const PLANE: std::ops::RangeInclusive<f64> = 1e11..=MAX_MAGNITUDE;

/// The space that the renderer computes in: a point p of the scene is at (p - `origin`) · `scale`
/// there.
///
/// The image stays the same, except for rounding:
///
/// * Lengths scale with `scale`: positions, radii, edges, meshes and the camera's focus distance.
/// * The intensity of point and spot lights (power per solid angle) scales with its square, as the
///   squares of their distances do, so that their irradiance stays.
/// * Emitted radiance, the irradiance of directional lights, the sky and panoramas, directions,
///   angles and textures have no length and stay as they are.
///
/// With a power of two as `scale` and no origin, the CPU's image keeps its bits, as long as no
/// number leaves the range of f32.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Rebase {
    /// Point of the scene that becomes 0, in the scene's units; each coordinate at most 1e18 from
    /// 0.
    #[serde(serialize_with = "triple")]
    #[cfg_attr(feature = "schema", schemars(with = "[f64; 3]"))]
    pub origin: DVec3,
    /// Factor on all lengths, between 1e-18 and 1e18. A power of two rounds nothing.
    pub scale: f64,
}

/// Serializes a vector as a list of three numbers.
pub(crate) fn triple<S: Serializer>(vector: &DVec3, serializer: S) -> Result<S::Ok, S::Error> {
    vector.to_array().serialize(serializer)
}

impl Default for Rebase {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Rebase {
    /// The scene's own space.
    pub const IDENTITY: Self = Self { origin: DVec3::ZERO, scale: 1.0 };

    /// Returns the scene's `point` in this space.
    pub fn point(&self, point: DVec3) -> DVec3 {
        (point - self.origin) * self.scale
    }

    /// Returns the scene's camera in this space.
    pub fn camera(&self, pose: &CameraPose) -> CameraPose {
        CameraPose {
            look_from: self.point(pose.look_from),
            look_at: self.point(pose.look_at),
            ..pose.map_lengths(|length| length * self.scale)
        }
    }

    /// Returns a camera of this space in the scene: the inverse of [`Self::camera`].
    pub fn camera_of(&self, pose: &CameraPose) -> CameraPose {
        let back = |point: DVec3| point / self.scale + self.origin;
        CameraPose {
            look_from: back(pose.look_from),
            look_at: back(pose.look_at),
            ..pose.map_lengths(|length| length / self.scale)
        }
    }

    /// Returns the combination of this space and then `next` as one space.
    pub fn then(self, next: Self) -> Self {
        Self { origin: self.origin + next.origin / self.scale, scale: self.scale * next.scale }
    }

    fn check(&self) -> Result<(), String> {
        if !in_world(self.origin) {
            return Err(format!("space: the origin {} goes beyond 1e18", self.origin));
        }
        if !is_length(self.scale) {
            return Err(format!("space: the scale {:e} is not between 1e-18 and 1e18", self.scale));
        }
        Ok(())
    }

    fn place(&self, map: &DAffine3) -> DAffine3 {
        DAffine3 { matrix3: map.matrix3 * self.scale, translation: self.point(map.translation) }
    }
}

fn in_world(point: DVec3) -> bool {
    point.abs().cmple(DVec3::splat(MAX_MAGNITUDE)).all()
}

fn is_length(length: f64) -> bool {
    (MIN_MAGNITUDE..=MAX_MAGNITUDE).contains(&length)
}

impl Description {
    /// Moves the scene to another space; see [`Rebase`] for what changes. [`Rebase::IDENTITY`]
    /// changes nothing.
    ///
    /// # Errors
    ///
    /// A message that names an object and how it leaves the ranges of a scene file.
    pub fn move_to(&mut self, space: Rebase) -> Result<(), String> {
        if space == Rebase::IDENTITY {
            return Ok(());
        }
        space.check()?;
        let fault = |what: String| {
            format!("in the space with origin {} and scale {:e}, {what}", space.origin, space.scale)
        };
        for (name, camera) in &mut self.cameras {
            let axis = (camera.look_at - camera.look_from) * space.scale;
            camera.look_from = space.point(camera.look_from);
            camera.look_at = camera.look_from + axis;
            *camera = camera.map_lengths(|length| length * space.scale);
            let beyond = || {
                "it goes beyond 1e18, or its focus_distance or height is not between 1e-18 and 1e18"
                    .to_owned()
            };
            let inside = in_world(camera.look_from)
                && in_world(camera.look_at)
                && is_length(camera.focus_distance)
                && (camera.parallel_height == 0.0 || is_length(camera.parallel_height));
            let checked = if inside { camera.check_together() } else { Err(beyond()) };
            checked.map_err(|reason| fault(format!("the camera \"{name}\" is invalid: {reason}")))?;
        }
        for (index, shape) in self.shapes.iter_mut().enumerate() {
            shape.move_to(space).map_err(|reason| fault(format!("shape {index} {reason}")))?;
        }
        for Instance { mesh, transform } in &mut self.instances {
            *transform = space.place(transform);
            let name = || self.meshes.get(*mesh).map_or("", |mesh| mesh.name.as_str());
            if !limits::in_range(transform) {
                return Err(fault(format!("the mesh \"{}\" goes beyond 1e18", name())));
            }
            if limits::is_singular(transform) {
                return Err(fault(format!("the mesh \"{}\" is scaled to nothing", name())));
            }
        }
        for material in &mut self.materials {
            if let Surface::MetallicRoughness(MetallicRoughness { layers, .. }) = &mut material.surface {
                layers.scale(space.scale);
            }
        }
        for medium in &mut self.media {
            medium.move_to(space.scale, |map| space.place(map));
            let name = names::medium(&medium.name);
            medium.check().map_err(|reason| fault(format!("the {name} is invalid: {reason}")))?;
        }
        if let Some(ground) = &mut self.ground {
            (ground.center, ground.size) = (space.point(ground.center), ground.size * space.scale);
            if !(in_world(ground.center) && is_length(ground.size)) {
                return Err(fault("the ground goes beyond 1e18, or is scaled to nothing".to_owned()));
            }
        }
        for (index, light) in self.lights.iter_mut().enumerate() {
            light.move_to(space).map_err(|reason| fault(format!("light {index} {reason}")))?;
        }
        for (index, Portal { corner, u, v }) in self.portals.iter_mut().enumerate() {
            move_quad(space, corner, u, v).map_err(|reason| fault(format!("portal {index} {reason}")))?;
        }
        Ok(())
    }
}

/// Moves and scales a parallelogram.
fn move_quad(space: Rebase, corner: &mut DVec3, u: &mut DVec3, v: &mut DVec3) -> Result<(), &'static str> {
    (*corner, *u, *v) = (space.point(*corner), *u * space.scale, *v * space.scale);
    if ![*corner, *u, *v].into_iter().all(in_world) {
        return Err("goes beyond 1e18");
    }
    limits::has_area(*u, *v).map_err(|_| "has sides that are too short, or too near to parallel")
}

impl Shape {
    fn move_to(&mut self, space: Rebase) -> Result<(), &'static str> {
        let is_plane = self.kind.is_plane();
        let (point, size) = match &mut self.kind {
            ShapeKind::Sphere { center, radius } => {
                *radius *= space.scale;
                (center, *radius)
            }
            ShapeKind::Disc { center, radius, .. } => {
                let moved = *radius * space.scale;
                *radius = if is_plane { moved.clamp(*PLANE.start(), *PLANE.end()) } else { moved };
                (center, *radius)
            }
            ShapeKind::Quad { corner, u, v } => return move_quad(space, corner, u, v),
        };
        *point = space.point(*point);
        if !in_world(*point) {
            return Err("goes beyond 1e18");
        }
        if is_length(size) { Ok(()) } else { Err("has a radius that is not between 1e-18 and 1e18") }
    }
}

impl PunctualLight {
    fn move_to(&mut self, space: Rebase) -> Result<(), &'static str> {
        let Some((position, intensity)) = self.parts_mut().placed else { return Ok(()) };
        *position = space.point(*position);
        *intensity *= space.scale * space.scale;
        if !in_world(*position) {
            return Err("goes beyond 1e18");
        }
        if intensity.max_element() <= MAX_INTENSITY { Ok(()) } else { Err("has an intensity beyond 1e36") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn description() -> Description {
        let camera = CameraPose {
            look_from: DVec3::new(5.0, 6.0, 8.0),
            look_at: DVec3::new(5.0, 6.0, 7.0),
            vertical_fov: 1.0,
            defocus_angle: 0.1,
            focus_distance: 3.0,
            ..CameraPose::PINHOLE
        };
        let center = DVec3::new(6.0, 6.0, 7.0);
        let shape = |kind| Shape { kind, material: 0 };
        Description {
            cameras: vec![("camera".to_owned(), camera)],
            shapes: vec![
                shape(ShapeKind::Sphere { center, radius: 0.5 }),
                shape(ShapeKind::Quad { corner: center, u: DVec3::X, v: DVec3::Y * 2.0 }),
                shape(ShapeKind::Disc { center, normal: DVec3::Y, radius: MAX_MAGNITUDE }),
            ],
            instances: vec![Instance { mesh: 0, transform: DAffine3::from_translation(center) }],
            lights: vec![
                PunctualLight::Point { position: center, intensity: DVec3::ONE },
                PunctualLight::Directional { direction: DVec3::X, irradiance: DVec3::ONE },
            ],
            portals: vec![Portal { corner: center, u: DVec3::X, v: DVec3::Y * 2.0 }],
            ..Description::default()
        }
    }

    #[test]
    fn all_that_has_a_length_moves() {
        let mut moved = description();
        let space = Rebase { origin: DVec3::new(5.0, 6.0, 7.0), scale: 4.0 };
        moved.move_to(space).unwrap();
        let camera = moved.cameras[0].1;
        assert_eq!((camera.look_from, camera.look_at), (DVec3::Z * 4.0, DVec3::ZERO));
        assert_eq!((camera.focus_distance, camera.vertical_fov, camera.defocus_angle), (12.0, 1.0, 0.1));
        let center = DVec3::X * 4.0;
        assert_eq!(moved.shapes[0].kind, ShapeKind::Sphere { center, radius: 2.0 });
        let quad = ShapeKind::Quad { corner: center, u: DVec3::X * 4.0, v: DVec3::Y * 8.0 };
        assert_eq!(moved.shapes[1].kind, quad);
        assert_eq!(moved.portals, [Portal { corner: center, u: DVec3::X * 4.0, v: DVec3::Y * 8.0 }]);
        assert_eq!(moved.shapes[2].kind, ShapeKind::Disc { center, normal: DVec3::Y, radius: MAX_MAGNITUDE });
        let map = moved.instances[0].transform;
        assert_eq!(map.transform_point3(DVec3::Z), DVec3::new(4.0, 0.0, 4.0));
        assert_eq!(moved.lights[0], PunctualLight::Point { position: center, intensity: DVec3::splat(16.0) });
        assert_eq!(moved.lights[1], description().lights[1]);
        // Two spaces, one after the other, equal their combination.
        let next = Rebase { origin: DVec3::new(-2.0, 0.5, 8.0), scale: 0.25 };
        let mut at_once = description();
        moved.move_to(next).unwrap();
        at_once.move_to(space.then(next)).unwrap();
        assert_eq!((&moved.shapes[..2], &moved.lights), (&at_once.shapes[..2], &at_once.lights));
    }

    #[test]
    fn what_leaves_the_world_is_refused() {
        let refused =
            |origin: DVec3, scale: f64| description().move_to(Rebase { origin, scale }).unwrap_err();
        assert!(refused(DVec3::NAN, 1.0).contains("origin"));
        for scale in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e19, 1e-19] {
            assert!(refused(DVec3::ZERO, scale).contains("scale"), "{scale}");
        }
        assert!(refused(DVec3::ZERO, 1e18).contains("camera"));
        let without_camera = |scale: f64| {
            let mut scene = description();
            scene.cameras.clear();
            scene.move_to(Rebase { origin: DVec3::ZERO, scale }).unwrap_err()
        };
        assert!(without_camera(1e18).contains("shape 0 goes beyond"));
        let mut tiny = description();
        tiny.shapes[0].kind = ShapeKind::Sphere { center: DVec3::ZERO, radius: 1e-10 };
        assert!(tiny.move_to(Rebase { origin: DVec3::ZERO, scale: 1e-10 }).unwrap_err().contains("radius"));
    }
}
