//! Packs images into one array of texels in half precision.

use super::super::description::{Filter, Texels, TextureImage, TextureUse, Wrap};
use half::f16;
use std::collections::HashMap;
use std::sync::Arc;
use trisect_image::metrics::srgb;
use trisect_shared::texture::{CLAMP, MIRROR, NEAREST, REPEAT, SECOND_SET, Texel, Texture};

/// Textures and texels so far. Each image is packed once, and each way of reading it is listed
/// once.
#[derive(Default)]
pub(super) struct Packer {
    pub textures: Vec<Texture>,
    pub texels: Vec<Texel>,
    first: HashMap<usize, u32>,
    /// Index of each texture by the bytes of its record.
    known: HashMap<Vec<u8>, u32>,
    /// Mean texel of each image by the index of its first texel.
    means: HashMap<u32, [f64; 3]>,
}

impl Packer {
    /// Returns the index of the texture that reads `use_`, and adds it at its first use.
    pub fn add(&mut self, use_: &TextureUse, images: &[Arc<TextureImage>]) -> Result<u32, String> {
        let Some(image) = images.get(use_.image) else {
            return Err(format!(
                "a texture reads image {}, but there are {} images",
                use_.image,
                images.len()
            ));
        };
        let first = match self.first.get(&use_.image) {
            Some(&first) => first,
            None => {
                let first = self.pack(image)?;
                self.first.insert(use_.image, first);
                first
            }
        };
        let wrap = |wrap| match wrap {
            Wrap::Repeat => REPEAT,
            Wrap::Mirror => MIRROR,
            Wrap::Clamp => CLAMP,
        };
        let nearest = if use_.filter == Filter::Nearest { NEAREST } else { 0 };
        let set = if use_.second_uvs { SECOND_SET } else { 0 };
        let (m, t) = (use_.transform.matrix2, use_.transform.translation);
        let record = Texture {
            first,
            width: image.width,
            height: image.height,
            flags: wrap(use_.wrap[0]) | wrap(use_.wrap[1]) << 2 | nearest | set,
            uu: m.x_axis.x as f32,
            uv: m.y_axis.x as f32,
            vu: m.x_axis.y as f32,
            vv: m.y_axis.y as f32,
            u0: t.x as f32,
            v0: t.y as f32,
            pad: [0; 2],
        };
        let index = *self.known.entry(bytemuck::bytes_of(&record).to_vec()).or_insert_with(|| {
            self.textures.push(record);
            self.textures.len() as u32 - 1
        });
        Ok(index)
    }

    fn pack(&mut self, image: &TextureImage) -> Result<u32, String> {
        let first = self.texels.len();
        let count = image.width as usize * image.height as usize;
        let given = match &image.texels {
            Texels::Srgb8(texels) | Texels::Linear8(texels) => texels.len(),
            Texels::Float(texels) => texels.len(),
        };
        if count == 0 || given != count || first + count > u32::MAX as usize {
            let (name, width, height) = (&image.name, image.width, image.height);
            return Err(format!(
                "image \"{name}\" has {given} texels for {width}x{height}; all images together may have 2^32 - 1"
            ));
        }
        let linear = |byte: u8| f32::from(byte) / 255.0;
        match &image.texels {
            Texels::Srgb8(texels) => {
                let decoded: Vec<f32> = (0..=255u8).map(|byte| srgb::decode(linear(byte))).collect();
                let at = |byte: u8| decoded[usize::from(byte)];
                self.texels
                    .extend(texels.iter().map(|t| texel([at(t[0]), at(t[1]), at(t[2]), linear(t[3])])));
            }
            Texels::Linear8(texels) => self.texels.extend(texels.iter().map(|t| texel(t.map(linear)))),
            Texels::Float(texels) => self.texels.extend(texels.iter().map(|&t| texel(t))),
        }
        Ok(first as u32)
    }

    /// Returns the mean of the texels of texture `index`, by channel.
    pub fn mean(&mut self, index: u32) -> [f64; 3] {
        let Some(t) = self.textures.get(index as usize) else { return [1.0; 3] };
        if let Some(&mean) = self.means.get(&t.first) {
            return mean;
        }
        let count = t.width as usize * t.height as usize;
        let mut sum = [0.0; 3];
        for texel in &self.texels[t.first as usize..t.first as usize + count] {
            let c = texel.channels();
            (0..3).for_each(|i| sum[i] += f64::from(c[i]));
        }
        let mean = sum.map(|s| s / count as f64);
        self.means.insert(t.first, mean);
        mean
    }
}

/// Rounds a texel to half precision. Values below the normal numbers (6.1e-5) and NaN become 0;
/// values above the maximum (65,504) become the maximum.
pub(super) fn texel(channels: [f32; 4]) -> Texel {
    let half = |x: f32| {
        let h = f16::from_f32(x.clamp(0.0, 65504.0));
        u32::from(if h >= f16::MIN_POSITIVE { h.to_bits() } else { 0 })
    };
    let [r, g, b, a] = channels.map(half);
    Texel { red_green: r | g << 16, blue_alpha: b | a << 16 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DAffine2, DVec2};

    #[test]
    fn ways_of_reading_an_image_are_listed_once_each() {
        let texels = Texels::Linear8(vec![[0, 51, 255, 255], [255, 51, 255, 255]]);
        let images = [TextureImage { name: "a".to_owned(), width: 2, height: 1, texels }.into()];
        let at = |offset: u32| TextureUse {
            image: 0,
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Linear,
            transform: DAffine2::from_translation(DVec2::new(f64::from(offset), 0.0)),
            second_uvs: false,
        };
        let mut packer = Packer::default();
        // So many that comparing each with each, or a mean for each, would take minutes.
        for offset in (0..200_000).chain([7, 199_999]) {
            let index = packer.add(&at(offset), &images).unwrap();
            assert_eq!(index, offset);
            let mean = packer.mean(index);
            assert!(
                (mean[0] - 0.5).abs() < 1e-3 && (mean[1] - 0.2).abs() < 1e-3 && mean[2] == 1.0,
                "{mean:?}"
            );
        }
        assert_eq!((packer.textures.len(), packer.texels.len(), packer.means.len()), (200_000, 2, 1));
    }

    #[test]
    fn texels_keep_their_values() {
        for x in [0.0f32, 1.0, 0.5, 0.003_035_27, 65504.0, 6.2e-5] {
            let c = texel([x, 1.0, x, 0.25]).channels();
            assert!((c.x - x).abs() <= x * 0.0005 && c.y == 1.0 && c.z == c.x && c.w == 0.25, "{x}: {c}");
        }
        let c = texel([1e-6, -1.0, f32::INFINITY, f32::NAN]).channels();
        assert_eq!((c.x, c.y, c.z), (0.0, 0.0, 65504.0));
        assert!(c.w == 0.0);
    }
}
