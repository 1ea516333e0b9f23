//! Command lines that render the images of a measurement.

use super::configuration::Configuration;
use trisect::bvh::BvhQuality;
use trisect::denoise::{DenoiseSettings, Denoiser, Filter};
use trisect::render::{MathMode, Sampler, Traversal};

/// Target error that no image reaches, in percent, so that adaptive sampling takes all its samples.
const UNREACHABLE_PERCENT: &str = "1e-7%";

/// Command that renders the base: `trisect render` with the scene and the options that decide its
/// image.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RenderCommand {
    /// Scene file; `None` for the built-in scene.
    pub scene: Option<String>,
    /// Options, such as `--depth`, each with its value; `None` for an option without one.
    pub options: Vec<(String, Option<String>)>,
}

impl RenderCommand {
    /// Returns the command line that renders a configuration with a number of samples per pixel, or
    /// `None` if none does: where the program has no option for the knob, or the image would be of
    /// another size.
    pub fn line(&self, base: &Configuration, mode: &Configuration, spp: u32) -> Option<String> {
        let mut options = self.options.clone();
        let mut set = |name: &str, value: &str| {
            let with = (name.to_owned(), Some(value.to_owned()));
            match options.iter_mut().find(|(other, _)| other == name) {
                Some(option) => *option = with,
                None => options.push(with),
            }
        };
        changes(base, mode, &mut set)?;
        if mode.adaptive {
            // A goal chooses what is not given.
            let settings = &mode.settings;
            set("--sampler", if settings.sampler == Sampler::Sobol { "sobol" } else { "independent" });
            set("--roulette", on_or_off(settings.roulette));
            if settings.roulette {
                set("--roulette-depth", &settings.roulette_depth.to_string());
            }
            set("--adaptive", "on");
            set("--target-error", UNREACHABLE_PERCENT);
            set("--max-spp", &spp.to_string());
        } else {
            set("--spp", &spp.to_string());
        }
        let mut words = vec!["trisect".to_owned(), "render".to_owned()];
        words.extend(self.scene.as_deref().map(quoted));
        for (name, value) in options {
            match value.as_deref().map(quoted) {
                None => words.push(name),
                // It would be read as an option.
                Some(value) if value.starts_with('-') => words.push(format!("{name}={value}")),
                Some(value) => words.extend([name, value]),
            }
        }
        Some(words.join(" "))
    }
}

fn on_or_off(is_on: bool) -> &'static str {
    if is_on { "on" } else { "off" }
}

/// Sets the options by which a configuration differs from the base. Returns `None` if a difference
/// has no option.
fn changes(base: &Configuration, mode: &Configuration, set: &mut dyn FnMut(&str, &str)) -> Option<()> {
    let (from, to) = (&base.settings, &mode.settings);
    if mode.divisor != 1 || mode.nearest || to.fresnel != from.fresnel {
        return None;
    }
    if to.sampler != from.sampler {
        set("--sampler", if to.sampler == Sampler::Sobol { "sobol" } else { "independent" });
    }
    if (to.roulette, to.roulette_depth) != (from.roulette, from.roulette_depth) {
        set("--roulette", on_or_off(to.roulette));
        if to.roulette {
            set("--roulette-depth", &to.roulette_depth.to_string());
        }
    }
    if to.depth != from.depth {
        set("--depth", &to.depth.to_string());
    }
    if to.clamp != from.clamp {
        set("--clamp", &to.clamp?.to_string());
    }
    if to.light_sampling != from.light_sampling {
        set("--light-sampling", on_or_off(to.light_sampling));
    }
    if to.math != from.math {
        set("--math", if to.math == MathMode::Fast { "fast" } else { "precise" });
    }
    if to.traversal != from.traversal {
        let name = match to.traversal? {
            Traversal::Stack => "stack",
            Traversal::Wide => "wide",
            Traversal::Linear => "linear",
        };
        set("--traversal", name);
    }
    if mode.quality != base.quality {
        let name = match mode.quality? {
            BvhQuality::Fast => "fast",
            BvhQuality::Medium => "medium",
            BvhQuality::High => "high",
        };
        set("--bvh-quality", name);
    }
    if mode.denoise != base.denoise {
        denoiser(mode.denoise.as_ref()?, set);
    }
    Some(())
}

fn denoiser(denoise: &Denoiser, set: &mut dyn FnMut(&str, &str)) {
    let filter = match denoise {
        Denoiser::Oidn => return set("--denoise", "oidn"),
        Denoiser::Filter(filter) => filter,
    };
    let usual = DenoiseSettings::new(filter.filter);
    set("--denoise", if filter.filter == Filter::Svgf { "svgf" } else { "atrous" });
    if filter.levels != usual.levels {
        set("--denoise-levels", &filter.levels.to_string());
    }
    let parameters = [
        ("--denoise-color", filter.color, usual.color),
        ("--denoise-normal", filter.normal, usual.normal),
        ("--denoise-depth", filter.depth, usual.depth),
    ];
    for (name, value, _) in parameters.into_iter().filter(|(_, value, usual)| value != usual) {
        set(name, &value.to_string());
    }
}

/// Returns a word as a POSIX shell reads it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-./:=,%+@#".contains(c);
    match !word.is_empty() && word.chars().all(plain) && !word.starts_with('#') {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::super::configuration::{KNOBS, configurations};
    use super::*;
    use trisect::render::Settings;
    use trisect::scene::Scene;

    #[test]
    fn each_knob_has_its_options() {
        let scene = Scene::hello_world().unwrap();
        let settings = Settings { depth: 50, ..Settings::of(&scene) };
        let base = Configuration::base(&settings, None);
        let command = RenderCommand {
            scene: Some("my scene.ron".to_owned()),
            options: vec![
                ("--sampler".to_owned(), Some("sobol".to_owned())),
                ("--allow-outside".to_owned(), None),
            ],
        };
        let all = configurations(&scene, &base, &KNOBS.map(str::to_owned), true).unwrap();
        let line = |name: &str| {
            let mode = all.iter().find(|mode| mode.name() == name).unwrap_or_else(|| panic!("{name}"));
            command.line(&base, mode, 16).map(|line| line.replace("trisect render 'my scene.ron' ", ""))
        };
        let always = "--sampler sobol --allow-outside";
        let expected = [
            ("base", "--spp 16"),
            ("roulette from segment 4", "--roulette on --roulette-depth 4 --spp 16"),
            ("denoiser svgf, color 3", "--denoise svgf --denoise-color 3 --spp 16"),
            ("denoiser svgf, 3 levels", "--denoise svgf --denoise-levels 3 --spp 16"),
            ("denoiser atrous", "--denoise atrous --spp 16"),
            ("depth 8", "--depth 8 --spp 16"),
            ("clamp 4", "--clamp 4 --spp 16"),
            ("math fast", "--math fast --spp 16"),
            ("bvh medium", "--bvh-quality medium --spp 16"),
            ("traversal wide tree", "--traversal wide --spp 16"),
            ("adaptive on", "--roulette off --adaptive on --target-error 1e-7% --max-spp 16"),
        ];
        for (name, options) in expected {
            assert_eq!(line(name), Some(format!("{always} {options}")), "{name}");
        }
        // An option that the user gave is replaced, not repeated.
        assert_eq!(
            line("sampler independent"),
            Some("--sampler independent --allow-outside --spp 16".to_owned())
        );
        let early =
            RenderCommand { scene: None, options: vec![("--time".to_owned(), Some("-1.5s".to_owned()))] };
        assert_eq!(
            early.line(&base, &base, 4).as_deref(),
            Some("trisect render --time=-1.5s --spp 4"),
            "a value like an option"
        );
        // No command gives an image of half the size enlarged, or another Fresnel term.
        for name in ["scale 1/2", "together scale 1/2, svgf", "fresnel exact", "fresnel Schlick"] {
            if all.iter().any(|mode| mode.name() == name) {
                assert_eq!(line(name), None, "{name}");
            }
        }
    }

    #[test]
    fn words_are_quoted_for_a_shell() {
        assert_eq!(quoted("scenes/a-b_1.ron"), "scenes/a-b_1.ron");
        assert_eq!(quoted("it's; rm $HOME"), r"'it'\''s; rm $HOME'");
        assert_eq!((quoted(""), quoted("#a"), quoted("<x>")), ("''".into(), "'#a'".into(), "'<x>'".into()));
    }
}
