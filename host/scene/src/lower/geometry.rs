//! Lowers shapes and meshes. An instance shares its mesh, or its triangles are baked into world
//! space, as `sharing` decides.
//!
//! Baking takes 48 bytes and a BVH node of 64 bytes for each triangle of each instance, and 32
//! bytes for each vertex; traversal then needs no transforms.

use super::super::description::{Description, Instance, Material, Mesh, Shape, ShapeKind};
use super::super::limits::{MAX_VERTEX, is_in_reach};
use super::super::memory_budget::MemoryBudget;
use super::super::shared_meshes::{SharedMeshes, Sharing};
use super::super::values::MAX_MAGNITUDE;
use super::sharing;
use super::tangents::{self, CornerTangents};
use super::unit;
use super::vertices::Vertices;
use glam::{DAffine3, DVec3, Vec3};
use std::collections::hash_map::Entry;
use std::collections::{BTreeSet, HashMap, HashSet};
use trisect_shared::attributes::MeshVertex;
use trisect_shared::planar::{DISC, Planar, QUAD};
use trisect_shared::sphere::Sphere;
use trisect_shared::triangle::Triangle;

#[derive(Default)]
pub(super) struct Geometry {
    pub spheres: Vec<Sphere>,
    pub flats: Vec<Planar>,
    pub triangles: Vec<Triangle>,
    pub vertices: Vec<MeshVertex>,
    pub shared: SharedMeshes,
    pub warnings: Vec<String>,
}

pub(super) fn lower(description: &Description, sharing: Sharing) -> Result<Geometry, String> {
    let mut geometry = Geometry::default();
    let mut unmapped = BTreeSet::new();
    for shape in &description.shapes {
        geometry.shape(shape);
        let material = description.materials.get(shape.material);
        unmapped.extend(material.filter(|m| m.normal_maps().next().is_some()).map(|m| &m.name));
    }
    let warning = |name: &String| {
        format!(
            "material \"{name}\": its normal map has no effect on spheres, quads and discs; only meshes have tangents"
        )
    };
    geometry.warnings.extend(unmapped.into_iter().map(warning));
    let differ =
        |m: &&Material| m.normal_maps().any(|map| m.normal_maps().any(|of| of.second_uvs != map.second_uvs));
    geometry.warnings.extend(description.materials.iter().filter(differ).map(|m| {
        format!(
            "material \"{}\": the normal map of its coat has the tangents of the surface's, whose set of texture coordinates is another",
            m.name
        )
    }));
    check_memory(description, sharing)?;
    let mut tangents = HashMap::new();
    let mut shared = HashMap::new();
    let shares = sharing::shared(description, sharing);
    for ((number, instance), shares) in (0..).zip(&description.instances).zip(shares) {
        let mesh = mesh(description, instance)?;
        let material = description.materials.get(mesh.material).filter(|material| material.needs_tangents());
        let tangents = material.map(|material| {
            let second = material.normal_maps().next().is_some_and(|map| map.second_uvs);
            let uvs = if second { &mesh.second_uvs } else { &mesh.uvs };
            &*tangents.entry(instance.mesh).or_insert_with(|| tangents::tangents(mesh, uvs))
        });
        if shares {
            let index = match shared.entry(instance.mesh) {
                Entry::Occupied(index) => *index.get(),
                Entry::Vacant(place) => *place.insert(geometry.share(mesh, tangents)?),
            };
            // Without a triangle that has an area there is nothing to place.
            if let Some(mesh) = index {
                geometry.place(mesh, &instance.transform, number)?;
            }
        } else {
            geometry.mesh(mesh, tangents, &instance.transform, number)?;
        }
    }
    Ok(geometry)
}

fn mesh<'a>(description: &'a Description, instance: &Instance) -> Result<&'a Mesh, String> {
    let (index, count) = (instance.mesh, description.meshes.len());
    description
        .meshes
        .get(index)
        .ok_or_else(|| format!("an instance refers to mesh {index}, but there are {count} meshes"))
}

/// Checks that there is memory for all triangles. This comes before the triangles are read, which
/// may take long.
fn check_memory(description: &Description, sharing: Sharing) -> Result<(), String> {
    let mut room = MemoryBudget::default();
    let mut counted = HashSet::new();
    let shares = sharing::shared(description, sharing);
    description.instances.iter().zip(shares).try_for_each(|(instance, shares)| {
        let mesh = mesh(description, instance)?;
        if shares && !counted.insert(instance.mesh) {
            return Ok(());
        }
        let material = description.materials.get(mesh.material);
        let has_tangents = material.is_some_and(|material| material.needs_tangents());
        room.place(mesh, has_tangents || mesh.has_attributes())
    })
}

impl Geometry {
    fn shape(&mut self, shape: &Shape) {
        let material = shape.material as u32;
        match &shape.kind {
            ShapeKind::Sphere { center, radius } => self.spheres.push(Sphere {
                center: center.as_vec3(),
                radius: *radius as f32,
                material,
                pad: [0; 3],
            }),
            ShapeKind::Quad { corner, u, v } => self.flats.push(flat(QUAD, *corner, *u, *v, material)),
            ShapeKind::Disc { center, normal, radius } => {
                let (u, v) = normal.normalize().any_orthonormal_pair();
                // The handedness of `any_orthonormal_pair` is not documented.
                let v = if u.cross(v).dot(*normal) > 0.0 { v } else { -v };
                self.flats.push(flat(DISC, *center, u * *radius, v * *radius, material));
            }
        }
    }

    /// Bakes an instance of a mesh, with the tangents of its corners if a normal map needs them.
    pub(super) fn mesh(
        &mut self,
        mesh: &Mesh,
        tangents: Option<&CornerTangents>,
        transform: &DAffine3,
        number: u32,
    ) -> Result<(), String> {
        let mirrored = transform.matrix3.determinant() < 0.0;
        let mut positions = Vec::with_capacity(mesh.positions.len());
        for (i, p) in mesh.positions.iter().enumerate() {
            let world = transform.transform_point3(Vec3::from(*p).as_dvec3());
            if !is_in_reach(world) {
                return Err(format!(
                    "mesh \"{}\": vertex {i} is at {world} in the world; coordinates must be at most {MAX_VERTEX:e}",
                    mesh.name
                ));
            }
            positions.push(world.as_vec3());
        }
        let mut flat = 0usize;
        self.triangles.reserve_exact(mesh.triangles.len());
        let mut vertices = Vertices::of(mesh, tangents, transform.matrix3, number);
        for (face, corners) in mesh.triangles.iter().enumerate() {
            let [a, mut b, mut c] = corners.map(|i| i as usize);
            let mut order = [0, 1, 2];
            if mirrored {
                std::mem::swap(&mut b, &mut c); // keeps the front
                order.swap(1, 2);
            }
            let (Some(&pa), Some(&pb), Some(&pc)) = (positions.get(a), positions.get(b), positions.get(c))
            else {
                return Err(format!(
                    "mesh \"{}\": a triangle has vertex {}, but there are {} vertices",
                    mesh.name,
                    a.max(b).max(c),
                    positions.len()
                ));
            };
            let triangle = Triangle::of([pa, pb, pc]);
            // Tested with the kernels' own arithmetic, because they divide by this length. It does
            // not depend on the triangle's size.
            let square = triangle.normal().length_squared();
            if !(square > Triangle::MIN_SQUARE && square.is_finite()) {
                flat += 1;
                continue;
            }
            let tangent = |corner: usize| tangents?.get(face).map(|own| own[order[corner]]);
            let [vertex_a, vertex_b, vertex_c] = [(a, 0), (b, 1), (c, 2)]
                .map(|(vertex, corner)| vertices.record(vertex, tangent(corner), &mut self.vertices));
            self.triangles.push(Triangle { vertex_a, vertex_b, vertex_c, ..triangle });
        }
        if flat > 0 {
            self.warnings.push(format!(
                "mesh \"{}\": {flat} triangles have no area in single precision and were dropped",
                mesh.name
            ));
        }
        Ok(())
    }
}

/// Returns the record of a quad or disc; `corner` is a disc's centre. The edges are f64, so that
/// only the record is rounded.
pub(super) fn flat(kind: u32, corner: DVec3, u: DVec3, v: DVec3, material: u32) -> Planar {
    let normal = u.cross(v);
    let square = normal.length_squared();
    let area = square.sqrt() * if kind == DISC { std::f64::consts::PI } else { 1.0 };
    Planar {
        origin: corner.as_vec3(),
        material,
        normal: unit(normal),
        kind,
        dual_u: (v.cross(normal) / square).as_vec3(),
        pad0: 0,
        dual_v: (normal.cross(u) / square).as_vec3(),
        pad1: 0,
        edge_u: u.as_vec3(),
        area: area.min(MAX_MAGNITUDE * MAX_MAGNITUDE) as f32,
        edge_v: v.as_vec3(),
        pad2: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn duals_give_coordinates() {
        let (corner, u, v) =
            (DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 0.5, 0.0), DVec3::new(0.0, 1.0, -3.0));
        let f = flat(QUAD, corner, u, v, 0);
        let (a, b) = f.coordinates((corner + u * 0.25 + v * 0.75).as_vec3());
        assert!((a - 0.25).abs() < 1e-6 && (b - 0.75).abs() < 1e-6, "{a} {b}");
        assert!((f.normal.as_dvec3() - u.cross(v).normalize()).length() < 1e-6);
    }

    #[test]
    fn a_plane_is_a_disc_without_end() {
        let mut g = Geometry::default();
        let kind = ShapeKind::Disc { center: DVec3::ZERO, normal: DVec3::Y, radius: MAX_MAGNITUDE };
        g.shape(&Shape { kind, material: 0 });
        let f = g.flats[0];
        assert!(f.dual_u.is_finite() && f.dual_v.is_finite() && f.edge_u.is_finite() && f.area.is_finite());
        assert_eq!(f.distance(Vec3::new(1e9, 2.0, -1e9), Vec3::NEG_Y), 2.0);
        assert!((f.normal - Vec3::Y).length() < 1e-6);
    }

    #[test]
    fn mirrored_meshes_keep_their_front() {
        let mesh = Mesh {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            normals: vec![[0.0, 0.0, 1.0]; 3],
            triangles: vec![[0, 1, 2], [0, 0, 1]],
            ..Mesh::default()
        };
        for (scale, z) in
            [(DVec3::ONE, 1.0), (DVec3::new(-1.0, 1.0, 1.0), 1.0), (DVec3::new(1.0, 1.0, -2.0), -1.0)]
        {
            let mut g = Geometry::default();
            let transform = DAffine3::from_scale(scale);
            g.mesh(&mesh, None, &transform, 3).unwrap();
            assert!(g.vertices.iter().all(|vertex| vertex.instance == 3));
            assert_eq!((g.triangles.len(), g.vertices.len(), g.warnings.len()), (1, 3, 1));
            let n = g.triangles[0].normal().normalize();
            assert_eq!((n.z, g.vertices[0].normal.z), (z, z), "{scale}");
        }
    }
}
