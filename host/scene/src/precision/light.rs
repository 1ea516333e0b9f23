//! Checks radiance against the range of the film's sums.
//!
//! A chunk sums radiance and its square over up to 256 samples in f32. The squares overflow beyond
//! √(MAX / 256) = 1.15e18, and the variance is lost. Beyond MAX / 256 = 1.33e36 the sum of radiance
//! becomes infinite, and beyond MAX the sample itself, which is left out. Below √MIN_POSITIVE =
//! 1.08e-19 the squares are subnormal, off by 2⁻¹⁵⁰ each, and 0 on a device that flushes them.

use super::finding::{Finding, Limit, Predicted, Severity, Supported, Unit};
use super::{ROUNDING, closest, geometry};
use crate::SceneDocument;
use crate::description::PunctualLight;
use crate::part_names as names;
use std::f64::consts::PI;
use trisect_shared::film::CHUNK_SAMPLES;

const BRIGHT: &str =
    "lower all lights by one factor: the image is darker by that factor and otherwise the same";
const NEAR: &str = "move the light away from the surface, give it an area (an emitting Sphere), or lower all lights by one factor";
const DIM: &str =
    "raise all lights by one factor: the image is brighter by that factor and otherwise the same";

/// Maximum number of lights without extent that are checked, the strongest first. Each is compared
/// with all surfaces.
const BRIGHTEST: usize = 16;

/// Returns the maximum radiance for which the sum of squares over a chunk is finite.
pub(super) fn brightest() -> f64 {
    (f64::from(f32::MAX) / f64::from(CHUNK_SAMPLES)).sqrt()
}

/// Returns the minimum radiance whose square is a normal number.
pub(super) fn dimmest() -> f64 {
    f64::from(f32::MIN_POSITIVE).sqrt()
}

fn bright(what: String, quantity: &'static str, radiance: f64, remedy: &'static str) -> Option<Finding> {
    let of =
        if radiance > f64::from(f32::MAX) / f64::from(CHUNK_SAMPLES) { Unit::Mean } else { Unit::Variance };
    (radiance > brightest()).then(|| Finding {
        limit: Limit::TooBright,
        severity: Severity::Warning,
        triangles: None,
        what,
        quantity,
        measured: radiance,
        supported: Supported::AtMost(brightest()),
        predicted: Predicted::share(1.0, of),
        remedy,
    })
}

pub(super) fn check(scene: &SceneDocument, found: &mut Vec<Finding>) {
    const EMITTED: &str = "emitted radiance";
    let description = &scene.description;
    let mut greatest = (0.0, String::new());
    let mut see = |radiance: f64, what: &dyn Fn() -> String| {
        if radiance > greatest.0 {
            greatest = (radiance, what());
        }
    };
    for material in &description.materials {
        let (radiance, what) = (material.emission.max_element(), || names::material(&material.name));
        see(radiance, &what);
        found.extend(bright(what(), EMITTED, radiance, BRIGHT));
    }
    if let Some(from) = &description.sky {
        let radiance = from.max_radiance();
        see(radiance, &|| "sky".to_owned());
        found.extend(bright("sky".to_owned(), EMITTED, radiance, BRIGHT));
    }
    let punctual = description.lights.iter().any(|light| strength(light) > 0.0);
    let mut lights: Vec<(usize, &PunctualLight)> = description.lights.iter().enumerate().collect();
    lights.sort_by(|a, b| strength(b.1).total_cmp(&strength(a.1)));
    for (index, light) in lights.into_iter().take(BRIGHTEST) {
        if let Some(radiance) = reflected(scene, light) {
            found.extend(bright(
                names::light(index),
                "radiance of a white surface at the distance of the nearest surface",
                radiance,
                NEAR,
            ));
        }
    }
    let (radiance, what) = greatest;
    if radiance > 0.0 && radiance < dimmest() && !punctual {
        found.push(Finding {
            limit: Limit::TooDim,
            severity: Severity::Warning,
            triangles: None,
            what: format!("{what}, the brightest"),
            quantity: EMITTED,
            measured: radiance,
            supported: Supported::AtLeast(dimmest()),
            predicted: Predicted::share(2f64.powi(-150) / (radiance * radiance), Unit::Variance),
            remedy: DIM,
        });
    }
}

/// Returns the largest channel of a light's strength.
fn strength(light: &PunctualLight) -> f64 {
    light.strength().max_element()
}

/// Returns the radiance of a white diffuse surface that faces the light at the distance of the
/// nearest surface: intensity / (π distance²). `None` if a surface would have to be nearer than the
/// rounding of positions to be too bright.
fn reflected(scene: &SceneDocument, light: &PunctualLight) -> Option<f64> {
    let intensity = strength(light);
    let Some(position) = light.position() else { return Some(intensity / PI) };
    let near = (intensity / (PI * brightest())).sqrt();
    if near <= ROUNDING * geometry::distance(scene.space, position) || near == 0.0 {
        return None;
    }
    // In the scene's lengths and intensities: their ratio is equal in every space.
    Some(intensity / (PI * closest::to_scene(position, &scene.description).powi(2)))
}
