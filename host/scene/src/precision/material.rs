//! Checks indices of refraction that f32 does not resolve.
//!
//! Near 1 the difference x = n - 1 matters. Rounding of n and 1 / n changes it by about u = 2⁻²⁴,
//! so Fresnel's reflectance, about x² / 4 at normal incidence, is off by 1.5 u / x of itself. Far
//! from 1, on the side of the larger index n, light passes within a cone of sin² = 1 / n², where
//! the cosine is within 1 / (2 n²) of 1. Its rounding changes the squared cosine of refraction,
//! 1 - n² sin², by 3 n² u. Measured errors agree (docs/reference/supported-ranges.md).

use super::finding::{Finding, Limit, Predicted, Severity, Supported, Unit};
use super::{RELATIVE, ROUNDING};
use crate::SceneDocument;
use crate::part_names as names;

const NEAR_ONE: &str =
    "leave the object out, or give it an ior of exactly 1: at normal incidence it reflects less than 2e-9";
const EXTREME: &str = "use an ior between 1/74 and 74; for a mirror, a Metal or a Conductor";

pub(super) fn check(scene: &SceneDocument, found: &mut Vec<Finding>) {
    for material in &scene.description.materials {
        let Some(ior) = material.surface.glass_ior() else { continue };
        let what = || names::material(&material.name);
        let difference = (ior - 1.0).abs();
        let near = 1.5 * ROUNDING / difference;
        if difference > 0.0 && near > RELATIVE {
            found.push(Finding {
                limit: Limit::IorNearOne,
                severity: Severity::Warning,
                triangles: None,
                what: what(),
                quantity: "difference of ior and 1",
                measured: difference,
                supported: Supported::AtLeast(1.5 * ROUNDING / RELATIVE),
                predicted: Predicted::share(near, Unit::Reflectance),
                remedy: NEAR_ONE,
            });
        }
        let contrast = ior.max(1.0 / ior);
        let extreme = 3.0 * contrast * contrast * ROUNDING;
        if extreme > RELATIVE {
            found.push(Finding {
                limit: Limit::IorExtreme,
                severity: Severity::Warning,
                triangles: None,
                what: what(),
                quantity: "ior or its inverse",
                measured: contrast,
                supported: Supported::AtMost((RELATIVE / (3.0 * ROUNDING)).sqrt()),
                predicted: Predicted::share(extreme, Unit::SquaredCosine),
                remedy: EXTREME,
            });
        }
    }
}
