//! Distances from a point to shapes, in f64, for the rule on lights near surfaces.

use crate::description::{Description, Instance, ShapeKind};
use crate::mesh_boxes::MeshBoxes;
use glam::{DVec3, Vec3};

fn to_segment(point: DVec3, a: DVec3, b: DVec3) -> f64 {
    let along = b - a;
    let t = ((point - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    point.distance(a + along * t)
}

/// Returns the distance to a parallelogram or, if `triangle`, to its half at `corner`.
fn to_flat(point: DVec3, corner: DVec3, u: DVec3, v: DVec3, triangle: bool) -> f64 {
    let normal = u.cross(v);
    let square = normal.length_squared();
    let from = point - corner;
    let (a, b) = (from.cross(v).dot(normal) / square, u.cross(from).dot(normal) / square);
    let inside = a >= 0.0 && b >= 0.0 && if triangle { a + b <= 1.0 } else { a <= 1.0 && b <= 1.0 };
    if inside {
        return from.dot(normal).abs() / square.sqrt();
    }
    let far = corner + u + v;
    let sides = [(corner, corner + u), (corner, corner + v), (corner + u, far), (corner + v, far)];
    let sides = if triangle { &[sides[0], sides[1], (corner + u, corner + v)][..] } else { &sides[..] };
    sides.iter().map(|&(a, b)| to_segment(point, a, b)).fold(f64::INFINITY, f64::min)
}

/// Returns the distance to the surface of a shape.
pub(super) fn to_shape(point: DVec3, kind: &ShapeKind) -> f64 {
    match *kind {
        ShapeKind::Sphere { center, radius } => (point.distance(center) - radius).abs(),
        ShapeKind::Quad { corner, u, v } => to_flat(point, corner, u, v, false),
        ShapeKind::Disc { center, normal, radius } => {
            let from = point - center;
            let height = from.dot(normal.normalize_or_zero());
            let aside = (from.length_squared() - height * height).max(0.0).sqrt();
            height.hypot((aside - radius).max(0.0))
        }
    }
}

/// Returns a lower bound of the distance to an instance: that to the ball around its box.
fn to_box(point: DVec3, boxes: &MeshBoxes, instance: &Instance) -> f64 {
    let (sum, count) =
        boxes.corners(instance).fold((DVec3::ZERO, 0.0), |(sum, count), p| (sum + p, count + 1.0));
    if count == 0.0 {
        return f64::INFINITY;
    }
    let center = sum / count;
    let radius = boxes.corners(instance).map(|corner| corner.distance(center)).fold(0.0, f64::max);
    // Less by what rounding may add to the radius.
    (point.distance(center) - radius * (1.0 + 1e-9)).max(0.0)
}

/// Returns the distance to the nearest surface of the scene; infinity if the scene is empty.
pub(super) fn to_scene(point: DVec3, scene: &Description) -> f64 {
    let mut least =
        scene.shapes.iter().map(|shape| to_shape(point, &shape.kind)).fold(f64::INFINITY, f64::min);
    // Nearest boxes first, until no box is nearer than the nearest surface.
    let boxes = MeshBoxes::of(scene);
    let mut instances: Vec<(f64, &Instance)> =
        scene.instances.iter().map(|of| (to_box(point, &boxes, of), of)).collect();
    instances.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (bound, instance) in instances {
        if bound >= least {
            break;
        }
        let Some(mesh) = scene.meshes.get(instance.mesh) else { continue };
        let world = |corner: u32| {
            let position = mesh.positions.get(corner as usize)?;
            Some(instance.transform.transform_point3(Vec3::from(*position).as_dvec3()))
        };
        for triangle in &mesh.triangles {
            if let [Some(a), Some(b), Some(c)] = triangle.map(world) {
                least = least.min(to_flat(point, a, b - a, c - a, true));
            }
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances() {
        let point = DVec3::new(0.5, 2.0, 0.5);
        let quad = |corner| ShapeKind::Quad { corner, u: DVec3::X, v: DVec3::Z };
        assert_eq!(to_shape(point, &quad(DVec3::ZERO)), 2.0);
        assert_eq!(to_shape(point, &quad(DVec3::X * 2.0)), 2.5);
        let disc =
            |radius| ShapeKind::Disc { center: DVec3::new(5.5, 2.0, 0.5), normal: DVec3::Y * 3.0, radius };
        assert_eq!((to_shape(point, &disc(1.0)), to_shape(point, &disc(1e18))), (4.0, 0.0));
        let sphere = ShapeKind::Sphere { center: DVec3::new(0.5, 0.0, 0.5), radius: 3.0 };
        assert_eq!(to_shape(point, &sphere), 1.0);
        assert_eq!(to_flat(DVec3::ONE, DVec3::ZERO, DVec3::X, DVec3::Y, true), 1.5f64.sqrt());
        assert_eq!(to_flat(DVec3::new(0.25, 0.25, -3.0), DVec3::ZERO, DVec3::X, DVec3::Y, true), 3.0);
        assert_eq!(to_scene(point, &Description::default()), f64::INFINITY);
    }
}
