//! Square root, sine, cosine, arc tangent, cube root, minimum and maximum for all other modules.
//!
//! Each function consists of operations that round identically everywhere, so its bits are the same
//! on the CPU and in precise PTX; [`fused`] and [`reciprocal`] are the two exceptions. glam's
//! `length` and `normalize` use a software square root on devices: use [`normalize`] instead.
//! Render kernels multiply by reciprocals and do not divide: on CUDA a division takes a branch.

use core::f32::consts::{FRAC_PI_2, LN_2};
use glam::{Vec3, Vec4};

/// Returns the correctly rounded square root; NaN below zero.
#[inline(always)]
pub fn sqrt(x: f32) -> f32 {
    #[cfg(target_arch = "nvptx64")]
    return core::f32::math::sqrt(x); // sqrt.rn.f32: libm's is software there
    #[cfg(all(feature = "std", not(target_arch = "nvptx64")))]
    return x.sqrt();
    #[cfg(all(not(feature = "std"), not(target_arch = "nvptx64")))]
    return libm::sqrtf(x); // rust-gpu turns this call into GLSL.std.450 Sqrt
}

/// Returns the smaller of two numbers, neither of them NaN; of +0 and -0 it may return either.
///
/// It is one instruction on each target. `f32::min` is one on PTX only: its rule for NaN costs x86
/// three, and SPIR-V two branches. Callers rule out NaN instead.
#[inline(always)]
pub fn min(a: f32, b: f32) -> f32 {
    #[cfg(target_arch = "nvptx64")]
    return a.min(b);
    #[cfg(target_arch = "spirv")]
    return libm::fminf(a, b); // rust-gpu turns this call into GLSL.std.450 FMin
    #[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
    return if a < b { a } else { b };
}

/// Returns the larger of two numbers, neither of them NaN; of +0 and -0 it may return either. See
/// [`min`].
#[inline(always)]
pub fn max(a: f32, b: f32) -> f32 {
    #[cfg(target_arch = "nvptx64")]
    return a.max(b);
    #[cfg(target_arch = "spirv")]
    return libm::fmaxf(a, b);
    #[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
    return if a > b { a } else { b };
}

/// Returns a b + c, rounded once on a device and twice on the CPU; for box tests only, which decide
/// no result. (On CUDA it treats denormal numbers as 0, by which the audit of precise PTX tells it
/// from a contraction.)
#[inline(always)]
pub fn fused(a: f32, b: f32, c: f32) -> f32 {
    #[cfg(target_arch = "nvptx64")]
    #[allow(unsafe_code, reason = "an intrinsic")]
    // SAFETY: an instruction without side effects.
    return unsafe { fused_flushing(a, b, c) };
    #[cfg(target_arch = "spirv")]
    return libm::fmaf(a, b, c); // rust-gpu turns this call into GLSL.std.450 Fma
    #[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
    return a * b + c;
}

/// Returns 1 / `x`, within 1 ULP on the CPU and CUDA and 2.5 ULP on Vulkan; for box tests only,
/// which decide no result.
#[inline(always)]
pub fn reciprocal(x: f32) -> f32 {
    #[cfg(target_arch = "nvptx64")]
    #[allow(unsafe_code, reason = "an intrinsic")]
    // SAFETY: an instruction without side effects.
    return unsafe { approximate_reciprocal(x) };
    #[cfg(not(target_arch = "nvptx64"))]
    return 1.0 / x;
}

#[cfg(target_arch = "nvptx64")]
#[allow(unsafe_code, reason = "an intrinsic")]
unsafe extern "C" {
    #[link_name = "llvm.nvvm.rcp.approx.ftz.f"]
    fn approximate_reciprocal(x: f32) -> f32;
    #[link_name = "llvm.nvvm.fma.rn.ftz.f"]
    fn fused_flushing(a: f32, b: f32, c: f32) -> f32;
}

/// Returns `v` scaled to unit length, within 3 ULP a component; NaN for the zero vector.
#[inline(always)]
pub fn normalize(v: Vec3) -> Vec3 {
    v * (1.0 / sqrt(v.dot(v)))
}

/// Returns whether no component is NaN or infinite. It looks at the bits, since a comparison of a
/// number with itself may legally be folded away, and compares once, since each comparison may cost
/// lanes a branch.
#[inline(always)]
pub fn all_finite(v: Vec3) -> bool {
    let size = |x: f32| x.to_bits() & 0x7fff_ffff;
    size(v.x).max(size(v.y)).max(size(v.z)) < 0x7f80_0000
}

/// Returns the number 0 ≤ u < 1 that the upper 24 of 32 random bits name, a multiple of 2⁻²⁴. It is
/// never 1, which `bits as f32 * 2⁻³²` is for the top 128 values.
#[inline(always)]
pub fn unit_f32(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Returns a point (cos φ, sin φ) of the unit circle, uniform in φ over uniform `bits`; each
/// component within 2e-7.
///
/// The lower bits choose an angle in [-π/4, π/4), where short minimax polynomials suffice; the
/// upper two bits choose one of the four quarter turns. That avoids the reduction of an angle and
/// any conversion from float to integer.
#[inline(always)]
pub fn unit_circle(bits: u32) -> (f32, f32) {
    let turn = ((bits >> 6) & 0x00ff_ffff) as f32 * (1.0 / 16_777_216.0) - 0.5; // in quarter turns
    let (cos, sin) = cos_sin_quarter_turns(turn);
    let cos = f32::from_bits(cos.to_bits() ^ (bits & 0x8000_0000));
    if bits & 0x4000_0000 == 0 { (cos, sin) } else { (sin, cos) }
}

/// Returns the cosine and sine of `turn` quarter turns (of π/2), for `turn` in [-1/2, 1/2]; minimax
/// polynomials, within 2e-7.
#[inline(always)]
fn cos_sin_quarter_turns(turn: f32) -> (f32, f32) {
    let square = turn * turn;
    let sin =
        turn * (FRAC_PI_2 + square * (-0.645_963_5 + square * (0.079_680_03 + square * -0.004_601_658)));
    let cos = 0.999_999_94 + square * (-1.233_696_7 + square * (0.253_594_94 + square * -0.020_398_581));
    (cos, sin)
}

/// Returns a point of the unit sphere, uniform by area over two uniform 32-bit words. (Archimedes:
/// z is uniform.)
#[inline(always)]
pub fn unit_sphere(height: u32, azimuth: u32) -> Vec3 {
    let u = unit_f32(height);
    let (cos, sin) = unit_circle(azimuth);
    let radius = 2.0 * sqrt(u * (1.0 - u)); // of the circle at this height; no cancellation, never NaN
    Vec3::new(radius * cos, radius * sin, 1.0 - 2.0 * u)
}

/// Returns the cube root of 2⁻²⁴ ≤ x ≤ 1, within 5e-7 relative; 0 for 0.
///
/// Newton's method for x^(-1/3) needs no division. Its first guess comes from the exponent, as in
/// Lomont's note on the inverse square root (2003); the constant minimises the guess's maximum
/// relative error, 3.5 %.
#[inline(always)]
pub fn cbrt_unit(x: f32) -> f32 {
    let third = x * (1.0 / 3.0);
    let mut y = f32::from_bits(0x54a2_3400 - x.to_bits() / 3);
    y *= 4.0 / 3.0 - third * y * (y * y);
    y *= 4.0 / 3.0 - third * y * (y * y);
    y *= 4.0 / 3.0 - third * y * (y * y);
    x * (y * y)
}

/// Returns the upper 32 bits of `a` · `b`. For a random `a` that is an integer below `b`, each with
/// the same probability within 2⁻³². It needs no 64-bit integers, which are optional in SPIR-V.
#[inline(always)]
pub fn mul_high(a: u32, b: u32) -> u32 {
    let (a1, a0, b1, b0) = (a >> 16, a & 0xffff, b >> 16, b & 0xffff);
    let middle = a1 * b0 + ((a0 * b0) >> 16); // at most 2³² - 1
    let low = a0 * b1 + (middle & 0xffff);
    a1 * b1 + (middle >> 16) + (low >> 16)
}

/// Returns the largest integer not above `x`, for |x| ≤ 2e9; some integer for other numbers and
/// NaN.
#[inline(always)]
pub fn floor(x: f32) -> i32 {
    // Clamp first: out of range, the conversion saturates on the CPU and is undefined on Vulkan.
    let clamped = min(max(x, -2e9), 2e9);
    let truncated = clamped as i32;
    truncated - (clamped < truncated as f32) as i32
}

/// Returns the cosine and sine of `turns` whole turns (of 2π), for |turns| < 2²⁰; each within 3e-7.
#[inline(always)]
pub fn cos_sin_turns(turns: f32) -> (f32, f32) {
    let quarters = turns * 4.0;
    let nearest = floor(quarters + 0.5);
    let turn = quarters - nearest as f32; // exact, in [-1/2, 1/2]
    let (cos, sin) = cos_sin_quarter_turns(turn);
    let (a, b) = if nearest & 1 == 0 { (cos, sin) } else { (-sin, cos) };
    if nearest & 2 == 0 { (a, b) } else { (-a, -b) }
}

/// Returns the angle of the vector (`x`, `y`) in turns, in [-1/2, 1/2], within 1e-7; 0 if both
/// components are zero or denormal.
#[inline(always)]
pub fn atan2_turns(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let (low, high) = (min(ax, ay), max(ax, ay));
    let ratio = if high >= f32::MIN_POSITIVE { low * (1.0 / high) } else { 0.0 };
    let s = ratio * ratio;
    // Minimax polynomial for atan(r) / (2 π r) in r², error 1.4e-8.
    let tail = 0.015_824_392 + s * (-0.009_534_13 + s * (0.003_908_387_4 + s * -0.000_760_833));
    let angle =
        ratio * (0.159_154_92 + s * (-0.053_049_676 + s * (0.031_785_432 + s * (-0.022_328_515 + s * tail))));
    let angle = if ay > ax { 0.25 - angle } else { angle };
    let angle = if x < 0.0 { 0.5 - angle } else { angle };
    if y < 0.0 { -angle } else { angle }
}

/// Returns 2 to the power of `x`, within 3e-7 relative for |x| ≤ 126; 2^-126 or 2^126 beyond.
#[inline(always)]
pub fn exp2(x: f32) -> f32 {
    let x = max(min(x, 126.0), -126.0);
    let whole = floor(x + 0.5);
    let f = x - whole as f32;
    // Taylor's series for |f| ≤ 1/2.
    let series = 1.0
        + f * (LN_2
            + f * (0.240_226_5
                + f * (0.055_504_11 + f * (0.009_618_129 + f * (0.001_333_356 + f * 0.000_154_035_3)))));
    series * f32::from_bits(((whole + 127) as u32) << 23)
}

/// Returns the logarithm to base 2 of a number of at least 2⁻¹²⁶, within 3e-7 or 2 ULP; -126 below.
#[inline(always)]
pub fn log2(x: f32) -> f32 {
    let bits = max(x, f32::MIN_POSITIVE).to_bits();
    // The mantissa becomes a number from sqrt(1/2) to sqrt(2).
    let shifted = bits.wrapping_sub(0x3f35_04f3);
    let whole = (shifted as i32) >> 23;
    let m = f32::from_bits((shifted & 0x007f_ffff).wrapping_add(0x3f35_04f3));
    let t = (m - 1.0) * (1.0 / (m + 1.0));
    let t2 = t * t;
    let series = 2.885_39 + t2 * (0.961_796_7 + t2 * (0.577_078 + t2 * (0.412_198_6 + t2 * 0.320_598_9)));
    whole as f32 + t * series
}

/// Returns two unit vectors perpendicular to the unit vector `n` and to each other; (first, second,
/// n) is right-handed.
///
/// Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
#[inline(always)]
pub fn basis(n: Vec3) -> (Vec3, Vec3) {
    let sign = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = 1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (Vec3::new(1.0 - sign * n.x * n.x * a, -sign * b, -sign * n.x), Vec3::new(-b, sign - n.y * n.y * a, -n.y))
}

/// Returns the value of a half-precision number that is 0 or at least 2⁻¹⁴ (the host rounds all
/// others to 0).
#[inline(always)]
pub fn from_half(bits: u32) -> f32 {
    // Move the half's exponent and fraction into place; times 2¹¹² for the difference of the
    // biases.
    f32::from_bits((bits & 0x7fff) << 13) * f32::from_bits(0x7780_0000)
}

/// Returns the Rec. 709 luminance of a linear colour.
#[inline(always)]
pub fn luminance(c: Vec3) -> f32 {
    0.212_6 * c.x + 0.715_2 * c.y + 0.072_2 * c.z
}

/// Returns the scalar product, added from x to w on every target: `Vec4::dot` adds in another order
/// on x86 than on GPUs.
#[inline(always)]
pub fn dot4(a: Vec4, b: Vec4) -> f32 {
    a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w
}

/// Returns the largest component.
#[inline(always)]
pub fn max_component(c: Vec3) -> f32 {
    max(c.x, max(c.y, c.z))
}

#[cfg(test)]
mod tests;
