//! Memory of a render on the CPU and of the construction of both BVHs, in bytes for each triangle.
//! A counting allocator measures it: the counts do not depend on the machine, but for how many
//! threads build.
#![allow(clippy::unwrap_used, reason = "a test")]

mod counted;

use counted::held;
use glam::Vec3;
use trisect::bvh::{Bvh, Wide};
use trisect::device::cpu::Cpu;
use trisect::render::{Renderer, Settings};
use trisect::scene::Scene;
use trisect_shared::triangle::Triangle;

/// Squares along a side of the mesh, each of two triangles: enough for several parts at once.
const SIDE: u32 = 768;

/// Bytes of a node of the binary BVH, of which there is one for each triangle.
const NODE: f64 = 64.0;

/// Returns a mesh of hills.
fn hills() -> Scene {
    let at = |x: u32, z: u32| {
        let (x, z) = (x as f32, z as f32);
        Vec3::new(x, 20.0 * (0.05 * x).sin() * (0.03 * z).cos() + (0.9 * x).sin() * (1.1 * z).sin(), z)
    };
    let mut scene = Scene::hello_world().unwrap();
    scene.triangles.reserve_exact((2 * SIDE * SIDE) as usize);
    for (x, z) in (0..SIDE).flat_map(|z| (0..SIDE).map(move |x| (x, z))) {
        let corners = [(x, z), (x + 1, z), (x, z + 1), (x + 1, z + 1)];
        let triangle = |of: [usize; 3]| {
            let [a, b, c] = of.map(|corner| at(corners[corner].0, corners[corner].1));
            let [vertex_a, vertex_b, vertex_c] =
                of.map(|corner| corners[corner].1 * (SIDE + 1) + corners[corner].0);
            Triangle { a, vertex_a, b, vertex_b, c, vertex_c }
        };
        scene.triangles.extend([[0, 2, 1], [1, 2, 3]].map(triangle));
    }
    scene.vertices = vec![bytemuck::Zeroable::zeroed(); ((SIDE + 1) * (SIDE + 1)) as usize].into();
    scene
}

/// Runs `what`. Returns what it made, and how many bytes it held at the peak.
fn peak<T>(what: impl FnOnce() -> T) -> (T, f64) {
    let (made, bytes) = held(what);
    (made, bytes.peak as f64)
}

/// One test, because tests run side by side and the counts are of the process.
#[test]
fn bytes_for_each_triangle() {
    let scene = hills();
    let triangles = scene.triangles.len() as f64;
    let (bvh, built) = peak(|| Bvh::build(&scene, None).unwrap());
    let (wide, collapsed) = peak(|| Wide::new(&scene, &bvh).unwrap().unwrap());
    let [built, collapsed] = [built, collapsed].map(|bytes| bytes / triangles);
    // The nodes, and the parts that are built at once.
    assert!(built < NODE + 120.0, "{built}");
    // The packets and nodes of the wide BVH, and 4 bytes for the plan of each binary node.
    assert!(collapsed < 64.0, "{collapsed}");
    let lanes = triangles / (8 * wide.triangles.len()) as f64;
    println!("{:.1} % of the lanes have a triangle", 100.0 * lanes);
    assert!(lanes > 0.9, "{lanes}");
    // What is kept takes no more than its length.
    let kept = size_of_val(wide.nodes.as_slice()) + size_of_val(wide.triangles.as_slice());
    assert!(collapsed < kept as f64 / triangles + 8.0, "{collapsed}");
    assert_eq!((wide.nodes.capacity(), wide.triangles.capacity()), (wide.nodes.len(), wide.triangles.len()));
    assert_eq!(bvh.nodes.capacity(), bvh.nodes.len());

    // A render on the CPU, from the records of the scene to the film.
    let settings = Settings { width: 16, height: 8, samples: 1, depth: 4, ..Settings::of(&scene) };
    drop((bvh, wide, scene));
    let render = || {
        let scene = hills();
        let mut renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
        renderer.render(&settings).unwrap()
    };
    let (_, whole) = peak(render);
    assert!(whole / triangles < 200.0, "{}", whole / triangles);
    println!("bytes for each triangle: {built:.1} {collapsed:.1} {:.1}", whole / triangles);

    // Negative controls: an array of all boxes is noticed, and so is a copy of the triangles.
    let scene = hills();
    let bvh = Bvh::build(&scene, None).unwrap();
    let (_, copied) = peak(|| (scene.triangles.to_vec(), render()));
    assert!(copied / triangles > 200.0, "{}", copied / triangles);
    let (_, more) = peak(|| (Wide::new(&scene, &bvh).unwrap(), vec![0u8; 32 * scene.triangles.len()]));
    assert!(more / triangles > 64.0, "{more}");
}
