//! The pass that converts a frame for a display.

use super::denoise::DenoiseBuffers;
use super::film::DeviceFilm;
use super::misuse;
use bytemuck::bytes_of;
use trisect_device::{BackendError, Buffer, Command, Device, Dispatch, RowTarget, Started};
use trisect_kernels::{DISPLAY, entry_point};
use trisect_shared::display::DisplayParams;

/// Conversion of a frame for a display.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DisplayPass {
    /// Launch parameters.
    pub params: DisplayParams,
    /// Denoised image, 0 or 1; `None` for the plain mean of the samples, which the parameters then
    /// select for all columns.
    pub image: Option<usize>,
    /// True if the samples are the sums over frames, and not this frame's.
    pub accumulated: bool,
}

impl DisplayPass {
    /// Starts to convert rows of the last frame's image, in `film` or `denoiser`, for a display and
    /// to copy them to the host. Takes the image of an earlier display, if there is any, and
    /// returns it.
    ///
    /// # Safety
    ///
    /// Nothing accesses the target's memory, and no other display is started with the image, before
    /// the device was waited for.
    pub(super) unsafe fn start(
        &self,
        device: &mut dyn Device,
        (film, denoiser): (&DeviceFilm, Option<&DenoiseBuffers>),
        shown: Option<Buffer>,
        to: RowTarget<'_>,
    ) -> Result<(Buffer, Started), BackendError> {
        let entry_point = entry_point(DISPLAY).ok_or_else(|| misuse("there is no such kernel"))?;
        let (of, params) = (film.of, &self.params);
        let denoiser = denoiser.filter(|buffers| buffers.fits(of.pixels()));
        let sums = match self.accumulated {
            true => denoiser.and_then(|buffers| buffers.accumulated()),
            false => Some(&film.sums),
        };
        let image = match self.image {
            // The film stands in for the denoised image: the kernel loads from it, and shows only
            // means.
            None => Some(&film.sums),
            Some(image) => denoiser.and_then(|buffers| buffers.images.get(image)),
        };
        let (Some(sums), Some(image)) = (sums, image) else {
            return Err(misuse("no pass wrote this image"));
        };
        let rows = params.first_row..to.rows().end().max(params.first_row);
        if (params.width, params.height) != (of.width, of.height)
            || rows.end > of.height
            || to.row_bytes() != of.width as usize * size_of::<u32>()
        {
            return Err(misuse("the display is of an image of another size"));
        }
        device.compile(entry_point, of.math)?;
        let bytes = of.pixels() * size_of::<u32>() as u64;
        let shown = match shown.filter(|shown| shown.bytes() >= bytes) {
            Some(shown) => shown,
            None => device.allocate(bytes, "the display image")?,
        };
        let launch = Dispatch {
            entry_point,
            math: of.math,
            params: bytes_of(params),
            lengths: &[],
            arrays: vec![sums, image, &shown],
            threads: (of.width, rows.len() as u32),
        };
        // SAFETY: each array has at least a record for each pixel of the film, whose size was
        // compared; records of a film are larger than those of a denoised image. The caller
        // promises the rest.
        let started = unsafe { device.start_with_copy(vec![Command::Dispatch(launch)], &shown, to) }?;
        Ok((shown, started))
    }
}
