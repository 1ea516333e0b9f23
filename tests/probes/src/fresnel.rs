//! Probe of reflectance and refraction at a boundary.

use crate::record::{Input, Output, ProbeParams, floats, row4};
use glam::{UVec4, Vec3};
use trisect_shared::fresnel::{conductor, dielectric, refracted_cos2, schlick};
use trisect_shared::math::sqrt;
use trisect_shared::scene::Scene;

/// Fresnel's equations of a dielectric. Row a: cosine of incidence; index, incident over refracted.
/// Output: reflectance; cosine of refraction, 0 where reflection is total; the square of that
/// cosine, negative there.
pub const DIELECTRIC: u32 = 0;
/// Schlick's approximation with the incident cosine; rows and output of [`DIELECTRIC`].
pub const SCHLICK: u32 = 1;
/// Fresnel's equations of a conductor. Row a: cosine; real and imaginary index. Output:
/// reflectance.
pub const CONDUCTOR: u32 = 2;
/// [`DIELECTRIC`] with cos² = 1 - eta² sin², which cancels: a negative control.
pub const CANCELLING: u32 = 3;

/// Runs the operation that `params.operation` names; the constants above state row and output a.
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
        // The condition by which a dielectric decides.
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
