//! `--denoise` and its parameters.

use clap::{Args, ValueEnum};
use trisect::denoise::{DenoiseError, DenoiseSettings, Filter};

/// Whether and how to denoise.
#[derive(Clone, Debug, Args)]
pub struct DenoiseArgs {
    /// Filter the image, stopping at edges of normals and depth; textures stay sharp. Without it, off; for view, svgf.
    #[arg(long, value_enum)]
    pub denoise: Option<DenoiseArg>,

    /// Passes of the filter; each reaches twice as far as the one before.
    #[arg(long, value_name = "N")]
    pub denoise_levels: Option<u32>,

    /// What of a difference in light is noise: in radiance (atrous), or in standard deviations of the pixel (svgf). Smaller is sharper.
    #[arg(long, value_name = "X")]
    pub denoise_color: Option<f32>,

    /// Which angle between normals is an edge, in degrees.
    #[arg(long, value_name = "DEGREES")]
    pub denoise_normal: Option<f32>,

    /// Which distance from a pixel's surface is an edge, as a share of its depth.
    #[arg(long, value_name = "X")]
    pub denoise_depth: Option<f32>,
}

/// `--denoise`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DenoiseArg {
    /// No filter.
    Off,
    /// The edge-avoiding à-trous wavelet transform, with fixed stops.
    Atrous,
    /// The same with stops by the variance of each pixel.
    Svgf,
}

impl DenoiseArgs {
    /// For the library: checked.
    pub fn denoise(&self) -> Result<Option<DenoiseSettings>, DenoiseError> {
        self.denoise_or(DenoiseArg::Off)
    }

    /// The same, with another filter where none was named.
    pub fn denoise_or(&self, default: DenoiseArg) -> Result<Option<DenoiseSettings>, DenoiseError> {
        let filter = match self.denoise.unwrap_or(default) {
            DenoiseArg::Off => {
                let given = [
                    ("levels", self.denoise_levels.is_some()),
                    ("color", self.denoise_color.is_some()),
                    ("normal", self.denoise_normal.is_some()),
                    ("depth", self.denoise_depth.is_some()),
                ];
                return match given.into_iter().find(|(_, given)| *given) {
                    Some((name, _)) => Err(DenoiseError::NoFilter { name }),
                    None => Ok(None),
                };
            }
            DenoiseArg::Atrous => Filter::Atrous,
            DenoiseArg::Svgf => Filter::Svgf,
        };
        let default = DenoiseSettings::new(filter);
        let denoise = DenoiseSettings {
            filter,
            levels: self.denoise_levels.unwrap_or(default.levels),
            color: self.denoise_color.unwrap_or(default.color),
            normal: self.denoise_normal.unwrap_or(default.normal),
            depth: self.denoise_depth.unwrap_or(default.depth),
        };
        denoise.check()?;
        Ok(Some(denoise))
    }
}
