//! The wide BVH and a test of each primitive give the same bits, with each instruction set of this
//! processor.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

mod inputs;

use bytemuck::Zeroable;
use inputs::{build, rays, share, words};
use trisect::bvh::{Bvh, Wide};
use trisect::device::cpu::{Cpu, InstructionSet};
use trisect::film::Film;
use trisect::render::{Renderer, Settings, Traversal};
use trisect::scene::Scene;
use trisect_shared::bvh::{Hit, NO_INSTANCE, NO_PRIMITIVE, RayQuery};
use trisect_shared::features::{AVX2, AVX512, FeatureSet, Features, INSTANCES, LINEAR, SHAPES, WIDE};
use trisect_shared::params::RenderParams;
use trisect_shared::ray::{OriginPrimitive, Ray};
use trisect_shared::scene as shared;
use trisect_shared::traversal::closest_hit;
use trisect_shared::wide::WideTree;
use trisect_tests::renders::independent;
use trisect_tests::scene;

const SETS: [InstructionSet; 3] = [InstructionSet::Avx512, InstructionSet::Avx2, InstructionSet::Baseline];

/// A scene and its BVHs.
struct Traced {
    scene: Scene,
    bvh: Bvh,
    wide: Wide,
}

impl Traced {
    fn new(scene: Scene) -> Self {
        let bvh = Bvh::build(&scene, None).unwrap();
        let wide = Wide::new(&scene, &bvh).unwrap().unwrap();
        Self { scene, bvh, wide }
    }

    fn all<const FEATURES: Features>(&self, tree: WideTree, rays: &[(Ray, RayQuery)]) -> Vec<Hit> {
        let (spheres, flats) = (self.scene.spheres.len() as u32, self.scene.flats.len() as u32);
        let params = RenderParams {
            root: self.bvh.root.0,
            first_planar: spheres,
            first_triangle: spheres + flats,
            primitive_count: self.scene.world_primitives() as u32,
            first_instance: self.bvh.first_leaf_of_instances(),
            instance_count: self.scene.shared.instances.len() as u32,
            first_instance_node: self.bvh.first_instance_node as u32,
            ..RenderParams::zeroed()
        };
        let arrays = shared::Scene {
            spheres: &self.scene.spheres,
            nodes: &self.bvh.nodes,
            materials: &[],
            planars: &self.scene.flats,
            triangles: &self.scene.numbered_triangles(),
            vertices: &[],
            lights: &[],
            textures: &[],
            texels: &[],
            environment: &[],
            wide: tree,
        };
        // SAFETY: the BVHs were validated; a damaged one has the same children; the processor has
        // the instructions.
        #[allow(unsafe_code, reason = "kernels read without bounds checks")]
        let hit =
            |ray, reach| unsafe { closest_hit(FeatureSet::<FEATURES>::ALL, &params, arrays, ray, reach) };
        rays.iter().map(|(ray, reach)| hit(*ray, *reach)).collect()
    }

    /// Returns the hits of rays in a wide BVH.
    fn hits(&self, set: InstructionSet, tree: WideTree, rays: &[(Ray, RayQuery)]) -> Vec<Hit> {
        const ALL: Features = SHAPES | INSTANCES | WIDE;
        match set {
            InstructionSet::Avx512 => self.all::<{ ALL | AVX512 }>(tree, rays),
            InstructionSet::Avx2 => self.all::<{ ALL | AVX2 }>(tree, rays),
            InstructionSet::Baseline => self.all::<ALL>(tree, rays),
        }
    }

    /// Returns the number of hits that differ from those of a test of each primitive.
    fn differing(
        &self,
        set: InstructionSet,
        tree: WideTree,
        rays: &[(Ray, RayQuery)],
        want: &[Hit],
    ) -> usize {
        let got = self.hits(set, tree, rays);
        let bits = |hit: &Hit| (hit.distance.to_bits(), hit.primitive, hit.instance);
        got.iter().zip(want).filter(|(got, want)| bits(got) != bits(want)).count()
    }
}

fn sets() -> impl Iterator<Item = InstructionSet> {
    SETS.into_iter().filter(|set| {
        if !set.is_available() {
            eprintln!("SKIPPED: this processor has no {}", set.name());
        }
        set.is_available()
    })
}

#[test]
fn hits_are_those_of_each_primitive_tested() {
    for (kind, scale) in [(0, 0), (1, 0), (2, 0), (3, 0), (0, -20), (2, -20), (0, 20), (2, 20)] {
        let size = f32::powi(2.0, scale);
        let traced = Traced::new(build(kind, size, 40));
        let rays = rays(&traced.scene, size, 6000);
        let want = traced.all::<{ SHAPES | LINEAR }>(WideTree::NONE, &rays);
        let hits = want.iter().filter(|hit| hit.primitive != NO_PRIMITIVE).count();
        assert!(hits * 4 > rays.len(), "scene {kind}: {hits} rays hit");
        let stack = traced.all::<{ SHAPES }>(WideTree::NONE, &rays);
        let other = stack.iter().zip(&want).filter(|(a, b)| a != b).count();
        assert_eq!(other, 0, "scene {kind}, 2^{scale}: binary tree");
        for set in sets() {
            let tree = traced.wide.tree();
            let name = set.name();
            assert_eq!(traced.differing(set, tree, &rays, &want), 0, "scene {kind}, 2^{scale}: {name}");
            if scale != 0 {
                continue;
            }
            // Negative controls: a child that no ray enters; boxes too small by a thousandth; other
            // primitives.
            let damaged = |damage: &dyn Fn(&mut Wide)| {
                let mut wide = traced.wide.clone();
                damage(&mut wide);
                traced.differing(set, wide.tree(), &rays, &want)
            };
            let lost = damaged(&|wide| {
                (0..3).for_each(|axis| wide.nodes[0].planes[axis].0[1] = f32::INFINITY);
            });
            assert!(lost > 0, "scene {kind}, {name}: negative control not detected (a lost child)");
            let small = damaged(&|wide| {
                for node in &mut wide.nodes {
                    (0..3).for_each(|axis| node.planes[axis].0 = node.planes[axis].0.map(|x| x + 1e-3));
                    (3..6).for_each(|axis| node.planes[axis].0 = node.planes[axis].0.map(|x| x - 1e-3));
                }
            });
            assert!(small > 0, "scene {kind}, {name}: negative control not detected (boxes too small)");
            let swapped = damaged(&|wide| {
                wide.triangles.iter_mut().for_each(|packet| packet.primitives.0[0] ^= 1);
                wide.spheres.iter_mut().for_each(|packet| packet.primitives.0[0] ^= 1);
            });
            assert!(swapped > 0, "scene {kind}, {name}: negative control not detected (another primitive)");
        }
    }
}

/// The traversals agree on triangles of instances, and of coincident ones on the instance.
#[test]
fn hits_in_instances_are_those_of_each_triangle_tested() {
    for (kind, scale) in [(0, 0), (2, 0), (0, -20), (2, 20)] {
        let size = f32::powi(2.0, scale);
        let mut scene = build(kind, size, 40);
        share(&mut scene, size);
        scene.validate().unwrap();
        let traced = Traced::new(scene);
        let mut rays = rays(&traced.scene, size, 6000);
        for (i, (ray, _)) in (0..).zip(&mut rays) {
            if ray.origin_primitive != OriginPrimitive::NONE {
                ray.origin_instance = words(24, i)[0] % 12;
            }
        }
        let want = traced.all::<{ SHAPES | INSTANCES | LINEAR }>(WideTree::NONE, &rays);
        let inside = want.iter().filter(|hit| hit.instance != NO_INSTANCE).count();
        assert!(inside * 20 > rays.len(), "scene {kind}: {inside} rays hit instances");
        let stack = traced.all::<{ SHAPES | INSTANCES }>(WideTree::NONE, &rays);
        assert_eq!(stack.iter().zip(&want).filter(|(a, b)| a != b).count(), 0, "scene {kind}: binary tree");
        for set in sets() {
            let name = set.name();
            assert_eq!(traced.differing(set, traced.wide.tree(), &rays, &want), 0, "scene {kind}: {name}");
            // Negative control: another mesh.
            let mut wide = traced.wide.clone();
            wide.instance_roots.swap(0, 2);
            assert!(traced.differing(set, wide.tree(), &rays, &want) > 0, "negative control not detected");
        }
    }
}

/// A shadow ray is blocked if its closest hit is another primitive than its light, in whichever
/// order the traversal tests primitives.
#[test]
fn shadow_rays_know_their_target() {
    for kind in 0..4 {
        let traced = Traced::new(build(kind, 1.0, 40));
        let primitives = traced.scene.primitives() as u32;
        let closest = rays(&traced.scene, 1.0, 6000);
        let want = traced.all::<{ SHAPES | LINEAR }>(WideTree::NONE, &closest);
        // Half of the lights are the ray's first hit.
        let target = |i: usize| match want[i].primitive {
            primitive if i.is_multiple_of(2) && primitive != NO_PRIMITIVE => primitive,
            _ => words(23, i as u32)[0] % primitives,
        };
        let any: Vec<(Ray, RayQuery)> = (0..)
            .zip(&closest)
            .map(|(i, (ray, reach))| (*ray, RayQuery { any_hit: true, light_primitive: target(i), ..*reach }))
            .collect();
        let is_blocked = |hit: &Hit, target| hit.primitive != NO_PRIMITIVE && hit.primitive != target;
        let blocked = (0..).zip(&want).filter(|(i, hit)| is_blocked(hit, target(*i))).count();
        assert!(blocked * 10 > any.len() && blocked * 10 < 9 * any.len(), "{blocked} of {} rays", any.len());
        for set in sets() {
            let wrong = |tree| {
                let got = traced.hits(set, tree, &any);
                let wrong = |i: &usize| is_blocked(&got[*i], target(*i)) != is_blocked(&want[*i], target(*i));
                (0..got.len()).filter(wrong).count()
            };
            assert_eq!(wrong(traced.wide.tree()), 0, "scene {kind}, {}", set.name());
            assert!(wrong(WideTree::NONE) > 0, "scene {kind}: negative control not detected");
        }
    }
}

/// The smallest scenes, of no primitive, one, one of each kind, and 8 or 9 of a kind, some of whose
/// wide BVHs have no nodes.
#[test]
fn the_smallest_scenes() {
    for (spheres, flats, triangles) in
        [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1), (8, 0, 0), (9, 0, 0), (0, 0, 9)]
    {
        let mut scene = build(0, 1.0, 10);
        let spare = build(0, 1.0, 10);
        scene.spheres.truncate(spheres);
        scene.flats.truncate(flats);
        scene.triangles.truncate(triangles);
        let traced = Traced::new(scene);
        let rays = rays(&spare, 1.0, 2000);
        let want = traced.all::<{ SHAPES | LINEAR }>(WideTree::NONE, &rays);
        for set in sets() {
            assert_eq!(traced.differing(set, traced.wide.tree(), &rays, &want), 0, "{}", set.name());
        }
    }
}

fn film(scene: &Scene, set: InstructionSet, settings: &Settings) -> Film {
    let cpu = Cpu::with_instructions(None, set).unwrap();
    Renderer::new(cpu, scene).unwrap().render(settings).unwrap().film
}

/// An image depends neither on the traversal nor on the instruction set.
#[test]
fn images_are_the_same() {
    for name in [
        "rtiow_final.ron",
        "three_spheres.ron",
        "cornell_box.ron",
        "materials.ron",
        "many_lights.ron",
        "next_week.ron",
        "gltf/features.glb",
    ] {
        let scene = scene(name);
        let by = |traversal, seed| Settings {
            width: 64,
            height: 36,
            samples: 4,
            seed,
            traversal: Some(traversal),
            ..independent(&scene)
        };
        let want = film(&scene, InstructionSet::Baseline, &by(Traversal::Stack, 1));
        let linear = film(&scene, InstructionSet::Baseline, &by(Traversal::Linear, 1));
        assert!(linear == want, "{name}: linear");
        for set in sets().filter(|set| *set != InstructionSet::Baseline) {
            assert!(film(&scene, set, &by(Traversal::Wide, 1)) == want, "{name}: {}", set.name());
            // Negative control: another seed.
            assert!(
                film(&scene, set, &by(Traversal::Wide, 2)) != want,
                "{name}: negative control not detected"
            );
        }
    }
}
