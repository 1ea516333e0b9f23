//! A scene on a device, with everything that passes keep there.

use super::bands::{Bands, UseBand};
use super::chunk_counter::ChunkCounter;
use super::denoise::DenoiseBuffers;
use super::display::DisplayPass;
use super::film::{DeviceFilm, FilmDesc, Launch};
use super::halves::{DeviceHalves, MeasuredNoise};
use super::misuse;
use super::scene::SceneArrays;
use super::totals::DeviceTotals;
use crate::denoise::Pass;
use crate::film::{AovTotals, FilmCounts, PixelTotals, RadianceTotals};
use std::ops::Range;
use std::time::Duration;
use trisect_device::{BackendError, Buffer, Device, HostFrame, RowSet, RowTarget, Started};
use trisect_shared::aovs::AovSums;
use trisect_shared::bvh::BvhNode;
use trisect_shared::denoise::FilteredPixel;
use trisect_shared::film::PixelSums;
use trisect_shared::params::RenderParams;
use trisect_shared::path::FirstHit;
use trisect_shared::totals::{RADIANCE_SUMS, SUMS};

/// Scene on a device, with the film and the images that passes keep there between calls.
///
/// Calls come in this order: for each frame, [`begin_film`](Self::begin_film),
/// [`write_tile_entries`](Self::write_tile_entries) if the launches use tile entries that are not
/// there yet, and, for each chunk of samples, any number of [`start_render`](Self::start_render)
/// and one [`read_film`](Self::read_film).
pub(crate) struct DeviceScene {
    device: Box<dyn Device>,
    /// Arrays of the scene; `None` if another scene could not be uploaded in their place.
    scene: Option<SceneArrays>,
    film: Option<DeviceFilm>,
    totals: Option<DeviceTotals>,
    halves: Option<DeviceHalves>,
    counter: Option<ChunkCounter>,
    bands: Bands,
    denoiser: Option<DenoiseBuffers>,
    /// Images for displays, 4 bytes a pixel, that nothing uses.
    shown: Vec<Buffer>,
}

/// Display of a frame that may still run.
pub(crate) struct StartedDisplay {
    shown: Buffer,
    started: Started,
    /// Nothing reads it before the device was waited for.
    memory: HostFrame,
}

impl StartedDisplay {
    /// Returns whether the device ran it before it returned.
    pub fn has_ended(&self) -> bool {
        self.started.has_ended()
    }
}

/// Returns the film, or an error if there is none.
fn made(film: Option<&DeviceFilm>) -> Result<&DeviceFilm, BackendError> {
    film.ok_or_else(|| misuse("no film was prepared"))
}

/// Returns the scene; an error without one.
fn there(scene: Option<&SceneArrays>) -> Result<&SceneArrays, BackendError> {
    scene.ok_or_else(|| misuse(NO_SCENE))
}

/// Message of a call without a scene.
const NO_SCENE: &str = "the scene could not be uploaded";

/// Returns the halves, or an error if there are none.
fn prepared(halves: Option<&DeviceHalves>) -> Result<&DeviceHalves, BackendError> {
    halves.ok_or_else(|| misuse(NO_HALVES))
}

/// Message of a call without halves.
const NO_HALVES: &str = "no halves were prepared";

impl DeviceScene {
    /// Wraps a scene on a device.
    pub fn new(device: Box<dyn Device>, scene: SceneArrays) -> Self {
        let (film, totals, halves, counter) = (None, None, None, None);
        let (bands, denoiser, shown) = (Bands::default(), None, Vec::new());
        let scene = Some(scene);
        Self { device, scene, film, totals, halves, counter, bands, denoiser, shown }
    }

    /// Returns the device.
    pub fn device(&self) -> &dyn Device {
        self.device.as_ref()
    }

    /// Returns whether the device has a wide BVH of the scene.
    pub fn has_wide(&self) -> bool {
        self.scene.as_ref().is_some_and(SceneArrays::has_wide)
    }

    /// Returns the device, to change what does not concern the scene.
    pub fn device_mut(&mut self) -> &mut dyn Device {
        self.device.as_mut()
    }

    /// Returns the device itself, for another scene.
    pub fn into_device(mut self) -> Box<dyn Device> {
        self.drop_halves();
        self.bands.unpin(self.device.as_mut());
        self.device
    }

    /// Replaces the scene by another one. `upload` gets the device and the arrays of this scene,
    /// and returns those of the other one; if it took the arrays, there is no scene after an error.
    /// What passes keep stays on the device.
    pub fn set_scene<E>(
        &mut self,
        upload: impl FnOnce(&mut dyn Device, &mut Option<SceneArrays>) -> Result<SceneArrays, E>,
    ) -> Result<(), E> {
        self.scene = Some(upload(self.device.as_mut(), &mut self.scene)?);
        Ok(())
    }

    /// Returns the same scene on a second stream of the device, or `None` if that gains nothing.
    pub fn second_stream(&self) -> Result<Option<Self>, BackendError> {
        let scene = there(self.scene.as_ref())?;
        Ok(self.device.second_stream()?.map(|device| Self::new(device, scene.clone())))
    }

    /// Writes the nodes of [tile entries](trisect_shared::tile_entry) after those of the scene, in
    /// place of earlier ones.
    pub fn write_tile_entries(&mut self, nodes: &[BvhNode]) -> Result<(), BackendError> {
        let scene = self.scene.as_mut().ok_or_else(|| misuse(NO_SCENE))?;
        scene.write_tile_entries(self.device.as_mut(), nodes)
    }

    /// Selects the kernel, and makes a film of [`PixelSums::UNWRITTEN`].
    pub fn begin_film(&mut self, of: FilmDesc) -> Result<(), BackendError> {
        // Halves of images of another size make room.
        if self.halves.as_ref().is_some_and(|halves| !halves.is_of(&of)) {
            self.drop_halves();
        }
        self.film = Some(DeviceFilm::begin(self.device.as_mut(), of, self.film.take())?);
        Ok(())
    }

    /// Starts to render one submission into the film. The launch is one of the renderer that
    /// uploaded the scene.
    pub fn start_render(&mut self, launch: &Launch) -> Result<Started, BackendError> {
        let scene = there(self.scene.as_ref())?;
        made(self.film.as_ref())?.start_render(self.device.as_mut(), scene, launch)
    }

    /// Waits for what was started. Returns the device's own measure of the time of each launch.
    pub fn wait(&mut self, started: Started) -> Result<Vec<Duration>, BackendError> {
        self.device.wait(started)
    }

    /// Copies these rows of the film, packed, to `sums`, and those of its AOV sums to `aovs`, which
    /// is empty if they are not wanted. Resets these rows at least to [`PixelSums::UNWRITTEN`] and
    /// [`AovSums::UNWRITTEN`].
    pub fn read_film(
        &mut self,
        rows: &RowSet,
        sums: &mut [PixelSums],
        aovs: &mut [AovSums],
    ) -> Result<(), BackendError> {
        made(self.film.as_ref())?.read(self.device.as_mut(), rows, sums, aovs)
    }

    /// Makes totals without samples for the film.
    ///
    /// # Errors
    ///
    /// [`BackendError::TooLarge`] if the device lacks the memory.
    pub fn begin_totals(&mut self) -> Result<(), BackendError> {
        let film = made(self.film.as_ref())?;
        self.totals = Some(DeviceTotals::begin(self.device.as_mut(), film, self.totals.take())?);
        Ok(())
    }

    /// Frees the totals' memory.
    pub fn drop_totals(&mut self) {
        self.totals = None;
    }

    /// Adds the film's chunk of `samples` in these rows to the totals, and resets it.
    pub fn add_chunk(&mut self, rows: &RowSet, samples: &Range<u32>) -> Result<(), BackendError> {
        let totals = self.totals.as_ref().ok_or_else(|| misuse("no totals were prepared"))?;
        totals.add_chunk(self.device.as_mut(), made(self.film.as_ref())?, rows, samples)
    }

    /// Makes counts of no chunk for each of `parts`, rows of the film.
    pub fn begin_counts(&mut self, parts: &[RowSet]) -> Result<(), BackendError> {
        let film = made(self.film.as_ref())?;
        self.counter = Some(ChunkCounter::begin(self.device.as_mut(), film, self.counter.take(), parts)?);
        Ok(())
    }

    /// Adds the film's chunk of `samples` to the counts.
    pub fn count_chunk(&mut self, samples: &Range<u32>) -> Result<(), BackendError> {
        let counter = self.counter.as_ref().ok_or_else(|| misuse("no counts were prepared"))?;
        counter.add(self.device.as_mut(), made(self.film.as_ref())?, samples)
    }

    /// Reads the counts of each part.
    pub fn read_counts(&mut self) -> Result<Vec<FilmCounts>, BackendError> {
        let counter = self.counter.as_ref().ok_or_else(|| misuse("no counts were prepared"))?;
        counter.read(self.device.as_mut())
    }

    /// Reads the totals of all pixels of some rows, and their AOV totals if there are any.
    pub fn read_totals(
        &mut self,
        rows: &RowSet,
        pixels: &mut [PixelTotals],
        aovs: &mut [AovTotals],
    ) -> Result<(), BackendError> {
        let totals = self.totals.as_ref().ok_or_else(|| misuse("no totals were prepared"))?;
        let device: &mut dyn Device = self.device.as_mut();
        let through = (device, &mut self.bands);
        totals.read(through, made(self.film.as_ref())?, rows, pixels, aovs)
    }

    /// Reads the totals of the radiance of all pixels of some rows.
    pub fn read_radiance(
        &mut self,
        rows: &RowSet,
        pixels: &mut [RadianceTotals],
    ) -> Result<(), BackendError> {
        let totals = self.totals.as_ref().ok_or_else(|| misuse("no totals were prepared"))?;
        let device: &mut dyn Device = self.device.as_mut();
        let through = (device, &mut self.bands);
        totals.read_radiance(through, made(self.film.as_ref())?, rows, pixels)
    }

    /// Makes halves without samples for images of the film's size.
    ///
    /// # Errors
    ///
    /// [`BackendError::TooLarge`] if the device lacks the memory.
    pub fn begin_halves(&mut self) -> Result<(), BackendError> {
        let film = made(self.film.as_ref())?;
        let halves = DeviceHalves::begin(self.device.as_mut(), film, self.halves.take())?;
        halves.prepare(self.device.as_mut(), &mut self.bands);
        self.halves = Some(halves);
        Ok(())
    }

    /// Frees the halves' memory.
    pub fn drop_halves(&mut self) {
        if let Some(halves) = self.halves.take() {
            halves.unpin(self.device.as_mut());
        }
    }

    /// Adds the film's chunk of `samples` to a half, and resets it.
    pub fn add_chunk_to_half(&mut self, half: usize, samples: &Range<u32>) -> Result<(), BackendError> {
        let halves = prepared(self.halves.as_ref())?;
        halves.add_chunk(self.device.as_mut(), made(self.film.as_ref())?, half, samples)
    }

    /// Requests a number of samples for each tile, whose last one is before `end`.
    pub fn request_samples(&mut self, counts: &[u32], end: u32) -> Result<(), BackendError> {
        let halves = prepared(self.halves.as_ref())?;
        halves.request(self.device.as_mut(), made(self.film.as_ref())?, counts, end)
    }

    /// Adds the film's samples, as many for each tile as were requested last, to a half.
    pub fn add_tiles_to_half(&mut self, half: usize) -> Result<(), BackendError> {
        let halves = prepared(self.halves.as_ref())?;
        halves.add_tiles(self.device.as_mut(), made(self.film.as_ref())?, half)
    }

    /// Measures the noise of the halves: of each tile, and of each pixel `with_errors`.
    pub fn noise(&mut self, from_halves: bool, with_errors: bool) -> Result<MeasuredNoise<'_>, BackendError> {
        let halves = self.halves.as_mut().ok_or_else(|| misuse(NO_HALVES))?;
        halves.noise(self.device.as_mut(), made(self.film.as_ref())?, from_halves, with_errors)
    }

    /// Reads the radiance of both halves, by bands: `use_band` gets their place in the image, and
    /// the totals of each half.
    pub fn read_radiance_of_halves(
        &mut self,
        use_band: &mut UseBand<'_, RadianceTotals, 2>,
    ) -> Result<(), BackendError> {
        let halves = prepared(self.halves.as_ref())?;
        let device: &mut dyn Device = self.device.as_mut();
        let through = (device, &mut self.bands);
        halves.read(through, made(self.film.as_ref())?, RADIANCE_SUMS, use_band)
    }

    /// Reads the totals of both halves, by bands.
    pub fn read_halves(&mut self, use_band: &mut UseBand<'_, PixelTotals, 2>) -> Result<(), BackendError> {
        let halves = prepared(self.halves.as_ref())?;
        let device: &mut dyn Device = self.device.as_mut();
        let through = (device, &mut self.bands);
        halves.read(through, made(self.film.as_ref())?, SUMS, use_band)
    }

    /// Writes the sums of all pixels to the film, and their AOV sums if the film's kernel writes
    /// AOV sums; otherwise `aovs` is empty.
    pub fn write_film(&mut self, sums: &[PixelSums], aovs: &[AovSums]) -> Result<(), BackendError> {
        made(self.film.as_ref())?.write(self.device.as_mut(), sums, aovs)
    }

    /// Writes the first hit of each pixel's first sample of the launch to `hits`, which has a
    /// record for each pixel of the film.
    pub fn first_hits(&mut self, params: &RenderParams, hits: &mut [FirstHit]) -> Result<(), BackendError> {
        let scene = there(self.scene.as_ref())?;
        made(self.film.as_ref())?.first_hits(self.device.as_mut(), scene, params, hits)
    }

    /// Runs the passes of the denoiser over the film and its AOV sums, which stay as they are.
    /// Returns the device's own measure of the time of each pass.
    pub fn denoise(&mut self, passes: &[Pass]) -> Result<Vec<Duration>, BackendError> {
        let started = self.start_denoise(passes)?;
        self.device.wait(started)
    }

    /// Starts the passes of the denoiser.
    pub fn start_denoise(&mut self, passes: &[Pass]) -> Result<Started, BackendError> {
        let film = made(self.film.as_ref())?;
        let (buffers, started) =
            DenoiseBuffers::start(self.device.as_mut(), film, self.denoiser.take(), passes)?;
        self.denoiser = Some(buffers);
        Ok(started)
    }

    /// Copies one of the denoiser's two images, after its passes, to `pixels`, which has a record
    /// for each pixel of the image.
    pub fn read_denoised(
        &mut self,
        image: usize,
        size: (u32, u32),
        pixels: &mut [FilteredPixel],
    ) -> Result<(), BackendError> {
        let buffers = self.denoiser.as_ref().ok_or_else(|| misuse("nothing was denoised"))?;
        buffers.read(self.device.as_mut(), image, size, pixels)
    }

    /// Copies rows of the last frame's sums and AOV sums, packed, which stay on the device: those
    /// over several frames if they are `accumulated`.
    pub fn copy_sums(
        &mut self,
        accumulated: bool,
        rows: &RowSet,
        records: (&mut [PixelSums], &mut [AovSums]),
    ) -> Result<(), BackendError> {
        let film = made(self.film.as_ref())?;
        let of = match accumulated {
            false => None,
            true => {
                let buffers = self.denoiser.as_ref().filter(|buffers| buffers.fits(film.of.pixels()));
                let kept = buffers.and_then(DenoiseBuffers::accumulated_with_aovs);
                Some(kept.ok_or_else(|| misuse("no frame was kept"))?)
            }
        };
        film.copy(self.device.as_mut(), of, rows, records)
    }

    /// Converts rows of the last frame's image for a display and copies them to the host. Returns
    /// the device's own measure of the time of the conversion.
    pub fn display(&mut self, pass: &DisplayPass, to: RowTarget<'_>) -> Result<Duration, BackendError> {
        let from = (made(self.film.as_ref())?, self.denoiser.as_ref());
        // SAFETY: the device is waited for here.
        let (shown, started) = unsafe { pass.start(self.device.as_mut(), from, self.shown.pop(), to) }?;
        let times = self.device.wait(started)?;
        self.shown.push(shown);
        Ok(times.into_iter().sum())
    }

    /// Starts what [`display`](Self::display) does, for all rows that the pass converts.
    pub fn start_display(
        &mut self,
        pass: &DisplayPass,
        mut memory: HostFrame,
    ) -> Result<StartedDisplay, BackendError> {
        let from = (made(self.film.as_ref())?, self.denoiser.as_ref());
        let to = memory.target();
        // SAFETY: both memories are out of reach until the device was waited for.
        let (shown, started) = unsafe { pass.start(self.device.as_mut(), from, self.shown.pop(), to) }?;
        Ok(StartedDisplay { shown, started, memory })
    }

    /// Waits for a display. Returns the device's own measure of the time of the conversion, and the
    /// memory with the pixels.
    pub fn end_display(&mut self, display: StartedDisplay) -> Result<(Duration, HostFrame), BackendError> {
        let times = self.device.wait(display.started)?;
        self.shown.push(display.shown);
        Ok((times.into_iter().sum(), display.memory))
    }
}
