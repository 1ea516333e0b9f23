#![allow(clippy::unwrap_used, reason = "tests")]

use super::*;
use crate::bvh::Bvh;
use glam::Quat;
use glam::Vec3;
use trisect_scene::Scene;
use trisect_shared::bvh::{Hit, RayQuery};
use trisect_shared::features::FeatureSet;
use trisect_shared::math::{basis, unit_f32};
use trisect_shared::params::RenderParams;
use trisect_shared::rng::PathKey;
use trisect_shared::scene as shared;
use trisect_shared::sphere::Sphere;
use trisect_shared::tile_entry::tile_entry;
use trisect_shared::traversal::closest_hit_below;
use trisect_shared::wide::WideTree;

const SIZE: (u32, u32) = (61, 37);

/// Returns a number that is uniform in [0, 1).
fn number(seed: u32, index: u32, which: usize) -> f32 {
    let w = PathKey { seed, pixel: index, sample: 0 }.words(which as u32 / 4);
    unit_f32([w.x, w.y, w.z, w.w][which % 4])
}

/// Returns a scene of spheres of all sizes about a point, some of them about the camera, and one as
/// the ground.
fn spheres(seed: u32, scale: f32, place: Vec3) -> Scene {
    let mut scene = Scene::hello_world().unwrap();
    let model = scene.spheres[0];
    let at = |center: Vec3, radius: f32| Sphere {
        center: place + center * scale,
        radius: radius * scale,
        ..model
    };
    scene.spheres = (0..300)
        .map(|i| {
            let n = |which| number(seed, i, which);
            let center = Vec3::new(n(0), n(1), n(2)) * 20.0 - 10.0;
            at(center, 0.02 * (n(3) * 4.0).exp())
        })
        .collect();
    scene.spheres.push(at(Vec3::new(0.0, -1010.0, 0.0), 1000.0));
    scene
}

/// Returns a camera above the ground that looks at the spheres with some roll; every other one has
/// a lens.
fn camera(seed: u32, scale: f32, place: Vec3) -> Camera {
    let n = |which| number(seed, 9999, which);
    let eye = Vec3::new(n(0) * 40.0 - 20.0, n(1) * 15.0 - 4.0, n(2) * 40.0 - 20.0);
    let forward = (Vec3::new(n(3), n(4), n(5)) * 6.0 - eye).normalize();
    let turn = Quat::from_axis_angle(forward, n(6) * 6.0);
    let (right, down) = basis(forward);
    let (right, down) = (turn * right * scale, turn * down * scale);
    let focus = 0.5 + 20.0 * n(7);
    let pixel = focus * (0.2 + n(8)) / SIZE.0 as f32;
    let lens = if seed.is_multiple_of(2) { 0.2 * n(9) } else { 0.0 };
    let (width, height) = (SIZE.0 as f32, SIZE.1 as f32);
    Camera {
        origin: place + eye * scale,
        corner: forward * (focus * scale) - right * (pixel * 0.5 * width) - down * (pixel * 0.5 * height),
        step_x: right * pixel,
        step_y: down * pixel,
        lens_x: right * lens,
        lens_y: down * -lens,
        ..bytemuck::Zeroable::zeroed()
    }
}

/// Number of camera rays, of those that hit something, and of those that hit something else below
/// the entry of their tile, or of the tile to its right.
#[derive(Default)]
struct Count {
    rays: u32,
    hits: u32,
    differ: u32,
    differ_beside: u32,
}

fn count(scene: &Scene, camera: &Camera, shift: u32, count: &mut Count) {
    let bvh = Bvh::build(scene, None).unwrap();
    let view = build_tile_entries(&bvh.nodes, bvh.root, camera, SIZE.0, SIZE.1, shift).unwrap();
    let nodes: Vec<BvhNode> = bvh.nodes.iter().chain(&view).copied().collect();
    for (index, node) in view.iter().enumerate() {
        for child in [node.first, node.second, node.tile_entry].map(Child) {
            let limit = if child.is_leaf() { scene.spheres.len() } else { nodes.len() };
            assert!(child == Child::EMPTY || (child.index() as usize) < limit, "{index}: {child:?}");
        }
    }
    let arrays = shared::Scene {
        spheres: &scene.spheres,
        nodes: &nodes,
        materials: &[],
        planars: &[],
        triangles: &[],
        vertices: &[],
        lights: &[],
        textures: &[],
        texels: &[],
        environment: &[],
        wide: WideTree::NONE,
    };
    let params = RenderParams {
        root: bvh.root.0,
        width: SIZE.0,
        height: SIZE.1,
        first_planar: scene.spheres.len() as u32,
        first_triangle: scene.spheres.len() as u32,
        primitive_count: scene.spheres.len() as u32,
        first_tile_entry: bvh.nodes.len() as u32,
        tile_shift: shift,
        ..bytemuck::Zeroable::zeroed()
    };
    for pixel in 0..SIZE.0 * SIZE.1 {
        let (x, y) = (pixel % SIZE.0, pixel / SIZE.0);
        for sample in 0..3 {
            let ray = camera.ray(x, y, PathKey { seed: 5, pixel, sample }.words(0));
            // SAFETY: the BVH was validated, and the children of the tile entries were checked
            // above.
            #[allow(unsafe_code, reason = "kernels read without bounds checks")]
            let [want, got, beside]: [Hit; 3] = unsafe {
                let below = |root| {
                    closest_hit_below(FeatureSet::<0>::ALL, &params, arrays, ray, RayQuery::CLOSEST, root)
                };
                let right = (x + (1 << shift)).min(SIZE.0 - 1);
                [bvh.root, tile_entry(&params, arrays, x, y), tile_entry(&params, arrays, right, y)]
                    .map(below)
            };
            count.rays += 1;
            count.hits += u32::from(want.primitive != trisect_shared::bvh::NO_PRIMITIVE);
            count.differ += u32::from(got != want);
            count.differ_beside += u32::from(beside != want);
        }
    }
}

/// Camera rays hit the same below their tile's entry as below the root, in small and large worlds,
/// near and far from the origin, with tiles of all sizes. Negative control: below the entry of the
/// tile beside, hits are lost.
#[test]
fn a_tile_sees_what_its_rays_meet() {
    let mut sum = Count::default();
    for seed in 0..40 {
        let scale = [1.0, 1e-3, 1e4][seed as usize % 3];
        let place = [Vec3::ZERO, Vec3::new(1e4, -1e5, 1e3) * scale][seed as usize / 3 % 2];
        let scene = spheres(seed, scale, place);
        count(&scene, &camera(seed, scale, place), [2, 3, 4, 10][seed as usize % 4], &mut sum);
    }
    assert_eq!(sum.differ, 0, "of {} rays, {} of which hit", sum.rays, sum.hits);
    assert!(sum.hits > sum.rays / 10 && sum.differ_beside > sum.rays / 1000, "the comparison detects little");
}

#[test]
fn scenes_without_inner_nodes() {
    let mut scene = spheres(0, 1.0, Vec3::ZERO);
    for left in [1, 0] {
        scene.spheres.truncate(left);
        count(&scene, &camera(1, 1.0, Vec3::ZERO), 4, &mut Count::default());
    }
}

/// The entry of a tile that sees the sky is empty; that of a tile that sees one sphere is the
/// sphere.
#[test]
fn what_no_ray_meets_is_gone() {
    let mut scene = spheres(0, 1.0, Vec3::ZERO);
    scene.spheres.truncate(1);
    let place = |x: f32| Sphere { center: Vec3::new(x, 0.0, -5.0), radius: 0.5, ..scene.spheres[0] };
    scene.spheres = vec![place(-3.0), place(3.0), place(30.0)];
    let bvh = Bvh::build(&scene, None).unwrap();
    let mut camera = camera(1, 1.0, Vec3::ZERO);
    camera.origin = Vec3::ZERO;
    camera.corner = Vec3::new(-1.0, 1.0, -1.0);
    (camera.step_x, camera.step_y) = (Vec3::X / 32.0, Vec3::NEG_Y / 32.0);
    let view = build_tile_entries(&bvh.nodes, bvh.root, &camera, 64, 64, 4).unwrap();
    let entries: Vec<Child> = view.iter().take(16).map(|node| Child(node.tile_entry)).collect();
    assert_eq!(entries[0], Child::EMPTY);
    assert_eq!((entries[4], entries[7]), (Child::leaf(0), Child::leaf(1)));
}
