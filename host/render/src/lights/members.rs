//! Lights of a scene as members of a light tree.

use super::bounds::{Bounds, Cone};
use super::tree::Member;
use glam::{DVec3, Vec3};
use std::f64::consts::{FRAC_PI_2, PI};
use trisect_scene::Scene;
use trisect_shared::light::{AREA, DIRECTIONAL, Light};
use trisect_shared::material::{EMITS_BOTH_SIDES, Material};
use trisect_shared::math::luminance;
use trisect_shared::planar::{DISC, Planar};

/// Returns the lights of `scene`, whose records are `lights`, with their bounds.
pub(super) fn of(scene: &Scene, lights: &[Light]) -> Vec<Member> {
    let member = |(index, light): (usize, &Light)| {
        let bounds = if light.kind == AREA { of_primitive(scene, light.primitive) } else { of_light(light) };
        Member { light: index as u32, distant: light.kind == DIRECTIONAL, bounds }
    };
    lights.iter().enumerate().map(member).collect()
}

/// Returns the bounds of a point, spot or directional light.
fn of_light(light: &Light) -> Bounds {
    let (at, strength) = (light.position.as_dvec3(), f64::from(luminance(light.intensity)));
    let cone = if light.kind == DIRECTIONAL {
        Cone { axis: at.normalize(), angle: 0.0 }
    } else if light.cone_scale > 0.0 {
        // The cosine of the outer half angle.
        let outer = -f64::from(light.cone_offset / light.cone_scale);
        Cone { axis: light.axis.as_dvec3().normalize(), angle: outer.clamp(-1.0, 1.0).acos() }
    } else {
        Cone::ALL
    };
    Bounds { low: at, high: at, cone, end: 0.0, strength }
}

/// Returns the bounds of a primitive that emits.
fn of_primitive(scene: &Scene, primitive: u32) -> Bounds {
    let index = primitive as usize;
    let (spheres, flats) = (scene.spheres.len(), scene.flats.len());
    let radiance = |material: u32| f64::from(scene.materials[material as usize].light_pdf);
    if let Some(sphere) = scene.spheres.get(index) {
        let (center, radius) = (sphere.center.as_dvec3(), f64::from(sphere.radius));
        // It is seen as a disc.
        let strength = radiance(sphere.material) * PI * radius * radius;
        return Bounds { low: center - radius, high: center + radius, cone: Cone::ALL, end: 0.0, strength };
    }
    if let Some(flat) = index.checked_sub(spheres).and_then(|index| scene.flats.get(index)) {
        let (low, high) = bounds_of_flat(flat);
        let normal = flat.normal.as_dvec3();
        return of_surface(scene, flat.material, (low, high), normal, f64::from(flat.area));
    }
    let triangle = &scene.triangles[index - spheres - flats];
    let corners = [triangle.a, triangle.b, triangle.c].map(Vec3::as_dvec3);
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let material = scene.vertices[triangle.vertex_a as usize].material;
    of_surface(scene, material, bounds_of(&corners), normal, 0.5 * normal.length())
}

/// Returns the bounds of a flat surface with this normal, of any length.
fn of_surface(scene: &Scene, material: u32, (low, high): (DVec3, DVec3), normal: DVec3, area: f64) -> Bounds {
    let material: &Material = &scene.materials[material as usize];
    let cone = if material.flags & EMITS_BOTH_SIDES != 0 {
        Cone::ALL
    } else {
        Cone { axis: normal.try_normalize().unwrap_or(DVec3::Z), angle: 0.0 }
    };
    Bounds { low, high, cone, end: FRAC_PI_2, strength: f64::from(material.light_pdf) * area }
}

/// Returns the corners of the box around a quad or disc.
pub(super) fn bounds_of_flat(flat: &Planar) -> (DVec3, DVec3) {
    let [origin, u, v] = [flat.origin, flat.edge_u, flat.edge_v].map(Vec3::as_dvec3);
    if flat.kind == DISC {
        let half = (u * u + v * v).map(f64::sqrt);
        (origin - half, origin + half)
    } else {
        bounds_of(&[origin, origin + u, origin + v, origin + u + v])
    }
}

/// Returns the corners of the box around points.
pub(super) fn bounds_of(corners: &[DVec3]) -> (DVec3, DVec3) {
    let (low, high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    corners.iter().fold((low, high), |(low, high), corner| (low.min(*corner), high.max(*corner)))
}
