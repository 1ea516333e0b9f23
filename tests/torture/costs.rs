//! Visits of rays at the extremes (44): nodes and leaves, counted, never timed.
//!
//! A ray along an axis or in an axis plane may cost what the same ray costs when it is tilted by a
//! thousandth, and no more primitives than obvhs tests by its own traversal of its own tree. `COST`
//! lines on standard error make the table of
//! `docs/accuracy.md`.

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
use trisect::backend::cpu::InstructionSet;
use trisect::bvh::Wide;
use trisect_probes::record::{Input, vector};
use trisect_probes::visits::{CLOSEST, SHADOW};
use trisect_shared::bvh::{Child, Hit, NO_PRIMITIVE, RayQuery, Visits};
use trisect_shared::features::{AVX2, AVX512, COUNTED, Features, PLANAR, TRIANGLES, WIDE};
use trisect_shared::math::{unit_circle, unit_f32};
use trisect_shared::ray::{OriginPrimitive, Ray};
use trisect_shared::traversal::{closest_hit_counted, distance};
use trisect_shared::triangle::Shear;
use trisect_tests::probe::{ProbeScene, Prober};
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_backend};

/// Rays of one kind, and what the probe is asked.
struct Family {
    name: &'static str,
    operation: u32,
    rays: Vec<Input>,
}

/// Mean and maximum over rays.
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

    /// Whether this is at most what the tilted rays cost: `MEAN` times their mean, `MAXIMUM` times
    /// their maximum. An exact ray runs in the planes that boxes share, so it may enter both boxes
    /// at a plane, and all four at an edge, of which a tilted ray enters one; and it stays in them
    /// where a tilted one leaves.
    fn is_bounded_by(&self, tilted: &Self) -> bool {
        const MEAN: f64 = 2.0;
        const MAXIMUM: f64 = 4.0;
        let holds = |a: (f64, u32), b: (f64, u32)| {
            a.0 <= MEAN * b.0 + 8.0 && f64::from(a.1) <= MAXIMUM * f64::from(b.1) + 64.0
        };
        holds(self.nodes, tilted.nodes) && holds(self.leaves, tilted.leaves)
    }
}

/// Rays along axes, in axis planes, and of suns along axes, `count` of each: from outside or from
/// the eye, from the middles of leaves' boxes and from their faces.
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

/// The same rays, tilted by a thousandth along each axis, to either side.
fn tilted(rays: &[Input]) -> Vec<Input> {
    let tilt = |(i, input): (u32, &Input)| {
        let w = words(4417, i);
        let by = |bits: u32| if bits & 1 == 0 { 1e-3 } else { -1e-3 };
        ray(vector(input.a), unit(vector(input.b) + Vec3::new(by(w.x), by(w.y), by(w.z))))
    };
    (0u32..).zip(rays).map(tilt).collect()
}

/// Visits of the wide tree by the best instructions that this processor has.
fn wide_visits(probe: &ProbeScene, wide: &Wide, operation: u32, rays: &[Input]) -> Vec<Visits> {
    const ALL: Features = PLANAR | TRIANGLES | COUNTED | WIDE;
    let mut records = probe.records();
    records.wide = wide.tree();
    let (params, set) = (probe.params(), InstructionSet::best());
    let reach = RayQuery { any_hit: operation == SHADOW, ..RayQuery::CLOSEST };
    let visits = |input: &Input| -> (Hit, Visits) {
        let (origin, direction) = (vector(input.a), vector(input.b));
        let ray = Ray { origin, direction, origin_primitive: OriginPrimitive::NONE };
        // SAFETY: the trees were proven; the processor was asked.
        #[allow(unsafe_code, reason = "kernels read without bounds checks")]
        unsafe {
            match set {
                InstructionSet::Avx512 => {
                    closest_hit_counted::<{ ALL | AVX512 }>(&params, records, ray, reach)
                }
                InstructionSet::Avx2 => closest_hit_counted::<{ ALL | AVX2 }>(&params, records, ray, reach),
                InstructionSet::Baseline => closest_hit_counted::<ALL>(&params, records, ray, reach),
            }
        }
    };
    rays.par_iter().map(|input| visits(input).1).collect()
}

/// The tree that obvhs builds by itself, with one primitive a leaf.
fn obvhs_tree(probe: &ProbeScene) -> Bvh2 {
    let preset = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::medium_build() };
    build_bvh2(&boxes(probe), preset, &mut Duration::default())
}

/// Mean number of primitives that obvhs tests for the closest hits of these rays.
fn obvhs_tests(probe: &ProbeScene, bvh: &Bvh2, rays: &[Input]) -> f64 {
    let (records, params) = (probe.records(), probe.params());
    let tests = |input: &Input| {
        let (origin, direction) = (vector(input.a), vector(input.b));
        let ray = Ray { origin, direction, origin_primitive: OriginPrimitive::NONE };
        let shear = Shear::new(direction);
        let number = |v: Vec3| Vec3A::from(v).to_array().into();
        let mut tests = 0u32;
        let mut test = |_: &ObvhsRay, index: usize| {
            tests += 1;
            let primitive = bvh.primitive_indices[index];
            // SAFETY: a primitive of the scene.
            #[allow(unsafe_code, reason = "kernels read without bounds checks")]
            unsafe {
                distance::<{ PLANAR | TRIANGLES }>(&params, records, ray, &shear, primitive)
            }
        };
        let theirs = ObvhsRay::new(number(origin), number(direction), 0.0, f32::MAX);
        bvh.ray_traverse(theirs, &mut RayHit::none(), &mut test);
        f64::from(tests)
    };
    rays.par_iter().map(tests).sum::<f64>() / rays.len() as f64
}

/// The boxes of the primitives by their numbers.
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

/// One line of the table.
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

/// Boxes that are endless along x and z: what a slab test sees that takes a ray along y for inside
/// all of these slabs.
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
    // The scenes with their trees are made once for all backends.
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
        let wide = on_cpu.then(|| Wide::new(&scene.scene, &probe.bvh).expect("a proven tree")).flatten();
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
                // Where the search ends at any hit, the order of both traversals decides, not the
                // tree.
                let theirs = obvhs.as_ref().filter(|_| traversal == "stack" && operation == CLOSEST);
                let theirs = theirs.map(|tree| obvhs_tests(probe, tree, &rays));
                tell(subject, traversal, scene.name, name, costs, theirs);
                let what = format!("{}, {name}, {traversal}", scene.name);
                assert!(exact.is_bounded_by(&leaning), "{what}: {exact:?}, tilted {leaning:?}");
                // A tree of one primitive a leaf tests as many of them as obvhs' own, but for what
                // padding lets in.
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
            let mut prober = Prober::with_scene(subject, &without_two_axes(probe)).expect("it was there");
            let control = Cost::of(&probe_visits(&mut prober, SHADOW, &suns));
            assert!(!control.is_bounded_by(&leaning), "a bound that cannot fail: {control:?} {leaning:?}");
        }
    }
    let figure = format!(
        "{compared} pairs of exact and tilted rays: at most {:.2} times the mean visits ({})",
        worst.0, worst.1
    );
    report(44, subject, Outcome::Passed, figure);
}

for_each_backend!(t44_costs);

/// A hit is no primitive where a ray misses; so a count of nothing is none.
#[test]
fn no_visits_without_a_scene() {
    let probe = ProbeScene::new(&crate::construct::scene(Vec::new(), &[]));
    let mut prober = Prober::with_scene(BackendUnderTest::Cpu, &probe).expect("the CPU");
    let answer = prober.ask("probe_visits", CLOSEST, &[ray(Vec3::ZERO, Vec3::X)])[0];
    assert_eq!((answer.a.x, answer.a.y, answer.a.z), (0, 0, NO_PRIMITIVE));
}
