//! Selection of the kernel: its features are those that the scene and the settings need, and the
//! traversal and the schedule that the settings name or that are fastest on the device.

use crate::settings::{KernelFeatures, Settings, SettingsError};
use trisect_device::{Schedule, Traversal};
use trisect_kernels::{EntryPoint, feature_names, render_kernel};
use trisect_shared::features::{
    CHOICES, EMITTERS, ENVIRONMENT, Features, LIGHT_TREE, NEE, NEEDS, PADDED_BOXES, PORTALS, PUNCTUAL,
    REFRACTED_LIGHT,
};

/// Returns the kernel for a scene with these features. Where the settings name no traversal or
/// schedule, `best` chooses by the kernel's features. `wide` is true if there is a wide BVH.
///
/// # Errors
///
/// [`SettingsError::NoWideTree`] if the settings name a traversal of a tree that is not there;
/// [`SettingsError::FeaturesLack`] and [`SettingsError::FeaturesDiffer`] if they name features with
/// which the image would be another.
pub(super) fn choose(
    scene: Features,
    settings: &Settings,
    best: impl Fn(Features) -> (Traversal, Schedule),
    wide: bool,
) -> Result<EntryPoint, SettingsError> {
    let needed = needed(scene, settings);
    let features = match settings.features {
        KernelFeatures::Needed => needed,
        KernelFeatures::Also(named) => checked(needed | named, needed)?,
        KernelFeatures::Exactly(named) => checked(named, needed)?,
    };
    let (traversal, schedule) = best(features);
    let traversal = match settings.traversal {
        Some(Traversal::Wide) if !wide => return Err(SettingsError::NoWideTree),
        Some(traversal) => traversal,
        None if traversal == Traversal::Wide && !wide => Traversal::Stack,
        None => traversal,
    };
    let schedule = settings.schedule.unwrap_or(schedule);
    Ok(render_kernel(features | traversal.features() | schedule.features()))
}

/// Returns the features that a kernel needs for a scene with these features and for the settings.
fn needed(scene: Features, settings: &Settings) -> Features {
    let has_lights = scene & (EMITTERS | PUNCTUAL | ENVIRONMENT | PORTALS) != 0;
    let nee = if settings.light_sampling && has_lights { NEE } else { 0 };
    let unused = if settings.light_sampling { 0 } else { PUNCTUAL | LIGHT_TREE | REFRACTED_LIGHT | PORTALS };
    (scene & !unused) | nee | settings.needed_features()
}

/// Returns the features that the settings name, if a kernel with them renders what needs `needed`.
fn checked(named: Features, needed: Features) -> Result<Features, SettingsError> {
    let missing = needed & NEEDS & !named;
    if missing != 0 {
        return Err(SettingsError::FeaturesLack { missing: feature_names(missing) });
    }
    let other = (named ^ needed) & CHOICES;
    if other != 0 {
        return Err(SettingsError::FeaturesDiffer { other: feature_names(other) });
    }
    // A scene without padded boxes, a light tree, glass before a light, or portals, has none.
    let of_scene = PADDED_BOXES | LIGHT_TREE | REFRACTED_LIGHT | PORTALS;
    Ok(named & !of_scene | named & needed & of_scene)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use crate::render::{Fresnel, Renderer, Sampler};
    use trisect_device::cpu::Cpu;
    use trisect_scene::Scene;
    use trisect_shared::bsdf::{DIELECTRIC, LAMBERTIAN, METAL};
    use trisect_shared::features::{
        AOVS, LINEAR, PERSISTENT, REGENERATE, ROULETTE, SCHLICK, SOBOL, SPHERES, TEXTURES, TRIANGLES, WIDE,
        of_material,
    };

    const DEFAULT: (Traversal, Schedule) = (Traversal::Stack, Schedule::Regenerate);

    fn settings() -> Settings {
        let scene = Scene::hello_world().unwrap_or_else(|error| panic!("{error}"));
        Settings { sampler: Sampler::Independent, ..Settings::of(&scene) }
    }

    fn features(scene: Features, settings: &Settings) -> Result<Features, SettingsError> {
        choose(scene, settings, |_| DEFAULT, false).map(|kernel| kernel.features)
    }

    /// A kernel has what scene and settings need, and nothing else.
    #[test]
    fn features_are_those_needed() {
        assert_eq!(features(SPHERES, &settings()), Ok(SPHERES | REGENERATE));
        let all = Settings {
            roulette: true,
            guides: true,
            sampler: Sampler::Sobol,
            fresnel: Fresnel::Schlick,
            ..settings()
        };
        let choices = ROULETTE | AOVS | SOBOL | SCHLICK;
        assert_eq!(features(TRIANGLES | TEXTURES, &all), Ok(TRIANGLES | TEXTURES | choices | REGENERATE));
    }

    /// Without light sampling nothing is connected to lights.
    #[test]
    fn light_sampling_is_a_feature() {
        let off = Settings { light_sampling: false, ..settings() };
        assert_eq!(features(PUNCTUAL, &settings()), Ok(PUNCTUAL | NEE | REGENERATE));
        assert_eq!(features(PUNCTUAL, &off), Ok(REGENERATE));
        assert_eq!(features(EMITTERS, &off), Ok(EMITTERS | REGENERATE));
    }

    #[test]
    fn traversal_and_schedule_are_those_named() {
        for (traversal, bits) in [(Traversal::Linear, LINEAR), (Traversal::Stack, 0)] {
            for (schedule, of) in [(Schedule::Pixel, 0), (Schedule::Persistent, REGENERATE | PERSISTENT)] {
                let named = Settings { traversal: Some(traversal), schedule: Some(schedule), ..settings() };
                assert_eq!(features(SPHERES, &named), Ok(SPHERES | bits | of));
            }
        }
    }

    #[test]
    fn the_wide_tree_is_traced_where_there_is_one() {
        let of = |traversal, wide| {
            let settings = Settings { traversal, ..settings() };
            let default = (Traversal::Wide, Schedule::Regenerate);
            choose(SPHERES, &settings, |_| default, wide).map(|kernel| kernel.features & (WIDE | LINEAR))
        };
        assert_eq!(of(None, true), Ok(WIDE));
        assert_eq!(of(Some(Traversal::Wide), true), Ok(WIDE));
        assert_eq!(of(Some(Traversal::Stack), true), Ok(0));
        assert_eq!(of(Some(Traversal::Linear), true), Ok(LINEAR));
        assert_eq!(of(None, false), Ok(0));
        assert_eq!(of(Some(Traversal::Wide), false), Err(SettingsError::NoWideTree));
    }

    /// The negative control of that check: a kernel that lacks a feature of the scene renders
    /// another image.
    #[test]
    fn a_missing_feature_changes_the_image() {
        let scene = Scene::hello_world().unwrap();
        let settings = settings().size(32, 18).spp(4);
        let image = |forgotten| {
            let mut renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
            renderer.scene.forget_features(forgotten);
            renderer.render(&settings).unwrap().film.image()
        };
        let want = image(0);
        assert_eq!(image(TRIANGLES | TEXTURES).pixels, want.pixels);
        for forgotten in [METAL, DIELECTRIC].map(of_material) {
            assert_ne!(image(forgotten).pixels, want.pixels, "{}", feature_names(forgotten));
        }
    }

    /// Features that the settings name must suffice, and must not change the image.
    #[test]
    fn named_features_must_render_the_scene() {
        let exactly = |features| Settings { features: KernelFeatures::Exactly(features), ..settings() };
        let named = |named, scene| features(scene, &exactly(named));
        assert_eq!(named(SPHERES | TEXTURES, SPHERES), Ok(SPHERES | TEXTURES | REGENERATE));
        let padded = |boxes| named(SPHERES | PADDED_BOXES, SPHERES | boxes);
        assert_eq!(padded(PADDED_BOXES), Ok(SPHERES | PADDED_BOXES | REGENERATE));
        assert_eq!(padded(0), Ok(SPHERES | REGENERATE));
        let lacks = |missing: &str| Err(SettingsError::FeaturesLack { missing: missing.to_owned() });
        assert_eq!(
            named(SPHERES | of_material(LAMBERTIAN), SPHERES | TRIANGLES | EMITTERS),
            lacks("triangles,emitters,nee")
        );
        let differ = |other: &str| Err(SettingsError::FeaturesDiffer { other: other.to_owned() });
        assert_eq!(named(SPHERES | SOBOL, SPHERES), differ("sobol"));
        let sobol = Settings { sampler: Sampler::Sobol, ..exactly(SPHERES) };
        assert_eq!(features(SPHERES, &sobol), differ("sobol"));
        let also = |features| Settings { features: KernelFeatures::Also(features), ..settings() };
        assert_eq!(features(SPHERES, &also(TEXTURES)), Ok(SPHERES | TEXTURES | REGENERATE));
        assert_eq!(features(SPHERES, &also(SOBOL)), differ("sobol"));
    }
}
