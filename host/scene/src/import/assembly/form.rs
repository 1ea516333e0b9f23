//! Analytic shapes in their own coordinates, and meshes that stand for them.

use super::super::mesh::corner_normals;
use crate::description::{Mesh, ShapeKind};
use glam::{DAffine3, DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// Columns of a mesh that stands for a whole surface of revolution: its silhouette is within 3e-4
/// of the radius.
const COLUMNS: u32 = 128;

/// Rows of a mesh that stands for a sphere.
const ROWS: u32 = 64;

/// An analytic shape in its own coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// A sphere around the origin; its front is outside.
    Sphere { radius: f64 },
    /// The square from -1 to 1 in x and y; its front is where z points.
    Square,
    /// A disc around the origin in the plane z = 0; its front is where z points. Its texture
    /// coordinates are radius and angle, in this order if `is_radial_first`.
    Disc { radius: f64, is_radial_first: bool },
}

/// A form, whether it is turned inside out, and its material.
pub(super) type Key = (u8, u64, bool, usize);

impl Form {
    pub(super) fn key(self, is_flipped: bool, material: usize) -> Key {
        let (kind, size) = match self {
            Self::Sphere { radius } => (0, radius),
            Self::Square => (1, 1.0),
            Self::Disc { radius, is_radial_first } => (2 + u8::from(is_radial_first), radius),
        };
        (kind, size.to_bits(), is_flipped, material)
    }

    /// Returns the analytic shape in the world; `None` if the transform makes another shape of it,
    /// or if it is a sphere whose front is inside.
    pub(super) fn shape(self, map: &DAffine3, is_flipped: bool) -> Option<ShapeKind> {
        let m = map.matrix3;
        let is_round = |axes: &[DVec3]| {
            let length = axes[0].length();
            axes.iter().all(|axis| (axis.length() - length).abs() <= 1e-6 * length)
                && (1..axes.len())
                    .all(|i| axes[..i].iter().all(|a| a.dot(axes[i]).abs() <= 1e-6 * length * length))
        };
        let is_mirrored = m.determinant() < 0.0;
        match self {
            Self::Sphere { radius } => {
                let is_sphere = !is_flipped && is_round(&[m.x_axis, m.y_axis, m.z_axis]);
                is_sphere.then(|| ShapeKind::Sphere {
                    center: map.translation,
                    radius: radius * m.x_axis.length(),
                })
            }
            Self::Square => {
                let (u, v) = (2.0 * m.x_axis, 2.0 * m.y_axis);
                let corner = map.translation - m.x_axis - m.y_axis;
                let (u, v) = if is_mirrored != is_flipped { (v, u) } else { (u, v) };
                Some(ShapeKind::Quad { corner, u, v })
            }
            Self::Disc { radius, .. } => {
                let normal = m.x_axis.cross(m.y_axis) * if is_mirrored != is_flipped { -1.0 } else { 1.0 };
                is_round(&[m.x_axis, m.y_axis]).then(|| ShapeKind::Disc {
                    center: map.translation,
                    normal: crate::values::unit(normal).unwrap_or(DVec3::Z),
                    radius: radius * m.x_axis.length(),
                })
            }
        }
    }

    /// Returns a mesh that stands for the shape.
    pub(super) fn mesh(self) -> Mesh {
        match self {
            Self::Sphere { radius } => surface_of_revolution(ROWS, TAU, |t| {
                let (sine, cosine) = (PI * t).sin_cos();
                ([radius * sine, radius * cosine], [sine, cosine])
            }),
            Self::Square => grid(1, 1, |u, v| {
                (DVec3::new(2.0 * u - 1.0, 2.0 * v - 1.0, 0.0), DVec3::Z, [u as f32, v as f32])
            }),
            Self::Disc { radius, is_radial_first } => {
                let mut mesh = surface_of_revolution(1, TAU, |t| ([radius * t, 0.0], [0.0, 1.0]));
                if is_radial_first {
                    mesh.uvs.iter_mut().for_each(|uv| uv.swap(0, 1));
                }
                mesh
            }
        }
    }
}

/// Returns the mesh of a surface of revolution about z, from x over `angle` radians towards y.
/// `profile` gives radius and z, and those of the unit normal, for 0 to 1. The texture coordinates
/// are the share of the angle, and the number that `profile` takes.
pub fn surface_of_revolution(rows: u32, angle: f64, profile: impl Fn(f64) -> ([f64; 2], [f64; 2])) -> Mesh {
    let columns = (f64::from(COLUMNS) * angle / TAU).ceil().clamp(3.0, f64::from(COLUMNS)) as u32;
    grid(columns, rows, |u, v| {
        let (sine, cosine) = (angle * u).sin_cos();
        let ([radius, z], [across, along]) = profile(v);
        let around = |r: f64, z: f64| DVec3::new(r * cosine, r * sine, z);
        (around(radius, z), around(across, along), [u as f32, v as f32])
    })
}

/// Returns a mesh of `columns` by `rows` cells whose vertices have the position, the normal and the
/// texture coordinates that `vertex` gives for 0 to 1 across and down.
pub fn grid(columns: u32, rows: u32, vertex: impl Fn(f64, f64) -> (DVec3, DVec3, [f32; 2])) -> Mesh {
    let mut mesh = Mesh::default();
    for row in 0..=rows {
        for column in 0..=columns {
            let (u, v) = (f64::from(column) / f64::from(columns), f64::from(row) / f64::from(rows));
            let (position, normal, uv) = vertex(u, v);
            mesh.positions.push(position.as_vec3().into());
            mesh.normals.push(normal.as_vec3().into());
            mesh.uvs.push(uv);
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let c = a + columns + 1;
            // At a pole, one of the two has no area.
            let point = |corner: u32| Vec3::from(mesh.positions[corner as usize]).as_dvec3();
            let has_area = |corners: &[u32; 3]| {
                let [a, b, c] = corners.map(point);
                (b - a).cross(c - a).length() > 1e-9 * (b - a).length_squared().max((c - a).length_squared())
            };
            let cell = [[a, a + 1, c + 1], [a, c + 1, c]];
            let cell: Vec<[u32; 3]> = cell.into_iter().filter(has_area).collect();
            mesh.triangles.extend(cell);
        }
    }
    oriented(mesh)
}

/// Turns each triangle so that its front is where the normals of its vertices point. A mesh
/// without normals stays.
pub fn oriented(mut mesh: Mesh) -> Mesh {
    let Mesh { positions, normals, triangles, .. } = &mut mesh;
    if normals.len() == positions.len() {
        for corners in triangles {
            let at = |list: &[[f32; 3]], corner: u32| Vec3::from(list[corner as usize]).as_dvec3();
            let [a, b, c] = corners.map(|corner| at(positions, corner));
            let normal = corners.iter().fold(DVec3::ZERO, |sum, &corner| sum + at(normals, corner));
            if (b - a).cross(c - a).dot(normal) < 0.0 {
                corners.swap(1, 2);
            }
        }
    }
    mesh
}

/// Gives a mesh the normals of its vertices: the means of its triangles' normals, weighted by their
/// angles at the vertex.
pub fn smooth(mesh: &mut Mesh) {
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    for corners in &mesh.triangles {
        let points = corners.map(|corner| Vec3::from(mesh.positions[corner as usize]).as_dvec3());
        for (&corner, normal) in corners.iter().zip(corner_normals(points)) {
            sums[corner as usize] += normal;
        }
    }
    // A vertex of no triangle, or one whose triangles cancel, has any normal.
    mesh.normals = sums.iter().map(|sum| sum.try_normalize().unwrap_or(DVec3::Z).as_vec3().into()).collect();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fronts_stay_under_reflections() {
        let mirrored = DAffine3::from_scale(DVec3::new(-2.0, 2.0, 2.0));
        for (map, is_flipped, sign) in
            [(DAffine3::IDENTITY, false, 1.0), (mirrored, false, 1.0), (mirrored, true, -1.0)]
        {
            let Some(ShapeKind::Quad { u, v, .. }) = Form::Square.shape(&map, is_flipped) else { panic!() };
            assert!(u.cross(v).z * sign > 0.0);
            let disc = Form::Disc { radius: 0.5, is_radial_first: false };
            let Some(ShapeKind::Disc { normal, .. }) = disc.shape(&map, is_flipped) else { panic!() };
            assert_eq!(normal, DVec3::Z * sign);
        }
        let sphere = Form::Sphere { radius: 2.0 };
        let Some(ShapeKind::Sphere { radius, .. }) = sphere.shape(&mirrored, false) else { panic!() };
        assert_eq!(radius, 4.0);
        assert!(sphere.shape(&mirrored, true).is_none());
        assert!(sphere.shape(&DAffine3::from_scale(DVec3::new(1.0, 2.0, 1.0)), false).is_none());
    }

    /// The meshes have the areas of the shapes, and their fronts are outside.
    #[test]
    fn meshes_stand_for_shapes() {
        let sphere = Form::Sphere { radius: 2.0 };
        let disc = Form::Disc { radius: 0.5, is_radial_first: true };
        for (form, area) in [(sphere, 16.0 * PI), (Form::Square, 4.0), (disc, 0.25 * PI)] {
            let mesh = form.mesh();
            let mut sum = 0.0;
            for corners in &mesh.triangles {
                let [a, b, c] = corners.map(|corner| Vec3::from(mesh.positions[corner as usize]).as_dvec3());
                let normal = (b - a).cross(c - a);
                sum += 0.5 * normal.length();
                let outward = if form == sphere { a + b + c } else { DVec3::Z };
                assert!(normal.dot(outward) >= 0.0);
            }
            assert!((sum / area - 1.0).abs() < 2e-3, "{form:?}: {sum}");
        }
        assert_eq!(disc.mesh().uvs.last(), Some(&[1.0, 1.0]));
    }

    #[test]
    fn smooth_normals_are_means() {
        let mut mesh = Form::Sphere { radius: 1.0 }.mesh();
        let exact = std::mem::take(&mut mesh.normals);
        smooth(&mut mesh);
        // Along the seam each vertex has the triangles of one side.
        let close =
            mesh.normals.iter().zip(&exact).filter(|(a, b)| Vec3::from(**a).dot(Vec3::from(**b)) > 0.999);
        assert!(close.count() > exact.len() * 95 / 100);
    }
}
