//! Light that GGX facets send to other facets, if they are stretched more along the tangent than
//! across it. For [`crate::bsdf`].
//!
//! The visible facets of a direction are those of a hemisphere, seen from the stretched direction:
//! so the loss is that of [`microfacet_albedo`](crate::microfacet_albedo) from the stretched
//! height, for the root mean square of the alphas, within 0.05. A correction is in proportion to
//! the difference of the alphas: a sum of terms z / (1 + |z|), with z linear in the inputs, fitted
//! by least squares to integrals over the visible normals, for alphas 0.02 to 1 and cosines 0.01
//! to 1.

use crate::glass_albedo::soft_sum;
use crate::math::{max, min, sqrt};
use crate::microfacet::stretched_height;
use crate::microfacet_albedo::{lost_share_at, mean_lost_share};
use glam::{Vec3, Vec4};

/// Least alpha of the fits; facets of less lose what those of this alpha do.
const MIN_ALPHA: f32 = 0.02;

/// Margin of the fit, for each unit of the alphas' difference: no light is added.
const MARGIN: f32 = 0.008;

/// Further margin where facets are narrow.
const NARROW_MARGIN: f32 = 0.06;

/// Returns what [`lost_share`](crate::microfacet_albedo::lost_share) does, for the direction `v`
/// and the alphas `x` along and `y` across the tangent, x ≥ y: 0.032 below to 0.004 above the
/// integral.
#[inline(always)]
pub fn stretched_lost_share(v: Vec3, x: f32, y: f32) -> f32 {
    let (height, y_given) = (stretched_height(v, x, y), y);
    let (x, y) = (max(x, MIN_ALPHA), max(y, MIN_ALPHA));
    // Square of the alpha along the direction, which has none at the normal.
    let (a, b) = (v.x * x, v.y * y);
    let along2 = min(max((a * a + b * b) * (1.0 / max(v.x * v.x + v.y * v.y, 1e-9)), y * y), x * x);
    let mean = sqrt(0.5 * (x * x + y * y));
    let (along, roughness, stretch) = (sqrt(along2), sqrt(mean), (x - y) * (1.0 / (x + y)));
    let at = Inputs { height, along, roughness, stretch };
    // Where facets are narrow across the tangent, the loss changes fast at grazing angles.
    let narrow =
        max(1.0 - y_given * 33.0, 0.0) * max(1.0 - v.z.abs() * 7.0, 0.0) * max(1.0 - along * 5.0, 0.0);
    let correction = TERMS[0].sum(at) + TERMS[1].sum(at) + (CONSTANT - MARGIN - NARROW_MARGIN * narrow);
    min(max(lost_share_at(height, roughness) + (x - y) * correction, 0.0), 1.0)
}

/// Returns the mean of [`stretched_lost_share`] over the hemisphere, weighted by the cosine, within
/// 0.007; at least 1e-3, so that a share can be divided by it.
#[inline(always)]
pub fn mean_stretched_lost_share(x: f32, y: f32) -> f32 {
    let (x, y) = (max(x, MIN_ALPHA), max(y, MIN_ALPHA));
    let r = sqrt(sqrt(0.5 * (x * x + y * y)));
    let stretch = (x - y) * (1.0 / (x + y));
    let plain = -0.205_38 + r * (0.6397 + r * (-1.4507 + r * (1.4943 + r * -0.473_51)));
    let once = -0.173_63 + r * (1.4014 + r * (-1.5629 + r * 0.220_96));
    let twice = 0.101_42 + r * (-0.856_27 + r * 0.831_56);
    max(mean_lost_share(r) + (x - y) * (plain + stretch * (once + stretch * twice)), 1e-3)
}

/// Inputs of the correction.
#[derive(Clone, Copy, Debug)]
struct Inputs {
    /// Stretched height.
    height: f32,
    /// Alpha along the direction.
    along: f32,
    /// Root of the alphas' root mean square.
    roughness: f32,
    /// Difference of the alphas over their sum.
    stretch: f32,
}

/// Four terms of the correction: their factors of each input, and of each term. (Vectors begin rows
/// of 16 bytes: naga lays records out so.)
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
struct Terms {
    height: Vec4,
    along: Vec4,
    roughness: Vec4,
    stretch: Vec4,
    constant: Vec4,
    weight: Vec4,
}

impl Terms {
    /// Returns the sum of the terms.
    #[inline(always)]
    fn sum(self, at: Inputs) -> f32 {
        let z = self.height * at.height
            + self.along * at.along
            + self.roughness * at.roughness
            + self.stretch * at.stretch
            + self.constant;
        soft_sum(z, self.weight)
    }
}

const CONSTANT: f32 = -0.504_78;

const TERMS: [Terms; 2] = [
    Terms {
        height: Vec4::new(0.015_642, 0.2867, -0.004_466_9, 5.5494),
        along: Vec4::new(-0.801_63, -3.7733, 0.6923, -6.5055),
        roughness: Vec4::new(1.361, 1.4684, -1.1338, 1.3881),
        stretch: Vec4::new(2.1067, -1.4292, -1.8885, -3.4906),
        constant: Vec4::new(-0.5927, 0.110_75, 0.5727, -3.3292),
        weight: Vec4::new(11.503, 0.791_54, 10.32, -0.180_36),
    },
    Terms {
        height: Vec4::new(40.826, -0.371_02, 0.3716, -7.5546),
        along: Vec4::new(2.1904, -3.5146, -3.0452, 3.785),
        roughness: Vec4::new(-17.162, -0.872_73, 2.6763, -8.2744),
        stretch: Vec4::new(0.849_71, -0.171_66, -1.1691, -0.646_74),
        constant: Vec4::new(-30.567, 1.5511, -1.252, -1.7448),
        weight: Vec4::new(0.041_664, -0.151_34, -0.534_42, 0.787_88),
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::microfacet::{facing_area_along, sample_visible_normal_along};
    use crate::rng::PathKey;

    fn direction(cos: f32, azimuth: f32) -> Vec3 {
        let sine = sqrt(1.0 - cos * cos);
        Vec3::new(sine * azimuth.cos(), sine * azimuth.sin(), cos)
    }

    /// Returns the share of light that visible facets lose at once.
    fn sampled(o: Vec3, x: f32, y: f32) -> f64 {
        let (mut kept, count) = (0.0, 100_000);
        for pixel in 0..count {
            let random = PathKey { seed: 5, pixel, sample: 0 }.words(0);
            let h = sample_visible_normal_along(o, x, y, random.x, random.y);
            let i = h * (2.0 * o.dot(h)) - o;
            if o.dot(h) > 0.0 && i.z > 0.0 {
                let (to_o, to_i) = (facing_area_along(o, x, y), facing_area_along(i, x, y));
                kept += f64::from(to_o * i.z * (1.0 / (to_o * i.z + o.z * (to_i - i.z))));
            }
        }
        1.0 - kept / f64::from(count)
    }

    #[test]
    fn the_fit_is_near_and_on_the_safe_side() {
        // Of the samples: 5 sigma of a mean of numbers from 0 to 1.
        let noise = 5.0 * 0.5 / f64::from(100_000u32).sqrt();
        let mut worst_plain = 0.0f64;
        for (x, y) in [(0.05f32, 0.02f32), (0.3, 0.05), (0.45, 0.3), (0.7, 0.02), (0.8, 0.4), (1.0, 0.1)] {
            for (cos, azimuth) in [0.02f32, 0.1, 0.3, 0.6, 1.0]
                .into_iter()
                .flat_map(|c| [0.0f32, 0.6, 1.2, 1.57].map(|a| (c, a)))
            {
                let v = direction(cos, azimuth);
                let lost = sampled(v, x, y);
                let apart = f64::from(stretched_lost_share(v, x, y)) - lost;
                assert!((-0.032 - noise..0.004 + noise).contains(&apart), "{x} {y} {v}: {lost} {apart}");
                let alike = f64::from(lost_share_at(cos, sqrt(0.5 * (x + y))));
                worst_plain = worst_plain.max((alike - lost).abs());
            }
        }
        // Negative control: the mean alpha in all directions.
        assert!(worst_plain > 0.1, "{worst_plain}");
    }

    #[test]
    fn the_mean_is_that_of_the_fit() {
        for (x, y) in [(0.05f32, 0.02f32), (0.3, 0.001), (0.5, 0.4), (0.8, 0.1), (1.0, 0.01), (1.0, 0.5)] {
            let (mut mean, count) = (0.0, 200);
            for (c, a) in (0..count).flat_map(|c| (0..16).map(move |a| (c, a))) {
                let cos = (c as f32 + 0.5) / count as f32;
                let v = direction(cos, (a as f32 + 0.5) / 16.0 * core::f32::consts::FRAC_PI_2);
                mean += f64::from(2.0 * cos * stretched_lost_share(v, x, y)) / f64::from(16 * count);
            }
            let fit = f64::from(mean_stretched_lost_share(x, y));
            assert!((mean - fit).abs() < 0.0075, "{x} {y}: {mean} {fit}");
        }
    }
}
