//! Albedo of a rough boundary of glass: the part of the light that its GGX facets reflect and
//! refract at once. For [`crate::bsdf`], which scales by its inverse what leaves at once, so that
//! no light is lost to other facets (Turquin, "Practical Multiple Scattering Compensation for
//! Microfacet Models", 2019, for reflection and refraction together).
//!
//! The scale depends on the viewer alone, so it is not reciprocal; but as the index goes to 1 all
//! light goes straight on, as it must, where the additional lobe of Kulla and Conty (2017) would
//! scatter up to 0.4 of it by the cosine. Factors for both directions that make the sum of each
//! side 1 (Sinkhorn and Knopp, 1967) are reciprocal, but range from 0.02 to 47 at roughness 1.
//!
//! The fit is a sum of terms z / (1 + |z|), with z linear in the inputs, one sum for each side. It
//! is fitted by least squares to integrals over the visible normals, with height-correlated
//! masking, for roughness 0.05 to 1, cosines 0.002 to 1 and indices 1.03 to 3 of the denser side
//! to the other.

use crate::math::{dot4, max, min, sqrt};
use glam::Vec4;

/// Factors of the fits from inside and from outside: margins, so that hardly more than all light
/// is scattered.
const FACTORS: [f32; 2] = [1.006, 1.005];

/// Least albedo. That of an index below 1.1 is less from inside at grazing angles: such glass loses
/// more.
const MIN_ALBEDO: f32 = 0.2;

/// Greatest ratio of the indices that was fitted; above it the albedo hardly changes.
const MAX_RATIO: f32 = 3.0;

/// Returns the albedo by single scattering of a boundary of glass, seen from cosine `cos`: 0.02
/// below to 0.02 above the integral for indices of at least 1.2 and cosines of at least 0.03.
/// `height` is the [stretched](crate::microfacet::stretched_height) one, `eta` the ratio of the
/// indices, incident over refracted.
#[inline(always)]
pub fn glass_albedo(cos: f32, height: f32, roughness: f32, eta: f32) -> f32 {
    let is_inside = eta > 1.0;
    let ratio = min(if is_inside { eta } else { 1.0 / eta }, MAX_RATIO);
    let inverse = 1.0 / ratio;
    // Cosine of the critical angle.
    let critical = sqrt(max((1.0 - inverse) * (1.0 + inverse), 0.0));
    let beyond = (cos - critical) * (1.0 / (roughness * roughness + 0.1));
    let at = Inputs { height, roughness, critical, cos, beyond };
    let fit = if is_inside {
        FACTORS[0]
            * (INSIDE[0].sum(at) + INSIDE[1].sum(at) + INSIDE[2].sum(at) + INSIDE[3].sum(at) + CONSTANTS[0])
    } else {
        FACTORS[1] * (OUTSIDE[0].sum(at) + OUTSIDE[1].sum(at) + OUTSIDE[2].sum(at) + CONSTANTS[1])
    };
    // Smooth surfaces lose nothing.
    let rough = min(max((roughness - 0.05) * 20.0, 0.0), 1.0);
    1.0 - (1.0 - min(max(fit, MIN_ALBEDO), 1.0)) * rough
}

/// Inputs of the fit.
#[derive(Clone, Copy, Debug)]
struct Inputs {
    height: f32,
    roughness: f32,
    critical: f32,
    cos: f32,
    beyond: f32,
}

/// Four terms of the fit: their factors of each input, and of each term. (Vectors begin rows of 16
/// bytes: naga lays records out so.)
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
struct Terms {
    height: Vec4,
    roughness: Vec4,
    critical: Vec4,
    cos: Vec4,
    beyond: Vec4,
    constant: Vec4,
    weight: Vec4,
}

impl Terms {
    /// Returns the sum of the terms.
    #[inline(always)]
    fn sum(self, at: Inputs) -> f32 {
        let z = self.height * at.height
            + self.roughness * at.roughness
            + self.critical * at.critical
            + self.cos * at.cos
            + self.beyond * at.beyond
            + self.constant;
        soft_sum(z, self.weight)
    }
}

/// Returns the weighted sum of z / (1 + |z|).
#[inline(always)]
pub(crate) fn soft_sum(z: Vec4, weight: Vec4) -> f32 {
    let inverse = Vec4::new(
        1.0 / (1.0 + z.x.abs()),
        1.0 / (1.0 + z.y.abs()),
        1.0 / (1.0 + z.z.abs()),
        1.0 / (1.0 + z.w.abs()),
    );
    dot4(z * inverse, weight)
}

/// Constants of the fits from inside and from outside.
const CONSTANTS: [f32; 2] = [0.537_54, 0.802_89];

/// Terms from the denser side.
const INSIDE: [Terms; 4] = [
    Terms {
        height: Vec4::new(-0.789_75, -0.043_215, -74.075, 0.731_01),
        roughness: Vec4::new(-0.483_44, -0.321_86, -18.201, 0.851_36),
        critical: Vec4::new(-0.940_36, 0.338_76, -81.404, 0.833_32),
        cos: Vec4::new(0.559_07, 0.016_65, 100.87, -0.310_73),
        beyond: Vec4::new(0.202_08, -0.105_83, -45.182, 0.116_54),
        constant: Vec4::new(1.6216, -0.078_885, 67.949, -1.8045),
        weight: Vec4::new(-5.1995, 2.528, -0.007_208, -1.473),
    },
    Terms {
        height: Vec4::new(-0.298_84, 1.891, -7.9289, 0.751_91),
        roughness: Vec4::new(-0.463_62, -0.474_73, -0.229_74, 0.558_53),
        critical: Vec4::new(0.798_87, 3.6573, 1.8593, 0.831_18),
        cos: Vec4::new(-0.665_46, 0.970_04, 1.2243, -0.441_32),
        beyond: Vec4::new(-0.035_507, -0.281_25, 1.0423, -0.2221),
        constant: Vec4::new(0.182_47, -0.174_21, -0.539_08, -1.6146),
        weight: Vec4::new(-0.589_36, -4.0527, 0.556_14, -4.9974),
    },
    Terms {
        height: Vec4::new(-0.575_03, -3.732, -0.296_95, -0.662_69),
        roughness: Vec4::new(0.008_383_1, 0.266_27, -0.776_75, -0.397_08),
        critical: Vec4::new(-0.865_66, -3.0502, 0.762_24, 0.032_389),
        cos: Vec4::new(0.136_86, -2.768, -0.001_279_2, 0.126_79),
        beyond: Vec4::new(0.069_415, 0.694_01, -0.009_543_1, -0.136_13),
        constant: Vec4::new(1.0176, 0.271_59, 0.220_23, 0.725_16),
        weight: Vec4::new(0.841_82, -4.449, 0.954_72, -1.503),
    },
    Terms {
        height: Vec4::new(-12.253, -0.343_75, 0.455_32, 1.5903),
        roughness: Vec4::new(6.0067, -0.336_59, -0.1658, -0.607_49),
        critical: Vec4::new(27.223, -0.244_94, 0.161_32, -0.343_03),
        cos: Vec4::new(-15.165, 0.117_69, -0.019_019, 0.392_11),
        beyond: Vec4::new(7.4552, -0.015_592, 0.004_131_5, -0.008_299_1),
        constant: Vec4::new(0.094_193, 0.584_33, -0.420_45, -1.2969),
        weight: Vec4::new(-0.004_046_3, -3.0685, -2.5992, 0.782_15),
    },
];

/// Terms from the other side.
const OUTSIDE: [Terms; 3] = [
    Terms {
        height: Vec4::new(-0.097_989, 2.6659, 67.023, 0.164_26),
        roughness: Vec4::new(-0.165_79, -0.157_41, 1.3526, -0.184_55),
        critical: Vec4::new(-0.267_47, -0.029_959, -1.4384, -0.113_26),
        cos: Vec4::new(0.011_314, -0.955_76, -37.213, 0.2037),
        beyond: Vec4::new(0.006_549_8, 0.000_941_64, -2.4279, -0.000_945_28),
        constant: Vec4::new(0.396_19, -2.8986, -1.9025, 0.075_652),
        weight: Vec4::new(-2.8626, 1.2378, -0.286_75, 2.1025),
    },
    Terms {
        height: Vec4::new(0.2451, -0.946_37, -0.163_59, 1292.5),
        roughness: Vec4::new(0.372_24, 0.099_757, -0.069_42, -3255.4),
        critical: Vec4::new(2.4418, -2.3394, 0.064_531, 7019.1),
        cos: Vec4::new(-0.010_047, 0.078_09, -0.495_67, -6777.6),
        beyond: Vec4::new(0.031_081, -0.079_575, -0.003_731_9, 1632.3),
        constant: Vec4::new(-2.6179, 2.9883, 0.143_51, -1628.8),
        weight: Vec4::new(0.331_38, -0.8767, -1.6757, 0.001_364_8),
    },
    Terms {
        height: Vec4::new(-0.098_392, -0.218_61, 0.619_23, -0.466_51),
        roughness: Vec4::new(-0.279_93, -0.531_96, -0.099_144, 0.344_37),
        critical: Vec4::new(0.261_65, -1.4546, 2.8551, -0.339_97),
        cos: Vec4::new(-0.414_81, -0.1214, -0.063_801, 0.365_58),
        beyond: Vec4::new(0.032_417, -0.043_59, 0.059_616, -0.032_359),
        constant: Vec4::new(0.118, 2.3353, -3.1381, 0.415_94),
        weight: Vec4::new(3.9944, 2.112, -0.664_82, 2.9753),
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fresnel;
    use crate::microfacet::{facing_area, sample_visible_normal, stretched_height};
    use crate::rng::PathKey;
    use glam::Vec3;

    fn fit(cos: f32, roughness: f32, eta: f32) -> f32 {
        let (alpha, o) = (roughness * roughness, Vec3::new(sqrt(1.0 - cos * cos), 0.0, cos));
        glass_albedo(cos, stretched_height(o, alpha, alpha), roughness, eta)
    }

    /// Returns the share of light that visible facets reflect and refract at once.
    fn sampled(cos: f32, roughness: f32, eta: f32) -> f64 {
        let alpha = roughness * roughness;
        let o = Vec3::new(sqrt(1.0 - cos * cos), 0.0, cos);
        let (mut kept, count) = (0.0, 100_000);
        for pixel in 0..count {
            let random = PathKey { seed: 4, pixel, sample: 0 }.words(0);
            let h = sample_visible_normal(o, alpha, random.x, random.y);
            let facing = o.dot(h).min(1.0);
            if facing <= 0.0 {
                continue;
            }
            let cos2 = fresnel::refracted_cos2(facing, eta);
            let f = if cos2 > 0.0 { fresnel::dielectric(facing, sqrt(cos2), eta) } else { 1.0 };
            let seen = |z: f32| {
                let (to_o, to_i) = (facing_area(o.z, alpha), facing_area(z, alpha));
                if z > 0.0 { to_o * z * (1.0 / (to_o * z + o.z * (to_i - z))) } else { 0.0 }
            };
            kept += f64::from(f * seen(2.0 * facing * h.z - o.z));
            if cos2 > 0.0 {
                kept += f64::from((1.0 - f) * seen(eta * o.z - h.z * (eta * facing - sqrt(cos2))));
            }
        }
        kept / f64::from(count)
    }

    #[test]
    fn the_fit_is_near_and_on_the_safe_side() {
        // Of the samples: 5 sigma of a mean of numbers from 0 to 1.
        let noise = 5.0 * 0.5 / f64::from(100_000u32).sqrt();
        for roughness in [0.1f32, 0.25, 0.45, 0.6, 0.85, 1.0] {
            for cos in [0.03f32, 0.1, 0.25, 0.5, 0.75, 1.0] {
                for ior in [1.2f32, 1.33, 1.5, 1.9, 2.4, 3.0] {
                    for eta in [ior, 1.0 / ior] {
                        let kept = sampled(cos, roughness, eta);
                        let above = f64::from(fit(cos, roughness, eta)) - kept;
                        let range = -0.02 - noise..0.02 + noise;
                        assert!(range.contains(&above), "{roughness} {cos} {eta}: {kept} {above}");
                    }
                }
            }
        }
        // Negative control: the other side's.
        assert!((sampled(1.0, 1.0, 1.5) - f64::from(fit(1.0, 1.0, 1.0 / 1.5))).abs() > 0.1);
    }

    #[test]
    fn it_is_a_share_everywhere() {
        for (r, c) in (0..=50).flat_map(|r| (0..=50).map(move |c| (r, c))) {
            let (roughness, cos) = (r as f32 / 50.0, (c as f32 / 50.0).max(1e-6));
            for eta in [1e-3, 0.3, 0.7, 0.999, 1.0, 1.001, 1.1, 1.5, 4.0, 1e3] {
                let share = fit(cos, roughness, eta);
                assert!((MIN_ALBEDO - 1e-6..=1.0).contains(&share), "{roughness} {cos} {eta}: {share}");
                assert!(share == 1.0 || roughness > 0.05);
            }
        }
    }
}
