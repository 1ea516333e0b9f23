//! Checks the eye, and small objects, against a surface that they are near to.
//!
//! A sphere's test subtracts squares: c = |o - C|² - R². Its terms are rounded by u R² (u = 2⁻²⁴),
//! while c is 2 R h at height h, so the distance is off by R u / h of itself. The hit is off by
//! R u, which is R u / s of the size of an object of size s that rests on the sphere. A plane's
//! test adds products of coordinates and normal, each rounded by u of itself. Measured errors agree
//! (docs/reference/supported-ranges.md).

use super::finding::{Finding, Limit, Predicted, Severity, Supported, Unit};
use super::{RELATIVE, ROUNDING, geometry};
use crate::SceneDocument;
use crate::description::ShapeKind;
use crate::part_names as names;
use glam::DVec3;

const SPHERE: &str = "use a `Plane` (or a `Quad`) as ground instead of a large sphere, or keep the eye and small objects away from it";
pub(super) const FLAT: &str =
    "give a `Plane` a `point` near the eye; with the field `space`, move the renderer's origin to the eye";

/// Returns the error of hits on a sphere, from the rounding of its radius or position. `None` if
/// the sphere is too small for its distance from the origin, which is another finding.
fn rounding(center: DVec3, radius: f64, origin: DVec3) -> Option<f64> {
    let far = (center - origin).abs().max_element();
    (far * ROUNDING <= RELATIVE * radius).then_some(radius.max(far) * ROUNDING)
}

/// Returns the remedy for a sphere. Near the origin, where its position is not the larger number,
/// only another shape helps.
fn remedy(center: DVec3, radius: f64, origin: DVec3) -> &'static str {
    if (center - origin).abs().max_element() > 2.0 * radius { geometry::FAR } else { SPHERE }
}

/// Returns the error of the distance to a surface, in the scene's units, and the eye's height above
/// it. `None` if the surface is not below the eye.
fn error(kind: &ShapeKind, eye: DVec3, origin: DVec3) -> Option<(f64, f64)> {
    let flat = |point: DVec3, normal: DVec3| {
        let to = eye - point;
        let terms = (point - origin).abs() + (eye - origin).abs() + to.abs();
        ((terms * normal.abs()).element_sum() * ROUNDING, to.dot(normal).abs())
    };
    match *kind {
        ShapeKind::Sphere { center, radius } => {
            Some((rounding(center, radius, origin)?, (eye.distance(center) - radius).abs()))
        }
        ShapeKind::Disc { center, normal, radius } => {
            let (error, height) = flat(center, normal.normalize_or_zero());
            let aside = ((eye - center).length_squared() - height * height).max(0.0).sqrt();
            (aside <= radius).then_some((error, height))
        }
        ShapeKind::Quad { corner, u, v } => {
            let normal = u.cross(v);
            let from = eye - corner;
            let along = |a: DVec3, b: DVec3| a.cross(b).dot(normal) / normal.length_squared();
            let inside = |x: f64| (0.0..=1.0).contains(&x);
            (inside(along(from, v)) && inside(along(u, from)))
                .then(|| flat(corner, normal.normalize_or_zero()))
        }
    }
}

/// Maximum number of spheres that are checked as ground for others, the largest first. Comparing
/// each with each would take too long.
const GROUNDS: usize = 16;

/// Adds findings for large spheres, each with the smallest sphere that rests on it.
fn grounds(scene: &SceneDocument, found: &mut Vec<Finding>) {
    let shapes = &scene.description.shapes;
    let mut spheres: Vec<(usize, DVec3, f64)> = shapes
        .iter()
        .enumerate()
        .filter_map(|(index, shape)| match shape.kind {
            ShapeKind::Sphere { center, radius } => Some((index, center, radius)),
            _ => None,
        })
        .collect();
    spheres.sort_by(|a, b| b.2.total_cmp(&a.2));
    for &(index, center, radius) in spheres.iter().take(GROUNDS) {
        let Some(error) = rounding(center, radius, scene.space.origin) else { continue };
        let gap = |other: DVec3, size: f64| (other.distance(center) - radius).abs() - size;
        let resting = spheres.iter().filter(|&&(_, other, size)| size < radius && gap(other, size) < size);
        let least = resting.map(|sphere| sphere.2).fold(f64::INFINITY, f64::min);
        if error > RELATIVE * least {
            found.push(Finding {
                limit: Limit::NearSurface,
                severity: Severity::Warning,
                triangles: None,
                what: names::shape(&scene.description, index, &shapes[index]),
                quantity: "radius of the smallest sphere on it",
                measured: least,
                supported: Supported::AtLeast(error / RELATIVE),
                predicted: Predicted::share(error / least, Unit::Size),
                remedy: remedy(center, radius, scene.space.origin),
            });
        }
    }
}

pub(super) fn check(scene: &SceneDocument, found: &mut Vec<Finding>) {
    grounds(scene, found);
    let Some((_, camera)) = scene.description.cameras.first() else { return };
    for (index, shape) in scene.description.shapes.iter().enumerate() {
        let Some((error, height)) = error(&shape.kind, camera.look_from, scene.space.origin) else {
            continue;
        };
        // Written so that a height of 0 gives a finding.
        if error > RELATIVE * height {
            let remedy = match shape.kind {
                ShapeKind::Sphere { center, radius } => remedy(center, radius, scene.space.origin),
                _ => FLAT,
            };
            found.push(Finding {
                limit: Limit::NearSurface,
                severity: Severity::Warning,
                triangles: None,
                what: names::shape(&scene.description, index, shape),
                quantity: "the eye's distance from it",
                measured: height,
                supported: Supported::AtLeast(error / RELATIVE),
                predicted: Predicted::share(error / height, Unit::Distance),
                remedy,
            });
        }
    }
}
