//! wgpu backend: Vulkan gets the SPIR-V kernels unchanged (pass-through), other drivers through
//! naga.

mod adapter;
mod denoise;
mod display;
mod memory;
mod pipeline;
mod transfer;

pub use adapter::devices;

use super::{Backend, BackendError, Device, DeviceKind, FilmDesc, Launch, SceneRecords};
use crate::{DisplayLaunch, Pass};
use crate::{MathMode, Schedule, Traversal};
use crate::{RowSet, RowTarget};
use adapter::Gpu;
use pipeline::Pipelines;
use std::time::{Duration, Instant};
use transfer::Upload;
use trisect_kernels::{FIRST_HIT, WORKGROUP, variant_by_name};
use trisect_shared::aovs::AovSums;
use trisect_shared::bvh::BvhNode;
use trisect_shared::denoise::FilteredPixel;
use trisect_shared::features::{AOVS, Features, HEAVY, PERSISTENT, TEXTURES, has, has_any};
use trisect_shared::film::{Compensation, PixelSums};
use trisect_shared::params::RenderParams;
use trisect_shared::path::FirstHit;
use wgpu::{
    Buffer, BufferDescriptor, BufferUsages, ComputePassTimestampWrites, QuerySet, QuerySetDescriptor,
    QueryType,
};

/// Route of the kernels to the driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Route {
    /// Unchanged if the adapter supports it (Vulkan), else through naga.
    PassThrough,
    /// Through naga, which reads SPIR-V and writes the driver's language.
    Naga,
}

/// Usage of the scene's arrays. The host writes them; that of the nodes is also copied to a larger
/// one, which has space for tile entries.
const SCENE_USAGE: BufferUsages =
    BufferUsages::STORAGE.union(BufferUsages::COPY_DST).union(BufferUsages::COPY_SRC);

/// Number of a scene's arrays.
const SCENE_ARRAYS: usize = 10;

/// Minimum number of bytes of a buffer: an empty array is bound as one record that no kernel reads.
const MIN_BUFFER: u64 = 112;

/// Index of the nodes among the scene's arrays.
const NODES: usize = 1;

/// A wgpu adapter, with a scene and a film.
pub struct Wgpu {
    device: Device,
    gpu: Gpu,
    pipelines: Pipelines,
    route: Route,
    denoiser: Option<denoise::Denoiser>,
    display: Option<display::Display>,
    params: Buffer,
    /// Counter of the queue from which persistent lanes take pixels.
    counter: Buffer,
    scene: Option<[Buffer; SCENE_ARRAYS]>,
    /// Number of the scene's own nodes; nodes of tile entries follow them.
    nodes: usize,
    film: Option<Film>,
    entry: &'static str,
    math: MathMode,
    timer: Option<Timer>,
}

/// Film on the device, the bytes that reset it, and the buffers through which it is read and
/// written.
struct Film {
    sums: Buffer,
    /// [`Compensation`] of each pixel.
    compensations: Buffer,
    unwritten: Buffer,
    staging: Buffer,
    upload: Upload,
    aovs: AovBuffers,
}

/// [`AovSums`] of each pixel for a kernel that writes them, otherwise the smallest buffers, and the
/// buffers through which they are read and written.
struct AovBuffers {
    records: Buffer,
    staging: Buffer,
    upload: Upload,
}

struct Timer {
    queries: QuerySet,
    resolved: Buffer,
    staging: Buffer,
    nanoseconds_per_tick: f64,
}

impl Wgpu {
    /// Opens the adapter with this index, or the best hardware one. A software adapter is opened
    /// only by its index.
    pub fn open(index: Option<usize>, route: Route) -> Result<Self, BackendError> {
        let (mut device, gpu) = adapter::open(index)?;
        let pipelines = Pipelines::new(&gpu, route, SCENE_ARRAYS, 4)?;
        let buffer = |size, usage| {
            gpu.device.create_buffer(&BufferDescriptor {
                label: None,
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let timer = gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY).then(|| Timer {
            queries: gpu.device.create_query_set(&QuerySetDescriptor {
                label: None,
                ty: QueryType::Timestamp,
                count: 2,
            }),
            resolved: buffer(16, BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
            staging: buffer(16, BufferUsages::MAP_READ | BufferUsages::COPY_DST),
            nanoseconds_per_tick: f64::from(gpu.queue.get_timestamp_period()),
        });
        device.timer = if timer.is_some() { "timestamp queries" } else { "wall clock" };
        let params = buffer(size_of::<RenderParams>() as u64, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        let counter = buffer(4, BufferUsages::STORAGE | BufferUsages::COPY_DST);
        gpu.check("creating buffers")?;
        Ok(Self {
            device,
            gpu,
            pipelines,
            route,
            denoiser: None,
            display: None,
            params,
            counter,
            scene: None,
            nodes: 0,
            film: None,
            entry: "render",
            math: MathMode::Precise,
            timer,
        })
    }

    /// Runs an entry point over the rows of `params` and waits for it. Returns the device time.
    fn dispatch(
        &self,
        entry: &'static str,
        params: &RenderParams,
        [output, carries, guides]: [&Buffer; 3],
    ) -> Result<Duration, BackendError> {
        let Some(scene) = &self.scene else {
            return Err(self.misuse("no scene was uploaded"));
        };
        let persistent = variant_by_name(entry).is_some_and(|variant| has(variant.features, PERSISTENT));
        let mut params = *params;
        let (mut groups_x, mut groups_y) =
            (params.width.div_ceil(WORKGROUP.0), params.rows.div_ceil(WORKGROUP.1));
        let limit = self.gpu.device.limits().max_compute_workgroups_per_dimension;
        if groups_x.max(groups_y) > limit {
            let limit = u64::from(limit) * u64::from(WORKGROUP.0.min(WORKGROUP.1));
            let (width, rows) = (params.width, params.rows);
            return Err(BackendError::TooLong { backend: "wgpu", width, rows, limit });
        }
        if persistent {
            // As many lanes as pixels; those that start late find the queue empty. A software
            // adapter runs lanes one after the other, and Mesa's lavapipe ends each loop of a lane
            // after 65,535 iterations: there each lane takes one pixel.
            let groups = groups_x * groups_y;
            (groups_x, groups_y) = (groups.min(limit), groups.div_ceil(limit));
            if self.device.kind == DeviceKind::SoftwareGpu {
                params.max_lane_pixels = 1;
            }
            self.gpu.queue.write_buffer(&self.counter, 0, &[0; 4]);
        }
        self.gpu.queue.write_buffer(&self.params, 0, bytemuck::bytes_of(&params));
        let film = [output, carries, &self.counter, guides];
        let group =
            self.pipelines.bind(&self.gpu.device, [&self.params].into_iter().chain(scene).chain(film));
        let start = Instant::now();
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(entry),
                timestamp_writes: self.timer.as_ref().map(|timer| ComputePassTimestampWrites {
                    query_set: &timer.queries,
                    beginning_of_pass_write_index: Some(0),
                    end_of_pass_write_index: Some(1),
                }),
            });
            pass.set_pipeline(self.pipelines.get(entry, self.math)?);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(groups_x, groups_y, 1);
        }
        if let Some(timer) = &self.timer {
            encoder.resolve_query_set(&timer.queries, 0..2, &timer.resolved, 0);
            encoder.copy_buffer_to_buffer(&timer.resolved, 0, &timer.staging, 0, 16);
        }
        self.gpu.queue.submit([encoder.finish()]);
        let Some(timer) = &self.timer else {
            self.gpu.wait("rendering")?;
            return Ok(start.elapsed());
        };
        let mut ticks = [0u64; 2];
        self.gpu.read(&timer.staging, bytemuck::cast_slice_mut(&mut ticks), "rendering")?;
        let nanoseconds = ticks[1].wrapping_sub(ticks[0]) as f64 * timer.nanoseconds_per_tick;
        Ok(Duration::from_nanos(nanoseconds as u64))
    }

    fn misuse(&self, message: &str) -> BackendError {
        BackendError::Device { backend: "wgpu", action: "rendering", message: message.to_owned() }
    }
}

impl Backend for Wgpu {
    fn device(&self) -> &Device {
        &self.device
    }

    fn best_method(&self, kernel: Features, math: MathMode) -> (Traversal, Schedule) {
        // Kernels with textures gain from a queue; other heavy ones only with fast math, which
        // shortens their shading (docs/notebook/vulkan.md).
        let large = has(kernel, TEXTURES) || math == MathMode::Fast && has_any(kernel, HEAVY);
        let queue =
            large && self.device.kind != DeviceKind::SoftwareGpu && self.pipelines.pass_through(&self.gpu);
        (Traversal::Stack, if queue { Schedule::Persistent } else { Schedule::Regenerate })
    }

    fn upload(&mut self, scene: &SceneRecords) -> Result<(), BackendError> {
        let scene = scene.scene();
        self.scene = None; // freed before the new one is allocated
        self.nodes = scene.nodes.len();
        self.scene = Some([
            self.store(scene.spheres, "the scene's spheres")?,
            self.store(scene.nodes, "the scene's BVH")?,
            self.store(scene.materials, "the scene's materials")?,
            self.store(scene.planars, "the scene's quads and discs")?,
            self.store(scene.triangles, "the scene's triangles")?,
            self.store(scene.shading, "the scene's normals and texture coordinates")?,
            self.store(scene.lights, "the scene's lights")?,
            self.store(scene.textures, "the scene's textures")?,
            self.store(scene.texels, "the scene's texels")?,
            self.store(scene.environment, "the scene's environment map")?,
        ]);
        self.gpu.check("copying the scene")
    }

    fn upload_tile_entries(&mut self, nodes: &[BvhNode]) -> Result<(), BackendError> {
        let Some(scene) = &self.scene else { return Err(self.misuse("no scene was uploaded")) };
        let bytes: &[u8] = bytemuck::cast_slice(nodes);
        let own = (self.nodes * size_of::<BvhNode>()) as u64;
        let total = own + bytes.len() as u64;
        let mut array = scene[NODES].clone();
        if array.size() < total {
            let larger = self.buffer(total, SCENE_USAGE, "the BVH's tile entries")?;
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&array, 0, &larger, 0, own);
            self.gpu.queue.submit([encoder.finish()]);
            array = larger;
        }
        self.gpu.queue.write_buffer(&array, own, bytes);
        if let Some(scene) = &mut self.scene {
            scene[NODES] = array;
        }
        self.gpu.check("copying the tile entries")
    }

    fn begin_film(&mut self, job: &FilmDesc) -> Result<(), BackendError> {
        // The queue needs an atomic operation on a plain word of a buffer, which naga does not
        // support.
        if has(job.variant.features, PERSISTENT) && !self.pipelines.pass_through(&self.gpu) {
            return Err(BackendError::NoQueue { backend: "wgpu" });
        }
        self.entry = job.variant.name;
        self.math = job.math;
        self.pipelines.compile(&self.gpu, self.entry, self.math)?;
        let bytes = (job.pixels() * size_of::<PixelSums>()) as u64;
        let guides =
            if has(job.variant.features, AOVS) { job.pixels() * size_of::<AovSums>() } else { 0 } as u64;
        let fits = |film: &Film| film.sums.size() == bytes && film.aovs.records.size() >= guides;
        if !self.film.as_ref().is_some_and(fits) {
            self.film = None; // freed before the new one is allocated
            let device = BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
            let sums = self.buffer(bytes, device | BufferUsages::STORAGE, "the film")?;
            let unwritten = self.buffer(bytes, device, "the film")?;
            let staging = self.buffer(bytes, BufferUsages::MAP_READ | BufferUsages::COPY_DST, "the film")?;
            // Each byte of unwritten sums is 0xff, also of the AOV sums, which are copied from
            // here.
            self.gpu.queue.write_buffer(&unwritten, 0, &vec![0xff; unwritten.size() as usize]);
            let carries = (job.pixels() * size_of::<Compensation>()) as u64;
            let carries = self.buffer(carries, BufferUsages::STORAGE, "the film")?;
            let read = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
            let guides = AovBuffers {
                records: self.buffer(guides, device | BufferUsages::STORAGE, "the film's AOV sums")?,
                staging: self.buffer(guides, read, "the film's AOV sums")?,
                upload: Upload::default(),
            };
            self.film = Some(Film {
                sums,
                compensations: carries,
                unwritten,
                staging,
                upload: Upload::default(),
                aovs: guides,
            });
        }
        let Some(film) = &self.film else { return Err(self.misuse("no film")) };
        self.copy(&film.unwritten, &film.sums, "erasing the film")?;
        self.erase_aovs(film)?;
        self.gpu.wait("erasing the film")
    }

    fn render(&mut self, launch: &Launch) -> Result<Duration, BackendError> {
        let Some(film) = &self.film else { return Err(self.misuse("no film was prepared")) };
        self.dispatch(self.entry, launch.params(), [&film.sums, &film.compensations, &film.aovs.records])
    }

    fn read_film(&mut self, rows: &RowSet, pixels: &mut [PixelSums]) -> Result<(), BackendError> {
        let Some(film) = &self.film else { return Err(self.misuse("no film was prepared")) };
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(pixels);
        self.copy_rows(rows, &film.sums, &film.staging, bytes.len())?;
        self.copy(&film.unwritten, &film.sums, "erasing the film")?;
        self.gpu.read(&film.staging, bytes, "reading the film")
    }

    fn read_aovs(&mut self, rows: &RowSet, guides: &mut [AovSums]) -> Result<(), BackendError> {
        let Some(film) = &self.film else { return Err(self.misuse("no film was prepared")) };
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(guides);
        self.copy_rows(rows, &film.aovs.records, &film.aovs.staging, bytes.len())?;
        self.erase_aovs(film)?;
        self.gpu.read(&film.aovs.staging, bytes, "reading the AOV sums")
    }

    fn write_film(&mut self, film: &[PixelSums], guides: &[AovSums]) -> Result<(), BackendError> {
        self.write_sums(film, guides)
    }

    #[allow(unsafe_code, reason = "the contract of the trait")]
    unsafe fn denoise(&mut self, passes: &[Pass]) -> Result<Vec<Duration>, BackendError> {
        self.denoise_film(passes)
    }

    fn read_denoised(&mut self, image: usize, pixels: &mut [FilteredPixel]) -> Result<(), BackendError> {
        let Some(denoiser) = &self.denoiser else { return Err(self.misuse("nothing was denoised")) };
        denoiser.read(&self.gpu, image, pixels)
    }

    #[allow(unsafe_code, reason = "the contract of the trait")]
    unsafe fn display(
        &mut self,
        frame: &DisplayLaunch,
        to: &mut RowTarget<'_>,
    ) -> Result<Duration, BackendError> {
        self.display_frame(frame, to)
    }

    fn first_hits(&mut self, launch: &Launch, hits: &mut [FirstHit]) -> Result<(), BackendError> {
        self.pipelines.compile(&self.gpu, FIRST_HIT, self.math)?;
        let bytes = size_of_val(hits) as u64;
        let output = self.buffer(bytes, BufferUsages::STORAGE | BufferUsages::COPY_SRC, "the first hits")?;
        let staging =
            self.buffer(bytes, BufferUsages::MAP_READ | BufferUsages::COPY_DST, "the first hits")?;
        let no_carries = self.buffer(0, BufferUsages::STORAGE, "the first hits")?;
        let no_guides = self.buffer(0, BufferUsages::STORAGE, "the first hits")?;
        self.dispatch(FIRST_HIT, launch.params(), [&output, &no_carries, &no_guides])?;
        self.copy(&output, &staging, "reading first hits")?;
        self.gpu.read(&staging, bytemuck::cast_slice_mut(hits), "reading first hits")
    }
}
