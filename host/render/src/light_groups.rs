//! Images of light groups: the light of each group apart, as layers of an EXR file.

use crate::Error;
use crate::bvh::BvhQuality;
use crate::denoise::Denoiser;
use crate::render::{RenderObserver, Renderer, Settings};
use trisect_image::output::{Channel, color_channels};
use trisect_scene::{LightGroup, Rebase, SceneDocument};

/// Renders the images of light groups, with the samples of the image that they add up to, and
/// returns their channels, `light_NAME.R` and so on. `document` is the scene with all lights;
/// `factor` multiplies all values. The renderer then has the scene of the last group.
///
/// # Errors
///
/// Those of [`SceneDocument::light_group_names`] and of a render; [`Error::Cancelled`] if
/// `observer` cancels it.
pub fn render(
    renderer: &mut Renderer,
    settings: &Settings,
    (document, groups, quality): (&SceneDocument, &[LightGroup], Option<BvhQuality>),
    (denoise, factor): (Option<&Denoiser>, f32),
    observer: &mut dyn RenderObserver,
) -> Result<Vec<Channel>, Error> {
    let denoise = denoise.copied();
    let settings = Settings { guides: settings.guides || denoise.is_some(), denoise, ..settings.clone() };
    let mut channels = Vec::new();
    for (index, name) in document.light_group_names(groups)?.iter().enumerate() {
        let scene = document.with_light_group(groups, index).lower(Rebase::IDENTITY)?;
        renderer.update_scene(&scene, quality)?;
        let mut image = renderer.render_observed(&settings, observer)?.image();
        image.pixels.iter_mut().flatten().for_each(|value| *value *= factor);
        channels.extend(color_channels(&format!("light_{name}."), &image.pixels));
    }
    Ok(channels)
}
