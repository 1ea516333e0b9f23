//! Bounding boxes of primitives.

use glam::{DVec3, Vec3, Vec3A};
use obvhs::Boundable;
use obvhs::aabb::Aabb;
use trisect_scene::{Scene, SharedInstance};
use trisect_shared::math::unit_f32;
use trisect_shared::planar::{DISC, Planar};
use trisect_shared::rng::PathKey;
use trisect_shared::sphere::Sphere;
use trisect_shared::triangle::Triangle;

/// Axis-aligned box. The builder's own type may have the vectors of another version of glam, if
/// someone builds without this project's lock file, so conversions pass plain numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub min: Vec3A,
    pub max: Vec3A,
}

impl Bounds {
    /// Box that contains nothing.
    pub const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY };

    /// Converts a box of the builder.
    pub fn of(aabb: &Aabb) -> Self {
        Self { min: Vec3A::from_array(aabb.min.to_array()), max: Vec3A::from_array(aabb.max.to_array()) }
    }

    /// Returns the minimum and the maximum corner, as nodes store them.
    pub fn corners(&self) -> (Vec3, Vec3) {
        (self.min.into(), self.max.into())
    }

    pub fn center(&self) -> Vec3A {
        (self.max + self.min) * 0.5
    }

    /// Returns the cube around the box, from its lower corner.
    pub fn cube(self) -> Self {
        let extent = (self.max - self.min).max_element();
        Self { min: self.min, max: self.max.max(self.min + extent) }
    }

    pub fn half_area(&self) -> f32 {
        let size = self.max - self.min;
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    /// Returns the union of several boxes.
    pub fn union(all: impl Iterator<Item = Self>) -> Self {
        all.fold(Self::EMPTY, |a, b| Self { min: a.min.min(b.min), max: a.max.max(b.max) })
    }
}

/// Box of each primitive, by its number. An array of all would take 32 bytes for each.
pub(super) type BoxOf<'a> = &'a (dyn Fn(u32) -> Bounds + Sync);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        Aabb::new(self.min.to_array().into(), self.max.to_array().into())
    }
}

/// Returns a box padded so that it contains the primitive whatever rounding does to its corners and
/// to a ray that touches one. The padding along an axis is 2 ULP of a sum: the farthest coordinate
/// on that axis plus the box's largest extent, which keeps the padding above zero at the origin.
fn padded(low: Vec3, high: Vec3) -> Bounds {
    let (low, high) = (Vec3A::from(low), Vec3A::from(high));
    let extent = Vec3A::splat((high - low).max_element());
    let pad = (low.abs().max(high.abs()) + extent) * (2.0 * f32::EPSILON);
    Bounds { min: low - pad, max: high + pad }
}

pub(super) fn sphere_bounds(sphere: &Sphere) -> Bounds {
    padded(sphere.center - sphere.radius, sphere.center + sphere.radius)
}

fn flat_bounds(flat: &Planar) -> Bounds {
    let (u, v) = (flat.edge_u, flat.edge_v);
    if flat.kind == DISC {
        let reach = Vec3::from_array(std::array::from_fn(|i| u[i].hypot(v[i])));
        return padded(flat.origin - reach, flat.origin + reach);
    }
    let corners = [flat.origin, flat.origin + u, flat.origin + v, flat.origin + u + v];
    let low = corners.into_iter().fold(Vec3::INFINITY, Vec3::min);
    padded(low, corners.into_iter().fold(Vec3::NEG_INFINITY, Vec3::max))
}

pub(super) fn triangle_bounds(t: &Triangle) -> Bounds {
    padded(t.a.min(t.b).min(t.c), t.a.max(t.b).max(t.c))
}

/// Returns the box moved by up to 1/1000 of its size, each box by another amount. PLOC merges boxes
/// that are each other's best neighbours; in a row of equal boxes only the first two are, so the
/// row would take a pass for each box.
pub(super) fn shifted(index: u32, bounds: &Bounds) -> Bounds {
    let size = bounds.max - bounds.min;
    let w = PathKey { seed: 0, pixel: index, sample: 0 }.words(0);
    let shift = size * 1e-3 * Vec3A::new(unit_f32(w.x), unit_f32(w.y), unit_f32(w.z));
    Bounds { min: bounds.min + shift, max: bounds.max + shift }
}

/// Returns the box of an instance: that of the corners of its mesh's box, padded for the rounding
/// of a ray's way into the mesh's coordinates, which is relative to the coordinates in the world.
fn instance_bounds(scene: &Scene, instance: &SharedInstance) -> Bounds {
    let corners = || scene.shared.corners(instance);
    let low = corners().fold(DVec3::INFINITY, DVec3::min);
    let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
    let reach = low.abs().max(high.abs()) + (high - low).max_element();
    let pad = reach * (INSTANCE_PADDING * f64::from(f32::EPSILON));
    padded((low - pad).as_vec3(), (high + pad).as_vec3())
}

/// Padding of an instance's box, in ULP: 10 roundings of a map there and back, each of a sum of up
/// to three coordinates.
const INSTANCE_PADDING: f64 = 16.0;

/// Returns the box of a primitive in the world, or of an instance, whose numbers follow.
pub(super) fn primitive_bounds(scene: &Scene, index: u32) -> Bounds {
    let index = index as usize;
    let first_flat = scene.spheres.len();
    let first_triangle = first_flat + scene.flats.len();
    let first_instance = first_triangle + scene.triangles.len();
    if index >= first_instance {
        instance_bounds(scene, &scene.shared.instances[index - first_instance])
    } else if index >= first_triangle {
        triangle_bounds(&scene.triangles[index - first_triangle])
    } else if index >= first_flat {
        flat_bounds(&scene.flats[index - first_flat])
    } else {
        sphere_bounds(&scene.spheres[index])
    }
}

/// Returns the boxes of all primitives in the world, then those of the instances.
#[cfg(test)]
pub(super) fn bounds(scene: &Scene) -> Vec<Bounds> {
    let count = scene.world_primitives() + scene.shared.instances.len();
    (0..count as u32).map(|index| primitive_bounds(scene, index)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_contain_their_spheres() {
        for (center, radius) in [(0.0f32, 1e-6f32), (1e6, 1e-3), (-1000.0, 1000.0), (0.1, 0.2), (-1e18, 1e18)]
        {
            let sphere = Sphere { center: Vec3::splat(center), radius, material: 0, pad: [0; 3] };
            let b = sphere_bounds(&sphere);
            let (c, r) = (f64::from(center), f64::from(radius));
            assert!(f64::from(b.min.x) < c - r && f64::from(b.max.x) > c + r, "{center} {radius}");
        }
    }
}
