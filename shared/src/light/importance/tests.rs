//! Importances by four lanes and by one, and the bounds that they are.

use super::*;
use crate::bvh::NO_PRIMITIVE;
use crate::rng::PathKey;
use glam::Vec3;

fn numbers(index: u32, block: u32) -> [f32; 4] {
    let words = PathKey { seed: 5, pixel: index, sample: 0 }.words(block);
    [words.x, words.y, words.z, words.w].map(|word| word as f32 / 4_294_967_296.0)
}

fn unit(from: [f32; 4]) -> Vec3 {
    Vec3::new(from[0] - 0.5, from[1] - 0.5, from[2] - 0.4).normalize()
}

/// Returns a node of one of the kinds: a sphere, a surface that emits to one side, a spot, or a
/// sun.
fn node(index: u32) -> LightNode {
    let ([a, b, c, d], e) = (numbers(index, 0), numbers(index, 1));
    let (kind, angle) = (index % 5, 1.5 * e[3]);
    LightNode {
        center: Vec3::new(a, b, c) * 4.0 - 2.0,
        radius: if kind == 4 { -1.0 } else { 0.5 * d * d },
        strength: if kind == 3 { -1.0 - d } else { 1.0 + d },
        sine: if kind < 2 { -1.0 } else { angle.sin() },
        axis: unit(e),
        cosine: if kind < 2 { -1.0 } else { angle.cos() },
        ..LightNode::default()
    }
}

fn from(index: u32) -> ReferencePoint {
    let ([a, b, c, d], e) = (numbers(index, 2), numbers(index, 3));
    let normal = if d < 0.3 { Vec3::ZERO } else { unit(e) };
    ReferencePoint { point: Vec3::new(a, b, c) * 4.0 - 2.0, primitive: NO_PRIMITIVE, normal }
}

fn one(node: &LightNode, from: &ReferencePoint) -> f32 {
    let LightNode { center, radius, strength, sine, axis, cosine, .. } = *node;
    let cone = || Cone(axis.x, axis.y, axis.z, cosine);
    importance_of_one(Sphere(center.x, center.y, center.z, radius), (strength, sine), cone, from)
}

fn four(nodes: [LightNode; 4], from: &ReferencePoint) -> [f32; 4] {
    let each = |f: fn(&LightNode) -> f32| Vec4::from_array(nodes.each_ref().map(f));
    let sphere = Sphere(each(|n| n.center.x), each(|n| n.center.y), each(|n| n.center.z), each(|n| n.radius));
    let cone = || Cone(each(|n| n.axis.x), each(|n| n.axis.y), each(|n| n.axis.z), each(|n| n.cosine));
    importances_of_four(sphere, (each(|n| n.strength), each(|n| n.sine)), cone, from).to_array()
}

/// GPUs look at one node at a time. Negative control: a cosine that is one step off changes bits.
#[test]
fn four_lanes_have_the_bits_of_one() {
    let mut changed = 0;
    for index in 0..4000 {
        // Of one kind, and of several.
        let nodes = [0, 1, 2, 3].map(|lane| node(5 * index + if index % 2 == 0 { lane } else { 0 }));
        let from = from(index);
        let all = four(nodes, &from);
        for (node, lane) in nodes.iter().zip(all) {
            assert_eq!(one(node, &from).to_bits(), lane.to_bits(), "{node:?} {from:?}");
            let off = LightNode { cosine: node.cosine.next_up(), ..*node };
            changed += u32::from(one(&off, &from).to_bits() != lane.to_bits());
        }
    }
    assert!(changed > 100, "{changed}");
}

/// No point of a node's sphere, with a normal in its cone, sends more light than the importance
/// says, but for rounding. Negative control: half the importance.
#[test]
fn importances_are_upper_bounds() {
    let (mut halved, mut lit) = (0, 0);
    for index in (0..40_000).filter(|index| index % 5 < 3) {
        let (node, from) = (node(index), from(index));
        let inside = |from: Vec3| from.length() < node.radius;
        if inside(node.center - from.point) || from.normal == Vec3::ZERO {
            continue;
        }
        let [a, b, c, d] = numbers(index, 4);
        let offset = unit([a, b, c, 0.0]) * node.radius * d;
        let to = node.center + offset - from.point;
        let direction = to.normalize();
        let cos_at_light = if index % 5 == 2 { -node.axis.dot(direction) } else { 1.0 };
        let cosines = cos_at_light.max(0.0) * from.normal.dot(direction).max(0.0);
        // The square of the distance to the centre stands for that of each point.
        let light = node.strength * cosines / (node.center - from.point).length_squared();
        let bound = one(&node, &from);
        assert!(light <= bound * 1.00001, "{light} {bound} {node:?} {from:?}");
        lit += u32::from(light > 0.0);
        halved += u32::from(light > 0.5 * bound);
    }
    assert!(lit > 2000 && halved > 500, "{lit} {halved}");
}
