//! Backends: CPU, wgpu and CUDA behind one trait.
//!
//! A [`Backend`] holds a scene and a film on a device, and launches kernels. The renderer of the
//! crate `trisect` drives it. [`open`] chooses one as `--backend` does.

pub mod cpu;
pub mod cuda;
mod error;
mod host_memory;
mod method;
mod passes;
mod rows;
mod select;
mod target;
pub mod wgpu;

pub use error::BackendError;
pub use host_memory::{HostMemory, HostRecords};
pub use method::{MathMode, Schedule, Traversal};
pub use passes::{DisplayLaunch, Kernel, MAX_PASSES, Pass};
pub use rows::RowSet;
pub use select::{Choice, Selection, list, open};
pub use target::{FrameMemory, HostFrame, RowTarget};

use serde::Serialize;
use std::sync::Arc;
use std::time::Duration;
use trisect_kernels::Variant;
use trisect_shared::aovs::AovSums;
use trisect_shared::bvh::BvhNode;
use trisect_shared::denoise::FilteredPixel;
use trisect_shared::features::Features;
use trisect_shared::film::PixelSums;
use trisect_shared::params::RenderParams;
use trisect_shared::path::FirstHit;
use trisect_shared::scene::Scene;

/// Kind of a device, which decides how work is divided into submissions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum DeviceKind {
    /// Threads of this machine's CPU.
    Cpu,
    /// A hardware GPU.
    Gpu,
    /// A graphics driver that computes on the CPU, such as Mesa's lavapipe.
    SoftwareGpu,
}

/// A device that can render.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Device {
    /// `cpu`, `wgpu` or `cuda`.
    pub backend: &'static str,
    /// Index for `--device`.
    pub index: usize,
    /// Name that the driver gives.
    pub name: String,
    /// Kind of the device.
    pub kind: DeviceKind,
    /// Driver, threads and memory, for people.
    pub details: String,
    /// Timer of [`Backend::render`]: `wall clock`, `CUDA events` or `timestamp queries`.
    pub timer: &'static str,
}

/// Arrays of a scene as kernels read them, without bounds checks.
#[derive(Clone, Copy)]
pub struct SceneRecords<'a>(Scene<'a>);

impl<'a> SceneRecords<'a> {
    /// Wraps the arrays of a scene.
    ///
    /// # Safety
    ///
    /// The scene was validated: every index in a record, BVH and light table included, is one of
    /// the array that it refers to.
    #[allow(unsafe_code, reason = "a promise of the caller")]
    pub unsafe fn new(scene: Scene<'a>) -> Self {
        Self(scene)
    }

    /// Returns the arrays that the kernels get.
    pub fn scene(&self) -> Scene<'a> {
        self.0
    }
}

/// Parameters of a kernel launch over the uploaded scene, within the film of
/// [`Backend::begin_film`].
#[derive(Clone, Copy, Debug)]
pub struct Launch(RenderParams);

impl Launch {
    /// Wraps launch parameters.
    ///
    /// # Safety
    ///
    /// Roots, counts and first indices are those of the uploaded scene, and the size is that of the
    /// film: kernels check none of them.
    #[allow(unsafe_code, reason = "a promise of the caller")]
    pub unsafe fn new(params: RenderParams) -> Self {
        Self(params)
    }

    /// Returns the parameters that the kernels get.
    pub fn params(&self) -> &RenderParams {
        &self.0
    }
}

/// Description of a film: what stays the same over all submissions of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilmDesc {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Kernel variant.
    pub variant: Variant,
    /// Math build of the kernels.
    pub math: MathMode,
}

impl FilmDesc {
    /// Returns `width * height`.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// Device with a scene and a film on it, which stay there between calls.
///
/// Calls come in this order: [`upload`](Self::upload) once; then, for each frame,
/// [`begin_film`](Self::begin_film), [`upload_tile_entries`](Self::upload_tile_entries) if the
/// launches use tile entries that are not there yet, and, for each chunk of samples, any number of
/// [`render`](Self::render) and one [`read_film`](Self::read_film).
pub trait Backend: Send {
    /// Returns the device in use.
    fn device(&self) -> &Device;

    /// Returns the fastest traversal and schedule for a kernel with these features in this math
    /// build (docs/notebook/kernels-and-schedules.md, docs/notebook/vulkan.md). With
    /// [`Traversal::Wide`] a wide BVH is built, and each kernel that traces the binary BVH can
    /// trace it instead.
    fn best_method(&self, _kernel: Features, _math: MathMode) -> (Traversal, Schedule) {
        (Traversal::Stack, Schedule::Regenerate)
    }

    /// Copies a scene to the device.
    fn upload(&mut self, scene: &SceneRecords) -> Result<(), BackendError>;

    /// Writes the nodes of [tile entries](trisect_shared::tile_entry) after those of the scene, in
    /// place of earlier ones.
    fn upload_tile_entries(&mut self, nodes: &[BvhNode]) -> Result<(), BackendError>;

    /// Selects the kernel, and makes a film of [`PixelSums::UNWRITTEN`].
    fn begin_film(&mut self, job: &FilmDesc) -> Result<(), BackendError>;

    /// Renders one submission into the film and waits for it. Returns the device's own measure of
    /// its time.
    fn render(&mut self, launch: &Launch) -> Result<Duration, BackendError>;

    /// Copies these rows of the film, packed, to `film`, which has a record for each of their
    /// pixels. Resets the film to [`PixelSums::UNWRITTEN`], in these rows at least.
    fn read_film(&mut self, rows: &RowSet, film: &mut [PixelSums]) -> Result<(), BackendError>;

    /// Copies these rows of the AOV sums, packed, to `guides`, for a kernel that writes them.
    /// Resets them to [`AovSums::UNWRITTEN`], in these rows at least.
    fn read_aovs(&mut self, rows: &RowSet, guides: &mut [AovSums]) -> Result<(), BackendError>;

    /// Writes the sums of all pixels to the film, and their AOV sums if the film's kernel writes
    /// AOV sums; otherwise `guides` is empty.
    fn write_film(&mut self, film: &[PixelSums], guides: &[AovSums]) -> Result<(), BackendError>;

    /// Runs the passes of the denoiser over the film and its AOV sums, which stay as they are.
    /// Returns the device's own measure of the time of each pass.
    ///
    /// # Safety
    ///
    /// Each pass reads what the passes before it wrote, in this call or in that of an earlier
    /// frame, and its rows and its views are those of the image: kernels do not check that.
    #[allow(unsafe_code, reason = "a promise of the caller")]
    unsafe fn denoise(&mut self, passes: &[Pass]) -> Result<Vec<Duration>, BackendError>;

    /// Copies one of the denoiser's two images, after its passes, to `pixels`, which has a record
    /// for each pixel of the film.
    fn read_denoised(&mut self, image: usize, pixels: &mut [FilteredPixel]) -> Result<(), BackendError>;

    /// Converts rows of the last frame's image for a display and copies them to the host. Returns
    /// the device's own measure of the time of the conversion.
    ///
    /// # Safety
    ///
    /// A pass has written the image that the launch reads.
    #[allow(unsafe_code, reason = "a promise of the caller")]
    unsafe fn display(
        &mut self,
        frame: &DisplayLaunch,
        to: &mut RowTarget<'_>,
    ) -> Result<Duration, BackendError>;

    /// Returns another backend on the same device with the same scene. Both render at the same
    /// time: while one waits for its last lanes or for the host, the other's lanes fill the device.
    /// Returns `None` if that gains nothing.
    fn second_stream(&self) -> Result<Option<Box<dyn Backend>>, BackendError> {
        Ok(None)
    }

    /// Pins this memory (locks its pages), so that the device copies to it directly:
    /// [`display`](Self::display) and [`read_film`](Self::read_film) are then faster. If that is
    /// not possible, their speed stays the same.
    fn pin(&mut self, _memory: &Arc<HostMemory>) {}

    /// Undoes [`pin`](Self::pin).
    fn unpin(&mut self, _memory: &Arc<HostMemory>) {}

    /// Writes the first hit of each pixel's first sample of the launch to `hits`, which has a
    /// record for each pixel of the film.
    fn first_hits(&mut self, launch: &Launch, hits: &mut [FirstHit]) -> Result<(), BackendError>;
}
