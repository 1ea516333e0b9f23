//! Checks the size of primitives against their distance from the origin and against the range of
//! f32.
//!
//! A coordinate x is rounded by up to u |x|, where u = 2⁻²⁴. So a primitive of size s at distance
//! |p| from the origin, and the distance to it, are off by |p| u / s of its size. Near |p| = s 2²³
//! nothing of it is left. Measured errors of spheres agree (docs/reference/supported-ranges.md).

use super::finding::{Finding, Limit, Predicted, Severity, Supported, Triangles, Unit};
use super::{RELATIVE, ROUNDING};
use crate::description::ShapeKind;
use crate::mesh_boxes;
use crate::part_names as names;
use crate::{Rebase, SceneDocument};
use glam::{DVec3, Vec3};
use trisect_shared::triangle::Triangle;

pub(super) const FAR: &str =
    "move the renderer's origin to the scene, with the field `space`: `precision::write` computes it";
pub(super) const SMALL: &str = "scale the scene up, with the field `space`: `precision::write` computes it";

/// Returns the minimum radius whose square f32 holds to [`RELATIVE`] on a device that flushes
/// subnormal numbers to 0. Of the three squares of the vector to the centre, each that is below the
/// smallest normal number may be lost.
pub(super) fn min_radius() -> f64 {
    (3.0 * f64::from(f32::MIN_POSITIVE) / RELATIVE).sqrt()
}

/// Returns the largest coordinate of a point relative to the renderer's origin, in the scene's
/// units.
pub(super) fn distance(space: Rebase, point: DVec3) -> f64 {
    (point - space.origin).abs().max_element()
}

/// Returns the smallest altitude of a triangle: twice its area over its longest side. Rounding of
/// vertices must stay below it.
fn altitude([a, b, c]: [DVec3; 3]) -> f64 {
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    (b - a).cross(c - a).length() / longest
}

fn far(what: String, distance: f64, size: f64) -> Option<Finding> {
    let error = distance * ROUNDING / size;
    (error > RELATIVE).then(|| Finding {
        limit: Limit::FarFromOrigin,
        severity: Severity::Warning,
        triangles: None,
        what,
        quantity: "distance from the origin over size",
        measured: distance / size,
        supported: Supported::AtMost(RELATIVE / ROUNDING),
        predicted: Predicted::share(error, Unit::Size),
        remedy: FAR,
    })
}

pub(super) fn check(scene: &SceneDocument, found: &mut Vec<Finding>) {
    let (space, description) = (scene.space, &scene.description);
    for (index, shape) in description.shapes.iter().enumerate() {
        let name = || names::shape(description, index, shape);
        let (place, size) = match shape.kind {
            ShapeKind::Sphere { center, radius } => {
                let length = radius * space.scale;
                if length < min_radius() {
                    found.push(Finding {
                        limit: Limit::TooSmall,
                        severity: Severity::Warning,
                        triangles: None,
                        what: name(),
                        quantity: "radius in the renderer",
                        measured: length,
                        supported: Supported::AtLeast(min_radius()),
                        predicted: Predicted::share((min_radius() / length).powi(2) * RELATIVE, Unit::Size),
                        remedy: SMALL,
                    });
                }
                (distance(space, center), radius)
            }
            ShapeKind::Disc { center, radius, .. } => (distance(space, center), radius),
            ShapeKind::Quad { corner, u, v } => {
                let corners = [corner, corner + u, corner + v, corner + u + v];
                let farthest = corners.into_iter().map(|p| distance(space, p)).fold(0.0, f64::max);
                (farthest, u.cross(v).length() / u.length().max(v.length()))
            }
        };
        found.extend(far(name(), place, size));
    }
    let first = found.len();
    let mut touched = AffectedTriangles::default();
    for index in mesh_boxes::examined(description) {
        mesh(scene, index, &mut touched, found);
    }
    for finding in found.iter_mut().skip(first) {
        let part = if finding.limit == Limit::FarFromOrigin { touched.far } else { touched.flat };
        if part.is_little_of(&touched.all) {
            finding.severity = Severity::Note;
        }
    }
}

/// A finding is a note if it affects less than this share of the triangles, and of their area.
const MAX_NOTE_SHARE: f64 = 1e-3;

/// Number and total area of some triangles.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    count: usize,
    area: f64,
}

impl Share {
    fn add(&mut self, area: f64) {
        self.count += 1;
        self.area += area;
    }

    /// Returns whether the share is small by number and by area. Both count, because a floor may be
    /// two triangles.
    fn is_little_of(&self, all: &Self) -> bool {
        (self.count as f64) < MAX_NOTE_SHARE * all.count as f64 && self.area <= MAX_NOTE_SHARE * all.area
    }
}

/// All triangles of a scene, and those that each kind of finding affects.
#[derive(Debug, Default)]
struct AffectedTriangles {
    all: Share,
    far: Share,
    flat: Share,
}

/// Adds findings for the triangles of an instance that are far from the origin, or without area.
/// Each has the worst triangle and the number of affected ones.
fn mesh(scene: &SceneDocument, index: usize, touched: &mut AffectedTriangles, found: &mut Vec<Finding>) {
    let (space, description) = (scene.space, &scene.description);
    let instance = &description.instances[index];
    let Some(mesh) = description.meshes.get(instance.mesh) else { return };
    let world: Vec<DVec3> = mesh
        .positions
        .iter()
        .map(|&p| instance.transform.transform_point3(Vec3::from(p).as_dvec3()))
        .collect();
    let (mut far_count, mut flat_count) = (0usize, 0usize);
    let mut worst = (0.0, 0.0, 1.0);
    let mut least_square = f64::INFINITY;
    for triangle in &mesh.triangles {
        let [Some(&a), Some(&b), Some(&c)] = triangle.map(|corner| world.get(corner as usize)) else {
            continue;
        };
        let size = altitude([a, b, c]);
        let area = 0.5 * (b - a).cross(c - a).length();
        touched.all.add(area);
        let place = distance(space, a).max(distance(space, b)).max(distance(space, c));
        let error = place * ROUNDING / size;
        if error > RELATIVE {
            far_count += 1;
            touched.far.add(area);
        }
        if error > worst.0 {
            worst = (error, place, size);
        }
        let [a, b, c] = [a, b, c].map(|p| space.point(p).as_vec3());
        let square = Triangle::of([a, b, c]).normal().length_squared();
        if !(square > Triangle::MIN_SQUARE && square.is_finite()) {
            flat_count += 1;
            touched.flat.add(area);
            least_square = least_square.min(f64::from(square));
        }
    }
    let of = mesh.triangles.len();
    let counted = |count| format!("{}: {count} of {of} triangles", names::instance(description, index));
    if far_count > 0 {
        let finding = far(counted(far_count), worst.1, worst.2);
        let triangles = Some(Triangles { outside: far_count, of });
        found.extend(finding.map(|finding| Finding { triangles, ..finding }));
    }
    if flat_count > 0 {
        found.push(Finding {
            limit: Limit::TooSmall,
            severity: Severity::Warning,
            triangles: Some(Triangles { outside: flat_count, of }),
            what: counted(flat_count),
            quantity: "square of twice the area, the longest extent taken for 1, in f32",
            measured: least_square,
            supported: Supported::AtLeast(f64::from(Triangle::MIN_SQUARE)),
            predicted: Predicted::share(1.0, Unit::Primitives),
            remedy: "it is a line in single precision: leave it out, or make it wider",
        });
    }
}
