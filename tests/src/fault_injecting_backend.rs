//! A backend whose launches can fail or take long.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use std::time::Duration;
use trisect::denoise::{DisplayLaunch, Pass};
use trisect::device::cpu::Cpu;
use trisect::device::{Backend, BackendError, Device, DeviceKind, FilmDesc, Launch, SceneRecords};
use trisect::film::{RowSet, RowTarget};
use trisect_shared::aovs::AovSums;
use trisect_shared::bvh::BvhNode;
use trisect_shared::denoise::FilteredPixel;
use trisect_shared::film::PixelSums;
use trisect_shared::path::FirstHit;

/// The CPU backend with all threads of this machine, and a function that is called after each
/// launch.
pub struct FaultInjectingBackend {
    inner: Cpu,
    device: Device,
    after: Box<dyn FnMut() -> Result<(), BackendError> + Send>,
}

impl FaultInjectingBackend {
    /// Opens the backend. A launch fails if `after` returns an error.
    ///
    /// # Panics
    ///
    /// If the CPU backend does not open.
    pub fn new(after: impl FnMut() -> Result<(), BackendError> + Send + 'static) -> Self {
        let inner = Cpu::open(None).unwrap();
        Self { device: inner.device().clone(), inner, after: Box::new(after) }
    }

    /// Reports the device as a GPU, so that the host adds a chunk to the film while the next one is
    /// rendered.
    #[must_use]
    pub fn as_gpu(mut self) -> Self {
        self.device.kind = DeviceKind::Gpu;
        self
    }
}

impl Backend for FaultInjectingBackend {
    fn device(&self) -> &Device {
        &self.device
    }

    fn upload(&mut self, scene: &SceneRecords) -> Result<(), BackendError> {
        self.inner.upload(scene)
    }

    fn upload_tile_entries(&mut self, nodes: &[BvhNode]) -> Result<(), BackendError> {
        self.inner.upload_tile_entries(nodes)
    }

    fn begin_film(&mut self, job: &FilmDesc) -> Result<(), BackendError> {
        self.inner.begin_film(job)
    }

    fn render(&mut self, launch: &Launch) -> Result<Duration, BackendError> {
        let took = self.inner.render(launch)?;
        (self.after)()?;
        Ok(took)
    }

    fn read_film(&mut self, rows: &RowSet, film: &mut [PixelSums]) -> Result<(), BackendError> {
        self.inner.read_film(rows, film)
    }

    fn read_aovs(&mut self, rows: &RowSet, guides: &mut [AovSums]) -> Result<(), BackendError> {
        self.inner.read_aovs(rows, guides)
    }

    fn write_film(&mut self, film: &[PixelSums], guides: &[AovSums]) -> Result<(), BackendError> {
        self.inner.write_film(film, guides)
    }

    #[allow(unsafe_code, reason = "the contract of the trait")]
    unsafe fn denoise(&mut self, passes: &[Pass]) -> Result<Vec<Duration>, BackendError> {
        // SAFETY: the caller's promise.
        unsafe { self.inner.denoise(passes) }
    }

    fn read_denoised(&mut self, image: usize, pixels: &mut [FilteredPixel]) -> Result<(), BackendError> {
        self.inner.read_denoised(image, pixels)
    }

    #[allow(unsafe_code, reason = "the contract of the trait")]
    unsafe fn display(
        &mut self,
        frame: &DisplayLaunch,
        to: &mut RowTarget<'_>,
    ) -> Result<Duration, BackendError> {
        // SAFETY: the caller's promise.
        unsafe { self.inner.display(frame, to) }
    }

    fn first_hits(&mut self, launch: &Launch, hits: &mut [FirstHit]) -> Result<(), BackendError> {
        self.inner.first_hits(launch, hits)
    }
}
