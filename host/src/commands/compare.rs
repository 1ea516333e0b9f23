//! `trisect compare`.

use crate::cli::CompareArgs;
use std::process::ExitCode;
use trisect::Error;
use trisect::image::{Image, ImageError};
use trisect::metrics::{ImageView, compare};

/// Images differ by more than the user allows.
const DIFFERENT: u8 = 5;

/// Compares two images and prints the measures.
pub fn run(arguments: &CompareArgs) -> Result<ExitCode, Error> {
    let image = Image::read(&arguments.image)?;
    let reference = Image::read(&arguments.reference)?;
    let result = compare(&view(&image)?, &view(&reference)?)?;
    if arguments.json {
        let text = serde_json::to_string_pretty(&result).map_err(|error| ImageError::Codec {
            path: arguments.image.clone(),
            message: error.to_string(),
        })?;
        println!("{text}");
    } else {
        println!("RMSE                 {:.6e}", result.rmse);
        println!("relMSE               {:.6e}", result.rel_mse);
        println!("PSNR                 {:.3} dB", result.psnr_db);
        println!("FLIP                 {:.6}", result.flip_mean);
        let (x, y) = result.max_pixel;
        println!("greatest difference  {:.6e} at pixel ({x}, {y})", result.max_difference);
        println!("mean, image          {:.6?}", result.mean_a);
        println!("mean, reference      {:.6?}", result.mean_b);
        println!("NaN or infinite      {} pixels", result.non_finite);
    }
    // Written so that a relMSE of NaN differs.
    let within = arguments.max_rel_mse.is_none_or(|limit| result.rel_mse <= limit);
    Ok(if within { ExitCode::SUCCESS } else { ExitCode::from(DIFFERENT) })
}

fn view(image: &Image) -> Result<ImageView<'_>, Error> {
    Ok(ImageView::new(image.width as usize, image.height as usize, &image.pixels)?)
}
