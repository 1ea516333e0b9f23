//! Writes images of a film with the background that `--background` chooses.

use crate::cli::Background;
use std::path::Path;
use trisect::film::Film;
use trisect::image::{Image, ImageError};
use trisect::output::{Channel, Encoding, Format, Picture};

/// Checks that the format of an image has alpha, if it needs it.
pub fn check(background: Background, path: &Path) -> Result<(), ImageError> {
    match background == Background::Transparent && !Format::of(path)?.has_alpha() {
        true => Err(ImageError::NoAlpha { path: path.to_owned() }),
        false => Ok(()),
    }
}

/// Writes the image of a film before a background, with layers. An exposure is applied to the image
/// already; a background's colour has none.
pub fn write(
    background: Background,
    image: &Image,
    film: &Film,
    layers: Vec<Channel>,
    (path, encoding): (&Path, &Encoding),
) -> Result<(), ImageError> {
    check(background, path)?;
    match background {
        Background::Sky => Picture { layers, ..Picture::from(image) }.write(path, encoding),
        Background::Transparent => {
            let alpha = alpha_of(film, path)?;
            Picture { image, alpha: Some(&alpha), layers }.write(path, encoding)
        }
        Background::Color(color) => {
            let image = over(image, &alpha_of(film, path)?, color);
            Picture { layers, ..Picture::from(&image) }.write(path, encoding)
        }
    }
}

/// Returns the film's alpha, by which its image is multiplied, if the background replaces the sky.
pub fn alpha_behind(background: Background, film: &Film) -> Option<Vec<f32>> {
    if background.hides_sky() { film.alpha() } else { None }
}

/// Returns the film's alpha.
fn alpha_of(film: &Film, path: &Path) -> Result<Vec<f32>, ImageError> {
    let message = "the film has no counts of hits, which a background needs; render with it".to_owned();
    film.alpha().ok_or_else(|| ImageError::Codec { path: path.to_owned(), message })
}

/// Returns an image, which is multiplied by `alpha`, before a colour.
fn over(image: &Image, alpha: &[f32], color: [f32; 3]) -> Image {
    let blend = |(pixel, alpha): (&[f32; 3], &f32)| {
        let mut blended = *pixel;
        blended.iter_mut().zip(color).for_each(|(channel, color)| *channel += (1.0 - alpha) * color);
        blended
    };
    Image { pixels: image.pixels.iter().zip(alpha).map(blend).collect(), ..*image }
}
