//! Tests of the validation of wide BVHs.

use super::*;
use trisect_shared::bvh::STACK_SIZE;

/// Returns the BVH of 20 spheres, one quad and 60 triangles, with these counts.
fn tree() -> (Wide, [usize; 4]) {
    let scene = Scene::hello_world().unwrap();
    let mut mixed = scene.clone();
    mixed.spheres = (0..20u8)
        .map(|i| {
            let center = Vec3::new(f32::from(i), f32::from(i * i % 7), 0.0);
            trisect_shared::sphere::Sphere { center, radius: 0.3, ..scene.spheres[0] }
        })
        .collect();
    let zero: trisect_shared::planar::Planar = bytemuck::Zeroable::zeroed();
    mixed.flats = vec![trisect_shared::planar::Planar { edge_u: Vec3::X, edge_v: Vec3::Y, ..zero }];
    mixed.triangles = (0..60u8)
        .map(|i| {
            let a = Vec3::new(f32::from(i % 8), f32::from(i / 8), 5.0);
            Triangle::of([a, a + Vec3::X, a + Vec3::Y])
        })
        .collect();
    mixed.vertices = vec![bytemuck::Zeroable::zeroed()].into();
    let bvh = Bvh::build(&mixed, None).unwrap();
    (Wide::new(&mixed, &bvh).unwrap().unwrap(), [20, 1, 60, 0])
}

/// Returns node and lane of the first child for which `what` is true.
fn find(wide: &Wide, what: impl Fn(WideChild) -> bool) -> (usize, usize) {
    let slots = wide.nodes.iter().enumerate().flat_map(|(node, n)| {
        n.children.0.iter().enumerate().map(move |(lane, child)| ((node, lane), WideChild(*child)))
    });
    slots.into_iter().find(|(_, child)| what(*child)).map(|(slot, _)| slot).unwrap()
}

#[test]
fn a_good_tree_is_proven() {
    let (wide, counts) = tree();
    assert!(wide.nodes.len() > 1 && wide.nodes.len() < 12, "{} nodes", wide.nodes.len());
    assert_eq!(wide.validate(counts), Ok(()));
}

#[test]
fn negative_control_each_broken_tree_is_refused() {
    let leaf = |wide: &Wide, kind| find(wide, |c| c != WideChild::EMPTY && c.is_leaf() && c.holds(kind));
    let set = |wide: &mut Wide, slot: (usize, usize), child: WideChild| {
        wide.nodes[slot.0].children.0[slot.1] = child.0;
    };
    let broken: [&dyn Fn(&mut Wide); 11] = [
        &|t| set(t, leaf(t, LeafKind::Triangles), WideChild::leaf(LeafKind::Triangles, 1, 9999)), // no such packet
        &|t| set(t, leaf(t, LeafKind::Triangles), WideChild::leaf(LeafKind::Spheres, 1, 0)),      // bad kind
        &|t| set(t, leaf(t, LeafKind::Planar), WideChild::leaf(LeafKind::Planar, 1, 3)),          // a sphere
        &|t| set(t, leaf(t, LeafKind::Planar), WideChild::leaf(LeafKind::Planar, 2, 20)),         // two
        &|t| set(t, leaf(t, LeafKind::Planar), WideChild::EMPTY), // lost, with its box
        &|t| set(t, find(t, |c| !c.is_leaf()), WideChild::inner(0)), // a loop
        &|t| set(t, find(t, |c| !c.is_leaf()), WideChild::inner(99)), // no such node
        &|t| t.triangles[0].primitives.0[0] = 5,                  // a sphere
        &|t| t.triangles[0].primitives.0[0] = t.triangles[1].primitives.0[0], // twice
        &|t| t.nodes[0].order.0[3] = 0,                           // only lane 0
        &|t| t.root = WideChild::inner(1),                        // loses primitives
    ];
    for (i, damage) in broken.into_iter().enumerate() {
        let (mut wide, counts) = tree();
        damage(&mut wide);
        assert!(wide.validate(counts).is_err(), "fault {i}");
    }
    // A packet with one child fewer loses a primitive.
    let (mut wide, counts) = tree();
    let slot = find(&wide, |c| {
        c != WideChild::EMPTY && c.is_leaf() && c.holds(LeafKind::Triangles) && c.count() > 1
    });
    let child = WideChild(wide.nodes[slot.0].children.0[slot.1]);
    set(&mut wide, slot, WideChild::leaf(LeafKind::Triangles, child.count() - 1, child.index()));
    assert!(wide.validate(counts).is_err(), "a lost triangle");
    // More levels than the traversal stack holds.
    let (mut wide, _) = tree();
    let nodes = STACK_SIZE as u32 + 1;
    let mut node = wide.nodes[0];
    node.children.0 = [WideChild::EMPTY.0; LANES];
    (0..3).for_each(|axis| node.planes[axis].0 = [f32::INFINITY; LANES]);
    wide.nodes = (1..=nodes)
        .map(|next| {
            let mut node = node;
            if next < nodes {
                node.children.0[0] = WideChild::inner(next).0;
            }
            node
        })
        .collect();
    (wide.spheres, wide.triangles) = (Vec::new(), Vec::new().into());
    assert!(wide.validate([0; 4]).is_err_and(|message| message.contains("levels")));
    wide.nodes.remove(0);
    wide.nodes.iter_mut().take(STACK_SIZE - 1).for_each(|node| node.children.0[0] -= 1);
    assert_eq!(wide.validate([0; 4]), Ok(()));
}
