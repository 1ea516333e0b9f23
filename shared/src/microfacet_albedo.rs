//! Albedo of GGX facets: the part of the light that a rough boundary reflects at once, and the part
//! that facets send to other facets, which multiple scattering gives back. For [`crate::bsdf`].
//!
//! The functions are fits to integrals over GGX's visible normals with height-correlated masking,
//! sampled for roughness 0.02 to 1 and cosines 0.002 to 1.

use crate::math::{max, min, sqrt};
use core::f32::consts::FRAC_1_PI;
use glam::{Vec3, Vec4};

/// Greatest error of the fit of [`lost_share`], which is kept as a margin: facets never reflect
/// more light than arrives.
const LOST_MARGIN: f32 = 0.003;

/// Returns the share of the light from cosine `cos` that facets of full reflectance send to other
/// facets: 1 minus the albedo by single scattering, within 0.006 below it.
#[inline(always)]
pub fn lost_share(cos: f32, roughness: f32) -> f32 {
    let alpha = roughness * roughness;
    // Height of the direction where the facets are stretched to a hemisphere.
    let cos2 = cos * cos;
    lost_share_at(cos * (1.0 / sqrt(max(cos2 + alpha * alpha * max(1.0 - cos2, 0.0), 1e-12))), roughness)
}

/// Returns what [`lost_share`] does, for the height of the direction where the facets are stretched
/// to a hemisphere.
#[inline(always)]
pub fn lost_share_at(height: f32, roughness: f32) -> f32 {
    let (r, s) = (roughness, height);
    let constant =
        0.005_572_8 + r * (-0.033_562 + r * (-0.003_317_8 + r * (0.220_67 + r * (-0.329_95 + r * 0.140_93))));
    let first = 0.211_41 + r * (-0.161_67 + r * (0.163_75 + r * (-0.294_56 + r * 0.296_14)));
    let second = -0.295_45 + r * (-0.166_08 + r * (0.747_26 + r * 0.059_25));
    let third = 0.509_33 + r * (-0.348_37 - r * 0.837_17);
    let fourth = -0.376_32 + r * 0.693_78;
    let above = constant + s * (first + s * (second + s * (third + s * (fourth - s * 0.052_886))));
    let below = 1.0 + r * (-1.841_1 + r * 0.890_52) + s * (-0.081_474 + r * 0.648_23 - s * 0.402_39);
    min(max(above * (1.0 / below) - LOST_MARGIN, 0.0), 1.0)
}

/// Returns the mean of [`lost_share`] over the hemisphere, weighted by the cosine, within 0.001; at
/// least 1e-3, so that a share can be divided by it.
#[inline(always)]
pub fn mean_lost_share(roughness: f32) -> f32 {
    let r = roughness;
    let fit =
        MEAN[0] + r * (MEAN[1] + r * (MEAN[2] + r * (MEAN[3] + r * (MEAN[4] + r * (MEAN[5] + r * MEAN[6])))));
    max(fit, 1e-3)
}

const MEAN: [f32; 7] = [8.338e-4, -0.045_799, 0.449_084, -1.555_76, 6.561_2, -7.405_59, 2.584_72];

/// Returns the factor of the [lost shares](lost_share) of two directions by which multiple
/// scattering by facets of full reflectance sends light from one to the other, per steradian (Kulla
/// and Conty, "Revisiting Physically Based Shading at Imageworks", 2017). `mean` is the mean lost
/// share.
#[inline(always)]
pub fn scattered_again(mean: f32) -> f32 {
    FRAC_1_PI * (1.0 / mean)
}

/// Returns the part of the [lost light](lost_share) that comes out again by multiple scattering, if
/// facets reflect `mean_reflectance` of light from all directions: a geometric series.
#[inline(always)]
pub fn returned_share(mean_reflectance: Vec3, mean_lost: f32) -> Vec3 {
    let f = mean_reflectance;
    let again = Vec3::ONE - f * mean_lost;
    // One division for all channels, each at least 0.4.
    let (xy, scale) = (again.x * again.y, 1.0 - mean_lost);
    let inverse = scale * (1.0 / (xy * again.z));
    f * f * (Vec3::new(again.y * again.z, again.x * again.z, xy) * inverse)
}

/// Returns the mean over the hemisphere, weighted by the cosine, of Schlick's reflectance from that
/// at normal and at grazing incidence.
#[inline(always)]
pub fn mean_schlick(normal: Vec3, grazing: Vec3) -> Vec3 {
    normal + (grazing - normal) * (1.0 / 21.0)
}

/// Returns the grazing part g of a rough boundary's reflectance: with reflectance f at normal
/// incidence, single scattering reflects f (1 - [lost](lost_share)) + (1 - f) g. It is the
/// boundary's albedo, seen at `cos`, for the reflectance (1 - v·h)⁵, the part of Schlick's form
/// that depends on the angle, less the same part of what is lost.
///
/// g is a fit: 0.002 below to 0.006 above the integral for cosines of at least 0.1, to 0.03 above
/// for cosines of at least 0.03, and to 0.13 above at grazing angles. It leans to the side above,
/// so that hardly more than all light is reflected.
#[inline(always)]
pub fn grazing_share(cos: f32, terms: &GrazingTerms) -> f32 {
    let x = max(1.0 - cos, 0.0);
    let (x2, c) = (x * x, terms.powers);
    let x4 = x2 * x2;
    let x8 = x4 * x4;
    let fit = c.x * x2 + c.y * (x4 * x) + c.z * (x8 * x) + c.w * (x8 * x4 * x2);
    min(max(fit, 0.0), 1.0)
}

/// Terms of [`grazing_share`] that depend on the roughness alone. (Vectors begin rows of 16 bytes:
/// naga lays records out so.)
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub struct GrazingTerms {
    /// Coefficients of (1 - cos) to the powers 2, 5, 9 and 14.
    powers: Vec4,
}

impl GrazingTerms {
    /// Returns the terms of a roughness.
    #[inline(always)]
    pub fn of(roughness: f32) -> Self {
        let r2 = roughness * roughness;
        let r4 = r2 * r2;
        let wide = 1.0 / (1.0 + 10.0 * r2);
        let (a, b, c) = (1.0 / (1.0 + 10.0 * r4), 1.0 / (1.0 + 100.0 * r4), 1.0 / (1.0 + 1000.0 * r4));
        let powers = Vec4::new(0.171_03, -1.671_04, 4.311_46, -3.391_71)
            + Vec4::new(-0.111_54, 1.192_27, -3.085_66, 2.430_51) * roughness
            + Vec4::new(-0.639_37, 5.739_97, -15.175_25, 12.575_51) * wide
            + Vec4::new(0.200_7, -0.252_63, 0.886_04, -0.901_85) * a
            + Vec4::new(0.028_66, -0.641_17, 4.568_1, -4.606_72) * b
            + Vec4::new(0.249_03, -2.186_83, 5.375_24, -3.614_09) * c;
        Self { powers }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::microfacet::{facing_area, sample_visible_normal};
    use crate::rng::PathKey;

    /// Returns the share of light that visible facets lose at once, and their albedo for the
    /// reflectance (1 - v·h)⁵.
    fn sampled(cos: f32, roughness: f32) -> (f64, f64) {
        let alpha = roughness * roughness;
        let o = Vec3::new(sqrt(1.0 - cos * cos), 0.0, cos);
        let (mut kept, mut grazing) = (0.0, 0.0);
        let count = 100_000;
        for pixel in 0..count {
            let random = PathKey { seed: 3, pixel, sample: 0 }.words(0);
            let h = sample_visible_normal(o, alpha, random.x, random.y);
            let facing = o.dot(h);
            let i = h * (2.0 * facing) - o;
            if facing > 0.0 && i.z > 0.0 {
                let (to_o, to_i) = (facing_area(o.z, alpha), facing_area(i.z, alpha));
                let seen = f64::from(to_o * i.z * (1.0 / (to_o * i.z + o.z * (to_i - i.z))));
                kept += seen;
                grazing += seen * f64::from(1.0 - facing.min(1.0)).powi(5);
            }
        }
        (1.0 - kept / f64::from(count), grazing / f64::from(count))
    }

    #[test]
    fn the_fits_are_near_and_on_the_safe_side() {
        // Of the samples: 5 sigma of a mean of numbers from 0 to 1.
        let noise = 5.0 * 0.5 / f64::from(100_000u32).sqrt();
        for roughness in [0.1f32, 0.25, 0.45, 0.6, 0.85, 1.0] {
            for cos in [0.01f32, 0.05, 0.15, 0.4, 0.75, 1.0] {
                let (lost, grazing) = sampled(cos, roughness);
                let apart = lost - f64::from(lost_share(cos, roughness));
                assert!((-noise..0.007 + noise).contains(&apart), "{roughness} {cos}: {lost} {apart}");
                let most = if cos < 0.03 {
                    0.13
                } else if cos < 0.1 {
                    0.033
                } else {
                    0.0065
                };
                let least = if cos < 0.03 { -0.015 } else { -0.002 };
                let above = f64::from(grazing_share(cos, &GrazingTerms::of(roughness))) - grazing;
                let range = least - noise..most + noise;
                assert!(range.contains(&above), "{roughness} {cos}: {grazing} {above}");
            }
        }
        // Negative control: roughness taken for alpha.
        assert!((sampled(0.4, 0.5).0 - f64::from(lost_share(0.4, 0.5f32.sqrt()))).abs() > 0.05);
    }

    #[test]
    fn the_mean_is_that_of_the_fit() {
        for step in 1..=20 {
            let (roughness, count) = (step as f32 / 20.0, 2000);
            let mut lost = 0.0;
            for place in 0..count {
                let cos = (place as f32 + 0.5) / count as f32;
                lost += f64::from(2.0 * cos * lost_share(cos, roughness)) / f64::from(count);
            }
            assert!((lost - f64::from(mean_lost_share(roughness))).abs() < 0.0015, "{roughness}: {lost}");
        }
    }

    #[test]
    fn numbers_stay_shares_everywhere() {
        for r in 0..=100 {
            for c in 0..=100 {
                let (roughness, cos) = (r as f32 / 100.0, (c as f32 / 100.0).max(1e-6));
                for share in [lost_share(cos, roughness), grazing_share(cos, &GrazingTerms::of(roughness))] {
                    assert!((0.0..=1.0).contains(&share), "{roughness} {cos}: {share}");
                }
            }
        }
    }
}
