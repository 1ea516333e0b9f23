//! Configurations to measure: the base settings, and those with one knob (an option of the render)
//! changed, or a few together.

use super::TradeoffError;
use trisect::bvh::BvhQuality;
use trisect::denoise::{DenoiseSettings, Denoiser, Filter, oidn};
use trisect::render::{Fresnel, MathMode, Sampler, Settings, Traversal};
use trisect::scene::Scene;
use trisect_shared::bsdf::DIELECTRIC;
use trisect_shared::features::{EMITTERS, ENVIRONMENT, has_any};

/// Names of the knobs, besides the number of samples per pixel.
pub const KNOBS: [&str; 14] = [
    "sampler",
    "roulette",
    "adaptive",
    "denoiser",
    "scale",
    "depth",
    "clamp",
    "lights",
    "math",
    "fresnel",
    "filter",
    "bvh",
    "traversal",
    "together",
];

/// Maximum number of primitives of a scene for which linear traversal, a test of each primitive for
/// each ray, is measured.
const MAX_LINEAR_PRIMITIVES: usize = 64;

/// A set of render settings that the lab measures.
#[derive(Clone, Debug, PartialEq)]
pub struct Configuration {
    /// Knob that was changed: one of [`KNOBS`], or `base`.
    pub knob: &'static str,
    /// Value that the knob was set to, for people.
    pub level: String,
    /// Render settings. Each render sets its own number of samples and seed.
    pub settings: Settings,
    /// Denoiser, if any.
    pub denoise: Option<Denoiser>,
    /// Pixels of the image per rendered pixel, along each axis.
    pub divisor: u32,
    /// True if samples are distributed by noise (adaptive sampling).
    pub adaptive: bool,
    /// Quality of the BVH; `None` for the default.
    pub quality: Option<BvhQuality>,
    /// True if textures are sampled at the nearest texel.
    pub nearest: bool,
}

impl Configuration {
    /// Returns the configuration that the others are compared with: `settings` without AOVs, no
    /// denoiser, full resolution.
    pub fn base(settings: &Settings, quality: Option<BvhQuality>) -> Self {
        Self {
            knob: "base",
            level: "as asked".to_owned(),
            settings: Settings { guides: false, ..settings.clone() },
            denoise: None,
            divisor: 1,
            adaptive: false,
            quality,
            nearest: false,
        }
    }

    /// Returns knob and level.
    pub fn name(&self) -> String {
        if self.knob == "base" { self.knob.to_owned() } else { format!("{} {}", self.knob, self.level) }
    }

    /// Returns whether the image differs from the reference's only by noise, by construction: the
    /// configurations differ in nothing but how samples are taken. An apparent bias then comes from
    /// paths too rare for the samples, or from a fault. `lights`: true if the scene has lights
    /// without extent, which no path hits by chance.
    pub fn is_exact(&self, base: &Self, lights: bool) -> bool {
        // Each field is named, so that whoever adds one decides whether it biases the image.
        let Settings {
            depth,
            fresnel,
            math,
            light_sampling,
            clamp,
            denoise: _, // the lab's own is below
            width: _,
            height: _,
            crop: _,
            samples: _,
            seed: _,
            roulette: _,
            roulette_depth: _,
            sampler: _,
            traversal: _,
            schedule: _,
            tile: _,
            sums: _,
            guides: _,
            hidden_sky: _, // the lab shows the sky
            features: _,
        } = self.settings;
        (depth, fresnel) == (base.settings.depth, base.settings.fresnel)
            && math == MathMode::Precise
            && clamp.is_none()
            && (light_sampling || !lights)
            && self.denoise.is_none()
            && self.divisor == 1
            && !self.nearest
    }

    fn with(&self, knob: &'static str, level: impl ToString, change: impl FnOnce(&mut Self)) -> Self {
        let mut mode = Self { knob, level: level.to_string(), ..self.clone() };
        change(&mut mode);
        mode
    }
}

/// Returns the base, and for each of `knobs` the base with that knob set to each level that makes
/// sense in this scene; fast math only if `fast`, that is if the device has it.
///
/// # Errors
///
/// [`TradeoffError::NoKnob`] for an unknown name.
pub fn configurations(
    scene: &Scene,
    base: &Configuration,
    knobs: &[String],
    fast: bool,
) -> Result<Vec<Configuration>, TradeoffError> {
    if let Some(name) = knobs.iter().find(|name| !KNOBS.contains(&name.as_str())) {
        return Err(TradeoffError::NoKnob { name: name.clone(), known: KNOBS.join(", ") });
    }
    let mut modes = vec![base.clone()];
    let settings = &base.settings;
    let mut add = |mode: Configuration| modes.push(mode);
    let sobol = |mode: &mut Configuration| mode.settings.sampler = Sampler::Sobol;
    let roulette = |mode: &mut Configuration| {
        (mode.settings.roulette, mode.settings.roulette_depth) = (true, 4.min(mode.settings.depth));
    };
    let svgf = |mode: &mut Configuration| mode.denoise = Some(Filter::Svgf.into());
    for knob in KNOBS.into_iter().filter(|&knob| knobs.iter().any(|name| name == knob)) {
        match knob {
            "sampler" => add(match settings.sampler {
                Sampler::Independent => base.with(knob, "sobol", sobol),
                Sampler::Sobol => {
                    base.with(knob, "independent", |m| m.settings.sampler = Sampler::Independent)
                }
            }),
            "roulette" if settings.roulette => add(base.with(knob, "off", |m| m.settings.roulette = false)),
            "roulette" => [1, 4].into_iter().filter(|&from| from < settings.depth).for_each(|from| {
                add(base.with(knob, format!("from segment {from}"), |m| {
                    (m.settings.roulette, m.settings.roulette_depth) = (true, from);
                }));
            }),
            "adaptive" => add(base.with(knob, "on", |m| m.adaptive = true)),
            "denoiser" => {
                add(base.with(knob, "atrous", |m| m.denoise = Some(Filter::Atrous.into())));
                add(base.with(knob, "svgf", svgf));
                for color in [3.0, 12.0] {
                    let denoise = DenoiseSettings { color, ..DenoiseSettings::new(Filter::Svgf) };
                    add(base.with(knob, format!("svgf, color {color}"), |m| m.denoise = Some(denoise.into())));
                }
                let denoise = DenoiseSettings { levels: 3, ..DenoiseSettings::new(Filter::Svgf) };
                add(base.with(knob, "svgf, 3 levels", |m| m.denoise = Some(denoise.into())));
                // Measured where it is installed.
                if oidn::check().is_ok() {
                    add(base.with(knob, "oidn", |m| m.denoise = Some(Denoiser::Oidn)));
                }
            }
            "scale" => [2, 4].into_iter().for_each(|divisor| {
                add(base.with(knob, format!("1/{divisor}"), |m| m.divisor = divisor));
            }),
            "depth" => [2, 4, 8, 16].into_iter().filter(|&depth| depth < settings.depth).for_each(|depth| {
                add(base.with(knob, depth, |m| m.settings.depth = depth));
            }),
            "clamp" => [16.0, 4.0, 1.0].into_iter().for_each(|clamp| {
                add(base.with(knob, clamp, |m| m.settings.clamp = Some(clamp)));
            }),
            "lights" if has_any(scene.features(), EMITTERS | ENVIRONMENT) && settings.light_sampling => {
                add(base.with(knob, "found by chance", |m| m.settings.light_sampling = false));
            }
            "math" if fast && settings.math == MathMode::Precise => {
                add(base.with(knob, "fast", |m| m.settings.math = MathMode::Fast));
            }
            "fresnel" if scene.materials.iter().any(|m| m.kind == DIELECTRIC) => {
                let (fresnel, name) = match settings.fresnel {
                    Fresnel::Exact => (Fresnel::Schlick, "Schlick"),
                    Fresnel::Schlick => (Fresnel::Exact, "exact"),
                };
                add(base.with(knob, name, |m| m.settings.fresnel = fresnel));
            }
            "filter" if !scene.textures.is_empty() => {
                add(base.with(knob, "nearest texel", |m| m.nearest = true))
            }
            "bvh" => [(BvhQuality::Fast, "fast"), (BvhQuality::Medium, "medium"), (BvhQuality::High, "high")]
                .into_iter()
                .for_each(|(quality, name)| add(base.with(knob, name, |m| m.quality = Some(quality)))),
            "traversal" => {
                let few = scene.primitives() <= MAX_LINEAR_PRIMITIVES;
                let all = [
                    (Traversal::Stack, "binary tree"),
                    (Traversal::Wide, "wide tree"),
                    (Traversal::Linear, "linear"),
                ];
                all.into_iter().filter(|(t, _)| few || *t != Traversal::Linear).for_each(
                    |(traversal, name)| {
                        add(base.with(knob, name, |m| m.settings.traversal = Some(traversal)));
                    },
                );
            }
            "together" => {
                let both = |m: &mut Configuration| {
                    sobol(m);
                    roulette(m);
                };
                add(base.with(knob, "sobol, roulette", both));
                add(base.with(knob, "sobol, roulette, svgf", |m| {
                    both(m);
                    svgf(m);
                }));
                add(base.with(knob, "roulette, adaptive", |m| {
                    roulette(m);
                    m.adaptive = true;
                }));
                add(base.with(knob, "sobol, svgf", |m| {
                    sobol(m);
                    svgf(m);
                }));
                add(base.with(knob, "scale 1/2, svgf", |m| {
                    m.divisor = 2;
                    svgf(m);
                }));
            }
            _ => {}
        }
    }
    Ok(modes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_no_mean_is_exact() {
        let settings = Scene::hello_world().map(|scene| Settings::of(&scene));
        let base = Configuration::base(&settings.unwrap_or_else(|error| panic!("{error}")), None);
        let roulette = base.with("roulette", "on", |m| m.settings.roulette = !m.settings.roulette);
        let tree = base.with("bvh", "fast", |m| m.quality = Some(BvhQuality::Fast));
        assert!([&base, &roulette, &tree].iter().all(|mode| mode.is_exact(&base, true)));
        let by_chance = base.with("lights", "found by chance", |m| m.settings.light_sampling = false);
        assert!(by_chance.is_exact(&base, false) && !by_chance.is_exact(&base, true));
        let clamp = base.with("clamp", 1, |m| m.settings.clamp = Some(1.0));
        let half = base.with("scale", "1/2", |m| m.divisor = 2);
        let both = roulette.with("together", "", |m| m.denoise = Some(Filter::Svgf.into()));
        assert!(![&clamp, &half, &both].iter().any(|mode| mode.is_exact(&base, false)));
        // The base is biased here.
        assert!(
            !clamp.with("sampler", "sobol", |m| m.settings.sampler = Sampler::Sobol).is_exact(&clamp, false)
        );
    }
}
