//! Writes images of a film with the background that `--background` chooses.

use crate::cli::Background;
use std::path::Path;
use trisect::film::Film;
use trisect::image::{Image, ImageError};
use trisect::layers::{Aov, FilmPlace, write as write_layers, write_with_alpha};
use trisect::output::{self, Format};

/// Checks that the format of an image has alpha, if it needs it.
pub fn check(background: Background, path: &Path) -> Result<(), ImageError> {
    let has_alpha = matches!(Format::of(path)?, Format::Png | Format::Exr);
    match background == Background::Transparent && !has_alpha {
        true => Err(ImageError::NoAlpha { path: path.to_owned() }),
        false => Ok(()),
    }
}

/// Writes the image of a film before a background, without layers. An exposure is applied to the
/// image already; a background's colour has none.
pub fn write(background: Background, image: &Image, film: &Film, path: &Path) -> Result<(), ImageError> {
    check(background, path)?;
    match (background, Format::of(path)?) {
        (Background::Sky, _) => output::write(image, path),
        (Background::Transparent, Format::Png) => {
            output::write_transparent(image, &alpha_of(film, path)?, path)
        }
        (Background::Transparent, _) => write_with_alpha(image, film, path),
        (Background::Color(color), _) => output::write(&over(image, &alpha_of(film, path)?, color), path),
    }
}

/// Writes the image of a film as [`write`] does, with the layers `aov`. `stops` is the exposure
/// that was applied to the image.
pub fn write_with_layers(
    background: Background,
    image: &Image,
    film: &Film,
    place: &FilmPlace<'_, impl Fn(Option<u32>) -> u32>,
    (aov, stops): (&[Aov], f32),
    path: &Path,
) -> Result<(), ImageError> {
    if aov.is_empty() {
        return write(background, image, film, path);
    }
    check(background, path)?;
    match background {
        Background::Sky => write_layers(image, film, place, aov, stops, path),
        Background::Transparent => {
            write_layers(image, film, place, &[aov, &[Aov::Alpha]].concat(), stops, path)
        }
        Background::Color(color) => {
            write_layers(&over(image, &alpha_of(film, path)?, color), film, place, aov, stops, path)
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
