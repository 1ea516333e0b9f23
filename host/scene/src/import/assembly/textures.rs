//! Images that imported textures read.

use super::super::images::Curve;
use super::super::source_location::{SourceLocation, shown};
use super::super::{budget, files};
use super::{Assembly, Value};
use crate::description::{Alpha, Filter, Material, Texels, TextureImage, TextureUse, Wrap};
use crate::error::SceneError;
use crate::surroundings::PANORAMAS;
use glam::{DAffine2, DVec2, DVec3};
use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;
use trisect_image::metrics::srgb;
use trisect_image::{Image, ImageError};

/// Returns whether a file's extension is that of an image with floating-point channels.
fn is_float(name: &str) -> bool {
    Path::new(name).extension().is_some_and(|e| PANORAMAS.iter().any(|known| e.eq_ignore_ascii_case(known)))
}

impl Assembly<'_> {
    /// Reads a file that the scene names.
    pub fn read(&mut self, name: &str, site: &SourceLocation) -> Result<Vec<u8>, SceneError> {
        // Files of other systems have `\` between folders.
        let path = name.replace('\\', "/");
        self.files.read(&path, files::readable()).map_err(|error| site.resource(name, error))
    }

    /// Reads an image of linear light: EXR, HDR or PFM, or a PNG, whose numbers are sRGB-encoded.
    pub fn float_image(&mut self, name: &str, site: &SourceLocation) -> Result<Image, SceneError> {
        let is_png = Path::new(name).extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
        if !(is_float(name) || is_png) {
            let problem = format!("\"{}\" is not an EXR, HDR, PFM or PNG file", shown(name));
            return Err(site.malformed(problem, "light from infinity needs one of these"));
        }
        let bytes = self.read(name, site)?;
        Image::decode(&bytes, Path::new(name)).map_err(|error| match error {
            ImageError::TooLarge { needed, free, .. } => site.too_large(
                format!("the image \"{}\" takes {needed} bytes of memory", shown(name)),
                format!("{free}, the free memory"),
            ),
            other => site.malformed(shown(&other.to_string()), "write it again"),
        })
    }

    /// Returns the index of an image file; `is_linear` says that its numbers are not sRGB-encoded.
    pub fn image(&mut self, name: &str, is_linear: bool, site: &SourceLocation) -> Result<usize, SceneError> {
        let curve = if is_linear { Curve::Linear } else { Curve::Srgb };
        if is_float(name) {
            if let Some(known) = self.images.all.iter().position(|image| image.name == shown(name)) {
                return Ok(known);
            }
            let Image { width, height, pixels } = self.float_image(name, site)?;
            budget::fits(16 * pixels.len() as u64, site)?;
            // Half precision, which textures have, ends at 65,504.
            let channel = |x: f32| if x.is_nan() { 0.0 } else { x.clamp(0.0, 65504.0) };
            let texels = pixels.iter().map(|p| [channel(p[0]), channel(p[1]), channel(p[2]), 1.0]).collect();
            return Ok(self.add_image(TextureImage {
                name: shown(name),
                width,
                height,
                texels: Texels::Float(texels),
            }));
        }
        let (path, files) = (name.replace('\\', "/"), &mut *self.files);
        self.images.get(&path, curve, site, || {
            let bytes = files.read(&path, files::readable());
            bytes.map(Cow::Owned).map_err(|error| site.resource(name, error))
        })
    }

    /// Adds an image.
    pub fn add_image(&mut self, image: TextureImage) -> usize {
        self.images.all.push(Arc::new(image));
        self.images.all.len() - 1
    }

    /// Returns a checkerboard whose fields are `size` wide in texture coordinates: `even` where the
    /// whole parts of both are even together.
    pub fn checkerboard(
        &mut self,
        [even, odd]: [DVec3; 2],
        coordinates: DAffine2,
        site: &SourceLocation,
    ) -> Result<Value, SceneError> {
        self.budget.take(1024, site)?;
        let texel = |color: DVec3| {
            let [r, g, b] = color.clamp(DVec3::ZERO, DVec3::splat(65504.0)).as_vec3().to_array();
            [r, g, b, 1.0]
        };
        let (even, odd) = (texel(even), texel(odd));
        let texels = Texels::Float(vec![even, odd, odd, even]);
        let image =
            self.add_image(TextureImage { name: "checkerboard".to_owned(), width: 2, height: 2, texels });
        let half = DAffine2::from_scale(DVec2::splat(0.5));
        let texture = TextureUse {
            image,
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Nearest,
            transform: half * coordinates,
            second_uvs: false,
        };
        Ok(Value::Image { texture, scale: DVec3::ONE })
    }

    /// Gives a material an opacity, which may be a texture: its alpha goes into the texture of the
    /// material's colour.
    pub fn set_opacity(
        &mut self,
        material: &mut Material,
        opacity: &Value,
        site: &SourceLocation,
    ) -> Result<(), SceneError> {
        let mean = opacity.mean(&self.images.all).element_sum() / 3.0;
        material.opacity = mean.clamp(0.0, 1.0);
        if material.opacity < 1.0 {
            material.alpha = Alpha::Blend;
        }
        let Value::Image { texture, scale } = opacity else { return Ok(()) };
        let base = material.surface.base_texture_mut();
        let combined = match base {
            Some(base) => combine(base.as_ref(), texture, *scale, &self.images.all),
            None => None,
        };
        let Some(image) = combined else {
            self.unsupported(
                "an opacity texture of another size than that of the colour",
                "its mean is used",
                site,
            );
            return Ok(());
        };
        self.budget.take(4 * u64::from(image.width) * u64::from(image.height), site)?;
        let image = self.add_image(image);
        if let Some(base) = material.surface.base_texture_mut() {
            *base = Some(TextureUse { image, ..texture.clone() });
        }
        (material.opacity, material.alpha) = (1.0, Alpha::Blend);
        Ok(())
    }
}

/// Returns an image with the colours of `base`, or white, and the mean of the channels of `opacity`
/// times `scale` as alpha; `None` if the two do not lie on each other.
fn combine(
    base: Option<&TextureUse>,
    opacity: &TextureUse,
    scale: DVec3,
    images: &[Arc<TextureImage>],
) -> Option<TextureImage> {
    let mask = images.get(opacity.image)?;
    let color = match base {
        Some(base) => {
            let color = images.get(base.image)?;
            let same_use = base.transform == opacity.transform && base.wrap == opacity.wrap;
            let same_size = (color.width, color.height) == (mask.width, mask.height);
            Some(color).filter(|_| same_use && same_size)
        }
        None => None,
    };
    if base.is_some() && color.is_none() {
        return None;
    }
    let alpha = |index: usize| {
        let linear = match &mask.texels {
            Texels::Srgb8(texels) => texels[index].map(|code| srgb::decode(f32::from(code) / 255.0)),
            Texels::Linear8(texels) => texels[index].map(|code| f32::from(code) / 255.0),
            Texels::Float(texels) => texels[index],
        };
        let mean = (0..3).map(|c| f64::from(linear[c]) * scale[c]).sum::<f64>() / 3.0;
        mean.clamp(0.0, 1.0)
    };
    let code = |index: usize| (255.0 * alpha(index)).round() as u8;
    let count = mask.width as usize * mask.height as usize;
    let with_alpha = |texels: &[[u8; 4]]| -> Vec<[u8; 4]> {
        texels.iter().enumerate().map(|(index, &[r, g, b, _])| [r, g, b, code(index)]).collect()
    };
    let texels = match color.map(|color| &color.texels) {
        None => Texels::Linear8((0..count).map(|index| [255, 255, 255, code(index)]).collect()),
        Some(Texels::Srgb8(texels)) => Texels::Srgb8(with_alpha(texels)),
        Some(Texels::Linear8(texels)) => Texels::Linear8(with_alpha(texels)),
        Some(Texels::Float(texels)) => Texels::Float(
            texels.iter().enumerate().map(|(index, &[r, g, b, _])| [r, g, b, alpha(index) as f32]).collect(),
        ),
    };
    Some(TextureImage { name: mask.name.clone(), width: mask.width, height: mask.height, texels })
}
