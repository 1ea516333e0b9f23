//! Writes a dense mesh as binary PLY: a sphere displaced by fractal noise, with smooth normals.
//!
//! ```text
//! cargo generate-scene mesh_ply scenes/generated/asteroid.ply [frequency]
//! ```
//!
//! Each edge of an icosahedron is cut into `frequency` parts, which gives 20 · frequency²
//! triangles: 1,310,720 for the default of 256. The bytes are equal on all machines, because only
//! exactly rounded f32 operations make them.

use glam::{UVec3, Vec3};
use std::collections::BTreeMap;
use std::error::Error;
use std::fs::File;
use std::io::Write;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("usage: mesh_ply FILE [FREQUENCY]")?;
    let frequency: u32 = arguments.next().map_or(Ok(256), |text| text.parse())?;
    if !(1..=4096).contains(&frequency) {
        return Err("the frequency is 1 to 4096".into());
    }
    let (mut positions, triangles) = sphere(frequency);
    displace(&mut positions);
    let normals = normals(&positions, &triangles);
    File::create(path)?.write_all(&ply(&positions, &normals, &triangles))?;
    Ok(())
}

/// Returns points and triangles of the unit sphere: each face of an icosahedron is cut into
/// frequency² triangles, and faces share the vertices on their edges.
fn sphere(frequency: u32) -> (Vec<Vec3>, Vec<UVec3>) {
    let golden = (1.0 + 5.0f32.sqrt()) / 2.0;
    let corners = [
        [-1.0, golden, 0.0],
        [1.0, golden, 0.0],
        [-1.0, -golden, 0.0],
        [1.0, -golden, 0.0],
        [0.0, -1.0, golden],
        [0.0, 1.0, golden],
        [0.0, -1.0, -golden],
        [0.0, 1.0, -golden],
        [golden, 0.0, -1.0],
        [golden, 0.0, 1.0],
        [-golden, 0.0, -1.0],
        [-golden, 0.0, 1.0],
    ]
    .map(|corner| Vec3::from(corner).normalize());
    const FACES: [[u32; 3]; 20] = [
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    let count = (10 * frequency * frequency + 2) as usize;
    let mut points = Vec::with_capacity(count);
    points.extend(corners);
    let mut triangles = Vec::with_capacity(20 * (frequency * frequency) as usize);
    // First index of the points on the edge between two corners, ordered from the corner with the
    // smaller index to that with the larger.
    let mut edges = BTreeMap::new();
    let n = frequency;
    for [a, b, c] in FACES {
        for (from, to) in [(a, b), (b, c), (a, c)] {
            let (low, high) = (from.min(to), from.max(to));
            edges.entry((low, high)).or_insert_with(|| {
                let first = points.len() as u32;
                let (start, end) = (corners[low as usize], corners[high as usize]);
                points.extend((1..n).map(|i| start.lerp(end, i as f32 / n as f32).normalize()));
                first
            });
        }
        let on_edge = |from: u32, to: u32, i: u32| {
            let first = edges.get(&(from.min(to), from.max(to))).copied().unwrap_or_default();
            if from < to { first + i - 1 } else { first + n - i - 1 }
        };
        let inside = points.len() as u32;
        let (pa, pb, pc) = (corners[a as usize], corners[b as usize], corners[c as usize]);
        // Row i has i + 1 points, from edge ab to edge ac.
        for i in 2..n {
            for j in 1..i {
                let (u, v) = ((i - j) as f32 / n as f32, j as f32 / n as f32);
                points.push((pa * (1.0 - u - v) + pb * u + pc * v).normalize());
            }
        }
        let index = |i: u32, j: u32| match (i, j) {
            (0, _) => a,
            (i, 0) if i == n => b,
            (i, j) if i == n && j == n => c,
            (i, 0) => on_edge(a, b, i),
            (i, j) if i == j => on_edge(a, c, i),
            (i, j) if i == n => on_edge(b, c, j),
            (i, j) => inside + (i - 1) * (i - 2) / 2 + j - 1,
        };
        for i in 0..n {
            for j in 0..=i {
                triangles.push(UVec3::new(index(i, j), index(i + 1, j), index(i + 1, j + 1)));
                if j < i {
                    triangles.push(UVec3::new(index(i, j), index(i + 1, j + 1), index(i, j + 1)));
                }
            }
        }
    }
    (points, triangles)
}

/// Moves each point of the unit sphere along its direction, by broad lumps, sharp ridges and fine
/// grain.
fn displace(points: &mut [Vec3]) {
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    let share = points.len().div_ceil(threads);
    std::thread::scope(|scope| {
        for part in points.chunks_mut(share) {
            scope.spawn(|| {
                for point in part {
                    let lumps = noise(*point * 1.3 + 7.0);
                    let (mut ridges, mut frequency, mut amplitude) = (0.0, 2.0, 0.5);
                    for _ in 0..7 {
                        ridges += amplitude * (1.0 - 2.0 * noise(*point * frequency + 31.0).abs());
                        frequency *= 2.03;
                        amplitude *= 0.48;
                    }
                    *point *= 0.85 + 0.22 * lumps + 0.16 * ridges;
                }
            });
        }
    });
}

/// Returns gradient noise (Perlin 2002) from a hash, about -1 to 1.
fn noise(point: Vec3) -> f32 {
    let cell = point.floor();
    let f = point - cell;
    let (x, y, z) = (cell.x as i32, cell.y as i32, cell.z as i32);
    let s = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let corner = |dx: i32, dy: i32, dz: i32| {
        let h = hash(x + dx, y + dy, z + dz);
        let d = f - Vec3::new(dx as f32, dy as f32, dz as f32);
        // The directions to the twelve edges of a cube.
        let (a, b) = match h % 3 {
            0 => (d.x, d.y),
            1 => (d.y, d.z),
            _ => (d.z, d.x),
        };
        (if h & 0x10000 == 0 { a } else { -a }) + (if h & 0x20000 == 0 { b } else { -b })
    };
    let mix = |a: f32, b: f32, t: f32| a + t * (b - a);
    let edge = |dy, dz| mix(corner(0, dy, dz), corner(1, dy, dz), s.x);
    let side = |dz| mix(edge(0, dz), edge(1, dz), s.y);
    mix(side(0), side(1), s.z)
}

/// Returns a hash of a cell: coordinates times large primes, mixed by Wellons' lowbias32.
fn hash(x: i32, y: i32, z: i32) -> u32 {
    let mut h = (x as u32).wrapping_mul(0x8da6_b343)
        ^ (y as u32).wrapping_mul(0xd816_3841)
        ^ (z as u32).wrapping_mul(0xcb1a_b31f);
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}

/// Returns the normal of each point: the sum of the normals of the triangles around it, weighted by
/// area.
fn normals(positions: &[Vec3], triangles: &[UVec3]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.to_array().map(|i| i as usize);
        let normal = (positions[b] - positions[a]).cross(positions[c] - positions[a]);
        for i in [a, b, c] {
            normals[i] += normal;
        }
    }
    normals.iter().map(|normal| normal.normalize_or_zero()).collect()
}

fn ply(positions: &[Vec3], normals: &[Vec3], triangles: &[UVec3]) -> Vec<u8> {
    let (vertices, faces) = (positions.len(), triangles.len());
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment made by the example mesh_ply of Trisect; CC0-1.0\n\
         element vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         property float nx\nproperty float ny\nproperty float nz\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    );
    let mut bytes = header.into_bytes();
    bytes.reserve_exact(24 * vertices + 13 * faces);
    for (position, normal) in positions.iter().zip(normals) {
        for value in position.to_array().into_iter().chain(normal.to_array()) {
            bytes.extend(value.to_le_bytes());
        }
    }
    for triangle in triangles {
        bytes.push(3);
        for index in triangle.to_array() {
            bytes.extend((index as i32).to_le_bytes());
        }
    }
    bytes
}
