//! Backends: the CPU, wgpu and CUDA behind one trait.

pub mod cpu;
pub mod cuda;
mod error;
mod select;
pub mod wgpu;

pub use error::BackendError;
pub use select::{Choice, Selection, list, open};

use crate::bvh::{Bvh, Wide};
use crate::denoise::{DisplayLaunch, Pass};
use crate::film::{HostMemory, RowSet, RowTarget};
use crate::lights::Lights;
use crate::render::{MathMode, Schedule, Traversal};
use crate::scene;
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
use trisect_shared::wide::WideTree;

/// What sort of device, which decides how work is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum DeviceKind {
    /// Threads of this machine.
    Cpu,
    /// Hardware.
    Gpu,
    /// A graphics driver that computes on the CPU, such as Mesa's lavapipe.
    SoftwareGpu,
}

/// A device that can render.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Device {
    /// `cpu`, `wgpu` or `cuda`.
    pub backend: &'static str,
    /// For `--device`.
    pub index: usize,
    /// As the driver names it.
    pub name: String,
    /// What sort.
    pub kind: DeviceKind,
    /// Driver, threads, memory: for people.
    pub details: String,
    /// What [`Backend::render`]'s times are: `wall pass_cost`, `CUDA events`, `timestamp queries`.
    pub timer: &'static str,
}

/// The arrays of a scene, as kernels read them: without bounds checks. Only a [`Renderer`](crate::render::Renderer) makes one,
/// after it proved the indices.
#[derive(Clone, Copy)]
pub struct SceneRecords<'a>(Scene<'a>);

impl<'a> SceneRecords<'a> {
    /// Of a proven scene, the trees and the light table that were made for it.
    pub(crate) fn new(
        scene: &'a scene::Scene,
        bvh: &'a Bvh,
        wide: Option<&'a Wide>,
        lights: &'a Lights,
    ) -> Self {
        Self(Scene {
            spheres: &scene.spheres,
            nodes: &bvh.nodes,
            materials: &lights.materials,
            planars: &scene.flats,
            triangles: &bvh.triangles,
            shading: &bvh.shading,
            lights: &lights.lights,
            textures: &scene.textures,
            texels: &scene.texels,
            environment: scene.environment.as_ref().map_or(&[], |environment| &environment.texels),
            wide: wide.map_or(WideTree::NONE, Wide::tree),
        })
    }

    /// What the kernels get.
    pub fn scene(&self) -> Scene<'a> {
        self.0
    }
}

/// A launch of the scene that was uploaded, within the film that was prepared. Only a [`Renderer`](crate::render::Renderer)
/// makes one: kernels trust its root and its size.
#[derive(Clone, Copy, Debug)]
pub struct Launch(RenderParams);

impl Launch {
    pub(crate) fn new(params: RenderParams) -> Self {
        Self(params)
    }

    /// What the kernels get.
    pub fn params(&self) -> &RenderParams {
        &self.0
    }
}

/// What stays the same over all submissions of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilmDesc {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Which kernel.
    pub variant: Variant,
    /// Which build of the kernels.
    pub math: MathMode,
}

impl FilmDesc {
    /// `width * height`.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// A device with a scene and a film on it. Data stays there between calls.
///
/// Calls come in this order: `upload` once, then for each frame `prepare`, `view` where the launches name a view that is not there yet, and, for each
/// chunk of samples, any number of `render` and one `read_film`.
pub trait Backend: Send {
    /// The device in use.
    fn device(&self) -> &Device;

    /// What is fastest here for this build of a kernel with these features, by docs/performance.md. With [`Traversal::Wide`], each kernel that
    /// traces the binary tree can trace the wide one instead, which is then made.
    fn best_method(&self, _kernel: Features, _math: MathMode) -> (Traversal, Schedule) {
        (Traversal::Stack, Schedule::Regenerate)
    }

    /// Copies a scene to the device.
    fn upload(&mut self, scene: &SceneRecords) -> Result<(), BackendError>;

    /// Puts these nodes after those of the scene, in place of earlier ones: the tree as the [camera](trisect_shared::tile_entry) sees it.
    fn upload_tile_entries(&mut self, nodes: &[BvhNode]) -> Result<(), BackendError>;

    /// Chooses the kernel, and makes a film of [`PixelSums::UNWRITTEN`].
    fn begin_film(&mut self, job: &FilmDesc) -> Result<(), BackendError>;

    /// Renders one submission into the film and waits for it. Returns the device's own measure of its time.
    fn render(&mut self, launch: &Launch) -> Result<Duration, BackendError>;

    /// Copies these rows of the film, one below the other, to `film` (as long as they have pixels) and resets the film to
    /// [`PixelSums::UNWRITTEN`], in these rows at least.
    fn read_film(&mut self, rows: &RowSet, film: &mut [PixelSums]) -> Result<(), BackendError>;

    /// The same of the guides, for a kernel that writes them: resets them to [`AovSums::UNWRITTEN`].
    fn read_aovs(&mut self, rows: &RowSet, guides: &mut [AovSums]) -> Result<(), BackendError>;

    /// Writes sums and guides (as long as the job has pixels) where a kernel that writes guides has them.
    fn write_film(&mut self, film: &[PixelSums], guides: &[AovSums]) -> Result<(), BackendError>;

    /// Denoises what film and guides hold, which stay as they are. Returns the device's own measure of each pass.
    fn denoise(&mut self, passes: &[Pass]) -> Result<Vec<Duration>, BackendError>;

    /// Copies one of the denoiser's two images, after its passes, to `pixels` (as long as the job has pixels).
    fn read_denoised(&mut self, image: usize, pixels: &mut [FilteredPixel]) -> Result<(), BackendError>;

    /// Makes rows of the last frame's image for a screen and copies them to the host. Returns the device's own measure of making them.
    fn display(&mut self, frame: &DisplayLaunch, to: &mut RowTarget<'_>) -> Result<Duration, BackendError>;

    /// Another one of the same device with the same scene, which renders while this one does: where one waits for its last lanes or for the host, the other's
    /// lanes fill the device. None where that brings nothing.
    fn second_stream(&self) -> Result<Option<Box<dyn Backend>>, BackendError> {
        Ok(None)
    }

    /// Keeps this memory from being swapped out, so that the device copies to it without a detour: [`display`](Self::display) and
    /// [`read_film`](Self::read_film) are faster then. Where that cannot be done, they stay as fast as they are.
    fn pin(&mut self, _memory: &Arc<HostMemory>) {}

    /// Lets go of it.
    fn unpin(&mut self, _memory: &Arc<HostMemory>) {}

    /// Writes the first hit of each pixel's first sample of the launch to `hits` (as long as the job has pixels).
    fn first_hits(&mut self, launch: &Launch, hits: &mut [FirstHit]) -> Result<(), BackendError>;
}
