//! How much a boundary reflects, and where it bends light to.

use crate::record::{Input, Output, ProbeParams, floats, row4};
use glam::{UVec4, Vec3};
use trisect_shared::fresnel::{conductor, dielectric, refracted_cos2, schlick};
use trisect_shared::math::sqrt;
use trisect_shared::scene::Scene;

/// Row a: cosine of incidence; index, incident over refracted. Output: reflectance, cosine of refraction or 0 where reflection is total, its square.
pub const DIELECTRIC: u32 = 0;
/// The same by Schlick's approximation with the incident cosine.
pub const SCHLICK: u32 = 1;
/// Row a: cosine; real and imaginary index. Output: reflectance.
pub const CONDUCTOR: u32 = 2;
/// As [`DIELECTRIC`] with 1 - eta² sin², which cancels: the twin.
pub const CANCELLING: u32 = 3;

/// Numbers in row a, out in row a.
#[inline(always)]
pub fn fresnel(params: &ProbeParams, _: Scene, input: Input) -> Output {
    let v = floats(input.a);
    let (cos, eta) = (v.x, v.y);
    let operation = params.operation;
    let mut a = UVec4::ZERO;
    if operation == CONDUCTOR {
        a = row4(conductor(cos, Vec3::splat(v.y), Vec3::splat(v.z)).x, 0.0, 0.0, 0.0);
    } else {
        let mut square = refracted_cos2(cos, eta);
        if operation == CANCELLING {
            let sin2 = 1.0 - cos * cos;
            square = 1.0 - eta * eta * sin2;
        }
        let mut reflectance = 1.0;
        let mut refracted = 0.0;
        // As a dielectric decides.
        if square > 0.0 {
            refracted = sqrt(square);
            reflectance = dielectric(cos, refracted, eta);
            if operation == SCHLICK {
                reflectance = schlick(cos, eta);
            }
        }
        a = row4(reflectance, refracted, square, a.w as f32);
    }
    Output { a, b: UVec4::ZERO }
}
