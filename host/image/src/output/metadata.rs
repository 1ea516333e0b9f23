//! Text about a render in its image file.

use serde::{Deserialize, Serialize};

/// Entries about a render, which PNG, JPEG, TIFF and EXR files hold; HDR and PFM have no place for
/// them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// Program with its version, such as "Trisect 0.1.0".
    pub software: Option<String>,
    /// Names and values, in order. The names have letters and spaces.
    pub entries: Vec<(&'static str, String)>,
    /// Names and values of further attributes, for .exr.
    pub attributes: Vec<(String, String)>,
    /// Camera of the image, for .exr.
    pub camera: Option<CameraMetadata>,
}

/// Camera of an image, as attributes of OpenEXR. Matrices multiply row vectors from the right, as
/// those of OpenEXR do; lengths are in scene units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraMetadata {
    /// From world coordinates to those of the camera: x to the right, y upwards, z forwards.
    pub world_to_camera: [[f32; 4]; 4],
    /// From world coordinates to normalised device coordinates: after division by w, x and y are 0
    /// at the image's top left corner and 1 at its bottom right one.
    pub world_to_ndc: [[f32; 4]; 4],
    /// Vertical field of view in degrees; `None` for a parallel projection.
    pub vertical_fov: Option<f32>,
}

impl Metadata {
    /// Returns the software and the entries as lines of text, `Name: value`.
    pub fn lines(&self) -> String {
        let software = self.software.iter().map(|software| ("Software", software.as_str()));
        let entries = self.entries.iter().map(|(name, value)| (*name, value.as_str()));
        software.chain(entries).map(|(name, value)| format!("{name}: {value}\n")).collect()
    }
}
