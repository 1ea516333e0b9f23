//! The denoiser's images on a device, and the launches of its passes.

use super::film::DeviceFilm;
use super::misuse;
use crate::denoise::{Kernel, Pass};
use bytemuck::bytes_of;
use trisect_device::{BackendError, Buffer, Command, Device, Dispatch, MathMode, RowSet, RowTarget, Started};
use trisect_kernels::entry_point;
use trisect_shared::aovs::AovSums;
use trisect_shared::denoise::{FilteredPixel, GBufferTexel, HistoryPixel};
use trisect_shared::film::PixelSums;

/// Buffers between passes, with a record for each pixel.
pub(super) struct DenoiseBuffers {
    /// Number of pixels of the image that they hold.
    pixels: u64,
    /// Number of pixels that they have room for.
    capacity: u64,
    pub images: [Buffer; 2],
    gbuffer: Buffer,
    temporal: Option<TemporalBuffers>,
}

/// Buffers that frames keep for later ones: history, and sums while the camera rests.
struct TemporalBuffers {
    histories: [Buffer; 2],
    sums: Buffer,
    aovs: Buffer,
}

/// Allocates zeros, because frames of some rows do not write the other rows.
fn zeros<T>(device: &mut dyn Device, pixels: u64, what: &'static str) -> Result<Buffer, BackendError> {
    let buffer = device.allocate(pixels * size_of::<T>() as u64, what)?;
    // SAFETY: no launch.
    unsafe { device.run(vec![clear::<T>(&buffer, pixels)]) }?;
    Ok(buffer)
}

/// Returns a command that sets the records of so many pixels to zeros.
fn clear<T>(buffer: &Buffer, pixels: u64) -> Command<'_> {
    Command::Fill { buffer, first: 0, bytes: pixels * size_of::<T>() as u64, ones: false }
}

impl DenoiseBuffers {
    fn new(device: &mut dyn Device, pixels: u64) -> Result<Self, BackendError> {
        let what = "the denoised image";
        let images =
            [zeros::<FilteredPixel>(device, pixels, what)?, zeros::<FilteredPixel>(device, pixels, what)?];
        let gbuffer = zeros::<GBufferTexel>(device, pixels, "the G-buffer")?;
        Ok(Self { pixels, capacity: pixels, images, gbuffer, temporal: None })
    }

    /// Makes the buffers those of an image of another size, if they have room: a camera that comes
    /// to rest changes the resolution, and fresh memory takes longer than a frame.
    fn resized(self, device: &mut dyn Device, pixels: u64) -> Result<Option<Self>, BackendError> {
        if self.pixels == pixels || self.capacity < pixels {
            return Ok(Some(self).filter(|buffers| buffers.pixels == pixels));
        }
        let [first, second] = &self.images;
        let mut commands = vec![
            clear::<FilteredPixel>(first, pixels),
            clear::<FilteredPixel>(second, pixels),
            clear::<GBufferTexel>(&self.gbuffer, pixels),
        ];
        if let Some(TemporalBuffers { histories: [first, second], sums, aovs }) = &self.temporal {
            commands.extend([
                clear::<HistoryPixel>(first, pixels),
                clear::<HistoryPixel>(second, pixels),
                clear::<PixelSums>(sums, pixels),
                clear::<AovSums>(aovs, pixels),
            ]);
        }
        // SAFETY: no launch.
        unsafe { device.run(commands) }?;
        Ok(Some(Self { pixels, ..self }))
    }

    /// Starts the passes of the denoiser, which [`passes`](crate::denoise) made, over a film and
    /// its AOV sums, which stay as they are. Takes the buffers of earlier frames, if there are any,
    /// and returns them.
    pub fn start(
        device: &mut dyn Device,
        film: &DeviceFilm,
        kept: Option<Self>,
        passes: &[Pass],
    ) -> Result<(Self, Started), BackendError> {
        let of = film.of;
        let fits = |pass: &Pass| {
            (pass.params.width, pass.params.height) == (of.width, of.height) && pass.rows.end <= of.height
        };
        if !of.has_aovs() || !passes.iter().all(fits) {
            return Err(misuse("the film has no AOV sums, or is of another size"));
        }
        let kept = match kept {
            Some(kept) => kept.resized(device, of.pixels())?,
            None => None,
        };
        let mut buffers = match kept {
            Some(buffers) => buffers,
            None => Self::new(device, of.pixels())?,
        };
        let temporal = |pass: &Pass| pass.accumulated || pass.kernel.is_temporal();
        if buffers.temporal.is_none() && passes.iter().any(temporal) {
            buffers.temporal = Some(TemporalBuffers::new(device, buffers.capacity)?);
        }
        let mut launches = Vec::new();
        for pass in passes {
            let launch = buffers.launch(pass, of.math, [&film.sums, &film.aovs])?;
            device.compile(launch.entry_point, of.math)?;
            launches.push(Command::Dispatch(launch));
        }
        // SAFETY: all arrays have a record for each pixel of the film, whose size was compared.
        let started = unsafe { device.start(launches) }?;
        Ok((buffers, started))
    }

    /// Copies one of the denoiser's two images, after its passes, to `pixels`, which has a record
    /// for each pixel of the image.
    pub fn read(
        &self,
        device: &mut dyn Device,
        image: usize,
        (width, height): (u32, u32),
        pixels: &mut [FilteredPixel],
    ) -> Result<(), BackendError> {
        let count = u64::from(width) * u64::from(height);
        let from = self.images.get(image).filter(|_| self.fits(count));
        let from = from.ok_or_else(|| misuse("no pass wrote this image"))?;
        if pixels.len() as u64 != count {
            return Err(misuse("the pixels are for an image of another size"));
        }
        let to = RowTarget::records(pixels, &RowSet::from(0..height));
        // SAFETY: no launch.
        unsafe { device.run(vec![Command::Read { from, to }]) }.map(|_| ())
    }

    /// Returns the launch of a pass. `own` are the sums and AOV sums of this frame.
    fn launch<'a>(
        &'a self,
        pass: &'a Pass,
        math: MathMode,
        own: [&'a Buffer; 2],
    ) -> Result<Dispatch<'a>, BackendError> {
        let entry_point = entry_point(pass.kernel.name()).ok_or_else(|| misuse("there is no such pass"))?;
        Ok(Dispatch {
            entry_point,
            math,
            params: bytes_of(&pass.params),
            lengths: &[],
            arrays: self.arrays(pass, own)?,
            threads: pass.threads(),
        })
    }

    /// Returns the sums over frames, if frames were summed.
    pub fn accumulated(&self) -> Option<&Buffer> {
        self.temporal.as_ref().map(|frames| &frames.sums)
    }

    /// Returns sums and AOV sums over frames, if frames were summed.
    pub fn accumulated_with_aovs(&self) -> Option<[&Buffer; 2]> {
        self.temporal.as_ref().map(|frames| [&frames.sums, &frames.aovs])
    }

    /// Returns whether the buffers are those of an image of this many pixels.
    pub fn fits(&self, pixels: u64) -> bool {
        self.pixels == pixels
    }

    /// Returns the arrays of a pass, in the order of its bindings. `own` are the sums and AOV sums
    /// of this frame.
    fn arrays<'a>(&'a self, pass: &Pass, own: [&'a Buffer; 2]) -> Result<Vec<&'a Buffer>, BackendError> {
        let image = |index: usize| self.images.get(index).ok_or_else(|| misuse("there is no such image"));
        let (from, to) = (image(pass.from)?, image(pass.to)?);
        if !pass.accumulated && !pass.kernel.is_temporal() {
            return Ok(vec![own[0], own[1], from, to, &self.gbuffer]);
        }
        let Some(frames) = &self.temporal else { return Err(misuse("no frame was kept")) };
        let kept = [&frames.sums, &frames.aovs];
        let of = if pass.accumulated { kept } else { own };
        let [first, second] = &frames.histories;
        let (past, next) = if pass.past == 0 { (first, second) } else { (second, first) };
        Ok(match pass.kernel {
            Kernel::Add => vec![own[0], own[1], kept[0], kept[1], to, &self.gbuffer],
            Kernel::Reproject => vec![of[0], of[1], from, &self.gbuffer, past, to, next],
            _ => vec![of[0], of[1], from, to, &self.gbuffer],
        })
    }
}

impl TemporalBuffers {
    fn new(device: &mut dyn Device, pixels: u64) -> Result<Self, BackendError> {
        let what = "the denoiser's history";
        Ok(Self {
            histories: [
                zeros::<HistoryPixel>(device, pixels, what)?,
                zeros::<HistoryPixel>(device, pixels, what)?,
            ],
            sums: zeros::<PixelSums>(device, pixels, what)?,
            aovs: zeros::<AovSums>(device, pixels, what)?,
        })
    }
}
