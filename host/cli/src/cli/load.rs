//! Options with which a scene is read.

use super::SurroundingsArgs;
use clap::Args;
use trisect::scene::import::ModelOptions;
use trisect::scene::{FieldEdit, Includes, LoadOptions};

/// Options with which a scene is read.
#[derive(Clone, Debug, Args)]
pub struct LoadArgs {
    /// Permitted locations of files that the scene names.
    #[command(flatten)]
    pub includes: IncludeArgs,

    /// Parts of models that are drawn.
    #[command(flatten)]
    pub model: ModelArgs,

    /// Environment, sun and ground.
    #[command(flatten)]
    pub surroundings: SurroundingsArgs,

    /// Change of a field of a scene file: names, and numbers of list entries from 0 on, with dots
    /// between them, such as camera.look_at=0,1,0 or objects.3.radius=2; may be given several times
    /// (default: none).
    #[arg(help_heading = "Scene", long, value_name = "PATH=VALUE")]
    pub set: Vec<FieldEdit>,
}

impl LoadArgs {
    /// Returns the choices for the library.
    pub fn options(&self) -> LoadOptions {
        LoadOptions {
            includes: self.includes.includes(),
            model: self.model.options(),
            surroundings: self.surroundings.surroundings(),
            edits: self.set.clone(),
            ..LoadOptions::default()
        }
    }
}

/// Option `--allow-outside`.
#[derive(Clone, Copy, Debug, Args)]
pub struct IncludeArgs {
    /// Also read files outside the scene's folder that the scene or its models name (default:
    /// refuse them).
    #[arg(help_heading = "Scene", long)]
    pub allow_outside: bool,
}

impl IncludeArgs {
    /// Returns the permitted locations for the library.
    pub fn includes(self) -> Includes {
        if self.allow_outside { Includes::Anywhere } else { Includes::Below }
    }
}

/// Choices among what glTF models hold, unless the scene file makes them.
#[derive(Clone, Debug, Default, Args)]
pub struct ModelArgs {
    /// Time of the animation of glTF models, in seconds or as 1500ms, 2s, 1m (default: the model's
    /// own pose; with --animation: 0).
    #[arg(help_heading = "Scene", long, value_name = "TIME", value_parser = parse_moment, allow_hyphen_values = true)]
    pub time: Option<f64>,

    /// Name of the animation of glTF models (default: their first).
    #[arg(help_heading = "Scene", long, value_name = "NAME")]
    pub animation: Option<String>,

    /// Name of the variant of the materials of glTF models (default: none).
    #[arg(help_heading = "Scene", long, value_name = "NAME")]
    pub material_variant: Option<String>,
}

impl ModelArgs {
    /// Returns the options that are given.
    pub fn given(&self) -> Vec<&'static str> {
        let Self { time, animation, material_variant } = self;
        let all = [
            ("--time", time.is_some()),
            ("--animation", animation.is_some()),
            ("--material-variant", material_variant.is_some()),
        ];
        all.into_iter().filter(|(_, given)| *given).map(|(name, _)| name).collect()
    }

    /// Returns the choices for the library.
    pub fn options(&self) -> ModelOptions {
        let Self { time, animation, material_variant } = self;
        ModelOptions { time: *time, animation: animation.clone(), variant: material_variant.clone() }
    }
}

/// Reads a time in seconds, with or without a unit.
fn parse_moment(text: &str) -> Result<f64, String> {
    super::time::seconds(text).ok_or_else(|| "must be a time such as 1.5, 1.5s, 1500ms or 2m".to_owned())
}
