//! Checks and completion of meshes, for the readers of all model formats.

use super::budget::Budget;
use super::source_location::SourceLocation;
use super::warnings::Warnings;
use crate::description::{Instance, Mesh};
use crate::error::SceneError;
use crate::limits::is_singular;
use crate::values::MAX_MAGNITUDE;
use glam::{DAffine3, DVec3, Vec3};

/// Returns a position if it is finite and no coordinate is beyond 1e18, else a description of the
/// problem.
pub(super) fn check_position(position: [f64; 3]) -> Result<[f64; 3], String> {
    if position.iter().all(|x| x.abs() <= MAX_MAGNITUDE) {
        return Ok(position);
    }
    let kind = if position.iter().all(|x| x.is_finite()) { "is beyond 1e18" } else { "is not finite" };
    let [x, y, z] = position;
    Err(format!("({x:e}, {y:e}, {z:e}) {kind}"))
}

/// Remedy for a position that [`check_position`] refuses.
pub(super) const POSITION_REMEDY: &str = "coordinates must be finite and at most 1e18 from 0";

/// Replaces texture coordinates that are not finite or beyond 1e18 by 0, with a warning.
pub(super) fn check_uvs(uvs: &mut [[f32; 2]], site: &SourceLocation, warnings: &mut Warnings) {
    let mut replaced = 0;
    for uv in uvs {
        if !uv.iter().all(|x| f64::from(x.abs()) <= MAX_MAGNITUDE) {
            *uv = [0.0; 2];
            replaced += 1;
        }
    }
    warnings.tally(
        "texture coordinates that are not finite or beyond 1e18, taken as 0",
        replaced,
        &site.place,
    );
}

/// Clamps colours of vertices to 0 to 1, with a warning; a number that is not one becomes 0.
pub(super) fn check_colors(colors: &mut [[f32; 4]], site: &SourceLocation, warnings: &mut Warnings) {
    let mut changed = 0;
    for color in colors {
        let clamped = color.map(|x| if x.is_nan() { 0.0 } else { x.clamp(0.0, 1.0) });
        changed += u64::from(clamped != *color);
        *color = clamped;
    }
    warnings.tally("colours of vertices outside 0 to 1, clamped", changed, &site.place);
}

/// Completes a mesh of checked positions and indices: drops triangles without area, and normalises
/// normals, or drops them all if one is zero or not finite. Each change is a warning.
///
/// `None` if no triangle is left.
pub(super) fn finish(mut mesh: Mesh, site: &SourceLocation, warnings: &mut Warnings) -> Option<Mesh> {
    let before = mesh.triangles.len();
    let Mesh { positions, triangles, .. } = &mut mesh;
    triangles.retain(|corners| {
        let [a, b, c] = corners.map(|corner| Vec3::from(positions[corner as usize]).as_dvec3());
        // In f64, differences of f32 and their products never underflow to 0: 0 means no area.
        (b - a).cross(c - a) != DVec3::ZERO
    });
    let dropped = (before - mesh.triangles.len()) as u64;
    warnings.tally("triangles without area or with a vertex twice, dropped", dropped, &site.place);
    if mesh.triangles.is_empty() {
        warnings.tally("meshes without triangles, left out", 1, &site.place);
        return None;
    }
    for normal in &mut mesh.normals {
        let exact = Vec3::from(*normal).as_dvec3();
        match exact.try_normalize() {
            Some(unit) => *normal = unit.as_vec3().into(),
            None => {
                mesh.normals = Vec::new();
                warnings.tally(
                    "meshes with normals that are zero or not finite, shaded flat",
                    1,
                    &site.place,
                );
                break;
            }
        }
    }
    Some(mesh)
}

/// Returns the normal of a triangle times its angle at each corner, which is its weight in smooth
/// normals; 0 for a triangle without area.
pub(super) fn corner_normals(points: [DVec3; 3]) -> [DVec3; 3] {
    [0, 1, 2].map(|i| {
        let (a, b) = (points[(i + 1) % 3] - points[i], points[(i + 2) % 3] - points[i]);
        a.cross(b).try_normalize().map_or(DVec3::ZERO, |normal| normal * a.angle_between(b))
    })
}

/// Returns the largest magnitude of a mesh's coordinates, for [`check_instance`].
pub(super) fn extent(mesh: &Mesh) -> f64 {
    mesh.positions.iter().flatten().fold(0.0f32, |extent, x| extent.max(x.abs())).into()
}

/// Checks that an instance of a mesh with this extent and number of triangles stays within the
/// limits, and takes it from the budget. Returns `false` if its transform flattens it.
pub(super) fn check_instance(
    extent: f64,
    triangles: usize,
    transform: &DAffine3,
    budget: &mut Budget,
    site: &SourceLocation,
) -> Result<bool, SceneError> {
    let [x, y, z] = [transform.x_axis, transform.y_axis, transform.z_axis].map(DVec3::abs);
    let farthest = transform.translation.abs() + (x + y + z) * extent;
    // The axes are checked separately: a tiny mesh could have a scale beyond the limit.
    if !(farthest.max_element() <= MAX_MAGNITUDE && (x + y + z).max_element() <= MAX_MAGNITUDE) {
        return Err(site.too_large("the instance's position, extent or scale is too large", "1e18"));
    }
    if is_singular(transform) {
        return Ok(false);
    }
    budget.place(triangles as u64, site)?;
    budget.take(size_of::<Instance>() as u64, site)?;
    Ok(true)
}

/// Returns the bytes that the vertices and triangles of a mesh take.
pub(super) fn bytes(vertices: u64, triangles: u64) -> u64 {
    vertices.saturating_mul(12 + 12 + 8 + 8 + 16 + 16).saturating_add(triangles.saturating_mul(12))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Mesh {
        Mesh {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0]],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        }
    }

    #[test]
    fn triangles_that_cover_nothing_are_dropped_and_counted() {
        let site = SourceLocation::new("test", "meshes[0]");
        let mut warnings = Warnings::default();
        let mut mesh = triangle();
        mesh.triangles.extend([[0, 0, 1], [0, 1, 3], [1, 1, 1]]);
        assert_eq!(finish(mesh, &site, &mut warnings).unwrap().triangles, [[0, 1, 2]]);
        let mut mesh = triangle();
        mesh.triangles = vec![[0, 1, 3]];
        assert!(finish(mesh, &site, &mut warnings).is_none());
        assert_eq!(
            warnings.finish(),
            [
                "triangles without area or with a vertex twice, dropped: 4, the first in meshes[0]",
                "meshes without triangles, left out: 1, the first in meshes[0]"
            ]
        );
        let mut tiny = triangle();
        tiny.positions = vec![[0.0; 3], [1e-45, 0.0, 0.0], [0.0, 1e-45, 0.0]];
        assert!(finish(tiny, &site, &mut Warnings::default()).is_some());
    }

    #[test]
    fn normals_become_units_or_none() {
        let site = SourceLocation::new("test", "meshes[0]");
        let mut mesh = triangle();
        mesh.normals = vec![[0.0, 0.0, 3.0], [1e-30, 0.0, 0.0], [1e30, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let finished = finish(mesh.clone(), &site, &mut Warnings::default()).unwrap();
        assert_eq!(finished.normals, [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        for bad in [[0.0; 3], [f32::NAN, 0.0, 0.0], [f32::INFINITY, 0.0, 0.0]] {
            mesh.normals[2] = bad;
            let mut warnings = Warnings::default();
            assert!(finish(mesh.clone(), &site, &mut warnings).unwrap().normals.is_empty());
            assert!(
                warnings.finish()[0]
                    .starts_with("meshes with normals that are zero or not finite, shaded flat: 1")
            );
        }
    }

    #[test]
    fn instances_are_invertible_and_within_the_world() {
        let site = SourceLocation::new("test", "nodes[0]");
        let mut budget = Budget::new(0);
        let mut check = |transform| check_instance(extent(&triangle()), 1, &transform, &mut budget, &site);
        assert!(check(DAffine3::from_scale(DVec3::new(-1.0, 2.0, 1e-9))).unwrap());
        assert!(!check(DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0))).unwrap());
        assert!(check(DAffine3::from_scale(DVec3::splat(1e19))).is_err());
        assert!(check(DAffine3::from_translation(DVec3::splat(1e19))).is_err());
        assert!(check(DAffine3::from_scale(DVec3::NAN)).is_err());
        assert!(!check(DAffine3::from_scale(DVec3::splat(1e-200))).unwrap());
    }
}
