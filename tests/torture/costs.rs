//! Test 44: visits of rays at the extremes. It counts nodes and leaves, and never measures time.
//!
//! A ray along an axis or in an axis plane may visit at most 2 times the mean (plus 8) and 4 times
//! the maximum (plus 64) of the same ray tilted by a thousandth. On the binary BVH it may test at
//! most 1.5 times as many primitives (plus 4) as obvhs does with its own BVH and traversal. `COST`
//! lines on standard error make the table "Visits of rays at the extremes" of
//! `docs/notebook/torture-tests.md`.

use crate::construct::{ray, unit, words};
use crate::cost_scenes::{self, CostScene};
use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use rayon::prelude::*;
use std::sync::OnceLock;
use std::time::Duration;
use trisect::bvh::Wide;
use trisect::device::cpu::InstructionSet;
use trisect_probes::record::{Input, vector};
use trisect_probes::visits::{CLOSEST, SHADOW};
use trisect_shared::bvh::{Child, Hit, NO_PRIMITIVE, RayQuery, Visits};
use trisect_shared::features::{AVX2, AVX512, COUNTED, FeatureSet, Features, SHAPES, WIDE};
use trisect_shared::math::{unit_circle, unit_f32};
use trisect_shared::primitive::distance;
use trisect_shared::ray::{OriginPrimitive, Ray};
use trisect_shared::traversal::closest_hit_counted;
use trisect_shared::triangle::Shear;
use trisect_tests::probe::{ProbeScene, Prober};
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_route};

/// Rays of one kind, and the probe operation that traces them.
struct Family {
    name: &'static str,
    operation: u32,
    rays: Vec<Input>,
}

/// Mean and maximum of visits per ray.
#[derive(Clone, Copy, Debug, Default)]
struct Cost {
    nodes: (f64, u32),
    leaves: (f64, u32),
}

impl Cost {
    fn of(visits: &[Visits]) -> Self {
        let over = |count: fn(&Visits) -> u32| {
            let sum: f64 = visits.iter().map(|v| f64::from(count(v))).sum();
            (sum / visits.len() as f64, visits.iter().map(count).max().unwrap_or(0))
        };
        Self { nodes: over(|v| v.nodes), leaves: over(|v| v.leaves) }
    }

    /// Returns whether this is at most `MEAN` times the tilted rays' mean plus 8, and `MAXIMUM`
    /// times their maximum plus 64.
    ///
    /// An exact ray runs in the planes that boxes share. It may therefore enter both boxes at a
    /// plane and all four at an edge, where a tilted ray enters one, and it stays in them where a
    /// tilted ray leaves.
    fn is_bounded_by(&self, tilted: &Self) -> bool {
        const MEAN: f64 = 2.0;
        const MAXIMUM: f64 = 4.0;
        let holds = |a: (f64, u32), b: (f64, u32)| {
            a.0 <= MEAN * b.0 + 8.0 && f64::from(a.1) <= MAXIMUM * f64::from(b.1) + 64.0
        };
        holds(self.nodes, tilted.nodes) && holds(self.leaves, tilted.leaves)
    }
}

/// Returns rays along axes, in axis planes, and to suns along axes, `count` of each. A third each
/// starts outside or at the eye, at the middle of a leaf's box, and at a corner of one.
fn families(scene: &CostScene, probe: &ProbeScene, count: u32) -> Vec<Family> {
    let boxes: Vec<(Vec3, Vec3)> = probe
        .bvh
        .nodes
        .iter()
        .flat_map(|node| [node.first, node.second].into_iter().zip(node.boxes()))
        .filter_map(|(child, corners)| Child(child).is_leaf().then_some(corners))
        .collect();
    let (low, high) = boxes
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), b| (low.min(b.0), high.max(b.1)));
    let axis = |bits: u32| Vec3::AXES[bits as usize % 3] * if bits & 0x100 == 0 { 1.0 } else { -1.0 };
    let origin = |stream: u32, i: u32, direction: Vec3| {
        let (w, v) = (words(stream, i), words(stream + 1, i));
        let (a, b) = boxes[w.x as usize % boxes.len()];
        match i % 3 {
            0 => scene.eye.unwrap_or_else(|| {
                let share = Vec3::new(unit_f32(v.x), unit_f32(v.y), unit_f32(v.z));
                low + (high - low) * share - direction * (high - low).length()
            }),
            1 => 0.5 * (a + b),
            _ => Vec3::select(Vec3::splat(unit_f32(v.w)).cmplt(Vec3::splat(0.5)), a, b),
        }
    };
    let along = |stream: u32, i: u32, direction: Vec3| ray(origin(stream, i, direction), direction);
    let in_plane = |i: u32| {
        let w = words(4412, i);
        let ((x, y), axis) = (unit_circle(w.x), w.y as usize % 3);
        let mut direction = Vec3::ZERO;
        (direction[axis], direction[(axis + 1) % 3]) = (x, y);
        along(4413, i, unit(direction))
    };
    let rays = |f: &dyn Fn(u32) -> Input| (0..count).map(f).collect();
    vec![
        Family {
            name: "along axes",
            operation: CLOSEST,
            rays: rays(&|i| along(4410, i, axis(words(4411, i).x))),
        },
        Family { name: "in axis planes", operation: CLOSEST, rays: rays(&in_plane) },
        Family { name: "sun straight above", operation: SHADOW, rays: rays(&|i| along(4415, i, Vec3::Y)) },
        Family { name: "sun along x", operation: SHADOW, rays: rays(&|i| along(4416, i, Vec3::NEG_X)) },
    ]
}

/// Returns the rays tilted by a thousandth along each axis, to either side.
fn tilted(rays: &[Input]) -> Vec<Input> {
    let tilt = |(i, input): (u32, &Input)| {
        let w = words(4417, i);
        let by = |bits: u32| if bits & 1 == 0 { 1e-3 } else { -1e-3 };
        ray(vector(input.a), unit(vector(input.b) + Vec3::new(by(w.x), by(w.y), by(w.z))))
    };
    (0u32..).zip(rays).map(tilt).collect()
}

/// Returns the visits of the wide BVH with the best instruction set of this processor.
fn wide_visits(probe: &ProbeScene, wide: &Wide, operation: u32, rays: &[Input]) -> Vec<Visits> {
    const ALL: Features = SHAPES | COUNTED | WIDE;
    let mut records = probe.records();
    records.wide = wide.tree();
    let (params, set) = (probe.params(), InstructionSet::best());
    let reach = RayQuery { any_hit: operation == SHADOW, ..RayQuery::CLOSEST };
    let visits = |input: &Input| -> (Hit, Visits) {
        let (origin, direction) = (vector(input.a), vector(input.b));
        let ray = Ray::in_world(origin, direction, OriginPrimitive::NONE);
        // SAFETY: the BVHs were validated, and the processor has these instructions.
        #[allow(unsafe_code, reason = "kernels read without bounds checks")]
        unsafe {
            match set {
                InstructionSet::Avx512 => {
                    closest_hit_counted(FeatureSet::<{ ALL | AVX512 }>::ALL, &params, records, ray, reach)
                }
                InstructionSet::Avx2 => {
                    closest_hit_counted(FeatureSet::<{ ALL | AVX2 }>::ALL, &params, records, ray, reach)
                }
                InstructionSet::Baseline => {
                    closest_hit_counted(FeatureSet::<ALL>::ALL, &params, records, ray, reach)
                }
            }
        }
    };
    rays.par_iter().map(|input| visits(input).1).collect()
}

/// Returns the BVH that obvhs builds from the primitives' boxes, with one primitive per leaf.
fn obvhs_tree(probe: &ProbeScene) -> Bvh2 {
    let preset = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::medium_build() };
    build_bvh2(&boxes(probe), preset, &mut Duration::default())
}

/// Returns the mean number of primitives that obvhs tests for the closest hits of these rays.
fn obvhs_tests(probe: &ProbeScene, bvh: &Bvh2, rays: &[Input]) -> f64 {
    let (records, params) = (probe.records(), probe.params());
    let tests = |input: &Input| {
        let (origin, direction) = (vector(input.a), vector(input.b));
        let ray = Ray::in_world(origin, direction, OriginPrimitive::NONE);
        let shear = Shear::new(direction);
        let number = |v: Vec3| Vec3A::from(v).to_array().into();
        let mut tests = 0u32;
        let mut test = |_: &ObvhsRay, index: usize| {
            tests += 1;
            let primitive = bvh.primitive_indices[index];
            // SAFETY: a primitive of the scene.
            #[allow(unsafe_code, reason = "kernels read without bounds checks")]
            unsafe {
                distance(FeatureSet::<{ SHAPES }>::ALL, &params, records, ray, &shear, primitive)
            }
        };
        let theirs = ObvhsRay::new(number(origin), number(direction), 0.0, f32::MAX);
        bvh.ray_traverse(theirs, &mut RayHit::none(), &mut test);
        f64::from(tests)
    };
    rays.par_iter().map(tests).sum::<f64>() / rays.len() as f64
}

/// Returns the box of each primitive, by its number.
fn boxes(probe: &ProbeScene) -> Vec<Aabb> {
    let mut boxes = vec![Aabb::default(); probe.params().primitive_count as usize];
    for node in &probe.bvh.nodes {
        for (child, (low, high)) in [node.first, node.second].into_iter().zip(node.boxes()) {
            if Child(child).is_leaf() {
                boxes[Child(child).index() as usize] =
                    Aabb::new(low.to_array().into(), high.to_array().into());
            }
        }
    }
    boxes
}

fn probe_visits(prober: &mut Prober, operation: u32, rays: &[Input]) -> Vec<Visits> {
    let answers = prober.ask("probe_visits", operation, rays);
    answers.iter().map(|answer| Visits { nodes: answer.a.x, leaves: answer.a.y }).collect()
}

/// Prints one line of the table.
fn tell(
    subject: BackendUnderTest,
    traversal: &str,
    scene: &str,
    family: &str,
    [exact, tilted]: [Cost; 2],
    obvhs: Option<f64>,
) {
    let pair = |(mean, max): (f64, u32)| format!("{mean:.1} {max}");
    let obvhs = obvhs.map_or_else(String::new, |tests| format!(" | obvhs tests {tests:.1}"));
    eprintln!(
        "COST {} {traversal} | {scene} | {family} | nodes {} tilted {} | leaves {} tilted {}{obvhs}",
        subject.label(),
        pair(exact.nodes),
        pair(tilted.nodes),
        pair(exact.leaves),
        pair(tilted.leaves),
    );
}

/// Returns the scene with boxes that are endless along x and z. That is how a slab test sees them
/// that counts a ray along y as inside of every slab of x and z.
fn without_two_axes(probe: &ProbeScene) -> ProbeScene {
    let mut broken = probe.clone();
    for node in &mut broken.bvh.nodes {
        for row in [&mut node.x, &mut node.z] {
            (row.z, row.w) = (1e9, 1e9);
        }
    }
    broken
}

fn t44_costs(subject: BackendUnderTest) {
    // All backends share the scenes and their BVHs.
    static SCENES: OnceLock<Vec<(CostScene, ProbeScene)>> = OnceLock::new();
    let with_tree = |scene: CostScene| {
        let probe = ProbeScene::new(&scene.scene);
        (scene, probe)
    };
    let scenes = SCENES.get_or_init(|| cost_scenes::all().into_iter().map(with_tree).collect());
    let mut worst = (0.0f64, String::new());
    let mut compared = 0;
    for (scene, probe) in scenes {
        let Some(mut prober) = Prober::with_scene(subject, probe) else { return };
        let on_cpu = subject == BackendUnderTest::Cpu;
        let obvhs = (on_cpu && !scene.is_coincident).then(|| obvhs_tree(probe));
        let wide = on_cpu.then(|| Wide::new(&scene.scene, &probe.bvh).expect("a validated BVH")).flatten();
        let count = if scene.is_costly { 48 } else { 768 } / if subject.is_software() { 4 } else { 1 };
        for Family { name, operation, rays } in families(scene, probe, count) {
            let leaning = tilted(&rays);
            let mut traversals = vec![(
                "stack",
                [&rays, &leaning].map(|rays| Cost::of(&probe_visits(&mut prober, operation, rays))),
            )];
            if let Some(wide) = &wide {
                let visits = |rays| Cost::of(&wide_visits(probe, wide, operation, rays));
                traversals.push(("wide", [&rays, &leaning].map(|rays| visits(rays))));
            }
            for (traversal, costs) in traversals {
                let [exact, leaning] = costs;
                // A search for any hit depends on the order of both traversals, so only closest
                // hits are compared with obvhs.
                let theirs = obvhs.as_ref().filter(|_| traversal == "stack" && operation == CLOSEST);
                let theirs = theirs.map(|tree| obvhs_tests(probe, tree, &rays));
                tell(subject, traversal, scene.name, name, costs, theirs);
                let what = format!("{}, {name}, {traversal}", scene.name);
                assert!(exact.is_bounded_by(&leaning), "{what}: {exact:?}, tilted {leaning:?}");
                // Both BVHs have one primitive per leaf, so they test about as many, except for
                // what the padding of boxes adds.
                assert!(
                    theirs.is_none_or(|theirs| exact.leaves.0 <= 1.5 * theirs + 4.0),
                    "{what}: {exact:?}, obvhs {theirs:?}"
                );
                let ratio = exact.nodes.0 / leaning.nodes.0.max(1.0);
                if ratio > worst.0 {
                    worst = (ratio, what);
                }
                compared += 1;
            }
        }
        if scene.name == "mesh" {
            let suns = families(scene, probe, 96).remove(2).rays;
            let leaning = Cost::of(&probe_visits(&mut prober, SHADOW, &tilted(&suns)));
            let mut prober = Prober::with_scene(subject, &without_two_axes(probe)).expect("opened before");
            let control = Cost::of(&probe_visits(&mut prober, SHADOW, &suns));
            assert!(!control.is_bounded_by(&leaning), "control not detected: {control:?} {leaning:?}");
        }
    }
    let figure = format!(
        "{compared} pairs of exact and tilted rays: at most {:.2} times the mean visits ({})",
        worst.0, worst.1
    );
    report(44, subject, Outcome::Passed, figure);
}

for_each_route!(t44_costs);

/// An empty scene has no visits and no hit primitive.
#[test]
fn no_visits_without_a_scene() {
    let probe = ProbeScene::new(&crate::construct::scene(Vec::new(), &[]));
    let mut prober = Prober::with_scene(BackendUnderTest::Cpu, &probe).expect("the CPU");
    let answer = prober.ask("probe_visits", CLOSEST, &[ray(Vec3::ZERO, Vec3::X)])[0];
    assert_eq!((answer.a.x, answer.a.y, answer.a.z), (0, 0, NO_PRIMITIVE));
}
