//! Distances scale with the scene, bit for bit (torture test 8): no constant has a unit of length.

use crate::statistics::{samples, words};
use bytemuck::Zeroable;
use glam::Vec3;
use trisect_shared::math::{normalize, unit_f32, unit_sphere};
use trisect_shared::planar::{DISC, Planar, QUAD};
use trisect_shared::ray::OriginPrimitive;
use trisect_shared::sphere::{MISS, Sphere};

/// Distance in a scene that is larger by the factor.
type Case<'a> = &'a dyn Fn(f32) -> f32;

/// Returns the powers of two at which the distance of `case` is not that of scale 1 times the
/// scale.
fn failing_powers(case: Case) -> impl Iterator<Item = i32> {
    let want = case(1.0);
    (-20..=20).step_by(5).filter(move |&k| {
        let scale = (k as f32).exp2();
        let scaled = if want < MISS { want * scale } else { MISS };
        case(scale).to_bits() != scaled.to_bits()
    })
}

fn check(name: &str, i: u32, case: Case) -> bool {
    let off: Vec<i32> = failing_powers(case).collect();
    assert!(off.is_empty(), "{name} {i}: not at 2^{off:?}");
    case(1.0) < MISS
}

#[test]
fn distances_scale() {
    let mut hits = [0; 4];
    for i in 0..samples(100_000) {
        let (w, v) = (words(40, i), words(41, i));
        // From near the surface and from far away.
        let origin = unit_sphere(w.x, w.y) * (1.0 + 10f32.powf(-6.0 + 8.0 * unit_f32(w.z)));
        let direction = normalize(unit_sphere(v.x, v.y) * (2.0 * unit_f32(v.w)) - origin);
        let sphere = |scale: f32| Sphere { center: Vec3::ZERO, radius: scale, material: 0, pad: [0; 3] };
        hits[0] += u32::from(check("sphere", i, &|scale| {
            sphere(scale).distance(origin * scale, direction, false, OriginPrimitive::NONE)
        }));
        // From the surface inward, to the far side.
        hits[1] += u32::from(check("departure", i, &|scale| {
            let (normal, point) = sphere(scale).project(origin * scale, direction);
            let inward = normalize(unit_sphere(v.x, v.z) - normal * 1.001);
            sphere(scale).distance(point, inward, true, OriginPrimitive::new(0, true))
        }));
        for kind in [QUAD, DISC] {
            let planar = |scale: f32| Planar {
                origin: Vec3::ZERO,
                normal: Vec3::Z,
                kind,
                dual_u: Vec3::X / scale,
                dual_v: Vec3::Y / scale,
                edge_u: Vec3::X * scale,
                edge_v: Vec3::Y * scale,
                ..Planar::zeroed()
            };
            // Also from very near the plane.
            let near = Vec3::new(origin.x, origin.y, origin.z * unit_f32(v.z) * 1e-3) * 0.5;
            for from in [origin, near] {
                let hit = check("flat", i, &|scale| planar(scale).distance(from * scale, direction));
                hits[2 + (kind == DISC) as usize] += u32::from(hit);
            }
        }
    }
    println!("{hits:?} hits");
    assert!(hits.iter().all(|&count| count > samples(100_000) / 20), "{hits:?}");
    // Negative control: a minimum distance, as offsets against self-intersection use it.
    let min_distance = |scale: f32| if 0.5 * scale > 1e-3 { 0.5 * scale } else { MISS };
    assert!(failing_powers(&min_distance).count() > 0);
}
