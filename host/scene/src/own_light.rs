//! Estimates whether a model's own lights carry its image.
//!
//! Compares the direct irradiance at points spread over the model with that of the sky that would
//! be added otherwise. Shadows are ignored: the estimate decides about a sky, not about an image.

use super::description::{Description, Instance, Material, Mesh, PunctualLight, Texels, TextureImage};
use super::mesh_boxes;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use std::sync::Arc;
use trisect_image::metrics::srgb;
use trisect_shared::math::luminance;

/// Number of points on the whole surface, and again on the surfaces that emit.
const POINTS: usize = 1024;
/// Minimum irradiance of a lit point, relative to that from a sky of radiance 1.
const MIN_IRRADIANCE: f64 = 1.0 / 16.0;
/// Minimum fraction of lit points. A lamp beside a convex body lights less than half of it.
const MIN_LIT_SHARE: f64 = 1.0 / 8.0;

/// Light of a model's own lights and emitting surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OwnLight {
    /// Neither lights nor surfaces that emit.
    Nothing,
    /// Too little light to show the model.
    Little,
    /// At least an eighth of the surface receives at least a sixteenth of the irradiance from a sky
    /// of radiance 1.
    Enough,
}

impl OwnLight {
    /// Estimates the light of a model.
    pub fn of(model: &Description) -> Self {
        let radiance: Vec<f64> =
            model.materials.iter().map(|material| emitted(material, &model.images)).collect();
        let of = |material: usize| radiance.get(material).copied().unwrap_or_default();
        let lights: Vec<&PunctualLight> =
            model.lights.iter().filter(|light| light.strength().max_element() > 0.0).collect();
        let emits = model.meshes.iter().any(|mesh| of(mesh.material) > 0.0);
        if model.shapes.iter().any(|shape| of(shape.material) > 0.0) {
            return Self::Enough; // model files have no shapes: who adds them knows what they light
        }
        if lights.is_empty() && !emits {
            return Self::Nothing;
        }
        let surface = spread(model, &|_| 1.0);
        let emitters = if emits { spread(model, &of) } else { Vec::new() };
        let sky = PI;
        let is_lit = |point: &&Point| {
            let least = MIN_IRRADIANCE * sky;
            let mut sum: f64 = lights.iter().map(|light| point.irradiance_of(light)).sum();
            for emitter in &emitters {
                if sum >= least {
                    break;
                }
                sum += point.irradiance_from(emitter);
            }
            sum >= least
        };
        let lit = surface.iter().filter(is_lit).count();
        // Without a surface, nothing is known about its light.
        if lit as f64 >= MIN_LIT_SHARE * surface.len() as f64 { Self::Enough } else { Self::Little }
    }
}

/// Returns the luminance that a material emits, averaged over its texture.
fn emitted(material: &Material, images: &[Arc<TextureImage>]) -> f64 {
    if material.emission.max_element() <= 0.0 {
        return 0.0;
    }
    let texture = material.emission_texture.as_ref().and_then(|texture| images.get(texture.image));
    let mean = texture.map_or(DVec3::ONE, |image| mean(image));
    f64::from(luminance((material.emission * mean).as_vec3()))
}

/// Returns the mean of an image's texels in linear light.
fn mean(image: &TextureImage) -> DVec3 {
    let bytes = |texels: &[[u8; 4]], linear: &dyn Fn(f32) -> f32| {
        let mut counts = [[0u64; 3]; 256];
        for [r, g, b, _] in texels {
            counts[usize::from(*r)][0] += 1;
            counts[usize::from(*g)][1] += 1;
            counts[usize::from(*b)][2] += 1;
        }
        let mut sum = DVec3::ZERO;
        for (value, [r, g, b]) in (0..=255u8).zip(counts) {
            sum += f64::from(linear(f32::from(value) / 255.0)) * DVec3::new(r as f64, g as f64, b as f64);
        }
        sum / texels.len().max(1) as f64
    };
    match &image.texels {
        Texels::Srgb8(texels) => bytes(texels, &srgb::decode),
        Texels::Linear8(texels) => bytes(texels, &|value| value),
        Texels::Float(texels) => {
            let sum: DVec3 = texels.iter().map(|&[r, g, b, _]| Vec3::new(r, g, b).as_dvec3()).sum();
            sum / texels.len().max(1) as f64
        }
    }
}

/// A point on the model's surface, in the world.
#[derive(Clone, Copy, Debug)]
struct Point {
    place: DVec3,
    /// Unit normal of the front.
    normal: DVec3,
    /// Area that the point represents.
    area: f64,
    /// Weight of the represented area: the radiance, for a point that emits.
    weight: f64,
    /// True if both sides emit.
    both_sides: bool,
}

impl Point {
    /// Returns the irradiance on this point's front from a point that emits.
    fn irradiance_from(&self, emitter: &Self) -> f64 {
        let to = emitter.place - self.place;
        let square = to.length_squared();
        if square == 0.0 {
            return 0.0;
        }
        let direction = to / square.sqrt();
        let facing = -emitter.normal.dot(direction);
        let facing = if emitter.both_sides { facing.abs() } else { facing.max(0.0) };
        let cosine = self.normal.dot(direction).max(0.0);
        // At most π times the radiance, however near the emitter is.
        emitter.weight * emitter.area * facing * cosine / (square + emitter.area / PI)
    }

    /// Returns the irradiance on this point's front from a light without extent.
    fn irradiance_of(&self, light: &PunctualLight) -> f64 {
        light.arrival(self.place).map_or(0.0, |(along, irradiance)| {
            f64::from(luminance(irradiance.as_vec3())) * self.normal.dot(-along).max(0.0)
        })
    }
}

/// Calls `visit` with each world triangle whose material has a positive weight, its corners
/// counter-clockwise seen from the front. In a large scene it visits a sample of the instances.
fn triangles(
    model: &Description,
    weight: &dyn Fn(usize) -> f64,
    visit: &mut dyn FnMut(&Mesh, f64, [DVec3; 3]),
) {
    let counts =
        |instance: &Instance| model.meshes.get(instance.mesh).is_some_and(|mesh| weight(mesh.material) > 0.0);
    for instance in mesh_boxes::sampled(model, counts) {
        let Some(mesh) = model.meshes.get(instance.mesh) else { continue };
        let weight = weight(mesh.material);
        if weight <= 0.0 {
            continue;
        }
        let mirrored = instance.transform.matrix3.determinant() < 0.0;
        let world = |corner: u32| {
            let position = mesh.positions.get(corner as usize)?;
            Some(instance.transform.transform_point3(Vec3::from(*position).as_dvec3()))
        };
        for triangle in &mesh.triangles {
            if let [Some(a), Some(b), Some(c)] = triangle.map(world) {
                visit(mesh, weight, if mirrored { [a, c, b] } else { [a, b, c] });
            }
        }
    }
}

/// Spreads [`POINTS`] points over the surface, in proportion to area times the weight of the
/// material.
fn spread(model: &Description, weight: &dyn Fn(usize) -> f64) -> Vec<Point> {
    let area = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a).length();
    let mut total = 0.0;
    triangles(model, weight, &mut |_, weight, corners| total += weight * area(corners));
    let step = total / POINTS as f64;
    let mut points = Vec::new();
    if !(step > 0.0 && step.is_finite()) {
        return points;
    }
    let (mut passed, mut next) = (0.0, 0.5 * step);
    triangles(model, weight, &mut |mesh, weight, corners| {
        passed += weight * area(corners);
        let [a, b, c] = corners;
        while next < passed && points.len() < POINTS {
            // The R2 sequence (Roberts, 2018), folded into the triangle.
            let index = points.len() as f64;
            let (u, v) = (
                (0.5 + index * 0.754_877_666_246_692_7).fract(),
                (0.5 + index * 0.569_840_290_998_053_3).fract(),
            );
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let material = model.materials.get(mesh.material);
            points.push(Point {
                place: a + (b - a) * u + (c - a) * v,
                normal: (b - a).cross(c - a).normalize_or_zero(),
                area: step / weight,
                weight,
                both_sides: material.is_some_and(|material| material.emits_both_sides),
            });
            next += step;
        }
    });
    points
}

#[cfg(test)]
mod tests;
