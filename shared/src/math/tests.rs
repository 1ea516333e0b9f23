//! Tests of the elementary functions.

use super::*;

#[test]
fn circle_is_on_the_circle_and_covers_it() {
    let mut quarter = [0u32; 4];
    for i in 0..1u32 << 16 {
        let (x, y) = unit_circle(i << 16 | i);
        let (x, y) = (f64::from(x), f64::from(y));
        let length = x * x + y * y;
        assert!((length - 1.0).abs() < 3e-7, "{i}: {length}");
        quarter[usize::from(x > 0.0) * 2 + usize::from(y > 0.0)] += 1;
    }
    assert!(quarter.iter().all(|&n| n.abs_diff(1 << 14) <= 1), "{quarter:?}");
}

#[test]
fn circle_matches_libm() {
    for i in 0..1u32 << 16 {
        let bits = i.wrapping_mul(0x9e37_79b9);
        let fraction = f64::from((bits >> 6) & 0x00ff_ffff) / f64::from(1 << 24) - 0.5;
        let angle = fraction * core::f64::consts::FRAC_PI_2;
        let (mut c, s) = (libm::cos(angle), libm::sin(angle));
        if bits >> 31 == 1 {
            c = -c;
        }
        let want = if bits >> 30 & 1 == 0 { (c, s) } else { (s, c) };
        let got = unit_circle(bits);
        assert!((f64::from(got.0) - want.0).abs() < 2e-7 && (f64::from(got.1) - want.1).abs() < 2e-7);
    }
}

#[test]
fn extreme_random_bits_stay_in_range() {
    for a in [0, 1, 0xff, 0x100, 0x7fff_ffff, 0x8000_0000, 0xffff_ff80, u32::MAX] {
        assert!((0.0..1.0).contains(&unit_f32(a)));
        for b in [0, 1, 0x3fff_ffff, 0x4000_0000, 0xbfff_ffff, 0xffff_ff80, u32::MAX] {
            let p = unit_sphere(a, b);
            assert!((p.dot(p) - 1.0).abs() < 1e-6, "{a:#x} {b:#x}: {p}");
        }
    }
}

#[test]
fn cube_root() {
    assert_eq!(cbrt_unit(0.0), 0.0);
    for i in 1..=1u32 << 20 {
        let x = i as f32 / (1 << 20) as f32;
        let want = libm::cbrt(f64::from(x));
        assert!((f64::from(cbrt_unit(x)) / want - 1.0).abs() < 5e-7, "{x}");
    }
    assert!((f64::from(cbrt_unit(1.0 / 16_777_216.0)) * 256.0 - 1.0).abs() < 5e-7);
}

#[test]
fn finite_by_bits() {
    assert!(all_finite(Vec3::new(0.0, f32::MAX, -f32::MIN_POSITIVE)));
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in Vec3::AXES {
            assert!(!all_finite(Vec3::select(axis.cmpeq(Vec3::ONE), Vec3::splat(bad), Vec3::ZERO)));
        }
    }
}

#[test]
fn normalized_has_unit_length() {
    let v = normalize(Vec3::new(3e-3, -40.0, 1e3));
    assert!((v.dot(v) - 1.0).abs() < 4.0 * f32::EPSILON);
}

#[test]
fn high_words_of_products() {
    let mut x = 1u32;
    for _ in 0..10_000 {
        x = crate::rng::pcg4d(crate::rng::Words { x, y: 1, z: 2, w: 3 }).x;
        let y = x.rotate_left(13) ^ 0x55;
        assert_eq!(mul_high(x, y), ((u64::from(x) * u64::from(y)) >> 32) as u32);
    }
    assert_eq!(mul_high(u32::MAX, u32::MAX), u32::MAX - 1);
}

#[test]
fn floors() {
    for (x, want) in [(0.0, 0), (0.9, 0), (-0.0, 0), (-0.1, -1), (-1.0, -1), (7.5, 7), (-7.5, -8)] {
        assert_eq!(floor(x), want, "{x}");
    }
    floor(f32::NAN);
    floor(f32::INFINITY);
}

#[test]
fn angles_and_back() {
    for i in -2000..2000 {
        let t = i as f32 / 1000.0;
        let (c, s) = cos_sin_turns(t);
        let angle = f64::from(t) * core::f64::consts::TAU;
        assert!((f64::from(c) - libm::cos(angle)).abs() < 3e-7, "{t}");
        assert!((f64::from(s) - libm::sin(angle)).abs() < 3e-7, "{t}");
        let want = libm::atan2(f64::from(s), f64::from(c)) / core::f64::consts::TAU;
        let error = (f64::from(atan2_turns(s, c)) - want).abs();
        assert!(error < 1e-7 || (error - 1.0).abs() < 1e-7, "{t}: {error}");
    }
    assert_eq!(
        (atan2_turns(0.0, 0.0), atan2_turns(0.0, 1.0), atan2_turns(1.0, 0.0), atan2_turns(0.0, -1.0)),
        (0.0, 0.0, 0.25, 0.5)
    );
}

#[test]
fn products_are_added_in_order() {
    let (mut others, mut word) = (0, 0u32);
    for _ in 0..1000 {
        let mut next = || {
            word = word.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            unit_f32(word)
        };
        let (a, b) = (Vec4::new(next(), next(), next(), next()), Vec4::new(next(), next(), next(), next()));
        let p = a * b;
        assert_eq!(dot4(a, b).to_bits(), (((p.x + p.y) + p.z) + p.w).to_bits());
        others += usize::from(dot4(a, b) != (p.x + p.z) + (p.y + p.w));
    }
    // Negative control: another order has other bits.
    assert!(others > 100, "{others}");
}

#[test]
fn bases_are_orthonormal() {
    for i in 0..10_000u32 {
        let w = crate::rng::PathKey { seed: 3, pixel: i, sample: 0 }.words(0);
        let n = unit_sphere(w.x, w.y);
        let (a, b) = basis(n);
        assert!(a.dot(b).abs() < 1e-6 && a.dot(n).abs() < 1e-6 && b.dot(n).abs() < 1e-6);
        assert!((a.cross(b) - n).length() < 1e-6);
    }
    assert!(basis(Vec3::NEG_Z).0.is_finite());
}

#[test]
fn halves() {
    for (bits, want) in
        [(0u32, 0.0f32), (0x3c00, 1.0), (0x0400, 1.0 / 16384.0), (0x7bff, 65504.0), (0x3555, 0.333_251_95)]
    {
        assert_eq!(from_half(bits), want);
    }
}
