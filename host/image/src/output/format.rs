//! Formats of image files, by extension.

use crate::ImageError;
use std::path::Path;

/// Image file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// PNG for a display: 8 or 16 bits; values are clipped to 0..1.
    Png,
    /// JPEG for a display: 8 bits, lossy; values are clipped to 0..1.
    Jpeg,
    /// TIFF for a display: 8 or 16 bits; values are clipped to 0..1.
    Tiff,
    /// OpenEXR, 16-bit or 32-bit float, linear.
    Exr,
    /// Radiance, linear, 8-bit mantissas with a shared exponent.
    Hdr,
    /// Portable float map, 32-bit, linear.
    Pfm,
}

/// Extensions, in lower case, with their formats.
const EXTENSIONS: [(&str, Format); 8] = [
    ("png", Format::Png),
    ("jpg", Format::Jpeg),
    ("jpeg", Format::Jpeg),
    ("tif", Format::Tiff),
    ("tiff", Format::Tiff),
    ("exr", Format::Exr),
    ("hdr", Format::Hdr),
    ("pfm", Format::Pfm),
];

/// Returns whether a path names standard output: `-`, or a format and `:-`, such as `exr:-`.
pub fn is_stdout(path: &Path) -> bool {
    path.to_str().is_some_and(|text| {
        text == "-" || text.strip_suffix(":-").is_some_and(|name| Format::of_extension(name).is_some())
    })
}

impl Format {
    /// Returns the format of an extension without its dot, in upper or lower case.
    pub fn of_extension(extension: &str) -> Option<Self> {
        let is_extension = |(name, _): &(&str, Self)| name.eq_ignore_ascii_case(extension);
        EXTENSIONS.into_iter().find(is_extension).map(|(_, format)| format)
    }

    /// Returns the format that a path's extension names, in upper or lower case. Standard output
    /// (see [`is_stdout`]) has the format before its colon, or PNG.
    ///
    /// # Errors
    ///
    /// [`ImageError::UnknownExtension`].
    pub fn of(path: &Path) -> Result<Self, ImageError> {
        let extension = match path.to_str() {
            Some("-") => Some("png"),
            Some(text) if is_stdout(path) => text.strip_suffix(":-"),
            _ => path.extension().and_then(|extension| extension.to_str()),
        };
        let format = extension.and_then(Self::of_extension);
        format.ok_or_else(|| ImageError::UnknownExtension { path: path.to_owned() })
    }

    /// Returns whether the format holds colours of a display; other formats hold linear radiance.
    pub fn is_display(self) -> bool {
        matches!(self, Self::Png | Self::Jpeg | Self::Tiff)
    }

    /// Returns whether the format has alpha.
    pub fn has_alpha(self) -> bool {
        matches!(self, Self::Png | Self::Tiff | Self::Exr)
    }

    /// Returns the maximum width and height in pixels, if the format has one.
    pub fn max_side(self) -> Option<u32> {
        (self == Self::Jpeg).then_some(u16::MAX.into())
    }

    /// Returns whether a channel may have 16 bits.
    pub fn has_16_bits(self) -> bool {
        matches!(self, Self::Png | Self::Tiff)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extensions() {
        let of = |name: &str| Format::of(Path::new(name)).ok();
        assert_eq!(of("a.PNG"), Some(Format::Png));
        assert_eq!((of("a.jpg"), of("a.Jpeg")), (Some(Format::Jpeg), Some(Format::Jpeg)));
        assert_eq!((of("a.tif"), of("b.c.tiff")), (Some(Format::Tiff), Some(Format::Tiff)));
        assert_eq!(
            (of("-"), of("exr:-"), of("JPG:-")),
            (Some(Format::Png), Some(Format::Exr), Some(Format::Jpeg))
        );
        assert!(is_stdout(Path::new("-")) && is_stdout(Path::new("pfm:-")) && !is_stdout(Path::new("a:-")));
        for bad in ["a", "a.gif", "png", ".png", "a.png ", "gif:-", ":-", "--"] {
            assert!(matches!(Format::of(Path::new(bad)), Err(ImageError::UnknownExtension { .. })), "{bad}");
        }
    }
}
