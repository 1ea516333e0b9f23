//! An image with what its file may hold beside it.

use super::Channel;
use crate::Image;

/// An image with what its file may hold beside it.
#[derive(Clone, Debug)]
pub struct Picture<'a> {
    /// The image, multiplied by `alpha` if there is one.
    pub image: &'a Image,
    /// Alpha of each pixel.
    pub alpha: Option<&'a [f32]>,
    /// Further channels, for .exr.
    pub layers: Vec<Channel>,
}

impl<'a> From<&'a Image> for Picture<'a> {
    fn from(image: &'a Image) -> Self {
        Self { image, alpha: None, layers: Vec::new() }
    }
}
