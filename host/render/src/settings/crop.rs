//! A part of an image, rendered as an image of its own.

use super::{Settings, SettingsError};
use crate::camera;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use trisect_image::output::Window;
use trisect_scene::CameraPose;
use trisect_shared::camera::Camera;

/// Place of an image in a larger one, of which it is a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Crop {
    /// Column of the larger image at the part's left edge.
    pub x: u32,
    /// Row of the larger image at the part's upper edge.
    pub y: u32,
    /// Pixels across the larger image.
    pub width: u32,
    /// Pixels down the larger image.
    pub height: u32,
}

/// Maximum number of pixels across and down the larger image, as .exr numbers them.
const MAX_SIDE: u32 = i32::MAX as u32;

impl From<Crop> for Window {
    fn from(Crop { x, y, width, height }: Crop) -> Self {
        Self { at: (x, y), of: (width, height) }
    }
}

impl Settings {
    /// Returns the settings of the part of this image in these columns and rows. Its pixels show
    /// what those of the whole show, with other random numbers.
    ///
    /// # Errors
    ///
    /// [`SettingsError::NoSuchCrop`] for a part that is empty or beyond the image.
    pub fn cropped(self, columns: Range<u32>, rows: Range<u32>) -> Result<Self, SettingsError> {
        let (width, height) = (self.width, self.height);
        let is_large = width.max(height) > MAX_SIDE;
        if is_large || columns.is_empty() || rows.is_empty() || columns.end > width || rows.end > height {
            return Err(SettingsError::NoSuchCrop { columns, rows, width, height });
        }
        let of = self.crop.unwrap_or(Crop { x: 0, y: 0, width, height });
        let crop = Crop { x: of.x + columns.start, y: of.y + rows.start, ..of };
        Ok(Self { width: columns.len() as u32, height: rows.len() as u32, crop: Some(crop), ..self })
    }

    /// Returns the settings of the image of which this one is a part; itself for a whole image.
    #[must_use]
    pub fn uncropped(self) -> Self {
        match self.crop {
            Some(Crop { width, height, .. }) => Self { width, height, crop: None, ..self },
            None => self,
        }
    }

    /// Returns the camera record of an image with these settings.
    pub(crate) fn camera_record(&self, pose: &CameraPose) -> Camera {
        match self.crop {
            None => camera::record(pose, self.width, self.height),
            Some(Crop { x, y, width, height }) => camera::shifted(camera::record(pose, width, height), x, y),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    #[test]
    fn parts_of_parts_are_parts() {
        let whole = Settings::new(100, 50);
        let part = whole.clone().cropped(20..80, 10..40).unwrap();
        assert_eq!((part.width, part.height), (60, 30));
        let inner = part.cropped(5..15, 0..1).unwrap();
        assert_eq!(inner.crop, Some(Crop { x: 25, y: 10, width: 100, height: 50 }));
        assert_eq!((inner.width, inner.height), (10, 1));
        assert_eq!(inner.uncropped(), whole);
        for (columns, rows) in [(0..101, 0..1), (5..5, 0..1), (0..1, 50..51), (0..1, 9..9)] {
            let refused = whole.clone().cropped(columns, rows);
            assert!(matches!(refused, Err(SettingsError::NoSuchCrop { width: 100, height: 50, .. })));
        }
    }
}
