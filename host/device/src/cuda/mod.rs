//! CUDA backend, through NVIDIA's driver, which is loaded at run time: one binary works with and
//! without it.
#![allow(
    unsafe_code,
    reason = "launches hand raw device memory to kernels; each block states why it is sound"
)]

mod denoise;
mod driver;
mod extract;
mod kernel;
mod memory;
mod pinned;

pub use driver::devices;

use super::{Backend, BackendError, Device, FilmDesc, Launch, SceneRecords};
use crate::{DisplayLaunch, Pass};
use crate::{HostMemory, RowSet, RowTarget};
use crate::{MathMode, Schedule, Traversal};
use bytemuck::Zeroable;
use cudarc::driver::sys::CUevent_flags;
use cudarc::driver::{
    CudaContext, CudaEvent, CudaFunction, CudaSlice, CudaStream, LaunchConfig, PushKernelArg,
};
use driver::{Argument, describe, failed, probe, unavailable};
use pinned::Pinned;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;
use trisect_kernels::{FIRST_HIT, WORKGROUP};
use trisect_shared::aovs::AovSums;
use trisect_shared::bvh::BvhNode;
use trisect_shared::denoise::FilteredPixel;
use trisect_shared::features::{AOVS, Features, PERSISTENT, has};
use trisect_shared::film::{Compensation, PixelSums};
use trisect_shared::params::RenderParams;
use trisect_shared::path::FirstHit;
use trisect_shared::scene::SceneLengths;

/// Oldest compute capability, major and minor, that the kernels are compiled for.
const MIN_CAPABILITY: (i32, i32) = (6, 1);

/// Index of the nodes among the scene's arrays.
const NODES: usize = 1;

/// Maximum number of blocks down a grid.
const GRID_LIMIT: u32 = 65_535;

/// Maximum number of pixels in a launch of persistent lanes, which count them in 32 bits.
const MAX_QUEUE: u64 = 1 << 31;

/// A CUDA device, with a scene and a film.
pub struct Cuda {
    device: Device,
    stream: Arc<CudaStream>,
    /// Kernels that were used so far, by entry point and math build.
    kernels: HashMap<(&'static str, MathMode), CudaFunction>,
    scene: Option<SceneOnDevice>,
    kernel: Option<CudaFunction>,
    /// True if the lanes of `kernel` take pixels from a queue.
    persistent: bool,
    /// Counter of that queue.
    counter: CudaSlice<u32>,
    film: Option<Film>,
    denoiser: Option<denoise::Images>,
    /// Image for a display, 4 bytes a pixel.
    shown: Option<CudaSlice<u8>>,
    /// Pinned host memory, to which this device copies directly.
    pinned: Vec<Pinned>,
    math: MathMode,
    start: CudaEvent,
    end: CudaEvent,
}

/// Film on the device, by pixel: [`PixelSums`], [`Compensation`] and, for a kernel that writes
/// them, [`AovSums`].
struct Film {
    sums: CudaSlice<u8>,
    compensations: CudaSlice<u8>,
    aovs: CudaSlice<u8>,
}

/// Scene arrays on the device, in the order of the kernels' arguments.
struct SceneOnDevice {
    lengths: Argument<SceneLengths>,
    /// Number of the scene's own nodes; nodes of tile entries follow them.
    nodes: usize,
    /// Scene arrays, shared with second streams.
    arrays: [Arc<CudaSlice<u8>>; 10],
}

impl Cuda {
    /// Opens the device with this index, or the first.
    pub fn open(index: Option<usize>) -> Result<Self, BackendError> {
        let count = probe()?;
        let index = index.unwrap_or(0);
        if index >= count {
            return Err(BackendError::NoSuchDevice { backend: "cuda", index, devices: count });
        }
        let context = CudaContext::new(index).map_err(failed("creating a context"))?;
        // SAFETY: memory is used by the stream that it was allocated in, except a scene's, which is
        // complete before a second stream begins and is never written afterwards.
        unsafe { context.disable_event_tracking() };
        let capability = context.compute_capability().map_err(failed("asking for an attribute"))?;
        if capability < MIN_CAPABILITY {
            return Err(unavailable(
                format!(
                    "device {index} has compute capability {}.{}, 6.1 is needed",
                    capability.0, capability.1
                ),
                "choose another --device or --backend",
            ));
        }
        Self::within(&context, describe(index)?)
    }

    /// Creates a backend with its own stream in a context.
    fn within(context: &Arc<CudaContext>, device: Device) -> Result<Self, BackendError> {
        let event =
            || context.new_event(Some(CUevent_flags::CU_EVENT_DEFAULT)).map_err(failed("creating an event"));
        let stream = context.new_stream().map_err(failed("creating a stream"))?;
        let counter = stream.alloc_zeros(1).map_err(failed("allocating memory"))?;
        Ok(Self {
            device,
            stream,
            kernels: HashMap::new(),
            scene: None,
            kernel: None,
            persistent: false,
            counter,
            film: None,
            denoiser: None,
            shown: None,
            pinned: Vec::new(),
            math: MathMode::Precise,
            start: event()?,
            end: event()?,
        })
    }

    /// Makes the context current on the calling thread, because another thread may have created the
    /// renderer.
    fn bind(&self) -> Result<(), BackendError> {
        self.stream.context().bind_to_thread().map_err(failed("entering the context"))
    }

    /// Writes nodes after the scene's own.
    fn append_nodes(&self, scene: &mut SceneOnDevice, nodes: &[BvhNode]) -> Result<(), BackendError> {
        let bytes: &[u8] = bytemuck::cast_slice(nodes);
        let own = scene.nodes * size_of::<BvhNode>();
        let array = &mut scene.arrays[NODES];
        // A second stream has tile entries of its own, so a shared array is copied first.
        if array.len() < own + bytes.len() || Arc::get_mut(array).is_none() {
            let mut larger = self.allocate(own + bytes.len(), "the BVH's tile entries")?;
            let (from, mut to) = (array.slice(0..own), larger.slice_mut(0..own));
            self.stream.memcpy_dtod(&from, &mut to).map_err(failed("copying the scene"))?;
            self.stream.synchronize().map_err(failed("copying the scene"))?;
            *array = Arc::new(larger);
        }
        let Some(array) = Arc::get_mut(array) else { return Err(not_prepared()) };
        let mut to = array.slice_mut(own..own + bytes.len());
        self.stream.memcpy_htod(bytes, &mut to).map_err(failed("copying the tile entries"))?;
        scene.lengths.0.nodes = scene.nodes + nodes.len();
        Ok(())
    }

    /// Launches `kernel` over the rows of `params` and waits for it. Returns the device time.
    fn launch(
        &mut self,
        kernel: &CudaFunction,
        params: &RenderParams,
        [output, carries, guides]: [&mut CudaSlice<u8>; 3],
        persistent: bool,
    ) -> Result<Duration, BackendError> {
        let Some(scene) = &self.scene else {
            return Err(BackendError::Device {
                backend: "cuda",
                action: "rendering",
                message: "no scene was uploaded".to_owned(),
            });
        };
        let argument = Argument(*params);
        let limit = u64::from(GRID_LIMIT) * u64::from(WORKGROUP.1);
        if u64::from(params.rows) > limit {
            let (width, rows) = (params.width, params.rows);
            return Err(BackendError::TooLong { backend: "cuda", width, rows, limit });
        }
        let mut grid = (params.width.div_ceil(WORKGROUP.0), params.rows.div_ceil(WORKGROUP.1), 1);
        if persistent {
            if u64::from(grid.0) * u64::from(grid.1) * u64::from(WORKGROUP.0 * WORKGROUP.1) > MAX_QUEUE {
                let (width, rows) = (params.width, params.rows);
                let limit = MAX_QUEUE / u64::from(width);
                return Err(BackendError::TooLong { backend: "cuda", width, rows, limit });
            }
            grid = (self.resident_blocks(kernel)?.min(grid.0 * grid.1), 1, 1);
            self.stream.memset_zeros(&mut self.counter).map_err(failed("resetting the queue"))?;
        }
        let config =
            LaunchConfig { grid_dim: grid, block_dim: (WORKGROUP.0, WORKGROUP.1, 1), shared_mem_bytes: 0 };
        self.start.record(&self.stream).map_err(failed("starting the timer"))?;
        let mut arguments = self.stream.launch_builder(kernel);
        arguments.arg(&argument).arg(&scene.lengths);
        for array in &scene.arrays {
            arguments.arg(&**array);
        }
        arguments.arg(output).arg(carries).arg(&mut self.counter).arg(guides);
        // SAFETY: the arguments are those of every entry point (see trisect_kernels), and the
        // counter is 0 for persistent lanes. `output`, for a render kernel `carries`, and for one
        // with AOVS `guides`, have a record for each pixel of the image. The host checked the
        // scene's indices.
        unsafe { arguments.launch(config) }.map_err(failed("launching"))?;
        self.end.record(&self.stream).map_err(failed("stopping the timer"))?;
        self.end.synchronize().map_err(failed("rendering"))?;
        let milliseconds = self.start.elapsed_ms(&self.end).map_err(failed("reading the timer"))?;
        Ok(Duration::from_secs_f64(f64::from(milliseconds.max(0.0)) * 1e-3))
    }
}

impl Backend for Cuda {
    fn device(&self) -> &Device {
        &self.device
    }

    fn best_method(&self, _kernel: Features, _math: MathMode) -> (Traversal, Schedule) {
        (Traversal::Stack, Schedule::Persistent)
    }

    fn upload(&mut self, scene: &SceneRecords) -> Result<(), BackendError> {
        self.bind()?;
        let scene = scene.scene();
        self.scene = None; // freed before the new one is allocated
        let lengths = Argument(SceneLengths::of(&scene));
        let arrays: [CudaSlice<u8>; 10] = [
            self.copy(scene.spheres, "the scene's spheres")?,
            self.copy(scene.nodes, "the scene's BVH")?,
            self.copy(scene.materials, "the scene's materials")?,
            self.copy(scene.planars, "the scene's quads and discs")?,
            self.copy(scene.triangles, "the scene's triangles")?,
            self.copy(scene.shading, "the scene's normals and texture coordinates")?,
            self.copy(scene.lights, "the scene's lights")?,
            self.copy(scene.textures, "the scene's textures")?,
            self.copy(scene.texels, "the scene's texels")?,
            self.copy(scene.environment, "the scene's environment map")?,
        ];
        let arrays = arrays.map(Arc::new);
        self.scene = Some(SceneOnDevice { lengths, nodes: scene.nodes.len(), arrays });
        Ok(())
    }

    fn upload_tile_entries(&mut self, nodes: &[BvhNode]) -> Result<(), BackendError> {
        self.bind()?;
        let Some(mut scene) = self.scene.take() else { return Err(not_prepared()) };
        let viewed = self.append_nodes(&mut scene, nodes);
        self.scene = Some(scene);
        viewed
    }

    fn begin_film(&mut self, job: &FilmDesc) -> Result<(), BackendError> {
        self.bind()?;
        self.math = job.math;
        self.persistent = has(job.variant.features, PERSISTENT);
        self.kernel = Some(self.kernel(job.variant.name, job.math)?);
        let bytes = job.pixels() * size_of::<PixelSums>();
        let guides = if has(job.variant.features, AOVS) { job.pixels() * size_of::<AovSums>() } else { 0 };
        let mut film = match self.film.take() {
            Some(film) if film.sums.len() == bytes && film.aovs.len() >= guides => film,
            other => {
                drop(other); // freed before the new one is allocated
                let carries = self.allocate(job.pixels() * size_of::<Compensation>(), "the film")?;
                let guides = self.allocate(guides, "the film's AOV sums")?;
                Film { sums: self.allocate(bytes, "the film")?, compensations: carries, aovs: guides }
            }
        };
        self.erase(&mut film.sums)?;
        self.erase(&mut film.aovs)?;
        self.film = Some(film);
        Ok(())
    }

    fn render(&mut self, launch: &Launch) -> Result<Duration, BackendError> {
        self.bind()?;
        let (Some(kernel), Some(mut film)) = (self.kernel.clone(), self.film.take()) else {
            return Err(not_prepared());
        };
        let time = self.launch(
            &kernel,
            launch.params(),
            [&mut film.sums, &mut film.compensations, &mut film.aovs],
            self.persistent,
        );
        self.film = Some(film);
        time
    }

    fn read_film(&mut self, rows: &RowSet, film: &mut [PixelSums]) -> Result<(), BackendError> {
        self.bind()?;
        let Some(mut memory) = self.film.take() else { return Err(not_prepared()) };
        let read = self.read_rows(rows, &memory.sums, bytemuck::cast_slice_mut(film));
        let erased = self.erase(&mut memory.sums);
        self.film = Some(memory);
        read.and(erased)
    }

    fn read_aovs(&mut self, rows: &RowSet, guides: &mut [AovSums]) -> Result<(), BackendError> {
        self.bind()?;
        let Some(mut memory) = self.film.take() else { return Err(not_prepared()) };
        let read = self.read_rows(rows, &memory.aovs, bytemuck::cast_slice_mut(guides));
        let erased = self.erase(&mut memory.aovs);
        self.film = Some(memory);
        read.and(erased)
    }

    fn write_film(&mut self, film: &[PixelSums], guides: &[AovSums]) -> Result<(), BackendError> {
        self.bind()?;
        self.write_sums(film, guides)
    }

    unsafe fn denoise(&mut self, passes: &[Pass]) -> Result<Vec<Duration>, BackendError> {
        self.bind()?;
        self.denoise_film(passes)
    }

    fn read_denoised(&mut self, image: usize, pixels: &mut [FilteredPixel]) -> Result<(), BackendError> {
        self.bind()?;
        self.read_image(image, pixels)
    }

    unsafe fn display(
        &mut self,
        frame: &DisplayLaunch,
        to: &mut RowTarget<'_>,
    ) -> Result<Duration, BackendError> {
        self.bind()?;
        self.display_frame(frame, to)
    }

    fn second_stream(&self) -> Result<Option<Box<dyn Backend>>, BackendError> {
        self.bind()?;
        // The scene that both streams use must be complete before the second one begins.
        self.stream.synchronize().map_err(failed("copying the scene"))?;
        let scene = self.scene.as_ref().map(|scene| SceneOnDevice { arrays: scene.arrays.clone(), ..*scene });
        let twin = Self::within(self.stream.context(), self.device.clone())?;
        Ok(Some(Box::new(Self { scene, kernels: self.kernels.clone(), ..twin })))
    }

    fn pin(&mut self, memory: &Arc<HostMemory>) {
        // After an error, the owner of pinned memory may be gone.
        self.pinned.retain(|pinned| !pinned.is_left());
        if memory.bytes() > 0 && !self.pinned.iter().any(|pinned| pinned.is_of(memory)) {
            self.pinned.extend(Pinned::new(&self.stream, memory));
        }
    }

    fn unpin(&mut self, memory: &Arc<HostMemory>) {
        self.pinned.retain(|pinned| !pinned.is_of(memory));
    }

    fn first_hits(&mut self, launch: &Launch, hits: &mut [FirstHit]) -> Result<(), BackendError> {
        self.bind()?;
        let kernel = self.kernel(FIRST_HIT, self.math)?;
        let mut memory = self.allocate(size_of_val(hits), "the first hits")?;
        self.erase(&mut memory)?;
        let mut no_carries = self.allocate(size_of::<Compensation>(), "the first hits")?;
        let mut no_guides = self.allocate(size_of::<AovSums>(), "the first hits")?;
        self.launch(&kernel, launch.params(), [&mut memory, &mut no_carries, &mut no_guides], false)?;
        hits.fill(FirstHit::zeroed());
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(hits);
        self.stream.memcpy_dtoh(&memory, bytes).map_err(failed("reading first hits"))?;
        self.stream.synchronize().map_err(failed("reading first hits"))
    }
}

fn not_prepared() -> BackendError {
    BackendError::Device { backend: "cuda", action: "rendering", message: "no film was prepared".to_owned() }
}
