//! Open Image Denoise: a trained network in a library of its own, which is loaded at run time.
//! Neither building nor running this program needs it.
//!
//! Images are copied to buffers of its device, so that a GPU serves as well as the processor. The
//! features, albedo and normal, have the noise of few samples: they are denoised first, each by
//! itself, and then guide the filter of the radiance as images without noise (`cleanAux`).

#![allow(unsafe_code, reason = "each call of the library states why its arguments are valid")]

mod device;
mod error;
mod inputs;
mod library;

pub use error::OidnError;

use device::Device;
use inputs::Inputs;
use library::Library;
use std::time::{Duration, Instant};
use trisect_image::Image;
use trisect_shared::aovs::AovSums;
use trisect_shared::film::PixelSums;

/// Environment variable with the path of the library, or of a folder that has it.
pub const VARIABLE: &str = "TRISECT_OIDN_LIBRARY";

/// Checks that the library can be used.
///
/// # Errors
///
/// [`OidnError`] says where it was searched, or why it cannot be used, and what helps.
pub fn check() -> Result<(), OidnError> {
    Library::shared().map(|_| ())
}

/// Opens the library's device, and returns its version, the type of the device and the file.
///
/// # Errors
///
/// Those of [`check`], and [`OidnError::Failed`] if there is no device.
pub fn describe() -> Result<String, OidnError> {
    let library = Library::shared()?;
    let device = Device::open(library, rayon::current_num_threads())?;
    let [major, minor, patch] = device.version;
    Ok(format!("Open Image Denoise {major}.{minor}.{patch} on {} ({})", device.kind, library.path))
}

/// Denoises sums and AOV sums of an image of `width` by `height` pixels, which have a record for
/// each. Returns the image, and the wall-clock times of denoising the albedo, the normal and the
/// radiance. Pixels without radiance of their own or near by are NaN.
pub(crate) fn denoise(
    sums: &[PixelSums],
    aovs: &[AovSums],
    (width, height): (u32, u32),
) -> Result<(Image, Vec<Duration>), OidnError> {
    denoise_by(Library::shared()?, sums, aovs, (width, height))
}

fn denoise_by(
    library: &Library,
    sums: &[PixelSums],
    aovs: &[AovSums],
    size: (u32, u32),
) -> Result<(Image, Vec<Duration>), OidnError> {
    let device = Device::open(library, rayon::current_num_threads())?;
    let Inputs { color: mut pixels, albedo, normal, lost } = Inputs::new(size.0 as usize, sums, aovs);
    let color = device.upload(&pixels)?;
    let albedo = device.upload(&albedo)?;
    let normal = device.upload(&normal)?;
    let mut times = Vec::new();
    let mut run = |action, images: &[_], switches: &[_]| {
        let start = Instant::now();
        let result = device.run(action, images, size, switches);
        times.push(start.elapsed());
        result
    };
    // Each filter writes its result over its input.
    run("denoising the albedo", &[(c"albedo", &albedo), (c"output", &albedo)], &[])?;
    run("denoising the normal", &[(c"normal", &normal), (c"output", &normal)], &[])?;
    let images = [(c"color", &color), (c"albedo", &albedo), (c"normal", &normal), (c"output", &color)];
    run("denoising the radiance", &images, &[c"hdr", c"cleanAux"])?;
    device.download(&color, &mut pixels)?;
    lost.into_iter().for_each(|pixel| pixels[pixel] = [f32::NAN; 3]);
    Ok((Image { width: size.0, height: size.1, pixels }, times))
}
