//! `--denoise` and the options of its filter.

use clap::{Args, ValueEnum};
use trisect::denoise::{DenoiseError, DenoiseSettings, Filter};

/// Filter of the image and its parameters.
#[derive(Clone, Debug, Args)]
pub struct DenoiseArgs {
    /// Filter of the image, which keeps edges of normals and depth, and textures (default: off;
    /// with --budget: off or svgf, the better one; for view: svgf).
    #[arg(long, value_enum)]
    pub denoise: Option<DenoiseArg>,

    /// With a filter: number of passes; each reaches twice as far as the one before (defaults:
    /// docs/how-to/denoise.md).
    #[arg(long, value_name = "N")]
    pub denoise_levels: Option<u32>,

    /// With a filter: difference in light at which a neighbour has a quarter of its weight, in
    /// radiance (atrous) or standard deviations of the pixel (svgf). Smaller is sharper; inf
    /// ignores light (defaults: docs/how-to/denoise.md).
    #[arg(long, value_name = "X")]
    pub denoise_color: Option<f32>,

    /// With a filter: angle between normals at which a neighbour has a quarter of its weight, in
    /// degrees; inf ignores normals (defaults: docs/how-to/denoise.md).
    #[arg(long, value_name = "DEGREES")]
    pub denoise_normal: Option<f32>,

    /// With a filter: distance from the pixel's tangent plane at which a neighbour has a quarter
    /// of its weight, as a share of the pixel's depth; inf ignores depth (defaults:
    /// docs/how-to/denoise.md).
    #[arg(long, value_name = "X")]
    pub denoise_depth: Option<f32>,
}

/// Values of `--denoise`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DenoiseArg {
    /// Image without a filter.
    Off,
    /// Edge-avoiding à-trous wavelet transform; a fixed difference in light counts as noise.
    Atrous,
    /// Edge-avoiding à-trous wavelet transform; noise is judged by the variance of each pixel.
    Svgf,
}

impl DenoiseArgs {
    /// Returns the checked settings of the filter, or `None` without a filter.
    pub fn denoise(&self) -> Result<Option<DenoiseSettings>, DenoiseError> {
        self.denoise_or(DenoiseArg::Off)
    }

    /// Returns the checked settings of the filter, which is `default` if none is given.
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
