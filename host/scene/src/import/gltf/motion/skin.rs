//! Skins: moves the vertices of a mesh with the joints that they are bound to (glTF 2.0, section
//! 3.7.3).

use super::super::super::source_location::SourceLocation;
use super::super::accessor::{Component, Elements, Expected};
use super::super::buffers::get;
use super::super::{Document, Output};
use super::Vertices;
use crate::description::Mesh;
use crate::error::SceneError;
use Component::{F32, U8, U16};
use glam::{DAffine3, DMat3, DMat4, DVec3, Vec3};

const MATRIX: Expected = Expected { kind: "MAT4", components: &[F32] };
const JOINTS: Expected = Expected { kind: "VEC4", components: &[U8, U16] };
const WEIGHTS: Expected = Expected { kind: "VEC4", components: &[F32, U8, U16] };

/// Returns, for each joint of a skin, the transform of vertices that are bound to it to the world;
/// `worlds` are those of the nodes.
pub fn joints(
    document: &Document,
    output: &mut Output,
    index: u32,
    worlds: &[DAffine3],
    user: &SourceLocation,
) -> Result<Vec<DAffine3>, SceneError> {
    let skin = get(&document.root.skins, index, "skins", user)?;
    let site = document.site(format!("skins[{index}]"));
    output.budget.take((skin.joints.len() * size_of::<DAffine3>()) as u64, &site)?;
    let binds = match skin.inverse_bind_matrices {
        Some(accessor) => {
            let site = site.member("inverseBindMatrices");
            Some(Elements::open(document, &mut output.budget, accessor, MATRIX, &site)?)
        }
        None => None,
    };
    if let Some(binds) = &binds
        && (binds.count as usize) < skin.joints.len()
    {
        let problem = format!("there are {} matrices and {} joints", binds.count, skin.joints.len());
        return Err(site.member("inverseBindMatrices").malformed(problem, "each joint needs a matrix"));
    }
    let of = |(place, &node): (u32, &u32)| {
        let world = get(worlds, node, "nodes", &site.member("joints"))?;
        let bind = binds.as_ref().map_or(DAffine3::IDENTITY, |binds| {
            DAffine3::from_mat4(DMat4::from_cols_array(&binds.floats::<16>(place).map(f64::from)))
        });
        Ok(*world * bind)
    };
    (0..).zip(&skin.joints).map(of).collect()
}

/// Joints that a mesh is bound to.
#[derive(Clone, Copy, Debug)]
pub struct Skin<'a> {
    /// Transforms to the world, as [`joints`] returns them.
    pub joints: &'a [DAffine3],
    /// Transform of the mesh's node to the world, by which a vertex without weights is moved.
    pub node: DAffine3,
}

/// Moves a mesh with its joints to the world.
pub fn apply(
    document: &Document,
    output: &mut Output,
    vertices: Vertices,
    skin: Skin,
    mesh: &mut Mesh,
    site: &SourceLocation,
) -> Result<(), SceneError> {
    let Vertices { attributes, used, .. } = vertices;
    let mut sets = Vec::new();
    for set in 0.. {
        let [joints, weights] = ["JOINTS", "WEIGHTS"].map(|name| format!("{name}_{set}"));
        let of_joints = attributes.open(document, output, &joints, JOINTS)?;
        let of_weights = attributes.open(document, output, &weights, WEIGHTS)?;
        let (Some(of_joints), Some(of_weights)) = (of_joints, of_weights) else { break };
        // No memory but time: many sets may name one accessor.
        output.budget.take(used.len() as u64, site)?;
        sets.push((of_joints, of_weights));
    }
    let (mut unbound, mut lost) = (0, 0);
    for (index, &vertex) in used.iter().enumerate() {
        let (mut matrix, mut sum) = (DMat4::ZERO, 0.0);
        for (of_joints, of_weights) in &sets {
            if vertex >= of_joints.count || vertex >= of_weights.count {
                continue;
            }
            let (places, weights) = (of_joints.integers::<4>(vertex), of_weights.floats::<4>(vertex));
            for (place, weight) in places.into_iter().zip(weights) {
                let weight = f64::from(weight);
                if !(weight > 0.0 && weight.is_finite()) {
                    continue;
                }
                match skin.joints.get(place as usize) {
                    Some(joint) => {
                        matrix += DMat4::from(*joint) * weight;
                        sum += weight;
                    }
                    None => lost += 1,
                }
            }
        }
        let transform = match sum > 0.0 {
            true => DAffine3::from_mat4(matrix * (1.0 / sum)),
            false => {
                unbound += 1;
                skin.node
            }
        };
        transform_vertex(mesh, index, &transform);
    }
    // glTF 2.0, section 3.7.4: the winding follows the determinant of the node's transform.
    if skin.node.matrix3.determinant() < 0.0 {
        mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        mesh.tangents.iter_mut().for_each(|tangent| tangent[3] = -tangent[3]);
    }
    let Output { warnings, .. } = output;
    warnings.tally("vertices without weights, moved with the node, not with joints", unbound, &site.place);
    warnings.tally("weights of joints that the skin does not have, ignored", lost, &site.place);
    Ok(())
}

fn transform_vertex(mesh: &mut Mesh, index: usize, transform: &DAffine3) {
    let exact = |v: [f32; 3]| Vec3::from(v).as_dvec3();
    if let Some(position) = mesh.positions.get_mut(index) {
        *position = transform.transform_point3(exact(*position)).as_vec3().into();
    }
    if let Some(normal) = mesh.normals.get_mut(index) {
        let moved = cofactors(transform.matrix3) * exact(*normal);
        // A unit in f64: its square may leave the range of f32.
        *normal = moved.try_normalize().unwrap_or(DVec3::ZERO).as_vec3().into();
    }
    if let Some([x, y, z, _]) = mesh.tangents.get_mut(index) {
        let moved = transform.transform_vector3(exact([*x, *y, *z]));
        [*x, *y, *z] = moved.try_normalize().unwrap_or(DVec3::ZERO).as_vec3().into();
    }
}

/// Returns the matrix of cofactors, by which normals are transformed: the inverse transpose times
/// the determinant, on the determinant's side. It exists for singular matrices, too.
fn cofactors(matrix: DMat3) -> DMat3 {
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = matrix;
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    if matrix.determinant() < 0.0 { -cofactors } else { cofactors }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Under shears, mirrors and flattening, normals stay perpendicular to their surface, and on
    /// its side.
    #[test]
    fn normals_stay_perpendicular() {
        let (a, b) = (Vec3::new(0.3, 1.0, 0.2), Vec3::new(-0.4, 0.1, 0.9));
        let matrices = [
            DMat3::from_cols(DVec3::new(4.0, 0.0, 0.0), DVec3::new(3.0, 0.25, 0.0), DVec3::Z),
            DMat3::from_diagonal(DVec3::new(-1.0, 2.0, 3.0)),
            DMat3::from_diagonal(DVec3::new(1e-12, 1e12, 1.0)),
            DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0)),
        ];
        for matrix in matrices {
            let transform = DAffine3::from_mat3(matrix);
            let mut mesh = Mesh {
                positions: vec![a.into()],
                normals: vec![a.cross(b).normalize().into()],
                tangents: vec![[a.x, a.y, a.z, 1.0]],
                ..Mesh::default()
            };
            transform_vertex(&mut mesh, 0, &transform);
            let normal = Vec3::from(mesh.normals[0]).as_dvec3();
            for edge in [a, b] {
                let moved = transform.transform_vector3(edge.as_dvec3());
                assert!(normal.dot(moved).abs() < 1e-6 * moved.length(), "{matrix}: {normal} {moved}");
            }
            let moved = transform.transform_vector3(a.cross(b).as_dvec3());
            assert!(normal.dot(moved) >= 0.0 && (normal.length() - 1.0).abs() < 1e-6, "{matrix}: {normal}");
        }
        let mut nothing =
            Mesh { positions: vec![[1.0; 3]], normals: vec![[0.0, 0.0, 1.0]], ..Mesh::default() };
        transform_vertex(&mut nothing, 0, &DAffine3::from_scale(DVec3::ZERO));
        assert_eq!((nothing.positions[0], nothing.normals[0]), ([0.0; 3], [0.0; 3]));
    }
}
