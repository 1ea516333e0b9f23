//! Construction of the [light tree](trisect_shared::light::tree).

use super::bounds::Bounds;
use bytemuck::Zeroable;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};
use trisect_shared::light::Light;
use trisect_shared::light::tree::{COUNT_SHIFT, LEAF, LightNode, MIXED, NOWHERE, WIDTH, first_child};

/// Light with its bounds, before its place in the tree is known.
#[derive(Clone, Copy)]
pub(super) struct Member {
    /// Index of the light.
    pub light: u32,
    /// True for a light that is infinitely far.
    pub distant: bool,
    pub bounds: Bounds,
}

/// Number of places along each axis at which a group may be divided.
const BUCKETS: usize = 12;

/// Depth from which on groups are halved: lights of which each is far from all later ones would
/// make a chain.
const MAX_DEPTH: usize = 64;

/// Greatest number of lights of a tree: nodes have at least two children, and a link has room for
/// twice as many nodes.
pub(super) const MAX_LIGHTS: u32 = 1 << (COUNT_SHIFT - 1);

/// Angle to their normals, in radians, below which lights count as sending light only into the cone
/// of these.
const NARROW: f64 = 0.1;

/// Node of the binary tree, which becomes part of the tree of wider nodes.
struct Node {
    bounds: Bounds,
    distant: bool,
    content: Content,
}

enum Content {
    Light(u32),
    /// Indices of both children.
    Children([usize; 2]),
}

/// Appends a tree over `members` to the lights, and writes to each light the link to its siblings
/// and its place among them. Nodes have strengths in units of the power of two below the greatest,
/// which it returns, so that scenes of all scales have the same numbers. There is a member, and at
/// most [`MAX_LIGHTS`].
pub(super) fn append(lights: &mut Vec<Light>, mut members: Vec<Member>) -> f64 {
    let greatest = members.iter().map(|member| member.bounds.strength).fold(0.0, f64::max);
    let unit = f64::from_bits(greatest.to_bits() & 0x7ff0_0000_0000_0000).max(f64::MIN_POSITIVE);
    members.iter_mut().for_each(|member| member.bounds.strength /= unit);
    let binary = binary(&mut members);
    let mut nodes: Vec<LightNode> = Vec::new();
    let mut root: Light = Zeroable::zeroed();
    // Node of the binary tree, with the link to its siblings and its place among them.
    let mut waiting = vec![(0, NOWHERE, 0)];
    while let Some((index, siblings, place)) = waiting.pop() {
        let children = match binary[index].content {
            // The only light.
            Content::Light(_) => vec![index],
            Content::Children(children) => widened(&binary, children),
        };
        let mixed = children.iter().any(|&child| binary[child].distant != binary[index].distant);
        let mut link = nodes.len() as u32 | (children.len() as u32 - 1) << COUNT_SHIFT;
        link |= if mixed { MIXED } else { 0 };
        if siblings == NOWHERE {
            root.kind = link;
        } else {
            nodes[(first_child(siblings) + place) as usize].link = link;
        }
        for (place, &child) in (0..).zip(&children) {
            let mut node = record(&binary[child]);
            if let Content::Light(light) = binary[child].content {
                node.link = LEAF | light;
                let light = &mut lights[light as usize];
                (light.threshold, light.alias) = (link, place);
            } else {
                waiting.push((child, link, place));
            }
            nodes.push(node);
        }
        let new = nodes.len() - children.len();
        nodes[new].back = siblings;
        if let Some(second) = nodes.get_mut(new + 1) {
            second.back = place;
        }
    }
    lights.push(root);
    // A CPU reads three nodes as four; four nodes are as long as three lights.
    nodes.resize((nodes.len() + 1).next_multiple_of(4), LightNode::default());
    lights.extend_from_slice(bytemuck::cast_slice(&nodes));
    unit
}

/// Replaces children of the greatest cost by their own children while there is room. Lights that
/// are infinitely far stay apart from others.
fn widened(nodes: &[Node], children: [usize; 2]) -> Vec<usize> {
    let mut children = children.to_vec();
    if nodes[children[0]].distant != nodes[children[1]].distant {
        return children;
    }
    while children.len() < WIDTH {
        let inner = children.iter().enumerate().filter_map(|(place, &child)| match nodes[child].content {
            Content::Children(below) => Some((place, nodes[child].bounds.cost(), below)),
            Content::Light(_) => None,
        });
        let Some((place, _, [first, second])) = inner.max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        children[place] = first;
        children.insert(place + 1, second);
    }
    children
}

/// Returns the nodes of a binary tree, the root first.
fn binary(members: &mut [Member]) -> Vec<Node> {
    // Lights that are infinitely far come first.
    let far = bring_forward(members, |member| member.distant);
    let mut nodes = vec![node_of(members)];
    let mut groups = vec![(0, 0..members.len(), 0)];
    while let Some((node, range, depth)) = groups.pop() {
        let (group, first) = (&mut members[range.clone()], range.start);
        if group.len() == 1 {
            continue;
        }
        let middle = if range.contains(&far) && far > first {
            far - first
        } else if depth < MAX_DEPTH {
            divide(group, &nodes[node].bounds)
        } else {
            group.len() / 2
        };
        let children = [nodes.len(), nodes.len() + 1];
        nodes[node].content = Content::Children(children);
        for (child, part) in children.into_iter().zip([first..first + middle, first + middle..range.end]) {
            nodes.push(node_of(&members[part.clone()]));
            groups.push((child, part, depth + 1));
        }
    }
    nodes
}

/// Returns the node of a group, which has the first light until the group is divided.
fn node_of(group: &[Member]) -> Node {
    let (first, others) = (&group[0], &group[1..]);
    let bounds = others.iter().fold(first.bounds, |bounds, member| bounds.and(&member.bounds));
    let distant = group.iter().all(|member| member.distant);
    Node { bounds, distant, content: Content::Light(first.light) }
}

/// Moves the members for which `is_first` holds to the front, in their order, and returns their
/// number.
fn bring_forward(members: &mut [Member], is_first: impl Fn(&Member) -> bool) -> usize {
    members.sort_by_key(|member| !is_first(member));
    members.iter().filter(|member| is_first(member)).count()
}

/// Divides a group of at least two where both parts cost least (the surface area orientation
/// heuristic, section 4.4 of the paper). Returns the number of members of the first part, which are
/// moved to the front.
fn divide(group: &mut [Member], bounds: &Bounds) -> usize {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for member in group.iter() {
        (low, high) = (low.min(member.bounds.middle()), high.max(member.bounds.middle()));
    }
    let (extent, longest) = (bounds.high - bounds.low, (bounds.high - bounds.low).max_element());
    let bucket = |member: &Member, axis: usize| {
        let part = (member.bounds.middle()[axis] - low[axis]) / (high[axis] - low[axis]);
        ((part * BUCKETS as f64) as usize).min(BUCKETS - 1)
    };
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| high[axis] > low[axis]) {
        let mut buckets: [Option<Bounds>; BUCKETS] = [None; BUCKETS];
        for member in group.iter() {
            let place = &mut buckets[bucket(member, axis)];
            *place = Some(place.map_or(member.bounds, |bounds| bounds.and(&member.bounds)));
        }
        let join = |a: Option<Bounds>, b: Option<Bounds>| match (a, b) {
            (Some(a), Some(b)) => Some(a.and(&b)),
            (a, b) => a.or(b),
        };
        let mut behind = [None; BUCKETS];
        for place in (1..BUCKETS).rev() {
            behind[place - 1] = join(buckets[place], behind[place]);
        }
        let mut before = None;
        for place in 0..BUCKETS - 1 {
            before = join(before, buckets[place]);
            if let (Some(a), Some(b)) = (before, behind[place]) {
                // Thin groups are not divided along their short axes.
                let cost = longest / extent[axis].max(f64::MIN_POSITIVE) * (a.cost() + b.cost());
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, place));
                }
            }
        }
    }
    let Some((_, axis, place)) = best else { return group.len() / 2 };
    let count = bring_forward(group, |member| bucket(member, axis) <= place);
    if count == 0 || count == group.len() { group.len() / 2 } else { count }
}

/// Returns the record of a node without its links.
fn record(of: &Node) -> LightNode {
    let Bounds { low, high, cone, end, strength } = of.bounds;
    let middle = of.bounds.middle();
    // A little wider for the rounding of the middle.
    let radius = 0.5 * (high - low).length() + 1e-7 * middle.length();
    // As wide as rounding of a cosine near 1 makes it.
    let angle = (cone.angle + 1e-3).min(PI);
    let is_narrow = !of.distant && end < NARROW;
    let sine = if of.distant && angle > FRAC_PI_2 {
        // A bound of the cosine is 1 at every angle, then.
        2.0
    } else if !of.distant && angle >= PI {
        -1.0
    } else {
        angle.sin().max(0.0)
    };
    LightNode {
        center: middle.as_vec3(),
        radius: if of.distant { -1.0 } else { radius as f32 },
        strength: if is_narrow { -strength } else { strength } as f32,
        sine: sine as f32,
        axis: cone.axis.as_vec3(),
        cosine: angle.cos() as f32,
        ..LightNode::default()
    }
}
