//! Probe of the sums over a pixel's samples.

use crate::record::{Input, Output, ProbeParams, floats, row};
use glam::{UVec4, Vec3, Vec4};
use trisect_shared::film::{Compensation, PixelSums};
use trisect_shared::params::FLAG_OPAQUE_ZERO;
use trisect_shared::scene::Scene;

/// Compensated sum of equal values. Row a: the value, and how often (word y) it is added. Output:
/// sum and samples.
pub const CONSTANT: u32 = 0;
/// Compensated sum of a list. Row a: up to four values; row b: how many. Output: sum and samples.
pub const LIST: u32 = 1;
/// [`CONSTANT`] summed in f32 without compensation: a negative control.
pub const PLAIN: u32 = 2;
/// [`LIST`] summed in f32 without compensation: a negative control.
pub const PLAIN_LIST: u32 = 3;

#[inline(always)]
fn component(v: Vec4, i: u32) -> f32 {
    if i == 0 {
        v.x
    } else if i == 1 {
        v.y
    } else if i == 2 {
        v.z
    } else {
        v.w
    }
}

/// Runs the operation that `params.operation` names; the constants above state the rows. Output a:
/// sum and samples.
#[inline(always)]
pub fn sums(params: &ProbeParams, _: Scene, input: Input) -> Output {
    let v = floats(input.a);
    let operation = params.operation;
    let list = operation == LIST || operation == PLAIN_LIST;
    let count = if list { input.b.x } else { input.a.y };
    let mut sums = PixelSums::ZERO;
    let mut compensation = Compensation::ZERO;
    let mut plain = 0.0;
    let mut i = 0;
    while i < count {
        let value = if list { component(v, i) } else { v.x };
        if operation == PLAIN || operation == PLAIN_LIST {
            plain += value;
        } else {
            sums.add(Vec3::splat(value), &mut compensation, params.render.flags & FLAG_OPAQUE_ZERO);
        }
        i += 1;
    }
    sums.compensate(compensation);
    sums.radiance += Vec3::splat(plain);
    Output { a: row(sums.radiance, sums.samples), b: UVec4::ZERO }
}
