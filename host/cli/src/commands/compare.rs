//! `trisect compare`: prints measures of the difference between two images, and writes a page of
//! both.

use crate::cli::CompareArgs;
use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;
use trisect::image::{Image, ImageError};
use trisect::memory;
use trisect::metrics::{ImageView, compare_with_map};
use trisect::output::{self, Format, Outputs};
use trisect_lab::Error;
use trisect_lab::comparison::{Named, page};

/// Exit code if images differ by more than `--max-rel-mse` allows.
const DIFFERENT: u8 = 5;

/// Compares two images, prints the measures, and writes the page of `--html`.
pub fn run(arguments: &CompareArgs) -> Result<ExitCode, Error> {
    let html = arguments.html.as_deref();
    let outputs = Outputs::default().file("--html", html);
    outputs.check_inputs("the image", [&arguments.image])?;
    outputs.check_inputs("the reference", [&arguments.reference])?;
    let image = Image::read(&arguments.image)?;
    fits(&image, &arguments.image, if html.is_some() { COMPARED + SHOWN } else { COMPARED })?;
    let reference = Image::read(&arguments.reference)?;
    html.map_or(Ok(()), output::probe)?;
    trisect::threads::start_shared(None)?;
    let (result, flip) = compare_with_map(&view(&image)?, &view(&reference)?)?;
    if let Some(path) = html {
        let names = [&arguments.image, &arguments.reference].map(|path| path.display().to_string());
        let is_for_display = |path: &Path| Format::of(path).is_ok_and(Format::is_display);
        let image =
            Named { name: &names[0], image: &image, is_for_display: is_for_display(&arguments.image) };
        let is_for_display = is_for_display(&arguments.reference);
        let reference = Named { name: &names[1], image: &reference, is_for_display };
        let text = page(image, reference, &result, &flip)
            .map_err(|message| ImageError::Codec { path: path.to_owned(), message })?;
        output::write_file(path, text.as_bytes())?;
    }
    let mut text = String::new();
    if arguments.json {
        text = serde_json::to_string_pretty(&result).map_err(|error| ImageError::Codec {
            path: arguments.image.clone(),
            message: error.to_string(),
        })?;
        text.push('\n');
    } else {
        let _ = writeln!(text, "RMSE                 {:.6e}", result.rmse);
        let _ = writeln!(text, "relMSE               {:.6e}", result.rel_mse);
        let _ = writeln!(text, "PSNR                 {:.3} dB", result.psnr_db);
        let _ = writeln!(text, "FLIP                 {:.6}", result.flip_mean);
        let (x, y) = result.max_pixel;
        let _ = writeln!(text, "greatest difference  {:.6e} at pixel ({x}, {y})", result.max_difference);
        let _ = writeln!(text, "mean, image          {:.6?}", result.mean_a);
        let _ = writeln!(text, "mean, reference      {:.6?}", result.mean_b);
        let _ = writeln!(text, "NaN or infinite      {} pixels", result.non_finite);
    }
    super::print(&text)?;
    // A relMSE of NaN counts as different. Pixels that are not finite are left out of relMSE and
    // count as different, too.
    let is_within = |limit| result.rel_mse <= limit && result.non_finite == 0;
    let within = arguments.max_rel_mse.is_none_or(is_within);
    Ok(if within { ExitCode::SUCCESS } else { ExitCode::from(DIFFERENT) })
}

/// Bytes per pixel of a second image and of the computation of the measures, mainly FLIP.
const COMPARED: u64 = 120;

/// Bytes per pixel of a page: differences and their sizes, and images of three bytes.
const SHOWN: u64 = 40;

/// Checks that enough memory is available to compare an image with another one, which takes `each`
/// bytes per pixel.
fn fits(image: &Image, path: &Path, each: u64) -> Result<(), ImageError> {
    let (width, height) = (u64::from(image.width), u64::from(image.height));
    let (needed, free) = (width.saturating_mul(height).saturating_mul(each), memory::available());
    match needed > free {
        true => Err(ImageError::TooLarge { path: path.to_owned(), width, height, needed, free }),
        false => Ok(()),
    }
}

fn view(image: &Image) -> Result<ImageView<'_>, Error> {
    Ok(ImageView::new(image.width as usize, image.height as usize, &image.pixels)?)
}
