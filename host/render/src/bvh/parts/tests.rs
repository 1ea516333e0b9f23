//! Tests of trees that are built in parts.

use super::*;
use crate::bvh::BvhQuality;
use glam::Vec3A;
use trisect_shared::bvh::STACK_SIZE;
use trisect_shared::math::unit_f32;
use trisect_shared::rng::PathKey;

/// Sizes by which small inputs are built in parts, too.
const SMALL: PartSizes = PartSizes { whole: 64, part: 100, subtrees: 8 };

fn random(number: u32) -> Vec3A {
    let w = PathKey { seed: 3, pixel: number, sample: 0 }.words(0);
    Vec3A::new(unit_f32(w.x), unit_f32(w.y), unit_f32(w.z))
}

fn around(center: Vec3A, half: f32) -> Bounds {
    Bounds { min: center - half, max: center + half }
}

/// Builds a tree of `count` boxes, validates it, and checks that each box contains what is below
/// it, within rounding.
fn tree(count: u32, boxes: BoxOf, sizes: &PartSizes) -> Bvh {
    let bvh = Bvh::over_parts(count as usize, boxes, Some(BvhQuality::Medium), sizes).unwrap();
    assert_eq!(bvh.nodes.len(), count as usize - 1);
    check_boxes(&bvh, boxes);
    bvh
}

fn check_boxes(bvh: &Bvh, boxes: BoxOf) {
    for node in &bvh.nodes {
        for (child, (low, high)) in [node.first, node.second].into_iter().zip(node.boxes()) {
            let (inner_low, inner_high) = if Child(child).is_leaf() {
                boxes(Child(child).index()).corners()
            } else {
                let [a, b] = bvh.nodes[child as usize].boxes();
                (a.0.min(b.0), a.1.max(b.1))
            };
            let room = 16.0 * f32::EPSILON * inner_low.abs().max(inner_high.abs()).max_element();
            assert!(low.cmple(inner_low).all() && inner_low.cmple(low + room).all(), "{low} {inner_low}");
            assert!(
                high.cmpge(inner_high).all() && inner_high.cmpge(high - room).all(),
                "{high} {inner_high}"
            );
        }
    }
}

#[test]
fn scattered_boxes_are_each_in_one_leaf() {
    for count in [65, 100, 101, 128, 999, 5000] {
        tree(count, &|i| around(random(i), 0.01), &SMALL);
    }
    for (part, subtrees) in [(1, 1), (1, 8), (2, 1), (7, 100), (100, 1), (5000, 8)] {
        tree(1000, &|i| around(random(i), 0.01), &PartSizes { whole: 1, part, subtrees });
    }
}

#[test]
fn a_parts_subtrees_lie_together() {
    let boxes = |i: u32| around(random(i), 0.01);
    let mut range: Vec<u32> = (0..5000).collect();
    let top: usize = divide(&mut range, &boxes, SMALL.part).iter().map(|part| part.len().min(8)).sum();
    let bvh = tree(5000, &boxes, &SMALL);
    // Behind the nodes above them, an inner child follows its parent, or its sibling's subtree.
    let mut sizes = vec![1; bvh.nodes.len()];
    for index in (top - 1..bvh.nodes.len()).rev() {
        let mut next = index + 1;
        for child in [bvh.nodes[index].first, bvh.nodes[index].second].map(Child) {
            if !child.is_leaf() {
                assert_eq!(child.index() as usize, next);
                next += sizes[next];
            }
        }
        sizes[index] = next - index;
    }
}

#[test]
fn boxes_at_one_place_are_divided_all_the_same() {
    // The centres of nested boxes are equal; those of the others are equal on two axes.
    let nested = tree(3000, &|i| around(Vec3A::ONE, 1.0 + i as f32), &SMALL);
    let equal = tree(3000, &|_| around(Vec3A::ONE, 0.5), &SMALL);
    let points = tree(3000, &|_| around(Vec3A::ONE, 0.0), &SMALL);
    let row = tree(3000, &|i| around(Vec3A::X * i as f32, 0.5), &SMALL);
    for bvh in [nested, equal, points, row] {
        assert!(bvh.depth <= STACK_SIZE, "{}", bvh.depth);
    }
}

#[test]
fn a_few_far_boxes_do_not_hide_the_others() {
    let far = |i: u32| around(if i.is_multiple_of(1000) { random(i) * 1e9 } else { random(i) }, 0.01);
    let mut range: Vec<u32> = (0..5000).collect();
    let parts = divide(&mut range, &far, 100);
    let mut all: Vec<u32> = parts.concat();
    all.sort_unstable();
    assert!(parts.iter().all(|part| (1..=100).contains(&part.len())));
    assert_eq!(all, (0..5000).collect::<Vec<u32>>());
    // Most parts are small beside the cube of the near boxes.
    let size = |part: &&[u32]| Bounds::union(part.iter().map(|&i| far(i))).half_area();
    let small = parts.iter().filter(|part| size(part) < 1.0).count();
    assert!(small * 10 > parts.len() * 8, "{small} of {}", parts.len());
    tree(5000, &far, &SMALL);
}

#[test]
fn a_huge_box_is_near_the_root() {
    let huge = 4321;
    let bvh = tree(5000, &|i| around(random(i), if i == huge { 100.0 } else { 0.01 }), &SMALL);
    let (mut pending, mut level) = (vec![(bvh.root, 0)], 0);
    while let Some((child, depth)) = pending.pop() {
        if child == Child::leaf(huge) {
            level = depth;
        } else if !child.is_leaf() {
            let node = &bvh.nodes[child.index() as usize];
            pending.extend([(Child(node.first), depth + 1), (Child(node.second), depth + 1)]);
        }
    }
    assert!((1..=2).contains(&level), "{level}");
}

/// Areas that are infinite: obvhs makes a chain, and a balanced tree replaces it.
#[test]
fn numbers_beyond_the_range_of_areas() {
    let wide = |i: u32| around((random(i) - 0.5) * 2e38, 1e30);
    let bvh = Bvh::over_parts(1000, &wide, None, &SMALL).unwrap();
    assert_eq!(bvh.depth, 10);
}

#[test]
fn the_tree_is_that_of_any_number_of_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| tree(5000, &|i| around(random(i), 0.01), &SMALL))
    };
    let one = on(1);
    for threads in [2, 5] {
        assert_eq!(on(threads).nodes, one.nodes);
    }
}

#[test]
fn a_tree_in_parts_costs_little_more_than_one_in_one_piece() {
    // A wavy surface of 64 parts.
    let boxes = |i: u32| {
        let (x, z) = ((i % 128) as f32, (i / 128) as f32);
        around(Vec3A::new(x, 3.0 * (0.2 * x).sin() * (0.3 * z).cos(), z), 0.6)
    };
    let sizes = PartSizes { whole: 64, part: 512, subtrees: 64 };
    let costs = [PartSizes::DEFAULT, sizes].map(|sizes| tree(1 << 14, &boxes, &sizes).surface_cost());
    assert!(costs[1] < 1.05 * costs[0], "{costs:?}");
    // Negative control: the same cost counts a tree that ignores where boxes are.
    let mixed = |i: u32| boxes(i.wrapping_mul(40_503) % (1 << 14));
    let mut bvh = tree(1 << 14, &boxes, &sizes);
    bvh.refit(&mixed);
    assert!(bvh.surface_cost() > 10.0 * costs[0]);
}

#[test]
fn negative_control_a_stale_box_is_noticed() {
    let boxes = |i: u32| around(random(i), 0.01);
    let bvh = tree(1000, &boxes, &SMALL);
    let moved = |i: u32| around(random(i) + if i == 500 { 1.0 } else { 0.0 }, 0.01);
    assert!(std::panic::catch_unwind(|| check_boxes(&bvh, &moved)).is_err());
}

impl Bvh {
    /// Returns the area of all inner nodes, relative to the root's.
    fn surface_cost(&self) -> f32 {
        let areas = self.nodes.iter().map(|node| {
            let [(low, high), (low2, high2)] = node.boxes();
            Bounds { min: low.min(low2).into(), max: high.max(high2).into() }.half_area()
        });
        let areas: Vec<f32> = areas.collect();
        areas.iter().sum::<f32>() / areas[0]
    }
}
