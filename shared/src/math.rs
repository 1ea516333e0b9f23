//! The only door to square root, sine, cosine and cube root, and to minimum and maximum.
//!
//! Each function is made of operations that round the same everywhere, so its bits are the same on the CPU and in
//! precise PTX. glam's `length` and `normalize` use a software square root on devices: use [`normalize`].

use core::f32::consts::FRAC_PI_2;
use glam::Vec3;

/// The correctly rounded square root; NaN below zero.
#[inline(always)]
pub fn sqrt(x: f32) -> f32 {
    #[cfg(target_arch = "nvptx64")]
    return core::f32::math::sqrt(x); // sqrt.rn.f32: libm's is software there
    #[cfg(all(feature = "std", not(target_arch = "nvptx64")))]
    return x.sqrt();
    #[cfg(all(not(feature = "std"), not(target_arch = "nvptx64")))]
    return libm::sqrtf(x); // rust-gpu turns this call into GLSL.std.450 Sqrt
}

/// The smaller of two numbers, neither of them NaN; of +0 and -0 either.
///
/// One instruction on each target. `f32::min` is one on PTX only: its rule for NaN costs x86 three, and SPIR-V two branches.
/// Callers make NaN impossible instead.
#[inline(always)]
pub fn min(a: f32, b: f32) -> f32 {
    #[cfg(target_arch = "nvptx64")]
    return a.min(b);
    #[cfg(target_arch = "spirv")]
    return libm::fminf(a, b); // rust-gpu turns this call into GLSL.std.450 FMin
    #[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
    return if a < b { a } else { b };
}

/// The larger of two numbers, neither of them NaN; of +0 and -0 either. See [`min`].
#[inline(always)]
pub fn max(a: f32, b: f32) -> f32 {
    #[cfg(target_arch = "nvptx64")]
    return a.max(b);
    #[cfg(target_arch = "spirv")]
    return libm::fmaxf(a, b);
    #[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
    return if a > b { a } else { b };
}

/// `v` to unit length, within 3 ULP a component; NaN for the zero vector.
#[inline(always)]
pub fn normalize(v: Vec3) -> Vec3 {
    v * (1.0 / sqrt(v.dot(v)))
}

/// Whether `x` is neither NaN nor infinite, by its bits: a comparison with itself may legally be folded away.
#[inline(always)]
pub fn is_finite(x: f32) -> bool {
    x.to_bits() & 0x7fff_ffff < 0x7f80_0000
}

/// The numbers 0 ≤ u < 1 that the upper 24 of 32 random bits name, 2⁻²⁴ apart. Never 1, which `bits as f32 * 2⁻³²`
/// is for the top 128 values.
#[inline(always)]
pub fn unit_f32(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A point of the unit circle, (cos φ, sin φ): uniform in φ over uniform `bits`; each component within 2e-7.
///
/// The lower bits choose an angle in [-π/4, π/4), where short minimax polynomials suffice; the upper two choose one of
/// the four quarter turns. That spares the reduction of an angle and any conversion from float to integer.
#[inline(always)]
pub fn unit_circle(bits: u32) -> (f32, f32) {
    let turn = ((bits >> 6) & 0x00ff_ffff) as f32 * (1.0 / 16_777_216.0) - 0.5; // of a quarter
    let square = turn * turn;
    let sin =
        turn * (FRAC_PI_2 + square * (-0.645_963_5 + square * (0.079_680_03 + square * -0.004_601_658)));
    let cos = 0.999_999_94 + square * (-1.233_696_7 + square * (0.253_594_94 + square * -0.020_398_581));
    let cos = f32::from_bits(cos.to_bits() ^ (bits & 0x8000_0000));
    if bits & 0x4000_0000 == 0 { (cos, sin) } else { (sin, cos) }
}

/// A point of the unit sphere, uniform by area over two uniform 32-bit words (Archimedes: z is uniform).
#[inline(always)]
pub fn unit_sphere(height: u32, azimuth: u32) -> Vec3 {
    let u = unit_f32(height);
    let (cos, sin) = unit_circle(azimuth);
    let radius = 2.0 * sqrt(u * (1.0 - u)); // of the circle at this height; no cancellation, never NaN
    Vec3::new(radius * cos, radius * sin, 1.0 - 2.0 * u)
}

/// The cube root of 2⁻²⁴ ≤ x ≤ 1, within 5e-7 relative; 0 for 0.
///
/// Newton's method for x^(-1/3) needs no division; its first guess comes from the exponent (as in Lomont's note on the
/// inverse square root, 2003; the constant was searched for the least greatest error, 3.5 %).
#[inline(always)]
pub fn cbrt_unit(x: f32) -> f32 {
    let third = x * (1.0 / 3.0);
    let mut y = f32::from_bits(0x54a2_3400 - x.to_bits() / 3);
    y *= 4.0 / 3.0 - third * y * (y * y);
    y *= 4.0 / 3.0 - third * y * (y * y);
    y *= 4.0 / 3.0 - third * y * (y * y);
    x * (y * y)
}

#[cfg(test)]
mod tests {
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
        assert!(is_finite(0.0) && is_finite(f32::MAX) && is_finite(-f32::MIN_POSITIVE));
        assert!(!is_finite(f32::NAN) && !is_finite(f32::INFINITY) && !is_finite(f32::NEG_INFINITY));
    }

    #[test]
    fn normalized_has_unit_length() {
        let v = normalize(Vec3::new(3e-3, -40.0, 1e3));
        assert!((v.dot(v) - 1.0).abs() < 4.0 * f32::EPSILON);
    }
}
