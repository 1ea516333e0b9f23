//! Ranges of results for any input: bent normals at silhouettes, weights of multiple importance
//! sampling, texture lookups.

use crate::materials::NO_SCENE;
use crate::statistics::{samples, words};
use bytemuck::Zeroable;
use glam::Vec3;
use trisect_shared::bvh::Hit;
use trisect_shared::features::{FeatureSet, SHAPES, TEXTURES};
use trisect_shared::light::mis_weight;
use trisect_shared::math::{normalize, unit_f32, unit_sphere};
use trisect_shared::params::RenderParams;
use trisect_shared::planar::{DISC, Planar, QUAD};
use trisect_shared::ray::{OriginPrimitive, Ray};
use trisect_shared::scene::Scene;
use trisect_shared::sphere::Sphere;
use trisect_shared::surface::{self, MIN_REFLECTED_COSINE, bend_shading_normal};
use trisect_shared::texture::{CLAMP, MIRROR, NEAREST, REPEAT, Texel, Texture, sample};

/// The two weights of a pair sum to 1 for any pdfs that are 0 or normal. 0 against 0 does not
/// occur: each sample has a pdf above 0.
#[test]
fn weights_of_a_pair_sum_to_one() {
    let extremes = [0.0f32, f32::MIN_POSITIVE, 1e-30, 1e-7, 0.5, 1.0, 1e7, 1e30, f32::MAX];
    for a in extremes {
        for b in extremes {
            if a + b > 0.0 {
                let (x, y) = (mis_weight(a, b), mis_weight(b, a));
                assert!((x + y - 1.0).abs() < 2e-7 && (0.0..=1.0).contains(&x), "{a} {b}: {x} {y}");
                let ratio = f64::from(a) / f64::from(b);
                let want = if b == 0.0 { 1.0 } else { ratio * ratio / (1.0 + ratio * ratio) };
                let want = if want.is_nan() { 1.0 } else { want };
                assert!((f64::from(x) - want).abs() < 1e-6, "{a} {b}: {x} for {want}");
            }
        }
    }
}

/// The view direction mirrored about the bent normal leaves the surface by at least half the
/// minimum cosine, for all viewers and shading normals; a normal that needs no bending keeps its
/// bits. Negative control: about the unbent normal, many directions enter the surface.
#[test]
fn mirrored_directions_leave_the_surface() {
    let (mut bent, mut lost) = (0, 0);
    for i in 0..samples(200_000) {
        let (w, v) = (words(2, i), words(3, i));
        let normal = unit_sphere(w.x, w.y);
        let above = |direction: Vec3, cos: f32| {
            let side = direction - normal * direction.dot(normal);
            normalize(normal * cos + normalize(side) * libm::sqrtf(1.0 - cos * cos))
        };
        // Cosines down to grazing; shading normals tilted at random, away from the viewer and
        // towards it.
        let (low, lower) = (libm::powf(10.0, -6.0 * unit_f32(v.x)), libm::powf(10.0, -6.0 * unit_f32(v.y)));
        let viewer = above(unit_sphere(w.z, w.w), low);
        let shading = match i % 4 {
            0 => normal,
            1 => above(-viewer, lower),
            2 => above(viewer, lower),
            _ => above(unit_sphere(v.z, v.w), lower),
        };
        let up = viewer.dot(normal);
        if up <= 0.0 || shading.dot(normal) <= 0.0 {
            continue;
        }
        let lowest = (0.9 * up).min(MIN_REFLECTED_COSINE);
        let mirrored = |n: Vec3| (n * (2.0 * viewer.dot(n)) - viewer).dot(normal);
        let n = bend_shading_normal(shading, normal, viewer);
        assert!((n.dot(n) - 1.0).abs() < 1e-6 && n.dot(normal) > 0.0, "{shading} {normal} {viewer}: {n}");
        assert!(n.dot(viewer) > 0.0, "{shading} {normal} {viewer}: {n}");
        // Rounding of this line's dot products, and of the viewer's cosine, by which the normal, a
        // sum of two directions as long as their cosines together, is turned.
        let rounding = 2e-6 + 4.0 * f32::EPSILON / (up + lowest);
        assert!(
            mirrored(n) >= 0.5 * lowest - rounding,
            "{shading} {normal} {viewer}: {} < {lowest}",
            mirrored(n)
        );
        if mirrored(shading) > lowest + rounding {
            assert_eq!(n, shading);
        }
        bent += u32::from(n != shading);
        lost += u32::from(mirrored(shading) < 0.0);
    }
    assert!(bent > samples(200_000) / 10 && lost > samples(200_000) / 20, "{bent} bent, {lost} lost without");
}

const SIDE: u32 = 5;

fn texture(flags: u32, scale: f32) -> Texture {
    let (width, height) = (SIDE, SIDE);
    Texture {
        first: 3,
        width,
        height,
        flags,
        uu: scale,
        uv: 0.0,
        vu: 0.0,
        vv: scale,
        u0: 0.0,
        v0: 0.0,
        pad: [0; 2],
    }
}

/// NaN, infinite and huge coordinates read some texel of the image: none beyond it, never NaN,
/// never out of its range. The texels around the image are infinite.
#[test]
fn texture_lookups_stay_inside() {
    let half = |x: f32| u32::from(((x.to_bits() >> 13) - (112 << 10)) as u16); // for normal numbers
    let outside = 0x7c00 | 0x7c00 << 16;
    let mut texels = vec![Texel { red_green: outside, blue_alpha: outside }; 3 + (SIDE * SIDE) as usize + 3];
    for (i, texel) in texels[3..][..(SIDE * SIDE) as usize].iter_mut().enumerate() {
        let value = half(0.25 + 0.5 * (i as f32 / (SIDE * SIDE) as f32));
        *texel = Texel { red_green: value | value << 16, blue_alpha: value | value << 16 };
    }
    let odd =
        [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -f32::MAX, 3e9, -3e9, 1e-40, -0.0, 1.0, 0.5];
    for wrapping in [REPEAT, MIRROR, CLAMP] {
        for flags in [wrapping | wrapping << 2, wrapping | wrapping << 2 | NEAREST] {
            for scale in [1.0, -1e6, 0.0] {
                let textures = [texture(flags, scale)];
                let scene = Scene { textures: &textures, texels: &texels, ..NO_SCENE };
                let check = |u: f32, v: f32| {
                    // SAFETY: the texture lies inside the texels.
                    let c = unsafe { sample(scene, 0, u, v) };
                    let inside = |x: f32| (0.2499..0.7501).contains(&x);
                    assert!(inside(c.x) && inside(c.w), "{flags:#x} {scale} ({u}, {v}): {c}");
                };
                for u in odd {
                    odd.iter().for_each(|&v| check(u, v));
                }
                for i in 0..samples(20_000) {
                    let w = words(2, i);
                    check(f32::from_bits(w.x), f32::from_bits(w.y));
                    check(unit_f32(w.z) * 3.0 - 1.0, unit_f32(w.w) * 3.0 - 1.0);
                }
            }
        }
    }
}

/// Interpolation passes through the texels' centres, and only there does it return one texel alone.
#[test]
fn texels_are_where_they_belong() {
    let one = 0x3c00;
    let mut texels = vec![Texel { red_green: 0, blue_alpha: 0 }; 3 + (SIDE * SIDE) as usize];
    texels[3 + (SIDE + 2) as usize].red_green = one; // column 2, row 1
    let textures = [texture(REPEAT, 1.0)];
    let scene = Scene { textures: &textures, texels: &texels, ..NO_SCENE };
    // SAFETY: as above.
    let red = |u: f32, v: f32| unsafe { sample(scene, 0, u, v) }.x;
    assert!((red(0.5, 0.3) - 1.0).abs() < 1e-6);
    assert!((red(0.5, 1.3) - 1.0).abs() < 1e-5);
    assert!((red(0.6, 0.3) - 0.5).abs() < 1e-6);
    assert!((red(0.4, 0.4) - 0.25).abs() < 1e-6);
    assert!(red(0.7, 0.3).abs() < 1e-6);
    assert_eq!(Vec3::splat(red(0.1, 0.9)), Vec3::ZERO);
}

/// Images are upright. Their first row is at the end of a quad's second edge, at the end of a
/// disc's second axis, and at a sphere's north pole. Their first column is at the start of a quad's
/// first edge, at the far end of a disc's first axis, and at a sphere's -x.
#[test]
fn images_are_upright() {
    let planar = |kind, origin| Planar {
        origin,
        normal: Vec3::Z,
        kind,
        dual_u: Vec3::X / 2.0,
        dual_v: Vec3::Y / 4.0,
        edge_u: Vec3::X * 2.0,
        edge_v: Vec3::Y * 4.0,
        ..Planar::zeroed()
    };
    let sphere = Sphere { center: Vec3::ZERO, radius: 2.0, material: 0, pad: [0; 3] };
    let flats = [planar(QUAD, Vec3::ZERO), planar(DISC, Vec3::ZERO)];
    let scene = Scene { spheres: &[sphere], planars: &flats, ..NO_SCENE };
    let mut params = RenderParams::zeroed();
    (params.first_planar, params.first_triangle) = (1, 3);
    // Returns the texture coordinates that a ray against `normal`, from distance 5, finds at
    // `point`.
    let read = |primitive: u32, point: Vec3, normal: Vec3| {
        let ray = Ray::in_world(point + normal * 5.0, -normal, OriginPrimitive::NONE);
        let hit = Hit::in_world(5.0, primitive);
        // SAFETY: the primitives are there.
        let s = unsafe { surface::at(FeatureSet::<{ SHAPES | TEXTURES }>::ALL, &params, scene, ray, hit) };
        (s.u, s.v)
    };
    let up = Vec3::Z;
    let cases = [
        (read(1, Vec3::new(0.5, 3.0, 0.0), up), (0.25, 0.25)),
        (read(1, Vec3::new(2.0, 0.0, 0.0), up), (1.0, 1.0)),
        (read(2, Vec3::new(-1.0, 2.0, 0.0), up), (0.25, 0.25)),
        (read(2, Vec3::new(2.0, 0.0, 0.0), up), (1.0, 0.5)),
        // From -x by +z, +x and -z.
        (read(0, Vec3::Z * 2.0, Vec3::Z), (0.25, 0.5)),
        (read(0, Vec3::X * 2.0, Vec3::X), (0.5, 0.5)),
        (read(0, Vec3::NEG_Z * 2.0, Vec3::NEG_Z), (0.75, 0.5)),
    ];
    for (i, (got, want)) in cases.into_iter().enumerate() {
        // Rounding of a position and of an angle.
        assert!((got.0 - want.0).abs() < 1e-6 && (got.1 - want.1).abs() < 1e-6, "{i}: {got:?} for {want:?}");
    }
    let (north, south) = (normalize(Vec3::new(0.1, 1.0, 0.0)), normalize(Vec3::new(0.1, -1.0, 0.0)));
    assert!(read(0, north * 2.0, north).1 < 0.1 && read(0, south * 2.0, south).1 > 0.9);
}
