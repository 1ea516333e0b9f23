//! Textures, their images and samplers.

use super::super::images::Curve;
use super::super::source_location::SourceLocation;
use super::buffers::{get, read_uri};
use super::json::{REPEAT, TextureInfo, TextureTransform};
use super::{Document, Output};
use crate::description::{Filter, TextureUse, Wrap};
use crate::error::SceneError;
use glam::{DAffine2, DMat2, DVec2};
use std::borrow::Cow;

const CLAMP_TO_EDGE: u32 = 33071;
const MIRRORED_REPEAT: u32 = 33648;
const NEAREST: u32 = 9728;
const LINEAR: u32 = 9729;

/// Reads the use of an image by a material, and the set of texture coordinates for it; `None` if
/// the image has no supported format.
pub fn read(
    document: &Document,
    output: &mut Output,
    info: &TextureInfo,
    curve: Curve,
    user: &SourceLocation,
) -> Result<Option<(TextureUse, u32)>, SceneError> {
    let root = &document.root;
    let texture = get(&root.textures, info.index, "textures", user)?;
    let site = document.site(format!("textures[{}]", info.index));
    // The image without an extension first: those of extensions lose more.
    let others = texture.extensions.as_deref();
    let webp = others.and_then(|others| others.webp.as_ref()?.source);
    let ktx2 = others.and_then(|others| others.ktx2.as_ref()?.source);
    let Some(source) = texture.source.or(webp).or(ktx2) else {
        output.warnings.tally("textures without an image, ignored", 1, &site.place);
        return Ok(None);
    };
    let image = image(document, output, source, curve, &site)?;
    let (mut wrap, mut filter) = ([Wrap::Repeat; 2], Filter::Linear);
    if let Some(index) = texture.sampler {
        let sampler = get(&root.samplers, index, "samplers", &site)?;
        let site = document.site(format!("samplers[{index}]"));
        let unknown =
            |name: &str, value: u32| site.malformed(format!("{name} is {value}"), "use one of glTF's values");
        let mode = |name: &str, value: u32| match value {
            REPEAT => Ok(Wrap::Repeat),
            CLAMP_TO_EDGE => Ok(Wrap::Clamp),
            MIRRORED_REPEAT => Ok(Wrap::Mirror),
            _ => Err(unknown(name, value)),
        };
        wrap = [mode("wrapS", sampler.wrap_s)?, mode("wrapT", sampler.wrap_t)?];
        filter = match sampler.mag_filter {
            None | Some(LINEAR) => Filter::Linear,
            Some(NEAREST) => Filter::Nearest,
            Some(other) => return Err(unknown("magFilter", other)),
        };
    }
    let moved = info.extensions.as_ref().and_then(|extensions| extensions.transform.as_ref());
    let set = moved.and_then(|moved| moved.tex_coord).unwrap_or(info.tex_coord);
    let transform = moved.map_or(DAffine2::IDENTITY, transform);
    if !transform.is_finite() {
        return Err(user.malformed("its KHR_texture_transform is not finite", "use smaller numbers"));
    }
    let second_uvs = false; // the material decides
    Ok(Some((TextureUse { image, wrap, filter, transform, second_uvs }, set)))
}

/// Returns scale, then rotation, then offset as a map. With v down, a positive rotation turns +u
/// towards -v.
fn transform(moved: &TextureTransform) -> DAffine2 {
    let turn = DMat2::from_angle(-moved.rotation);
    DAffine2::from_mat2_translation(
        turn * DMat2::from_diagonal(DVec2::from(moved.scale)),
        DVec2::from(moved.offset),
    )
}

/// Returns the index of an image in the description, and reads it at its first use.
fn image(
    document: &Document,
    output: &mut Output,
    index: u32,
    curve: Curve,
    user: &SourceLocation,
) -> Result<usize, SceneError> {
    let image = get(&document.root.images, index, "images", user)?;
    let site = document.site(format!("images[{index}]"));
    let Output { images, files, budget, .. } = output;
    images.get(&site.place, curve, &site, || match (&image.uri, image.buffer_view) {
        (Some(uri), _) => read_uri(uri, &site, *files, budget).map(Cow::Owned),
        (None, Some(view)) => {
            document.buffers.view(&document.root, view, &site).map(|(bytes, _)| Cow::Borrowed(bytes))
        }
        (None, None) => Err(site.malformed("it has neither uri nor bufferView", "it must have one of them")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_specifications_example_is_the_lower_left_quadrant_turned() {
        let moved = TextureTransform {
            offset: [0.0, 1.0],
            rotation: std::f64::consts::FRAC_PI_2,
            scale: [0.5, 0.5],
            tex_coord: None,
        };
        let transform = transform(&moved);
        for (uv, expected) in [
            ([0.0, 0.0], [0.0, 1.0]),
            ([1.0, 0.0], [0.0, 0.5]),
            ([0.0, 1.0], [0.5, 1.0]),
            ([1.0, 1.0], [0.5, 0.5]),
        ] {
            let uv = transform.transform_point2(DVec2::from(uv));
            assert!(uv.abs_diff_eq(DVec2::from(expected), 1e-12), "{uv}");
        }
    }
}
