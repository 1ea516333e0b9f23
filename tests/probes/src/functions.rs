//! Probe of the shared crate's own numeric functions (`math`).

use crate::record::{Input, Output, ProbeParams, floats, row, row4, vector};
use glam::UVec4;
use trisect_shared::math;
use trisect_shared::scene::Scene;

/// Point of the unit circle. Row a: random bits. Output: cos, sin.
pub const UNIT_CIRCLE: u32 = 0;
/// Cosine and sine of an angle. Row a: turns. Output: cos, sin.
pub const COS_SIN_TURNS: u32 = 1;
/// Angle of a vector. Row a: y, x. Output: turns.
pub const ATAN2_TURNS: u32 = 2;
/// Cube root. Row a: x in [0, 1]. Output: its cube root.
pub const CUBE_ROOT: u32 = 3;
/// Floor. Row a: x. Output b: the largest integer not above x.
pub const FLOOR: u32 = 4;
/// Normalisation. Row a: a vector. Output: the unit vector along it.
pub const NORMALIZE: u32 = 5;
/// Orthonormal basis. Row a: a unit vector. Output a, b: two unit vectors perpendicular to it and
/// to each other.
pub const BASIS: u32 = 6;
/// Conversion of a half. Row a: a half's bits. Output: its value.
pub const FROM_HALF: u32 = 7;
/// Test for finite numbers. Row a: a vector. Output b: 1 if all three are finite, else 0.
pub const ALL_FINITE: u32 = 8;
/// Product of integers. Row a: two integers. Output b: the upper word of their product.
pub const MUL_HIGH: u32 = 9;
/// Uniform number. Row a: random bits. Output: a number below 1.
pub const UNIT: u32 = 10;

/// Runs the operation that `params.operation` names; the constants above state row a and output.
#[inline(always)]
pub fn functions(params: &ProbeParams, _: Scene, input: Input) -> Output {
    let v = floats(input.a);
    let operation = params.operation;
    let mut out = Output { a: UVec4::ZERO, b: UVec4::ZERO };
    if operation == UNIT_CIRCLE {
        let (cos, sin) = math::unit_circle(input.a.x);
        out.a = row4(cos, sin, 0.0, 0.0);
    } else if operation == COS_SIN_TURNS {
        let (cos, sin) = math::cos_sin_turns(v.x);
        out.a = row4(cos, sin, 0.0, 0.0);
    } else if operation == ATAN2_TURNS {
        out.a = row4(math::atan2_turns(v.x, v.y), 0.0, 0.0, 0.0);
    } else if operation == CUBE_ROOT {
        out.a = row4(math::cbrt_unit(v.x), 0.0, 0.0, 0.0);
    } else if operation == FLOOR {
        out.b.x = math::floor(v.x) as u32;
    } else if operation == NORMALIZE {
        out.a = row(math::normalize(vector(input.a)), 0);
    } else if operation == BASIS {
        let (x, y) = math::basis(vector(input.a));
        out.a = row(x, 0);
        out.b = row(y, 0);
    } else if operation == FROM_HALF {
        out.a = row4(math::from_half(input.a.x), 0.0, 0.0, 0.0);
    } else if operation == ALL_FINITE {
        out.b.x = math::all_finite(vector(input.a)) as u32;
    } else if operation == MUL_HIGH {
        out.b.x = math::mul_high(input.a.x, input.a.y);
    } else if operation == UNIT {
        out.a = row4(math::unit_f32(input.a.x), 0.0, 0.0, 0.0);
    }
    out
}
