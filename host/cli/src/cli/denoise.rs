//! `--denoise` and the options of its filter.

use clap::{Args, ValueEnum};
use trisect::denoise::{DenoiseError, DenoiseSettings, Denoiser, Filter};

/// Filter of the image and its parameters.
#[derive(Clone, Debug, Args)]
pub struct DenoiseArgs {
    /// Filter of the image, which keeps edges of normals and depth, and textures (default: off;
    /// with --budget: oidn where it is installed and fits the time, or svgf, if that lowers the
    /// error; for view: svgf).
    #[arg(help_heading = "Filter", long, value_enum)]
    pub denoise: Option<DenoiseArg>,

    /// With a filter: number of passes; each reaches twice as far as the one before (defaults:
    /// docs/how-to/denoise.md).
    #[arg(help_heading = "Filter", long, value_name = "N")]
    pub denoise_levels: Option<u32>,

    /// With a filter: difference in light at which a neighbour has a quarter of its weight, in
    /// radiance (atrous) or standard deviations of the pixel (svgf). Smaller is sharper; inf
    /// ignores light (defaults: docs/how-to/denoise.md).
    #[arg(help_heading = "Filter", long, value_name = "X")]
    pub denoise_color: Option<f32>,

    /// With a filter: angle between normals at which a neighbour has a quarter of its weight, in
    /// degrees; inf ignores normals (defaults: docs/how-to/denoise.md).
    #[arg(help_heading = "Filter", long, value_name = "DEGREES")]
    pub denoise_normal: Option<f32>,

    /// With a filter: distance from the pixel's tangent plane at which a neighbour has a quarter
    /// of its weight, as a share of the pixel's depth; inf ignores depth (defaults:
    /// docs/how-to/denoise.md).
    #[arg(help_heading = "Filter", long, value_name = "X")]
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
    /// Open Image Denoise 2, a library that must be installed (docs/how-to/denoise.md); not for
    /// view.
    Oidn,
}

impl DenoiseArgs {
    /// Returns the denoiser with its parameters, which are checked, or `None` without one.
    /// [`Denoiser::check`] tells whether its library is available.
    ///
    /// # Errors
    ///
    /// [`DenoiseError`] names the parameter that is out of range, or has no filter.
    pub fn denoise(&self) -> Result<Option<Denoiser>, DenoiseError> {
        self.denoise_or(DenoiseArg::Off)
    }

    /// Returns the filter of live frames, which is `default` if none is given.
    ///
    /// # Errors
    ///
    /// The errors of [`denoise`](Self::denoise), and [`DenoiseError::NotLive`] for a denoiser of
    /// finished images.
    pub fn live_filter(&self, default: DenoiseArg) -> Result<Option<DenoiseSettings>, DenoiseError> {
        match self.denoise_or(default)? {
            None => Ok(None),
            Some(Denoiser::Filter(filter)) => Ok(Some(filter)),
            Some(other @ Denoiser::Oidn) => Err(DenoiseError::NotLive { name: other.name() }),
        }
    }

    /// Returns the denoiser, which is `default` if none is given.
    fn denoise_or(&self, default: DenoiseArg) -> Result<Option<Denoiser>, DenoiseError> {
        let filter = match self.denoise.unwrap_or(default) {
            DenoiseArg::Off => {
                return self.parameter().map_or(Ok(None), |name| Err(DenoiseError::NoFilter { name }));
            }
            DenoiseArg::Oidn => {
                let given = self.parameter();
                return given
                    .map_or(Ok(Some(Denoiser::Oidn)), |name| Err(DenoiseError::NoParameters { name }));
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
        Ok(Some(denoise.into()))
    }

    /// Returns the name of the first parameter of a filter that is given.
    fn parameter(&self) -> Option<&'static str> {
        let given = [
            ("levels", self.denoise_levels.is_some()),
            ("color", self.denoise_color.is_some()),
            ("normal", self.denoise_normal.is_some()),
            ("depth", self.denoise_depth.is_some()),
        ];
        given.into_iter().find(|(_, given)| *given).map(|(name, _)| name)
    }
}
