//! Writes the scenes of the cost figures in `docs/notebook/triangles-and-trees.md`: closed rooms
//! around a mesh, and a mesh under the sun.
//!
//! ```text
//! cargo generate-scene mesh_ply scenes/generated/asteroid_500k.ply 158
//! cargo generate-scene rooms scenes/generated
//! ```
//!
//! Files in the folder:
//!
//! * `room.ron`: walls, an area light under the ceiling, and the mesh of 499,280 triangles
//! * `terraces.ron`, `terraces.ply`: the same room around 979,296 triangles of steps, many of which
//!   face straight up
//! * `sun.ron`, `sun_tilted.ron`: the mesh under a sun that shines along (0, -1, 0), and under one
//!   that shines along (0.01, -1, 0.02)

use glam::Vec3;
use std::error::Error;
use std::fs;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: rooms FOLDER")?;
    let folder = Path::new(&folder);
    fs::create_dir_all(folder)?;
    fs::write(folder.join("terraces.ply"), ply(&terraces(404)))?;
    let mesh = r#"Mesh(file: "asteroid_500k.ply", transform: [Scale(0.6), Translate((0, 0.8, 0))], material: "grey")"#;
    let steps = r#"Mesh(file: "terraces.ply", transform: [Scale(0.008), Translate((-1.6, 0, -1.6))], material: "grey")"#;
    fs::write(folder.join("room.ron"), room(mesh))?;
    fs::write(folder.join("terraces.ron"), room(steps))?;
    fs::write(folder.join("sun.ron"), sun(mesh, "(0, -1, 0)"))?;
    fs::write(folder.join("sun_tilted.ron"), sun(mesh, "(0.01, -1, 0.02)"))?;
    Ok(())
}

/// Returns a scene file with a closed room of 4 by 3 by 4 around an object.
fn room(object: &str) -> String {
    format!(
        r#"Scene(
    version: 1,
    image: (width: 1280, height: 720, samples: 16, depth: 8),
    camera: (look_from: (0, 1.6, 1.9), look_at: (0, 0.9, 0), vertical_fov: 60),
    sky: Black,
    materials: {{
        "grey": Lambertian(albedo: (0.7, 0.7, 0.7)),
        "light": Emissive(radiance: (12, 12, 12)),
    }},
    objects: [
        Quad(corner: (-0.5, 2.99, -0.5), u: (1, 0, 0), v: (0, 0, 1), material: "light"),
        Quad(corner: (-2, 0, -2), u: (0, 0, 4), v: (4, 0, 0), material: "grey"),
        Quad(corner: (-2, 3, -2), u: (4, 0, 0), v: (0, 0, 4), material: "grey"),
        Quad(corner: (-2, 0, -2), u: (4, 0, 0), v: (0, 3, 0), material: "grey"),
        Quad(corner: (-2, 0, 2), u: (0, 3, 0), v: (4, 0, 0), material: "grey"),
        Quad(corner: (-2, 0, -2), u: (0, 3, 0), v: (0, 0, 4), material: "grey"),
        Quad(corner: (2, 0, -2), u: (0, 0, 4), v: (0, 3, 0), material: "grey"),
        {object},
    ],
)
"#
    )
}

/// Returns a scene file with an object under a sun.
fn sun(object: &str, direction: &str) -> String {
    format!(
        r#"Scene(
    version: 1,
    image: (width: 1280, height: 720, samples: 16, depth: 8),
    camera: (look_from: (2.4, 1.6, 3.4), look_at: (0, 0.85, 0), vertical_fov: 32),
    sky: Uniform(radiance: (0.2, 0.2, 0.2)),
    materials: {{ "grey": Lambertian(albedo: (0.7, 0.7, 0.7)) }},
    objects: [{object}],
    lights: [Directional(direction: {direction}, irradiance: (3, 3, 3))],
)
"#
    )
}

/// Returns the triangles of a pyramid of `side` by `side` flat steps, with the walls between them.
fn terraces(side: i32) -> Vec<[Vec3; 3]> {
    let height = |x: i32, z: i32| {
        let inside = (0..side).contains(&x) && (0..side).contains(&z);
        if inside { 0.5 * (side - (x - side / 2).abs() - (z - side / 2).abs()) as f32 } else { 0.0 }
    };
    let mut triangles = Vec::new();
    let mut quad = |corner: Vec3, u: Vec3, v: Vec3| {
        triangles.extend([[corner, corner + u, corner + u + v], [corner, corner + u + v, corner + v]]);
    };
    for x in 0..side {
        for z in 0..side {
            let top = height(x, z);
            let corner = Vec3::new(x as f32, top, z as f32);
            quad(corner, Vec3::Z, Vec3::X);
            quad(corner + Vec3::X, Vec3::Z, Vec3::Y * (height(x + 1, z) - top));
            quad(corner + Vec3::Z, Vec3::X, Vec3::Y * (height(x, z + 1) - top));
        }
    }
    triangles.retain(|[a, b, c]| (b - a).cross(c - a).length_squared() > 0.0);
    triangles
}

/// Returns a binary PLY file of triangles that share no vertices.
fn ply(triangles: &[[Vec3; 3]]) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        3 * triangles.len(),
        triangles.len()
    )
    .into_bytes();
    for v in triangles.iter().flatten() {
        bytes.extend(v.to_array().into_iter().flat_map(f32::to_le_bytes));
    }
    for i in 0..triangles.len() as u32 {
        bytes.push(3);
        bytes.extend([3 * i, 3 * i + 1, 3 * i + 2].into_iter().flat_map(u32::to_le_bytes));
    }
    bytes
}
