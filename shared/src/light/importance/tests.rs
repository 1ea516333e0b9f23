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

/// GPUs look at one node at a time. Negative control: an axis that is one step off changes bits.
#[test]
fn four_lanes_have_the_bits_of_one() {
    let mut changed = 0;
    for index in 0..4000 {
        // Of several kinds, and of one.
        let step = if index % 4 < 2 { 1 } else { 5 };
        let nodes = [0, 1, 2, 3].map(|lane| node(index + step * lane));
        let from = from(index);
        let all = four(nodes, &from);
        for (node, lane) in nodes.iter().zip(all) {
            assert_eq!(one(node, &from).to_bits(), lane.to_bits(), "{node:?} {from:?}");
            let axis = Vec3 { x: node.axis.x.next_up(), ..node.axis };
            let off = LightNode { axis, ..*node };
            changed += u32::from(one(&off, &from).to_bits() != lane.to_bits());
        }
    }
    assert!(changed > 100, "{changed}");
}

/// Returns a unit vector at this angle to an axis, on the side of another vector.
fn turned(axis: Vec3, angle: f32, side: Vec3) -> Vec3 {
    axis * angle.cos() + (side - axis * side.dot(axis)).normalize() * angle.sin()
}

/// Any light in a node, where it is and turned as the node says, leaves the importance above 0, and
/// sends no more than it says where the middle of the node is in front of the surface, and it in
/// front of the light. Negative controls: nodes without extent, and half the importance.
#[test]
fn importances_reach_all_lights() {
    let (mut missed, mut halved, mut lit) = (0, 0, 0);
    for index in 0..100_000 {
        let (node, from) = (node(index), from(index));
        let ([a, b, c, d], kind) = (numbers(index, 4), index % 5);
        let (middle, normal) = (node.center - from.point, from.normal);
        if normal == Vec3::ZERO || middle.length() < node.radius {
            continue;
        }
        let (side, angle) =
            (unit([c, a, b, 0.0]), node.cosine.acos() * if d < 0.5 { 1.0 } else { 2.0 - 2.0 * d });
        // Anywhere, or at the border, where the surface or the light sees most of it.
        let towards = if d < 0.3 {
            normal
        } else if d < 0.6 {
            node.axis
        } else {
            side
        };
        let border = (towards - middle * towards.dot(middle) / middle.length_squared()).normalize();
        let offset = if d < 0.8 { border * 0.999 } else { side * a } * node.radius.max(0.0);
        let direction =
            if kind == 4 { turned(node.axis, angle, side) } else { (middle + offset).normalize() };
        let at_light = match kind {
            0 | 1 | 4 => 1.0,
            2 => -turned(node.axis, angle, -direction).dot(direction),
            _ => {
                if -node.axis.dot(direction) > node.cosine {
                    1.0
                } else {
                    0.0
                }
            }
        };
        let at_surface = normal.dot(direction);
        if at_light <= 1e-4 || at_surface <= 1e-4 {
            continue;
        }
        lit += 1;
        let square = if kind == 4 { 1.0 } else { middle.length_squared() };
        let light = node.strength.abs() * at_light * at_surface / square;
        let importance = one(&node, &from);
        assert!(importance > 0.0, "{light} {node:?} {from:?}");
        let point = LightNode { radius: node.radius.min(0.0), ..node };
        missed += u32::from(one(&point, &from) == 0.0);
        let in_front = kind != 2 || -node.axis.dot(middle) >= 0.0;
        let before = if kind == 4 { node.axis } else { middle };
        if in_front && normal.dot(before) >= 0.0 {
            assert!(light <= importance * 1.00001, "{light} {importance} {node:?} {from:?}");
            halved += u32::from(light > 0.5 * importance);
        }
    }
    assert!(lit > 10_000 && missed > 20 && halved > 1000, "{lit} {missed} {halved}");
}
