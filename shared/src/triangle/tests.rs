//! The exact sign against wider integers.

use super::*;
use crate::rng::{Words, pcg4d};

/// The significand with its sign, and the exponent of its last bit.
fn parts(x: f32) -> (i128, i32) {
    let bits = x.to_bits();
    let exponent = (bits >> 23) & 0xff;
    let magnitude = i128::from(fraction(bits, exponent));
    (if bits >> 31 != 0 { -magnitude } else { magnitude }, exponent.max(1) as i32 - 150)
}

/// By i128, where the exponents differ by less than its width; else by the larger product.
fn oracle(a: f32, b: f32, c: f32, d: f32) -> i32 {
    let product = |x, y| {
        let ((m, e), (n, f)) = (parts(x), parts(y));
        (m * n, e + f)
    };
    let ((p, e), (q, f)) = (product(a, b), product(c, d));
    let (p, q) = match e - f {
        shift if p == 0 || q == 0 || shift.abs() > 70 => {
            return if p == 0 || (q != 0 && shift < 0) { -q.signum() as i32 } else { p.signum() as i32 };
        }
        shift if shift >= 0 => (p << shift, q),
        shift => (p, q << -shift),
    };
    (p > q) as i32 - (p < q) as i32
}

fn check(a: f32, b: f32, c: f32, d: f32) {
    assert_eq!(exact_sign(a, b, c, d).signum(), oracle(a, b, c, d), "{a:e} * {b:e} - {c:e} * {d:e}");
}

/// Any finite numbers; products that differ in their last bits or not at all; zeros, denormals and the greatest.
#[test]
fn signs_are_exact() {
    let (mut ties, mut near) = (0, 0);
    for i in 0..200_000 {
        let w = pcg4d(Words { x: i, y: 5, z: 0, w: 0 });
        let finite = |bits: u32| {
            f32::from_bits(if bits & 0x7f80_0000 == 0x7f80_0000 { bits ^ 0x4000_0000 } else { bits })
        };
        let (a, b, c) = (finite(w.x), finite(w.y), finite(w.z));
        check(a, b, c, finite(w.w));
        check(a, b, b, a);
        // Near to a tie: d = a b / c, rounded, and its neighbours.
        let (a, b, c) = (
            1.0 + (w.x >> 9) as f32 / 8388608.0,
            1.0 + (w.y >> 20) as f32,
            1.0 + (w.z >> 9) as f32 / 8388608.0,
        );
        let d = a * b / c;
        for d in [d.next_down(), d, d.next_up()] {
            for sign in [1.0, -1.0] {
                check(a * sign, b, c, d * sign);
                check(a * 1e-30, b * sign * 1e-10, c * sign * 1e-20, d * 1e-20);
            }
            ties += u32::from(a * b == c * d);
            near += u32::from(a * b == c * d && oracle(a, b, c, d) != 0);
        }
    }
    assert!(ties > 10_000 && near > 10_000, "rounded products must tie and differ: {ties} {near}");
    let odd =
        [0.0, -0.0, 1e-45, -1e-45, f32::MIN_POSITIVE, 1.0, -1.0, 1.0 + f32::EPSILON, f32::MAX, f32::MIN];
    for a in odd {
        for b in odd {
            for c in odd {
                odd.iter().for_each(|&d| check(a, b, c, d));
            }
        }
    }
}
