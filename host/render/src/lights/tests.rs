//! Light trees: their structure, and probabilities by quadrature and by counting.
#![allow(unsafe_code, clippy::unwrap_used, reason = "the trees are built here; this is how a test fails")]

use super::Lights;
use glam::Vec3;
use trisect_scene::Scene;
use trisect_scene::builder::{Camera, Emissive, Lambertian, SceneBuilder};
use trisect_shared::bvh::NO_PRIMITIVE;
use trisect_shared::light::tree::{LEAF, LightNode, NOWHERE, area_pdf, child_count, choose, first_child};
use trisect_shared::light::{DIRECTIONAL, Light, POINT, ReferencePoint};
use trisect_shared::params::RenderParams;
use trisect_shared::rng::{PathKey, Words};

fn words(index: u32) -> Words {
    PathKey { seed: 11, pixel: index, sample: 0 }.words(0)
}

fn unit(word: u32) -> f64 {
    f64::from(word) / 4_294_967_296.0
}

/// Returns a scene with `count` spheres and as many quads that emit on one side, in a box, some of
/// them a thousand times as bright as others.
fn scene(count: u32) -> Scene {
    lamps(count, count)
}

/// Returns a scene with `spheres` and `quads` that emit.
fn lamps(spheres: u32, quads: u32) -> Scene {
    let mut scene = SceneBuilder::new();
    let floor = scene.material(Lambertian::rgb(0.5, 0.5, 0.5));
    let lamps = [0.1, 1.0, 100.0].map(|radiance| scene.material(Emissive::rgb(radiance, radiance, radiance)));
    scene.plane([0.0; 3], [0.0, 1.0, 0.0], floor);
    for index in 0..spheres.max(quads) {
        let [a, b] = [words(index), words(index + 1000)];
        let at = [unit(a.x) * 10.0 - 5.0, unit(a.y) * 4.0, unit(a.z) * 10.0 - 5.0];
        let lamp = lamps[(a.w % 3) as usize];
        if index < spheres {
            scene.sphere(at, 0.01 + 0.1 * unit(b.x), lamp);
        }
        let at = [unit(b.y) * 10.0 - 5.0, unit(b.z) * 4.0, unit(b.w) * 10.0 - 5.0];
        if index < quads {
            scene.quad(at, [0.2 * unit(a.x), 0.1, 0.0], [0.0, 0.2 * unit(a.y), 0.1], lamp);
        }
    }
    scene.camera(Camera::look_at([0.0, 1.0, 8.0], [0.0; 3]));
    scene.build().unwrap()
}

fn params(lights: &Lights) -> RenderParams {
    let zero: RenderParams = bytemuck::Zeroable::zeroed();
    RenderParams { light_count: lights.count, area_light_count: lights.area_count, ..zero }
}

fn arrays(lights: &Lights) -> trisect_shared::scene::Scene<'_> {
    trisect_shared::scene::Scene {
        spheres: &[],
        nodes: &[],
        materials: &[],
        planars: &[],
        triangles: &[],
        vertices: &[],
        lights: &lights.lights,
        textures: &[],
        texels: &[],
        environment: &[],
        wide: trisect_shared::wide::WideTree::NONE,
    }
}

/// Returns the probability of each light, from the leaves up.
fn probabilities(lights: &Lights, from: &ReferencePoint) -> Vec<f64> {
    let (params, arrays) = (params(lights), arrays(lights));
    let of = |light: &Light| {
        // SAFETY: the tree is that of the lights.
        let pdf = unsafe { area_pdf(&params, arrays, from, light.primitive) };
        f64::from(pdf) / f64::from(light.intensity.x)
    };
    lights.lights[..lights.count as usize].iter().map(of).collect()
}

fn points() -> impl Iterator<Item = ReferencePoint> {
    (0..40).map(|index| {
        let w = words(index + 5000);
        let point =
            Vec3::new(unit(w.x) as f32 * 12.0 - 6.0, unit(w.y) as f32 * 5.0 - 0.5, unit(w.z) as f32 * 4.0);
        let normal = [Vec3::ZERO, Vec3::Y, Vec3::new(0.6, 0.0, -0.8)][index as usize % 3];
        ReferencePoint { point, primitive: NO_PRIMITIVE, normal }
    })
}

/// Each light is a leaf once, and knows the way to the root.
#[test]
fn each_light_is_a_leaf() {
    for count in (2..20).chain([400]) {
        let lights = Lights::new(&scene(count));
        assert!(lights.has_tree() && lights.count == 2 * count);
        let (own, tree) = lights.lights.split_at(lights.count as usize);
        let nodes: &[LightNode] = bytemuck::cast_slice(&tree[1..]);
        let mut leaves = vec![0; own.len()];
        // Link to children, with the link to their parent's siblings, its place, and its node.
        let mut waiting = vec![(tree[0].kind, NOWHERE, 0, None::<LightNode>)];
        while let Some((link, siblings, place, parent)) = waiting.pop() {
            let children = &nodes[first_child(link) as usize..][..child_count(link) as usize];
            assert!(children.len() >= 2);
            // A CPU reads three children as four.
            assert!(nodes.len() > (first_child(link) + child_count(link)) as usize);
            assert_eq!(children[0].back, siblings);
            assert!(siblings == NOWHERE || children[1].back == place);
            for (place, child) in (0..).zip(children) {
                if let Some(parent) = parent {
                    let reach = child.center.distance(parent.center) + child.radius;
                    // The box of a node is inside its sphere, not the spheres of its children.
                    assert!(reach < 2.0 * parent.radius + 1e-5);
                }
                if child.link & LEAF == 0 {
                    waiting.push((child.link, link, place, Some(*child)));
                } else {
                    let light = (child.link & !LEAF) as usize;
                    leaves[light] += 1;
                    assert_eq!((own[light].threshold, own[light].alias), (link, place));
                }
            }
        }
        assert!(leaves.iter().all(|&count| count == 1));
    }
}

/// With lights that emit to one side a descent may end where none sends light to the point.
#[test]
fn probabilities_sum_to_one() {
    for (spheres, quads) in [(3, 0), (40, 0), (800, 0), (2, 2), (400, 400), (0, 800)] {
        let lights = Lights::new(&lamps(spheres, quads));
        for from in points() {
            let sum: f64 = probabilities(&lights, &from).iter().sum();
            let least = if quads > 0 { 0.4 } else { 1.0 };
            assert!((least - 1e-6..1.0 + 1e-6).contains(&sum), "{spheres} {quads} {from:?}: {sum}");
        }
    }
}

/// Chi-square of the lights that are chosen, or of none, against their probabilities. Negative
/// control: those of a surface that faces away.
#[test]
fn choices_have_these_probabilities() {
    let lights = Lights::new(&scene(30));
    let (params, arrays) = (params(&lights), arrays(&lights));
    const DRAWS: u32 = 200_000;
    for (index, from) in (0..).zip(points().take(6)) {
        let mut counts = vec![0u32; lights.count as usize + 1];
        let mut off = 0.0f32;
        let all = |from: &ReferencePoint| {
            let mut all = probabilities(&lights, from);
            all.push(1.0 - all.iter().sum::<f64>());
            all
        };
        let expected = all(&from);
        for draw in 0..DRAWS {
            // SAFETY: the tree is that of the lights.
            let choice = unsafe { choose(&params, arrays, &from, words(draw * 7 + index)) };
            let place = choice.light.min(lights.count) as usize;
            counts[place] += 1;
            if place < lights.count as usize {
                off = off.max((choice.probability / expected[place] as f32 - 1.0).abs());
            }
        }
        assert!(off < 1e-5, "{off}");
        let excess = |expected: &[f64]| {
            let (mut sum, mut cells) = (0.0, 0.0);
            for (count, p) in counts.iter().zip(expected) {
                let mean = p * f64::from(DRAWS);
                if mean >= 5.0 {
                    sum += (f64::from(*count) - mean).powi(2) / mean;
                    cells += 1.0;
                }
            }
            (sum - cells) / f64::sqrt(2.0 * cells)
        };
        assert!(excess(&expected) < 5.0, "{from:?}: {}", excess(&expected));
        let turned = ReferencePoint { normal: Vec3::new(0.0, -0.6, 0.8), ..from };
        assert!(excess(&all(&turned)) > 50.0);
    }
}

/// A sun leaves at least a quarter of the choices to lamps.
#[test]
fn a_sun_leaves_a_share_to_lamps() {
    let mut scene = scene(2);
    let mut sun: Light = bytemuck::Zeroable::zeroed();
    (sun.kind, sun.position, sun.intensity) = (DIRECTIONAL, Vec3::Y, Vec3::splat(1e6));
    scene.lights.push(sun);
    let lights = Lights::new(&scene);
    for from in points() {
        let lamps: f64 = probabilities(&lights, &from)[..4].iter().sum();
        assert!((0.249..0.751).contains(&lamps), "{lamps}");
    }
}

/// A million lights in one place; one of 1e18 among dim ones.
#[test]
fn extreme_lights() {
    let mut scene = scene(3);
    let point = |strength: f32, x: f32| {
        let mut light: Light = bytemuck::Zeroable::zeroed();
        (light.kind, light.cone_offset) = (POINT, 1.0);
        (light.intensity, light.position) = (Vec3::splat(strength), Vec3::new(x, 1.0, 0.0));
        light
    };
    scene.lights = std::iter::repeat_n(point(1.0, 0.0), 1_000_000).collect();
    let lights = Lights::new(&scene);
    let (params, arrays) = (params(&lights), arrays(&lights));
    for from in points() {
        // SAFETY: the tree is that of the lights.
        let choice = unsafe { choose(&params, arrays, &from, words(3)) };
        assert!(choice.light < lights.count && choice.probability > 0.0, "{choice:?}");
    }
    scene.lights = (0..1000).map(|i| point(if i == 500 { 1e18 } else { 1e-3 }, i as f32)).collect();
    let lights = Lights::new(&scene);
    let (params, arrays) = (self::params(&lights), self::arrays(&lights));
    let from = points().next().unwrap();
    let mut dim = 0;
    for index in 0..10_000 {
        // SAFETY: the tree is that of the lights.
        let choice = unsafe { choose(&params, arrays, &from, words(index)) };
        assert!(choice.probability.is_finite() && choice.probability > 0.0);
        dim += u32::from(lights.lights[choice.light as usize].intensity.x < 1.0);
    }
    assert!((100..5000).contains(&dim), "{dim}");
}
