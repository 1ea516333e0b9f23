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
mod margin;

pub use error::OidnError;

use device::{Device, Mode};
use inputs::Inputs;
use library::Library;
use margin::Margin;
use std::sync::OnceLock;
use std::time::Duration;
use trisect_image::Image;
use trisect_shared::aovs::AovSums;
use trisect_shared::film::PixelSums;
use web_time::Instant;

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
    match DESCRIPTION.get() {
        Some(known) => Ok(known.clone()),
        None => open(Library::shared()?, None).map(|(_, description)| description.clone()),
    }
}

/// Description of the library with its device, once it was opened.
static DESCRIPTION: OnceLock<String> = OnceLock::new();

/// Opens the library's device, with a number of threads or the library's own, and describes both.
fn open(library: &Library, threads: Option<usize>) -> Result<(Device<'_>, &'static String), OidnError> {
    let device = Device::open(library, threads)?;
    let describe = || {
        let [major, minor, patch] = device.version;
        format!("Open Image Denoise {major}.{minor}.{patch} on {} ({})", device.kind, library.path)
    };
    let description = DESCRIPTION.get_or_init(describe);
    Ok((device, description))
}

/// Denoises sums and AOV sums of an image of `width` by `height` pixels, which have a record for
/// each. Returns the image, and the wall-clock times of denoising the albedo, the normal and the
/// radiance. Pixels without radiance of their own or near by are NaN.
pub(crate) fn denoise(
    sums: &[PixelSums],
    aovs: &[AovSums],
    (width, height): (u32, u32),
) -> Result<(Image, Vec<Duration>), OidnError> {
    let (device, _) = open(Library::shared()?, Some(rayon::current_num_threads()))?;
    let Inputs { color, albedo, normal, lost } = Inputs::new(width as usize, sums, aovs);
    let margin = Margin::of(width, height);
    let mut pixels = margin.add(&color);
    let color = device.upload(&pixels)?;
    let albedo = device.upload(&margin.add(&albedo))?;
    let normal = device.upload(&margin.add(&normal))?;
    let mut times = Vec::new();
    let mut run = |action, images: &[_], mode| {
        let start = Instant::now();
        let result = device.run(action, images, margin.outer(), mode);
        times.push(start.elapsed());
        result
    };
    // Each filter writes its result over its input.
    run("denoising the albedo", &[(c"albedo", &albedo), (c"output", &albedo)], Mode::Feature)?;
    run("denoising the normal", &[(c"normal", &normal), (c"output", &normal)], Mode::Feature)?;
    let images = [(c"color", &color), (c"albedo", &albedo), (c"normal", &normal), (c"output", &color)];
    run("denoising the radiance", &images, Mode::Radiance)?;
    device.download(&color, &mut pixels)?;
    let mut pixels = margin.remove(&pixels);
    lost.into_iter().for_each(|pixel| pixels[pixel] = [f32::NAN; 3]);
    Ok((Image { width, height, pixels }, times))
}
