//! Selection of the kernel: by the features that the scene needs, and by the traversal, the
//! schedule or the kernel variant that the settings name.

use crate::settings::{Settings, SettingsError};
use trisect_device::{Schedule, Traversal};
use trisect_kernels::{VARIANTS, Variant, variant, variant_by_name};
use trisect_shared::features::{
    AOVS, EMITTERS, ENVIRONMENT, Features, LINEAR, MICROFACETS, PERSISTENT, PLANAR, ROULETTE, SCHLICK, SOBOL,
    STRATEGY, TEXTURES, TRIANGLES, WIDE,
};

/// Returns the kernel for a scene with these features: the one that the settings name, or the
/// cheapest that supports them with the traversal and schedule of the settings. Where the settings
/// name no traversal or schedule, `best` chooses by the kernel's features, unless only a larger
/// kernel has that schedule. `wide` is true if there is a wide BVH: each kernel for the binary BVH
/// can trace it too.
pub(super) fn choose(
    scene: Features,
    settings: &Settings,
    best: impl Fn(Features) -> (Traversal, Schedule),
    wide: bool,
) -> Result<Variant, SettingsError> {
    let needed = scene | settings.features();
    let cheapest = of_traversal(scene, settings, (best(needed).0, Schedule::Regenerate), wide)?;
    if settings.schedule.is_some() || settings.variant.is_some() {
        return Ok(cheapest);
    }
    let size = |variant: Variant| variant.features & !(STRATEGY | ROULETTE | SCHLICK);
    let method = cheapest.features & (LINEAR | WIDE) | best(cheapest.features).1.features();
    let better = variant(needed | method).filter(|&better| size(better) == size(cheapest));
    Ok(better.unwrap_or(cheapest))
}

/// Returns the cheapest kernel with the traversal that the settings name, or with the default.
fn of_traversal(
    scene: Features,
    settings: &Settings,
    default: (Traversal, Schedule),
    wide: bool,
) -> Result<Variant, SettingsError> {
    let is_wide = |traversal| traversal == Traversal::Wide;
    let asked = settings.traversal.map_or(is_wide(default.0), is_wide);
    let default = (if is_wide(default.0) { Traversal::Stack } else { default.0 }, default.1);
    if !(wide && asked) {
        return among_built(scene, settings, default);
    }
    let traversal = settings.traversal.map(|_| Traversal::Stack);
    let mut variant = among_built(scene, &Settings { traversal, ..settings.clone() }, default)?;
    if Traversal::of(variant.features) == Traversal::Stack {
        variant.features |= WIDE;
    }
    Ok(variant)
}

/// Returns the cheapest prebuilt kernel for the scene and the settings. No prebuilt kernel is
/// listed with the wide BVH.
fn among_built(
    scene: Features,
    settings: &Settings,
    default: (Traversal, Schedule),
) -> Result<Variant, SettingsError> {
    let needed = scene | settings.features();
    if let Some(name) = settings.variant {
        let unknown = || SettingsError::NoSuchVariant { name: name.to_owned(), known: names(|_| true) };
        let variant = variant_by_name(name).ok_or_else(unknown)?;
        let missing = needed & !variant.features;
        let other = settings.traversal.is_some_and(|t| t != Traversal::of(variant.features))
            || settings.schedule.is_some_and(|s| s != Schedule::of(variant.features));
        return if !variant.supports(needed) || other {
            let missing = if missing != 0 {
                describe(missing)
            } else if variant.features & !needed & SOBOL != 0 {
                "the independent sampler".to_owned()
            } else if !variant.supports(needed) {
                "Fresnel's equations".to_owned()
            } else {
                "the `traversal` or `schedule` asked for".to_owned()
            };
            let able = names(|variant| variant.supports(needed));
            Err(SettingsError::VariantLacks { name: name.to_owned(), missing, able })
        } else {
            Ok(variant)
        };
    }
    let traversal = settings.traversal.unwrap_or(default.0);
    // A schedule that the settings do not ask for gives way to a traversal that they ask for.
    let schedules = match settings.schedule {
        Some(schedule) => vec![schedule],
        None => vec![default.1, Schedule::Regenerate, Schedule::Pixel],
    };
    let found = schedules.iter().find_map(|s| variant(needed | traversal.features() | s.features()));
    found.ok_or_else(|| SettingsError::NoVariant {
        needed: describe(needed | traversal.features() | schedules[0].features())
            + if schedules[0] == Schedule::Pixel { ", `schedule` pixel" } else { "" },
        able: names(|variant| variant.supports(needed)),
    })
}

fn names(which: impl Fn(&Variant) -> bool) -> String {
    VARIANTS
        .iter()
        .filter(|variant| which(variant))
        .map(|variant| variant.name)
        .collect::<Vec<_>>()
        .join(", ")
}

/// Returns the names of features, for messages.
fn describe(features: Features) -> String {
    let table = [
        (ROULETTE, "roulette"),
        (SCHLICK, "Schlick's Fresnel"),
        (SOBOL, "the Sobol sampler"),
        (PLANAR, "quads or discs"),
        (TRIANGLES, "triangles"),
        (EMITTERS, "lights"),
        (ENVIRONMENT, "an environment map"),
        (TEXTURES, "textures"),
        (MICROFACETS, "microfacets"),
        (LINEAR, "`traversal` linear"),
        (WIDE, "`traversal` wide"),
        (AOVS, "normals, albedos and positions"),
        (PERSISTENT, "`schedule` persistent"),
    ];
    table.iter().filter(|(bit, _)| features & bit != 0).map(|(_, word)| *word).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{Fresnel, Sampler};
    use trisect_scene::Scene;

    const DEFAULT: (Traversal, Schedule) = (Traversal::Stack, Schedule::Regenerate);

    fn settings() -> Settings {
        Scene::hello_world().map(|scene| Settings::of(&scene)).unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn the_cheapest_that_covers() {
        let name = |scene, settings: &Settings| {
            choose(scene, settings, |_| DEFAULT, false).map(|variant| variant.name)
        };
        assert_eq!(name(0, &settings()), Ok("render"));
        assert_eq!(name(0, &Settings { roulette: true, ..settings() }), Ok("render_roulette"));
        assert_eq!(name(TEXTURES, &settings()), Ok("render_all"));
    }

    /// The best schedule is taken if a kernel of the same size has it.
    #[test]
    fn a_schedule_does_not_make_a_kernel_larger() {
        let queue = |_| (Traversal::Stack, Schedule::Persistent);
        let name = |settings: &Settings| choose(0, settings, queue, false).map(|variant| variant.name);
        assert_eq!(name(&settings()), Ok("render"));
        let schlick = Settings { fresnel: Fresnel::Schlick, ..settings() };
        assert_eq!(name(&schlick), Ok("render_schlick_persistent"));
        let all = choose(TEXTURES, &settings(), queue, false).map(|variant| variant.name);
        assert_eq!(all, Ok("render_all_persistent"));
    }

    /// Hello world needs Fresnel's equations, so a variant with Schlick's approximation alone is
    /// not chosen.
    #[test]
    fn fresnel_is_met() {
        for schedule in [Schedule::Pixel, Schedule::Persistent] {
            let settings = Settings { schedule: Some(schedule), ..settings() };
            let name = choose(0, &settings, |_| DEFAULT, false).map(|variant| variant.name);
            assert!(name.is_ok_and(|name| !name.contains("schlick")));
        }
        let named = Settings { variant: Some("render_schlick"), ..settings() };
        let error = choose(0, &named, |_| DEFAULT, false).map_err(|error| error.to_string());
        assert!(error.is_err_and(|error| error.contains("lacks Fresnel's equations")));
    }

    /// A kernel with the Sobol sampler would render another image than settings with the
    /// independent one.
    #[test]
    fn the_sampler_is_met() {
        let named = Settings { variant: Some("render_all_sobol"), ..settings() };
        let error = choose(0, &named, |_| DEFAULT, false).map_err(|error| error.to_string());
        assert!(error.is_err_and(|error| error.contains("lacks the independent sampler")));
        let sobol = Settings { sampler: Sampler::Sobol, ..named };
        assert!(choose(0, &sobol, |_| DEFAULT, false).is_ok());
    }

    #[test]
    fn a_method_is_met_exactly() {
        for traversal in [Traversal::Linear, Traversal::Stack] {
            let settings = Settings { traversal: Some(traversal), ..settings() };
            let variant = choose(TRIANGLES, &settings, |_| DEFAULT, false)
                .map(|variant| Traversal::of(variant.features));
            assert_eq!(variant, Ok(traversal));
        }
    }

    #[test]
    fn the_wide_tree_is_traced_where_there_is_one() {
        let of = |traversal, variant, wide| {
            let settings = Settings { traversal, variant, ..settings() };
            let default = (Traversal::Wide, Schedule::Regenerate);
            choose(0, &settings, |_| default, wide).map(|v| (v.name, Traversal::of(v.features)))
        };
        assert_eq!(of(None, None, true), Ok(("render", Traversal::Wide)));
        assert_eq!(of(Some(Traversal::Wide), Some("render_all"), true), Ok(("render_all", Traversal::Wide)));
        assert_eq!(of(Some(Traversal::Stack), None, true), Ok(("render", Traversal::Stack)));
        let linear = Ok(("render_all_linear", Traversal::Linear));
        assert_eq!(of(None, Some("render_all_linear"), true), linear);
        assert_eq!(of(Some(Traversal::Linear), None, true), linear);
        assert_eq!(of(None, None, false), Ok(("render", Traversal::Stack)));
        assert!(of(Some(Traversal::Wide), None, false).is_err());
    }

    #[test]
    fn a_variant_by_name_must_cover_the_scene() {
        let named =
            |name, scene| choose(scene, &Settings { variant: Some(name), ..settings() }, |_| DEFAULT, false);
        assert_eq!(named("render_all", 0).map(|variant| variant.name), Ok("render_all"));
        let error = named("render", TRIANGLES | EMITTERS).map_err(|error| error.to_string());
        assert!(
            error.as_ref().is_err_and(|e| e.contains("triangles, lights") && e.contains("render_all")),
            "{error:?}"
        );
        assert!(matches!(named("fastest", 0), Err(SettingsError::NoSuchVariant { .. })));
    }
}
