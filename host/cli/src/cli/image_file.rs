//! Options of the image file that `render`, `resume` and `merge` write.

use super::parse_stops;
use clap::{Args, ValueEnum};
use std::path::Path;
use trisect::image::ImageError;
use trisect::output::{BitDepth, Encoding, Format, GAMMA_RANGE, ToneMap, Transfer};

/// Encoding of the image file.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Image file")]
pub struct ImageFileArgs {
    /// Exposure in stops; each doubles the radiance (default: 0; for a model without a scene file,
    /// in a file for a display, by the median luminance).
    #[arg(help_heading = "Image file", long, value_name = "STOPS", allow_negative_numbers = true, value_parser = parse_stops)]
    pub exposure: Option<f32>,

    /// Curve from exposed radiance to the range of a display, for .png, .jpg and .tif: none
    /// (clipped at 1), filmic, agx or aces (default: none).
    #[arg(help_heading = "Image file", long, value_name = "CURVE", value_parser = parse_tone_map)]
    pub tonemap: Option<ToneMap>,

    /// Encode .png, .jpg and .tif by a power of 1/X (default: by the curve of sRGB).
    #[arg(help_heading = "Image file", long, value_name = "X", value_parser = parse_gamma)]
    pub gamma: Option<f32>,

    /// Bits of a channel in .png and .tif: 8 or 16 (default: 8).
    #[arg(help_heading = "Image file", long, value_name = "8|16", value_parser = parse_bits)]
    pub bits: Option<BitDepth>,

    /// Write colours in .exr as 32-bit floats (default: 16-bit floats, unless one is above 65504;
    /// depth, position and variance always have 32 bits).
    #[arg(help_heading = "Image file", long)]
    pub float: bool,

    /// Text about the render in .png, .jpg, .tif and .exr (default: image).
    #[arg(help_heading = "Image file", long, value_enum)]
    pub metadata: Option<MetadataArg>,
}

/// Values of `--metadata`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum MetadataArg {
    /// No text.
    None,
    /// Properties that decide the image: version, scene, samples, seed, fingerprint, exposure, tone
    /// map. Equal renders give equal files.
    #[default]
    Image,
    /// In addition the device, the time of the render and the date.
    All,
}

impl ImageFileArgs {
    /// Returns these options with those of an earlier command where they are not given, unless the
    /// format of the file lacks what these ask for.
    pub fn or(&self, earlier: &Self, path: &Path) -> Self {
        let fits = |of: &Self| of.check(path).is_ok();
        let tonemap = earlier.tonemap.filter(|_| fits(&Self { tonemap: earlier.tonemap, ..Self::default() }));
        let gamma = earlier.gamma.filter(|_| fits(&Self { gamma: earlier.gamma, ..Self::default() }));
        let bits = earlier.bits.filter(|_| fits(&Self { bits: earlier.bits, ..Self::default() }));
        Self {
            exposure: self.exposure.or(earlier.exposure),
            tonemap: self.tonemap.or(tonemap),
            gamma: self.gamma.or(gamma),
            bits: self.bits.or(bits),
            float: self.float || earlier.float,
            metadata: self.metadata.or(earlier.metadata),
        }
    }

    /// Checks that the format of the file has what the options ask for.
    ///
    /// # Errors
    ///
    /// Those of [`ToneMap::check`] and [`Encoding::check`].
    pub fn check(&self, path: &Path) -> Result<(), ImageError> {
        self.tone_map().check(path)?;
        self.encoding().check(path)
    }

    /// Returns a warning if `--float` has no effect on the file.
    pub fn without_effect(&self, path: &Path) -> Option<&'static str> {
        let is_display = Format::of(path).is_ok_and(Format::is_display);
        (self.float && is_display).then_some("--float has no effect on files for a display; use .exr")
    }

    /// Returns the tone map.
    pub fn tone_map(&self) -> ToneMap {
        self.tonemap.unwrap_or_default()
    }

    /// Returns the choice of metadata.
    pub fn metadata(&self) -> MetadataArg {
        self.metadata.unwrap_or_default()
    }

    /// Returns the encoding, without metadata.
    pub fn encoding(&self) -> Encoding {
        Encoding {
            bits: self.bits.unwrap_or_default(),
            transfer: self.gamma.map_or(Transfer::Srgb, Transfer::Gamma),
            half: !self.float,
            ..Encoding::default()
        }
    }

    /// Returns whether a file for a display holds sRGB bytes of the rendered radiance.
    #[cfg(feature = "mpi")]
    pub fn is_plain(&self) -> bool {
        let Self { exposure: _, tonemap: _, gamma, bits, float: _, metadata: _ } = self;
        self.tone_map() == ToneMap::None && gamma.is_none() && *bits != Some(BitDepth::Sixteen)
    }
}

fn parse_tone_map(text: &str) -> Result<ToneMap, String> {
    ToneMap::ALL.into_iter().find(|(name, _)| *name == text).map(|(_, of)| of).ok_or_else(|| {
        let names: Vec<&str> = ToneMap::ALL.into_iter().map(|(name, _)| name).collect();
        format!("unknown curve; available: {}", names.join(", "))
    })
}

fn parse_gamma(text: &str) -> Result<f32, String> {
    let gamma = text.parse().ok().filter(|gamma| GAMMA_RANGE.contains(gamma));
    gamma.ok_or_else(|| format!("must be a number from {} to {}", GAMMA_RANGE.start(), GAMMA_RANGE.end()))
}

fn parse_bits(text: &str) -> Result<BitDepth, String> {
    match text {
        "8" => Ok(BitDepth::Eight),
        "16" => Ok(BitDepth::Sixteen),
        _ => Err("must be 8 or 16".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers() {
        assert_eq!((parse_gamma("2.2"), parse_gamma("1")), (Ok(2.2), Ok(1.0)));
        for bad in ["", "0", "-1", "NaN", "inf", "1e9"] {
            assert!(parse_gamma(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_bits("16"), Ok(BitDepth::Sixteen));
        assert!(parse_bits("32").is_err() && parse_bits("").is_err());
    }

    /// Options of an earlier command are dropped where another format lacks them; those of the
    /// command are not, so that their check fails.
    #[test]
    fn earlier_options_fit_the_format() {
        let earlier = ImageFileArgs {
            exposure: Some(1.0),
            tonemap: Some(ToneMap::Agx),
            bits: Some(BitDepth::Sixteen),
            ..ImageFileArgs::default()
        };
        let none = ImageFileArgs::default();
        let exr = none.or(&earlier, Path::new("a.exr"));
        assert_eq!((exr.exposure, exr.tonemap, exr.bits), (Some(1.0), None, None));
        let jpeg = none.or(&earlier, Path::new("a.jpg"));
        assert_eq!((jpeg.tonemap, jpeg.bits), (Some(ToneMap::Agx), None));
        let own = ImageFileArgs { bits: Some(BitDepth::Eight), ..none.clone() };
        assert_eq!(own.or(&earlier, Path::new("a.png")).bits, Some(BitDepth::Eight));
        assert!(earlier.or(&none, Path::new("a.exr")).check(Path::new("a.exr")).is_err());
    }
}
