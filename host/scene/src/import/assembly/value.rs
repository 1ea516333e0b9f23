//! Values of material parameters: a colour, or an image with a factor.

use crate::description::{Texels, TextureImage, TextureUse};
use glam::DVec3;
use std::sync::Arc;
use trisect_image::metrics::srgb;

/// A value of a material's parameter; a number is a grey colour.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A colour that is the same everywhere.
    Constant(DVec3),
    /// An image times a factor.
    Image { texture: TextureUse, scale: DVec3 },
}

impl Value {
    /// Returns a grey value.
    pub fn number(number: f64) -> Self {
        Self::Constant(DVec3::splat(number))
    }

    /// Returns the product; `None` for two images.
    pub fn times(&self, other: &Self) -> Option<Self> {
        match (self, other) {
            (Self::Constant(a), Self::Constant(b)) => Some(Self::Constant(*a * *b)),
            (Self::Image { texture, scale }, Self::Constant(factor))
            | (Self::Constant(factor), Self::Image { texture, scale }) => {
                Some(Self::Image { texture: texture.clone(), scale: *scale * *factor })
            }
            (Self::Image { .. }, Self::Image { .. }) => None,
        }
    }

    /// Returns the factor, each channel within 0 to 1, and the texture that it multiplies.
    pub fn share(self) -> (DVec3, Option<TextureUse>) {
        let unit = |color: DVec3| color.clamp(DVec3::ZERO, DVec3::ONE);
        match self {
            Self::Constant(color) => (unit(color), None),
            Self::Image { texture, scale } => (unit(scale), Some(texture)),
        }
    }

    /// Returns whether a constant or a factor is outside 0 to 1, so that [`Self::share`] clamps it.
    pub fn exceeds_one(&self) -> bool {
        let (Self::Constant(color) | Self::Image { scale: color, .. }) = self;
        color.max_element() > 1.0 + 1e-6 || color.min_element() < 0.0
    }

    /// Returns the mean over the image.
    pub fn mean(&self, images: &[Arc<TextureImage>]) -> DVec3 {
        match self {
            Self::Constant(color) => *color,
            Self::Image { texture, scale } => {
                *scale * images.get(texture.image).map_or(DVec3::ONE, |image| mean_texel(image))
            }
        }
    }
}

/// Returns the mean of red, green and blue of an image, linear.
fn mean_texel(image: &TextureImage) -> DVec3 {
    let mut sum = DVec3::ZERO;
    let mut add = |texel: [f32; 3]| sum += DVec3::from(texel.map(f64::from));
    let count = match &image.texels {
        Texels::Srgb8(texels) => {
            let decoded: Vec<f32> = (0..=255u8).map(|code| srgb::decode(f32::from(code) / 255.0)).collect();
            texels.iter().for_each(|&[r, g, b, _]| add([r, g, b].map(|code| decoded[usize::from(code)])));
            texels.len()
        }
        Texels::Linear8(texels) => {
            texels.iter().for_each(|&[r, g, b, _]| add([r, g, b].map(|code| f32::from(code) / 255.0)));
            texels.len()
        }
        Texels::Float(texels) => {
            texels.iter().for_each(|&[r, g, b, _]| add([r, g, b]));
            texels.len()
        }
    };
    sum / count.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{Filter, Wrap};
    use glam::DAffine2;

    #[test]
    fn products_keep_the_image() {
        let texture = TextureUse {
            image: 0,
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Linear,
            transform: DAffine2::IDENTITY,
            second_uvs: false,
        };
        let image = Value::Image { texture, scale: DVec3::splat(0.5) };
        let product = image.times(&Value::number(0.5)).unwrap();
        assert_eq!(product, Value::number(0.5).times(&image).unwrap());
        assert!(image.times(&image).is_none());
        let texels = Texels::Float(vec![[0.0, 1.0, 2.0, 1.0], [1.0, 1.0, 0.0, 1.0]]);
        let stored = TextureImage { name: "a".to_owned(), width: 2, height: 1, texels };
        assert_eq!(product.mean(&[Arc::new(stored)]), DVec3::new(0.125, 0.25, 0.25));
        assert_eq!(product.share().0, DVec3::splat(0.25));
    }
}
