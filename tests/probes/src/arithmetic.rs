//! Probe of the operations that all other functions consist of: f32 arithmetic, comparisons and
//! conversions.

use crate::record::{Input, Output, ProbeParams, floats, row4};
use glam::UVec4;
use trisect_shared::math::{max, min, reciprocal, sqrt};
use trisect_shared::scene::Scene;

/// x + y.
pub const ADD: u32 = 0;
/// x - y.
pub const SUBTRACT: u32 = 1;
/// x y.
pub const MULTIPLY: u32 = 2;
/// x / y.
pub const DIVIDE: u32 = 3;
/// The square root of x.
pub const ROOT: u32 = 4;
/// The smaller of x and y.
pub const MINIMUM: u32 = 5;
/// The larger of x and y.
pub const MAXIMUM: u32 = 6;
/// x y + z, which rounds twice unless the compiler contracts it.
pub const MULTIPLY_ADD: u32 = 7;
/// (x + y) - x: the part of y that the sum's rounding keeps, unless the compiler reassociates.
pub const ADD_SUBTRACT: u32 = 8;
/// The bits of x as an unsigned integer, converted to f32.
pub const FROM_UNSIGNED: u32 = 9;
/// The bits of x as a signed integer, converted to f32.
pub const FROM_SIGNED: u32 = 10;
/// x converted to a signed integer, towards zero; |x| < 2³¹.
pub const TO_SIGNED: u32 = 11;
/// Comparisons as bits from the lowest: x < y, x ≤ y, x = y, x ≠ x, x > y, x ≥ y.
pub const COMPARE: u32 = 12;
/// 1 / x.
pub const RECIPROCAL: u32 = 13;
/// Digest of 1 / x for each x of a range.
pub const RECIPROCALS: u32 = 14;
/// Digest of the square root of each x of a range.
pub const ROOTS: u32 = 15;
/// Digest of 1 / √x, both rounded, for each x of a range.
pub const RECIPROCALS_OF_ROOTS: u32 = 16;
/// Digest of the approximate reciprocal of each x of a range.
pub const APPROXIMATE_RECIPROCALS: u32 = 17;

/// Numbers of a digest's range.
pub const RANGE: u32 = 1 << 12;

/// Returns a digest of an operation's results for the [`RANGE`] numbers whose bits follow `first`:
/// the 32-bit FNV-1a hash of their bits, word by word, with one pattern for all NaN.
#[inline(always)]
fn digest(operation: u32, first: u32) -> u32 {
    let mut hash = 0x811c_9dc5;
    let mut index = 0;
    while index < RANGE {
        let x = f32::from_bits(first + index);
        let mut result = 0.0;
        if operation == RECIPROCALS {
            result = 1.0 / x;
        } else if operation == ROOTS {
            result = sqrt(x);
        } else if operation == RECIPROCALS_OF_ROOTS {
            result = 1.0 / sqrt(x);
        } else if operation == APPROXIMATE_RECIPROCALS {
            result = reciprocal(x);
        }
        let bits = result.to_bits();
        let bits = if bits & 0x7fff_ffff > 0x7f80_0000 { 0x7fc0_0000 } else { bits };
        hash = (hash ^ bits).wrapping_mul(0x0100_0193);
        index += 1;
    }
    hash
}

/// Runs the operation that `params.operation` names. Row a: x, y, z, or the bits of a range's first
/// number. Output: a the result, as a number; b the integer, the bits or the digest that
/// [`TO_SIGNED`], [`COMPARE`] and operations of ranges give instead.
#[inline(always)]
pub fn arithmetic(params: &ProbeParams, _: Scene, input: Input) -> Output {
    let v = floats(input.a);
    let (x, y, z) = (v.x, v.y, v.z);
    let operation = params.operation;
    let mut bits = 0;
    let mut result = 0.0;
    if operation == ADD {
        result = x + y;
    } else if operation == SUBTRACT {
        result = x - y;
    } else if operation == MULTIPLY {
        result = x * y;
    } else if operation == DIVIDE {
        result = x / y;
    } else if operation == ROOT {
        result = sqrt(x);
    } else if operation == MINIMUM {
        result = min(x, y);
    } else if operation == MAXIMUM {
        result = max(x, y);
    } else if operation == MULTIPLY_ADD {
        result = x * y + z;
    } else if operation == ADD_SUBTRACT {
        result = (x + y) - x;
    } else if operation == FROM_UNSIGNED {
        result = input.a.x as f32;
    } else if operation == FROM_SIGNED {
        result = input.a.x as i32 as f32;
    } else if operation == TO_SIGNED {
        bits = x as i32 as u32;
    } else if operation == COMPARE {
        bits = (x < y) as u32 | ((x <= y) as u32) << 1 | ((x == y) as u32) << 2;
        #[allow(clippy::eq_op, reason = "whether a compiler folds it is the question")]
        let is_nan = x != x;
        bits |= (is_nan as u32) << 3 | ((x > y) as u32) << 4 | ((x >= y) as u32) << 5;
    } else if operation == RECIPROCAL {
        result = 1.0 / x;
    } else {
        bits = digest(operation, input.a.x);
    }
    Output { a: row4(result, 0.0, 0.0, 0.0), b: UVec4::new(bits, 0, 0, 0) }
}
